//! Graph → machine code, through Cranelift: into executable memory, or into an object file.
//!
//! A *program* is one function: its outputs (ω; or ω and ∇ω) at one point, or at many points in blocks of one
//! 128-bit vector (two `f64` or four `f32`), the widest that the code generator has. One translation serves
//! both, because a single point is a vector whose other lanes are zero.
//!
//! Invariants: code memory is owned by the `Code` that refers to it and freed with it, and is never writable
//! and executable at once. The operations are those of `ir`, in its order, so results agree with the
//! interpreter bit for bit. Unsafe code of the crate lives here and in `solid::programs::compiled` only.

mod emitter;
mod entries;
mod host_functions;
mod machine;
mod memory;
mod object;
mod operations;
mod r0;
mod range;
mod request;
pub(crate) mod sine;
mod translate;

pub use entries::{Entry, EntryPrograms};
pub use host_functions::Library;
pub use machine::{CodegenError, target_description};
pub(crate) use memory::Code;
pub use object::{ObjectProgram, object};
pub(crate) use range::{
    REACH as RANGE_REACH, knows as range_is_known, stays_finite as range_stays_finite,
    supports as range_is_supported,
};
pub use request::{Request, Rounding, Shape};
pub use translate::Listing;
pub(crate) use translate::compile;

pub use crate::ir::{Form, Forms};
pub use crate::precision::Precision;
