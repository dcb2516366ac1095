//! Rows of particles that come close to each other.
//!
//! Sums over neighbours are made for particles that stand about a spacing apart in all directions. A fluid that is
//! pressed flat or drawn out in less time than its particles need to mix keeps the rows that it began with: they come
//! close to each other one way, and far the other way. The sums then say a greater density than there is, by a fifth
//! where rows are 0.3 spacings apart, and the pressure grows until the rows stand so far apart that the sums are right.
//! Volume and compression are found by the same sums and show nothing, but pressures and forces are up to three times
//! too large.

use crate::sph::core::{Core, Count};

/// Particles within this many spacings of another one are crowded.
const NEAR: f64 = 0.5;

/// More crowded particles than this part of all, beyond what there were at the start, are a finding. Dam breaks and
/// splashes have up to 0.17 of them, drops that meet 0.24, layers that two plates press flat 0.35 to 0.85.
const MOST_CROWDED: f64 = 0.3;

/// In fewer particles than this, a few pairs are no rows.
const FEWEST: usize = 100;

/// Number of steps from one count to the next. Methods that keep the density take few long steps, in which a layer may be
/// pressed flat within fifteen.
const LOOK: u64 = 16;
const LOOK_OF_LONG_STEPS: u64 = 2;

/// The part of the particles that is crowded.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Rows {
    /// That at the start.
    pub at_start: f64,
    /// The greatest so far.
    pub most: f64,
}

impl Rows {
    /// The crowding at the start of a simulation.
    pub fn start(core: &Core) -> Self {
        let share = crowded(core);
        Self { at_start: share, most: share }
    }

    /// Counts again, if it is time.
    pub fn look(&mut self, core: &Core) {
        let every = if core.parameters.keeps_density() { LOOK_OF_LONG_STEPS } else { LOOK };
        if core.steps.is_multiple_of(every) {
            self.most = self.most.max(crowded(core));
        }
    }

    /// A sentence about particles that were crowded.
    pub fn finding(&self) -> Option<String> {
        (self.most - self.at_start > MOST_CROWDED).then(|| {
            format!(
                "{:.0} % of the particles were closer to another one than half of their spacing at a time: where rows of \
                 them are pressed together, or drawn out, faster than they can mix, pressures and forces come out too large",
                100.0 * self.most
            )
        })
    }
}

/// The part of the particles that has another one closer than [`NEAR`]; none where walls have no density, as in the
/// paper's method, whose particles stand closer there.
fn crowded(core: &Core) -> f64 {
    let (parameters, n) = (&core.parameters, core.particles.len());
    if !parameters.walls_have_density() || n < FEWEST {
        return 0.0;
    }
    let mut counts = vec![0.0; n];
    core.sum(&Count { radius: NEAR * parameters.spacing() }, [], [&mut counts]);
    counts.iter().filter(|count| **count > 0.5).count() as f64 / n as f64
}
