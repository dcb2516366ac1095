//! Mends edges that stay far from the surface although nothing near their middles could cut them, and
//! triangles that lie upside down. Both occur at collars and gaps thinner than a cell, of which the grid has
//! seen a part.
//!
//! One edge after the other is turned, or cut at a point of the surface, or one of the vertices beside it
//! moves. The change is the one that brings the triangles beside the edge nearest to the surface without
//! folding them. Edges that a change touches wait in the same queue.
//!
//! Invariant: edges are treated in the order of their numbers, and an edge is turned only if its new ends
//! were not joined before. So the mesh stays closed and manifold and is the same on any number of threads.

use std::collections::VecDeque;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::super::{
    Watch,
    normals::{gradients, unit},
};
use super::patch::{FACING, NEAR, Pair, Patch, STEPS};
use super::vertices::{Vertex, VertexKind, Vertices};
use super::{crease, project};
use crate::field::Field;

/// A change must leave at most this share of what was wrong.
const LEFT: f64 = 0.9;

/// No edge shorter than this is cut, and none shorter than half of it is made, in cells.
const SHORTEST: f64 = 0.1;

/// The most edges that are looked at: for each edge in the queue at first, and in all, which takes a second.
/// Few edges are looked at that often unless the grid resolves nothing.
const LOOKS: usize = 40;
const MOST: usize = 20_000;

/// The largest number of edges to mend for each triangle, of which a mesh has 1.5 in all. With more the grid
/// does not resolve the surface, and nothing is mended.
const RESOLVED: f64 = 0.3;

/// What to mend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Aim {
    /// Edges that are far from the surface.
    Distance,
    /// Folded triangles. Their vertices may also be merged with others, by moving to the same point.
    Folds,
}

/// Whether there are edges to mend, and few enough of them.
pub(super) fn is_worth(edges: &[[u32; 2]], triangles: &[[u32; 3]]) -> bool {
    !edges.is_empty() && edges.len() as f64 <= RESOLVED * triangles.len() as f64
}

/// Mends the mesh around the given edges, which ascend, until about `budget` evaluations are spent or `watch` ends it.
/// Returns their number.
pub(super) fn mend(
    mut patch: Patch<'_>,
    edges: Vec<[u32; 2]>,
    tolerance: f64,
    aim: Aim,
    (budget, watch): (u64, &dyn Watch),
) -> u64 {
    let looks = MOST.min(LOOKS * edges.len());
    let mut waiting: FxHashSet<[u32; 2]> = edges.iter().copied().collect();
    let mut queue = VecDeque::from(edges);
    for _ in 0..looks {
        if patch.count > budget || watch.is_over() {
            break;
        }
        let Some(edge) = queue.pop_front() else { break };
        waiting.remove(&edge);
        let Some(pair) = patch.pair(edge) else { continue };
        if let Some(change) = best(&mut patch, pair, tolerance, aim) {
            let touched = make(&mut patch, pair, change).into_iter().map(|[a, b]| [a.min(b), a.max(b)]);
            queue.extend(touched.filter(|edge| waiting.insert(*edge)));
        }
    }
    patch.count
}

#[derive(Debug, Clone, Copy)]
enum Change {
    /// The edge is turned, so that it joins the apexes instead.
    Turn,
    /// The edge is cut.
    Cut(Vertex),
    /// A vertex moves.
    Move(u32, Vertex),
}

/// The change that helps most so far, with its gain: by how much it lowers the measure of what is wrong.
struct Choice(Option<(f64, Change)>);

impl Choice {
    /// The most that may be wrong after a change that is to be chosen.
    fn limit(&self, before: f64) -> f64 {
        f64::min(LEFT * before, before - self.0.map_or(0.0, |(most, _)| most))
    }

    /// Chooses a change if it helps most so far, and if no triangle then crosses another.
    fn consider(&mut self, before: f64, after: f64, change: Change, is_free: impl FnOnce() -> bool) {
        let gain = before - after;
        if after <= LEFT * before && self.0.is_none_or(|(most, _)| gain > most) && is_free() {
            self.0 = Some((gain, change));
        }
    }
}

/// The change at an edge that helps most. `None` if there is nothing to mend, or no change helps.
fn best(patch: &mut Patch<'_>, pair: Pair, tolerance: f64, aim: Aim) -> Option<Change> {
    let old = pair.triangles();
    let before = patch.badness(&old, &patch.along(pair.ends), f64::INFINITY);
    if before <= tolerance {
        return None;
    }
    let mut choice = Choice(None);
    let [c, d] = pair.apexes;
    if c != d && !patch.is_edge(pair.apexes) {
        let after = patch.badness(&pair.turned(), &patch.along(pair.apexes), choice.limit(before));
        choice.consider(before, after, Change::Turn, || !patch.cross(&pair.turned(), &pair.places));
    }
    let [p, q] = pair.ends.map(|v| patch.position(v));
    if p.distance(q) > SHORTEST * patch.size {
        let new = patch.vertices.len() as u32;
        for vertex in cuts(patch, pair) {
            let distances = pair.corners().map(|v| patch.position(v).distance(vertex.position));
            if distances.into_iter().any(|distance| distance < 0.5 * SHORTEST * patch.size) {
                continue;
            }
            patch.vertices.push(vertex);
            let spokes = pair.corners().map(|v| patch.along([v, new])).concat();
            let after = patch.badness(&pair.cut(new), &spokes, choice.limit(before));
            let is_free = || !patch.cross(&pair.cut(new), &pair.places);
            choice.consider(before, after, Change::Cut(vertex), is_free);
            patch.vertices.truncate(new as usize);
        }
    }
    let may_merge = aim == Aim::Folds || old.iter().any(|t| patch.fold(*t) > FACING);
    for v in pair.corners() {
        let old = patch.vertices.get(v);
        if old.kind != VertexKind::Sharp {
            continue;
        }
        let before = patch.badness_around(v, f64::INFINITY);
        for vertex in places(patch, v, may_merge) {
            patch.vertices.set(v, vertex);
            let after = patch.badness_around(v, choice.limit(before));
            choice.consider(before, after, Change::Move(v, vertex), || !patch.crosses_around(v));
        }
        patch.vertices.set(v, old);
    }
    choice.0.map(|(_, change)| change)
}

/// Makes a change. Returns the edges that it touches.
fn make(patch: &mut Patch<'_>, pair: Pair, change: Change) -> Vec<[u32; 2]> {
    match change {
        Change::Turn => {
            patch.replace(pair, &pair.turned());
            [&pair.rim()[..], &[pair.apexes]].concat()
        }
        Change::Cut(vertex) => {
            let new = patch.vertices.len() as u32;
            patch.vertices.push(vertex);
            patch.replace(pair, &pair.cut(new));
            [pair.rim(), pair.corners().map(|v| [v, new])].concat()
        }
        Change::Move(v, vertex) => patch.put(v, vertex).into_iter().flat_map(sides).collect(),
    }
}

fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// The face of an edge's end is looked up at this share of the edge's length from the end.
const BESIDE: f64 = 0.1;

/// Points of the surface where an edge may be cut: on the crease of the faces at its ends, and beside the
/// point of the edge that is farthest off the surface.
fn cuts(patch: &mut Patch<'_>, pair: Pair) -> Vec<Vertex> {
    let [a, b] = pair.ends.map(|v| patch.vertices.get(v));
    let points = patch.along(pair.ends);
    let off = points.map(|p| patch.distance(p));
    let start = (0..points.len()).max_by(|&i, &j| off[i].total_cmp(&off[j])).map_or(points[0], |i| points[i]);
    let length = a.position.distance(b.position);
    let reach = length.max(patch.size);
    let (field, count) = (patch.field, &mut patch.count);
    let faces = [(a, b), (b, a)].map(|(at, other)| {
        let p = at.position.lerp(other.position, BESIDE);
        match unit(at.normal) {
            Some(normal) => project::onto_face(field, p, normal, length, count),
            None => project::newton(field, p, length, count),
        }
    });
    let mut found = Vec::new();
    if let [Some(first), Some(second)] = faces {
        let at = crease::find(field, start, &[first, second], reach, count);
        found.extend(at.map(|position| Vertex { position, normal: DVec3::ZERO, kind: VertexKind::Sharp }));
    }
    let mean = faces.into_iter().flatten().fold(DVec3::ZERO, |sum, face| sum + face.normal);
    let mut near: Vec<_> = project::newton(field, start, reach, count).into_iter().collect();
    let [c, d] = pair.apexes.map(|v| patch.position(v));
    let across = (b.position - a.position).cross(c - d);
    for way in [mean, across].into_iter().filter_map(unit) {
        near.extend(project::along(field, start, way, reach, &mut patch.count));
    }
    found.extend(near.into_iter().map(on_face));
    found.retain(|vertex| patch.bounds.contains(vertex.position));
    found
}

fn on_face(face: project::FacePoint) -> Vertex {
    Vertex { position: face.point, normal: face.normal, kind: VertexKind::Sharp }
}

/// A vertex nearer to the surface than this, in cells, is on it and need not move onto it.
const ON_SURFACE: f64 = 1e-6;

/// Points of the surface to which a vertex may move: near it, near the middle of its triangles, and where it
/// may be merged with another vertex.
fn places(patch: &mut Patch<'_>, v: u32, may_merge: bool) -> Vec<Vertex> {
    let (mut facing, mut middle, mut count) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for t in patch.fan(v) {
        let [a, b, c] = t.map(|v| patch.position(v));
        facing += (b - a).cross(c - a);
        middle += (a + b + c) / 3.0;
        count += 1.0;
    }
    let here = patch.position(v);
    let is_off = patch.distance(here) > ON_SURFACE * patch.size;
    let mut found = Vec::new();
    for start in [here, middle / count].into_iter().skip(usize::from(!is_off)) {
        let nearest = project::newton(patch.field, start, patch.size, &mut patch.count);
        // the line along a normal leads to the same point as Newton's method, unless that found another face
        let other =
            unit(facing).filter(|f| nearest.is_none_or(|face| face.normal.dot(*f) < project::SAME_FACE));
        if let Some(facing) = other {
            found.extend(project::along(patch.field, start, facing, patch.size, &mut patch.count));
        }
        found.extend(nearest);
    }
    let mut found: Vec<Vertex> = found.into_iter().map(on_face).collect();
    found.retain(|vertex| patch.bounds.contains(vertex.position));
    if may_merge {
        let others = patch.mergeable(v).into_iter();
        found.extend(others.map(|other| Vertex { kind: VertexKind::Sharp, ..patch.vertices.get(other) }));
    }
    found
}

/// Triangles in a batch.
const BATCH: usize = 2048;

/// Triangles whose normals agree less than this with the surface below them (cosine) are looked at again.
const DOUBT: f64 = 0.8;

/// Edges of triangles that lie upside down, ascending, and the number of evaluations. Only triangles with
/// vertices on creases can be folded.
pub(super) fn folded(
    field: &dyn Field,
    vertices: &Vertices,
    triangles: &[[u32; 3]],
    size: f64,
) -> (Vec<[u32; 2]>, u64) {
    let find = |part: &[[u32; 3]]| {
        let mut suspects = Vec::new();
        for t in part {
            let kinds = t.map(|v| vertices.kinds[v as usize]);
            if kinds.contains(&VertexKind::Sharp) && !kinds.contains(&VertexKind::Cap) {
                suspects.push(*t);
            }
        }
        suspects
    };
    let suspects: Vec<Vec<[u32; 3]>> = triangles.par_chunks(BATCH).map(find).collect();
    let mut suspects = suspects.concat();
    let corners = |t: [u32; 3]| t.map(|v| vertices.positions[v as usize]);
    let mut feet: Vec<DVec3> = suspects.iter().map(|&t| corners(t).iter().sum::<DVec3>() / 3.0).collect();
    let mut folded = Vec::new();
    let mut evaluations = 0;
    for _ in 0..STEPS {
        evaluations += feet.len() as u64;
        let found = gradients(field, &feet);
        let mut doubtful = Vec::new();
        for ((t, foot), (omega, gradient)) in suspects.into_iter().zip(feet).zip(found) {
            let [a, b, c] = corners(t);
            let directions = unit((b - a).cross(c - a)).zip(unit(-gradient));
            let Some(facing) = directions.map(|(facing, normal)| facing.dot(normal)) else { continue };
            let step = gradient * (omega / gradient.length_squared());
            if facing < 0.0 {
                folded.push(t);
            } else if facing < DOUBT && step.is_finite() && step.length() > NEAR * size {
                doubtful.push((t, foot - step));
            }
        }
        (suspects, feet) = doubtful.into_iter().unzip();
    }
    let mut edges: Vec<[u32; 2]> =
        folded.into_iter().flat_map(sides).map(|[a, b]| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    edges.dedup();
    (edges, evaluations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;
    use crate::geom::Aabb;
    use crate::mesh::Unwatched;
    use crate::mesh::dual::care::Care;

    const BOUNDS: Aabb = Aabb { min: DVec3::splat(-9.0), max: DVec3::splat(9.0) };

    fn vertices(places: &[[f64; 3]]) -> Vertices {
        let mut vertices = Vertices::default();
        for place in places {
            let position = DVec3::from_array(*place);
            vertices.push(Vertex { position, normal: DVec3::ZERO, kind: VertexKind::Sharp });
        }
        vertices
    }

    /// Two triangles of a floor that face upwards, one of them folded over: together they are a dart whose
    /// reflex corner lies inside the other half.
    #[test]
    fn a_fold_is_taken_out() {
        let floor = Closures { omega: |p: DVec3| -p.z, gradient: |_| -DVec3::Z };
        let mut vertices = vertices(&[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.4, 0.4, 0.0], [0.0, 2.0, 0.0]]);
        // 1–3 is the diagonal outside the dart 0, 1, 2, 3
        let mut triangles = vec![[0, 1, 3], [1, 2, 3]];
        let (edges, _) = folded(&floor, &vertices, &triangles, 1.0);
        assert_eq!(edges, [[1, 2], [1, 3], [2, 3]]);
        let patch = Patch::new(&floor, (&BOUNDS, 1.0, Care::Apart), &mut vertices, &mut triangles, &edges);
        mend(patch, edges, 0.01, Aim::Folds, (u64::MAX, &Unwatched));
        assert_eq!(folded(&floor, &vertices, &triangles, 1.0).0, [[0; 2]; 0]);
        assert_eq!(triangles.len(), 2);
    }

    /// A plate that is thinner than the edges around it. One edge runs through it, from its upper face to its
    /// lower one.
    #[test]
    fn an_edge_through_a_plate_is_cut_at_its_rim() {
        let plate = Closures {
            omega: |p: DVec3| 1.0 - p.x * p.x - 16.0 * p.z * p.z,
            gradient: |p: DVec3| DVec3::new(-2.0 * p.x, 0.0, -32.0 * p.z),
        };
        let height = (1.0_f64 - 0.4 * 0.4).sqrt() / 4.0;
        let (up, down) = (height, -height);
        let mut vertices = vertices(&[[0.4, 0.0, up], [0.4, 0.0, down], [0.4, 1.0, up], [0.4, -1.0, down]]);
        let mut triangles = vec![[1, 2, 0], [1, 0, 3]];
        let edges = vec![[0, 1]];
        let patch = Patch::new(&plate, (&BOUNDS, 1.0, Care::Apart), &mut vertices, &mut triangles, &edges);
        mend(patch, edges, 0.025, Aim::Distance, (u64::MAX, &Unwatched));
        let farthest = vertices.positions.iter().map(|p| p.x).fold(0.0, f64::max);
        assert!((farthest - 1.0).abs() < 1e-9, "{:?}", vertices.positions);
        assert!(triangles.len() > 2);
    }
}
