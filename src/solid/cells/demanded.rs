//! The leaves that decide in and near the cells of a box, found on demand.
//!
//! Gradients off the surface are needed in few places, and continuous values only near the surface. So a cell
//! is divided when a point in it is asked for, down to the cells of the flat grid.
//!
//! Invariant: what a cell keeps depends on the cell alone, and not on what was asked before.

use std::sync::OnceLock;

use glam::{DVec3, UVec3};

use super::grid::{DEPTH, SIDE, bounds, judged, octant};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::solid::leaves::leaf_set::LeafTree;
use crate::solid::leaves::pruning::{Verdict, deciding};
use crate::solid::leaves::words::leaf_count;

/// Cells with no more leaves than this are not divided where values are kept: they cost less than what is gained.
const FEW_LEAVES: usize = 8;

/// What of the solid a cell keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Keeps {
    /// What decides the sign in the cell and within the margin around it; nothing where no surface is.
    Surface,
    /// What decides the value of the twin in the cell.
    Value,
}

/// A box that is divided on demand.
pub(super) struct Demanded {
    domain: Aabb,
    /// Cells of the flat grid for each unit of length.
    per_length: DVec3,
    keeps: Keeps,
    /// How far cells are grown.
    margin: f64,
    whole: OnceLock<Part>,
}

/// A cell at some depth.
struct Part {
    /// What is left of the solid, in prefix form; empty where nothing decides.
    words: Vec<u32>,
    /// Whether it is not divided.
    is_final: bool,
    octants: [OnceLock<Box<Self>>; 8],
}

impl Demanded {
    /// A box whose cells keep something of the solid, and are grown by a positive margin.
    pub fn new(domain: Aabb, keeps: Keeps, margin: f64) -> Self {
        let per_length = f64::from(SIDE) / domain.size();
        Self { domain, per_length, keeps, margin, whole: OnceLock::new() }
    }

    /// The cell of a point within the box, if something decides there: its number.
    pub fn find(&self, parts: &LeafTree, p: DVec3) -> Option<u32> {
        let q = (p - self.domain.min) * self.per_length;
        let within = q.cmpge(DVec3::ZERO).all() && q.cmple(DVec3::splat(f64::from(SIDE))).all();
        if !within {
            return None;
        }
        let at = q.as_uvec3().min(UVec3::splat(SIDE - 1));
        (!self.part(parts, at).words.is_empty()).then_some((at.z * SIDE + at.y) * SIDE + at.x)
    }

    /// What is left of the solid in a cell that [`Self::find`] has found; nothing elsewhere.
    pub fn words(&self, parts: &LeafTree, cell: u32) -> &[u32] {
        let at = UVec3::new(cell % SIDE, cell / SIDE % SIDE, cell / (SIDE * SIDE));
        &self.part(parts, at).words
    }

    /// The smallest known part that holds a cell of the flat grid.
    fn part(&self, parts: &LeafTree, at: UVec3) -> &Part {
        let mut part = self.whole.get_or_init(|| self.kept(parts, (0, UVec3::ZERO), &parts.words));
        let mut place = UVec3::ZERO;
        for depth in 1..=DEPTH {
            if part.is_final {
                break;
            }
            let k = (at >> (DEPTH - depth)) & UVec3::ONE;
            let k = (k.z << 2 | k.y << 1 | k.x) as usize;
            place = octant(place, k);
            part = part.octants[k].get_or_init(|| Box::new(self.kept(parts, (depth, place), &part.words)));
        }
        part
    }

    /// What a cell keeps of the words of the one that holds it.
    fn kept(&self, parts: &LeafTree, (depth, at): (u32, UVec3), words: &[u32]) -> Part {
        let over = bounds(&self.domain, depth, at).grown(self.margin);
        let words = match self.keeps {
            Keeps::Surface => match judged(parts, &over, words) {
                (Verdict::Near, left) => left,
                (Verdict::Inside | Verdict::Outside, _) => Vec::new(),
            },
            Keeps::Value => deciding(words, &mut |leaf| {
                let range = parts.leaves.range_among_many(leaf, &over);
                // the unknown stays unknown
                let factor = Interval::point(parts.leaves.factor(leaf));
                if range == Interval::ALL { range } else { range * factor }
            }),
        };
        let is_final = match self.keeps {
            Keeps::Surface => words.is_empty(),
            Keeps::Value => leaf_count(&words) <= FEW_LEAVES,
        };
        Part { words, is_final, octants: Default::default() }
    }
}
