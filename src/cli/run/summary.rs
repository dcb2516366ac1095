//! The summary of a run at its end.

use serde::Serialize;

use super::findings;
use super::frames::Frames;
use super::means::Means;
use super::pictures;
use super::probes::Probes;
use super::watch::Watch;
use crate::cli::output::{Shown, counted, significant};
use crate::cli::stated::Stated;
use rfm::Experiment;
use rfm::experiment::Deviation;
use rfm::sph::{Pass, Simulation};

/// The content of `summary.json` and the output of `--json`. Figures that judge the run are the worst of all
/// saved instants.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    schema: u32,
    /// The name of the file, without its folder.
    file: String,
    scene: String,
    method: &'static str,
    /// The names of the obstacles, in the order of the array `body` of their mesh.
    obstacles: Vec<String>,
    steps: u64,
    simulated_seconds: f64,
    time_step: f64,
    /// The speed of sound, m/s; null if the method has none.
    sound_speed: Option<f64>,
    /// Whether the scene states it; otherwise it is derived.
    sound_speed_stated: bool,
    particles: usize,
    particles_carved: usize,
    /// Mass of one particle, kg.
    particle_mass: f64,
    /// The spacing of the particles at rest, m: the cube root of the volume of one.
    spacing: f64,
    /// Rest density, kg/m³.
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
    /// The greatest excess of the energy over that at the start and the work of gravity and walls, as a part
    /// of the greatest energy so far; where walls move, over the least that was left of it. Null if it cannot
    /// be judged.
    energy_excess: Option<f64>,
    /// Why it cannot be judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    energy_unjudged: Option<&'static str>,
    /// Whether `wall_work` is known to a tenth only.
    #[serde(skip)]
    work_is_rough: bool,
    /// The work of walls that move on the fluid, J; null if the energy cannot be judged.
    wall_work: Option<f64>,
    /// The largest change of the fluid's volume by the places of its particles, as a part of it.
    volume_change: f64,
    /// The largest mean compression by the places of the particles, as a part of the rest density.
    compression_mean: f64,
    /// The largest compression that one particle in a hundred exceeds.
    compression_p99: f64,
    /// The largest compression of a particle.
    compression_max: f64,
    /// The greatest part of the particles, beyond that at the start, that were closer to another one than half a spacing.
    crowded: f64,
    /// The greatest speed after any step, m/s.
    max_speed: f64,
    /// The codes of what the audit of the run has found.
    findings: Vec<&'static str>,
    /// Relative L2 deviation of the pressure from the scene's `truth`, over all saved instants.
    #[serde(skip_serializing_if = "Option::is_none")]
    pressure_error: Option<f64>,
    /// Relative L2 deviation of the velocity from the scene's `truth`, over all saved instants.
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity_error: Option<f64>,
    /// Relative L2 deviation of the front on the floor from the scene's `truth`, over all saved instants.
    #[serde(skip_serializing_if = "Option::is_none")]
    front_error: Option<f64>,
    /// The means of those probes of which the scene asks for them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    probes: Vec<Means>,
    passes: Vec<&'static str>,
    /// The lowest and the highest corner of the scene's box, m.
    #[serde(rename = "box")]
    domain: [[f64; 3]; 2],
    /// What the scene states of its pictures.
    picture: Stated,
    threads: usize,
    frames: usize,
    finished: bool,
}

impl Summary {
    /// The summary of a run that has ended.
    pub fn of(
        watch: &Watch,
        experiment: &Experiment,
        simulation: &Simulation,
        probes: Vec<Means>,
        (frames, finished): (usize, bool),
    ) -> Self {
        let domain = experiment.domain();
        let steps = simulation.steps();
        let deviation = watch.deviations.total();
        let (audit, compression) = (simulation.audit(), simulation.audit().compression());
        Self {
            schema: 1,
            file: pictures::file_name(experiment),
            scene: experiment.scene().name.clone(),
            method: experiment.scene().method.name(),
            obstacles: experiment.bodies().iter().map(|body| body.solid.name().to_string()).collect(),
            steps,
            simulated_seconds: simulation.time(),
            time_step: simulation.time() / steps.max(1) as f64,
            sound_speed: Some(simulation.parameters().sound_speed()).filter(|speed| *speed > 0.0),
            sound_speed_stated: simulation.parameters().states_sound_speed(),
            particles: watch.now.particles,
            particles_carved: watch.carved,
            particle_mass: simulation.parameters().particle_mass,
            // without the gaps of a packing
            spacing: (simulation.parameters().particle_mass / simulation.parameters().rest_density).cbrt(),
            rest_density: simulation.parameters().rest_density,
            milliseconds_per_step: watch.spent.as_secs_f64() * 1e3 / steps.max(1) as f64,
            neighbours_per_particle: watch.neighbours.0 / watch.neighbours.1 as f64,
            max_penetration: watch.worst.max_penetration,
            inside: watch.worst.inside,
            lost: watch.worst.lost,
            non_finite: watch.worst.non_finite,
            max_density_error: watch.worst.max_density_error,
            kinetic_energy: watch.now.kinetic_energy,
            potential_energy: watch.now.potential_energy,
            energy_at_start: watch.energy_at_start,
            energy_excess: audit.energy_excess(),
            energy_unjudged: audit.unjudged(),
            work_is_rough: audit.work_is_rough(),
            wall_work: audit.wall_work(),
            volume_change: audit.volume_change(),
            compression_mean: compression.mean,
            compression_p99: compression.p99,
            compression_max: compression.largest,
            crowded: audit.crowded(),
            max_speed: audit.max_speed(),
            findings: simulation
                .findings()
                .into_iter()
                .map(|(finding, _)| findings::code(finding).0)
                .collect(),
            pressure_error: deviation.pressure,
            velocity_error: deviation.velocity,
            front_error: deviation.front,
            probes,
            passes: pass_names(simulation),
            domain: [domain.min.to_array(), domain.max.to_array()],
            picture: Stated::of(&experiment.scene().picture),
            threads: rayon::current_num_threads(),
            frames,
            finished,
        }
    }
}

/// Prints the summary as text. The colours of pictures may have been `fitted` to end at a speed, m/s.
pub(super) fn print(summary: &Summary, (frames, fitted): (&Frames, Option<f64>), probes: &Probes) {
    say!(
        "{} {:.3e} m apart, {} of {:.3e} s = {} s simulated",
        counted(summary.particles, "particle"),
        summary.spacing,
        counted(summary.steps as usize, "step"),
        summary.time_step,
        significant(summary.simulated_seconds, 3)
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
        "energy: {} J at the start, {} J at the end; {}",
        readable(summary.energy_at_start),
        readable(summary.kinetic_energy + summary.potential_energy),
        match (summary.energy_excess, summary.wall_work, summary.energy_unjudged) {
            (Some(excess), Some(work), _) if work != 0.0 => {
                let known = if summary.work_is_rough { ", known to a tenth" } else { "" };
                format!(
                    "walls gave {} J{known}; at most {excess:.2e} of the greatest energy came from nowhere",
                    readable(work)
                )
            }
            (Some(excess), ..) => {
                let surface = if summary.passes.contains(&"surface tension") {
                    " and what the surface had at the start"
                } else {
                    ""
                };
                format!(
                    "never more than {excess:.2e} of the greatest energy above what gravity gave{surface}"
                )
            }
            (None, _, Some(why)) => format!("not judged: {why}"),
            (None, _, None) => "not judged".to_string(),
        }
    );
    say!(
        "compression by places: mean {:.2} %, one in a hundred above {:.1} %; volume {:+.2} %; at most {} m/s",
        100.0 * summary.compression_mean,
        100.0 * summary.compression_p99,
        100.0 * summary.volume_change,
        significant(summary.max_speed, 2)
    );
    let errors = [summary.pressure_error, summary.velocity_error, summary.front_error];
    for (what, error) in Deviation::NAMES.into_iter().zip(errors) {
        match error {
            Some(error) if error.is_finite() => {
                say!(
                    "{what}: {:.2} % from what is known (relative L2 over the saved instants)",
                    100.0 * error
                );
            }
            Some(_) => say!("{what}: what is known is zero all over, so no deviation is a part of it"),
            None => {}
        }
    }
    for means in &summary.probes {
        say!("{}", means.line());
    }
    let probes = match probes.count() {
        0 => String::new(),
        1 => ", 1 probe".to_string(),
        count => format!(", {count} probes"),
    };
    let folder = frames.folder().shown();
    say!("written to {folder}: {}{probes}", frames.describe());
    if let Some(end) = fitted {
        say!(
            "the pictures were drawn again with colours up to {end} m/s, which fit the fluid; \
             `picture {{ fastest: … }}` in the scene states where they end"
        );
    }
}

/// Names of the passes that a simulation runs.
pub(super) fn pass_names(simulation: &Simulation) -> Vec<&'static str> {
    simulation.passes().into_iter().map(Pass::name).collect()
}

/// A figure with two decimals, or with three digits where these would say nothing.
fn readable(figure: f64) -> String {
    match figure.abs() {
        0.0 | 0.1..1e6 => format!("{figure:.2}"),
        _ => format!("{figure:.2e}"),
    }
}
