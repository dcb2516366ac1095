//! The passes of a step, and why some do not run.

use std::fmt;

use super::scales::Scales;

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

    /// Why the pass of the viscosity does not run.
    pub(super) fn without_viscosity(scales: &Scales) -> Option<&'static str> {
        (scales.viscosity == 0.0).then_some("the viscosity is zero")
    }

    /// Why the pass of the surface tension does not run.
    pub(super) fn without_tension(scales: &Scales) -> Option<&'static str> {
        (scales.surface_tension == 0.0).then_some("the surface tension is zero")
    }

    /// Why the pass that makes the fluid stick to walls does not run.
    pub(super) fn without_friction(scales: &Scales) -> Option<&'static str> {
        if scales.sticks { Self::without_viscosity(scales) } else { Some("the fluid slips along walls") }
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
