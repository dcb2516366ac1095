//! What a node is far from the origin: a power of the distance times a number in an interval.
//!
//! A point is written as p = s·u: its scale s is its largest coordinate, and the direction u lies on a face of the
//! cube with corners at ±1. For all scales between 2^l₀ and 2^l₁ and all directions of a box, a node is s^degree times
//! a factor of an interval. A sum has the larger of both degrees, and the other operand adds a part that dwindles with
//! s, so a sixth power outgrows a fifth one: the intervals of values themselves are both infinite there.
//!
//! Programs overflow. A node that may have done so has the sign of its factor, and is larger than it should be; a sum
//! in which it is the smaller operand is known only if the larger one is infinite, too.

use super::forward::{self, POSITIVE};
use super::sets::meet;
use crate::interval::Interval;
use crate::ir::op::Binary;

/// The scales 2^l between two exponents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// The smaller exponent.
    pub from: f64,
    /// The larger exponent.
    pub to: f64,
}

/// A node far from the origin.
#[derive(Debug, Clone, Copy)]
pub struct Growth {
    /// The power of the scale.
    pub degree: f64,
    /// What the power is multiplied with.
    pub factor: Interval,
    /// The exponent of the scale from which programs may have got an infinite value.
    pub may_overflow: f64,
    /// That from which the value is infinite, or no number, in any case.
    pub overflows: f64,
}

/// Exponents of values that are far from the largest and the smallest numbers.
const LARGE: f64 = 1000.0;
const SMALL: f64 = -1000.0;

/// Exponents from which all values are infinite.
const INFINITE: f64 = 1026.0;

/// Relative error of powers of the scale, whose exponents are rounded.
const OF_SCALE: f64 = 1e-11;

/// Rounding errors of an operation, and of the program's, in units in the last place.
const ROUNDING: u32 = 4;

impl Scales {
    /// s to the power of a degree. What is below or above all numbers has an end that is none: as 0 it would let another
    /// operand decide a sign.
    fn power(self, degree: f64) -> Interval {
        if degree == 0.0 {
            return Interval::point(1.0);
        }
        let (a, b) = ((degree * self.from).exp2(), (degree * self.to).exp2());
        let (lo, hi) = (a.min(b) * (1.0 - OF_SCALE), a.max(b) * (1.0 + OF_SCALE));
        let lo = if lo < f64::MIN_POSITIVE { 0.0 } else { lo.min(f64::MAX) };
        Interval { lo, hi: hi.max(f64::MIN_POSITIVE) }
    }
}

impl Growth {
    /// A number that does not grow.
    pub fn number(value: Interval) -> Self {
        let unknown = if value.is_bounded() { f64::INFINITY } else { f64::NEG_INFINITY };
        Self { degree: 0.0, factor: value, may_overflow: unknown, overflows: f64::INFINITY }
    }

    /// A coordinate, from those of the directions.
    pub fn coordinate(direction: Interval) -> Self {
        Self { degree: 1.0, factor: direction, may_overflow: f64::INFINITY, overflows: f64::INFINITY }
    }

    /// Nothing is known.
    pub const UNKNOWN: Self = Self {
        degree: 0.0,
        factor: Interval::ALL,
        may_overflow: f64::NEG_INFINITY,
        overflows: f64::INFINITY,
    };

    /// What is known together with the values for all points, of which the smaller ones are kept.
    pub fn within(self, values: Interval, scales: Scales) -> Self {
        if self.degree == 0.0 && !self.may_fail(scales) {
            return meet(self.factor, values).map_or(self, |factor| Self { factor, ..self });
        }
        let size = |factor: Interval, degree: f64| {
            factor.lo.abs().max(factor.hi.abs()).log2() + degree * scales.from
        };
        let is_smaller = size(values, 0.0) < size(self.factor, self.degree);
        if values.is_bounded() && (self.may_fail(scales) || is_smaller) { Self::number(values) } else { self }
    }

    /// The values for all scales.
    pub fn values(self, scales: Scales) -> Interval {
        if self.may_overflow <= scales.to {
            return Interval::ALL;
        }
        (self.factor * scales.power(self.degree)).widened(ROUNDING)
    }

    /// Whether it may be infinite, and what is computed from it may be no number.
    pub fn may_fail(self, scales: Scales) -> bool {
        self.may_overflow <= scales.to
    }

    /// With another factor and degree, after an operation of which the value is as large as that says. It is infinite
    /// where operands are.
    fn with(degree: f64, factor: Interval, operands: &[Self], scales: Scales) -> Self {
        let exponents = |size: f64| [scales.from, scales.to].map(|l| size.log2() + degree * l);
        // small values lose digits, or are zero
        let rounded = |end: f64| {
            let is_small = end != 0.0 && exponents(end.abs()).into_iter().any(|exponent| exponent < SMALL);
            if is_small { [2.0 * end, 0.0] } else { [end, end] }
        };
        let ends = [rounded(factor.lo), rounded(factor.hi)].concat();
        let factor = Interval::new(
            ends.iter().copied().fold(f64::INFINITY, f64::min),
            ends.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        );
        let reaches = |size: f64, limit: f64| {
            if size <= 0.0 {
                f64::INFINITY
            } else if exponents(size)[0] >= limit || !size.is_finite() {
                f64::NEG_INFINITY
            } else if degree > 0.0 {
                (limit - size.log2()) / degree
            } else {
                f64::INFINITY
            }
        };
        let most = factor.lo.abs().max(factor.hi.abs());
        let least = if factor.contains(0.0) { 0.0 } else { factor.lo.abs().min(factor.hi.abs()) };
        let earliest = operands.iter().fold(f64::INFINITY, |earliest, of| earliest.min(of.may_overflow));
        let overflows = if least.is_finite() { reaches(least, INFINITE) } else { f64::INFINITY };
        Self { degree, factor, may_overflow: earliest.min(reaches(most, LARGE)), overflows }
    }

    /// The factors of two nodes for the larger of their degrees, and that degree.
    pub fn aligned(a: Self, b: Self, scales: Scales) -> ([Interval; 2], f64) {
        let degree = a.degree.max(b.degree);
        ([a, b].map(|of| of.factor * scales.power(of.degree - degree)), degree)
    }

    pub fn negated(self) -> Self {
        Self { factor: -self.factor, ..self }
    }

    pub fn abs(self) -> Self {
        Self { factor: self.factor.abs(), ..self }
    }

    /// A sum. Where one operand may have become infinite too early, the other decides only if it is infinite itself.
    pub fn plus(self, other: Self, scales: Scales) -> Self {
        let ([a, b], degree) = Self::aligned(self, other, scales);
        let factor = (a + b).widened(ROUNDING);
        let sum = Self::with(degree, factor, &[self, other], scales);
        if factor.contains(0.0) {
            return sum;
        }
        let has_sign = |of: Interval| if factor.lo > 0.0 { of.lo > 0.0 } else { of.hi < 0.0 };
        let decides = |larger: Self, smaller: Self| {
            smaller.may_overflow > scales.to || larger.overflows <= smaller.may_overflow
        };
        let is_known = match (has_sign(a), has_sign(b)) {
            (true, true) => true,
            (true, false) => decides(self, other),
            (false, true) => decides(other, self),
            (false, false) => false,
        };
        if is_known { sum } else { Self::UNKNOWN }
    }

    pub fn times(self, other: Self, scales: Scales) -> Self {
        let factor = (self.factor * other.factor).widened(ROUNDING);
        Self::with(self.degree + other.degree, factor, &[self, other], scales)
    }

    pub fn over(self, other: Self, scales: Scales) -> Self {
        if other.factor.contains(0.0) || other.may_overflow <= scales.to {
            return Self::UNKNOWN;
        }
        let factor = (self.factor / other.factor).widened(ROUNDING);
        Self::with(self.degree - other.degree, factor, &[self, other], scales)
    }

    /// A whole power, which is above zero.
    pub fn to_the(self, exponent: u32, scales: Scales) -> Self {
        let factor = forward::power(self.factor, exponent).widened(ROUNDING.saturating_mul(exponent));
        Self::with(self.degree * f64::from(exponent), factor, &[self], scales)
    }

    /// The power of a number that is not negative; `None` if there is none.
    pub fn real_power(self, exponent: f64, scales: Scales) -> Option<Self> {
        // (−∞)^0.1 is ∞
        if self.factor.lo < 0.0 && self.may_fail(scales) {
            return Some(Self::UNKNOWN);
        }
        let base = meet(self.factor, POSITIVE)?;
        if exponent < 0.0 && (base.lo == 0.0 || self.may_fail(scales)) {
            return Some(Self::UNKNOWN);
        }
        let (a, b) = (libm::pow(base.lo, exponent), libm::pow(base.hi, exponent));
        let factor = Interval { lo: a.min(b) * (1.0 - OF_SCALE), hi: a.max(b) * (1.0 + OF_SCALE) };
        Some(Self::with(self.degree * exponent, factor, &[self], scales))
    }

    /// The smaller operand, or what has its sign and grows like the operands.
    pub fn smaller(op: Binary, a: Self, b: Self, scales: Scales) -> Self {
        let (factors, degree) = Self::aligned(a, b, scales);
        let factor = forward::binary(op, factors[0], factors[1]).range.unwrap_or(Interval::ALL);
        let operands = [a, b];
        let mut found = Self::with(degree, factor.widened(ROUNDING), &operands, scales);
        if op == Binary::And {
            // the squares of operands overflow and underflow earlier: the result is then off by a factor, or infinite
            let Interval { lo, hi } = found.factor;
            let smaller = factors[0].hi.min(factors[1].hi);
            let (lo, hi) =
                (if lo < 0.0 { 2.0 * lo } else { 0.5 * lo }, if hi > 0.0 { 2.0 * hi } else { 0.5 * hi });
            found.factor = Interval { lo, hi: hi.max(smaller) };
            if !Self::have_squares(factors, degree, scales) {
                found.may_overflow = f64::NEG_INFINITY;
            }
        }
        // programs find the sign of what dwindles, too
        let (mut factor, least) = (found.factor, f64::MIN_POSITIVE);
        if operands.iter().any(|of| of.factor.hi < 0.0) {
            factor = Interval { lo: factor.lo.min(-least), hi: factor.hi.min(-least) };
        } else if operands.iter().all(|of| of.factor.lo > 0.0) {
            factor = Interval { lo: factor.lo.max(least), hi: factor.hi.max(least) };
        }
        // an infinite operand is not always chosen
        Self { factor, overflows: f64::INFINITY, ..found }
    }

    /// Whether the squares of two numbers, and their sum, are numbers in programs at all scales.
    fn have_squares(factors: [Interval; 2], degree: f64, scales: Scales) -> bool {
        let most = factors.into_iter().fold(0.0, |most: f64, a| most.max(a.lo.abs()).max(a.hi.abs()));
        [scales.from, scales.to].iter().all(|l| (most.log2() + degree * l).abs() < 0.5 * LARGE)
    }

    /// An operation that has the same value where both operands are k times as large.
    pub fn of_directions(op: Binary, a: Self, b: Self, scales: Scales) -> Self {
        if a.may_fail(scales) || b.may_fail(scales) {
            return Self::UNKNOWN;
        }
        let ([a, b], degree) = Self::aligned(a, b, scales);
        if matches!(op, Binary::AndWeight | Binary::OrWeight) && !Self::have_squares([a, b], degree, scales) {
            return Self::UNKNOWN;
        }
        Self::number(forward::binary(op, a, b).range.unwrap_or(Interval::ALL))
    }
}

#[cfg(test)]
mod tests {
    use super::{Growth, Interval, Scales};

    /// Programs round once for each factor.
    #[test]
    fn powers_above_a_thousand_are_as_uncertain_as_all_their_factors() {
        let exponent = 60_000;
        let base = Growth::number(Interval::point(1.0001));
        let power = base.to_the(exponent, Scales { from: 1.0, to: 2.0 }).factor;
        let uncertain = power.hi / power.lo - 1.0;
        assert!(uncertain > 8.0 * f64::from(exponent) * f64::EPSILON && uncertain < 1e-9, "{uncertain}");
    }

    /// With a power that is exactly zero 10⁴⁰ − (x/1000)¹⁰⁰ would end at 2048, where it is still positive.
    #[test]
    fn powers_beyond_all_numbers_keep_their_sign() {
        let scales = Scales { from: 11.0, to: 12.0 };
        let small = scales.power(-100.0);
        assert!(small.lo == 0.0 && small.hi > 0.0, "{small:?}");
        let large = scales.power(100.0);
        assert!(large.lo.is_finite() && large.hi == f64::INFINITY, "{large:?}");
        let usual = scales.power(2.0);
        assert!(usual.lo < 2_f64.powi(22) && usual.hi > 2_f64.powi(24) && usual.hi < 1.001 * 2_f64.powi(24));
    }
}
