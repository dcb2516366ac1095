//! Gradients and divergences of what is linear in space, from sums over neighbours that may lie anywhere.

use glam::DVec3;

use crate::sph::walls::{Coverage, Symmetric, inverse_above};

/// Smallest part of Σ V r⊗∇W along a direction by which a gradient is divided. In a corner particles have
/// about a fifth.
const LEAST_MOMENT: f64 = 0.1;

/// Sums by which the gradient of a pressure and the divergence of a velocity that are linear in space are exact,
/// wherever the particles lie.
#[derive(Clone, Copy)]
pub(super) struct Linear {
    /// Σ f·d⊗d.
    pub moment: Symmetric,
    /// The symmetric part of Σ f·(v_i − v_j)⊗d. The moment is symmetric, so the other part would change nothing.
    pub parting: Symmetric,
}

/// What the walls of the box ask of a gradient of pressure: across a wall the fluid is not accelerated, so there the
/// pressure balances gravity. Viscosity is left out: by it the pressure would undo the damping of what moves across the
/// wall, and a turning honey in a box that it sticks to gained speed.
///
/// (Without that, gradients at a wall are those from the neighbours on one side, while the compression there knows the
/// wall. Waves across a gap of four spacings then grow by a third in the time of sound for two support radii, faster
/// than an artificial viscosity of 0.1 damps them.)
#[derive(Clone, Copy, Default)]
pub(super) struct Held {
    /// For each axis the part of a kernel's moment across the walls that lies behind them.
    pub weight: DVec3,
    /// The force per volume, N/m³, by which pressures balance gravity.
    pub push: DVec3,
}

impl Linear {
    /// The gradient whose sum over the neighbours alone is `sum`, with what walls of the box ask of it. Half of the
    /// neighbours suffice where nothing is known of a wall.
    pub fn gradient(&self, steepness: f64, sum: DVec3, held: &Held) -> DVec3 {
        let of_walls = Symmetric::new(held.weight, DVec3::ZERO);
        let whole = (steepness * self.moment + of_walls).to_matrix();
        inverse_above(&whole, LEAST_MOMENT) * (sum + held.weight * held.push)
    }

    /// The rate −∇·v at which the fluid is compressed, 1/s. A wall fills a part of the kernel as neighbours do,
    /// and its approach is a velocity along its normal. (In a corner it is taken along the mean normal.)
    ///
    /// (Without the tensors a flow that stretches the lattice of its particles has a false divergence: vortices
    /// that fill a box gain 8 % of energy when the lattice breaks, and 1 % with them. With the tensors for the
    /// pairs alone, and not for the wall's approach, water at rest moves along its walls at up to 5 cm/s.)
    pub fn compression(&self, steepness: f64, wall: Option<&Coverage>, wall_rate: f64) -> f64 {
        let by_pairs = steepness * self.moment;
        let whole = wall.map_or(by_pairs, |wall| by_pairs + wall.tensor());
        let inverse = inverse_above(&whole.to_matrix(), LEAST_MOMENT);
        let parting = self.parting.to_matrix();
        let product = (0..3).map(|k| inverse.col(k).dot(parting.col(k))).sum::<f64>();
        let across = wall.map_or(0.0, |wall| {
            let normal = wall.gradient.normalize_or_zero();
            normal.dot(inverse * normal)
        });
        wall_rate * across - steepness * product
    }
}
