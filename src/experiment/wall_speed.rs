//! The greatest speed of the walls of a scene, and the time in which they hardly move.

use std::sync::Arc;

use glam::DVec3;

use crate::Solid;
use crate::geom::Aabb;
use crate::solid::Bounds;
use crate::sph::{Slip, VectorField};

/// Times of a run at which a wall is looked at.
const TIMES: usize = 96;

/// Starts along each axis of the box, from which places of the surface are sought.
const SIDE: usize = 6;

/// The part of a run after which the speed of a wall is looked at again.
const SOON: f64 = 1e-7;

/// The change of a wall's speed may make this much of a way: as much as a vibration of a hundredth of the
/// support radius makes in a sixth of its period.
const CHANGE: f64 = 1.0 / 16.0;

/// Steps of Newton's method onto the surface, which begins far from it where a body is larger than the box.
const STEPS: usize = 8;

/// Newton steps shorter than this part of the box's longest side end the search.
const CLOSE: f64 = 1e-6;

/// The part of the box's longest side within which a place counts as one of the surface.
const NEAR: f64 = 1e-3;

/// Reach of a body's pressure in a fluid, in units of its greatest size. At this distance the pressure of a
/// ball has fallen to a fortieth.
const REACH: f64 = 4.0;

/// How often a stretch of time is halved in search of a motion that is short.
const HALVINGS: usize = 12;

/// The greatest speeds, m/s, to which walls drive a fluid.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Driven {
    /// The speed of the walls themselves.
    pub by_motion: f64,
    /// The speed that belongs to the pressures of their acceleration. The fluid need not reach it.
    pub by_pressure: f64,
}

impl Driven {
    /// The greater of each.
    pub fn or(self, other: Self) -> Self {
        Self {
            by_motion: self.by_motion.max(other.by_motion),
            by_pressure: self.by_pressure.max(other.by_pressure),
        }
    }
}

/// The greatest speeds, m/s, with which a solid's surface drives the fluid in a box during a run: that along
/// its normal, or the whole if the fluid sticks to it; `belt` is its motion within the surface where that is
/// stated. A surface with the acceleration a raises pressures up to ρ·a·L over a length L, that of the box or
/// of some bodies, as a speed of √(a·L) does: otherwise a body that swings fast over a short way would drive
/// a fluid whose sound is so slow that it resounds. A wall that drags the fluid along does the same where the fluid
/// returns elsewhere, as it does in a closed vessel. Whether it does is not known here. Zero for a solid at rest.
///
/// The speed is found at some places and times, so a wall that moves only during a hundredth of the run may
/// be missed. Solids of many parts are not looked at: their gradients would be one large program, which
/// nothing else needs.
pub(super) fn greatest(
    solid: &Solid,
    (slip, belt): (Slip, Option<Arc<VectorField>>),
    domain: &Aabb,
    until: f64,
) -> Driven {
    let belt = belt.filter(|_| slip == Slip::No);
    let mut driven = Driven::default();
    if !(solid.moves() || belt.is_some()) || solid.has_many_leaves() {
        return driven;
    }
    let size = match solid.at(0.0).bounds() {
        Bounds::Within(bounds) => REACH * bounds.size().max_element(),
        Bounds::Empty | Bounds::Unbounded => f64::INFINITY,
    };
    let reach = size.min(domain.size().max_element());
    at_places(solid, domain, until, |(time, [now, later]), (p, normal)| {
        let velocity = now.wall_velocity(p);
        let velocity_later = later.wall_velocity(p);
        // what drives the fluid along the wall; the surface of a solid at rest, which knows no time, may still move
        let [along, along_later] = match (slip, &belt) {
            (Slip::Free, _) => [DVec3::ZERO; 2],
            (Slip::No, Some(belt)) => [0.0, SOON * until].map(|after| belt(p, time + after)),
            (Slip::No, None) => [velocity, velocity_later],
        };
        let across = velocity.dot(normal);
        let change = velocity_later.dot(normal) - across;
        let change = change.abs().max((along_later - along).length());
        let by_pressure = (change / (SOON * until) * reach).sqrt();
        let finite = |speed: f64| if speed.is_finite() { speed } else { 0.0 };
        let seen = Driven {
            by_motion: finite(across.abs()).max(finite(along.length())),
            by_pressure: finite(by_pressure),
        };
        driven = driven.or(seen);
    });
    driven
}

/// A time, s, in which a solid's surface in a box moves by at most `way`, m, along its normal, and in which
/// its speed changes by at most a small part of that. It is at most the whole run. `None` if no place of its
/// surface is found.
///
/// The speed is found at some instants, and between each two of them the way that the surface has moved.
/// Where that way is too long, the half in which it moves farther is looked at in the same way.
pub(super) fn time_for(solid: &Solid, way: f64, domain: &Aabb, until: f64) -> Option<f64> {
    let mut time: Option<f64> = None;
    at_places(solid, domain, until, |(_, [now, later]), (p, normal)| {
        let speed = now.wall_velocity(p).dot(normal);
        let change = later.wall_velocity(p).dot(normal) - speed;
        let by_speed = way / speed.abs();
        let by_change = (CHANGE * way * SOON * until / change.abs()).sqrt();
        time = Some(time.unwrap_or(until).min(by_speed).min(by_change));
    });
    let instant = |k: usize| until * k as f64 / TIMES as f64;
    let stretches = (0..TIMES).filter_map(|k| quiet_time(solid, way, domain, [instant(k), instant(k + 1)]));
    Some(stretches.fold(time?, f64::min))
}

/// The length, s, of the part of a stretch of time in which the surface moves fastest, and by at most `way`,
/// m.
fn quiet_time(solid: &Solid, way: f64, domain: &Aabb, [mut from, mut to]: [f64; 2]) -> Option<f64> {
    let mut moved = farthest(solid, domain, [from, to])?;
    for _ in 0..HALVINGS {
        if moved <= way {
            break;
        }
        let middle = 0.5 * (from + to);
        let halves = [[from, middle], [middle, to]];
        let [first, second] = halves.map(|half| farthest(solid, domain, half).unwrap_or(0.0));
        ([from, to], moved) = if first > second { (halves[0], first) } else { (halves[1], second) };
    }
    Some(to - from)
}

/// The greatest distance, m, of places of the surface at a time, s, from the surface at another time. The
/// error of these places is included, which is small beside the motion of a wall in a run; [`moved`] is
/// without it.
fn farthest(solid: &Solid, domain: &Aabb, [from, to]: [f64; 2]) -> Option<f64> {
    let (now, then) = (solid.at(from), solid.at(to));
    let ways = (0..SIDE.pow(3)).filter_map(|start| on_surface(&now, domain, start)).map(|(p, _)| {
        let (omega, gradient) = then.omega_grad(p);
        (omega / gradient.length()).abs()
    });
    ways.filter(|way| way.is_finite()).reduce(f64::max)
}

/// The greatest way, m, that places of a solid's surface in a box move along their normals from one time, s,
/// to another. `None` if no place of its surface is found.
pub(super) fn moved(solid: &Solid, domain: &Aabb, [from, to]: [f64; 2]) -> Option<f64> {
    let (now, then) = (solid.at(from), solid.at(to));
    let distance = |solid: &Solid, p: DVec3| {
        let (omega, gradient) = solid.omega_grad(p);
        omega / gradient.length()
    };
    // places are found but for small errors, which are no motion
    let ways = (0..SIDE.pow(3))
        .filter_map(|start| on_surface(&now, domain, start))
        .map(|(p, _)| (distance(&then, p) - distance(&now, p)).abs());
    ways.filter(|way| way.is_finite()).reduce(f64::max)
}

/// Calls `see` with some times of a run, s, the solid at that time and a little later, and with places of its
/// surface in a box and their normals.
fn at_places(
    solid: &Solid,
    domain: &Aabb,
    until: f64,
    mut see: impl FnMut((f64, [&Solid; 2]), (DVec3, DVec3)),
) {
    for k in 0..TIMES {
        // instants that no period of a motion divides, and at which none begins
        let time = until * (k as f64 + 0.618) / TIMES as f64;
        let (now, later) = (solid.at(time), solid.at(time + SOON * until));
        for place in (0..SIDE.pow(3)).filter_map(|start| on_surface(&now, domain, start)) {
            see((time, [&now, &later]), place);
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
        if !last.is_finite() {
            return None;
        }
        // what leaves the box may come back along the surface
        p = (p + last * normal).clamp(domain.min, domain.max);
        if last.abs() <= CLOSE * domain.size().max_element() {
            break;
        }
    }
    let found = last.abs() <= NEAR * domain.size().max_element() && normal.is_finite() && domain.contains(p);
    found.then_some((p, normal))
}
