//! Methods of shapes: the shape is evaluated in moved, turned or scaled coordinates.
//!
//! A shape S moved by a transformation T has ω(T⁻¹ p): its coordinates are replaced by those of the point
//! before the transformation. Displacements and angles may depend on time: the shape then moves.

use super::dimensions::{Measure, is_foreign_quantity};
use super::lowering::Lowering;
use super::names::Kind;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::{Axis, Binary, Node, Unary, UnaryFunction};
use crate::syntax::ast::{Argument, Expr, Name};

/// What a method does to a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Transform {
    Move,
    /// A turn about a coordinate axis.
    RotateAbout(Axis3),
    Rotate,
    Scale,
    Mirror,
    /// Other coordinates in place of x, y and z.
    At,
    /// A turn about z by an angle that differs from point to point.
    Turned,
    /// Copies on a lattice.
    Repeat,
    /// Arcs in place of edges.
    Round,
    /// Faces moved outwards.
    Offset,
    /// Distances in place of the fields of its parts.
    Distance,
}

/// A coordinate axis, by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Axis3 {
    X = 0,
    Y = 1,
    Z = 2,
}

const METHODS: [(&str, Transform); 13] = [
    ("move", Transform::Move),
    ("rotate_x", Transform::RotateAbout(Axis3::X)),
    ("rotate_y", Transform::RotateAbout(Axis3::Y)),
    ("rotate_z", Transform::RotateAbout(Axis3::Z)),
    ("rotate", Transform::Rotate),
    ("scale", Transform::Scale),
    ("mirror", Transform::Mirror),
    ("at", Transform::At),
    ("turned", Transform::Turned),
    ("repeat", Transform::Repeat),
    ("round", Transform::Round),
    ("offset", Transform::Offset),
    ("distance", Transform::Distance),
];

/// What a parameter of a transformation takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ParameterKind {
    Vector,
    /// One angle for the whole shape.
    Angle,
    /// An angle that may differ from point to point.
    LocalAngle,
    /// A length; anything else has a message of its own.
    Length,
    /// A number or a vector; anything else has a message of its own.
    Factor,
}

impl ParameterKind {
    /// What a parameter of this kind and name measures.
    fn measure(self, parameter: &str) -> Measure {
        match (self, parameter) {
            (Self::Length, _) | (Self::Vector, "by" | "about" | "point" | "step") => Measure::Length,
            (Self::Vector, "counts") => Measure::Count,
            (Self::Angle | Self::LocalAngle, _) => Measure::Angle,
            (Self::Factor, _) => Measure::Factor,
            (Self::Vector, _) => Measure::Any,
        }
    }
}

impl Transform {
    /// The names of its parameters, in order, and what they take.
    fn parameters(self) -> &'static [(&'static str, ParameterKind)] {
        use ParameterKind::{Angle, Factor, Length, LocalAngle, Vector};
        match self {
            Self::Move => &[("by", Vector)],
            Self::RotateAbout(_) => &[("angle", Angle)],
            Self::Rotate => &[("axis", Vector), ("angle", Angle), ("about", Vector)],
            Self::Scale => &[("factor", Factor)],
            Self::Mirror => &[("normal", Vector), ("point", Vector)],
            Self::At => &[("place", Vector)],
            Self::Turned => &[("angle", LocalAngle)],
            Self::Repeat => &[("step", Vector), ("counts", Vector)],
            Self::Round => &[("radius", Length), ("inner", Length)],
            Self::Offset => &[("d", Length)],
            Self::Distance => &[],
        }
    }

    /// How many of them must be given.
    fn needed(self) -> usize {
        match self {
            Self::Rotate | Self::Repeat => 2,
            Self::Move
            | Self::RotateAbout(_)
            | Self::Scale
            | Self::Mirror
            | Self::At
            | Self::Turned
            | Self::Round
            | Self::Offset => 1,
            Self::Distance => 0,
        }
    }
}

/// The methods of shapes, each with the names of its parameters.
pub(super) fn methods() -> impl Iterator<Item = (&'static str, Vec<&'static str>)> {
    METHODS.into_iter().map(|(name, transform)| {
        (name, transform.parameters().iter().map(|(parameter, _)| *parameter).collect())
    })
}

/// A factor of a coordinate: a number, or a node that depends on time alone.
#[derive(Clone, Copy)]
enum Factor {
    Number(f64),
    Moving(Node),
}

/// Sine and cosine of an angle: of a fixed one, or of one that depends on time.
#[derive(Clone, Copy)]
enum Turn {
    Fixed { sin: f64, cos: f64 },
    Moving { sin: Node, cos: Node },
}

impl Turn {
    fn factors(self) -> [Factor; 2] {
        match self {
            Self::Fixed { sin, cos } => [sin, cos].map(Factor::Number),
            Self::Moving { sin, cos } => [sin, cos].map(Factor::Moving),
        }
    }
}

/// Whether the arguments are vectors and numbers where the method takes these. A value that failed fits.
fn kinds_fit(parameters: &[(&str, ParameterKind)], values: &[(Value, Span)]) -> bool {
    parameters.iter().zip(values).all(|((_, kind), (value, _))| match (kind, value) {
        (_, Value::Failed) => true,
        // a list of another length has a message of its own
        (ParameterKind::Vector, value) => matches!(value, Value::Vector(_) | Value::List(_)),
        (ParameterKind::Angle | ParameterKind::LocalAngle, value) => matches!(value, Value::Number(_)),
        (ParameterKind::Length | ParameterKind::Factor, _) => true,
    })
}

impl<'a> Lowering<'a> {
    pub fn method(&mut self, receiver: &Expr, method: &Name, arguments: &[Argument], span: Span) -> Value {
        if let Some(file) = self.import_of(receiver) {
            return self.call_imported(file, method, arguments, span);
        }
        if self.has_failed(receiver) {
            return Value::Failed;
        }
        if let Some(foreign) = self.function_of_a_module(receiver, method, arguments) {
            return self.fail(foreign);
        }
        let shape = self.field(receiver);
        let known = METHODS.into_iter().find(|(name, _)| *name == method.text);
        // a function of the file goes before the method of this name
        if let Some((function, source)) = self.function_of_shapes(&method.text)
            && (known.is_none() || source.is_users())
        {
            return self.call_method(function, source, receiver, arguments, span);
        }
        let Some((_, transform)) = known else {
            if let Some(foreign) = self.foreign_method(receiver, method, arguments) {
                return self.fail(foreign);
            }
            let own = self.names.functions_of_shapes(self.scope.source);
            let names: Vec<&str> =
                METHODS.iter().map(|(name, _)| *name).chain(own.iter().map(String::as_str)).collect();
            let message = format!("shapes have no method `{}`", method.text);
            let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, method.span, message);
            if let Some(call) = self.as_function(receiver, method, arguments) {
                return self.fail(diagnostic.at("a function").help(format!("write `{call}`")));
            }
            let diagnostic = diagnostic
                .help(format!("they have {}", names.join(", ")))
                .suggest(&method.text, names.iter().copied());
            return self.fail(diagnostic);
        };
        let parameters = transform.parameters();
        let mut values: Vec<Option<(Value, Span)>> = vec![None; parameters.len()];
        for (position, argument) in arguments.iter().enumerate() {
            let slot = match &argument.name {
                None => (position < parameters.len()).then_some(position),
                Some(name) => parameters.iter().position(|(parameter, _)| *parameter == name.text),
            };
            let Some(slot) = slot else {
                return self.fail(self.wrong_arguments(method, parameters, arguments, span));
            };
            let (parameter, kind) = parameters[slot];
            let measure = kind.measure(parameter);
            if is_foreign_quantity(&argument.value) {
                let may_stand_here = match kind {
                    ParameterKind::Angle => self.may_be_angle(&argument.value),
                    ParameterKind::Vector
                    | ParameterKind::LocalAngle
                    | ParameterKind::Length
                    | ParameterKind::Factor => self.measures(&argument.value, measure),
                };
                if !may_stand_here {
                    return Value::Failed;
                }
            }
            let value = self.expr(&argument.value);
            if kind != ParameterKind::Angle
                && value != Value::Failed
                && !self.measures(&argument.value, measure)
            {
                return Value::Failed;
            }
            if kind == ParameterKind::Angle {
                if !self.may_be_angle(&argument.value) {
                    return Value::Failed;
                }
                if let Value::Number(node) = &value {
                    match self.known_value(*node) {
                        Some(angle) => self.warn_of_large_angle(angle, &argument.value),
                        None => self.warn_of_fast_turn(&argument.value),
                    }
                }
            }
            values[slot] = Some((value, argument.value.span));
        }
        let given = values.iter().take_while(|value| value.is_some()).count();
        let values: Vec<(Value, Span)> = values.into_iter().flatten().collect();
        let gap = given < values.len();
        if gap || given < transform.needed() || !kinds_fit(parameters, &values) {
            return self.fail(self.wrong_arguments(
                method,
                &parameters[..transform.needed()],
                arguments,
                span,
            ));
        }
        let Some(shape) = shape else { return Value::Failed };
        self.transformed(shape, transform, &values, span).map_or(Value::Failed, Value::Number)
    }

    /// The call of a function of this file, or of one that it imports, which is written as a method although its first
    /// parameter is not called `shape`.
    fn as_function(&self, receiver: &Expr, method: &Name, arguments: &[Argument]) -> Option<String> {
        let name = &method.text;
        let own = self.names.of(self.scope.source, name).map(|global| &global.kind);
        let called = match own {
            Some(Kind::Function(_)) => name.clone(),
            Some(Kind::Value(_) | Kind::Solid(_) | Kind::Scene | Kind::Import(_)) | None => {
                self.names.in_an_import(self.scope.source, name, true)?
            }
        };
        let given = |argument: &Argument| {
            let value = self.written(&argument.value)?;
            Some(match &argument.name {
                Some(parameter) => format!("{} = {value}", parameter.text),
                None => value.to_string(),
            })
        };
        let arguments = arguments.iter().map(given);
        let all: Option<Vec<String>> =
            std::iter::once(self.written(receiver).map(String::from)).chain(arguments).collect();
        Some(format!("{called}({})", all.map_or("…".into(), |all| all.join(", "))))
    }

    fn wrong_arguments(
        &self,
        method: &Name,
        parameters: &[(&str, ParameterKind)],
        arguments: &[Argument],
        span: Span,
    ) -> Diagnostic {
        let names: Vec<&str> = parameters.iter().map(|(name, _)| *name).collect();
        let message = format!("the arguments of `.{}` are ({})", method.text, names.join(", "));
        let by_axes = self.vector_by_axes(&method.text, arguments);
        let arguments: Vec<&Expr> = arguments.iter().map(|argument| &argument.value).collect();
        let call = by_axes.unwrap_or_else(|| self.call_that_works(&method.text, &arguments));
        let help = format!("write `{call}`");
        Diagnostic::error(Code::ARGUMENTS, self.user_span(span), message).help(help)
    }

    fn transformed(
        &mut self,
        shape: Node,
        transform: Transform,
        values: &[(Value, Span)],
        span: Span,
    ) -> Option<Node> {
        let p = Axis::SPACE.map(|axis| self.module.graph.coordinate(axis));
        if transform == Transform::Distance {
            return self.distance_of_shape(shape, span);
        }
        let (first, at) = values.first()?;
        match transform {
            Transform::Move => {
                let by = self.as_vector(first, *at)?;
                let q = std::array::from_fn(|i| self.binary(Binary::Sub, p[i], by[i], span));
                Some(self.module.graph.substitute(shape, q))
            }
            Transform::RotateAbout(axis) => {
                let turn = self.angle(first, *at)?;
                Some(self.turned_about(axis, shape, turn, span))
            }
            Transform::Rotate | Transform::Mirror if values.len() > transform.needed() => {
                let (place, place_at) = &values[transform.needed()];
                let place = self.as_vector(place, *place_at)?;
                self.about(place, shape, transform, &values[..transform.needed()], span)
            }
            Transform::At => {
                let place = self.as_vector(first, *at)?;
                Some(self.module.graph.substitute(shape, place))
            }
            Transform::Turned => {
                let angle = self.as_number(first, *at)?;
                Some(self.turned(shape, angle, span))
            }
            Transform::Repeat => {
                let step = self.constant_vector(first, *at, "the distance of copies")?;
                let counts = self.constant_vector(&values[1].0, values[1].1, "a number of copies")?;
                self.repeated(shape, (step, *at), (counts, values[1].1), span)
            }
            Transform::Round => self.rounded_shape(shape, values, span),
            Transform::Offset => self.offset_shape(shape, &values[0], span),
            Transform::Distance => self.distance_of_shape(shape, span),
            Transform::Rotate => {
                let axis = self.constant_vector(first, *at, "an axis")?;
                let angle = self.angle(&values[1].0, values[1].1)?;
                let axis = self.unit_vector(axis, *at)?;
                let q = self.rotated_back(p, axis, angle, span);
                Some(self.module.graph.substitute(shape, q))
            }
            Transform::Scale => self.scale(shape, p, first, *at, span),
            Transform::Mirror => {
                let normal = self.constant_vector(first, *at, "a normal")?;
                let normal = self.unit_vector(normal, *at)?;
                Some(self.mirrored(shape, normal, span))
            }
        }
    }

    /// A shape that is turned about a coordinate axis.
    fn turned_about(&mut self, axis: Axis3, shape: Node, turn: Turn, span: Span) -> Node {
        let p = Axis::SPACE.map(|axis| self.module.graph.coordinate(axis));
        let [sin, cos] = turn.factors();
        let axis = axis as usize;
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut q = p;
        let back = self.negative(sin, span);
        q[j] = self.combination(&[(cos, p[j]), (sin, p[k])], span);
        q[k] = self.combination(&[(back, p[j]), (cos, p[k])], span);
        self.module.graph.substitute(shape, q)
    }

    /// A shape that is mirrored at the plane through the origin with the unit normal `n`: p − 2(p·n)n.
    fn mirrored(&mut self, shape: Node, n: [f64; 3], span: Span) -> Node {
        let p = Axis::SPACE.map(|axis| self.module.graph.coordinate(axis));
        let q = std::array::from_fn(|i| {
            let row: [(Factor, Node); 3] = std::array::from_fn(|j| {
                (Factor::Number(f64::from(u8::from(i == j)) - 2.0 * n[i] * n[j]), p[j])
            });
            self.combination(&row, span)
        });
        self.module.graph.substitute(shape, q)
    }

    /// The transformation about a place instead of the origin.
    fn about(
        &mut self,
        place: [Node; 3],
        shape: Node,
        transform: Transform,
        values: &[(Value, Span)],
        span: Span,
    ) -> Option<Node> {
        let p = Axis::SPACE.map(|axis| self.module.graph.coordinate(axis));
        let ahead = std::array::from_fn(|i| self.binary(Binary::Add, p[i], place[i], span));
        let at_origin = self.module.graph.substitute(shape, ahead);
        let transformed = self.transformed(at_origin, transform, values, span)?;
        let back = std::array::from_fn(|i| self.binary(Binary::Sub, p[i], place[i], span));
        Some(self.module.graph.substitute(transformed, back))
    }

    /// Scales about the origin. ω is scaled too (by the smallest factor), so that its gradient keeps its
    /// length on the surface.
    fn scale(&mut self, shape: Node, p: [Node; 3], factor: &Value, at: Span, span: Span) -> Option<Node> {
        let factors = match factor {
            Value::Vector(_) => self.constant_vector(factor, at, "a scale factor")?,
            Value::List(factors) => {
                let at = self.user_span(at);
                let message = format!("a shape is scaled by one factor or by three, found {}", factors.len());
                let written = self.written_at(at).and_then(|text| text.strip_suffix(']'));
                let help = match (written, factors.len()) {
                    (Some(two), 2) => format!("write `.scale({two}, 1])`, which keeps its height"),
                    _ => "write `.scale([2, 2, 1])` for factors along x, y and z".to_string(),
                };
                self.report(Diagnostic::error(Code::WRONG_TYPE, at, message).help(help));
                return None;
            }
            other => {
                let node = self.as_number(other, at)?;
                [self.as_constant(node, at, "a scale factor")?; 3]
            }
        };
        if let Some(bad) = factors.iter().find(|f| !(f.is_finite() && **f > 0.0)) {
            let message = format!("a scale factor must be positive, found {bad}");
            let at = self.user_span(at);
            let diagnostic = Diagnostic::error(Code::OUT_OF_RANGE, at, message);
            let mirrored = *bad < 0.0;
            self.report(if mirrored {
                diagnostic.help("`.mirror(normal)` turns a shape over")
            } else {
                diagnostic
            });
            return None;
        }
        let q = std::array::from_fn(|i| {
            let factor = self.constant(factors[i]);
            self.binary(Binary::Div, p[i], factor, span)
        });
        let scaled = self.module.graph.substitute(shape, q);
        let smallest = factors.into_iter().fold(f64::INFINITY, f64::min);
        let smallest = self.constant(smallest);
        Some(self.binary(Binary::Mul, smallest, scaled, span))
    }

    /// Sine and cosine of an angle that may depend on time, but not on the place.
    fn angle(&mut self, value: &Value, at: Span) -> Option<Turn> {
        let angle = self.as_number(value, at)?;
        if (self.known_value(angle).is_some() && !self.is_open(angle)) || self.depends_on_place(angle) {
            let angle = self.as_constant(angle, at, "an angle")?;
            let (sin, cos) = sin_cos(angle);
            return Some(Turn::Fixed { sin, cos });
        }
        let [sin, cos] = [UnaryFunction::Sin, UnaryFunction::Cos].map(|op| self.unary(op.into(), angle, at));
        Some(Turn::Moving { sin, cos })
    }

    fn negative(&mut self, factor: Factor, span: Span) -> Factor {
        match factor {
            Factor::Number(number) => Factor::Number(-number),
            Factor::Moving(node) => Factor::Moving(self.unary(Unary::Neg, node, span)),
        }
    }

    /// The point turned by −angle about a unit axis (Rodrigues' formula, as a matrix).
    fn rotated_back(&mut self, p: [Node; 3], n: [f64; 3], angle: Turn, span: Span) -> [Node; 3] {
        std::array::from_fn(|i| {
            let row: [(Factor, Node); 3] = std::array::from_fn(|j| {
                // the matrix of the vector product with the axis
                let cross = match (3 + j - i) % 3 {
                    0 => 0.0,
                    1 => -n[(i + 2) % 3],
                    _ => n[(i + 1) % 3],
                };
                let (identity, along) = (f64::from(u8::from(i == j)), n[i] * n[j]);
                let factor = match angle {
                    Turn::Fixed { sin, cos } => {
                        Factor::Number(cos * identity + (1.0 - cos) * along - sin * cross)
                    }
                    Turn::Moving { sin, cos } => self.turning((sin, cos), (identity, along, cross), span),
                };
                (factor, p[j])
            });
            self.combination(&row, span)
        })
    }

    /// cos·identity + (1 − cos)·along − sin·cross of a moving angle, written as along + (identity −
    /// along)·cos − cross·sin.
    fn turning(
        &mut self,
        (sin, cos): (Node, Node),
        (identity, along, cross): (f64, f64, f64),
        span: Span,
    ) -> Factor {
        let number = Factor::Number;
        let swinging = self.combination(&[(number(identity - along), cos), (number(-cross), sin)], span);
        if along == 0.0 {
            return Factor::Moving(swinging);
        }
        let along = self.constant(along);
        Factor::Moving(self.binary(Binary::Add, along, swinging, span))
    }

    /// Σ factor · node; terms with factor 0 left out, factors ±1 without a product.
    fn combination(&mut self, terms: &[(Factor, Node)], span: Span) -> Node {
        let mut sum: Option<Node> = None;
        for &(factor, node) in terms {
            let (term, negative) = match factor {
                Factor::Number(0.0) => continue,
                Factor::Number(factor) if factor.abs() == 1.0 => (node, factor < 0.0),
                Factor::Number(factor) => {
                    let magnitude = self.constant(factor.abs());
                    (self.binary(Binary::Mul, magnitude, node, span), factor < 0.0)
                }
                Factor::Moving(factor) => (self.binary(Binary::Mul, factor, node, span), false),
            };
            sum = Some(match sum {
                None if negative => self.unary(Unary::Neg, term, span),
                None => term,
                Some(sum) if negative => self.binary(Binary::Sub, sum, term, span),
                Some(sum) => self.binary(Binary::Add, sum, term, span),
            });
        }
        sum.unwrap_or_else(|| self.constant(0.0))
    }

    pub fn constant_vector(&mut self, value: &Value, at: Span, what: &str) -> Option<[f64; 3]> {
        let nodes = self.as_vector(value, at)?;
        let parts = nodes.map(|node| self.as_constant(node, at, what));
        match parts {
            [Some(a), Some(b), Some(c)] => Some([a, b, c]),
            _ => None,
        }
    }

    fn unit_vector(&mut self, v: [f64; 3], at: Span) -> Option<[f64; 3]> {
        let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        if length > 0.0 && length.is_finite() {
            return Some(v.map(|c| c / length));
        }
        let at = self.user_span(at);
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, at, "a direction must not have length zero"));
        None
    }
}

/// Sine and cosine, exact at whole multiples of a quarter turn.
fn sin_cos(angle: f64) -> (f64, f64) {
    let quarters = angle / std::f64::consts::FRAC_PI_2;
    let nearest = quarters.round();
    if (quarters - nearest).abs() <= 4.0 * f64::EPSILON * nearest.abs().max(1.0) {
        return match nearest.rem_euclid(4.0) as u8 {
            0 => (0.0, 1.0),
            1 => (1.0, 0.0),
            2 => (0.0, -1.0),
            _ => (-1.0, 0.0),
        };
    }
    (libm::sin(angle), libm::cos(angle))
}
