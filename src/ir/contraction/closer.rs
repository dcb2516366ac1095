//! A box around the points at which a formula is positive, made smaller by subdivision from each side.
//!
//! Contraction alone leaves a box far too large where a coordinate stands in several terms, as in x⁴ + y⁴ + z⁴ − xyz. The
//! farthest cell on a side is dropped or cut in two until one of its points is known to be as far out, nearly. All cells
//! that are left hold what the box held, so it can only be too large.

use glam::DVec3;

use super::contractor::{Contractor, Wanted};
use super::sets::Contracted;
use crate::geom::Aabb;
use crate::ir::bounds::range::Region;

/// How close to a point of the shape a side is moved, relative to the longest side.
const GOAL: f64 = 0.02;

/// Cells that are looked at for one side.
const CELLS_OF_SIDE: usize = 200;

/// Visits to nodes, of some hundredths of a second at most, and how many a cell takes: there and back for each of two halves.
const MOST_VISITS: usize = 1_000_000;
const WALKS_OF_CELL: usize = 4;

/// How often the sides are looked for, each time in a box of which the longest is less than half as long.
const MOST_REPEATS: usize = 4;

/// A smaller box around the points of `space` at which a formula is positive, at any time. `is_positive` says whether it is at a
/// point.
pub fn closer(contractor: &Contractor, mut space: Aabb, is_positive: impl Fn(DVec3) -> bool) -> Aabb {
    let cells = MOST_VISITS / (6 * MOST_REPEATS * WALKS_OF_CELL * contractor.len().max(1));
    let search = Search { contractor, is_positive, cells: cells.min(CELLS_OF_SIDE) };
    for _ in 0..MOST_REPEATS {
        let longest = space.size().max_element();
        for axis in 0..3 {
            for upper in [false, true] {
                space = search.cut(space, axis, upper);
                if space.is_empty() {
                    return space;
                }
            }
        }
        if space.size().max_element() > 0.5 * longest {
            break;
        }
    }
    space
}

struct Search<'a, F> {
    contractor: &'a Contractor,
    is_positive: F,
    /// Cells for one side.
    cells: usize,
}

impl<F: Fn(DVec3) -> bool> Search<'_, F> {
    /// A box with one of its sides nearer.
    fn cut(&self, space: Aabb, axis: usize, upper: bool) -> Aabb {
        let sign = if upper { 1.0 } else { -1.0 };
        let reach = |cell: &Aabb| if upper { cell.max[axis] } else { -cell.min[axis] };
        let goal = GOAL * space.size().max_element();
        let mut cells = vec![space];
        // how far out a point of the shape is known
        let mut found = f64::NEG_INFINITY;
        for _ in 0..self.cells {
            let farthest = (0..cells.len()).max_by(|&i, &j| reach(&cells[i]).total_cmp(&reach(&cells[j])));
            let Some(farthest) = farthest else { return Aabb::EMPTY };
            let cell = cells[farthest];
            let mut near = cell.centre();
            near[axis] = sign * (reach(&cell) - 0.5 * goal);
            for p in [cell.centre(), near] {
                if (self.is_positive)(p) {
                    found = found.max(sign * p[axis]);
                }
            }
            if reach(&cell) - found <= goal {
                break;
            }
            cells.swap_remove(farthest);
            for mut half in cell.halves_seen_from(DVec3::ZERO) {
                if self.holds_some(&mut half) {
                    cells.push(half);
                }
            }
        }
        cells.iter().fold(Aabb::EMPTY, |all, cell| all.union(cell)).intersection(&space)
    }
    /// Makes a cell smaller; whether it may hold points of the shape.
    fn holds_some(&self, cell: &mut Aabb) -> bool {
        let wanted = Wanted { region: Region::of(&Aabb::EMPTY), negated: false };
        let verdict = match self.contractor.contract(&wanted, cell, None) {
            Contracted::Somewhere => {
                let origin = cell.centre();
                self.contractor.contract_by_slopes(&wanted, cell, (origin, &mut Vec::new()))
            }
            verdict => verdict,
        };
        verdict != Contracted::Nowhere && !cell.is_empty()
    }
}
