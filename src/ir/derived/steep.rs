//! Formulas whose slope may be far from that of their surface: at an axis, a crease or a pole.

use glam::DVec3;

use crate::geom::Aabb;
use crate::ir::bounds::range::RangeEvaluator;
use crate::ir::function::{BinaryFunction, UnaryFunction};
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// Divisors that may vanish farther out do not matter.
const FAR: f64 = 1e9;

/// Whether a root may have an endless slope at places that are not far from its surface: by an angle around its axis, the
/// root of something that is no sum of squares, a logarithm, or a divisor that vanishes. There the value over the slope
/// says nothing of the distance.
pub fn may_be_steep(graph: &Graph, root: Node) -> bool {
    let varies = |node: Node| Axis::SPACE.iter().any(|&axis| graph.uses(node, axis));
    graph.cone(root).into_iter().any(|node| match graph.expr(node) {
        Expr::Unary(Unary::Sqrt, a) => varies(a) && !is_sum_of_squares(graph, a),
        Expr::Unary(Unary::Call(function), a) => is_steep(function) && varies(a),
        Expr::Binary(Binary::Call(BinaryFunction::Atan2), a, b) => varies(a) || varies(b),
        Expr::Binary(Binary::Call(BinaryFunction::Pow), a, b) => {
            let is_whole = graph.as_constant(b).is_some_and(|b| b >= 1.0);
            !is_whole && (varies(a) || varies(b))
        }
        Expr::Binary(Binary::Div | Binary::DivOrZero, _, b) => varies(b) && may_vanish(graph, b),
        Expr::Unary(Unary::Neg | Unary::Abs | Unary::Sign | Unary::Floor | Unary::Round, _)
        | Expr::Binary(..)
        | Expr::Constant(_)
        | Expr::Coordinate(_)
        | Expr::Parameter(_)
        | Expr::Uniform(_)
        | Expr::Lookup(..) => false,
    })
}

fn is_steep(function: UnaryFunction) -> bool {
    match function {
        UnaryFunction::Tan
        | UnaryFunction::Asin
        | UnaryFunction::Acos
        | UnaryFunction::Ln
        | UnaryFunction::Log2
        | UnaryFunction::Log10 => true,
        UnaryFunction::Sin
        | UnaryFunction::Cos
        | UnaryFunction::Atan
        | UnaryFunction::Exp
        | UnaryFunction::Sinh
        | UnaryFunction::Cosh
        | UnaryFunction::Tanh => false,
    }
}

/// Whether a node is a sum of squares, with numbers among them: its root is a length.
fn is_sum_of_squares(graph: &Graph, node: Node) -> bool {
    let mut waiting = vec![node];
    while let Some(node) = waiting.pop() {
        match graph.expr(node) {
            Expr::Binary(Binary::Add, a, b) => waiting.extend([a, b]),
            Expr::Binary(Binary::Mul, a, b) if a == b => {}
            Expr::Binary(Binary::Mul, a, b) if graph.as_constant(a).is_some_and(|a| a >= 0.0) => {
                waiting.push(b);
            }
            Expr::Binary(Binary::Mul | Binary::Div, a, b)
                if graph.as_constant(b).is_some_and(|b| b > 0.0) =>
            {
                waiting.push(a);
            }
            Expr::Constant(bits) if f64::from_bits(bits) >= 0.0 => {}
            Expr::Unary(..)
            | Expr::Binary(..)
            | Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => return false,
        }
    }
    true
}

fn may_vanish(graph: &Graph, divisor: Node) -> bool {
    let (graph, divisor) = graph.extract_cone(divisor);
    let around = Aabb::new(DVec3::splat(-FAR), DVec3::splat(FAR));
    RangeEvaluator::new(&graph, divisor).eval(&around).contains(0.0)
}
