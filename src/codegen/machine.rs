//! The machine for which code is generated, and the errors if it has no code generator.

use std::fmt;
use std::sync::{Arc, OnceLock};

use cranelift_codegen::ir::{Type, types};
use cranelift_codegen::isa::{self, OwnedTargetIsa};
use cranelift_codegen::settings::{self, Configurable};

use crate::precision::Precision;

/// The reason why a program could not be compiled.
#[derive(Debug, Clone)]
pub enum CodegenError {
    /// This processor or system cannot run compiled code; the interpreter can.
    Unsupported(String),
    /// The code generator refused its input, which is always a bug of ours.
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

fn allocator(nodes: usize) -> &'static str {
    if nodes > SINGLE_PASS_ABOVE { "single_pass" } else { "backtracking" }
}

/// The instruction set of this machine, detected once per register allocator.
pub(super) fn target(nodes: usize) -> Result<OwnedTargetIsa, CodegenError> {
    static THOROUGH: OnceLock<Result<OwnedTargetIsa, CodegenError>> = OnceLock::new();
    static FAST: OnceLock<Result<OwnedTargetIsa, CodegenError>> = OnceLock::new();
    let cell = if nodes > SINGLE_PASS_ABOVE { &FAST } else { &THOROUGH };
    let allocator = allocator(nodes);
    cell.get_or_init(|| detect(allocator, Place::Memory)).as_ref().map(Arc::clone).map_err(Clone::clone)
}

/// The place of the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// The memory of this process.
    Memory,
    /// An object file, whose code a linker may place anywhere.
    Object,
}

/// The instruction set of this machine, for an object file.
pub(super) fn object_target(nodes: usize) -> Result<OwnedTargetIsa, CodegenError> {
    detect(allocator(nodes), Place::Object)
}

/// Another instruction set, without any extension, for an object file.
pub(super) fn object_target_of(builder: isa::Builder, nodes: usize) -> Result<OwnedTargetIsa, CodegenError> {
    let flags = flags(allocator(nodes), Place::Object)?;
    builder.finish(flags).map_err(|e| CodegenError::Unsupported(e.to_string()))
}

fn detect(allocator: &str, place: Place) -> Result<OwnedTargetIsa, CodegenError> {
    let unsupported = |e: &dyn fmt::Display| CodegenError::Unsupported(e.to_string());
    let builder = cranelift_native::builder().map_err(|e| unsupported(&e))?;
    builder.finish(flags(allocator, place)?).map_err(|e| unsupported(&e))
}

fn flags(allocator: &str, place: Place) -> Result<settings::Flags, CodegenError> {
    let mut flags = settings::builder();
    let verify = if cfg!(debug_assertions) { "true" } else { "false" };
    let options = [
        ("opt_level", "speed"),
        ("regalloc_algorithm", allocator),
        ("enable_verifier", verify),
        ("is_pic", if place == Place::Object { "true" } else { "false" }),
        ("use_colocated_libcalls", "false"),
        ("unwind_info", "false"),
    ];
    for (name, value) in options {
        flags.set(name, value).map_err(|e| CodegenError::Bug(format!("setting {name}: {e}")))?;
    }
    Ok(settings::Flags::new(flags))
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

/// The type of a number in this precision.
pub fn number_type(precision: Precision) -> Type {
    match precision {
        Precision::F32 => types::F32,
        Precision::F64 => types::F64,
    }
}
