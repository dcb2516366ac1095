//! Calls: arguments are bound to parameters, then the body is evaluated in a scope of its own.

use super::builtins;
use super::dimensions::{Measure, is_foreign_quantity};
use super::foreign;
use super::lowering::{Call, Local, Lowering, Scope};
use super::module::VaryingSize;
use super::names::Kind;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, SourceId, Span};
use crate::syntax::ast::{Argument, Expr, ExprKind, Function, Name};

impl<'a> Lowering<'a> {
    pub fn call(&mut self, name: &Name, arguments: &[Argument], span: Span) -> Value {
        match self.names.get(self.scope.source, &name.text).map(|g| (g.kind.clone(), g.source)) {
            Some((Kind::Function(function), source)) => self.call_function(function, source, arguments, span),
            Some((Kind::Value(value) | Kind::Solid(value), _)) if value == Value::Failed => Value::Failed,
            Some((Kind::Value(_) | Kind::Solid(_) | Kind::Scene | Kind::Import(_), _))
                if !builtins::exists(&name.text) =>
            {
                let message = format!("`{}` is not a function", name.text);
                let diagnostic = Diagnostic::error(Code::NOT_A_FUNCTION, name.span, message).at("a value");
                let own = self.names.defined_at(self.scope.source, &name.text);
                self.fail(match own.filter(|_| self.names.is_standard_function(&name.text)) {
                    Some(own) => diagnostic.label(own, "which this hides").help(format!(
                        "the standard `{}(…)` needs its name: choose another one here",
                        name.text
                    )),
                    None => diagnostic.help("to multiply, write `*`"),
                })
            }
            _ if builtins::exists(&name.text) => self.call_builtin(name, arguments, span),
            _ => {
                if self.names.defined_later(self.scope.source, &name.text).is_none()
                    && let Some(foreign) = self.foreign_function(name, arguments)
                {
                    let mixed = self.mix_of_shapes(name, arguments);
                    return self.fail(mixed.unwrap_or(foreign));
                }
                let in_an_import = self.names.in_an_import(self.scope.source, &name.text, true);
                let mut candidates = self.names.candidates(self.scope.source, true);
                candidates.extend(builtins::names().map(String::from));
                let message = format!("unknown function or shape `{}`", name.text);
                let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, name.span, message)
                    .at("not defined above")
                    .suggest(&name.text, candidates.iter().map(String::as_str));
                let later = self.names.defined_later(self.scope.source, &name.text);
                let diagnostic = match (later, in_an_import) {
                    (Some(later), _) => diagnostic.label(later, "defined here"),
                    (None, Some(qualified)) => diagnostic
                        .help(format!("write `{qualified}(…)`"))
                        .edit(name.span, &name.text, qualified, false),
                    (None, None) => diagnostic,
                };
                self.fail(diagnostic)
            }
        }
    }

    /// The function that `.name(…)` calls.
    pub fn function_of_shapes(&mut self, name: &str) -> Option<(&'a Function, SourceId)> {
        self.names.function_of_shapes(self.scope.source, name)
    }

    /// `shape.name(…)` is `name(shape, …)`.
    pub fn call_method(
        &mut self,
        function: &'a Function,
        source: SourceId,
        receiver: &Expr,
        arguments: &[Argument],
        span: Span,
    ) -> Value {
        let mut all = vec![Argument { name: None, value: receiver.clone() }];
        all.extend_from_slice(arguments);
        self.call_function(function, source, &all, span)
    }

    pub fn call_function(
        &mut self,
        function: &'a Function,
        source: SourceId,
        arguments: &[Argument],
        span: Span,
    ) -> Value {
        let name = &function.name.text;
        if !self.may_call(name, source, span) {
            return Value::Failed;
        }
        if source == SourceId::Prelude && name == "box" && self.box_of_one_corner(arguments, span) {
            return Value::Failed;
        }
        if source == SourceId::Prelude
            && let Some(diagnostic) = self.solid_of_other_tools(name, arguments)
        {
            return self.fail(diagnostic);
        }
        let Some(mut bound) = self.bind((function, source), arguments, span) else { return Value::Failed };
        if source == SourceId::Prelude && !function.takes_a_shape() {
            self.remember_varying_sizes(name, &bound, span);
        }
        let call = Call { function: name.clone(), source, span };
        let mut calls = self.scope.calls.clone();
        calls.push(call);
        let outer = std::mem::replace(&mut self.scope, Scope { source, locals: Vec::new(), calls });
        // defaults may use the parameters before them
        for parameter in &function.parameters {
            let local = match bound.iter().position(|local| local.name == parameter.name.text) {
                Some(at) => bound.swap_remove(at),
                None => {
                    let value =
                        parameter.default.as_ref().map_or(Value::Failed, |default| self.expr(default));
                    Local { name: parameter.name.text.clone(), value, span, bare: false }
                }
            };
            self.scope.locals.push(local);
        }
        if source == SourceId::Prelude {
            let parameters = self.scope.locals.clone();
            match name.as_str() {
                "torus" => self.warn_of_spindle(&parameters, span),
                "bend" => self.warn_of_lost_ends(&parameters, span),
                _ => {}
            }
        }
        let value = self.expr(&function.body);
        self.scope = outer;
        value
    }

    /// Remembers the sizes of a standard solid that depend on the place. They may be meant, as in
    /// `cylinder(1 + 0.1*sin(z), 3)`, and may be why a solid has no end.
    fn remember_varying_sizes(&mut self, function: &str, bound: &[Local], call: Span) {
        for Local { name, value, span, .. } in bound {
            let Value::Number(node) = value else { continue };
            if Measure::of(function, name) == Measure::Length && self.depends_on_place(*node) {
                let call = self.user_span(call);
                let (function, parameter) = (function.to_string(), name.clone());
                self.module.varying_sizes.push(VaryingSize { function, parameter, value: *span, call });
            }
        }
    }

    /// The arguments by the names of their parameters; what does not fit is reported.
    fn bind(
        &mut self,
        (function, source): (&Function, SourceId),
        arguments: &[Argument],
        span: Span,
    ) -> Option<Vec<Local>> {
        let name = &function.name.text;
        let mut bound: Vec<Local> = Vec::new();
        let mut fits = true;
        let standard = !source.is_users();
        for (position, argument) in arguments.iter().enumerate() {
            // what it measures is told below, where it is known what is asked for
            let is_foreign = standard && is_foreign_quantity(&argument.value);
            let value = if is_foreign { Value::Failed } else { self.expr(&argument.value) };
            let parameter = match self.parameter(function, position, argument) {
                Parameter::Known(parameter) => parameter,
                Parameter::Unknown => {
                    fits = false;
                    continue;
                }
                Parameter::TooMany => {
                    self.report_too_many(function, arguments, argument);
                    return None;
                }
            };
            let measure = Measure::of(name, &parameter);
            if standard && (value != Value::Failed || is_foreign) {
                fits &= self.measures(&argument.value, measure);
            }
            if is_foreign && measure == Measure::Any {
                fits = false;
                self.expr(&argument.value);
            }
            if bound.iter().any(|local| local.name == parameter) {
                let at = argument.name.as_ref().map_or(argument.value.span, |name| name.span);
                let at = self.user_span(at);
                let message = format!("parameter `{parameter}` of `{name}` is given twice");
                self.report(Diagnostic::error(Code::ARGUMENTS, at, message));
                fits = false;
                continue;
            }
            let at = if argument.value.span.source.is_users() {
                argument.value.span
            } else {
                self.user_span(span)
            };
            let bare = self.is_bare(&argument.value);
            bound.push(Local { name: parameter, value, span: at, bare });
        }
        fits &= !standard || !self.exchanged((function, arguments), &bound);
        fits &=
            !standard || function.takes_a_shape() || self.kinds_of_arguments_fit(function, arguments, &bound);
        for parameter in &function.parameters {
            let given = bound.iter().any(|local| local.name == parameter.name.text);
            if !given && parameter.default.is_none() && fits {
                self.report_missing(function, &parameter.name.text, span);
                fits = false;
            }
        }
        fits.then_some(bound)
    }

    /// Whether a number stands where a function takes its shape, and a shape where it takes a number, as in
    /// `shell(0.1, sphere(1))`, which is reported.
    fn exchanged(&mut self, (function, arguments): (&Function, &[Argument]), bound: &[Local]) -> bool {
        let name = &function.name.text;
        let Some(first) = function.parameters.first().map(|p| &p.name.text) else { return false };
        if Measure::of(name, first) != Measure::Any
            || matches!(name.as_str(), "layer" | "noise" | "half_space")
        {
            return false;
        }
        let value = |local: &Local| match local.value {
            Value::Number(node) => Some(node),
            _ => None,
        };
        let Some(given) = bound.iter().find(|local| local.name == *first) else { return false };
        let is_constant = value(given).is_some_and(|node| self.known_value(node).is_some());
        let is_shape = |local: &&Local| {
            Measure::of(name, &local.name) != Measure::Any
                && value(local).is_some_and(|node| self.depends_on_place(node))
        };
        let Some(shape) = bound.iter().find(is_shape).filter(|_| is_constant) else { return false };
        let message = format!("`{}` of `{name}` is a number, found a shape", shape.name);
        let written: Vec<Option<&str>> = arguments.iter().map(|a| self.written(&a.value)).collect();
        let call = match written[..] {
            [Some(number), Some(shape)] => format!("{name}({shape}, {number})"),
            _ => example(name).unwrap_or("sphere(1).shell(0.1)").to_string(),
        };
        let help = format!("its parameters are {}: write `{call}`", signature(function));
        self.report(Diagnostic::error(Code::WRONG_TYPE, shape.span, message).help(help));
        true
    }

    /// Reports a number given to a standard solid where it takes a vector, and the other way round.
    fn kinds_of_arguments_fit(
        &mut self,
        function: &Function,
        arguments: &[Argument],
        bound: &[Local],
    ) -> bool {
        const VECTORS: [&str; 5] = ["centre", "min", "max", "normal", "point"];
        let name = &function.name.text;
        for local in bound {
            let wanted = VECTORS.contains(&local.name.as_str());
            let (what, found) = match (&local.value, wanted) {
                (Value::Number(_), true) => ("a vector `[a, b, c]`", "a number"),
                (Value::Vector(_), false) => ("a number", "a vector"),
                (Value::List(_), false) => ("a number", "a list"),
                (Value::List(numbers), true) if numbers.len() != 3 => {
                    self.report_wrong_length(name, local, numbers.len());
                    return false;
                }
                (Value::Text(_), true) => ("a vector `[a, b, c]`", "a text"),
                (Value::Text(_), false) => ("a number", "a text"),
                // what is wrong with one of three components is told where the vector is used
                (Value::Number(_), false)
                | (Value::Vector(_) | Value::List(_), true)
                | (Value::Failed, _) => {
                    continue;
                }
            };
            let message = format!("`{}` of `{name}` is {what}, found {found}", local.name);
            let numbers: Option<Vec<&str>> = arguments
                .iter()
                .map(|a| self.written(&a.value).filter(|text| text.chars().all(|c| c.is_ascii_digit())))
                .collect();
            let vector =
                arguments.first().and_then(|a| self.written(&a.value)).filter(|text| text.starts_with('['));
            let help = match (name.as_str(), numbers.as_deref(), vector) {
                ("sphere", Some([whole, part]), _) => {
                    format!("decimals are written with a point: write `sphere({whole}.{part})`")
                }
                ("sphere", _, Some(centre)) => format!("write `ball({centre}, 1)` or `sphere(1, {centre})`"),
                _ => match example(name) {
                    Some(call) => {
                        format!("its parameters are {}: write for example `{call}`", signature(function))
                    }
                    None => format!("its parameters are {}", signature(function)),
                },
            };
            self.report(Diagnostic::error(Code::WRONG_TYPE, local.span, message).help(help));
            return false;
        }
        true
    }

    /// Reports a list where a standard solid takes a vector, as in `sphere(1, [1, 0])`.
    fn report_wrong_length(&mut self, function: &str, local: &Local, length: usize) {
        let parameter = &local.name;
        let message = format!("`{parameter}` of `{function}` has three numbers `[a, b, c]`, found {length}");
        let diagnostic = Diagnostic::error(Code::WRONG_TYPE, local.span, message);
        let written = self.written_at(local.span).and_then(|text| text.strip_suffix(']'));
        self.report(match written.filter(|text| length == 2 && text.starts_with('[')) {
            Some(pair) => diagnostic.help(format!("write `{}, 0]` for a place at z = 0", pair.trim_end())),
            None => diagnostic,
        });
    }

    /// The parameter that an argument is for; a name that the function does not know is reported.
    fn parameter(&mut self, function: &Function, position: usize, argument: &Argument) -> Parameter {
        let Some(given) = &argument.name else {
            let parameter = function.parameters.get(position);
            return parameter.map_or(Parameter::TooMany, |p| Parameter::Known(p.name.text.clone()));
        };
        let names = function.parameters.iter().map(|p| p.name.text.as_str());
        if names.clone().any(|name| name == given.text) {
            return Parameter::Known(given.text.clone());
        }
        let message = format!("`{}` has no parameter `{}`", function.name.text, given.text);
        let all: Vec<&str> = names.clone().collect();
        let diagnostic = Diagnostic::error(Code::ARGUMENTS, given.span, message);
        let is_standard = self.names.is_standard(self.scope.source, &function.name.text);
        let known = foreign::parameter(&function.name.text, &given.text, &all).filter(|_| is_standard);
        self.report(match known {
            Some(help) => diagnostic.help(help),
            None => {
                diagnostic.help(format!("its parameters are {}", all.join(", "))).suggest(&given.text, names)
            }
        });
        Parameter::Unknown
    }

    fn report_too_many(&mut self, function: &Function, arguments: &[Argument], first: &Argument) {
        let found = arguments.len();
        let most = function.parameters.len();
        let plural = if most == 1 { "" } else { "s" };
        let message =
            format!("`{}` takes at most {most} argument{plural}, found {found}", function.name.text);
        let at = self.user_span(first.value.span);
        let diagnostic = Diagnostic::error(Code::ARGUMENTS, at, message).at("one too many");
        let signature = signature(function);
        // a rod between two points
        let between = matches!(arguments, [a, b, _] if [a, b].iter().all(|end| matches!(end.value.kind, ExprKind::Vector(_))));
        let ends = match function.name.text.as_str() {
            "capsule" => matches!(&first.value.kind, ExprKind::Number(_)),
            "cylinder" => between,
            _ => false,
        };
        if ends && self.names.is_standard(self.scope.source, &function.name.text) {
            let written: Option<Vec<&str>> = arguments.iter().map(|a| self.written(&a.value)).collect();
            let tube = match written.as_deref() {
                Some([a, b, radius]) if between => format!("sweep([{a}, {b}], {radius})"),
                _ => "sweep([[0, 0, 0], [1, 0, 0]], 0.1)".to_string(),
            };
            self.report(
                diagnostic
                    .help(format!("a rod between two points is a tube with round ends: write `{tube}`")),
            );
            return;
        }
        self.report(diagnostic.help(match example(&function.name.text) {
            Some(example) if self.names.is_standard(self.scope.source, &function.name.text) => {
                format!("its parameters are {signature}: write for example `{example}`")
            }
            _ => format!("its parameters are {signature}"),
        }));
    }

    fn report_missing(&mut self, function: &Function, parameter: &str, span: Span) {
        let name = &function.name.text;
        let message = format!("`{name}` needs a value for `{parameter}`");
        let at = self.user_span(span);
        let is_standard = self.names.is_standard(self.scope.source, name);
        let help = match example(name).filter(|_| is_standard) {
            Some(call) => format!("its parameters are {}: write for example `{call}`", signature(function)),
            None => format!("its parameters are {}", signature(function)),
        };
        self.report(Diagnostic::error(Code::ARGUMENTS, at, message).help(help));
    }

    /// `box([1, 1, 1])`: a box has two corners, and the size alone does not say where it is.
    pub fn box_of_one_corner(&mut self, arguments: &[Argument], span: Span) -> bool {
        let [Argument { name: None, value }] = arguments else { return false };
        let ExprKind::Vector(parts) = &value.kind else {
            let written = self.written(value).unwrap_or("1").to_string();
            let diagnostic =
                Diagnostic::error(Code::ARGUMENTS, self.user_span(span), "`box` needs two corners")
                    .help(format!("write `box([0, 0, 0], [{written}, {written}, {written}])`"));
            // a name may stand for a vector
            let is_corner = matches!(self.expr(value), Value::Vector(_) | Value::Failed);
            if !is_corner {
                self.report(diagnostic);
            }
            return !is_corner;
        };
        let too_far = parts.iter().any(|part| matches!(part.kind, ExprKind::Number(n) if n >= 1.0));
        if too_far {
            let size = self.written(value).unwrap_or("[1, 1, 1]");
            let help = format!("`box(min, max)` goes from corner to corner: write `box([0, 0, 0], {size})`");
            self.report(
                Diagnostic::error(Code::ARGUMENTS, self.user_span(span), "`box` needs two corners")
                    .help(help),
            );
        }
        too_far
    }
}

/// How a function is called: its name with its parameters.
fn signature(function: &Function) -> String {
    let written = |has_default: bool| if has_default { " = …" } else { "" };
    let parameters: Vec<String> =
        function.parameters.iter().map(|p| p.name.text.clone() + written(p.default.is_some())).collect();
    format!("{}({})", function.name.text, parameters.join(", "))
}

/// A call of a standard solid that works as it stands.
fn example(name: &str) -> Option<&'static str> {
    Some(match name {
        "sphere" => "sphere(1, [0, 0, 2])",
        "ball" => "ball([0, 0, 2], 1)",
        "ellipsoid" => "ellipsoid(1, 2, 3)",
        "box" => "box([0, 0, 0], [1, 2, 3])",
        "cylinder" => "cylinder(0.5, 2)",
        "cone" => "cone(0.5, 2)",
        "capsule" => "capsule(0.5, 2)",
        "torus" => "torus(1, 0.25)",
        "layer" => "layer(z, 0, 1)",
        "half_space" => "half_space([0, 0, 1], [0, 0, 2])",
        "extrude" => "polygon([[0, 0], [2, 0], [1, 1]]).extrude(0, 1)",
        "loft" => "a.loft(b, 0, 1)",
        "twist" => "box().twist(0.5)",
        "taper" => "box().taper(1, 0.5)",
        "bend" => "box().bend(2)",
        "shell" => "sphere(1).shell(0.1)",
        "offset" => "sphere(1).offset(0.1)",
        "polar_repeat" => "sphere(0.3).move([1, 0, 0]).polar_repeat(6)",
        "blend" => "blend(a, b, 0.1)",
        "chamfer" => "chamfer(a, b, 0.1)",
        "smooth_or" => "smooth_or(a, b, 0.1)",
        "smooth_and" => "smooth_and(a, b, 0.1)",
        "smooth_without" => "smooth_without(a, b, 0.1)",
        _ => return None,
    })
}

/// What an argument is for.
enum Parameter {
    Known(String),
    /// A name that the function does not have.
    Unknown,
    /// A position that it does not have.
    TooMany,
}
