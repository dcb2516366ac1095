//! Sums over neighbours, many particles at a time.
//!
//! A register holds several particles that lie close together: consecutive ones of one column. Whatever is near any of
//! them goes past, one at a time, and is added to all: kernels of finite support give zero to those that are too far.
//! No list of neighbours exists, hence none is kept from step to step. A method that sums many times over the same places
//! may have found once what is near each register ([`Near`]: a third of a list of neighbours, shared by 16 particles).
//!
//! ```text
//! Columns::sort ─▶ blocks ─▶ gather what is around a block ─▶ registers of particles ─▶ what is near each
//!                                                             ─▶ PairPass::add ─▶ PairPass::finish
//! ```
//!
//! Positions are taken relative to the block before they are rounded to the precision of the pair arithmetic, so that
//! single precision has its full digits for the distances that matter, wherever the scene lies. A pass sums in that
//! precision over the neighbours of one particle; everything that lasts longer than a step is in double precision.
//!
//! Invariants: particle i gathers from its neighbours in the order of the columns and writes only its own results: the
//! same bits for any number of threads. A particle is among its own neighbours, with the distance zero.

mod columns;
mod near;

use std::cell::RefCell;
use std::ops::Range;

use fearless_simd::{Level, Simd, SimdBase, SimdFloat, SimdFloatElement};
use rayon::prelude::*;
use smallvec::SmallVec;

use super::particles::Vectors;

pub(super) use columns::{Block, Columns};
pub(super) use near::Near;
use near::{OfBlock, Reach};

/// Compiles an expression for three widths of registers (512, 256 and 128 bits on x86-64) and runs the widest that the
/// processor has. Each width of each pass is code of its own: the levels in between are not worth theirs.
macro_rules! at_level {
    ($level:expr, $simd:ident => $run:expr) => {{
        let level: Level = $level;
        #[cfg(target_arch = "x86_64")]
        {
            if let Some($simd) = level.as_avx512() {
                $simd.vectorize(#[inline(always)] || $run)
            } else if let Some($simd) = level.as_avx2() {
                $simd.vectorize(#[inline(always)] || $run)
            } else if let Some($simd) = level.as_sse2() {
                $simd.vectorize(#[inline(always)] || $run)
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        fearless_simd::dispatch!(level, $simd => $run)
    }};
}

/// A precision for sums over neighbours.
pub(super) trait Real: SimdFloatElement + Default + Copy + Send + Sync + 'static {
    fn of(x: f64) -> Self;
    fn wide(self) -> f64;
    /// Lends this thread's working memory, which stays for the next use.
    fn with_surroundings<R>(use_it: impl FnOnce(&mut Surroundings<Self>) -> R) -> R;
}

macro_rules! real {
    ($real:ty) => {
        impl Real for $real {
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $real
            }

            #[inline(always)]
            fn wide(self) -> f64 {
                self.into()
            }

            fn with_surroundings<R>(use_it: impl FnOnce(&mut Surroundings<Self>) -> R) -> R {
                thread_local!(static KEPT: RefCell<Surroundings<$real>> = RefCell::default());
                KEPT.with_borrow_mut(use_it)
            }
        }
    };
}
real!(f32);
real!(f64);

/// What is summed over neighbours: `IN` numbers are read of each particle besides its position, `SUMS` are summed, and
/// `OUT` are made of them.
pub(super) trait PairPass<const IN: usize, const SUMS: usize, const OUT: usize>: Copy + Sync {
    /// Adds what one neighbour gives to several particles. `d` points from the neighbour to them, r2 = |d|². To be
    /// `#[inline(always)]`, and zero from the support radius on.
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; IN],
        other: [V; IN],
        sums: &mut [V; SUMS],
    );

    /// Results of particle `i`.
    fn finish(&self, i: usize, sums: [f64; SUMS]) -> [f64; OUT];
}

/// So many blocks are one task: small enough to balance, large enough to forget.
const TASK: usize = 4;

/// Where the particles are, and how they are sorted.
#[derive(Clone, Copy)]
pub(super) struct Cloud<'a> {
    pub level: Level,
    pub columns: &'a Columns,
    /// In the order of the columns.
    pub position: &'a Vectors,
    /// Support radius, m.
    pub radius: f64,
    /// What is near each particle, if it was found before; of the same places and the same precision.
    pub near: Option<&'a Near>,
}

/// Copies of what is around a block: positions relative to it, and the fields that a pass reads.
#[derive(Default)]
pub(super) struct Surroundings<T> {
    values: Vec<Vec<T>>,
    /// First particle and first copy of each range.
    ranges: SmallVec<[(usize, usize); 9]>,
    /// How many copies there are; the vectors may be longer.
    count: usize,
    /// The copies that are near a register's particles.
    near: Vec<u32>,
}

impl Cloud<'_> {
    /// Runs a pass over all pairs nearer than the radius; `fields` and `out` are in the order of the particles.
    pub fn sum<T, P, const IN: usize, const SUMS: usize, const OUT: usize>(
        &self,
        pass: &P,
        fields: [&[f64]; IN],
        out: [&mut [f64]; OUT],
    ) where
        T: Real,
        P: PairPass<IN, SUMS, OUT>,
    {
        self.sum_blocks::<T, P, IN, SUMS, OUT>(pass, fields, 0, self.columns.blocks(), 0, out);
    }

    /// Finds what is near each particle, for passes to come: worth it from three of them on.
    pub fn find_near<T: Real>(&self, near: &mut Near) {
        let blocks = self.columns.blocks();
        near.of_blocks.resize_with(blocks.len(), OfBlock::default);
        blocks.par_iter().zip(&mut near.of_blocks).with_min_len(TASK).for_each(|(block, of_block)| {
            T::with_surroundings(|around| {
                at_level!(self.level, simd => self.find_near_block::<T, _>(simd, block, around, of_block));
            });
        });
    }

    #[inline(always)]
    fn find_near_block<T: Real, S: Simd>(
        &self,
        simd: S,
        block: &Block,
        around: &mut Surroundings<T>,
        of_block: &mut OfBlock,
    ) {
        let lanes = T::Native::<S>::LEN;
        let particles = block.particles();
        let own_copy = self.gather([], block, lanes, around);
        let OfBlock { copies, ends } = of_block;
        copies.clear();
        ends.clear();
        let mut first = particles.start;
        while first < particles.end {
            let last = (first + lanes).min(particles.end);
            let here = places_of(simd, around, own_copy + first - particles.start);
            self.collect_near(simd, block, first..last, &here, around, copies);
            ends.push(copies.len() as u32);
            first = last;
        }
    }

    /// Appends the copies that are near the particles of a register, which are `here`.
    #[inline(always)]
    fn collect_near<T: Real, S: Simd>(
        &self,
        simd: S,
        block: &Block,
        particles: Range<usize>,
        here: &[T::Native<S>; 3],
        around: &Surroundings<T>,
        copies: &mut Vec<u32>,
    ) {
        let reach = Reach::around(simd, here, particles.len(), self.radius);
        let ranges = self.columns.ranges_around(block, extent(&self.position.z[particles]), self.radius);
        let [x, y, z, ..] = &around.values[..] else { unreachable!("places come first") };
        for (&(start, end), &(source, copy)) in ranges.iter().zip(&around.ranges) {
            let (start, end) = (start as usize - source + copy, end as usize - source + copy);
            reach.collect([x, y, z], (start, end), copies);
        }
    }

    /// Halves the blocks among the threads. `blocks` begin with block `number`, `out` with particle `first`.
    fn sum_blocks<T, P, const IN: usize, const SUMS: usize, const OUT: usize>(
        &self,
        pass: &P,
        fields: [&[f64]; IN],
        number: usize,
        blocks: &[Block],
        first: usize,
        mut out: [&mut [f64]; OUT],
    ) where
        T: Real,
        P: PairPass<IN, SUMS, OUT>,
    {
        if blocks.len() > TASK {
            let (left, right) = blocks.split_at(blocks.len() / 2);
            let middle = right[0].first as usize;
            let mut rest = out.iter_mut();
            let halves: [(&mut [f64], &mut [f64]); OUT] = std::array::from_fn(|_| {
                std::mem::take(rest.next().expect("as many as there are")).split_at_mut(middle - first)
            });
            let mut low: [&mut [f64]; OUT] = std::array::from_fn(|_| Default::default());
            let mut high: [&mut [f64]; OUT] = std::array::from_fn(|_| Default::default());
            for (k, (a, b)) in halves.into_iter().enumerate() {
                (low[k], high[k]) = (a, b);
            }
            rayon::join(
                || self.sum_blocks::<T, P, IN, SUMS, OUT>(pass, fields, number, left, first, low),
                || {
                    self.sum_blocks::<T, P, IN, SUMS, OUT>(
                        pass,
                        fields,
                        number + left.len(),
                        right,
                        middle,
                        high,
                    )
                },
            );
            return;
        }
        T::with_surroundings(|around| {
            for (k, block) in blocks.iter().enumerate() {
                let found = self.near.map(|near| &near.of_blocks[number + k]);
                let at = block.first as usize - first;
                let own = at..at + block.len as usize;
                let out = out.each_mut().map(|out| &mut out[own.clone()]);
                at_level!(self.level, simd => self.sum_block::<T, _, P, IN, SUMS, OUT>(simd, pass, fields, (block, found), around, out));
            }
        });
    }

    #[inline(always)]
    fn sum_block<T, S, P, const IN: usize, const SUMS: usize, const OUT: usize>(
        &self,
        simd: S,
        pass: &P,
        fields: [&[f64]; IN],
        (block, found): (&Block, Option<&OfBlock>),
        around: &mut Surroundings<T>,
        mut out: [&mut [f64]; OUT],
    ) where
        T: Real,
        S: Simd,
        P: PairPass<IN, SUMS, OUT>,
    {
        // Loops over the few fields are written out: what a closure holds would not be compiled for the wide registers.
        let lanes = T::Native::<S>::LEN;
        // a copy of its own: what the pass's numbers come to is then found before the loop over neighbours, not in it
        let pass = *pass;
        let particles = block.particles();
        let own_copy = self.gather(fields, block, lanes, around);
        let zero = T::Native::<S>::splat(simd, T::default());
        let mut first = particles.start;
        while first < particles.end {
            let last = (first + lanes).min(particles.end);
            let at = own_copy + first - particles.start;
            let here = places_of(simd, around, at);
            let mut own = [zero; IN];
            for k in 0..IN {
                own[k] = T::Native::<S>::from_slice(simd, &around.values[3 + k][at..at + lanes]);
            }
            let mut sums = [zero; SUMS];
            if found.is_none() {
                let mut near = std::mem::take(&mut around.near);
                near.clear();
                self.collect_near(simd, block, first..last, &here, around, &mut near);
                around.near = near;
            }
            let near = match found {
                Some(of_block) => of_block.register((first - particles.start) / lanes),
                None => &around.near,
            };
            let count = around.count;
            let x = &around.values[0][..count];
            let y = &around.values[1][..count];
            let z = &around.values[2][..count];
            let mut values: [&[T]; IN] = [&[]; IN];
            for k in 0..IN {
                values[k] = &around.values[3 + k][..count];
            }
            for &j in near {
                let j = j as usize;
                let d = [
                    here[0] - T::Native::<S>::splat(simd, x[j]),
                    here[1] - T::Native::<S>::splat(simd, y[j]),
                    here[2] - T::Native::<S>::splat(simd, z[j]),
                ];
                let r2 = d[2].mul_add(d[2], d[1].mul_add(d[1], d[0] * d[0]));
                let mut other = [zero; IN];
                for k in 0..IN {
                    other[k] = T::Native::<S>::splat(simd, values[k][j]);
                }
                pass.add(d, r2, &own, other, &mut sums);
            }
            for lane in 0..last - first {
                let mut of_lane = [0.0; SUMS];
                for (of_lane, sum) in of_lane.iter_mut().zip(&sums) {
                    *of_lane = sum.as_slice()[lane].wide();
                }
                let results = pass.finish(first + lane, of_lane);
                for (out, result) in out.iter_mut().zip(results) {
                    out[first - particles.start + lane] = result;
                }
            }
            first = last;
        }
    }

    /// Copies what is around a block, and returns where in it the block is.
    #[inline(always)]
    fn gather<T: Real, const IN: usize>(
        &self,
        fields: [&[f64]; IN],
        block: &Block,
        lanes: usize,
        around: &mut Surroundings<T>,
    ) -> usize {
        let particles = block.particles();
        let centre = self.position.get(particles.start + particles.len() / 2);
        around.values.resize_with((3 + IN).max(around.values.len()), Vec::new);
        around.ranges.clear();
        let near =
            self.columns.ranges_around(block, extent(&self.position.z[particles.clone()]), self.radius);
        let (mut count, mut own) = (0, 0);
        for &(start, end) in &near {
            let (start, end) = (start as usize, end as usize);
            if (start..end).contains(&particles.start) {
                own = count + particles.start - start;
            }
            around.ranges.push((start, count));
            count += end - start;
        }
        around.count = count;
        // the last register of the block may reach beyond what was copied
        let room = count + lanes;
        for values in &mut around.values[..3 + IN] {
            if values.len() < room {
                values.resize(2 * room, T::default());
            }
        }
        let Vectors { x, y, z } = self.position;
        let places = [(&x[..], centre.x), (&y[..], centre.y), (&z[..], centre.z)];
        let others = fields.map(|field| (field, 0.0));
        for (values, (source, origin)) in around.values.iter_mut().zip(places.into_iter().chain(others)) {
            for (&(start, end), &(_, copy)) in near.iter().zip(&around.ranges) {
                for (to, from) in values[copy..].iter_mut().zip(&source[start as usize..end as usize]) {
                    *to = T::of(from - origin);
                }
            }
        }
        own
    }
}

/// The places of a register's particles, of which the first is this copy.
#[inline(always)]
fn places_of<T: Real, S: Simd>(simd: S, around: &Surroundings<T>, copy: usize) -> [T::Native<S>; 3] {
    let mut here = [T::Native::<S>::splat(simd, T::default()); 3];
    for k in 0..3 {
        here[k] = T::Native::<S>::from_slice(simd, &around.values[k][copy..copy + T::Native::<S>::LEN]);
    }
    here
}

/// Least and greatest.
#[inline(always)]
fn extent(z: &[f64]) -> (f64, f64) {
    z.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &z| (low.min(z), high.max(z)))
}
