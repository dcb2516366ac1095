//! A scene of the language → a simulation: obstacles compiled, parameters checked, particles put and carved.

use super::super::args::Shared;
use super::super::{Failure, choose, input};
use crate::diagnostic::{Code, Diagnostic, Diagnostics, Span};
use crate::field::Field;
use crate::geom::Aabb;
use crate::lower::{Fill, Scene};
use crate::solid::Bounds;
use crate::sph::{
    self, FluidBlock, FluidShape, NegativePressure, Obstacle, Parameters, Particles, SeedError, Simulation,
    carve,
};
use crate::{Program, Solid};

/// Particles start at least this part of the spacing away from an obstacle.
const CLEARANCE: f64 = 0.5;

/// Obstacles of which no range is known would be sampled in steps of this part of the support radius; compiled ones
/// are swept.
const PATH_RESOLUTION: f64 = 0.05;

pub(super) struct Setup {
    pub domain: Aabb,
    pub parameters: Parameters,
    /// Solids, what answers for them in the box, and their restitution.
    pub obstacles: Vec<(Solid, Box<dyn Field>, f64)>,
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
        for obstacle in &scene.obstacles {
            let solid = compile(&obstacle.name, obstacle.shape)?;
            // ω itself for a few leaves; for many, only those that matter where a particle is
            let field: Box<dyn Field> =
                if solid.has_many_leaves() { solid.surface(scene.domain) } else { Box::new(solid.clone()) };
            obstacles.push((solid, field, obstacle.restitution));
        }
        let mut parameters = Parameters {
            rest_density: scene.fluid.density,
            particle_mass: scene.fluid.mass,
            support_radius: scene.fluid.support_radius,
            stiffness: scene.fluid.stiffness,
            negative_pressure: NegativePressure::default(),
            viscosity: scene.fluid.viscosity,
            surface_tension: scene.fluid.surface_tension,
            surface_threshold: scene.fluid.threshold,
            gravity: scene.gravity,
            wall_restitution: scene.wall_restitution,
            time_step: 1.0,
        };
        let height = scene.gravity.normalize_or_zero().abs().dot(scene.domain.size());
        let typical_speed =
            (scene.fluid.velocity.length_squared() + 2.0 * scene.gravity.length() * height).sqrt();
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
            velocity: fluid.velocity,
            jitter: fluid.jitter,
            seed: fluid.seed,
        };
        let span = fluid.particles_span.unwrap_or(fluid.shape_span);
        let mut particles =
            block.seed(&self.parameters, self.domain).map_err(|e| no_fluid(program, &e, span))?;
        let obstacles: Vec<Obstacle<'_>> =
            self.obstacles.iter().map(|(_, field, e)| self.obstacle(&**field, *e)).collect();
        let carved = self.carve(program, scene, &mut particles, &obstacles)?;
        let simulation = Simulation::new(self.parameters.clone(), particles, self.domain, obstacles);
        let simulation = simulation.map_err(|e| {
            refuse(program, Diagnostic::error(Code::SCENE_NO_ROOM, fluid.shape_span, e.to_string()))
        })?;
        Ok((simulation, carved))
    }

    fn obstacle<'a>(&self, field: &'a dyn Field, restitution: f64) -> Obstacle<'a> {
        let resolution = PATH_RESOLUTION * self.parameters.support_radius;
        Obstacle { field, restitution, resolution }
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
