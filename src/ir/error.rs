//! Certified rounding errors: a bound of |computed ω − exact ω| for every point of a box.
//!
//! Forward analysis, one operation after the other. Each node has a range of its exact values (`ir::range`) and an
//! [`Error`]: an absolute bound, and beside it a relative one with a tiny remainder for underflow,
//! |computed − exact| ≤ ρ·|exact| + α, which alone survives products, sums of squares and their roots near zero. An
//! operation hands on the errors of its operands through its derivatives over the box and adds its own rounding:
//!
//! - R₀ hands them on through its weights, 1 ∓ u/√(u² + v²), which lie in [0, 2] and depend on the direction of
//!   (u, v) only, so the worst over two ranges is known from the directions of their corners; and because R₀ is homogeneous of degree 1 with
//!   Σ wᵢ|uᵢ| ≤ √2·|ω|, relative errors grow by √2 at most.
//! - R₀'s own rounding, with u the unit roundoff: stable form 4u·|ω|, scaled form 7u·|ω| (from the error bounds of
//!   the factors of m·(1 − τ), of s + H and of M·(1 + k + q), Higham 2002, chapter 3), textbook form
//!   u·|s| + 2u·h + u·|ω|; where squares underflow, √(2η) more.
//! - Functions of the mathematical library err by at most one unit in the last place (the tests of the `libm`
//!   crate hold them to that); two are charged.
//!
//! What is not known — a root that may meet a negative number, a divisor that may vanish, an overflow — is ∞.
//! All bounds are computed with every operation rounded upwards. Ranges of a whole box add up worst cases of
//! different places, so a box is divided where its bound is largest, until no point would do much better.

use std::collections::BinaryHeap;

use super::forms::{Form, Forms};
use super::graph::{Expr, Graph, Node};
use super::growth::FloatType;
use super::op::{Binary, Unary};
use super::range::RangeEvaluator;
use crate::geom::Aabb;
use crate::interval::Interval;

/// How the coordinates of a point reach the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Inputs {
    /// They are numbers of the program's type.
    Exact,
    /// They are rounded to it once.
    Rounded,
    /// An origin is subtracted in `f64` before; the constants of the graph were folded with it, see
    /// [`localised`](super::localised).
    Shifted,
}

/// One way to compute a node.
#[derive(Debug, Clone, Copy)]
pub struct Arithmetic<'a> {
    pub float: FloatType,
    pub forms: &'a Forms,
    pub inputs: Inputs,
}

/// |computed − exact| ≤ `absolute`, and ≤ `relative`·|exact| + `remainder`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Error {
    pub absolute: f64,
    pub relative: f64,
    pub remainder: f64,
}

/// Relative error of a host function, in units of the roundoff.
const HOST_ROUNDINGS: f64 = 4.0;

/// Relative error of a constant that was folded with an origin, see [`localised`](super::localised).
pub(super) const FOLDING: f64 = 1.0 / (1u64 << 50) as f64;

/// Boxes that are looked at for one certificate, and operations in them.
const MOST_BOXES: usize = 4000;
const MOST_OPERATIONS: usize = 3_000_000;

/// A bound this much above that of some single point is tight enough.
const TIGHT: f64 = 1.25;

/// A graph prepared for certificates of one arithmetic.
pub struct ErrorAnalysis<'a> {
    graph: &'a Graph,
    root: Node,
    arithmetic: Arithmetic<'a>,
    ranges: RangeEvaluator,
}

impl<'a> ErrorAnalysis<'a> {
    pub fn new(graph: &'a Graph, root: Node, arithmetic: Arithmetic<'a>) -> Self {
        Self { graph, root, arithmetic, ranges: RangeEvaluator::new(graph, root) }
    }

    /// A bound of |computed − exact| of the root at every point of a box; ∞ where there is none. The box is divided
    /// until the bound is at most `enough`, cannot become so, or would not become much smaller.
    ///
    /// With [`Inputs::Shifted`] the box is one of shifted coordinates.
    pub fn certify(&self, over: &Aabb, enough: f64) -> f64 {
        let whole = Part { bound: self.bound(over), over: *over };
        let mut parts = BinaryHeap::from([whole]);
        let most = MOST_BOXES.min(MOST_OPERATIONS / self.graph.len().max(1)).max(16);
        // no division of the box gives less than this
        let mut attained: f64 = 0.0;
        for _ in 0..most {
            let Some(worst) = parts.peek() else { break };
            let centre = worst.over.centre();
            attained = attained.max(self.bound(&Aabb::new(centre, centre)));
            let tight = attained > enough.max(worst.bound / TIGHT) || attained.is_infinite();
            if worst.bound <= enough || tight {
                break;
            }
            let Some(worst) = parts.pop() else { break };
            parts.extend(worst.over.halves().map(|over| Part { bound: self.bound(&over), over }));
        }
        parts.peek().map_or(f64::INFINITY, |worst| worst.bound)
    }

    /// The bound for a box in one piece.
    pub fn bound(&self, over: &Aabb) -> f64 {
        self.errors(over)[self.root.index()].absolute
    }

    /// The errors of all nodes over a box, in the graph's order.
    pub fn errors(&self, over: &Aabb) -> Vec<Error> {
        let ranges = self.ranges.all(over);
        let mut known: Vec<Operand> = Vec::with_capacity(ranges.len());
        for ((_, expr), range) in std::iter::zip(self.graph.nodes(), ranges) {
            // the ends of R₀'s ranges are R₀ of the operands' ends, rounded
            let rounded = matches!(expr, Expr::Binary(Binary::And | Binary::Or, ..));
            let range = if rounded { range.widened(4) } else { range };
            let step = Step { arithmetic: self.arithmetic, known: &known, range };
            let (error, not_negative) = step.of(expr);
            known.push(Operand { error, range, not_negative });
        }
        known.into_iter().map(|operand| operand.error).collect()
    }
}

/// A part of the box, the one with the largest bound first.
struct Part {
    bound: f64,
    over: Aabb,
}

impl Ord for Part {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Part {}

// ---- numbers that are bounds from above: every operation rounds up, and what is unknown stays unknown ----------------

fn known(x: f64) -> f64 {
    if x.is_nan() { f64::INFINITY } else { x }
}

fn add(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { a + b } else { known((a + b).next_up()) }
}

fn mul(a: f64, b: f64) -> f64 {
    if a.is_infinite() || b.is_infinite() {
        f64::INFINITY
    } else if a == 0.0 || b == 0.0 {
        0.0
    } else {
        (a * b).next_up()
    }
}

/// a/b for a lower bound b of the divisor.
fn div(a: f64, b: f64) -> f64 {
    if b > 0.0 && a.is_finite() { known((a / b).next_up()) } else { f64::INFINITY }
}

fn root(a: f64) -> f64 {
    known(a.sqrt().next_up())
}

/// (1 + a)(1 + b) − 1
fn compound(a: f64, b: f64) -> f64 {
    add(add(a, b), mul(a, b))
}

fn magnitude(range: Interval) -> f64 {
    range.lo.abs().max(range.hi.abs())
}

// ---- one operation -------------------------------------------------------------------------------------------------

#[derive(Clone, Copy)]
struct Operand {
    error: Error,
    /// Of the exact values.
    range: Interval,
    /// By its form: neither the exact nor the computed value is ever negative.
    not_negative: bool,
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
        let reach = self.reach();
        if reach.lo > 0.0 {
            reach.lo
        } else if reach.hi < 0.0 {
            -reach.hi
        } else {
            0.0
        }
    }
}

impl Error {
    const NONE: Self = Self { absolute: 0.0, relative: 0.0, remainder: 0.0 };
    const UNKNOWN: Self = Self { absolute: f64::INFINITY, relative: f64::INFINITY, remainder: 0.0 };

    fn absolute(absolute: f64) -> Self {
        Self { absolute, relative: f64::INFINITY, remainder: 0.0 }
    }
}

struct Step<'a> {
    arithmetic: Arithmetic<'a>,
    known: &'a [Operand],
    /// Of the result.
    range: Interval,
}

impl Step<'_> {
    fn of(&self, expr: Expr) -> (Error, bool) {
        let operand = |node: Node| self.known[node.index()];
        let (error, by_form) = match expr {
            Expr::Constant(bits) => {
                let value = f64::from_bits(bits);
                (self.constant(value), value >= 0.0)
            }
            Expr::Coordinate(_) => (self.coordinate(), false),
            Expr::Parameter(_) => (Error::UNKNOWN, false),
            Expr::Unary(op, a) => (self.unary(op, operand(a)), matches!(op, Unary::Abs | Unary::Sqrt)),
            Expr::Binary(op, a, b) => {
                let (u, v) = (operand(a), operand(b));
                let form = self.arithmetic.forms.of(a, b);
                let both = u.not_negative && v.not_negative;
                let by_form = match op {
                    Binary::Mul => a == b || both,
                    Binary::Add | Binary::Min | Binary::Max | Binary::PlainMin | Binary::PlainMax => both,
                    _ => false,
                };
                (self.binary(op, u, v, form), by_form)
            }
        };
        (self.settled(error), by_form)
    }

    /// The smaller of both bounds; nothing where the range or the type is left.
    fn settled(&self, error: Error) -> Error {
        let largest = magnitude(self.range);
        let absolute = error.absolute.min(add(mul(error.relative, largest), error.remainder));
        if add(largest, absolute) < self.arithmetic.float.largest {
            Error { absolute, ..error }
        } else {
            Error::UNKNOWN
        }
    }

    fn unit(&self) -> f64 {
        self.arithmetic.float.unit
    }

    /// An error of the operands with the rounding of one operation whose result may underflow.
    fn rounded(&self, error: Error) -> Error {
        let tiny = self.arithmetic.float.smallest;
        let Error { absolute, relative, remainder } = self.rounded_sum(error);
        Error { absolute: add(absolute, tiny), relative, remainder: add(remainder, tiny) }
    }

    /// As [`Step::rounded`] for sums and roots, which are exact where they are tiny.
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
        let rounded = match self.arithmetic.float {
            FloatType::F64 => value,
            _ => f64::from(value as f32),
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
        let (unit, tiny) = (self.unit(), self.arithmetic.float.smallest);
        let relative = match self.arithmetic.inputs {
            Inputs::Exact => return Error::NONE,
            Inputs::Rounded => unit,
            Inputs::Shifted => compound(unit, FloatType::F64.unit),
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
            Unary::Sin | Unary::Cos | Unary::Atan => self.host(e),
            Unary::Tan if magnitude(reach) < 1.57 => {
                let steepest = magnitude(reach.increasing(libm::tan));
                self.host(mul(e, add(1.0, mul(steepest, steepest))))
            }
            Unary::Exp => self.host(mul(e, reach.increasing(libm::exp).hi)),
            Unary::Ln if reach.lo > 0.0 => self.host(div(e, reach.lo)),
            Unary::Asin | Unary::Acos if magnitude(reach) < 1.0 => {
                let rest = (Interval::point(1.0) - reach.square()).sqrt();
                self.host(div(e, rest.lo))
            }
            Unary::Tan | Unary::Ln | Unary::Asin | Unary::Acos => Error::UNKNOWN,
        }
    }

    /// A function of the mathematical library whose operands' errors amount to `propagated`.
    fn host(&self, propagated: f64) -> Error {
        let computed = add(magnitude(self.range), mul(2.0, propagated));
        let own = add(mul(HOST_ROUNDINGS * self.unit(), computed), self.arithmetic.float.smallest);
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
            Binary::Mul => self.product(a, b),
            Binary::Div | Binary::DivOrZero => self.quotient(a, b),
            Binary::Min | Binary::Max | Binary::PlainMin | Binary::PlainMax => Error {
                absolute: a.error.absolute.max(b.error.absolute),
                // the bounds t ∓ ρ|t| grow with t while ρ ≤ 1
                relative: at_most_one(a.error.relative.max(b.error.relative)),
                remainder: a.error.remainder.max(b.error.remainder),
            },
            Binary::And => self.r0(a.reach(), b.reach(), a, b, form),
            Binary::Or => self.r0(-a.reach(), -b.reach(), a, b, form),
            Binary::Pow => self.power(a, b),
            Binary::Atan2 => self.angle(a, b),
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
        let absolute = add(
            add(mul(a.largest(), f.absolute), mul(b.largest(), e.absolute)),
            mul(e.absolute, f.absolute),
        );
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

    /// a^b = exp(b·ln a)
    fn power(&self, a: Operand, b: Operand) -> Error {
        let reach = a.reach();
        if reach.lo <= 0.0 {
            return Error::UNKNOWN;
        }
        let logarithm = magnitude(reach.increasing(libm::log));
        let change =
            add(mul(b.largest(), div(a.error.absolute, reach.lo)), mul(logarithm, b.error.absolute));
        // eᵗ − 1 ≤ t·(1 + t) and eᵗ ≤ 1 + 2t for t ≤ 1
        if change > 1.0 {
            return Error::UNKNOWN;
        }
        let largest = mul(magnitude(self.range), add(1.0, mul(2.0, change)));
        self.host(mul(largest, mul(change, add(1.0, change))))
    }

    /// atan2(a, b), whose gradient is as long as 1/√(a² + b²), away from its cut.
    fn angle(&self, a: Operand, b: Operand) -> Error {
        let (above, right) = (a.reach(), b.reach());
        if right.lo <= 0.0 && above.contains(0.0) {
            return Error::UNKNOWN;
        }
        let distance = (a.smallest().powi(2) + b.smallest().powi(2)).sqrt() * (1.0 - 1e-15);
        self.host(div(add(a.error.absolute, b.error.absolute), distance))
    }

    /// u ∧ v with the operands' reaches; u ∨ v with both negated.
    fn r0(&self, u: Interval, v: Interval, a: Operand, b: Operand, form: Form) -> Error {
        let (e, f) = (a.error, b.error);
        let (unit, tiny) = (self.unit(), self.arithmetic.float.smallest);
        let propagated = through_weights(u, v, e.absolute, f.absolute);
        let computed = add(magnitude(self.range), mul(2.0, propagated));
        let (larger, both) = (magnitude(u).max(magnitude(v)), add(magnitude(u), magnitude(v)));
        let squares_fit = mul(mul(2.0, larger), larger) < self.arithmetic.float.largest;
        // what squares lose where they underflow, in h and so in the result
        let underflow = mul(4.0, root(tiny));
        let (own, own_relative, own_remainder) = match form {
            Form::Scaled => (mul(7.0 * unit, computed), 7.0 * unit, mul(4.0, tiny)),
            _ if !squares_fit => return Error::UNKNOWN,
            Form::Stable => (mul(4.0 * unit, computed), 4.0 * unit, underflow),
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

/// The largest w_u·e + w_v·f over two ranges of the operands of ∧.
///
/// With θ the direction of (u, v) it is e + f − (e·cos θ + f·sin θ): along the directions that the ranges cover it is
/// largest at one of their ends, which are directions of corners, or at (−e, −f) if that is one of them.
fn through_weights(u: Interval, v: Interval, e: f64, f: f64) -> f64 {
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

/// The largest weight 1 − u/√(u² + v²) of u in u ∧ v over two ranges: u/h falls with u, and with |v| it comes nearer
/// to zero.
fn largest_weight(u: Interval, v: Interval) -> f64 {
    let across = v.abs();
    let v = if u.lo >= 0.0 { across.hi } else { across.lo };
    let h = (u.lo * u.lo + v * v).sqrt();
    let cosine = u.lo / h;
    // a corner, or squares that leave the range
    if !cosine.is_finite() || !(1e-140..1e150).contains(&h) {
        return 2.0;
    }
    // the cosine and the difference are good to five roundings
    (1.0 - cosine + 1e-15).clamp(0.0, 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Axis;
    use glam::DVec3;

    const UNIT: f64 = 0.5 * f64::EPSILON;

    fn bound(graph: &Graph, root: Node, form: Form, over: Aabb) -> f64 {
        let forms = Forms::all(form);
        let arithmetic = Arithmetic { float: FloatType::F64, forms: &forms, inputs: Inputs::Exact };
        ErrorAnalysis::new(graph, root, arithmetic).bound(&over)
    }

    #[track_caller]
    fn near(found: f64, expected: f64) {
        assert!((found / expected - 1.0).abs() < 1e-12, "{found:e} is not {expected:e}");
    }

    fn cube(lo: f64, hi: f64) -> Aabb {
        Aabb::new(DVec3::splat(lo), DVec3::splat(hi))
    }

    #[test]
    fn sums_products_and_roots_by_hand() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let over = cube(0.0, 2.0);
        // one rounding of a sum of at most 4
        let sum = graph.binary(Binary::Add, x, y);
        near(bound(&graph, sum, Form::Stable, over), 4.0 * UNIT);
        // (1 + u)²(1 + u) − 1 of at most 16, and the underflow
        let square = graph.binary(Binary::Mul, sum, sum);
        near(bound(&graph, square, Form::Stable, over), 48.0 * UNIT);
        // of x² + y²: squares u, sum u, halved by the root, root u
        let (x2, y2) = (graph.binary(Binary::Mul, x, x), graph.binary(Binary::Mul, y, y));
        let squares = graph.binary(Binary::Add, x2, y2);
        let rho = graph.unary(Unary::Sqrt, squares);
        near(bound(&graph, rho, Form::Stable, over), 2.0 * UNIT * 8f64.sqrt());
        // the divisor may vanish
        let quotient = graph.binary(Binary::Div, y, x);
        assert_eq!(bound(&graph, quotient, Form::Stable, over), f64::INFINITY);
        near(bound(&graph, quotient, Form::Stable, cube(1.0, 2.0)), 2.0 * UNIT);
    }

    #[test]
    fn forms_of_r0_by_hand() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let and = graph.binary(Binary::And, x, y);
        // exact operands: 1 ∧ 1 … 2 ∧ 2 = 2·(2 − √2)
        let (over, value) = (cube(1.0, 2.0), 2.0 * (2.0 - 2f64.sqrt()));
        let close = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-3, "{found:e}");
        close(bound(&graph, and, Form::Stable, over), 4.0 * UNIT * value);
        close(bound(&graph, and, Form::Scaled, over), 7.0 * UNIT * value);
        let textbook = UNIT * 4.0 + 2.01 * UNIT * 8f64.sqrt() + 1.01 * UNIT * value;
        close(bound(&graph, and, Form::Textbook, over), textbook);
        // squares of 1e200 overflow, their scaled form does not
        assert_eq!(bound(&graph, and, Form::Stable, cube(1.0, 1e200)), f64::INFINITY);
        assert!(bound(&graph, and, Form::Scaled, cube(1.0, 1e200)) < 1e185);
    }

    #[test]
    fn weights_are_largest_at_a_corner() {
        let weight = |u: [f64; 2], v: [f64; 2]| {
            largest_weight(Interval::new(u[0], u[1]), Interval::new(v[0], v[1]))
        };
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

    #[test]
    fn dividing_the_box_tightens_the_bound_and_stops_where_nothing_is_known() {
        // x(1 − x) ∧ y over a box: the whole box pairs the largest factors
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let one = graph.constant(1.0);
        let rest = graph.binary(Binary::Sub, one, x);
        let slab = graph.binary(Binary::Mul, x, rest);
        let root = graph.binary(Binary::And, slab, y);
        let undefined = graph.unary(Unary::Sqrt, y);
        let forms = Forms::all(Form::Stable);
        let arithmetic = Arithmetic { float: FloatType::F64, forms: &forms, inputs: Inputs::Exact };
        let analysis = ErrorAnalysis::new(&graph, root, arithmetic);
        let over = cube(-1.0, 1.0);
        let (whole, divided) = (analysis.bound(&over), analysis.certify(&over, 0.0));
        assert!(divided < 0.7 * whole && divided > UNIT, "{divided:e} {whole:e}");
        assert_eq!(analysis.certify(&over, whole), whole);
        let analysis = ErrorAnalysis::new(&graph, undefined, arithmetic);
        assert_eq!(analysis.certify(&over, 0.0), f64::INFINITY);
    }
}
