//! The functions of the mathematical library that graphs may use: their names and their values.
//!
//! A function that is added here is known to the language, to the interpreter and to the code generator.
//! `function_rules` holds its derivative, its range, its enclosure along a path, how it hands errors on,
//! where it is infinite or undefined, and its true value. A few other places name functions one by one:
//! `contraction` (forwards and backwards), the source of shaders and of the ray-marcher, the words of the
//! language, and the C bindings.
//!
//! Values come from one portable library, so that results do not depend on the system.

use crate::precision::Precision;

/// Declares functions of the mathematical library, one on each line: their variant, their name in files and
/// dumps, and the functions that compute them in `f64` and in `f32`. Before them stand the operands in the
/// ways in which Rust wants them written.
macro_rules! functions {
    (
        $(#[$meta:meta])*
        pub enum $type:ident of [$($operand:ident)+] $operands:tt
            in $double_operands:tt or $single_operands:tt {
            $($(#[$variant_meta:meta])* $variant:ident $name:literal $double:ident $single:ident;)+
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum $type {
            $($(#[$variant_meta])* $variant,)+
        }

        impl $type {
            /// Every function, in the order of their declaration.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// Its name in files and dumps.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }

            /// Its name in the mathematical library of C.
            pub fn c_name(self, precision: Precision) -> &'static str {
                match (self, precision) {
                    $((Self::$variant, Precision::F64) => stringify!($double),
                    (Self::$variant, Precision::F32) => stringify!($single),)+
                }
            }

            /// Its value in `f64`.
            #[inline]
            pub fn in_f64(self, $($operand: f64),+) -> f64 {
                match self {
                    $(Self::$variant => libm::$double $operands,)+
                }
            }

            /// Its value in `f32`.
            #[inline]
            pub fn in_f32(self, $($operand: f32),+) -> f32 {
                match self {
                    $(Self::$variant => libm::$single $operands,)+
                }
            }

            /// The start of a C function that computes it in `f64`, for machine code to call.
            pub fn address_f64(self) -> *const u8 {
                match self {
                    $(Self::$variant => {
                        extern "C" fn host $double_operands -> f64 {
                            libm::$double $operands
                        }
                        host as *const u8
                    })+
                }
            }

            /// The start of a C function that computes it in `f32`, for machine code to call.
            pub fn address_f32(self) -> *const u8 {
                match self {
                    $(Self::$variant => {
                        extern "C" fn host $single_operands -> f32 {
                            libm::$single $operands
                        }
                        host as *const u8
                    })+
                }
            }
        }
    };
}

functions! {
    /// A function of one number that no processor has an instruction for: programs call it. Its derivative,
    /// its range and its other rules are in `function_rules`.
    pub enum UnaryFunction of [a] (a) in (a: f64) or (a: f32) {
        Sin "sin" sin sinf;
        Cos "cos" cos cosf;
        Tan "tan" tan tanf;
        Asin "asin" asin asinf;
        Acos "acos" acos acosf;
        Atan "atan" atan atanf;
        Exp "exp" exp expf;
        /// The natural logarithm.
        Ln "ln" log logf;
        Log2 "log2" log2 log2f;
        Log10 "log10" log10 log10f;
        Sinh "sinh" sinh sinhf;
        Cosh "cosh" cosh coshf;
        Tanh "tanh" tanh tanhf;
    }
}

functions! {
    /// A function of two numbers that no processor has an instruction for.
    pub enum BinaryFunction of [a b] (a, b) in (a: f64, b: f64) or (a: f32, b: f32) {
        /// aᵇ
        Pow "pow" pow powf;
        /// `atan2(a, b)`: the angle of the point (b, a).
        Atan2 "atan2" atan2 atan2f;
    }
}
