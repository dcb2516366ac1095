//! Where the surface is: bricks of cells that it may pass, the signs at their nodes, and its hits on their edges.
//!
//! Extended indices: a ring of virtual nodes that count as outside surrounds the grid, so node i of the grid has
//! extended index i + 1. The ring's nodes lie on the border: a cell of the ring has no thickness, and a solid that
//! leaves the grid is closed there without special cases.
//!
//! Invariant: bricks depend on the grid and the field alone and are listed in ascending order; an edge belongs to the
//! brick that holds its low end.

use glam::{DVec3, UVec3};
use rayon::prelude::*;

use super::super::{
    Grid, MeshError,
    cases::edge,
    normals::{gradients, unit},
    roots::{Edges, RootFinder},
};
use crate::{
    field::{Field, Points},
    geom::Aabb,
};

/// Cells along a brick's side. Each brick samples all its 9³ nodes, 42 % more than it owns, in one call.
pub(super) const SIDE: usize = 8;
/// Nodes along a brick's side.
const NODES: usize = SIDE + 1;

/// The coordinates of the extended nodes on each axis.
pub(super) struct Frame {
    coordinates: [Vec<f64>; 3],
    /// Side lengths of a cell.
    pub spacing: DVec3,
}

/// Where the surface crosses an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub position: DVec3,
    /// Outward unit normal; zero where the field has none.
    pub normal: DVec3,
    /// Whether the edge leaves the grid: the hit lies on the border inside the solid.
    pub is_cap: bool,
}

/// A brick that holds crossed edges or touches such.
pub(super) struct Brick {
    /// Its lowest node, extended.
    pub low: UVec3,
    /// Inside bits of nodes along x, for rows j + 9·k.
    inside: [u16; NODES * NODES],
    /// Crossed edges by axis and plane: bit 8·j + i for the low end (i, j).
    crossed: [[u64; SIDE]; 3],
    /// Number of the first crossed edge of each plane.
    before: [[u16; SIDE]; 3],
    /// In the order of their edges' numbers.
    pub hits: Vec<Hit>,
    pub evaluations: u64,
    /// The bricks above: bit 0 of the index is x, bit 1 y, bit 2 z. The brick itself comes first.
    pub above: [Option<u32>; 8],
}

impl Frame {
    pub fn new(grid: &Grid) -> Self {
        let coordinates = [0, 1, 2].map(|axis| {
            let mut nodes = grid.nodes(axis);
            nodes.insert(0, nodes[0]);
            nodes.push(nodes[nodes.len() - 1]);
            nodes
        });
        Self { coordinates, spacing: grid.spacing() }
    }

    pub fn place(&self, node: UVec3) -> DVec3 {
        let [x, y, z] = [0, 1, 2].map(|axis| self.coordinates[axis][node[axis] as usize]);
        DVec3::new(x, y, z)
    }

    /// The box of a cell; without thickness in the ring.
    pub fn cell(&self, low: UVec3) -> Aabb {
        Aabb::new(self.place(low), self.place(low + 1))
    }

    fn is_ring(&self, axis: usize, node: u32) -> bool {
        node == 0 || node as usize == self.coordinates[axis].len() - 1
    }

    /// Bricks along each axis.
    fn bricks(&self) -> UVec3 {
        let count = |axis: usize| (self.coordinates[axis].len() - 1).div_ceil(SIDE) as u32;
        UVec3::new(count(0), count(1), count(2))
    }

    fn last_node(&self) -> UVec3 {
        UVec3::from_array([0, 1, 2].map(|axis| self.coordinates[axis].len() as u32 - 1))
    }

    /// The low nodes of the bricks that the surface may pass, ascending by z, y, x. Boxes of bricks are halved until the
    /// field's range proves a sign or one brick is left.
    fn near(&self, field: &dyn Field) -> Vec<UVec3> {
        let mut found = Vec::new();
        let mut boxes = vec![(UVec3::ZERO, self.bricks())];
        while let Some((low, high)) = boxes.pop() {
            let (first, last) = (low * SIDE as u32, (high * SIDE as u32).min(self.last_node()));
            let range = field.range(&Aabb::new(self.place(first), self.place(last)));
            let touches_ring = first.min_element() == 0 || last.cmpeq(self.last_node()).any();
            if range.hi <= 0.0 || (range.lo > 0.0 && !touches_ring) {
                continue;
            }
            let extent = high - low;
            let axis = (0..3).max_by_key(|&axis| extent[axis]).unwrap_or(0);
            if extent[axis] > 1 {
                let middle = low[axis] + extent[axis] / 2;
                let (mut below, mut above) = (high, low);
                below[axis] = middle;
                above[axis] = middle;
                boxes.extend([(low, below), (above, high)]);
            } else {
                found.push(first);
            }
        }
        found.sort_unstable_by_key(|low| order(*low));
        found
    }
}

fn order(low: UVec3) -> [u32; 3] {
    [low.z, low.y, low.x]
}

/// All bricks with active cells, with their hits. `done` is called after each.
///
/// # Errors
/// [`MeshError::NotANumber`] at the first NaN in the order of bricks.
pub(super) fn find(
    field: &dyn Field,
    frame: &Frame,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Brick>, MeshError> {
    let near = frame.near(field);
    let count = near.len();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let bricks: Vec<Result<Option<Brick>, MeshError>> = near
        .into_par_iter()
        .map_init(Samples::default, |samples, low| {
            let brick = Brick::sample(field, frame, low, samples);
            let done = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
            if done.is_multiple_of(64) || done == count {
                progress(done as f64 / count as f64);
            }
            brick
        })
        .collect();
    let bricks: Result<Vec<Option<Brick>>, MeshError> = bricks.into_iter().collect();
    let mut bricks: Vec<Brick> = bricks?.into_iter().flatten().collect();
    let keys: Vec<[u32; 3]> = bricks.iter().map(|brick| order(brick.low)).collect();
    for brick in &mut bricks {
        brick.above = std::array::from_fn(|i| {
            let step = SIDE as u32 * UVec3::new(i as u32 & 1, i as u32 >> 1 & 1, i as u32 >> 2);
            keys.binary_search(&order(brick.low + step)).ok().map(|slot| slot as u32)
        });
    }
    Ok(bricks)
}

/// Scratch for the nodes of one brick, x fastest.
struct Samples {
    columns: [Vec<f64>; 3],
    omega: Vec<f64>,
}

impl Default for Samples {
    fn default() -> Self {
        Self { columns: std::array::from_fn(|_| vec![0.0; NODES.pow(3)]), omega: vec![0.0; NODES.pow(3)] }
    }
}

impl Samples {
    fn take(
        &mut self,
        field: &dyn Field,
        frame: &Frame,
        low: UVec3,
        size: [usize; 3],
    ) -> Result<(), MeshError> {
        let count = size.iter().product();
        let mut at = 0;
        let [x, y, z] = [0, 1, 2].map(|axis| &frame.coordinates[axis][low[axis] as usize..][..size[axis]]);
        for &z in z {
            for &y in y {
                self.columns[0][at..at + size[0]].copy_from_slice(x);
                self.columns[1][at..at + size[0]].fill(y);
                self.columns[2][at..at + size[0]].fill(z);
                at += size[0];
            }
        }
        let [x, y, z] = self.columns.each_ref().map(|column| &column[..count]);
        let points = Points::new(x, y, z);
        let omega = &mut self.omega[..count];
        field.omega_many(points, omega);
        if omega.iter().fold(false, |any, w| any | w.is_nan()) {
            let first = omega.iter().position(|w| w.is_nan()).unwrap_or(0);
            return Err(MeshError::NotANumber { at: points.get(first) });
        }
        Ok(())
    }
}

impl Brick {
    /// Samples a brick and finds its hits; nothing if the surface does not pass it.
    fn sample(
        field: &dyn Field,
        frame: &Frame,
        low: UVec3,
        samples: &mut Samples,
    ) -> Result<Option<Self>, MeshError> {
        let size = [0, 1, 2].map(|axis| NODES.min(frame.coordinates[axis].len() - low[axis] as usize));
        samples.take(field, frame, low, size)?;
        let at = |i: usize, j: usize, k: usize| samples.omega[(k * size[1] + j) * size[0] + i];
        let is_ring = |axis: usize, i: usize| frame.is_ring(axis, low[axis] + i as u32);
        let mut brick = Self {
            low,
            inside: [0; NODES * NODES],
            crossed: [[0; SIDE]; 3],
            before: [[0; SIDE]; 3],
            hits: Vec::new(),
            evaluations: size.iter().product::<usize>() as u64,
            above: [None; 8],
        };
        for k in (0..size[2]).filter(|&k| !is_ring(2, k)) {
            for j in (0..size[1]).filter(|&j| !is_ring(1, j)) {
                let bits = (0..size[0]).fold(0, |bits, i| bits | u16::from(at(i, j, k) > 0.0) << i);
                let ring = u16::from(is_ring(0, 0)) | u16::from(is_ring(0, size[0] - 1)) << (size[0] - 1);
                brick.inside[k * NODES + j] = bits & !ring;
            }
        }
        if brick.inside.iter().all(|&row| row == 0)
            || (size == [NODES; 3] && brick.inside.iter().all(|&row| row == (1 << NODES) - 1))
        {
            return Ok(None);
        }
        brick.find_crossed();
        brick.find_hits(field, frame)?;
        Ok(Some(brick))
    }

    fn row(&self, j: usize, k: usize) -> u16 {
        self.inside[k * NODES + j]
    }

    pub fn is_inside(&self, [i, j, k]: [usize; 3]) -> bool {
        self.row(j, k) >> i & 1 == 1
    }

    fn find_crossed(&mut self) {
        for k in 0..SIDE {
            for j in 0..SIDE {
                let row = self.row(j, k);
                let changes = [row ^ row >> 1, row ^ self.row(j + 1, k), row ^ self.row(j, k + 1)];
                for (axis, change) in changes.into_iter().enumerate() {
                    self.crossed[axis][k] |= u64::from(change & 0xff) << (8 * j);
                }
            }
        }
        let mut next = 0;
        for axis in 0..3 {
            for k in 0..SIDE {
                self.before[axis][k] = next;
                next += self.crossed[axis][k].count_ones() as u16;
            }
        }
    }

    /// Calls `visit(axis, low end)` for each crossed edge in the order of numbers.
    pub fn for_each_crossed(&self, mut visit: impl FnMut(usize, [usize; 3])) {
        for axis in 0..3 {
            for k in 0..SIDE {
                let mut word = self.crossed[axis][k];
                while word != 0 {
                    let bit = word.trailing_zeros() as usize;
                    word &= word - 1;
                    visit(axis, [bit % 8, bit / 8, k]);
                }
            }
        }
    }

    /// Number of a crossed edge among those of this brick.
    fn number(&self, axis: usize, [i, j, k]: [usize; 3]) -> u32 {
        let below = self.crossed[axis][k] & ((1 << (8 * j + i)) - 1);
        u32::from(self.before[axis][k]) + below.count_ones()
    }

    /// The brick that an edge of a cell belongs to, by its place in [`Self::above`], and the edge's number there.
    pub fn owner(&self, bricks: &[Self], cell: [usize; 3], e: u8) -> Option<(u32, u32)> {
        let (axis, corner) = edge(e.into());
        let node: [usize; 3] = std::array::from_fn(|a| cell[a] + (corner >> a & 1));
        let which = (0..3).fold(0, |bits, a| bits | (node[a] / SIDE) << a);
        let slot = self.above[which]?;
        Some((slot, bricks[slot as usize].number(axis, node.map(|n| n % SIDE))))
    }

    /// Calls `visit(cell, inside corners)` for each cell with corners on both sides.
    pub fn for_each_active(&self, mut visit: impl FnMut([usize; 3], u8)) {
        for k in 0..SIDE {
            for j in 0..SIDE {
                let rows = [self.row(j, k), self.row(j + 1, k), self.row(j, k + 1), self.row(j + 1, k + 1)];
                let some = rows.iter().fold(0, |bits, r| bits | r | r >> 1);
                let all = rows.iter().fold(u16::MAX, |bits, r| bits & r & r >> 1);
                let mut active = some & !all & 0xff;
                while active != 0 {
                    let i = active.trailing_zeros() as usize;
                    active &= active - 1;
                    let inside = (0..4).fold(0, |mask, r| mask | (rows[r] >> i & 3) << (2 * r));
                    visit([i, j, k], inside as u8);
                }
            }
        }
    }

    fn find_hits(&mut self, field: &dyn Field, frame: &Frame) -> Result<(), MeshError> {
        let low = self.low;
        // by axis, in the order of the hits
        let mut edges: [Edges; 3] = Default::default();
        let mut hits = Vec::new();
        self.for_each_crossed(|axis, [i, j, k]| {
            let near = low + UVec3::new(i as u32, j as u32, k as u32);
            let far = near[axis] + 1;
            let (position, to) = (frame.place(near), frame.coordinates[axis][far as usize]);
            let is_cap = frame.is_ring(axis, near[axis]) || frame.is_ring(axis, far);
            let normal = if frame.is_ring(axis, far) { DVec3::AXES[axis] } else { -DVec3::AXES[axis] };
            if !is_cap {
                let [first, second] = &mut edges[axis].across;
                first.push(position[(axis + 1) % 3]);
                second.push(position[(axis + 2) % 3]);
                edges[axis].low.push(position[axis]);
                edges[axis].high.push(to);
            }
            hits.push((axis, Hit { position, normal, is_cap }));
        });
        let mut finder = RootFinder::default();
        for (axis, edges) in edges.iter().enumerate() {
            let mut roots = Vec::with_capacity(edges.low.len());
            self.evaluations += finder.solve(field, axis, edges, &mut roots)?;
            let on_axis = hits.iter_mut().filter(|(along, hit)| *along == axis && !hit.is_cap);
            for ((_, hit), root) in on_axis.zip(roots) {
                hit.position[axis] = root;
            }
        }
        let mut hits: Vec<Hit> = hits.into_iter().map(|(_, hit)| hit).collect();
        let positions: Vec<DVec3> = hits.iter().filter(|hit| !hit.is_cap).map(|hit| hit.position).collect();
        let mut normals = gradients(field, &positions).into_iter();
        for hit in hits.iter_mut().filter(|hit| !hit.is_cap) {
            let gradient = normals.next().map_or(DVec3::ZERO, |(_, gradient)| gradient);
            hit.normal = unit(-gradient).unwrap_or(DVec3::ZERO);
        }
        self.hits = hits;
        Ok(())
    }
}
