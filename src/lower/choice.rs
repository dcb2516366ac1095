//! `where(condition, a, b)` and `if condition then a else b`: one of two values, by a condition that is known now or
//! differs from point to point.

use super::lowering::Lowering;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::{Binary, Node, Unary};
use crate::syntax::ast::{Comparison, Expr, ExprKind, Logic};

/// A condition.
enum Condition {
    /// It holds everywhere, or nowhere.
    Known(bool),
    /// It holds where the field is not negative.
    Field(Node),
}

impl Lowering<'_> {
    /// The first value where the condition holds, the second one elsewhere. If that is known now, the other one is
    /// not even evaluated.
    pub fn choose(&mut self, condition: &Expr, values: [&Expr; 2], span: Span) -> Value {
        match self.condition(condition) {
            None => Value::Failed,
            Some(Condition::Known(holds)) => {
                self.count_as_used(values[usize::from(holds)]);
                self.expr(values[usize::from(!holds)])
            }
            Some(Condition::Field(field)) => {
                let [first, second] = values.map(|value| self.expr(value));
                let counts = self.step(field, span);
                self.chosen(counts, (&first, &second), span)
            }
        }
    }

    fn chosen(&mut self, counts: Node, (first, second): (&Value, &Value), span: Span) -> Value {
        match (first, second) {
            (Value::Failed, _) | (_, Value::Failed) => Value::Failed,
            (Value::Number(a), Value::Number(b)) => Value::Number(self.either(counts, [*a, *b], span)),
            (Value::Vector(a), Value::Vector(b)) => {
                Value::Vector(std::array::from_fn(|i| self.either(counts, [a[i], b[i]], span)))
            }
            _ => {
                let message = format!(
                    "both values must be of one kind, found {} and {}",
                    first.describe(),
                    second.describe()
                );
                self.fail(Diagnostic::error(Code::WRONG_TYPE, self.user_span(span), message))
            }
        }
    }

    /// a where `counts` is 1, b where it is 0; the other one does not matter, even where it is no number.
    fn either(&mut self, counts: Node, [a, b]: [Node; 2], span: Span) -> Node {
        let one = self.constant(1.0);
        let rest = self.binary(Binary::Sub, one, counts, span);
        let (a, b) =
            (self.binary(Binary::MulOrZero, a, counts, span), self.binary(Binary::MulOrZero, b, rest, span));
        self.binary(Binary::Add, a, b, span)
    }

    /// 1 where a field is not negative, 0 elsewhere: ⌊1 + sign/2⌋.
    pub fn step(&mut self, field: Node, span: Span) -> Node {
        let (half, one) = (self.constant(0.5), self.constant(1.0));
        let sign = self.unary(Unary::Sign, field, span);
        let halved = self.binary(Binary::Mul, half, sign, span);
        let sum = self.binary(Binary::Add, one, halved, span);
        self.unary(Unary::Floor, sum, span)
    }

    /// `None` if a part of it was in error, which was reported.
    fn condition(&mut self, expr: &Expr) -> Option<Condition> {
        if let Some(holds) = self.holds(expr) {
            return Some(Condition::Known(holds));
        }
        let before = self.diagnostics.len();
        let field = self.field(expr)?;
        // what `<` means besides `<=` matters on the surface of a shape, and not where a choice changes
        let is_strict = |diagnostic: &Diagnostic| diagnostic.code == Code::STRICT_COMPARISON;
        let told = self.diagnostics.split_off(before);
        self.diagnostics.extend(told.into_iter().filter(|diagnostic| !is_strict(diagnostic)));
        match self.known_value(field) {
            Some(value) => {
                self.fix(field);
                Some(Condition::Known(value >= 0.0))
            }
            None => Some(Condition::Field(field)),
        }
    }

    /// Whether comparisons of numbers that are known now hold; `None` for anything else. Here `==` has a meaning.
    fn holds(&mut self, expr: &Expr) -> Option<bool> {
        match &expr.kind {
            ExprKind::Compare { first, rest } => {
                let mut left = self.known_number(first)?;
                let mut holds = true;
                for (op, _, operand) in rest {
                    let right = self.known_number(operand)?;
                    holds &= match op {
                        Comparison::LessEqual => left <= right,
                        Comparison::GreaterEqual => left >= right,
                        Comparison::Less => left < right,
                        Comparison::Greater => left > right,
                        Comparison::Equal => left == right,
                        Comparison::NotEqual => left != right,
                    };
                    left = right;
                }
                Some(holds)
            }
            ExprKind::Logic { op, operands } => {
                let mut parts = Vec::new();
                for operand in operands {
                    parts.push(self.holds(operand)?);
                }
                Some(match op {
                    Logic::And => parts.iter().all(|holds| *holds),
                    Logic::Or => parts.contains(&true),
                    Logic::Minus => parts[0] && !parts[1..].contains(&true),
                })
            }
            ExprKind::Not(inner) => Some(!self.holds(inner)?),
            ExprKind::Choice { condition, values } => {
                let [chosen, other] = match self.holds(condition)? {
                    true => [&values[0], &values[1]],
                    false => [&values[1], &values[0]],
                };
                self.count_as_used(other);
                self.holds(chosen)
            }
            ExprKind::Number(_)
            | ExprKind::Quantity { .. }
            | ExprKind::Text(_)
            | ExprKind::Name(_)
            | ExprKind::Vector(_)
            | ExprKind::Sum { .. }
            | ExprKind::Product { .. }
            | ExprKind::Negate(_)
            | ExprKind::Power { .. }
            | ExprKind::Call { .. }
            | ExprKind::Component { .. }
            | ExprKind::Member { .. }
            | ExprKind::Method { .. }
            | ExprKind::Index { .. }
            | ExprKind::Fold { .. } => None,
        }
    }

    fn known_number(&mut self, expr: &Expr) -> Option<f64> {
        let Value::Number(node) = self.expr(expr) else { return None };
        let value = self.known_value(node)?;
        self.fix(node);
        Some(value)
    }
}
