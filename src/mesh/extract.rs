//! Marching cubes: from signs at the nodes to triangles whose vertices lie on ω = 0.
//!
//! Bricks that may hold the surface are worked on in parallel, three times. First come the signs at their
//! nodes; then the crossed edges and the cells that need values, whose vertices and triangles are numbered;
//! then the vertices, normals and triangles, which are written to the places that their numbers say.
//!
//! Invariant: bricks and tasks depend on the grid and the field alone, never on the number of threads; each
//! task writes to its own part of the mesh.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Grid, Mesh, MeshError,
    cases::{CASES, EDGES},
    collapse,
    crossings::{self, BRICKS_PER_TASK, Crossed, EdgeScratch, OnEdges, ProgressPart, Task},
    normals::{self, GradientColumns},
    patches::{self, CellPatch},
    prune::{BRICK, Bricks, Lattice},
    signs::{
        Around, Brick, SLOT_OF_EDGE, Signs, VertexTable, crossed_cells, edge_slot, inside_corners,
        set_positions, vertex_table,
    },
};
use crate::field::Field;
use crate::mesh::Watch;

/// The surface ω = 0 of a field as a closed mesh. It is empty if no node of the grid lies inside.
///
/// Inside is strictly ω > 0. Everything outside the grid counts as outside, so a solid cut by the border is
/// closed by faces on it (see [`Mesh::caps`]). `watch` receives the completed share of the tasks, and may end
/// them. Source: W. Lorensen, H. Cline, Marching cubes, SIGGRAPH 1987, with the decisions about ambiguous
/// cells of `ambiguity`.
///
/// # Errors
/// [`MeshError::NotANumber`] if ω is NaN at a node or on an edge that crosses the surface,
/// [`MeshError::TooManyVertices`] beyond [`Mesh::MAX_VERTICES`], [`MeshError::Ended`] if `watch` ends the work.
pub fn marching_cubes(field: &dyn Field, grid: &Grid, watch: &dyn Watch) -> Result<Mesh, MeshError> {
    let lattice = Lattice::new(grid);
    let near = Bricks::classify(field, &lattice);
    let mut mesh = Mesh::default();
    let sampling = ProgressPart::new(near.near.len().div_ceil(BRICKS_PER_TASK), 0.0..0.5, watch);
    let signs = crossings::sample(field, &lattice, &near, &mut mesh.work.evaluations, &sampling)?;
    let crossed = Crossed::number(&near, &signs, |brick, around| {
        let cells = BrickTriangles::new(field, &lattice, brick.low, around);
        brick.inner = cells.patches.iter().map(|patch| patch.inner.len() as u32).sum();
        cells
    });
    MeshError::check_vertices(crossed.vertices)?;
    // rayon writes the zeros, so each thread touches memory of its own for the first time
    [mesh.positions, mesh.normals] =
        [(); 2].map(|()| rayon::iter::repeat_n(DVec3::ZERO, crossed.vertices).collect());
    let counts = crossed.tasks.iter().map(|task| task.kept.iter().map(|cells| cells.triangles).sum());
    let counts: Vec<usize> = counts.collect();
    mesh.triangles = rayon::iter::repeat_n([0; 3], counts.iter().sum()).collect();

    let marching = ProgressPart::new(crossed.tasks.len(), 0.5..1.0, watch);
    let vertices = || crossed.tasks.iter().map(|task| task.vertices);
    let positions = crossings::parts(&mut mesh.positions, vertices());
    let normals = crossings::parts(&mut mesh.normals, vertices());
    let triangles = crossings::parts(&mut mesh.triangles, counts.into_iter());
    let extraction = Extraction { field, lattice: &lattice, signs: &signs, crossed: &crossed };
    let jobs = crossed.tasks.par_iter().zip(positions).zip(normals).zip(triangles);
    let found: Vec<Result<OnEdges, MeshError>> = jobs
        .map_init(ExtractionScratch::default, |scratch, (((task, positions), normals), triangles)| {
            let job = ExtractionJob { task, positions, normals, triangles };
            marching.run(|| extraction.extract(job, scratch))
        })
        .collect();
    for cells in crossed.tasks.iter().flat_map(|task| &task.kept) {
        mesh.work.evaluations += cells.evaluations;
    }
    let mut at_nodes = Vec::new();
    for found in found {
        let found = found?;
        mesh.caps.extend(found.caps.iter().map(|cap| cap.vertex));
        at_nodes.extend(found.at_nodes);
        mesh.work.evaluations += found.evaluations;
    }
    mesh.work.gradients += crossed.vertices as u64;
    collapse::merge_coincident(&mut mesh, at_nodes);
    normals::fill_missing(&mut mesh);
    Ok(mesh)
}

/// The triangles of a brick's cells, before its vertices have positions.
struct BrickTriangles {
    patches: Vec<CellPatch>,
    /// The number of triangles, with those of the patches.
    triangles: usize,
    evaluations: u64,
}

impl BrickTriangles {
    fn new(field: &dyn Field, lattice: &Lattice, low: [usize; 3], around: &Around) -> Self {
        let mut evaluations = 0;
        let patches = patches::find(field, lattice, low, around, &mut evaluations);
        let mut triangles = patches.iter().map(|patch| patch.triangles.len()).sum();
        for z in 0..BRICK {
            let corners = around.corners(z);
            for cell in set_positions(crossed_cells(&corners)) {
                triangles += CASES.triangles(inside_corners(&corners, cell)).len();
            }
        }
        Self { patches, triangles, evaluations }
    }
}

/// A task, and where its vertices and triangles go.
struct ExtractionJob<'a> {
    task: &'a Task<BrickTriangles>,
    positions: &'a mut [DVec3],
    normals: &'a mut [DVec3],
    triangles: &'a mut [[u32; 3]],
}

/// What every task reads.
struct Extraction<'a> {
    field: &'a dyn Field,
    lattice: &'a Lattice,
    signs: &'a [Signs],
    crossed: &'a Crossed<BrickTriangles>,
}

/// Memory that a thread keeps from task to task.
struct ExtractionScratch {
    edges: EdgeScratch,
    gradients: GradientColumns,
    vertices: Box<VertexTable>,
}

impl Default for ExtractionScratch {
    fn default() -> Self {
        Self {
            edges: EdgeScratch::default(),
            gradients: GradientColumns::default(),
            vertices: vertex_table(),
        }
    }
}

impl Extraction<'_> {
    fn extract(&self, job: ExtractionJob<'_>, scratch: &mut ExtractionScratch) -> Result<OnEdges, MeshError> {
        let ExtractionJob { task, positions, normals, triangles } = job;
        let found = task.place_on_edges(self.field, self.lattice, positions, &mut scratch.edges)?;
        for (brick, cells) in task.bricks.iter().zip(&task.kept) {
            let inner = cells.patches.iter().flat_map(|patch| &patch.inner);
            let first = (brick.first + brick.crossings()) as usize - task.first;
            for (position, inner) in positions[first..].iter_mut().zip(inner) {
                *position = *inner;
            }
        }
        scratch.gradients.normals(self.field, positions, normals);
        for cap in &found.caps {
            normals[cap.vertex as usize - task.first] = DVec3::ZERO;
        }
        let mut places = triangles.iter_mut();
        for (brick, cells) in task.bricks.iter().zip(&task.kept) {
            let made = places.by_ref().take(cells.triangles);
            self.fill_triangles(brick, cells, &mut scratch.vertices, made);
        }
        Ok(found)
    }

    /// Writes the triangles of all cells of a brick to their places.
    fn fill_triangles<'a>(
        &self,
        brick: &Brick,
        cells: &BrickTriangles,
        vertices: &mut VertexTable,
        mut places: impl Iterator<Item = &'a mut [u32; 3]>,
    ) {
        let around = brick.around(self.signs);
        brick.number_vertices(|number| self.crossed.get(number), vertices);
        for z in 0..BRICK {
            let corners = around.corners(z);
            for cell in set_positions(crossed_cells(&corners)) {
                let base = edge_slot(0, [cell % BRICK, cell / BRICK, z]);
                let of_cell = CASES.triangles(inside_corners(&corners, cell));
                let vertex = |e: u8| vertices[base + SLOT_OF_EDGE[usize::from(e)]];
                for (triangle, place) in of_cell.iter().zip(&mut places) {
                    *place = triangle.map(vertex);
                }
            }
        }
        let mut next = brick.first + brick.vertices() as u32;
        for patch in cells.patches.iter().rev() {
            next -= patch.inner.len() as u32;
            let (z, bit) = patch.cell;
            let base = edge_slot(0, [bit % BRICK, bit / BRICK, z]);
            let vertex = |e: u8| match usize::from(e) {
                e if e < EDGES => vertices[base + SLOT_OF_EDGE[e]],
                inner => next + (inner - EDGES) as u32,
            };
            for (triangle, place) in patch.triangles.iter().zip(&mut places) {
                *place = triangle.map(vertex);
            }
        }
    }
}
