//! Straight paths, and the places where they enter an obstacle.

use glam::DVec3;

use crate::geom::Aabb;

/// A straight path from t = 0 to t = 1, and how closely it is to be sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Path {
    /// The place at t = 0.
    pub from: DVec3,
    /// The place at t = 1.
    pub to: DVec3,
    /// Part of the path, 0 to 1, where the search begins. What lies before is not searched.
    pub start: f64,
    /// Distance between samples, in the scene's unit of length, for fields that do not know their range;
    /// other fields ignore it. Sampling surely finds parts of the obstacle that are at least this thick.
    pub resolution: f64,
}

/// Where a path first meets an obstacle; ω = 0 counts as met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// Part of the path that lies before the entry, 0 to 1.
    pub t: f64,
    /// The path may be in the obstacle between `t` and this part of it. After it comes a part that is not.
    pub until: f64,
    /// Whether some point between `t` and `until` is surely not in the fluid. If not, the path grazes the
    /// surface within the rounding errors of the formula, or the search has spent its budget.
    pub certain: bool,
    /// The place at `t`.
    pub point: DVec3,
    /// Outward unit normals of the surfaces that meet at `point`.
    pub normals: Normals,
}

/// Up to four different unit normals: one on a face, several at edges and corners, none where the gradient
/// vanishes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Normals {
    count: usize,
    list: [DVec3; 4],
}

/// Most samples that are taken of one path. Only a runaway particle would need more.
const MOST_SAMPLES: f64 = 4096.0;

/// A bracket shorter than this part of the coordinates' size counts as a point.
const POINT: f64 = 4.0 * f64::EPSILON;

impl Path {
    /// A path that is searched from its beginning; see [`Path::resolution`] for `resolution`.
    pub fn new(from: DVec3, to: DVec3, resolution: f64) -> Self {
        Self { from, to, start: 0.0, resolution }
    }

    /// The place at a part `t` of the path, 0 to 1.
    pub fn at(&self, t: f64) -> DVec3 {
        self.from.lerp(self.to, t)
    }

    /// The box around the part of the path between `t0` and `t1`.
    pub fn hull(&self, t0: f64, t1: f64) -> Aabb {
        let (a, b) = (self.at(t0), self.at(t1));
        let whole = Aabb::new(a.min(b), a.max(b));
        if t0 == 0.0 && t1 == 1.0 {
            return whole;
        }
        // the ends are rounded
        whole.grown(POINT * a.abs().max(b.abs()).max_element())
    }

    /// The parts of the path, after t0 and up to t1, at which a field without ranges is sampled.
    pub(super) fn samples(&self, t0: f64, t1: f64) -> impl Iterator<Item = f64> + use<> {
        let parts = (self.from.distance(self.to) * (t1 - t0) / self.resolution).ceil();
        // NaN becomes 0, and then 1
        let count = (parts.clamp(1.0, MOST_SAMPLES) as usize).max(1);
        (1..=count).map(move |k| if k == count { t1 } else { t0 + (t1 - t0) * (k as f64 / count as f64) })
    }
}

impl Entry {
    /// An entry between `t` and `until`, with the normals at `t`.
    pub fn new(path: &Path, (t, until): (f64, f64), certain: bool, normals: Normals) -> Self {
        Self { t, until, certain, point: path.at(t), normals }
    }

    /// Searches an uncertain entry by samples of ω. Returns the first sample (t, ω) between `t` and `until`
    /// that is not in the fluid, NaN included, or `None` if there is none. `omega` gives ω at a part t of the
    /// path, see [`Walls::on_path`](super::Walls::on_path).
    pub fn first_sample_met(&self, path: &Path, omega: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
        let middle = 0.5 * (self.t + self.until);
        let look = |t: f64| {
            let w = omega(t);
            (w >= 0.0 || w.is_nan()).then_some((t, w))
        };
        look(self.t)
            .or_else(|| path.samples(self.t, middle).chain(path.samples(middle, self.until)).find_map(look))
    }
}

impl Normals {
    /// Adds the unit vector along a direction, unless it is known already, the direction has no length, or
    /// there are four.
    pub fn add(&mut self, direction: DVec3) {
        // scaled first, so that neither a tiny nor a huge gradient is lost in its square
        let scaled = direction / direction.abs().max_element();
        if let Some(normal) = scaled.try_normalize()
            && self.count < self.list.len()
            && !self.iter().any(|known| known.dot(normal) > 1.0 - 1e-12)
        {
            self.list[self.count] = normal;
            self.count += 1;
        }
    }

    /// The normals, in the order in which they were found.
    pub fn iter(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.list[..self.count].iter().copied()
    }

    /// The number of normals.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is no normal.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The normalised sum of the normals; `None` if there is no normal, or if they cancel.
    pub fn mean(&self) -> Option<DVec3> {
        let sum: DVec3 = self.iter().sum();
        // opposite normals leave rounding errors, which have no direction
        if sum.length() > 1e-9 { sum.try_normalize() } else { None }
    }
}

/// The last place of a path that is known to be in the fluid: the largest t found with `omega`(t) < 0,
/// between a (t, ω) in the fluid and a later one that is not. The search takes secant steps and a bisection
/// at every third. `omega` decides at which time a moving field is evaluated.
pub fn last_outside(
    omega: impl Fn(f64) -> f64,
    path: &Path,
    (mut low, mut w_low): (f64, f64),
    (mut high, mut w_high): (f64, f64),
) -> f64 {
    let size = path.from.abs().max(path.to.abs()).max_element();
    let tolerance = POINT * (size / path.from.distance(path.to)).max(1.0);
    for k in 0..120 {
        let width = high - low;
        if width <= tolerance {
            break;
        }
        // points nearer to either end than half the tolerance add no knowledge
        let margin = (0.5 * tolerance / width).min(0.5);
        let secant = w_low / (w_low - w_high);
        let part = if k % 3 == 2 || !secant.is_finite() { 0.5 } else { secant.clamp(margin, 1.0 - margin) };
        let t = low + part * width;
        let w = omega(t);
        if w < 0.0 {
            (low, w_low) = (t, w);
        } else {
            (high, w_high) = (t, w); // NaN is not in the fluid
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_are_different_and_few() {
        let mut normals = Normals::default();
        for direction in [DVec3::X, 1e-200 * DVec3::X, DVec3::ZERO, DVec3::NAN, 1e200 * DVec3::Y] {
            normals.add(direction);
        }
        assert_eq!(normals.iter().collect::<Vec<_>>(), [DVec3::X, DVec3::Y]);
        normals.add(-DVec3::X);
        normals.add(-DVec3::Y);
        assert!(normals.mean().is_none() && normals.len() == 4);
    }
}
