//! How far a simulated flow is from the solution that its scene states in the block `truth`.
//!
//! Each deviation is relative, in the L2 norm over the particles and all sampled instants together: √(Σ (a −
//! a*)² / Σ a*²). Where the known value vanishes, as when a wave turns, that instant adds nothing to the
//! denominator, and as much as any other to the numerator.

use super::Experiment;
use crate::ir::{Given, Interpreter, Node};
use crate::lower::Scene;
use crate::sph::Simulation;

/// Relative deviations of a flow from its known solution; `None` for each quantity of which nothing is known.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Deviation {
    /// Deviation of the particles' pressures.
    pub pressure: Option<f64>,
    /// Deviation of the particles' velocities.
    pub velocity: Option<f64>,
    /// Deviation of the front on the floor of the box. The front lies half a spacing beyond the outermost
    /// particle of the lowest layer and a half.
    pub front: Option<f64>,
}

impl Deviation {
    /// Names of the quantities that may be known, in the order of [`Deviation::parts`].
    pub const NAMES: [&str; 3] = ["pressure", "velocity", "front"];

    /// The deviations as an array, in the order of [`Deviation::NAMES`].
    pub fn parts(&self) -> [Option<f64>; 3] {
        [self.pressure, self.velocity, self.front]
    }
}

/// Sums over the instants of a run from which the [`Deviation`] follows.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Deviations {
    /// Σ (a − a*)², in the order of [`Deviation::NAMES`].
    off: [f64; 3],
    /// Σ a*², in the order of [`Deviation::NAMES`].
    size: [f64; 3],
    instants: usize,
}

impl Deviations {
    /// Adds the present state of a simulation. Does nothing if the scene has no `truth`, or if the `truth`
    /// begins later.
    pub fn look(&mut self, experiment: &Experiment, simulation: &Simulation) {
        let (program, scene) = (experiment.program(), experiment.scene());
        let now = simulation.time();
        let Some(truth) = scene.truth.filter(|truth| now >= truth.from * (1.0 - 1e-12)) else { return };
        let particles = simulation.particles();
        let mut compare = |what: usize, nodes: &[Node], found: &dyn Fn(usize, usize) -> f64, count: usize| {
            let formulas = Interpreter::new(&program.module().graph, nodes);
            let mut known = [0.0; 3];
            let known = &mut known[..nodes.len()];
            for i in 0..count {
                let point = particles.position.get(i).to_array();
                formulas.eval_given(Given { time: now, ..Given::point(point) }, known);
                for (k, &known) in known.iter().enumerate() {
                    self.off[what] += (found(i, k) - known).powi(2);
                    self.size[what] += known * known;
                }
            }
        };
        if let Some(node) = truth.pressure {
            compare(0, &[node], &|i, _| particles.pressure[i], particles.len());
        }
        if let Some(nodes) = truth.velocity {
            compare(1, &nodes, &|i, k| particles.velocity.get(i)[k], particles.len());
        }
        if let Some(node) = truth.front {
            // the formula depends on t alone, so any particle will do
            compare(2, &[node], &|_, _| front(scene, simulation), 1);
        }
        self.instants += 1;
    }

    /// The deviations over all instants so far.
    pub fn total(&self) -> Deviation {
        // both sums are zero if the quantity is not known
        let relative = |k: usize| {
            (self.off[k] != 0.0 || self.size[k] != 0.0).then(|| (self.off[k] / self.size[k]).sqrt())
        };
        Deviation { pressure: relative(0), velocity: relative(1), front: relative(2) }
    }

    /// Number of instants that were compared.
    pub fn instants(&self) -> usize {
        self.instants
    }

    /// The sums as numbers, for a checkpoint: [`Deviations::remembered`] takes them back.
    pub fn memory(&self) -> [f64; 7] {
        let ([a, b, c], [d, e, f]) = (self.off, self.size);
        [a, b, c, d, e, f, self.instants as f64]
    }

    /// The sums that [`Deviations::memory`] returned.
    pub fn remembered([a, b, c, d, e, f, instants]: [f64; 7]) -> Self {
        Self { off: [a, b, c], size: [d, e, f], instants: instants as usize }
    }
}

/// How far along x the fluid has come on the floor of the box, m.
fn front(scene: &Scene, simulation: &Simulation) -> f64 {
    let (floor, spacing) = (scene.domain.min, simulation.parameters().spacing());
    let low = simulation.particles().position.iter().filter(|p| p.z < floor.z + 1.5 * spacing);
    low.map(|p| p.x + 0.5 * spacing).fold(floor.x, f64::max)
}
