//! The signs at a brick's nodes, one bit each, and what follows from them: crossed edges, their numbers, and
//! the cells that the surface passes through.
//!
//! A plane of a brick's nodes is a word: bit x + 8·y is set if node (x, y) lies inside. An edge belongs
//! to the brick of its low end, a cell to the brick of its low corner. Both may reach into the seven
//! bricks above.
//!
//! Invariant: a bit is set exactly where ω > 0, whether sampled or proven; the ring's bits are zero.

use super::{
    MeshError,
    cases::{EDGES, edge},
    prune::{BRICK, BrickKind, Bricks, Lattice, NearBrick},
};
use crate::field::{Field, Points};

/// The inside bits of a brick's nodes, plane by plane.
pub(super) type Signs = [u64; BRICK];

/// The bits of the nodes with x = 0, and the bits of those with y = 0.
const FIRST_COLUMN: u64 = 0x0101_0101_0101_0101;
const FIRST_ROW: u64 = 0xff;

/// Takes the signs of bricks. The points of a brick and ω there are kept as memory for the next one.
#[derive(Debug, Default)]
pub(super) struct SignSampler {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    omega: Vec<f64>,
}

impl SignSampler {
    /// The signs at a brick's own nodes, sampled or proven. Adds to the number of evaluations.
    ///
    /// # Errors
    /// [`MeshError::NotANumber`] at the first NaN.
    pub(super) fn take(
        &mut self,
        field: &dyn Field,
        lattice: &Lattice,
        brick: &NearBrick,
        evaluations: &mut u64,
    ) -> Result<Signs, MeshError> {
        let [columns, rows, planes] = [0, 1, 2].map(|axis| lattice.own_nodes(axis, brick.at[axis]));
        let coordinate = |axis: usize, i: usize| lattice.coordinate(axis, brick.at[axis] * BRICK + i);
        let mut signs = [0; BRICK];
        if brick.solid {
            let row = (1_u64 << columns.end) - (1 << columns.start);
            let plane = rows.fold(0, |plane, y| plane | row << (BRICK * y));
            planes.for_each(|z| signs[z] = plane);
            return Ok(signs);
        }
        self.x.clear();
        self.y.clear();
        self.z.clear();
        for z in planes.clone() {
            for y in rows.clone() {
                self.x.extend(columns.clone().map(|x| coordinate(0, x)));
                self.y.resize(self.x.len(), coordinate(1, y));
            }
            self.z.resize(self.x.len(), coordinate(2, z));
        }
        let points = Points::new(&self.x, &self.y, &self.z);
        self.omega.resize(points.len(), 0.0);
        field.omega_many(points, &mut self.omega);
        *evaluations += points.len() as u64;
        // a separate pass that never leaves early becomes vector code
        if self.omega.iter().fold(false, |any, w| any | w.is_nan()) {
            let first = self.omega.iter().position(|w| w.is_nan()).unwrap_or(0);
            return Err(MeshError::NotANumber { at: points.get(first) });
        }
        let mut values = self.omega.chunks_exact(columns.len().max(1));
        for z in planes {
            for y in rows.clone() {
                let row = values.next().unwrap_or(&[]);
                let bits = row.iter().rev().fold(0_u64, |bits, &w| bits << 1 | u64::from(w > 0.0));
                signs[z] |= bits << (BRICK * y + columns.start);
            }
        }
        Ok(signs)
    }
}

/// A near brick with its crossed edges.
#[derive(Debug, Clone)]
pub(super) struct Brick {
    /// Its number among the near bricks.
    pub number: usize,
    /// The extended indices of its first node.
    pub low: [usize; 3],
    /// Crossed edges by axis and plane.
    pub edges: [Signs; 3],
    /// The number of crossed edges before each word of `edges`.
    before: [[u16; BRICK]; 3],
    /// The bricks above. Entry i − 1 is the brick that is higher on the axes whose bits are set in i.
    upper: [BrickKind; 7],
    /// The number of its first vertex. Vertices on edges come first, then inner ones.
    pub first: u32,
    /// The number of vertices within its cells.
    pub inner: u32,
}

/// The vertices on edges of a brick, and on the edges of the bricks above that its cells use,
/// by [`edge_slot`].
pub(super) type VertexTable = [u32; 3 * SLOTS];

const SLOTS_ALONG: usize = BRICK + 1;
const SLOTS: usize = SLOTS_ALONG.pow(3);

/// The place in the table of the vertex on an edge: the edge along `axis` from a node, which is counted from
/// the brick's first node.
pub(super) const fn edge_slot(axis: usize, [x, y, z]: [usize; 3]) -> usize {
    axis * SLOTS + (z * SLOTS_ALONG + y) * SLOTS_ALONG + x
}

/// An empty table.
pub(super) fn vertex_table() -> Box<VertexTable> {
    Box::new([0; 3 * SLOTS])
}

/// The places in a vertex table for the edges of the first cell. Those of another cell are as much further on
/// as that cell's x edge.
pub(super) const SLOT_OF_EDGE: [usize; EDGES] = {
    let mut slots = [0; EDGES];
    let mut e = 0;
    while e < EDGES {
        let (axis, low) = edge(e);
        slots[e] = edge_slot(axis, [low & 1, low >> 1 & 1, low >> 2 & 1]);
        e += 1;
    }
    slots
};

impl Brick {
    /// A near brick with its neighbours and crossed edges.
    pub(super) fn new(bricks: &Bricks, signs: &[Signs], number: usize) -> Self {
        let at = bricks.near[number].at;
        let upper = [1, 2, 3, 4, 5, 6, 7]
            .map(|i| bricks.kind([0, 1, 2].map(|axis: usize| at[axis] + (i >> axis & 1))));
        let mut brick = Self {
            number,
            low: at.map(|b| b * BRICK),
            edges: [[0; BRICK]; 3],
            before: [[0; BRICK]; 3],
            upper,
            first: 0,
            inner: 0,
        };
        let around = brick.around(signs);
        for z in 0..BRICK {
            let corners = around.corners(z);
            brick.edges[0][z] = corners[0] ^ corners[1];
            brick.edges[1][z] = corners[0] ^ corners[2];
            brick.edges[2][z] = corners[0] ^ corners[4];
        }
        let mut count = 0;
        for (edges, before) in brick.edges.iter().zip(&mut brick.before) {
            for (word, before) in edges.iter().zip(before) {
                *before = count;
                count += word.count_ones() as u16;
            }
        }
        brick
    }

    /// The number of crossed edges.
    pub(super) fn crossings(&self) -> u32 {
        u32::from(self.before[2][BRICK - 1]) + self.edges[2][BRICK - 1].count_ones()
    }

    /// The number of vertices, on edges and within cells.
    pub(super) fn vertices(&self) -> usize {
        (self.crossings() + self.inner) as usize
    }

    /// Calls `visit(axis, node)` for each crossed edge in the order of vertices. Nodes are counted from the
    /// brick's first node.
    pub(super) fn for_each_edge(&self, mut visit: impl FnMut(usize, [usize; 3])) {
        for (axis, planes) in self.edges.iter().enumerate() {
            for (z, &word) in planes.iter().enumerate() {
                for bit in set_positions(word) {
                    visit(axis, [bit % BRICK, bit / BRICK, z]);
                }
            }
        }
    }

    /// The signs of the brick, and of the nodes above that its cells use.
    pub(super) fn around(&self, signs: &[Signs]) -> Around {
        let above = |i: usize, z: usize| match self.upper[i - 1] {
            BrickKind::Solid => u64::MAX,
            BrickKind::Fluid => 0,
            BrickKind::Near(neighbour) => signs[neighbour as usize][z],
        };
        let mut around = Around { planes: [[0; BRICK + 1]; 4] };
        around.planes[0][..BRICK].copy_from_slice(&signs[self.number]);
        for (i, planes) in (1..4).zip(&mut around.planes[1..]) {
            (0..BRICK).for_each(|z| planes[z] = above(i, z));
        }
        (0..4).for_each(|i| around.planes[i][BRICK] = above(i + 4, 0));
        around
    }

    /// Writes the numbers of all vertices that the brick's cells may use. `crossed` gives a near brick by its
    /// number if it is crossed. A brick without a crossed cell has no crossed edge either, because all cells
    /// around such an edge are crossed.
    pub(super) fn number_vertices<'a>(
        &self,
        crossed: impl Fn(u32) -> Option<&'a Self>,
        table: &mut VertexTable,
    ) {
        let mut next = self.first;
        self.for_each_edge(|axis, node| {
            table[edge_slot(axis, node)] = next;
            next += 1;
        });
        for (i, place) in (1..8_usize).zip(self.upper) {
            let BrickKind::Near(neighbour) = place else { continue };
            let Some(neighbour) = crossed(neighbour) else { continue };
            let offset = [0, 1, 2].map(|axis: usize| (i >> axis & 1) * BRICK);
            let mut touching = u64::MAX;
            touching &= if i & 1 == 0 { u64::MAX } else { FIRST_COLUMN };
            touching &= if i & 2 == 0 { u64::MAX } else { FIRST_ROW };
            let planes = if i & 4 == 0 { BRICK } else { 1 };
            // an edge along an axis on which the neighbour is higher leads away from this brick
            for axis in (0..3).filter(|axis| i >> axis & 1 == 0) {
                for z in 0..planes {
                    let word = neighbour.edges[axis][z];
                    for bit in set_positions(word & touching) {
                        let place =
                            u32::from(neighbour.before[axis][z]) + (word & ((1 << bit) - 1)).count_ones();
                        let node = [bit % BRICK + offset[0], bit / BRICK + offset[1], z + offset[2]];
                        table[edge_slot(axis, node)] = neighbour.first + place;
                    }
                }
            }
        }
    }
}

/// The signs of a brick's nodes, and of the nodes of the bricks above that its cells use.
#[derive(Debug)]
pub(super) struct Around {
    /// The planes of the brick itself and of the bricks above it on x, on y, and on both. The last plane
    /// belongs to the four bricks above on z.
    planes: [[u64; BRICK + 1]; 4],
}

impl Around {
    /// Whether the surface passes through any of the brick's cells.
    pub(super) fn is_crossed(&self) -> bool {
        (0..BRICK).any(|z| crossed_cells(&self.corners(z)) != 0)
    }

    /// For each corner c, numbered as in `cases`, a word whose bit x + 8·y is set if that corner of cell (x,
    /// y) in plane `z` is inside.
    pub(super) fn corners(&self, z: usize) -> [u64; 8] {
        let [a, b, c, d] = self.corners_below(z);
        let [e, f, g, h] = self.corners_below(z + 1);
        [a, b, c, d, e, f, g, h]
    }

    fn corners_below(&self, z: usize) -> [u64; 4] {
        let [own, x, y, xy] = &self.planes;
        let (own, x, y, xy) = (own[z], x[z], y[z], xy[z]);
        let along_x = |own: u64, next: u64| own >> 1 & !(FIRST_COLUMN << 7) | (next & FIRST_COLUMN) << 7;
        let along_y = |own: u64, next: u64| own >> 8 | next << 56;
        let shifted = along_x(own, x);
        [own, shifted, along_y(own, y), along_y(shifted, along_x(y, xy))]
    }
}

/// The cells that the surface passes through: those whose corners have both signs.
pub(super) fn crossed_cells(corners: &[u64; 8]) -> u64 {
    let some = corners.iter().fold(0, |bits, c| bits | c);
    let all = corners.iter().fold(u64::MAX, |bits, c| bits & c);
    some & !all
}

/// The corners of one cell: bit c is set if corner c is inside.
pub(super) fn inside_corners(corners: &[u64; 8], cell: usize) -> u8 {
    (0..8).fold(0, |inside, c| inside | ((corners[c] >> cell & 1) as u8) << c)
}

/// The positions of the set bits, ascending.
pub(super) fn set_positions(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = (word != 0).then(|| word.trailing_zeros() as usize)?;
        word &= word - 1;
        Some(bit)
    })
}
