//! The error and the time of both meshing methods against the number of cells.

use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use anstream::println;
use serde::ser::Error as _;
use serde::{Serialize, Serializer};

use super::super::args::MeshMethod;
use super::super::failure::{Failure, note};
use super::super::mesh::no_grid;
use super::super::plot::{self, Axis, Labels, Legend, LogAxis};
use super::super::progress;
use super::table::{self, Column};
use rfm::Solid;
use rfm::mesh::{self, Grid, Quality, Resolution, Unwatched};

/// Resolutions for each method. Each is twice as fine as the one before.
const RESOLUTIONS: u32 = 4;

/// How many times as long a mesh with twice the number of cells may take: it has four times as many
/// triangles, and where contacts must be searched for, each of them takes longer.
const FINER: u32 = 8;

/// No mesh is begun that is likely to take longer than this, measured with its error.
const LONG: Duration = Duration::from_secs(40);

/// Timed repetitions, of which the fastest counts.
const REPETITIONS: usize = 3;

/// The error and the time of one mesh, a row of the report.
#[derive(Debug, Clone, Serialize)]
pub(super) struct MeshFigures {
    method: &'static str,
    cells: usize,
    /// The side of a cell in metres.
    spacing: f64,
    triangles: usize,
    closed: bool,
    manifold: bool,
    #[serde(flatten)]
    quality: Measured,
    evaluations: u64,
    gradients: u64,
    milliseconds: f64,
    /// log₂ of the Hausdorff distance with half the cells over the one with these.
    order: Option<f64>,
    /// The order of the root mean square from the mesh to the surface.
    order_rms: Option<f64>,
}

/// The quality of a mesh. One without triangles has none, and its figures are null.
#[derive(Debug, Clone, Copy)]
struct Measured(Option<Quality>);

impl Serialize for Measured {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Some(quality) = &self.0 else {
            let names = serde_json::to_value(Quality::default()).map_err(S::Error::custom)?;
            let names = names.as_object().into_iter().flat_map(serde_json::Map::keys);
            return serializer.collect_map(names.map(|name| (name, None::<f64>)));
        };
        quality.serialize(serializer)
    }
}

/// Meshes a solid by each method with up to `finest` cells. Empty for a solid without bounds.
pub(super) fn measure(solid: &Solid, finest: usize) -> Result<Vec<MeshFigures>, Failure> {
    let Some(bounds) = solid.bounds().aabb() else { return Ok(Vec::new()) };
    let bar = progress::bar(u64::from(2 * RESOLUTIONS), "meshing");
    let mut rows: Vec<MeshFigures> = Vec::new();
    for method in [MeshMethod::Mc, MeshMethod::Dc] {
        for halvings in (0..RESOLUTIONS).rev() {
            let cells = (finest >> halvings).max(Grid::MIN_CELLS);
            let grid = Grid::around(&bounds, Resolution::Cells(cells))
                .map_err(|error| no_grid(&error, "--mesh-cells", finest))?;
            let started = Instant::now();
            bar.set_message(format!("{}, {cells} cells", method.name()));
            let mut row = row(solid, method, cells, &grid)?;
            let coarser = rows.last().filter(|r| r.method == row.method && 2 * r.cells == cells);
            if let (Some(coarse), Some(fine)) = (coarser.and_then(|row| row.quality.0), row.quality.0) {
                row.order = order(coarse.hausdorff(), fine.hausdorff());
                row.order_rms = order(coarse.to_surface.rms, fine.to_surface.rms);
            }
            rows.push(row);
            bar.inc(1);
            if halvings > 0 && started.elapsed() > LONG / FINER {
                note(format!(
                    "meshes of {} cells and more by {} are left out: {cells} cells took {:.0} s to mesh and measure",
                    2 * cells,
                    method.name(),
                    started.elapsed().as_secs_f64()
                ));
                bar.inc(u64::from(halvings));
                break;
            }
        }
    }
    bar.finish_and_clear();
    Ok(rows)
}

fn order(coarse: f64, fine: f64) -> Option<f64> {
    Some((coarse / fine).log2()).filter(|order| order.is_finite())
}

fn row(solid: &Solid, method: MeshMethod, cells: usize, grid: &Grid) -> Result<MeshFigures, Failure> {
    let surface = solid.surface(*grid.bounds());
    let mut fastest = f64::INFINITY;
    let mut mesh = mesh::Mesh::default();
    for _ in 0..REPETITIONS {
        let started = Instant::now();
        mesh = method.mesh(&*surface, grid, &Unwatched).map_err(Failure::usage)?;
        fastest = fastest.min(started.elapsed().as_secs_f64() * 1e3);
    }
    let report = mesh::check(&mesh, &*surface);
    let depth = solid.depth(*grid.bounds(), grid.spacing().max_element());
    let quality = mesh::measure(&mesh, &*surface, &*depth, grid).map_err(Failure::usage)?;
    let quality = Measured((report.triangles > 0).then_some(quality));
    Ok(MeshFigures {
        method: method.name(),
        cells,
        spacing: grid.spacing().min_element(),
        triangles: report.triangles,
        closed: report.closed,
        manifold: report.manifold,
        quality,
        evaluations: mesh.work.evaluations,
        gradients: mesh.work.gradients,
        milliseconds: fastest,
        order: None,
        order_rms: None,
    })
}

/// What the table of meshes means.
pub(super) const ABOUT: &str =
    "lengths in metres; the order is log2 of the error's ratio to that in half as many cells";

pub(super) fn print(rows: &[MeshFigures]) {
    if rows.is_empty() {
        return println!("no meshes: the solid has no bounds");
    }
    println!("meshes; {ABOUT}");
    println!("{}", table::head(&COLUMNS));
    for row in rows {
        println!("{}", table::line(&COLUMNS, &row.cells()));
    }
    if let Some(lack) = without_triangles(rows) {
        println!("{lack}");
    }
}

/// Says which meshes have no triangles; `None` if all have some.
pub(super) fn without_triangles(rows: &[MeshFigures]) -> Option<String> {
    let of = |method: &str| {
        let own = rows.iter().filter(|row| row.method == method && row.triangles == 0);
        let cells: Vec<String> = own.map(|row| row.cells.to_string()).collect();
        (!cells.is_empty()).then(|| format!("{method} with {} cells", cells.join(", ")))
    };
    let lacking: Vec<String> = ["mc", "dc"].into_iter().filter_map(of).collect();
    (!lacking.is_empty()).then(|| {
        format!(
            "no triangles: {}; the mesh misses the whole solid, which is thinner than a cell, and has no figures",
            lacking.join(", ")
        )
    })
}

/// What the table of meshes holds.
pub(super) const COLUMNS: [Column; 12] = [
    Column::words("method", 7),
    Column::numbers("cells", 5),
    Column::numbers("triangles", 9),
    Column::numbers("ms", 9),
    Column::numbers("Hausdorff", 10),
    Column::numbers("order", 6),
    Column::numbers("rms", 9),
    Column::numbers("order", 6),
    Column::numbers("volume", 9),
    Column::numbers("normals", 8),
    Column::numbers("slivers", 8),
    Column::numbers("flipped", 7),
];

impl MeshFigures {
    /// The cells of [`COLUMNS`].
    pub fn cells(&self) -> Vec<String> {
        let figure = |shown: &dyn Fn(&Quality) -> String| self.quality.0.as_ref().map_or("–".into(), shown);
        vec![
            self.method.to_string(),
            self.cells.to_string(),
            self.triangles.to_string(),
            format!("{:.2}", self.milliseconds),
            figure(&|quality| format!("{:.2e}", quality.hausdorff())),
            table::order(self.order),
            figure(&|quality| format!("{:.1e}", quality.to_surface.rms)),
            table::order(self.order_rms),
            figure(&|quality| format!("{:+.1e}", quality.volume_error)),
            figure(&|quality| format!("{:.2}°", quality.normal_error.rms)),
            figure(&|quality| format!("{:.2} %", 100.0 * quality.slivers)),
            figure(&|quality| quality.flipped.to_string()),
        ]
    }
}

/// Plots the Hausdorff distance against the cells, with a line for each method, as SVG or PNG.
pub(super) fn draw(solid: &str, rows: &[MeshFigures], path: &Path) -> Result<Vec<u8>, Failure> {
    let marks: Vec<(&MeshFigures, f64)> = rows
        .iter()
        .filter_map(|row| Some((row, row.quality.0?.hausdorff())))
        .filter(|(_, error)| *error > 0.0 && error.is_finite())
        .collect();
    let mut out = plot::begin(&format!("{solid}: error of its meshes"));
    if marks.is_empty() {
        plot::sentence(&mut out, "no mesh has an error that can be plotted");
        return plot::end(out, path);
    }
    let x =
        LogAxis::over(marks.iter().map(|(row, _)| row.cells as f64), plot::LEFT, plot::WIDTH - plot::RIGHT);
    let y = LogAxis::over(marks.iter().map(|(_, error)| *error), plot::HEIGHT - plot::BOTTOM, plot::TOP);
    plot::grid(
        &mut out,
        &x,
        &y,
        ["cells along the longest side", "Hausdorff distance, m"],
        plot::WIDTH - plot::RIGHT,
    );
    let methods = [("mc", "marching cubes", "#1b6ca8"), ("dc", "dual contouring", "#c05621")];
    let own = |method: &str| {
        let rows = marks.iter().filter(|(row, _)| row.method == method);
        rows.map(|(row, error)| ((x.at(row.cells as f64), y.at(*error)), row.milliseconds))
            .collect::<Vec<_>>()
    };
    let lines = methods.map(|(method, ..)| own(method).into_iter().map(|(at, _)| at).collect::<Vec<_>>());
    let mut legend = Legend::new();
    for ((_, name, colour), line) in methods.iter().zip(&lines) {
        let points: Vec<String> = line.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        // writing to a String cannot fail
        let _ = write!(
            out,
            r##"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="2"/>"##,
            points.join(" ")
        );
        line.iter().for_each(|(x, y)| plot::dot(&mut out, *x, *y, colour));
        legend.entry(&mut out, name, |out, x, y| plot::line_sample(out, (x, y), colour, "none", true));
    }
    let mut labels = Labels::beside(&lines);
    for (at, milliseconds) in methods.iter().flat_map(|(method, ..)| own(method)) {
        labels.write(&mut out, at, &format!("{milliseconds:.1} ms"));
    }
    legend.gap();
    legend.remark(&mut out, "numbers: time of meshing");
    let empty = rows.iter().filter(|row| row.triangles == 0).count();
    if empty > 0 {
        legend.remark(&mut out, &format!("{empty} without triangles"));
    }
    plot::end(out, path)
}
