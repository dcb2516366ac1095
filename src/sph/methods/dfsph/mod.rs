//! The divergence-free method: its numbers, keys and limits. The scheme is in [`scheme`].

mod ahead;
mod arrest;
mod carried;
mod corrected;
mod full;
mod gaps;
mod hydrostatic;
mod mirrored;
mod pace;
mod passes;
mod relaxation;
mod rigid;
mod scheme;
mod solver;
mod start;
mod walls;

pub(super) use start::spread;

use super::declaration::{Absence, Declaration, FluidDefaults, Key, KeyBlock, Support, Value};
use super::numerics::{Noted, Numerics};
use super::roughness;
use crate::precision::Precision;
use crate::quantity::{Bound, Dimension};
use crate::sph::pass::Pass;
use crate::sph::scales::Scales;
use crate::sph::walls::{Wall, WallKernel};

/// The speed of sound in the artificial viscosity, over the greatest expected speed. It is that of a weakly
/// compressible fluid, so that the same α damps as much.
const NOMINAL_SOUND: f64 = 10.0;

/// Part of the spacing that a particle may cross in one step of a method without sound: the customary 0.4.
const ADVECTION: f64 = 0.4;

/// Factor of √(h/a) at the beginning of a run, when a still contains the acceleration that pressure will
/// cancel.
const IMPLICIT_FORCE_FACTOR: f64 = 0.1;

/// Factor of √(h/a) once the pressure is known and its acceleration is part of a. With 0.25 a column of forty
/// layers bursts at its start.
const SOLVED_FORCE_FACTOR: f64 = 0.15;

/// Strength of the shifting in a fluid that fills its vessel. Flows between cylinders and vortices were off by up to 1.5
/// times as much with a third of it, when walls counted in the corrections by their normals alone. With twice as much
/// displacements cannot hold the densities in a tank that moves.
const SHIFTING_IN_FULL: f64 = 0.3;

/// The support radius of a fluid with surface tension.
const WITH_TENSION: Support = Support::Spacings(3.0);

/// Numbers of the divergence-free method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dfsph {
    /// Mean excess of the density that is accepted, as a part of the rest density. One particle in two
    /// hundred may exceed it by more than ten times as much. Default 1e-4.
    pub tolerance: f64,
    /// Maximum number of iterations of each of the two solves in one step. A solve that begins without a
    /// known pressure, as in the first step, may take thirty times as many. Default 100.
    pub most_iterations: u32,
    /// α of the artificial viscosity (Monaghan 1992), for a speed of sound of ten times the greatest expected
    /// speed. Default 0.06; zero: the term is not computed.
    pub artificial_viscosity: f64,
    /// Strength of the drift of particles to where there are fewer of them. Default 0.3 in a fluid that fills its
    /// vessel, whose corrected sums make no order, else 0: no drift. In a fluid with a surface a strength of
    /// 1 halves the deviation at rest, and makes that of a shear flow two to three times as large. In a full vessel
    /// strengths from 0.6 on overshoot.
    pub shifting: Option<f64>,
    /// Whether the fluid fills all its room, so that it drifts unless a strength is stated.
    pub fills_room: bool,
}

impl Default for Dfsph {
    fn default() -> Self {
        Self {
            tolerance: 1e-4,
            most_iterations: 100,
            artificial_viscosity: 0.06,
            shifting: None,
            fills_room: false,
        }
    }
}

impl Dfsph {
    /// The strength of the shifting, stated or derived.
    fn shifting_in(&self, is_full: bool) -> f64 {
        self.shifting.unwrap_or(if is_full { SHIFTING_IN_FULL } else { 0.0 })
    }
}

impl Declaration for Dfsph {
    const NAME: &'static str = "dfsph";
    const TITLE: &'static str = "Divergence-free";
    const PRESSURE: &'static str = "solved for, so that nothing is compressed";
    const KERNEL: &'static str = "Wendland C2; 45";
    const STEP: &'static str = "adaptive";
    const FLUID: FluidDefaults = FluidDefaults {
        viscosity: 1e-3,
        surface_tension: 0.0,
        particles: Some(10_000),
        // many neighbours make the solver slow
        support: Support::Spacings(2.2),
        precision: Precision::F32,
        adaptive: true,
    };
    const KEYS: &'static [Key<Self>] = &[
        Key {
            name: "compression",
            block: KeyBlock::Solver,
            about: "mean excess of the density that is accepted, as a part of it",
            value: Value::Number {
                dimension: Dimension::NONE,
                bound: Bound::From(1e-9, 1.0),
                get: |dfsph| Some(dfsph.tolerance),
                set: |dfsph, tolerance| dfsph.tolerance = tolerance,
                derived: "",
            },
        },
        Key {
            name: "iterations",
            block: KeyBlock::Solver,
            about: "iterations of a step's solver, at most; thirty times as many where no pressure is known, as in the first step",
            value: Value::Count {
                least: 1,
                get: |dfsph| dfsph.most_iterations,
                set: |dfsph, iterations| dfsph.most_iterations = iterations,
            },
        },
        Key {
            name: "artificial_viscosity",
            block: KeyBlock::Fluid,
            about: "α of the artificial viscosity, which damps noise",
            value: Value::Number {
                dimension: Dimension::NONE,
                bound: Bound::NotNegative,
                get: |dfsph| Some(dfsph.artificial_viscosity),
                set: |dfsph, alpha| dfsph.artificial_viscosity = alpha,
                derived: "",
            },
        },
        Key {
            name: "shifting",
            block: KeyBlock::Fluid,
            about: "how strongly particles drift to where there are fewer of them",
            value: Value::Number {
                dimension: Dimension::NONE,
                bound: Bound::NotNegative,
                get: |dfsph| dfsph.shifting,
                set: |dfsph, strength| dfsph.shifting = Some(strength),
                derived: "0.3 in a fluid that fills its vessel, else 0",
            },
        },
    ];
    const PASSES: &'static [(Pass, Absence<Self>)] = &[
        (Pass::Coverage, |_, _| None),
        (Pass::Density, |_, _| None),
        (Pass::Pressure, |_, _| Some("the method solves for the pressure")),
        (Pass::PressureSolver, |_, _| None),
        (Pass::Viscosity, |_, scales| Pass::without_viscosity(scales)),
        (Pass::ArtificialViscosity, |dfsph, _| {
            (dfsph.artificial_viscosity == 0.0).then_some("the artificial viscosity is zero")
        }),
        (Pass::Shifting, |dfsph, _| {
            (dfsph.shifting_in(dfsph.fills_room) == 0.0).then_some("the shifting is zero")
        }),
        (Pass::NoSlip, |_, scales| Pass::without_friction(scales)),
        (Pass::SurfaceTension, |_, scales| Pass::without_tension(scales)),
    ];
    const OTHER_SUPPORT: Option<(Support, &'static str)> = Some((WITH_TENSION, "with surface tension"));

    /// A scene that says how strongly particles drift does not ask for more.
    fn settle(&mut self, has_surface: &dyn Fn() -> bool) {
        self.fills_room = self.shifting.is_none() && !has_surface();
    }

    /// Normals and curvature need a smooth surface: with 2.2 spacings a drop never stops stirring itself.
    fn support(&self, has_tension: bool) -> Support {
        if has_tension { WITH_TENSION } else { Self::FLUID.support }
    }

    const SAVES: &'static [&'static str] = &[
        "specific pressure",
        "debt",
        "own pressure",
        "pressure ahead",
        "step ahead",
        "velocity of the vessel",
        "stiffness",
        "last step",
        "closed bodies",
        "room at the start",
        "crowding x",
        "crowding y",
        "crowding z",
        "smooth velocity x",
        "smooth velocity y",
        "smooth velocity z",
        "pace",
    ];
}

impl Numerics for Dfsph {
    fn numerical_viscosity(&self, scales: &Scales) -> f64 {
        let sound = NOMINAL_SOUND * scales.expected_speed;
        let alpha = self.artificial_viscosity.max(Self::default().artificial_viscosity);
        roughness::viscosity(alpha, sound, scales.support_radius)
    }

    /// Its pressures act in pairs.
    fn drag_is_too_large(&self) -> bool {
        true
    }

    fn sound_speed(&self, _scales: &Scales) -> f64 {
        0.0
    }

    fn courant_dt(&self, scales: &Scales, max_speed: f64) -> f64 {
        ADVECTION * scales.spacing() / max_speed
    }

    fn force_factor(&self) -> f64 {
        IMPLICIT_FORCE_FACTOR
    }

    fn present_force_gain(&self) -> f64 {
        SOLVED_FORCE_FACTOR / IMPLICIT_FORCE_FACTOR
    }

    /// Walls consist of layers, because only with layers does a divergence-free fluid at rest have the right
    /// distance from a wall. (Differences of pressure are steady only at a continuous wall; with layers a
    /// standing wave of `wcsph` grows noise at the walls.)
    fn wall(&self, scales: &Scales) -> Wall {
        Wall::in_layers(WallKernel::WendlandC2, scales.support_radius, scales.spacing())
    }

    /// The first solve of places spreads crowded particles.
    fn makes_room_at_start(&self) -> bool {
        true
    }

    fn elastic_energy(&self, _scales: &Scales, _density: f64) -> f64 {
        0.0
    }

    fn kept_compression(&self) -> Option<f64> {
        Some(self.tolerance)
    }

    fn keeps_density(&self) -> bool {
        true
    }

    /// Forces at the present places change the velocities, which then move the particles.
    fn is_staggered(&self) -> bool {
        true
    }

    fn noted(&self) -> Noted {
        Noted::Forces
    }
}
