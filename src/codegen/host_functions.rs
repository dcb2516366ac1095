//! Functions that have no machine instruction: called lane by lane, the same functions that the interpreter
//! uses.

use cranelift_codegen::ir::{AbiParam, Signature, types};
use cranelift_codegen::isa::CallConv;

use crate::ir::{Binary, BinaryFunction, Expr, Unary, UnaryFunction};
use crate::precision::Precision;

/// Whose functions of the mathematical library a program calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Library {
    /// Those of the interpreter.
    Rfm,
    /// Those of the C library that an object file is linked with.
    System,
}

/// A function of the mathematical library.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum HostFunction {
    Unary(UnaryFunction),
    Binary(BinaryFunction),
}

impl HostFunction {
    /// All of them, to be registered with the linker: names are never looked up in the host's C library.
    pub fn all() -> impl Iterator<Item = Self> {
        let of_two = BinaryFunction::ALL.iter().copied().map(Self::Binary);
        UnaryFunction::ALL.iter().copied().map(Self::Unary).chain(of_two)
    }

    /// The function that an operation calls, if it calls one.
    pub fn of(expr: Expr) -> Option<Self> {
        match expr {
            Expr::Unary(Unary::Call(function), _) => Some(Self::Unary(function)),
            Expr::Binary(Binary::Call(function), ..) => Some(Self::Binary(function)),
            _ => None,
        }
    }

    /// Its name for the linker.
    pub fn symbol(self, precision: Precision, library: Library) -> String {
        let name = match self {
            Self::Unary(function) => function.c_name(precision),
            Self::Binary(function) => function.c_name(precision),
        };
        match library {
            Library::Rfm => format!("rfm_math_{name}"),
            Library::System => name.into(),
        }
    }

    pub fn address(self, precision: Precision) -> *const u8 {
        match (self, precision) {
            (Self::Unary(function), Precision::F32) => function.address_f32(),
            (Self::Unary(function), Precision::F64) => function.address_f64(),
            (Self::Binary(function), Precision::F32) => function.address_f32(),
            (Self::Binary(function), Precision::F64) => function.address_f64(),
        }
    }

    pub fn signature(self, convention: CallConv, precision: Precision) -> Signature {
        let scalar = match precision {
            Precision::F32 => types::F32,
            Precision::F64 => types::F64,
        };
        let operands = match self {
            Self::Unary(_) => 1,
            Self::Binary(_) => 2,
        };
        let mut signature = Signature::new(convention);
        signature.params = vec![AbiParam::new(scalar); operands];
        signature.returns = vec![AbiParam::new(scalar)];
        signature
    }
}
