//! The figures of a run while it is running: those of the last saved instant, and the worst of all saved
//! instants.

use std::time::Duration;

use super::super::failure::Failure;
use rfm::Experiment;
use rfm::experiment::Deviations;
use rfm::sph::{Checkpoint, Simulation, Stats};

/// Name of the memory of [`Watch`] in a checkpoint.
pub(super) const WATCH: &str = "watch";

/// Number of figures in that memory, before the mark of the truth.
const FIGURES: usize = 17;

/// The figures of a run while it is running.
pub(super) struct Watch {
    /// Time that the steps have taken.
    pub spent: Duration,
    pub carved: usize,
    pub energy_at_start: f64,
    /// Figures of the last saved instant.
    pub now: Stats,
    /// The worst of each figure over all saved instants.
    pub worst: Stats,
    /// Sum of the neighbours per particle, and the number of instants in it.
    pub neighbours: (f64, usize),
    /// Deviations from the known solution of the flow.
    pub deviations: Deviations,
    /// [`Experiment::truth_mark`] of that solution.
    truth: u32,
}

impl Watch {
    /// # Errors
    /// The run goes on with another `truth`, of which instants have passed: what was compared with the old one says
    /// nothing of the new one.
    pub fn new(
        experiment: &Experiment,
        simulation: &Simulation,
        carved: usize,
        resumed: Option<&Checkpoint>,
    ) -> Result<Self, Failure> {
        let stats = simulation.stats();
        let energy = stats.kinetic_energy + stats.potential_energy;
        let mut watch = Self {
            spent: Duration::ZERO,
            carved,
            energy_at_start: energy,
            neighbours: (stats.neighbours_per_particle, 1),
            deviations: Deviations::default(),
            truth: experiment.truth_mark(),
            now: stats.clone(),
            worst: stats,
        };
        if let Some(memory) = resumed.and_then(|checkpoint| checkpoint.get(WATCH).ok()) {
            watch.take_up(memory);
            let now = experiment.truth_mark();
            if watch.truth != now {
                let truth = experiment.scene().truth;
                if let Some(truth) = truth.filter(|truth| truth.from <= simulation.time()) {
                    return Err(changed(watch.truth, truth.from, simulation.time()));
                }
                (watch.truth, watch.deviations) = (now, Deviations::default());
            }
        }
        Ok(watch)
    }

    /// The figures as numbers, for a checkpoint.
    pub fn memory(&self) -> Vec<f64> {
        let Self { spent, carved, energy_at_start, neighbours, worst, truth, .. } = self;
        let mut memory = vec![
            spent.as_secs_f64(),
            *carved as f64,
            *energy_at_start,
            neighbours.0,
            neighbours.1 as f64,
            worst.max_penetration,
            worst.inside as f64,
            worst.lost as f64,
            worst.non_finite as f64,
            worst.max_density_error,
        ];
        memory.extend(self.deviations.memory());
        memory.push(f64::from(*truth));
        memory
    }

    /// Restores the figures from a memory. A memory of another length is ignored.
    fn take_up(&mut self, memory: &[f64]) {
        // earlier versions did not note the truth
        let (memory, truth) = match memory {
            [memory @ .., truth] if memory.len() == FIGURES => (memory, Some(*truth as u32)),
            memory => (memory, None),
        };
        let Ok([spent, carved, start, sum, looks, depth, inside, lost, non_finite, density, deviations @ ..]) =
            <[f64; FIGURES]>::try_from(memory)
        else {
            return;
        };
        self.truth = truth.unwrap_or(self.truth);
        self.spent = Duration::try_from_secs_f64(spent).unwrap_or_default();
        self.carved = carved as usize;
        self.energy_at_start = start;
        self.neighbours = (sum, looks as usize);
        self.deviations = Deviations::remembered(deviations);
        self.worst = Stats {
            max_penetration: depth,
            inside: inside as usize,
            lost: lost as usize,
            non_finite: non_finite as usize,
            max_density_error: density,
            ..self.worst.clone()
        };
    }

    /// Takes the figures of the present state.
    pub fn look(&mut self, experiment: &Experiment, simulation: &Simulation) {
        self.deviations.look(experiment, simulation);
        let now = simulation.stats();
        self.neighbours.0 += now.neighbours_per_particle;
        self.neighbours.1 += 1;
        let worst = &mut self.worst;
        worst.max_penetration = worst.max_penetration.max(now.max_penetration);
        worst.inside = worst.inside.max(now.inside);
        worst.lost = worst.lost.max(now.lost);
        worst.non_finite = worst.non_finite.max(now.non_finite);
        worst.max_density_error = worst.max_density_error.max(now.max_density_error);
        self.now = now;
    }
}

/// Why a run cannot go on that is at a time `at`, s, and whose `truth` is another one from a time on.
fn changed(was: u32, from: f64, at: f64) -> Failure {
    let what = if was == 0 { "`truth` is new" } else { "`truth` has changed" };
    Failure::usage(format!(
        "cannot go on: {what}, and holds already (from t = {from} s, and the run is at t = {at} s). Let it begin later \
         (`from:`), or begin the run anew with --force"
    ))
}
