//! Manifold dual contouring: one vertex for each sheet of the surface in a cell, placed on creases and corners.
//!
//! `bricks` finds the cells that the surface passes and its hits on their edges → `loops` tells which hits belong
//! together → `place` gives each loop a vertex (`qef`, `crease`) → `quads` joins the four vertices around each hit and
//! cuts the quad in two → `refine` cuts edges that are still too far from the surface → `unfold` turns edges of triangles
//! that lie upside down.
//!
//! The vertices are those of the dual of the marching-cubes mesh (Schaefer, Ju, Warren: Manifold dual contouring, IEEE
//! TVCG 13, 2007), so the topology is the same. The quadratic error is that of Ju, Losasso, Schaefer, Warren: Dual
//! contouring of Hermite data, SIGGRAPH 2002; what is new is that vertices at creases are moved onto them by probes
//! beside them, and so are exact also where faces are curved.
//!
//! Invariant: bricks are joined in order, so the mesh is the same for any number of threads.

mod bricks;
mod crease;
mod loops;
mod place;
mod project;
mod qef;
mod quads;
mod refine;
#[cfg(test)]
mod tests;
mod unfold;

use rayon::prelude::*;

use self::bricks::Frame;
use self::place::{Kind, Placed, Vertex};
use self::quads::Quads;
use super::{
    Grid, Mesh, MeshError, Work,
    collapse::{self, AtNode},
    normals,
};
use crate::field::Field;

/// How often vertices may be moved back because triangles around them are upside down.
const REPAIRS: usize = 4;

/// The surface ω = 0 of a field as a closed mesh with sharp creases; empty if no node of the grid lies inside.
///
/// Inside is strictly ω > 0; everything outside the grid counts as outside, so a solid cut by the border is closed by
/// faces on it (see [`Mesh::caps`]). `progress` is called from any thread with the share of the surface found, in (0,
/// 1], not always in ascending order.
///
/// # Errors
/// [`MeshError::NotANumber`] if ω is NaN at a node or on an edge that crosses the surface,
/// [`MeshError::TooManyVertices`] beyond [`Mesh::MAX_VERTICES`].
pub fn dual_contouring(
    field: &dyn Field,
    grid: &Grid,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Mesh, MeshError> {
    let frame = Frame::new(grid);
    let bricks = bricks::find(field, &frame, progress)?;
    let placed: Vec<Placed> =
        (0..bricks.len()).into_par_iter().map(|slot| place::place(field, &frame, &bricks, slot)).collect();
    let found = placed.iter().map(|part| part.vertices.len()).sum();
    if found > Mesh::MAX_VERTICES {
        return Err(MeshError::TooManyVertices { found });
    }
    let mut work = Work {
        evaluations: bricks.iter().map(|brick| brick.evaluations).sum(),
        gradients: placed.iter().map(|part| part.gradients).sum(),
        merged: 0,
    };
    work.gradients += bricks.iter().map(|brick| brick.hits.len() as u64).sum::<u64>();

    let size = frame.spacing.min_element();
    let mut vertices: Vec<Vertex> = Vec::with_capacity(found + found / 8);
    let quads = Quads::join(&bricks, placed, &mut vertices);
    let joined = vertices.len();
    let mut cut = quads.cut(field, &bricks, &mut vertices);
    for _ in 0..REPAIRS {
        let movable = |v: &&u32| vertices[**v as usize].position != vertices[**v as usize].fallback;
        let spoilt: Vec<u32> = cut.spoilt.iter().filter(movable).copied().collect();
        work.gradients += cut.gradients;
        if spoilt.is_empty() {
            break;
        }
        for v in spoilt {
            let vertex = &mut vertices[v as usize];
            let settled = project::newton(field, vertex.fallback, size, &mut work.gradients);
            vertex.fallback = settled.map_or(vertex.fallback, |face| face.point);
            vertex.position = vertex.fallback;
        }
        vertices.truncate(joined);
        cut = quads.cut(field, &bricks, &mut vertices);
    }
    let mut triangles = cut.triangles;
    work.gradients += refine::refine(field, &mut vertices, &mut triangles, size);
    if vertices.len() > Mesh::MAX_VERTICES {
        return Err(MeshError::TooManyVertices { found: vertices.len() });
    }
    work.merged = merge(&mut vertices, &mut triangles, size);
    unfold::unfold(field, &vertices, &mut triangles, &mut work.gradients);

    let caps = (0..).zip(&vertices).filter(|(_, v)| v.kind == Kind::Cap).map(|(i, _)| i).collect();
    let positions = vertices.iter().map(|v| v.position).collect();
    let mut mesh = Mesh { positions, triangles, caps, work, ..Mesh::default() };
    normals::add(field, &mut mesh);
    Ok(mesh)
}

/// Vertices on a crease that an edge shorter than this joins are merged, in cells: two cells, or two cut edges, may
/// have come to nearly the same place.
const TOO_CLOSE: f64 = 0.1;

/// Merges vertices that coincide, and ends of very short edges on creases; returns how many.
fn merge(vertices: &mut Vec<Vertex>, triangles: &mut Vec<[u32; 3]>, size: f64) -> u64 {
    let bits = |v: &Vertex| v.position.to_array().map(f64::to_bits);
    let sharp = (0_u32..).zip(vertices.iter()).filter(|(_, v)| v.kind != Kind::Smooth);
    let mut places: Vec<([u64; 3], u32)> = sharp.map(|(i, v)| (bits(v), i)).collect();
    places.sort_unstable();
    let mut is_taken = vec![false; vertices.len()];
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for group in places.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
        groups.push(group.iter().map(|&(_, v)| v).collect());
        group.iter().for_each(|&(_, v)| is_taken[v as usize] = true);
    }
    for t in triangles.iter() {
        for pair in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
            let [a, b] = pair.map(|v| &vertices[v as usize]);
            let on_crease = a.kind == Kind::Sharp && b.kind == Kind::Sharp;
            let is_free = !pair.iter().any(|&v| is_taken[v as usize]);
            if on_crease && is_free && a.position.distance(b.position) < TOO_CLOSE * size {
                pair.iter().for_each(|&v| is_taken[v as usize] = true);
                groups.push(pair.to_vec());
            }
        }
    }
    let at_nodes = (0..)
        .zip(groups)
        .flat_map(|(place, group)| group.into_iter().map(move |vertex| AtNode { node: place, vertex }))
        .collect();
    let positions = vertices.iter().map(|v| v.position).collect();
    let mut mesh = Mesh { positions, triangles: std::mem::take(triangles), ..Mesh::default() };
    let lost = collapse::merge_coincident(&mut mesh, at_nodes).unwrap_or_default();
    let mut is_lost = lost.iter();
    vertices.retain(|_| is_lost.next() != Some(&true));
    *triangles = mesh.triangles;
    mesh.work.merged
}
