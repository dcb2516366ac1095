//! The surface of a fluid in few bytes.
//!
//! Places lie on a lattice that is as coarse as is not seen, normals are left to the reader, and triangles follow each
//! other over their edges, so that most corners are the newest one or one of the last few.

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};
use serde::Serialize;

use super::block::{begin, differences, planes};
use super::coarse::coarse;
use super::levels::Lattice;
use crate::geom::Aabb;
use crate::mesh::Mesh;

/// What a surface may take for each particle of its frame, bytes of a page.
const BYTES_PER_PARTICLE: f64 = 4.0;

/// What vertices and triangles take, bytes of a page, as measured on drops and splashes.
const BYTES: [f64; 2] = [4.5, 1.6];

/// By how much cells grow until a surface is small enough, and how often at most.
const GROWTH: f64 = 1.25;
const MOST_GROWTHS: usize = 8;

/// Steps of the lattice in a cell of the mesh.
const STEPS: f64 = 16.0;

/// A surface with so little detail that it takes few bytes for each particle, and the size of its details, m. That is
/// at least the `spacing` of the particles, m.
pub fn reduced(mesh: &Mesh, spacing: f64, particles: usize) -> (Mesh, f64) {
    let mut cell = spacing;
    let mut found = coarse(mesh, cell);
    for _ in 0..MOST_GROWTHS {
        let [of_vertices, of_triangles] = BYTES;
        let bytes = of_vertices * found.positions.len() as f64 + of_triangles * found.triangles.len() as f64;
        if bytes <= BYTES_PER_PARTICLE * particles as f64 || cell.is_nan() || cell <= 0.0 {
            break;
        }
        cell *= GROWTH;
        found = coarse(mesh, cell);
    }
    (found, cell)
}

#[derive(Serialize)]
struct Head {
    kind: &'static str,
    count: usize,
    triangles: usize,
    /// The numbers of triangles of its parts: it has one.
    parts: [usize; 1],
    min: [f64; 3],
    max: [f64; 3],
    time: f64,
}

/// The block of a surface whose details are about as large as a cell, m: positions as those of a mesh, but without
/// normals, and then for each corner how many vertices ago it was new, or 0 if it is new now.
pub fn pack_surface(mesh: &Mesh, cell: f64, time: f64) -> Vec<u8> {
    let bounds = mesh.positions.iter().fold(Aabb::EMPTY, |all, p| all.including(*p));
    let bounds = if mesh.positions.is_empty() { Aabb::new(DVec3::ZERO, DVec3::ONE) } else { bounds };
    // sites that are rounded upwards stay within the lattice
    let lattice = Lattice::new(&Aabb::new(bounds.min, bounds.max + 0.1 * cell.max(0.0)));
    let (min, max) = (lattice.bounds().min.to_array(), lattice.bounds().max.to_array());
    let mut number = vec![None; mesh.positions.len()];
    let mut order: Vec<DVec3> = Vec::new();
    let walk = walk(&mesh.triangles);
    let corners: Vec<u32> = walk
        .iter()
        .flatten()
        .map(|&corner| {
            let next = order.len() as u32;
            match number[corner as usize] {
                Some(known) => next - known,
                None => {
                    number[corner as usize] = Some(next);
                    order.push(mesh.positions[corner as usize]);
                    0
                }
            }
        })
        .collect();
    let (count, triangles) = (order.len(), walk.len());
    let head = Head { kind: "surface", count, triangles, parts: [triangles], min, max, time };
    let mut out = begin(&head);
    // a step of a lattice is twice its rounding
    let bits = (2.0 * lattice.rounding() * STEPS).to_array().map(|size| shift(cell, size));
    for (axis, bits) in bits.into_iter().enumerate() {
        let sites = order.iter().map(|p| coarsened(lattice.site(*p)[axis], bits));
        planes(&mut out, &differences(sites));
    }
    for byte in 0..4 {
        out.extend(corners.iter().map(|corner| (corner >> (8 * byte)) as u8));
    }
    out
}

/// How many of the lowest bits of sites can be left out if a step may be as large as the part of a cell.
fn shift(cell: f64, size: f64) -> u32 {
    let mut bits = 0;
    while bits < 10 && size * f64::from(1 << (bits + 1)) <= cell {
        bits += 1;
    }
    bits
}

/// The nearest site whose lowest bits are 0.
fn coarsened(site: u16, bits: u32) -> u16 {
    // the last site but one is the highest place
    let rounded = (u32::from(site) + ((1 << bits) >> 1)) >> bits << bits;
    rounded.min(65_534 >> bits << bits) as u16
}

/// The triangles in an order in which most share an edge with the one before, each beginning with that edge, and each
/// of them once.
fn walk(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut known: FxHashSet<[u32; 3]> = FxHashSet::default();
    let first_least = |mut triangle: [u32; 3]| {
        let least = (0..3).min_by_key(|k| triangle[*k]).unwrap_or(0);
        triangle.rotate_left(least);
        triangle
    };
    let triangles: Vec<[u32; 3]> =
        triangles.iter().map(|t| first_least(*t)).filter(|t| known.insert(*t)).collect();
    let mut of_edge: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    for (k, [a, b, c]) in triangles.iter().enumerate() {
        for edge in [[*a, *b], [*b, *c], [*c, *a]] {
            of_edge.insert(edge, k as u32);
        }
    }
    let mut is_done = vec![false; triangles.len()];
    let mut out = Vec::with_capacity(triangles.len());
    let mut waiting: Vec<(usize, [u32; 3])> = Vec::new();
    for (start, triangle) in triangles.iter().enumerate() {
        waiting.push((start, *triangle));
        while let Some((k, [a, b, c])) = waiting.pop() {
            if std::mem::replace(&mut is_done[k], true) {
                continue;
            }
            out.push([a, b, c]);
            for [from, to] in [[c, a], [a, b], [b, c]] {
                let Some(&next) = of_edge.get(&[to, from]) else { continue };
                if !is_done[next as usize] {
                    let [p, q, r] = triangles[next as usize];
                    let begun =
                        [[p, q, r], [q, r, p], [r, p, q]].into_iter().find(|t| t[0] == to && t[1] == from);
                    waiting.extend(begun.map(|t| (next as usize, t)));
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;
    use crate::mesh::{Grid, Resolution, Unwatched, marching_cubes};

    fn ball() -> Mesh {
        let ball =
            Closures { omega: |p: DVec3| 1.0 - p.length(), gradient: |p: DVec3| -p.normalize_or_zero() };
        let domain = Aabb::new(DVec3::splat(-1.2), DVec3::splat(1.2));
        let grid = Grid::filling(&domain, Resolution::Cells(60)).unwrap();
        marching_cubes(&ball, &grid, &Unwatched).unwrap()
    }

    #[test]
    fn surfaces_come_back_in_few_bytes() {
        let mesh = coarse(&ball(), 0.1);
        let block = pack_surface(&mesh, 0.1, 0.5);
        let length = u32::from_le_bytes(block[..4].try_into().unwrap()) as usize;
        let head: serde_json::Value = serde_json::from_slice(&block[4..4 + length]).unwrap();
        let planes = &block[4 + length..];
        let (n, m) =
            (head["count"].as_u64().unwrap() as usize, 3 * head["triangles"].as_u64().unwrap() as usize);
        assert_eq!((m / 3, planes.len()), (mesh.triangles.len(), 6 * n + 4 * m));
        let mut positions = vec![DVec3::ZERO; n];
        for axis in 0..3 {
            let of = |end: &str| head[end][axis].as_f64().unwrap();
            let mut site = 0u16;
            for (i, p) in positions.iter_mut().enumerate() {
                let folded = u16::from_le_bytes([planes[2 * axis * n + i], planes[(2 * axis + 1) * n + i]]);
                site = site.wrapping_add((folded >> 1) ^ 0u16.wrapping_sub(folded & 1));
                p[axis] = of("min") + f64::from(site) / 65_534.0 * (of("max") - of("min"));
            }
        }
        let mut next = 0;
        let mut corner = |i: usize| {
            let ago = (0..4).map(|byte| u32::from(planes[6 * n + byte * m + i]) << (8 * byte)).sum::<u32>();
            next += u32::from(ago == 0);
            if ago == 0 { next - 1 } else { next - ago }
        };
        let corners: Vec<u32> = (0..m).map(&mut corner).collect();
        // the same triangles, with corners a 32nd of a cell away at most along each axis
        let key = |p: DVec3| (p / 0.02).round().to_array().map(|x| x as i32);
        let near = |p: DVec3| mesh.positions.iter().map(|q| (*q - p).abs().max_element()).fold(9.0, f64::min);
        assert!(positions.iter().all(|p| near(*p) < 0.1 / 32.0 + 1e-4));
        let middle = |[a, b, c]: [DVec3; 3]| key((a + b + c) / 3.0);
        let told = corners.chunks(3).map(|t| middle([0, 1, 2].map(|k| positions[t[k] as usize])));
        let told: FxHashSet<[i32; 3]> = told.collect();
        let truth = mesh.triangles.iter().map(|t| middle(t.map(|k| mesh.positions[k as usize])));
        let missed = truth.filter(|t| !told.contains(t)).count();
        // middles near the border between two boxes may lie in either
        assert!(missed < mesh.triangles.len() / 3, "{missed} of {}", mesh.triangles.len());
        // means of corners turn a few narrow triangles over
        let inward = corners.chunks(3).filter(|t| {
            let [a, b, c] = [0, 1, 2].map(|k| positions[t[k] as usize]);
            (b - a).cross(c - a).dot(a + b + c) <= 0.0
        });
        let inward = inward.count();
        assert!(50 * inward < mesh.triangles.len(), "{inward} of {}", mesh.triangles.len());
        let mut deflated = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::new(7));
        std::io::Write::write_all(&mut deflated, planes).unwrap();
        let bytes = deflated.finish().unwrap().len() as f64 / mesh.triangles.len() as f64;
        assert!(bytes < 3.0, "{bytes} bytes for each triangle");
    }

    #[test]
    fn detail_is_left_out_until_few_bytes_are_left() {
        let mesh = ball();
        let (fine, cell) = reduced(&mesh, 0.05, 1_000_000);
        assert_eq!((cell, fine), (0.05, coarse(&mesh, 0.05)));
        let (few, cell) = reduced(&mesh, 0.05, 1000);
        assert!(cell > 0.1 && few.triangles.len() < 2000, "{cell}");
        assert_eq!(reduced(&mesh, 0.0, 1).0, mesh);
    }
}
