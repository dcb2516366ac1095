//! Slips in the heads of items, folds and blocks.

use super::super::foreign;
use super::super::words::{ITEM_WORDS, KEYWORDS};
use super::Slip;
use super::pieces::{bracketed, first_part, fits, last_number, last_word, parts, replaced, unclosed};
use crate::diagnostic::{Code, Diagnostic, Span};

/// What begins a fold.
pub(super) const FOLDS: [&str; 7] = ["any", "all", "sum", "product", "min", "max", "list"];

/// Functions whose powers mathematics writes behind their names.
const POWERS_OF: [&str; 9] = ["sin", "cos", "tan", "sinh", "cosh", "tanh", "log", "ln", "exp"];

/// Functions whose argument mathematics writes without brackets.
const FUNCTIONS: [&str; 14] =
    ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "log", "ln", "exp", "sqrt", "abs"];

/// Standard solids that take numbers.
const SHAPES: [&str; 6] = ["sphere", "ellipsoid", "cylinder", "cone", "capsule", "torus"];

/// Whether a text ends with the head of a function whose body would follow, on a line that is indented.
pub(in crate::syntax) fn begins_a_body(text: &str) -> bool {
    let Some((head, indent)) = text.rsplit_once('\n') else { return false };
    let head = head.trim_end();
    let is_head = head.trim_start().starts_with("fn ") && head.ends_with('=');
    is_head && !indent.is_empty() && indent.chars().all(char::is_whitespace)
}

impl Slip<'_> {
    /// A function whose body is several statements: `fn f(r) =`, `let q = r*2` and `sphere(q)` on lines of their own.
    pub(super) fn body_of_statements(&self) -> Option<Diagnostic> {
        let rest = self.text[self.at..].trim_start();
        let above = &self.text[self.start.min(self.at)..self.text.len() - rest.len()];
        if !self.found.is_empty() || !rest.starts_with("let ") || !begins_a_body(above) {
            return None;
        }
        let mut lines = rest.lines().map(|line| line.split('#').next().unwrap_or_default().trim());
        let (name, value) = lines.next()?.strip_prefix("let ")?.split_once('=')?;
        let body = lines.next().unwrap_or_default();
        let [name, value, head] = [name, value, above.trim()].map(str::trim);
        let is_one = fits(&[name, value, head, body]) && !body.is_empty() && !body.starts_with("let ");
        let written = match is_one {
            true => format!("write `{head} {}`", replaced(body, name, value)),
            false => "write the value of each `let` in the place of its name".to_string(),
        };
        Some(
            self.syntax("a function is one expression")
                .help(format!("a `let` stands above the functions: {written}")),
        )
    }

    /// A mark that stands where the head of something is written otherwise.
    pub(super) fn mark_in_a_head(&self) -> Option<Diagnostic> {
        match self.found {
            "|" => self.absolute_value(),
            "~" => self.tilde(),
            "{" => self.function_in_braces(),
            "," => self.two_variables(),
            "(" => self
                .fold_as_a_call()
                .or_else(|| self.fold_of_three())
                .or_else(|| self.function_by_let())
                .or_else(|| self.obstacle_by_a_shape())
                .or_else(|| self.fluid_without_a_key())
                .or_else(|| self.power_of_a_function()),
            "<" | ">" | "≤" | "≥" | "^" | "*" => self.fluid_without_a_key(),
            "[" => self
                .range_in_brackets()
                .or_else(|| self.box_as_two_corners())
                .or_else(|| self.box_without_a_key()),
            ":" => self
                .type_of_a_param()
                .or_else(|| self.value_behind_a_colon())
                .or_else(|| self.argument_behind_a_colon()),
            "-" => self.name_with_a_dash(),
            "." => self.box_as_a_range().or_else(|| self.fold_of_three()),
            "}" => self.block_without_a_key().or_else(|| self.block_without_braces()),
            found if found.starts_with(|c: char| c.is_ascii_digit()) => {
                self.vector_without_commas().or_else(|| self.numbers_without_brackets())
            }
            _ => None,
        }
    }

    /// `let q = 3` and `fn f(x) = …` within a scene, of which the place is behind the name.
    pub(super) fn item_in_braces(&self) -> Option<Diagnostic> {
        let line = self.on_its_line().trim_start();
        let is_head = |word: &&str| {
            let rest = line.strip_prefix(*word).filter(|rest| rest.starts_with(char::is_whitespace));
            rest.is_some_and(|rest| rest.trim_start().starts_with(char::is_alphabetic))
        };
        let word = ITEM_WORDS.into_iter().find(is_head)?;
        // a block that begins on this line is not around it
        (self.in_braces() && !line.contains('{') && matches!(self.found, "=" | "(")).then(|| {
            let start = self.at - line.len();
            let span = Span::new(self.span.source, start, start + word.len());
            Diagnostic::error(Code::SYNTAX, span, format!("`{word}` within a block"))
                .help("items stand outside of scenes: move the line above the scene that uses it, or close the block with `}`")
        })
    }

    /// `"a\"b"`: the text ends at the second quote, and the third one does not begin another.
    pub(super) fn escaped_quote(&self) -> Option<Diagnostic> {
        let line = self.on_its_line();
        let (before, behind) = line.rsplit_once("\\\"")?;
        // the quote that the backslash stands before closes what the one before opens
        let is_closed = before.split(['#']).count() == 1 && before.matches('"').count() % 2 == 1;
        if !is_closed || behind.contains('"') {
            return None;
        }
        let at = self.at - line.len() + before.len();
        let span = Span::new(self.span.source, at, at + 2);
        let message = "a text has no escapes: it ends at this quote";
        Some(
            Diagnostic::error(Code::SYNTAX, span, message)
                .help("within a text write `'` or `”` in place of `\"`"),
        )
    }

    /// A text where none may stand, which is closed on its line.
    pub(super) fn text_in_a_wrong_place(&self) -> Diagnostic {
        let text = self.after().split('"').next().unwrap_or_default();
        let head = last_word(self.before());
        let behind = self.after().get(text.len() + 1..).unwrap_or_default().trim_start();
        let span = Span::new(self.span.source, self.at, self.at + text.len() + 2);
        let diagnostic =
            Diagnostic::error(Code::SYNTAX, span, format!("unexpected text `\"{}\"`", text.escape_debug()));
        if ITEM_WORDS.contains(&head) || !head.is_empty() && self.in_braces() && behind.starts_with('{') {
            let name: String = text.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
            let name = name.trim_matches('_');
            let is_name = name.starts_with(char::is_alphabetic);
            let name = if is_name { name } else { "name" };
            return diagnostic.help(format!("a name has no quotes, as in `{head} {name}`"));
        }
        diagnostic.help("only a param has a description: write it as a comment, behind `#`")
    }

    /// `sin x`
    pub(super) fn argument_without_brackets(&self) -> Option<Diagnostic> {
        let function = last_word(self.on_its_line().trim_end());
        let heads = self.on_its_line().trim_end().strip_suffix(function)?.trim_end();
        let is_solid = SHAPES.contains(&function) && !ITEM_WORDS.contains(&last_word(heads));
        let is_operand = !KEYWORDS.contains(&self.found) && (FUNCTIONS.contains(&function) || is_solid);
        is_operand.then(|| {
            let call = match bracketed(self.after()).filter(|inner| fits(&[inner])) {
                Some(inner) => format!("{function}({}({inner}))", self.found),
                None => format!("{function}({})", self.found),
            };
            self.unexpected().help(format!("the argument of a function stands in brackets: write `{call}`"))
        })
    }

    /// `sphere 1`, `cylinder 5 mm, 2`
    fn numbers_without_brackets(&self) -> Option<Diagnostic> {
        let head = self.on_its_line().trim_end();
        let function = last_word(head);
        let is_name = ITEM_WORDS.contains(&last_word(head.strip_suffix(function)?.trim_end()));
        if is_name || !(SHAPES.contains(&function) || FUNCTIONS.contains(&function)) {
            return None;
        }
        let line = self.text[self.at..].lines().next()?;
        let is_number = |word: &str| word.starts_with(|c: char| c.is_ascii_digit() || c == '.');
        let mut numbers: Vec<String> = Vec::new();
        for word in line.split([' ', '\t', ',']).filter(|word| !word.is_empty()) {
            let is_unit = word.chars().all(char::is_alphabetic) && !KEYWORDS.contains(&word);
            match numbers.last_mut() {
                _ if is_number(word) => numbers.push(word.to_string()),
                // with its unit
                Some(number) if is_unit && !number.contains(' ') => *number = format!("{number} {word}"),
                Some(_) | None => break,
            }
        }
        let call = format!("{function}({})", numbers.join(", "));
        let call = if fits(&[&call]) { call } else { format!("{function}(…)") };
        let what = if numbers.len() > 1 { "arguments stand" } else { "the argument of a function stands" };
        Some(self.unexpected().help(format!("{what} in brackets: write `{call}`")))
    }

    /// `|x|`
    fn absolute_value(&self) -> Option<Diagnostic> {
        let (inner, _) = self.after().lines().next()?.split_once('|')?;
        let inner = if fits(&[inner.trim()]) && !inner.contains(['(', ')']) { inner.trim() } else { "x" };
        (!self.ends_an_operand()).then(|| {
            self.unexpected().help(format!("the absolute value is a function: write `abs({inner})`"))
        })
    }

    /// `~a`
    fn tilde(&self) -> Option<Diagnostic> {
        let operand = self.after().lines().next()?;
        let operand = operand.split_inclusive(')').next().unwrap_or(operand).trim();
        let operand = if fits(&[operand]) && !operand.contains(',') { operand } else { "a" };
        (!self.ends_an_operand()).then(|| {
            self.unexpected().help(format!("what is not in a shape is `not {operand}`, or `!{operand}`"))
        })
    }

    /// `any i = 0..6: …`
    pub(super) fn fold_with_equals(&self) -> Option<Diagnostic> {
        let before = self.before();
        let variable = last_word(before);
        let fold = last_word(before.trim_end_matches(variable).trim_end());
        let line = self.after().lines().next()?;
        let range = line.split([':', ',']).next()?.trim();
        let is_range = range.contains("..") || range.starts_with('[');
        (FOLDS.contains(&fold) && !variable.is_empty() && is_range).then(|| {
            let range = if fits(&[range]) && range.contains("..") { range } else { "0..6" };
            self.unexpected()
                .help(format!("a fold runs over a range: write `{fold} {variable} in {range}: …`"))
        })
    }

    /// `any i in 0..6 sphere(1)`
    pub(super) fn fold_without_a_colon(&self) -> Option<Diagnostic> {
        let line = self.on_its_line();
        let word = |fold: &&str| line.rfind(&format!("{fold} ")).map(|at| (at, fold.len()));
        let (at, length) = FOLDS.iter().filter_map(word).max()?;
        let head = line[at..].trim();
        let (variable, range) = head[length..].trim_start().split_once(" in ")?;
        let is_head = last_word(variable) == variable && !head.contains([':', '(']) && !range.is_empty();
        (is_head && self.ends_an_operand() && fits(&[head]))
            .then(|| self.unexpected().help(format!("a fold has a colon: write `{head}: {}…`", self.found)))
    }

    /// `fn f(x) { x^2 }`
    fn function_in_braces(&self) -> Option<Diagnostic> {
        let head = self.before().trim_end_matches('=').trim_end();
        let (start, call) = head.rsplit_once("fn ")?;
        let is_head = start.trim().is_empty() && head.ends_with(')') && !call.contains('\n');
        let inner =
            self.after().split('}').next()?.trim().trim_start_matches("return ").trim_end_matches(';');
        let is_one = fits(&[inner]) && !inner.contains([';', '{', '=']);
        let body = if is_one { inner } else { "…" };
        (is_head && fits(&[call]))
            .then(|| self.unexpected().help(format!("a function has no braces: write `fn {call} = {body}`")))
    }

    /// `any i in 0..4, j in 0..4: …`
    fn two_variables(&self) -> Option<Diagnostic> {
        let line = self.on_its_line();
        let word = |fold: &&str| line.rfind(&format!("{fold} ")).map(|at| (at, fold.len()));
        let (at, length) = FOLDS.iter().filter_map(word).max()?;
        let head = line[at..].trim();
        let (second, _) = self.after().lines().next()?.split_once(':')?;
        let is_head = head.contains(" in ") && !head.contains([':', ',']) && second.contains(" in ");
        (is_head && fits(&[head, second])).then(|| {
            let fold = &head[..length];
            self.unexpected()
                .help(format!("a fold has one variable: write `{head}: {fold} {}: …`", second.trim()))
        })
    }

    /// `sin^2(x)`
    fn power_of_a_function(&self) -> Option<Diagnostic> {
        let before = self.before();
        let exponent = last_number(before);
        let function = last_word(before.strip_suffix(exponent)?.strip_suffix('^')?);
        let argument = bracketed(&self.text[self.at..])?.trim();
        let is_one = |part: &str| fits(&[part]) && !part.is_empty();
        (POWERS_OF.contains(&function) && !exponent.is_empty() && is_one(argument)).then(|| {
            let written = format!("{function}({argument})^{exponent}");
            self.unexpected().at("a power stands behind the call").help(format!("write `{written}`"))
        })
    }

    /// `sphere(1, centre: [0, 0, 1])`
    fn argument_behind_a_colon(&self) -> Option<Diagnostic> {
        let before = self.before();
        let open = unclosed(before)?;
        let function = last_word(&before[..open]);
        let name = last_word(before);
        let is_named = before[..before.len() - name.len()].trim_end().ends_with(['(', ',']);
        if function.is_empty() || FOLDS.contains(&function) || name.is_empty() || !is_named {
            return None;
        }
        let inner = bracketed(&self.text[self.start.min(self.at) + open..]);
        let written = |part: &str| match part.split_once(':') {
            Some((word, value)) if last_word(word.trim()) == word.trim() => {
                format!("{} = {}", word.trim(), value.trim())
            }
            _ => part.to_string(),
        };
        let arguments: Option<Vec<String>> =
            inner.map(|inner| parts(inner).into_iter().map(written).collect());
        let call = arguments.map(|arguments| format!("{function}({})", arguments.join(", ")));
        let call = call.filter(|call| fits(&[call])).unwrap_or_else(|| format!("{name} = …"));
        Some(self.unexpected().help(format!("a named argument has `=`: write `{call}`")))
    }

    /// `let f(x) = x^2`
    fn function_by_let(&self) -> Option<Diagnostic> {
        let head = self.on_its_line().trim();
        let name = head.strip_prefix("let ").or_else(|| head.strip_prefix("solid "))?.trim();
        let (arguments, _) = self.after().lines().next()?.split_once(')')?;
        (last_word(name) == name && !name.is_empty() && fits(&[name, arguments])).then(|| {
            self.unexpected().help(format!("a function begins with `fn`: write `fn {name}({arguments}) = …`"))
        })
    }

    /// `solid my-part = …`
    fn name_with_a_dash(&self) -> Option<Diagnostic> {
        let (item, first) = self.on_its_line().trim().split_once(' ')?;
        let rest = self.after();
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let first = first.trim();
        let is_name = ["solid", "let", "param", "fn", "scene"].contains(&item)
            && last_word(first) == first
            && end > 0
            && fits(&[first, &rest[..end]]);
        is_name.then(|| {
            let name = format!("{first}_{}", &rest[..end]);
            self.unexpected().help(format!("names are made of letters, digits and `_`: call it `{name}`"))
        })
    }

    /// `box: [0, 0, 0] .. [1, 1, 1]`
    fn box_as_a_range(&self) -> Option<Diagnostic> {
        let (before, low) = self.on_its_line().rsplit_once(':')?;
        let key = last_word(before.trim_end());
        let high = self.after().lines().next()?.trim_start_matches('.').trim();
        let high = &high[..=high.find(']')?];
        let low = low.trim().trim_end_matches('.').trim_end();
        let are_vectors = [low, high].into_iter().all(|end| end.starts_with('[') && end.ends_with(']'));
        let is_box = matches!(foreign::key(key).unwrap_or(key), "box");
        (is_box && are_vectors && fits(&[low, high]))
            .then(|| self.unexpected().help(format!("write `box {{ min: {low}, max: {high} }}`")))
    }

    /// `box: [0, 0, 0], [1, 1, 1]`
    fn box_as_two_corners(&self) -> Option<Diagnostic> {
        let (before, low) = self.on_its_line().rsplit_once(':')?;
        let low = low.trim().strip_suffix(',')?.trim_end();
        let rest = &self.text[self.at..];
        let high = &rest[..=rest.find([']', '\n']).filter(|&end| rest[end..].starts_with(']'))?];
        let key = last_word(before.trim_end());
        let is_box = matches!(foreign::key(key).unwrap_or(key), "box");
        (is_box && low.starts_with('[') && low.ends_with(']') && fits(&[low, high]))
            .then(|| self.unexpected().help(format!("write `box {{ min: {low}, max: {high} }}`")))
    }

    /// `obstacle post` or `fluid water`, and a new line
    pub(super) fn block_without_braces(&self) -> Option<Diagnostic> {
        let line = self.before().lines().last()?;
        let (block, name) = line.trim().split_once(' ')?;
        let is_scene = block == "scene" && !self.in_braces() && self.found != "}";
        let written = match block {
            "scene" => format!("scene {name} {{` here, and behind its last block `}}"),
            "obstacle" | "container" => format!("{block} {{ solid: {name} }}"),
            "fluid" => format!("fluid {name} {{ shape: …, density: 1000 }}"),
            "probe" => format!("probe {name} {{ energy: water, every: 0.1 s }}"),
            _ => return None,
        };
        let is_name = last_word(name) == name && fits(&[name]);
        let start = self.text[..self.at].trim_end().len() - line.trim().len();
        let span = Span::new(self.span.source, start, start + line.trim().len());
        ((self.in_braces() && block != "scene" || is_scene) && is_name).then(|| {
            Diagnostic::error(Code::SYNTAX, span, format!("`{block}` has no block"))
                .at("expected `{`")
                .help(format!("write `{written}`"))
        })
    }

    /// `param r: float = 1`
    fn type_of_a_param(&self) -> Option<Diagnostic> {
        let head = self.on_its_line().trim();
        let (kind, value) = self.after().lines().next()?.split_once('=')?;
        let (item, name) = head.split_once(' ')?;
        let is_head = ["param", "let", "solid"].contains(&item) && last_word(name) == name.trim();
        // the `=` may belong to a comparison or to an argument
        let kind = kind.trim();
        let is_type = !kind.is_empty()
            && last_word(kind) == kind
            && !matches!(kind, "x" | "y" | "z")
            && !value.starts_with('=');
        (is_head && is_type && fits(&[name, value])).then(|| {
            self.unexpected().help(format!("values have no types: write `{head} = {}`", value.trim()))
        })
    }

    /// `[0 0 -9.81]`
    fn vector_without_commas(&self) -> Option<Diagnostic> {
        let (_, first) = self.on_its_line().rsplit_once('[')?;
        let (rest, _) = self.text[self.at..].lines().next()?.split_once(']')?;
        let parts: Vec<&str> = first.split_whitespace().chain(rest.split_whitespace()).collect();
        let are_numbers = parts.len() > 1 && parts.iter().all(|part| part.parse::<f64>().is_ok());
        are_numbers.then(|| {
            let vector = parts.join(", ");
            self.unexpected().help(format!("commas separate the parts of a vector: write `[{vector}]`"))
        })
    }

    /// `obstacle sphere(0.1)`
    fn obstacle_by_a_shape(&self) -> Option<Diagnostic> {
        let (block, called) = self.on_its_line().trim().rsplit_once(' ')?;
        let block = last_word(block);
        let shape = format!("{called}{}", chain(&self.text[self.at..])?);
        let is_call = ["obstacle", "container"].contains(&block) && last_word(called) == called;
        (is_call && self.in_braces() && fits(&[&shape])).then(|| {
            let name = self.free_name(if block == "container" { "room" } else { usual_name(called) });
            self.unexpected().help(format!(
                "a solid has a name: write `solid {name} = {shape}` above the scene, and `{block} {{ solid: {name} }}` here"
            ))
        })
    }

    /// A name that the text does not use: as given, or with a number behind it.
    fn free_name(&self, name: &str) -> String {
        let is_used = |name: &str| {
            self.text.split(|c: char| !(c.is_alphanumeric() || c == '_')).any(|word| word == name)
        };
        let numbered = (2..).map(|number| format!("{name}{number}"));
        std::iter::once(name.to_string()).chain(numbered).find(|name| !is_used(name)).unwrap_or_default()
    }

    /// `obstacle { post }`
    fn block_without_a_key(&self) -> Option<Diagnostic> {
        let (head, name) = self.on_its_line().rsplit_once('{')?;
        let (block, name) = (last_word(head.trim()), name.trim());
        let block = foreign::key(block).unwrap_or(block);
        let is_name = !name.is_empty() && last_word(name) == name;
        (["obstacle", "container"].contains(&block) && is_name && fits(&[name]))
            .then(|| self.unexpected().help(format!("write `{block} {{ solid: {name} }}`")))
    }

    /// `fluid water { z <= 0.3 }`
    fn fluid_without_a_key(&self) -> Option<Diagnostic> {
        let (head, first) = self.on_its_line().rsplit_once('{')?;
        let is_fluid = head.split_whitespace().rev().take(2).any(|word| word == "fluid");
        let rest = first_part(self.text[self.at..].lines().next()?);
        let shape = format!("{first}{}", rest.split('}').next()?);
        let (shape, head) = (shape.trim(), head.rsplit_once("fluid")?.1.trim());
        let name = if head.is_empty() { String::new() } else { format!("{head} ") };
        (is_fluid && self.in_braces() && !first.contains(':') && fits(&[shape])).then(|| {
            self.unexpected()
                .help(format!("a value stands behind its key: write `fluid {name}{{ shape: {shape} }}`"))
        })
    }

    /// `box [1, 1, 1]`
    fn box_without_a_key(&self) -> Option<Diagnostic> {
        let rest = &self.text[self.at..];
        let corner = &rest[..=rest.find([']', '\n']).filter(|&end| rest[end..].starts_with(']'))?];
        (last_word(self.on_its_line().trim_end()) == "box" && self.in_braces() && fits(&[corner]))
            .then(|| self.unexpected().help(format!("write `box {{ max: {corner} }}`")))
    }
}

/// What a solid of a standard shape may be called. Shapes themselves are no free names.
fn usual_name(shape: &str) -> &'static str {
    match shape {
        "sphere" | "ball" | "ellipsoid" => "stone",
        "box" => "block",
        "cylinder" | "cone" | "capsule" => "post",
        "torus" => "ring",
        "half_space" => "ground",
        _ => "body",
    }
}

/// The arguments in brackets at the start of a text, with the methods behind them.
fn chain(text: &str) -> Option<&str> {
    let mut end = bracketed(text)?.len() + 2;
    while let Some(method) = text[end..].strip_prefix('.') {
        let name = method.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(method.len());
        let Some(arguments) = bracketed(&method[name..]) else { break };
        end += 1 + name + arguments.len() + 2;
    }
    Some(&text[..end])
}
