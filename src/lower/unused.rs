//! Names, parameters of functions and variables of folds that nothing uses.

use super::lowering::Lowering;
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{Entry, Expr, ExprKind, Function, Item};

impl Lowering<'_> {
    /// Warns of names that nothing mentions.
    pub fn unused(&mut self) {
        let unused = self.names.unused();
        for (name, kind, span) in unused {
            self.report(
                Diagnostic::warning(Code::UNUSED, span, format!("{kind} `{name}` is never used"))
                    .help(format!("remove it, or write `_{name}`"))
                    .edit(span, &name, format!("_{name}"), false),
            );
        }
    }

    /// Warns of local names of an item that its expressions do not mention.
    pub fn unused_locals(&mut self, item: &Item) {
        match item {
            Item::Import(_) | Item::Param(_) => {}
            Item::Let(definition) | Item::Solid(definition) => self.unused_variables(&definition.value),
            Item::Function(function) => {
                self.unused_parameters(function);
                self.unused_variables(&function.body);
            }
            Item::Scene(scene) => self.unused_in_entries(&scene.entries),
        }
    }

    fn unused_in_entries(&mut self, entries: &[Entry]) {
        for entry in entries {
            match entry {
                Entry::Setting { value, .. } => self.unused_variables(value),
                Entry::Block { entries, .. } => self.unused_in_entries(entries),
            }
        }
    }

    /// Counts the names of an expression as used that is not evaluated, and those of the functions that it calls.
    pub fn count_as_used(&mut self, expr: &Expr) {
        let mut locals = self.scope.locals.iter().map(|local| local.name.clone()).collect();
        self.count_names(expr, &mut locals);
    }

    fn count_names(&mut self, expr: &Expr, locals: &mut Vec<String>) {
        match &expr.kind {
            ExprKind::Name(name) => self.count_name(name, locals),
            ExprKind::Call { function, .. } => self.count_name(&function.text, locals),
            ExprKind::Method { receiver, method, .. } => {
                self.count_name(&method.text, &[]);
                self.count_file_as_used(receiver);
            }
            ExprKind::Member { of, .. } => self.count_file_as_used(of),
            ExprKind::Fold { variable, members, body, .. } => {
                members.exprs().into_iter().for_each(|part| self.count_names(part, locals));
                locals.push(variable.text.clone());
                self.count_names(body, locals);
                locals.pop();
                return;
            }
            ExprKind::Number(_)
            | ExprKind::Quantity { .. }
            | ExprKind::Text(_)
            | ExprKind::Vector(_)
            | ExprKind::Logic { .. }
            | ExprKind::Not(_)
            | ExprKind::Negate(_)
            | ExprKind::Compare { .. }
            | ExprKind::Sum { .. }
            | ExprKind::Product { .. }
            | ExprKind::Power { .. }
            | ExprKind::Component { .. }
            | ExprKind::Index { .. }
            | ExprKind::Choice { .. } => {}
        }
        expr.children().into_iter().for_each(|part| self.count_names(part, locals));
    }

    fn count_name(&mut self, name: &str, locals: &[String]) {
        if locals.iter().any(|local| local == name) {
            return;
        }
        if let Some(function) = self.names.first_use(self.scope.source, name) {
            let mut own = function.parameters.iter().map(|parameter| parameter.name.text.clone()).collect();
            let defaults = function.parameters.iter().filter_map(|parameter| parameter.default.as_ref());
            defaults.chain([&function.body]).for_each(|part| self.count_names(part, &mut own));
        }
    }

    /// Counts an imported file as used whose name stands in front of a dot.
    fn count_file_as_used(&mut self, of: &Expr) {
        if let ExprKind::Name(name) = &of.kind {
            self.names.import(self.scope.source, name);
        }
    }

    fn unused_parameters(&mut self, function: &Function) {
        for (i, parameter) in function.parameters.iter().enumerate() {
            let name = &parameter.name;
            let defaults = function.parameters[i + 1..].iter().filter_map(|later| later.default.as_ref());
            let mut places = std::iter::once(&function.body).chain(defaults);
            if !name.text.starts_with('_') && !places.any(|expr| mentions(expr, &name.text)) {
                let message =
                    format!("the parameter `{}` of `{}` is never used", name.text, function.name.text);
                let help = format!("remove it, or write `_{}`", name.text);
                self.report(Diagnostic::warning(Code::UNUSED, name.span, message).help(help));
            }
        }
    }

    fn unused_variables(&mut self, expr: &Expr) {
        if let ExprKind::Fold { op, variable, body, .. } = &expr.kind
            && !variable.text.starts_with('_')
            && !mentions(body, &variable.text)
        {
            let message = format!(
                "`{}` is never used behind `{} {}`: all members are the same",
                variable.text,
                op.word(),
                variable.text
            );
            let help = format!("use it, as in `.move([{0}, 0, 0])`, or write `_{0}`", variable.text);
            self.report(Diagnostic::warning(Code::UNUSED, variable.span, message).help(help));
        }
        for part in expr.children() {
            self.unused_variables(part);
        }
    }
}

/// Whether an expression has a name in it.
fn mentions(expr: &Expr, name: &str) -> bool {
    matches!(&expr.kind, ExprKind::Name(found) if found == name)
        || expr.children().into_iter().any(|part| mentions(part, name))
}
