//! The parameters of a fluid, each with its unit, checked once before a run. The numbers of a method are
//! declared with the method, see [`Method`].

use glam::DVec3;

use super::error::ParameterError;
use super::kernel::Kernels;
use super::methods::{COURANT, Method, Paper, StatedSound};
use super::scales::{Scales, Slip};
use crate::precision::Precision;
use crate::quantity::Bound;

/// The parameters of a fluid. [`Parameters::of`] fills them in for a method and a size of particles,
/// [`Parameters::paper`] with table 1 of the paper. The default is water in the default method, in particles
/// of 20 g.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Rest density ρ₀, kg/m³. 998.29: water at 20 °C (table 1).
    pub rest_density: f64,
    /// Mass of one particle m, kg. With ρ₀ it fixes the spacing (m/ρ₀)^⅓: 27.2 mm for 0.02 (table 1) in
    /// water.
    pub particle_mass: f64,
    /// Support radius h, m: every kernel is zero beyond it. By default it suits the method: 0.1 (table 1) for
    /// the paper's, that is 3.7 spacings and some 200 neighbours, and fewer spacings for the others.
    pub support_radius: f64,
    /// Dynamic viscosity, Pa·s (the paper's ν). By default that of water; in the paper's method 3.5 (table
    /// 1), 3500 times as much. Zero: the pass does not run.
    pub viscosity: f64,
    /// Surface tension σ, N/m. By default none; in the paper's method 0.0728 (table 1): water against air.
    /// Zero: the pass does not run.
    pub surface_tension: f64,
    /// Gravity, m/s². (0, 0, −9.81). Zero: the pass does not run.
    pub gravity: DVec3,
    /// The greatest acceleration by gravity where a formula of place or time gives it, m/s². 0 where none does.
    pub most_gravity: f64,
    /// Restitution c_R of the container's walls, 0 (stick) to 1 (mirror). 0.5: half of the normal speed
    /// returns.
    pub wall_restitution: f64,
    /// Time step dt, s, or the longest one if steps are adaptive. For the paper's method 0.002: below
    /// [`Parameters::stable_dt`] of the paper's scene (2.7 ms after a fall of 3 m), so that no particle
    /// crosses more than a sixth of its support in one step. The paper's own 0.01 is three times the bound;
    /// in that scene, soft and viscous as it is, it still does not diverge, but loses 3 % more energy in the
    /// first second.
    pub time_step: f64,
    /// Whether a step may be shorter than `time_step` where the state demands it, see
    /// [`Simulation::stable_dt`](super::Simulation::stable_dt).
    pub adaptive: bool,
    /// The greatest speed that is expected, m/s. A compressible method derives its speed of sound from it,
    /// unless that is stated. 7.7 by default: a fall through the paper's box, 3 m.
    pub expected_speed: f64,
    /// The part of it that gravity and walls cause, m/s: all of it but for a velocity that the fluid has at the start. Damping
    /// does not depend on a velocity that all of the fluid has. 7.7 by default.
    pub driven_speed: f64,
    /// The method that finds the pressure, with its numbers.
    pub method: Method,
    /// How the walls of the box act on a fluid that moves along them. Obstacles have their own.
    pub slip: Slip,
    /// Whether the fluid sticks to any wall, of the box or of an obstacle; a simulation also finds out by
    /// itself. Steps that viscosity limits are shorter then, except with the paper's method.
    pub sticks: bool,
    /// Coefficient of friction μ of the container's walls: when a particle hits a wall, its speed along the
    /// wall falls by μ times the change of its velocity normal to the wall. Zero: no friction.
    pub wall_friction: f64,
    /// Whether the fluid fills all room that the box and the obstacles leave, so that it has no surface.
    /// `dfsph` then packs the particles at the start, and finds their `packing`.
    pub fills_vessel: bool,
    /// Whether it still does. Uniform gravity then moves nothing in it, and `dfsph` adds the hydrostatic pressure that
    /// it causes to the pressures of the motion. A simulation ends this where walls that move leave more room.
    pub is_sealed: bool,
    /// Part of the room of a fluid that fills its vessel which the volumes of its particles take in sums over
    /// neighbours: particles that have left their lattice leave gaps. One for any other fluid. A simulation
    /// finds it.
    pub packing: f64,
    /// Precision of the sums over neighbours. State and motion are always in `f64`. `f32` has seven digits,
    /// relative to a few support radii.
    pub precision: Precision,
}

/// The density of water at 20 °C, kg/m³.
const WATER: f64 = 998.29;

/// The mass of a particle, kg, in the paper's table 1.
const PAPER_MASS: f64 = 0.02;

/// The longest step of methods whose steps follow the state, s.
const LONGEST_STEP: f64 = 0.01;

impl Default for Parameters {
    /// Water at 20 °C in the default method, in particles of 20 g.
    fn default() -> Self {
        Self { particle_mass: PAPER_MASS, ..Self::of(Method::default(), (PAPER_MASS / WATER).cbrt()) }
    }
}

/// What the viscosity is called as a limit of steps, see [`Parameters::shortest_step`].
pub(crate) const VISCOSITY: &str = "viscosity";

impl Parameters {
    /// Water at 20 °C in particles with this spacing, m. Viscosity, surface tension, support radius,
    /// precision and steps are the defaults of the method, as in a scene that states none of them. Walls let
    /// the fluid slip, and speeds up to a fall of 3 m are expected.
    pub fn of(method: impl Into<Method>, spacing: f64) -> Self {
        let method = method.into();
        let fluid = method.fluid();
        let mut parameters = Self {
            rest_density: WATER,
            particle_mass: WATER * spacing.powi(3),
            support_radius: method.support(fluid.surface_tension > 0.0).radius(spacing),
            viscosity: fluid.viscosity,
            surface_tension: fluid.surface_tension,
            gravity: DVec3::new(0.0, 0.0, -9.81),
            most_gravity: 0.0,
            wall_restitution: 0.5,
            time_step: LONGEST_STEP,
            adaptive: fluid.adaptive,
            expected_speed: 7.7,
            driven_speed: 7.7,
            method,
            slip: Slip::Free,
            sticks: false,
            wall_friction: 0.0,
            fills_vessel: false,
            is_sealed: false,
            packing: 1.0,
            precision: fluid.precision,
        };
        if !parameters.adaptive {
            parameters.time_step = parameters.stable_dt(parameters.expected_speed);
        }
        parameters
    }

    /// Table 1 of the paper, in the paper's method, with steps of 2 ms.
    pub fn paper() -> Self {
        let fluid = Self::of(Paper::default(), (PAPER_MASS / WATER).cbrt());
        Self { particle_mass: PAPER_MASS, time_step: 0.002, ..fluid }
    }

    /// Checks all parameters and the numbers of the method.
    ///
    /// # Errors
    /// The first parameter that is not finite, or lies outside the values for which the method is meaningful.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let check = |name, found: f64, holds: bool, expected: &str| {
            if holds { Ok(()) } else { Err(ParameterError { name, found, expected: expected.into() }) }
        };
        let numbers = [
            ("rest_density", self.rest_density, Bound::Positive),
            ("particle_mass", self.particle_mass, Bound::Positive),
            ("packing", self.packing, Bound::Fraction),
            ("support_radius", self.support_radius, Bound::Positive),
            ("viscosity", self.viscosity, Bound::NotNegative),
            ("surface_tension", self.surface_tension, Bound::NotNegative),
            ("most_gravity", self.most_gravity, Bound::NotNegative),
            ("wall_restitution", self.wall_restitution, Bound::Fraction),
            ("time_step", self.time_step, Bound::Positive),
            ("wall_friction", self.wall_friction, Bound::NotNegative),
            ("expected_speed", self.expected_speed, Bound::NotNegative),
            ("driven_speed", self.driven_speed, Bound::NotNegative),
        ];
        for (name, found, bound) in numbers {
            check(name, found, bound.admits(found), &bound.to_string())?;
        }
        for g in self.gravity.to_array() {
            check("gravity", g, g.is_finite(), "finite components")?;
        }
        self.method.check()?;
        self.method.numerics().validate(&self.scales())?;
        // Kernels divide by h⁹: with other units than metres that may leave the range of a double.
        let weight = self.mass_in_sums() * Kernels::new(self.support_radius).poly6(0.0);
        check(
            "support_radius",
            self.support_radius,
            weight.is_normal(),
            "a length whose ninth power is a number",
        )
    }

    /// The mass, kg, with which a particle counts in sums over neighbours.
    pub(crate) fn mass_in_sums(&self) -> f64 {
        self.packing * self.particle_mass
    }

    /// The volume, m³, with which a particle at rest counts in sums over neighbours.
    pub(crate) fn volume_in_sums(&self) -> f64 {
        self.mass_in_sums() / self.rest_density
    }

    /// The volume, m³, that a particle at rest fills.
    pub(crate) fn volume(&self) -> f64 {
        self.particle_mass / self.rest_density
    }

    /// What the method derives numbers from.
    pub(crate) fn scales(&self) -> Scales {
        Scales {
            rest_density: self.rest_density,
            particle_mass: self.mass_in_sums(),
            support_radius: self.support_radius,
            viscosity: self.viscosity,
            surface_tension: self.surface_tension,
            expected_speed: self.expected_speed,
            sticks: self.sticks || self.slip == Slip::No,
        }
    }

    /// The uniform gravity that sets the fluid in motion, m/s².
    pub fn pull(&self) -> DVec3 {
        if self.is_sealed { DVec3::ZERO } else { self.gravity }
    }

    /// Distance between particles at rest, (m/ρ₀)^⅓, m.
    pub fn spacing(&self) -> f64 {
        self.scales().spacing()
    }

    /// Whether walls and obstacles add to the density of particles. If not, they act on positions and
    /// velocities only.
    pub fn walls_have_density(&self) -> bool {
        self.method.numerics().walls_have_density()
    }

    /// The density, kg/m³, of a particle that starts under a pressure, Pa; `None` if the method starts all
    /// particles at the rest density.
    pub fn density_at_start(&self, pressure: f64) -> Option<f64> {
        self.method.numerics().density_at_start(&self.scales(), pressure)
    }

    /// Whether the method keeps the fluid from being compressed, at any cost.
    pub fn keeps_density(&self) -> bool {
        self.method.numerics().keeps_density()
    }

    /// Whether particles that start too near to an obstacle are moved away from it instead of being dropped.
    pub fn makes_room_at_start(&self) -> bool {
        self.method.numerics().makes_room_at_start()
    }

    /// The mean compression, as a part of the rest density, within which the method is to keep the fluid;
    /// `None` if it promises none.
    pub(super) fn kept_compression(&self) -> Option<f64> {
        self.method.numerics().kept_compression()
    }

    /// Speed of sound, m/s; 0 if the method has no compression.
    pub fn sound_speed(&self) -> f64 {
        self.method.numerics().sound_speed(&self.scales())
    }

    /// Whether the scene states the speed of sound. Otherwise it follows from how fast the fluid may become.
    pub fn states_sound_speed(&self) -> bool {
        self.stated_sound().is_some()
    }

    /// The longest step, s, that is stable while no particle is faster than `max_speed`, m/s: the least of
    /// the limits of sound and motion, of viscosity, of ripples under surface tension, and of gravity. The
    /// method has their formulas.
    ///
    /// Pressure forces have no bound before a run, see
    /// [`Simulation::stable_dt`](super::Simulation::stable_dt).
    pub fn stable_dt(&self, max_speed: f64) -> f64 {
        self.shortest_step(max_speed).0
    }

    /// [`Parameters::stable_dt`], and what asks for it.
    pub fn shortest_step(&self, max_speed: f64) -> (f64, &'static str) {
        let (numerics, scales) = (self.method.numerics(), self.scales());
        let limits = [
            (numerics.courant_dt(&scales, max_speed), "the speeds of sound and of the fluid"),
            (numerics.viscous_dt(&scales), VISCOSITY),
            (numerics.capillary_dt(&scales), "surface tension"),
            (self.force_dt(self.gravity.length()), "gravity"),
        ];
        let none = (f64::INFINITY, "nothing");
        limits.into_iter().fold(none, |shortest, limit| if limit.0 < shortest.0 { limit } else { shortest })
    }

    /// The kinematic viscosity, m²/s, with which a method damps the noise of particles, at least that of its defaults.
    pub fn numerical_viscosity(&self) -> f64 {
        self.method.numerics().numerical_viscosity(&self.scales())
    }

    /// Whether the method makes the drag of bodies that move through the fluid several times too large.
    pub(crate) fn drag_is_too_large(&self) -> bool {
        self.method.numerics().drag_is_too_large()
    }

    /// The speed of sound that a scene states, with the speed that it must exceed; `None` if the scene states
    /// none.
    pub(crate) fn stated_sound(&self) -> Option<StatedSound> {
        self.method.numerics().stated_sound(&self.scales())
    }

    /// The longest step, s, for an acceleration a, m/s²: a multiple of √(h/a), with the support radius h.
    pub fn force_dt(&self, acceleration: f64) -> f64 {
        self.method.numerics().force_factor() * (self.support_radius / acceleration).sqrt()
    }

    /// The longest step, s, for a speed of sound and a greatest speed, m/s.
    pub(super) fn sound_dt(&self, sound: f64, max_speed: f64) -> f64 {
        COURANT * self.support_radius / (sound + max_speed)
    }

    /// The longest step, s, for the present acceleration of the particles, pressure included, m/s².
    pub(super) fn present_force_dt(&self, acceleration: f64) -> f64 {
        self.method.numerics().present_force_gain() * self.force_dt(acceleration)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sph::{Dfsph, Paper, Wcsph};

    #[test]
    fn table_1_is_valid() {
        let paper = Parameters::paper();
        assert_eq!(paper.validate(), Ok(()));
        let Parameters { rest_density, particle_mass, support_radius, viscosity, surface_tension, .. } =
            paper;
        let table = [rest_density, particle_mass, support_radius, viscosity, surface_tension];
        assert_eq!(table, [998.29, 0.02, 0.1, 3.5, 0.0728]);
        assert!(!paper.adaptive && paper.precision == Precision::F64);
    }

    #[test]
    fn parameters_of_a_method_are_its_defaults() {
        assert_eq!(Parameters::default().method, Method::default());
        for method in Method::all() {
            let (parameters, fluid) = (Parameters::of(method, 0.03), method.fluid());
            assert_eq!(parameters.validate(), Ok(()), "{}", method.name());
            assert_eq!((parameters.viscosity, parameters.adaptive), (fluid.viscosity, fluid.adaptive));
            assert!((parameters.spacing() / 0.03 - 1.0).abs() < 1e-12);
            assert!(parameters.adaptive || parameters.time_step <= parameters.stable_dt(7.7));
        }
    }

    #[test]
    fn each_wrong_value_is_named() {
        let check = |change: fn(&mut Parameters), name: &str| {
            let mut parameters = Parameters::paper();
            change(&mut parameters);
            assert_eq!(parameters.validate().map_err(|e| e.name), Err(name));
        };
        check(|p| p.rest_density = 0.0, "rest_density");
        check(|p| p.particle_mass = f64::NAN, "particle_mass");
        check(|p| p.support_radius = -0.1, "support_radius");
        check(|p| p.support_radius = 1e-60, "support_radius");
        check(|p| p.method = Paper { stiffness: f64::INFINITY, ..Paper::default() }.into(), "stiffness");
        check(|p| p.method = Wcsph { sound_speed: Some(0.0), ..Wcsph::default() }.into(), "sound_speed");
        fn slow(p: &mut Parameters, tension: f64) {
            (p.method, p.expected_speed, p.surface_tension) = (Wcsph::default().into(), 0.0, tension);
        }
        check(|p| slow(p, 0.0), "sound_speed");
        // ripples have a speed where nothing else moves
        let mut drop = Parameters::paper();
        slow(&mut drop, 1.0);
        assert_eq!(drop.validate(), Ok(()));
        check(|p| p.method = Dfsph { tolerance: 2.0, ..Dfsph::default() }.into(), "compression");
        check(|p| p.method = Dfsph { most_iterations: 0, ..Dfsph::default() }.into(), "iterations");
        check(|p| p.viscosity = -1.0, "viscosity");
        check(|p| p.wall_restitution = 1.5, "wall_restitution");
        check(|p| p.gravity.y = f64::NAN, "gravity");
        check(|p| p.time_step = 0.0, "time_step");
        let error = Parameters { viscosity: -1.0, ..Parameters::paper() }.validate().unwrap_err();
        assert_eq!(error.to_string(), "viscosity is -1, expected a finite number of at least 0");
    }
}
