//! What notebooks show: facts, a picture, and the viewer's page in a frame of its own.

use pyo3::prelude::*;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::mesh::{Grid, Mesh, MeshError, Resolution, Unwatched, dual_contouring, split_creases};
use rfm::solid::{Bounds, Chosen};
use rfm::sph::Simulation;
use rfm::view::{
    Array, Corners, Frame, FrameHead, Lattice, Levels, Page, Setting, VELOCITY, pack_frame, pack_mesh,
};
use rfm::{Experiment, Solid, slice};

use crate::pool::{Threads, run};
use crate::slice::Sliced;

/// Mesh cells along the longest side of a solid that is shown: a page should be small.
const CELLS: usize = 64;

/// A solid: its name, its bounds, the page if it has a mesh, and the picture.
pub fn solid(
    py: Python<'_>,
    solid: &Solid,
    time: f64,
    domain: Option<Aabb>,
    picture: Option<String>,
) -> PyResult<String> {
    let bounds = match solid.bounds() {
        Bounds::Within(found) => format!("{:.4} … {:.4} m", found.min, found.max),
        Bounds::Unbounded => "none found".into(),
        Bounds::Empty => "the solid is empty".into(),
    };
    let motion = if solid.moves() { format!(", at t = {time} s") } else { String::new() };
    let name = slice::escaped(solid.name());
    let page = run(py, Threads::Auto, || page_of_solid(solid, domain))?;
    let page = page.map_or_else(String::new, |page| framed(&page));
    let picture = picture.unwrap_or_default();
    Ok(format!("<div><p><b>solid {name}</b>{motion}; bounds {bounds}</p>{page}{picture}</div>"))
}

/// The slice across y through the middle of a solid's bounds or of its domain, as SVG; `None` without a domain.
pub fn picture(
    py: Python<'_>,
    (solid, chosen): (&Solid, Option<&Chosen>),
    domain: Option<Aabb>,
) -> PyResult<Option<String>> {
    let Some(domain) = domain else { return Ok(None) };
    let middle = solid.bounds().aabb().unwrap_or(domain).centre().y;
    let plane = slice::Plane::new(slice::Axis::Y, middle);
    Sliced::new(py, (solid, chosen), plane, 200, None, Some(domain), Threads::Auto)?.svg(py).map(Some)
}

/// A simulation: its particles and obstacles as they are now.
pub fn simulation(
    py: Python<'_>,
    experiment: &Experiment,
    simulation: &Simulation,
    threads: Threads,
) -> PyResult<String> {
    let facts = facts(experiment, simulation);
    let page = run(py, threads, || page_of_simulation(experiment, simulation, &facts))?;
    let page = page.map_or_else(String::new, |page| framed(&page));
    Ok(format!("<div><p><b>{}</b></p>{page}</div>", slice::escaped(&facts)))
}

fn facts(experiment: &Experiment, simulation: &Simulation) -> String {
    let (scene, particles) = (experiment.scene(), simulation.particles().len());
    format!(
        "scene {} · {} · {particles} particles · t = {:.4} s",
        scene.name,
        scene.method.name(),
        simulation.time()
    )
}

/// A document inside another one. Its scripts run and may save pictures, and reach nothing of the document around it.
fn framed(page: &str) -> String {
    let page = page.replace('&', "&amp;").replace('"', "&quot;");
    let style = "width: 100%; height: 26em; border: 1px solid #8884";
    format!("<iframe sandbox=\"allow-scripts allow-downloads\" style=\"{style}\" srcdoc=\"{page}\"></iframe>")
}

/// The viewer's page of a solid; `None` if it has no mesh.
fn page_of_solid(solid: &Solid, domain: Option<Aabb>) -> Option<String> {
    let grid = match (solid.bounds().aabb(), domain) {
        (Some(bounds), _) => Grid::around(&bounds, Resolution::Cells(CELLS)),
        (None, Some(domain)) => Grid::filling(&domain, Resolution::Cells(CELLS)),
        (None, None) => return None,
    };
    let mesh = mesh(solid, &grid.ok()?).ok().filter(|mesh| !mesh.triangles.is_empty())?;
    let mut page = Vec::new();
    rfm::view::solid(solid.name(), &mesh, &mut page).ok()?;
    String::from_utf8(page).ok()
}

/// The viewer's page of an instant. Obstacles that have no mesh are not drawn.
fn page_of_simulation(experiment: &Experiment, simulation: &Simulation, facts: &str) -> Option<String> {
    let domain = experiment.domain();
    let bodies = experiment.bodies().iter().filter_map(|body| {
        let solid = body.solid.at(simulation.time());
        let bounds = solid.bounds().aabb().unwrap_or(domain);
        let grid = Grid::within(&bounds, &domain, Resolution::Cells(CELLS)).ok()?;
        mesh(&solid, &grid).ok()
    });
    let obstacles = Mesh::joined(&bodies.collect::<Vec<_>>());
    let particles = simulation.particles();
    let speeds: Vec<f64> = particles.velocity.iter().map(DVec3::length).collect();
    let lattice = Lattice::new(&domain);
    let velocity = &particles.velocity;
    let arrays: [&[f64]; 6] =
        [&speeds, &particles.density, &particles.pressure, &velocity.x, &velocity.y, &velocity.z];
    let (frame, ranges) = Frame::of(&lattice, particles.position.iter(), &arrays);
    let fastest = Levels { low: 0.0, high: ranges[0].high };
    let array = |name| Array::named(name, (name == "speed").then_some(fastest));
    let setting = Setting {
        title: experiment.scene().name.clone(),
        facts: facts.to_string(),
        live: false,
        moves: false,
        has_surface: false,
        domain: Corners::from(&domain),
        lattice: Some(Corners::from(lattice.bounds())),
        radius: 0.5 * experiment.parameters().spacing(),
        arrays: ["speed", "density", "pressure"].into_iter().chain(VELOCITY).map(array).collect(),
        solids: Vec::new(),
        bodies: Vec::new(),
        gravity: None,
        params: Vec::new(),
        plots: None,
        picture: None,
    };
    let mut out = Vec::new();
    let mut page = Page::begin(&mut out, &setting).ok()?;
    let has_mesh = !obstacles.triangles.is_empty();
    if has_mesh {
        page.mesh(&pack_mesh(&split_creases(&obstacles), simulation.time(), 0)).ok()?;
    }
    let (time, step) = (simulation.time(), Some(simulation.steps()));
    let head = FrameHead { time, step, ranges, mesh: has_mesh.then_some(0), ..FrameHead::at(time) };
    page.frame(&pack_frame(&head, &frame, None)).ok()?;
    page.end().ok()?;
    String::from_utf8(out).ok()
}

fn mesh(solid: &Solid, grid: &Grid) -> Result<Mesh, MeshError> {
    dual_contouring(&*solid.surface(*grid.bounds()), grid, &Unwatched)
}
