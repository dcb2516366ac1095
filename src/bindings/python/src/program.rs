//! `load`, and the class `Program`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBytes, PyDict, PyString, PyTuple, PyType};
use rfm::compile::{files_beside, text_of};
use rfm::diagnostic::{Diagnostics, Source, SourceId};
use rfm::files::Files;
use rfm::lower::{Options, SetBy};
use rfm::quantity::{Dimension, parse_quantity};
use rfm::solid::Chosen;
use rfm::{Error, Program, Solid};

use crate::error::{diagnostics, not_read, of_diagnostics, raised};
use crate::points::aabb;
use crate::pool::Threads;
use crate::simulation::PySimulation;
use crate::solid::PySolid;

/// What messages call a program that was given as a text.
const TEXT: &str = "<text>";

/// Reads and checks a file, or a text.
///
/// Parameters
/// ----------
/// path_or_text : str or path
///     A text, if it is a str that has several lines or begins with ``rfm ``; otherwise the path of a file.
/// path : str or path, optional
///     The path of the file for which a text stands: the text may name other files in its folder and below, and messages
///     show it. The file itself is not read. Positional only, because params may be called so.
/// **params : float or str
///     Values for params of the file: numbers in SI units, or texts with a unit such as ``"8 mm"``. The unit must fit the
///     one that the file writes the param in; a param that it writes without a unit takes any, as ``rfm -D`` does.
///
/// Returns
/// -------
/// Program
///
/// Raises
/// ------
/// RfmError
///     If the file has mistakes. `diagnostics` lists them.
/// OSError
///     If the file cannot be read.
#[pyfunction]
#[pyo3(signature = (path_or_text, path=None, /, **params))]
pub fn load(
    py: Python<'_>,
    path_or_text: &Bound<'_, PyAny>,
    path: Option<PathBuf>,
    params: Option<&Bound<'_, PyDict>>,
) -> PyResult<PyProgram> {
    if path_or_text.is_instance_of::<PyBytes>() {
        return Err(PyTypeError::new_err(
            "the first argument is bytes, expected a str: `text.decode()` for a text, `os.fsdecode(path)` for a path",
        ));
    }
    let source = match (path_or_text.cast::<PyString>(), path) {
        (Ok(text), path) if is_text(&text.to_cow()?) => {
            let name = path.map_or(TEXT.to_string(), |path| path.display().to_string());
            Source::file(name, text.to_cow()?.into_owned())
        }
        (_, None) => read(&path_or_text.extract::<PathBuf>()?)?,
        (_, Some(_)) => {
            return Err(PyValueError::new_err("a path is for a text, and the first argument is no text"));
        }
    };
    PyProgram::check(py, source, given(params)?)
}

fn is_text(given: &str) -> bool {
    given.contains('\n') || given.trim_start().starts_with("rfm ")
}

fn read(path: &Path) -> PyResult<Source> {
    let name = path.display().to_string();
    let text = std::fs::read(path).and_then(text_of).map_err(|error| not_read(&name, error))?;
    Ok(Source::file(name, text))
}

/// A param as it is given: a number, or a text with a unit.
struct Given {
    name: String,
    /// In SI units.
    value: f64,
    /// `None` without a unit.
    dimension: Option<Dimension>,
}

/// Params as names with numbers, or with texts such as `"8 mm"`.
fn given(params: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<Given>> {
    let one = |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let name: String = name.extract()?;
        if let Ok(value) = value.extract::<f64>() {
            return Ok(Given { name, value, dimension: None });
        }
        let Ok(text) = value.cast::<PyString>() else {
            return Err(PyTypeError::new_err(format!("param `{name}` is {value}, expected a number")));
        };
        let (value, dimension) = parse_quantity(&text.to_cow()?)
            .map_err(|error| PyValueError::new_err(format!("param `{name}`: {error}")))?;
        Ok(Given { name, value, dimension })
    };
    params.into_iter().flat_map(|params| params.iter()).map(one).collect()
}

/// A checked file: its solids and its scenes. `load` makes one.
///
/// ``program["pawn"]`` is a solid, compiled when it is first asked for. ``in``, ``len`` and iteration are about
/// the names of solids. A name that the file does not have is a ``KeyError`` here, as in any mapping, and an `RfmError`
/// in `solid` and `scene`.
#[pyclass(frozen, mapping, module = "rfm", name = "Program")]
pub struct PyProgram {
    pub program: Program,
    solids: Mutex<HashMap<String, Solid>>,
}

impl PyProgram {
    /// The cheaper program of a solid that keeps the tolerance of the file; `None` if the file states none.
    ///
    /// # Errors
    /// `RfmError` if no program keeps it.
    pub fn chosen(&self, py: Python<'_>, solid: &Solid) -> PyResult<Option<Chosen>> {
        self.program.within_tolerance(solid).transpose().map_err(|message| {
            let sources = self.program.sources().clone();
            of_diagnostics(py, &Diagnostics { list: vec![*message], sources })
        })
    }

    fn check(py: Python<'_>, source: Source, params: Vec<Given>) -> PyResult<Self> {
        // a text has no folder, and names no other files
        let files = if &*source.name == TEXT { Files::default() } else { files_beside(&*source.name, false) };
        Self::check_with(py, source, params, files)
    }

    fn check_with(py: Python<'_>, source: Source, params: Vec<Given>, files: Files) -> PyResult<Self> {
        let dimensions =
            params.iter().filter_map(|param| Some((param.name.clone(), param.dimension?))).collect();
        let overrides = params.into_iter().map(|param| (param.name, param.value)).collect();
        let set_by = SetBy::Python;
        let options = Options { overrides, dimensions, files, set_by, ..Options::default() };
        let program = py.detach(|| Program::check(source, options));
        program.map(Self::new).map_err(|found| of_diagnostics(py, &found))
    }

    fn new(program: Program) -> Self {
        Self { program, solids: Mutex::default() }
    }

    /// A solid, compiled once.
    pub fn compiled(&self, py: Python<'_>, name: &str) -> PyResult<Solid> {
        let solids = || self.solids.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(solid) = solids().get(name) {
            return Ok(solid.clone());
        }
        let solid = py.detach(|| self.program.solid(name)).map_err(|error| raised(py, error))?;
        Ok(solids().entry(name.to_string()).or_insert(solid).clone())
    }

    fn has(&self, solid: &str) -> bool {
        self.program.solids().any(|name| name == solid)
    }

    fn source(&self) -> Option<&Source> {
        self.program.sources().iter().find(|source| source.id == SourceId::File)
    }
}

#[pymethods]
impl PyProgram {
    /// Names of the solids, in the order of the file.
    #[getter]
    fn solids(&self) -> Vec<&str> {
        self.program.module().solids.iter().map(|solid| &*solid.name).collect()
    }

    /// Names of the scenes, in the order of the file.
    #[getter]
    fn scenes(&self) -> Vec<&str> {
        self.program.module().scenes.iter().map(|scene| &*scene.name).collect()
    }

    /// Params by their names, in the order of the file: `Param` has ``value``, ``low``, ``high``, ``doc`` and ``unit``.
    #[getter]
    fn params<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let class = CLASS.import(py, "rfm._records", "Param")?;
        let params = PyDict::new(py);
        for param in &self.program.module().params {
            let (low, high) = param.range.unzip();
            let unit = param.unit.as_ref().map(|(_, text)| &**text);
            let fields = (param.value, low, high, param.doc.as_deref(), unit);
            params.set_item(&param.name, class.call1(fields)?)?;
        }
        Ok(params)
    }

    /// Messages that do not prevent the use of the file: a tuple of `Diagnostic`.
    #[getter]
    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        diagnostics(py, &self.program.warnings())
    }

    /// Path of the file; None for a text.
    #[getter]
    fn path(&self) -> Option<&str> {
        self.source().map(|source| &*source.name).filter(|name| *name != TEXT)
    }

    /// Text of the file.
    #[getter]
    fn text(&self) -> &str {
        self.source().map_or("", |source| &source.text)
    }

    /// A solid by its name; without a name, the only solid of the file.
    ///
    /// Raises
    /// ------
    /// RfmError
    ///     If there is no such solid, or if no program keeps the tolerance that the file states for it.
    #[pyo3(signature = (name=None))]
    fn solid(slf: &Bound<'_, Self>, name: Option<&str>) -> PyResult<PySolid> {
        let this = slf.get();
        let name = match (name, &this.program.module().solids[..]) {
            (Some(name), _) => name,
            (None, [only]) => &only.name,
            (None, []) => return Err(crate::error::refused("the file defines no solid")),
            (None, several) => {
                let names: Vec<&str> = several.iter().map(|solid| &*solid.name).collect();
                let message = format!("name one of the solids of the file: {}", names.join(", "));
                return Err(crate::error::refused(message));
            }
        };
        PySolid::new(slf, this.compiled(slf.py(), name)?, [0.0, 0.0], None)
    }

    fn __getitem__(slf: &Bound<'_, Self>, name: &str) -> PyResult<PySolid> {
        if !slf.get().has(name) {
            let known = slf.get().program.module().solids.iter().map(|solid| solid.name.clone()).collect();
            let unknown = Error::UnknownName { kind: "solid", name: name.into(), known };
            return Err(PyKeyError::new_err(unknown.to_string()));
        }
        Self::solid(slf, Some(name))
    }

    /// Whether a solid has this name; what is no text is none.
    fn __contains__(&self, name: &Bound<'_, PyAny>) -> bool {
        name.cast::<PyString>().is_ok_and(|name| name.to_cow().is_ok_and(|name| self.has(&name)))
    }

    fn __len__(&self) -> usize {
        self.program.module().solids.len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyTuple::new(py, self.solids())?.try_iter()?.into_any())
    }

    /// A simulation of a scene at its start; without a name, of the only scene of the file.
    ///
    /// Parameters
    /// ----------
    /// name : str, optional
    /// threads : int, optional
    ///     Number of threads, at most that of processors. The results do not depend on it.
    ///
    /// Raises
    /// ------
    /// RfmError
    ///     If there is no such scene, or if it cannot be simulated.
    #[pyo3(signature = (name=None, *, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, name=None, *, threads=None)")]
    fn scene(slf: &Bound<'_, Self>, name: Option<&str>, threads: Threads) -> PyResult<PySimulation> {
        let name = match (name, &slf.get().program.module().scenes[..]) {
            (Some(name), _) => name,
            (None, [only]) => &only.name,
            (None, several) => {
                let names: Vec<&str> = several.iter().map(|scene| &*scene.name).collect();
                let message = match names[..] {
                    [] => "the file has no scene".into(),
                    _ => format!("name one of the scenes of the file: {}", names.join(", ")),
                };
                return Err(crate::error::refused(message));
            }
        };
        PySimulation::new(slf, name, threads)
    }

    /// The same file with other values for params, as `load` takes them; those that are not named keep theirs.
    #[pyo3(signature = (**params))]
    fn with_params(&self, py: Python<'_>, params: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let params = given(params)?;
        let quantities = params.iter().map(|param| (&*param.name, param.value, param.dimension));
        let changed = py.detach(|| self.program.with_quantities(quantities));
        changed.map(Self::new).map_err(|error| raised(py, error))
    }

    fn __repr__(&self) -> String {
        let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        let module = self.program.module();
        let (solids, scenes) = (count(module.solids.len(), "solid"), count(module.scenes.len(), "scene"));
        format!("<rfm.Program {}: {solids}, {scenes}>", self.path().unwrap_or(TEXT))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let rebuild = py.import("rfm._rfm")?.getattr("_program")?;
        let params: Vec<(&str, f64)> =
            self.program.overrides().iter().map(|(name, value)| (&**name, *value)).collect();
        let name = self.source().map_or(TEXT, |source| &source.name);
        // with the files that it read, so that it is the same wherever and whenever it is made again
        let files = self.program.files();
        let read = |name: String| files.read(&name).ok().map(|bytes| (name, PyBytes::new(py, &bytes)));
        let files: Vec<_> = files.asked().into_iter().filter_map(read).collect();
        Ok((rebuild, (name, self.text(), params, files).into_pyobject(py)?))
    }
}

/// A program from its name, text, params and the files that it reads; for pickles.
#[pyfunction(name = "_program")]
pub fn program_from_pickle(
    py: Python<'_>,
    name: String,
    text: String,
    params: Vec<(String, f64)>,
    files: Vec<(String, Bound<'_, PyBytes>)>,
) -> PyResult<PyProgram> {
    let params = params.into_iter().map(|(name, value)| Given { name, value, dimension: None });
    let files = Files::from_memory(files.iter().map(|(name, bytes)| (name, bytes.as_bytes())));
    PyProgram::check_with(py, Source::file(name, text), params.collect(), files)
}

/// A solid of a program by its name, at a stretch of time and for particles in a box; for pickles.
#[pyfunction(name = "_solid", signature = (program, name, from, to, over=None))]
pub fn solid_from_pickle(
    program: &Bound<'_, PyProgram>,
    name: &str,
    from: f64,
    to: f64,
    over: Option<&Bound<'_, PyAny>>,
) -> PyResult<PySolid> {
    let solid = program.get().compiled(program.py(), name)?;
    PySolid::new(program, solid, [from, to], over.map(aabb).transpose()?)
}
