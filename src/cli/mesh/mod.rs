//! `rfm mesh`: a closed triangle mesh of a solid, in the format that the file's ending names; with `--fluid` surfaces
//! of the particles of a run.

mod fluid;
mod format;
mod simplified;

use std::time::Instant;

use serde::Serialize;

use super::args::{Mesh as Options, MeshMethod, Shared};
use super::{Failure, choose, input, note, output, progress};
use crate::field::Field;
use crate::geom::Aabb;
use crate::mesh::{
    self, Grid, Mesh, MeshError, Quality, Reference, Report, Resolution, ThinCells, dual_contouring,
    marching_cubes,
};
use crate::solid::{Bounds, Depth};
pub(super) use format::Format;
use simplified::{Simplified, simplified};

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
    thin_cells: usize,
    evaluations: u64,
    milliseconds: f64,
    method: &'static str,
    /// With `--quality` only: lengths in metres, angles in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    quality: Option<Quality>,
    /// With `--simplify` only.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    simplified: Option<SimplifiedFigures>,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct SimplifiedFigures {
    /// Triangles before.
    simplified_from: usize,
    /// Metres, as asked for.
    simplify_tolerance: f64,
    /// Measured Hausdorff distance from the surface, metres.
    simplify_error: f64,
    /// With measuring.
    simplify_milliseconds: f64,
}

impl From<&Simplified> for SimplifiedFigures {
    fn from(simplified: &Simplified) -> Self {
        Self {
            simplified_from: simplified.from,
            simplify_tolerance: simplified.tolerance,
            simplify_error: simplified.quality.hausdorff(),
            simplify_milliseconds: simplified.milliseconds,
        }
    }
}

impl MeshMethod {
    pub fn name(self) -> &'static str {
        match self {
            Self::Mc => "mc",
            Self::Dc => "dc",
        }
    }

    /// Meshes a field by this method.
    pub fn mesh(
        self,
        field: &dyn Field,
        grid: &Grid,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Mesh, MeshError> {
        match self {
            Self::Mc => marching_cubes(field, grid, progress),
            Self::Dc => dual_contouring(field, grid, progress),
        }
    }
}

pub(super) fn run(shared: &Shared, options: &Options) -> Result<(), Failure> {
    if options.fluid {
        return fluid::run(shared, options);
    }
    if options.file.is_dir() {
        let folder = options.file.display();
        return Err(Failure::usage(format!(
            "`{folder}` is a folder: give a file, or mesh the fluid of a run with `rfm mesh {folder} --fluid`"
        )));
    }
    let format = match options.output.as_deref().map(Format::of).transpose()? {
        Some(format) => Some(format.as_text(options.ascii)?),
        None if options.ascii => return Err(Format::no_text()),
        None => None,
    };
    if format.is_none() && !shared.json {
        return Err(Failure::usage(
            "no output: give -o FILE.stl (or .ply, .obj, .vtp, .glb, .3mf), or --json for the figures alone",
        ));
    }
    let program = input::program(shared, &options.file)?;
    let solid = choose::solid_at(shared, &program, options.solid.as_deref(), options.time)?;
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
    let mut mesh = match &grid {
        None => Mesh::default(),
        Some(grid) => {
            let bar = progress::bar(1000, "meshing");
            let mesh = options.method.mesh(&*surface, grid, &|part| bar.set_position((1000.0 * part) as u64));
            bar.finish_and_clear();
            let mut mesh =
                mesh.map_err(|error| Failure::usage(format!("cannot mesh `{}`: {error}", solid.name())))?;
            if options.no_slivers {
                mesh::remove_slivers(&mut mesh);
            }
            mesh
        }
    };
    let milliseconds = started.elapsed().as_secs_f64() * 1e3;
    let depth = Depth(&solid);
    let measured = options.quality || options.simplify.is_some();
    let spinner = measured.then(|| progress::spinner("measuring"));
    let reference = grid.as_ref().filter(|_| measured).map(|grid| Reference::new(&*surface, &depth, grid));
    let reference = reference.transpose().map_err(Failure::usage)?;
    let simplified = options.simplify.zip(reference.as_ref()).map(|(tolerance, reference)| {
        let found = simplified(&mesh, tolerance, &depth, reference);
        mesh.clone_from(&found.mesh);
        found
    });
    let quality = match (&simplified, &reference) {
        (Some(simplified), _) => Some(simplified.quality),
        (None, Some(reference)) => Some(reference.measure(&mesh)),
        (None, None) => None,
    };
    spinner.inspect(|spinner| spinner.finish_and_clear());
    let report = mesh::check(&mesh, &*surface);
    let thin = grid
        .as_ref()
        .map_or(Ok(ThinCells::NONE), |grid| mesh::thin_cells(&*surface, grid))
        .map_err(Failure::usage)?;
    if thin.count > 0 {
        note(format!(
            "{} cells away from the mesh hide parts of the surface that are thinner than a cell, between {:.3} and {:.3}; \
             try more cells",
            thin.count, thin.bounds.min, thin.bounds.max
        ));
    }
    if mesh.triangles.is_empty() {
        note(format!("`{}` has no surface here: {}", solid.name(), why_empty(&solid, bounds, options)));
    }
    if let (Some(path), Some(format)) = (&options.output, format) {
        output::write(path, |out| format.write(&mesh, out))?;
    }
    if shared.json {
        let quality = quality.filter(|_| options.quality);
        let mut summary = summary(solid.name(), options.method, &report, thin.count, quality, milliseconds);
        summary.simplified = simplified.as_ref().map(SimplifiedFigures::from);
        return output::json(&summary);
    }
    print(&report, milliseconds);
    if let Some(simplified) = &simplified {
        say!(
            "simplified from {} triangles: at most {:.2e} from the surface, {:.2e} allowed",
            simplified.from,
            simplified.quality.hausdorff(),
            simplified.tolerance
        );
    }
    if let Some(quality) = quality.filter(|_| options.quality) {
        print_quality(&quality);
    }
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

fn summary(
    name: &str,
    method: MeshMethod,
    report: &Report,
    thin_cells: usize,
    quality: Option<Quality>,
    milliseconds: f64,
) -> Summary {
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
        thin_cells,
        evaluations: report.evaluations,
        milliseconds,
        method: method.name(),
        quality,
        simplified: None,
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

fn print_quality(quality: &Quality) {
    say!(
        "Hausdorff distance: {:.2e} (mesh to surface {:.2e}, rms {:.1e}; surface to mesh {:.2e}, rms {:.1e})",
        quality.hausdorff(),
        quality.to_surface.max,
        quality.to_surface.rms,
        quality.from_surface.max,
        quality.from_surface.rms
    );
    say!(
        "volume error: {:+.1e}, area error: {:+.1e}, normals off by {:.2}° rms, {} triangles upside down",
        quality.volume_error,
        quality.area_error,
        quality.normal_error.rms,
        quality.flipped
    );
    say!(
        "triangles: least angle {:.2}°, mean radius ratio {:.3}, {:.2} % slivers",
        quality.min_angle,
        quality.mean_radius_ratio,
        100.0 * quality.slivers
    );
}
