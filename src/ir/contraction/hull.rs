//! A box made smaller by values: hull consistency.

use smallvec::SmallVec;

use super::contractor::{Angle, Contractor, SCRATCH, Scratch, Wanted};
use super::forms;
use super::linear::LinearForm;
use super::quadric::ellipsoid;
use super::sets::{Contracted, part_of_angle, parts_of_angle};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::bounds::range::Region;
use crate::ir::graph::Node;

/// Choices of the parts of angles that are looked at.
const MOST_CHOICES: u32 = 32;

impl Contractor {
    /// Cuts off parts of a box where the formula is not positive. With `found` it also returns the values
    /// that it has found for the linear forms in the formula.
    pub fn contract(
        &self,
        wanted: &Wanted<'_>,
        space: &mut Aabb,
        found: Option<&mut Vec<LinearForm>>,
    ) -> Contracted {
        if found.is_none() && !self.angles.is_empty() {
            return self.contract_beside_cuts(wanted, space);
        }
        self.contract_given(&[], wanted, space, found)
    }

    /// Cuts off parts of a box in which angles may jump: what is left for each part of them is found alone.
    fn contract_beside_cuts(&self, wanted: &Wanted<'_>, space: &mut Aabb) -> Contracted {
        SCRATCH.with_borrow_mut(|scratch| {
            let before = *space;
            let region = Region { space: &before, ..wanted.region };
            scratch.known.clear();
            if self.forward(&region, scratch).is_none() {
                return Contracted::Nowhere;
            }
            let cuts = self.cuts(scratch);
            let operands = |angle: &Angle| [angle.a, angle.b].map(|node| scratch.values[node.index()]);
            let ranges: Vec<[Interval; 2]> = self.angles.iter().map(operands).collect();
            let choices: u32 = cuts.iter().map(|(_, parts)| parts).product();
            let (mut hull, mut filled) = (Aabb::EMPTY, 0);
            for choice in 0..choices {
                self.choose(&cuts, &ranges, choice, &mut scratch.known);
                let mut own = before;
                match self.pass(&region, wanted.negated, scratch) {
                    None => {}
                    Some(true) => {
                        filled += 1;
                        hull = hull.union(&own);
                    }
                    Some(false) if self.read_box(&scratch.values, &mut own).is_some() => {
                        hull = hull.union(&own)
                    }
                    Some(false) => {}
                }
            }
            if filled == choices {
                return Contracted::Everywhere;
            }
            *space = hull;
            if hull.is_empty() { Contracted::Nowhere } else { Contracted::Somewhere }
        })
    }

    /// What a choice of a part of each cut says of its angle and of the number whose sign the angle has.
    fn choose(
        &self,
        cuts: &[(Angle, u32)],
        ranges: &[[Interval; 2]],
        mut choice: u32,
        known: &mut Vec<(Node, Interval)>,
    ) {
        known.clear();
        for &(cut, parts) in cuts {
            let part = choice % parts;
            choice /= parts;
            let (mut half, is_below) = (Interval::ALL, 2 * part < parts);
            if is_below {
                half.hi = 0.0;
            } else {
                half.lo = 0.0;
            }
            known.push((cut.a, half));
            for (angle, &ranges) in self.angles.iter().zip(ranges) {
                if angle.node == cut.node {
                    known.push((angle.node, part_of_angle(ranges, (part, parts))));
                } else if angle.a == cut.a {
                    known.push((angle.node, half));
                }
            }
        }
        known.sort_by_key(|(node, _)| node.index());
    }

    /// A few angles that jump in a box, at the zeros of different numbers, and the number of their parts.
    fn cuts(&self, scratch: &Scratch) -> SmallVec<[(Angle, u32); 2]> {
        let mut cuts: SmallVec<[(Angle, u32); 2]> = SmallVec::new();
        let mut choices = 1;
        for angle in &self.angles {
            let [a, b] = [angle.a, angle.b].map(|node| scratch.values[node.index()]);
            let is_new = cuts.iter().all(|(cut, _)| cut.a != angle.a);
            let parts = parts_of_angle(b);
            if a.contains(0.0) && b.lo <= 0.0 && is_new && choices * parts <= MOST_CHOICES {
                choices *= parts;
                cuts.push((*angle, parts));
            }
        }
        cuts
    }

    /// Cuts off parts of a box in which linear forms of other formulas have known ranges, too.
    pub fn contract_given(
        &self,
        given: &[LinearForm],
        wanted: &Wanted<'_>,
        space: &mut Aabb,
        found: Option<&mut Vec<LinearForm>>,
    ) -> Contracted {
        SCRATCH.with_borrow_mut(|scratch| {
            let before = *space;
            let region = Region { space: &before, ..wanted.region };
            scratch.known.clear();
            if !given.is_empty() && self.forward(&region, scratch).is_some() {
                forms::bound(self, &self.forms, given, &before, scratch);
            }
            match self.pass(&region, wanted.negated, scratch) {
                None => Contracted::Nowhere,
                Some(true) => Contracted::Everywhere,
                Some(false) => match self.read_box(&scratch.values, space) {
                    None => Contracted::Nowhere,
                    Some(()) => {
                        let Some(found) = found else { return Contracted::Somewhere };
                        forms::collect(self, &self.forms, scratch, found);
                        if self.is_quadric
                            && let Some(around) = ellipsoid(
                                (&self.rules, &self.degrees),
                                self.root(),
                                &scratch.values,
                                wanted.negated,
                            )
                        {
                            *space = space.intersection(&around);
                        }
                        if space.is_empty() { Contracted::Nowhere } else { Contracted::Somewhere }
                    }
                },
            }
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::linear::{contract_linear, contract_linear_around};
    use super::*;
    use crate::ir::graph::{Axis, Graph};
    use crate::ir::{Binary, Interpreter, Unary, UnaryFunction};
    use glam::DVec3;
    use proptest::prelude::*;

    const AXES: [Axis; 3] = Axis::SPACE;

    /// Random formulas: each step applies an operation to two of the nodes made before.
    pub fn formula(steps: &[(usize, usize, usize, f64)]) -> (Graph, Node) {
        let mut graph = Graph::default();
        let mut nodes: Vec<Node> = AXES.iter().map(|&axis| graph.coordinate(axis)).collect();
        let unary: Vec<Unary> = Unary::all().collect();
        let binary: Vec<Binary> = Binary::all().collect();
        let count = binary.len();
        for &(op, i, j, number) in steps {
            let (a, b) = (nodes[nodes.len() - 1 - i % nodes.len()], nodes[j % nodes.len()]);
            let constant = graph.constant(number);
            // plain minima and maxima are made only of operands that are known to be numbers
            let binary = |op: usize| match binary[op] {
                Binary::PlainMin => Binary::Min,
                Binary::PlainMax => Binary::Max,
                other => other,
            };
            let node = match op % (unary.len() + 2 * count) {
                op if op < unary.len() => graph.unary(unary[op], a),
                op if op < unary.len() + count => graph.binary(binary(op - unary.len()), a, b),
                op => graph.binary(binary(op - unary.len() - count), a, constant),
            };
            nodes.push(node);
        }
        (graph, nodes[nodes.len() - 1])
    }

    /// Contracts a box in all ways, and compares with the formula at points, whose coordinates are parts of
    /// its sides.
    fn cuts_off_no_point(
        steps: &[(usize, usize, usize, f64)],
        space: Aabb,
        points: &[[f64; 3]],
        negated: bool,
    ) -> Result<(), TestCaseError> {
        let (graph, root) = formula(steps);
        let (interpreter, contractor) = (Interpreter::new(&graph, &[root]), Contractor::new(&graph, root));
        let wanted = Wanted { region: Region::of(&space), negated };
        let mut forms = Vec::new();
        let mut left = space;
        let mut verdict = contractor.contract(&wanted, &mut left, Some(&mut forms));
        if verdict == Contracted::Somewhere && !contract_linear(&forms, &mut left) {
            verdict = Contracted::Nowhere;
        }
        if verdict == Contracted::Somewhere {
            let origin = left.centre();
            forms.clear();
            for contractor in [&contractor, &contractor] {
                verdict = contractor.contract_by_slopes(&wanted, &mut left, (origin, &mut forms));
            }
            if verdict == Contracted::Somewhere && !contract_linear_around(origin, &forms, &mut left) {
                verdict = Contracted::Nowhere;
            }
        }
        for &at in points {
            let p = (space.min + space.size() * DVec3::from_array(at)).clamp(space.min, space.max);
            let mut omega = [0.0];
            interpreter.eval_f64(p.to_array(), &mut omega);
            let inside = if negated { omega[0] < 0.0 } else { omega[0] > 0.0 };
            match verdict {
                Contracted::Nowhere => prop_assert!(!inside, "{p} is inside, {omega:?}"),
                Contracted::Everywhere => prop_assert!(inside, "{p} is not inside, {omega:?}"),
                Contracted::Somewhere => prop_assert!(!inside || left.contains(p), "{p} not in {left:?}"),
            }
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3000))]
        /// Whatever the operations: a point at which the formula is positive is never cut off.
        #[test]
        fn no_point_is_cut_off(
            steps in prop::collection::vec((0..200_usize, 0..4_usize, 0..9_usize, -3.0..3.0f64), 1..9),
            lo in prop::array::uniform3(-3.0..2.0f64),
            size in prop::array::uniform3(0.0..4.0f64),
            points in prop::collection::vec(prop::array::uniform3(0.0..=1.0f64), 24),
            negated: bool,
        ) {
            let min = DVec3::from_array(lo);
            let space = Aabb::new(min, min + DVec3::from_array(size));
            cuts_off_no_point(&steps, space, &points, negated)?;
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        /// Whatever the operations: no gradient in a box is outside the slopes.
        #[test]
        fn slopes_hold_all_gradients(
            steps in prop::collection::vec((0..200_usize, 0..4_usize, 0..9_usize, -3.0..3.0f64), 1..9),
            lo in prop::array::uniform3(-3.0..2.0f64),
            size in prop_oneof![prop::array::uniform3(0.0..1.0f64), prop::array::uniform3(0.0..0.01f64)],
            at in prop::array::uniform3(0.0..=1.0f64),
        ) {
            let (mut graph, root) = formula(&steps);
            let min = DVec3::from_array(lo);
            let space = Aabb::new(min, min + DVec3::from_array(size));
            let slopes = Contractor::new(&graph, root).slopes(&Region::of(&space));
            let gradient = crate::ir::gradient(&mut graph, root);
            let p = (space.min + space.size() * DVec3::from_array(at)).clamp(space.min, space.max);
            let all: Vec<Node> = graph.nodes().map(|(node, _)| node).collect();
            let mut values = vec![0.0; all.len()];
            Interpreter::new(&graph, &all).eval_f64(p.to_array(), &mut values);
            // the rounding of the terms of a gradient
            let slack = 1e-12 * values.iter().fold(1.0, |most: f64, value| most.max(value.abs()));
            for (node, slope) in gradient.into_iter().zip(slopes.into_iter().flatten()) {
                let found = values[node.index()];
                let holds = found.is_nan() || slope.lo - slack <= found && found <= slope.hi + slack;
                prop_assert!(holds, "{found:e} not in {slope:?}");
            }
        }
    }

    /// Where a number is infinite, its factors, dividends and exponents are not restricted.
    #[test]
    fn infinite_values_cut_off_nothing() {
        type Steps = &'static [(usize, usize, usize, f64)];
        let cases: [(Steps, [f64; 3], [f64; 3], bool); 6] = [
            // max(−0^z·0, x) with z < 0: 0·∞
            (
                &[(47, 1, 0, 0.0), (35, 0, 2, 0.0), (21, 0, 3, 0.0), (0, 0, 0, 0.0), (28, 0, 7, 0.0)],
                [0.59, 0.0, -2.6],
                [0.0, 0.17, 0.0],
                false,
            ),
            // (ln 0)^0.07 = (−∞)^0.07
            (&[(4, 2, 0, 0.0), (13, 0, 0, 0.0), (53, 0, 0, 0.066)], [0.0; 3], [0.0; 3], false),
            // ln(−5/−0^x) with x < 0: −5/−∞ is 0
            (
                &[
                    (3, 1, 0, 0.0),
                    (30, 2, 2, 0.0),
                    (31, 1, 0, 0.0),
                    (35, 1, 0, 0.0),
                    (0, 0, 0, 0.0),
                    (22, 2, 6, 0.0),
                    (13, 0, 0, 0.0),
                ],
                [-2.7, 0.0, 0.0],
                [0.0, 0.0, 2.9],
                true,
            ),
            // max(round(cos y), −1.75)^sign(cos y) = (−0)^−1 = −∞
            (
                &[(7, 1, 0, 0.0), (5, 0, 0, 0.0), (3, 1, 0, 0.0), (44, 1, 0, -1.75), (35, 0, 5, 0.0)],
                [0.0, -1.66, 0.0],
                [0.0; 3],
                true,
            ),
            // max(sinh(ln 0) ∨ ln 0, 0.9) and the same with a weight
            (
                &[(29, 3, 0, 0.0), (13, 0, 0, 0.0), (16, 0, 0, 0.0), (32, 0, 4, 0.0), (44, 0, 0, 0.89)],
                [0.0; 3],
                [0.0, 0.0, 3.4],
                false,
            ),
            (
                &[(29, 3, 0, 0.0), (13, 0, 0, 0.0), (16, 0, 0, 0.0), (33, 0, 4, 0.0), (44, 0, 0, 0.89)],
                [0.0; 3],
                [0.0, 0.0, 3.4],
                false,
            ),
        ];
        let points: Vec<[f64; 3]> = (0..9).map(|i| [f64::from(i) / 8.0; 3]).collect();
        for (i, (steps, lo, size, negated)) in cases.into_iter().enumerate() {
            let min = DVec3::from_array(lo);
            let space = Aabb::new(min, min + DVec3::from_array(size));
            cuts_off_no_point(steps, space, &points, negated).unwrap_or_else(|e| panic!("case {i}: {e}"));
        }
    }

    #[track_caller]
    fn check(build: impl Fn(&mut Graph, [Node; 3]) -> Node, expected: [[f64; 2]; 3]) {
        let mut graph = Graph::default();
        let coordinates = AXES.map(|axis| graph.coordinate(axis));
        let root = build(&mut graph, coordinates);
        let contractor = Contractor::new(&graph, root);
        let mut space = Aabb::new(DVec3::splat(-1e75), DVec3::splat(1e75));
        let wanted = Wanted { region: Region::of(&Aabb::EMPTY), negated: false };
        let mut forms = Vec::new();
        assert_eq!(contractor.contract(&wanted, &mut space, Some(&mut forms)), Contracted::Somewhere);
        assert!(contract_linear(&forms, &mut space));
        for (axis, [lo, hi]) in expected.into_iter().enumerate() {
            let found = [space.min[axis], space.max[axis]];
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs().max(1.0);
            assert!(near(found[0], lo) && near(found[1], hi), "{space:?}");
        }
    }

    #[test]
    fn operations_are_solved_for_their_operands() {
        let all = [-1e75, 1e75];
        // 1 − x² − |y| − √z: each coordinate by itself
        check(
            |g, [x, y, z]| {
                let one = g.constant(1.0);
                let (x2, y1, z_root) =
                    (g.binary(Binary::Mul, x, x), g.unary(Unary::Abs, y), g.unary(Unary::Sqrt, z));
                let a = g.binary(Binary::Sub, one, x2);
                let b = g.binary(Binary::Sub, a, y1);
                g.binary(Binary::Sub, b, z_root)
            },
            [[-1.0, 1.0], [-1.0, 1.0], [0.0, 1.0]],
        );
        // 8 − x³ ∧ eʸ − 1
        check(
            |g, [x, y, _]| {
                let (eight, one) = (g.constant(8.0), g.constant(1.0));
                let square = g.binary(Binary::Mul, x, x);
                let cube = g.binary(Binary::Mul, square, x);
                let a = g.binary(Binary::Sub, eight, cube);
                let exp = g.unary(UnaryFunction::Exp.into(), y);
                let b = g.binary(Binary::Sub, exp, one);
                g.binary(Binary::And, a, b)
            },
            [[-1e75, 2.0], [0.0, 1e75], all],
        );
        // 1 − (0.6x + 0.8y)² − (0.6y − 0.8x)²: only both forms together bound x and y
        let reach = 1.4;
        check(
            |g, [x, y, _]| {
                let [one, c, s] = [1.0, 0.6, 0.8].map(|number| g.constant(number));
                let mut form = |op, a, p, b, q| {
                    let (a, b) = (g.binary(Binary::Mul, a, p), g.binary(Binary::Mul, b, q));
                    let form = g.binary(op, a, b);
                    g.binary(Binary::Mul, form, form)
                };
                let (u, v) = (form(Binary::Add, c, x, s, y), form(Binary::Sub, c, y, s, x));
                let a = g.binary(Binary::Sub, one, u);
                g.binary(Binary::Sub, a, v)
            },
            [[-reach, reach], [-reach, reach], all],
        );
    }
}
