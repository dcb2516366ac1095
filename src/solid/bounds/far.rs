//! A cube that holds a solid whose bounds were not found from near.

use super::search::SEARCH_RADIUS;
use super::whole::at_its_time;
use crate::geom::Aabb;
use crate::ir::{Contractor, Region, Wanted, cube_around};
use crate::solid::construction::Solid;

/// Nodes visited for a cube: a second.
const MOST_VISITS: usize = 10_000_000;

impl Solid {
    /// A cube around the origin that holds the solid, although its bounds were not found from near; `None` if there is
    /// no proof.
    pub(super) fn box_far_out(&self) -> Option<Aabb> {
        let (graph, root) = at_its_time(self);
        let region = Region { time: self.moment.interval(), ..Region::of(&Aabb::EMPTY) };
        let wanted = Wanted { region, negated: false };
        cube_around(&Contractor::new(&graph, root), wanted, SEARCH_RADIUS, MOST_VISITS)
    }
}
