//! The class `Slice`.

use std::path::PathBuf;

use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rfm::Solid;
use rfm::field::Field;
use rfm::geom::Aabb;
use rfm::glam::DVec2;
use rfm::mesh::Watch;
use rfm::slice::{self, Axis, Plane, Samples, SliceError, Window};
use rfm::solid::Chosen;

use crate::error::refused;
use crate::mesh::write_file;
use crate::pool::{Threads, run_watched};

/// The plane that one of three coordinates states.
///
/// # Errors
/// `ValueError` if not exactly one is stated, or if it is not finite.
pub fn plane(coordinates: [Option<f64>; 3]) -> PyResult<Plane> {
    let stated: Vec<(Axis, f64)> = [Axis::X, Axis::Y, Axis::Z]
        .into_iter()
        .zip(coordinates)
        .filter_map(|(axis, value)| Some((axis, value?)))
        .collect();
    match stated[..] {
        [(axis, value)] if value.is_finite() => Ok(Plane::new(axis, value)),
        [(axis, value)] => {
            Err(PyValueError::new_err(format!("{} is {value}, expected a finite number", axis.name())))
        }
        _ => Err(PyValueError::new_err("state one of x, y and z: the plane of the slice")),
    }
}

/// What is sampled.
#[derive(Clone)]
struct Sliced {
    solid: Solid,
    /// The cheaper program that keeps the tolerance of the file.
    chosen: Option<Chosen>,
}

impl Sliced {
    fn field(&self) -> &dyn Field {
        self.chosen.as_ref().map_or(&self.solid, |chosen| chosen)
    }
}

/// ω in a plane: samples, and pictures of them.
#[pyclass(frozen, module = "rfm", name = "Slice")]
pub struct PySlice {
    sliced: Sliced,
    samples: Samples,
    number: usize,
}

impl PySlice {
    /// Samples a solid, by the cheaper program that keeps its tolerance if there is one.
    pub fn new(
        py: Python<'_>,
        (solid, chosen): (&Solid, Option<&Chosen>),
        plane: Plane,
        number: usize,
        window: Option<[f64; 4]>,
        domain: Option<Aabb>,
        threads: Threads,
    ) -> PyResult<Self> {
        let window = match (window, domain) {
            (Some([u0, v0, u1, v1]), _) => Window::new(DVec2::new(u0, v0), DVec2::new(u1, v1)),
            (None, Some(domain)) => plane.window(&domain),
            (None, None) => {
                let name = solid.name();
                return Err(refused(format!(
                    "`{name}` has no bounds and the file no scene: state the window"
                )));
            }
        };
        let sliced = Sliced { solid: solid.clone(), chosen: chosen.cloned() };
        let sampled = sliced.clone();
        let samples = run_watched(py, threads, move |watch| {
            slice::sample_while(sampled.field(), plane, window, number, &|| !watch.is_over())
        })?;
        Ok(Self { sliced, samples: samples.map_err(refused)?, number })
    }

    /// The bytes of a picture, drawn from a field with its name, in a part of a plane with a number of samples.
    fn drawn(
        &self,
        py: Python<'_>,
        draw: impl FnOnce(&dyn Field, &str, Plane, Window, usize, &mut Vec<u8>) -> Result<(), SliceError>
        + Send
        + 'static,
    ) -> PyResult<Vec<u8>> {
        let (sliced, number) = (self.sliced.clone(), self.number);
        let Samples { plane, window, .. } = self.samples;
        run_watched(py, Threads::Auto, move |_| {
            let mut picture = Vec::new();
            draw(sliced.field(), sliced.solid.name(), plane, window, number, &mut picture).map(|()| picture)
        })?
        .map_err(refused)
    }

    /// The drawing as SVG.
    pub fn svg(&self, py: Python<'_>) -> PyResult<String> {
        String::from_utf8(self.drawn(py, |field, name, plane, window, number, svg| {
            slice::write_svg(field, name, plane, window, number, svg)
        })?)
        .map_err(refused)
    }

    /// The coordinates of columns or of rows, m.
    fn along<'py>(
        &self,
        py: Python<'py>,
        count: usize,
        at: impl Fn(usize) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, (0..count).map(at))
    }
}

#[pymethods]
impl PySlice {
    /// ω: array of shape (rows, columns), ``float64``. Row 0 has the smallest v, so plot it with
    /// ``origin="lower"``.
    #[getter]
    fn omega<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let Samples { rows, columns, omega, .. } = &self.samples;
        Ok(PyArray1::from_slice(py, omega).reshape([*rows, *columns])?.into_any())
    }

    /// Coordinates of the columns, m: array of shape (columns,).
    #[getter]
    fn u<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.along(py, self.samples.columns, |column| self.samples.position(column, 0).x)
    }

    /// Coordinates of the rows, m: array of shape (rows,).
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.along(py, self.samples.rows, |row| self.samples.position(0, row).y)
    }

    /// Names of the coordinates u and v, such as ("x", "z").
    #[getter]
    fn axes(&self) -> (&'static str, &'static str) {
        let (right, up) = self.samples.plane.axis.right_and_up();
        (right.name(), up.name())
    }

    /// Corners of the window as matplotlib's ``extent``: (u0, u1, v0, v1), m.
    #[getter]
    fn extent(&self) -> (f64, f64, f64, f64) {
        let Window { min, max } = self.samples.window;
        (min.x, max.x, min.y, max.y)
    }

    /// The drawing as an SVG document: bands of ω, the outline, axes and a bar of colours.
    #[pyo3(name = "svg")]
    fn svg_document(&self, py: Python<'_>) -> PyResult<String> {
        self.svg(py)
    }

    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<String> {
        self.svg(py)
    }

    /// Writes the drawing to a file, .svg or .png.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let ending =
            path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let picture = match &*ending {
            "svg" => self.svg(py)?.into_bytes(),
            "png" => self.drawn(py, |field, name, plane, window, number, png| {
                slice::write_png(field, name, plane, window, number, 2.0, png)
            })?,
            _ => {
                let path = path.display();
                return Err(PyValueError::new_err(format!(
                    "cannot tell the format of `{path}`: the ending must be .svg or .png"
                )));
            }
        };
        py.detach(|| write_file(&path, |out| out.write_all(&picture)))
    }

    fn __repr__(&self) -> String {
        let Samples { plane, rows, columns, .. } = &self.samples;
        format!("<rfm.Slice of {} in {plane}, {rows} × {columns} samples>", self.sliced.solid.name())
    }
}
