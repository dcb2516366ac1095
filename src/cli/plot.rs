//! The common parts of all plots: the ground with its title, the margins, the axes, and SVG or PNG at
//! the end.

use std::fmt::Write;
use std::path::Path;

use super::failure::Failure;
use super::output;
use rfm::slice;

pub(super) const WIDTH: f64 = 760.0;
pub(super) const HEIGHT: f64 = 520.0;
pub(super) const LEFT: f64 = 80.0;
pub(super) const RIGHT: f64 = 190.0;
pub(super) const TOP: f64 = 50.0;
pub(super) const BOTTOM: f64 = 60.0;

/// If an axis has at most this many powers of ten there is room for lines between them.
const FEW: i32 = 3;

/// The beginning of a plot: the white ground and the title.
pub(super) fn begin(title: &str) -> String {
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="Ubuntu" font-size="13"><rect width="100%" height="100%" fill="#ffffff"/><text x="{LEFT}" y="28" font-size="17">{}</text>"##,
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

/// A logarithmic axis over whole powers of ten.
pub(super) struct LogAxis {
    low: i32,
    high: i32,
    from: f64,
    to: f64,
}

impl LogAxis {
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

    /// The values to mark, each with its text: powers of ten, and if there are few of them also their double
    /// and fivefold.
    fn ticks(&self) -> impl Iterator<Item = (f64, String)> {
        let factors: &[f64] = if self.high - self.low <= FEW { &[1.0, 2.0, 5.0] } else { &[1.0] };
        (self.low..=self.high)
            .flat_map(move |power| factors.iter().map(move |factor| (factor, power)))
            .filter(|&(factor, power)| power < self.high || *factor == 1.0)
            .map(|(factor, power)| {
                let digits = (-power).max(0) as usize;
                let value = factor * 10f64.powi(power);
                (value, format!("{value:.digits$}"))
            })
    }

    pub fn at(&self, value: f64) -> f64 {
        let share = (value.log10() - f64::from(self.low)) / f64::from(self.high - self.low);
        self.from + share * (self.to - self.from)
    }
}

/// An axis on which equal differences are equally long. Its ticks are whole multiples of 1, 2 or 5 times a
/// power of ten.
pub(super) struct EvenAxis {
    low: f64,
    high: f64,
    tick: f64,
    from: f64,
    to: f64,
}

impl EvenAxis {
    /// An axis over the finite values, or from 0 to 1 without any.
    pub fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        /// The least number of intervals between ticks.
        const TICKS: f64 = 5.0;
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        // a line that does not rise still needs a height around it
        let largest = low.abs().max(high.abs());
        let size = match high - low {
            size if size > 1e-9 * largest => size,
            _ if largest > 0.0 => 0.1 * largest,
            _ => 1.0,
        };
        let power = 10f64.powf((size / TICKS).log10().floor());
        let tick = [5.0, 2.0, 1.0].map(|n| n * power).into_iter().find(|tick| size / tick >= TICKS);
        let tick = tick.unwrap_or(power);
        Self { low: (low / tick).floor() * tick, high: ((low + size) / tick).ceil() * tick, tick, from, to }
    }

    pub fn at(&self, value: f64) -> f64 {
        self.from + (value - self.low) / (self.high - self.low) * (self.to - self.from)
    }

    /// The values to mark, each with its text.
    fn ticks(&self) -> impl Iterator<Item = (f64, String)> {
        let count = ((self.high - self.low) / self.tick).round() as usize;
        let digits = (-self.tick.log10().floor()).clamp(0.0, 12.0) as usize;
        let large = self.low.abs().max(self.high.abs()) >= 1e6 || self.tick < 1e-6;
        (0..=count).map(move |k| {
            let value = self.low + k as f64 * self.tick;
            // the last bits of a sum must not give −0
            let value = if value.abs() < 1e-9 * self.tick { 0.0 } else { value };
            (value, if large { format!("{value:.1e}") } else { format!("{value:.digits$}") })
        })
    }
}

/// Draws lines at the ticks, and the names of the axes.
pub(super) fn grid(out: &mut String, x: &LogAxis, y: &LogAxis, names: [&str; 2]) {
    for (value, text) in x.ticks() {
        across(out, x.at(value), &text);
    }
    if y.high - y.low <= FEW {
        for (value, text) in y.ticks() {
            along(out, y.at(value), &text);
        }
    } else {
        for power in (y.low..=y.high).filter(|p| (p - y.low) % 2 == 0) {
            along(out, y.at(10f64.powi(power)), &format!("1e{power}"));
        }
    }
    axis_names(out, names);
}

/// Draws lines at the ticks, and the names of the axes.
pub(super) fn even_grid(out: &mut String, x: &EvenAxis, y: &EvenAxis, names: [&str; 2]) {
    for (value, text) in x.ticks() {
        across(out, x.at(value), &text);
    }
    for (value, text) in y.ticks() {
        along(out, y.at(value), &text);
    }
    axis_names(out, names);
}

/// Draws an upright line of the grid, with its value below. Writing to a String cannot fail.
fn across(out: &mut String, at: f64, text: &str) {
    let _ = write!(
        out,
        r##"<line x1="{at:.1}" y1="{TOP}" x2="{at:.1}" y2="{:.1}" stroke="#dddddd"/><text x="{at:.1}" y="{:.1}" text-anchor="middle">{text}</text>"##,
        HEIGHT - BOTTOM,
        HEIGHT - BOTTOM + 20.0,
    );
}

/// Draws a level line of the grid, with its value to the left.
fn along(out: &mut String, at: f64, text: &str) {
    let _ = write!(
        out,
        r##"<line x1="{LEFT}" y1="{at:.1}" x2="{:.1}" y2="{at:.1}" stroke="#dddddd"/><text x="{:.1}" y="{:.1}" text-anchor="end">{text}</text>"##,
        WIDTH - RIGHT,
        LEFT - 8.0,
        at + 4.5
    );
}

fn axis_names(out: &mut String, [along, up]: [&str; 2]) {
    let middle = 0.5 * (TOP + HEIGHT - BOTTOM);
    let _ = write!(
        out,
        r##"<text x="{:.1}" y="{:.1}" text-anchor="middle">{along}</text><text x="20" y="{middle:.1}" text-anchor="middle" transform="rotate(-90 20 {middle:.1})">{up}</text>"##,
        0.5 * (LEFT + WIDTH - RIGHT),
        HEIGHT - 14.0
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_powers_of_ten_are_divided() {
        let texts = |low: f64, high: f64| -> Vec<String> {
            LogAxis::over([low, high].into_iter(), 0.0, 1.0).ticks().map(|tick| tick.1).collect()
        };
        assert_eq!(texts(0.03, 0.4), ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"]);
        assert_eq!(texts(1e-3, 20.0), ["0.001", "0.01", "0.1", "1", "10", "100"]);
    }

    #[test]
    fn ticks_are_round_and_hold_all_values() {
        for (low, high) in [(0.0, 1.0), (-3.2, 17.0), (0.0, 1e-4), (1e5, 1e5 + 3.0), (2.0, 2.0), (0.0, 0.0)] {
            let axis = EvenAxis::over([low, high].into_iter(), 0.0, 100.0);
            let count = axis.ticks().count();
            assert!((6..=15).contains(&count), "{low} {high}: {count}");
            assert!(axis.at(low) >= 0.0 && axis.at(high) <= 100.0 + 1e-9, "{low} {high}");
            let texts: std::collections::BTreeSet<String> = axis.ticks().map(|(_, text)| text).collect();
            assert!(low == high || texts.len() == count, "{texts:?}");
        }
        let empty = EvenAxis::over(std::iter::empty(), 0.0, 1.0);
        assert_eq!((empty.low, empty.high), (0.0, 1.0));
        let texts: Vec<String> =
            EvenAxis::over([0.0, 0.3].into_iter(), 0.0, 1.0).ticks().map(|t| t.1).collect();
        assert_eq!(texts, ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25", "0.30"]);
    }
}
