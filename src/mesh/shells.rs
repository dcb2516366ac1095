//! The connected parts of a mesh: outer surfaces of solids, and walls of cavities.
//!
//! Invariant: shells are listed in the order of their first vertices, and their triangles partition the mesh.

use super::Mesh;
use crate::geom::Aabb;

/// One connected part of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shell {
    /// The lowest of its vertices.
    pub first_vertex: u32,
    /// The number of vertices.
    pub vertices: usize,
    /// The number of triangles.
    pub triangles: usize,
    /// The signed volume in m³: positive for the outside of a solid, negative for the wall of a cavity.
    pub volume: f64,
    /// The area in m².
    pub area: f64,
    /// The box around it, m.
    pub bounds: Aabb,
}

impl Shell {
    /// A volume below this share of area^1.5 is rounding, and the shell is a folded sheet without inside. A
    /// ball has 0.09.
    const FLAT: f64 = 1e-12;

    /// Whether the shell is the outside of a solid.
    pub fn is_solid(&self) -> bool {
        self.volume > Self::FLAT * self.area.powf(1.5)
    }

    /// Whether the shell is the wall of a cavity.
    pub fn is_cavity(&self) -> bool {
        self.volume < -Self::FLAT * self.area.powf(1.5)
    }
}

/// The connected parts of a mesh, in the order of their first vertices. Vertices that no triangle uses belong
/// to no part.
pub fn shells(mesh: &Mesh) -> Vec<Shell> {
    let mut roots = Roots::new(mesh.positions.len());
    for &[a, b, c] in &mesh.triangles {
        roots.unite(a, b);
        roots.unite(a, c);
    }
    let mut place = vec![None; mesh.positions.len()];
    let mut found: Vec<Shell> = Vec::new();
    for &[a, b, c] in &mesh.triangles {
        let root = roots.find(a);
        let index = *place[root as usize].get_or_insert_with(|| {
            found.push(Shell {
                first_vertex: root,
                vertices: 0,
                triangles: 0,
                volume: 0.0,
                area: 0.0,
                bounds: Aabb::EMPTY,
            });
            found.len() - 1
        });
        let shell = &mut found[index];
        // volumes about a vertex of the shell itself, so that a small shell far from the origin keeps
        // its digits
        let origin = mesh.positions[root as usize];
        let [p, q, r] = [a, b, c].map(|v| mesh.positions[v as usize] - origin);
        shell.triangles += 1;
        shell.volume += p.dot(q.cross(r)) / 6.0;
        shell.area += 0.5 * (q - p).cross(r - p).length();
    }
    for v in 0..mesh.positions.len() as u32 {
        if let Some(index) = place[roots.find(v) as usize] {
            found[index].vertices += 1;
            found[index].bounds = found[index].bounds.including(mesh.positions[v as usize]);
        }
    }
    found.sort_by_key(|shell| shell.first_vertex);
    found
}

/// Disjoint sets. The representative of a set is its least member.
pub(super) struct Roots {
    parents: Vec<u32>,
}

impl Roots {
    pub(super) fn new(members: usize) -> Self {
        Self { parents: (0..members as u32).collect() }
    }

    pub(super) fn find(&mut self, mut member: u32) -> u32 {
        while self.parents[member as usize] != member {
            let above = self.parents[self.parents[member as usize] as usize];
            self.parents[member as usize] = above;
            member = above;
        }
        member
    }

    pub(super) fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }
}
