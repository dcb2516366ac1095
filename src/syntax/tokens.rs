//! The tokens of a text that fits the grammar, comments included, with the place of each in the grammar.
//!
//! The grammar says where words, numbers and operators are. What stands between them can only be white space,
//! comments and punctuation of one character.

use std::collections::{HashMap, HashSet};

use pest::iterators::{Pair, Pairs};

use super::grammar::Rule;

/// What a token is to the layout of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Comment,
    Version,
    /// A name, a key or a keyword.
    Word,
    Number,
    /// A number with its unit.
    Quantity,
    Text,
    /// An operator with blanks on both sides: logic, comparisons, sums, and the `=` of definitions and arguments.
    Operator,
    /// `*` and `/`, with blanks or without, as they are written.
    Product,
    /// A sign in front of its operand.
    Sign,
    /// The word `not`.
    Not,
    /// A sign of negation in front of its operand.
    NotSign,
    Superscript,
    Power,
    Comma,
    Colon,
    /// The dot of a method or a component.
    Dot,
    /// The dots of a fold's range.
    FoldDots,
    /// A bracket that follows a name or a list without a blank.
    OpenCall,
    /// A bracket that groups, or begins a list.
    Open,
    Close,
    OpenBrace,
    CloseBrace,
}

impl Kind {
    /// Whether it is a bracket or a brace that opens.
    pub fn opens(self) -> bool {
        matches!(self, Self::OpenCall | Self::Open | Self::OpenBrace)
    }

    pub fn closes(self) -> bool {
        matches!(self, Self::Close | Self::CloseBrace)
    }
}

/// What begins with a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Begins {
    Nothing,
    Item,
    /// A setting or a block of a scene.
    Entry,
}

#[derive(Debug, Clone)]
pub(super) struct Token {
    pub kind: Kind,
    pub text: String,
    pub begins: Begins,
    /// Ends of lines between the token before it and this one.
    pub breaks: usize,
    /// Whether white space precedes it.
    pub spaced: bool,
    /// Its column in the text, in characters; a tabulator reaches to the next multiple of eight.
    pub column: usize,
    /// The column behind it in the text.
    pub end_column: usize,
    /// Its first byte.
    pub start: usize,
    /// Whether the layout joins the line of the text in which it stands to an earlier one.
    pub moved: bool,
}

/// Powers and superscripts that can be written in the other way, by the bytes at which their parts begin.
#[derive(Debug, Default)]
pub(super) struct Powers {
    /// Exponents `2` and `3` that a superscript can replace together with the `^` in front of them.
    pub to_superscript: HashSet<usize>,
    /// Superscripts that `^` and a number can replace as they stand.
    pub to_caret: HashSet<usize>,
    /// Other superscripts, each with the beginning of its operand, which needs brackets then.
    pub to_brackets: HashMap<usize, usize>,
}

/// The tokens of a text whose pairs the grammar gave.
pub(super) fn tokens(text: &str, pairs: Pairs<'_, Rule>) -> (Vec<Token>, Powers) {
    let mut reader = Reader { text, at: 0, measured: (0, 0), open: Vec::new(), found: Vec::new() };
    let mut powers = Powers::default();
    let mut leaf_end = 0;
    let mut begins: HashMap<usize, Begins> = HashMap::new();
    for pair in pairs.flatten() {
        let span = pair.as_span();
        if span.start() < leaf_end || pair.as_rule() == Rule::EOI {
            continue;
        }
        reader.punctuation(span.start());
        reader.close(span.start());
        match pair.as_rule() {
            Rule::power | Rule::exponent => powers.of(&pair),
            Rule::setting | Rule::block => {
                begins.insert(span.start(), Begins::Entry);
            }
            Rule::attribute | Rule::kw_solid => {
                begins.insert(span.start(), Begins::Item);
            }
            _ if reader.is_in_file() && pair.as_rule() != Rule::version => {
                begins.insert(span.start(), Begins::Item);
            }
            _ => {}
        }
        let whole = matches!(
            pair.as_rule(),
            Rule::version | Rule::quantity | Rule::text | Rule::or_op | Rule::and_op | Rule::not_op
        );
        if whole || (pair.clone().into_inner().next().is_none() && !may_be_empty(pair.as_rule())) {
            let kind = kind(pair.as_rule(), span.as_str(), reader.parent(span.start()));
            // rules end behind trailing white space
            let word = span.as_str().trim_end();
            leaf_end = span.start() + word.len();
            reader.push(kind, span.start(), leaf_end);
        } else {
            reader.open.push((span.end(), pair.as_rule()));
        }
    }
    reader.punctuation(text.len());
    let mut found = reader.found;
    for token in &mut found {
        token.begins = begins.get(&token.start).copied().unwrap_or(Begins::Nothing);
    }
    (found, powers)
}

/// Rules without a character of their own where nothing is written. A bracket between may still belong to them.
fn may_be_empty(rule: Rule) -> bool {
    matches!(rule, Rule::arguments | Rule::vector | Rule::file)
}

fn kind(rule: Rule, text: &str, parent: Rule) -> Kind {
    match rule {
        Rule::version => Kind::Version,
        Rule::number => Kind::Number,
        Rule::quantity => Kind::Quantity,
        Rule::text => Kind::Text,
        Rule::or_op | Rule::and_op | Rule::minus_op | Rule::compare_op | Rule::add_op | Rule::equals => {
            Kind::Operator
        }
        Rule::mul_op => Kind::Product,
        Rule::sign_op => Kind::Sign,
        Rule::not_op if text.starts_with("not") => Kind::Not,
        Rule::not_op => Kind::NotSign,
        Rule::superscript => Kind::Superscript,
        Rule::colon => Kind::Colon,
        Rule::dots if parent == Rule::fold => Kind::FoldDots,
        Rule::dots => Kind::Operator,
        Rule::open => Kind::OpenCall,
        Rule::close | Rule::close_vector => Kind::Close,
        Rule::open_brace => Kind::OpenBrace,
        Rule::close_brace => Kind::CloseBrace,
        // names, keys and keywords
        _ => Kind::Word,
    }
}

/// What a character between the grammar's tokens is.
fn mark(c: char, parent: Rule) -> Kind {
    match c {
        '(' if parent == Rule::group => Kind::Open,
        '(' => Kind::OpenCall,
        '[' if parent == Rule::index => Kind::OpenCall,
        '[' => Kind::Open,
        ',' => Kind::Comma,
        '.' => Kind::Dot,
        '^' => Kind::Power,
        ')' | ']' => Kind::Close,
        '{' => Kind::OpenBrace,
        '}' => Kind::CloseBrace,
        // the `=` of arguments and defaults
        _ => Kind::Operator,
    }
}

struct Reader<'t> {
    text: &'t str,
    /// How far the text has been read.
    at: usize,
    /// A byte, and its column.
    measured: (usize, usize),
    /// The rules around, each with its end.
    open: Vec<(usize, Rule)>,
    found: Vec<Token>,
}

impl Reader<'_> {
    fn close(&mut self, at: usize) {
        while self.open.last().is_some_and(|(end, _)| *end <= at) {
            self.open.pop();
        }
    }

    fn parent(&self, at: usize) -> Rule {
        self.open.iter().rev().find(|(end, _)| *end > at).map_or(Rule::file, |(_, rule)| *rule)
    }

    /// Whether only the whole file is around.
    fn is_in_file(&self) -> bool {
        matches!(self.open[..], [(_, Rule::file)])
    }

    /// Reads comments and punctuation up to a place.
    fn punctuation(&mut self, end: usize) {
        while let Some(c) = self.text.get(self.at..end).and_then(|rest| rest.chars().next()) {
            let start = self.at;
            if c == '#' || self.text[start..end].starts_with("//") {
                let line = self.text[start..end].find('\n').map_or(end, |length| start + length);
                let comment = self.text[start..line].trim_end();
                self.push(Kind::Comment, start, start + comment.len());
                self.at = line;
            } else if c.is_whitespace() || c == '\u{FEFF}' {
                self.at += c.len_utf8();
            } else {
                let kind = mark(c, self.parent(start));
                self.push(kind, start, start + c.len_utf8());
            }
        }
    }

    fn push(&mut self, kind: Kind, start: usize, end: usize) {
        let before = self.found.last().map_or(0, |token| token.start + token.text.len());
        let blank = &self.text[before..start];
        let column = self.column(start);
        self.found.push(Token {
            kind,
            text: self.text[start..end].to_string(),
            begins: Begins::Nothing,
            breaks: blank.matches('\n').count(),
            spaced: !blank.is_empty(),
            column,
            end_column: column + self.text[start..end].chars().count(),
            start,
            moved: false,
        });
        self.at = end;
    }

    /// The column of a byte behind those that were measured before.
    fn column(&mut self, byte: usize) -> usize {
        let (from, column) = self.measured;
        let column = self.text[from..byte].chars().fold(column, |column, c| match c {
            '\n' => 0,
            '\t' => column / 8 * 8 + 8,
            '\u{FEFF}' => column,
            _ => column + 1,
        });
        self.measured = (byte, column);
        column
    }
}

impl Powers {
    /// Looks at a power, or at an exponent within one.
    fn of(&mut self, pair: &Pair<'_, Rule>) {
        let parts: Vec<_> = pair.clone().into_inner().collect();
        let exponents: Vec<_> = parts.iter().filter(|part| part.as_rule() == Rule::exponent).collect();
        if let [exponent] = &exponents[..]
            && matches!(exponent.as_str().trim_end(), "2" | "3" | "2." | "3.")
        {
            self.to_superscript.insert(exponent.as_span().start());
        }
        let last = exponents.last().map(|exponent| exponent.as_span().start());
        for exponent in &exponents {
            let inner: Vec<_> = (*exponent).clone().into_inner().collect();
            if let [postfix] = &inner[..] {
                self.superscripts(postfix, last == Some(exponent.as_span().start()));
            } else if let Some(postfix) = inner.last() {
                self.superscripts(postfix, false);
            }
        }
        if pair.as_rule() == Rule::power
            && let Some(base) = parts.first()
        {
            self.superscripts(base, exponents.is_empty());
        }
    }

    /// Superscripts of one operand; the last of them may become a power as it stands if nothing binds more tightly.
    fn superscripts(&mut self, postfix: &Pair<'_, Rule>, may_end: bool) {
        let parts: Vec<_> = postfix.clone().into_inner().collect();
        for (i, part) in parts.iter().enumerate().filter(|(_, part)| part.as_rule() == Rule::superscript) {
            let at = part.as_span().start();
            if may_end && i + 1 == parts.len() {
                self.to_caret.insert(at);
            } else {
                self.to_brackets.insert(at, postfix.as_span().start());
            }
        }
    }
}
