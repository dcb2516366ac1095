//! Where a solid is while it is watched: the box that a picture of it needs.

use rfm::Solid;
use rfm::geom::Aabb;
use rfm::solid::Bounds;

/// The instants at which a solid is looked at for the room that its way takes up.
const INSTANTS: u32 = 32;

/// The longest side of that room, in longest sides of the solid at the start.
const MOST_ROOM: f64 = 12.0;

/// The longest time for which a solid is watched, s. If its way takes up too much room, half of that is
/// tried, and so on.
const LONGEST: f64 = 1024.0;

/// How often the time is halved.
const HALVINGS: i32 = 40;

/// Where a solid is while it is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Way {
    /// A box around all of it.
    pub room: Aabb,
    /// When it begins, s: 0 unless the solid is empty then.
    pub start: f64,
    /// When it ends, s: at its beginning if the solid stands still, and before the solid is out of sight if
    /// it goes away.
    pub end: f64,
}

impl Way {
    /// The way of a solid.
    ///
    /// # Errors
    /// It is empty, or has no end.
    pub fn of(solid: &Solid) -> Result<Self, String> {
        let first = [0.0].into_iter().chain(instants(LONGEST / 2_f64.powi(6)));
        let found = first.map(|time| (time, solid.at(time))).find_map(|(time, solid)| match solid.bounds() {
            Bounds::Within(room) => Some((time, Ok(*room))),
            Bounds::Unbounded => Some((time, Err("could not be proven to end"))),
            Bounds::Empty => None,
        });
        let (start, room) = found.unwrap_or((0.0, Err("is empty")));
        let room = room.map_err(|why| format!("`{}` {why}: there is nothing to show", solid.name()))?;
        let mut ends = (0..HALVINGS).map(|k| start + LONGEST * 0.5_f64.powi(k));
        let way =
            if solid.moves() { ends.find_map(|end| Self::until(solid, room, start, end)) } else { None };
        let Self { room, start, end } = way.unwrap_or(Self { room, start, end: start });
        // room for the instants in between, and for a face in the border of the box
        let slack = if end > start { 0.02 } else { 1e-3 };
        Ok(Self { room: room.grown(slack * side(&room)), start, end })
    }

    /// The way between two times, beginning at a first place; `None` if it takes up too much room.
    fn until(solid: &Solid, first: Aabb, start: f64, end: f64) -> Option<Self> {
        let mut room = first;
        for time in instants(end - start).map(|time| start + time).chain([end]) {
            match solid.at(time).bounds() {
                Bounds::Within(bounds) => room = room.union(bounds),
                // for a while it takes up no room
                Bounds::Empty => {}
                Bounds::Unbounded => return None,
            }
            if side(&room) > MOST_ROOM * side(&first) {
                return None;
            }
        }
        Some(Self { room, start, end })
    }
}

/// Instants within a time, s, by the golden ratio, so that they fit no period.
fn instants(time: f64) -> impl Iterator<Item = f64> {
    (1..=INSTANTS).map(move |k| time * (f64::from(k) * 0.618_033_988_749_895).fract())
}

fn side(room: &Aabb) -> f64 {
    room.size().max_element()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rfm::{Engine, Program};

    fn way(formula: &str) -> Result<Way, String> {
        let program = Program::from_source("way.rfm", format!("rfm 1\nsolid s = {formula}\n")).unwrap();
        Way::of(&program.solid_with("s", Engine::Interpreter).unwrap())
    }

    #[test]
    fn a_way_holds_turns_and_ends_where_a_solid_goes_out_of_sight() {
        let turning = way("box([-0.1, -0.1, -0.1], [1, 0.1, 0.1]).rotate_z(t)").unwrap();
        assert_eq!((turning.start, turning.end), (0.0, LONGEST));
        let reach = (1.0_f64 + 0.01).sqrt();
        assert!(turning.room.min.x < -0.99 && turning.room.max.y > 0.99 && turning.room.max.x < 1.06 * reach);
        // 2 m wide, 24 m of room: 22 m at 5 m/s, and half of what is tried before
        let leaving = way("sphere(1).move([5*t, 0, 0])").unwrap();
        assert_eq!(leaving.end, 4.0);
        assert!(leaving.room.max.x > 21.0);
        let still = way("sphere(1)").unwrap();
        assert_eq!((still.start, still.end), (0.0, 0.0));
        let late = way("sphere(1).move([0, 0, 1]) and t >= 2").unwrap();
        assert!(late.start >= 2.0 && late.end > late.start, "{late:?}");
        assert!(way("x >= 0").unwrap_err().contains("could not be proven to end"));
        assert!(way("sphere(1) and x >= 2").unwrap_err().contains("is empty"));
    }
}
