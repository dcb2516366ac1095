//! Contraction: a box made smaller without losing a point at which a formula is positive.
//!
//! | file | what it holds |
//! |---|---|
//! | `rule` | how the nodes of a graph are read: powers and slabs are one operation |
//! | `forward` | the numbers that an operation may give |
//! | `backward` | the operands that may give a number |
//! | `contractor` | both, over a whole graph (hull consistency) |
//! | `slopes` | derivatives over a box, and what they exclude (the mean value form) |
//! | `linear` | linear forms with known ranges, and the box around them (linear programming) |
//!
//! Intervals here hold the *numbers* that a node may be. Where a formula is positive every operand that it
//! needs is a number, so an undefined operation restricts its operands and does not make the whole unknown.
//!
//! Invariant: what is cut off holds no point at which the formula is positive, over the reals or as programs
//! in `f64` evaluate it. Rules backwards therefore widen a value by the rounding error of its operation first.

mod backward;
mod contractor;
mod forward;
mod linear;
mod rule;
mod slopes;

pub use contractor::{Contractor, Wanted};
pub use linear::{LinearForm, contract_linear, contract_linear_around};

use crate::interval::Interval;

/// What is known of a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contracted {
    /// The formula is positive nowhere in it.
    Nowhere,
    /// The formula is positive everywhere in it.
    Everywhere,
    /// It may be positive somewhere in what is left.
    Somewhere,
}

/// The numbers that two intervals share; `None` if there are none.
fn meet(a: Interval, b: Interval) -> Option<Interval> {
    let (lo, hi) = (a.lo.max(b.lo), a.hi.min(b.hi));
    (lo <= hi).then_some(Interval { lo, hi })
}

/// The hull of what an interval shares with two others.
fn meet_either(a: Interval, [b, c]: [Interval; 2]) -> Option<Interval> {
    match (meet(a, b), meet(a, c)) {
        (Some(b), Some(c)) => Some(b.hull(c)),
        (one, other) => one.or(other),
    }
}
