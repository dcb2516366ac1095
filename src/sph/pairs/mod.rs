//! Sums over neighbours, many particles at a time.
//!
//! A register holds several particles that lie close together: consecutive ones of one column. Each particle
//! near any of them is added in turn to all of them; kernels of finite support give zero where the distance
//! is too large. There are no lists of neighbours to keep from step to step. A method that sums many times
//! over the same places may find once which particles are around each block and near each register
//! ([`Near`]).
//!
//! ```text
//! Columns::sort ─▶ blocks ─▶ gather the surroundings of a block ─▶ registers of particles ─▶ near particles
//!                                                               ─▶ PairPass::add ─▶ PairPass::finish
//! ```
//!
//! Positions are taken relative to the block before they are rounded to the precision of the pair arithmetic.
//! Single precision thus has its full digits for the distances that matter, wherever the scene lies. A pass
//! sums in that precision over the neighbours of one particle; everything that lasts longer than a step is in
//! double precision.
//!
//! Invariants: particle i gathers from its neighbours in the order of the columns and writes only its own
//! results, which gives equal bits for any number of threads. A particle is among its own neighbours, at
//! distance zero.

mod columns;
mod near;
mod real;

use std::cell::RefCell;

use fearless_simd::{Level, Simd, SimdBase, SimdFloat};
use rayon::prelude::*;
use smallvec::SmallVec;

use super::particles::Vectors;

pub(super) use columns::Columns;
use columns::{BLOCK, Block};
pub(super) use near::Near;
use near::{OfBlock, Range, Reach};
pub(super) use real::Real;

/// Compiles an expression for three widths of registers (512, 256 and 128 bits on x86-64) and runs the widest
/// that the processor has. Every width adds code for each pass, and the levels in between are not worth it.
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

/// A precision with working memory of its own.
pub(super) trait Kept: Real {
    /// The surroundings of each block, found in this precision.
    fn blocks(near: &Near) -> &[OfBlock<Self>];

    /// The place to store them.
    fn blocks_mut(near: &mut Near) -> &mut Vec<OfBlock<Self>>;

    /// Lends this thread's working memory, which is kept for the next use.
    fn with_surroundings<R>(use_it: impl FnOnce(&mut Surroundings<Self>) -> R) -> R;
}

macro_rules! kept {
    ($real:ty, $blocks:ident) => {
        impl Kept for $real {
            fn blocks(near: &Near) -> &[OfBlock<Self>] {
                &near.$blocks
            }

            fn blocks_mut(near: &mut Near) -> &mut Vec<OfBlock<Self>> {
                &mut near.$blocks
            }

            fn with_surroundings<R>(use_it: impl FnOnce(&mut Surroundings<Self>) -> R) -> R {
                thread_local!(static KEPT: RefCell<Surroundings<$real>> = RefCell::default());
                KEPT.with_borrow_mut(use_it)
            }
        }
    };
}
kept!(f32, single);
kept!(f64, double);

/// Quantity that is summed over neighbours. A pass reads `IN` numbers of each particle besides its position,
/// forms `SUMS` sums and makes `OUT` results from them.
pub(super) trait PairPass<const IN: usize, const SUMS: usize, const OUT: usize>: Copy + Sync {
    /// Adds the contribution of one neighbour to several particles. `d` points from the neighbour to them,
    /// and r2 = |d|². Implementations must be `#[inline(always)]` and add zero at the support radius and
    /// beyond.
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

    /// The pass as it is for these particles, where it does not do the same for all.
    fn for_block(self, _: std::ops::Range<usize>) -> Self {
        self
    }

    /// How many of the `IN` numbers it reads, from the first on.
    fn reads(&self) -> usize {
        IN
    }
}

/// Number of blocks in one task: small enough to balance the load, large enough to make its overhead
/// negligible.
const TASK: usize = 4;

/// Numbers in the widest register.
const MOST_LANES: usize = 16;

/// Positions of the particles, and how they are sorted.
#[derive(Clone, Copy)]
pub(super) struct Cloud<'a> {
    pub level: Level,
    pub columns: &'a Columns,
    /// Positions in the order of the columns.
    pub position: &'a Vectors,
    /// Support radius, m.
    pub radius: f64,
    /// Particles near each register, if they were found before for these places and this precision.
    pub near: Option<&'a Near>,
}

/// Working memory for the sums of a block.
#[derive(Default)]
pub(super) struct Surroundings<T> {
    /// The surroundings of the block, if they were not found before.
    near: OfBlock<T>,
    /// Copies of the fields that a pass reads, in the order of the copies of places.
    fields: Vec<Vec<T>>,
    /// [`BLOCK`] places for each sum, one for each particle.
    sums: Vec<f64>,
}

/// Consecutive blocks for one thread, and the place of their results.
struct Task<'a> {
    /// Number of the first block among all.
    number: usize,
    blocks: &'a [Block],
    /// Index of the first particle.
    first: usize,
    /// Results of these particles, one slice for each result of a pass.
    out: SmallVec<[&'a mut [f64]; 8]>,
}

impl<'a> Task<'a> {
    /// Halves the blocks repeatedly, to share them among the threads. `one` is behind a pointer so that this
    /// is compiled once for all passes.
    fn run(self, one: &(dyn Fn(Task<'_>) + Sync)) {
        if self.blocks.len() <= TASK {
            return one(self);
        }
        let (left, right) = self.halves();
        rayon::join(|| left.run(one), || right.run(one));
    }

    fn halves(self) -> (Self, Self) {
        let Task { number, blocks, first, out } = self;
        let (left, right) = blocks.split_at(blocks.len() / 2);
        let middle = right[0].first as usize;
        let (low, high) = out.into_iter().map(|out| out.split_at_mut(middle - first)).unzip();
        (
            Task { number, blocks: left, first, out: low },
            Task { number: number + left.len(), blocks: right, first: middle, out: high },
        )
    }
}

impl Cloud<'_> {
    /// Runs a pass over all pairs nearer than the radius. `fields` and `out` are in the order of the
    /// particles.
    pub fn sum<T, P, const IN: usize, const SUMS: usize, const OUT: usize>(
        &self,
        pass: &P,
        fields: [&[f64]; IN],
        out: [&mut [f64]; OUT],
    ) where
        T: Kept,
        P: PairPass<IN, SUMS, OUT>,
    {
        let all = Task { number: 0, blocks: self.columns.blocks(), first: 0, out: out.into_iter().collect() };
        all.run(&|mut task: Task<'_>| {
            T::with_surroundings(|Surroundings { near, fields: copies, sums }| {
                for (k, block) in task.blocks.iter().enumerate() {
                    let near = match self.near {
                        Some(found) => &T::blocks(found)[task.number + k],
                        None => {
                            self.look_around(block, near);
                            &*near
                        }
                    };
                    let pass = &pass.for_block(block.particles());
                    self.gather(&fields, pass.reads(), near, copies);
                    add_up::<T, P, IN, SUMS, OUT>(self.level, pass, block, near, copies, sums);
                    finish::<P, IN, SUMS, OUT>(pass, block, sums, task.first, &mut task.out);
                }
            });
        });
    }

    /// Finds the surroundings of each block for later passes. This is worthwhile for three passes or more.
    pub fn find_near<T: Kept>(&self, near: &mut Near) {
        let blocks = self.columns.blocks();
        let near = T::blocks_mut(near);
        near.resize_with(blocks.len(), OfBlock::default);
        blocks
            .par_iter()
            .zip(near)
            .with_min_len(TASK)
            .for_each(|(block, near)| self.look_around(block, near));
    }

    /// Copies the places around a block, relative to it, and finds which of them are near its registers.
    fn look_around<T: Kept>(&self, block: &Block, near: &mut OfBlock<T>) {
        let particles = block.particles();
        let centre = self.position.get(particles.start + particles.len() / 2);
        let ranges =
            self.columns.ranges_around(block, extent(&self.position.z[particles.clone()]), self.radius);
        near.ranges.clear();
        near.count = 0;
        for (start, end) in ranges {
            let (start, end) = (start as usize, end as usize);
            if (start..end).contains(&particles.start) {
                near.own = near.count + particles.start - start;
            }
            near.ranges.push(Range { start, end, copy: near.count });
            near.count += end - start;
        }
        let Vectors { x, y, z } = self.position;
        let sources = [(x, centre.x), (y, centre.y), (z, centre.z)];
        for (values, (source, origin)) in near.places.iter_mut().zip(sources) {
            make_room(values, near.count);
            at_level!(self.level, simd => copy_ranges(simd, source, origin, &near.ranges, values));
        }
        near.copies.clear();
        near.ends.clear();
        at_level!(self.level, simd => self.collect_near_registers(simd, block, near));
    }

    /// Copies the first `reads` fields, which a pass reads, of the particles around a block.
    fn gather<T: Kept>(&self, fields: &[&[f64]], reads: usize, near: &OfBlock<T>, copies: &mut Vec<Vec<T>>) {
        copies.resize_with(fields.len().max(copies.len()), Vec::new);
        for (k, (values, source)) in copies.iter_mut().zip(fields).enumerate() {
            make_room(values, near.count);
            if k < reads {
                at_level!(self.level, simd => copy_ranges(simd, source, 0.0, &near.ranges, values));
            }
        }
    }

    /// Finds the copies that are near each register of a block.
    #[inline(always)]
    fn collect_near_registers<T: Kept, S: Simd>(&self, simd: S, block: &Block, near: &mut OfBlock<T>) {
        let lanes = T::Native::<S>::LEN;
        let particles = block.particles();
        let OfBlock { places: [x, y, z], ranges, own, copies, ends, .. } = near;
        let mut first = particles.start;
        while first < particles.end {
            let last = (first + lanes).min(particles.end);
            let here = places_of(simd, [x, y, z], *own + first - particles.start);
            let reach = Reach::around(simd, &here, last - first, self.radius);
            let closer =
                self.columns.ranges_around(block, extent(&self.position.z[first..last]), self.radius);
            for (&(start, end), range) in closer.iter().zip(&*ranges) {
                let (start, end) =
                    (start as usize - range.start + range.copy, end as usize - range.start + range.copy);
                reach.collect([x, y, z], (start, end), copies);
            }
            ends.push(copies.len() as u32);
            first = last;
        }
    }
}

/// Makes room for the given number of copies. The last register of a block may reach beyond them.
fn make_room<T: Copy + Default>(values: &mut Vec<T>, count: usize) {
    let room = count + MOST_LANES;
    if values.len() < room {
        values.resize(room + room / 4, T::default());
    }
}

/// Copies ranges of numbers, less an origin.
#[inline(always)]
fn copy_ranges<T: Kept, S: Simd>(_: S, source: &[f64], origin: f64, ranges: &[Range], values: &mut [T]) {
    for range in ranges {
        for (to, from) in values[range.copy..].iter_mut().zip(&source[range.start..range.end]) {
            *to = T::of(from - origin);
        }
    }
}

/// Sums over the neighbours of a block's particles. Only this function is compiled for each pass, precision
/// and width.
fn add_up<T, P, const IN: usize, const SUMS: usize, const OUT: usize>(
    level: Level,
    pass: &P,
    block: &Block,
    near: &OfBlock<T>,
    fields: &[Vec<T>],
    sums: &mut Vec<f64>,
) where
    T: Kept,
    P: PairPass<IN, SUMS, OUT>,
{
    at_level!(level, simd => add_up_registers(simd, pass, block.len as usize, near, fields, sums));
}

#[inline(always)]
fn add_up_registers<T, S, P, const IN: usize, const SUMS: usize, const OUT: usize>(
    simd: S,
    pass: &P,
    len: usize,
    near: &OfBlock<T>,
    fields: &[Vec<T>],
    of_block: &mut Vec<f64>,
) where
    T: Kept,
    S: Simd,
    P: PairPass<IN, SUMS, OUT>,
{
    // Loops over the few fields are written out, because the body of a closure would not be compiled for wide
    // registers.
    let lanes = T::Native::<S>::LEN;
    // A local copy lets the compiler compute values derived from the pass before the loop over neighbours,
    // not in it.
    let pass = *pass;
    let zero = T::Native::<S>::splat(simd, T::default());
    if of_block.len() < SUMS * BLOCK {
        of_block.resize(SUMS * BLOCK, 0.0);
    }
    let [x, y, z] = &near.places;
    let mut first = 0;
    while first < len {
        let at = near.own + first;
        let here = places_of(simd, [x, y, z], at);
        let mut own = [zero; IN];
        for k in 0..IN {
            own[k] = T::Native::<S>::from_slice(simd, &fields[k][at..at + lanes]);
        }
        let mut sums = [zero; SUMS];
        let count = near.count;
        let (x, y, z) = (&x[..count], &y[..count], &z[..count]);
        let mut values: [&[T]; IN] = [&[]; IN];
        for k in 0..IN {
            values[k] = &fields[k][..count];
        }
        for &j in near.register(first / lanes) {
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
        for k in 0..SUMS {
            let place = k * BLOCK + first;
            for (to, from) in of_block[place..place + lanes].iter_mut().zip(sums[k].as_slice()) {
                *to = from.wide();
            }
        }
        first += lanes;
    }
}

/// Makes results from a block's sums. `out` begins with particle `first`.
fn finish<P, const IN: usize, const SUMS: usize, const OUT: usize>(
    pass: &P,
    block: &Block,
    sums: &[f64],
    first: usize,
    out: &mut [&mut [f64]],
) where
    P: PairPass<IN, SUMS, OUT>,
{
    for (lane, i) in block.particles().enumerate() {
        let results = pass.finish(i, std::array::from_fn(|k| sums[k * BLOCK + lane]));
        for (out, result) in out.iter_mut().zip(results) {
            out[i - first] = result;
        }
    }
}

/// Places of a register's particles; `copy` is the index of the first.
#[inline(always)]
fn places_of<T: Kept, S: Simd>(simd: S, places: [&[T]; 3], copy: usize) -> [T::Native<S>; 3] {
    let mut here = [T::Native::<S>::splat(simd, T::default()); 3];
    for k in 0..3 {
        here[k] = T::Native::<S>::from_slice(simd, &places[k][copy..copy + T::Native::<S>::LEN]);
    }
    here
}

/// Least and greatest value.
#[inline(always)]
fn extent(z: &[f64]) -> (f64, f64) {
    z.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &z| (low.min(z), high.max(z)))
}
