//! Volumes, meshes of solids, and surfaces of fluids.

use std::ptr::null;

use library::field::Field;
use library::fluid_surface::Reconstruction;
use library::geom::Aabb;
use library::glam::DVec3;
use library::mesh::{Grid, Mesh, Resolution, Unwatched, dual_contouring};
use library::solid::Bounds;
use rfm_columns::{NoVolume, volume};

use crate::columns::{RfmPoints, vectors};
use crate::error::{RfmError, RfmStatus, answer, attempt};
use crate::program::hand_out;
use crate::solid::{RfmSolid, read_box, solid as solid_of};

/// A closed triangle mesh. It may be used by any number of threads at a time.
pub struct RfmMesh(Mesh);

/// The volume of a solid, m^3, found on meshes with `cells` cells, two thirds and half as many along the longest side (96 do
/// for most solids). A solid of which parts are too thin for these is measured along lines that cross it. `uncertainty` is
/// how far it may be off, m^3, infinite if that is not known; it may be null. All processors are used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_volume(
    solid: *const RfmSolid,
    cells: usize,
    volume: *mut f64,
    uncertainty: *mut f64,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let measure = || {
        // SAFETY: null, or a solid
        let this = unsafe { solid_of(solid) }?;
        if volume.is_null() {
            return Err(RfmError::bad("volume is null"));
        }
        let found = self::volume(&this.solid, cells, &Unwatched).map_err(RfmError::bad)?;
        // SAFETY: the caller may have it written
        unsafe { volume.write(found.volume) };
        if !uncertainty.is_null() {
            // SAFETY: the caller may have it written
            unsafe { uncertainty.write(found.error) };
        }
        Ok(())
    };
    // SAFETY: null, or the caller's
    unsafe { attempt(error, measure) }
}

/// A mesh of the surface of a solid, with `cells` cells along the longest side of its bounds, or of the box that is given by
/// its lowest and its highest corner, three numbers each: the mesh is closed at its border. Both may be null. Vertices lie
/// on edges and corners, too (dual contouring). All processors are used. `mesh` is null after a failure, and has no
/// triangles if the solid is empty.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_mesh(
    solid: *const RfmSolid,
    cells: usize,
    low: *const f64,
    high: *const f64,
    mesh: *mut *mut RfmMesh,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let make = || {
        // SAFETY: null, or a solid
        let this = unsafe { solid_of(solid) }?;
        // SAFETY: null, or three numbers each
        let over = unsafe { optional_box(low, high) }?;
        let grid = match (over, this.solid.bounds()) {
            (Some(over), _) => Grid::filling(&over, Resolution::Cells(cells)),
            (None, Bounds::Within(bounds)) => Grid::around(bounds, Resolution::Cells(cells)),
            (None, Bounds::Empty) => return Ok(RfmMesh(Mesh::default())),
            (None, Bounds::Unbounded) => {
                return Err(RfmError::bad(NoVolume::asking_for_a_box(this.solid.name())));
            }
        };
        let grid = grid.map_err(RfmError::bad)?;
        let surface = this.solid.surface(*grid.bounds());
        dual_contouring(&*surface as &dyn Field, &grid, &Unwatched).map(RfmMesh).map_err(RfmError::bad)
    };
    // SAFETY: null, or the caller's
    unsafe { hand_out((mesh, "mesh"), error, make) }
}

/// The surface of a fluid of `count` particles, each of which stands for a cube with the side `spacing`, m, as
/// `rfm render --surface` draws it. A fluid in a box, given by its lowest and its highest corner, three numbers each, goes
/// up to a wall that it touches, and never beyond it; both may be null. Particles whose places are not finite are left
/// out. `cell` is the size of a cell of the marching cubes, m; where it is 0, it is a quarter of the spacing. All
/// processors are used. `mesh` is null after a failure, and has no triangles if there are no particles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_fluid_surface(
    count: usize,
    particles: RfmPoints,
    spacing: f64,
    cell: f64,
    low: *const f64,
    high: *const f64,
    mesh: *mut *mut RfmMesh,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let make = || {
        // SAFETY: the caller promises the columns
        let particles = unsafe { vectors(count, [particles]) }?;
        // SAFETY: null, or three numbers each
        let vessel = unsafe { optional_box(low, high) }?;
        let places = (0..count).map(|i| DVec3::from_array(particles.get(0, i)));
        let finite: Vec<DVec3> = places.filter(|p| p.is_finite()).collect();
        let advised = Reconstruction::of_radius(0.5 * spacing);
        let cell = if cell == 0.0 { advised.cell } else { cell };
        let made = Reconstruction { cell, vessel, ..advised }.mesh(&finite);
        made.map(RfmMesh).map_err(RfmError::bad)
    };
    // SAFETY: null, or the caller's
    unsafe { hand_out((mesh, "mesh"), error, make) }
}

/// A box of the caller, if there is one.
///
/// # Safety
/// Its corners are null, or have three numbers each.
// SAFETY: the caller promises what the reads need
unsafe fn optional_box(low: *const f64, high: *const f64) -> Result<Option<Aabb>, RfmError> {
    if low.is_null() && high.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller promises three numbers each
    unsafe { read_box(low, high) }.map(Some)
}

/// The number of vertices of a mesh; 0 for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_mesh_vertex_count(mesh: *const RfmMesh) -> usize {
    // SAFETY: null, or a mesh
    unsafe { mesh.as_ref() }.map_or(0, |mesh| mesh.0.positions.len())
}

/// The vertices of a mesh, m: x, y and z of each after one another. They live as long as the mesh; null for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_mesh_vertices(mesh: *const RfmMesh) -> *const f64 {
    // SAFETY: null, or a mesh
    unsafe { mesh.as_ref() }.map_or(null(), |mesh| mesh.0.positions.as_ptr().cast())
}

/// The outward unit normals of the vertices, in the same order. They live as long as the mesh; null for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_mesh_normals(mesh: *const RfmMesh) -> *const f64 {
    // SAFETY: null, or a mesh
    unsafe { mesh.as_ref() }.map_or(null(), |mesh| mesh.0.normals.as_ptr().cast())
}

/// The number of triangles of a mesh; 0 for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_mesh_triangle_count(mesh: *const RfmMesh) -> usize {
    // SAFETY: null, or a mesh
    unsafe { mesh.as_ref() }.map_or(0, |mesh| mesh.0.triangles.len())
}

/// The triangles of a mesh: the numbers of three vertices each, from 0, counter-clockwise as seen from outside. They live as
/// long as the mesh; null for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_mesh_triangles(mesh: *const RfmMesh) -> *const u32 {
    // SAFETY: null, or a mesh
    unsafe { mesh.as_ref() }.map_or(null(), |mesh| mesh.0.triangles.as_ptr().cast())
}

/// Frees a mesh; does nothing with null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_mesh_free(mesh: *mut RfmMesh) {
    if !mesh.is_null() {
        // SAFETY: `hand_out` made it, and the caller frees it once
        answer((), || drop(unsafe { Box::from_raw(mesh) }));
    }
}
