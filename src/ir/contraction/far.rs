//! The sign of a formula far from the origin.

use super::contractor::{Contractor, Operand, SCRATCH, Scratch, Wanted};
use super::forward;
use super::growth::{Growth, Scales};
use super::rule::{Degree, Rule};
use super::sets::{Contracted, meet, part_of_angle, parts_of_angle};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::bounds::range::{Affine, Region};
use crate::ir::function::BinaryFunction;
use crate::ir::graph::{Axis, Expr, Node};
use crate::ir::op::{Binary, Unary};

/// Choices of the parts of several angles.
const MOST_CHOICES: usize = 64;

/// Points far from the origin: s·u for all scales s and all directions u.
#[derive(Debug, Clone, Copy)]
pub struct Far {
    /// A box on a face of the cube with corners at ±1.
    pub directions: Aabb,
    /// The scales.
    pub scales: Scales,
}

impl Far {
    /// A box around the points.
    pub fn around(&self) -> Aabb {
        let [near, far] = [self.scales.from, self.scales.to].map(f64::exp2);
        let (min, max) = (self.directions.min, self.directions.max);
        Aabb::new((min * near).min(min * far), (max * near).max(max * far))
    }
}

/// The angles that jump among the points, or go all around, and the parts of them that are looked at alone.
#[derive(Default)]
struct Cuts {
    /// The node of each, the number of its parts, and the one that is meant.
    parts: Vec<(usize, u32, u32)>,
    /// The nodes that were met, with the number of their parts.
    met: Vec<(usize, u32)>,
    /// Whether no point has angles in the parts that are meant.
    is_impossible: bool,
}

impl Cuts {
    /// The angle atan2(a, b) of a node that jumps.
    fn part(&mut self, node: usize, angle: Interval, [a, b]: [Interval; 2]) -> Interval {
        self.met.push((node, parts_of_angle(b)));
        let Some(&(_, count, part)) = self.parts.iter().find(|(of, ..)| *of == node) else { return angle };
        let found = meet(angle, part_of_angle([a, b], (part, count)));
        self.is_impossible |= found.is_none();
        found.unwrap_or(angle)
    }

    /// All choices of a part of each angle that was met; of some of them, where there are many.
    fn choices(&self) -> Vec<Self> {
        let mut choices = vec![Self::default()];
        for &(node, count) in &self.met {
            if choices.len() * count as usize > MOST_CHOICES {
                break;
            }
            let with = |choice: &Self, part: u32| Self {
                parts: [&choice.parts[..], &[(node, count, part)]].concat(),
                ..Self::default()
            };
            choices =
                choices.iter().flat_map(|choice| (0..count).map(move |part| with(choice, part))).collect();
        }
        choices
    }
}

impl Contractor {
    /// Where a formula is positive among far points, or negative, as is wanted.
    pub fn far(&self, wanted: &Wanted<'_>, far: &Far) -> Contracted {
        SCRATCH.with_borrow_mut(|scratch| {
            scratch.known.clear();
            let around = far.around();
            if self.forward(&Region { space: &around, ..wanted.region }, scratch).is_none() {
                return Contracted::Nowhere;
            }
            let mut cuts = Cuts::default();
            let verdict = self.sign_far(wanted.negated, far, scratch, &mut cuts);
            if verdict != Contracted::Somewhere || cuts.met.is_empty() {
                return verdict;
            }
            let mut choices = cuts.choices();
            let is_nowhere = |cuts: &mut Cuts| {
                let verdict = self.sign_far(wanted.negated, far, scratch, cuts);
                cuts.is_impossible || verdict == Contracted::Nowhere
            };
            if choices.iter_mut().all(is_nowhere) { Contracted::Nowhere } else { Contracted::Somewhere }
        })
    }

    fn sign_far(&self, negated: bool, far: &Far, scratch: &Scratch, cuts: &mut Cuts) -> Contracted {
        let root = self.root().index();
        let mut all: Vec<Growth> = Vec::with_capacity(root + 1);
        for i in 0..=root {
            let values = scratch.values[i];
            let is_open = self.operands[i].iter().any(|&Operand { node, needed }| {
                !needed && (scratch.may_fail[node.index()] || all[node.index()].may_fail(far.scales))
            });
            let growth = if is_open || self.degrees[i] == Degree::Number {
                Growth::number(values)
            } else {
                match self.growth(i, far, &all, cuts) {
                    Some(growth) => growth,
                    // it is undefined
                    None if self.needed[i] => return Contracted::Nowhere,
                    None => Growth::UNKNOWN,
                }
            };
            all.push(growth.within(values, far.scales));
        }
        let factor = if negated { -all[root].factor } else { all[root].factor };
        if factor.hi < 0.0 {
            Contracted::Nowhere
        } else if factor.lo > 0.0 && !scratch.may_fail[root] && !all[root].may_fail(far.scales) {
            Contracted::Everywhere
        } else {
            Contracted::Somewhere
        }
    }

    /// How a node grows; `None` if it is undefined at all points.
    fn growth(&self, i: usize, far: &Far, all: &[Growth], cuts: &mut Cuts) -> Option<Growth> {
        let scales = far.scales;
        let of = |node: Node| all[node.index()];
        match self.rules[i] {
            Rule::Power { of: base, exponent } => Some(of(base).to_the(exponent, scales)),
            Rule::Slab { of: e, first, second } => {
                let line = |Affine { slope, offset, minus }: Affine| {
                    let line = if slope < 0.0 { of(e).negated() } else { of(e) };
                    match offset.map(of) {
                        None => line,
                        Some(by) if minus => line.plus(by.negated(), scales),
                        Some(by) => line.plus(by, scales),
                    }
                };
                Some(line(first).times(line(second), scales))
            }
            Rule::Plain(Expr::Coordinate(axis)) => {
                let Aabb { min, max } = far.directions;
                let axis = match axis {
                    Axis::X => 0,
                    Axis::Y => 1,
                    Axis::Z => 2,
                    Axis::T => return Some(Growth::UNKNOWN),
                };
                Some(Growth::coordinate(Interval { lo: min[axis], hi: max[axis] }))
            }
            Rule::Plain(Expr::Unary(op, a)) => unary(op, of(a), scales),
            Rule::Plain(Expr::Binary(op, a, b)) => binary(op, [of(a), of(b)], scales, (i, cuts)),
            // what is known of them does not grow
            Rule::Plain(Expr::Lookup(..) | Expr::Constant(_) | Expr::Parameter(_) | Expr::Uniform(_)) => {
                Some(Growth::UNKNOWN)
            }
        }
    }
}

fn unary(op: Unary, a: Growth, scales: Scales) -> Option<Growth> {
    let between = |lo: f64, hi: f64| Growth::number(Interval { lo, hi });
    match op {
        Unary::Neg => Some(a.negated()),
        Unary::Abs => Some(a.abs()),
        Unary::Sqrt => a.real_power(0.5, scales),
        Unary::Floor => Some(a.plus(between(-1.0, 0.0), scales)),
        Unary::Round => Some(a.plus(between(-0.5, 0.5), scales)),
        Unary::Sign if a.factor.lo > 0.0 => Some(between(1.0, 1.0)),
        Unary::Sign if a.factor.hi < 0.0 => Some(between(-1.0, -1.0)),
        Unary::Sign => Some(between(-1.0, 1.0)),
        Unary::Call(_) => forward::unary(op, a.values(scales)).range.map(Growth::number),
    }
}

fn binary(
    op: Binary,
    [a, b]: [Growth; 2],
    scales: Scales,
    (node, cuts): (usize, &mut Cuts),
) -> Option<Growth> {
    match op {
        Binary::Add => Some(a.plus(b, scales)),
        Binary::Sub => Some(a.plus(b.negated(), scales)),
        Binary::Mul => Some(a.times(b, scales)),
        Binary::MulOrZero if b.factor.contains(0.0) && a.may_fail(scales) => Some(Growth::UNKNOWN),
        Binary::MulOrZero => Some(a.times(b, scales)),
        Binary::Div | Binary::DivOrZero => Some(a.over(b, scales)),
        Binary::And | Binary::Min | Binary::PlainMin => Some(Growth::smaller(op, a, b, scales)),
        Binary::Or => Some(Growth::smaller(Binary::And, a.negated(), b.negated(), scales).negated()),
        Binary::Max | Binary::PlainMax => {
            Some(Growth::smaller(Binary::Min, a.negated(), b.negated(), scales).negated())
        }
        Binary::MinWeight | Binary::MaxWeight | Binary::AndWeight | Binary::OrWeight => {
            Some(Growth::of_directions(op, a, b, scales))
        }
        Binary::Call(BinaryFunction::Atan2) => {
            let angle = Growth::of_directions(op, a, b, scales);
            let jumps = a.factor.contains(0.0) && b.factor.lo <= 0.0;
            let is_known = !a.may_fail(scales) && !b.may_fail(scales);
            let (factors, _) = Growth::aligned(a, b, scales);
            let part = |cuts: &mut Cuts| Growth::number(cuts.part(node, angle.factor, factors));
            Some(if jumps && is_known { part(cuts) } else { angle })
        }
        Binary::Call(BinaryFunction::Pow) if b.factor.lo == b.factor.hi && b.degree == 0.0 => {
            match forward::whole_exponent(b.factor) {
                Some(exponent) => Some(a.to_the(exponent, scales)),
                None if b.factor.lo.fract() == 0.0 => Some(Growth::UNKNOWN),
                None => a.real_power(b.factor.lo, scales),
            }
        }
        Binary::Call(BinaryFunction::Pow) => {
            forward::binary(op, a.values(scales), b.values(scales)).range.map(Growth::number)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::hull::tests::formula;
    use super::*;
    use crate::ir::{Graph, Interpreter, UnaryFunction};
    use glam::DVec3;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        /// Whatever the operations: what is said of far points holds at each of them, however far.
        #[test]
        fn the_sign_far_out_is_that_of_its_points(
            steps in prop::collection::vec((0..200_usize, 0..4_usize, 0..9_usize, -3.0..3.0f64), 1..9),
            (axis, upper) in (0..3_usize, any::<bool>()),
            lo in prop::array::uniform3(-1.0..1.0f64),
            size in prop_oneof![prop::array::uniform3(0.0..0.5f64), prop::array::uniform3(0.0..0.01f64)],
            (from, height) in (-100.0..200.0f64, prop_oneof![0.0..300.0f64, 0.0..3.0f64]),
            points in prop::collection::vec((prop::array::uniform3(0.0..=1.0f64), 0.0..=1.0f64), 24),
            negated: bool,
        ) {
            let (graph, root) = formula(&steps);
            let mut min = DVec3::from_array(lo);
            let mut max = (min + DVec3::from_array(size)).min(DVec3::ONE);
            (min[axis], max[axis]) = if upper { (1.0, 1.0) } else { (-1.0, -1.0) };
            let directions = Aabb::new(min, max);
            let scales = Scales { from: from.round(), to: (from + height).min(250.0).max(from).round() };
            let wanted = Wanted { region: Region::of(&Aabb::EMPTY), negated };
            let verdict = Contractor::new(&graph, root).far(&wanted, &Far { directions, scales });
            let interpreter = Interpreter::new(&graph, &[root]);
            for (at, height) in points {
                let direction = (min + (max - min) * DVec3::from_array(at)).clamp(min, max);
                let p = direction * (scales.from + (scales.to - scales.from) * height).exp2();
                let mut omega = [0.0];
                interpreter.eval_f64(p.to_array(), &mut omega);
                let inside = if negated { omega[0] < 0.0 } else { omega[0] > 0.0 };
                match verdict {
                    Contracted::Nowhere => prop_assert!(!inside, "{p} is inside, {omega:?}"),
                    Contracted::Everywhere => prop_assert!(inside, "{p} is not inside, {omega:?}"),
                    Contracted::Somewhere => {}
                }
            }
        }
    }

    /// (sinh z)^0.57 is no number for negative z, and infinite as soon as programs find −∞ for sinh z.
    #[test]
    fn powers_of_what_is_infinite_decide_nothing() {
        let mut graph = Graph::default();
        let (z, exponent) = (graph.coordinate(Axis::Z), graph.constant(0.57));
        let sinh = graph.unary(UnaryFunction::Sinh.into(), z);
        let root = graph.binary(BinaryFunction::Pow.into(), sinh, exponent);
        let directions = Aabb::new(DVec3::NEG_Z, DVec3::NEG_Z);
        let far = Far { directions, scales: Scales { from: 10.0, to: 100.0 } };
        let wanted = Wanted { region: Region::of(&Aabb::EMPTY), negated: false };
        assert_eq!(Contractor::new(&graph, root).far(&wanted, &far), Contracted::Somewhere);
    }

    /// x·10⁻³⁰⁰·x¹⁰ overflows before it is larger than x⁶ − 1 where it stands: programs find the other sign there.
    #[test]
    fn a_product_that_overflows_early_decides_nothing() {
        let mut graph = Graph::default();
        let x = graph.coordinate(Axis::X);
        let small = graph.constant(1e-300);
        let power = |graph: &mut Graph, exponent: u32| {
            (1..exponent).fold(x, |product, _| graph.binary(Binary::Mul, product, x))
        };
        let tenth = power(&mut graph, 10);
        let early = graph.binary(Binary::Mul, tenth, small);
        let sixth = power(&mut graph, 6);
        let root = graph.binary(Binary::Sub, early, sixth);
        let contractor = Contractor::new(&graph, root);
        let wanted = Wanted { region: Region::of(&Aabb::EMPTY), negated: false };
        let directions = Aabb::new(DVec3::new(1.0, -1.0, -1.0), DVec3::ONE);
        let verdict =
            |from: f64, to: f64| contractor.far(&wanted, &Far { directions, scales: Scales { from, to } });
        // 10⁻³⁰⁰·x⁴ < 1 up to x = 10⁷⁵, but x¹⁰ is infinite from 10³¹ on
        assert_eq!(verdict(10.0, 90.0), Contracted::Nowhere);
        assert_eq!(verdict(10.0, 120.0), Contracted::Somewhere);
    }
}
