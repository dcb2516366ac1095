//! What decides near the cells of a box that hold no surface: the leaves that matter within a distance of each.
//!
//! Gradients are asked for off the surface in few places, so the box is divided only where somebody asks: a cell
//! is found from the one that holds it, down to those of the flat grid.
//!
//! Invariant: what a cell keeps depends on the cell alone, and not on what was asked before.

use std::sync::OnceLock;

use glam::{DVec3, UVec3};

use super::grid::{DEPTH, SIDE, bounds, judged, octant};
use crate::geom::Aabb;
use crate::solid::leaves::leaf_set::LeafTree;
use crate::solid::leaves::pruning::Verdict;

/// A box that is divided on demand.
pub(super) struct Surroundings {
    domain: Aabb,
    /// Cells of the flat grid for each unit of length.
    per_length: DVec3,
    /// How far cells are grown.
    margin: f64,
    whole: OnceLock<Part>,
}

/// A cell at some depth.
struct Part {
    verdict: Verdict,
    /// What is left of the solid, in prefix form.
    words: Vec<u32>,
    octants: [OnceLock<Box<Self>>; 8],
}

impl Part {
    fn new((verdict, words): (Verdict, Vec<u32>)) -> Self {
        Self { verdict, words, octants: Default::default() }
    }
}

impl Surroundings {
    pub fn new(domain: Aabb, margin: f64) -> Self {
        Self { domain, per_length: f64::from(SIDE) / domain.size(), margin, whole: OnceLock::new() }
    }

    /// The cell of a point within the box, if something decides near it: its number.
    pub fn find(&self, parts: &LeafTree, p: DVec3) -> Option<u32> {
        let q = (p - self.domain.min) * self.per_length;
        let within = q.cmpge(DVec3::ZERO).all() && q.cmple(DVec3::splat(f64::from(SIDE))).all();
        if !within {
            return None;
        }
        let at = q.as_uvec3().min(UVec3::splat(SIDE - 1));
        self.part(parts, at)?;
        Some((at.z * SIDE + at.y) * SIDE + at.x)
    }

    /// What is left of the solid in a cell that [`Self::find`] has found; nothing elsewhere.
    pub fn words(&self, parts: &LeafTree, cell: u32) -> &[u32] {
        let at = UVec3::new(cell % SIDE, cell / SIDE % SIDE, cell / (SIDE * SIDE));
        self.part(parts, at).map_or(&[], |part| &part.words)
    }

    /// A cell of the flat grid; `None` if nothing decides near it.
    fn part(&self, parts: &LeafTree, at: UVec3) -> Option<&Part> {
        let judge = |depth: u32, at: UVec3, words: &[u32]| {
            Part::new(judged(parts, &bounds(&self.domain, depth, at).grown(self.margin), words))
        };
        let mut part = self.whole.get_or_init(|| judge(0, UVec3::ZERO, &parts.words));
        let mut place = UVec3::ZERO;
        for depth in 1..=DEPTH {
            if part.verdict != Verdict::Near {
                return None;
            }
            let k = (at >> (DEPTH - depth)) & UVec3::ONE;
            let k = (k.z << 2 | k.y << 1 | k.x) as usize;
            place = octant(place, k);
            part = part.octants[k].get_or_init(|| Box::new(judge(depth, place, &part.words)));
        }
        (part.verdict == Verdict::Near).then_some(part)
    }
}
