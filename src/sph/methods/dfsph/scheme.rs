//! The scheme of a divergence-free fluid, after Bender & Koschier (2017). The pressures that keep the density
//! are found by iteration.
//!
//! ```text
//! v ← v + dt·(½·(g + tension) + viscosity)
//! v ← v + dt·a(s)          s ≥ 0 so that dρ/dt ≤ −D/τ, or ≤ (ρ₀ − ρ)/τ where ρ < ρ₀; see `full` if there is no surface
//! D ← D + dt·(the part of dρ/dt that the solver left)
//! v ← v + ½·dt·(g + tension + a(s̄))
//! x ← x + dt·v + b(s′)     s′ ≥ 0 so that ρ ≤ ρ₀ at the new place
//! v ← v + the part of b(s′)/dt that undoes this motion
//! ```
//!
//! with the lower of the last pressure and its mean as s̄ ([`Ahead`]): the fluid follows its curved paths to second
//! order.
//!
//! Here s = p/ρ². In the paper the second solver corrects the density by changing velocities, so each small
//! error of a density becomes a speed: a fluid at rest simmers, and so does its pressure. Here the second
//! solver changes places, and the displacement is not part of the velocity.
//!
//! But then an error left by an unfinished solve no longer appears in the density, and the pressure cannot
//! correct it. A column could sink endlessly within the tolerance while displacements lift it (a breaking dam
//! gained 8 % of its energy in this way). So each particle remembers the error as a debt D of density, and
//! the pressure pays it back within τ (Baumgarte 1972). The tolerance of this solve is that of the density
//! over τ. A part of the density that displacements take away is added to the debt, see [`OWED`]. No particle owes more than
//! its present density. Velocities that
//! displacements undo are taken away, see [`Arrest`]. Where the fluid fills its vessel, the sums of forces are exact for
//! flows that are linear in space, see [`corrected`](super::corrected), and neither is done.
//!
//! Both systems count the part of the kernel that is missing before a free surface as fluid
//! ([`free_surface`](super::super::free_surface)), so that the outermost particles keep the same distance as
//! those in the depth.
//!
//! The two systems treat walls differently.
//!
//! Forces: a(s)_i = −M_i[Σ m (s_i + s_j) ∇W + 2ρ₀ s_i ∇λ] and dρ_i/dt = Σ m (w_i − w_j)·∇W + 2ρ₀
//! (w_i·∇λ − sweep) with M = (1 − K)⁻¹ and w = r + M·(v − r). A pressure that is linear in space continues
//! behind the wall, and a velocity is mirrored there, as seen from the wall. Across walls r is their
//! velocity. Along walls, where the fluid slips, r is the velocity of the fluid as a whole, so that the
//! disorder of M does not stir a fluid that moves past a wall ([`Rigid`]). Pressure changes w by M·a, so the
//! system is symmetric and has no negative eigenvalue for any vessel, and its solution adds no energy. (With
//! r = 0 water that moves with its tank at 5 m/s is stirred to 0.9 m/s. On a still column, with λ and ∇λ
//! alone, the pressure of the first layer comes out 2.2 times too high. In a narrow vessel all pressures are
//! too high by 20 %.)
//!
//! Places: ρ_i = Σ m W + ρ₀ B with the barrier B of [`OfFace`](crate::sph::walls::OfFace), which equals a
//! lattice's part where a fluid at rest touches the wall. b(s′) follows from the derivative of B, which is
//! exact for each face. The solve therefore reaches the density that is found next, up to the square of the
//! displacement. (With the system of forces a breaking dam keeps three times the tolerance.) The part missing
//! before a free surface is that at the present places, so near a surface the density also differs by the
//! change of this part in a step.
//!
//! In both systems a fluid that its tension rules, in a box, has images in its walls instead
//! ([`mirrored`](super::mirrored)).
//!
//! Artificial viscosity of rough motion ([`roughness`]) damps the noise of the particles' disorder, which
//! nothing else would damp in a fluid without viscosity. It acts along the lines between particles, and so does
//! the laminar viscosity unless it counts ([`SpinViscosity`]). Both conserve momentum, and angular
//! momentum but for the couples of walls.
//!
//! The pressure of a particle is G·ρ²s, because for a pressure that is linear in space the sums give G·∇p (G
//! = 0.98 in the depth of a fluid that has left the lattice). It is averaged over τ, because the divergence
//! of velocity that one step leaves becomes a pressure in the next. The reported pressure is that of the
//! field around the particle ([`Field`]). The pressures that keep the densities of neighbouring particles
//! differ by a fifth of a layer's weight, even in still water, where these differences balance each other.
//! Where particles move fast, reported pressures are averaged over a shorter time. Otherwise water that runs
//! up a wall would carry the pressure of its impact along, and the mean over the wall would be twice the
//! force on it.
//!
//! Invariant: the densities are those of the present positions.

#[cfg(test)]
mod gap_tests;
mod pressure;
#[cfg(test)]
mod symmetry_tests;

use smallvec::{SmallVec, smallvec};

use super::super::{
    bodies_of_fluid::bodies,
    free_surface::FreeSurface,
    images::WithImages,
    roughness::{self, Roughness},
    scheme::{Scheme, Start},
    shifting::{restore_crowding, save_crowding, shift},
    tension::Tension,
    viscosity::SpinViscosity,
};
use super::ahead::Ahead;
use super::arrest::Arrest;
use super::carried::Carried;
use super::gaps::Gaps;
use super::hydrostatic;
use super::pace::Pace;
use super::passes::{Constants, Continuation, Densities, Drag};
use super::relaxation::{RELAXATION_STEPS, relaxation_time};
use super::rigid::Rigid;
use super::solver::{Begin, Errors, Goal, RateOf, Solver};
use super::walls::Walls;
use super::{Dfsph, NOMINAL_SOUND, full};
use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::Core,
    error::StepError,
    kernel::Wendland,
    params::Parameters,
    particles::{Vectors, add_scaled},
    reaction::Reaction,
};

/// Factors of the number of iterations and of the tolerance for a solve that begins without any pressure, as
/// in the first step, where the whole weight of a column must be found. Without them the pressure of a column
/// of sixty layers comes too late, and the column falls and bursts.
const FIRST_ITERATIONS: u32 = 30;
const FIRST_TOLERANCE: f64 = 0.1;

/// Part of the density taken away by displacements that becomes a debt. Without it a column of forty layers,
/// ten wide, sinks at 0.3 m/s with a velocity in which the system of forces sees no divergence, and
/// displacements cannot hold it. With all of it, and with a third, a column of eighty layers, eight wide,
/// bursts at its start.
pub(super) const OWED: f64 = 0.6;

/// The scheme. It keeps pressures and debts between steps; the rest is working memory.
pub struct DivergenceFree {
    pub(super) numbers: Dfsph,
    /// Finds pressures that change velocities; its answer is p/ρ².
    forces: Solver,
    /// Finds pressures that displace particles.
    places: Solver,
    /// The density, kg/m³, that each particle would have gained by the errors that the solver of forces left.
    pub(super) debt: Vec<f64>,
    /// The pressure that each particle bears, Pa, averaged over the relaxation time.
    pub(super) own_pressure: Vec<f64>,
    /// What the last step gave of pressure in advance.
    ahead: Ahead,
    /// The acceleration of the fluid in a sealed vessel as a whole.
    carried: Carried,
    arrest: Arrest,
    gaps: Gaps,
    /// Stiffness of a lattice of these particles, see [`Wendland::lattice_stiffness`].
    stiffness: f64,
    /// G = −⅓ Σ V r·∇W + ⅓ tr K of each particle.
    spread: Vec<f64>,
    /// Σ V ∇W + ∇λ, 1/m; zero at the surface.
    crowding: Vectors,
    /// Right-hand side of a solve: a rate of density, or an excess of density. Between the two solves it
    /// holds the pressures that the particles bear in this step, Pa.
    free: Vec<f64>,
    /// Pressures around the particles in this step, Pa.
    field: Vec<f64>,
    tension: Tension,
    viscosity: SpinViscosity,
    roughness: Roughness,
    pace: Pace,
    /// Displacements of this step that are not part of the velocity, m.
    pub(super) displacement: Vectors,
    /// Velocities including the drift by shifting, m/s.
    pub(super) drift: Vectors,
    /// Densities with the barriers of the walls and the part missing before a free surface, kg/m³. They must
    /// not exceed the rest density.
    pub(super) loaded: Vec<f64>,
    pub(super) walls: Walls,
    /// The motion of the fluid as a whole at the beginning of the step.
    whole: Rigid,
    /// The part of kernels that is missing before a free surface.
    surface: FreeSurface,
    /// Iterations of the last step's solvers.
    pub(super) iterations: u32,
    /// Length of the last step, s; zero at the start.
    last_dt: f64,
    /// Whether any body of a fluid with a surface has none itself.
    any_closed: bool,
    /// The room around the fluid of a sealed vessel in which something moves, over its volume, at the first look.
    room_at_start: Option<f64>,
}

/// Greatest factor of a force that depends on the place. A step may be a short remainder before a frame; the
/// force of half a usual step would then need a pressure a hundred times as large.
const MOST_CARRIED: f64 = 2.0;

/// Name of the length of the last step in a checkpoint.
const LAST_STEP: &str = "last step";

/// Name of whether there are closed bodies in a checkpoint.
const CLOSED: &str = "closed bodies";

/// Name of the room at the first look in a checkpoint.
const ROOM: &str = "room at the start";

/// Steps from one look for closed bodies to the next.
const LOOK: u64 = 16;

impl Scheme for DivergenceFree {
    fn step(&mut self, core: &mut Core, most: f64) -> Result<f64, StepError> {
        core.pressure_dt = self.pressure_dt(core).min(self.approach_dt(core));
        let dt = core.next_dt(most)?;
        self.gaps.find(core, &self.walls, relaxation_time(&core.parameters, core.speed, dt));
        // before gravity pulls: the velocity that gravity adds in a step and pressure takes back is no motion
        // along walls
        self.whole = Rigid::of(&core.particles.position, &core.particles.velocity);
        self.find_other_accelerations(core, dt);
        add_scaled(&mut core.particles.velocity, &core.acceleration, dt);
        if self.last_dt > 0.0 {
            self.ahead.hold_back(core, dt);
        }
        self.keep_density(core, dt);
        // in a full vessel displacements undo above all that single particles pass each other, which nothing owes
        let is_full = core.parameters.fills_vessel;
        let owed = if is_full { 0.0 } else { OWED };
        if self.find_displacements(core, dt, owed) && !is_full {
            self.arrest.find(core, (&mut self.places, &self.walls), &self.free, &self.loaded);
            self.arrest.take(core, &self.walls, dt, &mut self.displacement);
        }
        core.move_obstacles(dt);
        core.drift(dt, Some((&self.displacement, 1.0 / dt)))?;
        self.carried.act(core, 0.5 * dt);
        self.carried.expect(&self.ahead.push);
        self.settle(core, &mut []);
        self.last_dt = dt;
        core.check_finite(dt)?;
        if hydrostatic::has_opened(core, &mut self.room_at_start) {
            (core.parameters.is_sealed, core.parameters.fills_vessel) = (false, false);
            self.carried.end();
            self.any_closed = true;
        }
        Ok(dt)
    }

    /// Saves the answer of the last step. All else follows from the positions.
    fn save(&self, checkpoint: &mut Checkpoint) {
        checkpoint.set("specific pressure", self.forces.s.clone());
        checkpoint.set("debt", self.debt.clone());
        checkpoint.set("own pressure", self.own_pressure.clone());
        self.ahead.save(checkpoint);
        self.carried.save(checkpoint);
        checkpoint.set("stiffness", vec![self.forces.stiffness, self.places.stiffness]);
        checkpoint.set(LAST_STEP, vec![self.last_dt]);
        checkpoint.set(CLOSED, vec![f64::from(u8::from(self.any_closed))]);
        checkpoint.set(ROOM, self.room_at_start.into_iter().collect());
        save_crowding(&self.crowding, checkpoint);
        self.roughness.save(checkpoint);
        self.pace.save(checkpoint);
    }

    fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.forces.s = checkpoint.of_particles("specific pressure")?;
        self.debt = checkpoint.of_particles("debt")?;
        self.own_pressure = checkpoint.of_particles("own pressure")?;
        self.ahead.restore(checkpoint)?;
        self.carried.restore(checkpoint)?;
        if let [forces, places] = checkpoint.get("stiffness")? {
            (self.forces.stiffness, self.places.stiffness) = (*forces, *places);
        }
        self.last_dt = match checkpoint.get(LAST_STEP)? {
            [last_dt] if last_dt.is_finite() && *last_dt >= 0.0 => *last_dt,
            _ => return Err(CheckpointError::Column(LAST_STEP.into())),
        };
        self.room_at_start = checkpoint.get(ROOM)?.first().copied();
        self.any_closed = matches!(checkpoint.get(CLOSED)?, [closed] if *closed != 0.0);
        self.crowding = restore_crowding(checkpoint)?;
        self.roughness.restore(checkpoint)?;
        self.pace.restore(checkpoint)
    }

    fn densities<'a>(&'a self, core: &'a Core) -> &'a [f64] {
        &core.particles.density
    }

    fn bytes(&self) -> usize {
        let columns = [&self.debt, &self.own_pressure, &self.spread, &self.free, &self.field, &self.loaded];
        let vectors = [&self.crowding, &self.displacement, &self.drift];
        columns.map(|column| 8 * column.capacity()).iter().sum::<usize>()
            + vectors.map(Vectors::bytes).iter().sum::<usize>()
            + self.forces.bytes()
            + self.places.bytes()
            + self.tension.bytes()
            + self.viscosity.bytes()
            + self.roughness.bytes()
            + self.walls.bytes()
            + self.ahead.bytes()
            + self.carried.bytes()
            + self.arrest.bytes()
            + self.gaps.bytes()
    }

    fn iterations(&self) -> Option<u32> {
        Some(self.iterations)
    }
}

impl Start for Dfsph {
    fn start(self, core: &mut Core, is_new: bool) -> Box<dyn Scheme> {
        let mut scheme = DivergenceFree::at(self, core);
        if is_new {
            scheme.settle_in(core);
        }
        Box::new(scheme)
    }
}

impl DivergenceFree {
    /// Makes the scheme for the present positions.
    pub(super) fn at(numbers: Dfsph, core: &mut Core) -> Self {
        let n = core.particles.len();
        core.particles.density.resize(n, 0.0);
        core.particles.pressure.resize(n, 0.0);
        let mut scheme = Self {
            numbers,
            forces: Solver::new(Continuation::Linear, &core.parameters, n),
            places: Solver::new(Continuation::Barrier, &core.parameters, n),
            debt: vec![0.0; n],
            own_pressure: vec![0.0; n],
            ahead: Ahead::nothing(n),
            carried: Carried::at_rest(core),
            arrest: Arrest::default(),
            gaps: Gaps::default(),
            stiffness: 0.0,
            spread: vec![0.0; n],
            crowding: Vectors::default(),
            free: Vec::new(),
            field: Vec::new(),
            tension: Tension::default(),
            viscosity: SpinViscosity::default(),
            roughness: Roughness::of(&core.particles.velocity, true),
            pace: Pace::at_start(core),
            displacement: Vectors::default(),
            drift: Vectors::default(),
            loaded: vec![0.0; n],
            walls: Walls::default(),
            whole: Rigid::default(),
            surface: FreeSurface::default(),
            iterations: 0,
            last_dt: 0.0,
            any_closed: false,
            room_at_start: None,
        };
        scheme.find_lattice(&core.parameters);
        scheme.settle(core, &mut []);
        scheme
    }

    /// Finds the quantities that depend on the number of spacings per support radius.
    pub(super) fn find_lattice(&mut self, parameters: &Parameters) {
        let ratio = parameters.support_radius / parameters.spacing();
        self.stiffness = Wendland::lattice_stiffness(ratio).max(0.0);
        self.surface = FreeSurface::of_lattice(ratio);
    }

    /// Finds the order, walls, densities and factors for the present positions.
    pub(super) fn settle(&mut self, core: &mut Core, kept: &mut [&mut Vec<f64>]) {
        let mut columns: SmallVec<[&mut Vec<f64>; 8]> =
            smallvec![&mut self.forces.s, &mut self.debt, &mut self.own_pressure, &mut self.ahead.s];
        columns.extend(self.roughness.columns());
        columns.extend(self.carried.columns());
        columns.extend(kept.iter_mut().map(|column| &mut **column));
        core.sort(&mut columns);
        core.find_near();
        self.walls.give_back_mirrors();
        self.tension.find_wet_walls(core);
        self.walls.find(core, self.tension.mirrors());
        let mut density = std::mem::take(&mut core.particles.density);
        let (constants, walls) = (Constants::of(&core.parameters), &self.walls);
        let pass = Densities { constants, surface: &self.surface, walls };
        self.spread.resize(density.len(), 0.0);
        self.crowding.resize(density.len());
        let Vectors { x, y, z } = &mut self.crowding;
        let [linear, barrier] = [&mut self.forces.factor, &mut self.places.factor];
        self.loaded.resize(density.len(), 0.0);
        let out = [&mut self.loaded[..], linear, barrier, x, y, z, &mut self.spread, &mut density];
        match self.walls.mirrors() {
            Some(mirrors) => core.sum(&WithImages::new(pass, mirrors), mirrors.columns_after([]), out),
            None => core.sum(&pass, [], out),
        }
        core.particles.density = density;
    }

    /// Finds the accelerations by gravity, viscosity and surface tension.
    fn find_other_accelerations(&mut self, core: &mut Core, dt: f64) {
        let mut acceleration = std::mem::take(&mut core.acceleration);
        let g = core.parameters.pull();
        let Vectors { x, y, z } = &mut acceleration;
        let parameters = &core.parameters;
        let artificial = roughness::factor(
            self.numbers.artificial_viscosity,
            NOMINAL_SOUND * self.pace.follow(core),
            parameters.support_radius,
            dt,
        );
        let kinematic = parameters.viscosity / parameters.rest_density;
        if kinematic > 0.0 || artificial > 0.0 {
            let (constants, velocity) = (Constants::of(parameters), &core.particles.velocity);
            let (rough, smooth) = self.roughness.split(velocity);
            let fields = [&velocity.x[..], &velocity.y, &velocity.z, &rough.x, &rough.y, &rough.z];
            let out = [&mut x[..], y, z, &mut smooth.x, &mut smooth.y, &mut smooth.z];
            let (walls, reaction) = (&self.walls, Reaction::of(core, dt));
            let spin = self.viscosity.find(core, velocity, |i| walls.near(i).map(|(wall, _)| wall.friction));
            macro_rules! drag {
                ($laminar:literal, $artificial:literal) => {{
                    let pass = Drag::<$laminar, $artificial> {
                        constants,
                        walls,
                        velocity,
                        kinematic,
                        artificial,
                        gravity: g,
                        spin,
                        reaction,
                    };
                    core.sum(&pass, fields, out);
                }};
            }
            match (kinematic > 0.0, artificial > 0.0) {
                (true, true) => drag!(true, true),
                (true, false) => drag!(true, false),
                (false, _) => drag!(false, true),
            }
        } else {
            x.fill(g.x);
            y.fill(g.y);
            z.fill(g.z);
        }
        core.acceleration = acceleration;
        // Under a force that changes with the place, velocities are those of the middle of a step, and the
        // force advances them from the middle of the last step. Steps differ in length as the fluid slows
        // down and falls again: if the force acted for the whole of each step, a ball of water that swings
        // through the middle of a trap would lose a tenth of its energy in three periods. (After uniform
        // gravity velocities are those of the end of a step, whatever its length.) Surface tension is such a force,
        // too.
        self.tension.find(core);
        let tension = self.tension.force(&core.parameters);
        self.ahead.pull(core, tension, (0.5 * (self.last_dt + dt) / dt).min(MOST_CARRIED));
    }

    /// Changes velocities by pressure so that nothing is compressed beyond the rest density.
    fn keep_density(&mut self, core: &mut Core, dt: f64) {
        let rest = core.parameters.rest_density;
        // what walls press together cannot pay its debt; a particle that escaped with thrice its density as a debt burst away
        // from the few that it met
        self.debt.iter_mut().zip(&self.loaded).for_each(|(debt, density)| *debt = debt.min(*density));
        let relaxation = relaxation_time(&core.parameters, core.speed, dt);
        let is_corrected = core.parameters.fills_vessel && self.walls.mirrors().is_none();
        self.forces.correct(core, &self.walls, is_corrected);
        // the compression without pressure; each iteration finds how much of it s takes away
        self.forces.find_rate_of(core, &self.walls, &core.particles.velocity, RateOf::Velocity(&self.whole));
        self.gaps.take(core, (&mut self.forces, &self.walls), &self.whole, dt);
        let found = (&self.forces.rate[..], &self.loaded[..], &self.debt[..]);
        // particles that have a wall of a spacing between them belong to two bodies
        let bodies = core.parameters.fills_vessel.then(|| bodies(core, core.parameters.spacing()));
        if let Some(bodies) = &bodies {
            let spacing = core.parameters.spacing();
            let (position, velocity) = (&core.particles.position, &core.particles.velocity);
            let motion = |i| (velocity.get(i) - self.whole.at(position.get(i))).length() / spacing;
            full::lower(&mut self.forces.s, bodies);
            full::find_unwanted(&mut self.free, bodies, found, motion, relaxation);
        } else {
            let (rates, densities, debts) = found;
            let unwanted = |((rate, rho), debt): ((&f64, &f64), &f64)| {
                rate + ((rho - rest).min(0.0) + debt) / relaxation
            };
            self.free.clear();
            self.free.extend(rates.iter().zip(densities).zip(debts).map(unwanted));
            self.keep_closed_volumes(core);
        }
        // The error that a step leaves becomes a debt, which the next steps pay back. Even if every step
        // leaves one, the debt is at most eight tolerances. Only positions guarantee the density.
        let mut goal = Goal {
            tolerance: RELAXATION_STEPS * self.numbers.tolerance * rest / relaxation,
            most_iterations: self.numbers.most_iterations,
        };
        if self.forces.s.iter().all(|s| *s == 0.0) {
            goal.tolerance *= FIRST_TOLERANCE;
            goal.most_iterations = goal.most_iterations.saturating_mul(FIRST_ITERATIONS);
        }
        self.iterations = self.forces.solve(core, &self.walls, &self.free, dt, goal, Begin::Last);
        let hydrostatic = self.find_hydrostatic(core, bodies, dt, relaxation);
        self.note_walls(core, hydrostatic.as_ref(), dt);
        for ((free, rate), debt) in self.free.iter().zip(&self.forces.rate).zip(&mut self.debt) {
            let left = free + dt * rate;
            *debt = (*debt + dt * (left - *debt / relaxation)).max(0.0);
        }
        add_scaled(&mut core.particles.velocity, &self.forces.push, dt);
        add_scaled(&mut core.acceleration, &self.forces.push, 1.0);
        self.bear(core, dt, relaxation);
        // what is given in advance keeps densities to second order, of which a rate of density knows nothing
        self.drift.clone_from(&core.particles.velocity);
        if self.last_dt > 0.0 {
            self.ahead.give(core, (&mut self.forces, &self.walls), dt);
        }
        add_scaled(&mut core.acceleration, &self.ahead.push, 0.5);
        self.report_pressure(core, dt, relaxation, hydrostatic.as_ref());
        self.carried.act(core, 0.5 * dt);
    }

    /// Lets bodies of fluid without a surface keep their volume. Whether there are any is looked for now and then.
    fn keep_closed_volumes(&mut self, core: &Core) {
        if !(self.any_closed || core.steps.is_multiple_of(LOOK)) {
            return;
        }
        let bodies = bodies(core, core.parameters.spacing());
        let closed = full::closed(&bodies, &self.spread);
        self.any_closed = closed.contains(&true);
        if self.any_closed {
            full::keep_volumes(&mut self.free, &mut self.forces.s, &bodies, &closed);
        }
    }

    /// Finds the displacements of a step of the length dt: those by shifting, and those that keep densities
    /// at the new places from exceeding the rest density. The part `owed` of the density that the latter take
    /// away becomes a debt. The velocities are those in `drift`. Returns whether densities had to be kept.
    pub(super) fn find_displacements(&mut self, core: &Core, dt: f64, owed: f64) -> bool {
        let shifting = self.numbers.shifting_in(core.parameters.fills_vessel);
        if let Some((crowding, factor)) = shift(shifting, &self.crowding, core) {
            add_scaled(&mut self.drift, crowding, factor);
        }
        let by_others = (&self.forces.push, self.tension.force(&core.parameters));
        self.ahead.fall_less(core, by_others, &mut self.drift, -0.5 * dt);
        self.places.find_rate_of(core, &self.walls, &self.drift, RateOf::Velocity(&self.whole));
        let rest = core.parameters.rest_density;
        self.free.clear();
        let densities = &self.loaded;
        self.free.extend(self.places.rate.iter().zip(densities).map(|(rate, rho)| rho - rest + dt * rate));
        let goal =
            Goal { tolerance: self.numbers.tolerance * rest, most_iterations: self.numbers.most_iterations };
        let mut errors = Errors::default();
        self.free.iter().for_each(|excess| errors.count(excess.max(0.0), goal));
        let is_kept = errors.reach(goal, self.free.len());
        if is_kept {
            self.displacement.resize(self.free.len());
            self.displacement.components_mut().into_iter().for_each(|column| column.fill(0.0));
        } else {
            self.iterations += self.places.solve(core, &self.walls, &self.free, 1.0, goal, Begin::Nothing);
            self.displacement.clone_from(&self.places.push);
            for ((debt, excess), rate) in self.debt.iter_mut().zip(&self.free).zip(&self.places.rate) {
                let left = (excess + rate).max(0.0);
                *debt += owed * (excess.max(0.0) - left).max(0.0);
            }
        }
        if let Some((crowding, factor)) = shift(shifting, &self.crowding, core) {
            add_scaled(&mut self.displacement, crowding, factor * dt);
        }
        let by_others = (&self.forces.push, self.tension.force(&core.parameters));
        self.ahead.fall_less(core, by_others, &mut self.displacement, -0.5 * dt * dt);
        !is_kept
    }
}
