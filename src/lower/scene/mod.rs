//! Scenes: keys with units and defaults become plain data for the solver.
//!
//! Invariant: after this stage every number is finite and in SI units, and every size is positive.
//!
//! This file has the data, [`read`] reads the blocks of a scene, [`fluid`] its fluid and method, [`run`] how
//! long it runs, [`truth`] what is known of it, [`picture`] how it is drawn, and [`keys`] what a key may
//! hold. The keys of a block are declared beside their reader, see [`declaration`].

pub(super) mod declaration;
pub(super) mod fluid;
mod keys;
pub(super) mod picture;
pub(super) mod read;
pub(super) mod run;
pub(super) mod truth;

use glam::DVec3;

pub(super) use keys::Block;

use crate::diagnostic::Span;
use crate::geom::Aabb;
use crate::ir::Node;
use crate::precision::Precision;
use crate::sph::{Fill, Method, Probe, Slip};

/// The acceleration of the whole fluid by gravity, m/s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gravity {
    /// Gravity that is equal at all places and times.
    Still(DVec3),
    /// Formulas of t alone, as for a container that turns.
    Turning([Node; 3]),
    /// Formulas of the place, and perhaps of t, for any body force.
    Field([Node; 3]),
}

impl Gravity {
    /// The formulas of gravity; `None` if it is constant.
    pub fn formulas(&self) -> Option<&[Node; 3]> {
        match self {
            Self::Still(_) => None,
            Self::Turning(nodes) | Self::Field(nodes) => Some(nodes),
        }
    }
}

/// A scene as a file states it: all that a simulation needs.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name of the scene.
    pub name: String,
    /// Place of the name.
    pub span: Span,
    /// The box of the scene, m.
    pub domain: Aabb,
    /// Place of the box in the text.
    pub domain_span: Span,
    /// How the walls of the box act on a particle that hits them.
    pub walls: Bounce,
    /// Whether the fluid sticks to the walls of the box, and to obstacles that do not say otherwise.
    pub slip: Slip,
    /// The vessel within the box, if there is one. The fluid stays where its solid is positive.
    pub container: Option<Container>,
    /// The fluid.
    pub fluid: Fluid,
    /// The obstacles, in the order of the file.
    pub obstacles: Vec<Obstacle>,
    /// Gravity.
    pub gravity: Gravity,
    /// The method that finds the pressure.
    pub method: Method,
    /// How the method is run.
    pub solver: Solver,
    /// How long the simulation runs, and what it saves.
    pub run: Run,
    /// The known solution with which the flow is compared.
    pub truth: Option<Truth>,
    /// What is measured during the run.
    pub probes: Vec<SceneProbe>,
    /// How its pictures are drawn.
    pub picture: Picture,
    /// The largest error of ω that is accepted for the obstacles in the box, if it is stated.
    pub tolerance: Option<Tolerance>,
}

impl Scene {
    /// The most frames of a run: the names of their files have six digits.
    pub const MOST_FRAMES: u64 = 999_999;
}

/// How a wall acts on a particle that hits it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounce {
    /// Part of the normal speed that is returned, 0 … 1.
    pub restitution: f64,
    /// Coefficient of friction μ.
    pub friction: f64,
}

/// How a solid acts on the fluid at its surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Skin {
    /// How it acts on a particle that hits it.
    pub bounce: Bounce,
    /// Whether the fluid sticks to it.
    pub slip: Slip,
    /// Motion within the surface, m/s, as formulas of x, y, z and t: that of a belt, or of a turning
    /// cylinder.
    pub velocity: Option<[Node; 3]>,
}

/// A vessel that holds the fluid.
#[derive(Debug, Clone, PartialEq)]
pub struct Container {
    /// Name of the solid, or `obstacle` for a shape written on the spot.
    pub name: String,
    /// The wall that the fluid meets: positive outside the vessel.
    pub outside: Node,
    /// Place of the solid in the text.
    pub span: Span,
    /// What happens at its surface.
    pub skin: Skin,
}

/// A known solution of a flow, as formulas of x, y, z and t; `None` for a quantity that is not stated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Pressure, Pa.
    pub pressure: Option<Node>,
    /// Velocity, m/s.
    pub velocity: Option<[Node; 3]>,
    /// How far along x the fluid has come on the floor of the box, m: a formula of t alone.
    pub front: Option<Node>,
    /// The time, s, from which the solution holds.
    pub from: f64,
}

/// How a method is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solver {
    /// Precision of the sums over neighbours; `None`: the method decides.
    pub precision: Option<Precision>,
}

/// The fluid of a scene. Defaults are table 1 of the paper for its method, and for other methods those of
/// water and of the particles' spacing.
#[derive(Debug, Clone, PartialEq)]
pub struct Fluid {
    /// Name of the fluid; `fluid` if it has none.
    pub name: String,
    /// Place of its block in the text.
    pub span: Span,
    /// Positive where particles are put at the start.
    pub shape: Node,
    /// Place of the shape in the text.
    pub shape_span: Span,
    /// Which part of the shape is taken when it has room for more particles than are wanted.
    pub fill: Fill,
    /// Number of particles; `None`: as many as fit. If no size is stated, this number fills the shape.
    pub particles: Option<usize>,
    /// Place of the number of particles in the text, if it is stated.
    pub particles_span: Option<Span>,
    /// Rest density ρ₀, kg/m³.
    pub density: f64,
    /// Mass of one particle, kg. A number of particles without a size determines another one.
    pub mass: f64,
    /// Place of the key that states how large a particle is, `mass` or `spacing`; `None`: the mass is the default.
    pub size_span: Option<Span>,
    /// Dynamic viscosity, Pa·s.
    pub viscosity: f64,
    /// Surface tension, N/m.
    pub surface_tension: f64,
    /// Place of its value; `None` if it is the method's.
    pub tension_span: Option<Span>,
    /// Place of the stated speed of sound, which only some methods have.
    pub sound_span: Option<Span>,
    /// Place of the viscosity in the text or, if that is the method's, of the density by which it is divided.
    pub viscosity_span: Option<Span>,
    /// Place of the support radius in the text, if it is stated.
    pub support_span: Option<Span>,
    /// Place of the velocity at the start in the text, if it is stated.
    pub velocity_span: Option<Span>,
    /// Support radius h, m; `None`: as many spacings as is usual for the method.
    pub support_radius: Option<f64>,
    /// Velocity at the start, m/s, as formulas of x, y and z.
    pub velocity: [Node; 3],
    /// Random displacement of the start positions, as a part of the particle spacing.
    pub jitter: f64,
    /// Seed of the random displacement.
    pub seed: u64,
}

/// An obstacle of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// The name of the solid, or `obstacle` for a shape written on the spot.
    pub name: String,
    /// Positive inside the obstacle.
    pub shape: Node,
    /// Place of the solid in the text.
    pub span: Span,
    /// What happens at its surface.
    pub skin: Skin,
}

/// How long a simulation runs, and how often it saves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Fixed time step, s; `None`: it follows from the fluid and the method.
    pub dt: Option<f64>,
    /// Place of the time step in the text, if it is stated.
    pub dt_span: Option<Span>,
    /// End of the simulated time, s.
    pub until: f64,
    /// Time between saved frames, s.
    pub save_every: f64,
    /// Time between checkpoints, s; `None`: one is saved with every frame.
    pub checkpoint_every: Option<f64>,
}

/// A measurement that goes on while a scene runs.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneProbe {
    /// Name of the probe, and of its files.
    pub name: String,
    /// Place of the name.
    pub span: Span,
    /// What is measured.
    pub measured: Probe,
    /// Simulated time between samples, s; `None`: that between frames.
    pub every: Option<f64>,
    /// The mean that is taken of the samples; `None` if it is not asked for.
    pub mean: Option<AskedMean>,
}

/// A mean over the samples of a probe, and what it is to be.
#[derive(Debug, Clone, PartialEq)]
pub struct AskedMean {
    /// The time of the first sample that counts, s.
    pub from: f64,
    /// What is known of the first figures of each sample, in SI units; empty if nothing is.
    pub known: Vec<f64>,
    /// Whether the torque of a force is asked for: its point is stated.
    pub torque: bool,
}

/// How the pictures of a scene are drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Picture {
    /// The direction from the scene to the eye, of any length above 0; `None`: from the front, right and above.
    pub camera: Option<DVec3>,
    /// The place in the middle of a picture, m; `None`: that of the box.
    pub look_at: Option<DVec3>,
    /// How many times as large as if the whole box were seen; `None`: 1.
    pub zoom: Option<f64>,
    /// Whether lines that are parallel stay so; otherwise what is nearer is larger.
    pub parallel: bool,
    /// What is taken away of obstacles.
    pub cut: Opening,
    /// The speed at the end of the colours, m/s; `None`: one that follows from the scene.
    pub fastest: Option<f64>,
    /// The names of obstacles that are not drawn.
    pub hide: Vec<String>,
    /// The names of obstacles that are drawn clear.
    pub glass: Vec<String>,
}

impl Picture {
    /// The values that [`Picture::zoom`] may have.
    pub const ZOOMS: std::ops::RangeInclusive<f64> = 0.05..=20.0;
}

/// What is taken away of obstacles in pictures, so that they do not hide the fluid.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Opening {
    /// The front half of each obstacle that would hide much of the fluid.
    #[default]
    Automatic,
    /// No obstacle is cut.
    None,
    /// The half of space on one side of a plane across an axis, of all obstacles.
    Half {
        /// The axis: 0, 1 or 2.
        axis: usize,
        /// Where the plane meets the axis, m.
        at: f64,
        /// Whether the part at smaller coordinates is taken away.
        below: bool,
    },
}

/// The largest |computed ω − exact ω| that is accepted; positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// The largest error.
    pub value: f64,
    /// Place where it is stated.
    pub span: Span,
}
