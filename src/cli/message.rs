//! A message of the compiler as other programs read it.

use std::path::Path;

use serde::Serialize;

use rfm::diagnostic::{Code, Diagnostic, Diagnostics, Severity, Source, Span};

/// A message as other programs read it.
#[derive(Debug, Serialize)]
pub(super) struct Message {
    pub code: &'static str,
    pub severity: String,
    pub message: String,
    pub file: String,
    pub line: usize,
    pub column: usize,
    pub end_line: usize,
    pub end_column: usize,
    pub help: Option<String>,
    /// The edit that does what the help says. Null if only a person can do it.
    pub fix: Option<Fix>,
}

#[derive(Debug, Serialize)]
pub(super) struct Fix {
    pub line: usize,
    pub column: usize,
    pub end_line: usize,
    pub end_column: usize,
    pub replacement: String,
    /// Whether `--fix` applies it.
    pub safe: bool,
}

impl Message {
    /// Why a command could not do what it was asked to with a file; it is about no place in it.
    pub fn of_command(path: &Path, reason: &str) -> Self {
        Self {
            code: Code::COMMAND.0,
            severity: Severity::Error.to_string(),
            message: reason.to_string(),
            file: if path == Path::new("-") { "<stdin>".into() } else { path.display().to_string() },
            line: 1,
            column: 1,
            end_line: 1,
            end_column: 1,
            help: None,
            fix: None,
        }
    }
}

/// A message with its place.
pub(super) fn message(diagnostic: &Diagnostic, all: &Diagnostics) -> Message {
    let source = all.source(diagnostic.primary.span.source);
    let place = |span: Span| {
        let at = |byte: u32| {
            source.map_or((1, 1), |s| {
                let p = Source::position(s, byte as usize);
                (p.line, p.column)
            })
        };
        (at(span.start), at(span.end))
    };
    let ((line, column), (end_line, end_column)) = place(diagnostic.primary.span);
    let fix = source.and_then(|source| diagnostic.edit_of(source)).map(|edit| {
        let ((line, column), (end_line, end_column)) = place(edit.span);
        Fix { line, column, end_line, end_column, replacement: edit.replacement.clone(), safe: edit.is_safe }
    });
    Message {
        code: diagnostic.code.0,
        severity: diagnostic.severity.to_string(),
        message: diagnostic.message.clone(),
        file: source.map_or_else(String::new, |s| s.name.to_string()),
        line,
        column,
        end_line,
        end_column,
        help: diagnostic.help.clone(),
        fix,
    }
}
