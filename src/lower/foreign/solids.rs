//! Standard solids with the arguments that other tools give them: the call that makes the same solid here.

use super::super::lowering::Lowering;
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{Argument, Expr, ExprKind, Name};
use crate::syntax::foreign;

impl Lowering<'_> {
    /// The message for `box(center=[0, 0, 0], size=[1, 1, 1])` and `cylinder(h=2, r1=1, r2=0.5)`; `None` if the
    /// arguments are those of this language, or unknown.
    pub fn solid_of_other_tools(&self, function: &str, arguments: &[Argument]) -> Option<Diagnostic> {
        if let Some(diagnostic) = self.centred_solid(function, arguments) {
            return Some(diagnostic);
        }
        let mut given = Given { lowering: self, unread: arguments.iter().collect() };
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
            _ if call.as_ref().is_some_and(|call| call.starts_with("cone(")) => {
                ("a cone has the radius of its base, and ends in a point", "cone(1, 2)")
            }
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

    /// The message for `cylinder(1, 2, center=true)`; `None` if the arguments are others than a radius, a height and this.
    fn centred_solid(&self, function: &str, arguments: &[Argument]) -> Option<Diagnostic> {
        if !["cylinder", "cone", "capsule"].contains(&function) {
            return None;
        }
        let name = arguments.iter().filter_map(|argument| argument.name.as_ref());
        let name = name.into_iter().find(|name| CENTRE.contains(&name.text.as_str()))?;
        let mut given = Given { lowering: self, unread: arguments.iter().collect() };
        let centre = given.named(&CENTRE)?;
        let is_centred = match given.written(centre)? {
            "true" | "True" => true,
            "false" | "False" => false,
            _ => return None,
        };
        let r = given.named(&["r", "radius"]).or_else(|| given.unnamed())?;
        let h = given.named(&["h", "height"]).or_else(|| given.unnamed())?;
        let (r, h) = (given.written(r)?, given.written(h)?);
        if !given.unread.is_empty() {
            return None;
        }
        let lowered = if is_centred { format!(".move([0, 0, {}])", times(-0.5, h)) } else { String::new() };
        let message = format!("`{function}` has no parameter `{}`", name.text);
        let help = format!("a {function} begins at z = 0: write `{function}({r}, {h}){lowered}`");
        Some(Diagnostic::error(Code::ARGUMENTS, name.span, message).help(help))
    }
}

/// What boxes are given elsewhere.
const BOX: [&str; 7] = ["center", "centre", "centered", "size", "sizes", "dimensions", "extents"];

/// What truncated cones are given elsewhere.
const CONE: [&str; 4] = ["r1", "r2", "d1", "d2"];

/// The arguments of a call. What is suggested in its place has read all of them: one that nobody asked for may
/// change the solid.
struct Given<'a, 'l> {
    lowering: &'a Lowering<'l>,
    unread: Vec<&'a Argument>,
}

const CENTRE: [&str; 3] = ["center", "centre", "centered"];
const SIZE: [&str; 4] = ["size", "sizes", "dimensions", "extents"];

impl<'a> Given<'a, '_> {
    /// What was given for the first of these names, which counts as read.
    fn named(&mut self, names: &[&str]) -> Option<&'a Expr> {
        let is_meant = |argument: &&Argument| {
            argument.name.as_ref().is_some_and(|name| names.contains(&name.text.as_str()))
        };
        let at = self.unread.iter().position(is_meant)?;
        Some(&self.unread.remove(at).value)
    }

    /// The first argument without a name, which counts as read.
    fn unnamed(&mut self) -> Option<&'a Expr> {
        let at = self.unread.iter().position(|argument| argument.name.is_none())?;
        Some(&self.unread.remove(at).value)
    }

    fn written(&self, value: &Expr) -> Option<&'a str> {
        self.lowering.written(value)
    }

    /// The three parts of a vector.
    fn vector(&self, value: &Expr) -> Option<[&'a str; 3]> {
        let ExprKind::Vector(parts) = &value.kind else { return None };
        let [a, b, c] = &parts[..] else { return None };
        Some([self.written(a)?, self.written(b)?, self.written(c)?])
    }

    /// The three sides of a box; a number stands for three of them.
    fn sides(&self, value: &Expr) -> Option<[&'a str; 3]> {
        match &value.kind {
            ExprKind::Number(_) | ExprKind::Quantity { .. } => Some([self.written(value)?; 3]),
            _ => self.vector(value),
        }
    }

    /// `box(center=[0, 0, 0], size=[1, 1, 1])`, `box(size=[1, 1, 1], center=true)` and `box([1, 1, 1], center=true)`
    fn box_of_a_size(&mut self) -> Option<String> {
        let centre = self.named(&CENTRE);
        let size = self.named(&SIZE).or_else(|| centre.and_then(|_| self.unnamed()));
        if !self.unread.is_empty() {
            return None;
        }
        let sides = match size {
            Some(size) => self.sides(size),
            None => Some(["1"; 3]),
        };
        let is_name = |value: &Expr| matches!(value.kind, ExprKind::Name(_));
        let middle = match (centre, centre.and_then(|centre| self.written(centre))) {
            (None, _) | (_, Some("false" | "False")) => {
                return match (sides, size) {
                    (Some([x, y, z]), _) => Some(format!("box([0, 0, 0], [{x}, {y}, {z}])")),
                    (None, Some(size)) if is_name(size) => {
                        Some(format!("box([0, 0, 0], {})", self.written(size)?))
                    }
                    (None, _) => None,
                };
            }
            (_, Some("true" | "True")) => ["0"; 3],
            (Some(centre), Some(name)) if is_name(centre) => {
                let size = size?;
                let is_vector = is_name(size) || self.vector(size).is_some();
                let side = foreign::operand(self.written(size)?);
                return is_vector.then(|| format!("box({name} - {side}/2, {name} + {side}/2)"));
            }
            (Some(centre), _) => match (self.vector(centre), size) {
                (Some(middle), _) if sides.is_some() => middle,
                (Some(_), Some(size)) if is_name(size) => {
                    let (middle, side) = (self.written(centre)?, self.written(size)?);
                    return Some(format!("box({middle} - {side}/2, {middle} + {side}/2)"));
                }
                _ => return None,
            },
        };
        let sides = sides?;
        let corner = |sign| {
            let parts: Vec<String> =
                middle.iter().zip(&sides).map(|(middle, side)| beside(middle, side, sign)).collect();
            format!("[{}]", parts.join(", "))
        };
        Some(format!("box({}, {})", corner(-1.0), corner(1.0)))
    }

    /// A radius, or half of a diameter.
    fn radius(&mut self, r: &str, d: &str) -> Option<String> {
        if let Some(radius) = self.named(&[r]) {
            return self.written(radius).map(str::to_string);
        }
        let diameter = self.named(&[d])?;
        Some(times(0.5, self.written(diameter)?))
    }

    /// `cylinder(h=2, r1=1, r2=0.5)`
    fn truncated_cone(&mut self) -> Option<String> {
        let (low, high) = (self.radius("r1", "d1")?, self.radius("r2", "d2")?);
        let h = match self.named(&["h", "height"]).or_else(|| self.unnamed()) {
            Some(h) => self.written(h)?,
            None => "1",
        };
        let centred = match self.named(&CENTRE).map(|centre| self.written(centre)) {
            None | Some(Some("false" | "False")) => false,
            Some(Some("true" | "True")) => true,
            Some(_) => return None,
        };
        if self.unread.is_empty() { truncated_cone((&low, &high), h, centred) } else { None }
    }
}

/// The call for a cone by its radii below and above and its height; `None` if there is no such solid. It stands on
/// z = 0, or has its middle there.
pub(super) fn truncated_cone((low, high): (&str, &str), h: &str, centred: bool) -> Option<String> {
    let (bottom, top) = (amount(low), amount(high));
    let is_negative = |radius: Option<(f64, &str)>| radius.is_some_and(|(radius, _)| radius < 0.0);
    let is_point = |radius: Option<(f64, &str)>| radius.is_some_and(|(radius, _)| radius == 0.0);
    if is_negative(bottom) || is_negative(top) {
        return None;
    }
    let lowered = if centred { format!(".move([0, 0, {}])", times(-0.5, h)) } else { String::new() };
    match (is_point(bottom), is_point(top)) {
        (true, true) => None,
        (true, false) => {
            let raised = if centred { times(0.5, h) } else { h.to_string() };
            Some(format!("cone({high}, {h}).mirror([0, 0, 1]).move([0, 0, {raised}])"))
        }
        (false, true) => Some(format!("cone({low}, {h}){lowered}")),
        (false, false) => {
            let ratio = match (bottom, top) {
                (Some((low, unit)), Some((high, other))) if unit == other => shown(high / low),
                _ => format!("({high})/({low})"),
            };
            Some(format!("cylinder({low}, {h}).taper({h}, {ratio}){lowered}"))
        }
    }
}

/// A number and its unit, which is empty if there is none.
fn amount(text: &str) -> Option<(f64, &str)> {
    let (number, unit) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
    let (value, unit): (f64, _) = (number.parse().ok()?, unit.trim());
    // names like `inf` are no numbers here
    let is_number = value.is_finite() && number.ends_with(|c: char| c.is_ascii_digit() || c == '.');
    (is_number && unit.chars().all(char::is_alphabetic)).then_some((value, unit))
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
