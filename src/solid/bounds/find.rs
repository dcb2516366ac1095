//! The bounds of a solid, found once.

use super::contraction::Tree;
use super::extent::Bounds;
use super::found::FoundBounds;
use super::search::{EVERYWHERE, Found, Side, search};
use super::whole::WholeFormula;
use crate::geom::Aabb;
use crate::solid::construction::Solid;

/// Longer formulas are not searched as one if their leaves were.
const MOST_NODES: usize = 2000;

impl Solid {
    /// Where the solid is; found on first use, then kept.
    pub fn bounds(&self) -> &Bounds {
        &self.found_bounds().bounds
    }

    /// Whether a point of the solid is proven to be near each side of its bounds: within a millionth of the longest
    /// side where the budget of the search allowed it, and within a thousandth in any case. Otherwise the bounds hold
    /// the solid and may be too large.
    pub fn bounds_are_tight(&self) -> bool {
        self.found_bounds().are_tight
    }

    /// The sides to which no end of the solid was found.
    pub(super) fn open_sides(&self) -> &[Side] {
        &self.found_bounds().open
    }

    fn found_bounds(&self) -> &FoundBounds {
        self.moment.bounds(|| {
            let mut found = self.found_within(EVERYWHERE);
            if found.bounds == Bounds::Unbounded
                && let Some(around) = self.box_far_out().or_else(|| self.box_of_operands())
            {
                found = self.found_within(around);
            }
            found
        })
    }

    /// What is found from the formula as one, if angles occur in it: around an axis, leaves alone are undecided for
    /// different angles.
    fn with_common_angles(&self, found: Option<Found>) -> Option<Found> {
        let found = found?;
        let is_open = Side::all().any(|side| side.is_open(&found.hull));
        if found.is_tight || is_open || self.formula().0.len() > MOST_NODES {
            return Some(found);
        }
        let whole = WholeFormula::of(self, false);
        if whole.has_angles() { search(&whole, found.hull) } else { Some(found) }
    }

    /// The bounds of the part of the solid in a box.
    pub(super) fn found_within(&self, around: Aabb) -> FoundBounds {
        let found = match self.parts_with_hulls() {
            Some(parts) => {
                self.with_common_angles(search(&Tree { words: parts.words.clone(), parts }, around))
            }
            None => search(&WholeFormula::of(self, false), around),
        };
        let Some(Found { hull, is_tight }) = found else {
            return FoundBounds { bounds: Bounds::Empty, open: Vec::new(), are_tight: true };
        };
        let open: Vec<Side> = Side::all().filter(|side| side.is_open(&hull)).collect();
        let bounds = if open.is_empty() { Bounds::Within(hull) } else { Bounds::Unbounded };
        FoundBounds { bounds, open, are_tight: is_tight }
    }
}
