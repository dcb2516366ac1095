//! The simulation: state, buffers and one step of the method.
//!
//! Velocity Verlet in kick–drift–kick form. Viscosity depends on the velocity, which is not yet known when
//! the forces are found; it is predicted as v + a·dt/2 from the half-step velocity and the last acceleration,
//! the paper's "approximation of a new velocity vector". One evaluation of the forces per step.
//!
//! Invariant: between steps positions, velocities, densities, pressures and accelerations belong to one
//! instant, and particles lie in the grid's order.

use std::{error, fmt};

use glam::DVec3;
use rayon::prelude::*;

use crate::geom::Aabb;

use super::{
    boundary::{Boundary, Obstacle},
    density::{find_density, find_pressure},
    forces::{Record, find_accelerations},
    grid::CellGrid,
    kernel::Kernels,
    neighbours::{BLOCK, Neighbours},
    params::{ParameterError, Parameters},
    particles::{Particles, Vectors},
    stats::{Pass, Stats},
};

/// Particles stop this part of the support radius before an obstacle.
const CLEARANCE: f64 = 1e-6;

/// A simulation that cannot be started.
#[derive(Debug, Clone, PartialEq)]
pub enum SetupError {
    Parameter(ParameterError),
    /// The box is empty, flat or infinite.
    Domain(Aabb),
    /// An obstacle's restitution is not in 0..=1, or its resolution is not positive.
    Obstacle {
        index: usize,
    },
    NoParticles,
    /// A particle's position or velocity is not finite.
    NonFinite {
        id: u32,
    },
    /// Particles outside the box or not in the fluid (ω ≥ 0); [`carve`](super::carve) removes such.
    NotInFluid {
        outside_box: usize,
        inside_obstacles: usize,
    },
}

impl fmt::Display for SetupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter(error) => error.fmt(f),
            Self::Domain(b) => write!(f, "the box from {} to {} has no finite volume", b.min, b.max),
            Self::Obstacle { index } => {
                write!(f, "obstacle {index} needs a restitution from 0 to 1 and a resolution above 0")
            }
            Self::NoParticles => write!(f, "there are no particles"),
            Self::NonFinite { id } => write!(f, "the position or velocity of particle {id} is not finite"),
            Self::NotInFluid { outside_box, inside_obstacles } => {
                write!(f, "{outside_box} particles lie outside the box and {inside_obstacles} in obstacles")
            }
        }
    }
}

impl error::Error for SetupError {}

/// What ceased to be a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    Position,
    Density,
    Acceleration,
    Omega,
}

/// Why, most likely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// The step exceeds what this state allows, s.
    StepTooLong { dt: f64, stable: f64 },
    /// The obstacle's formula has no value at a point.
    FieldUndefined { at: DVec3 },
    /// The step was short enough: values grew until they left the range of a double.
    Overflow,
}

/// A step that could not be completed; the state is not to be used any more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepError {
    NonFinite { step: u64, id: u32, quantity: Quantity, cause: Cause },
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self::NonFinite { step, id, quantity, cause } = self;
        let quantity = match quantity {
            Quantity::Position => "position",
            Quantity::Density => "density",
            Quantity::Acceleration => "acceleration",
            Quantity::Omega => "obstacle's field",
        };
        write!(f, "step {step}: the {quantity} of particle {id} is not finite; ")?;
        match cause {
            Cause::StepTooLong { dt, stable } => {
                write!(f, "the time step of {dt} s is too long, at most {stable:.2e} s is stable")
            }
            Cause::FieldUndefined { at } => write!(f, "the obstacle's formula has no value at {at}"),
            Cause::Overflow => write!(f, "values have grown beyond the range of numbers"),
        }
    }
}

impl error::Error for StepError {}

/// A fluid in a box with obstacles.
pub struct Simulation<'a> {
    parameters: Parameters,
    boundary: Boundary<'a>,
    kernels: Kernels,
    particles: Particles,
    acceleration: Vectors,
    steps: u64,
    grid: CellGrid,
    neighbours: Neighbours,
    buffers: Buffers,
}

/// Storage that is kept between steps and whose content is not.
#[derive(Default)]
struct Buffers {
    sorted: Vec<f64>,
    sorted_id: Vec<u32>,
    target: Vectors,
    predicted: Vectors,
    records: Vec<Record>,
}

impl<'a> Simulation<'a> {
    /// Checks the input and finds densities and forces of the first instant.
    ///
    /// # Errors
    /// [`SetupError`] names the first thing that makes a run meaningless.
    pub fn new(
        parameters: Parameters,
        particles: Particles,
        domain: Aabb,
        obstacles: Vec<Obstacle<'a>>,
    ) -> Result<Self, SetupError> {
        parameters.validate().map_err(SetupError::Parameter)?;
        let clearance = CLEARANCE * parameters.support_radius;
        let boundary =
            Boundary { domain, wall_restitution: parameters.wall_restitution, obstacles, clearance };
        check_setup(&boundary, &particles)?;
        let mut simulation = Self {
            kernels: Kernels::new(parameters.support_radius),
            acceleration: Vectors::default(),
            parameters,
            boundary,
            particles,
            steps: 0,
            grid: CellGrid::default(),
            neighbours: Neighbours::default(),
            buffers: Buffers::default(),
        };
        simulation.acceleration.resize(simulation.particles.len());
        simulation.find_neighbours();
        simulation.find_density_and_pressure();
        simulation.find_forces(0.0);
        Ok(simulation)
    }

    /// Advances by one time step.
    ///
    /// # Errors
    /// [`StepError`] when a value is not finite any more; nothing is clamped to hide it.
    pub fn step(&mut self) -> Result<(), StepError> {
        let half = 0.5 * self.parameters.time_step;
        self.steps += 1;
        self.kick(half);
        self.drift();
        self.collide()?;
        self.find_neighbours();
        self.find_density_and_pressure();
        self.find_forces(half);
        self.kick(half);
        self.check_finite()
    }

    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The particles, in the solver's order.
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// m/s², in the order of the particles.
    pub fn acceleration(&self) -> &Vectors {
        &self.acceleration
    }

    /// Steps taken; after an error, the one that failed included.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Simulated time, s.
    pub fn time(&self) -> f64 {
        self.steps as f64 * self.parameters.time_step
    }

    /// Turns gravity, m/s², from the next step on (a container that rotates).
    pub fn set_gravity(&mut self, gravity: DVec3) {
        self.parameters.gravity = gravity;
    }

    /// The longest step, s, that this state allows: the parameters' limits for the present greatest speed,
    /// and the force limit for the present greatest acceleration.
    pub fn stable_dt(&self) -> f64 {
        let longest =
            |vectors: &Vectors| vectors.iter().map(DVec3::length_squared).fold(0.0, f64::max).sqrt();
        let limit = self.parameters.stable_dt(longest(&self.particles.velocity));
        limit.min(self.parameters.force_dt(longest(&self.acceleration)))
    }

    /// Ordered pairs of particles within the support radius: the work count of a step.
    pub fn pairs(&self) -> usize {
        self.neighbours.pairs()
    }

    /// Figures of the present state.
    pub fn stats(&self) -> Stats {
        Stats::of(&self.parameters, &self.boundary, &self.neighbours, &self.particles)
    }

    /// The passes that a step of this simulation runs, in order.
    pub fn passes(&self) -> Vec<Pass> {
        Pass::of(&self.parameters, &self.boundary)
    }

    /// v += a·t
    fn kick(&mut self, t: f64) {
        add_scaled(&mut self.particles.velocity, &self.acceleration, t);
    }

    /// target = x + v·dt; the positions follow when collisions are resolved.
    fn drift(&mut self) {
        self.buffers.target.clone_from(&self.particles.position);
        add_scaled(&mut self.buffers.target, &self.particles.velocity, self.parameters.time_step);
    }

    fn collide(&mut self) -> Result<(), StepError> {
        // infinite positions would be clamped to the box and never seen
        if let Some(i) = first_non_finite(&self.buffers.target) {
            return Err(self.non_finite(i, Quantity::Position));
        }
        let Particles { position, velocity, .. } = &mut self.particles;
        self.boundary.collide(position, &mut self.buffers.target, velocity).map_err(|fault| {
            StepError::NonFinite {
                step: self.steps,
                id: self.particles.id[fault.index],
                quantity: Quantity::Omega,
                cause: Cause::FieldUndefined { at: fault.at },
            }
        })?;
        std::mem::swap(&mut self.particles.position, &mut self.buffers.target);
        Ok(())
    }

    fn find_neighbours(&mut self) {
        let cells = self.neighbours.cells_per_radius(self.particles.len());
        self.grid.sort(&self.particles.position, self.kernels.h, cells);
        self.reorder();
        self.neighbours.search(&self.grid, &self.particles.position, self.kernels.h);
    }

    /// Brings the particles into the grid's order.
    fn reorder(&mut self) {
        let order = self.grid.order();
        let Particles { position, velocity, id, .. } = &mut self.particles;
        let sorted = &mut self.buffers.sorted;
        for vectors in [position, velocity, &mut self.acceleration] {
            for component in vectors.components_mut() {
                sorted.clear();
                sorted.extend(order.iter().map(|&i| component[i as usize]));
                std::mem::swap(sorted, component);
            }
        }
        let sorted_id = &mut self.buffers.sorted_id;
        sorted_id.clear();
        sorted_id.extend(order.iter().map(|&i| id[i as usize]));
        std::mem::swap(sorted_id, id);
    }

    fn find_density_and_pressure(&mut self) {
        let Particles { position, density, pressure, .. } = &mut self.particles;
        find_density(&self.neighbours, position, &self.kernels, self.parameters.particle_mass, density);
        find_pressure(&self.parameters, density, pressure);
    }

    /// Accelerations for the velocities predicted `ahead` seconds from those stored.
    fn find_forces(&mut self, ahead: f64) {
        let predicted = &mut self.buffers.predicted;
        predicted.clone_from(&self.particles.velocity);
        add_scaled(predicted, &self.acceleration, ahead);
        find_accelerations(
            &self.parameters,
            &self.kernels,
            &self.neighbours,
            &self.particles,
            predicted,
            &mut self.buffers.records,
            &mut self.acceleration,
        );
    }

    fn check_finite(&self) -> Result<(), StepError> {
        if let Some(i) = self.particles.density.iter().position(|rho| !rho.is_finite()) {
            return Err(self.non_finite(i, Quantity::Density));
        }
        match first_non_finite(&self.acceleration) {
            Some(i) => Err(self.non_finite(i, Quantity::Acceleration)),
            None => Ok(()),
        }
    }

    fn non_finite(&self, index: usize, quantity: Quantity) -> StepError {
        let dt = self.parameters.time_step;
        // the state may hold NaN already; max and min pass it over
        let stable = self.stable_dt();
        let cause = if dt > stable { Cause::StepTooLong { dt, stable } } else { Cause::Overflow };
        StepError::NonFinite { step: self.steps, id: self.particles.id[index], quantity, cause }
    }
}

fn check_setup(boundary: &Boundary<'_>, particles: &Particles) -> Result<(), SetupError> {
    let domain = boundary.domain;
    if !(domain.is_finite() && domain.volume() > 0.0 && domain.volume() < f64::INFINITY) {
        return Err(SetupError::Domain(domain));
    }
    let wrong = |o: &Obstacle<'_>| !((0.0..=1.0).contains(&o.restitution) && o.resolution > 0.0);
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
    let in_fluid = |p: DVec3| boundary.obstacles.iter().all(|o| o.field.omega(p) < 0.0);
    let outside_box = particles.position.iter().filter(|&p| !domain.contains(p)).count();
    let inside_obstacles = particles.position.iter().filter(|&p| !in_fluid(p)).count();
    if outside_box + inside_obstacles > 0 {
        return Err(SetupError::NotInFluid { outside_box, inside_obstacles });
    }
    Ok(())
}

/// to += from·t
fn add_scaled(to: &mut Vectors, from: &Vectors, t: f64) {
    for (to, from) in [(&mut to.x, &from.x), (&mut to.y, &from.y), (&mut to.z, &from.z)] {
        to.par_chunks_mut(16 * BLOCK).zip(from.par_chunks(16 * BLOCK)).for_each(|(to, from)| {
            for (to, from) in to.iter_mut().zip(from) {
                *to += from * t;
            }
        });
    }
}

fn first_non_finite(vectors: &Vectors) -> Option<usize> {
    vectors.iter().position(|v| !v.is_finite())
}
