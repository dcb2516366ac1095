//! ω on a regular grid of a plane.
//!
//! Invariant: a row is evaluated in one batch on any number of threads, so the samples have the same bits on
//! one thread and on many.

use glam::DVec2;
use rayon::prelude::*;

use super::{Plane, SliceError, Window};
use crate::field::{Field, Points};

/// ω at the nodes of a grid in a window. Row 0 is at the bottom of the window, column 0 at its left border.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    /// The plane that was sampled.
    pub plane: Plane,
    /// The part of it that was sampled.
    pub window: Window,
    /// The number of columns, two at least.
    pub columns: usize,
    /// The number of rows, two at least.
    pub rows: usize,
    /// The `rows × columns` values, row by row.
    pub omega: Vec<f64>,
}

/// Samples a field over a window of a plane, with `samples` nodes along the window's longer side and nearly
/// square cells.
///
/// # Errors
/// Those of [`Window::grid`].
pub fn sample(
    field: &dyn Field,
    plane: Plane,
    window: Window,
    samples: usize,
) -> Result<Samples, SliceError> {
    sample_while(field, plane, window, samples, &|| true)
}

/// [`sample`] that ends soon after `goes_on` has become false; then samples are missing, and are 0. It is asked before
/// each row.
///
/// # Errors
/// Those of [`Window::grid`].
pub fn sample_while(
    field: &dyn Field,
    plane: Plane,
    window: Window,
    samples: usize,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Result<Samples, SliceError> {
    let (columns, rows) = window.grid(samples)?;
    Ok(sample_grid_while(field, plane, window, (columns, rows), goes_on))
}

/// Samples a field at given numbers of columns and rows, at least two each. Cells need not be square.
pub(super) fn sample_grid(
    field: &dyn Field,
    plane: Plane,
    window: Window,
    columns: usize,
    rows: usize,
) -> Samples {
    sample_grid_while(field, plane, window, (columns, rows), &|| true)
}

fn sample_grid_while(
    field: &dyn Field,
    plane: Plane,
    window: Window,
    (columns, rows): (usize, usize),
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Samples {
    let mut samples = Samples { plane, window, columns, rows, omega: Vec::new() };
    let mut omega = vec![0.0; columns * rows];
    omega.par_chunks_mut(columns).enumerate().for_each(|(row, out)| {
        if !goes_on() {
            return;
        }
        let points: Vec<_> = (0..columns).map(|column| plane.point(samples.position(column, row))).collect();
        let [x, y, z] = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect::<Vec<_>>());
        field.omega_many(Points::new(&x, &y, &z), out);
    });
    samples.omega = omega;
    samples
}

impl Window {
    /// The columns and rows of samples, for `samples` along the longer side and nearly square cells.
    ///
    /// # Errors
    /// [`SliceError::Window`] for a window without area or with infinite sides, [`SliceError::Resolution`]
    /// for fewer than 2 or more than 8192 samples.
    pub fn grid(&self, samples: usize) -> Result<(usize, usize), SliceError> {
        let size = self.size();
        if !(size.is_finite() && self.min.is_finite() && size.x > 0.0 && size.y > 0.0) {
            return Err(SliceError::Window(*self));
        }
        if !(2..=8192).contains(&samples) {
            return Err(SliceError::Resolution(samples));
        }
        let cells = (samples - 1) as f64;
        let along = |side: f64| (cells * side / size.max_element()).round().max(1.0) as usize + 1;
        Ok((along(size.x), along(size.y)))
    }
}

impl Samples {
    /// ω at a node.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn get(&self, column: usize, row: usize) -> f64 {
        self.omega[row * self.columns + column]
    }

    /// The position (u, v) of a node. The last column and row lie exactly on the window's border.
    pub fn position(&self, column: usize, row: usize) -> DVec2 {
        let along = |i: usize, n: usize, from: f64, to: f64| {
            if i + 1 == n { to } else { from + (to - from) * (i as f64 / (n - 1) as f64) }
        };
        let Window { min, max } = self.window;
        DVec2::new(along(column, self.columns, min.x, max.x), along(row, self.rows, min.y, max.y))
    }

    /// Whether a corner of the cell to the right of and above this node is NaN.
    pub fn cell_is_undefined(&self, column: usize, row: usize) -> bool {
        [(0, 0), (1, 0), (0, 1), (1, 1)].iter().any(|&(i, j)| self.get(column + i, row + j).is_nan())
    }

    /// The number of nodes where ω is NaN.
    pub fn undefined(&self) -> usize {
        self.omega.iter().filter(|w| w.is_nan()).count()
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::disc, *};
    use crate::field::Closures;
    use crate::slice::Axis;
    use glam::DVec3;

    #[test]
    fn nodes_hold_the_value_of_the_field_there() {
        let plane = Plane::new(Axis::Y, 0.25);
        let window = Window::new(DVec2::new(-1.0, -0.5), DVec2::new(1.0, 0.5));
        let samples = sample(&disc(), plane, window, 9).unwrap();
        assert_eq!((samples.columns, samples.rows), (9, 5));
        for (column, row) in [(0, 0), (3, 2), (8, 4)] {
            let expected = disc().omega(plane.point(samples.position(column, row)));
            assert_eq!(samples.get(column, row), expected);
        }
        assert_eq!(samples.position(8, 4), window.max);
    }

    #[test]
    fn samples_end_when_they_are_not_wanted_any_more() {
        let asked = std::sync::atomic::AtomicUsize::new(0);
        let inside = Closures { omega: |_: DVec3| 1.0, gradient: |_: DVec3| DVec3::ZERO };
        let goes_on = || asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed) < 5;
        let window = Window::new(DVec2::ZERO, DVec2::ONE);
        let found = sample_while(&inside, Plane::new(Axis::Z, 0.0), window, 20, &goes_on).unwrap();
        assert_eq!(found.omega.iter().filter(|w| **w > 0.0).count(), 5 * 20);
    }

    #[test]
    fn samples_have_the_same_bits_on_one_and_two_threads() {
        let plane = Plane::new(Axis::Z, 0.0);
        let window = Window::new(DVec2::splat(-1.0), DVec2::ONE);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| sample(&disc(), plane, window, 65).unwrap())
        };
        assert_eq!(on(1), on(2));
    }

    #[test]
    fn bad_windows_and_resolutions_are_errors() {
        let flat = Window::new(DVec2::ZERO, DVec2::new(1.0, 0.0));
        assert!(matches!(flat.grid(10), Err(SliceError::Window(_))));
        let endless = Window::new(DVec2::ZERO, DVec2::new(f64::INFINITY, 1.0));
        assert!(matches!(endless.grid(10), Err(SliceError::Window(_))));
        let unit = Window::new(DVec2::ZERO, DVec2::ONE);
        assert!(matches!(unit.grid(1), Err(SliceError::Resolution(1))));
        let wide = Window::new(DVec2::ZERO, DVec2::new(2.0, 1.0));
        assert_eq!(wide.grid(101).unwrap(), (101, 51));
    }
}
