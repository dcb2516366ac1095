//! Where a run ends, and when its frames are saved.

use std::path::Path;

use super::super::Failure;
use super::super::args::Run;
use crate::cli::output::Shown;
use rfm::Experiment;
use rfm::sph::{Simulation, short_time};

/// Where a run begins, or goes on: after a number of steps, at a time, s.
#[derive(Clone, Copy, Default)]
pub(super) struct Begin {
    pub steps: u64,
    pub time: f64,
}

/// The end of a run.
#[derive(Clone, Copy)]
pub(super) enum Goal {
    /// A number of steps.
    Steps(u64),
    /// A time, s, at which steps of any length arrive.
    Time(f64),
}

impl Goal {
    pub fn of(options: &Run, experiment: &Experiment) -> Result<Self, Failure> {
        match (options.steps, options.until) {
            (Some(steps), _) => Ok(Self::Steps(steps)),
            (None, Some(until)) if !(until.is_finite() && until >= 0.0) => {
                Err(Failure::usage(format!("--until {until}: a run goes on until a time from 0 s on")))
            }
            (None, until) => {
                let run = &experiment.scene().run;
                let until = until.unwrap_or(run.until);
                Ok(if experiment.parameters().adaptive {
                    Self::Time(frame_within_rounding(until, run.save_every))
                } else {
                    Self::Steps((until / experiment.parameters().time_step).round() as u64)
                })
            }
        }
    }

    /// Refuses an end from a flag that lies before the present time of a resumed run: a run does not go back.
    pub fn lies_ahead(self, options: &Run, folder: &Path, begin: Begin) -> Result<(), Failure> {
        let (time, steps) = (short_time(begin.time), begin.steps);
        let asked = match (options.steps, options.until) {
            (Some(asked), _) if asked < steps => format!("--steps {asked}"),
            (None, Some(asked)) if asked < begin.time * (1.0 - ROUNDING) => format!("--until {asked}"),
            _ => return Ok(()),
        };
        Err(Failure::usage(format!(
            "{asked}: the run in `{}` is at step {steps}, {time} s, already, and --resume does not go back: ask for a later \
             end, or begin anew with --force",
            folder.shown()
        )))
    }

    pub fn is_reached(self, simulation: &Simulation) -> bool {
        match self {
            Self::Steps(steps) => simulation.steps() >= steps,
            Self::Time(end) => simulation.time() >= end * (1.0 - ROUNDING),
        }
    }

    /// Time that is left, s; infinite if the goal is a number of steps.
    pub fn left(self, simulation: &Simulation) -> f64 {
        match self {
            Self::Steps(_) => f64::INFINITY,
            Self::Time(end) => end - simulation.time(),
        }
    }

    /// The whole length for the progress bar, in steps or microseconds.
    pub fn total(self) -> u64 {
        match self {
            Self::Steps(steps) => steps,
            Self::Time(end) => (1e6 * end) as u64,
        }
    }

    /// The part of [`Goal::total`] that is done.
    pub fn done(self, simulation: &Simulation) -> u64 {
        match self {
            Self::Steps(_) => simulation.steps(),
            Self::Time(_) => (1e6 * simulation.time()) as u64,
        }
    }

    /// Number of frames after that of a beginning, if each step has this length, s.
    pub fn frames(self, begin: Begin, experiment: &Experiment, dt: f64) -> u64 {
        let end = match self {
            Self::Steps(steps) => begin.time + steps.saturating_sub(begin.steps) as f64 * dt,
            Self::Time(end) => end,
        };
        // runs arrive at their frames within rounding errors
        let every = experiment.scene().run.save_every;
        let all = (end / every * (1.0 - ROUNDING)).ceil();
        (all - (begin.time / every * (1.0 + ROUNDING)).floor()).max(0.0) as u64
    }

    /// Number of steps from a beginning, if each has this length, s.
    pub fn steps(self, begin: Begin, dt: f64) -> u64 {
        match self {
            Self::Steps(steps) => steps.saturating_sub(begin.steps),
            Self::Time(end) => ((end - begin.time) / dt).ceil() as u64,
        }
    }
}

/// A frame is meant by a time this part of it earlier or later: 3·0.05 is 0.15000000000000002, and not 0.15.
const ROUNDING: f64 = 1e-12;

/// A time, s, or that of the frame which is meant by it. A run that ends at a frame takes the same last step
/// as one that goes on from there.
fn frame_within_rounding(time: f64, every: f64) -> f64 {
    let frame = every * (time / every).round();
    if (frame - time).abs() <= ROUNDING * time { frame } else { time }
}

/// When frames are saved: after a number of equal steps, or at instants that steps are fitted to.
pub(super) enum Pace {
    Steps(u64),
    Times { every: f64, next: u64 },
}

impl Pace {
    /// The frames of a run from a time on, s.
    pub fn new(experiment: &Experiment, time: f64) -> Self {
        let every = experiment.scene().run.save_every;
        if experiment.parameters().adaptive {
            Self::Times { every, next: 1 + (time / every * (1.0 + ROUNDING)) as u64 }
        } else {
            Self::Steps(((every / experiment.parameters().time_step).round() as u64).max(1))
        }
    }

    /// Time to the next frame, s, if steps are fitted to frames; otherwise infinite.
    pub fn left(&self, simulation: &Simulation) -> f64 {
        match self {
            Self::Steps(_) => f64::INFINITY,
            Self::Times { every, next } => every * *next as f64 - simulation.time(),
        }
    }

    /// Whether a frame is due after a step. A due frame counts as saved.
    pub fn frame_is_due(&mut self, simulation: &Simulation) -> bool {
        match self {
            Self::Steps(steps) => simulation.steps().is_multiple_of(*steps),
            Self::Times { every, next } => {
                let due = simulation.time() >= *every * *next as f64 * (1.0 - ROUNDING);
                *next += u64::from(due);
                due
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_at_a_frame_is_the_time_of_the_frame() {
        let differing = (1..200).filter(|k| {
            let (written, frame) = (f64::from(5 * k) / 100.0, 0.05 * f64::from(*k));
            assert_eq!(frame_within_rounding(written, 0.05), frame);
            written != frame
        });
        assert!(differing.count() > 10);
        assert_eq!(frame_within_rounding(0.15, 0.04), 0.15);
        assert_eq!(frame_within_rounding(0.0, 0.04), 0.0);
    }
}
