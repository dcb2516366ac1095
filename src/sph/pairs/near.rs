//! Selection of the gathered copies that are near a register's particles.

use fearless_simd::{Simd, SimdFloat, SimdMask};

use super::real::Real;

/// Places within the radius of the box around a register's particles. The ranges of copies are boxes too, and
/// about a third of the copies lies outside them.
pub(super) struct Reach<V> {
    centre: [V; 3],
    half: [V; 3],
    /// Square of the radius, plus a little more than rounding can add to it.
    squared: V,
}

impl<V> Reach<V> {
    /// Returns the reach of the first `lanes` particles.
    #[inline(always)]
    pub fn around<T: Real, S: Simd>(simd: S, here: &[V; 3], lanes: usize, radius: f64) -> Self
    where
        V: SimdFloat<S, Element = T>,
    {
        let mut centre = [V::splat(simd, T::default()); 3];
        let mut half = centre;
        for k in 0..3 {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for &x in &here[k].as_slice()[..lanes] {
                (low, high) = (low.min(x.wide()), high.max(x.wide()));
            }
            centre[k] = V::splat(simd, T::of(0.5 * (low + high)));
            half[k] = V::splat(simd, T::of(0.5 * (high - low)));
        }
        Self { centre, half, squared: V::splat(simd, T::of(radius * radius * 1.0001)) }
    }

    /// Appends the copies from `start` to `end` that are within reach.
    #[inline(always)]
    pub fn collect<T: Real, S: Simd>(
        &self,
        places: [&[T]; 3],
        (start, end): (usize, usize),
        near: &mut Vec<u32>,
    ) where
        V: SimdFloat<S, Element = T>,
    {
        let simd = self.squared.token();
        let zero = V::splat(simd, T::default());
        let mut at = start;
        while at < end {
            let mut squared = zero;
            for k in 0..3 {
                let place = V::from_slice(simd, &places[k][at..at + V::LEN]);
                let beyond = ((place - self.centre[k]).abs() - self.half[k]).max(zero);
                squared = beyond.mul_add(beyond, squared);
            }
            let mut within = squared.simd_lt(self.squared).to_bitmask();
            if end - at < V::LEN {
                within &= (1 << (end - at)) - 1;
            }
            while within != 0 {
                near.push(at as u32 + within.trailing_zeros());
                within &= within - 1;
            }
            at += V::LEN;
        }
    }
}

/// Copies near the registers of each block, kept for several passes over the same places.
#[derive(Default)]
pub(in crate::sph) struct Near {
    pub(super) of_blocks: Vec<OfBlock>,
}

#[derive(Default)]
pub(super) struct OfBlock {
    /// Indices of the copies, register after register.
    pub copies: Vec<u32>,
    /// End of each register's copies in `copies`, one past the last.
    pub ends: Vec<u32>,
}

impl OfBlock {
    pub fn clear(&mut self) {
        self.copies.clear();
        self.ends.clear();
    }

    /// Copies near the register with this number.
    #[inline(always)]
    pub fn register(&self, number: usize) -> &[u32] {
        let begin = number.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.copies[begin as usize..self.ends[number] as usize]
    }
}

impl Near {
    pub fn bytes(&self) -> usize {
        let of_blocks = self.of_blocks.iter();
        let lists: usize = of_blocks.map(|of| 4 * (of.copies.capacity() + of.ends.capacity())).sum();
        lists + size_of::<OfBlock>() * self.of_blocks.capacity()
    }
}
