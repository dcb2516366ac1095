//! `text("R", height)`: letters of the built-in font as profiles.

use glam::DVec3;

use super::curves::{self, Flaw};
use super::lowering::Lowering;
use super::outline::{self, Point};
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::{Binary, Node, Unary};
use crate::lettering;
use crate::syntax::ast::{Argument, Logic};

/// Chords stay within this part of the height of a capital letter.
const FINENESS: f64 = 1e-3;

/// The most characters of one text.
const LONGEST: usize = 1000;

impl Lowering<'_> {
    /// A line of letters that begins at the origin, `height` the height of its capital letters.
    pub fn text(&mut self, values: &[Value], arguments: &[Argument], span: Span) -> Value {
        let at = self.user_span(arguments[0].value.span);
        let Value::Text(words) = &values[0] else {
            let message = format!("expected a text in quotes, found {}", values[0].describe());
            return self.fail(
                Diagnostic::error(Code::WRONG_TYPE, at, message).help("write for example `text(\"R\", 1)`"),
            );
        };
        let Some(height) = self.above_zero(&values[1], &arguments[1], "the height of letters") else {
            return Value::Failed;
        };
        if words.trim().is_empty() || words.chars().count() > LONGEST {
            let message = format!("a text has 1 to {LONGEST} letters");
            return self.fail(Diagnostic::error(Code::OUT_OF_RANGE, at, message));
        }
        let glyphs = match lettering::contours(words) {
            Ok(glyphs) => glyphs,
            Err(unknown) => {
                let message = format!("the font has no letter for {unknown:?}");
                let diagnostic = Diagnostic::error(Code::OUT_OF_RANGE, at, message);
                return self.fail(diagnostic.help("it has those of Latin, Greek and Cyrillic scripts"));
            }
        };
        let mut letters = Vec::new();
        for glyph in glyphs {
            let chains: Result<Vec<_>, _> = glyph.iter().map(|contour| chain(contour, height)).collect();
            let Ok(chains) = chains else {
                let message = format!("letters of the height {height} cannot be outlined");
                return self
                    .fail(Diagnostic::error(Code::OUT_OF_RANGE, at, message).help("scale the numbers"));
            };
            letters.extend(self.letter(&chains, span));
            if self.over_budget(span) {
                return Value::Failed;
            }
        }
        if letters.is_empty() {
            let message = "the text has no letter with an outline";
            return self.fail(Diagnostic::error(Code::OUT_OF_RANGE, at, message));
        }
        Value::Number(self.balanced(Logic::Or, &letters, span))
    }

    /// The parts of a letter, each without the holes in it.
    fn letter(&mut self, outlines: &[Vec<Point>], span: Span) -> Vec<Node> {
        let holds =
            |outer: usize, inner: usize| outer != inner && is_within(outlines[inner][0], &outlines[outer]);
        let depth = |i: usize| (0..outlines.len()).filter(|&outer| holds(outer, i)).count();
        let mut parts = Vec::new();
        for i in (0..outlines.len()).filter(|&i| depth(i) % 2 == 0) {
            let mut part = self.enclosed(outline::outline(outlines[i].clone()), span);
            for hole in (0..outlines.len()).filter(|&hole| holds(i, hole) && depth(hole) == depth(i) + 1) {
                let inside = self.enclosed(outline::outline(outlines[hole].clone()), span);
                let outside = self.unary(Unary::Neg, inside, span);
                part = self.binary(Binary::And, part, outside, span);
            }
            parts.push(part);
        }
        parts
    }
}

/// The corners of the chords along a contour.
fn chain(contour: &lettering::Contour, height: f64) -> Result<Vec<Point>, Flaw> {
    let place = |[x, y]: [f64; 2]| height * DVec3::new(x, y, 0.0);
    let curves: Vec<[DVec3; 4]> = contour.iter().map(|curve| curve.map(place)).collect();
    let points = curves::beziers(&curves, FINENESS * height)?;
    let mut points: Vec<Point> = points.iter().map(|p| [p.x, p.y]).collect();
    points.dedup();
    if points.first() == points.last() {
        points.pop();
    }
    if points.len() < 3 || outline::flaw(&points).is_some() { Err(Flaw::TooLarge) } else { Ok(points) }
}

/// Whether a point is inside an outline, by a count of the edges that a ray to the right crosses.
fn is_within([x, y]: Point, outline: &[Point]) -> bool {
    let mut inside = false;
    for (i, a) in outline.iter().enumerate() {
        let b = outline[(i + 1) % outline.len()];
        if (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) {
            inside = !inside;
        }
    }
    inside
}
