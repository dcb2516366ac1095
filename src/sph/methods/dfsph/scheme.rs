//! The scheme of a divergence-free fluid, after Bender & Koschier (2017). The pressure that keeps the density
//! is found by iteration.
//!
//! ```text
//! v ← v + dt·(g + viscosity)
//! v ← v + dt·a(s)      s ≥ 0 so that dρ/dt ≤ (ρ₀ − ρ)/τ
//! x ← x + dt·v
//! ```
//!
//! with s = p/ρ², a(s)_i = −M_i[Σ m (s_i + s_j) ∇W + 2ρ₀ s_i ∇λ] and dρ_i/dt = Σ m (M_i v_i − M_j v_j)·∇W +
//! 2ρ₀ (M_i v_i)·∇λ.
//!
//! One solve does the work of their two. It demands a velocity free of divergence and, besides, that a
//! density that is off returns within a relaxation time τ (Baumgarte 1972). If a density had to be right
//! after a single step, as in their second solver, each of its small errors would become a speed: a fluid at
//! rest would simmer, and its pressure with it.
//!
//! Walls enter by λ, ∇λ and M = (1 − K)⁻¹: a pressure that is linear in space continues behind the wall. The
//! rate of density is the adjoint of that: a velocity that is linear in space continues behind the wall and
//! is mirrored at it. So the system to be solved is symmetric and has no negative eigenvalue for any vessel,
//! and its solution adds no energy. (Measured on a still column: with λ and ∇λ alone the pressure of the
//! first layer comes out 2.2 times too high; with the mirrored pressure but not the mirrored velocity the
//! column boils.)
//!
//! The reported pressure of a particle is G·ρ²s, because the sums make G·∇p of a pressure that is linear in
//! space (G = 0.98 in the depth of a fluid that has left the lattice). It is averaged over the relaxation
//! time τ, because the divergence of velocity that one step leaves is a pressure in the next: in a fluid at
//! rest single steps differ by a tenth, and only their sum is its weight.
//!
//! Invariant: the densities are those of the present positions.

use rayon::prelude::*;
use smallvec::{SmallVec, smallvec};

use super::super::{
    scheme::Scheme,
    shifting::{depth, restore_crowding, save_crowding, shift},
    tension::Tension,
};
use super::passes::{Constants, Densities, Drag, Push, Squeeze};
use super::walls::Walls;
use super::{ADVECTION, Dfsph};
use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::{CHUNK, Core, add_scaled},
    error::StepError,
    params::Parameters,
    particles::{Particles, Vectors},
};

/// Factor by which walls and disorder make the system stiffer than the even fluid of [`stiffness`].
const STIFFNESS: f64 = 1.5;

/// A particle whose factor is below this part of that in a full neighbourhood has no neighbours, and no
/// pressure is solved for.
const LONELY: f64 = 1e-3;

/// The relaxation time, in steps: the first where the fastest particle moves as far in a step as it may, the
/// second at least where nothing moves. Moving fluid loses its density step by step (with ten everywhere a
/// breaking dam is 0.5 % too dense in the mean, with four 0.3 %). At rest each correction is noise of the
/// pressure.
const RELAXATION_STEPS: [f64; 2] = [4.0, 10.0];

/// The least relaxation time at rest, in units of √(h/g), however short the steps are: the error of a whole
/// column returns at once, and with ten steps a column of eighty layers bursts at its start.
const RELAXATION_FALLS: f64 = 2.0;

/// The most steps of a relaxation time, for a gravity close to zero. Where a column would burst, steps are so
/// short that a relaxation time has some sixty of them.
const MOST_RELAXATION_STEPS: f64 = 100.0;

/// The scheme. It keeps the solver's answer between steps; the rest is working memory.
pub struct DivergenceFree {
    numbers: Dfsph,
    /// Specific pressure s = p/ρ².
    specific: Vec<f64>,
    /// The diagonal of the system: how much a unit of p/ρ² lowers the particle's own dρ/dt in a second, (1 −
    /// K)⁻¹(…)·(…) + Σ m²|∇W|².
    factor: Vec<f64>,
    /// G = −⅓ Σ V r·∇W + ⅓ tr K of each particle.
    spread: Vec<f64>,
    /// Rate of density dρ/dt.
    rate: Vec<f64>,
    /// Rate of density without pressure, plus the rate at which a density that is off returns.
    free: Vec<f64>,
    /// Acceleration a(s) by pressure.
    push: Vectors,
    /// Σ V ∇W + ∇λ, 1/m: the direction in which particles crowd; zero at the surface.
    crowding: Vectors,
    tension: Tension,
    /// M·v of each particle.
    completed: Vectors,
    walls: Walls,
    /// The last guess, without the momentum that was added to it.
    last: Vec<f64>,
    /// Greatest eigenvalue of the system over its diagonal: the inverse of a step that cannot overshoot.
    stiffness: f64,
    /// Sums of the errors and of the momentum's work, chunk by chunk.
    errors: Vec<[f64; 2]>,
    /// Iterations of the last step's solver.
    iterations: u32,
}

impl Scheme for DivergenceFree {
    fn step(&mut self, core: &mut Core, most: f64) -> Result<f64, StepError> {
        let dt = core.next_dt(most)?;
        self.find_other_accelerations(core);
        add_scaled(&mut core.particles.velocity, &core.acceleration, dt);
        self.keep_density(core, dt);
        core.move_obstacles(dt);
        core.drift(dt, shift(self.numbers.shifting, &self.crowding, core))?;
        self.settle(core, &mut []);
        core.check_finite(dt)?;
        Ok(dt)
    }

    /// Saves the answers of the last step. All else follows from the positions.
    fn save(&self, checkpoint: &mut Checkpoint) {
        checkpoint.set("specific pressure", self.specific.clone());
        checkpoint.set("stiffness", vec![self.stiffness]);
        save_crowding(&self.crowding, checkpoint);
    }

    fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.specific = checkpoint.of_particles("specific pressure")?;
        if let [stiffness] = checkpoint.get("stiffness")? {
            self.stiffness = *stiffness;
        }
        self.crowding = restore_crowding(checkpoint)?;
        Ok(())
    }

    fn densities<'a>(&'a self, core: &'a Core) -> &'a [f64] {
        &core.particles.density
    }

    fn bytes(&self) -> usize {
        let columns = [&self.specific, &self.factor, &self.spread, &self.rate, &self.free, &self.last];
        columns.map(|column| 8 * column.capacity()).iter().sum::<usize>()
            + self.push.bytes()
            + self.crowding.bytes()
            + self.tension.bytes()
            + self.completed.bytes()
            + self.walls.bytes()
    }

    fn iterations(&self) -> Option<u32> {
        Some(self.iterations)
    }
}

impl DivergenceFree {
    /// Makes the scheme of a fluid that is new, or that goes on from a state which will be restored.
    pub fn start(numbers: Dfsph, core: &mut Core, is_new: bool) -> Self {
        let n = core.particles.len();
        core.particles.density.resize(n, 0.0);
        core.particles.pressure.resize(n, 0.0);
        let mut scheme = Self {
            numbers,
            specific: vec![0.0; n],
            factor: vec![0.0; n],
            spread: vec![0.0; n],
            rate: vec![0.0; n],
            free: vec![0.0; n],
            push: Vectors::default(),
            crowding: Vectors::default(),
            tension: Tension::default(),
            completed: Vectors::default(),
            walls: Walls::default(),
            last: Vec::new(),
            stiffness: STIFFNESS * stiffness(core.parameters.support_radius / core.parameters.spacing()),
            errors: Vec::new(),
            iterations: 0,
        };
        scheme.push.resize(n);
        scheme.settle(core, &mut []);
        if is_new {
            scheme.relax(core);
        }
        scheme
    }

    /// Moves the particles of a start apart where they are too dense, above all at walls, to which the
    /// lattice does not fit: otherwise the first step would give them speeds. Their velocities stay.
    fn relax(&mut self, core: &mut Core) {
        /// Most rounds; the compression that is left then is small.
        const ROUNDS: usize = 40;
        let dt = core.parameters.force_dt(core.parameters.gravity.length().max(1e-3));
        let gravity = std::mem::take(&mut core.parameters.gravity);
        let mut velocity = core.particles.velocity.clone();
        let speed = std::mem::take(&mut core.speed);
        for _ in 0..ROUNDS {
            let rest = core.parameters.rest_density;
            let worst =
                core.particles.density.iter().fold(0.0, |worst: f64, rho| worst.max(rho / rest - 1.0));
            if worst < 2.0 * self.numbers.tolerance {
                break;
            }
            core.particles.velocity.components_mut().into_iter().for_each(|column| column.fill(0.0));
            self.keep_density(core, dt);
            // the first step will report a place at which an obstacle has no value
            if core.drift(dt, None).is_err() {
                break;
            }
            let [x, y, z] = velocity.components_mut();
            self.settle(core, &mut [x, y, z]);
            self.specific.fill(0.0);
        }
        (core.particles.velocity, core.speed) = (velocity, speed);
        core.parameters.gravity = gravity;
        core.acceleration.components_mut().into_iter().for_each(|column| column.fill(0.0));
        core.particles.pressure.fill(0.0);
    }

    /// Finds the order, walls, densities and factors for the present positions.
    fn settle(&mut self, core: &mut Core, kept: &mut [&mut Vec<f64>]) {
        let mut columns: SmallVec<[&mut Vec<f64>; 4]> = smallvec![&mut self.specific];
        columns.extend(kept.iter_mut().map(|column| &mut **column));
        core.sort(&mut columns);
        core.find_near();
        self.walls.find(core);
        let mut density = std::mem::take(&mut core.particles.density);
        let pass = Densities { constants: Constants::of(&core.parameters), walls: &self.walls };
        self.crowding.resize(density.len());
        let Vectors { x, y, z } = &mut self.crowding;
        self.spread.resize(density.len(), 0.0);
        core.sum(&pass, [], [&mut density, &mut self.factor, x, y, z, &mut self.spread]);
        core.particles.density = density;
    }

    /// Finds the accelerations by gravity, viscosity and surface tension.
    fn find_other_accelerations(&mut self, core: &mut Core) {
        let mut acceleration = std::mem::take(&mut core.acceleration);
        let g = core.parameters.gravity;
        let Vectors { x, y, z } = &mut acceleration;
        if core.parameters.viscosity > 0.0 {
            let Vectors { x: vx, y: vy, z: vz } = &core.particles.velocity;
            let pass = Drag {
                constants: Constants::of(&core.parameters),
                walls: &self.walls,
                velocity: &core.particles.velocity,
                kinematic: core.parameters.viscosity / core.parameters.rest_density,
                gravity: g,
            };
            core.sum(&pass, [&vx[..], vy, vz], [&mut x[..], y, z]);
        } else {
            x.fill(g.x);
            y.fill(g.y);
            z.fill(g.z);
        }
        core.acceleration = acceleration;
        core.pull();
        self.tension.act(core);
    }

    /// Changes velocities by pressure so that nothing is compressed, and what is too dense expands.
    fn keep_density(&mut self, core: &mut Core, dt: f64) {
        let rest = core.parameters.rest_density;
        let mut pressure = std::mem::take(&mut self.specific);
        let relaxation = relaxation_time(&core.parameters, core.speed, dt);
        // the compression to come without pressure; each iteration finds what s takes away
        self.find_rate_of(core, &core.particles.velocity, true);
        let mut free = std::mem::take(&mut self.free);
        for ((free, rate), rho) in free.iter_mut().zip(&self.rate).zip(&core.particles.density) {
            *free = (rho - rest) / relaxation + rate;
        }
        self.iterations = self.solve(core, &mut pressure, &free, dt, self.numbers.tolerance * rest / dt);
        self.free = free;
        add_scaled(&mut core.particles.velocity, &self.push, dt);
        add_scaled(&mut core.acceleration, &self.push, 1.0);
        let Particles { pressure: p, density, .. } = &mut core.particles;
        // until the relaxation time has passed, the mean is taken since the start
        let share = (dt / relaxation.min(core.time + dt)).min(1.0);
        for (((p, s), rho), g) in p.iter_mut().zip(&pressure).zip(density).zip(&self.spread) {
            *p += share * ((1.0 + depth(*g) * (g - 1.0)) * s * *rho * *rho - *p);
        }
        self.specific = pressure;
    }

    /// Finds s ≥ 0 such that the rate of density `free` + dt·(rate of a(s)) vanishes where s > 0 and is not
    /// positive elsewhere, with a mean error of at most `tolerance`. Leaves a(s) in `push`, and returns the
    /// number of iterations.
    ///
    /// The method is projected gradients with momentum (Nesterov 1983), scaled by the diagonal, and restarted
    /// when the momentum leads uphill (O'Donoghue & Candès 2015). It takes some √κ iterations where Jacobi's
    /// method needs κ.
    fn solve(&mut self, core: &Core, pressure: &mut [f64], free: &[f64], dt: f64, tolerance: f64) -> u32 {
        let least = LONELY * Constants::of(&core.parameters).full_factor;
        let n = pressure.len() as f64;
        self.last.clear();
        self.last.extend_from_slice(pressure);
        let (mut iteration, mut momentum, mut best) = (0, 0.0, f64::INFINITY);
        loop {
            self.find_push(core, pressure);
            let push = std::mem::take(&mut self.push);
            self.find_rate_of(core, &push, false);
            self.push = push;
            let [error, uphill] = self.find_errors(pressure, free, dt, least);
            let mean = error / n;
            let done = (mean <= tolerance && iteration > 0) || iteration >= self.numbers.most_iterations;
            if done || !mean.is_finite() {
                break;
            }
            let too_long = mean > 2.0 * best;
            if too_long {
                // steps are too long for this neighbourhood
                self.stiffness *= 1.3;
            }
            best = if too_long { mean } else { best.min(mean) };
            let begin_anew = too_long || uphill > 0.0;
            let beta = if begin_anew { 0.0 } else { momentum / (momentum + 3.0) };
            momentum = if begin_anew { 0.0 } else { momentum + 1.0 };
            self.guess_again(pressure, free, dt, least, beta);
            iteration += 1;
        }
        iteration
    }

    /// The sum of the errors at a guess, and a second sum that is above zero if momentum leads uphill from
    /// it.
    fn find_errors(&mut self, pressure: &[f64], free: &[f64], dt: f64, least: f64) -> [f64; 2] {
        let scale = 1.0 / (dt * self.stiffness);
        self.rate
            .par_chunks(CHUNK)
            .zip(free.par_chunks(CHUNK))
            .zip(self.factor.par_chunks(CHUNK))
            .zip(pressure.par_chunks(CHUNK))
            .zip(self.last.par_chunks(CHUNK))
            .map(|((((rate, free), factor), s), last)| {
                let mut sums = [0.0; 2];
                for k in 0..rate.len() {
                    if factor[k] > least {
                        let error = free[k] + dt * rate[k];
                        let next = projected(scale, s[k], error, factor[k]);
                        // no pressure can end an expansion, so it is no error
                        sums[0] += if s[k] > 0.0 { error.abs() } else { error.max(0.0) };
                        sums[1] += factor[k] * (s[k] - next) * (next - last[k]);
                    }
                }
                sums
            })
            .collect_into_vec(&mut self.errors);
        self.errors.iter().fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d])
    }

    /// Takes a step along the gradient, and repeats the part `beta` of the last step.
    fn guess_again(&mut self, pressure: &mut [f64], free: &[f64], dt: f64, least: f64, beta: f64) {
        let scale = 1.0 / (dt * self.stiffness);
        pressure
            .par_chunks_mut(CHUNK)
            .zip(self.last.par_chunks_mut(CHUNK))
            .zip(self.rate.par_chunks(CHUNK))
            .zip(free.par_chunks(CHUNK))
            .zip(self.factor.par_chunks(CHUNK))
            .for_each(|((((s, last), rate), free), factor)| {
                for k in 0..s.len() {
                    if factor[k] > least {
                        let error = free[k] + dt * rate[k];
                        let next = projected(scale, s[k], error, factor[k]);
                        s[k] = (next + beta * (next - last[k])).max(0.0);
                        last[k] = next;
                    } else {
                        (s[k], last[k]) = (0.0, 0.0);
                    }
                }
            });
    }

    /// Finds the acceleration a(s) by pressure.
    fn find_push(&mut self, core: &Core, pressure: &[f64]) {
        let pass = Push { constants: Constants::of(&core.parameters), walls: &self.walls, pressure };
        let Vectors { x, y, z } = &mut self.push;
        core.sum(&pass, [pressure], [&mut x[..], y, z]);
    }

    /// Finds the dρ/dt of a velocity, with the motion of the walls, or of an acceleration in a second,
    /// without it.
    fn find_rate_of(&mut self, core: &Core, velocity: &Vectors, with_walls: bool) {
        self.walls.complete(velocity, &mut self.completed);
        let pass = Squeeze {
            constants: Constants::of(&core.parameters),
            walls: &self.walls,
            completed: &self.completed,
            with_walls,
        };
        let Vectors { x, y, z } = &self.completed;
        core.sum(&pass, [&x[..], y, z], [&mut self.rate]);
    }
}

/// The relaxation time, s, in which a density that is off returns, after a step of the length `dt` with this
/// greatest speed. Reported pressures are averaged over the same time.
fn relaxation_time(parameters: &Parameters, speed: f64, dt: f64) -> f64 {
    let [moving, at_rest] = RELAXATION_STEPS;
    let fall = (parameters.support_radius / parameters.gravity.length()).sqrt();
    let falls =
        if fall.is_finite() { (RELAXATION_FALLS * fall).min(MOST_RELAXATION_STEPS * dt) } else { 0.0 };
    let slow = falls.max(at_rest * dt);
    let courant = (dt * speed / (ADVECTION * parameters.spacing())).min(1.0);
    slow + (moving * dt - slow) * courant
}

/// The guess after a step along the gradient, not below zero.
#[inline]
fn projected(scale: f64, s: f64, error: f64, factor: f64) -> f64 {
    (s + scale * error / factor).max(0.0)
}

/// Greatest eigenvalue over diagonal in an even fluid with `ratio` spacings per support radius. It belongs to
/// waves of pressure of the length 1.65 h, by quadrature of (∫ ∇W sin kx)²·ρ/m / ∫|∇W|².
fn stiffness(ratio: f64) -> f64 {
    1.775 * (0.5 * ratio).powi(3)
}
