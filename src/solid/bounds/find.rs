//! The bounds of a solid, found once.

use super::contraction::Tree;
use super::extent::Bounds;
use super::found::FoundBounds;
use super::search::{Side, search};
use super::whole::WholeFormula;
use crate::geom::Aabb;
use crate::solid::construction::Solid;

impl Solid {
    /// Where the solid is; found on first use, then kept.
    pub fn bounds(&self) -> &Bounds {
        &self.found_bounds().bounds
    }

    /// The sides to which no end of the solid was found.
    pub(super) fn open_sides(&self) -> &[Side] {
        &self.found_bounds().open
    }

    fn found_bounds(&self) -> &FoundBounds {
        self.moment.bounds(|| {
            let Some(hull) = self.hull() else {
                return FoundBounds { bounds: Bounds::Empty, open: Vec::new() };
            };
            let open: Vec<Side> = Side::all().filter(|side| side.is_open(&hull)).collect();
            let bounds = if open.is_empty() { Bounds::Within(hull) } else { Bounds::Unbounded };
            FoundBounds { bounds, open }
        })
    }

    /// A box around the solid, which may reach to the ends of the search region; `None` for an empty solid.
    fn hull(&self) -> Option<Aabb> {
        match self.parts_with_hulls() {
            Some(parts) => search(&Tree { words: parts.words.clone(), parts }),
            None => search(&WholeFormula::of(self, false)),
        }
    }
}
