//! `sweep(path, radius)`: all points within a radius of a path.

use glam::DVec3;

use super::lowering::Lowering;
use super::paths::{Dimensions, PathKind};
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::{Axis, Binary, Node, Unary};
use crate::syntax::ast::Argument;

const PATH: PathKind = PathKind {
    list: "a tube follows a list of points",
    point: "a point of a path has three coordinates",
    what: "a point of a path",
    example: "sweep([[0, 0, 0], [1, 0, 0], [1, 1, 0]], 0.1)",
    dimensions: Dimensions::Space,
};

impl Lowering<'_> {
    /// The greatest of the fields of capsules around the segments of a path. At a joint two of them are equal on the
    /// whole ball around it, where R₀ would change the gradient by a factor and the greatest one does not.
    pub fn sweep(&mut self, values: &[Value], arguments: &[Argument], span: Span) -> Value {
        if let Value::Number(node) = values[1]
            && self.depends_on_place(node)
        {
            let at = self.user_span(arguments[1].value.span);
            let message = "a tube has a radius, found a shape";
            let help = "tubes are round: write `sweep([[0, 0, 0], [1, 0, 0]], 0.1)`; profiles go along z by `.extrude(z0, z1)`, and around it by `.revolve()`";
            return self.fail(Diagnostic::error(Code::WRONG_TYPE, at, message).help(help));
        }
        let path = self.spots(&values[0], &arguments[0].value, &PATH);
        let radius = self.above_zero(&values[1], &arguments[1], "the radius of a tube");
        let (Some((spots, _)), Some(radius)) = (path, radius) else { return Value::Failed };
        if !(radius * radius).is_normal() {
            let at = self.user_span(arguments[1].value.span);
            let message = format!("the square of the radius {radius} is no number that can be computed with");
            return self.fail(Diagnostic::error(Code::OUT_OF_RANGE, at, message).help("scale the numbers"));
        }
        let mut points: Vec<DVec3> = spots.iter().map(|spot| spot.at).collect();
        points.dedup();
        if points.len() < 2 {
            let span = self.user_span(arguments[0].value.span);
            let diagnostic = Diagnostic::error(Code::OUT_OF_RANGE, span, "a path has two points or more");
            return self.fail(diagnostic.help("write `ball([0, 0, 0], 0.1)` for a single point"));
        }
        let mut capsules = Vec::with_capacity(points.len() - 1);
        for pair in points.windows(2) {
            let length = pair[0].distance(pair[1]);
            if !length.is_normal() {
                let span = self.user_span(arguments[0].value.span);
                let message =
                    format!("the points {} and {} of the path are {length} apart", pair[0], pair[1]);
                return self
                    .fail(Diagnostic::error(Code::OUT_OF_RANGE, span, message).help("scale the numbers"));
            }
            capsules.push(self.tube([pair[0], pair[1]], length, radius, span));
            if self.over_budget(span) {
                return Value::Failed;
            }
        }
        Value::Number(self.tree(Binary::Max, &capsules, span))
    }

    /// (r² − d²)/2r, with d the distance from a segment. Along and across the segment its parts are lengths
    /// of their own, so that ranges over boxes are as narrow as those of a ball.
    fn tube(&mut self, [a, b]: [DVec3; 2], length: f64, radius: f64, span: Span) -> Node {
        let ahead = (b - a) / length;
        // the coordinate axis that is most across
        let least = ahead.abs().min_element();
        let other = DVec3::AXES.into_iter().find(|axis| ahead.dot(*axis).abs() == least).unwrap_or(DVec3::X);
        let across = ahead.cross(other).normalize();
        let third = ahead.cross(across);
        let [along, v, w] = [ahead, across, third].map(|direction| self.ahead(direction, a, span));
        // ends apart: bounds are found from each of them
        let (zero, end) = (self.constant(0.0), self.constant(length));
        let short = self.unary(Unary::Neg, along, span);
        let before = self.binary(Binary::Max, short, zero, span);
        let far = self.binary(Binary::Sub, along, end, span);
        let beyond = self.binary(Binary::Max, far, zero, span);
        let mut rest = self.constant(radius * radius);
        for part in [v, w, before, beyond] {
            let square = self.binary(Binary::Mul, part, part, span);
            rest = self.binary(Binary::Sub, rest, square, span);
        }
        let diameter = self.constant(2.0 * radius);
        self.binary(Binary::Div, rest, diameter, span)
    }

    /// How far the point of a map lies from a place in a direction.
    fn ahead(&mut self, direction: DVec3, from: DVec3, span: Span) -> Node {
        let parts = [Axis::X, Axis::Y, Axis::Z].into_iter().zip(direction.to_array()).zip(from.to_array());
        self.linear(parts.map(|((axis, slope), from)| (axis, slope, from)), span)
    }

    /// Σ slope·(coordinate − from), without the terms of slope 0.
    pub fn linear(&mut self, terms: impl Iterator<Item = (Axis, f64, f64)>, span: Span) -> Node {
        let mut sum = None;
        for (axis, slope, from) in terms {
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
