//! Marching cubes: from signs at the nodes to triangles whose vertices lie on ω = 0.
//!
//! Bricks that may hold the surface are found by ranges, then worked on in parallel, twice: signs at their nodes →
//! crossed edges, which are numbered → vertices, normals and triangles, written to where their numbers say.
//!
//! Invariant: bricks and tasks depend on the grid and the field alone, never on the number of threads, and are joined
//! in order.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Grid, Mesh, MeshError,
    cases::{CASES, EDGES, edge},
    collapse::{self, AtNode},
    normals::{self, Gradients},
    patches,
    prune::{BRICK, Bricks, Lattice},
    roots::{Edges, RootFinder},
    signs::{
        Brick, CrossedBricks, Samples, Signs, VertexTable, crossed_cells, edge_slot, inside_corners,
        set_positions,
    },
};
use crate::field::Field;

/// Bricks in a task: some thousand vertices, whose coordinates stay in the nearer caches.
const BRICKS_PER_TASK: usize = 16;

/// The surface ω = 0 of a field as a closed mesh; empty if no node of the grid lies inside.
///
/// Inside is strictly ω > 0; everything outside the grid counts as outside, so a solid cut by the border is
/// closed by faces on it (see [`Mesh::caps`]). `progress` is called from any thread with the share of tasks
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
    let lattice = Lattice::new(grid);
    let near = Bricks::classify(field, &lattice);
    let mut mesh = Mesh::default();
    let sampling = Stage::new(near.near.len(), 0.0, progress);
    let signs = sample(field, &lattice, &near, &mut mesh.work.evaluations, &|| sampling.advance())?;
    let (bricks, found) = number(field, &lattice, &near, &signs, &mut mesh.work.evaluations);
    if found > Mesh::MAX_VERTICES {
        return Err(MeshError::TooManyVertices { found });
    }
    mesh.positions = vec![DVec3::ZERO; found];
    mesh.normals = vec![DVec3::ZERO; found];
    let scene = Scene { field, lattice: &lattice, signs: &signs, bricks: &bricks };
    let jobs = jobs(&bricks.list, &mut mesh.positions, &mut mesh.normals);
    let marching = Stage::new(bricks.list.len(), 0.5, progress);
    let parts: Vec<Result<Part, MeshError>> = jobs
        .into_par_iter()
        .map_init(Scratch::default, |scratch, job| {
            let part = scene.extract(job, scratch);
            marching.advance();
            part
        })
        .collect();
    let parts = parts.into_iter().collect::<Result<Vec<_>, _>>()?;
    let at_nodes = join(&mut mesh, parts);
    collapse::merge_coincident(&mut mesh, at_nodes);
    normals::fill_missing(&mut mesh);
    Ok(mesh)
}

/// One of the two halves of the work, for who waits for it.
struct Stage<'a> {
    tasks: usize,
    done: AtomicUsize,
    /// The share done before it.
    before: f64,
    progress: &'a (dyn Fn(f64) + Sync),
}

impl<'a> Stage<'a> {
    fn new(bricks: usize, before: f64, progress: &'a (dyn Fn(f64) + Sync)) -> Self {
        Self { tasks: bricks.div_ceil(BRICKS_PER_TASK), done: AtomicUsize::new(0), before, progress }
    }

    fn advance(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.progress)(self.before + 0.5 * done as f64 / self.tasks as f64);
    }
}

/// Signs at the nodes of all near bricks; adds to the number of evaluations, and calls `advance` after each task.
///
/// # Errors
/// [`MeshError::NotANumber`] at the first NaN.
pub(super) fn sample(
    field: &dyn Field,
    lattice: &Lattice,
    bricks: &Bricks,
    evaluations: &mut u64,
    advance: &(dyn Fn() + Sync),
) -> Result<Vec<Signs>, MeshError> {
    let tasks: Vec<Result<(Vec<Signs>, u64), MeshError>> = bricks
        .near
        .par_chunks(BRICKS_PER_TASK)
        .map_init(Samples::default, |samples, task| {
            let mut count = 0;
            let signs = task.iter().map(|brick| samples.take(field, lattice, brick, &mut count));
            let signs = signs.collect::<Result<Vec<_>, _>>()?;
            advance();
            Ok((signs, count))
        })
        .collect();
    let mut found = Vec::with_capacity(bricks.near.len());
    for task in tasks {
        let (signs, count) = task?;
        found.extend(signs);
        *evaluations += count;
    }
    Ok(found)
}

/// Crossed edges of all near bricks and the cells that need values, with the numbers of their vertices, and how many
/// there are.
fn number(
    field: &dyn Field,
    lattice: &Lattice,
    near: &Bricks,
    signs: &[Signs],
    evaluations: &mut u64,
) -> (CrossedBricks, usize) {
    let count = near.near.len();
    let tasks = (0..count.div_ceil(BRICKS_PER_TASK)).into_par_iter();
    let made: Vec<(Vec<Brick>, u64)> = tasks
        .map(|task| {
            let first = task * BRICKS_PER_TASK;
            let bricks =
                (first..count.min(first + BRICKS_PER_TASK)).map(|number| Brick::new(near, signs, number));
            let mut crossed: Vec<Brick> = bricks.filter(|brick| brick.is_crossed(signs)).collect();
            let mut evaluations = 0;
            for brick in &mut crossed {
                let around = brick.around(signs);
                brick.patches = patches::find(field, lattice, brick.low, &around, &mut evaluations);
            }
            (crossed, evaluations)
        })
        .collect();
    let mut found = 0;
    let mut bricks = Vec::with_capacity(made.iter().map(|(bricks, _)| bricks.len()).sum());
    for (crossed, count) in made {
        *evaluations += count;
        for mut brick in crossed {
            brick.first = found as u32; // too many are refused before the numbers are used
            found += brick.vertices();
            bricks.push(brick);
        }
    }
    (CrossedBricks::new(bricks, count), found)
}

/// A task: some bricks, and where their vertices go.
struct Job<'a> {
    bricks: std::ops::Range<usize>,
    positions: &'a mut [DVec3],
    normals: &'a mut [DVec3],
}

fn jobs<'a>(bricks: &[Brick], mut positions: &'a mut [DVec3], mut normals: &'a mut [DVec3]) -> Vec<Job<'a>> {
    let mut jobs = Vec::with_capacity(bricks.len().div_ceil(BRICKS_PER_TASK));
    for (i, task) in bricks.chunks(BRICKS_PER_TASK).enumerate() {
        let first = i * BRICKS_PER_TASK;
        let count: usize = task.iter().map(Brick::vertices).sum();
        let (own_positions, other_positions) = positions.split_at_mut(count);
        let (own_normals, other_normals) = normals.split_at_mut(count);
        (positions, normals) = (other_positions, other_normals);
        let bricks = first..first + task.len();
        jobs.push(Job { bricks, positions: own_positions, normals: own_normals });
    }
    jobs
}

/// What a task adds to the mesh besides vertices.
#[derive(Debug, Default)]
struct Part {
    triangles: Vec<[u32; 3]>,
    caps: Vec<u32>,
    at_nodes: Vec<AtNode>,
    evaluations: u64,
    gradients: u64,
}

fn join(mesh: &mut Mesh, parts: Vec<Part>) -> Vec<AtNode> {
    let mut at_nodes = Vec::new();
    mesh.triangles.reserve_exact(parts.iter().map(|part| part.triangles.len()).sum());
    for part in parts {
        mesh.triangles.extend(part.triangles);
        mesh.caps.extend(part.caps);
        at_nodes.extend(part.at_nodes);
        mesh.work.evaluations += part.evaluations;
        mesh.work.gradients += part.gradients;
    }
    at_nodes
}

/// What all tasks read.
struct Scene<'a> {
    field: &'a dyn Field,
    lattice: &'a Lattice,
    signs: &'a [Signs],
    bricks: &'a CrossedBricks,
}

/// Memory that a thread keeps from task to task.
struct Scratch {
    /// Crossed edges by axis, without those that leave the grid.
    edges: [Edges; 3],
    /// For each of them its vertex and its low end.
    ends: [Vec<(u32, [usize; 3])>; 3],
    roots: Vec<f64>,
    finder: RootFinder,
    gradients: Gradients,
    vertices: Box<VertexTable>,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            edges: Default::default(),
            ends: Default::default(),
            roots: Vec::new(),
            finder: RootFinder::default(),
            gradients: Gradients::default(),
            vertices: Box::new([0; size_of::<VertexTable>() / size_of::<u32>()]),
        }
    }
}

impl Scene<'_> {
    fn extract(&self, job: Job<'_>, scratch: &mut Scratch) -> Result<Part, MeshError> {
        let mut part = Part::default();
        self.place_vertices(&job.bricks, job.positions, scratch, &mut part)?;
        part.gradients = job.positions.len() as u64;
        scratch.gradients.normals(self.field, job.positions, job.normals);
        let first = self.bricks.list.get(job.bricks.start).map_or(0, |brick| brick.first);
        for &cap in &part.caps {
            job.normals[(cap - first) as usize] = DVec3::ZERO;
        }
        part.triangles.reserve(2 * job.positions.len() + 64);
        for number in job.bricks {
            self.add_triangles(number, &mut scratch.vertices, &mut part.triangles);
        }
        Ok(part)
    }

    /// Puts a vertex on each crossed edge: at ω = 0, or at the border if the edge leaves the grid.
    fn place_vertices(
        &self,
        bricks: &std::ops::Range<usize>,
        positions: &mut [DVec3],
        scratch: &mut Scratch,
        part: &mut Part,
    ) -> Result<(), MeshError> {
        let Scratch { edges, ends, roots, finder, .. } = scratch;
        edges.iter_mut().for_each(Edges::clear);
        ends.iter_mut().for_each(Vec::clear);
        let first = self.bricks.list.get(bricks.start).map_or(0, |brick| brick.first);
        let mut vertex = first;
        for brick in &self.bricks.list[bricks.clone()] {
            brick.for_each_edge(|axis, node| {
                let low = [0, 1, 2].map(|a| brick.low[a] + node[a]);
                let mut high = low;
                high[axis] += 1;
                let position = self.lattice.position(low);
                if self.lattice.is_ring(axis, low[axis]) || self.lattice.is_ring(axis, high[axis]) {
                    // the end in the grid
                    let node = if self.lattice.is_ring(axis, low[axis]) { high } else { low };
                    positions[(vertex - first) as usize] = position;
                    part.caps.push(vertex);
                    part.at_nodes.push(AtNode { node: self.lattice.key(node), vertex });
                } else {
                    edges[axis].low.push(position[axis]);
                    edges[axis].high.push(self.lattice.coordinate(axis, high[axis]));
                    edges[axis].across[0].push(position[(axis + 1) % 3]);
                    edges[axis].across[1].push(position[(axis + 2) % 3]);
                    ends[axis].push((vertex, low));
                }
                vertex += 1;
            });
            for inner in brick.patches.iter().flat_map(|patch| &patch.inner) {
                positions[(vertex - first) as usize] = *inner;
                vertex += 1;
            }
        }
        for (axis, edges) in edges.iter().enumerate() {
            roots.clear();
            part.evaluations += finder.solve(self.field, axis, edges, roots)?;
            for (i, (&root, &(vertex, low))) in roots.iter().zip(&ends[axis]).enumerate() {
                let position = &mut positions[(vertex - first) as usize];
                position[axis] = root;
                position[(axis + 1) % 3] = edges.across[0][i];
                position[(axis + 2) % 3] = edges.across[1][i];
                // a root may have met either end
                let mut node = low;
                node[axis] += usize::from(root == edges.high[i]);
                if root == edges.low[i] || root == edges.high[i] {
                    part.at_nodes.push(AtNode { node: self.lattice.key(node), vertex });
                }
            }
        }
        Ok(())
    }

    /// Triangles of all cells of a brick.
    fn add_triangles(&self, number: usize, vertices: &mut VertexTable, triangles: &mut Vec<[u32; 3]>) {
        let brick = &self.bricks.list[number];
        let around = brick.around(self.signs);
        let mut is_numbered = false;
        for z in 0..BRICK {
            let corners = around.corners(z);
            let cells = crossed_cells(&corners);
            if cells != 0 && !is_numbered {
                brick.number_vertices(self.bricks, vertices);
                is_numbered = true;
            }
            for cell in set_positions(cells) {
                let base = edge_slot(0, [cell % BRICK, cell / BRICK, z]);
                let of_cell = CASES.triangles(inside_corners(&corners, cell));
                let vertex = |e: u8| vertices[base + SLOT_OF_EDGE[usize::from(e)]];
                triangles.extend(of_cell.iter().map(|t| t.map(vertex)));
            }
        }
        let mut next = brick.first + brick.vertices() as u32;
        for patch in brick.patches.iter().rev() {
            next -= patch.inner.len() as u32;
            let (z, bit) = patch.cell;
            let base = edge_slot(0, [bit % BRICK, bit / BRICK, z]);
            let vertex = |e: u8| match usize::from(e) {
                e if e < EDGES => vertices[base + SLOT_OF_EDGE[e]],
                inner => next + (inner - EDGES) as u32,
            };
            triangles.extend(patch.triangles.iter().map(|t| t.map(vertex)));
        }
    }
}

/// Where the vertex of each edge of the first cell stands in a vertex table; that of another cell stands as much
/// further on as the cell's x edge.
const SLOT_OF_EDGE: [usize; EDGES] = {
    let mut slots = [0; EDGES];
    let mut e = 0;
    while e < EDGES {
        let (axis, low) = edge(e);
        slots[e] = edge_slot(axis, [low & 1, low >> 1 & 1, low >> 2 & 1]);
        e += 1;
    }
    slots
};
