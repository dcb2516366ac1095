//! One run of a flow: what it cost, and how far it was from what is known.

use serde::Serialize;

use rfm::experiment::Deviation;
use rfm::sph::Simulation;

/// One run of a scene, as a row of the report.
#[derive(Debug, Clone, Serialize)]
pub(super) struct FlowRun {
    pub method: &'static str,
    /// Precision of the sums over neighbours.
    pub precision: &'static str,
    pub particles: usize,
    /// Particle spacing, m.
    pub spacing: f64,
    pub steps: u64,
    /// Simulated time, s.
    pub simulated_seconds: f64,
    pub pressure_error: Option<f64>,
    pub velocity_error: Option<f64>,
    pub front_error: Option<f64>,
    /// Order p of error ∝ spacingᵖ between this run and the coarser one before it.
    pub pressure_order: Option<f64>,
    pub velocity_order: Option<f64>,
    pub front_order: Option<f64>,
    /// Processor time of all threads, for the steps alone, s.
    pub cpu_seconds: f64,
    pub cpu_seconds_per_simulated_second: f64,
    /// Time by the clock, for the steps alone, s.
    pub seconds: f64,
    /// Why the run ended before its end.
    pub failure: Option<String>,
}

impl FlowRun {
    /// The errors in the order of [`Deviation::NAMES`]; `None` if the run failed.
    pub fn errors(&self) -> [Option<f64>; 3] {
        [self.pressure_error, self.velocity_error, self.front_error]
    }

    pub fn orders(&self) -> [Option<f64>; 3] {
        [self.pressure_order, self.velocity_order, self.front_order]
    }

    /// Sets the orders of convergence from the coarser run before this one.
    pub fn compare(&mut self, coarser: &Self) {
        let halvings = (coarser.spacing / self.spacing).ln();
        if coarser.method != self.method || halvings <= 0.0 {
            return;
        }
        let order = |coarse: Option<f64>, fine: Option<f64>| {
            Some((coarse? / fine?).ln() / halvings).filter(|order| order.is_finite())
        };
        self.pressure_order = order(coarser.pressure_error, self.pressure_error);
        self.velocity_order = order(coarser.velocity_error, self.velocity_error);
        self.front_order = order(coarser.front_error, self.front_error);
    }

    /// The row of a run that has ended, with the seconds that it took on processors and by the clock. The
    /// orders of convergence are not known yet.
    pub fn of(
        simulation: &Simulation,
        deviation: Deviation,
        [cpu_seconds, seconds]: [f64; 2],
        failure: Option<String>,
    ) -> Self {
        let parameters = simulation.parameters();
        Self {
            method: parameters.method.name(),
            precision: parameters.precision.name(),
            particles: simulation.particles().len(),
            spacing: parameters.spacing(),
            steps: simulation.steps(),
            simulated_seconds: simulation.time(),
            pressure_error: deviation.pressure,
            velocity_error: deviation.velocity,
            front_error: deviation.front,
            pressure_order: None,
            velocity_order: None,
            front_order: None,
            cpu_seconds,
            cpu_seconds_per_simulated_second: cpu_seconds / simulation.time(),
            seconds,
            failure,
        }
    }
}
