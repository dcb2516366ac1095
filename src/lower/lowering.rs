//! The state of a lowering: the module so far, what was reported, and where an expression is evaluated.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::module::Module;
use super::names::Names;
use super::options::SetBy;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Label, Severity, SourceId, Span};
use crate::files::Files;
use crate::ir::{Axis, Binary, Expr as Operation, Node, Unary};
use crate::quantity::Dimension;
use crate::sph::Method;
use crate::syntax::ast::Expr;

/// Calls nested deeper than this are refused: functions cannot recurse, so only a chain of them gets here.
const DEEPEST_CALL: usize = 64;

/// Expressions evaluated for each operation of the budget: shared operations cost time though they add no
/// node.
const EVALUATIONS_PER_NODE: usize = 4;

/// The dimension of a param or name.
#[derive(Debug, Clone, Copy)]
pub struct KnownDimension {
    pub dimension: Dimension,
    /// Whether it follows from other names, and not from a unit that stands there.
    pub is_derived: bool,
}

/// The state of a lowering.
pub(super) struct Lowering<'a> {
    pub module: Module,
    /// The values of the first nodes of the graph that have one, see [`Lowering::known_value`].
    known: RefCell<Vec<Option<f64>>>,
    pub diagnostics: Vec<Diagnostic>,
    pub names: Names<'a>,
    pub scope: Scope,
    /// The text of the file.
    pub text: Arc<str>,
    /// Its name.
    pub file_name: Arc<str>,
    /// Names of the imported files that were read so far.
    pub imported: Vec<(Arc<str>, SourceId)>,
    /// What stands in front of the names of params: `chess.` in an imported file.
    pub qualifier: String,
    pub files: Files,
    /// Whether the value of a solid is being evaluated, where only lengths and angles have units.
    pub in_shape: bool,
    /// Whether one side of a comparison is evaluated whose other side has coordinates in it.
    pub against_place: bool,
    /// Whether a scene is being read.
    pub in_scene: bool,
    /// The files that give the name of the time to a value of theirs.
    pub without_time: HashSet<SourceId>,
    /// Whether the value of a `let` is read.
    pub in_let: bool,
    /// Dimensions of the params and names of each text whose units tell them.
    pub dimensions: HashMap<(SourceId, String), KnownDimension>,
    /// Params and names whose value has neither a unit nor π in it.
    pub bare: HashSet<String>,
    /// The method that all scenes get, whatever they state.
    pub method: Option<Method>,
    /// What sets params, for advice about them.
    pub set_by: SetBy,
    /// Whether some params are no constants.
    pub has_open_params: bool,
    max_nodes: usize,
    budget_reported: bool,
    /// Whether a fold with several members was read.
    pub has_repeated: bool,
    /// Expressions evaluated so far.
    pub evaluations: usize,
    /// Expressions that are being evaluated inside one another.
    pub depth: usize,
    /// Code and place of what was reported: a mistake in a function or a fold is one mistake.
    reported: HashSet<(&'static str, Span)>,
}

/// Where an expression is evaluated: whose code it is, its local names, and the call that led there.
#[derive(Debug, Clone)]
pub(super) struct Scope {
    pub source: SourceId,
    pub locals: Vec<Local>,
    /// The functions being called, outermost first.
    pub calls: Vec<Call>,
}

/// A name that holds within one call or one fold.
#[derive(Debug, Clone)]
pub(super) struct Local {
    pub name: String,
    pub value: Value,
    /// The place of the argument that it was bound to.
    pub span: Span,
    /// Whether the value has neither a unit nor π in it.
    pub bare: bool,
}

/// A function that is being called.
#[derive(Debug, Clone)]
pub(super) struct Call {
    pub function: String,
    pub source: SourceId,
    pub span: Span,
}

impl Lowering<'_> {
    pub fn new(text: Arc<str>, max_nodes: usize) -> Self {
        Self {
            module: Module::default(),
            known: RefCell::default(),
            diagnostics: Vec::new(),
            names: Names::default(),
            scope: Scope { source: SourceId::Prelude, locals: Vec::new(), calls: Vec::new() },
            text,
            file_name: "".into(),
            imported: Vec::new(),
            qualifier: String::new(),
            files: Files::default(),
            in_shape: false,
            against_place: false,
            in_scene: false,
            without_time: HashSet::new(),
            in_let: false,
            dimensions: HashMap::new(),
            bare: HashSet::new(),
            method: None,
            set_by: SetBy::default(),
            has_open_params: false,
            max_nodes,
            budget_reported: false,
            has_repeated: false,
            evaluations: 0,
            depth: 0,
            reported: HashSet::new(),
        }
    }

    /// Reports once for each place; messages about no place in particular all come through.
    pub fn report(&mut self, diagnostic: Diagnostic) {
        let mut diagnostic = self.in_users_text(diagnostic);
        if diagnostic.severity == Severity::Error && diagnostic.code == Code::OUT_OF_RANGE {
            self.take_over_what_explains(&mut diagnostic);
        }
        let span = diagnostic.primary.span;
        if span.range().is_empty() || self.reported.insert((diagnostic.code.0, span)) {
            self.diagnostics.push(diagnostic);
        }
    }

    /// Makes a warning about a part of a value, such as a divisor that is zero, part of the error that the value cannot
    /// be: both are one mistake, and the warning says what to write.
    fn take_over_what_explains(&mut self, error: &mut Diagnostic) {
        let at = error.primary.span;
        let explains = |other: &Diagnostic| {
            let part = other.primary.span;
            other.severity == Severity::Warning
                && [Code::UNDEFINED_VALUE, Code::LARGE_ANGLE].contains(&other.code)
                && part.source == at.source
                && at.start <= part.start
                && part.end <= at.end
        };
        let Some(found) = self.diagnostics.iter().rposition(explains) else { return };
        let warning = self.diagnostics.remove(found);
        match warning.primary.span == at {
            true => error.primary.text = warning.message,
            false => error.secondary.push(Label { span: warning.primary.span, text: warning.message }),
        }
        error.help = warning.help;
        error.edit = warning.edit;
    }

    /// A message about a place in the standard solids, moved to the call that led there, because the user can
    /// mend only that.
    fn in_users_text(&self, mut diagnostic: Diagnostic) -> Diagnostic {
        let within = diagnostic.primary.span;
        let at = self.user_span(within);
        if at == within {
            return diagnostic;
        }
        let called = self.scope.calls.iter().rev().find(|call| call.span == at);
        diagnostic.primary.span = at;
        diagnostic.primary.text =
            called.map_or(String::new(), |call| format!("found within `{}`", call.function));
        diagnostic.secondary.retain(|label| label.span.source.is_users());
        diagnostic.edit = None;
        diagnostic
    }

    /// Reports and gives the value that silences what depends on it.
    pub fn fail(&mut self, diagnostic: Diagnostic) -> Value {
        self.report(diagnostic);
        Value::Failed
    }

    /// What the user wrote for an expression, if a message can repeat it: it stands in the file, on one line, and is
    /// short.
    pub fn written(&self, expr: &Expr) -> Option<&str> {
        self.written_at(expr.span)
    }

    /// The text of a place in the user's file, if a message may quote it.
    pub fn written_at(&self, span: Span) -> Option<&str> {
        const LONGEST: usize = 60;
        let text = self.text.get(span.range()).filter(|_| span.source == SourceId::File)?;
        let fits =
            !text.is_empty() && text.len() <= LONGEST && !text.contains(|c: char| c.is_control() || c == '`');
        fits.then_some(text)
    }

    /// The span in the user's file that an expression belongs to: its own, or that of the call that led into
    /// the standard solids.
    pub fn user_span(&self, span: Span) -> Span {
        if span.source.is_users() {
            return span;
        }
        self.scope.calls.iter().rev().map(|c| c.span).find(|s| s.source.is_users()).unwrap_or(span)
    }

    /// Whether the file has grown beyond its budget; reported once.
    pub fn over_budget(&mut self, span: Span) -> bool {
        let too_many = self.module.graph.len() > self.max_nodes;
        let most_evaluations = self.max_nodes.saturating_mul(EVALUATIONS_PER_NODE);
        let over = too_many || self.evaluations > most_evaluations;
        if over {
            let message = if too_many {
                format!("the file unrolls to more than {} operations", self.max_nodes)
            } else {
                format!("the file evaluates more than {most_evaluations} expressions when it is unrolled")
            };
            let remedy = if self.has_repeated { "make a range shorter" } else { "split the file" };
            self.report_budget(message, remedy, span);
        }
        over
    }

    /// Whether so many operations, which are certain to be needed, are within the budget. If not, this is reported
    /// before the first of them is made: to make them up to the limit may take seconds and gigabytes.
    pub fn may_unroll(&mut self, operations: f64, remedy: &str, span: Span) -> bool {
        let fits = operations <= self.max_nodes as f64;
        if !fits {
            let message = format!("the file unrolls to more than {} operations", self.max_nodes);
            self.report_budget(message, remedy, span);
        }
        fits
    }

    fn report_budget(&mut self, message: String, remedy: &str, span: Span) {
        if !std::mem::replace(&mut self.budget_reported, true) {
            let span = self.user_span(span);
            let help = match self.set_by.more_operations() {
                Some(more) => format!("{remedy}, or {more}"),
                None => remedy.to_string(),
            };
            self.report(Diagnostic::error(Code::TOO_LARGE, span, message).help(help));
        }
    }

    pub fn node(&mut self, operation: Operation, span: Span) -> Node {
        let span = self.user_span(span);
        self.module.graph.intern(operation, Some(span))
    }

    pub fn unary(&mut self, op: Unary, a: Node, span: Span) -> Node {
        self.node(Operation::Unary(op, a), span)
    }

    pub fn binary(&mut self, op: Binary, a: Node, b: Node, span: Span) -> Node {
        self.node(Operation::Binary(op, a, b), span)
    }

    pub fn constant(&mut self, value: f64) -> Node {
        self.module.graph.constant(value)
    }

    pub fn as_number(&mut self, value: &Value, span: Span) -> Option<Node> {
        match value {
            Value::Number(node) => Some(*node),
            Value::Failed => None,
            other => {
                let span = self.user_span(span);
                let message = format!("expected a number or a field, found {}", other.describe());
                let diagnostic = Diagnostic::error(Code::WRONG_TYPE, span, message);
                let is_shape =
                    |part: &Value| matches!(part, Value::Number(node) if self.depends_on_place(*node));
                let holds_shapes =
                    matches!(other, Value::List(parts) if !parts.is_empty() && parts.iter().all(is_shape));
                self.report(match other {
                    _ if holds_shapes => {
                        diagnostic.help("`any part in parts: part` joins the shapes of a list `parts`")
                    }
                    Value::Vector(_) => diagnostic
                        .help("numbers are wanted here: take its components, `v.x`, `v.y` and `v.z`, or its `length(v)`"),
                    Value::List(_) | Value::Text(_) | Value::Number(_) | Value::Failed => diagnostic,
                });
                None
            }
        }
    }

    pub fn as_vector(&mut self, value: &Value, span: Span) -> Option<[Node; 3]> {
        match value {
            Value::Vector(parts) => Some(*parts),
            Value::Failed => None,
            Value::List(members) => {
                let span = self.user_span(span);
                let strange = members.iter().position(|member| !matches!(member, Value::Number(_)));
                let message = match (strange, &members[..]) {
                    (Some(at), [_, _, _]) => {
                        let which = ["first", "second", "third"][at];
                        format!(
                            "the {which} component of a vector is a number, found {}",
                            members[at].describe()
                        )
                    }
                    _ => format!("a vector has three components, found {}", members.len()),
                };
                self.report(Diagnostic::error(Code::WRONG_TYPE, span, message));
                None
            }
            other => {
                let span = self.user_span(span);
                let message = format!("expected a vector `[a, b, c]`, found {}", other.describe());
                self.report(Diagnostic::error(Code::WRONG_TYPE, span, message));
                None
            }
        }
    }

    /// The value that a node has with the present values of params; `None` if it depends on the place or on time.
    pub fn known_value(&self, node: Node) -> Option<f64> {
        let mut known = self.known.borrow_mut();
        // found once for each node: a chain of calls asks for each of its links
        if known.len() <= node.index() {
            let params: Vec<f64> = self.module.params.iter().map(|param| param.value).collect();
            self.module.graph.extend_values(&params, &mut known);
        }
        known[node.index()]
    }

    /// Remembers that the values of the open params in a node have decided how a solid is built.
    pub fn fix(&mut self, node: Node) {
        if self.has_open_params {
            let found = self.module.graph.parameters(node);
            self.module.fixed.extend(found);
        }
    }

    /// Whether a value depends on an open param.
    pub fn is_open(&self, node: Node) -> bool {
        self.has_open_params && !self.module.graph.parameters(node).is_empty()
    }

    pub fn as_constant(&mut self, node: Node, span: Span, what: &str) -> Option<f64> {
        let value = self.known_value(node);
        self.fix(node);
        if value.is_none() {
            let span = self.user_span(span);
            let on = if self.depends_on_place(node) { "x, y or z" } else { "t" };
            let message = format!("{what} must be a constant, but it depends on {on}");
            self.report(Diagnostic::error(Code::NOT_CONSTANT, span, message));
        }
        value
    }

    /// Whether a value differs from point to point, and not only from one time to another.
    pub fn depends_on_place(&self, node: Node) -> bool {
        Axis::SPACE.into_iter().any(|axis| self.module.graph.uses(node, axis))
    }

    /// Whether one more call may be made.
    pub fn may_call(&mut self, function: &str, source: SourceId, span: Span) -> bool {
        let calls = &self.scope.calls;
        if calls.iter().any(|call| call.function == function && call.source == source) {
            let span = self.user_span(span);
            let message = format!("`{function}` calls itself");
            self.report(
                Diagnostic::error(Code::RECURSION, span, message)
                    .help("a fold repeats: `any i in 0..n: …` joins shapes, and `product i in 1..n + 1: i` multiplies numbers"),
            );
            return false;
        }
        if calls.len() >= DEEPEST_CALL {
            let span = self.user_span(span);
            let message = format!("calls nested more than {DEEPEST_CALL} deep");
            self.report(Diagnostic::error(Code::TOO_DEEP, span, message));
            return false;
        }
        true
    }
}
