//! `rfm run`: the fluid of a scene, step by step, with frames, pictures and a summary.
//!
//! A scene becomes an experiment, and this a simulation. It takes steps, with a frame, a checkpoint and
//! samples of probes at their times, and ends with a summary.

pub(super) mod bodies;
mod checkpoints;
mod findings;
mod folder;
mod forecast;
mod frames;
mod goal;
mod means;
mod paraview;
pub(super) mod pictures;
mod probe_plot;
mod probes;
mod stop;
mod summary;
mod watch;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::args::Run;
use super::shared::Shared;
use super::{Failure, choose, input, interrupt, lints, note, output, progress};
use crate::cli::output::Shown;
use checkpoints::Checkpoints;
use folder::Hold;
use frames::Frames;
use goal::{Begin, Goal, Pace};
use probes::Probes;
use rfm::lower::Scene;
use rfm::render::digits_of_time;
use rfm::sph::{Simulation, short_time};
use rfm::{Error, Experiment, Program};
use stop::{NoRoom, Stop};
use summary::Summary;
use watch::{WATCH, Watch};

/// Memory that an obstacle of a single leaf was found to take.
const MEGABYTES_OF_OBSTACLE: f64 = 0.7;

pub(super) fn run(shared: &Shared, options: &Run) -> Result<(), Failure> {
    let program = input::program(shared, &options.file)?;
    let scene = choose::scene(&program, options.scene.as_deref())?;
    obstacles_fit(options, scene)?;
    let experiment = experiment(shared, &program, &scene.name)?;
    let mark = experiment.mark();
    let folder = folder::of(options);
    let read = program.files().asked();
    let latest = || options.resume.then(|| checkpoints::latest(&folder, &mark, &read)).transpose();
    if options.dry_run {
        let goal = Goal::of(options, &experiment)?;
        frames_fit(options, goal, &experiment)?;
        if !options.resume {
            input::show(&lints::of_experiment(&experiment, &mut lints::Searches::short()));
        }
        return forecast::dry_run(shared, options, &experiment, goal, latest()?.as_ref());
    }
    // a run that is writing there is told of before what it has written so far
    let again = folder::was_held(&folder).then(|| Hold::take(&folder)).transpose()?;
    folder::may_be_written(&folder, options, experiment.scene())?;
    // a folder that is not there yet is made only after all that can fail
    let held = match again {
        None => folder.exists().then(|| Hold::take(&folder)).transpose()?,
        Some(_) => again,
    };
    let resumed = latest()?;
    let (mut simulation, carved) = match &resumed {
        Some(checkpoint) => (experiment.resume(checkpoint).map_err(Failure::usage)?, 0),
        None => {
            input::show(&lints::of_experiment(&experiment, &mut lints::Searches::short()));
            probes::tell_of_potentials(experiment.scene());
            start(&experiment)?
        }
    };
    let goal = Goal::of(options, &experiment)?;
    goal.lies_ahead(options, &folder, Begin { steps: simulation.steps(), time: simulation.time() })?;
    frames_fit(options, goal, &experiment)?;
    let watch = Watch::new(&experiment, &simulation, carved, resumed.as_ref())?;
    let _held = held.map_or_else(|| Hold::take(&folder), Ok)?;
    // another run may have ended in the meantime
    folder::may_be_written(&folder, options, experiment.scene())?;
    let mut recording = Recording {
        frames: Frames::new(options, &experiment, resumed.as_ref())?,
        probes: Probes::start(&folder, experiment.scene(), &mut simulation, resumed.as_ref())?,
        checkpoints: Checkpoints::new(&folder, mark, experiment.scene(), resumed.as_ref()),
        watch,
        experiment: &experiment,
    };
    let pace = Pace::new(&experiment, simulation.time());
    let interrupted = interrupt::of_runs()?;
    let end = recording.go_on(&mut simulation, goal, pace, &interrupted);
    let stopped = match end {
        Ok(end) => end.err(),
        Err(Failure::Usage(message)) => {
            return Err(Failure::Usage(format!("{message}\n{}", recording.kept())));
        }
        Err(other) => return Err(other),
    };
    conclude((shared, options), &mut recording, &simulation, stopped)
}

/// Refuses more obstacles than are reasonable: each has programs and a map of the box of its own.
fn obstacles_fit(options: &Run, scene: &Scene) -> Result<(), Failure> {
    let count = scene.obstacles.len();
    if count <= options.most_obstacles {
        return Ok(());
    }
    let megabytes = (count as f64 * MEGABYTES_OF_OBSTACLE).round();
    Err(Failure::usage(format!(
        "scene `{}` has {count} obstacles, which would take about {megabytes} MB, because each has programs of its own: \
         join them with `or` into one solid, or allow them with --most-obstacles {count}",
        scene.name
    )))
}

/// Refuses more frames than there are names for.
fn frames_fit(options: &Run, goal: Goal, experiment: &Experiment) -> Result<(), Failure> {
    let frames = goal.frames(Begin::default(), experiment, experiment.parameters().time_step);
    if options.no_frames || frames <= Scene::MOST_FRAMES {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "a run to so late an end has {frames} frames, one every {} s; at most {} are saved: choose an earlier end, a longer \
         `save_every` in the scene, or --no-frames",
        experiment.scene().run.save_every,
        Scene::MOST_FRAMES
    )))
}

/// Writes the summary and the plots, and says how the run ended.
fn conclude(
    (shared, options): (&Shared, &Run),
    recording: &mut Recording<'_>,
    simulation: &Simulation,
    stopped: Option<Stop>,
) -> Result<(), Failure> {
    let is_whole = stopped.is_none();
    let Recording { frames, probes, watch, experiment, .. } = recording;
    let summary = Summary::of(watch, experiment, simulation, probes.means()?, (frames.count(), is_whole));
    output::write(&frames.folder().join("summary.json"), |out| {
        serde_json::to_writer_pretty(&mut *out, &summary)?;
        writeln!(out)
    })?;
    probes.plot()?;
    if shared.json {
        output::json(&summary)?;
    }
    // a picture that cannot be drawn again, as that of a frame that was removed, keeps its colours
    let fitted = if is_whole { frames.fit_colours(options, experiment).unwrap_or_default() } else { None };
    match stopped {
        None => {
            if !shared.json {
                summary::print(&summary, (frames, fitted), probes);
            }
            findings::repeat(simulation);
        }
        Some(stop) => {
            if let Some(reason) = stop.reason(experiment) {
                return Err(Failure::Numerical(format!("{reason}\n{}", recording.kept())));
            }
            note(format!("interrupted after {} steps; {}", simulation.steps(), recording.kept()));
            return Err(Failure::Interrupted);
        }
    }
    Ok(())
}

/// The experiment of a scene. Its warnings are shown.
pub(super) fn experiment(shared: &Shared, program: &Program, scene: &str) -> Result<Experiment, Failure> {
    let experiment = Experiment::new(program, scene, shared.engine.into()).map_err(refused)?;
    input::show(&experiment.warnings());
    Ok(experiment)
}

/// The simulation at its start, and the number of particles that were removed. Warnings about the start are
/// shown.
pub(super) fn start(experiment: &Experiment) -> Result<(Simulation, usize), Failure> {
    let start = experiment.start().map_err(refused)?;
    input::show(&start.warnings);
    Ok((start.simulation, start.carved))
}

/// Shows the messages about a scene, and returns the failure for them.
fn refused(error: Error) -> Failure {
    match error {
        Error::Diagnostics(diagnostics) => {
            input::show(&diagnostics);
            Failure::Findings
        }
        other => choose::usage(other),
    }
}

/// Everything that a run writes while it is running.
struct Recording<'a> {
    experiment: &'a Experiment,
    frames: Frames,
    probes: Probes,
    checkpoints: Checkpoints,
    watch: Watch,
}

impl Recording<'_> {
    /// Takes steps until the goal is reached, the user interrupts, or a step fails.
    fn go_on(
        &mut self,
        simulation: &mut Simulation,
        goal: Goal,
        mut pace: Pace,
        interrupted: &AtomicBool,
    ) -> Result<Result<(), Stop>, Failure> {
        let bar = progress::bar(goal.total(), "running");
        if simulation.steps() == 0 {
            self.frames.save(simulation)?;
        }
        self.probes.sample(simulation)?;
        while !goal.is_reached(simulation) {
            let started = Instant::now();
            let longest = goal.left(simulation).min(pace.left(simulation));
            let result = simulation.step_at_most(longest);
            self.watch.spent += started.elapsed();
            if let Err(error) = result {
                bar.finish_and_clear();
                let crushed = NoRoom::of(self.experiment, simulation, true);
                return Ok(Err(crushed.map_or(Stop::Numerical(error), Stop::NoRoom)));
            }
            bar.suspend(|| findings::tell_news(simulation));
            bar.set_position(goal.done(simulation));
            let stop = interrupted.load(Ordering::Relaxed);
            let in_turn = pace.frame_is_due(simulation);
            self.record(simulation, in_turn, stop || goal.is_reached(simulation))?;
            if in_turn && let Some(crushed) = NoRoom::of(self.experiment, simulation, false) {
                bar.finish_and_clear();
                return Ok(Err(Stop::NoRoom(crushed)));
            }
            let speed = simulation.speed();
            let digits = digits_of_time(self.experiment.scene().run.save_every);
            let mut message = format!("t = {:.digits$} s, {speed:.2} m/s", simulation.time());
            if let Some(iterations) = simulation.iterations() {
                message += &format!(", {iterations} iterations");
            }
            bar.set_message(message);
            if stop {
                bar.finish_and_clear();
                return Ok(Err(Stop::Interrupted));
            }
        }
        // a run that is resumed at its end has lost the frame that was saved there out of turn
        if self.frames.last_time() != simulation.time() {
            self.frames.save(simulation)?;
        }
        bar.finish_and_clear();
        Ok(Ok(()))
    }

    /// Writes what is due after a step. Frames come first, so that a checkpoint never lists a frame that does
    /// not exist.
    fn record(&mut self, simulation: &Simulation, in_turn: bool, last: bool) -> Result<(), Failure> {
        self.probes.sample(simulation)?;
        if in_turn {
            self.watch.look(self.experiment, simulation);
        }
        if in_turn || last {
            self.frames.save(simulation)?;
        }
        if self.checkpoints.is_due(simulation.time(), in_turn) || last {
            let Self { frames, probes, watch, .. } = self;
            self.checkpoints.save(simulation, |checkpoint| {
                frames.remember(checkpoint, in_turn);
                probes.save(checkpoint);
                checkpoint.set(WATCH, watch.memory());
            })?;
        }
        if last && !in_turn {
            self.watch.look(self.experiment, simulation);
        }
        Ok(())
    }

    /// Says what a run that ended early has left.
    fn kept(&self) -> String {
        let frames = match self.frames.listed_until() {
            Some(time) => format!("the frames up to {} s are kept", short_time(time)),
            None => "there are no frames".to_string(),
        };
        match self.checkpoints.last() {
            Some(path) => format!("{frames}; --resume goes on from `{}`", path.shown()),
            None => format!("{frames}; there is no checkpoint yet"),
        }
    }
}

/// What a folder has of a run, in words; `None` if there is nothing that a new run would remove.
pub(super) fn run_in(folder: &Path) -> Option<String> {
    folder::run_in(folder)
}

/// Whether a folder has a run that `--resume` can go on with.
pub(super) fn has_checkpoint(folder: &Path) -> bool {
    checkpoints::exist(folder)
}
