//! Where ω changes sign along an edge of the grid, to the last digits, for many edges at a time.
//!
//! Chandrupatla's method (Adv. Eng. Software 28, 1997): inverse quadratic interpolation where three points show
//! that it is safe, else bisection. R0 fields bend sharply near creases and may be flat, so a bracket is always
//! kept and bisection bounds the number of steps.
//!
//! Invariant: the result lies in the closed edge and is one of two points at most [`BRACKET`] apart of which one
//! has ω > 0 and the other does not: the one with the smaller |ω|.

use glam::DVec3;

use super::MeshError;
use crate::field::{Field, Points};

/// An edge with ω > 0 at exactly one end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bracket {
    pub axis: usize,
    /// The low end.
    pub from: DVec3,
    /// The high end's coordinate on `axis`.
    pub to: f64,
    /// ω at the low and at the high end.
    pub omega: [f64; 2],
}

/// Edges solved together: enough to fill vector code, few enough to stay in the nearest cache.
const BATCH: usize = 512;

/// Interpolation halves a bracket at least every other step in practice; after this many steps only bisection
/// is used, which ends within 60 more.
const MAX_INTERPOLATIONS: usize = 40;

/// The width of the final bracket relative to the edge's coordinates: a few times the rounding of an R0 field
/// divided by its slope. Narrower ones make the search wander in that rounding: 13 evaluations for each edge of
/// the pawn rather than 8. The root itself is mostly right to the last digit. Roots so near to an edge's end are
/// put on it, so that vertices which meet in a node coincide exactly and can be merged.
const BRACKET: f64 = 32.0 * f64::EPSILON;

/// The first step across a root that interpolation seems to have found, as a share of the final bracket.
const FIRST_STEP: f64 = 0.25;

/// How much longer the next step is if that one does not change the sign: ω is flatter there than three points
/// could show.
const STEP_GROWTH: f64 = 4.0;

/// Appends the surface's coordinate on each edge to `roots`; returns the number of evaluations.
///
/// # Errors
/// [`MeshError::NotANumber`] at the first NaN found.
pub(super) fn solve(field: &dyn Field, brackets: &[Bracket], roots: &mut Vec<f64>) -> Result<u64, MeshError> {
    let mut evaluations = 0;
    let mut batch = Batch::default();
    for edges in brackets.chunks(BATCH) {
        evaluations += batch.solve(field, edges, roots)?;
    }
    Ok(evaluations)
}

/// One edge's search. `newest` and `other` bracket the root, `previous` is the point last given up.
#[derive(Debug, Clone, Copy)]
struct Search {
    edge: usize,
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

#[derive(Debug, Default)]
struct Batch {
    searches: Vec<Search>,
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    omega: Vec<f64>,
}

impl Batch {
    fn solve(
        &mut self,
        field: &dyn Field,
        edges: &[Bracket],
        roots: &mut Vec<f64>,
    ) -> Result<u64, MeshError> {
        let first = roots.len();
        roots.resize(first + edges.len(), f64::NAN);
        let roots = &mut roots[first..];
        self.searches.clear();
        self.searches.extend(edges.iter().enumerate().map(|(i, edge)| Search::new(i, edge)));
        let mut evaluations = 0;
        let mut steps = 0;
        while !self.searches.is_empty() {
            self.evaluate(field, edges)?;
            evaluations += self.searches.len() as u64;
            steps += 1;
            let mut values = self.omega.iter();
            self.searches.retain_mut(|search| {
                let omega = values.next().copied().unwrap_or(f64::NAN);
                let root = search.advance(omega, steps < MAX_INTERPOLATIONS);
                if let Some(root) = root {
                    roots[search.edge] = edges[search.edge].snapped(root);
                }
                root.is_none()
            });
        }
        Ok(evaluations)
    }

    fn evaluate(&mut self, field: &dyn Field, edges: &[Bracket]) -> Result<(), MeshError> {
        self.x.clear();
        self.y.clear();
        self.z.clear();
        for search in &self.searches {
            let mut at = edges[search.edge].from;
            at[edges[search.edge].axis] = search.next;
            self.x.push(at.x);
            self.y.push(at.y);
            self.z.push(at.z);
        }
        self.omega.resize(self.x.len(), 0.0);
        let points = Points::new(&self.x, &self.y, &self.z);
        field.omega_many(points, &mut self.omega);
        match self.omega.iter().position(|w| w.is_nan()) {
            Some(i) => Err(MeshError::NotANumber { at: points.get(i) }),
            None => Ok(()),
        }
    }
}

impl Bracket {
    fn largest_coordinate(&self) -> f64 {
        self.from[self.axis].abs().max(self.to.abs())
    }

    fn snapped(&self, root: f64) -> f64 {
        let (low, reach) = (self.from[self.axis], BRACKET * self.largest_coordinate());
        match root {
            _ if root - low <= reach => low,
            _ if self.to - root <= reach => self.to,
            _ => root,
        }
    }
}

impl Search {
    fn new(edge: usize, bracket: &Bracket) -> Self {
        let low = (bracket.from[bracket.axis], bracket.omega[0]);
        let high = (bracket.to, bracket.omega[1]);
        let tolerance = BRACKET * bracket.largest_coordinate();
        let least_step = FIRST_STEP * tolerance;
        let mut search =
            Self { edge, newest: low, other: high, previous: high, tolerance, least_step, next: 0.0 };
        // The straight line's root; not a number when an end is infinite.
        let share = low.1 / (low.1 - high.1);
        search.next = search.at_share(if share.is_finite() { share } else { 0.5 });
        search
    }

    /// Takes ω at `next` into account; returns the root once the bracket is down to rounding.
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

    /// The share of the bracket, from the newest point, at which inverse quadratic interpolation puts the root;
    /// none where the three points do not promise a monotone parabola.
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
    use super::*;
    use crate::field::Closures;

    /// Solves f = 0 on [0, 1] along y at x = 2, z = 3; returns the root and the number of evaluations.
    fn root_of(f: impl Fn(f64) -> f64 + Sync) -> (f64, u64) {
        let field = Closures { omega: |p: DVec3| f(p.y), gradient: |_| DVec3::Y };
        let edge = Bracket { axis: 1, from: DVec3::new(2.0, 0.0, 3.0), to: 1.0, omega: [f(0.0), f(1.0)] };
        let mut roots = Vec::new();
        let evaluations = solve(&field, &[edge], &mut roots).unwrap();
        (roots[0], evaluations)
    }

    #[track_caller]
    fn check_root(f: impl Fn(f64) -> f64 + Sync, truth: f64, most_evaluations: u64) {
        let (root, evaluations) = root_of(f);
        assert!((root - truth).abs() <= BRACKET, "{root} for {truth}");
        assert!(evaluations <= most_evaluations, "{evaluations} evaluations");
    }

    #[test]
    fn smooth_functions_take_few_steps() {
        check_root(|y| y - 0.3, 0.3, 3);
        check_root(|y| 0.25 - y * y, 0.5, 9);
        check_root(|y| y.exp() - 2.0, std::f64::consts::LN_2, 9);
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
        let field = Closures { omega: |p: DVec3| (p.x - 0.5).sqrt(), gradient: |_| DVec3::X };
        let edge = Bracket { axis: 0, from: DVec3::ZERO, to: 1.0, omega: [-1.0, 1.0] };
        let found = solve(&field, &[edge; 3], &mut Vec::new());
        assert!(matches!(found, Err(MeshError::NotANumber { .. })) || found.is_ok());
        let nowhere = Closures { omega: |_| f64::NAN, gradient: |_| DVec3::X };
        assert!(matches!(solve(&nowhere, &[edge], &mut Vec::new()), Err(MeshError::NotANumber { .. })));
    }
}
