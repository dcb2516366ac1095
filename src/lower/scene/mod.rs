//! Scenes: keys with units and defaults → plain data for the solver.
//!
//! Invariant: after this stage every number is finite and in SI units, and every size is positive.
//!
//! This file has the data, [`read`] the blocks of a scene, [`fluid`] its fluid and method, [`keys`] what a key may hold.

mod fluid;
mod keys;
mod read;

use glam::DVec3;

pub(super) use keys::Block;

use super::Tolerance;
use super::probes::Probe;
use crate::diagnostic::Span;
use crate::geom::Aabb;
use crate::ir::Node;
use crate::precision::Precision;
use crate::sph::{Fill, Method, Slip};

/// Acceleration of all of the fluid, m/s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gravity {
    Still(DVec3),
    /// Formulas of t alone: a container that turns.
    Turning([Node; 3]),
    /// Formulas of the place, and perhaps of t: any body force.
    Field([Node; 3]),
}

impl Gravity {
    /// Its formulas, if it is not always the same.
    pub fn formulas(&self) -> Option<&[Node; 3]> {
        match self {
            Self::Still(_) => None,
            Self::Turning(nodes) | Self::Field(nodes) => Some(nodes),
        }
    }
}

/// What a simulation needs, as a file states it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    pub name: String,
    pub span: Span,
    /// The container.
    pub domain: Aabb,
    pub domain_span: Span,
    /// What the walls of the box do to a particle that hits them.
    pub walls: Bounce,
    /// Whether a fluid sticks to the walls of the box, and to obstacles that do not say otherwise.
    pub slip: Slip,
    /// The vessel within the box, if there is one: the fluid stays where it is positive.
    pub container: Option<Container>,
    pub fluid: Fluid,
    pub obstacles: Vec<Obstacle>,
    pub gravity: Gravity,
    pub method: Method,
    pub solver: Solver,
    pub run: Run,
    /// What is known of the flow, to be compared with.
    pub truth: Option<Truth>,
    pub probes: Vec<Probe>,
    /// The largest error of ω that is accepted of its obstacles in the box, if one is stated.
    pub tolerance: Option<Tolerance>,
}

/// What becomes of a particle at a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounce {
    /// Part of the normal speed that is given back, 0 … 1.
    pub restitution: f64,
    /// Coefficient of friction μ.
    pub friction: f64,
}

/// What a solid does to the fluid at its surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Skin {
    pub bounce: Bounce,
    pub slip: Slip,
    /// Motion within the surface as formulas of x, y, z and t, m/s: of a belt, or of a cylinder that turns.
    pub velocity: Option<[Node; 3]>,
}

/// A vessel.
#[derive(Debug, Clone, PartialEq)]
pub struct Container {
    pub name: String,
    /// Positive outside the vessel: what the fluid meets.
    pub outside: Node,
    pub span: Span,
    pub skin: Skin,
}

/// A flow that is known, as formulas of x, y, z and t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Pa
    pub pressure: Option<Node>,
    /// m/s
    pub velocity: Option<[Node; 3]>,
    /// How far along x the fluid has come on the floor of the box, m: a formula of t alone.
    pub front: Option<Node>,
    /// From when on it holds, s.
    pub from: f64,
}

/// How a method is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solver {
    /// Of sums over neighbours; the method decides if it is not given.
    pub precision: Option<Precision>,
}

/// The defaults are table 1 of the paper for its method, and those of water and of the particles' spacing for others.
#[derive(Debug, Clone, PartialEq)]
pub struct Fluid {
    pub name: String,
    /// Positive where particles are put at the start.
    pub shape: Node,
    pub shape_span: Span,
    /// Which part of the shape is taken when it has room for more particles than are wanted.
    pub fill: Fill,
    /// As many as fit if it is not given.
    pub particles: Option<usize>,
    pub particles_span: Option<Span>,
    /// Rest density ρ₀, kg/m³.
    pub density: f64,
    /// Of one particle, kg.
    pub mass: f64,
    /// Dynamic viscosity, Pa·s.
    pub viscosity: f64,
    /// N/m
    pub surface_tension: f64,
    /// h, m
    pub support_radius: f64,
    /// At the start, m/s.
    pub velocity: [Node; 3],
    /// Random displacement of the start positions, as a part of the particle spacing.
    pub jitter: f64,
    pub seed: u64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// The name of the solid, or `obstacle` for a shape written on the spot.
    pub name: String,
    pub shape: Node,
    pub span: Span,
    pub skin: Skin,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Fixed time step, s; derived from the fluid if it is not given.
    pub dt: Option<f64>,
    /// End of the simulated time, s.
    pub until: f64,
    /// Time between saved frames, s.
    pub save_every: f64,
    /// Time between checkpoints, s; one goes with every frame if it is not given.
    pub checkpoint_every: Option<f64>,
}
