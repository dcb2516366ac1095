//! The weakly compressible method: its numbers, keys and limits. The scheme is in [`scheme`].

mod at_edges;
mod leaving;
mod linear;
mod numbers;
mod passes;
mod rates;
mod scheme;

use super::declaration::{Absence, Declaration, FluidDefaults, Key, KeyBlock, Support, Value};
use super::negative_pressure::NegativePressure;
use super::numerics::{COURANT, Noted, Numerics, StatedSound};
use super::roughness;
use crate::precision::Precision;
use crate::quantity::{Bound, Dimension};
use crate::sph::error::ParameterError;
use crate::sph::pass::Pass;
use crate::sph::scales::Scales;

/// The exponent of Tait's equation for water.
const EXPONENT: i32 = 7;

/// Surface tension counts if its speed √(σ/ρa) over a spacing a is more than this part of the expected speed.
const CAPILLARY: f64 = 0.05;

/// Default α of the artificial viscosity with pairs of pressures.
const PAIRS_ALPHA: f64 = 0.1;

/// Default α with differences. A fluid that is more viscous than this needs no artificial viscosity.
const DIFFERENCES_ALPHA: f64 = 0.02;

/// A fluid's own viscosity reduces the artificial one if it is at least this part of it. Water has far less.
const THIN: f64 = 0.01;

/// Default speed of sound over the greatest expected speed. It keeps changes of the density within 1 %.
const SOUND_OVER_SPEED: f64 = 10.0;

/// The greatest expected pressure of a creeping flow over μu/a.
const MOST_SQUEEZED: f64 = 10.0;

/// How the pressures of two particles enter their acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gradients {
    /// Sums p_i + p_j: what one particle gains, the other loses, so momentum is conserved to rounding.
    #[default]
    Pairs,
    /// Differences p_j − p_i in the fluid's depth: exact where the pressure is linear in space, and better
    /// than pairs in viscous flows and those without a free surface. They need shifting and, at a free
    /// surface, an artificial viscosity of some 0.05: without it, waves gain energy.
    Differences,
}

/// Numbers of the weakly compressible method.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wcsph {
    /// Speed of sound c, m/s. `None`: ten times √(u² + σ/ρa), with the greatest expected speed u, and the
    /// surface tension σ over a spacing a, or √(10νu/a) where that is more and costs no steps. This keeps changes of
    /// the density within 1 %.
    pub sound_speed: Option<f64>,
    /// δ of the density diffusion (Molteni & Colagrossi 2009). `None`: 0.1, and 0 where surface tension moves
    /// the fluid; zero: the term is not computed.
    pub density_diffusion: Option<f64>,
    /// α of the artificial viscosity (Monaghan 1992). With pairs of pressures it acts on rough motion alone.
    /// With differences it acts on all motion, which would gain energy without it. `None`: 0.1 with pairs,
    /// 0.02 with differences, less what the fluid's own viscosity damps; zero: the term is not computed.
    pub artificial_viscosity: Option<f64>,
    /// How the pressures of two particles enter their acceleration. `None`: by differences in a fluid that fills
    /// its room, else in pairs.
    pub gradients: Option<Gradients>,
    /// Strength of the drift of particles to where there are fewer of them, which keeps them evenly
    /// distributed. Zero: no drift. `None`: 1 with differences of pressure, 0 with sums.
    pub shifting: Option<f64>,
    /// The treatment of negative pressures. `None`: they are kept in a fluid that fills its room and has
    /// gradients by differences, else cut off at zero. Without a surface, only differences of pressure matter.
    pub negative_pressure: Option<NegativePressure>,
    /// Whether the fluid fills all room of its scene, at all times, so that it has no surface. It is no key: an
    /// [`Experiment`](crate::experiment::Experiment) finds it before there are particles, and overwrites what is
    /// set here. [`Parameters::fills_vessel`](crate::sph::Parameters::fills_vessel) is about the particles of a
    /// start.
    pub fills_room: bool,
    /// Whether the fluid starts under the pressure of its own weight. If not, it starts without pressure, and
    /// oscillates.
    pub hydrostatic_start: bool,
}

/// The keys that rule out differences of pressure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ClampedBy {
    /// `gradients: pairs`
    Pairs,
    /// `shifting: 0`, without which there are no differences.
    NoShifting,
    /// Both of them.
    Both,
}

impl Wcsph {
    /// δ of the density diffusion, stated or derived. Surface tension acts on a layer of particles, so the
    /// density grows with the depth in that layer. Diffusion levels this growth out of step with the motion,
    /// and a drop gains energy, whether it oscillates or rests. So there is no diffusion unless waves of the
    /// particles' size are much slower than the fluid, or there is no surface that they could move.
    fn density_diffusion(&self, scales: &Scales) -> f64 {
        let moves = !self.fills_room && ripples(scales) > CAPILLARY * scales.expected_speed;
        self.density_diffusion.unwrap_or(if moves { 0.0 } else { 0.1 })
    }

    /// The speed √(u² + σ/ρa), m/s, of the expected speed u and of ripples. Its square times the rest density
    /// is the greatest expected pressure. Surface tension presses with 2σ/r on a drop of the radius r, which
    /// is at least two spacings a.
    fn driven_speed(&self, scales: &Scales) -> f64 {
        scales.expected_speed.hypot(ripples(scales))
    }

    /// The speed √(10νu/a), m/s, whose square times the rest density is a pressure that viscosity may need to drive
    /// fluid out of a narrow place: ten times μu/a, with the spacing a. Sound that is ten times as fast makes no step
    /// shorter, because the speed ends where steps would be those that viscosity allows. (With sound of ten times the
    /// fluid's speed, honey below a plate that sank into it was a gas and bore a thirtieth of the load, and the drag of
    /// a ball in a tube was 18 and 65 % too small.)
    fn creeping_speed(&self, scales: &Scales) -> f64 {
        if scales.viscosity == 0.0 {
            return 0.0;
        }
        let Scales { rest_density, viscosity, expected_speed, support_radius, .. } = *scales;
        let driven = (MOST_SQUEEZED * viscosity * expected_speed / (rest_density * scales.spacing())).sqrt();
        let free = COURANT * support_radius / self.viscous_dt(scales) - expected_speed;
        driven.min(free / SOUND_OVER_SPEED)
    }

    /// α of the artificial viscosity, stated or derived. It is reduced by the fluid's own viscosity, which
    /// damps already. (In a ring ten spacings wide, a flow with half as much artificial viscosity as its own
    /// is 24 % too slow, and 14 % without it.)
    fn artificial_viscosity(&self, scales: &Scales) -> f64 {
        self.artificial_viscosity.unwrap_or_else(|| {
            let alpha = match self.gradients() {
                Gradients::Pairs => PAIRS_ALPHA,
                Gradients::Differences => DIFFERENCES_ALPHA,
            };
            let artificial = roughness::viscosity(alpha, self.sound_speed(scales), scales.support_radius);
            let own = scales.viscosity / (scales.rest_density * artificial);
            if own < THIN { alpha } else { alpha * (1.0 - own).max(0.0) }
        })
    }

    /// The support radius where pressures act by differences, which need no more, or where surface tension
    /// needs the curvature of a surface on a small scale.
    const NEAR: Support = Support::Spacings(2.6);

    /// How pressures enter accelerations: as stated, else as suits a fluid with or without a surface.
    pub fn gradients(&self) -> Gradients {
        self.gradients.unwrap_or(if self.fills_room { Gradients::Differences } else { Gradients::Pairs })
    }

    /// The treatment of negative pressures, stated or derived.
    pub fn negative_pressure(&self) -> NegativePressure {
        self.negative_pressure.unwrap_or(if self.fills_room && self.gradients() == Gradients::Differences {
            NegativePressure::Keep
        } else {
            NegativePressure::Clamp
        })
    }

    /// What rules out differences of pressure where they would be the default, so that negative pressures are cut off
    /// although nothing says so.
    pub(crate) fn clamped_by(&self) -> Option<ClampedBy> {
        let by = match (self.gradients, self.shifting) {
            (Some(Gradients::Pairs), Some(0.0)) => Some(ClampedBy::Both),
            (Some(Gradients::Pairs), _) => Some(ClampedBy::Pairs),
            (None, Some(0.0)) => Some(ClampedBy::NoShifting),
            (None | Some(Gradients::Differences), _) => None,
        };
        by.filter(|_| self.negative_pressure.is_none())
    }

    /// The strength of the shifting, stated or derived.
    pub fn shifting(&self) -> f64 {
        self.shifting.unwrap_or(match self.gradients() {
            Gradients::Pairs => 0.0,
            Gradients::Differences => 1.0,
        })
    }
}

impl Declaration for Wcsph {
    const NAME: &'static str = "wcsph";
    const TITLE: &'static str = "Weakly compressible";
    const PRESSURE: &'static str = "Tait's equation, density from the motion";
    const KERNEL: &'static str = "Wendland C2; 113";
    const STEP: &'static str = "adaptive";
    const FLUID: FluidDefaults = FluidDefaults {
        viscosity: 1e-3,
        surface_tension: 0.0,
        particles: Some(10_000),
        // many neighbours make pressures smooth, and let rows of particles slide past each other
        support: Support::Spacings(3.0),
        precision: Precision::F32,
        adaptive: true,
    };
    const KEYS: &'static [Key<Self>] = &[
        Key {
            name: "sound_speed",
            block: KeyBlock::Fluid,
            about: "speed of sound: the higher, the less the fluid is compressed, and the shorter are the steps",
            value: Value::Number {
                dimension: Dimension::SPEED,
                bound: Bound::Positive,
                get: |wcsph| wcsph.sound_speed,
                set: |wcsph, speed| wcsph.sound_speed = Some(speed),
                derived: "ten times the greatest expected speed u; with surface tension ten times √(u² + σ/ρa), with the spacing a; in a creeping flow 10√(10νu/a), as far as that costs no steps",
            },
        },
        Key {
            name: "density_diffusion",
            block: KeyBlock::Fluid,
            about: "δ of the density diffusion, which smooths pressures",
            value: Value::Number {
                dimension: Dimension::NONE,
                bound: Bound::NotNegative,
                get: |wcsph| wcsph.density_diffusion,
                set: |wcsph, delta| wcsph.density_diffusion = Some(delta),
                derived: "0.1, and 0 where surface tension moves the fluid",
            },
        },
        Key {
            name: "artificial_viscosity",
            block: KeyBlock::Fluid,
            about: "α of the artificial viscosity, which damps noise; with gradients by differences it damps waves too",
            value: Value::Number {
                dimension: Dimension::NONE,
                bound: Bound::NotNegative,
                get: |wcsph| wcsph.artificial_viscosity,
                set: |wcsph, alpha| wcsph.artificial_viscosity = Some(alpha),
                derived: "0.1 with pairs, 0.02 with differences, less what the fluid's own viscosity damps",
            },
        },
        Key {
            name: "gradients",
            block: KeyBlock::Fluid,
            about: "pairs conserve momentum; differences are exact for linear pressures in the fluid's depth",
            value: Value::Word {
                words: &[
                    ("pairs", |wcsph| wcsph.gradients = Some(Gradients::Pairs)),
                    ("differences", |wcsph| wcsph.gradients = Some(Gradients::Differences)),
                ],
                get: |wcsph| match wcsph.gradients() {
                    Gradients::Pairs => "pairs",
                    Gradients::Differences => "differences",
                },
                derived: "differences in a fluid that fills all its room, unless `shifting` is 0, else pairs",
            },
        },
        Key {
            name: "shifting",
            block: KeyBlock::Fluid,
            about: "how strongly particles drift to where there are fewer of them; gradients by differences need it, so 0 makes them pairs unless they are stated",
            value: Value::Number {
                dimension: Dimension::NONE,
                bound: Bound::NotNegative,
                get: |wcsph| wcsph.shifting,
                set: |wcsph, strength| wcsph.shifting = Some(strength),
                derived: "1 with differences, 0 with pairs",
            },
        },
        Key {
            name: "negative_pressure",
            block: KeyBlock::Fluid,
            about: "whether pressure may pull (keep) or is cut off at zero (clamp)",
            value: Value::Word {
                words: &[
                    ("clamp", |wcsph| wcsph.negative_pressure = Some(NegativePressure::Clamp)),
                    ("keep", |wcsph| wcsph.negative_pressure = Some(NegativePressure::Keep)),
                ],
                get: |wcsph| wcsph.negative_pressure().name(),
                derived: "keep in a fluid that fills all its room and has gradients by differences, else clamp",
            },
        },
        Key {
            name: "start",
            block: KeyBlock::Fluid,
            about: "under no pressure (free), or under that of the fluid's own weight (hydrostatic)",
            value: Value::Word {
                words: &[
                    ("free", |wcsph| wcsph.hydrostatic_start = false),
                    ("hydrostatic", |wcsph| wcsph.hydrostatic_start = true),
                ],
                get: |wcsph| if wcsph.hydrostatic_start { "hydrostatic" } else { "free" },
                derived: "",
            },
        },
    ];
    const PASSES: &'static [(Pass, Absence<Self>)] = &[
        (Pass::Coverage, |_, _| None),
        (Pass::Density, |_, _| None),
        (Pass::DensityDiffusion, |wcsph, scales| {
            (wcsph.density_diffusion(scales) == 0.0).then_some("the density diffusion is zero")
        }),
        (Pass::Pressure, |_, _| None),
        (Pass::PressureSolver, |_, _| Some(Pass::STATE)),
        (Pass::Viscosity, |_, scales| Pass::without_viscosity(scales)),
        (Pass::ArtificialViscosity, |wcsph, scales| {
            (wcsph.artificial_viscosity(scales) == 0.0).then_some("the artificial viscosity is zero")
        }),
        (Pass::Shifting, |wcsph, _| (wcsph.shifting() == 0.0).then_some("the shifting is zero")),
        (Pass::NoSlip, |_, scales| Pass::without_friction(scales)),
        (Pass::SurfaceTension, |_, scales| Pass::without_tension(scales)),
    ];
    const SAVES: &'static [&'static str] = &[
        "places",
        "density rate",
        "earlier density rate",
        "density drift",
        "missing before a surface",
        "last step",
        "crowding x",
        "crowding y",
        "crowding z",
        "smooth velocity x",
        "smooth velocity y",
        "smooth velocity z",
        "part of walls",
        "rate of that part",
    ];
    const OTHER_SUPPORT: Option<(Support, &'static str)> =
        Some((Self::NEAR, "with surface tension or `gradients: differences`"));

    /// Pairs are for splashes and waves, which a fluid without a surface does not have. It has vortices and
    /// layers that slide along each other, and there pairs of pressures push particles about: they resist in a
    /// channel 13 % too much, take half of the energy of vortices in four seconds, and add a half to the mass
    /// that a swinging ball moves.
    fn settle(&mut self, has_surface: &dyn Fn() -> bool) {
        let takes_differences = match self.gradients {
            Some(stated) => stated == Gradients::Differences,
            None => self.shifting != Some(0.0),
        };
        self.fills_room = takes_differences && !has_surface();
    }

    fn support(&self, has_tension: bool) -> Support {
        if has_tension || self.gradients() == Gradients::Differences {
            Self::NEAR
        } else {
            Self::FLUID.support
        }
    }
}

/// The speed √(σ/ρa) of surface tension over a spacing a, m/s.
fn ripples(scales: &Scales) -> f64 {
    (scales.surface_tension / (scales.rest_density * scales.spacing())).sqrt()
}

impl Numerics for Wcsph {
    fn numerical_viscosity(&self, scales: &Scales) -> f64 {
        let alpha = self.artificial_viscosity.unwrap_or(PAIRS_ALPHA).max(PAIRS_ALPHA);
        roughness::viscosity(alpha, self.sound_speed(scales), scales.support_radius)
    }

    /// With differences the pressures on a surface are right.
    fn drag_is_too_large(&self) -> bool {
        self.gradients() == Gradients::Pairs
    }

    fn stated_sound(&self, scales: &Scales) -> Option<StatedSound> {
        let driven_speed = self.driven_speed(scales);
        self.sound_speed.map(|sound_speed| StatedSound { sound_speed, driven_speed })
    }

    fn validate(&self, scales: &Scales) -> Result<(), ParameterError> {
        let found = self.sound_speed(scales);
        if Bound::Positive.admits(found) {
            return Ok(());
        }
        Err(ParameterError { name: "sound_speed", found, expected: Bound::Positive.to_string() })
    }

    fn sound_speed(&self, scales: &Scales) -> f64 {
        let derived = || SOUND_OVER_SPEED * self.driven_speed(scales).max(self.creeping_speed(scales));
        self.sound_speed.unwrap_or_else(derived)
    }

    /// The compression of a fluid at its greatest speed, whatever speed of sound a scene states.
    fn kept_compression(&self) -> Option<f64> {
        Some(SOUND_OVER_SPEED.powi(-2))
    }

    /// The density ρ₀(1 + 7p/(c²ρ₀))^(1/7), the inverse of Tait's equation.
    fn density_at_start(&self, scales: &Scales, pressure: f64) -> Option<f64> {
        let stiffness = self.sound_speed(scales).powi(2) * scales.rest_density / 7.0;
        self.hydrostatic_start.then(|| scales.rest_density * (1.0 + pressure / stiffness).powf(1.0 / 7.0))
    }

    fn makes_room_at_start(&self) -> bool {
        true
    }

    /// The energy ∫ p/ρ₀² dρ = c²/7·((x⁸ − 1)/8 − (x − 1)) with x = ρ/ρ₀, whose gradient is the acceleration
    /// by pressure. It differs from ∫ p/ρ² dρ by twice the compression.
    fn elastic_energy(&self, scales: &Scales, density: f64) -> f64 {
        let x = density / scales.rest_density;
        if x < 1.0 && self.negative_pressure() == NegativePressure::Clamp {
            return 0.0;
        }
        self.sound_speed(scales).powi(2) / 7.0 * ((x.powi(8) - 1.0) / 8.0 - (x - 1.0))
    }

    /// Differences of pressure do not cancel, so the neighbours of a particle contribute to what remains.
    fn noted(&self) -> Noted {
        match self.gradients() {
            Gradients::Pairs => Noted::Forces,
            Gradients::Differences => Noted::Friction,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Water has the full artificial viscosity, a thick fluid only what its own viscosity leaves of it, and a
    /// thicker one none.
    #[test]
    fn what_a_fluid_damps_itself_is_not_damped_again() {
        let of = |viscosity: f64| Scales {
            rest_density: 1000.0,
            particle_mass: 1e-3,
            support_radius: 0.03,
            viscosity,
            surface_tension: 0.0,
            expected_speed: 3.0,
            sticks: false,
        };
        for (gradients, usual) in
            [(Gradients::Pairs, PAIRS_ALPHA), (Gradients::Differences, DIFFERENCES_ALPHA)]
        {
            let wcsph = Wcsph { gradients: Some(gradients), ..Wcsph::default() };
            let alpha = |viscosity: f64| wcsph.artificial_viscosity(&of(viscosity));
            let own = 1000.0 * roughness::viscosity(usual, wcsph.sound_speed(&of(0.0)), 0.03);
            assert_eq!((alpha(0.0), alpha(1e-3)), (usual, usual));
            for part in [0.25, 0.9] {
                assert!((alpha(part * own) - (1.0 - part) * usual).abs() < 1e-12 * usual, "{part}");
            }
            assert_eq!((alpha(own), alpha(10.0 * own)), (0.0, 0.0));
        }
        let stated = Wcsph { artificial_viscosity: Some(0.1), ..Wcsph::default() };
        assert_eq!(stated.artificial_viscosity(&of(1e3)), 0.1);
    }
}
