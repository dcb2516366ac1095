//! What the compiler says to a person: one type for every message about a file, one renderer, one list of codes.
//!
//! Messages are lower case without a full stop; they say what was found and what would be accepted.

mod codes;
mod render;
mod source;

use std::fmt;
use std::sync::Arc;

pub use codes::{Code, explain};
pub use render::{Style, render};
pub use source::{Position, Source, SourceId, Span};

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    Warning,
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

/// A further place that a message speaks of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    pub span: Span,
    pub text: String,
}

/// One message about the input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    pub severity: Severity,
    pub code: Code,
    pub message: String,
    /// The place that the message is about, with a few words put beside it.
    pub primary: Label,
    pub secondary: Vec<Label>,
    pub help: Option<String>,
}

impl Diagnostic {
    pub fn error(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self {
            severity: Severity::Error,
            code,
            message: message.into(),
            primary: Label { span, text: String::new() },
            secondary: Vec::new(),
            help: None,
        }
    }

    pub fn warning(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, span, message) }
    }

    /// The words beside the primary span.
    #[must_use]
    pub fn at(mut self, text: impl Into<String>) -> Self {
        self.primary.text = text.into();
        self
    }

    #[must_use]
    pub fn label(mut self, span: Span, text: impl Into<String>) -> Self {
        self.secondary.push(Label { span, text: text.into() });
        self
    }

    #[must_use]
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }

    /// Help of the form "did you mean `name`?" if one of the candidates is near enough to what was written.
    #[must_use]
    pub fn suggest<'a>(self, written: &str, candidates: impl IntoIterator<Item = &'a str>) -> Self {
        match nearest(written, candidates) {
            Some(name) => self.help(format!("did you mean `{name}`?")),
            None => self,
        }
    }
}

/// The candidate with the fewest typing slips from `written`: at most one slip, or one in three letters.
pub fn nearest<'a>(written: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = written.chars().count();
    // one letter is near to every other
    let limit = if length == 1 { 0 } else { (length / 3).max(1) };
    let lower = written.to_lowercase();
    candidates
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(&lower, &name.to_lowercase()), name))
        .filter(|&(slips, name)| slips <= limit && slips < name.chars().count())
        .min()
        .map(|(_, name)| name)
}

/// The messages of one compilation together with the texts they point into: the error type of the library.
#[derive(Debug, Clone)]
pub struct Diagnostics {
    pub list: Vec<Diagnostic>,
    pub sources: Arc<[Source]>,
}

impl Diagnostics {
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|d| d.severity == Severity::Error)
    }

    pub fn source(&self, id: SourceId) -> Option<&Source> {
        self.sources.iter().find(|s| s.id == id)
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&render(self, Style::Plain))
    }
}

impl std::error::Error for Diagnostics {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggestions_stay_near() {
        assert_eq!(nearest("spere", ["sphere", "box", "cone"]), Some("sphere"));
        assert_eq!(nearest("q", ["sphere", "x"]), None);
        assert_eq!(nearest("visocsity", ["viscosity", "density"]), Some("viscosity"));
    }

    #[test]
    fn positions_count_characters() {
        let source = Source::file("a.rfm", "let α = 1\nlet b = α");
        assert_eq!(source.position(0), Position { line: 1, column: 1 });
        let last = source.text.len() - 2;
        assert_eq!(source.position(last), Position { line: 2, column: 9 });
    }
}
