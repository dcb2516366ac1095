//! Warnings about chains of comparisons that a solid fulfils in the other order: `x <= y <= z` holds where
//! `z <= y <= x` does as well.

use std::collections::HashMap;

use rfm::Program;
use rfm::diagnostic::{Code, Diagnostic, Span};
use rfm::geom::{Aabb, place};
use rfm::lower::NamedSolid;
use rfm::solid::turned_chains;
use rfm::syntax::ast::{Comparison, Expr, ExprKind, Item};

/// The chains of a file, by their places.
pub(super) struct Chains(HashMap<Span, Chain>);

/// A chain `a <= e <= b`.
struct Chain {
    /// As it is written.
    text: String,
    /// In the other order.
    turned: String,
    /// Both comparisons joined by `and`.
    joined: String,
}

impl Chains {
    pub fn of(program: &Program) -> Self {
        let text = &program.ast().text;
        let mut found = HashMap::new();
        let values = program.ast().items.iter().filter_map(|item| match item {
            Item::Let(definition) | Item::Solid(definition) => Some(&definition.value),
            Item::Function(function) => Some(&function.body),
            Item::Import(_) | Item::Param(_) | Item::Scene(_) => None,
        });
        for value in values {
            add(value, text, &mut found);
            if let Some(chain) = found.get_mut(&value.span) {
                // nothing stands beside it that could bind more tightly
                chain.joined = chain.joined[1..chain.joined.len() - 1].to_string();
            }
        }
        Self(found)
    }

    /// Warnings about those of a solid. Its points are looked for in a box, at a time. `budget` counts operations.
    pub fn warnings(
        &self,
        (program, named): (&Program, &NamedSolid),
        over: &Aabb,
        time: f64,
        budget: &mut usize,
    ) -> impl Iterator<Item = Diagnostic> {
        let formula = (&program.module().graph, named.node);
        let found = match self.0.is_empty() {
            true => Vec::new(),
            false => turned_chains(formula, |span| self.0.contains_key(&span), over, time, budget),
        };
        let size = over.size().max_element();
        found.into_iter().filter_map(move |turned| {
            let Chain { text, turned: other, joined } = self.0.get(&turned.span)?;
            let does = if turned.is_inside { "holds" } else { "lacks" };
            let message =
                format!("solid `{}` {does} {} because `{other}` there", named.name, place(turned.at, size));
            let warning = Diagnostic::warning(Code::REVERSED_CHAIN, turned.span, message);
            Some(
                warning
                    .at("this is read in both orders: it is the layer between its ends, whichever is greater")
                    .help(format!("for one order only, write `{joined}`"))
                    .edit(turned.span, text, joined, false),
            )
        })
    }
}

/// Adds the chains in an expression.
fn add(expr: &Expr, text: &str, found: &mut HashMap<Span, Chain>) {
    expr.children().into_iter().for_each(|part| add(part, text, found));
    let ExprKind::Compare { first, rest } = &expr.kind else { return };
    let [(order, _, middle), (_, _, last)] = &rest[..] else { return };
    let sign = match order {
        Comparison::LessEqual | Comparison::Less => "<=",
        Comparison::GreaterEqual | Comparison::Greater => ">=",
        Comparison::Equal | Comparison::NotEqual => return,
    };
    let written = |expr: &Expr| text.get(expr.span.range()).unwrap_or("…");
    let [a, e, b] = [first, middle, last].map(written);
    let joined = format!("({a} {sign} {e} and {e} {sign} {b})");
    let chain = Chain { text: written(expr).into(), turned: format!("{b} {sign} {e} {sign} {a}"), joined };
    found.insert(expr.span, chain);
}
