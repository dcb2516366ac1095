//! The bounds of a solid, found once.

use super::contraction::Tree;
use super::extent::Bounds;
use super::search::{Side, search};
use super::whole::WholeFormula;
use crate::geom::Aabb;
use crate::solid::construction::Solid;

impl Solid {
    /// Where the solid is; found on first use, then kept.
    pub fn bounds(&self) -> &Bounds {
        self.moment.bounds(|| match self.hull() {
            None => Bounds::Empty,
            Some(hull) if Side::all().any(|side| side.is_open(&hull)) => Bounds::Unbounded,
            Some(hull) => Bounds::Within(hull),
        })
    }

    /// A box around the solid, which may reach to the ends of the search region; `None` for an empty solid.
    fn hull(&self) -> Option<Aabb> {
        match self.parts() {
            Some(parts) => search(&Tree { words: parts.words.clone(), parts }),
            None => search(&WholeFormula::of(self, false)),
        }
    }

    /// The sides to which no end of the solid was found.
    pub(super) fn open_sides(&self) -> Vec<Side> {
        let hull = if *self.bounds() == Bounds::Unbounded { self.hull() } else { None };
        hull.map_or(Vec::new(), |hull| Side::all().filter(|side| side.is_open(&hull)).collect())
    }
}
