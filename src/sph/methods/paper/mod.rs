//! The method of the paper (equations 8–14), corrected: its numbers, keys and limits. The scheme is in
//! [`scheme`].

mod scheme;

use std::f64::consts::PI;

use super::declaration::{Absence, Declaration, FluidDefaults, Key, KeyBlock, Support, Value};
use super::negative_pressure::NegativePressure;
use super::numerics::Numerics;
use crate::precision::Precision;
use crate::quantity::{Bound, Dimension};
use crate::sph::pass::Pass;
use crate::sph::scales::Scales;
use crate::sph::walls::{Wall, WallKernel};

/// Numbers of the paper's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paper {
    /// Stiffness k of p = k(ρ − ρ₀), m²/s² = J/kg. 3.0 (table 1): the speed of sound is √k = 1.7 m/s, so the
    /// fluid is far softer than water and long steps are stable. Zero: there is no pressure.
    pub stiffness: f64,
    /// Threshold l on |∇c|, 1/m, above which a particle counts as surface. 7.065 (table 1) = √(ρ₀/20 kg/m³).
    pub surface_threshold: f64,
    /// The treatment of negative pressures. By default they are cut off at zero.
    pub negative_pressure: NegativePressure,
}

impl Default for Paper {
    fn default() -> Self {
        Self { stiffness: 3.0, surface_threshold: 7.065, negative_pressure: NegativePressure::Clamp }
    }
}

impl Paper {
    /// Pressure of a density, Pa (equation 9, read as p = k(ρ − ρ₀): the printed p = κρ pushes a fluid apart
    /// even at rest). Densities are in kg/m³.
    pub fn pressure(&self, density: f64, rest_density: f64) -> f64 {
        self.negative_pressure.of(self.stiffness * (density - rest_density))
    }
}

const POSITIONS_ONLY: &str = "in this method walls act on positions and velocities only";

impl Declaration for Paper {
    const NAME: &'static str = "paper";
    const TITLE: &'static str = "Equations 8–14 of the paper, corrected";
    const PRESSURE: &'static str = "k(ρ − ρ₀), the paper's equations 8–14, corrected";
    const KERNEL: &'static str = "poly6, spiky, viscosity; 200";
    const STEP: &'static str = "fixed";
    const FLUID: FluidDefaults = FluidDefaults {
        viscosity: 3.5,
        surface_tension: 0.0728,
        particles: None,
        support: Support::Metres(0.1),
        precision: Precision::F64,
        adaptive: false,
    };
    const KEYS: &'static [Key<Self>] = &[
        Key {
            name: "stiffness",
            block: KeyBlock::Fluid,
            about: "k of the equation of state p = k(ρ − ρ₀)",
            value: Value::Number {
                dimension: Dimension::SPECIFIC_ENERGY,
                bound: Bound::NotNegative,
                get: |paper| Some(paper.stiffness),
                set: |paper, stiffness| paper.stiffness = stiffness,
                derived: "",
            },
        },
        Key {
            name: "threshold",
            block: KeyBlock::Fluid,
            about: "gradient of the colour field above which a particle belongs to the surface",
            value: Value::Number {
                dimension: Dimension::PER_LENGTH,
                bound: Bound::Positive,
                get: |paper| Some(paper.surface_threshold),
                set: |paper, threshold| paper.surface_threshold = threshold,
                derived: "",
            },
        },
        Key {
            name: "negative_pressure",
            block: KeyBlock::Fluid,
            about: "whether pressure may pull (keep) or is cut off at zero (clamp)",
            value: Value::Word {
                words: &[
                    ("clamp", |paper| paper.negative_pressure = NegativePressure::Clamp),
                    ("keep", |paper| paper.negative_pressure = NegativePressure::Keep),
                ],
                get: |paper| paper.negative_pressure.name(),
                derived: "",
            },
        },
    ];
    const PASSES: &'static [(Pass, Absence<Self>)] = &[
        (Pass::Coverage, |_, _| Some(POSITIONS_ONLY)),
        (Pass::Density, |_, _| None),
        (Pass::Pressure, |paper, _| (paper.stiffness == 0.0).then_some("the stiffness is zero")),
        (Pass::PressureSolver, |_, _| Some(Pass::STATE)),
        (Pass::Viscosity, |_, scales| Pass::without_viscosity(scales)),
        (Pass::NoSlip, |_, _| Some(POSITIONS_ONLY)),
        (Pass::SurfaceTension, |_, scales| Pass::without_tension(scales)),
    ];
    const SAVES: &'static [&'static str] = &[];
}

impl Numerics for Paper {
    /// Zero, because the viscosity of this method is the fluid's own.
    fn numerical_viscosity(&self, _scales: &Scales) -> f64 {
        0.0
    }

    /// False: its fluid is as viscous as the paper's, which causes more drag than the method does.
    fn drag_is_too_large(&self) -> bool {
        false
    }

    /// The speed of sound √(dp/dρ) = √k.
    fn sound_speed(&self, _scales: &Scales) -> f64 {
        self.stiffness.sqrt()
    }

    /// One decay time of the relative velocity of two lone, coinciding particles: half of the longest stable
    /// explicit step. The velocity decays at the rate 2·viscosity·m·∇²W(0)/ρ² with ρ = mW(0), the fastest
    /// that the method can produce, because denser surroundings divide by a larger ρ.
    fn viscous_dt(&self, scales: &Scales) -> f64 {
        let (h, mass) = (scales.support_radius, scales.particle_mass);
        let lone_density = mass * 315.0 / (64.0 * PI * h.powi(3));
        let laplacian = 45.0 / (PI * h.powi(5));
        lone_density.powi(2) / (2.0 * scales.viscosity * mass * laplacian)
    }

    /// No limit: the paper's method has none for surface tension.
    fn capillary_dt(&self, _scales: &Scales) -> f64 {
        f64::INFINITY
    }

    fn walls_have_density(&self) -> bool {
        false
    }

    fn wall(&self, scales: &Scales) -> Wall {
        Wall::new(WallKernel::Poly6, scales.support_radius, scales.spacing())
    }

    /// The energy k(ln x + 1/x − 1) with x = ρ/ρ₀.
    fn elastic_energy(&self, scales: &Scales, density: f64) -> f64 {
        let x = density / scales.rest_density;
        if x < 1.0 && self.negative_pressure == NegativePressure::Clamp {
            return 0.0;
        }
        self.stiffness * (x.ln() + 1.0 / x - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sph::params::Parameters;

    #[test]
    fn pressure_below_rest_density_is_zero_unless_kept() {
        let mut paper = Paper::default();
        assert_eq!(paper.pressure(500.0, 998.29), 0.0);
        paper.negative_pressure = NegativePressure::Keep;
        assert_eq!(paper.pressure(500.0, 998.29), 3.0 * (500.0 - 998.29));
    }

    #[test]
    fn the_papers_step_exceeds_the_stable_one_of_its_scene() {
        let parameters = Parameters::paper();
        let fall = (2.0f64 * 9.81 * 3.0).sqrt();
        let dt = parameters.stable_dt(fall);
        assert!(parameters.time_step < dt && dt < 0.003, "{dt}");
        // without sound and motion the viscous limit remains: 4.8 ms
        assert!(Paper::default().viscous_dt(&parameters.scales()) < 0.005);
    }
}
