//! Graph → machine code, through Cranelift.
//!
//! A *program* is one function: its outputs (ω; or ω and ∇ω) at one point, or at many points in blocks of one
//! 128-bit vector (two `f64` or four `f32`), the widest that the code generator has. The same translation serves
//! both: a single point is a vector whose other lanes are zero.
//!
//! Invariants: code memory is owned by the [`Code`] that refers to it and freed with it, never writable and
//! executable at once; the operations are those of `ir`, in its order, so results agree with the interpreter bit
//! for bit. Unsafe code of the crate lives here and in `solid::compiled` only.

mod emit;
mod math_calls;
mod memory;
mod r0;
mod range;
mod translate;

use std::fmt;
use std::sync::{Arc, OnceLock};

use cranelift_codegen::isa::OwnedTargetIsa;
use cranelift_codegen::settings::{self, Configurable};

pub use memory::Code;
pub use range::{
    REACH as RANGE_REACH, Rounding, knows as range_is_known, stays_finite as range_stays_finite,
    supports as range_is_supported,
};
pub use translate::{Listing, compile};

pub use crate::ir::{Form, Forms};
use crate::ir::{Graph, Node};
pub use crate::precision::Precision;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Shape {
    /// `fn(x, y, z, out: *mut T)`: the outputs at one point, one after the other.
    Point,
    /// `fn(columns: *const *mut T, blocks: usize)`: columns x, y, z, then one per input and one per output, all of
    /// them `blocks` × [`Precision::lanes`] long; no alignment asked for.
    Batch,
    /// `fn(box: *const [f64; 6], out: *mut [f64; 2])`: the range of the one output over a box, called with this
    /// rounding; `f64` only, and only for graphs that [`range_is_supported`] names.
    Range(Rounding),
}

/// What is to be compiled.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    pub graph: &'a Graph,
    /// Nodes that a batch program reads from columns instead of computing them; other shapes have none.
    pub inputs: &'a [Node],
    pub outputs: &'a [Node],
    pub precision: Precision,
    pub shape: Shape,
    pub forms: &'a Forms,
    /// Whether the function takes one more argument, a pointer to the parameters of the graph.
    pub parameters: bool,
    /// Whether it takes another one after that, a pointer to the graph's uniforms: numbers of the program's type, or for
    /// [`Shape::Range`] pairs of bounds. Time itself no program knows, see [`hoisted`](crate::ir::hoisted).
    pub uniforms: bool,
}

impl Precision {
    /// Points in a block of the batch program.
    pub const fn lanes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 2,
        }
    }
}

#[derive(Debug, Clone)]
pub enum CodegenError {
    /// This processor or system cannot run compiled code; the interpreter can.
    Unsupported(String),
    /// The code generator refused what it was given: always a bug of ours.
    Bug(String),
}

impl fmt::Display for CodegenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsupported(why) => write!(f, "machine code is not available here: {why}"),
            Self::Bug(what) => write!(f, "internal error in the code generator: {what}"),
        }
    }
}

impl std::error::Error for CodegenError {}

/// Above this many nodes the register allocator with linear cost is used: the other one grows superlinearly
/// (66 000 instructions: 1.8 s against 0.1 s).
const SINGLE_PASS_ABOVE: usize = 4_000;

/// The instruction set of this machine, found out once per register allocator.
fn target(nodes: usize) -> Result<OwnedTargetIsa, CodegenError> {
    static THOROUGH: OnceLock<Result<OwnedTargetIsa, CodegenError>> = OnceLock::new();
    static FAST: OnceLock<Result<OwnedTargetIsa, CodegenError>> = OnceLock::new();
    let (cell, allocator) =
        if nodes > SINGLE_PASS_ABOVE { (&FAST, "single_pass") } else { (&THOROUGH, "backtracking") };
    cell.get_or_init(|| detect(allocator)).as_ref().map(Arc::clone).map_err(Clone::clone)
}

fn detect(allocator: &str) -> Result<OwnedTargetIsa, CodegenError> {
    let mut flags = settings::builder();
    let verify = if cfg!(debug_assertions) { "true" } else { "false" };
    let options = [
        ("opt_level", "speed"),
        ("regalloc_algorithm", allocator),
        ("enable_verifier", verify),
        ("is_pic", "false"),
        ("use_colocated_libcalls", "false"),
        ("unwind_info", "false"),
    ];
    for (name, value) in options {
        flags.set(name, value).map_err(|e| CodegenError::Bug(format!("setting {name}: {e}")))?;
    }
    let unsupported = |e: &dyn fmt::Display| CodegenError::Unsupported(e.to_string());
    let builder = cranelift_native::builder().map_err(|e| unsupported(&e))?;
    builder.finish(settings::Flags::new(flags)).map_err(|e| unsupported(&e))
}

/// The instruction set extensions that generated code uses here, for reports.
pub fn target_description() -> String {
    match target(0) {
        Ok(isa) => {
            let on = isa.isa_flags().into_iter().filter(|f| f.as_bool() == Some(true));
            let names: Vec<&str> = on.map(|f| f.name.trim_start_matches("has_")).collect();
            format!("{} ({})", isa.triple(), names.join(" "))
        }
        Err(error) => error.to_string(),
    }
}
