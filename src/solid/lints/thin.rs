//! Walls and gaps that are thinner than a length.
//!
//! From points of the surface a line goes into the solid, and one away from it. If it meets another face soon, and this
//! face looks the other way, there is a wall or a gap between the two. The edge of a wedge or the tip of a cone is thin
//! as well, but its faces do not look in opposite directions.

use glam::DVec3;

use super::crossings::{ALL_HALVINGS, Lattice, MOST_POINTS, halved};
use crate::geom::Aabb;
use crate::solid::Bounds;
use crate::solid::construction::Solid;

/// What walls and gaps are looked for.
struct Search {
    /// Walls that are thinner than this length, m.
    wall: f64,
    /// Gaps that are thinner than this length, m.
    gap: f64,
    /// The room that a fluid needs beyond a wall, m.
    room: f64,
    /// Where a fluid may be.
    within: Aabb,
}

impl Search {
    /// Whether a fluid may be in a gap, or on both sides of a wall, between two faces. The direction is that
    /// from the first to the second one; the sign is 1 for a wall.
    fn is_in_fluid(&self, [first, second]: [DVec3; 2], (direction, sign): (DVec3, f64)) -> bool {
        let within = self.within.grown(-BORDER * self.within.size().max_element());
        let beyond = if sign > 0.0 { self.room * direction } else { DVec3::ZERO };
        within.contains(first - beyond) && within.contains(second + beyond)
    }
}

/// A wall, or a gap between walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThinPart {
    /// A point on its surface.
    pub at: DVec3,
    /// Its thickness there: the least that was found.
    pub thickness: f64,
    /// Estimated area of one of its sides, as far as it is thinner than asked.
    pub area: f64,
}

/// Nodes along each side of the lattice between which the surface is found.
const NODES: usize = 49;

/// Solids with more operations are not looked at: the sign of each is needed some hundred thousand times.
const MOST_OPERATIONS: usize = 5000;

/// Maximum number of signs that are needed of a solid: at the nodes, and for each point of the surface on its
/// edge and on two lines, of which halving needs some 50 each.
const SIGNS: usize = NODES.pow(3) + MOST_POINTS * (50 + 2 * (STEPS + 50));

/// A point nearer than this to the border of the region where a fluid may be, as a part of the longest side,
/// counts as on it.
const BORDER: f64 = 1e-6;

/// Steps along a line, and its beginning, off the surface, as a part of it.
const STEPS: usize = 32;
const START: f64 = 1e-6;

/// The faces of a wall look in opposite directions: the cosine between their normals is at most this. The
/// same holds for a wedge whose angle is less than 12°.
const OPPOSITE: f64 = -0.98;

/// A wall whose sides are smaller than the square of this many of the wanted thicknesses is a detail, and so is a gap
/// with sides smaller than that of this many times the room of a fluid.
const LEAST_EXTENT: f64 = 2.0;

impl Solid {
    /// The thinnest wall and the thinnest gap of the solid that are thinner than a length each, and extend over twice
    /// the length of the wall, and twice the third length; `None` where there is none. Very large solids are not looked
    /// at, nor are those without bounds in a box without them.
    ///
    /// A fluid may be in a finite box. Both faces of a gap must lie in it, and beyond both faces of a wall there must
    /// be as much room in it as the third length. The search takes its operations from a budget; if too few are left,
    /// it finds nothing.
    pub fn thin_parts(
        &self,
        [wall, gap, room]: [f64; 3],
        within: &Aabb,
        budget: &mut usize,
    ) -> [Option<ThinPart>; 2] {
        let search = Search { wall, gap, room, within: *within };
        let operations = self.formula().0.len();
        let (..=MOST_OPERATIONS, Some(left)) = (operations, budget.checked_sub(SIGNS * operations)) else {
            return [None; 2];
        };
        let bounds = match self.bounds() {
            Bounds::Within(bounds) => bounds.intersection(&search.within),
            Bounds::Unbounded if search.within.size().is_finite() => search.within,
            Bounds::Unbounded | Bounds::Empty => return [None; 2],
        };
        if bounds.is_empty() {
            return [None; 2];
        }
        *budget = left;
        // nodes do not lie in faces
        let lattice = Lattice::of(self, &bounds.grown(0.0173 * bounds.size().max_element()), NODES);
        let (crossings, every) = lattice.crossings(self, MOST_POINTS, ALL_HALVINGS);
        let cell = lattice.cell();
        let mut found: [Option<ThinPart>; 2] = [None; 2];
        for crossing in &crossings {
            let [p, other] = crossing.ends;
            let normal = self.contact(p).normal;
            if !(0.5..2.0).contains(&normal.length()) {
                continue;
            }
            // each edge of the lattice stands for the face of a cell; a face is crossed by edges of all three
            // directions
            let axis = (0..3).find(|&axis| p[axis] != other[axis]).unwrap_or(0);
            let face = cell[(axis + 1) % 3] * cell[(axis + 2) % 3];
            let area = every as f64 * face * normal[axis].abs();
            for (part, (direction, sign, length)) in
                found.iter_mut().zip([(-normal, 1.0, search.wall), (normal, -1.0, search.gap)])
            {
                let Some(far) = self.other_face(p, (direction, sign), length) else { continue };
                if !search.is_in_fluid([p, far], (direction, sign)) {
                    continue;
                }
                let thickness = p.distance(far);
                let so_far = part.get_or_insert(ThinPart { at: p, thickness, area: 0.0 });
                so_far.area += area;
                if thickness < so_far.thickness {
                    (so_far.at, so_far.thickness) = (p, thickness);
                }
            }
        }
        let mut lengths = [search.wall, search.room].into_iter();
        found.map(|part| {
            let least = (LEAST_EXTENT * lengths.next()?).powi(2);
            // both sides were counted
            let part = part.map(|part| ThinPart { area: 0.5 * part.area, ..part });
            part.filter(|part| part.area > least)
        })
    }

    /// The next face along a line from a point of the surface, if it is nearer than a length and looks the
    /// other way. Along the line up to there the solid has one sign.
    fn other_face(&self, p: DVec3, (direction, sign): (DVec3, f64), length: f64) -> Option<DVec3> {
        let place = |part: f64| p + direction * (length * part);
        let places = |step: usize| place((step as f64 / STEPS as f64).max(START));
        if self.sign(places(0)) != sign {
            return None;
        }
        let end = (1..=STEPS).find(|&step| self.sign(places(step)) == -sign)?;
        let [far, _] = halved([places(end - 1), places(end)], ALL_HALVINGS, |q| self.sign(q) == sign);
        let opposite = self.contact(p).normal.dot(self.contact(far).normal) <= OPPOSITE;
        opposite.then_some(far)
    }
}
