//! Parameters of functions and variables of folds that nothing uses.

use super::lowering::Lowering;
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{Entry, Expr, ExprKind, Function, Item};

impl Lowering<'_> {
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
