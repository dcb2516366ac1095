//! Source texts and the spans that point into them.

use std::sync::Arc;

/// Which of the texts of one compilation a span belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SourceId {
    /// The standard solids, written in the language itself.
    Prelude,
    /// The user's file.
    File,
}

/// A range of bytes of one source text; every node of every stage carries the one that it came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Span {
    pub source: SourceId,
    pub start: u32,
    pub end: u32,
}

impl Span {
    pub fn new(source: SourceId, start: usize, end: usize) -> Self {
        // `Source::new` refuses texts of 4 GiB and more, so positions fit
        Self { source, start: start as u32, end: end as u32 }
    }

    /// From the start of this span to the end of the other.
    #[must_use]
    pub fn to(self, end: Self) -> Self {
        Self { end: end.end.max(self.end), ..self }
    }

    pub fn range(self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// A named text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    pub id: SourceId,
    /// As the user wrote the path; `<stdin>` for standard input.
    pub name: Arc<str>,
    pub text: Arc<str>,
}

/// Line and column of a byte, both from 1; the column counts characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position {
    pub line: usize,
    pub column: usize,
}

impl Source {
    /// The longest text that is read, in bytes.
    pub const MAX_LEN: usize = 1 << 28;

    pub fn file(name: impl Into<Arc<str>>, text: impl Into<Arc<str>>) -> Self {
        Self { id: SourceId::File, name: name.into(), text: text.into() }
    }

    pub fn position(&self, byte: usize) -> Position {
        let mut byte = byte.min(self.text.len());
        while !self.text.is_char_boundary(byte) {
            byte -= 1;
        }
        let before = &self.text[..byte];
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        Position {
            line: before.bytes().filter(|&b| b == b'\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }

    /// The text under a span of this source.
    pub fn slice(&self, span: Span) -> &str {
        self.text.get(span.range()).unwrap_or("")
    }
}
