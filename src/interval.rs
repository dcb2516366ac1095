//! Closed intervals with outward rounding. They enclose the results of real arithmetic and are
//! never narrower.
//!
//! The result of every operation contains the exact image of its operands: results of the correctly rounded
//! operations (+ − × ÷ √) are widened by one unit in the last place, those of library functions by four.
//! Where an operation is undefined at a point (√ of a negative number, division by an interval around zero)
//! the result is [`Interval::ALL`], which also stands for "may be NaN".

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A closed interval with `lo ≤ hi`. Either end may be infinite, and neither is NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The lower end.
    pub lo: f64,
    /// The upper end.
    pub hi: f64,
}

/// Neighbours that are gone through one by one.
const MOST_STEPS: u32 = 1000;

impl Interval {
    /// All reals, and possibly NaN: nothing is known.
    pub const ALL: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// The interval that holds one number only.
    pub const fn point(x: f64) -> Self {
        Self { lo: x, hi: x }
    }

    /// The interval between two bounds. It is [`Interval::ALL`] if they are out of order or NaN.
    pub fn new(lo: f64, hi: f64) -> Self {
        if lo <= hi { Self { lo, hi } } else { Self::ALL }
    }

    /// Whether a number is in the interval. NaN is in none.
    pub fn contains(&self, x: f64) -> bool {
        self.lo <= x && x <= self.hi
    }

    /// Whether both ends are finite.
    pub fn is_bounded(&self) -> bool {
        self.lo.is_finite() && self.hi.is_finite()
    }

    /// The length of the interval.
    pub fn width(&self) -> f64 {
        self.hi - self.lo
    }

    /// The smallest interval that contains both intervals.
    pub fn hull(&self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// The interval with its ends `ulps` floating-point neighbours further out. Exact zeros stay zero, so
    /// that a widened bound never loses a sign.
    #[must_use]
    pub fn widened(self, ulps: u32) -> Self {
        if ulps > MOST_STEPS {
            return self.widened_at_once(f64::from(ulps));
        }
        let (mut lo, mut hi) = (self.lo, self.hi);
        for _ in 0..ulps {
            if lo != 0.0 {
                lo = lo.next_down();
            }
            if hi != 0.0 {
                hi = hi.next_up();
            }
        }
        Self::new(lo, hi)
    }

    /// Wider by so many neighbours of each end, or up to twice as many, in one step: none is farther away than a rounding
    /// error of the end, or the smallest number above zero.
    fn widened_at_once(self, ulps: f64) -> Self {
        let step = |end: f64| match end.is_finite() {
            true => ulps * (f64::EPSILON * end.abs() + f64::from_bits(1)),
            false => 0.0,
        };
        let (lo, hi) = (self.lo - step(self.lo), self.hi + step(self.hi));
        // beyond zero no end goes
        Self::new(
            if self.lo >= 0.0 { lo.max(0.0) } else { lo },
            if self.hi <= 0.0 { hi.min(0.0) } else { hi },
        )
    }

    /// The interval with its ends one neighbour further out. That includes zeros, because a result that was
    /// rounded to zero may have been non-zero.
    fn rounded_out(lo: f64, hi: f64) -> Self {
        Self::new(lo.next_down(), hi.next_up())
    }

    /// The squares x² of the numbers in the interval. They are never negative, while a product of the
    /// interval with itself could be.
    pub fn square(self) -> Self {
        let (a, b) = (self.lo * self.lo, self.hi * self.hi);
        let hi = a.max(b).next_up();
        if self.contains(0.0) {
            return Self::new(0.0, hi);
        }
        Self::new(a.min(b).next_down().max(0.0), hi)
    }

    /// The square roots. [`Interval::ALL`] if the interval holds a negative number.
    pub fn sqrt(self) -> Self {
        if self.lo < 0.0 {
            return Self::ALL;
        }
        Self::new(self.lo.sqrt().next_down().max(0.0), self.hi.sqrt().next_up())
    }

    /// The absolute values.
    pub fn abs(self) -> Self {
        if self.lo >= 0.0 {
            self
        } else if self.hi <= 0.0 {
            -self
        } else {
            Self { lo: 0.0, hi: self.hi.max(-self.lo) }
        }
    }

    /// The smaller of two numbers, one from each interval.
    pub fn min(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.min(other.hi) }
    }

    /// The larger of two numbers, one from each interval.
    pub fn max(self, other: Self) -> Self {
        Self { lo: self.lo.max(other.lo), hi: self.hi.max(other.hi) }
    }

    /// The image under a function that never decreases and is exact to four units in the last place.
    pub fn increasing(self, f: impl Fn(f64) -> f64) -> Self {
        let (lo, hi) = (f(self.lo), f(self.hi));
        if lo.is_nan() || hi.is_nan() {
            return Self::ALL;
        }
        Self::rounded_out(lo, hi).widened(3)
    }

    /// The sines of angles in radians.
    pub fn sin(self) -> Self {
        self.periodic(libm::sin, std::f64::consts::FRAC_PI_2)
    }

    /// The cosines of angles in radians.
    pub fn cos(self) -> Self {
        self.periodic(libm::cos, 0.0)
    }

    /// The image under sin or cos: the extremes lie at the ends, or are ±1 if a crest (at `crest + 2πk`) or a
    /// trough lies between them.
    fn periodic(self, f: impl Fn(f64) -> f64, crest: f64) -> Self {
        use std::f64::consts::{PI, TAU};
        // beyond 2^20 the position of a crest is no longer known to a useful accuracy
        if self.width() >= TAU || self.lo.abs().max(self.hi.abs()) >= f64::from(1 << 20) {
            return Self { lo: -1.0, hi: 1.0 };
        }
        let slack = 1e-9;
        let spans = |at: f64| {
            let first = ((self.lo - slack - at) / TAU).ceil() * TAU + at;
            first <= self.hi + slack
        };
        let (a, b) = (f(self.lo), f(self.hi));
        let ends = Self::rounded_out(a.min(b), a.max(b)).widened(3);
        Self {
            lo: if spans(crest + PI) { -1.0 } else { ends.lo.max(-1.0) },
            hi: if spans(crest) { 1.0 } else { ends.hi.min(1.0) },
        }
    }
}

/// The product of two bounds. 0 · ∞ is 0 here, because an infinite bound is a limit that no operand reaches.
fn bound_product(a: f64, b: f64) -> f64 {
    let product = a * b;
    if product.is_nan() { 0.0 } else { product }
}

/// The least and the greatest of four bounds, none of which is NaN.
fn extremes([a, b, c, d]: [f64; 4]) -> (f64, f64) {
    // one instruction each, where f64::min is three
    let less = |x: f64, y: f64| if x < y { x } else { y };
    let more = |x: f64, y: f64| if x > y { x } else { y };
    (less(less(a, b), less(c, d)), more(more(a, b), more(c, d)))
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        let sum = Self::rounded_out(self.lo + b.lo, self.hi + b.hi);
        // a sum of squares stays one, however it rounds
        if self.lo >= 0.0 && b.lo >= 0.0 { Self { lo: sum.lo.max(0.0), ..sum } } else { sum }
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        self + -b
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        let corners = [
            bound_product(self.lo, b.lo),
            bound_product(self.lo, b.hi),
            bound_product(self.hi, b.lo),
            bound_product(self.hi, b.hi),
        ];
        let (lo, hi) = extremes(corners);
        let both_positive = self.lo >= 0.0 && b.lo >= 0.0;
        let out = Self::rounded_out(lo, hi);
        if both_positive { Self { lo: out.lo.max(0.0), ..out } } else { out }
    }
}

impl Div for Interval {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        if b.contains(0.0) {
            return Self::ALL;
        }
        let corners = [self.lo / b.lo, self.lo / b.hi, self.hi / b.lo, self.hi / b.hi];
        if corners.iter().any(|c| c.is_nan()) {
            return Self::ALL; // ∞/∞
        }
        let (lo, hi) = extremes(corners);
        Self::rounded_out(lo, hi)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn many_neighbours_are_as_far_as_one_by_one() {
        for (lo, hi) in [(1.0, 2.0), (-3e300, -1e-300), (5e-324, 7e-310), (0.0, f64::MAX), (-7.1, 0.0)] {
            let of = Interval::new(lo, hi);
            let one_by_one = (0..5).fold(of, |of, _| of.widened(MOST_STEPS));
            let (at_once, twice) = (of.widened(5 * MOST_STEPS), one_by_one.widened(5 * MOST_STEPS));
            assert!(
                at_once.lo <= one_by_one.lo && one_by_one.hi <= at_once.hi,
                "{at_once:?}, {one_by_one:?}"
            );
            assert!(twice.lo <= at_once.lo && at_once.hi <= twice.hi, "{at_once:?}, {twice:?}");
        }
    }

    fn interval() -> impl Strategy<Value = Interval> {
        (-10.0..10.0f64, 0.0..5.0f64).prop_map(|(lo, width)| Interval::new(lo, lo + width))
    }

    proptest! {
        #[test]
        fn operations_contain_the_image(a in interval(), b in interval(), s in 0.0..1.0f64, t in 0.0..1.0f64) {
            let x = (a.lo + s * (a.hi - a.lo)).clamp(a.lo, a.hi);
            let y = (b.lo + t * (b.hi - b.lo)).clamp(b.lo, b.hi);
            prop_assert!((a + b).contains(x + y));
            prop_assert!((a - b).contains(x - y));
            prop_assert!((a * b).contains(x * y));
            prop_assert!((a / b).contains(x / y));
            prop_assert!(a.square().contains(x * x));
            prop_assert!(a.abs().contains(x.abs()));
            prop_assert!(a.sin().contains(x.sin()));
            prop_assert!(a.cos().contains(x.cos()));
            prop_assert!(a.min(b).contains(x.min(y)));
            prop_assert!(a.abs().sqrt().contains(x.abs().sqrt()));
        }
    }

    #[test]
    fn undefined_points_widen_to_all() {
        assert_eq!(Interval::new(-1.0, 4.0).sqrt(), Interval::ALL);
        assert_eq!(Interval::point(1.0) / Interval::new(-1.0, 1.0), Interval::ALL);
        assert_eq!(Interval::new(f64::NAN, 1.0), Interval::ALL);
    }
}
