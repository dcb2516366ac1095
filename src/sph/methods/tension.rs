//! Surface tension as a force on the layer of particles at the surface (Brackbill et al. 1992), for a fluid
//! without an outer phase.
//!
//! ```text
//! n_i = Σ V ∇W + ∇λ          into the fluid, of the length A(δ)/h at the depth δh below a flat surface
//! κ_i = −∇·(n/|n|)           Σ over neighbours with a normal, divided by the sum's own tangential moment
//! a_i = (2σ/ρ₀)·κ_i·n_i
//! ```
//!
//! Only half of ∫|∇c| across the surface lies within the fluid, hence the factor 2. With it the pressure of a
//! closed drop jumps by σκ. The sums for κ are one-sided, like the fluid, so they are divided by their own
//! tangential moment Σ V c f·½(r² − (r·n̂)²). This is exact where the normals turn evenly. (Sirotkin & Yoh
//! 2012 renormalise the full matrix.)
//!
//! Walls count as fluid: a surface meets a wall at a right angle. The forces on a body of fluid that touches
//! no wall have neither a resultant nor a torque ([`free_bodies`]).

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;

use super::crowding::Crowding;
use super::free_bodies;
use crate::sph::{
    core::Core,
    pairs::{PairPass, Real},
    params::Parameters,
    particles::{Vectors, add_scaled},
};

/// Limits of |n|·h. Below the first a particle has no normal; above the second it has a full one. A flat
/// surface has 1.5 where the particle lies in it, and noise in the depth has about 0.05.
const NORMAL: [f64; 2] = [0.1, 0.3];

/// A neighbourhood with less than this part of a full tangential moment has no curvature.
const LEAST_MOMENT: f64 = 0.05;

/// The stage that adds surface tension, with its working memory.
#[derive(Default)]
pub(super) struct Tension {
    /// n̂ times its weight.
    direction: Vectors,
    /// Weight of the normal, 0 to 1.
    weight: Vec<f64>,
    /// Normals n, 1/m.
    normal: Vectors,
    force: Vectors,
}

impl Tension {
    /// Adds the accelerations by surface tension, if the fluid has any.
    pub fn act(&mut self, core: &mut Core) {
        let parameters = &core.parameters;
        if parameters.surface_tension == 0.0 {
            return;
        }
        let n = core.particles.len();
        for vectors in [&mut self.direction, &mut self.normal, &mut self.force] {
            vectors.resize(n);
        }
        self.weight.resize(n, 0.0);
        let crowding = Crowding::of(parameters);

        let pass = Normals { crowding, core };
        let (Vectors { x, y, z }, Vectors { x: dx, y: dy, z: dz }) = (&mut self.normal, &mut self.direction);
        core.sum(&pass, [], [x, y, z, dx, dy, dz, &mut self.weight]);

        let pass = Curvature { crowding, parameters, normal: &self.normal, weight: &self.weight };
        let Vectors { x: dx, y: dy, z: dz } = &self.direction;
        let Vectors { x, y, z } = &mut self.force;
        core.sum(&pass, [&dx[..], dy, dz, &self.weight], [x, y, z]);

        free_bodies::balance(core, &mut self.force, &self.weight);
        add_scaled(&mut core.acceleration, &self.force, 1.0);
    }

    pub fn bytes(&self) -> usize {
        [&self.direction, &self.normal, &self.force].map(Vectors::bytes).iter().sum::<usize>()
            + 8 * self.weight.capacity()
    }
}

/// Finds n, n̂ and its weight.
#[derive(Clone, Copy)]
struct Normals<'a> {
    crowding: Crowding,
    core: &'a Core,
}

impl PairPass<0, 3, 7> for Normals<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        _: &[V; 0],
        _: [V; 0],
        sums: &mut [V; 3],
    ) {
        self.crowding.add(d, r2, sums);
    }

    fn finish(&self, i: usize, sums: [f64; 3]) -> [f64; 7] {
        let mut normal = self.crowding.total(sums);
        if let Some(wall) = self.core.coverage::<()>(i) {
            normal += wall.gradient;
        }
        let length = normal.length();
        let [none, full] = NORMAL;
        let weight = ((length * self.crowding.kernel.h - none) / (full - none)).clamp(0.0, 1.0);
        let direction = if weight > 0.0 { normal / length } else { DVec3::ZERO };
        [normal.x, normal.y, normal.z, direction.x, direction.y, direction.z, weight]
    }
}

/// Finds the acceleration by surface tension.
#[derive(Clone, Copy)]
struct Curvature<'a> {
    crowding: Crowding,
    parameters: &'a Parameters,
    normal: &'a Vectors,
    weight: &'a [f64],
}

impl PairPass<4, 2, 3> for Curvature<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 4],
        other: [V; 4],
        sums: &mut [V; 2],
    ) {
        let s = self.crowding.kernel.nearness(r2);
        let f = s * s * s * other[3];
        let turn = (other[0] - own[0]) * d[0];
        let turn = (other[1] - own[1]).mul_add(d[1], turn);
        let turn = (other[2] - own[2]).mul_add(d[2], turn);
        let along = own[2].mul_add(d[2], own[1].mul_add(d[1], own[0] * d[0]));
        sums[0] = f.mul_add(turn, sums[0]);
        sums[1] = f.mul_add(r2 - along * along, sums[1]);
    }

    fn finish(&self, i: usize, [turn, moment]: [f64; 2]) -> [f64; 3] {
        let normal = self.normal.get(i);
        let moment = 0.5 * self.crowding.steepness * moment;
        if moment < LEAST_MOMENT {
            return [0.0; 3];
        }
        // with d from the neighbour, ∇·n̂ = −Σ V (n̂_j − n̂_i)·cf·d over the moment
        let curvature = self.crowding.steepness * turn / moment;
        let Parameters { surface_tension, rest_density, .. } = *self.parameters;
        (2.0 * surface_tension / rest_density * self.weight[i] * curvature * normal).to_array()
    }
}
