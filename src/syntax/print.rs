//! The syntax tree as indented text, for `rfm explain --show ast` and the tests.

use std::fmt::Write;

use super::ast::{Argument, Ast, Entry, Expr, ExprKind, Item};

/// One node per line, children indented below it.
pub fn print(ast: &Ast) -> String {
    let mut out = Printer { text: String::new(), depth: 0 };
    for item in &ast.items {
        out.item(item);
    }
    out.text
}

struct Printer {
    text: String,
    depth: usize,
}

impl Printer {
    fn line(&mut self, line: std::fmt::Arguments<'_>) {
        let indent = 2 * self.depth;
        // writing to a String cannot fail
        let _ = writeln!(self.text, "{:indent$}{line}", "");
    }

    fn nested(&mut self, line: std::fmt::Arguments<'_>, children: impl FnOnce(&mut Self)) {
        self.line(line);
        self.depth += 1;
        children(self);
        self.depth -= 1;
    }

    fn item(&mut self, item: &Item) {
        match item {
            Item::Import(import) => {
                self.line(format_args!("import {:?} as {}", import.path, import.name.text))
            }
            Item::Param(param) => self.nested(format_args!("param {}", param.name.text), |p| {
                p.expr(&param.value);
                if let Some((low, high)) = &param.range {
                    p.nested(format_args!("in"), |p| {
                        p.expr(low);
                        p.expr(high);
                    });
                }
            }),
            Item::Let(item) => self.nested(format_args!("let {}", item.name.text), |p| p.expr(&item.value)),
            Item::Solid(item) => {
                for attribute in &item.attributes {
                    self.nested(format_args!("@{}", attribute.name.text), |p| {
                        p.arguments(&attribute.arguments);
                    });
                }
                self.nested(format_args!("solid {}", item.name.text), |p| p.expr(&item.value))
            }
            Item::Function(function) => self.nested(format_args!("fn {}", function.name.text), |p| {
                for parameter in &function.parameters {
                    p.nested(format_args!("parameter {}", parameter.name.text), |p| {
                        if let Some(default) = &parameter.default {
                            p.expr(default);
                        }
                    });
                }
                p.expr(&function.body);
            }),
            Item::Scene(scene) => self.nested(format_args!("scene {}", scene.name.text), |p| {
                for entry in &scene.entries {
                    p.entry(entry);
                }
            }),
        }
    }

    fn entry(&mut self, entry: &Entry) {
        match entry {
            Entry::Setting { key, value } => self.nested(format_args!("{}:", key.text), |p| p.expr(value)),
            Entry::Block { key, label, entries, .. } => {
                let label = label.as_ref().map_or("", |l| &l.text);
                self.nested(format_args!("{} {label}", key.text), |p| {
                    for entry in entries {
                        p.entry(entry);
                    }
                });
            }
        }
    }

    fn exprs<'a>(&mut self, exprs: impl IntoIterator<Item = &'a Expr>) {
        for expr in exprs {
            self.expr(expr);
        }
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Number(value) => self.line(format_args!("{value}")),
            ExprKind::Quantity { value, unit } => self.line(format_args!("{value} {}", unit.text)),
            ExprKind::Text(text) => self.line(format_args!("{text:?}")),
            ExprKind::Name(name) => self.line(format_args!("{name}")),
            ExprKind::Vector(parts) => self.nested(format_args!("vector"), |p| p.exprs(parts)),
            ExprKind::Logic { op, operands } => {
                let op = format!("{op:?}").to_lowercase();
                self.nested(format_args!("{op}/{}", operands.len()), |p| p.exprs(operands));
            }
            ExprKind::Not(inner) => self.nested(format_args!("not"), |p| p.expr(inner)),
            ExprKind::Negate(inner) => self.nested(format_args!("negate"), |p| p.expr(inner)),
            ExprKind::Compare { first, rest } => self.nested(format_args!("compare"), |p| {
                p.expr(first);
                for (op, _, operand) in rest {
                    p.line(format_args!("{op:?}"));
                    p.expr(operand);
                }
            }),
            ExprKind::Sum { first, rest } => self.nested(format_args!("sum"), |p| {
                p.expr(first);
                for (op, operand) in rest {
                    p.nested(format_args!("{op:?}"), |p| p.expr(operand));
                }
            }),
            ExprKind::Product { first, rest } => self.nested(format_args!("product"), |p| {
                p.expr(first);
                for (op, operand) in rest {
                    p.nested(format_args!("{op:?}"), |p| p.expr(operand));
                }
            }),
            ExprKind::Power { base, exponent } => {
                self.nested(format_args!("power"), |p| p.exprs([&**base, &**exponent]));
            }
            ExprKind::Call { function, arguments } => {
                self.nested(format_args!("call {}", function.text), |p| p.arguments(arguments));
            }
            ExprKind::Method { receiver, method, arguments } => {
                self.nested(format_args!("method {}", method.text), |p| {
                    p.expr(receiver);
                    p.arguments(arguments);
                });
            }
            ExprKind::Component { vector, axis } => {
                self.nested(format_args!("component {axis}"), |p| p.expr(vector));
            }
            ExprKind::Member { of, name } => {
                self.nested(format_args!("member {}", name.text), |p| p.expr(of));
            }
            ExprKind::Index { list, index } => {
                self.nested(format_args!("index"), |p| p.exprs([&**list, &**index]));
            }
            ExprKind::Fold { op, variable, members, body } => {
                self.nested(format_args!("fold {} {}", op.word(), variable.text), |p| {
                    p.exprs(members.exprs());
                    p.expr(body);
                });
            }
            ExprKind::Choice { condition, values } => {
                self.nested(format_args!("choice"), |p| {
                    p.expr(condition);
                    p.exprs(values.iter());
                });
            }
        }
    }

    fn arguments(&mut self, arguments: &[Argument]) {
        for argument in arguments {
            match &argument.name {
                Some(name) => self.nested(format_args!("{} =", name.text), |p| p.expr(&argument.value)),
                None => self.expr(&argument.value),
            }
        }
    }
}
