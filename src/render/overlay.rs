//! Words and numbers over the picture: the title, the colour bar and the caption, in the one font that is
//! built in.

use std::fmt::Write;

use resvg::tiny_skia::{Pixmap, Transform};

use super::{RenderError, colour::STOPS, image::Layer};

/// The text beside the picture.
#[derive(Debug, Clone, Copy)]
pub struct Legend<'a> {
    /// The title over the picture.
    pub title: &'a str,
    /// The speed that is shown in red, in m/s. Frames of a run can be compared if it is the same for all
    /// of them.
    pub fastest: f64,
}

/// The text under a frame.
#[derive(Debug, Clone, Copy)]
pub struct Caption {
    /// Simulated time in seconds.
    pub time: f64,
    /// The number of the step.
    pub step: u64,
}

use crate::lettering;

const INK: &str = "#1c1c1c";

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
    let mut escaped = String::new();
    for c in text.chars().filter(|c| !c.is_control()) {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            _ => escaped.push(c),
        }
    }
    draw((width, 48.0), scale, &format!(r#"<text x="32" y="36" font-size="22">{escaped}</text>"#))
}

/// The width of the colour bar's layer, in units.
pub const BAR_WIDTH: f64 = 124.0;
/// The height of the colour bar's layer, in units.
pub const BAR_HEIGHT: f64 = 420.0;

/// The colour bar for speeds.
pub fn bar(legend: &Legend<'_>, scale: f64) -> Result<Layer, RenderError> {
    let (left, top, width, height) = (16.0, 44.0, 18.0, 360.0);
    let mut body = String::from(r#"<linearGradient id="g" x1="0" y1="1" x2="0" y2="0">"#);
    for (k, [r, g, b]) in STOPS.iter().enumerate() {
        let offset = k as f64 / (STOPS.len() - 1) as f64;
        let _ = write!(body, r#"<stop offset="{offset}" stop-color="rgb({r},{g},{b})"/>"#);
    }
    let _ = write!(
        body,
        r#"</linearGradient><rect x="{left}" y="{top}" width="{width}" height="{height}" fill="url(#g)" stroke="{INK}"/><g font-size="16"><text x="{left}" y="{}">speed, m/s</text>"#,
        top - 18.0
    );
    for (value, label) in round_values(legend.fastest) {
        let y = top + height * (1.0 - value / legend.fastest);
        let right = left + width;
        let _ = write!(
            body,
            r#"<path d="M{right} {y:.2}h5" stroke="{INK}"/><text x="{}" y="{:.2}">{label}</text>"#,
            right + 10.0,
            y + 5.5
        );
    }
    body.push_str("</g>");
    draw((BAR_WIDTH, BAR_HEIGHT), scale, &body)
}

/// The height of the caption's layer, in units.
pub const CAPTION_HEIGHT: f64 = 44.0;

/// The time, the step and the number of particles, in columns that stay in place while the numbers change.
pub fn caption(moment: &Caption, particles: usize, scale: f64) -> Result<Layer, RenderError> {
    let body = format!(
        r#"<g font-size="18"><text x="32" y="22">t = {:.3} s</text><text x="172" y="22">step {}</text><text x="312" y="22">N = {}</text></g>"#,
        moment.time,
        grouped(moment.step),
        grouped(particles as u64)
    );
    draw((520.0, CAPTION_HEIGHT), scale, &body)
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

/// Three to seven round values from 0 to `top` with their labels. Empty if `top` is not a positive number.
fn round_values(top: f64) -> Vec<(f64, String)> {
    if !(top > 0.0 && top.is_finite()) {
        return Vec::new();
    }
    let decade = libm::log10(top).floor() as i32;
    let candidates = [(1, decade - 1), (2, decade - 1), (5, decade - 1), (1, decade), (2, decade)];
    for (mantissa, exponent) in candidates {
        // read back from digits, so that the value is the one of the label
        let number = |k: i64| format!("{}e{exponent}", k * mantissa).parse::<f64>().unwrap_or(f64::NAN);
        let count = (0..20).take_while(|&k| number(k) <= top * (1.0 + 1e-9)).count() as i64;
        if count <= 7 {
            let places = (-exponent).max(0) as usize;
            let plain = (-4..5).contains(&exponent);
            let label = |v: f64| if plain { format!("{v:.places$}") } else { format!("{v:e}") };
            return (0..count).map(|k| (number(k), label(number(k)))).collect();
        }
    }
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_has_a_few_round_numbers() {
        let labels = |top: f64| round_values(top).into_iter().map(|(_, l)| l).collect::<Vec<_>>().join(" ");
        assert_eq!(labels(5.4), "0 1 2 3 4 5");
        assert_eq!(labels(1.0), "0.0 0.2 0.4 0.6 0.8 1.0");
        assert_eq!(labels(0.3), "0.00 0.05 0.10 0.15 0.20 0.25 0.30");
        assert_eq!(labels(2e-9), "0e0 5e-10 1e-9 1.5e-9 2e-9");
        assert_eq!(labels(f64::NAN) + &labels(-1.0) + &labels(f64::INFINITY), "");
    }

    #[test]
    fn numbers_are_grouped_by_thousands() {
        assert_eq!(
            [7, 1234, 10_000, 1_234_567].map(grouped),
            ["7", "1234", "10\u{a0}000", "1\u{a0}234\u{a0}567"]
        );
    }

    #[test]
    fn any_title_and_moment_can_be_set() {
        assert!(title("a<b & \"c\"\u{0}", 400.0, 1.0).is_ok());
        let layer = caption(&Caption { time: f64::NAN, step: u64::MAX }, 0, 0.1).unwrap();
        assert_eq!((layer.width, layer.height), (52, 5));
    }
}
