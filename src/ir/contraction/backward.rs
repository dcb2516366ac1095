//! The operands that are possible for a given value.
//!
//! Each rule starts from the value of an operation, widened by its rounding error, and returns the remaining
//! part of one operand. Rules that cannot exclude anything return the operand unchanged.

use std::f64::consts::{FRAC_PI_2, PI};

use super::forward::{POSITIVE, sum, whole_exponent};
use super::sets::{meet, meet_either};
use crate::interval::Interval;
use crate::ir::function::{BinaryFunction, UnaryFunction};
use crate::ir::op::{Binary, Unary};

/// The remaining part of the operand a of a unary operation, given its value.
pub fn unary(op: Unary, value: Interval, a: Interval) -> Option<Interval> {
    match op {
        Unary::Neg => meet(a, -value),
        Unary::Abs => either_sign(a, meet(value, POSITIVE)?),
        Unary::Sqrt => {
            let value = meet(value.widened(1), POSITIVE)?;
            meet(meet(a, POSITIVE)?, value.square().widened(1))
        }
        Unary::Sign if value.lo > 0.0 => meet(a, POSITIVE),
        Unary::Sign if value.hi < 0.0 => meet(a, -POSITIVE),
        Unary::Sign => Some(a),
        Unary::Floor => meet(a, Interval { lo: value.lo.ceil(), hi: (value.hi.floor() + 1.0).next_up() }),
        Unary::Round => {
            meet(a, Interval { lo: value.lo.ceil() - 0.5, hi: value.hi.floor() + 0.5 }.widened(1))
        }
        Unary::Call(function) => call(function, value.widened(4), a),
    }
}

fn call(function: UnaryFunction, value: Interval, a: Interval) -> Option<Interval> {
    let within = |reach: f64| value.lo > -reach && value.hi < reach;
    match function {
        UnaryFunction::Sin => wave(value, a),
        UnaryFunction::Cos => {
            let shift = |by: f64, x: Interval| (x + Interval::point(by)).widened(2);
            let moved = wave(value, shift(FRAC_PI_2, a))?;
            let slack = 1e-12 * (1.0 + moved.lo.abs().max(moved.hi.abs()));
            meet(a, Interval { lo: moved.lo - FRAC_PI_2 - slack, hi: moved.hi - FRAC_PI_2 + slack })
        }
        UnaryFunction::Tan if a.lo > -1.57 && a.hi < 1.57 => meet(a, value.increasing(libm::atan)),
        UnaryFunction::Tan => Some(a),
        UnaryFunction::Asin => {
            let angle = meet(value, Interval { lo: -FRAC_PI_2, hi: FRAC_PI_2 }.widened(4))?;
            meet(a, angle.sin().widened(4))
        }
        UnaryFunction::Acos => {
            let angle = meet(value, Interval { lo: 0.0, hi: PI }.widened(4))?;
            meet(a, angle.cos().widened(4))
        }
        UnaryFunction::Atan if within(1.57) => meet(a, value.increasing(libm::tan)),
        UnaryFunction::Atan => Some(a),
        UnaryFunction::Exp => {
            // below the smallest number an exponential is 0
            let lo = if value.lo > 1e-300 { libm::log(value.lo) - 1e-12 } else { f64::NEG_INFINITY };
            let hi = if value.hi > 1e-300 { libm::log(value.hi) } else { -690.0 };
            let slack = 1e-14 * hi.abs().max(1.0);
            meet(a, Interval { lo: lo - 1e-14 * lo.abs().min(1e300), hi: hi + slack })
        }
        UnaryFunction::Ln => logarithm(value.increasing(libm::exp), a),
        UnaryFunction::Log2 => logarithm(value.increasing(libm::exp2), a),
        UnaryFunction::Log10 => logarithm(value.increasing(libm::exp10), a),
        UnaryFunction::Sinh => meet(a, value.increasing(libm::asinh).widened(64)),
        UnaryFunction::Cosh => {
            let value = meet(value, Interval { lo: 1.0, hi: f64::INFINITY })?;
            // steep where the cosine is 1
            let slack = |x: f64| 1e-7 + 1e-12 * x.min(1e300);
            let (lo, hi) = (libm::acosh(value.lo), libm::acosh(value.hi));
            either_sign(a, Interval { lo: (lo - slack(lo)).max(0.0), hi: hi + slack(hi) })
        }
        UnaryFunction::Tanh => {
            let lo = if value.lo > -1.0 { libm::atanh(value.lo) } else { f64::NEG_INFINITY };
            let hi = if value.hi < 1.0 { libm::atanh(value.hi) } else { f64::INFINITY };
            meet(a, Interval::new(lo, hi).widened(64))
        }
    }
}

/// Positive numbers whose logarithm may be a value.
fn logarithm(value: Interval, a: Interval) -> Option<Interval> {
    meet(a, Interval { lo: value.lo.max(0.0) * (1.0 - 1e-12), hi: value.hi * (1.0 + 1e-12) })
}

/// The angles within an interval whose sine may be a value, searched piece by piece between a trough and a
/// crest.
fn wave(value: Interval, a: Interval) -> Option<Interval> {
    let value = meet(value, Interval { lo: -1.0, hi: 1.0 })?;
    if a.width() > 8.0 * PI || a.lo.abs().max(a.hi.abs()) > 1e5 {
        return Some(a);
    }
    let slack = 1e-9;
    let (first, last) = ((a.lo / PI).round() as i64 - 1, (a.hi / PI).round() as i64 + 1);
    let mut left: Option<Interval> = None;
    for piece in first..=last {
        let rises = piece % 2 == 0;
        let (lo, hi) = (libm::asin(value.lo), libm::asin(value.hi));
        let (lo, hi) = if rises { (lo, hi) } else { (-hi, -lo) };
        let middle = piece as f64 * PI;
        if let Some(found) = meet(a, Interval { lo: middle + lo - slack, hi: middle + hi + slack }) {
            left = Some(left.map_or(found, |left| left.hull(found)));
        }
    }
    left
}

/// The remaining parts of both operands of an operation, given its value.
pub fn binary(op: Binary, value: Interval, a: Interval, b: Interval) -> Option<[Interval; 2]> {
    let rounded = value.widened(1);
    match op {
        Binary::Add => {
            let a = meet(a, sum(rounded, -b))?;
            Some([a, meet(b, sum(rounded, -a))?])
        }
        Binary::Sub => {
            let a = meet(a, sum(rounded, b))?;
            Some([a, meet(b, sum(a, -rounded))?])
        }
        Binary::MulOrZero if value.contains(0.0) && b.contains(0.0) => Some([a, b]),
        Binary::Mul | Binary::MulOrZero => {
            let a = factor(rounded, b, a)?;
            Some([a, factor(rounded, a, b)?])
        }
        Binary::Div | Binary::DivOrZero => quotient(op, rounded, a, b),
        Binary::Min | Binary::PlainMin => smaller(value, a, b),
        Binary::Max | Binary::PlainMax => {
            let [a, b] = smaller(-value, -a, -b)?;
            Some([-a, -b])
        }
        Binary::And => conjunction(value, a, b),
        Binary::Or => {
            let [a, b] = conjunction(-value, -a, -b)?;
            Some([-a, -b])
        }
        Binary::MinWeight | Binary::MaxWeight | Binary::AndWeight | Binary::OrWeight => Some([a, b]),
        Binary::Call(BinaryFunction::Pow) => general_power(value.widened(4), a, b),
        Binary::Call(BinaryFunction::Atan2) => angle(value, a, b),
    }
}

/// The numbers t of `within` for which t·y is a value for some y.
pub fn factor(value: Interval, y: Interval, within: Interval) -> Option<Interval> {
    if !y.contains(0.0) {
        return meet(within, value / y);
    }
    if value.contains(0.0) {
        return Some(within);
    }
    let least = if value.lo > 0.0 { value.lo } else { -value.hi };
    // |t| is at least `least`/|y|; t has the sign of the value where y is positive
    let at_least = |reach: f64| Interval { lo: (least / reach).next_down().max(0.0), hi: f64::INFINITY };
    let with_positive = (y.hi > 0.0).then(|| at_least(y.hi));
    let with_negative = (y.lo < 0.0).then(|| -at_least(-y.lo));
    let signed = |t: Interval| if value.lo > 0.0 { t } else { -t };
    match (with_positive.map(signed), with_negative.map(signed)) {
        (Some(a), Some(b)) => meet_either(within, [a, b]),
        (Some(t), None) | (None, Some(t)) => meet(within, t),
        (None, None) => None,
    }
}

/// a/b = value. Where b may be zero the quotient is infinite, or 0 by definition; where b is infinite the
/// quotient is 0, whatever a is.
fn quotient(op: Binary, value: Interval, a: Interval, b: Interval) -> Option<[Interval; 2]> {
    if op == Binary::DivOrZero && b.contains(0.0) {
        return Some([a, b]);
    }
    if !b.is_bounded() && value.contains(0.0) {
        return Some([a, b]);
    }
    let is_finite = value.is_bounded();
    let left = if b.contains(0.0) && !is_finite { a } else { meet(a, (value * b).widened(1))? };
    let b = if is_finite || !b.contains(0.0) { factor(left, value, b)? } else { b };
    Some([left, b])
}

/// min(a, b) = value
fn smaller(value: Interval, a: Interval, b: Interval) -> Option<[Interval; 2]> {
    let above = Interval { lo: value.lo, hi: f64::INFINITY };
    let (a, b) = (meet(a, above)?, meet(b, above)?);
    Some([
        if b.lo > value.hi { meet(a, value)? } else { a },
        if a.lo > value.hi { meet(b, value)? } else { b },
    ])
}

/// a ∧ b = value. It is never above the smaller operand, and grows with both.
fn conjunction(value: Interval, a: Interval, b: Interval) -> Option<[Interval; 2]> {
    let value = value.widened(8);
    let above = Interval { lo: value.lo, hi: f64::INFINITY };
    let (a, b) = (meet(a, above)?, meet(b, above)?);
    let a_below = Interval { lo: f64::NEG_INFINITY, hi: partner(value.hi, b.lo) };
    let b_below = Interval { lo: f64::NEG_INFINITY, hi: partner(value.hi, a.lo) };
    Some([meet(a, a_below)?, meet(b, b_below)?])
}

/// The largest a for which a ∧ `other` is at most `most`: a = (2·other·most − most²)/2(other − most).
fn partner(most: f64, other: f64) -> f64 {
    let scale = most.abs() + other.abs();
    if !(other - most > 1e-6 * scale && scale < 1e150 && scale > 1e-140) {
        return f64::INFINITY;
    }
    let found = most * (2.0 * other - most) / (2.0 * (other - most));
    // the difference has lost six digits at most
    found + 1e-9 * (found.abs() + most.abs())
}

/// The remaining part of the base of a whole power.
pub fn power(value: Interval, a: Interval, exponent: u32) -> Option<Interval> {
    let value = value.widened(exponent.saturating_mul(2).min(200));
    if exponent.is_multiple_of(2) {
        let value = meet(value, POSITIVE)?;
        return either_sign(
            a,
            Interval { lo: root(value.lo, exponent, false), hi: root(value.hi, exponent, true) },
        );
    }
    let signed = |x: f64, up: bool| if x < 0.0 { -root(-x, exponent, !up) } else { root(x, exponent, up) };
    meet(a, Interval { lo: signed(value.lo, false), hi: signed(value.hi, true) })
}

/// A bound of the root of a non-negative number.
fn root(x: f64, exponent: u32, up: bool) -> f64 {
    if x == 0.0 || x == f64::INFINITY {
        return x;
    }
    if exponent == 2 {
        let root = x.sqrt();
        return if up { root.next_up() } else { root.next_down() };
    }
    let root = libm::pow(x, 1.0 / f64::from(exponent));
    root * if up { 1.0 + 1e-12 } else { 1.0 - 1e-12 }
}

/// The numbers of an interval whose magnitude lies in another interval.
fn either_sign(a: Interval, magnitude: Interval) -> Option<Interval> {
    meet_either(a, [magnitude, -magnitude])
}

/// The remaining part of e in (±e + q)·(±e + s), with the slopes and offsets of both factors.
pub fn slab(value: Interval, e: Interval, first: (f64, f64), second: (f64, f64)) -> Option<Interval> {
    let roots = [-first.1 * first.0, -second.1 * second.0];
    if roots.iter().any(|root| !root.is_finite()) {
        return Some(e);
    }
    let (low, high) = (roots[0].min(roots[1]), roots[0].max(roots[1]));
    // σ·(e − low)·(e − high): its sign is exact, because the signs of differences are
    let sigma = first.0 * second.0;
    if sigma < 0.0 && value.lo == 0.0 {
        return meet(e, Interval { lo: low, hi: high });
    }
    // σ(t² − h²) = value with t = e − middle
    let (middle, half) = (0.5 * low + 0.5 * high, 0.5 * (high - low));
    let value = value.widened(4);
    let square = sum(if sigma < 0.0 { -value } else { value }, Interval::point(half * half).widened(4));
    let square = meet(square, POSITIVE)?;
    let t = Interval { lo: root(square.lo, 2, false), hi: root(square.hi, 2, true) };
    let slack = 4.0 * f64::EPSILON * (middle.abs() + high.abs() + low.abs());
    let slack_at = |x: f64| slack + 1e-14 * x.abs();
    let right =
        Interval { lo: middle + t.lo - slack_at(t.lo), hi: middle + t.hi + slack_at(t.hi.min(1e300)) };
    let left = Interval { lo: middle - t.hi - slack_at(t.hi.min(1e300)), hi: middle - t.lo + slack_at(t.lo) };
    meet_either(e, [left, right])
}

/// aᵇ = value for a fixed exponent b that is not whole, or a base that is positive.
fn general_power(value: Interval, a: Interval, b: Interval) -> Option<[Interval; 2]> {
    if let Some(exponent) = whole_exponent(b) {
        return Some([power(value, a, exponent)?, b]);
    }
    let fixed = b.lo == b.hi && b.lo != 0.0 && b.lo.is_finite();
    let has_negative_powers = b.lo.fract() == 0.0 && (a.lo < 0.0 || a.lo == 0.0 && b.lo < 0.0);
    if !fixed || has_negative_powers || !a.lo.is_finite() {
        return Some([a, b]);
    }
    let (a, value) = (meet(a, POSITIVE)?, meet(value, POSITIVE)?);
    let inverse = |x: f64, up: bool| {
        let found = libm::pow(x, 1.0 / b.lo);
        // ln x is below 750, and its product with the error of 1/b below 1e-12
        found * if up { 1.0 + 1e-12 } else { 1.0 - 1e-12 }
    };
    let ends = if b.lo > 0.0 { (value.lo, value.hi) } else { (value.hi, value.lo) };
    let (lo, hi) = (inverse(ends.0, false), inverse(ends.1, true));
    if lo.is_nan() || hi.is_nan() {
        return Some([a, b]);
    }
    Some([meet(a, Interval { lo, hi })?, b])
}

/// atan2(a, b) = value
fn angle(value: Interval, a: Interval, b: Interval) -> Option<[Interval; 2]> {
    let slack = 1e-9;
    let mut left = [a, b];
    if value.lo > slack && value.hi < PI - slack {
        left[0] = meet(a, POSITIVE)?;
    } else if value.hi < -slack && value.lo > slack - PI {
        left[0] = meet(a, -POSITIVE)?;
    }
    if value.lo > slack - FRAC_PI_2 && value.hi < FRAC_PI_2 - slack {
        left[1] = meet(b, POSITIVE)?;
    }
    Some(left)
}
