//! Walls of a box that hold the fluid.
//!
//! The kernel sum before a wall misses what the wall replaces, so its surface would be round there and stand off. The
//! mirror images of the particles behind the wall fill it up, and the surface goes through the wall. What lies
//! beyond is then laid flat onto the wall: the mesh stays closed, and ends where the wall is.

use glam::DVec3;

use crate::geom::Aabb;
use crate::mesh::Mesh;

/// The mirror images behind the walls of a box of all particles that are nearer to a wall than `reach`, also those behind
/// its edges and corners.
pub(super) fn images(particles: &[DVec3], vessel: &Aabb, reach: f64) -> Vec<DVec3> {
    let mut images: Vec<DVec3> = Vec::new();
    for axis in 0..3 {
        let walls = [(vessel.min[axis], 1.0), (vessel.max[axis], -1.0)];
        // images behind the walls before this one have images of their own, those behind the opposite one have none
        let before = images.len();
        for (wall, inwards) in walls {
            let near = |p: &DVec3| (0.0..reach).contains(&(inwards * (p[axis] - wall)));
            let mirrored = |p: &DVec3| {
                let mut image = *p;
                image[axis] = 2.0 * wall - p[axis];
                image
            };
            let found: Vec<DVec3> =
                particles.iter().chain(&images[..before]).filter(|p| near(p)).map(mirrored).collect();
            images.extend(found);
        }
    }
    images
}

/// Moves what lies beyond the walls onto them.
pub(super) fn hold(mesh: &mut Mesh, vessel: &Aabb) {
    for (p, normal) in mesh.positions.iter_mut().zip(&mut mesh.normals) {
        let held = p.clamp(vessel.min, vessel.max);
        if held != *p {
            let outwards = (*p - held).try_normalize();
            (*p, *normal) = (held, outwards.unwrap_or(*normal));
        }
    }
}
