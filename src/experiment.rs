//! A scene of the language → a simulation: obstacles compiled, parameters checked, particles put and carved.
//!
//! ```no_run
//! let program = rfm::Program::from_path("examples/pawn.rfm")?;
//! let scene = &program.module().scenes[0];
//! let experiment = rfm::Experiment::of(&program, scene, rfm::Engine::Auto)?;
//! let (mut simulation, _carved) = experiment.simulation(&program, scene)?;
//! simulation.step().unwrap();
//! # Ok::<(), rfm::Error>(())
//! ```

mod deviation;

use std::cell::RefCell;
use std::ops::ControlFlow;

use glam::DVec3;

use crate::compile::Error;
use crate::diagnostic::{Code, Diagnostic, Diagnostics, Span};
use crate::field::{Moving, Walls};
use crate::geom::Aabb;
use crate::ir::{Given, Interpreter, Node};
use crate::lower::{Fill, Fluid, Gravity, Method, Scene, Skin, Slip};
use crate::solid::{Bounds, MovingMap};
use crate::sph::{
    self, Checkpoint, FluidBlock, FluidShape, Gradients, NegativePressure, Obstacle, Parameters, Particles,
    SeedError, SetupError, Simulation, StepError, VectorField, carve, make_room,
};
use crate::{Engine, Precision, Program, Solid};

pub use deviation::{Deviation, Deviations};

/// Particles start at least this part of the spacing away from an obstacle.
const CLEARANCE: f64 = 0.5;

/// Obstacles of which no range is known would be sampled in steps of this part of the support radius; compiled ones
/// are swept.
const PATH_RESOLUTION: f64 = 0.05;

/// A solid in the fluid's way.
pub struct Body {
    /// As it is at the start.
    pub solid: Solid,
    /// What answers for it in the box.
    field: Box<dyn Walls>,
    moving: Option<Box<dyn Moving>>,
    /// What it does to a particle, and to the fluid that moves along it.
    pub skin: Skin,
    surface_velocity: Option<Box<VectorField>>,
}

/// A window of time in which the map of a moving solid stays, in steps.
const WINDOW: f64 = 16.0;

/// What a scene needs besides its particles.
pub struct Experiment {
    /// The box.
    pub domain: Aabb,
    /// Of the fluid and the method.
    pub parameters: Parameters,
    /// Gravity that depends on the place.
    gravity_field: Option<Box<VectorField>>,
    /// The container's outside, if the scene has one, and the obstacles.
    pub obstacles: Vec<Body>,
    fluid: Solid,
    /// Why steps are as long as they are.
    pub time_step_reason: &'static str,
    /// A speed that the scene can reach by gravity, for the colours of pictures.
    pub typical_speed: f64,
    warnings: RefCell<Vec<Diagnostic>>,
}

impl Experiment {
    /// Compiles a scene's solids and derives the numbers of its method.
    ///
    /// # Errors
    /// If the engine is not to be had, or the fluid's figures do not fit together.
    pub fn of(program: &Program, scene: &Scene, engine: Engine) -> Result<Self, Error> {
        let compile = |name: &str, node| program.compile(name, node, engine);
        let warnings: RefCell<Vec<Diagnostic>> = RefCell::default();
        let fluid = compile(&scene.fluid.name, scene.fluid.shape)?;
        let (mut obstacles, mut moved) = (Vec::new(), Vec::new());
        let reach = match scene.method {
            Method::Paper => 0.0,
            _ => scene.fluid.support_radius,
        };
        let container = scene.container.as_ref().map(|c| (&c.name, c.outside, c.skin));
        for (name, shape, skin) in
            container.into_iter().chain(scene.obstacles.iter().map(|o| (&o.name, o.shape, o.skin)))
        {
            let whole = compile(name, shape)?;
            let solid = whole.at(0.0);
            let field: Box<dyn Walls> = if reach > 0.0 {
                solid.walls(scene.domain, reach)
            } else if solid.has_many_leaves() {
                // ω itself for a few leaves; for many, only those that matter where a particle is
                solid.surface(scene.domain)
            } else {
                Box::new(solid.clone())
            };
            moved.push(whole);
            let surface_velocity = skin.velocity.map(|nodes| vector_field(program, &nodes));
            obstacles.push(Body { solid, field, moving: None, skin, surface_velocity });
        }
        let (gravity, gravity_field) = match scene.gravity {
            Gravity::Still(gravity) => (gravity, None),
            Gravity::Turning(nodes) => (at_time(program, &nodes, 0.0), None),
            Gravity::Field(nodes) => (DVec3::ZERO, Some(vector_field(program, &nodes))),
        };
        let height = gravity.normalize_or_zero().abs().dot(scene.domain.size());
        let start = fastest(program, scene);
        let typical_speed = (start * start + 2.0 * gravity.length() * height).sqrt();
        let mut parameters = Parameters {
            rest_density: scene.fluid.density,
            particle_mass: scene.fluid.mass,
            support_radius: scene.fluid.support_radius,
            stiffness: scene.fluid.stiffness,
            negative_pressure: if scene.fluid.negative_pressure {
                NegativePressure::Keep
            } else {
                NegativePressure::Clamp
            },
            viscosity: scene.fluid.viscosity,
            surface_tension: scene.fluid.surface_tension,
            surface_threshold: scene.fluid.threshold,
            gravity,
            wall_restitution: scene.walls.restitution,
            wall_friction: scene.walls.friction,
            time_step: 1.0,
            adaptive: scene.method != Method::Paper && scene.run.dt.is_none(),
            method: method(scene, typical_speed),
            slip: slip(scene.slip),
            precision: match (scene.solver.precision, scene.method) {
                (Some(Precision::F64), _) | (None, Method::Paper) => Precision::F64,
                _ => Precision::F32,
            },
        };
        let stable = parameters.stable_dt(typical_speed);
        let time_step_reason = match scene.run.dt {
            Some(dt) => {
                parameters.time_step = dt;
                if dt > stable {
                    let message = format!(
                        "the time step of {dt} s is longer than the {stable:.2e} s that are stable up to \
                         {typical_speed:.1} m/s, the speed of a fall through the box"
                    );
                    let long = Diagnostic::warning(Code::LONG_STEP, scene.span, message);
                    warnings.borrow_mut().push(long);
                }
                "stated by the scene"
            }
            None if parameters.adaptive => {
                parameters.time_step = scene.run.save_every;
                "adaptive: what sound, motion, forces and viscosity allow"
            }
            None => {
                // a whole number of steps between frames
                let steps = (scene.run.save_every / stable).ceil().max(1.0);
                parameters.time_step = scene.run.save_every / steps;
                "derived: stable for a fall through the box"
            }
        };
        for (body, solid) in obstacles.iter_mut().zip(&moved) {
            if solid.moves() {
                let run = (0.0, scene.run.until);
                let reach = parameters.support_radius;
                let window = WINDOW * parameters.stable_dt(typical_speed).min(parameters.time_step);
                body.moving = Some(match MovingMap::new(solid, scene.domain, reach, run, window) {
                    Some(map) => Box::new(map),
                    None => Box::new(solid.clone()),
                });
            }
        }
        parameters.validate().map_err(|error| {
            let message = format!("the fluid's figures do not fit together: {error}");
            refuse(program, Diagnostic::error(Code::OUT_OF_RANGE, scene.fluid.shape_span, message))
        })?;
        Ok(Self {
            domain: scene.domain,
            parameters,
            gravity_field,
            obstacles,
            fluid,
            time_step_reason,
            typical_speed,
            warnings,
        })
    }

    /// What a person should know of the scene and does not keep it from being run; each is told once.
    pub fn take_warnings(&self) -> Vec<Diagnostic> {
        self.warnings.take()
    }

    /// The simulation at its start, and how many particles were carved off.
    ///
    /// # Errors
    /// If the fluid has no room.
    pub fn simulation(&self, program: &Program, scene: &Scene) -> Result<(Simulation<'_>, usize), Error> {
        let fluid = &scene.fluid;
        let bounds = match self.fluid.bounds() {
            Bounds::Within(bounds) => *bounds,
            Bounds::Unbounded => self.domain,
            Bounds::Empty => {
                let message = "the shape of the fluid is empty";
                return Err(refuse(
                    program,
                    Diagnostic::error(Code::SCENE_NO_ROOM, fluid.shape_span, message),
                ));
            }
        };
        let fill = match fluid.fill {
            Fill::Below => sph::Fill::Below,
            Fill::Middle => sph::Fill::Middle,
        };
        let block = FluidBlock {
            shape: FluidShape::Field { field: &self.fluid, bounds, fill },
            count: fluid.particles,
            allow_fewer: false,
            velocity: DVec3::ZERO,
            jitter: fluid.jitter,
            seed: fluid.seed,
        };
        let span = fluid.particles_span.unwrap_or(fluid.shape_span);
        let mut particles =
            block.seed(&self.parameters, self.domain).map_err(|e| no_fluid(program, &e, span))?;
        set_in_motion(program, fluid, &mut particles);
        let obstacles: Vec<Obstacle<'_>> = self.obstacles.iter().map(|body| self.obstacle(body)).collect();
        let carved = self.carve(program, scene, &mut particles, &obstacles)?;
        if fluid.hydrostatic {
            self.put_under_pressure(&mut particles);
        }
        let simulation = Simulation::new(self.parameters.clone(), particles, self.domain, obstacles);
        let mut simulation = simulation.map_err(|e| {
            refuse(program, Diagnostic::error(Code::SCENE_NO_ROOM, fluid.shape_span, e.to_string()))
        })?;
        if let Some(field) = &self.gravity_field {
            simulation.set_gravity_field(field);
        }
        Ok((simulation, carved))
    }

    /// The simulation at a checkpoint.
    ///
    /// # Errors
    /// If the checkpoint does not fit the scene.
    pub fn resume(&self, checkpoint: &Checkpoint) -> Result<Simulation<'_>, SetupError> {
        let obstacles = self.obstacles.iter().map(|body| self.obstacle(body)).collect();
        let mut simulation = Simulation::resume(self.parameters.clone(), checkpoint, self.domain, obstacles)?;
        if let Some(field) = &self.gravity_field {
            simulation.set_gravity_field(field);
        }
        Ok(simulation)
    }

    fn obstacle<'a>(&self, body: &'a Body) -> Obstacle<'a> {
        Obstacle {
            field: &*body.field,
            moving: body.moving.as_deref(),
            restitution: body.skin.bounce.restitution,
            friction: body.skin.bounce.friction,
            slip: slip(body.skin.slip),
            surface_velocity: body.surface_velocity.as_deref(),
            resolution: PATH_RESOLUTION * self.parameters.support_radius,
        }
    }

    /// One step of at most `longest` seconds, under the gravity of its beginning.
    ///
    /// # Errors
    /// Those of a step.
    pub fn step(
        &self,
        program: &Program,
        scene: &Scene,
        simulation: &mut Simulation<'_>,
        longest: f64,
    ) -> Result<(), StepError> {
        if let Gravity::Turning(nodes) = &scene.gravity {
            simulation.set_gravity(at_time(program, nodes, simulation.time()));
        }
        simulation.step_at_most(longest)
    }

    /// Steps until a time, s, at which the last step ends; `after_step` sees each state on the way, and may end it.
    ///
    /// # Errors
    /// Those of a step.
    pub fn advance(
        &self,
        program: &Program,
        scene: &Scene,
        simulation: &mut Simulation<'_>,
        end: f64,
        mut after_step: impl FnMut(&Simulation<'_>) -> ControlFlow<()>,
    ) -> Result<(), StepError> {
        while simulation.time() < end * (1.0 - 1e-12) {
            self.step(program, scene, simulation, end - simulation.time())?;
            if after_step(simulation).is_break() {
                break;
            }
        }
        Ok(())
    }

    fn carve(
        &self,
        program: &Program,
        scene: &Scene,
        particles: &mut Particles,
        obstacles: &[Obstacle<'_>],
    ) -> Result<usize, Error> {
        let span = scene.fluid.shape_span;
        let mut clearance = CLEARANCE * self.parameters.spacing();
        if let sph::Method::Wcsph(_) = self.parameters.method {
            // its density does not follow from where particles are: those too near may move, and only what finds no
            // place goes. (dfsph would bear the volume, but bursts from the pairs that come too close.)
            make_room(particles, &self.domain, obstacles, clearance);
            clearance *= 0.5;
        }
        let carved =
            carve(particles, &self.domain, obstacles, clearance).map_err(|e| no_fluid(program, &e, span))?;
        let lost = carved.inside + carved.too_close + carved.outside_box;
        if lost > 0 {
            let message = format!(
                "{lost} of the fluid's particles were carved off: {} in an obstacle, {} too close to one, {} \
                 outside the box; {} are left",
                carved.inside, carved.too_close, carved.outside_box, carved.kept
            );
            self.warnings.borrow_mut().push(Diagnostic::warning(Code::FLUID_IN_OBSTACLE, span, message));
        }
        Ok(lost)
    }
}

impl Experiment {
    /// The densities of a fluid at rest under its own weight, its surface half a spacing above the highest particle.
    fn put_under_pressure(&self, particles: &mut Particles) {
        let p = &self.parameters;
        let up = -p.gravity.normalize_or_zero();
        let height = |at: DVec3| up.dot(at);
        let top = particles.position.iter().map(height).fold(f64::NEG_INFINITY, f64::max) + 0.5 * p.spacing();
        let pressure = |at: DVec3| p.rest_density * p.gravity.length() * (top - height(at));
        particles.density = particles.position.iter().map(|at| p.density_under(pressure(at))).collect();
    }
}

fn slip(slip: Slip) -> sph::Slip {
    match slip {
        Slip::Free => sph::Slip::Free,
        Slip::No => sph::Slip::No,
    }
}

/// Formulas of t alone.
fn at_time(program: &Program, nodes: &[Node; 3], time: f64) -> DVec3 {
    vector_field(program, nodes)(DVec3::ZERO, time)
}

/// Formulas of the place and of t.
fn vector_field(program: &Program, nodes: &[Node; 3]) -> Box<VectorField> {
    let formulas = Interpreter::new(&program.module().graph, nodes);
    Box::new(move |p, time| {
        let mut vector = [0.0; 3];
        formulas.eval_given(Given { time, ..Given::point(p.to_array()) }, &mut vector);
        DVec3::from_array(vector)
    })
}

/// The method of a scene with its numbers.
fn method(scene: &Scene, typical_speed: f64) -> sph::Method {
    match scene.method {
        Method::Paper => sph::Method::Paper,
        Method::Wcsph => sph::Method::Wcsph(sph::Wcsph {
            sound_speed: scene.fluid.sound_speed.unwrap_or(10.0 * typical_speed),
            density_diffusion: scene.fluid.density_diffusion,
            artificial_viscosity: scene.fluid.artificial_viscosity,
            gradients: if scene.fluid.differences { Gradients::Differences } else { Gradients::Pairs },
            shifting: scene.fluid.shifting,
        }),
        Method::Dfsph => sph::Method::Dfsph(sph::Dfsph {
            tolerance: scene.solver.compression,
            most_iterations: scene.solver.iterations as u32,
            shifting: scene.fluid.shifting,
        }),
    }
}

/// Speeds at the start: each particle's own, where the scene gives them as formulas.
fn set_in_motion(program: &Program, fluid: &Fluid, particles: &mut Particles) {
    let speeds = Interpreter::new(&program.module().graph, &fluid.velocity);
    for i in 0..particles.len() {
        let mut velocity = [0.0; 3];
        speeds.eval_given(
            Given { time: 0.0, ..Given::point(particles.position.get(i).to_array()) },
            &mut velocity,
        );
        particles.velocity.set(i, DVec3::from_array(velocity));
    }
}

/// The greatest speed at the start, looked for on a grid over the box.
fn fastest(program: &Program, scene: &Scene) -> f64 {
    const SIDE: usize = 16;
    let speeds = Interpreter::new(&program.module().graph, &scene.fluid.velocity);
    let mut most: f64 = 0.0;
    for k in 0..SIDE.pow(3) {
        let part = DVec3::new((k % SIDE) as f64, (k / SIDE % SIDE) as f64, (k / SIDE / SIDE) as f64);
        let p = scene.domain.min + scene.domain.size() * part / (SIDE - 1) as f64;
        let mut velocity = [0.0; 3];
        speeds.eval_given(Given { time: 0.0, ..Given::point(p.to_array()) }, &mut velocity);
        most = most.max(DVec3::from_array(velocity).length());
    }
    most
}

fn no_fluid(program: &Program, error: &SeedError, span: Span) -> Error {
    let code = match error {
        SeedError::NothingLeft(_) => Code::OBSTACLE_FILLS_BOX,
        _ => Code::SCENE_NO_ROOM,
    };
    refuse(program, Diagnostic::error(code, span, error.to_string()))
}

fn refuse(program: &Program, diagnostic: Diagnostic) -> Error {
    Error::Diagnostics(Diagnostics { list: vec![diagnostic], sources: program.sources().clone() })
}
