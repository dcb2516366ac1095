//! Walls of a box that hold the fluid.
//!
//! The kernel sum before a wall misses what the wall replaces, so its surface would be round there and stand off. The
//! mirror images of the particles behind the wall fill it up, and the surface goes through the wall. What lies
//! beyond is then laid flat onto the wall: the mesh stays closed, and ends where the wall is.

use glam::DVec3;

use crate::geom::Aabb;
use crate::mesh::Mesh;

/// The mirror images behind the walls of a box of all particles that are nearer to a wall than `reach`, also
/// those behind its edges and corners.
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

/// Moves what lies beyond the walls onto them, and leaves out what lies there alone: the images of fluid that does not
/// touch the wall.
pub(super) fn hold(mesh: &mut Mesh, vessel: &Aabb) {
    keep_parts_within(mesh, vessel);
    for (p, normal) in mesh.positions.iter_mut().zip(&mut mesh.normals) {
        let held = p.clamp(vessel.min, vessel.max);
        if held != *p {
            let outwards = (*p - held).try_normalize();
            (*p, *normal) = (held, outwards.unwrap_or(*normal));
        }
    }
}

/// Leaves out the parts of a mesh that have no vertex within the box. The others keep their order.
fn keep_parts_within(mesh: &mut Mesh, vessel: &Aabb) {
    // each vertex points to one of its part, the first of all in the end
    let mut of: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    fn first(of: &mut [u32], mut v: u32) -> u32 {
        while of[v as usize] != v {
            of[v as usize] = of[of[v as usize] as usize];
            v = of[v as usize];
        }
        v
    }
    for t in &mesh.triangles {
        for pair in [[t[0], t[1]], [t[1], t[2]]] {
            let [a, b] = pair.map(|v| first(&mut of, v));
            of[a.max(b) as usize] = a.min(b);
        }
    }
    let mut is_kept = vec![false; of.len()];
    for v in 0..of.len() as u32 {
        let p = mesh.positions[v as usize];
        if (p.cmpgt(vessel.min) & p.cmplt(vessel.max)).all() {
            is_kept[first(&mut of, v) as usize] = true;
        }
    }
    let stays: Vec<bool> = (0..of.len() as u32).map(|v| is_kept[first(&mut of, v) as usize]).collect();
    if stays.iter().all(|stays| *stays) {
        return;
    }
    let mut count = 0;
    let numbers: Vec<u32> = stays
        .iter()
        .map(|&stays| {
            count += u32::from(stays);
            count - u32::from(stays)
        })
        .collect();
    mesh.triangles.retain(|t| stays[t[0] as usize]);
    mesh.triangles.iter_mut().flatten().for_each(|v| *v = numbers[*v as usize]);
    for column in [&mut mesh.positions, &mut mesh.normals] {
        let mut stays = stays.iter();
        column.retain(|_| stays.next() == Some(&true));
    }
}
