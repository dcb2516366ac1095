//! What may be written at the cursor, and which argument of a call it is.

use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionTextEdit, Documentation, InsertReplaceEdit,
    ParameterInformation, ParameterLabel, SignatureHelp, SignatureInformation, TextEdit,
};

use rfm::diagnostic::Source;
use rfm::lower::vocabulary;
use rfm::sph::Method;
use rfm::syntax::{
    self,
    ast::{Ast, Entry, ExprKind, Item},
};

use super::context::{Context, Open};
use super::document::Document;
use crate::cli::language::{
    keys,
    words::{self, Signature, is_of_a_word},
};

const OPERATORS: [&str; 13] =
    ["and", "or", "not", "any", "all", "sum", "product", "min", "max", "list", "if", "then", "else"];

fn item(label: impl Into<String>, kind: CompletionItemKind, about: &str) -> CompletionItem {
    let documentation = (!about.is_empty()).then(|| Documentation::String(about.to_string()));
    CompletionItem { label: label.into(), kind: Some(kind), documentation, ..CompletionItem::default() }
}

fn called(signature: Signature, kind: CompletionItemKind) -> CompletionItem {
    let detail = Some(signature.label());
    CompletionItem { detail, ..item(signature.name, kind, &signature.about) }
}

/// What may be written at a byte, each with the word that it replaces: editors have different ideas of what a
/// word is. They leave out entries that do not begin with the word that is there. Some let the user choose
/// whether the text behind the cursor is replaced too.
pub(super) fn at(document: &Document, byte: usize, may_choose: bool) -> Vec<CompletionItem> {
    let context = Context::at(document.text(), byte);
    let after = document.text().get(byte..).unwrap_or("");
    let to_end = after.find(|c: char| !is_of_a_word(c)).unwrap_or(after.len());
    let start = byte - context.prefix.len();
    let (insert, replace) = (document.range(start..byte), document.range(start..byte + to_end));
    // in front of a word nothing has been typed of it, so it stays
    let word = if context.prefix.is_empty() { insert } else { replace };
    let with_edit = |item: CompletionItem| {
        let new_text = item.insert_text.unwrap_or_else(|| item.label.clone());
        let edit = if may_choose {
            CompletionTextEdit::InsertAndReplace(InsertReplaceEdit { new_text, insert, replace })
        } else {
            CompletionTextEdit::Edit(TextEdit::new(word, new_text))
        };
        CompletionItem { text_edit: Some(edit), insert_text: None, ..item }
    };
    fitting(document, &context, byte).into_iter().map(with_edit).collect()
}

/// What may be written in a context.
fn fitting(document: &Document, context: &Context, byte: usize) -> Vec<CompletionItem> {
    if context.is_quiet {
        return Vec::new();
    }
    if let Some(members) = members(document, context) {
        return members;
    }
    if context.after_dot {
        let axes =
            ["x", "y", "z"].map(|axis| item(axis, CompletionItemKind::FIELD, "a component of a vector"));
        let methods = methods(document).into_iter().map(|method| called(method, CompletionItemKind::METHOD));
        return methods.chain(axes).collect();
    }
    if context.wants_key()
        && let Some(block) = context.block()
    {
        let method = method_around(document, byte).unwrap_or_default();
        let keys = vocabulary::keys(block, method).into_iter();
        let about = |key: &str| keys::about(block, key, Some(method));
        return keys.map(|key| item(key, CompletionItemKind::PROPERTY, &about(key))).collect();
    }
    if let Some(key) = &context.key {
        let words = vocabulary::words(key);
        if !words.is_empty() {
            return words.into_iter().map(|word| item(word, CompletionItemKind::ENUM_MEMBER, "")).collect();
        }
    }
    let mut found = Vec::new();
    if context.begins_item {
        found.extend(words::ITEMS.map(|(word, about)| item(word, CompletionItemKind::KEYWORD, about)));
    }
    if let Some(open) = context.open.last().filter(|open| open.bracket == '(')
        && let Some(signature) = of_call(document, context, open)
    {
        let names = signature.parameters.iter().filter_map(|p| p.split(" = ").next()).filter(|p| *p != "…");
        found.extend(names.map(|name| CompletionItem {
            insert_text: Some(format!("{name} = ")),
            ..item(format!("{name} ="), CompletionItemKind::VARIABLE, "an argument by its name")
        }));
    }
    found.extend(context.locals.iter().map(|name| item(name, CompletionItemKind::VARIABLE, "")));
    found.extend(names(document, byte));
    found.extend(words::functions().into_iter().map(|f| called(f, CompletionItemKind::FUNCTION)));
    found.extend(vocabulary::reserved().iter().map(|word| item(*word, CompletionItemKind::CONSTANT, "")));
    found.extend(OPERATORS.map(|word| item(word, CompletionItemKind::KEYWORD, "")));
    let mut known = std::collections::HashSet::new();
    found.retain(|item| known.insert(item.label.clone()));
    found
}

/// What the file defines above a byte.
fn names(document: &Document, byte: usize) -> Vec<CompletionItem> {
    let above = document.reading.ast.items.iter().filter(|item| item.name().span.range().end < byte);
    above.filter_map(|item| defined(item, document.text())).collect()
}

/// What an import defines, if its name stands alone in front of the dot at the cursor. An import of its own
/// is not among that: it has no meaning outside.
fn members(document: &Document, context: &Context) -> Option<Vec<CompletionItem>> {
    let source = imported(document, context, context.owner.as_deref())?;
    let (ast, _) = syntax::parse(&source);
    let items = ast.items.iter().filter(|item| !matches!(item, Item::Import(_)));
    Some(items.filter_map(|item| defined(item, &source.text)).collect())
}

/// The text of an import, from the name that stands alone in front of a dot; `None` if that names something else.
fn imported(document: &Document, context: &Context, owner: Option<&str>) -> Option<Source> {
    let owner = owner.filter(|owner| !context.locals.iter().any(|local| local == owner))?;
    let import = document.reading.ast.items.iter().find_map(|item| match item {
        Item::Import(import) => (import.name.text == *owner).then_some(import),
        Item::Param(_) | Item::Let(_) | Item::Function(_) | Item::Solid(_) | Item::Scene(_) => None,
    })?;
    document.imported(&import.path)
}

/// An item of a text as what may be written; `None` for a scene, whose name is written nowhere.
fn defined(defined: &Item, text: &str) -> Option<CompletionItem> {
    let name = defined.name();
    let about = words::comment_above(text, name.span.range().start);
    match defined {
        Item::Param(param) => {
            let about = param.doc.clone().unwrap_or(about);
            Some(item(&name.text, CompletionItemKind::CONSTANT, &about))
        }
        Item::Let(_) => Some(item(&name.text, CompletionItemKind::VARIABLE, &about)),
        Item::Solid(_) => Some(item(&name.text, CompletionItemKind::CLASS, &about)),
        Item::Function(function) => Some(called(words::of(function, text), CompletionItemKind::FUNCTION)),
        Item::Import(_) => Some(item(&name.text, CompletionItemKind::MODULE, &about)),
        Item::Scene(_) => None,
    }
}

fn methods(document: &Document) -> Vec<Signature> {
    let own = document.reading.ast.items.iter().filter_map(|item| match item {
        Item::Function(function) => {
            function.takes_a_shape().then(|| words::behind_a_shape(words::of(function, document.text())))
        }
        Item::Import(_) | Item::Param(_) | Item::Let(_) | Item::Solid(_) | Item::Scene(_) => None,
    });
    own.chain(words::methods()).collect()
}

/// The method of the scene around a byte, if it states one.
pub(super) fn method_around(document: &Document, byte: usize) -> Option<Method> {
    let in_tree = document.reading.ast.items.iter().find_map(|item| match item {
        Item::Scene(scene) => scene.span.range().contains(&byte).then(|| scene.entries.iter()),
        Item::Import(_) | Item::Param(_) | Item::Let(_) | Item::Function(_) | Item::Solid(_) => None,
    });
    let stated = in_tree.into_iter().flatten().find_map(|entry| match entry {
        Entry::Setting { key, value } => {
            if let ExprKind::Name(word) = &value.kind
                && key.text == "method"
            {
                Method::named(word)
            } else {
                None
            }
        }
        Entry::Block { .. } => None,
    });
    // a scene that is being typed is not in the tree
    stated.or_else(|| {
        let scene = document.text().get(..byte)?.rfind("scene ")?;
        let (_, after) = document.text()[scene..].split_once("method:")?;
        Method::named(after.split_whitespace().next()?.trim_end_matches([',', '}']))
    })
}

/// The signature of a function or a method.
pub(super) fn signature(document: &Document, name: &str, is_method: bool) -> Option<Signature> {
    if is_method {
        return methods(document).into_iter().find(|method| method.name == name);
    }
    let own = function(&document.reading.ast, document.text(), name);
    own.or_else(|| words::functions().into_iter().find(|function| function.name == name))
}

/// The signature of a function that a text defines.
fn function(ast: &Ast, text: &str, name: &str) -> Option<Signature> {
    ast.items.iter().find_map(|item| match item {
        Item::Function(function) => (function.name.text == name).then(|| words::of(function, text)),
        Item::Import(_) | Item::Param(_) | Item::Let(_) | Item::Solid(_) | Item::Scene(_) => None,
    })
}

/// The signature of what a bracket calls: behind the name of an import, a function of its file.
fn of_call(document: &Document, context: &Context, open: &Open) -> Option<Signature> {
    match imported(document, context, open.owner.as_deref()) {
        Some(source) => function(&syntax::parse(&source).0, &source.text, &open.word),
        None => signature(document, &open.word, open.is_method),
    }
}

/// The call around a byte, with the argument at which it stands.
pub(super) fn signature_help(document: &Document, byte: usize) -> Option<SignatureHelp> {
    let context = Context::at(document.text(), byte);
    let open = context.open.iter().rev().find(|open| open.bracket == '(' && !open.word.is_empty())?;
    let signature = of_call(document, &context, open)?;
    let last = signature.parameters.len().saturating_sub(1);
    let active = Some(open.commas.min(last) as u32);
    let parameters = signature.parameters.iter().map(|parameter| ParameterInformation {
        label: ParameterLabel::Simple(parameter.clone()),
        documentation: None,
    });
    let information = SignatureInformation {
        label: signature.label(),
        documentation: (!signature.about.is_empty()).then(|| Documentation::String(signature.about.clone())),
        parameters: Some(parameters.collect()),
        active_parameter: active,
    };
    Some(SignatureHelp { signatures: vec![information], active_signature: Some(0), active_parameter: active })
}
