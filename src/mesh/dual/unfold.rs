//! Turns edges so that no triangle lies upside down.
//!
//! Three vertices in a row on a crease, or two close together in a groove, may span a triangle that is folded over its
//! neighbour. Together the two make a quad; its other diagonal takes the fold out.
//!
//! Invariant: an edge is turned only if its new ends were not joined yet, so the mesh stays closed and manifold.

use std::collections::BTreeMap;

use glam::DVec3;

use super::super::normals::{gradients, unit};
use super::vertices::{Kind, Vertices};
use crate::field::Field;

/// Turning one edge may unfold its neighbours too; what is left after so many rounds stays.
const ROUNDS: usize = 4;

/// Turns edges of triangles that lie upside down.
pub(super) fn unfold(field: &dyn Field, vertices: &Vertices, triangles: &mut [[u32; 3]], count: &mut u64) {
    for _ in 0..ROUNDS {
        let folded = folded(field, vertices, triangles, count);
        if folded.is_empty() || !turn(field, vertices, triangles, &folded, count) {
            break;
        }
    }
}

fn corners(vertices: &Vertices, triangle: [u32; 3]) -> [DVec3; 3] {
    triangle.map(|v| vertices.positions[v as usize])
}

/// How well a triangle faces as the surface below its middle does, where ∇ω is given: the cosine between them.
fn facing([a, b, c]: [DVec3; 3], gradient: DVec3) -> f64 {
    match (unit((b - a).cross(c - a)), unit(-gradient)) {
        (Some(facing), Some(outward)) => facing.dot(outward),
        _ => 0.0,
    }
}

fn agreement(field: &dyn Field, vertices: &Vertices, triangle: [u32; 3], count: &mut u64) -> f64 {
    let corners = corners(vertices, triangle);
    *count += 1;
    facing(corners, field.omega_grad(corners.iter().sum::<DVec3>() / 3.0).1)
}

/// Triangles upside down; only vertices on creases make such.
fn folded(field: &dyn Field, vertices: &Vertices, triangles: &[[u32; 3]], count: &mut u64) -> Vec<usize> {
    let kinds = |t: &[u32; 3]| t.map(|v| vertices.kinds[v as usize]);
    let is_suspect = |kinds: [Kind; 3]| {
        kinds.iter().filter(|&&kind| kind == Kind::Sharp).count() >= 2 && !kinds.contains(&Kind::Cap)
    };
    let suspects: Vec<usize> =
        triangles.iter().enumerate().filter(|(_, t)| is_suspect(kinds(t))).map(|(i, _)| i).collect();
    let middle = |&t: &usize| corners(vertices, triangles[t]).iter().sum::<DVec3>() / 3.0;
    let middles: Vec<DVec3> = suspects.iter().map(middle).collect();
    *count += middles.len() as u64;
    let below = gradients(field, &middles);
    let found = suspects.into_iter().zip(below);
    found.filter(|&(t, (_, g))| facing(corners(vertices, triangles[t]), g) < 0.0).map(|(t, _)| t).collect()
}

/// Turns the edge of each folded triangle that helps most; whether any did.
fn turn(
    field: &dyn Field,
    vertices: &Vertices,
    triangles: &mut [[u32; 3]],
    folded: &[usize],
    count: &mut u64,
) -> bool {
    let mut fans: BTreeMap<u32, Vec<usize>> =
        folded.iter().flat_map(|&t| triangles[t]).map(|v| (v, Vec::new())).collect();
    for (i, triangle) in triangles.iter().enumerate() {
        for v in triangle {
            if let Some(fan) = fans.get_mut(v) {
                fan.push(i);
            }
        }
    }
    let mut is_touched = vec![false; triangles.len()];
    let mut turned = false;
    for &t in folded {
        let mut best: Option<(f64, usize, [[u32; 3]; 2])> = None;
        for side in 0..3 {
            let [a, b, c] = std::array::from_fn(|i| triangles[t][(side + i) % 3]);
            let other = fans[&a].iter().copied().find(|&o| o != t && triangles[o].contains(&b));
            let Some(other) = other.filter(|o| !is_touched[*o] && !is_touched[t]) else { continue };
            let Some(d) = triangles[other].into_iter().find(|v| *v != a && *v != b) else { continue };
            if d == c || fans[&c].iter().any(|&o| triangles[o].contains(&d)) {
                continue;
            }
            let mut worst = |pair: [[u32; 3]; 2]| {
                pair.map(|t| agreement(field, vertices, t, count)).into_iter().fold(1.0, f64::min)
            };
            let pair = [[a, d, c], [d, b, c]];
            let (before, after) = (worst([triangles[t], triangles[other]]), worst(pair));
            if after > before && best.is_none_or(|(least, ..)| after > least) {
                best = Some((after, other, pair));
            }
        }
        if let Some((_, other, pair)) = best {
            // fans of this round know nothing of the new triangles: their neighbours wait for the next
            let near = pair.concat();
            for v in near.iter().filter_map(|v| fans.get(v)).flatten() {
                is_touched[*v] = true;
            }
            (triangles[t], triangles[other]) = (pair[0], pair[1]);
            is_touched[t] = true;
            is_touched[other] = true;
            turned = true;
        }
    }
    turned
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::vertices::Vertex;
    use super::*;
    use crate::field::Closures;

    /// A flat square cut so that one half is folded over: a dart whose reflex corner lies inside the other half.
    #[test]
    fn a_fold_is_turned_out() {
        let floor = Closures { omega: |p: DVec3| -p.z, gradient: |_| -DVec3::Z };
        let places = [[0.0, 0.0], [2.0, 0.0], [0.4, 0.4], [0.0, 2.0]];
        let mut vertices = Vertices::default();
        for [x, y] in places {
            let position = DVec3::new(x, y, 0.0);
            vertices.push(Vertex { position, normal: DVec3::Z, kind: Kind::Sharp });
        }
        // 1–3 is the diagonal outside the dart 0, 1, 2, 3
        let mut triangles = [[0, 1, 3], [1, 2, 3]];
        assert!(agreement(&floor, &vertices, triangles[1], &mut 0) < 0.0);
        unfold(&floor, &vertices, &mut triangles, &mut 0);
        for t in triangles {
            assert!(agreement(&floor, &vertices, t, &mut 0) > 0.99, "{triangles:?}");
        }
    }
}
