//! Impulses that obstacles take from particles that they push or that hit them, and the work of those that
//! move, as threads find them during a step.

use std::sync::{Mutex, PoisonError};

use glam::DVec3;

/// What obstacles and particles have done to each other since the start.
#[derive(Debug, Default)]
pub struct Contacts {
    /// Whether a probe asks for forces. Otherwise only work is noted.
    for_forces: bool,
    /// Impulse and moment of impulse about the origin of each obstacle, N·s and N·m·s.
    totals: Vec<[f64; 6]>,
    /// Hits of the present step, in the order in which threads find them.
    now: Mutex<Vec<Hit>>,
    /// Work on particles in the present step, J/kg, with their indices.
    work_now: Mutex<Vec<(usize, f64)>>,
    /// Work of moving walls on the fluid, J, that has not been fetched yet.
    work: f64,
    /// Accelerations by viscosity in the present step, m/s², with the particles' indices, in the order in which threads
    /// find them.
    drags_now: Mutex<Vec<(usize, DVec3)>>,
    /// Those of the last step, by the particles' indices.
    drags: Vec<(usize, DVec3)>,
}

/// A change of a particle's velocity by an obstacle, m/s, and of its angular momentum per mass by a couple, m²/s.
#[derive(Debug, Clone, Copy)]
struct Hit {
    particle: usize,
    obstacle: usize,
    change: DVec3,
    turn: DVec3,
    at: DVec3,
}

impl Contacts {
    /// The state before any contact, for a number of obstacles.
    pub fn of(obstacles: usize) -> Self {
        Self { totals: vec![[0.0; 6]; obstacles], ..Self::default() }
    }

    /// Notes impulses from now on.
    pub fn ask_for_forces(&mut self) {
        self.for_forces = true;
    }

    /// Whether impulses are noted.
    pub fn are_for_forces(&self) -> bool {
        self.for_forces
    }

    /// Notes that an obstacle changed the velocity of a particle at a place, m/s, and by a couple its angular momentum
    /// per mass, m²/s, if a probe asks for forces.
    pub fn add(&self, particle: usize, obstacle: usize, [change, turn]: [DVec3; 2], at: DVec3) {
        if self.for_forces {
            let mut now = self.now.lock().unwrap_or_else(PoisonError::into_inner);
            now.push(Hit { particle, obstacle, change, turn, at });
        }
    }

    /// Notes the work of walls on a particle, J/kg.
    pub fn add_work(&self, particle: usize, work: f64) {
        if work != 0.0 {
            self.work_now.lock().unwrap_or_else(PoisonError::into_inner).push((particle, work));
        }
    }

    /// Notes the acceleration of a particle near walls by viscosity, m/s².
    pub fn note_drag(&self, particle: usize, drag: DVec3) {
        self.drags_now.lock().unwrap_or_else(PoisonError::into_inner).push((particle, drag));
    }

    /// That acceleration, m/s², of the last step; zero where none was noted.
    pub fn drag(&self, particle: usize) -> DVec3 {
        let found = self.drags.binary_search_by_key(&particle, |(noted, _)| *noted);
        found.map_or(DVec3::ZERO, |k| self.drags[k].1)
    }

    /// Adds the hits of the step to the totals, particle by particle, so that the sum does not depend on
    /// which thread was first.
    pub fn settle(&mut self, mass: f64) {
        let now = self.now.get_mut().unwrap_or_else(PoisonError::into_inner);
        now.sort_by_key(|hit| hit.particle); // stable: the hits of one particle stay in their order
        for hit in now.drain(..) {
            let impulse = -mass * hit.change;
            let moment = hit.at.cross(impulse) - mass * hit.turn;
            let total = &mut self.totals[hit.obstacle];
            for (sum, x) in total.iter_mut().zip(impulse.to_array().into_iter().chain(moment.to_array())) {
                *sum += x;
            }
        }
        let now = self.work_now.get_mut().unwrap_or_else(PoisonError::into_inner);
        now.sort_by_key(|(particle, _)| *particle);
        self.work += mass * now.drain(..).map(|(_, work)| work).sum::<f64>();
        let now = self.drags_now.get_mut().unwrap_or_else(PoisonError::into_inner);
        self.drags.clear();
        self.drags.append(now);
        self.drags.sort_unstable_by_key(|(particle, _)| *particle);
    }

    /// The work of moving walls on the fluid, J, since the last call.
    pub fn take_work(&mut self) -> f64 {
        std::mem::take(&mut self.work)
    }

    /// Impulse, N·s, and moment of impulse about the origin, N·m·s, that an obstacle has received.
    pub fn total(&self, obstacle: usize) -> [f64; 6] {
        self.totals[obstacle]
    }

    /// The totals of all obstacles in their order.
    pub fn totals(&self) -> &[[f64; 6]] {
        &self.totals
    }

    /// Restores the totals of a checkpoint, for as many obstacles as both have.
    pub fn restore(&mut self, totals: &[f64]) {
        for (total, values) in self.totals.iter_mut().zip(totals.as_chunks::<6>().0) {
            *total = *values;
        }
    }
}
