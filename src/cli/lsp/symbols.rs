//! The outline of a file.

use lsp_types::{DocumentSymbol, SymbolKind};

use rfm::diagnostic::Span;
use rfm::syntax::ast::{Entry, Item, Name};

use super::document::Document;

pub(super) fn of(document: &Document) -> Vec<DocumentSymbol> {
    let items = document.reading.ast.items.iter();
    items
        .map(|item| match item {
            Item::Import(import) => {
                let file = Some(import.path.clone());
                symbol(document, &import.name, import.name.span, SymbolKind::MODULE, file)
            }
            Item::Param(param) => {
                symbol(document, &param.name, param.value.span, SymbolKind::CONSTANT, param.doc.clone())
            }
            Item::Let(let_item) => {
                symbol(document, &let_item.name, let_item.value.span, SymbolKind::VARIABLE, None)
            }
            Item::Solid(solid) => symbol(document, &solid.name, solid.value.span, SymbolKind::CLASS, None),
            Item::Function(function) => {
                symbol(document, &function.name, function.body.span, SymbolKind::FUNCTION, None)
            }
            Item::Scene(scene) => {
                let mut symbol = symbol(document, &scene.name, scene.span, SymbolKind::NAMESPACE, None);
                symbol.children =
                    Some(scene.entries.iter().filter_map(|entry| block(document, entry)).collect());
                symbol
            }
        })
        .collect()
}

fn block(document: &Document, entry: &Entry) -> Option<DocumentSymbol> {
    match entry {
        Entry::Setting { .. } => None,
        Entry::Block { key, label, span, .. } => {
            let detail = label.as_ref().map(|label| label.text.clone());
            Some(symbol(document, key, *span, SymbolKind::OBJECT, detail))
        }
    }
}

/// The symbol of a name that reaches to the end of its value.
fn symbol(
    document: &Document,
    name: &Name,
    value: Span,
    kind: SymbolKind,
    detail: Option<String>,
) -> DocumentSymbol {
    let (place, value) = (name.span.range(), value.range());
    let reach = place.start..value.end.max(place.end);
    #[allow(deprecated)] // the field must be given although it is deprecated
    DocumentSymbol {
        name: name.text.clone(),
        detail,
        kind,
        tags: None,
        deprecated: None,
        range: document.range(reach),
        selection_range: document.range(place),
        children: None,
    }
}
