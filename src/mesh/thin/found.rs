//! What was found of thin parts.

use glam::DVec3;

use super::super::Grid;
use crate::geom::Aabb;

/// The cells in which a surface is hidden from the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThinCells {
    /// The number of such cells.
    pub count: usize,
    /// The smallest box around all of them, in metres; empty if there are none.
    pub bounds: Aabb,
    /// The least thickness that was found in them, in metres; wedges count only if there is nothing else.
    /// Infinite if it is not known or nothing hides.
    pub thickness: f64,
    /// A point of the surface where it is that thin, in metres; the origin if there is none.
    pub at: DVec3,
    /// Whether a gap is that thin, rather than a part of the solid.
    pub is_gap: bool,
    /// Whether all of them are edges, tips and rims of what grows to something that the grid shows. No grid shows all
    /// of such an edge.
    pub is_wedge: bool,
    /// Whether the search was ended before all cells were looked into.
    pub ended: bool,
}

impl ThinCells {
    /// The result for a grid that sees everything.
    pub const NONE: Self = Self {
        count: 0,
        bounds: Aabb::EMPTY,
        thickness: f64::INFINITY,
        at: DVec3::ZERO,
        is_gap: false,
        is_wedge: false,
        ended: false,
    };

    /// The result for cells that were not looked into.
    pub(super) const ENDED: Self = Self { ended: true, ..Self::NONE };

    /// The number of cells along the longest side of a grid in which the hidden parts would be two cells
    /// thick. `None` if nothing hides but wedges, its thickness is not known, or no grid can be so fine.
    pub fn cells_needed(&self, grid: &Grid) -> Option<usize> {
        let needed = (2.0 * grid.bounds().size().max_element() / self.thickness).ceil();
        (self.count > 0 && !self.is_wedge && needed > 0.0 && needed <= Grid::MAX_CELLS as f64)
            .then_some(needed as usize)
    }

    /// The cells of two parts of a grid.
    pub(super) fn and(self, other: Self) -> Self {
        // a wall says more than the edge of a wedge
        let before = |a: &Self, b: &Self| (a.is_wedge, a.thickness) < (b.is_wedge, b.thickness);
        let is_other = other.count > 0 && (self.count == 0 || before(&other, &self));
        let thinner = if is_other { other } else { self };
        let (count, bounds) = (self.count + other.count, self.bounds.union(&other.bounds));
        Self { count, bounds, ended: self.ended || other.ended, ..thinner }
    }
}
