//! One run of a flow: what it cost, and how far it was from what is known.

use serde::Serialize;

use rfm::Precision;
use rfm::experiment::Deviation;
use rfm::sph::Simulation;

/// One run of a scene, as a row of the report.
#[derive(Debug, Clone, Serialize)]
pub(super) struct FlowRun {
    pub method: &'static str,
    /// What the method's keys hold, as far as they are words: runs of other words are of another method.
    #[serde(skip)]
    pub words: Vec<(&'static str, &'static str)>,
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

    /// Relative deviations that rounding alone may leave.
    fn rounding(&self) -> f64 {
        if self.precision == Precision::F64.name() { 1e-12 } else { 1e-6 }
    }

    /// Sets the orders of convergence from the coarser run before this one.
    pub fn compare(&mut self, coarser: &Self) {
        let halvings = (coarser.spacing / self.spacing).ln();
        if (coarser.method, &coarser.words) != (self.method, &self.words) || halvings <= 0.0 {
            return;
        }
        let rounding = self.rounding();
        let order = |coarse: Option<f64>, fine: Option<f64>| {
            // errors at the level of rounding say nothing about the method
            let (coarse, fine) = (coarse?, fine.filter(|fine| *fine > rounding)?);
            Some((coarse / fine).ln() / halvings).filter(|order| order.is_finite())
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
            words: parameters.method.words(),
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

#[cfg(test)]
mod tests {
    use super::*;

    fn run(spacing: f64, error: f64, precision: &'static str) -> FlowRun {
        FlowRun {
            method: "wcsph",
            words: Vec::new(),
            precision,
            particles: 1,
            spacing,
            steps: 1,
            simulated_seconds: 1.0,
            pressure_error: Some(error),
            velocity_error: None,
            front_error: None,
            pressure_order: None,
            velocity_order: None,
            front_order: None,
            cpu_seconds: 1.0,
            cpu_seconds_per_simulated_second: 1.0,
            seconds: 1.0,
            failure: None,
        }
    }

    #[test]
    fn orders_come_from_errors_above_rounding() {
        let order = |coarse: f64, fine: f64, precision| {
            let mut finer = run(0.1, fine, precision);
            finer.compare(&run(0.2, coarse, precision));
            finer.pressure_order
        };
        assert!((order(0.04, 0.01, "f64").unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(order(2e-16, 3e-16, "f64"), None);
        assert_eq!(order(1e-2, 3e-16, "f64"), None);
        assert_eq!(order(2e-8, 3e-7, "f32"), None);
        assert!(order(2e-8, 3e-7, "f64").is_some());
    }
}
