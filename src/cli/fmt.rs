//! `rfm fmt`: files in their layout.

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use serde::Serialize;
use similar::TextDiff;

use super::failure::{Failure, complain};
use super::message::{Message, message};
use super::shared::Shared;
use super::{input, output};
use crate::cli::output::Shown;
use rfm::diagnostic::{Diagnostics, Source, printable};
use rfm::syntax::{Spelling, format};

#[derive(Debug, Args)]
#[command(after_help = "Lay out a file in place:       rfm fmt obstacle.rfm\n\
                        See what would change:         rfm fmt --diff obstacle.rfm\n\
                        In continuous integration:     rfm fmt --check *.rfm\n\
                        From an editor:                rfm fmt - < obstacle.rfm\n\
                        As mathematics:                rfm fmt --unicode obstacle.rfm\n\n\
                        Line breaks are yours: lines are neither joined nor wrapped, and one empty line stays between groups.\n\
                        Columns stay where lines share them: `=`, ranges, descriptions and comments of neighbouring lines that\n\
                        you put under each other, and wrapped lines under what they go on with. All other blanks are laid out\n\
                        anew. Values never change: the result is read again and compared before anything is written.\n\n\
                        A file with a syntax error is left as it is; the error is shown, and the exit code is 1.")]
pub(super) struct Fmt {
    /// Files to lay out; `-` reads standard input and writes to standard output
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Write nothing; name the files that would change, and exit with 1 if there are any
    #[arg(long)]
    pub check: bool,
    /// Write nothing; show what would change, and exit with 1 if anything would
    #[arg(long)]
    pub diff: bool,
    /// Write operators as signs: ∧ ∨ ¬ ∖ ≤ ≥ ² ³
    #[arg(long, conflicts_with = "ascii")]
    pub unicode: bool,
    /// Write operators in ASCII: and or not \ <= >= ^2 ^3; the · between units has no other spelling
    #[arg(long)]
    pub ascii: bool,
}

#[derive(Serialize)]
struct Document {
    schema: u32,
    ok: bool,
    /// Why files cannot be laid out.
    diagnostics: Vec<Message>,
    files: Vec<Outcome>,
}

#[derive(Serialize)]
struct Outcome {
    file: String,
    /// Whether the layout differs from the text. Null if the file has a syntax error or cannot be read or written.
    changed: Option<bool>,
}

pub(super) fn run(shared: &Shared, options: &Fmt) -> Result<(), Failure> {
    let mut document = Document { schema: 1, ok: true, diagnostics: Vec::new(), files: Vec::new() };
    let mut usage = None;
    for path in &options.files {
        let changed = match one(shared, options, path, &mut document.diagnostics) {
            Ok(changed) => Some(changed),
            Err(Failure::Findings) => {
                document.ok = false;
                None
            }
            Err(Failure::Usage(message)) => {
                document.ok = false;
                document.diagnostics.push(Message::of_command(path, &message));
                // the other files are laid out all the same
                usage.replace(message).iter().for_each(|earlier| complain(earlier));
                None
            }
            Err(other) => return Err(other),
        };
        document.ok &= changed == Some(false) || !(options.check || options.diff);
        document.files.push(Outcome { file: path.display().to_string(), changed });
    }
    if shared.json {
        output::json(&document)?;
    } else if !options.check && !options.diff {
        summarise(&document.files);
    }
    match usage {
        Some(message) => Err(Failure::Usage(message)),
        None if document.ok => Ok(()),
        None => Err(Failure::Findings),
    }
}

/// Says how many files were laid out. Standard input has its text as the answer.
fn summarise(files: &[Outcome]) {
    let of = |changed| files.iter().filter(|file| file.file != "-" && file.changed == Some(changed)).count();
    let count = |n: usize| format!("{n} file{}", if n == 1 { "" } else { "s" });
    let parts = [(of(true), "laid out"), (of(false), "unchanged")];
    let parts: Vec<String> =
        parts.iter().filter(|part| part.0 > 0).map(|(n, what)| format!("{} {what}", count(*n))).collect();
    if !parts.is_empty() {
        say!("{}", parts.join(", "));
    }
}

/// Lays out one file. Returns whether its text differs from its layout.
fn one(shared: &Shared, options: &Fmt, path: &Path, messages: &mut Vec<Message>) -> Result<bool, Failure> {
    let source = input::read(path)?;
    let spelling = match (options.unicode, options.ascii) {
        (true, _) => Spelling::Unicode,
        (_, true) => Spelling::Ascii,
        _ => Spelling::Written,
    };
    let text = format(&source, spelling).map_err(|list| {
        let found = Diagnostics { list, sources: Arc::from([source.clone()]) };
        match shared.json {
            true => messages.extend(found.list.iter().map(|d| message(d, &found))),
            false => input::show(&found),
        }
        Failure::Findings
    })?;
    let changed = *source.text != *text;
    let is_stdin = path == Path::new("-");
    if options.diff {
        if changed && !shared.json {
            difference(&source, &text)?;
        }
    } else if options.check {
        if changed && !shared.json {
            say!("{}", path.shown());
        }
    } else if is_stdin {
        if !shared.json {
            io::stdout().lock().write_all(text.as_bytes())?;
        }
    } else if changed {
        output::replace(path, &text)?;
    }
    Ok(changed)
}

/// Prints what would change, as `patch` reads it.
fn difference(source: &Source, text: &str) -> Result<(), Failure> {
    let lines = TextDiff::from_lines(&*source.text, text);
    let shown = lines.unified_diff().context_radius(3).header(&source.name, &source.name).to_string();
    let out = io::stdout();
    if out.is_terminal() {
        // a terminal must not obey what a file holds
        out.lock().write_all(printable(&shown).as_bytes())?;
    } else {
        out.lock().write_all(shown.as_bytes())?;
    }
    Ok(())
}
