//! A method at work.

use crate::sph::checkpoint::{Checkpoint, CheckpointError};
use crate::sph::core::Core;
use crate::sph::error::StepError;

/// The numbers of a method, from which its scheme is made.
pub(super) trait Start {
    /// Makes the scheme of a fluid, and finds densities and forces of the first instant. The fluid is new, or
    /// it continues from a state that will be restored.
    fn start(self, core: &mut Core, is_new: bool) -> Box<dyn Scheme>;
}

/// A method at work, with the state that it keeps between steps.
pub(in crate::sph) trait Scheme: Send + Sync {
    /// Advances by one step of at most `longest` seconds, and returns how long it was.
    ///
    /// # Errors
    /// [`StepError`] if a value became infinite or NaN, or steps became too short.
    fn step(&mut self, core: &mut Core, longest: f64) -> Result<f64, StepError>;

    /// Puts into a checkpoint the state that the next step needs besides the particles and their
    /// accelerations.
    fn save(&self, _checkpoint: &mut Checkpoint) {}

    /// Restores from a checkpoint the state that [`Scheme::save`] put there.
    ///
    /// # Errors
    /// The column that the checkpoint lacks.
    fn restore(&mut self, _checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        Ok(())
    }

    /// The densities that follow from the present positions of the particles, kg/m³.
    fn densities<'a>(&'a self, core: &'a Core) -> &'a [f64];

    /// Iterations of the last step's solver; `None` for methods without one.
    fn iterations(&self) -> Option<u32> {
        None
    }

    /// Memory that is kept between steps, bytes.
    fn bytes(&self) -> usize;
}
