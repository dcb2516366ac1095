//! The mesh between its first triangles and its end: refined, mended, merged, and given its last normals.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use super::super::{
    Grid, Mesh, MeshError, Watch, Work,
    collapse::{self, AtNode},
    crossings::ended,
    intersections::{Cubes, Neighbours, bounds_of, corners, crossing_pairs},
    normals,
};
use super::care::Care;
use super::mend::{self, Aim};
use super::patch::Patch;
use super::refine::{self, Refined};
use super::vertices::{Vertex, VertexKind, Vertices};
use crate::field::Field;
use crate::geom::Aabb;

/// How often folded triangles are looked for and mended.
const REPAIRS: usize = 4;

/// Evaluations for mending where triangles must not cross: as a share of those that found the surface, which
/// were made many at a time, and the least number.
const MENDING: f64 = 0.25;
const LEAST_MENDING: u64 = 20_000;

/// Evaluations for mending where nothing crosses: as a share, and the least number. The examples need up to
/// four times as many as found the surface; without a limit, a mesh of a surface with details everywhere
/// would never be done.
const SHARP_MENDING: f64 = 8.0;
const LEAST_SHARP_MENDING: u64 = 200_000;

/// Maximum number of rounds of moving cuts back. The last one moves all back.
const UNDOINGS: usize = 16;

/// Greatest number of times that some of them are tried on the surface again.
const RESTORINGS: usize = 10_000;

/// A triangle that agrees less than this (cosine) with the surface at a corner is compared with others.
const AGREEING: f64 = 0.3;

/// Triangles in a batch.
const BATCH: usize = 4096;

/// Vertices on a crease that an edge shorter than this joins are merged, in cells. Two cells, or two cut
/// edges, may have put them at nearly the same point.
const TOO_CLOSE: f64 = 0.1;

/// A mesh that is still worked on.
#[derive(Clone)]
pub(super) struct Draft<'a> {
    field: &'a dyn Field,
    /// The grid.
    bounds: &'a Aabb,
    /// The shortest side of a cell.
    size: f64,
    /// May end the work.
    watch: &'a dyn Watch,
    vertices: Vertices,
    triangles: Vec<[u32; 3]>,
    work: Work,
    care: Care,
    /// The vertices from here on cut edges.
    first_cut: usize,
    /// The ends of these edges.
    cut_ends: Vec<[u32; 2]>,
}

impl<'a> Draft<'a> {
    /// The mesh as it was first joined in a grid.
    pub fn new(
        field: &'a dyn Field,
        grid: &'a Grid,
        (vertices, triangles): (Vertices, Vec<[u32; 3]>),
        work: Work,
        watch: &'a dyn Watch,
    ) -> Self {
        let (bounds, size) = (grid.bounds(), grid.spacing().min_element());
        let (first_cut, cut_ends) = (vertices.len(), Vec::new());
        Self { field, bounds, size, watch, vertices, triangles, work, care: Care::Sharp, first_cut, cut_ends }
    }

    /// Cuts edges until the mesh is near the surface. Returns the edges that are not near and could not be
    /// cut, ascending.
    ///
    /// # Errors
    /// [`MeshError::Ended`].
    pub fn cut(&mut self) -> Result<Vec<[u32; 2]>, MeshError> {
        self.first_cut = self.vertices.len();
        let Refined { left, ends, evaluations } =
            refine::refine(self.field, &mut self.vertices, &mut self.triangles, self.size, self.watch)?;
        self.work.gradients += evaluations;
        self.cut_ends = ends;
        Ok(left)
    }

    /// Moves cuts back where triangles cross, if none crossed without them, and takes care from now on that none do.
    /// For a mesh that was cut and not mended.
    ///
    /// # Errors
    /// [`MeshError::Ended`].
    pub fn part(&mut self) -> Result<(), MeshError> {
        self.care = Care::Apart;
        let ends = std::mem::take(&mut self.cut_ends);
        if !ends.is_empty() {
            self.uncross(self.first_cut, &ends)?;
        }
        Ok(())
    }

    /// Moves vertices that cut edges back to the middles of their edges where triangles cross, and then
    /// returns as many of them as possible to the surface. The vertices with indices from `first` cut the
    /// edges with the given ends; without them nothing crosses.
    ///
    /// # Errors
    /// [`MeshError::Ended`].
    fn uncross(&mut self, first: usize, ends: &[[u32; 2]]) -> Result<(), MeshError> {
        let mut is_back = vec![false; ends.len()];
        let mut suspects = self.doubtful();
        let mut cuts: BTreeMap<u32, Vertex> = BTreeMap::new();
        let place_of = |v: u32| (v as usize).checked_sub(first);
        for round in 1..=UNDOINGS {
            ended(self.watch)?;
            let pairs = crossing_pairs(&self.vertices.positions, &self.triangles, &suspects, self.size);
            // a vertex in the middle of its edge lies in the plane of the first triangles only if its ends do
            let mut retreating: Vec<usize> = pairs
                .iter()
                .flatten()
                .flat_map(|&t| self.triangles[t as usize])
                .filter_map(place_of)
                .collect();
            let mut moves = false;
            while let Some(place) = retreating.pop() {
                if !std::mem::replace(&mut is_back[place], true) {
                    moves = true;
                    retreating.extend(ends[place].into_iter().filter_map(place_of));
                }
            }
            if !moves {
                break; // nothing crosses, or only what crossed before
            }
            if round == UNDOINGS {
                is_back.fill(true);
            }
            let mut is_moved = vec![false; ends.len()];
            for (place, [a, b]) in ends.iter().enumerate().filter(|(place, _)| is_back[*place]) {
                let [p, q] = [a, b].map(|v| self.vertices.positions[*v as usize]);
                let vertex = Vertex { position: p.midpoint(q), normal: DVec3::ZERO, kind: VertexKind::Sharp };
                let v = (first + place) as u32;
                let old = self.vertices.get(v);
                if vertex.position != old.position {
                    is_moved[place] = true;
                    cuts.entry(v).or_insert(old);
                    self.vertices.set(v, vertex);
                }
            }
            // all other pairs are as they were when they did not cross
            let beside = |t: &[u32; 3]| t.iter().any(|&v| place_of(v).is_some_and(|place| is_moved[place]));
            let touched = (0..).zip(&self.triangles).filter(|(_, t)| beside(t)).map(|(t, _)| t);
            suspects = touched.chain(pairs.iter().flatten().copied()).collect();
            suspects.sort_unstable();
            suspects.dedup();
        }
        self.restore(&cuts);
        Ok(())
    }

    /// Moves vertices to where they were, unless a triangle beside them would then cross another: all at once
    /// if that is possible, and otherwise each half of them.
    fn restore(&mut self, cuts: &BTreeMap<u32, Vertex>) {
        let mut beside: FxHashMap<u32, SmallVec<[u32; 8]>> = FxHashMap::default();
        let mut touched = Vec::new();
        let mut is_cut = vec![false; self.vertices.len()];
        cuts.keys().for_each(|&v| is_cut[v as usize] = true);
        for (t, triangle) in (0..).zip(&self.triangles) {
            let moved = triangle.iter().filter(|&&v| is_cut[v as usize]);
            moved.clone().for_each(|v| beside.entry(*v).or_default().push(t));
            touched.extend(moved.map(|_| t).next());
        }
        let farthest = |most: f64, (&v, cut): (&u32, &Vertex)| {
            most.max(self.vertices.positions[v as usize].distance(cut.position))
        };
        let margin = cuts.iter().fold(0.0, farthest);
        let cubes = Cubes::new(self.size);
        let mut near = Neighbours::find(&self.vertices.positions, &self.triangles, (&touched, margin), cubes);
        let all: Vec<u32> = cuts.keys().copied().collect();
        let mut waiting = vec![&all[..]];
        for _ in 0..RESTORINGS {
            let Some(part) = waiting.pop() else { break };
            let before: Vec<Vertex> = part.iter().map(|&v| self.vertices.get(v)).collect();
            part.iter().for_each(|v| self.vertices.set(*v, cuts[v]));
            let mut suspects: Vec<u32> =
                part.iter().filter_map(|v| beside.get(v)).flatten().copied().collect();
            suspects.sort_unstable();
            suspects.dedup();
            let (positions, triangles) = (&self.vertices.positions, &self.triangles);
            for &t in &suspects {
                near.add(t, &bounds_of(corners(positions, triangles[t as usize])));
            }
            if near.any_crosses(positions, triangles, &suspects) {
                part.iter().zip(before).for_each(|(&v, vertex)| self.vertices.set(v, vertex));
                if part.len() > 1 {
                    let (low, high) = part.split_at(part.len() / 2);
                    waiting.extend([high, low]);
                }
            }
        }
    }

    /// The triangles that may cross others, ascending: they have a doubtful corner, or at some corner do not
    /// face as the surface does.
    fn doubtful(&self) -> Vec<u32> {
        let Vertices { positions, normals, doubtful, .. } = &self.vertices;
        let is_doubtful = |t: &[u32; 3]| {
            let t = t.map(|v| v as usize);
            let [a, b, c] = t.map(|v| positions[v]);
            let facing = (b - a).cross(c - a);
            let least = AGREEING * facing.length();
            t.iter().any(|&v| doubtful[v] || facing.dot(normals[v]) < least)
        };
        let parts: Vec<Vec<u32>> = self
            .triangles
            .par_chunks(BATCH)
            .enumerate()
            .map(|(part, triangles)| {
                let numbered = ((part * BATCH) as u32..).zip(triangles);
                numbered.filter(|(_, t)| is_doubtful(t)).map(|(t, _)| t).collect()
            })
            .collect();
        parts.concat()
    }

    /// The number of pairs of triangles that cross, of which one is not surely clear of others.
    pub fn crossings(&self) -> usize {
        crossing_pairs(&self.vertices.positions, &self.triangles, &self.doubtful(), self.size).len()
    }

    /// The work done so far.
    pub fn work(&self) -> Work {
        self.work
    }

    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Whether edges were cut.
    pub fn is_cut(&self) -> bool {
        !self.cut_ends.is_empty()
    }

    /// Counts the work that was spent on the mesh in all.
    pub fn count(&mut self, work: Work) {
        self.work = work;
    }

    /// Mends the mesh around the given edges, merges vertices that are too close, and mends folded triangles. Returns
    /// whether that changed anything.
    ///
    /// # Errors
    /// [`MeshError::TooManyVertices`] if refining and mending made too many, and [`MeshError::Ended`].
    pub fn mend(&mut self, far: Vec<[u32; 2]>) -> Result<bool, MeshError> {
        let (share, least) = match self.care {
            Care::Sharp => (SHARP_MENDING, LEAST_SHARP_MENDING),
            Care::Apart => (MENDING, LEAST_MENDING),
        };
        let mut budget = ((share * self.work.evaluations as f64) as u64).max(least);
        let merged = self.work.merged;
        let mut changes = mend::is_worth(&far, &self.triangles);
        if changes {
            self.mend_around(far, Aim::Distance, &mut budget)?;
        }
        MeshError::check_vertices(self.vertices.len())?;
        self.merge_close();
        for _ in 0..REPAIRS {
            let (folded, evaluations) = mend::folded(self.field, &self.vertices, &self.triangles, self.size);
            self.work.gradients += evaluations;
            if !mend::is_worth(&folded, &self.triangles) || budget == 0 {
                break;
            }
            changes = true;
            self.mend_around(folded, Aim::Folds, &mut budget)?;
            self.merge(0.0);
        }
        Ok(changes || self.work.merged != merged)
    }

    /// # Errors
    /// [`MeshError::Ended`].
    fn mend_around(&mut self, edges: Vec<[u32; 2]>, aim: Aim, budget: &mut u64) -> Result<(), MeshError> {
        let place = (self.bounds, self.size, self.care);
        let patch = Patch::new(self.field, place, &mut self.vertices, &mut self.triangles, &edges);
        let count = mend::mend(patch, edges, refine::TOLERANCE * self.size, aim, (*budget, self.watch));
        self.work.gradients += count;
        *budget = budget.saturating_sub(count);
        ended(self.watch)
    }

    /// Merges vertices that coincide, and ends of short edges on creases; with care, unless triangles would cross.
    fn merge_close(&mut self) {
        if self.care == Care::Sharp {
            return self.merge(TOO_CLOSE * self.size);
        }
        let close: Vec<[u32; 2]> = self
            .mergeable(TOO_CLOSE * self.size)
            .into_iter()
            .filter_map(|group| <[u32; 2]>::try_from(group).ok())
            .filter(|ends| {
                let [a, b] = ends.map(|v| self.vertices.positions[v as usize]);
                a != b
            })
            .collect();
        if !close.is_empty() {
            let place = (self.bounds, self.size, self.care);
            let (vertices, triangles) = (&mut self.vertices, &mut self.triangles);
            let mut patch = Patch::new(self.field, place, vertices, triangles, &close);
            close.into_iter().for_each(|[kept, lost]| patch.join(kept, lost));
        }
        self.merge(0.0);
    }

    /// Merges vertices that coincide, and ends of edges on creases that are shorter than `too_close`.
    fn merge(&mut self, too_close: f64) {
        let groups = self.mergeable(too_close);
        let at_nodes = (0..)
            .zip(groups)
            .flat_map(|(node, group)| group.into_iter().map(move |vertex| AtNode { node, vertex }))
            .collect();
        let mut mesh = Mesh {
            positions: std::mem::take(&mut self.vertices.positions),
            normals: std::mem::take(&mut self.vertices.normals),
            triangles: std::mem::take(&mut self.triangles),
            ..Mesh::default()
        };
        let lost = collapse::merge_coincident(&mut mesh, at_nodes).unwrap_or_default();
        let mut is_lost = lost.iter();
        self.vertices.kinds.retain(|_| is_lost.next() != Some(&true));
        let mut is_lost = lost.iter();
        self.vertices.doubtful.retain(|_| is_lost.next() != Some(&true));
        (self.vertices.positions, self.vertices.normals, self.triangles) =
            (mesh.positions, mesh.normals, mesh.triangles);
        self.work.merged += mesh.work.merged;
    }

    /// Groups of vertices to merge; no vertex is in two of them.
    fn mergeable(&self, too_close: f64) -> Vec<Vec<u32>> {
        let Vertices { positions, kinds, .. } = &self.vertices;
        let sharp = (0_u32..).zip(kinds).filter(|(_, kind)| **kind != VertexKind::Smooth);
        let bits = |v: u32| positions[v as usize].to_array().map(f64::to_bits);
        let mut by_position: Vec<([u64; 3], u32)> = sharp.map(|(v, _)| (bits(v), v)).collect();
        by_position.sort_unstable();
        let mut is_taken = vec![false; positions.len()];
        let mut groups: Vec<Vec<u32>> = Vec::new();
        for group in by_position.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
            groups.push(group.iter().map(|&(_, v)| v).collect());
            group.iter().for_each(|&(_, v)| is_taken[v as usize] = true);
        }
        for t in &self.triangles {
            let is_sharp = t.map(|v| kinds[v as usize] == VertexKind::Sharp);
            for i in (0..3).filter(|&i| is_sharp[i] && is_sharp[(i + 1) % 3]) {
                let pair = [t[i], t[(i + 1) % 3]];
                let [a, b] = pair.map(|v| positions[v as usize]);
                let is_free = !pair.iter().any(|&v| is_taken[v as usize]);
                if is_free && a.distance(b) < too_close {
                    pair.iter().for_each(|&v| is_taken[v as usize] = true);
                    groups.push(pair.to_vec());
                }
            }
        }
        groups
    }

    /// The finished mesh, with normals for the vertices that have none yet.
    pub fn finish(self) -> Mesh {
        let Vertices { positions, normals, kinds, .. } = self.vertices;
        let caps = (0..).zip(&kinds).filter(|(_, kind)| **kind == VertexKind::Cap).map(|(i, _)| i).collect();
        let mut mesh = Mesh { positions, normals, triangles: self.triangles, caps, work: self.work };
        let is_unknown = |v: usize| kinds[v] != VertexKind::Smooth || mesh.normals[v] == DVec3::ZERO;
        let unknown: Vec<u32> = (0..kinds.len()).filter(|&v| is_unknown(v)).map(|v| v as u32).collect();
        normals::add(self.field, &mut mesh, &unknown);
        mesh
    }
}
