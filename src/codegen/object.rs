//! Programs as an object file, for linkers of other programs.

use cranelift_codegen::isa::{self, OwnedTargetIsa};
use cranelift_module::{Linkage, default_libcall_names};
use cranelift_object::{ObjectBuilder, ObjectModule};
use rustc_hash::FxHashSet;

use super::entries::{self, Entry};
use super::host_functions::Library;
use super::machine::{CodegenError, object_target, object_target_of};
use super::request::Request;
use super::sine;
use super::translate::{Named, define, needed, waves};

/// A program of an object file, under a name that its own functions find.
pub struct ObjectProgram<'a> {
    /// Name of the symbol.
    pub symbol: String,
    /// The program to compile.
    pub request: Request<'a>,
}

/// Compiles programs and the functions over them into an object file, for this machine or for another one with the same
/// kind of processor, named by its triple, for example `x86_64-apple-darwin`.
///
/// # Errors
/// [`CodegenError::Unsupported`] if there is no code generator for the machine; [`CodegenError::Bug`] if a
/// generated function is refused.
pub fn object(
    programs: &[ObjectProgram<'_>],
    entries: &[Entry],
    library: Library,
    triple: Option<&str>,
) -> Result<Vec<u8>, CodegenError> {
    let largest = programs.iter().map(|program| needed(program.request).len()).max().unwrap_or(0);
    let isa: OwnedTargetIsa = match triple {
        None => object_target(largest)?,
        Some(triple) => {
            let triple = triple.parse().map_err(|error| {
                CodegenError::Unsupported(format!("`{triple}` names no machine: {error}"))
            })?;
            let builder =
                isa::lookup(triple).map_err(|error| CodegenError::Unsupported(error.to_string()))?;
            object_target_of(builder, largest)?
        }
    };
    let bug = |what: &dyn std::fmt::Display| CodegenError::Bug(what.to_string());
    let builder = ObjectBuilder::new(isa, "rfm", default_libcall_names()).map_err(|error| bug(&error))?;
    let mut module = ObjectModule::new(builder);
    if library == Library::Rfm {
        let of = |&ObjectProgram { request, .. }: &ObjectProgram<'_>| {
            waves(request, &needed(request)).into_values().map(move |wanted| (request.precision, wanted))
        };
        let called: FxHashSet<_> = programs.iter().flat_map(of).collect();
        for function in sine::all().filter(|function| called.contains(function)) {
            let (precision, wanted) = function;
            sine::define(&mut module, precision, wanted)?;
        }
    }
    for ObjectProgram { symbol, request } in programs {
        let named = Named { name: symbol, linkage: Linkage::Hidden, library };
        define(&mut module, *request, named, false)?;
    }
    for entry in entries {
        entries::define(&mut module, entry)?;
    }
    module.finish().emit().map_err(|error| bug(&error))
}
