//! What the analysis of a computation needs to know of its floating-point type.

use crate::precision::Precision;

/// The constants of a floating-point type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloatType {
    /// Half the distance of 1 from the next number: the relative error of one rounding.
    pub unit: f64,
    /// The smallest positive number: not less than the error of a rounding that underflows.
    pub smallest: f64,
    /// The largest finite number.
    pub largest: f64,
}

impl FloatType {
    const F64: Self = Self { unit: 0.5 * f64::EPSILON, smallest: f64::from_bits(1), largest: f64::MAX };
    const F32: Self = Self {
        unit: 0.5 * f32::EPSILON as f64,
        smallest: f32::from_bits(1) as f64,
        largest: f32::MAX as f64,
    };

    /// The constants of a type.
    pub const fn of(precision: Precision) -> Self {
        match precision {
            Precision::F32 => Self::F32,
            Precision::F64 => Self::F64,
        }
    }
}
