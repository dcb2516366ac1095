//! Paths: lists of points, and the pieces `arc(…)`, `spline(…)` and `helix(…)` of them, which are lists of points too.

use glam::DVec3;

use super::curves::{self, Flaw, MOST_POINTS};
use super::dimensions::Measure;
use super::lowering::Lowering;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::syntax::ast::{Argument, Expr, ExprKind};

/// Chords stay within this part of the extent of a spline, of the diameter of an arc.
const FINENESS: f64 = 1.0 / 2000.0;

/// Ends of pieces that are closer than this part of the extent are one point.
const JOINT: f64 = 1e-9;

/// A point of a path.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    pub at: DVec3,
    /// Where it was written, or the piece that it belongs to.
    pub place: Span,
    /// The member of the list that it comes from, if that is a piece.
    piece: Option<usize>,
}

/// Which points a path has, and the words of its messages.
#[derive(Debug, Clone, Copy)]
pub(super) struct PathKind {
    /// The word for the list, as in "a polygon takes a list of corners".
    pub list: &'static str,
    /// The word for a point of it, as in "a corner has two coordinates".
    pub point: &'static str,
    /// Both words, as in "a corner of a polygon".
    pub what: &'static str,
    /// How it is written.
    pub example: &'static str,
    pub dimensions: Dimensions,
}

/// The count of coordinates of the points of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dimensions {
    Plane,
    Space,
    /// Two or three, the same for all points.
    Either,
}

const CURVE: PathKind = PathKind {
    list: "a spline takes a list of points",
    point: "a point of a spline has two or three coordinates, as many as the other points",
    what: "a point of a spline",
    example: "spline([[0, 0], [1, 0.4], [2, 0]])",
    dimensions: Dimensions::Either,
};

const CORNERS: PathKind = PathKind {
    list: "a rounded path is made of a list of points",
    point: "a point of a path has two or three coordinates, as many as the other points",
    what: "a point of a path",
    example: "rounded([[0, 0], [2, 0], [2, 1]], 0.2)",
    dimensions: Dimensions::Either,
};

const ARC: PathKind = PathKind {
    list: "an arc goes through three points",
    point: "a point of an arc has two or three coordinates, as many as the other points",
    what: "a point of an arc",
    example: "arc([0, 0], [1, 1], [2, 0])",
    dimensions: Dimensions::Either,
};

impl Lowering<'_> {
    /// The points of a path along it, those of its pieces among them, and how many coordinates they have.
    /// Where a piece begins at the end of the one before, the point is listed once. Values that are no points
    /// are reported at their places.
    pub fn spots(&mut self, path: &Value, written: &Expr, kind: &PathKind) -> Option<(Vec<Spot>, usize)> {
        let Some(members) = path.members() else {
            let span = self.user_span(written.span);
            let message = format!("{}, found {}", kind.list, path.describe());
            let diagnostic = Diagnostic::error(Code::WRONG_TYPE, span, message);
            self.report(diagnostic.help(format!("write for example `{}`", kind.example)));
            return None;
        };
        let mut reading = Reading { kind, dimensions: None, spots: Vec::with_capacity(members.len()) };
        for (i, member) in members.iter().enumerate() {
            let place = place_of(written, i);
            match pieces(member) {
                None => self.spot(member, (i, place), None, &mut reading)?,
                Some(parts) => {
                    for part in parts.iter() {
                        self.spot(part, (i, place), Some(i), &mut reading)?;
                    }
                }
            }
        }
        let dimensions = reading.dimensions.unwrap_or(2);
        let size = extent(reading.spots.iter().map(|spot| spot.at));
        Some((joined(reading.spots, JOINT * size), dimensions))
    }

    fn spot(
        &mut self,
        value: &Value,
        (number, place): (usize, Span),
        piece: Option<usize>,
        reading: &mut Reading<'_>,
    ) -> Option<()> {
        let kind = reading.kind;
        let numbers: Option<Vec<_>> = value.members().and_then(|members| {
            members.iter().map(|m| if let Value::Number(node) = m { Some(*node) } else { None }).collect()
        });
        let fits = |count: usize| match kind.dimensions {
            Dimensions::Plane => count == 2,
            Dimensions::Space => count == 3,
            Dimensions::Either => reading.dimensions.map_or(count == 2 || count == 3, |known| count == known),
        };
        let Some(numbers) = numbers.filter(|numbers| fits(numbers.len())) else {
            let message = format!("{}, found {}", kind.point, described(value));
            let diagnostic = Diagnostic::error(Code::WRONG_TYPE, self.user_span(place), message);
            self.report(diagnostic.help(format!("write for example `{}`", kind.example)));
            return None;
        };
        reading.dimensions = Some(numbers.len());
        let mut at = DVec3::ZERO;
        for (i, node) in numbers.into_iter().enumerate() {
            at[i] = self.as_constant(node, place, kind.what)?;
        }
        if !at.is_finite() {
            let message = format!("point {number} of the path is at {at}, which is not finite");
            self.report(Diagnostic::error(Code::OUT_OF_RANGE, self.user_span(place), message));
            return None;
        }
        reading.spots.push(Spot { at, place, piece });
        Some(())
    }

    /// `arc(a, b, c)`: from a point through another one to a third; `arc(centre, r, from, to)`: around a
    /// centre, from one angle to another. A last argument is the tolerance.
    pub fn arc(&mut self, values: &[Value], arguments: &[Argument], span: Span) -> Value {
        if let Value::Number(_) = values[1] {
            return self.arc_around(values, arguments, span);
        }
        if values.len() > 4 {
            let message =
                format!("an arc through points has three points and a tolerance, found {}", values.len());
            let diagnostic = Diagnostic::error(Code::ARGUMENTS, self.user_span(span), message);
            return self
                .fail(diagnostic.help("write `arc([0, 0], [1, 1], [2, 0])`, or `arc([1, 0], 1, 0°, 180°)`"));
        }
        let mut reading = Reading { kind: &ARC, dimensions: None, spots: Vec::new() };
        for (i, argument) in arguments.iter().enumerate().take(3) {
            if self.spot(&values[i], (i, argument.value.span), None, &mut reading).is_none() {
                return Value::Failed;
            }
        }
        let [a, b, c] = [0, 1, 2].map(|i| reading.spots[i].at);
        let Some(tolerance) = self.fineness(values.get(3).zip(arguments.get(3))) else {
            return Value::Failed;
        };
        let points = curves::arc_through([a, b, c], |radius| tolerance.unwrap_or(2.0 * radius * FINENESS));
        self.curve(points, reading.dimensions.unwrap_or(2), ("an arc", span))
    }

    fn arc_around(&mut self, values: &[Value], arguments: &[Argument], span: Span) -> Value {
        let Some(from_to) = values.get(2..4).zip(arguments.get(2..4)) else {
            let message = "an arc around a centre has a radius and two angles";
            let diagnostic = Diagnostic::error(Code::ARGUMENTS, self.user_span(span), message);
            return self
                .fail(diagnostic.help("write `arc([1, 0], 1, 0°, 180°)`, or `arc([0, 0], [1, 1], [2, 0])`"));
        };
        let plane = PathKind {
            point: "the centre of an arc has two coordinates",
            dimensions: Dimensions::Plane,
            ..ARC
        };
        let mut reading = Reading { kind: &plane, dimensions: None, spots: Vec::new() };
        let place = (0, arguments[0].value.span);
        if self.spot(&values[0], place, None, &mut reading).is_none() {
            return Value::Failed;
        }
        let Some(radius) = self.above_zero(&values[1], &arguments[1], "the radius of an arc") else {
            return Value::Failed;
        };
        let mut angles = [0.0; 2];
        for (angle, (value, argument)) in angles.iter_mut().zip(from_to.0.iter().zip(from_to.1)) {
            if !self.may_be_angle(&argument.value) {
                return Value::Failed;
            }
            let node = self.as_number(value, argument.value.span);
            let Some(known) = node.and_then(|n| self.as_constant(n, argument.value.span, "an angle")) else {
                return Value::Failed;
            };
            self.warn_of_large_angle(known, &argument.value);
            *angle = known;
        }
        let turn = angles[1] - angles[0];
        if turn == 0.0 || !turn.is_finite() || curves::beyond_a_turn(turn) {
            let at = self.user_span(arguments[2].value.span.to(arguments[3].value.span));
            let message = format!("an arc turns by an angle up to 360°, found {:.6}°", turn.to_degrees());
            let diagnostic = Diagnostic::error(Code::OUT_OF_RANGE, at, message);
            return self.fail(diagnostic.help("write for example `arc([1, 0], 1, 0°, 180°)`"));
        }
        let Some(tolerance) = self.fineness(values.get(4).zip(arguments.get(4))) else {
            return Value::Failed;
        };
        let tolerance = tolerance.unwrap_or(2.0 * radius * FINENESS);
        self.curve(curves::arc(reading.spots[0].at, radius, angles, tolerance), 2, ("an arc", span))
    }

    /// `helix(radius, pitch, turns)`: around z, from `[radius, 0, 0]` upwards.
    pub fn helix(&mut self, values: &[Value], arguments: &[Argument], span: Span) -> Value {
        let Some(radius) = self.above_zero(&values[0], &arguments[0], "the radius of a helix") else {
            return Value::Failed;
        };
        let mut numbers = [0.0; 2];
        for (i, what) in [(1, "the pitch of a helix"), (2, "the turns of a helix")] {
            let at = arguments[i].value.span;
            if !self.measures(&arguments[i].value, if i == 1 { Measure::Length } else { Measure::Count }) {
                return Value::Failed;
            }
            let node = self.as_number(&values[i], at);
            let Some(known) = node.and_then(|node| self.as_constant(node, at, what)) else {
                return Value::Failed;
            };
            if !known.is_finite() || (i == 2 && known == 0.0) {
                let message = format!("{what} cannot be {known}");
                return self.fail(Diagnostic::error(Code::OUT_OF_RANGE, self.user_span(at), message));
            }
            numbers[i - 1] = known;
        }
        let Some(tolerance) = self.fineness(values.get(3).zip(arguments.get(3))) else {
            return Value::Failed;
        };
        let tolerance = tolerance.unwrap_or(2.0 * radius * FINENESS);
        self.curve(curves::helix(radius, numbers[0], numbers[1], tolerance), 3, ("a helix", span))
    }

    /// `spline([[x, y], …])`: a smooth curve through points, closed if the last is the first.
    pub fn spline(&mut self, values: &[Value], arguments: &[Argument], span: Span) -> Value {
        let Some((spots, dimensions)) = self.spots(&values[0], &arguments[0].value, &CURVE) else {
            return Value::Failed;
        };
        let Some(tolerance) = self.fineness(values.get(1).zip(arguments.get(1))) else {
            return Value::Failed;
        };
        let points = through(&spots);
        let tolerance = tolerance.unwrap_or(FINENESS * extent(points.iter().copied()));
        match self.flaw_at(curves::spline(&points, tolerance), &spots) {
            Ok(chain) => self.curve(chain, dimensions, ("a spline", span)),
            Err(diagnostic) => self.fail(diagnostic),
        }
    }

    /// `rounded([[x, y], …], r)`: straight pieces with an arc at each corner, closed if the last point is the first.
    pub fn rounded(&mut self, values: &[Value], arguments: &[Argument], span: Span) -> Value {
        let Some((spots, dimensions)) = self.spots(&values[0], &arguments[0].value, &CORNERS) else {
            return Value::Failed;
        };
        let radius = self.above_zero(&values[1], &arguments[1], "the radius of corners");
        let tolerance = self.fineness(values.get(2).zip(arguments.get(2)));
        let (Some(radius), Some(tolerance)) = (radius, tolerance) else { return Value::Failed };
        let points = through(&spots);
        let chain = curves::rounded(&points, radius, tolerance.unwrap_or(2.0 * radius * FINENESS));
        match self.flaw_at(chain, &spots) {
            Ok(chain) => self.curve(chain, dimensions, ("a rounded path", span)),
            Err(diagnostic) => self.fail(diagnostic),
        }
    }

    /// The message for a flaw at one of the points of a curve.
    fn flaw_at<T>(&self, chain: Result<T, Flaw>, spots: &[Spot]) -> Result<Result<T, Flaw>, Diagnostic> {
        let (at, message, help) = match chain {
            Err(Flaw::Repeated(i)) => (
                i,
                format!("points {} and {i} of the path are the same", i - 1),
                "points are counted from 0; list each once, the first again at the end to close the curve",
            ),
            Err(Flaw::TurnsBack(i)) => (
                i,
                format!("the path turns back on itself at point {i}"),
                "points are counted from 0; list them along the path",
            ),
            Err(Flaw::NoRoom(i)) => (
                i,
                format!("there is no room for the arc at point {i}: the pieces beside it are too short"),
                "points are counted from 0; make the radius smaller, or the pieces longer",
            ),
            Ok(_) | Err(Flaw::OnALine | Flaw::TooFew | Flaw::TooFine | Flaw::TooLarge) => return Ok(chain),
        };
        let diagnostic = Diagnostic::error(Code::OUTLINE, self.user_span(spots[at].place), message);
        Err(diagnostic.help(help))
    }

    /// A list of points, or what was wrong with its curve.
    fn curve(
        &mut self,
        points: Result<Vec<DVec3>, Flaw>,
        dimensions: usize,
        (what, span): (&str, Span),
    ) -> Value {
        let (message, help) = match points {
            Ok(points) => {
                let mut members = Vec::with_capacity(points.len());
                for p in points {
                    let [x, y, z] = p.to_array().map(|c| self.constant(c));
                    let flat = || Value::List([x, y].map(Value::Number).into());
                    members.push(if dimensions == 3 { Value::Vector([x, y, z]) } else { flat() });
                }
                return self.list(members, span);
            }
            Err(Flaw::OnALine) => (
                "the three points of the arc lie on a line".into(),
                "list a straight piece by its ends, without `arc`",
            ),
            Err(Flaw::TooFew | Flaw::Repeated(_) | Flaw::TurnsBack(_) | Flaw::NoRoom(_)) => (
                format!("{what} goes through two points or more, a closed one through three"),
                "list more points, each once",
            ),
            Err(Flaw::TooFine) => (
                format!("{what} with this tolerance has more than {MOST_POINTS} points"),
                "the tolerance is the greatest distance of the chords from the curve: make it larger",
            ),
            Err(Flaw::TooLarge) => {
                (format!("{what} has points that are too far apart or too close"), "scale the numbers")
            }
        };
        self.fail(Diagnostic::error(Code::OUT_OF_RANGE, self.user_span(span), message).help(help))
    }

    /// A tolerance that may be left out; `None` if it was reported.
    fn fineness(&mut self, given: Option<(&Value, &Argument)>) -> Option<Option<f64>> {
        match given {
            None => Some(None),
            Some((value, argument)) => self.above_zero(value, argument, "the tolerance of a curve").map(Some),
        }
    }

    /// A constant above zero.
    pub fn above_zero(&mut self, value: &Value, argument: &Argument, what: &str) -> Option<f64> {
        let at = argument.value.span;
        if !self.measures(&argument.value, Measure::Length) {
            return None;
        }
        let node = self.as_number(value, at)?;
        let known = self.as_constant(node, at, what)?;
        if known > 0.0 && known.is_finite() {
            return Some(known);
        }
        let message = format!("{what} must be positive, found {known}");
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, self.user_span(at), message));
        None
    }
}

/// The points that were read so far.
struct Reading<'a> {
    kind: &'a PathKind,
    dimensions: Option<usize>,
    spots: Vec<Spot>,
}

/// The points of a member of a path that is a piece: a list of lists.
fn pieces(member: &Value) -> Option<std::sync::Arc<[Value]>> {
    match member {
        Value::List(parts) if matches!(parts.first(), Some(Value::List(_) | Value::Vector(_))) => {
            Some(parts.clone())
        }
        Value::List(_) | Value::Vector(_) | Value::Number(_) | Value::Text(_) | Value::Failed => None,
    }
}

/// The place of a point, if the list was written out, or of the list.
fn place_of(written: &Expr, point: usize) -> Span {
    match &written.kind {
        ExprKind::Vector(parts) => parts.get(point).map_or(written.span, |part| part.span),
        _ => written.span,
    }
}

/// The points without the first one of each piece that begins where the path is, and without a point that was written
/// where a piece ends.
fn joined(spots: Vec<Spot>, close: f64) -> Vec<Spot> {
    let mut kept: Vec<Spot> = Vec::with_capacity(spots.len());
    for spot in spots {
        match kept.last_mut() {
            Some(last) if is_joint(last, &spot, close) => {
                // a point that was written is more exact than one that was computed
                if last.piece.is_some() {
                    *last = spot;
                }
            }
            _ => kept.push(spot),
        }
    }
    kept
}

/// Whether two neighbours are one point because one of them is the end of a piece.
pub(super) fn is_joint(a: &Spot, b: &Spot, close: f64) -> bool {
    a.piece != b.piece && a.at.distance(b.at) <= close
}

/// Whether a path that goes round ends where it began, in one point that is listed twice.
pub(super) fn is_closed(spots: &[Spot]) -> bool {
    let size = extent(spots.iter().map(|spot| spot.at));
    matches!(spots, [first, .., last] if first.at == last.at || is_joint(last, first, JOINT * size))
}

/// The points that a curve goes through. A last one that is the first but for rounding, as of a path that is computed
/// from angles, closes it.
fn through(spots: &[Spot]) -> Vec<DVec3> {
    let mut points: Vec<DVec3> = spots.iter().map(|spot| spot.at).collect();
    let close = JOINT * extent(points.iter().copied());
    if let [first, _, _, .., last] = &mut points[..]
        && first.distance(*last) <= close
    {
        *last = *first;
    }
    points
}

/// The longest side of the box around points.
fn extent(points: impl Iterator<Item = DVec3>) -> f64 {
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in points {
        (min, max) = (min.min(p), max.max(p));
    }
    (max - min).max_element().max(0.0)
}

fn described(value: &Value) -> String {
    match value.members() {
        Some(members) => format!("{} with {} members", value.describe(), members.len()),
        None => value.describe().to_string(),
    }
}
