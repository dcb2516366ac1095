//! Columns of numbers in memory that another language owns.
//!
//! Slices are made only of columns that are whole, aligned and apart from all others; everything else is copied
//! through blocks on the stack, number by number.

use std::ops::Range;

use crate::number::Number;

/// Numbers that a column of copied points has room for.
pub const BLOCK: usize = 256;

/// Bytes of a column that are copied at a time. Rows are read while nothing is computed, so that the
/// processor waits for those that it has not fetched on its own; with more bytes it waits, with fewer the
/// calls cost more.
const BYTES_AT_A_TIME: usize = 1024;

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
    /// A column by its first number and the distance between two numbers, bytes.
    pub fn new(start: *mut T, stride: isize) -> Self {
        Self { start, stride }
    }

    /// Whether the numbers follow one another, aligned, so that they may be seen as a slice.
    fn is_slice(self) -> bool {
        self.stride == size_of::<T>() as isize && self.start.is_aligned()
    }

    fn at(self, i: usize) -> *mut T {
        self.start.wrapping_byte_offset(i as isize * self.stride)
    }

    /// Number `i`.
    ///
    /// # Safety
    /// There is one, and nothing writes to it meanwhile.
    // SAFETY: the caller promises what the read needs
    unsafe fn read(self, i: usize) -> T
    where
        T: Copy,
    {
        // SAFETY: the caller promises the number; it need not be aligned
        unsafe { self.at(i).read_unaligned() }
    }

    /// Replaces number `i`.
    ///
    /// # Safety
    /// There is one, and nothing else uses it meanwhile.
    // SAFETY: the caller promises what the write needs
    unsafe fn write(self, i: usize, number: T) {
        // SAFETY: the caller promises the number; it need not be aligned
        unsafe { self.at(i).write_unaligned(number) };
    }

    /// The addresses from the first to the last of `count` numbers.
    pub fn extent(self, count: usize) -> Range<usize> {
        if count == 0 {
            return 0..0;
        }
        let (first, last) = (self.start.addr(), self.at(count - 1).addr());
        first.min(last)..first.max(last) + size_of::<T>()
    }
}

/// Vectors that may be changed, `N` at each index, as columns.
pub struct Vectors<const N: usize> {
    count: usize,
    columns: [[Column<f64>; 3]; N],
}

// SAFETY: the pointers lead to memory that the caller of `Vectors::new` keeps
unsafe impl<const N: usize> Send for Vectors<N> {}
// SAFETY: what takes `&self` only reads
unsafe impl<const N: usize> Sync for Vectors<N> {}

impl<const N: usize> Vectors<N> {
    /// Vectors by the columns of their components.
    ///
    /// # Safety
    /// The columns have `count` numbers each, in memory that outlives the vectors, and nothing else uses them
    /// meanwhile.
    // SAFETY: the caller promises what the methods need
    pub unsafe fn new(count: usize, columns: [[Column<f64>; 3]; N]) -> Self {
        Self { count, columns }
    }

    /// The number of indices.
    #[allow(clippy::len_without_is_empty)] // not needed
    pub fn len(&self) -> usize {
        self.count
    }

    /// Vector `k` at an index.
    ///
    /// # Panics
    /// If there is none.
    #[inline]
    pub fn get(&self, k: usize, i: usize) -> [f64; 3] {
        assert!(i < self.count, "an index of a vector");
        // SAFETY: `new` promises that the numbers exist
        self.columns[k].map(|column| unsafe { column.read(i) })
    }

    /// Replaces vector `k` at an index.
    ///
    /// # Panics
    /// If there is none.
    pub fn set(&mut self, k: usize, i: usize, vector: [f64; 3]) {
        assert!(i < self.count, "an index of a vector");
        for (column, number) in self.columns[k].into_iter().zip(vector) {
            // SAFETY: `new` promises that the number exists, and that nothing else uses it
            unsafe { column.write(i, number) };
        }
    }
}

/// The columns that an evaluation reads and writes: those of points, and those of results. A result without
/// a column is not wanted.
pub struct Job<T, const N: usize> {
    count: usize,
    points: [Column<T>; 3],
    results: [Option<Column<T>>; N],
    /// Whether results lie away from the points and from one another, so that columns may be seen as slices.
    /// If not, every number is copied.
    is_apart: bool,
    /// The results, if they and the points are all slices.
    slices: Option<[Column<T>; N]>,
    /// Whether each point is three numbers that follow one another.
    is_interleaved: bool,
}

// SAFETY: the pointers lead to memory that the caller of `Job::new` keeps, and threads write to different parts
// of it
unsafe impl<T: Send, const N: usize> Send for Job<T, N> {}
// SAFETY: as above
unsafe impl<T: Sync, const N: usize> Sync for Job<T, N> {}

impl<T: Number, const N: usize> Job<T, N> {
    /// A job over `count` points. Results may replace the points that they belong to, or lie between them; what
    /// they say is undefined if they lie on other points, or on one another.
    ///
    /// # Safety
    /// The columns have `count` numbers each, in memory that outlives the job. Nothing else writes to the columns
    /// of points or uses those of results meanwhile. Parts that [`Job::run`] evaluates at the same time are
    /// disjoint, and then no result lies on a point.
    // SAFETY: the caller promises what `run` needs
    pub unsafe fn new(count: usize, points: [Column<T>; 3], results: [Option<Column<T>>; N]) -> Self {
        let is_apart = are_apart(count, &points, &results);
        let sliced = results.into_iter().flatten().filter(|column| column.is_slice());
        let slices = <[Column<T>; N]>::try_from(sliced.collect::<Vec<_>>()).ok();
        let slices = slices.filter(|_| is_apart && points.iter().all(|column| column.is_slice()));
        let [x, y, z] = points;
        let is_interleaved = is_apart
            && x.stride == 3 * size_of::<T>() as isize
            && points.iter().all(|column| column.stride == x.stride)
            && y.start == x.start.wrapping_add(1)
            && z.start == x.start.wrapping_add(2);
        Self { count, points, results, is_apart, slices, is_interleaved }
    }

    /// The number of points.
    #[allow(clippy::len_without_is_empty)] // not needed
    pub fn len(&self) -> usize {
        self.count
    }

    /// Evaluates a part of the points: `evaluate` gets their columns and those of the results.
    ///
    /// # Panics
    /// If there are fewer points.
    pub fn run(&self, part: Range<usize>, evaluate: &impl Fn([&[T]; 3], [&mut [T]; N])) {
        assert!(part.start <= part.end && part.end <= self.count, "a part of the points");
        if part.is_empty() {
            return; // the addresses of no numbers may be null
        }
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
        let size = (BYTES_AT_A_TIME / size_of::<T>()).min(BLOCK);
        for start in part.clone().step_by(size) {
            let block = start..(start + size).min(part.end);
            self.gather(&block, &mut gathered);
            let mut points = gathered.each_ref().map(|column| &column[..block.len()]);
            for (points, column) in points.iter_mut().zip(self.points) {
                if self.is_apart && column.is_slice() {
                    *points = self.slice(column, &block);
                }
            }
            let mut results = computed.each_mut().map(|column| &mut column[..block.len()]);
            for (result, column) in results.iter_mut().zip(self.results) {
                if let Some(column) = column.filter(|column| self.is_apart && column.is_slice()) {
                    // SAFETY: `new` promises that the numbers exist and that nothing else uses them
                    *result = unsafe { std::slice::from_raw_parts_mut(column.at(block.start), block.len()) };
                }
            }
            evaluate(points, results);
            for (column, values) in self.results.iter().zip(&computed) {
                let Some(column) = column.filter(|column| !(self.is_apart && column.is_slice())) else {
                    continue;
                };
                for (i, value) in block.clone().zip(values) {
                    // SAFETY: `new` promises that the number exists and that nothing else uses it
                    unsafe { column.write(i, *value) };
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
            if self.is_apart && column.is_slice() {
                continue;
            }
            for (i, number) in block.clone().zip(numbers) {
                // SAFETY: `new` promises that the number exists
                *number = unsafe { column.read(i) };
            }
        }
    }
}

/// Whether no result may share an address with a point, and no slice of results with another result.
fn are_apart<T>(count: usize, points: &[Column<T>; 3], results: &[Option<Column<T>>]) -> bool {
    let meets = |a: Range<usize>, b: Range<usize>| a.start < b.end && b.start < a.end;
    let results: Vec<Column<T>> = results.iter().copied().flatten().collect();
    let on_points = results
        .iter()
        .any(|result| points.iter().any(|point| meets(result.extent(count), point.extent(count))));
    let on_results = results.iter().enumerate().any(|(i, a)| {
        results[i + 1..]
            .iter()
            .any(|b| (a.is_slice() || b.is_slice()) && meets(a.extent(count), b.extent(count)))
    });
    !(on_points || on_results)
}
