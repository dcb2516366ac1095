//! Lists and folds: `[a, b, …]`, `list[i]`, `any i in 0..6: …`, `sum p in points: …`, `list i in 0..6: …`.

use std::sync::Arc;

use super::lowering::{Local, Lowering};
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::ir::{Binary, Node};
use crate::syntax::ast::{Expr, ExprKind, Fold, Logic, Members, Name};

/// The most numbers of a list with all lists in it.
const MOST_NUMBERS: usize = 100_000;

/// How deep lists may be nested.
const DEEPEST_LIST: usize = 32;

/// The farthest end of a range: up to 2⁵³ every whole number is a number.
const MOST_COUNTED: f64 = 9_007_199_254_740_992.0;

impl Lowering<'_> {
    /// Three numbers are a vector; anything else in square brackets is a list.
    pub fn vector(&mut self, parts: &[Expr], span: Span) -> Value {
        if !parts.iter().all(|part| self.no_angle(part)) {
            return Value::Failed;
        }
        let values: Vec<Value> = parts.iter().map(|part| self.expr(part)).collect();
        if values.contains(&Value::Failed) {
            return Value::Failed;
        }
        if self.over_budget(span) {
            return Value::Failed;
        }
        self.listed(values, |member| parts[member].span, span)
    }

    /// The list of some members, or the vector if they are three numbers. `place` tells where a member is written.
    fn listed(&mut self, values: Vec<Value>, place: impl Fn(usize) -> Span, span: Span) -> Value {
        if let Some(text) = values.iter().position(|value| matches!(value, Value::Text(_))) {
            let message = "a list holds numbers, vectors and lists, found a text";
            return self.fail(Diagnostic::error(Code::WRONG_TYPE, self.user_span(place(text)), message));
        }
        match values[..] {
            [Value::Number(a), Value::Number(b), Value::Number(c)] => Value::Vector([a, b, c]),
            _ => self.list(values, span),
        }
    }

    /// A list that is not too large: names may stand for lists of lists, which grow fast.
    pub fn list(&mut self, members: Vec<Value>, span: Span) -> Value {
        let list = Value::List(members.into());
        let (count, depth) = list.extent();
        if count > MOST_NUMBERS || depth > DEEPEST_LIST {
            let span = self.user_span(span);
            let message = format!("a list with {count} numbers, {depth} lists deep");
            let diagnostic = Diagnostic::error(Code::TOO_LARGE, span, message);
            return self
                .fail(diagnostic.help(format!("at most {MOST_NUMBERS} numbers and {DEEPEST_LIST} lists")));
        }
        list
    }

    /// `v.x` of a vector, or of a list of two numbers.
    pub fn component(&mut self, value: &Value, axis: usize, span: Span) -> Value {
        if let Value::List(pair) = value
            && let ([Value::Number(_), Value::Number(_)], Some(part)) = (&pair[..], pair.get(axis))
        {
            return part.clone();
        }
        self.as_vector(value, span).map_or(Value::Failed, |v| Value::Number(v[axis]))
    }

    /// `list[2]`, counted from 0.
    pub fn index(&mut self, list: &Expr, index: &Expr, span: Span) -> Value {
        let value = self.expr(list);
        let Some(at) = self.constant_expr(index, "the index of a list") else { return Value::Failed };
        let Some(members) = self.list_members(&value, list) else { return Value::Failed };
        let whole = at.fract() == 0.0 && at >= 0.0;
        match members.get(at as usize).filter(|_| whole) {
            Some(member) => member.clone(),
            None => {
                let span = self.user_span(span);
                let message = format!("a list with {} members has no member {at}", members.len());
                let diagnostic = Diagnostic::error(Code::OUT_OF_RANGE, span, message);
                self.fail(match members.len().checked_sub(1) {
                    Some(last) => diagnostic.help(format!("members are counted from 0 to {last}")),
                    None => diagnostic,
                })
            }
        }
    }

    /// The members of a list; a value without members is reported.
    fn list_members(&mut self, value: &Value, written: &Expr) -> Option<Arc<[Value]>> {
        let members = value.members();
        if members.is_none() && *value != Value::Failed {
            let span = self.user_span(self.origin(written));
            let message = format!("expected a list `[a, b, …]`, found {}", value.describe());
            self.report(Diagnostic::error(Code::WRONG_TYPE, span, message));
        }
        members
    }

    pub fn fold(&mut self, op: Fold, variable: &Name, members: &Members, body: &Expr, span: Span) -> Value {
        let values = match members {
            Members::Range(start, end) => self.range(op, start, end),
            Members::List(list) => self.fold_list(op, list),
        };
        let Some(values) = values else { return Value::Failed };
        if let (Members::List(list), true) = (members, values.is_empty() && !op.has_value_of_none()) {
            let message = format!("`{}` over a list without members", op.word());
            let help = format!("{}: give the list a member, or leave the fold out", of_none(op));
            let span = self.user_span(list.span);
            return self.fail(Diagnostic::error(Code::OUT_OF_RANGE, span, message).help(help));
        }
        if !self.may_be_local(variable) {
            return Value::Failed;
        }
        self.has_repeated |= values.len() > 1 && span.source.is_users();
        let is_range = matches!(members, Members::Range(..));
        let mut results = Vec::new();
        for value in values.iter().cloned() {
            let name = variable.text.clone();
            self.scope.locals.push(Local { name, value, span: variable.span, bare: is_range });
            let result = self.expr(body);
            self.scope.locals.pop();
            if result == Value::Failed {
                return Value::Failed; // one message is enough
            }
            results.push(result);
        }
        self.folded(op, results, (variable, members), (body, span))
    }

    /// The numbers of a range `start..end`.
    fn range(&mut self, op: Fold, start: &Expr, end: &Expr) -> Option<Arc<[Value]>> {
        let whole = start.span.to(end.span);
        // the number of copies may be a param, and 1
        let is_written = [start, end].iter().all(|end| matches!(end.kind, ExprKind::Number(_)));
        let (start, end) = (
            self.constant_expr(start, "the start of a range"),
            self.constant_expr(end, "the end of a range"),
        );
        let (start, end) = (start?, end?);
        if start.fract() != 0.0 || end.fract() != 0.0 {
            let message = format!("a range goes from one whole number to another, found {start} .. {end}");
            let diagnostic = Diagnostic::error(Code::OUT_OF_RANGE, whole, message);
            let dots = self.written_at(whole).filter(|text| text.contains("..."));
            self.report(match dots {
                Some(text) => {
                    diagnostic.help(format!("a range has two dots: write `{}`", text.replace("...", "..")))
                }
                None => diagnostic,
            });
            return None;
        }
        if start.abs().max(end.abs()) > MOST_COUNTED {
            let message = format!("a range goes up to {MOST_COUNTED:.0} at most, found {start} .. {end}");
            self.report(Diagnostic::error(Code::OUT_OF_RANGE, whole, message));
            return None;
        }
        if start >= end && !op.has_value_of_none() {
            let message = format!("`{}` over the range {start} .. {end}, which has no member", op.word());
            self.report(Diagnostic::error(Code::OUT_OF_RANGE, whole, message).help(self.more_members(op)));
            return None;
        }
        // each member is a constant of the graph, whatever is made of it
        if !self.may_unroll(end - start, "make the range shorter", whole) {
            return None;
        }
        if end - start == 1.0 && is_written && matches!(op, Fold::Any | Fold::All) {
            self.report(Diagnostic::warning(
                Code::FOLD_OF_ONE,
                whole,
                format!("`{}` over the single member {start}", op.word()),
            ));
        }
        let mut numbers = Vec::new();
        let mut index = start;
        while index < end {
            numbers.push(Value::Number(self.constant(index)));
            index += 1.0;
        }
        Some(numbers.into())
    }

    /// What to write for a fold without members: it has no value, as a sum has.
    fn more_members(&self, op: Fold) -> String {
        let why = of_none(op);
        // `any i in 0..n: any j in 0..i: …`
        match self.scope.locals.last().filter(|local| local.bare && self.scope.calls.is_empty()) {
            Some(outer) => format!("{why}: begin the range of `{}` where this one has a member", outer.name),
            None => format!("{why}: a range a..b holds a, a+1, … b−1, so a must be less than b"),
        }
    }

    /// The members of the list that a fold goes through.
    fn fold_list(&mut self, op: Fold, list: &Expr) -> Option<Arc<[Value]>> {
        let value = self.expr(list);
        if let (Value::Number(node), true) = (&value, self.known_value_of(&value).is_some()) {
            let end = self.known_value(*node).unwrap_or_default();
            let span = self.user_span(list.span);
            let message = format!("`{}` goes through a range or a list, found the number {end}", op.word());
            let diagnostic = Diagnostic::error(Code::WRONG_TYPE, span, message);
            self.report(diagnostic.help(format!("write `{} i in 0..{end}: …`", op.word())));
            return None;
        }
        self.list_members(&value, list)
    }

    fn known_value_of(&self, value: &Value) -> Option<f64> {
        match value {
            Value::Number(node) => self.known_value(*node),
            Value::Vector(_) | Value::List(_) | Value::Text(_) | Value::Failed => None,
        }
    }

    /// What a fold makes of its members.
    fn folded(
        &mut self,
        op: Fold,
        results: Vec<Value>,
        head: (&Name, &Members),
        (body, span): (&Expr, Span),
    ) -> Value {
        let join: fn(&mut Self, &[Node], Span) -> Node = match op {
            Fold::List => return self.listed(results, |_| body.span, span),
            Fold::Sum => return self.added(&results, (body, span)),
            Fold::Any => |lowering, nodes, span| lowering.balanced(Logic::Or, nodes, span),
            Fold::All => |lowering, nodes, span| lowering.balanced(Logic::And, nodes, span),
            Fold::Min => |lowering, nodes, span| lowering.chain(Binary::Min, nodes, span),
            Fold::Max => |lowering, nodes, span| lowering.chain(Binary::Max, nodes, span),
            // a product of none is 1
            Fold::Product if results.is_empty() => return Value::Number(self.constant(1.0)),
            Fold::Product => |lowering, nodes, span| lowering.chain(Binary::Mul, nodes, span),
        };
        if let Some(strange) = results.iter().find(|value| !matches!(value, Value::Number(_))) {
            let diagnostic = self.not_joined(op, strange, head, body);
            return self.fail(diagnostic);
        }
        let numbers = results.iter().map(|value| self.as_number(value, self.origin(body)));
        let Some(nodes) = numbers.collect::<Option<Vec<Node>>>() else { return Value::Failed };
        Value::Number(join(self, &nodes, span))
    }

    /// The sum of the members of a fold, which may be vectors; 0 of none.
    fn added(&mut self, results: &[Value], (body, span): (&Expr, Span)) -> Value {
        let Some((first, rest)) = results.split_first() else { return Value::Number(self.constant(0.0)) };
        self.warn_of_sum(body, span);
        rest.iter().fold(first.clone(), |sum, next| self.sum(Binary::Add, &sum, next, span))
    }

    /// The message for a member that is no number, as in `any i in 0..60: [i, 0, 0]`, where a list is meant.
    fn not_joined(
        &self,
        op: Fold,
        member: &Value,
        (variable, members): (&Name, &Members),
        body: &Expr,
    ) -> Diagnostic {
        let what = if matches!(op, Fold::Any | Fold::All) { "shapes" } else { "numbers" };
        let message = format!("`{}` is a fold of {what}, found {}", op.word(), member.describe());
        let range = members.exprs().into_iter().map(|expr| self.written(expr)).collect::<Option<Vec<_>>>();
        let written = match (range, self.written(body)) {
            (Some(range), Some(body)) => format!("list {} in {}: {body}", variable.text, range.join("..")),
            _ => "list i in 0..60: [cos(i), sin(i), i/60]".to_string(),
        };
        let diagnostic = Diagnostic::error(Code::WRONG_TYPE, self.user_span(self.origin(body)), message);
        match member {
            Value::Vector(_) | Value::List(_) => {
                diagnostic.help(format!("for a list of the members, write `{written}`"))
            }
            Value::Number(_) | Value::Text(_) | Value::Failed => diagnostic,
        }
    }
}

/// Why a fold has no value without members, or which one it has.
fn of_none(op: Fold) -> &'static str {
    match op {
        Fold::Any | Fold::All => "no shape would be left, and there is no formula for none",
        Fold::Min | Fold::Max => "no number is the least or greatest of none",
        Fold::Sum | Fold::Product => "a sum over none is 0 and a product 1",
        Fold::List => "a list of none has no members",
    }
}
