//! How the sign of ω follows from the signs of its leaves.

use glam::DVec3;

use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::bounds::range::{RangeEvaluator, Region};
use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// Factors whose formulas have more nodes are not looked into.
const MOST_NODES: usize = 48;

/// Where a factor that varies has to be positive: the sign of a solid is asked nowhere else.
const FARTHEST: f64 = 2e77;

/// A factor that varies lies between these bounds, so that products are 0 nowhere but where the other factor is, or is
/// below 1e-299; in single precision below 1e-29.
const FACTORS: Interval = Interval { lo: 1e-9, hi: 1e9 };

/// A factor that varies is at least this part of its largest value and of the constants in its formula. The errors of a
/// few operations on such numbers in single precision are a hundredth of that, so the factor is positive in it, too.
const LEAST_PART: f64 = 128.0 * f32::EPSILON as f64;

/// How the sign of a node follows from its operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignRule {
    /// ∧ and min: the sign of the smaller operand.
    All(Node, Node),
    /// ∨ and max: the sign of the larger operand.
    Any(Node, Node),
    /// The opposite sign of the operand.
    Not(Node),
    /// A product or quotient with a factor that is proven to be positive: the sign of the other operand.
    Same(Node),
    /// The value itself has to be computed.
    Leaf,
}

impl SignRule {
    /// The rule for a node of a graph.
    pub fn of(graph: &Graph, node: Node) -> Self {
        let positive = |node| match graph.as_constant(node) {
            Some(constant) => constant > 0.0 && constant.is_finite(),
            None => varies_above_zero(graph, node),
        };
        match graph.expr(node) {
            Expr::Binary(Binary::And | Binary::Min | Binary::PlainMin, u, v) => Self::All(u, v),
            Expr::Binary(Binary::Or | Binary::Max | Binary::PlainMax, u, v) => Self::Any(u, v),
            Expr::Unary(Unary::Neg, u) => Self::Not(u),
            Expr::Binary(Binary::Mul, u, v) if positive(u) && u != v => Self::Same(v),
            Expr::Binary(Binary::Mul | Binary::Div, u, v) if positive(v) && u != v => Self::Same(u),
            // for all others the value is needed
            Expr::Unary(..)
            | Expr::Binary(..)
            | Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => Self::Leaf,
        }
    }

    /// The positive constant with which a node multiplies the operand that it has the sign of, see
    /// [`SignRule::Same`]; 1 for all other nodes, and where the factor varies.
    pub fn factor(graph: &Graph, node: Node) -> f64 {
        let Self::Same(operand) = Self::of(graph, node) else { return 1.0 };
        let expr = graph.expr(node);
        let constant =
            expr.operands().find(|other| *other != operand).and_then(|other| graph.as_constant(other));
        let constant = constant.unwrap_or(1.0);
        if matches!(expr, Expr::Binary(Binary::Div, ..)) { 1.0 / constant } else { constant }
    }

    /// Whether a node that has the sign of one of its operands multiplies it with something that is no constant.
    pub fn varies(graph: &Graph, node: Node) -> bool {
        let Self::Same(operand) = Self::of(graph, node) else { return false };
        graph.expr(node).operands().any(|other| other != operand && graph.as_constant(other).is_none())
    }

    /// The operands that alone decide the sign.
    pub fn operands(self) -> impl Iterator<Item = Node> {
        let (a, b) = match self {
            Self::All(u, v) | Self::Any(u, v) => (Some(u), Some(v)),
            Self::Not(u) | Self::Same(u) => (Some(u), None),
            Self::Leaf => (None, None),
        };
        a.into_iter().chain(b)
    }
}

/// Whether a factor that is no constant is proven to be positive: the width of a shape that tapers, for instance.
fn varies_above_zero(graph: &Graph, node: Node) -> bool {
    let mut seen = vec![node];
    let (mut next, mut is_bounded, mut largest) = (0, false, 0_f64);
    while let Some(&node) = seen.get(next) {
        let expr = graph.expr(node);
        largest = largest.max(graph.as_constant(node).unwrap_or(0.0).abs());
        // most formulas without one of these are as large as their coordinates
        is_bounded |=
            matches!(expr, Expr::Unary(Unary::Call(_), _) | Expr::Binary(Binary::Min | Binary::Max, ..));
        if matches!(expr, Expr::Parameter(_) | Expr::Uniform(_) | Expr::Lookup(..)) || seen.len() > MOST_NODES
        {
            return false;
        }
        for operand in expr.operands() {
            if !seen.contains(&operand) {
                seen.push(operand);
            }
        }
        next += 1;
    }
    is_bounded && {
        let (small, root) = graph.extract_cone(node);
        let over = Aabb::new(DVec3::splat(-FARTHEST), DVec3::splat(FARTHEST));
        let region = Region { time: Interval::new(-FARTHEST, FARTHEST), ..Region::of(&over) };
        let range = RangeEvaluator::new(&small, root).eval_with(&region);
        range.lo >= FACTORS.lo.max(LEAST_PART * largest.max(range.hi)) && range.hi <= FACTORS.hi
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::{Axis, UnaryFunction};

    #[test]
    fn factors_that_stay_positive_do_not_matter() {
        let mut graph = Graph::default();
        let [x, z, time] = [Axis::X, Axis::Z, Axis::T].map(|axis| graph.coordinate(axis));
        let [zero, one, part, most, small] =
            [0.0, 1.0, -0.4, -0.999_999_99, 1e-12].map(|value| graph.constant(value));
        let within = graph.binary(Binary::Max, z, zero);
        let within = graph.binary(Binary::Min, within, one);
        let part = graph.binary(Binary::Mul, part, within);
        let width = graph.binary(Binary::Add, one, part);
        let tapered = graph.binary(Binary::Mul, x, width);
        assert_eq!(SignRule::of(&graph, tapered), SignRule::Same(x));
        let divided = graph.binary(Binary::Div, x, width);
        assert_eq!(SignRule::of(&graph, divided), SignRule::Same(x));
        let wave = graph.unary(Unary::Call(UnaryFunction::Sin), time);
        for (factor, is_positive) in [(2.0, true), (0.5, false)] {
            let level = graph.constant(factor);
            let level = graph.binary(Binary::Add, level, wave);
            let waving = graph.binary(Binary::Mul, x, level);
            assert_eq!(SignRule::of(&graph, waving) == SignRule::Same(x), is_positive, "{factor}");
        }
        let thin = graph.binary(Binary::Add, small, within);
        // 1 − 0.99999999 is 1e-8, but 0 in single precision
        let most = graph.binary(Binary::Mul, most, within);
        let sharp = graph.binary(Binary::Add, one, most);
        // a factor may be 0, as large as its coordinates, or so small that the product is 0 before x is
        for factor in [within, z, part, thin, sharp] {
            let product = graph.binary(Binary::Mul, x, factor);
            assert_eq!(SignRule::of(&graph, product), SignRule::Leaf);
        }
    }
}
