//! A cube beyond which a formula is proven to be positive nowhere.
//!
//! Far out a formula is decided by the direction, and each of its parts by the power with which it grows: the cells
//! are boxes of directions here, and each stands for the points at all distances between two bounds. The first step
//! asks for the points beyond 2¹⁰⁰, the next ones for those between a smaller cube and the last one that was proven.

use glam::DVec3;

use super::contractor::{Contractor, Wanted};
use super::far::Far;
use super::growth::Scales;
use super::sets::Contracted;
use crate::geom::Aabb;

/// Exponent of the first cube. Solids are smaller.
const FIRST: f64 = 100.0;

/// Exponent of the smallest cube.
const LAST: f64 = -100.0;

/// The part of the visits to nodes that each cube but the first may take.
const PART_OF_STEP: usize = 10;

/// How often a face of the cube is cut in two, at most. A cell is a thousandth of it then.
const MOST_CUTS: u32 = 20;

/// A cube around the origin that holds all points within `farthest` of it, along each axis, at which a formula is as
/// wanted; `None` if there is no proof. About so many nodes are visited for it.
pub fn cube_around(
    contractor: &Contractor,
    wanted: Wanted<'_>,
    farthest: f64,
    most_visits: usize,
) -> Option<Aabb> {
    let outside = Outside { contractor, wanted };
    let mut visits = most_visits;
    let mut proven = FIRST;
    if !outside.is_empty(Scales { from: FIRST, to: farthest.log2() }, &mut visits) {
        return None;
    }
    // the exponents between which the smallest cube is
    let mut too_small = LAST;
    while proven - too_small > 1.0 {
        let from = (0.5 * (proven + too_small)).round();
        let mut visits = most_visits / PART_OF_STEP;
        if outside.is_empty(Scales { from, to: proven }, &mut visits) {
            proven = from;
        } else {
            too_small = from;
        }
    }
    let half = DVec3::splat(proven.exp2());
    Some(Aabb::new(-half, half))
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
