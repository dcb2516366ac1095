//! Where the surface crosses the edges of the grid in and around a brick: found once, and used by all cells
//! around an edge.

use glam::DVec3;

use super::super::{
    normals::unit,
    prune::{BRICK, Lattice},
};
use crate::field::Field;

/// Bisections of an edge. They leave a thousandth of it, over which a normal hardly turns.
const HALVED: usize = 10;

/// Nodes along a side: those of the brick's cells, and one more on both sides.
const SIDE: usize = BRICK + 3;

/// What is known so far of the nodes of a brick and those around it, and of the edges between them.
pub(super) struct BrickEdges {
    /// The extended indices of the brick's first node.
    low: [usize; 3],
    inside: Vec<Option<bool>>,
    /// For each node the normals on the edges that begin in it, along x, y and z. The inner `None` is a place
    /// without a normal.
    normals: Vec<[Option<Option<DVec3>>; 3]>,
}

impl BrickEdges {
    pub fn new(low: [usize; 3]) -> Self {
        Self { low, inside: Vec::new(), normals: Vec::new() }
    }

    /// The place of a node, given by its extended indices.
    fn slot(&self, node: [usize; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| node[axis] + 1 - self.low[axis]);
        (z * SIDE + y) * SIDE + x
    }

    /// Whether a node lies inside. Nodes of the ring do not.
    pub fn is_inside(&mut self, (field, lattice): (&dyn Field, &Lattice), node: [usize; 3]) -> bool {
        self.inside.resize(SIDE * SIDE * SIDE, None);
        let slot = self.slot(node);
        *self.inside[slot].get_or_insert_with(|| {
            let is_ring = (0..3).any(|axis| lattice.is_ring(axis, node[axis]));
            !is_ring && field.omega(lattice.position(node)) > 0.0
        })
    }

    /// The outward normal where ω changes its sign on the edge that begins in a node and leads along an axis.
    /// Either the node lies inside or the other end does.
    pub fn normal(
        &mut self,
        (field, lattice): (&dyn Field, &Lattice),
        node: [usize; 3],
        (axis, is_inside): (usize, bool),
    ) -> Option<DVec3> {
        self.normals.resize(SIDE * SIDE * SIDE, [None; 3]);
        let slot = self.slot(node);
        *self.normals[slot][axis].get_or_insert_with(|| {
            let mut other = node;
            other[axis] += 1;
            let mut ends = [lattice.position(node), lattice.position(other)];
            if is_inside {
                ends.reverse();
            }
            normal_between(field, ends)
        })
    }
}

/// The outward normal where ω changes its sign between a point outside and one inside.
fn normal_between(field: &dyn Field, [mut outside, mut inside]: [DVec3; 2]) -> Option<DVec3> {
    for _ in 0..HALVED {
        let middle = outside.midpoint(inside);
        if field.omega(middle) > 0.0 { inside = middle } else { outside = middle }
    }
    unit(-field.omega_grad(inside).1)
}
