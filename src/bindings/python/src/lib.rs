//! The Python module `rfm`: obstacles as NumPy sees them, and simulations.
//!
//! | file | what it has |
//! |---|---|
//! | `program`, `solid`, `mesh`, `slice`, `simulation` | one class of Python each |
//! | `solid::questions` | those of `Solid` about points |
//! | `points`, `results`, `evaluate`, `path` | arguments as columns, new and given arrays, questions about many points |
//! | `begin` | scenes at their start, and their probes |
//! | `collision` | particles that are put back in arrays of the caller |
//! | `source` | solids as source text |
//! | `show` | what notebooks show |
//! | `memory`, `state` | the memory of arrays; the particles of a simulation as arrays |
//! | `pool`, `error` | threads, and what happens to them in a forked process; exceptions |
//!
//! Invariant: no argument leads to a panic or to memory that is not the caller's. Errors are exceptions.

mod begin;
mod collision;
mod error;
mod evaluate;
mod memory;
mod mesh;
mod path;
mod points;
mod pool;
mod program;
mod results;
mod show;
mod simulation;
mod slice;
mod solid;
mod source;
mod state;

use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// Compiled part of the module `rfm`.
#[pymodule]
fn _rfm(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let error = py.get_type::<error::RfmError>();
    error.setattr("diagnostics", PyTuple::empty(py))?;
    module.add("RfmError", error)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<program::PyProgram>()?;
    module.add_class::<solid::PySolid>()?;
    module.add_class::<mesh::PyMesh>()?;
    module.add_class::<slice::PySlice>()?;
    module.add_class::<simulation::PySimulation>()?;
    module.add_function(wrap_pyfunction!(program::load, module)?)?;
    module.add_function(wrap_pyfunction!(program::program_from_pickle, module)?)?;
    module.add_function(wrap_pyfunction!(program::solid_from_pickle, module)?)?;
    module.add_function(wrap_pyfunction!(mesh::mesh_from_pickle, module)?)?;
    module.add_function(wrap_pyfunction!(slice::slice_from_pickle, module)?)?;
    Ok(())
}
