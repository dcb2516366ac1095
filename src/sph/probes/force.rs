//! The force of a fluid on an obstacle, which is minus the force of the obstacle on the fluid.

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    field::Faces,
    sph::{
        core::{CHUNK, Core},
        scales::Slip,
        walls::{Coverage, Wall, WallDrag},
    },
};

/// A force and its moment about the origin → the force and its moment about a point.
pub fn about([x, y, z, u, v, w]: [f64; 6], point: DVec3) -> [f64; 6] {
    let force = DVec3::new(x, y, z);
    let moment = DVec3::new(u, v, w) - point.cross(force);
    [x, y, z, moment.x, moment.y, moment.z]
}

/// Force and torque by pressure, ∫ p n over the obstacle's surface, and by friction where the fluid sticks to
/// walls.
///
/// ∇λ of an obstacle is a layer over its surface that weighs ½ in the fluid. The integral is therefore a sum
/// of 2V·p·∇λ over the particles, with the pressure continued to the surface by the balance ∇p = ρ(g − a).
/// (The sum of what the method's wall terms give to the particles is too small in a narrow vessel: its
/// completed sums let the side walls carry 7 % of a column ten spacings wide.)
pub fn pressure_on(core: &Core, obstacle: usize, point: DVec3) -> [f64; 6] {
    let Core { parameters, particles, .. } = core;
    if !parameters.walls_have_density() {
        return [0.0; 6];
    }
    let field = core.boundary.field(obstacle);
    let (h, mass) = (parameters.support_radius, parameters.particle_mass);
    // the integral over the surface needs a continuous wall, even if the method's sums take it in layers
    let surface = Wall { layer: None, ..*core.wall() };
    let friction = match core.boundary.obstacles[obstacle].slip {
        Slip::Free => 0.0,
        Slip::No => 2.0 * mass * parameters.viscosity / parameters.rest_density,
    };
    let on_obstacle = |i: usize| {
        let mut faces = Faces::new();
        field.faces(particles.position.get(i), h, &mut faces);
        let wall = Coverage::<WallDrag>::of_faces(&surface, &faces);
        let by_pressure = core.acceleration.get(i) - core.gravity(i);
        let density = particles.density[i];
        2.0 * mass / density * (particles.pressure[i] * wall.gradient - density * (wall.spread * by_pressure))
            + friction * (wall.friction.tensor * particles.velocity.get(i))
    };
    let forces: Vec<DVec3> =
        (0..particles.len()).into_par_iter().with_min_len(CHUNK / 4).map(on_obstacle).collect();
    // one after the other: the same bits for any number of threads
    let (mut force, mut moment) = (DVec3::ZERO, DVec3::ZERO);
    for (x, push) in particles.position.iter().zip(forces) {
        force += push;
        moment += (x - point).cross(push);
    }
    [force.x, force.y, force.z, moment.x, moment.y, moment.z]
}
