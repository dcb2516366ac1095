//! The plot of a sweep: one panel for each figure that changes, over the first param, with a line for each
//! combination of the others.

use std::fmt::Write;

use super::super::plot::{self, Legend};
use super::figures::is_said_elsewhere;
use super::index::{Index, Row};
use rfm::{geom, slice};

/// Maximum number of panels: the first figures are the main ones.
const MOST_PANELS: usize = 12;

/// More panels than this stand in two columns.
const FEW_PANELS: usize = 3;

/// Room to the right of a panel without a legend.
const MARGIN: f64 = 40.0;

/// The height of a line of text below the panels, and the mean width of its letters.
const REMARK_HEIGHT: f64 = 24.0;
const WIDTH_OF_LETTER: f64 = 6.8;

/// Lines of a panel that have an entry in the legend.
const MOST_ENTRIES: usize = 16;

const COLOURS: [&str; 8] =
    ["#1b6ca8", "#c05621", "#2f855a", "#6b46c1", "#b83280", "#4a5568", "#975a16", "#2c7a7b"];

/// A line of a panel: the combination that it belongs to, and its points with their errors.
struct Line {
    name: String,
    points: Vec<[f64; 3]>,
}

/// Draws all panels, as SVG.
pub(super) fn draw(index: &Index) -> String {
    let changes = |name: &&str| {
        let mut values = index.figures(name).map(|figure| figure.value);
        let first = values.next();
        values.any(|value| Some(value) != first)
    };
    let own = index.names().into_iter().filter(|name| !is_said_elsewhere(name));
    let (mut names, same): (Vec<&str>, Vec<&str>) = own.partition(changes);
    let more = names.split_off(names.len().min(MOST_PANELS));
    let panels: Vec<String> = match names.is_empty() {
        true => vec![empty(index)],
        false => names.iter().map(|name| panel(index, name)).collect(),
    };
    let columns = if panels.len() > FEW_PANELS { 2 } else { 1 };
    let width = plot::WIDTH * columns as f64;
    let bottom = plot::HEIGHT * panels.len().div_ceil(columns) as f64;
    let remarks = remarks(index, &same, &more, width);
    let height = bottom + REMARK_HEIGHT * remarks.len() as f64;
    let mut out = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}"><rect width="100%" height="100%" fill="#ffffff"/>"##
    );
    for (i, panel) in panels.iter().enumerate() {
        let (x, y) = (plot::WIDTH * (i % columns) as f64, plot::HEIGHT * (i / columns) as f64);
        out.push_str(&panel.replacen("<svg ", &format!("<svg x=\"{x}\" y=\"{y}\" "), 1));
        out.push_str("</svg>\n");
    }
    for (i, remark) in remarks.iter().enumerate() {
        let y = bottom + REMARK_HEIGHT * (i as f64 + 0.4);
        // writing to a String cannot fail
        let _ = writeln!(
            out,
            r##"<text x="{}" y="{y:.1}" font-family="Ubuntu, sans-serif" font-size="13">{}</text>"##,
            plot::LEFT,
            slice::escaped(remark)
        );
    }
    out.push_str("</svg>\n");
    out
}

/// What has no panel, in lines that fit a page: figures that are the same at all values, and those beyond the last panel.
fn remarks(index: &Index, same: &[&str], more: &[&str], width: f64) -> Vec<String> {
    let value = |name: &&str| {
        let first = index.figures(name).next();
        first.map_or_else(
            || (*name).to_string(),
            |figure| format!("{name} {}", geom::significant(figure.value)),
        )
    };
    let same: Vec<String> = same.iter().map(value).collect();
    let more: Vec<String> = more.iter().map(|name| (*name).to_string()).collect();
    let letters = ((width - 2.0 * plot::LEFT) / WIDTH_OF_LETTER) as usize;
    [("the same at all values: ", same), ("not drawn, but in table.csv: ", more)]
        .into_iter()
        .filter(|(_, names)| !names.is_empty())
        .flat_map(|(what, names)| wrapped(what, &names, letters))
        .collect()
}

/// Names behind some words, in lines of at most so many letters.
fn wrapped(words: &str, names: &[String], letters: usize) -> Vec<String> {
    let mut lines = vec![words.to_string()];
    for (i, name) in names.iter().enumerate() {
        let part = if i + 1 < names.len() { format!("{name}, ") } else { name.clone() };
        match lines.last_mut() {
            Some(line) if line.chars().count() + part.chars().count() <= letters => line.push_str(&part),
            _ => lines.push(part),
        }
    }
    lines
}

fn empty(index: &Index) -> String {
    let mut out = plot::begin(&index.file);
    plot::sentence(&mut out, "no figure changes with what is swept");
    out
}

fn panel(index: &Index, name: &str) -> String {
    let lines = lines(index, name);
    // a line alone needs no legend, and has its room
    let has_legend = lines.iter().any(|line| !line.name.is_empty());
    let right = plot::WIDTH - if has_legend { plot::RIGHT } else { MARGIN };
    let points = || lines.iter().flat_map(|line| &line.points);
    let places: Vec<f64> = points().map(|point| point[0]).collect();
    let x = plot::over_params(&places, plot::LEFT, right);
    let ends: Vec<f64> = points().flat_map(|[_, value, error]| [value - error, value + error]).collect();
    let values: Vec<f64> = points().map(|point| point[1]).collect();
    let y = plot::over_figures(&values, &ends, plot::HEIGHT - plot::BOTTOM, plot::TOP);
    let unit = index.figures(name).map(|figure| figure.unit.as_str()).find(|unit| !unit.is_empty());
    let named = if index.is_mean(name) { format!("{name}, mean of the second half") } else { name.into() };
    let mut out = plot::begin(&unit.map_or_else(|| named.clone(), |unit| format!("{named}, {unit}")));
    let along = index.sweeps.first().map_or_else(String::new, |axis| slice::escaped(&axis.column()));
    // the title names what goes up
    plot::grid(&mut out, &*x, &*y, [&along, ""], right);
    let mut legend = Legend::new();
    for (i, (line, colour)) in lines.iter().zip(COLOURS.into_iter().cycle()).enumerate() {
        let path: Vec<String> = line
            .points
            .iter()
            .map(|[at, value, _]| format!("{:.1},{:.1}", x.at(*at), y.at(*value)))
            .collect();
        // writing to a String cannot fail
        let _ = write!(
            out,
            r##"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="2"/>"##,
            path.join(" ")
        );
        for [at, value, error] in &line.points {
            if *error > 0.0 {
                let _ = write!(
                    out,
                    r##"<line x1="{0:.1}" y1="{1:.1}" x2="{0:.1}" y2="{2:.1}" stroke="{colour}"/>"##,
                    x.at(*at),
                    y.at(value - error),
                    y.at(value + error)
                );
            }
            plot::dot(&mut out, x.at(*at), y.at(*value), colour);
        }
        if !line.name.is_empty() && i < MOST_ENTRIES {
            legend.entry(&mut out, &line.name, |out, x, y| {
                plot::line_sample(out, (x, y), colour, "none", true)
            });
        }
    }
    if points().any(|[.., error]| *error > 0.0) {
        let bars = format!("bars: {}", index.kind_of_error());
        match has_legend {
            true => {
                legend.gap();
                legend.remark(&mut out, &bars);
            }
            false => {
                let _ = write!(
                    out,
                    r##"<text x="{right:.1}" y="{:.1}" font-size="11" text-anchor="end">{}</text>"##,
                    plot::HEIGHT - 0.3 * plot::BOTTOM,
                    slice::escaped(&bars)
                );
            }
        }
    }
    out
}

/// The points of a figure, by the values of all params but the first.
fn lines(index: &Index, name: &str) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    for row in &index.rows {
        let (Some(at), Some(figure)) =
            (row.values.first(), row.figures.iter().find(|figure| figure.name == name))
        else {
            continue;
        };
        let point = [*at, figure.value, figure.error.unwrap_or(0.0)];
        let others = others(index, row);
        match lines.iter_mut().find(|line| line.name == others) {
            Some(line) => line.points.push(point),
            None => lines.push(Line { name: others, points: vec![point] }),
        }
    }
    lines
}

fn others(index: &Index, row: &Row) -> String {
    let shown = |(axis, value): (&super::index::Axis, &f64)| match axis.unit.as_str() {
        "" => format!("{} = {value}", axis.name),
        unit => format!("{} = {value} {unit}", axis.name),
    };
    index.sweeps.iter().zip(&row.values).skip(1).map(shown).collect::<Vec<_>>().join(", ")
}
