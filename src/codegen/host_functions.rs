//! Functions that have no machine instruction. They are the functions of the interpreter, called lane by
//! lane. Such functions also look up tables of a graph; they receive the address of the table. Sines and
//! cosines are called only for the arguments that `sine` does not handle.

use std::sync::Arc;

use cranelift_codegen::ir::{AbiParam, Signature, Type};
use cranelift_codegen::isa::CallConv;

use super::machine::number_type;
use crate::ir::{Binary, BinaryFunction, Expr, Lookup, Part, Unary, UnaryFunction};
use crate::precision::Precision;
use crate::table::Table;

/// The mathematical library whose functions a program calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Library {
    /// The functions of the interpreter.
    Rfm,
    /// The functions of the C library that an object file is linked with.
    System,
}

/// A function of the mathematical library.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum HostFunction {
    Unary(UnaryFunction),
    Binary(BinaryFunction),
    /// The value of a table at a point. The first argument is the address of the table.
    Table(Part),
}

impl HostFunction {
    /// All functions, to be registered with the linker, so that names are never looked up in the host's C
    /// library.
    pub fn all() -> impl Iterator<Item = Self> {
        let of_two = BinaryFunction::ALL.iter().copied().map(Self::Binary);
        let tables = Lookup::PARTS.into_iter().map(Self::Table);
        UnaryFunction::ALL.iter().copied().map(Self::Unary).chain(of_two).chain(tables)
    }

    /// The function that an operation calls, if it calls one.
    pub fn of(expr: Expr) -> Option<Self> {
        match expr {
            Expr::Unary(Unary::Call(function), _) => Some(Self::Unary(function)),
            Expr::Binary(Binary::Call(function), ..) => Some(Self::Binary(function)),
            Expr::Lookup(lookup, _) => Some(Self::Table(lookup.part)),
            Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Unary(..)
            | Expr::Binary(..) => None,
        }
    }

    /// Its name for the linker.
    pub fn symbol(self, precision: Precision, library: Library) -> String {
        let name = match self {
            Self::Unary(function) => function.c_name(precision),
            Self::Binary(function) => function.c_name(precision),
            Self::Table(part) => return format!("rfm_{}_{}", table_name(part), precision.name()),
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
            (Self::Table(part), Precision::F64) => match part {
                Part::Value => in_f64::value as *const u8,
                Part::Slope(0) => in_f64::slope_x as *const u8,
                Part::Slope(1) => in_f64::slope_y as *const u8,
                Part::Slope(_) => in_f64::slope_z as *const u8,
            },
            (Self::Table(part), Precision::F32) => match part {
                Part::Value => in_f32::value as *const u8,
                Part::Slope(0) => in_f32::slope_x as *const u8,
                Part::Slope(1) => in_f32::slope_y as *const u8,
                Part::Slope(_) => in_f32::slope_z as *const u8,
            },
        }
    }

    /// Its signature, with addresses of this type.
    pub fn signature(self, convention: CallConv, precision: Precision, pointer: Type) -> Signature {
        let scalar = number_type(precision);
        let operands = match self {
            Self::Unary(_) => vec![scalar],
            Self::Binary(_) => vec![scalar; 2],
            Self::Table(_) => vec![pointer, scalar, scalar, scalar],
        };
        let mut signature = Signature::new(convention);
        signature.params = operands.into_iter().map(AbiParam::new).collect();
        signature.returns = vec![AbiParam::new(scalar)];
        signature
    }
}

fn table_name(part: Part) -> &'static str {
    Lookup { table: 0, part }.name()
}

/// The functions that look up tables, for programs in one type of numbers.
macro_rules! lookups {
    ($module:ident, $t:ty: $($name:ident $part:expr;)+) => {
        mod $module {
            use super::{Arc, Part, Table};

            $(
                /// # Safety
                /// `table` points to a table.
                // SAFETY: see the one use of the pointer
                pub unsafe extern "C" fn $name(table: *const Arc<dyn Table>, x: $t, y: $t, z: $t) -> $t {
                    // SAFETY: programs pass the address that `Emitter::lookup` wrote into them. It belongs to
                    // a table of their graph, which the running `Code` keeps alive and in its place.
                    let table = unsafe { &**table };
                    $part.of(table, [f64::from(x), f64::from(y), f64::from(z)]) as $t
                }
            )+
        }
    };
}

lookups! { in_f64, f64:
    value Part::Value;
    slope_x Part::Slope(0);
    slope_y Part::Slope(1);
    slope_z Part::Slope(2);
}

lookups! { in_f32, f32:
    value Part::Value;
    slope_x Part::Slope(0);
    slope_y Part::Slope(1);
    slope_z Part::Slope(2);
}
