//! What a sweep leaves in its folder: `index.json`, and the table and the plot are made of it.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::super::Failure;
use super::super::output::{self, Shown};
use super::figures::{Figure, is_said_elsewhere};

pub(super) const INDEX: &str = "index.json";

/// The content of `index.json`.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Index {
    pub schema: u32,
    pub command: String,
    pub file: String,
    /// Hash of the file, of all that it imports, and of the command's options.
    pub fingerprint: String,
    pub sweeps: Vec<Axis>,
    pub rows: Vec<Row>,
}

/// A param that is swept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Axis {
    pub name: String,
    pub unit: String,
    pub values: Vec<f64>,
}

/// The outcome of one combination.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    /// Its folder, within that of the sweep.
    pub folder: String,
    /// The values of the params, in the units of the sweeps.
    pub values: Vec<f64>,
    pub figures: Vec<Figure>,
    /// The exit code that the command alone would have had.
    pub exit: u8,
    /// Why there is a code other than 0.
    pub failure: Option<String>,
}

/// The reader for whom a table is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reader {
    /// Five digits, and errors behind them.
    Person,
    /// All digits, and columns for errors.
    Program,
}

impl Axis {
    /// The name of its column.
    pub fn column(&self) -> String {
        match self.unit.as_str() {
            "" => self.name.clone(),
            unit => format!("{} [{unit}]", self.name),
        }
    }
}

impl Index {
    /// The index of a folder; `None` if there is none.
    pub fn read(folder: &Path) -> Option<Result<Self, Failure>> {
        let path = folder.join(INDEX);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return None,
            Err(error) => {
                return Some(Err(Failure::usage(format!("cannot read `{}`: {error}", path.shown()))));
            }
        };
        Some(serde_json::from_str(&text).map_err(|error| {
            Failure::usage(format!(
                "`{}` is not the index of a sweep, write elsewhere with --into DIR: {error}",
                path.shown()
            ))
        }))
    }

    pub fn write(&self, folder: &Path) -> Result<(), Failure> {
        output::write(&folder.join(INDEX), |out| {
            serde_json::to_writer_pretty(&mut *out, self)?;
            writeln!(out)
        })
    }

    /// Adds a row in place of one for the same values. Rows are sorted by their values.
    pub fn insert(&mut self, row: Row) {
        self.rows.retain(|known| known.folder != row.folder);
        let before = |known: &Row| {
            let pairs = known.values.iter().zip(&row.values);
            pairs.map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).is_none_or(|order| order.is_lt())
        };
        let place = self.rows.partition_point(before);
        self.rows.insert(place, row);
    }

    /// The table as a CSV file.
    pub fn table(&self) -> String {
        self.cells(Reader::Program).iter().map(|line| line.join(",") + "\n").collect()
    }

    /// The names of all figures, in the order in which they first appear.
    pub fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for figure in self.rows.iter().flat_map(|row| &row.figures) {
            if !names.contains(&figure.name.as_str()) {
                names.push(&figure.name);
            }
        }
        names
    }

    /// The table: the names of the columns, then a line for each combination.
    fn cells(&self, reader: Reader) -> Vec<Vec<String>> {
        let mut names = self.names();
        let is_file = reader == Reader::Program;
        if !is_file {
            names.retain(|name| !is_said_elsewhere(name));
        }
        let has_error = |name: &str| self.figures(name).any(|figure| figure.error.is_some());
        let mut head: Vec<String> = self.sweeps.iter().map(Axis::column).collect();
        for name in &names {
            head.push((*name).to_string());
            if is_file && has_error(name) {
                head.push(format!("{name} {}", self.kind_of_error()));
            }
        }
        head.push("failure".into());
        let line = |row: &Row| {
            let mut cells: Vec<String> = row.values.iter().map(f64::to_string).collect();
            for name in &names {
                let figure = row.figures.iter().find(|figure| figure.name == *name);
                let error = figure.and_then(|figure| figure.error);
                match (is_file, figure) {
                    (true, _) => {
                        cells.push(figure.map_or_else(String::new, |figure| figure.value.to_string()));
                        if has_error(name) {
                            cells.push(error.map_or_else(String::new, |error| error.to_string()));
                        }
                    }
                    (false, None) => cells.push("–".into()),
                    (false, Some(figure)) => cells.push(short(figure)),
                }
            }
            let failure = row.failure.as_deref().unwrap_or_default();
            cells.push(if is_file { quoted(failure) } else { failure.to_string() });
            cells
        };
        std::iter::once(head).chain(self.rows.iter().map(line)).collect()
    }

    /// What the errors of figures are.
    pub fn kind_of_error(&self) -> &'static str {
        match self.command.as_str() {
            "run" => "standard error",
            _ => "error",
        }
    }

    pub fn figures<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Figure> {
        self.rows.iter().flat_map(|row| &row.figures).filter(move |figure| figure.name == name)
    }

    /// Prints the table for people.
    pub fn print(&self) {
        let mut cells = self.cells(Reader::Person);
        if self.rows.iter().all(|row| row.failure.is_none()) {
            cells.iter_mut().for_each(|line| drop(line.pop()));
        }
        let width = |column: usize| cells.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..cells.first().map_or(0, Vec::len)).map(width).collect();
        for line in &cells {
            let padded: Vec<String> =
                line.iter().zip(&widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
            say!("{}", padded.join("  ").trim_end());
        }
        if self.names().iter().any(|name| self.is_mean(name)) {
            say!("figures of probes are means over the second half of their samples, with standard errors");
        }
    }

    /// Whether a figure is the mean of a probe.
    pub fn is_mean(&self, name: &str) -> bool {
        self.command == "run" && name.contains('.')
    }
}

/// A figure with five digits, and its error behind it.
fn short(figure: &Figure) -> String {
    let number = |value: f64| match value.abs() {
        _ if value == value.round() && value.abs() < 1e7 => format!("{value}"),
        size if (1e-3..1e6).contains(&size) => {
            let digits = (4 - size.log10().floor() as i32).max(0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.4e}"),
    };
    match figure.error.filter(|error| *error > 0.0) {
        _ if figure.unresolved => format!("{}, not resolved", number(figure.value)),
        Some(error) => format!("{} ± {error:.1e}", number(figure.value)),
        None => number(figure.value),
    }
}

/// A cell of a CSV file.
fn quoted(text: &str) -> String {
    match text.contains([',', '"', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_string(),
    }
}
