//! The plot of a probe: its columns over time, with an axis for each unit.

use std::fmt::Write as _;

use super::super::output::significant;
use super::super::plot::{self, Axis, EvenAxis, HEIGHT, LEFT, Legend, RIGHT, SECOND_AXIS, TOP, WIDTH};
use super::means::{Means, rounded};
use rfm::geom;
use rfm::sph::Probe;

const COLOURS: [&str; 6] = ["#1b6ca8", "#c05621", "#2f855a", "#6b46c1", "#b7791f", "#4a5568"];

/// Dashes of lines that belong to the axis on the right, in the order of the columns; those on the left have none.
const DASHES: [&str; 3] = ["7 3", "2 3", "11 3 2 3"];

/// The widths of lines, in the order in which they are drawn: of lines that lie on each other all are seen.
const WIDTHS: [f64; 6] = [2.8, 2.4, 2.0, 1.7, 1.4, 1.1];

/// The dashes of column `k`, which belongs to an axis.
fn dashes(k: usize, axis: usize) -> &'static str {
    if axis == 0 { "none" } else { DASHES[k % DASHES.len()] }
}

/// Most points of a line.
const MOST_POINTS: usize = 2000;

/// A column of the probe's table.
struct Series {
    name: String,
    unit: &'static str,
    colour: &'static str,
    values: Vec<f64>,
}

impl Series {
    fn is_empty(&self) -> bool {
        !self.values.iter().any(|v| v.is_finite())
    }

    /// The largest of its values, without sign.
    fn size(&self) -> f64 {
        self.values.iter().fold(0.0, |most, v| f64::max(most, v.abs()))
    }

    /// Whether it has values, and all of them are zero.
    fn is_zero(&self) -> bool {
        !self.is_empty() && self.size() == 0.0
    }
}

/// Values below this part of the largest are what rounding has left of a sum that cancels, as a force across a plane of
/// symmetry.
const ROUNDING: f64 = 1e-7;

/// Whether the values of a column are nothing but rounding, beside the others of its unit. Torques are the forces times
/// their arms, so the force counts for them too: one of 1e-7 of it has an arm of 0.1 µm.
fn is_rounding(probe: &Probe, own: &Series, all: &[Series]) -> bool {
    let by_force = matches!(probe, Probe::Force { .. });
    let beside = all.iter().filter(|other| by_force || other.unit == own.unit);
    let largest = beside.map(Series::size).filter(|size| size.is_finite()).fold(0.0, f64::max);
    !own.is_empty() && own.size() < ROUNDING * largest
}

/// A plot with a line for each column over time, and with its mean, within its standard error, where one is asked
/// for. A line is interrupted where a value is missing. Without anything to show the plot is a sentence.
pub(super) fn drawn(name: &str, probe: &Probe, table: &str, means: Option<&Means>) -> String {
    let (times, series) = columns(probe, table);
    let mut out = plot::begin(name);
    if let Some(why) = nothing_to_draw(&series) {
        plot::sentence(&mut out, &why);
        return out;
    }
    let shown = |s: &&Series| !s.is_zero() && !s.is_empty() && !is_rounding(probe, s, &series);
    let mut units: Vec<&str> = Vec::new();
    for s in series.iter().filter(shown) {
        if !units.contains(&s.unit) {
            units.push(s.unit);
        }
    }
    let right = WIDTH - RIGHT - if units.len() > 1 { SECOND_AXIS } else { 0.0 };
    let x = EvenAxis::over(times.iter().copied(), LEFT, right);
    // energies are shown from their start on
    let means = means.filter(|_| *probe != Probe::Energy);
    let known = |k: usize| means.and_then(|means| means.known(k));
    let axis = |unit: &&str| {
        let own = series.iter().enumerate().filter(|(_, s)| shown(s) && s.unit == *unit);
        let values = own.flat_map(|(k, s)| s.values.iter().copied().chain(known(k)));
        EvenAxis::over(values, HEIGHT - plot::BOTTOM, TOP).with_short_numbers()
    };
    let mut axes: Vec<EvenAxis> = units.iter().map(axis).collect();
    EvenAxis::with_common_zero(&mut axes);
    plot::grid(&mut out, &x, &axes[0], ["time, s", &axis_name(&series, units[0], &axes[0])], right);
    if let Some(second) = axes.get(1) {
        plot::right_axis(&mut out, second, &axis_name(&series, units[1], second), right);
    }
    let mut legend = Legend::new();
    let lines = series.iter().enumerate().filter(|(_, s)| shown(s)).count();
    // a line alone, or a few of them, are as thin as the last ones
    let widths = &WIDTHS[WIDTHS.len().saturating_sub(lines + 1)..];
    let shown_lines = series.iter().enumerate().filter(|(_, s)| shown(s));
    for ((k, s), width) in shown_lines.zip(widths.iter().cycle()) {
        let axis = usize::from(s.unit != units[0]);
        let mean = means.and_then(|means| means.of_column(k));
        if let Some(mean) = mean {
            draw_mean(&mut out, mean, (&x, right), &axes[axis], s.colour);
        }
        if let Some(known) = known(k) {
            draw_known(&mut out, known, &axes[axis], right, s.colour);
        }
        let path = path(&times, &s.values, &x, &axes[axis]);
        // writing to a String cannot fail
        let _ = write!(
            out,
            r##"<path d="{path}" fill="none" stroke="{}" stroke-width="{width}" stroke-dasharray="{}"/>"##,
            s.colour,
            dashes(k, axis)
        );
        legend.entry(&mut out, &s.name, |out, x, y| {
            plot::line_sample(out, (x, y), s.colour, dashes(k, axis), false);
        });
        for (t, v) in lone(&times, &s.values) {
            plot::dot(&mut out, x.at(t), axes[axis].at(v), s.colour);
        }
        figures(&mut out, &mut legend, mean, known(k));
    }
    legend.gap();
    if axes.len() > 1 {
        legend.remark(&mut out, "dashed: axis on the right");
    }
    for s in series.iter().filter(|s| !shown(s)) {
        let what = match (s.is_zero(), s.is_empty()) {
            (true, _) => "zero at all times",
            (_, true) => "no values",
            _ => "zero but for rounding",
        };
        legend.remark(&mut out, &format!("{}: {what}", s.name));
    }
    out
}

/// Why a plot would have no line; `None` if it has one.
fn nothing_to_draw(series: &[Series]) -> Option<String> {
    if series.iter().all(Series::is_empty) {
        return Some("no values: there was never any fluid where this probe measures".into());
    }
    let what: Vec<&str> = series.iter().map(|s| s.name.as_str()).collect();
    let is_flat = series.iter().all(|s| s.is_zero() || s.is_empty());
    is_flat.then(|| format!("zero at all times: {}", what.join(", ")))
}

/// Adds to the legend the mean of a column from a time on, with its error, and what is known of it.
fn figures(out: &mut String, legend: &mut Legend, mean: Option<(f64, f64, Option<f64>)>, known: Option<f64>) {
    if let Some((from, mean, error)) = mean {
        let figures = match error.map(|error| rounded(mean, error)) {
            Some((mean, error)) => format!("mean {mean} ± {error}"),
            None => format!("mean {}", significant(mean, 3)),
        };
        legend.remark(out, &figures);
        legend.remark(out, &format!("from {from} s on"));
    }
    if let Some(known) = known {
        legend.remark(out, &format!("known {}", geom::significant(known)));
    }
}

/// The numbers of a table without its header.
pub(super) fn rows(table: &str) -> Vec<Vec<f64>> {
    let numbers = |line: &str| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
    table.lines().skip(1).map(numbers).collect()
}

/// The times and the columns of a table. Energies that depend on where heights are measured from are counted from the
/// start: their own size would flatten all others.
fn columns(probe: &Probe, table: &str) -> (Vec<f64>, Vec<Series>) {
    let rows = rows(table);
    let stride = rows.len().div_ceil(MOST_POINTS).max(1);
    let column = |k: usize| -> Vec<f64> {
        let shown = rows.iter().step_by(stride);
        shown.map(|row| row.get(k).copied().unwrap_or(f64::NAN)).collect()
    };
    let series = probe.columns().iter().zip(COLOURS.into_iter().cycle()).enumerate();
    let series = series.map(|(k, ((name, unit), colour))| {
        let mut values = column(k + 1);
        let from_start = *probe == Probe::Energy && ["potential", "total"].contains(name);
        let start = values.iter().copied().find(|v| v.is_finite()).unwrap_or_default();
        if from_start {
            values.iter_mut().for_each(|v| *v -= start);
        }
        let name = if from_start { format!("{name} − start") } else { (*name).to_string() };
        Series { name, unit, colour, values }
    });
    (column(0), series.collect())
}

/// What an axis measures: the common words of its columns, what they are counted from, and their unit.
fn axis_name(series: &[Series], unit: &str, axis: &EvenAxis) -> String {
    let own: Vec<&str> = series.iter().filter(|s| s.unit == unit).map(|s| s.name.as_str()).collect();
    let first = own.first().and_then(|name| name.split(' ').next()).unwrap_or_default();
    let what = match &own[..] {
        [only] => (*only).to_string(),
        all if all.iter().all(|name| name.split(' ').next() == Some(first)) => first.to_string(),
        _ if unit == "J" => "energy".into(),
        _ => "value".into(),
    };
    let what = axis.origin().map_or(what.clone(), |origin| format!("{what} − {origin}"));
    match unit {
        "1" => format!("{what} (no unit)"),
        unit => format!("{what}, {}", unit.replace(' ', "·")),
    }
}

/// Draws a mean as a line from a time on, and how far it may be off as a band around it.
fn draw_mean(
    out: &mut String,
    (from, mean, error): (f64, f64, Option<f64>),
    (x, right): (&EvenAxis, f64),
    y: &EvenAxis,
    colour: &str,
) {
    let (left, error) = (x.at(from), error.filter(|error| error.is_finite()).unwrap_or_default());
    let clamped = |value: f64| y.at(value).clamp(TOP, HEIGHT - plot::BOTTOM);
    let (top, bottom) = (clamped(mean + error), clamped(mean - error));
    // writing to a String cannot fail
    let _ = write!(
        out,
        r##"<rect x="{left:.1}" y="{top:.1}" width="{:.1}" height="{:.1}" fill="{colour}" fill-opacity="0.16"/><line x1="{left:.1}" y1="{at:.1}" x2="{right:.1}" y2="{at:.1}" stroke="{colour}" stroke-width="1" stroke-dasharray="2 2"/>"##,
        (right - left).max(0.0),
        bottom - top,
        at = clamped(mean)
    );
}

/// Draws what the scene knows of a figure as a dashed line through the plot, which says so at its end.
fn draw_known(out: &mut String, known: f64, y: &EvenAxis, right: f64, colour: &str) {
    let at = y.at(known);
    // writing to a String cannot fail
    let _ = write!(
        out,
        r##"<line x1="{LEFT:.1}" y1="{at:.1}" x2="{right:.1}" y2="{at:.1}" stroke="{colour}" stroke-width="1.2" stroke-dasharray="9 4"/><text x="{:.1}" y="{:.1}" font-size="11" text-anchor="end" fill="{colour}" stroke="#ffffff" stroke-width="3" paint-order="stroke">known</text>"##,
        right - 4.0,
        at - 4.0
    );
}

/// The values without neighbours, of which no line is seen.
fn lone<'a>(times: &'a [f64], values: &'a [f64]) -> impl Iterator<Item = (f64, f64)> + 'a {
    let is_there = |k: usize| values.get(k).is_some_and(|v| v.is_finite());
    let is_lone = move |k: &usize| is_there(*k) && !is_there(k.wrapping_sub(1)) && !is_there(k + 1);
    (0..times.len().min(values.len())).filter(is_lone).map(|k| (times[k], values[k]))
}

fn path(times: &[f64], values: &[f64], x: &EvenAxis, y: &EvenAxis) -> String {
    let mut path = String::new();
    let mut pen_down = false;
    for (t, v) in times.iter().zip(values) {
        if t.is_finite() && v.is_finite() {
            let _ = write!(path, "{}{:.1} {:.1}", if pen_down { 'L' } else { 'M' }, x.at(*t), y.at(*v));
        }
        pen_down = v.is_finite();
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The number of strokes of each line, and of the pieces that they consist of.
    fn paths(svg: &str) -> Vec<(usize, usize)> {
        let paths = svg.split("<path d=\"").skip(1).map(|p| p.split('"').next().unwrap());
        paths.map(|p| (p.matches('M').count(), p.matches('L').count())).collect()
    }

    #[test]
    fn a_single_sample_is_a_dot_and_a_mean_has_a_band() {
        let asked = rfm::lower::AskedMean { from: 1.0, known: Vec::new(), torque: false };
        let probe = Probe::Pressure { at: glam::DVec3::ZERO };
        let table = "time,pressure\n0,5\n1,7\n2,8\n3,6\n4,9\n";
        let means = Means::of("p", &probe, &asked, &rows(table));
        let svg = drawn("p", &probe, table, Some(&means));
        assert!(
            svg.contains("fill-opacity") && svg.contains(">mean 7.667") && svg.contains(">from 1 s on"),
            "{svg}"
        );
        assert!(!svg.contains("<circle"));
        let one = drawn("p", &probe, "time,pressure\n0,1000\n", None);
        assert_eq!(one.matches("<circle").count(), 1);
        // beside a gap, too
        let gap = drawn("p", &probe, "time,pressure\n0,1\n1,2\n2,nan\n3,4\n4,nan\n", None);
        assert_eq!(gap.matches("<circle").count(), 1);
    }

    #[test]
    fn what_is_known_is_a_line_with_room_for_it() {
        let asked = rfm::lower::AskedMean { from: 0.0, known: vec![12.0], torque: false };
        let probe = Probe::Pressure { at: glam::DVec3::ZERO };
        let table = "time,pressure\n0,5\n1,7\n2,8\n3,6\n4,9\n";
        let means = Means::of("p", &probe, &asked, &rows(table));
        let svg = drawn("p", &probe, table, Some(&means));
        assert!(svg.contains(">known</text>") && svg.contains(">known 12<") && svg.contains(">12<"), "{svg}");
        let line = svg.split("stroke-dasharray=\"9 4\"").next().unwrap().rsplit("y1=\"").next().unwrap();
        let y: f64 = line.split('"').next().unwrap().parse().unwrap();
        assert!((TOP..HEIGHT - plot::BOTTOM).contains(&y), "{y}");
        assert!(!drawn("p", &probe, table, None).contains("known"));
    }

    /// A height of a hundred nanometres that changes by a millionth of itself.
    #[test]
    fn numbers_that_differ_in_late_digits_are_counted_from_the_lowest() {
        let probe = Probe::Pressure { at: glam::DVec3::ZERO };
        let svg = drawn("p", &probe, "time\n0,1.350624e-7\n1,1.3506241e-7\n2,1.3506242e-7\n", None);
        assert!(svg.contains(">pressure − 1.35062398e-7, Pa<"), "{svg}");
        let labels = svg.split("text-anchor=\"end\">").skip(1).map(|rest| rest.split('<').next().unwrap());
        let longest = labels.map(|label| label.chars().count()).max().unwrap();
        assert!(longest <= 9, "{svg}");
        let plain = drawn("p", &probe, "time\n0,1000\n1,1003\n", None);
        assert!(plain.contains(">pressure, Pa<") && plain.contains(">1000.0<"), "{plain}");
    }

    #[test]
    fn a_plot_is_interrupted_where_values_are_missing() {
        let probe = Probe::Velocity { at: glam::DVec3::ZERO };
        let table = "time [s],…\n0,nan,1,2\n1,2,nan,3\n2,3,1,4\n3,4,1,5\n";
        let svg = drawn("a<b", &probe, table, None);
        assert_eq!(paths(&svg), [(1, 2), (2, 1), (1, 3)]);
        assert!(svg.contains("a&lt;b") && svg.contains(">velocity, m/s<"));
    }

    #[test]
    fn without_values_a_plot_is_a_sentence() {
        let probe = Probe::Pressure { at: glam::DVec3::ZERO };
        for (table, says) in [
            ("time [s],pressure [Pa]\n0,nan\n1,nan\n", "no values"),
            ("time [s],pressure [Pa]\n", "no values"),
            ("time [s],pressure [Pa]\n0,0\n1,nan\n2,0\n", "zero at all times: pressure"),
        ] {
            let svg = drawn("p", &probe, table, None);
            assert!(svg.contains(says) && paths(&svg).is_empty() && !svg.contains("<line"), "{svg}");
        }
    }

    #[test]
    fn forces_and_torques_have_axes_of_their_own() {
        let probe = Probe::Force { obstacle: 0, about: glam::DVec3::ZERO };
        let svg = drawn("f", &probe, "time\n0,1,2,3,1e-3,0,nan\n1,4,5,6,2e-3,0,nan\n", None);
        assert_eq!(paths(&svg).len(), 4);
        for says in
            [">force, N<", ">torque, N·m<", "0.0020", "torque y: zero at all times", "torque z: no values"]
        {
            assert!(svg.contains(says), "{says}: {svg}");
        }
    }

    /// All components of a force may be zero at first, and torques follow forces.
    #[test]
    fn lines_that_lie_on_each_other_are_told_apart() {
        let probe = Probe::Force { obstacle: 0, about: glam::DVec3::ZERO };
        let svg = drawn("f", &probe, "time\n0,1,1,1,2,2,2\n1,4,4,4,8,8,8\n", None);
        let strokes: Vec<&str> = svg
            .split("<path d=\"")
            .skip(1)
            .filter_map(|path| path.split_once("stroke-width=\"")?.1.split_once("/>"))
            .map(|(style, _)| style)
            .collect();
        let widths: Vec<f64> =
            strokes.iter().filter_map(|style| style.split('"').next()?.parse().ok()).collect();
        assert!(widths.len() == 6 && widths.is_sorted_by(|a, b| a > b), "{strokes:?}");
        let dashes: std::collections::BTreeSet<&str> = strokes
            .iter()
            .skip(3)
            .filter_map(|style| style.split_once("dasharray=\""))
            .map(|(_, d)| d)
            .collect();
        assert_eq!(dashes.len(), 3, "{strokes:?}");
    }

    #[test]
    fn what_rounding_leaves_of_a_component_fills_no_axis() {
        let probe = Probe::Force { obstacle: 0, about: glam::DVec3::ZERO };
        let svg = drawn(
            "f",
            &probe,
            "time\n0,2e3,1e-5,-900,1e-6,-2e-5,3e-6\n1,1e3,-2e-5,-800,2e-6,1e-5,1e-6\n",
            None,
        );
        assert_eq!(paths(&svg).len(), 2, "{svg}");
        assert!(!svg.contains(">torque, N·m<") && svg.contains("force y: zero but for rounding"), "{svg}");
        // small forces beside small ones are shown, and so is a torque of a short arm
        let svg = drawn("f", &probe, "time\n0,2e-6,1e-7,0,1e-11,0,0\n1,1e-6,2e-7,0,2e-11,0,0\n", None);
        assert_eq!(paths(&svg).len(), 3, "{svg}");
    }

    #[test]
    fn energies_are_counted_from_the_start_where_only_differences_mean_anything() {
        let svg = drawn("e", &Probe::Energy, "time\n0,0,1000,0,1000\n1,5,995,0,1000\n2,8,991,0,999\n", None);
        assert!(svg.contains("potential − start") && svg.contains(">energy, J<"), "{svg}");
        assert!(!svg.contains("1000"), "{svg}");
    }
}
