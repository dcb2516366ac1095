//! Means over the samples of a probe, as the summary tells them.

use rfm::experiment::Mean;
use rfm::lower::AskedMean;
use rfm::sph::Probe;
use serde::Serialize;

/// The means of a probe's figures.
#[derive(Debug, Serialize)]
pub(super) struct Means {
    probe: String,
    /// The time of the first sample that counts, s.
    from: f64,
    samples: usize,
    /// Names of the figures, with their units.
    columns: Vec<String>,
    mean: Vec<f64>,
    /// The standard errors; null where there are too few samples to tell.
    error: Vec<Option<f64>>,
    /// What the scene knows of the first figures; empty if it states nothing.
    known: Vec<f64>,
    /// How far the first figures are from what is known, as a part of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    deviation: Option<f64>,
}

impl Means {
    /// The means of a table's rows, each of which begins with its time; `None` if no row counts.
    pub fn of(name: &str, probe: &Probe, asked: &AskedMean, rows: &[Vec<f64>]) -> Option<Self> {
        let counted: Vec<&Vec<f64>> =
            rows.iter().filter(|row| row.first().is_some_and(|time| *time >= asked.from)).collect();
        let mut means = Vec::new();
        for column in 1..=probe.columns().len() {
            means.push(Mean::of(counted.iter().filter_map(|row| row.get(column).copied()))?);
        }
        let known = asked.known.clone();
        let off = known.iter().zip(&means).map(|(known, mean)| (mean.value - known).powi(2)).sum::<f64>();
        let size = known.iter().map(|known| known * known).sum::<f64>();
        Some(Self {
            probe: name.to_string(),
            from: asked.from,
            samples: means.iter().map(|mean| mean.samples).min().unwrap_or_default(),
            columns: probe.columns().iter().map(|(name, unit)| format!("{name} [{unit}]")).collect(),
            mean: means.iter().map(|mean| mean.value).collect(),
            error: means.iter().map(|mean| mean.error).collect(),
            deviation: (size > 0.0).then(|| (off / size).sqrt()),
            known,
        })
    }

    /// The means as a line of text.
    pub fn line(&self) -> String {
        let mut line = format!("probe {}, mean from {} s on:", self.probe, self.from);
        let figures = self.columns.iter().zip(&self.mean).zip(&self.error);
        for (k, ((column, mean), error)) in figures.enumerate() {
            let (name, unit) = column.split_once(" [").unwrap_or((column, ""));
            let unit = unit.trim_end_matches(']');
            let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
            let separator = if k == 0 { "" } else { "," };
            line += &match error {
                Some(error) => format!("{separator} {name} {} ± {error:.1e}{unit}", rounded(*mean, *error)),
                None => format!("{separator} {name} {mean:.4e}{unit}"),
            };
        }
        if let Some(deviation) = self.deviation {
            line += &format!("; {:.2} % from what is known", 100.0 * deviation);
        }
        line
    }
}

/// A value with as many digits as its error leaves it.
fn rounded(value: f64, error: f64) -> String {
    let digits = if error > 0.0 { 1.0 - error.log10().floor() } else { 6.0 };
    format!("{value:.0$}", digits.clamp(0.0, 12.0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_before_the_start_do_not_count() {
        let rows: Vec<Vec<f64>> = (0..100)
            .map(|i| vec![0.01 * f64::from(i), if i < 50 { 7.0 } else { 2.0 + 0.1 * f64::from(i % 2) }])
            .collect();
        let asked = AskedMean { from: 0.5, known: vec![2.0] };
        let probe = Probe::Pressure { at: glam::DVec3::ZERO };
        let means = Means::of("p", &probe, &asked, &rows).unwrap();
        assert_eq!((means.samples, means.columns[0].as_str()), (50, "pressure [Pa]"));
        assert!((means.mean[0] - 2.05).abs() < 1e-12 && (means.deviation.unwrap() - 0.025).abs() < 1e-12);
        assert!(means.line().starts_with("probe p, mean from 0.5 s on: pressure 2.05"), "{}", means.line());
        assert!(means.line().ends_with(" Pa; 2.50 % from what is known"), "{}", means.line());
        assert!(Means::of("p", &probe, &AskedMean { from: 2.0, known: vec![] }, &rows).is_none());
    }
}
