//! Mistakes that the rules of the language accept although they are rarely meant: degrees written as radians,
//! ω subtracted from ω, solids without a surface. The messages ask.

use rustc_hash::FxHashMap;

use super::dimensions::Measure;
use super::lowering::Lowering;
use super::names::{Kind, TIME};
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, SourceId, Span};
use crate::geom::significant;
use crate::ir::{Binary, Node};
use crate::quantity::{Dimension, parse_unit};
use crate::syntax::ast::{Argument, Expr, ExprKind, Fold, Logic, MulOp, Name};
use crate::syntax::foreign;

impl Lowering<'_> {
    /// The field of a solid, in which only lengths and angles have units.
    pub fn shape(&mut self, expr: &Expr) -> Option<Node> {
        let outer = std::mem::replace(&mut self.in_shape, true);
        let value = self.expr(expr);
        self.in_shape = outer;
        if value != Value::Failed
            && let Some(diagnostic) = self.list_as_a_shape(&value, expr)
        {
            self.report(diagnostic);
            return None;
        }
        self.as_number(&value, self.origin(expr))
    }

    /// The message for a list of shapes where one shape is asked for.
    fn list_as_a_shape(&mut self, value: &Value, expr: &Expr) -> Option<Diagnostic> {
        let written = match (&expr.kind, value) {
            (ExprKind::Vector(parts), _) if !parts.is_empty() => {
                if !parts.iter().all(|part| self.is_shape(part)) {
                    return None;
                }
                let parts: Option<Vec<String>> =
                    parts.iter().map(|part| self.written(part).map(foreign::operand)).collect();
                parts.map_or("a or b".to_string(), |parts| parts.join(" or "))
            }
            (ExprKind::Fold { op: op @ Fold::List, body, .. }, _) => {
                if !self.is_shape(body) {
                    return None;
                }
                let written = self.written(expr).unwrap_or("list i in 0..6: …");
                written.replacen(op.word(), Fold::Any.word(), 1)
            }
            // three shapes are a vector, as `[x, y, z]` is
            (ExprKind::Name(name), Value::List(members)) => {
                let is_shape =
                    |member: &Value| matches!(member, Value::Number(node) if self.depends_on_place(*node));
                if !members.iter().all(is_shape) {
                    return None;
                }
                format!("any part in {name}: part")
            }
            _ => return None,
        };
        let message = "a list of shapes is no shape";
        Some(
            Diagnostic::error(Code::WRONG_TYPE, self.user_span(expr.span), message)
                .help(format!("to join them, write `{written}`")),
        )
    }

    /// Reports a number that no `f64` can hold.
    pub fn may_be_number(&mut self, value: f64, expr: &Expr) -> bool {
        let written = self.written(expr).unwrap_or_default();
        let mantissa = written.split(['e', 'E']).next().unwrap_or_default();
        let vanishes = value == 0.0 && mantissa.contains(|c: char| ('1'..='9').contains(&c));
        if value.is_finite() && !vanishes {
            return true;
        }
        let message = if vanishes {
            format!("`{written}` is too small for a number: it would be 0")
        } else {
            "the number is too large: it would be infinite".to_string()
        };
        self.report(
            Diagnostic::error(Code::OUT_OF_RANGE, expr.span, message)
                .help("numbers have a magnitude from 5e-324 to 1.8e308"),
        );
        false
    }

    /// Warns of a shape that has no surface because its ω is a constant.
    pub fn warn_of_constant(&mut self, what: &str, node: Node, value: &Expr) {
        let Some(constant) = self.known_value(node) else { return };
        let holds = if constant > 0.0 { "holds all of space" } else { "is empty" };
        let message = format!("{what} is the constant {constant}: it {holds}");
        let warning = Diagnostic::warning(Code::CONSTANT_SOLID, value.span, message);
        let help = match self.written(value) {
            Some(size) if constant > 0.0 => {
                format!("is a size meant? write `sphere({size})`, or an inequality such as `z <= {size}`")
            }
            _ => "write a standard solid such as `sphere(1)`, or an inequality such as `z <= 1`".to_string(),
        };
        self.report(warning.help(help));
    }

    /// Warns of a function that takes the name of a standard solid or map, as in `fn sphere(r) = box()`.
    pub fn warn_of_replaced(&mut self, name: &Name) {
        // what has the name of a function of numbers, such as `cosh`, most often does the same
        if self.names.is_standard_function(&name.text) && self.scope.source == SourceId::File {
            let message = format!(
                "`{0}` is the name of a standard function, and from here on means this one",
                name.text
            );
            let help = format!("give it another name, as in `fn my_{}(…)`", name.text);
            self.report(Diagnostic::warning(Code::REPLACED, name.span, message).help(help));
        }
    }

    /// Warns of the first operand that is the same formula as one before it. Within functions and folds this
    /// may hold for some arguments and members only, so only what is written outside of them is looked at.
    pub fn warn_of_twins(&mut self, op: Logic, operands: &[Expr], nodes: &[Node]) {
        if !self.scope.calls.is_empty() || !self.scope.locals.is_empty() {
            return;
        }
        let mut first_of: FxHashMap<Node, usize> = FxHashMap::default();
        let (mut first_twins, mut count) = (None, 0);
        // a \ a contains nothing, which is reported elsewhere
        for (later, node) in nodes.iter().enumerate().skip(usize::from(op == Logic::Minus)) {
            let earlier = *first_of.entry(*node).or_insert(later);
            if earlier != later {
                first_twins.get_or_insert((earlier, later));
                count += 1;
            }
        }
        let Some((earlier, later)) = first_twins else { return };
        let message = match count {
            1 => format!("two operands of `{}` are the same", op.word()),
            _ => format!("{count} operands of `{}` are the same as others before them", op.word()),
        };
        self.report(
            Diagnostic::warning(Code::IDLE_OPERAND, operands[later].span, message)
                .at("it changes no point of the shape")
                .label(operands[earlier].span, "it is the same as this")
                .help("remove one of them, or look for a slip in its size or place"),
        );
    }

    /// Warns of a division by a constant zero.
    pub fn warn_of_zero(&mut self, divisor: Node, expr: &Expr) {
        let is_zero = self.known_value(divisor) == Some(0.0);
        // elsewhere a value that is not finite is an error of its own
        if is_zero && (self.in_shape || self.in_let) && expr.span.source == SourceId::File {
            self.report(
                Diagnostic::warning(Code::UNDEFINED_VALUE, expr.span, "the divisor is zero")
                    .help("is another divisor meant? what depends on this value is infinite or no number"),
            );
        }
    }

    /// Warns of a function of constants that has no finite value, as `sqrt(-1)`, and of no others: what a value of it
    /// makes undefined is not its mistake.
    pub fn warn_of_undefined(
        &mut self,
        function: &str,
        operands: Option<&[Node]>,
        value: Option<Node>,
        span: Span,
    ) {
        let (Some(operands), Some(node)) = (operands, value) else { return };
        let is_looked_at = (self.in_shape || self.in_let) && span.source == SourceId::File;
        let Some(value) = self.known_value(node).filter(|value| is_looked_at && !value.is_finite()) else {
            return;
        };
        let Some(of) =
            operands.iter().map(|operand| self.known_value(*operand)).collect::<Option<Vec<f64>>>()
        else {
            return;
        };
        if of.iter().all(|operand| operand.is_finite()) {
            let of: Vec<String> = of.into_iter().map(|operand| significant(operand).to_string()).collect();
            let is = if value.is_nan() { "no number" } else { "infinite" };
            let message = format!("`{function}({})` is {is}", of.join(", "));
            self.report(
                Diagnostic::warning(Code::UNDEFINED_VALUE, span, message)
                    .help("is another value meant? what depends on this one is infinite or no number"),
            );
        }
    }

    /// Warns of an operation of arithmetic on two shapes, as in `sphere(1) - sphere(0.5)`.
    pub fn warn_of_shapes(&mut self, op: Binary, left: &Expr, right: &Expr) {
        if !(self.is_shape(left) && self.is_shape(right)) {
            return;
        }
        let (sign, verb, word, purpose) = match op {
            Binary::Sub => ("-", "subtracts", "\\", "to take the second away from the first"),
            Binary::Add => ("+", "adds", "or", "to join them"),
            Binary::Mul => ("*", "multiplies", "and", "for what both of them hold"),
            Binary::Div => ("/", "divides", "\\", "to take the second away from the first"),
            _ => return,
        };
        let written = match (self.written(left), self.written(right)) {
            (Some(a), Some(b)) => format!("{a} {word} {b}"),
            _ => format!("a {word} b"),
        };
        let message = format!("`{sign}` {verb} the values of two shapes; it does not join or cut them");
        self.report(
            Diagnostic::warning(Code::SHAPES_AS_NUMBERS, left.span.to(right.span), message)
                .help(format!("{purpose}, write `{written}`")),
        );
    }

    /// Warns of a power of two shapes, as in `sphere(1) ^ box()`, which some languages have for what is in one alone.
    pub fn warn_of_power_of_shapes(&mut self, base: &Expr, exponent: &Expr) {
        if !(self.is_shape(base) && self.is_shape(exponent)) {
            return;
        }
        let [a, b] = [(base, "a"), (exponent, "b")]
            .map(|(expr, other)| foreign::operand(self.written(expr).unwrap_or(other)));
        let message = "`^` raises the value of a shape to that of another; it does not join or cut them";
        self.report(Diagnostic::warning(Code::SHAPES_AS_NUMBERS, base.span.to(exponent.span), message).help(
            format!("for what is in one of them and not in both, write `({a} or {b}) \\ ({a} and {b})`"),
        ));
    }

    /// Warns of `sum` over shapes, as in `sum i in 0..3: sphere(1).move([i, 0, 0])`.
    pub fn warn_of_sum(&mut self, body: &Expr, fold: Span) {
        if self.is_shape(body) {
            let message = "`sum` adds the values of shapes; it does not join them";
            let joined = match self.written_at(fold) {
                Some(text) => text.replacen("sum", "any", 1),
                None => "any i in 0..6: …".to_string(),
            };
            self.report(
                Diagnostic::warning(Code::SHAPES_AS_NUMBERS, body.span, message)
                    .help(format!("to join them, write `{joined}`")),
            );
        }
    }

    /// Warns of the first operand of `and`, `or` or `\` that is a number, as in `x <= 1 or 2`.
    pub fn warn_of_numbers(&mut self, op: Logic, operands: &[Expr], nodes: &[Node]) {
        let is_number =
            |expr: &Expr| matches!(without_sign(expr).kind, ExprKind::Number(_) | ExprKind::Quantity { .. });
        let mut pairs = std::iter::zip(operands, nodes);
        let Some((operand, node)) = pairs.find(|(expr, _)| is_number(expr) && expr.span.source.is_users())
        else {
            return;
        };
        let Some(constant) = self.known_value(*node) else { return };
        let holds = if constant > 0.0 { "holds all of space" } else { "is empty" };
        let message =
            format!("an operand of `{}` is the number {constant}: as a shape it {holds}", op.word());
        self.report(
            Diagnostic::warning(Code::CONSTANT_SOLID, operand.span, message)
                .help("each operand is a whole shape or comparison, as in `x <= 1 or x >= 2`"),
        );
    }

    /// Whether an expression is written as a shape: a standard solid, a moved one, a solid's name, a
    /// comparison, or shapes joined.
    pub fn is_shape(&mut self, expr: &Expr) -> bool {
        if expr.span.source != SourceId::File {
            return false;
        }
        match &expr.kind {
            ExprKind::Call { function, .. } => {
                let is_layer = function.text == "layer";
                let global = self.names.get(self.scope.source, &function.text);
                !is_layer && global.is_some_and(|g| g.source == SourceId::Prelude)
            }
            ExprKind::Name(name) => {
                let is_local = self.scope.locals.iter().any(|local| local.name == *name);
                let global = self.names.get(self.scope.source, name);
                !is_local && global.is_some_and(|g| matches!(g.kind, Kind::Solid(_)))
            }
            ExprKind::Method { .. }
            | ExprKind::Logic { .. }
            | ExprKind::Not(_)
            | ExprKind::Compare { .. } => true,
            ExprKind::Fold { op, .. } => matches!(op, Fold::Any | Fold::All),
            ExprKind::Choice { values, .. } => values.iter().all(|value| self.is_shape(value)),
            ExprKind::Number(_)
            | ExprKind::Quantity { .. }
            | ExprKind::Text(_)
            | ExprKind::Vector(_)
            | ExprKind::Sum { .. }
            | ExprKind::Product { .. }
            | ExprKind::Negate(_)
            | ExprKind::Power { .. }
            | ExprKind::Index { .. }
            | ExprKind::Component { .. }
            | ExprKind::Member { .. } => false,
        }
    }

    /// Warns of an angle above a whole turn that has no unit, as in `.rotate_z(45)`.
    pub fn warn_of_large_angle(&mut self, angle: f64, expr: &Expr) {
        if angle.abs() <= std::f64::consts::TAU || expr.span.source != SourceId::File || !self.is_bare(expr) {
            return;
        }
        let message = format!("{angle} rad is {:.1} turns", (angle / std::f64::consts::TAU).abs());
        let warning = Diagnostic::warning(Code::LARGE_ANGLE, expr.span, message);
        let (deg, rad) = match self.written(expr) {
            Some(written) => (with_unit(written, "deg"), with_unit(written, "rad")),
            None => ("… deg".into(), "… rad".into()),
        };
        let help = format!("are degrees meant? write `{deg}`, or `{rad}` for radians");
        self.report(warning.help(help));
    }

    /// Warns of an angle above a whole turn that is known now and made of a number that is usual in degrees, as in
    /// `cos(360/n*i)`.
    pub fn warn_of_degrees(&mut self, angle: f64, expr: &Expr) {
        let Some((number, at)) = large_number(expr).filter(|_| self.has_no_unit(expr)) else { return };
        if angle.abs() <= std::f64::consts::TAU
            || !USUAL_IN_DEGREES.contains(&number)
            || expr.span.source != SourceId::File
        {
            return;
        }
        let written = self.written(at).unwrap_or("…").to_string();
        let message =
            format!("an angle of {angle} rad is {:.1} turns", (angle / std::f64::consts::TAU).abs());
        let help = format!(
            "are degrees meant? write `{}`, or `{}` for radians",
            with_unit(&written, "deg"),
            with_unit(&written, "rad")
        );
        self.report(Diagnostic::warning(Code::LARGE_ANGLE, at.span, message).help(help));
    }

    /// Warns of a number beyond all angles that a function gives, as in `atan2(y, x) <= 45`.
    pub fn warn_of_angle_out_of_range(&mut self, operands: &[&Expr]) {
        let function = |operand: &&Expr| match &operand.kind {
            ExprKind::Call { function, .. } if GIVE_ANGLES.contains(&function.text.as_str()) => {
                Some(function.text.clone())
            }
            _ => None,
        };
        let Some(function) = operands.iter().find_map(function) else { return };
        for operand in operands {
            let ExprKind::Number(number) = without_sign(operand).kind else { continue };
            if number <= std::f64::consts::PI || operand.span.source != SourceId::File {
                continue;
            }
            let written = self.written(operand).unwrap_or("…").to_string();
            let message = format!("no angle of `{function}` reaches {number} rad: they lie between -π and π");
            let help = format!("are degrees meant? write `{}`", with_unit(&written, "deg"));
            self.report(Diagnostic::warning(Code::LARGE_ANGLE, operand.span, message).help(help));
        }
    }

    /// Warns of a number of turns that is usual in degrees, as in `.twist(90)`.
    pub fn warn_of_turns_in_degrees(&mut self, expr: &Expr) {
        let ExprKind::Number(number) = without_sign(expr).kind else { return };
        if !USUAL_IN_DEGREES.contains(&number) || expr.span.source != SourceId::File {
            return;
        }
        let sign = if without_sign(expr).span == expr.span { "" } else { "-" };
        let message = format!("{number} turns in each metre");
        let help = format!(
            "are degrees meant? write `.twist({sign}{})`, which turns by {sign}{number}° in each metre",
            significant(number / 360.0)
        );
        self.report(Diagnostic::warning(Code::LARGE_ANGLE, expr.span, message).help(help));
    }

    /// Warns of a number above a whole turn in an angle that depends on t, as in `.rotate_z(40*sin(t))`. In a product
    /// with t it is a rate of turning, as in `.rotate_z(45*t)`: a number of radians per second is often that large,
    /// so only those are reported that are usual in degrees.
    pub fn warn_of_fast_turn(&mut self, expr: &Expr) {
        let Some((number, at)) = large_number(expr).filter(|_| self.has_no_unit(expr)) else { return };
        let is_rate = is_factor_of_time(expr, at);
        if expr.span.source != SourceId::File || is_rate && !USUAL_IN_DEGREES.contains(&number) {
            return;
        }
        let written = self.written(at).unwrap_or("…").to_string();
        let turns = number / std::f64::consts::TAU;
        let message = if is_rate {
            format!("{number} rad/s is {turns:.1} turns per second")
        } else {
            format!("in an angle that depends on t, {number} rad is {turns:.1} turns")
        };
        let help = format!(
            "are degrees meant? write `{}`, or `{}` for radians",
            with_unit(&written, "deg"),
            with_unit(&written, "rad")
        );
        self.report(Diagnostic::warning(Code::LARGE_ANGLE, at.span, message).help(help));
    }

    /// Whether a value is made of numbers without units and without π.
    pub fn is_bare(&self, expr: &Expr) -> bool {
        let is_call = matches!(expr.kind, ExprKind::Call { .. });
        !is_call && self.has_no_unit(expr) && expr.children().into_iter().all(|part| self.is_bare(part))
    }

    /// Whether neither a unit nor π stands in a value, nor in the arguments of its functions.
    fn has_no_unit(&self, expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Quantity { .. } | ExprKind::Text(_) => false,
            ExprKind::Name(name) => {
                let local = self.scope.locals.iter().rev().find(|local| local.name == *name);
                let is_time = name == TIME && !self.without_time.contains(&self.scope.source);
                local.map_or(is_time || self.bare.contains(name), |local| local.bare)
            }
            _ => expr.children().into_iter().all(|part| self.has_no_unit(part)),
        }
    }

    /// Reports an angle where lengths are asked for, as in `ball([1 deg, 0, 0], 1)`.
    pub fn no_angle(&mut self, expr: &Expr) -> bool {
        let ExprKind::Quantity { unit, .. } = &without_sign(expr).kind else { return true };
        let is_angle = parse_unit(&unit.text).is_some_and(|unit| unit.dimension == Dimension::ANGLE);
        if is_angle && expr.span.source == SourceId::File {
            self.report(
                Diagnostic::error(Code::UNIT_MISMATCH, unit.span, "an angle is not a length").help(
                    "write a length such as `1`, `2 cm` or `5 mm`; angles belong to `.rotate_z(45 deg)`",
                ),
            );
        }
        !is_angle
    }

    /// Whether a value may be an angle. One with a unit of another kind is reported, as in `.rotate_z(5 mm)`, and
    /// in `.rotate_z(w)` after `param w = 30 rpm`.
    pub fn may_be_angle(&mut self, expr: &Expr) -> bool {
        let inner = without_sign(expr);
        let span = match &inner.kind {
            ExprKind::Quantity { unit, .. } => unit.span,
            _ => inner.span,
        };
        let written = self.written(inner).unwrap_or("w").to_string();
        let sign = if inner.span == expr.span { "" } else { "-" };
        let (message, help) = match self.dimension(inner) {
            Some(Dimension::LENGTH) => {
                ("a length is not an angle".into(), "write an angle such as `45 deg` or `0.8 rad`".into())
            }
            // a number with such a unit is no value of a shape, and a name for it is needed
            Some(Dimension::TURN_RATE) if matches!(inner.kind, ExprKind::Quantity { .. }) => (
                format!("`{written}` is a rate of turning, not an angle"),
                format!(
                    "write `param w = {written}` above, and `{sign}w*t` here for a shape that turns as time passes"
                ),
            ),
            Some(Dimension::FREQUENCY) if matches!(inner.kind, ExprKind::Quantity { .. }) => (
                format!("`{written}` is a rate, not an angle"),
                format!(
                    "write `param w = {written}` above, and `{sign}2*pi*w*t` here for a shape that turns so often in a \
                     second"
                ),
            ),
            Some(Dimension::TURN_RATE) if matches!(inner.kind, ExprKind::Name(_)) => (
                format!("`{written}` is a rate of turning, not an angle"),
                format!("write `{sign}{written}*t` for a shape that turns as time passes"),
            ),
            Some(Dimension::FREQUENCY) if matches!(inner.kind, ExprKind::Name(_)) => (
                format!("`{written}` is a rate, not an angle"),
                format!("write `{sign}2*pi*{written}*t` for a shape that turns so often in a second"),
            ),
            Some(_) | None => return self.measures(expr, Measure::Angle),
        };
        self.report(Diagnostic::error(Code::UNIT_MISMATCH, span, message).help(help));
        false
    }

    /// The vector that is meant by arguments with the names of axes, as in `.move(y=2)` and `.scale(x=2)`.
    pub fn vector_by_axes(&self, method: &str, arguments: &[Argument]) -> Option<String> {
        let other = match method {
            "move" | "mirror" => "0",
            "scale" => "1",
            _ => return None,
        };
        let mut parts = [other; 3];
        for argument in arguments {
            let name = &argument.name.as_ref()?.text;
            let axis = ["x", "y", "z"].iter().position(|axis| axis == name)?;
            parts[axis] = self.written(&argument.value)?;
        }
        (!arguments.is_empty()).then(|| format!(".{method}([{}])", parts.join(", ")))
    }

    /// How the arguments of a method are written, for a call that has them wrong.
    pub fn call_that_works(&self, method: &str, arguments: &[&Expr]) -> String {
        let written: Option<Vec<&str>> = arguments.iter().map(|argument| self.written(argument)).collect();
        let written = written.unwrap_or_default();
        let is_vector = |text: &str| text.starts_with('[');
        match (method, &written[..]) {
            ("move" | "scale" | "mirror", [a, b, c]) => format!(".{method}([{a}, {b}, {c}])"),
            ("move" | "mirror", [a, b]) if !is_vector(a) => format!(".{method}([{a}, {b}, 0])"),
            ("rotate", [one]) => foreign::turned(one),
            ("rotate", [angle, axis]) if is_vector(axis) && !is_vector(angle) => {
                format!(".rotate({axis}, {})", foreign::in_degrees(angle))
            }
            ("rotate", [x, y, z]) if ![x, y, z].into_iter().any(|text| is_vector(text)) => {
                foreign::turned(&format!("[{x}, {y}, {z}]"))
            }
            ("move", _) => ".move([1, 0, 0])".into(),
            ("rotate", _) => ".rotate([0, 0, 1], 45 deg)".into(),
            ("scale", _) => ".scale(2)` or `.scale([1, 1, 2])".into(),
            ("mirror", _) => ".mirror([1, 0, 0])".into(),
            ("at", _) => ".at([2*x, y, z])".into(),
            ("turned", _) => ".turned(0.5*z)".into(),
            ("repeat", [step, count]) if ![step, count].into_iter().any(|text| is_vector(text)) => {
                format!(".repeat([{step}, 0, 0], [{count}, 1, 1])")
            }
            ("repeat", [step]) if is_vector(step) => format!(".repeat({step}, [6, 1, 1])"),
            ("repeat", _) => ".repeat([2, 0, 0], [6, 1, 1])".into(),
            ("round" | "offset", _) => format!(".{method}(0.1)"),
            ("distance", _) => ".distance()".into(),
            _ => format!(".{method}(45 deg)"),
        }
    }
}

/// Whether a coordinate stands in an expression.
pub(super) fn names_a_coordinate(expr: &Expr) -> bool {
    let is_one = matches!(&expr.kind, ExprKind::Name(name) if matches!(name.as_str(), "x" | "y" | "z"));
    is_one || expr.children().into_iter().any(names_a_coordinate)
}

fn without_sign(expr: &Expr) -> &Expr {
    if let ExprKind::Negate(inner) = &expr.kind { inner } else { expr }
}

/// Functions that give angles.
const GIVE_ANGLES: [&str; 4] = ["atan2", "atan", "asin", "acos"];

/// Numbers that angles in degrees usually have.
const USUAL_IN_DEGREES: [f64; 9] = [30.0, 45.0, 60.0, 72.0, 90.0, 120.0, 180.0, 270.0, 360.0];

/// Whether an expression is t, or a sum with t as in `t - 1 s`.
fn is_time(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Name(name) => name == TIME,
        ExprKind::Negate(inner) => is_time(inner),
        ExprKind::Sum { first, rest } => is_time(first) || rest.iter().any(|(_, term)| is_time(term)),
        _ => false,
    }
}

/// Whether a number in an expression is multiplied by t.
fn is_factor_of_time(expr: &Expr, number: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Product { first, rest } => {
            let factors = || std::iter::once(&**first).chain(rest.iter().map(|(_, factor)| factor));
            let multiplied =
                rest.iter().filter(|(operator, _)| *operator == MulOp::Multiply).map(|(_, factor)| factor);
            std::iter::once(&**first).chain(multiplied).any(is_time)
                && factors().any(|factor| without_sign(factor).span == number.span)
                || factors().any(|factor| is_factor_of_time(factor, number))
        }
        _ => expr.children().into_iter().any(|part| is_factor_of_time(part, number)),
    }
}

/// Functions whose value is as large as an argument. The large number in `0.5*sin(10*t)` is no angle.
const AS_LARGE: [&str; 8] = ["abs", "ceil", "clamp", "floor", "max", "min", "mod", "round"];

/// The first number above a whole turn in an expression, and its place. Whole and half multiples of π stand for turns.
fn large_number(expr: &Expr) -> Option<(f64, &Expr)> {
    let number = match &expr.kind {
        ExprKind::Number(number) => *number,
        ExprKind::Call { function, .. } if !AS_LARGE.contains(&function.text.as_str()) => return None,
        _ => return expr.children().into_iter().find_map(large_number),
    };
    let halves = 2.0 * number / std::f64::consts::PI;
    let is_of_pi = (halves - halves.round()).abs() < 1e-4 * halves;
    (number > std::f64::consts::TAU && !is_of_pi).then_some((number, expr))
}

/// A value with an angle's unit behind it: behind its last number if that is its last factor.
fn with_unit(written: &str, unit: &str) -> String {
    let is_product = written.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '*' | '.' | '-'));
    let last = written.rsplit(['*', '-']).next().unwrap_or_default();
    match (is_product, last.parse::<f64>()) {
        (true, Ok(_)) => format!("{written} {unit}"),
        (true, Err(_)) => format!("{written}*1 {unit}"),
        (false, _) => format!("({written})*1 {unit}"),
    }
}
