//! A text that was read: its tree, its names, and the positions that an editor counts in it.

use std::sync::Arc;

use lsp_types::{Position, PositionEncodingKind, Range, TextDocumentContentChangeEvent, Uri};

use rfm::diagnostic::{Source, Span};
use rfm::files::Files;
use rfm::syntax::Ast;

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

    /// The byte at which a character of the first line of a text begins; one beyond the line counts as its end.
    fn byte_in_line(self, text: &str, character: u32) -> usize {
        let line = text.split('\n').next().unwrap_or("");
        let line = line.strip_suffix('\r').unwrap_or(line);
        let mut before = 0;
        for (at, c) in line.char_indices() {
            if before >= character {
                return at;
            }
            before += self.width(c.encode_utf8(&mut [0; 4]));
        }
        line.len()
    }

    /// The byte at a position of a text that has not been read.
    fn byte(self, text: &str, position: Position) -> usize {
        let line_ends = text.match_indices('\n').map(|(at, _)| at + 1);
        let start = std::iter::once(0).chain(line_ends).nth(position.line as usize);
        start.map_or(text.len(), |start| start + self.byte_in_line(&text[start..], position.character))
    }
}

/// The text after changes, which are made one after the other; `None` if one changes a part of a text that is
/// not known.
pub(super) fn changed(
    text: Option<Arc<str>>,
    changes: Vec<TextDocumentContentChangeEvent>,
    encoding: Encoding,
) -> Option<Arc<str>> {
    changes.into_iter().fold(text, |text, change| match change.range {
        None => Some(change.text.into()),
        Some(range) => {
            let text = text?;
            let ends = [range.start, range.end].map(|end| encoding.byte(&text, end));
            let (start, end) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            Some([&text[..start], &change.text, &text[end..]].concat().into())
        }
    })
}

/// A text with its tree.
pub(super) struct Reading {
    pub source: Source,
    pub ast: Ast,
    pub names: Names,
    encoding: Encoding,
    /// The first byte of each line.
    lines: Vec<usize>,
}

impl Reading {
    pub fn new(source: Source, ast: Ast, encoding: Encoding) -> Self {
        let ends = source.text.match_indices('\n').map(|(at, _)| at + 1);
        let lines = std::iter::once(0).chain(ends).collect();
        let names = Names::of(&ast);
        Self { source, ast, names, encoding, lines }
    }

    pub fn text(&self) -> &str {
        &self.source.text
    }

    /// The path of the file, without detours.
    pub fn path(&self) -> String {
        Files::plain(&self.source.name)
    }

    /// The byte at a position; one beyond its line counts as the end of the line.
    pub fn byte(&self, position: Position) -> usize {
        let text = self.text();
        let Some(&start) = self.lines.get(position.line as usize) else { return text.len() };
        start + self.encoding.byte_in_line(&text[start..], position.character)
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
}

/// The path that an address names.
pub(super) fn path_of(uri: &Uri) -> String {
    uri.path().as_estr().decode().into_string_lossy().into_owned()
}

/// The address of a path; `None` if it has none.
pub(super) fn uri_of(path: &str) -> Option<Uri> {
    let mut address = String::from("file://");
    for byte in path.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'/' | b'-' | b'_' | b'.' | b'~' => {
                address.push(byte.into());
            }
            _ => address += &format!("%{byte:02X}"),
        }
    }
    address.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_text_are_changed_one_after_the_other() {
        let change = |range: Option<[u32; 4]>, text: &str| TextDocumentContentChangeEvent {
            range: range.map(|[a, b, c, d]| Range::new(Position::new(a, b), Position::new(c, d))),
            range_length: None,
            text: text.to_string(),
        };
        let before: Arc<str> = "𝛼 = 1\r\nb\n".into();
        for (encoding, after) in [(Encoding::Utf16, 2), (Encoding::Utf8, 4)] {
            let changes = vec![
                change(Some([0, 0, 0, after]), "ω"),
                change(Some([1, 0, 9, 0]), "c"),
                // the end of a line, and ends in the wrong order
                change(Some([0, 99, 0, 99]), "0"),
                change(Some([1, 1, 1, 0]), "d"),
            ];
            let text = changed(Some(Arc::clone(&before)), changes, encoding);
            assert_eq!(text.as_deref(), Some("ω = 10\r\nd"));
        }
        let unknown = vec![change(Some([0, 0, 0, 0]), "a"), change(None, "whole")];
        assert_eq!(changed(None, unknown.clone(), Encoding::Utf8).as_deref(), Some("whole"));
        assert_eq!(changed(None, unknown[..1].to_vec(), Encoding::Utf8), None);
    }

    #[test]
    fn a_path_has_an_address_and_this_leads_back() {
        for path in ["/a/b.rfm", "/with blank/ω#1%.rfm", "/a?b[c].rfm"] {
            assert_eq!(path_of(&uri_of(path).unwrap()), path);
        }
    }
}
