//! Numbers that look random and are the same in every run.

use rfm::geom::Aabb;
use rfm::glam::{DVec2, DVec3};

/// A linear congruential generator (Knuth's), by its state.
pub struct Random(pub u64);

impl Random {
    /// The next state: 64 bits, of which the lower ones are poor.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0
    }

    /// A number from 0 to 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A place in the unit square.
    pub fn in_square(&mut self) -> DVec2 {
        DVec2::new(self.unit(), self.unit())
    }

    /// A place in the unit cube.
    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit())
    }

    /// A place with coordinates from −`reach` to `reach`.
    pub fn around(&mut self, reach: f64) -> DVec3 {
        self.in_cube() * (2.0 * reach) - reach
    }

    pub fn in_box(&mut self, over: &Aabb) -> DVec3 {
        over.min + over.size() * self.in_cube()
    }
}
