//! The characters of a text that are code.

use std::str::CharIndices;

/// The characters of a text with their places and ends. A comment counts as the end of its line, and a quoted text as
/// its first quotation mark, with the end of the whole.
pub(super) struct CodeChars<'a> {
    text: &'a str,
    chars: CharIndices<'a>,
}

impl<'a> CodeChars<'a> {
    pub fn of(text: &'a str) -> Self {
        Self { text, chars: text.char_indices() }
    }

    /// Moves past the next character that is a stop, and returns where it ends.
    fn past(&mut self, stop: impl Fn(char) -> bool) -> usize {
        self.chars.find(|(_, c)| stop(*c)).map_or(self.text.len(), |(at, c)| at + c.len_utf8())
    }
}

impl Iterator for CodeChars<'_> {
    type Item = (usize, char, usize);

    fn next(&mut self) -> Option<Self::Item> {
        let (at, c) = self.chars.next()?;
        Some(if c == '#' || self.text[at..].starts_with("//") {
            (at, '\n', self.past(|c| c == '\n'))
        } else if c == '"' {
            // a text that is not closed ends with its line
            (at, c, self.past(|c| c == '"' || c == '\n'))
        } else {
            (at, c, at + c.len_utf8())
        })
    }
}
