//! Guaranteed ranges: an interval that contains ω of every point of a box.
//!
//! R₀ grows with each operand, so its exact range is reached at the ends of the operands' ranges: two scalar
//! evaluations, widened by four ulp for their rounding (which cannot change their signs). Squares and products of
//! two linear functions of one node (slabs) get their exact range too; elsewhere a node that occurs twice is
//! taken as two independent ones, which is safe but wider.

use std::cell::RefCell;

use super::graph::{Axis, Expr, Graph, Node};
use super::op::{Binary, Unary};
use super::r0;
use crate::geom::Aabb;
use crate::interval::Interval;

/// How the range of one node is found; `codegen::range` does the same in machine code.
#[derive(Debug, Clone, Copy)]
pub enum Step {
    Plain(Expr),
    Square(Node),
    /// (p·e + q)·(r·e + s) of one node e.
    Slab {
        of: Node,
        first: Affine,
        second: Affine,
    },
}

/// slope · node + offset, with slope 1 or −1
#[derive(Debug, Clone, Copy)]
pub struct Affine {
    pub slope: f64,
    pub offset: f64,
}

impl Step {
    /// The way for a node of a graph.
    pub fn of(graph: &Graph, expr: Expr) -> Self {
        step(graph, expr)
    }
}

/// A graph prepared for the evaluation of ranges.
#[derive(Debug, Clone)]
pub struct RangeEvaluator {
    steps: Vec<Step>,
    root: Node,
}

thread_local! {
    static SCRATCH: RefCell<Vec<Interval>> = const { RefCell::new(Vec::new()) };
}

impl RangeEvaluator {
    pub fn new(graph: &Graph, root: Node) -> Self {
        let steps = graph.nodes().map(|(_, expr)| step(graph, expr)).collect();
        Self { steps, root }
    }

    /// The range of ω over a box; bounds of the box may be infinite.
    pub fn eval(&self, over: &Aabb) -> Interval {
        SCRATCH.with_borrow_mut(|values| {
            self.fill(over, values);
            values[self.root.index()]
        })
    }

    /// The ranges of all nodes, in the graph's order.
    pub fn all(&self, over: &Aabb) -> Vec<Interval> {
        let mut values = Vec::new();
        self.fill(over, &mut values);
        values
    }

    fn fill(&self, over: &Aabb, values: &mut Vec<Interval>) {
        let axes = [
            Interval::new(over.min.x, over.max.x),
            Interval::new(over.min.y, over.max.y),
            Interval::new(over.min.z, over.max.z),
        ];
        values.clear();
        for &step in &self.steps {
            let value = match step {
                Step::Square(a) => values[a.index()].square(),
                Step::Slab { of, first, second } => slab(values[of.index()], first, second),
                Step::Plain(expr) => plain(expr, values, axes),
            };
            values.push(value);
        }
    }
}

fn step(graph: &Graph, expr: Expr) -> Step {
    if let Expr::Binary(Binary::Mul, a, b) = expr {
        if a == b {
            return Step::Square(a);
        }
        let ((of, first), (other, second)) = (affine(graph, a), affine(graph, b));
        if of == other && graph.as_constant(of).is_none() {
            return Step::Slab { of, first, second };
        }
    }
    Step::Plain(expr)
}

/// Reads a node as slope · (another node) + offset; only slopes ±1, for which the rounding of the written sum is
/// that of the written sum. Anything else is 1 · itself + 0.
fn affine(graph: &Graph, node: Node) -> (Node, Affine) {
    let itself = (node, Affine { slope: 1.0, offset: 0.0 });
    match graph.expr(node) {
        Expr::Binary(Binary::Add, a, b) => match (graph.as_constant(a), graph.as_constant(b)) {
            (None, Some(offset)) => (a, Affine { slope: 1.0, offset }),
            (Some(offset), None) => (b, Affine { slope: 1.0, offset }),
            _ => itself,
        },
        Expr::Binary(Binary::Sub, a, b) => match (graph.as_constant(a), graph.as_constant(b)) {
            (None, Some(offset)) => (a, Affine { slope: 1.0, offset: -offset }),
            (Some(offset), None) => (b, Affine { slope: -1.0, offset }),
            _ => itself,
        },
        Expr::Unary(Unary::Neg, a) => (a, Affine { slope: -1.0, offset: 0.0 }),
        _ => itself,
    }
}

fn at(affine: Affine, e: Interval) -> Interval {
    let signed = if affine.slope < 0.0 { -e } else { e };
    if affine.offset == 0.0 { signed } else { signed + Interval::point(affine.offset) }
}

/// A product of two linear functions of e has its extremes at the ends of e and at its vertex.
fn slab(e: Interval, first: Affine, second: Affine) -> Interval {
    let value = |e: Interval| at(first, e) * at(second, e);
    let mut range = value(Interval::point(e.lo)).hull(value(Interval::point(e.hi)));
    // vertex halfway between the roots −offset/slope
    let roots = (-first.offset * first.slope, -second.offset * second.slope);
    let vertex = Interval::point(0.5 * roots.0 + 0.5 * roots.1).widened(4);
    if vertex.hi >= e.lo && vertex.lo <= e.hi {
        range = range.hull(value(vertex));
    }
    range
}

fn plain(expr: Expr, values: &[Interval], axes: [Interval; 3]) -> Interval {
    match expr {
        Expr::Constant(bits) => {
            let value = f64::from_bits(bits);
            Interval::new(value, value)
        }
        Expr::Coordinate(Axis::X) => axes[0],
        Expr::Coordinate(Axis::Y) => axes[1],
        Expr::Coordinate(Axis::Z) => axes[2],
        Expr::Parameter(_) => Interval::ALL,
        Expr::Unary(op, a) => unary(op, values[a.index()]),
        Expr::Binary(op, a, b) => binary(op, values[a.index()], values[b.index()]),
    }
}

fn unary(op: Unary, a: Interval) -> Interval {
    match op {
        Unary::Neg => -a,
        Unary::Abs => a.abs(),
        Unary::Sqrt => a.sqrt(),
        Unary::Sign => Interval { lo: Unary::Sign.eval(a.lo), hi: Unary::Sign.eval(a.hi) },
        Unary::Sin => a.sin(),
        Unary::Cos => a.cos(),
        Unary::Atan => a.increasing(libm::atan),
        Unary::Exp => a.increasing(libm::exp),
        Unary::Ln if a.lo > 0.0 => a.increasing(libm::log),
        Unary::Asin if a.lo >= -1.0 && a.hi <= 1.0 => a.increasing(libm::asin),
        Unary::Acos if a.lo >= -1.0 && a.hi <= 1.0 => (-a).increasing(|x| libm::acos(-x)),
        Unary::Tan if a.lo > -1.57 && a.hi < 1.57 => a.increasing(libm::tan),
        Unary::Ln | Unary::Asin | Unary::Acos | Unary::Tan => Interval::ALL,
    }
}

fn binary(op: Binary, a: Interval, b: Interval) -> Interval {
    match op {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div => a / b,
        Binary::DivOrZero => {
            if b.contains(0.0) {
                Interval::ALL
            } else {
                a / b
            }
        }
        Binary::Min | Binary::PlainMin => a.min(b),
        Binary::Max | Binary::PlainMax => a.max(b),
        Binary::And => Interval::new(r0::and_of_bounds(a.lo, b.lo), r0::and_of_bounds(a.hi, b.hi)).widened(4),
        Binary::Or => Interval::new(r0::or_of_bounds(a.lo, b.lo), r0::or_of_bounds(a.hi, b.hi)).widened(4),
        Binary::MinWeight | Binary::MaxWeight => Interval { lo: 0.0, hi: 1.0 },
        Binary::AndWeight | Binary::OrWeight => Interval { lo: 0.0, hi: 2.0_f64.next_up() },
        Binary::Atan2 => Interval::new(-std::f64::consts::PI, std::f64::consts::PI).widened(1),
        Binary::Pow if a.lo > 0.0 => {
            let corners =
                [(a.lo, b.lo), (a.lo, b.hi), (a.hi, b.lo), (a.hi, b.hi)].map(|(a, b)| libm::pow(a, b));
            let lo = corners.into_iter().fold(f64::INFINITY, f64::min);
            let hi = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
            Interval::new(lo, hi).widened(4)
        }
        Binary::Pow => Interval::ALL,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Interpreter;
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
        let (sin, abs, cos) = (g.unary(Unary::Sin, x), g.unary(Unary::Abs, y), g.unary(Unary::Cos, z));
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
