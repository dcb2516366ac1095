//! Gaps between the fluid and walls that it comes near to.
//!
//! The kernel of a particle reaches a wall before the fluid does. The sums of forces would count this as compression, and
//! pressure that walls alone cause accelerates the first layer towards the wall, away from the others: of a slug that met
//! a plate with 3 m/s the front reached 4.8 m/s, and all of it left the plate again with a third of its speed. How much
//! depended on the length of a step. But a wall compresses nothing as long as there is room before it. So what a wall
//! adds to a rate of density within the step counts as far as it exceeds the part of the density that is missing there. As
//! seen from the neighbours, too, the wall is not there for as much of the step.
//!
//! Only the demand on the pressure changes, and never the pressure's effect, so that the system stays symmetric.
//!
//! Fluid that comes near slowly closes gaps within the relaxation time anyway. (If gaps beside a floor were open for
//! whatever gravity pulls down within a step, still water would move by half as much again.)

use super::rigid::Rigid;
use super::solver::{RateOf, Solver};
use super::walls::Walls;
use crate::sph::core::Core;

/// The part of the rest density by which disorder alone may miss it.
const LOOSE: f64 = 0.01;

/// Gaps of which a particle closes less than this part of the rest density within the relaxation time close slowly. (Water
/// that turns along a round wall comes near to it, too. With a sixth of this it loses 2.2 % of its energy in half a turn,
/// and else 1.0.)
const SLOW: f64 = 0.3;

/// The particles that come near to walls, and working memory.
#[derive(Default)]
pub(super) struct Gaps {
    /// Particles before a gap that they close fast.
    closing: Vec<u32>,
    /// The part of this step, 0 to 1, in which walls are not there for a particle.
    open: Vec<f64>,
    /// Rates of density with all of the walls, kg/m³/s.
    with_walls: Vec<f64>,
}

impl Gaps {
    /// Finds the particles that close a gap fast by their motion, before the forces of a step act. Gaps are closed within
    /// the time `relaxation`, s, anyway.
    pub fn find(&mut self, core: &Core, walls: &Walls, relaxation: f64) {
        self.closing.clear();
        if core.parameters.fills_vessel || walls.mirrors().is_some() {
            return;
        }
        self.closing.extend(walls.found().iter().filter_map(|(i, (wall, _))| {
            let approach = wall.gradient.dot(core.particles.velocity.get(*i as usize)) - wall.sweep;
            (2.0 * approach * relaxation > SLOW && gap(core, *i) > 0.0).then_some(*i)
        }));
    }

    /// Takes from the rates of density in `forces` what walls cause within a step of the length `dt`, s, as long as gaps
    /// before them are open.
    pub fn take(&mut self, core: &Core, (forces, walls): (&mut Solver, &Walls), whole: &Rigid, dt: f64) {
        if self.closing.is_empty() {
            return;
        }
        let velocity = &core.particles.velocity;
        self.with_walls.clone_from(&forces.rate);
        self.open.clear();
        self.open.resize(velocity.x.len(), 0.0);
        // rates are linear in the open parts: all that the walls before these gaps add is what open ones would take
        self.closing.iter().for_each(|i| self.open[*i as usize] = 1.0);
        forces.find_rate_of(core, walls, velocity, RateOf::BeforeGaps(whole, &self.open));
        self.open.fill(0.0);
        let mut is_any_open = false;
        for i in &self.closing {
            let by_walls = self.with_walls[*i as usize] - forces.rate[*i as usize];
            if by_walls > 0.0 {
                self.open[*i as usize] = (gap(core, *i) / (dt * by_walls)).min(1.0);
                is_any_open = true;
            }
        }
        if is_any_open {
            forces.find_rate_of(core, walls, velocity, RateOf::BeforeGaps(whole, &self.open));
        } else {
            forces.rate.clone_from(&self.with_walls);
        }
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        4 * self.closing.capacity() + 8 * (self.open.capacity() + self.with_walls.capacity())
    }
}

/// The density that is missing around a particle, kg/m³.
fn gap(core: &Core, i: u32) -> f64 {
    (core.parameters.rest_density * (1.0 - LOOSE) - core.particles.density[i as usize]).max(0.0)
}
