//! The mesh between its first triangles and its end: refined, mended, merged, and given its last normals.

use glam::DVec3;

use super::super::{
    Grid, Mesh, MeshError, Work,
    collapse::{self, AtNode},
    normals,
};
use super::mend::{self, Aim};
use super::patch::Patch;
use super::refine;
use super::vertices::{VertexKind, Vertices};
use crate::field::Field;
use crate::geom::Aabb;

/// How often folded triangles are looked for and mended.
const REPAIRS: usize = 4;

/// Vertices on a crease that an edge shorter than this joins are merged, in cells. Two cells, or two cut
/// edges, may have put them at nearly the same point.
const TOO_CLOSE: f64 = 0.1;

/// A mesh that is still worked on.
pub(super) struct Draft<'a> {
    field: &'a dyn Field,
    /// The grid.
    bounds: &'a Aabb,
    /// The shortest side of a cell.
    size: f64,
    vertices: Vertices,
    triangles: Vec<[u32; 3]>,
    work: Work,
}

impl<'a> Draft<'a> {
    /// The mesh as it was first joined in a grid.
    pub fn new(
        field: &'a dyn Field,
        grid: &'a Grid,
        vertices: Vertices,
        triangles: Vec<[u32; 3]>,
        work: Work,
    ) -> Self {
        let (bounds, size) = (grid.bounds(), grid.spacing().min_element());
        Self { field, bounds, size, vertices, triangles, work }
    }

    /// Cuts edges until the mesh is near the surface. Returns the edges that are not near and could not be
    /// cut, ascending.
    pub fn refine(&mut self) -> Vec<[u32; 2]> {
        let (left, evaluations) =
            refine::refine(self.field, &mut self.vertices, &mut self.triangles, self.size);
        self.work.gradients += evaluations;
        left
    }

    /// Mends the mesh around the given edges, merges vertices that are too close, and mends folded triangles.
    ///
    /// # Errors
    /// [`MeshError::TooManyVertices`] if refining and mending made too many.
    pub fn mend(&mut self, far: Vec<[u32; 2]>) -> Result<(), MeshError> {
        if mend::is_worth(&far, &self.triangles) {
            self.mend_around(far, Aim::Distance);
        }
        MeshError::check_vertices(self.vertices.len())?;
        self.merge(TOO_CLOSE * self.size);
        for _ in 0..REPAIRS {
            let (folded, evaluations) = mend::folded(self.field, &self.vertices, &self.triangles, self.size);
            self.work.gradients += evaluations;
            if !mend::is_worth(&folded, &self.triangles) {
                break;
            }
            self.mend_around(folded, Aim::Folds);
            self.merge(0.0);
        }
        Ok(())
    }

    fn mend_around(&mut self, edges: Vec<[u32; 2]>, aim: Aim) {
        let place = (self.bounds, self.size);
        let patch = Patch::new(self.field, place, &mut self.vertices, &mut self.triangles, &edges);
        self.work.gradients += mend::mend(patch, edges, refine::TOLERANCE * self.size, aim);
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
        let Vertices { positions, normals, kinds } = self.vertices;
        let caps = (0..).zip(&kinds).filter(|(_, kind)| **kind == VertexKind::Cap).map(|(i, _)| i).collect();
        let mut mesh = Mesh { positions, normals, triangles: self.triangles, caps, work: self.work };
        let is_unknown = |v: usize| kinds[v] != VertexKind::Smooth || mesh.normals[v] == DVec3::ZERO;
        let unknown: Vec<u32> = (0..kinds.len()).filter(|&v| is_unknown(v)).map(|v| v as u32).collect();
        normals::add(self.field, &mut mesh, &unknown);
        mesh
    }
}
