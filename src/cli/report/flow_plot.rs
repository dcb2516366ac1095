//! A plot of error against cost of a flow, both logarithmic, with a line for each method and each known
//! quantity.

use std::fmt::Write;
use std::path::Path;

use super::super::Failure;
use super::super::plot::{self, LogAxis};
use super::flow_run::FlowRun;
use rfm::experiment::Deviation;
use rfm::sph::Method;

/// Colours of the methods, in the order of their list; a longer list begins anew.
const COLOURS: [&str; 6] = ["#2f855a", "#1b6ca8", "#c05621", "#6b46c1", "#b83280", "#4a5568"];

/// Dash patterns for the lines of the first, second and third known quantity.
const DASHES: [&str; 3] = ["none", "7 4", "2 4"];

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
    let x =
        LogAxis::over(marks.iter().map(|(row, ..)| row.cpu_seconds), plot::LEFT, plot::WIDTH - plot::RIGHT);
    let y = LogAxis::over(marks.iter().map(|(.., error)| *error), plot::HEIGHT - plot::BOTTOM, plot::TOP);
    let mut out = plot::begin(&format!("{scene}: error against cost"));
    plot::grid(&mut out, &x, &y, ["processor time, s", "relative deviation"]);
    let mut legend = Vec::new();
    let methods = Method::all();
    for (method, colour) in methods.iter().map(Method::name).zip(COLOURS.into_iter().cycle()) {
        for (&k, dashes) in known.iter().zip(DASHES) {
            let own: Vec<(f64, f64, usize)> = marks
                .iter()
                .filter(|(row, quantity, _)| row.method == method && *quantity == k)
                .map(|(row, _, error)| (x.at(row.cpu_seconds), y.at(*error), row.particles))
                .collect();
            if !own.is_empty() {
                line(&mut out, &own, colour, dashes);
                legend.push((format!("{method}, {}", Deviation::NAMES[k]), colour, dashes));
            }
        }
    }
    let left = plot::WIDTH - plot::RIGHT + 14.0;
    for (i, (name, colour, dashes)) in legend.iter().enumerate() {
        let at = plot::TOP + 12.0 + 21.0 * i as f64;
        // writing to a String cannot fail
        let _ = write!(
            out,
            r##"<line x1="{left:.1}" y1="{:.1}" x2="{:.1}" y2="{:.1}" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/><text x="{:.1}" y="{at:.1}">{name}</text>"##,
            at - 4.5,
            left + 26.0,
            at - 4.5,
            left + 33.0
        );
    }
    let below = plot::TOP + 12.0 + 21.0 * legend.len() as f64 + 8.0;
    let _ = write!(out, r##"<text x="{left:.1}" y="{below:.1}" font-size="11">numbers: particles</text>"##);
    plot::end(out, path)
}

/// A line through its points, each with the number of particles beside it.
fn line(out: &mut String, points: &[(f64, f64, usize)], colour: &str, dashes: &str) {
    let path: Vec<String> = points.iter().map(|(x, y, _)| format!("{x:.1},{y:.1}")).collect();
    // writing to a String cannot fail
    let _ = write!(
        out,
        r##"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>"##,
        path.join(" ")
    );
    for (x, y, particles) in points {
        let _ = write!(
            out,
            r##"<circle cx="{x:.1}" cy="{y:.1}" r="4.5" fill="{colour}"/><text x="{:.1}" y="{:.1}" font-size="11">{particles}</text>"##,
            x + 7.0,
            y - 6.0
        );
    }
}
