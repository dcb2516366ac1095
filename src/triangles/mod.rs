//! Solids whose surface is a list of triangles, as files from elsewhere have them, and the distance from it.
//!
//! The distance is exact: that of the nearest point of the surface, which a tree of boxes finds. Its sign is that of
//! the nearest triangle's plane, or of the pseudonormal of the nearest edge or corner (Bærentzen and Aanæs 2005): the
//! sum of the normals around it, each with the angle at the corner as its weight. Where triangles without an area meet
//! there, or shells touch, the sign is that of the surfaces that a ray passes.
//!
//! | file | what it holds |
//! |---|---|
//! | `read` | STL, OBJ and PLY files |
//! | `surface` | triangles that share their corners; whether they are closed |
//! | `tree` | which triangle is nearest, which ones a ray passes |
//! | `boxes` | the boxes of the tree |
//! | `nearest` | the point of one triangle that is nearest |
//! | `memory` | what a thread has just found |
//!
//! Invariant: a value depends on the point alone, to the bit, and not on what was asked before.

mod boxes;
mod memory;
mod nearest;
mod read;
mod surface;
mod tree;

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::geom::Aabb;
use crate::interval::Interval;
use crate::table::{Sample, Table};
use nearest::Feature;
use surface::Surface;
use tree::{ROUNDED, Tree, width};

pub use read::{FORMATS, is_known, read};
pub use surface::NotClosed;

/// Points nearer to the surface than this, relative to the size of the solid, have the gradient of the surface: the way
/// to the nearest point has lost its digits there.
const ON_SURFACE: f64 = 1e-10;

/// A pseudonormal decides the side of a point if the cosine of the angle between them is larger.
const CLEAR_COSINE: f64 = 1e-7;

/// What rounding may add to a distance, relative to the coordinates.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Normals whose sums may be shorter than this say nothing of their directions.
const LEAST_SUM: f64 = 0.2;

/// What rounding may add to a component of a gradient, at the distance [`ON_SURFACE`] from an edge.
const SLOPE_ROUNDING: f64 = 1e-5;

/// The longest gradient that is found, whose exact length is 1.
const LONGEST_SLOPE: f64 = 1.0 + 1e-12;

/// A solid with a closed surface of triangles.
pub struct TriangleSolid {
    surface: Surface,
    tree: Tree,
    /// For all of the process.
    number: u64,
    hash: blake3::Hash,
}

impl TriangleSolid {
    /// A solid from the corners of its triangles, in counter-clockwise order from outside. If all are in the other
    /// order they are turned over.
    ///
    /// # Errors
    /// What keeps the triangles from enclosing a solid.
    pub fn new(triangles: &[[DVec3; 3]]) -> Result<Self, NotClosed> {
        let surface = Surface::new(triangles)?;
        let tree = Tree::new(&surface);
        let mut hasher = blake3::Hasher::new();
        for coordinate in triangles.iter().flatten().flat_map(|corner| corner.to_array()) {
            hasher.update(&coordinate.to_bits().to_le_bytes());
        }
        static NEXT: AtomicU64 = AtomicU64::new(1);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let solid = Self { surface, tree, number, hash: hasher.finalize() };
        solid.is_simple()?;
        Ok(solid)
    }

    /// Refuses surfaces that run through themselves. No edge passes through a triangle, and on one side of each triangle
    /// there is the solid, on the other there is none; that is asked at the centre of each triangle.
    fn is_simple(&self) -> Result<(), NotClosed> {
        let centre = |triangle: u32| {
            let [a, b, c] = self.surface.corners_of(triangle);
            (a + b + c) / 3.0
        };
        let is_wrong = |triangle: &u32| {
            // a rounded corner may turn it over
            if width(self.surface.corners_of(*triangle)) <= ROUNDED * self.surface.size {
                return false;
            }
            let Some(normal) = self.surface.normal_of(*triangle) else { return false };
            let beside = self.tree.crossings(&self.surface, centre(*triangle), Some(*triangle));
            beside.is_some_and(|beside| {
                let expected = i32::from(beside.direction.dot(normal) < 0.0);
                beside.touches || beside.winding != expected
            })
        };
        let mut wrong: Vec<u32> = (0..self.surface.len() as u32).into_par_iter().filter(is_wrong).collect();
        wrong.sort_unstable();
        if let Some(&first) = wrong.first() {
            return Err(NotClosed::Overlap { count: wrong.len(), at: centre(first) });
        }
        // the other triangle at an edge has it the other way round
        let edges = (0..self.surface.len() as u32).into_par_iter().flat_map_iter(|triangle| {
            let [a, b, c] = self.surface.numbers_of(triangle);
            [[a, b], [b, c], [c, a]].into_iter().filter(|[from, to]| from < to)
        });
        let pierced: Vec<DVec3> = edges.filter_map(|edge| self.tree.pierced(&self.surface, edge)).collect();
        match pierced.first() {
            Some(&at) => Err(NotClosed::Crossing { count: pierced.len(), at }),
            None => Ok(()),
        }
    }

    fn signed(&self, p: DVec3, triangle: u32, nearest: nearest::Nearest) -> Sample {
        let distance = nearest.square.sqrt();
        let (normal, is_clear) = self.surface.normal_at(triangle, nearest.feature);
        if let Feature::Face { above, .. } = nearest.feature {
            // the plane gives more digits than the nearest point does
            return Sample { value: -above, gradient: -normal };
        }
        let offset = p - nearest.point;
        let cosine = normal.dot(offset);
        let length = normal.length();
        let is_inside = if is_clear && cosine.abs() > CLEAR_COSINE * distance * length {
            cosine < 0.0
        } else {
            let passed = self.tree.crossings(&self.surface, p, None).filter(|passed| !passed.touches);
            passed.map_or(cosine < 0.0, |passed| passed.winding > 0)
        };
        let side = if is_inside { 1.0 } else { -1.0 };
        let gradient = if distance > ON_SURFACE * self.surface.size {
            side * offset / distance
        } else if length > 0.0 {
            -normal / length
        } else {
            -self.surface.face_normal(triangle)
        };
        Sample { value: side * distance, gradient }
    }
}

impl Table for TriangleSolid {
    /// The distance from the surface, positive inside, and its gradient, of length 1.
    fn at(&self, p: DVec3) -> Sample {
        let p = p + DVec3::ZERO; // −0 is 0
        if !p.is_finite() {
            return Sample::NAN;
        }
        memory::remembered(self.number, p, |last| {
            let (place, nearest) = self.tree.nearest(&self.surface, p, last);
            (self.signed(p, self.tree.triangle(place), nearest), place)
        })
    }

    /// The distance changes by at most the distance between two points.
    fn range(&self, over: &Aabb) -> Interval {
        let bounds = self.surface.bounds;
        let deepest = 0.5 * bounds.size().min_element();
        let far = over.min.abs().max(over.max.abs()).max(bounds.min.abs()).max(bounds.max.abs());
        let slack = ROUNDING * far.max_element();
        let (centre, half) = (over.centre(), 0.5 * over.size());
        if !(centre.is_finite() && half.is_finite() && slack.is_finite()) {
            return Interval { lo: f64::NEG_INFINITY, hi: (deepest * (1.0 + 1e-9)).next_up() };
        }
        let apart = (over.min - bounds.max).max(bounds.min - over.max).max(DVec3::ZERO).length();
        let reach = half.length();
        let value = self.at(centre).value;
        let most = if apart > 0.0 { -apart } else { deepest };
        Interval { lo: value - reach - slack, hi: (value + reach).min(most) + slack }
    }

    /// The way to the nearest point is along the normal of its triangle or, on an edge or at a corner, along
    /// a sum of the normals there with positive weights. The triangles that are nearest to some point of the
    /// box are at most twice its radius farther from its centre than the nearest one.
    fn slopes(&self, over: &Aabb) -> [Interval; 3] {
        let any = [Interval { lo: -LONGEST_SLOPE, hi: LONGEST_SLOPE }; 3];
        let (centre, radius) = (over.centre(), 0.5 * over.size().length());
        if !(centre.is_finite() && radius.is_finite()) {
            return any;
        }
        let slack = ROUNDING * (self.surface.size + centre.abs().max_element() + radius);
        let reach = self.at(centre).value.abs() + 2.0 * radius + slack;
        let Some((low, high, sum)) = self.tree.normals_within(&self.surface, centre, reach) else {
            return any;
        };
        // a sum of unit normals, with weights whose sum is 1, is at least as long as this
        let middle = sum.normalize_or_zero();
        let shortest = (0..3).map(|i| (middle[i] * low[i]).min(middle[i] * high[i])).sum::<f64>();
        if shortest < LEAST_SUM {
            return any;
        }
        std::array::from_fn(|i| {
            let (low, high) = (-high[i], -low[i]); // ω grows inwards
            let widest = |end: f64, other: f64| end.min(end / shortest).min(other);
            let lo = widest(low, any[i].hi) - SLOPE_ROUNDING;
            let hi = -widest(-high, any[i].hi) + SLOPE_ROUNDING;
            Interval { lo: lo.max(any[i].lo), hi: hi.min(any[i].hi) }
        })
    }

    /// A point inside is as far from the sides of the box around the solid as it is from the surface, or farther.
    fn reach(&self, least: f64) -> Aabb {
        let bounds = self.surface.bounds;
        if !least.is_finite() {
            return Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        }
        let slack = ROUNDING * (bounds.min.abs().max(bounds.max.abs()).max_element() + least.abs());
        bounds.grown(slack - least)
    }

    fn triangles(&self) -> Option<(Vec<DVec3>, Vec<[u32; 3]>)> {
        Some(self.surface.parts())
    }

    fn what(&self) -> &'static str {
        "a mesh"
    }

    fn fingerprint(&self) -> String {
        self.hash.to_hex()[..16].to_string()
    }
}

impl fmt::Debug for TriangleSolid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "TriangleSolid({} triangles, {})", self.surface.len(), Table::fingerprint(self))
    }
}

#[cfg(test)]
mod tests;
