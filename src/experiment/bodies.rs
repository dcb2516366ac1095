//! The solids of a scene as obstacles of a simulation.

use std::sync::Arc;

use super::wall_speed::{self, Driven};
use super::{rigid_parts, switched::Switched, vector_field};
use crate::compile::Error;
use crate::field::{Moving, Walls};
use crate::ir::Node;
use crate::lower::{Scene, Skin};
use crate::solid::MovingMap;
use crate::sph::{ChangingShape, Obstacle, Parameters};
use crate::{Engine, Program, Solid};

/// Distance of samples, over the support radius, along paths at obstacles without a known range. Compiled
/// obstacles are swept instead.
const PATH_RESOLUTION: f64 = 0.05;

/// Length of the window of time for which the map of a moving solid holds, in steps.
const WINDOW: f64 = 16.0;

/// How far, over the support radius, the surface of a solid that changes its shape moves between two looks at
/// it. The part of kernels that it takes is interpolated by a cubic in time, whose error is then about a
/// thousandth.
const CHANGE: f64 = 1.0 / 8.0;

/// The least number of intervals between such looks in a run.
const LEAST_CHANGES: f64 = 16.0;

/// A solid in the way of the fluid: an obstacle, or the outside of the container.
pub struct Body {
    /// The solid as it is at the start, t = 0.
    pub solid: Solid,
    /// What the scene states about the solid's surface.
    pub skin: Skin,
    /// The solid as the simulation uses it.
    pub(super) obstacle: Obstacle,
}

/// The outside of a scene's container, or an obstacle, at all times.
pub(super) struct Part {
    name: String,
    shape: Node,
    skin: Skin,
    pub whole: Solid,
}

/// Compiles the outside of the container, if the scene has one, and the obstacles.
pub(super) fn compile(program: &Program, scene: &Scene, engine: Engine) -> Result<Vec<Part>, Error> {
    let container = scene.container.iter().map(|c| (&c.name, c.outside, c.skin));
    let obstacles = scene.obstacles.iter().map(|o| (&o.name, o.shape, o.skin));
    let part = |(name, shape, skin): (&String, Node, Skin)| {
        Ok(Part { name: name.clone(), shape, skin, whole: program.compile(name, shape, engine)? })
    };
    container.chain(obstacles).map(part).collect()
}

/// The greatest speeds of walls and surfaces that move.
pub(super) fn greatest_speed(program: &Program, scene: &Scene, parts: &[Part]) -> Driven {
    let speed = |part: &Part| {
        let belt = part.skin.velocity.map(|nodes| vector_field(program, &nodes));
        wall_speed::greatest(&part.whole, (part.skin.slip, belt), &scene.domain, scene.run.until)
    };
    parts.iter().map(speed).fold(Driven::default(), Driven::or)
}

/// The parts in the form that a simulation needs.
pub(super) fn of_parts(
    program: &Program,
    scene: &Scene,
    parameters: &Parameters,
    engine: Engine,
    parts: Vec<Part>,
) -> Result<Vec<Body>, Error> {
    parts.into_iter().map(|part| body(program, scene, parameters, engine, part)).collect()
}

fn body(
    program: &Program,
    scene: &Scene,
    parameters: &Parameters,
    engine: Engine,
    part: Part,
) -> Result<Body, Error> {
    let Part { name, shape, skin, whole } = part;
    let solid = whole.at(0.0);
    let has_maps = whole.moves() && parameters.walls_have_density();
    let parts = if has_maps {
        rigid_parts::of(program, (&name, shape), scene.run.until, engine)?
    } else {
        Vec::new()
    };
    let switched = (whole.moves() && parts.is_empty())
        .then(|| Switched::of(&program.module().graph, shape, &whole, scene.run.until, engine))
        .flatten()
        .filter(|_| !rigid_parts::keeps_its_shape(program, shape, scene.run.until));
    let switched = switched.map(|switched| switched as Arc<dyn Moving>);
    let changing = (has_maps && parts.is_empty())
        .then(|| changing_shape(program, shape, (&whole, switched.clone()), scene, parameters))
        .flatten();
    let obstacle = Obstacle {
        parts,
        changing,
        field: at_rest(&solid, scene, parameters),
        moving: whole.moves().then(|| switched.unwrap_or_else(|| in_motion(&whole, scene, parameters))),
        restitution: skin.bounce.restitution,
        friction: skin.bounce.friction,
        slip: skin.slip,
        surface_velocity: skin.velocity.map(|nodes| vector_field(program, &nodes)),
        resolution: PATH_RESOLUTION * parameters.support_radius,
    };
    Ok(Body { solid, skin, obstacle })
}

/// How often a solid that changes its shape during a run is looked at; `None` if it does not change it, if it
/// has too many parts for its volume to be affordable, or if its surface is not found.
fn changing_shape(
    program: &Program,
    shape: Node,
    (whole, switched): (&Solid, Option<Arc<dyn Moving>>),
    scene: &Scene,
    parameters: &Parameters,
) -> Option<ChangingShape> {
    let until = scene.run.until;
    if whole.has_many_leaves() || rigid_parts::keeps_its_shape(program, shape, until) {
        return None;
    }
    if let Some(body) = switched {
        return Some(ChangingShape { body, until, intervals: 1, switches: true });
    }
    let way = CHANGE * parameters.support_radius;
    let wanted = wall_speed::time_for(whole, way, &scene.domain, until)?
        .max(parameters.stable_dt(parameters.expected_speed).min(parameters.time_step));
    // a whole number of them, so that none is beyond the end
    let intervals = (until / wanted).ceil().max(LEAST_CHANGES) as u64;
    Some(ChangingShape { body: Arc::new(whole.clone()), until, intervals, switches: false })
}

/// The cheapest field that represents a solid in the box of a scene.
fn at_rest(solid: &Solid, scene: &Scene, parameters: &Parameters) -> Arc<dyn Walls> {
    if parameters.walls_have_density() {
        solid.walls(scene.domain, parameters.support_radius).into()
    } else if solid.has_many_leaves() {
        // with few leaves ω itself is cheap; with many, only the leaves that matter near a particle are
        // evaluated
        solid.surface(scene.domain).into()
    } else {
        Arc::new(solid.clone())
    }
}

/// The cheapest field that represents a moving solid in the box of a scene during a run.
fn in_motion(solid: &Solid, scene: &Scene, parameters: &Parameters) -> Arc<dyn Moving> {
    let run = (0.0, scene.run.until);
    let window = WINDOW * parameters.stable_dt(parameters.expected_speed).min(parameters.time_step);
    match MovingMap::new(solid, scene.domain, parameters.support_radius, run, window) {
        Some(map) => Arc::new(map),
        None => Arc::new(solid.clone()),
    }
}
