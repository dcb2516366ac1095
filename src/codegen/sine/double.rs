//! Sine and cosine in `f64`, by the algorithms of `libm::sin` and `libm::cos` for nearly all arguments.
//!
//! `libm` treats some arguments differently: it reduces in more steps where much cancels, and cuts quadrants
//! at numbers that are a little beyond odd multiples of π/4. These arguments, one in 1000 of those up to 100,
//! are recognised by their remainder; so are those above 50 000, infinity and NaN.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{InstBuilder, Value};

use super::quadrants::{QUARTERS, Quadrants, TO_WHOLE};
use crate::codegen::emitter::Emitter;

/// The first 33 bits of π/2.
pub(crate) const QUARTER: f64 = 1.57079632673412561417;
/// The remaining bits of π/2.
pub(crate) const QUARTER_TAIL: f64 = 6.07710050650619224932e-11;

/// `libm` reduces an argument further if less than this part of it remains. It compares exponents, so this
/// limit also takes some arguments that it does not reduce.
pub(crate) const CANCELLED: f64 = 1.0 / 65_536.0;
/// Above this, the argument is near an odd multiple of π/4. `libm` knows the multiples up to the ninth to 20
/// bits only.
pub(crate) const NEXT_QUADRANT: f64 = std::f64::consts::FRAC_PI_4 - 1.0 / 65_536.0;

/// sin y = y + y³·(S₀ + y²·S₁ + …) for |y| ≤ π/4
pub(crate) const SINE: [f64; 6] = [
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
];

/// cos y = 1 − y²/2 + y⁴·(C₀ + y²·C₁ + …) for |y| ≤ π/4
pub(crate) const COSINE: [f64; 6] = [
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
];

/// The magnitude of an argument minus the nearest multiple of π/2. The sign is restored at the end: sine is
/// odd, cosine even.
struct Reduced {
    /// The remainder y, |y| ≤ π/4, and its error.
    y: Value,
    tail: Value,
    /// The multiple as a number, and as the last bits of a number.
    multiple: Value,
    sum: Value,
    /// A mask of the lanes that `libm` reduces in another way.
    rare: Value,
}

impl Emitter<'_, '_> {
    /// Sines and cosines within a quadrant.
    pub(super) fn double_quadrants(&mut self, x: Value) -> Quadrants {
        let reduced = self.reduce(x);
        let square = self.builder.ins().fmul(reduced.y, reduced.y);
        let (sine, cosine) = (self.sine_kernel(&reduced, square), self.cosine_kernel(&reduced, square));
        Quadrants { sine, cosine, sum: reduced.sum, rare: reduced.rare }
    }

    fn reduce(&mut self, x: Value) -> Reduced {
        let x = self.abs(x);
        let to_whole = self.constant(TO_WHOLE);
        let quarters = self.times(x, QUARTERS);
        let sum = self.builder.ins().fadd(quarters, to_whole);
        let multiple = self.builder.ins().fsub(sum, to_whole);
        let product = self.times(multiple, QUARTER);
        let rest = self.builder.ins().fsub(x, product);
        let rest_tail = self.times(multiple, QUARTER_TAIL);
        let y = self.builder.ins().fsub(rest, rest_tail);
        let lost = self.builder.ins().fsub(rest, y);
        let tail = self.builder.ins().fsub(lost, rest_tail);

        let (size, least) = (self.abs(y), self.times(x, CANCELLED));
        let most = self.constant(NEXT_QUADRANT);
        let is_small = self.builder.ins().fcmp(FloatCC::LessThan, size, least);
        // also true for NaN
        let is_large = self.builder.ins().fcmp(FloatCC::UnorderedOrGreaterThan, size, most);
        let rare = self.builder.ins().bor(is_small, is_large);
        Reduced { y, tail, multiple, sum, rare }
    }

    fn sine_kernel(&mut self, reduced: &Reduced, z: Value) -> Value {
        let &Reduced { y, tail, multiple, .. } = reduced;
        let [s1, s2, s3, s4, s5, s6] = SINE.map(|s| self.constant(s));
        let w = self.builder.ins().fmul(z, z);
        let low = self.multiply_add(z, s4, s3);
        let low = self.multiply_add(z, low, s2);
        let high = self.multiply_add(z, s6, s5);
        let sixth = self.builder.ins().fmul(z, w);
        let r = self.multiply_add(sixth, high, low);
        let cube = self.builder.ins().fmul(z, y);

        // near zero, where nothing was subtracted
        let plain = self.multiply_add(z, r, s1);
        let plain = self.builder.ins().fmul(cube, plain);
        // elsewhere
        let half = self.times(tail, 0.5);
        let product = self.builder.ins().fmul(cube, r);
        let difference = self.builder.ins().fsub(half, product);
        let difference = self.builder.ins().fmul(z, difference);
        let difference = self.builder.ins().fsub(difference, tail);
        let first = self.builder.ins().fmul(cube, s1);
        let exact = self.builder.ins().fsub(first, difference);

        let zero = self.constant(0.0);
        let is_plain = self.compare(FloatCC::Equal, multiple, zero);
        let correction = self.select(is_plain, plain, exact);
        self.builder.ins().fadd(y, correction)
    }

    fn cosine_kernel(&mut self, reduced: &Reduced, z: Value) -> Value {
        let &Reduced { y, tail, .. } = reduced;
        let [c1, c2, c3, c4, c5, c6] = COSINE.map(|c| self.constant(c));
        let w = self.builder.ins().fmul(z, z);
        let low = self.multiply_add(z, c3, c2);
        let low = self.multiply_add(z, low, c1);
        let low = self.builder.ins().fmul(z, low);
        let high = self.multiply_add(z, c6, c5);
        let high = self.multiply_add(z, high, c4);
        let fourth = self.builder.ins().fmul(w, w);
        let r = self.multiply_add(fourth, high, low);

        let (half, one) = (self.times(z, 0.5), self.constant(1.0));
        let near = self.builder.ins().fsub(one, half);
        let lost = self.builder.ins().fsub(one, near);
        let lost = self.builder.ins().fsub(lost, half);
        let (first, second) = (self.builder.ins().fmul(z, r), self.builder.ins().fmul(y, tail));
        let rest = self.builder.ins().fsub(first, second);
        let rest = self.builder.ins().fadd(lost, rest);
        self.builder.ins().fadd(near, rest)
    }
}
