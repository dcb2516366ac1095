//! Walls in layers, as a fluid has them: what a face takes of a kernel.
//!
//! A fluid is summed, not integrated: its particles lie in layers, a spacing apart, the first half a spacing
//! from the wall. At h = 2.2 spacings, integration takes 0.195 of the kernel of such a first layer, and the
//! mirrored layers of a lattice 0.158. With integrals the layer stands off the wall, and the pressure comes
//! out 4 % too high. A [`Wall`] in layers therefore takes the same integrals by the midpoint rule, one layer
//! of the wall after the other: λ = τ·Σ A(δ_k) with δ_k = δ + (k + ½)τ and so on, where τ is a spacing over
//! h. (In a lattice, too, only one layer of the wall reaches the second layer of the fluid.)
//!
//! [`super::coverage`] combines the results for the faces near a particle.

use super::kernel::WallKernel;

/// How a viscous fluid rubs on itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(in crate::sph) enum ViscousForces {
    /// Along the lines between particles.
    #[default]
    AlongLines,
    /// Against all relative motion but the turning of each neighbourhood: more exact, by two more sums over
    /// neighbours.
    WithSpin,
}

/// How walls enter the sums of a method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::sph) struct Wall {
    pub kernel: WallKernel,
    /// Support radius, m.
    pub h: f64,
    /// τ: the thickness of the wall's layers over h; `None` for a continuous wall.
    pub layer: Option<f64>,
    /// The spacing of the fluid over h, by which walls fill the kernels of particles, see [`OfFace::filled`].
    pub spacing: f64,
    /// λ at half a spacing from a wall in layers, where a fluid rests.
    pub at_rest: f64,
    /// The kernel's sum over a lattice behind a face, half a spacing before the face, divided by λ of layers:
    /// layers are planes and a lattice is points. With 2.2 spacings per support radius it is 0.975, with 3 it
    /// is 0.997, and at most 1 is counted.
    pub lattice_over_layers: f64,
    /// How the fluid rubs on itself, which its friction at the wall must match.
    pub viscous_forces: ViscousForces,
}

/// What one face takes of a kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::sph) struct OfFace {
    /// λ: the covered part of the kernel.
    pub part: f64,
    /// A: ∇λ is −A/h times the normal.
    pub area: f64,
    /// ∫ y·∂W/∂y along the normal, minus λ: δ·A for a plane.
    pub spread: f64,
    /// What a wall adds to the sum over a lattice of particles, of which the first layer is half a spacing away: λ by
    /// layers a spacing apart, as a lattice has it.
    pub filled: f64,
    /// B, what a wall in layers adds to the density of a fluid that must not be compressed. It is what a
    /// lattice adds, and nearer than half a spacing, where a fluid at rest touches the wall, λ counts twice:
    /// the wall mirrors the fluid. Over a width of two [`BEND`] it bends from the one to the other. (Without
    /// the mirror the fluid creeps into the walls, and a level of ten layers sinks by 3 %. With a kink
    /// instead of the bend water at rest never comes to rest. With λ of layers instead of a lattice's part
    /// the first layer is 0.9 % too dense, and a deep column that rises by that much bursts.)
    pub barrier: f64,
    /// −h·dB/dd.
    pub barrier_area: f64,
}

/// From this number of spacings per support radius on, integrals replace sums over lattices.
const LONGEST_SUM: f64 = 8.0;

/// Maximum number of steps in search of a distance.
const MOST_STEPS: usize = 30;

/// A step of that search, as a part of 1 − δ, whose square is rounding.
const NEWTON_STEP: f64 = 1e-8;

/// λ on a flat face.
const ON_FACE: f64 = 0.5;

/// Half the width, in λ, of the bend of a barrier, at most.
const BEND: f64 = 0.01;

impl Wall {
    /// A continuous wall, for a fluid with this spacing, m.
    pub fn new(kernel: WallKernel, h: f64, spacing: f64) -> Self {
        let spacing = spacing / h;
        let mut wall = Self {
            kernel,
            h,
            layer: None,
            spacing,
            at_rest: 0.0,
            lattice_over_layers: 1.0,
            viscous_forces: ViscousForces::default(),
        };
        // wide kernels know no difference between planes and points
        if spacing * LONGEST_SUM > 1.0 {
            let layers = wall.by_layers(0.5 * spacing);
            // kernels that hardly reach the first layer say nothing about planes
            let lattice = kernel.lattice_behind(1.0 / spacing) / layers;
            wall.lattice_over_layers = if layers > 0.0 { lattice.min(1.0) } else { 1.0 };
        }
        wall
    }

    /// A wall in layers that are a spacing, m, thick.
    pub fn in_layers(kernel: WallKernel, h: f64, spacing: f64) -> Self {
        let mut wall = Self { layer: Some(spacing / h), ..Self::new(kernel, h, spacing) };
        wall.at_rest = wall.by_layers(0.5 * wall.spacing);
        wall
    }

    /// −dλ/dδ of a plane that takes the part λ of a kernel.
    pub fn slope_at(&self, part: f64) -> f64 {
        self.kernel.slope(self.distance_of(part))
    }

    /// The distance δ = d/h of a plane that takes the part λ of a kernel. λ is between 0 and 1.
    pub fn distance_of(&self, part: f64) -> f64 {
        let small = part.min(1.0 - part);
        if small <= 0.0 {
            return if part > 0.5 { -1.0 } else { 1.0 };
        }
        let (mut low, mut high) = (0.0, 1.0);
        let mut delta = self.kernel.near_distance_of(small);
        for _ in 0..MOST_STEPS {
            let off = self.kernel.covered(delta) - small;
            let step = off / self.kernel.slope(delta);
            // Newton's error is the square of its step, which counts by what is left to the end of the support
            if step.abs() < NEWTON_STEP * (1.0 - delta) {
                delta += step;
                break;
            }
            if off > 0.0 {
                low = delta
            } else {
                high = delta
            }
            let next = delta + step;
            delta = if next > low && next < high { next } else { 0.5 * (low + high) };
        }
        if part > 0.5 { -delta } else { delta }
    }

    /// ∇λ of a face at the distance δ = d/h, as a multiple of that of a continuous wall.
    pub fn strength(&self, delta: f64) -> f64 {
        let slope = self.kernel.slope(delta);
        if self.layer.is_none() || slope <= 0.0 { 1.0 } else { self.of_face(delta, 0.0).area / slope }
    }

    /// The part of a face at the distance δ = d/h with the mean curvature H·h.
    #[inline]
    pub fn of_face(&self, delta: f64, curvature: f64) -> OfFace {
        if delta <= -1.0 {
            return OfFace {
                part: 1.0,
                area: 0.0,
                spread: 0.0,
                filled: 1.0,
                barrier: 1.0,
                barrier_area: 0.0,
            };
        }
        let whole = || self.continuous(delta, curvature);
        let Some(layer) = self.layer else {
            let whole = whole();
            let layers = if delta < 0.0 { whole.part } else { self.by_layers(delta) };
            return OfFace { filled: self.as_lattice(delta, layers), ..whole };
        };
        let layered = self.of_layers(layer, delta, curvature);
        if delta >= 0.0 {
            return self.with_barrier(layered);
        }
        // behind a face the sum over all layers is one up to half a hundredth, depending on where they lie:
        // the deeper the particle is, the more of the wall counts as continuous
        let whole = whole();
        let mix = |layered: f64, whole: f64| layered + delta * (layered - whole);
        let part = mix(layered.part, whole.part);
        let (area, spread) = (mix(layered.area, whole.area), mix(layered.spread, whole.spread));
        self.with_barrier(OfFace { part, area, spread, filled: self.as_lattice(delta, part), ..layered })
    }

    /// The part of a continuous face.
    #[inline]
    fn continuous(&self, delta: f64, curvature: f64) -> OfFace {
        let area = self.kernel.slope(delta) * (1.0 - curvature * delta);
        let part = self.kernel.covered_by_curved(delta, curvature).clamp(0.0, 1.0);
        OfFace { part, area, spread: delta * area, filled: part, barrier: 0.0, barrier_area: 0.0 }
    }

    /// What a lattice adds where layers take this part of a kernel. Deep behind the face it is all.
    #[inline]
    fn as_lattice(&self, delta: f64, layers: f64) -> f64 {
        (layers * (1.0 - (1.0 - self.lattice_over_layers) * (1.0 + delta.min(0.0)))).min(1.0)
    }

    /// λ of a plane by layers a spacing apart, before the face.
    #[inline]
    fn by_layers(&self, delta: f64) -> f64 {
        let mut slopes = 0.0;
        let mut at = delta + 0.5 * self.spacing;
        while at < 1.0 {
            slopes += self.kernel.slope(at);
            at += self.spacing;
        }
        self.spacing * slopes
    }

    /// The part of a face by the midpoint rule over the wall's layers, for δ > −1.
    #[inline]
    fn of_layers(&self, layer: f64, delta: f64, curvature: f64) -> OfFace {
        // Σ A, Σ −A′, Σ δA and Σ −δA′
        let [mut slopes, mut steeps, mut moments, mut spreads] = [0.0; 4];
        let mut at = delta + 0.5 * layer;
        while at < 1.0 {
            let (slope, steep) = self.kernel.slope_and_steepness(at);
            slopes += slope;
            steeps += steep;
            moments += at * slope;
            spreads += at * steep;
            at += layer;
        }
        // j = ∫ 2δA, and A belongs to λ − ½H·h·j
        let part = layer * (slopes - curvature * moments);
        let area = layer * (steeps + curvature * (slopes - spreads));
        let spread = layer * (spreads - slopes) * (1.0 - curvature * delta);
        let part = part.clamp(0.0, 1.0);
        OfFace { part, area, spread, filled: self.as_lattice(delta, part), barrier: 0.0, barrier_area: 0.0 }
    }

    /// The part of a face with its barrier.
    #[inline]
    fn with_barrier(&self, of_face: OfFace) -> OfFace {
        let beyond = of_face.part - self.at_rest;
        // on the face the bend has ended, however wide the kernel is
        let bend = BEND.min(0.25 * (ON_FACE - self.at_rest));
        // behind the face the wall is no longer a mirror: deep in it B is one, as λ is
        let (on_face, deep) = (ON_FACE - self.at_rest - bend, 1.0 - self.lattice_over_layers);
        let (more, slope) = match () {
            () if of_face.part > ON_FACE => {
                let slope = (deep - on_face) / (1.0 - ON_FACE);
                (on_face + slope * (of_face.part - ON_FACE), slope)
            }
            () if beyond < 0.0 => (0.0, 0.0),
            () if beyond < 2.0 * bend => (beyond.powi(2) / (4.0 * bend), beyond / (2.0 * bend)),
            () => (beyond - bend, 1.0),
        };
        OfFace {
            barrier: self.lattice_over_layers * of_face.part + more,
            barrier_area: (self.lattice_over_layers + slope) * of_face.area,
            ..of_face
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::kernel::tests::{integral, weight},
        *,
    };
    use crate::sph::kernel::Wendland;
    use std::f64::consts::PI;

    #[test]
    fn layers_are_planes_of_the_kernel() {
        let kernel = WallKernel::WendlandC2;
        let (layer, h) = (1.0 / 2.2, 1.0);
        let wall = Wall::in_layers(kernel, h, layer * h);
        for delta in [0.0, 0.1, 0.5 * layer, 0.4, 1.5 * layer, 0.95] {
            // each layer is a plane of the wall's thickness: its weight by discs
            let planes = (0..12).map(|k| delta + (f64::from(k) + 0.5) * layer);
            let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
                let disc = |z: f64| integral(0.0, 1.0, 400, |r| 2.0 * PI * r * of(z, (r * r + z * z).sqrt()));
                planes.clone().map(|z| layer * disc(z)).sum()
            };
            let OfFace { part, area, spread, .. } = wall.of_face(delta, 0.0);
            let covered = sum(&|_, q| weight(kernel, q));
            assert!((part - covered.clamp(0.0, 1.0)).abs() < 1e-8, "{delta}: {part} {covered}");
            // −∂W/∂z = 20·21/2π·z·(1 − q)³
            let steep = |z: f64, q: f64| 210.0 / PI * z * (1.0 - q).max(0.0).powi(3);
            let repelled = sum(&steep);
            assert!((area - repelled).abs() < 1e-6, "{delta}: {area} {repelled}");
            let moment = sum(&|z, q| z * steep(z, q));
            assert!((spread + covered - moment).abs() < 1e-6, "{delta}: {spread} {moment}");
        }
    }

    #[test]
    fn a_particle_deep_behind_a_face_is_wholly_covered() {
        let wall = Wall::in_layers(WallKernel::WendlandC2, 1.0, 1.0 / 2.2);
        for delta in [-1.0, -1.3, -5.0, -1e30, f64::NEG_INFINITY] {
            let OfFace { part, area, .. } = wall.of_face(delta, 0.0);
            assert_eq!((part, area), (1.0, 0.0), "{delta}");
        }
        let mut last = wall.of_face(-1.0, 0.0);
        for i in 1..=2000 {
            let delta = -1.0 + f64::from(i) * 1e-3;
            let next = wall.of_face(delta, 0.0);
            // the differences stay below the greatest slopes, so nothing jumps
            assert!((next.part - last.part).abs() < 2e-3, "{delta}: {last:?} {next:?}");
            assert!((next.area - last.area).abs() < 6e-3, "{delta}: {last:?} {next:?}");
            last = next;
        }
    }

    /// A lattice between walls half a spacing away is as dense at the walls as anywhere: the layers of the
    /// walls replace those that it would have behind them.
    #[test]
    fn a_lattice_is_even_up_to_a_layered_wall() {
        let kernel = WallKernel::WendlandC2;
        for ratio in [2.2, 2.6, 3.0] {
            let behind = |layer: i32| -> f64 {
                let places = (-4..=4).flat_map(|x| (-4..=4).map(move |y| f64::from(x * x + y * y)));
                let planes = places.flat_map(|xy| (1..=4).map(move |k| (xy, f64::from(k + layer).powi(2))));
                planes.map(|(xy, z)| weight(kernel, (xy + z).sqrt() / ratio)).sum::<f64>() / ratio.powi(3)
            };
            for (layer, tolerance) in [(0, 0.006), (1, 0.003)] {
                let delta = (f64::from(layer) + 0.5) / ratio;
                let of = |layer| Wall { layer, ..Wall::in_layers(kernel, 1.0, 0.4) }.of_face(delta, 0.0).part;
                let (layered, continuous, lattice) = (of(Some(1.0 / ratio)), of(None), behind(layer));
                assert!((layered - lattice).abs() < tolerance, "{ratio} {layer}: {layered} {lattice}");
                assert!((layered - lattice).abs() < 0.5 * (continuous - lattice).abs(), "{continuous}");
            }
        }
    }

    /// The sums over thin layers tend to the continuous wall, also for a curved one.
    #[test]
    fn many_layers_come_to_the_integral() {
        for kernel in WallKernel::ALL {
            for (delta, curvature) in [(-0.4, 0.0), (0.0, 0.3), (0.2, -0.3), (0.7, 0.4)] {
                let of =
                    |layer| Wall { layer, ..Wall::in_layers(kernel, 1.0, 0.4) }.of_face(delta, curvature);
                let (many, whole) = (of(Some(1e-3)), of(None));
                // the midpoint rule's error, a 24th of τ² times a slope
                assert!((many.part - whole.part).abs() < 1e-5, "{kernel:?} {delta}: {many:?} {whole:?}");
                assert!((many.area - whole.area).abs() < 1e-5, "{kernel:?} {delta}: {many:?} {whole:?}");
                let spread = (many.spread - delta * whole.area).abs();
                assert!(spread < 1e-5, "{kernel:?} {delta}: {many:?} {whole:?}");
            }
        }
    }

    #[test]
    fn a_barrier_is_continuous_and_has_its_own_slope() {
        let step = 1e-6;
        for ratio in [1.05, 1.2, 1.5, 2.2, 3.0, 7.0, 20.0, 100.0] {
            let wall = Wall::in_layers(WallKernel::WendlandC2, 1.0, 1.0 / ratio);
            for k in 1..=99 {
                let delta = 0.01 * f64::from(k);
                let [before, now, after] = [-step, 0.0, step].map(|d| wall.of_face(delta + d, 0.0));
                let slope = (before.barrier - after.barrier) / (2.0 * step);
                // the slope itself changes by up to 60/h within the step, where a narrow bend begins
                assert!(
                    (slope - now.barrier_area).abs() < 1e-4,
                    "{ratio}, {delta}: {slope} {}",
                    now.barrier_area
                );
                // a fluid that B keeps is not denser than what its places say
                assert!(now.barrier >= now.filled, "{ratio}, {delta}: {now:?}");
            }
            for k in 1..=100 {
                let deep = wall.of_face(-0.01 * f64::from(k), 0.0);
                assert!(
                    deep.barrier <= 1.0 + 1e-12 && deep.barrier >= deep.part - 1e-12,
                    "{ratio}, {k}: {deep:?}"
                );
                assert!(
                    deep.filled <= 1.0 && deep.filled >= wall.lattice_over_layers * deep.part - 1e-12,
                    "{ratio}, {k}: {deep:?}"
                );
                // the sum over layers is one up to half a hundredth, so its slope is not quite monotone
                assert!(ratio < 2.0 || deep.barrier_area >= -0.01, "{ratio}, {k}: {deep:?}");
            }
            let [before, behind] = [step, -step].map(|delta| wall.of_face(delta, 0.0).barrier);
            assert!(before <= behind && behind - before < 1e-4, "{ratio}: {before} {behind}");
        }
        // a kernel that reaches no layer has no wall before the face
        let narrow = Wall::in_layers(WallKernel::WendlandC2, 1.0, 1.1).of_face(0.6, 0.0);
        assert_eq!((narrow.barrier, narrow.filled), (0.0, 0.0));
        // a lattice at rest is as dense before a wall as in its depth
        for ratio in [2.0, 2.2, 3.0] {
            let wall = Wall::in_layers(WallKernel::WendlandC2, 1.0, 1.0 / ratio);
            let at_rest = wall.of_face(0.5 / ratio, 0.0);
            let lattice = Wendland::lattice_surface(ratio, 0).missing;
            assert!((at_rest.barrier - lattice).abs() < 1e-12, "{ratio}: {at_rest:?} {lattice}");
            assert!((at_rest.filled - lattice).abs() < 1e-12, "{ratio}: {at_rest:?} {lattice}");
            // on the wall a mirrored layer is added
            let on_wall = wall.of_face(0.0, 0.0);
            let mirrored = on_wall.part - at_rest.part - BEND;
            assert!((on_wall.barrier - on_wall.filled - mirrored).abs() < 1e-12, "{ratio}: {on_wall:?}");
        }
        assert_eq!(Wall::new(WallKernel::WendlandC2, 1.0, 0.4).of_face(0.1, 0.0).barrier, 0.0);
    }
}
