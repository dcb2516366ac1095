//! The cheapest field for a question about the surface of a solid.

use super::cells::map::CellMap;
use super::construction::Solid;
use crate::field::Walls;
use crate::geom::Aabb;

/// Up to this many leaves the twin alone is cheaper than finding out which of them matter. In a batch a leaf
/// and its share of the minima cost some 0.2 ns, a cell's look-up and call 10.
const TWIN_SUFFICES: usize = 24;

impl Solid {
    /// The cheapest field with exactly the sign, zero set and surface gradient of ω in a box: the twin for a
    /// few leaves, a [`CellMap`] for many. Off the surface its value differs.
    pub fn surface(&self, over: Aabb) -> Box<dyn Walls> {
        match if self.has_many_leaves() { CellMap::new(self, over) } else { None } {
            Some(map) => Box::new(map),
            None => Box::new(self.twin()),
        }
    }

    /// The field that a fluid solver needs in a box: that of [`Solid::surface`], with its faces within
    /// `reach`.
    pub fn walls(&self, over: Aabb, reach: f64) -> Box<dyn Walls> {
        match CellMap::with_reach(self, over, reach) {
            Some(map) => Box::new(map),
            None => Box::new(self.clone()),
        }
    }

    /// Whether the number of leaves that decide the sign is so large that it pays to find out which of them
    /// matter at a place.
    pub fn has_many_leaves(&self) -> bool {
        self.leaf_count().is_some_and(|leaves| leaves > TWIN_SUFFICES)
    }
}
