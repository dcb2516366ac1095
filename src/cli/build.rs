//! `rfm build`: a solid as source text or object code for other programs, in the language that the file's ending
//! names.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::args::{Build as Options, BuildWhat};
use super::failure::{Failure, note};
use super::shared::Shared;
use super::{choose, input, output};
use crate::cli::output::Shown;
use rfm::codegen::CodegenError;
use rfm::diagnostic::{Code, Diagnostic, Diagnostics};
use rfm::ir::Expr;
use rfm::source::{self, ObjectError, Param, Target};
use rfm::{Program, Solid};

/// Functions with more operations than this take compilers of shaders and of Rust seconds to minutes.
const MANY_OPERATIONS: usize = 5000;

/// What stands in every text that this command writes.
const MADE: &str = "Made by rfm";

/// What a file can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Source(Target),
    Object,
}

pub(super) fn run(shared: &Shared, options: &Options) -> Result<(), Failure> {
    let path = options.output.as_deref().ok_or_else(no_output)?;
    let kind = kind(path)?;
    if options.target.is_some() && kind != Kind::Object {
        return Err(Failure::usage("--target is for .o files: source text is the same for all machines"));
    }
    let program = input::program(shared, &options.file)?;
    output::keep_inputs(path)?;
    let solid = choose::solid(shared, &program, options.solid.as_deref())?;
    if let Some(diagnostics) = without_formulas(&program, &solid) {
        input::show(&diagnostics);
        return Err(Failure::Findings);
    }
    let opened = if options.runtime_params { Some(open(&program, &solid)?) } else { None };
    let text_options = text_options(&program, &solid, options, opened.as_ref());
    let solid = opened.map_or(solid, |opened| opened.solid);
    let made = match kind {
        Kind::Source(target) => {
            let made =
                source::write(&solid, target, &text_options).map_err(|error| advised(&error, &solid))?;
            Made { bytes: made.text.into_bytes(), header: made.header, operations: made.operations }
        }
        Kind::Object => {
            let made = source::object(&solid, &text_options, options.target.as_deref());
            let made = made.map_err(|error| match error {
                ObjectError::Source(error) => advised(&error, &solid),
                ObjectError::Codegen(error) => no_machine(&error, options.target.as_deref()),
            })?;
            Made { bytes: made.bytes, header: Some(made.header), operations: made.operations }
        }
    };
    let beside = path.with_extension("h");
    if made.header.is_some() {
        output::keep_inputs(&beside)?;
        may_replace(&beside)?;
    }
    output::write(path, |out| out.write_all(&made.bytes))?;
    let mut files = vec![path.to_path_buf()];
    if let Some(header) = &made.header {
        output::write(&beside, |out| out.write_all(header.as_bytes()))?;
        files.push(beside);
    }
    if made.operations > MANY_OPERATIONS && !matches!(kind, Kind::Source(Target::C | Target::Header)) {
        note(format!(
            "`{}` has {} operations in straight lines, which may take its compiler minutes; .c and .h have them in \
             loops",
            solid.name(),
            made.operations
        ));
    }
    report(shared, &solid, &files, made.operations)
}

/// A message for each part of a solid that is looked up in a table; `None` if all of it is formulas.
fn without_formulas(program: &Program, solid: &Solid) -> Option<Diagnostics> {
    let module = program.module();
    let root = module.solids.iter().find(|known| known.name == solid.name())?.node;
    let used = module.graph.reachable(&[root]);
    let lookups = module.graph.nodes().filter(|(node, _)| used[node.index()]);
    let mut list: Vec<Diagnostic> = lookups
        .filter_map(|(node, expr)| {
            let Expr::Lookup(lookup, _) = expr else { return None };
            let what = module.graph.tables()[lookup.table as usize].what();
            let message = format!("`{}` cannot be written as source: it has {what}", solid.name());
            let help = "`rfm mesh` writes its surface, and programs in Rust, C and Python evaluate it through the library";
            let diagnostic = Diagnostic::error(Code::NO_FORMULA, module.graph.span(node)?, message);
            Some(diagnostic.at("looked up in a table, which is no formula").help(help))
        })
        .collect();
    // copies of one part are one mistake
    let mut seen = std::collections::HashSet::new();
    list.retain(|diagnostic| seen.insert(diagnostic.primary.span.range()));
    (!list.is_empty()).then(|| Diagnostics { list, sources: program.sources().to_vec().into() })
}

/// Refuses to replace a header that this command has not made, because the user did not name it.
fn may_replace(header: &Path) -> Result<(), Failure> {
    match std::fs::read_to_string(header) {
        Ok(text) if !text.contains(MADE) => Err(Failure::usage(format!(
            "`{}` would be replaced by the header that belongs to the file, and it is not one of ours: choose another name",
            header.shown()
        ))),
        // a header of ours, none, or one whose writing will say what is wrong
        Ok(_) | Err(_) => Ok(()),
    }
}

/// What is written to files.
struct Made {
    bytes: Vec<u8>,
    header: Option<String>,
    operations: usize,
}

/// A solid with its params as arguments.
struct Opened {
    solid: Solid,
    params: Vec<Param>,
    /// Those that remain constants.
    fixed: Vec<String>,
}

fn open(program: &Program, solid: &Solid) -> Result<Opened, Failure> {
    let (opened, fixed) = program.with_open_params_of([solid.name()]).map_err(choose::usage)?;
    let solid = opened.solid_with(solid.name(), rfm::Engine::Interpreter).map_err(choose::usage)?;
    if let Some(message) = source::kept_constant(solid.name(), &fixed) {
        note(message);
    }
    let params = opened.module().params.iter();
    let params = params.map(|p| Param { name: p.name.clone(), value: p.value, doc: p.doc.clone() });
    Ok(Opened { solid, params: params.collect(), fixed })
}

/// The failure of a target that there is no code generator for.
fn no_machine(error: &CodegenError, target: Option<&str>) -> Failure {
    match target {
        Some(target) => Failure::usage(format!(
            "cannot make object code for `{target}`: {error}; a .c file can be compiled for any machine"
        )),
        None => Failure::usage(error),
    }
}

/// What is written, as JSON.
#[derive(Serialize)]
struct Summary<'a> {
    schema: u32,
    solid: &'a str,
    files: Vec<String>,
    operations: usize,
}

fn report(shared: &Shared, solid: &Solid, files: &[PathBuf], operations: usize) -> Result<(), Failure> {
    let shown: Vec<String> = files.iter().map(|file| file.shown()).collect();
    if shared.json {
        return output::json(&Summary { schema: 1, solid: solid.name(), files: shown, operations });
    }
    say!("{}: {operations} operations, written to {}", solid.name(), shown.join(" and "));
    Ok(())
}

/// How the solid is written.
fn text_options(
    program: &Program,
    solid: &Solid,
    options: &Options,
    opened: Option<&Opened>,
) -> source::Options {
    let file = options.file.shown();
    let mut origin =
        vec![format!("{MADE} {} from {file}, solid {}.", env!("CARGO_PKG_VERSION"), solid.name())];
    let is_constant = |name: &String| opened.is_none_or(|opened| opened.fixed.contains(name));
    let params = program.params().iter().filter(|param| is_constant(&param.name));
    origin.extend(source::constants(params.map(|param| (&*param.name, param.value))));
    origin.extend(
        opened.and_then(|opened| source::kept_constant(solid.name(), &opened.fixed)).map(|kept| kept + "."),
    );
    let params = opened.map_or_else(Vec::new, |opened| opened.params.clone());
    source::Options {
        prefix: options.prefix.clone(),
        sign: options.what.contains(&BuildWhat::Sign),
        distance: options.what.contains(&BuildWhat::Distance),
        precisions: options.precision.clone(),
        math: options.math.into(),
        params,
        origin: origin.into_iter().map(|line| line.replace("*/", "* /")).collect(),
    }
}

/// What the ending of a path asks for.
fn kind(path: &Path) -> Result<Kind, Failure> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if ending == "o" {
        return Ok(Kind::Object);
    }
    Target::of_ending(&ending).map(Kind::Source).ok_or_else(|| {
        Failure::usage(format!(
            "cannot tell the language of `{}`: the ending must be {}",
            path.shown(),
            endings()
        ))
    })
}

fn endings() -> String {
    let endings: Vec<String> = Target::ALL.iter().map(|target| format!(".{}", target.ending())).collect();
    format!("{} or .o", endings.join(", "))
}

fn no_output() -> Failure {
    Failure::usage(format!("no output: give -o FILE with the ending {}", endings()))
}

/// The error with what helps on the command line.
fn advised(error: &source::SourceError, solid: &Solid) -> Failure {
    use source::SourceError;
    Failure::usage(match error {
        SourceError::BadPrefix(prefix) if prefix == solid.name() => {
            format!("{error}, by --prefix")
        }
        SourceError::NoSuchPrecision(..) => format!("{error}; leave out --precision"),
        SourceError::NoSuchMath(..) => format!("{error}; leave out --math"),
        SourceError::BadPrefix(_) | SourceError::NumberOutOfRange(_) | SourceError::Table => {
            error.to_string()
        }
    })
}
