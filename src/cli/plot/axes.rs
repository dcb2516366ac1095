//! The axes of plots, logarithmic and even, with their lines and numbers.

use std::fmt::Write;

use super::{BOTTOM, HEIGHT, LEFT, SECOND_AXIS, TOP};

/// If an axis covers at most this many powers of ten there is room for lines between them.
const FEW: f64 = 3.0;

/// Most powers of ten that have a line of their own.
const MANY: i32 = 8;

/// The room beyond the outermost marks of a logarithmic axis, as a factor.
const MARGIN: f64 = 1.12;

/// Positive values whose greatest is at least this many times their least are plotted by their logarithms: on an even
/// axis the smaller ones would lie in the line of the axis itself.
const WIDE: f64 = 100.0;

/// An axis of a plot.
pub(in crate::cli) trait Axis {
    /// Where a value is, in the picture's units. On a logarithmic axis it must be positive.
    fn at(&self, value: f64) -> f64;

    /// The values to mark, each with its text.
    fn ticks(&self) -> Vec<(f64, String)>;
}

/// An axis over figures and what else must find room, as the ends of their errors: logarithmic if the figures span two
/// powers of ten or more, and all is positive.
pub(in crate::cli) fn over_figures(figures: &[f64], room: &[f64], from: f64, to: f64) -> Box<dyn Axis> {
    let all = || figures.iter().chain(room).copied().filter(|value| value.is_finite());
    if all().all(|value| value > 0.0) && span(figures) >= WIDE {
        Box::new(LogAxis::over(all(), from, to))
    } else {
        Box::new(EvenAxis::over(all(), from, to))
    }
}

/// An axis over the values of a param: logarithmic if they span two powers of ten or more, and if their ratios are more
/// even than their differences.
pub(in crate::cli) fn over_params(values: &[f64], from: f64, to: f64) -> Box<dyn Axis> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.dedup();
    let uneven = |gap: &dyn Fn(f64, f64) -> f64| {
        let gaps: Vec<f64> = sorted.windows(2).map(|pair| gap(pair[0], pair[1])).collect();
        span(&gaps)
    };
    if sorted.first().is_some_and(|least| *least > 0.0)
        && span(&sorted) >= WIDE
        && uneven(&|a, b| (b / a).ln()) < uneven(&|a, b| b - a)
    {
        Box::new(LogAxis::over(sorted.into_iter(), from, to))
    } else {
        Box::new(EvenAxis::over(sorted.into_iter(), from, to))
    }
}

/// The greatest of some positive values over the least; 1 without values.
fn span(values: &[f64]) -> f64 {
    let ends = |(least, most): (f64, f64), value: &f64| (least.min(*value), most.max(*value));
    let finite = values.iter().filter(|value| value.is_finite());
    let (least, most) = finite.fold((f64::INFINITY, 0.0), ends);
    if most > 0.0 { most / least } else { 1.0 }
}

/// A logarithmic axis, from one number 1, 2 or 5 times a power of ten to another.
pub(in crate::cli) struct LogAxis {
    /// Logarithms of the ends.
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl LogAxis {
    /// An axis that just holds the values, which must be positive.
    pub fn over(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (least, most) =
            values.fold((f64::INFINITY, 0.0_f64), |(least, most), value| (least.min(value), most.max(value)));
        if !(least > 0.0 && least <= most && most.is_finite()) {
            return Self { low: 0.0, high: 1.0, from, to };
        }
        let decade = (least / MARGIN).log10().floor() as i32;
        let steps = || (0..).flat_map(|k| [1.0, 2.0, 5.0].map(|factor| number(factor, decade + k)));
        let low = steps().take_while(|step| *step <= least / MARGIN).last().unwrap_or(least);
        let high = steps().find(|step| *step >= most * MARGIN).unwrap_or(most);
        Self { low: low.log10(), high: high.log10(), from, to }
    }
}

impl Axis for LogAxis {
    /// The values to mark, each with its text: powers of ten, and if there are few of them also their double
    /// and fivefold.
    fn ticks(&self) -> Vec<(f64, String)> {
        let span = self.high - self.low;
        let factors: &[f64] = if span <= FEW { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let (first, last) = (self.low.floor() as i32, self.high.ceil() as i32);
        let stride = (1 + (last - first) / MANY).max(1);
        let is_within = |value: f64| value.log10() > self.low - 1e-9 && value.log10() < self.high + 1e-9;
        let plain = first >= -4 && last <= 6;
        let text = |factor: f64, power: i32| {
            let digits = (-power).max(0) as usize;
            if plain { format!("{:.digits$}", number(factor, power)) } else { format!("{factor}e{power}") }
        };
        (first..=last)
            .filter(|power| power.rem_euclid(stride) == 0)
            .flat_map(|power| factors.iter().map(move |factor| (*factor, power)))
            .filter(|(factor, power)| is_within(number(*factor, *power)))
            .map(|(factor, power)| (number(factor, power), text(factor, power)))
            .collect()
    }

    fn at(&self, value: f64) -> f64 {
        let share = (value.log10() - self.low) / (self.high - self.low);
        self.from + share * (self.to - self.from)
    }
}

fn number(factor: f64, power: i32) -> f64 {
    factor * 10f64.powi(power)
}

/// An axis on which equal differences are equally long. Its ticks are whole multiples of 1, 2 or 5 times a
/// power of ten.
pub(in crate::cli) struct EvenAxis {
    low: f64,
    high: f64,
    tick: f64,
    from: f64,
    to: f64,
    /// What the numbers at the ticks are counted from.
    origin: f64,
}

/// Numbers with more digits than these are counted from the lowest of them where a plot can say so.
const MOST_DIGITS: f64 = 5.0;

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
        let (low, high) = ((low / tick).floor() * tick, ((low + size) / tick).ceil() * tick);
        Self { low, high, tick, from, to, origin: 0.0 }
    }

    /// The axis with short numbers: if its values differ in late digits only, they are counted from the lowest.
    /// [`EvenAxis::origin`] says so, and belongs into the name of the axis.
    #[must_use]
    pub fn with_short_numbers(mut self) -> Self {
        let least = self.low.abs().min(self.high.abs());
        let is_one_side = self.low * self.high > 0.0;
        if is_one_side && power(least) - power(self.tick) >= MOST_DIGITS {
            self.origin = self.low;
        }
        self
    }

    /// What the numbers are counted from, with all its digits; `None` if that is 0.
    pub fn origin(&self) -> Option<String> {
        let digits = (power(self.origin.abs()) - power(self.tick)).clamp(0.0, 15.0) as usize;
        (self.origin != 0.0).then(|| match self.origin.abs() {
            1e-3..1e6 => format!("{:.*}", (-power(self.tick)).clamp(0.0, 15.0) as usize, self.origin),
            _ => format!("{:.digits$e}", self.origin),
        })
    }

    /// Brings the zeros of two axes to one height: each gets as many ticks below and above it as the other has.
    /// Nothing is done where one of them does not hold zero, or would have more than twice as many ticks.
    pub fn with_common_zero(axes: &mut [Self]) {
        let counts = |axis: &Self| [-axis.low, axis.high].map(|end| (end / axis.tick).round());
        let [first, second] = axes else { return };
        let ([a, b], [c, d]) = (counts(first), counts(second));
        let (below, above) = (a.max(c), b.max(d));
        let holds_zero = [a, b, c, d].iter().all(|count| *count >= 0.0);
        if holds_zero && below + above <= 2.0 * (a + b).min(c + d) {
            for axis in [first, second] {
                (axis.low, axis.high) = (-below * axis.tick, above * axis.tick);
            }
        }
    }
}

impl Axis for EvenAxis {
    fn at(&self, value: f64) -> f64 {
        self.from + (value - self.low) / (self.high - self.low) * (self.to - self.from)
    }

    fn ticks(&self) -> Vec<(f64, String)> {
        let count = ((self.high - self.low) / self.tick).round() as usize;
        let digits = (-power(self.tick)).clamp(0.0, 12.0) as usize;
        let largest = (self.low - self.origin).abs().max((self.high - self.origin).abs());
        let large = largest >= 1e6 || self.tick < 1e-6;
        // enough of them to distinguish one tick from the next
        let of_power = (power(largest) - power(self.tick)).clamp(1.0, 12.0) as usize;
        let tick = |k: usize| {
            // the last bits of a sum must not give −0
            let rounded = |value: f64| if value.abs() < 1e-9 * self.tick { 0.0 } else { value };
            let value = rounded(self.low + k as f64 * self.tick);
            let number = if self.origin == self.low { k as f64 * self.tick } else { value };
            (value, if large { format!("{number:.of_power$e}") } else { format!("{number:.digits$}") })
        };
        (0..=count).map(tick).collect()
    }
}

/// The power of ten of a positive number.
fn power(value: f64) -> f64 {
    value.log10().floor()
}

/// Draws lines at the ticks, and the names of the axes. The plot ends at x = `right`.
pub(in crate::cli) fn grid(out: &mut String, x: &dyn Axis, y: &dyn Axis, names: [&str; 2], right: f64) {
    for (value, text) in x.ticks() {
        across(out, x.at(value), &text);
    }
    for (value, text) in y.ticks() {
        along(out, y.at(value), &text, right);
    }
    axis_names(out, names, right);
}

/// Draws the numbers and the name of a second axis to the right of the plot, which ends at x = `right`.
pub(in crate::cli) fn right_axis(out: &mut String, y: &EvenAxis, name: &str, right: f64) {
    for (value, text) in y.ticks() {
        let at = y.at(value);
        let _ = write!(
            out,
            r##"<line x1="{right:.1}" y1="{at:.1}" x2="{:.1}" y2="{at:.1}" stroke="#888888"/><text x="{:.1}" y="{:.1}">{text}</text>"##,
            right + 5.0,
            right + 8.0,
            at + 4.5
        );
    }
    let (x, middle) = (right + SECOND_AXIS - 6.0, 0.5 * (TOP + HEIGHT - BOTTOM));
    let _ = write!(
        out,
        r##"<text x="{x:.1}" y="{middle:.1}" text-anchor="middle" transform="rotate(-90 {x:.1} {middle:.1})">{name}</text>"##
    );
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
fn along(out: &mut String, at: f64, text: &str, right: f64) {
    let _ = write!(
        out,
        r##"<line x1="{LEFT}" y1="{at:.1}" x2="{right:.1}" y2="{at:.1}" stroke="#dddddd"/><text x="{:.1}" y="{:.1}" text-anchor="end">{text}</text>"##,
        LEFT - 8.0,
        at + 4.5
    );
}

fn axis_names(out: &mut String, [along, up]: [&str; 2], right: f64) {
    let middle = 0.5 * (TOP + HEIGHT - BOTTOM);
    let _ = write!(
        out,
        r##"<text x="{:.1}" y="{:.1}" text-anchor="middle">{along}</text><text x="20" y="{middle:.1}" text-anchor="middle" transform="rotate(-90 20 {middle:.1})">{up}</text>"##,
        0.5 * (LEFT + right),
        HEIGHT - 14.0
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithmic_axes_just_hold_their_values_and_few_powers_are_divided() {
        let texts = |low: f64, high: f64| -> Vec<String> {
            let axis = LogAxis::over([low, high].into_iter(), 0.0, 1.0);
            assert!(axis.at(low) > 0.0 && axis.at(high) < 1.0);
            axis.ticks().into_iter().map(|tick| tick.1).collect()
        };
        assert_eq!(texts(0.03, 0.4), ["0.02", "0.05", "0.1", "0.2", "0.5"]);
        assert_eq!(texts(2.0, 3.0), ["1", "2", "5"]);
        assert_eq!(texts(3e-3, 15.0), ["0.01", "0.1", "1", "10"]);
        assert_eq!(texts(3e-17, 2e-5).len(), 6);
        assert_eq!(texts(3e-17, 2e-5)[0], "1e-16");
        assert_eq!(LogAxis::over(std::iter::empty(), 0.0, 1.0).ticks().len(), 4);
    }

    #[test]
    fn values_over_powers_of_ten_are_plotted_by_their_logarithms() {
        let middle = |values: &[f64], room: &[f64]| over_figures(values, room, 0.0, 1.0).at(10.0);
        // 1, 10 and 100 are equally far apart on a logarithmic axis alone
        assert!((middle(&[1.0, 10.0, 100.0, f64::NAN], &[]) - 0.5).abs() < 0.05);
        for even in [&[1.0, 10.0, 99.0][..], &[0.0, 10.0, 1000.0], &[-1.0, 10.0, 1000.0]] {
            assert!(middle(even, &[]) < 0.2, "{even:?}");
        }
        // an error as large as its figure is no power of ten, and one below zero has no logarithm
        assert!((over_figures(&[1.0], &[0.01, 1.99], 0.0, 1.0).at(1.0) - 0.5).abs() < 0.05);
        assert!(middle(&[1.0, 10.0, 1000.0], &[-1.0]) < 0.2);

        let param = |values: &[f64]| over_params(values, 0.0, 1.0).at(10.0);
        assert!((param(&[1.0, 10.0, 100.0]) - 0.5).abs() < 0.05);
        let evenly: Vec<f64> = (1..=200).map(f64::from).collect();
        assert!(param(&evenly) < 0.1);
        assert!(over_params(&[], 0.0, 1.0).at(0.5).is_finite());
    }

    #[test]
    fn zeros_of_two_axes_are_at_one_height_where_there_is_room() {
        let axes = |ranges: [[f64; 2]; 2]| {
            let mut axes = ranges.map(|range| EvenAxis::over(range.into_iter(), 100.0, 0.0));
            EvenAxis::with_common_zero(&mut axes);
            for (axis, [low, high]) in axes.iter().zip(ranges) {
                assert!(axis.at(high) >= -1e-9 && axis.at(low) <= 100.0 + 1e-9);
            }
            axes
        };
        for ranges in [[[-0.3, 0.7], [0.0, 10.0]], [[-5.0, 1.0], [-3e-3, 2e-3]], [[0.0, 1.0], [0.0, 7e4]]] {
            let [a, b] = axes(ranges);
            assert!((a.at(0.0) - b.at(0.0)).abs() < 1e-9, "{ranges:?}");
        }
        // one that is far from zero keeps its own range
        let [_, far] = axes([[-1.0, 1.0], [100.0, 101.0]]);
        assert!(far.at(100.0) - far.at(101.0) > 50.0);
    }

    #[test]
    fn ticks_are_round_and_hold_all_values() {
        for (low, high) in [
            (0.0, 1.0),
            (-3.2, 17.0),
            (0.0, 1e-4),
            (1e5, 1e5 + 3.0),
            (1e6, 1e6 + 3.0),
            (-3.0626e-4, -3.0589e-4),
            (9.1878e-8, 9.3381e-8),
            (2.0, 2.0),
            (0.0, 0.0),
        ] {
            let axis = EvenAxis::over([low, high].into_iter(), 0.0, 100.0);
            let count = axis.ticks().len();
            assert!((6..=15).contains(&count), "{low} {high}: {count}");
            assert!(axis.at(low) >= 0.0 && axis.at(high) <= 100.0 + 1e-9, "{low} {high}");
            let texts: std::collections::BTreeSet<String> =
                axis.ticks().into_iter().map(|(_, text)| text).collect();
            assert!(low == high || texts.len() == count, "{texts:?}");
        }
        let empty = EvenAxis::over(std::iter::empty(), 0.0, 1.0);
        assert_eq!((empty.low, empty.high), (0.0, 1.0));
        let texts: Vec<String> =
            EvenAxis::over([0.0, 0.3].into_iter(), 0.0, 1.0).ticks().into_iter().map(|t| t.1).collect();
        assert_eq!(texts, ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25", "0.30"]);
    }
}
