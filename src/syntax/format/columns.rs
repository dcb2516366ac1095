//! Where the lines of the layout begin, and which tokens share a column.
//!
//! Tokens that share a column keep sharing it: if blanks put a token into the column of a like token in
//! another line of the same paragraph, both stay in one column. A wrapped line stays under the token of an
//! earlier line below which it stands. Columns depend on each other only to the left and upwards, so a few
//! passes settle them all.

use std::collections::HashMap;

use super::super::tokens::{Begins, Kind, Token};
use super::spacing::between;

/// Blanks by which what is inside of something is indented.
const STEP: usize = 2;

/// Passes after which columns that are not settled are given up.
const MOST_PASSES: usize = 100;

/// Lines above a wrapped one in which its column is looked for.
const LINES_ABOVE: usize = 50;

/// Where a line begins.
#[derive(Debug, Clone, Copy)]
enum Indent {
    Fixed(usize),
    /// The given number of columns further in than the given line.
    Inside(usize, usize),
    /// In the column of a token, less a width; where that is no room, in the last column.
    Under(usize, usize, usize),
    /// In the column of the next line.
    AsNext,
}

struct Line {
    first: usize,
    end: usize,
    indent: Indent,
    paragraph: usize,
}

/// The text of the tokens.
pub(super) fn write(tokens: &[Token], line_end: &str) -> String {
    let lines = lines(tokens);
    let columns = columns(tokens, &lines);
    let mut out = String::new();
    for line in &lines {
        for _ in 0..if line.first == 0 { 0 } else { tokens[line.first].breaks } {
            out.push_str(line_end);
        }
        let mut at = 0;
        for i in line.first..line.end {
            out.extend(std::iter::repeat_n(' ', columns[i].saturating_sub(at)));
            out.push_str(&tokens[i].text);
            at = columns[i] + width(&tokens[i]);
        }
    }
    out.push_str(line_end);
    out
}

fn width(token: &Token) -> usize {
    token.text.chars().count()
}

/// A bracket that is open where a line begins.
struct Bracket {
    line: usize,
    /// Whether nothing but a comment follows it on its line.
    hangs: bool,
    brace: bool,
}

/// The lines, each with where it begins.
fn lines(tokens: &[Token]) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    let mut open: Vec<Bracket> = Vec::new();
    // the first line of the item or entry around, and where its value begins
    let (mut start, mut value) = (0, 0);
    let mut paragraph = 0;
    for (i, token) in tokens.iter().enumerate() {
        if i == 0 || token.breaks > 0 {
            paragraph += usize::from(token.breaks > 1);
            let indent = indent(tokens, &lines, &open, i, (start, value));
            lines.push(Line { first: i, end: i, indent, paragraph });
        }
        let here = lines.len() - 1;
        lines[here].end = i + 1;
        if token.begins != Begins::Nothing {
            (start, value) = (here, usize::MAX);
        }
        let is_sign = token.text == "=" || token.kind == Kind::Colon || token.kind == Kind::OpenCall;
        if value == usize::MAX && is_sign {
            value = i + 1;
        }
        if token.kind.opens() {
            let hangs = match tokens.get(i + 1) {
                Some(next) if next.kind == Kind::Comment => true,
                next => next.is_none_or(|next| next.breaks > 0),
            };
            open.push(Bracket { line: here, hangs, brace: token.kind == Kind::OpenBrace });
        } else if token.kind.closes() {
            open.pop();
        }
    }
    lines
}

/// Where the line begins whose first token this is. `around` is the first line of the item or entry, and the token with
/// which its value begins.
fn indent(tokens: &[Token], lines: &[Line], open: &[Bracket], i: usize, around: (usize, usize)) -> Indent {
    let token = &tokens[i];
    let depth = open.iter().filter(|bracket| bracket.brace).count();
    match token.kind {
        Kind::Comment => return comment(tokens, lines, i),
        Kind::CloseBrace => return Indent::Fixed(STEP * depth.saturating_sub(1)),
        Kind::Version => return Indent::Fixed(0),
        _ => {}
    }
    match token.begins {
        Begins::Item => return Indent::Fixed(0),
        Begins::Entry => return Indent::Fixed(STEP * depth),
        Begins::Nothing => {}
    }
    let (start, value) = around;
    let hanging = open.last().filter(|bracket| bracket.hangs && !bracket.brace);
    if let Some(bracket) = hanging.filter(|_| token.kind.closes()) {
        return Indent::Inside(bracket.line, 0);
    }
    // what stands directly behind `=` has nothing to stand under
    let above = hanging.map_or(start, |bracket| bracket.line + 1);
    let begins_value = i > 0 && (tokens[i - 1].kind == Kind::Colon || tokens[i - 1].text == "=");
    let plain = STEP * (depth + 1);
    if i > value
        && !begins_value
        && let Some((above, less)) = under(tokens, lines, i, above, value)
    {
        return Indent::Under(above, less, plain);
    }
    match hanging {
        Some(bracket) => Indent::Inside(bracket.line, STEP),
        None => Indent::Fixed(plain),
    }
}

/// A line of a comment alone: below a comment at the end of a line it continues that comment, otherwise it
/// belongs to what follows.
fn comment(tokens: &[Token], lines: &[Line], i: usize) -> Indent {
    let above = lines.last().map(|line| line.end - 1).filter(|_| tokens[i].breaks == 1);
    let goes_on = above.filter(|&last| {
        let is_first =
            lines.last().is_some_and(|line| line.first == last && !matches!(line.indent, Indent::Under(..)));
        tokens[last].kind == Kind::Comment && !is_first && tokens[last].column == tokens[i].column
    });
    goes_on.map_or(Indent::AsNext, |last| Indent::Under(last, 0, 0))
}

/// The token of an earlier line under which a line stands by its first token, or by what follows its first
/// operator, which has the width that comes second.
fn under(tokens: &[Token], lines: &[Line], i: usize, above: usize, value: usize) -> Option<(usize, usize)> {
    let first = &tokens[i];
    let second = tokens.get(i + 1).filter(|next| {
        next.breaks == 0
            && next.kind != Kind::Comment
            // what was put further away stands in a column of its own
            && next.column <= first.end_column + between(first, next)
            && matches!(first.kind, Kind::Operator | Kind::Product | Kind::Not | Kind::NotSign)
    });
    for line in lines[above.min(lines.len())..].iter().rev().take(LINES_ABOVE) {
        let in_column = |column: usize| {
            (line.first.max(value)..line.end).find(|&j| {
                let token = &tokens[j];
                // nothing stands under what ends an operand
                let ends = matches!(token.kind, Kind::Comma | Kind::Close | Kind::Colon | Kind::Comment);
                token.column == column && !token.moved && !ends
            })
        };
        if let Some(token) = in_column(first.column) {
            return Some((token, 0));
        }
        if let Some(next) = second
            && let Some(token) = in_column(next.column)
        {
            return Some((token, width(first) + between(first, next)));
        }
    }
    None
}

/// What may share a column: tokens of one class.
#[derive(Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Clone, Copy)]
enum Class<'t> {
    Comment,
    Text,
    /// What stands behind this sign; the name behind the word that an item or an entry begins with has none.
    Operand(&'t str),
    Mark(&'t str),
}

/// Signs whose operands share columns among themselves: the end of a range and the operand of an `and` stand below each
/// other by chance.
const SIGNS: [&str; 5] = ["=", "..", "in", ",", ":"];

/// The class of a token behind another. `None` if it follows that without a blank, or came from another line.
fn class<'t>(before: &Token, token: &'t Token) -> Option<Class<'t>> {
    if token.moved {
        return None;
    }
    match token.kind {
        Kind::Comment => Some(Class::Comment),
        Kind::Text => Some(Class::Text),
        Kind::Word if token.text == "in" => Some(Class::Mark("in")),
        Kind::Word | Kind::Number | Kind::Quantity | Kind::Sign | Kind::Open | Kind::Version => {
            let sign = SIGNS.into_iter().find(|sign| *sign == before.text);
            let other = if before.begins == Begins::Nothing { "other" } else { "" };
            Some(Class::Operand(sign.unwrap_or(other)))
        }
        Kind::Operator | Kind::Product | Kind::Not | Kind::NotSign | Kind::OpenBrace | Kind::CloseBrace => {
            Some(Class::Mark(&token.text))
        }
        Kind::Superscript
        | Kind::Power
        | Kind::Comma
        | Kind::Colon
        | Kind::Dot
        | Kind::FoldDots
        | Kind::OpenCall
        | Kind::Close => None,
    }
}

/// The tokens that share a column with each token, as the number of their group.
fn groups(tokens: &[Token], lines: &[Line]) -> Vec<Option<usize>> {
    let mut members: HashMap<(usize, usize, usize, Class<'_>), Vec<usize>> = HashMap::new();
    let mut depth = 0;
    for line in lines {
        let inside = depth;
        for token in &tokens[line.first..line.end] {
            match token.kind {
                Kind::OpenBrace => depth += 1,
                Kind::CloseBrace => depth = usize::saturating_sub(depth, 1),
                _ => {}
            }
        }
        // what follows an operator at the beginning goes with it
        let leads =
            matches!(tokens[line.first].kind, Kind::Operator | Kind::Product | Kind::Not | Kind::NotSign);
        for i in line.first + 1 + usize::from(leads)..line.end {
            // what is written without a blank, as after a comma, stands in its column by chance
            let is_apart = tokens[i].column > tokens[i - 1].end_column;
            let blank = is_apart && between(&tokens[i - 1], &tokens[i]) > 0;
            if let Some(class) = class(&tokens[i - 1], &tokens[i]).filter(|_| blank) {
                // lines of different depth are moved apart, and only comments stay in one column beside them
                let within = if class == Class::Comment { 0 } else { inside };
                members.entry((line.paragraph, tokens[i].column, within, class)).or_default().push(i);
            }
        }
    }
    let mut found = vec![None; tokens.len()];
    let padded = |&i: &usize| {
        let before = &tokens[i - 1];
        tokens[i].column > before.end_column + between(before, &tokens[i])
    };
    let shared = members.into_values().filter(|group| group.len() > 1 && group.iter().any(padded));
    for (number, group) in shared.enumerate() {
        for i in group {
            found[i] = Some(number);
        }
    }
    found
}

/// The column of each token.
fn columns(tokens: &[Token], lines: &[Line]) -> Vec<usize> {
    let groups = groups(tokens, lines);
    let none = || settled(tokens, lines, &vec![None; tokens.len()]).unwrap_or_else(|| vec![0; tokens.len()]);
    let mut columns = settled(tokens, lines, &groups).unwrap_or_else(none);
    let mut next = 0;
    for line in lines.iter().rev() {
        if matches!(line.indent, Indent::AsNext) {
            columns[line.first] = next;
        } else {
            // a comment in front of a bracket that closes belongs to what is inside
            next = columns[line.first] + if tokens[line.first].kind.closes() { STEP } else { 0 };
        }
    }
    columns
}

/// The columns of all tokens but of comments that stand alone. `None` if groups push each other on and on.
fn settled(tokens: &[Token], lines: &[Line], groups: &[Option<usize>]) -> Option<Vec<usize>> {
    let mut shared = vec![0; groups.iter().flatten().max().map_or(0, |most| most + 1)];
    let mut columns = vec![0; tokens.len()];
    for _ in 0..MOST_PASSES {
        let before = (columns.clone(), shared.clone());
        for line in lines {
            columns[line.first] = match line.indent {
                Indent::Fixed(column) => column,
                Indent::Inside(line, more) => columns[lines[line].first] + more,
                Indent::Under(token, less, plain) => columns[token].checked_sub(less).unwrap_or(plain),
                // done in the end, because nothing depends on it
                Indent::AsNext => 0,
            };
            for i in line.first + 1..line.end {
                let natural = columns[i - 1] + width(&tokens[i - 1]) + between(&tokens[i - 1], &tokens[i]);
                columns[i] = match groups[i] {
                    Some(group) => {
                        shared[group] = natural.max(shared[group]);
                        shared[group]
                    }
                    None => natural,
                };
            }
        }
        if before == (columns.clone(), shared.clone()) {
            return Some(columns);
        }
    }
    None
}
