//! The treatment of pressures below zero.

/// The pressure of an equation of state where the density is below the rest density.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NegativePressure {
    /// Pressure is cut off at zero: the fluid pushes, and never pulls.
    ///
    /// This is the default. At a free surface half of the neighbours are missing, so the density found there
    /// is about half of the rest density, and the unclamped law of the paper gives a tension of kρ₀/2. That
    /// is an artefact of the sum, not a property of the fluid. Under tension the pressure kernel pulls until
    /// particles coincide: with the values of table 1 some 32 of them must lie in one point before their
    /// density reaches ρ₀.
    #[default]
    Clamp,
    /// Pressure may be negative, as in Kelager (2006). This keeps a drop together, and makes particles clump.
    Keep,
}

impl NegativePressure {
    /// The word for it in scenes.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Clamp => "clamp",
            Self::Keep => "keep",
        }
    }

    /// The pressure that acts, Pa, from that of the equation of state, Pa.
    #[inline]
    pub(super) fn of(self, pressure: f64) -> f64 {
        match self {
            Self::Clamp => pressure.max(0.0),
            Self::Keep => pressure,
        }
    }
}
