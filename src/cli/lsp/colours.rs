//! The colours of solids, as pictures show them. They are not written in files, so an editor shows them and
//! cannot set them.

use lsp_types::{Color, ColorInformation};

use rfm::render::OBSTACLE;
use rfm::syntax::ast::Item;

use super::document::Document;

/// The colour of each solid, at its name.
pub(super) fn of(document: &Document) -> Vec<ColorInformation> {
    let [red, green, blue] = OBSTACLE.map(|channel| f32::from(channel) / 255.0);
    let color = Color { red, green, blue, alpha: 1.0 };
    let items = document.reading.ast.items.iter();
    let names = items.filter_map(|item| match item {
        Item::Solid(solid) => Some(solid.name.span),
        Item::Import(_) | Item::Param(_) | Item::Let(_) | Item::Function(_) | Item::Scene(_) => None,
    });
    names.map(|name| ColorInformation { range: document.range(name.range()), color }).collect()
}
