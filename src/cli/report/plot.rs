//! Speed against error as a picture, with a mark for each program.

use std::fmt::Write;
use std::path::Path;

use super::super::failure::Failure;
use super::super::plot::{
    Axis, BOTTOM, HEIGHT, LEFT, Legend, LogAxis, RIGHT, TOP, WIDTH, begin, end, grid, sentence,
};
use super::programs::ProgramFigures;

/// Smaller errors are drawn at this one, because an exact answer has no place on a logarithmic axis.
const LEAST_ERROR: f64 = 1e-17;

/// The colours of programs by their precision.
const PROGRAMS: [(&str, &str, &str); 8] = [
    ("value", "f64", "#1b6ca8"),
    ("value", "f32", "#63b3ed"),
    ("gradient", "f64", "#c05621"),
    ("gradient", "f32", "#f6ad55"),
    ("sign", "f64", "#2f855a"),
    ("sign", "f32", "#8fd6a8"),
    ("range", "f64", "#6b46c1"),
    ("range", "f32", "#b794f4"),
];

/// The shapes of marks by the form of the program, as paths around the place.
const FORMS: [(&str, &str); 5] = [
    ("stable", "m-5.5 0a5.5 5.5 0 1 0 11 0a5.5 5.5 0 1 0 -11 0z"),
    ("guarded", "m0 -7l6 7l-6 7l-6 -7z"),
    ("textbook", "m0 -7l6 11h-12z"),
    ("scaled", "m-5 -5h10v10h-10z"),
    ("twin", "m-6 -3h12l-6 10z"),
];

/// The outline of programs for one point; those for columns are outlined in their own colour.
const ONE_POINT: &str = "#111111";

/// The plot as SVG or PNG, by the ending of the path.
pub(super) fn draw(solid: &str, rows: &[ProgramFigures], path: &Path) -> Result<Vec<u8>, Failure> {
    end(svg(solid, rows), path)
}

fn svg(solid: &str, rows: &[ProgramFigures]) -> String {
    let marks: Vec<Mark> = rows.iter().filter_map(Mark::of).collect();
    let mut out = begin(&format!("{solid}: speed against error"));
    if marks.is_empty() {
        sentence(&mut out, "no program has an error that can be plotted");
        return out;
    }
    let x = LogAxis::over(marks.iter().map(|mark| mark.row.ns_per_point), LEFT, WIDTH - RIGHT);
    let y = LogAxis::over(marks.iter().map(|mark| mark.error), HEIGHT - BOTTOM, TOP);
    grid(
        &mut out,
        &x,
        &y,
        ["time per point on one thread, ns", "largest relative error (no unit)"],
        WIDTH - RIGHT,
    );
    for mark in &marks {
        mark.draw(&mut out, x.at(mark.row.ns_per_point), y.at(mark.error));
    }
    legend(&mut out, &marks);
    out
}

/// A program with a place in the plot.
struct Mark<'a> {
    row: &'a ProgramFigures,
    error: f64,
    colour: &'static str,
    shape: &'static str,
}

impl<'a> Mark<'a> {
    /// `None` for a program without a finite error.
    fn of(row: &'a ProgramFigures) -> Option<Self> {
        let error = row.max_rel_error?.max(LEAST_ERROR);
        let is_own = |(program, precision, _): &&(&str, &str, &str)| {
            *program == row.program && *precision == row.precision
        };
        let (.., colour) = PROGRAMS.iter().find(is_own)?;
        let (_, shape) = FORMS.iter().find(|(form, _)| *form == row.form)?;
        error.is_finite().then_some(Self { row, error, colour, shape })
    }

    fn is_interpreted(&self) -> bool {
        self.row.engine == "interp"
    }

    fn is_of_one_point(&self) -> bool {
        self.row.shape == "one"
    }

    fn draw(&self, out: &mut String, x: f64, y: f64) {
        let fill = if self.is_interpreted() { "#ffffff" } else { self.colour };
        let stroke = if self.is_of_one_point() { ONE_POINT } else { self.colour };
        shape(out, (x, y), self.shape, fill, stroke);
    }
}

fn shape(out: &mut String, (x, y): (f64, f64), path: &str, fill: &str, stroke: &str) {
    // writing to a String cannot fail
    let _ = write!(
        out,
        r##"<path d="M{x:.1} {y:.1}{path}" fill="{fill}" stroke="{stroke}" stroke-width="1.6"/>"##
    );
}

/// Explains every colour, shape and outline that occurs.
fn legend(out: &mut String, marks: &[Mark<'_>]) {
    const GREY: &str = "#888888";
    let mut legend = Legend::new();
    let (_, circle) = FORMS[0];
    for (program, precision, colour) in PROGRAMS {
        if marks.iter().any(|mark| mark.colour == colour) {
            let text = format!("{program}, {precision}");
            legend.entry(out, &text, |out, x, y| {
                let _ = write!(
                    out,
                    r##"<rect x="{:.1}" y="{:.1}" width="11" height="11" fill="{colour}"/>"##,
                    x - 5.5,
                    y - 5.5
                );
            });
        }
    }
    legend.gap();
    for (form, path) in FORMS {
        if marks.iter().any(|mark| mark.shape == path) {
            legend.entry(out, form, |out, x, y| shape(out, (x, y), path, GREY, GREY));
        }
    }
    legend.gap();
    if marks.iter().any(Mark::is_interpreted) {
        legend.entry(out, "interpreter", |out, x, y| shape(out, (x, y), circle, "#ffffff", GREY));
    }
    if marks.iter().any(Mark::is_of_one_point) {
        legend.entry(out, "for one point", |out, x, y| shape(out, (x, y), circle, GREY, ONE_POINT));
        legend.remark(out, "without outline: for columns");
    }
}
