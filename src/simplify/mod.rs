//! Graph → cheaper graph with the same values.
//!
//! Each rule is an equation with a direction and a label. All rules here are *value-exact*: the result has
//! the same value for every input, infinities and NaN included, except that a zero may change its sign (no
//! consumer can see the difference: ω = ±0 is the surface). Nothing is reassociated or expanded: (x − a)² − …
//! keeps its factored differences, whose digits an expansion would lose.
//!
//! Common subexpressions need no rule: interning finds them.

mod rules;
mod simplifier;

use std::fmt;

use crate::ir::{Graph, Node};
use simplifier::Simplifier;
pub use simplifier::{Applied, MOST_PLACES, Uses};

/// What a step of the compiler keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exactness {
    /// The value at every point: all rules of this module.
    Value,
    /// Keeps only where ω is positive, zero and negative: min for ∧, leaves that are dropped in a box.
    ZeroSet,
}

impl fmt::Display for Exactness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Value => "value-exact",
            Self::ZeroSet => "zero-set-exact",
        })
    }
}

/// The roots and what they use, simplified.
pub fn simplify(graph: &Graph, roots: &[Node]) -> (Graph, Vec<Node>, Applied) {
    let (simplifier, roots) = simplified(graph, roots);
    let (graph, roots) = simplifier.graph.extract(&roots);
    (graph, roots, simplifier.applied)
}

/// A root and what it uses, simplified, with what encloses any of that; `None` if nothing does.
pub fn simplify_with_hulls(graph: &Graph, root: Node) -> Option<(Graph, Node)> {
    let enclosed = graph.enclosed(&[root]);
    if enclosed.is_empty() {
        return None;
    }
    let roots: Vec<Node> =
        std::iter::once(root).chain(enclosed.into_iter().flat_map(<[Node; 2]>::from)).collect();
    let (mut simplifier, roots) = simplified(graph, &roots);
    for pair in roots[1..].chunks_exact(2) {
        simplifier.graph.enclose(pair[0], pair[1]);
    }
    Some((simplifier.graph, roots[0]))
}

/// What the simplifier makes of some roots, and whatever else it made.
fn simplified(graph: &Graph, roots: &[Node]) -> (Simplifier, Vec<Node>) {
    let used = graph.reachable(roots);
    let mut simplifier = Simplifier::new(graph, rules::ALL);
    let mut image: Vec<Option<Node>> = vec![None; graph.len()];
    for (node, expr) in graph.nodes().filter(|(node, _)| used[node.index()]) {
        let mapped = expr.map(|operand| image[operand.index()].unwrap_or(operand));
        image[node.index()] = Some(simplifier.make(mapped, graph.span(node)));
    }
    let roots = roots.iter().map(|root| image[root.index()].unwrap_or(*root)).collect();
    (simplifier, roots)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::{Axis, Binary, Interpreter, Unary, dump};

    fn coordinates(g: &mut Graph) -> [Node; 3] {
        [g.coordinate(Axis::X), g.coordinate(Axis::Y), g.coordinate(Axis::Z)]
    }

    #[track_caller]
    fn check(build: impl Fn(&mut Graph) -> Node, expected: &str) {
        let mut graph = Graph::default();
        let root = build(&mut graph);
        let (small, roots, _) = simplify(&graph, &[root]);
        assert_eq!(dump(&small, &[("w", roots[0])], &[]), expected);
        // and the value is untouched, awkward numbers included
        let awkward = [0.0, -0.0, 1.0, -2.5, 1e-300, 1e300, f64::INFINITY, f64::NAN];
        let (before, after) = (Interpreter::new(&graph, &[root]), Interpreter::new(&small, &roots));
        for x in awkward {
            for y in awkward {
                let (mut a, mut b) = ([0.0], [0.0]);
                before.eval_f64([x, y, 0.5], &mut a);
                after.eval_f64([x, y, 0.5], &mut b);
                assert!(a[0] == b[0] || (a[0].is_nan() && b[0].is_nan()), "at {x}, {y}: {a:?} became {b:?}");
            }
        }
    }

    #[test]
    fn signs_move_outwards() {
        check(
            |g| {
                let [x, y, _] = coordinates(g);
                let (nx, ny) = (g.unary(Unary::Neg, x), g.unary(Unary::Neg, y));
                let product = g.binary(Binary::Mul, nx, ny);
                g.binary(Binary::Sub, product, nx)
            },
            "%0 = x\n%1 = y\n%2 = mul %0 %1\n%3 = add %2 %0\nw = %3\n",
        );
    }

    #[test]
    fn de_morgan() {
        check(
            |g| {
                let [x, y, _] = coordinates(g);
                let (nx, ny) = (g.unary(Unary::Neg, x), g.unary(Unary::Neg, y));
                let both = g.binary(Binary::And, nx, ny);
                g.unary(Unary::Neg, both)
            },
            "%0 = x\n%1 = y\n%2 = r0_or %0 %1\nw = %2\n",
        );
    }

    #[test]
    fn constants_fold() {
        check(
            |g| {
                let [x, ..] = coordinates(g);
                let (two, three) = (g.constant(2.0), g.constant(3.0));
                let six = g.binary(Binary::Mul, two, three);
                let eight = g.binary(Binary::Add, six, two);
                let half = g.binary(Binary::Div, x, two);
                g.binary(Binary::Add, half, eight)
            },
            "%0 = x\n%1 = 8.0\n%2 = 0.5\n%3 = mul %0 %2\n%4 = add %3 %1\nw = %4\n",
        );
    }

    #[test]
    fn forbidden_rewrites_do_not_happen() {
        // R₀ is not idempotent, sums are not reassociated, products are not expanded, 0·x is not 0 for x = ∞
        let unchanged = |build: &dyn Fn(&mut Graph) -> Node| {
            let mut graph = Graph::default();
            let root = build(&mut graph);
            let (small, roots, _) = simplify(&graph, &[root]);
            assert_eq!(dump(&small, &[("w", roots[0])], &[]), dump(&graph, &[("w", root)], &[]));
        };
        unchanged(&|g| {
            let x = g.coordinate(Axis::X);
            g.binary(Binary::And, x, x)
        });
        unchanged(&|g| {
            let x = g.coordinate(Axis::X);
            let million = g.constant(1e6);
            let d = g.binary(Binary::Sub, x, million);
            g.binary(Binary::Mul, d, d)
        });
        // 1 − (x² − y²) keeps its difference, (x − y)·(x + y) its factors
        unchanged(&|g| {
            let [x, y, _] = coordinates(g);
            let (difference, sum) = (g.binary(Binary::Sub, x, y), g.binary(Binary::Add, x, y));
            g.binary(Binary::Mul, difference, sum)
        });
        unchanged(&|g| {
            let [x, y, _] = coordinates(g);
            let (a, b) = (g.binary(Binary::Mul, x, x), g.binary(Binary::Mul, y, y));
            g.binary(Binary::Sub, a, b)
        });
        // 3·x + 3·y keeps both products, (x + y) + z its order
        unchanged(&|g| {
            let [x, y, z] = coordinates(g);
            let three = g.constant(3.0);
            let (a, b) = (g.binary(Binary::Mul, three, x), g.binary(Binary::Mul, three, y));
            let sum = g.binary(Binary::Add, a, b);
            g.binary(Binary::Add, sum, z)
        });
        unchanged(&|g| {
            let x = g.coordinate(Axis::X);
            let zero = g.constant(0.0);
            g.binary(Binary::Mul, x, zero)
        });
        unchanged(&|g| {
            let x = g.coordinate(Axis::X);
            let (a, b) = (g.constant(1e16), g.constant(1.0));
            let sum = g.binary(Binary::Add, x, a);
            g.binary(Binary::Add, sum, b)
        });
    }
}
