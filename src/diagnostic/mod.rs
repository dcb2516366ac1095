//! Messages of the compiler to people: one type for every message about a file, one renderer, one list
//! of codes.
//!
//! Messages are in lower case without a full stop. They say what was found and what would be accepted.

mod codes;
mod printable;
mod render;
mod source;

use std::fmt;
use std::sync::Arc;

pub use codes::{Code, explain, explanations};
pub use printable::{is_hidden, printable, printable_line};
pub use render::{Style, render};
pub use source::{Position, Source, SourceId, Span};

/// How serious a message is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The input is accepted, but something about it is odd.
    Warning,
    /// The input is refused.
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

/// A place in a source, with words beside it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// The words beside it; may be empty.
    pub text: String,
}

/// One message about the input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// Whether it is an error or a warning.
    pub severity: Severity,
    /// The code, which [`explain`] explains.
    pub code: Code,
    /// What was found, in lower case and without a full stop.
    pub message: String,
    /// The place that the message is about, with a few words beside it.
    pub primary: Label,
    /// Other places that belong to the matter.
    pub secondary: Vec<Label>,
    /// What would be accepted, or what to do.
    pub help: Option<String>,
    /// A change of the text that does what the help says.
    pub edit: Option<Edit>,
}

/// A change of a text that removes the cause of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Edit {
    /// The place that is replaced; empty where something is inserted.
    pub span: Span,
    /// What stands there. The edit is for texts in which it does.
    pub written: String,
    /// What is written instead.
    pub replacement: String,
    /// Whether the file means the same afterwards, so that the edit can be made unseen.
    pub is_safe: bool,
}

impl Diagnostic {
    /// An error about a place.
    pub fn error(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self {
            severity: Severity::Error,
            code,
            message: message.into(),
            primary: Label { span, text: String::new() },
            secondary: Vec::new(),
            help: None,
            edit: None,
        }
    }

    /// A warning about a place.
    pub fn warning(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, span, message) }
    }

    /// Puts words beside the primary place.
    #[must_use]
    pub fn at(mut self, text: impl Into<String>) -> Self {
        self.primary.text = text.into();
        self
    }

    /// Adds another place that belongs to the matter.
    #[must_use]
    pub fn label(mut self, span: Span, text: impl Into<String>) -> Self {
        self.secondary.push(Label { span, text: text.into() });
        self
    }

    /// Adds help: what would be accepted, or what to do.
    #[must_use]
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }

    /// Adds the edit that replaces what is written at a place.
    #[must_use]
    pub fn edit(
        mut self,
        span: Span,
        written: impl Into<String>,
        replacement: impl Into<String>,
        is_safe: bool,
    ) -> Self {
        self.edit = Some(Edit { span, written: written.into(), replacement: replacement.into(), is_safe });
        self
    }

    /// Whether the message is about no place of the file: a param is set that it does not declare.
    pub(crate) fn is_about_no_place(&self) -> bool {
        self.code == Code::OVERRIDE && self.primary.span.range().is_empty()
    }

    /// The edit, if the text holds at its place what it replaces.
    pub fn edit_of(&self, source: &Source) -> Option<&Edit> {
        self.edit.as_ref().filter(|edit| {
            edit.span.source == source.id && source.text.get(edit.span.range()) == Some(edit.written.as_str())
        })
    }

    /// Adds the help "did you mean `name`?" and the edit that writes the name, if one of the candidates is
    /// near enough to what was written.
    #[must_use]
    pub fn suggest<'a>(self, written: &str, candidates: impl IntoIterator<Item = &'a str>) -> Self {
        match nearest(written, candidates) {
            Some(name) => {
                let span = self.primary.span;
                self.help(format!("did you mean `{name}`?")).edit(span, written, name, false)
            }
            None => self,
        }
    }
}

/// The candidate with the fewest typing slips from `written`. `None` if each has more than one slip and more
/// than one in three letters, and none has just one or two letters more, as `sphere` has than `sphr`.
pub fn nearest<'a>(written: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = written.chars().count();
    // a single letter is near to every other
    let limit = if length == 1 { 0 } else { (length / 3).max(1) };
    let lower = written.to_lowercase();
    candidates
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(&lower, &name.to_lowercase()), name))
        .filter(|&(slips, name)| {
            slips < name.chars().count() && (slips <= limit || slips <= 2 && is_short_for(&lower, name))
        })
        .min()
        .map(|(_, name)| name)
}

/// Whether a word of four letters or more is a name without some of its letters, of which the first is there.
fn is_short_for(lower: &str, name: &str) -> bool {
    let name = name.to_lowercase();
    let mut left = name.chars();
    lower.chars().count() > 3
        && lower.chars().next() == name.chars().next()
        && lower.chars().all(|letter| left.any(|other| other == letter))
}

/// The messages of one compilation, together with the texts that they point into. This is the error type of
/// the compiler.
#[derive(Debug, Clone)]
pub struct Diagnostics {
    /// The messages in the order in which they are shown.
    pub list: Vec<Diagnostic>,
    /// The texts that their spans point into.
    pub sources: Arc<[Source]>,
}

impl Diagnostics {
    /// Whether there is an error among the messages.
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|d| d.severity == Severity::Error)
    }

    /// The text with an id. `None` if it is not among the sources.
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
        assert_eq!(nearest("sphr", ["sphere", "box", "cone"]), Some("sphere"));
        assert_eq!(nearest("post", ["position", "box", "cone"]), None);
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
