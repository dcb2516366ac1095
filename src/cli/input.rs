//! Reads the file of a command from a path or from standard input, with params from flags. Messages go to
//! standard error.

use std::io::{Error, ErrorKind, IsTerminal, Read};
use std::path::Path;

use serde::Serialize;

use super::failure::{Failure, note};
use super::flag_of_name;
use super::message::{Message, message};
use super::shared::Shared;
use crate::cli::output::{self, Shown};
use rfm::Program;
use rfm::compile::{files_beside, text_of};
use rfm::diagnostic::{Code, Diagnostics, Source, Style, nearest, render};
use rfm::files::Files;
use rfm::lower::Options;

/// The text of a file, with the name that messages give it.
pub(super) fn read(path: &Path) -> Result<Source, Failure> {
    let name = if path == Path::new("-") { "<stdin>".to_string() } else { path.display().to_string() };
    let limit = Source::MAX_LEN as u64 + 1;
    let mut bytes = Vec::new();
    let result = if path == Path::new("-") {
        std::io::stdin().lock().take(limit).read_to_end(&mut bytes)
    } else {
        std::fs::File::open(path).and_then(|file| file.take(limit).read_to_end(&mut bytes))
    };
    let text = result.and_then(|_| text_of(bytes)).map_err(|error| unreadable(path, &error))?;
    output::remember_input(path);
    Ok(Source::file(name, text))
}

/// Why a file cannot be read.
fn unreadable(path: &Path, error: &Error) -> Failure {
    if path == Path::new("-") {
        return Failure::usage(format!("cannot read `<stdin>`: {error}"));
    }
    match error.kind() {
        ErrorKind::NotFound => missing(path),
        ErrorKind::IsADirectory => {
            Failure::usage(format!("`{}` is a folder: name a file in it", path.shown()))
        }
        _ => Failure::usage(format!("cannot read `{}`: {error}", path.shown())),
    }
}

/// The failure for a path at which there is neither a file nor a folder.
pub(super) fn missing(path: &Path) -> Failure {
    // as `rfm explain` takes them
    let shown = path.shown();
    if let Some((file, name)) = shown.rsplit_once(':').filter(|(file, _)| Path::new(file).is_file()) {
        let hint =
            format!("a solid of `{file}` is chosen by `--solid {name}`, and a scene by `--scene {name}`");
        return Failure::usage(format!("there is no file `{shown}`; {hint}"));
    }
    if let Some((flag, file)) = flag_of_name(&shown) {
        return Failure::usage(format!(
            "there is no file `{shown}`; what has this name in `{file}` is chosen by `{flag} {shown}`"
        ));
    }
    let with_ending =
        Some(path.with_extension("rfm")).filter(|other| path.extension().is_none() && other.is_file());
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let beside = std::fs::read_dir(folder.unwrap_or(Path::new("."))).into_iter().flatten().flatten();
    let names: Vec<String> = beside.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    let written = path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
    let near = nearest(&written, names.iter().map(String::as_str));
    let near = with_ending.or_else(|| near.map(|name| path.with_file_name(name))).map(|near| near.shown());
    let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    Failure::usage(format!("there is no file `{}`{hint}", path.shown()))
}

/// The files that a source may name: those in its folder, or in the current one for standard input.
pub(super) fn files(shared: &Shared, source: &Source) -> Files {
    files_beside(&*source.name, shared.allow_outside)
}

/// Checks a source with the params of the command line.
pub(super) fn check(shared: &Shared, source: Source, files: Files) -> Result<Program, Diagnostics> {
    let overrides = shared.define.iter().map(|given| (given.name.clone(), given.value)).collect();
    let (dimensions, places) = (shared.dimensions(), shared.places());
    let max_nodes = shared.max_nodes;
    let options =
        Options { overrides, dimensions, places, max_nodes, files: files.clone(), ..Options::default() };
    let checked = Program::check(source, options);
    files.asked().iter().for_each(|name| output::remember_input(Path::new(name)));
    checked
}

/// Reads and checks a file, and prints its messages.
pub(super) fn program(shared: &Shared, path: &Path) -> Result<Program, Failure> {
    let source = match read(path) {
        Ok(source) => source,
        Err(Failure::Usage(reason)) => {
            refusal(shared, vec![Message::of_command(path, &reason)])?;
            return Err(Failure::Usage(reason));
        }
        Err(other) => return Err(other),
    };
    let files = files(shared, &source);
    match check(shared, source, files) {
        Ok(program) => {
            show(&program.warnings());
            Ok(program)
        }
        Err(diagnostics) => {
            match shared.json {
                true => refusal(shared, diagnostics.list.iter().map(|d| message(d, &diagnostics)).collect())?,
                false => show(&diagnostics),
            }
            Err(failure(&diagnostics))
        }
    }
}

/// The document of a command whose file is refused, as far as it is that of `rfm check`.
#[derive(Serialize)]
struct Refusal {
    schema: u32,
    ok: bool,
    diagnostics: Vec<Message>,
}

/// Prints the document of a file that is refused, if documents are asked for.
fn refusal(shared: &Shared, diagnostics: Vec<Message>) -> Result<(), Failure> {
    if shared.json { output::json(&Refusal { schema: 1, ok: false, diagnostics }) } else { Ok(()) }
}

/// The failure of a file with errors, or of flags that set what the file does not allow.
pub(super) fn failure(diagnostics: &Diagnostics) -> Failure {
    let errors = || diagnostics.list.iter().filter(|d| d.severity == rfm::diagnostic::Severity::Error);
    if errors().all(|d| d.code == Code::OVERRIDE) {
        return Failure::Params;
    }
    Failure::Findings
}

/// The most messages that are printed as text. `--json` lists all.
const MOST_SHOWN: usize = 100;

pub(super) fn show(diagnostics: &Diagnostics) {
    if diagnostics.list.is_empty() {
        return;
    }
    if diagnostics.list.len() > MOST_SHOWN {
        let first = diagnostics.list[..MOST_SHOWN].to_vec();
        show(&Diagnostics { list: first, sources: diagnostics.sources.clone() });
        note(format!("{} more messages are not shown", diagnostics.list.len() - MOST_SHOWN));
        return;
    }
    // anstream removes colours where they are not wanted; line drawing characters are for terminals only
    let style = if std::io::stderr().is_terminal() { Style::Terminal } else { Style::Plain };
    anstream::eprint!("{}", render(diagnostics, style));
}
