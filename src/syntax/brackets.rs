//! Brackets that a text opens and does not close, and where its code ends. Comments and quoted texts do not count.

use super::code::CodeChars;

/// An open bracket.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Open {
    /// Its place in the text.
    pub at: usize,
    pub bracket: char,
    /// What would close it.
    pub close: char,
}

/// What a pass over the characters of a text finds.
#[derive(Debug, Default)]
pub(super) struct Brackets {
    /// The open brackets, from the outermost on.
    pub open: Vec<Open>,
    /// The end of the last character that is neither white space nor in a comment.
    pub end: usize,
}

impl Brackets {
    pub fn of(text: &str) -> Self {
        let mut found = Self::default();
        for (at, c, end) in CodeChars::of(text) {
            match c {
                '(' => found.open.push(Open { at, bracket: c, close: ')' }),
                '[' => found.open.push(Open { at, bracket: c, close: ']' }),
                '{' => found.open.push(Open { at, bracket: c, close: '}' }),
                ')' | ']' | '}' => drop(found.open.pop()),
                _ => {}
            }
            if !c.is_whitespace() {
                found.end = end;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_texts_hold_no_brackets() {
        let text = "solid a = (x # (\n  or [1, \"](\", f(2)  // }\n# (\n";
        let found = Brackets::of(text);
        let open: Vec<(usize, char)> = found.open.iter().map(|open| (open.at, open.close)).collect();
        assert_eq!(open, [(10, ')'), (22, ']')]);
        assert_eq!(&text[..found.end], "solid a = (x # (\n  or [1, \"](\", f(2)");
        assert_eq!(Brackets::of("# all\n").end, 0);
        assert_eq!(Brackets::of("a \"ω").end, 5);
    }
}
