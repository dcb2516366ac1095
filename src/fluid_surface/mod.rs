//! Closed triangle meshes around the particles of a fluid, frame by frame.
//!
//! [`read_collection`] lists the frames of a run, [`read_points`] reads the positions of one ([`read_arrays`] and
//! [`read_mesh`] what else a frame has), and
//! [`Reconstruction::mesh`] lays a surface around them with the crate `splashsurf_lib`. A kernel sum gives
//! the density over the rest density, which marching cubes mesh at a threshold, as Löschner, Böttcher,
//! Jeske and Bender describe ("Weighted Laplacian Smoothing for Surface Reconstruction of Particle-based
//! Fluids", 2023).
//!
//! Invariant: the mesh is closed, its triangles are counter-clockwise as seen from outside the fluid, and the
//! same particles give the same bits on any number of threads. The crate returns vertices in the order in
//! which threads finish; they are put in order here.

mod collection;
mod error;
mod frame;
mod storage;
mod values;
mod vessel;

use std::fmt;

use glam::DVec3;
use splashsurf_lib::nalgebra::Vector3;
use splashsurf_lib::{GridDecompositionParameters, Parameters, SpatialDecomposition, reconstruct_surface};

use crate::geom::Aabb;
use crate::mesh::Mesh;

pub use collection::{CollectionError, FrameEntry, read_collection};
pub use error::FrameError;
pub use frame::{PointArray, read_arrays, read_mesh, read_points};
pub use values::values_at;

/// The parameters of a surface. Lengths are in metres and absolute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reconstruction {
    /// Half of the particles' spacing. A particle stands for a cube whose side is twice this.
    pub particle_radius: f64,
    /// Beyond this distance a particle has no weight. It is twice the smoothing length, which splashsurf
    /// advises to be twice the radius. Larger ones smooth the surface and blunt it.
    pub support_radius: f64,
    /// The side of a marching-cubes cell. splashsurf advises half the radius. With a whole radius or more,
    /// single particles show as facets.
    pub cell: f64,
    /// The part of the rest density at which the surface lies. splashsurf advises 0.6, with which a
    /// half-space full of particles keeps about its volume.
    pub threshold: f64,
    /// A box whose walls hold the fluid. The fluid goes up to a wall that it touches, and never beyond it. `None`: the
    /// surface is round everywhere, also where the fluid lies on a wall.
    pub vessel: Option<Aabb>,
}

impl Reconstruction {
    /// The advised support radius over the particle radius.
    const SUPPORT: f64 = 4.0;
    /// The advised cell over the particle radius.
    const CELL: f64 = 0.5;
    /// The advised threshold.
    const THRESHOLD: f64 = 0.6;
    /// The most cells within the support radius. At 32 one particle already touches 137 000 nodes.
    const MOST_IN_SUPPORT: f64 = 32.0;
    /// The most cells along the longest side of the fluid. `f32`, in which the crate computes fast, then
    /// still resolves a thousandth of a cell.
    const MOST_CELLS: f64 = 16384.0;

    /// The advised parameters for particles of a radius, in metres.
    pub fn of_radius(particle_radius: f64) -> Self {
        Self {
            particle_radius,
            support_radius: Self::SUPPORT * particle_radius,
            cell: Self::CELL * particle_radius,
            threshold: Self::THRESHOLD,
            vessel: None,
        }
    }

    /// The surface around particles at positions in metres. Without particles it has no triangles.
    ///
    /// # Errors
    /// [`SurfaceError`] for lengths that are not positive, for cells that are too small for the radius or for
    /// the extent of the fluid, for positions that are not numbers, and for surfaces with too many vertices.
    pub fn mesh(&self, particles: &[DVec3]) -> Result<Mesh, SurfaceError> {
        let positive = |length: f64| length.is_finite() && length > 0.0;
        if ![self.particle_radius, self.support_radius, self.cell].into_iter().all(positive) {
            return Err(SurfaceError::Length);
        }
        if self.support_radius > Self::MOST_IN_SUPPORT * self.cell {
            let least = self.support_radius / Self::MOST_IN_SUPPORT;
            return Err(SurfaceError::CellTooSmall { cell: self.cell, least });
        }
        if let Some(index) = particles.iter().position(|p| !p.is_finite()) {
            return Err(SurfaceError::NotANumber { index });
        }
        if particles.is_empty() {
            return Ok(Mesh::default());
        }
        let bounds = particles.iter().fold(Aabb::EMPTY, |bounds, p| bounds.including(*p));
        let extent = bounds.size().max_element();
        if extent > Self::MOST_CELLS * self.cell {
            return Err(SurfaceError::TooWide { extent, cell: self.cell });
        }
        // near the origin f32 has its digits where they are needed
        let middle = bounds.centre();
        // with one layer of images only, edges between walls show holes
        let images = self.vessel.map(|vessel| vessel::images(particles, &vessel, self.support_radius));
        let positions: Vec<Vector3<f32>> = particles
            .iter()
            .chain(images.iter().flatten())
            .map(|p| {
                let p = (*p - middle).as_vec3();
                Vector3::new(p.x, p.y, p.z)
            })
            .collect();
        let found = reconstruct_surface::<i64, f32>(&positions, &self.parameters());
        let surface = found.map_err(|error| SurfaceError::Crate(error.to_string()))?.mesh;
        let positions = surface.vertices.iter().map(|v| [v.x, v.y, v.z]).collect();
        let mut mesh = in_order(positions, surface.triangles, middle)?;
        if let Some(vessel) = &self.vessel {
            vessel::hold(&mut mesh, vessel);
        }
        Ok(mesh)
    }

    fn parameters(&self) -> Parameters<f32> {
        let [radius, support, cell] =
            [self.particle_radius, self.support_radius, self.cell].map(|length| length as f32);
        let mut parameters = Parameters::new(radius, support, cell);
        parameters.iso_surface_threshold = self.threshold as f32;
        // without subdomains densities are summed in the order in which threads come
        parameters.spatial_decomposition = SpatialDecomposition::UniformGrid(GridDecompositionParameters {
            auto_disable: false,
            ..GridDecompositionParameters::default()
        });
        parameters
    }
}

/// A mesh whose vertices are sorted by position and whose triangles are sorted by vertices. The crate
/// stitches subdomains together in the order in which threads finish.
fn in_order(
    positions: Vec<[f32; 3]>,
    triangles: Vec<[usize; 3]>,
    middle: DVec3,
) -> Result<Mesh, SurfaceError> {
    if positions.len() > Mesh::MAX_VERTICES {
        return Err(SurfaceError::TooManyVertices { found: positions.len() });
    }
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_by(|&a, &b| {
        let (a, b) = (positions[a as usize], positions[b as usize]);
        a[2].total_cmp(&b[2]).then(a[1].total_cmp(&b[1])).then(a[0].total_cmp(&b[0]))
    });
    let mut number = vec![0; positions.len()];
    (0..).zip(&order).for_each(|(new, &old): (u32, _)| number[old as usize] = new);
    let mut sorted: Vec<[u32; 3]> = triangles
        .into_iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| number[v]);
            // begin with the least corner, and keep the winding
            if a < b && a < c {
                [a, b, c]
            } else if b < c {
                [b, c, a]
            } else {
                [c, a, b]
            }
        })
        .collect();
    sorted.sort_unstable();
    let place = |&old: &u32| DVec3::from(positions[old as usize].map(f64::from)) + middle;
    Ok(Mesh::from_triangles(order.iter().map(place).collect(), sorted))
}

/// Why there is no surface for particles.
#[derive(Debug, Clone, PartialEq)]
pub enum SurfaceError {
    /// A length is not positive and finite.
    Length,
    /// The cell is too small for the support radius.
    CellTooSmall {
        /// The side of the cell in metres.
        cell: f64,
        /// The least side that would do, in metres.
        least: f64,
    },
    /// The fluid is too many cells wide.
    TooWide {
        /// The longest side of the fluid in metres.
        extent: f64,
        /// The side of the cell in metres.
        cell: f64,
    },
    /// A position is infinite or not a number.
    NotANumber {
        /// The particle's index.
        index: usize,
    },
    /// The surface would have more vertices than [`Mesh::MAX_VERTICES`].
    TooManyVertices {
        /// The number of vertices that was found.
        found: usize,
    },
    /// `splashsurf_lib` failed with this message.
    Crate(String),
}

impl fmt::Display for SurfaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length => write!(f, "the particle radius and the cell must be lengths above 0"),
            Self::CellTooSmall { cell, least } => {
                write!(f, "a cell of {cell} m is too small for these particles; use {least:.3e} m or more")
            }
            Self::TooWide { extent, cell } => write!(
                f,
                "the particles are {extent:.3e} m apart, too many cells of {cell:.3e} m: has one flown off? \
                 Larger cells may help"
            ),
            Self::NotANumber { index } => write!(f, "the position of particle {index} is not a number"),
            Self::TooManyVertices { found } => {
                write!(f, "the surface would have {found} vertices; use larger cells")
            }
            Self::Crate(message) => write!(f, "the surface could not be made: {message}"),
        }
    }
}

impl std::error::Error for SurfaceError {}

#[cfg(test)]
mod tests;
