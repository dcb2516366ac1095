//! Questions of `Solid` about points: ω, its gradient, sign, contact, the velocity of the surface, and clearance.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;

use super::PySolid;
use crate::evaluate::ask;
use crate::pool::Threads;
use crate::results::{array, no_out, several};

#[pymethods]
impl PySolid {
    /// ω at points, as `omega`; for a single point, three numbers, a ``float``.
    #[pyo3(signature = (points, y=None, z=None, /))]
    fn __call__<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        y: Option<&Bound<'py, PyAny>>,
        z: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.omega(points, y, z, None, Threads::Auto)
    }

    /// ω at points.
    ///
    /// Parameters
    /// ----------
    /// points : array of shape (..., 3), m; or x, y, z : arrays that broadcast together, or numbers
    /// out : array of shape (...), optional
    /// threads : int, optional
    ///
    /// Returns
    /// -------
    /// Array of shape (...), in the units of the formula; a ``float`` for a single point. If the file states a
    /// tolerance, doubles are computed by the cheapest program that keeps it.
    #[pyo3(signature = (points, y=None, z=None, /, *, out=None, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, points, y=None, z=None, /, *, out=None, threads=None)")]
    fn omega<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        y: Option<&Bound<'py, PyAny>>,
        z: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Threads,
    ) -> PyResult<Bound<'py, PyAny>> {
        ask!(
            self,
            (points, y, z),
            threads,
            |p| {
                no_out(out)?;
                Ok(self.omega_at(p).into_pyobject(points.py())?.into_any())
            },
            |question, columns| question.omega(&columns, out)
        )
    }

    /// ∇ω at points.
    ///
    /// Near the surface it points into the solid. At edges and corners it is one finite member of the limits.
    ///
    /// Parameters
    /// ----------
    /// points : array of shape (..., 3), m; or x, y, z : arrays that broadcast together, or numbers
    /// out : array of shape (..., 3), optional
    /// threads : int, optional
    ///
    /// Returns
    /// -------
    /// Array of shape (..., 3), in units of ω per metre. If x, y and z came as columns, it consists of columns:
    /// ``gradient[:, 0]`` is contiguous.
    #[pyo3(signature = (points, y=None, z=None, /, *, out=None, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, points, y=None, z=None, /, *, out=None, threads=None)")]
    fn gradient<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        y: Option<&Bound<'py, PyAny>>,
        z: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Threads,
    ) -> PyResult<Bound<'py, PyAny>> {
        ask!(
            self,
            (points, y, z),
            threads,
            |p| {
                no_out(out)?;
                Ok(array(points.py(), self.solid.omega_grad(p).1))
            },
            |question, columns| question.gradient(&columns, out)
        )
    }

    /// ω and ∇ω at points, for the price of the gradient.
    ///
    /// Parameters
    /// ----------
    /// points : array of shape (..., 3), m; or x, y, z : arrays that broadcast together, or numbers
    /// out : tuple of two arrays, optional
    ///     For ω of shape (...), and for ∇ω of shape (..., 3); either may be None.
    /// threads : int, optional
    ///
    /// Returns
    /// -------
    /// Tuple of both, as `omega` and `gradient` return them; a tolerance of the file is not used.
    #[pyo3(signature = (points, y=None, z=None, /, *, out=None, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, points, y=None, z=None, /, *, out=None, threads=None)")]
    fn omega_gradient<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        y: Option<&Bound<'py, PyAny>>,
        z: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Threads,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        ask!(
            self,
            (points, y, z),
            threads,
            |p| {
                no_out(out)?;
                let (omega, gradient) = self.solid.omega_grad(p);
                Ok((omega.into_pyobject(points.py())?.into_any(), array(points.py(), gradient)))
            },
            |question, columns| question.omega_gradient(&columns, several(out)?)
        )
    }

    /// Whether points are inside (1), on the surface (0) or outside (-1): exactly the logic of the parts, each
    /// by the sign of its rounded formula.
    ///
    /// Parameters
    /// ----------
    /// points : array of shape (..., 3), m; or x, y, z : arrays that broadcast together, or numbers
    /// out : array of shape (...), optional
    /// threads : int, optional
    ///
    /// Returns
    /// -------
    /// Array of shape (...) with the type of the points; NaN where the formula has no value.
    #[pyo3(signature = (points, y=None, z=None, /, *, out=None, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, points, y=None, z=None, /, *, out=None, threads=None)")]
    fn sign<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        y: Option<&Bound<'py, PyAny>>,
        z: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Threads,
    ) -> PyResult<Bound<'py, PyAny>> {
        ask!(
            self,
            (points, y, z),
            threads,
            |p| {
                no_out(out)?;
                Ok(self.solid.sign(p).into_pyobject(points.py())?.into_any())
            },
            |question, columns| question.sign(&columns, out)
        )
    }

    /// The surface as seen from points: accurate near a face, an estimate far away. Before an edge or a corner that
    /// stands out the distance is that of the nearest face's plane: too small by up to 1 - sin(a/2) of it before an
    /// edge with the angle a of the solid, 29 % at a right angle, more at an acute one; and by more before a corner,
    /// 42 % at that of a box. Inside, beside an edge that goes in, it may be too long, by up to a half between two
    /// balls that overlap.
    ///
    /// Parameters
    /// ----------
    /// points : array of shape (..., 3), m; or x, y, z : arrays that broadcast together, or numbers
    /// out : tuple of three arrays, optional
    ///     For the distance, the normal and the curvature; each may be None.
    /// threads : int, optional
    ///
    /// Returns
    /// -------
    /// `Contact`: ``distance`` of shape (...), m, positive outside, infinite where no surface is found; ``normal`` of
    /// shape (..., 3), the outward unit normal of the nearest face, the mean of two at an edge, zero where there is
    /// none; ``curvature`` of shape (...), the mean curvature, 1/m, positive where the solid is convex. Away from the
    /// face it is that of the surface of equal distance through the point.
    #[pyo3(signature = (points, y=None, z=None, /, *, out=None, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, points, y=None, z=None, /, *, out=None, threads=None)")]
    fn contact<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        y: Option<&Bound<'py, PyAny>>,
        z: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Threads,
    ) -> PyResult<Bound<'py, PyAny>> {
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let py = points.py();
        let (distance, normal, curvature) = ask!(
            self,
            (points, y, z),
            threads,
            |p| {
                no_out(out)?;
                let found = self.solid.contact(p);
                (
                    found.distance.into_pyobject(py)?.into_any(),
                    array(py, found.normal),
                    found.mean_curvature.into_pyobject(py)?.into_any(),
                )
            },
            |question, columns| question.contact(&columns, several(out)?)?
        );
        CLASS.import(py, "rfm._records", "Contact")?.call1((distance, normal, curvature))
    }

    /// The velocity of the surface near points, as `rfm_wall_velocity` in C: zero for a solid at rest. For a solid that
    /// is moved and turned as a whole it is that of the body, for others that of the nearest face along its normal.
    ///
    /// Parameters
    /// ----------
    /// points : array of shape (..., 3), m; or x, y, z : arrays that broadcast together, or numbers
    /// out : array of shape (..., 3), optional
    /// threads : int, optional
    ///
    /// Returns
    /// -------
    /// Array of shape (..., 3), m/s.
    #[pyo3(signature = (points, y=None, z=None, /, *, out=None, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, points, y=None, z=None, /, *, out=None, threads=None)")]
    fn wall_velocity<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        y: Option<&Bound<'py, PyAny>>,
        z: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Threads,
    ) -> PyResult<Bound<'py, PyAny>> {
        ask!(
            self,
            (points, y, z),
            threads,
            |p| {
                no_out(out)?;
                Ok(array(points.py(), self.solid.wall_velocity(p)))
            },
            |question, columns| question.wall_velocity(&columns, out)
        )
    }

    /// Radii of balls around points that are proven not to meet the surface, as ``rfm eval --what clearance``: never
    /// more than the distance, and mostly within 1e-4 of it. It takes a thousand times as long as `contact`.
    ///
    /// Parameters
    /// ----------
    /// points : array of shape (..., 3), m; or x, y, z : arrays that broadcast together, or numbers
    /// out : array of shape (...), optional
    /// threads : int, optional
    ///     If it is not stated, all are used from three points on.
    ///
    /// Returns
    /// -------
    /// Array of shape (...), m, positive inside, too, and always finite: nothing is looked for farther away than
    /// 3.6e75, which is the clearance of a solid without a surface, 3.4e38 in single precision.
    #[pyo3(signature = (points, y=None, z=None, /, *, out=None, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, points, y=None, z=None, /, *, out=None, threads=None)")]
    fn clearance<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        y: Option<&Bound<'py, PyAny>>,
        z: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        threads: Threads,
    ) -> PyResult<Bound<'py, PyAny>> {
        ask!(
            self,
            (points, y, z),
            threads,
            |p| {
                no_out(out)?;
                let py = points.py();
                Ok(py.detach(|| self.solid.distance(p).clearance).into_pyobject(py)?.into_any())
            },
            |question, columns| question.clearance(&columns, out)
        )
    }
}
