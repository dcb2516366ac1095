//! How pressure is found: one file for each method, each a readable `step` over the stages of [`Core`].

mod dfsph;
mod paper;
mod shifting;
mod tension;
mod wcsph;

pub(super) use paper::Terms;

use super::{
    checkpoint::{Checkpoint, CheckpointError},
    core::Core,
    params::Method,
    simulation::StepError,
};

/// A method with what it keeps between steps.
pub(super) enum Scheme {
    Paper(paper::Paper),
    Wcsph(Box<wcsph::Weakly>),
    Dfsph(Box<dfsph::DivergenceFree>),
}

impl Scheme {
    /// Finds densities and forces of the first instant; of a fluid that is not new, those that a checkpoint has replace them.
    pub fn start(core: &mut Core<'_>, is_new: bool) -> Self {
        match core.parameters.method {
            Method::Paper => Self::Paper(paper::Paper::start(core)),
            Method::Wcsph(_) => Self::Wcsph(Box::new(wcsph::Weakly::start(core))),
            Method::Dfsph(_) => Self::Dfsph(Box::new(dfsph::DivergenceFree::start(core, is_new))),
        }
    }

    /// Advances by one step of at most `longest` seconds, and returns how long it was.
    pub fn step(&mut self, core: &mut Core<'_>, longest: f64) -> Result<f64, StepError> {
        match self {
            Self::Paper(scheme) => scheme.step(core, longest),
            Self::Wcsph(scheme) => scheme.step(core, longest),
            Self::Dfsph(scheme) => scheme.step(core, longest),
        }
    }

    pub fn iterations(&self) -> Option<u32> {
        if let Self::Dfsph(scheme) = self { Some(scheme.iterations) } else { None }
    }

    /// Puts into a checkpoint what the next step needs besides the particles and their accelerations.
    pub fn save(&self, checkpoint: &mut Checkpoint) {
        match self {
            Self::Paper(_) => {}
            Self::Wcsph(scheme) => scheme.save(checkpoint),
            Self::Dfsph(scheme) => scheme.save(checkpoint),
        }
    }

    /// # Errors
    /// The column that the checkpoint lacks.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        match self {
            Self::Paper(_) => Ok(()),
            Self::Wcsph(scheme) => scheme.restore(checkpoint),
            Self::Dfsph(scheme) => scheme.restore(checkpoint),
        }
    }

    /// Memory that is kept between steps.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Paper(scheme) => scheme.bytes(),
            Self::Wcsph(scheme) => scheme.bytes(),
            Self::Dfsph(scheme) => scheme.bytes(),
        }
    }
}
