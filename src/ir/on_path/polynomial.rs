//! A polynomial leaf along a straight path, as further nodes of its graph: u(a + t·b) = c₀ + c₁t + c₂t², with
//! a bound of the rounding errors of each coefficient.
//!
//! Truncated polynomials are carried through the operations, and with them the running error: what the
//! operands bring along, and ε times every product and sum that is formed. ε is 2⁻⁵³, the unit of rounding,
//! and a little more, which covers the roundings of the bounds themselves. Constants count as exact: the
//! shape is that of the numbers in the graph, not of those in a text.

use std::collections::HashMap;

use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// A coefficient that is known not to vanish everywhere, and the bound of its error; both are nodes.
#[derive(Debug, Clone, Copy)]
struct Term {
    value: Node,
    /// `None` where the value is exact.
    error: Option<Node>,
}

/// 2⁻⁵³(1 + 2⁻³⁰)
const ROUNDING: f64 = 0.5 * f64::EPSILON * (1.0 + 1.0 / (1u64 << 30) as f64);

/// Coefficients of 1, t and t²; `None` stands for zero.
type Polynomial = [Option<Term>; 3];

/// [c₀, c₁, c₂, their error bounds] of a root along a path from the point (x, y, z).
///
/// The components of the path's direction are the parameters `direction`, `direction` + 1 and `direction` +
/// 2. Time goes on by the parameter `direction` + 3 from the parameter `direction` + 4. `None` unless the
/// root is made of sums, products and quotients by constants, and of degree two at most.
pub fn polynomial_on_path(graph: &mut Graph, root: Node, direction: u32) -> Option<[Node; 6]> {
    let mut builder = Builder { graph, direction };
    let mut known: HashMap<Node, Polynomial> = HashMap::new();
    for node in builder.graph.cone(root) {
        let polynomial = builder.polynomial(node, &known)?;
        known.insert(node, polynomial);
    }
    let terms = known.remove(&root)?;
    // bounds of errors below the range of normal numbers have lost digits themselves
    let least = builder.graph.constant(f64::MIN_POSITIVE);
    let zero = builder.graph.constant(0.0);
    let values = terms.map(|term| term.map_or(zero, |term| term.value));
    let errors = terms.map(|term| match term.and_then(|term| term.error) {
        Some(error) => builder.graph.binary(Binary::Add, error, least),
        None => zero,
    });
    let ([a, b, c], [d, e, f]) = (values, errors);
    Some([a, b, c, d, e, f])
}

struct Builder<'g> {
    graph: &'g mut Graph,
    direction: u32,
}

impl Builder<'_> {
    fn polynomial(&mut self, node: Node, known: &HashMap<Node, Polynomial>) -> Option<Polynomial> {
        let exact = |value| Some(Term { value, error: None });
        Some(match self.graph.expr(node) {
            Expr::Constant(_) | Expr::Parameter(_) => [exact(node), None, None],
            Expr::Uniform(_) => return None,
            Expr::Coordinate(axis) => {
                let number = self.direction + axis as u32;
                let step = self.graph.intern(Expr::Parameter(number), None);
                // a difference of two points, rounded
                let error = self.rounding(step);
                // the program has no time of its own
                let begin = match axis {
                    Axis::T => self.graph.intern(Expr::Parameter(self.direction + 4), None),
                    Axis::X | Axis::Y | Axis::Z => node,
                };
                [exact(begin), Some(Term { value: step, error: Some(error) }), None]
            }
            Expr::Unary(Unary::Neg, a) => known[&a].map(|term| {
                term.map(|term| Term { value: self.graph.unary(Unary::Neg, term.value), ..term })
            }),
            Expr::Binary(Binary::Add, a, b) => self.sum(known[&a], known[&b]),
            Expr::Binary(Binary::Sub, a, b) => self.difference(known[&a], known[&b]),
            Expr::Binary(Binary::Mul, a, b) => self.product(known[&a], known[&b])?,
            Expr::Binary(Binary::Div, a, b) => match known[&b] {
                [Some(divisor), None, None] if divisor.error.is_none() => {
                    known[&a].map(|term| term.map(|term| self.quotient(term, divisor.value)))
                }
                _ => return None,
            },
            // no other operation keeps a polynomial one
            Expr::Unary(..) | Expr::Binary(..) | Expr::Lookup(..) => return None,
        })
    }

    fn sum(&mut self, a: Polynomial, b: Polynomial) -> Polynomial {
        std::array::from_fn(|k| match (a[k], b[k]) {
            (Some(a), Some(b)) => Some(self.joined(Binary::Add, a, b)),
            (term, None) | (None, term) => term,
        })
    }

    fn difference(&mut self, a: Polynomial, b: Polynomial) -> Polynomial {
        std::array::from_fn(|k| match (a[k], b[k]) {
            (Some(a), Some(b)) => Some(self.joined(Binary::Sub, a, b)),
            (None, Some(b)) => Some(Term { value: self.graph.unary(Unary::Neg, b.value), ..b }),
            (term, None) => term,
        })
    }

    /// A sum or difference with its own rounding.
    fn joined(&mut self, op: Binary, a: Term, b: Term) -> Term {
        let value = self.graph.binary(op, a.value, b.value);
        let own = self.rounding(value);
        let brought = self.added(a.error, b.error);
        Term { value, error: self.added(brought, Some(own)) }
    }

    fn product(&mut self, a: Polynomial, b: Polynomial) -> Option<Polynomial> {
        let degree = |p: &Polynomial| (0..3).rev().find(|&k| p[k].is_some());
        let (Some(n), Some(m)) = (degree(&a), degree(&b)) else { return Some([None; 3]) };
        if n + m > 2 {
            return None;
        }
        Some(std::array::from_fn(|k| {
            let pairs = (0..=k).filter_map(|i| Some((a[i]?, b[k - i]?)));
            let products: Vec<Term> = pairs.map(|(a, b)| self.times(a, b)).collect();
            products.into_iter().reduce(|sum, next| self.joined(Binary::Add, sum, next))
        }))
    }

    /// (a ± α)(b ± β): |a|β + (|b| + β)α, and the rounding of ab.
    fn times(&mut self, a: Term, b: Term) -> Term {
        let value = self.graph.binary(Binary::Mul, a.value, b.value);
        let own = self.rounding_or_underflow(value);
        let from_b = b.error.map(|error| self.scaled(error, a.value));
        let from_a = a.error.map(|error| {
            let plain = self.scaled(error, b.value);
            let both = b.error.map(|other| self.graph.binary(Binary::Mul, error, other));
            self.added(Some(plain), both).unwrap_or(plain)
        });
        let brought = self.added(from_a, from_b);
        Term { value, error: self.added(brought, Some(own)) }
    }

    fn quotient(&mut self, a: Term, divisor: Node) -> Term {
        let value = self.graph.binary(Binary::Div, a.value, divisor);
        let own = self.rounding_or_underflow(value);
        let magnitude = self.graph.unary(Unary::Abs, divisor);
        let brought = a.error.map(|error| self.graph.binary(Binary::Div, error, magnitude));
        Term { value, error: self.added(brought, Some(own)) }
    }

    /// ε|v|
    fn rounding(&mut self, value: Node) -> Node {
        let epsilon = self.graph.constant(ROUNDING);
        self.scaled(epsilon, value)
    }

    /// ε|v| of a product or quotient, and the digits that it loses below the range of normal numbers: what
    /// multiplies it later makes them count.
    fn rounding_or_underflow(&mut self, value: Node) -> Node {
        let own = self.rounding(value);
        let least = self.graph.constant(f64::MIN_POSITIVE);
        self.graph.binary(Binary::Add, own, least)
    }

    /// bound·|v|
    fn scaled(&mut self, bound: Node, value: Node) -> Node {
        let magnitude = self.graph.unary(Unary::Abs, value);
        self.graph.binary(Binary::Mul, bound, magnitude)
    }

    fn added(&mut self, a: Option<Node>, b: Option<Node>) -> Option<Node> {
        match (a, b) {
            (Some(a), Some(b)) => Some(self.graph.binary(Binary::Add, a, b)),
            (term, None) | (None, term) => term,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::{Interpreter, exact};
    use proptest::prelude::*;

    /// ((x − 1e3)(y + z) − 3x)/7 + 2 − z²
    fn sample() -> (Graph, Node) {
        let mut g = Graph::default();
        let (x, y, z) = (g.coordinate(Axis::X), g.coordinate(Axis::Y), g.coordinate(Axis::Z));
        let (thousand, three, seven, two) =
            (g.constant(1e3), g.constant(3.0), g.constant(7.0), g.constant(2.0));
        let shifted = g.binary(Binary::Sub, x, thousand);
        let sum = g.binary(Binary::Add, y, z);
        let product = g.binary(Binary::Mul, shifted, sum);
        let plane = g.binary(Binary::Mul, three, x);
        let top = g.binary(Binary::Sub, product, plane);
        let quotient = g.binary(Binary::Div, top, seven);
        let square = g.binary(Binary::Mul, z, z);
        let rest = g.binary(Binary::Sub, two, square);
        let root = g.binary(Binary::Add, quotient, rest);
        (g, root)
    }

    proptest! {
        /// The polynomial at t against the leaf at that point of the path, both with 400 bits.
        #[test]
        fn exact_values_are_within_the_bounds(
            from in prop::array::uniform3(-1e4..1e4f64),
            step in prop::array::uniform3(-1.0..1.0f64),
            t in 0..=64u32,
        ) {
            let (mut graph, root) = sample();
            let outputs = polynomial_on_path(&mut graph, root, 0).unwrap();
            // t, the point and its coordinates are exact when the path is made of multiples of 2⁻²⁰
            let round = |v: f64| (v * f64::from(1 << 20)).round() / f64::from(1 << 20);
            let (from, step) = (from.map(round), step.map(round));
            let mut c = [0.0; 6];
            Interpreter::new(&graph, &outputs).eval_with(from, &step, &mut c);
            let t = f64::from(t) / 64.0;
            let at: [f64; 3] = std::array::from_fn(|i| from[i] + t * step[i]);
            let truth = &exact::evaluate(&graph, &[root], at).unwrap()[0];
            let found = c[0] + t * c[1] + t * t * c[2];
            let bound = c[3] + t * c[4] + t * t * c[5];
            // the sum formed here has roundings of its own
            let own = 4.0 * f64::EPSILON * (c[0].abs() + c[1].abs() + c[2].abs());
            prop_assert!(truth.error_of(found) <= bound + own, "{found} {bound}");
            // and the bound is worth something: a few ε of the largest intermediate value, 1e3·2e4
            prop_assert!(bound < 1e-7, "{bound}");
        }
    }

    #[test]
    fn only_polynomials_of_low_degree_are_taken() {
        let mut g = Graph::default();
        let x = g.coordinate(Axis::X);
        let square = g.binary(Binary::Mul, x, x);
        let cube = g.binary(Binary::Mul, square, x);
        let root = g.unary(Unary::Sqrt, square);
        let inverse = g.binary(Binary::Div, square, x);
        assert!(polynomial_on_path(&mut g, square, 0).is_some());
        for other in [cube, root, inverse] {
            assert!(polynomial_on_path(&mut g, other, 0).is_none());
        }
    }
}
