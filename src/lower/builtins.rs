//! Functions that are operations of the graph rather than text of the prelude.

use super::eval::Lowering;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::{self, Binary, Node, Unary};
use crate::syntax::ast::{Argument, Expr, ExprKind, Name};

/// Name, fewest and most arguments.
const TABLE: [(&str, usize, usize); 23] = [
    ("sqrt", 1, 1),
    ("abs", 1, 1),
    ("sin", 1, 1),
    ("cos", 1, 1),
    ("tan", 1, 1),
    ("asin", 1, 1),
    ("acos", 1, 1),
    ("atan", 1, 1),
    ("exp", 1, 1),
    ("ln", 1, 1),
    ("sign", 1, 1),
    ("atan2", 2, 2),
    ("pow", 2, 2),
    ("min", 2, usize::MAX),
    ("max", 2, usize::MAX),
    ("hypot", 2, 3),
    ("clamp", 3, 3),
    ("dot", 2, 2),
    ("cross", 2, 2),
    ("length", 1, 1),
    ("normalise", 1, 1),
    ("normalize", 1, 1),
    ("positive", 1, 2),
];

pub(super) fn exists(name: &str) -> bool {
    TABLE.iter().any(|(known, ..)| *known == name)
}

pub(super) fn names() -> impl Iterator<Item = &'static str> {
    TABLE.iter().map(|(name, ..)| *name)
}

impl Lowering<'_> {
    pub fn call_builtin(&mut self, name: &Name, arguments: &[Argument], span: Span) -> Value {
        let Some(&(_, fewest, most)) = TABLE.iter().find(|(known, ..)| *known == name.text) else {
            return Value::Failed; // the caller has looked
        };
        if let Some(named) = arguments.iter().find_map(|a| a.name.as_ref()) {
            let message = format!("`{}` takes its arguments by position", name.text);
            return self.fail(Diagnostic::error(Code::ARGUMENTS, named.span, message));
        }
        if !(fewest..=most).contains(&arguments.len()) {
            let expected = match (fewest, most) {
                (a, b) if a == b => format!("{a}"),
                (a, usize::MAX) => format!("{a} or more"),
                (a, b) => format!("{a} to {b}"),
            };
            let plural = if expected == "1" { "" } else { "s" };
            let message =
                format!("`{}` takes {expected} argument{plural}, found {}", name.text, arguments.len());
            let span = self.user_span(span);
            return self.fail(Diagnostic::error(Code::ARGUMENTS, span, message));
        }
        if name.text == "positive" {
            return self.positive(&arguments[0].value, arguments.get(1).map(|a| &a.value), span);
        }
        let values: Vec<Value> = arguments.iter().map(|a| self.expr(&a.value)).collect();
        if values.contains(&Value::Failed) {
            return Value::Failed;
        }
        let typed = |lowering: &mut Self, i: usize| lowering.as_number(&values[i], arguments[i].value.span);
        let vector = |lowering: &mut Self, i: usize| lowering.as_vector(&values[i], arguments[i].value.span);
        let result = match name.text.as_str() {
            "dot" => match (vector(self, 0), vector(self, 1)) {
                (Some(a), Some(b)) => Some(self.dot(a, b, span)),
                _ => None,
            },
            "length" => vector(self, 0).map(|v| {
                let square = self.dot(v, v, span);
                self.unary(Unary::Sqrt, square, span)
            }),
            "cross" => {
                return match (vector(self, 0), vector(self, 1)) {
                    (Some(a), Some(b)) => Value::Vector(self.cross(a, b, span)),
                    _ => Value::Failed,
                };
            }
            _ => {
                let numbers: Option<Vec<Node>> = (0..values.len()).map(|i| typed(self, i)).collect();
                numbers.map(|numbers| self.scalar_builtin(&name.text, &numbers, span))
            }
        };
        result.map_or(Value::Failed, Value::Number)
    }

    fn scalar_builtin(&mut self, name: &str, a: &[Node], span: Span) -> Node {
        if let Some(op) = Unary::ALL.into_iter().find(|op| op.name() == name) {
            return self.unary(op, a[0], span);
        }
        match name {
            "atan2" => self.binary(Binary::Atan2, a[0], a[1], span),
            "pow" => self.raise(a[0], a[1], span),
            "min" => self.chain(Binary::Min, a, span),
            "max" => self.chain(Binary::Max, a, span),
            "clamp" => {
                let upper = self.binary(Binary::Min, a[0], a[2], span);
                self.binary(Binary::Max, a[1], upper, span)
            }
            "hypot" => {
                let squares: Vec<Node> = a.iter().map(|&a| self.binary(Binary::Mul, a, a, span)).collect();
                let sum = self.chain(Binary::Add, &squares, span);
                self.unary(Unary::Sqrt, sum, span)
            }
            _ => self.normalise(a[0], span),
        }
    }

    fn chain(&mut self, op: Binary, operands: &[Node], span: Span) -> Node {
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

    /// ω/√(ω² + |∇ω|²): gradient of length 1 on the surface, no division by zero unless ω and ∇ω vanish together
    /// (Rvachev's normalisation of first order).
    fn normalise(&mut self, omega: Node, span: Span) -> Node {
        let gradient = ir::gradient(&mut self.module.graph, omega);
        let square = self.binary(Binary::Mul, omega, omega, span);
        let slope = self.dot(gradient, gradient, span);
        let sum = self.binary(Binary::Add, square, slope, span);
        let root = self.unary(Unary::Sqrt, sum, span);
        self.binary(Binary::DivOrZero, omega, root, span)
    }

    /// The value itself; if it is known now and not positive, an error at the argument that it came from.
    fn positive(&mut self, value: &Expr, what: Option<&Expr>, span: Span) -> Value {
        let result = self.expr(value);
        let Value::Number(node) = result else { return result };
        let Some(number) = self.module.graph.constant_value(node) else { return result };
        if number > 0.0 && number.is_finite() {
            return result;
        }
        let origin = match &value.kind {
            ExprKind::Name(name) => self.scope.locals.iter().rev().find(|l| l.name == *name).map(|l| l.span),
            _ => None,
        };
        let what = match what.map(|w| &w.kind) {
            Some(ExprKind::Text(text)) => text.as_str(),
            _ => "the value",
        };
        let at = self.user_span(origin.unwrap_or(span));
        let message = format!("{what} must be positive, found {number}");
        self.fail(Diagnostic::error(Code::OUT_OF_RANGE, at, message))
    }
}
