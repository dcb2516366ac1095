//! Cuts edges in two where the mesh is farther from the surface than it should be.
//!
//! A chord of length h misses a surface of radius R by h²/8R: a tight bend that is only a cell or two wide keeps a
//! large error in a mesh that is fine elsewhere. The middle of such an edge moves onto the surface; that of an edge
//! across a crease which no vertex has caught moves onto the crease.
//!
//! Invariant: cutting edges and the triangles beside them changes neither topology nor the order of what was there.

use glam::DVec3;
use rayon::prelude::*;

use super::super::normals::{gradients, unit};
use super::crease;
use super::place::{Kind, Vertex};
use super::project;
use crate::field::Field;

/// The distance of an edge's middle from the surface above which it is cut, in cells. It bounds what is left: the pawn
/// in [0, 3]³ at 256³ cells has a Hausdorff distance of 0.024 cells, where chords across its collar alone make 0.08.
const TOLERANCE: f64 = 0.025;

/// Each round quarters what is left.
const ROUNDS: usize = 3;

/// Edges looked at together.
const BATCH: usize = 1024;

/// How far a middle may move on a smooth surface, in lengths of its edge: farther, and triangles would turn over.
const LONGEST_MOVE: f64 = 0.4;

/// How far it may drop onto a crease at most: an edge that bridges a narrow groove drops to its bottom, and the
/// triangles beside it come to lie on the walls.
const LONGEST_DROP: f64 = 2.0;

/// Where on an edge the faces of its two ends are looked up, as a share of its length.
const BESIDE: f64 = 0.1;

/// Cuts edges until the mesh is near the surface; returns the number of evaluations of ∇ω.
pub(super) fn refine(
    field: &dyn Field,
    vertices: &mut Vec<Vertex>,
    triangles: &mut Vec<[u32; 3]>,
    size: f64,
) -> u64 {
    let mut evaluations = 0;
    for _ in 0..ROUNDS {
        let (cuts, count) = cuts(field, vertices, triangles, TOLERANCE * size);
        evaluations += count;
        if cuts.is_empty() {
            break;
        }
        let first = vertices.len() as u32;
        let numbers: Vec<([u32; 2], u32)> = cuts.iter().zip(first..).map(|(cut, v)| (cut.0, v)).collect();
        vertices.extend(cuts.into_iter().map(|cut| cut.1));
        *triangles = divided(vertices, triangles, &numbers);
    }
    evaluations
}

/// An edge's ends, ascending, and the vertex that cuts it.
type EdgeCut = ([u32; 2], Vertex);

/// The edges to cut, ascending by their ends.
fn cuts(
    field: &dyn Field,
    vertices: &[Vertex],
    triangles: &[[u32; 3]],
    tolerance: f64,
) -> (Vec<EdgeCut>, u64) {
    // each edge of a closed mesh is run along once in ascending order
    let sides = triangles.par_iter().flat_map_iter(|t| (0..3).map(|i| [t[i], t[(i + 1) % 3]]));
    let mut edges: Vec<[u32; 2]> =
        sides.filter(|&[a, b]| a < b && may_bulge(vertices, [a, b], tolerance)).collect();
    edges.par_sort_unstable();
    let parts: Vec<(Vec<EdgeCut>, u64)> = edges
        .par_chunks(BATCH)
        .map(|edges| {
            let ends = |edge: &[u32; 2]| edge.map(|v| &vertices[v as usize]);
            let between = |[a, b]: [&Vertex; 2]| 0.5 * (a.position + b.position);
            let middles: Vec<DVec3> = edges.iter().map(|edge| between(ends(edge))).collect();
            let mut count = middles.len() as u64;
            let found = gradients(field, &middles).into_iter();
            let off = |(omega, gradient): (f64, DVec3)| omega.abs() > tolerance * gradient.length();
            let cut = edges
                .iter()
                .zip(found)
                .filter(|(_, found)| off(*found))
                .filter_map(|(edge, _)| Some((*edge, middle(field, ends(edge), tolerance, &mut count)?)));
            (cut.collect(), count)
        })
        .collect();
    let count = parts.iter().map(|part| part.1).sum();
    (parts.into_iter().flat_map(|part| part.0).collect(), count)
}

/// Whether the surface may be farther than `tolerance` from the middle of an edge, as far as its ends tell.
fn may_bulge(vertices: &[Vertex], edge: [u32; 2], tolerance: f64) -> bool {
    let [a, b] = edge.map(|v| &vertices[v as usize]);
    let chord = b.position - a.position;
    match (a.kind, b.kind) {
        // sheets that touch
        _ if chord == DVec3::ZERO => false,
        // a cap is no part of ω = 0
        (Kind::Cap, _) | (_, Kind::Cap) => false,
        (Kind::Smooth, Kind::Smooth) => (b.normal - a.normal).dot(chord).abs() > 4.0 * tolerance,
        _ => true,
    }
}

/// The vertex that cuts an edge: on the crease between the faces at its ends, or on the surface; none where the surface
/// is near after all (the field told another face's distance), or too far off.
fn middle(field: &dyn Field, [a, b]: [&Vertex; 2], tolerance: f64, count: &mut u64) -> Option<Vertex> {
    let (start, length) = (0.5 * (a.position + b.position), a.position.distance(b.position));
    let is_near = |p: &DVec3, reach: f64| p.distance(start) <= reach * length;
    let mut face = |p: DVec3, normal: DVec3| match unit(normal) {
        Some(normal) => project::onto_face(field, p, normal, length, count),
        None => project::newton(field, p, length, count),
    };
    let faces = [
        face(a.position.lerp(b.position, BESIDE), a.normal),
        face(b.position.lerp(a.position, BESIDE), b.normal),
    ];
    let near =
        faces.into_iter().flatten().any(|f| project::is_within(field, start, f.normal, tolerance, count));
    if near {
        return None;
    }
    if let [Some(first), Some(second)] = faces {
        let found = crease::find(field, start, &[first, second], length, count);
        // the bottom of a groove between walls at ±angle/2 lies half a length · tan(angle/2) below the middle
        let drop = (0.5 * first.normal.angle_between(second.normal)).tan();
        if let Some(position) = found.filter(|p| is_near(p, (0.25 + 0.75 * drop).min(LONGEST_DROP))) {
            return Some(Vertex { position, normal: DVec3::ZERO, kind: Kind::Sharp, fallback: position });
        }
    }
    let normal = faces.into_iter().flatten().fold(DVec3::ZERO, |sum, face| sum + face.normal);
    let found = match unit(normal) {
        Some(normal) => project::onto_face(field, start, normal, length, count),
        None => project::newton(field, start, length, count),
    };
    let found = found.filter(|face| is_near(&face.point, LONGEST_MOVE))?;
    Some(Vertex { position: found.point, normal: found.normal, kind: Kind::Smooth, fallback: found.point })
}

/// The triangles, those at cut edges divided. `middles` are sorted by their edges.
fn divided(vertices: &[Vertex], triangles: &[[u32; 3]], middles: &[([u32; 2], u32)]) -> Vec<[u32; 3]> {
    let mut is_end = vec![false; vertices.len()];
    middles.iter().flat_map(|m| m.0).for_each(|v| is_end[v as usize] = true);
    let middle = |a: u32, b: u32| {
        if !is_end[a as usize] || !is_end[b as usize] {
            return None;
        }
        let at = middles.binary_search_by_key(&[a.min(b), a.max(b)], |m| m.0).ok()?;
        Some(middles[at].1)
    };
    let distance = |a: u32, b: u32| vertices[a as usize].position.distance(vertices[b as usize].position);
    let mut out = Vec::with_capacity(triangles.len() + 4 * middles.len());
    for &[a, b, c] in triangles {
        // turned so that the first side is cut if one is, and the third is whole if one is
        let turns = [[a, b, c], [b, c, a], [c, a, b]];
        let cuts = turns.map(|[p, q, _]| middle(p, q));
        let turn = match cuts.map(|m| m.is_some()) {
            [false, true, _] => 1,
            [_, false, true] => 2,
            _ => 0,
        };
        let [a, b, c] = turns[turn];
        match [cuts[turn], cuts[(turn + 1) % 3], cuts[(turn + 2) % 3]] {
            [Some(ab), Some(bc), Some(ca)] => {
                out.extend([[a, ab, ca], [ab, b, bc], [bc, c, ca], [ab, bc, ca]])
            }
            [Some(ab), Some(bc), None] if distance(ab, c) <= distance(a, bc) => {
                out.extend([[ab, b, bc], [ab, bc, c], [a, ab, c]]);
            }
            [Some(ab), Some(bc), None] => out.extend([[ab, b, bc], [a, ab, bc], [a, bc, c]]),
            [Some(ab), None, None] => out.extend([[a, ab, c], [ab, b, c]]),
            _ => out.push([a, b, c]),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_choice_of_cut_sides_tiles_the_triangle() {
        let places =
            [DVec3::ZERO, DVec3::X, DVec3::Y, 0.5 * DVec3::X, DVec3::new(0.5, 0.5, 0.0), 0.5 * DVec3::Y];
        let vertices = places.map(|position| Vertex {
            position,
            normal: DVec3::Z,
            kind: Kind::Smooth,
            fallback: position,
        });
        let sides = [([0, 1], 3), ([0, 2], 5), ([1, 2], 4)];
        for chosen in 0..8 {
            let middles: Vec<_> = (0..3).filter(|i| chosen >> i & 1 == 1).map(|i| sides[i]).collect();
            for triangle in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
                let parts = divided(&vertices, &[triangle], &middles);
                assert_eq!(parts.len(), 1 + middles.len());
                let areas = parts.iter().map(|t| {
                    let [a, b, c] = t.map(|v| places[v as usize]);
                    0.5 * (b - a).cross(c - a).z
                });
                let areas: Vec<f64> = areas.collect();
                assert!(areas.iter().all(|&area| area > 0.0), "{chosen}: {parts:?}");
                assert_eq!(areas.iter().sum::<f64>(), 0.5);
            }
        }
    }
}
