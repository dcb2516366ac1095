//! The instructions of range programs, one for each node of a graph, and whether all results stay finite.
//!
//! Only graphs are accepted whose nodes are all finite over [`REACH`], and so small that no square overflows.

use std::collections::HashMap;

use glam::DVec3;

use super::functions::RangeFunction;
use crate::geom::Aabb;
use crate::ir::{
    Affine, Axis, Binary, BinaryFunction, Choice, Expr, Graph, Limits, Node, RangeEvaluator, RangeRule,
    Region, Unary, UnaryFunction,
};

/// Machine code answers for boxes within this distance of the origin.
pub const REACH: f64 = 1e9;

/// Values beyond this might overflow in a product or in the bound of one.
const LARGEST: f64 = 1e300;

/// Operands of R₀ beyond this might have squares that overflow.
const LARGEST_OPERAND: f64 = 1e150;

/// Divisors nearer to 0 are left to the interpreter.
pub(super) const LEAST_DIVISOR: f64 = 1e-60;

/// Values of called functions at or above this are left to the interpreter, too.
pub(super) const LARGEST_CALL: f64 = 1e60;

/// Whether machine code can answer for this graph.
pub fn supports(graph: &Graph, root: Node) -> bool {
    knows(graph) && stays_finite(graph, &RangeEvaluator::new(graph, root), Region::of(&Aabb::EMPTY))
}

/// Whether every operation of a graph is one that range programs have.
pub fn knows(graph: &Graph) -> bool {
    Instructions::of(graph).is_some()
}

/// The instruction of a range program for one node.
#[derive(Clone, Copy)]
pub(super) enum Instruction {
    Constant(f64),
    /// The range of x, y or z: its number.
    Coordinate(usize),
    Parameter(u32),
    Uniform(u32),
    Square(Node),
    Slab {
        of: Node,
        first: Affine,
        second: Affine,
    },
    Unary(RangeUnary, Node),
    Binary(RangeBinary, Node, Node),
    /// A quotient by a constant or a parameter.
    Divide(Node, Node),
    /// A quotient by a node that may vanish. Where the node is within [`LEAST_DIVISOR`] of 0 the program has
    /// no answer.
    Quotient(Node, Node),
    /// The share of the first in the smaller of both: a derivative.
    Share(Node, Node),
    /// One of two values: the first where a share is 1, the second where it is 0, and anything between them
    /// otherwise.
    Choice {
        values: [Node; 2],
        share: Node,
    },
    /// A called function. One with a single operand has it twice.
    Call(RangeFunction, [Node; 2]),
}

/// The operations on one range.
#[derive(Clone, Copy)]
pub(super) enum RangeUnary {
    Neg,
    Abs,
    Sqrt,
    Sign,
    Floor,
    Round,
    Atan,
}

/// The operations on two ranges.
#[derive(Clone, Copy)]
pub(super) enum RangeBinary {
    Add,
    Sub,
    Mul,
    MulOrZero,
    Min,
    Max,
    And,
    Or,
    AndWeight,
    OrWeight,
    Atan2,
}

/// The instructions for all nodes of a graph, in its order.
#[derive(Default)]
pub(in crate::codegen) struct Instructions(pub(super) Vec<Instruction>);

impl Instructions {
    /// `None` if the graph has an operation that range programs lack.
    pub fn of(graph: &Graph) -> Option<Self> {
        let choices: HashMap<Node, Choice> = Choice::all(graph).into_iter().map(|c| (c.node(), c)).collect();
        let instruction = |(node, expr)| {
            let choice = choices.get(&node).and_then(|choice| Instruction::choice(graph, choice));
            choice.or_else(|| Instruction::of(graph, expr))
        };
        graph.nodes().map(instruction).collect::<Option<_>>().map(Self)
    }
}

impl Instruction {
    /// `None` if the graph does not restrict its share.
    fn choice(graph: &Graph, choice: &Choice) -> Option<Self> {
        let (share, one) = choice.share();
        let is_share = matches!(graph.expr(share), Expr::Binary(Binary::MinWeight | Binary::MaxWeight, ..));
        (is_share && graph.as_constant(one) == Some(1.0))
            .then(|| Self::Choice { values: choice.values(), share })
    }

    fn of(graph: &Graph, expr: Expr) -> Option<Self> {
        Some(match RangeRule::of(graph, expr) {
            RangeRule::Square(a) => Self::Square(a),
            RangeRule::Slab { of, first, second } => Self::Slab { of, first, second },
            RangeRule::Plain(Expr::Constant(bits)) => Self::Constant(f64::from_bits(bits)),
            RangeRule::Plain(Expr::Coordinate(axis)) => {
                Self::Coordinate(Axis::SPACE.into_iter().position(|place| place == axis)?)
            }
            RangeRule::Plain(Expr::Parameter(i)) => Self::Parameter(i),
            RangeRule::Plain(Expr::Uniform(i)) => Self::Uniform(i),
            RangeRule::Plain(Expr::Unary(op, a)) => Self::unary(op, a),
            RangeRule::Plain(Expr::Binary(Binary::Div, a, b)) => match graph.expr(b) {
                Expr::Constant(_) | Expr::Parameter(_) => Self::Divide(a, b),
                Expr::Coordinate(_)
                | Expr::Uniform(_)
                | Expr::Unary(..)
                | Expr::Binary(..)
                | Expr::Lookup(..) => Self::Quotient(a, b),
            },
            RangeRule::Plain(Expr::Binary(Binary::DivOrZero, a, b)) => Self::Quotient(a, b),
            RangeRule::Plain(Expr::Binary(Binary::MinWeight, a, b)) => Self::Share(a, b),
            RangeRule::Plain(Expr::Binary(Binary::MaxWeight, a, b)) => Self::Share(b, a),
            RangeRule::Plain(Expr::Binary(Binary::Call(function @ BinaryFunction::Pow), a, b)) => {
                Self::Call(RangeFunction::Binary(function), [a, b])
            }
            RangeRule::Plain(Expr::Binary(op, a, b)) => Self::Binary(RangeBinary::of(op)?, a, b),
            RangeRule::Plain(Expr::Lookup(..)) => return None,
        })
    }

    fn unary(op: Unary, a: Node) -> Self {
        let op = match op {
            Unary::Neg => RangeUnary::Neg,
            Unary::Abs => RangeUnary::Abs,
            Unary::Sqrt => RangeUnary::Sqrt,
            Unary::Floor => RangeUnary::Floor,
            Unary::Round => RangeUnary::Round,
            Unary::Sign => RangeUnary::Sign,
            Unary::Call(UnaryFunction::Atan) => RangeUnary::Atan,
            Unary::Call(function) => return Self::Call(RangeFunction::Unary(function), [a, a]),
        };
        Self::Unary(op, a)
    }
}

impl RangeBinary {
    fn of(op: Binary) -> Option<Self> {
        match op {
            Binary::Add => Some(Self::Add),
            Binary::Sub => Some(Self::Sub),
            Binary::Mul => Some(Self::Mul),
            Binary::MulOrZero => Some(Self::MulOrZero),
            Binary::Min | Binary::PlainMin => Some(Self::Min),
            Binary::Max | Binary::PlainMax => Some(Self::Max),
            Binary::And => Some(Self::And),
            Binary::Or => Some(Self::Or),
            Binary::AndWeight => Some(Self::AndWeight),
            Binary::OrWeight => Some(Self::OrWeight),
            Binary::Call(BinaryFunction::Atan2) => Some(Self::Atan2),
            Binary::Div
            | Binary::DivOrZero
            | Binary::MinWeight
            | Binary::MaxWeight
            | Binary::Call(BinaryFunction::Pow) => None,
        }
    }
}

/// Whether no bound can overflow for a box within [`REACH`], for these parameters and uniforms, where the
/// program has an answer. A quotient by a node that may vanish is assumed to be as large as [`LEAST_DIVISOR`]
/// allows; a quotient by a number that is zero is not finite. Roots are those of positive numbers, and called
/// functions are below [`LARGEST_CALL`].
pub fn stays_finite(graph: &Graph, evaluator: &RangeEvaluator, numbers: Region<'_>) -> bool {
    let space = Aabb::new(DVec3::splat(-REACH), DVec3::splat(REACH));
    let limits = Limits { least_divisor: LEAST_DIVISOR, largest_call: LARGEST_CALL };
    let ranges = evaluator.all_within(&Region { space: &space, ..numbers }, limits);
    let within = |node: Node, limit: f64| {
        let range = ranges[node.index()];
        range.lo > -limit && range.hi < limit
    };
    graph.nodes().all(|(node, expr)| {
        let operands_fit = match expr {
            Expr::Binary(Binary::And | Binary::Or, a, b) => {
                within(a, LARGEST_OPERAND) && within(b, LARGEST_OPERAND)
            }
            // all others overflow only if their result does
            Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..)
            | Expr::Unary(..)
            | Expr::Binary(
                Binary::Add
                | Binary::Sub
                | Binary::Mul
                | Binary::Div
                | Binary::DivOrZero
                | Binary::MulOrZero
                | Binary::Min
                | Binary::Max
                | Binary::PlainMin
                | Binary::PlainMax
                | Binary::MinWeight
                | Binary::MaxWeight
                | Binary::Call(_)
                | Binary::AndWeight
                | Binary::OrWeight,
                ..,
            ) => true,
        };
        operands_fit && within(node, LARGEST)
    })
}
