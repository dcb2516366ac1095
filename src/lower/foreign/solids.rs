//! Standard solids with the arguments that other tools give them: the call that makes the same solid here.

use super::super::lowering::Lowering;
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{Argument, ExprKind, Name};
use crate::syntax::foreign;

impl Lowering<'_> {
    /// The message for `box(center=[0, 0, 0], size=[1, 1, 1])` and `cylinder(h=2, r1=1, r2=0.5)`; `None` if the
    /// arguments are those of this language, or unknown.
    pub fn solid_of_other_tools(&self, function: &str, arguments: &[Argument]) -> Option<Diagnostic> {
        let given = Given { lowering: self, arguments };
        let (known, call): (&[&str], _) = match function {
            "box" => (&BOX, given.box_of_a_size()),
            "cylinder" | "cone" => (&CONE, given.truncated_cone()),
            _ => return None,
        };
        let foreign = arguments.iter().filter_map(|argument| argument.name.as_ref());
        let first: &Name = foreign.into_iter().find(|name| known.contains(&name.text.as_str()))?;
        let message = format!("`{function}` has no parameter `{}`", first.text);
        let (what, generic) = match function {
            "box" => ("a box goes from corner to corner", "box([0, 0, 0], [1, 1, 1])"),
            _ => (
                "a cone that does not end in a point is a cylinder made narrower upwards",
                "cylinder(2, 3).taper(3, 0.5)",
            ),
        };
        let help = match call {
            Some(call) => format!("{what}: write `{call}`"),
            None => format!("{what}: write for example `{generic}`"),
        };
        Some(Diagnostic::error(Code::ARGUMENTS, first.span, message).help(help))
    }
}

/// What boxes are given elsewhere.
const BOX: [&str; 7] = ["center", "centre", "centered", "size", "sizes", "dimensions", "extents"];

/// What truncated cones are given elsewhere.
const CONE: [&str; 4] = ["r1", "r2", "d1", "d2"];

/// The arguments of a call.
struct Given<'a, 'l> {
    lowering: &'a Lowering<'l>,
    arguments: &'a [Argument],
}

impl<'a> Given<'a, '_> {
    /// What was written for the first of these names.
    fn named(&self, names: &[&str]) -> Option<&'a str> {
        let is_meant = |argument: &&Argument| {
            argument.name.as_ref().is_some_and(|name| names.contains(&name.text.as_str()))
        };
        let argument = self.arguments.iter().find(is_meant)?;
        self.lowering.written(&argument.value)
    }

    /// The parts of a vector that was written for one of these names; a number stands for three of them.
    fn vector(&self, names: &[&str]) -> Option<[&'a str; 3]> {
        let is_meant = |argument: &&Argument| {
            argument.name.as_ref().is_some_and(|name| names.contains(&name.text.as_str()))
        };
        let value = &self.arguments.iter().find(is_meant)?.value;
        match &value.kind {
            ExprKind::Vector(parts) => {
                let [a, b, c] = &parts[..] else { return None };
                Some([self.lowering.written(a)?, self.lowering.written(b)?, self.lowering.written(c)?])
            }
            ExprKind::Number(_) | ExprKind::Quantity { .. } => Some([self.lowering.written(value)?; 3]),
            _ => None,
        }
    }

    /// `box(center=[0, 0, 0], size=[1, 1, 1])`, and `box(size=[1, 1, 1], center=true)`
    fn box_of_a_size(&self) -> Option<String> {
        const CENTRE: [&str; 3] = ["center", "centre", "centered"];
        const SIZE: [&str; 4] = ["size", "sizes", "dimensions", "extents"];
        let size_text = self.named(&SIZE);
        let size = if size_text.is_none() { Some(["1"; 3]) } else { self.vector(&SIZE) };
        let centre = match self.named(&CENTRE) {
            None | Some("false" | "False") => {
                return Some(match size {
                    Some([x, y, z]) => format!("box([0, 0, 0], [{x}, {y}, {z}])"),
                    None => format!("box([0, 0, 0], {})", size_text?),
                });
            }
            Some("true" | "True") => Some(["0"; 3]),
            Some(_) => self.vector(&CENTRE),
        };
        if let (Some(centre), Some(size)) = (centre, size) {
            let corner = |sign| {
                let parts: Vec<String> =
                    centre.iter().zip(&size).map(|(middle, side)| beside(middle, side, sign)).collect();
                format!("[{}]", parts.join(", "))
            };
            return Some(format!("box({}, {})", corner(-1.0), corner(1.0)));
        }
        let (c, s) = (foreign::operand(self.named(&CENTRE)?), foreign::operand(size_text?));
        Some(format!("box({c} - {s}/2, {c} + {s}/2)"))
    }

    /// `cylinder(h=2, r1=1, r2=0.5)`
    fn truncated_cone(&self) -> Option<String> {
        let radius = |r: &str, d: &str| {
            let given = self.named(&[r]).map(str::to_string);
            given.or_else(|| self.named(&[d]).map(|diameter| times(0.5, diameter)))
        };
        let (low, high) = (radius("r1", "d1")?, radius("r2", "d2")?);
        let first = self.arguments.first().filter(|argument| argument.name.is_none());
        let first = first.and_then(|argument| self.lowering.written(&argument.value));
        let h = self.named(&["h", "height"]).or(first).unwrap_or("1");
        if low.parse() == Ok(0.0) {
            return Some(format!("cone({high}, {h}).mirror([0, 0, 1]).move([0, 0, {h}])"));
        }
        if high.parse() == Ok(0.0) {
            return Some(format!("cone({low}, {h})"));
        }
        let top = match (amount(&low), amount(&high)) {
            (Some((low, unit)), Some((high, other))) if unit == other => shown(high / low),
            _ => format!("({high})/({low})"),
        };
        Some(format!("cylinder({low}, {h}).taper({h}, {top})"))
    }
}

/// A number and its unit, which is empty if there is none.
fn amount(text: &str) -> Option<(f64, &str)> {
    let (number, unit) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
    let unit = unit.trim();
    unit.chars().all(char::is_alphabetic).then_some((number.parse().ok()?, unit))
}

/// A number with its unit behind it.
fn with_unit(value: f64, unit: &str) -> String {
    format!("{} {unit}", shown(value)).trim_end().to_string()
}

/// A multiple of what was written.
fn times(factor: f64, text: &str) -> String {
    match amount(text) {
        Some((value, unit)) => with_unit(factor * value, unit),
        None => format!("{factor}*{}", foreign::operand(text)),
    }
}

/// The place half of a side away from a middle: one number if both are numbers of one unit, and a formula otherwise.
fn beside(middle: &str, side: &str, sign: f64) -> String {
    match (amount(middle), amount(side)) {
        (Some((0.0, _)), _) => times(sign * 0.5, side),
        (Some((middle, unit)), Some((side, other))) if unit == other => {
            with_unit(middle + sign * side / 2.0, unit)
        }
        _ => format!("{middle} {} {}", if sign < 0.0 { '-' } else { '+' }, times(0.5, side)),
    }
}

/// A number without the digits that rounding left.
fn shown(value: f64) -> String {
    let rounded: f64 = format!("{:.9e}", value + 0.0).parse().unwrap_or(value);
    rounded.to_string()
}
