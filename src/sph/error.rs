//! What can go wrong: in parameters, in the setup of a simulation, and in a step.

use std::{error, fmt};

use glam::DVec3;

use super::checkpoint::CheckpointError;
use crate::geom::Aabb;

/// A parameter is outside the values for which the method is meaningful.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterError {
    /// Name of the parameter: a field of [`Parameters`](super::Parameters), or a key of the method.
    pub name: &'static str,
    /// The value that was found.
    pub found: f64,
    /// What would be accepted, in words.
    pub expected: String,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is {}, expected {}", self.name, self.found, self.expected)
    }
}

impl error::Error for ParameterError {}

/// Why a simulation cannot be started.
#[derive(Debug, Clone, PartialEq)]
pub enum SetupError {
    /// A parameter is out of range.
    Parameter(ParameterError),
    /// The box is empty, flat or infinite.
    Domain(Aabb),
    /// An obstacle's restitution is not in 0..=1, its friction is negative, or its resolution is not
    /// positive.
    Obstacle {
        /// Number of the obstacle, from 0.
        index: usize,
    },
    /// A probe asks for the force on an obstacle that is not there.
    NoObstacle {
        /// Number that the probe has, from 0.
        index: usize,
        /// How many obstacles there are.
        obstacles: usize,
    },
    /// There are no particles.
    NoParticles,
    /// The checkpoint does not belong to this method.
    Checkpoint(CheckpointError),
    /// A particle's position or velocity is not finite.
    NonFinite {
        /// The particle's number at seeding.
        id: u32,
    },
    /// Some particles lie outside the box or not in the fluid (ω ≥ 0). [`carve`](super::carve) removes such
    /// particles.
    NotInFluid {
        /// Number of particles outside the box.
        outside_box: usize,
        /// Number of particles in obstacles or on their surfaces.
        inside_obstacles: usize,
    },
}

impl fmt::Display for SetupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter(error) => error.fmt(f),
            Self::Domain(b) => write!(f, "the box from {} to {} has no finite volume", b.min, b.max),
            Self::Obstacle { index } => {
                write!(
                    f,
                    "obstacle {index} needs a restitution from 0 to 1, a friction of at least 0 and a resolution above 0"
                )
            }
            Self::NoObstacle { index, obstacles } => {
                write!(f, "there is no obstacle {index}: the simulation has {obstacles}, numbered from 0")
            }
            Self::Checkpoint(error) => write!(f, "the checkpoint cannot be used: {error}"),
            Self::NoParticles => write!(f, "there are no particles"),
            Self::NonFinite { id } => write!(f, "the position or velocity of particle {id} is not finite"),
            Self::NotInFluid { outside_box, inside_obstacles } => {
                write!(f, "{outside_box} particles lie outside the box and {inside_obstacles} in obstacles")
            }
        }
    }
}

impl error::Error for SetupError {}

/// The quantity that ceased to be finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The position of a particle.
    Position,
    /// The density of a particle.
    Density,
    /// The acceleration of a particle.
    Acceleration,
    /// The field ω of an obstacle at a particle.
    Omega,
}

/// The most likely reason why a quantity ceased to be finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// The step is longer than this state allows.
    StepTooLong {
        /// The length of the step, s.
        dt: f64,
        /// The longest stable step, s.
        stable: f64,
    },
    /// The obstacle's formula has no value at a point.
    FieldUndefined {
        /// The point, m.
        at: DVec3,
    },
    /// The formula of a gravity that depends on the place has no value at a point.
    GravityUndefined {
        /// The point, m.
        at: DVec3,
    },
    /// The step was short enough, but values grew until they left the range of a double.
    Overflow,
}

/// Why a step could not be completed. The state must no longer be used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepError {
    /// A quantity ceased to be finite.
    NonFinite {
        /// Number of the step.
        step: u64,
        /// The particle's number at seeding.
        id: u32,
        /// What is not finite.
        quantity: Quantity,
        /// The most likely reason.
        cause: Cause,
    },
    /// The formula of a gravity that depends on the time has no value.
    Gravity {
        /// Number of the step.
        step: u64,
        /// The time, s.
        time: f64,
    },
    /// Moving walls leave no room for a particle: they close on it, or pass over it in one step.
    NoRoom {
        /// Number of the step.
        step: u64,
        /// The particle's number at seeding.
        id: u32,
        /// Where the particle is, m.
        at: DVec3,
    },
    /// The energy of the fluid has doubled without work. See [`Audit`](super::Audit).
    EnergyDoubled {
        /// Number of the step.
        step: u64,
        /// The excess of the energy over that at the start and all work, as a part of that at the start. Where walls
        /// move, the amounts of what they gave and took belong to it.
        excess: f64,
        /// Whether walls move.
        walls_move: bool,
        /// The number, at seeding, of the fastest particle.
        id: u32,
        /// The speed of this particle, m/s.
        speed: f64,
    },
    /// The state allows only steps so short that the run would never end, because a particle has become too
    /// fast.
    Stalled {
        /// Number of the step.
        step: u64,
        /// The longest stable step, s.
        dt: f64,
        /// The number, at seeding, of the fastest particle.
        id: u32,
        /// The speed of this particle, m/s.
        speed: f64,
    },
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (step, id, quantity, cause) = match self {
            Self::NonFinite { step, id, quantity, cause } => (step, id, quantity, cause),
            Self::Gravity { step, time } => {
                return write!(f, "step {step}: the formula of gravity has no finite value at t = {time} s");
            }
            Self::NoRoom { step, id, at } => {
                return write!(
                    f,
                    "step {step}: moving walls leave no room for particle {id} at {at}: they close on the fluid, or \
                     pass over it in one step; end the motion earlier, leave a gap, make `dt` shorter, or let what appears \
                     at once come in from outside, or grow"
                );
            }
            Self::EnergyDoubled { step, excess, walls_move, id, speed } => {
                let start = if *walls_move {
                    "that at the start and all that walls gave and took"
                } else {
                    "that at the start"
                };
                let grown = if *excess < 10.0 {
                    format!("{:.0} % above {start}", 100.0 * excess)
                } else {
                    format!("{:.0e} times {start}", 1.0 + excess)
                };
                let or = if *walls_move { " unless a wall jumps" } else { "" };
                return write!(
                    f,
                    "step {step}: without any work the energy is {grown}, which no fluid does{or}; particle {id} is the \
                     fastest, with {speed:.2e} m/s"
                );
            }
            Self::Stalled { step, dt, id, speed } => {
                return write!(
                    f,
                    "step {step}: only steps of {dt:.1e} s are stable any more; particle {id} is the fastest, with \
                     {speed:.2e} m/s"
                );
            }
        };
        let quantity = match quantity {
            Quantity::Position => "position",
            Quantity::Density => "density",
            Quantity::Acceleration => "acceleration",
            Quantity::Omega => "obstacle's field",
        };
        write!(f, "step {step}: the {quantity} of particle {id} is not finite; ")?;
        match cause {
            Cause::StepTooLong { dt, stable } => {
                write!(f, "the time step of {dt} s is too long, at most {stable:.2e} s is stable")
            }
            Cause::FieldUndefined { at } => write!(f, "the obstacle's formula has no value at {at}"),
            Cause::GravityUndefined { at } => write!(f, "the formula of gravity has no finite value at {at}"),
            Cause::Overflow => write!(f, "values have grown beyond the range of numbers"),
        }
    }
}

impl error::Error for StepError {}
