//! The simulation: its state is checked at the start, advanced by steps, and measured.
//!
//! Invariant: between steps, positions, velocities, densities, pressures and accelerations belong to one
//! instant, and particles lie in the order of the columns.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;

use crate::geom::Aabb;

use super::scales::Slip;
use super::{
    VectorField, VectorOfTime,
    audit::{Audit, Finding},
    checkpoint::Checkpoint,
    contacts::Contacts,
    core::{Core, first_non_finite},
    error::{SetupError, StepError},
    methods::{Scheme, start},
    params::Parameters,
    particles::{Particles, Vectors},
    pass::Pass,
    plan::plan,
    probes::{Gauge, Probe},
    stats::Stats,
    walls::{Boundary, BroadPhase, Maps, Obstacle},
};

/// Distance from an obstacle at which particles stop, over the support radius.
const CLEARANCE: f64 = 1e-6;

/// A fluid in a box with obstacles.
pub struct Simulation {
    core: Core,
    scheme: Box<dyn Scheme>,
    audit: Audit,
}

/// Name of the audit's memory in a checkpoint.
const AUDIT: &str = "audit";

/// Name of the mass of a particle in a checkpoint. It may differ from that of the scene, so that the fluid
/// has the mass of its shape.
const MASS: &str = "particle mass";

/// Name of the packing in a checkpoint.
const PACKING: &str = "packing";
/// Name of what says whether a full vessel will stay full.
const SEALED: &str = "sealed";

/// Name of whether the fluid fills its vessel, 1 or 0, in a checkpoint.
const FILLS_VESSEL: &str = "fills its vessel";

impl Simulation {
    /// Checks the input and finds the densities and forces of the first instant.
    ///
    /// # Errors
    /// [`SetupError`] names the first finding that makes a run meaningless.
    pub fn new(
        parameters: Parameters,
        particles: Particles,
        domain: Aabb,
        obstacles: Vec<Obstacle>,
    ) -> Result<Self, SetupError> {
        Self::at(parameters, particles, domain, obstacles, None)
    }

    /// The simulation at an instant: the number of steps taken, and the time, s.
    fn at(
        mut parameters: Parameters,
        particles: Particles,
        domain: Aabb,
        obstacles: Vec<Obstacle>,
        instant: Option<(u64, f64)>,
    ) -> Result<Self, SetupError> {
        let (steps, time) = instant.unwrap_or((0, 0.0));
        parameters.validate().map_err(SetupError::Parameter)?;
        parameters.sticks |= obstacles.iter().any(|obstacle| obstacle.slip == Slip::No);
        let clearance = CLEARANCE * parameters.support_radius;
        let broad_phase = BroadPhase::unknown(obstacles.len());
        let mut boundary = Boundary {
            domain,
            wall_restitution: parameters.wall_restitution,
            wall_friction: parameters.wall_friction,
            slip: parameters.slip,
            obstacles,
            during: Vec::new(),
            time: 0.0,
            step: 0.0,
            clearance,
            maps: Maps::default(),
            broad_phase,
        };
        boundary.move_to(time, time);
        check_setup(&boundary, &particles)?;
        let mut core = Core::new(parameters, boundary, particles);
        (core.steps, core.time) = (steps, time);
        let scheme = start(&mut core, instant.is_none());
        let audit = Audit::start(&core, scheme.densities(&core));
        Ok(Self { core, scheme, audit })
    }

    /// A simulation that continues from a checkpoint. With the same parameters, box and obstacles, every
    /// later step has the bits that it would have had without the interruption.
    ///
    /// # Errors
    /// [`SetupError`] as for [`Simulation::new`], or if the checkpoint belongs to another method.
    pub fn resume(
        mut parameters: Parameters,
        checkpoint: &Checkpoint,
        domain: Aabb,
        obstacles: Vec<Obstacle>,
    ) -> Result<Self, SetupError> {
        if let Ok([mass]) = checkpoint.get(MASS) {
            parameters.particle_mass = *mass;
        }
        if let Ok([packing]) = checkpoint.get(PACKING) {
            parameters.packing = *packing;
        }
        if let Ok([fills_vessel]) = checkpoint.get(FILLS_VESSEL) {
            parameters.fills_vessel = *fills_vessel != 0.0;
        }
        if let Ok([is_sealed]) = checkpoint.get(SEALED) {
            parameters.is_sealed = *is_sealed != 0.0;
        }
        let particles = checkpoint.particles().map_err(SetupError::Checkpoint)?;
        // the particles of a checkpoint are sorted already: sorting them again leaves their order
        let instant = Some((checkpoint.steps, checkpoint.time));
        let mut simulation = Self::at(parameters, particles, domain, obstacles, instant)?;
        let restored = simulation.core.restore(checkpoint);
        restored.and_then(|()| simulation.scheme.restore(checkpoint)).map_err(SetupError::Checkpoint)?;
        if let Ok(memory) = checkpoint.get(AUDIT) {
            simulation.audit.take_up(memory);
        }
        Ok(simulation)
    }

    /// The present state, for [`Simulation::resume`]. The caller sets the fingerprint.
    pub fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = self.core.checkpoint();
        self.scheme.save(&mut checkpoint);
        checkpoint.set(AUDIT, self.audit.memory());
        checkpoint.set(MASS, vec![self.core.parameters.particle_mass]);
        checkpoint.set(PACKING, vec![self.core.parameters.packing]);
        checkpoint.set(FILLS_VESSEL, vec![f64::from(u8::from(self.core.parameters.fills_vessel))]);
        checkpoint.set(SEALED, vec![f64::from(u8::from(self.core.parameters.is_sealed))]);
        checkpoint
    }

    /// Advances by one time step.
    ///
    /// # Errors
    /// [`StepError`] if a value became infinite or NaN, steps became too short, or the energy has doubled
    /// without work. Nothing is clamped to hide it.
    pub fn step(&mut self) -> Result<(), StepError> {
        self.step_at_most(f64::INFINITY)
    }

    /// Advances by one time step of at most `longest` seconds, so that a caller can arrive at an exact
    /// instant.
    ///
    /// # Errors
    /// See [`Simulation::step`].
    pub fn step_at_most(&mut self, longest: f64) -> Result<(), StepError> {
        // the whole step runs on threads of the pool; otherwise each of its many sums would have to be handed
        // over to them. A thread that waits may take a step of another simulation meanwhile
        rayon::scope(|_| self.take_step(longest))
    }

    fn take_step(&mut self, longest: f64) -> Result<(), StepError> {
        let before = self.core.steps;
        self.core.steps += 1;
        if let Some(gravity) = &self.core.turning_gravity {
            self.core.parameters.gravity = gravity(self.core.time);
            if !self.core.parameters.gravity.is_finite() {
                return Err(StepError::Gravity { step: self.core.steps, time: self.core.time });
            }
        }
        let dt = self.scheme.step(&mut self.core, longest)?;
        // equal steps are counted, so that their rounding errors do not add up
        let counted = |steps: u64| steps as f64 * dt;
        self.core.time =
            if self.core.time == counted(before) { counted(before + 1) } else { self.core.time + dt };
        let by_walls = self.core.contacts.as_mut().map_or(0.0, Contacts::take_work);
        self.audit.look(&self.core, self.scheme.densities(&self.core), dt, by_walls)
    }

    /// The greatest speed after the last step, m/s.
    pub fn speed(&self) -> f64 {
        self.audit.speed()
    }

    /// What the energy, the volume, the densities, the speed and the rows of this simulation have shown since its start.
    pub fn audit(&self) -> &Audit {
        &self.audit
    }

    /// Findings about the simulation so far that a user must know, each with a sentence.
    pub fn findings(&self) -> Vec<(Finding, String)> {
        self.audit.findings(&self.core.parameters)
    }

    /// The findings that this function has not returned before.
    pub fn news(&mut self) -> Vec<(Finding, String)> {
        self.audit.news(&self.core.parameters)
    }

    /// The parameters. Gravity is that of the present step.
    pub fn parameters(&self) -> &Parameters {
        &self.core.parameters
    }

    /// The particles, in the solver's order.
    pub fn particles(&self) -> &Particles {
        &self.core.particles
    }

    /// The accelerations, m/s², in the order of the particles.
    pub fn acceleration(&self) -> &Vectors {
        &self.core.acceleration
    }

    /// Number of steps taken, including one that failed.
    pub fn steps(&self) -> u64 {
        self.core.steps
    }

    /// Simulated time, s.
    pub fn time(&self) -> f64 {
        self.core.time
    }

    /// Takes steps until a time, s, at which the last step ends. `after_step` is called with each state on
    /// the way and may stop earlier. A time that is no number, or is not after the present one, asks for no step.
    ///
    /// # Errors
    /// See [`Simulation::step`].
    pub fn advance(
        &mut self,
        end: f64,
        mut after_step: impl FnMut(&Self) -> ControlFlow<()>,
    ) -> Result<(), StepError> {
        while self.core.time < end * (1.0 - 1e-12) {
            self.step_at_most(end - self.core.time)?;
            if after_step(self).is_break() {
                break;
            }
        }
        Ok(())
    }

    /// Sets a constant gravity, m/s², from the next step on.
    pub fn set_gravity(&mut self, gravity: DVec3) {
        self.core.parameters.gravity = gravity;
        self.core.turning_gravity = None;
    }

    /// Makes gravity, m/s², a function of the time, s, as in a container that rotates. Each step takes the
    /// value at its beginning.
    pub fn set_turning_gravity(&mut self, gravity: Arc<VectorOfTime>) {
        self.core.parameters.gravity = gravity(self.core.time);
        self.core.turning_gravity = Some(gravity);
        self.begin_audit();
    }

    /// Adds to gravity an acceleration that depends on the place and the time, m/s².
    pub fn set_gravity_field(&mut self, field: Arc<VectorField>) {
        self.core.gravity_field = Some(field);
        if self.core.steps == 0 {
            self.core.pull(1.0);
        }
        self.begin_audit();
    }

    /// Restarts the audit if what acts on the fluid is set before its first step.
    fn begin_audit(&mut self) {
        if self.core.steps == 0 {
            self.audit = Audit::start(&self.core, self.scheme.densities(&self.core));
        }
    }

    /// Prepares a probe. It may be sampled from now on, at most once at each instant.
    ///
    /// # Errors
    /// [`SetupError::Obstacle`] if the probe names an obstacle that does not exist.
    pub fn gauge(&mut self, probe: Probe) -> Result<Gauge, SetupError> {
        self.prepare(probe)?;
        Ok(Gauge::beginning(probe, &self.core))
    }

    /// Prepares a probe of a run that continues from a checkpoint, with the [memory](Gauge::memory) that it
    /// had then. A force by differences of pressure in a viscous fluid is not known again before the first step.
    ///
    /// # Errors
    /// See [`Simulation::gauge`].
    pub fn gauge_at(
        &mut self,
        probe: Probe,
        checkpoint: &Checkpoint,
        memory: &[f64],
    ) -> Result<Gauge, SetupError> {
        let is_first = !self.core.contacts.as_ref().is_some_and(Contacts::are_for_forces);
        self.prepare(probe)?;
        if let (true, Some(contacts), Ok(totals)) =
            (is_first, &mut self.core.contacts, checkpoint.get("contacts"))
        {
            contacts.restore(totals);
        }
        Ok(Gauge::remembering(probe, memory).unwrap_or_else(|| Gauge::beginning(probe, &self.core)))
    }

    fn prepare(&mut self, probe: Probe) -> Result<(), SetupError> {
        if let Probe::Force { obstacle, .. } = probe {
            let obstacles = self.core.boundary.obstacles.len();
            if obstacle >= obstacles {
                return Err(SetupError::NoObstacle { index: obstacle, obstacles });
            }
            self.core.contacts.get_or_insert_with(|| Contacts::of(obstacles)).ask_for_forces();
        }
        Ok(())
    }

    /// Samples a probe now: one figure for each of its [columns](Probe::columns).
    pub fn sample(&self, gauge: &mut Gauge) -> Vec<f64> {
        gauge.sample(&self.core, &self.audit)
    }

    /// The longest step, s, that this state allows: the least of the parameters' limits at the present
    /// greatest speed and the force limit at the present greatest acceleration.
    pub fn stable_dt(&self) -> f64 {
        self.core.stable_dt()
    }

    /// Number of ordered pairs of particles within the support radius, which measures the work of a step.
    /// This call counts them.
    pub fn pairs(&self) -> usize {
        self.core.pairs()
    }

    /// Iterations of the last step's solver; `None` for methods without one.
    pub fn iterations(&self) -> Option<u32> {
        self.scheme.iterations()
    }

    /// Memory of the state and of all that a step needs, bytes.
    pub fn bytes(&self) -> usize {
        self.core.bytes() + self.scheme.bytes()
    }

    /// Figures of the present state, computed by this call.
    pub fn stats(&self) -> Stats {
        Stats::of(&self.core)
    }

    /// The passes that a step of this simulation runs, in order.
    pub fn passes(&self) -> Vec<Pass> {
        self.plan().into_iter().filter_map(|(pass, absence)| absence.is_none().then_some(pass)).collect()
    }

    /// All passes in the order in which a step would run them, each with the reason if it does not run.
    pub fn plan(&self) -> Vec<(Pass, Option<Cow<'static, str>>)> {
        plan(&self.core.parameters, self.core.boundary.obstacles.len(), self.core.has_gravity())
    }
}

fn check_setup(boundary: &Boundary, particles: &Particles) -> Result<(), SetupError> {
    let domain = boundary.domain;
    if !(domain.is_finite() && domain.volume() > 0.0 && domain.volume() < f64::INFINITY) {
        return Err(SetupError::Domain(domain));
    }
    let wrong = |o: &Obstacle| {
        !((0.0..=1.0).contains(&o.restitution)
            && (0.0..f64::INFINITY).contains(&o.friction)
            && o.resolution > 0.0)
    };
    if let Some(index) = boundary.obstacles.iter().position(wrong) {
        return Err(SetupError::Obstacle { index });
    }
    if particles.is_empty() {
        return Err(SetupError::NoParticles);
    }
    for vectors in [&particles.position, &particles.velocity] {
        if let Some(i) = first_non_finite(vectors) {
            return Err(SetupError::NonFinite { id: particles.id[i] });
        }
    }
    let in_fluid = |p: DVec3| boundary.fields().all(|field| field.omega(p) < 0.0);
    let outside_box = particles.position.iter().filter(|&p| !domain.contains(p)).count();
    let inside_obstacles = particles.position.iter().filter(|&p| !in_fluid(p)).count();
    if outside_box + inside_obstacles > 0 {
        return Err(SetupError::NotInFluid { outside_box, inside_obstacles });
    }
    Ok(())
}
