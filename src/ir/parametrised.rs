//! A graph whose constants are parameters: what differs in its constants alone is then one program.

use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::diagnostic::Span;
use crate::ir::function::BinaryFunction;
use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

impl Graph {
    /// The graph with each use of a constant replaced by a parameter of its own; and the constants. An exponent of 0 stays,
    /// because a power needs its base with all others. Nodes are in the order of a walk from the root, operands first, so
    /// that graphs of one shape give the same result here, whatever else is in the graph they come from and whichever of
    /// their constants happen to be equal. Nor do the signs of constants matter: differences with a number or with its
    /// product become sums.
    pub fn parametrised(&self, root: Node) -> (Self, Node, Vec<f64>) {
        let mut walk = Parametrisation {
            graph: self,
            out: Self::like(self),
            constants: Vec::new(),
            image: FxHashMap::default(),
        };
        let mut stack = vec![(root, false)];
        while let Some((node, operands_done)) = stack.pop() {
            if walk.image.contains_key(&node) {
                continue;
            }
            if !operands_done && node != root && self.as_constant(node).is_some() {
                continue; // its users make their own parameter of it
            }
            let term = SignedTerm::of(self, node);
            if operands_done {
                let new = walk.written(term, self.span(node));
                walk.image.insert(node, new);
            } else {
                stack.push((node, true));
                let operands: SmallVec<[Node; 2]> = term.operands().collect();
                stack.extend(operands.into_iter().rev().map(|operand| (operand, false)));
            }
        }
        (walk.out, walk.image[&root], walk.constants)
    }
}

/// A node of a graph, with the signs of constants left to the constants. Each of these has the bits of the node:
/// a − c is a + (−c), −(k·b) is (−k)·b, and k·b is b·k.
#[derive(Clone, Copy)]
enum SignedTerm {
    Plain(Expr),
    /// a + number
    Sum(Node, f64),
    /// number · b
    Product(f64, Node),
    /// a + number · b
    SumWithProduct(Node, f64, Node),
}

impl SignedTerm {
    fn of(graph: &Graph, node: Node) -> Self {
        let product = |node: Node| match graph.expr(node) {
            Expr::Binary(Binary::Mul, a, b) => match (graph.as_constant(a), graph.as_constant(b)) {
                (Some(number), None) => Some((number, b)),
                (None, Some(number)) => Some((number, a)),
                (Some(_), Some(_)) | (None, None) => None,
            },
            _ => None,
        };
        let is_number = |node: Node| graph.as_constant(node).is_some();
        match graph.expr(node) {
            Expr::Binary(Binary::Sub, a, b) if !is_number(a) => match (graph.as_constant(b), product(b)) {
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

/// A walk that makes parameters of constants.
struct Parametrisation<'g> {
    graph: &'g Graph,
    out: Graph,
    constants: Vec<f64>,
    image: FxHashMap<Node, Node>,
}

impl Parametrisation<'_> {
    fn parameter(&mut self, number: f64, span: Option<Span>) -> Node {
        self.constants.push(number);
        self.out.intern(Expr::Parameter(self.constants.len() as u32 - 1), span)
    }

    /// The image of an operand; a constant gets a parameter of its own.
    fn operand(&mut self, node: Node, span: Option<Span>) -> Node {
        match self.graph.as_constant(node) {
            Some(number) => self.parameter(number, span),
            None => self.image[&node],
        }
    }

    fn product(&mut self, number: f64, node: Node, span: Option<Span>) -> Node {
        let node = self.image[&node];
        let number = self.parameter(number, span);
        self.out.intern(Expr::Binary(Binary::Mul, node, number), span)
    }

    fn written(&mut self, term: SignedTerm, span: Option<Span>) -> Node {
        match term {
            SignedTerm::Plain(Expr::Constant(bits)) => self.parameter(f64::from_bits(bits), span),
            SignedTerm::Plain(Expr::Binary(op @ Binary::Call(BinaryFunction::Pow), a, b))
                if self.graph.as_constant(b) == Some(0.0) =>
            {
                let a = self.operand(a, span);
                let none = self.out.constant(0.0);
                self.out.intern(Expr::Binary(op, a, none), span)
            }
            SignedTerm::Plain(expr) => {
                let mapped = expr.map(|operand| self.operand(operand, span));
                self.out.intern(mapped, span)
            }
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
}
