//! Habits from OpenSCAD and Python: transformations in front of a shape, loops in brackets, special variables,
//! functions without a name.

use super::super::foreign;
use super::super::words::KEYWORDS;
use super::Slip;
use super::heads::FOLDS;
use super::pieces::{
    bracketed, closing, first_part, fits, last_word, opening, parts, replaced, token_end, unclosed,
};
use super::ranges::multiple;
use crate::diagnostic::Diagnostic;

impl Slip<'_> {
    /// `translate([1, 0, 0]) sphere(1)`
    pub(super) fn transform_in_front(&self) -> Option<Diagnostic> {
        let before = self.on_its_line().trim_end();
        let open = opening(before)?;
        let name = last_word(&before[..open]);
        let follows_a_method = before[..open].strip_suffix(name).is_some_and(|heads| heads.ends_with('.'));
        if follows_a_method {
            foreign::method(self.found)?;
            let shape = format!("{}({})", self.found, bracketed(self.after())?);
            let written = if fits(&[&shape]) { shape } else { format!("{}(…)", self.found) };
            return Some(self.unexpected().help(format!("a method follows a point: write `.{written}`")));
        }
        let line_start = self.at - self.on_its_line().len();
        let chain = &self.text[line_start + open - name.len()..];
        let is_transform = foreign::method(name).is_some() || foreign::of_a_profile(name, "").is_some();
        let written = match methods_behind(chain.lines().next()?) {
            Some((written, _)) if fits(&[&written]) => written,
            Some(_) | None => format!("shape.{}(…)", foreign::method(name).unwrap_or("extrude")),
        };
        is_transform.then(|| {
            self.unexpected().at("a method stands behind its shape").help(format!("write `{written}`"))
        })
    }

    /// `solid s = for (i = [0:5]) sphere(i)` and `any i in [0:5]: sphere(i)`
    pub(super) fn range_in_square_brackets(&self) -> Option<Diagnostic> {
        let written = self.fold_of_a_loop()?;
        let what = "a range is written with dots, and ends before its second number";
        Some(self.unexpected().at(what).help(format!("write `{written}`")))
    }

    /// `any i in [0..6]: sphere(i)`, of which the place is the second dot.
    pub(super) fn dots_in_square_brackets(&self) -> Option<Diagnostic> {
        let (head, start) = self.on_its_line().rsplit_once('[').filter(|_| self.found == ".")?;
        let (end, behind) = self.after().lines().next()?.split_once(']')?;
        let head = head.trim_end().strip_suffix(" in")?.trim_end();
        let variable = last_word(head);
        let fold = last_word(head.strip_suffix(variable)?.trim_end());
        let (start, end) = (start.trim_end_matches('.').trim(), end.trim_start_matches(['.', '=']).trim());
        let body = first_part(behind.trim_start().strip_prefix(':')?);
        let is_range = FOLDS.contains(&fold) && !variable.is_empty() && fits(&[start, end, body]);
        is_range.then(|| {
            let written = format!("{fold} {variable} in {start}..{end}: {body}");
            self.unexpected().help(format!("a range has no brackets: write `{written}`"))
        })
    }

    /// `for (i = [0:5]) sphere(i)` at the beginning of a line.
    pub(super) fn loop_of_its_own(&self) -> Option<Diagnostic> {
        let colon = self.text[self.at..].lines().next()?.find(':').filter(|_| self.found == "for")?;
        let at = self.at + colon;
        let written = Slip { at, found: &self.text[at..=at], ..*self }.fold_of_a_loop()?;
        Some(self.unexpected().help(format!("shapes repeat within a solid: write `solid row = {written}`")))
    }

    /// The fold that a loop with a range in square brackets means; the place is the colon in the range.
    fn fold_of_a_loop(&self) -> Option<String> {
        let (head, start) = self.on_its_line().rsplit_once('[').filter(|_| self.found == ":")?;
        let (range, behind) = self.after().lines().next()?.split_once(']')?;
        let head = head.trim_end();
        let head = head.strip_suffix('=').or_else(|| head.strip_suffix(" in"))?.trim_end();
        let variable = last_word(head);
        let heads = head.strip_suffix(variable)?.trim_end().trim_end_matches('(').trim_end();
        let fold = last_word(heads);
        if !(FOLDS.contains(&fold) || fold == "for") || variable.is_empty() {
            return None;
        }
        let fold = match heads.strip_suffix("for").map(str::trim_end) {
            Some(front) if front.ends_with('[') => "list",
            Some(_) => "any",
            None => fold,
        };
        let body = behind.trim_start_matches([' ', ')', ':']);
        let body = match methods_behind(body) {
            Some((written, rest)) if rest.trim_start_matches(';').is_empty() => written,
            Some(_) | None => first_part(body).to_string(),
        };
        let (step, end) = range.split_once(':').unwrap_or(("1", range));
        let [start, step, end] = [start, step, end].map(str::trim);
        let numbers = [start, step, end].map(|text| text.parse::<f64>().ok().filter(|n| n.abs() < 1e9));
        // both ends belong to the range there, and only the first one here
        let (members, member) = match numbers {
            [Some(first), Some(1.0), Some(last)]
                if [first, last].map(f64::fract) == [0.0; 2] && first <= last =>
            {
                (format!("{start}..{}", last + 1.0), variable.to_string())
            }
            [Some(first), Some(width), Some(last)] if width != 0.0 && (last - first) / width >= 0.0 => {
                let count = ((last - first) / width + 1e-9).floor() + 1.0;
                (format!("0..{count}"), multiple(start, step, variable))
            }
            [_, Some(1.0), _] if fits(&[start, end]) => (format!("{start}..{end} + 1"), variable.to_string()),
            _ => return None,
        };
        let body = if fits(&[&body]) { replaced(&body, variable, &member) } else { "…".to_string() };
        Some(format!("{fold} {variable} in {members}: {body}"))
    }

    /// `cylinder(h = 10, r = 2, $fn = 50)`
    pub(super) fn special_variable(&self) -> Option<Diagnostic> {
        if self.found != "$" {
            return None;
        }
        let exact = "surfaces are exact, and `--cells` says how fine a mesh of one is";
        let before = self.before();
        let call = unclosed(before).and_then(|open| {
            let function = last_word(&before[..open]);
            let behind = &self.text[self.at..];
            let inner = [&before[open + 1..], &behind[..closing(behind)?]].concat();
            let kept: Vec<&str> = parts(&inner).into_iter().filter(|part| !part.starts_with('$')).collect();
            let arguments = kept.join(", ");
            // arguments with a name may be called otherwise here
            let as_written = || (!arguments.contains('=')).then(|| format!("{function}({arguments})"));
            foreign::shape(function, &arguments).or_else(as_written)
        });
        if let Some(prism) = self.prism_of_few_sides() {
            return Some(self.unexpected().help(format!("{exact}; {prism}")));
        }
        Some(self.unexpected().help(match call.filter(|call| fits(&[call]) && !call.starts_with('(')) {
            Some(call) => format!("{exact}: write `{call}`"),
            None => format!("leave it out: {exact}"),
        }))
    }

    /// `cylinder(h = 1, r = 2, $fn = 6)` is a prism, and meant as one. Without both sizes by name, no prism is proposed.
    fn prism_of_few_sides(&self) -> Option<String> {
        let before = self.before();
        let open = unclosed(before)?;
        let behind = &self.text[self.at..];
        let inner = [&before[open + 1..], &behind[..closing(behind)?]].concat();
        let given = |name: &str| {
            let named = parts(&inner).into_iter().filter_map(|part| part.split_once('='));
            named.map(|(key, value)| (key.trim(), value.trim())).find(|(key, _)| *key == name).map(|(_, v)| v)
        };
        let sides: u32 = given("$fn")?.parse().ok().filter(|sides| (3..=12).contains(sides))?;
        let radius: f64 = given("r")?.parse().ok().filter(|r: &f64| r.is_finite() && *r > 0.0)?;
        let inner_radius = (radius * libm::cos(std::f64::consts::PI / f64::from(sides)) * 1e4).round() / 1e4;
        let height = given("h")?;
        let is_cylinder = last_word(&before[..open]) == "cylinder" && fits(&[height]);
        is_cylinder.then(|| {
            format!(
                "a prism with {sides} sides is `(all i in 0..{sides}: half_space([1, 0, 0], [{inner_radius}, 0, 0])\
                 .rotate_z(i*360 deg/{sides})) and 0 <= z <= {height}`"
            )
        })
    }

    /// `let f = lambda a: a^2`
    pub(super) fn function_without_a_name(&self) -> Option<Diagnostic> {
        let line = self.on_its_line().trim_end();
        let head = line.strip_suffix("lambda")?.trim_end();
        let (parameters, body) = self.text[self.at..].lines().next()?.split_once(':')?;
        let [parameters, body] = [parameters.trim(), first_part(body)];
        let name = head.strip_suffix('=').map_or("", |head| last_word(head.trim_end()));
        let name = if name.is_empty() { "f" } else { name };
        let written = match fits(&[name, parameters, body]) {
            true => format!("fn {name}({parameters}) = {body}"),
            false => "fn f(a) = a^2".to_string(),
        };
        Some(
            self.unexpected().help(format!("a function has a name and a line of its own: write `{written}`")),
        )
    }
}

/// Transformations in front of a shape, with which a text begins, as they are written here: behind it. A shape of
/// OpenSCAD has the name that it has here. The rest of the text comes with them.
fn methods_behind(text: &str) -> Option<(String, &str)> {
    let (mut rest, mut methods) = (text.trim_start(), Vec::new());
    loop {
        let (name, behind) = rest.split_at(token_end(rest));
        let arguments = bracketed(behind)?;
        rest = behind[arguments.len() + 2..].trim_start_matches([' ', '\t']);
        let next = &rest[..token_end(rest)];
        let goes_on = next.starts_with(|c: char| c.is_alphabetic()) && !KEYWORDS.contains(&next);
        if !goes_on {
            let shape = foreign::shape(name, arguments).unwrap_or_else(|| format!("{name}({arguments})"));
            let is_shape = foreign::method(name).is_none() && !name.is_empty();
            methods.push(shape);
            methods.reverse();
            return is_shape.then(|| (methods.concat(), rest));
        }
        methods
            .push(foreign::of_a_profile(name, arguments).or_else(|| foreign::method_call(name, arguments))?);
    }
}
