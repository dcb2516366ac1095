//! From the text of a file to what is shown: the solids as meshes at once, then the simulation.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::super::choose;
use super::super::failure::Failure;
use super::super::input;
use super::super::shared::Shared;
use super::super::stated::Stated;
use super::course::{Course, Flow, Motion};
use super::messages::{message, plain, refused};
use super::options::View;
use super::way::Way;
use crate::cli::output::Shown;
use rfm::compile::files_beside;
use rfm::files::Files;
use rfm::geom::Aabb;
use rfm::lower::{Gravity, Options, Scene};
use rfm::quantity::Dimension;
use rfm::view::{Array, Corners, Levels, Param, Setting, VELOCITY};
use rfm::{Engine, Error, Experiment, Program, Solid};

/// What is viewed, as the command line states it.
#[derive(Clone)]
pub(super) struct Subject {
    pub path: PathBuf,
    scene: Option<String>,
    solid: Option<String>,
    /// The solid that a page has chosen of a file without a scene.
    chosen: Option<String>,
    cells: usize,
    define: BTreeMap<String, f64>,
    /// Where those of them stand that a file sets.
    places: BTreeMap<String, String>,
    dimensions: BTreeMap<String, Dimension>,
    max_nodes: Option<usize>,
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

/// Solids with the box in which they are shown.
pub(super) struct Standing {
    pub solids: Vec<Solid>,
    pub domain: Aabb,
    /// The way of a solid alone.
    pub way: Option<Way>,
    /// When they stand so, s.
    pub time: f64,
}

/// How fine a mesh is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Detail {
    /// It is shown while a slider moves.
    Passing,
    /// It stays.
    Lasting,
}

/// What distinguishes one state of a file from another.
pub(super) type Stamp = Option<Vec<Option<(SystemTime, u64)>>>;

impl Subject {
    pub fn new(shared: &Shared, options: &View) -> Self {
        Self {
            path: options.subject.clone(),
            scene: options.scene.clone(),
            solid: options.solid.clone(),
            chosen: None,
            cells: options.mesh_cells,
            places: shared.places(),
            define: shared.define.iter().map(|given| (given.name.clone(), given.value)).collect(),
            dimensions: shared.dimensions(),
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

    /// Makes sure that the files which the file names are read again when it is next checked.
    pub fn forget(&self) {
        self.files.forget();
    }

    /// Shows another solid of a file without a scene from now on.
    /// Returns what was chosen before.
    pub fn choose(&mut self, solid: Option<String>) -> Option<String> {
        std::mem::replace(&mut self.chosen, solid)
    }

    pub fn title(&self) -> String {
        self.path.file_name().map_or_else(|| self.path.shown(), |name| Path::new(name).shown())
    }

    /// Reads and checks the file, with values for params besides those of the command line.
    ///
    /// # Errors
    /// The messages, as the command line shows them.
    pub fn checked(&self, values: &BTreeMap<String, f64>) -> Result<Checked, String> {
        let program = self.program(values)?;
        let scene = self.scene_of(&program).map_err(message)?.cloned();
        Ok(Checked { program, scene, solid: self.solid.clone() })
    }

    /// Refuses a scene or solid of the command line that the file lacks, and a missing choice between scenes. A file
    /// with mistakes is not refused: it is shown with them until it is mended.
    ///
    /// # Errors
    /// [`Failure::Usage`].
    pub fn admit_choice(&self) -> Result<(), Failure> {
        let Ok(program) = self.program(&BTreeMap::new()) else { return Ok(()) };
        let solids = &program.module().solids;
        match &self.solid {
            Some(name) if solids.iter().all(|solid| solid.name != *name) => {
                let known = solids.iter().map(|solid| solid.name.clone()).collect();
                Err(choose::usage(Error::UnknownName { kind: "solid", name: name.clone(), known }))
            }
            Some(_) => Ok(()),
            None => self.scene_of(&program).map(|_| ()),
        }
    }

    /// The scene that is simulated; `None` if only a solid is shown.
    fn scene_of<'a>(&self, program: &'a Program) -> Result<Option<&'a Scene>, Failure> {
        let has_scene = !program.module().scenes.is_empty();
        let is_wanted = self.solid.is_none() && (has_scene || self.scene.is_some());
        is_wanted.then(|| choose::scene(program, self.scene.as_deref())).transpose()
    }

    fn program(&self, values: &BTreeMap<String, f64>) -> Result<Program, String> {
        let source = input::read(&self.path).map_err(message)?;
        let mut overrides = self.define.clone();
        overrides.extend(values.iter().map(|(name, value)| (name.clone(), *value)));
        let dimensions = self.dimensions.clone();
        let mut places = self.places.clone();
        places.retain(|name, _| !values.contains_key(name));
        let options = Options {
            overrides,
            dimensions,
            places,
            max_nodes: self.max_nodes,
            files: self.files.clone(),
            ..Options::default()
        };
        Program::check(source, options).map_err(|diagnostics| plain(&diagnostics))
    }

    /// All that stands in the fluid's way at the start, or the solid at a time, s. A solid whose way ends before that
    /// time is shown at its end.
    ///
    /// # Errors
    /// Why nothing can be shown.
    pub fn standing(&self, checked: &Checked, time: f64) -> Result<Standing, String> {
        match &checked.scene {
            Some(scene) => {
                let solids = self.solids_of(checked, scene)?;
                Ok(Standing { solids, domain: scene.domain, way: None, time: 0.0 })
            }
            None => {
                let solid = self.solid_of(checked)?;
                let way = Way::of(&solid)?;
                let time = time.clamp(way.start, way.end);
                Ok(Standing { solids: vec![solid], domain: way.room, way: Some(way), time })
            }
        }
    }

    /// Cells along the longest side of meshes that stay.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// The box in which a scene or a solid is shown.
    ///
    /// # Errors
    /// Why a solid has none.
    pub fn domain(&self, checked: &Checked) -> Result<Aabb, String> {
        match &checked.scene {
            Some(scene) => Ok(scene.domain),
            None => Ok(Way::of(&self.solid_of(checked)?)?.room),
        }
    }

    fn solids_of(&self, checked: &Checked, scene: &Scene) -> Result<Vec<Solid>, String> {
        let container = scene.container.iter().map(|container| (container.name.as_str(), container.outside));
        let obstacles = scene.obstacles.iter().map(|obstacle| (obstacle.name.as_str(), obstacle.shape));
        let compile = |(name, shape)| checked.program.compile(name, shape, self.engine).map_err(refused);
        container.chain(obstacles).map(compile).collect()
    }

    /// The names of the solids of a file without a scene, that which is shown first.
    fn solids_to_choose(&self, checked: &Checked) -> Vec<String> {
        let Ok(shown) = self.solid_of(checked) else { return Vec::new() };
        let names = checked.program.module().solids.iter().map(|solid| solid.name.clone());
        let others = names.filter(|name| name != shown.name());
        std::iter::once(shown.name().to_string()).chain(others).collect()
    }

    fn solid_of(&self, checked: &Checked) -> Result<Solid, String> {
        let module = checked.program.module();
        let chosen =
            self.chosen.as_ref().filter(|name| module.solids.iter().any(|solid| solid.name == **name));
        let name = match (chosen.or(checked.solid.as_ref()), &module.solids[..]) {
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
    pub fn start(&self, checked: &Checked, scene: &Scene) -> Result<Course, String> {
        let experiment = Experiment::new(&checked.program, &scene.name, self.engine).map_err(refused)?;
        Ok(Course::Fluid(Box::new(Flow::start(experiment, self.cells)?)))
    }

    /// What goes on where a solid stands alone; `None` if it does not move.
    pub fn motion(&self, standing: &Standing) -> Option<Course> {
        let way = standing.way.filter(|way| way.end > way.start)?;
        Some(Course::Solid(Motion::of(standing.solids.clone(), way, standing.time, self.cells)))
    }

    /// What a page shows besides frames and meshes.
    pub fn setting(&self, checked: Option<&Checked>, bounds: &Aabb, course: Option<&Course>) -> Setting {
        let scene = checked.and_then(|checked| checked.scene.as_ref());
        let flow = course.and_then(Course::flow);
        let facts = match (checked, scene, flow) {
            (_, Some(scene), Some(flow)) => {
                let particles = flow.simulation.particles().len();
                format!("scene {} · {} · {particles} particles", scene.name, scene.method.name())
            }
            (_, Some(scene), None) => format!("scene {} · {}", scene.name, scene.method.name()),
            (Some(checked), None, _) => {
                let solid = self.solid_of(checked).map(|solid| solid.name().to_string());
                solid.map_or_else(|_| String::new(), |name| format!("solid {name}"))
            }
            (None, None, _) => String::new(),
        };
        let stated = scene.map(|scene| Stated::of(&scene.picture));
        let end = stated.as_ref().and_then(|stated| stated.fastest);
        let fastest =
            flow.map(|flow| Levels { low: 0.0, high: end.unwrap_or_else(|| flow.experiment.speed_scale()) });
        let [x, y, z] = VELOCITY;
        let arrays = ["speed", "density", "pressure", x, y, z].map(|name| {
            Array::named(name, fastest.filter(|range| name == "speed" && range.high.is_finite()))
        });
        Setting {
            title: self.title(),
            facts,
            live: true,
            domain: Corners::from(bounds),
            moves: matches!(course, Some(Course::Solid(_))),
            has_surface: false,
            lattice: flow.map(|flow| Corners::from(flow.lattice.bounds())),
            radius: flow.map_or(0.0, |flow| 0.5 * flow.experiment.parameters().spacing()),
            arrays: if scene.is_some() { arrays.to_vec() } else { Vec::new() },
            solids: match (checked, scene) {
                (Some(checked), None) => self.solids_to_choose(checked),
                (Some(_) | None, _) => Vec::new(),
            },
            bodies: flow.map_or_else(Vec::new, |flow| {
                flow.experiment.bodies().iter().map(|body| body.solid.name().to_string()).collect()
            }),
            gravity: scene.and_then(|scene| match &scene.gravity {
                Gravity::Still(gravity) => Some(gravity.to_array()),
                Gravity::Turning(_) | Gravity::Field(_) => None,
            }),
            params: checked.map_or_else(Vec::new, params),
            plots: flow.is_none().then(Vec::new),
            picture: stated.as_ref().map(Stated::outset),
        }
    }
}

impl Checked {
    /// Whether the file has a param of this name.
    pub fn has_param(&self, name: &str) -> bool {
        self.program.module().params.iter().any(|param| param.name == name)
    }

    /// Whether the file has a param of this name whose range has this value.
    pub fn admits(&self, name: &str, value: f64) -> bool {
        let param = self.program.module().params.iter().find(|param| param.name == name);
        param.is_some_and(|param| param.range.is_none_or(|(low, high)| (low..=high).contains(&value)))
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
