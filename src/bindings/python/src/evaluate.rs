//! Questions about many points: over columns, on one thread or several.

use numpy::Element;
use pyo3::prelude::*;
use rfm::Solid;
use rfm::glam::DVec3;
use rfm::solid::{Chosen, Distances};
use rfm_columns::{Column, Job, Number};

use crate::points::Points;
use crate::pool::{CHUNK, Threads, Worth, in_ranges};
use crate::results::Target;

/// Points whose answers take as long as ω does.
pub const CHEAP: Worth = Worth { threads: 4 * CHUNK, least: 64 };

/// Points of which each takes as long as ω at a thousand, or at a hundred thousand.
const COSTLY: Worth = Worth { threads: 2, least: 1 };

/// Numbers that points have, as doubles and back.
pub trait Rounded: Number + Element {
    /// Itself.
    fn wide(self) -> f64;

    /// The nearest one.
    fn nearest(value: f64) -> Self;

    /// The greatest one that is not above a double.
    fn below(value: f64) -> Self;
}

impl Rounded for f32 {
    fn wide(self) -> f64 {
        self.into()
    }

    fn nearest(value: f64) -> Self {
        value as f32
    }

    fn below(value: f64) -> Self {
        let nearest = value as f32;
        if f64::from(nearest) > value { nearest.next_down() } else { nearest }
    }
}

impl Rounded for f64 {
    fn wide(self) -> f64 {
        self
    }

    fn nearest(value: f64) -> Self {
        value
    }

    fn below(value: f64) -> Self {
        value
    }
}

/// Calls `evaluate` for all points.
fn over<T: Number + Element, const N: usize>(
    py: Python<'_>,
    points: &Points<'_, T>,
    results: [Option<Column<T>>; N],
    threads: Threads,
    evaluate: impl Fn([&[T]; 3], [&mut [T]; N]) + Sync,
) -> PyResult<()> {
    over_worth(py, points, results, (threads, CHEAP), evaluate)
}

/// Calls `evaluate` for all points, on several threads where they are worth it.
fn over_worth<T: Number + Element, const N: usize>(
    py: Python<'_>,
    points: &Points<'_, T>,
    results: [Option<Column<T>>; N],
    (threads, worth): (Threads, Worth),
    evaluate: impl Fn([&[T]; 3], [&mut [T]; N]) + Sync,
) -> PyResult<()> {
    // SAFETY: `points` keeps its arrays, the callers below keep those of the results, and `Target` sees to it
    // that results share no address with the points or with one another
    let job = unsafe { Job::new(points.count, points.columns, results) };
    in_ranges(py, threads, job.len(), worth, |range| job.run(range, &evaluate))?;
    Ok(())
}

/// One question to a solid, with the arguments that all questions have.
pub struct Question<'a, 'py> {
    pub py: Python<'py>,
    pub solid: &'a Solid,
    pub chosen: Option<&'a Chosen>,
    pub threads: Threads,
}

/// Asks a question about points of either precision, or returns `$one` for a single point.
macro_rules! ask {
    ($self:ident, $points:expr, $threads:ident, |$p:ident| $one:expr, |$question:ident, $columns:ident| $many:expr) => {{
        let (points, y, z): (&Bound<'py, PyAny>, Option<&Bound<'py, PyAny>>, Option<&Bound<'py, PyAny>>) =
            $points;
        let py = points.py();
        let $question = $crate::evaluate::Question {
            py,
            solid: &$self.solid,
            chosen: $self.chosen.as_ref(),
            threads: $threads,
        };
        match $crate::points::Given::read(points, y, z)? {
            $crate::points::Given::One($p) => $one,
            $crate::points::Given::Double($columns) => $many,
            $crate::points::Given::Single($columns) => $many,
        }
    }};
}

pub(crate) use ask;

/// Something of Python's.
type Any<'py> = Bound<'py, PyAny>;

impl<'py> Question<'_, 'py> {
    /// ω at points.
    pub fn omega<T: Number + Element>(
        &self,
        points: &Points<'py, T>,
        out: Option<&Any<'py>>,
    ) -> PyResult<Any<'py>> {
        let omega = Target::<T, 1>::new(self.py, points, out)?;
        let (solid, chosen) = (self.solid, self.chosen);
        over(self.py, points, omega.columns.map(Some), self.threads, |points, [omega]| {
            T::omega(solid, chosen, points, omega);
        })?;
        omega.finished()
    }

    /// The sign of the solid at points.
    pub fn sign<T: Number + Element>(
        &self,
        points: &Points<'py, T>,
        out: Option<&Any<'py>>,
    ) -> PyResult<Any<'py>> {
        let sign = Target::<T, 1>::new(self.py, points, out)?;
        let solid = self.solid;
        over(self.py, points, sign.columns.map(Some), self.threads, |points, [sign]| {
            solid.sign_many(points, sign);
        })?;
        sign.finished()
    }

    /// ∇ω at points.
    pub fn gradient<T: Number + Element>(
        &self,
        points: &Points<'py, T>,
        out: Option<&Any<'py>>,
    ) -> PyResult<Any<'py>> {
        let gradient = Target::<T, 3>::new(self.py, points, out)?;
        let [x, y, z] = gradient.columns.map(Some);
        self.omega_and_gradient_into(points, [None, x, y, z])?;
        gradient.finished()
    }

    /// ω and ∇ω at points.
    pub fn omega_gradient<T: Number + Element>(
        &self,
        points: &Points<'py, T>,
        out: [Option<Any<'py>>; 2],
    ) -> PyResult<(Any<'py>, Any<'py>)> {
        let [for_omega, for_gradient] = out;
        let omega = Target::<T, 1>::new(self.py, points, for_omega.as_ref())?;
        let gradient = Target::<T, 3>::new(self.py, points, for_gradient.as_ref())?;
        let gradient = gradient.apart_from(self.py, points, &omega)?;
        let ([w], [x, y, z]) = (omega.columns, gradient.columns);
        self.omega_and_gradient_into(points, [w, x, y, z].map(Some))?;
        Ok((omega.finished()?, gradient.finished()?))
    }

    fn omega_and_gradient_into<T: Number + Element>(
        &self,
        points: &Points<'py, T>,
        results: [Option<Column<T>>; 4],
    ) -> PyResult<()> {
        let solid = self.solid;
        over(self.py, points, results, self.threads, |points, out| solid.omega_grad_many(points, out))
    }

    /// The velocity of the surface near points. It is computed in double precision.
    pub fn wall_velocity<T: Rounded>(
        &self,
        points: &Points<'py, T>,
        out: Option<&Any<'py>>,
    ) -> PyResult<Any<'py>> {
        let velocity = Target::<T, 3>::new(self.py, points, out)?;
        let solid = self.solid;
        over(self.py, points, velocity.columns.map(Some), self.threads, |points, [x, y, z]| {
            for i in 0..x.len() {
                let found = solid.wall_velocity(DVec3::from_array(points.map(|column| column[i].wide())));
                [x[i], y[i], z[i]] = found.to_array().map(T::nearest);
            }
        })?;
        velocity.finished()
    }

    /// Distances that are proven at points. They are found in double precision.
    pub fn clearance<T: Rounded>(
        &self,
        points: &Points<'py, T>,
        out: Option<&Any<'py>>,
    ) -> PyResult<Any<'py>> {
        let clearance = Target::<T, 1>::new(self.py, points, out)?;
        let distances = Distances::new(self.solid);
        let (results, threads) = (clearance.columns.map(Some), (self.threads, COSTLY));
        over_worth(self.py, points, results, threads, |points, [clearance]| {
            for (i, clearance) in clearance.iter_mut().enumerate() {
                let at = DVec3::from_array(points.map(|column| column[i].wide()));
                *clearance = T::below(distances.at(at).clearance);
            }
        })?;
        clearance.finished()
    }

    /// Distance, normal and mean curvature at points.
    pub fn contact<T: Number + Element>(
        &self,
        points: &Points<'py, T>,
        out: [Option<Any<'py>>; 3],
    ) -> PyResult<(Any<'py>, Any<'py>, Any<'py>)> {
        let [for_distance, for_normal, for_curvature] = out;
        let distance = Target::<T, 1>::new(self.py, points, for_distance.as_ref())?;
        let normal = Target::<T, 3>::new(self.py, points, for_normal.as_ref())?;
        let normal = normal.apart_from(self.py, points, &distance)?;
        let curvature = Target::<T, 1>::new(self.py, points, for_curvature.as_ref())?;
        let curvature =
            curvature.apart_from(self.py, points, &distance)?.apart_from(self.py, points, &normal)?;
        let ([d], [x, y, z], [c]) = (distance.columns, normal.columns, curvature.columns);
        let solid = self.solid;
        over(self.py, points, [d, x, y, z, c].map(Some), self.threads, |points, out| {
            solid.contact_many(points, out);
        })?;
        Ok((distance.finished()?, normal.finished()?, curvature.finished()?))
    }
}
