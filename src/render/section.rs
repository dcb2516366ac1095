//! Obstacles that are cut open to show the fluid behind them.
//!
//! A ray from the eye may have entered a closed mesh more often than it has left it before it meets the plane
//! of the cut. Then it is inside the mesh there, and shows the face that the cut has opened. So no triangle
//! is divided, and the face is as sharp as the picture.
//!
//! Invariant: neighbouring triangles share an edge without gap or overlap, so the count is exact for closed
//! meshes.

use super::{
    Cut, Rgb,
    camera::Camera,
    facet::Facet,
    raster::{Band, Corner},
    shade::{self, Material},
};

/// A cut as the camera sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeenCut {
    /// The nearness of the plane at (x, y) on the screen: a + b·x + c·y.
    nearness: [f64; 3],
    colour: Rgb,
}

impl SeenCut {
    /// `None` if the eye lies in the plane, which then hides nothing.
    pub fn new(cut: &Cut, material: Material, camera: &Camera) -> Option<Self> {
        let colour = shade::section(material, camera.turn(cut.normal).as_vec3().to_array());
        camera.nearness_of(cut).map(|nearness| Self { nearness, colour })
    }

    /// Draws the remaining part of a cut mesh, and the face that the cut opens.
    pub fn draw(&self, facets: &[&Facet], ink: impl Fn(&Facet, [f32; 3]) -> Rgb, band: &mut Band<'_>) {
        let mut left = vec![0.0_f32; band.nearness.len()];
        let mut colour = vec![[0; 3]; band.nearness.len()];
        // number of times that the ray has entered the part that is cut away, minus the number of times that
        // it has left it
        let mut inside = vec![0_i16; band.nearness.len()];
        let frame = band.frame();
        for facet in facets {
            let entry = if Corner::is_front(&facet.corners) { 1 } else { -1 };
            frame.fragments(&facet.corners, |at, near, weights| {
                if facet.is_beyond(weights) {
                    inside[at] += entry;
                } else if near > left[at] {
                    left[at] = near;
                    colour[at] = ink(facet, weights);
                }
            });
        }
        for row in band.top..band.bottom() {
            for column in band.left..band.left + band.width {
                let at = band.index(column, row);
                let (near, ink) = if inside[at] > 0 {
                    let [a, b, c] = self.nearness;
                    ((a + b * (column as f64 + 0.5) + c * (row as f64 + 0.5)) as f32, self.colour)
                } else {
                    (left[at], colour[at])
                };
                if near > band.nearness[at] {
                    band.nearness[at] = near;
                    band.colour[at] = ink;
                }
            }
        }
    }
}
