//! `rfm run --dry-run`: what a run would cost.

use std::time::Instant;

use serde::Serialize;

use super::super::args::Shared;
use super::super::{Failure, output};
use super::goal::Goal;
use super::summary::pass_names;
use rfm::Experiment;
use rfm::sph::Simulation;

/// The output of `--dry-run`.
#[derive(Debug, Serialize)]
struct Forecast {
    schema: u32,
    particles: usize,
    spacing: f64,
    neighbours_per_particle: f64,
    time_step: f64,
    time_step_reason: &'static str,
    steps: u64,
    passes: Vec<&'static str>,
    bytes: f64,
    milliseconds_per_step: f64,
    seconds: f64,
}

/// Runs a few steps, and prints what all of them would cost.
pub(super) fn dry_run(
    shared: &Shared,
    simulation: &mut Simulation,
    experiment: &Experiment,
    goal: Goal,
) -> Result<(), Failure> {
    /// Number of steps before the clock starts: buffers grow in them, and solvers have no answer yet to start
    /// from.
    const FIRST: u32 = 2;
    /// Most steps that are timed, and the seconds after which no further step begins.
    const TRIAL: (u32, f64) = (20, 1.0);
    let parameters = experiment.parameters();
    let mut step = || simulation.step().map_err(|e| Failure::Numerical(e.to_string()));
    for _ in 0..FIRST {
        step()?;
    }
    let started = Instant::now();
    let mut trial = 0;
    while trial < TRIAL.0 && started.elapsed().as_secs_f64() < TRIAL.1 {
        step()?;
        trial += 1;
    }
    let per_step = started.elapsed().as_secs_f64() / f64::from(trial);
    // the fluid will become faster than it is at the start
    let time_step = if parameters.adaptive {
        parameters.stable_dt(experiment.typical_speed()).min(simulation.stable_dt())
    } else {
        parameters.time_step
    };
    let steps = goal.steps(time_step);
    let stats = simulation.stats();
    let forecast = Forecast {
        schema: 1,
        particles: stats.particles,
        spacing: parameters.spacing(),
        neighbours_per_particle: stats.neighbours_per_particle,
        time_step,
        time_step_reason: experiment.time_step().reason,
        steps,
        passes: pass_names(simulation),
        bytes: simulation.bytes() as f64,
        milliseconds_per_step: per_step * 1e3,
        seconds: per_step * steps as f64,
    };
    if shared.json {
        return output::json(&forecast);
    }
    say!("particles     {}", forecast.particles);
    say!("spacing       {:.4} m", forecast.spacing);
    say!("neighbours    {:.1} per particle", forecast.neighbours_per_particle);
    say!("time step     {:.3e} s ({})", forecast.time_step, forecast.time_step_reason);
    say!("steps         {steps}");
    say!("passes        {}", forecast.passes.join(", "));
    say!("memory        about {:.0} MiB", forecast.bytes / f64::from(1 << 20));
    say!(
        "time          about {:.0} s ({:.2} ms per step, without frames)",
        forecast.seconds,
        forecast.milliseconds_per_step
    );
    Ok(())
}
