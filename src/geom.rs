//! Axis-aligned boxes and rigid motions in the scene's coordinates, in metres.

mod eigen;

use glam::{DMat3, DVec3};

pub(crate) use eigen::eigen;

/// An axis-aligned box, in metres. It has `min ≤ max` in each coordinate unless it is empty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// The corner with the smallest coordinates.
    pub min: DVec3,
    /// The corner with the largest coordinates. It belongs to the box.
    pub max: DVec3,
}

/// A place to print with three digits behind the point: rounded, and no zero in it has a sign.
pub fn to_thousandths(p: DVec3) -> DVec3 {
    DVec3::from_array(p.to_array().map(|x| match x.abs() < LARGEST_WITH_THOUSANDTHS {
        true => (1e3 * x).round() / 1e3 + 0.0,
        false => x,
    }))
}

/// A place to print in or around something of this size: three digits behind the point for a metre and more, and more of
/// them for less.
pub fn place(p: DVec3, size: f64) -> String {
    let digits = (3.0 - size.log10().floor()).clamp(3.0, 12.0) as usize;
    let unit = 10f64.powi(digits as i32);
    let [x, y, z] = p.to_array().map(|x| match x.abs() < LARGEST_WITH_THOUSANDTHS {
        // rounded first, so that zero has no sign
        true => (unit * x).round() / unit + 0.0,
        false => x,
    });
    format!("[{x:.digits$}, {y:.digits$}, {z:.digits$}]")
}

/// A number to print with six digits; a zero without a sign.
pub fn significant(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x) + 0.0
}

/// The direction of a vector; `None` if it is zero, infinite or no number. The length of a vector beyond 1e±154 cannot be
/// computed from squares, so such vectors are scaled by a power of two, which changes no digit.
pub fn direction(v: DVec3) -> Option<DVec3> {
    /// Scales that bring the largest and the smallest numbers to where squares are numbers.
    const DOWN: f64 = f64::from_bits((1023 - 600) << 52);
    const UP: f64 = f64::from_bits((1023 + 600) << 52);
    let largest = v.abs().max_element();
    let scaled = match largest {
        largest if largest > 1e140 => DOWN * v,
        largest if largest < 1e-140 => UP * v,
        _ => v,
    };
    let length = scaled.length();
    (length > 0.0 && length.is_finite()).then(|| scaled / length)
}

/// Larger numbers are printed as they are: there thousandths are near the last digit.
const LARGEST_WITH_THOUSANDTHS: f64 = 1e12;

impl Aabb {
    /// Place number `k` of a sequence that fills the box evenly, along each side too, however flat it is: multiples of the
    /// powers 1 to 3 of the inverse of x⁴ = x + 1 (Roberts 2018).
    pub fn evenly(&self, k: u32) -> DVec3 {
        const STEP: DVec3 =
            DVec3::new(0.819_172_513_396_164_4, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3);
        self.min + self.size() * (f64::from(k) * STEP).fract()
    }

    /// The empty box. Every union with it gives the other box.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The box between two corners. It is empty if `min` exceeds `max` in a coordinate.
    pub const fn new(min: DVec3, max: DVec3) -> Self {
        Self { min, max }
    }

    /// Whether no point is in the box. True also for corners that are NaN, and false for a box without
    /// thickness, which holds its points.
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }

    /// Whether all coordinates of the corners are finite.
    pub fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    /// The lengths of the sides. Some are negative for an empty box.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// The middle of the box.
    pub fn centre(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// The volume in m³. It is 0 for an empty box.
    pub fn volume(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let size = self.size();
        size.x * size.y * size.z
    }

    /// Whether a point is inside the box or on its border.
    pub fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    /// The smallest box that holds both boxes.
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The part that both boxes hold. It is empty if they do not meet.
    pub fn intersection(&self, other: &Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// The smallest box that holds this one and a point.
    pub fn including(&self, p: DVec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// The box grown by `margin` metres on every side.
    pub fn grown(&self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// The eight corners. Bit 0 of the index chooses x, bit 1 y, bit 2 z; a set bit means `max`.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, lo: f64, hi: f64| if i >> bit & 1 == 0 { lo } else { hi };
            DVec3::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        })
    }

    /// The two halves of the box, cut across its longest side; the lower one comes first.
    pub fn halves(&self) -> [Self; 2] {
        let axis = self.size().max_position();
        let middle = self.centre()[axis];
        let (mut low, mut high) = (*self, *self);
        low.max[axis] = middle;
        high.min[axis] = middle;
        [low, high]
    }

    /// The two halves of the box. A huge one is cut by magnitude as seen from a point, so that the scale of what is in it
    /// is found in a few steps.
    pub fn halves_seen_from(&self, from: DVec3) -> [Self; 2] {
        const HUGE: f64 = 1e6;
        if self.size().max_element() < HUGE {
            return self.halves();
        }
        let scale = |x: f64| x.signum() * x.abs().ln_1p();
        let ends = |axis: usize| [self.min[axis], self.max[axis]].map(|x| scale(x - from[axis]));
        let lengths = DVec3::from_array(std::array::from_fn(|axis| ends(axis)[1] - ends(axis)[0]));
        let axis = lengths.max_position();
        let middle = 0.5 * (ends(axis)[0] + ends(axis)[1]);
        let cut = from[axis] + middle.signum() * middle.abs().exp_m1();
        // not `clamp`, which panics where the ends of a side are not in order
        let cut = cut.max(self.min[axis]).min(self.max[axis]);
        let (mut low, mut high) = (*self, *self);
        low.max[axis] = cut;
        high.min[axis] = cut;
        [low, high]
    }
}

/// Where a body is that has been turned about the origin and then moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The rotation, as a matrix.
    pub rotation: DMat3,
    /// The translation, m.
    pub translation: DVec3,
}

impl Placement {
    /// A body that is where it was.
    pub const IDENTITY: Self = Self { rotation: DMat3::IDENTITY, translation: DVec3::ZERO };

    /// The place in the body at the start of a point that is in it now.
    pub fn back(&self, p: DVec3) -> DVec3 {
        self.rotation.transpose() * (p - self.translation)
    }

    /// Where a point of the body at the start is now.
    pub fn apply(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation
    }
}

/// How a body moves at an instant: v(p) = v₀ + ω × p.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// The velocity at the origin, v₀, m/s.
    pub velocity: DVec3,
    /// The angular velocity ω, rad/s.
    pub angular: DVec3,
}

impl Twist {
    /// The velocity of a point that the body carries along, m/s.
    pub fn at(&self, p: DVec3) -> DVec3 {
        self.velocity + self.angular.cross(p)
    }
}

/// Directions that are spread evenly, along a spiral from pole to pole.
pub(crate) fn directions(count: usize) -> impl Iterator<Item = DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sin, cos) = (golden * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_zeros_have_no_sign() {
        let shown = |x, y, z| format!("{:.3}", to_thousandths(DVec3::new(x, y, z)));
        assert_eq!(shown(-0.0, -0.000_4, 0.000_4), "[0.000, 0.000, 0.000]");
        assert_eq!(shown(-0.000_6, 1.234_56, -7.0), "[-0.001, 1.235, -7.000]");
        let large = DVec3::new(1e300, f64::INFINITY, -1e13);
        assert_eq!(to_thousandths(large), large);
    }

    #[test]
    fn directions_of_vectors_of_any_size() {
        let v = DVec3::new(1.0, -2.0, 0.3);
        for scale in [1.0, 1e-200, 1e200, 1e-300, 5e307] {
            let found = direction(scale * v).unwrap();
            assert!((found - v.normalize()).length() < 1e-15, "{scale}: {found}");
        }
        assert_eq!(direction(v), Some(v / v.length()));
        assert_eq!(direction(DVec3::new(0.0, 5e-324, 0.0)), Some(DVec3::Y));
        for none in [DVec3::ZERO, DVec3::NAN, DVec3::new(f64::INFINITY, 1.0, 0.0)] {
            assert_eq!(direction(none), None);
        }
        assert_eq!([1.008_446_477_162_621_8, -0.0, 1e-30].map(significant), [1.008_45, 0.0, 1e-30]);
    }

    #[test]
    fn empty_box_is_the_neutral_element_of_union() {
        let unit = Aabb::new(DVec3::ZERO, DVec3::ONE);
        assert_eq!(Aabb::EMPTY.union(&unit), unit);
        assert!(Aabb::EMPTY.is_empty());
        assert_eq!(Aabb::EMPTY.volume(), 0.0);
    }

    #[test]
    fn halves_share_the_middle_plane_of_the_longest_side() {
        let [low, high] = Aabb::new(DVec3::ZERO, DVec3::new(1.0, 4.0, 2.0)).halves();
        assert_eq!((low.max.y, high.min.y), (2.0, 2.0));
        assert_eq!(low.max.x, 1.0);
    }
}
