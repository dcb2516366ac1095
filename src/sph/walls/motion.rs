//! How long a step may be beside bodies that move: their surfaces must not pass the fluid by, and a body that
//! swings must be seen to swing, also where the fluid itself is still.
//!
//! Bodies that move without deformation say where they will be. For other bodies nothing is known in advance;
//! there the fluid that they push limits the steps.

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    field::Moving,
    geom::{Aabb, Placement},
    sph::particles::Vectors,
};

use super::boundary::{Boundary, MARKED, box_around};

/// Parts of a step after which a body's place is looked at.
const PARTS: usize = 4;

/// Maximum number of attempts at a step. Each is shorter than the one before.
const ATTEMPTS: usize = 30;

/// Smallest ratio of an attempt at a step to the attempt before it.
const SHORTER: f64 = 0.25;

/// Least length of a step beside a body, as a part of a usual step. A body that still moves too far jumps,
/// however short the step is (`floor(t)`), and its jump takes one step of the usual length.
const JUMP: f64 = 1e-3;

/// Limits of a step beside bodies.
pub(in crate::sph) struct StepLimits<A> {
    /// How far a body may move in a step, m.
    pub travel: f64,
    /// How near, m, fluid must be to a body to feel it.
    pub reach: f64,
    /// The longest step, s, for an acceleration, m/s².
    pub for_acceleration: A,
}

/// How a body moves near the fluid in a step.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    /// The longest way of a point of it, m.
    way: f64,
    /// Its greatest acceleration, m/s².
    acceleration: f64,
}

impl Motion {
    fn or(self, other: Self) -> Self {
        Self { way: self.way.max(other.way), acceleration: self.acceleration.max(other.acceleration) }
    }
}

impl<A: Fn(f64) -> f64> StepLimits<A> {
    /// The longest step, s, if a body moves so in a step of the length `dt`.
    fn longest(&self, motion: Motion, dt: f64) -> f64 {
        let by_way = if motion.way > self.travel { dt * (self.travel / motion.way) } else { dt };
        by_way.min((self.for_acceleration)(motion.acceleration))
    }
}

impl Boundary {
    /// The longest step, s, at most `dt`, that bodies near the fluid allow from a time, s, on. Without bodies steps are
    /// `usual`, s, long, if no instant is nearer.
    pub fn step_beside_bodies<A: Fn(f64) -> f64>(
        &self,
        position: &Vectors,
        limits: &StepLimits<A>,
        time: f64,
        usual: f64,
        mut dt: f64,
    ) -> f64 {
        let [x, y, z] = position.components().map(|column| &column[..]);
        let fluid = box_around([x, y, z]);
        let shortest = JUMP * usual;
        for (k, moving) in self.movers() {
            let before = dt;
            for _ in 0..ATTEMPTS {
                let Some(places) = places(moving, time, dt) else { break };
                // no part of a box moves more than its corners, and most steps are short enough for all of the fluid
                let mut longest = limits.longest(of_corners(&fluid, &places, dt), dt);
                if longest < dt {
                    longest = limits.longest(self.motion_near(k, position, limits.reach, &places, dt), dt);
                }
                if longest >= dt {
                    break;
                }
                // not at once, because a shorter step may show that the body is far
                dt = longest.max(SHORTER * dt);
                if dt < shortest {
                    dt = before;
                    break;
                }
            }
        }
        dt
    }

    /// What moves: bodies, or their parts, with the numbers of the bodies.
    fn movers(&self) -> impl Iterator<Item = (usize, &dyn Moving)> {
        self.obstacles.iter().enumerate().flat_map(|(k, obstacle)| {
            let whole = obstacle.moving.iter().filter(|_| obstacle.parts.is_empty());
            let parts = obstacle.parts.iter().filter_map(|part| part.moving.as_ref());
            whole.chain(parts).map(move |moving| (k, &**moving))
        })
    }

    /// How a body moves where fluid is near it.
    fn motion_near(&self, k: usize, position: &Vectors, reach: f64, places: &[Placement], dt: f64) -> Motion {
        let field = self.field(k);
        let [x, y, z] = position.components().map(|column| column.par_chunks(MARKED));
        x.zip(y)
            .zip(z)
            .with_min_len(64)
            .map(|((x, y), z)| {
                let block = box_around([x, y, z]);
                let motion = of_corners(&block, places, dt);
                // the fluid's box grows, not the reach, beyond which a map of cells knows nothing
                let is_far = field.is_far(&block.grown(motion.way), reach);
                if is_far { Motion::default() } else { motion }
            })
            .reduce(Motion::default, Motion::or)
    }
}

/// Where a body is in the course of a step; `None` if it is at rest, or its motion is not known.
fn places(moving: &dyn Moving, time: f64, dt: f64) -> Option<[Placement; PARTS + 1]> {
    if !(dt.is_finite() && moving.moves()) {
        return None;
    }
    let mut places = [moving.placement(time)?; PARTS + 1];
    for (part, place) in places.iter_mut().enumerate().skip(1) {
        *place = moving.placement(time + dt * part as f64 / PARTS as f64)?;
    }
    Some(places)
}

/// How the corners of a box would move if they belonged to the body.
fn of_corners(block: &Aabb, places: &[Placement], dt: f64) -> Motion {
    let corner = |n: usize| {
        let pick = |axis: usize| if n >> axis & 1 == 0 { block.min[axis] } else { block.max[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    let part = dt / PARTS as f64;
    (0..8)
        .map(|n| {
            let in_body = places[0].back(corner(n));
            let mut way = [DVec3::ZERO; PARTS + 1];
            for (way, place) in way.iter_mut().zip(places) {
                *way = place.apply(in_body);
            }
            let steps = way.windows(2).map(|ends| (ends[1] - ends[0]).length());
            let bends = way.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).length());
            Motion { way: steps.sum(), acceleration: bends.fold(0.0, f64::max) / (part * part) }
        })
        .fold(Motion::default(), Motion::or)
}
