//! From a field to a closed triangle mesh of its surface ω = 0, and what can be said about that mesh.
//!
//! A [`Grid`] says where the nodes are. [`marching_cubes`] or [`dual_contouring`] makes a mesh: the first
//! cuts creases off between nodes, the second puts vertices on them. [`remove_slivers`] and [`simplify()`]
//! contract edges of a mesh. [`check`] reports its topology, volume and distance, [`thin_cells`] counts what
//! the grid could not see, [`self_intersections`] lists triangles that cross, and [`measure`] finds the
//! distance both ways. The [`FORMATS`] write it to files.
//!
//! Marching cubes sample ω in the bricks of cells that ranges do not exclude. They connect crossed edges by
//! the case table, or by the corners' values where the table leaves a choice. A root search on ω itself puts
//! each vertex on the surface, vertices that coincide in a node are merged, and normals are −∇ω/|∇ω|.
//!
//! What is promised: the mesh is closed; every edge lies in exactly two triangles, which run along it in
//! opposite directions; triangles are counter-clockwise as seen from the fluid; the topology is that of the
//! trilinear interpolant of ω at the nodes, except where ω at many places of a diagonal of a face shows that
//! its corners are joined in another way, as beside a sharp rim; the same field and grid give the same bits
//! on any number of threads.
//!
//! What is not promised: marching cubes cut creases between nodes; features thinner than two cells may be
//! missed, although they are counted; there is no surface where the field touches zero without a change
//! of sign.
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
//! mesh::stl::write(&surface, mesh::LengthUnit::MILLIMETRE, &mut Vec::new())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Invariant: this module knows nothing of a compiler; it sees only [`Field`](crate::field::Field).

mod ambiguity;
mod branches;
mod cases;
mod check;
mod collapse;
mod crossings;
mod diagonals;
mod distance;
mod dual;
mod extract;
mod formats;
mod grid;
mod intersections;
mod lines;
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
mod volume;
mod watch;

#[cfg(test)]
mod tests;

use std::fmt;

use glam::DVec3;

use crate::geom::{Placement, significant};

pub use branches::{Branches, branches};
pub use check::{Report, check, is_closed_manifold};
pub use distance::MeshDistance;
pub use dual::dual_contouring;
pub use extract::marching_cubes;
pub use formats::*;
pub use grid::{Grid, GridError, Resolution};
pub use intersections::self_intersections;
pub use lines::{ByLines, by_lines};
pub use quality::{Distances, Quality, Reference, measure};
pub use shells::{Shell, shells};
pub use simplify::simplify;
pub use slivers::remove_slivers;
pub use thin::{ThinCells, thin_cells};
pub use volume::{Volume, VolumeError, volume};
pub use watch::{Stretch, Unwatched, Watch};

/// A triangle mesh with shared vertices.
///
/// `positions` and `normals` have the same length. Meshes made here are closed manifolds, see [`check`].
/// Functions that take a mesh panic if one of its triangles names a vertex that does not exist.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// The vertices, in metres.
    pub positions: Vec<DVec3>,
    /// The outward unit normals, one for each vertex; always finite.
    pub normals: Vec<DVec3>,
    /// Three indices of vertices for each triangle, counter-clockwise as seen from the fluid.
    pub triangles: Vec<[u32; 3]>,
    /// Indices, ascending, of the vertices that close a solid at the grid's border. They lie on the border
    /// and inside the solid, not on ω = 0.
    pub caps: Vec<u32>,
    /// The work that it took to make the mesh.
    pub work: Work,
}

impl Mesh {
    /// The largest number of vertices of a mesh. The corners of twice as many triangles then still have
    /// 32-bit numbers, and indices fit the signed 32 bits of PLY and VTP files.
    pub const MAX_VERTICES: usize = 1 << 29;

    /// The mesh of a body that is elsewhere.
    #[must_use]
    pub fn moved(&self, to: &Placement) -> Self {
        Self {
            positions: self.positions.iter().map(|p| to.apply(*p)).collect(),
            normals: self.normals.iter().map(|n| to.rotation * *n).collect(),
            triangles: self.triangles.clone(),
            caps: self.caps.clone(),
            work: self.work,
        }
    }

    /// The parts of a mesh, distinguished by a whole number from 0 to `count` − 1 at each vertex; `None` if
    /// numbers are missing or invalid, or a triangle has corners in several parts.
    pub fn divided(&self, part_of: &[f64], count: usize) -> Option<Vec<Self>> {
        if part_of.len() != self.positions.len() || self.normals.len() != self.positions.len() {
            return None;
        }
        let mut parts = vec![Self::default(); count];
        // the number of each vertex within its part
        let mut numbers = Vec::with_capacity(self.positions.len());
        for (k, &part) in part_of.iter().enumerate() {
            if !(part >= 0.0 && part.fract() == 0.0) {
                return None;
            }
            let own = parts.get_mut(part as usize)?;
            numbers.push(own.positions.len() as u32);
            own.positions.push(self.positions[k]);
            own.normals.push(self.normals[k]);
        }
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|vertex| part_of[vertex as usize] as usize);
            if a != b || b != c {
                return None;
            }
            parts[a].triangles.push(triangle.map(|vertex| numbers[vertex as usize]));
        }
        Some(parts)
    }

    /// Meshes as one: their vertices and triangles one after the other.
    pub fn joined(meshes: &[Self]) -> Self {
        let mut all = Self::default();
        for mesh in meshes {
            let first = all.positions.len() as u32;
            all.positions.extend(&mesh.positions);
            all.normals.extend(&mesh.normals);
            all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        all
    }
}

/// Counts of work. They are the same on any machine.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Evaluations of ω: samples at nodes and steps of root searches.
    pub evaluations: u64,
    /// Evaluations of ∇ω.
    pub gradients: u64,
    /// Vertices that were merged because they coincided in a node of the grid, or dropped as a speck
    /// without extent.
    pub merged: u64,
}

/// Why a field could not be meshed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MeshError {
    /// ω is not a number at a point, so it cannot be decided whether the point is inside.
    NotANumber {
        /// The first such point in the order of the search, in metres.
        at: DVec3,
    },
    /// The mesh would have more vertices than [`Mesh::MAX_VERTICES`].
    TooManyVertices {
        /// The number of vertices that was found.
        found: usize,
    },
    /// The caller ended the work, see [`Watch::is_over`].
    Ended,
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
                let [x, y, z] = at.to_array().map(significant);
                write!(f, "the field is not a number at ({x}, {y}, {z})")
            }
            Self::Ended => write!(f, "the mesh was not finished: it was ended before"),
            Self::TooManyVertices { found } => {
                let most = Mesh::MAX_VERTICES;
                write!(
                    f,
                    "the mesh would have {found} vertices; at most {most} are possible, use larger cells"
                )
            }
        }
    }
}

impl std::error::Error for MeshError {}
