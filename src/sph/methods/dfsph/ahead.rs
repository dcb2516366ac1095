//! Half of a step's pressure, gravity and surface tension, after the solve that finds the pressure.
//!
//! A velocity without divergence is tangential to the streamlines where the step begins. A step along it leaves the
//! fluid's curved path by ½·dt²·a, where a is the acceleration across the path, and what the next solve then takes
//! away is motion: water that turns with a cylinder lost about W²·dt/4 of its angular momentum in a second, and twice
//! as much of its energy (11 and 19 % in 3 s at 6 rad/s with steps of 4 ms), and displacements hid it from the force on
//! the walls. So pressure, gravity and tension act for half of the step before and half of the step after the places
//! where they are found: half of gravity and of the surface tension is held back until velocities are free of
//! divergence, and then acts together with the pressure. Without pressure nothing changes, and at rest they cancel.
//! (When all of the tension acted before, the pressure threw the surface of a drop out for half a step and the tension
//! drew it back in the next: particles of water at rest in a drop with a radius of 1 mm reached 0.22 m/s in 20 ms, and
//! 0.07 m/s now.)
//!
//! The pressure of the step to come is that of the last solve, at most its mean over the relaxation time: an impact
//! that lasts a step is over, and in advance it would throw the fluid back. (With twice that of the last solve at most,
//! a jet bounced off a plate and pushed it by 18 % too much.) The first step gives nothing, because walls that begin to
//! move strike the fluid in it.

use glam::DVec3;
use rayon::prelude::*;

use super::solver::Solver;
use super::walls::Walls;
use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::Core,
    particles::{CHUNK, Vectors, add_scaled},
    reaction::Reaction,
};

/// Names of the pressure and of the length of its step in a checkpoint.
const PRESSURE: &str = "pressure ahead";
const STEP: &str = "step ahead";

/// Fluid that bears no more than this part of its weight falls freely, and that which bears the other part does not. In
/// between it does in part.
const FREE: f64 = 0.25;
const SUPPORTED: f64 = 0.5;

/// What acts in advance.
#[derive(Default)]
pub(super) struct Ahead {
    /// p/ρ² of each particle, as in the solver of forces.
    pub s: Vec<f64>,
    /// The length of the step of which it was half, s; zero before anything was given.
    pub dt: f64,
    /// a(s), m/s².
    pub push: Vectors,
    /// Gravity and surface tension of this step, m/s²; empty if there is only a gravity that is the same everywhere.
    held: Vectors,
}

impl Ahead {
    /// Without any pressure yet, for `n` particles.
    pub fn nothing(n: usize) -> Self {
        let mut push = Vectors::default();
        push.resize(n);
        Self { s: vec![0.0; n], dt: 0.0, push, held: Vectors::default() }
    }

    /// Adds a part of the accelerations that depend on the place to those of the particles, and notes them: of gravity,
    /// as [`Core::pull`] does, and of surface tension, if the fluid is under any.
    pub fn pull(&mut self, core: &mut Core, tension: Option<&Vectors>, part: f64) {
        if core.gravity_field.is_none() && tension.is_none() {
            return;
        }
        self.held.clone_from(&core.acceleration);
        core.pull(part);
        if let Some(tension) = tension {
            add_scaled(&mut core.acceleration, tension, part);
        }
        // steps differ in length, and half of this one waits
        let uniform = core.parameters.pull();
        let pulled = core.acceleration.components().into_iter().zip(self.held.components_mut());
        for ((now, before), uniform) in pulled.zip(uniform.to_array()) {
            before.iter_mut().zip(now).for_each(|(before, now)| *before = (now - *before) / part + uniform);
        }
    }

    /// Holds back the gravity and the tension of half of a step of the length `dt`, s, from velocities that have that
    /// of all of it.
    pub fn hold_back(&self, core: &mut Core, dt: f64) {
        self.add_held(core, -0.5 * dt);
    }

    /// Gives the fluid the pressures `s`, and the gravity and the tension of half of a step of the length `dt`, s.
    pub fn give(&mut self, core: &mut Core, (forces, walls): (&mut Solver, &Walls), dt: f64) {
        forces.find_push_of(core, walls, &self.s, &mut self.push);
        if let Some(reaction) = Reaction::of(core, 0.5 * dt) {
            forces.note_walls(reaction, walls, core.parameters.rest_density, (&self.push, &self.s));
        }
        add_scaled(&mut core.particles.velocity, &self.push, 0.5 * dt);
        self.add_held(core, 0.5 * dt);
        self.dt = dt;
    }

    /// Lets particles that fall freely go less far: with the velocity of the end of a step they would go too far by half of
    /// what gravity gives in it. Adds gravity times `factor` to the ways or velocities of particles, as far as they fall:
    /// as far as the accelerations by the pressure of the step, `push`, and by surface tension, m/s², leave them to gravity.
    /// (The skin of a drop is held by both. By its pressure alone it would not fall with the drop.) Gravity that depends on
    /// the place acts from the middle of one step to that of the next anyway.
    pub fn fall_less(
        &self,
        core: &Core,
        (push, tension): (&Vectors, Option<&Vectors>),
        ways: &mut Vectors,
        factor: f64,
    ) {
        let g = core.parameters.pull();
        if core.gravity_field.is_some() || g == DVec3::ZERO || factor == 0.0 {
            return;
        }
        let (weight, given) = (g.length(), factor * g);
        let falls = |i: usize| {
            let tension = tension.map_or(DVec3::ZERO, |tension| tension.get(i));
            let borne = (push.get(i) + 0.5 * self.push.get(i) + tension).length() / weight;
            ((SUPPORTED - borne) / (SUPPORTED - FREE)).clamp(0.0, 1.0)
        };
        let Vectors { x, y, z } = ways;
        x.par_chunks_mut(CHUNK)
            .zip(y.par_chunks_mut(CHUNK))
            .zip(z.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(chunk, ((x, y), z))| {
                for k in 0..x.len() {
                    let change = falls(CHUNK * chunk + k) * given;
                    (x[k], y[k], z[k]) = (x[k] + change.x, y[k] + change.y, z[k] + change.z);
                }
            });
    }

    fn add_held(&self, core: &mut Core, time: f64) {
        if !self.held.x.is_empty() {
            add_scaled(&mut core.particles.velocity, &self.held, time);
        } else if core.parameters.pull() != DVec3::ZERO {
            let change = time * core.parameters.pull();
            let columns = core.particles.velocity.components_mut().into_iter();
            for (column, change) in columns.zip(change.to_array()) {
                column.iter_mut().for_each(|v| *v += change);
            }
        }
    }

    /// Saves what the next step needs.
    pub fn save(&self, checkpoint: &mut Checkpoint) {
        checkpoint.set(PRESSURE, self.s.clone());
        checkpoint.set(STEP, vec![self.dt]);
    }

    /// Takes up what a checkpoint saved.
    ///
    /// # Errors
    /// The column that the checkpoint lacks.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.s = checkpoint.of_particles(PRESSURE)?;
        self.dt = match checkpoint.get(STEP)? {
            [dt] if dt.is_finite() && *dt >= 0.0 => *dt,
            _ => return Err(CheckpointError::Column(STEP.into())),
        };
        Ok(())
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        8 * self.s.capacity() + self.push.bytes() + self.held.bytes()
    }
}
