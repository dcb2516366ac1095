//! Pieces of a text that the grammar does not understand: its last word, the operand before a place, what stands in brackets.

use super::super::words::token_at;

/// Whether the text ends in a number rather than in a name such as `r2`.
pub(super) fn number_ends(text: &str) -> bool {
    let start = text
        .rfind(|c: char| !(c.is_alphanumeric() || c == '_' || c == '.'))
        .map_or(0, |at| at + text[at..].chars().next().map_or(1, char::len_utf8));
    text[start..].starts_with(|c: char| c.is_ascii_digit() || c == '.')
}

pub(super) fn last_number(text: &str) -> &str {
    &text[text.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.').len()..]
}

/// The words of a text, the last one first.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').rev()
}

/// Whether a text ends within the condition of an `if`. A line with a comment or a text in it is not looked at.
pub(super) fn is_condition(text: &str) -> bool {
    let line = text.rfind('\n').map_or(text, |end| &text[end..]);
    let last = words(line).find(|word| ["if", "then"].contains(word));
    !line.contains(['#', '"']) && last == Some("if")
}

pub(super) fn last_word(text: &str) -> &str {
    &text[text.trim_end_matches(|c: char| c.is_alphanumeric() || c == '_').len()..]
}

pub(super) fn last_number_or_word(text: &str) -> &str {
    last_word(text.trim_end())
}

/// Where the number or word ends that a text begins with, white space before it included.
pub(super) fn token_end(text: &str) -> usize {
    let blank = text.len() - text.trim_start().len();
    blank + token_at(text, blank, text.len()).len()
}

/// The first value of a line: up to a comma or a bracket that closes what was open before.
pub(super) fn first_part(line: &str) -> &str {
    let mut depth = 0_i32;
    for (at, c) in line.char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' if depth == 0 => return line[..at].trim(),
            ')' | ']' | '}' => depth -= 1,
            ',' | ';' | '#' if depth == 0 => return line[..at].trim(),
            _ => {}
        }
    }
    line.trim()
}

/// The bracket that a text opens last without closing it, if it is a round one.
pub(super) fn unclosed(text: &str) -> Option<usize> {
    last_open(text).filter(|(_, bracket)| *bracket == '(').map(|(at, _)| at)
}

/// The bracket that a text opens last without closing it, with its place.
pub(super) fn last_open(text: &str) -> Option<(usize, char)> {
    let mut open = Vec::new();
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' | '{' => open.push((at, c)),
            ')' | ']' | '}' => drop(open.pop()),
            _ => {}
        }
    }
    open.pop()
}

/// Where the round bracket ends that was open before a text.
pub(super) fn closing(text: &str) -> Option<usize> {
    let mut depth = 0;
    text.char_indices().find_map(|(at, c)| {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' if depth == 0 => return Some(at),
            ')' | ']' | '}' => depth -= 1,
            _ => {}
        }
        None
    })
}

/// The last operand of a text: what stands behind a bracket that is still open, a sign or a word that joins.
pub(super) fn last_part(text: &str) -> &str {
    // where the operand begins, and those around it
    let (mut start, mut around) = (0, Vec::new());
    for (at, c) in text.char_indices() {
        match c {
            '(' | '[' => {
                around.push(start);
                start = at + c.len_utf8();
            }
            ')' | ']' => start = around.pop().unwrap_or(start),
            '=' | ':' | ',' | '&' | '|' | '\\' | '<' | '>' | '∧' | '∨' | '≤' | '≥' => {
                start = at + c.len_utf8()
            }
            _ => {}
        }
        if [" and ", " or ", " not "].iter().any(|word| text[..at].ends_with(word)) {
            start = at;
        }
    }
    text[start..].trim()
}

/// The text between a bracket at the beginning and the one that closes it.
pub(super) fn bracketed(text: &str) -> Option<&str> {
    let inner = text.strip_prefix('(')?;
    let mut depth = 0_i32;
    for (at, c) in inner.char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' if depth == 0 => return Some(&inner[..at]),
            ')' | ']' => depth -= 1,
            _ => {}
        }
    }
    None
}

/// Where the bracket opens that closes at the end of a text.
pub(super) fn opening(text: &str) -> Option<usize> {
    let mut depth = 0_i32;
    for (at, c) in text.char_indices().rev() {
        match c {
            ')' => depth += 1,
            '(' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return Some(at);
        }
    }
    None
}

/// The parts of a list of arguments.
pub(super) fn parts(arguments: &str) -> Vec<&str> {
    let mut rest = arguments;
    let mut parts = Vec::new();
    while !rest.trim().is_empty() {
        let part = first_part(rest);
        parts.push(part);
        let end = rest.find(part).map_or(rest.len(), |at| at + part.len());
        rest = rest[end..].trim_start().get(1..).unwrap_or_default();
    }
    parts
}

/// Whether what the user wrote is short enough to be repeated in a message.
pub(super) fn fits(parts: &[&str]) -> bool {
    let length: usize = parts.iter().map(|part| part.len()).sum();
    length <= 100 && parts.iter().all(|part| !part.is_empty() && !part.contains(['\n', '`', '\u{1b}']))
}

/// A formula with a value in place of a name: in brackets, unless it stands alone between commas or brackets. The
/// name of an argument stays.
pub(super) fn replaced(formula: &str, name: &str, value: &str) -> String {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let mut written = String::new();
    let mut rest = formula;
    while let Some(at) = rest.find(name) {
        let (before, behind) = (&rest[..at], &rest[at + name.len()..]);
        written += before;
        let next = behind.trim_start();
        let names_an_argument = next.starts_with('=') && !next.starts_with("==");
        let is_name = !written.ends_with(|c: char| is_part(c) || c == '.')
            && !behind.starts_with(is_part)
            && !names_an_argument;
        let is_alone = |text: &str| text.is_empty() || text.ends_with(['(', '[', ',']);
        let ends = next.is_empty() || next.starts_with([')', ']', ',']);
        match (is_name, is_alone(written.trim_end()) && ends) {
            (false, _) => written += name,
            (true, true) => written += value,
            (true, false) => written += &format!("({value})"),
        }
        rest = behind;
    }
    written + rest
}
