//! The volume and the area of a solid from the lines that cross it: of one whose parts are too thin for the cells of
//! a mesh, as sheets and wires are, at any angle.
//!
//! On a line ranges of ω say where the solid begins and ends, down to a millionth of its longest side. So only where
//! the lines lie is left to chance, and what they miss is known from how much sets of them differ:
//!
//! ```text
//! V = ∫ (length inside the solid) da      over the face of the bounds that the lines cross
//! A = Σ over x, y, z ∫ Σ |n_k| da         over the points where lines along k cross the surface with the normal n
//! ```
//!
//! The second is Σ n_k² = 1, because a line along k meets dA·|n_k| of the surface. Places of the lines are those of
//! the additive recurrence with the powers of 1/p, p³ = p + 1 (Roberts 2018), shifted at random in each set (Cranley &
//! Patterson 1976). The sets are mirrored, too: an edge that lies as the places of one set do would else be missed by
//! all of them alike. (Of the two wedges x ≤ y ≤ z and x ≥ y ≥ z in a ball all sets along z missed something, and the
//! volume was off by 2.4 of its errors.)

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::Watch;
use crate::field::Field;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::random;

/// The volume and the area of a solid, found along lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ByLines {
    /// The volume, m³.
    pub volume: f64,
    /// How far the volume may be off, m³: about 99 of 100 are not.
    pub error: f64,
    /// The area of the surface, m².
    pub area: f64,
    /// How far the area may be off, m².
    pub area_error: f64,
    /// The number of lines.
    pub lines: usize,
}

/// Sets of lines whose results are compared.
const SETS: usize = 8;

/// Lines of a set along one axis in the first round. Each round doubles them.
const FIRST_ROUND: usize = 128;

/// Most lines of a set along one axis.
const LAST_ROUND: usize = 16_384;

/// Ranges of ω after which no more lines are drawn.
const MOST_RANGES: usize = 8_000_000;

/// Ranges that one line may ask for.
const MOST_OF_LINE: usize = 4000;

/// The error that ends the search, as a part of the value.
const ENOUGH: f64 = 6e-4;

/// −ln 1 %: what takes more than this number over n of the face is met by one of n lines in 99 of 100 cases. Each line
/// lies along one of three axes, and a part may show along one of them alone.
const UNSEEN: f64 = 4.61 * 3.0;

/// Student's t for 99 % and the degrees of freedom of the sets, over the square root of their number.
const DEVIATIONS: f64 = 3.499 / 2.828;

/// The shortest piece of a line, as a part of the bounds' longest side, of which ranges are asked. A change of sign in
/// it is then sought by ω itself.
const SHORTEST: f64 = 1.0 / 1_048_576.0;

/// How often the place of a change of sign is halved.
const HALVED: usize = 28;

/// 1/p and 1/p² of the recurrence.
const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_3);

/// Finds the volume and the area of a solid within its bounds. `None` if no line meets it, if ranges do not tell where
/// it begins and ends, or if the watch ends the work before the first round. Progress is not reported.
pub fn by_lines(field: &dyn Field, bounds: &Aabb, watch: &dyn Watch) -> Option<ByLines> {
    let sides = bounds.size();
    if !(sides.min_element() > 0.0 && sides.is_finite()) {
        return None;
    }
    let mut sets = [[Sums::default(); 3]; SETS];
    let (mut from, mut until) = (0, FIRST_ROUND);
    let mut best: Option<ByLines> = None;
    loop {
        let jobs: Vec<(usize, usize, usize)> = (0..SETS)
            .flat_map(|set| (0..3).flat_map(move |axis| (from..until).map(move |line| (set, axis, line))))
            .collect();
        let found: Vec<Option<Sums>> = jobs
            .par_iter()
            .map(|&(set, axis, line)| {
                let at = place(set, axis, line);
                (!watch.is_over()).then(|| Line::new(field, bounds, axis, at).sums())
            })
            .collect();
        for (&(set, axis, _), found) in jobs.iter().zip(found) {
            // what an ended round has found is a part of its places only
            let Some(found) = found else { return best };
            sets[set][axis].add(&found);
        }
        let ranges: usize = sets.iter().flatten().map(|sums| sums.ranges).sum();
        best = combined(&sets, sides, until).or(best);
        let is_enough =
            best.is_some_and(|now| now.error <= ENOUGH * now.volume && now.area_error <= ENOUGH * now.area);
        // the next round asks for as much as all of those before
        if is_enough || 2 * ranges > MOST_RANGES || until >= LAST_ROUND {
            return best;
        }
        (from, until) = (until, 2 * until);
    }
}

/// The place of a line on its face, from (0, 0) to (1, 1).
fn place(set: usize, axis: usize, line: usize) -> DVec2 {
    let [x, y] = [0, 1].map(|side| random::nth((6 * set + 2 * axis + side) as u64));
    let shift = DVec2::new(x, y);
    let step = if set.is_multiple_of(2) { STEP } else { DVec2::new(STEP.y, STEP.x) };
    let step = if (set / 2).is_multiple_of(2) { step } else { DVec2::new(-step.x, step.y) };
    let at = shift + (line as f64) * step;
    at - at.floor()
}

/// What lines along one axis have met.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// The length inside the solid, m.
    length: f64,
    /// Length of which nothing is known, m.
    unknown: f64,
    /// Σ |n_k| over the crossings.
    cosines: f64,
    /// The number of crossings without a normal.
    without_normal: usize,
    /// The number of lines that meet the solid.
    met: usize,
    /// The number of ranges that were asked for.
    ranges: usize,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.length += other.length;
        self.unknown += other.unknown;
        self.cosines += other.cosines;
        self.without_normal += other.without_normal;
        self.met += other.met;
        self.ranges += other.ranges;
    }
}

/// A line through the bounds.
struct Line<'a> {
    field: &'a dyn Field,
    axis: usize,
    /// The beginning; only the coordinate along the axis changes.
    from: DVec3,
    until: f64,
    shortest: f64,
}

/// Where a piece of a line lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Inside,
    Outside,
}

impl<'a> Line<'a> {
    fn new(field: &'a dyn Field, bounds: &Aabb, axis: usize, at: DVec2) -> Self {
        let (sides, mut from) = (bounds.size(), bounds.min);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        from[u] += at.x * sides[u];
        from[v] += at.y * sides[v];
        // a little more than the bounds, so that faces of the solid on theirs are crossed
        let shortest = SHORTEST * sides.max_element();
        from[axis] -= 2.0 * shortest;
        Self { field, axis, from, until: bounds.max[axis] + 2.0 * shortest, shortest }
    }

    fn at(&self, t: f64) -> DVec3 {
        let mut p = self.from;
        p[self.axis] = t;
        p
    }

    /// Divides the line until ranges of ω know all pieces, from its beginning to its end.
    fn sums(&self) -> Sums {
        let mut sums = Sums::default();
        let mut side = Side::Outside;
        let mut pieces = vec![(self.from[self.axis], self.until)];
        while let Some((a, b)) = pieces.pop() {
            if sums.ranges >= MOST_OF_LINE {
                sums.unknown += b - a;
                continue;
            }
            sums.ranges += 1;
            let Interval { lo, hi } = self.field.range(&Aabb::new(self.at(a), self.at(b)));
            let middle = 0.5 * (a + b);
            if lo > 0.0 {
                self.enter(&mut side, (a, Side::Inside), &mut sums);
                sums.length += b - a;
            } else if hi < 0.0 {
                self.enter(&mut side, (a, Side::Outside), &mut sums);
            } else if b - a > self.shortest && a < middle && middle < b {
                pieces.extend([(middle, b), (a, middle)]);
            } else {
                self.cross((a, b), &mut side, &mut sums);
            }
        }
        self.enter(&mut side, (self.until, Side::Outside), &mut sums);
        sums.met = usize::from(sums.length > 0.0);
        sums
    }

    /// A piece that is too short to be divided, and in which ω may change its sign.
    fn cross(&self, (a, b): (f64, f64), side: &mut Side, sums: &mut Sums) {
        let ends = [a, b].map(|t| self.side(t));
        self.enter(side, (a, ends[0]), sums);
        if ends[0] == ends[1] {
            sums.length += if ends[0] == Side::Inside { b - a } else { 0.0 };
            return;
        }
        let (mut near, mut far) = (a, b);
        for _ in 0..HALVED {
            let middle = 0.5 * (near + far);
            if self.side(middle) == ends[0] { near = middle } else { far = middle }
        }
        sums.length += if ends[0] == Side::Inside { near - a } else { b - far };
        self.enter(side, (far, ends[1]), sums);
    }

    fn side(&self, t: f64) -> Side {
        if self.field.omega(self.at(t)) > 0.0 { Side::Inside } else { Side::Outside }
    }

    /// Goes on with a piece that begins at t, across the surface if it lies on the other side.
    fn enter(&self, side: &mut Side, (t, next): (f64, Side), sums: &mut Sums) {
        if *side == next {
            return;
        }
        *side = next;
        let (_, gradient) = self.field.omega_grad(self.at(t));
        match gradient.try_normalize() {
            Some(normal) => sums.cosines += normal[self.axis].abs(),
            None => sums.without_normal += 1,
        }
    }
}

/// The volume and the area of all sets, each with so many lines along each axis. `None` if no line met anything, or if
/// too little is known of them.
fn combined(sets: &[[Sums; 3]; SETS], sides: DVec3, lines: usize) -> Option<ByLines> {
    let n = lines as f64;
    let face = |axis: usize| sides[(axis + 1) % 3] * sides[(axis + 2) % 3];
    let over = |value: &dyn Fn(usize) -> f64| (0..SETS).map(value).sum::<f64>() / SETS as f64;
    let mut weights = [0.0; 3];
    for (axis, weight) in weights.iter_mut().enumerate() {
        let of_set = |set: usize| sets[set][axis].length / n;
        let mean = over(&of_set);
        let met: usize = sets.iter().map(|set| set[axis].met).sum();
        if met > 0 {
            let variance = over(&|set| (of_set(set) - mean).powi(2)) / (SETS - 1) as f64;
            // one line more or less, if all of them agree
            *weight = mean.powi(2) / (variance + (mean / met as f64).powi(2));
        }
    }
    let all: f64 = weights.iter().sum();
    if all <= 0.0 {
        return None;
    }
    let volumes: [f64; SETS] = std::array::from_fn(|set| {
        (0..3).map(|axis| weights[axis] / all * face(axis) * sets[set][axis].length / n).sum()
    });
    let areas: [f64; SETS] =
        std::array::from_fn(|set| (0..3).map(|axis| face(axis) * sets[set][axis].cosines / n).sum());
    let doubt: f64 =
        (0..3).map(|axis| weights[axis] / all * face(axis) / n * over(&|set| sets[set][axis].unknown)).sum();
    let without_normal: f64 =
        (0..3).map(|axis| face(axis) / n * over(&|set| sets[set][axis].without_normal as f64)).sum();
    let met: usize = sets.iter().flatten().map(|sums| sums.met).sum();
    let [(volume, error), (area, area_error)] = [volumes, areas].map(|values| {
        let mean = values.iter().sum::<f64>() / SETS as f64;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (SETS - 1) as f64;
        (mean, (DEVIATIONS * variance.sqrt()).max(UNSEEN * mean / met as f64))
    });
    // the half of what has no normal is the best that is known
    let found = ByLines {
        volume: volume + 0.5 * doubt,
        error: error + 0.5 * doubt,
        area: area + 0.5 * without_normal,
        area_error: area_error + 0.5 * without_normal,
        lines: 3 * SETS * lines,
    };
    (found.error < 0.5 * found.volume && found.area_error < 0.5 * found.area).then_some(found)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DQuat;

    use super::*;
    use crate::mesh::{Unwatched, VolumeError, volume};

    /// A turned box with half sides, and ranges that are exact up to rounding for each pair of faces.
    struct Slab {
        axes: [DVec3; 3],
        half: [f64; 3],
    }

    impl Slab {
        fn new(half: [f64; 3], turn: DQuat) -> Self {
            Self { axes: DVec3::AXES.map(|axis| turn * axis), half }
        }

        fn bounds(&self) -> Aabb {
            let reach = (0..3).map(|i| self.half[i] * self.axes[i].abs()).sum::<DVec3>();
            Aabb::new(-reach, reach)
        }
    }

    impl Field for Slab {
        fn omega(&self, p: DVec3) -> f64 {
            (0..3).map(|i| self.half[i] - self.axes[i].dot(p).abs()).fold(f64::INFINITY, f64::min)
        }
        fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
            let nearest = (0..3)
                .min_by(|&i, &j| {
                    let of = |i: usize| self.half[i] - self.axes[i].dot(p).abs();
                    of(i).total_cmp(&of(j))
                })
                .unwrap();
            (self.omega(p), -self.axes[nearest].dot(p).signum() * self.axes[nearest])
        }
        fn range(&self, over: &Aabb) -> Interval {
            let (middle, half) = (over.centre(), 0.5 * over.size());
            let of = |i: usize| {
                let (at, reach) = (self.axes[i].dot(middle).abs(), self.axes[i].abs().dot(half) + 1e-15);
                (self.half[i] - at - reach, self.half[i] - (at - reach).max(0.0))
            };
            let lo = (0..3).map(|i| of(i).0).fold(f64::INFINITY, f64::min);
            Interval::new(lo, (0..3).map(|i| of(i).1).fold(f64::INFINITY, f64::min))
        }
    }

    #[test]
    fn sheets_and_wires_are_measured_at_any_angle() {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        for turn in [DQuat::IDENTITY, DQuat::from_rotation_x(0.3), turn] {
            for half in [[5.0, 5.0, 5e-3], [1.0, 0.4, 1e-5], [1e-3, 1e-3, 1.0], [0.5, 0.5, 0.5]] {
                let slab = Slab::new(half, turn);
                let bounds = slab.bounds();
                let found = by_lines(&slab, &bounds, &Unwatched).unwrap();
                let [a, b, c] = half.map(|half| 2.0 * half);
                let (exact, area) = (a * b * c, 2.0 * (a * b + b * c + c * a));
                assert!((found.volume - exact).abs() <= found.error, "{found:?} {exact}");
                assert!((found.area - area).abs() <= found.area_error, "{found:?} {area}");
                // a wire meets few lines
                let most = if half[0] < 0.1 { 0.2 } else { 0.01 };
                assert!(found.error <= most * exact && found.area_error <= most * area, "{found:?} {exact}");
            }
        }
        // which cells do not show
        let slab = Slab::new([5.0, 5.0, 5e-3], DQuat::IDENTITY);
        assert_eq!(volume(&slab, &slab.bounds(), 96, &Unwatched), Err(VolumeError::TooThin));
    }

    #[test]
    fn a_thin_shell_has_the_volume_and_area_of_both_its_sides() {
        /// A shell with exact ranges up to rounding.
        struct Shell;
        const INNER: f64 = 0.9999;
        impl Field for Shell {
            fn omega(&self, p: DVec3) -> f64 {
                (1.0 - p.length()).min(p.length() - INNER)
            }
            fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
                let sign = if 1.0 - p.length() < p.length() - INNER { -1.0 } else { 1.0 };
                (self.omega(p), sign * p.normalize_or_zero())
            }
            fn range(&self, over: &Aabb) -> Interval {
                let near = DVec3::ZERO.clamp(over.min, over.max).length() - 1e-15;
                let far = over.min.abs().max(over.max.abs()).length() + 1e-15;
                Interval::new((1.0 - far).min(near - INNER), (1.0 - near).min(far - INNER))
            }
        }
        let bounds = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        let found = by_lines(&Shell, &bounds, &Unwatched).unwrap();
        let (exact, area) = (4.0 / 3.0 * PI * (1.0 - INNER.powi(3)), 4.0 * PI * (1.0 + INNER.powi(2)));
        assert!(
            (found.volume - exact).abs() <= found.error && found.error < 0.04 * exact,
            "{found:?} {exact}"
        );
        assert!((found.area - area).abs() <= found.area_error && found.area_error < 0.01 * area, "{found:?}");
    }

    #[test]
    fn what_no_line_meets_or_no_range_knows_is_not_measured() {
        let bounds = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        let nothing = Slab::new([1e-9, 1e-9, 1e-9], DQuat::IDENTITY);
        assert_eq!(by_lines(&nothing, &bounds, &Unwatched), None);
        let flat = Aabb::new(DVec3::NEG_ONE, DVec3::new(1.0, 1.0, -1.0));
        assert_eq!(by_lines(&nothing, &flat, &Unwatched), None);
        // nothing is known of what a field has no ranges for
        let unknown = crate::field::Closures { omega: |p: DVec3| 0.5 - p.length(), gradient: |p: DVec3| -p };
        let bounds = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        assert_eq!(by_lines(&unknown, &bounds, &Unwatched), None);
    }
}
