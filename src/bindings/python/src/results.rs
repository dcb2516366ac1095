//! Where results go: to new arrays, or to those that the caller gives as `out`.

use numpy::ndarray::{Ix1, Ix2};
use numpy::{Element, PyArray, PyArrayDescrMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rfm::glam::DVec3;
use rfm::solid::{Bounds, Lane};
use rfm_columns::Column;

use crate::error::refused;
use crate::memory::{column, columns, columns_of_new, new_array};
use crate::points::{Points, numpy};

/// A vector as an array of three doubles.
pub fn array(py: Python<'_>, vector: DVec3) -> Bound<'_, PyAny> {
    numpy::PyArray1::from_slice(py, &vector.to_array()).into_any()
}

/// The corners of bounds as an array of shape (2, 3), m; None if they are empty.
pub fn corners<'py>(py: Python<'py>, bounds: &Bounds) -> PyResult<Option<Bound<'py, PyAny>>> {
    let (low, high) = match bounds {
        Bounds::Within(found) => (found.min, found.max),
        Bounds::Unbounded => (DVec3::NEG_INFINITY, DVec3::INFINITY),
        Bounds::Empty => return Ok(None),
    };
    let corners = [low, high].map(|corner| corner.to_array().to_vec());
    Ok(Some(numpy::PyArray2::from_vec2(py, &corners).map_err(refused)?.into_any()))
}

/// An array for one result of `N` numbers at each point: 1 for a value, 3 for a vector.
pub struct Target<'py, T, const N: usize> {
    pub columns: [Column<T>; N],
    array: Bound<'py, PyAny>,
    /// The array of the caller, if the result must be copied there in the end.
    copied_to: Option<Bound<'py, PyAny>>,
    is_one: bool,
}

impl<'py, T: Lane + Element, const N: usize> Target<'py, T, N> {
    /// A new array, or the caller's own if it may be written to while the points are read.
    ///
    /// # Errors
    /// `TypeError` or `ValueError` if `out` has another type or shape than the result, or is read-only, and
    /// those of NumPy.
    pub fn new(py: Python<'py>, points: &Points<'py, T>, out: Option<&Bound<'py, PyAny>>) -> PyResult<Self> {
        let Some(out) = out else { return Self::made(py, points) };
        let mut shape = points.shape.clone();
        if N > 1 {
            shape.push(N);
        }
        check::<T>(out, &shape)?;
        let direct = if N == 1 {
            out.cast::<PyArray<T, Ix1>>().ok().map(|array| [column(array); N])
        } else {
            out.cast::<PyArray<T, Ix2>>().ok().map(|array| columns(array))
        };
        let is_one = points.shape.is_empty();
        match direct.filter(|columns| are_apart(columns, points) && strides_are_apart(out)) {
            Some(columns) => Ok(Self { columns, array: out.clone(), copied_to: None, is_one }),
            None => Ok(Self { copied_to: Some(out.clone()), ..Self::made(py, points)? }),
        }
    }

    fn made(py: Python<'py>, points: &Points<'py, T>) -> PyResult<Self> {
        let mut shape = points.shape.clone();
        let is_one = shape.is_empty();
        let by_columns = N > 1 && points.by_columns;
        if by_columns {
            shape.insert(0, N);
        } else if N > 1 {
            shape.push(N);
        }
        let array = new_array::<T>(py, &shape, false)?;
        let columns = columns_of_new(&array, !by_columns);
        let array = match by_columns {
            true if shape.len() == 2 => array.getattr("T")?,
            true => numpy(py)?.call_method1("moveaxis", (array, 0, -1))?,
            false => array.into_any(),
        };
        Ok(Self { columns, array, copied_to: None, is_one })
    }

    /// The array with the results in it: that of the caller, or a number if there is one point.
    pub fn finished(self) -> PyResult<Bound<'py, PyAny>> {
        match self.copied_to {
            Some(out) => {
                numpy(out.py())?.call_method1("copyto", (&out, &self.array))?;
                Ok(out)
            }
            None if self.is_one && N == 1 => self.array.get_item(()),
            None => Ok(self.array),
        }
    }

    /// Copies the result in the end rather than write to an array that shares addresses with another target.
    pub fn apart_from<const M: usize>(
        self,
        py: Python<'py>,
        points: &Points<'py, T>,
        other: &Target<'py, T, M>,
    ) -> PyResult<Self> {
        if self.copied_to.is_some() {
            return Ok(self);
        }
        let count = points.count;
        let meets = self.columns.iter().any(|column| {
            let own = column.extent(count);
            other
                .columns
                .iter()
                .map(|column| column.extent(count))
                .any(|o| own.start < o.end && o.start < own.end)
        });
        if !meets {
            return Ok(self);
        }
        Ok(Self { copied_to: Some(self.array), ..Self::made(py, points)? })
    }
}

/// Several arrays of the caller for one result; none if there is no `out`.
pub fn several<'py, const N: usize>(
    out: Option<&Bound<'py, PyAny>>,
) -> PyResult<[Option<Bound<'py, PyAny>>; N]> {
    let Some(out) = out else { return Ok([const { None }; N]) };
    let list: Vec<Bound<'py, PyAny>> = out
        .cast::<PyTuple>()
        .map_err(|_| {
            PyTypeError::new_err(format!("out is {}, expected a tuple of {N} arrays", out.get_type()))
        })?
        .iter()
        .collect();
    let list: [_; N] = list.try_into().map_err(|list: Vec<_>| {
        PyValueError::new_err(format!("out has {} arrays, expected {N}", list.len()))
    })?;
    Ok(list.map(|array| (!array.is_none()).then_some(array)))
}

/// Refuses arrays for results where there is no array of points.
pub fn no_out(out: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
    match out {
        None => Ok(()),
        Some(_) => Err(PyTypeError::new_err("out is for arrays of points, not for a single point")),
    }
}

/// Refuses an array that cannot take a result.
fn check<T: Element>(out: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<()> {
    let py = out.py();
    let Ok(array) = out.cast::<PyUntypedArray>() else {
        let class = out.get_type();
        return Err(PyTypeError::new_err(format!("out is {class}, expected an array")));
    };
    let wanted = T::get_dtype(py);
    if !array.dtype().is_equiv_to(&wanted) {
        let found = array.dtype();
        return Err(PyTypeError::new_err(format!(
            "out has the type {found}, expected {wanted} as the points have"
        )));
    }
    if array.shape() != shape {
        let found = array.shape();
        return Err(PyValueError::new_err(format!("out has the shape {found:?}, expected {shape:?}")));
    }
    if !out.getattr("flags")?.getattr("writeable")?.extract::<bool>()? {
        return Err(PyValueError::new_err("out is read-only"));
    }
    Ok(())
}

/// Whether no column shares an address with the points.
fn are_apart<T: Lane + Element>(columns: &[Column<T>], points: &Points<'_, T>) -> bool {
    let read = points.extents();
    columns.iter().all(|column| {
        let written = column.extent(points.count);
        read.iter().all(|read| written.end <= read.start || read.end <= written.start)
    })
}

/// Whether no two elements of an array share an address.
fn strides_are_apart(array: &Bound<'_, PyAny>) -> bool {
    let Ok(array) = array.cast::<PyUntypedArray>() else { return false };
    let mut sides: Vec<(usize, usize)> = array
        .strides()
        .iter()
        .map(|stride| stride.unsigned_abs())
        .zip(array.shape().iter().copied())
        .collect();
    sides.retain(|(_, length)| *length > 1);
    sides.sort_unstable();
    let mut occupied = array.dtype().itemsize();
    sides.into_iter().all(|(stride, length)| {
        let apart = stride >= occupied;
        occupied = stride * length;
        apart
    })
}
