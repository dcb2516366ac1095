//! The rough part of a motion, which is noise and which an artificial viscosity is to damp.
//!
//! ```text
//! v′ = v − v̄,   v̄_i = Σ V v_j W / Σ V W, a step before
//! Π_ij ∝ α·h·c·(that of v′_ij·d and v_ij·d which is nearer to zero; zero if their signs differ)
//! ```
//!
//! An artificial viscosity of the whole motion brakes waves too: with α = 0.02 and twenty layers a free wave
//! loses half of its height in five periods (`wcsph`). A velocity that is linear in space is its own mean v̄
//! in the depth of a fluid, so the viscosity of v′ leaves it alone, and damps a wave of length L by a part of
//! the order (h/L)² of what it did. At a surface and beside walls the mean is one-sided, and smooth motion is
//! damped a little there. Noise from particle to particle has no mean, and is damped as before. Pairs still
//! exchange equal and opposite momenta along their lines, and each pair takes energy away, because v′·d never
//! acts against v·d.
//!
//! The mean is that of the step before, which the same sum finds on its way. In one step the noise of
//! velocities changes little, and what gravity adds is the same for all.

use fearless_simd::{Simd, SimdFloat};

use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    pairs::Real,
    particles::{Vectors, set_sum},
};

/// Velocities in parts: smooth ones, and what is left.
pub(super) struct Roughness {
    /// v̄ of the last step, m/s.
    smooth: Vectors,
    /// v − v̄, m/s.
    rough: Vectors,
}

/// Names of the smooth velocity's components in a checkpoint.
const NAMES: [&str; 3] = ["smooth velocity x", "smooth velocity y", "smooth velocity z"];

impl Roughness {
    /// The roughness of a fluid that starts with these velocities: none, as nothing is known of a step before. If
    /// nothing `is_smooth`, it is all of their motion.
    pub fn of(velocity: &Vectors, is_smooth: bool) -> Self {
        let mut smooth = velocity.clone();
        if !is_smooth {
            smooth.components_mut().into_iter().for_each(|column| column.fill(0.0));
        }
        Self { smooth, rough: Vectors::default() }
    }

    /// Splits the velocities of a step, and returns their rough parts, and where a sum is to put the smooth
    /// ones.
    pub fn split(&mut self, velocity: &Vectors) -> (&Vectors, &mut Vectors) {
        set_sum(&mut self.rough, velocity, &self.smooth, -1.0);
        (&self.rough, &mut self.smooth)
    }

    /// What must be sorted as the particles are.
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

/// The factor α·h/2·c of an artificial viscosity, m²/s, or as much of it as noise bears in a step of the
/// length `dt`: with a greater one the step would turn noise round and make it grow. The limit is that of a
/// viscosity ν = factor/10.
pub(super) fn factor(alpha: f64, sound_speed: f64, support_radius: f64, dt: f64) -> f64 {
    let smoothing = 0.5 * support_radius;
    (alpha * smoothing * sound_speed).min(10.0 * smoothing.powi(2) / (24.0 * dt))
}

/// The kinematic viscosity, m²/s, of an artificial viscosity without that limit.
pub(super) fn viscosity(alpha: f64, sound_speed: f64, support_radius: f64) -> f64 {
    alpha * 0.5 * support_radius * sound_speed / 10.0
}

/// The difference of rough velocities along a line, as far as it takes energy from the whole motion, `whole`.
#[inline(always)]
pub(super) fn damped<S: Simd, V: SimdFloat<S, Element: Real>>(rough: V, whole: V) -> V {
    let zero = V::Element::of(0.0);
    rough.min(whole).max(zero) + rough.max(whole).min(zero)
}
