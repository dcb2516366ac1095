//! The numbers of a fluid and of the method, each with its unit, checked once before a run.
//!
//! Invariant: nothing else in the solver has a default; what is not here is derived from what is.

use std::{error, f64::consts::PI, fmt};

use glam::DVec3;

use super::kernel::Kernels;
use crate::precision::Precision;

/// What the equation of state answers where the density is below the rest density.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NegativePressure {
    /// p = max(k(ρ − ρ₀), 0): the fluid pushes, and never pulls.
    ///
    /// The default. At a free surface half of the neighbours are missing, so the density found there is about
    /// half of the rest density, and the unclamped law answers with a tension of kρ₀/2: an artefact of the
    /// sum, not a property of the fluid. Under tension the pressure kernel pulls until particles coincide;
    /// with the values of table 1 some 32 of them must lie in one point before their density reaches ρ₀.
    #[default]
    Clamp,
    /// p = k(ρ − ρ₀), as in Kelager (2006): keeps a drop together, and makes particles clump.
    Keep,
}

/// How pressure is found. Every method has density and motion; what else runs, the numbers below decide.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Method {
    /// Equations 8–14 of the paper, corrected: p = k(ρ − ρ₀), kernels poly6, spiky and viscosity, fixed step.
    #[default]
    Paper,
    /// Weakly compressible: density from the equation of continuity, pressure by Tait's equation.
    Wcsph(Wcsph),
    /// Divergence-free (Bender & Koschier 2017): pressure is solved for, so that the density stays.
    Dfsph(Dfsph),
}

impl Method {
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Wcsph(_) => "wcsph",
            Self::Dfsph(_) => "dfsph",
        }
    }
}

/// Of which pressures the acceleration of a particle is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gradients {
    /// Sums p_i + p_j: what one particle gains another loses, momentum is conserved to rounding.
    #[default]
    Pairs,
    /// Differences p_j − p_i in the fluid's depth: exact where pressure is linear in space, and five to ten times as accurate
    /// in fluids at rest, in viscous ones and in those without a free surface. Needs shifting, and, at a free surface, an
    /// artificial viscosity of some 0.05: without it, waves gain energy.
    Differences,
}

/// Numbers of the weakly compressible method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wcsph {
    /// Speed of sound c, m/s: ten times the greatest speed keeps the density within 1 %.
    pub sound_speed: f64,
    /// δ of the density diffusion (Molteni & Colagrossi 2009), 0.1; zero: the term is not computed.
    pub density_diffusion: f64,
    /// α of the artificial viscosity (Monaghan 1992), 0.02; zero: the term is not computed.
    pub artificial_viscosity: f64,
    pub gradients: Gradients,
    /// How strongly particles drift to where there are fewer of them, which keeps them even, 1; zero: they do not.
    pub shifting: f64,
}

/// Numbers of the divergence-free method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dfsph {
    /// Mean compression by one step that is accepted, as a part of the rest density. 1e-4: a tenth of that hardly changes
    /// the pressure of a fluid at rest, ten times that makes it 5 % too high.
    pub tolerance: f64,
    /// Iterations of the solver, at most. 100.
    pub most_iterations: u32,
    /// How strongly particles drift to where there are fewer of them; zero: they do not. 1 halves the deviation of a fluid at
    /// rest, and makes that of a shear flow two to three times as large.
    pub shifting: f64,
}

impl Default for Dfsph {
    fn default() -> Self {
        Self { tolerance: 1e-4, most_iterations: 100, shifting: 0.0 }
    }
}

/// What a wall does to a fluid that moves along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Slip {
    /// Nothing.
    #[default]
    Free,
    /// The fluid at the wall has the wall's velocity: viscosity acts between the two.
    No,
}

/// Everything a step needs to know of the fluid. Defaults are table 1 of the paper where it has a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Rest density ρ₀, kg/m³. 998.29: water at 20 °C (table 1).
    pub rest_density: f64,
    /// Mass of one particle m, kg. 0.02 (table 1); with ρ₀ it fixes the spacing (m/ρ₀)^⅓ = 27.2 mm.
    pub particle_mass: f64,
    /// Support radius h, m: every kernel is zero beyond it. 0.1 (table 1), that is 3.7 spacings and some
    /// 200 neighbours; 0.055 would give 30.
    pub support_radius: f64,
    /// Stiffness k of p = k(ρ − ρ₀), m²/s² = J/kg. 3.0 (table 1): the speed of sound is √k = 1.7 m/s,
    /// so the fluid is far softer than water and long steps are stable.
    pub stiffness: f64,
    /// What becomes of negative pressure; clamped to zero by default.
    pub negative_pressure: NegativePressure,
    /// Dynamic viscosity, Pa·s (the paper's ν). 3.5 (table 1), 3500 times that of water. Zero: the pass does not run.
    pub viscosity: f64,
    /// Surface tension σ, N/m. 0.0728 (table 1): water against air. Zero: the pass does not run.
    pub surface_tension: f64,
    /// Threshold l on |∇c|, 1/m, above which a particle counts as surface. 7.065 (table 1) = √(ρ₀/20 kg/m³).
    pub surface_threshold: f64,
    /// Gravity, m/s². (0, 0, −9.81). Zero: the pass does not run.
    pub gravity: DVec3,
    /// Restitution c_R of the container's walls, 0 (stick) to 1 (mirror). 0.5: half of the normal speed returns.
    pub wall_restitution: f64,
    /// Time step dt, s. 0.002: below [`Parameters::stable_dt`] of the paper's scene (2.7 ms after a fall of
    /// 3 m), so that no particle crosses more than a sixth of its support in one step. The paper's own 0.01
    /// is three times the bound; in that scene, soft and viscous as it is, it still does not diverge, but loses
    /// 3 % more energy in the first second.
    pub time_step: f64,
    /// Whether a step may be shorter than that where the state demands it (see
    /// [`Simulation::stable_dt`](super::Simulation::stable_dt)).
    pub adaptive: bool,
    pub method: Method,
    /// At the walls of the box; obstacles have their own.
    pub slip: Slip,
    /// Coefficient of friction μ of the container's walls: of the speed along the wall, μ times what the wall takes of
    /// the speed into it is lost. Zero: none.
    pub wall_friction: f64,
    /// Of the sums over neighbours; state and motion are always in `f64`. `f32` has seven digits relative to a few support
    /// radii.
    pub precision: Precision,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            rest_density: 998.29,
            particle_mass: 0.02,
            support_radius: 0.1,
            stiffness: 3.0,
            negative_pressure: NegativePressure::Clamp,
            viscosity: 3.5,
            surface_tension: 0.0728,
            surface_threshold: 7.065,
            gravity: DVec3::new(0.0, 0.0, -9.81),
            wall_restitution: 0.5,
            time_step: 0.002,
            adaptive: false,
            method: Method::Paper,
            slip: Slip::Free,
            wall_friction: 0.0,
            precision: Precision::F64,
        }
    }
}

/// A parameter outside the values for which the method has a meaning.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterError {
    /// The field's name in [`Parameters`].
    pub name: &'static str,
    pub found: f64,
    /// What would be accepted.
    pub expected: &'static str,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is {}, expected {}", self.name, self.found, self.expected)
    }
}

impl error::Error for ParameterError {}

/// Fraction of the support radius that a particle and a sound wave together may cross in one step: the
/// customary value for weakly compressible fluids, cautious for this one. A drop of 3000 particles on the pawn
/// has, at 0.5 s and 1 s, 1037.8 and 300.6 J with steps of 0.5 ms; 1037.6 and 297.6 J with 2 ms; 1037.0 and
/// 297.2 J with 4 ms; 1034.3 and 290.3 J with 10 ms. The bound at the fastest instant is 3.2 ms.
const COURANT: f64 = 0.25;

/// Part of the spacing that a particle may cross in one step where there is no sound: the customary 0.4.
const ADVECTION: f64 = 0.4;

/// Factor of √(h/a): a particle that is accelerated from rest moves 1/32 of h in such a step.
const FORCE_FACTOR: f64 = 0.25;

/// The same where pressure is solved for: the acceleration that it takes away counts too, at the beginning of a run.
const IMPLICIT_FORCE_FACTOR: f64 = 0.1;

/// The same once the pressure is known: its acceleration is part of what is limited. With 0.25 a column of forty layers
/// bursts at its start.
const SOLVED_FORCE_FACTOR: f64 = 0.15;

/// A density that is off comes back within so many steps: the first where the fastest particle passes as much in a step as
/// it may, the second at least where nothing moves. What moves loses its density step by step (with ten everywhere a dam
/// that breaks is 0.5 % too dense in the mean, with four 0.3 %); at rest each correction is noise of the pressure.
const RELAXATION_STEPS: [f64; 2] = [4.0, 10.0];

/// … and at rest in no less than so many times √(h/g), however short the steps: the error of a whole column comes back at
/// once, and with ten steps a column of eighty layers bursts at its start.
const RELAXATION_FALLS: f64 = 2.0;

/// … but not in more steps than these, in a gravity that is next to nothing; where a column bursts, steps are so short
/// that the time of a fall has some sixty.
const MOST_RELAXATION_STEPS: f64 = 100.0;

impl Parameters {
    /// # Errors
    /// The first parameter that is not finite, or lies outside the values the method is defined for.
    pub fn validate(&self) -> Result<(), ParameterError> {
        const POSITIVE: &str = "a finite number above 0";
        const NOT_NEGATIVE: &str = "a finite number of at least 0";
        let check = |name, found: f64, holds: bool, expected| {
            if found.is_finite() && holds { Ok(()) } else { Err(ParameterError { name, found, expected }) }
        };
        let positive = |name, x: f64| check(name, x, x > 0.0, POSITIVE);
        let not_negative = |name, x: f64| check(name, x, x >= 0.0, NOT_NEGATIVE);

        positive("rest_density", self.rest_density)?;
        positive("particle_mass", self.particle_mass)?;
        positive("support_radius", self.support_radius)?;
        not_negative("stiffness", self.stiffness)?;
        not_negative("viscosity", self.viscosity)?;
        not_negative("surface_tension", self.surface_tension)?;
        positive("surface_threshold", self.surface_threshold)?;
        for g in self.gravity.to_array() {
            check("gravity", g, true, "finite components")?;
        }
        let e = self.wall_restitution;
        check("wall_restitution", e, (0.0..=1.0).contains(&e), "a number from 0 to 1")?;
        positive("time_step", self.time_step)?;
        not_negative("wall_friction", self.wall_friction)?;
        match self.method {
            Method::Paper => {}
            Method::Wcsph(method) => {
                positive("sound_speed", method.sound_speed)?;
                not_negative("density_diffusion", method.density_diffusion)?;
                not_negative("artificial_viscosity", method.artificial_viscosity)?;
                not_negative("shifting", method.shifting)?;
            }
            Method::Dfsph(method) => {
                check(
                    "tolerance",
                    method.tolerance,
                    (1e-9..1.0).contains(&method.tolerance),
                    "from 1e-9 to 1",
                )?;
                not_negative("shifting", method.shifting)?;
            }
        }
        // Kernels divide by h⁹: far from metres that leaves the range of a double.
        let weight = self.particle_mass * Kernels::new(self.support_radius).poly6(0.0);
        check(
            "support_radius",
            self.support_radius,
            weight.is_normal(),
            "a length whose ninth power is a number",
        )
    }

    /// Distance between particles at rest, (m/ρ₀)^⅓, m.
    pub fn spacing(&self) -> f64 {
        (self.particle_mass / self.rest_density).cbrt()
    }

    /// Speed of sound, m/s: that of p = k(ρ − ρ₀) is √(dp/dρ) = √k; none if the method knows no compression.
    pub fn sound_speed(&self) -> f64 {
        match self.method {
            Method::Paper => self.stiffness.sqrt(),
            Method::Wcsph(method) => method.sound_speed,
            Method::Dfsph(_) => 0.0,
        }
    }

    /// Pressure of a density, Pa (equation 9, read as p = k(ρ − ρ₀): the printed p = κρ pushes a fluid apart
    /// even at rest).
    pub fn pressure(&self, density: f64) -> f64 {
        let p = self.stiffness * (density - self.rest_density);
        match self.negative_pressure {
            NegativePressure::Clamp => p.max(0.0),
            NegativePressure::Keep => p,
        }
    }

    /// The density that a pressure (Pa) belongs to, kg/m³: that at rest where the method knows no compression.
    pub fn density_under(&self, pressure: f64) -> f64 {
        match self.method {
            Method::Paper => self.rest_density + pressure / self.stiffness,
            Method::Wcsph(method) => {
                let stiffness = method.sound_speed.powi(2) * self.rest_density / 7.0;
                self.rest_density * (1.0 + pressure / stiffness).powf(1.0 / 7.0)
            }
            Method::Dfsph(_) => self.rest_density,
        }
    }

    /// The longest step, s, that is stable while no particle is faster than `max_speed` (m/s).
    ///
    /// The least of four limits:
    /// - sound and motion: h/4 / (c + max_speed);
    /// - viscosity: the relative velocity of two lone, coinciding particles decays at the rate
    ///   2·viscosity·m·∇²W(0)/ρ² with ρ = mW(0), the fastest the method can produce (denser
    ///   surroundings divide by larger ρ); one decay time, half of what an explicit step endures;
    /// - ripples under surface tension, where pressure is not that of the paper;
    /// - gravity: ¼√(h/g).
    ///
    /// Pressure forces have no bound before the run; see [`Simulation::stable_dt`](super::Simulation::stable_dt).
    pub fn stable_dt(&self, max_speed: f64) -> f64 {
        let courant = match self.method {
            Method::Dfsph(_) => ADVECTION * self.spacing() / max_speed,
            _ => COURANT * self.support_radius / (self.sound_speed() + max_speed),
        };
        courant.min(self.viscous_dt()).min(self.capillary_dt()).min(self.force_dt(self.gravity.length()))
    }

    /// How long a density that is off may take to come back, s, after a step of the length `dt` with this greatest speed; for
    /// methods that solve for the pressure, which they tell as a mean over this time.
    pub(super) fn relaxation_time(&self, speed: f64, dt: f64) -> f64 {
        let [moving, at_rest] = RELAXATION_STEPS;
        let fall = (self.support_radius / self.gravity.length()).sqrt();
        let falls =
            if fall.is_finite() { (RELAXATION_FALLS * fall).min(MOST_RELAXATION_STEPS * dt) } else { 0.0 };
        let slow = falls.max(at_rest * dt);
        let courant = (dt * speed / (ADVECTION * self.spacing())).min(1.0);
        slow + (moving * dt - slow) * courant
    }

    /// The longest step for an acceleration (m/s²): ¼√(h/a), s.
    pub fn force_dt(&self, acceleration: f64) -> f64 {
        let factor = if let Method::Dfsph(_) = self.method { IMPLICIT_FORCE_FACTOR } else { FORCE_FACTOR };
        factor * (self.support_radius / acceleration).sqrt()
    }

    /// The same for the acceleration that particles have now, pressure included.
    pub(super) fn present_force_dt(&self, acceleration: f64) -> f64 {
        let more = if let Method::Dfsph(_) = self.method {
            SOLVED_FORCE_FACTOR / IMPLICIT_FORCE_FACTOR
        } else {
            1.0
        };
        more * self.force_dt(acceleration)
    }

    /// ¼√(ρ(h/2)³/2πσ): a ripple as short as the smoothing length (Brackbill et al. 1992), s. The paper's method has none.
    fn capillary_dt(&self) -> f64 {
        if matches!(self.method, Method::Paper) {
            return f64::INFINITY;
        }
        let ripple =
            self.rest_density * (0.5 * self.support_radius).powi(3) / (2.0 * PI * self.surface_tension);
        0.25 * ripple.sqrt()
    }

    fn viscous_dt(&self) -> f64 {
        let h = self.support_radius;
        if !matches!(self.method, Method::Paper) {
            // ⅛·(h/2)²/ν (Morris et al. 1997)
            return 0.125 * (0.5 * h).powi(2) * self.rest_density / self.viscosity;
        }
        let lone_density = self.particle_mass * 315.0 / (64.0 * PI * h.powi(3));
        let laplacian = 45.0 / (PI * h.powi(5));
        lone_density.powi(2) / (2.0 * self.viscosity * self.particle_mass * laplacian)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_1_is_valid() {
        assert_eq!(Parameters::default().validate(), Ok(()));
    }

    #[test]
    fn each_wrong_value_is_named() {
        let check = |change: fn(&mut Parameters), name: &str| {
            let mut parameters = Parameters::default();
            change(&mut parameters);
            assert_eq!(parameters.validate().map_err(|e| e.name), Err(name));
        };
        check(|p| p.rest_density = 0.0, "rest_density");
        check(|p| p.particle_mass = f64::NAN, "particle_mass");
        check(|p| p.support_radius = -0.1, "support_radius");
        check(|p| p.support_radius = 1e-60, "support_radius");
        check(|p| p.stiffness = f64::INFINITY, "stiffness");
        check(|p| p.viscosity = -1.0, "viscosity");
        check(|p| p.wall_restitution = 1.5, "wall_restitution");
        check(|p| p.gravity.y = f64::NAN, "gravity");
        check(|p| p.time_step = 0.0, "time_step");
        let error = Parameters { viscosity: -1.0, ..Parameters::default() }.validate().unwrap_err();
        assert_eq!(error.to_string(), "viscosity is -1, expected a finite number of at least 0");
    }

    #[test]
    fn pressure_below_rest_density_is_zero_unless_kept() {
        let mut parameters = Parameters::default();
        assert_eq!(parameters.pressure(500.0), 0.0);
        parameters.negative_pressure = NegativePressure::Keep;
        assert_eq!(parameters.pressure(500.0), 3.0 * (500.0 - 998.29));
    }

    #[test]
    fn the_papers_step_exceeds_the_stable_one_of_its_scene() {
        let parameters = Parameters::default();
        let fall = (2.0f64 * 9.81 * 3.0).sqrt();
        let dt = parameters.stable_dt(fall);
        assert!(parameters.time_step < dt && dt < 0.003, "{dt}");
        // without sound and motion the viscous limit remains: 4.8 ms
        assert!(parameters.viscous_dt() < 0.005);
    }
}
