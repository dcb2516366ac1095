//! Functions that have no machine instruction: called lane by lane, the same functions that the interpreter uses.

use cranelift_codegen::ir::{AbiParam, Signature, types};
use cranelift_codegen::isa::CallConv;

use super::Precision;
use crate::ir::{Binary, Real, Unary};

/// A host function by the name that the code generator knows it by.
pub(super) struct HostFunction {
    pub name: String,
    pub address: *const u8,
    pub arity: usize,
}

macro_rules! unary {
    ($op:expr, $precision:expr; $($variant:ident => $method:ident),*) => {
        match ($op, $precision) {
            $(
                (Unary::$variant, Precision::F64) => {
                    extern "C" fn host(a: f64) -> f64 { Real::$method(a) }
                    Some(host as extern "C" fn(f64) -> f64 as *const u8)
                }
                (Unary::$variant, Precision::F32) => {
                    extern "C" fn host(a: f32) -> f32 { Real::$method(a) }
                    Some(host as extern "C" fn(f32) -> f32 as *const u8)
                }
            )*
            _ => None,
        }
    };
}

macro_rules! binary {
    ($op:expr, $precision:expr; $($variant:ident => $method:ident),*) => {
        match ($op, $precision) {
            $(
                (Binary::$variant, Precision::F64) => {
                    extern "C" fn host(a: f64, b: f64) -> f64 { Real::$method(a, b) }
                    Some(host as extern "C" fn(f64, f64) -> f64 as *const u8)
                }
                (Binary::$variant, Precision::F32) => {
                    extern "C" fn host(a: f32, b: f32) -> f32 { Real::$method(a, b) }
                    Some(host as extern "C" fn(f32, f32) -> f32 as *const u8)
                }
            )*
            _ => None,
        }
    };
}

/// The host function of an operation, if it is one that is called.
pub(super) fn unary(op: Unary, precision: Precision) -> Option<HostFunction> {
    let address = unary!(op, precision; Sin => sin, Cos => cos, Tan => tan, Asin => asin, Acos => acos,
        Atan => atan, Exp => exp, Ln => ln)?;
    Some(HostFunction { name: symbol(op.name(), precision), address, arity: 1 })
}

pub(super) fn binary(op: Binary, precision: Precision) -> Option<HostFunction> {
    let address = binary!(op, precision; Pow => pow, Atan2 => atan2)?;
    Some(HostFunction { name: symbol(op.name(), precision), address, arity: 2 })
}

/// All of them, to be registered with the linker: names are never looked up in the host's C library.
pub(super) fn all(precision: Precision) -> impl Iterator<Item = HostFunction> {
    let unaries = Unary::ALL.into_iter().filter_map(move |op| unary(op, precision));
    unaries.chain(Binary::ALL.into_iter().filter_map(move |op| binary(op, precision)))
}

pub(super) fn signature(convention: CallConv, precision: Precision, arity: usize) -> Signature {
    let scalar = match precision {
        Precision::F32 => types::F32,
        Precision::F64 => types::F64,
    };
    let mut signature = Signature::new(convention);
    signature.params = vec![AbiParam::new(scalar); arity];
    signature.returns = vec![AbiParam::new(scalar)];
    signature
}

fn symbol(name: &str, precision: Precision) -> String {
    format!("rfm_{name}_{precision:?}")
}
