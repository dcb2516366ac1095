//! A graph in coordinates relative to an origin: x − c becomes x′ + (o − c) with the constants folded in
//! `f64`.
//!
//! In single precision a coordinate far from zero has lost the digits that matter before the program starts.
//! Here the origin is subtracted in double precision, and the large constants of the formula with it.

use std::collections::HashMap;

use glam::DVec3;

use crate::ir::bounds::error::FOLDING;
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// ± a coordinate + an offset, not yet written into the graph.
#[derive(Clone, Copy)]
struct Shifted {
    axis: Axis,
    negative: bool,
    offset: f64,
    /// Largest possible |offset − the sum of constants that it stands for|.
    error: f64,
}

#[derive(Clone, Copy)]
enum Image {
    Node(Node),
    Shifted(Shifted),
}

/// The root as a function of x − origin. Each constant of the new graph that was folded with the origin is
/// off by at most 2⁻⁵⁰ of itself; no other constant is changed.
pub fn localised(graph: &Graph, root: Node, origin: DVec3) -> (Graph, Node) {
    let mut out = Graph::like(graph);
    let mut images: HashMap<Node, Image> = HashMap::new();
    for node in graph.cone(root) {
        let shifted = match graph.expr(node) {
            Expr::Coordinate(axis) if axis != Axis::T => {
                let offset = origin[axis as usize];
                Some(Shifted { axis, negative: false, offset, error: 0.0 })
            }
            expr => fold(graph, expr, &images),
        };
        let image = match shifted {
            Some(shifted) => Image::Shifted(shifted),
            None => {
                let expr = graph.expr(node).map(|operand| written(&mut out, images[&operand]));
                Image::Node(out.intern(expr, graph.span(node)))
            }
        };
        images.insert(node, image);
    }
    let root = written(&mut out, images[&root]);
    out.extract_cone(root) // without the constants that were folded
}

/// A coordinate with a constant added, taken from one, or negated; `None` if the constant cannot be folded to
/// the digits that are promised.
fn fold(graph: &Graph, expr: Expr, images: &HashMap<Node, Image>) -> Option<Shifted> {
    let shifted = |node: Node| match images.get(&node) {
        Some(Image::Shifted(shifted)) => Some(*shifted),
        _ => None,
    };
    let (shifted, constant) = match expr {
        Expr::Unary(Unary::Neg, a) => {
            let s = shifted(a)?;
            return Some(Shifted { negative: !s.negative, offset: -s.offset, ..s });
        }
        Expr::Binary(Binary::Add, a, b) => match (shifted(a), shifted(b)) {
            (Some(s), None) => (s, graph.as_constant(b)?),
            (None, Some(s)) => (s, graph.as_constant(a)?),
            _ => return None,
        },
        Expr::Binary(Binary::Sub, a, b) => match (shifted(a), shifted(b)) {
            (Some(s), None) => (s, -graph.as_constant(b)?),
            (None, Some(s)) => {
                (Shifted { negative: !s.negative, offset: -s.offset, ..s }, graph.as_constant(a)?)
            }
            _ => return None,
        },
        _ => return None,
    };
    let offset = shifted.offset + constant;
    let error = shifted.error + rounding(shifted.offset, constant, offset);
    (error <= 0.5 * FOLDING * offset.abs()).then_some(Shifted { offset, error, ..shifted })
}

/// |a + b − sum| of a rounded sum, exactly (Knuth's two-sum).
fn rounding(a: f64, b: f64, sum: f64) -> f64 {
    let b_part = sum - a;
    let a_part = sum - b_part;
    ((a - a_part) + (b - b_part)).abs()
}

fn written(out: &mut Graph, image: Image) -> Node {
    let shifted = match image {
        Image::Node(node) => return node,
        Image::Shifted(shifted) => shifted,
    };
    let coordinate = out.coordinate(shifted.axis);
    if shifted.offset == 0.0 {
        return if shifted.negative { out.unary(Unary::Neg, coordinate) } else { coordinate };
    }
    let offset = out.constant(shifted.offset);
    let op = if shifted.negative { Binary::Sub } else { Binary::Add };
    if shifted.negative { out.binary(op, offset, coordinate) } else { out.binary(op, coordinate, offset) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::exact;

    #[test]
    fn a_far_ball_keeps_its_digits() {
        // 0.25 − (x − 1e6)²
        let mut graph = Graph::default();
        let x = graph.coordinate(Axis::X);
        let centre = graph.constant(1e6);
        let d = graph.binary(Binary::Sub, x, centre);
        let square = graph.binary(Binary::Mul, d, d);
        let quarter = graph.constant(0.25);
        let root = graph.binary(Binary::Sub, quarter, square);
        let (local, new) = localised(&graph, root, DVec3::new(1e6, 0.0, 0.0));
        let constants: Vec<f64> = local.nodes().filter_map(|(node, _)| local.as_constant(node)).collect();
        assert_eq!(constants, [0.25]);
        let at = |graph: &Graph, root, x| exact::evaluate(graph, &[root], [x, 0.0, 0.0]).unwrap()[0].to_f64();
        assert_eq!(at(&local, new, 0.375), at(&graph, root, 1e6 + 0.375));
    }

    #[test]
    fn a_constant_that_loses_digits_is_not_folded() {
        // (x + 0.1) − 1e9 about −1e9: the first sum rounds by more than the second leaves
        let mut graph = Graph::default();
        let x = graph.coordinate(Axis::X);
        let (tenth, far) = (graph.constant(0.1), graph.constant(1e9));
        let near = graph.binary(Binary::Add, x, tenth);
        let root = graph.binary(Binary::Sub, near, far);
        let (local, new) = localised(&graph, root, DVec3::new(1e9, 0.0, 0.0));
        let exact = exact::evaluate(&local, &[new], [0.0; 3]).unwrap();
        assert!((exact[0].to_f64() - 0.1).abs() < 1e-7);
        assert!(local.nodes().any(|(node, _)| local.as_constant(node) == Some(1e9)));
    }
}
