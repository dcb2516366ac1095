//! What evaluates a solid, and the questions that it answers.

/// What evaluates a solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Engine {
    /// Machine code, or the interpreter where there can be none.
    #[default]
    Auto,
    /// Machine code, or an error.
    Jit,
    /// The interpreter: it gives the same bits, some 12 to 13 times slower over columns of points.
    Interpreter,
}

/// The question that a program answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ProgramKind {
    /// ω
    Value,
    /// ω, ∂ω/∂x, ∂ω/∂y, ∂ω/∂z
    Gradient,
    /// The min/max twin, which has the sign of ω
    Sign,
    /// The twin and its gradient, which is that of the active leaf
    SignGradient,
    /// Distance from the surface (positive in the fluid), outward unit normal, mean curvature
    Contact,
    /// The surface's velocity along its normal: three numbers, zero for a solid at rest
    Velocity,
}

impl ProgramKind {
    pub(super) const COUNT: usize = 6;
}
