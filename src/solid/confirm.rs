//! Whether an estimated contact is one: the signs around it are compared with it, and where they contradict, the nearest
//! place is looked for, by signs alone.
//!
//! `ir::contact` takes ω over its slope for a distance. On the axis of an angle, on a crease, or where a formula is flat, that
//! may be a thousandth of the distance or a thousand times as much, and in the middle of a valley it is the distance to its
//! ground. How much an estimate needs to be confirmed is known from its formula, see `ir::trust`. An estimate that leads
//! nearer to the surface stays what it is: so does that at an edge, which is the distance to the farther of two faces.

use std::cell::Cell;

use glam::DVec3;

use super::contact::Contact;
use crate::ir::{Trust, is_far_away};

/// A surface between two signs, and the contacts that its formula estimates.
pub(super) trait Surface {
    fn sign(&self, p: DVec3) -> f64;
    fn omega(&self, p: DVec3) -> f64;
    fn estimate(&self, p: DVec3) -> Contact;
    /// Whether one of several faces lies between a point and one behind its estimated contact, whose sign is the same.
    fn crosses_a_face(&self, p: DVec3, behind: DVec3) -> bool;
}

/// The part of ω that may be left after a step that leads nearer to the surface: the smaller one where a formula has no edge of
/// its own, and on a crease.
const HEADWAY: f64 = 0.9;
const HEADWAY_AT_EDGES: f64 = 0.99;

/// An estimate is confirmed by the signs before and behind it, at these parts of its distance: nearer before it where a formula
/// has edges of its own, around which estimates are a little too long.
const BEFORE: f64 = 0.98;
const BEFORE_AN_EDGE: f64 = 0.9;
const BEHIND: f64 = 1.02;

/// A surface that is nearer than this many times an estimate is not searched for.
const NOT_MUCH_LONGER: f64 = 1.5;

/// A normal is along an axis if its other coordinates are less.
const ON_AXIS: f64 = 1e-9;

/// An estimate this much too long has nothing to do with the surface.
const FAR_TOO_LONG: f64 = 0.5;

/// A surface in another direction is looked for at this part of the estimated distance.
const BESIDE: f64 = 0.98;

/// Rays become twice as long so many times, and shorter by a factor so many.
const DOUBLINGS: i32 = 24;
const SHORTENINGS: i32 = 12;
const SHORTENED: f64 = 2.0 / 3.0;

/// The length of the first rays over that of the coordinates, where nothing is known of the distance.
const SHORT: f64 = 1e-3;

/// To this part of their length rays are halved: those that are compared, and the last.
const COARSE: f64 = 1e-2;
const FINE: f64 = 1e-7;

/// Secants that find a zero of ω on a ray.
const MOST_SECANTS: usize = 20;

/// Directions around a ray in which it is turned, the tangents of the widest and of the narrowest turn, and most rounds.
const TURNS: u32 = 8;
const WIDEST_TURN: f64 = 0.5;
const LEAST_TURN: f64 = 2e-3;
const MOST_ROUNDS: u32 = 60;
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// A round of turns has found a nearer place if it is nearer by this part of the square of its tangent.
const GAIN: f64 = 0.02;

/// Steps along a surface to the foot of a point, the fewer where an estimate would do, and the part of the distance by which the
/// foot is missed.
const MOST_STEPS: usize = 8;
const FEW_STEPS: usize = 6;

/// Steps after which the foot is missed by more than this part of what it was before lead nowhere.
const SLOW: f64 = 0.8;
const MISSED: f64 = 1e-3;

/// Normals of one face agree more than this (cosine).
const SAME_FACE: f64 = 0.99;

/// The contact of a surface with a point, of which an estimate is given: that estimate unless the signs contradict it.
/// Distances below `least` are those of rounding.
pub(super) fn confirmed(
    surface: &impl Surface,
    trust: &Trust,
    p: DVec3,
    found: Contact,
    least: f64,
) -> Contact {
    let length = found.distance.abs();
    if !(length > least && length < f64::INFINITY) {
        return found;
    }
    let is_on_crease = trust.is_on_crease(p, length);
    let is_strict = trust.is_smooth || is_on_crease;
    let rays = Rays { surface, p, found, is_strict, best: Cell::new(None) };
    if trust.is_doubtful_at(p, length) {
        match rays.seen() {
            Seen::There => {}
            Seen::TooLong => return rays.shorter(),
            Seen::AtAnEdge => return found,
            // beside a crease ω may jump
            Seen::Nearer if is_on_crease => return rays.searched(),
            Seen::Nearer => {
                if let Some(contact) = trust.is_smooth.then(|| rays.walked()).flatten() {
                    return contact;
                }
            }
            Seen::Nothing => return rays.searched(),
        }
    }
    if trust.may_be_beside(p, found.distance, found.mean_curvature) {
        return rays.beside(AROUND.into_iter().take(BESIDE_NORMAL));
    }
    if trust.may_be_flat(found.distance, found.mean_curvature) {
        return rays.beside(aside(-rays.toward()));
    }
    found
}

/// What the signs along an estimated contact say of it.
enum Seen {
    /// The surface is about as far.
    There,
    /// It is nearer.
    TooLong,
    /// The estimate is that of a face that ends before its foot.
    AtAnEdge,
    /// It leads nearer to the surface, but not all the way.
    Nearer,
    /// It leads to no surface.
    Nothing,
}

/// What rays from a point meet.
struct Rays<'a, S> {
    surface: &'a S,
    p: DVec3,
    /// What was estimated.
    found: Contact,
    /// Whether no edge of the formula excuses it.
    is_strict: bool,
    /// The way to the nearest place of the other sign that is known.
    best: Cell<Option<DVec3>>,
}

impl<S: Surface> Rays<'_, S> {
    /// The direction of the estimated foot.
    fn toward(&self) -> DVec3 {
        -self.found.distance.signum() * self.found.normal
    }

    /// Whether the other sign is at the end of a way. The estimate has the sign of its side.
    fn is_other(&self, way: DVec3) -> bool {
        self.surface.sign(self.p + way) * self.found.distance > 0.0
    }

    fn before(&self) -> f64 {
        if self.is_strict { BEFORE } else { BEFORE_AN_EDGE }
    }

    fn seen(&self) -> Seen {
        let (length, toward) = (self.found.distance.abs(), self.toward());
        let behind = BEHIND * length * toward;
        if self.is_other(behind) {
            return if self.is_other(self.before() * length * toward) { Seen::TooLong } else { Seen::There };
        }
        if !is_far_away(self.p, length) && self.surface.crosses_a_face(self.p, self.p + behind) {
            return Seen::AtAnEdge;
        }
        if self.makes_headway() { Seen::Nearer } else { Seen::Nothing }
    }

    /// Whether a step along the estimate leads nearer to the surface.
    fn makes_headway(&self) -> bool {
        let Self { surface, p, found, .. } = self;
        let headway = if self.is_strict { HEADWAY } else { HEADWAY_AT_EDGES };
        surface.omega(found.foot(*p)).abs() <= headway * surface.omega(*p).abs()
    }

    /// The length of the shortest way to the other side that is known.
    fn reach(&self) -> f64 {
        self.best.get().map_or(f64::INFINITY, DVec3::length)
    }

    /// The contact at an estimate that is too long.
    fn shorter(&self) -> Contact {
        let (length, toward) = (self.found.distance.abs(), self.toward());
        if self.is_other(FAR_TOO_LONG * length * toward) {
            self.halve(toward, FAR_TOO_LONG * length, COARSE);
            return self.searched();
        }
        let length = self.zero(toward, self.before() * length);
        Contact { distance: self.found.distance.signum() * length, ..self.found }
    }

    /// Where ω vanishes on a ray that ends on the other side: by the secant through two places of different signs, of which the
    /// one that stays counts half (the Illinois rule).
    fn zero(&self, direction: DVec3, length: f64) -> f64 {
        let value =
            |length: f64| self.surface.omega(self.p + length * direction) * self.found.distance.signum();
        let (mut near, mut far) = ((0.0, value(0.0)), (length, value(length)));
        let mut last = 0;
        for _ in 0..MOST_SECANTS {
            let at = (near.0 * far.1 - far.0 * near.1) / (far.1 - near.1);
            if !(at > near.0 && at < far.0) || far.0 - near.0 <= FINE * far.0 {
                break;
            }
            let here = value(at);
            if here > 0.0 {
                (far, near.1, last) = ((at, here), if last > 0 { 0.5 * near.1 } else { near.1 }, 1);
            } else {
                (near, far.1, last) = ((at, here), if last < 0 { 0.5 * far.1 } else { far.1 }, -1);
            }
            if here.abs() <= FINE * far.1.max(-near.1) {
                return at;
            }
        }
        far.0
    }

    /// The contact in one of some other directions, if there the surface is nearer than the estimate.
    fn beside(&self, directions: impl Iterator<Item = DVec3>) -> Contact {
        let length = self.found.distance.abs();
        directions.for_each(|direction| self.try_ray(direction, BESIDE * length, COARSE));
        let Some(way) = self.best.get() else { return self.found };
        self.followed(way, length, MOST_STEPS).unwrap_or_else(|| self.searched())
    }

    /// The contact that steps from the estimated foot on lead to. On an axis of symmetry they follow the axis, and where that leads
    /// nowhere the contact is searched for. `None` if the estimate may stay.
    fn walked(&self) -> Option<Contact> {
        let way = self.found.foot(self.p) - self.p;
        let walked = self.followed(way, f64::INFINITY, FEW_STEPS);
        let zeros = self.found.normal.to_array().into_iter().filter(|slope| slope.abs() <= ON_AXIS).count();
        let is_lost = zeros == 2 && !self.is_other(NOT_MUCH_LONGER * way);
        walked.or_else(|| is_lost.then(|| self.searched()))
    }

    /// The foot of the point on the surface around the end of a way, along the surface. `None` if that leads nowhere, or is
    /// not nearer than `limit`.
    fn followed(&self, way: DVec3, limit: f64, steps: usize) -> Option<Contact> {
        let (mut place, mut before) = (self.p + way, f64::INFINITY);
        for _ in 0..steps {
            let there = self.surface.estimate(place);
            let foot = place - there.distance * there.normal;
            let way = foot - self.p;
            let aside = way - way.dot(there.normal) * there.normal;
            let (length, missed) = (way.length(), aside.length() + there.distance.abs());
            if length.is_nan() || length >= limit {
                return None;
            }
            if missed <= MISSED * length {
                let is_there = self.is_other((1.0 + MISSED) * way) && !self.is_other((1.0 - MISSED) * way);
                return is_there.then(|| self.contact(way, there.mean_curvature));
            }
            if missed > SLOW * before {
                return None;
            }
            before = missed;
            // from outside a ball, a step along its surface is seen as a shorter one
            let bend = there.mean_curvature * length * self.found.distance.signum();
            place = foot - aside / (1.0 + bend.max(0.0));
        }
        None
    }

    /// The contact with the nearest place that rays find; the estimate if they find none.
    fn searched(&self) -> Contact {
        if self.best.get().is_none() {
            self.rays();
        }
        self.turn();
        let Some(way) = self.best.get() else { return self.found };
        let contact = self.contact(way, 0.0);
        let face = self.surface.estimate(self.p + way);
        // a face that is seen from the point along its normal; at an edge nothing is known of the curvature
        let is_smooth = face.normal.dot(contact.normal) >= SAME_FACE && face.mean_curvature.is_finite();
        Contact { mean_curvature: if is_smooth { face.mean_curvature } else { 0.0 }, ..contact }
    }

    fn contact(&self, way: DVec3, mean_curvature: f64) -> Contact {
        let distance = self.found.distance.signum() * way.length();
        Contact { distance, normal: -way / distance, mean_curvature }
    }

    /// Rays in all directions, longer and longer until one of them meets the other side; then shorter and shorter ones. Where the
    /// estimate is far longer than the coordinates, these say how long the first are.
    fn rays(&self) {
        let (length, coordinates) = (self.found.distance.abs(), self.p.abs().max_element());
        let longer = (0..DOUBLINGS).map(|k| length * f64::exp2(f64::from(k)));
        let shorter = (1..=SHORTENINGS).map(|k| length * SHORTENED.powi(k));
        let from_coordinates = (0..DOUBLINGS).map(|k| SHORT * coordinates * f64::exp2(f64::from(k)));
        let is_far = is_far_away(self.p, length);
        let first = from_coordinates.filter(|reach| is_far && *reach > 0.0 && *reach < length);
        for length in first.chain(longer).chain(shorter) {
            let directions = std::iter::once(self.toward()).chain(AROUND.into_iter().skip(LEFT_OUT));
            directions.for_each(|direction| self.try_ray(direction, length, COARSE));
            if self.best.get().is_some() {
                return;
            }
        }
    }

    /// Turns the shortest way as long as that finds shorter ones.
    fn turn(&self) {
        let mut tangent = WIDEST_TURN;
        for round in 0..MOST_ROUNDS {
            let Some(way) = self.best.get() else { return };
            if tangent < LEAST_TURN {
                break;
            }
            let before = way.length();
            let direction = way / before;
            let (u, v) = direction.any_orthonormal_pair();
            for k in 0..TURNS {
                let turned =
                    f64::from(k) * std::f64::consts::TAU / f64::from(TURNS) + f64::from(round) * GOLDEN_ANGLE;
                let (sin, cos) = turned.sin_cos();
                let other = (direction + tangent * (cos * u + sin * v)).normalize();
                self.try_ray(other, before, (GAIN * tangent * tangent).max(FINE));
            }
            if self.reach() >= before * (1.0 - GAIN * tangent * tangent) {
                tangent *= 0.5;
            }
        }
    }

    /// Follows a ray to the surface, if it meets that sooner than the best one.
    fn try_ray(&self, direction: DVec3, length: f64, fineness: f64) {
        let length = length.min(self.reach() * (1.0 - fineness));
        if direction.is_finite() && self.is_other(length * direction) {
            self.halve(direction, length, fineness);
        }
    }

    /// Halves a ray that ends on the other side.
    fn halve(&self, direction: DVec3, length: f64, fineness: f64) {
        let (mut near, mut far) = (0.0, length);
        while far - near > fineness * far {
            let middle = 0.5 * (near + far);
            if middle <= near || middle >= far {
                break;
            }
            if self.is_other(middle * direction) { far = middle } else { near = middle }
        }
        self.best.set(Some(far * direction));
    }
}

/// The diagonals of the planes of the axes, the axes, and the diagonals of space, towards both sides.
const AROUND: [DVec3; 26] = {
    let mut directions = [DVec3::ZERO; 26];
    let (mut found, mut kind) = (0, 0);
    // of so many axes, and their length
    let kinds = [(2, std::f64::consts::FRAC_1_SQRT_2), (1, 1.0), (3, INV_SQRT_3)];
    while kind < kinds.len() {
        let (axes, length) = kinds[kind];
        let mut k = 1;
        while k < 27 {
            let [x, y, z] = [k % 3, k / 3 % 3, k / 9];
            if (x > 0) as i32 + (y > 0) as i32 + (z > 0) as i32 == axes {
                directions[found] = DVec3::new(STEPS[x] * length, STEPS[y] * length, STEPS[z] * length);
                found += 1;
            }
            k += 1;
        }
        kind += 1;
    }
    directions
};
const STEPS: [f64; 3] = [0.0, 1.0, -1.0];
const INV_SQRT_3: f64 = 0.577_350_269_189_625_8;

/// Those of [`AROUND`] in which a surface may be nearer than along its normal, and those left out where nothing is known of it.
const BESIDE_NORMAL: usize = 18;
const LEFT_OUT: usize = 12;

/// Directions across a normal, and those between them and the way against it.
fn aside(normal: DVec3) -> impl Iterator<Item = DVec3> {
    let (u, v) = normal.try_normalize().unwrap_or(DVec3::Z).any_orthonormal_pair();
    let across = [u, v, -u, -v];
    across.into_iter().chain(across.map(move |direction| (direction - normal).normalize()))
}
