//! A scene of the language → a simulation: obstacles compiled, parameters checked, particles put and carved.

use super::super::args::Shared;
use super::super::{Failure, choose, input};
use crate::diagnostic::{Code, Diagnostic, Diagnostics, Span};
use crate::field::Field;
use crate::geom::Aabb;
use crate::ir::Interpreter;
use crate::lower::{Bounce, Fill, Fluid, Method, Precision, Scene, Slip};
use crate::solid::Bounds;
use crate::sph::{
    self, Checkpoint, FluidBlock, FluidShape, NegativePressure, Obstacle, Parameters, Particles, SeedError,
    SetupError, Simulation, carve,
};
use crate::{Program, Solid};
use glam::DVec3;

/// Particles start at least this part of the spacing away from an obstacle.
const CLEARANCE: f64 = 0.5;

/// Obstacles of which no range is known would be sampled in steps of this part of the support radius; compiled ones
/// are swept.
const PATH_RESOLUTION: f64 = 0.05;

pub(super) struct Setup {
    pub domain: Aabb,
    pub parameters: Parameters,
    /// Solids, what answers for them in the box, and what they do to a particle.
    pub obstacles: Vec<(Solid, Box<dyn Field>, Bounce)>,
    fluid: Solid,
    pub time_step_reason: &'static str,
    /// A speed that the scene can reach by gravity, for the colours of pictures.
    pub typical_speed: f64,
}

impl Setup {
    pub fn of(shared: &Shared, program: &Program, scene: &Scene) -> Result<Self, Failure> {
        let engine = shared.engine.into();
        let compile = |name: &str, node| program.compile(name, node, engine).map_err(choose::usage);
        let fluid = compile(&scene.fluid.name, scene.fluid.shape)?;
        let mut obstacles = Vec::new();
        let reach = match scene.method {
            Method::Paper => 0.0,
            _ => scene.fluid.support_radius,
        };
        let container = scene.container.as_ref().map(|c| (&c.name, c.outside, c.bounce));
        for (name, shape, bounce) in
            container.into_iter().chain(scene.obstacles.iter().map(|o| (&o.name, o.shape, o.bounce)))
        {
            let solid = compile(name, shape)?;
            let field: Box<dyn Field> = if reach > 0.0 {
                solid.walls(scene.domain, reach)
            } else if solid.has_many_leaves() {
                // ω itself for a few leaves; for many, only those that matter where a particle is
                solid.surface(scene.domain)
            } else {
                Box::new(solid.clone())
            };
            obstacles.push((solid, field, bounce));
        }
        let gravity = scene.gravity;
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
            slip: match scene.slip {
                Slip::Free => sph::Slip::Free,
                Slip::No => sph::Slip::No,
            },
            precision: match (scene.solver.precision, scene.method) {
                (Some(Precision::Double), _) | (None, Method::Paper) => sph::Precision::Double,
                _ => sph::Precision::Single,
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
                    warn(program, Diagnostic::warning(Code::LONG_STEP, scene.span, message));
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
        parameters.validate().map_err(|error| {
            let message = format!("the fluid's figures do not fit together: {error}");
            refuse(program, Diagnostic::error(Code::OUT_OF_RANGE, scene.fluid.shape_span, message))
        })?;
        Ok(Self { domain: scene.domain, parameters, obstacles, fluid, time_step_reason, typical_speed })
    }

    /// The simulation at its start, and how many particles were carved off.
    pub fn simulation(&self, program: &Program, scene: &Scene) -> Result<(Simulation<'_>, usize), Failure> {
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
        let obstacles: Vec<Obstacle<'_>> =
            self.obstacles.iter().map(|(_, field, e)| self.obstacle(&**field, *e)).collect();
        let carved = self.carve(program, scene, &mut particles, &obstacles)?;
        let simulation = Simulation::new(self.parameters.clone(), particles, self.domain, obstacles);
        let simulation = simulation.map_err(|e| {
            refuse(program, Diagnostic::error(Code::SCENE_NO_ROOM, fluid.shape_span, e.to_string()))
        })?;
        Ok((simulation, carved))
    }

    /// The simulation at a checkpoint.
    pub fn resume(&self, checkpoint: &Checkpoint) -> Result<Simulation<'_>, SetupError> {
        let obstacles = self.obstacles.iter().map(|(_, field, e)| self.obstacle(&**field, *e)).collect();
        Simulation::resume(self.parameters.clone(), checkpoint, self.domain, obstacles)
    }

    fn obstacle<'a>(&self, field: &'a dyn Field, bounce: Bounce) -> Obstacle<'a> {
        let resolution = PATH_RESOLUTION * self.parameters.support_radius;
        Obstacle { field, restitution: bounce.restitution, friction: bounce.friction, resolution }
    }

    fn carve(
        &self,
        program: &Program,
        scene: &Scene,
        particles: &mut Particles,
        obstacles: &[Obstacle<'_>],
    ) -> Result<usize, Failure> {
        let span = scene.fluid.shape_span;
        let clearance = CLEARANCE * self.parameters.spacing();
        let carved =
            carve(particles, &self.domain, obstacles, clearance).map_err(|e| no_fluid(program, &e, span))?;
        let lost = carved.inside + carved.too_close + carved.outside_box;
        if lost > 0 {
            let message = format!(
                "{lost} of the fluid's particles were carved off: {} in an obstacle, {} too close to one, {} \
                 outside the box; {} are left",
                carved.inside, carved.too_close, carved.outside_box, carved.kept
            );
            warn(program, Diagnostic::warning(Code::FLUID_IN_OBSTACLE, span, message));
        }
        Ok(lost)
    }
}

/// The method of a scene with its numbers.
fn method(scene: &Scene, typical_speed: f64) -> sph::Method {
    match scene.method {
        Method::Paper => sph::Method::Paper,
        Method::Wcsph => sph::Method::Wcsph(sph::Wcsph {
            sound_speed: scene.fluid.sound_speed.unwrap_or(10.0 * typical_speed),
            density_diffusion: scene.fluid.density_diffusion,
            artificial_viscosity: scene.fluid.artificial_viscosity,
        }),
        Method::Dfsph => sph::Method::Dfsph(sph::Dfsph {
            tolerance: scene.solver.compression,
            most_iterations: scene.solver.iterations as u32,
        }),
    }
}

/// Speeds at the start: each particle's own, where the scene gives them as formulas.
fn set_in_motion(program: &Program, fluid: &Fluid, particles: &mut Particles) {
    let speeds = Interpreter::new(&program.module().graph, &fluid.velocity);
    for i in 0..particles.len() {
        let mut velocity = [0.0; 3];
        speeds.eval_f64(particles.position.get(i).to_array(), &mut velocity);
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
        speeds.eval_f64(p.to_array(), &mut velocity);
        most = most.max(DVec3::from_array(velocity).length());
    }
    most
}

fn no_fluid(program: &Program, error: &SeedError, span: Span) -> Failure {
    let code = match error {
        SeedError::NothingLeft(_) => Code::OBSTACLE_FILLS_BOX,
        _ => Code::SCENE_NO_ROOM,
    };
    refuse(program, Diagnostic::error(code, span, error.to_string()))
}

/// Shows a message about the scene and makes it a finding.
fn refuse(program: &Program, diagnostic: Diagnostic) -> Failure {
    warn(program, diagnostic);
    Failure::Findings
}

fn warn(program: &Program, diagnostic: Diagnostic) {
    input::show(&Diagnostics { list: vec![diagnostic], sources: program.sources().clone() });
}
