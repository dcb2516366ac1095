//! The solids of a scene as obstacles of a simulation.

use std::sync::Arc;

use super::vector_field;
use crate::compile::Error;
use crate::field::{Moving, Walls};
use crate::ir::Node;
use crate::lower::{Scene, Skin};
use crate::solid::MovingMap;
use crate::sph::{Obstacle, Parameters};
use crate::{Engine, Program, Solid};

/// Obstacles without a known range would be sampled in steps of this part of the support radius; compiled ones are swept.
const PATH_RESOLUTION: f64 = 0.05;

/// A window of time in which the map of a moving solid stays, in steps.
const WINDOW: f64 = 16.0;

/// A solid in the fluid's way.
pub struct Body {
    /// The solid as it is at the start.
    pub solid: Solid,
    /// What the scene says of its surface.
    pub skin: Skin,
    /// The solid as the simulation meets it.
    pub(super) obstacle: Obstacle,
}

/// Compiles the outside of the container, if the scene has one, and the obstacles.
pub(super) fn compile(
    program: &Program,
    scene: &Scene,
    parameters: &Parameters,
    engine: Engine,
) -> Result<Vec<Body>, Error> {
    let container = scene.container.iter().map(|c| (&c.name, c.outside, c.skin));
    let obstacles = scene.obstacles.iter().map(|o| (&o.name, o.shape, o.skin));
    container
        .chain(obstacles)
        .map(|(name, shape, skin)| body(program, scene, parameters, (name, shape), skin, engine))
        .collect()
}

fn body(
    program: &Program,
    scene: &Scene,
    parameters: &Parameters,
    (name, shape): (&str, Node),
    skin: Skin,
    engine: Engine,
) -> Result<Body, Error> {
    let whole = program.compile(name, shape, engine)?;
    let solid = whole.at(0.0);
    let obstacle = Obstacle {
        field: at_rest(&solid, scene, parameters),
        moving: whole.moves().then(|| in_motion(&whole, scene, parameters)),
        restitution: skin.bounce.restitution,
        friction: skin.bounce.friction,
        slip: skin.slip,
        surface_velocity: skin.velocity.map(|nodes| vector_field(program, &nodes)),
        resolution: PATH_RESOLUTION * parameters.support_radius,
    };
    Ok(Body { solid, skin, obstacle })
}

/// The cheapest field that answers for a solid in the box of a scene.
fn at_rest(solid: &Solid, scene: &Scene, parameters: &Parameters) -> Arc<dyn Walls> {
    if parameters.walls_have_density() {
        solid.walls(scene.domain, parameters.support_radius).into()
    } else if solid.has_many_leaves() {
        // ω itself for a few leaves; for many, only those that matter where a particle is
        solid.surface(scene.domain).into()
    } else {
        Arc::new(solid.clone())
    }
}

/// The same for a solid that moves, during a run.
fn in_motion(solid: &Solid, scene: &Scene, parameters: &Parameters) -> Arc<dyn Moving> {
    let run = (0.0, scene.run.until);
    let window = WINDOW * parameters.stable_dt(parameters.expected_speed).min(parameters.time_step);
    match MovingMap::new(solid, scene.domain, parameters.support_radius, run, window) {
        Some(map) => Arc::new(map),
        None => Arc::new(solid.clone()),
    }
}
