//! Figures by which one judges whether a state is sound.
//!
//! Invariant: the figures follow from the state alone; the solver remembers none of them.

use glam::DVec3;

use super::{core::Core, walls::Boundary};

/// Figures of a state at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Stats {
    /// Number of particles.
    pub particles: usize,
    /// Mean number of neighbours within the support radius, without the particle itself.
    pub neighbours_per_particle: f64,
    /// Largest compression (ρ − ρ₀)/ρ₀, at least 0. A density below ρ₀ belongs to the free surface and is not
    /// an error.
    pub max_density_error: f64,
    /// Kinetic energy Σ ½mv², J.
    pub kinetic_energy: f64,
    /// Potential energy −Σ m g·(x − corner), J, from the box's lowest corner along gravity.
    pub potential_energy: f64,
    /// Momentum Σ mv, kg·m/s.
    pub momentum: DVec3,
    /// Largest speed, m/s.
    pub max_speed: f64,
    /// Largest depth of a particle in an obstacle, ω/|∇ω| where ω > 0, m; 0 if no particle is inside.
    pub max_penetration: f64,
    /// Number of particles in an obstacle (ω > 0).
    pub inside: usize,
    /// Number of particles outside the box.
    pub lost: usize,
    /// Number of particles with a position, velocity or density that is not finite.
    pub non_finite: usize,
}

impl Stats {
    pub(super) fn of(core: &Core) -> Self {
        let Core { parameters, boundary, particles, .. } = core;
        let mass = parameters.particle_mass;
        let [kinetic_energy, potential_energy] = energies(core);
        let mut stats = Self {
            particles: particles.len(),
            neighbours_per_particle: core.pairs() as f64 / particles.len() as f64,
            max_density_error: 0.0,
            kinetic_energy,
            potential_energy,
            momentum: DVec3::ZERO,
            max_speed: 0.0,
            max_penetration: 0.0,
            inside: 0,
            lost: 0,
            non_finite: 0,
        };
        for i in 0..particles.len() {
            let (x, v, rho) = (particles.position.get(i), particles.velocity.get(i), particles.density[i]);
            stats.max_density_error = stats.max_density_error.max(rho / parameters.rest_density - 1.0);
            stats.momentum += mass * v;
            stats.max_speed = stats.max_speed.max(v.length());
            stats.lost += usize::from(!boundary.domain.contains(x));
            stats.non_finite += usize::from(!(x.is_finite() && v.is_finite() && rho.is_finite()));
            let depth = boundary.penetration(x);
            stats.inside += usize::from(depth > 0.0);
            stats.max_penetration = stats.max_penetration.max(depth);
        }
        stats
    }
}

/// Kinetic and potential energy, J. The potential one is measured from the box's lowest corner along gravity.
pub(super) fn energies(core: &Core) -> [f64; 2] {
    let Core { parameters, boundary, particles, .. } = core;
    let (mass, g) = (parameters.particle_mass, parameters.gravity);
    let floor = boundary.domain.corners().map(|c| -g.dot(c)).into_iter().fold(f64::INFINITY, f64::min);
    let kinetic = particles.velocity.iter().map(|v| 0.5 * mass * v.length_squared()).sum();
    let potential = particles.position.iter().map(|x| mass * (-g.dot(x) - floor)).sum();
    [kinetic, potential]
}

impl Boundary {
    /// Largest ω/|∇ω| of the obstacles that contain the point, m; zero in the fluid.
    fn penetration(&self, p: DVec3) -> f64 {
        let depth = |field: &dyn crate::field::Walls| {
            if field.omega(p) > 0.0 {
                let (w, gradient) = field.omega_grad(p);
                // a vanishing gradient gives an infinite depth: deep inside
                w / gradient.length()
            } else {
                0.0
            }
        };
        self.fields().map(depth).fold(0.0, f64::max)
    }
}
