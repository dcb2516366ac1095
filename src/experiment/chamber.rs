//! Whether a fluid fills the chamber that it is in: the part of the scene's room from which it is not walled off.
//!
//! Room behind a wall is none of the fluid's. (Where a tank was full to its lid, and the scene empty above that, the fluid
//! counted as one with a surface; with `dfsph` such water, at rest, burst within a second.)

use std::collections::HashSet;

use glam::DVec3;

use super::Experiment;
use super::room::{Crowd, LEAST_ROOM};
use crate::geom::Aabb;

/// Side of the cells by which room is explored, in spacings. An opening that a particle passes holds two of them.
const CELL: f64 = 0.5;

/// Most cells around a fluid that are looked at. What takes more counts by the room of all of the scene.
const MOST_CELLS: f64 = 4e6;

/// A cell by its numbers along the axes.
type Cell = [i32; 3];

fn neighbours([x, y, z]: Cell) -> [Cell; 6] {
    [[x - 1, y, z], [x + 1, y, z], [x, y - 1, z], [x, y + 1, z], [x, y, z - 1], [x, y, z + 1]]
}

impl Experiment {
    /// Whether a fluid of a volume, m³, within the given box fills its chamber at the start, or all of its chambers. Walls
    /// thinner than a cell may count as none, so that the answer is no.
    pub(super) fn fills_its_chamber(&self, within: &Aabb, volume: f64) -> bool {
        let cell = CELL * self.parameters.spacing();
        let (from, domain) = (within.min, self.scene.domain);
        let counts = (within.size() / cell).ceil().max(DVec3::ONE);
        if counts.element_product() > MOST_CELLS {
            return false;
        }
        let crowd = Crowd::of(self.bodies.iter().map(|body| &body.solid));
        let centre = |at: Cell| from + cell * (DVec3::from(at.map(f64::from)) + 0.5);
        let is_free = |at: Cell| {
            let place = centre(at);
            domain.contains(place) && crowd.is_free(place)
        };
        let is_wet = |at: Cell| self.fluid.omega(centre(at)) > 0.0;
        let room = (LEAST_ROOM - 1.0) * volume / cell.powi(3);
        let (mut seen, mut dry) = (HashSet::new(), Vec::new());
        let mut explore = |at: Cell, dry: &mut Vec<Cell>| {
            for next in neighbours(at) {
                if !is_wet(next) && seen.insert(next) && is_free(next) {
                    dry.push(next);
                }
            }
        };
        let [nx, ny, nz] = counts.to_array().map(|count| count as i32);
        // most surfaces lie at the top, and what has one is soon found to have it
        let cells = (0..nz).rev().flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        let mut found = 0;
        for at in cells.filter(|at| is_wet(*at)) {
            if !is_free(at) {
                continue;
            }
            explore(at, &mut dry);
            while let Some(next) = dry.pop() {
                found += 1;
                if f64::from(found) > room {
                    return false;
                }
                explore(next, &mut dry);
            }
        }
        true
    }
}
