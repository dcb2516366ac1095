//! The operations: each is defined once, here, by its name and its value.
//!
//! The code generator is tested against these values bit for bit. A new operation needs a rule in every
//! analysis (derivative, range, magnitude, rounding error, contraction, enclosure along a path, truth), an
//! instruction, a form in source text, and its place among the words of the language (`lower::builtins`). The
//! compiler names these places, because their matches have no wildcard. A function of the mathematical
//! library needs less, see `function`.

use crate::ir::function::{BinaryFunction, UnaryFunction};
use crate::ir::r0;
use crate::ir::real::Real;

/// Declares operations, one on each line: their variant and their name in dumps. Functions of the
/// mathematical library are operations too.
macro_rules! operations {
    (
        $(#[$meta:meta])*
        pub enum $type:ident with $function:ident {
            $($(#[$variant_meta:meta])* $variant:ident $name:literal;)+
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $type {
            $($(#[$variant_meta])* $variant,)+
            /// A function of the mathematical library.
            Call($function),
        }

        impl $type {
            /// Every operation: those declared here, then the functions.
            pub fn all() -> impl Iterator<Item = Self> {
                let functions = $function::ALL.iter().copied().map(Self::Call);
                [$(Self::$variant),+].into_iter().chain(functions)
            }

            /// Its name in dumps.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                    Self::Call(function) => function.name(),
                }
            }
        }

        impl From<$function> for $type {
            fn from(function: $function) -> Self {
                Self::Call(function)
            }
        }
    };
}

operations! {
    /// An operation on one number.
    pub enum Unary with UnaryFunction {
        /// −a
        Neg "neg";
        /// |a|
        Abs "abs";
        /// √a
        Sqrt "sqrt";
        /// −1, 0 or 1; the derivative of |a|, 0 at 0 by convention.
        Sign "sign";
        /// The largest whole number that is not above a.
        Floor "floor";
        /// The nearest whole number; halfway between two the even one.
        Round "round";
    }
}

operations! {
    /// An operation on two numbers, a and b.
    pub enum Binary with BinaryFunction {
        /// a + b
        Add "add";
        /// a − b
        Sub "sub";
        /// a·b
        Mul "mul";
        /// a/b
        Div "div";
        /// a/b, and 0 where b = 0: derivatives of roots at their singular point, where the limit set contains
        /// 0.
        DivOrZero "div_or_zero";
        /// a·b, and 0 where b = 0 whatever a is, even if it is no number: b chooses whether a counts.
        MulOrZero "mul_or_zero";
        /// The smaller operand; NaN if either is NaN.
        Min "min";
        /// The larger operand; NaN if either is NaN.
        Max "max";
        /// The smaller operand, where both are known to be numbers: one instruction.
        PlainMin "plain_min";
        /// The larger operand, where both are known to be numbers: one instruction.
        PlainMax "plain_max";
        /// ∂min(a, b)/∂a: 1, ½ or 0 where a is smaller, equal or larger.
        MinWeight "min_weight";
        /// ∂max(a, b)/∂a: 1, ½ or 0 where a is larger, equal or smaller.
        MaxWeight "max_weight";
        /// R₀-conjunction a ∧ b, see [`r0::and`].
        And "r0_and";
        /// R₀-disjunction a ∨ b, see [`r0::or`].
        Or "r0_or";
        /// ∂(a ∧ b)/∂a, see [`r0::and_weights`].
        AndWeight "r0_and_weight";
        /// ∂(a ∨ b)/∂a.
        OrWeight "r0_or_weight";
    }
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

impl Binary {
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
