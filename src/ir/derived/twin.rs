//! The min/max twin of a graph: ∧ becomes min, ∨ becomes max.
//!
//! R₀ and min/max have the same sign for every sign of their operands, so the twin has exactly the sign and
//! the zero set of ω; in floating point too, because min and max do not round. It needs no roots, and its
//! gradient is that of one leaf. Its value away from the surface differs.

use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::bounds::range::{RangeEvaluator, Region};
use crate::ir::derived::sign::SignRule;
use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::op::Binary;
use glam::DVec3;

/// Within these distances of the origin a leaf must be shown to be a number for the plain minimum to be used;
/// [`Graph`] users make results beyond them NaN (see `solid::programs::on_demand`). One pair for each
/// precision: the box, and the largest value that cannot overflow.
const PROOFS: [(f64, f64); 2] = [(5e9, 1e38), (2e77, 1e308)];

/// The twin of a root, in the same graph.
///
/// Only the junctions that decide the sign of the root are replaced: those reached from it through ∧, ∨, ¬,
/// min, max and multiplication by a positive number. In `(a and b) - 0.1` the value of a ∧ b matters, not
/// its sign, so the difference is a leaf.
pub fn twin(graph: &mut Graph, root: Node) -> Node {
    let logic = logic_nodes(graph, root);
    let finite = finite_nodes(graph, root);
    // the image of each logic node, and whether it is known to be a number
    let mut image: Vec<Option<(Node, bool)>> = vec![None; root.index() + 1];
    for i in 0..=root.index() {
        if !logic[i] {
            continue;
        }
        let node = graph.node(i);
        let of = |operand: Node| image[operand.index()].unwrap_or((operand, finite[operand.index()]));
        let span = graph.span(node);
        let joined = |graph: &mut Graph, [u, v]: [Node; 2], plain: Binary, careful: Binary| {
            let ((u, u_is_number), (v, v_is_number)) = (of(u), of(v));
            let numbers = u_is_number && v_is_number;
            (graph.intern(Expr::Binary(if numbers { plain } else { careful }, u, v), span), numbers)
        };
        let result = match SignRule::of(graph, node) {
            SignRule::All(u, v) => joined(graph, [u, v], Binary::PlainMin, Binary::Min),
            SignRule::Any(u, v) => joined(graph, [u, v], Binary::PlainMax, Binary::Max),
            // a factor that varies would make the twin differ from the tree of leaves, which has constant factors
            SignRule::Same(u) if SignRule::varies(graph, node) => of(u),
            SignRule::Not(u) | SignRule::Same(u) => {
                let (new, number) = of(u);
                let mapped = graph.expr(node).map(|operand| if operand == u { new } else { operand });
                (graph.intern(mapped, span), number)
            }
            SignRule::Leaf => (node, finite[i]),
        };
        image[i] = Some(result);
    }
    image[root.index()].map_or(root, |(node, _)| node)
}

/// For each node, whether only its sign matters for the sign of the root; leaves included.
fn logic_nodes(graph: &Graph, root: Node) -> Vec<bool> {
    let mut logic = vec![false; root.index() + 1];
    logic[root.index()] = true;
    for i in (0..=root.index()).rev() {
        if logic[i] {
            for operand in SignRule::of(graph, graph.node(i)).operands() {
                logic[operand.index()] = true;
            }
        }
    }
    logic
}

/// For each node, whether it is proven to be finite wherever the twin gives an answer.
fn finite_nodes(graph: &Graph, root: Node) -> Vec<bool> {
    let mut finite = vec![true; root.index() + 1];
    let ranges = RangeEvaluator::new(graph, root);
    for (reach, largest) in PROOFS {
        let over = Aabb::new(DVec3::splat(-reach), DVec3::splat(reach));
        let region = Region { time: Interval::new(-reach, reach), ..Region::of(&over) };
        for (flag, range) in finite.iter_mut().zip(ranges.all_with(&region)) {
            *flag &= range.lo >= -largest && range.hi <= largest;
        }
    }
    finite
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::{Axis, Unary, dump};
    use crate::simplify::simplify;

    #[track_caller]
    fn check(build: impl Fn(&mut Graph, [Node; 3]) -> Node, expected: &str) {
        let mut graph = Graph::default();
        let coordinates = [Axis::X, Axis::Y, Axis::Z].map(|axis| graph.coordinate(axis));
        let root = build(&mut graph, coordinates);
        let root = twin(&mut graph, root);
        let (graph, roots, _) = simplify(&graph, &[root]);
        assert_eq!(dump(&graph, &[("twin", roots[0])], &[]), expected);
    }

    #[test]
    fn junctions_become_min_and_max() {
        check(
            |g, [x, y, z]| {
                let both = g.binary(Binary::And, x, y);
                let not = g.unary(Unary::Neg, both);
                let three = g.constant(3.0);
                let scaled = g.binary(Binary::Mul, three, not);
                g.binary(Binary::Or, scaled, z)
            },
            "%0 = x\n%1 = y\n%2 = z\n%3 = 3.0\n%4 = plain_min %0 %1\n%5 = mul %3 %4\n%6 = neg %5\n\
             %7 = plain_max %6 %2\ntwin = %7\n",
        );
    }

    #[test]
    fn a_junction_whose_value_matters_stays() {
        check(
            |g, [x, y, z]| {
                let both = g.binary(Binary::And, x, y);
                let tenth = g.constant(0.1);
                let inner = g.binary(Binary::Sub, both, tenth);
                g.binary(Binary::And, inner, z)
            },
            "%0 = x\n%1 = y\n%2 = z\n%3 = r0_and %0 %1\n%4 = 0.1\n%5 = sub %3 %4\n%6 = plain_min %5 %2\n\
             twin = %6\n",
        );
    }

    #[test]
    fn leaves_that_may_be_nan_keep_the_careful_minimum() {
        check(
            |g, [x, y, _]| {
                let root = g.unary(Unary::Sqrt, x);
                g.binary(Binary::And, root, y)
            },
            "%0 = x\n%1 = y\n%2 = sqrt %0\n%3 = min %2 %1\ntwin = %3\n",
        );
    }
}
