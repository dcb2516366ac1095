//! `rfm mesh`: a closed triangle mesh of a solid, in the format that the file's ending names. With `--fluid`
//! it makes surfaces of the particles of a run.

mod fluid;
mod format;
mod simplified;
mod stopwatch;
mod summary;

use std::path::Path;
use std::time::Instant;

use super::args::{Mesh as Options, MeshMethod};
use super::deadline::{self, Deadline};
use super::failure::{Failure, complain, note};
use super::hidden::{hidden, knows_ranges, without_ranges};
use super::shared::Shared;
use super::{choose, input, output, progress};
use crate::cli::output::Shown;
pub(super) use format::{ascii_help, format_name, output_help, unit_help, unit_name};
use rfm::Solid;
use rfm::field::Field;
use rfm::geom::{Aabb, place};
use rfm::mesh::{
    self, Grid, GridError, LengthUnit, Mesh, MeshError, Quality, Reference, Resolution, ThinCells, Watch,
    WriteMesh, dual_contouring, marching_cubes,
};
use rfm::solid::Bounds;
use rfm::view;
use simplified::{Simplified, simplified};
use stopwatch::milliseconds;
use summary::{MeshSummary, Times};

impl MeshMethod {
    /// The name on the command line and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mc => "mc",
            Self::Dc => "dc",
        }
    }

    /// Meshes a field by this method.
    pub fn mesh(self, field: &dyn Field, grid: &Grid, watch: &dyn Watch) -> Result<Mesh, MeshError> {
        match self {
            Self::Mc => marching_cubes(field, grid, watch),
            Self::Dc => dual_contouring(field, grid, watch),
        }
    }
}

pub(super) fn run(shared: &Shared, options: &Options) -> Result<(), Failure> {
    if options.fluid {
        return fluid::run(shared, options);
    }
    let (writer, unit) = writer(shared, options)?;
    let program = input::program(shared, &options.file)?;
    options.output.as_deref().map_or(Ok(()), output::keep_inputs)?;
    let solid = choose::solid_at(shared, &program, options.solid.as_deref(), options.time)?;
    let grid = grid(&solid, options)?;

    let mut times = Times::default();
    let started = Instant::now();
    // it has the same zero set as ω, is cheaper, and gives the normal of one face at creases
    let surface = solid.surface(grid.as_ref().map_or(Aabb::EMPTY, |grid| *grid.bounds()));
    let mut mesh = match &grid {
        None => Mesh::default(),
        Some(grid) => meshed(&solid, &*surface, grid, options)?,
    };
    times.meshing = milliseconds(started);
    let started = Instant::now();
    let (quality, simplified) = match &grid {
        Some(grid) if options.quality || options.simplify.is_some() => {
            measured(&mut mesh, &solid, &*surface, grid, options)?
        }
        _ => (None, None),
    };
    times.measuring = milliseconds(started);
    let started = Instant::now();
    let report = mesh::check(&mesh, &*surface);
    let thin = match &grid {
        None => ThinCells::NONE,
        Some(grid) => thin_cells((&solid, &*surface), grid, options, times.meshing)?,
    };
    times.checking = milliseconds(started);
    let small = small_components(&report, grid.as_ref());
    remark(&solid, (&mesh, small), (&thin, grid.as_ref()), options);
    if mesh.triangles.is_empty() {
        return nothing_to_write(shared, options, (&solid, &report, &thin, &times));
    }
    if let (Some(path), Some(writer)) = (&options.output, writer) {
        let started = Instant::now();
        output::write(path, |out| match writer {
            Writer::File(write) => write(&mesh, unit, out),
            Writer::Page => view::solid(&format!("{} · {}", solid.name(), title(options)), &mesh, out),
        })?;
        times.writing = milliseconds(started);
        warn_of_rounding(path, &mesh, grid.as_ref());
    }
    let names = (solid.name(), options.method.name());
    let mut summary = MeshSummary::new(names, &report, &thin, quality, simplified.as_ref(), times);
    summary.small_components = small;
    if shared.json {
        return output::json(&summary);
    }
    summary.print();
    if let Some(path) = &options.output {
        say!("written to {}, in {}{}", path.shown(), unit.plural, unit_hint(path, options));
    }
    Ok(())
}

/// Time for the search for thin parts, unless the option states it: the larger one of this number of seconds
/// and this multiple of the time for meshing.
pub(super) const LEAST_SEARCH: f64 = 10.0;
const SEARCH_PER_MESHING: f64 = 3.0;

/// What the mesh misses. Without ranges the search does not begin, and counts as ended. `meshing` is how long the meshing took,
/// ms.
fn thin_cells(
    (solid, surface): (&Solid, &dyn Field),
    grid: &Grid,
    options: &Options,
    meshing: f64,
) -> Result<ThinCells, Failure> {
    if options.budget.is_none() && !knows_ranges(solid, grid.bounds()) {
        return Ok(ThinCells { ended: true, ..ThinCells::NONE });
    }
    let own = LEAST_SEARCH.max(SEARCH_PER_MESHING * 1e-3 * meshing);
    mesh::thin_cells(surface, grid, &Deadline::after(options.budget.unwrap_or(own))).map_err(Failure::usage)
}

/// Ends the command for a mesh without triangles: there is no file of it.
fn nothing_to_write(
    shared: &Shared,
    options: &Options,
    (solid, report, thin, times): (&Solid, &mesh::Report, &ThinCells, &Times),
) -> Result<(), Failure> {
    if shared.json {
        let names = (solid.name(), options.method.name());
        output::json(&MeshSummary::new(names, report, thin, None, None, *times))?;
    }
    if let Some(path) = &options.output {
        complain(&format!("the mesh is empty: `{}` is not written", path.shown()));
    } else {
        complain("the mesh is empty");
    }
    Err(Failure::Findings)
}

/// The message about a unit that other programs take for another one.
fn unit_hint(path: &Path, options: &Options) -> &'static str {
    let is_stl = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(mesh::stl::FORMAT.ending));
    if is_stl && options.unit.is_none() { "; most programs read .stl as millimetres: --unit mm" } else { "" }
}

/// If the rounding of vertices is at least this part of a cell, it is reported.
const SEEN_ROUNDING: f64 = 1e-3;

/// Reports how far a format with few digits moves vertices, if that is a visible part of a cell.
fn warn_of_rounding(path: &Path, mesh: &Mesh, grid: Option<&Grid>) {
    let is_single = format::is_page(path) || format::of_path(path).is_ok_and(|format| format.single);
    let Some(cell) = grid.map(|grid| grid.spacing().min_element()).filter(|_| is_single) else { return };
    let farthest = mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let rounding = 0.5 * f64::from(f32::EPSILON) * farthest;
    if rounding > SEEN_ROUNDING * cell {
        note(format!(
            "`{}` holds seven digits, which move vertices by up to {rounding:.1e} m, {:.1e} of a cell: move the solid to \
             the origin, or write .ply",
            path.shown(),
            rounding / cell
        ));
    }
}

/// How a mesh is written.
enum Writer {
    File(WriteMesh),
    /// A page that shows it in a browser.
    Page,
}

/// The name of the file that a mesh is made of.
fn title(options: &Options) -> String {
    options.file.file_name().map_or_else(|| options.file.shown(), |name| Path::new(name).shown())
}

/// The writer that the options ask for, `None` if only figures are wanted; and the unit.
fn writer(shared: &Shared, options: &Options) -> Result<(Option<Writer>, LengthUnit), Failure> {
    if options.file.is_dir() {
        let folder = options.file.shown();
        return Err(Failure::usage(format!(
            "`{folder}` is a folder: give a file, or mesh the fluid of a run with `rfm mesh {folder} --fluid`"
        )));
    }
    match &options.output {
        Some(path) if format::is_page(path) => match options.unit {
            None | Some(LengthUnit::METRE) if !options.ascii => Ok((Some(Writer::Page), LengthUnit::METRE)),
            _ => Err(Failure::usage(
                "a page shows the mesh in metres: --unit and --ascii are for other formats",
            )),
        },
        Some(path) => {
            let format = format::of_path(path)?;
            let unit = format::unit_fits(format, options.unit)?;
            Ok((Some(Writer::File(format::writer(format, options.ascii)?)), unit))
        }
        None if options.ascii => Err(format::no_text()),
        None if shared.json || options.quality => Ok((None, LengthUnit::METRE)),
        None => Err(format::no_output()),
    }
}

/// The grid around a solid, or in the box that is asked for; `None` for an empty solid without a box.
fn grid(solid: &Solid, options: &Options) -> Result<Option<Grid>, Failure> {
    let resolution = options.cell.map_or(Resolution::Cells(options.cells), Resolution::Spacing);
    let grid = match (options.domain, solid.bounds()) {
        (Some(domain), _) => Some(Grid::filling(&domain, resolution)),
        (None, Bounds::Within(bounds)) => Some(Grid::around(bounds, resolution)),
        (None, Bounds::Empty) => None,
        (None, Bounds::Unbounded) => {
            let sides = solid.unbounded().map_or(String::new(), |why| why.direction());
            return Err(Failure::usage(format!(
                "`{}` could not be proven to end {sides}: give the box to mesh with --box X0,Y0,Z0,X1,Y1,Z1",
                solid.name()
            )));
        }
    };
    grid.transpose().map_err(|error| match options.cell {
        None => no_grid(&error, "--cells", options.cells),
        Some(cell) => match error {
            GridError::TooManyCells(found) => Failure::usage(format!(
                "--cell {cell} makes {found} cells along one side: at most {} are possible",
                Grid::MAX_CELLS
            )),
            GridError::BadSpacing(_) => Failure::usage(format!(
                "--cell {cell} is not a positive length that these coordinates can resolve"
            )),
            GridError::TooFewCells(_) | GridError::BadBox(_) => Failure::usage(error),
        },
    })
}

/// Why there is no grid with the given number of cells along the longest side, in the words of the flag that
/// asks for them.
pub(super) fn no_grid(error: &GridError, flag: &str, cells: usize) -> Failure {
    Failure::usage(match error {
        GridError::TooManyCells(_) => {
            format!("{flag} {cells} is too fine: at most {} cells along a side are possible", Grid::MAX_CELLS)
        }
        GridError::TooFewCells(_) => {
            format!("{flag} {cells} is too coarse: at least {} are needed", Grid::MIN_CELLS)
        }
        GridError::BadSpacing(_) => format!("{flag} {cells} is too fine for these coordinates"),
        GridError::BadBox(_) => error.to_string(),
    })
}

/// The mesh of a surface, without slivers if the options ask for that.
fn meshed(solid: &Solid, surface: &dyn Field, grid: &Grid, options: &Options) -> Result<Mesh, Failure> {
    let bar = progress::shares("meshing");
    let mesh = options.method.mesh(surface, grid, &bar);
    bar.finish_and_clear();
    let mut mesh =
        mesh.map_err(|error| Failure::usage(format!("cannot mesh `{}`: {error}", solid.name())))?;
    if options.no_slivers {
        mesh::remove_slivers(&mut mesh);
    }
    Ok(mesh)
}

/// Simplifies the mesh if the options ask for it, and measures it. The quality is `None` if only `--simplify`
/// needed it.
fn measured(
    mesh: &mut Mesh,
    solid: &Solid,
    surface: &dyn Field,
    grid: &Grid,
    options: &Options,
) -> Result<(Option<Quality>, Option<Simplified>), Failure> {
    // the samples lie nearer to the surface than a cell
    let depth = solid.depth(*grid.bounds(), grid.spacing().max_element());
    // a mesh that is simplified stays within its tolerance only if all of it is measured
    let end = options.budget.filter(|_| options.simplify.is_none()).map(Deadline::after);
    let bar = progress::shares("a finer mesh");
    let reference = Reference::new(surface, &*depth, grid, &deadline::Shown(&bar, end));
    bar.finish_and_clear();
    let reference = match reference {
        Err(MeshError::Ended) => {
            note(
                "the quality was not measured: the finer mesh that this one is compared with was not finished in time; \
                 --budget gives it more",
            );
            return Ok((None, None));
        }
        other => other.map_err(Failure::usage)?,
    };
    let found =
        options.simplify.map(|tolerance| simplified(mesh, tolerance, &*depth, &reference, options.method));
    let quality = options.quality.then(|| {
        found.as_ref().and_then(|found| found.quality).unwrap_or_else(|| {
            let bar = progress::shares("measuring");
            let quality = reference.measure(mesh, &deadline::Shown(&bar, end));
            bar.finish_and_clear();
            quality
        })
    });
    Ok((quality, found))
}

/// The longest side, in cells, of a component that the grid shows roughly at best.
const SMALL: f64 = 2.0;

/// The number of components that are so small that each of their faces lies in one or two cells.
fn small_components(report: &mesh::Report, grid: Option<&Grid>) -> usize {
    let Some(grid) = grid else { return 0 };
    let least = SMALL * grid.spacing().max_element();
    report.component_bounds.iter().filter(|bounds| bounds.size().max_element() < least).count()
}

/// Triangles that are compared with one another in a few tenths of a second.
const MOST_COMPARED: usize = 300_000;

/// Says on standard error what the grid could not see, and why a mesh is empty.
fn remark(
    solid: &Solid,
    (mesh, small): (&Mesh, usize),
    (thin, grid): (&ThinCells, Option<&Grid>),
    options: &Options,
) {
    if let Some(grid) = grid.filter(|_| thin.count > 0) {
        let what = if thin.is_wedge {
            "the mesh shows sharp edges and tips blunt"
        } else {
            "the mesh does not show all of what is thinner than two cells:"
        };
        note(format!("{what} {}", hidden(thin, grid)));
    }
    if small > 0 {
        let (are, they) = if small == 1 { ("is", "it is") } else { ("are", "they are") };
        let parts = output::counted(small, "component");
        note(format!(
            "{parts} of the mesh {are} less than two cells across: so few cells show where {they}, and neither shape nor \
             volume; --cells with more, or a --box around one, shows these"
        ));
    }
    if let Some(mesh::Branches { count, at }) = mesh::branches(mesh) {
        let at = grid.map_or_else(|| at.to_string(), |grid| place(at, grid.bounds().size().max_element()));
        let cure = match options.method {
            MeshMethod::Dc => "`--method mc` or a part that is moved a little",
            MeshMethod::Mc => "a part that is moved a little",
        };
        note(format!(
            "more than two triangles meet at {}, as around {at}, for programs that join vertices at one place, as those that \
             read STL do: they may take the mesh for no solid; {cure} has none",
            output::counted(count, "edge")
        ));
    }
    // faces of walls and gaps that lie in one cell may pass through each other; dual contouring keeps them apart
    let is_looked_at = options.method == MeshMethod::Mc && mesh.triangles.len() <= MOST_COMPARED;
    let crossing = match thin.count > 0 && !thin.is_wedge && is_looked_at {
        true => mesh::self_intersections(mesh).len(),
        false => 0,
    };
    if crossing > 0 {
        let pairs = output::counted(crossing, "pair");
        note(format!(
            "{pairs} of triangles cross: more cells part them, and `--method dc` keeps triangles apart"
        ));
    }
    match (thin.ended, grid) {
        (true, Some(grid)) if options.budget.is_none() && !knows_ranges(solid, grid.bounds()) => {
            note(without_ranges(solid));
        }
        (true, _) => note(
            "the search for what the mesh misses was ended before all of the surface was looked at; --budget gives \
             it more time",
        ),
        (false, _) => {}
    }
    if mesh.triangles.is_empty() {
        note(format!("`{}` has no surface here: {}", solid.name(), why_empty(solid, options)));
    }
}

fn why_empty(solid: &Solid, options: &Options) -> &'static str {
    match (solid.bounds(), options.domain) {
        (Bounds::Empty, _) => "ω is nowhere positive, so the solid is empty",
        (_, Some(domain)) if solid.range(&domain).lo > 0.0 => "the box lies inside it",
        (_, Some(domain)) if solid.range(&domain).hi < 0.0 => "the box lies outside it",
        _ => "no grid point lies inside it; try more cells",
    }
}
