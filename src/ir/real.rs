//! The two floating-point types as one: what the interpreter needs of them.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::ir::function::{BinaryFunction, UnaryFunction};

/// `f64` or `f32`. The functions that are not correctly rounded everywhere come from one portable library, so
/// that results do not depend on the system.
pub trait Real:
    Copy
    + PartialOrd
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// The nearest number of the type.
    fn from_f64(x: f64) -> Self;
    /// Its value in `f64`, exactly.
    fn to_f64(self) -> f64;
    /// √a, correctly rounded; NaN for negative numbers.
    fn sqrt(self) -> Self;
    /// |a|
    fn abs(self) -> Self;
    /// The largest whole number that is not above a.
    fn floor(self) -> Self;
    /// The nearest whole number; halfway between two the even one.
    fn round_ties_even(self) -> Self;
    /// A function of the mathematical library.
    fn call(self, function: UnaryFunction) -> Self;
    /// A function of the mathematical library, of this operand and a second one.
    fn call_with(self, function: BinaryFunction, second: Self) -> Self;
}

macro_rules! real {
    ($t:ty, $value:ident) => {
        impl Real for $t {
            #[inline]
            fn from_f64(x: f64) -> Self {
                x as $t
            }
            #[inline]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline]
            fn abs(self) -> Self {
                <$t>::abs(self)
            }
            #[inline]
            fn floor(self) -> Self {
                <$t>::floor(self)
            }
            #[inline]
            fn round_ties_even(self) -> Self {
                <$t>::round_ties_even(self)
            }
            #[inline]
            fn call(self, function: UnaryFunction) -> Self {
                function.$value(self)
            }
            #[inline]
            fn call_with(self, function: BinaryFunction, second: Self) -> Self {
                function.$value(self, second)
            }
        }
    };
}

real!(f64, in_f64);
real!(f32, in_f32);
