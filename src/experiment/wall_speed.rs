//! How fast the walls of a scene move at most, and in which time they hardly move.

use std::sync::Arc;

use glam::DVec3;

use crate::Solid;
use crate::geom::Aabb;
use crate::sph::{Slip, VectorField};

/// Times of a run at which a wall is looked at.
const TIMES: usize = 96;

/// Starts along each axis of the box, from which places of the surface are sought.
const SIDE: usize = 6;

/// After which part of a run the speed of a wall is looked at once more.
const SOON: f64 = 1e-7;

/// How much of a way the change of a wall's speed may make: as much as a vibration of a hundredth of the support radius does
/// in a sixth of its period.
const CHANGE: f64 = 1.0 / 16.0;

/// Steps of Newton's method onto the surface.
const STEPS: usize = 3;

/// The part of the box's longest side within which a place counts as one of the surface.
const NEAR: f64 = 1e-3;

/// The greatest speed, m/s, with which a solid's surface drives the fluid in a box during a run: that along its normal, or
/// the whole if the fluid sticks to it; `belt` is its motion within the surface where that is stated. A surface with the
/// acceleration a raises pressures up to ρ·a·L in a box of the length L, as a speed of √(a·L) does: what swings fast without
/// getting far would else drive a fluid with a sound so slow that it resounds. Zero for a solid at rest.
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
    let (soon, reach) = (SOON * until, domain.size().max_element());
    let mut greatest = 0.0;
    at_places(solid, domain, until, |now, (p, normal)| {
        let velocity = now.wall_velocity(p);
        let along = match (slip, &belt) {
            (Slip::Free, _) => 0.0,
            (Slip::No, Some(belt)) => belt(p, now.time()).length(),
            (Slip::No, None) => velocity.length(),
        };
        let across = velocity.dot(normal);
        let later = solid.at(now.time() + soon).wall_velocity(p).dot(normal);
        let by_pressure = ((later - across).abs() / soon * reach).sqrt();
        let speeds = [across.abs(), along, by_pressure];
        greatest = speeds.into_iter().filter(|speed| speed.is_finite()).fold(greatest, f64::max);
    });
    greatest
}

/// A time, s, in which a solid's surface in a box moves by no more than `way`, m, along its normal, and in which its speed
/// changes by no more than a small part of that: at most the whole run. Found at some places and times, as [`greatest`] is.
pub(super) fn time_for(solid: &Solid, way: f64, domain: &Aabb, until: f64) -> f64 {
    let soon = SOON * until;
    let mut time = until;
    at_places(solid, domain, until, |now, (p, normal)| {
        let speed = now.wall_velocity(p).dot(normal);
        let later = solid.at(now.time() + soon).wall_velocity(p).dot(normal);
        let by_speed = way / speed.abs();
        let by_change = (CHANGE * way * soon / (later - speed).abs()).sqrt();
        time = time.min(by_speed).min(by_change);
    });
    time
}

/// Calls `see` with a solid at some times of a run, and places of its surface in a box with their normals.
fn at_places(solid: &Solid, domain: &Aabb, until: f64, mut see: impl FnMut(&Solid, (DVec3, DVec3))) {
    for k in 0..TIMES {
        let now = solid.at(until * (k as f64 + 0.5) / TIMES as f64);
        for place in (0..SIDE.pow(3)).filter_map(|start| on_surface(&now, domain, start)) {
            see(&now, place);
        }
    }
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
