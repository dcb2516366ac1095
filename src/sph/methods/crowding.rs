//! The sum Σ V ∇W over the neighbours of a particle, which points to where they crowd.

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;

use crate::sph::kernel::Wendland;
use crate::sph::pairs::Real;
use crate::sph::params::Parameters;

/// Sums Σ V ∇W, 1/m, without the part of walls. With V∇W = −V·c·(1 − q)³·**r** the pairs sum (1 − q)³·**r**,
/// and the factor comes last.
#[derive(Clone, Copy)]
pub(super) struct Crowding {
    pub kernel: Wendland,
    /// V·c, 1/m².
    pub steepness: f64,
}

impl Crowding {
    pub fn of(parameters: &Parameters) -> Self {
        let kernel = Wendland::new(parameters.support_radius);
        let volume = parameters.volume_in_sums();
        Self { kernel, steepness: volume * kernel.steepness }
    }

    /// Adds the neighbours at **d**.
    #[inline(always)]
    pub fn add<S: Simd, V: SimdFloat<S, Element: Real>>(&self, d: [V; 3], r2: V, sums: &mut [V; 3]) {
        let s = self.kernel.nearness(r2);
        let f = s * s * s;
        for k in 0..3 {
            sums[k] = f.mul_add(d[k], sums[k]);
        }
    }

    /// The gradient, 1/m.
    pub fn total(&self, sums: [f64; 3]) -> DVec3 {
        -self.steepness * DVec3::from_array(sums)
    }
}
