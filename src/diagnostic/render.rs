//! The only place where a diagnostic becomes text.

use std::borrow::Cow;

use annotate_snippets::{
    Annotation, AnnotationKind, Group, Level, Origin, Renderer, Snippet, renderer::DecorStyle,
};

use super::{Diagnostic, Diagnostics, Label, Severity, Source, Span, is_hidden, printable, printable_line};

/// How messages are decorated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// ASCII decorations without escape codes, for logs, snapshots and error values.
    Plain,
    /// As [`Style::Plain`], with quoted lines cut to the width of a panel beside a picture.
    Panel,
    /// Escape codes and line drawing characters, for terminals.
    Terminal,
}

/// Lines longer than this, in bytes, are not quoted whole. A generated file may be one line of megabytes.
const LONGEST_QUOTED_LINE: usize = 400;

/// Columns of a panel beside a picture.
const PANEL_COLUMNS: usize = 72;

/// Messages longer than this, in bytes, lose their middle.
const LONGEST_MESSAGE: usize = 400;

/// All messages as text, with a blank line between them and a newline at the end.
pub fn render(diagnostics: &Diagnostics, style: Style) -> String {
    let renderer = match style {
        Style::Plain => Renderer::plain(),
        Style::Panel => Renderer::plain().term_width(PANEL_COLUMNS),
        Style::Terminal => Renderer::styled().decor_style(DecorStyle::Unicode),
    };
    let mut out = String::new();
    for diagnostic in &diagnostics.list {
        let groups = groups(diagnostic, &diagnostics.sources);
        out.push_str(renderer.render(&groups).trim_end());
        out.push_str("\n\n");
    }
    out.truncate(out.trim_end().len());
    out.push('\n');
    out
}

fn groups<'a>(diagnostic: &'a Diagnostic, sources: &'a [Source]) -> Vec<Group<'a>> {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let message = printable(&shortened(&diagnostic.message)).into_owned();
    let mut group = Group::with_title(level.primary_title(message).id(diagnostic.code.0));
    for source in sources {
        let labels: Vec<_> = std::iter::once((AnnotationKind::Primary, &diagnostic.primary))
            .chain(diagnostic.secondary.iter().map(|label| (AnnotationKind::Context, label)))
            .filter(|(_, label)| label.span.source == source.id)
            .collect();
        if diagnostic.is_about_no_place() && source.id == diagnostic.primary.span.source {
            group = group.element(Origin::path(printable_line(&source.name)));
        } else if !labels.is_empty() {
            group = group.element(snippet(source, &labels));
        }
    }
    if let Some(help) = &diagnostic.help {
        group = group.element(Level::HELP.message(printable(help)));
    }
    vec![group]
}

/// The message without its middle if it is too long. It may quote a name of any length.
fn shortened(message: &str) -> Cow<'_, str> {
    if message.len() <= LONGEST_MESSAGE {
        return message.into();
    }
    let half = LONGEST_MESSAGE / 2;
    let (first, last) = (floor_boundary(message, half), floor_boundary(message, message.len() - half));
    format!("{}…{}", &message[..first], &message[last..]).into()
}

/// The lines that the labels touch. They are cut out first, so that the cost does not grow with the file.
fn snippet<'a>(source: &'a Source, labels: &[(AnnotationKind, &'a Label)]) -> Snippet<'a, Annotation<'a>> {
    let text = &source.text;
    let first = labels.iter().map(|(_, l)| clamp(text, l.span).start).min().unwrap_or(0);
    let last = labels.iter().map(|(_, l)| clamp(text, l.span).end).max().unwrap_or(0);
    let mut start = text[..first].rfind('\n').map_or(0, |at| at + 1);
    let mut end = text[last..].find('\n').map_or(text.len(), |at| last + at);
    if first - start > LONGEST_QUOTED_LINE {
        start = floor_boundary(text, first - LONGEST_QUOTED_LINE / 2);
    }
    if end - last > LONGEST_QUOTED_LINE {
        end = floor_boundary(text, last + LONGEST_QUOTED_LINE / 2);
    }
    let mut snippet = Snippet::source(quoted(&text[start..end]))
        .line_start(source.position(start).line)
        .path(printable_line(&source.name))
        .fold(true);
    for (kind, label) in labels {
        let range = clamp(text, label.span);
        let shown = |byte: usize| quoted(&text[start..byte]).len();
        let annotation = kind.span(shown(range.start)..shown(range.end.min(end)));
        snippet = snippet.annotation(if label.text.is_empty() {
            annotation
        } else {
            annotation.label(printable(&label.text))
        });
    }
    snippet
}

/// A part of a source with a sign in place of each character that a terminal would hide or obey. The renderer has signs
/// of its own for the ASCII ones, and would show one at the end of each line that ends as on Windows.
fn quoted(text: &str) -> Cow<'_, str> {
    let hidden = |c: char| is_hidden(c) && !c.is_ascii();
    let text = text.strip_suffix('\r').unwrap_or(text);
    let text: Cow<'_, str> =
        if text.contains("\r\n") { text.replace("\r\n", "\n").into() } else { text.into() };
    if text.contains(hidden) { text.replace(hidden, "\u{fffd}").into() } else { text }
}

/// The bytes of a span, moved onto character boundaries inside the text.
fn clamp(text: &str, span: Span) -> std::ops::Range<usize> {
    let start = floor_boundary(text, span.start as usize);
    let end = floor_boundary(text, span.end as usize).max(start);
    start..end
}

fn floor_boundary(text: &str, byte: usize) -> usize {
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    byte
}
