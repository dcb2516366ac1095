//! Changes of the text that the editor may ask for: quick fixes and layout.

use std::collections::HashMap;

use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, Diagnostic, Range, TextEdit, Uri, WorkspaceEdit,
};

use rfm::syntax::{Spelling, format};

use super::document::Document;
use super::messages;

// the protocol keys edits by the address of their file, which never changes
#[allow(clippy::mutable_key_type)]
fn in_file(uri: &Uri, edits: Vec<TextEdit>) -> WorkspaceEdit {
    WorkspaceEdit { changes: Some(HashMap::from([(uri.clone(), edits)])), ..WorkspaceEdit::default() }
}

/// The edits that messages in a range come with.
pub(super) fn fixes(uri: &Uri, document: &Document, range: Range) -> Vec<CodeActionOrCommand> {
    let touches =
        |diagnostic: &Diagnostic| diagnostic.range.start <= range.end && range.start <= diagnostic.range.end;
    let messages = document.messages.list.iter();
    messages
        .filter_map(|message| {
            let edit = message.edit_of(&document.reading.source)?;
            let diagnostic = messages::of(uri, document, message).filter(touches)?;
            let title = match (edit.written.as_str(), edit.replacement.trim_end()) {
                ("", new) => format!("Insert `{new}`"),
                (old, "") => format!("Remove `{old}`"),
                (old, new) => format!("Replace `{old}` by `{new}`"),
            };
            let change = TextEdit::new(document.span(edit.span), edit.replacement.clone());
            Some(CodeActionOrCommand::CodeAction(CodeAction {
                title,
                kind: Some(CodeActionKind::QUICKFIX),
                diagnostics: Some(vec![diagnostic]),
                edit: Some(in_file(uri, vec![change])),
                is_preferred: Some(true),
                ..CodeAction::default()
            }))
        })
        .collect()
}

/// The edit that lays out a file; none if it has a syntax error or is laid out.
pub(super) fn layout(document: &Document) -> Vec<TextEdit> {
    match format(&document.reading.source, Spelling::Written) {
        Ok(text) if text != document.text() => vec![TextEdit::new(document.reading.whole(), text)],
        Ok(_) | Err(_) => Vec::new(),
    }
}
