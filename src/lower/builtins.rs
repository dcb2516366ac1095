//! Functions that are operations of the graph rather than text of the prelude.

use super::dimensions::{Measure, is_foreign_quantity};
use super::lowering::Lowering;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::{self, Binary, BinaryFunction, Node, Unary};
use crate::random;
use crate::syntax::ast::{Argument, Expr, ExprKind, Name};

/// A function of the language.
#[derive(Clone, Copy)]
struct Builtin {
    name: &'static str,
    /// Least and greatest number of arguments.
    arity: (usize, usize),
    meaning: Meaning,
}

/// What a call makes of its arguments. Functions are given as many as the builtin takes.
#[derive(Clone, Copy)]
enum Meaning {
    /// One operation on one number.
    Unary(Unary),
    /// Numbers become a number.
    Number(fn(&mut Lowering<'_>, &[Node], Span) -> Node),
    /// Vectors become a number.
    NumberOfVectors(fn(&mut Lowering<'_>, &[[Node; 3]], Span) -> Node),
    /// Vectors become a vector.
    Vector(fn(&mut Lowering<'_>, &[[Node; 3]], Span) -> [Node; 3]),
    /// Values of any kind become a value.
    Value(fn(&mut Lowering<'_>, &[Value], &[Argument], Span) -> Value),
    /// The arguments are looked at before they are evaluated.
    Unevaluated(fn(&mut Lowering<'_>, &[Argument], Span) -> Value),
}

/// The builtins that are more than one operation on one number.
const COMPOSED: [Builtin; 31] = {
    use Meaning::{Number, NumberOfVectors, Unevaluated, Value, Vector};
    const MANY: usize = usize::MAX;
    const fn builtin(name: &'static str, arity: (usize, usize), meaning: Meaning) -> Builtin {
        Builtin { name, arity, meaning }
    }
    [
        builtin(
            "atan2",
            (2, 2),
            Number(|l, a, span| l.binary(BinaryFunction::Atan2.into(), a[0], a[1], span)),
        ),
        builtin("pow", (2, 2), Number(|l, a, span| l.raise(a[0], a[1], span))),
        builtin("min", (2, MANY), Number(|l, a, span| l.chain(Binary::Min, a, span))),
        builtin("max", (2, MANY), Number(|l, a, span| l.chain(Binary::Max, a, span))),
        builtin("hypot", (2, 3), Number(|l, a, span| l.hypotenuse(a, span))),
        builtin("clamp", (3, 3), Number(|l, a, span| l.clamp([a[0], a[1], a[2]], span))),
        builtin("dot", (2, 2), NumberOfVectors(|l, v, span| l.dot(v[0], v[1], span))),
        builtin("cross", (2, 2), Vector(|l, v, span| l.cross(v[0], v[1], span))),
        builtin("length", (1, 1), NumberOfVectors(|l, v, span| l.length(v[0], span))),
        builtin("ceil", (1, 1), Number(|l, a, span| l.ceiling(a[0], span))),
        builtin("fract", (1, 1), Number(|l, a, span| l.fraction(a[0], span))),
        builtin("mod", (2, 2), Number(|l, a, span| l.remainder(a[0], a[1], span))),
        builtin(
            "step",
            (2, 2),
            Number(|l, a, span| {
                let above = l.binary(Binary::Sub, a[1], a[0], span);
                l.step(above, span)
            }),
        ),
        builtin(
            "where",
            (3, 3),
            Unevaluated(|l, a, span| l.choose(&a[0].value, [&a[1].value, &a[2].value], span)),
        ),
        builtin("random", (2, 2), Value(|l, values, arguments, _| l.random(values, arguments))),
        builtin("count", (1, 1), Value(|l, values, arguments, _| l.count(&values[0], &arguments[0].value))),
        builtin(
            "polygon",
            (1, 1),
            Value(|l, values, arguments, _| l.polygon(&values[0], &arguments[0].value)),
        ),
        builtin("mesh", (1, 2), Value(|l, values, arguments, _| l.mesh(values, arguments))),
        builtin("height_map", (3, 4), Value(|l, values, arguments, _| l.height_map(values, arguments))),
        builtin("points", (1, 1), Value(|l, values, arguments, _| l.points(values, arguments))),
        builtin("arc", (3, 5), Value(|l, values, arguments, span| l.arc(values, arguments, span))),
        builtin("spline", (1, 2), Value(|l, values, arguments, span| l.spline(values, arguments, span))),
        builtin("helix", (3, 4), Value(|l, values, arguments, span| l.helix(values, arguments, span))),
        builtin("rounded", (2, 3), Value(|l, values, arguments, span| l.rounded(values, arguments, span))),
        builtin("sweep", (2, 2), Value(|l, values, arguments, span| l.sweep(values, arguments, span))),
        builtin("text", (2, 2), Value(|l, values, arguments, span| l.text(values, arguments, span))),
        builtin("around", (2, 2), Number(|l, a, span| l.around(a[0], a[1], span))),
        builtin("overlapping", (4, 4), Number(|l, a, span| l.overlapping([a[0], a[1]], [a[2], a[3]], span))),
        builtin("slope", (1, 1), Number(|l, a, span| l.slope(a[0], span))),
        builtin("normalise", (1, 1), Number(|l, a, span| l.normalise(a[0], span))),
        builtin("normalize", (1, 1), Number(|l, a, span| l.normalise(a[0], span))),
    ]
};

const POSITIVE: Builtin = Builtin {
    name: "positive",
    arity: (1, 3),
    meaning: Meaning::Unevaluated(|l, arguments, span| l.positive(arguments, span)),
};

/// What a positive number is, where a message needs more than its words: the third argument of `positive`.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sort {
    /// A length, or what is like one.
    Plain,
    /// A number of copies.
    Count,
    /// The distance of two bounds that were written.
    Between([&'static str; 2]),
    /// The distance of two corners along an axis.
    OfBox,
    /// The thickness of a wall.
    OfWall,
}

impl Sort {
    /// The sort that the standard solids name.
    fn named(expr: &Expr) -> Option<Self> {
        let ExprKind::Name(name) = &expr.kind else { return None };
        [
            ("count", Self::Count),
            ("layer", Self::Between(["low", "high"])),
            ("loft", Self::Between(["z0", "z1"])),
            ("box", Self::OfBox),
            ("shell", Self::OfWall),
        ]
        .into_iter()
        .find_map(|(known, sort)| (known == name).then_some(sort))
    }
}

/// Where operations stand in lists of builtins.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    First,
    Functions,
    Steps,
}

/// Where an operation stands among the builtins; `None` if the language has a sign for it.
fn place_in_lists(op: Unary) -> Option<Place> {
    match op {
        Unary::Neg => None,
        Unary::Sqrt | Unary::Abs => Some(Place::First),
        Unary::Call(_) => Some(Place::Functions),
        Unary::Sign | Unary::Floor | Unary::Round => Some(Place::Steps),
    }
}

/// All builtins.
fn all() -> impl Iterator<Item = Builtin> {
    let operation = |op: Unary| Builtin { name: op.name(), arity: (1, 1), meaning: Meaning::Unary(op) };
    let with_place =
        move |place| Unary::all().filter(move |&op| place_in_lists(op) == Some(place)).map(operation);
    with_place(Place::First)
        .chain(with_place(Place::Functions))
        .chain(with_place(Place::Steps))
        .chain(COMPOSED.iter().copied())
        .chain([POSITIVE])
}

pub(super) fn exists(name: &str) -> bool {
    all().any(|builtin| builtin.name == name)
}

pub(super) fn names() -> impl Iterator<Item = &'static str> {
    all().map(|builtin| builtin.name)
}

impl Lowering<'_> {
    /// A call of a builtin; [`Value::Failed`] if there is none of this name, which the caller has looked for.
    pub fn call_builtin(&mut self, name: &Name, arguments: &[Argument], span: Span) -> Value {
        let Some(builtin) = all().find(|builtin| builtin.name == name.text) else { return Value::Failed };
        if let Some(diagnostic) = self.arguments_do_not_fit(builtin, arguments, span) {
            return self.fail(diagnostic);
        }
        let number = |node: Option<Node>| node.map_or(Value::Failed, Value::Number);
        match builtin.meaning {
            Meaning::Unevaluated(build) => build(self, arguments, span),
            Meaning::Value(build) => {
                if builtin.name == "arc" && !self.arc_measures(arguments) {
                    return Value::Failed;
                }
                self.values(arguments).map_or(Value::Failed, |values| build(self, &values, arguments, span))
            }
            Meaning::Unary(op) => {
                let operand = self.numbers(arguments);
                if let (Some(a), "sin" | "cos" | "tan") = (&operand, builtin.name)
                    && let Some(angle) = self.known_value(a[0])
                {
                    self.warn_of_degrees(angle, &arguments[0].value);
                }
                let value = operand.as_ref().map(|a| self.unary(op, a[0], span));
                self.warn_of_undefined(builtin.name, operand.as_deref(), value, span);
                number(value)
            }
            Meaning::Number(build) => {
                let operands = self.numbers(arguments);
                let value = operands.as_ref().map(|a| build(self, a, span));
                self.warn_of_undefined(builtin.name, operands.as_deref(), value, span);
                number(value)
            }
            Meaning::NumberOfVectors(build) => number(self.vectors(arguments).map(|v| build(self, &v, span))),
            Meaning::Vector(build) => {
                self.vectors(arguments).map_or(Value::Failed, |v| Value::Vector(build(self, &v, span)))
            }
        }
    }

    /// Whether quantities of an arc may measure what they stand for, as far as their units tell. If not, this is reported.
    fn arc_measures(&mut self, arguments: &[Argument]) -> bool {
        let is_point = |argument: &Argument| matches!(argument.value.kind, ExprKind::Vector(_));
        // an arc through three points has a tolerance in the place of an angle
        let angles = if arguments[1..].iter().take(2).any(is_point) { 0..0 } else { 2..4 };
        let foreign = arguments.iter().enumerate().filter(|(_, a)| is_foreign_quantity(&a.value));
        foreign.into_iter().all(|(i, argument)| match angles.contains(&i) {
            true => self.may_be_angle(&argument.value),
            false => self.measures(&argument.value, Measure::Length),
        })
    }

    /// What is wrong with the number of arguments, or with names given to them.
    fn arguments_do_not_fit(
        &self,
        Builtin { name, arity: (fewest, most), .. }: Builtin,
        arguments: &[Argument],
        span: Span,
    ) -> Option<Diagnostic> {
        if let Some(named) = arguments.iter().find_map(|a| a.name.as_ref()) {
            let message = format!("`{name}` takes its arguments by position");
            let diagnostic = Diagnostic::error(Code::ARGUMENTS, named.span, message);
            let written: Option<Vec<&str>> = arguments.iter().map(|a| self.written(&a.value)).collect();
            let call = match example(name) {
                Some(call) => call.to_string(),
                None => format!("{name}({})", written.unwrap_or_else(|| vec!["…"]).join(", ")),
            };
            return Some(diagnostic.help(format!("write for example `{call}`")));
        }
        if (fewest..=most).contains(&arguments.len()) {
            return None;
        }
        let expected = match (fewest, most) {
            (a, b) if a == b => format!("{a}"),
            (a, usize::MAX) => format!("{a} or more"),
            (a, b) => format!("{a} to {b}"),
        };
        let plural = if expected == "1" { "" } else { "s" };
        let message = format!("`{name}` takes {expected} argument{plural}, found {}", arguments.len());
        let diagnostic = Diagnostic::error(Code::ARGUMENTS, self.user_span(span), message);
        Some(match (name, example(name)) {
            ("atan", _) if arguments.len() == 2 => {
                let written: Option<Vec<&str>> = arguments.iter().map(|a| self.written(&a.value)).collect();
                let written = written.map_or("y, x".to_string(), |both| both.join(", "));
                diagnostic.help(format!("the angle of two sides is `atan2` here: write `atan2({written})`"))
            }
            ("round", _) => diagnostic.help("edges are rounded by a method of shapes: `box().round(0.1)`"),
            (_, Some(call)) => diagnostic.help(format!("write for example `{call}`")),
            (_, None) => diagnostic,
        })
    }

    /// The values of all arguments; `None` if one of them failed.
    fn values(&mut self, arguments: &[Argument]) -> Option<Vec<Value>> {
        let values: Vec<Value> = arguments.iter().map(|a| self.expr(&a.value)).collect();
        if values.contains(&Value::Failed) { None } else { Some(values) }
    }

    /// The arguments as numbers; the first that is none is reported.
    fn numbers(&mut self, arguments: &[Argument]) -> Option<Vec<Node>> {
        let values = self.values(arguments)?;
        values.iter().zip(arguments).map(|(value, a)| self.as_number(value, a.value.span)).collect()
    }

    /// The arguments as vectors; each that is none is reported.
    fn vectors(&mut self, arguments: &[Argument]) -> Option<Vec<[Node; 3]>> {
        let values = self.values(arguments)?;
        let vectors: Vec<Option<[Node; 3]>> =
            values.iter().zip(arguments).map(|(value, a)| self.as_vector(value, a.value.span)).collect();
        vectors.into_iter().collect()
    }

    /// √(a² + b² + …)
    fn hypotenuse(&mut self, a: &[Node], span: Span) -> Node {
        let squares: Vec<Node> = a.iter().map(|&a| self.binary(Binary::Mul, a, a, span)).collect();
        let sum = self.chain(Binary::Add, &squares, span);
        self.unary(Unary::Sqrt, sum, span)
    }

    /// max(low, min(value, high))
    fn clamp(&mut self, [value, low, high]: [Node; 3], span: Span) -> Node {
        let upper = self.binary(Binary::Min, value, high, span);
        self.binary(Binary::Max, low, upper, span)
    }

    fn length(&mut self, v: [Node; 3], span: Span) -> Node {
        let square = self.dot(v, v, span);
        self.unary(Unary::Sqrt, square, span)
    }

    pub fn chain(&mut self, op: Binary, operands: &[Node], span: Span) -> Node {
        let (first, rest) = (operands[0], &operands[1..]);
        rest.iter().fold(first, |so_far, &next| self.binary(op, so_far, next, span))
    }

    fn dot(&mut self, a: [Node; 3], b: [Node; 3], span: Span) -> Node {
        let products: [Node; 3] = std::array::from_fn(|i| self.binary(Binary::Mul, a[i], b[i], span));
        self.chain(Binary::Add, &products, span)
    }

    fn cross(&mut self, a: [Node; 3], b: [Node; 3], span: Span) -> [Node; 3] {
        std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let (left, right) =
                (self.binary(Binary::Mul, a[j], b[k], span), self.binary(Binary::Mul, a[k], b[j], span));
            self.binary(Binary::Sub, left, right, span)
        })
    }

    /// ω/√(ω² + |∇ω|²): gradient of length 1 on the surface, no division by zero unless ω and ∇ω vanish
    /// together (Rvachev's normalisation of first order).
    fn normalise(&mut self, omega: Node, span: Span) -> Node {
        let gradient = ir::gradient(&mut self.module.graph, omega);
        let square = self.binary(Binary::Mul, omega, omega, span);
        let slope = self.dot(gradient, gradient, span);
        let sum = self.binary(Binary::Add, square, slope, span);
        let root = self.unary(Unary::Sqrt, sum, span);
        self.binary(Binary::DivOrZero, omega, root, span)
    }

    /// −⌊−a⌋
    fn ceiling(&mut self, a: Node, span: Span) -> Node {
        let negative = self.unary(Unary::Neg, a, span);
        let floor = self.unary(Unary::Floor, negative, span);
        self.unary(Unary::Neg, floor, span)
    }

    /// a − ⌊a⌋
    fn fraction(&mut self, a: Node, span: Span) -> Node {
        let floor = self.unary(Unary::Floor, a, span);
        self.binary(Binary::Sub, a, floor, span)
    }

    /// a − b·⌊a/b⌋, which has the sign of b.
    fn remainder(&mut self, a: Node, b: Node, span: Span) -> Node {
        let quotient = self.binary(Binary::Div, a, b, span);
        let whole = self.unary(Unary::Floor, quotient, span);
        let multiple = self.binary(Binary::Mul, b, whole, span);
        self.binary(Binary::Sub, a, multiple, span)
    }

    /// |∇ω|
    fn slope(&mut self, omega: Node, span: Span) -> Node {
        let gradient = ir::gradient(&mut self.module.graph, omega);
        self.length(gradient, span)
    }

    /// A number from 0 to 1, without 1, that looks like chance but is the same in every run.
    fn random(&mut self, values: &[Value], arguments: &[Argument]) -> Value {
        let mut state = 0_u64;
        for (value, argument) in values.iter().zip(arguments) {
            let span = argument.value.span;
            let Some(node) = self.as_number(value, span) else { return Value::Failed };
            let Some(number) = self.as_constant(node, span, "an argument of `random`") else {
                return Value::Failed;
            };
            state = random::scrambled(state ^ (number + 0.0).to_bits());
        }
        Value::Number(self.constant(random::from_bits(state)))
    }

    /// How many members a list has.
    fn count(&mut self, value: &Value, written: &Expr) -> Value {
        match value.members() {
            Some(members) => Value::Number(self.constant(members.len() as f64)),
            None => {
                let message = format!("expected a list `[a, b, …]`, found {}", value.describe());
                self.fail(Diagnostic::error(Code::WRONG_TYPE, self.user_span(written.span), message))
            }
        }
    }

    /// The value itself, which comes first. If it is known now and not positive, an error is reported at the argument that
    /// it came from, with the words that come second.
    fn positive(&mut self, arguments: &[Argument], span: Span) -> Value {
        let value = &arguments[0].value;
        let result = self.expr(value);
        let Value::Number(node) = result else { return result };
        let Some(number) = self.known_value(node) else { return result };
        let sort = arguments.get(2).and_then(|sort| Sort::named(&sort.value)).unwrap_or(Sort::Plain);
        let is_broken = sort == Sort::Count && number.fract() != 0.0;
        if number > 0.0 && number.is_finite() && !is_broken {
            return result;
        }
        let origin = match &value.kind {
            ExprKind::Name(name) => self.scope.locals.iter().rev().find(|l| l.name == *name).map(|l| l.span),
            _ => None,
        };
        let at = self.user_span(origin.unwrap_or(span));
        let wanted = if is_broken { "a whole number" } else { "positive" };
        // what the user wrote may be made of a layer
        let call = self.scope.calls.iter().find(|call| !call.source.is_users()).map(|call| &*call.function);
        let (what, sort) = match (arguments.get(1).map(|what| &what.value.kind), sort, call) {
            (_, Sort::Between(_), Some("extrude")) => {
                ("the height of what is extruded", Sort::Between(["z0", "z1"]))
            }
            (Some(ExprKind::Text(text)), sort, _) => (text.as_str(), sort),
            (_, sort, _) => ("the value", sort),
        };
        let message = format!("{what} must be {wanted}, found {number}");
        let diagnostic = Diagnostic::error(Code::OUT_OF_RANGE, at, message);
        match self.help_for(sort, number, at) {
            Some(help) => self.fail(diagnostic.help(help)),
            None => self.fail(diagnostic),
        }
    }

    /// What helps with a number that is to be positive and is not.
    fn help_for(&self, sort: Sort, number: f64, at: Span) -> Option<String> {
        let is_negative = number < 0.0 && number.is_finite();
        match sort {
            Sort::Plain | Sort::Count => None,
            Sort::Between([low, high]) => Some(match number < 0.0 {
                true => format!("`{low}` is above `{high}`: exchange them"),
                false => format!("`{low}` is to be less than `{high}`"),
            }),
            Sort::OfBox => is_negative.then(|| {
                "the first corner of a box has the smaller coordinates: `box(min, max)`".to_string()
            }),
            Sort::OfWall => is_negative.then(|| self.help_for_wall(number, at)),
        }
    }

    /// What helps with a wall of negative thickness. A formula has more signs than its first.
    fn help_for_wall(&self, number: f64, at: Span) -> String {
        let is_one = |text: &&str| {
            let (number, unit) = text.split_once(' ').unwrap_or((text, ""));
            number.starts_with(|c: char| c.is_ascii_digit() || c == '.')
                && number.parse::<f64>().is_ok()
                && unit.trim().chars().all(char::is_alphabetic)
        };
        let written = self.written_at(at).and_then(|text| text.strip_prefix('-')).map(str::trim);
        let width = written.filter(is_one).map_or_else(
            || {
                let rounded = format!("{:.9e}", -number).parse().unwrap_or(-number);
                rounded.to_string()
            },
            str::to_string,
        );
        format!(
            "a wall lies inside of the surface: write `.shell({width})`; for one outside of it, write \
             `.offset({width}).shell({width})`"
        )
    }
}

/// A call of a builtin whose arguments are not plain from its name.
fn example(name: &str) -> Option<&'static str> {
    Some(match name {
        "arc" => "arc([0, 0], 1, 0°, 90°)",
        "spline" => "spline([[0, 0], [1, 0.4], [2, 0]])",
        "helix" => "helix(1, 0.5, 3)",
        "rounded" => "rounded([[0, 0], [2, 0], [2, 1]], 0.2)",
        "sweep" => "sweep([[0, 0, 0], [1, 0, 0], [1, 1, 0]], 0.1)",
        "text" => "text(\"R\", 1)",
        "polygon" => "polygon([[0, 0], [2, 0], [1, 1]])",
        "mesh" => "mesh(\"part.stl\", 1 mm)",
        "height_map" => "height_map(\"ground.csv\", [0, 0], [4, 3])",
        "where" => "where(x <= 0, 1, 2)",
        "clamp" => "clamp(z, 0, 1)",
        "random" => "random(1, i)",
        _ => return None,
    })
}
