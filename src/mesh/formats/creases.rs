//! Meshes whose vertices are doubled at creases, for formats and pictures that give each vertex one normal: a normal
//! that is shared across an edge of 90° makes the edge look round.
//!
//! Invariant: triangles keep their places and their order. A vertex without a crease keeps its number and its normal,
//! which is that of the surface.

use std::collections::HashMap;

use glam::DVec3;
use rustc_hash::FxBuildHasher;

use super::super::{Mesh, normals::unit};

/// Triangles that meet at a larger angle than this have an edge between them, and not a curved surface: cos 30°.
const CREASE: f64 = 0.866;

/// The mesh with a vertex for each smooth piece of the surface around every vertex.
pub fn split_creases(mesh: &Mesh) -> Mesh {
    let faces: Vec<Option<DVec3>> = mesh.triangles.iter().map(|t| unit(twice_area(mesh, *t))).collect();
    let corners = smooth_corners(mesh, &faces);
    let mut split = Mesh { caps: Vec::new(), ..mesh.clone() };
    // for each vertex the piece that keeps its number
    let mut first: Vec<Option<u32>> = vec![None; mesh.positions.len()];
    let mut others: HashMap<u32, u32, FxBuildHasher> = HashMap::default();
    let mut is_split = vec![false; mesh.positions.len()];
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        for (k, &v) in triangle.iter().enumerate() {
            let piece = corners[3 * number + k];
            if piece == *first[v as usize].get_or_insert(piece) {
                continue;
            }
            is_split[v as usize] = true;
            split.triangles[number][k] = *others.entry(piece).or_insert_with(|| {
                split.positions.push(mesh.positions[v as usize]);
                split.normals.push(mesh.normals[v as usize]);
                is_split.push(true);
                split.positions.len() as u32 - 1
            });
        }
    }
    let mut sums: Vec<DVec3> = vec![DVec3::ZERO; split.positions.len()];
    for ((triangle, whole), face) in split.triangles.iter().zip(&mesh.triangles).zip(&faces) {
        for (k, &v) in triangle.iter().enumerate().filter(|(_, v)| is_split[**v as usize]) {
            sums[v as usize] += angle(mesh, *whole, k) * face.unwrap_or(DVec3::ZERO);
        }
    }
    let new = split.normals.iter_mut().zip(&sums).zip(&is_split).filter(|(_, is_split)| **is_split);
    new.for_each(|((normal, sum), _)| *normal = unit(*sum).unwrap_or(*normal));
    split
}

/// For each corner of each triangle the number of its piece: corners at one vertex have the same number if their
/// triangles are joined across edges without a crease.
fn smooth_corners(mesh: &Mesh, faces: &[Option<DVec3>]) -> Vec<u32> {
    let mut pieces: Vec<u32> = (0..3 * mesh.triangles.len() as u32).collect();
    let following = |corner: u32| corner - corner % 3 + (corner % 3 + 1) % 3;
    let vertex = |corner: u32| mesh.triangles[corner as usize / 3][corner as usize % 3];
    // the half edges that wait for their neighbour, as the corners that they begin at, in a list for each vertex
    let mut waiting: Vec<u32> = vec![NONE; mesh.positions.len()];
    let mut behind: Vec<u32> = vec![NONE; pieces.len()];
    for here in 0..pieces.len() as u32 {
        let (from, to) = (vertex(here), vertex(following(here)));
        // the neighbour runs along the edge the other way
        let (mut before, mut there) = (NONE, waiting[to as usize]);
        while there != NONE && vertex(following(there)) != from {
            (before, there) = (there, behind[there as usize]);
        }
        if there == NONE {
            behind[here as usize] = std::mem::replace(&mut waiting[from as usize], here);
            continue;
        }
        match before {
            NONE => waiting[to as usize] = behind[there as usize],
            before => behind[before as usize] = behind[there as usize],
        }
        if is_smooth(faces[here as usize / 3], faces[there as usize / 3]) {
            join(&mut pieces, here as usize, following(there) as usize);
            join(&mut pieces, following(here) as usize, there as usize);
        }
    }
    (0..pieces.len()).map(|corner| root(&mut pieces, corner)).collect()
}

/// The end of a list of corners.
const NONE: u32 = u32::MAX;

/// Whether two faces with these normals may belong to one curved surface. A face without area has no normal.
fn is_smooth(a: Option<DVec3>, b: Option<DVec3>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => a.dot(b) > CREASE,
        (None, _) | (_, None) => true,
    }
}

fn root(pieces: &mut [u32], corner: usize) -> u32 {
    let mut at = corner;
    while pieces[at] as usize != at {
        pieces[at] = pieces[pieces[at] as usize];
        at = pieces[at] as usize;
    }
    at as u32
}

fn join(pieces: &mut [u32], a: usize, b: usize) {
    let (a, b) = (root(pieces, a), root(pieces, b));
    // the smaller number leads, so the result does not depend on the order of joins
    pieces[a.max(b) as usize] = a.min(b);
}

fn twice_area(mesh: &Mesh, triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
    (b - a).cross(c - a)
}

/// The angle of a triangle at one of its corners: long thin triangles must not outweigh others.
fn angle(mesh: &Mesh, triangle: [u32; 3], corner: usize) -> f64 {
    let at = |k: usize| mesh.positions[triangle[(corner + k) % 3] as usize];
    let (p, q) = (at(1) - at(0), at(2) - at(0));
    libm::atan2(p.cross(q).length(), p.dot(q))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;
    use crate::geom::Aabb;
    use crate::mesh::Unwatched;
    use crate::mesh::{Grid, Resolution, dual_contouring};

    fn meshed(
        omega: impl Fn(DVec3) -> f64 + Send + Sync,
        gradient: impl Fn(DVec3) -> DVec3 + Send + Sync,
    ) -> Mesh {
        let grid =
            Grid::around(&Aabb::new(DVec3::splat(-0.6), DVec3::splat(0.61)), Resolution::Cells(24)).unwrap();
        dual_contouring(&Closures { omega, gradient }, &grid, &Unwatched).unwrap()
    }

    #[test]
    fn every_corner_of_a_cube_has_three_normals() {
        let inside = |p: DVec3| 0.5 - p.abs().max_element();
        let slope = |p: DVec3| {
            let largest = p.abs().max_element();
            DVec3::from_array(std::array::from_fn(
                |i| if p[i].abs() == largest { -p[i].signum() } else { 0.0 },
            ))
        };
        let mesh = meshed(inside, slope);
        let split = split_creases(&mesh);
        assert_eq!(split.triangles.len(), mesh.triangles.len());
        let place = |m: &Mesh, i: usize| m.triangles[i].map(|v| m.positions[v as usize]);
        assert!((0..mesh.triangles.len()).all(|i| place(&mesh, i) == place(&split, i)));
        for triangle in &split.triangles {
            let face = unit(twice_area(&split, *triangle));
            let Some(face) = face else { continue };
            for v in triangle {
                assert!(
                    split.normals[*v as usize].dot(face) > 0.999,
                    "{} {face}",
                    split.normals[*v as usize]
                );
            }
        }
        let corner = |p: &&DVec3| p.abs().min_element() > 0.5 - 1e-9;
        assert_eq!(mesh.positions.iter().filter(corner).count(), 8);
        assert_eq!(split.positions.iter().filter(corner).count(), 24);
    }

    #[test]
    fn a_round_mesh_stays_as_it_is() {
        let mesh = meshed(|p| 0.25 - p.length_squared(), |p| -2.0 * p);
        let split = split_creases(&mesh);
        assert_eq!(
            (split.positions, split.normals, split.triangles),
            (mesh.positions, mesh.normals, mesh.triangles)
        );
    }
}
