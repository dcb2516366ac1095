//! Figures at places, through planes and on bodies, from the particles alone.
//!
//! A field A at a place x is a fit to the particles around it, weighted by the method's kernel: where at least half of
//! the kernel's free part is filled, a linear one, A(x) + ∇A·(x_j − x), by least squares, so that a field that is linear
//! in space is met exactly, at a wall too; elsewhere the mean Σ A_j V_j W / Σ V_j W (Shepard 1968).
//!
//! Invariants: a probe looks at a state and leaves it as it was; sums run in the solver's order, so that the same state
//! gives the same bits.

mod force;

use glam::{DMat3, DVec3};

use crate::geom::Aabb;

use super::{
    core::Core,
    kernel::{Kernels, Wendland},
    stats::energies,
    walls::{Wall, WallKernel},
};

pub(super) use force::Contacts;

/// Of the variance of places along the weakest direction, in units of h²: below it a slope along that direction is not
/// asked for. In a full neighbourhood the variance is 0.05 (Wendland) to 0.1 (poly6), at a wall half of it.
const LEAST_SPREAD: f64 = 1e-5;

/// Walls take no more of a kernel than this; in the corner of a box they take seven eighths.
const MOST_COVERED: f64 = 0.9;

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Probe {
    /// z of the fluid's surface above (x, y), m: the highest place at which half of what walls leave of the kernel is
    /// filled. Drops and spray are not, a dry place has the z of the box's floor.
    Height { x: f64, y: f64 },
    /// Pa; zero where no fluid is within the support radius.
    Pressure { at: DVec3 },
    /// m/s; NaN where no fluid is within the support radius.
    Velocity { at: DVec3 },
    /// What the fluid does to an obstacle, N, and its torque about a point, N·m.
    ///
    /// Counted are the fluid's pressure on the obstacle's faces, the friction where the fluid sticks to walls, and the
    /// contacts of particles, averaged over the time since the last sample. The paper's method knows contacts only. Pressures
    /// of `dfsph` are means over the time in which a density comes back: of an impact it tells that much later.
    Force { obstacle: usize, about: DVec3 },
    /// Mass per second through a plane, along its normal, kg/s: ∫ ρ v·n over the plane with the density and velocity
    /// that the kernel makes of the particles.
    Flux { point: DVec3, normal: DVec3 },
    /// Kinetic, potential and elastic energy and their sum, J. Potential: from the box's lowest corner along gravity.
    /// Elastic: ∫ p/ρ² dρ from the density at rest, zero for a fluid that is not compressible.
    Energy,
}

impl Probe {
    /// Names and units of the figures.
    pub fn columns(&self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Height { .. } => &[("height", "m")],
            Self::Pressure { .. } => &[("pressure", "Pa")],
            Self::Velocity { .. } => &[("velocity x", "m/s"), ("velocity y", "m/s"), ("velocity z", "m/s")],
            Self::Force { .. } => &[
                ("force x", "N"),
                ("force y", "N"),
                ("force z", "N"),
                ("torque x", "N m"),
                ("torque y", "N m"),
                ("torque z", "N m"),
            ],
            Self::Flux { .. } => &[("flux", "kg/s")],
            Self::Energy => &[("kinetic", "J"), ("potential", "J"), ("elastic", "J"), ("total", "J")],
        }
    }
}

/// A probe with what it remembers of its last sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Gauge {
    pub probe: Probe,
    /// Time, impulse and moment of impulse of the obstacle's contacts at the last sample.
    last: [f64; 7],
}

impl Gauge {
    pub fn new(probe: Probe) -> Self {
        Self { probe, last: [0.0; 7] }
    }

    /// What must not be lost between two samples.
    pub fn memory(&self) -> &[f64] {
        &self.last
    }

    /// A probe that goes on; a memory of the wrong length is none.
    pub fn remembering(probe: Probe, memory: &[f64]) -> Self {
        Self { probe, last: memory.try_into().unwrap_or([0.0; 7]) }
    }

    pub(super) fn sample(&mut self, core: &Core) -> Vec<f64> {
        match self.probe {
            Probe::Height { x, y } => vec![height(core, x, y)],
            Probe::Pressure { at } => vec![Neighbourhood::around(core, at).pressure()],
            Probe::Velocity { at } => Neighbourhood::around(core, at).velocity().to_array().into(),
            Probe::Flux { point, normal } => vec![flux(core, point, normal)],
            Probe::Energy => {
                let [kinetic, potential] = energies(core);
                let elastic = elastic_energy(core);
                vec![kinetic, potential, elastic, kinetic + potential + elastic]
            }
            Probe::Force { obstacle, about } => {
                let mut force = force::pressure_on(core, obstacle, about);
                let (time, total) =
                    (core.time, core.contacts.as_ref().map_or([0.0; 6], |c| c.total(obstacle)));
                let passed = time - self.last[0];
                if passed > 0.0 {
                    let impulse = force::about(std::array::from_fn(|k| total[k] - self.last[1 + k]), about);
                    force.iter_mut().zip(impulse).for_each(|(force, impulse)| *force += impulse / passed);
                }
                self.last[0] = time;
                self.last[1..].copy_from_slice(&total);
                force.into()
            }
        }
    }
}

/// The kernel of a method, from the square of a distance.
#[derive(Clone, Copy)]
struct Weight {
    poly6: Kernels,
    wendland: Wendland,
    kernel: WallKernel,
    h: f64,
}

impl Weight {
    fn of(core: &Core) -> Self {
        let Wall { kernel, h, .. } = *core.wall();
        Self { poly6: Kernels::new(h), wendland: Wendland::new(h), kernel, h }
    }

    /// 1/m³
    fn at(&self, r2: f64) -> f64 {
        if self.kernel == WallKernel::Poly6 { self.poly6.poly6(r2) } else { self.wendland.at(r2) }
    }
}

/// How much of the kernel at a place is filled with fluid, of what walls leave of it: one in the fluid's depth.
fn filling(core: &Core, weight: &Weight, at: DVec3, particles: impl Iterator<Item = DVec3>) -> f64 {
    let volume = core.parameters.particle_mass / core.parameters.rest_density;
    let filled: f64 = particles.map(|p| volume * weight.at(p.distance_squared(at))).sum();
    let covered = core.boundary.coverage::<()>(core.wall(), at).map_or(0.0, |walls| walls.part);
    filled / (1.0 - covered.min(MOST_COVERED))
}

fn height(core: &Core, x: f64, y: f64) -> f64 {
    let h = core.parameters.support_radius;
    let weight = Weight::of(core);
    let beside = |p: &DVec3| (p.x - x).hypot(p.y - y) < h;
    let column: Vec<DVec3> = core.particles.position.iter().filter(beside).collect();
    let Aabb { min, max } = core.boundary.domain;
    let is_filled = |z: f64| filling(core, &weight, DVec3::new(x, y, z), column.iter().copied()) >= 0.5;
    let top = column.iter().map(|p| p.z).fold(min.z, f64::max).min(max.z);
    let step = 0.25 * core.parameters.spacing();
    let mut above = top + h;
    while above > min.z {
        let z = above - step;
        if is_filled(z) {
            let (mut filled, mut empty) = (z, above);
            for _ in 0..30 {
                let middle = 0.5 * (filled + empty);
                if is_filled(middle) { filled = middle } else { empty = middle }
            }
            return filled.clamp(min.z, max.z);
        }
        above = z;
    }
    min.z
}

/// The particles around a place.
struct Neighbourhood<'a> {
    core: &'a Core,
    at: DVec3,
    /// Particle and weight V·W.
    near: Vec<(usize, f64)>,
    filling: f64,
}

impl<'a> Neighbourhood<'a> {
    fn around(core: &'a Core, at: DVec3) -> Self {
        let weight = Weight::of(core);
        let h2 = core.parameters.support_radius.powi(2);
        let position = &core.particles.position;
        let near: Vec<(usize, f64)> = (0..position.len())
            .map(|i| (i, position.get(i).distance_squared(at)))
            .filter(|(_, r2)| *r2 < h2)
            .map(|(i, r2)| (i, weight.at(r2) / core.particles.density[i]))
            .collect();
        let filling = filling(core, &weight, at, near.iter().map(|&(i, _)| position.get(i)));
        Self { core, at, near, filling }
    }

    fn pressure(&self) -> f64 {
        self.fit(|i| DVec3::new(self.core.particles.pressure[i], 0.0, 0.0)).map_or(0.0, |p| p.x)
    }

    fn velocity(&self) -> DVec3 {
        self.fit(|i| self.core.particles.velocity.get(i)).unwrap_or(DVec3::NAN)
    }

    /// Of three fields at once; none where no particle is near.
    fn fit(&self, field: impl Fn(usize) -> DVec3) -> Option<DVec3> {
        let h = self.core.parameters.support_radius;
        let place = |i: usize| (self.core.particles.position.get(i) - self.at) / h;
        let total: f64 = self.near.iter().map(|(_, weight)| weight).sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let mean = |of: &dyn Fn(usize) -> DVec3| {
            self.near.iter().map(|&(i, weight)| weight / total * of(i)).sum::<DVec3>()
        };
        let (mean_field, mean_place) = (mean(&field), mean(&place));
        if self.filling < 0.5 {
            return Some(mean_field);
        }
        let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
        let (mut spread, mut slope) = (DMat3::from_diagonal(DVec3::splat(LEAST_SPREAD)), DMat3::ZERO);
        for &(i, weight) in &self.near {
            let d = place(i) - mean_place;
            spread += outer(d, d) * (weight / total);
            slope += outer(field(i) - mean_field, d) * (weight / total);
        }
        Some(mean_field - slope * (spread.inverse() * mean_place))
    }
}

/// ∫ W over the plane is the slope of what a wall there would take of the kernel.
fn flux(core: &Core, point: DVec3, normal: DVec3) -> f64 {
    let Weight { kernel, h, .. } = Weight::of(core);
    let particles = core.particles.position.iter().zip(core.particles.velocity.iter());
    let passing = particles.map(|(x, v)| v.dot(normal) * kernel.slope((x - point).dot(normal) / h));
    core.parameters.particle_mass / h * passing.sum::<f64>()
}

fn elastic_energy(core: &Core) -> f64 {
    let parameters = &core.parameters;
    let method = parameters.method.numerics();
    let energies = core.particles.density.iter().map(|&rho| method.elastic_energy(parameters, rho));
    parameters.particle_mass * energies.sum::<f64>()
}

#[cfg(test)]
mod tests;
