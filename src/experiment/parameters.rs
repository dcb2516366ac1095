//! The parameters of a simulation from the numbers of a scene, and the length of its steps.

use glam::DVec3;

use super::{fall, vector_field, velocities};
use crate::diagnostic::{Code, Diagnostic};
use crate::ir::Node;
use crate::lower::{Gravity, Scene};
use crate::sph::{ClampedBy, Method, Parameters, Slip, VISCOSITY};
use crate::{Program, Solid};

/// The length of a simulation's steps, and where it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeStep {
    /// The length of a step, s. If steps follow the state, it is the longest.
    pub seconds: f64,
    /// Where the length comes from, in words.
    pub reason: &'static str,
}

/// Number of times of a run at which quantities are looked at that depend on time alone, and number for those
/// that depend on the place too.
const MANY_INSTANTS: usize = 256;
const SOME_INSTANTS: usize = 13;

/// The speed that the fluid can reach by a fall from rest, m/s. `stirs` says whether something moves that may lift it.
pub(super) fn speed_of_fall(program: &Program, scene: &Scene, shape: &Solid, stirs: bool) -> f64 {
    let size = scene.domain.size();
    let along = |gravity: DVec3| gravity.length() * gravity.normalize_or_zero().abs().dot(size);
    let fall = match &scene.gravity {
        Gravity::Still(gravity) => gravity.length() * fall::height(shape, &scene.domain, *gravity, stirs),
        Gravity::Turning(nodes) => {
            let gravity = vector_field(program, nodes);
            instants(scene, MANY_INSTANTS).map(|time| along(gravity(DVec3::ZERO, time))).fold(0.0, f64::max)
        }
        Gravity::Field(nodes) => most_in_fluid(program, scene, nodes, |gravity| gravity.abs().dot(size)),
    };
    (2.0 * fall).sqrt()
}

/// All parameters except the time step, which is 1 s here. `mass` is that of a particle, kg, and the speeds, m/s, are those
/// of [`Parameters::expected_speed`] and [`Parameters::driven_speed`].
pub(super) fn of_scene(
    program: &Program,
    scene: &Scene,
    mass: f64,
    (expected_speed, driven_speed): (f64, f64),
) -> Parameters {
    let (fluid, method) = (&scene.fluid, scene.method.fluid());
    Parameters {
        rest_density: fluid.density,
        particle_mass: mass,
        support_radius: support_radius(scene, mass),
        viscosity: fluid.viscosity,
        surface_tension: fluid.surface_tension,
        gravity: at_start(program, &scene.gravity),
        most_gravity: scene
            .gravity
            .formulas()
            .map_or(0.0, |nodes| most_in_fluid(program, scene, nodes, DVec3::length)),
        wall_restitution: scene.walls.restitution,
        wall_friction: scene.walls.friction,
        time_step: 1.0,
        adaptive: method.adaptive && scene.run.dt.is_none(),
        expected_speed,
        driven_speed,
        method: scene.method,
        slip: scene.slip,
        sticks: scene
            .container
            .iter()
            .map(|c| c.skin)
            .chain(scene.obstacles.iter().map(|o| o.skin))
            .any(|s| s.slip == Slip::No),
        // known once the particles are placed
        fills_vessel: false,
        is_sealed: false,
        packing: 1.0,
        precision: scene.solver.precision.unwrap_or(method.precision),
    }
}

/// The support radius, m, of particles with this mass, kg.
pub(super) fn support_radius(scene: &Scene, mass: f64) -> f64 {
    let fluid = &scene.fluid;
    // a length that is stated for the usual particles scales with the size of particles
    let (stated, derived) = ((fluid.mass / fluid.density).cbrt(), (mass / fluid.density).cbrt());
    let support = scene.method.support(fluid.surface_tension > 0.0);
    fluid.support_radius.unwrap_or(support.radius(stated) * (derived / stated))
}

/// Speed, rms, that a drop at rest keeps in a method that keeps its density, over √(σ/ρa) with the spacing a,
/// at an Ohnesorge number µ/√(ρσa) of [`STIRRED_AT`] and with kernels of three spacings: the most that was
/// measured, with 500 particles. With 2000 and 8000 it is 0.0023 and 0.0008 at numbers of 0.14 and 0.18 (0.05
/// by the radius, as with 500).
const STIRRED: f64 = 0.0075;
const STIRRED_AT: f64 = 0.1;

/// Exponent: the speed grows as the Ohnesorge number to the power of −0.7 (measured: 0.65 and 0.8 for numbers
/// from 0.1 to 0.01).
const CALMING: f64 = 0.7;

/// Upper limit of that speed, in units of √(σ/ρa).
const MOST_STIRRED: f64 = 0.05;

/// Shorter kernels see rougher normals: with 2.2 spacings the speed is 1.7 times as large with 500 particles,
/// and 3 times with 2000.
const SMOOTH_REACH: f64 = 3.0;

/// Runs with more steps get a warning: with a thousand particles they take half a day.
const MANY_STEPS: f64 = 1e8;

/// Stirring above this part of the expected speed gets a warning.
const MUCH_STIRRED: f64 = 0.05;

/// Slow sound gets a warning if it lets the density change by more than this, in per cent.
const MUCH_COMPRESSED: f64 = 5.0;

/// A warning if the surface tension stirs the fluid, which it does in methods that keep the density: the
/// force on a surface is no gradient of an energy, and only viscosity takes the energy that it gives.
pub(super) fn stirring(scene: &Scene, parameters: &Parameters) -> Option<Diagnostic> {
    let Parameters { surface_tension, viscosity, rest_density, expected_speed, support_radius, .. } =
        *parameters;
    let spacing = parameters.spacing();
    let ohnesorge = viscosity / (rest_density * surface_tension * spacing).sqrt();
    let rough = (SMOOTH_REACH * spacing / support_radius).max(1.0).powi(2);
    let share = (rough * STIRRED * (STIRRED_AT / ohnesorge).powf(CALMING)).min(MOST_STIRRED);
    let speed = share * (surface_tension / (rest_density * spacing)).sqrt();
    (parameters.keeps_density() && speed > MUCH_STIRRED * expected_speed).then(|| {
        let at = scene.fluid.tension_span.unwrap_or(scene.fluid.shape_span);
        let message = format!(
            "with this method the surface tension stirs a fluid of so little viscosity: particles of a drop at rest keep up to {speed:.1e} m/s, and up to sixteen times as much where it touches walls"
        );
        Diagnostic::warning(Code::TENSION_STIRS, at, message)
            .help("write `method: wcsph`, or give the fluid more viscosity, or smaller particles")
    })
}

/// A warning if a stated speed of sound is so low that the fluid is compressed like a gas: its density
/// changes by the square of the speed over that of sound.
pub(super) fn slow_sound(scene: &Scene, parameters: &Parameters) -> Option<Diagnostic> {
    let stated = parameters.stated_sound()?;
    let (sound, speed) = (stated.sound_speed, stated.driven_speed);
    let rounded = |value: f64| format!("{value:.1e}").parse().unwrap_or(value);
    let change = 100.0 * (speed / sound).powi(2);
    (change > MUCH_COMPRESSED).then(|| {
        let message = format!(
            "sound of {} m/s is slow for a fluid that may reach {} m/s: its density may change by {change:.0} %",
            rounded(sound),
            rounded(speed)
        );
        let at = scene.fluid.sound_span.unwrap_or(scene.fluid.shape_span);
        Diagnostic::warning(Code::SLOW_SOUND, at, message)
            .help(format!("leave `sound_speed` out, or write {} m/s or more", rounded(10.0 * speed)))
    })
}

/// A stated support radius gets a warning if it is more than so many times the one that the method would take: each
/// particle then has many times as many neighbours.
const WIDE_SUPPORT: f64 = 2.5;

/// A warning if a stated support radius makes neighbours of far more particles than the method needs.
pub(super) fn wide_support(scene: &Scene, parameters: &Parameters) -> Option<Diagnostic> {
    let at = scene.fluid.support_span?;
    let (stated, spacing) = (parameters.support_radius, parameters.spacing());
    let usual = scene.method.support(parameters.surface_tension > 0.0).radius(spacing);
    (stated > WIDE_SUPPORT * usual).then(|| {
        let rounded = |value: f64| format!("{value:.1e}").parse().unwrap_or(value);
        let message = format!(
            "`support_radius` is {} times the one that this method takes for particles {} m apart: sums over so many \
             neighbours smear the fluid out, and take long",
            rounded(stated / usual),
            rounded(spacing)
        );
        let help = format!("leave it out: here it would be {} m", rounded(usual));
        Diagnostic::warning(Code::ODD_QUANTITY, at, message).help(help)
    })
}

/// A warning if negative pressures are cut off in a fluid that fills its room, only because of another key.
pub(super) fn clamped(scene: &Scene, method: &Method, has_surface: &dyn Fn() -> bool) -> Option<Diagnostic> {
    let Method::Wcsph(wcsph) = method else { return None };
    let by = wcsph.clamped_by().filter(|_| !has_surface())?;
    let (key, others, help) = match by {
        ClampedBy::Pairs => ("gradients: pairs", "`negative_pressure` is clamp", "leave `gradients` out"),
        ClampedBy::NoShifting => (
            "shifting: 0",
            "`gradients` are pairs and `negative_pressure` is clamp",
            "leave `shifting` out, write `gradients: differences` beside it",
        ),
        ClampedBy::Both => {
            ("gradients: pairs", "`negative_pressure` is clamp", "leave `gradients` and `shifting` out")
        }
    };
    let message = format!(
        "the fluid fills all its room, and with `{key}` {others}: pressures below zero, as in half of a sound wave or behind a body, are cut off"
    );
    let help = format!("{help}, or state what is meant: `negative_pressure: clamp` or `keep`");
    Some(Diagnostic::warning(Code::CLAMPED, scene.fluid.shape_span, message).help(help))
}

/// The length of steps, and a warning if the scene states a longer one than is stable.
pub(super) fn time_step(scene: &Scene, parameters: &Parameters) -> (TimeStep, Option<Diagnostic>) {
    let (speed, save_every) = (parameters.expected_speed, scene.run.save_every);
    let stable = parameters.stable_dt(speed);
    match scene.run.dt {
        Some(dt) => {
            let too_long = (dt > stable).then(|| {
                let message = format!(
                    "the time step of {dt} s is longer than the {stable:.2e} s that are stable up to {speed:.1} m/s, \
                     the speed of a fall through the box"
                );
                let at = scene.run.dt_span.unwrap_or(scene.span);
                let help = format!("leave `dt` out, or write `dt: {}`", time_as_written(0.9 * stable));
                Diagnostic::warning(Code::LONG_STEP, at, message).help(help)
            });
            (TimeStep { seconds: dt, reason: "stated by the scene" }, too_long)
        }
        None if parameters.adaptive => {
            let reason = "adaptive: what sound, motion, forces and viscosity allow";
            (TimeStep { seconds: save_every, reason }, None)
        }
        None => {
            // fit a whole number of steps between frames
            let steps = (save_every / stable).ceil().max(1.0);
            let reason = "derived: stable for a fall through the box";
            (TimeStep { seconds: save_every / steps, reason }, None)
        }
    }
}

/// The refusal of a step that is longer than the whole run.
pub(super) fn longer_than_the_run(scene: &Scene, parameters: &Parameters) -> Option<Diagnostic> {
    let (until, speed) = (scene.run.until, parameters.expected_speed);
    let dt = scene.run.dt.filter(|dt| *dt > until)?;
    let stable = parameters.stable_dt(speed);
    let message = format!("a step of {dt} s is longer than the run of {until} s");
    let help = format!(
        "leave `dt` out, or write `dt: {}`: {} are stable up to the expected speed of {speed:.1} m/s",
        // rounding up must not make it longer than the run
        time_as_written(0.9 * stable.min(until)),
        time_as_written(stable)
    );
    let at = scene.run.dt_span.unwrap_or(scene.span);
    Some(Diagnostic::error(Code::OUT_OF_RANGE, at, message).help(help))
}

/// A warning if the run has too many steps to finish in reasonable time.
pub(super) fn many_steps(scene: &Scene, parameters: &Parameters) -> Option<Diagnostic> {
    let (shortest, cause) = parameters.shortest_step(parameters.expected_speed);
    let (step, cause, at) = match scene.run.dt {
        Some(dt) => (dt, "`dt`", scene.run.dt_span.unwrap_or(scene.span)),
        None if cause == VISCOSITY => (shortest, cause, scene.fluid.viscosity_span.unwrap_or(scene.span)),
        None => (shortest, cause, scene.span),
    };
    // steps end at frames
    let (step, cause) =
        if scene.run.save_every < step { (scene.run.save_every, "`save_every`") } else { (step, cause) };
    let steps = scene.run.until / step;
    (steps >= MANY_STEPS).then(|| {
        let of = match cause == VISCOSITY {
            true => {
                let viscosity = scene.fluid.viscosity;
                let shown = if viscosity < 1e6 { viscosity.to_string() } else { format!("{viscosity:e}") };
                format!(" of {shown} Pa·s at a density of {} kg/m³", scene.fluid.density)
            }
            false => String::new(),
        };
        let message =
            format!("the run takes about {steps:.0e} steps of {step:.1e} s, which {cause}{of} asks for");
        Diagnostic::warning(Code::MANY_STEPS, at, message).help(
            "`rfm run --dry-run` tells how long that is; look for a number in another unit than was meant",
        )
    })
}

/// A time with two digits, as a file writes it.
fn time_as_written(seconds: f64) -> String {
    let rounded = |value: f64| format!("{value:.1e}").parse().unwrap_or(value);
    if (1e-6..0.1).contains(&seconds) {
        format!("{} ms", rounded(1e3 * seconds))
    } else {
        format!("{} s", rounded(seconds))
    }
}

/// A warning if the fluid is to stick to walls that, with this method, only turn particles back.
pub(super) fn without_friction(scene: &Scene, parameters: &Parameters) -> Option<Diagnostic> {
    (parameters.sticks || parameters.slip == Slip::No).then_some(())?;
    if parameters.walls_have_density() {
        return None;
    }
    let method = parameters.method.name();
    let message = format!(
        "`no_slip` has no effect with `method: {method}`: its walls turn particles back, and rub on nothing"
    );
    let help = "state a `friction` of walls, with which particles that hit them lose speed, or choose another method";
    Some(Diagnostic::warning(Code::NO_FRICTION, scene.span, message).help(help))
}

/// The part of gravity that does not depend on the place, at t = 0, m/s².
fn at_start(program: &Program, gravity: &Gravity) -> DVec3 {
    match gravity {
        Gravity::Still(gravity) => *gravity,
        Gravity::Turning(nodes) => vector_field(program, nodes)(DVec3::ZERO, 0.0),
        Gravity::Field(_) => DVec3::ZERO,
    }
}

/// Times of a run, s, at which quantities that depend on time are looked at: its start, its end, and times
/// between them that are no multiples of a period of an oscillation.
fn instants(scene: &Scene, number: usize) -> impl Iterator<Item = f64> + use<'_> {
    let between = (0..number).map(move |k| (k as f64 + 0.618) / number as f64);
    between.chain([0.0, 1.0]).map(|part| part * scene.run.until)
}

/// The greatest speed at the start, m/s, of the points of a grid over the box.
pub(super) fn fastest(program: &Program, scene: &Scene) -> f64 {
    let velocities = velocities(program, &scene.fluid);
    most(scene, |p| velocities(p, 0.0).length())
}

/// The greatest value at the points of a grid over the box; at least 0.
fn most(scene: &Scene, value: impl Fn(DVec3) -> f64) -> f64 {
    const SIDE: usize = 16;
    let at = |k: usize| {
        let part = DVec3::new((k % SIDE) as f64, (k / SIDE % SIDE) as f64, (k / SIDE / SIDE) as f64);
        scene.domain.min + scene.domain.size() * part / (SIDE - 1) as f64
    };
    (0..SIDE.pow(3)).map(|k| value(at(k))).filter(|v| v.is_finite()).fold(0.0, f64::max)
}

/// The greatest size of a vector where the fluid is at the start, at some instants of the run; at least 0.
/// Formulas may have poles elsewhere.
fn most_in_fluid(program: &Program, scene: &Scene, nodes: &[Node; 3], size: impl Fn(DVec3) -> f64) -> f64 {
    let (fluid, vector) = (vector_field(program, &[scene.fluid.shape; 3]), vector_field(program, nodes));
    let inside = |p: DVec3, time: f64| if fluid(p, 0.0).x > 0.0 { size(vector(p, time)) } else { 0.0 };
    let at = |time: f64| most(scene, |p| inside(p, time));
    instants(scene, SOME_INSTANTS).map(at).fold(0.0, f64::max)
}

/// A speed that the fluid reaches where it neither falls nor moves at the start: that of its known solution,
/// of surfaces that take it along, or of a fall through the box under a force that depends on the place. 1
/// m/s if nothing is known.
pub(super) fn driven_speed(program: &Program, scene: &Scene) -> f64 {
    let fastest = |nodes: &[Node; 3]| most_in_fluid(program, scene, nodes, DVec3::length);
    let container = scene.container.iter().map(|c| c.skin);
    let skins = container.chain(scene.obstacles.iter().map(|o| o.skin));
    let stated = scene.truth.iter().filter_map(|truth| truth.velocity);
    let stated = stated.chain(skins.filter_map(|skin| skin.velocity)).map(|nodes| fastest(&nodes));
    let force = scene.gravity.formulas().map_or(0.0, &fastest);
    let fall = (2.0 * force * scene.domain.size().max_element()).sqrt();
    match stated.fold(0.0, f64::max) {
        speed if speed > 0.0 => speed,
        _ if fall > 0.0 => fall,
        _ => 1.0,
    }
}
