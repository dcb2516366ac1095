//! Mends the places where edges stay far from the surface although nothing near their middles could cut them: collars
//! and gaps thinner than a cell, which the grid has seen in part.
//!
//! One edge after the other is cut at one of several points of the surface, or turned, whichever brings the triangles
//! beside it nearest to the surface without turning them over. A new edge that is far off again waits in the same queue.
//!
//! Invariant: edges are treated in the order of their numbers and an edge is turned only if its new ends were not joined
//! yet, so the mesh stays closed and manifold and is the same on any number of threads.

use std::collections::VecDeque;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::super::normals::{gradients, unit};
use super::vertices::{Kind, Vertex, Vertices};
use super::{crease, project};
use crate::field::Field;

/// Triangles that face less like the surface below them than this (cosine) count as folded, the more the less they do.
const FACING: f64 = 0.3;

/// What a fold weighs against a distance of as many cells.
const WEIGHT: f64 = 1.0;

/// A change must leave at most this share of what it is to mend.
const LEFT: f64 = 0.9;

/// No edge shorter than this is cut, in cells.
const SHORTEST: f64 = 0.1;

/// Steps of Newton's method from the middle of a triangle to the surface below, and the step that needs no other after it,
/// in cells: what faces there is to be known, not where it is.
const STEPS: usize = 4;
const NEAR: f64 = 0.01;

/// Triangles that face less than this like the surface below them (cosine) are looked at once more.
const DOUBT: f64 = 0.8;

/// Where an edge is compared with the surface, as shares of its length.
pub(super) const SHARES: [f64; 3] = [0.5, 0.25, 0.75];

/// Changes for each edge that was far off at first.
const CHANGES: usize = 12;

/// Mends what is around the given edges, ascending; returns the number of evaluations of ∇ω.
pub(super) fn mend(
    field: &dyn Field,
    vertices: &mut Vertices,
    triangles: &mut Vec<[u32; 3]>,
    edges: Vec<[u32; 2]>,
    (size, tolerance): (f64, f64),
    may_merge: bool,
) -> u64 {
    if edges.is_empty() {
        return 0;
    }
    let mut changes = CHANGES * edges.len();
    let fans = fans(vertices.len(), triangles, &edges);
    let mut patch = Patch { field, size, vertices, triangles, fans, count: 0, may_merge };
    let mut queue = VecDeque::from(edges);
    while let Some(edge) = queue.pop_front() {
        if changes == 0 {
            break;
        }
        if let Some(changed) = patch.improve(edge, tolerance) {
            changes -= 1;
            queue.extend(changed);
        }
    }
    patch.count
}

/// The triangles around the vertices near some edges: those of the edges, their neighbours and the neighbours of these.
fn fans(vertices: usize, triangles: &[[u32; 3]], edges: &[[u32; 2]]) -> FxHashMap<u32, Vec<u32>> {
    let mut is_near = vec![false; vertices];
    edges.iter().flatten().for_each(|&v| is_near[v as usize] = true);
    for _ in 0..RINGS {
        let beside: Vec<[u32; 3]> =
            triangles.iter().filter(|t| t.iter().any(|&v| is_near[v as usize])).copied().collect();
        beside.iter().flatten().for_each(|&v| is_near[v as usize] = true);
    }
    let mut fans: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for (i, t) in (0..).zip(triangles) {
        for v in t.iter().filter(|&&v| is_near[v as usize]) {
            fans.entry(*v).or_default().push(i);
        }
    }
    fans
}

/// How far from the edges changes may spread, in edges.
const RINGS: usize = 3;

/// The mesh around the edges to mend.
struct Patch<'a> {
    field: &'a dyn Field,
    size: f64,
    vertices: &'a mut Vertices,
    triangles: &'a mut Vec<[u32; 3]>,
    /// Triangles around each vertex of the patch.
    fans: FxHashMap<u32, Vec<u32>>,
    count: u64,
    may_merge: bool,
}

/// The two triangles at an edge a–b: (a, b, c) and (b, a, d).
#[derive(Clone, Copy)]
struct Pair {
    places: [u32; 2],
    ends: [u32; 2],
    apexes: [u32; 2],
}

/// A change of the mesh, and how much less is wrong after it.
struct Change {
    gain: f64,
    kind: ChangeKind,
}

enum ChangeKind {
    /// The edge joins the apexes instead.
    Turn,
    /// The edge is cut.
    Cut(Vertex),
    /// The vertex goes elsewhere.
    Move(u32, Vertex),
}

impl Patch<'_> {
    /// Makes the change about an edge that helps most, if any does; the edges that this touches.
    fn improve(&mut self, edge: [u32; 2], tolerance: f64) -> Option<Vec<[u32; 2]>> {
        let pair = self.pair(edge)?;
        let ([a, b], [c, d]) = (pair.ends, pair.apexes);
        let old = [[a, b, c], [b, a, d]];
        let before = self.badness(&old, &self.along(edge));
        if before <= tolerance {
            return None;
        }
        let is_folded = self.may_merge || old.iter().any(|t| self.folds(*t) > FACING);
        let mut best: Option<Change> = None;
        let mut consider = |before: f64, after: f64, kind: ChangeKind| {
            let gain = before - after;
            if after <= LEFT * before && best.as_ref().is_none_or(|best| gain > best.gain) {
                best = Some(Change { gain, kind });
            }
        };
        if c != d && !self.is_edge([c, d]) {
            let after = self.badness(&turned(pair), &self.along([c, d]));
            consider(before, after, ChangeKind::Turn);
        }
        let new = self.vertices.len() as u32;
        if self.position(a).distance(self.position(b)) > SHORTEST * self.size {
            for vertex in self.candidates(pair) {
                let is_new = |v: u32| self.position(v).distance(vertex.position) > 0.5 * SHORTEST * self.size;
                if ![a, b, c, d].into_iter().all(is_new) {
                    continue;
                }
                self.vertices.push(vertex);
                let spokes = [a, b, c, d].map(|v| self.along([v, new])).concat();
                let after = self.badness(&cut(pair, new), &spokes);
                self.vertices.pop();
                consider(before, after, ChangeKind::Cut(vertex));
            }
        }
        for v in [a, b, c, d] {
            if self.vertices.kinds[v as usize] != Kind::Sharp {
                continue;
            }
            let Some(before) = self.badness_around(v) else { continue };
            let old = self.vertices.get(v);
            for vertex in self.places(v, is_folded) {
                self.vertices.set(v, vertex);
                let after = self.badness_around(v).unwrap_or(before);
                consider(before, after, ChangeKind::Move(v, vertex));
            }
            self.vertices.set(v, old);
        }
        let rim = [[a, c], [b, c], [a, d], [b, d]];
        match best?.kind {
            ChangeKind::Turn => {
                let [first, second] = turned(pair);
                self.replace(pair, [first, second], &[]);
                Some([&rim[..], &[[c, d]]].concat())
            }
            ChangeKind::Cut(vertex) => {
                self.vertices.push(vertex);
                let [first, second, third, fourth] = cut(pair, new);
                self.replace(pair, [first, second], &[third, fourth]);
                Some([&rim[..], &[a, b, c, d].map(|v| [v, new])].concat())
            }
            ChangeKind::Move(v, vertex) => {
                for other in self.around(v) {
                    // to be merged
                    if self.position(other) == vertex.position {
                        self.vertices.kinds[other as usize] = Kind::Sharp;
                    }
                }
                self.vertices.set(v, vertex);
                let around = self.fans.get(&v)?.iter().map(|&t| self.triangles[t as usize]);
                Some(around.flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]).collect())
            }
        }
    }

    fn is_edge(&self, [a, b]: [u32; 2]) -> bool {
        self.fans.get(&a).is_some_and(|fan| fan.iter().any(|&t| self.triangles[t as usize].contains(&b)))
    }

    /// Points spread along an edge.
    fn along(&self, edge: [u32; 2]) -> [DVec3; 3] {
        let [p, q] = edge.map(|v| self.position(v));
        SHARES.map(|share| p.lerp(q, share))
    }

    /// What is wrong about a vertex and its triangles.
    fn badness_around(&mut self, v: u32) -> Option<f64> {
        let fan = self.fans.get(&v)?;
        let triangles: Vec<[u32; 3]> = fan.iter().map(|&t| self.triangles[t as usize]).collect();
        let rim = triangles.iter().map(|t| (0..3).find(|&i| t[i] == v).map_or(v, |i| t[(i + 1) % 3]));
        let mut points: Vec<DVec3> = rim.flat_map(|other| self.along([v, other])).collect();
        points.push(self.position(v));
        Some(self.badness(&triangles, &points))
    }

    /// Points of the surface where a vertex may go.
    fn places(&mut self, v: u32, may_merge: bool) -> Vec<Vertex> {
        let Some(fan) = self.fans.get(&v).filter(|fan| !fan.is_empty()) else { return Vec::new() };
        let (mut facing, mut middle) = (DVec3::ZERO, DVec3::ZERO);
        for t in fan {
            let [a, b, c] = self.triangles[*t as usize].map(|v| self.position(v));
            facing += (b - a).cross(c - a);
            middle += (a + b + c) / (3 * fan.len()) as f64;
        }
        let (at, size) = (self.position(v), self.size);
        let mut found = Vec::new();
        for start in [at, middle] {
            let along = unit(facing)
                .and_then(|facing| project::along(self.field, start, facing, size, &mut self.count));
            found.extend(along);
            found.extend(project::newton(self.field, start, size, &mut self.count));
        }
        let vertex = |face: crease::Face| Vertex { position: face.point, normal: face.normal, kind: Kind::Sharp };
        let mut found: Vec<Vertex> = found.into_iter().map(vertex).collect();
        let around = self.around(v);
        if !may_merge {
            return found;
        }
        for &other in &around {
            let joined = self.around(other);
            let common = around.iter().filter(|v| joined.contains(v)).count();
            let kind = self.vertices.kinds[other as usize];
            if self.fans.contains_key(&other) && kind != Kind::Cap && common == 2 && around.len() > 3 {
                found.push(Vertex { kind: Kind::Sharp, ..self.vertices.get(other) });
            }
        }
        found
    }

    /// Vertices joined to one by an edge.
    fn around(&self, v: u32) -> Vec<u32> {
        let fan = self.fans.get(&v).map_or(&[][..], Vec::as_slice);
        let sides = fan.iter().map(|&t| self.triangles[t as usize]);
        sides.filter_map(|t| (0..3).find(|&i| t[i] == v).map(|i| t[(i + 1) % 3])).collect()
    }

    fn pair(&self, [a, b]: [u32; 2]) -> Option<Pair> {
        let triangle = |t: &u32| self.triangles[*t as usize];
        let runs = |t: [u32; 3], [a, b]: [u32; 2]| (0..3).any(|i| t[i] == a && t[(i + 1) % 3] == b);
        let fan = self.fans.get(&a)?;
        let first = *fan.iter().find(|t| runs(triangle(t), [a, b]))?;
        let second = *fan.iter().find(|t| runs(triangle(t), [b, a]))?;
        let apex = |t: u32| triangle(&t).into_iter().find(|v| *v != a && *v != b);
        let pair = Pair { places: [first, second], ends: [a, b], apexes: [apex(first)?, apex(second)?] };
        // caps are no part of ω = 0
        let is_free = |v: &u32| self.fans.contains_key(v) && self.vertices.kinds[*v as usize] != Kind::Cap;
        pair.ends.iter().chain(&pair.apexes).all(is_free).then_some(pair)
    }

    /// Puts triangles in the place of a pair, and others to the end.
    fn replace(&mut self, pair: Pair, now: [[u32; 3]; 2], more: &[[u32; 3]]) {
        for (place, t) in pair.places.into_iter().zip(now) {
            for v in self.triangles[place as usize] {
                self.fans.entry(v).or_default().retain(|&other| other != place);
            }
            self.triangles[place as usize] = t;
            t.iter().for_each(|v| self.fans.entry(*v).or_default().push(place));
        }
        for t in more {
            let place = self.triangles.len() as u32;
            self.triangles.push(*t);
            t.iter().for_each(|v| self.fans.entry(*v).or_default().push(place));
        }
    }

    /// Points of the surface where an edge may be cut.
    fn candidates(&mut self, pair: Pair) -> Vec<Vertex> {
        let [a, b] = pair.ends.map(|v| self.vertices.get(v));
        let length = a.position.distance(b.position);
        let points = self.along(pair.ends);
        let off = points.map(|p| self.step(p).0.length());
        let worst = (0..points.len()).max_by(|&i, &j| off[i].total_cmp(&off[j])).unwrap_or(1);
        let start = points[worst];
        let reach = length.max(self.size);
        let mut found = Vec::new();
        let faces = [(a, b), (b, a)].map(|(at, other)| {
            let p = at.position.lerp(other.position, BESIDE);
            match unit(at.normal) {
                Some(normal) => project::onto_face(self.field, p, normal, length, &mut self.count),
                None => project::newton(self.field, p, length, &mut self.count),
            }
        });
        if let [Some(first), Some(second)] = faces {
            let at = crease::find(self.field, start, &[first, second], reach, &mut self.count);
            found.extend(at.map(|position| Vertex { position, normal: DVec3::ZERO, kind: Kind::Sharp }));
        }
        let sum = faces.into_iter().flatten().fold(DVec3::ZERO, |sum, face| sum + face.normal);
        let apexes = pair.apexes.map(|v| self.position(v));
        let outwards = pair.ends.map(|v| self.position(v));
        let flat = (outwards[1] - outwards[0]).cross(apexes[0] - apexes[1]);
        let ways = [unit(sum), unit(flat)].into_iter().flatten();
        let near: Vec<_> =
            ways.filter_map(|way| project::along(self.field, start, way, reach, &mut self.count)).collect();
        let near = near.into_iter().chain(project::newton(self.field, start, reach, &mut self.count));
        found.extend(near.map(|face| Vertex { position: face.point, normal: face.normal, kind: Kind::Sharp }));
        found
    }

    fn position(&self, v: u32) -> DVec3 {
        self.vertices.positions[v as usize]
    }

    /// What is wrong with triangles, as a distance: how far their middles and some more points are from the surface, at
    /// most, and how much they turn from it in all.
    fn badness(&mut self, triangles: &[[u32; 3]], points: &[DVec3]) -> f64 {
        let mut off = 0.0;
        for p in points {
            off = f64::max(off, self.step(*p).0.length());
        }
        let mut folds = 0.0;
        for t in triangles {
            let middle = t.map(|v| self.position(v)).iter().sum::<DVec3>() / 3.0;
            off = f64::max(off, self.step(middle).0.length());
            folds += self.folds(*t);
        }
        off + WEIGHT * self.size * folds
    }

    /// How much less a triangle faces like the surface below its middle than it should; above [`FACING`] it is folded.
    fn folds(&mut self, t: [u32; 3]) -> f64 {
        let [a, b, c] = t.map(|v| self.position(v));
        let Some(facing) = unit((b - a).cross(c - a)) else { return 0.0 };
        let mut foot = (a + b + c) / 3.0;
        let mut folds = 0.0;
        for _ in 0..STEPS {
            let (step, normal) = self.step(foot);
            foot -= step;
            folds = normal.map_or(folds, |normal| f64::max(folds, FACING - facing.dot(normal)));
            if step.length() <= NEAR * self.size {
                break;
            }
        }
        folds
    }

    /// The step of Newton's method at a point, of a cell at most, and the outward normal there.
    fn step(&mut self, p: DVec3) -> (DVec3, Option<DVec3>) {
        self.count += 1;
        let (omega, gradient) = self.field.omega_grad(p);
        let step = gradient * (omega / gradient.length_squared());
        let step = if step.is_finite() { step.clamp_length_max(self.size) } else { DVec3::ZERO };
        (step, unit(-gradient))
    }
}

/// Where on an edge the faces of its two ends are looked up, as a share of its length.
const BESIDE: f64 = 0.1;

/// The triangles of a pair whose edge is cut at a vertex.
fn cut(pair: Pair, m: u32) -> [[u32; 3]; 4] {
    let ([a, b], [c, d]) = (pair.ends, pair.apexes);
    [[a, m, c], [b, m, d], [m, b, c], [m, a, d]]
}

/// The triangles of a pair whose edge is turned.
fn turned(pair: Pair) -> [[u32; 3]; 2] {
    let ([a, b], [c, d]) = (pair.ends, pair.apexes);
    [[a, d, c], [d, b, c]]
}

/// Edges of triangles that lie upside down, ascending; only vertices on creases make such.
pub(super) fn folded(
    field: &dyn Field,
    vertices: &Vertices,
    triangles: &[[u32; 3]],
    size: f64,
    count: &mut u64,
) -> Vec<[u32; 2]> {
    let kinds = |t: &&[u32; 3]| t.map(|v| vertices.kinds[v as usize]);
    let mut suspects: Vec<[u32; 3]> = triangles
        .par_iter()
        .filter(|t| kinds(t).contains(&Kind::Sharp) && !kinds(t).contains(&Kind::Cap))
        .copied()
        .collect();
    let corners = |t: [u32; 3]| t.map(|v| vertices.positions[v as usize]);
    let mut feet: Vec<DVec3> = suspects.iter().map(|&t| corners(t).iter().sum::<DVec3>() / 3.0).collect();
    let mut folded = Vec::new();
    for _ in 0..STEPS {
        *count += feet.len() as u64;
        let found = gradients(field, &feet);
        let mut doubtful = Vec::new();
        for ((t, foot), (omega, gradient)) in suspects.into_iter().zip(feet).zip(found) {
            let [a, b, c] = corners(t);
            let normals = unit((b - a).cross(c - a)).zip(unit(-gradient));
            let Some(facing) = normals.map(|(facing, normal)| facing.dot(normal)) else { continue };
            let step = gradient * (omega / gradient.length_squared());
            if facing < 0.0 {
                folded.push(t);
            } else if facing < DOUBT && step.is_finite() && step.length() > NEAR * size {
                doubtful.push((t, foot - step));
            }
        }
        (suspects, feet) = doubtful.into_iter().unzip();
    }
    let sides = folded.into_iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut sides: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    sides.sort_unstable();
    sides.dedup();
    sides
}
