//! How wide the cells of a lattice are along each axis so that whole layers of them fill a shape.
//!
//! The surface of a fluid often lies at several levels: that of two pools, or of a lake and a wet bed behind
//! a gate. A lattice of cubes ends above or below each of them by up to half a layer. The whole weighs what
//! it should, because the mass of a particle is fitted, but one pool is too full and the other too empty:
//! with a spacing of 3 cm, 17 cm beside 50 cm would be off by +7.5 and −2.5 %. Cells that are a few per cent
//! higher or lower than wide fit both. Obstacles are left out: what they take of a lattice is carved from it
//! by its volume.
//!
//! Levels are found by chords: the parts of parallel lines that lie in the shape. Where neighbouring lines
//! have the same chord, it lies between flat faces. The chords of a ball or of a slope are all different:
//! what a lattice lacks on one line it has too much of on another, so no width of cells fits them better than
//! others.

use crate::field::{Field, Points, is_inside};
use crate::geom::Aabb;

/// Number of lines along each side of the box that is searched.
const LINES: usize = 16;

/// Samples for each spacing along a line, and halvings of the interval in which one end of a chord lies.
const SAMPLES: f64 = 8.0;
const HALVINGS: usize = 12;

/// Fewest and most samples along a line.
const SAMPLE_LIMITS: [f64; 2] = [16.0, 4096.0];

/// Change of a cell's width that is tried, as a part of the spacing, and the number of widths that are. That
/// of the spacing itself, which is a mean over the axes, is no greater.
const MOST_STRETCHED: f64 = 0.1;
const WIDTHS: usize = 81;

/// Difference between the ends of chords that counts as none, as a part of the spacing.
const SAME: f64 = 0.01;

/// Neighbouring lines whose chords must be the same for these to lie between flat faces.
const FLAT: usize = 3;

/// Penalty for stretched cells: the part of the fluid at a wrong place that counts as much as cells which are
/// longer than wide by one part in their length.
const UNEVEN: f64 = 0.05;

/// The layers of a lattice along an axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layers {
    /// Where the first begins, m.
    pub start: f64,
    /// Their number.
    pub number: f64,
    /// How high each is, m.
    pub width: f64,
}

/// The parts of a line that lie in a shape: where each begins and ends, m.
type Line = Vec<[f64; 2]>;

/// The parts of lines along each axis that lie in a shape.
pub(super) struct Chords([Along; 3]);

/// The chords of the lines along one axis.
struct Along {
    /// Where those between flat faces begin and end, m.
    flat: Line,
    /// The length of all together, m.
    whole: f64,
}

impl Chords {
    /// The chords of a shape in a box.
    pub fn of(shape: &dyn Field, within: Aabb, spacing: f64) -> Self {
        Self(std::array::from_fn(|axis| {
            let lines = along(shape, within, axis, spacing);
            let whole = lines.iter().flatten().map(|[start, end]| end - start).sum();
            Along { flat: flat(&lines, SAME * spacing), whole }
        }))
    }

    /// How much of the shape such layers lack, and have too much, between flat faces across an axis, as a part of it.
    pub fn mismatch(&self, axis: usize, layers: Layers) -> f64 {
        // the number of sites below a place
        let below = |at: f64| ((at - layers.start) / layers.width + 0.5).floor().clamp(0.0, layers.number);
        let Along { flat, whole } = &self.0[axis];
        let off = |[start, end]: &[f64; 2]| {
            let filled = (below(*end) - below(*start)) * layers.width;
            (filled - (end - start)).abs()
        };
        if *whole > 0.0 { flat.iter().map(off).sum::<f64>() / whole } else { 0.0 }
    }

    /// The width of cells, m, about as large as the spacing, of which layers fit the chords along an axis
    /// best. `layers` says where the layers of a width begin.
    pub fn fitted(&self, axis: usize, spacing: f64, layers: impl Fn(f64) -> Layers) -> f64 {
        let mut best = (f64::INFINITY, spacing);
        for k in 0..WIDTHS {
            let width = spacing * (1.0 + MOST_STRETCHED * (2.0 * k as f64 / (WIDTHS - 1) as f64 - 1.0));
            let badness = self.mismatch(axis, layers(width)) + UNEVEN * (width / spacing).ln().abs();
            if badness < best.0 {
                best = (badness, width);
            }
        }
        best.1
    }
}

/// The chords that neighbouring lines have as well, in both directions across them.
fn flat(lines: &[Line], same: f64) -> Line {
    let has = |line: usize, chord: [f64; 2]| {
        let is_same = |other: &[f64; 2]| chord.iter().zip(other).all(|(a, b)| (a - b).abs() <= same);
        lines[line].iter().any(is_same)
    };
    let mut found = Vec::new();
    for (line, chords) in lines.iter().enumerate() {
        for &chord in chords {
            let repeats = |step: usize, place: usize| {
                (place.saturating_sub(FLAT - 1)..=place).any(|first| {
                    let neighbour = |k: usize| line + step * (first + k) - step * place;
                    first + FLAT <= LINES && (0..FLAT).all(|k| has(neighbour(k), chord))
                })
            };
            if repeats(1, line % LINES) && repeats(LINES, line / LINES) {
                found.push(chord);
            }
        }
    }
    found
}

/// The chords of all lines along one axis.
fn along(shape: &dyn Field, within: Aabb, axis: usize, spacing: f64) -> Vec<Line> {
    let size = within.size();
    let [fewest, most] = SAMPLE_LIMITS;
    let samples = (SAMPLES * size[axis] / spacing).ceil().clamp(fewest, most) as usize;
    let step = size[axis] / samples as f64;
    let heights: Vec<f64> = (0..samples).map(|i| within.min[axis] + (i as f64 + 0.5) * step).collect();
    let mut omega = vec![0.0; samples];
    let mut lines = Vec::new();
    for line in 0..LINES * LINES {
        let place = |k: usize| (k as f64 + 0.5) / LINES as f64;
        let mut at = within.min;
        at[(axis + 1) % 3] += size[(axis + 1) % 3] * place(line % LINES);
        at[(axis + 2) % 3] += size[(axis + 2) % 3] * place(line / LINES);
        let constant = [0, 1, 2].map(|k| vec![at[k]; samples]);
        let column = |k: usize| if k == axis { &heights[..] } else { &constant[k] };
        shape.omega_many(Points::new(column(0), column(1), column(2)), &mut omega);
        let is_inside_at = |height: f64| {
            let mut there = at;
            there[axis] = height;
            is_inside(shape.omega(there))
        };
        let mut found = Vec::new();
        let mut start = is_inside(omega[0]).then_some(within.min[axis]);
        for i in 1..samples {
            let [before, after] = [i - 1, i].map(|i| is_inside(omega[i]));
            match (before, after) {
                (false, true) => start = Some(end_of([heights[i], heights[i - 1]], is_inside_at)),
                (true, false) => {
                    let end = end_of([heights[i - 1], heights[i]], is_inside_at);
                    found.extend(start.take().map(|start| [start, end]));
                }
                (true, true) | (false, false) => {}
            }
        }
        found.extend(start.map(|start| [start, within.max[axis]]));
        lines.push(found);
    }
    lines
}

/// Where a line leaves the shape between a place inside of it and one outside.
fn end_of([mut inside, mut outside]: [f64; 2], is_inside: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        *(if is_inside(middle) { &mut inside } else { &mut outside }) = middle;
    }
    0.5 * (inside + outside)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::field::Closures;

    fn of(omega: impl Fn(DVec3) -> f64 + Send + Sync, size: DVec3) -> Chords {
        let shape = Closures { omega, gradient: |_: DVec3| DVec3::ZERO };
        Chords::of(&shape, Aabb::new(DVec3::ZERO, size), 0.03)
    }

    fn from_zero(length: f64) -> impl Fn(f64) -> Layers {
        move |width| Layers { start: 0.0, number: (length / width + 1e-9).floor(), width }
    }

    /// A lake half a metre deep, and a bed of 17 cm behind it.
    #[test]
    fn cells_fit_two_levels() {
        let size = DVec3::new(2.0, 0.5, 0.5);
        let chords = of(|p: DVec3| if p.x < 1.0 { 1.0 } else { 0.17 - p.z }, size);
        let layers = from_zero(0.5);
        let cubes = chords.mismatch(2, layers(0.03));
        let width = chords.fitted(2, 0.03, &layers);
        let fitted = chords.mismatch(2, layers(width));
        assert!(cubes > 0.03 && fitted < 0.007, "{cubes} {fitted}");
        for depth in [0.5, 0.17] {
            // an eighth of a layer
            assert!(((depth / width).round() * width - depth).abs() < 0.13 * width, "{width}");
        }
    }

    /// The chords of a ball differ from line to line, and so do those of a cylinder but for its ends.
    #[test]
    fn cells_of_what_is_round_stay_cubes() {
        let ball = of(|p: DVec3| 0.25 * 0.25 - p.distance_squared(DVec3::splat(0.25)), DVec3::splat(0.5));
        let across = |p: DVec3| 0.25 * 0.25 - (p - DVec3::splat(0.25)).truncate().length_squared();
        let cylinder = of(across, DVec3::new(0.5, 0.5, 0.3));
        for axis in 0..3 {
            let expected = std::f64::consts::PI / 6.0 * 0.5 * (LINES * LINES) as f64;
            let whole = ball.0[axis].whole;
            assert!((whole / expected - 1.0).abs() < 0.01, "{whole} {expected}");
            assert_eq!(ball.fitted(axis, 0.03, from_zero(0.5)), 0.03);
        }
        for axis in 0..2 {
            assert_eq!(cylinder.fitted(axis, 0.03, from_zero(0.5)), 0.03);
        }
        assert!(!cylinder.0[2].flat.is_empty());
    }
}
