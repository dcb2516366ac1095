//! How the nodes of a graph are read.

use crate::ir::bounds::range::{Affine, RangeRule};
use crate::ir::function::BinaryFunction;
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::op::Binary;

/// How a node is computed from others.
#[derive(Debug, Clone, Copy)]
pub enum Rule {
    /// By its operation.
    Plain(Expr),
    /// A whole power of a node, written as products.
    Power { of: Node, exponent: u32 },
    /// (±e + q)·(±e + s) of one node e.
    Slab { of: Node, first: Affine, second: Affine },
}

/// What a node is in terms of the coordinates of space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Degree {
    /// It does not depend on them.
    Number,
    /// A linear form of them.
    Linear,
    /// Neither is known of it.
    Other,
}

impl Rule {
    /// The rules of all nodes.
    pub fn all(graph: &Graph) -> Vec<Self> {
        let mut rules: Vec<Self> = Vec::with_capacity(graph.len());
        for (_, expr) in graph.nodes() {
            let power_of = |node: Node| match rules[node.index()] {
                Self::Power { of, exponent } => (of, exponent),
                Self::Plain(_) | Self::Slab { .. } => (node, 1),
            };
            let rule = match (expr, RangeRule::of(graph, expr)) {
                (Expr::Binary(Binary::Mul, a, b), _) if power_of(a).0 == power_of(b).0 => {
                    let ((of, m), (_, n)) = (power_of(a), power_of(b));
                    Self::Power { of, exponent: m.saturating_add(n) }
                }
                (_, RangeRule::Slab { of, first, second }) => Self::Slab { of, first, second },
                (_, RangeRule::Square(_) | RangeRule::Plain(_)) => Self::Plain(expr),
            };
            rules.push(rule);
        }
        rules
    }

    /// The nodes that it reads.
    pub fn operands(self) -> impl Iterator<Item = Node> {
        let (expr, of) = match self {
            Self::Plain(expr) => (Some(expr), None),
            Self::Power { of, .. } | Self::Slab { of, .. } => (None, Some(of)),
        };
        expr.into_iter().flat_map(Expr::operands).chain(of)
    }

    /// The operands without which it is not a number. The others may be undefined at a point where it has a
    /// value: 1^y is 1 even if y is not a number.
    pub fn needed(self, graph: &Graph) -> impl Iterator<Item = Node> {
        let never = |node: Node, number: f64| graph.as_constant(node).is_some_and(|c| c != number);
        let (needs_first, needs_second) = match self {
            Self::Plain(Expr::Binary(op, a, b)) => match op {
                Binary::Call(BinaryFunction::Pow) => (never(b, 0.0), never(a, 1.0)),
                Binary::DivOrZero | Binary::MulOrZero => (false, true),
                Binary::MinWeight
                | Binary::MaxWeight
                | Binary::AndWeight
                | Binary::OrWeight
                | Binary::PlainMin
                | Binary::PlainMax => (false, false),
                Binary::Call(BinaryFunction::Atan2)
                | Binary::Add
                | Binary::Sub
                | Binary::Mul
                | Binary::Div
                | Binary::Min
                | Binary::Max
                | Binary::And
                | Binary::Or => (true, true),
            },
            Self::Plain(_) | Self::Power { .. } | Self::Slab { .. } => (true, true),
        };
        let is_needed = [needs_first, needs_second];
        self.operands().zip(is_needed).filter_map(|(node, needed)| needed.then_some(node))
    }

    /// The degree of a node with this rule, given those of its operands.
    pub fn degree(self, of: impl Fn(Node) -> Degree) -> Degree {
        use Degree::{Linear, Number, Other};
        match self {
            Self::Plain(Expr::Coordinate(Axis::X | Axis::Y | Axis::Z)) => Linear,
            rule if rule.operands().all(|node| of(node) == Number) => Number,
            Self::Plain(Expr::Unary(crate::ir::Unary::Neg, a)) => of(a),
            Self::Plain(Expr::Binary(Binary::Add | Binary::Sub, a, b)) => match (of(a), of(b)) {
                (Other, Number | Linear | Other) | (Number | Linear, Other) => Other,
                (Number | Linear, Number | Linear) => Linear,
            },
            Self::Plain(Expr::Binary(Binary::Mul, a, b)) => match (of(a), of(b)) {
                (Number, Linear) | (Linear, Number) => Linear,
                (Number, Number) => Number,
                (Linear | Other, Linear | Other) | (Number, Other) | (Other, Number) => Other,
            },
            Self::Plain(Expr::Binary(Binary::Div, a, b)) if of(a) == Linear && of(b) == Number => Linear,
            Self::Plain(_) | Self::Power { .. } | Self::Slab { .. } => Other,
        }
    }
}
