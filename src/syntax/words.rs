//! The words of the language, and where a word, a number or a sign ends in a text.

pub(super) const ITEM_WORDS: [&str; 6] = ["param", "let", "fn", "solid", "scene", "import"];

/// The words that cannot be names.
pub const KEYWORDS: [&str; 15] = [
    "param", "let", "fn", "solid", "scene", "import", "and", "or", "not", "any", "all", "in", "if", "then",
    "else",
];

/// The word, number or single character at a place in the text.
pub(super) fn token_at(text: &str, at: usize, end: usize) -> &str {
    let rest = &text[at..end.max(at)];
    let Some(first) = rest.chars().next() else { return "" };
    let wordy = |c: char| c.is_alphanumeric() || c == '_';
    if wordy(first) {
        let length = rest.find(|c: char| !wordy(c)).unwrap_or(rest.len());
        return &rest[..length];
    }
    if first.is_whitespace() || first.is_control() {
        return "";
    }
    &rest[..first.len_utf8()]
}
