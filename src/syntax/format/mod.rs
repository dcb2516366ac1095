//! The layout of a file: the same tokens and line breaks with the blanks that belong between them.
//!
//! Line breaks are the writer's: lines are neither joined nor wrapped, and groups stay apart by one empty
//! line. Columns are kept where several lines share them, and wrapped lines stay under what they were put
//! under. Everything else is laid out again.
//!
//! What always holds: the result has the same tree and the same comments, and formatting it again changes nothing.

mod columns;
mod spacing;
mod spelling;

use pest::Parser;

pub use spelling::Spelling;

use super::ast::Ast;
use super::grammar::{EDITION, Grammar, Rule};
use super::parse::{on_large_stack, parse};
use super::print::print;
use super::tokens::{Begins, Kind, Token, tokens};
use crate::diagnostic::{Code, Diagnostic, Severity, Source, Span};

/// The text of a file in its layout, or why there is none: messages with an error among them.
pub fn format(source: &Source, spelling: Spelling) -> Result<String, Vec<Diagnostic>> {
    let (ast, messages) = parse(source);
    let broken: Vec<_> = messages.into_iter().filter(|m| m.severity == Severity::Error).collect();
    if broken.iter().any(|message| message.code != Code::EMPTY_FILE) {
        return Err(broken);
    }
    let text = on_large_stack(|| layout(&source.text, spelling)).ok_or_else(|| vec![bug(source)])?;
    let again = Source { text: text.as_str().into(), ..source.clone() };
    let (same, _) = parse(&again);
    let comments = |text: &str| on_large_stack(|| comments(text)).unwrap_or_default();
    if meaning(&ast) != meaning(&same) || comments(&source.text) != comments(&text) {
        return Err(vec![bug(source)]);
    }
    Ok(text)
}

/// The tree of a file as text, with one spelling of each unit.
fn meaning(ast: &Ast) -> String {
    print(ast).replace('°', "deg").replace('µ', "u").replace('²', "^2").replace('³', "^3")
}

/// The message if the layout would change the meaning of a file. No file is known for which it does.
fn bug(source: &Source) -> Diagnostic {
    let message = "the file cannot be formatted without changing its meaning";
    Diagnostic::error(Code::SYNTAX, Span::new(source.id, 0, 0), message)
        .help("this is a mistake of rfm: please report it with the file")
}

fn layout(text: &str, spelling: Spelling) -> Option<String> {
    let pairs = Grammar::parse(Rule::file, text).ok()?;
    let (mut tokens, powers) = tokens(text, pairs);
    spelling::apply(&mut tokens, &powers, spelling);
    if !tokens.iter().any(|token| token.kind == Kind::Version) {
        add_version(&mut tokens);
    }
    breaks(&mut tokens);
    let end = if text.contains("\r\n") { "\r\n" } else { "\n" };
    Some(columns::write(&tokens, end))
}

/// Puts the version line at the beginning, below comments that stand there.
fn add_version(tokens: &mut Vec<Token>) {
    let column = 0;
    let at = tokens.iter().position(|token| token.kind != Kind::Comment).unwrap_or(tokens.len());
    let start = tokens.get(at).map_or(0, |token| token.start);
    let begins = Begins::Nothing;
    let breaks = tokens.get(at).map_or(1, |token| token.breaks);
    let text = format!("rfm {EDITION}");
    tokens.insert(
        at,
        Token {
            kind: Kind::Version,
            text,
            begins,
            breaks,
            spaced: true,
            column,
            end_column: 0,
            start,
            moved: false,
        },
    );
}

/// Decides where lines end: as written, except for items on one line and for tokens that never begin a line.
fn breaks(tokens: &mut [Token]) {
    let mut before: Option<Kind> = None;
    // whether this part of a line stood on a line of its own
    let mut moved = false;
    for token in tokens {
        let (least, most) = match before {
            None => (0, 0),
            Some(Kind::Comment) => (1, 2),
            Some(Kind::Version) => (usize::from(token.kind != Kind::Comment), 2),
            Some(_) if token.begins == Begins::Item => (1, 2),
            Some(_) if matches!(token.kind, Kind::Comma | Kind::OpenBrace) => (0, 0),
            Some(before) if before.opens() || token.kind.closes() => (0, 1),
            Some(_) => (0, 2),
        };
        // no empty line below an opening bracket or above a closing one, comments or not
        let most = if before.is_some_and(Kind::opens) || token.kind.closes() { most.min(1) } else { most };
        moved = if token.breaks > 0 { most == 0 } else { moved };
        token.moved = moved;
        token.breaks = token.breaks.clamp(least, most);
        before = Some(token.kind);
    }
}

fn comments(text: &str) -> Option<Vec<String>> {
    let (tokens, _) = tokens(text, Grammar::parse(Rule::file, text).ok()?);
    Some(tokens.into_iter().filter(|token| token.kind == Kind::Comment).map(|token| token.text).collect())
}

#[cfg(test)]
mod tests;
