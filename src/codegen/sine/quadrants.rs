//! Which function of what remains of an argument is its sine or cosine, and with which sign.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Type, Value, types};

use super::wanted::Wanted;
use crate::codegen::emitter::{ENDIANNESS, Emitter};

/// 1.5 · 2⁵²: a number below 2⁵¹ that is added to it is rounded to a whole one, which its last bits then hold.
pub(super) const TO_WHOLE: f64 = 1.5 / f64::EPSILON;
/// 2/π
pub(super) const QUARTERS: f64 = std::f64::consts::FRAC_2_PI;

/// Lanes of `f64` as far as they are known without their quadrants.
pub(super) struct Quadrants {
    /// Those of what remains when the nearest multiple of π/2 is taken from the magnitude of the argument.
    pub sine: Value,
    pub cosine: Value,
    /// A number whose last bits hold the multiple.
    pub sum: Value,
    /// A mask of the lanes that `libm` finds in another way.
    pub rare: Value,
}

impl Emitter<'_, '_> {
    /// Those that are wanted, the sine first, from what is known of them.
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
        // bit 1 of the multiple where the sign is, and bit 0
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

    /// The bits of numbers, to be moved and chosen.
    fn whole(&mut self, numbers: Value) -> Value {
        self.lanes_as(types::I64X2, numbers)
    }

    fn lanes_as(&mut self, lanes: Type, v: Value) -> Value {
        self.builder.ins().bitcast(lanes, MemFlagsData::new().with_endianness(ENDIANNESS), v)
    }
}
