//! Particles that have entered a solid, in arrays of the caller that are changed in place.

use numpy::ndarray::{Ix1, Ix2};
use numpy::{PyArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyList, PyTuple, PyType};
use rfm::sph::Rebound;
use rfm_columns::{Collisions, Column, Found, Obstacle, Particles, Vectors};

use crate::evaluate::CHEAP;
use crate::memory::{column, columns};
use crate::points::refuse_masked;
use crate::pool::{Threads, in_ranges};

/// Vectors in the memory of arrays that may be written to.
struct Given {
    count: usize,
    columns: [Column<f64>; 3],
}

/// Puts particles back, and returns what became of them as the class `Collisions`.
///
/// # Errors
/// `TypeError` or `ValueError` for arrays that are none of doubles, cannot be changed or do not fit one another.
pub fn collide<'py>(
    obstacle: &Obstacle,
    positions: &Bound<'py, PyAny>,
    velocities: &Bound<'py, PyAny>,
    rebound: &Rebound,
    threads: Threads,
) -> PyResult<Bound<'py, PyAny>> {
    static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let py = positions.py();
    if positions.is(velocities) {
        return Err(PyValueError::new_err("positions and velocities are the same array"));
    }
    let (x, v) = (vectors(positions, "positions")?, vectors(velocities, "velocities")?);
    if x.count != v.count {
        return Err(PyValueError::new_err(format!("{} positions, but {} velocities", x.count, v.count)));
    }
    // SAFETY: the arguments keep their arrays, and callers promise not to use them meanwhile
    let mut particles = Particles::new(unsafe { Vectors::new(x.count, [x.columns, v.columns]) });
    // with Python's lock, so that no other thread forks a process in which this would never end
    obstacle.prepare();
    let found = look(py, &particles, obstacle, rebound, threads)?;
    let mut counts = Collisions::default();
    // one part after the other, when all have been read: arrays of the caller may share elements
    for part in &found {
        particles.put(part);
        counts = counts.and(part.counts);
    }
    CLASS.import(py, "rfm._records", "Collisions")?.call1((counts.hits, counts.stuck, counts.undefined))
}

/// What becomes of the particles, in parts.
fn look(
    py: Python<'_>,
    particles: &Particles,
    obstacle: &Obstacle,
    rebound: &Rebound,
    threads: Threads,
) -> PyResult<Vec<Found>> {
    let part = |range| particles.look(range, obstacle, rebound);
    in_ranges(py, threads, particles.len(), CHEAP, part)
}

/// An array of shape (n, 3), or three columns.
fn vectors(given: &Bound<'_, PyAny>, name: &str) -> PyResult<Given> {
    if let Ok(array) = given.cast::<PyArray<f64, Ix2>>() {
        let &[count, 3] = array.shape() else {
            let found = array.shape();
            return Err(PyValueError::new_err(format!("{name} have the shape {found:?}, expected (n, 3)")));
        };
        check_writeable(given, name)?;
        return Ok(Given { count, columns: columns(array) });
    }
    let is_several = given.is_instance_of::<PyTuple>() || given.is_instance_of::<PyList>();
    if let Some([x, y, z]) = is_several.then(|| given.extract::<[Bound<'_, PyAny>; 3]>().ok()).flatten() {
        let (x, y, z) = (one(&x, name)?, one(&y, name)?, one(&z, name)?);
        if x.0 != y.0 || x.0 != z.0 {
            let lengths = format!("{}, {} and {}", x.0, y.0, z.0);
            return Err(PyValueError::new_err(format!("the columns of the {name} have {lengths} numbers")));
        }
        return Ok(Given { count: x.0, columns: [x.1, y.1, z.1] });
    }
    Err(not_in_place(given, name))
}

/// A column with its length.
fn one(given: &Bound<'_, PyAny>, name: &str) -> PyResult<(usize, Column<f64>)> {
    let array = given.cast::<PyArray<f64, Ix1>>().map_err(|_| not_in_place(given, name))?;
    check_writeable(given, name)?;
    Ok((array.len(), column(array)))
}

/// Refuses an array that must not be changed, or not all of it.
fn check_writeable(array: &Bound<'_, PyAny>, name: &str) -> PyResult<()> {
    refuse_masked(array)?;
    match array.getattr("flags")?.getattr("writeable")?.extract()? {
        true => Ok(()),
        false => {
            Err(PyValueError::new_err(format!("the {name} are read-only, and they are changed in place")))
        }
    }
}

fn not_in_place(given: &Bound<'_, PyAny>, name: &str) -> PyErr {
    let found = match given.getattr("dtype") {
        Ok(dtype) => format!("an array of {dtype}"),
        Err(_) => format!("{}", given.get_type()),
    };
    PyTypeError::new_err(format!(
        "{name} are {found}, expected a float64 array of shape (n, 3), or three float64 columns: they are changed \
         in place"
    ))
}
