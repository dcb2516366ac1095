//! Dimensions of expressions, where units make them known: sums of unlike quantities and arguments of another kind
//! are reported. Numbers without a unit may stand for anything.

use super::lowering::Lowering;
use crate::diagnostic::{Code, Diagnostic, SourceId};
use crate::quantity::{Dimension, parse_unit};
use crate::syntax::ast::{Expr, ExprKind, MulOp, Param};

/// What an argument of a standard function or of a method measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Measure {
    Length,
    /// A number of copies, a ratio or a seed.
    Count,
    /// Whole turns in a length.
    TurnsPerLength,
    /// A factor of coordinates: `.scale(1 mm)` reads a shape in millimetres.
    Factor,
    /// An angle, or a formula for one.
    Angle,
    /// A shape, a direction or a formula.
    Any,
}

impl Measure {
    /// What a parameter of a standard function measures.
    pub fn of(function: &str, parameter: &str) -> Self {
        match (function, parameter) {
            ("twist", "turns") => Self::TurnsPerLength,
            ("taper", "top") | ("narrowed", "factor") | ("polar_repeat", "n") | ("noise", "seed") => {
                Self::Count
            }
            (_, "r" | "R" | "h" | "radius" | "thickness" | "d" | "z0" | "z1" | "centre" | "min" | "max")
            | ("ellipsoid", "a" | "b" | "c")
            | ("half_space", "point") => Self::Length,
            _ => Self::Any,
        }
    }

    /// Whether a quantity of this dimension may stand here.
    fn admits(self, found: Dimension) -> bool {
        let is_plain = found == Dimension::NONE;
        match self {
            Self::Any => true,
            Self::Count => is_plain,
            Self::TurnsPerLength => is_plain || found == Dimension::PER_LENGTH,
            // one over the side of a body makes it a metre long
            Self::Factor => is_plain || found == Dimension::LENGTH || found == Dimension::PER_LENGTH,
            // an angle times a length is the length of an arc
            Self::Length => is_plain || without_angle(found) == Dimension::LENGTH,
            Self::Angle => is_plain || found == Dimension::ANGLE,
        }
    }

    /// What is asked for, and how it is written.
    fn wanted(self) -> (&'static str, &'static str) {
        match self {
            Self::Length => ("a length", "write a length such as `1`, `2 cm` or `5 mm`"),
            Self::Count => ("a plain number", "write a number without a unit"),
            Self::TurnsPerLength => (
                "a number of turns per metre",
                "write turns per metre, as in `.twist(0.25)`, which turns by 90° from z = 0 to z = 1 m",
            ),
            Self::Factor => ("a factor", "write a number without a unit, as in `.scale(2)`"),
            Self::Angle => ("an angle", "write an angle such as `45 deg` or `0.8 rad`"),
            Self::Any => ("a shape", ""),
        }
    }
}

impl Lowering<'_> {
    /// The dimension of an expression, as far as its units tell; `None` if it may be anything.
    pub fn dimension(&self, expr: &Expr) -> Option<Dimension> {
        match &expr.kind {
            ExprKind::Quantity { unit, .. } => parse_unit(&unit.text).map(|unit| unit.dimension),
            ExprKind::Name(name) => {
                let is_local = self.scope.locals.iter().any(|local| local.name == *name);
                let key = (self.scope.source, name.clone());
                self.dimensions.get(&key).map(|known| known.dimension).filter(|_| !is_local)
            }
            ExprKind::Negate(inner) => self.dimension(inner),
            ExprKind::Sum { first, rest } => {
                let mut terms = std::iter::once(&**first).chain(rest.iter().map(|(_, term)| term));
                terms.find_map(|term| self.dimension(term).filter(|found| *found != Dimension::NONE))
            }
            ExprKind::Product { first, rest } => {
                rest.iter().try_fold(self.factor_dimension(first)?, |so_far, (op, factor)| {
                    let factor = self.factor_dimension(factor)?;
                    Some(match op {
                        MulOp::Multiply => so_far.times(factor),
                        MulOp::Divide => so_far.per(factor),
                    })
                })
            }
            ExprKind::Choice { values, .. } => {
                let [first, second] = values.each_ref().map(|value| self.dimension(value));
                first.filter(|first| second == Some(*first))
            }
            ExprKind::Call { function, arguments } => match function.text.as_str() {
                "abs" | "min" | "max" | "clamp" | "hypot" => {
                    arguments.iter().find_map(|argument| self.dimension(&argument.value))
                }
                _ => None,
            },
            ExprKind::Number(_)
            | ExprKind::Text(_)
            | ExprKind::Vector(_)
            | ExprKind::Logic { .. }
            | ExprKind::Not(_)
            | ExprKind::Compare { .. }
            | ExprKind::Power { .. }
            | ExprKind::Component { .. }
            | ExprKind::Member { .. }
            | ExprKind::Method { .. }
            | ExprKind::Index { .. }
            | ExprKind::Fold { .. } => None,
        }
    }

    /// The dimension of a param or name that is made of other quantities, if it is one that shapes have. A plain
    /// number in a product may stand for a quantity, so nothing is concluded for speeds and pressures.
    pub fn derived_dimension(&self, value: &Expr) -> Option<Dimension> {
        const SIMPLE: [Dimension; 4] =
            [Dimension::LENGTH, Dimension::ANGLE, Dimension::TIME, Dimension::MASS];
        self.dimension(value).filter(|found| SIMPLE.contains(found))
    }

    /// The dimension of a factor. One, two and π count; other plain numbers may stand for a quantity in SI units,
    /// as 1000 does for the density of water.
    fn factor_dimension(&self, factor: &Expr) -> Option<Dimension> {
        match &factor.kind {
            ExprKind::Number(number) if [1.0, 2.0].contains(number) => Some(Dimension::NONE),
            ExprKind::Name(name) if name == "pi" => Some(Dimension::NONE),
            _ => self.dimension(factor),
        }
    }

    /// Whether two terms may be added, as far as their units tell. If not, this is reported.
    pub fn may_be_added(&mut self, first: &Expr, second: &Expr) -> bool {
        for (angle, other) in [(first, second), (second, first)] {
            if let ExprKind::Number(number) = other.kind
                && self.dimension(angle) == Some(Dimension::ANGLE)
            {
                self.warn_of_large_angle(number, other);
            }
        }
        let (Some(a), Some(b)) = (self.dimension(first), self.dimension(second)) else { return true };
        let is_plain = a == Dimension::NONE || b == Dimension::NONE;
        if is_plain || a == b || (without_angle(a) == without_angle(b) && without_angle(a) != Dimension::NONE)
        {
            return true;
        }
        let [kind_a, kind_b] = [a, b].map(kind);
        let message = format!("{kind_a} and {kind_b} have no sum");
        let help = if [a, b].contains(&Dimension::ANGLE) && [a, b].contains(&Dimension::LENGTH) {
            "an angle times a radius is a length, as in `2 mm + 30 deg*5 mm`"
        } else {
            "is another name or unit meant? numbers without a unit may be added to anything"
        };
        self.report(
            Diagnostic::error(Code::UNIT_MISMATCH, second.span, message)
                .at(kind_b)
                .label(first.span, kind_a)
                .help(help),
        );
        false
    }

    /// Whether the ends of a param's range may measure what its value does, as far as their units tell. If not, this is
    /// reported.
    pub fn range_measures_the_same(&mut self, param: &Param) -> bool {
        let Some((low, high)) = &param.range else { return true };
        let of = |of: &Self, expr| of.dimension(expr).filter(|found| *found != Dimension::NONE);
        let (stated, [from, to]) = (of(self, &param.value), [low, high].map(|end| of(self, end)));
        let Some(wanted) = stated.or(from) else { return true };
        let wrong = [(from, low), (to, high)].into_iter().find_map(|(found, end)| {
            found.filter(|found| *found != wanted).map(|found| (kind(found), end.span))
        });
        let Some((found, span)) = wrong else { return true };
        let message =
            format!("`{}` is {}, and {found} is no end of its range", param.name.text, kind(wanted));
        let help = "write both ends of the range in a unit of the value, as in `5 mm in 1 mm .. 10 mm`";
        self.report(
            Diagnostic::error(Code::UNIT_MISMATCH, span, message)
                .at(found)
                .label(param.value.span, kind(wanted))
                .help(help),
        );
        false
    }

    /// Warns of a coordinate that is compared with an angle, as in `x <= 10 deg`.
    pub fn warn_of_angle_as_length(&mut self, operands: &[&Expr]) {
        let is_angle = |operand: &&&Expr| self.dimension(operand) == Some(Dimension::ANGLE);
        let Some(angle) = operands.iter().find(is_angle).filter(|angle| angle.span.source.is_users()) else {
            return;
        };
        let Some(length) = operands.iter().find(|operand| is_coordinate(operand)) else { return };
        let written = self.written(angle).unwrap_or("10 deg").to_string();
        let message = "a coordinate, which is a length, is compared with an angle";
        self.report(
            Diagnostic::warning(Code::ANGLE_AS_LENGTH, angle.span, message)
                .at("taken as a number of radians")
                .label(length.span, "a length")
                .help(format!(
                    "the angle of a place about z is `atan2(y, x)`: compare that with `{written}`"
                )),
        );
    }

    /// Warns of squares of coordinates that are compared with a length, as in `x² + y² <= 500 mm`.
    pub fn warn_of_length_as_area(&mut self, operands: &[&Expr]) {
        let is_length = |operand: &&&Expr| self.dimension(operand) == Some(Dimension::LENGTH);
        let Some(length) = operands.iter().find(is_length).filter(|length| length.span.source.is_users())
        else {
            return;
        };
        let Some(area) = operands.iter().find(|operand| is_area(operand)) else { return };
        let squared = match (&length.kind, self.written(length)) {
            (ExprKind::Name(_), Some(written)) => format!("{written}^2"),
            (_, Some(written)) => format!("({written})^2"),
            (_, None) => "(5 mm)^2".to_string(),
        };
        let message = "squares of coordinates, which are an area, are compared with a length";
        self.report(
            Diagnostic::warning(Code::LENGTH_AS_AREA, length.span, message)
                .at("taken as a number of square metres")
                .label(area.span, "an area")
                .help(format!("if this is the radius, write `{squared}`")),
        );
    }

    /// Whether an argument may measure what is asked for, as far as its units tell. If not, this is reported. Of a
    /// vector, each component is looked at.
    pub fn measures(&mut self, expr: &Expr, wanted: Measure) -> bool {
        if let ExprKind::Vector(parts) = &expr.kind {
            return parts.iter().all(|part| self.measures(part, wanted));
        }
        if wanted == Measure::TurnsPerLength {
            self.warn_of_turns_in_degrees(expr);
        }
        let Some(found) = self.dimension(expr).filter(|found| !wanted.admits(*found)) else { return true };
        // turns are an angle over 2π, which has the dimension of an angle here
        let counts_turns = matches!(wanted, Measure::Count | Measure::TurnsPerLength)
            && matches!(expr.kind, ExprKind::Product { .. })
            && wanted.admits(without_angle(found));
        if counts_turns {
            return true;
        }
        if expr.span.source == SourceId::Prelude {
            return true;
        }
        let (what, help) = wanted.wanted();
        let message = format!("{} is not {what}", kind(found));
        let turns = match &expr.kind {
            ExprKind::Quantity { value, unit } => parse_unit(&unit.text)
                .map(|unit| (value * unit.factor / std::f64::consts::TAU * 1e6).round() / 1e6),
            _ => None,
        };
        let help = match (wanted, found) {
            (Measure::TurnsPerLength, Dimension::ANGLE) => match (turns, self.written(expr)) {
                (Some(turns), Some(angle)) => {
                    format!("it takes turns per metre: write `.twist({turns})` for `{angle}` in each metre")
                }
                _ => help.to_string(),
            },
            (Measure::Length, Dimension::ANGLE) => format!("{help}; angles belong to `.rotate_z(45 deg)`"),
            (Measure::TurnsPerLength, Dimension::LENGTH) => match self.written(expr) {
                Some(pitch) => format!("for a whole turn in each `{pitch}`, write `.twist(1/({pitch}))`"),
                None => help.to_string(),
            },
            _ => help.to_string(),
        };
        self.report(Diagnostic::error(Code::UNIT_MISMATCH, expr.span, message).help(help));
        false
    }
}

/// Whether an expression is a number with a unit that no shape has, such as `3 s`, or a vector with one.
pub(super) fn is_foreign_quantity(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Quantity { unit, .. } => parse_unit(&unit.text)
            .is_some_and(|unit| ![Dimension::LENGTH, Dimension::ANGLE].contains(&unit.dimension)),
        ExprKind::Negate(inner) => is_foreign_quantity(inner),
        ExprKind::Vector(parts) => parts.iter().any(is_foreign_quantity),
        _ => false,
    }
}

/// Whether an expression is a coordinate, or one with something added.
fn is_coordinate(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Name(name) => matches!(name.as_str(), "x" | "y" | "z"),
        ExprKind::Negate(inner) => is_coordinate(inner),
        ExprKind::Sum { first, rest } => {
            is_coordinate(first) || rest.iter().any(|(_, term)| is_coordinate(term))
        }
        _ => false,
    }
}

/// Whether an expression is a square of a coordinate, or a sum of such.
fn is_area(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Power { base, exponent } => {
            is_coordinate(base) && matches!(exponent.kind, ExprKind::Number(number) if number == 2.0)
        }
        ExprKind::Product { first, rest } => match &rest[..] {
            [(MulOp::Multiply, second)] => is_coordinate(first) && is_coordinate(second),
            _ => false,
        },
        ExprKind::Sum { first, rest } => is_area(first) && rest.iter().all(|(_, term)| is_area(term)),
        _ => false,
    }
}

/// A dimension in which angles are plain numbers.
fn without_angle(dimension: Dimension) -> Dimension {
    Dimension { angle: 0, ..dimension }
}

/// What a quantity of a dimension is called in messages, with its article.
fn kind(dimension: Dimension) -> String {
    match dimension {
        Dimension::NONE => "a plain number".into(),
        Dimension::LENGTH => "a length".into(),
        Dimension::ANGLE => "an angle".into(),
        Dimension::TIME => "a time".into(),
        Dimension::MASS => "a mass".into(),
        Dimension::SPEED => "a speed".into(),
        Dimension::FREQUENCY => "a rate".into(),
        Dimension::TURN_RATE => "a rate of turning".into(),
        other => match other.unit() {
            Some(unit) => format!("a quantity in {unit}"),
            None => "a quantity of another kind".into(),
        },
    }
}

#[cfg(test)]
mod tests {
    use crate::Program;

    /// Formulas in which units cancel, or in which a plain number may have one.
    #[test]
    fn what_may_be_right_is_accepted() {
        for text in [
            "solid s = layer(atan2(y, x), 0 deg, 30 deg) and box()",
            "param step = 30 deg\nsolid s = sphere(0.1).move([1, 0, 0]).polar_repeat(2*pi/step)",
            "param a = 90 deg\nsolid s = box([0, 0, 0], [1, 0.1, 1]).twist(a/(2*pi))",
            "param side = 20 mm\nsolid s = box().scale(1/side).scale(side)",
            "param s0 = 5 mm\nsolid s = box().rotate_z(5*s0)",
            "param v = 2 m/s\nsolid s = sphere(1).move([0.5*v, 0, 0])",
            "param r = 5 mm\nsolid s = sphere(2*r + 1) and cylinder(2*pi*r, 1)",
            "param stroke = 5 cm\nlet speed = 2*stroke\nscene q { box { max: [1, 1, 1] }
               fluid water { shape: z <= 0.5, velocity: [speed, 0, 0] } run { until: 1 s } }",
        ] {
            let program = Program::from_source("units.rfm", format!("rfm 1\n{text}"));
            assert!(program.is_ok(), "{text}: {:?}", program.err());
        }
    }

    #[test]
    fn what_cannot_be_right_is_refused() {
        for text in [
            "solid s = box().twist(90 deg)",
            "param a = 90 deg\nsolid s = box().twist(a)",
            "solid s = sphere(2 mm + 30 deg)",
            "param r = 5 mm\nsolid s = box().rotate_z(2*r)",
            "param m = 3 kg\nsolid s = sphere(2*m)",
        ] {
            assert!(Program::from_source("units.rfm", format!("rfm 1\n{text}")).is_err(), "{text}");
        }
    }
}
