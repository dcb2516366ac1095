//! Sine and cosine in `f32`, by the algorithms of `libm::sinf` and `libm::cosf`, which compute in `f64`.
//!
//! Each half of a vector is as wide as a whole one in `f64`. Arguments up to 9π/4 are reduced in one step,
//! others in two. Rare arguments are left to `libm`: those beside odd multiples of π/4, where `libm` cuts
//! quadrants at the nearest number in `f32`, those above 4 · 10⁸, infinity and NaN.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{Endianness, InstBuilder, MemFlagsData, Value, types};

use super::quadrants::{QUARTERS, Quadrants, TO_WHOLE};
use crate::codegen::emitter::Emitter;

/// π/2
pub(crate) const QUARTER: f64 = std::f64::consts::FRAC_PI_2;
/// The first 25 bits of π/2.
pub(crate) const QUARTER_HEAD: f64 = 1.57079631090164184570;
/// The remaining bits of π/2.
pub(crate) const QUARTER_TAIL: f64 = 1.58932547735281966916e-08;

/// The largest argument that is reduced in one step: 9π/4 in `f32`.
pub(crate) const ONE_STEP: f64 = f32::from_bits(0x40e2_31d5) as f64;
/// A little less than 2²⁸ π/2, above which `libm` reduces with more digits.
pub(crate) const LARGEST: f64 = 4.0e8;
/// Above this, the argument is near an odd multiple of π/4.
pub(crate) const NEXT_QUADRANT: f64 = std::f64::consts::FRAC_PI_4 - 1.0 / 262_144.0;

/// sin y = y + y³·(S₀ + y²·S₁ + …) for |y| ≤ π/4
pub(crate) const SINE: [f64; 4] = [
    -0.166666666416265235595,
    0.0083333293858894631756,
    -0.000198393348360966317347,
    0.0000027183114939898219064,
];

/// cos y = 1 + y²·(C₀ + y²·C₁ + …) for |y| ≤ π/4
pub(crate) const COSINE: [f64; 4] = [
    -0.499999997251031003120,
    0.0416666233237390631894,
    -0.00138867637746099294692,
    0.0000243904487962774090654,
];

impl Emitter<'_, '_> {
    /// The lower and the upper half of a vector in `f32`, as vectors in `f64`.
    pub(super) fn halves(&mut self, v: Value) -> [Value; 2] {
        let upper = self.mix([v, v], [8, 8]);
        [v, upper].map(|half| self.builder.ins().fvpromote_low(half))
    }

    /// Both halves of a vector, rounded to `f32`.
    pub(super) fn joined(&mut self, halves: [Value; 2]) -> Value {
        let halves = halves.map(|half| self.builder.ins().fvdemote(half));
        self.mix(halves, [0, 16])
    }

    /// Eight bytes from each place of two vectors that stand one after the other.
    fn mix(&mut self, vectors: [Value; 2], [low, high]: [u8; 2]) -> Value {
        let flags = MemFlagsData::new().with_endianness(Endianness::Little);
        let [a, b] = vectors.map(|v| self.builder.ins().bitcast(types::I8X16, flags, v));
        let bytes: Vec<u8> = (low..low + 8).chain(high..high + 8).collect();
        let mask = self.builder.func.dfg.immediates.push(bytes.into());
        let mixed = self.builder.ins().shuffle(a, b, mask);
        self.builder.ins().bitcast(types::F32X4, flags, mixed)
    }

    /// Sines and cosines within a quadrant, of numbers that are in `f32`.
    pub(super) fn single_quadrants(&mut self, x: Value) -> Quadrants {
        let x = self.abs(x);
        let to_whole = self.constant(TO_WHOLE);
        let quarters = self.times(x, QUARTERS);
        let sum = self.builder.ins().fadd(quarters, to_whole);
        let multiple = self.builder.ins().fsub(sum, to_whole);
        let whole = self.times(multiple, QUARTER);
        let near = self.builder.ins().fsub(x, whole);
        let (head, tail) = (self.times(multiple, QUARTER_HEAD), self.times(multiple, QUARTER_TAIL));
        let far = self.builder.ins().fsub(x, head);
        let far = self.builder.ins().fsub(far, tail);
        let one_step = self.constant(ONE_STEP);
        let is_near = self.compare(FloatCC::LessThanOrEqual, x, one_step);
        let y = self.select(is_near, near, far);

        let (size, most, largest) = (self.abs(y), self.constant(NEXT_QUADRANT), self.constant(LARGEST));
        // also true for NaN
        let is_beside = self.builder.ins().fcmp(FloatCC::UnorderedOrGreaterThan, size, most);
        let is_large = self.builder.ins().fcmp(FloatCC::GreaterThan, x, largest);
        let rare = self.builder.ins().bor(is_beside, is_large);
        let (sine, cosine) = self.single_kernels(y);
        Quadrants { sine, cosine, sum, rare }
    }

    fn single_kernels(&mut self, y: Value) -> (Value, Value) {
        let z = self.builder.ins().fmul(y, y);
        let w = self.builder.ins().fmul(z, z);
        let [s1, s2, s3, s4] = SINE.map(|s| self.constant(s));
        let cube = self.builder.ins().fmul(z, y);
        let low = self.multiply_add(z, s2, s1);
        let low = self.multiply_add(cube, low, y);
        let seventh = self.builder.ins().fmul(cube, w);
        let high = self.multiply_add(z, s4, s3);
        let sine = self.multiply_add(seventh, high, low);

        let [c0, c1, c2, c3] = COSINE.map(|c| self.constant(c));
        let one = self.constant(1.0);
        let low = self.multiply_add(z, c0, one);
        let low = self.multiply_add(w, c1, low);
        let sixth = self.builder.ins().fmul(w, z);
        let high = self.multiply_add(z, c3, c2);
        (sine, self.multiply_add(sixth, high, low))
    }
}
