//! A triangle as it lies on the screen.

use super::{raster::Corner, shade};

/// A triangle on the screen.
#[derive(Debug)]
pub(super) struct Facet {
    pub corners: [Corner; 3],
    pub rows: (i64, i64),
    /// The numbers of the corners in the mesh.
    pub vertices: [u32; 3],
    /// The normals in the camera's frame, towards the side that is seen.
    pub normals: [[f32; 3]; 3],
    /// How far the corners lie beyond the cut, with the weight by which this is linear on the screen.
    pub beyond: [f32; 3],
}

impl Facet {
    /// The colour at the place with these weights of the corners; `None` if the corners have no colours.
    pub fn tint(&self, weights: [f32; 3], tints: &[[f32; 3]]) -> Option<[f32; 3]> {
        if tints.is_empty() {
            return None;
        }
        let corners = self.vertices.map(|vertex| tints[vertex as usize]);
        Some(std::array::from_fn(|i| (0..3).map(|k| weights[k] * corners[k][i]).sum()))
    }

    /// The unit normal at the place with these weights of the corners.
    pub fn normal(&self, [u, v, w]: [f32; 3]) -> [f32; 3] {
        let [a, b, c] = self.normals;
        let n: [f32; 3] = std::array::from_fn(|i| u * a[i] + v * b[i] + w * c[i]);
        let length = shade::dot(n, n).sqrt();
        n.map(|x| x / length)
    }

    /// Whether the place with these weights of the corners is cut away.
    pub fn is_beyond(&self, weights: [f32; 3]) -> bool {
        shade::dot(weights, self.beyond) > 0.0
    }
}
