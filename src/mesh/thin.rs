//! What marching cubes cannot see: parts of a solid, or gaps in it, that pass between the nodes of the grid.
//!
//! A cell that touches no triangle has corners of one sign only, and so have all cells around it. If the
//! ranges over its parts, an eighth of a cell long, do not exclude the surface, or if a point of the other
//! sign is found, something thinner than a cell is hidden there. Cells next to triangles are not examined,
//! because every curved surface bulges a little into some of them.
//!
//! Invariant: a cell that is not counted and touches no triangle is proven to hold no surface; or the field
//! knows no ranges there, and no sampled point of the cell has the other sign.

use rayon::prelude::*;

use super::{
    Grid, MeshError,
    crossings::sample,
    prune::{BRICK, BrickKind, Bricks, Lattice},
    signs::{Brick, Signs, crossed_cells},
};
use crate::{field::Field, geom::Aabb, interval::Interval};

/// The cells away from the mesh in which a surface is hidden from the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThinCells {
    /// The number of such cells.
    pub count: usize,
    /// The smallest box around all of them, in metres; empty if there are none.
    pub bounds: Aabb,
}

impl ThinCells {
    /// The result for a grid that sees everything.
    pub const NONE: Self = Self { count: 0, bounds: Aabb::EMPTY };

    fn and(self, other: Self) -> Self {
        Self { count: self.count + other.count, bounds: self.bounds.union(&other.bounds) }
    }
}

/// The number of times that an undecided cell is halved on each axis.
const HALVINGS: u32 = 3;

/// Rows of a brick's cells and of the cells next to it. Bit 0 is the cell before the brick's first.
type Rows = [[u16; BRICK + 2]; BRICK + 2];

/// Counts the cells of a grid in which [`marching_cubes`](super::marching_cubes) misses a surface, or may
/// miss one.
///
/// # Errors
/// [`MeshError::NotANumber`] if ω is NaN at a node.
pub fn thin_cells(field: &dyn Field, grid: &Grid) -> Result<ThinCells, MeshError> {
    let lattice = Lattice::new(grid);
    let near = Bricks::classify(field, &lattice);
    let signs = sample(field, &lattice, &near, &mut 0, &|| ())?;
    let crossed: Vec<Signs> = (0..near.near.len())
        .into_par_iter()
        .map(|number| {
            let around = Brick::new(&near, &signs, number).around(&signs);
            std::array::from_fn(|z| crossed_cells(&around.corners(z)))
        })
        .collect();
    let cells = grid.cells();
    let parts: Vec<ThinCells> = (0..near.near.len())
        .into_par_iter()
        .map(|number| {
            let brick = near.near[number];
            if brick.solid {
                return ThinCells::NONE;
            }
            let rows = crossed_rows(&near, &crossed, brick.at);
            let untouched = std::array::from_fn(|z| untouched_plane(&rows, z));
            let search = HiddenSearch {
                field,
                lattice: &lattice,
                low: brick.at.map(|b| b * BRICK),
                cells,
                untouched,
                signs: &signs[number],
            };
            search.count([0; 3], BRICK)
        })
        .collect();
    Ok(parts.into_iter().fold(ThinCells::NONE, ThinCells::and))
}

/// The crossed cells of a brick and of the layer of cells around it.
fn crossed_rows(near: &Bricks, crossed: &[Signs], at: [usize; 3]) -> Rows {
    let mut rows = [[0; BRICK + 2]; BRICK + 2];
    for i in 0..27 {
        let step = [i % 3, i / 3 % 3, i / 9]; // 0 below, 1 here, 2 above
        if (0..3).any(|axis| at[axis] + step[axis] == 0) {
            continue;
        }
        let BrickKind::Near(number) = near.kind([0, 1, 2].map(|axis| at[axis] + step[axis] - 1)) else {
            continue;
        };
        let planes = &crossed[number as usize];
        // only the last or the first layer of a neighbour lies next to the brick
        let layers = |axis: usize| match step[axis] {
            0 => BRICK - 1..BRICK,
            1 => 0..BRICK,
            _ => 0..1,
        };
        let place = |axis: usize, cell: usize| (cell + 1 + step[axis] * BRICK) - BRICK;
        for z in layers(2) {
            for y in layers(1) {
                let row = (planes[z] >> (BRICK * y) & 0xff) as u16;
                let (kept, shift) = match step[0] {
                    0 => (row >> (BRICK - 1), 0),
                    1 => (row, 1),
                    _ => (row & 1, BRICK + 1),
                };
                rows[place(2, z)][place(1, y)] |= kept << shift;
            }
        }
    }
    rows
}

/// The cells of a plane of the brick that have no crossed cell around them.
fn untouched_plane(rows: &Rows, z: usize) -> u64 {
    let mut touched = 0;
    for y in 0..BRICK {
        let around = (z..z + 3).flat_map(|z| (y..y + 3).map(move |y| rows[z][y]));
        let row = around.fold(0, |bits, row| bits | row | row << 1 | row >> 1) >> 1 & 0xff;
        touched |= u64::from(row) << (BRICK * y);
    }
    !touched
}

/// The search for hidden surfaces in one brick.
struct HiddenSearch<'a> {
    field: &'a dyn Field,
    lattice: &'a Lattice,
    /// The extended indices of the brick's first node.
    low: [usize; 3],
    /// The numbers of cells of the grid.
    cells: [usize; 3],
    /// The cells to search.
    untouched: Signs,
    signs: &'a Signs,
}

impl HiddenSearch<'_> {
    /// The thin cells in a cube of cells, whose first cell is counted from the brick's first.
    fn count(&self, first: [usize; 3], size: usize) -> ThinCells {
        let row = ((1_u64 << size) - 1) << first[0];
        let square = (first[1]..first[1] + size).fold(0, |bits, y| bits | row << (BRICK * y));
        let any = self.untouched[first[2]..first[2] + size].iter().any(|plane| plane & square != 0);
        let low = [0, 1, 2].map(|axis| self.low[axis] + first[axis]);
        // cells of the ring, below the first node of the grid or from the last node on, have no extent
        let beyond = (0..3).any(|axis| low[axis] + size <= 1 || low[axis] > self.cells[axis]);
        if !any || beyond {
            return ThinCells::NONE;
        }
        let high = low.map(|n| n + size);
        let bounds = Aabb::new(self.lattice.position(low), self.lattice.position(high));
        if is_decided(self.field.range(&bounds)) {
            return ThinCells::NONE;
        }
        if size == 1 {
            let inside = self.signs[first[2]] >> (BRICK * first[1] + first[0]) & 1 == 1;
            let hides = hides_surface(self.field, &bounds, inside, HALVINGS);
            return if hides { ThinCells { count: 1, bounds } } else { ThinCells::NONE };
        }
        let half = size / 2;
        let child = |i: usize| [0, 1, 2].map(|axis: usize| first[axis] + (i >> axis & 1) * half);
        (0..8).map(|i| self.count(child(i), half)).fold(ThinCells::NONE, ThinCells::and)
    }
}

fn is_decided(range: Interval) -> bool {
    range.lo > 0.0 || range.hi <= 0.0
}

/// Whether the middle of the box or of one of its parts has the other sign, or one of its smallest parts
/// cannot be excluded.
fn hides_surface(field: &dyn Field, bounds: &Aabb, inside: bool, halvings: u32) -> bool {
    let range = field.range(bounds);
    if is_decided(range) {
        return false;
    }
    let centre = bounds.centre();
    if (field.omega(centre) > 0.0) != inside {
        return true;
    }
    if halvings == 0 {
        return range != Interval::ALL; // a field that knows nothing here is not blamed
    }
    let parts = bounds.corners().map(|corner| Aabb::new(corner.min(centre), corner.max(centre)));
    parts.iter().any(|part| hides_surface(field, part, inside, halvings - 1))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::Resolution;

    /// A shell between two balls, with its exact range up to rounding.
    struct HollowBall {
        inner: f64,
        outer: f64,
    }

    impl Field for HollowBall {
        fn omega(&self, p: DVec3) -> f64 {
            let r = p.length();
            (self.outer - r).min(r - self.inner)
        }
        fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
            (self.omega(p), p)
        }
        fn range(&self, over: &Aabb) -> Interval {
            let nearest = DVec3::ZERO.clamp(over.min, over.max).length() - 1e-12;
            let farthest = over.min.abs().max(over.max.abs()).length() + 1e-12;
            let lowest = (self.outer - farthest).min(nearest - self.inner);
            Interval::new(lowest, (self.outer - nearest).min(farthest - self.inner))
        }
    }

    fn thin(field: &dyn Field, cells: usize) -> ThinCells {
        let domain = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
        thin_cells(field, &Grid::filling(&domain, Resolution::Cells(cells)).unwrap()).unwrap()
    }

    #[test]
    fn a_ball_and_a_thick_shell_hide_nothing() {
        for cells in [5, 16, 40, 64] {
            assert_eq!(thin(&HollowBall { inner: -1.0, outer: 0.83 }, cells), ThinCells::NONE);
        }
        assert_eq!(thin(&HollowBall { inner: 0.6, outer: 0.83 }, 40), ThinCells::NONE);
    }

    #[test]
    fn a_shell_thinner_than_a_cell_is_found_where_it_is() {
        // cells of 1/20, a wall of 1/1000
        let found = thin(&HollowBall { inner: 0.8, outer: 0.801 }, 40);
        // the sphere meets some 6·π·0.8²·20² cells, of which few see a node inside
        assert!(found.count > 1000, "{found:?}");
        assert!(found.bounds.max.max_element() < 0.86 && found.bounds.min.min_element() > -0.86, "{found:?}");
        assert_eq!(thin(&HollowBall { inner: 0.8, outer: 0.86 }, 160), ThinCells::NONE);
    }

    #[test]
    fn a_field_without_ranges_is_blamed_only_for_points_that_are_found() {
        let field = crate::field::Closures { omega: |p: DVec3| 0.5 - p.length(), gradient: |p: DVec3| -p };
        assert_eq!(thin(&field, 20), ThinCells::NONE);
        // a speck around the middle of one cell
        let speck = crate::field::Closures {
            omega: |p: DVec3| 0.01 - p.distance(DVec3::splat(0.05)),
            gradient: |p: DVec3| -p,
        };
        assert_eq!(thin(&speck, 20).count, 1);
    }
}
