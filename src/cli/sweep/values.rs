//! `--sweep NAME=A..B:N` and `--sweep NAME=A,B,…`: the values that a param goes through.

use super::super::values::{Definition, definition};
use rfm::quantity::{number_and_unit, parse_quantity, parse_unit};

/// A param with the values that it goes through.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::cli) struct Sweep {
    pub name: String,
    /// The unit of the values, as it was written; empty without one.
    pub unit: String,
    /// The values in that unit, in ascending order.
    pub values: Vec<f64>,
}

/// Most values of a sweep. A larger number is a typing error.
const MOST_VALUES: usize = 10_000;

/// Digits of values: what is lost to rounding does not show.
const DIGITS: usize = 12;

/// Reads `NAME=A..B:N` or `NAME=A,B,…`, with a unit behind the last number or behind all.
pub(in crate::cli) fn sweep(text: &str) -> Result<Sweep, String> {
    let form =
        "expected NAME=A..B:N or NAME=A,B,…, as in side=1..2:5, alpha=\"0..30 deg:4\" or side=1,10,100";
    let (name, range) = text.split_once('=').ok_or(form)?;
    if range.contains(',') && !range.contains("..") {
        return listed(name.trim(), range);
    }
    let (ends, count) =
        range.rsplit_once(':').ok_or_else(|| format!("the number of values is missing; {form}"))?;
    let (low, high) = ends.split_once("..").ok_or(form)?;
    let count = count.trim();
    let number: usize = count.parse().map_err(|_| format!("`{count}` is no number of values; {form}"))?;
    if number > MOST_VALUES {
        return Err(format!("{number} values: at most {MOST_VALUES} are possible"));
    }
    let (_, unit) = number_and_unit(high.trim());
    let (low, high) = (end_in(low, unit)?, end_in(high, unit)?);
    match number {
        0 => Err("0 values are none: write 2 or more".into()),
        1 => Err("1 value has no two ends: write 2 or more, or set the param by -D".into()),
        _ if low == high => Err(format!("both ends are {low}: set the param by -D")),
        _ if low > high => {
            Err(format!("the ends are out of order: write {}={high}..{low}{unit}:{number}", name.trim()))
        }
        _ if !(high - low).is_finite() => Err(format!("from {low:e} to {high:e} is too far")),
        _ => {
            let value = |i: usize| rounded(low + (high - low) * i as f64 / (number - 1) as f64);
            let values: Vec<f64> = (0..number).map(value).collect();
            if values.windows(2).any(|pair| pair[0] >= pair[1]) {
                return Err(format!("{number} values so close together do not differ in {DIGITS} digits"));
            }
            Ok(Sweep { name: name.trim().to_string(), unit: unit.to_string(), values })
        }
    }
}

/// The values of a list, in the unit behind the last one.
fn listed(name: &str, list: &str) -> Result<Sweep, String> {
    let texts: Vec<&str> = list.split(',').collect();
    if texts.len() > MOST_VALUES {
        return Err(format!("{} values: at most {MOST_VALUES} are possible", texts.len()));
    }
    let (_, unit) = number_and_unit(texts.last().map_or("", |text| text.trim()));
    let mut values = texts.iter().map(|text| end_in(text, unit)).collect::<Result<Vec<f64>, String>>()?;
    values.sort_unstable_by(f64::total_cmp);
    if let Some(pair) = values.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(format!("{} is listed twice", written(pair[0])));
    }
    Ok(Sweep { name: name.to_string(), unit: unit.to_string(), values })
}

/// An end of the range, or a value of the list, in the unit of its last one.
fn end_in(text: &str, unit: &str) -> Result<f64, String> {
    let (value, dimension) = parse_quantity(text)?;
    if !value.is_finite() {
        return Err(format!("`{}` is not finite", text.trim()));
    }
    let (number, own) = number_and_unit(text.trim());
    if own == unit || own.is_empty() {
        return number.trim().parse().map_err(|_| format!("`{number}` is not a number"));
    }
    let Some(wanted) = parse_unit(unit) else {
        return Err(format!(
            "`{}` has a unit, and the last number has none: write it behind that",
            text.trim()
        ));
    };
    if dimension != Some(wanted.dimension) {
        return Err(format!("`{own}` and `{unit}` do not measure the same"));
    }
    Ok(rounded(value / wanted.factor))
}

fn rounded(value: f64) -> f64 {
    format!("{value:.DIGITS$e}").parse().unwrap_or(value)
}

/// A value with all digits, and with an exponent where there would be many zeros.
fn written(value: f64) -> String {
    match value.abs() {
        size if size == 0.0 || (1e-9..1e9).contains(&size) => value.to_string(),
        _ => format!("{value:e}"),
    }
}

impl Sweep {
    /// The same values with a unit, as they are written behind `--sweep`.
    pub fn written_in(&self, unit: &str) -> String {
        let (Some(first), Some(last)) = (self.values.first(), self.values.last()) else {
            return String::new();
        };
        let steps = self.values.len() - 1;
        let even = |i: usize| rounded(first + (last - first) * i as f64 / steps as f64);
        let is_even = steps > 1 && self.values.iter().enumerate().all(|(i, value)| even(i) == *value);
        let values = match is_even {
            true => format!("{}..{} {unit}:{}", written(*first), written(*last), self.values.len()),
            false => {
                let all: Vec<String> = self.values.iter().map(|value| written(*value)).collect();
                format!("{} {unit}", all.join(","))
            }
        };
        format!("{}=\"{values}\"", self.name)
    }

    /// A value as a person writes it.
    pub fn shown(&self, value: f64) -> String {
        match self.unit.as_str() {
            "" => written(value),
            unit => format!("{} {unit}", written(value)),
        }
    }

    /// What sets the param to a value.
    pub fn definition(&self, value: f64) -> Result<Definition, String> {
        definition(&format!("{}={}", self.name, self.shown(value)))
    }
}

/// All combinations of the values of several sweeps: the last one changes fastest.
pub(super) fn grid(sweeps: &[Sweep]) -> Vec<Vec<f64>> {
    sweeps.iter().fold(vec![Vec::new()], |points, sweep| {
        let extended = |point: &Vec<f64>| -> Vec<Vec<f64>> {
            sweep.values.iter().map(|value| [&point[..], &[*value]].concat()).collect()
        };
        points.iter().flat_map(extended).collect()
    })
}

/// The name of the folder for a combination of values.
pub(super) fn folder(sweeps: &[Sweep], point: &[f64]) -> String {
    let part = |(sweep, value): (&Sweep, &f64)| format!("{}={}{}", sweep.name, written(*value), sweep.unit);
    let name: Vec<String> = sweeps.iter().zip(point).map(part).collect();
    name.join(",").chars().map(|c| if is_allowed(c) { c } else { '_' }).collect()
}

fn is_allowed(c: char) -> bool {
    c.is_alphanumeric() || "=,.-+_".contains(c)
}

/// Whether a folder may have been named by a sweep, and thus lies within that of the sweep.
pub(super) fn is_folder(name: &str) -> bool {
    name.contains('=') && name.chars().all(is_allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_evenly_spaced_in_the_unit_that_is_written() {
        let check = |text: &str, unit: &str, values: &[f64]| {
            let found = sweep(text).unwrap();
            assert_eq!((found.unit.as_str(), &found.values[..]), (unit, values), "{text}");
        };
        check("a=0..30 deg:4", "deg", &[0.0, 10.0, 20.0, 30.0]);
        check("a=1..2:3", "", &[1.0, 1.5, 2.0]);
        check("a=-1..1:2", "", &[-1.0, 1.0]);
        check("a=0..0.3:4", "", &[0.0, 0.1, 0.2, 0.3]);
        check("a=5mm..2cm:4", "cm", &[0.5, 1.0, 1.5, 2.0]);
        check("a = 1e-3 .. 3e-3 m/s : 3", "m/s", &[1e-3, 2e-3, 3e-3]);
        check("a=100,1,10", "", &[1.0, 10.0, 100.0]);
        check("a=5mm, 1, 3 cm", "cm", &[0.5, 1.0, 3.0]);
        let degrees = sweep("a=0..30 deg:4").unwrap().definition(30.0).unwrap();
        assert_eq!((degrees.name.as_str(), degrees.value), ("a", 30.0 * (std::f64::consts::PI / 180.0)));
    }

    #[test]
    fn the_same_values_in_a_unit_are_read_back() {
        for text in ["d=4..8:3", "d=4..8:2", "d=1,2,5,10"] {
            let (plain, again) =
                (sweep(text).unwrap(), sweep(text).unwrap().written_in("mm").replace('"', ""));
            let Sweep { values, unit, .. } = sweep(&again).unwrap();
            assert_eq!((values, unit.as_str()), (plain.values, "mm"), "{again}");
        }
    }

    #[test]
    fn what_is_no_range_is_refused_in_words() {
        for (text, reason) in [
            ("a", "expected NAME=A..B:N"),
            ("a=1..2", "the number of values is missing"),
            ("a=1:2", "expected NAME=A..B:N"),
            ("a=1..2:0", "0 values are none"),
            ("a=1..2:1", "1 value has no two ends"),
            ("a=1..2:x", "`x` is no number of values"),
            ("a=1..2:20000", "at most 10000"),
            ("a=2..1:3", "write a=1..2:3"),
            ("a=1..1:3", "both ends are 1"),
            ("a=1..inf:3", "not finite"),
            ("a=-1e308..1e308:3", "is too far"),
            ("a=1..1.0000000000001:4", "do not differ in 12 digits"),
            ("a=1mm..2:3", "write it behind that"),
            ("a=1,2,1", "1 is listed twice"),
            ("a=1,,2", "is not a number"),
            ("a=1 mm,2", "write it behind that"),
            ("a=1 s,2 mm", "do not measure the same"),
            ("a=1s..2mm:3", "do not measure the same"),
            ("a=1..2 furlong:3", "is not a unit"),
        ] {
            let error = sweep(text).unwrap_err();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }

    #[test]
    fn a_grid_has_all_combinations_and_each_its_folder() {
        let sweeps = [sweep("a=1..2:2").unwrap(), sweep("v=0..1 m/s:3").unwrap()];
        let points = grid(&sweeps);
        assert_eq!(points.len(), 6);
        assert_eq!((&points[0][..], &points[1][..]), (&[1.0, 0.0][..], &[1.0, 0.5][..]));
        assert_eq!(folder(&sweeps, &points[1]), "a=1,v=0.5m_s");
        let tiny = [sweep("a=1e-300..2e-300:2").unwrap()];
        assert_eq!(folder(&tiny, &[1e-300]), "a=1e-300");
    }
}
