//! Where a solid is while it is watched: the box that a picture of it needs.

use rfm::Solid;
use rfm::geom::Aabb;

/// The instants at which a solid is looked at for the room that its way takes up.
const INSTANTS: u32 = 32;

/// The longest side of that room, in longest sides of the solid at the start.
const MOST_ROOM: f64 = 12.0;

/// The longest time for which a solid is watched, s. Less is tried ten times in the same ratio.
const LONGEST: f64 = 1000.0;

/// Where a solid is while it is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::cli) struct Way {
    /// A box around all of it.
    pub room: Aabb,
    /// When it ends, s: a solid that stands still has none, one that goes away is left before it is out of sight.
    pub end: f64,
}

impl Way {
    /// The way of a solid.
    ///
    /// # Errors
    /// It is empty at the start, or has no end.
    pub fn of(solid: &Solid) -> Result<Self, String> {
        let start = solid.at(0.0).bounds().aabb().ok_or_else(|| {
            format!("`{}` is empty, or could not be proven to end: there is nothing to show", solid.name())
        })?;
        let side = |room: &Aabb| room.size().max_element();
        let still = Self { room: start, end: 0.0 };
        let most = MOST_ROOM * side(&start);
        let mut ends = (0..10).map(|k| LONGEST * 0.1_f64.powi(k));
        let way =
            if solid.moves() { ends.find_map(|end| Self::until(solid, start, end, most)) } else { None };
        let Self { room, end } = way.unwrap_or(still);
        // what lies between the instants, and the plane of a face in the border of the box
        let slack = if end > 0.0 { 0.02 } else { 1e-3 };
        Ok(Self { room: room.grown(slack * side(&room)), end })
    }

    /// The way until a time; `None` if its room has a longer side than `most`.
    fn until(solid: &Solid, start: Aabb, end: f64, most: f64) -> Option<Self> {
        // by the golden ratio: instants that fit no period
        let instants = (1..=INSTANTS).map(|k| end * (f64::from(k) * 0.618_033_988_749_895).fract());
        let mut room = start;
        for time in instants.chain([end]) {
            // a solid that is empty for a while takes up no room
            let Some(bounds) = solid.at(time).bounds().aabb() else { continue };
            room = Aabb::new(room.min.min(bounds.min), room.max.max(bounds.max));
            if room.size().max_element() > most {
                return None;
            }
        }
        Some(Self { room, end })
    }
}
