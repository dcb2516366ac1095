//! The sums over neighbours, from which [`Rates`] finds what each particle does.

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;

use super::super::{crowding::Crowding, free_surface::FreeSurface, roughness};
use super::linear::Linear;
use super::rates::{Contents, Rates, Sums};
use crate::sph::{
    core::Core,
    pairs::{PairPass, Real},
    walls::Symmetric,
};

/// Squares of distances below this part of h² do not count as a direction.
const LEAST_DISTANCE: f64 = 1e-6;

/// Number of sums of [`Pairs`].
const SUMS: usize = 16;

/// Number of sums of [`Shifted`], which those of Σ f·d⊗d follow.
const SHIFTED_SUMS: usize = SUMS + 3;

/// Number of sums of [`Differences`]: those, and two symmetric tensors whose traces they contain.
const DIFFERENCES_SUMS: usize = SHIFTED_SUMS + 10;

/// Components of a symmetric tensor besides zz, which follows from the trace.
const COMPONENTS: [(usize, usize); 5] = [(0, 0), (1, 1), (1, 2), (2, 0), (0, 1)];

/// The pass over pairs, with or without laminar viscosity, artificial viscosity and crowding. With f =
/// (1 − q)³ and d from the neighbour it sums f·(p_j − p_i + Π)·d, f·(v_i − v_j)·d, f·(ρ_j − ρ_i), f·d, f·d²,
/// W, f·((v_j − v_i)·d)·d/d² (unless viscous forces come with the spin) and W·v_j, where the artificial
/// viscosity Π is that of rough velocities. Without crowding it sums p_j + p_i instead of p_j − p_i, and omits f·d and f·d².
#[derive(Clone, Copy)]
pub(super) struct Pairs<'a, const LAMINAR: bool, const ARTIFICIAL: bool, const EVEN: bool>(pub Rates<'a>);

impl<const LAMINAR: bool, const ARTIFICIAL: bool, const EVEN: bool> Pairs<'_, LAMINAR, ARTIFICIAL, EVEN> {
    const CONTENTS: Contents = Contents { laminar: LAMINAR, artificial: ARTIFICIAL, even: EVEN };

    /// The artificial viscosity is a pressure between particles that approach, and a tension between those
    /// that part. With the pressure alone, noise at rest would hold up a part of the fluid's weight (3 % of
    /// it with α = 0.1).
    #[inline(always)]
    fn sum<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: &[V; 8],
        sums: &mut [V; SUMS],
    ) {
        let of = V::Element::of;
        let rates = &self.0;
        let s = rates.kernel.nearness(r2);
        let f = s * s * s;
        // how fast they part, by the three velocity columns from `k`
        let parting = |k: usize| {
            let x = (own[k] - other[k]) * d[0];
            let x = (own[k + 1] - other[k + 1]).mul_add(d[1], x);
            (own[k + 2] - other[k + 2]).mul_add(d[2], x)
        };
        let departing = parting(0);
        let mut push = if EVEN { other[3] - own[3] } else { other[3] + own[3] };
        if ARTIFICIAL {
            let least = of(0.01 * (0.5 * rates.kernel.h).powi(2));
            let rough = roughness::damped(parting(5), departing);
            // the twelve bits of an estimate in single precision suffice for an artificial viscosity
            push -= rough * of(rates.artificial) * (r2 + least).approximate_recip();
        }
        let push = push * f;
        for k in 0..3 {
            sums[k] = push.mul_add(d[k], sums[k]);
        }
        sums[3] = f.mul_add(departing, sums[3]);
        sums[4] = f.mul_add(other[4] - own[4], sums[4]);
        if EVEN {
            for k in 0..3 {
                sums[5 + k] = f.mul_add(d[k], sums[5 + k]);
            }
            sums[8] = f.mul_add(r2, sums[8]);
        }
        // 1 + 4q = 5 − 4s
        let weight = f * s * s.mul_add(of(-4.0), of(5.0));
        sums[9] += weight;
        if ARTIFICIAL {
            for k in 0..3 {
                sums[13 + k] = weight.mul_add(other[k], sums[13 + k]);
            }
        }
        if LAMINAR && rates.spin.is_none() {
            // a particle has no line to itself
            let least = of(LEAST_DISTANCE * rates.kernel.h.powi(2));
            let rubbing = f * departing / (r2 + least);
            for k in 0..3 {
                sums[10 + k] = d[k].mul_add(-rubbing, sums[10 + k]);
            }
        }
    }
}

impl<const LAMINAR: bool, const ARTIFICIAL: bool, const EVEN: bool> PairPass<8, SUMS, 16>
    for Pairs<'_, LAMINAR, ARTIFICIAL, EVEN>
{
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: [V; 8],
        sums: &mut [V; SUMS],
    ) {
        self.sum(d, r2, own, &other, sums);
    }

    fn finish(&self, i: usize, sums: [f64; SUMS]) -> [f64; 16] {
        self.0.finish(i, Self::CONTENTS, &named(sums))
    }
}

/// The sums of [`Pairs`] by name.
fn named(sums: [f64; SUMS]) -> Sums {
    let [px, py, pz, departing, denser, cx, cy, cz, squares, weights, ux, uy, uz, sx, sy, sz] = sums;
    Sums {
        push: DVec3::new(px, py, pz),
        departing,
        denser,
        crowding: DVec3::new(cx, cy, cz),
        squares,
        weights,
        rubbing: DVec3::new(ux, uy, uz),
        velocities: DVec3::new(sx, sy, sz),
        denser_along: DVec3::ZERO,
        linear: None,
    }
}

/// The pass over pairs of a fluid that is shifted. It also sums f·(ρ_j − ρ₀)·d, the crowding that is due to
/// compression of the fluid.
#[derive(Clone, Copy)]
pub(super) struct Shifted<'a, const LAMINAR: bool, const ARTIFICIAL: bool>(pub Rates<'a>);

impl<const LAMINAR: bool, const ARTIFICIAL: bool> Shifted<'_, LAMINAR, ARTIFICIAL> {
    #[inline(always)]
    fn sum<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: &[V; 8],
        (sums, denser_along): (&mut [V; SUMS], &mut [V; 3]),
    ) {
        Pairs::<LAMINAR, ARTIFICIAL, true>(self.0).sum(d, r2, own, other, sums);
        let s = self.0.kernel.nearness(r2);
        let denser = s * s * s * other[4];
        for k in 0..3 {
            denser_along[k] = denser.mul_add(d[k], denser_along[k]);
        }
    }
}

impl<const LAMINAR: bool, const ARTIFICIAL: bool> PairPass<8, SHIFTED_SUMS, 16>
    for Shifted<'_, LAMINAR, ARTIFICIAL>
{
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: [V; 8],
        sums: &mut [V; SHIFTED_SUMS],
    ) {
        let (mut all, mut denser) = split(sums);
        self.sum(d, r2, own, &other, (&mut all, &mut denser));
        sums[..SUMS].copy_from_slice(&all);
        sums[SUMS..].copy_from_slice(&denser);
    }

    fn finish(&self, i: usize, sums: [f64; SHIFTED_SUMS]) -> [f64; 16] {
        let (all, denser) = split(&sums);
        let sums = Sums { denser_along: DVec3::from_array(denser), ..named(all) };
        self.0.finish(i, Pairs::<LAMINAR, ARTIFICIAL, true>::CONTENTS, &sums)
    }
}

/// The sums of [`Pairs`], and the sums of [`Shifted`] that follow them.
#[inline(always)]
fn split<V: Copy>(sums: &[V]) -> ([V; SUMS], [V; 3]) {
    (std::array::from_fn(|k| sums[k]), std::array::from_fn(|k| sums[SUMS + k]))
}

/// The pass over pairs where pressures act by their differences. It also sums f·d⊗d and f·(v_i − v_j)⊗d, for
/// [`Linear`].
#[derive(Clone, Copy)]
pub(super) struct Differences<'a, const LAMINAR: bool, const ARTIFICIAL: bool>(pub Rates<'a>);

impl<const LAMINAR: bool, const ARTIFICIAL: bool> PairPass<8, DIFFERENCES_SUMS, 16>
    for Differences<'_, LAMINAR, ARTIFICIAL>
{
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: [V; 8],
        sums: &mut [V; DIFFERENCES_SUMS],
    ) {
        let (mut all, mut denser) = split(sums);
        Shifted::<LAMINAR, ARTIFICIAL>(self.0).sum(d, r2, own, &other, (&mut all, &mut denser));
        sums[..SUMS].copy_from_slice(&all);
        sums[SUMS..SHIFTED_SUMS].copy_from_slice(&denser);
        let s = self.0.kernel.nearness(r2);
        let f = s * s * s;
        let along: [V; 3] = std::array::from_fn(|k| f * d[k]);
        let parting: [V; 3] = std::array::from_fn(|k| own[k] - other[k]);
        for (k, (a, b)) in COMPONENTS.into_iter().enumerate() {
            let (moment, part) = (SHIFTED_SUMS + k, SHIFTED_SUMS + COMPONENTS.len() + k);
            sums[moment] = along[a].mul_add(d[b], sums[moment]);
            sums[part] = along[a].mul_add(parting[b], sums[part]);
            if a != b {
                sums[part] = along[b].mul_add(parting[a], sums[part]);
            }
        }
    }

    fn finish(&self, i: usize, sums: [f64; DIFFERENCES_SUMS]) -> [f64; 16] {
        let (all, denser) = split(&sums);
        let tensor = |from: usize, trace: f64, beside: f64| {
            let [xx, yy, yz, zx, xy] = std::array::from_fn(|k| sums[from + k]);
            Symmetric::new(DVec3::new(xx, yy, trace - xx - yy), beside * DVec3::new(yz, zx, xy))
        };
        let moment = tensor(SHIFTED_SUMS, all[8], 1.0);
        // beside the diagonal both a⊗b and b⊗a were summed
        let parting = tensor(SHIFTED_SUMS + COMPONENTS.len(), all[3], 0.5);
        let (denser_along, linear) = (DVec3::from_array(denser), Some(Linear { moment, parting }));
        let sums = Sums { denser_along, linear, ..named(all) };
        self.0.finish(i, Pairs::<LAMINAR, ARTIFICIAL, true>::CONTENTS, &sums)
    }
}

/// The pass over pairs that finds the density that kernels miss before a free surface, as a part of the rest
/// density.
#[derive(Clone, Copy)]
pub(super) struct Missing<'a> {
    core: &'a Core,
    crowding: Crowding,
    surface: FreeSurface,
}

impl<'a> Missing<'a> {
    pub fn new(core: &'a Core) -> Self {
        let parameters = &core.parameters;
        let surface = FreeSurface::of_lattice(parameters.support_radius / parameters.spacing());
        Self { core, crowding: Crowding::of(parameters), surface }
    }
}

impl PairPass<0, 3, 1> for Missing<'_> {
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

    fn finish(&self, i: usize, sums: [f64; 3]) -> [f64; 1] {
        let mut crowding = self.crowding.total(sums);
        if let Some(wall) = self.core.coverage::<()>(i) {
            crowding += wall.gradient;
        }
        [self.surface.missing(crowding.length() * self.crowding.kernel.h)]
    }
}
