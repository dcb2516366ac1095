//! Text from files, names and paths as a terminal may show it: no character of it moves the cursor, changes colours,
//! turns the direction of writing or hides.

use std::borrow::Cow;

/// Whether a terminal shows nothing for a character, or obeys it. Line ends and tabs are not among them.
pub fn is_hidden(c: char) -> bool {
    let invisible = matches!(c,
        '\u{ad}' | '\u{34f}' | '\u{61c}' | '\u{115f}'..='\u{1160}' | '\u{17b4}'..='\u{17b5}' | '\u{180e}'
        | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{3164}' | '\u{feff}'
        | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e0fff}');
    invisible || (c.is_control() && !matches!(c, '\n' | '\t'))
}

/// The text with hidden characters as `\u{…}`. Line ends and tabs stay.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return text.into();
    }
    escaped(text, is_hidden).into()
}

/// The text on one line: hidden characters, line ends and tabs as `\u{…}`, `\n` and `\t`.
pub fn printable_line(text: &str) -> Cow<'_, str> {
    let leaves_line = |c: char| is_hidden(c) || matches!(c, '\n' | '\t');
    if !text.contains(leaves_line) {
        return text.into();
    }
    escaped(text, leaves_line).into()
}

fn escaped(text: &str, is_escaped: impl Fn(char) -> bool) -> String {
    text.chars().fold(String::new(), |mut out, c| {
        match c {
            '\n' if is_escaped(c) => out.push_str("\\n"),
            c if is_escaped(c) => out.extend(c.escape_unicode()),
            c => out.push(c),
        }
        out
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_spelled_out() {
        assert_eq!(printable("\u{1b}[31mred\u{9b}0m"), "\\u{1b}[31mred\\u{9b}0m");
        assert_eq!(printable("a\u{202e}b\u{200b}c\u{feff}"), "a\\u{202e}b\\u{200b}c\\u{feff}");
        assert_eq!(printable("two\nlines\r"), "two\nlines\\u{d}");
        assert_eq!(printable_line("two\nlines\t"), "two\\nlines\\u{9}");
        assert!(matches!(printable("ω ≤ 0.5 °"), Cow::Borrowed(_)));
    }
}
