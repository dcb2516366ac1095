//! From a scene of the language to a simulation: obstacles are compiled, parameters checked, particles
//! placed, and those removed that an obstacle leaves no room for.
//!
//! ```no_run
//! let program = rfm::Program::from_path("examples/pawn.rfm")?;
//! let experiment = rfm::Experiment::new(&program, "drop", rfm::Engine::Auto)?;
//! let mut simulation = experiment.start()?.simulation;
//! simulation.step().unwrap();
//! # Ok::<(), rfm::Error>(())
//! ```
//!
//! An [`Experiment`] owns all that it needs, and so does a [`Simulation`]: both may be sent to another
//! thread. [`Deviations`] compares the flow with the solution that the scene states.

mod bodies;
mod chamber;
mod deviation;
mod drag;
mod dry;
mod every;
mod fall;
mod filling;
mod fingerprint;
mod free_surface;
mod layers;
mod mean;
mod misfits;
mod out_of_reach;
mod parameters;
mod probes;
mod rigid_parts;
mod room;
mod switched;
mod wall_speed;
mod weight;

use std::sync::Arc;

use glam::DVec3;

use crate::compile::Error;
use crate::diagnostic::{Code, Diagnostic, Diagnostics};
use crate::geom::Aabb;
use crate::ir::{Given, Interpreter, Node};
use crate::lower::{Fluid, Gravity, Scene};
use crate::sph::{
    Checkpoint, Obstacle, ParameterError, Parameters, Particles, SetupError, Simulation, VectorField,
};
use crate::{Engine, Program, Solid};
use weight::put_under_pressure;

pub use bodies::Body;
pub use deviation::{Deviation, Deviations};
pub use every::Every;
pub use filling::spacing;
pub use fingerprint::SceneMark;
pub use mean::Mean;
pub use misfits::{MOST_OBSTACLES, out_of_reach, too_fine, wall_limit};
pub use out_of_reach::is_out_of_reach;
pub use parameters::TimeStep;
pub use probes::probe_column;
pub use room::{Taken, outside_the_container, taken_by_obstacles};

/// A scene, compiled and checked: all that a simulation needs besides its particles.
pub struct Experiment {
    program: Program,
    scene: Scene,
    parameters: Parameters,
    /// A speed that the fluid may reach, m/s, without that of pressures alone.
    seen_speed: f64,
    time_step: TimeStep,
    bodies: Vec<Body>,
    fluid: Solid,
    warnings: Vec<Diagnostic>,
}

/// A simulation at its start, as [`Experiment::start`] returns it.
pub struct Start {
    /// The simulation. It has taken no step yet.
    pub simulation: Simulation,
    /// Number of particles that were removed because they lay in an obstacle, too close to one, or outside
    /// the box.
    pub carved: usize,
    /// Warnings about the start. They do not prevent a run.
    pub warnings: Diagnostics,
}

impl Experiment {
    /// Compiles the solids of a scene and derives the parameters of its method.
    ///
    /// # Errors
    /// [`Error::UnknownName`] if the file has no scene of this name, [`Error::Codegen`] if the engine is not
    /// available, [`Error::Diagnostics`] if the fluid's parameters do not fit together.
    pub fn new(program: &Program, scene: &str, engine: Engine) -> Result<Self, Error> {
        Self::of_scene(program.clone(), program.scene(scene)?.clone(), engine)
    }

    /// A scene without its obstacles, and without what is measured at them. It shows quickly whether a fluid among very
    /// many obstacles has room.
    ///
    /// # Errors
    /// Those of [`Experiment::new`].
    pub fn without_obstacles(program: &Program, scene: &str, engine: Engine) -> Result<Self, Error> {
        let scene = program.scene(scene)?.clone();
        let scene = Scene { obstacles: Vec::new(), probes: Vec::new(), ..scene };
        Self::of_scene(program.clone(), scene, engine)
    }

    fn of_scene(program: Program, scene: Scene, engine: Engine) -> Result<Self, Error> {
        let fluid = program.compile(&scene.fluid.name, scene.fluid.shape, engine)?;
        let parts = bodies::compile(&program, &scene, engine)?;
        let by_walls = bodies::greatest_speed(&program, &scene, &parts);
        let stirs = by_walls.by_motion > 0.0 || parts.iter().any(|part| part.whole.moves());
        let by_fall = parameters::speed_of_fall(&program, &scene, &fluid, stirs);
        let seen_speed = by_fall.hypot(parameters::fastest(&program, &scene)).max(by_walls.by_motion);
        let typical_speed = seen_speed.max(by_walls.by_pressure);
        let driven_speed = by_fall.max(by_walls.by_motion).max(by_walls.by_pressure);
        let mass = filling::mass_by_number(&scene, &fluid).unwrap_or(scene.fluid.mass);
        let mut parameters = parameters::of_scene(&program, &scene, mass, (typical_speed, driven_speed));
        let mut method = scene.method;
        let wholes = || parts.iter().map(|part| &part.whole);
        let has_surface = || free_surface::has_surface(&scene, &fluid, wholes(), parameters.spacing());
        method.settle(&has_surface);
        let clamped = parameters::clamped(&scene, &method, &has_surface);
        let scene = Scene { method, ..scene };
        parameters.method = method;
        parameters.support_radius = parameters::support_radius(&scene, mass);
        if let Some(refusal) = parameters::longer_than_the_run(&scene, &parameters) {
            return Err(refuse(&program, refusal));
        }
        let (time_step, too_long) = parameters::time_step(&scene, &parameters);
        parameters.time_step = time_step.seconds;
        let (h, spacing) = (parameters.support_radius, parameters.spacing());
        if scene.fluid.support_radius.is_some() && h < spacing {
            return Err(refuse(&program, too_small_a_support(&scene, h, spacing)));
        }
        parameters.validate().map_err(|error| refuse(&program, unfit(&scene, typical_speed, &error)))?;
        let bodies = bodies::of_parts(&program, &scene, &parameters, engine, parts)?;
        for body in &bodies {
            if let Some(Err(refusal)) = program.within_tolerance(&body.solid) {
                return Err(refuse(&program, *refusal));
            }
        }
        let warnings = clamped.into_iter().chain(too_long).chain(parameters::stirring(&scene, &parameters));
        let warnings = warnings.chain(parameters::slow_sound(&scene, &parameters));
        let warnings = warnings.chain(parameters::wide_support(&scene, &parameters));
        let warnings = warnings.chain(parameters::many_steps(&scene, &parameters));
        let warnings = warnings.chain(parameters::without_friction(&scene, &parameters));
        let warnings = warnings.chain(drag::warnings(&scene, &parameters, &bodies));
        let warnings = warnings.chain(probes::in_bodies(&scene, &bodies, parameters.spacing())).collect();
        Ok(Self { program, scene, parameters, seen_speed, time_step, bodies, fluid, warnings })
    }

    /// The program that the scene belongs to.
    pub fn program(&self) -> &Program {
        &self.program
    }

    /// The scene, as the file states it, with what its method derives from whether the fluid has a free surface.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The box of the scene, m.
    pub fn domain(&self) -> Aabb {
        self.scene.domain
    }

    /// Parameters of the fluid and of its method, in SI units.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The length of steps, and the reason for it.
    pub fn time_step(&self) -> TimeStep {
        self.time_step
    }

    /// A speed that the fluid can reach, m/s: the larger of two speeds, the one from its velocity at the
    /// start and a fall through the box, and the one of walls that move.
    pub fn typical_speed(&self) -> f64 {
        self.parameters.expected_speed
    }

    /// The greatest speed that the fluid has at its start, m/s.
    pub fn start_speed(&self) -> f64 {
        parameters::fastest(&self.program, &self.scene)
    }

    /// The outside of the container, if the scene has one, and the obstacles.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// A speed that the fluid may reach, m/s, for the scale of pictures: that of its start, of a fall through the box
    /// and of walls, or if they are 0, the speed that other causes give the fluid. Always positive.
    pub fn speed_scale(&self) -> f64 {
        match self.seen_speed {
            speed if speed > 0.0 => speed,
            _ => parameters::driven_speed(&self.program, &self.scene),
        }
    }

    /// The shape of the fluid at the start.
    pub fn fluid(&self) -> &Solid {
        &self.fluid
    }

    /// Warnings about the scene. They do not prevent a run.
    pub fn warnings(&self) -> Diagnostics {
        self.diagnostics(self.warnings.clone())
    }

    /// Starts a simulation: places the particles, and finds the densities and forces of the first instant.
    ///
    /// # Errors
    /// [`Error::Diagnostics`] if the fluid has no room.
    pub fn start(&self) -> Result<Start, Error> {
        let fluid = &self.scene.fluid;
        let obstacles = self.obstacles();
        let mut filling = self.fill(&obstacles)?;
        let carving = self.carving(&filling);
        let dry = self.dry_walls(&filling.particles);
        let mut particles = std::mem::take(&mut filling.particles);
        self.set_in_motion(&mut particles);
        let filling::Filling { carved, mass, fills_vessel, .. } = filling;
        let parameters = Parameters {
            particle_mass: mass,
            fills_vessel,
            is_sealed: fills_vessel,
            ..self.parameters.clone()
        };
        let field = match &self.scene.gravity {
            Gravity::Field(nodes) => Some(vector_field(&self.program, nodes)),
            Gravity::Still(_) | Gravity::Turning(_) => None,
        };
        put_under_pressure(&parameters, field.as_deref(), &mut particles);
        let simulation = Simulation::new(parameters, particles, self.scene.domain, obstacles);
        let mut simulation = simulation.map_err(|e| {
            let no_room = Diagnostic::error(Code::SCENE_NO_ROOM, fluid.shape_span, e.to_string());
            refuse(&self.program, no_room)
        })?;
        self.set_gravity(&mut simulation);
        let outside = self.reach().ok().and_then(|bounds| self.outside(&bounds));
        let warnings = self.diagnostics(outside.into_iter().chain(carving).chain(dry).collect());
        let carved = carved.inside + carved.too_close + carved.outside_box;
        Ok(Start { simulation, carved, warnings })
    }

    /// Starts a simulation at a checkpoint.
    ///
    /// # Errors
    /// [`SetupError`] if the checkpoint does not fit the scene.
    pub fn resume(&self, checkpoint: &Checkpoint) -> Result<Simulation, SetupError> {
        let obstacles = self.obstacles();
        let mut simulation =
            Simulation::resume(self.parameters.clone(), checkpoint, self.scene.domain, obstacles)?;
        self.set_gravity(&mut simulation);
        Ok(simulation)
    }

    fn obstacles(&self) -> Vec<Obstacle> {
        self.bodies.iter().map(|body| body.obstacle.clone()).collect()
    }

    /// Sets a gravity that depends on the time or on the place. A constant gravity is a parameter.
    fn set_gravity(&self, simulation: &mut Simulation) {
        match &self.scene.gravity {
            Gravity::Still(_) => {}
            Gravity::Turning(nodes) => {
                let formulas = vector_field(&self.program, nodes);
                simulation.set_turning_gravity(Arc::new(move |time| formulas(DVec3::ZERO, time)));
            }
            Gravity::Field(nodes) => simulation.set_gravity_field(vector_field(&self.program, nodes)),
        }
    }

    /// Gives each particle its velocity at the start, by the formulas of the scene.
    fn set_in_motion(&self, particles: &mut Particles) {
        let velocities = velocities(&self.program, &self.scene.fluid);
        for i in 0..particles.len() {
            particles.velocity.set(i, velocities(particles.position.get(i), 0.0));
        }
    }

    fn diagnostics(&self, list: Vec<Diagnostic>) -> Diagnostics {
        Diagnostics { list, sources: self.program.sources().clone() }
    }
}

/// The velocity of the fluid at the start, m/s, as a function of the place.
fn velocities(program: &Program, fluid: &Fluid) -> Arc<VectorField> {
    vector_field(program, &fluid.velocity)
}

/// Formulas of the place and of t as a function.
fn vector_field(program: &Program, nodes: &[Node; 3]) -> Arc<VectorField> {
    let formulas = Interpreter::new(&program.module().graph, nodes);
    Arc::new(move |p, time| {
        let mut vector = [0.0; 3];
        formulas.eval_given(Given { time, ..Given::point(p.to_array()) }, &mut vector);
        DVec3::from_array(vector)
    })
}

/// Says why the figures of a fluid do not fit together, or which one is missing.
fn unfit(scene: &Scene, typical_speed: f64, error: &ParameterError) -> Diagnostic {
    if error.name == "sound_speed" && typical_speed == 0.0 {
        // it has no default where nothing moves; one that is stated was checked when the scene was read
        let message = "`sound_speed` is missing: it follows from how fast the fluid falls or is moved, and here nothing moves";
        let help = "state `sound_speed` in this block, ten times the greatest speed to come";
        return Diagnostic::error(Code::SCENE_MISSING, scene.fluid.span, message).help(help);
    }
    let message = format!("the fluid's figures do not fit together: {error}");
    Diagnostic::error(Code::OUT_OF_RANGE, scene.fluid.shape_span, message)
}

/// The message for kernels that do not reach from particle to particle.
fn too_small_a_support(scene: &Scene, h: f64, spacing: f64) -> Diagnostic {
    let message = format!(
        "`support_radius` is {h:.2e} m, and particles are {spacing:.2e} m apart: none has a neighbour"
    );
    let usual = scene.method.support(scene.fluid.surface_tension > 0.0).radius(spacing);
    Diagnostic::error(Code::OUT_OF_RANGE, scene.fluid.support_span.unwrap_or(scene.fluid.span), message)
        .help(format!("leave it out: here it would be {usual:.2e} m"))
}

fn refuse(program: &Program, diagnostic: Diagnostic) -> Error {
    Error::Diagnostics(Diagnostics { list: vec![diagnostic], sources: program.sources().clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_experiment_and_what_it_starts_may_be_sent_to_a_thread() {
        fn is_owned<T: Send + Sync + 'static>() {}
        is_owned::<Experiment>();
        is_owned::<Simulation>();
        is_owned::<Deviations>();
    }
}
