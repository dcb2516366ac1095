//! Sums over neighbours: densities, the acceleration by pressure, its effect on densities, and viscosity.

use fearless_simd::{Simd, SimdFloat};
use glam::{DMat3, DVec3};

use crate::sph::{
    kernel::Wendland,
    methods::{roughness, shifting::depth},
    pairs::{PairPass, Real},
    params::Parameters,
    particles::Vectors,
    reaction::Reaction,
    walls::{Friction, Pushed},
};

use super::super::{free_surface::FreeSurface, viscosity::SpinSums};
use super::walls::{Walls, WallsNear};

/// Constants that the passes share.
#[derive(Clone, Copy)]
pub(super) struct Constants {
    pub kernel: Wendland,
    pub rest_density: f64,
    /// m·w over the sum on a lattice, so that an even fluid has its rest density, kg/m³.
    pub mass_weight: f64,
    /// m·c, kg/m⁵.
    pub mass_steepness: f64,
    /// Σ m²|∇W|² in a full neighbourhood: mρ₀·c²·4π∫(1 − q)⁶r⁴ dr, where ∫q⁴(1 − q)⁶ dq = 1/2310.
    pub full_factor: f64,
}

impl Constants {
    pub fn of(parameters: &Parameters) -> Self {
        let (h, m) = (parameters.support_radius, parameters.mass_in_sums());
        let kernel = Wendland::new(h);
        Self {
            kernel,
            rest_density: parameters.rest_density,
            mass_weight: m * kernel.weight / Wendland::lattice_sum(h / parameters.spacing()),
            mass_steepness: m * kernel.steepness,
            full_factor: parameters.rest_density
                * m
                * kernel.steepness.powi(2)
                * 4.0
                * std::f64::consts::PI
                * h.powi(5)
                / 2310.0,
        }
    }
}

/// Squares of distances below this part of h² do not count as a direction.
const LEAST_DISTANCE: f64 = 1e-6;

/// The treatment of walls in a linear system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Continuation {
    /// A pressure that is linear in space continues behind the wall, and a velocity is mirrored there, by λ
    /// and M. This is right for forces.
    Linear,
    /// Only what the barrier B adds to the density. This is right for places.
    Barrier,
}

/// Finds the density ρ with the barriers of the walls and the part missing before a free surface, the
/// diagonals of both systems, the direction in which particles crowd, G, and the density of the places alone.
#[derive(Clone, Copy)]
pub(super) struct Densities<'a> {
    pub constants: Constants,
    pub surface: &'a FreeSurface,
    pub walls: &'a Walls,
}

impl PairPass<0, 6, 8> for Densities<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        _: &[V; 0],
        _: [V; 0],
        sums: &mut [V; 6],
    ) {
        let of = V::Element::of;
        let s = self.constants.kernel.nearness(r2);
        let f = s * s * s;
        // 1 + 4q = 5 − 4s
        sums[0] = (f * s).mul_add(s.mul_add(of(-4.0), of(5.0)), sums[0]);
        for k in 0..3 {
            sums[1 + k] = f.mul_add(d[k], sums[1 + k]);
        }
        sums[4] = (f * f).mul_add(r2, sums[4]);
        sums[5] = f.mul_add(r2, sums[5]);
    }

    fn finish(&self, i: usize, sums: [f64; 6]) -> [f64; 8] {
        self.results(i, sums, DVec3::ZERO)
    }
}

impl Densities<'_> {
    /// The results of a particle from its sums, and from Σ d·(1 − q)³ of its own images.
    pub(super) fn results(
        &self,
        i: usize,
        [weight, x, y, z, squares, spread]: [f64; 6],
        own_images: DVec3,
    ) -> [f64; 8] {
        let Constants { mass_weight, mass_steepness, rest_density, .. } = self.constants;
        let [mut density, mut filled] = [mass_weight * weight; 2];
        let slope = -mass_steepness * DVec3::new(x, y, z);
        let squares = mass_steepness.powi(2) * squares;
        let mut crowding = slope / rest_density;
        let mut spread = mass_steepness / rest_density * spread / 3.0;
        // the images of a particle are pushed as it is
        let own = slope - mass_steepness * own_images;
        let mut factors = [own.length_squared() + squares; 2];
        if let Some((wall, completion)) = self.walls.in_place_of_fluid(i) {
            filled += rest_density * wall.filled;
            density += rest_density * wall.barrier.part;
            crowding += wall.gradient;
            spread += wall.share();
            // the neighbours' walls complete their sums about as much as the particle's walls do its own
            let others = squares * completion.determinant().max(1.0).cbrt().powi(2);
            let own = *completion * (slope + 2.0 * rest_density * wall.gradient);
            let barrier = slope + rest_density * wall.barrier.gradient;
            factors = [own.length_squared() + others, barrier.length_squared() + squares];
        }
        let missing = rest_density * self.surface.missing(crowding.length() * self.constants.kernel.h);
        density += match self.walls.near(i) {
            // a gap beside a wall is no surface
            Some(_) => missing.min((rest_density - filled).max(0.0)),
            None => missing,
        };
        let crowding = depth(spread) * crowding;
        let [linear, barrier] = factors;
        [density, linear, barrier, crowding.x, crowding.y, crowding.z, spread, filled]
    }
}

/// Finds the acceleration a(s) by pressure, or a displacement.
#[derive(Clone, Copy)]
pub(super) struct Push<'a> {
    pub constants: Constants,
    pub walls: &'a Walls,
    pub pressure: &'a [f64],
    pub continuation: Continuation,
}

impl PairPass<1, 3, 3> for Push<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 1],
        other: [V; 1],
        sums: &mut [V; 3],
    ) {
        let s = self.constants.kernel.nearness(r2);
        let push = (own[0] + other[0]) * s * s * s;
        for k in 0..3 {
            sums[k] = push.mul_add(d[k], sums[k]);
        }
    }

    fn finish(&self, i: usize, sums: [f64; 3]) -> [f64; 3] {
        let push = self.constants.mass_steepness * DVec3::from_array(sums);
        let Some((wall, completion)) = self.walls.in_place_of_fluid(i) else {
            return push.to_array();
        };
        let pressure = self.constants.rest_density * self.pressure[i];
        let push = match self.continuation {
            Continuation::Linear => *completion * (push - 2.0 * pressure * wall.gradient),
            Continuation::Barrier => push - pressure * wall.barrier.gradient,
        };
        push.to_array()
    }
}

/// Finds the pressure at each particle as that of the fluid around it. It is the mean of the neighbours'
/// pressures, continued linearly to the particle: Σ w·(p_j + ∇p·(x_i − x_j))/Σ w with the weights w =
/// 1 − r/h. The gradient is ∇p = −ρ₀a, from the acceleration that pressure gives the particle.
#[derive(Clone, Copy)]
pub(super) struct Field<'a> {
    pub kernel: Wendland,
    pub rest_density: f64,
    /// a, m/s².
    pub push: &'a Vectors,
}

impl PairPass<1, 5, 1> for Field<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        _: &[V; 1],
        other: [V; 1],
        sums: &mut [V; 5],
    ) {
        let weight = self.kernel.nearness(r2);
        sums[0] += weight;
        sums[1] = weight.mul_add(other[0], sums[1]);
        for k in 0..3 {
            sums[2 + k] = weight.mul_add(d[k], sums[2 + k]);
        }
    }

    fn finish(&self, i: usize, [weights, pressure, x, y, z]: [f64; 5]) -> [f64; 1] {
        let gradient = -self.rest_density * self.push.get(i);
        [((pressure + gradient.dot(DVec3::new(x, y, z))) / weights).max(0.0)]
    }
}

/// Finds the rate of density dρ/dt.
#[derive(Clone, Copy)]
pub(super) struct Squeeze<'a> {
    pub constants: Constants,
    pub walls: &'a Walls,
    /// Velocities or displacements; M·v where they continue linearly.
    pub velocity: &'a Vectors,
    pub continuation: Continuation,
    /// Whether the motion of walls counts. It does for velocities, but not for accelerations by pressure.
    pub with_walls: bool,
    /// If there are gaps: the part o of each particle's walls that is not there, and its velocity v. What it has in place
    /// of v is w + o·(v − w) then, where w is M·v.
    pub open: Option<(&'a [f64], &'a Vectors)>,
}

impl PairPass<3, 1, 1> for Squeeze<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 3],
        other: [V; 3],
        sums: &mut [V; 1],
    ) {
        let s = self.constants.kernel.nearness(r2);
        let departing = (own[0] - other[0]) * d[0];
        let departing = (own[1] - other[1]).mul_add(d[1], departing);
        let departing = (own[2] - other[2]).mul_add(d[2], departing);
        sums[0] = (s * s * s).mul_add(departing, sums[0]);
    }

    fn finish(&self, i: usize, [sum]: [f64; 1]) -> [f64; 1] {
        let rate = -self.constants.mass_steepness * sum;
        let of_walls = |(wall, _): (&WallsNear, &DMat3)| {
            let (gradient, sweep) = match self.continuation {
                Continuation::Linear => (2.0 * wall.gradient, 2.0 * wall.sweep),
                Continuation::Barrier => (wall.barrier.gradient, wall.barrier.sweep),
            };
            let completed = self.velocity.get(i);
            let sweep = if self.with_walls { sweep } else { 0.0 };
            match self.open {
                None => gradient.dot(completed) - sweep,
                // (1 − o)·(∇λ·w − sweep), in which 1 − o divides nothing
                Some((open, velocity)) => {
                    let own = velocity.get(i);
                    (1.0 - open[i]) * (gradient.dot(own) - sweep) + gradient.dot(completed - own)
                }
            }
        };
        [rate + self.constants.rest_density * self.walls.in_place_of_fluid(i).map_or(0.0, of_walls)]
    }
}

/// Finds the acceleration by viscosity and by gravity, and the smooth velocity around each particle.
/// Viscosity is laminar (Monaghan & Gingold 1983), artificial (Monaghan 1992, for rough motion alone) or
/// both. Both act along the lines between particles, unless the laminar one has been found with the spin.
#[derive(Clone, Copy)]
pub(super) struct Drag<'a, const LAMINAR: bool, const ARTIFICIAL: bool> {
    pub constants: Constants,
    pub walls: &'a Walls,
    pub velocity: &'a Vectors,
    /// Kinematic viscosity ν, m²/s.
    pub kinematic: f64,
    /// The factor α·h/2·c of the artificial viscosity, m²/s.
    pub artificial: f64,
    pub gravity: DVec3,
    /// Viscous forces that replace those along lines.
    pub spin: Option<SpinSums<'a>>,
    /// Receives the forces of walls, if they are wanted.
    pub reaction: Option<Reaction<'a>>,
}

impl<const LAMINAR: bool, const ARTIFICIAL: bool> PairPass<6, 10, 6> for Drag<'_, LAMINAR, ARTIFICIAL> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 6],
        other: [V; 6],
        sums: &mut [V; 10],
    ) {
        let s = self.constants.kernel.nearness(r2);
        let f = s * s * s;
        let approach = |k: usize| {
            let x = (other[k] - own[k]) * d[0];
            let x = (other[k + 1] - own[k + 1]).mul_add(d[1], x);
            (other[k + 2] - own[k + 2]).mul_add(d[2], x)
        };
        let arriving = approach(0);
        // a particle has no line to itself
        let r2 = r2 + V::Element::of(LEAST_DISTANCE * self.constants.kernel.h.powi(2));
        if LAMINAR && self.spin.is_none() {
            let push = f * arriving / r2;
            for k in 0..3 {
                sums[k] = push.mul_add(d[k], sums[k]);
            }
        }
        if ARTIFICIAL {
            // twelve bits suffice for an artificial viscosity
            let push = f * roughness::damped(approach(3), arriving) * r2.approximate_recip();
            for k in 0..3 {
                sums[3 + k] = push.mul_add(d[k], sums[3 + k]);
            }
            // 1 + 4q = 5 − 4s
            let weight = f * s * s.mul_add(V::Element::of(-4.0), V::Element::of(5.0));
            for k in 0..3 {
                sums[6 + k] = weight.mul_add(other[k], sums[6 + k]);
            }
            sums[9] += weight;
        }
    }

    fn finish(&self, i: usize, [x, y, z, dx, dy, dz, sx, sy, sz, weights]: [f64; 10]) -> [f64; 6] {
        let Constants { mass_steepness, rest_density, .. } = self.constants;
        let factor = mass_steepness / rest_density;
        let mut drag = match self.spin {
            Some(sums) => sums.drag(i, self.kinematic),
            None => 10.0 * self.kinematic * factor * DVec3::new(x, y, z),
        };
        if LAMINAR && let Some((wall, _)) = self.walls.near(i) {
            let velocity = self.velocity.get(i);
            let viscosity = self.kinematic;
            if let Some(reaction) = &self.reaction {
                let by_friction = wall.friction.by_walls(drag, velocity, viscosity);
                let pushed = Pushed { by_friction, velocity, viscosity, ..Pushed::default() };
                let turned = self.spin.map(|sums| sums.with_couple(i, &wall.friction, pushed));
                reaction.add(i, turned.unwrap_or(pushed));
            }
            drag = wall.friction.complete(drag, velocity, viscosity);
        }
        let a = drag + self.artificial * factor * DVec3::new(dx, dy, dz) + self.gravity;
        let smooth = if ARTIFICIAL { DVec3::new(sx, sy, sz) / weights } else { DVec3::ZERO };
        [a.x, a.y, a.z, smooth.x, smooth.y, smooth.z]
    }
}
