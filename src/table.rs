//! Fields that are looked up and not computed from a formula: what a graph may have as a leaf beside its operations.

use std::fmt::Debug;

use glam::DVec3;

use crate::geom::Aabb;
use crate::interval::Interval;

/// A field with a value and a gradient at every point whose coordinates are finite.
///
/// A value depends on the point alone, to the bit: programs and the interpreter may ask in any order, from any thread.
pub trait Table: Debug + Send + Sync {
    /// The value and its gradient. All numbers are NaN where a coordinate is not finite.
    fn at(&self, p: DVec3) -> Sample;

    /// An interval that holds the value at every point of a box, exact or computed. Ends of the box may be infinite.
    fn range(&self, over: &Aabb) -> Interval;

    /// For each axis, an interval that holds the derivative along it at every point of a box, exact or
    /// computed. Ends of the box may be infinite.
    fn slopes(&self, over: &Aabb) -> [Interval; 3];

    /// A box around the points whose value is at least `least`.
    fn reach(&self, least: f64) -> Aabb;

    /// The surface where the value is 0, if that is a list of triangles, and positive inside: the corners, and three
    /// of their numbers for each triangle, counter-clockwise from outside.
    fn triangles(&self) -> Option<(Vec<DVec3>, Vec<[u32; 3]>)> {
        None
    }

    /// What it is, with its article, in messages.
    fn what(&self) -> &'static str;

    /// A hash of the values, which distinguishes this table from others.
    fn fingerprint(&self) -> String;
}

/// What a table has at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The value.
    pub value: f64,
    /// Its gradient.
    pub gradient: DVec3,
}

impl Sample {
    /// No numbers.
    pub const NAN: Self = Self { value: f64::NAN, gradient: DVec3::NAN };
}
