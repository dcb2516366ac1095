//! The scheme of a weakly compressible fluid: the density follows from how the particles move, and the pressure
//! from the density (Tait).
//!
//! ```text
//! ρ_i = Q_i + o_i,  Q_i = Σ m W + 2ρ₀ λ,  do_i/dt = δ·h·c Σ 2(ρ_j − ρ_i − ρᴴ_ji) V r_ji·∇W/r² + (what places say)
//! a_i = g − 1/ρ₀·[Σ V (p_i + p_j) ∇W + 2 p_i ∇λ] + viscosity
//! p = c²ρ₀/7·((ρ/ρ₀)⁷ − 1)
//! ```
//!
//! Energy: but for the factor at walls below, the acceleration by pressure is the gradient of the elastic energy Σ m·e(ρ), e = ∫ p/ρ₀² dρ, by the
//! places, because a density changes with the places as Q does. What viscosity and diffusion do only takes
//! energy away. So nothing is gained but the errors of finite steps. These have a sign: the pressure at a new
//! place is that of a density which is extrapolated from the last two rates, and the density is then made
//! exact by the Q that the same sum finds. (One particle between two walls, with steps at the limit: with
//! densities that are integrated along the way, 7 m/s become 50 m/s in a second. With the exact density from
//! a sum of its own the energy is up to 0.5 % above its start, with the extrapolated one 0.05 %.)
//!
//! A density that started at a surface knows too much once its particle is deep in the fluid, and diffusion
//! mixes such densities. In the depth of the fluid they therefore return to what the places say, Σ m W over
//! its value on a lattice, plus the part of the walls.
//!
//! Kernel: Wendland C2 (1995), under which particles do not clump. Density diffusion: Molteni & Colagrossi
//! (2009), without the hydrostatic part ρᴴ (Fourtakas et al. 2019), so that it does not lift a fluid at rest.
//! Viscosity: laminar (Monaghan & Gingold 1983, with the factor 2(d + 2) = 10 of three dimensions) and artificial
//! (Monaghan 1992), with pairs of pressures that of rough motion alone ([`roughness`]). Both act along the lines between
//! particles and so conserve angular momentum.
//!
//! With `gradients: differences` the depth of the fluid has gradients by differences instead, divided by what
//! the sum makes of the gradient of a position, G = −⅓ Σ V r·∇W + ⅓ tr K (0.98 on a lattice at h = 2.6 spacings). A pressure that is linear in space has
//! its exact gradient, however far above zero it lies. Such forces do not push particles apart; shifting
//! keeps the particles evenly distributed instead ([`super::super::shifting`]). At a free surface and in
//! spray, where G is small, pressures act as sums p_i + p_j there too. Densities then follow the equation of
//! continuity, and energy is not conserved by construction.
//!
//! Walls enter by λ, ∇λ and K in closed form ([`Coverage`](crate::sph::walls::Coverage)). They mirror the
//! pressure and the velocity of a particle. In the depth of the fluid the pressure beyond a wall is also
//! continued linearly by the fluid's own balance ∇p = ρ(g + viscous − a). Since a is the unknown, this is a
//! linear system of three unknowns for each particle at a wall; the factor (1 − K)⁻¹ solves it. (Without it
//! water at rest keeps moving along its walls, 3 cm/s in the mean after three seconds instead of 1 cm/s, and
//! is 14 % too light at the floor.) Spray that hits a wall has no balance, so it has no such factor, and its
//! motion conserves energy. Particles of a surface at rest have one, or walls would not bear their share of its
//! weight: the pressure of water eight layers deep was too high by a tenth of a layer, everywhere. Those of a
//! surface that moves have none: a film that runs along a floor would gain energy by it, 0.5 % of what a tank had.
//!
//! Along walls that let it slip the flow is mirrored: the part of the kernel inside them adds to the viscosity
//! what the rest does.
//!
//! Time: kick–drift–kick with one evaluation per step.

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;
use rayon::prelude::*;

use super::super::{
    negative_pressure::NegativePressure,
    roughness::{self, Roughness},
    scheme::Scheme,
    shifting::{depth, restore_crowding, return_rate, save_crowding, shift},
    tension::Tension,
};
use super::{EXPONENT, Gradients, Wcsph};
use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::{CHUNK, Core, add_scaled, set_sum},
    error::StepError,
    kernel::Wendland,
    pairs::{PairPass, Real},
    params::Parameters,
    particles::Vectors,
    reaction::Reaction,
    walls::{Friction, Pushed, WallDrag},
};

/// The method's numbers, with derived values where the scene states none.
#[derive(Debug, Clone, Copy)]
struct Numbers {
    /// Speed of sound, m/s.
    sound_speed: f64,
    density_diffusion: f64,
    /// The factor α·h/2·c of the artificial viscosity, m²/s.
    artificial: f64,
    gradients: Gradients,
    shifting: f64,
    negative_pressure: NegativePressure,
}

impl Numbers {
    fn of(wcsph: &Wcsph, parameters: &Parameters) -> Self {
        Self {
            sound_speed: parameters.sound_speed(),
            density_diffusion: wcsph.density_diffusion,
            artificial: wcsph.artificial_factor(&parameters.scales()),
            gradients: wcsph.gradients,
            shifting: wcsph.shifting(),
            negative_pressure: wcsph.negative_pressure,
        }
    }
}

/// The scheme. It keeps the rates of change between steps; the rest is working memory.
pub struct Weakly {
    numbers: Numbers,
    /// Q = Σ m W + 2ρ₀λ, kg/m³: how densities depend on places. Zero with differences of pressure.
    places: Vec<f64>,
    /// dQ/dt, kg/m³/s, now and a step before.
    rate: Vec<f64>,
    earlier_rate: Vec<f64>,
    /// Length of the last step, s; zero at the start.
    last_dt: f64,
    /// What else changes densities, kg/m³/s.
    drift: Vec<f64>,
    /// Densities by the places of the particles alone, kg/m³.
    filled: Vec<f64>,
    /// Σ V ∇W + ∇λ, 1/m: the direction in which particles crowd; zero at the surface.
    crowding: Vectors,
    /// Predicted ρ − ρ₀.
    excess: Vec<f64>,
    roughness: Roughness,
    /// Working memory: the Q and the drift that a sum finds.
    found: [Vec<f64>; 2],
    tension: Tension,
}

/// Names of the scheme's columns in a checkpoint.
const COLUMNS: [&str; 4] = ["places", "density rate", "earlier density rate", "density drift"];

/// Squares of distances below this part of h² do not count as a direction.
const LEAST_DISTANCE: f64 = 1e-6;

/// Name of the length of the last step in a checkpoint.
const LAST_STEP: &str = "last step";

impl Scheme for Weakly {
    fn step(&mut self, core: &mut Core, longest: f64) -> Result<f64, StepError> {
        let dt = core.next_dt(longest)?;
        add_scaled(&mut core.particles.velocity, &core.acceleration, 0.5 * dt);
        core.move_obstacles(dt);
        core.drift(dt, shift(self.numbers.shifting, &self.crowding, core))?;
        let [sx, sy, sz] = self.roughness.columns();
        core.sort(&mut [
            &mut self.places,
            &mut self.rate,
            &mut self.earlier_rate,
            &mut self.drift,
            sx,
            sy,
            sz,
        ]);
        self.find_rates(core, dt);
        add_scaled(&mut core.particles.velocity, &core.acceleration, 0.5 * dt);
        self.find_pressure(core, dt);
        core.check_finite(dt)?;
        Ok(dt)
    }

    fn save(&self, checkpoint: &mut Checkpoint) {
        for (name, column) in COLUMNS.iter().zip([&self.places, &self.rate, &self.earlier_rate, &self.drift])
        {
            checkpoint.set(name, column.clone());
        }
        checkpoint.set(LAST_STEP, vec![self.last_dt]);
        save_crowding(&self.crowding, checkpoint);
        self.roughness.save(checkpoint);
    }

    fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        let columns = [&mut self.places, &mut self.rate, &mut self.earlier_rate, &mut self.drift];
        for (name, column) in COLUMNS.iter().zip(columns) {
            *column = checkpoint.of_particles(name)?;
        }
        if let [last_dt] = checkpoint.get(LAST_STEP)? {
            self.last_dt = *last_dt;
        }
        self.crowding = restore_crowding(checkpoint)?;
        self.roughness.restore(checkpoint)
    }

    fn densities<'a>(&'a self, _core: &'a Core) -> &'a [f64] {
        &self.filled
    }

    fn bytes(&self) -> usize {
        let Self { places, rate, earlier_rate, drift, filled, found: [a, b], excess, .. } = self;
        let columns = [places, rate, earlier_rate, drift, filled, a, b, excess];
        columns.map(|column| 8 * column.capacity()).iter().sum::<usize>()
            + self.crowding.bytes()
            + self.tension.bytes()
            + self.roughness.bytes()
    }
}

impl Weakly {
    pub fn start(wcsph: &Wcsph, core: &mut Core) -> Self {
        let numbers = Numbers::of(wcsph, &core.parameters);
        let n = core.particles.len();
        // a particle without a density starts at the rest density
        core.particles.density.resize(n, 0.0);
        for rho in core.particles.density.iter_mut().filter(|rho| **rho == 0.0) {
            *rho = core.parameters.rest_density;
        }
        core.particles.pressure.resize(n, 0.0);
        let mut scheme = Self {
            numbers,
            places: vec![0.0; n],
            rate: vec![0.0; n],
            earlier_rate: vec![0.0; n],
            last_dt: 0.0,
            drift: vec![0.0; n],
            filled: vec![0.0; n],
            crowding: Vectors::default(),
            excess: Vec::new(),
            roughness: Roughness::of(&core.particles.velocity, numbers.gradients == Gradients::Pairs),
            found: [vec![0.0; n], vec![0.0; n]],
            tension: Tension::default(),
        };
        core.sort(&mut scheme.roughness.columns());
        scheme.find_rates(core, 0.0);
        scheme.find_pressure(core, 0.0);
        scheme
    }

    /// Finds the pressures of the densities, and the greatest speed of sound after a step of the length `dt`.
    fn find_pressure(&self, core: &mut Core, dt: f64) {
        let (numbers, parameters, particles) = (&self.numbers, &core.parameters, &mut core.particles);
        let densest = particles
            .pressure
            .par_chunks_mut(CHUNK)
            .zip(particles.density.par_chunks(CHUNK))
            .zip(self.rate.par_chunks(CHUNK))
            .map(|((pressure, density), rate)| {
                let mut densest = parameters.rest_density;
                for ((p, &rho), rate) in pressure.iter_mut().zip(density).zip(rate) {
                    *p = tait(numbers, parameters, rho);
                    densest = densest.max(rho + dt * rate);
                }
                densest
            })
            .reduce(|| parameters.rest_density, f64::max);
        core.sound = numbers.sound_speed * (densest / parameters.rest_density).powi((EXPONENT - 1) / 2);
    }

    /// Finds accelerations, densities and their rates at the end of a step of the length `dt`, with velocities
    /// and densities predicted for it. The pressures of the particles become those of the predicted densities.
    fn find_rates(&mut self, core: &mut Core, dt: f64) {
        let n = core.particles.len();
        let mut predicted = std::mem::take(&mut core.spare);
        set_sum(&mut predicted, &core.particles.velocity, &core.acceleration, 0.5 * dt);
        self.predict_densities(core, dt);
        self.crowding.resize(n);
        self.filled.resize(n, 0.0);
        let mut pressure = std::mem::take(&mut core.particles.pressure);
        self.find_excess(core, &mut pressure);
        let numbers = &self.numbers;
        let mut acceleration = std::mem::take(&mut core.acceleration);
        let Vectors { x: vx, y: vy, z: vz } = &predicted;
        let (Vectors { x: rx, y: ry, z: rz }, Vectors { x: sx, y: sy, z: sz }) =
            self.roughness.split(&predicted);
        let fields = [&vx[..], vy, vz, &pressure, &self.excess, rx, ry, rz];
        let Vectors { x, y, z } = &mut acceleration;
        let Vectors { x: cx, y: cy, z: cz } = &mut self.crowding;
        let [mut places, mut drift] = std::mem::take(&mut self.found);
        std::mem::swap(&mut self.rate, &mut self.earlier_rate);
        let out = [
            &mut x[..],
            y,
            z,
            &mut self.rate,
            &mut places,
            &mut drift,
            &mut self.filled,
            cx,
            cy,
            cz,
            sx,
            sy,
            sz,
        ];
        let rates = Rates::new(core, numbers, &predicted, &pressure, &self.excess, dt);
        match (rates.laminar > 0.0, rates.artificial > 0.0, rates.even) {
            (true, true, true) => core.sum(&Pairs::<true, true, true>(rates), fields, out),
            (true, true, false) => core.sum(&Pairs::<true, true, false>(rates), fields, out),
            (true, false, true) => core.sum(&Pairs::<true, false, true>(rates), fields, out),
            (true, false, false) => core.sum(&Pairs::<true, false, false>(rates), fields, out),
            (false, true, true) => core.sum(&Pairs::<false, true, true>(rates), fields, out),
            (false, true, false) => core.sum(&Pairs::<false, true, false>(rates), fields, out),
            (false, false, true) => core.sum(&Pairs::<false, false, true>(rates), fields, out),
            (false, false, false) => core.sum(&Pairs::<false, false, false>(rates), fields, out),
        }
        core.acceleration = acceleration;
        core.particles.pressure = pressure;
        core.spare = predicted;
        core.settle_contacts();
        if dt > 0.0 {
            self.correct_densities(core, &places, &drift, dt);
        }
        self.found = [std::mem::replace(&mut self.places, places), std::mem::replace(&mut self.drift, drift)];
        self.last_dt = dt;
        core.pull();
        self.tension.act(core);
    }

    /// Finds the pressures of the predicted densities, and makes of these densities what the sums read.
    fn find_excess(&mut self, core: &Core, pressure: &mut [f64]) {
        let (numbers, parameters) = (&self.numbers, &core.parameters);
        let even = sums_crowding(numbers, core);
        // where how particles crowd is not summed, only differences of the excess matter, so that of a fluid at
        // rest is subtracted
        let (at_rest, from) = (at_rest(numbers, parameters), core.boundary.domain.min);
        let Vectors { x, y, z } = &core.particles.position;
        let places = x.par_chunks(CHUNK).zip(y.par_chunks(CHUNK)).zip(z.par_chunks(CHUNK));
        let columns = self.excess.par_chunks_mut(CHUNK).zip(pressure.par_chunks_mut(CHUNK));
        columns.zip(places).for_each(|((excess, pressure), ((x, y), z))| {
            for (excess, pressure) in excess.iter_mut().zip(pressure) {
                *pressure = tait(numbers, parameters, *excess);
                *excess -= parameters.rest_density;
                if numbers.gradients == Gradients::Pairs {
                    // where nothing pulls, a density below that at rest is as good as that at rest
                    *excess = numbers.negative_pressure.of(*excess);
                }
            }
            if !even {
                for (((excess, x), y), z) in excess.iter_mut().zip(x).zip(y).zip(z) {
                    *excess -= at_rest.dot(DVec3::new(*x, *y, *z) - from);
                }
            }
        });
    }

    /// Predicts densities for the end of a step of the length `dt`, by the rates of the last two instants
    /// (Adams–Bashforth). They are left in `excess`.
    fn predict_densities(&mut self, core: &Core, dt: f64) {
        let bend = if self.last_dt > 0.0 { 0.5 * dt * dt / self.last_dt } else { 0.0 };
        self.excess.resize(core.particles.len(), 0.0);
        self.excess
            .par_chunks_mut(CHUNK)
            .zip(core.particles.density.par_chunks(CHUNK))
            .zip(self.rate.par_chunks(CHUNK).zip(self.earlier_rate.par_chunks(CHUNK)))
            .zip(self.drift.par_chunks(CHUNK))
            .for_each(|(((predicted, density), (rate, earlier)), drift)| {
                for k in 0..predicted.len() {
                    predicted[k] = density[k] + dt * (rate[k] + drift[k]) + bend * (rate[k] - earlier[k]);
                }
            });
    }

    /// Advances densities over a step of the length `dt`, to the Q and the drift at its end.
    fn correct_densities(&self, core: &mut Core, places: &[f64], drift: &[f64], dt: f64) {
        core.particles
            .density
            .par_chunks_mut(CHUNK)
            .zip(places.par_chunks(CHUNK).zip(self.places.par_chunks(CHUNK)))
            .zip(drift.par_chunks(CHUNK).zip(self.drift.par_chunks(CHUNK)))
            .for_each(|((density, (places, places_before)), (drift, drift_before))| {
                for k in 0..density.len() {
                    density[k] += places[k] - places_before[k] + 0.5 * dt * (drift[k] + drift_before[k]);
                }
            });
    }
}

/// Whether how particles crowd is summed: where they are kept evenly distributed, with differences of pressure and with
/// shifting, and where the growth of the density at rest depends on the place, as gravity does.
fn sums_crowding(numbers: &Numbers, core: &Core) -> bool {
    numbers.shifting > 0.0 || numbers.gradients == Gradients::Differences || core.gravity_field.is_some()
}

/// ρ₀/c²·g: how the density of a fluid at rest grows with the depth, kg/m⁴.
fn at_rest(numbers: &Numbers, parameters: &Parameters) -> DVec3 {
    parameters.rest_density / numbers.sound_speed.powi(2) * parameters.gravity
}

/// The pressure p = c²ρ₀/7·((ρ/ρ₀)⁷ − 1), cut off at zero unless negative pressures are kept.
#[inline]
fn tait(numbers: &Numbers, parameters: &Parameters, density: f64) -> f64 {
    let stiffness = numbers.sound_speed.powi(2) * parameters.rest_density / f64::from(EXPONENT);
    let p = stiffness * ((density / parameters.rest_density).powi(EXPONENT) - 1.0);
    numbers.negative_pressure.of(p)
}

/// Limits of Σ V W, with the part of a wall, between which a particle at the wall begins to take part in the balance
/// of the fluid: spray has less, and a surface at rest more.
const HELD: [f64; 2] = [0.7, 0.8];

/// How far a particle at a wall takes part in the balance of the fluid, 0 to 1, from its Σ V W.
fn held(filled: f64) -> f64 {
    let [spray, surface] = HELD;
    ((filled - spray) / (surface - spray)).clamp(0.0, 1.0)
}

/// What the pass over pairs needs besides the columns that it sums.
#[derive(Clone, Copy)]
struct Rates<'a> {
    parameters: &'a Parameters,
    core: &'a Core,
    velocity: &'a Vectors,
    pressure: &'a [f64],
    /// ρ − ρ₀; where how particles crowd is not summed, less the excess in a fluid at rest.
    excess: &'a [f64],
    kernel: Wendland,
    /// The factor V·c of V∇W = −V·c·(1 − q)³·r.
    steepness: f64,
    /// The factor 2δ·h/2·c·ρ₀ of the diffusion, over ρ₀.
    diffusion: f64,
    /// ρ₀/c², s²·kg/m⁵: how the density of a fluid at rest grows along gravity.
    compressibility: f64,
    /// Kinematic viscosity ν = μ/ρ₀, m²/s.
    laminar: f64,
    /// The factor α·h/2·c·ρ₀ of the artificial viscosity.
    artificial: f64,
    /// Densities before the step, kg/m³.
    density: &'a [f64],
    /// Whether nothing pulls, so that a density below that at rest is as good as that at rest.
    clamped: bool,
    /// Whether pressures act by their differences in the fluid's depth.
    differences: bool,
    /// Rate at which densities return to what the places say, 1/s.
    return_rate: f64,
    /// Σ V W on a lattice.
    lattice: f64,
    /// Whether how particles crowd is summed, see [`sums_crowding`].
    even: bool,
    /// Where what walls do is noted, if it is to be.
    reaction: Option<Reaction<'a>>,
}

impl<'a> Rates<'a> {
    fn new(
        core: &'a Core,
        numbers: &Numbers,
        velocity: &'a Vectors,
        pressure: &'a [f64],
        excess: &'a [f64],
        dt: f64,
    ) -> Self {
        let parameters = &core.parameters;
        let kernel = Wendland::new(parameters.support_radius);
        let smoothing = 0.5 * parameters.support_radius;
        Self {
            parameters,
            core,
            velocity,
            pressure,
            excess,
            kernel,
            steepness: parameters.particle_mass / parameters.rest_density * kernel.steepness,
            diffusion: 2.0 * numbers.density_diffusion * smoothing * numbers.sound_speed,
            compressibility: parameters.rest_density / numbers.sound_speed.powi(2),
            laminar: parameters.viscosity / parameters.rest_density,
            artificial: roughness::within_step(numbers.artificial, parameters.support_radius, dt)
                * parameters.rest_density,
            density: &core.particles.density,
            clamped: numbers.negative_pressure == NegativePressure::Clamp,
            differences: numbers.gradients == Gradients::Differences,
            return_rate: return_rate(core),
            lattice: Wendland::lattice_sum(parameters.support_radius / parameters.spacing()),
            even: sums_crowding(numbers, core),
            reaction: Reaction::of(core, dt),
        }
    }
}

/// The pass over pairs, with laminar and artificial viscosity or without, and for particles that are kept
/// even or not. With f = (1 − q)³ and d from the neighbour it sums f·(p_j − p_i + Π)·d, f·(v_i − v_j)·d,
/// f·(ρ_j − ρ_i), f·d, f·d², W, f·((v_j − v_i)·d)·d/d² and W·v_j; the artificial viscosity Π is that of rough velocities.
/// Where how particles crowd is not summed it has p_j + p_i
/// instead of p_j − p_i, and omits f·d and f·d².
#[derive(Clone, Copy)]
struct Pairs<'a, const LAMINAR: bool, const ARTIFICIAL: bool, const EVEN: bool>(Rates<'a>);

impl<const LAMINAR: bool, const ARTIFICIAL: bool, const EVEN: bool> PairPass<8, 16, 13>
    for Pairs<'_, LAMINAR, ARTIFICIAL, EVEN>
{
    /// The artificial viscosity is a pressure between particles that approach, and a tension between those
    /// that part. With the pressure alone, noise at rest would hold up a part of the fluid's weight (3 % of
    /// it with α = 0.1).
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 8],
        other: [V; 8],
        sums: &mut [V; 16],
    ) {
        let of = V::Element::of;
        let rates = &self.0;
        let s = rates.kernel.nearness(r2);
        let f = s * s * s;
        let departing = (own[0] - other[0]) * d[0];
        let departing = (own[1] - other[1]).mul_add(d[1], departing);
        let departing = (own[2] - other[2]).mul_add(d[2], departing);
        let mut push = if EVEN { other[3] - own[3] } else { other[3] + own[3] };
        if ARTIFICIAL {
            let least = of(0.01 * (0.5 * rates.kernel.h).powi(2));
            // an artificial viscosity needs no more than the twelve bits of an estimate in single precision
            let rough = (own[5] - other[5]) * d[0];
            let rough = (own[6] - other[6]).mul_add(d[1], rough);
            let rough = (own[7] - other[7]).mul_add(d[2], rough);
            push -=
                roughness::damped(rough, departing) * of(rates.artificial) * (r2 + least).approximate_recip();
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
        sums[9] = weight + sums[9];
        if ARTIFICIAL {
            for k in 0..3 {
                sums[13 + k] = weight.mul_add(other[k], sums[13 + k]);
            }
        }
        if LAMINAR {
            // a particle has no line to itself
            let least = of(LEAST_DISTANCE * rates.kernel.h.powi(2));
            let rubbing = f * departing / (r2 + least);
            for k in 0..3 {
                sums[10 + k] = d[k].mul_add(-rubbing, sums[10 + k]);
            }
        }
    }

    fn finish(&self, i: usize, sums: [f64; 16]) -> [f64; 13] {
        let [px, py, pz, departing, denser, cx, cy, cz, squares, weights, ux, uy, uz, sx, sy, sz] = sums;
        let rates = &self.0;
        let Rates { parameters, steepness, laminar, .. } = *rates;
        let rest = parameters.rest_density;
        let mut crowding = -steepness * DVec3::new(cx, cy, cz);
        let mut denser = rates.diffusion * steepness * denser;
        if EVEN {
            denser -= rates.diffusion * rates.at_rest(i).dot(crowding);
        }
        let mut push = steepness * DVec3::new(px, py, pz);
        let mut spread = steepness * squares / 3.0;
        let mut compression = -steepness * departing;
        let mut drag = 10.0 * laminar * steepness * DVec3::new(ux, uy, uz);
        let mut by_friction = DVec3::ZERO;
        let velocity = rates.velocity.get(i);
        // a fluid without viscosity feels no friction, and most have none
        let wall = if LAMINAR {
            rates.core.coverage::<WallDrag>(i).map(|wall| {
                by_friction = wall.friction.by_walls(drag, velocity, laminar);
                drag = wall.friction.complete(drag, velocity, laminar);
                wall.without_friction()
            })
        } else {
            rates.core.coverage::<()>(i)
        };
        let by_weight = parameters.particle_mass * rates.kernel.weight * weights;
        let mut filled = by_weight / (rest * rates.lattice);
        let mut places = by_weight;
        // how fast the wall approaches, in units of the kernel that it takes
        let mut wall_rate = 0.0;
        let crowding_by_pairs = crowding;
        if let Some(wall) = &wall {
            crowding += wall.gradient;
            spread += wall.share();
            wall_rate = wall.gradient.dot(velocity) - wall.sweep;
            // differences are steady only at a continuous wall
            filled += if rates.differences { wall.part } else { wall.filled };
            places += 2.0 * rest * wall.part;
        }
        // how far the particle belongs to the depth of the fluid
        let depth = depth(if EVEN { spread } else { filled });
        let smooth = if rates.differences { depth } else { 0.0 };
        let mean = if smooth > 0.0 { 1.0 + smooth * (1.0 / spread - 1.0) } else { 1.0 };
        let density = rest + smooth * rates.excess[i];
        // where pressures do not act by differences, their own pressure pushes particles apart, and walls push
        // as their mirrored images do; without EVEN the sums contain the part of the pairs already
        let pairs = push;
        push -= (1.0 - smooth) * 2.0 * rates.pressure[i] * crowding;
        if let Some(wall) = &wall {
            let (pressure, by_pairs) =
                (rates.pressure[i], pairs - 2.0 * rates.pressure[i] * crowding_by_pairs);
            let balanced =
                if rates.differences { 1.0 } else { depth.max(held(filled) * rates.calm(i, velocity)) };
            push = push.lerp(wall.completion() * push, balanced);
            if let Some(reaction) = &rates.reaction {
                let by_pressure = (push - by_pairs) / density;
                reaction.add(i, Pushed { by_pressure, factor: -2.0 * pressure / density, by_friction });
            }
        }
        let acceleration = mean * (push / density + drag) + parameters.gravity;
        let crowding = depth * crowding;
        // differences of pressure make waves grow, so that all their motion is damped
        let smooth =
            if ARTIFICIAL && !rates.differences { DVec3::new(sx, sy, sz) / weights } else { DVec3::ZERO };
        let mut drift = denser + depth * rates.returns(i, filled);
        let rate = if rates.differences {
            // densities follow the equation of continuity
            compression += wall_rate;
            drift += mean * density * compression;
            places = 0.0;
            0.0
        } else {
            rest * (compression + 2.0 * wall_rate)
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
        ]
    }
}

impl Rates<'_> {
    /// How the density of a fluid at rest grows at a particle, kg/m⁴.
    fn at_rest(&self, i: usize) -> DVec3 {
        self.compressibility * self.core.gravity(i)
    }

    /// How far a particle is at rest in the scene, 0 to 1: one if its speed is that of a fall through a sixteenth of a
    /// spacing or less, zero from an eighth on. Where nothing falls there is no weight to share, and it is zero.
    fn calm(&self, i: usize, velocity: DVec3) -> f64 {
        let fall = 0.125 * 2.0 * self.core.gravity(i).length() * self.parameters.spacing();
        if fall > 0.0 { (2.0 - 2.0 * velocity.length_squared() / fall).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The rate at which the density of a particle in the depth returns to what its place says, kg/m³/s.
    fn returns(&self, i: usize, filled: f64) -> f64 {
        let rest = self.parameters.rest_density;
        let (mut target, density) = (rest * filled, self.density[i]);
        if self.clamped && !self.differences {
            target = target.max(rest.min(density));
        }
        self.return_rate * (target - density)
    }
}
