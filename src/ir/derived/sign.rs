//! How the sign of ω follows from the signs of its leaves.

use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// How the sign of a node follows from its operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignRule {
    /// ∧ and min: the sign of the smaller operand.
    All(Node, Node),
    /// ∨ and max: the sign of the larger operand.
    Any(Node, Node),
    /// The opposite sign of the operand.
    Not(Node),
    /// A product or quotient with a positive constant: the sign of the other operand.
    Same(Node),
    /// The value itself has to be computed.
    Leaf,
}

impl SignRule {
    /// The rule for a node of a graph.
    pub fn of(graph: &Graph, node: Node) -> Self {
        let positive = |node| graph.as_constant(node).is_some_and(|c| c > 0.0 && c.is_finite());
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
    /// [`SignRule::Same`]; 1 for all other nodes.
    pub fn factor(graph: &Graph, node: Node) -> f64 {
        let Self::Same(operand) = Self::of(graph, node) else { return 1.0 };
        let expr = graph.expr(node);
        let constant =
            expr.operands().find(|other| *other != operand).and_then(|other| graph.as_constant(other));
        let constant = constant.unwrap_or(1.0);
        if matches!(expr, Expr::Binary(Binary::Div, ..)) { 1.0 / constant } else { constant }
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
