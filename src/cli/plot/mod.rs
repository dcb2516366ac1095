//! The common parts of all plots: the ground with its title, the margins, the axes, labels, the legend, and SVG or PNG
//! at the end.

mod axes;
mod labels;

use std::fmt::Write;
use std::path::Path;

use super::failure::Failure;
use super::output;
use rfm::slice;

pub(super) use axes::{Axis, EvenAxis, LogAxis, grid, over_figures, over_params, right_axis};
pub(super) use labels::Labels;

pub(super) const WIDTH: f64 = 760.0;
pub(super) const HEIGHT: f64 = 520.0;
pub(super) const LEFT: f64 = 80.0;
pub(super) const RIGHT: f64 = 200.0;
pub(super) const TOP: f64 = 50.0;
pub(super) const BOTTOM: f64 = 60.0;

/// Room for the numbers and the name of a second axis, between the plot and the legend.
pub(super) const SECOND_AXIS: f64 = 62.0;

/// The beginning of a plot: the white ground and the title.
pub(super) fn begin(title: &str) -> String {
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="Ubuntu, sans-serif" font-size="13"><rect width="100%" height="100%" fill="#ffffff"/><text x="{LEFT}" y="28" font-size="17">{}</text>"##,
        slice::escaped(title)
    )
}

/// The finished plot as SVG or PNG, by the ending of the path.
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

/// Writes a sentence in the middle of a page without axes.
pub(super) fn sentence(out: &mut String, text: &str) {
    let _ = write!(
        out,
        r##"<text x="{:.1}" y="{:.1}" font-size="16" text-anchor="middle">{}</text>"##,
        0.5 * WIDTH,
        0.5 * HEIGHT,
        slice::escaped(text)
    );
}

/// A list of what the lines and marks of a plot stand for, to the right of it.
pub(super) struct Legend {
    y: f64,
}

impl Legend {
    const LEFT: f64 = WIDTH - RIGHT + 14.0;

    pub fn new() -> Self {
        Self { y: TOP + 12.0 }
    }

    /// Adds an entry. `sample` draws around its point what stands in the plot.
    pub fn entry(&mut self, out: &mut String, text: &str, sample: impl FnOnce(&mut String, f64, f64)) {
        sample(out, Self::LEFT + 13.0, self.y - 4.5);
        let _ = write!(
            out,
            r##"<text x="{:.1}" y="{:.1}">{}</text>"##,
            Self::LEFT + 33.0,
            self.y,
            slice::escaped(text)
        );
        self.y += 21.0;
    }

    /// Adds a line of explanation.
    pub fn remark(&mut self, out: &mut String, text: &str) {
        let _ = write!(
            out,
            r##"<text x="{:.1}" y="{:.1}" font-size="11">{}</text>"##,
            Self::LEFT,
            self.y,
            slice::escaped(text)
        );
        self.y += 16.0;
    }

    /// Leaves room before the next entry.
    pub fn gap(&mut self) {
        self.y += 8.0;
    }
}

/// Draws a piece of a line with a mark in its middle, as in the plot.
pub(super) fn line_sample(out: &mut String, (x, y): (f64, f64), colour: &str, dashes: &str, marked: bool) {
    let _ = write!(
        out,
        r##"<line x1="{:.1}" y1="{y:.1}" x2="{:.1}" y2="{y:.1}" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"/>"##,
        x - 13.0,
        x + 13.0
    );
    if marked {
        dot(out, x, y, colour);
    }
}

/// Draws the mark of a measured point.
pub(super) fn dot(out: &mut String, x: f64, y: f64, colour: &str) {
    let _ = write!(out, r##"<circle cx="{x:.1}" cy="{y:.1}" r="4.5" fill="{colour}"/>"##);
}
