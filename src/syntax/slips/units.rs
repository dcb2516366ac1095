//! Slips in units: behind formulas, of other systems, and in other spellings.

use super::super::foreign;
use super::Slip;
use super::pieces::{fits, last_part, last_word, number_ends, token_end, words};
use crate::diagnostic::{Code, Diagnostic, Span, nearest};
use crate::quantity::parse_unit;

impl Slip<'_> {
    /// A word after a number that is no unit.
    pub(super) fn unit(&self, number: &str) -> Diagnostic {
        const UNITS: [&str; 14] =
            ["m", "mm", "cm", "km", "s", "ms", "min", "kg", "g", "N", "Pa", "J", "deg", "rad"];
        let word = self.found;
        let unknown =
            Diagnostic::error(Code::UNKNOWN_UNIT, self.span, format!("unknown unit `{word}` after a number"))
                .at("not a unit");
        if foreign::is_letter_of_type(word) {
            return unknown.help(format!("numbers have no type: write `{number}`"));
        }
        let is_range = || self.after().lines().next().is_some_and(|rest| rest.contains(".."));
        if word == "in" && is_range() {
            return unknown.help("only a param has a range, as in `param d = 2 in 0 .. 5`");
        }
        if let Some(known) = self.unit_of_another_system(number) {
            return known;
        }
        if word == "to" {
            return self.range_with_to(number);
        }
        if matches!(word, "e" | "E") && self.after().starts_with([')', ',', ']', ' ', '\n']) {
            let message = format!("`{number}{word}` has no exponent");
            let help = format!("write `{number}`, or with a power of ten `{number}e3`");
            return Diagnostic::error(Code::SYNTAX, self.span, message).help(help);
        }
        if word == "pi" {
            return unknown.help(format!("a product has a sign: write `{number}*pi`"));
        }
        if word.starts_with('_') {
            let digits: String = word.chars().filter(|c| *c != '_').collect();
            return unknown.help(format!("digits are not grouped: write `{number}{digits}`"));
        }
        // a name that is merely like a unit, as `radius` is, is more likely a factor
        let is_alike = |meant: &&str| {
            let [word, meant] = [word, *meant].map(str::as_bytes);
            word.last_chunk::<4>() == meant.last_chunk::<4>()
                || word.first_chunk::<5>() == meant.first_chunk::<5>()
        };
        if let Some(meant) = nearest(word, foreign::UNITS_IN_FULL).filter(is_alike)
            && let Some(written) = foreign::quantity(number, meant)
        {
            return unknown.help(format!("is `{meant}` meant? write `{written}`"));
        }
        let is_name = |other: &&str| other.as_ptr() != word.as_ptr() && *other == word;
        let is_known = ["x", "y", "z", "t"].contains(&word) || words(self.text).any(|w| is_name(&w));
        unknown
            .help(match is_known {
                true => format!("a word after a number is its unit; to multiply, write `{number}*{word}`"),
                false => "a word after a number is its unit, such as `mm`, `kg` or `deg`".to_string(),
            })
            .suggest(word, UNITS.into_iter().filter(|_| word.chars().count() > 1))
    }

    /// `5 inch`, `3000 rev/min`: a unit that is converted.
    fn unit_of_another_system(&self, number: &str) -> Option<Diagnostic> {
        let word = self.found;
        let divisor = self.after().strip_prefix('/').map(|behind| &behind[..token_end(behind)]);
        let divisor = divisor.filter(|divisor| parse_unit(divisor).is_some());
        let per = divisor.map_or(String::new(), |divisor| format!("/{divisor}"));
        let unit = format!("{word}{per}");
        let converted = |number: &str| {
            let of_one = || foreign::quantity(number, word).map(|written| format!("{written}{per}"));
            foreign::quantity(number, &unit).or_else(of_one)
        };
        let written = converted(number)?;
        let line = self.on_its_line().trim_end();
        let before = line.strip_suffix(number).unwrap_or(line);
        let span = Span::new(self.span.source, self.at, self.at + unit.len());
        let message = format!("unknown unit `{unit}` after a number");
        // `1/2 inch` is half of one
        let help = match converted("1").filter(|_| before.ends_with('/')) {
            Some(one) => format!("write `{}*{one}`", last_part(line)),
            None => format!("write `{written}`"),
        };
        Some(Diagnostic::error(Code::UNKNOWN_UNIT, span, message).at("not a unit").help(help))
    }

    /// `0 to 5`, of a param or of a fold, in which both ends are meant.
    fn range_with_to(&self, start: &str) -> Diagnostic {
        let end = self.after().trim_start();
        let end = &end[..token_end(end)];
        let of_a_param = self.on_its_line().trim_start().starts_with("param ");
        let range = match end.parse::<u64>() {
            _ if of_a_param && fits(&[end]) => format!("{start} .. {end}"),
            Ok(last) if last < u64::MAX => format!("{start}..{}", last + 1),
            Ok(_) | Err(_) => "0..6".to_string(),
        };
        let ends = if of_a_param { "" } else { ", and ends before its second number" };
        self.unexpected().help(format!("a range is written with dots{ends}: write `{range}`"))
    }

    /// `n mm`, `(1 + n) mm`: a unit behind something that is no number.
    pub(super) fn unit_of_a_formula(&self, before: &str, unit: &str, span: Span) -> Option<Diagnostic> {
        parse_unit(unit)?;
        // names stand in front of a `=`
        if !before.contains(['=', ':']) || before.trim_start().starts_with("fn ") && !before.contains('=') {
            return None;
        }
        // within shapes an hour or a gram is more likely a name
        if !self.in_braces() && unit.chars().count() == 1 && unit != "m" {
            return None;
        }
        let value = last_part(before).trim();
        let value = if fits(&[value]) { value } else { "n" };
        let is_sum = has_a_sum(value);
        // of a sum in which another part has its unit, the last one is meant
        let has_units = value.split_whitespace().any(|word| parse_unit(word).is_some());
        let written = match (is_sum, has_units) {
            (true, true) => format!("… + {}*1 {unit}", value.rsplit(['+', '-']).next().unwrap_or("n").trim()),
            (true, false) => format!("({value})*1 {unit}"),
            (false, _) => format!("{value}*1 {unit}"),
        };
        let diagnostic = Diagnostic::error(Code::SYNTAX, span, "a unit stands behind a number");
        // a letter may be a name as well
        let or = if unit.chars().count() == 1 { "; or is a comma or a sign missing?" } else { "" };
        Some(diagnostic.help(format!("write `{written}`{or}")))
    }

    /// `velocity: [0, 0, -1] m/s` in a block, where the grammar takes the unit for the next key.
    pub(super) fn unit_of_a_vector(&self) -> Option<Diagnostic> {
        // the grammar may have taken the next key for the name of a block
        let before = match self.found {
            ":" => self.before().strip_suffix(last_word(self.before()))?.trim_end(),
            _ => self.before(),
        };
        let word = last_word(before);
        let vector = before.strip_suffix(word)?.trim_end();
        if word.is_empty() || !self.in_braces() || !vector.ends_with(']') {
            return None;
        }
        let start = self.start + before.len() - word.len();
        let ends = |c: char| c.is_whitespace() || matches!(c, ',' | '}' | ')' | ']' | ';' | '#' | ':');
        let unit = self.text[start..].split(ends).next().unwrap_or_default();
        parse_unit(unit)?;
        // a key may have the name of a unit
        let behind = self.text[start + unit.len()..].trim_start();
        if behind.starts_with([':', '{']) {
            return None;
        }
        let (_, inner) = vector[..vector.len() - 1].rsplit_once('[')?;
        let parts: Vec<&str> = inner.split(',').map(str::trim).collect();
        let are_numbers = parts.iter().all(|part| part.parse::<f64>().is_ok());
        let help = if are_numbers {
            let parts: Vec<String> = parts.iter().map(|part| format!("{part} {unit}")).collect();
            format!("each component has its own, as in `[{}]`", parts.join(", "))
        } else {
            "each component has its own, as in `[0, 0, -1 m/s]`: leave this one out".to_string()
        };
        let span = Span::new(self.span.source, start, start + unit.len());
        Some(Diagnostic::error(Code::SYNTAX, span, "a unit stands behind a number").help(help))
    }

    /// `viscosity: 1 cP }`, `1000 kg m^-3`: the text behind the number is no unit, or continues behind one,
    /// so the grammar takes it for the next key.
    pub(super) fn unit_taken_for_a_key(&self) -> Option<Diagnostic> {
        // the next word or bracket may stand on a line of its own, and a `:` behind that word
        let before = self.before();
        let before = match self.found {
            ":" => {
                before.strip_suffix(last_word(before)).filter(|rest| rest.ends_with([' ', '\n']))?.trim_end()
            }
            _ => before,
        };
        let line_start = before.rfind('\n').map_or(self.start.min(self.at), |n| self.start + n + 1);
        let line = before.get(line_start.saturating_sub(self.start)..)?;
        let word = last_word(line);
        if !self.in_braces() || matches!(self.found, "{" | "=" | "[") || word.is_empty() {
            return None;
        }
        let value_start = line.rfind([':', ',', '[', '{', '='])? + 1;
        let end = if self.found == ":" { line_start + line.len() } else { self.text.len() };
        let value = self.text[line_start + value_start..end].lines().next().unwrap_or_default();
        let value = value.split([',', '}', ']', ')', '#', ';']).next().unwrap_or_default().trim_end();
        let number = value.len() - value.trim_start().trim_start_matches('-').len();
        let number_length = number_at(&value[number..]);
        if number_length == 0 {
            let before = line[..line.len() - word.len()].trim_end();
            let start = line_start + line.len() - word.len();
            let span = Span::new(self.span.source, start, start + word.len());
            let is_value = before.ends_with(|c: char| c.is_alphanumeric() || ")_²³".contains(c));
            return (is_value && !number_ends(before) && line[..value_start].ends_with(':'))
                .then(|| self.unit_of_a_formula(before, word, span))
                .flatten();
        }
        let (number, unit) = value[number..].split_at(number_length);
        let start = line_start + value_start + value.len() - unit.trim_start().len();
        let unit = unit.trim();
        let is_word = unit.starts_with(|c: char| c.is_alphabetic() || c == '°');
        if !is_word || parse_unit(unit).is_some() || !fits(&[unit]) {
            return None;
        }
        // of several words each must be a unit: what follows one may be the next key
        let words: Vec<&str> = unit.split(SEPARATORS).filter(|word| !word.is_empty()).collect();
        let is_unit = |word: &&str| {
            let base = base(word);
            !base.is_empty() && (parse_unit(base).is_some() || foreign::quantity("1", base).is_some())
        };
        let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '°';
        let own = spelled(unit);
        let is_known = foreign::quantity("1", &own).is_some() || words.iter().all(is_unit);
        if !words.iter().all(|word| base(word).chars().all(is_part)) || words.len() > 1 && !is_known {
            return None;
        }
        let span = Span::new(self.span.source, start, start + unit.len());
        let written = match parse_unit(&own) {
            Some(_) => Some(format!("{number} {own}")),
            None => foreign::quantity(number, &own),
        };
        let message = format!("unknown unit `{unit}` after a number");
        let help = match written {
            Some(written) => format!("write `{written}`"),
            None => {
                "units are made of m, s, kg, N, Pa, J, deg and their multiples, as in `kg/m^3` and `Pa·s`"
                    .into()
            }
        };
        Some(Diagnostic::error(Code::UNKNOWN_UNIT, span, message).at("not a unit").help(help))
    }
}

/// The length of the number that a text begins with.
fn number_at(text: &str) -> usize {
    let length =
        |text: &str| text.len() - text.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.').len();
    let mantissa = length(text);
    let exponent = text[mantissa..].strip_prefix(['e', 'E']).map_or(0, |rest| {
        let sign = usize::from(rest.starts_with(['+', '-']));
        let digits = length(&rest[sign..]);
        if digits > 0 { 1 + sign + digits } else { 0 }
    });
    if text.starts_with(|c: char| c.is_ascii_digit() || c == '.') { mantissa + exponent } else { 0 }
}

/// What stands between the parts of a unit.
const SEPARATORS: [char; 5] = [' ', '*', '·', '.', '/'];

/// A part of a unit without its power.
fn base(part: &str) -> &str {
    part.trim_end_matches(|c: char| c.is_ascii_digit() || "-^⁻¹²³".contains(c))
}

/// A unit as it is spelled here: `kg m^-3` is `kg/m^3`, `Pa.s` is `Pa·s`, and `g/cm3` is `g/cm^3`.
fn spelled(unit: &str) -> String {
    let unit =
        unit.replace("**", "^").replace('⁻', "-").replace('¹', "1").replace('²', "2").replace('³', "3");
    let (mut above, mut below) = (Vec::new(), Vec::new());
    let mut divided = false;
    for part in unit.split_inclusive(SEPARATORS) {
        let word = part.trim_end_matches(SEPARATORS);
        if !word.is_empty() {
            let base = base(word);
            let power = word[base.len()..].trim_start_matches('^');
            let turned = power.starts_with('-');
            let power = match power.trim_start_matches('-') {
                "" | "1" => String::new(),
                digits => format!("^{digits}"),
            };
            (if divided == turned { &mut above } else { &mut below }).push(format!("{base}{power}"));
        }
        divided = part.ends_with('/') || divided && word.is_empty();
    }
    if above.is_empty() {
        return below.iter().map(|part| format!("{part}^-1")).collect::<Vec<_>>().join("·");
    }
    [vec![above.join("·")], below].concat().join("/")
}

/// Whether a formula adds or subtracts outside of brackets, but for the sign of its first number.
fn has_a_sum(formula: &str) -> bool {
    let mut depth = 0_i32;
    formula.char_indices().any(|(at, c)| {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ => {}
        }
        at > 0 && depth == 0 && matches!(c, '+' | '-')
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_in_other_spellings() {
        for (text, expected) in [
            ("kg m^-3", "kg/m^3"),
            ("kg/m3", "kg/m^3"),
            ("kg*m**-3", "kg/m^3"),
            ("g / cm³", "g/cm^3"),
            ("Pa.s", "Pa·s"),
            ("m s^-2", "m/s^2"),
            ("N m", "N·m"),
            ("mPa s", "mPa·s"),
        ] {
            assert_eq!(spelled(text), expected);
        }
    }
}
