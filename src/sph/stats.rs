//! Figures that tell whether a state is sound, and which passes a simulation runs.
//!
//! Invariant: computed afresh from the state; nothing here is remembered by the solver.

use std::fmt;

use glam::DVec3;

use super::{core::Core, methods::Terms, params::Parameters, walls::Boundary};

/// A stage of a step. Those a scene does not need do not run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pass {
    Integrate,
    Walls,
    Obstacles,
    Neighbours,
    Density,
    Pressure,
    Viscosity,
    SurfaceTension,
    Gravity,
}

impl Pass {
    /// In the order in which a step runs them.
    pub const ALL: [Self; 9] = [
        Self::Integrate,
        Self::Walls,
        Self::Obstacles,
        Self::Neighbours,
        Self::Density,
        Self::Pressure,
        Self::Viscosity,
        Self::SurfaceTension,
        Self::Gravity,
    ];

    /// Why a scene runs without the pass.
    pub fn absence(self) -> &'static str {
        match self {
            Self::Integrate | Self::Walls | Self::Neighbours | Self::Density => "always runs",
            Self::Obstacles => "the scene has no obstacle",
            Self::Pressure => "the stiffness is zero",
            Self::Viscosity => "the viscosity is zero",
            Self::SurfaceTension => "the surface tension is zero",
            Self::Gravity => "gravity is zero",
        }
    }

    pub(super) fn of(parameters: &Parameters, boundary: &Boundary<'_>) -> Vec<Self> {
        let terms = Terms::of(parameters);
        [
            (Self::Integrate, true),
            (Self::Walls, true),
            (Self::Obstacles, !boundary.obstacles.is_empty()),
            (Self::Neighbours, true),
            (Self::Density, true),
            (Self::Pressure, terms.pressure),
            (Self::Viscosity, terms.viscosity),
            (Self::SurfaceTension, terms.tension),
            (Self::Gravity, parameters.gravity != DVec3::ZERO),
        ]
        .into_iter()
        .filter_map(|(pass, runs)| runs.then_some(pass))
        .collect()
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Integrate => "integrate",
            Self::Walls => "walls",
            Self::Obstacles => "obstacles",
            Self::Neighbours => "neighbours",
            Self::Density => "density",
            Self::Pressure => "pressure",
            Self::Viscosity => "viscosity",
            Self::SurfaceTension => "surface tension",
            Self::Gravity => "gravity",
        }
    }
}

impl fmt::Display for Pass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Figures of one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Stats {
    pub particles: usize,
    /// Mean number of others within the support radius.
    pub neighbours_per_particle: f64,
    /// Largest (ρ − ρ₀)/ρ₀ above zero: compression. A density below ρ₀ is the free surface, not an error.
    pub max_density_error: f64,
    /// Σ ½mv², J
    pub kinetic_energy: f64,
    /// −Σ m g·(x − corner), J, from the box's lowest corner along gravity
    pub potential_energy: f64,
    /// Σ mv, kg·m/s
    pub momentum: DVec3,
    /// m/s
    pub max_speed: f64,
    /// Largest ω/|∇ω| where ω > 0, m
    pub max_penetration: f64,
    /// Particles with ω > 0 for some obstacle
    pub inside: usize,
    /// Particles outside the box
    pub lost: usize,
    /// Particles with a position, velocity or density that is no number
    pub non_finite: usize,
}

impl Stats {
    pub(super) fn of(core: &Core<'_>) -> Self {
        let Core { parameters, boundary, particles, .. } = core;
        let mass = parameters.particle_mass;
        let g = parameters.gravity;
        let floor = boundary.domain.corners().map(|c| -g.dot(c)).into_iter().fold(f64::INFINITY, f64::min);
        let mut stats = Self {
            particles: particles.len(),
            neighbours_per_particle: core.pairs() as f64 / particles.len() as f64,
            max_density_error: 0.0,
            kinetic_energy: 0.0,
            potential_energy: 0.0,
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
            stats.kinetic_energy += 0.5 * mass * v.length_squared();
            stats.potential_energy += mass * (-g.dot(x) - floor);
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

impl Boundary<'_> {
    /// Largest ω/|∇ω| of the obstacles that hold the point, m; zero in the fluid.
    fn penetration(&self, p: DVec3) -> f64 {
        let depth = |field: &dyn crate::field::Field| {
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
