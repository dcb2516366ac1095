//! What a kernel misses before a free surface.
//!
//! A sum over neighbours takes the empty half before a surface for room: the outermost particles have four fifths
//! of the density at rest, and may come nearer to each other until they have all of it. Surface tension pulls just
//! there: it drew the outermost layers together until a drop was a seventh too small, its tension nearly twice too
//! strong, and its surface too ragged for normals, so that it stirred itself without end. With what is missing
//! added, a flat surface of a lattice is as dense as its depth.
//!
//! The missing part is counted where tension moves single particles: where their spacing is below the capillary
//! length √(σ/ρg). Without tension it would calm still water too (a pool of eight layers starts with 16 mm/s instead
//! of 43), but columns of sixty layers on a lattice burst in their first steps: nothing in them is too dense then, and
//! their pressure comes too late.
//!
//! What is missing follows from the normal: n = Σ V ∇W + ∇λ is zero in the depth, and before a flat surface both n and
//! the missing part depend on the distance from it alone. Between the layers of a lattice the relation is
//! taken as linear.

use crate::sph::{
    kernel::{Surface, Wendland},
    params::Parameters,
};

/// Normals of this length times h, and shorter ones, are disorder in the depth.
const DISORDER: f64 = 0.1;

/// Half of the kernel is missing where a particle lies in a flat surface, and no more is ever counted.
const MOST: f64 = 0.5;

/// Layers that are looked at, at most.
const LAYERS: usize = 4;

/// The missing part of a kernel by the length of the normal.
#[derive(Debug, Clone, Copy)]
pub(super) struct FreeSurface {
    /// |n|·h and the missing part, from the depth to the surface. Points that repeat the first one are unused.
    points: [[f64; 2]; LAYERS + 1],
}

impl FreeSurface {
    /// That of a fluid, if its tension moves single particles.
    pub fn of(parameters: &Parameters) -> Option<Self> {
        let Parameters { surface_tension, rest_density, gravity, most_gravity, support_radius, .. } =
            *parameters;
        let spacing = parameters.spacing();
        // the tension's acceleration of a particle against that by gravity
        let gravity = gravity.length().max(most_gravity);
        let pulls = surface_tension > rest_density * gravity * spacing.powi(2);
        pulls.then(|| Self::of_lattice(support_radius / spacing))
    }

    /// That of a lattice with `ratio` spacings per support radius.
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
            // beyond the last point the last line goes on
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

    /// Sums over the half of a lattice, with what is missing added, are those over the whole.
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
    fn gravity_by_a_formula_counts_too() {
        let of = |surface_tension: f64, spacing: f64, gravity: f64, most_gravity: f64| {
            FreeSurface::of(&Parameters {
                rest_density: 1000.0,
                particle_mass: 1000.0 * spacing.powi(3),
                surface_tension,
                gravity: DVec3::new(0.0, 0.0, -gravity),
                most_gravity,
                ..Parameters::default()
            })
            .is_some()
        };
        // the capillary length of water is 2.7 mm
        assert!(of(0.072, 2e-3, 9.81, 0.0) && !of(0.072, 4e-3, 9.81, 0.0));
        assert!(of(0.072, 4e-3, 0.0, 0.0) && !of(0.072, 4e-3, 0.0, 9.81));
        assert!(!of(0.0, 2e-3, 0.0, 0.0));
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
