//! Fluid under tension at its edge on a wall.
//!
//! There a wall takes only a part of what it takes of a whole fluid. The tension there is that of the fluid with its
//! images in the walls ([`super::super::images`]), so an even pressure pushes by these images, too, and what the fluid
//! loses by flowing along the walls is counted with them. (With what the walls take in the place of the images,
//! pressures and tension did work on each other: a hemisphere of water with a radius of 1 mm on a floor rose from it in
//! 15 ms, and a flat film in a dish of 2 mm threw drops at 1.1 m/s.)

use std::ops::Range;

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;

use super::super::{
    images::{self, COLUMNS, Image, Mirrors},
    tension::Tension,
};
use crate::sph::{
    core::Core,
    kernel::Wendland,
    pairs::{PairPass, Real},
    particles::Vectors,
};

/// Columns of velocities of the fluid and of the walls, and of planes.
const VELOCITIES: usize = 6 + COLUMNS;

/// What is known of a particle at an edge.
#[derive(Clone, Copy)]
pub(super) struct Edge {
    /// Σ V ∇W over the fluid and its images, 1/m.
    pub normal: DVec3,
    /// How far the particle belongs to the surface, 0 to 1.
    pub weight: f64,
    /// Σ (v_i − v_j)·V∇W over the images, 1/s.
    pub compression: f64,
}

/// The edges of a fluid under tension.
#[derive(Clone, Copy)]
pub(super) struct Edges<'a> {
    tension: &'a Tension,
    compression: &'a [f64],
}

impl<'a> Edges<'a> {
    /// Finds the edges for these velocities; `None` if no wall is near any particle, or nothing is under tension.
    /// `compression` is working memory.
    pub fn find(
        core: &Core,
        tension: &'a Tension,
        velocity: &Vectors,
        compression: &'a mut Vec<f64>,
    ) -> Option<Self> {
        let mirrors = tension.mirrors()?;
        compression.resize(core.particles.len(), 0.0);
        let kernel = Wendland::new(core.parameters.support_radius);
        let steepness = core.parameters.volume_in_sums() * kernel.steepness;
        let pass = Compression { kernel, steepness, tension, mirrors, count: 0 };
        let (Vectors { x, y, z }, Vectors { x: wx, y: wy, z: wz }) = (velocity, &mirrors.velocity);
        core.sum(&pass, mirrors.columns_after([&x[..], y, z, wx, wy, wz]), [compression]);
        Some(Self { tension, compression })
    }

    /// What is known of a particle; `None` if it is not at an edge.
    pub fn at(&self, i: usize) -> Option<Edge> {
        let (normal, weight) = self.tension.at_mirrors(i)?;
        Some(Edge { normal, weight, compression: self.compression[i] })
    }
}

/// The pass over pairs.
#[derive(Clone, Copy)]
struct Compression<'a> {
    kernel: Wendland,
    /// V·c, 1/m².
    steepness: f64,
    tension: &'a Tension,
    mirrors: &'a Mirrors,
    /// Number of planes.
    count: usize,
}

impl PairPass<VELOCITIES, 1, 1> for Compression<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; VELOCITIES],
        [vx, vy, vz, ..]: [V; VELOCITIES],
        [departing]: &mut [V; 1],
    ) {
        let [x, y, z, wx, wy, wz, planes @ ..] = own;
        // a wall that moves mirrors velocities as they are seen from it
        let neighbour = Image { d, r2, direction: [vx - *wx, vy - *wy, vz - *wz] };
        images::for_each(self.count, planes, neighbour, |Image { d, r2, direction }| {
            let s = self.kernel.nearness(r2);
            let along = (*x - *wx - direction[0]) * d[0];
            let along = (*y - *wy - direction[1]).mul_add(d[1], along);
            let along = (*z - *wz - direction[2]).mul_add(d[2], along);
            *departing = (s * s * s).mul_add(along, *departing);
        });
    }

    fn finish(&self, _: usize, [departing]: [f64; 1]) -> [f64; 1] {
        [-self.steepness * departing]
    }

    fn for_block(self, particles: Range<usize>) -> Self {
        let at_surface = self.tension.any_at_surface(particles.clone());
        Self { count: if at_surface { self.mirrors.most(particles) } else { 0 }, ..self }
    }

    fn reads(&self) -> usize {
        if self.count > 0 { 6 + images::columns_of(self.count) } else { 0 }
    }
}
