//! How large the nodes of a graph can become in a box, and which form of R₀ that asks for.
//!
//! u ∧ v and u ∨ v can be 2 + √2 times as large as their operands, so a fold written out by hand grows as 2ⁿ:
//! its squares overflow after 512 equal members in `f64`, after 64 in `f32`, long before its value does.
//! Sizes are kept here as logarithms, because they leave the range that they are to be compared with.

use glam::DVec3;

use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::bounds::float::FloatType;
use crate::ir::bounds::range::{RangeEvaluator, Region};
use crate::ir::form::{Form, Forms};
use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};
use crate::precision::Precision;

/// Forms are chosen within this distance of the origin if nothing else is known of a solid, and
/// within as many seconds of the beginning.
const REACH: f64 = 1e4;

/// Ranges up to this size show how large a node is; larger ones may have overflowed.
const TRUSTED: f64 = 1e290;

/// Upper bounds of log₂ of the magnitudes of a graph's nodes in a box; ∞ where nothing is known.
#[derive(Debug, Clone)]
pub struct Magnitudes {
    exponents: Vec<f64>,
}

impl Magnitudes {
    /// Within 10⁴ of the origin, and of the beginning of time: for a solid of which nothing else is known.
    pub fn within_reach(graph: &Graph) -> Self {
        Self::over(graph, &Aabb::new(DVec3::splat(-REACH), DVec3::splat(REACH)))
    }

    /// In a box.
    pub fn over(graph: &Graph, over: &Aabb) -> Self {
        let time = Interval::new(-REACH, REACH);
        let Some((last, _)) = graph.nodes().last() else { return Self { exponents: Vec::new() } };
        let ranges = RangeEvaluator::new(graph, last).all_with(&Region { time, ..Region::of(over) });
        let mut exponents: Vec<f64> = Vec::with_capacity(ranges.len());
        for ((_, expr), range) in std::iter::zip(graph.nodes(), ranges) {
            exponents.push(exponent(graph, expr, range, &exponents));
        }
        Self { exponents }
    }

    /// log₂ of a node's magnitude, at most.
    pub fn exponent(&self, node: Node) -> f64 {
        self.exponents[node.index()]
    }

    /// The default form, but the scaled one where squares of operands leave the range of the type: where they
    /// may overflow, or are bound to underflow. Where nothing is known the default stays.
    pub fn forms(&self, graph: &Graph, default: Form, precision: Precision) -> Forms {
        let float = FloatType::of(precision);
        let mut forms = Forms::all(default);
        // u² + v² ≤ 2·M²
        let too_large = 0.5 * (float.largest.log2() - 1.0);
        // below this M² loses digits: the smallest normal number is smallest / 2·unit
        let too_small = 0.5 * (float.smallest.log2() - 2.0 * float.unit.log2());
        for (_, u, v) in junctions(graph) {
            let largest = self.exponent(u).max(self.exponent(v));
            if largest.is_finite() && (largest > too_large || largest < too_small) {
                forms.set(u, v, Form::Scaled);
            }
        }
        forms
    }

    /// The first operation ∧ or ∨ whose value may leave the range of the type although its operands do not.
    pub fn overflow(&self, graph: &Graph, precision: Precision) -> Option<Node> {
        let largest = FloatType::of(precision).largest;
        let fits = |node| self.exponent(node) < largest.log2();
        let found = junctions(graph)
            .find(|&(node, u, v)| self.exponent(node).is_finite() && !fits(node) && fits(u) && fits(v));
        found.map(|(node, ..)| node)
    }
}

/// ∧, ∨ and their weights, with their operands.
fn junctions(graph: &Graph) -> impl Iterator<Item = (Node, Node, Node)> + '_ {
    graph.nodes().filter_map(|(node, expr)| match expr {
        Expr::Binary(op, u, v) => op.r0().map(|_| (node, u, v)),
        _ => None,
    })
}

fn exponent(graph: &Graph, expr: Expr, range: Interval, known: &[f64]) -> f64 {
    let magnitude = range.lo.abs().max(range.hi.abs());
    if magnitude < TRUSTED {
        return magnitude.log2();
    }
    let of = |node: Node| known[node.index()];
    match expr {
        Expr::Unary(Unary::Neg | Unary::Abs | Unary::Floor | Unary::Round, a) => of(a),
        Expr::Unary(Unary::Sqrt, a) => 0.5 * of(a),
        Expr::Binary(op, a, b) => {
            let (ea, eb) = (of(a), of(b));
            let (large, small) = (ea.max(eb), ea.min(eb));
            let q = if large.is_finite() { (small - large).exp2() } else { 1.0 };
            match op {
                Binary::Add | Binary::Sub => large + (1.0 + q).log2(),
                Binary::Mul | Binary::MulOrZero => ea + eb,
                Binary::Div => graph.as_constant(b).map_or(f64::INFINITY, |c| ea - c.abs().log2()),
                Binary::Min | Binary::Max | Binary::PlainMin | Binary::PlainMax => large,
                // |M|·(1 + q + √(1 + q²))
                Binary::And | Binary::Or => large + (1.0 + q + (1.0 + q * q).sqrt()).log2(),
                Binary::DivOrZero
                | Binary::MinWeight
                | Binary::MaxWeight
                | Binary::AndWeight
                | Binary::OrWeight
                | Binary::Call(_) => f64::INFINITY,
            }
        }
        Expr::Unary(Unary::Sign | Unary::Call(_), _)
        | Expr::Constant(_)
        | Expr::Coordinate(_)
        | Expr::Parameter(_)
        | Expr::Uniform(_)
        | Expr::Lookup(..) => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Axis;

    /// ((x ∨ x) ∨ x) ∨ …, and its nodes.
    fn left_fold(members: usize) -> (Graph, Vec<Node>) {
        let mut graph = Graph::default();
        let x = graph.coordinate(Axis::X);
        let mut nodes = vec![x];
        for _ in 1..members {
            let so_far = nodes[nodes.len() - 1];
            nodes.push(graph.binary(Binary::Or, so_far, x));
        }
        (graph, nodes)
    }

    fn unit_box() -> Aabb {
        Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0))
    }

    #[test]
    fn only_the_members_that_need_it_are_scaled() {
        let (graph, nodes) = left_fold(1000);
        let magnitudes = Magnitudes::over(&graph, &unit_box());
        let x = nodes[0];
        for (float, first) in [(Precision::F64, 512.0), (Precision::F32, 64.0)] {
            let forms = magnitudes.forms(&graph, Form::Stable, float);
            let scaled = nodes.windows(2).filter(|w| forms.of(w[0], x) == Form::Scaled).count() as f64;
            // value n is 2ⁿ, a few of which make up for the first, smaller steps
            assert!((scaled - (999.0 - first)).abs() < 4.0, "{scaled}");
        }
        assert_eq!(magnitudes.overflow(&graph, Precision::F64), None);
        let first = magnitudes.overflow(&graph, Precision::F32).unwrap();
        assert!((first.index() as f64 - 128.0).abs() < 4.0, "{first:?}");
        let (graph, _) = left_fold(1100);
        let first = Magnitudes::over(&graph, &unit_box()).overflow(&graph, Precision::F64).unwrap();
        assert!((first.index() as f64 - 1024.0).abs() < 4.0, "{first:?}");
    }

    #[test]
    fn what_is_not_known_changes_nothing_and_tiny_scenes_are_scaled() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let quotient = graph.binary(Binary::Div, y, x);
        graph.binary(Binary::And, quotient, x);
        graph.binary(Binary::Or, x, y);
        let plain = Forms::all(Form::Stable);
        for float in [Precision::F64, Precision::F32] {
            assert_eq!(Magnitudes::within_reach(&graph).forms(&graph, Form::Stable, float), plain);
        }
        let tiny = Magnitudes::over(&graph, &Aabb::new(DVec3::splat(-1e-24), DVec3::splat(1e-24)));
        assert_eq!(tiny.forms(&graph, Form::Stable, Precision::F64), plain);
        assert_eq!(tiny.forms(&graph, Form::Stable, Precision::F32).of(x, y), Form::Scaled);
    }
}
