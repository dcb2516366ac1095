//! Half of a step's pressure, given in advance.
//!
//! A velocity without divergence is tangential to the streamlines where the step begins. A step along it leaves the
//! fluid's curved path by ½·dt²·a, where a is the acceleration across the path, and what the next solve then takes
//! away is motion: water that turns with a cylinder lost W²·dt/2 of its angular momentum and of its speed in a second
//! (11 % in 3 s at 6 rad/s with steps of 7 ms, and displacements hid it from the force on the walls). So a step goes
//! along v + ½·dt·a, and the next solve begins from there: pressure acts at the places where it was found, for half of
//! the step before and half of the step after them.
//!
//! The pressure that is given in advance is that of the last solve, at most its mean over the relaxation time: an
//! impact that lasts a step is over, and in advance it would throw the fluid back. (With twice that of the last solve at
//! most, a jet bounced off a plate and pushed it by 18 % too much.) The part of gravity that pressure
//! bears is given in advance too, and kept back from the next step. A fluid in free fall is given nothing.

use glam::DVec3;

use super::solver::Solver;
use super::walls::Walls;
use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::Core,
    particles::Vectors,
    reaction::Reaction,
};

/// Names of columns in a checkpoint.
const PRESSURE: &str = "pressure ahead";
const LENT: [&str; 3] = ["gravity ahead x", "gravity ahead y", "gravity ahead z"];

/// What the last step gave in advance.
#[derive(Default)]
pub(super) struct Ahead {
    /// p/ρ² of each particle, as in the solver of forces.
    pub s: Vec<f64>,
    /// The velocities that gravity has lent, m/s.
    pub lent: Vectors,
    /// a(s), m/s².
    pub push: Vectors,
}

impl Ahead {
    /// Nothing for n particles.
    pub fn nothing(n: usize) -> Self {
        let (mut lent, mut push) = (Vectors::default(), Vectors::default());
        lent.resize(n);
        push.resize(n);
        Self { s: vec![0.0; n], lent, push }
    }

    /// Takes back what gravity has lent, before a step of the length `dt`, s, adds that of its whole length: at most half
    /// of that, because a step may be a short remainder before a frame.
    pub fn take_back_gravity(&mut self, core: &mut Core, dt: f64) {
        for i in 0..self.s.len() {
            let lent = self.lent.get(i);
            if lent == DVec3::ZERO {
                continue;
            }
            let taken = lent.clamp_length_max(0.5 * dt * core.gravity(i).length());
            self.lent.set(i, lent - taken);
            core.particles.velocity.set(i, core.particles.velocity.get(i) - taken);
        }
    }

    /// Gives the fluid the pressures `s` for half of a step of the length `dt`, s, and the part of gravity that they
    /// bear.
    pub fn give(&mut self, core: &mut Core, (forces, walls): (&Solver, &Walls), dt: f64) {
        forces.find_push_of(core, walls, &self.s, &mut self.push);
        if let Some(reaction) = Reaction::of(core, 0.5 * dt) {
            forces.note_walls(reaction, walls, core.parameters.rest_density, (&self.push, &self.s));
        }
        for i in 0..self.s.len() {
            let (push, gravity) = (self.push.get(i), core.gravity(i));
            let lent = 0.5 * dt * borne(push, gravity) * gravity;
            self.lent.set(i, self.lent.get(i) + lent);
            core.particles.velocity.set(i, core.particles.velocity.get(i) + 0.5 * dt * push + lent);
        }
    }

    /// Saves what the next step needs.
    pub fn save(&self, checkpoint: &mut Checkpoint) {
        checkpoint.set(PRESSURE, self.s.clone());
        for (name, column) in LENT.into_iter().zip(self.lent.components()) {
            checkpoint.set(name, column.clone());
        }
    }

    /// Takes up what a checkpoint saved.
    ///
    /// # Errors
    /// The column that the checkpoint lacks.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.s = checkpoint.of_particles(PRESSURE)?;
        for (name, column) in LENT.into_iter().zip(self.lent.components_mut()) {
            *column = checkpoint.of_particles(name)?;
        }
        Ok(())
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        8 * self.s.capacity() + self.lent.bytes() + self.push.bytes()
    }
}

/// The part of gravity that an acceleration by pressure bears.
fn borne(push: DVec3, gravity: DVec3) -> f64 {
    let square = gravity.length_squared();
    if square > 0.0 { (-push.dot(gravity) / square).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressure_bears_what_it_holds_against_gravity() {
        let g = DVec3::new(0.0, 0.0, -9.81);
        for (push, part) in [(-g, 1.0), (-0.25 * g, 0.25), (-3.0 * g, 1.0), (g, 0.0), (9.0 * DVec3::X, 0.0)] {
            assert_eq!(borne(push, g), part, "{push}");
        }
        assert_eq!(borne(DVec3::X, DVec3::ZERO), 0.0);
    }
}
