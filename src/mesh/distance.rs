//! The distance from a mesh, for pictures: a search for the true distance from a solid costs a thousand times as much.

use glam::DVec3;

use super::Mesh;
use crate::table::Table;
use crate::triangles::TriangleSolid;

/// The distance from the surface of a closed mesh.
#[derive(Debug)]
pub struct MeshDistance(TriangleSolid);

impl MeshDistance {
    /// Prepares a mesh.
    ///
    /// # Errors
    /// Why it is not the surface of a solid, in words.
    pub fn of(mesh: &Mesh) -> Result<Self, String> {
        let corners = |t: &[u32; 3]| t.map(|vertex| mesh.positions[vertex as usize]);
        let triangles: Vec<[DVec3; 3]> = mesh.triangles.iter().map(corners).collect();
        TriangleSolid::new(&triangles).map(Self).map_err(|error| error.to_string())
    }

    /// The distance of a point from the mesh, m, positive inside, and its gradient, of length 1.
    pub fn at(&self, p: DVec3) -> (f64, DVec3) {
        let sample = self.0.at(p);
        (sample.value, sample.gradient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_from_a_tetrahedron() {
        let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let distance = MeshDistance::of(&Mesh::from_triangles(corners.clone(), faces.clone())).unwrap();
        let (value, gradient) = distance.at(DVec3::new(0.2, 0.2, -0.5));
        assert!((value + 0.5).abs() < 1e-12 && gradient.distance(DVec3::Z) < 1e-12, "{value} {gradient}");
        assert!((distance.at(DVec3::new(0.2, 0.2, 0.05)).0 - 0.05).abs() < 1e-12);
        let open = Mesh::from_triangles(corners, faces[1..].to_vec());
        assert!(MeshDistance::of(&open).unwrap_err().contains("hole"));
    }
}
