//! Arguments that are points: three numbers, an array of shape (…, 3), or three arrays. They become columns.

use std::ops::Range;

use numpy::ndarray::{Ix1, Ix2};
use numpy::{Element, PyArray, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::PyTypeInfo;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyFloat, PyInt, PyList, PyModule, PyTuple};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::solid::Lane;
use rfm_columns::Column;

use crate::memory::{column, columns};

/// What a caller gave as points.
pub enum Given<'py> {
    /// Three numbers.
    One(DVec3),
    /// Arrays of doubles, or of what becomes doubles.
    Double(Points<'py, f64>),
    /// Arrays in single precision.
    Single(Points<'py, f32>),
}

/// Points in the memory of arrays.
pub struct Points<'py, T> {
    pub count: usize,
    pub columns: [Column<T>; 3],
    /// The shape of the points, without the 3 of their coordinates.
    pub shape: Vec<usize>,
    /// Whether the x of all points lie together, and so do y and z. Results that are vectors then lie so, too.
    pub by_columns: bool,
    /// Keeps the memory.
    _arrays: Vec<Bound<'py, PyAny>>,
}

impl<T: Lane + Element> Points<'_, T> {
    /// The addresses that the points occupy.
    pub fn extents(&self) -> [Range<usize>; 3] {
        self.columns.map(|column| column.extent(self.count))
    }
}

impl<'py> Given<'py> {
    /// Reads the arguments `points`, or `x, y, z`.
    ///
    /// # Errors
    /// `TypeError` for what is no real number, `ValueError` for shapes that do not fit, and those of NumPy.
    pub fn read(
        points: &Bound<'py, PyAny>,
        y: Option<&Bound<'py, PyAny>>,
        z: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        [Some(points), y, z].into_iter().flatten().try_for_each(refuse_masked)?;
        match (y, z) {
            (None, None) => {
                if let Some(points) = rows(points) {
                    return Ok(Self::Double(points));
                }
                rows(points).map_or_else(|| converted_rows(points), |points| Ok(Self::Single(points)))
            }
            (Some(y), Some(z)) => {
                let given = [points, y, z];
                if given.iter().all(|number| is_number(number)) {
                    let [x, y, z] = [points.extract()?, y.extract()?, z.extract()?];
                    return Ok(Self::One(DVec3::new(x, y, z)));
                }
                if let Some(points) = three(given) {
                    return Ok(Self::Double(points));
                }
                three(given).map_or_else(|| converted_three(given), |points| Ok(Self::Single(points)))
            }
            _ => Err(PyTypeError::new_err("expected points of shape (…, 3), or x, y and z")),
        }
    }
}

/// Whether this is a number of Python itself; numbers of NumPy that are doubles count too.
fn is_number(given: &Bound<'_, PyAny>) -> bool {
    given.is_instance_of::<PyFloat>() || given.is_instance_of::<PyInt>()
}

/// Lists that hold one another more often than this are no array: NumPy has at most 64 dimensions.
const DEEPEST: usize = 64;

/// Refuses an array some of whose elements are masked, alone or in lists: its memory has numbers for them that
/// mean nothing.
///
/// # Errors
/// `ValueError` for such an array.
pub fn refuse_masked(given: &Bound<'_, PyAny>) -> PyResult<()> {
    refuse_masked_within(given, DEEPEST)
}

/// The same for what lists hold that lie in one another, `depth` deep at most.
fn refuse_masked_within(given: &Bound<'_, PyAny>, depth: usize) -> PyResult<()> {
    let py = given.py();
    if given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>() {
        if depth == 0 {
            return Ok(()); // NumPy makes no array of it
        }
        return given.try_iter()?.try_for_each(|item| refuse_masked_within(&item?, depth - 1));
    }
    if given.get_type().is(PyUntypedArray::type_object(py)) || is_number(given) {
        return Ok(()); // nearly all, at the price of a comparison
    }
    match numpy(py)?.getattr("ma")?.call_method1("is_masked", (given,))?.is_truthy()? {
        true => Err(PyValueError::new_err(
            "the array has masked elements: leave them out, as `array.compressed()` does, or give them a value, as \
             `array.filled(numpy.nan)` does",
        )),
        false => Ok(()),
    }
}

/// The module `numpy`.
pub fn numpy(py: Python<'_>) -> PyResult<&Bound<'_, PyModule>> {
    static NUMPY: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    Ok(NUMPY.get_or_try_init(py, || py.import("numpy").map(Bound::unbind))?.bind(py))
}

/// An array of shape (n, 3) as points; `None` if it is none of this type.
fn rows<'py, T: Lane + Element>(given: &Bound<'py, PyAny>) -> Option<Points<'py, T>> {
    let array = given.cast::<PyArray<T, Ix2>>().ok()?;
    let &[count, 3] = array.shape() else { return None };
    let by_columns = array.strides()[0].abs() < array.strides()[1].abs();
    let columns = columns(array);
    Some(Points { count, columns, shape: vec![count], by_columns, _arrays: vec![given.clone()] })
}

/// Three arrays of one length as points; `None` if they are none of this type.
fn three<'py, T: Lane + Element>(given: [&Bound<'py, PyAny>; 3]) -> Option<Points<'py, T>> {
    let mut columns = Vec::with_capacity(3);
    let mut count = None;
    for array in given {
        let array = array.cast::<PyArray<T, Ix1>>().ok()?;
        if *count.get_or_insert(array.len()) != array.len() {
            return None;
        }
        columns.push(column(array));
    }
    let (count, columns) = (count?, columns.try_into().ok()?);
    let arrays = given.map(Bound::clone).to_vec();
    Some(Points { count, columns, shape: vec![count], by_columns: true, _arrays: arrays })
}

/// Anything that NumPy makes an array of shape (…, 3) of.
fn converted_rows<'py>(given: &Bound<'py, PyAny>) -> PyResult<Given<'py>> {
    let numpy = numpy(given.py())?;
    let array = numpy.call_method1("asarray", (given,))?;
    let name = number_type(&array.getattr("dtype")?)?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    let Some((3, shape)) = shape.split_last().map(|(last, rest)| (*last, rest.to_vec())) else {
        let found = array.getattr("shape")?;
        return Err(PyValueError::new_err(format!("points have the shape {found}, expected (…, 3)")));
    };
    // also makes a copy where the bytes are in a foreign order
    let array = array.call_method1("astype", (name,))?;
    let rows_of = array.call_method1("reshape", ((-1, 3),))?;
    let lost = || PyTypeError::new_err("NumPy made no array of the points");
    Ok(match name {
        "f4" => Given::Single(Points { shape, ..rows(&rows_of).ok_or_else(lost)? }),
        _ => Given::Double(Points { shape, ..rows(&rows_of).ok_or_else(lost)? }),
    })
}

/// Anything that NumPy makes three arrays of one shape of.
fn converted_three<'py>(given: [&Bound<'py, PyAny>; 3]) -> PyResult<Given<'py>> {
    let py = given[0].py();
    let numpy = numpy(py)?;
    let mut arrays = Vec::with_capacity(3);
    for given in given {
        let array = numpy.call_method1("asarray", (given,))?;
        number_type(&array.getattr("dtype")?)?;
        arrays.push(array);
    }
    // a number of Python takes the precision of the arrays beside it
    let deciding =
        given.iter().zip(&arrays).map(|(given, array)| if is_number(given) { given } else { array });
    let name = number_type(&numpy.call_method1("result_type", PyTuple::new(py, deciding)?)?)?;
    let arrays: Vec<_> =
        arrays.iter().map(|array| array.call_method1("astype", (name,))).collect::<PyResult<_>>()?;
    let together: Vec<Bound<'py, PyAny>> =
        numpy.call_method1("broadcast_arrays", PyTuple::new(py, arrays)?)?.extract()?;
    let shape: Vec<usize> = together[0].getattr("shape")?.extract()?;
    let flat: Vec<_> =
        together.iter().map(|array| array.call_method1("reshape", (-1,))).collect::<PyResult<_>>()?;
    let [x, y, z] = &flat[..] else { return Err(PyTypeError::new_err("NumPy lost an array of three")) };
    let lost = || PyTypeError::new_err("NumPy made no arrays of x, y and z");
    Ok(match name {
        "f4" => Given::Single(Points { shape, ..three([x, y, z]).ok_or_else(lost)? }),
        _ => Given::Double(Points { shape, ..three([x, y, z]).ok_or_else(lost)? }),
    })
}

/// The type in which numbers of a type are computed: `f4` for single and half precision, `f8` for doubles and
/// integers.
fn number_type(dtype: &Bound<'_, PyAny>) -> PyResult<&'static str> {
    let kind: String = dtype.getattr("kind")?.extract()?;
    let bytes: usize = dtype.getattr("itemsize")?.extract()?;
    match &*kind {
        "f" if bytes <= 4 => Ok("f4"),
        "f" | "i" | "u" | "b" => Ok("f8"),
        _ => Err(PyTypeError::new_err(format!("coordinates are {dtype}, expected real numbers"))),
    }
}

/// A box: its lowest and its highest corner, or six numbers.
///
/// # Errors
/// `ValueError` or `TypeError` if it is neither, or empty or not finite.
pub fn aabb(given: &Bound<'_, PyAny>) -> PyResult<Aabb> {
    let corners = numpy(given.py())?.call_method1("asarray", (given, "f8"))?.call_method0("ravel")?;
    let corners: Vec<f64> = corners.extract()?;
    let &[x0, y0, z0, x1, y1, z1] = &corners[..] else {
        return Err(PyValueError::new_err("expected a box: its lowest and its highest corner"));
    };
    let found = Aabb::new(DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1));
    if found.is_empty() || !found.is_finite() {
        return Err(PyValueError::new_err(format!(
            "the box from {} to {} is empty or not finite",
            found.min, found.max
        )));
    }
    Ok(found)
}
