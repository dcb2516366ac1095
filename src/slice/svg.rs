//! A slice as an SVG document: filled bands, isolines, the line of the surface, axes and a colour bar.
//!
//! Bands are painted over each other from the lowest ω upwards. Each is the whole region above its level, so
//! no gap shows between neighbours at any magnification.

use std::fmt::Write;

use glam::DVec2;

use super::{
    Quantity, Style, arrows,
    axes::{self, INK, PlotFrame},
    colour::{Rgb, Scale, UNDEFINED},
    isolines::{Outline, outlines},
    labels::{LevelLabel, Placer},
    numbers::written,
    paths,
    sample::Samples,
};
use crate::field::Field;

pub const LEFT: f64 = 72.0;
pub const TOP: f64 = 44.0;
pub const BELOW: f64 = 52.0;
/// Room beside the plot for the last number of its axis.
pub const RIGHT: f64 = 16.0;
/// The colour bar: the gap before it, its width, and the room for its title.
const BAR: [f64; 3] = [26.0, 16.0, 22.0];
/// The room for the numbers of the colour bar: that around them, and for each character.
const NUMBERS: [f64; 2] = [20.0, 7.8];
/// The largest height of a band in the colour bar, and the least for a legible number.
const BAND: [f64; 2] = [26.0, 15.0];

/// A part of a document.
pub struct Drawing {
    pub size: DVec2,
    pub body: String,
}

impl Drawing {
    /// The drawing as a document.
    pub fn document(&self, title: &str) -> String {
        let (DVec2 { x: width, y: height }, title) = (self.size, escaped(title));
        format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="Ubuntu, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif" font-weight="300" fill="{INK}">
<title>{title}</title>
<rect width="{width}" height="{height}" fill="#fff"/>
{}</svg>
"##,
            self.body
        )
    }
}

/// The slice as an SVG document. `name` becomes part of the title. The samples must be those of the field.
pub fn svg(field: &dyn Field, name: &str, samples: &Samples) -> String {
    let (style, scale) = (Style::default(), Scale::for_samples(samples));
    let plot = drawing(field, name, samples, style, &scale, "");
    let beside = DVec2::new(plot.size.x - RIGHT, TOP);
    let bar = bar(&scale, style.quantity, beside, plot.size.y - TOP - BELOW);
    let size = DVec2::new(bar.size.x, plot.size.y.max(bar.size.y));
    Drawing { size, body: plot.body + &bar.body }.document(&format!("{name}, {} m", samples.plane))
}

/// The slice as a part of a document, without its colour bar. `id` keeps the patterns of several apart.
pub fn drawing(
    field: &dyn Field,
    name: &str,
    samples: &Samples,
    style: Style,
    scale: &Scale,
    id: &str,
) -> Drawing {
    let frame = PlotFrame::with_room(samples.window, DVec2::new(LEFT, TOP));
    let mut out = format!(
        r##"<text x="{3}" y="{2}" font-size="16">{0}<tspan fill="#555" dx="9">{1} m</tspan></text>
"##,
        escaped(name),
        samples.plane,
        TOP - 16.0,
        frame.origin.x
    );
    let labels = bands_and_lines(&mut out, field, samples, &frame, scale);
    undefined_cells(&mut out, samples, &frame, id);
    if style.arrows {
        let labels: Vec<LevelLabel> = labels.iter().map(|(_, label)| label.clone()).collect();
        arrows::draw(&mut out, field, samples.plane, &frame, &labels);
    }
    numbers(&mut out, scale, &labels);
    axes::draw(&mut out, &frame, samples.plane);
    Drawing { size: DVec2::new(frame.right() + RIGHT, frame.bottom() + BELOW), body: out }
}

/// The colour bar of a scale beside a plot of a height, whose upper right corner is `at`.
pub fn bar(scale: &Scale, quantity: Quantity, at: DVec2, height: f64) -> Drawing {
    let bar = Bar::new(at, height, scale);
    let mut body = String::new();
    bar.draw(&mut body, scale, quantity);
    let right = at.x + BAR.iter().sum::<f64>() + bar.numbers + 8.0;
    Drawing { size: DVec2::new(right, (at.y + height).max(bar.bottom) + BELOW), body }
}

/// Draws the bands and their lines, and returns the numbers on these, each with the number of its level.
fn bands_and_lines(
    out: &mut String,
    field: &dyn Field,
    samples: &Samples,
    frame: &PlotFrame,
    scale: &Scale,
) -> Vec<(usize, LevelLabel)> {
    let levels: Vec<Vec<Outline>> =
        scale.levels().iter().map(|&level| outlines(field, samples, level)).collect();
    let PlotFrame { origin, size, .. } = *frame;
    let _ = writeln!(
        out,
        r#"<rect x="{}" y="{}" width="{}" height="{}" fill="{}"/>"#,
        origin.x,
        origin.y,
        size.x,
        size.y,
        hex(scale.band_colour(0))
    );
    for (k, outlines) in levels.iter().enumerate() {
        let mut path = String::new();
        for outline in outlines {
            paths::append(&mut path, &on_page(frame, &outline.points), true);
        }
        if !path.is_empty() {
            let colour = hex(scale.band_colour(k + 1));
            let _ = writeln!(out, r#"<path d="{path}" fill="{colour}" fill-rule="evenodd"/>"#);
        }
    }

    let lines: Vec<Vec<(Vec<DVec2>, bool)>> = levels
        .iter()
        .map(|outlines| {
            let lines = outlines.iter().flat_map(Outline::isolines);
            lines.map(|line| (on_page(frame, &line.points), line.closed)).collect()
        })
        .collect();
    let draw = |out: &mut String, lines: &[(Vec<DVec2>, bool)], style: &str| {
        let mut path = String::new();
        for (points, closed) in lines {
            paths::append(&mut path, points, *closed);
        }
        if !path.is_empty() {
            let _ = writeln!(out, r#"<path d="{path}" fill="none" stroke-linejoin="round" {style}/>"#);
        }
    };
    let zero = scale.levels().iter().position(|&level| level == 0.0).unwrap_or(0);
    for (_, lines) in lines.iter().enumerate().filter(|(k, _)| *k != zero) {
        draw(out, lines, r##"stroke="#222" stroke-opacity="0.42" stroke-width="0.5""##);
    }
    draw(out, &lines[zero], r##"stroke="#111" stroke-width="1.8""##);
    labels(frame, scale, zero, &lines)
}

/// The numbers on the lines of all levels but zero.
fn labels(
    frame: &PlotFrame,
    scale: &Scale,
    zero: usize,
    lines: &[Vec<(Vec<DVec2>, bool)>],
) -> Vec<(usize, LevelLabel)> {
    let lines: Vec<Vec<Vec<DVec2>>> =
        lines.iter().map(|level| level.iter().map(|(points, _)| points.clone()).collect()).collect();
    let mut placer = Placer::new(frame, &lines);
    let texts = written(scale.decimals());
    let others = texts.iter().enumerate().filter(|(k, _)| *k != zero);
    others.filter_map(|(k, text)| Some((k, placer.place(k, text)?))).collect()
}

fn numbers(out: &mut String, scale: &Scale, labels: &[(usize, LevelLabel)]) {
    if labels.is_empty() {
        return;
    }
    let _ = writeln!(
        out,
        r#"<g font-size="10" font-weight="400" text-anchor="middle" paint-order="stroke" stroke-width="3.5" stroke-linejoin="round">"#
    );
    for (k, LevelLabel { at, angle, text }) in labels {
        // the halo has the colour of the ground, so the line seems to be interrupted
        let _ = writeln!(
            out,
            r#"<text transform="translate({:.2} {:.2}) rotate({angle:.1})" y="3.4" stroke="{}">{text}</text>"#,
            at.x,
            at.y,
            hex(mean(scale.band_colour(*k), scale.band_colour(k + 1)))
        );
    }
    out.push_str("</g>\n");
}

/// Draws grey hatching over every cell with a corner that has no value. Cells side by side make
/// one rectangle.
fn undefined_cells(out: &mut String, samples: &Samples, frame: &PlotFrame, id: &str) {
    if samples.undefined() == 0 {
        return;
    }
    let mut path = String::new();
    for row in 0..samples.rows - 1 {
        let mut column = 0;
        while column + 1 < samples.columns {
            let run =
                (column..samples.columns - 1).take_while(|&i| samples.cell_is_undefined(i, row)).count();
            if run > 0 {
                let low = frame.page(samples.position(column, row));
                let high = frame.page(samples.position(column + run, row + 1));
                let _ = write!(path, "M{:.2} {:.2}H{:.2}V{:.2}H{:.2}z", low.x, low.y, high.x, high.y, low.x);
            }
            column += run.max(1);
        }
    }
    let [r, g, b] = UNDEFINED;
    let _ = writeln!(
        out,
        r##"<pattern id="undefined{id}" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)"><rect width="6" height="6" fill="rgb({r},{g},{b})"/><rect width="1.2" height="6" fill="#8c8c8c"/></pattern>
<path d="{path}" fill="url(#undefined{id})" shape-rendering="crispEdges"/>"##
    );
}

/// The colour bar: bands of one height, with pointed ends for values beyond the last levels.
struct Bar {
    left: f64,
    band: f64,
    bottom: f64,
    /// The room for the numbers beside it.
    numbers: f64,
}

impl Bar {
    fn new(at: DVec2, height: f64, scale: &Scale) -> Self {
        let bands = scale.bands() as f64;
        let band = (height / bands).clamp(BAND[1], BAND[0]).floor();
        // centred beside the plot, or from the plot's upper edge down if the plot is lower than the bar
        let top = at.y + (0.5 * (height - bands * band)).max(0.0).round();
        let widest = written(scale.decimals()).iter().map(|level| level.chars().count()).max().unwrap_or(1);
        let numbers = NUMBERS[0] + NUMBERS[1] * widest as f64;
        Self { left: at.x + BAR[0], band, bottom: top + bands * band, numbers }
    }

    /// The lower border of a band.
    fn border(&self, band: usize) -> f64 {
        self.bottom - self.band * band as f64
    }

    fn draw(&self, out: &mut String, scale: &Scale, quantity: Quantity) {
        let (left, width, band) = (self.left, BAR[1], self.band);
        let (right, middle, bands) = (left + width, left + 0.5 * width, scale.bands());
        for k in 0..bands {
            let (low, high) = (self.border(k), self.border(k + 1));
            let shape = match k {
                0 => format!("M{left} {high}h{width}L{middle} {low}z"),
                _ if k + 1 == bands => format!("M{left} {low}h{width}L{middle} {high}z"),
                _ => format!("M{left} {low}h{width}v-{band}h-{width}z"),
            };
            let _ = writeln!(out, r#"<path d="{shape}" fill="{}"/>"#, hex(scale.band_colour(k)));
        }
        let (first, last) = (self.border(1), self.border(bands - 1));
        let (tail, tip) = (self.border(0), self.border(bands));
        let _ = writeln!(
            out,
            r#"<path d="M{left} {first}L{middle} {tail}L{right} {first}V{last}L{middle} {tip}L{left} {last}z" fill="none" stroke="{INK}" stroke-width="0.8"/>
<g font-size="12">"#
        );
        let mut zero = 0.0;
        for (k, (level, text)) in scale.decimals().iter().zip(written(scale.decimals())).enumerate() {
            let y = self.border(k + 1);
            let weight = if level.mantissa == 0 { 1.8 } else { 0.8 };
            if level.mantissa == 0 {
                zero = y;
            }
            let _ = writeln!(
                out,
                r#"<path d="M{left} {y}h{}" stroke="{INK}" stroke-width="{weight}"/><text x="{}" y="{}">{text}</text>"#,
                width + 4.0,
                right + 8.0,
                y + 4.0
            );
        }
        let x = right + self.numbers + 4.0;
        let [inside, outside] = match quantity {
            Quantity::Omega => ["inside, ω &gt; 0", "outside, ω &lt; 0"],
            Quantity::Distance => ["depth inside, m", "−distance, m"],
        };
        for (y, text) in [(0.5 * (zero + tip), inside), (0.5 * (zero + tail), outside)] {
            let _ = writeln!(
                out,
                r#"<text transform="translate({x} {y:.2}) rotate(-90)" text-anchor="middle">{text}</text>"#
            );
        }
        out.push_str("</g>\n");
    }
}

pub fn on_page(frame: &PlotFrame, points: &[DVec2]) -> Vec<DVec2> {
    points.iter().map(|&uv| frame.page(uv)).collect()
}

fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn mean(a: Rgb, b: Rgb) -> Rgb {
    std::array::from_fn(|i| a[i].midpoint(b[i]))
}

/// The text with its markup characters escaped for XML, and without control characters.
pub fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars().filter(|c| !c.is_control()) {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::{
        super::tests::{disc, field, pawn},
        *,
    };
    use crate::slice::{Axis, DEFAULT_SAMPLES, Plane, Window, png, sample, write_png};

    fn pawn_window() -> Window {
        Window::new(DVec2::new(0.8, -0.1), DVec2::new(2.2, 1.6))
    }

    fn plot(field: &dyn Field, name: &str) -> String {
        svg(field, name, &sample(field, Plane::new(Axis::Y, 1.5), pawn_window(), DEFAULT_SAMPLES).unwrap())
    }

    #[test]
    fn drawings_are_well_formed_and_small() {
        let text = plot(&pawn(), "pawn");
        assert!(png::parse(&text).is_ok());
        assert!(text.len() < 60_000, "{} bytes", text.len());
        for expected in ["<title>pawn, y = 1.5 m</title>", ">−0.5</text>", ">1.2</text>", "inside, ω &gt; 0"]
        {
            assert!(text.contains(expected), "no {expected}");
        }
    }

    #[test]
    fn names_cannot_break_the_document() {
        let text = plot(&disc(), "a<b & \"c\"\u{1}");
        assert!(png::parse(&text).is_ok());
        assert!(text.contains("a&lt;b &amp; &quot;c&quot;,"));
    }

    #[test]
    fn fields_without_values_or_surface_are_drawn() {
        for f in [|_: DVec3| f64::NAN, |_: DVec3| f64::INFINITY, |_: DVec3| 0.0, |p: DVec3| p.x.sqrt() - 1e3]
        {
            assert!(png::parse(&plot(&field(f), "odd")).is_ok());
        }
        let half = plot(&field(|p| (p.x - 1.5).sqrt() - 0.4), "root");
        assert!(half.contains("url(#undefined)"));
    }

    #[test]
    fn pictures_decode_to_the_size_asked_for_and_are_the_same_on_two_threads() {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut bytes = Vec::new();
            let plane = Plane::new(Axis::Y, 1.5);
            pool.install(|| write_png(&pawn(), "pawn", plane, pawn_window(), 80, 0.5, &mut bytes)).unwrap();
            bytes
        };
        let bytes = on(1);
        assert!(bytes == on(2));
        let mut reader = ::png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (291, 278));
        assert_eq!(pixels[..3], [255, 255, 255]);
        let mut nothing = Vec::new();
        assert!(
            write_png(&pawn(), "", Plane::new(Axis::X, 0.0), pawn_window(), 8, f32::NAN, &mut nothing)
                .is_err()
        );
    }
}
