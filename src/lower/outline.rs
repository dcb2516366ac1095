//! `polygon([[x, y], …])`: the field of a simple polygon in x and y.
//!
//! The formula uses the line of each edge once and without *not*, so ω has no zero off the outline: crossing a line
//! at a point where it alone is zero changes the sign, and so crosses the outline. An edge's field is the distance from
//! its line, positive to the left of a polygon that runs counter-clockwise.

use std::cmp::Ordering;

use super::lowering::Lowering;
use super::paths::{self, Dimensions, PathKind, Spot};
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::{Axis, Binary, Node};
use crate::syntax::ast::{Expr, Logic};

/// The most corners of a polygon: all pairs of edges are looked at.
const MOST_CORNERS: usize = 10_000;

/// Corners count as those between chords of a curve up to this turn (cosine of 15°).
const SMOOTH: f64 = 0.965_925_826_289_068_3;

/// Sines below this are those of rounded angles.
const STRAIGHT: f64 = 1e-14;

/// Corners farther from the origin than this are refused: products of their distances must not overflow.
const FARTHEST: f64 = 1e150;

pub(super) type Point = [f64; 2];

const CORNERS: PathKind = PathKind {
    list: "a polygon takes a list of corners",
    point: "a corner has two coordinates",
    what: "a corner of a polygon",
    example: "polygon([[0, 0], [2, 0], [1, 1]])",
    dimensions: Dimensions::Plane,
};

/// The polygon as a formula.
#[derive(Debug, PartialEq)]
enum Chain {
    /// The edge from this corner to the next one.
    Edge(usize),
    Joined(Logic, Vec<Chain>),
}

/// What is wrong with an outline.
#[derive(Debug, PartialEq)]
pub(super) enum Flaw {
    Repeated(usize),
    TurnsBack(usize),
    /// The edges that begin at two corners touch.
    Touch(usize, usize),
    NoArea,
    /// A corner lies so far away that areas would overflow.
    TooFar(usize),
}

impl Lowering<'_> {
    /// The field of the polygon with these corners; it does not depend on z.
    pub fn polygon(&mut self, corners: &Value, written: &Expr) -> Value {
        let Some((mut spots, _)) = self.spots(corners, written, &CORNERS) else { return Value::Failed };
        // data often ends where it began
        if spots.len() > 3 && paths::is_closed(&spots) {
            spots.pop();
        }
        let points: Vec<Point> = spots.iter().map(|spot| [spot.at.x, spot.at.y]).collect();
        let count = points.len();
        if !(3..=MOST_CORNERS).contains(&count) {
            let span = self.user_span(written.span);
            let message = format!("a polygon has 3 to {MOST_CORNERS} corners, found {count}");
            return self.fail(Diagnostic::error(Code::OUT_OF_RANGE, span, message));
        }
        if let Some(flaw) = flaw(&points) {
            let diagnostic = self.explained(&flaw, &spots, written);
            return self.fail(diagnostic);
        }
        Value::Number(self.enclosed(outline(points), written.span))
    }

    /// The field of an outline without flaws, counter-clockwise.
    pub fn enclosed(&mut self, outline: Vec<Point>, span: Span) -> Node {
        let count = outline.len();
        let order = |a: &usize, b: &usize| outline[*a].partial_cmp(&outline[*b]).unwrap_or(Ordering::Equal);
        // the leftmost corner and the rightmost one: edges from there continue to the left and to the right
        let first = (0..count).min_by(order).unwrap_or(0);
        let second = (0..count).max_by(order).unwrap_or(0);
        let corners: Vec<Point> = (0..=count).map(|i| outline[(first + i) % count]).collect();
        let corner = |i: usize| corners[i % count];
        let formula = whole(&corner, (second + count - first) % count, count);
        let (node, _) = self.outlined((&formula, true), &corners, span);
        let hull = self.octagon(&corners, span);
        self.module.graph.enclose(node, hull);
        node
    }

    /// A field that is positive inside the smallest octagon of its kind around the corners, and just outside. Chains
    /// of a concave outline have no end by themselves, so its formula does not show where it ends.
    fn octagon(&mut self, corners: &[Point], span: Span) -> Node {
        let margin = rounding(corners);
        let (x, y) = (self.module.graph.coordinate(Axis::X), self.module.graph.coordinate(Axis::Y));
        let (sum, difference) = (self.binary(Binary::Add, x, y, span), self.binary(Binary::Sub, x, y, span));
        let along = [(x, [1.0, 0.0]), (y, [0.0, 1.0]), (sum, [1.0, 1.0]), (difference, [1.0, -1.0])];
        let sides = along.map(|(along, [a, b])| {
            let places = corners.iter().map(|p| a * p[0] + b * p[1]);
            let [least, most] = places
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], place| [lo.min(place), hi.max(place)]);
            let [least, most] = [least - margin, most + margin].map(|end| self.constant(end));
            [self.binary(Binary::Sub, along, least, span), self.binary(Binary::Sub, most, along, span)]
        });
        self.tree(Binary::Min, sides.as_flattened(), span)
    }

    fn explained(&self, flaw: &Flaw, spots: &[Spot], written: &Expr) -> Diagnostic {
        let (at, message) = match *flaw {
            Flaw::Repeated(i) => {
                (spots[i].place, format!("corners {} and {i} of the polygon are the same", i - 1))
            }
            Flaw::TurnsBack(i) => (spots[i].place, format!("the outline turns back on itself at corner {i}")),
            Flaw::Touch(i, j) => (
                spots[j].place,
                format!("the outline touches itself: the edges behind corners {i} and {j} meet"),
            ),
            Flaw::NoArea => (written.span, "the polygon has no area".to_string()),
            Flaw::TooFar(i) => {
                let message =
                    format!("corner {i} of the polygon is farther than {FARTHEST:e} from the origin");
                return Diagnostic::error(Code::OUT_OF_RANGE, self.user_span(spots[i].place), message);
            }
        };
        let diagnostic = Diagnostic::error(Code::OUTLINE, self.user_span(at), message);
        diagnostic.help(
            "corners are counted from 0; list them along the outline, each once, so that no two edges cross",
        )
    }

    /// The field of a part of the formula, and its first edge; the whole formula goes round. Parts that meet
    /// at a corner of less than [`SMOOTH`] are joined by the least or the greatest of both: along the chords
    /// of a curve, R₀ of many fields that are nearly equal would be far from the distance.
    fn outlined(
        &mut self,
        (formula, is_whole): (&Chain, bool),
        corners: &[Point],
        span: Span,
    ) -> (Node, usize) {
        let (op, parts) = match formula {
            Chain::Edge(i) => return (self.beside([corners[*i], corners[i + 1]], span), *i),
            Chain::Joined(op, parts) => (*op, parts),
        };
        let parts: Vec<_> = parts.iter().map(|part| self.outlined((part, false), corners, span)).collect();
        let mut runs: Vec<Vec<Node>> = parts
            .chunk_by(|_, (_, edge)| is_smooth(corners, *edge))
            .map(|run| run.iter().map(|(node, _)| *node).collect())
            .collect();
        if is_whole && runs.len() > 1 && is_smooth(corners, 0) {
            let last = runs.pop().unwrap_or_default();
            runs[0].extend(last);
        }
        let choice = if op == Logic::And { Binary::Min } else { Binary::Max };
        let nodes: Vec<Node> = runs.iter().map(|run| self.tree(choice, run, span)).collect();
        (self.balanced(op, &nodes, span), parts[0].1)
    }

    /// The distance from the line through two points, positive to the left.
    fn beside(&mut self, [a, b]: [Point; 2], span: Span) -> Node {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = libm::hypot(dx, dy);
        let terms = [(Axis::Y, dx / length, a[1]), (Axis::X, -dy / length, a[0])];
        self.linear(terms.into_iter(), span)
    }
}

/// Whether the outline hardly turns where an edge begins. The first corner is also the last one.
fn is_smooth(corners: &[Point], edge: usize) -> bool {
    let before = if edge > 0 { edge - 1 } else { corners.len() - 2 };
    let [u, v] = [before, edge].map(|i| {
        let (a, b) = (corners[i], corners[i + 1]);
        [b[0] - a[0], b[1] - a[1]]
    });
    u[0] * v[0] + u[1] * v[1] > SMOOTH * libm::hypot(u[0], u[1]) * libm::hypot(v[0], v[1])
}

/// How far the formula's corners may lie from those given, for rounding: its lines are off by rounding, and those of a
/// needle cross far from there.
fn rounding(corners: &[Point]) -> f64 {
    let size = corners.as_flattened().iter().fold(0.0_f64, |size, c| size.max(c.abs()));
    let narrowest = |corner: usize| {
        let [a, b, c] = [corner - 1, corner, corner + 1].map(|i| corners[i % (corners.len() - 1)]);
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
        let turns_back = u[0] * v[0] + u[1] * v[1] < 0.0;
        let sine = (u[0] * v[1] - u[1] * v[0]).abs() / (libm::hypot(u[0], u[1]) * libm::hypot(v[0], v[1]));
        if turns_back { sine } else { 1.0 }
    };
    let narrowest = (1..corners.len()).map(narrowest).fold(1.0, f64::min);
    // sums and differences of two coordinates are farther off than each of them
    32.0 * f64::EPSILON * size / narrowest.max(STRAIGHT)
}

/// Twice the area of the triangle a b c, positive if it runs counter-clockwise; 0 if its corners lie on a line but for
/// rounding.
fn side(a: Point, b: Point, c: Point) -> f64 {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let cross = u[0] * v[1] - u[1] * v[0];
    let scale = libm::hypot(u[0], u[1]) * libm::hypot(v[0], v[1]);
    if cross.abs() <= STRAIGHT * scale { 0.0 } else { cross }
}

/// The first flaw of an outline.
pub(super) fn flaw(points: &[Point]) -> Option<Flaw> {
    let n = points.len();
    if let Some(i) = (0..n).find(|&i| points[i].iter().any(|c| c.abs() > FARTHEST)) {
        return Some(Flaw::TooFar(i));
    }
    if let Some(i) = (1..n).find(|&i| points[i] == points[i - 1]) {
        return Some(Flaw::Repeated(i));
    }
    let corner = |i: usize| points[i % n];
    let turns_back = |i: usize| {
        let (a, b, c) = (corner(i + n - 1), corner(i), corner(i + 1));
        let ahead = (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]);
        side(a, b, c) == 0.0 && ahead <= 0.0
    };
    if let Some(i) = (0..n).find(|&i| turns_back(i)) {
        return Some(Flaw::TurnsBack(i));
    }
    for i in 0..n {
        for j in i + 2..n {
            let neighbours = i == 0 && j == n - 1;
            if !neighbours && touch([corner(i), corner(i + 1)], [corner(j), corner(j + 1)]) {
                return Some(Flaw::Touch(i, j));
            }
        }
    }
    (area(points) == 0.0).then_some(Flaw::NoArea)
}

/// Whether two segments have a point in common.
fn touch([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let apart = |i: usize| a[i].max(b[i]) < c[i].min(d[i]) || c[i].max(d[i]) < a[i].min(b[i]);
    if apart(0) || apart(1) {
        return false;
    }
    let on_both_sides = |p: f64, q: f64| p == 0.0 || q == 0.0 || (p > 0.0) != (q > 0.0);
    on_both_sides(side(a, b, c), side(a, b, d)) && on_both_sides(side(c, d, a), side(c, d, b))
}

/// Twice the area, positive if the outline runs counter-clockwise.
fn area(points: &[Point]) -> f64 {
    let from = points[0];
    let part =
        |p: &Point, q: &Point| (p[0] - from[0]) * (q[1] - from[1]) - (p[1] - from[1]) * (q[0] - from[0]);
    points.windows(2).map(|pair| part(&pair[0], &pair[1])).sum()
}

/// The corners counter-clockwise, without those in the middle of a straight line.
pub(super) fn outline(mut points: Vec<Point>) -> Vec<Point> {
    if area(&points) < 0.0 {
        points.reverse();
    }
    let mut corners: Vec<Point> = Vec::with_capacity(points.len());
    let n = points.len();
    for i in 0..n {
        let before = corners.last().copied().unwrap_or(points[n - 1]);
        if side(before, points[i], points[(i + 1) % n]) != 0.0 {
            corners.push(points[i]);
        }
    }
    corners
}

/// The formula of a polygon whose corners 0 and `opposite` are its farthest to the left and to the right.
fn whole(corner: &impl Fn(usize) -> Point, opposite: usize, count: usize) -> Chain {
    joined(Logic::And, [chain(corner, 0, opposite), chain(corner, opposite, count)])
}

/// The formula of the edges from one corner to a later one. The first edge and the last one have no end, so
/// that the chain divides the plane in two. At a corner of its hull it splits into two such chains (Dobkin,
/// Guibas, Hershberger and Snoeyink 1988), which are joined by *and* where the outline turns left and by *or*
/// where it turns right.
fn chain(corner: &impl Fn(usize) -> Point, from: usize, to: usize) -> Chain {
    if to - from == 1 {
        return Chain::Edge(from);
    }
    let at = hull_corner(corner, from, to);
    let is_left = side(corner(at - 1), corner(at), corner(at + 1)) > 0.0;
    let op = if is_left { Logic::And } else { Logic::Or };
    joined(op, [chain(corner, from, at), chain(corner, at, to)])
}

/// Two chains as one; what is joined by the same operation becomes one list.
fn joined(op: Logic, chains: [Chain; 2]) -> Chain {
    let mut parts = Vec::new();
    for chain in chains {
        match chain {
            Chain::Joined(inner, all) if inner == op => parts.extend(all),
            other => parts.push(other),
        }
    }
    Chain::Joined(op, parts)
}

/// A corner of the hull of a chain whose first and last edge have no end: the farthest one against the direction
/// halfway between theirs.
fn hull_corner(corner: &impl Fn(usize) -> Point, from: usize, to: usize) -> usize {
    let unit = |a: Point, b: Point| {
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        let length = libm::hypot(x, y);
        [x / length, y / length]
    };
    let back = unit(corner(from + 1), corner(from));
    let ahead = unit(corner(to - 1), corner(to));
    let mut towards = [back[0] + ahead[0], back[1] + ahead[1]];
    if libm::hypot(towards[0], towards[1]) < STRAIGHT {
        towards = [-ahead[1], ahead[0]];
    }
    let place = |i: usize| {
        let p = corner(i);
        (towards[0] * p[0] + towards[1] * p[1], towards[0] * p[1] - towards[1] * p[0])
    };
    let order = |a: &usize, b: &usize| place(*a).partial_cmp(&place(*b)).unwrap_or(Ordering::Equal);
    (from + 1..to).min_by(order).unwrap_or(from + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formula(points: &[Point]) -> Chain {
        let points = outline(points.to_vec());
        let n = points.len();
        let order = |a: &usize, b: &usize| points[*a].partial_cmp(&points[*b]).unwrap();
        let (first, second) = ((0..n).min_by(order).unwrap(), (0..n).max_by(order).unwrap());
        whole(&|i| points[(first + i) % n], (second + n - first) % n, n)
    }

    #[test]
    fn a_convex_outline_is_one_conjunction() {
        let square = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.5], [1.0, 0.0]];
        let Chain::Joined(Logic::And, parts) = formula(&square) else { panic!() };
        assert_eq!(parts.len(), 4);
    }

    #[test]
    fn a_notch_is_a_disjunction() {
        let notched = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 1.0], [0.0, 2.0]];
        let Chain::Joined(Logic::And, parts) = formula(&notched) else { panic!() };
        assert!(parts.contains(&Chain::Joined(Logic::Or, vec![Chain::Edge(2), Chain::Edge(3)])), "{parts:?}");
    }

    #[test]
    fn flaws_are_found() {
        let bow = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(flaw(&bow), Some(Flaw::Touch(0, 2)));
        assert_eq!(flaw(&[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]]), Some(Flaw::TurnsBack(0)));
        // areas of such corners would be infinite
        assert_eq!(flaw(&[[0.0, 0.0], [1.0, 0.0], [-1e308, 1.0]]), Some(Flaw::TooFar(2)));
        assert_eq!(flaw(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), Some(Flaw::Repeated(2)));
        assert_eq!(flaw(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), None);
    }
}
