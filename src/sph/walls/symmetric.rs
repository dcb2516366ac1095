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

    /// The tensor n⊗n.
    pub fn square(n: DVec3) -> Self {
        Self { diagonal: n * n, beside: DVec3::new(n.y * n.z, n.z * n.x, n.x * n.y) }
    }

    pub fn trace(&self) -> f64 {
        self.diagonal.element_sum()
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
    }
}
