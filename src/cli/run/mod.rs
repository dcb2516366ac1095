//! `rfm run`: the fluid of a scene, step by step, with frames, pictures and a summary.
//!
//! experiment (scene → simulation) → steps, with a frame, a checkpoint and samples of probes every so often → summary.

mod bodies;
mod checkpoints;
mod frames;
mod pace;
mod probes;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::args::{Run, Shared};
use super::{Failure, choose, input, note, output, progress};
use crate::diagnostic::Diagnostics;
use crate::experiment::{Deviation, Deviations};
use crate::lower::Scene;
use crate::sph::{Checkpoint, Simulation, Stats, StepError, short_time};
use crate::{Error, Experiment, Program};
use checkpoints::Checkpoints;
use frames::Frames;
use probes::Probes;

/// What `summary.json` and `--json` say; figures that judge the run are the worst of all saved instants.
#[derive(Debug, Serialize)]
struct Summary {
    schema: u32,
    scene: String,
    steps: u64,
    simulated_seconds: f64,
    time_step: f64,
    particles: usize,
    particles_carved: usize,
    /// Of one particle, kg.
    particle_mass: f64,
    /// kg/m³
    rest_density: f64,
    milliseconds_per_step: f64,
    neighbours_per_particle: f64,
    max_penetration: f64,
    inside: usize,
    lost: usize,
    non_finite: usize,
    max_density_error: f64,
    kinetic_energy: f64,
    potential_energy: f64,
    energy_at_start: f64,
    /// Largest energy of a saved instant above the one at the start, as a part of that; 0 if it only fell, null if
    /// a fluid that had none at the start has some.
    energy_growth: Option<f64>,
    max_speed: f64,
    /// Relative L2 deviation of the pressure from the scene's `truth`, over all saved instants.
    #[serde(skip_serializing_if = "Option::is_none")]
    pressure_error: Option<f64>,
    /// The same of the velocity.
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_error: Option<f64>,
    /// The same of the front on the floor.
    #[serde(skip_serializing_if = "Option::is_none")]
    front_error: Option<f64>,
    passes: Vec<&'static str>,
    threads: usize,
    frames: usize,
    finished: bool,
}

pub(super) fn run(shared: &Shared, options: &Run) -> Result<(), Failure> {
    let program = input::program(shared, &options.file)?;
    let scene = choose::scene(&program, options.scene.as_deref())?;
    let setup = experiment(shared, &program, scene)?;
    let fingerprint = checkpoints::fingerprint(&program, scene, &setup);
    let folder = frames::folder(options);
    let resumed = options.resume.then(|| checkpoints::latest(&folder, &fingerprint)).transpose()?;
    let (mut simulation, carved) = match &resumed {
        Some(checkpoint) => (setup.resume(checkpoint).map_err(Failure::usage)?, 0),
        None => start(&setup, &program, scene)?,
    };
    let goal = Goal::of(options, scene, &setup)?;
    if options.dry_run {
        return dry_run(shared, &mut simulation, &setup, goal);
    }
    let mut recording = Recording {
        program: &program,
        scene,
        setup: &setup,
        frames: Frames::new(options, scene, &setup, resumed.as_ref())?,
        probes: Probes::start(&folder, scene, &mut simulation, resumed.as_ref())?,
        checkpoints: Checkpoints::new(&folder, fingerprint, scene, resumed.as_ref()),
        watch: Watch::new(&simulation, carved, resumed.as_ref()),
    };
    let pace = Pace::new(scene, &setup, simulation.time());
    let interrupted = interruption()?;
    let end = recording.go_on(&mut simulation, goal, pace, &interrupted);
    let finished = match end {
        Ok(finished) => finished,
        Err(Failure::Usage(message)) => {
            return Err(Failure::Usage(format!("{message}\n{}", recording.kept())));
        }
        Err(other) => return Err(other),
    };
    let Recording { frames, probes, watch, .. } = &recording;
    let summary = watch.summary(scene, &simulation, frames.count(), finished.is_ok());
    output::write(&folder.join("summary.json"), |out| {
        serde_json::to_writer_pretty(&mut *out, &summary)?;
        writeln!(out)
    })?;
    probes.plot()?;
    if shared.json {
        output::json(&summary)?;
    }
    match finished {
        Ok(()) if !shared.json => print(&summary, frames, probes),
        Ok(()) => {}
        Err(Stop::Interrupted) => {
            note(format!("interrupted after {} steps; {}", simulation.steps(), recording.kept()));
            return Err(Failure::Interrupted);
        }
        Err(Stop::Numerical(error)) => {
            return Err(Failure::Numerical(format!("{error}\n{}", recording.kept())));
        }
    }
    Ok(())
}

fn experiment(shared: &Shared, program: &Program, scene: &Scene) -> Result<Experiment, Failure> {
    let experiment = Experiment::of(program, scene, shared.engine.into()).map_err(refused)?;
    tell(&experiment, program);
    Ok(experiment)
}

fn start<'a>(
    experiment: &'a Experiment,
    program: &Program,
    scene: &Scene,
) -> Result<(Simulation<'a>, usize), Failure> {
    let simulation = experiment.simulation(program, scene).map_err(refused)?;
    tell(experiment, program);
    Ok(simulation)
}

fn tell(experiment: &Experiment, program: &Program) {
    input::show(&Diagnostics { list: experiment.take_warnings(), sources: program.sources().clone() });
}

/// Shows messages about the scene and makes them findings.
fn refused(error: Error) -> Failure {
    match error {
        Error::Diagnostics(diagnostics) => {
            input::show(&diagnostics);
            Failure::Findings
        }
        other => choose::usage(other),
    }
}

/// All that is written while a run goes on.
struct Recording<'a> {
    program: &'a Program,
    scene: &'a Scene,
    setup: &'a Experiment,
    frames: Frames,
    probes: Probes,
    checkpoints: Checkpoints,
    watch: Watch,
}

/// Why a run ended before its end.
enum Stop {
    Interrupted,
    Numerical(StepError),
}

impl Recording<'_> {
    /// Steps to the goal, or as far as it goes.
    fn go_on(
        &mut self,
        simulation: &mut Simulation<'_>,
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
            let result = self.setup.step(self.program, self.scene, simulation, longest);
            self.watch.spent += started.elapsed();
            if let Err(error) = result {
                bar.finish_and_clear();
                return Ok(Err(Stop::Numerical(error)));
            }
            bar.set_position(goal.done(simulation));
            let stop = interrupted.load(Ordering::Relaxed);
            let in_turn = pace.frame_is_due(simulation);
            self.record(simulation, in_turn, stop || goal.is_reached(simulation))?;
            let speed = self.watch.now.max_speed;
            let mut message = format!("t = {:.3} s, {speed:.2} m/s", simulation.time());
            if let Some(iterations) = simulation.iterations() {
                message += &format!(", {iterations} iterations");
            }
            bar.set_message(message);
            if stop {
                bar.finish_and_clear();
                return Ok(Err(Stop::Interrupted));
            }
        }
        // a run that goes on and is at its end already has lost the frame that was saved there out of turn
        if self.frames.last_time() != simulation.time() {
            self.frames.save(simulation)?;
        }
        bar.finish_and_clear();
        Ok(Ok(()))
    }

    /// Writes what is due after a step: frames first, so that a checkpoint never knows of one that is not there.
    fn record(&mut self, simulation: &Simulation<'_>, in_turn: bool, last: bool) -> Result<(), Failure> {
        self.probes.sample(simulation)?;
        if in_turn {
            self.look(simulation);
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
            self.look(simulation);
        }
        Ok(())
    }

    fn look(&mut self, simulation: &Simulation<'_>) {
        self.watch.look(simulation);
        self.watch.deviations.look(self.program, self.scene, simulation);
    }

    /// What is left of a run that ended early.
    fn kept(&self) -> String {
        let frames = format!("the frames up to {} s are kept", short_time(self.frames.last_time()));
        match self.checkpoints.last() {
            Some(path) => format!("{frames}; --resume goes on from `{}`", path.display()),
            None => format!("{frames}; there is no checkpoint yet"),
        }
    }
}

/// Name in a checkpoint of what [`Watch`] remembers.
const WATCH: &str = "watch";

/// Where a run ends.
#[derive(Clone, Copy)]
enum Goal {
    /// After so many steps.
    Steps(u64),
    /// At an instant, s, which steps of any length arrive at.
    Time(f64),
}

impl Goal {
    fn of(options: &Run, scene: &Scene, setup: &Experiment) -> Result<Self, Failure> {
        match (options.steps, options.until) {
            (Some(steps), _) => Ok(Self::Steps(steps)),
            (None, Some(until)) if !(until.is_finite() && until >= 0.0) => {
                Err(Failure::usage(format!("--until {until}: expected a time in seconds")))
            }
            (None, until) => {
                let until = until.unwrap_or(scene.run.until);
                Ok(if setup.parameters.adaptive {
                    Self::Time(until)
                } else {
                    Self::Steps((until / setup.parameters.time_step).round() as u64)
                })
            }
        }
    }

    fn is_reached(self, simulation: &Simulation<'_>) -> bool {
        match self {
            Self::Steps(steps) => simulation.steps() >= steps,
            Self::Time(end) => simulation.time() >= end * (1.0 - 1e-12),
        }
    }

    /// Time to the end, s, if it is known.
    fn left(self, simulation: &Simulation<'_>) -> f64 {
        match self {
            Self::Steps(_) => f64::INFINITY,
            Self::Time(end) => end - simulation.time(),
        }
    }

    /// For the bar: steps, or microseconds.
    fn total(self) -> u64 {
        match self {
            Self::Steps(steps) => steps,
            Self::Time(end) => (1e6 * end) as u64,
        }
    }

    fn done(self, simulation: &Simulation<'_>) -> u64 {
        match self {
            Self::Steps(_) => simulation.steps(),
            Self::Time(_) => (1e6 * simulation.time()) as u64,
        }
    }

    /// Steps to come if each were as long as this, s.
    fn steps(self, dt: f64) -> u64 {
        match self {
            Self::Steps(steps) => steps,
            Self::Time(end) => (end / dt).ceil() as u64,
        }
    }
}

/// When frames are saved: after a number of equal steps, or at instants that steps are fitted to.
enum Pace {
    Steps(u64),
    Times { every: f64, next: u64 },
}

impl Pace {
    /// From a time on, s.
    fn new(scene: &Scene, setup: &Experiment, time: f64) -> Self {
        let every = scene.run.save_every;
        if setup.parameters.adaptive {
            Self::Times { every, next: 1 + (time / every * (1.0 + 1e-12)) as u64 }
        } else {
            Self::Steps(((every / setup.parameters.time_step).round() as u64).max(1))
        }
    }

    /// Time to the next frame, s, if steps are to be fitted to it.
    fn left(&self, simulation: &Simulation<'_>) -> f64 {
        match self {
            Self::Steps(_) => f64::INFINITY,
            Self::Times { every, next } => every * *next as f64 - simulation.time(),
        }
    }

    fn frame_is_due(&mut self, simulation: &Simulation<'_>) -> bool {
        match self {
            Self::Steps(steps) => simulation.steps().is_multiple_of(*steps),
            Self::Times { every, next } => {
                let due = simulation.time() >= *every * *next as f64 * (1.0 - 1e-12);
                *next += u64::from(due);
                due
            }
        }
    }
}

/// Set by Ctrl-C: the run ends after the step that is under way.
fn interruption() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = Arc::clone(&flag);
    let handler = move || {
        if set.swap(true, Ordering::Relaxed) {
            std::process::exit(130); // asked twice
        }
    };
    ctrlc::set_handler(handler).map_err(|e| Failure::usage(format!("cannot listen for Ctrl-C: {e}")))?;
    Ok(flag)
}

/// What `--dry-run` says.
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

fn dry_run(
    shared: &Shared,
    simulation: &mut Simulation<'_>,
    setup: &Experiment,
    goal: Goal,
) -> Result<(), Failure> {
    /// Steps that are taken before the clock starts: buffers grow, and solvers begin without an answer to start from.
    const FIRST: u32 = 2;
    /// Steps at most, and seconds after which no further one is begun.
    const TRIAL: (u32, f64) = (20, 1.0);
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
    // at the start a fluid is slower than it will be
    let time_step = if setup.parameters.adaptive {
        setup.parameters.stable_dt(setup.typical_speed).min(simulation.stable_dt())
    } else {
        setup.parameters.time_step
    };
    let steps = goal.steps(time_step);
    let stats = simulation.stats();
    let forecast = Forecast {
        schema: 1,
        particles: stats.particles,
        spacing: setup.parameters.spacing(),
        neighbours_per_particle: stats.neighbours_per_particle,
        time_step,
        time_step_reason: setup.time_step_reason,
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

fn pass_names(simulation: &Simulation<'_>) -> Vec<&'static str> {
    simulation.passes().into_iter().map(crate::sph::Pass::name).collect()
}

/// The figures of a run while it goes on.
struct Watch {
    spent: Duration,
    carved: usize,
    energy_at_start: f64,
    most_energy: f64,
    now: Stats,
    worst: Stats,
    neighbours: (f64, usize),
    /// From what is known.
    deviations: Deviations,
}

impl Watch {
    fn new(simulation: &Simulation<'_>, carved: usize, resumed: Option<&Checkpoint>) -> Self {
        let stats = simulation.stats();
        let energy = stats.kinetic_energy + stats.potential_energy;
        let mut watch = Self {
            spent: Duration::ZERO,
            carved,
            energy_at_start: energy,
            most_energy: energy,
            neighbours: (stats.neighbours_per_particle, 1),
            deviations: Deviations::default(),
            now: stats.clone(),
            worst: stats,
        };
        if let Some(memory) = resumed.and_then(|checkpoint| checkpoint.get(WATCH).ok()) {
            watch.take_up(memory);
        }
        watch
    }

    /// What a run that goes on must know of its beginning.
    fn memory(&self) -> Vec<f64> {
        let Self { spent, carved, energy_at_start, most_energy, neighbours, worst, .. } = self;
        let mut memory = vec![
            spent.as_secs_f64(),
            *carved as f64,
            *energy_at_start,
            *most_energy,
            neighbours.0,
            neighbours.1 as f64,
            worst.max_penetration,
            worst.inside as f64,
            worst.lost as f64,
            worst.non_finite as f64,
            worst.max_density_error,
            worst.max_speed,
        ];
        memory.extend(self.deviations.memory());
        memory
    }

    /// The other way; a memory of another length is none.
    fn take_up(&mut self, memory: &[f64]) {
        let Ok(
            [
                spent,
                carved,
                start,
                most,
                sum,
                looks,
                depth,
                inside,
                lost,
                non_finite,
                density,
                speed,
                deviations @ ..,
            ],
        ) = <[f64; 19]>::try_from(memory)
        else {
            return;
        };
        self.spent = Duration::try_from_secs_f64(spent).unwrap_or_default();
        self.carved = carved as usize;
        (self.energy_at_start, self.most_energy) = (start, most);
        self.neighbours = (sum, looks as usize);
        self.deviations = Deviations::remembered(deviations);
        self.worst = Stats {
            max_penetration: depth,
            inside: inside as usize,
            lost: lost as usize,
            non_finite: non_finite as usize,
            max_density_error: density,
            max_speed: speed,
            ..self.worst.clone()
        };
    }

    fn look(&mut self, simulation: &Simulation<'_>) {
        let now = simulation.stats();
        self.most_energy = self.most_energy.max(now.kinetic_energy + now.potential_energy);
        self.neighbours.0 += now.neighbours_per_particle;
        self.neighbours.1 += 1;
        let worst = &mut self.worst;
        worst.max_penetration = worst.max_penetration.max(now.max_penetration);
        worst.inside = worst.inside.max(now.inside);
        worst.lost = worst.lost.max(now.lost);
        worst.non_finite = worst.non_finite.max(now.non_finite);
        worst.max_density_error = worst.max_density_error.max(now.max_density_error);
        worst.max_speed = worst.max_speed.max(now.max_speed);
        self.now = now;
    }

    fn summary(&self, scene: &Scene, simulation: &Simulation<'_>, frames: usize, finished: bool) -> Summary {
        let steps = simulation.steps();
        let deviation = self.deviations.total();
        Summary {
            schema: 1,
            scene: scene.name.clone(),
            steps,
            simulated_seconds: simulation.time(),
            time_step: simulation.time() / steps.max(1) as f64,
            particles: self.now.particles,
            particles_carved: self.carved,
            particle_mass: simulation.parameters().particle_mass,
            rest_density: simulation.parameters().rest_density,
            milliseconds_per_step: self.spent.as_secs_f64() * 1e3 / steps.max(1) as f64,
            neighbours_per_particle: self.neighbours.0 / self.neighbours.1 as f64,
            max_penetration: self.worst.max_penetration,
            inside: self.worst.inside,
            lost: self.worst.lost,
            non_finite: self.worst.non_finite,
            max_density_error: self.worst.max_density_error,
            kinetic_energy: self.now.kinetic_energy,
            potential_energy: self.now.potential_energy,
            energy_at_start: self.energy_at_start,
            energy_growth: growth(self.energy_at_start, self.most_energy),
            max_speed: self.worst.max_speed,
            pressure_error: deviation.pressure,
            velocity_error: deviation.velocity,
            front_error: deviation.front,
            passes: pass_names(simulation),
            threads: rayon::current_num_threads(),
            frames,
            finished,
        }
    }
}

/// How far `most` exceeds `start`, as a part of `start`.
fn growth(start: f64, most: f64) -> Option<f64> {
    if most <= start { Some(0.0) } else { Some(most / start - 1.0).filter(|part| part.is_finite()) }
}

fn print(summary: &Summary, frames: &Frames, probes: &Probes) {
    say!(
        "{} particles, {} steps of {:.3e} s = {:.3} s simulated",
        summary.particles,
        summary.steps,
        summary.time_step,
        summary.simulated_seconds
    );
    say!(
        "{:.2} ms per step on {} thread(s), {:.1} neighbours per particle",
        summary.milliseconds_per_step,
        summary.threads,
        summary.neighbours_per_particle
    );
    say!(
        "inside the obstacle: {} (deepest {:.1e} m), outside the box: {}, not finite: {}",
        summary.inside,
        summary.max_penetration,
        summary.lost,
        summary.non_finite
    );
    say!(
        "energy: {:.2} J at the start, {:.2} J at the end; largest compression {:.1} %",
        summary.energy_at_start,
        summary.kinetic_energy + summary.potential_energy,
        100.0 * summary.max_density_error
    );
    let errors = [summary.pressure_error, summary.velocity_error, summary.front_error];
    for (what, error) in Deviation::NAMES.into_iter().zip(errors) {
        if let Some(error) = error {
            say!("{what}: {:.2} % from what is known (relative L2 over the saved instants)", 100.0 * error);
        }
    }
    let probes = if probes.count() > 0 { format!(", {} probes", probes.count()) } else { String::new() };
    say!("written to {}: {}{probes}", frames.folder().display(), frames.describe());
}

/// `rfm explain FILE:SCENE`: which passes run, which do not, and why.
pub(super) fn explain(shared: &Shared, program: &Program, scene: &Scene) -> Result<(), Failure> {
    let setup = experiment(shared, program, scene)?;
    let (simulation, _) = start(&setup, program, scene)?;
    say!(
        "scene {}: method {}, sums over neighbours in {}, time step {}",
        scene.name,
        setup.parameters.method.name(),
        setup.parameters.precision.name(),
        if setup.parameters.adaptive {
            setup.time_step_reason.to_string()
        } else {
            format!("{:.3e} s ({})", setup.parameters.time_step, setup.time_step_reason)
        }
    );
    for (pass, absence) in simulation.plan() {
        match absence {
            None => say!("  runs      {pass}"),
            Some(reason) => say!("  left out  {pass}: {reason}"),
        }
    }
    Ok(())
}
