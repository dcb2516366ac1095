//! A scene at its start, and the probes that take samples from then on.

use pyo3::prelude::*;
use rfm::diagnostic::Diagnostics;
use rfm::experiment::{Every, Start, probe_column};
use rfm::mesh::Watch as _;
use rfm::sph::{Checkpoint, Gauge, Simulation};
use rfm::{Engine, Experiment, Program};

use crate::error::{raised, refused};
use crate::pool::Watch;

/// A scene at its start.
pub struct Begun {
    pub experiment: Experiment,
    pub at_start: Diagnostics,
    pub simulation: Simulation,
    pub recorders: Vec<Recorder>,
}

/// Fills a scene with particles. `None` if that is not wanted any more.
///
/// # Errors
/// What is wrong with the scene, or its probes.
pub fn begin(file: &Program, scene: &str, watch: &Watch) -> Result<Option<Begun>, NotBegun> {
    let experiment = Experiment::new(file, scene, Engine::Auto).map_err(NotBegun::Scene)?;
    if watch.is_over() {
        return Ok(None);
    }
    let Start { mut simulation, warnings, .. } = experiment.start().map_err(NotBegun::Scene)?;
    if watch.is_over() {
        return Ok(None);
    }
    let mut at_start = experiment.warnings();
    at_start.list.extend(warnings.list);
    let recorders = recorders(&experiment, &mut simulation, None).map_err(NotBegun::Probe)?;
    Ok(Some(Begun { experiment, at_start, simulation, recorders }))
}

/// Why a scene has no start.
pub enum NotBegun {
    Scene(rfm::Error),
    Probe(PyErr),
}

impl NotBegun {
    /// The exception.
    pub fn raised(self, py: Python<'_>) -> PyErr {
        match self {
            Self::Scene(error) => raised(py, error),
            Self::Probe(error) => error,
        }
    }
}

/// A probe with the samples that it has taken.
pub struct Recorder {
    pub name: String,
    pub gauge: Gauge,
    clock: Every,
    pub times: Vec<f64>,
    /// One column for each figure of a sample.
    pub figures: Vec<Vec<f64>>,
}

impl Recorder {
    /// Takes a sample if one is due.
    pub fn sample(&mut self, simulation: &Simulation) {
        if !self.clock.is_due(simulation.time()) {
            return;
        }
        self.times.push(simulation.time());
        for (column, figure) in self.figures.iter_mut().zip(simulation.sample(&mut self.gauge)) {
            column.push(figure);
        }
    }
}

/// The probes of a scene, sampled at the present instant.
///
/// # Errors
/// `RfmError` for a probe that measures nothing.
pub fn recorders(
    experiment: &Experiment,
    simulation: &mut Simulation,
    resumed: Option<&Checkpoint>,
) -> PyResult<Vec<Recorder>> {
    let scene = experiment.scene();
    let mut recorders = Vec::new();
    for stated in &scene.probes {
        let probe = stated.measured;
        let gauge = match resumed {
            Some(from) => {
                let memory = from.get(&probe_column(&stated.name)).unwrap_or_default();
                simulation.gauge_at(probe, from, memory)
            }
            None => simulation.gauge(probe),
        };
        let gauge = gauge.map_err(|error| refused(format!("probe `{}`: {error}", stated.name)))?;
        let every = stated.every.unwrap_or(scene.run.save_every);
        let begin = if resumed.is_some() { simulation.time() } else { -every };
        let figures = vec![Vec::new(); probe.columns().len()];
        let clock = Every::after(every, begin);
        recorders.push(Recorder { name: stated.name.clone(), gauge, clock, times: Vec::new(), figures });
    }
    recorders.iter_mut().for_each(|recorder| recorder.sample(simulation));
    Ok(recorders)
}
