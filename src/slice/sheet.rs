//! Several slices in one drawing, row by row, each with its own axes.

use std::fmt::Write;
use std::io;

use glam::DVec2;

use super::{
    SliceError, Style, Window,
    plane::Plane,
    png,
    sample::sample,
    sections::{self, Cut},
    svg::{Drawing, drawing},
};

/// A slice of a sheet: ω of one solid, or the sections of several.
pub struct Panel<'a> {
    /// The plane.
    pub plane: Plane,
    /// The part of it that is drawn.
    pub window: Window,
    /// How one solid is drawn.
    pub style: Style,
    /// The solids that it cuts.
    pub cuts: Vec<Cut<'a>>,
}

/// The space between panels.
const GAP: f64 = 16.0;

/// Writes panels as one SVG document.
///
/// # Errors
/// Those of [`sample`] and of `out`.
pub fn write_sheet_svg(
    title: &str,
    panels: &[Panel<'_>],
    samples: usize,
    mut out: impl io::Write,
) -> Result<(), SliceError> {
    out.write_all(sheet(title, panels, samples)?.as_bytes())?;
    Ok(())
}

/// Writes panels as one PNG picture: the drawing of [`write_sheet_svg`] at `scale` pixels per unit.
///
/// # Errors
/// Those of [`sample`] and of `out`, and [`SliceError::Scale`].
pub fn write_sheet_png(
    title: &str,
    panels: &[Panel<'_>],
    samples: usize,
    scale: f32,
    out: impl io::Write,
) -> Result<(), SliceError> {
    png::rasterise(&sheet(title, panels, samples)?, scale, out)
}

/// The document. Columns are as wide as their widest panel and rows as high as their highest, so nothing overlaps.
fn sheet(title: &str, panels: &[Panel<'_>], samples: usize) -> Result<String, SliceError> {
    let draw = |(k, panel): (usize, &Panel<'_>)| match &panel.cuts[..] {
        [one] => {
            let samples = sample(one.field, panel.plane, panel.window, samples)?;
            Ok(drawing(one.field, &one.name, &samples, panel.style, &k.to_string()))
        }
        several => sections::drawing(several, panel.plane, panel.window, samples, &k.to_string()),
    };
    let drawings = panels.iter().enumerate().map(draw).collect::<Result<Vec<Drawing>, SliceError>>()?;
    let columns = (1..).find(|n| n * n >= drawings.len()).unwrap_or(1);
    let greatest = |of: &dyn Fn(&Drawing) -> f64, pick: &dyn Fn(usize) -> bool| {
        let chosen = drawings.iter().enumerate().filter(|(k, _)| pick(*k));
        chosen.fold(0.0, |most: f64, (_, drawing)| most.max(of(drawing) + GAP))
    };
    let starts = |count: usize, of: &dyn Fn(usize) -> f64| {
        (0..count).fold(vec![0.0], |mut starts, k| {
            starts.push(starts[k] + of(k));
            starts
        })
    };
    let rows = drawings.len().div_ceil(columns);
    let x = starts(columns, &|column| greatest(&|d| d.size.x, &|k| k % columns == column));
    let y = starts(rows, &|row| greatest(&|d| d.size.y, &|k| k / columns == row));
    let mut body = String::new();
    for (k, Drawing { body: part, .. }) in drawings.iter().enumerate() {
        let _ =
            write!(body, "<g transform=\"translate({} {})\">\n{part}</g>\n", x[k % columns], y[k / columns]);
    }
    // a ground that ends within a pixel would leave a grey line
    Ok(Drawing { size: DVec2::new(x[columns], y[rows]).ceil(), body }.document(title))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Field;
    use crate::slice::tests::{disc, field};
    use crate::slice::{Axis, png};

    fn panel<'a>(cuts: &[(&str, &'a dyn Field)], z: f64, half: f64) -> Panel<'a> {
        let cuts = cuts.iter().map(|&(name, field)| Cut { name: name.into(), field }).collect();
        let window = Window::new(DVec2::splat(-half), DVec2::new(half, 0.6 * half));
        Panel { plane: Plane::new(Axis::Z, z), window, style: Style::default(), cuts }
    }

    #[test]
    fn panels_lie_side_by_side_and_tell_their_solids_apart() {
        let (round, square) = (disc(), field(|p| 0.3 - p.abs().max_element()));
        let both: [(&str, &dyn Field); 2] = [("round & <red>", &round), ("square", &square)];
        let panels = [
            panel(&both, 0.0, 1.0),
            panel(&both[..1], 0.1, 0.7),
            panel(&both, 0.25, 1.0),
            panel(&both, 9.0, 1.0),
        ];
        let text = sheet("two", &panels, 60).unwrap();
        assert!(png::parse(&text).is_ok(), "{text}");
        for expected in [
            "<title>two</title>",
            ">round &amp; &lt;red&gt;</text>",
            "z = 0.25",
            "url(#hatch0-1)",
            "url(#hatch2-0)",
        ] {
            assert!(text.contains(expected), "no {expected}");
        }
        // every panel begins where the one beside it and those above it have ended
        let places: Vec<(f64, f64)> = text
            .split("<g transform=\"translate(")
            .skip(1)
            .filter_map(|part| part.split_once(')')?.0.split_once(' '))
            .filter_map(|(x, y)| Some((x.parse().ok()?, y.parse().ok()?)))
            .collect();
        let sizes: Vec<DVec2> = panels
            .iter()
            .map(|panel| match &panel.cuts[..] {
                [one] => {
                    let samples = sample(one.field, panel.plane, panel.window, 60).unwrap();
                    drawing(one.field, &one.name, &samples, Style::default(), "").size
                }
                several => sections::drawing(several, panel.plane, panel.window, 60, "").unwrap().size,
            })
            .collect();
        assert_eq!(places.len(), 4);
        for k in [0, 2] {
            assert!(places[k + 1].0 >= sizes[k].x && places[k].1 == places[k + 1].1);
        }
        assert!((0..2).all(|k| places[k + 2].1 >= sizes[k].y));
        // what a pattern is called occurs once
        for k in [0, 2, 3] {
            assert_eq!(text.matches(&format!("id=\"hatch{k}-0\"")).count(), 1);
        }
    }

    #[test]
    fn sections_are_filled_where_solids_are() {
        let round = disc();
        let cuts: [(&str, &dyn Field); 2] = [("a", &round), ("b", &round)];
        let mut bytes = Vec::new();
        let window = Window::new(DVec2::splat(-1.0), DVec2::ONE);
        let cuts = cuts.map(|(name, field)| Cut { name: name.into(), field }).into();
        let panels = [Panel { plane: Plane::new(Axis::Z, 0.0), window, style: Style::default(), cuts }];
        write_sheet_png("disc", &panels, 200, 1.0, &mut bytes).unwrap();
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        // the plot is a square of 460 units; a disc of half its width has π/16 of its area
        let (left, top, side) = (72, 44, 460);
        let tinted = (top..top + side)
            .flat_map(|y| (left..left + side).map(move |x| 3 * (y * info.width as usize + x)))
            .filter(|&at| pixels[at..at + 3] != [255; 3])
            .count();
        let share = tinted as f64 / (side * side) as f64;
        assert!((share - std::f64::consts::PI / 16.0).abs() < 0.02, "{share}");
    }
}
