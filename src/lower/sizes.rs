//! Sizes that do not fit one another: shapes of which nothing is left, walls that fill their shape, tori that
//! cut themselves.

use super::lowering::{Local, Lowering};
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, SourceId, Span};
use crate::geom::Aabb;
use crate::ir::{self, Node};

/// The function of the standard solids that takes away what an offset leaves.
const SHELL: &str = "shell";

impl Lowering<'_> {
    /// Warns of a shape of which a radius or an offset leaves nothing. `within` is a box around the shape before,
    /// and `by` the length by which its faces move inwards at most.
    ///
    /// A shape that is more than twice as wide as that everywhere keeps its middle, so it is not looked at: the
    /// proof takes time. Returns whether it warned.
    pub fn warn_of_nothing_left(&mut self, left: Node, within: Option<Aabb>, by: f64, span: Span) -> bool {
        let is_narrow = within.is_some_and(|within| within.size().min_element() <= 2.0 * by);
        if !is_narrow || self.has_open_params || !ir::is_nowhere_positive(&self.module.graph, left) {
            return false;
        }
        let at = self.user_span(span);
        let call = self.scope.calls.last();
        let is_shell = call.is_some_and(|call| call.source == SourceId::Prelude && call.function == SHELL);
        let (message, help) = if is_shell {
            (
                format!("a wall of {by} fills the shape: nothing of it is hollow"),
                "less than half of the shape's thickness leaves a hollow",
            )
        } else {
            (
                format!("nothing of the shape is left: {by} is too much for it"),
                "less than half of the shape's thickness leaves some of it",
            )
        };
        self.report(Diagnostic::warning(Code::NOTHING_LEFT, at, message).help(help));
        true
    }

    /// Warns of a radius of edges that is larger than half of the thickness of a part which they end.
    pub fn warn_of_thin_part(&mut self, half: f64, radius: f64, span: Span) {
        // `half` comes from the root of a sum, which rounds
        const ROUNDING: f64 = 1e-9;
        if self.has_open_params || radius <= half * (1.0 + ROUNDING) {
            return;
        }
        // what the arc leaves out in the middle of the thickness
        let lost = radius - (radius * radius - (radius - half).powi(2)).sqrt();
        let message = format!(
            "a part is {} thick, less than two radii of {radius}: where it meets another face, it ends at least {} before it",
            short(2.0 * half),
            short(lost)
        );
        self.report(
            Diagnostic::warning(Code::THIN_FOR_EDGES, self.user_span(span), message)
                .help(format!("a radius of {} or less leaves all faces where they are", short(half))),
        );
    }

    /// Warns of a torus whose section is wider than its ring: it cuts itself, and has no hole.
    pub fn warn_of_spindle(&mut self, parameters: &[Local], span: Span) {
        let known = |name: &str| {
            let local = parameters.iter().find(|local| local.name == name)?;
            let Value::Number(node) = local.value else { return None };
            self.known_value(node)
        };
        let (Some(ring), Some(section)) = (known("R"), known("r")) else { return };
        if section > ring && ring > 0.0 {
            let message =
                format!("the section of this torus, r = {section}, is wider than its ring, R = {ring}");
            self.report(
                Diagnostic::warning(Code::SPINDLE, self.user_span(span), message)
                    .at("it cuts itself and has no hole")
                    .help(format!(
                        "the radius of the ring comes first: is `torus({section}, {ring})` meant?"
                    )),
            );
        }
    }
}

/// A number with three digits.
fn short(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}
