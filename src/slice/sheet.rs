//! Several slices in one drawing, row by row, each with its own axes.

use std::fmt::Write;
use std::io;

use glam::DVec2;

use super::{
    Quantity, SliceError, Style, Window,
    colour::Scale,
    plane::Plane,
    png,
    sample::{Samples, sample},
    sections::{self, Cut},
    svg::{BELOW, Drawing, RIGHT, TOP, bar, drawing},
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
/// Panels that show the same quantity have one scale and one colour bar, and panels of the same solids one legend.
fn sheet(title: &str, panels: &[Panel<'_>], samples: usize) -> Result<String, SliceError> {
    let sampled = |panel: &Panel<'_>| match &panel.cuts[..] {
        [one] => sample(one.field, panel.plane, panel.window, samples).map(Some),
        _ => Ok(None),
    };
    let sampled = panels.iter().map(sampled).collect::<Result<Vec<Option<Samples>>, SliceError>>()?;
    let scales = [Quantity::Omega, Quantity::Distance].map(|quantity| {
        let of = panels.iter().zip(&sampled).filter(|(panel, _)| panel.style.quantity == quantity);
        let of: Vec<&Samples> = of.filter_map(|(_, samples)| samples.as_ref()).collect();
        (quantity, (!of.is_empty()).then(|| Scale::for_all(&of)))
    });
    let draw = |(k, (panel, samples_of)): (usize, (&Panel<'_>, &Option<Samples>))| {
        let scale = scales.iter().find(|(quantity, _)| *quantity == panel.style.quantity);
        match (&panel.cuts[..], samples_of, scale) {
            ([one], Some(sampled), Some((_, Some(scale)))) => {
                Ok(drawing(one.field, &one.name, sampled, panel.style, scale, &k.to_string()))
            }
            (several, ..) => sections::drawing(several, panel.plane, panel.window, samples, &k.to_string()),
        }
    };
    let drawings =
        panels.iter().zip(&sampled).enumerate().map(draw).collect::<Result<Vec<Drawing>, SliceError>>()?;
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
    // the legends stand beside the first row
    let mut bottom = y[rows];
    let mut add = |legend: Drawing| {
        body += &legend.body;
        bottom = bottom.max(legend.size.y);
        DVec2::new(legend.size.x, TOP)
    };
    let height = drawings.first().map_or(0.0, |drawing| drawing.size.y - TOP - BELOW);
    let mut right = DVec2::new(x[columns] - GAP - RIGHT, TOP);
    for (quantity, scale) in &scales {
        if let Some(scale) = scale {
            right = add(bar(scale, *quantity, right, height));
        }
    }
    let mut named: Vec<Vec<&str>> = Vec::new();
    for (k, panel) in panels.iter().enumerate().filter(|(_, panel)| panel.cuts.len() != 1) {
        let names: Vec<&str> = panel.cuts.iter().map(|cut| cut.name.as_str()).collect();
        if !names.is_empty() && !named.contains(&names) {
            right = add(sections::legend(&panel.cuts, right, &k.to_string()));
            named.push(names);
        }
    }
    // a ground that ends within a pixel would leave a grey line
    Ok(Drawing { size: DVec2::new(right.x.max(x[columns]), bottom).ceil(), body }.document(title))
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
                    let scale = Scale::for_samples(&samples);
                    drawing(one.field, &one.name, &samples, Style::default(), &scale, "").size
                }
                several => sections::drawing(several, panel.plane, panel.window, 60, "").unwrap().size,
            })
            .collect();
        assert_eq!(places.len(), 4);
        for k in [0, 2] {
            assert!(places[k + 1].0 >= sizes[k].x && places[k].1 == places[k + 1].1);
        }
        assert!((0..2).all(|k| places[k + 2].1 >= sizes[k].y));
        // three panels of both solids have one legend, and that of one solid has the only colour bar
        assert_eq!((text.matches(">square</text>").count(), text.matches("inside, ω").count()), (1, 1));
        // what a pattern is called occurs once
        for k in [0, 2, 3] {
            assert_eq!(text.matches(&format!("id=\"hatch{k}-0\"")).count(), 1);
        }
    }

    #[test]
    fn panels_of_one_quantity_have_one_scale() {
        let round = field(|p| 0.25 - p.length_squared());
        let one: [(&str, &dyn Field); 1] = [("round", &round)];
        let panels = [panel(&one, 0.0, 1.0), panel(&one, 0.3, 0.5)];
        let text = sheet("one", &panels, 60).unwrap();
        assert_eq!((text.matches("inside, ω").count(), text.matches("outside, ω").count()), (1, 1));
        let colours = |z: f64, half: f64| {
            let plane = Plane::new(Axis::Z, z);
            let window = Window::new(DVec2::splat(-half), DVec2::new(half, 0.6 * half));
            Scale::for_samples(&sample(&round, plane, window, 60).unwrap())
        };
        assert_ne!(colours(0.0, 1.0), colours(0.3, 0.5), "these would have different scales");
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
