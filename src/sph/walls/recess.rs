//! What walls take of a kernel in sums over a fluid's lattice, where only integrals over the walls are known
//! and not their faces.
//!
//! For a body that is known by its volume, λ says how much of a kernel it takes, and T = ∮ W·y·n over its
//! surface, which is tr K − 3λ, says by how many faces. A plane at the distance δ has T = δ·A(δ). An edge of
//! a vessel with the same λ is farther away, along two normals, and has a larger T: T = Σ δ_i·A_i·(1 − λ_j)
//! for two planes at a right angle, and so on for the three of a corner. Therefore T decides where a body is
//! placed between one plane, two equal planes and three equal planes. (As planes, edges of a vessel that is
//! turned in its box would be 19 % of the rest density too dense where a fluid at rest touches both walls,
//! corners 36 %. Water stood 3 % too high in a vessel ten spacings wide, and a full vessel held 5 % less.
//! With two planes at unlike distances the barrier is off by 1 % of the rest density, 5 % where one is within
//! a tenth of the support radius.)

use super::layers::{OfFace, Wall};

/// Tolerance of T for a plane, as a fraction of the way from a plane to two planes. Bent faces differ by
/// less, and integrals in a map are known to some parts in a thousand.
const BENT: f64 = 0.05;

/// Smallest relative excess of T of two planes over that of one plane with the same λ. It is 2^(1/6) − 1
/// where λ vanishes.
const LEAST_MORE: f64 = 0.12;

/// The contribution of walls of which only integrals are known to sums over a lattice.
#[derive(Debug, Clone, Copy)]
pub(super) struct Recess {
    /// λ: the covered part of the kernel, by layers if the wall is in layers.
    pub part: f64,
    /// See [`OfFace::filled`].
    pub filled: f64,
    /// See [`OfFace::barrier`].
    pub barrier: f64,
    /// How many times faster than λ of a continuous wall `part` grows.
    pub of_part: f64,
    /// How many times faster than that the barrier grows, but for what changes in the parts before the other
    /// planes, which [`Barrier`](super::coverage::Barrier) leaves out wherever walls are joined.
    pub of_barrier: f64,
    /// The excess of tr (K − λ·1) of layers over that of a continuous wall, if it grows as `part` does.
    pub of_layers: f64,
}

impl Wall {
    /// The sums for walls that take the continuous part λ of a kernel and have this T.
    pub(super) fn recess(&self, part: f64, support: f64) -> Recess {
        let (plane, of_plane) = self.planes(1, part);
        if support <= of_plane * (1.0 + BENT * LEAST_MORE) {
            return plane;
        }
        let (edge, of_edge) = self.planes(2, part);
        if support < of_edge {
            let way = (support - of_plane) / (of_edge - of_plane);
            return plane.mixed(&edge, ((way - BENT) / (1.0 - BENT)).max(0.0));
        }
        let (corner, of_corner) = self.planes(3, part);
        let way = if of_corner > of_edge { (support - of_edge) / (of_corner - of_edge) } else { 0.0 };
        edge.mixed(&corner, way.min(1.0))
    }

    /// The sums for `number` equal planes at right angles that together take the part λ of a kernel, and
    /// their T.
    fn planes(&self, number: i32, part: f64) -> (Recess, f64) {
        // the part of the kernel before one of them, and before the others
        let before = match number {
            1 => 1.0 - part,
            2 => (1.0 - part).sqrt(),
            _ => (1.0 - part).powf(1.0 / f64::from(number)),
        };
        let others = before.powi(number - 1);
        let delta = self.distance_of(1.0 - before);
        let slope = self.kernel.slope(delta);
        let OfFace { part, area, spread, filled, barrier, barrier_area } = self.of_face(delta, 0.0);
        let others_in_layers = (1.0 - part).powi(number - 1);
        // deep in a wall nothing grows any further
        let in_layers = self.layer.is_some() && slope > 0.0 && others > 0.0;
        let faster = if in_layers { others_in_layers / (others * slope) } else { 0.0 };
        let of_part = if in_layers { faster * area } else { 1.0 };
        let whole = 1.0 - (1.0 - part).powi(number);
        let n = f64::from(number);
        let support = n * delta * slope * others;
        let recess = Recess {
            part: whole,
            filled: 1.0 - (1.0 - filled).powi(number),
            barrier: whole + n * others_in_layers * (barrier - part),
            of_part,
            of_barrier: faster * barrier_area,
            of_layers: n * others_in_layers * spread - of_part * support,
        };
        (recess, support)
    }
}

impl Recess {
    /// A mean of two, with the weight of the other one.
    fn mixed(&self, other: &Self, weight: f64) -> Self {
        let mix = |a: f64, b: f64| a + weight * (b - a);
        Self {
            part: mix(self.part, other.part),
            filled: mix(self.filled, other.filled),
            barrier: mix(self.barrier, other.barrier),
            of_part: mix(self.of_part, other.of_part),
            of_barrier: mix(self.of_barrier, other.of_barrier),
            of_layers: mix(self.of_layers, other.of_layers),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::kernel::WallKernel;
    use super::*;

    /// Planes at right angles by their distances: what they add together, and their λ and T.
    fn joined(wall: &Wall, distances: &[f64]) -> (Recess, [f64; 2]) {
        let faces: Vec<OfFace> = distances.iter().map(|delta| wall.of_face(*delta, 0.0)).collect();
        let before = |skip: usize, taken: &dyn Fn(usize) -> f64| -> f64 {
            (0..faces.len()).filter(|k| *k != skip).map(|k| 1.0 - taken(k)).product()
        };
        let continuous = |k: usize| wall.kernel.covered(distances[k]);
        let in_layers = |k: usize| faces[k].part;
        let part = 1.0 - before(usize::MAX, &in_layers);
        let above: f64 =
            (0..faces.len()).map(|k| before(k, &in_layers) * (faces[k].barrier - faces[k].part)).sum();
        let support = |k: usize| distances[k] * wall.kernel.slope(distances[k]) * before(k, &continuous);
        let recess = Recess {
            part,
            filled: 1.0 - before(usize::MAX, &|k| faces[k].filled),
            barrier: part + above,
            of_part: 0.0,
            of_barrier: 0.0,
            of_layers: 0.0,
        };
        (recess, [1.0 - before(usize::MAX, &continuous), (0..faces.len()).map(support).sum()])
    }

    #[test]
    fn planes_edges_and_corners_are_told_from_one_another() {
        let layer = 1.0 / 2.2;
        let wall = Wall::in_layers(WallKernel::WendlandC2, 1.0, layer);
        let at_rest = 0.5 * layer;
        let far = at_rest + layer;
        for (distances, tolerance) in [
            (&[at_rest][..], 1e-6),
            (&[0.1], 1e-6),
            (&[-0.2], 1e-6),
            (&[at_rest, at_rest], 1e-6),
            (&[at_rest, at_rest, at_rest], 1e-6),
            (&[0.1, 0.1], 1e-6),
            // the next particle along a wall, and those that have not come to rest
            (&[at_rest, far], 1e-3),
            (&[at_rest, at_rest, far], 0.02),
            (&[at_rest, 0.4], 0.01),
            (&[0.1, at_rest], 0.005),
        ] {
            let (known, [part, support]) = joined(&wall, distances);
            let found = wall.recess(part, support);
            for (what, found, known) in [
                ("λ", found.part, known.part),
                ("filled", found.filled, known.filled),
                ("B", found.barrier, known.barrier),
            ] {
                assert!((found - known).abs() < tolerance, "{what} at {distances:?}: {found} {known}");
            }
        }
        // without T, the edge where a fluid rests would be a fifth too dense
        let (known, [part, _]) = joined(&wall, &[at_rest, at_rest]);
        assert!(wall.recess(part, 0.0).barrier > known.barrier + 0.18);
    }
}
