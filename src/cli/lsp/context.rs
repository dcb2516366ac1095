//! Where in a text the cursor stands. The text is being typed, so nothing is expected to be complete.

use rfm::syntax::KEYWORDS;

use crate::cli::language::words::{ITEMS, is_of_a_word};

/// A bracket that is open at the cursor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Open {
    pub bracket: char,
    /// The word in front of it: a function, a method or the key of a block.
    pub word: String,
    /// Whether a dot stands in front of the word.
    pub is_method: bool,
    /// The name in front of that dot, if it is all that stands there: perhaps that of an import.
    pub owner: Option<String>,
    /// Commas so far between this bracket and the cursor, outside of others.
    pub commas: usize,
}

/// What surrounds the cursor.
#[derive(Debug, Default)]
pub(super) struct Context {
    /// The open brackets, the innermost last.
    pub open: Vec<Open>,
    /// The beginning of a word that ends at the cursor.
    pub prefix: String,
    /// Whether a dot stands in front of that word: a method is wanted.
    pub after_dot: bool,
    /// The name in front of that dot, if it is all that stands there: perhaps that of an import.
    pub owner: Option<String>,
    /// The key whose value is written, in a scene.
    pub key: Option<String>,
    /// Whether an item may begin here.
    pub begins_item: bool,
    /// Whether the cursor is in a comment or a text.
    pub is_quiet: bool,
    /// Parameters and variables of folds of the item so far.
    pub locals: Vec<String>,
}

impl Context {
    /// The words of the blocks around, the scene's own left out; `None` outside of scenes.
    pub fn block(&self) -> Option<Option<&str>> {
        let braces: Vec<&Open> = self.open.iter().filter(|open| open.bracket == '{').collect();
        match braces[..] {
            [] => None,
            [_] => Some(None),
            [.., last] => Some(Some(&last.word)),
        }
    }

    /// Whether a key may stand here.
    pub fn wants_key(&self) -> bool {
        self.open.last().is_some_and(|open| open.bracket == '{') && self.key.is_none()
    }

    /// The context of a byte.
    pub fn at(text: &str, byte: usize) -> Self {
        let text = text.get(..byte).unwrap_or("");
        let mut reader = Reader { context: Self::default(), tokens: Vec::new() };
        reader.read(&text[item_start(text)..]);
        reader.finish()
    }
}

/// Where the item of the text's end begins: at the last line that starts with the word of an item.
fn item_start(text: &str) -> usize {
    let mut start = 0;
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let word = line.split(|c: char| !is_of_a_word(c)).next().unwrap_or("");
        if ITEMS.iter().any(|(item, _)| *item == word) {
            start = at;
        }
        at += line.len();
    }
    start
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Word(String),
    Mark(char),
    LineEnd,
}

struct Reader {
    context: Context,
    tokens: Vec<Token>,
}

impl Reader {
    fn read(&mut self, text: &str) {
        let mut at = 0;
        while let Some(c) = text[at..].chars().next() {
            let rest = &text[at..];
            let length = if c == '#' || rest.starts_with("//") {
                let end = rest.find('\n');
                self.context.is_quiet = end.is_none();
                end.unwrap_or(rest.len())
            } else if c == '"' {
                let end = rest[1..].find(['"', '\n']);
                self.context.is_quiet = end.is_none();
                end.map_or(rest.len(), |end| end + 2)
            } else if is_of_a_word(c) {
                let end = rest.find(|c: char| !is_of_a_word(c)).unwrap_or(rest.len());
                self.word(&rest[..end], end == rest.len());
                end
            } else {
                match c {
                    '\n' => self.tokens.push(Token::LineEnd),
                    c if c.is_whitespace() => {}
                    c => self.mark(c),
                }
                c.len_utf8()
            };
            at += length;
        }
    }

    fn word(&mut self, word: &str, ends: bool) {
        if ends && !word.starts_with(|c: char| c.is_ascii_digit()) {
            self.context.prefix = word.to_string();
            return;
        }
        self.tokens.push(Token::Word(word.to_string()));
        // `any i in`, and the parameters between the name of a function and its `=`
        let before = |back: usize| self.tokens.len().checked_sub(back).and_then(|i| self.tokens.get(i));
        if word == "in"
            && let Some(Token::Word(variable)) = before(2)
        {
            self.context.locals.push(variable.clone());
        }
        let is_function = matches!(self.tokens.first(), Some(Token::Word(first)) if first == "fn");
        let in_header =
            is_function && self.context.open.len() == 1 && !self.tokens.contains(&Token::Mark(')'));
        if in_header && matches!(before(2), Some(Token::Mark('(' | ','))) {
            self.context.locals.push(word.to_string());
        }
    }

    fn mark(&mut self, c: char) {
        match c {
            '(' | '[' | '{' => {
                let words: Vec<&Token> =
                    self.tokens.iter().rev().take_while(|t| matches!(t, Token::Word(_))).collect();
                // `fluid water {`: the key stands in front of the label
                let word = match (c, &words[..]) {
                    (_, []) => String::new(),
                    ('{', [.., Token::Word(first)]) | (_, [Token::Word(first), ..]) => first.clone(),
                    _ => String::new(),
                };
                let is_method = self.tokens.iter().rev().nth(1) == Some(&Token::Mark('.'));
                let before = self.tokens.len().saturating_sub(1);
                let owner = is_method.then(|| lone_name(&self.tokens[..before])).flatten();
                self.context.open.push(Open { bracket: c, word, is_method, owner, commas: 0 });
                if c == '{' {
                    self.context.key = None;
                }
            }
            ')' | ']' | '}' => {
                self.context.open.pop();
                if c == '}' {
                    self.context.key = None;
                }
            }
            ',' => {
                if let Some(open) = self.context.open.last_mut() {
                    open.commas += 1;
                    if open.bracket == '{' {
                        self.context.key = None;
                    }
                }
            }
            ':' if self.context.open.last().is_some_and(|open| open.bracket == '{') => {
                if let Some(Token::Word(key)) = self.tokens.last()
                    && self.context.key.is_none()
                {
                    self.context.key = Some(key.clone());
                }
            }
            _ => {}
        }
        self.tokens.push(Token::Mark(c));
    }

    fn finish(mut self) -> Context {
        let last = self.tokens.iter().rev().find(|token| **token != Token::LineEnd);
        let on_new_line = matches!(self.tokens.last(), None | Some(Token::LineEnd));
        let ends_value = match last {
            None => true,
            Some(Token::Word(word)) => !KEYWORDS.contains(&word.as_str()),
            Some(Token::Mark(c)) => matches!(c, ')' | ']' | '}' | '"'),
            Some(Token::LineEnd) => false,
        };
        let two_dots = self.tokens.ends_with(&[Token::Mark('.'), Token::Mark('.')]);
        self.context.after_dot = self.tokens.last() == Some(&Token::Mark('.')) && !two_dots;
        if self.context.after_dot {
            self.context.owner = lone_name(&self.tokens);
        }
        self.context.begins_item = self.context.open.is_empty() && on_new_line && ends_value;
        // a value is at its end where a new line begins behind an operand
        if on_new_line && ends_value && self.context.open.last().is_some_and(|open| open.bracket == '{') {
            self.context.key = None;
        }
        self.context
    }
}

/// The name in front of a dot that is last, if no other dot stands before it.
fn lone_name(tokens: &[Token]) -> Option<String> {
    match tokens {
        [.., Token::Mark('.'), Token::Word(_), Token::Mark('.')] => None,
        [.., Token::Word(name), Token::Mark('.')] => Some(name.clone()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> Context {
        Context::at(text, text.len())
    }

    #[test]
    fn brackets_and_commas_are_counted() {
        let context = at("rfm 1\nsolid s = box([0, 1], sphere(1).mo");
        assert_eq!((context.prefix.as_str(), context.after_dot), ("mo", true));
        let open = context.open.last().unwrap();
        assert_eq!((open.word.as_str(), open.commas), ("box", 1));
        let context = at("let a = sphere(1).move([0, 0, 1], ");
        let open = context.open.last().unwrap();
        assert_eq!((open.word.as_str(), open.is_method, open.commas), ("move", true, 1));
        assert!(!at("let a = any i in 0..").after_dot);
        // exponents are signs of their own
        assert_eq!(at("let a = x²").prefix, "");
        assert_eq!(at("let a = x²an").prefix, "an");
    }

    #[test]
    fn a_name_alone_in_front_of_a_dot_is_known() {
        assert_eq!(at("solid s = chess.pa").owner.as_deref(), Some("chess"));
        assert_eq!(at("solid s = sphere(1) or chess.").owner.as_deref(), Some("chess"));
        for text in ["solid s = sphere(1).mo", "let a = chess.pawn.mo", "let a = 0..", "let a = chess"] {
            assert_eq!(at(text).owner, None, "{text}");
        }
        let owner_of_call = |text| at(text).open.last().unwrap().owner.clone();
        assert_eq!(owner_of_call("solid s = chess.rook(1, ").as_deref(), Some("chess"));
        for text in ["solid s = sphere(1).move(", "let a = chess.pawn.move(", "let a = rook("] {
            assert_eq!(owner_of_call(text), None, "{text}");
        }
    }

    #[test]
    fn scenes_want_keys_and_values() {
        assert!(at("scene s {\n  ").wants_key());
        assert_eq!(at("scene s {\n  ").block(), Some(None));
        assert_eq!(at("scene s { fluid water { den").block(), Some(Some("fluid")));
        let context = at("scene s { method: ");
        assert_eq!((context.wants_key(), context.key.as_deref()), (false, Some("method")));
        assert!(at("scene s { method: paper\n ").wants_key());
        assert!(at("scene s { box { max: [1, 1, 1] }\n gr").wants_key());
    }

    #[test]
    fn items_locals_and_comments_are_known() {
        assert!(at("rfm 1\nlet a = 1\nso").begins_item);
        assert!(!at("let a = 1 +\n").begins_item);
        assert_eq!(at("fn f(a, b = 1) = any i in 0..3: ").locals, ["a", "b", "i"]);
        assert!(at("let a = 1 # comm").is_quiet);
        assert!(at("param a = 1 \"te").is_quiet);
        assert!(!at("param a = 1 \"text\" ").is_quiet);
    }
}
