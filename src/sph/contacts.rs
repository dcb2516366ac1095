//! Impulses that obstacles take from particles that they push or that hit them, as threads find them during a step.

use std::sync::{Mutex, PoisonError};

use glam::DVec3;

/// Impulses that obstacles have received from particles since the start.
#[derive(Debug, Default)]
pub struct Contacts {
    /// Impulse and moment of impulse about the origin of each obstacle, N·s and N·m·s.
    totals: Vec<[f64; 6]>,
    /// Hits of the present step, in the order in which threads find them.
    now: Mutex<Vec<Hit>>,
}

/// A change of a particle's velocity by an obstacle.
#[derive(Debug, Clone, Copy)]
struct Hit {
    particle: usize,
    obstacle: usize,
    change: DVec3,
    at: DVec3,
}

impl Contacts {
    /// The state before any contact, for a number of obstacles.
    pub fn of(obstacles: usize) -> Self {
        Self { totals: vec![[0.0; 6]; obstacles], now: Mutex::default() }
    }

    /// Notes that an obstacle changed the velocity of a particle at a place.
    pub fn add(&self, particle: usize, obstacle: usize, change: DVec3, at: DVec3) {
        let mut now = self.now.lock().unwrap_or_else(PoisonError::into_inner);
        now.push(Hit { particle, obstacle, change, at });
    }

    /// Adds the hits of the step to the totals, particle by particle, so that the sum does not depend on
    /// which thread was first.
    pub fn settle(&mut self, mass: f64) {
        let now = self.now.get_mut().unwrap_or_else(PoisonError::into_inner);
        now.sort_by_key(|hit| hit.particle); // stable: the hits of one particle stay in their order
        for hit in now.drain(..) {
            let impulse = -mass * hit.change;
            let moment = hit.at.cross(impulse);
            let total = &mut self.totals[hit.obstacle];
            for (sum, x) in total.iter_mut().zip(impulse.to_array().into_iter().chain(moment.to_array())) {
                *sum += x;
            }
        }
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
