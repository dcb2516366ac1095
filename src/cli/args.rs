//! The arguments of every command, with the help that teaches them.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Arg, Args, CommandFactory, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;

use super::mesh::{ascii_help, format_name, output_help, unit_help, unit_name};
use super::render::Surface;
use super::scenery::Viewpoint;
use super::shared::Shared;
use super::sweep::options::{Again, SweepOptions};
pub(super) use super::values::CutFlag;
use super::values::{
    Deny, Frames, Tolerance, aabb, camera, cells, cut, deny, frames, length, plane, point, seconds, steps,
    tolerance, window,
};
use glam::DVec3;
use rfm::geom::Aabb;
use rfm::mesh::{Format, LengthUnit};
use rfm::precision::Precision;
use rfm::slice::Plane;
use rfm::source::Target;

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

/// Commands that read no file of the language: options of all commands mean nothing to them.
const WITHOUT_FILES: [&str; 4] = ["completions", "man", "lsp", "init"];

/// Help without the options of all commands, for those that have no use for them.
const HELP: &str = "{about-with-newline}\n{usage-heading} {usage}\n\nArguments:\n{positionals}{after-help}";

/// The declaration of all commands. Options of all commands are hidden where they mean nothing.
pub(super) fn declaration() -> clap::Command {
    let whole = Arguments::command();
    let shared: Vec<Arg> = whole.get_arguments().filter(|arg| arg.is_global_set()).cloned().collect();
    whole.mut_subcommands(|command| {
        if !WITHOUT_FILES.contains(&command.get_name()) {
            return command;
        }
        // a command's own declaration of an option replaces the one that it would get
        command.args(shared.iter().map(|arg| arg.clone().hide(true)))
    })
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Validate files, list their solids, plot slices
    Check(Check),
    /// Evaluate ω, ∇ω, sign, distance and normal at points
    Eval(Eval),
    /// Make a closed triangle mesh of a solid, or of the fluid of a run
    Mesh(Mesh),
    /// Write a solid as source or object code for other programs: C, CUDA, Rust, WGSL, GLSL
    Build(Build),
    /// Simulate the fluid of a scene around its obstacles
    Run(Run),
    /// Show a scene, a solid or the frames of a run in the browser, or save a run as one page
    View(super::view::View),
    /// Make pictures or a film of the frames of a run, or a picture of a solid
    Render(super::render::Render),
    /// Measure speed against error: of every program of a solid and its meshes, or of a flow that is known
    Report(super::report::Report),
    /// Explain a message, or show what a stage of the compiler makes of a file
    Explain(Explain),
    /// Lay out files: blanks, indentation, spelling of operators; lines end where they end
    Fmt(super::fmt::Fmt),
    /// Serve an editor: messages, layout, completion and more while you type
    Lsp(super::lsp::Lsp),
    /// Write a file to begin with: an obstacle, an experiment or a validation
    Init(super::init::Init),
    /// Print what a shell needs to complete commands and options
    Completions(Completions),
    /// Print the manual page, or write one for each command
    Man(Man),
}

#[derive(Debug, Clone, Args)]
pub(super) struct Check {
    /// Files to check; `-` is standard input
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Plot ω over a plane: x=…, y=… or z=…; several planes make a sheet: z=0.2,z=0.8,y=1.5
    #[arg(long, value_name = "AXIS=VALUE", value_parser = plane, value_delimiter = ',')]
    pub slice: Vec<Plane>,
    /// The solid to measure and to plot; of several the sections are drawn together, hatched [default: all are
    /// measured, and the only one or the first obstacle of the scene is plotted]
    #[arg(short, long, value_name = "NAME", value_delimiter = ',')]
    pub solid: Vec<String>,
    /// Where the plot goes: .svg or .png [default: SOLID.AXIS=VALUE.svg; a sheet: slices.svg]
    #[arg(short, long, value_name = "FILE", requires = "slice")]
    pub output: Option<PathBuf>,
    /// Draw the plot in the terminal
    #[arg(long, requires = "slice", conflicts_with = "json")]
    pub term: bool,
    /// What the plot shows: ω, or the distance from the surface, of a mesh with 192 cells
    #[arg(long, value_enum, default_value_t = Plotted::Omega, hide_possible_values = true, value_name = "omega|distance", requires = "slice")]
    pub plot: Plotted,
    /// Arrows along −∇ω, the way out of the solid
    #[arg(long, requires = "slice")]
    pub arrows: bool,
    /// Part of the plane to plot: u0,v0,u1,v1 [default: around the solid]
    #[arg(long, value_name = "U0,V0,U1,V1", value_parser = window, allow_hyphen_values = true, requires = "slice")]
    pub window: Option<[f64; 4]>,
    /// Check again whenever a file changes
    #[arg(long)]
    pub watch: bool,
    /// Time at which moving solids are evaluated, in seconds or with a unit
    #[arg(long, value_name = "TIME", default_value_t = 0.0, value_parser = seconds, allow_negative_numbers = true)]
    pub time: f64,
    /// Time for measuring the solids of a file, in seconds or with a unit. Each gets an equal share, and what is left
    /// goes to those for which it was too little. What is not finished then is left out, and said. It does not hold for
    /// what scenes are asked, whose particles are placed
    #[arg(long, value_name = "TIME", default_value_t = 10.0, value_parser = seconds)]
    pub budget: f64,
    /// Treat warnings as errors: all of them (`warnings`), or those with a code (W0401); may be repeated
    #[arg(long, value_name = "WHICH", value_parser = deny)]
    pub deny: Vec<Deny>,
    /// How messages are written; other forms than `human` go to standard output, in place of the solids
    #[arg(long, value_enum, value_name = "FORM", default_value_t = MessageFormat::Human, conflicts_with = "json")]
    pub message_format: MessageFormat,
    /// Apply the fixes that do not change what a file means, then check it: `<` becomes `<=`, a missing `rfm 1` is
    /// added
    #[arg(long)]
    pub fix: bool,
    #[command(flatten)]
    pub sweep: SweepOptions,
    #[command(flatten)]
    pub again: Again,
}

/// What a slice shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Plotted {
    /// The value of the formula
    Omega,
    /// The distance from the surface, positive inside
    Distance,
}

/// How messages are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum MessageFormat {
    /// With the lines of the file, for people
    Human,
    /// One line each: FILE:LINE:COLUMN: severity[CODE]: message
    Short,
    /// One JSON object on each line
    Json,
    /// One SARIF document, for services that show findings
    Sarif,
    /// Commands of GitHub Actions, which show findings in the changes
    Github,
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
    /// Time at which moving solids are evaluated, in seconds or with a unit
    #[arg(long, value_name = "TIME", default_value_t = 0.0, value_parser = seconds, allow_negative_numbers = true)]
    pub time: f64,
    /// Columns to print, in this order
    #[arg(long, value_enum, value_delimiter = ',', default_value = "value,gradient")]
    pub what: Vec<What>,
    /// Width of all arithmetic [default: f64, or what the solid's tolerance allows for ω]
    #[arg(long, value_parser = precision())]
    pub precision: Option<Precision>,
}

/// A column of the output of `rfm eval`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum What {
    /// ω, positive inside
    Value,
    /// ∂ω/∂x, ∂ω/∂y, ∂ω/∂z
    Gradient,
    /// 1 inside, 0 on the surface, −1 outside
    Sign,
    /// Distance from the nearest point of the surface that was found, positive in the fluid
    Distance,
    /// Radius of a ball around the point that is proven not to meet the surface
    Clearance,
    /// Outward unit normal −∇ω/|∇ω|
    Normal,
}

#[derive(Debug, Clone, Args)]
pub(super) struct Mesh {
    /// The file; `-` is standard input. With --fluid the folder of a run
    pub file: PathBuf,
    /// The solid [default: the only one, or the first obstacle of the scene]
    #[arg(short, long, value_name = "NAME")]
    pub solid: Option<String>,
    // where the mesh goes; `output_help` writes the help, which lists the formats
    #[arg(short, long, value_name = "FILE", help = output_help())]
    pub output: Option<PathBuf>,
    /// Cells along the longest side
    #[arg(
        long,
        value_name = "N",
        default_value_t = 128,
        value_parser = cells,
        conflicts_with = "cell",
        allow_negative_numbers = true
    )]
    pub cells: usize,
    /// Size of a cell instead of their number, in metres or with a unit; with --fluid half the radius by
    /// default
    #[arg(long, value_name = "SIZE", allow_negative_numbers = true, value_parser = length)]
    pub cell: Option<f64>,
    /// Mesh this box instead of the solid's own bounds; the mesh is closed at its border
    #[arg(long = "box", value_name = "X0,Y0,Z0,X1,Y1,Z1", value_parser = aabb, allow_hyphen_values = true)]
    pub domain: Option<Aabb>,
    /// Time at which moving solids are evaluated, in seconds or with a unit
    #[arg(long, value_name = "TIME", default_value_t = 0.0, value_parser = seconds, allow_negative_numbers = true)]
    pub time: f64,
    /// How the surface is found
    #[arg(long, value_enum, default_value_t = MeshMethod::Dc)]
    pub method: MeshMethod,
    /// Contract thin triangles; all vertices stay on the surface
    #[arg(long)]
    pub no_slivers: bool,
    /// Contract edges as long as the mesh stays this near to the surface: a length as in 2mm, or a part of
    /// the mesh's diagonal as in 0.1%. The distance is measured; vertices stay on the surface. A mesh that is itself
    /// farther away stays as it is
    #[arg(long, value_name = "ERROR", value_parser = tolerance, allow_hyphen_values = true)]
    pub simplify: Option<Tolerance>,
    /// Time to look for what the mesh misses, in seconds or with a unit [default: 10 s, or three times that of meshing
    /// if it is longer]. --quality has as much, and all that it needs unless this is stated
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub budget: Option<f64>,
    /// Measure the mesh against the surface and the surface against the mesh: takes longer than meshing. With --budget
    /// it ends in time and says how much it has measured, unless --simplify needs all of it
    #[arg(long)]
    pub quality: bool,
    // the unit of the file's numbers; the help names those that there are
    #[arg(long, value_parser = unit_name(), value_name = "UNIT", help = unit_help())]
    pub unit: Option<LengthUnit>,
    // whether to write text; the help names the formats that can
    #[arg(long, help = ascii_help())]
    pub ascii: bool,
    /// Mesh the fluid: a closed surface around the particles of each frame that `rfm run` wrote
    #[arg(
        long,
        help_heading = "Fluid",
        conflicts_with_all = ["solid", "cells", "domain", "method", "no_slivers", "simplify", "quality", "sweep"]
    )]
    pub fluid: bool,
    /// Half the spacing of the particles [default: from the run's summary.json]
    #[arg(
        long,
        help_heading = "Fluid",
        value_name = "LENGTH",
        value_parser = length,
        requires = "fluid",
        allow_negative_numbers = true
    )]
    pub radius: Option<f64>,
    /// Only these frames, counted from 0; B is the first that is left out [default: all]
    #[arg(long, help_heading = "Fluid", value_name = "A..B", value_parser = frames, requires = "fluid")]
    pub frames: Option<Frames>,
    /// The format of the files [default: vtp, with a collection for ParaView]
    #[arg(long, help_heading = "Fluid", value_parser = format_name(), requires = "fluid")]
    pub format: Option<Format>,
    #[command(flatten)]
    pub sweep: SweepOptions,
    #[command(flatten)]
    pub again: Again,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum MeshMethod {
    /// Marching cubes with vertices on the exact surface: a third of the time at as many cells, but edges are
    /// cut off
    Mc,
    /// Dual contouring: also edges and corners are exact, so an eighth of the cells do for the same error
    Dc,
}

#[derive(Debug, Args)]
#[command(after_help = "In C:           rfm build examples/pawn.rfm -o pawn.c\n                \
                        cc -O3 -march=native -ffp-contract=off -fno-math-errno -fno-trapping-math -c pawn.c\n\
                        In Rust:        rfm build examples/pawn.rfm -o pawn.rs\n\
                        In a shader:    rfm build examples/pawn.rfm -o pawn.wgsl\n\
                        With a linker:  rfm build examples/pawn.rfm -o pawn.o --what sign,distance\n\n\
                        For a solid `pawn` a file has pawn_omega and pawn_omega_gradient, and with --what also pawn_sign and \
                        pawn_distance: for one point, and with _many for columns of points; in f64, and with f (C) or _f32 \
                        (Rust) at the end of the name in f32. Solids that move take the time as an argument. C and Rust \
                        give the bits of rfm if they are compiled as their first lines say; shaders compute in f32 and \
                        promise no bits. Beside a .c or .o file a header .h of the same name is written.")]
pub(super) struct Build {
    /// The file; `-` is standard input
    pub file: PathBuf,
    /// The solid [default: the only one, or the first obstacle of the scene]
    #[arg(short, long, value_name = "NAME")]
    pub solid: Option<String>,
    // where the text goes; `output_help` writes the help, which lists the targets
    #[arg(short, long, value_name = "FILE", help = languages())]
    pub output: Option<PathBuf>,
    /// Functions besides those of ω and ∇ω
    #[arg(long, value_enum, value_delimiter = ',')]
    pub what: Vec<BuildWhat>,
    /// Precisions of the functions [default: f64 and f32; shaders have f32 alone]
    #[arg(long, value_parser = precision(), value_delimiter = ',')]
    pub precision: Vec<Precision>,
    /// Whose sin, exp and so on are called
    #[arg(long, value_enum, default_value_t = BuildMath::System)]
    pub math: BuildMath,
    /// Keep the params of the file as arguments of the functions, in a structure, instead of constants. The sign and
    /// the surface are those of the file with these values. ω has the same bits where params are lengths and factors;
    /// its last ones may differ where a param is an angle of a rotation, and all of it off the surface where a param
    /// decides how far a repeated, lofted, twisted or rounded shape reaches. Gradients may round differently
    #[arg(long)]
    pub runtime_params: bool,
    /// The machine of an object file, as in x86_64-apple-darwin [default: this one, with all that its processor has]
    #[arg(long, value_name = "TRIPLE")]
    pub target: Option<String>,
    /// What all names begin with [default: the name of the solid]
    #[arg(long, value_name = "NAME")]
    pub prefix: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum BuildWhat {
    /// 1 inside, 0 on the surface, −1 outside
    Sign,
    /// Distance from the surface, positive outside: accurate near a face, an estimate far away, which no sign confirms, 0
    /// where nothing is known
    Distance,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum BuildMath {
    /// Those of the language: nothing else is needed, and their last bits differ between systems
    System,
    /// Those of rfm, with its bits: rfm_math_sin … of its C library, libm::sin … in Rust
    Rfm,
}

impl From<BuildMath> for rfm::source::Math {
    fn from(math: BuildMath) -> Self {
        match math {
            BuildMath::System => Self::System,
            BuildMath::Rfm => Self::Rfm,
        }
    }
}

#[derive(Debug, Clone, Args)]
pub(super) struct Run {
    /// The file; `-` is standard input
    pub file: PathBuf,
    /// The scene [default: the only one]
    #[arg(long, value_name = "NAME")]
    pub scene: Option<String>,
    /// Folder for frames, pictures and summary [default: the file's name + .out]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Stop after this many steps, counted from the run's beginning, whatever the scene says of the end
    #[arg(long, value_name = "N", conflicts_with = "until", value_parser = steps, allow_negative_numbers = true)]
    pub steps: Option<u64>,
    /// Stop at this simulated time, in seconds or with a unit: 500ms
    #[arg(long, value_name = "TIME", value_parser = seconds, allow_negative_numbers = true)]
    pub until: Option<f64>,
    /// Go on from the folder's last checkpoint; the scene's `run` block and probes may have changed. The result is that
    /// of a run without a stop, bit for bit, unless it had ended between two frames (--until): the last step was cut
    /// short there
    #[arg(long)]
    pub resume: bool,
    /// Replace the run that the folder holds
    #[arg(long, conflicts_with = "resume")]
    pub force: bool,
    /// Print what would be run, and run nothing; with --resume, what is left
    #[arg(long)]
    pub dry_run: bool,
    /// Refuse scenes with more obstacles than this: many parts are better joined with `or` into one solid
    #[arg(long, value_name = "N", default_value_t = 500)]
    pub most_obstacles: usize,
    /// Direction from the scene to the eye in pictures; also as the viewer copies it [default: the scene's, or
    /// 0.48,-1,0.46]
    #[arg(long, help_heading = "Pictures", value_name = "X,Y,Z", value_parser = camera, allow_hyphen_values = true)]
    pub camera: Option<Viewpoint>,
    /// Cut obstacles open at a plane, the side towards the eye being taken away; `auto` cuts those that hide much of
    /// the fluid where it begins, `none` none [default: the scene's, or auto]
    #[arg(long, help_heading = "Pictures", value_name = "AXIS=VALUE|auto|none", value_parser = cut)]
    pub cut: Option<CutFlag>,
    /// Do not draw an obstacle; may be repeated
    #[arg(long, help_heading = "Pictures", value_name = "NAME", value_delimiter = ',')]
    pub hide: Vec<String>,
    /// Draw an obstacle as clear glass, so that the fluid behind it is seen; a plane of --cut opens it; may be repeated
    #[arg(long, help_heading = "Pictures", value_name = "NAME", value_delimiter = ',')]
    pub glass: Vec<String>,
    /// Draw the surface of the fluid in place of its particles: `clear` shows what is in the fluid, `opaque` does not
    /// [default without a word: clear]
    #[arg(long, help_heading = "Pictures", value_name = "LOOK", num_args = 0..=1, require_equals = true, default_missing_value = "clear", value_enum)]
    pub surface: Option<Surface>,
    /// Write no pictures
    #[arg(long)]
    pub no_pictures: bool,
    /// Write no frames and no pictures
    #[arg(long)]
    pub no_frames: bool,
    /// Cells of the obstacle's mesh along its longest side
    #[arg(long, value_name = "N", default_value_t = 96, value_parser = cells, allow_negative_numbers = true)]
    pub mesh_cells: usize,
    #[command(flatten)]
    pub sweep: SweepOptions,
}

/// A type of numbers by its name.
fn precision() -> impl TypedValueParser<Value = Precision> {
    let precisions = [Precision::F32, Precision::F64];
    let unknown = "clap lets only the names of precisions through";
    PossibleValuesParser::new(precisions.map(Precision::name))
        .try_map(move |name| precisions.into_iter().find(|p| p.name() == name).ok_or(unknown))
}

#[derive(Debug, Args)]
pub(super) struct Explain {
    /// The code of a message (E0201), `codes` for a list of them; a word of the language or a key of a scene (twist,
    /// spacing), `words` for all of them; `outputs` for what a run writes, or a key of its summary; or a file,
    /// FILE:SOLID or FILE:SCENE
    #[arg(value_name = "CODE|WORD|FILE[:NAME]", required_unless_present = "methods")]
    pub subject: Option<String>,
    /// List the methods of the fluid solver, with the keys, units, defaults and passes of each, as Markdown
    #[arg(long, conflicts_with = "subject")]
    pub methods: bool,
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

#[derive(Debug, Args)]
#[command(help_template = HELP, override_usage = "rfm completions <SHELL>")]
#[command(after_help = "bash:  rfm completions bash > ~/.local/share/bash-completion/completions/rfm\n\
                        fish:  rfm completions fish > ~/.config/fish/completions/rfm.fish\n\
                        zsh:   rfm completions zsh > a file _rfm in a folder of $fpath")]
pub(super) struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub shell: Shell,
}

#[derive(Debug, Args)]
#[command(help_template = HELP, override_usage = "rfm man [DIR]")]
pub(super) struct Man {
    /// Folder for a page of each command [default: rfm's own page, on standard output]
    #[arg(value_name = "DIR")]
    pub folder: Option<PathBuf>,
}

/// The help of `rfm build --output`: the languages and their endings.
fn languages() -> String {
    let targets: Vec<String> =
        Target::ALL.iter().map(|target| format!(".{} {}", target.ending(), target.title())).collect();
    format!(
        "Where it goes; the ending chooses the language: {}; .o object code, with a header",
        targets.join("; ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_definition_is_consistent() {
        declaration().debug_assert();
    }
}
