//! Guaranteed ranges: an interval that contains ω of every point of a box.
//!
//! R₀ grows with each operand, so its exact range is reached at the ends of the operands' ranges: two scalar
//! evaluations, widened by four ulp for their rounding (which cannot change their signs). Squares and
//! products of two linear functions of one node (slabs) get their exact range too; elsewhere a node that
//! occurs twice is taken as two independent ones, which is safe but wider.
//!
//! A range holds the exact values of the formula over the reals, and for every node also the values that
//! programs in `f64` find. Rounding never leaves bounds that were rounded outwards, and where squares
//! overflow or underflow R₀ is widened to what its floating-point form then gives. A node that may not be a
//! number has [`Interval::ALL`], and so has every node that uses it. Points whose coordinates are not finite
//! belong to no box.

use std::cell::RefCell;

use super::choice::Choice;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::lookup::Tables;
use crate::ir::op::{Binary, Unary};
use crate::ir::r0;

/// How the range of one node is found, here and in machine code.
#[derive(Debug, Clone, Copy)]
pub enum RangeRule {
    /// By the operation, from the ranges of its operands.
    Plain(Expr),
    /// The product of a node with itself.
    Square(Node),
    /// (p·e + q)·(r·e + s) of one node e.
    Slab { of: Node, first: Affine, second: Affine },
}

/// slope · node ± offset, with slope 1 or −1; the offset is a constant or a parameter.
#[derive(Debug, Clone, Copy)]
pub struct Affine {
    /// 1 or −1.
    pub slope: f64,
    /// `None` for zero.
    pub offset: Option<Node>,
    /// Whether the offset is subtracted.
    pub minus: bool,
}

impl RangeRule {
    /// The rule for a node of a graph.
    pub fn of(graph: &Graph, expr: Expr) -> Self {
        if let Expr::Binary(Binary::Mul, a, b) = expr {
            if a == b {
                return Self::Square(a);
            }
            let itself = |node| (node, Affine { slope: 1.0, offset: None, minus: false });
            let (of_a, of_b) = (affine(graph, a), affine(graph, b));
            // a·(h − a) is a slab of a, whatever a is made of
            for ((of, first), (other, second)) in [(of_a, of_b), (itself(a), of_b), (of_a, itself(b))] {
                if of == other && !is_number(graph, of) {
                    return Self::Slab { of, first, second };
                }
            }
        }
        Self::Plain(expr)
    }

    /// The range of a square or a slab from that of the node it is made of; `None` for other rules.
    pub(in crate::ir) fn over(&self, range: impl Fn(Node) -> Interval) -> Option<Interval> {
        match *self {
            Self::Square(a) => Some(range(a).square()),
            Self::Slab { of, first, second } => {
                let line = |affine: Affine| (affine.slope, affine.number(&range));
                Some(slab(range(of), line(first), line(second)))
            }
            Self::Plain(_) => None,
        }
    }
}

/// The points, times and numbers for which a range is to hold.
#[derive(Debug, Clone, Copy)]
pub struct Region<'a> {
    /// The box.
    pub space: &'a Aabb,
    /// Seconds.
    pub time: Interval,
    /// The values of the graph's parameters.
    pub parameters: &'a [f64],
    /// One range for each number that depends on time alone, see [`Expr::Uniform`].
    pub uniforms: &'a [Interval],
}

impl<'a> Region<'a> {
    /// A box, at any time.
    pub fn of(space: &'a Aabb) -> Self {
        Self { space, time: Interval::ALL, parameters: &[], uniforms: &[] }
    }
}

/// The points to which something is restricted. They fulfil three conditions:
/// - no divisor is nearer to 0 than `least_divisor`, unless it is a constant;
/// - no root is taken of a negative number;
/// - no value of a function of the library is larger than `largest_call`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub least_divisor: f64,
    pub largest_call: f64,
}

/// A graph prepared for the evaluation of ranges.
#[derive(Debug, Clone)]
pub struct RangeEvaluator {
    rules: Vec<RangeRule>,
    /// In the order of the nodes.
    choices: Vec<Choice>,
    root: Node,
    tables: Tables,
}

thread_local! {
    static SCRATCH: RefCell<Vec<Interval>> = const { RefCell::new(Vec::new()) };
}

impl RangeEvaluator {
    /// Prepares a root of a graph.
    pub fn new(graph: &Graph, root: Node) -> Self {
        let rules = graph.nodes().map(|(_, expr)| RangeRule::of(graph, expr)).collect();
        Self { rules, choices: Choice::all(graph), root, tables: graph.tables().clone() }
    }

    /// The range of ω over a box at any time; bounds of the box may be infinite.
    pub fn eval(&self, over: &Aabb) -> Interval {
        self.eval_with(&Region::of(over))
    }

    /// The range over a region.
    pub fn eval_with(&self, region: &Region<'_>) -> Interval {
        SCRATCH.with_borrow_mut(|values| {
            self.fill(region, values, None);
            values[self.root.index()]
        })
    }

    /// The ranges of all nodes, in the graph's order.
    pub fn all(&self, over: &Aabb) -> Vec<Interval> {
        self.all_with(&Region::of(over))
    }

    /// The ranges of all nodes over a region.
    pub fn all_with(&self, region: &Region<'_>) -> Vec<Interval> {
        let mut values = Vec::new();
        self.fill(region, &mut values, None);
        values
    }

    /// The ranges of all nodes over the points of a region that are within limits.
    pub(crate) fn all_within(&self, region: &Region<'_>, limits: Limits) -> Vec<Interval> {
        let mut values = Vec::new();
        self.fill(region, &mut values, Some(limits));
        values
    }

    fn fill(&self, region: &Region<'_>, values: &mut Vec<Interval>, limits: Option<Limits>) {
        let up_to = |most: f64| Interval::new(-most, most);
        let steepest = limits.map(|limits| up_to(1.0 / limits.least_divisor));
        let mut choices = self.choices.iter().peekable();
        values.clear();
        for &rule in &self.rules {
            // a coordinate is always a number, even if nothing else is known of it
            let is_coordinate =
                |node: Node| matches!(self.rules[node.index()], RangeRule::Plain(Expr::Coordinate(_)));
            let unknown = |node: Node| values[node.index()] == Interval::ALL && !is_coordinate(node);
            let value = match rule {
                RangeRule::Square(a) | RangeRule::Slab { of: a, .. } if unknown(a) => Interval::ALL,
                RangeRule::Square(a) => values[a.index()].square(),
                RangeRule::Slab { of, first, second } => {
                    let number = |affine: Affine| affine.number(|node| values[node.index()]);
                    slab(values[of.index()], (first.slope, number(first)), (second.slope, number(second)))
                }
                // whatever the other operand is
                RangeRule::Plain(Expr::Binary(Binary::MulOrZero, _, b)) if is_zero(values[b.index()]) => {
                    Interval::point(0.0)
                }
                RangeRule::Plain(Expr::Unary(_, a)) if unknown(a) => Interval::ALL,
                RangeRule::Plain(Expr::Binary(_, a, b)) if unknown(a) || unknown(b) => Interval::ALL,
                RangeRule::Plain(Expr::Binary(Binary::Div | Binary::DivOrZero, a, b))
                    if let Some(steepest) = steepest
                        && values[b.index()].contains(0.0)
                        && values[b.index()].width() > 0.0 =>
                {
                    values[a.index()] * steepest
                }
                RangeRule::Plain(Expr::Unary(Unary::Sqrt, a))
                    if limits.is_some() && values[a.index()].lo < 0.0 =>
                {
                    Interval::new(0.0, values[a.index()].hi.max(0.0)).sqrt()
                }
                RangeRule::Plain(
                    expr @ (Expr::Unary(Unary::Call(_), _) | Expr::Binary(Binary::Call(_), ..)),
                ) if let Some(limits) = limits => {
                    let (value, most) = (plain(expr, values, region), up_to(limits.largest_call));
                    Interval::new(value.lo.clamp(most.lo, most.hi), value.hi.clamp(most.lo, most.hi))
                }
                RangeRule::Plain(Expr::Lookup(_, at)) if at.into_iter().any(unknown) => Interval::ALL,
                RangeRule::Plain(Expr::Lookup(lookup, at)) => {
                    lookup.range(&self.tables, at.map(|node| values[node.index()]))
                }
                RangeRule::Plain(expr) => plain(expr, values, region),
            };
            let chosen = choices.next_if(|choice| choice.node().index() == values.len());
            let chosen = chosen.and_then(|choice| choice.range(|node| values[node.index()]));
            values.push(chosen.filter(|_| value != Interval::ALL).unwrap_or(value));
        }
    }
}

/// Whether a node has one value: a constant or a parameter.
fn is_number(graph: &Graph, node: Node) -> bool {
    matches!(graph.expr(node), Expr::Constant(_) | Expr::Parameter(_))
}

/// Reads a node as slope · (another node) + offset; only slopes ±1, for which the rounding is that of the
/// written sum. Anything else is 1 · itself.
fn affine(graph: &Graph, node: Node) -> (Node, Affine) {
    let with = |slope, offset, minus| Affine { slope, offset, minus };
    let number = |node| is_number(graph, node);
    match graph.expr(node) {
        Expr::Binary(Binary::Add, a, b) if !number(a) && number(b) => (a, with(1.0, Some(b), false)),
        Expr::Binary(Binary::Add, a, b) if number(a) && !number(b) => (b, with(1.0, Some(a), false)),
        Expr::Binary(Binary::Sub, a, b) if !number(a) && number(b) => (a, with(1.0, Some(b), true)),
        Expr::Binary(Binary::Sub, a, b) if number(a) && !number(b) => (b, with(-1.0, Some(a), false)),
        Expr::Unary(Unary::Neg, a) => (a, with(-1.0, None, false)),
        _ => (node, with(1.0, None, false)),
    }
}

impl Affine {
    /// The number that is added; NaN if it is not known.
    pub(in crate::ir) fn number(self, range: impl Fn(Node) -> Interval) -> f64 {
        let Some(node) = self.offset else { return 0.0 };
        let Interval { lo, hi } = range(node);
        let number = if lo == hi { lo } else { f64::NAN };
        if self.minus { -number } else { number }
    }
}

fn at((slope, offset): (f64, f64), e: Interval) -> Interval {
    let signed = if slope < 0.0 { -e } else { e };
    if offset == 0.0 { signed } else { signed + Interval::point(offset) }
}

/// A product of two linear functions of e has its extremes at the ends of e and at its vertex.
fn slab(e: Interval, first: (f64, f64), second: (f64, f64)) -> Interval {
    if first.1.is_nan() || second.1.is_nan() {
        return Interval::ALL;
    }
    let value = |e: Interval| at(first, e) * at(second, e);
    let mut range = value(Interval::point(e.lo)).hull(value(Interval::point(e.hi)));
    // vertex halfway between the roots −offset/slope
    let roots = (-first.1 * first.0, -second.1 * second.0);
    let vertex = Interval::point(0.5 * roots.0 + 0.5 * roots.1).widened(4);
    if vertex.hi >= e.lo && vertex.lo <= e.hi {
        range = range.hull(value(vertex));
    }
    range
}

fn plain(expr: Expr, values: &[Interval], region: &Region<'_>) -> Interval {
    let Aabb { min, max } = *region.space;
    match expr {
        Expr::Constant(bits) => {
            let value = f64::from_bits(bits);
            Interval::new(value, value)
        }
        Expr::Coordinate(Axis::X) => Interval::new(min.x, max.x),
        Expr::Coordinate(Axis::Y) => Interval::new(min.y, max.y),
        Expr::Coordinate(Axis::Z) => Interval::new(min.z, max.z),
        Expr::Parameter(i) => {
            region.parameters.get(i as usize).map_or(Interval::ALL, |&value| Interval::new(value, value))
        }
        Expr::Coordinate(Axis::T) => region.time,
        Expr::Uniform(i) => region.uniforms.get(i as usize).copied().unwrap_or(Interval::ALL),
        Expr::Unary(op, a) => unary(op, values[a.index()]),
        Expr::Binary(op, a, b) => binary(op, values[a.index()], values[b.index()]),
        // the caller has the tables
        Expr::Lookup(..) => Interval::ALL,
    }
}

pub(in crate::ir) fn unary(op: Unary, a: Interval) -> Interval {
    match op {
        Unary::Neg => -a,
        Unary::Abs => a.abs(),
        Unary::Sqrt => a.sqrt(),
        Unary::Sign | Unary::Floor | Unary::Round => Interval { lo: op.eval(a.lo), hi: op.eval(a.hi) },
        Unary::Call(function) => function.range(a),
    }
}

pub(in crate::ir) fn binary(op: Binary, a: Interval, b: Interval) -> Interval {
    match op {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        // 0·∞, where the one that is infinite has overflowed
        Binary::Mul if a.contains(0.0) && is_infinite(b) || b.contains(0.0) && is_infinite(a) => {
            Interval::ALL
        }
        Binary::Mul => a * b,
        Binary::Div => a / b,
        Binary::DivOrZero => {
            if b.contains(0.0) {
                Interval::ALL
            } else {
                a / b
            }
        }
        Binary::MulOrZero if is_zero(b) => Interval::point(0.0),
        Binary::MulOrZero if b.contains(0.0) => binary(Binary::Mul, a, b).hull(Interval::point(0.0)),
        Binary::MulOrZero => binary(Binary::Mul, a, b),
        Binary::Min | Binary::PlainMin => a.min(b),
        Binary::Max | Binary::PlainMax => a.max(b),
        Binary::And => conjunction(a, b),
        Binary::Or => -conjunction(-a, -b),
        // two infinite operands have no weights
        Binary::AndWeight | Binary::OrWeight if is_infinite(a) && is_infinite(b) => Interval::ALL,
        Binary::MinWeight => minimum_weight(a, b),
        Binary::MaxWeight => minimum_weight(b, a),
        Binary::AndWeight => conjunction_weight(a, b),
        Binary::OrWeight => conjunction_weight(-a, -b),
        Binary::Call(function) => function.range(a, b),
    }
}

pub(in crate::ir) fn is_zero(a: Interval) -> bool {
    a.lo == 0.0 && a.hi == 0.0
}

fn is_infinite(a: Interval) -> bool {
    a.lo == f64::NEG_INFINITY || a.hi == f64::INFINITY
}

/// Operands beyond this have squares whose sum may overflow.
pub(crate) const SQUARES_OVERFLOW: f64 = 6.7e153; // 2⁵¹¹

/// Results below this may have operands whose squares lose digits to underflow.
pub(crate) const SQUARES_UNDERFLOW: f64 = 3.0e-151; // 2⁻⁵⁰⁰

/// The range of u ∧ v: exact at the ends, and what the half-angle form of `ir::r0` makes of extreme operands.
fn conjunction(a: Interval, b: Interval) -> Interval {
    let (first, last) = (r0::and_scaled(a.lo, b.lo), r0::and_scaled(a.hi, b.hi));
    // over a box of a few neighbouring numbers rounding may change their order
    let exact = if last < first { Interval::new(last, first) } else { Interval::new(first, last) }.widened(4);
    let largest = [a.lo, a.hi, b.lo, b.hi].into_iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    if largest > SQUARES_OVERFLOW {
        // √(u² + v²) = ∞: the small branch gives the smaller operand, the other one −∞; ∞ − ∞ and ∞/∞ are NaN
        let opposite = a.hi == f64::INFINITY && b.lo == f64::NEG_INFINITY
            || b.hi == f64::INFINITY && a.lo == f64::NEG_INFINITY;
        if opposite || a.hi == f64::INFINITY && b.hi == f64::INFINITY {
            return Interval::ALL;
        }
        let lo = if a.lo + b.lo > 0.0 { exact.lo } else { f64::NEG_INFINITY };
        return Interval::new(lo, exact.hi.max(a.hi.min(b.hi)));
    }
    // there √(u² + v²) is only known to lie between the larger operand and twice that
    let outwards = |x: f64, away: bool| match (x.abs() < SQUARES_UNDERFLOW, away) {
        (false, _) => x,
        (true, true) => 2.0 * x,
        (true, false) => 0.5 * x,
    };
    Interval::new(outwards(exact.lo, exact.lo < 0.0), outwards(exact.hi, exact.hi > 0.0))
}

/// The share of a in the smaller of a and b.
fn minimum_weight(a: Interval, b: Interval) -> Interval {
    if a.hi < b.lo {
        Interval::point(1.0)
    } else if b.hi < a.lo {
        Interval::point(0.0)
    } else {
        Interval { lo: 0.0, hi: 1.0 }
    }
}

/// How far the weights of R₀ may be from their exact values by rounding, in all its forms.
pub(crate) const WEIGHT_ROUNDING: f64 = 1e-14;

/// The range of 1 − u/√(u² + v²), the derivative of u ∧ v by u.
pub(in crate::ir) fn conjunction_weight(u: Interval, v: Interval) -> Interval {
    let any = Interval { lo: 0.0, hi: 2.0_f64.next_up() };
    let v = v.abs();
    let nearest = v.lo.max(u.lo).max(-u.hi);
    let farthest = v.hi.max(-u.lo).max(u.hi);
    // at the corner the weights take all values; where squares leave the range of numbers the forms differ
    if !(nearest > SQUARES_UNDERFLOW && farthest < SQUARES_OVERFLOW) {
        return any;
    }
    // it falls with u, and grows with |v| where u is positive
    let weight = |u: f64, v: f64| 1.0 - u / (u * u + v * v).sqrt();
    let least = weight(u.hi, if u.hi > 0.0 { v.lo } else { v.hi });
    let most = weight(u.lo, if u.lo > 0.0 { v.hi } else { v.lo });
    Interval { lo: (least - WEIGHT_ROUNDING).max(any.lo), hi: (most + WEIGHT_ROUNDING).min(any.hi) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::{Interpreter, UnaryFunction};
    use glam::DVec3;
    use proptest::prelude::*;

    /// ((x(3−x)) ∧ (0.25 − y² − z²)) ∨ (sin(x) − |y|·z/(2 + cos z))
    fn sample() -> (Graph, Node) {
        let mut g = Graph::default();
        let (x, y, z) = (g.coordinate(Axis::X), g.coordinate(Axis::Y), g.coordinate(Axis::Z));
        let three = g.constant(3.0);
        let rest = g.binary(Binary::Sub, three, x);
        let slab = g.binary(Binary::Mul, x, rest);
        let (y2, z2) = (g.binary(Binary::Mul, y, y), g.binary(Binary::Mul, z, z));
        let quarter = g.constant(0.25);
        let a = g.binary(Binary::Sub, quarter, y2);
        let ball = g.binary(Binary::Sub, a, z2);
        let both = g.binary(Binary::And, slab, ball);
        let (sin, abs, cos) = (
            g.unary(UnaryFunction::Sin.into(), x),
            g.unary(Unary::Abs, y),
            g.unary(UnaryFunction::Cos.into(), z),
        );
        let two = g.constant(2.0);
        let below = g.binary(Binary::Add, two, cos);
        let top = g.binary(Binary::Mul, abs, z);
        let quotient = g.binary(Binary::Div, top, below);
        let other = g.binary(Binary::Sub, sin, quotient);
        let root = g.binary(Binary::Or, both, other);
        (g, root)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4000))]
        #[test]
        fn no_point_is_outside_its_range(
            lo in prop::array::uniform3(-4.0..4.0f64),
            size in prop::array::uniform3(0.0..2.0f64),
            at in prop::array::uniform3(0.0..=1.0f64),
        ) {
            let (graph, root) = sample();
            let min = DVec3::from_array(lo);
            let max = min + DVec3::from_array(size);
            let p = (min + (max - min) * DVec3::from_array(at)).clamp(min, max);
            let mut omega = [0.0];
            Interpreter::new(&graph, &[root]).eval_f64(p.to_array(), &mut omega);
            let range = RangeEvaluator::new(&graph, root).eval(&Aabb::new(min, max));
            prop_assert!(range.contains(omega[0]), "{omega:?} not in {range:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn no_weight_is_outside_its_range(
            lo in prop::array::uniform2(-2.0..2.0f64),
            size in prop::array::uniform2(prop_oneof![Just(0.0), 0.0..1.0f64, 0.0..1e-9f64]),
            at in prop::array::uniform2(0.0..=1.0f64),
            scale in -520_i32..=500,
        ) {
            let scale = 2.0_f64.powi(scale);
            let side = |i: usize| Interval::new(lo[i] * scale, (lo[i] + size[i]) * scale);
            let (a, b) = (side(0), side(1));
            let within = |i: usize, range: Interval| ((lo[i] + at[i] * size[i]) * scale).clamp(range.lo, range.hi);
            let (u, v) = (within(0, a), within(1, b));
            for op in [Binary::AndWeight, Binary::OrWeight, Binary::MinWeight, Binary::MaxWeight] {
                let (weight, range) = (op.eval(u, v), binary(op, a, b));
                prop_assert!(range.contains(weight), "{op:?} of {u}, {v}: {weight} not in {range:?}");
            }
        }
    }

    #[test]
    fn weights_far_from_a_corner_are_nearly_known() {
        let (u, v) = (Interval::new(0.1, 0.11), Interval::new(0.9, 1.0));
        // 1 − u/√(u² + v²)
        let range = binary(Binary::AndWeight, u, v);
        assert!(range.lo > 0.878 && range.hi < 0.901, "{range:?}");
        assert_eq!(binary(Binary::MinWeight, u, v), Interval::point(1.0));
    }

    #[test]
    fn slabs_are_exact_and_infinite_boxes_are_understood() {
        let mut g = Graph::default();
        let x = g.coordinate(Axis::X);
        let three = g.constant(3.0);
        let rest = g.binary(Binary::Sub, three, x);
        let slab = g.binary(Binary::Mul, x, rest);
        let ranges = RangeEvaluator::new(&g, slab);
        let over = |lo, hi| ranges.eval(&Aabb::new(DVec3::splat(lo), DVec3::splat(hi)));
        let whole = over(0.0, 3.0);
        assert!(whole.hi >= 2.25 && whole.hi < 2.2500001 && whole.lo > -1e-300, "{whole:?}");
        assert!(over(4.0, f64::INFINITY).hi < 0.0);
    }
}
