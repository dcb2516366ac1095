//! The sum over neighbours, and the rates of each particle that follow from it.

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;

use super::super::{
    crowding::Crowding,
    free_surface::FreeSurface,
    near_walls::NearWalls,
    negative_pressure::NegativePressure,
    roughness,
    shifting::{depth, falling_rate, return_rate},
    viscosity::SpinSums,
};
use super::Gradients;
use super::at_edges::{Edge, Edges};
use super::linear::{Held, Linear};
use super::numbers::{Numbers, at_rest};
use crate::sph::{
    core::Core,
    kernel::Wendland,
    pairs::{PairPass, Real},
    params::Parameters,
    particles::Vectors,
    reaction::Reaction,
    walls::{Coverage, Friction, Pushed, Symmetric, WallDrag},
};

/// Squares of distances below this part of h² do not count as a direction.
const LEAST_DISTANCE: f64 = 1e-6;

/// Between these values of Σ V W, with the part of a wall, a particle at the wall begins to take part in the
/// balance of the fluid. Spray has less, and a surface at rest more.
const HELD: [f64; 2] = [0.7, 0.8];

/// The density may exceed the sum over particles by this part of the rest density without being lowered.
/// Particles that have come to rest in disorder, and the layers of walls beside them, make an error of this
/// size. With 0 still water eight layers deep sinks by a hundredth, and its pressure is off by twice as much.
/// With 0.03 water that has splashed stands 2 % too high.
const LOOSE: f64 = 0.02;

/// Number of sums of [`Pairs`].
const SUMS: usize = 16;

/// Number of sums of [`Shifted`], which those of Σ f·d⊗d follow.
const SHIFTED_SUMS: usize = SUMS + 3;

/// Number of sums of [`Differences`]: those, and two symmetric tensors whose traces they contain.
const DIFFERENCES_SUMS: usize = SHIFTED_SUMS + 10;

/// Components of a symmetric tensor besides zz, which follows from the trace.
const COMPONENTS: [(usize, usize); 5] = [(0, 0), (1, 1), (1, 2), (2, 0), (0, 1)];

/// How far a particle at a wall takes part in the balance of the fluid, 0 to 1, from its Σ V W.
fn held(filled: f64) -> f64 {
    let [spray, surface] = HELD;
    ((filled - spray) / (surface - spray)).clamp(0.0, 1.0)
}

/// The data of the pass over pairs besides the columns that it sums.
#[derive(Clone, Copy)]
pub(super) struct Rates<'a> {
    numbers: &'a Numbers,
    parameters: &'a Parameters,
    core: &'a Core,
    velocity: &'a Vectors,
    pressure: &'a [f64],
    /// ρ − ρ₀, kg/m³, less the excess in a fluid at rest where the sums do not include crowding.
    excess: &'a [f64],
    kernel: Wendland,
    /// The factor V·c of V∇W = −V·c·(1 − q)³·r.
    steepness: f64,
    /// The factor 2δ·h/2·c·ρ₀ of the diffusion, over ρ₀.
    diffusion: f64,
    /// Kinematic viscosity ν = μ/ρ₀, m²/s.
    pub laminar: f64,
    /// The factor α·h/2·c·ρ₀ of the artificial viscosity.
    pub artificial: f64,
    /// Densities before the step, kg/m³.
    density: &'a [f64],
    /// Whether pressures act by their differences in the fluid's depth.
    differences: bool,
    /// Rate at which densities return to those of the places, 1/s.
    return_rate: f64,
    /// Rate at which they return where there is room, 1/s.
    closing_rate: f64,
    /// The density that kernels miss before a free surface, as a part of the rest density; zero where it is
    /// not computed.
    missing: &'a [f64],
    /// Σ V W on a lattice.
    lattice: f64,
    /// The mean density by places to which densities return, over the rest density.
    pub mean_filled: f64,
    /// Viscous forces that replace those along lines, with the walls near particles.
    pub spin: Option<(SpinSums<'a>, &'a NearWalls<Coverage<WallDrag>>)>,
    /// The edges on walls of a fluid under tension.
    pub edges: Option<Edges<'a>>,
    /// Receives the forces of walls, if they are wanted.
    reaction: Option<Reaction<'a>>,
}

impl<'a> Rates<'a> {
    pub fn new(
        core: &'a Core,
        numbers: &'a Numbers,
        velocity: &'a Vectors,
        pressure: &'a [f64],
        excess: &'a [f64],
        missing: &'a [f64],
        dt: f64,
    ) -> Self {
        let parameters = &core.parameters;
        let kernel = Wendland::new(parameters.support_radius);
        let smoothing = 0.5 * parameters.support_radius;
        Self {
            numbers,
            parameters,
            core,
            velocity,
            pressure,
            excess,
            kernel,
            steepness: parameters.volume_in_sums() * kernel.steepness,
            diffusion: 2.0 * numbers.density_diffusion * smoothing * numbers.sound_speed,
            laminar: parameters.viscosity / parameters.rest_density,
            artificial: parameters.rest_density
                * roughness::factor(
                    numbers.artificial_viscosity,
                    numbers.sound_speed,
                    parameters.support_radius,
                    dt,
                ),
            density: &core.particles.density,
            differences: numbers.gradients == Gradients::Differences,
            return_rate: return_rate(core),
            closing_rate: return_rate(core).max(falling_rate(core)),
            missing,
            lattice: Wendland::lattice_sum(parameters.support_radius / parameters.spacing()),
            mean_filled: 1.0,
            spin: None,
            edges: None,
            reaction: Reaction::of(core, dt),
        }
    }
}

/// The pass over pairs, with or without laminar viscosity, artificial viscosity and crowding. With f =
/// (1 − q)³ and d from the neighbour it sums f·(p_j − p_i + Π)·d, f·(v_i − v_j)·d, f·(ρ_j − ρ_i), f·d, f·d²,
/// W, f·((v_j − v_i)·d)·d/d² (unless viscous forces come with the spin) and W·v_j, where the artificial
/// viscosity Π is that of rough velocities. Without crowding it sums p_j + p_i instead of p_j − p_i, and omits f·d and f·d².
#[derive(Clone, Copy)]
pub(super) struct Pairs<'a, const LAMINAR: bool, const ARTIFICIAL: bool, const EVEN: bool>(pub Rates<'a>);

impl<const LAMINAR: bool, const ARTIFICIAL: bool, const EVEN: bool> Pairs<'_, LAMINAR, ARTIFICIAL, EVEN> {
    /// The artificial viscosity is a pressure between particles that approach, and a tension between those
    /// that part. With the pressure alone, noise at rest would hold up a part of the fluid's weight (3 % of
    /// it with α = 0.1).
    #[inline(always)]
    fn sum<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: &[V; 8],
        sums: &mut [V; SUMS],
    ) {
        let of = V::Element::of;
        let rates = &self.0;
        let s = rates.kernel.nearness(r2);
        let f = s * s * s;
        // how fast they part, by the three velocity columns from `k`
        let parting = |k: usize| {
            let x = (own[k] - other[k]) * d[0];
            let x = (own[k + 1] - other[k + 1]).mul_add(d[1], x);
            (own[k + 2] - other[k + 2]).mul_add(d[2], x)
        };
        let departing = parting(0);
        let mut push = if EVEN { other[3] - own[3] } else { other[3] + own[3] };
        if ARTIFICIAL {
            let least = of(0.01 * (0.5 * rates.kernel.h).powi(2));
            let rough = roughness::damped(parting(5), departing);
            // the twelve bits of an estimate in single precision suffice for an artificial viscosity
            push -= rough * of(rates.artificial) * (r2 + least).approximate_recip();
        }
        let push = push * f;
        for k in 0..3 {
            sums[k] = push.mul_add(d[k], sums[k]);
        }
        sums[3] = f.mul_add(departing, sums[3]);
        sums[4] = f.mul_add(other[4] - own[4], sums[4]);
        if EVEN {
            for k in 0..3 {
                sums[5 + k] = f.mul_add(d[k], sums[5 + k]);
            }
            sums[8] = f.mul_add(r2, sums[8]);
        }
        // 1 + 4q = 5 − 4s
        let weight = f * s * s.mul_add(of(-4.0), of(5.0));
        sums[9] += weight;
        if ARTIFICIAL {
            for k in 0..3 {
                sums[13 + k] = weight.mul_add(other[k], sums[13 + k]);
            }
        }
        if LAMINAR && rates.spin.is_none() {
            // a particle has no line to itself
            let least = of(LEAST_DISTANCE * rates.kernel.h.powi(2));
            let rubbing = f * departing / (r2 + least);
            for k in 0..3 {
                sums[10 + k] = d[k].mul_add(-rubbing, sums[10 + k]);
            }
        }
    }

    /// The results of a particle from its sums. `denser_along` is Σ f·(ρ_j − ρ₀)·d, and `linear` has the tensors
    /// of differences of pressure.
    fn finished(
        &self,
        i: usize,
        sums: [f64; SUMS],
        denser_along: DVec3,
        linear: Option<Linear>,
    ) -> [f64; 14] {
        let [px, py, pz, departing, denser, cx, cy, cz, squares, weights, ux, uy, uz, sx, sy, sz] = sums;
        let rates = &self.0;
        let Rates { parameters, steepness, laminar, .. } = *rates;
        let rest = parameters.rest_density;
        let mut crowding = -steepness * DVec3::new(cx, cy, cz);
        let mut denser = rates.diffusion * steepness * denser;
        if EVEN {
            let at_rest = at_rest(rates.numbers, parameters, rates.core.gravity(i));
            denser -= rates.diffusion * at_rest.dot(crowding);
        }
        let mut push = steepness * DVec3::new(px, py, pz);
        let mut spread = steepness * squares / 3.0;
        let compression_by_pairs = -steepness * departing;
        let mut drag = match rates.spin {
            Some((sums, _)) => sums.drag(i, laminar),
            None => 10.0 * laminar * steepness * DVec3::new(ux, uy, uz),
        };
        let (mut by_friction, mut friction) = (DVec3::ZERO, WallDrag::default());
        let velocity = rates.velocity.get(i);
        // a fluid without viscosity feels no friction, and most have none
        let wall = if LAMINAR {
            let near = match rates.spin {
                Some((_, walls)) => walls.near(i).copied(),
                None => rates.core.coverage::<WallDrag>(i),
            };
            near.map(|wall| {
                friction = wall.friction;
                by_friction = wall.friction.by_walls(drag, velocity, laminar);
                drag = wall.friction.complete(drag, velocity, laminar);
                wall.without_friction()
            })
        } else {
            rates.core.coverage::<()>(i)
        };
        let by_weight = parameters.mass_in_sums() * rates.kernel.weight * weights;
        let mut filled = by_weight / (rest * rates.lattice);
        let mut places = by_weight;
        // how fast the wall approaches, in units of the kernel that it takes
        let mut wall_rate = 0.0;
        let crowding_by_pairs = crowding;
        if let Some(wall) = &wall {
            crowding += wall.gradient;
            spread += wall.share();
            wall_rate = wall.gradient.dot(velocity) - wall.sweep;
            filled += wall.filled;
            places += 2.0 * rest * wall.part;
        }
        // a gap beside a wall is no free surface
        let missing = rates.missing[i];
        let whole = filled + if wall.is_some() { missing.min((1.0 - filled).max(0.0)) } else { missing };
        // how far the particle belongs to the depth of the fluid, before a surface as well
        let whole_depth = depth(whole);
        let depth = depth(if EVEN { spread } else { filled });
        let smooth = if rates.differences { depth } else { 0.0 };
        let mean = if smooth > 0.0 { 1.0 + smooth * (1.0 / spread - 1.0) } else { 1.0 };
        let density = rest + smooth * rates.excess[i];
        // where pressures do not act by differences, a particle's own pressure pushes particles apart, and
        // walls push like mirror images; without EVEN the sums already contain the part of the pairs
        let pairs = push;
        push -= (1.0 - smooth) * 2.0 * rates.pressure[i] * crowding;
        let by_pairs = pairs - 2.0 * rates.pressure[i] * crowding_by_pairs;
        let blended = push;
        if let Some(wall) = &wall {
            let balanced =
                if rates.differences { 1.0 } else { depth.max(held(filled) * rates.calm(i, velocity)) };
            push = push.lerp(wall.completion() * push, balanced);
            if let Some(Edge { normal, weight, compression }) = rates.edges.and_then(|edges| edges.at(i)) {
                let even = -2.0 * (1.0 - smooth) * rates.pressure[i] * normal;
                push = push.lerp(wall.completion() * pairs + even, weight);
                wall_rate += weight * (compression - wall_rate);
            }
        }
        push *= mean;
        let mut compression = mean * (compression_by_pairs + wall_rate);
        if let Some(linear) = linear.filter(|_| smooth > 0.0) {
            let held = wall.as_ref().map_or_else(Held::default, |_| Held {
                weight: rates.core.box_moments(i),
                push: -density * rates.core.gravity(i),
            });
            push = push.lerp(linear.gradient(steepness, blended, &held), smooth);
            // before a surface too few neighbours lie on one side, and what is exact is noisy
            if rates.numbers.fills_room {
                let exact = linear.compression(steepness, wall.as_ref(), wall_rate);
                compression += smooth * (exact - compression);
            }
        }
        if let Some(wall) = &wall {
            let pressure = rates.pressure[i];
            if let Some(reaction) = &rates.reaction {
                let factor = -2.0 * pressure / density;
                let pushed = Pushed {
                    by_pressure: (push - by_pairs) / density,
                    factor,
                    gradient: wall.gradient,
                    by_friction: mean * by_friction,
                    velocity,
                    viscosity: mean * laminar,
                    ..Pushed::default()
                };
                let turned = rates.spin.map(|(sums, _)| sums.with_couple(i, &friction, pushed));
                reaction.add(i, turned.unwrap_or(pushed));
                if LAMINAR {
                    reaction.note_drag(i, mean * drag);
                }
            }
        }
        let acceleration = push / density + mean * drag + parameters.gravity;
        // where the fluid is denser because it is compressed, particles do not crowd
        let compressed = steepness * denser_along + rates.excess[i] * (crowding_by_pairs - crowding);
        let crowding = depth * (crowding + compressed / rest);
        // differences of pressure make waves grow, so all motion is damped
        let smooth =
            if ARTIFICIAL && !rates.differences { DVec3::new(sx, sy, sz) / weights } else { DVec3::ZERO };
        let returning = if closes_gaps(rates.numbers) { whole_depth } else { depth };
        let mut drift = denser + returning * rates.returns(i, whole);
        let rate = if rates.differences {
            // densities follow the equation of continuity
            drift += density * compression;
            places = 0.0;
            0.0
        } else {
            rest * (compression_by_pairs + 2.0 * wall_rate)
        };
        [
            acceleration.x,
            acceleration.y,
            acceleration.z,
            rate,
            places,
            drift,
            rest * filled,
            crowding.x,
            crowding.y,
            crowding.z,
            smooth.x,
            smooth.y,
            smooth.z,
            depth,
        ]
    }
}

impl<const LAMINAR: bool, const ARTIFICIAL: bool, const EVEN: bool> PairPass<8, SUMS, 14>
    for Pairs<'_, LAMINAR, ARTIFICIAL, EVEN>
{
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: [V; 8],
        sums: &mut [V; SUMS],
    ) {
        self.sum(d, r2, own, &other, sums);
    }

    fn finish(&self, i: usize, sums: [f64; SUMS]) -> [f64; 14] {
        self.finished(i, sums, DVec3::ZERO, None)
    }
}

/// The pass over pairs of a fluid that is shifted. It also sums f·(ρ_j − ρ₀)·d, the crowding that is due to
/// compression of the fluid.
#[derive(Clone, Copy)]
pub(super) struct Shifted<'a, const LAMINAR: bool, const ARTIFICIAL: bool>(pub Rates<'a>);

impl<const LAMINAR: bool, const ARTIFICIAL: bool> Shifted<'_, LAMINAR, ARTIFICIAL> {
    #[inline(always)]
    fn sum<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: &[V; 8],
        (sums, denser_along): (&mut [V; SUMS], &mut [V; 3]),
    ) {
        Pairs::<LAMINAR, ARTIFICIAL, true>(self.0).sum(d, r2, own, other, sums);
        let s = self.0.kernel.nearness(r2);
        let denser = s * s * s * other[4];
        for k in 0..3 {
            denser_along[k] = denser.mul_add(d[k], denser_along[k]);
        }
    }
}

impl<const LAMINAR: bool, const ARTIFICIAL: bool> PairPass<8, SHIFTED_SUMS, 14>
    for Shifted<'_, LAMINAR, ARTIFICIAL>
{
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: [V; 8],
        sums: &mut [V; SHIFTED_SUMS],
    ) {
        let (mut all, mut denser) = split(sums);
        self.sum(d, r2, own, &other, (&mut all, &mut denser));
        sums[..SUMS].copy_from_slice(&all);
        sums[SUMS..].copy_from_slice(&denser);
    }

    fn finish(&self, i: usize, sums: [f64; SHIFTED_SUMS]) -> [f64; 14] {
        let (all, denser) = split(&sums);
        Pairs::<LAMINAR, ARTIFICIAL, true>(self.0).finished(i, all, DVec3::from_array(denser), None)
    }
}

/// The sums of [`Pairs`], and the sums of [`Shifted`] that follow them.
#[inline(always)]
fn split<V: Copy>(sums: &[V]) -> ([V; SUMS], [V; 3]) {
    (std::array::from_fn(|k| sums[k]), std::array::from_fn(|k| sums[SUMS + k]))
}

/// The pass over pairs where pressures act by their differences. It also sums f·d⊗d and f·(v_i − v_j)⊗d, for
/// [`Linear`].
#[derive(Clone, Copy)]
pub(super) struct Differences<'a, const LAMINAR: bool, const ARTIFICIAL: bool>(pub Rates<'a>);

impl<const LAMINAR: bool, const ARTIFICIAL: bool> PairPass<8, DIFFERENCES_SUMS, 14>
    for Differences<'_, LAMINAR, ARTIFICIAL>
{
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: [V; 8],
        sums: &mut [V; DIFFERENCES_SUMS],
    ) {
        let (mut all, mut denser) = split(sums);
        Shifted::<LAMINAR, ARTIFICIAL>(self.0).sum(d, r2, own, &other, (&mut all, &mut denser));
        sums[..SUMS].copy_from_slice(&all);
        sums[SUMS..SHIFTED_SUMS].copy_from_slice(&denser);
        let s = self.0.kernel.nearness(r2);
        let f = s * s * s;
        let along: [V; 3] = std::array::from_fn(|k| f * d[k]);
        let parting: [V; 3] = std::array::from_fn(|k| own[k] - other[k]);
        for (k, (a, b)) in COMPONENTS.into_iter().enumerate() {
            let (moment, part) = (SHIFTED_SUMS + k, SHIFTED_SUMS + COMPONENTS.len() + k);
            sums[moment] = along[a].mul_add(d[b], sums[moment]);
            sums[part] = along[a].mul_add(parting[b], sums[part]);
            if a != b {
                sums[part] = along[b].mul_add(parting[a], sums[part]);
            }
        }
    }

    fn finish(&self, i: usize, sums: [f64; DIFFERENCES_SUMS]) -> [f64; 14] {
        let (all, denser) = split(&sums);
        let tensor = |from: usize, trace: f64, beside: f64| {
            let [xx, yy, yz, zx, xy] = std::array::from_fn(|k| sums[from + k]);
            Symmetric::new(DVec3::new(xx, yy, trace - xx - yy), beside * DVec3::new(yz, zx, xy))
        };
        let moment = tensor(SHIFTED_SUMS, all[8], 1.0);
        // beside the diagonal both a⊗b and b⊗a were summed
        let parting = tensor(SHIFTED_SUMS + COMPONENTS.len(), all[3], 0.5);
        let (denser, linear) = (DVec3::from_array(denser), Linear { moment, parting });
        Pairs::<LAMINAR, ARTIFICIAL, true>(self.0).finished(i, all, denser, Some(linear))
    }
}

impl Rates<'_> {
    /// How far a particle is at rest in the scene, 0 to 1: one up to the speed of a fall through a sixteenth
    /// of a spacing, and zero above that of a fall through an eighth. It is zero where nothing falls, because
    /// there is no weight to share.
    fn calm(&self, i: usize, velocity: DVec3) -> f64 {
        let fall = 0.125 * 2.0 * self.core.gravity(i).length() * self.parameters.spacing();
        if fall > 0.0 { (2.0 - 2.0 * velocity.length_squared() / fall).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The rate at which the density of a particle in the depth returns to that of its place, kg/m³/s.
    ///
    /// Where nothing pulls, a density below the rest density is as good as the rest density, and is left
    /// alone. A particle whose density is higher presses. If such a particle has room around it, its density
    /// belongs to another place, for instance a surface that a splash has folded in. Then the density falls
    /// until neighbours have filled the room. (If densities could not fall below the rest density, excess by
    /// disorder would raise them and nothing would lower them: water that comes to rest after a splash would
    /// stand 15 % too high, and a block that is lowered into it would raise it four times too far.)
    fn returns(&self, i: usize, filled: f64) -> f64 {
        let rest = self.parameters.rest_density;
        let (target, density) = (rest * filled / self.mean_filled, self.density[i]);
        if !closes_gaps(self.numbers) || target >= density {
            return self.return_rate * (target - density);
        }
        let gap = density - target - LOOSE * rest;
        if density > rest { -self.closing_rate * gap.max(0.0) } else { 0.0 }
    }
}

/// Whether densities above the rest density fall where there is room: if pressures cannot pull, and act in
/// pairs.
pub(super) fn closes_gaps(numbers: &Numbers) -> bool {
    numbers.negative_pressure == NegativePressure::Clamp && numbers.gradients == Gradients::Pairs
}

/// The pass over pairs that finds the density that kernels miss before a free surface, as a part of the rest
/// density.
#[derive(Clone, Copy)]
pub(super) struct Missing<'a> {
    core: &'a Core,
    crowding: Crowding,
    surface: FreeSurface,
}

impl<'a> Missing<'a> {
    pub fn new(core: &'a Core) -> Self {
        let parameters = &core.parameters;
        let surface = FreeSurface::of_lattice(parameters.support_radius / parameters.spacing());
        Self { core, crowding: Crowding::of(parameters), surface }
    }
}

impl PairPass<0, 3, 1> for Missing<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        _: &[V; 0],
        _: [V; 0],
        sums: &mut [V; 3],
    ) {
        self.crowding.add(d, r2, sums);
    }

    fn finish(&self, i: usize, sums: [f64; 3]) -> [f64; 1] {
        let mut crowding = self.crowding.total(sums);
        if let Some(wall) = self.core.coverage::<()>(i) {
            crowding += wall.gradient;
        }
        [self.surface.missing(crowding.length() * self.crowding.kernel.h)]
    }
}
