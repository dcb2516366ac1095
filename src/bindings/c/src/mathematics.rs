//! The functions of the mathematical library with the bits of `rfm`: what `rfm build --math rfm` calls.

use library::ir::{BinaryFunction, UnaryFunction};

/// The sine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_sin(a: f64) -> f64 {
    UnaryFunction::Sin.in_f64(a)
}

/// The sine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_sinf(a: f32) -> f32 {
    UnaryFunction::Sin.in_f32(a)
}

/// The cosine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_cos(a: f64) -> f64 {
    UnaryFunction::Cos.in_f64(a)
}

/// The cosine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_cosf(a: f32) -> f32 {
    UnaryFunction::Cos.in_f32(a)
}

/// The tangent, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_tan(a: f64) -> f64 {
    UnaryFunction::Tan.in_f64(a)
}

/// The tangent, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_tanf(a: f32) -> f32 {
    UnaryFunction::Tan.in_f32(a)
}

/// The arc sine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_asin(a: f64) -> f64 {
    UnaryFunction::Asin.in_f64(a)
}

/// The arc sine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_asinf(a: f32) -> f32 {
    UnaryFunction::Asin.in_f32(a)
}

/// The arc cosine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_acos(a: f64) -> f64 {
    UnaryFunction::Acos.in_f64(a)
}

/// The arc cosine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_acosf(a: f32) -> f32 {
    UnaryFunction::Acos.in_f32(a)
}

/// The arc tangent, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_atan(a: f64) -> f64 {
    UnaryFunction::Atan.in_f64(a)
}

/// The arc tangent, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_atanf(a: f32) -> f32 {
    UnaryFunction::Atan.in_f32(a)
}

/// The exponential, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_exp(a: f64) -> f64 {
    UnaryFunction::Exp.in_f64(a)
}

/// The exponential, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_expf(a: f32) -> f32 {
    UnaryFunction::Exp.in_f32(a)
}

/// The natural logarithm, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_log(a: f64) -> f64 {
    UnaryFunction::Ln.in_f64(a)
}

/// The natural logarithm, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_logf(a: f32) -> f32 {
    UnaryFunction::Ln.in_f32(a)
}

/// The logarithm to base 2, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_log2(a: f64) -> f64 {
    UnaryFunction::Log2.in_f64(a)
}

/// The logarithm to base 2, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_log2f(a: f32) -> f32 {
    UnaryFunction::Log2.in_f32(a)
}

/// The logarithm to base 10, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_log10(a: f64) -> f64 {
    UnaryFunction::Log10.in_f64(a)
}

/// The logarithm to base 10, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_log10f(a: f32) -> f32 {
    UnaryFunction::Log10.in_f32(a)
}

/// The hyperbolic sine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_sinh(a: f64) -> f64 {
    UnaryFunction::Sinh.in_f64(a)
}

/// The hyperbolic sine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_sinhf(a: f32) -> f32 {
    UnaryFunction::Sinh.in_f32(a)
}

/// The hyperbolic cosine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_cosh(a: f64) -> f64 {
    UnaryFunction::Cosh.in_f64(a)
}

/// The hyperbolic cosine, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_coshf(a: f32) -> f32 {
    UnaryFunction::Cosh.in_f32(a)
}

/// The hyperbolic tangent, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_tanh(a: f64) -> f64 {
    UnaryFunction::Tanh.in_f64(a)
}

/// The hyperbolic tangent, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_tanhf(a: f32) -> f32 {
    UnaryFunction::Tanh.in_f32(a)
}

/// A to the power b, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_pow(a: f64, b: f64) -> f64 {
    BinaryFunction::Pow.in_f64(a, b)
}

/// A to the power b, with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_powf(a: f32, b: f32) -> f32 {
    BinaryFunction::Pow.in_f32(a, b)
}

/// The angle of the point (b, a), with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_atan2(a: f64, b: f64) -> f64 {
    BinaryFunction::Atan2.in_f64(a, b)
}

/// The angle of the point (b, a), with the bits that solids have.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_math_atan2f(a: f32, b: f32) -> f32 {
    BinaryFunction::Atan2.in_f32(a, b)
}
