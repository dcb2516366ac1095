//! What is known of the surface near a point.

use glam::DVec3;

/// The surface of a solid as seen from a point, see `ir::contact`: accurate near the surface, an estimate far
/// away. [`Solid::distance`](crate::Solid::distance) is slow and has a proof: a clearance that is never
/// too long, beside an estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Length, positive in the fluid, negative inside the solid.
    pub distance: f64,
    /// Outward unit normal of the face that is nearest; the mean of two at an edge; zero where there is none.
    pub normal: DVec3,
    /// Mean curvature of that face in 1/length, positive where the solid is convex: 1/R for a ball, 1/2R for
    /// a cylinder.
    pub mean_curvature: f64,
}

/// Velocities along the normal of one face agree more than this (cosine).
const SAME_FACE: f64 = 0.99;

/// Contacts that are nearer than this part of the coordinates are not compared with signs: their numbers end there.
pub(super) const SURE: f64 = 1e-9;

impl Contact {
    /// The place of the surface that was found from a point `p`; the point itself where none was.
    pub fn foot(&self, p: DVec3) -> DVec3 {
        let foot = p - self.distance * self.normal;
        if foot.is_finite() { foot } else { p }
    }

    /// The velocity of the face that was found from `p`, by a formula for that of the nearest face along its normal. Before
    /// an edge, where another face may be the nearest to the foot, it is that at `p`.
    pub(in crate::solid) fn velocity_at_foot(&self, p: DVec3, velocity: impl Fn(DVec3) -> DVec3) -> DVec3 {
        let [here, there] = [p, self.foot(p)].map(velocity);
        let is_same_face = here.dot(there) >= SAME_FACE * here.length() * there.length();
        if is_same_face { there } else { here }
    }
}
