//! Merges vertices that coincide in a node of the grid, so that no triangle has zero area where that can
//! be avoided.
//!
//! Where ω = 0 in a node, all roots on the edges around it fall onto the node. Where a solid leaves the grid
//! across an edge of its box, two or three cap vertices fall onto a node. Sheets that only touch in the node
//! stay apart.
//!
//! Invariant: each step contracts one edge of zero length under the link condition (its ends have exactly two
//! common neighbours), which keeps the mesh closed, manifold and of the same topology. Or it removes a whole
//! component that has shrunk into the node.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::Mesh;

/// A vertex that lies exactly on a node of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct AtNode {
    /// The number of the node, see `Lattice::key`.
    pub node: u64,
    pub vertex: u32,
}

/// Contracts the edges of zero length among the listed vertices and drops what vanishes. Returns which
/// vertices of the mesh were lost; `None` if none could be.
pub(super) fn merge_coincident(mesh: &mut Mesh, mut at_nodes: Vec<AtNode>) -> Option<Vec<bool>> {
    at_nodes.par_sort_unstable();
    let groups: Vec<&[AtNode]> =
        at_nodes.chunk_by(|a, b| a.node == b.node).filter(|group| group.len() > 1).collect();
    if groups.is_empty() {
        return None;
    }
    let mut fans = Fans::new(mesh, groups.iter().copied().flatten().map(|at| at.vertex));
    for group in groups {
        let mut vertices: Vec<u32> = group.iter().map(|at| at.vertex).collect();
        while let Some((kept, lost)) = fans.contractible(&vertices) {
            fans.contract(kept, lost);
            vertices.retain(|&v| v != lost);
        }
        fans.drop_specks(&vertices);
    }
    let Fans { is_lost, is_dead, .. } = fans;
    compact(mesh, &is_lost, &is_dead);
    Some(is_lost)
}

/// The triangles around each vertex that may be merged.
pub(super) struct Fans<'a> {
    pub mesh: &'a mut Mesh,
    fans: BTreeMap<u32, Vec<u32>>,
    /// Whether a triangle is gone.
    pub is_dead: Vec<bool>,
    /// Whether a vertex is gone.
    pub is_lost: Vec<bool>,
}

impl<'a> Fans<'a> {
    pub(super) fn new(mesh: &'a mut Mesh, vertices: impl Iterator<Item = u32>) -> Self {
        let mut is_wanted = vec![false; mesh.positions.len()];
        vertices.for_each(|v| is_wanted[v as usize] = true);
        let mut fans: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            for &v in triangle.iter().filter(|&&v| is_wanted[v as usize]) {
                fans.entry(v).or_default().push(index as u32);
            }
        }
        let (is_dead, is_lost) = (vec![false; mesh.triangles.len()], vec![false; mesh.positions.len()]);
        Self { mesh, fans, is_dead, is_lost }
    }

    /// The triangles around a vertex that are not gone.
    pub(super) fn fan(&self, v: u32) -> impl Iterator<Item = u32> {
        let listed = self.fans.get(&v).map_or(&[][..], Vec::as_slice);
        listed.iter().copied().filter(|&t| !self.is_dead[t as usize])
    }

    /// The vertices joined to `v` by an edge, ascending.
    pub(super) fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut found: Vec<u32> =
            self.fan(v).flat_map(|t| self.mesh.triangles[t as usize]).filter(|&u| u != v).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// A pair (kept, lost) of the vertices whose edge may be contracted. `None` if there is none. If one
    /// vertex is on ω = 0 and the other on a cap, the first is kept.
    fn contractible(&self, vertices: &[u32]) -> Option<(u32, u32)> {
        for (i, &a) in vertices.iter().enumerate() {
            let around = self.neighbours(a);
            for &b in &vertices[i + 1..] {
                if around.binary_search(&b).is_ok() && self.meets_link_condition(b, &around) {
                    let is_cap = |v| self.mesh.caps.binary_search(&v).is_ok();
                    return Some(if is_cap(a) && !is_cap(b) { (b, a) } else { (a, b) });
                }
            }
        }
        None
    }

    /// Whether contracting the edge keeps the topology: its ends have two common neighbours, and the mesh
    /// there is not a tetrahedron.
    pub(super) fn meets_link_condition(&self, b: u32, around_a: &[u32]) -> bool {
        let around_b = self.neighbours(b);
        let common = around_b.iter().filter(|v| around_a.binary_search(v).is_ok()).count();
        common == 2 && (around_a.len() > 3 || around_b.len() > 3)
    }

    pub(super) fn contract(&mut self, kept: u32, lost: u32) {
        let fan: Vec<u32> = self.fan(lost).collect();
        for &t in &fan {
            let triangle = &mut self.mesh.triangles[t as usize];
            if triangle.contains(&kept) {
                self.is_dead[t as usize] = true;
            } else {
                *triangle = triangle.map(|v| if v == lost { kept } else { v });
                self.fans.entry(kept).or_default().push(t);
            }
        }
        self.is_lost[lost as usize] = true;
        self.mesh.work.merged += 1;
    }

    /// Drops the components that lie wholly in the node.
    fn drop_specks(&mut self, vertices: &[u32]) {
        for &start in vertices {
            let mut speck = vec![start];
            let mut next = 0;
            while let Some(&v) = speck.get(next) {
                for u in self.neighbours(v) {
                    if !speck.contains(&u) {
                        speck.push(u);
                    }
                }
                next += 1;
                if !vertices.contains(&v) {
                    break;
                }
            }
            if next == speck.len() && speck.iter().all(|v| vertices.contains(v) && !self.is_lost[*v as usize])
            {
                for &v in &speck {
                    let fan: Vec<u32> = self.fan(v).collect();
                    fan.into_iter().for_each(|t| self.is_dead[t as usize] = true);
                    self.is_lost[v as usize] = true;
                    self.mesh.work.merged += 1;
                }
            }
        }
    }
}

/// Removes lost vertices and dead triangles and renumbers the rest in order.
pub(super) fn compact(mesh: &mut Mesh, is_lost: &[bool], is_dead: &[bool]) {
    let mut number = 0;
    let numbers: Vec<u32> = is_lost
        .iter()
        .map(|lost| {
            number += u32::from(!lost);
            number - u32::from(!lost)
        })
        .collect();
    let mut dead = is_dead.iter();
    mesh.triangles.retain(|_| dead.next() == Some(&false));
    mesh.triangles.iter_mut().for_each(|t| *t = t.map(|v| numbers[v as usize]));
    let mut lost = is_lost.iter();
    mesh.positions.retain(|_| lost.next() == Some(&false));
    let mut lost = is_lost.iter();
    mesh.normals.retain(|_| lost.next() == Some(&false));
    mesh.caps.retain(|&v| !is_lost[v as usize]);
    mesh.caps.iter_mut().for_each(|v| *v = numbers[*v as usize]);
}
