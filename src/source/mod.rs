//! A solid as source text for other programs: C, CUDA, Rust, WGSL and GLSL, from one printer; and as
//! object code.
//!
//! ```
//! use rfm::{Program, source};
//!
//! let program = Program::from_source("post.rfm", "rfm 1\nsolid post = cylinder(0.5, 1)")?;
//! let target = source::Target::of_ending("wgsl").unwrap();
//! let text = source::write(&program.solid("post")?, target, &source::Options::default())?.text;
//! assert!(text.contains("fn post_omega(p: vec3<f32>) -> f32 {"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | file | what it holds |
//! |---|---|
//! | `program` | what is written: the graphs of ω, ω with ∇ω, sign and distance |
//! | `language` | the table of languages: numbers, declarations, functions |
//! | `operations` | R₀ and other operations that are functions of a file, each written once for all languages |
//! | `statements` | a graph as a list of declarations |
//! | `c`, `rust`, `shader` | whole files: heads, parameters, one point and columns |
//! | `c_header` | the headers of C files and object files, and the names of functions |
//! | `c_blocks`, `c_chunks` | long formulas of C in parts |
//! | `c_folds`, `c_links` | long formulas of C as chains |
//! | `c_calls`, `c_waves` | loops of C around the functions of the mathematical library, and its own sine and cosine |
//! | `c_room`, `c_table` | the columns of blocks of points, and the tables of steps over them |
//! | `march` | functions for a ray-marcher: sign, gradient and range of ω |
//! | `object` | object code with its header |
//! | `names` | which names a file may use |
//!
//! Invariant: a text has the operations of the machine code in the same order and the same numbers, so C and Rust
//! give its bits. Shaders compute in `f32` and promise no bits.

mod c;
mod c_blocks;
mod c_calls;
mod c_chunks;
mod c_folds;
mod c_header;
mod c_linkage;
mod c_links;
mod c_room;
mod c_table;
mod c_waves;
mod language;
mod march;
mod names;
mod object;
mod operations;
mod program;
mod rust;
mod shader;
mod statements;

pub use march::{Marched, marched};
pub use object::{Object, ObjectError, object};

use std::fmt;

use crate::precision::Precision;
use crate::solid::Solid;
use program::Program;

/// What a solid can be written as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// C99 for one translation unit, with a header of its declarations.
    C,
    /// C99 as one header with everything in it.
    Header,
    /// CUDA: the header, for host and device, with kernels.
    Cuda,
    /// Functions for a shader in WGSL.
    Wgsl,
    /// Functions for a shader in GLSL ES 3.0.
    Glsl,
    /// A module of Rust.
    Rust,
}

impl Target {
    /// Every target, in the order of messages.
    pub const ALL: [Self; 6] = [Self::C, Self::Header, Self::Cuda, Self::Wgsl, Self::Glsl, Self::Rust];

    /// The ending of its files.
    pub fn ending(self) -> &'static str {
        match self {
            Self::C => "c",
            Self::Header => "h",
            Self::Cuda => "cu",
            Self::Wgsl => "wgsl",
            Self::Glsl => "glsl",
            Self::Rust => "rs",
        }
    }

    /// The target whose files have an ending.
    pub fn of_ending(ending: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.ending() == ending)
    }

    /// What it is, in a few words.
    pub fn title(self) -> &'static str {
        match self {
            Self::C => "C99, with a header of the declarations",
            Self::Header => "C99 in one header",
            Self::Cuda => "CUDA, for host and device",
            Self::Wgsl => "functions for a WGSL shader",
            Self::Glsl => "functions for a GLSL ES 3.0 shader",
            Self::Rust => "a module of Rust",
        }
    }

    /// Whether it is for graphics processors alone, which compute in `f32`.
    pub fn is_shader(self) -> bool {
        matches!(self, Self::Wgsl | Self::Glsl)
    }
}

/// Whose sin, exp and so on a text calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Math {
    /// Those of the language: `sin` of C, `f64::sin` of Rust. Their last bits differ between systems.
    #[default]
    System,
    /// Those of `rfm`: `rfm_math_sin` in C, from the C library of `rfm`, and `libm::sin` in Rust, from the crate
    /// `libm`. They give the bits of `rfm`.
    Rfm,
}

/// A param that remains an argument of the functions.
#[derive(Debug, Clone, PartialEq)]
pub struct Param {
    /// Its name in the file.
    pub name: String,
    /// Its value in the file, in SI units.
    pub value: f64,
    /// What the file says of it.
    pub doc: Option<String>,
}

/// The params of a file that are constants in a text, for its head. `None` if there are none.
pub fn constants<'a>(params: impl IntoIterator<Item = (&'a str, f64)>) -> Option<String> {
    let values: Vec<String> = params.into_iter().map(|(name, value)| format!("{name} = {value:?}")).collect();
    (!values.is_empty()).then(|| format!("Params: {}.", values.join(", ")))
}

/// What users should know of params that were to stay open and cannot. `None` if there are none.
pub fn kept_constant(solid: &str, fixed: &[String]) -> Option<String> {
    let (decide, stay) = match fixed {
        [] => return None,
        [_] => ("decides", "stays"),
        _ => ("decide", "stay"),
    };
    let names: Vec<String> = fixed.iter().map(|name| format!("`{name}`")).collect();
    Some(format!("{} {decide} how `{solid}` is built and {stay} as in the file", names.join(", ")))
}

/// How a solid is written.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// What all names begin with; the name of the solid if it is `None`.
    pub prefix: Option<String>,
    /// Whether there is a function for the sign.
    pub sign: bool,
    /// Whether there is a function for the distance from the surface.
    pub distance: bool,
    /// The precisions of the functions; both if it is empty. Shaders have `f32` alone.
    pub precisions: Vec<Precision>,
    /// Whose functions are called.
    pub math: Math,
    /// What `Parameter(i)` of the solid's graph stands for. Empty if all params are constants.
    pub params: Vec<Param>,
    /// Lines for the head of the text: where it comes from.
    pub origin: Vec<String>,
}

/// What has been written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// The text of the file.
    pub text: String,
    /// The header that belongs to it, where it needs one.
    pub header: Option<String>,
    /// How many operations the largest function has.
    pub operations: usize,
}

/// Why a solid cannot be written.
#[derive(Debug, Clone, PartialEq)]
pub enum SourceError {
    /// A prefix that no language would accept.
    BadPrefix(String),
    /// A constant of the formula that shaders cannot hold in `f32`.
    NumberOutOfRange(f64),
    /// A precision that the target does not have.
    NoSuchPrecision(Target, Precision),
    /// A shader has no other functions than its own.
    NoSuchMath(Target),
    /// The solid has a part that is looked up in a table, such as a mesh from a file.
    Table,
}

impl fmt::Display for SourceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BadPrefix(prefix) => write!(
                f,
                "names cannot begin with `{prefix}`: give a prefix of ASCII letters, digits and single underscores that \
                 begins with a letter"
            ),
            Self::NumberOutOfRange(value) => write!(
                f,
                "the formula has the number {value:e}, which f32 cannot hold, and a shader has no f64: write C, or scale \
                 the formula"
            ),
            Self::NoSuchPrecision(target, precision) => write!(
                f,
                "a .{} file cannot compute in {}: shaders have f32 alone",
                target.ending(),
                precision.name()
            ),
            Self::NoSuchMath(target) => write!(
                f,
                "a .{} file calls the functions of the shader language: the bits of rfm are for c, h, cu and rs",
                target.ending()
            ),
            Self::Table => f.write_str(
                "the solid has a part that is no formula, such as the mesh of a file: `rfm mesh` writes its surface, and \
                 programs can call the library",
            ),
        }
    }
}

impl std::error::Error for SourceError {}

/// Writes a solid as source text.
///
/// # Errors
/// If the target has no such precision or functions, or cannot hold a number of the formula, or if no name may begin
/// with the prefix, or if a part of the solid is no formula.
pub fn write(solid: &Solid, target: Target, options: &Options) -> Result<Source, SourceError> {
    if target.is_shader() {
        if options.precisions.contains(&Precision::F64) {
            return Err(SourceError::NoSuchPrecision(target, Precision::F64));
        }
        if options.math == Math::Rfm {
            return Err(SourceError::NoSuchMath(target));
        }
    }
    in_file(solid, target.is_shader(), options, |file| {
        let operations = file.programs.iter().map(Program::operations).max().unwrap_or(0);
        let (text, header) = match target {
            Target::C => (c::source(file, c::Flavour::Unit)?, Some(c_header::header(file))),
            Target::Header => (c::source(file, c::Flavour::Header)?, None),
            Target::Cuda => (c::source(file, c::Flavour::Cuda)?, None),
            Target::Wgsl => (shader::source(file, &shader::WGSL)?, None),
            Target::Glsl => (shader::source(file, &shader::GLSL)?, None),
            Target::Rust => (rust::source(file)?, None),
        };
        Ok(Source { text, header, operations })
    })?
}

/// Calls `make` with what a file is written from.
fn in_file<R>(
    solid: &Solid,
    in_f32_alone: bool,
    options: &Options,
    make: impl FnOnce(&File<'_>) -> R,
) -> Result<R, SourceError> {
    let (graph, root) = solid.formula();
    if graph.has_lookups(&[root]) {
        return Err(SourceError::Table);
    }
    let prefix = names::prefix(options.prefix.as_deref().unwrap_or(solid.name()))?;
    let wanted = |precision: &Precision| match options.precisions.is_empty() {
        true => *precision == Precision::F32 || !in_f32_alone,
        false => options.precisions.contains(precision),
    };
    let precisions: Vec<Precision> = [Precision::F64, Precision::F32].into_iter().filter(wanted).collect();
    let programs = Program::of(solid, options);
    Ok(make(&File {
        prefix: &prefix,
        solid: solid.name(),
        moves: solid.moves(),
        params: open_params(&programs, options),
        options,
        precisions: &precisions,
        programs: &programs,
    }))
}

/// All that a file is written from.
struct File<'a> {
    prefix: &'a str,
    solid: &'a str,
    moves: bool,
    /// The params that are arguments.
    params: Vec<OpenParam<'a>>,
    options: &'a Options,
    precisions: &'a [Precision],
    programs: &'a [Program],
}

/// What a text says of its params.
const PARAMS: &str = "The params of the file, in SI units. Nothing checks them against the ranges that the file states. The surface is \
     that of the file with these values; off it, omega may be another field where a param decides how far a shape reaches.";

/// A param that is an argument, because the solid depends on it.
struct OpenParam<'a> {
    /// Its number in the graphs.
    number: u32,
    /// Its name in a text.
    field: String,
    param: &'a Param,
}

fn open_params<'a>(programs: &[Program], options: &'a Options) -> Vec<OpenParam<'a>> {
    let mut numbers: Vec<u32> = programs.iter().flat_map(Program::parameters).collect();
    numbers.sort_unstable();
    numbers.dedup();
    let fields = names::fields(&options.params);
    let named = numbers.into_iter().filter_map(|number| Some((number, options.params.get(number as usize)?)));
    named.map(|(number, param)| OpenParam { number, field: fields[number as usize].clone(), param }).collect()
}

impl File<'_> {
    /// How a text names a param.
    fn field(&self, number: u32) -> &str {
        let open = self.params.iter().find(|open| open.number == number);
        open.map_or_else(|| unreachable!("param {number} is a constant"), |open| open.field.as_str())
    }

    /// The first lines of every file, without the signs of a comment.
    fn title(&self) -> Vec<String> {
        let mut lines = vec![format!(
            "{}: omega(x, y, z), positive inside the solid, 0 on its surface, negative outside.",
            self.solid
        )];
        lines.extend(self.options.origin.iter().cloned());
        lines
    }
}
