//! Solids as source text.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rfm::Solid;
use rfm::source::{self, Options, Param, Target};

use crate::error::{raised, refused, warn};
use crate::program::PyProgram;

/// What Python asks of a text.
pub struct Asked {
    pub sign: bool,
    pub distance: bool,
    pub prefix: Option<String>,
    pub open_params: bool,
}

impl Asked {
    /// Reads the keywords of a call.
    ///
    /// # Errors
    /// `TypeError` for a keyword that there is not, or a value of another type.
    pub fn of(keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut asked = Self { sign: false, distance: false, prefix: None, open_params: false };
        for (name, value) in keywords.into_iter().flatten() {
            match name.extract::<String>()?.as_str() {
                "sign" => asked.sign = value.extract()?,
                "distance" => asked.distance = value.extract()?,
                "prefix" => asked.prefix = value.extract()?,
                "open_params" => asked.open_params = value.extract()?,
                other => return Err(PyTypeError::new_err(format!("unexpected keyword argument `{other}`"))),
            }
        }
        Ok(asked)
    }
}

/// The text of a solid of a program in a language. Warns of params that were to stay open and cannot.
///
/// # Errors
/// `RfmError` if the language cannot hold a number of the formula, or if no name may begin with the prefix.
pub fn text(
    py: Python<'_>,
    (program, solid): (&Py<PyProgram>, &Solid),
    target: Target,
    asked: Asked,
) -> PyResult<String> {
    let Asked { sign, distance, prefix, open_params } = asked;
    let program = &program.bind(py).get().program;
    let mut origin = vec![format!("Made by rfm {}, solid {}.", env!("CARGO_PKG_VERSION"), solid.name())];
    let mut params = Vec::new();
    let mut solid = solid.clone();
    let mut constants: Vec<&str> = program.params().iter().map(|param| &*param.name).collect();
    let kept;
    if open_params {
        let (opened, fixed) =
            program.with_open_params_of([solid.name()]).map_err(|error| raised(py, error))?;
        kept = source::kept_constant(solid.name(), &fixed);
        constants.retain(|name| fixed.iter().any(|fixed| fixed == name));
        let opened_params = opened.params().iter();
        params = opened_params
            .map(|param| Param { name: param.name.clone(), value: param.value, doc: param.doc.clone() })
            .collect();
        solid =
            opened.solid_with(solid.name(), rfm::Engine::Interpreter).map_err(|error| raised(py, error))?;
    } else {
        kept = None;
    }
    let values = program.params().iter().filter(|param| constants.contains(&&*param.name));
    origin.extend(source::constants(values.map(|param| (&*param.name, param.value))));
    if let Some(kept) = kept {
        warn(py, &kept)?;
        origin.push(format!("{kept}."));
    }
    let options = Options { prefix, sign, distance, params, origin, ..Options::default() };
    py.detach(|| source::write(&solid, target, &options)).map(|made| made.text).map_err(refused)
}
