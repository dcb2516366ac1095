//! An open file: its text, and all that follows from it.

use std::sync::Arc;

use lsp_types::{Position, Range, Uri};

use rfm::Program;
use rfm::compile::text_of;
use rfm::diagnostic::{Diagnostics, Source, Span};
use rfm::files::Files;
use rfm::lower::Options;
use rfm::syntax;

use super::buffers::Buffers;
use super::reading::{Encoding, Reading, path_of};

/// An open file with all that follows from its text.
pub(super) struct Document {
    pub reading: Reading,
    /// What there is to say, errors and warnings.
    pub messages: Diagnostics,
    /// The compiled file; `None` if it has errors.
    pub program: Option<Program>,
    /// The number that the editor gave to this text.
    pub version: Option<i32>,
    buffers: Buffers,
    /// The files that it names, as they were read.
    files: Files,
}

impl Document {
    /// Reads a text as the compiler does. Files that it names are read from the open ones, and from the disk.
    pub fn new(uri: &Uri, text: &str, version: Option<i32>, encoding: Encoding, buffers: &Buffers) -> Self {
        let text: Arc<str> = text.into();
        let source = Source::file(path_of(uri), text);
        let files = buffers.beside(&source.name);
        let options = Options { files: files.clone(), ..Options::default() };
        let (program, ast, messages) = match Program::check(source.clone(), options) {
            Ok(program) => {
                let (ast, warnings) = (program.ast().clone(), program.warnings());
                (Some(program), ast, warnings)
            }
            // the items without a mistake are known all the same
            Err(messages) => (None, syntax::parse(&source).0, messages),
        };
        let reading = Reading::new(source, ast, encoding);
        Self { reading, messages, program, version, buffers: buffers.clone(), files }
    }

    pub fn text(&self) -> &str {
        self.reading.text()
    }

    pub fn byte(&self, position: Position) -> usize {
        self.reading.byte(position)
    }

    pub fn range(&self, bytes: std::ops::Range<usize>) -> Range {
        self.reading.range(bytes)
    }

    pub fn span(&self, span: Span) -> Range {
        self.reading.span(span)
    }

    /// Whether it names the file of this path, or one that it imports does.
    pub fn names_file(&self, path: &str) -> bool {
        self.files.asked().iter().any(|asked| asked == path)
    }

    /// A file that this one imports, by the path that is written; `None` if it cannot be read.
    pub fn imported(&self, path: &str) -> Option<Source> {
        let name = Files::name(path, &self.reading.source.name);
        let bytes = self.buffers.beside(&self.reading.source.name).read(&name).ok()?;
        Some(Source::file(name, text_of(bytes.to_vec()).ok()?))
    }

    /// The file with more text at its end, if that compiles.
    pub fn with(&self, more: &str) -> Option<Program> {
        let text = format!("{}\n{more}\n", self.text());
        let name = self.reading.source.name.clone();
        let options = Options { files: self.files.clone(), ..Options::default() };
        Program::check(Source::file(name, text), options).ok()
    }
}
