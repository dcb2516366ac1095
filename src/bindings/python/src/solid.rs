//! The class `Solid`.

mod questions;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rfm::field::Field;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::solid::Chosen;
use rfm::source::Target;
use rfm::sph::Rebound;
use rfm::{Solid, mesh};
use rfm_columns::{Obstacle, volume};

use crate::collision::collide;
use crate::error::{refused, warn};
use crate::mesh::{Found, PyMesh};
use crate::path::first_entry;
use crate::points::aabb;
use crate::pool::{Threads, run_watched};
use crate::program::PyProgram;
use crate::results::corners;
use crate::show;
use crate::slice::{PySlice, Sliced};
use crate::source::{Asked, text};

/// A compiled obstacle: ω, its gradient, its sign and its surface.
///
/// ω > 0 inside, 0 on the surface, < 0 outside. A solid comes from a program, `program["pawn"]`. It may be used
/// by several threads at a time.
///
/// Points are given as an array of shape (n, 3), or as three arrays x, y, z; any number of dimensions before the
/// 3, any strides and anything that NumPy makes such arrays of will do. Coordinates are in metres. In single
/// precision (``float32``) everything is computed in single precision; all else is computed in ``float64``.
/// Results have the type of the points. Coordinates that are not finite give NaN, never "outside". Arrays with masked
/// elements are refused.
///
/// Results go to new arrays, or to ``out``. Python's lock is released meanwhile, so do not change the arrays from
/// another thread. ``threads`` is the number of threads, at most that of processors; if it is not stated, all are
/// used from 32768 points on. The results do not depend on it.
#[pyclass(frozen, module = "rfm", name = "Solid")]
pub struct PySolid {
    program: Py<PyProgram>,
    solid: Solid,
    /// The stretch of time that it is seen in, s.
    stretch: [f64; 2],
    /// The cheaper program that keeps the tolerance of the file.
    chosen: Option<Chosen>,
    /// The solid for collisions, and the box where the particles are.
    obstacle: Obstacle,
    over: Option<Aabb>,
}

/// Cells along the longest side of a mesh, as of `rfm mesh`.
const DEFAULT_CELLS: usize = 128;

impl PySolid {
    /// A solid of a program during a stretch of time, for particles in a box.
    pub fn new(
        program: &Bound<'_, PyProgram>,
        solid: Solid,
        [from, to]: [f64; 2],
        over: Option<Aabb>,
    ) -> PyResult<Self> {
        let solid = solid.between(from, to);
        let chosen = program.get().chosen(program.py(), &solid)?;
        let obstacle = Obstacle::new(solid.clone(), over);
        Ok(Self { program: program.clone().unbind(), solid, stretch: [from, to], chosen, obstacle, over })
    }

    fn omega_at(&self, p: DVec3) -> f64 {
        self.chosen.as_ref().map_or_else(|| self.solid.omega(p), |chosen| chosen.omega(p))
    }

    pub fn solid(&self) -> &Solid {
        &self.solid
    }

    /// The cheaper program that keeps the tolerance of the file.
    pub fn chosen(&self) -> Option<&Chosen> {
        self.chosen.as_ref()
    }

    /// The box that is drawn.
    fn domain(&self) -> Option<Aabb> {
        Python::attach(|py| self.program.bind(py).get().program.domain(&self.solid))
    }
}

#[pymethods]
impl PySolid {
    /// Name that the file gives the solid.
    #[getter]
    fn name(&self) -> &str {
        self.solid.name()
    }

    /// Program that the solid comes from.
    #[getter]
    fn program(&self, py: Python<'_>) -> Py<PyProgram> {
        self.program.clone_ref(py)
    }

    /// Time that values are for, s.
    #[getter]
    fn time(&self) -> f64 {
        self.stretch[1]
    }

    /// Whether time occurs in the formula.
    #[getter]
    fn moves(&self) -> bool {
        self.solid.moves()
    }

    /// Whether machine code answers, rather than the slower interpreter with the same results.
    #[getter]
    fn is_compiled(&self) -> bool {
        self.solid.is_compiled()
    }

    /// Where straight paths first meet the solid.
    ///
    /// It is proven that nothing before the entry is in the solid, however thin the solid and long the path. For
    /// a solid `between` two times, time passes evenly along the path.
    ///
    /// Parameters
    /// ----------
    /// start, end : arrays of shape (..., 3), m, or tuples of three arrays, that broadcast together
    /// threads : int, optional
    ///
    /// Returns
    /// -------
    /// `Entry`, always in double precision: ``part`` of shape (...), the part of the path before the entry, 0 to 1,
    /// or NaN if there is none; ``point`` of shape (..., 3), m; ``normal`` of shape (..., 3), the outward unit
    /// normal there, the mean of those that meet; ``certain`` of shape (...), False where the path may only graze the
    /// surface within rounding errors, and for ends that are not finite. An entry comes early, never late, by up to
    /// some 1e-8 of the path where the surface is met far from the origin or steeply.
    #[pyo3(signature = (start, end, *, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, start, end, *, threads=None)")]
    fn first_entry<'py>(
        &self,
        start: &Bound<'py, PyAny>,
        end: &Bound<'py, PyAny>,
        threads: Threads,
    ) -> PyResult<Bound<'py, PyAny>> {
        first_entry(&self.solid, start, end, threads)
    }

    /// Puts particles that are inside the solid, or on its surface, back outside, and reflects their velocities
    /// relative to that of the surface. Both arrays are changed in place; particles that stay outside keep their bits.
    /// A particle goes to the nearest place outside if it is not deep in the solid, as after a step. From
    /// deeper it goes where the formula's slope leads if that is within ``reach``, otherwise the shortest way along an
    /// axis, and if there is none, one that is found in all directions: each may be farther than the nearest place.
    ///
    /// Parameters
    /// ----------
    /// positions, velocities : float64 arrays of shape (n, 3), m and m/s; or tuples of three columns
    /// reach : float, m
    ///     The farthest that a particle is moved.
    /// restitution : float
    ///     The part of the normal speed that returns, 0 to 1.
    /// friction : float
    ///     The tangential speed loses at most this times the change of the normal speed.
    /// threads : int, optional
    ///
    /// Returns
    /// -------
    /// `Collisions`: ``hits`` particles have been put back; ``stuck`` are inside without a way out within reach, and
    /// ``undefined`` are not finite, or ω has no value there: these stay as they are.
    #[pyo3(signature = (positions, velocities, *, reach, restitution=0.0, friction=0.0, threads=Threads::Auto))]
    #[pyo3(
        text_signature = "($self, positions, velocities, *, reach, restitution=0.0, friction=0.0, threads=None)"
    )]
    fn collide<'py>(
        &self,
        positions: &Bound<'py, PyAny>,
        velocities: &Bound<'py, PyAny>,
        reach: f64,
        restitution: f64,
        friction: f64,
        threads: Threads,
    ) -> PyResult<Bound<'py, PyAny>> {
        let rebound = Rebound::new(restitution, friction, reach).map_err(PyValueError::new_err)?;
        collide(&self.obstacle, positions, velocities, &rebound, threads)
    }

    /// The smallest known box around the solid: an array of shape (2, 3), m, its lowest and its highest corner.
    ///
    /// None if the solid is empty, and infinite if no box could be proven.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let found = py.detach(|| *self.solid.bounds());
        corners(py, &found)
    }

    /// The least and the greatest value that ω may have in a box, guaranteed.
    ///
    /// Parameters
    /// ----------
    /// box : two corners, or six numbers, m
    ///
    /// Returns
    /// -------
    /// (low, high) : floats; infinite where nothing is known, or where ω may not be a number
    #[pyo3(signature = (r#box, /))]
    #[pyo3(text_signature = "($self, box, /)")]
    fn range(&self, r#box: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
        let range = self.solid.range(&aabb(r#box)?);
        Ok((range.lo, range.hi))
    }

    /// The solid at a time.
    ///
    /// Parameters
    /// ----------
    /// time : float, s
    ///
    /// Returns
    /// -------
    /// Solid; nothing is compiled again. A solid at rest is the same at all times.
    fn at(&self, py: Python<'_>, time: f64) -> PyResult<Self> {
        self.between(py, time, time)
    }

    /// The solid during a stretch of time: values are those at its end, ranges and bounds hold for all of it, and
    /// paths of `first_entry` pass from its beginning to its end.
    ///
    /// Parameters
    /// ----------
    /// start, end : floats, s
    fn between(&self, py: Python<'_>, start: f64, end: f64) -> PyResult<Self> {
        for time in [start, end] {
            if !time.is_finite() {
                return Err(PyValueError::new_err(format!("the time is {time} s, expected a finite number")));
            }
        }
        if start > end {
            let message = format!("the stretch from {start} to {end} s ends before it begins");
            return Err(PyValueError::new_err(message));
        }
        Self::new(self.program.bind(py), self.solid.clone(), [start, end], self.over)
    }

    /// The solid for particles in a box: all answers stay the same, but `collide` with a solid of many parts that has
    /// no bounds, such as a vessel with posts in it, is much faster in the box.
    ///
    /// Parameters
    /// ----------
    /// box : two corners, or six numbers, m
    #[pyo3(signature = (r#box, /), text_signature = "($self, box, /)")]
    fn within(&self, py: Python<'_>, r#box: &Bound<'_, PyAny>) -> PyResult<Self> {
        Self::new(self.program.bind(py), self.solid.clone(), self.stretch, Some(aabb(r#box)?))
    }

    /// The volume, m³, found on meshes with `cells` cells, two thirds and half as many along the longest side. A solid of
    /// which parts are too thin for these is measured along lines that cross it; a warning says if more than a hundredth
    /// of the volume is uncertain. That of a solid made of triangles is theirs.
    ///
    /// Parameters
    /// ----------
    /// cells : int
    /// threads : int, optional
    #[pyo3(signature = (cells=96, *, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, cells=96, *, threads=None)")]
    fn volume(&self, py: Python<'_>, cells: usize, threads: Threads) -> PyResult<f64> {
        let solid = self.solid.clone();
        let found = run_watched(py, threads, move |watch| volume(&solid, cells, watch))?.map_err(refused)?;
        if let Some(doubt) = &found.doubt {
            warn(py, doubt)?;
        }
        Ok(found.volume)
    }

    /// A closed triangle mesh of the surface.
    ///
    /// Parameters
    /// ----------
    /// cells : int, optional
    ///     Cells along the longest side; 128 if neither they nor their size are stated.
    /// cell : float, m, optional
    ///     Size of a cell instead of their number.
    /// method : "dc" or "mc"
    ///     Dual contouring, which puts vertices on edges and corners too, or marching cubes, which are three times
    ///     as fast for as many cells.
    /// box : two corners, m, optional
    ///     What is meshed instead of the solid's bounds; the mesh is closed at its border.
    /// no_slivers : bool
    ///     Contract the shortest edges, so that no triangle is very thin.
    /// threads : int, optional
    #[pyo3(signature = (cells=None, *, cell=None, method="dc", r#box=None, no_slivers=false, threads=Threads::Auto))]
    #[pyo3(
        text_signature = "($self, cells=None, *, cell=None, method='dc', box=None, no_slivers=False, threads=None)"
    )]
    #[allow(clippy::too_many_arguments)] // they have names in Python
    fn mesh(
        slf: &Bound<'_, Self>,
        cells: Option<usize>,
        cell: Option<f64>,
        method: &str,
        r#box: Option<&Bound<'_, PyAny>>,
        no_slivers: bool,
        threads: Threads,
    ) -> PyResult<PyMesh> {
        let resolution = match (cells, cell) {
            (Some(_), Some(_)) => {
                return Err(PyValueError::new_err("both cells and cell are given, expected one of them"));
            }
            (None, Some(cell)) => mesh::Resolution::Spacing(cell),
            (cells, None) => mesh::Resolution::Cells(cells.unwrap_or(DEFAULT_CELLS)),
        };
        let domain = r#box.map(aabb).transpose()?;
        let mesher = crate::mesh::mesher(method)?;
        let solid = slf.get().solid.clone();
        let found = run_watched(slf.py(), threads, move |watch| {
            Found::of(&solid, domain, resolution, mesher, no_slivers, watch)
        })?;
        Ok(found?.of_solid(slf))
    }

    /// ω in a plane.
    ///
    /// Parameters
    /// ----------
    /// x, y, z : float, m
    ///     The plane: one of the three.
    /// samples : int
    ///     Number of samples along the longer side, 2 to 8192.
    /// window : (u0, v0, u1, v1), m, optional
    ///     The part of the plane; u and v are the two other coordinates. If it is not stated, it is that of the
    ///     scene's box, or what lies around the solid.
    /// threads : int, optional
    ///
    /// Returns
    /// -------
    /// `Slice` with the samples, as SVG, and as PNG
    #[pyo3(signature = (*, x=None, y=None, z=None, samples=320, window=None, threads=Threads::Auto))]
    #[pyo3(text_signature = "($self, *, x=None, y=None, z=None, samples=320, window=None, threads=None)")]
    #[allow(clippy::too_many_arguments)] // they have names in Python
    fn slice(
        slf: &Bound<'_, Self>,
        x: Option<f64>,
        y: Option<f64>,
        z: Option<f64>,
        samples: usize,
        window: Option<[f64; 4]>,
        threads: Threads,
    ) -> PyResult<PySlice> {
        let plane = crate::slice::plane([x, y, z])?;
        let this = slf.get();
        let solid = (&this.solid, this.chosen.as_ref());
        let sliced = Sliced::new(slf.py(), solid, plane, samples, window, this.domain(), threads)?;
        Ok(PySlice::new(slf, sliced))
    }

    /// The solid as C, for programs without Python: text of a file with ω and ∇ω at one point and over columns.
    ///
    /// Its first lines say how to compile it so that it gives the bits of `omega`. A solid that moves takes the
    /// time as an argument.
    ///
    /// Parameters
    /// ----------
    /// header : bool
    ///     Whether all functions are `static inline`, for a header, rather than for a file of its own.
    /// sign, distance : bool
    ///     Whether there are functions for the sign and for the distance from the surface.
    /// prefix : str, optional
    ///     What all names begin with: the name of the solid.
    /// open_params : bool
    ///     Whether the params of the file are arguments of the functions instead of constants. A ``UserWarning`` and the
    ///     text name those that decide how the solid is built, and stay constants.
    #[pyo3(signature = (*, header=false, sign=false, distance=false, prefix=None, open_params=false))]
    fn to_c(
        &self,
        py: Python<'_>,
        header: bool,
        sign: bool,
        distance: bool,
        prefix: Option<String>,
        open_params: bool,
    ) -> PyResult<String> {
        let target = if header { Target::Header } else { Target::C };
        text(py, (&self.program, &self.solid), target, Asked { sign, distance, prefix, open_params })
    }

    /// The solid as functions for a WGSL shader, in single precision. Parameters as in `to_c`.
    #[pyo3(signature = (**asked), text_signature = "($self, *, sign=False, distance=False, prefix=None, open_params=False)")]
    fn to_wgsl(&self, py: Python<'_>, asked: Option<&Bound<'_, PyDict>>) -> PyResult<String> {
        text(py, (&self.program, &self.solid), Target::Wgsl, Asked::of(asked)?)
    }

    /// The solid as functions for a GLSL ES 3.0 shader, in single precision. Parameters as in `to_c`.
    #[pyo3(signature = (**asked), text_signature = "($self, *, sign=False, distance=False, prefix=None, open_params=False)")]
    fn to_glsl(&self, py: Python<'_>, asked: Option<&Bound<'_, PyDict>>) -> PyResult<String> {
        text(py, (&self.program, &self.solid), Target::Glsl, Asked::of(asked)?)
    }

    /// A picture for notebooks: the slice across y through the middle of the scene's box or of the bounds.
    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<Option<String>> {
        show::picture(py, (&self.solid, self.chosen.as_ref()), self.domain())
    }

    /// The solid in the viewer's page, to be turned and cut, with the most important facts, for notebooks.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        let picture = self._repr_svg_(py)?;
        show::solid(py, &self.solid, self.time(), self.domain(), picture)
    }

    fn __repr__(&self) -> String {
        let time = if self.solid.moves() { format!(" at t = {} s", self.time()) } else { String::new() };
        format!("<rfm.Solid {}{time}>", self.solid.name())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, this) = (slf.py(), slf.get());
        let rebuild = py.import("rfm._rfm")?.getattr("_solid")?;
        let [from, to] = this.stretch;
        let over = this.over.map(|over| [over.min.to_array(), over.max.to_array()].concat());
        Ok((rebuild, (this.program.clone_ref(py), this.solid.name(), from, to, over).into_pyobject(py)?))
    }
}
