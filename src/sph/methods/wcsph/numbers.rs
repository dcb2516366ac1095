//! The method's numbers with derived values, and quantities of single particles that follow from them.

use glam::DVec3;

use super::super::negative_pressure::NegativePressure;
use super::{EXPONENT, Gradients, Wcsph};
use crate::sph::{core::Core, params::Parameters};

/// The method's numbers, with derived values where the scene states none.
#[derive(Debug, Clone, Copy)]
pub(super) struct Numbers {
    /// Speed of sound, m/s.
    pub sound_speed: f64,
    pub density_diffusion: f64,
    pub artificial_viscosity: f64,
    pub gradients: Gradients,
    pub shifting: f64,
    pub negative_pressure: NegativePressure,
    /// Whether the fluid has no surface and gradients by differences, so that only differences of its densities
    /// matter.
    pub fills_room: bool,
}

impl Numbers {
    pub fn of(wcsph: &Wcsph, parameters: &Parameters) -> Self {
        Self {
            sound_speed: parameters.sound_speed(),
            density_diffusion: wcsph.density_diffusion(&parameters.scales()),
            artificial_viscosity: wcsph.artificial_viscosity(&parameters.scales()),
            gradients: wcsph.gradients(),
            shifting: wcsph.shifting(),
            negative_pressure: wcsph.negative_pressure(),
            fills_room: wcsph.fills_room && wcsph.gradients() == Gradients::Differences,
        }
    }
}

/// Whether the sums include crowding. They do where particles are kept evenly distributed (with differences
/// of pressure, and with shifting), where the growth of the density at rest depends on the place, as gravity does, and
/// where the surface tension balances an even pressure.
pub(super) fn sums_crowding(numbers: &Numbers, core: &Core) -> bool {
    numbers.shifting > 0.0
        || numbers.gradients == Gradients::Differences
        || core.gravity_field.is_some()
        || core.parameters.surface_tension != 0.0
}

/// ρ₀/c²·g: how the density of a fluid at rest grows along gravity, kg/m⁴.
pub(super) fn at_rest(numbers: &Numbers, parameters: &Parameters, gravity: DVec3) -> DVec3 {
    parameters.rest_density / numbers.sound_speed.powi(2) * gravity
}

/// The pressure p = c²ρ₀/7·((ρ/ρ₀)⁷ − 1), cut off at zero unless negative pressures are kept.
#[inline]
pub(super) fn tait(numbers: &Numbers, parameters: &Parameters, density: f64) -> f64 {
    let stiffness = numbers.sound_speed.powi(2) * parameters.rest_density / f64::from(EXPONENT);
    let p = stiffness * ((density / parameters.rest_density).powi(EXPONENT) - 1.0);
    numbers.negative_pressure.of(p)
}
