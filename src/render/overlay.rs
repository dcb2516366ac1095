//! Words and numbers over the picture: the title, the colour bar and the caption, in the one font that is
//! built in.

use std::fmt::Write;

use resvg::tiny_skia::{Pixmap, Transform};

use super::{ColourMap, RenderError, Rgb, image::Layer};
use crate::geom::significant;

/// The text beside the picture.
#[derive(Debug, Clone, Copy)]
pub struct Legend<'a> {
    /// The title over the picture.
    pub title: &'a str,
    /// The scale of the colour bar; `None` draws no bar.
    pub scale: Option<Scale<'a>>,
}

/// The meaning of the colours of particles. Frames of a run can be compared if they share one scale.
#[derive(Debug, Clone, Copy)]
pub struct Scale<'a> {
    /// The quantity and its unit, written over the colour bar.
    pub label: &'a str,
    /// The value at the low end of the map.
    pub low: f64,
    /// The value at the high end of the map.
    pub high: f64,
    /// Whether smaller and larger values may be shown, in the colours of the ends. The bar then ends in a
    /// tip.
    pub open: [bool; 2],
    /// The colours.
    pub map: ColourMap,
}

impl<'a> Scale<'a> {
    /// Speeds from rest to `fastest`, in m/s, and beyond.
    pub fn speeds(fastest: f64) -> Self {
        let open = [false, true];
        Self { label: "speed, m/s", low: 0.0, high: fastest, open, map: ColourMap::default() }
    }

    /// The scale without its label, so that it need not live as long as the text.
    pub(super) fn unlabelled(&self) -> Scale<'static> {
        Scale { label: "", ..*self }
    }

    /// The colour of a value.
    pub(super) fn colour(&self, value: f64) -> Rgb {
        self.map.colour(value, (self.low, self.high))
    }
}

/// The text under a frame.
#[derive(Debug, Clone, Copy)]
pub struct Caption {
    /// Simulated time in seconds.
    pub time: f64,
    /// The time between pictures, s: times are shown with the digits that tell two of them apart. 0 for the usual
    /// digits.
    pub every: f64,
    /// The number of the step, if it is known.
    pub step: Option<u64>,
}

use crate::lettering;

const INK: &str = "#1c1c1c";

/// What letters have around them, so that they can be read over particles: a border in the colour of the paper.
const HALO: &str =
    r##"paint-order="stroke" stroke="#fff" stroke-opacity=".85" stroke-width="5" stroke-linejoin="round""##;

/// Least pixels per unit at which the smallest letters can be read.
const READABLE: f64 = 0.5;

/// Pixels per unit of the layout, which is made for a height of 960, in a picture of this height. In a small one letters
/// stay as large as can be read, as long as there is room for the colour bar.
pub(super) fn unit(height: f64) -> f64 {
    (height / 960.0).max(READABLE.min(height / BAR_HEIGHT))
}

/// Draws an SVG body on a page of `size` units, at `scale` pixels per unit.
fn draw(size: (f64, f64), scale: f64, body: &str) -> Result<Layer, RenderError> {
    let svg = format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{}" height="{}" fill="{INK}">{body}</svg>"#,
        size.0, size.1
    );
    let tree = lettering::tree(&svg).map_err(RenderError::Legend)?;
    let pixels = |units: f64| (units * scale).ceil().clamp(1.0, 8192.0) as u32;
    let (width, height) = (pixels(size.0), pixels(size.1));
    let mut pixmap = Pixmap::new(width, height)
        .ok_or_else(|| RenderError::Legend(format!("{width} × {height} pixels")))?;
    resvg::render(&tree, Transform::from_scale(scale as f32, scale as f32), &mut pixmap.as_mut());
    Ok(Layer { width: width as usize, height: height as usize, rgba: pixmap.take() })
}

/// The title, for the upper left corner of a page `width` units wide.
pub fn title(text: &str, width: f64, scale: f64) -> Result<Layer, RenderError> {
    let text = escaped(text);
    draw((width, 48.0), scale, &format!(r#"<text x="32" y="36" font-size="22" {HALO}>{text}</text>"#))
}

/// A text, escaped for SVG.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars().filter(|c| !c.is_control()) {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            _ => escaped.push(c),
        }
    }
    escaped
}

/// The width of the colour bar's layer, in units.
pub const BAR_WIDTH: f64 = 124.0;
/// The height of the colour bar's layer, in units.
pub const BAR_HEIGHT: f64 = 420.0;
/// The length, in units, of the tip at an end of the colour bar beyond which values are shown.
const TIP: f64 = 12.0;

/// The colour bar.
pub fn bar(values: &Scale<'_>, scale: f64) -> Result<Layer, RenderError> {
    let (left, top, width, height) = (16.0, 44.0, 18.0, 360.0);
    let mut body = String::from(r#"<linearGradient id="g" x1="0" y1="1" x2="0" y2="0">"#);
    let stops = values.map.stops();
    for (k, [r, g, b]) in stops.iter().enumerate() {
        let offset = k as f64 / (stops.len() - 1) as f64;
        let _ = write!(body, r#"<stop offset="{offset}" stop-color="rgb({r},{g},{b})"/>"#);
    }
    let _ = write!(
        body,
        r#"</linearGradient><rect x="{left}" y="{top}" width="{width}" height="{height}" fill="url(#g)" stroke="{INK}"/>"#
    );
    let ends = [(stops[0], top + height, TIP), (stops[stops.len() - 1], top, -TIP)];
    for (([r, g, b], y, tip), _) in ends.into_iter().zip(values.open).filter(|(_, is_open)| *is_open) {
        let _ = write!(
            body,
            r#"<path d="M{left} {y}l{} {tip}l{} {}z" fill="rgb({r},{g},{b})" stroke="{INK}" stroke-linejoin="round"/>"#,
            0.5 * width,
            0.5 * width,
            -tip
        );
    }
    let _ = write!(
        body,
        r#"<g font-size="16"><text x="{left}" y="{}" {HALO}>{}</text>"#,
        top - 18.0,
        escaped(values.label)
    );
    for (value, label) in marks(values.low, values.high) {
        // where all values are one, particles have the colour of the low end
        let span = values.high - values.low;
        let part = if span > 0.0 { (values.high - value) / span } else { 1.0 };
        let y = top + height * part;
        let right = left + width;
        let _ = write!(
            body,
            r#"<path d="M{right} {y:.2}h5" stroke="{INK}"/><text x="{}" y="{:.2}" {HALO}>{label}</text>"#,
            right + 10.0,
            y + 5.5
        );
    }
    body.push_str("</g>");
    draw((BAR_WIDTH, BAR_HEIGHT), scale, &body)
}

/// The height of the caption's layer, in units.
pub const CAPTION_HEIGHT: f64 = 44.0;

/// The time, the step and the number of particles where there are any, in columns that stay in place while
/// the numbers change.
pub fn caption(moment: &Caption, particles: usize, scale: f64) -> Result<Layer, RenderError> {
    let mut words = vec![time(moment)];
    words.extend(moment.step.map(|step| format!("step {}", grouped(step))));
    words.extend((particles > 0).then(|| format!("N = {}", grouped(particles as u64))));
    let mut body = String::from(r#"<g font-size="18">"#);
    for (k, words) in words.iter().enumerate() {
        let _ = write!(body, r#"<text x="{}" y="22" {HALO}>{words}</text>"#, 32 + 140 * k);
    }
    body.push_str("</g>");
    draw((520.0, CAPTION_HEIGHT), scale, &body)
}

fn time(moment: &Caption) -> String {
    // a single instant has no distance to another one
    let every = if moment.every > 0.0 { moment.every } else { moment.time.abs() };
    format!("t = {:.*} s", digits_of_time(every), moment.time)
}

/// Decimal digits of times that are so far apart, s: two of the difference are shown, and three at least.
pub fn digits_of_time(every: f64) -> usize {
    const MOST: f64 = 9.0;
    let of_difference = 1.0 - libm::log10(every).floor();
    if every > 0.0 && of_difference > 3.0 { of_difference.min(MOST) as usize } else { 3 }
}

/// The digits of a number in groups of three, with unbreakable spaces between them.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) && digits.len() > 4 {
            out.push('\u{a0}');
        }
        out.push(digit);
    }
    out
}

/// Round values of a range with their labels; or its only value, if it has no more than one.
fn marks(low: f64, high: f64) -> Vec<(f64, String)> {
    let marks = round_values(low, high);
    if !(marks.is_empty() && low.is_finite() && high.is_finite() && low <= high) {
        return marks;
    }
    let value = significant(low);
    let is_plain = value == 0.0 || (1e-4..1e7).contains(&value.abs());
    vec![(low, if is_plain { value.to_string() } else { format!("{value:e}") })]
}

/// Two to seven round values of a range with their labels. Empty if the range is empty or endless.
fn round_values(low: f64, high: f64) -> Vec<(f64, String)> {
    let width = high - low;
    // numbers that agree in all but their last digits have no round values between them
    let noise = 1e-9 * low.abs().max(high.abs());
    if !(width > noise && width.is_finite()) {
        return Vec::new();
    }
    let decade = libm::log10(width).floor() as i32;
    let candidates = [(1, decade - 1), (2, decade - 1), (5, decade - 1), (1, decade), (2, decade)];
    for (mantissa, exponent) in candidates {
        // read back from digits, so that the value equals the label
        let number = |k: i64| format!("{}e{exponent}", k * mantissa).parse::<f64>().unwrap_or(f64::NAN);
        let step = number(1);
        let first = ((low - 1e-9 * width) / step).ceil() as i64;
        let last = ((high + 1e-9 * width) / step).floor() as i64;
        if last - first < 7 {
            let places = (-exponent).max(0) as usize;
            let plain = (-4..5).contains(&exponent) && low.abs().max(high.abs()) < 1e7;
            let label = |v: f64| if plain { format!("{v:.places$}") } else { format!("{v:e}") };
            return (first..=last).map(|k| (number(k), label(number(k)))).collect();
        }
    }
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_has_a_few_round_numbers() {
        let range = |low: f64, high: f64| {
            round_values(low, high).into_iter().map(|(_, l)| l).collect::<Vec<_>>().join(" ")
        };
        let labels = |top: f64| range(0.0, top);
        assert_eq!(labels(5.4), "0 1 2 3 4 5");
        assert_eq!(labels(1.0), "0.0 0.2 0.4 0.6 0.8 1.0");
        assert_eq!(labels(0.3), "0.00 0.05 0.10 0.15 0.20 0.25 0.30");
        assert_eq!(labels(2e-9), "0e0 5e-10 1e-9 1.5e-9 2e-9");
        assert_eq!(labels(f64::NAN) + &labels(-1.0) + &labels(f64::INFINITY), "");
        assert_eq!(range(987.0, 1012.0), "990 995 1000 1005 1010");
        assert_eq!(range(-0.25, 0.25), "-0.2 -0.1 0.0 0.1 0.2");
        assert_eq!(range(1e300, 1e300) + &range(1.0, 1.0 + 1e-15), "");
    }

    #[test]
    fn a_range_of_one_value_has_its_number() {
        let marks =
            |low: f64, high: f64| marks(low, high).into_iter().map(|(_, l)| l).collect::<Vec<_>>().join(" ");
        assert_eq!(marks(0.0, 0.0), "0");
        assert_eq!(marks(998.29, 998.29), "998.29");
        assert_eq!(marks(1.0 / 3.0, 1.0 / 3.0 + 1e-16), "0.333333");
        assert_eq!(marks(-2e-9, -2e-9), "-2e-9");
        assert_eq!(marks(0.0, 2.0), "0.0 0.5 1.0 1.5 2.0");
        assert_eq!(marks(f64::NAN, f64::NAN) + &marks(1.0, f64::INFINITY) + &marks(1.0, 0.0), "");
    }

    #[test]
    fn letters_of_small_pictures_can_be_read() {
        let smallest = |height: f64| 16.0 * unit(height);
        assert_eq!([480.0, 960.0, 1920.0].map(unit), [0.5, 1.0, 2.0]);
        assert!([200.0, 240.0, 300.0].map(smallest).into_iter().all(|pixels| pixels > 7.0));
        // and its bar fits a picture of any height
        assert!([20.0, 100.0, 200.0, 400.0].into_iter().all(|height| BAR_HEIGHT * unit(height) <= height));
    }

    #[test]
    fn numbers_are_grouped_by_thousands() {
        assert_eq!(
            [7, 1234, 10_000, 1_234_567].map(grouped),
            ["7", "1234", "10\u{a0}000", "1\u{a0}234\u{a0}567"]
        );
    }

    #[test]
    fn times_have_the_digits_that_tell_them_apart() {
        let digits = [0.0, 0.05, 0.01, 1e-3, 2.5e-4, 1e-6, 1e-20, f64::NAN].map(digits_of_time);
        assert_eq!(digits, [3, 3, 3, 4, 5, 7, 9, 3]);
    }

    #[test]
    fn a_single_instant_has_digits_too() {
        let at = |time: f64, every: f64| super::time(&Caption { time, every, step: None });
        assert_eq!(at(1e-7, 0.0), "t = 0.00000010 s");
        assert_eq!(at(1.25, 0.0), "t = 1.250 s");
        assert_eq!(at(0.0, 0.0), "t = 0.000 s");
        assert_eq!(at(1e-7, 2.5e-8), "t = 0.000000100 s");
    }

    #[test]
    fn any_title_and_moment_can_be_set() {
        assert!(title("a<b & \"c\"\u{0}", 400.0, 1.0).is_ok());
        let layer =
            caption(&Caption { time: f64::NAN, every: f64::NAN, step: Some(u64::MAX) }, 0, 0.1).unwrap();
        assert_eq!((layer.width, layer.height), (52, 5));
    }
}
