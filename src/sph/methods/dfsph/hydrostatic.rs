//! The hydrostatic pressure of a fluid that fills its vessel.
//!
//! Uniform gravity moves nothing in such a fluid: the pressure ρ₀·g·(x − top) balances it everywhere. So gravity is left
//! out of the motion ([`Parameters::pull`](crate::sph::Parameters::pull)), and this pressure is added to what is reported
//! and to the forces on walls. (If pressures are solved for with gravity, what each step leaves of it lets particles
//! settle into the room that their packing leaves: within a second a full tank of 15 layers stood 5 % too low, moved
//! with 9 cm/s, and had a third of its pressure less.)
//!
//! A wall bears what it does to the particles near it: all of the weight of such a particle, less what other particles
//! bear of it. Those forces are taken from the sums over pairs, whose gradient of a linear pressure is a few per cent too
//! small; they count so much more that walls bear all of the weight.
//!
//! Walls that move may open the vessel. From then on gravity moves the fluid, and it has a surface as any other.

use glam::DVec3;
use rayon::prelude::*;

use super::solver::Solver;
use super::walls::Walls;
use crate::geom::Aabb;
use crate::sph::{
    core::Core,
    particles::{CHUNK, Vectors, add_scaled},
    reaction::Reaction,
    walls::Pushed,
};

/// The least part of a linear pressure's gradient that sums over pairs are expected to find.
const LEAST_FOUND: f64 = 0.1;

/// Steps from one look at the room that moving walls leave to the next.
const LOOK: u64 = 16;

/// A vessel is open if the room around the fluid has grown by this part of the fluid's volume: three hundredths at the start
/// still count as full, and samples are off by a hundredth.
const OPEN: f64 = 0.05;

/// How far room is looked for around the particles, in spacings.
const AROUND: f64 = 2.0;

/// Samples that are to lie in the room, and the most that are taken. So many find it to a hundredth.
const SAMPLES: f64 = 16_384.0;
const MOST_SAMPLES: f64 = 262_144.0;

/// Whether walls that move leave the fluid of a sealed vessel more room than it fills. It is looked for now and then, and
/// compared with the first look, `at_start`: behind thin walls there may be room that is not the fluid's.
pub(super) fn has_opened(core: &Core, at_start: &mut Option<f64>) -> bool {
    let is_asked = core.parameters.is_sealed && core.boundary.any_moves() && core.steps.is_multiple_of(LOOK);
    is_asked && {
        let room = room(core);
        room > at_start.get_or_insert(room).max(1.0) + OPEN
    }
}

/// The room around the fluid over its volume.
fn room(core: &Core) -> f64 {
    let Core { parameters, boundary, particles, .. } = core;
    let fluid = particles.len() as f64 * parameters.particle_mass / parameters.rest_density;
    let hold = |all: Aabb, at: DVec3| Aabb::new(all.min.min(at), all.max.max(at));
    let nearby = particles.position.iter().fold(Aabb::EMPTY, hold).grown(AROUND * parameters.spacing());
    let nearby = nearby.intersection(&boundary.domain);
    let samples = (SAMPLES * nearby.volume() / fluid).clamp(SAMPLES, MOST_SAMPLES) as u32;
    let is_free = |k: &u32| {
        let at = nearby.evenly(*k);
        boundary.fields().all(|field| field.omega(at) < 0.0)
    };
    let free = (1..=samples).into_par_iter().filter(is_free).count();
    nearby.volume() * free as f64 / f64::from(samples) / fluid
}

/// The hydrostatic pressure at the present places.
#[derive(Clone)]
pub(super) struct Hydrostatic {
    /// The body of fluid of each particle, and their number.
    bodies: (Vec<usize>, usize),
    /// Of each particle, Pa; zero half a spacing above the highest particle of the body of fluid that it belongs to.
    pub pressure: Vec<f64>,
    /// The gravity that each particle feels, m/s².
    gravity: Vectors,
}

impl Hydrostatic {
    /// The pressure under a gravity, m/s², that is the same within each of the bodies of fluid: the body of each particle,
    /// and their number.
    pub fn of(core: &Core, bodies: (Vec<usize>, usize), g: impl Fn(usize) -> DVec3) -> Self {
        let parameters = &core.parameters;
        let (of, count) = &bodies;
        let position = &core.particles.position;
        let mut gravity = Vectors::default();
        (0..position.len()).for_each(|i| gravity.push(g(i)));
        let mut least = vec![f64::INFINITY; *count];
        for ((x, g), body) in position.iter().zip(gravity.iter()).zip(of) {
            least[*body] = least[*body].min(g.dot(x));
        }
        let pressure = position.iter().zip(gravity.iter()).zip(of).map(|((x, g), body)| {
            parameters.rest_density * (g.dot(x) - least[*body] + 0.5 * parameters.spacing() * g.length())
        });
        let pressure = pressure.collect();
        Self { pressure, gravity, bodies }
    }

    /// The pressure of all of the fluid as one body, under a uniform gravity, m/s².
    pub fn of_one_body(core: &Core, g: DVec3) -> Self {
        Self::of(core, (vec![0; core.particles.len()], 1), |_| g)
    }

    /// That of the same bodies under a gravity that differs by `change`, m/s².
    pub fn after(&self, core: &Core, change: DVec3) -> Self {
        Self::of(core, self.bodies.clone(), |i| self.gravity.get(i) + change)
    }

    /// Notes what walls bear of the fluid's weight under the uniform gravity `g`, m/s², and what accelerates the fluid
    /// with them besides. The sums find different parts of the two, as particles have more neighbours along some
    /// directions than along others.
    pub fn note_walls(
        &self,
        core: &Core,
        (forces, walls): (&mut Solver, &Walls),
        reaction: Reaction<'_>,
        g: DVec3,
    ) {
        let still = Self::of(core, self.bodies.clone(), |_| g);
        let mut rest = self.clone();
        rest.pressure.iter_mut().zip(&still.pressure).for_each(|(p, still)| *p -= still);
        add_scaled(&mut rest.gravity, &still.gravity, -1.0);
        for part in [still, rest] {
            if part.gravity.iter().any(|g| g != DVec3::ZERO) {
                part.note_part(core, (&mut *forces, walls), reaction);
            }
        }
    }

    fn note_part(&self, core: &Core, (forces, walls): (&mut Solver, &Walls), reaction: Reaction<'_>) {
        let rest = core.parameters.rest_density;
        let s: Vec<f64> = self.pressure.iter().map(|p| p / (rest * rest)).collect();
        let mut push = Vectors::default();
        push.resize(s.len());
        forces.find_push_of(core, walls, &s, &mut push);
        let mut is_free = vec![true; s.len()];
        walls.found().iter().for_each(|(i, _)| is_free[*i as usize] = false);
        let (mut found, mut number) = (0.0, 0.0);
        for ((push, g), _) in push.iter().zip(self.gravity.iter()).zip(&is_free).filter(|(_, free)| **free) {
            found += push.dot(-g);
            number += g.length_squared();
        }
        let found = if number > 0.0 { (found / number).max(LEAST_FOUND) } else { 1.0 };
        walls.found().par_iter().with_min_len(CHUNK / 4).for_each(|(i, (wall, completion))| {
            let i = *i as usize;
            let factor = -2.0 * rest * s[i];
            let of_pairs = (completion.inverse() * push.get(i) - factor * wall.gradient) / found;
            let pushed = Pushed {
                by_pressure: -self.gravity.get(i) - of_pairs,
                factor: factor / found,
                gradient: wall.gradient,
                ..Pushed::default()
            };
            reaction.add(i, pushed);
        });
    }
}
