//! An open file: its text, and the positions that an editor counts in it.

use std::sync::Arc;

use lsp_types::{Position, PositionEncodingKind, Range, Uri};

use rfm::Program;
use rfm::compile::{files_beside, text_of};
use rfm::diagnostic::{Diagnostics, Source, Span};
use rfm::files::Files;
use rfm::lower::Options;
use rfm::syntax::{self, Ast};

use super::names::Names;

/// In what the editor counts along a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Utf8,
    /// What every editor understands.
    Utf16,
}

impl Encoding {
    /// UTF-8 if the editor offers it.
    pub fn chosen(offered: Option<&[PositionEncodingKind]>) -> Self {
        let utf8 = offered.is_some_and(|kinds| kinds.contains(&PositionEncodingKind::UTF8));
        if utf8 { Self::Utf8 } else { Self::Utf16 }
    }

    pub fn kind(self) -> PositionEncodingKind {
        match self {
            Self::Utf8 => PositionEncodingKind::UTF8,
            Self::Utf16 => PositionEncodingKind::UTF16,
        }
    }

    fn width(self, text: &str) -> u32 {
        match self {
            Self::Utf8 => text.len() as u32,
            Self::Utf16 => text.encode_utf16().count() as u32,
        }
    }
}

/// An open file with all that follows from its text.
pub(super) struct Document {
    pub source: Source,
    pub ast: Ast,
    /// What there is to say, errors and warnings.
    pub messages: Diagnostics,
    /// The compiled file; `None` if it has errors.
    pub program: Option<Program>,
    pub names: Names,
    encoding: Encoding,
    /// The first byte of each line.
    lines: Vec<usize>,
}

impl Document {
    /// Reads a text as the compiler does.
    pub fn new(uri: &Uri, text: String, encoding: Encoding) -> Self {
        let text: Arc<str> = text.into();
        let path = uri.path().as_estr().decode().into_string_lossy();
        let source = Source::file(&*path, text.clone());
        let (program, ast, messages) = match Program::check(source.clone(), options(&source)) {
            Ok(program) => {
                let (ast, warnings) = (program.ast().clone(), program.warnings());
                (Some(program), ast, warnings)
            }
            // the items without a mistake are known all the same
            Err(messages) => (None, syntax::parse(&source).0, messages),
        };
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        let names = Names::of(&ast);
        Self { source, ast, messages, program, names, encoding, lines }
    }

    pub fn text(&self) -> &str {
        &self.source.text
    }

    /// The byte at a position; one beyond its line counts as the end of the line.
    pub fn byte(&self, position: Position) -> usize {
        let text = self.text();
        let Some(&start) = self.lines.get(position.line as usize) else { return text.len() };
        let line = text[start..].split('\n').next().unwrap_or("");
        let line = line.strip_suffix('\r').unwrap_or(line);
        let mut before = 0;
        for (at, c) in line.char_indices() {
            if before >= position.character {
                return start + at;
            }
            before += self.encoding.width(c.encode_utf8(&mut [0; 4]));
        }
        start + line.len()
    }

    /// The position of a byte; one within a character counts as its beginning.
    pub fn position(&self, byte: usize) -> Position {
        let text = self.text();
        let mut byte = byte.min(text.len());
        while !text.is_char_boundary(byte) {
            byte -= 1;
        }
        let line = self.lines.partition_point(|&start| start <= byte) - 1;
        Position::new(line as u32, self.encoding.width(&text[self.lines[line]..byte]))
    }

    pub fn range(&self, bytes: std::ops::Range<usize>) -> Range {
        Range::new(self.position(bytes.start), self.position(bytes.end))
    }

    pub fn span(&self, span: Span) -> Range {
        self.range(span.range())
    }

    pub fn whole(&self) -> Range {
        self.range(0..self.text().len())
    }

    /// A file that this one imports, by the path that is written; `None` if it cannot be read.
    pub fn imported(&self, path: &str) -> Option<Source> {
        let name = Files::name(path, &self.source.name);
        let bytes = options(&self.source).files.read(&name).ok()?;
        Some(Source::file(name, text_of(bytes.to_vec()).ok()?))
    }

    /// The file with more text at its end, if that compiles.
    pub fn with(&self, more: &str) -> Option<Program> {
        let text = format!("{}\n{more}\n", self.text());
        Program::check(Source::file(self.source.name.clone(), text), options(&self.source)).ok()
    }
}

/// A file may name those in its folder, as for the other commands.
fn options(source: &Source) -> Options {
    Options { files: files_beside(&*source.name, false), ..Options::default() }
}
