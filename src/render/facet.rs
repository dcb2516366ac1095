//! A triangle as it lies on the screen.

use super::{
    Rgb,
    raster::Corner,
    shade::{self, Material, Veil},
};

/// A triangle on the screen.
#[derive(Debug)]
pub(super) struct Facet {
    pub corners: [Corner; 3],
    pub rows: (i64, i64),
    /// The normals in the camera's frame, towards the side that is seen.
    pub normals: [[f32; 3]; 3],
    /// How far the corners lie beyond the cut, times their nearness: this changes evenly over the screen.
    pub beyond: [f32; 3],
}

impl Facet {
    /// The colour at the place that has these weights of the corners.
    pub fn colour(&self, weights: [f32; 3], material: Material) -> Rgb {
        shade::solid(material, self.normal(weights))
    }

    /// The colour and the opacity at the place that has these weights of the corners.
    pub fn veil(&self, weights: [f32; 3], material: Material) -> Veil {
        shade::veil(material, self.normal(weights))
    }

    fn normal(&self, [u, v, w]: [f32; 3]) -> [f32; 3] {
        let [a, b, c] = self.normals;
        let n: [f32; 3] = std::array::from_fn(|i| u * a[i] + v * b[i] + w * c[i]);
        let length = shade::dot(n, n).sqrt();
        n.map(|x| x / length)
    }

    /// Whether the place that has these weights of the corners is cut away.
    pub fn is_beyond(&self, weights: [f32; 3]) -> bool {
        shade::dot(weights, self.beyond) > 0.0
    }
}
