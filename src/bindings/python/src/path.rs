//! Straight paths, and where they meet a solid.

use std::ops::Range;

use numpy::ndarray::Ix2;
use numpy::{PyArray, PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyTuple, PyType};
use rfm::Solid;
use rfm::field::Entry;
use rfm::glam::DVec3;

use crate::points::{numpy, refuse_masked};
use crate::pool::{Threads, Worth, in_ranges};

/// A path takes as long as ω at some ten points, and through a solid of many parts a thousand times that.
const WORTH: Worth = Worth { threads: 128, least: 8 };

/// The first entries of many paths as the class `Entry`.
pub fn first_entry<'py>(
    solid: &Solid,
    start: &Bound<'py, PyAny>,
    end: &Bound<'py, PyAny>,
    threads: Threads,
) -> PyResult<Bound<'py, PyAny>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let py = start.py();
    let numpy = numpy(py)?;
    let both = numpy.call_method1("broadcast_arrays", (doubles(start)?, doubles(end)?))?;
    let mut shape: Vec<usize> = both.get_item(0)?.getattr("shape")?.extract()?;
    if shape.last() != Some(&3) {
        return Err(PyValueError::new_err(format!("paths have the shape {shape:?}, expected (…, 3)")));
    }
    let (from, to) = (rows(&both.get_item(0)?)?, rows(&both.get_item(1)?)?);
    // nothing is known of a path from or to nowhere
    let met = |(from, to): (&DVec3, &DVec3)| {
        if from.is_finite() && to.is_finite() { solid.first_entry(*from, *to) } else { None }
    };
    let some = |range: Range<usize>| -> Vec<Option<Entry>> {
        from[range.clone()].iter().zip(&to[range]).map(met).collect()
    };
    let entries = in_ranges(py, threads, from.len(), WORTH, some)?.concat();
    let normal = |entry: &Entry| entry.normals.mean().unwrap_or(DVec3::ZERO);
    let part = PyArray1::from_iter(py, entries.iter().map(|e| e.map_or(f64::NAN, |e| e.t)));
    let point = vectors(py, &entries, |entry| entry.point)?.call_method1("reshape", (&shape,))?;
    let normal = vectors(py, &entries, normal)?.call_method1("reshape", (&shape,))?;
    let is_path = from.iter().zip(&to).map(|(from, to)| from.is_finite() && to.is_finite());
    // that there is no entry is proven, too
    let certain = entries.iter().zip(is_path).map(|(e, is_path)| is_path && e.is_none_or(|e| e.certain));
    let certain = PyArray1::from_iter(py, certain);
    shape.pop();
    let part = part.call_method1("reshape", (&shape,))?;
    let certain = certain.call_method1("reshape", (&shape,))?;
    // a single path gives numbers, as a single point does
    let (part, certain) = match shape.is_empty() {
        true => (part.call_method0("item")?, certain.call_method0("item")?),
        false => (part, certain),
    };
    CLASS.import(py, "rfm._records", "Entry")?.call1((part, point, normal, certain))
}

/// An array of doubles, of shape (…, 3). Three arrays in a tuple are columns, as they are everywhere.
fn doubles<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    refuse_masked(given)?;
    let numpy = numpy(given.py())?;
    let is_array = |part: Bound<'_, PyAny>| part.hasattr("ndim").unwrap_or(false);
    let array = match given.cast::<PyTuple>() {
        Ok(columns) if columns.len() == 3 && columns.iter().all(is_array) => {
            let columns = numpy.call_method1("broadcast_arrays", columns.clone())?;
            numpy.call_method1("stack", (columns, -1))?
        }
        Ok(_) | Err(_) => numpy.call_method1("asarray", (given,))?,
    };
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["f", "i", "u", "b"].contains(&&*kind) {
        let found = array.getattr("dtype")?;
        return Err(PyTypeError::new_err(format!("coordinates are {found}, expected real numbers")));
    }
    array.call_method1("astype", ("f8",))
}

/// A copy of the vectors of an array.
fn rows(array: &Bound<'_, PyAny>) -> PyResult<Vec<DVec3>> {
    let flat = array.call_method1("reshape", ((-1, 3),))?;
    let flat = flat.cast::<PyArray<f64, Ix2>>().map_err(PyErr::from)?;
    let rows = flat.readonly();
    Ok(rows.as_array().rows().into_iter().map(|row| DVec3::new(row[0], row[1], row[2])).collect())
}

/// One vector of each entry, or NaN, in a flat array.
fn vectors<'py>(
    py: Python<'py>,
    entries: &[Option<Entry>],
    vector: impl Fn(&Entry) -> DVec3,
) -> PyResult<Bound<'py, PyAny>> {
    let numbers = entries.iter().flat_map(|entry| entry.as_ref().map_or(DVec3::NAN, &vector).to_array());
    Ok(PyArray1::from_iter(py, numbers).into_any())
}
