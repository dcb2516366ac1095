//! From the text of a file to what is shown: the solids as meshes at once, then the simulation.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use glam::DVec3;

use super::super::args::{Shared, View};
use super::super::choose;
use super::super::failure::Failure;
use super::super::input;
use super::super::run::bodies::Bodies;
use super::plots::History;
use crate::cli::output::Shown;
use rfm::compile::files_beside;
use rfm::diagnostic::{Diagnostics, Style, render};
use rfm::files::Files;
use rfm::geom::Aabb;
use rfm::lower::{Gravity, Options, Scene};
use rfm::mesh::{Mesh, split_creases};
use rfm::quantity::Dimension;
use rfm::sph::Simulation;
use rfm::view::{
    Array, Corners, Frame, FrameHead, Lattice, Levels, Param, Setting, VELOCITY, pack_frame, pack_mesh,
};
use rfm::{Engine, Error, Experiment, Program, Solid};

/// What is viewed, as the command line states it.
pub(super) struct Subject {
    pub path: PathBuf,
    scene: Option<String>,
    solid: Option<String>,
    cells: usize,
    define: BTreeMap<String, f64>,
    dimensions: BTreeMap<String, Dimension>,
    max_nodes: usize,
    /// The files that it names.
    files: Files,
    engine: Engine,
}

/// A file without errors, with values for its params.
pub(super) struct Checked {
    pub program: Program,
    /// The scene that is simulated; `None` if only a solid is shown.
    pub scene: Option<Scene>,
    solid: Option<String>,
}

/// Solids with the block of their mesh and the box in which they are shown.
pub(super) struct Standing {
    pub mesh: Vec<u8>,
    pub solids: Vec<Solid>,
    pub domain: Aabb,
}

/// A simulation with what is drawn of its scene.
pub(super) struct Running {
    pub simulation: Simulation,
    pub experiment: Experiment,
    pub history: History,
    bodies: Bodies,
    lattice: Lattice,
}

/// How fine a mesh is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Detail {
    /// It is shown while a slider moves.
    Passing,
    /// It stays.
    Lasting,
}

/// Most cells along the longest side of a mesh that is shown while a slider moves.
const PASSING_CELLS: usize = 40;

/// What tells one state of a file from another one.
pub(super) type Stamp = Option<Vec<Option<(SystemTime, u64)>>>;

impl Subject {
    pub fn new(shared: &Shared, options: &View) -> Self {
        Self {
            path: options.subject.clone(),
            scene: options.scene.clone(),
            solid: options.solid.clone(),
            cells: options.mesh_cells,
            define: shared.define.iter().map(|given| (given.name.clone(), given.value)).collect(),
            dimensions: shared
                .define
                .iter()
                .filter_map(|given| Some((given.name.clone(), given.dimension?)))
                .collect(),
            max_nodes: shared.max_nodes,
            files: files_beside(&options.subject, shared.allow_outside),
            engine: shared.engine.into(),
        }
    }

    /// When the file was written, and its length, and those of the files that it names; `None` while it is not there.
    pub fn stamp(&self) -> Stamp {
        let of = |path: &Path| {
            let file = std::fs::metadata(path).ok()?;
            Some((file.modified().ok()?, file.len()))
        };
        let own = of(&self.path)?;
        let named = self.files.asked();
        Some(std::iter::once(Some(own)).chain(named.iter().map(|name| of(Path::new(name)))).collect())
    }

    /// Reads the files that the file names anew when it is next checked.
    pub fn forget(&self) {
        self.files.forget();
    }

    pub fn title(&self) -> String {
        self.path.file_name().map_or_else(|| self.path.shown(), |name| Path::new(name).shown())
    }

    /// Reads and checks the file, with values for params besides those of the command line.
    ///
    /// # Errors
    /// The messages, as the command line shows them.
    pub fn checked(&self, values: &BTreeMap<String, f64>) -> Result<Checked, String> {
        let source = input::read(&self.path).map_err(message)?;
        let mut overrides = self.define.clone();
        overrides.extend(values.iter().map(|(name, value)| (name.clone(), *value)));
        let dimensions = self.dimensions.clone();
        let options = Options {
            overrides,
            dimensions,
            max_nodes: self.max_nodes,
            files: self.files.clone(),
            ..Options::default()
        };
        let program = Program::check(source, options).map_err(|diagnostics| plain(&diagnostics))?;
        let has_scene = !program.module().scenes.is_empty();
        let scene = if self.solid.is_none() && (has_scene || self.scene.is_some()) {
            Some(choose::scene(&program, self.scene.as_deref()).map_err(message)?.clone())
        } else {
            None
        };
        Ok(Checked { program, scene, solid: self.solid.clone() })
    }

    /// All that stands in the fluid's way at the start, or the solid.
    ///
    /// # Errors
    /// Why there is no mesh.
    pub fn standing(&self, checked: &Checked, detail: Detail, run: u64) -> Result<Standing, String> {
        let (solids, domain) = match &checked.scene {
            Some(scene) => (self.solids_of(checked, scene)?, scene.domain),
            None => {
                let solid = self.solid_of(checked)?;
                let domain = around(&solid)?;
                (vec![solid], domain)
            }
        };
        let cells = match detail {
            Detail::Passing => self.cells.min(PASSING_CELLS),
            Detail::Lasting => self.cells,
        };
        let bodies = Bodies::of(solids, domain, cells);
        let meshes = bodies.meshes_at(0.0).map_err(message)?;
        let mesh = pack_mesh(&split_creases(&Mesh::joined(&meshes)), 0.0, run);
        Ok(Standing { mesh, solids: bodies.solids().to_vec(), domain })
    }

    /// The box in which a scene or a solid is shown.
    ///
    /// # Errors
    /// Why a solid has none.
    pub fn domain(&self, checked: &Checked) -> Result<Aabb, String> {
        match &checked.scene {
            Some(scene) => Ok(scene.domain),
            None => around(&self.solid_of(checked)?),
        }
    }

    fn solids_of(&self, checked: &Checked, scene: &Scene) -> Result<Vec<Solid>, String> {
        let container = scene.container.iter().map(|container| (container.name.as_str(), container.outside));
        let obstacles = scene.obstacles.iter().map(|obstacle| (obstacle.name.as_str(), obstacle.shape));
        let compile = |(name, shape)| checked.program.compile(name, shape, self.engine).map_err(refused);
        container.chain(obstacles).map(compile).collect()
    }

    fn solid_of(&self, checked: &Checked) -> Result<Solid, String> {
        let module = checked.program.module();
        let name = match (&checked.solid, &module.solids[..]) {
            (Some(name), _) => name,
            (None, [.., last]) => &last.name,
            (None, []) => return Err("the file defines neither a solid nor a scene".into()),
        };
        checked.program.solid_with(name, self.engine).map_err(refused)
    }

    /// Compiles a scene and places its particles.
    ///
    /// # Errors
    /// The messages, as the command line shows them.
    pub fn start(&self, checked: &Checked, scene: &Scene) -> Result<Running, String> {
        let experiment = Experiment::new(&checked.program, &scene.name, self.engine).map_err(refused)?;
        let mut simulation = experiment.start().map_err(refused)?.simulation;
        let history = History::start(&mut simulation, scene);
        let solids = experiment.bodies().iter().map(|body| body.solid.clone()).collect();
        let domain = experiment.domain();
        let bodies = Bodies::of(solids, domain, self.cells);
        Ok(Running { simulation, history, bodies, lattice: Lattice::new(&domain), experiment })
    }

    /// What a page shows besides frames and meshes.
    pub fn setting(&self, checked: Option<&Checked>, bounds: &Aabb, running: Option<&Running>) -> Setting {
        let scene = checked.and_then(|checked| checked.scene.as_ref());
        let facts = match (checked, scene, running) {
            (_, Some(scene), Some(running)) => {
                let particles = running.simulation.particles().len();
                format!("scene {} · {} · {particles} particles", scene.name, scene.method.name())
            }
            (_, Some(scene), None) => format!("scene {} · {}", scene.name, scene.method.name()),
            (Some(checked), None, _) => {
                let solid = self.solid_of(checked).map(|solid| solid.name().to_string());
                solid.map_or_else(|_| String::new(), |name| format!("solid {name}"))
            }
            (None, None, _) => String::new(),
        };
        let fastest = running.map(|running| Levels { low: 0.0, high: running.experiment.speed_scale() });
        let [x, y, z] = VELOCITY;
        let arrays = ["speed", "density", "pressure", x, y, z].map(|name| {
            Array::named(name, fastest.filter(|range| name == "speed" && range.high.is_finite()))
        });
        Setting {
            title: self.title(),
            facts,
            live: true,
            domain: Corners::from(bounds),
            lattice: running.map(|running| Corners::from(running.lattice.bounds())),
            radius: running.map_or(0.0, |running| 0.5 * running.experiment.parameters().spacing()),
            arrays: if scene.is_some() { arrays.to_vec() } else { Vec::new() },
            gravity: scene.and_then(|scene| match &scene.gravity {
                Gravity::Still(gravity) => Some(gravity.to_array()),
                Gravity::Turning(_) | Gravity::Field(_) => None,
            }),
            params: checked.map_or_else(Vec::new, params),
            plots: running.is_none().then(Vec::new),
        }
    }
}

/// The box in which a solid is shown.
fn around(solid: &Solid) -> Result<Aabb, String> {
    let bounds = solid.bounds().aabb().ok_or_else(|| {
        format!("`{}` is empty, or could not be proven to end: there is nothing to show", solid.name())
    })?;
    Ok(bounds.grown(1e-3 * bounds.size().max_element()))
}

impl Checked {
    /// Whether the file has a param of this name.
    pub fn has_param(&self, name: &str) -> bool {
        self.program.module().params.iter().any(|param| param.name == name)
    }
}

fn params(checked: &Checked) -> Vec<Param> {
    let params = &checked.program.module().params;
    let shown = params.iter().map(|param| {
        let unit = param.unit.as_ref();
        Param {
            name: param.name.clone(),
            doc: param.doc.clone(),
            value: param.value,
            range: param.range,
            unit: unit.map_or_else(String::new, |(_, text)| text.clone()),
            factor: unit.map_or(1.0, |(unit, _)| unit.factor),
        }
    });
    shown.collect()
}

impl Running {
    /// Begins again.
    ///
    /// # Errors
    /// Why that is not possible; the run is as it was then.
    pub fn restart(&mut self) -> Result<(), String> {
        self.simulation = self.experiment.start().map_err(refused)?.simulation;
        self.history = History::start(&mut self.simulation, self.experiment.scene());
        Ok(())
    }

    /// Whether any obstacle moves by itself.
    pub fn moves(&self) -> bool {
        self.bodies.move_about()
    }

    /// The block of the obstacles' mesh as they stand now.
    pub fn mesh(&self, run: u64) -> Result<Vec<u8>, String> {
        let time = self.simulation.time();
        let meshes = self.bodies.meshes_at(time).map_err(message)?;
        Ok(pack_mesh(&split_creases(&Mesh::joined(&meshes)), time, run))
    }

    /// The block of the present instant.
    pub fn frame(&self, run: u64) -> Vec<u8> {
        let particles = self.simulation.particles();
        // by their ids, so that the page can follow each of them
        let order = particles.order_by_id();
        let column = |of: &dyn Fn(usize) -> f64| order.iter().map(|&i| of(i)).collect::<Vec<f64>>();
        let velocity = &particles.velocity;
        let arrays = [
            column(&|i| velocity.get(i).length()),
            column(&|i| particles.density[i]),
            column(&|i| particles.pressure[i]),
            column(&|i| velocity.x[i]),
            column(&|i| velocity.y[i]),
            column(&|i| velocity.z[i]),
        ];
        let places = order.iter().map(|&i| particles.position.get(i));
        let (frame, ranges) = Frame::of(&self.lattice, places, &arrays.each_ref().map(Vec::as_slice));
        let (time, step) = (self.simulation.time(), Some(self.simulation.steps()));
        pack_frame(&FrameHead { time, step, ranges, mesh: None, run, motion: None }, &frame, None)
    }

    /// Lets gravity act in this direction from now on, m/s².
    pub fn set_gravity(&mut self, gravity: DVec3) {
        self.simulation.set_turning_gravity(std::sync::Arc::new(move |_| gravity));
    }
}

fn plain(diagnostics: &Diagnostics) -> String {
    render(diagnostics, Style::Plain)
}

pub(super) fn refused(error: Error) -> String {
    match error {
        Error::Diagnostics(diagnostics) => plain(&diagnostics),
        other => other.to_string(),
    }
}

fn message(failure: Failure) -> String {
    match failure {
        Failure::Usage(message) | Failure::Numerical(message) => message,
        Failure::Findings | Failure::Interrupted | Failure::ClosedPipe => "the file has mistakes".into(),
    }
}
