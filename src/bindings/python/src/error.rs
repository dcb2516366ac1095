//! What the module raises: `RfmError` for all that is wrong with a file, a solid or a scene, and `OSError` for
//! files that cannot be read or written.

use std::ffi::CString;
use std::fmt::Display;
use std::io;

use pyo3::exceptions::{PyOSError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyTuple, PyType};
use rfm::diagnostic::Diagnostics;

pyo3::create_exception!(
    rfm,
    RfmError,
    PyValueError,
    "Something is wrong with a file, a solid, a scene or what was asked of it.\n\n\
     The text is what the program `rfm` prints. `diagnostics` has the messages of the compiler one by one, as a\n\
     tuple of `Diagnostic`; it is empty for errors that do not belong to a place of a file."
);

/// An error without a place in a file.
pub fn refused(message: impl Display) -> PyErr {
    RfmError::new_err(message.to_string())
}

/// An error of the library as an exception.
pub fn raised(py: Python<'_>, error: rfm::Error) -> PyErr {
    match error {
        rfm::Error::File { path, error } => not_read(&path, error),
        rfm::Error::Diagnostics(diagnostics) => of_diagnostics(py, &diagnostics),
        rfm::Error::UnknownName { .. } | rfm::Error::Codegen(_) => refused(error),
    }
}

/// The messages of the compiler as an exception.
pub fn of_diagnostics(py: Python<'_>, found: &Diagnostics) -> PyErr {
    let error = RfmError::new_err(found.to_string());
    let list = match diagnostics(py, found) {
        Ok(list) => list,
        Err(error) => return error,
    };
    match error.value(py).setattr("diagnostics", list) {
        Ok(()) => error,
        Err(error) => error,
    }
}

/// A file that could not be read or written: `FileNotFoundError` and its like.
pub fn not_read(path: &str, error: io::Error) -> PyErr {
    let text = error.to_string();
    match (error.raw_os_error(), error.kind()) {
        // the constructor of OSError chooses the subclass by the number
        (Some(number), _) => {
            let text = text.split(" (os error").next().unwrap_or_default().to_string();
            PyOSError::new_err((number, text, path.to_string()))
        }
        // a text that is none
        (None, io::ErrorKind::InvalidData) => refused(format!("cannot read `{path}`: {text}")),
        (None, kind) => io::Error::new(kind, format!("cannot use `{path}`: {text}")).into(),
    }
}

/// Messages as a tuple of the class `Diagnostic`.
pub fn diagnostics<'py>(py: Python<'py>, found: &Diagnostics) -> PyResult<Bound<'py, PyTuple>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let class = CLASS.import(py, "rfm._records", "Diagnostic")?;
    let list: Vec<_> = found
        .list
        .iter()
        .map(|message| {
            let span = message.primary.span;
            let source = found.source(span.source);
            let at = |byte: u32| source.map(|source| source.position(byte as usize));
            let (start, end) = (at(span.start), at(span.end));
            class.call1((
                message.severity.to_string(),
                message.code.0,
                message.message.as_str(),
                source.map_or("", |source| &*source.name),
                start.map(|at| at.line),
                start.map(|at| at.column),
                end.map(|at| at.line),
                end.map(|at| at.column),
                message.help.as_deref(),
            ))
        })
        .collect::<PyResult<_>>()?;
    PyTuple::new(py, list)
}

/// Shows a warning at the line that called.
pub fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    let message = CString::new(text).map_err(refused)?;
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &message, 1)
}
