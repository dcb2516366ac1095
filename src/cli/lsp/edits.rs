//! Changes of the text that the editor may ask for: quick fixes, layout, other names.

use std::collections::HashMap;

use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, Diagnostic, Range, TextEdit, Uri, WorkspaceEdit,
};

use rfm::lower::vocabulary;
use rfm::syntax::{KEYWORDS, Spelling, format};

use super::document::Document;
use super::messages;
use super::names::{Meaning, Mention};

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
            let edit = message.edit_of(&document.source)?;
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
    match format(&document.source, Spelling::Written) {
        Ok(text) if text != document.text() => vec![TextEdit::new(document.whole(), text)],
        Ok(_) | Err(_) => Vec::new(),
    }
}

/// The name at a byte, if the file defines it.
pub(super) fn renamable(document: &Document, byte: usize) -> Option<(&Mention, &std::ops::Range<usize>)> {
    let mention = document.names.at(byte)?;
    match &mention.meaning {
        Meaning::Defined(place) => Some((mention, place)),
        Meaning::Standard | Meaning::Key(_) => None,
    }
}

/// The edits that give another name to what stands at a byte.
///
/// # Errors
/// Why the name cannot be given, in words.
pub(super) fn rename(
    uri: &Uri,
    document: &Document,
    byte: usize,
    name: &str,
) -> Result<WorkspaceEdit, String> {
    let (mention, place) = renamable(document, byte).ok_or("the file defines no name here")?;
    let starts = name.starts_with(|c: char| c.is_alphabetic() || c == '_');
    if !starts || !name.chars().all(|c| c.is_alphabetic() || c.is_ascii_digit() || c == '_') {
        return Err(format!("`{name}` is no name: names have letters, digits and `_`"));
    }
    if KEYWORDS.contains(&name) || vocabulary::reserved().contains(&name) {
        return Err(format!("`{name}` is a word of the language"));
    }
    if name != mention.text
        && document.names.mentions.iter().any(|other| other.text == name && is_name(other))
    {
        return Err(format!("`{name}` is used in the file already"));
    }
    let edits = document
        .names
        .uses(place)
        .map(|found| TextEdit::new(document.range(found.place.clone()), name.into()));
    Ok(in_file(uri, edits.collect()))
}

fn is_name(mention: &Mention) -> bool {
    match mention.meaning {
        Meaning::Defined(_) | Meaning::Standard => true,
        Meaning::Key(_) => false,
    }
}
