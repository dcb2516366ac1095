//! A graph whose constants are parameters: what differs in its constants alone is then one program.

use std::ops::Neg;

use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::diagnostic::Span;
use crate::ir::function::BinaryFunction;
use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// A number that is the same at every point.
#[derive(Debug, Clone, Copy)]
pub enum Scalar {
    Constant(f64),
    Uniform {
        index: u32,
        /// Whether it is the negative of the uniform.
        negated: bool,
    },
}

/// To the bit, so that −0 is another number than 0.
impl PartialEq for Scalar {
    fn eq(&self, other: &Self) -> bool {
        match (*self, *other) {
            (Self::Constant(a), Self::Constant(b)) => a.to_bits() == b.to_bits(),
            (Self::Uniform { index: a, negated: of_a }, Self::Uniform { index: b, negated: of_b }) => {
                (a, of_a) == (b, of_b)
            }
            (Self::Constant(_), Self::Uniform { .. }) | (Self::Uniform { .. }, Self::Constant(_)) => false,
        }
    }
}

impl Neg for Scalar {
    type Output = Self;

    fn neg(self) -> Self {
        match self {
            Self::Constant(value) => Self::Constant(-value),
            Self::Uniform { index, negated } => Self::Uniform { index, negated: !negated },
        }
    }
}

impl Graph {
    /// The graph with each use of a constant replaced by a parameter of its own; and the constants. An exponent of 0 stays,
    /// because a power needs its base with all others. Nodes are in the order of a walk from the root, operands first, so
    /// that graphs of one shape give the same result here, whatever else is in the graph they come from and whichever of
    /// their constants happen to be equal. Nor do the signs of constants matter: differences with a number or with its
    /// product become sums.
    pub fn parametrised(&self, root: Node) -> (Self, Node, Vec<f64>) {
        self.with_parameters(root, Self::as_constant)
    }

    /// Like [`Self::parametrised`], with uniforms as numbers beside the constants: parts that differ in what time or params
    /// give them then have one shape, too.
    pub fn parametrised_with_uniforms(&self, root: Node) -> (Self, Node, Vec<Scalar>) {
        self.with_parameters(root, Self::as_scalar)
    }

    /// The number that a node is at every point.
    pub fn as_scalar(&self, node: Node) -> Option<Scalar> {
        match self.expr(node) {
            Expr::Constant(bits) => Some(Scalar::Constant(f64::from_bits(bits))),
            Expr::Uniform(index) => Some(Scalar::Uniform { index, negated: false }),
            Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Unary(..)
            | Expr::Binary(..)
            | Expr::Lookup(..) => None,
        }
    }

    fn with_parameters<N: Copy + Neg<Output = N>>(
        &self,
        root: Node,
        number: fn(&Self, Node) -> Option<N>,
    ) -> (Self, Node, Vec<N>) {
        let mut walk = Parametrisation {
            graph: self,
            number,
            out: Self::like(self),
            numbers: Vec::new(),
            image: FxHashMap::default(),
        };
        let mut stack = vec![(root, false)];
        while let Some((node, operands_done)) = stack.pop() {
            if walk.image.contains_key(&node) {
                continue;
            }
            if !operands_done && node != root && number(self, node).is_some() {
                continue; // its users make their own parameter of it
            }
            let term = SignedTerm::of(self, node, number);
            if operands_done {
                let new = walk.written(node, term, self.span(node));
                walk.image.insert(node, new);
            } else {
                stack.push((node, true));
                let operands: SmallVec<[Node; 2]> = term.operands().collect();
                stack.extend(operands.into_iter().rev().map(|operand| (operand, false)));
            }
        }
        (walk.out, walk.image[&root], walk.numbers)
    }
}

/// A node of a graph, with the signs of numbers left to the numbers. Each of these has the bits of the node:
/// a − c is a + (−c), −(k·b) is (−k)·b, and k·b is b·k.
#[derive(Clone, Copy)]
enum SignedTerm<N> {
    Plain(Expr),
    /// a + number
    Sum(Node, N),
    /// number · b
    Product(N, Node),
    /// a + number · b
    SumWithProduct(Node, N, Node),
}

impl<N: Copy + Neg<Output = N>> SignedTerm<N> {
    fn of(graph: &Graph, node: Node, number: fn(&Graph, Node) -> Option<N>) -> Self {
        let product = |node: Node| match graph.expr(node) {
            Expr::Binary(Binary::Mul, a, b) => match (number(graph, a), number(graph, b)) {
                (Some(number), None) => Some((number, b)),
                (None, Some(number)) => Some((number, a)),
                (Some(_), Some(_)) | (None, None) => None,
            },
            _ => None,
        };
        let is_number = |node: Node| number(graph, node).is_some();
        match graph.expr(node) {
            Expr::Binary(Binary::Sub, a, b) if !is_number(a) => match (number(graph, b), product(b)) {
                (Some(number), _) => Self::Sum(a, -number),
                (None, Some((number, b))) => Self::SumWithProduct(a, -number, b),
                (None, None) => Self::Plain(graph.expr(node)),
            },
            Expr::Unary(Unary::Neg, a) => match product(a) {
                Some((number, b)) => Self::Product(-number, b),
                None => Self::Plain(graph.expr(node)),
            },
            // products commute to the bit
            expr => product(node).map_or(Self::Plain(expr), |(number, b)| Self::Product(number, b)),
        }
    }

    fn operands(self) -> impl Iterator<Item = Node> {
        let (expr, nodes) = match self {
            Self::Plain(expr) => (Some(expr), [None, None]),
            Self::Sum(a, _) => (None, [Some(a), None]),
            Self::Product(_, b) => (None, [Some(b), None]),
            Self::SumWithProduct(a, _, b) => (None, [Some(a), Some(b)]),
        };
        expr.into_iter().flat_map(Expr::operands).chain(nodes.into_iter().flatten())
    }
}

/// A walk that makes parameters of numbers.
struct Parametrisation<'g, N> {
    graph: &'g Graph,
    /// The number that a node is, if it becomes a parameter.
    number: fn(&Graph, Node) -> Option<N>,
    out: Graph,
    numbers: Vec<N>,
    image: FxHashMap<Node, Node>,
}

impl<N: Copy + Neg<Output = N>> Parametrisation<'_, N> {
    fn parameter(&mut self, number: N, span: Option<Span>) -> Node {
        self.numbers.push(number);
        self.out.intern(Expr::Parameter(self.numbers.len() as u32 - 1), span)
    }

    /// The image of an operand; a number gets a parameter of its own.
    fn operand(&mut self, node: Node, span: Option<Span>) -> Node {
        match (self.number)(self.graph, node) {
            Some(number) => self.parameter(number, span),
            None => self.image[&node],
        }
    }

    fn product(&mut self, number: N, node: Node, span: Option<Span>) -> Node {
        let node = self.image[&node];
        let number = self.parameter(number, span);
        self.out.intern(Expr::Binary(Binary::Mul, node, number), span)
    }

    fn written(&mut self, node: Node, term: SignedTerm<N>, span: Option<Span>) -> Node {
        match term {
            SignedTerm::Plain(Expr::Binary(op @ Binary::Call(BinaryFunction::Pow), a, b))
                if self.graph.as_constant(b) == Some(0.0) =>
            {
                let a = self.operand(a, span);
                let none = self.out.constant(0.0);
                self.out.intern(Expr::Binary(op, a, none), span)
            }
            SignedTerm::Plain(expr) => match (self.number)(self.graph, node) {
                Some(number) => self.parameter(number, span),
                None => {
                    let mapped = expr.map(|operand| self.operand(operand, span));
                    self.out.intern(mapped, span)
                }
            },
            SignedTerm::Sum(a, number) => {
                let a = self.image[&a];
                let number = self.parameter(number, span);
                self.out.intern(Expr::Binary(Binary::Add, a, number), span)
            }
            SignedTerm::Product(number, b) => self.product(number, b, span),
            SignedTerm::SumWithProduct(a, number, b) => {
                let b = self.product(number, b, span);
                let a = self.image[&a];
                self.out.intern(Expr::Binary(Binary::Add, a, b), span)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::graph::Axis;

    #[test]
    fn shapes_do_not_depend_on_which_constants_are_equal() {
        let mut graph = Graph::default();
        let (x, y) = (graph.coordinate(Axis::X), graph.coordinate(Axis::Y));
        let mut leaf = |a: f64, b: f64| {
            let (a, b) = (graph.constant(a), graph.constant(b));
            let (p, q) = (graph.binary(Binary::Sub, x, a), graph.binary(Binary::Sub, y, b));
            graph.binary(Binary::Mul, p, q)
        };
        // the last has constants that are in the graph already, in the other order
        let roots = [leaf(1.0, 2.0), leaf(3.0, 3.0), leaf(2.0, 1.0)];
        let shapes = roots.map(|root| graph.parametrised(root));
        assert!(shapes.iter().all(|(shape, ..)| shape.exprs() == shapes[0].0.exprs()));
        assert_eq!(shapes.map(|(.., constants)| constants), [[-1.0, -2.0], [-3.0, -3.0], [-2.0, -1.0]]);
    }

    #[test]
    fn shapes_do_not_depend_on_the_signs_of_constants() {
        let mut graph = Graph::default();
        let (x, y) = (graph.coordinate(Axis::X), graph.coordinate(Axis::Y));
        let mut turned = |op: Binary, c: f64, s: f64| {
            let (c, s) = (graph.constant(c), graph.constant(s));
            let (p, q) = (graph.binary(Binary::Mul, c, x), graph.binary(Binary::Mul, s, y));
            graph.binary(op, p, q)
        };
        let roots = [turned(Binary::Sub, 0.25, 0.5), turned(Binary::Add, 0.75, 0.125)];
        let shapes = roots.map(|root| graph.parametrised(root));
        assert_eq!(shapes[0].0.exprs(), shapes[1].0.exprs());
        for ((shape, root, constants), original) in std::iter::zip(&shapes, roots) {
            let at = [0.1, 0.7, 0.0];
            let (mut value, mut expected) = ([0.0], [0.0]);
            let given = crate::ir::Given { parameters: constants, ..crate::ir::Given::point(at) };
            crate::ir::Interpreter::new(shape, &[*root]).eval_given(given, &mut value);
            crate::ir::Interpreter::new(&graph, &[original]).eval_f64(at, &mut expected);
            assert_eq!(value, expected);
        }
    }

    #[test]
    fn what_time_gives_and_what_the_file_gives_are_numbers_of_one_shape() {
        let mut graph = Graph::default();
        let x = graph.coordinate(Axis::X);
        let (one, uniform) = (graph.constant(1.0), graph.intern(Expr::Uniform(7), None));
        let roots = [one, uniform].map(|number| graph.binary(Binary::Sub, x, number));
        let shapes = roots.map(|root| graph.parametrised_with_uniforms(root));
        assert_eq!(shapes[0].0.exprs(), shapes[1].0.exprs());
        let numbers = shapes.map(|(.., numbers)| numbers);
        assert_eq!(numbers, [[Scalar::Constant(-1.0)], [Scalar::Uniform { index: 7, negated: true }]]);
    }
}
