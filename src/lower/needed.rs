//! Which items of a file some of its solids are made of.

use std::collections::BTreeSet;

use super::imports::Imported;
use crate::syntax::ast::{Ast, Expr, ExprKind, Item};

/// The names that some solids mention, and those that the items of these names mention, also in the files that are
/// imported, each after those that it imports itself. A name of one file stands for those of all others, too: a few
/// items more are read then. `None` if one of the solids is no item of the file.
pub(super) fn names(
    (ast, imported): (&Ast, &[Imported]),
    solids: &BTreeSet<String>,
) -> Option<BTreeSet<String>> {
    let is_item = |name: &&String| ast.items.iter().any(|item| item.name().text == **name);
    if !solids.iter().all(|name| is_item(&name)) {
        return None;
    }
    let mut needed = solids.clone();
    let imported = imported.iter().rev().map(|file| &file.ast);
    // a name is defined above its uses, and in another file before them
    for item in [ast].into_iter().chain(imported).flat_map(|ast| ast.items.iter().rev()) {
        // all params have values, and an import may have params
        if matches!(item, Item::Param(_) | Item::Import(_)) {
            needed.insert(item.name().text.clone());
        }
        if needed.contains(&item.name().text) {
            values(item).into_iter().for_each(|value| add(value, &mut needed));
        }
    }
    Some(needed)
}

/// The expressions of an item.
fn values(item: &Item) -> Vec<&Expr> {
    match item {
        Item::Param(param) => {
            let range = param.range.iter().flat_map(|(low, high)| [low, high]);
            range.chain([&param.value]).collect()
        }
        Item::Let(definition) | Item::Solid(definition) => {
            let arguments = definition.attributes.iter().flat_map(|attribute| &attribute.arguments);
            arguments.map(|argument| &argument.value).chain([&definition.value]).collect()
        }
        Item::Function(function) => {
            let defaults = function.parameters.iter().filter_map(|parameter| parameter.default.as_ref());
            defaults.chain([&function.body]).collect()
        }
        // a scene is no part of a solid
        Item::Import(_) | Item::Scene(_) => Vec::new(),
    }
}

/// Adds all names of an expression, those of its own variables among them, which does no harm.
fn add(expr: &Expr, needed: &mut BTreeSet<String>) {
    let name = match &expr.kind {
        ExprKind::Name(name) => Some(name),
        ExprKind::Call { function: name, .. } | ExprKind::Method { method: name, .. } => Some(&name.text),
        // `lib.post`
        ExprKind::Member { name, .. } => Some(&name.text),
        _ => None,
    };
    needed.extend(name.cloned());
    expr.children().into_iter().for_each(|part| add(part, needed));
}
