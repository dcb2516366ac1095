//! Slips in ranges: of params, of folds, and of what lies between two bounds.

use super::super::foreign;
use super::Slip;
use super::heads::FOLDS;
use super::pieces::{bracketed, first_part, fits, last_open, last_part, last_word, parts, replaced, words};
use crate::diagnostic::Diagnostic;

impl Slip<'_> {
    /// The whole line of the place.
    fn line(&self) -> &str {
        let start = self.at - self.on_its_line().len();
        self.text[start..].lines().next().unwrap_or_default()
    }

    /// `param r = 1 [0.1, 5]`
    pub(super) fn range_in_brackets(&self) -> Option<Diagnostic> {
        let param = self.on_its_line().trim();
        self.range_of(param, self.text[self.at..].lines().next()?)
    }

    /// `param r = 1 in [0.5, 2]` and `param r = 1 in (0.5, 2)`
    pub(super) fn range_as_a_vector(&self) -> Option<Diagnostic> {
        // at the end of an item the place may be a line further down
        let line = match self.found {
            "" | "\"" => self.before().lines().last()?,
            "," => self.line(),
            _ => return None,
        };
        let (param, range) = line.trim().split_once(" in ")?;
        self.range_of(param, range.trim_start())
    }

    /// The message for a range that was written as two numbers in brackets, with which a text begins.
    fn range_of(&self, param: &str, range: &str) -> Option<Diagnostic> {
        let ([low, high], rest) = two_bounds(range)?;
        let ends = rest.is_empty() || rest.starts_with(['"', '#']);
        let (_, value) = param.split_once('=')?;
        (param.starts_with("param ") && ends && fits(&[param, low, high])).then(|| {
            // the bounds have the unit of the value
            let unit = unit_of(value.trim());
            let [low, high] = [low, high].map(|bound| match bound.parse::<f64>() {
                Ok(_) => format!("{bound} {unit}").trim_end().to_string(),
                Err(_) => bound.to_string(),
            });
            let message = match self.found {
                "" => self.syntax("a range has no brackets"),
                _ => self.unexpected(),
            };
            message.help(format!("a range follows `in`: write `{param} in {low} .. {high}`"))
        })
    }

    /// `param r: 1 mm .. 5 mm` and `param r: 1`
    pub(super) fn value_behind_a_colon(&self) -> Option<Diagnostic> {
        let head = self.on_its_line().trim();
        let line = self.after().lines().next()?;
        let value = line.split(['"', '#']).next()?.trim();
        let (item, name) = head.split_once(' ')?;
        let is_head = ["param", "let", "solid"].contains(&item) && last_word(name) == name.trim();
        if !is_head || self.in_braces() || !fits(&[head, value]) || has_equals(value) {
            return None;
        }
        if TYPES.contains(&value) {
            let example = if item == "solid" { "sphere(1)" } else { "1" };
            return Some(self.unexpected().help(format!("values have no types: write `{head} = {example}`")));
        }
        let (range, value) = match value.split_once("..") {
            Some((low, _)) if item == "param" && !value.contains(" in ") => {
                (format!(" in {value}"), low.trim())
            }
            _ => (String::new(), value),
        };
        let written = format!("write `{head} = {value}{range}`");
        Some(self.unexpected().help(if range.is_empty() {
            format!("a value follows `=`: {written}")
        } else {
            format!("a param has a value, and then a range: {written}, or with another value between the two")
        }))
    }

    /// `for i in 0..5: sphere(0.1).move([i, 0, 0])`
    pub(super) fn fold_with_for(&self) -> Diagnostic {
        let line = self.after().lines().next().unwrap_or_default();
        let head = line.trim_start().strip_prefix("in ").and_then(|rest| rest.split_once(':'));
        let range = head.and_then(|(range, _)| members(range.trim()));
        let heads = match range.filter(|range| fits(&[range.as_str()])) {
            Some(range) => format!("{} in {range}", self.found),
            None => "i in 0..6".into(),
        };
        // `[for i in 0..5: [i, i^2]]` makes a list
        let before = self.on_its_line().trim_end().trim_end_matches("for").trim_end();
        match before.ends_with('[') {
            true => self
                .unexpected()
                .at("`for` in a list is written `list` here")
                .help(format!("write `list {heads}: …`, without the brackets around it")),
            false => {
                self.unexpected().at("`for` is written `any` here").help(format!("write `any {heads}: …`"))
            }
        }
    }

    /// `any i in 0:5: sphere(0.1).move([i, 0, 0])`
    pub(super) fn range_with_a_colon(&self) -> Option<Diagnostic> {
        let (head, range) = self.on_its_line().rsplit_once(" in ").filter(|_| self.found == ":")?;
        let variable = last_word(head);
        let fold = last_word(head.strip_suffix(variable)?.trim_end());
        let (start, end) = range.split_once(':')?;
        let [start, end] = [start.trim(), end.trim()];
        // with a step between both ends it says something else
        let rest = self.after().lines().next().unwrap_or_default();
        let has_step = rest.split_once(':').is_some_and(|(last, _)| last.trim().parse::<f64>().is_ok());
        (FOLDS.contains(&fold) && !has_step && fits(&[start, end])).then(|| {
            let written = format!("{fold} {variable} in {start}..{end}: …");
            self.unexpected().at("a range is written with dots").help(format!("write `{written}`"))
        })
    }

    /// `any(i in 0..4, …)`, `sum(i in 0..4: …)` and `any(… for i in 0..4)`
    pub(super) fn fold_as_a_call(&self) -> Option<Diagnostic> {
        let line = self.on_its_line();
        let open = if self.found == "(" { self.at } else { self.at - line.len() + line.rfind('(')? };
        let fold = last_word(self.text[..open].trim_end());
        let inner = bracketed(&self.text[open..])?;
        let (head, body) = match inner.split_once(" for ") {
            Some((body, head)) => (head.trim(), body.trim()),
            None => {
                let (head, body) = inner.split_at(inner.find([',', ':'])?);
                (head.trim(), body[1..].trim())
            }
        };
        let (variable, range) = head.split_once(" in ").filter(|_| FOLDS.contains(&fold) && fits(&[head]))?;
        let range = members(range.trim()).unwrap_or_else(|| range.trim().to_string());
        let body = if fits(&[body]) { body } else { "…" };
        Some(
            self.unexpected()
                .help(format!("a fold has no brackets: write `{fold} {variable} in {range}: {body}`")),
        )
    }

    /// `sum(i, 0..5, i)`
    pub(super) fn fold_of_three(&self) -> Option<Diagnostic> {
        let line = self.on_its_line();
        let open = if self.found == "(" { self.at } else { self.at - line.len() + line.rfind('(')? };
        let fold = last_word(self.text[..open].trim_end());
        let all = parts(bracketed(&self.text[open..])?);
        let [variable, members, body] = all[..] else { return None };
        let is_fold = FOLDS.contains(&fold)
            && last_word(variable) == variable
            && (members.contains("..") || members.starts_with('['))
            && fits(&[variable, members, body]);
        is_fold.then(|| {
            self.unexpected()
                .help(format!("a fold has no brackets: write `{fold} {variable} in {members}: {body}`"))
        })
    }

    /// `z ∈ [0, 1]`, and `z in [0, 1]`
    pub(super) fn member_of_a_range(&self) -> Option<Diagnostic> {
        if !matches!(self.found, "∈" | "in") || !self.ends_an_operand() {
            return None;
        }
        let value = last_part(self.on_its_line()).trim();
        let item = self.line().split_whitespace().next().unwrap_or_default();
        let first = value.split_whitespace().next().unwrap_or_default();
        let is_number = value.starts_with(|c: char| c.is_ascii_digit() || c == '.');
        if is_number || FOLDS.contains(&first) || first == "for" || ["param", "let"].contains(&item) {
            return None;
        }
        let rest = self.after().lines().next().unwrap_or_default().trim_start();
        let bounds = match rest.strip_prefix(['[', '(']) {
            Some(_) => two_bounds(rest).map(|([low, high], _)| (low, high)),
            None => first_part(rest).split_once(".."),
        };
        let of_a_choice = words(value).any(|word| matches!(word, "if" | "then" | "else"));
        let written = match bounds {
            Some((low, high)) if !of_a_choice && fits(&[low.trim(), value, high.trim()]) => {
                format!("{} <= {value} <= {}", low.trim(), high.trim())
            }
            _ if self.found == "in" => return None,
            _ => "0 <= z <= 1".to_string(),
        };
        Some(
            self.unexpected()
                .help(format!("what lies between two bounds is compared with both: write `{written}`")),
        )
    }

    /// `any k in 0..5 step 2: …`, `… where r = 2`, and `z in [0, 1]`
    pub(super) fn word_behind_a_value(&self) -> Option<Diagnostic> {
        match self.found {
            "step" | "by" => self.step_of_a_range(),
            "where" => self.value_behind_where(),
            "for" => self.list_with_for(),
            "in" => self.fold_as_a_call().or_else(|| self.member_of_a_range()),
            _ => None,
        }
    }

    /// `[[i, 0, 0] for i in range(60)]`
    fn list_with_for(&self) -> Option<Diagnostic> {
        let line = self.on_its_line();
        let (open, _) = last_open(line).filter(|(_, bracket)| *bracket == '[')?;
        let body = line[open + 1..].trim();
        let (variable, range) = first_part(self.after().lines().next()?).split_once(" in ")?;
        let range = members(range.trim()).unwrap_or_else(|| range.trim().to_string());
        let written = match fits(&[body, variable, &range]) {
            true => format!("list {} in {range}: {body}", variable.trim()),
            false => "list i in 0..6: …".to_string(),
        };
        Some(
            self.unexpected()
                .help(format!("a list of members is a fold without brackets: write `{written}`")),
        )
    }

    /// `any k in 0..5 step 2: sphere(0.1).move([k, 0, 0])`
    fn step_of_a_range(&self) -> Option<Diagnostic> {
        let (head, range) = self.on_its_line().rsplit_once(" in ")?;
        let variable = last_word(head.trim_end());
        let fold = last_word(head.trim_end().strip_suffix(variable)?.trim_end());
        let (start, end) = range.split_once("..")?;
        if !FOLDS.contains(&fold) || variable.is_empty() {
            return None;
        }
        let (step, body) = self.after().lines().next()?.split_once(':')?;
        let [start, end, step] = [start, end, step].map(str::trim);
        let body = first_part(body);
        if !fits(&[start, end, step, body]) {
            return None;
        }
        let count = match [start, end, step].map(str::parse::<f64>) {
            [Ok(first), Ok(last), Ok(width)] => {
                let count = ((last - first) / width - 1e-9).ceil();
                if !(1.0..=1e9).contains(&count) {
                    return None;
                }
                count.to_string()
            }
            _ => {
                let [start, end, step] = [start, end, step].map(foreign::operand);
                let length = if start == "0" { end } else { format!("({end} - {start})") };
                format!("ceil({length}/{step})")
            }
        };
        let body = replaced(body, variable, &multiple(start, step, variable));
        let written = format!("{fold} {variable} in 0..{count}: {body}");
        let diagnostic = self.syntax("a range has steps of 1");
        Some(diagnostic.help(format!("count the steps, and multiply: write `{written}`")))
    }

    /// `x^2 <= r^2 where r = 2`
    fn value_behind_where(&self) -> Option<Diagnostic> {
        let rest = self.after().lines().next().unwrap_or_default().split('#').next().unwrap_or_default();
        let is_definition = |part: &&str| {
            part.split_once('=').is_some_and(|(name, value)| {
                let name = name.trim();
                !name.is_empty() && last_word(name) == name && !value.starts_with('=')
            })
        };
        let all = parts(rest.trim());
        if self.in_braces() || !self.ends_an_operand() || all.is_empty() || !all.iter().all(is_definition) {
            return None;
        }
        let written = match fits(&all) {
            true => all.iter().map(|part| format!("`let {part}`")).collect::<Vec<_>>().join(" and "),
            false => "`let r = 2`".to_string(),
        };
        let diagnostic = self.syntax("a name is defined in front of what has it");
        Some(diagnostic.help(format!("write {written} above, on a line of its own")))
    }
}

/// What stands for the type of a number elsewhere.
const TYPES: [&str; 9] = ["float", "int", "number", "real", "f64", "f32", "length", "double", "bool"];

/// The two parts of brackets with which a text begins, and what stands behind them.
fn two_bounds(text: &str) -> Option<([&str; 2], &str)> {
    let inner = text.strip_prefix(['[', '('])?;
    let (mut depth, mut start, mut found) = (0, 0, Vec::new());
    for (at, c) in inner.char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' if depth == 0 => {
                found.push(inner[start..at].trim());
                return Some((found.try_into().ok()?, inner[at + 1..].trim()));
            }
            ')' | ']' => depth -= 1,
            ',' | ';' if depth == 0 => {
                found.push(inner[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
    }
    None
}

/// The unit of a value that is one number with a unit; empty for every other value.
fn unit_of(value: &str) -> &str {
    let (number, unit) = value.split_once(' ').unwrap_or((value, ""));
    let unit = unit.trim();
    let is_unit = unit.starts_with(char::is_alphabetic)
        && unit.chars().all(|c| c.is_alphanumeric() || matches!(c, '/' | '^' | '²' | '³'));
    if is_unit && number.parse::<f64>().is_ok() { unit } else { "" }
}

/// Whether a text has a `=` outside of brackets that belongs to no comparison.
fn has_equals(text: &str) -> bool {
    let mut depth = 0;
    text.char_indices().any(|(at, c)| {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ => {}
        }
        let compares = text[..at].ends_with(['<', '>', '=', '!']) || text[at..].starts_with("==");
        c == '=' && depth == 0 && !compares
    })
}

/// The value of a step: `2*k`, `1 + 2*k` or `5 - k`.
pub(super) fn multiple(start: &str, step: &str, variable: &str) -> String {
    let (sign, step) = match step.strip_prefix('-') {
        Some(rest) => ('-', rest.trim_start()),
        None => ('+', step),
    };
    let product = match step.parse::<f64>() {
        Ok(1.0) => variable.to_string(),
        Ok(_) => format!("{step}*{variable}"),
        Err(_) => format!("{}*{variable}", foreign::operand(step)),
    };
    match (start.parse() == Ok(0.0), sign) {
        (true, '+') => product,
        (true, _) => format!("-{product}"),
        (false, _) => format!("{start} {sign} {product}"),
    }
}

/// The members of a fold as they are written here: `0..5` and `[1, 2]` stay, and `range(5)` is `0..5`.
fn members(range: &str) -> Option<String> {
    if let Some(arguments) = range.strip_prefix("range").and_then(bracketed) {
        return match parts(arguments)[..] {
            [end] => Some(format!("0..{end}")),
            [start, end] => Some(format!("{start}..{end}")),
            _ => None,
        };
    }
    (range.contains("..") && !range.contains('=') || range.starts_with('[')).then(|| range.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_replaced_where_they_stand_alone() {
        assert_eq!(replaced("ball([k, 0, k^2], kr).k", "k", "2*k"), "ball([2*k, 0, (2*k)^2], kr).k");
        assert_eq!(replaced("k", "k", "5 - k"), "5 - k");
        assert_eq!(replaced("f(k=1, r = k)", "k", "2*k"), "f(k=1, r = (2*k))");
    }
}
