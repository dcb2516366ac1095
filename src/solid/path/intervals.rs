//! Where on a path something may hold, or surely does: sorted intervals of the path's parameter t, and the
//! roots of quadratics that bound them.
//!
//! Invariant: a root is rounded to the side that is asked for, so "may hold" never loses a point and "surely
//! holds" never gains one.

use smallvec::SmallVec;

use crate::ir::Enclosure;

/// Disjoint closed intervals in ascending order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PathIntervals(SmallVec<[(f64, f64); 4]>);

/// To which side of the truth an answer may err.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The answer may hold more than the truth.
    More,
    /// The answer may hold less than the truth.
    Less,
}

/// Where a leaf, or a tree of them, may be at least zero, and where it surely is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NotNegative {
    pub possible: PathIntervals,
    pub certain: PathIntervals,
}

impl PathIntervals {
    pub fn one(stretch: (f64, f64)) -> Self {
        Self(SmallVec::from_slice(&[stretch]))
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn iter(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.0.iter().copied()
    }

    /// From the beginning of the first to the end of the last.
    pub fn hull(&self) -> Option<(f64, f64)> {
        Some((self.0.first()?.0, self.0.last()?.1))
    }

    /// Adds an interval that begins where the last one does, or later.
    pub fn push(&mut self, (begin, end): (f64, f64)) {
        match self.0.last_mut() {
            Some(last) if begin <= last.1 => last.1 = last.1.max(end),
            _ => self.0.push((begin, end)),
        }
    }

    pub fn union(&self, other: &Self) -> Self {
        let (mut a, mut b) = (self.0.iter().peekable(), other.0.iter().peekable());
        let mut out = Self::default();
        loop {
            let from_a = match (a.peek(), b.peek()) {
                (Some(x), Some(y)) => x.0 <= y.0,
                (x, _) => x.is_some(),
            };
            match if from_a { a.next() } else { b.next() } {
                Some(&stretch) => out.push(stretch),
                None => return out,
            }
        }
    }

    pub fn intersection(&self, other: &Self) -> Self {
        let (mut i, mut j) = (0, 0);
        let mut out = Self::default();
        while let (Some(a), Some(b)) = (self.0.get(i), other.0.get(j)) {
            let common = (a.0.max(b.0), a.1.min(b.1));
            if common.0 <= common.1 {
                out.push(common);
            }
            if a.1 < b.1 { i += 1 } else { j += 1 }
        }
        out
    }

    /// What is not in the other, with its borders.
    pub fn without(&self, other: &Self) -> Self {
        let mut out = Self::default();
        for &(begin, end) in &self.0 {
            let mut left = begin;
            for hole in other.0.iter().filter(|hole| hole.1 >= begin && hole.0 <= end) {
                if hole.0 > left {
                    out.0.push((left, hole.0));
                }
                left = hole.1;
            }
            if left < end {
                out.0.push((left, end));
            }
        }
        out
    }

    /// The part within an interval.
    pub fn within(&self, (begin, end): (f64, f64)) -> Self {
        self.intersection(&Self::one((begin, end)))
    }
}

impl NotNegative {
    /// Where what is enclosed over [t₀, t₁] may be at least zero, and where it is.
    pub fn of(enclosure: &Enclosure, (t0, t1): (f64, f64)) -> Self {
        let [a, b, c] = enclosure.coefficients;
        let placed = |stretches: PathIntervals, side: Side| {
            let mut out = PathIntervals::default();
            for (begin, end) in stretches.iter() {
                let (begin, end) = match side {
                    Side::More => ((t0 + begin).next_down().max(t0), (t0 + end).next_up().min(t1)),
                    Side::Less => ((t0 + begin).next_up().min(t1), (t0 + end).next_down().max(t0)),
                };
                if begin <= end {
                    out.push((begin, end));
                }
            }
            out
        };
        let width = t1 - t0;
        let possible = if enclosure.range.hi < 0.0 {
            PathIntervals::default()
        } else {
            placed(not_negative([a.hi, b.hi, c.hi], width, Side::More), Side::More)
        };
        let certain = if enclosure.range.lo >= 0.0 {
            PathIntervals::one((t0, t1))
        } else {
            placed(not_negative([a.lo, b.lo, c.lo], width, Side::Less), Side::Less)
        };
        Self { possible: possible.union(&certain), certain }
    }

    pub fn within(&self, stretch: (f64, f64)) -> Self {
        Self { possible: self.possible.within(stretch), certain: self.certain.within(stretch) }
    }
}

/// Where c₀ + c₁s + c₂s² ≥ 0 for 0 ≤ s ≤ width.
///
/// The discriminant is moved by its rounding error to the side asked for, the root of larger magnitude is
/// q/c₂ with q = −½(c₁ ± √D), the other c₀/q: no cancellation, so a few ε cover their own roundings. (c₀/q
/// belongs to a quadratic whose discriminant has moved a little; where c₀ and c₂ have one sign it moves to
/// the same side, where they have not nothing cancels in D, and it moves by a few ε.)
fn not_negative([c0, c1, c2]: [f64; 3], width: f64, side: Side) -> PathIntervals {
    const ROUNDINGS: f64 = 16.0 * f64::EPSILON;
    let more = side == Side::More;
    let (everything, nothing) = (PathIntervals::one((0.0, width)), PathIntervals::default());
    let change = (c1.abs() + c2.abs() * width) * width;
    if c0.abs() > change * (1.0 + ROUNDINGS) {
        return if c0 > 0.0 { everything } else { nothing };
    }
    let largest = c0.abs().max(c1.abs()).max(c2.abs());
    if !largest.is_finite() || c0.is_nan() || c1.is_nan() || c2.is_nan() {
        return if more { everything } else { nothing };
    }
    if !(1e-100..1e100).contains(&largest) && largest > 0.0 {
        // the same roots, in the middle of the range of numbers; scaling by a power of two is exact
        let scale = libm::scalbn(1.0, -libm::ilogb(largest));
        return not_negative([c0, c1, c2].map(|c| c * scale), width, side);
    }
    let size = c1 * c1 + (4.0 * c0 * c2).abs();
    // a root moved away from or towards the part where the polynomial is not negative
    let moved = |root: f64, up: bool| {
        if root.is_infinite() {
            return root; // c₂ is next to nothing; infinity less infinity is no number
        }
        let by = ROUNDINGS * root.abs() + f64::MIN_POSITIVE;
        if up { root + by } else { root - by }
    };
    let clipped = |begin: f64, end: f64| {
        let (begin, end) = (begin.max(0.0), end.min(width));
        if begin <= end { PathIntervals::one((begin, end)) } else { PathIntervals::default() }
    };
    if c2 == 0.0 {
        if c1 == 0.0 {
            return if c0 >= 0.0 { everything } else { nothing };
        }
        let root = -c0 / c1;
        return if c1 > 0.0 { clipped(moved(root, !more), width) } else { clipped(0.0, moved(root, more)) };
    }
    let concave = c2 < 0.0; // not negative between the roots, otherwise outside them
    let slack = 4.0 * f64::EPSILON * size + f64::MIN_POSITIVE;
    let discriminant = c1 * c1 - 4.0 * c0 * c2;
    let discriminant = if concave == more { discriminant + slack } else { discriminant - slack };
    if discriminant < 0.0 {
        return if concave { nothing } else { everything };
    }
    let q = -0.5 * (c1 + discriminant.sqrt().copysign(c1));
    let first = q / c2;
    let second = if q == 0.0 { first } else { c0 / q };
    let (low, high) = (first.min(second), first.max(second));
    if concave {
        return clipped(moved(low, !more), moved(high, more));
    }
    let (low, high) = (moved(low, more), moved(high, !more));
    if low >= high {
        return everything;
    }
    clipped(0.0, low).union(&clipped(high, width))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interval::Interval;
    use proptest::prelude::*;

    fn set(list: &[(f64, f64)]) -> PathIntervals {
        PathIntervals(SmallVec::from_slice(list))
    }

    #[test]
    fn sets_are_joined_and_cut() {
        let a = set(&[(0.0, 0.2), (0.5, 0.6), (0.8, 1.0)]);
        let b = set(&[(0.1, 0.55), (0.9, 0.95)]);
        assert_eq!(a.union(&b), set(&[(0.0, 0.6), (0.8, 1.0)]));
        assert_eq!(a.intersection(&b), set(&[(0.1, 0.2), (0.5, 0.55), (0.9, 0.95)]));
        assert_eq!(a.without(&b), set(&[(0.0, 0.1), (0.55, 0.6), (0.8, 0.9), (0.95, 1.0)]));
        assert_eq!(a.within((0.55, 0.85)), set(&[(0.55, 0.6), (0.8, 0.85)]));
        assert_eq!(a.hull(), Some((0.0, 1.0)));
        assert_eq!(PathIntervals::default().union(&b), b);
    }

    /// The sign of c₀ + c₁s + c₂s² in integers: all numbers are multiples of 2⁻²⁰ below 2⁴.
    fn exact_sign(c: [i64; 3], s: i64) -> i128 {
        let [c0, c1, c2] = c.map(i128::from);
        let s = i128::from(s);
        ((c0 << 40) + ((c1 * s) << 20) + c2 * s * s).signum()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn no_point_is_lost_and_none_is_invented(
            c in prop::array::uniform3(-(1i64 << 24)..1i64 << 24),
            flat in prop::bool::weighted(0.1),
            double in prop::option::of(0i64..1 << 10),
            at in 0i64..=1 << 20,
        ) {
            let mut c = c;
            if flat {
                c[2] = 0;
            }
            if let Some(root) = double {
                // a(s − root)²: the discriminant vanishes
                let (a, root) = ((c[2] % 8) << 20, root << 10);
                let square = (((i128::from(a) * i128::from(root)) >> 20) * i128::from(root)) >> 20;
                c = [square as i64, -2 * (a >> 10) * (root >> 10), a];
            }
            let unit = 1.0 / f64::from(1 << 20);
            let coefficients = c.map(|c| c as f64 * unit);
            let enclosure = Enclosure { coefficients: coefficients.map(Interval::point), range: Interval::ALL };
            let met = NotNegative::of(&enclosure, (0.0, 1.0));
            let holds = |stretches: &PathIntervals, s: f64| stretches.iter().any(|(a, b)| a <= s && s <= b);
            let mut places = vec![at];
            places.extend(double.map(|root| root << 10));
            for s in places {
                let (sign, s) = (exact_sign(c, s), s as f64 * unit);
                prop_assert!(sign < 0 || holds(&met.possible, s), "{c:?} lost {s}: {met:?}");
                prop_assert!(sign >= 0 || !holds(&met.certain, s), "{c:?} invented {s}: {met:?}");
            }
            for (begin, end) in met.certain.iter() {
                prop_assert!(holds(&met.possible, begin) && holds(&met.possible, end));
            }
        }
    }
}
