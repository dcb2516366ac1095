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
//! The drift does not change densities that follow the motion, so the fluid's volume would stray, by 5 %
//! within a few periods of a wave. In the depth of the fluid densities are therefore drawn to those of the
//! particles' places, Σ m W, at the rate [`RETURN`]·U/h. This is slow enough for the noise of that sum to
//! cancel out.

use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::Core,
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

/// How far a particle belongs to the fluid's depth, 0 to 1, from its G: one in the depth, a half at a flat
/// surface.
pub(super) fn depth(spread: f64) -> f64 {
    let [surface, depth] = SURFACE;
    ((spread - surface) / (depth - surface)).clamp(0.0, 1.0)
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
