//! Walls and gaps that are thinner than a length.
//!
//! From points of the surface a line goes into the solid, and one away from it. If it meets another face soon, and this
//! face looks the other way, there is a wall or a gap between the two. The edge of a wedge or the tip of a cone is thin
//! as well, but its faces do not look in opposite directions.

use glam::DVec3;

use super::crossings::{ALL_HALVINGS, Lattice, MOST_POINTS, halved};
use crate::solid::construction::Solid;

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

/// Steps along a line, and its beginning, off the surface, as a part of it.
const STEPS: usize = 32;
const START: f64 = 1e-6;

/// The faces of a wall look in opposite directions: the cosine between their normals is at most this. So is that of a wedge
/// whose angle is less than 12°.
const OPPOSITE: f64 = -0.98;

/// A part whose sides are smaller than the square of so many thicknesses that were asked for is a detail.
const LEAST_EXTENT: f64 = 2.0;

impl Solid {
    /// The thinnest wall and the thinnest gap of the solid that are thinner than a length each, and extend over twice this
    /// length at least; `None` where there is none. Solids without bounds, and very large ones, are not looked at.
    pub fn thinner_than(&self, wall: f64, gap: f64) -> [Option<ThinPart>; 2] {
        let (Some(bounds), ..=MOST_OPERATIONS) = (self.bounds().aabb(), self.formula().0.len()) else {
            return [None; 2];
        };
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
            // each edge of the lattice stands for the face of a cell; a face is crossed by edges of all three directions
            let axis = (0..3).find(|&axis| p[axis] != other[axis]).unwrap_or(0);
            let face = cell[(axis + 1) % 3] * cell[(axis + 2) % 3];
            let area = every as f64 * face * normal[axis].abs();
            for (part, (direction, within, length)) in
                found.iter_mut().zip([(-normal, 1.0, wall), (normal, -1.0, gap)])
            {
                let Some(thickness) = self.thickness(p, (direction, within), length) else { continue };
                let so_far = part.get_or_insert(ThinPart { at: p, thickness, area: 0.0 });
                so_far.area += area;
                if thickness < so_far.thickness {
                    (so_far.at, so_far.thickness) = (p, thickness);
                }
            }
        }
        let mut lengths = [wall, gap].into_iter();
        found.map(|part| {
            let least = (LEAST_EXTENT * lengths.next()?).powi(2);
            // both sides were counted
            let part = part.map(|part| ThinPart { area: 0.5 * part.area, ..part });
            part.filter(|part| part.area > least)
        })
    }

    /// How far the next face is along a line from a point of the surface, if it is nearer than a length and looks the
    /// other way. Along the line up to there the solid has the sign `within`.
    fn thickness(&self, p: DVec3, (direction, within): (DVec3, f64), length: f64) -> Option<f64> {
        let place = |part: f64| p + direction * (length * part);
        let places = |step: usize| place((step as f64 / STEPS as f64).max(START));
        if self.sign(places(0)) != within {
            return None;
        }
        let end = (1..=STEPS).find(|&step| self.sign(places(step)) == -within)?;
        let [far, _] = halved([places(end - 1), places(end)], ALL_HALVINGS, |q| self.sign(q) == within);
        let opposite = self.contact(p).normal.dot(self.contact(far).normal) <= OPPOSITE;
        opposite.then(|| p.distance(far))
    }
}
