//! `rfm mesh`: a closed triangle mesh of a solid, in the format that the file's ending names.

use std::io::{self, Write};
use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::args::{Mesh as Options, MeshMethod, Shared};
use super::{Failure, choose, input, note, output, progress};
use crate::field::Field;
use crate::geom::Aabb;
use crate::mesh::{self, Grid, Mesh, Report, Resolution, dual_contouring, marching_cubes};
use crate::solid::Bounds;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Stl,
    Ply,
    Obj,
    Vtp,
}

impl Format {
    fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        match ending.as_str() {
            "stl" => Ok(Self::Stl),
            "ply" => Ok(Self::Ply),
            "obj" => Ok(Self::Obj),
            "vtp" => Ok(Self::Vtp),
            _ => Err(Failure::usage(format!(
                "cannot tell the mesh format of `{}`: the ending must be .stl, .ply, .obj or .vtp",
                path.display()
            ))),
        }
    }

    pub fn write(self, mesh: &Mesh, mut out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Stl => mesh::stl::write(mesh, &mut out),
            Self::Ply => mesh::ply::write(mesh, &mut out),
            Self::Obj => mesh::obj::write(mesh, &mut out),
            Self::Vtp => mesh::vtp::write(mesh, &mut out),
        }
    }
}

#[derive(Serialize)]
struct Summary {
    schema: u32,
    solid: String,
    vertices: usize,
    triangles: usize,
    closed: bool,
    manifold: bool,
    components: usize,
    euler: i64,
    volume: f64,
    area: f64,
    max_distance: f64,
    rms_distance: f64,
    evaluations: u64,
    milliseconds: f64,
}

pub(super) fn run(shared: &Shared, options: &Options) -> Result<(), Failure> {
    let format = options.output.as_deref().map(Format::of).transpose()?;
    if format.is_none() && !shared.json {
        return Err(Failure::usage(
            "no output: give -o FILE.stl (or .ply, .obj, .vtp), or --json for the figures alone",
        ));
    }
    let program = input::program(shared, &options.file)?;
    let solid = choose::solid(shared, &program, options.solid.as_deref())?;
    let resolution = options.cell.map_or(Resolution::Cells(options.cells), Resolution::Spacing);
    let bounds = *solid.bounds();
    let grid = match (options.domain, bounds) {
        (Some(domain), _) => Some(Grid::filling(&domain, resolution)),
        (None, Bounds::Within(bounds)) => Some(Grid::around(&bounds, resolution)),
        (None, Bounds::Empty) => None,
        (None, Bounds::Unbounded) => {
            return Err(Failure::usage(format!(
                "`{}` could not be proven to end anywhere: give the box to mesh with --box X0,Y0,Z0,X1,Y1,Z1",
                solid.name()
            )));
        }
    };
    let started = Instant::now();
    // same surface as ω, cheaper, and normals of one face at creases
    let grid = grid.transpose().map_err(Failure::usage)?;
    let surface = solid.surface(grid.as_ref().map_or(Aabb::EMPTY, |grid| *grid.bounds()));
    let mesh = match grid {
        None => Mesh::default(),
        Some(grid) => {
            let bar = progress::bar(1000, "meshing");
            let progress = |part| bar.set_position((1000.0 * part) as u64);
            let mesh = match options.method {
                MeshMethod::Mc => marching_cubes(&*surface, &grid, &progress),
                MeshMethod::Dc => dual_contouring(&*surface, &grid, &progress),
            };
            bar.finish_and_clear();
            mesh.map_err(|error| Failure::usage(format!("cannot mesh `{}`: {error}", solid.name())))?
        }
    };
    let milliseconds = started.elapsed().as_secs_f64() * 1e3;
    let report = mesh::check(&mesh, &*surface);
    if mesh.triangles.is_empty() {
        note(format!("`{}` has no surface here: {}", solid.name(), why_empty(&solid, bounds, options)));
    }
    if let (Some(path), Some(format)) = (&options.output, format) {
        output::write(path, |out| format.write(&mesh, out))?;
    }
    if shared.json {
        return output::json(&summary(solid.name(), &report, milliseconds));
    }
    print(&report, milliseconds);
    if let Some(path) = &options.output {
        say!("written to {}", path.display());
    }
    Ok(())
}

fn why_empty(solid: &impl Field, bounds: Bounds, options: &Options) -> String {
    match (bounds, options.domain) {
        (Bounds::Empty, _) => "ω is nowhere positive, so the solid is empty".into(),
        (_, Some(domain)) if solid.range(&domain).lo > 0.0 => "the box lies inside it".into(),
        _ => "no grid point lies inside it; try more cells".into(),
    }
}

fn summary(name: &str, report: &Report, milliseconds: f64) -> Summary {
    Summary {
        schema: 1,
        solid: name.to_string(),
        vertices: report.vertices,
        triangles: report.triangles,
        closed: report.closed,
        manifold: report.manifold,
        components: report.components,
        euler: report.euler,
        volume: report.volume,
        area: report.area,
        max_distance: report.max_distance,
        rms_distance: report.rms_distance,
        evaluations: report.evaluations,
        milliseconds,
    }
}

fn print(report: &Report, milliseconds: f64) {
    let yes = |b: bool| if b { "yes" } else { "NO" };
    say!(
        "{} vertices, {} triangles in {milliseconds:.1} ms ({} evaluations of ω)",
        report.vertices,
        report.triangles,
        report.evaluations
    );
    say!(
        "closed: {}, manifold: {}, components: {}, Euler characteristic: {}",
        yes(report.closed),
        yes(report.manifold),
        report.components,
        report.euler
    );
    say!("volume: {:.9}, area: {:.9}", report.volume, report.area);
    say!(
        "distance of the vertices from the surface: {:.1e} at most, {:.1e} rms",
        report.max_distance,
        report.rms_distance
    );
}
