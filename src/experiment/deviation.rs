//! How far a flow is from what its scene knows of it.
//!
//! Each deviation is a relative one in the L2 norm over the particles and all instants that were looked at together:
//! √(Σ (a − a*)² / Σ a*²). An instant at which what is known vanishes (a wave that turns) weighs nothing in the denominator
//! and as much as any other in the numerator.

use super::Experiment;
use crate::ir::{Given, Interpreter, Node};
use crate::lower::Scene;
use crate::sph::Simulation;

/// How far a flow is from what is known of it; nothing where nothing is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Deviation {
    /// Of the particles' pressures.
    pub pressure: Option<f64>,
    /// Of their velocities.
    pub velocity: Option<f64>,
    /// Of the front on the floor: where the outermost of the particles in the lowest layer and a half ends, half a spacing
    /// beyond its middle.
    pub front: Option<f64>,
}

impl Deviation {
    /// What may be known of a flow, in the order of [`Deviation::parts`].
    pub const NAMES: [&str; 3] = ["pressure", "velocity", "front"];

    /// All of it.
    pub fn parts(&self) -> [Option<f64>; 3] {
        [self.pressure, self.velocity, self.front]
    }
}

/// What is added up over the instants of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Deviations {
    /// Σ (a − a*)², in the order of [`Deviation::NAMES`].
    off: [f64; 3],
    /// Σ a*²
    size: [f64; 3],
    instants: usize,
}

impl Deviations {
    /// Takes the present state, if the scene knows anything of this instant.
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
            // a formula of t alone: the same for any particle
            compare(2, &[node], &|_, _| front(scene, simulation), 1);
        }
        self.instants += 1;
    }

    /// Over all instants so far.
    pub fn total(&self) -> Deviation {
        // not known at all: both sums are as they began
        let relative = |k: usize| {
            (self.off[k] != 0.0 || self.size[k] != 0.0).then(|| (self.off[k] / self.size[k]).sqrt())
        };
        Deviation { pressure: relative(0), velocity: relative(1), front: relative(2) }
    }

    /// Of how many instants something was known.
    pub fn instants(&self) -> usize {
        self.instants
    }

    /// All that is remembered, as numbers.
    pub fn memory(&self) -> [f64; 7] {
        let ([a, b, c], [d, e, f]) = (self.off, self.size);
        [a, b, c, d, e, f, self.instants as f64]
    }

    /// The other way.
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
