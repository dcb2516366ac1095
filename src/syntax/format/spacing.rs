//! Blanks between two tokens of one line.

use super::super::tokens::{Kind, Token};

/// Blanks in front of a comment and of the text that describes a param.
const ASIDE: usize = 2;

/// The blanks between two neighbours on a line.
pub(super) fn between(a: &Token, b: &Token) -> usize {
    use Kind::{
        Close, CloseBrace, Colon, Comma, Comment, Dot, FoldDots, Not, NotSign, Open, OpenBrace, OpenCall,
        Operator, Power, Product, Quantity, Sign, Superscript, Text, Word,
    };
    match (a.kind, b.kind) {
        (_, Comment) => ASIDE,
        // what follows would become part of the unit
        (Quantity, Superscript | Power | Product) => 1,
        (Product, _) => usize::from(a.spaced),
        (_, Product) => usize::from(b.spaced),
        (OpenBrace, CloseBrace) => 0,
        (OpenCall | Open | Dot | Sign | NotSign | Power | FoldDots, _) => 0,
        (_, Comma | Colon | Dot | Close | Superscript | OpenCall | Power | FoldDots) => 0,
        (Comma | Colon | Operator | Not | OpenBrace, _) => 1,
        // a path is not a description
        (Word, Text) if a.text == "import" => 1,
        (_, Text) => ASIDE,
        _ => 1,
    }
}
