//! The class `Simulation`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Instant;

use pyo3::exceptions::{PyBufferError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple, PyType};
use rfm::Experiment;
use rfm::diagnostic::Diagnostics;
use rfm::experiment::probe_column;
use rfm::fluid_surface::Reconstruction;
use rfm::glam::DVec3;
use rfm::sph::{Checkpoint, Simulation, StepError};

use crate::begin::{Begun, Recorder, begin, recorders};
use crate::error::{diagnostics, not_read, refused};
use crate::mesh::{Found, PyMesh, write_file};
use crate::pool::{LOOK, Threads, run, run_watched};
use crate::program::PyProgram;
use crate::show;
use crate::state::{self, Lent};

/// Folder of checkpoints in that of a run; that of `rfm run`, too.
const CHECKPOINTS: &str = "checkpoints";

/// A fluid in the scene of a file.
///
/// ``program.scene("drop")`` makes one at its start. Arrays of particles are copies in the order in which the
/// particles were made, so that a row is always the same particle. Quantities are in SI units. While one thread
/// takes steps, others get a ``RuntimeError`` for all but ``time``, ``steps``, ``len`` and what stays the same: these
/// tell how far it was a moment ago.
#[pyclass(frozen, module = "rfm", name = "Simulation")]
pub struct PySimulation {
    program: Py<PyProgram>,
    experiment: Experiment,
    threads: Threads,
    /// Messages about the scene and its start.
    at_start: Diagnostics,
    /// Those, and the ones about obstacles that do not fit the particles. These take up to a second to find, so they
    /// are found when somebody asks.
    warnings: PyOnceLock<Py<PyTuple>>,
    state: Mutex<State>,
    now: Mutex<Now>,
}

/// How far a simulation is: what is told while it takes steps, too.
#[derive(Clone, Copy)]
struct Now {
    time: f64,
    steps: u64,
    particles: usize,
    /// Mass of a particle, kg.
    mass: f64,
    /// m.
    spacing: f64,
}

impl Now {
    fn of(simulation: &Simulation) -> Self {
        let parameters = simulation.parameters();
        Self {
            time: simulation.time(),
            steps: simulation.steps(),
            particles: simulation.particles().len(),
            mass: parameters.particle_mass,
            spacing: parameters.spacing(),
        }
    }
}

/// What changes with each step.
struct State {
    simulation: Simulation,
    recorders: Vec<Recorder>,
    /// Why no further step can be taken.
    failed: Option<StepError>,
    /// Held by all views of the state.
    lent: Lent,
}

/// When steps end.
#[derive(Clone, Copy)]
enum Goal {
    /// After this many steps of the simulation.
    Steps(u64),
    /// At a time, s.
    Time(f64),
}

impl State {
    /// Takes steps until the goal is reached, a step fails, or it is time to look for Ctrl-C. Breaks in the
    /// first two cases.
    fn go_on(&mut self, goal: Goal) -> ControlFlow<()> {
        let started = Instant::now();
        loop {
            let (steps, time) = (self.simulation.steps(), self.simulation.time());
            let (reached, longest) = match goal {
                Goal::Steps(last) => (steps >= last, f64::INFINITY),
                Goal::Time(end) => (time >= end * (1.0 - 1e-12), end - time),
            };
            if reached {
                return ControlFlow::Break(());
            }
            if let Err(error) = self.simulation.step_at_most(longest) {
                self.failed = Some(error);
                return ControlFlow::Break(());
            }
            self.recorders.iter_mut().for_each(|recorder| recorder.sample(&self.simulation));
            if started.elapsed() >= LOOK {
                return ControlFlow::Continue(());
            }
        }
    }
}

impl PySimulation {
    pub fn new(program: &Bound<'_, PyProgram>, scene: &str, threads: Threads) -> PyResult<Self> {
        let py = program.py();
        let (file, scene) = (program.get().program.clone(), scene.to_string());
        let begun = run_watched(py, threads, move |watch| begin(&file, &scene, watch))?;
        let Some(Begun { experiment, at_start, simulation, recorders }) =
            begun.map_err(|error| error.raised(py))?
        else {
            return Err(PyRuntimeError::new_err("the start of the scene was left unfinished"));
        };
        let now = Mutex::new(Now::of(&simulation));
        let state = State { simulation, recorders, failed: None, lent: Lent::default() };
        Ok(Self {
            program: program.clone().unbind(),
            experiment,
            threads,
            at_start,
            warnings: PyOnceLock::new(),
            state: Mutex::new(state),
            now,
        })
    }

    /// The state, if no other thread is taking steps.
    fn state(&self) -> PyResult<MutexGuard<'_, State>> {
        match self.state.try_lock() {
            Ok(state) => Ok(state),
            Err(TryLockError::WouldBlock) => {
                Err(PyRuntimeError::new_err("the simulation is taking steps in another thread"))
            }
            Err(TryLockError::Poisoned(_)) => Err(PyRuntimeError::new_err(
                "a step of the simulation was interrupted by an error of the program",
            )),
        }
    }

    /// How far it is; a moment ago, if another thread takes steps.
    fn now(&self) -> Now {
        // it is copied as a whole, so a thread that panicked left nothing half done
        *self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set_now(&self, simulation: &Simulation) {
        *self.now.lock().unwrap_or_else(PoisonError::into_inner) = Now::of(simulation);
    }

    /// The state, to be changed.
    fn state_to_change(&self) -> PyResult<MutexGuard<'_, State>> {
        let state = self.state()?;
        if state.lent.is_out() {
            let message =
                "views of the particles are in use: delete them, or copy them, before the next step";
            return Err(PyBufferError::new_err(message));
        }
        if let Some(error) = &state.failed {
            return Err(refused(format!("the simulation has ended: {error}")));
        }
        Ok(state)
    }

    /// Takes steps up to a goal, and looks for Ctrl-C on the way.
    fn go_on(
        &self,
        py: Python<'_>,
        goal: Goal,
        mut report: impl FnMut(&Simulation) -> PyResult<()>,
    ) -> PyResult<()> {
        let mut state = self.state_to_change()?;
        let state = &mut *state;
        while run(py, self.threads, || state.go_on(goal))?.is_continue() {
            self.set_now(&state.simulation);
            report(&state.simulation)?;
            py.check_signals()?;
        }
        self.set_now(&state.simulation);
        report(&state.simulation)?;
        match &state.failed {
            Some(error) => Err(refused(error)),
            None => Ok(()),
        }
    }

    fn column(&self, of: impl Fn(&Simulation) -> &[f64]) -> PyResult<Py<PyAny>> {
        let state = self.state()?;
        Python::attach(|py| Ok(state::column_by_id(py, of(&state.simulation), state.simulation.particles())))
    }
}

/// Writes how far a simulation is to standard error, on one line.
fn show_progress(py: Python<'_>, simulation: &Simulation, until: f64, end: &str) -> PyResult<()> {
    let (time, steps, speed) = (simulation.time(), simulation.steps(), simulation.speed());
    let part = 100.0 * (time / until).clamp(0.0, 1.0);
    let line = format!("\r{part:3.0} %  t = {time:.4} of {until} s, step {steps}, {speed:.2} m/s   {end}");
    let out = py.import("sys")?.getattr("stderr")?;
    if out.is_none() {
        return Ok(()); // a program without a terminal
    }
    out.call_method1("write", (line,))?;
    out.call_method0("flush")?;
    Ok(())
}

#[pymethods]
impl PySimulation {
    /// Program that the scene comes from.
    #[getter]
    fn program(&self, py: Python<'_>) -> Py<PyProgram> {
        self.program.clone_ref(py)
    }

    /// Name of the scene.
    #[getter]
    fn name(&self) -> &str {
        &self.experiment.scene().name
    }

    /// Messages about the scene, its start, and obstacles that do not fit the particles: a tuple of `Diagnostic`. The
    /// first question takes up to a second. ``rfm check`` also looks for formulas that jump.
    #[getter]
    fn warnings(&self, py: Python<'_>) -> PyResult<Py<PyTuple>> {
        let found = self.warnings.get_or_try_init(py, || {
            let misfits = run(py, self.threads, || self.experiment.misfits())?;
            let mut found = self.at_start.clone();
            found.list.extend(misfits.list);
            Ok::<_, PyErr>(diagnostics(py, &found)?.unbind())
        })?;
        Ok(found.clone_ref(py))
    }

    /// Simulated time, s.
    #[getter]
    fn time(&self) -> f64 {
        self.now().time
    }

    /// Number of steps taken.
    #[getter]
    fn steps(&self) -> u64 {
        self.now().steps
    }

    /// Time at which a run of the scene ends, s, as the file states it.
    #[getter]
    fn until(&self) -> f64 {
        self.experiment.scene().run.until
    }

    /// Mass of a particle, kg: ``len(simulation)`` of them have that of the fluid.
    #[getter]
    fn particle_mass(&self) -> f64 {
        self.now().mass
    }

    /// Distance of particles, m: the side of a cube of the fluid with the mass of one.
    #[getter]
    fn spacing(&self) -> f64 {
        self.now().spacing
    }

    /// The box of the scene: array of shape (2, 3), m.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let domain = self.experiment.domain();
        let corners = [domain.min, domain.max].map(|corner| corner.to_array().to_vec());
        Ok(numpy::PyArray2::from_vec2(py, &corners).map_err(refused)?.into_any())
    }

    /// Number of particles.
    fn __len__(&self) -> usize {
        self.now().particles
    }

    /// Places of the particles: a copy, array of shape (n, 3), m.
    #[getter]
    fn positions(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let state = self.state()?;
        let particles = state.simulation.particles();
        state::vectors_by_id(py, &particles.position, particles)
    }

    /// Velocities of the particles: a copy, array of shape (n, 3), m/s.
    #[getter]
    fn velocities(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let state = self.state()?;
        let particles = state.simulation.particles();
        state::vectors_by_id(py, &particles.velocity, particles)
    }

    /// Densities of the particles: a copy, array of shape (n,), kg/m³.
    #[getter]
    fn density(&self) -> PyResult<Py<PyAny>> {
        self.column(|simulation| &simulation.particles().density)
    }

    /// Pressures of the particles: a copy, array of shape (n,), Pa.
    #[getter]
    fn pressure(&self) -> PyResult<Py<PyAny>> {
        self.column(|simulation| &simulation.particles().pressure)
    }

    /// The particles without a copy.
    ///
    /// Returns
    /// -------
    /// Dictionary of read-only arrays of shape (n,): ``x``, ``y``, ``z`` (m), ``u``, ``v``, ``w`` (velocity, m/s),
    /// ``density`` (kg/m³), ``pressure`` (Pa) and ``id``. Particles stand in the solver's order, which changes;
    /// the copies are in the order of ``id``. A step is refused with a ``BufferError`` while one of the
    /// arrays, or a view of it, is alive.
    fn views<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let state = slf.get().state()?;
        state::views(slf.as_any(), state.simulation.particles(), &state.lent)
    }

    /// Takes steps, each as long as the method allows or the scene states.
    ///
    /// Parameters
    /// ----------
    /// count : int, not negative
    ///
    /// Raises
    /// ------
    /// RfmError
    ///     If numbers became useless. The simulation has then ended.
    /// KeyboardInterrupt
    ///     After Ctrl-C. The simulation may go on from the last whole step.
    #[pyo3(signature = (count=1))]
    fn step(&self, py: Python<'_>, count: i64) -> PyResult<()> {
        let Ok(count) = u64::try_from(count) else {
            return Err(PyValueError::new_err(format!("count is {count}, expected 0 or more steps")));
        };
        let last = self.state()?.simulation.steps().saturating_add(count);
        self.go_on(py, Goal::Steps(last), |_| Ok(()))
    }

    /// Takes steps until a time, at which the last step ends; none if that time has passed.
    ///
    /// Parameters
    /// ----------
    /// until : float, s
    /// progress : bool
    ///     Show on standard error how far it is.
    ///
    /// Raises
    /// ------
    /// RfmError, KeyboardInterrupt
    ///     As `step`.
    #[pyo3(signature = (until, *, progress=false))]
    fn advance(&self, py: Python<'_>, until: f64, progress: bool) -> PyResult<()> {
        if !until.is_finite() {
            return Err(PyValueError::new_err(format!("until is {until} s, expected a finite time")));
        }
        let result = self.go_on(py, Goal::Time(until), |simulation| match progress {
            true => show_progress(py, simulation, until, ""),
            false => Ok(()),
        });
        if progress && let Ok(state) = self.state() {
            show_progress(py, &state.simulation, until, "\n")?;
        }
        result
    }

    /// The surface of the fluid as it is now: what ``rfm render --surface`` draws and ``rfm mesh DIR --fluid`` writes.
    ///
    /// The fluid goes up to a wall of the box that it touches, and never beyond it. Particles whose places are not finite
    /// are left out.
    ///
    /// Parameters
    /// ----------
    /// cell : float, m, optional
    ///     Size of a cell of the marching cubes; a quarter of `spacing` if it is not stated.
    ///
    /// Returns
    /// -------
    /// `Mesh`; an empty one without particles
    ///
    /// Raises
    /// ------
    /// RfmError
    ///     If the cell is too small for the particles, or for the extent of the fluid.
    #[pyo3(signature = (*, cell=None))]
    fn surface(&self, py: Python<'_>, cell: Option<f64>) -> PyResult<PyMesh> {
        let state = self.state()?;
        let position = &state.simulation.particles().position;
        let places: Vec<DVec3> =
            (0..position.len()).map(|i| position.get(i)).filter(|p| p.is_finite()).collect();
        let advised = Reconstruction::of_radius(0.5 * state.simulation.parameters().spacing());
        drop(state);
        let vessel = Some(self.experiment.domain());
        let reconstruction = Reconstruction { cell: cell.unwrap_or(advised.cell), vessel, ..advised };
        let made = run(py, self.threads, || reconstruction.mesh(&places))?;
        Ok(Found::of_fluid(made.map_err(refused)?))
    }

    /// What energy, volume and densities have shown since the start: `Audit`.
    #[getter]
    fn audit<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let state = self.state()?;
        let (audit, compression) = (state.simulation.audit(), state.simulation.audit().compression());
        let findings: Vec<String> = state.simulation.findings().into_iter().map(|(_, text)| text).collect();
        CLASS.import(py, "rfm._records", "Audit")?.call1((
            audit.energy_excess(),
            audit.unjudged(),
            audit.wall_work(),
            audit.volume_change(),
            compression.mean,
            compression.p99,
            compression.largest,
            audit.crowded(),
            audit.max_speed(),
            PyTuple::new(py, findings)?,
        ))
    }

    /// Figures of the present state: `Stats`.
    #[getter]
    fn stats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        let state = self.state()?;
        let simulation = &state.simulation;
        let stats = run(py, self.threads, || simulation.stats())?;
        CLASS.import(py, "rfm._records", "Stats")?.call1((
            stats.particles,
            stats.kinetic_energy,
            stats.potential_energy,
            <(f64, f64, f64)>::from(stats.momentum),
            stats.max_speed,
            stats.max_density_error,
            stats.inside,
            stats.lost,
            stats.non_finite,
        ))
    }

    /// Samples of the scene's probes by their names, up to now, and from the resumed instant on after `resume`.
    ///
    /// Returns
    /// -------
    /// Dictionary of dictionaries of arrays of shape (samples,): ``time``, s, and a figure under each name of the
    /// columns, in the units that `probe_units` states.
    #[getter]
    fn probes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let state = self.state()?;
        let probes = PyDict::new(py);
        for recorder in &state.recorders {
            let table = PyDict::new(py);
            table.set_item("time", numpy::PyArray1::from_slice(py, &recorder.times))?;
            for ((name, _), figures) in recorder.gauge.probe.columns().iter().zip(&recorder.figures) {
                table.set_item(name, numpy::PyArray1::from_slice(py, figures))?;
            }
            probes.set_item(&recorder.name, table)?;
        }
        Ok(probes)
    }

    /// Units of the columns of each probe.
    #[getter]
    fn probe_units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let probes = PyDict::new(py);
        for stated in &self.experiment.scene().probes {
            let units = PyDict::new(py);
            units.set_item("time", "s")?;
            for (name, unit) in stated.measured.columns() {
                units.set_item(name, unit)?;
            }
            probes.set_item(&stated.name, units)?;
        }
        Ok(probes)
    }

    /// Saves the state for `resume`, and for ``rfm run --resume``.
    ///
    /// Parameters
    /// ----------
    /// folder : str or path
    ///     Folder of the run; it is made if it does not exist. The state becomes a file in its ``checkpoints``.
    ///
    /// Returns
    /// -------
    /// Path of the file
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<PathBuf> {
        let state = self.state_to_change()?;
        let mut checkpoint = state.simulation.checkpoint();
        self.experiment.mark().stamp(&mut checkpoint);
        for recorder in &state.recorders {
            checkpoint.set(&probe_column(&recorder.name), recorder.gauge.memory().to_vec());
        }
        let folder = folder.join(CHECKPOINTS);
        std::fs::create_dir_all(&folder).map_err(|error| not_read(&folder.display().to_string(), error))?;
        let path = folder.join(Checkpoint::file_name(checkpoint.steps));
        py.detach(|| write_file(&path, |mut out| checkpoint.write(&mut out)))?;
        Ok(path)
    }

    /// Goes on from a state that `save` or ``rfm run`` has saved for the same scene. Every later step has the
    /// bits that it would have had without the interruption.
    ///
    /// Parameters
    /// ----------
    /// folder : str or path
    ///     Folder of the run, whose newest state is taken, or a file with a state.
    ///
    /// Raises
    /// ------
    /// RfmError
    ///     If there is no sound state, or if it belongs to another scene. The simulation then stays as it is.
    fn resume(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let mut state = self.state()?;
        if state.lent.is_out() {
            return Err(PyBufferError::new_err(
                "views of the particles are in use: delete them, or copy them",
            ));
        }
        let path = if folder.is_dir() { newest(&folder.join(CHECKPOINTS))? } else { folder };
        let bytes = std::fs::read(&path).map_err(|error| not_read(&path.display().to_string(), error))?;
        let unusable = |why: String| refused(format!("cannot go on from `{}`: {why}", path.display()));
        let checkpoint = Checkpoint::read(&bytes).map_err(|error| unusable(error.to_string()))?;
        let mark = self.experiment.mark();
        if !mark.fits(&checkpoint) {
            let mut why = "it belongs to another scene, or this one was changed since".to_string();
            let differences = mark.differences(&checkpoint);
            if !differences.is_empty() {
                why.push_str(&format!(": {}", differences.join(", ")));
            }
            return Err(unusable(why));
        }
        let resumed = run(py, self.threads, || {
            let mut simulation =
                self.experiment.resume(&checkpoint).map_err(|error| unusable(error.to_string()))?;
            let recorders = recorders(&self.experiment, &mut simulation, Some(&checkpoint))?;
            Ok::<_, PyErr>((simulation, recorders))
        })?;
        let (simulation, recorders) = resumed?;
        self.set_now(&simulation);
        *state = State { simulation, recorders, failed: None, lent: Lent::default() };
        Ok(())
    }

    /// The particles and the obstacles as they are now, in the viewer's page, for notebooks.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        let state = self.state()?;
        show::simulation(py, &self.experiment, &state.simulation, self.threads)
    }

    fn __repr__(&self) -> String {
        let Now { particles, time, .. } = self.now();
        format!("<rfm.Simulation {}: {particles} particles, t = {time} s>", self.name())
    }
}

/// The newest state in a folder.
fn newest(folder: &Path) -> PyResult<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let steps = entries.filter_map(|entry| Checkpoint::steps_of_file(entry.file_name().to_str()?));
    match steps.max() {
        Some(steps) => Ok(folder.join(Checkpoint::file_name(steps))),
        None => Err(refused(format!("there is no state in `{}` to go on from", folder.display()))),
    }
}
