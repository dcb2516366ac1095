//! The bricks of cells that may hold the surface, as far as the field's ranges prove it: an octree of bricks.
//!
//! A ring of virtual nodes that count as outside surrounds the grid, so a surface that leaves the grid is
//! closed there without special cases. Extended indices count the ring: node i of the grid has extended index
//! i + 1. A brick owns [`BRICK`]³ extended nodes, from its low corner on, and the cells and edges that begin
//! in them.
//!
//! Invariant: a brick is called solid or fluid only if the range excludes every other sign and NaN in its
//! closed box. Its nodes then need no sample, and none of its edges is crossed. With a field that knows no
//! ranges every brick is near.

use glam::DVec3;
use rayon::prelude::*;

use super::Grid;
use crate::{field::Field, geom::Aabb};

/// Cells along a brick's side. The inside bits of one plane of its nodes fill a word.
pub(super) const BRICK: usize = 8;

/// Boxes whose ranges are evaluated in one task.
const BOXES_PER_TASK: usize = 64;

/// What ranges prove about a brick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BrickKind {
    /// ω > 0 throughout.
    Solid,
    /// ω ≤ 0 throughout.
    Fluid,
    /// Samples must decide. The number is the brick's place among the near bricks.
    Near(u32),
}

/// A brick that the surface may pass through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NearBrick {
    /// Its place in the lattice of bricks, on each axis.
    pub at: [usize; 3],
    /// True if ω > 0 is proven at all of its nodes in the grid. The surface then only closes the solid at the
    /// grid's border.
    pub solid: bool,
}

/// The grid's nodes and its division into bricks.
#[derive(Debug)]
pub(super) struct Lattice {
    /// The coordinates of the grid's nodes on each axis.
    nodes: [Vec<f64>; 3],
}

impl Lattice {
    pub(super) fn new(grid: &Grid) -> Self {
        Self { nodes: [0, 1, 2].map(|axis| grid.nodes(axis)) }
    }

    /// The number of bricks on each axis.
    fn counts(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| (self.nodes[axis].len() + 2).div_ceil(BRICK))
    }

    /// Whether a node with this extended index belongs to the ring.
    pub(super) fn is_ring(&self, axis: usize, extended: usize) -> bool {
        extended == 0 || extended > self.nodes[axis].len()
    }

    /// The coordinate of an extended node. Nodes of the ring have no coordinates of their own and lie on
    /// the border.
    pub(super) fn coordinate(&self, axis: usize, extended: usize) -> f64 {
        self.nodes[axis][extended.clamp(1, self.nodes[axis].len()) - 1]
    }

    /// The position of an extended node.
    pub(super) fn position(&self, extended: [usize; 3]) -> DVec3 {
        let [x, y, z] = extended;
        DVec3::new(self.coordinate(0, x), self.coordinate(1, y), self.coordinate(2, z))
    }

    /// The box of the grid.
    pub(super) fn whole(&self) -> Aabb {
        let ends = |place: fn(&[f64]) -> Option<&f64>| {
            DVec3::from_array(self.nodes.each_ref().map(|nodes| place(nodes).copied().unwrap_or(f64::NAN)))
        };
        Aabb::new(ends(<[f64]>::first), ends(<[f64]>::last))
    }

    /// The part of a brick's nodes on one axis that lies in the grid, counted from the brick's first node.
    pub(super) fn own_nodes(&self, axis: usize, brick: usize) -> std::ops::Range<usize> {
        let first = brick * BRICK;
        let end = (self.nodes[axis].len() + 1).saturating_sub(first).min(BRICK);
        usize::from(first == 0).min(end)..end
    }

    /// A number that belongs to one extended node alone.
    pub(super) fn key(&self, extended: [usize; 3]) -> u64 {
        let [nx, ny, _] = [0, 1, 2].map(|axis| self.nodes[axis].len() as u64 + 2);
        (extended[2] as u64 * ny + extended[1] as u64) * nx + extended[0] as u64
    }

    /// The closed box of extended nodes from `low` to `high`, and whether all of it lies in the grid. `None`
    /// if none of it does.
    fn bounds(&self, low: [usize; 3], high: [usize; 3]) -> Option<(Aabb, bool)> {
        let in_grid = |axis: usize| low[axis] > 0 && high[axis] <= self.nodes[axis].len();
        let beyond = (0..3).any(|axis| low[axis] > self.nodes[axis].len());
        (!beyond).then(|| (Aabb::new(self.position(low), self.position(high)), (0..3).all(in_grid)))
    }
}

#[derive(Debug, Clone, Copy)]
enum Octant {
    Solid,
    Fluid,
    Near(u32),
    /// Its first child.
    Divided(u32),
}

/// All bricks of a grid.
#[derive(Debug)]
pub(super) struct Bricks {
    /// Eight children in a row for each divided octant. The root is the first.
    cells: Vec<Octant>,
    /// The root's side has two to this power bricks.
    levels: u32,
    /// The near bricks. Neighbours are close to one another in the list.
    pub near: Vec<NearBrick>,
}

/// What a range says about a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Finding {
    Solid,
    /// The part of the box in the grid is proven to be solid, but the box reaches beyond the grid.
    SolidAtBorder,
    Fluid,
    Undecided,
}

impl Bricks {
    /// Divides the grid, level by level, until the sign is proven or single bricks are left.
    pub(super) fn classify(field: &dyn Field, lattice: &Lattice) -> Self {
        let most = lattice.counts().into_iter().max().unwrap_or(1);
        let levels = most.next_power_of_two().trailing_zeros();
        let mut found = Self { cells: vec![Octant::Fluid], levels, near: Vec::new() };
        let mut open = vec![(0_usize, [0_usize; 3])];
        for level in (0..=levels).rev() {
            let size = 1_usize << level;
            let look = |&(_, at): &(usize, [usize; 3])| {
                let low = at.map(|b| b * BRICK);
                let Some((bounds, in_grid)) = lattice.bounds(low, low.map(|n| n + size * BRICK)) else {
                    return Finding::Fluid;
                };
                let range = field.range(&bounds);
                match (range.lo > 0.0, in_grid) {
                    (true, true) => Finding::Solid,
                    (true, false) => Finding::SolidAtBorder,
                    _ if range.hi <= 0.0 => Finding::Fluid,
                    _ => Finding::Undecided,
                }
            };
            let findings: Vec<Finding> = open.par_iter().with_min_len(BOXES_PER_TASK).map(look).collect();
            let mut next = Vec::new();
            for ((slot, at), finding) in open.into_iter().zip(findings) {
                found.cells[slot] = match finding {
                    Finding::Solid => Octant::Solid,
                    Finding::Fluid => Octant::Fluid,
                    _ if level == 0 => {
                        found.near.push(NearBrick { at, solid: finding == Finding::SolidAtBorder });
                        Octant::Near(found.near.len() as u32 - 1)
                    }
                    _ => {
                        let first = found.cells.len();
                        found.cells.resize(first + 8, Octant::Fluid);
                        let child = |i: usize| [0, 1, 2].map(|axis| at[axis] + (i >> axis & 1) * size / 2);
                        next.extend((0..8).map(|i| (first + i, child(i))));
                        Octant::Divided(first as u32)
                    }
                };
            }
            open = next;
        }
        found
    }

    /// What is known about a brick. Beyond the grid there is fluid.
    pub(super) fn kind(&self, at: [usize; 3]) -> BrickKind {
        if at.iter().any(|b| b >> self.levels != 0) {
            return BrickKind::Fluid;
        }
        let mut cell = self.cells[0];
        let mut level = self.levels;
        loop {
            match cell {
                Octant::Solid => return BrickKind::Solid,
                Octant::Fluid => return BrickKind::Fluid,
                Octant::Near(number) => return BrickKind::Near(number),
                Octant::Divided(first) => {
                    level -= 1;
                    let [x, y, z] = at.map(|b| b >> level & 1);
                    cell = self.cells[first as usize + (z << 2 | y << 1 | x)];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interval::Interval;
    use crate::mesh::Resolution;

    /// The field ω = x − 1 with its exact range.
    struct HalfSpace;

    impl Field for HalfSpace {
        fn omega(&self, p: DVec3) -> f64 {
            p.x - 1.0
        }
        fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
            (self.omega(p), DVec3::X)
        }
        fn range(&self, over: &Aabb) -> Interval {
            Interval::new(over.min.x - 1.0, over.max.x - 1.0)
        }
    }

    #[test]
    fn bricks_that_meet_neither_the_plane_nor_the_border_are_decided() {
        let domain = Aabb::new(DVec3::splat(-0.01), DVec3::splat(2.99));
        let lattice = Lattice::new(&Grid::filling(&domain, Resolution::Cells(48)).unwrap());
        assert_eq!(lattice.counts(), [7; 3]);
        let bricks = Bricks::classify(&HalfSpace, &lattice);
        // the plane lies between nodes 16 and 17 of the grid, whose extended indices are 17 and 18
        let found = [0, 1, 2, 3, 5, 6, 7].map(|x| bricks.kind([x, 3, 3]));
        let near = |place| matches!(place, BrickKind::Near(_));
        assert_eq!(found.map(near), [false, false, true, false, false, true, false]);
        assert_eq!([found[0], found[3], found[6]], [BrickKind::Fluid, BrickKind::Solid, BrickKind::Fluid]);
        // at the border nothing is sampled, but the solid is closed there
        let solid = bricks.near.iter().filter(|brick| brick.solid).count();
        let border = 7 * 7 + 3 * (7 * 7 - 5 * 5);
        assert_eq!((solid, bricks.near.len()), (border, border + 49));
        for (i, brick) in bricks.near.iter().enumerate() {
            assert_eq!(bricks.kind(brick.at), BrickKind::Near(i as u32));
        }
    }

    #[test]
    fn bricks_own_each_node_of_the_grid_once() {
        for cells in [1, 5, 6, 13, 14, 15] {
            let domain = Aabb::new(DVec3::ZERO, DVec3::new(1.0, 1.0, 20.0));
            let grid = Grid::filling(&domain, Resolution::Spacing(1.0 / cells as f64)).unwrap();
            let lattice = Lattice::new(&grid);
            let owned: usize = (0..lattice.counts()[0]).map(|b| lattice.own_nodes(0, b).len()).sum();
            assert_eq!(owned, cells + 1);
        }
    }
}
