//! The distance from a point to the surface, proven from both sides.
//!
//! A point of the other sign bounds the distance from above: rays find one, cells around the point find nearer
//! ones. From below it is bounded by the nearest cell that may hold such a point, see `bounds::contraction`.
//! Neither needs a gradient, so axes, medial surfaces and places without a normal are like any others.

use std::cell::Cell;
use std::collections::BinaryHeap;
use std::sync::OnceLock;

use glam::DVec3;

use super::bounds::contraction::Tree;
use super::bounds::queue::Queued;
use super::bounds::search::{Effort, NODES_PER_WORK, SEARCH_RADIUS, Shrink};
use super::bounds::whole::WholeFormula;
use super::construction::Solid;
use super::leaves::words;
use crate::geom::{Aabb, directions};

/// How far a point is from the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// The distance of [`Distance::nearest`]: positive in the fluid, negative inside the solid, 0 on the
    /// surface, ±∞ if none was found. Never nearer than the surface is.
    pub estimate: f64,
    /// The radius of a ball around the point in which ω is proven not to have the other sign; never more
    /// than the true distance, and always finite: farther away than 2²⁵¹ nothing is looked for.
    pub clearance: f64,
    /// The nearest point of the surface that was found; NaN if there is none.
    pub nearest: DVec3,
}

/// A solid and its complement, prepared for many distance queries.
pub struct Distances {
    solid: Solid,
    /// What a sign at a point costs, in the unit of the work.
    work_of_sign: usize,
    /// Where ω is positive, and where it is negative.
    positive: Side,
    negative: Side,
}

/// Where ω has one sign.
struct Side {
    target: Target,
    lead: Lead,
}

/// What leads to a side where no short ray does; found once for all points.
#[derive(Default)]
struct Lead {
    /// Whether the side has an end in all directions.
    ends: OnceLock<bool>,
    /// Some places there, far from one another.
    places: OnceLock<Vec<DVec3>>,
}

enum Target {
    Tree(Tree),
    Whole(Box<WholeFormula>),
}

impl From<Target> for Side {
    fn from(target: Target) -> Self {
        Self { target, lead: Lead::default() }
    }
}

/// Clearance and estimate may differ by this part of the distance.
const GAP: f64 = 1e-4;

/// Cells looked at for one point. In the middle of a ball all of its surface is equally near.
const MOST_CELLS: usize = 1_000;

/// Work for one point, in the unit of `bounds::search`.
const MOST_WORK: usize = 100_000;

/// Operations of machine code that take as long as a node of a formula whose range is found.
const OPERATIONS_OF_NODE: usize = 16;

/// Length of the first ray where nothing is known of the distance, m.
const SHORTEST_RAY: f64 = 1e-6;

/// Directions that are tried where neither the normal nor an axis meets the surface.
const ALL_AROUND: usize = 64;

/// Work that longer and longer rays may take: cells around the point find what they miss.
const WORK_OF_RAYS: usize = MOST_WORK / 4;

/// Number of times that the length of a ray is doubled.
const DOUBLINGS: i32 = 60;

/// If what is known is farther away than the middle of a cell by more than this factor, the corners of the
/// cell are tried as well.
const WIDE_GAP: f64 = 1.02;

/// Places behind a cell that are tried.
const BEHIND: u32 = 6;

/// Distance beyond a point with ω = 0 at which the other side is looked for, over the distance of the point.
const BEYOND: f64 = 1e-9;

/// Places that are tried where no ray meets the surface.
const SCATTERED: u32 = 1000;

/// A box with a longer side does not show where something ends.
const ENDLESS: f64 = 1e30;

/// Places that are kept of a side, and cells that are looked at to find them.
const MOST_PLACES: usize = 32;
const CELLS_OF_PLACES: usize = 20_000;

/// Most steps from a cell towards the other side.
const MOST_STEPS: usize = 12;

/// Directions in which a ray is turned.
const TURNS: u32 = 8;

/// The tangent of the widest turn.
const WIDEST_TURN: f64 = 0.5;

/// Turns of a smaller tangent are not tried.
const LEAST_TURN: f64 = 1e-6;

/// Rounds of turns, of which each tries all directions, and those without success after which the turns get smaller. From
/// round to round the directions are turned by the golden angle: along an edge few lead to nearer places.
const MOST_ROUNDS: usize = 100;
const FAILURES: u32 = 2;
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// One part in this many of the work that is left: what turning may take each time, so that cells find what it misses.
const PARTS_OF_WORK: usize = 8;

/// The part of its length to which a ray is halved around the surface.
const FINE: f64 = 1e-12;

/// That part as long as cells are looked at: rays need only be compared. At last the nearest one is halved on.
const COARSE: f64 = 0.1 * GAP;

/// That part while rays are turned, over the angle of the turn: they need only be compared.
const FINE_OF_TURN: f64 = 1e-6;

/// Halvings of a ray around the surface.
const HALVINGS: usize = 50;

impl Solid {
    /// How far a point is from the surface, with a proof. It costs thousands of times as much as
    /// [`Solid::contact`]; for many points see [`Distances`].
    pub fn distance(&self, p: DVec3) -> Distance {
        Distances::new(self).at(p)
    }
}

impl Distances {
    /// Prepares a solid.
    pub fn new(solid: &Solid) -> Self {
        let whole = |negated| Target::Whole(Box::new(WholeFormula::of(solid, negated)));
        // what encloses parts shows where they end, which chains of many edges do not
        let positive = match solid.parts_with_hulls() {
            Some(parts) => Target::Tree(Tree { words: parts.words.clone(), parts }),
            None => whole(false),
        };
        let negative = match solid.parts() {
            Some(parts) => Target::Tree(Tree { words: words::opposite(&parts.words).into(), parts }),
            None => whole(true),
        };
        let (graph, _) = solid.formula();
        let work_of_sign = 1 + graph.len() / (OPERATIONS_OF_NODE * NODES_PER_WORK);
        Self { solid: solid.clone(), work_of_sign, positive: positive.into(), negative: negative.into() }
    }

    /// How far a point is from the surface. All numbers are NaN where the sign is.
    pub fn at(&self, p: DVec3) -> Distance {
        let sign = self.solid.sign(p);
        if sign.is_nan() {
            return Distance { estimate: f64::NAN, clearance: f64::NAN, nearest: DVec3::NAN };
        }
        if sign == 0.0 {
            return Distance { estimate: 0.0, clearance: 0.0, nearest: p };
        }
        let Side { target, lead } = if sign < 0.0 { &self.positive } else { &self.negative };
        let (least, most, nearest) = match target {
            Target::Tree(tree) => self.search((tree, lead), sign, p),
            Target::Whole(whole) => self.search((&**whole, lead), sign, p),
        };
        Distance { estimate: -sign * most, clearance: least, nearest }
    }

    /// A bound from below, one from above, and the point that proves the latter.
    fn search<S: Shrink>(&self, (target, lead): (&S, &Lead), sign: f64, p: DVec3) -> (f64, f64, DVec3) {
        let mut best = Best {
            solid: &self.solid,
            sign,
            p,
            distance: f64::INFINITY,
            point: DVec3::NAN,
            work_of_sign: self.work_of_sign,
            work: Cell::new(MOST_WORK),
            fineness: COARSE,
        };
        self.rays(&mut best);
        // where a side ends, all that may hold it is searched for less
        if !best.distance.is_finite() && !*lead.ends.get_or_init(|| ends(target)) {
            self.rays_all_around(&mut best);
        }
        best.turn();
        // nothing is proven beyond the box that is searched
        let reach = best.distance.min(2.0 * SEARCH_RADIUS);
        let mut around = Aabb::new(p - DVec3::splat(reach), p + DVec3::splat(reach));
        let Some(known) = target.shrink(&target.everything(), &mut around, Effort::Large) else {
            best.refine();
            return (reach, best.distance, best.point);
        };
        if !best.distance.is_finite() {
            best.scatter(&around);
            if !best.distance.is_finite() {
                best.work.set(MOST_WORK);
                best.try_places(lead.places.get_or_init(|| self.places(target, -sign)));
            }
            best.turn();
        }
        // the nearest box comes first
        let mut queue = BinaryHeap::from([Queued { rank: -distance_to(&around, p), space: around, known }]);
        let mut cells = 0;
        while let Some(Queued { rank, space, known }) = queue.pop() {
            let distance = -rank;
            if distance >= (1.0 - GAP) * best.distance || cells == MOST_CELLS || best.is_spent() {
                best.refine();
                return (distance.min(best.distance).min(reach), best.distance, best.point);
            }
            cells += 1;
            best.spend(target.work(&known));
            let before = best.distance;
            best.try_cell(&space);
            if best.distance < before * (1.0 - GAP) {
                best.turn();
            }
            for mut half in space.halves_seen_from(p) {
                let Some((known, beyond)) = target.shrink_from(&known, &mut half, p) else { continue };
                let distance = distance_to(&half, p).max(beyond);
                if distance < best.distance {
                    queue.push(Queued { rank: -distance, space: half, known });
                }
            }
        }
        best.refine();
        (best.distance.min(reach), best.distance, best.point)
    }

    /// Places where ω has a sign, from the middles of ever smaller cells, of which the largest comes first.
    fn places<S: Shrink>(&self, target: &S, sign: f64) -> Vec<DVec3> {
        let mut found = Vec::new();
        let Some(hull) = hull(target) else { return found };
        let queued = |(space, known): (Aabb, S::Known)| Queued { rank: space.size().length(), space, known };
        let mut queue: BinaryHeap<Queued<S::Known>> = target.parts(&hull).into_iter().map(queued).collect();
        for _ in 0..CELLS_OF_PLACES {
            let Some(Queued { space, known, .. }) = queue.pop() else { break };
            if self.solid.sign(space.centre()) * sign > 0.0 {
                found.push(space.centre());
                if found.len() == MOST_PLACES {
                    break;
                }
                continue;
            }
            for mut half in space.halves_seen_from(DVec3::ZERO) {
                if let Some(known) = target.shrink(&known, &mut half, Effort::Cell) {
                    queue.push(queued((half, known)));
                }
            }
        }
        found
    }

    /// Looks for the surface along the normal and the axes, first as far as the contact estimates.
    fn rays(&self, best: &mut Best<'_>) {
        let contact = self.solid.estimated_contact(best.p);
        let guess = contact.distance.abs();
        let first = if guess.is_finite() && guess > 0.0 { 1.0001 * guess } else { SHORTEST_RAY };
        let normal = contact.normal * best.sign;
        let directions = [normal, DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z];
        Self::longer_rays(best, first, &directions);
    }

    /// Looks for the surface in all directions. (A solid such as xy ≤ −1 has neither a point on the axes nor, seen from
    /// the middle, a normal, and it has no end, so that cells of all space would have to find it.)
    fn rays_all_around(&self, best: &mut Best<'_>) {
        let directions: Vec<DVec3> = directions(ALL_AROUND).collect();
        Self::longer_rays(best, SHORTEST_RAY, &directions);
    }

    /// Tries rays, each time twice as long, until one of them meets the surface.
    fn longer_rays(best: &mut Best<'_>, first: f64, directions: &[DVec3]) {
        let enough = best.work.get().saturating_sub(WORK_OF_RAYS);
        for doubling in 0..DOUBLINGS {
            let reach = first * f64::exp2(f64::from(doubling));
            for &direction in directions {
                if direction.is_finite() && direction != DVec3::ZERO {
                    best.try_ray(best.p + reach * direction);
                }
            }
            if best.distance.is_finite() || best.work.get() <= enough {
                break;
            }
        }
    }
}

/// The nearest point of the other sign that is known.
struct Best<'a> {
    solid: &'a Solid,
    /// The sign at p.
    sign: f64,
    p: DVec3,
    distance: f64,
    point: DVec3,
    work_of_sign: usize,
    /// What may still be spent on the point.
    work: Cell<usize>,
    /// The part of their lengths to which rays are halved.
    fineness: f64,
}

impl Best<'_> {
    fn spend(&self, work: usize) {
        self.work.set(self.work.get().saturating_sub(work));
    }

    fn is_spent(&self) -> bool {
        self.work.get() == 0
    }

    /// Whether a point is on the other side, or on the surface.
    fn is_other(&self, q: DVec3) -> bool {
        self.spend(self.work_of_sign);
        let product = self.solid.sign(q) * self.sign;
        product < 0.0 || product == 0.0 && self.is_on_surface(q)
    }

    /// Whether the other side begins at a point with ω = 0. On a face that two parts share nothing begins.
    fn is_on_surface(&self, q: DVec3) -> bool {
        let way = BEYOND * self.p.distance(q) * self.solid.estimated_contact(q).normal * self.sign;
        way.is_finite() && self.solid.sign(q + way) * self.sign < 0.0
    }

    /// Tries the middle of a cell, its corner that is nearest to the point, other corners, and what lies
    /// behind the cell.
    fn try_cell(&mut self, cell: &Aabb) {
        let nearest = self.p.clamp(cell.min, cell.max);
        if self.is_other(nearest) {
            self.take(nearest);
            return;
        }
        let centre = cell.centre();
        self.try_ray(centre);
        self.try_ray(centre + (centre - nearest));
        // an edge may cut off less of the cell than its middle
        let length = (centre - self.p).length();
        if self.distance > WIDE_GAP * length {
            cell.corners().into_iter().for_each(|corner| self.try_ray(corner));
        }
        let behind = self.distance - length;
        if behind.is_finite() && behind > 0.0 && length > 0.0 {
            let direction = (centre - self.p) / length;
            let places = (1..BEHIND).map(|k| length + behind * (f64::from(k) / f64::from(BEHIND)).powi(3));
            let found = places.map(|t| self.p + t * direction).find(|q| self.is_other(*q));
            found.into_iter().for_each(|end| self.try_ray(end));
        }
        if self.distance > WIDE_GAP * length {
            self.climb(centre, 0.5 * cell.size().length());
        }
    }

    /// Tries places that are evenly spread over a box. (Beside a jump of ω the nearest cells cannot be
    /// decided, and no cell that holds something is ever looked at.)
    fn scatter(&mut self, space: &Aabb) {
        // the additive recurrence in three dimensions, by the root of g⁴ = g + 1
        const G: f64 = 1.220_744_084_605_759_5;
        let steps = DVec3::new(1.0 / G, 1.0 / (G * G), 1.0 / (G * G * G));
        let enough = self.work.get().saturating_sub(WORK_OF_RAYS);
        for k in 0..SCATTERED {
            let share = (0.5 + steps * f64::from(k)).fract();
            if self.work.get() <= enough {
                return;
            }
            self.try_ray(space.min + share * space.size());
        }
    }

    /// Tries places of the other side, the nearest first.
    fn try_places(&mut self, places: &[DVec3]) {
        let mut places = places.to_vec();
        places.sort_by(|a, b| self.p.distance_squared(*a).total_cmp(&self.p.distance_squared(*b)));
        let enough = self.work.get().saturating_sub(WORK_OF_RAYS);
        for place in places {
            if self.distance.is_finite() && self.work.get() <= enough {
                return;
            }
            self.try_ray(place);
        }
    }

    /// Follows ω towards the other side, with steps that get longer: from the tip of a sharp edge into the
    /// solid, where a cell around the tip has neither middle nor corners.
    fn climb(&mut self, from: DVec3, first: f64) {
        let (mut q, mut step) = (from, first);
        for _ in 0..MOST_STEPS {
            let direction = self.solid.estimated_contact(q).normal * self.sign;
            if !direction.is_finite() || direction == DVec3::ZERO {
                return;
            }
            q += step * direction;
            if self.is_other(q) {
                self.try_ray(q);
                return;
            }
            step *= 1.5;
        }
    }

    /// Turns the ray towards the nearest point as long as that finds nearer ones: to the foot of a face, and
    /// along edges.
    fn turn(&mut self) {
        let (mut angle, mut failures) = (WIDEST_TURN, 0);
        let enough = self.work.get() - self.work.get() / PARTS_OF_WORK;
        for round in 0..MOST_ROUNDS {
            if !self.distance.is_finite() || angle <= LEAST_TURN || self.work.get() <= enough {
                break;
            }
            let (before, direction) = (self.distance, (self.point - self.p).normalize_or_zero());
            if direction == DVec3::ZERO {
                break;
            }
            self.fineness = (FINE_OF_TURN * angle).clamp(FINE, COARSE);
            let (u, v) = direction.any_orthonormal_pair();
            for k in 0..TURNS {
                let turned =
                    f64::from(k) * std::f64::consts::TAU / f64::from(TURNS) + round as f64 * GOLDEN_ANGLE;
                let (sin, cos) = turned.sin_cos();
                let other = (direction + angle * (cos * u + sin * v)).normalize();
                self.try_ray(self.p + before * other);
            }
            failures = if self.distance < before * (1.0 - GAP * angle) { 0 } else { failures + 1 };
            if failures == FAILURES {
                (angle, failures) = (0.5 * angle, 0);
            }
        }
        self.fineness = COARSE;
    }

    /// Halves the nearest ray as far as numbers allow.
    fn refine(&mut self) {
        self.fineness = FINE;
        if self.point.is_finite() {
            self.try_ray(self.point);
        }
    }

    /// Follows a ray to a point of the other sign back to the surface.
    fn try_ray(&mut self, end: DVec3) {
        let direction = (end - self.p).normalize_or_zero();
        let length = (end - self.p).length();
        if direction == DVec3::ZERO || !self.is_other(end) {
            return;
        }
        let (mut near, mut far) = (0.0, length);
        if far > self.distance {
            // only a nearer point matters
            if !self.is_other(self.p + self.distance * direction) {
                return;
            }
            far = self.distance;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near + far);
            if far - near <= self.fineness * far {
                break;
            }
            if self.is_other(self.p + middle * direction) { far = middle } else { near = middle }
        }
        self.take(self.p + far * direction);
    }

    fn take(&mut self, q: DVec3) {
        let distance = (q - self.p).length();
        if distance < self.distance {
            (self.distance, self.point) = (distance, q);
        }
    }
}

/// A box around a side; `None` if there is nothing of it.
fn hull<S: Shrink>(target: &S) -> Option<Aabb> {
    let mut hull = Aabb::new(DVec3::splat(-SEARCH_RADIUS), DVec3::splat(SEARCH_RADIUS));
    target.shrink(&target.everything(), &mut hull, Effort::Large).map(|_| hull)
}

/// Whether a side is known to end everywhere, or is empty.
fn ends<S: Shrink>(target: &S) -> bool {
    hull(target).is_none_or(|hull| hull.size().max_element() < ENDLESS)
}

/// A bound of the distance from a box, rounded downwards.
fn distance_to(space: &Aabb, p: DVec3) -> f64 {
    (p.clamp(space.min, space.max) - p).length() * (1.0 - 4.0 * f64::EPSILON)
}
