//! The passes of pressure for a fluid that has images in the walls of a box.
//!
//! To a fluid under tension a wall is a mirror, and a body of fluid with its images is round ([`images`]). With walls that
//! continue a pressure linearly (see [`scheme`](super::scheme)) the pressure in the edge of such a body was not the one
//! that its tension needs: half a ball of water with a radius of 1 mm on a floor had 0.25 m/s after 20 ms, an eighth of
//! one in a corner 0.34, and a film of 0.8 mm in a box 0.20. With images they are whole balls and an endless film, and
//! have 0.05, 0.03 and 0.09 m/s.
//!
//! They are for a fluid that its tension rules, because they cost time: each neighbour of a particle near walls has one to
//! seven of them.
//!
//! The image of j in a plane is as far from i as that of i is from j, and ∇W is mirrored. So with mirrored velocities the
//! system is as symmetric as that of the fluid alone. This needs planes that are the same for both, which walls of the
//! box are; of an obstacle each particle has a plane of its own.

use std::ops::Range;

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;

use super::super::images::{self, COLUMNS, Image, WithImages};
use super::passes::{Densities, Push, Squeeze};
use crate::sph::pairs::{PairPass, Real};

impl PairPass<COLUMNS, 6, 8> for WithImages<'_, Densities<'_>> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        planes: &[V; COLUMNS],
        _: [V; COLUMNS],
        sums: &mut [V; 6],
    ) {
        let of = V::Element::of;
        let squares = sums[4];
        // |∇W|/c
        let steepness = |r2: V| {
            let s = self.pass.constants.kernel.nearness(r2);
            let f = s * s * s;
            // r = h·(1 − s)
            (f - f * s) * of(self.pass.constants.kernel.h)
        };
        let mut all = steepness(r2);
        self.pass.add(d, r2, &[], [], sums);
        images::for_each(self.count, planes, Image { d, r2, direction: d }, |Image { d, r2, .. }| {
            self.pass.add(d, r2, &[], [], sums);
            all += steepness(r2);
        });
        // A neighbour and its images answer together, at most with the sum of what each does; a particle's own images count
        // twice. So steps are rather too short. (With the sum of squares they were too long for particles in a corner,
        // and one of them left it at 17 m/s.)
        sums[4] = all.mul_add(all, squares);
    }

    fn finish(&self, i: usize, sums: [f64; 6]) -> [f64; 8] {
        let planes = self.mirrors.near(i).map_or(&[][..], |near| &near.each);
        let kernel = self.pass.constants.kernel;
        let of_image = |mirrored: usize| {
            let in_these = (0..planes.len()).filter(|k| mirrored >> k & 1 == 1);
            let way: DVec3 = in_these.map(|k| 2.0 * planes[k].distance * planes[k].normal).sum();
            // (1 − q)³, as in the sums
            way * (1.0 - way.length() / kernel.h).max(0.0).powi(3)
        };
        self.pass.results(i, sums, (1..1_usize << planes.len()).map(of_image).sum())
    }

    fn for_block(self, particles: Range<usize>) -> Self {
        self.in_block(particles)
    }

    fn reads(&self) -> usize {
        images::columns_of(self.count)
    }
}

impl PairPass<{ 1 + COLUMNS }, 3, 3> for WithImages<'_, Push<'_>> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 1 + COLUMNS],
        [other, ..]: [V; 1 + COLUMNS],
        sums: &mut [V; 3],
    ) {
        let (own, planes) = (&[own[0]], &own[1..]);
        self.pass.add(d, r2, own, [other], sums);
        images::for_each(self.count, planes, Image { d, r2, direction: d }, |Image { d, r2, .. }| {
            self.pass.add(d, r2, own, [other], sums);
        });
    }

    fn finish(&self, i: usize, sums: [f64; 3]) -> [f64; 3] {
        self.pass.finish(i, sums)
    }

    fn for_block(self, particles: Range<usize>) -> Self {
        self.in_block(particles)
    }

    fn reads(&self) -> usize {
        1 + images::columns_of(self.count)
    }
}

impl PairPass<{ 3 + COLUMNS }, 1, 1> for WithImages<'_, Squeeze<'_>> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 3 + COLUMNS],
        [x, y, z, ..]: [V; 3 + COLUMNS],
        sums: &mut [V; 1],
    ) {
        let (own, planes) = (&[own[0], own[1], own[2]], &own[3..]);
        self.pass.add(d, r2, own, [x, y, z], sums);
        let neighbour = Image { d, r2, direction: [x, y, z] };
        images::for_each(self.count, planes, neighbour, |Image { d, r2, direction }| {
            self.pass.add(d, r2, own, direction, sums);
        });
    }

    fn finish(&self, i: usize, sums: [f64; 1]) -> [f64; 1] {
        self.pass.finish(i, sums)
    }

    fn for_block(self, particles: Range<usize>) -> Self {
        self.in_block(particles)
    }

    fn reads(&self) -> usize {
        3 + images::columns_of(self.count)
    }
}
