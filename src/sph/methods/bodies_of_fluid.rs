//! Bodies of fluid, as drops and jets are, and the balance of the forces within them.
//!
//! The tension of a closed surface has no resultant and no torque, ∮ κ n dA = 0 and ∮ x × κ n dA = 0. A sum
//! over particles has both, so a round drop would set itself in motion and begin to spin. Among all changes
//! that remove the resultant and the torque, the smallest one, weighted by how far particles belong to the
//! surface, is a rigid acceleration w·(α + β × (x − c)). It is a small part of the force, for each body on
//! its own.
//!
//! A surface that meets walls at a right angle keeps its area where the body slides along them as a rigid one:
//! along a plane and about its normal, about the centre of a sphere, along the edge of a corner and a tube. So the
//! tension does no work there, and only such motions are removed from its forces on a body that touches walls. They
//! are those (α, β) for which α + β × (x − c) has no part along the normals m of the walls:
//!
//! ```text
//! (M + ρQ)·(α, β) = Σ (f, (x − c) × f)        M = Σ w J Jᵀ,  Q = Σ λ g gᵀ,  g = (m, (x − c) × m)
//! ```
//!
//! with a ρ so large that what Q holds is left alone. In edges each wall counts with the λ of all of them.
//!
//! Two particles belong to one body if their cells in a grid with the support radius as spacing touch. So
//! bodies that approach each other count as one slightly too early.

use std::collections::HashMap;

use glam::{DMat3, DVec3};
use nalgebra::{ArrayStorage, Cholesky, Matrix3, Matrix6, Vector3, Vector6};

use super::images::{Mirrors, Plane};
use crate::sph::{core::Core, particles::Vectors};

/// A body that is as flat as a line, by the determinant of its moment of inertia over the cube of its trace,
/// has no axis of its own.
const LEAST_ROUND: f64 = 1e-6;

/// ρ. Maps know normals to 0.004, which adds ρ·0.004² = 0.16 of Σ λ to M, a hundredth of it for a drop on a plane, so
/// that such a body still slides. Of what walls hold, less than a hundredth is taken off.
const HOLD: f64 = 1e4;

/// A body of fluid.
#[derive(Clone, Copy)]
struct Body {
    touches_wall: bool,
    /// Q, with lengths in units of m.
    held: Matrix6<f64>,
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

/// Removes the resultant and the torque from the forces on bodies, as far as no wall holds them. `force` holds the
/// force of each particle over its mass, `weight` how far it belongs to the surface.
pub(super) fn balance(core: &Core, mirrors: &Mirrors, force: &mut Vectors, weight: &[f64]) {
    let (of, count) = bodies(core, core.parameters.support_radius);
    let mut bodies = vec![Body::NONE; count];
    let position = &core.particles.position;
    for (i, &k) in of.iter().enumerate() {
        let body = &mut bodies[k];
        body.touches_wall = body.touches_wall || mirrors.near(i).is_some();
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
        if let Some(near) = mirrors.near(i) {
            for Plane { normal, .. } in &near.each {
                let turn = away.cross(*normal);
                let along = Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
                body.held += near.filled * along * along.transpose();
            }
        }
    }
    for body in &mut bodies {
        if body.touches_wall {
            (body.force, body.torque) = body.slide().unwrap_or_default();
            continue;
        }
        let trace = body.inertia.x_axis.x + body.inertia.y_axis.y + body.inertia.z_axis.z;
        let is_round = body.inertia.determinant() > LEAST_ROUND * trace.powi(3);
        body.torque = if is_round { body.inertia.inverse() * body.torque } else { DVec3::ZERO };
    }
    for (i, &k) in of.iter().enumerate() {
        let body = &bodies[k];
        if body.weight > 0.0 {
            let rigid = body.force + body.torque.cross(position.get(i) - body.centre);
            force.set(i, force.get(i) - weight[i] * rigid);
        }
    }
}

impl Body {
    /// A body without particles. (The default of a matrix is not zero but one.)
    const NONE: Self = Self {
        touches_wall: false,
        held: Matrix6::from_array_storage(ArrayStorage([[0.0; 6]; 6])),
        weight: 0.0,
        centre: DVec3::ZERO,
        force: DVec3::ZERO,
        torque: DVec3::ZERO,
        inertia: DMat3::ZERO,
    };

    /// α and β of a body that touches walls, from its force over its weight and its torque. `None` if they cannot be
    /// told, as for a body of one particle.
    fn slide(&self) -> Option<(DVec3, DVec3)> {
        let trace = self.inertia.x_axis.x + self.inertia.y_axis.y + self.inertia.z_axis.z;
        if trace <= 0.0 {
            return None;
        }
        // the radius of gyration makes lengths of angles
        let radius = (0.5 * trace / self.weight).sqrt();
        let lengths = Vector6::new(1.0, 1.0, 1.0, 1.0 / radius, 1.0 / radius, 1.0 / radius);
        let mut moments = HOLD * self.held;
        let inertia = Matrix3::from_column_slice(&self.inertia.to_cols_array());
        let mut turns = moments.fixed_view_mut::<3, 3>(3, 3);
        turns += inertia;
        for k in 0..3 {
            moments[(k, k)] += self.weight;
        }
        let scaled = Matrix6::from_diagonal(&lengths) * moments * Matrix6::from_diagonal(&lengths);
        let (force, torque) = (self.weight * self.force, self.torque);
        let loads = Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
        let motion = Cholesky::new(scaled)?.solve(&loads.component_mul(&lengths)).component_mul(&lengths);
        let of = |k: usize| DVec3::from_array(Vector3::from(motion.fixed_rows::<3>(k)).into());
        let (translation, rotation) = (of(0), of(3));
        (translation.is_finite() && rotation.is_finite()).then_some((translation, rotation))
    }
}

/// The body of each particle, and the number of bodies, by a grid with this spacing, m.
pub(super) fn bodies(core: &Core, h: f64) -> (Vec<usize>, usize) {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A body of these particles of weight 1, some with a wall of λ = 0.2 and a normal near them, under the loads that
    /// a rigid acceleration gives.
    fn loaded(particles: &[(DVec3, Option<DVec3>)], along: DVec3, around: DVec3) -> Body {
        let weight = particles.len() as f64;
        let centre = particles.iter().map(|(x, _)| x).sum::<DVec3>() / weight;
        let mut body = Body { touches_wall: true, weight, centre, ..Body::NONE };
        for (x, normal) in particles {
            let away = x - centre;
            let force = along + around.cross(away);
            body.force += force / weight;
            body.torque += away.cross(force);
            let square = DMat3::from_cols(away * away.x, away * away.y, away * away.z);
            body.inertia += DMat3::from_diagonal(DVec3::splat(away.length_squared())) - square;
            if let Some(normal) = normal {
                let turn = away.cross(*normal);
                let motion = Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
                body.held += 0.2 * motion * motion.transpose();
            }
        }
        body
    }

    /// The places of a lattice in a ball or before a plane, with the normals that `wall` gives some of them.
    fn drop(wall: impl Fn(DVec3) -> Option<DVec3>) -> Vec<(DVec3, Option<DVec3>)> {
        let side = || (-4..=4).map(f64::from);
        let places = side().flat_map(|x| side().flat_map(move |y| side().map(move |z| DVec3::new(x, y, z))));
        let above = places.filter(|p| p.z >= 0.0 && p.length() < 4.5);
        above.map(|p| (p, wall(p))).collect()
    }

    /// What of a rigid load is taken off is the part that slides along the walls, but for what lies within 1/ρ.
    fn check(particles: &[(DVec3, Option<DVec3>)], load: [DVec3; 2], slides: [DVec3; 2]) {
        let (along, around) = loaded(particles, load[0], load[1]).slide().unwrap();
        assert!((along - slides[0]).length() < 0.01, "{along} for {}", slides[0]);
        assert!((around - slides[1]).length() < 0.01, "{around} for {}", slides[1]);
    }

    #[test]
    fn a_drop_slides_along_a_plane_and_turns_about_its_normal() {
        let on_plane = drop(|p| (p.z == 0.0).then_some(DVec3::Z));
        let free = [DVec3::new(1.0, -2.0, 0.0), DVec3::new(0.0, 0.0, 0.5)];
        check(&on_plane, free, free);
        let held = [DVec3::new(0.0, 0.0, 1.0), DVec3::new(0.3, -0.2, 0.0)];
        check(&on_plane, held, [DVec3::ZERO; 2]);
    }

    #[test]
    fn a_drop_on_a_ball_turns_about_its_middle() {
        let middle = DVec3::new(0.0, 0.0, -10.0);
        let on_ball = drop(|p| (p.z == 0.0).then(|| (p - middle).normalize()));
        let centre = on_ball.iter().map(|(x, _)| x).sum::<DVec3>() / on_ball.len() as f64;
        let around = DVec3::new(0.1, 0.05, 0.2);
        let turning = [around.cross(centre - middle), around];
        check(&on_ball, turning, turning);
    }

    #[test]
    fn a_drop_in_an_edge_slides_along_it_alone() {
        let normals = [DVec3::Z, DVec3::X];
        let in_edge = drop(|p| {
            let near = [p.z == 0.0, p.x <= -3.0];
            normals.into_iter().zip(near).find_map(|(normal, is_near)| is_near.then_some(normal))
        });
        let along = [DVec3::Y, DVec3::ZERO];
        check(&in_edge, along, along);
        check(&in_edge, [DVec3::new(1.0, 0.0, 1.0), DVec3::ZERO], [DVec3::ZERO; 2]);
    }

    #[test]
    fn one_particle_has_no_motion_to_take_off() {
        assert_eq!(loaded(&[(DVec3::ZERO, Some(DVec3::Z))], DVec3::X, DVec3::ZERO).slide(), None);
    }
}
