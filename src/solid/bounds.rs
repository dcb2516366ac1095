//! Where a solid is: a box that provably contains it, made tight by subdivision with guaranteed ranges.

use crate::field::Field;
use crate::geom::Aabb;
use glam::DVec3;

/// What is known about the extent of a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bounds {
    /// ω > 0 nowhere in the cube of half-side 2²⁰ around the origin: proven.
    Empty,
    /// The solid lies in this box: proven. Each face is within a millionth of the longest side of the solid itself
    /// where the budget of the proof allowed it.
    Within(Aabb),
    /// No such box was found within that cube.
    Unbounded,
}

/// Half the side of the cube around the origin in which solids are looked for.
pub const SEARCH_RADIUS: f64 = 1_048_576.0;

/// Cells kept undecided on one level: beyond it the box found so far has to do.
const MOST_CELLS: usize = 50_000;

/// Cells along the longest side at which the first search ends.
const ENOUGH_CELLS: f64 = 24.0;

/// Ranges spent on one attempt to move one face.
const PROOF_BUDGET: usize = 3_000;

/// Attempts for each face: each halves the uncertainty.
const FACE_STEPS: usize = 24;

impl Bounds {
    /// The box, if the solid has one.
    pub fn aabb(&self) -> Option<Aabb> {
        match self {
            Self::Within(aabb) => Some(*aabb),
            Self::Empty | Self::Unbounded => None,
        }
    }
}

/// Looks for the solid in the whole search cube.
pub(super) fn find(field: &impl Field) -> Bounds {
    let everything = Aabb::new(DVec3::splat(-SEARCH_RADIUS), DVec3::splat(SEARCH_RADIUS));
    let Some(hull) = coarse_hull(field, everything) else { return Bounds::Empty };
    let touches = hull.min.cmple(everything.min).any() || hull.max.cmpge(everything.max).any();
    if touches {
        return Bounds::Unbounded;
    }
    Bounds::Within(tighten(field, hull))
}

/// Level by level: cells that may hold a part of the solid are divided, the others dropped.
fn coarse_hull(field: &impl Field, everything: Aabb) -> Option<Aabb> {
    let mut cells = vec![everything];
    loop {
        let kept: Vec<Aabb> = cells.iter().copied().filter(|cell| may_be_inside(field, cell)).collect();
        let hull = kept.iter().fold(Aabb::EMPTY, |hull, cell| hull.union(cell));
        let first = kept.first()?;
        let fine = hull.size().max_element() >= ENOUGH_CELLS * first.size().max_element();
        // below this a cell is a point in double precision: a solid of no extent, or a range that never decides
        let exhausted = first.size().max_element() < 1e-12 || kept.len() > MOST_CELLS;
        if fine || exhausted {
            return Some(hull);
        }
        cells = kept.iter().flat_map(octants).collect();
    }
}

fn octants(cell: &Aabb) -> [Aabb; 8] {
    let centre = cell.centre();
    cell.corners().map(|corner| Aabb::new(corner.min(centre), corner.max(centre)))
}

fn may_be_inside(field: &impl Field, cell: &Aabb) -> bool {
    // NaN bounds cannot occur; a range without a positive part proves that no point is inside
    field.range(cell).hi > 0.0
}

/// Whether ω > 0 nowhere in the box, as far as `budget` ranges can prove it.
pub fn prove_empty(field: &impl Field, over: Aabb, budget: usize) -> bool {
    let mut stack = vec![over];
    let mut left = budget;
    while let Some(cell) = stack.pop() {
        if left == 0 {
            return false;
        }
        left -= 1;
        if may_be_inside(field, &cell) {
            // a point inside ends the attempt at once
            if field.omega(cell.centre()) > 0.0 {
                return false;
            }
            stack.extend(cell.halves());
        }
    }
    true
}

/// Moves each face inwards as far as the slab that is cut off is proven empty.
fn tighten(field: &impl Field, hull: Aabb) -> Aabb {
    let mut bounds = hull;
    let goal = 1e-6 * hull.size().max_element();
    for axis in 0..3 {
        for upper in [false, true] {
            // between `near` (known to be needed or not yet proven) and `far` (proven to be outside)
            let mut far = if upper { bounds.max[axis] } else { bounds.min[axis] };
            let mut near = bounds.centre()[axis];
            for _ in 0..FACE_STEPS {
                if (far - near).abs() <= goal {
                    break;
                }
                let middle = 0.5 * (near + far);
                let mut slab = bounds;
                if upper {
                    slab.min[axis] = middle;
                } else {
                    slab.max[axis] = middle;
                }
                if prove_empty(field, slab, PROOF_BUDGET) {
                    far = middle;
                    if upper {
                        bounds.max[axis] = middle;
                    } else {
                        bounds.min[axis] = middle;
                    }
                } else {
                    near = middle;
                }
            }
        }
    }
    bounds
}
