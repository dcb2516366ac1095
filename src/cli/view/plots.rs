//! Quantities over time for a page: those that a run has written as tables, and those of a live run.
//!
//! A table becomes a plot for each unit, so that each plot has one axis. Parts of one are shown in per cent.

use std::path::{Path, PathBuf};

use crate::cli::saved::{HISTORY, OWN_TABLES};
use rfm::lower::Scene;
use rfm::sph::{Gauge, Probe, Simulation};
use rfm::view::{Column, Plot};

/// Most points of a plot.
const MOST_POINTS: usize = 1000;

/// Maximum number of samples of a live run; beyond it every other one is left out.
const MOST_SAMPLES: usize = 600;

/// Times with columns of values.
#[derive(Clone)]
struct Table {
    name: String,
    times: Vec<f64>,
    columns: Vec<TableColumn>,
}

#[derive(Clone)]
struct TableColumn {
    name: String,
    unit: String,
    values: Vec<f64>,
}

impl Table {
    /// A table of `rfm run`. `None` if the file is another one.
    fn read(path: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(path).ok()?;
        let (header, lines) = text.split_once('\n')?;
        let mut names = header.split(',').map(|name| name.trim().trim_end_matches(']').split_once(" ["));
        names.next().flatten().filter(|(name, unit)| (*name, *unit) == ("time", "s"))?;
        let names: Vec<(&str, &str)> = names.collect::<Option<_>>()?;
        let numbers =
            |line: &str| line.split(',').map(|word| word.trim().parse().ok()).collect::<Option<Vec<f64>>>();
        let rows: Vec<Vec<f64>> =
            lines.lines().filter_map(numbers).filter(|row| row.len() == names.len() + 1).collect();
        let every = rows.len().div_ceil(MOST_POINTS).max(1);
        let values = |k: usize| rows.iter().step_by(every).map(|row| row[k]).collect::<Vec<f64>>();
        let columns = names.iter().enumerate().map(|(k, (name, unit))| TableColumn {
            name: name.to_string(),
            unit: unit.to_string(),
            values: values(k + 1),
        });
        let name = path.file_stem()?.to_string_lossy().into_owned();
        Some(Self { name, times: values(0), columns: columns.collect() })
            .filter(|table| !table.times.is_empty())
    }

    /// The columns of a probe without values.
    fn of(name: &str, probe: &Probe) -> Self {
        let columns = probe.columns().iter().map(|(name, unit)| TableColumn {
            name: name.to_string(),
            unit: unit.to_string(),
            values: Vec::new(),
        });
        Self { name: name.to_string(), times: Vec::new(), columns: columns.collect() }
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|column| column.name.as_str())
    }

    /// Leaves out every other row.
    fn thin(&mut self) {
        let halved = |values: &mut Vec<f64>| *values = values.iter().copied().step_by(2).collect();
        halved(&mut self.times);
        self.columns.iter_mut().for_each(|column| halved(&mut column.values));
    }

    /// A plot for each unit.
    fn plots(&self) -> Vec<Plot> {
        let mut units: Vec<&str> = Vec::new();
        for column in &self.columns {
            if !units.contains(&column.unit.as_str()) {
                units.push(&column.unit);
            }
        }
        let plot = |unit: &&str| {
            let (shown, factor) = if *unit == "1" { ("%", 100.0) } else { (*unit, 1.0) };
            let same = self.columns.iter().filter(|column| column.unit == *unit);
            let columns = same.map(|column| Column {
                name: column.name.clone(),
                values: column.values.iter().map(|value| rounded(factor * value)).collect(),
            });
            Plot {
                name: self.name.clone(),
                unit: shown.to_string(),
                times: self.times.iter().copied().map(rounded).collect(),
                columns: columns.collect(),
            }
        };
        units.iter().map(plot).collect()
    }
}

/// The plots of a run's folder: its energy and its audit, then its probes. A table that cannot be read is
/// left out: it may be a file of the user's.
pub(super) fn saved(folder: &Path) -> Vec<Plot> {
    let files = std::fs::read_dir(folder.join("probes")).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = files.map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "csv"));
    paths.sort();
    let probes: Vec<Table> = paths.iter().filter_map(|path| Table::read(path)).collect();
    let own = OWN_TABLES
        .iter()
        .filter_map(|(name, _)| Table::read(&folder.join(HISTORY).join(format!("{name}.csv"))));
    // a probe of the scene that measures the same has more samples
    let own = own.filter(|own| !probes.iter().any(|probe| probe.names().eq(own.names())));
    own.chain(probes.iter().cloned()).flat_map(|table| table.plots()).collect()
}

/// The quantities of a live run.
pub(super) struct History {
    probes: Vec<(Gauge, Table)>,
    /// One sample in this number is kept.
    every: usize,
    /// The samples so far, kept or not.
    passed: usize,
}

impl History {
    /// The energy, the audit and the probes of a scene, with a first sample.
    pub fn start(simulation: &mut Simulation, scene: &Scene) -> Self {
        let stated = scene.probes.iter().map(|probe| (probe.name.as_str(), probe.measured));
        let stated: Vec<(&str, Probe)> = stated.collect();
        let own = OWN_TABLES.into_iter().filter(|(_, own)| !stated.iter().any(|(_, probe)| probe == own));
        let prepared = own.chain(stated.iter().copied()).filter_map(|(name, probe)| {
            // the check of the scene has refused probes of obstacles that are not there
            Some((simulation.gauge(probe).ok()?, Table::of(name, &probe)))
        });
        let mut history = Self { probes: prepared.collect(), every: 1, passed: 0 };
        history.sample(simulation);
        history
    }

    /// Takes a sample, at most one at each instant.
    pub fn sample(&mut self, simulation: &Simulation) {
        let last = self.probes.first().and_then(|(_, table)| table.times.last());
        if last == Some(&simulation.time()) {
            return;
        }
        let is_kept = self.passed.is_multiple_of(self.every);
        self.passed += 1;
        if !is_kept {
            return;
        }
        for (gauge, table) in &mut self.probes {
            table.times.push(simulation.time());
            let values = simulation.sample(gauge);
            table.columns.iter_mut().zip(values).for_each(|(column, value)| column.values.push(value));
        }
        if self.probes.first().is_some_and(|(_, table)| table.times.len() > MOST_SAMPLES) {
            self.probes.iter_mut().for_each(|(_, table)| table.thin());
            self.every *= 2;
        }
    }

    pub fn plots(&self) -> Vec<Plot> {
        self.probes.iter().flat_map(|(_, table)| table.plots()).collect()
    }
}

/// Six digits are more than a plot shows.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(times: Vec<f64>) -> Table {
        let column = |name: &str, unit: &str, factor: f64| TableColumn {
            name: name.into(),
            unit: unit.into(),
            values: times.iter().map(|t| factor * t).collect(),
        };
        let columns = vec![column("a", "1", 1.0), column("speed", "m/s", 2.0), column("b", "1", 3.0)];
        Table { name: "audit".into(), columns, times }
    }

    #[test]
    fn each_unit_has_a_plot_and_parts_become_per_cent() {
        let plots = table(vec![0.0, 0.123_456_789]).plots();
        let [parts, speeds] = &plots[..] else { panic!("{plots:?}") };
        assert_eq!((parts.unit.as_str(), speeds.unit.as_str()), ("%", "m/s"));
        assert_eq!(parts.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
        assert_eq!(parts.columns[1].values, [0.0, 37.037]);
        assert_eq!(speeds.columns[0].values, [0.0, 0.246_914]);
        assert_eq!(speeds.times, [0.0, 0.123_457]);
    }

    #[test]
    fn tables_of_others_are_left_out_and_torn_lines_skipped() {
        let folder = tempfile::tempdir().unwrap();
        [HISTORY, "probes"].iter().for_each(|part| std::fs::create_dir(folder.path().join(part)).unwrap());
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("history/energy.csv", "time [s],kinetic [J]\n0,1\n0.1,nan\n0.2,");
        write("history/audit.csv", "my notes\n");
        write("probes/gauge.csv", "time [s],height [m]\n0,2\n");
        write("probes/mine.csv", "a,b\n1,2\n");
        let plots = saved(folder.path());
        assert_eq!(plots.iter().map(|plot| plot.name.as_str()).collect::<Vec<_>>(), ["energy", "gauge"]);
        assert_eq!(plots[0].times, [0.0, 0.1]);
        assert!(plots[0].columns[0].values[1].is_nan());
        // the same quantity from a probe of the scene
        write("probes/all.csv", "time [s],kinetic [J]\n0,1\n");
        assert_eq!(saved(folder.path())[0].name, "all");
    }

    #[test]
    fn numbers_keep_six_digits_and_odd_ones_stay() {
        assert_eq!(
            [1.0 / 3.0, -2e-300, 123_456_789.0, 0.0].map(rounded),
            [0.333_333, -2e-300, 123_457_000.0, 0.0]
        );
        assert!(rounded(f64::NAN).is_nan());
        assert_eq!(rounded(f64::INFINITY), f64::INFINITY);
        assert_eq!(rounded(5e-324), 5e-324);
    }
}
