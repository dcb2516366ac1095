//! Symmetric tensors: sums of n⊗n over faces.

use std::ops::{Add, Mul, Sub};

use glam::{DMat3, DVec3};

/// A symmetric 3×3 matrix.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::sph) struct Symmetric {
    /// The components xx, yy, zz.
    diagonal: DVec3,
    /// The components yz, zx, xy.
    beside: DVec3,
}

impl Symmetric {
    pub const IDENTITY: Self = Self { diagonal: DVec3::ONE, beside: DVec3::ZERO };

    /// The tensor with the components xx, yy, zz and yz, zx, xy.
    pub fn new(diagonal: DVec3, beside: DVec3) -> Self {
        Self { diagonal, beside }
    }

    /// The tensor n⊗n.
    pub fn square(n: DVec3) -> Self {
        Self { diagonal: n * n, beside: DVec3::new(n.y * n.z, n.z * n.x, n.x * n.y) }
    }

    pub fn trace(&self) -> f64 {
        self.diagonal.element_sum()
    }

    /// R·S·Rᵀ: the tensor of what has been turned.
    pub fn turned(self, rotation: &DMat3) -> Self {
        let turned = *rotation * self.to_matrix() * rotation.transpose();
        Self {
            diagonal: DVec3::new(turned.x_axis.x, turned.y_axis.y, turned.z_axis.z),
            beside: DVec3::new(turned.y_axis.z, turned.z_axis.x, turned.x_axis.y),
        }
    }

    pub fn to_matrix(self) -> DMat3 {
        let (DVec3 { x, y, z }, DVec3 { x: yz, y: zx, z: xy }) = (self.diagonal, self.beside);
        DMat3::from_cols(DVec3::new(x, xy, zx), DVec3::new(xy, y, yz), DVec3::new(zx, yz, z))
    }
}

impl Add for Symmetric {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { diagonal: self.diagonal + other.diagonal, beside: self.beside + other.beside }
    }
}

impl Sub for Symmetric {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { diagonal: self.diagonal - other.diagonal, beside: self.beside - other.beside }
    }
}

impl Mul<Symmetric> for f64 {
    type Output = Symmetric;

    fn mul(self, matrix: Symmetric) -> Symmetric {
        Symmetric { diagonal: self * matrix.diagonal, beside: self * matrix.beside }
    }
}

impl Mul<DVec3> for Symmetric {
    type Output = DVec3;

    fn mul(self, v: DVec3) -> DVec3 {
        let DVec3 { x: yz, y: zx, z: xy } = self.beside;
        self.diagonal * v + DVec3::new(xy * v.y + zx * v.z, xy * v.x + yz * v.z, zx * v.x + yz * v.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_matrix_that_it_stands_for() {
        let (n, m, v) = (DVec3::new(1.0, -2.0, 3.0), DVec3::new(0.5, 4.0, -1.0), DVec3::new(7.0, -3.0, 2.0));
        let outer = |n: DVec3| DMat3::from_cols(n * n.x, n * n.y, n * n.z);
        let tensor = 2.0 * Symmetric::square(n) - Symmetric::square(m) + Symmetric::IDENTITY;
        let matrix = 2.0 * outer(n) - outer(m) + DMat3::IDENTITY;
        assert_eq!(tensor.to_matrix(), matrix);
        assert_eq!(tensor * v, matrix * v);
        assert_eq!(tensor.trace(), matrix.diagonal().element_sum());
        let rotation = DMat3::from_rotation_x(0.3) * DMat3::from_rotation_z(1.1);
        let turned = Symmetric::square(rotation * n).to_matrix();
        assert!(Symmetric::square(n).turned(&rotation).to_matrix().abs_diff_eq(turned, 1e-12));
    }
}
