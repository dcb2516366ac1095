//! Expressions → values.

use super::builtins;
use super::foreign;
use super::lowering::Lowering;
use super::names::{Kind, TIME};
use super::slips::names_a_coordinate;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, SourceId, Span};
use crate::ir::{Axis, Binary, BinaryFunction, Node, Unary};
use crate::quantity::{Dimension, parse_unit};
use crate::syntax::ast::{AddOp, Comparison, Expr, ExprKind, Logic, MulOp, Name};

/// The most expressions that are evaluated inside one another. With the limits of the parser it takes a chain
/// of calls to get there.
const DEEPEST_EVALUATION: usize = 2000;

/// Number of messages that come with a suggestion. In a file with more of them something else is wrong.
const MOST_SUGGESTIONS: usize = 100;

impl Lowering<'_> {
    /// A number or field; anything else is reported.
    pub fn field(&mut self, expr: &Expr) -> Option<Node> {
        let value = self.expr(expr);
        self.as_number(&value, self.origin(expr))
    }

    /// Where the value of an expression was written: for a parameter, the argument of the call.
    pub fn origin(&self, expr: &Expr) -> Span {
        let local = match &expr.kind {
            ExprKind::Name(name) if expr.span.source == SourceId::Prelude => {
                self.scope.locals.iter().rev().find(|local| local.name == *name)
            }
            _ => None,
        };
        local.map_or(expr.span, |local| local.span)
    }

    /// A number known when the file is compiled; anything else is reported.
    pub fn constant_expr(&mut self, expr: &Expr, what: &str) -> Option<f64> {
        let node = self.field(expr)?;
        self.as_constant(node, expr.span, what)
    }

    /// The value of an expression; [`Value::Failed`] if a part of it was in error, which was reported.
    pub fn expr(&mut self, expr: &Expr) -> Value {
        self.evaluations += 1;
        if self.over_budget(expr.span) {
            return Value::Failed;
        }
        if self.depth >= DEEPEST_EVALUATION {
            let span = self.user_span(expr.span);
            return self.fail(Diagnostic::error(Code::TOO_DEEP, span, "the calls unroll too deeply"));
        }
        self.depth += 1;
        let value = self.evaluate(expr);
        self.depth -= 1;
        value
    }

    fn evaluate(&mut self, expr: &Expr) -> Value {
        let span = expr.span;
        match &expr.kind {
            ExprKind::Number(value) if self.may_be_number(*value, expr) => {
                Value::Number(self.constant(*value))
            }
            ExprKind::Quantity { value, unit } if self.may_be_number(*value, expr) => {
                self.quantity(*value, unit)
            }
            ExprKind::Number(_) | ExprKind::Quantity { .. } => Value::Failed,
            ExprKind::Text(text) => Value::Text(text.clone()),
            ExprKind::Name(name) => self.name(name, span),
            ExprKind::Vector(parts) => self.vector(parts, span),
            ExprKind::Logic { op, operands } => self.logic(*op, operands, span),
            ExprKind::Not(inner) | ExprKind::Negate(inner) => {
                let value = self.expr(inner);
                self.negate(&value, span)
            }
            ExprKind::Compare { first, rest } => self.compare(first, rest, span),
            ExprKind::Sum { first, rest } => self.sums(first, rest),
            ExprKind::Product { first, rest } => self.products(first, rest),
            ExprKind::Power { base, exponent } => self.power(base, exponent, span),
            ExprKind::Call { function, arguments } => self.call(function, arguments, span),
            ExprKind::Component { vector, axis } => {
                let value = self.expr(vector);
                self.component(&value, *axis, self.origin(vector))
            }
            ExprKind::Member { of, name } => self.member(of, name),
            ExprKind::Method { receiver, method, arguments } => {
                self.method(receiver, method, arguments, span)
            }
            ExprKind::Index { list, index } => self.index(list, index, span),
            ExprKind::Fold { op, variable, members, body } => self.fold(*op, variable, members, body, span),
            ExprKind::Choice { condition, values } => {
                let [first, second] = &**values;
                self.choose(condition, [first, second], span)
            }
        }
    }

    /// `a + b - c`
    fn sums(&mut self, first: &Expr, rest: &[(AddOp, Expr)]) -> Value {
        let mut value = self.expr(first);
        for (op, operand) in rest {
            let right = self.expr(operand);
            let op = match op {
                AddOp::Add => Binary::Add,
                AddOp::Subtract => Binary::Sub,
            };
            self.warn_of_shapes(op, first, operand);
            if value != Value::Failed && right != Value::Failed && !self.may_be_added(first, operand) {
                return Value::Failed;
            }
            value = self.sum(op, &value, &right, first.span.to(operand.span));
        }
        value
    }

    /// `a*b/c`
    fn products(&mut self, first: &Expr, rest: &[(MulOp, Expr)]) -> Value {
        let mut value = self.expr(first);
        for (op, operand) in rest {
            let right = self.expr(operand);
            let op = match op {
                MulOp::Multiply => Binary::Mul,
                MulOp::Divide => Binary::Div,
            };
            self.warn_of_shapes(op, first, operand);
            if let (Binary::Div, Value::Number(divisor)) = (op, &right) {
                self.warn_of_zero(*divisor, operand);
            }
            value = self.product(op, &value, &right, first.span.to(operand.span));
        }
        value
    }

    fn quantity(&mut self, value: f64, unit: &Name) -> Value {
        let Some(parsed) = parse_unit(&unit.text) else {
            let message = format!("unknown unit `{}`", unit.text);
            return self.fail(Diagnostic::error(Code::UNKNOWN_UNIT, unit.span, message));
        };
        if self.in_shape && ![Dimension::LENGTH, Dimension::ANGLE].contains(&parsed.dimension) {
            let message = format!("`{}` is not a length or an angle", unit.text);
            // what moves is a formula of `t`, in which a name for the quantity is needed
            let name = match parsed.dimension {
                Dimension::TURN_RATE | Dimension::FREQUENCY => Some("w"),
                Dimension::SPEED => Some("v"),
                Dimension::TIME => Some("q"),
                _ => None,
            };
            let help = match name {
                Some(name) => format!(
                    "inside shapes only lengths and angles have units; define a name above: write \
                     `param {name} = {value} {}`, and `{name}` here",
                    unit.text
                ),
                None => format!(
                    "inside shapes only lengths and angles have units: write a length such as `{value} mm`, or a number \
                     without a unit"
                ),
            };
            return self.fail(Diagnostic::error(Code::UNIT_MISMATCH, unit.span, message).help(help));
        }
        Value::Number(self.constant(value * parsed.factor))
    }

    /// Reports `t` in a scene of a file that gives this name to something else.
    fn time_is_taken(&mut self, span: Span) -> Value {
        let diagnostic = Diagnostic::error(Code::RESERVED_NAME, span, "`t` is the time in a scene");
        let diagnostic = match self.names.defined_at(self.scope.source, TIME) {
            Some(defined) => diagnostic.label(defined, "and this here in the file"),
            None => diagnostic,
        };
        self.fail(diagnostic.help(
            "give the other one another name; or another name to its value, as in `let thickness = t` above the scene",
        ))
    }

    fn name(&mut self, name: &str, span: Span) -> Value {
        if let Some(local) = self.scope.locals.iter().rev().find(|local| local.name == name) {
            return local.value.clone();
        }
        let axis = match name {
            "x" => Some(Axis::X),
            "y" => Some(Axis::Y),
            "z" => Some(Axis::Z),
            TIME if !self.without_time.contains(&self.scope.source) => Some(Axis::T),
            TIME if self.in_scene && self.scope.calls.is_empty() => return self.time_is_taken(span),
            "pi" => return Value::Number(self.constant(std::f64::consts::PI)),
            _ => None,
        };
        if let Some(axis) = axis {
            // no place: a coordinate is shared by all that is written
            return Value::Number(self.module.graph.coordinate(axis));
        }
        match self.names.get(self.scope.source, name).map(|global| global.kind.clone()) {
            Some(Kind::Value(value) | Kind::Solid(value)) => value,
            Some(Kind::Import(_)) => self.file_as_value(name, span),
            Some(Kind::Scene) => {
                let message = format!("`{name}` is a scene, not a value");
                self.fail(Diagnostic::error(Code::WRONG_TYPE, span, message))
            }
            Some(Kind::Function(_)) => {
                let message = format!("`{name}` is a function");
                self.fail(
                    Diagnostic::error(Code::NOT_A_FUNCTION, span, message)
                        .at("used without arguments")
                        .help(format!("write `{name}(…)`")),
                )
            }
            None if builtins::exists(name) => {
                let message = format!("`{name}` is a function");
                self.fail(
                    Diagnostic::error(Code::NOT_A_FUNCTION, span, message).help(format!("write `{name}(…)`")),
                )
            }
            None => self.unknown_name(name, span),
        }
    }

    /// The message for a name that nothing has, with what may be meant.
    fn unknown_name(&mut self, name: &str, span: Span) -> Value {
        let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, span, format!("unknown name `{name}`"));
        if self.diagnostics.len() > MOST_SUGGESTIONS {
            return self.fail(diagnostic);
        }
        let later = self.names.defined_later(self.scope.source, name);
        if let Some(qualified) =
            self.names.in_an_import(self.scope.source, name, false).filter(|_| later.is_none())
        {
            let diagnostic = diagnostic.at("not defined in this file");
            return self
                .fail(diagnostic.help(format!("write `{qualified}`")).edit(span, name, qualified, false));
        }
        if let Some(path) = self.path_without_quotes(name, span) {
            return self.fail(diagnostic.at("a path stands in quotes").help(format!("write `\"{path}\"`")));
        }
        let diagnostic = match (later, foreign::value(name, self.in_scene)) {
            // `solid part = mesh(part)`
            (Some(later), _) if later.start < span.start && self.is_path_of_a_mesh(span) => diagnostic
                .at("not defined yet")
                .label(later, "defined here")
                .help(format!("the path of a file stands in quotes: write `mesh(\"{name}.stl\")`")),
            (Some(later), _) if later.start < span.start => diagnostic
                .at("not defined yet")
                .label(later, "defined here")
                .help("nothing can be made of itself: give one of both another name"),
            (Some(later), _) => diagnostic
                .at("not defined above")
                .label(later, "defined here")
                .help("a name means what was defined above it: move this line down, or that one up"),
            (None, Some(_)) if self.against_place && matches!(name, "r" | "R") => {
                let set = self.set_by.shown(name, "2");
                diagnostic.at("not defined above").help(format!(
                    "define it above: write `let {name} = 1`, or `param {name} = 1` for what `{set}` may set"
                ))
            }
            (None, None) if name.len() > 1 && parse_unit(name).is_some() => {
                diagnostic.at("a unit stands behind a number").help(format!("write `1 {name}`"))
            }
            (None, Some(help)) => diagnostic.at("not defined above").help(help),
            (None, None) => {
                let candidates = self.names.candidates(self.scope.source, false);
                let locals: Vec<String> = self.scope.locals.iter().map(|l| l.name.clone()).collect();
                let all =
                    candidates.iter().chain(&locals).map(String::as_str).chain(["x", "y", "z", "t", "pi"]);
                diagnostic.at("not defined above").suggest(name, all)
            }
        };
        self.fail(diagnostic)
    }

    /// `bunny.stl`, of which the name is the beginning.
    fn path_without_quotes(&self, name: &str, span: Span) -> Option<String> {
        const ENDINGS: [&str; 7] = ["stl", "obj", "ply", "csv", "png", "txt", "asc"];
        let rest = self.text.get(span.range().end..).filter(|_| span.source == SourceId::File)?;
        let ending: String = rest.strip_prefix('.')?.chars().take_while(|c| c.is_alphanumeric()).collect();
        ENDINGS.contains(&ending.to_lowercase().as_str()).then(|| format!("{name}.{ending}"))
    }

    /// Whether a name stands where a mesh has its path.
    fn is_path_of_a_mesh(&self, span: Span) -> bool {
        let before = self.text.get(..span.range().start).filter(|_| span.source == SourceId::File);
        let call = before.and_then(|text| text.trim_end().strip_suffix('('));
        let head = call.and_then(|text| text.trim_end().strip_suffix("mesh"));
        head.is_some_and(|head| !head.ends_with(|c: char| c.is_alphanumeric() || c == '_'))
    }

    pub fn negate(&mut self, value: &Value, span: Span) -> Value {
        match value {
            Value::Number(a) => Value::Number(self.unary(Unary::Neg, *a, span)),
            Value::Vector(v) => Value::Vector(v.map(|a| self.unary(Unary::Neg, a, span))),
            Value::List(members) => Value::List(members.iter().map(|a| self.negate(a, span)).collect()),
            other => {
                self.as_number(other, span);
                Value::Failed
            }
        }
    }

    pub fn sum(&mut self, op: Binary, a: &Value, b: &Value, span: Span) -> Value {
        match (a, b) {
            (Value::Failed, _) | (_, Value::Failed) => Value::Failed,
            (Value::Vector(a), Value::Vector(b)) => {
                Value::Vector(std::array::from_fn(|i| self.binary(op, a[i], b[i], span)))
            }
            (Value::Number(a), Value::Number(b)) => Value::Number(self.binary(op, *a, *b, span)),
            (Value::List(a), Value::List(b)) if a.len() == b.len() => Value::List(
                std::iter::zip(a.iter(), b.iter()).map(|(a, b)| self.sum(op, a, b, span)).collect(),
            ),
            _ => {
                let span = self.user_span(span);
                let message = format!("cannot add or subtract {} and {}", a.describe(), b.describe());
                let diagnostic = Diagnostic::error(Code::WRONG_TYPE, span, message);
                let moves = matches!((a, b), (Value::Number(shape), Value::Vector(_)) if self.depends_on_place(*shape));
                let help = "a shape is moved by a method, as in `sphere(1).move([1, 0, 0])`";
                self.fail(if moves { diagnostic.help(help) } else { diagnostic })
            }
        }
    }

    pub fn product(&mut self, op: Binary, a: &Value, b: &Value, span: Span) -> Value {
        match (a, b) {
            (Value::Failed, _) | (_, Value::Failed) => Value::Failed,
            (Value::Number(a), Value::Number(b)) => Value::Number(self.binary(op, *a, *b, span)),
            (Value::Vector(v), Value::Number(s)) => Value::Vector(v.map(|c| self.binary(op, c, *s, span))),
            (Value::Number(s), Value::Vector(v)) if op == Binary::Mul => {
                Value::Vector(v.map(|c| self.binary(op, *s, c, span)))
            }
            (Value::List(list), Value::Number(_)) => {
                Value::List(list.iter().map(|member| self.product(op, member, b, span)).collect())
            }
            (Value::Number(_), Value::List(list)) if op == Binary::Mul => {
                Value::List(list.iter().map(|member| self.product(op, a, member, span)).collect())
            }
            _ => {
                let span = self.user_span(span);
                let what = if op == Binary::Mul { "multiply" } else { "divide" };
                let message = format!("cannot {what} {} by {}", a.describe(), b.describe());
                let diagnostic = Diagnostic::error(Code::WRONG_TYPE, span, message);
                let vectors = matches!((a, b), (Value::Vector(_), Value::Vector(_)));
                let help = "`dot(a, b)` is the scalar product of two vectors";
                self.fail(if vectors { diagnostic.help(help) } else { diagnostic })
            }
        }
    }

    /// Whole exponents up to 64 are products (by repeated squaring), ½ is the root, the rest is `pow`.
    fn power(&mut self, base: &Expr, exponent: &Expr, span: Span) -> Value {
        let (Some(a), Some(b)) = (self.field(base), self.field(exponent)) else { return Value::Failed };
        self.warn_of_power_of_shapes(base, exponent);
        let value = self.raise(a, b, span);
        self.warn_of_undefined("pow", Some(&[a, b]), Some(value), span);
        Value::Number(value)
    }

    pub fn raise(&mut self, a: Node, b: Node, span: Span) -> Node {
        let Some(exponent) = self.known_value(b) else {
            return self.binary(BinaryFunction::Pow.into(), a, b, span);
        };
        self.fix(b);
        if exponent == 0.5 {
            return self.unary(Unary::Sqrt, a, span);
        }
        let whole = exponent.abs();
        if whole.fract() != 0.0 || whole > 64.0 {
            return self.binary(BinaryFunction::Pow.into(), a, b, span);
        }
        let power = self.whole_power(a, whole as u32, span);
        if exponent < 0.0 {
            let one = self.constant(1.0);
            return self.binary(Binary::Div, one, power, span);
        }
        power
    }

    fn whole_power(&mut self, a: Node, exponent: u32, span: Span) -> Node {
        match exponent {
            0 => self.constant(1.0),
            1 => a,
            n => {
                let half = self.whole_power(a, n / 2, span);
                let square = self.binary(Binary::Mul, half, half, span);
                if n % 2 == 0 { square } else { self.binary(Binary::Mul, square, a, span) }
            }
        }
    }

    /// `a <= b` is b − a; `a <= e <= b` is (e − a)·(b − e), the slab of the R-function literature.
    fn compare(&mut self, first: &Expr, rest: &[(Comparison, Span, Expr)], span: Span) -> Value {
        for (op, at, _) in rest {
            match op {
                Comparison::Equal | Comparison::NotEqual => {
                    let message = if *op == Comparison::Equal {
                        "`==` would be a surface of zero thickness"
                    } else {
                        "`!=` would leave out a surface of zero thickness"
                    };
                    return self.fail(
                        Diagnostic::error(Code::EQUALITY, *at, message)
                            .help("write a thin layer `-t <= a - b <= t`, or a half-space `a <= b`"),
                    );
                }
                Comparison::Less | Comparison::Greater => {
                    let orders = if *op == Comparison::Less { ("<", "<=") } else { (">", ">=") };
                    let message = format!("`{}` means the same as `{}` here", orders.0, orders.1);
                    self.report(
                        Diagnostic::warning(Code::STRICT_COMPARISON, *at, message)
                            .help(format!("write `{}`", orders.1))
                            .edit(*at, orders.0, orders.1, true),
                    );
                }
                Comparison::LessEqual | Comparison::GreaterEqual => {}
            }
        }
        let upwards = |op: Comparison| matches!(op, Comparison::LessEqual | Comparison::Less);
        let same_way = rest.windows(2).all(|pair| upwards(pair[0].0) == upwards(pair[1].0));
        if rest.len() > 2 || !same_way {
            let message = if same_way {
                format!("a chain of {} comparisons", rest.len())
            } else {
                "comparisons in opposite directions".to_string()
            };
            return self
                .fail(Diagnostic::error(Code::CHAIN, span, message).help("join the comparisons with `and`"));
        }
        let operands: Vec<&Expr> = std::iter::once(first).chain(rest.iter().map(|(_, _, e)| e)).collect();
        self.warn_of_angle_as_length(&operands);
        self.warn_of_length_as_area(&operands);
        self.warn_of_angle_out_of_range(&operands);
        let places: Vec<bool> = operands.iter().map(|operand| names_a_coordinate(operand)).collect();
        let has_place = places.contains(&true);
        let terms: Vec<Option<Node>> = std::iter::zip(operands, places)
            .map(|(operand, place)| {
                let outer = std::mem::replace(&mut self.against_place, has_place && !place);
                let node = self.field(operand);
                self.against_place = outer;
                node
            })
            .collect();
        let Some(mut terms) = terms.into_iter().collect::<Option<Vec<Node>>>() else { return Value::Failed };
        if !upwards(rest[0].0) {
            terms.reverse();
        }
        let difference = self.binary(Binary::Sub, terms[1], terms[0], span);
        let Some(&third) = terms.get(2) else { return Value::Number(difference) };
        let ends = (self.known_value(terms[0]), self.known_value(third));
        if let (Some(low), Some(high)) = ends
            && low > high
        {
            let message = "no place fulfils both comparisons: the ends are exchanged";
            let written = match (self.written(first), self.written(&rest[0].2), self.written(&rest[1].2)) {
                (Some(a), Some(between), Some(b)) => {
                    let sign = if upwards(rest[0].0) { "<=" } else { ">=" };
                    format!("`{b} {sign} {between} {sign} {a}`")
                }
                _ => "`a <= e <= b` with the smaller end as `a`".to_string(),
            };
            self.report(
                Diagnostic::warning(Code::REVERSED_CHAIN, span, message)
                    .at(format!("{low} is greater than {high}"))
                    .help(format!("write {written}; a chain is read as this layer all the same")),
            );
        }
        let other = self.binary(Binary::Sub, third, terms[1], span);
        Value::Number(self.binary(Binary::Mul, difference, other, span))
    }

    fn logic(&mut self, op: Logic, operands: &[Expr], span: Span) -> Value {
        let nodes: Vec<Option<Node>> = operands.iter().map(|operand| self.field(operand)).collect();
        let Some(mut nodes) = nodes.into_iter().collect::<Option<Vec<Node>>>() else { return Value::Failed };
        self.warn_of_twins(op, operands, &nodes);
        self.warn_of_numbers(op, operands, &nodes);
        if op == Logic::Minus {
            for node in &mut nodes[1..] {
                *node = self.unary(Unary::Neg, *node, span);
            }
        }
        Value::Number(self.balanced(op, &nodes, span))
    }

    /// An n-ary operation as a balanced tree, the left half the larger one: a fold would let ω grow as 2ⁿ.
    pub fn balanced(&mut self, op: Logic, nodes: &[Node], span: Span) -> Node {
        self.tree(if op == Logic::Or { Binary::Or } else { Binary::And }, nodes, span)
    }

    /// One operation over some nodes as a balanced tree.
    pub fn tree(&mut self, op: Binary, nodes: &[Node], span: Span) -> Node {
        if let [only] = nodes {
            return *only;
        }
        let (left, right) = nodes.split_at(nodes.len().div_ceil(2));
        let (a, b) = (self.tree(op, left, span), self.tree(op, right, span));
        self.binary(op, a, b, span)
    }
}
