//! Mistakes that deserve a better message than a list of what the grammar would accept: most of them are
//! habits from another language.

pub(super) mod heads;
mod openscad;
mod pieces;
mod ranges;
mod units;

use self::pieces::{
    bracketed, closing, first_part, fits, is_condition, last_number, last_number_or_word, last_part,
    last_word, number_ends, parts, token_end, unclosed, words,
};
use super::block_form::block_form;
use super::foreign;
use super::words::{ITEM_WORDS, KEYWORDS};
use crate::diagnostic::{Code, Diagnostic, Span, nearest};

/// A place in the text where the grammar went no further.
pub(super) struct Slip<'t> {
    pub text: &'t str,
    /// The first byte of the item that the place belongs to.
    pub start: usize,
    pub at: usize,
    /// The word, number or character at the place; empty at the end of the item.
    pub found: &'t str,
    pub span: Span,
}

impl<'t> Slip<'t> {
    /// The message for this slip; `None` if it is not one of those known here.
    pub fn explained(&self) -> Option<Diagnostic> {
        let first = self.escaped_quote().or_else(|| self.body_of_statements());
        let first = first.or_else(|| self.item_in_braces());
        let first = first.or_else(|| self.unit_of_a_vector());
        let first = first.or_else(|| self.unit_taken_for_a_key()).or_else(|| self.import());
        if first.is_some() {
            return first;
        }
        if matches!(last_word(self.on_its_line().trim_end()), "when" | "case") {
            return Some(self.syntax("a choice is written with `if`").help(foreign::CONDITION));
        }
        if self.found == ","
            && unclosed(self.before()).is_some_and(|open| last_word(self.before()[..open].trim_end()) == "if")
        {
            return Some(self.unexpected().help(foreign::CONDITION));
        }
        if self.found.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_') {
            return self.word();
        }
        self.comment().or_else(|| self.equals()).or_else(|| self.mark())
    }

    /// The text of the item in front of the place, without white space at its end.
    fn before(&self) -> &'t str {
        self.text[self.start.min(self.at)..self.at].trim_end()
    }

    /// The text behind what was found.
    fn after(&self) -> &'t str {
        &self.text[self.at + self.found.len()..]
    }

    fn on_its_line(&self) -> &'t str {
        let line_start = self.text[..self.at].rfind('\n').map_or(0, |n| n + 1);
        &self.text[line_start..self.at]
    }

    fn syntax(&self, message: impl Into<String>) -> Diagnostic {
        Diagnostic::error(Code::SYNTAX, self.span, message)
    }

    fn unexpected(&self) -> Diagnostic {
        self.syntax(format!("unexpected `{}`", self.found))
    }

    fn in_braces(&self) -> bool {
        let opened = self.before().matches('{').count();
        opened > self.before().matches('}').count()
    }

    /// Whether what stands before defines this name as a solid.
    fn defines(&self, name: &str) -> bool {
        let all: Vec<&str> = self.text[..self.at].split_whitespace().collect();
        all.windows(2).any(|pair| pair[0] == "solid" && pair[1].trim_end_matches('=') == name)
    }

    /// A word where none may stand.
    fn word(&self) -> Option<Diagnostic> {
        let called = self.after().starts_with('(');
        if self.found == "import" && called {
            let path = bracketed(self.after()).filter(|path| fits(&[path]) && path.contains('"'));
            let path = path.map_or("\"part.stl\"", str::trim);
            return Some(
                self.unexpected()
                    .help(format!("a mesh from a file is a shape, as in `solid part = mesh({path})`")),
            );
        }
        if self.found == "import" && !self.on_its_line().trim().is_empty() {
            return self.import_as_a_value();
        }
        if let Some(known) = self.function_without_a_name() {
            return Some(known);
        }
        if KEYWORDS.contains(&self.found) && called && !self.ends_an_operand() {
            return self.operator_as_a_function();
        }
        if let Some(known) = self.word_behind_a_value().or_else(|| self.argument_without_brackets()) {
            return Some(known);
        }
        if self.on_its_line().trim().is_empty() {
            return Some(self.first_word());
        }
        if let Some(help) = foreign::operator(self.found).filter(|_| self.ends_an_operand()) {
            return Some(self.syntax(format!("there is no operator `{}`", self.found)).help(help));
        }
        let line = self.on_its_line().trim_end();
        if !called && line.ends_with(|c: char| c.is_ascii_digit() || c == '.') && number_ends(line) {
            return Some(self.unit(last_number(line)));
        }
        if !called && self.ends_an_operand() {
            let diagnostic = self.unit_of_a_formula(line, self.found, self.span);
            if diagnostic.is_some() {
                return diagnostic;
            }
        }
        if matches!(last_word(line), "NOT" | "Not") {
            return Some(self.syntax("there is no operator `NOT`").help("write `not a`"));
        }
        if last_word(line) == "for" {
            return Some(self.fold_with_for());
        }
        if let Some(fold) = self.fold_without_a_colon() {
            return Some(fold);
        }
        if called && line.ends_with(')') {
            return self.transform_in_front();
        }
        None
    }

    /// `solid part = import "part.stl"`
    fn import_as_a_value(&self) -> Option<Diagnostic> {
        let path = self.after().trim_start().strip_prefix('"')?.split(['"', '\n']).next()?;
        let path = if fits(&[path]) { path } else { "part.stl" };
        let help = match is_a_mesh(path) {
            true => format!("a mesh from a file is a shape, as in `solid part = mesh(\"{path}\")`"),
            false => format!(
                "files are imported on a line of their own, as in `import \"{path}\" as parts`; their solids are \
                 then `parts.…`"
            ),
        };
        Some(self.unexpected().help(help))
    }

    /// Whether the text in front of the place ends an operand, so that an operator may follow.
    fn ends_an_operand(&self) -> bool {
        self.before()
            .ends_with(|c: char| c.is_alphanumeric() || matches!(c, ')' | ']' | '_' | '²' | '³' | '°'))
            && !KEYWORDS.contains(&last_word(self.before()))
    }

    /// `and(a, b)`
    fn operator_as_a_function(&self) -> Option<Diagnostic> {
        let word = self.found;
        if !["and", "or"].contains(&word) {
            return None;
        }
        let written = match bracketed(self.after()).map(parts) {
            Some(parts) if parts.len() > 1 && fits(&parts) => {
                let operands: Vec<String> = parts.into_iter().map(foreign::operand).collect();
                operands.join(&format!(" {word} "))
            }
            _ => format!("a {word} b"),
        };
        Some(
            self.unexpected()
                .at(format!("`{word}` stands between its operands"))
                .help(format!("write `{written}`")),
        )
    }

    /// `a.and(b)`
    pub fn operator_as_a_method(&self) -> Option<Diagnostic> {
        let receiver = self.before().strip_suffix('.').filter(|_| ["and", "or"].contains(&self.found))?;
        let (left, right) = (last_part(receiver), bracketed(self.after())?.trim());
        let written = match fits(&[left, right]) {
            true => format!("{} {} {}", foreign::operand(left), self.found, foreign::operand(right)),
            false => format!("a {} b", self.found),
        };
        let at = format!("`{}` stands between its operands", self.found);
        Some(self.unexpected().at(at).help(format!("write `{written}`")))
    }

    /// An `import` without a name, or without quotes.
    fn import(&self) -> Option<Diagnostic> {
        let line = self.text[self.start..].trim_start().strip_prefix("import")?;
        if self.before().contains('\n') {
            return None;
        }
        let line = line.lines().next().unwrap_or_default();
        let word = line.split_whitespace().next().filter(|word| word.contains('.') && fits(&[word]));
        let quoted = line.split('"').nth(1).or(word).unwrap_or("chess.rfm");
        let stem = quoted.rsplit(['/', '\\']).next().unwrap_or(quoted).split('.').next().unwrap_or(quoted);
        let is_name = stem.starts_with(|c: char| c.is_alphabetic())
            && stem.chars().all(|c| c.is_alphanumeric() || c == '_')
            && !KEYWORDS.contains(&stem);
        let name = if is_name { stem } else { "part" };
        let message = "an import has a path in quotes and a name";
        Some(self.syntax(message).help(if is_a_mesh(quoted) {
            format!("a mesh is a solid, as in `solid {name} = mesh(\"{quoted}\")`")
        } else {
            format!("as in `import \"{quoted}\" as {name}`; its solids are then `{name}.…`")
        }))
    }

    /// A word that begins a line but no item.
    fn first_word(&self) -> Diagnostic {
        let word = self.found;
        let after = self.after().trim_start_matches([' ', '\t']);
        if let Some(diagnostic) = self.block_without_braces().or_else(|| self.loop_of_its_own()) {
            return diagnostic;
        }
        if let Some(help) = foreign::item(word) {
            return self.unexpected().help(help);
        }
        if !after.starts_with('(')
            && let Some(item) = nearest(word, ITEM_WORDS)
        {
            return self.unexpected().help(format!("did you mean `{item}`?"));
        }
        if after.starts_with('=') && !after.starts_with("==") {
            let line = after[1..].lines().next().unwrap_or_default().trim().trim_end_matches(';');
            return self.unexpected().at("expected an item").help(format!(
                "a definition begins with `let`, `param` or `solid`: write `let {word} = {line}`"
            ));
        }
        if let Some(arguments) = bracketed(after) {
            let call = format!("{word}({arguments})");
            let call = if fits(&[&call]) { call } else { format!("{word}(…)") };
            return self
                .unexpected()
                .at("expected an item")
                .help(format!("a shape needs a name: write `solid part = {call}`"));
        }
        self.unexpected()
            .at("expected an item or the rest of the one above")
            .help("items start with `param`, `let`, `fn`, `solid` or `scene`")
    }

    fn comment(&self) -> Option<Diagnostic> {
        let rest = &self.text[self.at..];
        let begins = rest.starts_with("/*") || rest.starts_with("*/");
        let within = self.text[..self.at].ends_with('/') && rest.starts_with('*');
        let other = rest.starts_with("--") || rest.starts_with("(*") || rest.starts_with("<!--");
        let declared = rest.starts_with('%') && self.on_its_line().trim().is_empty();
        (begins || within || (other && self.on_its_line().trim().is_empty()) || declared).then(|| {
            let found = if within { "/*" } else { rest.get(..2).unwrap_or(self.found) };
            let start = if within { self.at - 1 } else { self.at };
            let span = Span::new(self.span.source, start, start + found.trim_end().len());
            let message = format!("`{}` does not begin a comment", found.trim_end());
            Diagnostic::error(Code::SYNTAX, span, message)
                .help("a comment begins with `#` and ends with its line")
        })
    }

    /// `=` where something else is meant.
    fn equals(&self) -> Option<Diagnostic> {
        if self.found != "=" {
            return None;
        }
        let before = self.before();
        if ITEM_WORDS.contains(&last_word(before)) {
            return None;
        }
        if let Some(start) = before.strip_suffix("..") {
            return Some(self.closed_range(last_number_or_word(start)));
        }
        if let Some(fold) = self.fold_with_equals() {
            return Some(fold);
        }
        let value = self.after().trim_start();
        let key = last_word(before);
        let heads = before.trim_end_matches(key).trim_end();
        let begins_scene = last_word(heads) == "scene";
        if value.starts_with('{') && (self.in_braces() || begins_scene) {
            let kind = if begins_scene { "scene " } else { "" };
            return Some(self.syntax("a block has no `=`").help(format!("write `{kind}{key} {{ … }}`")));
        }
        if self.in_braces() && !key.is_empty() && !heads.ends_with(['(', '=', '<', '>', '+', '*', ':']) {
            let line = value.lines().next().unwrap_or_default();
            let value = first_part(line);
            let value = if value.is_empty() || !fits(&[value]) { "…" } else { value };
            let solid = if value.starts_with('"') { &format!("mesh({value})") } else { value };
            let (message, written) = match block_form(key, solid, self.defines(value)) {
                Some(block) => ("a block has no `=`", block),
                None => ("a key and its value are joined by `:`", format!("{key}: {value}")),
            };
            return Some(self.syntax(message).help(format!("write `{written}`")));
        }
        if before.ends_with([':', '+', '-', '*', '/', '^']) {
            return Some(self.unexpected().help("a definition is written `let a = 1`, and never changed"));
        }
        let (left, right) = (last_part(before), first_part(value.lines().next().unwrap_or_default()));
        let compared = |sign: &str| match fits(&[left, right]) {
            true => format!("`{left} {sign} {right}`"),
            false => format!("`a {sign} b`"),
        };
        let of_space = |text: &str| words(text).any(|word| matches!(word, "x" | "y" | "z"));
        if is_condition(before) && !of_space(left) && !of_space(right) {
            let help = format!("write {} between numbers", compared("=="));
            return Some(Diagnostic::error(Code::EQUALITY, self.span, "`=` does not compare").help(help));
        }
        let (below, above) = (compared("<="), compared(">="));
        let help = format!("write {below} or {above}: each is the part of space on one side of a surface");
        Some(Diagnostic::error(Code::EQUALITY, self.span, "`=` does not compare").help(help))
    }

    /// `1'000`
    fn grouped_digits(&self) -> Diagnostic {
        let behind = self.after();
        let end =
            behind.find(|c: char| !(c.is_ascii_digit() || c == '\'' || c == '.')).unwrap_or(behind.len());
        let digits: String = behind[..end].chars().filter(|c| *c != '\'').collect();
        let number = last_number(self.before());
        self.unexpected().help(format!("digits are not grouped: write `{number}{digits}`"))
    }

    /// `0..=5`
    fn closed_range(&self, start: &str) -> Diagnostic {
        let end = last_number_or_word(&self.after()[..token_end(self.after())]);
        let one_more = match end.parse::<u64>().ok().and_then(|end| end.checked_add(1)) {
            Some(end) => format!("{start}..{end}"),
            None if end.is_empty() => "0..6".to_string(),
            None => format!("{start}..{end} + 1"),
        };
        self.unexpected().at("a range ends before its second number").help(format!("write `{one_more}`"))
    }

    /// `solid s { sphere(1) }`
    fn solid_in_braces(&self) -> Option<Diagnostic> {
        let heads = self.before().trim_end_matches('=').trim_end();
        let name = last_word(heads);
        if last_word(heads.strip_suffix(name)?.trim_end()) != "solid" {
            return None;
        }
        let inner = self.after().split('}').next().unwrap_or_default().trim();
        let shape = if fits(&[inner]) && !inner.contains([';', '{']) { inner } else { "sphere(1)" };
        Some(self.unexpected().help(format!("a solid has no braces: write `solid {name} = {shape}`")))
    }

    /// `(1, 0, 0)` in place of `[1, 0, 0]`
    fn vector_in_brackets(&self) -> Option<Diagnostic> {
        let before = self.before();
        let open = unclosed(before).filter(|_| self.found == ",")?;
        let callee = last_word(before[..open].trim_end());
        // a comma within a call separates its arguments
        if !(callee.is_empty() || KEYWORDS.contains(&callee)) {
            return None;
        }
        let behind = &self.text[self.at..];
        let inner = [&before[open + 1..], behind[..closing(behind)?].trim_end()].concat();
        let is_vector = !inner.contains(['\n', ';']) && matches!(inner.split(',').count(), 2 | 3);
        is_vector.then(|| self.unexpected().help(format!("a vector has square brackets: write `[{inner}]`")))
    }

    /// `param a = 1 0..2`
    fn range_without_in(&self) -> Option<Diagnostic> {
        let before = self.on_its_line().trim_end();
        let is_param = before.trim_start().starts_with("param ") && before.contains('=');
        let line = self.text[self.at..].lines().next().unwrap_or_default();
        let range = line.split(['"', '#']).next().unwrap_or_default().trim();
        let is_range = self.found.starts_with(|c: char| c.is_ascii_digit()) && range.contains("..");
        (is_param && is_range).then(|| {
            self.unexpected()
                .help(format!("a range follows `in`: write `{} in {range}`", before.trim_start()))
        })
    }

    /// `sphere { <0, 0, 0>, 1 }`
    fn arguments_in_braces(&self) -> Option<Diagnostic> {
        let called = last_word(self.before());
        let inner = self.after().split_once('}')?.0.trim();
        let is_call = self.found == "{" && !called.is_empty() && !KEYWORDS.contains(&called);
        if !is_call || self.in_braces() || inner.is_empty() || inner.contains(['\n', ';', '{', '(', ':']) {
            return None;
        }
        let inner = inner.replace('<', "[").replace('>', "]");
        // a sphere with a centre is a ball
        let called = if called == "sphere" && inner.starts_with('[') { "ball" } else { called };
        Some(self.unexpected().help(format!("arguments have round brackets: write `{called}({inner})`")))
    }

    /// A character that has no meaning where it stands.
    fn mark(&self) -> Option<Diagnostic> {
        let (before, after) = (self.before(), self.after());
        if let Some(known) = self.dots_in_square_brackets() {
            return Some(known);
        }
        if let Some(known) = self.range_in_square_brackets().or_else(|| self.special_variable()) {
            return Some(known);
        }
        if let Some(known) = self.range_as_a_vector().or_else(|| self.member_of_a_range()) {
            return Some(known);
        }
        if let Some(known) = self.vector_in_brackets().or_else(|| self.range_without_in()) {
            return Some(known);
        }
        if let Some(known) = self.mark_in_a_head().or_else(|| self.range_with_a_colon()) {
            return Some(known);
        }
        let help = match self.found {
            "*" if before.ends_with('*') => "a power is written `x^2`",
            "," if number_ends(before) && after.starts_with(|c: char| c.is_ascii_digit()) => {
                "decimals are written with a point: `0.5`"
            }
            ";" => "leave it out: an item ends where the next one begins",
            "\"" if after.split_once('"').is_some_and(|(_, rest)| rest.trim_start().starts_with(':')) => {
                "a key has no quotes, as in `density: 1000`"
            }
            "\"" if after.lines().next().is_some_and(|line| line.contains('"')) => {
                return Some(self.text_in_a_wrong_place());
            }
            "\"" => {
                return Some(
                    self.syntax("the text is not closed").help("a text ends with `\"` on its own line"),
                );
            }
            "'" if number_ends(before) && after.starts_with(|c: char| c.is_ascii_digit()) => {
                return Some(self.grouped_digits());
            }
            "'" | "“" | "”" | "„" | "«" | "‘" => "a text stands in double quotes: `\"…\"`",
            "∪" => "shapes are joined by `or` or `∨`: write `a or b`",
            "∩" => "shapes are cut by `and` or `∧`: write `a and b`",
            "@" if self.on_its_line().trim().is_empty() => {
                "an attribute stands before a solid, and its value in brackets, as in `@tolerance(1e-6)`"
            }
            "–" | "—" => {
                "this is a dash: the sign of a difference is `-`, as in `a - b`, and shapes are cut by `a \\ b`"
            }
            "≠" => "that would leave out a surface of zero thickness: write `a <= b` or `a >= b`",
            "√" => "a root is written `sqrt(2)`",
            "%" if number_ends(before) => "a percentage is written as a number: `0.1` for 10 %",
            "%" => foreign::REMAINDER,
            "?" => foreign::CONDITION,
            "<" if before.ends_with(['(', ',', '=', '{', ':']) => "a vector is written `[0, 0, 0]`",
            "{" if before.ends_with(':') && self.in_braces() => {
                let key = last_word(before.trim_end_matches(':').trim_end());
                return Some(self.syntax("a block has no `:`").help(format!("write `{key} {{ … }}`")));
            }
            "{" if self.solid_in_braces().is_some() => return self.solid_in_braces(),
            "{" if self.arguments_in_braces().is_some() => return self.arguments_in_braces(),
            "{" if last_word(before) == "scene" => "a scene has a name: write `scene tank { … }`",
            "{" if before.ends_with(')') || !self.in_braces() => {
                "shapes are joined by `or`, `and` and `\\`: write `solid part = sphere(1) \\ sphere(0.5)`"
            }
            ":" if before.ends_with(')') && before.contains("range(") => {
                "a range is written with dots: `any i in 0..6: …`"
            }
            _ => return None,
        };
        Some(self.unexpected().help(help))
    }
}

/// Whether a path is that of a mesh, by its ending.
fn is_a_mesh(path: &str) -> bool {
    [".stl", ".obj", ".ply"].iter().any(|ending| path.to_lowercase().ends_with(ending))
}
