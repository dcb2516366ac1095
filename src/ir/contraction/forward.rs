//! The numbers that an operation may return.

use super::rule::Rule;
use super::sets::meet;
use crate::interval::Interval;
use crate::ir::bounds::range::{self, Region};
use crate::ir::function::{BinaryFunction, UnaryFunction};
use crate::ir::graph::{Axis, Expr};
use crate::ir::lookup::Tables;
use crate::ir::op::{Binary, Unary};

pub const POSITIVE: Interval = Interval { lo: 0.0, hi: f64::INFINITY };
const UP_TO_ONE: Interval = Interval { lo: -1.0, hi: 1.0 };

/// The possible values of a node.
#[derive(Debug, Clone, Copy)]
pub struct Numbers {
    /// The numbers; `None` if it is undefined everywhere.
    pub range: Option<Interval>,
    /// Whether the operation may be undefined for some of its operands.
    pub may_fail: bool,
}

impl From<Interval> for Numbers {
    fn from(range: Interval) -> Self {
        Self { range: Some(range), may_fail: false }
    }
}

/// The values of an operation for operands in a domain; it is undefined for the others.
fn partial(operand: Interval, domain: Interval, f: impl Fn(Interval) -> Interval) -> Numbers {
    let defined = meet(operand, domain);
    Numbers { range: defined.map(f), may_fail: defined != Some(operand) }
}

/// The possible values of a node with this rule; `of` returns those of its operands.
pub fn numbers(
    rule: &Rule,
    of: impl Fn(crate::ir::Node) -> Interval,
    region: &Region<'_>,
    tables: &Tables,
) -> Numbers {
    match *rule {
        Rule::Power { of: base, exponent } => power(of(base), exponent).into(),
        Rule::Slab { of: e, first, second } => {
            let rule = range::RangeRule::Slab { of: e, first, second };
            rule.over(of).unwrap_or(Interval::ALL).into()
        }
        Rule::Plain(Expr::Unary(op, a)) => unary(op, of(a)),
        Rule::Plain(Expr::Binary(op, a, b)) => binary(op, of(a), of(b)),
        Rule::Plain(Expr::Lookup(lookup, at)) => lookup.range(tables, at.map(of)).into(),
        Rule::Plain(Expr::Coordinate(axis)) => coordinate(axis, region).into(),
        Rule::Plain(Expr::Constant(bits)) => {
            let value = f64::from_bits(bits);
            Interval::new(value, value).into()
        }
        Rule::Plain(Expr::Parameter(i)) => {
            let known = region.parameters.get(i as usize);
            known.map_or(Interval::ALL, |&value| Interval::new(value, value)).into()
        }
        Rule::Plain(Expr::Uniform(i)) => {
            region.uniforms.get(i as usize).copied().unwrap_or(Interval::ALL).into()
        }
    }
}

fn coordinate(axis: Axis, region: &Region<'_>) -> Interval {
    let (min, max) = (region.space.min, region.space.max);
    match axis {
        Axis::X => Interval::new(min.x, max.x),
        Axis::Y => Interval::new(min.y, max.y),
        Axis::Z => Interval::new(min.z, max.z),
        Axis::T => region.time,
    }
}

pub fn unary(op: Unary, a: Interval) -> Numbers {
    match op {
        Unary::Neg | Unary::Abs | Unary::Sign | Unary::Floor | Unary::Round => range::unary(op, a).into(),
        Unary::Sqrt => partial(a, POSITIVE, Interval::sqrt),
        Unary::Call(function) => match function {
            UnaryFunction::Sin => a.sin().into(),
            UnaryFunction::Cos => a.cos().into(),
            UnaryFunction::Tan
            | UnaryFunction::Atan
            | UnaryFunction::Sinh
            | UnaryFunction::Cosh
            | UnaryFunction::Tanh => function.range(a).into(),
            UnaryFunction::Exp => {
                let range = function.range(a);
                Interval { lo: range.lo.max(0.0), ..range }.into()
            }
            // the logarithm of 0 is −∞
            UnaryFunction::Ln | UnaryFunction::Log2 | UnaryFunction::Log10 => {
                partial(a, POSITIVE, |a| a.increasing(|x| function.in_f64(x)))
            }
            UnaryFunction::Asin | UnaryFunction::Acos => partial(a, UP_TO_ONE, |a| function.range(a)),
        },
    }
}

pub fn binary(op: Binary, a: Interval, b: Interval) -> Numbers {
    match op {
        Binary::Add => sum(a, b).into(),
        Binary::Sub => sum(a, -b).into(),
        Binary::Mul => (a * b).into(),
        Binary::Div if b.contains(0.0) => Numbers { range: Some(Interval::ALL), may_fail: true },
        Binary::Div
        | Binary::DivOrZero
        | Binary::MulOrZero
        | Binary::Min
        | Binary::Max
        | Binary::PlainMin
        | Binary::PlainMax
        | Binary::MinWeight
        | Binary::MaxWeight
        | Binary::AndWeight
        | Binary::OrWeight => range::binary(op, a, b).into(),
        Binary::And => conjunction(a, b).into(),
        Binary::Or => (-conjunction(-a, -b)).into(),
        Binary::Call(BinaryFunction::Pow) => general_power(a, b),
        Binary::Call(function @ BinaryFunction::Atan2) => function.range(a, b).into(),
    }
}

/// u ∧ v is never above the smaller operand.
fn conjunction(a: Interval, b: Interval) -> Interval {
    let known = range::binary(Binary::And, a, b);
    let hi = a.min(b).widened(4).hi;
    Interval { lo: known.lo, hi: known.hi.min(hi) }
}

/// A sum, rounded outwards only if it is not exact, so that faces at round numbers stay there.
pub fn sum(a: Interval, b: Interval) -> Interval {
    let (lo, low_error) = exact_sum(a.lo, b.lo);
    let (hi, high_error) = exact_sum(a.hi, b.hi);
    let lo = if lo.is_nan() {
        f64::NEG_INFINITY
    } else if low_error < 0.0 {
        lo.next_down()
    } else {
        lo
    };
    let hi = if hi.is_nan() {
        f64::INFINITY
    } else if high_error > 0.0 {
        hi.next_up()
    } else {
        hi
    };
    Interval { lo, hi }
}

/// a + b as rounded, and the missing part (Knuth's two-sum). For an overflow the missing part has the other
/// sign.
fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    if !s.is_finite() {
        return (s, if a.is_finite() && b.is_finite() { -s } else { 0.0 });
    }
    let of_b = s - a;
    (s, (a - (s - of_b)) + (b - of_b))
}

/// Whole powers: an even one has its minimum at 0.
pub fn power(a: Interval, exponent: u32) -> Interval {
    let at = |x: f64| {
        let (mut result, mut square, mut left) = (Interval::point(1.0), Interval::point(x), exponent);
        while left > 0 {
            if left % 2 == 1 {
                result = result * square;
            }
            square = square.square_or_point(left > 1);
            left /= 2;
        }
        result
    };
    if exponent.is_multiple_of(2) {
        let a = a.abs();
        let (lo, hi) = (at(a.lo), at(a.hi));
        return Interval { lo: if a.lo == 0.0 { 0.0 } else { lo.lo.max(0.0) }, hi: hi.hi };
    }
    Interval {
        lo: if a.lo == 0.0 { 0.0 } else { at(a.lo).lo },
        hi: if a.hi == 0.0 { 0.0 } else { at(a.hi).hi },
    }
}

trait Squared {
    fn square_or_point(self, needed: bool) -> Self;
}

impl Squared for Interval {
    fn square_or_point(self, needed: bool) -> Self {
        if needed { self.square() } else { self }
    }
}

/// The largest exponent that counts as one of a whole power.
const MOST_EXPONENT: f64 = 65536.0;

/// An exponent that is one positive whole number.
pub fn whole_exponent(b: Interval) -> Option<u32> {
    let is_whole = b.lo == b.hi && b.lo.fract() == 0.0 && (1.0..=MOST_EXPONENT).contains(&b.lo);
    is_whole.then_some(b.lo as u32)
}

/// aᵇ. A negative base has a power only where the exponent is whole, or if the base is infinite: (−∞)^0.1 is
/// ∞. With a negative exponent this includes the base −0: (−0)^−1 is −∞.
fn general_power(a: Interval, b: Interval) -> Numbers {
    if let Some(exponent) = whole_exponent(b) {
        return power(a, exponent).into();
    }
    let whole = b.lo == b.hi && b.lo.fract() == 0.0;
    let may_be_whole = whole || b.lo != b.hi;
    if may_be_whole && (a.lo < 0.0 || a.lo == 0.0 && b.lo < 0.0) || !a.lo.is_finite() {
        return Numbers { range: Some(Interval::ALL), may_fail: true };
    }
    partial(a, POSITIVE, |a| {
        let corners = [(a.lo, b.lo), (a.lo, b.hi), (a.hi, b.lo), (a.hi, b.hi)];
        let corners = corners.map(|(a, b)| libm::pow(a, b));
        if corners.iter().any(|corner| corner.is_nan()) {
            return POSITIVE;
        }
        let lo = corners.into_iter().fold(f64::INFINITY, f64::min);
        let hi = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let range = Interval::new(lo, hi).widened(4);
        Interval { lo: range.lo.max(0.0), ..range }
    })
}
