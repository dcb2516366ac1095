//! Four boxes in single precision, each turned as the triangles in it lie.
//!
//! A patch of a surface is nearly flat. A box whose axes are along and across it is as thin as the patch is
//! bent, so that few boxes come nearer to a point than the surface does; boxes along x, y and z are as thick
//! as the patch is wide.
//!
//! Bounds are rounded outwards, and [`View::limit`] makes up for what single precision loses at a point.

use glam::DVec3;

use crate::geom::Aabb;

/// The boxes of a branch.
pub const WIDTH: usize = 4;

/// The most that rounding changes coordinates along the axes of a box, relative to the coordinates of the
/// point, and to squares of distances: some units in the last place of single precision.
const ROUNDING: f64 = 1e-6;

/// How much boxes grow before a ray meets them, relative to the size of the solid and the way to it, and what is the
/// least slope of a ray.
const RAY_SLACK: f32 = 1e-5;

/// Normals of a group point one way if their sum is at least this part of what it may be.
const ONE_WAY: f64 = 0.3;

/// The space of the tree: its origin is the middle of the solid, and its unit is the size of the solid.
#[derive(Debug, Clone, Copy)]
pub struct Space {
    centre: DVec3,
    /// Per metre.
    scale: f64,
}

impl Space {
    pub fn around(bounds: &Aabb) -> Self {
        let size = bounds.size().max_element();
        Self { centre: bounds.centre(), scale: if size > 0.0 { size.recip() } else { 1.0 } }
    }

    pub fn local(&self, p: DVec3) -> DVec3 {
        (p - self.centre) * self.scale
    }
}

/// A point as boxes see it.
pub struct View {
    point: [f32; 3],
    slack: f64,
    scale: f64,
}

impl View {
    pub fn new(p: DVec3, space: &Space) -> Self {
        let local = space.local(p);
        let lost = p.abs().max_element().max(space.centre.abs().max_element()) * space.scale;
        // the origin may be so far away that double precision, too, loses digits
        let slack = ROUNDING * (1.0 + local.abs().element_sum()) + 8.0 * f64::EPSILON * lost;
        Self { point: local.as_vec3().to_array(), slack, scale: space.scale }
    }

    /// What [`Boxes::squares`] is at most for boxes that have points within a distance whose square this is.
    #[inline]
    pub fn limit(&self, square: f64) -> f32 {
        let distance = square.sqrt() * self.scale + self.slack;
        // the cast rounds to nearest, by less than the factor
        (distance * distance * (1.0 + 4.0 * ROUNDING)) as f32
    }
}

type Lanes = [f32; WIDTH];

/// Lanes of boxes: the axes of each, and the least and the greatest coordinates along them.
pub struct Boxes {
    axes: [[Lanes; 3]; 3],
    low: [Lanes; 3],
    high: [Lanes; 3],
}

impl Boxes {
    /// Boxes that nothing is near.
    pub const EMPTY: Self = Self {
        axes: [[[0.0; WIDTH]; 3]; 3],
        low: [[f32::INFINITY; WIDTH]; 3],
        high: [[f32::NEG_INFINITY; WIDTH]; 3],
    };

    /// Puts a box around triangles.
    pub fn set(&mut self, lane: usize, triangles: &[[DVec3; 3]], space: &Space) {
        let local = || triangles.iter().map(|corners| corners.map(|corner| space.local(corner)));
        // bounds are taken along the axes as they are kept
        let axes = axes_of(local).map(|axis| axis.as_vec3().as_dvec3());
        for (k, axis) in axes.into_iter().enumerate() {
            let ends = |(low, high): (f64, f64), c: DVec3| (low.min(axis.dot(c)), high.max(axis.dot(c)));
            let (low, high) = local().flatten().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
            self.low[k][lane] = (low as f32).next_down();
            self.high[k][lane] = (high as f32).next_up();
            for (i, component) in axis.as_vec3().to_array().into_iter().enumerate() {
                self.axes[k][i][lane] = component;
            }
        }
    }

    /// The components of a vector along one axis of each box.
    #[inline]
    fn along(&self, axis: usize, [x, y, z]: [f32; 3]) -> Lanes {
        let [ax, ay, az] = &self.axes[axis];
        let mut along = [0.0; WIDTH];
        for lane in 0..WIDTH {
            along[lane] = ax[lane] * x + ay[lane] * y + az[lane] * z;
        }
        along
    }

    /// For each box, the square of its distance from a point in the tree's space, but for rounding.
    #[inline]
    pub fn squares(&self, view: &View) -> Lanes {
        let mut squares = [0.0; WIDTH];
        for k in 0..3 {
            let along = self.along(k, view.point);
            for lane in 0..WIDTH {
                let (below, above) = (self.low[k][lane] - along[lane], along[lane] - self.high[k][lane]);
                // written so that NaN, from points too far away for single precision, counts as near
                let outside = if below > above { below } else { above };
                let outside = if outside > 0.0 { outside } else { 0.0 };
                squares[lane] += outside * outside;
            }
        }
        squares
    }

    /// Whether a ray of the tree's space may pass each box.
    #[inline]
    pub fn are_met(&self, (from, direction): ([f32; 3], [f32; 3])) -> [bool; WIDTH] {
        let slack = RAY_SLACK * (1.0 + from.iter().map(|c| c.abs()).sum::<f32>());
        let (mut enter, mut leave) = ([-slack; WIDTH], [f32::INFINITY; WIDTH]);
        for k in 0..3 {
            let (at, slopes) = (self.along(k, from), self.along(k, direction));
            for lane in 0..WIDTH {
                // a ray along a side is one that hardly leaves it
                let slope = slopes[lane];
                let slope = if slope.abs() > RAY_SLACK { slope } else { RAY_SLACK };
                let a = (self.low[k][lane] - slack - at[lane]) / slope;
                let b = (self.high[k][lane] + slack - at[lane]) / slope;
                let (near, far) = if a < b { (a, b) } else { (b, a) };
                enter[lane] = if near > enter[lane] { near } else { enter[lane] };
                leave[lane] = if far < leave[lane] { far } else { leave[lane] };
            }
        }
        [0, 1, 2, 3].map(|lane| enter[lane] <= leave[lane] + slack)
    }
}

/// Axes of length 1 at right angles: across the triangles and along them, the longer way first. Those of the
/// space if the normals point all ways.
fn axes_of<I: Iterator<Item = [DVec3; 3]>>(triangles: impl Fn() -> I) -> [DVec3; 3] {
    let areas = || triangles().map(|[a, b, c]| (b - a).cross(c - a));
    let (sum, all) = areas().fold((DVec3::ZERO, 0.0), |(sum, all), area| (sum + area, all + area.length()));
    if all.is_nan() || all <= 0.0 || sum.length() < ONE_WAY * all {
        return DVec3::AXES;
    }
    let across = sum.normalize();
    let (u, v) = across.any_orthonormal_pair();
    let count = 3.0 * triangles().count() as f64;
    let middle = triangles().flatten().sum::<DVec3>() / count;
    let [uu, uv, vv] = triangles().flatten().fold([0.0; 3], |[uu, uv, vv], corner| {
        let (a, b) = (u.dot(corner - middle), v.dot(corner - middle));
        [uu + a * a, uv + a * b, vv + b * b]
    });
    let (sin, cos) = (0.5 * (2.0 * uv).atan2(uu - vv)).sin_cos();
    let along = cos * u + sin * v;
    [across, along, across.cross(along)]
}
