//! Speed against error as a picture: one mark for each program; and what other pictures of the report share.

use std::fmt::Write;
use std::path::Path;

use super::super::{Failure, output};
use super::Row;
use crate::slice;

pub(super) const WIDTH: f64 = 760.0;
pub(super) const HEIGHT: f64 = 520.0;
pub(super) const LEFT: f64 = 80.0;
pub(super) const RIGHT: f64 = 190.0;
pub(super) const TOP: f64 = 50.0;
pub(super) const BOTTOM: f64 = 60.0;

/// Errors below this are drawn at it: an exact answer has no place on a logarithmic axis.
const LEAST_ERROR: f64 = 1e-17;

/// The plot as SVG or PNG, as the ending of the path says.
pub(super) fn draw(solid: &str, rows: &[Row], path: &Path) -> Result<Vec<u8>, Failure> {
    end(svg(solid, rows), path)
}

/// The beginning of a plot: the white ground and the title.
pub(super) fn begin(title: &str) -> String {
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="Ubuntu" font-size="13"><rect width="100%" height="100%" fill="#ffffff"/><text x="{LEFT}" y="28" font-size="17">{}</text>"##,
        slice::escaped(title)
    )
}

/// The finished plot as SVG or PNG, as the ending of the path says.
pub(super) fn end(mut svg: String, path: &Path) -> Result<Vec<u8>, Failure> {
    svg.push_str("</svg>\n");
    match output::Picture::of(path)? {
        output::Picture::Svg => Ok(svg.into_bytes()),
        output::Picture::Png => {
            let mut bytes = Vec::new();
            slice::rasterise(&svg, 2.0, &mut bytes).map_err(Failure::usage)?;
            Ok(bytes)
        }
    }
}

/// A logarithmic axis over whole powers of ten.
pub(super) struct Axis {
    low: i32,
    high: i32,
    from: f64,
    to: f64,
}

impl Axis {
    pub fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (mut low, mut high) = (i32::MAX, i32::MIN);
        for value in values {
            low = low.min(value.log10().floor() as i32);
            high = high.max(value.log10().ceil() as i32);
        }
        if low >= high {
            (low, high) = if low == i32::MAX { (0, 1) } else { (low, low + 1) };
        }
        Self { low, high, from, to }
    }

    pub fn at(&self, value: f64) -> f64 {
        let share = (value.log10() - f64::from(self.low)) / f64::from(self.high - self.low);
        self.from + share * (self.to - self.from)
    }
}

fn svg(solid: &str, rows: &[Row]) -> String {
    let marks: Vec<(&Row, f64)> = rows
        .iter()
        .filter_map(|row| Some((row, row.max_rel_error?.max(LEAST_ERROR))))
        .filter(|(_, error)| error.is_finite())
        .collect();
    let x = Axis::over(marks.iter().map(|(row, _)| row.ns_per_point), LEFT, WIDTH - RIGHT);
    let y = Axis::over(marks.iter().map(|(_, error)| *error), HEIGHT - BOTTOM, TOP);
    let mut out = begin(&format!("{solid}: speed against error"));
    grid(&mut out, &x, &y, ["ns per point, one thread", "largest relative error"]);
    for (row, error) in &marks {
        mark(&mut out, row, x.at(row.ns_per_point), y.at(*error));
    }
    legend(&mut out, &marks);
    out
}

/// Lines at the whole powers of ten, and what the axes are.
pub(super) fn grid(out: &mut String, x: &Axis, y: &Axis, [along, up]: [&str; 2]) {
    // writing to a String cannot fail
    for power in x.low..=x.high {
        let at = x.at(10f64.powi(power));
        let _ = write!(
            out,
            r##"<line x1="{at:.1}" y1="{TOP}" x2="{at:.1}" y2="{:.1}" stroke="#dddddd"/><text x="{at:.1}" y="{:.1}" text-anchor="middle">{}</text>"##,
            HEIGHT - BOTTOM,
            HEIGHT - BOTTOM + 20.0,
            10f64.powi(power)
        );
    }
    for power in (y.low..=y.high).filter(|p| (p - y.low) % 2 == 0) {
        let at = y.at(10f64.powi(power));
        let _ = write!(
            out,
            r##"<line x1="{LEFT}" y1="{at:.1}" x2="{:.1}" y2="{at:.1}" stroke="#dddddd"/><text x="{:.1}" y="{:.1}" text-anchor="end">1e{power}</text>"##,
            WIDTH - RIGHT,
            LEFT - 8.0,
            at + 4.5
        );
    }
    let middle = 0.5 * (TOP + HEIGHT - BOTTOM);
    let _ = write!(
        out,
        r##"<text x="{:.1}" y="{:.1}" text-anchor="middle">{along}</text><text x="20" y="{middle:.1}" text-anchor="middle" transform="rotate(-90 20 {middle:.1})">{up}</text>"##,
        0.5 * (LEFT + WIDTH - RIGHT),
        HEIGHT - 14.0
    );
}

/// Colour tells the program, shape the form; interpreters are hollow.
fn mark(out: &mut String, row: &Row, x: f64, y: f64) {
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

fn colour(row: &Row) -> &'static str {
    match (row.program, row.precision, row.shape) {
        ("value", "f64", "many") => "#1b6ca8",
        ("value", "f64", _) => "#0b3c5d",
        ("value", ..) => "#63b3ed",
        ("gradient", "f64", "many") => "#c05621",
        ("gradient", "f64", _) => "#7b341e",
        _ => "#f6ad55",
    }
}

fn legend(out: &mut String, marks: &[(&Row, f64)]) {
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
