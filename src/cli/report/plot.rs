//! Speed against error as a picture, with a mark for each program.

use std::fmt::Write;
use std::path::Path;

use super::super::failure::Failure;
use super::super::plot::{BOTTOM, HEIGHT, LEFT, LogAxis, RIGHT, TOP, WIDTH, begin, end, grid};
use super::programs::ProgramFigures;

/// Smaller errors are drawn at this one, because an exact answer has no place on a logarithmic axis.
const LEAST_ERROR: f64 = 1e-17;

/// The plot as SVG or PNG, by the ending of the path.
pub(super) fn draw(solid: &str, rows: &[ProgramFigures], path: &Path) -> Result<Vec<u8>, Failure> {
    end(svg(solid, rows), path)
}

fn svg(solid: &str, rows: &[ProgramFigures]) -> String {
    let marks: Vec<(&ProgramFigures, f64)> = rows
        .iter()
        .filter_map(|row| Some((row, row.max_rel_error?.max(LEAST_ERROR))))
        .filter(|(_, error)| error.is_finite())
        .collect();
    let x = LogAxis::over(marks.iter().map(|(row, _)| row.ns_per_point), LEFT, WIDTH - RIGHT);
    let y = LogAxis::over(marks.iter().map(|(_, error)| *error), HEIGHT - BOTTOM, TOP);
    let mut out = begin(&format!("{solid}: speed against error"));
    grid(&mut out, &x, &y, ["ns per point, one thread", "largest relative error"]);
    for (row, error) in &marks {
        mark(&mut out, row, x.at(row.ns_per_point), y.at(*error));
    }
    legend(&mut out, &marks);
    out
}

/// Draws a mark. Its colour stands for the program, its shape for the form, and interpreters are hollow.
fn mark(out: &mut String, row: &ProgramFigures, x: f64, y: f64) {
    let colour = colour(row);
    let fill = if row.engine == "interp" { "#ffffff" } else { colour };
    let style = format!(r##"fill="{fill}" stroke="{colour}" stroke-width="1.6""##);
    let _ = match row.form {
        "textbook" => write!(out, r##"<path d="M{x:.1} {:.1}l6 11h-12z" {style}/>"##, y - 7.0),
        "scaled" => {
            write!(out, r##"<rect x="{:.1}" y="{:.1}" width="10" height="10" {style}/>"##, x - 5.0, y - 5.0)
        }
        _ => write!(out, r##"<circle cx="{x:.1}" cy="{y:.1}" r="5.5" {style}/>"##),
    };
}

fn colour(row: &ProgramFigures) -> &'static str {
    match (row.program, row.precision, row.shape) {
        ("value", "f64", "many") => "#1b6ca8",
        ("value", "f64", _) => "#0b3c5d",
        ("value", ..) => "#63b3ed",
        ("gradient", "f64", "many") => "#c05621",
        ("gradient", "f64", _) => "#7b341e",
        _ => "#f6ad55",
    }
}

fn legend(out: &mut String, marks: &[(&ProgramFigures, f64)]) {
    let x = WIDTH - RIGHT + 22.0;
    let mut y = TOP + 12.0;
    let mut seen: Vec<&'static str> = Vec::new();
    for (row, _) in marks {
        let colour = colour(row);
        if seen.contains(&colour) {
            continue;
        }
        seen.push(colour);
        let shape = if row.shape == "one" { ", one point" } else { "" };
        let _ = write!(
            out,
            r##"<rect x="{x:.1}" y="{:.1}" width="11" height="11" fill="{colour}"/><text x="{:.1}" y="{:.1}">{} {}{shape}</text>"##,
            y - 10.0,
            x + 18.0,
            y,
            row.program,
            row.precision
        );
        y += 21.0;
    }
    y += 10.0;
    for form in ["stable", "textbook", "scaled"] {
        let _ = match form {
            "textbook" => {
                write!(out, r##"<path d="M{:.1} {:.1}l6 11h-12z" fill="#666666"/>"##, x + 5.5, y - 11.0)
            }
            "scaled" => write!(
                out,
                r##"<rect x="{x:.1}" y="{:.1}" width="10" height="10" fill="#666666"/>"##,
                y - 10.0
            ),
            _ => write!(out, r##"<circle cx="{:.1}" cy="{:.1}" r="5.5" fill="#666666"/>"##, x + 5.5, y - 5.0),
        };
        let _ = write!(out, r##"<text x="{:.1}" y="{y:.1}">{form}</text>"##, x + 18.0);
        y += 21.0;
    }
    let _ = write!(
        out,
        r##"<circle cx="{:.1}" cy="{:.1}" r="5.5" fill="#ffffff" stroke="#666666" stroke-width="1.6"/><text x="{:.1}" y="{y:.1}">interpreter</text>"##,
        x + 5.5,
        y - 5.0,
        x + 18.0
    );
}
