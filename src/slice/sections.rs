//! The sections of several solids in one plane: each has its own colour and hatching, and a legend names them.
//!
//! Colours and directions of hatching both distinguish solids, so a print without colours can be read too.

use std::fmt::Write;

use glam::DVec2;

use super::{
    SliceError, Window,
    axes::{self, INK, PlotFrame},
    isolines::{Outline, outlines},
    paths,
    plane::Plane,
    sample::sample,
    svg::{BELOW, Drawing, LEFT, RIGHT, TOP, escaped, on_page},
};
use crate::field::Field;

/// A solid that is cut by a plane.
pub struct Cut<'a> {
    /// What the legend calls it.
    pub name: String,
    /// Its ω.
    pub field: &'a dyn Field,
}

/// Colours that stay apart for colour-blind people (Okabe and Ito), without yellow, which paper swallows.
const COLOURS: [&str; 6] = ["#d55e00", "#0072b2", "#009e73", "#cc79a7", "#56b4e9", "#6b6b6b"];
/// Directions of the hatching, degrees. Their number and that of the colours have no common factor, so 30
/// solids differ.
const ANGLES: [f64; 5] = [45.0, -45.0, 0.0, 90.0, 22.5];
/// The legend: the gap before it, the height of a row, the swatch, and the width of a character.
const LEGEND: [f64; 4] = [24.0, 24.0, 22.0, 7.4];

/// Draws solids in a plane, without a legend. `id` keeps the patterns of several drawings in one document apart.
///
/// # Errors
/// Those of [`sample`].
pub(super) fn drawing(
    cuts: &[Cut<'_>],
    plane: Plane,
    window: Window,
    samples: usize,
    id: &str,
) -> Result<Drawing, SliceError> {
    let frame = PlotFrame::with_room(window, DVec2::new(LEFT, TOP));
    let mut body = String::new();
    let _ =
        writeln!(body, r#"<text x="{}" y="{}" font-size="16">{plane} m</text>"#, frame.origin.x, TOP - 16.0);
    for (k, cut) in cuts.iter().enumerate() {
        let (colour, angle) = (COLOURS[k % COLOURS.len()], ANGLES[k % ANGLES.len()]);
        let _ = writeln!(
            body,
            r#"<pattern id="hatch{id}-{k}" width="7" height="7" patternUnits="userSpaceOnUse" patternTransform="rotate({angle})"><rect width="7" height="1.3" fill="{colour}"/></pattern>"#
        );
        let found = outlines(cut.field, &sample(cut.field, plane, window, samples)?, 0.0);
        region(&mut body, &frame, &found, colour, &format!("hatch{id}-{k}"));
    }
    axes::draw(&mut body, &frame, plane);
    Ok(Drawing { size: DVec2::new(frame.right() + RIGHT, frame.bottom() + BELOW), body })
}

/// The names of solids with their colours and hatching, beside a plot whose upper right corner is `at`. `id` is that of
/// a drawing of the same solids.
pub(super) fn legend(cuts: &[Cut<'_>], at: DVec2, id: &str) -> Drawing {
    let mut body = String::new();
    let widest = cuts.iter().map(|cut| cut.name.chars().count()).max().unwrap_or(0) as f64;
    let left = at.x + LEGEND[0];
    for (k, cut) in cuts.iter().enumerate() {
        let (colour, top) = (COLOURS[k % COLOURS.len()], at.y + LEGEND[1] * k as f64);
        let [width, height] = [LEGEND[2], LEGEND[1] - 8.0];
        for fill in [format!(r#"{colour}" fill-opacity="0.18"#), format!("url(#hatch{id}-{k})")] {
            let _ = writeln!(
                body,
                r#"<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="{fill}" stroke="{colour}"/>"#
            );
        }
        let _ = writeln!(
            body,
            r#"<text x="{}" y="{}" font-size="13">{}</text>"#,
            left + width + 8.0,
            top + height - 3.5,
            escaped(&cut.name)
        );
    }
    let right = left + LEGEND[2] + 8.0 + LEGEND[3] * widest + 12.0;
    Drawing { size: DVec2::new(right, at.y + LEGEND[1] * cuts.len() as f64).ceil(), body }
}

/// Fills a region and draws its border.
fn region(out: &mut String, frame: &PlotFrame, outlines: &[Outline], colour: &str, hatch: &str) {
    let (mut inside, mut border) = (String::new(), String::new());
    for outline in outlines {
        paths::append(&mut inside, &on_page(frame, &outline.points), true);
        for line in outline.isolines() {
            paths::append(&mut border, &on_page(frame, &line.points), line.closed);
        }
    }
    if inside.is_empty() {
        return;
    }
    for fill in [format!(r#"{colour}" fill-opacity="0.18"#), format!("url(#{hatch})")] {
        let _ = writeln!(out, r#"<path d="{inside}" fill="{fill}" fill-rule="evenodd"/>"#);
    }
    let _ = writeln!(
        out,
        r#"<path d="{border}" fill="none" stroke="{INK}" stroke-width="1.4" stroke-linejoin="round"/>"#
    );
}
