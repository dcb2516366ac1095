//! How fast parts of the fluid move, as seen from the fluid as a whole.
//!
//! Artificial viscosity scales with the greatest expected speed. But no damping may depend on a velocity that all of the
//! fluid has: two drops that collided in flight at 10 m/s kept two thirds of the energy that they kept when their middle was
//! at rest. So a common velocity at the start does not count, unless walls have turned it into a motion of parts.

use glam::DVec3;
use rayon::prelude::*;

use crate::quantity::Bound;
use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::Core,
    particles::{CHUNK, Vectors},
};

/// Name of both speeds in a checkpoint.
const NAME: &str = "pace";

/// Speeds of parts of the fluid.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pace {
    /// The expected one, m/s.
    expected: f64,
    /// The greatest so far, m/s.
    found: f64,
}

impl Pace {
    /// Of a fluid at its start: what is expected is the speed at the start and that by gravity and walls.
    pub fn at_start(core: &Core) -> Self {
        let velocity = &core.particles.velocity;
        let found = greatest(velocity, velocity.mean());
        Self { expected: core.parameters.driven_speed.hypot(found), found }
    }

    /// Looks at the velocities of a step. Returns the speed by which motion is damped, m/s.
    pub fn follow(&mut self, core: &Core) -> f64 {
        let velocity = &core.particles.velocity;
        self.found = self.found.max(greatest(velocity, velocity.mean()));
        self.expected.max(self.found).min(core.parameters.expected_speed)
    }

    /// Saves both speeds.
    pub fn save(&self, checkpoint: &mut Checkpoint) {
        checkpoint.set(NAME, vec![self.expected, self.found]);
    }

    /// Takes up what a checkpoint saved.
    ///
    /// # Errors
    /// The column that the checkpoint lacks.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        *self = match checkpoint.get(NAME)? {
            &[expected, found] if Bound::NotNegative.admits(expected) && Bound::NotNegative.admits(found) => {
                Self { expected, found }
            }
            _ => return Err(CheckpointError::Column(NAME.into())),
        };
        Ok(())
    }
}

/// The greatest speed, m/s, as seen from something with the velocity `from`.
fn greatest(velocity: &Vectors, from: DVec3) -> f64 {
    let square = |i: usize| (velocity.get(i) - from).length_squared();
    (0..velocity.len()).into_par_iter().with_min_len(CHUNK).map(square).reduce(|| 0.0, f64::max).sqrt()
}
