//! Ranges of atan and atan2, in both lanes at once and without a call.
//!
//! Over a box that holds neither the origin nor a point of the cut behind it, atan2 has its extreme values in
//! two corners. Angles are odd functions of the first operand, so the negated lower bound is the angle of a
//! corner too, and one evaluation gives both bounds.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{InstBuilder, Value};

use super::{BoundLane, Ranges, ULP};

/// atan(√s)/√s = Σ cᵢ·sⁱ for √s ≤ tan(π/8), to 3e-18: the polynomial that interpolates at Chebyshev's points.
const COEFFICIENTS: [f64; 13] = [
    1.0,
    -0.33333333333333326,
    0.19999999999997012,
    -0.1428571428532936,
    0.11111111085301238,
    -0.0909090805829841,
    0.07692281083678901,
    -0.06666205023178091,
    0.058768317098427496,
    -0.05217297919655059,
    0.044994415067496046,
    -0.03338645225903317,
    0.01511237643149517,
];

/// tan(π/8). Tangents above it are replaced by those of π/4 less.
const STEEP: f64 = 0.41421356237309503;

/// Relative widening of an angle: at most 8 roundings here, in either direction, and one and a half in the
/// library.
const MARGIN: f64 = 16.0 * ULP;

/// Absolute widening of an angle where its tangent underflows.
const LEAST: f64 = 1e-300;

/// Points nearer to the origin than this are moved away from it by a factor. So close to the smallest number,
/// the error of a product with a tangent may be as large as the product.
const TINY: f64 = 1e-280;
const FACTOR: f64 = (1_u64 << 60) as f64;

impl Ranges<'_, '_> {
    pub(super) fn atan(&mut self, a: Value) -> Value {
        let one = self.emitter.constant(1.0);
        self.angle(a, one)
    }

    /// The angles of the points (x, y), and a mask of where they may jump.
    pub(super) fn atan2(&mut self, y: Value, x: Value) -> (Value, Value) {
        let zero = self.emitter.constant(0.0);
        let [low, high] = [BoundLane::Low, BoundLane::High].map(|lane| self.both(x, lane));
        let low = self.emitter.negate(low);
        // the greatest angle is at the least x where y may be positive, and on the right at the greatest y
        let is_above = self.emitter.compare(FloatCC::LessThan, zero, y);
        let at_x = self.emitter.select(is_above, low, high);
        let (turned, is_right) = (self.swap(y), self.emitter.compare(FloatCC::LessThanOrEqual, zero, at_x));
        let least = self.emitter.negate(turned);
        let at_y = self.emitter.select(is_right, y, least);
        let angles = self.angle(at_y, at_x);

        let (below, above) = (self.emitter.compare(FloatCC::LessThanOrEqual, zero, y), self.swap(y));
        let above = self.emitter.compare(FloatCC::LessThanOrEqual, zero, above);
        let is_behind = self.emitter.compare(FloatCC::LessThanOrEqual, low, zero);
        let crosses = self.emitter.builder.ins().band(below, above);
        let jumps = self.emitter.builder.ins().band(crosses, is_behind);
        let all = self.emitter.constant(std::f64::consts::PI.next_up());
        (self.emitter.select(jumps, all, angles), jumps)
    }

    /// Bounds from above of the angle of a point in each lane.
    fn angle(&mut self, y: Value, x: Value) -> Value {
        use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};
        let (to_x, to_y) = (self.emitter.abs(x), self.emitter.abs(y));
        let (least, most) = (self.min(to_x, to_y), self.emitter.max(to_x, to_y));
        let [steep, none, eighth, quarter, half, zero] =
            [STEEP, -0.0, FRAC_PI_4, FRAC_PI_2, PI, 0.0].map(|c| self.emitter.constant(c));
        let [tiny, factor, one] = [TINY, FACTOR, 1.0].map(|c| self.emitter.constant(c));
        let is_tiny = self.emitter.compare(FloatCC::LessThan, most, tiny);
        let factor = self.emitter.select(is_tiny, factor, one);
        let (least, most) = (self.fmul(least, factor), self.fmul(most, factor));

        // tan(α − π/4) = (tan α − 1)/(tan α + 1)
        let limit = self.fmul(most, steep);
        let is_steep = self.emitter.compare(FloatCC::LessThan, limit, least);
        let moved = self.emitter.select(is_steep, most, none);
        let below = self.emitter.select(is_steep, least, none);
        let (above, below) = (self.emitter.builder.ins().fsub(least, moved), self.fadd(most, below));
        let tangent = self.emitter.builder.ins().fdiv(above, below);
        let square = self.fmul(tangent, tangent);
        let ratio = self.polynomial(square);
        let angle = self.fmul(tangent, ratio);
        let start = self.emitter.select(is_steep, eighth, none);
        let angle = self.fadd(angle, start);

        let is_upright = self.emitter.compare(FloatCC::LessThan, to_x, to_y);
        let rest = self.emitter.builder.ins().fsub(quarter, angle);
        let angle = self.emitter.select(is_upright, rest, angle);
        let is_left = self.emitter.compare(FloatCC::LessThan, x, zero);
        let rest = self.emitter.builder.ins().fsub(half, angle);
        let angle = self.emitter.select(is_left, rest, angle);

        let (margin, lost) = (self.emitter.constant(MARGIN), self.emitter.constant(LEAST));
        let margin = self.fmul(angle, margin);
        let margin = self.fadd(margin, lost);
        let sign = self.emitter.builder.ins().band(y, none);
        let angle = self.emitter.builder.ins().bor(angle, sign);
        self.fadd(angle, margin)
    }

    /// Evaluated by pairs, so that half of the products do not wait for each other.
    fn polynomial(&mut self, s: Value) -> Value {
        let square = self.fmul(s, s);
        let mut coefficients = COEFFICIENTS.iter().rev();
        let mut sum = match coefficients.next() {
            Some(&last) => self.emitter.constant(last),
            None => self.emitter.constant(0.0),
        };
        while let (Some(&odd), Some(&even)) = (coefficients.next(), coefficients.next()) {
            let (odd, even) = (self.emitter.constant(odd), self.emitter.constant(even));
            let pair = self.fmul(odd, s);
            let pair = self.fadd(pair, even);
            let product = self.fmul(sum, square);
            sum = self.fadd(product, pair);
        }
        sum
    }
}
