//! A cube beyond which a formula is proven to be positive nowhere.
//!
//! Far out a formula is decided by the direction, and each of its parts by the power with which it grows: the cells
//! are boxes of directions here, and each stands for the points at all distances between two bounds. The first step
//! asks for the points beyond 2¹⁰⁰, the next ones for those between a smaller cube and the last one that was proven.

use glam::DVec3;

use super::search::SEARCH_RADIUS;
use super::whole::at_its_time;
use crate::geom::Aabb;
use crate::ir::{Contracted, Contractor, Far, Region, Scales, Wanted};
use crate::solid::construction::Solid;

/// Exponent of the first cube. Solids are smaller.
const FIRST: f64 = 100.0;

/// Exponent of the smallest cube.
const LAST: f64 = -100.0;

/// Nodes visited for a cube: a second.
const MOST_VISITS: usize = 10_000_000;

/// How often a face of the cube is cut in two, at most. A cell is a thousandth of it then.
const MOST_CUTS: u32 = 20;

impl Solid {
    /// A cube around the origin that holds the solid, although its bounds were not found from near; `None` if there is
    /// no proof.
    pub(super) fn box_far_out(&self) -> Option<Aabb> {
        let (graph, root) = at_its_time(self);
        let contractor = Contractor::new(&graph, root);
        let region = Region { time: self.moment.interval(), ..Region::of(&Aabb::EMPTY) };
        let outside = Outside { contractor: &contractor, wanted: Wanted { region, negated: false } };
        let mut visits = MOST_VISITS;
        let mut proven = FIRST;
        if !outside.is_empty(Scales { from: FIRST, to: SEARCH_RADIUS.log2() }, &mut visits) {
            return None;
        }
        // the exponents between which the smallest cube is
        let mut too_small = LAST;
        while proven - too_small > 1.0 {
            let from = (0.5 * (proven + too_small)).round();
            let mut visits = MOST_VISITS / 10;
            if outside.is_empty(Scales { from, to: proven }, &mut visits) {
                proven = from;
            } else {
                too_small = from;
            }
        }
        let half = DVec3::splat(proven.exp2());
        Some(Aabb::new(-half, half))
    }
}

/// A formula that is positive nowhere far out, perhaps.
struct Outside<'a> {
    contractor: &'a Contractor,
    wanted: Wanted<'a>,
}

impl Outside<'_> {
    /// Whether the formula is proven to be positive nowhere at these distances.
    fn is_empty(&self, scales: Scales, visits: &mut usize) -> bool {
        let faces = (0..3).flat_map(|axis| [-1.0, 1.0].map(|end| (axis, end)));
        let mut waiting: Vec<(Aabb, u32)> = faces
            .map(|(axis, end)| {
                let (mut min, mut max) = (DVec3::NEG_ONE, DVec3::ONE);
                (min[axis], max[axis]) = (end, end);
                (Aabb::new(min, max), 0)
            })
            .collect();
        // the smallest cells first: one of them may be the end of it
        while let Some((directions, cuts)) = waiting.pop() {
            *visits = visits.saturating_sub(self.contractor.len());
            match self.contractor.far(&self.wanted, &Far { directions, scales }) {
                Contracted::Nowhere => {}
                Contracted::Somewhere if cuts < MOST_CUTS && *visits > 0 => {
                    waiting.extend(directions.halves().map(|half| (half, cuts + 1)));
                }
                Contracted::Somewhere | Contracted::Everywhere => return false,
            }
        }
        true
    }
}
