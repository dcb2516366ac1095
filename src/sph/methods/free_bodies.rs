//! Bodies of fluid that touch no wall, as drops and jets do, and the balance of the forces within them.
//!
//! The tension of a closed surface has no resultant and no torque, ∮ κ n dA = 0 and ∮ x × κ n dA = 0. A sum
//! over particles has both, so a round drop would set itself in motion and begin to spin. Among all changes
//! that remove the resultant and the torque, the smallest one, weighted by how far particles belong to the
//! surface, is a rigid acceleration w·(α + β × (x − c)). It is a small part of the force, for each body on
//! its own.
//!
//! Two particles belong to one body if their cells in a grid with the support radius as spacing touch. So
//! bodies that approach each other count as one slightly too early.

use std::collections::HashMap;

use glam::{DMat3, DVec3};

use crate::sph::{core::Core, particles::Vectors};

/// A body that is as flat as a line, by the determinant of its moment of inertia over the cube of its trace,
/// has no axis of its own.
const LEAST_ROUND: f64 = 1e-6;

/// A body of fluid.
#[derive(Clone, Copy, Default)]
struct Body {
    touches_wall: bool,
    /// Σ w.
    weight: f64,
    /// Σ w·x, and with that the centre c.
    centre: DVec3,
    /// Σ f, and with that α.
    force: DVec3,
    /// Σ (x − c) × f, and with that β.
    torque: DVec3,
    /// Σ w·(r²·1 − r⊗r).
    inertia: DMat3,
}

/// Removes the resultant and the torque from the forces on bodies that touch no wall. `force` holds the force
/// of each particle over its mass, `weight` how far it belongs to the surface.
pub(super) fn balance(core: &Core, force: &mut Vectors, weight: &[f64]) {
    let (of, count) = bodies(core);
    let mut bodies = vec![Body::default(); count];
    let position = &core.particles.position;
    for (i, &k) in of.iter().enumerate() {
        let body = &mut bodies[k];
        body.touches_wall = body.touches_wall || core.coverage::<()>(i).is_some();
        body.weight += weight[i];
        body.centre += weight[i] * position.get(i);
        body.force += force.get(i);
    }
    for body in bodies.iter_mut().filter(|body| body.weight > 0.0) {
        body.centre /= body.weight;
        body.force /= body.weight;
    }
    for (i, &k) in of.iter().enumerate() {
        let body = &mut bodies[k];
        let away = position.get(i) - body.centre;
        body.torque += away.cross(force.get(i));
        let square = DMat3::from_cols(away * away.x, away * away.y, away * away.z);
        body.inertia += weight[i] * (DMat3::from_diagonal(DVec3::splat(away.length_squared())) - square);
    }
    for body in &mut bodies {
        let trace = body.inertia.x_axis.x + body.inertia.y_axis.y + body.inertia.z_axis.z;
        let is_round = body.inertia.determinant() > LEAST_ROUND * trace.powi(3);
        body.torque = if is_round { body.inertia.inverse() * body.torque } else { DVec3::ZERO };
    }
    for (i, &k) in of.iter().enumerate() {
        let body = &bodies[k];
        if body.weight > 0.0 && !body.touches_wall {
            let rigid = body.force + body.torque.cross(position.get(i) - body.centre);
            force.set(i, force.get(i) - weight[i] * rigid);
        }
    }
}

/// The body of each particle, and the number of bodies.
fn bodies(core: &Core) -> (Vec<usize>, usize) {
    let h = core.parameters.support_radius;
    let from = core.boundary.domain.min;
    let cell_of = |p: DVec3| ((p - from) / h).floor().to_array().map(|n| n as i64);
    let mut cells: HashMap<[i64; 3], usize> = HashMap::new();
    let mut keys = Vec::new();
    let of: Vec<usize> = core
        .particles
        .position
        .iter()
        .map(|p| {
            let cell = cell_of(p);
            *cells.entry(cell).or_insert_with(|| {
                keys.push(cell);
                keys.len() - 1
            })
        })
        .collect();
    // the first cell of each body stands for it
    let mut parent: Vec<usize> = (0..keys.len()).collect();
    let root = |parent: &mut Vec<usize>, mut k: usize| {
        while parent[k] != k {
            parent[k] = parent[parent[k]];
            k = parent[k];
        }
        k
    };
    for (k, [x, y, z]) in keys.iter().enumerate() {
        // half of the neighbours: the others have this cell among theirs
        for n in 14..27 {
            let other = [x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1];
            if let Some(&other) = cells.get(&other) {
                let (a, b) = (root(&mut parent, k), root(&mut parent, other));
                parent[a.max(b)] = a.min(b);
            }
        }
    }
    let mut number = vec![usize::MAX; keys.len()];
    let mut count = 0;
    let of = of
        .into_iter()
        .map(|cell| {
            let root = root(&mut parent, cell);
            if number[root] == usize::MAX {
                number[root] = count;
                count += 1;
            }
            number[root]
        })
        .collect();
    (of, count)
}
