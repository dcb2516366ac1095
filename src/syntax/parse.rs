//! Runs the grammar, turns its failures into diagnostics and recovers at the next item.

use pest::Parser;
use pest::error::{Error, ErrorVariant, InputLocation};

use super::ast::Ast;
use super::brackets::Brackets;
use super::build;
use super::code::CodeChars;
use super::foreign;
use super::grammar::{Grammar, Rule};
use super::slips::{Slip, heads::begins_a_body};
use super::words::{ITEM_WORDS, KEYWORDS, token_at};
use crate::diagnostic::{Code, Diagnostic, Severity, Source, SourceId, Span};

/// Brackets nested deeper than this are refused. The limit is beyond what a person writes and well inside the
/// stack.
const DEEPEST_NESTING: usize = 200;

/// Stack of the parsing thread, in bytes: the same limit on every platform, and enough for
/// [`DEEPEST_NESTING`] in debug builds.
const STACK_BYTES: usize = 32 << 20;

/// Parses a text. Items that fit the grammar are returned even if others do not; the messages say which do
/// not.
pub fn parse(source: &Source) -> (Ast, Vec<Diagnostic>) {
    if source.text.len() > Source::MAX_LEN {
        let message =
            format!("the file has {} bytes; at most {} are read", source.text.len(), Source::MAX_LEN);
        return (
            Ast::default(),
            vec![Diagnostic::error(Code::TOO_LONG, Span::new(source.id, 0, 0), message)],
        );
    }
    let scan = Scan::of(&source.text);
    if let Some(at) = scan.too_deep {
        let span = Span::new(source.id, at, at + 1);
        let message = format!("brackets and folds nested more than {DEEPEST_NESTING} deep");
        let diagnostic = Diagnostic::error(Code::TOO_DEEP, span, message).help("name a part with `let`");
        return (Ast::default(), vec![diagnostic]);
    }
    on_large_stack(|| parse_here(source, &scan))
}

/// Runs what nests as deeply as a text on a thread with a stack for it.
pub(super) fn on_large_stack<T: Send>(work: impl Fn() -> T + Send + Sync) -> T {
    std::thread::scope(|scope| {
        let spawned = std::thread::Builder::new()
            .name("rfm-parse".into())
            .stack_size(STACK_BYTES)
            .spawn_scoped(scope, &work);
        match spawned.map(std::thread::ScopedJoinHandle::join) {
            Ok(Ok(done)) => done,
            Ok(Err(panic)) => std::panic::resume_unwind(panic),
            // if no thread can be started, the caller's own stack serves, and the grammar guards it
            Err(_) => work(),
        }
    })
}

fn parse_here(source: &Source, scan: &Scan) -> (Ast, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let ast = match Grammar::parse(Rule::file, &source.text) {
        Ok(pairs) => build::file(source, pairs, &mut diagnostics),
        Err(_) => recover(source, scan, &mut diagnostics),
    };
    let broken = diagnostics.iter().any(|d| d.severity == Severity::Error);
    if ast.items.is_empty() && !broken && source.id != SourceId::Prelude {
        let start = Span::new(source.id, 0, 0);
        let empty = Diagnostic::error(Code::EMPTY_FILE, start, "the file defines nothing")
            .help("write for example `solid ball = sphere(1)`; `rfm --help` has more");
        diagnostics = vec![empty];
    }
    (ast, diagnostics)
}

/// Parses item by item, so that one mistake does not hide the next.
fn recover(source: &Source, scan: &Scan, diagnostics: &mut Vec<Diagnostic>) -> Ast {
    let text = &source.text;
    let mut ast = Ast { text: source.text.clone(), ..Ast::default() };
    let mut starts = vec![0];
    starts.extend(scan.items.iter().copied().filter(|&at| at > 0));
    starts.push(text.len());
    let mut in_a_body = false;
    for (i, pair) in starts.windows(2).enumerate() {
        let (start, end) = (pair[0], pair[1]);
        let above = starts[i.saturating_sub(1)]..start;
        in_a_body = begins_a_body(&text[above]) || in_a_body && is_indented(text, start);
        let rule = if i == 0 { Rule::file } else { Rule::items };
        match Grammar::parse(rule, &text[start..end]) {
            Ok(pairs) if i == 0 => ast.items.extend(build::file(source, pairs, diagnostics).items),
            Ok(pairs) => ast.items.extend(build::items(source, start, pairs, diagnostics)),
            // the body of a function in several statements is one mistake
            Err(_) if in_a_body => {}
            Err(error) => diagnostics.push(syntax_error(source, start, end, &error)),
        }
    }
    if diagnostics.is_empty() {
        // every piece fits although the whole does not: report the error of the whole
        if let Err(error) = Grammar::parse(Rule::file, text) {
            diagnostics.push(syntax_error(source, 0, text.len(), &error));
        }
    }
    ast
}

/// Whether a place has nothing but blanks in front of it on its line, and some of them.
fn is_indented(text: &str, at: usize) -> bool {
    let line = text[..at].rsplit('\n').next().unwrap_or_default();
    !line.is_empty() && line.chars().all(char::is_whitespace)
}

fn syntax_error(source: &Source, start: usize, end: usize, error: &Error<Rule>) -> Diagnostic {
    let at = start
        + match error.location {
            InputLocation::Pos(at) => at,
            InputLocation::Span((at, _)) => at,
        };
    // at the end of an item, point behind its last character and not at a comment or at the next item
    let is_end = at >= end;
    let at = if is_end { start + Brackets::of(&source.text[start..end]).end } else { at };
    let found = token_at(&source.text, at, end);
    let span = Span::new(source.id, at, at + found.len());
    let expects_name = matches!(&error.variant, ErrorVariant::ParsingError { positives, .. }
        if positives.contains(&Rule::name) && !positives.contains(&Rule::number));
    let slip = Slip { text: &source.text, start, at, found, span };
    if let Some(diagnostic) = slip.operator_as_a_method() {
        return diagnostic;
    }
    if expects_name && KEYWORDS.contains(&found) && !ITEM_WORDS.contains(&found) {
        let message = format!("`{found}` is a word of the language and cannot be a name");
        return Diagnostic::error(Code::SYNTAX, span, message).help("choose another name");
    }
    let missing = missing_word(error);
    // what ends a condition in other languages lacks a word here, and a word or number may be a slip within it
    let explained = if missing.is_some() && ENDS_A_VALUE.contains(&found) { None } else { slip.explained() };
    if let Some(diagnostic) = explained {
        return diagnostic;
    }
    if let Some(word) = missing {
        let what = if found.is_empty() { "end of the item".to_string() } else { format!("`{found}`") };
        return Diagnostic::error(Code::SYNTAX, span, format!("unexpected {what}"))
            .at(format!("expected `{word}`"))
            .help(foreign::CONDITION);
    }
    let strange = source.text[at..end.max(at)].chars().next().filter(|c| c.is_control() && found.is_empty());
    let what = match strange {
        Some(c) if !c.is_whitespace() => format!("character U+{:04X}", c as u32),
        _ if found.is_empty() => "end of the item".to_string(),
        _ => format!("`{found}`"),
    };
    let expected = match &error.variant {
        ErrorVariant::ParsingError { positives, .. } => expectation(positives),
        ErrorVariant::CustomError { message } if message.contains("stack limit") => {
            return Diagnostic::error(Code::TOO_DEEP, span, "the expression is nested too deeply")
                .help("name a part with `let`");
        }
        ErrorVariant::CustomError { message } => message.clone(),
    };
    let open = Brackets::of(&source.text[start..at]).open.pop();
    let place = open.map(|open| Span::new(source.id, start + open.at, start + open.at + 1));
    if let (Some(open), Some(place), true) = (open, place, is_end) {
        return Diagnostic::error(Code::SYNTAX, place, format!("`{}` is not closed", open.bracket))
            .label(span, format!("the item ends here without `{}`", open.close));
    }
    let diagnostic = Diagnostic::error(Code::SYNTAX, span, format!("unexpected {what}"));
    let diagnostic =
        if expected.is_empty() { diagnostic } else { diagnostic.at(format!("expected {expected}")) };
    match (open, place) {
        // a bracket on an earlier line may be the one that should have been closed
        (Some(open), Some(place))
            if expected.contains(&format!("`{}`", open.close))
                && source.text[start + open.at..at].contains('\n') =>
        {
            diagnostic.label(place, format!("`{}` would close this", open.close))
        }
        _ => diagnostic,
    }
}

/// What ends the condition or the value of an `if` without its next word.
const ENDS_A_VALUE: [&str; 11] = ["", "{", "}", "[", "]", ")", ":", ",", ";", "?", "elif"];

/// The word that an `if` lacks where the grammar went no further.
fn missing_word(error: &Error<Rule>) -> Option<&'static str> {
    let ErrorVariant::ParsingError { positives, .. } = &error.variant else { return None };
    if positives.contains(&Rule::kw_then) {
        Some("then")
    } else if positives.contains(&Rule::kw_else) {
        Some("else")
    } else {
        None
    }
}

/// Rule names in the words of the language, each only once.
fn expectation(rules: &[Rule]) -> String {
    let mut words: Vec<&str> = Vec::new();
    let mut add = |word| {
        if !words.contains(&word) {
            words.push(word);
        }
    };
    let may_end = rules.contains(&Rule::EOI);
    // what must come is listed before what may come
    for rule in rules {
        match rule {
            Rule::equals => add("`=`"),
            Rule::colon => add("`:`"),
            Rule::dots => add("`..`"),
            Rule::open => add("`(`"),
            Rule::close => add("`)`"),
            Rule::close_vector => add("`]`"),
            Rule::open_brace => add("`{`"),
            Rule::kw_solid if rules.contains(&Rule::attribute_name) && !may_end => add("`solid`"),
            Rule::close_brace => add("`}`"),
            Rule::kw_as => add("`as`"),
            Rule::kw_in if !may_end => add("`in`"),
            Rule::kw_then => add("`then`"),
            Rule::kw_else => add("`else`"),
            Rule::version => add("`rfm 1`"),
            Rule::edition => add("the edition of the language, as in `rfm 1`"),
            Rule::axis => add("`x`, `y`, `z`, or the name of a method or of something imported"),
            Rule::text_body => add("a text"),
            _ => {}
        }
    }
    let axis = rules.contains(&Rule::axis);
    for rule in rules {
        match rule {
            Rule::or_op | Rule::and_op | Rule::minus_op | Rule::compare_op | Rule::add_op | Rule::mul_op => {
                add("an operator");
            }
            Rule::name | Rule::parameter if !axis && !rules.contains(&Rule::number) => add("a name"),
            Rule::key | Rule::block | Rule::setting => add("a key"),
            Rule::number
            | Rule::sign_op
            | Rule::expr
            | Rule::conjunction
            | Rule::negation
            | Rule::comparison
            | Rule::sum
            | Rule::product
            | Rule::signed
            | Rule::exponent
            | Rule::postfix => add("an expression"),
            Rule::unit if !may_end => add("a unit"),
            Rule::EOI => add("the next item"),
            _ => {}
        }
    }
    match words.split_last() {
        None => String::new(),
        Some((only, [])) => (*only).to_string(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
    }
}

/// One pass over the characters, before the grammar runs, finds the nesting depth and where items begin.
struct Scan {
    too_deep: Option<usize>,
    /// Where item keywords stand first on their line, outside braces.
    items: Vec<usize>,
}

impl Scan {
    fn of(text: &str) -> Self {
        let mut scan = Self { too_deep: None, items: Vec::new() };
        let mut nesting = Nesting::default();
        let mut line_blank = true;
        let mut in_word = false;
        // true after an attribute, before the item that it belongs to
        let mut attributed = false;
        for (at, c, _) in CodeChars::of(text) {
            let word_starts = !in_word && (c.is_alphabetic() || c == '_');
            in_word = c.is_alphanumeric() || c == '_';
            match c {
                '\n' => {
                    line_blank = true;
                    continue;
                }
                '@' if line_blank && nesting.braces == 0 => {
                    if !attributed {
                        scan.items.push(at);
                    }
                    attributed = true;
                }
                '(' | '[' | '{' => nesting.open(c == '{'),
                ')' | ']' | '}' => nesting.close(c == '}'),
                ',' => nesting.next_part(),
                _ if word_starts => {
                    let word = token_at(text, at, text.len());
                    if attributed && nesting.depth() == 0 && ITEM_WORDS.contains(&word) {
                        attributed = false; // this item began with its attribute
                    } else if line_blank && nesting.braces == 0 && ITEM_WORDS.contains(&word) {
                        attributed = false;
                        scan.items.push(at);
                        nesting = Nesting::default(); // an unclosed bracket above is that item's error
                    } else if takes_the_rest(word, &text[at..]) {
                        nesting.fold();
                    }
                }
                _ => {}
            }
            if nesting.depth() > DEEPEST_NESTING && scan.too_deep.is_none() {
                scan.too_deep = Some(at);
            }
            line_blank &= c.is_whitespace();
        }
        scan
    }
}

/// Whether a word begins a fold or a choice at this place, which take everything to their right. Those that are
/// functions as well do so in front of a name.
fn takes_the_rest(word: &str, from: &str) -> bool {
    match word {
        "any" | "all" | "if" => true,
        "sum" | "product" | "min" | "max" | "list" => {
            let rest = from[word.len()..].trim_start();
            rest.starts_with(|c: char| c.is_alphabetic() || c == '_')
        }
        _ => false,
    }
}

/// How deeply a place in the text is nested: in brackets, and in folds, which take everything to their right.
#[derive(Default)]
struct Nesting {
    /// Folds begun outside of all brackets.
    outside: usize,
    /// Folds begun in each open bracket.
    brackets: Vec<usize>,
    folds: usize,
    braces: usize,
}

impl Nesting {
    fn depth(&self) -> usize {
        self.brackets.len() + self.folds
    }

    fn open(&mut self, brace: bool) {
        self.brackets.push(0);
        self.braces += usize::from(brace);
    }

    fn close(&mut self, brace: bool) {
        self.folds -= self.brackets.pop().unwrap_or(0);
        self.braces = self.braces.saturating_sub(usize::from(brace));
    }

    fn fold(&mut self) {
        self.folds += 1;
        *self.brackets.last_mut().unwrap_or(&mut self.outside) += 1;
    }

    fn next_part(&mut self) {
        self.folds -= std::mem::take(self.brackets.last_mut().unwrap_or(&mut self.outside));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::syntax::print;

    fn tree(text: &str) -> String {
        let (ast, diagnostics) = parse(&Source::file("t.rfm", format!("rfm 1\n{text}")));
        assert!(diagnostics.is_empty(), "{diagnostics:?}");
        print(&ast)
    }

    #[test]
    fn chains_are_n_ary_and_parentheses_are_kept() {
        assert_eq!(tree("let a = x and y and z"), "let a\n  and/3\n    x\n    y\n    z\n");
        assert_eq!(tree("let a = x and (y and z)"), "let a\n  and/2\n    x\n    and/2\n      y\n      z\n");
        assert_eq!(tree("let a = x & y \\ z"), "let a\n  minus/2\n    and/2\n      x\n      y\n    z\n");
        assert_eq!(tree("let a = x ∧ y ∨ z"), tree("let a = (x and y) or z"));
    }

    #[test]
    fn a_minus_binds_weaker_than_a_power() {
        assert_eq!(tree("let a = -x^2"), "let a\n  negate\n    power\n      x\n      2\n");
        assert_eq!(tree("let a = 2^3^-x²"), tree("let a = 2^(3^(-(x²)))"));
        assert_eq!(tree("let a = - - x"), "let a\n  x\n");
    }

    #[test]
    fn ranges_methods_and_numbers_share_the_dot() {
        let text = tree("let a = any i in 0..6: ball(i).move([1., 0, .5])\nlet b = 2.move(1)");
        assert!(text.contains("fold any i\n    0\n    6\n"), "{text}");
        assert!(text.contains("method move\n    2\n"), "{text}");
    }

    #[test]
    fn attributes_belong_to_the_solid_below() {
        let text = "solid a = x\n@tolerance(1e-6)\nsolid b = y";
        assert_eq!(tree(text), "solid a\n  x\n@tolerance\n  0.000001\nsolid b\n  y\n");
        // the mistake above it does not swallow it
        let source = Source::file("t.rfm", "rfm 1\nlet c = 2 +\n@tolerance(1e-6)\nsolid b = y");
        let (ast, diagnostics) = parse(&source);
        assert_eq!((print(&ast).as_str(), diagnostics.len()), ("@tolerance\n  0.000001\nsolid b\n  y\n", 1));
        let source = Source::file("t.rfm", "rfm 1\n@tolerance(1e-6)\nlet c = 2\nsolid b = y");
        let (ast, diagnostics) = parse(&source);
        assert_eq!((ast.items.len(), diagnostics[0].message.as_str()), (1, "unexpected `let`"));
    }

    #[test]
    fn units_stay_on_their_line() {
        assert_eq!(tree("let a = 3 mm\nlet m = 2\nsolid s = x"), "let a\n  3 mm\nlet m\n  2\nsolid s\n  x\n");
    }
}
