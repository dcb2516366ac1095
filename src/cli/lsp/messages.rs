//! Messages of the compiler as the editor shows them.

use lsp_types::{
    Diagnostic, DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag, Location, NumberOrString,
    PublishDiagnosticsParams, Uri,
};

use rfm::diagnostic::{self, Code, Severity};

use super::document::Document;

/// The most messages that are shown of a file.
const MOST: usize = 200;

/// All messages of a file.
pub(super) fn published(uri: &Uri, document: &Document) -> PublishDiagnosticsParams {
    let messages = document.messages.list.iter().filter_map(|message| of(uri, document, message));
    PublishDiagnosticsParams {
        uri: uri.clone(),
        diagnostics: messages.take(MOST).collect(),
        version: document.version,
    }
}

/// A message; `None` if it is about another text.
pub(super) fn of(uri: &Uri, document: &Document, message: &diagnostic::Diagnostic) -> Option<Diagnostic> {
    let in_file = |span: diagnostic::Span| span.source == document.reading.source.id;
    // a mistake in a standard solid is shown where the file calls it
    let labels = std::iter::once(&message.primary).chain(&message.secondary);
    let primary = labels.clone().find(|label| in_file(label.span))?;
    let related = labels.filter(|label| *label != primary && in_file(label.span) && !label.text.is_empty());
    let related: Vec<_> = related
        .map(|label| DiagnosticRelatedInformation {
            location: Location::new(uri.clone(), document.span(label.span)),
            message: label.text.clone(),
        })
        .collect();
    let mut words = message.message.clone();
    for more in
        [Some(&primary.text).filter(|text| !text.is_empty()), message.help.as_ref()].into_iter().flatten()
    {
        words.push('\n');
        words.push_str(more);
    }
    Some(Diagnostic {
        range: document.span(primary.span),
        severity: Some(match message.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
        }),
        code: Some(NumberOrString::String(message.code.0.to_string())),
        source: Some("rfm".to_string()),
        message: words,
        related_information: (!related.is_empty()).then_some(related),
        tags: (message.code == Code::UNUSED).then(|| vec![DiagnosticTag::UNNECESSARY]),
        ..Diagnostic::default()
    })
}
