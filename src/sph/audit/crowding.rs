//! How close particles come to each other.
//!
//! Sums over neighbours are made for particles that stand about a spacing apart in all directions. A fluid that is
//! pressed flat or drawn out in less time than its particles need to mix keeps the rows that it began with: they come
//! close to each other one way, and far the other way. The sums then take it for denser than it is, by a fifth where
//! rows are 0.3 spacings apart, so that neither the volume nor the compression shows it, and pressures and forces are
//! up to three times too large.

use crate::sph::core::{Core, Count};

/// Particles within this many spacings of another one are crowded.
const NEAR: f64 = 0.5;

/// More crowded particles than this part of all, beyond what there were at the start, are a finding. Dam breaks and
/// splashes have up to 0.17 of them, drops that meet 0.24, layers that two plates press flat 0.35 to 0.85.
const MOST_CROWDED: f64 = 0.3;

/// Number of steps from one count to the next.
const LOOK: u64 = 16;

/// The part of the particles that is crowded.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Crowding {
    /// That at the start.
    pub at_start: f64,
    /// The greatest so far.
    pub most: f64,
}

impl Crowding {
    /// The crowding at the start of a simulation.
    pub fn start(core: &Core) -> Self {
        let share = crowded(core);
        Self { at_start: share, most: share }
    }

    /// Counts again, if it is time.
    pub fn look(&mut self, core: &Core) {
        if core.steps.is_multiple_of(LOOK) {
            self.most = self.most.max(crowded(core));
        }
    }

    /// A sentence about particles that were crowded.
    pub fn finding(&self) -> Option<String> {
        (self.most - self.at_start > MOST_CROWDED).then(|| {
            format!(
                "{:.0} % of the particles were closer to another one than half of their spacing at a time: rows of them were \
                 pressed together, or drawn out, faster than they could mix, and there pressures and forces are too large",
                100.0 * self.most
            )
        })
    }
}

/// The part of the particles that has another one closer than [`NEAR`]; none where walls have no density, as in the
/// paper's method, whose particles stand closer there.
fn crowded(core: &Core) -> f64 {
    let parameters = &core.parameters;
    if !parameters.walls_have_density() {
        return 0.0;
    }
    let mut counts = vec![0.0; core.particles.len()];
    core.sum(&Count { radius: NEAR * parameters.spacing() }, [], [&mut counts]);
    counts.iter().filter(|count| **count > 0.5).count() as f64 / counts.len() as f64
}
