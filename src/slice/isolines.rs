//! Level sets of ω in a slice, by marching squares with every crossing refined on ω itself.
//!
//! The grid is surrounded by a rim of nodes that count as outside, so each level gives closed loops: the
//! outlines of {ω ≥ level}, which run along the window's border where the region is cut off. The isolines are
//! these loops without their border parts, so fills and lines fit each other exactly. A node without a value
//! (NaN) counts as rim.
//!
//! Invariant: a loop has ω ≥ level on its left. The order of loops and points depends on the samples alone.

use glam::DVec2;
use rayon::prelude::*;

use super::Samples;
use crate::field::{Field, Points};

/// A connected piece of a level set.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    /// The points in order, as (u, v) in metres.
    pub points: Vec<DVec2>,
    /// Whether the last point is joined to the first one, which is not repeated.
    pub closed: bool,
}

/// A closed outline of {ω ≥ level}.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// The points in order, as (u, v) in metres. The first is not repeated.
    pub points: Vec<DVec2>,
    /// For each point whether it is not on the level, but at the window's border or beside a NaN.
    pub rim: Vec<bool>,
}

/// The lines ω = `level` of a slice. The samples must be those of the field.
pub fn isolines(field: &dyn Field, samples: &Samples, level: f64) -> Vec<Polyline> {
    outlines(field, samples, level).iter().flat_map(Outline::isolines).collect()
}

/// The outlines of the region ω ≥ `level` in the window, to be filled by the even-odd rule. The samples must
/// be those of the field.
pub fn outlines(field: &dyn Field, samples: &Samples, level: f64) -> Vec<Outline> {
    Tracer { field, samples, level }.outlines()
}

impl Outline {
    /// The parts of the outline between rim points.
    pub fn isolines(&self) -> Vec<Polyline> {
        let n = self.points.len();
        let Some(start) = self.rim.iter().position(|&rim| rim) else {
            return vec![Polyline { points: self.points.clone(), closed: true }];
        };
        let mut lines = Vec::new();
        let mut points = Vec::new();
        for i in (start..=start + n).map(|i| i % n) {
            if !self.rim[i] {
                points.push(self.points[i]);
            } else if points.len() > 1 {
                lines.push(Polyline { points: std::mem::take(&mut points), closed: false });
            } else {
                points.clear();
            }
        }
        lines
    }
}

const NONE: u32 = u32::MAX;

/// Traces outlines. Nodes are numbered with the rim: (0, 0) is the rim's corner, (1, 1) the first sample.
struct Tracer<'a> {
    field: &'a dyn Field,
    samples: &'a Samples,
    level: f64,
}

impl Tracer<'_> {
    fn outlines(&self) -> Vec<Outline> {
        let loops = self.loops();
        let crossings = self.crossings(loops.iter().flatten().copied());
        let mut crossings = crossings.into_iter();
        let outline = |edges: Vec<usize>| {
            let mut outline = Outline { points: Vec::new(), rim: Vec::new() };
            for (point, rim) in crossings.by_ref().take(edges.len()) {
                if outline.points.last() != Some(&point) || outline.rim.last() != Some(&rim) {
                    outline.points.push(point);
                    outline.rim.push(rim);
                }
            }
            (outline.points.len() > 2).then_some(outline)
        };
        loops.into_iter().filter_map(outline).collect()
    }

    /// The grid edges that each closed line crosses, in order.
    fn loops(&self) -> Vec<Vec<usize>> {
        let next = self.segments();
        let mut visited = vec![false; next.len()];
        let mut loops = Vec::new();
        for start in 0..next.len() {
            if next[start] == NONE || visited[start] {
                continue;
            }
            let (mut edges, mut edge) = (Vec::new(), start);
            while !visited[edge] {
                visited[edge] = true;
                edges.push(edge);
                edge = next[edge] as usize;
            }
            loops.push(edges);
        }
        loops
    }

    /// For each grid edge that a line crosses, the edge where the line goes next.
    fn segments(&self) -> Vec<u32> {
        let (width, height) = (self.width(), self.samples.rows + 2);
        let mut next = vec![NONE; 2 * width * height];
        for row in 0..height - 1 {
            for column in 0..width - 1 {
                let corner = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| (column + i, row + j));
                let inside = corner.map(|(i, j)| self.inside(self.value(i, j)));
                let count = inside.iter().filter(|&&b| b).count();
                if count == 0 || count == 4 {
                    continue;
                }
                let edge = [
                    self.edge(column, row, false),
                    self.edge(column + 1, row, true),
                    self.edge(column, row + 1, false),
                    self.edge(column, row, true),
                ];
                let saddle = count == 2 && inside[0] == inside[2];
                let joined = saddle && self.inside(self.centre(column, row));
                // on a walk around the square a line enters where the border turns from inside to outside,
                // and leaves where it turns back: at the turn just before, or, if two inside corners are
                // joined through the middle, at the turn just after
                for side in (0..4).filter(|&side| inside[side] && !inside[(side + 1) % 4]) {
                    let step = if joined { 1 } else { 3 };
                    let turns_in = |s: usize| !inside[s] && inside[(s + 1) % 4];
                    let exit = (1..4).map(|k| (side + k * step) % 4).find(|&s| turns_in(s));
                    if let Some(exit) = exit {
                        next[edge[side]] = edge[exit] as u32;
                    }
                }
            }
        }
        next
    }

    fn width(&self) -> usize {
        self.samples.columns + 2
    }

    fn edge(&self, column: usize, row: usize, vertical: bool) -> usize {
        2 * (row * self.width() + column) + usize::from(vertical)
    }

    fn inside(&self, omega: f64) -> bool {
        omega >= self.level
    }

    /// ω at a node. NaN on the rim.
    fn value(&self, column: usize, row: usize) -> f64 {
        let within = |i: usize, n: usize| (1..=n).contains(&i);
        if within(column, self.samples.columns) && within(row, self.samples.rows) {
            self.samples.get(column - 1, row - 1)
        } else {
            f64::NAN
        }
    }

    /// ω in the middle of a square that has four samples.
    fn centre(&self, column: usize, row: usize) -> f64 {
        let diagonal = self.position(column, row) + self.position(column + 1, row + 1);
        self.field.omega(self.samples.plane.point(0.5 * diagonal))
    }

    fn position(&self, column: usize, row: usize) -> DVec2 {
        let clamp = |i: usize, n: usize| i.clamp(1, n) - 1;
        self.samples.position(clamp(column, self.samples.columns), clamp(row, self.samples.rows))
    }

    /// For each crossed edge its point on the level, and whether it is on the rim instead.
    ///
    /// All roots are sought together, because a column of points costs a small part of as many single ones.
    fn crossings(&self, edges: impl Iterator<Item = usize>) -> Vec<(DVec2, bool)> {
        let mut waiting = Vec::new();
        let mut found: Vec<(DVec2, bool)> = Vec::new();
        for edge in edges {
            let [inner, outer] = self.ends(edge);
            found.push((inner.0, outer.1.is_nan()));
            if !outer.1.is_nan() {
                let [lo, hi] = [inner, outer].map(|(_, omega)| omega - self.level);
                waiting.push((found.len() - 1, [inner.0, outer.0], Bracket::new(lo, hi)));
            }
        }
        waiting.par_chunks_mut(SOUGHT_TOGETHER).for_each(|sought| self.find_roots(sought));
        for (k, [inner, outer], bracket) in waiting {
            found[k].0 = inner.lerp(outer, bracket.lo.0);
        }
        found
    }

    /// The ends of a crossed edge with their ω: the one inside the level first.
    fn ends(&self, edge: usize) -> [(DVec2, f64); 2] {
        let (node, vertical) = (edge / 2, edge % 2 == 1);
        let from = (node % self.width(), node / self.width());
        let to = if vertical { (from.0, from.1 + 1) } else { (from.0 + 1, from.1) };
        let [a, b] = [from, to].map(|(i, j)| (self.position(i, j), self.value(i, j)));
        if self.inside(a.1) { [a, b] } else { [b, a] }
    }

    /// Narrows brackets on their edges until each holds its root.
    fn find_roots(&self, sought: &mut [(usize, [DVec2; 2], Bracket)]) {
        let mut open: Vec<(&[DVec2; 2], &mut Bracket, f64)> =
            sought.iter_mut().map(|(_, ends, bracket)| (&*ends, bracket, 0.0)).collect();
        let [mut x, mut y, mut z, mut omega] = [const { Vec::new() }; 4];
        loop {
            open.retain_mut(|(_, bracket, t)| bracket.next().map(|next| *t = next).is_some());
            if open.is_empty() {
                return;
            }
            [&mut x, &mut y, &mut z].into_iter().for_each(Vec::clear);
            for ([inner, outer], _, t) in &open {
                let p = self.samples.plane.point(inner.lerp(*outer, *t));
                x.push(p.x);
                y.push(p.y);
                z.push(p.z);
            }
            omega.clear();
            omega.resize(open.len(), 0.0);
            self.field.omega_many(Points::new(&x, &y, &z), &mut omega);
            for ((_, bracket, t), omega) in open.iter_mut().zip(&omega) {
                bracket.take(*t, omega - self.level);
            }
        }
    }
}

/// The number of roots that one task seeks.
const SOUGHT_TOGETHER: usize = 2048;

/// The final bracket of a root, relative to the edge of a cell: far below the width of a line.
const ROOT_TOLERANCE: f64 = 1e-10;

/// Steps after which a root has to do.
const MOST_STEPS: u32 = 90;

/// The part of [0, 1] that holds a root of f with f(0) ≥ 0 > f(1), narrowed by Illinois steps and bisections in turn, so
/// that kinks and jumps cannot stall it. Steps keep off the ends by the tolerance, so that the far end is drawn in when
/// the near one has reached the root.
#[derive(Debug, Clone, Copy)]
struct Bracket {
    /// The place and the value of the last point that is not below zero, and of the first that is.
    lo: (f64, f64),
    hi: (f64, f64),
    /// Which end the last step moved: 1 the lower, -1 the upper, 0 before the first.
    moved: i8,
    steps: u32,
}

impl Bracket {
    fn new(f0: f64, f1: f64) -> Self {
        Self { lo: (0.0, f0), hi: (1.0, f1), moved: 0, steps: 0 }
    }

    /// Where f is to be taken next; `None` if the root is found.
    fn next(&mut self) -> Option<f64> {
        let Self { lo, hi, steps, .. } = self;
        if lo.1 == 0.0 || hi.0 - lo.0 <= 2.0 * ROOT_TOLERANCE || *steps >= MOST_STEPS {
            return None;
        }
        *steps += 1;
        let secant = lo.0 + (hi.0 - lo.0) * (lo.1 / (lo.1 - hi.1));
        Some(if *steps % 2 == 0 || !secant.is_finite() {
            0.5 * (lo.0 + hi.0)
        } else {
            secant.clamp(lo.0 + ROOT_TOLERANCE, hi.0 - ROOT_TOLERANCE)
        })
    }

    /// Takes the value at a place. The search ends where f has no value.
    fn take(&mut self, t: f64, value: f64) {
        let Self { lo, hi, moved, steps } = self;
        if value >= 0.0 {
            *lo = (t, value);
            if *moved == 1 {
                hi.1 *= 0.5;
            }
            *moved = 1;
        } else if value < 0.0 {
            *hi = (t, value);
            if *moved == -1 {
                lo.1 *= 0.5;
            }
            *moved = -1;
        } else {
            *steps = MOST_STEPS;
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::{
        super::tests::{disc, field},
        *,
    };
    use crate::slice::{Axis, Plane, Window, sample};

    fn trace(field: &dyn Field, half: f64, level: f64) -> Vec<Polyline> {
        let window = Window::new(DVec2::splat(-half), DVec2::splat(half));
        let samples = sample(field, Plane::new(Axis::Z, 0.0), window, 40).unwrap();
        isolines(field, &samples, level)
    }

    #[test]
    fn isoline_of_a_disc_lies_on_the_circle_and_is_closed() {
        let lines = trace(&disc(), 1.0, 0.0);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].closed && lines[0].points.len() > 60);
        for p in &lines[0].points {
            assert!((p.length() - 0.5).abs() < 1e-9, "{p} is off the circle");
        }
    }

    #[test]
    fn outline_turns_left_around_the_inside() {
        let points = &trace(&disc(), 1.0, 0.0)[0].points;
        let twice_area: f64 =
            (0..points.len()).map(|i| points[i].perp_dot(points[(i + 1) % points.len()])).sum();
        // the polygon with 40 samples is inscribed, so its area is a little below π/4
        assert!((0.5 * twice_area - std::f64::consts::FRAC_PI_4).abs() < 5e-3, "{twice_area}");
    }

    #[test]
    fn lines_cut_by_the_window_are_open_and_end_on_its_border() {
        let lines = trace(&disc(), 0.45, 0.0);
        assert_eq!(lines.len(), 4, "the circle of radius 0.5 leaves the window through four sides");
        for line in &lines {
            assert!(!line.closed);
            for end in [line.points[0], *line.points.last().unwrap()] {
                assert!((end.abs().max_element() - 0.45).abs() < 1e-9, "{end} is not on the border");
            }
        }
    }

    #[test]
    fn saddles_follow_the_sample_in_the_middle() {
        // one cell with two opposite corners inside: the bump decides whether they are connected
        for (bump, pieces) in [(0.5, 1), (-0.5, 2)] {
            let f = field(move |p| p.x * p.y + bump * (1.0 - p.x * p.x) * (1.0 - p.y * p.y));
            let window = Window::new(DVec2::splat(-1.0), DVec2::ONE);
            let samples = sample(&f, Plane::new(Axis::Z, 0.0), window, 2).unwrap();
            assert_eq!(outlines(&f, &samples, 0.0).len(), pieces, "bump {bump}");
        }
    }

    #[test]
    fn undefined_nodes_cut_the_lines_without_a_panic() {
        let f = field(|p: DVec3| if p.x > 0.2 { f64::NAN } else { 0.25 - p.length_squared() });
        let lines = trace(&f, 1.0, 0.0);
        assert_eq!(lines.len(), 1);
        assert!(!lines[0].closed);
        let nothing = field(|_| f64::NAN);
        assert!(trace(&nothing, 1.0, 0.0).is_empty());
    }

    #[test]
    fn the_root_of_a_kink_and_of_a_jump_is_found() {
        let root = |f: fn(f64) -> f64, f0, f1| {
            let mut bracket = Bracket::new(f0, f1);
            while let Some(t) = bracket.next() {
                bracket.take(t, f(t));
            }
            bracket.lo.0
        };
        assert!((root(|t| if t < 0.3 { 1e-9 } else { -1e9 }, 1e-9, -1e9) - 0.3).abs() < 3e-10);
        assert!((root(|t| (0.7 - t).min(1e3 * (0.7 - t)), 0.7, -300.0) - 0.7).abs() < 3e-10);
    }
}
