//! The memory of NumPy's arrays: as columns, new, and shown to Python.

use std::ffi::c_int;
use std::ptr::null_mut;

use numpy::npyffi::{NpyTypes, PY_ARRAY_API, get_type_object, npy_intp};
use numpy::{Element, PyArray, PyArrayDescrMethods, PyArrayMethods, PyUntypedArrayMethods, ndarray};
use pyo3::exceptions::{PyMemoryError, PyValueError};
use pyo3::prelude::*;
use rfm_columns::Column;

use crate::points::numpy;

/// The columns of a two-dimensional array.
pub fn columns<T: Element, const N: usize>(array: &Bound<'_, PyArray<T, ndarray::Ix2>>) -> [Column<T>; N] {
    let (start, stride) = (array.data(), array.strides());
    debug_assert_eq!(array.shape()[1], N);
    std::array::from_fn(|k| Column::new(start.wrapping_byte_offset(k as isize * stride[1]), stride[0]))
}

/// A one-dimensional array as a column.
pub fn column<T: Element>(array: &Bound<'_, PyArray<T, ndarray::Ix1>>) -> Column<T> {
    Column::new(array.data(), array.strides()[0])
}

/// The numbers of a new array, in the order of memory, as `N` columns: one after the other, or interleaved.
pub fn columns_of_new<T: Element, const N: usize>(
    array: &Bound<'_, PyArray<T, ndarray::IxDyn>>,
    interleaved: bool,
) -> [Column<T>; N] {
    let (start, count) = (array.data(), array.len() / N);
    std::array::from_fn(|k| match interleaved {
        true => Column::new(start.wrapping_add(k), (N * size_of::<T>()) as isize),
        false => Column::new(start.wrapping_add(k * count), size_of::<T>() as isize),
    })
}

/// A new array whose numbers are to be written, in C or in Fortran order.
///
/// # Errors
/// Those of NumPy, if the array is too large.
pub fn new_array<'py, T: Element>(
    py: Python<'py>,
    shape: &[usize],
    fortran: bool,
) -> PyResult<Bound<'py, PyArray<T, ndarray::IxDyn>>> {
    let too_large = |_| PyMemoryError::new_err("the array would be too large");
    let mut dims: Vec<npy_intp> =
        shape.iter().map(|&n| npy_intp::try_from(n).map_err(too_large)).collect::<PyResult<_>>()?;
    let dtype = T::get_dtype(py).into_dtype_ptr();
    // SAFETY: the arguments are those of NumPy's manual; the type is new and given away, and a null pointer
    // with an exception set becomes an error
    let array = unsafe {
        let array = PY_ARRAY_API.PyArray_NewFromDescr(
            py,
            get_type_object(py, NpyTypes::PyArray_Type),
            dtype,
            dims.len() as c_int,
            dims.as_mut_ptr(),
            null_mut(),
            null_mut(),
            c_int::from(fortran),
            null_mut(),
        );
        Bound::from_owned_ptr_or_err(py, array)?
    };
    // SAFETY: it was made with this type of numbers; they are plain numbers, for which any bits will do
    Ok(unsafe { array.cast_into_unchecked() })
}

/// The rows of an array of shape (n, N), copied. `dtype` is NumPy's name of `T`, into which other numbers are turned.
///
/// # Errors
/// `ValueError` for another shape, and those of NumPy for what is no such array.
pub fn rows_of<T: Element + Copy, const N: usize>(
    given: &Bound<'_, PyAny>,
    dtype: &str,
) -> PyResult<Vec<[T; N]>> {
    let array = contiguous::<T>(given, dtype)?;
    let &[_, columns] = array.shape() else { return Err(wrong_shape(&array)) };
    if columns != N {
        return Err(wrong_shape(&array));
    }
    let numbers = array.try_readonly()?;
    let (rows, _) = numbers.as_slice()?.as_chunks::<N>();
    Ok(rows.to_vec())
}

/// An array as one whose numbers lie one after the other in memory, as Rust reads them.
///
/// # Errors
/// Those of NumPy for what is no array of numbers.
pub fn contiguous<'py, T: Element>(
    given: &Bound<'py, PyAny>,
    dtype: &str,
) -> PyResult<Bound<'py, PyArray<T, ndarray::IxDyn>>> {
    let array = numpy(given.py())?.call_method1("require", (given, dtype, ["C", "A"]))?;
    Ok(array.cast_into()?)
}

/// Refuses an array for its shape.
pub fn wrong_shape<T: Element>(array: &Bound<'_, PyArray<T, ndarray::IxDyn>>) -> PyErr {
    PyValueError::new_err(format!(
        "an array of the pickle has the shape {:?}, which does not fit",
        array.shape()
    ))
}

/// A read-only array that shows a slice.
///
/// # Safety
/// The slice stays where it is, and nothing writes to it, as long as `owner` is alive.
// SAFETY: the caller promises what NumPy needs
pub unsafe fn view<'py, T: Element>(slice: &[T], owner: Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let shown = ndarray::ArrayView1::from(slice);
    // SAFETY: the caller promises what NumPy needs
    let array = unsafe { PyArray::borrow_from_array(&shown, owner) };
    array.call_method1("setflags", (false,))?;
    Ok(array.into_any())
}
