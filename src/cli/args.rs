//! The arguments of every command, with the help that teaches them.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::geom::Aabb;
use crate::slice::{Axis, Plane};
use glam::DVec3;

/// Obstacles written as R-functions, compiled to machine code: check, mesh, simulate.
///
/// A file describes solids by inequalities joined with `and`, `or`, `not`:
///
///   rfm 1
///   solid post = x^2 + y^2 <= 0.25 and 0 <= z <= 1
///
/// rfm compiles it to native code for ω(x, y, z), positive inside the solid, and its gradient.
#[derive(Debug, Parser)]
#[command(name = "rfm", version, max_term_width = 100, verbatim_doc_comment)]
#[command(after_help = "Start with:  rfm check examples/pawn.rfm --slice y=1.5 -o pawn.svg\n             \
                        rfm run examples/pawn.rfm\n\nExit codes: 0 fine, 1 the input has findings, 2 usage or file error, \
                        3 numerical failure in a run, 130 interrupted")]
pub(super) struct Arguments {
    #[command(flatten)]
    pub shared: Shared,
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Args)]
pub(super) struct Shared {
    /// Set a param of the file; may be repeated
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = definition, global = true)]
    pub define: Vec<(String, f64)>,
    /// Threads to use [default: all processors]; results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads, global = true)]
    pub threads: Option<NonZeroUsize>,
    /// Print one JSON document on standard output instead of text
    #[arg(long, global = true)]
    pub json: bool,
    /// Operations that a file may unroll to
    #[arg(long, value_name = "N", default_value_t = 1_000_000, global = true, hide_short_help = true)]
    pub max_nodes: usize,
    /// What evaluates ω: machine code or the interpreter, which gives the same bits
    #[arg(long, value_enum, default_value_t = Engine::Auto, global = true, hide_short_help = true)]
    pub engine: Engine,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Engine {
    /// Machine code where it can be made
    Auto,
    /// Machine code, or an error
    Jit,
    /// The interpreter
    Interp,
}

impl From<Engine> for crate::Engine {
    fn from(engine: Engine) -> Self {
        match engine {
            Engine::Auto => Self::Auto,
            Engine::Jit => Self::Jit,
            Engine::Interp => Self::Interpreter,
        }
    }
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Validate files, list their solids, plot slices
    Check(Check),
    /// Evaluate ω, ∇ω, sign, distance and normal at points
    Eval(Eval),
    /// Make a closed triangle mesh of a solid
    Mesh(Mesh),
    /// Simulate the fluid of a scene around its obstacles
    Run(Run),
    /// Measure speed against error for every program of a solid, and for its meshes
    Report(Report),
    /// Explain a message, or show what a stage of the compiler makes of a file
    Explain(Explain),
}

#[derive(Debug, Args)]
pub(super) struct Check {
    /// Files to check; `-` is standard input
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Plot ω over a plane: x=…, y=… or z=…
    #[arg(long, value_name = "AXIS=VALUE", value_parser = plane)]
    pub slice: Option<Plane>,
    /// The solid to plot [default: the only one, or the first obstacle of the scene]
    #[arg(short, long, value_name = "NAME", requires = "slice")]
    pub solid: Option<String>,
    /// Where the plot goes: .svg or .png [default: SOLID.AXIS=VALUE.svg]
    #[arg(short, long, value_name = "FILE", requires = "slice")]
    pub output: Option<PathBuf>,
    /// Draw the plot in the terminal
    #[arg(long, requires = "slice", conflicts_with = "json")]
    pub term: bool,
    /// Part of the plane to plot: u0,v0,u1,v1 [default: around the solid]
    #[arg(long, value_name = "U0,V0,U1,V1", value_parser = window, allow_hyphen_values = true, requires = "slice")]
    pub window: Option<[f64; 4]>,
    /// Check again whenever a file changes
    #[arg(long)]
    pub watch: bool,
    /// Treat a kind of message as an error
    #[arg(long, value_enum, value_name = "KIND")]
    pub deny: Option<Deny>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Deny {
    Warnings,
}

#[derive(Debug, Args)]
pub(super) struct Eval {
    /// The file; `-` is standard input
    pub file: PathBuf,
    /// The solid [default: the only one]
    #[arg(short, long, value_name = "NAME")]
    pub solid: Option<String>,
    /// A point; may be repeated
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    pub at: Vec<DVec3>,
    /// A CSV file of points with the header x,y,z; `-` is standard input
    #[arg(long, value_name = "FILE")]
    pub points: Option<PathBuf>,
    /// Columns to print
    #[arg(long, value_enum, value_delimiter = ',', default_value = "value,gradient")]
    pub what: Vec<What>,
    /// Width of all arithmetic [default: f64, or what the solid's tolerance allows for ω]
    #[arg(long, value_enum)]
    pub precision: Option<Precision>,
}

/// In the order of their columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub(super) enum What {
    /// ω, positive inside
    Value,
    /// ∂ω/∂x, ∂ω/∂y, ∂ω/∂z
    Gradient,
    /// 1 inside, 0 on the surface, −1 outside
    Sign,
    /// Distance from the surface, positive in the fluid: accurate near it, an estimate far away
    Distance,
    /// Outward unit normal −∇ω/|∇ω|
    Normal,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Precision {
    F32,
    F64,
}

#[derive(Debug, Args)]
pub(super) struct Mesh {
    /// The file; `-` is standard input
    pub file: PathBuf,
    /// The solid [default: the only one, or the first obstacle of the scene]
    #[arg(short, long, value_name = "NAME")]
    pub solid: Option<String>,
    /// Where the mesh goes; the ending chooses the format: .stl .ply .obj .vtp .glb .3mf
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Cells along the longest side
    #[arg(long, value_name = "N", default_value_t = 128, conflicts_with = "cell")]
    pub cells: usize,
    /// Size of a cell instead of their number
    #[arg(long, value_name = "SIZE", allow_negative_numbers = true)]
    pub cell: Option<f64>,
    /// Mesh this box instead of the solid's own bounds; the mesh is closed at its border
    #[arg(long = "box", value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = aabb, allow_hyphen_values = true)]
    pub domain: Option<Aabb>,
    /// How the surface is found
    #[arg(long, value_enum, default_value_t = MeshMethod::Mc)]
    pub method: MeshMethod,
    /// Contract thin triangles; all vertices stay on the surface
    #[arg(long)]
    pub no_slivers: bool,
    /// Measure the mesh against the surface and the surface against the mesh: takes longer than meshing
    #[arg(long)]
    pub quality: bool,
    /// Write .stl as text
    #[arg(long)]
    pub ascii: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum MeshMethod {
    /// Marching cubes with vertices on the exact surface
    Mc,
    /// Dual contouring: also edges and corners are exact
    Dc,
}

#[derive(Debug, Args)]
pub(super) struct Run {
    /// The file; `-` is standard input
    pub file: PathBuf,
    /// The scene [default: the only one]
    #[arg(long, value_name = "NAME")]
    pub scene: Option<String>,
    /// Folder for frames, pictures and summary [default: the file's name + .out]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Stop after this many steps, counted from the run's beginning
    #[arg(long, value_name = "N", conflicts_with = "until")]
    pub steps: Option<u64>,
    /// Stop at this simulated time, seconds
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub until: Option<f64>,
    /// Go on from the folder's last checkpoint; the scene's `run` block and probes may have changed
    #[arg(long)]
    pub resume: bool,
    /// Print what would be run, and run nothing
    #[arg(long, conflicts_with = "resume")]
    pub dry_run: bool,
    /// Write no pictures
    #[arg(long)]
    pub no_pictures: bool,
    /// Write no frames and no pictures
    #[arg(long)]
    pub no_frames: bool,
    /// Cells of the obstacle's mesh along its longest side
    #[arg(long, value_name = "N", default_value_t = 96)]
    pub mesh_cells: usize,
}

#[derive(Debug, Args)]
pub(super) struct Report {
    /// The file; `-` is standard input
    pub file: PathBuf,
    /// The solid [default: the only one, or the first obstacle of the scene]
    #[arg(short, long, value_name = "NAME")]
    pub solid: Option<String>,
    /// Plot speed against error: .svg or .png
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Plot the error of meshes against their cells: .svg or .png
    #[arg(long, value_name = "FILE")]
    pub mesh_plot: Option<PathBuf>,
    /// Cells along the longest side of the finest mesh; the others have half as many each
    #[arg(long, value_name = "N", default_value_t = 128)]
    pub mesh_cells: usize,
}

#[derive(Debug, Args)]
pub(super) struct Explain {
    /// The code of a message (E0201), or a file, FILE:SOLID or FILE:SCENE
    #[arg(value_name = "CODE|FILE[:NAME]")]
    pub subject: String,
    /// Stages to print
    #[arg(long, value_enum, value_delimiter = ',')]
    pub show: Vec<Stage>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Stage {
    /// The syntax tree
    Ast,
    /// The simplified expression graph of ω and ∇ω
    Ir,
    /// The code generator's intermediate representation
    Clif,
    /// Machine code
    Asm,
}

fn definition(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let value = value.trim().parse().map_err(|_| format!("`{value}` is not a number"))?;
    Ok((name.trim().to_string(), value))
}

/// More threads than this are a slip of the keyboard, and starting them would take minutes.
const MOST_THREADS: usize = 1024;

fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let number = text.trim().parse().ok().filter(|n: &NonZeroUsize| n.get() <= MOST_THREADS);
    number.ok_or_else(|| format!("expected a whole number from 1 to {MOST_THREADS}"))
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let parts: Vec<&str> = text.split(',').collect();
    let values: Result<Vec<f64>, String> = parts
        .iter()
        .map(|part| part.trim().parse().map_err(|_| format!("`{part}` is not a number")))
        .collect();
    values?.try_into().map_err(|v: Vec<f64>| format!("expected {N} numbers, found {}", v.len()))
}

fn point(text: &str) -> Result<DVec3, String> {
    numbers::<3>(text).map(DVec3::from_array)
}

fn window(text: &str) -> Result<[f64; 4], String> {
    numbers::<4>(text)
}

fn aabb(text: &str) -> Result<Aabb, String> {
    let [x0, y0, z0, x1, y1, z1] = numbers::<6>(text)?;
    Ok(Aabb::new(DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1)))
}

fn plane(text: &str) -> Result<Plane, String> {
    let (axis, value) = text.split_once('=').ok_or("expected x=…, y=… or z=…")?;
    let axis = match axis.trim() {
        "x" => Axis::X,
        "y" => Axis::Y,
        "z" => Axis::Z,
        other => return Err(format!("`{other}` is not an axis; expected x, y or z")),
    };
    let value: f64 = value.trim().parse().map_err(|_| format!("`{value}` is not a number"))?;
    if !value.is_finite() {
        return Err("the plane must be at a finite place".into());
    }
    Ok(Plane::new(axis, value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent() {
        Arguments::command().debug_assert();
    }
}
