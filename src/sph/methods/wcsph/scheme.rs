//! The scheme of a weakly compressible fluid: the density follows from how the particles move, and the
//! pressure from the density (Tait).
//!
//! ```text
//! ρ_i = Q_i + o_i,  Q_i = Σ m W + 2ρ₀ λ,
//! do_i/dt = δ·h·c Σ 2(ρ_j − ρ_i − ρᴴ_ji) V r_ji·∇W/r² + (return to the density of the places)
//! a_i = g − 1/ρ₀·[Σ V (p_i + p_j) ∇W + 2 p_i ∇λ] + viscosity
//! p = c²ρ₀/7·((ρ/ρ₀)⁷ − 1)
//! ```
//!
//! Energy: a density changes with the places as Q does. So, but for the factor at walls below, the
//! acceleration by pressure is the gradient of the elastic energy Σ m·e(ρ), e = ∫ p/ρ₀² dρ, with respect to
//! the places. Viscosity and diffusion only take energy away. Energy is therefore gained only by the errors
//! of finite steps, and these have a sign. The pressure at a new place is that of a density extrapolated from
//! the last two rates; the density is then made exact by the Q that the same sum finds. (One particle between
//! two walls, with steps at the limit: if densities are integrated along the way, 7 m/s become 50 m/s in a
//! second. With the exact density from a separate sum the energy is up to 0.5 % above its start, with the
//! extrapolated one 0.05 %.)
//!
//! A density that started at a surface is no longer right once its particle is deep in the fluid, and
//! diffusion mixes such densities. In the fluid they therefore return to the density of the places: Σ m W
//! over its value on a lattice, plus the part of the walls and the part missing before a free surface
//! ([`free_surface`](super::super::free_surface)). Where there is room they return to within two hundredths,
//! and not slower than a fluid falls together.
//!
//! Kernel: Wendland C2 (1995), under which particles do not clump. Density diffusion: Molteni & Colagrossi
//! (2009), without the hydrostatic part ρᴴ (Fourtakas et al. 2019), so that it does not lift a fluid at rest.
//! Viscosity: laminar (Monaghan & Gingold 1983, with the factor 2(d + 2) = 10 of three dimensions) and
//! artificial (Monaghan 1992); with pairs of pressures the artificial one acts on rough motion alone
//! ([`Roughness`]). Both act along the lines between particles, so with pairs of pressures they conserve
//! angular momentum. The laminar one of a fluid whose viscosity counts is that of [`SpinViscosity`], which does too.
//!
//! With `gradients: differences` the depth of the fluid has gradients by differences instead. They are
//! divided by the gradient of a position by the same sum: the tensor −Σ V r⊗∇W over a particle's neighbours
//! (Bonet & Lok 1999). So the gradient of a pressure that is linear in space is exact, however far above zero
//! the pressure lies and wherever the neighbours are, even at walls, where half of them are missing. (Closed
//! forms of the part that walls take hold for whole walls, but not for the places of particles: with them
//! still water would never stop moving along edges and out of corners, at 4 cm/s and more.) Such forces do
//! not push particles apart; shifting keeps the particles evenly distributed instead
//! ([`super::super::shifting`]). At a free surface and in spray G = −⅓ Σ V r·∇W + ⅓ tr K is small (it is 0.98
//! on a lattice at h = 2.6 spacings), and there pressures act as sums p_i + p_j with this key, too. Densities
//! then follow the equation of continuity, and neither energy nor momentum is conserved by construction.
//!
//! A fluid that fills its room has these gradients by default. It has no surface at which they are less exact
//! than pairs, so more is asked of it: the divergence is exact for a velocity that is linear in space, too
//! ([`Linear`](super::linear::Linear)), negative pressures are kept, because only differences of pressure have a
//! meaning, and shifting moves only what is uneven between neighbours ([`Common`]).
//!
//! Walls enter by λ, ∇λ and K in closed form ([`Coverage`](crate::sph::walls::Coverage)). They mirror the
//! pressure and the velocity of a particle. In the depth of the fluid the pressure beyond a wall is also
//! continued linearly by the fluid's own balance ∇p = ρ(g + viscous − a). Since a is the unknown, this is a
//! linear system of three unknowns for each particle at a wall; the factor (1 − K)⁻¹ solves it. (Without it
//! water at rest keeps moving along its walls, 3 cm/s in the mean after three seconds instead of 1 cm/s, and
//! is 14 % too light at the floor.) With gradients by differences the walls of the box need no such factor:
//! across them the fluid is not accelerated, which is one more condition on the gradient
//! ([`Held`](super::linear::Held)). Spray that hits a wall has no balance, so it has no such factor, and its
//! motion conserves energy. Particles of a surface at rest have the factor, or walls would not bear their
//! share of its weight: without it the pressure of water eight layers deep is too high by a tenth of a
//! layer, everywhere. Particles of a moving surface do not have it: a film that runs along a floor would
//! gain energy by it, 0.5 % of that of a tank. At the edge of a fluid under tension the walls mirror the fluid itself
//! ([`Edges`]).
//!
//! Along walls on which it slips the flow is mirrored: the part of the kernel inside them adds as much to the
//! viscosity as the rest.
//!
//! Time: kick–drift–kick with one evaluation per step.

use glam::DVec3;
use rayon::prelude::*;
use smallvec::SmallVec;

use super::super::{
    dfsph::spread,
    near_walls::NearWalls,
    roughness::Roughness,
    scheme::{Scheme, Start},
    shifting::{Common, restore_crowding, save_crowding, shift},
    tension::Tension,
    viscosity::SpinViscosity,
};
use super::at_edges::Edges;
use super::leaving::OfWalls;
use super::numbers::{Numbers, at_rest, sums_crowding, tait};
use super::passes::{Differences, Missing, Pairs, Shifted};
use super::rates::{Rates, closes_gaps};
use super::{EXPONENT, Gradients, Wcsph};
use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::Core,
    error::StepError,
    particles::{CHUNK, Vectors, add_scaled, set_sum},
    walls::{Coverage, ViscousForces, WallDrag},
};

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
    /// Rate of density by everything else, kg/m³/s.
    drift: Vec<f64>,
    /// Densities that follow from the places of the particles alone, kg/m³.
    filled: Vec<f64>,
    /// Σ V ∇W + ∇λ, 1/m, without the part due to compression and, in a fluid that fills its room, without what
    /// neighbours have in common: the direction in which particles crowd. It is zero at the surface.
    crowding: Vectors,
    /// What neighbours have in common, if the fluid fills its room.
    common: Option<Common>,
    /// How far each particle belongs to the depth of the fluid, 0 to 1.
    depth: Vec<f64>,
    /// The mean of [`filled`](Self::filled) over the rest density in a fluid that fills its room, else one.
    mean_filled: f64,
    /// Predicted ρ − ρ₀.
    excess: Vec<f64>,
    /// The density that kernels miss before a free surface, as a part of the rest density. It is found every
    /// [`SURFACE_STEPS`] steps.
    missing: Vec<f64>,
    roughness: Roughness,
    /// What walls add to the densities.
    of_walls: OfWalls,
    /// Working memory: the Q and the drift that a sum finds.
    found: [Vec<f64>; 2],
    tension: Tension,
    /// Working memory of [`Edges`].
    edge_compression: Vec<f64>,
    viscosity: SpinViscosity,
    /// The walls near particles, found for them.
    walls: NearWalls<Coverage<WallDrag>>,
}

/// Names of the scheme's columns in a checkpoint.
const COLUMNS: [&str; 5] =
    ["places", "density rate", "earlier density rate", "density drift", "missing before a surface"];

/// Number of steps after which the part that kernels miss before a free surface is found anew. The surface
/// changes within some hundred steps.
const SURFACE_STEPS: u64 = 8;

/// Names of the length of the last step and of the mean density by places in a checkpoint.
const LAST_STEP: &str = "last step";
const MEAN_FILLED: &str = "mean density of places";

impl Scheme for Weakly {
    fn step(&mut self, core: &mut Core, longest: f64) -> Result<f64, StepError> {
        let dt = core.next_dt(longest)?;
        add_scaled(&mut core.particles.velocity, &core.acceleration, 0.5 * dt);
        core.move_obstacles(dt);
        core.drift(dt, shift(self.numbers.shifting, &self.crowding, core))?;
        self.sort(core);
        self.find_rates(core, dt);
        add_scaled(&mut core.particles.velocity, &core.acceleration, 0.5 * dt);
        self.find_pressure(core, dt);
        core.check_finite(dt)?;
        Ok(dt)
    }

    fn save(&self, checkpoint: &mut Checkpoint) {
        let columns = [&self.places, &self.rate, &self.earlier_rate, &self.drift, &self.missing];
        for (name, column) in COLUMNS.iter().zip(columns) {
            checkpoint.set(name, column.clone());
        }
        checkpoint.set(LAST_STEP, vec![self.last_dt]);
        save_crowding(&self.crowding, checkpoint);
        if let Some(common) = &self.common {
            common.save(checkpoint);
            checkpoint.set(MEAN_FILLED, vec![self.mean_filled]);
        }
        self.roughness.save(checkpoint);
        self.of_walls.save(checkpoint);
    }

    fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        let columns =
            [&mut self.places, &mut self.rate, &mut self.earlier_rate, &mut self.drift, &mut self.missing];
        for (name, column) in COLUMNS.iter().zip(columns) {
            *column = checkpoint.of_particles(name)?;
        }
        if let [last_dt] = checkpoint.get(LAST_STEP)? {
            self.last_dt = *last_dt;
        }
        self.crowding = restore_crowding(checkpoint)?;
        if let Some(common) = &mut self.common {
            common.restore(checkpoint)?;
            if let [mean] = checkpoint.get(MEAN_FILLED)? {
                self.mean_filled = *mean;
            }
        }
        self.roughness.restore(checkpoint)?;
        self.of_walls.restore(checkpoint)
    }

    fn densities<'a>(&'a self, _core: &'a Core) -> &'a [f64] {
        &self.filled
    }

    fn bytes(&self) -> usize {
        let Self { places, rate, earlier_rate, drift, filled, depth, found: [a, b], excess, missing, .. } =
            self;
        let columns = [places, rate, earlier_rate, drift, filled, depth, a, b, excess, missing];
        columns.map(|column| 8 * column.capacity()).iter().sum::<usize>()
            + self.crowding.bytes()
            + self.common.as_ref().map_or(0, Common::bytes)
            + self.tension.bytes()
            + 8 * self.edge_compression.capacity()
            + self.roughness.bytes()
            + self.of_walls.bytes()
            + self.viscosity.bytes()
            + self.walls.bytes()
    }
}

impl Start for Wcsph {
    fn start(self, core: &mut Core, is_new: bool) -> Box<dyn Scheme> {
        if is_new {
            spread(core);
        }
        Box::new(Weakly::at(&self, core))
    }
}

impl Weakly {
    /// Makes the scheme for the present positions and velocities.
    fn at(wcsph: &Wcsph, core: &mut Core) -> Self {
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
            common: numbers.fills_room.then(|| Common::of(n)),
            depth: vec![0.0; n],
            mean_filled: 1.0,
            excess: Vec::new(),
            missing: vec![0.0; n],
            roughness: Roughness::of(&core.particles.velocity, numbers.gradients == Gradients::Pairs),
            of_walls: OfWalls::nothing(n),
            found: [vec![0.0; n], vec![0.0; n]],
            tension: Tension::default(),
            edge_compression: Vec::new(),
            viscosity: SpinViscosity::default(),
            walls: NearWalls::default(),
        };
        core.sort(&mut scheme.roughness.columns());
        scheme.tension.find_wet_walls(core);
        scheme.find_rates(core, 0.0);
        scheme.find_pressure(core, 0.0);
        scheme
    }

    /// Sorts particles, and what is kept of them between steps, by their cells.
    fn sort(&mut self, core: &mut Core) {
        let own =
            [&mut self.places, &mut self.rate, &mut self.earlier_rate, &mut self.drift, &mut self.missing];
        let mut columns: SmallVec<[&mut Vec<f64>; 13]> = SmallVec::from_iter(own);
        columns.extend(self.roughness.columns());
        columns.extend(self.of_walls.columns());
        columns.extend(self.common.iter_mut().flat_map(Common::columns));
        core.sort(&mut columns);
        self.tension.find_wet_walls(core);
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

    /// Finds accelerations, densities and their rates at the end of a step of the length `dt`, with
    /// velocities and densities predicted for it. The pressures of the particles become those of the
    /// predicted densities.
    fn find_rates(&mut self, core: &mut Core, dt: f64) {
        let n = core.particles.len();
        let mut predicted = std::mem::take(&mut core.spare);
        set_sum(&mut predicted, &core.particles.velocity, &core.acceleration, 0.5 * dt);
        self.predict_densities(core, dt);
        self.crowding.resize(n);
        self.filled.resize(n, 0.0);
        self.depth.resize(n, 0.0);
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
        let [of_walls, rate_of_walls] = self.of_walls.at_end();
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
            &mut self.depth,
            of_walls,
            rate_of_walls,
        ];
        self.missing.resize(n, 0.0);
        if closes_gaps(numbers) && core.steps.is_multiple_of(SURFACE_STEPS) {
            core.sum(&Missing::new(core), [], [&mut self.missing]);
        }
        self.tension.find(core);
        let mut rates = Rates::new(core, numbers, &predicted, &pressure, &self.excess, &self.missing, dt);
        rates.mean_filled = self.mean_filled;
        if core.wall().viscous_forces == ViscousForces::WithSpin {
            self.walls.find(core, |i| core.coverage(i));
        }
        let walls = &self.walls;
        let sums = self.viscosity.find(core, &predicted, |i| walls.near(i).map(|wall| wall.friction));
        rates.edges = Edges::find(core, &self.tension, &predicted, &mut self.edge_compression);
        rates.spin = sums.map(|sums| (sums, walls));
        if numbers.gradients == Gradients::Differences {
            match (rates.laminar > 0.0, rates.artificial > 0.0) {
                (true, true) => core.sum(&Differences::<true, true>(rates), fields, out),
                (true, false) => core.sum(&Differences::<true, false>(rates), fields, out),
                (false, true) => core.sum(&Differences::<false, true>(rates), fields, out),
                (false, false) => core.sum(&Differences::<false, false>(rates), fields, out),
            }
        } else {
            let (shifted, even) = (numbers.shifting > 0.0, sums_crowding(numbers, core));
            match (shifted, even, rates.laminar > 0.0, rates.artificial > 0.0) {
                (true, _, true, true) => core.sum(&Shifted::<true, true>(rates), fields, out),
                (true, _, true, false) => core.sum(&Shifted::<true, false>(rates), fields, out),
                (true, _, false, true) => core.sum(&Shifted::<false, true>(rates), fields, out),
                (true, _, false, false) => core.sum(&Shifted::<false, false>(rates), fields, out),
                (false, true, true, true) => core.sum(&Pairs::<true, true, true>(rates), fields, out),
                (false, true, true, false) => core.sum(&Pairs::<true, false, true>(rates), fields, out),
                (false, true, false, true) => core.sum(&Pairs::<false, true, true>(rates), fields, out),
                (false, true, false, false) => core.sum(&Pairs::<false, false, true>(rates), fields, out),
                (false, false, true, true) => core.sum(&Pairs::<true, true, false>(rates), fields, out),
                (false, false, true, false) => core.sum(&Pairs::<true, false, false>(rates), fields, out),
                (false, false, false, true) => core.sum(&Pairs::<false, true, false>(rates), fields, out),
                (false, false, false, false) => core.sum(&Pairs::<false, false, false>(rates), fields, out),
            }
        }
        if let Some(common) = self.common.as_mut().filter(|_| n > 0) {
            common.subtract_from(&mut self.crowding, &self.depth, core);
            self.mean_filled = self.filled.iter().sum::<f64>() / (n as f64 * core.parameters.rest_density);
        }
        core.acceleration = acceleration;
        core.particles.pressure = pressure;
        core.spare = predicted;
        core.settle_contacts();
        if dt > 0.0 {
            self.correct_densities(core, &places, &drift, dt);
        }
        if dt > 0.0 && core.boundary.any_moves() && closes_gaps(&self.numbers) {
            self.of_walls.lift(&core.parameters, &mut core.particles.density, dt);
        }
        self.of_walls.advance();
        self.found = [std::mem::replace(&mut self.places, places), std::mem::replace(&mut self.drift, drift)];
        self.last_dt = dt;
        core.pull(1.0);
        self.tension.act(core);
    }

    /// Finds the pressures of the predicted densities, and turns these densities into the excess that the
    /// sums read.
    fn find_excess(&mut self, core: &Core, pressure: &mut [f64]) {
        let (numbers, parameters) = (&self.numbers, &core.parameters);
        let even = sums_crowding(numbers, core);
        // where the sums do not include crowding, only differences of the excess matter, so the excess in a
        // fluid at rest is subtracted
        let (at_rest, from) = (at_rest(numbers, parameters, parameters.gravity), core.boundary.domain.min);
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
