//! Numbers as few bits: positions on a lattice of a box, the values of arrays on equal levels.

use glam::DVec3;
use serde::Serialize;

use crate::geom::Aabb;

/// The steps of [`Lattice`] along each side. The number above them stands for a coordinate that is not finite.
const STEPS: f64 = 65_534.0;

/// The steps of [`Levels`].
const LEVELS: f64 = 254.0;

/// The level of a value that is not finite.
pub const UNKNOWN_LEVEL: u8 = 255;

/// A box in which positions have 16 bits for each coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    bounds: Aabb,
}

impl Lattice {
    /// The lattice of a box, m. A side without length is given one, so that a plane of particles has a lattice, too.
    pub fn new(bounds: &Aabb) -> Self {
        let longest = bounds.size().max_element();
        let least = if longest > 0.0 { 1e-6 * longest } else { 1.0 };
        let half = 0.5 * bounds.size().max(DVec3::splat(least));
        let centre = bounds.centre();
        Self { bounds: Aabb::new(centre - half, centre + half) }
    }

    /// The box, m.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// The steps for a metre along each axis.
    pub fn steps(&self) -> DVec3 {
        STEPS / self.bounds.size()
    }

    /// The largest distance along each axis between a position in the box and its site, m.
    pub fn rounding(&self) -> DVec3 {
        0.5 * self.bounds.size() / STEPS
    }

    /// The site of a position. Beyond the box it is the nearest one on its surface; a coordinate that is not finite
    /// makes all three 65535.
    pub fn site(&self, at: DVec3) -> [u16; 3] {
        if !at.is_finite() {
            return [u16::MAX; 3];
        }
        let part = (at - self.bounds.min) / self.bounds.size();
        (part.clamp(DVec3::ZERO, DVec3::ONE) * STEPS).round().to_array().map(|x| x as u16)
    }

    /// The position of a site, m.
    pub fn position(&self, site: [u16; 3]) -> DVec3 {
        let part = DVec3::from_array(site.map(f64::from)) / STEPS;
        self.bounds.min + part * self.bounds.size()
    }
}

/// A range of values in 254 equal steps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Levels {
    /// The value of the lowest level. Smaller values have this level, too.
    pub low: f64,
    /// The value of the highest level. Greater values have this level, too.
    pub high: f64,
}

impl Levels {
    /// All finite values. `None` if there are none.
    pub fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let finite = values.filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        (low <= high).then_some(Self { low, high })
    }

    /// The range of both.
    pub fn with(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// The range of the values without a part of them at each end, so that a few stray values do not take the levels of
    /// the others. `None` without finite values.
    pub fn of_most(values: impl Iterator<Item = f64>, part: f64) -> Option<Self> {
        let mut finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        let last = finite.len().checked_sub(1)?;
        let left_out = (part.clamp(0.0, 0.5) * last as f64) as usize;
        let low = *finite.select_nth_unstable_by(left_out, f64::total_cmp).1;
        let high = *finite.select_nth_unstable_by(last - left_out, f64::total_cmp).1;
        Some(Self { low, high })
    }

    /// The level of a value.
    pub fn level(&self, value: f64) -> u8 {
        if !value.is_finite() {
            return UNKNOWN_LEVEL;
        }
        let width = self.high - self.low;
        if width > 0.0 { ((value - self.low) / width * LEVELS).clamp(0.0, LEVELS).round() as u8 } else { 0 }
    }

    /// The level of a value, by operations that are the same in every browser.
    pub(super) fn level_below(&self, value: f64) -> u8 {
        let width = self.high - self.low;
        if width > 0.0 {
            (((value - self.low) / width * LEVELS).clamp(0.0, LEVELS) + 0.5).floor() as u8
        } else {
            0
        }
    }

    /// The value of a level.
    pub fn value(&self, level: u8) -> f64 {
        self.low + f64::from(level) / LEVELS * (self.high - self.low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_come_back_within_half_a_step() {
        let lattice = Lattice::new(&Aabb::new(DVec3::new(-1.0, 0.0, 2.0), DVec3::new(2.0, 0.5, 2.0)));
        for at in [DVec3::new(-1.0, 0.5, 2.0), DVec3::new(0.123_456, 0.2, 2.0), DVec3::new(2.0, 0.0, 2.0)] {
            let off = (lattice.position(lattice.site(at)) - at).abs();
            assert!(off.cmple(lattice.rounding() * (1.0 + 1e-9)).all(), "{at}: {off}");
        }
        assert_eq!(lattice.site(DVec3::new(9.0, -9.0, 2.0))[..2], [65_534, 0]);
        assert_eq!(lattice.site(DVec3::new(f64::NAN, 0.0, 2.0)), [65_535; 3]);
    }

    #[test]
    fn levels_keep_the_bulk_of_values() {
        let values = || (0..1000).map(f64::from).chain([1e9, f64::NAN]);
        assert_eq!(Levels::of(values()), Some(Levels { low: 0.0, high: 1e9 }));
        assert_eq!(Levels::of_most(values(), 0.002), Some(Levels { low: 2.0, high: 998.0 }));
        assert_eq!(Levels::of(std::iter::once(f64::NAN)), None);
        let levels = Levels { low: -1.0, high: 1.0 };
        assert_eq!([-2.0, -1.0, 0.0, 1.0, f64::INFINITY].map(|v| levels.level(v)), [0, 0, 127, 254, 255]);
        assert!((levels.value(levels.level(0.3)) - 0.3).abs() <= 0.5 * 2.0 / 254.0);
        assert_eq!(Levels { low: 3.0, high: 3.0 }.level(3.0), 0);
    }
}
