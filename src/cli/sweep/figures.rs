//! The main figures of a command at one combination of values, from the documents that it gives with `--json`.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A figure, which is a number, or a mean over time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Figure {
    /// Its name, with the solid or the probe that it belongs to.
    pub name: String,
    pub value: f64,
    /// The standard error of a mean; how far a volume or an area may be off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Empty for a plain number.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Whether it belongs to what the cells show, which is not all of the solid.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unresolved: bool,
}

impl Figure {
    fn new(name: impl Into<String>, value: &Value) -> Option<Self> {
        let value = value.as_f64().or(value.as_bool().map(f64::from))?;
        value.is_finite().then(|| Self {
            name: name.into(),
            value,
            error: None,
            unit: String::new(),
            unresolved: false,
        })
    }
}

/// The commands that can be swept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Command {
    Check,
    Mesh,
    Run,
    Report,
}

impl Command {
    pub fn name(self) -> &'static str {
        match self {
            Self::Check => "check",
            Self::Mesh => "mesh",
            Self::Run => "run",
            Self::Report => "report",
        }
    }

    /// The figures in a document. Files of the command are in `folder`.
    pub fn figures(self, document: &Value, folder: &Path) -> Vec<Figure> {
        match self {
            Self::Check => of_solids(document),
            Self::Mesh => {
                keys(document, "", &["triangles", "volume", "area", "max_distance", "thin_cells", "closed"])
            }
            Self::Run => {
                // a study is about what it measures
                let mut figures = of_probes(&folder.join("probes"));
                figures.extend(keys(document, "", &RUN));
                figures
            }
            Self::Report => of_report(document),
        }
    }
}

/// What judges a run.
const RUN: [&str; 9] = [
    "energy_excess",
    "volume_change",
    "compression_mean",
    "compression_p99",
    "crowded",
    "max_speed",
    "pressure_error",
    "velocity_error",
    "front_error",
];

/// The figure that says whether a solid is resolved.
const RESOLVED: &str = "resolved";

/// Whether a figure's name is that of one that volumes and areas already show, for people.
pub(super) fn is_said_elsewhere(name: &str) -> bool {
    name.rsplit('.').next() == Some(RESOLVED)
}

/// Those of some keys of an object that are numbers.
fn keys(object: &Value, prefix: &str, names: &[&str]) -> Vec<Figure> {
    let figure = |name: &&str| {
        let figure = Figure::new(format!("{prefix}{name}"), &object[*name])?;
        Some(Figure { unit: unit(name).into(), ..figure })
    };
    names.iter().filter_map(figure).collect()
}

/// The unit of a key; empty for a plain number.
fn unit(key: &str) -> &'static str {
    match key {
        "volume" => "m³",
        "area" => "m²",
        "max_distance" => "m",
        "max_speed" => "m/s",
        "cpu_seconds" => "s",
        "milliseconds" => "ms",
        "ns_per_point" => "ns",
        _ => "",
    }
}

fn of_solids(document: &Value) -> Vec<Figure> {
    let solids = document["solids"].as_array().map_or(&[][..], |list| list);
    let figures = |solid: &Value| {
        let prefix = match (solids.len(), solid["name"].as_str()) {
            (2.., Some(name)) => format!("{name}."),
            _ => String::new(),
        };
        let mut figures = keys(solid, &prefix, &["volume", "area", "components", RESOLVED]);
        let resolved = solid[RESOLVED] != Value::Bool(false) || solid["lines"].is_u64();
        for (key, error) in [("volume", "volume_error"), ("area", "area_error")] {
            if let Some(figure) = figures.iter_mut().find(|figure| figure.name == format!("{prefix}{key}")) {
                figure.unresolved = !resolved;
                figure.error = solid[error].as_f64().filter(|_| resolved);
            }
        }
        figures
    };
    solids.iter().flat_map(figures).collect()
}

/// The figures of a report: for a solid the fastest program of ω over many points in f64, and the finest
/// mesh; for a flow the errors and the time of each run.
fn of_report(document: &Value) -> Vec<Figure> {
    let rows = document["rows"].as_array().map_or(&[][..], |list| list);
    if document["scene"].is_string() {
        let of_run = |row: &Value| {
            let name = |key: &str| row[key].as_str().unwrap_or_default().to_string();
            let prefix = match rows.len() {
                1 => String::new(),
                _ => format!("{}.{}.", name("method"), row["particles"]),
            };
            keys(row, &prefix, &["velocity_error", "pressure_error", "front_error", "cpu_seconds"])
        };
        return rows.iter().flat_map(of_run).collect();
    }
    let is_value =
        |row: &&Value| row["program"] == "value" && row["precision"] == "f64" && row["shape"] == "many";
    let time = |row: &Value| row["ns_per_point"].as_f64().unwrap_or(f64::INFINITY);
    let fastest = rows.iter().filter(is_value).min_by(|a, b| time(a).total_cmp(&time(b)));
    let mut figures = fastest
        .map_or_else(Vec::new, |row| keys(row, "", &["ns_per_point", "max_abs_error", "certified_error"]));
    if let Some(mesh) = document["meshes"].as_array().and_then(|meshes| meshes.last()) {
        figures.extend(keys(mesh, "mesh.", &["triangles", "milliseconds", "volume_error"]));
    }
    figures
}

/// The means of all columns of the probes' tables over the second half of the samples.
fn of_probes(folder: &Path) -> Vec<Figure> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut tables: Vec<_> = entries.map(|entry| entry.path()).collect();
    tables.retain(|path| path.extension().is_some_and(|ending| ending == "csv"));
    tables.sort();
    let of_table = |path: &std::path::PathBuf| {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        means(&name, &std::fs::read_to_string(path).unwrap_or_default())
    };
    tables.iter().flat_map(of_table).collect()
}

/// Stretches of time over which means are compared: samples within one depend on each other.
const STRETCHES: usize = 8;

fn means(probe: &str, table: &str) -> Vec<Figure> {
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()).collect();
    let later = &rows[rows.len() / 2..];
    let column = |i: usize| -> Vec<f64> {
        later.iter().filter_map(|row| row.get(i).copied()).filter(|value| value.is_finite()).collect()
    };
    let figure = |(i, name): (usize, &&str)| {
        let (value, error) = mean(&column(i))?;
        // `height [m]`
        let (quantity, unit) = name.split_once(" [").unwrap_or((name, ""));
        let unit = unit.trim_end_matches(']').into();
        Some(Figure { name: format!("{probe}.{quantity}"), value, error, unit, unresolved: false })
    };
    names.iter().enumerate().skip(1).filter_map(figure).collect()
}

/// The mean of samples in the order of time, and its standard error from the means of stretches of time; `None` for the
/// error if there are too few.
fn mean(samples: &[f64]) -> Option<(f64, Option<f64>)> {
    let of = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    if samples.is_empty() {
        return None;
    }
    let mean = of(samples);
    let length = samples.len() / STRETCHES;
    if length < 2 {
        return Some((mean, None));
    }
    let parts: Vec<f64> = samples.chunks_exact(length).take(STRETCHES).map(of).collect();
    let middle = of(&parts);
    let variance = parts.iter().map(|part| (part - middle).powi(2)).sum::<f64>() / (STRETCHES - 1) as f64;
    Some((mean, Some((variance / STRETCHES as f64).sqrt())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_of_the_second_half_with_the_error_of_stretches() {
        // 0 for a while, then 16 samples in 8 stretches whose means are 1, 3, 1, 3, …: 2 ± √(8·1/7/8)
        let first = (0..16).map(|i| format!("{i},0\n")).collect::<String>();
        let second = (0..16).map(|i| format!("{},{}\n", 16 + i, if i / 2 % 2 == 0 { 1 } else { 3 }));
        let table = format!("time [s],height [m]\n{first}{}", second.collect::<String>());
        let found = means("gauge", &table);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].name.as_str(), found[0].value), ("gauge.height", 2.0));
        assert!((found[0].error.unwrap() - (1.0_f64 / 7.0).sqrt()).abs() < 1e-12, "{found:?}");
        // few samples have a mean and no error; those that are missing do not count
        let few = means("p", "time [s],a [m]\n0,1\n1,nan\n2,4\n3,6\n");
        assert_eq!((few[0].value, few[0].error), (5.0, None));
        assert_eq!(means("p", "time [s],a [m]\n"), []);
    }
}
