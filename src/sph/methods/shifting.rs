//! Shifting: what keeps particles even where pressure does not (Lind et al. 2012, Sun et al. 2017).
//!
//! Forces by pressure in equal pairs p_i + p_j push particles apart until they lie evenly, but the noise of doing so is as
//! large as the pressure itself is above zero. Forces by differences p_j − p_i have no such noise and no such order. Besides
//! their velocity particles then drift by −2h·U·(Σ V ∇W + ∇λ), U being the greatest speed: from where they crowd to where
//! they lack. The drift is no motion of the fluid; what a particle carries (velocity, density) it keeps, an error of the
//! order of the drift times the gradient.
//!
//! Densities that follow the motion do not hear of the drift, and the fluid's volume would stray: by 5 % within a few periods of
//! a wave. So in the depth they are drawn to what the particles' places say, Σ m W, at the rate [`RETURN`]·U/h: slowly enough
//! for the noise of that sum to cancel out.

use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::Core,
    particles::Vectors,
};

/// Below the first value of G = −⅓ Σ V r·∇W + ⅓ tr K a particle belongs to the surface, from the second on to the depth.
const SURFACE: [f64; 2] = [0.85, 0.95];

/// The rate at which densities come back to the particles' places, over U/h. A wave's volume strays by 5 % with 0, 3 % with
/// 0.1, 2 % with 0.3; vortices lose nothing by it.
const RETURN: f64 = 0.3;

/// The rate of return for the present speeds, 1/s.
pub(super) fn return_rate(strength: f64, core: &Core) -> f64 {
    if strength > 0.0 { RETURN * core.speed / core.parameters.support_radius } else { 0.0 }
}

/// How far a particle belongs to the fluid's depth, 0 to 1, from its G: one in the depth, a half at a flat surface.
pub(super) fn depth(spread: f64) -> f64 {
    let [surface, depth] = SURFACE;
    ((spread - surface) / (depth - surface)).clamp(0.0, 1.0)
}

/// The drift as a field and its factor: Σ V ∇W + ∇λ, 1/m, times a diffusivity, m²/s. None without shifting.
pub(super) fn shift<'a>(strength: f64, crowding: &'a Vectors, core: &Core) -> Option<(&'a Vectors, f64)> {
    let strength = strength * 2.0 * core.parameters.support_radius;
    (strength > 0.0).then(|| (crowding, -strength * core.speed))
}

/// In a checkpoint.
const NAMES: [&str; 3] = ["crowding x", "crowding y", "crowding z"];

pub(super) fn save_crowding(crowding: &Vectors, checkpoint: &mut Checkpoint) {
    for (name, column) in NAMES.into_iter().zip(crowding.components()) {
        checkpoint.set(name, column.clone());
    }
}

/// # Errors
/// The column that the checkpoint lacks.
pub(super) fn restore_crowding(checkpoint: &Checkpoint) -> Result<Vectors, CheckpointError> {
    let mut crowding = Vectors::default();
    for (name, column) in NAMES.into_iter().zip(crowding.components_mut()) {
        *column = checkpoint.of_particles(name)?;
    }
    Ok(crowding)
}
