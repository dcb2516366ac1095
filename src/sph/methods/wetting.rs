//! How much of the walls near a particle is wet.
//!
//! A fluid under tension has a pressure up to its edge on a wall. A wall that took its whole part of a kernel
//! there would push the outermost row of particles off, as if the fluid went on beside the drop. So the wall takes as
//! much as the images of the fluid in it do ([`super::images`]). Where walls meet that are no mirrors of each other,
//! one image is too little, and there the fluid's own part of the kernel counts.

use std::ops::Range;

use fearless_simd::{Simd, SimdFloat};

use super::images::{self, COLUMNS, Image, Mirrors};
use crate::sph::{
    core::Core,
    kernel::Wendland,
    pairs::{PairPass, Real},
};

/// Sums of particles in disorder are this much less than those of a lattice, in parts. What is whole up to that is whole.
const DISORDER: f64 = 0.05;

/// Tells the core how wet the walls are that mirror the fluid.
pub(super) fn find(core: &mut Core, mirrors: &Mirrors) {
    if !mirrors.any() {
        return;
    }
    let h = core.parameters.support_radius;
    let kernel = Wendland::new(h);
    let parameters = &core.parameters;
    let volume = parameters.volume_in_sums();
    let whole = Wendland::lattice_sum(h / parameters.spacing());
    let pass = Fullness { kernel, weight: kernel.weight * volume / whole, mirrors, count: 0 };
    let mut wet = std::mem::take(&mut core.wet);
    wet.resize(core.particles.len(), 0.0);
    core.sum(&pass, mirrors.columns_after([]), [&mut wet]);
    core.wet = wet;
}

/// Sums the fluid and its images. It reads the planes of each particle.
#[derive(Clone, Copy)]
struct Fullness<'a> {
    kernel: Wendland,
    /// w·V over the sum of a lattice.
    weight: f64,
    mirrors: &'a Mirrors,
    /// Number of planes.
    count: usize,
}

impl PairPass<COLUMNS, 2, 1> for Fullness<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        planes: &[V; COLUMNS],
        _: [V; COLUMNS],
        sums: &mut [V; 2],
    ) {
        let of = V::Element::of;
        let weight = |r2: V| {
            let s = self.kernel.nearness(r2);
            let f = s * s;
            // 1 + 4q = 5 − 4s
            f * f * s.mul_add(of(-4.0), of(5.0))
        };
        let [fluid, images] = sums;
        *fluid += weight(r2);
        images::for_each(self.count, planes, Image { d, r2, direction: d }, |image| {
            *images += weight(image.r2);
        });
    }

    fn finish(&self, i: usize, sums: [f64; 2]) -> [f64; 1] {
        let Some(planes) = self.mirrors.near(i) else { return [1.0] };
        let wall = planes.filled;
        let [fluid, images] = sums.map(|sum| self.weight * sum);
        // in oblique corners and gaps more than half a kernel may lie behind walls, and then little fluid has room
        let wet = (images / wall).max(fluid / (1.0 - wall).max(wall));
        [((1.0 + DISORDER) * wet).min(1.0)]
    }

    fn for_block(self, particles: Range<usize>) -> Self {
        Self { count: self.mirrors.most(particles), ..self }
    }

    fn reads(&self) -> usize {
        images::columns_of(self.count)
    }
}
