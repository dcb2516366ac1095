//! Walls that leave the fluid.
//!
//! The density of a particle contains the part 2ρ₀λ of the walls near it, and a surface that was one from the start has
//! the rest density without. Where a wall moves away faster than the fluid follows, or is gone at once, its part went with
//! it: behind a gate that had opened particles had down to 471 kg/m³, and had to come together to half of their distance
//! before they pressed again. The front of the water lost a part of its volume, and got energy when it met the next wall.
//!
//! But a density below the rest density is as good as the rest density where nothing pulls. So what a wall takes away by
//! leaving lowers no density below that. It leaves if it takes more in a step than the particle's own motion could: if it
//! moves more than twice as fast as the particle follows it. What a particle loses by moving away from a wall it gets back
//! there, and that stays as it is, as does what a wall takes by which a particle is turned back on its way. If the wall returns, the gap is closed before it compresses anything
//! ([`rate_into_gap`](super::rates)).

use rayon::prelude::*;

use super::rates::LOOSE;
use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    params::Parameters,
    particles::CHUNK,
};

/// Names of the parts of walls and of their rates in a checkpoint.
pub(super) const NAMES: [&str; 2] = ["part of walls", "rate of that part"];

/// The parts of walls in the densities of the particles.
pub(super) struct OfWalls {
    /// 2ρ₀λ, kg/m³.
    part: Vec<f64>,
    /// How fast that grows by the motion of the particle alone: 2ρ₀∇λ·v, kg/m³/s.
    rate: Vec<f64>,
    /// The same at the end of a step.
    found: [Vec<f64>; 2],
}

impl OfWalls {
    /// Without walls, for `n` particles.
    pub fn nothing(n: usize) -> Self {
        let empty = || vec![0.0; n];
        Self { part: empty(), rate: empty(), found: [empty(), empty()] }
    }

    /// The columns in which a sum puts the parts and their rates at the end of a step.
    pub fn at_end(&mut self) -> [&mut [f64]; 2] {
        let [part, rate] = &mut self.found;
        [part, rate]
    }

    /// Gives densities, kg/m³, that have followed the places of a step of the length `dt`, s, back what walls took in it.
    pub fn lift(&self, parameters: &Parameters, density: &mut [f64], dt: f64) {
        let least = parameters.rest_density * (1.0 - LOOSE);
        let [part, rate] = &self.found;
        let before = self.part.par_chunks(CHUNK).zip(self.rate.par_chunks(CHUNK));
        let after = part.par_chunks(CHUNK).zip(rate.par_chunks(CHUNK));
        let columns = density.par_chunks_mut(CHUNK).zip(before).zip(after);
        columns.for_each(|((density, (part_before, rate_before)), (part, rate))| {
            for k in 0..density.len() {
                if density[k] < least {
                    let by_motion = 0.5 * dt * (rate_before[k] + rate[k]);
                    let taken = part_before[k] + by_motion - part[k];
                    // a wall that stops a particle on its way, or pushes it, changes its rate by so much at most
                    if taken > dt * (rate_before[k].abs() + rate[k].abs()) {
                        density[k] = least.min(density[k] + taken);
                    }
                }
            }
        });
    }

    /// Goes on to the end of the step.
    pub fn advance(&mut self) {
        std::mem::swap(&mut self.part, &mut self.found[0]);
        std::mem::swap(&mut self.rate, &mut self.found[1]);
    }

    /// The columns that must be sorted with the particles.
    pub fn columns(&mut self) -> [&mut Vec<f64>; 2] {
        [&mut self.part, &mut self.rate]
    }

    /// Saves what the next step needs.
    pub fn save(&self, checkpoint: &mut Checkpoint) {
        checkpoint.set(NAMES[0], self.part.clone());
        checkpoint.set(NAMES[1], self.rate.clone());
    }

    /// Takes up what a checkpoint saved.
    ///
    /// # Errors
    /// The column that the checkpoint lacks.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.part = checkpoint.of_particles(NAMES[0])?;
        self.rate = checkpoint.of_particles(NAMES[1])?;
        Ok(())
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let Self { part, rate, found: [a, b] } = self;
        [part, rate, a, b].map(|column| 8 * column.capacity()).iter().sum()
    }
}
