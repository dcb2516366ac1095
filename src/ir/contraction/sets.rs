//! Intervals as sets of numbers, and the possible results for a box.

use crate::interval::Interval;

/// The result of contraction for a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contracted {
    /// The formula is positive nowhere in it.
    Nowhere,
    /// The formula is positive everywhere in it.
    Everywhere,
    /// It may be positive somewhere in the remaining part.
    Somewhere,
}

/// The numbers that two intervals share; `None` if there are none.
pub fn meet(a: Interval, b: Interval) -> Option<Interval> {
    let (lo, hi) = (a.lo.max(b.lo), a.hi.min(b.hi));
    (lo <= hi).then_some(Interval { lo, hi })
}

/// The hull of the intersections of an interval with two others.
pub fn meet_either(a: Interval, [b, c]: [Interval; 2]) -> Option<Interval> {
    match (meet(a, b), meet(a, c)) {
        (Some(b), Some(c)) => Some(b.hull(c)),
        (one, other) => one.or(other),
    }
}
