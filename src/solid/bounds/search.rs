//! Where a solid is: a box that provably contains it, made tight by subdivision with guaranteed ranges.

use std::sync::Arc;

use glam::DVec3;

use super::extent::Bounds;
use crate::geom::Aabb;
use crate::solid::construction::Solid;
use crate::solid::leaves::leaf_set::LeafTree;
use crate::solid::leaves::pruning::{Verdict, prune};

/// Half the side of the cube around the origin in which solids are looked for.
pub const SEARCH_RADIUS: f64 = 1_048_576.0;

/// Cells kept undecided on one level. Beyond it the search ends with the box that it has found.
const MOST_CELLS: usize = 50_000;

/// Cells along the longest side at which the first search ends.
const ENOUGH_CELLS: f64 = 24.0;

/// Ranges spent on one attempt to move one face.
const PROOF_BUDGET: usize = 3_000;

/// Attempts for each face: each halves the uncertainty.
const FACE_STEPS: usize = 24;

/// What tells whether a box may hold a part of the solid, the better the smaller the box.
trait Probe {
    /// What is known of a box, handed on to the boxes within it.
    type Known: Clone;
    fn everything(&self) -> Self::Known;
    /// What is known of a box that lies within another one, of which `known` holds; `None` if it is proven to
    /// be outside.
    fn look(&self, known: &Self::Known, cell: &Aabb) -> Option<Self::Known>;
    fn is_inside(&self, known: &Self::Known, p: DVec3) -> bool;
}

/// Asks for the range of the whole solid.
struct Whole<'a>(&'a Solid);

impl Probe for Whole<'_> {
    type Known = ();

    fn everything(&self) {}

    fn look(&self, (): &(), cell: &Aabb) -> Option<()> {
        // a range without a positive part proves that no point is inside
        (self.0.range(cell).hi > 0.0).then_some(())
    }

    fn is_inside(&self, (): &(), p: DVec3) -> bool {
        self.0.sign(p) > 0.0
    }
}

/// Asks only for the ranges of the leaves that still matter in a box.
struct ByLeaves<'a> {
    parts: &'a LeafTree,
}

impl Probe for ByLeaves<'_> {
    /// What is left of the solid; `None` if the box is inside it.
    type Known = Option<Arc<[u32]>>;

    fn everything(&self) -> Self::Known {
        Some(self.parts.words.clone())
    }

    fn look(&self, known: &Self::Known, cell: &Aabb) -> Option<Self::Known> {
        let Some(words) = known else { return Some(None) };
        let mut left = Vec::new();
        match prune(words, &mut |leaf| self.parts.leaves.range(leaf, cell), &mut left) {
            Verdict::Outside => None,
            Verdict::Inside => Some(None),
            Verdict::Near => Some(Some(left.into())),
        }
    }

    fn is_inside(&self, known: &Self::Known, p: DVec3) -> bool {
        known.as_ref().is_none_or(|words| self.parts.leaves.decide(words, &mut 0, p).0 > 0.0)
    }
}

impl Solid {
    /// Where the solid is; found on first use by subdivision, then kept.
    pub fn bounds(&self) -> &Bounds {
        self.moment.bounds(|| find(self))
    }
}

/// Looks for the solid in the whole search cube.
fn find(solid: &Solid) -> Bounds {
    match solid.parts() {
        Some(parts) => search(&ByLeaves { parts: &parts }),
        None => search(&Whole(solid)),
    }
}

fn search<P: Probe>(probe: &P) -> Bounds {
    let everything = Aabb::new(DVec3::splat(-SEARCH_RADIUS), DVec3::splat(SEARCH_RADIUS));
    let Some((hull, known)) = coarse_hull(probe, everything) else { return Bounds::Empty };
    let touches = hull.min.cmple(everything.min).any() || hull.max.cmpge(everything.max).any();
    if touches {
        return Bounds::Unbounded;
    }
    Bounds::Within(tighten(probe, &known, hull))
}

/// A box around the solid, and what is known of it. Cells that may hold a part of the solid are divided level
/// by level, the others are dropped. `None` if no cell is left.
fn coarse_hull<P: Probe>(probe: &P, everything: Aabb) -> Option<(Aabb, P::Known)> {
    let mut cells = vec![(everything, probe.everything())];
    loop {
        let look = |(cell, known): &(Aabb, P::Known)| Some((*cell, probe.look(known, cell)?));
        let kept: Vec<(Aabb, P::Known)> = cells.iter().filter_map(look).collect();
        let hull = kept.iter().fold(Aabb::EMPTY, |hull, (cell, _)| hull.union(cell));
        let (first, _) = kept.first()?;
        let fine = hull.size().max_element() >= ENOUGH_CELLS * first.size().max_element();
        // below this a cell is a point in double precision: a solid of no extent, or a range that never
        // decides
        let exhausted = first.size().max_element() < 1e-12 || kept.len() > MOST_CELLS;
        if fine || exhausted {
            let known = probe.look(&probe.everything(), &hull)?;
            return Some((hull, known));
        }
        let octants = |(cell, known): &(Aabb, P::Known)| {
            let centre = cell.centre();
            cell.corners().map(|corner| (Aabb::new(corner.min(centre), corner.max(centre)), known.clone()))
        };
        cells = kept.iter().flat_map(octants).collect();
    }
}

/// Whether it can be proven within a budget of looks that no point of the box is inside.
fn prove_empty<P: Probe>(probe: &P, known: &P::Known, over: Aabb) -> bool {
    let mut stack = vec![(over, known.clone())];
    let mut left = PROOF_BUDGET;
    while let Some((cell, known)) = stack.pop() {
        if left == 0 {
            return false;
        }
        left -= 1;
        if let Some(known) = probe.look(&known, &cell) {
            // a point inside ends the attempt at once
            if probe.is_inside(&known, cell.centre()) {
                return false;
            }
            stack.extend(cell.halves().map(|half| (half, known.clone())));
        }
    }
    true
}

/// Moves each face inwards as far as the slab that is cut off is proven empty.
fn tighten<P: Probe>(probe: &P, known: &P::Known, hull: Aabb) -> Aabb {
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
                if prove_empty(probe, known, slab) {
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
