//! Hull consistency over a whole graph: values forwards, what they leave of their operands backwards.

use std::cell::RefCell;

use glam::DVec3;

use super::forward::{POSITIVE, numbers};
use super::linear::{self, LinearForm};
use super::rule::{Degree, Rule};
use super::{Contracted, backward, meet, slopes};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::bounds::range::{Affine, Region};
use crate::ir::graph::{Axis, Expr, Graph, Node};

/// A graph prepared for contraction.
#[derive(Debug, Clone)]
pub struct Contractor {
    pub(super) rules: Vec<Rule>,
    pub(super) degrees: Vec<Degree>,
    root: Node,
    /// Whether the root is a number only if the node is.
    needed: Vec<bool>,
    /// The operands of each node that it needs.
    needs: Vec<[bool; 2]>,
    /// Linear forms that something else is computed from, or the root.
    forms: Vec<Node>,
    coordinates: [Option<Node>; 3],
}

/// What is asked of a formula.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// Time, and the numbers that the formula takes. Its space is not used.
    pub region: Region<'a>,
    /// Whether the formula is to be negative instead of positive.
    pub negated: bool,
}

/// Intervals of the nodes, kept between calls.
#[derive(Default)]
pub(super) struct Scratch {
    pub values: Vec<Interval>,
    /// Whether a node may be undefined somewhere.
    pub may_fail: Vec<bool>,
    pub slopes: Vec<[Interval; 3]>,
    pub linear: Vec<[Interval; 4]>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

impl Contractor {
    /// Prepares a root of a graph.
    pub fn new(graph: &Graph, root: Node) -> Self {
        let rules = Rule::all(graph);
        let mut degrees: Vec<Degree> = Vec::with_capacity(rules.len());
        for rule in &rules {
            degrees.push(rule.degree(|node| degrees[node.index()]));
        }
        let needs = rules.iter().map(|rule| {
            let needed: Vec<Node> = rule.needed(graph).collect();
            let mut flags = [false; 2];
            for (flag, operand) in flags.iter_mut().zip(rule.operands()) {
                *flag = needed.contains(&operand);
            }
            flags
        });
        let needs: Vec<[bool; 2]> = needs.collect();
        let mut needed = vec![false; rules.len()];
        needed[root.index()] = true;
        let mut read_by_other = vec![false; rules.len()];
        read_by_other[root.index()] = true;
        for i in (0..=root.index()).rev() {
            for (operand, is_needed) in rules[i].operands().zip(needs[i]) {
                needed[operand.index()] |= needed[i] && is_needed;
                read_by_other[operand.index()] |= needed[i] && degrees[i] == Degree::Other;
            }
        }
        let is_form = |&(node, expr): &(Node, Expr)| {
            degrees[node.index()] == Degree::Linear
                && read_by_other[node.index()]
                && needed[node.index()]
                && !matches!(expr, Expr::Coordinate(_))
        };
        let forms = graph.nodes().filter(is_form).map(|(node, _)| node).collect();
        let coordinates = Axis::SPACE.map(|axis| graph.find(Expr::Coordinate(axis)));
        Self { rules, degrees, root, needed, needs, forms, coordinates }
    }

    /// How many nodes a call visits.
    pub fn len(&self) -> usize {
        self.rules.len()
    }

    /// Cuts off parts of a box where the formula is not positive. With `forms` it also tells what it has found
    /// of the linear forms in the formula.
    pub fn contract(
        &self,
        wanted: &Wanted<'_>,
        space: &mut Aabb,
        forms: Option<&mut Vec<LinearForm>>,
    ) -> Contracted {
        SCRATCH.with_borrow_mut(|scratch| {
            let before = *space;
            let region = Region { space: &before, ..wanted.region };
            match self.pass(&region, wanted.negated, scratch) {
                None => Contracted::Nowhere,
                Some(true) => Contracted::Everywhere,
                Some(false) => match self.read_box(&scratch.values, space) {
                    None => Contracted::Nowhere,
                    Some(()) => {
                        if let Some(forms) = forms {
                            linear::collect(self, &self.forms, scratch, forms);
                        }
                        Contracted::Somewhere
                    }
                },
            }
        })
    }

    /// Cuts off what the formula's derivatives exclude. It pays in boxes that are small on the scale of the
    /// formula. `forms` receives what they say of the distance from an origin.
    pub fn contract_by_slopes(
        &self,
        wanted: &Wanted<'_>,
        space: &mut Aabb,
        forms: (DVec3, &mut Vec<LinearForm>),
    ) -> Contracted {
        SCRATCH.with_borrow_mut(|scratch| slopes::contract(self, wanted, space, forms, scratch))
    }

    /// Forwards and backwards. `None` if the root is positive nowhere, true if it is everywhere.
    fn pass(&self, region: &Region<'_>, negated: bool, scratch: &mut Scratch) -> Option<bool> {
        self.forward(region, scratch)?;
        let Scratch { values, may_fail, .. } = scratch;
        let root = self.root.index();
        let signed = if negated { -values[root] } else { values[root] };
        if signed.hi <= 0.0 {
            return None;
        }
        if signed.lo > 0.0 && !may_fail[root] {
            return Some(true);
        }
        let positive = meet(signed, POSITIVE)?;
        values[root] = if negated { -positive } else { positive };
        for i in (0..=root).rev() {
            if self.needed[i] {
                self.backward(i, values)?;
            }
        }
        Some(false)
    }

    /// The numbers that each node may be. `None` if one that the root needs is undefined everywhere.
    pub(super) fn forward(&self, region: &Region<'_>, scratch: &mut Scratch) -> Option<()> {
        let Scratch { values, may_fail, .. } = scratch;
        values.clear();
        may_fail.clear();
        for (i, rule) in self.rules[..=self.root.index()].iter().enumerate() {
            // an operand that is undefined where the node is not says nothing of the node
            let unknown = |node: Node| may_fail[node.index()];
            let is_open = rule.operands().zip(self.needs[i]).any(|(node, needed)| !needed && unknown(node));
            let found = numbers(rule, |node| values[node.index()], region);
            let fails = found.may_fail || rule.operands().any(unknown);
            let value = match found.range {
                Some(range) if !is_open => range,
                None if self.needed[i] && !is_open => return None,
                _ => Interval::ALL,
            };
            values.push(value);
            may_fail.push(fails);
        }
        Some(())
    }

    /// What the value of a node leaves of its operands.
    fn backward(&self, i: usize, values: &mut [Interval]) -> Option<()> {
        let value = values[i];
        match self.rules[i] {
            Rule::Power { of, exponent } => {
                values[of.index()] = backward::power(value, values[of.index()], exponent)?;
            }
            Rule::Slab { of, first, second } => {
                let line = |affine: Affine| (affine.slope, affine.number(|node| values[node.index()]));
                let (first, second) = (line(first), line(second));
                values[of.index()] = backward::slab(value, values[of.index()], first, second)?;
            }
            Rule::Plain(Expr::Unary(op, a)) => {
                values[a.index()] = backward::unary(op, value, values[a.index()])?;
            }
            Rule::Plain(Expr::Binary(op, a, b)) => {
                let [left, right] = backward::binary(op, value, values[a.index()], values[b.index()])?;
                let [needs_a, needs_b] = self.needs[i];
                if a == b {
                    if needs_a && needs_b {
                        values[a.index()] = meet(left, right)?;
                    }
                    return Some(());
                }
                if needs_a {
                    values[a.index()] = left;
                }
                if needs_b {
                    values[b.index()] = right;
                }
            }
            Rule::Plain(Expr::Constant(_) | Expr::Coordinate(_) | Expr::Parameter(_) | Expr::Uniform(_)) => {}
        }
        Some(())
    }

    /// What is left of a box.
    fn read_box(&self, values: &[Interval], space: &mut Aabb) -> Option<()> {
        for (axis, node) in self.coordinates.into_iter().enumerate() {
            let Some(value) = node.and_then(|node| values.get(node.index())) else { continue };
            let left = meet(Interval { lo: space.min[axis], hi: space.max[axis] }, *value)?;
            (space.min[axis], space.max[axis]) = (left.lo, left.hi);
        }
        Some(())
    }

    pub(super) fn root(&self) -> Node {
        self.root
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::{Binary, Interpreter, Unary, UnaryFunction};
    use proptest::prelude::*;

    const AXES: [Axis; 3] = Axis::SPACE;

    /// Random formulas: each step applies an operation to two of the nodes made before.
    fn formula(steps: &[(usize, usize, usize, f64)]) -> (Graph, Node) {
        let mut graph = Graph::default();
        let mut nodes: Vec<Node> = AXES.iter().map(|&axis| graph.coordinate(axis)).collect();
        let unary: Vec<Unary> = Unary::all().collect();
        let binary: Vec<Binary> = Binary::all().collect();
        for &(op, i, j, number) in steps {
            let (a, b) = (nodes[nodes.len() - 1 - i % nodes.len()], nodes[j % nodes.len()]);
            let constant = graph.constant(number);
            let node = match op % (unary.len() + 2 * binary.len()) {
                op if op < unary.len() => graph.unary(unary[op], a),
                op if op < unary.len() + binary.len() => graph.binary(binary[op - unary.len()], a, b),
                op => graph.binary(binary[op - unary.len() - binary.len()], a, constant),
            };
            nodes.push(node);
        }
        (graph, nodes[nodes.len() - 1])
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
            let (graph, root) = formula(&steps);
            let (interpreter, contractor) = (Interpreter::new(&graph, &[root]), Contractor::new(&graph, root));
            let min = DVec3::from_array(lo);
            let space = Aabb::new(min, min + DVec3::from_array(size));
            let wanted = Wanted { region: Region::of(&space), negated };
            let mut forms = Vec::new();
            let mut left = space;
            let mut verdict = contractor.contract(&wanted, &mut left, Some(&mut forms));
            if verdict == Contracted::Somewhere && !linear::contract_linear(&forms, &mut left) {
                verdict = Contracted::Nowhere;
            }
            if verdict == Contracted::Somewhere {
                let origin = left.centre();
                forms.clear();
                for contractor in [&contractor, &contractor] {
                    verdict = contractor.contract_by_slopes(&wanted, &mut left, (origin, &mut forms));
                }
                if verdict == Contracted::Somewhere
                    && !linear::contract_linear_around(origin, &forms, &mut left)
                {
                    verdict = Contracted::Nowhere;
                }
            }
            for at in points {
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
        assert!(linear::contract_linear(&forms, &mut space));
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
