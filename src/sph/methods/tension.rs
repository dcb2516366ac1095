//! Surface tension as a force on the layer of particles at the surface (Brackbill et al. 1992), for a fluid
//! without an outer phase.
//!
//! ```text
//! n_i = Σ V ∇W               into the fluid, of the length A(δ)/h at the depth δh below a flat surface
//! κ_i = −∇·(n/|n|)           Σ over neighbours with a normal, divided by the sum's own tangential moment
//! a_i = (2σ/ρ₀)·κ·n_i/L
//! ```
//!
//! κ and L ([`Layer`]) depend on how pressures push the particles of a surface. In a compressed fluid they act in
//! pairs, and a pressure p that is the same everywhere pushes by −2p·n_i/ρ₀. So p = σκ balances the tension of the
//! particles with a full normal, if κ is the curvature of the surface; that of the layer below it, κ_i, is larger.
//! (With κ_i the pressure in a drop was 8 % too high at h/R = 0.385, and the square of the rate at which it swings was
//! too large by twice that part.) Where the solver keeps the density, a surface counts as filled and bears no pressure.
//! There the work of the tension decides, ∫ 2σκ_i·n_i·v over the layer. In a drop that swings κ_i is larger as the
//! layer is nearer to the middle, but the layer has less area and moves less, and all of that cancels.
//!
//! The sums for κ_i are one-sided, like the fluid, so they are divided by their own tangential moment
//! Σ V c f·½(r² − (r·n̂)²). This is exact where the normals turn evenly. (Sirotkin & Yoh 2012 renormalise the full
//! matrix.)
//!
//! A surface meets a wall at a right angle: for n, n̂ and κ the fluid has images in the walls ([`super::images`]), and
//! what its edge takes of the walls follows from them, too ([`super::wetting`]). (With the whole wall, which goes on
//! beside a drop as well as below it, drops spread until they were a layer thin, and fell apart. Curvature from the
//! fluid alone, whose sums are one-sided near a wall, made the edges of a still hemisphere leap within a few steps.)
//! Where walls are no mirrors, in the edges of an obstacle, n is Σ V ∇W + ∇λ with the wet part of the walls. Beside
//! them the tension acts along the wall: what it has across it, by the noise of n, would press particles into the wall.
//!
//! The forces on a body of fluid that touches no wall have neither a resultant nor a torque, and those on one that
//! does move it along none of its walls ([`bodies_of_fluid`]).

use std::{ops::Range, sync::Arc};

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;

use super::{
    bodies_of_fluid,
    crowding::Crowding,
    images::{self, COLUMNS, Image, Mirrors, Plane, WithImages},
    wetting,
};
use crate::sph::{
    core::Core,
    kernel::Wendland,
    pairs::{PairPass, Real},
    params::Parameters,
    particles::{Vectors, add_scaled},
};

/// Limits of |n|·h. Below the first a particle has no normal; above the second it has a full one. A flat
/// surface has 1.5 where the particle lies in it, and noise in the depth has about 0.05.
const NORMAL: [f64; 2] = [0.1, 0.3];

/// Layers of a lattice below which no particle has a normal.
const LAYERS: u32 = 4;

/// A layer that finds less than this part of its tension has too few neighbours for that to be told from a lattice.
const LEAST_WHOLE: f64 = 0.5;

/// A neighbourhood with less than this part of a full tangential moment has no curvature.
const LEAST_MOMENT: f64 = 0.05;

/// By how much of itself, over hκ, the curvature of a layer of particles counts as too large, where pressures act in
/// pairs. The layer lies nearer to the middle of a drop than the surface does. By quadrature of the sums over balls
/// with h/R of 0.15 to 0.39 its curvature is 0.149 to 0.171 too large. With that the pressure of a drop at rest is
/// within 1 %, but its swings are 2 to 6 % slow (8000 to 1500 particles), because their work is that of the layer. With
/// 0.11 the pressure is 4 to 3 % too high, and periods are within 1 % from 2000 particles on.
const DEPTH: f64 = 0.11;

/// What [`NORMAL`] leaves of ∫|n| across a flat surface.
const WITH_NORMAL: f64 = 0.963;

/// −hκ of the narrowest hollow for which that is meant. Narrower ones have its correction.
const DEEPEST: f64 = 1.2;

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
    mirrors: Arc<Mirrors>,
}

impl Tension {
    /// Finds which walls are wet, once the particles are sorted, if the fluid is under tension.
    pub fn find_wet_walls(&mut self, core: &mut Core) {
        if core.parameters.surface_tension != 0.0 {
            // the table is lent to walls, which find theirs after this
            if Arc::get_mut(&mut self.mirrors).is_none() {
                self.mirrors = Arc::default();
            }
            if let Some(mirrors) = Arc::get_mut(&mut self.mirrors) {
                mirrors.find(core);
            }
            wetting::find(core, &self.mirrors);
        }
    }

    /// Adds the accelerations by surface tension, if the fluid has any.
    pub fn act(&self, core: &mut Core) {
        if let Some(force) = self.force(&core.parameters) {
            add_scaled(&mut core.acceleration, force, 1.0);
        }
    }

    /// Finds the accelerations by surface tension, if the fluid has any.
    pub fn find(&mut self, core: &Core) {
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

        let mirrors = self.mirrors.any().then_some(&self.mirrors);

        let pass = Normals { crowding, core };
        let (Vectors { x, y, z }, Vectors { x: dx, y: dy, z: dz }) = (&mut self.normal, &mut self.direction);
        let out = [&mut x[..], y, z, dx, dy, dz, &mut self.weight];
        match mirrors {
            Some(mirrors) => core.sum(&WithImages::new(pass, mirrors), mirrors.columns_after([]), out),
            None => core.sum(&pass, [], out),
        }

        let layer = Layer::of(parameters);
        let (normal, weight) = (&self.normal, &self.weight);
        let pass = Curvature { crowding, layer, parameters, normal, weight };
        let Vectors { x: dx, y: dy, z: dz } = &self.direction;
        let Vectors { x, y, z } = &mut self.force;
        let (direction, out) = ([&dx[..], dy, dz, &self.weight], [&mut x[..], y, z]);
        match mirrors {
            Some(mirrors) => {
                core.sum(&WithImages::new(pass, mirrors), mirrors.columns_after(direction), out);
            }
            None => core.sum(&pass, direction, out),
        }

        bodies_of_fluid::balance(core, &self.mirrors, &mut self.force, &self.weight);
    }

    /// The accelerations that the last [`Self::find`] found, m/s²; `None` for a fluid without tension.
    pub fn force(&self, parameters: &Parameters) -> Option<&Vectors> {
        (parameters.surface_tension != 0.0).then_some(&self.force)
    }

    /// The walls as mirrors; `None` if none is near any particle.
    pub fn mirrors(&self) -> Option<&Arc<Mirrors>> {
        self.mirrors.any().then_some(&self.mirrors)
    }

    /// Whether one of these particles belongs to the surface.
    pub fn any_at_surface(&self, particles: Range<usize>) -> bool {
        any_at_surface(&self.weight, particles)
    }

    /// n of a particle near walls that mirror the fluid, 1/m, with its weight; `None` for others, and in the depth.
    pub fn at_mirrors(&self, i: usize) -> Option<(DVec3, f64)> {
        let weight = self.weight[i];
        let is_at_mirrors = weight > 0.0 && self.mirrors.near(i).is_some_and(|near| near.are_mirrors);
        is_at_mirrors.then(|| (self.normal.get(i), weight))
    }

    pub fn bytes(&self) -> usize {
        [&self.direction, &self.normal, &self.force].map(Vectors::bytes).iter().sum::<usize>()
            + 8 * self.weight.capacity()
            + self.mirrors.bytes()
    }
}

/// Whether one of some particles, which follow one another, has a weight at the surface.
fn any_at_surface(weight: &[f64], particles: Range<usize>) -> bool {
    weight[particles].iter().any(|weight| *weight > 0.0)
}

/// Columns of directions with their weights, and of planes.
const DIRECTED: usize = 4 + COLUMNS;

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

    fn finish(&self, _: usize, sums: [f64; 3]) -> [f64; 7] {
        let normal = self.crowding.total(sums);
        self.results(normal, normal)
    }
}

impl Normals<'_> {
    /// The results of a particle: n, n̂ along another vector, and its weight.
    fn results(&self, normal: DVec3, along: DVec3) -> [f64; 7] {
        let weight = weight_of(normal.length() * self.crowding.kernel.h);
        let direction = if weight > 0.0 { along.normalize_or_zero() } else { DVec3::ZERO };
        [normal.x, normal.y, normal.z, direction.x, direction.y, direction.z, weight]
    }
}

impl PairPass<COLUMNS, 6, 7> for WithImages<'_, Normals<'_>> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        planes: &[V; COLUMNS],
        _: [V; COLUMNS],
        [fx, fy, fz, ix, iy, iz]: &mut [V; 6],
    ) {
        let crowding = self.pass.crowding;
        let (mut fluid, mut images) = ([*fx, *fy, *fz], [*ix, *iy, *iz]);
        crowding.add(d, r2, &mut fluid);
        images::for_each(self.count, planes, Image { d, r2, direction: d }, |Image { d, r2, .. }| {
            crowding.add(d, r2, &mut images);
        });
        ([*fx, *fy, *fz], [*ix, *iy, *iz]) = (fluid, images);
    }

    fn finish(&self, i: usize, [fx, fy, fz, ix, iy, iz]: [f64; 6]) -> [f64; 7] {
        let Normals { crowding, core } = self.pass;
        let fluid = crowding.total([fx, fy, fz]);
        let both = fluid + crowding.total([ix, iy, iz]);
        let Some(oblique) = self.mirrors.near(i).filter(|near| !near.are_mirrors) else {
            return self.pass.results(both, both);
        };
        // images do not fill the kernel, and the wall does
        let normal = fluid + core.coverage::<()>(i).map_or(DVec3::ZERO, |wall| wall.gradient);
        let Plane { normal: across, distance } = oblique.each[0];
        // a layer at rest lies half a spacing from its wall, and the next one is free
        let held = (1.5 - distance / core.parameters.spacing()).clamp(0.0, 1.0);
        self.pass.results(normal - held * normal.dot(across) * across, both)
    }

    fn for_block(self, particles: Range<usize>) -> Self {
        self.in_block(particles)
    }

    fn reads(&self) -> usize {
        images::columns_of(self.count)
    }
}

/// Finds the acceleration by surface tension.
#[derive(Clone, Copy)]
struct Curvature<'a> {
    crowding: Crowding,
    layer: Layer,
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
        self.bend(d, r2, own, other, sums);
    }

    fn finish(&self, i: usize, [turn, moment]: [f64; 2]) -> [f64; 3] {
        let normal = self.normal.get(i);
        let moment = 0.5 * self.crowding.steepness * moment;
        if moment < LEAST_MOMENT {
            return [0.0; 3];
        }
        // with d from the neighbour, ∇·n̂ = −Σ V (n̂_j − n̂_i)·cf·d over the moment
        let curvature = self.crowding.steepness * turn / moment;
        let h = self.crowding.kernel.h;
        let curvature = self.layer.curvature(curvature * h) / h;
        let Parameters { surface_tension, rest_density, .. } = *self.parameters;
        (2.0 * surface_tension / rest_density * self.weight[i] * curvature / self.layer.whole * normal)
            .to_array()
    }
}

/// How the layer of particles at a surface bears the tension.
#[derive(Debug, Clone, Copy)]
struct Layer {
    /// By how much of itself, over hκ, the curvature that counts is smaller than the layer's own.
    depth: f64,
    /// L, the part of a flat surface's tension that sums over the layer find.
    whole: f64,
}

impl Layer {
    fn of(parameters: &Parameters) -> Self {
        if !parameters.method.numerics().keeps_density() {
            return Self { depth: DEPTH, whole: WITH_NORMAL };
        }
        let ratio = parameters.support_radius / parameters.spacing();
        let layers = (0..LAYERS).map(|layer| Wendland::lattice_surface(ratio, layer).normal);
        // half of ∫|n| lies within the fluid
        let whole = 2.0 / ratio * layers.map(|normal| normal * weight_of(normal)).sum::<f64>();
        Self { depth: 0.0, whole: whole.max(LEAST_WHOLE) }
    }

    /// The curvature that counts, times h, from that of the layer, times h: the u of u·(1 + depth·u) = told.
    fn curvature(&self, told: f64) -> f64 {
        2.0 * told / (1.0 + (1.0 + 4.0 * self.depth * told.max(-DEEPEST)).sqrt())
    }
}

/// The weight of a normal whose length times h is given, 0 to 1.
fn weight_of(normal: f64) -> f64 {
    let [none, full] = NORMAL;
    ((normal - none) / (full - none)).clamp(0.0, 1.0)
}

impl Curvature<'_> {
    /// Adds a neighbour with the direction n̂ and its weight.
    #[inline(always)]
    fn bend<S: Simd, V: SimdFloat<S, Element: Real>>(
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
}

impl PairPass<DIRECTED, 2, 3> for WithImages<'_, Curvature<'_>> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; DIRECTED],
        [x, y, z, weight, ..]: [V; DIRECTED],
        sums: &mut [V; 2],
    ) {
        let (own, planes) = (&[own[0], own[1], own[2], own[3]], &own[4..]);
        self.pass.bend(d, r2, own, [x, y, z, weight], sums);
        let neighbour = Image { d, r2, direction: [x, y, z] };
        images::for_each(self.count, planes, neighbour, |Image { d, r2, direction: [x, y, z] }| {
            self.pass.bend(d, r2, own, [x, y, z, weight], sums);
        });
    }

    fn finish(&self, i: usize, sums: [f64; 2]) -> [f64; 3] {
        self.pass.finish(i, sums)
    }

    fn for_block(self, particles: Range<usize>) -> Self {
        // in the depth curvature does nothing
        if any_at_surface(self.pass.weight, particles.clone()) { self.in_block(particles) } else { self }
    }

    fn reads(&self) -> usize {
        4 + images::columns_of(self.count)
    }
}
