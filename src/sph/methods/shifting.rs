//! Shifting, which keeps particles evenly distributed where pressure does not (Lind et al. 2012, Sun et al.
//! 2017).
//!
//! Forces by sums of pressures p_i + p_j push particles apart until they lie evenly, but the noise of this is
//! proportional to the pressure. Forces by differences p_j − p_i have no such noise, and make no such order.
//! So particles also drift by −2h·U·(Σ V ∇W + ∇λ), where U is the greatest speed, from where they crowd to
//! where there are few. The drift is not a motion of the fluid. A particle keeps its velocity and density,
//! with an error of the order of the drift times their gradient.
//!
//! A compressed fluid has more particles where its pressure is higher, and they do not crowd there. With
//! `wcsph` the sum is therefore Σ V(1 − (ρ_j − ρ₀)/ρ₀)∇W, with the densities that particles carry. (Otherwise
//! the drift and the pressure move particles in a circle, and each round takes momentum from a fluid that
//! turns.)
//!
//! A particle takes its momentum along when it drifts. So in a fluid that fills its room only what is uneven
//! between neighbours moves particles: each particle drifts by its own sum less the mean of its neighbours'
//! sums. A slope of the density that is longer than the kernel is for the pressure to level. (Water that
//! turns in a vessel at 5 rad/s lost 7 % of its angular momentum in 3 s by drifts that all led to the axis, and
//! loses nothing without the mean.) Before a free surface the mean is needed: without it water at rest keeps
//! moving at 25 mm/s instead of 6.
//!
//! The drift does not change densities that follow the motion, so the fluid's volume would stray, by 5 %
//! within a few periods of a wave. In the depth of the fluid densities are therefore drawn to those of the
//! particles' places, Σ m W, at the rate [`RETURN`]·U/h. This is slow enough for the noise of that sum to
//! cancel out. Disorder makes that sum larger by a hundredth, which a fluid without a surface cannot give way
//! to. There densities are drawn to the places' after division by their mean.

use fearless_simd::{Simd, SimdFloat};

use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::Core,
    kernel::Wendland,
    pairs::{PairPass, Real},
    particles::Vectors,
};

/// Limits of G = −⅓ Σ V r·∇W + ⅓ tr K. Below the first a particle belongs to the surface, above the second to
/// the depth.
const SURFACE: [f64; 2] = [0.85, 0.95];

/// The rate, over U/h, at which densities return to those of the particles' places. A wave's volume strays by
/// 5 % with 0, 3 % with 0.1, 2 % with 0.3; vortices lose nothing by the return.
const RETURN: f64 = 0.3;

/// The rate at which densities return, at the present speeds, 1/s.
pub(super) fn return_rate(core: &Core) -> f64 {
    RETURN * core.speed / core.parameters.support_radius
}

/// The rate of return at the speed of a fall through half a support radius, 1/s. Gravity closes again what it
/// has loosened.
pub(super) fn falling_rate(core: &Core) -> f64 {
    let gravity = core.parameters.gravity.length().max(core.parameters.most_gravity);
    RETURN * (gravity / core.parameters.support_radius).sqrt()
}

/// How far a particle belongs to the fluid's depth, 0 to 1, from its G: one in the depth, zero at a flat
/// surface, where G is 0.72.
pub(super) fn depth(spread: f64) -> f64 {
    let [surface, depth] = SURFACE;
    ((spread - surface) / (depth - surface)).clamp(0.0, 1.0)
}

/// What the crowding of neighbours has in common, which moves no particle in a fluid that fills its room.
pub(super) struct Common {
    /// The mean of the crowding c over the neighbours, Σ W·c/Σ W·d, 1/m. Dividing by the depths d leaves out
    /// neighbours at a surface, whose c is zero.
    mean: Vectors,
}

/// Number of steps after which [`Common`] is found anew. It is smooth, and changes as slowly as the flow does.
const COMMON_STEPS: u64 = 8;

/// Names of the components of [`Common`] in a checkpoint.
const COMMON_NAMES: [&str; 3] = ["common crowding x", "common crowding y", "common crowding z"];

impl Common {
    /// Nothing in common, for this many particles.
    pub fn of(particles: usize) -> Self {
        let mut mean = Vectors::default();
        mean.resize(particles);
        Self { mean }
    }

    /// Subtracts from the crowding what neighbours have in common. `depth` says how far each particle belongs to
    /// the fluid's depth.
    pub fn subtract_from(&mut self, crowding: &mut Vectors, depth: &[f64], core: &Core) {
        self.mean.resize(depth.len());
        if core.steps.is_multiple_of(COMMON_STEPS) {
            let pass = Mean { kernel: Wendland::new(core.parameters.support_radius) };
            let ([cx, cy, cz], [x, y, z]) = (crowding.components(), self.mean.components_mut());
            core.sum(&pass, [&cx[..], cy, cz, depth], [&mut x[..], y, z]);
        }
        for (own, mean) in crowding.components_mut().into_iter().zip(self.mean.components()) {
            own.iter_mut().zip(mean).zip(depth).for_each(|((own, mean), depth)| *own -= depth * mean);
        }
    }

    /// The columns that must be sorted with the particles.
    pub fn columns(&mut self) -> [&mut Vec<f64>; 3] {
        self.mean.components_mut()
    }

    pub fn save(&self, checkpoint: &mut Checkpoint) {
        for (name, column) in COMMON_NAMES.into_iter().zip(self.mean.components()) {
            checkpoint.set(name, column.clone());
        }
    }

    /// Restores what [`Common::save`] stored.
    ///
    /// # Errors
    /// The column that the checkpoint lacks.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        for (name, column) in COMMON_NAMES.into_iter().zip(self.columns()) {
            *column = checkpoint.of_particles(name)?;
        }
        Ok(())
    }

    pub fn bytes(&self) -> usize {
        self.mean.bytes()
    }
}

/// The pass over pairs that finds the mean of a vector, weighted by W and by a fourth column.
#[derive(Clone, Copy)]
struct Mean {
    kernel: Wendland,
}

impl PairPass<4, 4, 3> for Mean {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        _: [V; 3],
        r2: V,
        _: &[V; 4],
        other: [V; 4],
        sums: &mut [V; 4],
    ) {
        let of = V::Element::of;
        let s = self.kernel.nearness(r2);
        let f = s * s * s;
        // 1 + 4q = 5 − 4s
        let weight = f * s * s.mul_add(of(-4.0), of(5.0));
        for k in 0..4 {
            sums[k] = weight.mul_add(other[k], sums[k]);
        }
    }

    fn finish(&self, _: usize, [x, y, z, weight]: [f64; 4]) -> [f64; 3] {
        if weight == 0.0 { [0.0; 3] } else { [x, y, z].map(|sum| sum / weight) }
    }
}

/// The drift as a field and its factor: Σ V ∇W + ∇λ, 1/m, times a diffusivity, m²/s; `None` without shifting.
pub(super) fn shift<'a>(strength: f64, crowding: &'a Vectors, core: &Core) -> Option<(&'a Vectors, f64)> {
    let strength = strength * 2.0 * core.parameters.support_radius;
    (strength > 0.0).then(|| (crowding, -strength * core.speed))
}

/// Names of the crowding's components in a checkpoint.
const NAMES: [&str; 3] = ["crowding x", "crowding y", "crowding z"];

/// Stores Σ V ∇W + ∇λ in a checkpoint.
pub(super) fn save_crowding(crowding: &Vectors, checkpoint: &mut Checkpoint) {
    for (name, column) in NAMES.into_iter().zip(crowding.components()) {
        checkpoint.set(name, column.clone());
    }
}

/// The Σ V ∇W + ∇λ that [`save_crowding`] stored.
///
/// # Errors
/// The column that the checkpoint lacks.
pub(super) fn restore_crowding(checkpoint: &Checkpoint) -> Result<Vectors, CheckpointError> {
    let mut crowding = Vectors::default();
    for (name, column) in NAMES.into_iter().zip(crowding.components_mut()) {
        *column = checkpoint.of_particles(name)?;
    }
    Ok(crowding)
}
