//! Where ω changes sign along edges of the grid, to the last digits, for many edges at a time.
//!
//! On most edges ω is one leaf, and most leaves are quadratic along a line. Three values then determine the
//! root, and a step across it confirms it. Chandrupatla's method (Adv. Eng. Software 28, 1997) does the rest,
//! at creases and with other leaves: inverse quadratic interpolation where three points show that it is safe,
//! and bisection elsewhere. R0 fields bend sharply near creases and may be flat, so a bracket is always kept
//! and bisection bounds the number of steps.
//!
//! Invariant: the result lies in the closed edge. It is one of two points at most [`BRACKET`] apart, one with
//! ω > 0 and one without: the one with the smaller |ω|.

use std::ops::Range;

use super::MeshError;
use crate::field::{Field, Points};

/// Edges along one axis, with ω > 0 at exactly one end of each.
#[derive(Debug, Default, Clone)]
pub(super) struct AxisEdges {
    /// The coordinates of both ends on the axis.
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    /// The coordinates on the next axis and on the one after it, cyclically.
    pub across: [Vec<f64>; 2],
}

/// The width of the final bracket relative to the edge's coordinates: a few times the rounding of an R0
/// field divided by its slope. In a narrower bracket the search wanders in that rounding and takes 13
/// evaluations for each edge of the pawn instead of 8. The root itself is mostly right to the last digit. A
/// root that is so near to an edge's end is put on it, so that vertices which meet in a node coincide
/// exactly and can be merged.
const BRACKET: f64 = 32.0 * f64::EPSILON;

/// The first step across a root that interpolation seems to have found, as a share of the final bracket.
const FIRST_STEP: f64 = 0.25;

/// How much longer the next step is if a step does not change the sign, because ω is flatter there than three
/// points could show.
const STEP_GROWTH: f64 = 4.0;

/// The least distance of the third value from the edge's ends, as a share of the edge. If it were nearer,
/// rounding would decide about the curvature.
const LEAST_SHARE: f64 = 1.0 / 64.0;

/// In practice interpolation halves a bracket at least every other step. After this many steps only bisection
/// is used, which ends within 60 more.
const MAX_INTERPOLATIONS: usize = 40;

/// Edges in a batch: enough for vector code, and few enough to stay in the nearest cache.
const BATCH: usize = 512;

impl AxisEdges {
    pub(super) fn clear(&mut self) {
        self.low.clear();
        self.high.clear();
        self.across.iter_mut().for_each(Vec::clear);
    }

    fn largest_coordinate(&self, edge: usize) -> f64 {
        self.low[edge].abs().max(self.high[edge].abs())
    }

    /// The bracket width that ends a search.
    fn tolerance(&self, edge: usize) -> f64 {
        BRACKET * self.largest_coordinate(edge)
    }

    fn snapped(&self, edge: usize, root: f64) -> f64 {
        let reach = self.tolerance(edge);
        match root {
            _ if root - self.low[edge] <= reach => self.low[edge],
            _ if self.high[edge] - root <= reach => self.high[edge],
            _ => root,
        }
    }
}

/// One point on each of some edges along an axis, as columns.
fn on_axis<'a>(axis: usize, along: &'a [f64], across: [&'a [f64]; 2]) -> Points<'a> {
    match axis {
        0 => Points::new(along, across[0], across[1]),
        1 => Points::new(across[1], along, across[0]),
        _ => Points::new(across[0], across[1], along),
    }
}

/// Finds roots, keeping its memory from one call to the next.
#[derive(Debug, Default)]
pub(super) struct RootFinder {
    /// ω at both ends of each edge, then at the points that the straight line, the parabola and the step
    /// across its root gave.
    omega: [Vec<f64>; 5],
    tried: [Vec<f64>; 3],
    /// The slope dω/dt of each parabola at its root.
    slopes: Vec<f64>,
    searches: Vec<RootSearch>,
    columns: [Vec<f64>; 3],
}

impl RootFinder {
    /// Appends the surface's coordinate on each edge along `axis` to `roots`; returns the number
    /// of evaluations.
    ///
    /// # Errors
    /// [`MeshError::NotANumber`] at the first NaN found.
    pub(super) fn solve(
        &mut self,
        field: &dyn Field,
        axis: usize,
        edges: &AxisEdges,
        roots: &mut Vec<f64>,
    ) -> Result<u64, MeshError> {
        let mut evaluations = 0;
        for first in (0..edges.low.len()).step_by(BATCH) {
            let batch = first..(first + BATCH).min(edges.low.len());
            evaluations += self.fit_parabolas(field, axis, edges, batch.clone())?;
            self.confirm(edges, batch, roots);
            evaluations += self.search(field, axis, edges, roots)?;
        }
        Ok(evaluations)
    }

    /// Fills `tried`, `slopes` and `omega` for a batch of edges. Returns the number of evaluations.
    fn fit_parabolas(
        &mut self,
        field: &dyn Field,
        axis: usize,
        edges: &AxisEdges,
        batch: Range<usize>,
    ) -> Result<u64, MeshError> {
        let across = edges.across.each_ref().map(|column| &column[batch.clone()]);
        let (low, high) = (&edges.low[batch.clone()], &edges.high[batch]);
        let [at_low, at_high, at_line, at_parabola, at_step] = &mut self.omega;
        let [line, parabola, step] = &mut self.tried;
        let mut evaluations = evaluate(field, on_axis(axis, low, across), at_low)?;
        evaluations += evaluate(field, on_axis(axis, high, across), at_high)?;

        let count = low.len();
        let (f0, f1) = (&at_low[..count], &at_high[..count]);
        line.clear();
        line.extend((0..count).map(|i| low[i] + line_share(f0[i], f1[i]) * (high[i] - low[i])));
        evaluations += evaluate(field, on_axis(axis, line, across), at_line)?;

        parabola.clear();
        self.slopes.clear();
        for (i, &f) in at_line[..count].iter().enumerate() {
            let (share, slope) = parabola_root(f0[i], f1[i], line_share(f0[i], f1[i]), f);
            parabola.push(low[i] + share * (high[i] - low[i]));
            self.slopes.push(slope / (high[i] - low[i]));
        }
        evaluations += evaluate(field, on_axis(axis, parabola, across), at_parabola)?;

        step.clear();
        for (i, &f) in at_parabola[..count].iter().enumerate() {
            // ω = 0 counts as outside, and then the step leads to the end that is inside
            let towards_high = (f > 0.0) == (f0[i] > 0.0);
            let least = FIRST_STEP * BRACKET * low[i].abs().max(high[i].abs());
            let way = (f / self.slopes[i]).abs() + least;
            let next = if towards_high { parabola[i] + way } else { parabola[i] - way };
            // an infinite or NaN way leads to an end
            step.push(if towards_high { next.min(high[i]) } else { next.max(low[i]) });
        }
        evaluations += evaluate(field, on_axis(axis, step, across), at_step)?;
        Ok(evaluations)
    }

    /// Appends the roots that the step confirms, and lists searches for the others.
    fn confirm(&mut self, edges: &AxisEdges, batch: Range<usize>, roots: &mut Vec<f64>) {
        self.searches.clear();
        for (i, edge) in batch.enumerate() {
            let at = |k: usize| (self.tried[k][i], self.omega[k + 2][i]);
            let (parabola, step) = (at(1), at(2));
            let is_across = (parabola.1 > 0.0) != (step.1 > 0.0);
            if is_across && (parabola.0 - step.0).abs() <= edges.tolerance(edge) {
                let nearest = if parabola.1.abs() <= step.1.abs() { parabola } else { step };
                roots.push(edges.snapped(edge, nearest.0));
                continue;
            }
            let (low, high) = ((edges.low[edge], self.omega[0][i]), (edges.high[edge], self.omega[1][i]));
            let same_as_low = (step.1 > 0.0) == (low.1 > 0.0);
            let (other, previous) = match is_across {
                true => (parabola, if same_as_low { low } else { high }),
                false if same_as_low => (high, parabola),
                false => (low, parabola),
            };
            roots.push(f64::NAN);
            self.searches.push(RootSearch::new(
                edge,
                roots.len() - 1,
                [step, other, previous],
                edges.tolerance(edge),
            ));
        }
    }

    /// Finishes the listed searches. Returns the number of evaluations.
    fn search(
        &mut self,
        field: &dyn Field,
        axis: usize,
        edges: &AxisEdges,
        roots: &mut [f64],
    ) -> Result<u64, MeshError> {
        let mut evaluations = 0;
        let mut steps = 0;
        while !self.searches.is_empty() {
            let [along, first, second] = &mut self.columns;
            along.clear();
            along.extend(self.searches.iter().map(|search| search.next));
            for (column, across) in [first, second].into_iter().zip(&edges.across) {
                column.clear();
                column.extend(self.searches.iter().map(|search| across[search.edge]));
            }
            let [along, first, second] = &self.columns;
            let omega = &mut self.omega[0];
            evaluations += evaluate(field, on_axis(axis, along, [first, second]), omega)?;
            steps += 1;
            let mut values = omega.iter();
            self.searches.retain_mut(|search| {
                let omega = values.next().copied().unwrap_or(f64::NAN);
                let root = search.advance(omega, steps < MAX_INTERPOLATIONS);
                if let Some(root) = root {
                    roots[search.slot] = edges.snapped(search.edge, root);
                }
                root.is_none()
            });
        }
        Ok(evaluations)
    }
}

/// Evaluates ω at many points. Returns their number.
///
/// # Errors
/// [`MeshError::NotANumber`] at the first NaN.
fn evaluate(field: &dyn Field, points: Points<'_>, omega: &mut Vec<f64>) -> Result<u64, MeshError> {
    omega.resize(points.len(), 0.0);
    field.omega_many(points, omega);
    if omega.iter().fold(false, |any, w| any | w.is_nan()) {
        let first = omega.iter().position(|w| w.is_nan()).unwrap_or(0);
        return Err(MeshError::NotANumber { at: points.get(first) });
    }
    Ok(points.len() as u64)
}

/// The share of an edge at which the straight line through the values at its ends is zero. It is kept off
/// the ends.
fn line_share(f0: f64, f1: f64) -> f64 {
    let share = f0 / (f0 - f1);
    // not a number when an end is infinite
    if share.is_nan() { 0.5 } else { share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE) }
}

/// The root in [0, 1] of the parabola through (0, f0), (1, f1) and (s, f), and the parabola's slope there.
/// There is exactly one, because f0 and f1 differ in sign.
fn parabola_root(f0: f64, f1: f64, s: f64, f: f64) -> (f64, f64) {
    let rise = f1 - f0;
    // f0 + b·t + c·t²
    let c = (f - f0 - s * rise) / (s * (s - 1.0));
    let b = rise - c;
    let slope = (b * b - 4.0 * c * f0).max(0.0).sqrt().copysign(rise);
    // both forms are equal; this one adds numbers of one sign
    let share = if b * slope >= 0.0 { -2.0 * f0 / (b + slope) } else { (slope - b) / (2.0 * c) };
    (if share.is_nan() { 0.5 } else { share.clamp(0.0, 1.0) }, slope)
}

/// The search on one edge. `newest` and `other` bracket the root, and `previous` is the point that was given
/// up last.
#[derive(Debug, Clone, Copy)]
struct RootSearch {
    edge: usize,
    /// The place in `roots` for the result.
    slot: usize,
    newest: (f64, f64),
    other: (f64, f64),
    previous: (f64, f64),
    /// The bracket width that ends the search.
    tolerance: f64,
    /// The least distance of the next point from the bracket's ends.
    least_step: f64,
    /// The next point to try.
    next: f64,
}

impl RootSearch {
    /// Goes on from the newest point, the point that brackets the root with it, and the point that was
    /// given up.
    fn new(edge: usize, slot: usize, [newest, other, previous]: [(f64, f64); 3], tolerance: f64) -> Self {
        let least_step = FIRST_STEP * tolerance;
        let mut search = Self { edge, slot, newest, other, previous, tolerance, least_step, next: 0.0 };
        search.next = search.at_share(search.quadratic_share().unwrap_or(0.5));
        search
    }

    /// Takes ω at `next` into account. Returns the root once the bracket is as narrow as rounding allows.
    fn advance(&mut self, omega: f64, interpolate: bool) -> Option<f64> {
        // ω = 0 counts as outside, as everywhere: a field may be zero on a whole region.
        if (omega > 0.0) == (self.newest.1 > 0.0) {
            if (self.next - self.newest.0).abs() <= 1.5 * self.least_step {
                self.least_step *= STEP_GROWTH;
            }
            self.previous = self.newest;
        } else {
            self.previous = self.other;
            self.other = self.newest;
        }
        self.newest = (self.next, omega);
        if (self.other.0 - self.newest.0).abs() <= self.tolerance {
            let nearest = if self.newest.1.abs() <= self.other.1.abs() { self.newest } else { self.other };
            return Some(nearest.0);
        }
        let share = if interpolate { self.quadratic_share() } else { None };
        self.next = self.at_share(share.unwrap_or(0.5));
        None
    }

    /// The share of the bracket, from the newest point, at which inverse quadratic interpolation puts the
    /// root. `None` where the three points do not promise a monotone parabola.
    fn quadratic_share(&self) -> Option<f64> {
        let ((x1, f1), (x2, f2), (x3, f3)) = (self.newest, self.other, self.previous);
        let xi = (x1 - x2) / (x3 - x2);
        let phi = (f1 - f2) / (f3 - f2);
        if !(phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi) {
            return None;
        }
        let share = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2);
        share.is_finite().then_some(share)
    }

    /// The point at a share of the bracket, kept off its ends so that every step shrinks it.
    fn at_share(&self, share: f64) -> f64 {
        let (near, width) = (self.newest.0, self.other.0 - self.newest.0);
        let least = (self.least_step / width.abs()).min(0.5);
        near + share.clamp(least, 1.0 - least) * width
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::field::Closures;

    /// Solves f = 0 on [0, 1] along y at x = 2, z = 3; returns the root and the number of evaluations.
    fn root_of(f: impl Fn(f64) -> f64 + Sync) -> (f64, u64) {
        let field = Closures { omega: |p: DVec3| f(p.y), gradient: |_| DVec3::Y };
        let (roots, evaluations) = solve(&field, 1).unwrap();
        (roots[0], evaluations)
    }

    fn solve(field: &dyn Field, count: usize) -> Result<(Vec<f64>, u64), MeshError> {
        let column = |value| vec![value; count];
        let edges = AxisEdges { low: column(0.0), high: column(1.0), across: [column(3.0), column(2.0)] };
        let mut roots = Vec::new();
        let evaluations = RootFinder::default().solve(field, 1, &edges, &mut roots)?;
        Ok((roots, evaluations))
    }

    #[track_caller]
    fn check_root(f: impl Fn(f64) -> f64 + Sync, truth: f64, most_evaluations: u64) {
        let (root, evaluations) = root_of(f);
        assert!((root - truth).abs() <= BRACKET, "{root} for {truth}");
        assert!(evaluations <= most_evaluations, "{evaluations} evaluations");
    }

    #[test]
    fn parabolas_take_five_evaluations_and_smooth_functions_a_few_more() {
        check_root(|y| y - 0.3, 0.3, 5);
        check_root(|y| 0.25 - y * y, 0.5, 5);
        check_root(|y| (y - 0.75) * (y + 3.0), 0.75, 5);
        check_root(|y| y.exp() - 2.0, std::f64::consts::LN_2, 9);
        check_root(|y| (1.0 + 4.0 * y).sqrt() - 2.0, 0.75, 9);
    }

    #[test]
    fn flat_kinked_and_jumping_functions_keep_the_bracket() {
        check_root(|y| (y - 0.3).powi(3), 0.3, 120);
        check_root(|y| if y < 0.7 { -1e-9 } else { 1e6 }, 0.7, 60);
        check_root(|y| (y - 0.6).max(20.0 * (y - 0.6)), 0.6, 60);
        check_root(|y| (0.4 - y).max(0.0), 0.4, 80);
        check_root(|y| if y > 0.2 { f64::INFINITY } else { f64::NEG_INFINITY }, 0.2, 60);
    }

    #[test]
    fn zero_at_the_outer_end_is_the_root() {
        assert_eq!(root_of(|y| y).0, 0.0);
        assert_eq!(root_of(|y| 1.0 - y).0, 1.0);
    }

    #[test]
    fn nan_on_the_way_is_an_error() {
        let some = Closures { omega: |p: DVec3| (p.y - 0.5).sqrt(), gradient: |_| DVec3::X };
        assert!(matches!(solve(&some, 3), Err(MeshError::NotANumber { .. })));
    }

    #[test]
    fn edges_along_each_axis_keep_their_other_coordinates() {
        let field = Closures { omega: |p: DVec3| 14.0 - p.length_squared(), gradient: |p: DVec3| -2.0 * p };
        let at = DVec3::new(1.0, 2.0, 3.0);
        for axis in 0..3 {
            let across = [1, 2].map(|next| vec![at[(axis + next) % 3]]);
            let edges = AxisEdges { low: vec![0.0], high: vec![5.0], across };
            let mut roots = Vec::new();
            RootFinder::default().solve(&field, axis, &edges, &mut roots).unwrap();
            assert!((roots[0] - at[axis]).abs() < 1e-14, "axis {axis}: {}", roots[0]);
        }
    }
}
