//! Quadrics: the weighted sum of squared distances of a point from many planes, as ten numbers (M. Garland,
//! P. Heckbert, "Surface Simplification Using Quadric Error Metrics", SIGGRAPH 1997).

use glam::{DMat3, DVec3};

/// The quadric p·Ap + 2b·p + c, and the sum of the weights.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quadric {
    a: DMat3,
    b: DVec3,
    c: f64,
    /// The sum of the weights, in m².
    pub area: f64,
}

impl Quadric {
    pub const ZERO: Self = Self { a: DMat3::ZERO, b: DVec3::ZERO, c: 0.0, area: 0.0 };

    /// The quadric of a triangle's plane, weighted by its area. It is zero for a triangle without area.
    pub fn of_triangle([p, q, r]: [DVec3; 3]) -> Self {
        let twice_area = (q - p).cross(r - p);
        let length = twice_area.length();
        if length == 0.0 || !length.is_finite() {
            return Self::ZERO;
        }
        let normal = twice_area / length;
        let (offset, area) = (-normal.dot(p), 0.5 * length);
        let a = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        Self { a: a * area, b: normal * (offset * area), c: offset * offset * area, area }
    }

    pub fn plus(self, other: Self) -> Self {
        Self { a: self.a + other.a, b: self.b + other.b, c: self.c + other.c, area: self.area + other.area }
    }

    /// The weighted sum of the squared distances from the planes. Rounding does not make it negative.
    pub fn at(&self, p: DVec3) -> f64 {
        (p.dot(self.a * p) + 2.0 * self.b.dot(p) + self.c).max(0.0)
    }

    /// The point with the least sum. On one plane or along a straight crease all points are as good; then it
    /// is the one near `start`.
    pub fn least(&self, start: DVec3) -> DVec3 {
        /// The part of the mean stiffness that pulls to `start`. It moves a well-defined point by a
        /// thousandth of its way.
        const PULL: f64 = 1e-3;
        let stiffness = (self.a.x_axis.x + self.a.y_axis.y + self.a.z_axis.z) / 3.0;
        let pulled = self.a + DMat3::from_diagonal(DVec3::splat(PULL * stiffness));
        let found = start - pulled.inverse() * (self.a * start + self.b);
        if found.is_finite() { found } else { start }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squared_distances_from_the_planes_of_a_corner() {
        // the planes x = 1, y = 2, z = 3, with areas 1/2, 2, 1/2
        let corner = DVec3::new(1.0, 2.0, 3.0);
        let sides = [(DVec3::Y, DVec3::Z, 1.0), (DVec3::Z, DVec3::X, 2.0), (DVec3::X, DVec3::Y, 1.0)];
        let quadric = sides.into_iter().fold(Quadric::ZERO, |sum, (u, v, s)| {
            sum.plus(Quadric::of_triangle([corner, corner + s * u, corner + s * v]))
        });
        assert!((quadric.area - 3.0).abs() < 1e-15);
        let p = corner + DVec3::new(0.1, 0.2, -0.3);
        let expected = 0.5 * 0.01 + 2.0 * 0.04 + 0.5 * 0.09;
        assert!((quadric.at(p) - expected).abs() < 1e-14, "{}", quadric.at(p));
        assert!(quadric.at(corner) < 1e-14);
        assert!(quadric.least(p).distance(corner) < 3e-3 * p.distance(corner));
        // a single plane leaves the place in it free
        let plane = Quadric::of_triangle([DVec3::ZERO, DVec3::X, DVec3::Y]);
        let foot = plane.least(DVec3::new(7.0, 8.0, 0.1));
        assert!(foot.distance(DVec3::new(7.0, 8.0, 0.0)) < 1e-3, "{foot}");
        assert_eq!(Quadric::of_triangle([DVec3::X; 3]).least(DVec3::ONE), DVec3::ONE);
    }
}
