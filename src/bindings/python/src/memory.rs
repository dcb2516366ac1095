//! Columns of numbers in the memory of NumPy's arrays: read, written, and made.
//!
//! This is the only file that uses pointers. Slices are made only of columns that are whole, aligned and apart
//! from all others; everything else is copied through blocks on the stack, number by number.

use std::ffi::c_int;
use std::ops::Range;
use std::ptr::null_mut;

use numpy::npyffi::{NpyTypes, PY_ARRAY_API, get_type_object, npy_intp};
use numpy::{Element, PyArray, PyArrayDescrMethods, PyArrayMethods, PyUntypedArrayMethods, ndarray};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;

use crate::evaluate::Number;

/// Points that are copied at a time.
pub const BLOCK: usize = 512;

/// Numbers at equal distances in memory.
#[derive(Debug)]
pub struct Column<T> {
    start: *mut T,
    /// Distance between two numbers, bytes.
    stride: isize,
}

impl<T> Clone for Column<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Column<T> {}

impl<T> Column<T> {
    /// Whether the numbers follow one another, aligned, so that they may be seen as a slice.
    fn is_slice(self) -> bool {
        self.stride == size_of::<T>() as isize && self.start.is_aligned()
    }

    fn at(self, i: usize) -> *mut T {
        self.start.wrapping_byte_offset(i as isize * self.stride)
    }

    /// The addresses that `count` numbers occupy.
    pub fn extent(self, count: usize) -> Range<usize> {
        if count == 0 {
            return 0..0;
        }
        let (first, last) = (self.start.addr(), self.at(count - 1).addr());
        first.min(last)..first.max(last) + size_of::<T>()
    }
}

/// The columns that an evaluation reads and writes: those of points, and those of results. A result without
/// a column is not wanted.
pub struct Job<T, const N: usize> {
    count: usize,
    points: [Column<T>; 3],
    results: [Option<Column<T>>; N],
    /// The results, if they and the points are all slices.
    slices: Option<[Column<T>; N]>,
    /// Whether each point is three numbers that follow one another.
    is_interleaved: bool,
}

// SAFETY: the pointers lead to arrays that the caller of `Job::new` keeps alive, and threads write to
// different parts of them
unsafe impl<T: Send, const N: usize> Send for Job<T, N> {}
// SAFETY: as above
unsafe impl<T: Sync, const N: usize> Sync for Job<T, N> {}

impl<T: Number, const N: usize> Job<T, N> {
    /// # Safety
    /// The columns have `count` numbers each, in arrays that outlive the job. Nothing else writes to the
    /// columns of points or uses those of results meanwhile. No column of results shares an address with a
    /// column of points or with another one of results.
    pub unsafe fn new(count: usize, points: [Column<T>; 3], results: [Option<Column<T>>; N]) -> Self {
        let wanted: Vec<Column<T>> =
            results.into_iter().flatten().filter(|column| column.is_slice()).collect();
        let slices = <[Column<T>; N]>::try_from(wanted).ok();
        let slices = slices.filter(|_| points.iter().all(|column| column.is_slice()));
        let [x, y, z] = points;
        let is_interleaved = x.stride == 3 * size_of::<T>() as isize
            && points.iter().all(|column| column.stride == x.stride)
            && y.start == x.start.wrapping_add(1)
            && z.start == x.start.wrapping_add(2);
        Self { count, points, results, slices, is_interleaved }
    }

    /// The number of points.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Evaluates a part of the points. Parts that run at the same time must be disjoint.
    pub fn run(&self, part: Range<usize>, evaluate: &impl Fn([&[T]; 3], [&mut [T]; N])) {
        debug_assert!(part.end <= self.count);
        let Some(results) = self.slices else { return self.run_in_blocks(part, evaluate) };
        let points = self.points.map(|column| self.slice(column, &part));
        let results = results.map(|column| {
            // SAFETY: `new` promises that the numbers exist and that nothing else uses them
            unsafe { std::slice::from_raw_parts_mut(column.at(part.start), part.len()) }
        });
        evaluate(points, results);
    }

    /// A part of a column of points as a slice.
    fn slice(&self, column: Column<T>, part: &Range<usize>) -> &[T] {
        debug_assert!(column.is_slice());
        // SAFETY: `new` promises that the numbers exist and that nothing writes to them
        unsafe { std::slice::from_raw_parts(column.at(part.start), part.len()) }
    }

    fn run_in_blocks(&self, part: Range<usize>, evaluate: &impl Fn([&[T]; 3], [&mut [T]; N])) {
        let mut gathered = [[T::default(); BLOCK]; 3];
        let mut computed = [[T::default(); BLOCK]; N];
        for start in part.clone().step_by(BLOCK) {
            let block = start..(start + BLOCK).min(part.end);
            self.gather(&block, &mut gathered);
            let mut points = gathered.each_ref().map(|column| &column[..block.len()]);
            for (points, column) in points.iter_mut().zip(self.points) {
                if column.is_slice() {
                    *points = self.slice(column, &block);
                }
            }
            let mut results = computed.each_mut().map(|column| &mut column[..block.len()]);
            for (result, column) in results.iter_mut().zip(self.results) {
                if let Some(column) = column.filter(|column| column.is_slice()) {
                    // SAFETY: `new` promises that the numbers exist and that nothing else uses them
                    *result = unsafe { std::slice::from_raw_parts_mut(column.at(block.start), block.len()) };
                }
            }
            evaluate(points, results);
            for (column, values) in self.results.iter().zip(&computed) {
                let Some(column) = column.filter(|column| !column.is_slice()) else { continue };
                for (i, value) in block.clone().zip(values) {
                    // SAFETY: `new` promises that the number exists and that nothing else uses it
                    unsafe { column.at(i).write_unaligned(*value) };
                }
            }
        }
    }

    /// Copies the points of a block that are not slices already.
    fn gather(&self, block: &Range<usize>, gathered: &mut [[T; BLOCK]; 3]) {
        if self.is_interleaved {
            let first = self.points[0].at(block.start).cast::<u8>();
            // SAFETY: `new` promises that the points exist and that nothing writes to them; bytes need no
            // alignment
            let bytes = unsafe { std::slice::from_raw_parts(first, block.len() * size_of::<[T; 3]>()) };
            T::deinterleave(bytes, gathered);
            return;
        }
        for (column, numbers) in self.points.into_iter().zip(gathered) {
            if column.is_slice() {
                continue;
            }
            for (i, number) in block.clone().zip(numbers) {
                // SAFETY: `new` promises that the number exists
                *number = unsafe { column.at(i).read_unaligned() };
            }
        }
    }
}

/// The columns of a two-dimensional array.
pub fn columns<T: Element, const N: usize>(array: &Bound<'_, PyArray<T, ndarray::Ix2>>) -> [Column<T>; N] {
    let (start, stride) = (array.data(), array.strides());
    debug_assert_eq!(array.shape()[1], N);
    std::array::from_fn(|k| Column {
        start: start.wrapping_byte_offset(k as isize * stride[1]),
        stride: stride[0],
    })
}

/// A one-dimensional array as a column.
pub fn column<T: Element>(array: &Bound<'_, PyArray<T, ndarray::Ix1>>) -> Column<T> {
    Column { start: array.data(), stride: array.strides()[0] }
}

/// The numbers of a new array, in the order of memory, as `N` columns: one after the other, or interleaved.
pub fn columns_of_new<T: Element, const N: usize>(
    array: &Bound<'_, PyArray<T, ndarray::IxDyn>>,
    interleaved: bool,
) -> [Column<T>; N] {
    let (start, count) = (array.data(), array.len() / N);
    std::array::from_fn(|k| match interleaved {
        true => Column { start: start.wrapping_add(k), stride: (N * size_of::<T>()) as isize },
        false => Column { start: start.wrapping_add(k * count), stride: size_of::<T>() as isize },
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

/// A read-only array that shows a slice.
///
/// # Safety
/// The slice stays where it is, and nothing writes to it, as long as `owner` is alive.
pub unsafe fn view<'py, T: Element>(slice: &[T], owner: Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let shown = ndarray::ArrayView1::from(slice);
    // SAFETY: the caller promises what NumPy needs
    let array = unsafe { PyArray::borrow_from_array(&shown, owner) };
    array.call_method1("setflags", (false,))?;
    Ok(array.into_any())
}
