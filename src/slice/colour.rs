//! The colours of ω: bands between round levels, orange inside and blue outside.
//!
//! Levels that shrink by decades keep detail near the surface. Values far from it, often a hundred times
//! larger, share the outermost bands and do not wash the picture out. Where that would leave most of a side
//! in one band, as in a solid that is thick everywhere, the levels are evenly spaced instead. Each side has
//! its own largest level because ω is not a distance: an obstacle may reach +0.2 where its surroundings reach
//! −20. Both ramps darken away from the surface and differ only in hue, so colour-blind people can read the
//! plot too. The pale ends stay apart on paper because the line ω = 0 lies between them.

use super::{Samples, numbers::Decimal};

/// An sRGB colour with 8 bits per channel: red, green, blue.
pub type Rgb = [u8; 3];

/// The colour of places where ω is NaN.
pub const UNDEFINED: Rgb = [214, 214, 214];

/// Levels other than zero on each side. Five span a factor of 20 to 25.
const LEVELS_PER_SIDE: usize = 5;
/// The ramps from the surface outwards. They are spread evenly over the bands of a side.
const INSIDE: [Rgb; 3] = [[255, 237, 211], [247, 176, 102], [208, 103, 30]];
const OUTSIDE: [Rgb; 3] = [[232, 241, 249], [155, 197, 226], [77, 134, 188]];

/// The colours of values of ω. Bands are numbered from the lowest ω to the highest, and band k lies below
/// level k.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// The levels, ascending, with zero among them.
    levels: Vec<Decimal>,
    values: Vec<f64>,
    /// The index of the level zero. Bands 0..=zero are outside, the others inside.
    zero: usize,
}

impl Scale {
    /// The levels that suit a slice. On each side they are a series 1, 2, 5 · 10ⁿ or evenly spaced, whichever
    /// divides the samples better, and reach up to the 98th percentile of |ω| there.
    pub fn for_samples(samples: &Samples) -> Self {
        Self::for_all(&[samples])
    }

    /// The levels that suit several slices together, as [`Scale::for_samples`].
    pub fn for_all(slices: &[&Samples]) -> Self {
        let side = |sign: f64| {
            let values = slices.iter().flat_map(|samples| &samples.omega);
            let magnitudes = values.map(|w| w * sign).filter(|w| *w > 0.0 && w.is_finite());
            let mut magnitudes: Vec<f64> = magnitudes.collect();
            magnitudes.sort_unstable_by(f64::total_cmp);
            let Some(top) = Decimal::below(percentile_98(&magnitudes)) else { return Vec::new() };
            let series: Vec<Decimal> = std::iter::successors(Some(top), |level| Some(level.smaller()))
                .take(LEVELS_PER_SIDE)
                .collect();
            let even = evenly(percentile_98(&magnitudes));
            let share = |levels: &[Decimal]| largest_band(levels, &magnitudes);
            if share(&even) < share(&series) { even } else { series }
        };
        let (outside, inside) = (side(-1.0), side(1.0));
        let zero = outside.len();
        let mut levels: Vec<_> = outside.iter().map(|level| level.negated()).collect();
        levels.push(Decimal::ZERO);
        levels.extend(inside.iter().rev());
        let values = levels.iter().map(|level| level.value()).collect();
        Self { levels, values, zero }
    }

    /// The levels in ascending order. Zero is one of them.
    pub fn levels(&self) -> &[f64] {
        &self.values
    }

    pub(super) fn decimals(&self) -> &[Decimal] {
        &self.levels
    }

    /// The number of bands: one more than there are levels.
    pub fn bands(&self) -> usize {
        self.levels.len() + 1
    }

    /// The band that holds a value. `None` for NaN.
    pub fn band(&self, omega: f64) -> Option<usize> {
        (!omega.is_nan()).then(|| self.values.partition_point(|level| *level <= omega))
    }

    /// Whether a band is inside, and how far it is from the surface: 0 for the nearest band of its side, 1
    /// for the farthest.
    pub fn depth(&self, band: usize) -> (bool, f64) {
        let part = |k: usize, last: usize| if last == 0 { 0.5 } else { k.min(last) as f64 / last as f64 };
        match band.checked_sub(self.zero + 1) {
            Some(k) => (true, part(k, self.levels.len() - self.zero - 1)),
            None => (false, part(self.zero - band, self.zero)),
        }
    }

    /// The colour of a band.
    pub fn band_colour(&self, band: usize) -> Rgb {
        let (inside, depth) = self.depth(band);
        ramp(if inside { &INSIDE } else { &OUTSIDE }, depth)
    }

    /// The colour of a value. [`UNDEFINED`] for NaN.
    pub fn colour(&self, omega: f64) -> Rgb {
        self.band(omega).map_or(UNDEFINED, |band| self.band_colour(band))
    }
}

/// The 98th percentile of sorted numbers; 0 without any.
fn percentile_98(sorted: &[f64]) -> f64 {
    sorted.get(sorted.len().saturating_sub(1) * 98 / 100).copied().unwrap_or_default()
}

/// The multiples of a round number up to `top`, the largest first.
fn evenly(top: f64) -> Vec<Decimal> {
    let Some(mut step) = Decimal::below(top / LEVELS_PER_SIDE as f64) else { return Vec::new() };
    while top / step.value() >= (LEVELS_PER_SIDE + 1) as f64 {
        step = step.larger();
    }
    let multiple = |k: i64| Decimal { mantissa: k * step.mantissa, ..step };
    let mut levels: Vec<Decimal> =
        (1..=LEVELS_PER_SIDE as i64).map(multiple).take_while(|level| level.value() <= top).collect();
    levels.reverse();
    levels
}

/// The part of sorted numbers in the band that holds most of them. The levels descend.
fn largest_band(levels: &[Decimal], sorted: &[f64]) -> usize {
    let mut end = sorted.len();
    let mut largest = 0;
    for level in levels {
        let start = sorted.partition_point(|w| *w < level.value());
        largest = largest.max(end - start);
        end = start;
    }
    largest.max(end)
}

/// A piecewise linear ramp at t in [0, 1].
fn ramp(anchors: &[Rgb; 3], t: f64) -> Rgb {
    let (from, to, t) =
        if t < 0.5 { (anchors[0], anchors[1], 2.0 * t) } else { (anchors[1], anchors[2], 2.0 * t - 1.0) };
    std::array::from_fn(|i| (f64::from(from[i]) * (1.0 - t) + f64::from(to[i]) * t).round() as u8)
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::slice::{Axis, Plane, Window};

    fn scale(omega: &[f64]) -> Scale {
        Scale::for_samples(&Samples {
            plane: Plane::new(Axis::Z, 0.0),
            window: Window::new(DVec2::ZERO, DVec2::ONE),
            columns: omega.len(),
            rows: 1,
            omega: omega.to_vec(),
        })
    }

    #[test]
    fn each_side_has_its_own_round_levels() {
        let scale = scale(&[-7.0, 0.16]);
        assert_eq!(scale.levels(), [-5.0, -2.0, -1.0, -0.5, -0.2, 0.0, 0.005, 0.01, 0.02, 0.05, 0.1]);
    }

    #[test]
    fn a_thick_inside_has_evenly_spaced_levels() {
        let thick: Vec<f64> = (0..100).map(|k| 0.4 + 0.006 * f64::from(k)).collect();
        assert_eq!(scale(&thick).levels(), [0.0, 0.2, 0.4, 0.6, 0.8]);
        // values over decades keep the series
        let wide: Vec<f64> = (0..100).map(|k| 10f64.powf(-0.05 * f64::from(k))).collect();
        assert_eq!(scale(&wide).levels(), [0.0, 0.02, 0.05, 0.1, 0.2, 0.5]);
    }

    #[test]
    fn ends_of_the_scale_have_the_ends_of_the_ramps() {
        let scale = scale(&[-7.0, 0.16]);
        assert_eq!(scale.colour(-1e9), OUTSIDE[2]);
        assert_eq!(scale.colour(-1e-9), OUTSIDE[0]);
        assert_eq!(scale.colour(0.0), INSIDE[0], "the surface belongs to the inside");
        assert_eq!(scale.colour(f64::INFINITY), INSIDE[2]);
        assert_eq!(scale.colour(f64::NAN), UNDEFINED);
    }

    #[test]
    fn slices_of_one_side_or_of_nothing_have_a_scale() {
        assert_eq!(scale(&[-1.0, -3.0]).levels().last(), Some(&0.0));
        assert_eq!(scale(&[3.0]).levels()[0], 0.0);
        for odd in [&[f64::NAN, f64::INFINITY][..], &[0.0], &[]] {
            let scale = scale(odd);
            assert_eq!((scale.levels(), scale.bands()), (&[0.0][..], 2));
            assert_ne!(scale.colour(1.0), scale.colour(-1.0));
        }
    }
}
