//! A plot of error against cost of a flow, both logarithmic, with a line for each method and each known
//! quantity.

use std::fmt::Write;
use std::path::Path;

use super::super::Failure;
use super::super::plot::{self, Axis, Labels, Legend, LogAxis};
use super::flow_run::FlowRun;
use rfm::experiment::Deviation;
use rfm::sph::Method;

/// Colours of the methods, in the order of their list; a longer list repeats them.
const COLOURS: [&str; 6] = ["#2f855a", "#1b6ca8", "#c05621", "#6b46c1", "#b83280", "#4a5568"];

/// Dash patterns for the lines of the first, second and third known quantity.
const DASHES: [&str; 3] = ["none", "7 4", "2 4"];

/// A line of the plot.
struct Line {
    name: String,
    colour: &'static str,
    dashes: &'static str,
    /// Places on the page, with the number of particles at each.
    points: Vec<(f64, f64)>,
    particles: Vec<usize>,
}

/// Draws the plot as SVG or PNG. Runs that failed, or took no measurable time, are left out.
pub(super) fn draw(scene: &str, rows: &[FlowRun], path: &Path) -> Result<Vec<u8>, Failure> {
    let is_shown = |x: f64| x > 0.0 && x.is_finite();
    let known: Vec<usize> =
        (0..3).filter(|&k| rows.iter().any(|row| row.errors()[k].is_some_and(is_shown))).collect();
    let marks: Vec<(&FlowRun, usize, f64)> = rows
        .iter()
        .filter(|row| is_shown(row.cpu_seconds))
        .flat_map(|row| known.iter().filter_map(move |&k| Some((row, k, row.errors()[k]?))))
        .filter(|&(.., error)| is_shown(error))
        .collect();
    let mut out = plot::begin(&format!("{scene}: error against cost"));
    if marks.is_empty() {
        plot::sentence(&mut out, "no run has an error that can be plotted");
        return plot::end(out, path);
    }
    let x =
        LogAxis::over(marks.iter().map(|(row, ..)| row.cpu_seconds), plot::LEFT, plot::WIDTH - plot::RIGHT);
    let y = LogAxis::over(marks.iter().map(|(.., error)| *error), plot::HEIGHT - plot::BOTTOM, plot::TOP);
    plot::grid(
        &mut out,
        &x,
        &y,
        ["processor time, s", "relative deviation (no unit)"],
        plot::WIDTH - plot::RIGHT,
    );
    let mut lines = Vec::new();
    for (method, colour) in Method::all().iter().map(Method::name).zip(COLOURS.into_iter().cycle()) {
        for (&k, dashes) in known.iter().zip(DASHES) {
            let own = || marks.iter().filter(|(row, quantity, _)| row.method == method && *quantity == k);
            let points: Vec<_> = own().map(|(row, _, error)| (x.at(row.cpu_seconds), y.at(*error))).collect();
            if !points.is_empty() {
                let particles = own().map(|(row, ..)| row.particles).collect();
                let name = format!("{method}, {}", Deviation::NAMES[k]);
                lines.push(Line { name, colour, dashes, points, particles });
            }
        }
    }
    draw_lines(&mut out, &lines);
    plot::end(out, path)
}

/// Draws the lines, each mark with the number of particles beside it, and the legend.
fn draw_lines(out: &mut String, lines: &[Line]) {
    let mut legend = Legend::new();
    for Line { name, colour, dashes, points, .. } in lines {
        let path: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        // writing to a String cannot fail
        let _ = write!(
            out,
            r##"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>"##,
            path.join(" ")
        );
        for (x, y) in points {
            plot::dot(out, *x, *y, colour);
        }
        legend.entry(out, name, |out, x, y| plot::line_sample(out, (x, y), colour, dashes, true));
    }
    let mut labels = Labels::beside(&lines.iter().map(|line| line.points.clone()).collect::<Vec<_>>());
    for line in lines {
        for (at, particles) in line.points.iter().zip(&line.particles) {
            labels.write(out, *at, &particles.to_string());
        }
    }
    legend.gap();
    legend.remark(out, "numbers: particles");
}
