//! Edges at which more than two triangles meet as soon as vertices at one place are one.
//!
//! A mesh parts such an edge by several vertices at its ends, so that it is manifold. Formats without numbers of vertices, as
//! STL, cannot hold that, and programs that read them join what is at one place.

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::Mesh;

/// Edges of more than two triangles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Branches {
    /// How many there are.
    pub count: usize,
    /// The middle of one, m.
    pub at: DVec3,
}

/// The edges of a mesh at which more than two triangles meet once vertices at one place are joined; `None` if there are none.
pub fn branches(mesh: &Mesh) -> Option<Branches> {
    let mut known: FxHashMap<[u64; 3], u32> = FxHashMap::default();
    // −0 is the same place as 0
    let bits = |p: &DVec3| (*p + 0.0).to_array().map(f64::to_bits);
    let joined: Vec<u32> =
        (0..).zip(&mesh.positions).map(|(v, p)| *known.entry(bits(p)).or_insert(v)).collect();
    if known.len() == mesh.positions.len() {
        return None;
    }
    let mut edges: Vec<(u32, u32)> = Vec::with_capacity(3 * mesh.triangles.len());
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|v| joined[v as usize]);
        // one that has become a line has no edges of its own
        if a != b && b != c && c != a {
            edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to))));
        }
    }
    edges.sort_unstable();
    let crowded = || edges.chunk_by(|a, b| a == b).filter(|same| same.len() > 2);
    let (a, b) = crowded().next()?[0];
    let at = 0.5 * (mesh.positions[a as usize] + mesh.positions[b as usize]);
    Some(Branches { count: crowded().count(), at })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron with an edge from [0, 0, 0] to [0, 0, 1], on one side of it.
    fn tetrahedron(side: f64) -> Mesh {
        let positions = vec![DVec3::ZERO, DVec3::Z, DVec3::new(side, 1.0, 0.5), DVec3::new(side, -1.0, 0.5)];
        Mesh { positions, triangles: vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], ..Mesh::default() }
    }

    #[test]
    fn solids_that_share_an_edge_branch_there() {
        let [left, right] = [-1.0, 1.0].map(tetrahedron);
        assert_eq!(branches(&left), None);
        let both = Mesh::joined(&[left.clone(), right]);
        let found = branches(&both).unwrap();
        assert_eq!((found.count, found.at), (1, DVec3::new(0.0, 0.0, 0.5)));
        // those that touch at a corner do not
        let mut above = left.clone();
        above.positions.iter_mut().for_each(|p| *p += DVec3::Z);
        assert_eq!(branches(&Mesh::joined(&[left, above])), None);
    }
}
