//! The rules by which the nodes of a graph are computed.

use crate::interval::Interval;
use crate::ir::bounds::range::{Affine, RangeRule};
use crate::ir::function::BinaryFunction;
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// The rule by which a node is computed from others.
#[derive(Debug, Clone, Copy)]
pub enum Rule {
    /// By its operation.
    Plain(Expr),
    /// A whole power of a node, written as products.
    Power { of: Node, exponent: u32 },
    /// (±e + q)·(±e + s) of one node e.
    Slab { of: Node, first: Affine, second: Affine },
}

/// The degree of a node in the coordinates of space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Degree {
    /// It does not depend on them.
    Number,
    /// A linear form of them.
    Linear,
    /// Neither is known.
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

    /// The operands that must be numbers for it to be one. The others may be undefined at a point where it
    /// has a value: 1^y is 1 even if y is not a number.
    pub fn needed(self, graph: &Graph) -> impl Iterator<Item = Node> {
        let never = |node: Node, number: f64| graph.as_constant(node).is_some_and(|c| c != number);
        // a constant exponent of 0 is made no parameter
        let is_given = |node: Node| matches!(graph.expr(node), Expr::Parameter(_));
        let (needs_first, needs_second) = match self {
            Self::Plain(Expr::Binary(op, a, b)) => match op {
                Binary::Call(BinaryFunction::Pow) => (never(b, 0.0) || is_given(b), never(a, 1.0)),
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
        let is_needed = [needs_first, needs_second, true];
        self.operands().zip(is_needed).filter_map(|(node, needed)| needed.then_some(node))
    }

    /// Whether a node with this rule may be infinite where its operands are numbers, if its range is not
    /// bounded: an operand is infinite, bounded operands overflow, or it has a pole.
    pub fn may_be_infinite(self, of: impl Fn(Node) -> Interval, infinite: impl Fn(Node) -> bool) -> bool {
        let has_pole = match self {
            Self::Plain(Expr::Unary(Unary::Call(function), _)) => function.has_pole(),
            Self::Plain(Expr::Binary(Binary::Call(function), ..)) => function.has_pole(),
            Self::Plain(_) | Self::Power { .. } | Self::Slab { .. } => false,
        };
        let is_read = self.operands().next().is_none();
        let is_unbounded = |node| !of(node).is_bounded();
        has_pole || self.operands().any(infinite) || !is_read && !self.operands().any(is_unbounded)
    }

    /// Whether it is undefined where one of its operands is infinite: ∞ − ∞, also within R₀, 0·∞, ∞/∞ or the
    /// sine of ∞.
    pub fn fails_at_infinity(self, of: impl Fn(Node) -> Interval, infinite: impl Fn(Node) -> bool) -> bool {
        match self {
            Self::Plain(Expr::Binary(op, a, b)) => match op {
                Binary::Add
                | Binary::Sub
                | Binary::Div
                | Binary::DivOrZero
                | Binary::And
                | Binary::Or
                | Binary::AndWeight
                | Binary::OrWeight => infinite(a) && infinite(b),
                Binary::Mul | Binary::MulOrZero => {
                    infinite(a) && of(b).contains(0.0) || infinite(b) && of(a).contains(0.0)
                }
                Binary::Min
                | Binary::Max
                | Binary::PlainMin
                | Binary::PlainMax
                | Binary::MinWeight
                | Binary::MaxWeight
                | Binary::Call(BinaryFunction::Pow | BinaryFunction::Atan2) => false,
            },
            Self::Plain(Expr::Unary(Unary::Call(function), a)) => function.fails_at_infinity() && infinite(a),
            Self::Plain(Expr::Lookup(_, at)) => at.into_iter().any(infinite),
            // (±e + q)·(±e + s): the sum of an infinite e and a number is infinite
            Self::Plain(_) | Self::Power { .. } | Self::Slab { .. } => false,
        }
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
