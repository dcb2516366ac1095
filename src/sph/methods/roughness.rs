//! The rough part of a motion: noise, which an artificial viscosity should damp.
//!
//! ```text
//! v′ = v − v̄,   v̄_i = Σ V v_j W / Σ V W, a step before
//! Π_ij ∝ α·h·c·(that of v′_ij·d and v_ij·d which is nearer to zero; zero if their signs differ)
//! ```
//!
//! An artificial viscosity of the whole motion brakes waves, too. With α = 0.02 and twenty layers a free wave
//! loses half of its height in five periods (`wcsph`). A velocity that is linear in space is its own mean v̄
//! in the depth of a fluid, so the viscosity of v′ leaves it alone. It damps a wave of length L by a part of
//! the order (h/L)² of the damping of the whole motion. At a surface and beside walls the mean is one-sided,
//! and smooth motion is damped a little there. Noise from particle to particle has no mean, and is damped in
//! full. Pairs still exchange equal and opposite momenta along their lines, and each pair takes energy away,
//! because v′·d never acts against v·d.
//!
//! The mean is that of the step before, which the same sum finds at little cost. In one step the noise of
//! velocities changes little, and gravity adds the same velocity to all particles.

use fearless_simd::{Simd, SimdFloat};

use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    pairs::Real,
    particles::{Vectors, set_sum},
};

/// Velocities split into smooth and rough parts.
pub(super) struct Roughness {
    /// v̄ of the last step, m/s.
    smooth: Vectors,
    /// v − v̄, m/s.
    rough: Vectors,
}

/// Names of the smooth velocity's components in a checkpoint.
const NAMES: [&str; 3] = ["smooth velocity x", "smooth velocity y", "smooth velocity z"];

impl Roughness {
    /// The roughness of a fluid that starts with these velocities. It is zero, because no step before is
    /// known. If `is_smooth` is false, the whole motion counts as rough.
    pub fn of(velocity: &Vectors, is_smooth: bool) -> Self {
        let mut smooth = velocity.clone();
        if !is_smooth {
            smooth.components_mut().into_iter().for_each(|column| column.fill(0.0));
        }
        Self { smooth, rough: Vectors::default() }
    }

    /// Splits the velocities of a step. Returns their rough parts, and the columns in which a sum puts the
    /// smooth ones.
    pub fn split(&mut self, velocity: &Vectors) -> (&Vectors, &mut Vectors) {
        set_sum(&mut self.rough, velocity, &self.smooth, -1.0);
        (&self.rough, &mut self.smooth)
    }

    /// The columns that must be sorted with the particles.
    pub fn columns(&mut self) -> [&mut Vec<f64>; 3] {
        self.smooth.components_mut()
    }

    pub fn save(&self, checkpoint: &mut Checkpoint) {
        for (name, column) in NAMES.into_iter().zip(self.smooth.components()) {
            checkpoint.set(name, column.clone());
        }
    }

    /// Restores what [`Roughness::save`] stored.
    ///
    /// # Errors
    /// The column that the checkpoint lacks.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        for (name, column) in NAMES.into_iter().zip(self.smooth.components_mut()) {
            *column = checkpoint.of_particles(name)?;
        }
        Ok(())
    }

    pub fn bytes(&self) -> usize {
        self.smooth.bytes() + self.rough.bytes()
    }
}

/// The factor α·h/2·c of an artificial viscosity, m²/s, limited to what noise allows in a step of the length
/// `dt`: with a greater factor the step would reverse noise and make it grow. The limit is that of a
/// viscosity ν = factor/10.
pub(super) fn factor(alpha: f64, sound_speed: f64, support_radius: f64, dt: f64) -> f64 {
    let smoothing = 0.5 * support_radius;
    (alpha * smoothing * sound_speed).min(10.0 * smoothing.powi(2) / (24.0 * dt))
}

/// The kinematic viscosity, m²/s, of an artificial viscosity without that limit.
pub(super) fn viscosity(alpha: f64, sound_speed: f64, support_radius: f64) -> f64 {
    alpha * 0.5 * support_radius * sound_speed / 10.0
}

/// The part of the difference of rough velocities along a line that takes energy from the whole motion,
/// `whole`.
#[inline(always)]
pub(super) fn damped<S: Simd, V: SimdFloat<S, Element: Real>>(rough: V, whole: V) -> V {
    let zero = V::Element::of(0.0);
    rough.min(whole).max(zero) + rough.max(whole).min(zero)
}
