//! The frame of a plot: the place of (u, v) on the page, and the ticks and labels around it.
//!
//! Page units are CSS pixels, with y downwards.

use std::fmt::Write;

use glam::DVec2;

use super::{
    Plane, Window,
    numbers::{Decimal, ticks, written},
};

/// The longest sides of the plotted area.
const MAX_SIZE: DVec2 = DVec2::new(560.0, 460.0);
/// A long thin window is stretched to this rather than drawn as a line.
const MIN_SIDE: f64 = 60.0;
const TICK: f64 = 5.0;
/// The width of a digit of a number at a tick.
const LETTER: f64 = 6.6;
/// The height of the capitals in the name of an axis, and the room that is left outside of it.
const NAME: f64 = 12.0;
/// From the plotted area to the numbers of the vertical axis, and from these to the name of the axis.
const BESIDE_NUMBERS: f64 = TICK + 14.0;
/// Room for one label on the horizontal and on the vertical axis.
const LABEL_SPACING: DVec2 = DVec2::new(46.0, 36.0);

/// The plotted area on the page.
#[derive(Debug, Clone, Copy)]
pub struct PlotFrame {
    pub window: Window,
    pub origin: DVec2,
    pub size: DVec2,
}

impl PlotFrame {
    /// The largest frame with equal scales in both directions, its upper left corner at `origin`.
    pub fn new(window: Window, origin: DVec2) -> Self {
        let size = window.size();
        let scale = (MAX_SIZE / size).min_element();
        Self { window, origin, size: (size * scale).max(DVec2::splat(MIN_SIDE)).round() }
    }

    /// [`PlotFrame::new`], moved to the right as far as the numbers of the vertical axis and its name need room.
    pub fn with_room(window: Window, least: DVec2) -> Self {
        let frame = Self::new(window, least);
        let needed = (NAME + BESIDE_NUMBERS + LETTER * widest(&written(&frame.ticks(1))) as f64).ceil();
        Self { origin: DVec2::new(least.x.max(needed), least.y), ..frame }
    }

    /// The numbers of an axis: 0 is the horizontal one, 1 the vertical one.
    fn ticks(&self, axis: usize) -> Vec<Decimal> {
        let count = ((self.size[axis] / LABEL_SPACING[axis]) as usize).clamp(2, 9);
        at_least_two(self.window.min[axis], self.window.max[axis], count)
    }

    pub fn page(&self, uv: DVec2) -> DVec2 {
        let t = (uv - self.window.min) / self.window.size();
        self.origin + self.size * DVec2::new(t.x, 1.0 - t.y)
    }

    pub fn right(&self) -> f64 {
        self.origin.x + self.size.x
    }

    pub fn bottom(&self) -> f64 {
        self.origin.y + self.size.y
    }
}

/// Draws the border, ticks with numbers, and the names of the axes.
pub fn draw(out: &mut String, frame: &PlotFrame, plane: Plane) {
    let (right, up) = plane.axis.right_and_up();
    let PlotFrame { origin, size, .. } = *frame;
    let (left, bottom) = (origin.x, frame.bottom());

    let mut marks = String::new();
    let mut numbers = String::new();
    let across = frame.ticks(0);
    let texts = written(&across);
    // numbers that would run into each other make room for the first and the last
    let room = size.x / across.len().max(1) as f64 >= LETTER * widest(&texts) as f64 + 6.0;
    for (k, (tick, label)) in across.iter().zip(&texts).enumerate() {
        let x = frame.page(DVec2::new(tick.value(), 0.0)).x;
        let _ = write!(marks, "M{x:.2} {bottom}v{TICK}");
        if room || k == 0 || k + 1 == across.len() {
            let _ = writeln!(numbers, r#"<text x="{x:.2}" y="{:.2}">{label}</text>"#, bottom + TICK + 13.0);
        }
    }
    let upwards = frame.ticks(1);
    let texts = written(&upwards);
    for (tick, label) in upwards.iter().zip(&texts) {
        let y = frame.page(DVec2::new(0.0, tick.value())).y;
        let _ = write!(marks, "M{left} {y:.2}h-{TICK}");
        let _ = writeln!(
            numbers,
            r#"<text x="{:.2}" y="{:.2}" text-anchor="end">{label}</text>"#,
            left - TICK - 4.0,
            y + 4.0
        );
    }
    let _ = writeln!(
        out,
        r#"<path d="M{left} {}h{}v{}h-{}z{marks}" fill="none" stroke="{INK}"/>"#,
        origin.y, size.x, size.y, size.x
    );
    let _ = write!(
        out,
        r#"<g font-size="12" text-anchor="middle">
{numbers}</g>
"#
    );
    let (x, y) = (left + 0.5 * size.x, bottom + 38.0);
    let _ = writeln!(
        out,
        r#"<text x="{x:.2}" y="{y:.2}" font-size="14" text-anchor="middle">{}, m</text>"#,
        right.name()
    );
    let (x, y) = (left - BESIDE_NUMBERS - LETTER * widest(&texts) as f64, origin.y + 0.5 * size.y + 4.0);
    let _ = writeln!(
        out,
        r#"<text transform="translate({x:.2} {y:.2}) rotate(-90)" font-size="14" text-anchor="middle">{}, m</text>"#,
        up.name()
    );
}

/// The number of characters of the longest text.
fn widest(texts: &[String]) -> usize {
    texts.iter().map(|text| text.chars().count()).max().unwrap_or(1)
}

/// Round numbers between two, at least two of them if there are any: one alone says nothing of the scale.
fn at_least_two(min: f64, max: f64, count: usize) -> Vec<Decimal> {
    let found = (count..count + 4).map(|count| ticks(min, max, count));
    let mut first = None;
    for ticks in found {
        if ticks.len() >= 2 {
            return ticks;
        }
        first.get_or_insert(ticks);
    }
    first.unwrap_or_default()
}

/// The colour of lines and text, a little softer than black.
pub const INK: &str = "#1c1c1c";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_keep_the_shape_of_the_window_and_the_v_axis_points_up() {
        let window = Window::new(DVec2::new(0.0, 1.0), DVec2::new(2.0, 2.0));
        let frame = PlotFrame::new(window, DVec2::new(50.0, 40.0));
        assert_eq!(frame.size, DVec2::new(560.0, 280.0));
        assert_eq!(frame.page(window.min), DVec2::new(50.0, frame.bottom()));
        assert_eq!(frame.page(window.max), DVec2::new(frame.right(), 40.0));
    }

    #[test]
    fn long_numbers_leave_room_for_the_name_of_their_axis() {
        for (low, side) in [(0.0, 1.0), (19.999, 2e-3), (5e6, 10.0), (1_999.999_999, 2e-6), (-5e6, 0.01)] {
            let window = Window::new(DVec2::splat(low), DVec2::splat(low + side));
            let frame = PlotFrame::with_room(window, DVec2::new(72.0, 44.0));
            let mut out = String::new();
            draw(&mut out, &frame, Plane::new(super::super::Axis::Z, 0.0));
            let name = out.lines().find(|line| line.contains("rotate(-90)")).unwrap();
            let x = name.split("translate(").nth(1).unwrap().split(' ').next().unwrap();
            assert!(x.parse::<f64>().unwrap() >= NAME, "{low}: {name}");
        }
        let usual = Window::new(DVec2::ZERO, DVec2::ONE);
        assert_eq!(PlotFrame::with_room(usual, DVec2::new(72.0, 44.0)).origin, DVec2::new(72.0, 44.0));
    }
}
