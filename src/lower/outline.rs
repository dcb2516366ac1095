//! `polygon([[x, y], …])`: the field of a simple polygon in x and y.
//!
//! The formula uses the line of each edge once and without *not*, so ω has no zero off the outline: crossing a line
//! at a point where it alone is zero changes the sign, and so crosses the outline. An edge's field is the distance from
//! its line, positive to the left of a polygon that runs counter-clockwise.

use std::cmp::Ordering;

use super::lowering::Lowering;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::{Axis, Binary, Node, Unary};
use crate::syntax::ast::{Expr, ExprKind, Logic};

/// The most corners of a polygon: all pairs of edges are looked at.
const MOST_CORNERS: usize = 10_000;

/// Sines below this are those of rounded angles.
const STRAIGHT: f64 = 1e-14;

type Point = [f64; 2];

/// The polygon as a formula.
#[derive(Debug, PartialEq)]
enum Chain {
    /// The edge from this corner to the next one.
    Edge(usize),
    Joined(Logic, Vec<Chain>),
}

/// What is wrong with an outline.
#[derive(Debug, PartialEq)]
enum Flaw {
    Repeated(usize),
    TurnsBack(usize),
    /// The edges that begin at two corners touch.
    Touch(usize, usize),
    NoArea,
}

impl Lowering<'_> {
    /// The field of the polygon with these corners; it does not depend on z.
    pub fn polygon(&mut self, corners: &Value, written: &Expr) -> Value {
        let Some(mut points) = self.corners(corners, written) else { return Value::Failed };
        // data often ends where it began
        if points.len() > 3 && points.first() == points.last() {
            points.pop();
        }
        let count = points.len();
        if !(3..=MOST_CORNERS).contains(&count) {
            let span = self.user_span(written.span);
            let message = format!("a polygon has 3 to {MOST_CORNERS} corners, found {count}");
            return self.fail(Diagnostic::error(Code::OUT_OF_RANGE, span, message));
        }
        if let Some(flaw) = flaw(&points) {
            let diagnostic = self.explained(&flaw, written);
            return self.fail(diagnostic);
        }
        let outline = outline(points);
        let last = outline.len();
        let corner = |i: usize| outline[i % last];
        let order = |a: &usize, b: &usize| outline[*a].partial_cmp(&outline[*b]).unwrap_or(Ordering::Equal);
        // the leftmost corner and the rightmost one: edges from there go on to the left and to the right
        let (Some(first), Some(second)) = ((0..last).min_by(order), (0..last).max_by(order)) else {
            return Value::Failed;
        };
        let formula = whole(&|i| corner(first + i), (second + last - first) % last, last);
        let span = written.span;
        Value::Number(self.outlined(&formula, &|i| [corner(first + i), corner(first + i + 1)], span))
    }

    /// The corners as numbers; what is none is reported at its place.
    fn corners(&mut self, corners: &Value, written: &Expr) -> Option<Vec<Point>> {
        let Some(members) = corners.members() else {
            let span = self.user_span(written.span);
            let message = format!("a polygon takes a list of corners, found {}", corners.describe());
            let diagnostic = Diagnostic::error(Code::WRONG_TYPE, span, message);
            self.report(diagnostic.help("write for example `polygon([[0, 0], [2, 0], [1, 1]])`"));
            return None;
        };
        let mut points = Vec::with_capacity(members.len());
        for (i, member) in members.iter().enumerate() {
            let at = place_of(written, i);
            let pair = member.members();
            let Some([Value::Number(x), Value::Number(y)]) = pair.as_deref() else {
                let span = self.user_span(at);
                let message = format!("a corner has two coordinates, found {}", described(member));
                let diagnostic = Diagnostic::error(Code::WRONG_TYPE, span, message);
                self.report(diagnostic.help("write for example `polygon([[0, 0], [2, 0], [1, 1]])`"));
                return None;
            };
            let (x, y) = (
                self.as_constant(*x, at, "a corner of a polygon"),
                self.as_constant(*y, at, "a corner of a polygon"),
            );
            let point = [x?, y?];
            if !point.iter().all(|c| c.is_finite()) {
                let message = format!("corner {i} of the polygon is at [{}, {}]", point[0], point[1]);
                self.report(Diagnostic::error(Code::OUT_OF_RANGE, self.user_span(at), message));
                return None;
            }
            points.push(point);
        }
        Some(points)
    }

    fn explained(&self, flaw: &Flaw, written: &Expr) -> Diagnostic {
        let (at, message) = match *flaw {
            Flaw::Repeated(i) => {
                (place_of(written, i), format!("corners {} and {i} of the polygon are the same", i - 1))
            }
            Flaw::TurnsBack(i) => {
                (place_of(written, i), format!("the outline turns back on itself at corner {i}"))
            }
            Flaw::Touch(i, j) => (
                place_of(written, j),
                format!("the outline touches itself: the edges behind corners {i} and {j} meet"),
            ),
            Flaw::NoArea => (written.span, "the polygon has no area".to_string()),
        };
        let diagnostic = Diagnostic::error(Code::OUTLINE, self.user_span(at), message);
        diagnostic.help(
            "corners are counted from 0; list them along the outline, each once, so that no two edges cross",
        )
    }

    fn outlined(&mut self, formula: &Chain, edge: &impl Fn(usize) -> [Point; 2], span: Span) -> Node {
        match formula {
            Chain::Edge(i) => self.beside(edge(*i), span),
            Chain::Joined(op, parts) => {
                let nodes: Vec<Node> = parts.iter().map(|part| self.outlined(part, edge, span)).collect();
                self.balanced(*op, &nodes, span)
            }
        }
    }

    /// The distance from the line through two points, positive to the left.
    fn beside(&mut self, [a, b]: [Point; 2], span: Span) -> Node {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = libm::hypot(dx, dy);
        let mut sum = None;
        for (axis, slope, from) in [(Axis::Y, dx / length, a[1]), (Axis::X, -dy / length, a[0])] {
            if slope == 0.0 {
                continue;
            }
            let coordinate = self.module.graph.coordinate(axis);
            let from = self.constant(from);
            let ahead = self.binary(Binary::Sub, coordinate, from, span);
            let term = if slope.abs() == 1.0 {
                ahead
            } else {
                let size = self.constant(slope.abs());
                self.binary(Binary::Mul, size, ahead, span)
            };
            sum = Some(match sum {
                None if slope < 0.0 => self.unary(Unary::Neg, term, span),
                None => term,
                Some(sum) => {
                    self.binary(if slope < 0.0 { Binary::Sub } else { Binary::Add }, sum, term, span)
                }
            });
        }
        sum.unwrap_or_else(|| self.constant(0.0))
    }
}

/// The place of a corner, if the list was written out, or of the list.
fn place_of(written: &Expr, corner: usize) -> Span {
    match &written.kind {
        ExprKind::Vector(parts) => parts.get(corner).map_or(written.span, |part| part.span),
        _ => written.span,
    }
}

fn described(value: &Value) -> String {
    match value.members() {
        Some(members) => format!("{} with {} members", value.describe(), members.len()),
        None => value.describe().to_string(),
    }
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
fn flaw(points: &[Point]) -> Option<Flaw> {
    let n = points.len();
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
fn outline(mut points: Vec<Point>) -> Vec<Point> {
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

/// The formula of the edges from one corner to a later one. The first edge and the last one go on for ever, so that
/// the chain parts the plane in two. At a corner of its hull it falls into two such chains (Dobkin, Guibas,
/// Hershberger and Snoeyink 1988), which are joined by *and* where the outline turns left and by *or* where it turns
/// right.
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
        assert_eq!(flaw(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), Some(Flaw::Repeated(2)));
        assert_eq!(flaw(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), None);
    }
}
