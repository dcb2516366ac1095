//! Marching cubes: from signs at the nodes to triangles whose vertices lie on ω = 0.
//!
//! The grid is cut into blocks of cell layers; each block is a task of its own with two layers of samples. Both
//! blocks at a cut sample its plane, so they find the same crossed edges there and number them alike: the upper
//! block owns those vertices, and the lower one's numbers simply run on into them.
//!
//! Invariant: blocks depend on the grid alone, never on the number of threads, and are joined in order.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Grid, Mesh, MeshError,
    cases::{CASES, EDGES, edge},
    collapse::{self, AtNode},
    layer::{EdgeRows, Layer, RowPoints, Shape, set_positions, shifted},
    normals,
    prune::{BRICK, Bricks},
    roots::{self, Bracket},
};
use crate::field::Field;

/// Layers of cells in a block: one layer in seventeen is sampled twice, and 128³ cells make eight tasks.
const BLOCK: usize = 2 * BRICK;

/// The surface ω = 0 of a field as a closed mesh; empty if no node of the grid lies inside.
///
/// Inside is strictly ω > 0; everything outside the grid counts as outside, so a solid cut by the border is
/// closed by faces on it (see [`Mesh::caps`]). `progress` is called from any thread with the share of blocks
/// done, in (0, 1], not always in ascending order.
///
/// # Errors
/// [`MeshError::NotANumber`] if ω is NaN at a node or on an edge that crosses the surface,
/// [`MeshError::TooManyVertices`] beyond [`Mesh::MAX_VERTICES`].
pub fn marching_cubes(
    field: &dyn Field,
    grid: &Grid,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Mesh, MeshError> {
    let nodes = [0, 1, 2].map(|axis| grid.nodes(axis));
    let count = grid.cells()[2].div_ceil(BLOCK);
    let done = AtomicUsize::new(0);
    let blocks: Vec<Result<Block, MeshError>> = (0..count)
        .into_par_iter()
        .with_max_len(1)
        .map(|index| {
            let block = Block::extract(field, &nodes, index);
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count as f64);
            block
        })
        .collect();
    let (mut mesh, at_nodes) = join(blocks)?;
    collapse::merge_coincident(&mut mesh, at_nodes);
    normals::add(field, &mut mesh);
    Ok(mesh)
}

/// What one block adds to the mesh. Vertex numbers count from the block's first vertex.
#[derive(Debug, Default)]
struct Block {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    caps: Vec<u32>,
    at_nodes: Vec<AtNode>,
    evaluations: u64,
}

fn join(blocks: Vec<Result<Block, MeshError>>) -> Result<(Mesh, Vec<AtNode>), MeshError> {
    let blocks = blocks.into_iter().collect::<Result<Vec<_>, _>>()?;
    let found: usize = blocks.iter().map(|block| block.positions.len()).sum();
    if found > Mesh::MAX_VERTICES {
        return Err(MeshError::TooManyVertices { found });
    }
    let mut mesh = Mesh { positions: Vec::with_capacity(found), ..Mesh::default() };
    mesh.triangles.reserve_exact(blocks.iter().map(|block| block.triangles.len()).sum());
    let mut at_nodes = Vec::new();
    for block in blocks {
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(block.positions);
        mesh.triangles.extend(block.triangles.into_iter().map(|t| t.map(|v| v + base)));
        mesh.caps.extend(block.caps.into_iter().map(|v| v + base));
        at_nodes.extend(block.at_nodes.into_iter().map(|at| AtNode { vertex: at.vertex + base, ..at }));
        mesh.work.evaluations += block.evaluations;
    }
    Ok((mesh, at_nodes))
}

/// A crossed edge, as its low end in extended indices and ω at both ends.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    axis: usize,
    low: [usize; 3],
    omega: [f64; 2],
}

/// A plane of nodes with the crossed edges in it.
struct Plane {
    samples: Layer,
    x_edges: EdgeRows,
    y_edges: EdgeRows,
}

/// The two planes of nodes around a layer of cells, and the edges between them.
struct Slab {
    shape: Shape,
    lower: Plane,
    upper: Plane,
    z_edges: EdgeRows,
}

impl Block {
    /// Marches block `index`: extended cell layers, the first and last block with the ring's.
    fn extract(field: &dyn Field, nodes: &[Vec<f64>; 3], index: usize) -> Result<Self, MeshError> {
        let cells = [0, 1, 2].map(|axis: usize| nodes[axis].len() - 1);
        let (first, end) = (index * BLOCK, cells[2].min((index + 1) * BLOCK));
        let shape = Shape::new(cells);
        let bricks = Bricks::classify(field, nodes, first, end);
        // Extended planes: plane k of the grid is k + 1.
        let first_plane = if first == 0 { 0 } else { first + 1 };
        let last_plane = if end == cells[2] { end + 2 } else { end + 1 };

        let mut block = Self::default();
        let mut scratch = RowPoints::new(shape);
        let mut sample = |layer: &mut Layer, plane: usize| {
            if (1..=cells[2] + 1).contains(&plane) {
                layer.sample(field, nodes, plane - 1, &bricks, &mut scratch)
            } else {
                layer.clear();
                Ok(0)
            }
        };
        let mut crossings = Vec::new();
        let mut next = 0;
        let mut slab = Slab::new(shape);
        block.evaluations += sample(&mut slab.upper.samples, first_plane)?;
        slab.upper.number(shape, &mut next);
        for plane in first_plane..last_plane {
            std::mem::swap(&mut slab.lower, &mut slab.upper);
            slab.lower.list_crossings(plane, &mut crossings);
            block.evaluations += sample(&mut slab.upper.samples, plane + 1)?;
            slab.z_edges.along_z(shape, &slab.lower.samples, &slab.upper.samples, &mut next);
            slab.list_crossings(plane, &mut crossings);
            slab.upper.number(shape, &mut next);
            slab.add_triangles(&mut block.triangles);
        }
        block.place_vertices(field, nodes, &crossings)?;
        Ok(block)
    }

    /// Puts a vertex on each crossed edge: at ω = 0, or at the border if the edge leaves the grid.
    fn place_vertices(
        &mut self,
        field: &dyn Field,
        nodes: &[Vec<f64>; 3],
        crossings: &[Crossing],
    ) -> Result<(), MeshError> {
        // The ring's nodes have no place of their own: an edge to one shrinks to its end on the border.
        let clamped = |axis: usize, extended: usize| extended.clamp(1, nodes[axis].len()) - 1;
        let place = |at: [usize; 3]| {
            let [x, y, z] = [0, 1, 2].map(|axis| nodes[axis][clamped(axis, at[axis])]);
            DVec3::new(x, y, z)
        };
        let leaves_grid = |c: &Crossing| c.low[c.axis] == 0 || c.low[c.axis] == nodes[c.axis].len();
        let brackets: Vec<Bracket> = crossings
            .iter()
            .filter(|c| !leaves_grid(c))
            .map(|c| Bracket {
                axis: c.axis,
                from: place(c.low),
                to: nodes[c.axis][c.low[c.axis]],
                omega: c.omega,
            })
            .collect();
        let mut found = Vec::with_capacity(brackets.len());
        self.evaluations += roots::solve(field, &brackets, &mut found)?;

        let mut found = found.into_iter();
        for crossing in crossings {
            let vertex = self.positions.len() as u32;
            let mut position = place(crossing.low);
            let (mut low, mut high) = (crossing.low, crossing.low);
            high[crossing.axis] += 1;
            if leaves_grid(crossing) {
                self.caps.push(vertex);
            } else if let Some(root) = found.next() {
                position[crossing.axis] = root;
            }
            // On a cap the node is the end inside the grid; elsewhere a root may have met either end.
            if leaves_grid(crossing) && crossing.low[crossing.axis] == 0 {
                low = high;
            }
            let node = [low, high].into_iter().find(|&end| place(end) == position);
            self.at_nodes.extend(node.map(|node| AtNode { node: node.map(|i| i as u32), vertex }));
            self.positions.push(position);
        }
        Ok(())
    }
}

impl Plane {
    fn outside(shape: Shape) -> Self {
        Self { samples: Layer::outside(shape), x_edges: EdgeRows::default(), y_edges: EdgeRows::default() }
    }

    fn number(&mut self, shape: Shape, next: &mut u32) {
        self.x_edges.along_x(shape, &self.samples, next);
        self.y_edges.along_y(shape, &self.samples, next);
    }

    /// Lists the crossed edges in the plane, in the order of their numbers.
    fn list_crossings(&self, plane: usize, crossings: &mut Vec<Crossing>) {
        let omega = |column, row| self.samples.omega(column, row);
        self.x_edges.for_each(|i, j| {
            crossings.push(Crossing { axis: 0, low: [i, j, plane], omega: [omega(i, j), omega(i + 1, j)] });
        });
        self.y_edges.for_each(|i, j| {
            crossings.push(Crossing { axis: 1, low: [i, j, plane], omega: [omega(i, j), omega(i, j + 1)] });
        });
    }
}

impl Slab {
    fn new(shape: Shape) -> Self {
        Self {
            shape,
            lower: Plane::outside(shape),
            upper: Plane::outside(shape),
            z_edges: EdgeRows::default(),
        }
    }

    /// Lists the crossed edges between the planes, in the order of their numbers.
    fn list_crossings(&self, plane: usize, crossings: &mut Vec<Crossing>) {
        self.z_edges.for_each(|i, j| {
            let omega = [self.lower.samples.omega(i, j), self.upper.samples.omega(i, j)];
            crossings.push(Crossing { axis: 2, low: [i, j, plane], omega });
        });
    }

    fn add_triangles(&self, triangles: &mut Vec<[u32; 3]>) {
        let rows = self.shape.nodes[1];
        for row in 0..rows - 1 {
            // Rows of nodes along x around this row of cells; bits 0 and 1 of the index are y and z.
            let around = [
                self.lower.samples.row(row),
                self.lower.samples.row(row + 1),
                self.upper.samples.row(row),
                self.upper.samples.row(row + 1),
            ];
            for word in 0..self.shape.words {
                let some = around.iter().fold(0, |bits, r| bits | r[word] | shifted(r, word));
                let all = around.iter().fold(u64::MAX, |bits, r| bits & r[word] & shifted(r, word));
                for bit in set_positions(some & !all) {
                    let inside = (0..4).fold(0_u8, |mask, i| {
                        let pair = around[i][word] >> bit & 1 | (shifted(around[i], word) >> bit & 1) << 1;
                        mask | (pair as u8) << (2 * i)
                    });
                    self.add_cell(inside, 64 * word + bit, row, triangles);
                }
            }
        }
    }

    fn add_cell(&self, inside: u8, column: usize, row: usize, triangles: &mut Vec<[u32; 3]>) {
        let mut vertices = [None; EDGES];
        let mut vertex = |e: u8| {
            let e = usize::from(e);
            *vertices[e].get_or_insert_with(|| self.vertex(e, column, row))
        };
        triangles.extend(CASES.triangles(inside).iter().map(|triangle| triangle.map(&mut vertex)));
    }

    /// Number of the vertex on a cell's edge.
    fn vertex(&self, e: usize, column: usize, row: usize) -> u32 {
        let (axis, low) = edge(e);
        let (column, row) = (column + (low & 1), row + (low >> 1 & 1));
        let plane = if low >> 2 & 1 == 0 { &self.lower } else { &self.upper };
        match axis {
            0 => plane.x_edges.number(column, row),
            1 => plane.y_edges.number(column, row),
            _ => self.z_edges.number(column, row),
        }
    }
}
