//! Numbers that are bounds from above: every operation rounds up, and unknown numbers stay unknown (∞).

use crate::interval::Interval;

fn known(x: f64) -> f64 {
    if x.is_nan() { f64::INFINITY } else { x }
}

/// a + b
pub fn add(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { a + b } else { known((a + b).next_up()) }
}

/// a·b
pub fn mul(a: f64, b: f64) -> f64 {
    if a.is_infinite() || b.is_infinite() {
        f64::INFINITY
    } else if a == 0.0 || b == 0.0 {
        0.0
    } else {
        (a * b).next_up()
    }
}

/// a/b for a lower bound b of the divisor.
pub fn div(a: f64, b: f64) -> f64 {
    if b > 0.0 && a.is_finite() { known((a / b).next_up()) } else { f64::INFINITY }
}

/// √a
pub fn root(a: f64) -> f64 {
    known(a.sqrt().next_up())
}

/// (1 + a)(1 + b) − 1
pub fn compound(a: f64, b: f64) -> f64 {
    add(add(a, b), mul(a, b))
}

/// The largest |x| of an interval.
pub fn magnitude(range: Interval) -> f64 {
    range.lo.abs().max(range.hi.abs())
}

/// The smallest |x| of an interval.
pub fn smallest_magnitude(range: Interval) -> f64 {
    if range.lo > 0.0 {
        range.lo
    } else if range.hi < 0.0 {
        -range.hi
    } else {
        0.0
    }
}
