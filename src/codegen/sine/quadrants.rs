//! The choice of quadrant: sine and cosine of an argument from those of its remainder, with their signs.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Type, Value, types};

use super::wanted::Wanted;
use crate::codegen::emitter::{ENDIANNESS, Emitter};

/// 1.5 · 2⁵². Adding it to a number below 2⁵¹ rounds that to a whole number, which the last bits of the sum
/// hold.
pub(crate) const TO_WHOLE: f64 = 1.5 / f64::EPSILON;
/// 2/π
pub(crate) const QUARTERS: f64 = std::f64::consts::FRAC_2_PI;

/// Results in lanes of `f64`, before quadrants are chosen.
pub(super) struct Quadrants {
    /// Sine and cosine of the remainder, which is the magnitude of the argument minus the nearest multiple of
    /// π/2.
    pub sine: Value,
    pub cosine: Value,
    /// A number whose last bits hold the multiple.
    pub sum: Value,
    /// A mask of the lanes that `libm` computes in another way.
    pub rare: Value,
}

impl Emitter<'_, '_> {
    /// The wanted results, the sine first, from those of the remainder.
    pub(super) fn choose(&mut self, x: Value, quadrants: &Quadrants, wanted: Wanted) -> Vec<Value> {
        let &Quadrants { sine, cosine, sum, .. } = quadrants;
        let [sine, cosine, multiple] = [sine, cosine, sum].map(|v| self.whole(v));
        let [zero, one] = [0, 1].map(|n| {
            let scalar = self.builder.ins().iconst(types::I64, n);
            self.builder.ins().splat(types::I64X2, scalar)
        });
        let last = self.builder.ins().band(multiple, one);
        let is_even = self.builder.ins().icmp(IntCC::Equal, last, zero);
        let sign_bit = self.constant(-0.0);
        let sign_bit = self.whole(sign_bit);
        // bit 1 of the multiple, moved to the place of the sign, and bit 0
        let [half_turns, quarter_turns] =
            [62, 63].map(|distance| self.builder.ins().ishl_imm_u(multiple, distance));
        let mut results = Vec::new();
        if wanted.sine {
            let x = self.whole(x);
            let turns = self.builder.ins().bxor(half_turns, x);
            results.push((self.builder.ins().bitselect(is_even, sine, cosine), turns));
        }
        if wanted.cosine {
            let turns = self.builder.ins().bxor(half_turns, quarter_turns);
            results.push((self.builder.ins().bitselect(is_even, cosine, sine), turns));
        }
        let signed = results.into_iter().map(|(size, turns)| {
            let sign = self.builder.ins().band(turns, sign_bit);
            let result = self.builder.ins().bxor(size, sign);
            self.lanes_as(types::F64X2, result)
        });
        signed.collect()
    }

    /// a·b + c, rounded twice.
    pub(super) fn multiply_add(&mut self, a: Value, b: Value, c: Value) -> Value {
        let product = self.builder.ins().fmul(a, b);
        self.builder.ins().fadd(c, product)
    }

    pub(super) fn times(&mut self, a: Value, factor: f64) -> Value {
        let factor = self.constant(factor);
        self.builder.ins().fmul(a, factor)
    }

    /// The bits of numbers as integers, for shifts and masks.
    fn whole(&mut self, numbers: Value) -> Value {
        self.lanes_as(types::I64X2, numbers)
    }

    fn lanes_as(&mut self, lanes: Type, v: Value) -> Value {
        self.builder.ins().bitcast(lanes, MemFlagsData::new().with_endianness(ENDIANNESS), v)
    }
}
