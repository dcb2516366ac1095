//! Why a run ended before its end, in words that say what to do.

use crate::cli::output::significant;
use rfm::Experiment;
use rfm::geom::Aabb;
use rfm::sph::{Cause, Simulation, StepError, short_time};

/// Why a run ended before its end.
pub(super) enum Stop {
    Interrupted,
    Numerical(StepError),
    /// Moving obstacles leave less room than the fluid needs.
    NoRoom(NoRoom),
}

/// A fluid in less room than it needs, m³.
pub(super) struct NoRoom {
    time: f64,
    free: f64,
    fluid: f64,
}

/// The part of a fluid's volume that must be free for a run to mean anything.
const LEAST_ROOM: f64 = 0.8;

/// The part of its volume that a fluid must have free if its numbers became useless for another reason.
/// Volumes are found by samples, to a few hundredths.
const ENOUGH_ROOM: f64 = 1.05;

impl NoRoom {
    /// Whether moving obstacles leave a fluid too little room at the present time. If its numbers are
    /// useless, `failed`, already a lack of room for its expansion is the reason.
    pub fn of(experiment: &Experiment, simulation: &Simulation, failed: bool) -> Option<Self> {
        if !experiment.bodies().iter().any(|body| body.solid.moves()) {
            return None;
        }
        let parameters = simulation.parameters();
        let fluid = simulation.particles().len() as f64 * parameters.particle_mass / parameters.rest_density;
        let domain = experiment.scene().domain;
        // useless numbers may have thrown particles anywhere
        let places = simulation.particles().position.iter().filter(|place| domain.contains(*place));
        let within = places.fold(Aabb::EMPTY, |all, place| all.including(place));
        let within = if within.is_empty() { domain } else { within };
        let least = if failed { ENOUGH_ROOM } else { LEAST_ROOM };
        let time = simulation.time();
        experiment.lacks_room(&within, time, least * fluid).map(|free| Self { time, free, fluid })
    }
}

impl Stop {
    /// The reason in words; `None` if the user is the reason.
    pub fn reason(&self, experiment: &Experiment) -> Option<String> {
        match self {
            Self::Interrupted => None,
            Self::NoRoom(NoRoom { time, free, fluid }) => Some(format!(
                "t = {} s: the moving obstacles leave {} m³ of room to {} m³ of fluid: there is no room left for it; \
                 let them leave a gap, or end the run before with --until",
                short_time(*time),
                significant(*free, 3),
                significant(*fluid, 3)
            )),
            Self::Numerical(StepError::NonFinite { step, cause: Cause::StepTooLong { dt, .. }, .. })
                if *dt > experiment.parameters().stable_dt(experiment.typical_speed()) =>
            {
                let stable = experiment.parameters().stable_dt(experiment.typical_speed());
                Some(format!(
                    "step {step}: the time step of {dt} s is too long, and the fluid has exploded; {stable:.1e} s is stable \
                     at the speeds of this scene: leave `dt` out, or write `dt: {:.1e} s`",
                    0.9 * stable
                ))
            }
            Self::Numerical(error) => Some(error.to_string()),
        }
    }
}
