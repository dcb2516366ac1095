//! The operations: each is defined once, here, by its name and its value.
//!
//! The code generator is tested against these values bit for bit. A new operation needs a rule in every
//! analysis (derivative, range, magnitude, rounding error, contraction, enclosure along a path, truth), an
//! instruction, and a form in source text. The compiler names these places, because their matches have no
//! wildcard; only the lists for tests (`Unary::all`, `Binary::all`) and the name in the language
//! (`lower::builtins`) may be forgotten without an error. A function of the mathematical library needs less,
//! see `function`.

use crate::ir::function::{BinaryFunction, UnaryFunction};
use crate::ir::r0;
use crate::ir::real::Real;

/// An operation on one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unary {
    /// −a
    Neg,
    /// |a|
    Abs,
    /// √a
    Sqrt,
    /// −1, 0 or 1; the derivative of |a|, 0 at 0 by convention.
    Sign,
    /// The largest whole number that is not above a.
    Floor,
    /// The nearest whole number; halfway between two the even one.
    Round,
    /// A function of the mathematical library.
    Call(UnaryFunction),
}

/// An operation on two numbers, a and b.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Binary {
    /// a + b
    Add,
    /// a − b
    Sub,
    /// a·b
    Mul,
    /// a/b
    Div,
    /// a/b, and 0 where b = 0: derivatives of roots at their singular point, where the limit set contains 0.
    DivOrZero,
    /// a·b, and 0 where b = 0 whatever a is, even if it is no number: b chooses whether a counts.
    MulOrZero,
    /// The smaller operand; NaN if either is NaN.
    Min,
    /// The larger operand; NaN if either is NaN.
    Max,
    /// The smaller operand, where both are known to be numbers: one instruction.
    PlainMin,
    /// The larger operand, where both are known to be numbers: one instruction.
    PlainMax,
    /// ∂min(a, b)/∂a: 1, ½ or 0 where a is smaller, equal or larger.
    MinWeight,
    /// ∂max(a, b)/∂a: 1, ½ or 0 where a is larger, equal or smaller.
    MaxWeight,
    /// A function of the mathematical library.
    Call(BinaryFunction),
    /// R₀-conjunction a ∧ b, see [`r0::and`].
    And,
    /// R₀-disjunction a ∨ b, see [`r0::or`].
    Or,
    /// ∂(a ∧ b)/∂a, see [`r0::and_weights`].
    AndWeight,
    /// ∂(a ∨ b)/∂a.
    OrWeight,
}

/// An operation of the R₀ system. It is computed in one of several forms, see [`Form`](super::Form).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum R0 {
    /// [`Binary::And`]
    And,
    /// [`Binary::Or`]
    Or,
    /// [`Binary::AndWeight`]
    AndWeight,
    /// [`Binary::OrWeight`]
    OrWeight,
}

impl Unary {
    /// Every operation, for tests.
    pub fn all() -> impl Iterator<Item = Self> {
        let functions = UnaryFunction::ALL.iter().copied().map(Self::Call);
        [Self::Neg, Self::Abs, Self::Sqrt, Self::Sign, Self::Floor, Self::Round].into_iter().chain(functions)
    }

    /// Its name in dumps.
    pub fn name(self) -> &'static str {
        match self {
            Self::Neg => "neg",
            Self::Abs => "abs",
            Self::Sqrt => "sqrt",
            Self::Sign => "sign",
            Self::Floor => "floor",
            Self::Round => "round",
            Self::Call(function) => function.name(),
        }
    }

    /// Whether it is constant between jumps: its derivative is taken to be 0.
    pub fn is_step(self) -> bool {
        match self {
            Self::Sign | Self::Floor | Self::Round => true,
            Self::Neg | Self::Abs | Self::Sqrt | Self::Call(_) => false,
        }
    }

    /// Its value.
    pub fn eval<T: Real>(self, a: T) -> T {
        match self {
            Self::Neg => -a,
            Self::Abs => a.abs(),
            Self::Sqrt => a.sqrt(),
            Self::Sign => sign(a),
            Self::Floor => a.floor(),
            Self::Round => a.round_ties_even(),
            Self::Call(function) => a.call(function),
        }
    }
}

impl From<UnaryFunction> for Unary {
    fn from(function: UnaryFunction) -> Self {
        Self::Call(function)
    }
}

impl From<BinaryFunction> for Binary {
    fn from(function: BinaryFunction) -> Self {
        Self::Call(function)
    }
}

impl Binary {
    /// Every operation, for tests.
    pub fn all() -> impl Iterator<Item = Self> {
        let instructions = [
            Self::Add,
            Self::Sub,
            Self::Mul,
            Self::Div,
            Self::DivOrZero,
            Self::MulOrZero,
            Self::Min,
            Self::Max,
            Self::PlainMin,
            Self::PlainMax,
            Self::MinWeight,
            Self::MaxWeight,
            Self::And,
            Self::Or,
            Self::AndWeight,
            Self::OrWeight,
        ];
        instructions.into_iter().chain(BinaryFunction::ALL.iter().copied().map(Self::Call))
    }

    /// Its name in dumps.
    pub fn name(self) -> &'static str {
        match self {
            Self::Add => "add",
            Self::Sub => "sub",
            Self::Mul => "mul",
            Self::Div => "div",
            Self::DivOrZero => "div_or_zero",
            Self::MulOrZero => "mul_or_zero",
            Self::Min => "min",
            Self::Max => "max",
            Self::PlainMin => "plain_min",
            Self::PlainMax => "plain_max",
            Self::MinWeight => "min_weight",
            Self::MaxWeight => "max_weight",
            Self::Call(function) => function.name(),
            Self::And => "r0_and",
            Self::Or => "r0_or",
            Self::AndWeight => "r0_and_weight",
            Self::OrWeight => "r0_or_weight",
        }
    }

    /// Whether swapping the operands gives the same bits.
    pub fn commutes(self) -> bool {
        use Binary::{Add, And, Max, Min, Mul, Or, PlainMax, PlainMin};
        matches!(self, Add | Mul | Min | Max | PlainMin | PlainMax | And | Or)
    }

    /// The operation of the R₀ system that it is, if it is one.
    pub fn r0(self) -> Option<R0> {
        match self {
            Self::And => Some(R0::And),
            Self::Or => Some(R0::Or),
            Self::AndWeight => Some(R0::AndWeight),
            Self::OrWeight => Some(R0::OrWeight),
            Self::Add
            | Self::Sub
            | Self::Mul
            | Self::Div
            | Self::DivOrZero
            | Self::MulOrZero
            | Self::Min
            | Self::Max
            | Self::PlainMin
            | Self::PlainMax
            | Self::MinWeight
            | Self::MaxWeight
            | Self::Call(_) => None,
        }
    }

    /// Its value, with R₀ in its stable form.
    // Inlined always, with what it calls: the loops over columns are compiled for several instruction sets,
    // and a call in them would be made for each number.
    #[inline(always)]
    pub fn eval<T: Real>(self, a: T, b: T) -> T {
        let zero = T::from_f64(0.0);
        match self {
            Self::Add => a + b,
            Self::Sub => a - b,
            Self::Mul => a * b,
            Self::Div => a / b,
            Self::DivOrZero => {
                if b == zero {
                    zero
                } else {
                    a / b
                }
            }
            Self::MulOrZero => {
                if b == zero {
                    zero
                } else {
                    a * b
                }
            }
            Self::Min => ordered(a < b, a, b),
            Self::Max => ordered(a > b, a, b),
            Self::PlainMin => {
                if a < b {
                    a
                } else {
                    b
                }
            }
            Self::PlainMax => {
                if b < a {
                    a
                } else {
                    b
                }
            }
            Self::MinWeight => weight(a < b, a, b),
            Self::MaxWeight => weight(a > b, a, b),
            Self::Call(function) => a.call_with(function, b),
            Self::And => r0::and(a, b),
            Self::Or => r0::or(a, b),
            Self::AndWeight => r0::and_weights(a, b).0,
            Self::OrWeight => r0::or_weights(a, b).0,
        }
    }
}

fn sign<T: Real>(a: T) -> T {
    let zero = T::from_f64(0.0);
    if a > zero {
        T::from_f64(1.0)
    } else if a < zero {
        T::from_f64(-1.0)
    } else {
        a // ±0 and NaN
    }
}

/// The first operand if it was found to be the one sought; the other otherwise, but never a number for a NaN.
#[allow(clippy::eq_op)]
#[inline(always)]
fn ordered<T: Real>(first: bool, a: T, b: T) -> T {
    if first {
        a
    } else if a == a {
        b
    } else {
        a
    }
}

#[inline(always)]
fn weight<T: Real>(first: bool, a: T, b: T) -> T {
    if first {
        T::from_f64(1.0)
    } else if a == b {
        T::from_f64(0.5)
    } else {
        T::from_f64(0.0)
    }
}
