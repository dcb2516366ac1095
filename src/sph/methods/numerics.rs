//! The questions of the solver to a method's numbers: limits of the step, walls, pressures.

use std::f64::consts::PI;

use crate::sph::error::ParameterError;
use crate::sph::scales::Scales;
use crate::sph::walls::{ViscousForces, Wall, WallKernel};

/// Part of the support radius that a particle and a sound wave together may cross in one step. The value is
/// customary for weakly compressible fluids, and cautious for the paper's. A drop of 3000 particles on the
/// pawn has, at 0.5 s and 1 s, 1037.8 and 300.6 J with steps of 0.5 ms; 1037.6 and 297.6 J with 2 ms; 1037.0
/// and 297.2 J with 4 ms; 1034.3 and 290.3 J with 10 ms. The bound at the fastest instant is 3.2 ms.
pub(in crate::sph) const COURANT: f64 = 0.25;

/// Factor of √(h/a) in the limit for an acceleration a: a particle that is accelerated from rest moves 1/32
/// of h in such a step.
const FORCE_FACTOR: f64 = 0.25;

/// A fluid's viscosity counts from this part of the one on that damps noise. Water on the scale of a laboratory has
/// less than a hundredth of it.
const NOTICEABLE: f64 = 0.1;

/// A speed of sound that is stated instead of derived.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StatedSound {
    /// The speed of sound, m/s.
    pub sound_speed: f64,
    /// The speed, m/s, to which the greatest expected pressure drives the fluid.
    pub driven_speed: f64,
}

/// What is noted of what walls do to particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::sph) enum Noted {
    /// Nothing besides contacts.
    Nothing,
    /// The friction of walls, and their work to a tenth. Forces on obstacles are those of contacts and friction, and of
    /// the pressure in front of their surfaces.
    Friction,
    /// The forces of walls, and so their work.
    Forces,
}

/// The questions of the solver to a method's numbers.
pub(in crate::sph) trait Numerics: Sync {
    /// The kinematic viscosity, m²/s, that damps the noise of particles, or would damp it by default: αhc/20
    /// of an artificial viscosity. Without it rows of particles resist a shear about as much.
    fn numerical_viscosity(&self, scales: &Scales) -> f64;

    /// How the fluid rubs on itself: by the more exact forces where its viscosity counts beside that which damps
    /// noise.
    fn viscous_forces(&self, scales: &Scales) -> ViscousForces {
        let own = scales.viscosity / scales.rest_density;
        if own > NOTICEABLE * self.numerical_viscosity(scales) {
            ViscousForces::WithSpin
        } else {
            ViscousForces::AlongLines
        }
    }

    /// Whether the drag of a body that moves through the fluid comes out several times too large, as it does
    /// with pressures in pairs.
    fn drag_is_too_large(&self) -> bool;

    /// The speed of sound that a scene states, with the speed to compare it with; `None` if the scene states
    /// none.
    fn stated_sound(&self, _scales: &Scales) -> Option<StatedSound> {
        None
    }

    /// Checks conditions that the bounds of single keys do not cover.
    ///
    /// # Errors
    /// The first parameter that is out of range.
    fn validate(&self, _scales: &Scales) -> Result<(), ParameterError> {
        Ok(())
    }

    /// Speed of sound, m/s; 0 if the method has no compression.
    fn sound_speed(&self, scales: &Scales) -> f64;

    /// The longest step, s, in which sound and particles with this greatest speed, m/s, stay within their
    /// part of the support.
    fn courant_dt(&self, scales: &Scales, max_speed: f64) -> f64 {
        COURANT * scales.support_radius / (self.sound_speed(scales) + max_speed)
    }

    /// The longest step, s, that viscosity allows: (h/2)²/24ν, and half of it where the fluid sticks to
    /// walls.
    ///
    /// Forces along lines resist a compression three times as strongly as a shear. Away from walls, flows
    /// burst with steps beyond 1.2 times (h/2)²/24ν (support of 2.4 spacings), or 1.5 times (3 spacings). A
    /// wall adds up to 2ν·18/h²/(1 − m) to the rate of a particle beside it, and divides the part of its
    /// neighbours by 1 − m: by a half at a wall and by a quarter in an edge, where there are fewer
    /// neighbours. Together they allow 0.57 of (h/2)²/24ν; in tests flows burst beyond 0.8 of it in a box,
    /// and 0.7 in a cylinder. Forces with spin are hardly stiffer than those along lines: motion between neighbours
    /// dies away with up to 8ν Σ V F, which allows 2.0 (support of 3 spacings) to 2.4 times (2.2) as much as (h/2)²/24ν.
    fn viscous_dt(&self, scales: &Scales) -> f64 {
        let part = if scales.sticks { 48.0 } else { 24.0 };
        (0.5 * scales.support_radius).powi(2) * scales.rest_density / (part * scales.viscosity)
    }

    /// The longest step, s, that surface tension allows: ¼√(ρ(h/2)³/2πσ), for a ripple as short as the
    /// smoothing length (Brackbill et al. 1992).
    fn capillary_dt(&self, scales: &Scales) -> f64 {
        let half = 0.5 * scales.support_radius;
        let ripple = scales.rest_density * half.powi(3) / (2.0 * PI * scales.surface_tension);
        0.25 * ripple.sqrt()
    }

    /// Factor of √(h/a) in the limit for an acceleration a.
    fn force_factor(&self) -> f64 {
        FORCE_FACTOR
    }

    /// Factor by which a step may be longer if the acceleration a is the present one, pressure included.
    fn present_force_gain(&self) -> f64 {
        1.0
    }

    /// Whether walls and obstacles add to the density of particles. If not, they act on positions and
    /// velocities only.
    fn walls_have_density(&self) -> bool {
        true
    }

    /// How walls enter the sums of the method.
    fn wall(&self, scales: &Scales) -> Wall {
        Wall::new(WallKernel::WendlandC2, scales.support_radius, scales.spacing())
    }

    /// The density, kg/m³, of a particle that starts under a pressure, Pa; `None` if all start at the rest
    /// density.
    fn density_at_start(&self, _scales: &Scales, _pressure: f64) -> Option<f64> {
        None
    }

    /// Whether particles that start too near to an obstacle are moved away from it instead of being dropped.
    /// This suits only methods whose densities at the start do not follow from the places of particles, or
    /// that spread crowded particles before the first step.
    fn makes_room_at_start(&self) -> bool {
        false
    }

    /// Energy that compression has stored in a kilogram of fluid of this density, J/kg.
    fn elastic_energy(&self, scales: &Scales, density: f64) -> f64;

    /// The sum of [`Numerics::elastic_energy`] over several densities, J/kg.
    fn elastic_energies(&self, scales: &Scales, densities: &[f64]) -> f64 {
        densities.iter().map(|&density| self.elastic_energy(scales, density)).sum()
    }

    /// The mean compression, as a part of the rest density, within which the method is to keep the fluid;
    /// `None` if it promises none.
    fn kept_compression(&self) -> Option<f64> {
        None
    }

    /// Whether the method prevents compression of the fluid at any cost.
    fn keeps_density(&self) -> bool {
        false
    }

    /// Whether the velocities after a step are those of its middle if a force depends on the place.
    fn is_staggered(&self) -> bool {
        false
    }

    /// What the notes of each step say about what walls do to particles, see `Reaction`.
    fn noted(&self) -> Noted {
        Noted::Nothing
    }
}
