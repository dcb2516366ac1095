//! One operation: the errors of its operands and its own rounding.

use super::arithmetic::{Arithmetic, Error, FOLDING, Inputs};
use super::weights::through_weights;
use crate::interval::Interval;
use crate::ir::bounds::float::FloatType;
use crate::ir::bounds::range::is_zero;
use crate::ir::bounds::upper::{add, compound, div, magnitude, mul, root, smallest_magnitude};
use crate::ir::form::Form;
use crate::ir::graph::{Expr, Node};
use crate::ir::op::{Binary, Unary};
use crate::precision::Precision;

/// Relative error of a host function, in units of the roundoff.
const HOST_ROUNDINGS: f64 = 4.0;

/// What is known of a node.
#[derive(Clone, Copy)]
pub struct Operand {
    pub error: Error,
    /// The range of the exact values.
    pub range: Interval,
    /// By its form: neither the exact nor the computed value is ever negative.
    pub not_negative: bool,
}

impl Operand {
    /// A range that holds the exact and the computed values. After a shift the exact values are those of the
    /// written formula, not quite those of the graph: hence twice the error.
    fn reach(&self) -> Interval {
        let slack = mul(2.0, self.error.absolute);
        if slack.is_infinite() {
            return Interval::ALL;
        }
        if slack == 0.0 {
            return self.range;
        }
        let lo = (self.range.lo - slack).next_down();
        Interval::new(if self.not_negative { lo.max(0.0) } else { lo }, (self.range.hi + slack).next_up())
    }

    fn largest(&self) -> f64 {
        magnitude(self.reach())
    }

    fn is_exact(&self) -> bool {
        self.error.absolute == 0.0
    }

    /// A lower bound of the magnitude, exact or computed.
    fn smallest(&self) -> f64 {
        smallest_magnitude(self.reach())
    }
}

impl Error {
    const NONE: Self = Self { absolute: 0.0, relative: 0.0, remainder: 0.0 };
    const UNKNOWN: Self = Self { absolute: f64::INFINITY, relative: f64::INFINITY, remainder: 0.0 };

    fn absolute(absolute: f64) -> Self {
        Self { absolute, relative: f64::INFINITY, remainder: 0.0 }
    }
}

/// An operation among those that came before it.
pub struct ErrorRules<'a> {
    pub arithmetic: Arithmetic<'a>,
    pub known: &'a [Operand],
    /// The range of the result.
    pub range: Interval,
}

impl ErrorRules<'_> {
    /// The error of an operation, and whether it is never negative.
    pub fn of(&self, expr: Expr) -> (Error, bool) {
        let operand = |node: Node| self.known[node.index()];
        let (error, by_form) = match expr {
            Expr::Constant(bits) => {
                let value = f64::from_bits(bits);
                (self.constant(value), value >= 0.0)
            }
            Expr::Coordinate(_) => (self.coordinate(), false),
            Expr::Parameter(_) | Expr::Uniform(_) | Expr::Lookup(..) => (Error::UNKNOWN, false),
            Expr::Unary(op, a) => (self.unary(op, operand(a)), matches!(op, Unary::Abs | Unary::Sqrt)),
            Expr::Binary(op, a, b) => {
                let (u, v) = (operand(a), operand(b));
                let form = self.arithmetic.forms.of(a, b);
                let both = u.not_negative && v.not_negative;
                let by_form = match op {
                    Binary::Mul => a == b || both,
                    Binary::Add | Binary::Min | Binary::Max | Binary::PlainMin | Binary::PlainMax => both,
                    Binary::Sub
                    | Binary::Div
                    | Binary::DivOrZero
                    | Binary::MulOrZero
                    | Binary::MinWeight
                    | Binary::MaxWeight
                    | Binary::And
                    | Binary::Or
                    | Binary::AndWeight
                    | Binary::OrWeight
                    | Binary::Call(_) => false,
                };
                (self.binary(op, u, v, form), by_form)
            }
        };
        (self.settled(error), by_form)
    }

    /// The smaller of both bounds; unknown where the range of the type is left.
    fn settled(&self, error: Error) -> Error {
        let largest = magnitude(self.range);
        // after a shift the relative bound is one of the written formula's value, itself within it of the
        // graph's
        let scale = match self.arithmetic.inputs {
            Inputs::Shifted if error.relative <= 0.5 => {
                div(add(largest, error.remainder), (1.0 - error.relative).next_down())
            }
            Inputs::Shifted => f64::INFINITY,
            Inputs::Exact | Inputs::Rounded => largest,
        };
        let absolute = error.absolute.min(add(mul(error.relative, scale), error.remainder));
        if add(largest, absolute) < self.float().largest {
            Error { absolute, ..error }
        } else {
            Error::UNKNOWN
        }
    }

    fn float(&self) -> FloatType {
        FloatType::of(self.arithmetic.precision)
    }

    fn unit(&self) -> f64 {
        self.float().unit
    }

    /// An error of the operands with the rounding of one operation whose result may underflow.
    fn rounded(&self, error: Error) -> Error {
        let tiny = self.float().smallest;
        let Error { absolute, relative, remainder } = self.rounded_sum(error);
        Error { absolute: add(absolute, tiny), relative, remainder: add(remainder, tiny) }
    }

    /// [`ErrorRules::rounded`] for sums and roots, which are exact where they are tiny.
    fn rounded_sum(&self, error: Error) -> Error {
        let unit = self.unit();
        let computed = add(magnitude(self.range), mul(2.0, error.absolute));
        Error {
            absolute: add(error.absolute, mul(unit, computed)),
            relative: compound(error.relative, unit),
            remainder: add(error.remainder, mul(unit, error.remainder)),
        }
    }

    fn constant(&self, value: f64) -> Error {
        let rounded = match self.arithmetic.precision {
            Precision::F64 => value,
            Precision::F32 => f64::from(value as f32),
        };
        if !rounded.is_finite() {
            return Error::UNKNOWN;
        }
        let folding = if self.arithmetic.inputs == Inputs::Shifted { mul(FOLDING, value.abs()) } else { 0.0 };
        // the difference of two neighbours is exact
        let absolute = add((rounded - value).abs(), folding);
        if absolute == 0.0 {
            return Error::NONE;
        }
        Error { absolute, relative: div(absolute, value.abs()), remainder: 0.0 }
    }

    fn coordinate(&self) -> Error {
        let (unit, tiny) = (self.unit(), self.float().smallest);
        let relative = match self.arithmetic.inputs {
            Inputs::Exact => return Error::NONE,
            Inputs::Rounded => unit,
            Inputs::Shifted => compound(unit, FloatType::of(Precision::F64).unit),
        };
        let absolute = add(mul(relative, magnitude(self.range)), tiny);
        Error { absolute, relative, remainder: tiny }
    }

    fn unary(&self, op: Unary, a: Operand) -> Error {
        let reach = a.reach();
        let e = a.error.absolute;
        match op {
            Unary::Neg | Unary::Abs => a.error,
            Unary::Sqrt => self.sqrt(a),
            Unary::Sign if reach.lo > 0.0 || reach.hi < 0.0 => Error::NONE,
            Unary::Sign => Error::absolute(2.0),
            // a whole number has no error unless the operand may be on the other side of a jump
            Unary::Floor | Unary::Round => match op.eval(reach.hi) - op.eval(reach.lo) {
                0.0 => Error::NONE,
                jump if jump.is_finite() => Error::absolute(jump),
                _ => Error::UNKNOWN,
            },
            Unary::Call(function)
                if function.overflows_early() && mul(4.0, magnitude(self.range)) >= self.float().largest =>
            {
                Error::UNKNOWN
            }
            Unary::Call(function) => self.host(function.propagated(reach, e)),
        }
    }

    /// A function of the mathematical library that hands on this error of its operands, if a bound of it is
    /// known.
    fn host(&self, propagated: Option<f64>) -> Error {
        let Some(propagated) = propagated else { return Error::UNKNOWN };
        let computed = add(magnitude(self.range), mul(2.0, propagated));
        let own = add(mul(HOST_ROUNDINGS * self.unit(), computed), self.float().smallest);
        Error::absolute(add(propagated, own))
    }

    fn sqrt(&self, a: Operand) -> Error {
        let reach = a.reach();
        if reach.lo < 0.0 {
            return Error::UNKNOWN;
        }
        let Error { absolute, relative, remainder } = a.error;
        // |√â − √a| = |â − a|/(√â + √a)
        let steep = div(absolute, (2.0 * reach.lo.sqrt()).next_down());
        let halved =
            if relative <= 1.0 { mul(mul(0.5, relative), add(1.0, relative)) } else { f64::INFINITY };
        self.rounded_sum(Error {
            absolute: steep.min(root(absolute)),
            relative: halved,
            remainder: if remainder == 0.0 { 0.0 } else { root(remainder) },
        })
    }

    fn binary(&self, op: Binary, a: Operand, b: Operand, form: Form) -> Error {
        match op {
            Binary::Add | Binary::Sub => self.sum(op, a, b),
            Binary::MulOrZero if is_zero(b.reach()) => Error::NONE,
            // it is 0 here and not there, however small the error
            Binary::MulOrZero if !b.is_exact() && b.reach().contains(0.0) => Error::UNKNOWN,
            Binary::Mul | Binary::MulOrZero => self.product(a, b),
            Binary::Div | Binary::DivOrZero => self.quotient(a, b),
            Binary::Min | Binary::Max | Binary::PlainMin | Binary::PlainMax => Error {
                absolute: a.error.absolute.max(b.error.absolute),
                // the bounds t ∓ ρ|t| grow with t while ρ ≤ 1
                relative: at_most_one(a.error.relative.max(b.error.relative)),
                remainder: a.error.remainder.max(b.error.remainder),
            },
            Binary::And => self.r0(a.reach(), b.reach(), a, b, form),
            Binary::Or => self.r0(-a.reach(), -b.reach(), a, b, form),
            Binary::Call(function) => {
                let errors = [a.error.absolute, b.error.absolute];
                self.host(function.propagated([a.reach(), b.reach()], errors, self.range))
            }
            // derivatives jump: programs of gradients have no certificate
            Binary::MinWeight | Binary::MaxWeight | Binary::AndWeight | Binary::OrWeight => Error::UNKNOWN,
        }
    }

    fn sum(&self, op: Binary, a: Operand, b: Operand) -> Error {
        if a.is_exact() && b.is_exact() {
            let absolute = mul(self.unit(), magnitude(self.range));
            return Error { absolute, relative: self.unit(), remainder: 0.0 };
        }
        let adds_up = op == Binary::Add && a.not_negative && b.not_negative;
        self.rounded_sum(Error {
            absolute: add(a.error.absolute, b.error.absolute),
            relative: if adds_up { a.error.relative.max(b.error.relative) } else { f64::INFINITY },
            remainder: if adds_up { add(a.error.remainder, b.error.remainder) } else { 0.0 },
        })
    }

    fn product(&self, a: Operand, b: Operand) -> Error {
        let (e, f) = (a.error, b.error);
        let absolute =
            add(add(mul(a.largest(), f.absolute), mul(b.largest(), e.absolute)), mul(e.absolute, f.absolute));
        // (â − a)·b̂ + a·(b̂ − b)
        let second = mul(mul(f.remainder, a.largest()), add(1.0, e.relative));
        let remainder = add(mul(e.remainder, b.largest()), second);
        self.rounded(Error { absolute, relative: compound(e.relative, f.relative), remainder })
    }

    fn quotient(&self, a: Operand, b: Operand) -> Error {
        let below = b.smallest();
        let change = div(b.error.absolute, below);
        // the range is that of the graph: after a shift not quite that of the written formula
        let largest = match self.arithmetic.inputs {
            Inputs::Shifted => div(a.largest(), below),
            Inputs::Exact | Inputs::Rounded => magnitude(self.range),
        };
        let absolute = add(div(a.error.absolute, below), mul(largest, change));
        // (1 + ρ)/(1 − κ) − 1
        let relative = if change < 0.5 {
            div(add(a.error.relative, change), (1.0 - change).next_down())
        } else {
            f64::INFINITY
        };
        let remainder = if a.error.remainder == 0.0 { 0.0 } else { div(a.error.remainder, below) };
        if below > 0.0 { self.rounded(Error { absolute, relative, remainder }) } else { Error::UNKNOWN }
    }

    /// u ∧ v with the operands' reaches; u ∨ v with both negated.
    fn r0(&self, u: Interval, v: Interval, a: Operand, b: Operand, form: Form) -> Error {
        let (e, f) = (a.error, b.error);
        let (unit, tiny) = (self.unit(), self.float().smallest);
        let propagated = through_weights(u, v, e.absolute, f.absolute);
        let computed = add(magnitude(self.range), mul(2.0, propagated));
        let (larger, both) = (magnitude(u).max(magnitude(v)), add(magnitude(u), magnitude(v)));
        let squares_fit = mul(mul(2.1, larger), larger) < self.float().largest;
        // what squares lose where they underflow, in h and so in the result
        let underflow = mul(4.0, root(tiny));
        let (own, own_relative, own_remainder) = match form {
            Form::Scaled => (mul(7.0 * unit, computed), 7.0 * unit, mul(4.0, tiny)),
            _ if !squares_fit => return Error::UNKNOWN,
            Form::Stable => (mul(4.0 * unit, computed), 4.0 * unit, underflow),
            // |r| ≥ h/8, with 2.01 h + |u + v| ≤ 3.5 h and the rounding of the difference; or the stable form
            Form::Guarded => (mul(32.0 * unit, computed), 32.0 * unit, underflow),
            Form::Textbook => {
                let sum = magnitude(u + v).min(both);
                let h = root(add(mul(magnitude(u), magnitude(u)), mul(magnitude(v), magnitude(v))));
                let parts = add(mul(unit, sum), mul(2.01 * unit, h));
                (add(parts, mul(1.01 * unit, computed)), f64::INFINITY, underflow)
            }
        };
        let relative = e.relative.max(f.relative);
        // e^{√2ρ/(1 − ρ)} − 1 ≤ 1.5·ρ for ρ ≤ 0.02
        let grown = if relative <= 0.02 { mul(1.5, relative) } else { f64::INFINITY };
        Error {
            absolute: add(add(propagated, own), own_remainder),
            relative: compound(grown, own_relative),
            remainder: add(mul(2.01, add(e.remainder, f.remainder)), own_remainder),
        }
    }
}

fn at_most_one(relative: f64) -> f64 {
    if relative <= 1.0 { relative } else { f64::INFINITY }
}
