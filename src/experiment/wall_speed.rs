//! How fast the walls of a scene move at most.

use std::sync::Arc;

use glam::DVec3;

use crate::Solid;
use crate::geom::Aabb;
use crate::sph::{Slip, VectorField};

/// Times of a run at which a wall is looked at.
const TIMES: usize = 96;

/// Starts along each axis of the box, from which places of the surface are sought.
const SIDE: usize = 6;

/// Steps of Newton's method onto the surface.
const STEPS: usize = 3;

/// The part of the box's longest side within which a place counts as one of the surface.
const NEAR: f64 = 1e-3;

/// The greatest speed, m/s, with which a solid's surface drives the fluid in a box during a run: that along its normal, or
/// the whole if the fluid sticks to it; `belt` is its motion within the surface where that is stated. Zero for a solid at
/// rest.
///
/// It is found at some places and times, so a wall that moves during a hundredth of the run alone may be missed. Solids of
/// many parts are not looked at: their gradients would be one large program, which nothing else needs.
pub(super) fn greatest(
    solid: &Solid,
    (slip, belt): (Slip, Option<Arc<VectorField>>),
    domain: &Aabb,
    until: f64,
) -> f64 {
    let belt = belt.filter(|_| slip == Slip::No);
    if !(solid.moves() || belt.is_some()) || solid.has_many_leaves() {
        return 0.0;
    }
    let mut greatest = 0.0;
    for k in 0..TIMES {
        let time = until * (k as f64 + 0.5) / TIMES as f64;
        let now = solid.at(time);
        for place in 0..SIDE.pow(3) {
            let Some((p, normal)) = on_surface(&now, domain, place) else { continue };
            let velocity = now.wall_velocity(p);
            let along = match (slip, &belt) {
                (Slip::Free, _) => 0.0,
                (Slip::No, Some(belt)) => belt(p, time).length(),
                (Slip::No, None) => velocity.length(),
            };
            let speed = velocity.dot(normal).abs().max(along);
            if speed.is_finite() {
                greatest = f64::max(greatest, speed);
            }
        }
    }
    greatest
}

/// A place of a solid's surface in a box and its normal there, sought from one of the starts.
fn on_surface(solid: &Solid, domain: &Aabb, start: usize) -> Option<(DVec3, DVec3)> {
    let part = |k: usize| (k as f64 + 0.5) / SIDE as f64;
    let part = DVec3::new(part(start % SIDE), part(start / SIDE % SIDE), part(start / (SIDE * SIDE)));
    let mut p = domain.min + domain.size() * part;
    let mut last = f64::INFINITY;
    let mut normal = DVec3::ZERO;
    for _ in 0..STEPS {
        let (omega, gradient) = solid.omega_grad(p);
        let slope = gradient.length();
        normal = -gradient / slope;
        last = omega / slope;
        p += last * normal;
    }
    let found = last.abs() <= NEAR * domain.size().max_element() && normal.is_finite() && domain.contains(p);
    found.then_some((p, normal))
}
