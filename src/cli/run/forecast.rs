//! `rfm run --dry-run`: what a run would cost, in less than a second unless many obstacles need programs and maps.
//!
//! A large scene is not seeded: a few steps of the same scene with larger particles are measured, and scaled up.

use std::path::Path;

use serde::Serialize;

use super::super::args::Run;
use super::super::failure::warn;
use super::super::output::{counted, sound_speed};
use super::super::progress::duration;
use super::super::shared::Shared;
use super::super::stopwatch::Stopwatch;
use super::super::{Failure, input, output};
use super::frames::{self, FrameCost};
use super::goal::{Begin, Goal};
use super::summary::pass_names;
use super::{folder, refused, start};
use rfm::diagnostic::Code;
use rfm::sph::{Checkpoint, Gauge, Parameters, Simulation};
use rfm::{Error, Experiment};

/// Most particles of a simulation that is started to be measured, and least if they have very many neighbours.
const MEASURED: (f64, f64) = (6000.0, 500.0);

/// The usual number of neighbours of a particle. With more of them fewer particles are measured.
const USUAL_NEIGHBOURS: f64 = 500.0;

/// Number of steps before the clock starts: buffers grow in them, and solvers have no answer yet to start from.
const FIRST: u32 = 2;

/// Most steps that are timed, and the seconds of the clock after which no further step begins.
const TRIAL: (u32, f64) = (20, 0.15);

/// The output of `--dry-run`.
#[derive(Debug, Serialize)]
struct Forecast {
    schema: u32,
    particles: usize,
    /// Whether the particles were estimated from the volume of the fluid and not placed.
    estimated: bool,
    spacing: f64,
    neighbours_per_particle: f64,
    time_step: f64,
    time_step_reason: &'static str,
    /// The speed of sound, m/s; null if the method has none.
    sound_speed: Option<f64>,
    /// Whether the scene states it.
    sound_speed_stated: bool,
    steps: u64,
    passes: Vec<&'static str>,
    bytes: f64,
    /// Memory that is free now; null where the system does not provide it.
    bytes_free: Option<f64>,
    frames: u64,
    disk_bytes: f64,
    /// Room on the disk of the folder; null where the system does not provide it.
    disk_bytes_free: Option<f64>,
    milliseconds_per_step: f64,
    milliseconds_per_frame: f64,
    /// Seconds that are spent once: the fluid is placed and settled, walls are mapped, and what rests is drawn.
    seconds_to_start: f64,
    /// Seconds that the samples of the scene's probes take.
    seconds_of_probes: f64,
    seconds: f64,
}

/// Runs a few steps, and prints what all steps would cost, or the remaining ones of a resumed run.
pub(super) fn dry_run(
    shared: &Shared,
    options: &Run,
    experiment: &Experiment,
    goal: Goal,
    resumed: Option<&Checkpoint>,
) -> Result<(), Failure> {
    let begin = resumed.map_or(Begin::default(), |from| Begin { steps: from.steps, time: from.time });
    goal.lies_ahead(options, &folder::of(options), begin)?;
    let mut trial = Trial::start(shared, experiment, resumed)?;
    // probes may ask steps to note forces, which takes time
    let mut probes = TrialProbes::start(trial.coarser.as_ref().unwrap_or(experiment), &mut trial.simulation)?;
    let per_step = seconds_per_step(&mut trial.simulation)?;
    let per_second = probes.seconds(&trial.simulation);
    let Trial { ref simulation, particles, .. } = trial;
    let measured = trial.coarser.as_ref().unwrap_or(experiment);
    let (stats, parameters) = (simulation.stats(), experiment.parameters());
    let scale = particles as f64 / stats.particles as f64;
    let reach = within_reach(experiment);
    let crowding = reach.min(particles as f64) / reach.min(stats.particles as f64);
    let per_step = scale * crowding * per_step;
    let time_step = time_step(experiment, measured, simulation);
    let steps = goal.steps(begin, time_step);
    let first = u64::from(resumed.is_none());
    let frames = if options.no_frames { 0 } else { first + goal.frames(begin, experiment, time_step) };
    let cost = FrameCost::measured(options, measured, simulation)?.scaled(scale);
    let to_start = scale * trial.to_start + cost.first;
    let for_probes = scale * per_second * time_step * steps as f64;
    let disk = frames as f64 * cost.bytes + 2.0 * scale * frames::checkpoint_bytes(simulation);
    let forecast = Forecast {
        schema: 1,
        particles,
        estimated: trial.coarser.is_some() && resumed.is_none(),
        // that of the scene is stretched when its particles are placed
        spacing: trial.coarser.as_ref().map_or(simulation.parameters(), |_| parameters).spacing(),
        neighbours_per_particle: stats.neighbours_per_particle,
        time_step,
        time_step_reason: experiment.time_step().reason,
        sound_speed: Some(parameters.sound_speed()).filter(|speed| *speed > 0.0),
        sound_speed_stated: parameters.states_sound_speed(),
        steps,
        passes: pass_names(simulation),
        bytes: memory(simulation, scale),
        bytes_free: free_memory(),
        frames,
        disk_bytes: disk,
        disk_bytes_free: free_disk(&folder::of(options)),
        milliseconds_per_step: per_step * 1e3,
        milliseconds_per_frame: cost.seconds * 1e3,
        seconds_to_start: to_start,
        seconds_of_probes: for_probes,
        seconds: to_start + per_step * steps as f64 + cost.seconds * frames as f64 + for_probes,
    };
    warn_of_too_much(&forecast);
    if shared.json {
        return output::json(&forecast);
    }
    print(&forecast, parameters);
    Ok(())
}

/// A simulation whose steps are timed: the scene's, or one with fewer particles.
struct Trial {
    /// The scene with fewer particles, if the scene has too many.
    coarser: Option<Experiment>,
    simulation: Simulation,
    /// The seconds that the start took.
    to_start: f64,
    /// The number of particles of the scene.
    particles: usize,
}

impl Trial {
    fn start(
        shared: &Shared,
        experiment: &Experiment,
        resumed: Option<&Checkpoint>,
    ) -> Result<Self, Failure> {
        let estimate = match resumed {
            Some(checkpoint) => checkpoint.ids.len() as f64,
            None => experiment.estimated_particles().map_err(refused)?,
        };
        let most = most_measured(experiment);
        if estimate > 1.5 * most {
            let (coarser, simulation, to_start) = coarser(shared, experiment, most)?;
            let particles = estimate.round() as usize;
            // a resumed run places nothing
            let to_start = if resumed.is_some() { 0.0 } else { to_start };
            return Ok(Self { coarser: Some(coarser), simulation, to_start, particles });
        }
        let begun = Stopwatch::start();
        let simulation = match resumed {
            Some(checkpoint) => experiment.resume(checkpoint).map_err(Failure::usage)?,
            None => start(experiment)?.0,
        };
        let particles = simulation.particles().len();
        Ok(Self { coarser: None, simulation, to_start: begun.seconds(), particles })
    }
}

/// The scene with few large particles, started, and the seconds that the start took. If particles are too
/// large for the gaps of the scene, nothing may be left, so more particles are tried.
fn coarser(
    shared: &Shared,
    experiment: &Experiment,
    most: f64,
) -> Result<(Experiment, Simulation, f64), Failure> {
    let started = |particles: f64| {
        let smaller = experiment.coarser(particles, shared.engine.into())?;
        let begun = Stopwatch::start();
        let start = smaller.start()?;
        Ok((smaller, start, begun.seconds()))
    };
    let found: Result<_, Error> =
        started(most).or_else(|_: Error| started(4.0 * most)).or_else(|_: Error| started(16.0 * most));
    let (smaller, mut start, seconds) = found.map_err(refused)?;
    // warnings that count particles, or depend on their size, would mislead
    let misleads = [Code::FLUID_IN_OBSTACLE, Code::DRY_WALL];
    start.warnings.list.retain(|warning| !misleads.contains(&warning.code));
    input::show(&start.warnings);
    Ok((smaller, start.simulation, seconds))
}

/// Particles of the rest spacing within the support radius of one.
fn within_reach(experiment: &Experiment) -> f64 {
    let parameters = experiment.parameters();
    4.0 / 3.0 * std::f64::consts::PI * (parameters.support_radius / parameters.spacing()).powi(3)
}

/// The most particles that are measured: a step costs what its pairs cost.
fn most_measured(experiment: &Experiment) -> f64 {
    let (most, least) = MEASURED;
    (most * (USUAL_NEIGHBOURS / within_reach(experiment)).sqrt().min(1.0)).max(least)
}

fn seconds_per_step(simulation: &mut Simulation) -> Result<f64, Failure> {
    let mut step = || simulation.step().map_err(|e| Failure::Numerical(e.to_string()));
    for _ in 0..FIRST {
        step()?;
    }
    let started = Stopwatch::start();
    let mut trial = 0;
    while trial == 0 || (trial < TRIAL.0 && started.passed() < TRIAL.1) {
        step()?;
        trial += 1;
    }
    Ok(started.seconds() / f64::from(trial))
}

/// The probes of a scene, sampled once before the steps that are timed.
struct TrialProbes {
    /// Each with the time between two samples, s.
    gauges: Vec<(Gauge, f64)>,
}

impl TrialProbes {
    /// Samples each probe once: the first sample of a force finds the pieces of a surface, which later ones know.
    fn start(measured: &Experiment, simulation: &mut Simulation) -> Result<Self, Failure> {
        let scene = measured.scene();
        let mut gauges = Vec::new();
        for probe in &scene.probes {
            let gauge = simulation.gauge(probe.measured);
            let mut gauge = gauge.map_err(|e| Failure::usage(format!("probe `{}`: {e}", probe.name)))?;
            simulation.sample(&mut gauge);
            gauges.push((gauge, probe.every.unwrap_or(scene.run.save_every)));
        }
        Ok(Self { gauges })
    }

    /// The seconds that their samples take for each second that is simulated.
    fn seconds(&mut self, simulation: &Simulation) -> f64 {
        let of_one = |(gauge, every): &mut (Gauge, f64)| {
            let started = Stopwatch::start();
            simulation.sample(gauge);
            started.seconds() / every.max(simulation.stable_dt())
        };
        self.gauges.iter_mut().map(of_one).sum()
    }
}

/// The length of a step, s: the fluid will become faster than it is at the start.
fn time_step(experiment: &Experiment, measured: &Experiment, simulation: &Simulation) -> f64 {
    let parameters = experiment.parameters();
    if !parameters.adaptive {
        return parameters.time_step;
    }
    let expected = parameters.stable_dt(experiment.typical_speed());
    let coarse = measured.parameters().stable_dt(measured.typical_speed());
    expected * (simulation.stable_dt() / coarse).min(1.0)
}

fn warn_of_too_much(forecast: &Forecast) {
    let Forecast { bytes, bytes_free, disk_bytes, disk_bytes_free, .. } = forecast;
    if let Some(free) = bytes_free.filter(|free| bytes > free) {
        let [needed, free] = [*bytes, free].map(size);
        warn(Code::TOO_MUCH, format!("the run needs about {needed} of memory, and {free} are free"));
    }
    if let Some(free) = disk_bytes_free.filter(|free| disk_bytes > free) {
        let [needed, free] = [*disk_bytes, free].map(size);
        warn(Code::TOO_MUCH, format!("the run writes about {needed}, and {free} of the disk are free"));
    }
}

/// Probes that take more than this part of the time are named.
const SHOWN_PART: f64 = 0.05;

fn print(forecast: &Forecast, parameters: &Parameters) {
    let about = if forecast.estimated { "about " } else { "" };
    let free = |free: Option<f64>| free.map_or(String::new(), |free| format!(", {} free", size(free)));
    say!("particles     {about}{}", forecast.particles);
    say!("spacing       {:.3e} m", forecast.spacing);
    say!("neighbours    {:.1} per particle", forecast.neighbours_per_particle);
    say!("time step     {:.3e} s ({})", forecast.time_step, forecast.time_step_reason);
    if forecast.sound_speed.is_some() {
        say!("sound speed   {}", sound_speed(parameters));
    }
    match forecast.steps {
        u64::MAX => say!("steps         more than {:.1e}", u64::MAX as f64),
        steps => say!("steps         {steps}"),
    }
    say!("passes        {}", forecast.passes.join(", "));
    say!("memory        about {}{}", size(forecast.bytes), free(forecast.bytes_free));
    say!(
        "disk          about {} for {}{}",
        size(forecast.disk_bytes),
        counted(forecast.frames as usize, "frame"),
        free(forecast.disk_bytes_free)
    );
    say!(
        "time          about {} ({} to start, {} per step, {} per frame{})",
        duration(forecast.seconds),
        short(forecast.seconds_to_start),
        short(1e-3 * forecast.milliseconds_per_step),
        short(1e-3 * forecast.milliseconds_per_frame),
        if forecast.seconds_of_probes > SHOWN_PART * forecast.seconds {
            format!(", {} for probes", short(forecast.seconds_of_probes))
        } else {
            String::new()
        }
    );
}

/// A short time in a readable form: `0.35 ms`, `31 ms`, `2.4 s`, and longer ones as [`duration`] does.
fn short(seconds: f64) -> String {
    let digits = |value: f64| if value < 10.0 { format!("{value:.2}") } else { format!("{value:.0}") };
    match seconds {
        s if s < 1.0 => format!("{} ms", digits(1e3 * s)),
        s if s < 10.0 => format!("{s:.1} s"),
        s => duration(s),
    }
}

/// A number of bytes as a person says it.
fn size(bytes: f64) -> String {
    match bytes {
        b if b < 1e6 => format!("{:.1} kB", b / 1e3),
        b if b < 1e9 => format!("{:.1} MB", b / 1e6),
        b if b < 1e12 => format!("{:.1} GB", b / 1e9),
        b => format!("{:.1} TB", b / 1e12),
    }
}

/// Bytes that the process will take: the state and the copy of it that becomes a checkpoint, beside what the
/// program takes for itself.
fn memory(simulation: &Simulation, scale: f64) -> f64 {
    let state = simulation.bytes() as f64;
    let own = own_memory().map_or(0.0, |bytes| (bytes - state).max(0.0));
    own + scale * (state + frames::checkpoint_bytes(simulation))
}

/// Bytes of memory that this process takes now; `None` where the system does not provide it.
fn own_memory() -> Option<f64> {
    kilobytes("/proc/self/status", "VmRSS:")
}

/// Bytes of memory that programs may still take; `None` where the system does not provide it.
fn free_memory() -> Option<f64> {
    kilobytes("/proc/meminfo", "MemAvailable:")
}

/// The figure of a line of a file that gives kilobytes, in bytes.
fn kilobytes(file: &str, name: &str) -> Option<f64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024.0 * kilobytes)
}

/// Bytes that are free on the disk of a folder, or of the nearest folder above it that exists.
#[cfg(unix)]
fn free_disk(folder: &Path) -> Option<f64> {
    let absolute = std::path::absolute(folder).ok()?;
    let there = absolute.ancestors().find(|folder| folder.exists())?;
    let found = rustix::fs::statvfs(there).ok()?;
    Some(found.f_bavail as f64 * found.f_frsize as f64)
}

#[cfg(not(unix))]
fn free_disk(_: &Path) -> Option<f64> {
    None
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn short_times_have_two_or_three_digits() {
        let shown = [3.5e-4, 9.876e-3, 0.0314, 0.5, 2.42, 5600.0].map(short);
        assert_eq!(shown, ["0.35 ms", "9.88 ms", "31 ms", "500 ms", "2.4 s", "93 min"]);
    }
}
