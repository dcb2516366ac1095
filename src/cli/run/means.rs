//! Means over the samples of a probe, as the summary shows them.

use rfm::experiment::Mean;
use rfm::lower::AskedMean;
use rfm::sph::Probe;
use serde::Serialize;

/// Instants this part of a time later are the same.
const ROUNDING: f64 = 1e-9;

/// The means of a probe's figures.
#[derive(Debug, Serialize)]
pub(super) struct Means {
    probe: String,
    /// The time of the first sample that counts, s.
    from: f64,
    samples: usize,
    /// Samples that the run took and that the table lacked when it went on; they may be among those that count.
    #[serde(rename = "samples_lost", skip_serializing_if = "is_zero")]
    lost: usize,
    /// Names of the figures, with their units.
    columns: Vec<String>,
    mean: Vec<Option<f64>>,
    /// The standard errors; null where there are too few samples for them.
    error: Vec<Option<f64>>,
    /// What the scene knows of the first figures; empty if it states nothing.
    known: Vec<f64>,
    /// Columns that text shows.
    #[serde(skip)]
    shown: usize,
    /// How far the first figures are from what is known, as a part of it, or in their unit if it is zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    deviation: Option<f64>,
}

// serde asks for a reference
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// Columns that text shows where no torque is asked for.
const WITHOUT_TORQUE: usize = 3;

impl Means {
    /// The means of a table's rows, each of which begins with its time. A row stands for the time since the
    /// one before it.
    pub fn of(name: &str, probe: &Probe, asked: &AskedMean, rows: &[Vec<f64>]) -> Self {
        let time = |row: &[f64]| row.first().copied().unwrap_or(f64::NAN);
        let mean_of = |column: usize| {
            let pairs = rows.windows(2).filter(|pair| time(&pair[1]) > asked.from * (1.0 + ROUNDING));
            Mean::of(pairs.map(|pair| {
                let value = pair[1].get(column).copied().unwrap_or(f64::NAN);
                (value, time(&pair[1]) - time(&pair[0]))
            }))
        };
        let means: Vec<Option<Mean>> = (1..=probe.columns().len()).map(mean_of).collect();
        let known = asked.known.clone();
        let off: Option<f64> =
            known.iter().zip(&means).map(|(known, mean)| Some((mean.as_ref()?.value - known).powi(2))).sum();
        let size = known.iter().map(|known| known * known).sum::<f64>();
        let size = if size > 0.0 { size } else { 1.0 };
        Self {
            probe: name.to_string(),
            from: asked.from.max(rows.first().map_or(0.0, |row| time(row))),
            samples: means.iter().map(|mean| mean.map_or(0, |mean| mean.samples)).max().unwrap_or_default(),
            lost: 0,
            columns: probe.columns().iter().map(|(name, unit)| format!("{name} [{unit}]")).collect(),
            mean: means.iter().map(|mean| mean.map(|mean| mean.value)).collect(),
            error: means.iter().map(|mean| mean.and_then(|mean| mean.error)).collect(),
            deviation: off.filter(|_| !known.is_empty()).map(|off| (off / size).sqrt()),
            known,
            shown: if asked.torque { usize::MAX } else { WITHOUT_TORQUE },
        }
    }

    /// The time from which values count, s, and the mean and standard error of a column, counted from 0.
    pub fn of_column(&self, column: usize) -> Option<(f64, f64, Option<f64>)> {
        let mean = (*self.mean.get(column)?)?;
        Some((self.from, mean, self.error.get(column).copied().flatten()))
    }

    /// What the scene knows of a column, counted from 0.
    pub fn known(&self, column: usize) -> Option<f64> {
        self.known.get(column).copied()
    }

    /// These means, taken from a table that lacks the given number of samples.
    pub fn lacking(self, lost: usize) -> Self {
        Self { lost, ..self }
    }

    /// The means as a line of text.
    pub fn line(&self) -> String {
        let mut line = format!("probe {}, mean from {} s on:", self.probe, self.from);
        if self.mean.iter().all(Option::is_none) {
            return line + " no value was sampled";
        }
        let figures = self.columns.iter().zip(&self.mean).zip(&self.error).take(self.shown);
        for (k, ((column, mean), error)) in figures.enumerate() {
            let mean = mean.unwrap_or(f64::NAN);
            let (name, unit) = name_and_unit(column);
            let separator = if k == 0 { "" } else { "," };
            line += &match error {
                Some(error) => {
                    let (mean, error) = rounded(mean, *error);
                    format!("{separator} {name} {mean} ± {error}{unit}")
                }
                None => format!("{separator} {name} {}{unit}", alone(mean)),
            };
        }
        if self.error.iter().take(self.shown).any(Option::is_none) {
            line += " (too few samples for an error)";
        }
        if let Some(deviation) = self.deviation {
            line += &match self.known.iter().all(|known| *known == 0.0) {
                true => {
                    let unit = self.columns.first().map_or(String::new(), |column| name_and_unit(column).1);
                    format!("; {}{unit} from what is known", alone(deviation))
                }
                false => format!("; {:.2} % from what is known", 100.0 * deviation),
            };
        }
        if self.lost > 0 {
            line += &format!("; {} samples of its table are lost (W0517), so this may be wrong", self.lost);
        }
        line
    }
}

/// The name of a column, and its unit with a space before it, if it has one.
fn name_and_unit(column: &str) -> (&str, String) {
    let (name, unit) = column.split_once(" [").unwrap_or((column, ""));
    let unit = unit.trim_end_matches(']');
    (name, if unit.is_empty() || unit == "1" { String::new() } else { format!(" {unit}") })
}

/// Sizes of values that are written without an exponent.
const PLAIN: std::ops::Range<f64> = 1e-3..1e7;

/// A value of which no error is known, with five digits.
fn alone(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let decimals = 4.0 - value.abs().log10().floor();
    match PLAIN.contains(&value.abs()) {
        true => format!("{value:.0$}", decimals.clamp(0.0, 12.0) as usize),
        false => format!("{value:.4e}"),
    }
}

/// A value with the digits that its error leaves it, and the error with two, in one notation.
pub(super) fn rounded(value: f64, error: f64) -> (String, String) {
    let last = if error > 0.0 { error.log10().floor() - 1.0 } else { -6.0 };
    let size = value.abs().max(error);
    if size == 0.0 || PLAIN.contains(&size) {
        let decimals = (-last).clamp(0.0, 12.0) as usize;
        // two digits of an error above a hundred
        let error = if last > 0.0 { (error / 10_f64.powf(last)).round() * 10_f64.powf(last) } else { error };
        return (format!("{value:.decimals$}"), format!("{error:.decimals$}"));
    }
    let digits = if error > 0.0 { value.abs().log10().floor() - last } else { 6.0 };
    (format!("{value:.0$e}", digits.clamp(0.0, 12.0) as usize), format!("{error:.1e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_digits_that_their_errors_leave() {
        let check = |value, error, expected: [&str; 2]| {
            assert_eq!(rounded(value, error), (expected[0].to_string(), expected[1].to_string()));
        };
        check(236.0712, 0.11, ["236.07", "0.11"]);
        check(136.4, 31.2, ["136", "31"]);
        check(1362.7, 143.0, ["1363", "140"]);
        check(8.7234, 0.748, ["8.72", "0.75"]);
        check(0.0, 0.11, ["0.00", "0.11"]);
        check(5e-4, 0.11, ["0.00", "0.11"]);
        check(-3e-7, 6.5e-6, ["-3e-7", "6.5e-6"]);
        check(3.414567e-10, 2.1e-12, ["3.415e-10", "2.1e-12"]);
        check(3.413119e14, 2e11, ["3.4131e14", "2.0e11"]);
        let shown = [662.234_56, 0.012_345_67, -1.5e-9, 0.0].map(alone);
        assert_eq!(shown, ["662.23", "0.012346", "-1.5000e-9", "0"]);
    }

    #[test]
    fn rows_before_the_start_do_not_count() {
        let rows: Vec<Vec<f64>> = (0..100)
            .map(|i| vec![0.01 * f64::from(i), if i < 50 { 7.0 } else { 2.0 + 0.1 * f64::from(i % 2) }])
            .collect();
        let asked = AskedMean { from: 0.5, known: vec![2.0], torque: false };
        let probe = Probe::Pressure { at: glam::DVec3::ZERO };
        let means = Means::of("p", &probe, &asked, &rows);
        // the row at the start stands for the time before it
        assert_eq!((means.samples, means.columns[0].as_str()), (49, "pressure [Pa]"));
        let expected = 2.0 + 0.1 * 25.0 / 49.0;
        assert!((means.mean[0].unwrap() - expected).abs() < 1e-9, "{:?}", means.mean);
        assert!((means.deviation.unwrap() / (expected / 2.0 - 1.0) - 1.0).abs() < 1e-9);
        assert!(means.line().starts_with("probe p, mean from 0.5 s on: pressure 2.05"), "{}", means.line());
        assert!(means.line().ends_with(" Pa; 2.55 % from what is known"), "{}", means.line());
        let none = Means::of("p", &probe, &AskedMean { from: 2.0, known: vec![0.0], torque: false }, &rows);
        assert_eq!((none.samples, none.deviation), (0, None));
        assert!(none.line().ends_with(": no value was sampled"), "{}", none.line());
    }

    #[test]
    fn a_row_counts_as_long_as_it_stands_for() {
        let rows = [vec![0.0, 9.0], vec![1.0, 4.0], vec![4.0, 8.0]];
        let probe = Probe::Height { x: 0.0, y: 0.0 };
        let means = Means::of("h", &probe, &AskedMean { from: 0.0, known: vec![0.0], torque: false }, &rows);
        assert_eq!((means.mean[0], means.deviation), (Some(7.0), Some(7.0)));
        assert!(means.line().ends_with("; 7.0000 m from what is known"), "{}", means.line());
    }

    #[test]
    fn torques_are_told_where_their_point_is_stated() {
        let rows = [vec![0.0; 7], vec![1.0; 7], vec![2.0; 7]];
        let probe = Probe::Force { obstacle: 0, about: glam::DVec3::ZERO };
        let line = |torque: bool| {
            let asked = AskedMean { from: 0.0, known: Vec::new(), torque };
            Means::of("f", &probe, &asked, &rows).line()
        };
        assert!(line(true).contains("torque z 1.5"), "{}", line(true));
        assert!(line(false).contains("force z 1.5") && !line(false).contains("torque"), "{}", line(false));
    }
}
