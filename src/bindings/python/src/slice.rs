//! The class `Slice`.

use std::path::PathBuf;

use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rfm::Solid;
use rfm::field::Field;
use rfm::geom::Aabb;
use rfm::glam::DVec2;
use rfm::mesh::Watch;
use rfm::slice::{self, Axis, Plane, Samples, SliceError, Window};
use rfm::solid::Chosen;

use crate::error::refused;
use crate::memory::{contiguous, wrong_shape};
use crate::mesh::write_file;
use crate::pool::{Threads, run_watched};
use crate::solid::PySolid;

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
struct Shape {
    solid: Solid,
    /// The cheaper program that keeps the tolerance of the file.
    chosen: Option<Chosen>,
}

impl Shape {
    fn of(solid: &PySolid) -> Self {
        Self { solid: solid.solid().clone(), chosen: solid.chosen().cloned() }
    }

    fn field(&self) -> &dyn Field {
        self.chosen.as_ref().map_or(&self.solid, |chosen| chosen)
    }
}

/// A shape with its samples in a plane.
pub struct Sliced {
    shape: Shape,
    samples: Samples,
    /// Samples along the longer side.
    number: usize,
}

impl Sliced {
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
        let shape = Shape { solid: solid.clone(), chosen: chosen.cloned() };
        let sampled = shape.clone();
        let samples = run_watched(py, threads, move |watch| {
            slice::sample_while(sampled.field(), plane, window, number, &|| !watch.is_over())
        })?;
        Ok(Self { shape, samples: samples.map_err(refused)?, number })
    }

    /// The bytes of a picture, drawn from a field with its name, in a part of a plane with a number of samples.
    fn drawn(
        &self,
        py: Python<'_>,
        draw: impl FnOnce(&dyn Field, &str, Plane, Window, usize, &mut Vec<u8>) -> Result<(), SliceError>
        + Send
        + 'static,
    ) -> PyResult<Vec<u8>> {
        let (shape, number) = (self.shape.clone(), self.number);
        let Samples { plane, window, .. } = self.samples;
        run_watched(py, Threads::Auto, move |_| {
            let mut picture = Vec::new();
            draw(shape.field(), shape.solid.name(), plane, window, number, &mut picture).map(|()| picture)
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

    /// The bytes of an image, at the resolution of screens that are sharp.
    fn png(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        self.drawn(py, |field, name, plane, window, number, png| {
            slice::write_png(field, name, plane, window, number, 2.0, png)
        })
    }
}

/// ω in a plane: samples, and pictures of them. A pickle holds the samples and the solid, of which pictures are drawn.
#[pyclass(frozen, module = "rfm", name = "Slice")]
pub struct PySlice {
    /// The solid that is drawn.
    solid: Py<PySolid>,
    sliced: Sliced,
}

impl PySlice {
    pub fn new(solid: &Bound<'_, PySolid>, sliced: Sliced) -> Self {
        Self { solid: solid.clone().unbind(), sliced }
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
        let Samples { rows, columns, omega, .. } = &self.sliced.samples;
        Ok(PyArray1::from_slice(py, omega).reshape([*rows, *columns])?.into_any())
    }

    /// Coordinates of the columns, m: array of shape (columns,).
    #[getter]
    fn u<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.along(py, self.sliced.samples.columns, |column| self.sliced.samples.position(column, 0).x)
    }

    /// Coordinates of the rows, m: array of shape (rows,).
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.along(py, self.sliced.samples.rows, |row| self.sliced.samples.position(0, row).y)
    }

    /// Names of the coordinates u and v, such as ("x", "z").
    #[getter]
    fn axes(&self) -> (&'static str, &'static str) {
        let (right, up) = self.sliced.samples.plane.axis.right_and_up();
        (right.name(), up.name())
    }

    /// Corners of the window as matplotlib's ``extent``: (u0, u1, v0, v1), m.
    #[getter]
    fn extent(&self) -> (f64, f64, f64, f64) {
        let Window { min, max } = self.sliced.samples.window;
        (min.x, max.x, min.y, max.y)
    }

    /// The drawing as an SVG document: bands of ω, the outline, axes and a bar of colours.
    #[pyo3(name = "svg")]
    fn svg_document(&self, py: Python<'_>) -> PyResult<String> {
        self.sliced.svg(py)
    }

    fn _repr_svg_(&self, py: Python<'_>) -> PyResult<String> {
        self.sliced.svg(py)
    }

    /// Writes the drawing to a file, .svg or .png.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let ending =
            path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let picture = match &*ending {
            "svg" => self.sliced.svg(py)?.into_bytes(),
            "png" => self.sliced.png(py)?,
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
        let Samples { plane, rows, columns, .. } = &self.sliced.samples;
        let name = self.sliced.shape.solid.name();
        format!("<rfm.Slice of {name} in {plane}, {rows} × {columns} samples>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let rebuild = py.import("rfm._rfm")?.getattr("_slice")?;
        let Samples { plane, window: Window { min, max }, .. } = &self.sliced.samples;
        let (axis, window) = (plane.axis.name(), [min.x, min.y, max.x, max.y]);
        let solid = self.solid.clone_ref(py);
        let (number, omega) = (self.sliced.number, self.omega(py)?);
        Ok((rebuild, (solid, axis, plane.value, window, number, omega).into_pyobject(py)?))
    }
}

/// A slice from its solid, its plane and its samples; for pickles.
///
/// # Errors
/// `ValueError`, `TypeError` or `RfmError` if these are not what a slice has.
#[pyfunction(name = "_slice")]
pub fn slice_from_pickle(
    solid: &Bound<'_, PySolid>,
    axis: &str,
    value: f64,
    window: [f64; 4],
    number: usize,
    omega: &Bound<'_, PyAny>,
) -> PyResult<PySlice> {
    let plane = plane(["x", "y", "z"].map(|name| (name == axis).then_some(value)))?;
    let [u0, v0, u1, v1] = window;
    let window = Window::new(DVec2::new(u0, v0), DVec2::new(u1, v1));
    let (columns, rows) = window.grid(number).map_err(refused)?;
    let omega = contiguous::<f64>(omega, "f8")?;
    if omega.shape() != [rows, columns] {
        return Err(wrong_shape(&omega));
    }
    let omega = omega.try_readonly()?.as_slice()?.to_vec();
    let samples = Samples { plane, window, columns, rows, omega };
    Ok(PySlice::new(solid, Sliced { shape: Shape::of(solid.get()), samples, number }))
}
