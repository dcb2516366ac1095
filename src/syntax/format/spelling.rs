//! How words, numbers and signs are spelt.

use super::super::tokens::{Begins, Kind, Powers, Token};

/// How signs with several spellings are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Spelling {
    /// Words and signs as they stand, except for slips and signs that are pasted from documents: `&&` becomes
    /// `and`, `−` becomes `-`.
    #[default]
    Written,
    /// By signs: `∧ ∨ ¬ ∖ ≤ ≥ ² ³`.
    Unicode,
    /// By ASCII letters: `and or not \ <= >= ^2 ^3`.
    Ascii,
}

/// Spells each token, and writes powers in the wanted way.
pub(super) fn apply(tokens: &mut Vec<Token>, powers: &Powers, spelling: Spelling) {
    match spelling {
        Spelling::Written => {}
        Spelling::Unicode => superscripts(tokens, powers),
        Spelling::Ascii => carets(tokens, powers),
    }
    even(tokens);
    for token in tokens {
        token.text = spelt(token, spelling);
        if matches!(token.kind, Kind::Not | Kind::NotSign) {
            token.kind = if token.text == "not" { Kind::Not } else { Kind::NotSign };
        }
    }
}

/// Blanks around `*` and `/` stand on both sides or on none.
fn even(tokens: &mut [Token]) {
    for i in 0..tokens.len() {
        let product = |token: &Token| token.kind == Kind::Product;
        if product(&tokens[i]) {
            // a unit in front would swallow the operator
            let unit = i > 0 && tokens[i - 1].kind == Kind::Quantity;
            let after = tokens.get(i + 1).is_some_and(|next| next.spaced && next.breaks == 0);
            let before = tokens[i].spaced && tokens[i].breaks == 0;
            let wrapped = tokens[i].breaks > 0 || tokens.get(i + 1).is_some_and(|next| next.breaks > 0);
            tokens[i].spaced = if wrapped { before || after } else { before || after || unit };
        }
    }
}

fn spelt(token: &Token, spelling: Spelling) -> String {
    let text = token.text.as_str();
    match token.kind {
        Kind::Number => number(text),
        Kind::Quantity => quantity(text, spelling),
        Kind::Version => text.split_whitespace().collect::<Vec<_>>().join(" "),
        Kind::Operator | Kind::Not | Kind::NotSign | Kind::Product | Kind::Sign => {
            sign(text, spelling).to_string()
        }
        Kind::Comment
        | Kind::Word
        | Kind::Text
        | Kind::Superscript
        | Kind::Power
        | Kind::Comma
        | Kind::Colon
        | Kind::Dot
        | Kind::FoldDots
        | Kind::OpenCall
        | Kind::Open
        | Kind::Close
        | Kind::OpenBrace
        | Kind::CloseBrace => text.to_string(),
    }
}

/// Signs with several spellings.
fn sign(text: &str, spelling: Spelling) -> &str {
    match (text, spelling) {
        ("and" | "∧", Spelling::Unicode) | ("∧", Spelling::Written) => "∧",
        ("or" | "∨", Spelling::Unicode) | ("∨", Spelling::Written) => "∨",
        ("&" | "&&", Spelling::Unicode) => "∧",
        ("|" | "||", Spelling::Unicode) => "∨",
        ("and" | "∧" | "&" | "&&", _) => "and",
        ("or" | "∨" | "|" | "||", _) => "or",
        ("not" | "¬" | "!", Spelling::Unicode) | ("¬", Spelling::Written) => "¬",
        ("not" | "¬" | "!", _) => "not",
        ("\\" | "∖", Spelling::Unicode) | ("∖", Spelling::Written) => "∖",
        ("\\" | "∖", _) => "\\",
        ("<=" | "≤" | "=<", Spelling::Unicode) | ("≤", Spelling::Written) => "≤",
        ("<=" | "≤" | "=<", _) => "<=",
        (">=" | "≥" | "=>", Spelling::Unicode) | ("≥", Spelling::Written) => "≥",
        (">=" | "≥" | "=>", _) => ">=",
        ("−", _) => "-",
        ("·" | "×", _) => "*",
        ("÷", _) => "/",
        (text, _) => text,
    }
}

/// A number with a digit on both sides of its point, or without a point.
fn number(text: &str) -> String {
    let text = text.replace('−', "-");
    let text = text.strip_suffix('.').unwrap_or(&text);
    match text.strip_prefix('.') {
        Some(digits) => format!("0.{digits}"),
        None => text.to_string(),
    }
}

fn quantity(text: &str, spelling: Spelling) -> String {
    // the number ends before the first letter that is not its exponent
    let is_exponent = |at: usize| {
        let rest = text[at + 1..].trim_start_matches(['+', '-', '−']);
        matches!(text.as_bytes()[at], b'e' | b'E') && rest.starts_with(|c: char| c.is_ascii_digit())
    };
    let is_unit = |&(at, c): &(usize, char)| c == '°' || c == 'µ' || (c.is_alphabetic() && !is_exponent(at));
    let split = text.char_indices().find(is_unit).map_or(text.len(), |(at, _)| at);
    let (value, unit) = (number(text[..split].trim_end()), text[split..].trim());
    let unit = match spelling {
        Spelling::Written | Spelling::Unicode => unit.to_string(),
        Spelling::Ascii => unit.replace('µ', "u").replace('°', "deg").replace('²', "^2").replace('³', "^3"),
    };
    if unit.starts_with('°') { format!("{value}{unit}") } else { format!("{value} {unit}") }
}

/// Replaces `^2` and `^3` by superscripts where the tree stays the same.
fn superscripts(tokens: &mut Vec<Token>, powers: &Powers) {
    let mut i = 1;
    while i < tokens.len() {
        let is_plain = tokens[i].kind == Kind::Number && tokens[i - 1].kind == Kind::Power;
        if is_plain && tokens[i].breaks == 0 && powers.to_superscript.contains(&tokens[i].start) {
            let sign = if tokens[i].text.starts_with('2') { "²" } else { "³" };
            let caret = tokens.remove(i - 1);
            let token = &mut tokens[i - 1];
            (token.kind, token.text) = (Kind::Superscript, sign.to_string());
            (token.breaks, token.spaced, token.column) = (caret.breaks, caret.spaced, caret.column);
        } else {
            i += 1;
        }
    }
}

/// Replaces superscripts by `^2` and `^3`, with brackets around what would be grouped otherwise.
fn carets(tokens: &mut Vec<Token>, powers: &Powers) {
    let old = std::mem::take(tokens);
    for mut token in old {
        if token.kind != Kind::Superscript {
            tokens.push(token);
            continue;
        }
        let digit = if token.text == "²" { "2" } else { "3" };
        let bracketed = powers.to_brackets.get(&token.start).copied();
        let part = |kind, text: &str| Token {
            kind,
            text: text.to_string(),
            breaks: 0,
            spaced: false,
            begins: Begins::Nothing,
            ..token.clone()
        };
        let (number, close) = (part(Kind::Number, digit), part(Kind::Close, ")"));
        if let Some(operand) = bracketed
            && let Some(at) = tokens.iter().rposition(|t| t.start == operand)
        {
            let first = &mut tokens[at];
            let open = Token { kind: Kind::Open, text: "(".into(), ..first.clone() };
            (first.breaks, first.spaced) = (0, false);
            first.begins = Begins::Nothing;
            tokens.insert(at, open);
        }
        (token.kind, token.text) = (Kind::Power, "^".to_string());
        tokens.extend([token, number]);
        if bracketed.is_some() {
            tokens.push(close);
        }
    }
}
