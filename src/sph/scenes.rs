//! Scenes that the tests of this module share.

use std::sync::Arc;

use glam::DVec3;
use rand_pcg::{
    Pcg64,
    rand_core::{Rng, SeedableRng},
};

use crate::{
    field::{Closures, Walls},
    geom::Aabb,
};

use super::{FluidBlock, Obstacle, Parameters, Particles, Simulation, Vectors, carve};

/// The paper's container.
pub const BOX: Aabb = Aabb::new(DVec3::ZERO, DVec3::splat(3.0));

/// A box far from everything.
const SPACE: Aabb = Aabb::new(DVec3::splat(-1e3), DVec3::splat(1e3));

/// Points in a cube of this side around the origin, evenly distributed at random.
pub fn random_cloud(count: usize, side: f64) -> Vectors {
    let mut random = Pcg64::seed_from_u64(count as u64);
    let mut number = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
    let mut cloud = Vectors::default();
    for _ in 0..count {
        cloud.push(side * DVec3::new(number(), number(), number()));
    }
    cloud
}

/// A simulation of particles, given by position and velocity, far from all walls.
pub fn free(parameters: Parameters, particles: &[(DVec3, DVec3)]) -> Simulation {
    let mut fluid = Particles::default();
    for &(position, velocity) in particles {
        fluid.push(position, velocity);
    }
    Simulation::new(parameters, fluid, SPACE, Vec::new()).unwrap()
}

/// A simulation of particles with random positions in a cube and random velocities, far from all walls.
pub fn free_cloud(parameters: Parameters, count: usize, side: f64) -> Simulation {
    let velocity = random_cloud(count + 1, 2.0);
    let cloud: Vec<_> = random_cloud(count, side).iter().zip(velocity.iter()).collect();
    free(parameters, &cloud)
}

/// A simulation of a drop at rest, far from all walls.
pub fn free_drop(parameters: Parameters, count: usize) -> Simulation {
    let drop = FluidBlock::drop(DVec3::ZERO, count).seed(&parameters, SPACE).unwrap();
    Simulation::new(parameters, drop, SPACE, Vec::new()).unwrap()
}

/// (R² − r²)/2R: gradient of length one on the surface, none at the centre.
pub fn sphere(centre: DVec3, radius: f64) -> Arc<dyn Walls> {
    Arc::new(Closures {
        omega: move |p: DVec3| (radius * radius - p.distance_squared(centre)) / (2.0 * radius),
        gradient: move |p: DVec3| (centre - p) / radius,
    })
}

/// The half-space below the plane through the origin with this unit normal.
pub fn half_space(origin: DVec3, normal: DVec3) -> Arc<dyn Walls> {
    Arc::new(Closures { omega: move |p: DVec3| (origin - p).dot(normal), gradient: move |_: DVec3| -normal })
}

/// An R₀ operation with its gradient; at 0 the gradient is one symmetric member of the limits.
fn r0(sign: f64, (u, du): (f64, DVec3), (v, dv): (f64, DVec3)) -> (f64, DVec3) {
    let h = u.hypot(v);
    let (a, b) = if h > 0.0 { (u / h, v / h) } else { (0.0, 0.0) };
    (u + v + sign * h, du * (1.0 + sign * a) + dv * (1.0 + sign * b))
}

/// The paper's pawn, equation (5).
pub fn pawn() -> Arc<dyn Walls> {
    let both = |p: DVec3| {
        let (x, y, z) = (p.x - 1.5, p.y - 1.5, p.z);
        let r2 = x * x + y * y;
        let ring = DVec3::new(2.0 * x, 2.0 * y, 0.0);
        let w1 = (0.25 - r2, -ring);
        let w2 = (z * (1.0 - z), DVec3::Z * (1.0 - 2.0 * z));
        let w3 = (1.0 - 20.0 * r2 + 10.0 * (z - 0.75).powi(2), -20.0 * ring + DVec3::Z * 20.0 * (z - 0.75));
        let w4 = (0.125 - r2 - 20.0 * (1.0 - z).powi(2), -ring + DVec3::Z * 40.0 * (1.0 - z));
        let w5 = (0.05 - r2 - (1.25 - z).powi(2), -ring + DVec3::Z * 2.0 * (1.25 - z));
        let (and, or) = (-1.0, 1.0);
        r0(or, r0(and, r0(and, w1, w2), w3), r0(or, w4, w5))
    };
    Arc::new(Closures { omega: move |p: DVec3| both(p).0, gradient: move |p: DVec3| both(p).1 })
}

/// A field as an obstacle at rest.
pub fn obstacle(field: &Arc<dyn Walls>) -> Obstacle {
    Obstacle::at_rest(field.clone(), 0.005)
}

/// A drop of the paper's fluid above the pawn. Its lowest point is near the pawn's head.
pub fn drop_on(pawn: &Arc<dyn Walls>, parameters: Parameters, count: usize) -> Simulation {
    let mut drop = FluidBlock::drop(DVec3::new(1.5, 1.5, 2.2), count).seed(&parameters, BOX).unwrap();
    carve(&mut drop, &BOX, &[obstacle(pawn)], 0.0).unwrap();
    Simulation::new(parameters, drop, BOX, vec![obstacle(pawn)]).unwrap()
}
