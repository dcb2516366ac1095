//! Intervals as sets of numbers, and the possible results for a box.

use std::f64::consts::PI;

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

/// Parts of an angle that goes all around.
const PARTS_AROUND: u32 = 16;

/// The number of parts in which an angle atan2(a, b) is looked at where it jumps: one on each side of the cut, where a is
/// 0 and b negative; more if it goes around the axis.
pub fn parts_of_angle(b: Interval) -> u32 {
    if b.hi < 0.0 { 2 } else { PARTS_AROUND }
}

/// A part of the angle atan2(a, b), given by its number, of two or more. The first half of them has a that is not
/// positive, the second one a that is not negative.
pub fn part_of_angle([a, b]: [Interval; 2], (part, count): (u32, u32)) -> Interval {
    let all = Interval { lo: -PI, hi: PI }.widened(4);
    if count > 2 {
        let at = |k: u32| PI * (2.0 * f64::from(k) / f64::from(count) - 1.0);
        // zero, which divides positive from negative angles, is exact
        return Interval { lo: at(part), hi: at(part + 1) }.widened(8);
    }
    let farthest = |a: f64| if b.hi < 0.0 { libm::atan2(a.abs(), b.hi) * (1.0 - 1e-15) } else { 0.0 };
    if part == 0 {
        Interval { hi: -farthest(a.lo.min(0.0)), ..all }
    } else {
        Interval { lo: farthest(a.hi.max(0.0)), ..all }
    }
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
