//! What a grid of cells cannot show, in words.

use rfm::geom::to_thousandths;
use rfm::mesh::{Grid, ThinCells};

/// The parts that a grid cannot show, as a sentence without its subject: how much, where, and how many cells
/// would show them.
pub(super) fn hidden(thin: &ThinCells, grid: &Grid) -> String {
    let what = if thin.is_gap { "a gap" } else { "a part" };
    let how = match thin.cells_needed(grid) {
        Some(needed) => format!("{what} {:.2e} thick: about {needed} cells would show it", thin.thickness),
        None if thin.is_wedge => format!("{what} that ends in a sharp edge"),
        None if thin.thickness.is_finite() => {
            format!("{what} {:.0e} thick, which no grid around all of it shows", thin.thickness)
        }
        None => format!("{what} of unknown thickness"),
    };
    format!(
        "in {} cells between {:.3} and {:.3}, the thinnest at {:.3}, {how}",
        thin.count,
        to_thousandths(thin.bounds.min),
        to_thousandths(thin.bounds.max),
        to_thousandths(thin.at)
    )
}
