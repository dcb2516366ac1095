//! Turns the grammar's pairs into an [`Ast`]: one function per rule, in the grammar's order.
//!
//! The grammar has already accepted the text, so the shapes of the pairs are known. Where a child could only
//! be missing through a bug here, an empty name or a zero stands in; the tests of the grammar would show it.

use pest::iterators::{Pair, Pairs};

use std::cell::Cell;

use super::ast::{
    AddOp, Argument, Ast, Attribute, Comparison, Definition, Entry, Expr, ExprKind, Fold, Function, Import,
    Item, Logic, Members, MulOp, Name, Param, Parameter, SceneItem,
};
use super::grammar::{DEEPEST_TREE, EDITION, Rule};
use crate::diagnostic::{Code, Diagnostic, Source, SourceId, Span};

type Node<'i> = Pair<'i, Rule>;

/// A whole file, with its version line checked.
pub(super) fn file(source: &Source, pairs: Pairs<'_, Rule>, diagnostics: &mut Vec<Diagnostic>) -> Ast {
    let builder = Builder { source: source.id, offset: 0, cut: Cell::new(None) };
    let mut version = None;
    let mut items = Vec::new();
    for pair in pairs.flat_map(Pair::into_inner) {
        match pair.as_rule() {
            Rule::version => version = Some(pair),
            Rule::EOI => {}
            _ => items.extend(builder.whole_item(pair, diagnostics)),
        }
    }
    match version {
        None if source.id != SourceId::Prelude => {
            let start = Span::new(source.id, 0, 0);
            diagnostics.push(
                Diagnostic::warning(Code::VERSION_MISSING, start, "the first line does not say `rfm 1`")
                    .help("write `rfm 1` as the first line")
                    .edit(start, "", format!("rfm {EDITION}\n"), true),
            );
        }
        Some(pair) => {
            let span = builder.span(&pair);
            let edition = pair.into_inner().next().map_or("", |e| e.as_str());
            if edition.parse::<u32>().ok() != Some(EDITION) {
                let message = format!("edition {edition} of the language is not known to this program");
                diagnostics.push(
                    Diagnostic::error(Code::VERSION_UNKNOWN, span, message)
                        .at(format!("this rfm reads edition {EDITION}")),
                );
            }
        }
        None => {}
    }
    Ast { items, text: source.text.clone() }
}

/// The items of a piece of a file. The piece begins `offset` bytes into the file.
pub(super) fn items(
    source: &Source,
    offset: usize,
    pairs: Pairs<'_, Rule>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<Item> {
    let builder = Builder { source: source.id, offset, cut: Cell::new(None) };
    pairs
        .flat_map(Pair::into_inner)
        .filter(|pair| pair.as_rule() != Rule::EOI)
        .filter_map(|pair| builder.whole_item(pair, diagnostics))
        .collect()
}

/// The children of a pair that carry meaning. Punctuation is only there for the messages.
fn parts(pair: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    pair.into_inner().filter(|part| {
        !matches!(
            part.as_rule(),
            Rule::equals
                | Rule::colon
                | Rule::dots
                | Rule::open
                | Rule::close
                | Rule::close_vector
                | Rule::open_brace
                | Rule::close_brace
        )
    })
}

/// The most links in one chain of powers or methods. Each link is one level of the tree.
const LONGEST_CHAIN: usize = 100;

struct Builder {
    source: SourceId,
    offset: usize,
    /// Where a chain became longer than [`LONGEST_CHAIN`]; the rest of it was left out.
    cut: Cell<Option<Span>>,
}

impl Builder {
    fn span(&self, pair: &Node<'_>) -> Span {
        let span = pair.as_span();
        // rules end behind trailing white space and comments, which a message should not underline
        let length = length_of_code(pair.as_str());
        Span::new(self.source, self.offset + span.start(), self.offset + span.start() + length)
    }

    fn name(&self, pair: Option<Node<'_>>) -> Name {
        match pair {
            Some(pair) => Name { text: pair.as_str().to_string(), span: self.span(&pair) },
            None => Name { text: String::new(), span: Span::new(self.source, 0, 0) },
        }
    }

    /// The item, or `None` if it is nested too deeply for the later stages.
    fn whole_item(&self, pair: Node<'_>, diagnostics: &mut Vec<Diagnostic>) -> Option<Item> {
        let item = self.item(pair);
        let Some(span) = self.cut.take().or_else(|| item.deeper_than(DEEPEST_TREE)) else {
            return Some(item);
        };
        diagnostics.push(
            Diagnostic::error(Code::TOO_DEEP, span, "the expression is nested too deeply")
                .help("name a part with `let`"),
        );
        None
    }

    fn item(&self, pair: Node<'_>) -> Item {
        let rule = pair.as_rule();
        if rule == Rule::scene {
            return Item::Scene(self.scene(pair));
        }
        let mut inner = parts(pair).peekable();
        let mut attributes = Vec::new();
        while let Some(pair) = inner.next_if(|part| part.as_rule() == Rule::attribute) {
            attributes.push(self.attribute(pair));
        }
        inner.next(); // the keyword
        if rule == Rule::import_item {
            let text = inner.next();
            let span = text.as_ref().map_or(Span::new(self.source, 0, 0), |text| self.span(text));
            let path = text.map_or_else(String::new, text_of);
            let name = inner.find(|part| part.as_rule() == Rule::name);
            return Item::Import(Import { name: self.name(name), path, span });
        }
        let name = self.name(inner.next());
        match rule {
            Rule::param => self.param(name, inner),
            Rule::fn_item => self.function(name, inner),
            Rule::solid => {
                Item::Solid(Definition { attributes, name, value: self.expr_or_zero(inner.next()) })
            }
            _ => Item::Let(Definition { attributes, name, value: self.expr_or_zero(inner.next()) }),
        }
    }

    fn attribute(&self, pair: Node<'_>) -> Attribute {
        let span = self.span(&pair);
        let mut inner = parts(pair);
        let Name { text, span: whole } = self.name(inner.next());
        // leaves out the `@` that makes it an attribute
        let name = Name {
            text: text.trim_start_matches('@').to_string(),
            span: Span::new(self.source, whole.range().start + 1, whole.range().end),
        };
        Attribute { name, arguments: self.arguments(inner.next()), span }
    }

    fn param<'i>(&self, name: Name, mut inner: impl Iterator<Item = Node<'i>>) -> Item {
        let value = self.expr_or_zero(inner.next());
        let (mut range, mut doc) = (None, None);
        for pair in inner {
            if pair.as_rule() == Rule::param_range {
                let mut bounds = parts(pair).filter(|p| p.as_rule() == Rule::sum);
                if let (Some(low), Some(high)) = (bounds.next(), bounds.next()) {
                    range = Some((self.sum(low), self.sum(high)));
                }
            } else {
                doc = Some(text_of(pair));
            }
        }
        Item::Param(Param { name, value, range, doc })
    }

    fn function<'i>(&self, name: Name, inner: impl Iterator<Item = Node<'i>>) -> Item {
        let mut parameters = Vec::new();
        let mut body = None;
        for pair in inner {
            if pair.as_rule() == Rule::parameter {
                let mut inner = parts(pair);
                let name = self.name(inner.next());
                parameters.push(Parameter { name, default: inner.next().map(|e| self.expr(e)) });
            } else {
                body = Some(pair);
            }
        }
        Item::Function(Function { name, parameters, body: self.expr_or_zero(body) })
    }

    fn scene(&self, pair: Node<'_>) -> SceneItem {
        let span = self.span(&pair);
        let mut inner = parts(pair);
        inner.next();
        let name = self.name(inner.next());
        SceneItem { name, entries: inner.map(|e| self.entry(e)).collect(), span }
    }

    fn entry(&self, pair: Node<'_>) -> Entry {
        let span = self.span(&pair);
        let is_block = pair.as_rule() == Rule::block;
        let mut inner = parts(pair).peekable();
        let key = self.name(inner.next());
        if !is_block {
            return Entry::Setting { key, value: self.expr_or_zero(inner.next()) };
        }
        let label = inner.next_if(|p| p.as_rule() == Rule::name).map(|p| self.name(Some(p)));
        Entry::Block { key, label, entries: inner.map(|e| self.entry(e)).collect(), span }
    }

    fn expr_or_zero(&self, pair: Option<Node<'_>>) -> Expr {
        match pair {
            Some(pair) => self.expr(pair),
            None => Expr { kind: ExprKind::Number(0.0), span: Span::new(self.source, 0, 0) },
        }
    }

    /// A run of one operator becomes one n-ary node. Where the operator changes, the run so far becomes its
    /// operand.
    fn expr(&self, pair: Node<'_>) -> Expr {
        let operands = parts(pair).filter(|p| p.as_rule() == Rule::conjunction);
        let operands: Vec<_> = operands.map(|p| self.conjunction(p)).collect();
        logic(Logic::Or, operands)
    }

    fn conjunction(&self, pair: Node<'_>) -> Expr {
        let mut run: Vec<Expr> = Vec::new();
        let mut run_op = Logic::And;
        let mut next_op = Logic::And;
        for pair in parts(pair) {
            match pair.as_rule() {
                Rule::and_op => next_op = Logic::And,
                Rule::minus_op => next_op = Logic::Minus,
                _ => {
                    if run.len() > 1 && next_op != run_op {
                        run = vec![logic(run_op, run)];
                    }
                    run_op = next_op;
                    run.push(self.negation(pair));
                }
            }
        }
        logic(run_op, run)
    }

    /// An even number of `not`s cancels: the negation of ω is exact.
    fn negation(&self, pair: Node<'_>) -> Expr {
        let span = self.span(&pair);
        let (mut first, mut odd) = (None, false);
        let mut operand = None;
        for pair in parts(pair) {
            if pair.as_rule() == Rule::not_op {
                first.get_or_insert(self.span(&pair));
                odd = !odd;
            } else {
                operand = Some(self.comparison(pair));
            }
        }
        let operand = operand.unwrap_or(Expr { kind: ExprKind::Number(0.0), span });
        match first {
            Some(not) if odd => {
                let span = not.to(operand.span);
                Expr { kind: ExprKind::Not(Box::new(operand)), span }
            }
            _ => operand,
        }
    }

    fn comparison(&self, pair: Node<'_>) -> Expr {
        let span = self.span(&pair);
        let mut inner = parts(pair);
        let first = inner.next().map_or(Expr { kind: ExprKind::Number(0.0), span }, |p| self.sum(p));
        let mut rest = Vec::new();
        while let (Some(op), Some(operand)) = (inner.next(), inner.next()) {
            let comparison = match op.as_str() {
                "<=" | "≤" | "=<" => Comparison::LessEqual,
                ">=" | "≥" | "=>" => Comparison::GreaterEqual,
                "<" => Comparison::Less,
                ">" => Comparison::Greater,
                "!=" => Comparison::NotEqual,
                _ => Comparison::Equal,
            };
            rest.push((comparison, self.span(&op), self.sum(operand)));
        }
        if rest.is_empty() {
            return first;
        }
        Expr { kind: ExprKind::Compare { first: Box::new(first), rest }, span }
    }

    fn sum(&self, pair: Node<'_>) -> Expr {
        let span = self.span(&pair);
        let mut inner = parts(pair);
        let first = inner.next().map_or(Expr { kind: ExprKind::Number(0.0), span }, |p| self.product(p));
        let mut rest = Vec::new();
        while let (Some(op), Some(operand)) = (inner.next(), inner.next()) {
            let op = if op.as_str() == "+" { AddOp::Add } else { AddOp::Subtract };
            rest.push((op, self.product(operand)));
        }
        if rest.is_empty() {
            return first;
        }
        Expr { kind: ExprKind::Sum { first: Box::new(first), rest }, span }
    }

    fn product(&self, pair: Node<'_>) -> Expr {
        let span = self.span(&pair);
        let mut inner = parts(pair);
        let first = inner.next().map_or(Expr { kind: ExprKind::Number(0.0), span }, |p| self.signed(p));
        let mut rest = Vec::new();
        while let (Some(op), Some(operand)) = (inner.next(), inner.next()) {
            let op = if matches!(op.as_str(), "/" | "÷") { MulOp::Divide } else { MulOp::Multiply };
            rest.push((op, self.signed(operand)));
        }
        if rest.is_empty() {
            return first;
        }
        Expr { kind: ExprKind::Product { first: Box::new(first), rest }, span }
    }

    /// `signed` and `exponent`: sign operators before an operand. An even number of minuses cancels.
    fn signed(&self, pair: Node<'_>) -> Expr {
        let span = self.span(&pair);
        let mut negative = false;
        let mut operand = None;
        for pair in parts(pair) {
            match pair.as_rule() {
                Rule::sign_op => negative ^= pair.as_str() != "+",
                Rule::power => operand = Some(self.power(pair)),
                _ => operand = Some(self.postfix(pair)),
            }
        }
        let operand = operand.unwrap_or(Expr { kind: ExprKind::Number(0.0), span });
        if negative { Expr { kind: ExprKind::Negate(Box::new(operand)), span } } else { operand }
    }

    /// Powers group to the right: a^b^c is a^(b^c).
    fn power(&self, pair: Node<'_>) -> Expr {
        let mut inner = parts(pair);
        let Some(base) = inner.next() else { return self.expr_or_zero(None) };
        let mut operands = vec![self.postfix(base)];
        for pair in inner {
            if operands.len() > LONGEST_CHAIN {
                self.cut.set(Some(self.span(&pair)));
                break;
            }
            operands.push(self.signed(pair));
        }
        let exponents = operands.split_off(1);
        let exponent = exponents.into_iter().rev().reduce(|exponent, base| raised(base, exponent));
        let base = operands.remove(0);
        match exponent {
            Some(exponent) => raised(base, exponent),
            None => base,
        }
    }

    fn postfix(&self, pair: Node<'_>) -> Expr {
        let mut inner = parts(pair);
        let Some(primary) = inner.next() else { return self.expr_or_zero(None) };
        let mut result = self.primary(primary);
        for (link, pair) in inner.enumerate() {
            if link >= LONGEST_CHAIN {
                self.cut.set(Some(self.span(&pair)));
                break;
            }
            let span = result.span.to(self.span(&pair));
            let kind = if pair.as_rule() == Rule::superscript {
                let exponent = if pair.as_str() == "²" { 2.0 } else { 3.0 };
                let exponent = Expr { kind: ExprKind::Number(exponent), span: self.span(&pair) };
                ExprKind::Power { base: Box::new(result), exponent: Box::new(exponent) }
            } else if pair.as_rule() == Rule::component {
                let axis = match pair.as_str() {
                    ".x" => 0,
                    ".y" => 1,
                    _ => 2,
                };
                ExprKind::Component { vector: Box::new(result), axis }
            } else if pair.as_rule() == Rule::member {
                let name = self.name(parts(pair).next());
                ExprKind::Member { of: Box::new(result), name }
            } else if pair.as_rule() == Rule::index {
                let index = Box::new(self.expr_or_zero(parts(pair).next()));
                ExprKind::Index { list: Box::new(result), index }
            } else {
                let mut inner = parts(pair);
                let method = self.name(inner.next());
                ExprKind::Method {
                    receiver: Box::new(result),
                    method,
                    arguments: self.arguments(inner.next()),
                }
            };
            result = Expr { kind, span };
        }
        result
    }

    fn primary(&self, pair: Node<'_>) -> Expr {
        let span = self.span(&pair);
        let kind = match pair.as_rule() {
            Rule::number => ExprKind::Number(number(pair.as_str())),
            Rule::quantity => {
                let mut inner = parts(pair);
                let value = inner.next().map_or(0.0, |p| number(p.as_str()));
                ExprKind::Quantity { value, unit: self.name(inner.next()) }
            }
            Rule::text => ExprKind::Text(text_of(pair)),
            Rule::vector => ExprKind::Vector(parts(pair).map(|p| self.expr(p)).collect()),
            Rule::name => ExprKind::Name(pair.as_str().to_string()),
            Rule::group => {
                // the brackets belong to the span but not to the tree, whose shape already says how things
                // are grouped
                let inner = self.expr_or_zero(parts(pair).next());
                return Expr { span, ..inner };
            }
            Rule::call => {
                let mut inner = parts(pair);
                let function = self.name(inner.next());
                ExprKind::Call { function, arguments: self.arguments(inner.next()) }
            }
            Rule::choice => return self.choice(pair),
            _ => return self.fold(pair),
        };
        Expr { kind, span }
    }

    fn arguments(&self, pair: Option<Node<'_>>) -> Vec<Argument> {
        let Some(pair) = pair else { return Vec::new() };
        let argument = |pair: Node<'_>| {
            let mut inner = parts(pair).peekable();
            let name = inner.next_if(|p| p.as_rule() == Rule::name).map(|p| self.name(Some(p)));
            Argument { name, value: self.expr_or_zero(inner.next()) }
        };
        parts(pair).map(argument).collect()
    }

    /// `if condition then a else b`
    fn choice(&self, pair: Node<'_>) -> Expr {
        let span = self.span(&pair);
        let mut inner = parts(pair).filter(|p| p.as_rule() == Rule::expr);
        let condition = Box::new(self.expr_or_zero(inner.next()));
        let values = Box::new([self.expr_or_zero(inner.next()), self.expr_or_zero(inner.next())]);
        Expr { kind: ExprKind::Choice { condition, values }, span }
    }

    fn fold(&self, pair: Node<'_>) -> Expr {
        let span = self.span(&pair);
        let mut inner = parts(pair).filter(|p| p.as_rule() != Rule::kw_in);
        let word = inner.next();
        let is_written = |fold: &Fold| word.as_ref().is_some_and(|word| word.as_str() == fold.word());
        // the grammar has no other words
        let op = Fold::ALL_FOLDS.into_iter().find(is_written).unwrap_or(Fold::Any);
        let variable = self.name(inner.next());
        let (bounds, body): (Vec<_>, Vec<_>) = inner.partition(|p| p.as_rule() == Rule::sum);
        let mut bounds = bounds.into_iter().map(|p| Box::new(self.sum(p)));
        let members = match (bounds.next(), bounds.next()) {
            (Some(start), Some(end)) => Members::Range(start, end),
            (list, _) => Members::List(list.unwrap_or_else(|| Box::new(self.expr_or_zero(None)))),
        };
        let body = Box::new(self.expr_or_zero(body.into_iter().next()));
        Expr { kind: ExprKind::Fold { op, variable, members, body }, span }
    }
}

fn raised(base: Expr, exponent: Expr) -> Expr {
    let span = base.span.to(exponent.span);
    Expr { kind: ExprKind::Power { base: Box::new(base), exponent: Box::new(exponent) }, span }
}

fn logic(op: Logic, mut operands: Vec<Expr>) -> Expr {
    if operands.len() == 1 {
        return operands.remove(0);
    }
    let span = match (operands.first(), operands.last()) {
        (Some(first), Some(last)) => first.span.to(last.span),
        _ => Span::new(SourceId::File, 0, 0),
    };
    Expr { kind: ExprKind::Logic { op, operands }, span }
}

fn text_of(pair: Node<'_>) -> String {
    pair.into_inner().next().map_or_else(String::new, |body| body.as_str().to_string())
}

/// Reads a number. The grammar admits only what `f64` reads, except for a pasted minus sign in the exponent.
fn number(text: &str) -> f64 {
    text.replace('−', "-").parse().unwrap_or(f64::NAN)
}

/// The length of a text without the white space and the comments at its end.
fn length_of_code(text: &str) -> usize {
    if !text.contains('#') && !text.contains("//") {
        return text.trim_end().len();
    }
    let (mut end, mut is_quoted) = (0, false);
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let at = text.len() - rest.len();
        if !is_quoted && (c == '#' || rest.starts_with("//")) {
            let line = rest.find('\n').unwrap_or(rest.len());
            rest = &rest[line..];
            continue;
        }
        // a text ends with its line
        is_quoted = c != '\n' && (is_quoted != (c == '"'));
        rest = &rest[c.len_utf8()..];
        if !c.is_whitespace() {
            end = at + c.len_utf8();
        }
    }
    end
}

#[cfg(test)]
mod tests {
    use super::length_of_code;

    #[test]
    fn what_stands_behind_the_code_is_not_its_end() {
        for (text, code) in [
            ("a + b", "a + b"),
            ("a  \n\t", "a"),
            ("a # one\n  // two\n# three", "a"),
            ("a # one\n + b // two\n", "a # one\n + b"),
            ("mesh(\"a#b//c.stl\") # d \"e\"", "mesh(\"a#b//c.stl\")"),
            ("x² # é", "x²"),
            ("# nothing", ""),
            ("", ""),
        ] {
            assert_eq!(&text[..length_of_code(text)], code, "{text:?}");
        }
    }
}
