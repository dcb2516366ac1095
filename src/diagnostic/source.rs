//! Source texts and the spans that point into them.

use std::sync::Arc;

/// One of the texts of a compilation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SourceId {
    /// The standard solids, written in the language itself.
    Prelude,
    /// The user's file.
    File,
    /// A file that the user's file imports, or one of those imports: its number.
    Import(u16),
}

impl SourceId {
    /// Whether it is a text that a user has written.
    pub fn is_users(self) -> bool {
        match self {
            Self::Prelude => false,
            Self::File | Self::Import(_) => true,
        }
    }
}

/// A range of bytes of one source text. Every node of every stage carries the span that it came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Span {
    /// The text.
    pub source: SourceId,
    /// The first byte.
    pub start: u32,
    /// The byte after the last one.
    pub end: u32,
}

impl Span {
    /// The bytes `start..end` of a text.
    pub fn new(source: SourceId, start: usize, end: usize) -> Self {
        // texts longer than `Source::MAX_LEN` are refused, so positions fit
        Self { source, start: start as u32, end: end as u32 }
    }

    /// The span from the start of this one to the end of the other.
    #[must_use]
    pub fn to(self, end: Self) -> Self {
        Self { end: end.end.max(self.end), ..self }
    }

    /// The range of bytes.
    pub fn range(self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// A named text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Which of the texts of a compilation it is.
    pub id: SourceId,
    /// The path as the user wrote it; `<stdin>` for standard input.
    pub name: Arc<str>,
    /// The text itself.
    pub text: Arc<str>,
}

/// The line and the column of a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position {
    /// The line, from 1.
    pub line: usize,
    /// The column in characters, from 1.
    pub column: usize,
}

impl Source {
    /// The longest text that is read, in bytes.
    pub const MAX_LEN: usize = 1 << 28;

    /// The user's file: its name in messages, and its text.
    pub fn file(name: impl Into<Arc<str>>, text: impl Into<Arc<str>>) -> Self {
        Self { id: SourceId::File, name: name.into(), text: text.into() }
    }

    /// The line and the column of a byte. A byte beyond the end counts as the end.
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

    /// The text under a span of this source. Empty if the span does not fit the text.
    pub fn slice(&self, span: Span) -> &str {
        self.text.get(span.range()).unwrap_or("")
    }
}
