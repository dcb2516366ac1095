//! What a search for bounds has found.

use super::extent::Bounds;
use super::search::Side;

/// The bounds of a solid, and the sides to which no end of it was found.
pub struct FoundBounds {
    pub bounds: Bounds,
    pub open: Vec<Side>,
    /// Whether a point of the solid is known near each side of the bounds.
    pub are_tight: bool,
}
