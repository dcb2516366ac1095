//! Selection of the gathered copies that are near a register's particles.

use fearless_simd::{Simd, SimdFloat, SimdMask};
use smallvec::SmallVec;

use super::real::Real;

/// Places within the radius of a register's particles. The ranges of copies are boxes. About a third of the
/// copies lies farther than the radius from the box around the particles. Another third is near that box, but
/// near none of the particles.
pub(super) struct Reach<'a, V> {
    here: &'a [V; 3],
    /// A bit for each particle.
    lanes: u64,
    centre: [V; 3],
    half: [V; 3],
    /// Square of the radius, plus a little more than rounding can add to it.
    squared: V,
}

impl<'a, V> Reach<'a, V> {
    /// Returns the reach of the first `lanes` particles.
    #[inline(always)]
    pub fn around<T: Real, S: Simd>(simd: S, here: &'a [V; 3], lanes: usize, radius: f64) -> Self
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
        Self {
            here,
            lanes: (1 << lanes) - 1,
            centre,
            half,
            squared: V::splat(simd, T::of(radius * radius * 1.0001)),
        }
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
                let copy = at + within.trailing_zeros() as usize;
                if self.is_near_any(places, copy) {
                    near.push(copy as u32);
                }
                within &= within - 1;
            }
            at += V::LEN;
        }
    }

    /// Whether a copy is within the radius of one of the particles.
    #[inline(always)]
    fn is_near_any<T: Real, S: Simd>(&self, places: [&[T]; 3], copy: usize) -> bool
    where
        V: SimdFloat<S, Element = T>,
    {
        let simd = self.squared.token();
        let x = self.here[0] - V::splat(simd, places[0][copy]);
        let y = self.here[1] - V::splat(simd, places[1][copy]);
        let z = self.here[2] - V::splat(simd, places[2][copy]);
        let squared = z.mul_add(z, y.mul_add(y, x * x));
        squared.simd_lt(self.squared).to_bitmask() & self.lanes != 0
    }
}

/// The surroundings of each block, kept for several passes over the same places, in one precision.
#[derive(Default)]
pub(in crate::sph) struct Near {
    pub(super) single: Vec<OfBlock<f32>>,
    pub(super) double: Vec<OfBlock<f64>>,
}

/// Consecutive particles and where their copies begin.
#[derive(Clone, Copy)]
pub(in crate::sph) struct Range {
    pub start: usize,
    pub end: usize,
    /// Index of the first copy.
    pub copy: usize,
}

/// The surroundings of a block.
#[derive(Default)]
pub(in crate::sph) struct OfBlock<T> {
    /// Copies of the places around the block, relative to it. There is room for one more register.
    pub places: [Vec<T>; 3],
    /// The particles of these copies.
    pub ranges: SmallVec<[Range; 9]>,
    /// Number of copies; the vectors may be longer.
    pub count: usize,
    /// Index of the copy of the block's first particle.
    pub own: usize,
    /// Indices of the copies near each register of the block, register after register.
    pub copies: Vec<u32>,
    /// End of each register's copies in `copies`, one past the last.
    pub ends: Vec<u32>,
}

impl<T> OfBlock<T> {
    /// Copies near the register with this number.
    #[inline(always)]
    pub fn register(&self, number: usize) -> &[u32] {
        let begin = number.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.copies[begin as usize..self.ends[number] as usize]
    }

    fn bytes(&self) -> usize {
        let places: usize = self.places.iter().map(|values| size_of::<T>() * values.capacity()).sum();
        size_of::<Self>() + places + 4 * (self.copies.capacity() + self.ends.capacity())
    }
}

impl Near {
    pub fn bytes(&self) -> usize {
        self.single.iter().map(OfBlock::bytes).sum::<usize>()
            + self.double.iter().map(OfBlock::bytes).sum::<usize>()
    }
}
