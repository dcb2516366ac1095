//! The interface for C, C++ and Fortran.
//!
//! | file | what it has |
//! |---|---|
//! | `error` | statuses and error objects, and how a panic becomes one |
//! | `environment` | floating-point exceptions and rounding of the host |
//! | `program` | files and texts, checked |
//! | `solid` | solids, and questions about one point |
//! | `mesh` | volumes, meshes of solids, and surfaces of fluids |
//! | `columns` | questions about many points, and collisions |
//! | `mathematics` | sin, exp and so on with the bits of `rfm`, for generated source and object code |
//!
//! `include/rfm.h` is made from these files and says what callers owe. Invariant: no panic leaves a function, and
//! nothing is kept outside of handles.

// names of constants are those of C
#![allow(non_camel_case_types)]

mod columns;
mod environment;
mod error;
mod mathematics;
mod mesh;
mod program;
mod solid;

/// Version of this interface. It changes when a program that was compiled with an older header would break.
pub const RFM_ABI_VERSION: u32 = 1;

/// The version of the interface that the library has: `RFM_ABI_VERSION` of its header.
#[unsafe(no_mangle)]
pub extern "C" fn rfm_abi_version() -> u32 {
    RFM_ABI_VERSION
}
