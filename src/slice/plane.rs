//! Where a slice lies: a plane across one axis, and a window in it.
//!
//! Coordinates in the plane are (u, v), u to the right and v upwards: (x, y) for z = c, (x, z) for y = c and
//! (y, z) for x = c. So z points up whenever it is in the picture.

use std::fmt;

use glam::{DVec2, DVec3};

use crate::geom::Aabb;

/// A coordinate axis of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// The first coordinate.
    X,
    /// The second coordinate.
    Y,
    /// The third coordinate.
    Z,
}

impl Axis {
    /// The axis's index in a vector: 0, 1 or 2.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The axis's name: `x`, `y` or `z`.
    pub const fn name(self) -> &'static str {
        ["x", "y", "z"][self as usize]
    }

    /// The axes that are drawn to the right and upwards in a slice across this one.
    pub const fn right_and_up(self) -> (Self, Self) {
        match self {
            Self::X => (Self::Y, Self::Z),
            Self::Y => (Self::X, Self::Z),
            Self::Z => (Self::X, Self::Y),
        }
    }
}

/// The plane `axis = value`, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The axis that the plane lies across.
    pub axis: Axis,
    /// The coordinate of the plane on that axis, in metres.
    pub value: f64,
}

impl Plane {
    /// The plane across an axis at a coordinate, in metres.
    pub const fn new(axis: Axis, value: f64) -> Self {
        Self { axis, value }
    }

    /// The point of space at (u, v) of the plane.
    pub fn point(&self, uv: DVec2) -> DVec3 {
        match self.axis {
            Axis::X => DVec3::new(self.value, uv.x, uv.y),
            Axis::Y => DVec3::new(uv.x, self.value, uv.y),
            Axis::Z => DVec3::new(uv.x, uv.y, self.value),
        }
    }

    /// The rectangle that a box projects to along the plane's axis, whether or not the plane cuts the box.
    pub fn window(&self, over: &Aabb) -> Window {
        let (right, up) = self.axis.right_and_up();
        let pick = |p: DVec3| DVec2::new(p[right.index()], p[up.index()]);
        Window { min: pick(over.min), max: pick(over.max) }
    }
}

impl fmt::Display for Plane {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // a length in millimetres has digits that only its conversion to metres has made
        let shown: f64 = format!("{:.12e}", self.value).parse().unwrap_or(self.value);
        write!(f, "{} = {}", self.axis.name(), shown)
    }
}

/// The rectangle of the plane that is drawn, in (u, v) and metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// The lower left corner.
    pub min: DVec2,
    /// The upper right corner.
    pub max: DVec2,
}

impl Window {
    /// The rectangle between two corners. One without area is refused when it is sampled.
    pub const fn new(min: DVec2, max: DVec2) -> Self {
        Self { min, max }
    }

    /// The lengths of the sides in metres.
    pub fn size(&self) -> DVec2 {
        self.max - self.min
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_shown_without_digits_of_a_conversion() {
        assert_eq!(Plane::new(Axis::Z, 99.123_456 * 1e-3).to_string(), "z = 0.099123456");
    }

    #[test]
    fn each_plane_puts_its_own_axis_at_the_value() {
        for (axis, point) in
            [(Axis::X, [9.0, 1.0, 2.0]), (Axis::Y, [1.0, 9.0, 2.0]), (Axis::Z, [1.0, 2.0, 9.0])]
        {
            let plane = Plane::new(axis, 9.0);
            assert_eq!(plane.point(DVec2::new(1.0, 2.0)).to_array(), point);
            let window = plane.window(&Aabb::new(DVec3::ZERO, DVec3::from_array(point)));
            assert_eq!(window.max, DVec2::new(1.0, 2.0));
        }
        assert_eq!(Plane::new(Axis::Z, 0.5).to_string(), "z = 0.5");
    }
}
