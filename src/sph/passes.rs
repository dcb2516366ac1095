//! The passes of a step: which ones a simulation runs, and why it leaves out the others.

use std::borrow::Cow;
use std::fmt;

use glam::DVec3;

use super::methods::Method;
use super::params::{Parameters, Slip};

/// A stage of a step. The variants stand in the order in which a step runs them. Passes that a scene does not
/// need do not run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pass {
    /// Velocities and positions advance in time.
    Integrate,
    /// Particles stay in the box.
    Walls,
    /// Particles stay out of obstacles.
    Obstacles,
    /// Particles are sorted into columns.
    Neighbours,
    /// What walls take of the kernel of each particle.
    Coverage,
    /// The density of each particle.
    Density,
    /// Diffusion of the density.
    DensityDiffusion,
    /// Pressure from an equation of state.
    Pressure,
    /// Pressure by iteration.
    PressureSolver,
    /// The physical viscosity of the fluid.
    Viscosity,
    /// Artificial viscosity, which damps noise.
    ArtificialViscosity,
    /// Particles drift to where there are fewer of them.
    Shifting,
    /// The fluid sticks to walls.
    NoSlip,
    /// Tension of the free surface.
    SurfaceTension,
    /// Gravity accelerates the fluid.
    Gravity,
}

impl Pass {
    /// Why methods with an equation of state have no solver for the pressure.
    pub(super) const STATE: &'static str = "the method has an equation of state";

    /// All passes in the order of a step, each with the reason if it does not run.
    pub(super) fn plan(parameters: &Parameters, obstacles: usize) -> Vec<(Self, Option<Cow<'static, str>>)> {
        let unless = |needed: bool, reason: &'static str| (!needed).then_some(reason);
        let of_all_methods = [
            (Self::Integrate, None),
            (Self::Walls, None),
            (Self::Obstacles, unless(obstacles > 0, "the scene has no obstacle")),
            (Self::Neighbours, None),
            (Self::Gravity, unless(parameters.gravity != DVec3::ZERO, "gravity is zero")),
        ];
        let own = parameters.method.passes(parameters);
        let mut plan: Vec<(Self, Option<Cow<'static, str>>)> = of_all_methods
            .into_iter()
            .chain(own)
            .map(|(pass, reason)| (pass, reason.map(Cow::Borrowed)))
            .collect();
        for method in Method::all() {
            for pass in method.info().passes {
                if !plan.iter().any(|(known, _)| *known == pass) {
                    plan.push((pass, Some(Cow::Owned(pass.belongs()))));
                }
            }
        }
        plan.sort_by_key(|(pass, _)| *pass);
        plan
    }

    /// Why a method that does not declare the pass does not run it: names the methods that have it.
    fn belongs(self) -> String {
        let has_pass = |method: &Method| method.info().passes.contains(&self);
        let names: Vec<&str> = Method::all().iter().filter(|m| has_pass(m)).map(Method::name).collect();
        let methods = if names.len() == 1 { "method" } else { "methods" };
        format!("it belongs to the {methods} {}", names.join(" and "))
    }

    /// Why the pass of the viscosity does not run.
    pub(super) fn without_viscosity(parameters: &Parameters) -> Option<&'static str> {
        (parameters.viscosity == 0.0).then_some("the viscosity is zero")
    }

    /// Why the pass of the surface tension does not run.
    pub(super) fn without_tension(parameters: &Parameters) -> Option<&'static str> {
        (parameters.surface_tension == 0.0).then_some("the surface tension is zero")
    }

    /// Why the pass that makes the fluid stick to walls does not run.
    pub(super) fn without_friction(parameters: &Parameters) -> Option<&'static str> {
        match parameters.slip {
            Slip::Free => Some("the fluid slips along walls"),
            Slip::No => Self::without_viscosity(parameters),
        }
    }

    /// Name of the pass in the output of `rfm explain` and in summaries.
    pub fn name(self) -> &'static str {
        match self {
            Self::Integrate => "integrate",
            Self::Walls => "walls",
            Self::Obstacles => "obstacles",
            Self::Neighbours => "neighbours",
            Self::Coverage => "wall coverage",
            Self::Density => "density",
            Self::DensityDiffusion => "density diffusion",
            Self::Pressure => "pressure",
            Self::PressureSolver => "pressure solver",
            Self::Viscosity => "viscosity",
            Self::ArtificialViscosity => "artificial viscosity",
            Self::Shifting => "particle shifting",
            Self::NoSlip => "no slip",
            Self::SurfaceTension => "surface tension",
            Self::Gravity => "gravity",
        }
    }
}

impl fmt::Display for Pass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
