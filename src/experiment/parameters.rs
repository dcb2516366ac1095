//! The parameters of a simulation from the numbers of a scene, and the length of its steps.

use glam::DVec3;

use super::{vector_field, velocities};
use crate::Program;
use crate::diagnostic::{Code, Diagnostic};
use crate::lower::{Gravity, Scene};
use crate::sph::Parameters;

/// The length of a simulation's steps, and where it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeStep {
    /// The length of a step, s. If steps follow the state, it is the longest.
    pub seconds: f64,
    /// Where the length comes from, in words.
    pub reason: &'static str,
}

/// A speed that the fluid can reach by its velocity at the start and a fall through the box, m/s.
pub(super) fn typical_speed(program: &Program, scene: &Scene) -> f64 {
    let gravity = at_start(program, &scene.gravity);
    let height = gravity.normalize_or_zero().abs().dot(scene.domain.size());
    let start = fastest(program, scene);
    (start * start + 2.0 * gravity.length() * height).sqrt()
}

/// All parameters except the time step, which is 1 s here. `mass` is that of a particle, kg.
pub(super) fn of_scene(program: &Program, scene: &Scene, mass: f64, typical_speed: f64) -> Parameters {
    let (fluid, method) = (&scene.fluid, scene.method.fluid());
    // a length that is stated for the usual particles grows with those of another size
    let (stated, derived) = ((fluid.mass / fluid.density).cbrt(), (mass / fluid.density).cbrt());
    let usual = method.support.radius(stated) * (derived / stated);
    Parameters {
        rest_density: fluid.density,
        particle_mass: mass,
        support_radius: fluid.support_radius.unwrap_or(usual),
        viscosity: fluid.viscosity,
        surface_tension: fluid.surface_tension,
        gravity: at_start(program, &scene.gravity),
        wall_restitution: scene.walls.restitution,
        wall_friction: scene.walls.friction,
        time_step: 1.0,
        adaptive: method.adaptive && scene.run.dt.is_none(),
        expected_speed: typical_speed,
        method: scene.method,
        slip: scene.slip,
        precision: scene.solver.precision.unwrap_or(method.precision),
    }
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

/// A time with two digits, as a file writes it.
fn time_as_written(seconds: f64) -> String {
    let rounded = |value: f64| format!("{value:.1e}").parse().unwrap_or(value);
    if (1e-6..0.1).contains(&seconds) {
        format!("{} ms", rounded(1e3 * seconds))
    } else {
        format!("{} s", rounded(seconds))
    }
}

/// The part of gravity that does not depend on the place, at t = 0, m/s².
fn at_start(program: &Program, gravity: &Gravity) -> DVec3 {
    match gravity {
        Gravity::Still(gravity) => *gravity,
        Gravity::Turning(nodes) => vector_field(program, nodes)(DVec3::ZERO, 0.0),
        Gravity::Field(_) => DVec3::ZERO,
    }
}

/// The greatest speed at the start, m/s, of the points of a grid over the box.
fn fastest(program: &Program, scene: &Scene) -> f64 {
    const SIDE: usize = 16;
    let velocities = velocities(program, &scene.fluid);
    let mut most: f64 = 0.0;
    for k in 0..SIDE.pow(3) {
        let part = DVec3::new((k % SIDE) as f64, (k / SIDE % SIDE) as f64, (k / SIDE / SIDE) as f64);
        let p = scene.domain.min + scene.domain.size() * part / (SIDE - 1) as f64;
        most = most.max(velocities(p, 0.0).length());
    }
    most
}
