//! Motion that displacements undo is taken from the velocities.
//!
//! The two systems of the scheme treat walls differently, so some motions do not compress the fluid for the system of
//! forces, although they do for that of places. Two layers in a channel 2.3 spacings wide approach each other, and the
//! column falls into the gaps that seem to open beside them. Displacements put the layers back in each step, but their
//! velocities stayed and grew: the fluid fell as if there was no floor, and had twice its energy after 55 steps.
//!
//! So what answers to the motion of the step acts on velocities, too: Δv = b(c·s′)/dt, where c is the part of the excess of
//! density that this motion makes within some steps, and 0 where it expands the places. Displacements are the adjoint of
//! that rate of compression, so this takes kinetic energy away. As a sum over pairs it keeps momentum and angular
//! momentum. All of it is shortened by one factor if it would overshoot.
//!
//! In a fluid that fills its vessel nothing falls, and displacements undo above all that single particles pass each
//! other. That is no motion of the fluid, so nothing is taken there: an oil of 20 Pa·s lost it by three times its viscosity.

use rayon::prelude::*;

use super::solver::Solver;
use super::walls::Walls;
use crate::sph::{
    core::Core,
    particles::{CHUNK, Vectors, add_scaled},
    reaction::Reaction,
    walls::Pushed,
};

/// Steps in which the same motion has made an excess that solves have left: as many as a debt lasts.
const LASTING: f64 = 8.0;

/// What is taken from the velocities in a step.
#[derive(Default)]
pub(super) struct Arrest {
    /// c·s′.
    s: Vec<f64>,
    /// Its displacement, m: the way that was undone.
    undone: Vectors,
}

impl Arrest {
    /// Finds what the answer of the system of places undoes of the motion of a step, with the excesses of density that it
    /// was asked for and the densities before the step, kg/m³.
    pub fn find(
        &mut self,
        core: &Core,
        (places, walls): (&mut Solver, &Walls),
        excess: &[f64],
        density: &[f64],
    ) {
        let rest = core.parameters.rest_density;
        self.s.clear();
        self.s.extend(places.s.iter().zip(excess).zip(density).map(|((s, excess), density)| {
            let by_motion = excess - (density - rest);
            if by_motion > 0.0 { s * (LASTING * by_motion / excess.max(by_motion)).min(1.0) } else { 0.0 }
        }));
        self.undone.resize(self.s.len());
        places.find_push_of(core, walls, &self.s, &mut self.undone);
    }

    /// Takes it from the velocities. The way, which the step is still to go by these velocities, is taken from the
    /// displacements, so that places stay as they were found.
    pub fn take(&self, core: &mut Core, walls: &Walls, dt: f64, displacement: &mut Vectors) {
        let (mut gain, mut square) = (0.0, 0.0);
        for (undone, velocity) in self.undone.iter().zip(core.particles.velocity.iter()) {
            gain += undone.dot(velocity) / dt;
            square += undone.length_squared() / (dt * dt);
        }
        // what a wall takes away is motion as seen from the wall
        for (i, (wall, _)) in walls.found() {
            gain += core.parameters.rest_density * self.s[*i as usize] * wall.barrier.sweep / dt;
        }
        if !(gain < 0.0 && square > 0.0) {
            return;
        }
        let part = (-gain / square).min(1.0);
        self.note_walls(core, walls, part, dt);
        add_scaled(&mut core.particles.velocity, &self.undone, part / dt);
        add_scaled(displacement, &self.undone, -part);
    }

    /// Notes what walls do of it.
    fn note_walls(&self, core: &Core, walls: &Walls, part: f64, dt: f64) {
        let Some(reaction) = Reaction::of(core, dt) else { return };
        walls.found().par_iter().with_min_len(CHUNK / 4).for_each(|(i, (wall, _))| {
            let i = *i as usize;
            let factor = -core.parameters.rest_density * self.s[i] * part / (dt * dt);
            let by_pressure = factor * wall.barrier.gradient;
            reaction.add(i, Pushed { by_pressure, factor, gradient: wall.gradient, ..Pushed::default() });
        });
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        8 * self.s.capacity() + self.undone.bytes()
    }
}
