//! The part of a kernel that is missing before a free surface.
//!
//! A sum over neighbours counts the empty half before a surface as free room: the outermost particles have
//! four fifths of the rest density, and may approach each other until they reach it. Surface tension pulls
//! just there. It would draw the outermost layers together until a drop is a seventh too small, its tension
//! nearly twice too strong, and its surface too ragged for normals, so that the drop never stops stirring
//! itself. Water at rest would sink by a twentieth in the same way. With the missing part added, a flat
//! surface of a lattice is as dense as its depth.
//!
//! The missing part follows from the normal n = Σ V ∇W + ∇λ. In the depth n is zero, and before a flat
//! surface both n and the missing part depend only on the distance from it. Between the layers of a lattice
//! the relation is taken as linear.

use crate::sph::kernel::{Surface, Wendland};

/// Normals in the depth reach this length, times h, by disorder alone.
const DISORDER: f64 = 0.1;

/// Half of the kernel is missing where a particle lies in a flat surface. More is never counted.
const MOST: f64 = 0.5;

/// Maximum number of layers that are considered.
const LAYERS: usize = 4;

/// The missing part of a kernel by the length of the normal.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FreeSurface {
    /// |n|·h and the missing part, from the depth to the surface. Points that repeat the first are unused.
    points: [[f64; 2]; LAYERS + 1],
}

impl FreeSurface {
    /// The relation for a lattice with `ratio` spacings per support radius.
    pub fn of_lattice(ratio: f64) -> Self {
        let mut points = [[DISORDER, 0.0]; LAYERS + 1];
        for layer in 0..LAYERS {
            let Surface { normal, missing } = Wendland::lattice_surface(ratio, layer as u32);
            if normal > DISORDER {
                points[LAYERS - layer] = [normal, missing];
            }
        }
        Self { points }
    }

    /// The part of the kernel that is missing where |n|·h is `normal`.
    pub fn missing(&self, normal: f64) -> f64 {
        let mut found = 0.0;
        for [from, to] in self.points.array_windows::<2>().copied() {
            // beyond the last point the last line continues
            if normal > from[0] && to[0] > from[0] {
                found = from[1] + (normal - from[0]) * (to[1] - from[1]) / (to[0] - from[0]);
            }
        }
        found.min(MOST)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// A sum over half of a lattice, with the missing part added, equals the sum over the whole lattice.
    #[test]
    fn a_flat_surface_is_as_dense_as_its_depth() {
        for ratio in [2.2, 3.0] {
            let (surface, kernel) = (FreeSurface::of_lattice(ratio), Wendland::new(ratio));
            for depth in 0..4 {
                let at = DVec3::new(0.0, 0.0, -0.5 - f64::from(depth));
                let (mut sum, mut normal) = (0.0, DVec3::ZERO);
                for k in 0..9 * 9 * 9 {
                    let [x, y, z] = [k % 9, k / 9 % 9, k / 81].map(f64::from);
                    let away = at - DVec3::new(x - 4.0, y - 4.0, -0.5 - z);
                    let nearness = (1.0 - away.length() / ratio).max(0.0);
                    sum += kernel.at(away.length_squared());
                    normal -= kernel.steepness * nearness.powi(3) * away;
                }
                let density = sum / Wendland::lattice_sum(ratio) + surface.missing(normal.length() * ratio);
                // below the second layer a missing part of up to 0.3 % counts as disorder
                assert!((density - 1.0).abs() < 3e-3, "{ratio}, layer {depth}: {density}");
            }
        }
    }

    #[test]
    fn layers_of_a_lattice_miss_what_lies_beyond_the_surface() {
        for ratio in [2.2, 3.0] {
            let surface = FreeSurface::of_lattice(ratio);
            for layer in 0..2 {
                let Surface { normal, missing } = Wendland::lattice_surface(ratio, layer);
                let found = surface.missing(normal);
                let expected = if normal > DISORDER { missing } else { 0.0 };
                assert!((found - expected).abs() < 1e-12, "{ratio}, {layer}: {found} for {expected}");
            }
            assert_eq!(surface.missing(0.05), 0.0);
            assert_eq!(surface.missing(7.0), MOST);
        }
    }
}
