//! Probes: figures at places, through planes and on bodies, computed from the particles alone.
//!
//! The value of a field A at a place x is a fit to the particles around it, weighted by the method's kernel.
//! Where at least half of the kernel's free part is filled, the fit is linear, A(x) + ∇A·(x_j − x), by least
//! squares, so that a field that is linear in space is met exactly, also at a wall. Elsewhere it is the mean
//! Σ A_j V_j W / Σ V_j W (Shepard 1968).
//!
//! Invariants: a probe leaves the state as it is. Sums run in the solver's order, so that the same state
//! gives the same bits.

mod force;
mod surface;

use glam::{DMat3, DVec3};

use self::force::KeptPieces;
use crate::geom::Aabb;

use super::{
    audit::Audit,
    core::Core,
    kernel::{Kernels, Wendland},
    methods::Noted,
    stats::energies,
    walls::{Wall, WallKernel},
};

/// Regularisation of the variance of places along each direction, in units of h². Along a direction in which
/// the variance is below it, the fit has no slope. In a full neighbourhood the variance is 0.05 (Wendland) to
/// 0.1 (poly6), at a wall half of that.
const LEAST_SPREAD: f64 = 1e-5;

/// Largest part of a kernel that walls are taken to cover. In the corner of a box they cover seven eighths.
const MOST_COVERED: f64 = 0.9;

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Probe {
    /// Height z of the fluid's surface above (x, y), m: the highest place at which half of the kernel's part
    /// outside walls is filled. Drops and spray do not count. A dry place has the z of its ground, and one beside the
    /// box, or in bodies from the floor to the ceiling, has NaN.
    Height {
        /// x of the place, m.
        x: f64,
        /// y of the place, m.
        y: f64,
    },
    /// Pressure at a place, Pa; zero if no fluid is within the support radius. With `dfsph` it is a mean over
    /// several steps.
    Pressure {
        /// The place, m.
        at: DVec3,
    },
    /// Velocity at a place, m/s; NaN if no fluid is within the support radius.
    Velocity {
        /// The place, m.
        at: DVec3,
    },
    /// Force of the fluid on an obstacle, N, and its torque about a point, N·m.
    ///
    /// It is the momentum that the obstacle has taken from particles since the last sample, by pressure,
    /// friction and contacts, over that time; with the paper's method there are contacts only. For `wcsph` with
    /// differences of pressure, whose forces do not cancel in pairs, pressure is instead that of the particles in
    /// front of the obstacle's faces at the instant of the sample. At the start that is so for all methods, and
    /// for friction too. The force of surface tension where the surface meets the obstacle does not count, so a
    /// hanging drop seems to push.
    Force {
        /// Number of the obstacle, from 0.
        obstacle: usize,
        /// The point to which the torque refers, m.
        about: DVec3,
    },
    /// Mass flow through a plane along its normal, kg/s: ∫ ρ v·n over the plane, with the density and
    /// velocity that the kernel interpolates between the particles.
    Flux {
        /// A point of the plane, m.
        point: DVec3,
        /// Unit normal of the plane.
        normal: DVec3,
    },
    /// Kinetic, potential and elastic energy and their sum, J. Potential energy is measured from the box's
    /// lowest corner along gravity. Elastic energy is the work of pressure from the rest density on, zero for
    /// an incompressible fluid.
    Energy,
    /// The present figures of the [audit](super::Audit): excess of energy, change of volume, and compression by
    /// the places of the particles, as parts, and the greatest speed, m/s. Densities are looked at every few
    /// steps.
    Audit,
}

impl Probe {
    /// Names and units of the figures that a sample has.
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
            Self::Audit => &[
                ("energy excess", "1"),
                ("volume change", "1"),
                ("compression mean", "1"),
                ("compression p99", "1"),
                ("compression max", "1"),
                ("max speed", "m/s"),
            ],
        }
    }
}

/// A probe with its memory of the last sample. [`Simulation::gauge`](super::Simulation::gauge) makes one.
#[derive(Debug, Clone, PartialEq)]
pub struct Gauge {
    /// What is measured.
    pub probe: Probe,
    /// Time of the last sample, and impulse and moment of impulse of the obstacle's contacts up to then.
    last: [f64; 7],
    /// What is known of the obstacle's surface.
    pieces: KeptPieces,
}

impl Gauge {
    /// A probe that has not been sampled yet.
    pub fn new(probe: Probe) -> Self {
        Self { probe, last: [0.0; 7], pieces: KeptPieces::default() }
    }

    /// What the probe remembers between two samples, for a checkpoint.
    pub fn memory(&self) -> &[f64] {
        &self.last
    }

    /// A probe with the memory of an earlier one; `None` if the memory has the wrong length.
    pub(super) fn remembering(probe: Probe, memory: &[f64]) -> Option<Self> {
        memory.try_into().ok().map(|last| Self { last, ..Self::new(probe) })
    }

    /// A probe whose first sample begins now.
    pub(super) fn beginning(probe: Probe, core: &Core) -> Self {
        let mut last = [0.0; 7];
        if let (Probe::Force { obstacle, .. }, Some(contacts)) = (probe, &core.contacts) {
            last[0] = core.time;
            last[1..].copy_from_slice(&contacts.total(obstacle));
        }
        Self { last, ..Self::new(probe) }
    }

    pub(super) fn sample(&mut self, core: &Core, audit: &Audit) -> Vec<f64> {
        match self.probe {
            Probe::Audit => audit.sample(),
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
                let (time, total) =
                    (core.time, core.contacts.as_ref().map_or([0.0; 6], |c| c.total(obstacle)));
                let passed = time - self.last[0];
                let is_complete = core.parameters.method.numerics().noted() == Noted::Forces;
                let is_noted = passed > 0.0;
                let mut force = if is_noted && is_complete {
                    [0.0; 6]
                } else {
                    let found = force::on_surface(core, obstacle, about, !is_noted, &mut self.pieces);
                    if is_complete {
                        // later samples are sums of what steps note
                        self.pieces = KeptPieces::default();
                    }
                    found
                };
                if is_noted {
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

/// The kernel of a method, as a function of the square of a distance.
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

    /// W, 1/m³.
    fn at(&self, r2: f64) -> f64 {
        if self.kernel == WallKernel::Poly6 { self.poly6.poly6(r2) } else { self.wendland.at(r2) }
    }
}

/// The filled part of the kernel at a place, relative to its part outside walls: one deep in the fluid.
fn filling(core: &Core, weight: &Weight, at: DVec3, particles: impl Iterator<Item = DVec3>) -> f64 {
    let volume = core.parameters.volume_in_sums();
    let filled: f64 = particles.map(|p| volume * weight.at(p.distance_squared(at))).sum();
    let covered = core.boundary.coverage::<(), ()>(core.wall(), at).map_or(0.0, |walls| walls.part);
    filled / (1.0 - covered.min(MOST_COVERED))
}

fn height(core: &Core, x: f64, y: f64) -> f64 {
    let Aabb { min, max } = core.boundary.domain;
    let is_in_box = (min.x..=max.x).contains(&x) && (min.y..=max.y).contains(&y);
    if !is_in_box {
        return f64::NAN;
    }
    let h = core.parameters.support_radius;
    let weight = Weight::of(core);
    let beside = |p: &DVec3| (p.x - x).hypot(p.y - y) < h;
    let column: Vec<DVec3> = core.particles.position.iter().filter(beside).collect();
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
    ground(core, x, y)
}

/// Height of the lowest place above (x, y) that lies in no body, m; NaN if there is none.
fn ground(core: &Core, x: f64, y: f64) -> f64 {
    let Aabb { min, max } = core.boundary.domain;
    let is_free = |z: f64| core.boundary.fields().all(|body| body.omega(DVec3::new(x, y, z)) <= 0.0);
    let step = 0.25 * core.parameters.spacing();
    let mut below = min.z;
    if is_free(below) {
        return below;
    }
    while below < max.z {
        let z = (below + step).min(max.z);
        if is_free(z) {
            let (mut taken, mut free) = (below, z);
            for _ in 0..30 {
                let middle = 0.5 * (taken + free);
                if is_free(middle) { free = middle } else { taken = middle }
            }
            return free;
        }
        below = z;
    }
    f64::NAN
}

/// The particles around a place.
struct Neighbourhood<'a> {
    core: &'a Core,
    at: DVec3,
    /// Index and weight V·W of each particle within the support radius.
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

    /// The fit of three fields at once; `None` if no particle is near.
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

/// The mass flow through a plane. ∫ W over the plane is the slope of the part of the kernel that a wall there
/// would cover.
fn flux(core: &Core, point: DVec3, normal: DVec3) -> f64 {
    let Weight { kernel, h, .. } = Weight::of(core);
    let particles = core.particles.position.iter().zip(core.particles.velocity.iter());
    let passing = particles.map(|(x, v)| v.dot(normal) * kernel.slope((x - point).dot(normal) / h));
    core.parameters.particle_mass / h * passing.sum::<f64>()
}

fn elastic_energy(core: &Core) -> f64 {
    let parameters = &core.parameters;
    let (method, scales) = (parameters.method.numerics(), parameters.scales());
    let energies = core.particles.density.iter().map(|&rho| method.elastic_energy(&scales, rho));
    parameters.particle_mass * energies.sum::<f64>()
}

#[cfg(test)]
mod tests;
