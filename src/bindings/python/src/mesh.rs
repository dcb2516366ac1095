//! The class `Mesh`.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyTuple;
use rfm::Solid;
use rfm::field::Field;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::mesh::{
    self, FORMATS, Grid, LengthUnit, Mesh, MeshError, Report, Resolution, dual_contouring, marching_cubes,
};
use rfm::solid::Bounds;
use rfm::view;
use rfm_columns::NoVolume;

use crate::error::{not_read, refused};
use crate::memory::rows_of;
use crate::points::aabb;
use crate::pool::{Threads, Watch, run_watched};
use crate::solid::PySolid;

/// A way to make a mesh, ended by Ctrl-C.
pub type Mesher = fn(&dyn Field, &Grid, &Watch) -> Result<Mesh, MeshError>;

/// The method of a name.
pub fn mesher(method: &str) -> PyResult<Mesher> {
    match method {
        "mc" => Ok(|field, grid, watch| marching_cubes(field, grid, watch)),
        "dc" => Ok(|field, grid, watch| dual_contouring(field, grid, watch)),
        _ => Err(PyValueError::new_err(format!("method is {method:?}, expected 'mc' or 'dc'"))),
    }
}

/// A closed triangle mesh of a solid's surface, or of a fluid's. Its arrays are read-only; copy them to change them.
///
/// A pickle holds the arrays and what was found about them; nothing is meshed again. As long as ``thin_cells`` was not
/// asked for, it holds the solid, too.
#[pyclass(frozen, module = "rfm", name = "Mesh")]
pub struct PyMesh {
    mesh: Mesh,
    findings: Findings,
    /// What it was made of, and in which cells; `None` for an empty solid, a fluid, and for a mesh from a pickle whose thin
    /// cells are counted.
    made_of: Option<(Py<PySolid>, Grid)>,
    thin_cells: OnceLock<usize>,
    vertices: PyOnceLock<Py<PyAny>>,
    normals: PyOnceLock<Py<PyAny>>,
    triangles: PyOnceLock<Py<PyAny>>,
}

/// What was found about a mesh when it was made.
#[derive(Clone, Copy)]
struct Findings {
    /// m³
    volume: f64,
    /// m²
    area: f64,
    /// Whether every edge lies in exactly two triangles, also if there is none.
    closed: bool,
    /// m
    max_distance: f64,
}

/// A mesh before it is one of Python's: with the cells in which it was made, if there were any.
pub struct Found {
    mesh: Mesh,
    findings: Findings,
    grid: Option<Grid>,
}

impl Found {
    /// The mesh of a solid in a box, or in its own bounds.
    ///
    /// # Errors
    /// `RfmError` if no box around the solid is known, or if it cannot be meshed.
    pub fn of(
        solid: &Solid,
        domain: Option<Aabb>,
        resolution: Resolution,
        mesher: Mesher,
        no_slivers: bool,
        watch: &Watch,
    ) -> PyResult<Self> {
        let grid = match (domain, solid.bounds()) {
            (Some(domain), _) => Grid::filling(&domain, resolution),
            (None, Bounds::Within(bounds)) => Grid::around(bounds, resolution),
            (None, Bounds::Empty) => return Ok(Self::empty()),
            (None, Bounds::Unbounded) => return Err(refused(NoVolume::asking_for_a_box(solid.name()))),
        };
        let grid = grid.map_err(refused)?;
        let field = solid.surface(*grid.bounds());
        let mut found = mesher(&*field, &grid, watch).map_err(refused)?;
        if no_slivers {
            mesh::remove_slivers(&mut found);
        }
        Ok(Self::checked(found, &*field, Some(grid)))
    }

    /// The mesh of an empty solid.
    fn empty() -> Self {
        let nowhere = rfm::field::Closures { omega: |_| -1.0, gradient: |_| DVec3::ZERO };
        Self::checked(Mesh::default(), &nowhere, None)
    }

    /// The surface of a fluid. No formula says how far its vertices are from where they ought to be.
    pub fn of_fluid(mesh: Mesh) -> PyMesh {
        let shells = mesh::shells(&mesh);
        let findings = Findings {
            volume: shells.iter().map(|shell| shell.volume).sum(),
            area: shells.iter().map(|shell| shell.area).sum(),
            closed: mesh::is_closed_manifold(&mesh),
            max_distance: f64::NAN,
        };
        PyMesh::new(mesh, findings, None, Some(0))
    }

    fn checked(mesh: Mesh, field: &dyn Field, grid: Option<Grid>) -> Self {
        let Report { volume, area, closed, max_distance, .. } = mesh::check(&mesh, field);
        Self { mesh, findings: Findings { volume, area, closed, max_distance }, grid }
    }

    /// The mesh as one of Python's, with the solid that it was made of.
    pub fn of_solid(self, solid: &Bound<'_, PySolid>) -> PyMesh {
        let made_of = self.grid.map(|grid| (solid.clone().unbind(), grid));
        PyMesh::new(self.mesh, self.findings, made_of, None)
    }
}

impl PyMesh {
    /// The number of cells in which parts of the solid hide, found when it is first asked for.
    ///
    /// # Errors
    /// `RfmError` if there are too many cells.
    fn count_thin_cells(&self, py: Python<'_>) -> PyResult<usize> {
        if let Some(count) = self.thin_cells.get() {
            return Ok(*count);
        }
        let Some((solid, grid)) = &self.made_of else { return Ok(0) };
        let (solid, grid) = (solid.get().solid().clone(), grid.clone());
        let found = run_watched(py, Threads::Auto, move |watch| {
            mesh::thin_cells(&*solid.surface(*grid.bounds()), &grid, watch)
        })?
        .map_err(refused)?;
        Ok(*self.thin_cells.get_or_init(|| found.count))
    }

    fn new(
        mesh: Mesh,
        findings: Findings,
        made_of: Option<(Py<PySolid>, Grid)>,
        thin_cells: Option<usize>,
    ) -> Self {
        let [vertices, normals, triangles] = [PyOnceLock::new(), PyOnceLock::new(), PyOnceLock::new()];
        let thin_cells = thin_cells.map_or_else(OnceLock::new, OnceLock::from);
        Self { mesh, findings, made_of, thin_cells, vertices, normals, triangles }
    }
}

/// Vectors as a read-only array of shape (n, 3).
fn rows(py: Python<'_>, vectors: &[DVec3]) -> PyResult<Py<PyAny>> {
    let flat = PyArray1::from_iter(py, vectors.iter().flat_map(|vector| vector.to_array()));
    read_only(flat.reshape([vectors.len(), 3])?.into_any())
}

fn read_only(array: Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
    array.call_method1("setflags", (false,))?;
    Ok(array.unbind())
}

/// Links that lead to one another.
const MOST_LINKS: usize = 40;

/// Writes a file under another name first, so that it is whole or not there.
///
/// # Errors
/// `OSError`.
pub fn write_file(
    path: &Path,
    fill: impl FnOnce(&mut dyn std::io::Write) -> std::io::Result<()>,
) -> PyResult<()> {
    let failed = |error| not_read(&path.display().to_string(), error);
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // a folder that does not exist is better found here than behind the name of a temporary file
    std::fs::metadata(folder).map_err(failed)?;
    // a device or a pipe (/dev/null) is written as it stands: a file must not take its place
    let is_stream = path.starts_with("/dev")
        || std::fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir());
    if is_stream {
        let mut out = BufWriter::new(std::fs::File::options().write(true).open(path).map_err(failed)?);
        return fill(&mut out).and_then(|()| out.flush()).map_err(failed);
    }
    // a link stays a link, also one to a file that is not there yet
    let mut linked = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(next) = std::fs::read_link(&linked) else { break };
        linked = linked.parent().unwrap_or(Path::new("")).join(next);
    }
    let path = linked.as_path();
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut temporary = tempfile::Builder::new();
    temporary.prefix(".rfm-");
    #[cfg(unix)]
    temporary.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o644));
    let mut out = BufWriter::new(temporary.tempfile_in(folder).map_err(failed)?);
    fill(&mut out).map_err(failed)?;
    let temporary = out.into_inner().map_err(|error| failed(error.into_error()))?;
    temporary.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}

impl PyMesh {
    /// Refuses to write a mesh without triangles.
    fn holds_something(&self, py: Python<'_>) -> PyResult<()> {
        if self.mesh.triangles.is_empty() {
            let hidden = match self.count_thin_cells(py) {
                // what is no refusal of the mesher comes from a signal
                Err(error) if !error.is_instance_of::<PyValueError>(py) => return Err(error),
                counted => counted.unwrap_or(0),
            };
            let reason = match hidden {
                0 => "the solid is empty, or smaller than a cell".to_owned(),
                n => format!("parts of the solid hide in {n} cells; mesh it with more"),
            };
            return Err(refused(format!("the mesh is empty: {reason}")));
        }
        Ok(())
    }
}

#[pymethods]
impl PyMesh {
    /// Places of the vertices: array of shape (n, 3), ``float64``, m.
    #[getter]
    fn vertices(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(self.vertices.get_or_try_init(py, || rows(py, &self.mesh.positions))?.clone_ref(py))
    }

    /// Outward unit normals of the vertices: array of shape (n, 3), ``float64``.
    #[getter]
    fn normals(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(self.normals.get_or_try_init(py, || rows(py, &self.mesh.normals))?.clone_ref(py))
    }

    /// Vertices of the triangles: array of shape (m, 3), ``uint32``, counter-clockwise as seen from outside.
    #[getter]
    fn triangles(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let made = || {
            let corners: Vec<Vec<u32>> = self.mesh.triangles.iter().map(|corners| corners.to_vec()).collect();
            let array = match corners.is_empty() {
                true => PyArray2::zeros(py, [0, 3], false),
                false => PyArray2::from_vec2(py, &corners).map_err(refused)?,
            };
            read_only(array.into_any())
        };
        Ok(self.triangles.get_or_try_init(py, made)?.clone_ref(py))
    }

    /// Volume that the mesh encloses, m³.
    #[getter]
    fn volume(&self) -> f64 {
        self.findings.volume
    }

    /// Area of the surface, m².
    #[getter]
    fn area(&self) -> f64 {
        self.findings.area
    }

    /// Whether every edge lies in exactly two triangles. An empty mesh is not closed.
    #[getter]
    fn closed(&self) -> bool {
        self.findings.closed && !self.mesh.triangles.is_empty()
    }

    /// Number of cells in which parts of the solid hide that are too thin for the mesh.
    #[getter]
    fn thin_cells(&self, py: Python<'_>) -> PyResult<usize> {
        self.count_thin_cells(py)
    }

    /// Largest distance of the mesh's vertices from the surface, m. Between them triangles leave a curved surface by up
    /// to an eighth of the squared cell times its curvature. NaN for the surface of a fluid, which no formula has.
    #[getter]
    fn max_distance(&self) -> f64 {
        self.findings.max_distance
    }

    /// Writes the mesh to a file; the ending chooses the format: .stl .ply .obj .vtp .glb .3mf,
    /// or .html for a page that shows the mesh in a browser.
    ///
    /// Parameters
    /// ----------
    /// path : str or path
    /// ascii : bool
    ///     Write .stl as text.
    /// unit : str
    ///     Unit of the numbers in the file: m, cm, mm, um, in or ft. Files .vtp, .glb and .html are in metres.
    #[pyo3(signature = (path, *, ascii=false, unit="m"))]
    fn save(&self, py: Python<'_>, path: PathBuf, ascii: bool, unit: &str) -> PyResult<()> {
        let Some(unit) = LengthUnit::named(unit) else {
            let known = LengthUnit::ALL.map(|unit| unit.name).join(" ");
            return Err(PyValueError::new_err(format!("unknown unit `{unit}`: it must be one of {known}")));
        };
        let ending =
            path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        if ending == "html" {
            if ascii || unit != LengthUnit::METRE {
                return Err(PyValueError::new_err(".html files are pages, and always in metres"));
            }
            self.holds_something(py)?;
            let title = path.file_stem().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            return py.detach(|| write_file(&path, |out| view::solid(&title, &self.mesh, out)));
        }
        let Some(format) = FORMATS.iter().find(|format| format.ending == ending) else {
            let formats = FORMATS.iter().map(|format| format.ending);
            let known: Vec<String> = formats.chain(["html"]).map(|ending| format!(".{ending}")).collect();
            return Err(PyValueError::new_err(format!(
                "cannot tell the format of `{}`: the ending must be one of {}",
                path.display(),
                known.join(" ")
            )));
        };
        let write = match (ascii, format.write_text) {
            (false, _) => format.write,
            (true, Some(write)) => write,
            (true, None) => return Err(PyValueError::new_err(format!(".{ending} files have no text form"))),
        };
        if format.only_metres && unit != LengthUnit::METRE {
            return Err(PyValueError::new_err(format!(".{ending} files are always in metres")));
        }
        self.holds_something(py)?;
        py.detach(|| write_file(&path, |out| write(&self.mesh, unit, out)))
    }

    /// The mesh as a ``trimesh.Trimesh``. The package ``trimesh`` must be installed.
    fn to_trimesh<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("rfm._convert")?.call_method1("to_trimesh", (slf,))
    }

    /// The mesh as a ``pyvista.PolyData`` with the point data ``Normals``. The package ``pyvista`` must be
    /// installed.
    fn to_pyvista<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("rfm._convert")?.call_method1("to_pyvista", (slf,))
    }

    /// The mesh as a ``meshio.Mesh`` with the point data ``normals``. The package ``meshio`` must be installed.
    fn to_meshio<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("rfm._convert")?.call_method1("to_meshio", (slf,))
    }

    fn __repr__(&self) -> String {
        let (vertices, triangles) = (self.mesh.positions.len(), self.mesh.triangles.len());
        let closed = match (triangles, self.closed()) {
            (0, _) => "empty",
            (_, true) => "closed",
            (_, false) => "open",
        };
        format!("<rfm.Mesh {vertices} vertices, {triangles} triangles, {closed}>")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let rebuild = py.import("rfm._rfm")?.getattr("_mesh")?;
        let arrays = (self.vertices(py)?, self.normals(py)?, self.triangles(py)?);
        let Findings { volume, area, closed, max_distance } = self.findings;
        let thin_cells = self.thin_cells.get().copied();
        // only the thin cells are still asked of the solid, and once they are counted it need not come along
        let made_of = self.made_of.as_ref().filter(|_| thin_cells.is_none()).map(|(solid, grid)| {
            let Aabb { min, max } = grid.bounds();
            (solid.clone_ref(py), (min.to_array(), max.to_array()), grid.cells())
        });
        let findings = (volume, area, closed, max_distance);
        Ok((rebuild, (arrays, findings, thin_cells, made_of).into_pyobject(py)?))
    }
}

/// A mesh from its arrays, what was found about it, and what it was made of; for pickles.
///
/// # Errors
/// `ValueError` or `TypeError` if these are not what a mesh has.
#[pyfunction(name = "_mesh")]
pub fn mesh_from_pickle(
    arrays: [Bound<'_, PyAny>; 3],
    findings: (f64, f64, bool, f64),
    thin_cells: Option<usize>,
    made_of: Option<(Py<PySolid>, Bound<'_, PyAny>, [usize; 3])>,
) -> PyResult<PyMesh> {
    let [vertices, normals, triangles] = arrays;
    let (volume, area, closed, max_distance) = findings;
    let vectors = |given| -> PyResult<Vec<DVec3>> {
        Ok(rows_of::<f64, 3>(given, "f8")?.into_iter().map(DVec3::from_array).collect())
    };
    let (positions, normals) = (vectors(&vertices)?, vectors(&normals)?);
    let triangles = rows_of::<u32, 3>(&triangles, "u4")?;
    let count = positions.len();
    if count > Mesh::MAX_VERTICES || normals.len() != count {
        let normals = normals.len();
        return Err(PyValueError::new_err(format!("the mesh has {count} vertices and {normals} normals")));
    }
    if !positions.iter().chain(&normals).all(|vector| vector.is_finite()) {
        return Err(PyValueError::new_err("a vertex or a normal of the mesh is not finite"));
    }
    if let Some(corner) = triangles.iter().flatten().find(|&&corner| corner as usize >= count) {
        return Err(PyValueError::new_err(format!(
            "a triangle has the vertex {corner}, and there are {count}"
        )));
    }
    let made_of = match made_of {
        Some((solid, bounds, cells)) => {
            Some((solid, Grid::of_cells(&aabb(&bounds)?, cells).map_err(refused)?))
        }
        None => None,
    };
    let mesh = Mesh { positions, normals, triangles, ..Mesh::default() };
    Ok(PyMesh::new(mesh, Findings { volume, area, closed, max_distance }, made_of, thin_cells))
}
