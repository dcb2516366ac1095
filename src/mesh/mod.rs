//! From a field to a closed triangle mesh of its surface ω = 0, and what can be said about that mesh.
//!
//! [`Grid`] lays nodes → [`marching_cubes`] samples ω in the bricks of cells that ranges do not exclude, connects
//! crossed edges by the case table, or by the corners' values where the table leaves a choice, puts each vertex on the
//! surface by a root search on ω itself, merges vertices that coincide in a node and adds normals −∇ω/|∇ω| →
//! [`remove_slivers`] or [`simplify()`] if asked → [`check`] reports topology, volume and distance, [`thin_cells`] what the grid cannot
//! see, [`measure`] the distance both ways → the [`FORMATS`] write. [`dual_contouring`] does what [`marching_cubes`]
//! does, with sharp creases.
//!
//! Promises: the mesh is closed, every edge lies in exactly two triangles that run along it in opposite
//! directions, triangles are counter-clockwise seen from the fluid, its topology is that of the trilinear interpolant
//! of ω at the nodes, and the same field and grid give the same bits on any number of threads. Not promised: marching
//! cubes cut creases between nodes, features thinner than a cell may be missed (but are counted), and where the field touches
//! zero without a change of sign there is no surface.
//!
//! ```
//! use rfm::{field::Closures, geom::Aabb, glam::DVec3, mesh};
//!
//! let ball = Closures { omega: |p: DVec3| 1.0 - p.length_squared(), gradient: |p: DVec3| -2.0 * p };
//! let bounds = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
//! let grid = mesh::Grid::around(&bounds, mesh::Resolution::Cells(32))?;
//! let surface = mesh::marching_cubes(&ball, &grid, &|_share_done| ())?;
//! let report = mesh::check(&surface, &ball);
//! assert!(report.closed && report.manifold && report.max_distance < 1e-12);
//! mesh::stl::write(&surface, &mut Vec::new())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Invariant: this module knows nothing of a compiler; it sees only [`Field`](crate::field::Field).

mod ambiguity;
mod cases;
mod check;
mod collapse;
mod crossings;
mod dual;
mod extract;
mod formats;
mod grid;
mod normals;
mod patches;
mod prune;
mod quality;
mod roots;
mod shells;
mod signs;
mod simplify;
mod slivers;
mod thin;

#[cfg(test)]
mod tests;

use std::fmt;

use glam::DVec3;

pub use check::{Report, check, is_closed_manifold};
pub use dual::dual_contouring;
pub use extract::marching_cubes;
pub use formats::*;
pub use grid::{Grid, GridError, Resolution};
pub use quality::{Distances, Quality, Reference, measure};
pub use shells::{Shell, shells};
pub use simplify::simplify;
pub use slivers::remove_slivers;
pub use thin::{ThinCells, thin_cells};

/// Triangles over shared vertices.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertices, in the scene's unit (metres).
    pub positions: Vec<DVec3>,
    /// Outward unit normals, one for each vertex, always finite.
    pub normals: Vec<DVec3>,
    /// Indices of vertices, counter-clockwise seen from the fluid.
    pub triangles: Vec<[u32; 3]>,
    /// Ascending indices of vertices which close a solid at the grid's border: they lie on the border and
    /// inside the solid, not on ω = 0.
    pub caps: Vec<u32>,
    /// What it took to make the mesh.
    pub work: Work,
}

impl Mesh {
    /// Most vertices of a mesh: the corners of twice as many triangles then still have 32-bit numbers.
    pub const MAX_VERTICES: usize = 1 << 29;
}

/// Counts of work, the same on any machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Evaluations of ω: samples and root steps.
    pub evaluations: u64,
    /// Evaluations of ∇ω, for normals.
    pub gradients: u64,
    /// Vertices merged because they coincided in a node of the grid, or dropped as a speck of no extent.
    pub merged: u64,
}

/// Why a field could not be meshed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MeshError {
    /// ω is not a number here, so nobody can say whether the point is inside.
    NotANumber {
        /// The first such point in the order of the search.
        at: DVec3,
    },
    /// More vertices than [`Mesh::MAX_VERTICES`].
    TooManyVertices {
        /// The number found.
        found: usize,
    },
}

impl MeshError {
    /// Refuses more vertices than a mesh can have.
    pub(crate) fn check_vertices(found: usize) -> Result<(), Self> {
        if found > Mesh::MAX_VERTICES { Err(Self::TooManyVertices { found }) } else { Ok(()) }
    }
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotANumber { at } => {
                write!(f, "the field is not a number at ({}, {}, {})", at.x, at.y, at.z)
            }
            Self::TooManyVertices { found } => {
                write!(
                    f,
                    "the mesh would have {found} vertices; at most {} are possible, use larger cells",
                    Mesh::MAX_VERTICES
                )
            }
        }
    }
}

impl std::error::Error for MeshError {}
