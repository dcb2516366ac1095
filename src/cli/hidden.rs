//! What a grid of cells cannot show, in words, and whether it can be looked for.

use super::output::counted;
use rfm::Solid;
use rfm::geom::{Aabb, place};
use rfm::glam::DVec3;
use rfm::interval::Interval;
use rfm::mesh::{Grid, ThinCells};

/// Boxes along each side of a solid in which its range is tried; one in `MOST_UNKNOWN` of them may be
/// unknown.
const PROBES: u32 = 16;
const MOST_UNKNOWN: usize = 50;

/// Whether ranges say anything about the solid nearly everywhere in a box. Where they do not, a search for
/// thin parts would divide every cell to the end.
pub(super) fn knows_ranges(solid: &Solid, bounds: &Aabb) -> bool {
    let size = bounds.size() / f64::from(PROBES);
    let probe = |i: u32| {
        let place =
            DVec3::new(f64::from(i % PROBES), f64::from(i / PROBES % PROBES), f64::from(i / PROBES.pow(2)));
        let low = bounds.min + size * place;
        solid.range(&Aabb::new(low, low + size)) == Interval::ALL
    };
    let unknown = (0..PROBES.pow(3)).filter(|&i| probe(i)).count();
    unknown * MOST_UNKNOWN <= PROBES.pow(3) as usize
}

/// Says that a search for thin parts does not begin.
pub(super) fn without_ranges(solid: &Solid) -> String {
    format!("thin parts of `{}` are not looked for: the ranges of its formula are unknown", solid.name())
}

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
    let size = grid.bounds().size().max_element();
    let [min, max, at] = [thin.bounds.min, thin.bounds.max, thin.at].map(|p| place(p, size));
    format!("in {} between {min} and {max}, the thinnest at {at}, {how}", counted(thin.count, "cell"))
}
