//! What a fluid does to an obstacle: minus what the obstacle does to the fluid.

use std::sync::{Mutex, PoisonError};

use fearless_simd::{Simd, SimdFloat};
use glam::{DMat3, DVec3};

use crate::{
    field::Faces,
    sph::{
        core::Core,
        methods::{LEAST_FREE, Scheme},
        pairs::{PairPass, Real},
        params::Slip,
        walls::{Boundary, Coverage, WallKernel},
    },
};

/// Of the walls' own matrix, so that directions in which no wall looks get nothing.
const LEAST_SHARE: f64 = 1e-9;

/// Impulses that obstacles took from particles that hit them, since the start.
#[derive(Debug, Default)]
pub struct Contacts {
    /// Impulse and moment of impulse about the origin of each obstacle, N·s and N·m·s.
    totals: Vec<[f64; 6]>,
    /// Of the step that is under way, as threads find them.
    now: Mutex<Vec<Hit>>,
}

/// A change of a particle's velocity by an obstacle.
#[derive(Debug, Clone, Copy)]
struct Hit {
    particle: usize,
    obstacle: usize,
    change: DVec3,
    at: DVec3,
}

impl Contacts {
    pub fn of(obstacles: usize) -> Self {
        Self { totals: vec![[0.0; 6]; obstacles], now: Mutex::default() }
    }

    pub fn add(&self, particle: usize, obstacle: usize, change: DVec3, at: DVec3) {
        let mut now = self.now.lock().unwrap_or_else(PoisonError::into_inner);
        now.push(Hit { particle, obstacle, change, at });
    }

    /// Adds the step's hits, particle by particle, whichever thread found them first.
    pub fn settle(&mut self, mass: f64) {
        let now = self.now.get_mut().unwrap_or_else(PoisonError::into_inner);
        now.sort_by_key(|hit| hit.particle); // stable: the hits of one particle stay in their order
        for hit in now.drain(..) {
            let impulse = -mass * hit.change;
            let moment = hit.at.cross(impulse);
            let total = &mut self.totals[hit.obstacle];
            for (sum, x) in total.iter_mut().zip(impulse.to_array().into_iter().chain(moment.to_array())) {
                *sum += x;
            }
        }
    }

    pub fn total(&self, obstacle: usize) -> [f64; 6] {
        self.totals[obstacle]
    }

    /// All totals, one after the other.
    pub fn totals(&self) -> &[[f64; 6]] {
        &self.totals
    }

    /// The other way; as many as there are.
    pub fn restore(&mut self, totals: &[f64]) {
        for (total, values) in self.totals.iter_mut().zip(totals.as_chunks::<6>().0) {
            *total = *values;
        }
    }
}

/// A force and its moment about the origin, as one about a point.
pub fn about([x, y, z, u, v, w]: [f64; 6], point: DVec3) -> [f64; 6] {
    let force = DVec3::new(x, y, z);
    let moment = DVec3::new(u, v, w) - point.cross(force);
    [x, y, z, moment.x, moment.y, moment.z]
}

/// Force and torque by pressure and, where the fluid sticks to walls, by friction.
pub fn pressure_on(core: &Core<'_>, scheme: &Scheme, obstacle: usize, point: DVec3) -> [f64; 6] {
    let Some(specific) = scheme.specific_pressure(core) else { return [0.0; 6] };
    let n = core.particles.len();
    let [mut x, mut y, mut z] = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let pass = OfWalls::new(core, &specific, obstacle);
    core.sum(&pass, [&specific[..]], [&mut x[..], &mut y, &mut z]);
    let (mut force, mut moment) = (DVec3::ZERO, DVec3::ZERO);
    for i in 0..n {
        let push = -core.parameters.particle_mass * DVec3::new(x[i], y[i], z[i]);
        force += push;
        moment += (core.particles.position.get(i) - point).cross(push);
    }
    [force.x, force.y, force.z, moment.x, moment.y, moment.z]
}

/// The part of a particle's acceleration that is due to one obstacle: what its acceleration is with all walls less what
/// it would be with none, shared out among the walls.
struct OfWalls<'a> {
    core: &'a Core<'a>,
    /// p/ρ²
    specific: &'a [f64],
    /// The box and all obstacles.
    all: &'a Boundary<'a>,
    /// The box alone.
    container: Boundary<'a>,
    obstacle: usize,
    /// m·c of ∇W = −c(1 − q)³·r
    mass_steepness: f64,
    /// ν of a fluid that sticks to walls, m²/s
    friction: f64,
}

impl<'a> OfWalls<'a> {
    fn new(core: &'a Core<'a>, specific: &'a [f64], obstacle: usize) -> Self {
        let parameters = &core.parameters;
        let steepness = 210.0 / (std::f64::consts::PI * parameters.support_radius.powi(5));
        Self {
            core,
            specific,
            all: &core.boundary,
            container: Boundary { obstacles: Vec::new(), ..core.boundary.clone() },
            obstacle,
            mass_steepness: parameters.particle_mass * steepness,
            friction: match parameters.slip {
                Slip::Free => 0.0,
                Slip::No => parameters.viscosity / parameters.rest_density,
            },
        }
    }

    /// What one obstacle alone takes of a kernel.
    fn covered_by(&self, obstacle: usize, p: DVec3) -> Coverage {
        let h = self.core.parameters.support_radius;
        let mut faces = Faces::new();
        self.all.obstacles[obstacle].field.faces(p, h, &mut faces);
        Coverage::of_faces(WallKernel::WendlandC2, h, &faces)
    }

    /// The obstacle's share of an acceleration by all walls.
    fn share(&self, acceleration: DVec3, own: &Coverage, p: DVec3) -> DVec3 {
        let h = self.core.parameters.support_radius;
        let others = (0..self.all.obstacles.len()).filter(|k| *k != self.obstacle);
        let others = others.map(|k| self.covered_by(k, p));
        let container = self.container.coverage(WallKernel::WendlandC2, h, p).unwrap_or_default();
        // g² n⊗n, g the steepness of what a wall takes: the nearest walls get most
        let outer = |g: DVec3| DMat3::from_cols(g * g.x, g * g.y, g * g.z);
        let (mut matrix, mut steepness) = (DMat3::ZERO, 0.0);
        let container = container.gradient;
        let sides = [DVec3::X * container.x, DVec3::Y * container.y, DVec3::Z * container.z];
        for gradient in others.chain([*own]).map(|wall| wall.gradient).chain(sides) {
            matrix += outer(gradient);
            steepness += gradient.length();
        }
        let least = LEAST_SHARE * steepness * steepness;
        let inverse = (matrix + DMat3::from_diagonal(DVec3::splat(least))).inverse();
        let along = |wall: DVec3| wall * wall.dot(inverse * acceleration);
        // what points along no wall's normal, friction for one, goes by steepness alone
        let rest = acceleration - matrix * (inverse * acceleration);
        along(own.gradient) + rest * (own.gradient.length() / steepness)
    }
}

impl PairPass<1, 3, 3> for OfWalls<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 1],
        other: [V; 1],
        sums: &mut [V; 3],
    ) {
        let of = V::Element::of;
        let h = self.core.parameters.support_radius;
        let s = r2.sqrt().mul_add(of(-1.0 / h), of(1.0)).max(of(0.0));
        let push = (own[0] + other[0]) * s * s * s;
        for k in 0..3 {
            sums[k] = push.mul_add(d[k], sums[k]);
        }
    }

    fn finish(&self, i: usize, sums: [f64; 3]) -> [f64; 3] {
        let particles = &self.core.particles;
        let p = particles.position.get(i);
        let own = self.covered_by(self.obstacle, p);
        if own.gradient == DVec3::ZERO {
            return [0.0; 3];
        }
        let h = self.core.parameters.support_radius;
        let Some(walls) = self.all.coverage(WallKernel::WendlandC2, h, p) else { return [0.0; 3] };
        let push = self.mass_steepness * DVec3::from_array(sums);
        let wall_push = -2.0 * particles.density[i] * self.specific[i] * walls.gradient;
        let by_pressure = walls.completed(push + wall_push, LEAST_FREE) - push;
        let by_friction = -2.0 * self.friction * (walls.drag * particles.velocity.get(i));
        self.share(by_pressure + by_friction, &own, p).to_array()
    }
}
