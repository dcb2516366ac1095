//! The two floating-point types that programs, evaluations and sums over neighbours exist in.

/// A floating-point type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Precision {
    /// 32 bits, seven digits.
    F32,
    /// 64 bits, sixteen digits.
    #[default]
    F64,
}

impl Precision {
    /// `f32` or `f64`, as Rust and scenes write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}
