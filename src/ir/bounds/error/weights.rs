//! How R₀ hands errors of its operands on: the largest weights over two ranges.

use crate::interval::Interval;
use crate::ir::bounds::upper::{add, mul, root};

/// The largest w_u·e + w_v·f over two ranges of the operands of ∧.
///
/// With θ the direction of (u, v) it is e + f − (e·cos θ + f·sin θ): along the directions that the ranges
/// cover it is largest at one of their ends, which are directions of corners, or at (−e, −f) if that is one
/// of them.
pub fn through_weights(u: Interval, v: Interval, e: f64, f: f64) -> f64 {
    let apart = add(mul(largest_weight(u, v), e), mul(largest_weight(v, u), f));
    let anywhere = add(add(e, f), root(add(mul(e, e), mul(f, f))));
    let bound = apart.min(anywhere);
    let holds_origin = u.contains(0.0) && v.contains(0.0);
    if holds_origin || e == 0.0 || f == 0.0 || !bound.is_finite() || holds_ray(u, v, e, f) {
        return bound;
    }
    let corners = [(u.lo, v.lo), (u.lo, v.hi), (u.hi, v.lo), (u.hi, v.hi)];
    let at_corners = corners.into_iter().map(|(u, v)| {
        let (u, v) = (Interval::point(u), Interval::point(v));
        add(mul(largest_weight(u, v), e), mul(largest_weight(v, u), f))
    });
    bound.min(at_corners.fold(0.0, f64::max))
}

/// Whether the ranges may hold a point t·(−e, −f), t ≥ 0, for positive e and f; in doubt they do.
fn holds_ray(u: Interval, v: Interval, e: f64, f: f64) -> bool {
    let (above, right) = ([-u.hi / e, -u.lo / e], [-v.hi / f, -v.lo / f]);
    let (first, last) = (above[0].max(right[0]), above[1].min(right[1]));
    // each end is good to one rounding; NaN is in doubt
    !(last < 0.0 || first > last + 1e-14 * (first.abs() + last.abs()))
}

/// The largest weight 1 − u/√(u² + v²) of u in u ∧ v over two ranges: u/h falls with u, and with |v| it comes
/// nearer to zero.
fn largest_weight(u: Interval, v: Interval) -> f64 {
    let across = v.abs();
    let v = if u.lo >= 0.0 { across.hi } else { across.lo };
    let plain = (u.lo * u.lo + v * v).sqrt();
    // squares may leave the range
    let h = if (1e-140..1e150).contains(&plain) { plain } else { libm::hypot(u.lo, v) };
    let cosine = u.lo / h;
    // a corner, an infinite bound
    if !cosine.is_finite() || !(1e-290..f64::MAX).contains(&h) {
        return 2.0;
    }
    // the cosine and the difference are good to five roundings
    (1.0 - cosine + 1e-15).clamp(0.0, 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_largest_at_a_corner() {
        let weight =
            |u: [f64; 2], v: [f64; 2]| largest_weight(Interval::new(u[0], u[1]), Interval::new(v[0], v[1]));
        assert!((weight([3.0, 5.0], [-4.0, 2.0]) - 0.4).abs() < 1e-14);
        assert!((weight([-3.0, 5.0], [4.0, 9.0]) - 1.6).abs() < 1e-14);
        assert_eq!(weight([-3.0, 5.0], [-1.0, 9.0]), 2.0);
        assert_eq!(weight([0.0, 0.0], [0.0, 0.0]), 2.0);
        // both at once: the worst direction of a quarter of the plane, a corner, or (−e, −f) itself
        let both = |u: [f64; 2], v: [f64; 2], e, f| {
            through_weights(Interval::new(u[0], u[1]), Interval::new(v[0], v[1]), e, f)
        };
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-13, "{found}");
        close(both([3.0, 4.0], [3.0, 4.0], 1.0, 1.0), 0.6);
        close(both([-5.0, -3.0], [-5.0, -3.0], 3.0, 4.0), 12.0);
        close(both([-3.0, -3.0], [4.0, 4.0], 1.0, 1.0), 1.6 + 0.2);
        close(both([-1.0, 1.0], [-1.0, 1.0], 1.0, 1.0), 2.0 + 2f64.sqrt());
    }

    proptest::proptest! {
        #[test]
        fn no_direction_is_worse_than_the_bound(
            lo in proptest::array::uniform2(-3.0..3.0f64),
            size in proptest::array::uniform2(0.0..3.0f64),
            at in proptest::array::uniform2(0.0..=1.0f64),
            e in 0.0..2.0f64,
            f in 0.0..2.0f64,
        ) {
            let ranges = [0, 1].map(|i| Interval::new(lo[i], lo[i] + size[i]));
            let [u, v] = [0, 1].map(|i| (lo[i] + at[i] * size[i]).clamp(ranges[i].lo, ranges[i].hi));
            let h = u.hypot(v);
            let here = (1.0 - u / h) * e + (1.0 - v / h) * f;
            let bound = through_weights(ranges[0], ranges[1], e, f);
            proptest::prop_assert!(here <= bound + 1e-14, "{here} exceeds {bound}");
        }
    }
}
