//! Sums that are exact for a flow that is linear in space, for a fluid that fills its vessel.
//!
//! ```text
//! dρ_i/dt = −Σ m (v_i − v_j)·A_i ∇W        a_i = Σ m (s_i A_i + s_j A_j) ∇W
//! A = E·B⁻¹        B = −Σ V r⊗∇W, r = x_j − x_i        E = tr B/tr(1 − K)·(1 − K)
//! ```
//!
//! With A = 1 a flow with the gradient J has dρ/dt = −ρ J:B. An even fluid has B = b·1, and only the divergence tr J
//! counts. Particles in rows, and disordered ones, have more neighbours along some directions than along others. What
//! that leaves in B takes a shear for a compression, pressure opposes it, and has energy from it in proportion to its
//! level, which is as high in a full vessel as its lowest pressure demands. So Taylor–Green vortices, 24 spacings wide,
//! lost 45 % of their energy in the time in which they should lose 18 %, and 92 % where it should be 55; their lattice
//! took much of that when it broke. With the gradients corrected (Bonet & Lok 1999) they lose 18 and 52 %.
//!
//! Pressures act by the adjoint of the rate. So the system keeps its symmetry, pressure has no energy from a flow that it
//! need not change, and momentum is conserved in pairs. A turning fluid has J:E = 0, so that angular momentum is, too.
//!
//! Equal pressures no longer push particles to where there are fewer of them, as they do in pairs. So particles drift there
//! ([`shifting`](super::super::shifting)), without which they are in disorder and pressures noisy: the flow between two
//! cylinders, five spacings wide, is off by 1.9 % with it, and was by 4.6 % without and by 9.8 % with A = 1.
//!
//! Beside walls an even fluid has B = b·(1 − K), because they take K of it. What they stand for in both sums, with M,
//! rests on that.

use fearless_simd::{Simd, SimdFloat};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::passes::{Push, Squeeze};
use super::walls::Walls;
use crate::sph::{
    core::Core,
    kernel::Wendland,
    pairs::{PairPass, Real},
    particles::Vectors,
};

/// A particle whose det B is below this part of (⅓ tr B)³ has neighbours near a plane, and keeps A = 1. So the eigenvalues of
/// A are at most 11.
const FLAT: f64 = 0.2;

/// Where less than this of the trace of 1 − K is left, walls are all around a particle, and it keeps A = 1.
const LEAST_FREE: f64 = 0.1;

/// The corrections of all particles.
#[derive(Default)]
pub(super) struct Correction {
    /// A of each particle, entry by entry, column after column.
    entries: [Vec<f64>; 9],
    /// s·A, likewise.
    weighted: [Vec<f64>; 9],
}

impl Correction {
    /// Finds the corrections for the present positions.
    pub fn find(&mut self, core: &Core, walls: &Walls) {
        let parameters = &core.parameters;
        let kernel = Wendland::new(parameters.support_radius);
        self.entries.iter_mut().for_each(|column| column.resize(core.particles.len(), 0.0));
        let out = self.entries.each_mut().map(|column| &mut column[..]);
        core.sum(&Moments { kernel, walls }, [], out);
    }

    /// Finds the a(s) of `push`.
    pub fn push(&mut self, core: &Core, pass: Push<'_>, s: &[f64], push: &mut Vectors) {
        self.weighted.par_iter_mut().zip(&self.entries).for_each(|(weighted, entries)| {
            weighted.clear();
            weighted.extend(entries.iter().zip(s).map(|(entry, s)| entry * s));
        });
        let Vectors { x, y, z } = push;
        let columns = self.weighted.each_ref().map(|column| &column[..]);
        core.sum(&CorrectedPush { pass }, columns, [&mut x[..], y, z]);
    }

    /// Finds the dρ/dt of `squeeze`.
    pub fn rate(&self, core: &Core, pass: Squeeze<'_>, rate: &mut [f64]) {
        let Vectors { x, y, z } = pass.velocity;
        core.sum(&CorrectedSqueeze { pass, entries: &self.entries }, [&x[..], y, z], [rate]);
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.entries.iter().chain(&self.weighted).map(|column| 8 * column.capacity()).sum()
    }
}

/// The pass that finds A from Σ (1 − q)³ d⊗d. The factor between that and B does not count.
#[derive(Clone, Copy)]
struct Moments<'a> {
    kernel: Wendland,
    walls: &'a Walls,
}

impl PairPass<0, 6, 9> for Moments<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        _: &[V; 0],
        _: [V; 0],
        sums: &mut [V; 6],
    ) {
        let s = self.kernel.nearness(r2);
        let f = s * s * s;
        for k in 0..3 {
            let along = f * d[k];
            sums[k] = along.mul_add(d[k], sums[k]);
            sums[3 + k] = along.mul_add(d[(k + 1) % 3], sums[3 + k]);
        }
    }

    fn finish(&self, i: usize, [xx, yy, zz, xy, yz, zx]: [f64; 6]) -> [f64; 9] {
        let moment = DMat3::from_cols(DVec3::new(xx, xy, zx), DVec3::new(xy, yy, yz), DVec3::new(zx, yz, zz));
        let even = match self.walls.near(i) {
            Some((wall, _)) => DMat3::IDENTITY - wall.tensor().to_matrix(),
            None => DMat3::IDENTITY,
        };
        correction(moment, even).to_cols_array()
    }
}

/// A of a particle with this moment, where an even fluid has `even`, each up to a factor.
fn correction(moment: DMat3, even: DMat3) -> DMat3 {
    let trace = |m: &DMat3| m.x_axis.x + m.y_axis.y + m.z_axis.z;
    let [found, expected] = [&moment, &even].map(trace);
    let is_flat = !(found > 0.0 && moment.determinant() > FLAT * (found / 3.0).powi(3));
    let is_free = expected > LEAST_FREE;
    if is_flat || !is_free {
        return DMat3::IDENTITY;
    }
    found / expected * even * moment.inverse()
}

/// The pass that finds a(s), from the columns of s·A.
#[derive(Clone, Copy)]
struct CorrectedPush<'a> {
    pass: Push<'a>,
}

impl PairPass<9, 3, 3> for CorrectedPush<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 9],
        other: [V; 9],
        sums: &mut [V; 3],
    ) {
        let s = self.pass.constants.kernel.nearness(r2);
        let f = s * s * s;
        for l in 0..3 {
            let along = f * d[l];
            for k in 0..3 {
                sums[k] = (own[3 * l + k] + other[3 * l + k]).mul_add(along, sums[k]);
            }
        }
    }

    fn finish(&self, i: usize, sums: [f64; 3]) -> [f64; 3] {
        self.pass.finish(i, sums)
    }
}

/// The pass that finds dρ/dt.
#[derive(Clone, Copy)]
struct CorrectedSqueeze<'a> {
    pass: Squeeze<'a>,
    entries: &'a [Vec<f64>; 9],
}

impl PairPass<3, 9, 1> for CorrectedSqueeze<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 3],
        other: [V; 3],
        sums: &mut [V; 9],
    ) {
        let s = self.pass.constants.kernel.nearness(r2);
        let f = s * s * s;
        let parting: [V; 3] = std::array::from_fn(|k| own[k] - other[k]);
        for l in 0..3 {
            let along = f * d[l];
            for k in 0..3 {
                sums[3 * l + k] = along.mul_add(parting[k], sums[3 * l + k]);
            }
        }
    }

    fn finish(&self, i: usize, sums: [f64; 9]) -> [f64; 1] {
        let sum = self.entries.iter().zip(sums).map(|(entries, sum)| entries[i] * sum).sum();
        self.pass.finish(i, [sum])
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::correction;

    /// An uneven moment: positive, not along the axes.
    fn moment() -> DMat3 {
        let turn = DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(1.1);
        turn * DMat3::from_diagonal(DVec3::new(1.3, 0.9, 0.7)) * turn.transpose()
    }

    /// J:(A·B) is what a flow with the gradient J makes of the density.
    fn answer(flow: DMat3, corrected: DMat3) -> f64 {
        let product = flow.transpose() * corrected;
        product.x_axis.x + product.y_axis.y + product.z_axis.z
    }

    #[test]
    fn a_shear_and_a_turn_are_no_compression() {
        let shear = DMat3::from_cols(
            DVec3::new(1.0, 0.3, 0.0),
            DVec3::new(2.0, -0.4, 0.5),
            DVec3::new(0.1, 0.7, -0.6),
        );
        let corrected = correction(moment(), DMat3::IDENTITY) * moment();
        assert!(answer(shear, moment()).abs() > 0.1 && answer(shear, corrected).abs() < 1e-12);
        // a uniform compression counts as before
        let shrinking = answer(DMat3::IDENTITY, corrected);
        assert!((shrinking - answer(DMat3::IDENTITY, moment())).abs() < 1e-12, "{shrinking}");
    }

    /// In an even fluid beside walls nothing changes, and in an uneven one the fluid's part is that of an even one.
    #[test]
    fn beside_walls_a_fluid_counts_as_if_it_was_even() {
        let even =
            DMat3::from_cols(DVec3::new(0.4, 0.1, 0.0), DVec3::new(0.1, 0.5, 0.0), DVec3::new(0.0, 0.0, 0.7));
        assert!(correction(0.3 * even, even).abs_diff_eq(DMat3::IDENTITY, 1e-12));
        let uneven = even + 0.05 * (moment() - DMat3::IDENTITY);
        let corrected = correction(uneven, even) * uneven;
        let part = answer(DMat3::IDENTITY, uneven) / answer(DMat3::IDENTITY, even);
        assert!(corrected.abs_diff_eq(part * even, 1e-12));
        let turning = DMat3::from_cols(
            DVec3::new(0.0, 1.0, -2.0),
            DVec3::new(-1.0, 0.0, 3.0),
            DVec3::new(2.0, -3.0, 0.0),
        );
        assert!(answer(turning, corrected).abs() < 1e-12);
    }

    #[test]
    fn particles_in_a_plane_or_alone_are_left_as_they_are() {
        for diagonal in [DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 1.0, f64::NAN)] {
            assert_eq!(correction(DMat3::from_diagonal(diagonal), DMat3::IDENTITY), DMat3::IDENTITY);
        }
        assert_eq!(correction(moment(), DMat3::ZERO), DMat3::IDENTITY);
    }
}
