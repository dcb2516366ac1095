//! What is known about the extent of a solid.

use crate::geom::Aabb;

/// What is known about the extent of a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bounds {
    /// It is proven that ω > 0 nowhere, up to 2²⁵⁰ from the origin.
    Empty,
    /// It is proven that the solid lies in this box. Each face is within a millionth of the longest side of
    /// the solid itself, where the budget of the search allowed it; see
    /// [`Solid::bounds_are_tight`](crate::Solid::bounds_are_tight).
    Within(Aabb),
    /// No such box was found; [`Solid::unbounded`](crate::Solid::unbounded) names the operand without bounds.
    Unbounded,
}

impl Bounds {
    /// The box, if the solid has one.
    pub fn aabb(&self) -> Option<Aabb> {
        match self {
            Self::Within(aabb) => Some(*aabb),
            Self::Empty | Self::Unbounded => None,
        }
    }
}
