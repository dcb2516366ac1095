//! The folder of a run as pictures.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use glam::DVec3;

use super::film::{Kind, Target};
use super::options::Render;
use super::solid::camera;
use crate::cli::args::Shared;
use crate::cli::failure::{Failure, note};
use crate::cli::output::{self, Shown};
use crate::cli::saved::{self, RunFigures};
use crate::cli::scenery::{self, Drawn, half_towards_eye, out_of_the_way};
use crate::cli::survey::Survey;
use crate::cli::values::CutFlag;
use rfm::diagnostic::nearest;
use rfm::field::Points;
use rfm::fluid_surface::{FrameEntry, read_arrays, read_mesh};
use rfm::geom::Aabb;
use rfm::mesh::Mesh;
use rfm::render::{Backdrop, Camera, Caption, Image, Legend, ParticlesView, Scale};
use rfm::view::{Array, Levels};

/// Pictures in a second of a film.
const RATE: u32 = 25;

/// Most particles of the first frame that stand for the fluid when it is asked what hides it.
const MOST_SAMPLES: usize = 3000;

pub(super) fn run(shared: &Shared, options: &Render) -> Result<(), Failure> {
    let folder = options.subject.as_path();
    if let Some(flag) = options.flag_of_solids() {
        return Err(Failure::usage(format!(
            "{flag} is for a solid of a file, and `{}` is the folder of a run",
            folder.shown()
        )));
    }
    let path = options.output.clone().unwrap_or_else(|| folder.join("render"));
    let kind = Kind::of(&path)?;
    if options.fps.is_some() && !kind.is_film() {
        return Err(Failure::usage(format!(
            "--fps is for films, and `{}` is none: name a .gif, .apng, .mp4 or .webm",
            path.shown()
        )));
    }
    let target = Target { path, kind, size: options.size, rate: options.fps.unwrap_or(RATE) };
    let run = RunScene::open(folder, options)?;
    target.check(run.entries.len())?;
    let started = Instant::now();
    let numbers: Vec<usize> = run.entries.iter().map(|(number, _)| *number).collect();
    target.write(&numbers, &|k| run.picture(k))?;
    run.report(shared, &target, started.elapsed().as_secs_f64())
}

/// What all pictures of a run share.
struct RunScene {
    folder: PathBuf,
    entries: Vec<(usize, FrameEntry)>,
    /// Files of the obstacles' meshes, and for each frame the number of its mesh.
    meshes: Vec<PathBuf>,
    mesh_of: Vec<Option<usize>>,
    /// How each body of a mesh is drawn; the only entry is for all if bodies are not told apart.
    drawn: Vec<Drawn>,
    domain: Aabb,
    radius: f64,
    camera: Camera,
    title: String,
    /// The array that is shown, with its unit and its range.
    shown: Array,
    range: Levels,
    map: rfm::render::ColourMap,
    /// The scene without particles, where obstacles stand still.
    still: Option<Backdrop>,
    /// What was spent on drawing, µs; the pictures that were drawn; the particles that could not be.
    spent: AtomicU64,
    pictures: AtomicUsize,
    left_out: AtomicUsize,
}

impl RunScene {
    fn open(folder: &Path, options: &Render) -> Result<Self, Failure> {
        let all = saved::collection(folder)?;
        let first = all[0].clone();
        let mut entries = saved::chosen(all, options.frames)?;
        if let Some((from, to)) = options.times {
            entries = at_times(entries, (from, to))?;
        }
        let entries: Vec<_> = entries.into_iter().step_by(options.every.unwrap_or(1)).collect();
        saved::check_frames(folder, &entries)?;
        let figures = RunFigures::read(&folder.join("summary.json")).ok();
        let survey = Survey::of(folder, &entries)?;
        let domain = survey.domain(figures.as_ref());
        let radius = survey.radius(figures.as_ref(), entries.len());
        let (shown, range) = shown(options, &survey)?;
        let camera = camera(options, &domain)?;
        let (meshes, mesh_of) = saved::obstacles(folder, &entries)?;
        let bodies = Bodies::at_start(folder, &first, &meshes, figures.as_ref())?;
        let drawn = bodies.drawn(options, &camera)?;
        let names: Vec<&str> = bodies.names.iter().map(String::as_str).collect();
        let title = options.title.clone().unwrap_or_else(|| {
            let scene = figures.map(|figures| figures.scene).filter(|scene| !scene.is_empty());
            let words = std::iter::once(saved::title(folder)).chain(scene);
            words.chain(scenery::described(&names, &drawn)).collect::<Vec<_>>().join(" · ")
        });
        let map = options.colours.unwrap_or_default();
        let mut scene = Self {
            folder: folder.to_path_buf(),
            entries,
            meshes,
            mesh_of,
            drawn,
            domain,
            radius,
            camera,
            title,
            shown,
            range,
            map,
            still: None,
            spent: AtomicU64::new(0),
            pictures: AtomicUsize::new(0),
            left_out: AtomicUsize::new(0),
        };
        if scene.meshes.len() <= 1 && scene.mesh_of.iter().all(|mesh| *mesh == scene.mesh_of[0]) {
            scene.still = Some(scene.backdrop(scene.mesh_of[0])?);
        }
        Ok(scene)
    }

    /// The scene without its particles, with a mesh of the obstacles.
    fn backdrop(&self, mesh: Option<usize>) -> Result<Backdrop, Failure> {
        let bodies = match mesh {
            Some(mesh) => bodies_of(&self.meshes[mesh], self.drawn.len())?,
            None => Vec::new(),
        };
        let unit = &self.shown.unit;
        let label =
            if unit.is_empty() { self.shown.name.clone() } else { format!("{}, {unit}", self.shown.name) };
        let scale = Scale { label: &label, low: self.range.low, high: self.range.high, map: self.map };
        let legend = Legend { title: &self.title, scale: Some(scale) };
        scenery::backdrop(&self.camera, &self.domain, &legend, self.drawn.iter().copied().zip(&bodies))
    }

    /// The picture of a chosen frame.
    fn picture(&self, k: usize) -> Result<Image, Failure> {
        let (_, entry) = &self.entries[k];
        let (points, values) = self.particles(entry)?;
        let own;
        let scene = match &self.still {
            Some(still) => still,
            None => {
                own = self.backdrop(self.mesh_of[k])?;
                &own
            }
        };
        let [x, y, z] = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect::<Vec<f64>>());
        let view = ParticlesView { positions: Points::new(&x, &y, &z), values: &values, radius: self.radius };
        let started = Instant::now();
        let image = scene.frame(&view, &Caption { time: entry.time, step: None });
        self.spent.fetch_add(started.elapsed().as_micros() as u64, Ordering::Relaxed);
        self.pictures.fetch_add(1, Ordering::Relaxed);
        self.left_out.fetch_max(image.skipped, Ordering::Relaxed);
        Ok(image)
    }

    /// The places of a frame, with every ball before the walls of the box, and the values that are shown.
    fn particles(&self, entry: &FrameEntry) -> Result<(Vec<DVec3>, Vec<f64>), Failure> {
        let path = self.folder.join(&entry.file);
        let failed =
            |error: String| Failure::usage(format!("cannot read the frame `{}`: {error}", path.shown()));
        let file = std::fs::read(&path).map_err(|error| failed(error.to_string()))?;
        let (mut points, arrays) = read_arrays(&file).map_err(|error| failed(error.to_string()))?;
        let name = &self.shown.name;
        let array = arrays.into_iter().find(|array| array.name == *name && array.components == 1);
        let values = array.ok_or_else(|| failed(format!("the array `{name}` is missing")))?.values;
        let (low, high) = (self.domain.min + self.radius, self.domain.max - self.radius);
        if low.cmple(high).all() {
            let near = self.domain.grown(self.radius);
            points.iter_mut().filter(|p| near.contains(**p)).for_each(|p| *p = p.clamp(low, high));
        }
        Ok((points, values))
    }

    fn report(&self, shared: &Shared, target: &Target, seconds: f64) -> Result<(), Failure> {
        let left_out = self.left_out.load(Ordering::Relaxed);
        if left_out > 0 {
            note(format!(
                "up to {left_out} particles of a frame are at no place that can be drawn, and were left out"
            ));
        }
        let drawn = self.pictures.load(Ordering::Relaxed);
        let each = self.spent.load(Ordering::Relaxed) as f64 / 1e3 / drawn.max(1) as f64;
        let (count, (width, height)) = (self.entries.len(), target.size);
        if shared.json {
            return output::json(&serde_json::json!({
                "schema": 1, "output": target.path.display().to_string(), "pictures": count, "width": width,
                "height": height, "by": self.shown.name, "low": self.range.low, "high": self.range.high,
                "milliseconds": seconds * 1e3, "milliseconds_of_drawing": each,
            }));
        }
        let pictures = if count == 1 { "picture" } else { "pictures" };
        say!("{count} {pictures} of {width} × {height} in {seconds:.1} s, {each:.1} ms each to draw");
        say!("written to {}", target.path.shown());
        Ok(())
    }
}

/// The frames within a range of times, s.
fn at_times(
    entries: Vec<(usize, FrameEntry)>,
    (from, to): (f64, f64),
) -> Result<Vec<(usize, FrameEntry)>, Failure> {
    let last = entries.last().map_or(0.0, |(_, entry)| entry.time);
    let first = entries.first().map_or(0.0, |(_, entry)| entry.time);
    // times of frames are sums of steps
    let slack = 1e-9 * last.abs();
    let is_within = |entry: &FrameEntry| (from - slack..=to + slack).contains(&entry.time);
    let found: Vec<_> = entries.into_iter().filter(|(_, entry)| is_within(entry)).collect();
    if found.is_empty() {
        return Err(Failure::usage(format!(
            "--times: no frame lies there; they go from {first} s to {last} s"
        )));
    }
    Ok(found)
}

/// The array that is shown, and its range.
fn shown(options: &Render, survey: &Survey) -> Result<(Array, Levels), Failure> {
    let name = options.by.as_deref().unwrap_or("speed");
    let names = || survey.arrays.iter().map(|(name, _)| name.as_str());
    let Some((_, found)) = survey.arrays.iter().find(|(known, _)| known == name) else {
        let near = nearest(name, names()).map_or(String::new(), |near| format!("; did you mean `{near}`?"));
        let there = names().collect::<Vec<_>>().join(", ");
        return Err(Failure::usage(format!(
            "--by {name}: the frames have no such number at each particle; there is {there}{near}"
        )));
    };
    let range = options.range.map_or(*found, |(low, high)| Levels { low, high });
    Ok((Array::named(name, None), range))
}

/// The obstacles at the start of a run.
struct Bodies {
    /// Their names; one for all if the folder does not tell them apart.
    names: Vec<String>,
    are_named: bool,
    meshes: Vec<Mesh>,
    /// Particles of the first frame.
    samples: Vec<DVec3>,
}

impl Bodies {
    fn at_start(
        folder: &Path,
        first: &FrameEntry,
        others: &[PathBuf],
        figures: Option<&RunFigures>,
    ) -> Result<Self, Failure> {
        let named = figures.map(|figures| figures.obstacles.clone()).unwrap_or_default();
        let (files, _) = saved::obstacles(folder, &[(0, first.clone())])?;
        let are_named = !named.is_empty();
        let names = if are_named { named } else { vec!["the obstacles".to_string()] };
        let meshes = match files.first().or(others.first()) {
            Some(file) => bodies_of(file, names.len())?,
            None => Vec::new(),
        };
        // a first frame that is gone or damaged only means that nothing is cut by itself
        let points = std::fs::read(folder.join(&first.file)).ok().and_then(|file| read_arrays(&file).ok());
        let points: Vec<DVec3> = points.map(|(points, _)| points).unwrap_or_default();
        let finite: Vec<DVec3> = points.into_iter().filter(|p| p.is_finite()).collect();
        let every = finite.len().div_ceil(MOST_SAMPLES).max(1);
        Ok(Self { names, are_named, meshes, samples: finite.into_iter().step_by(every).collect() })
    }

    /// How each of them is drawn.
    fn drawn(&self, options: &Render, camera: &Camera) -> Result<Vec<Drawn>, Failure> {
        if let Some(unknown) = options.hide.iter().find(|name| !self.are_named || !self.names.contains(name))
        {
            let reason = match (self.are_named, self.meshes.is_empty()) {
                (_, true) => "the run has no obstacles".to_string(),
                (true, false) => format!("the run has no such obstacle; there is {}", self.names.join(", ")),
                (false, false) => {
                    "the folder does not name its obstacles: its summary.json is missing, or the run was made by an earlier \
                     version; `rfm run` makes it again"
                        .to_string()
                }
            };
            return Err(Failure::usage(format!("--hide {unknown}: {reason}")));
        }
        let is_hidden = |name: &String| self.are_named && options.hide.contains(name);
        let drawn = |(name, mesh): (&String, &Mesh)| match &options.cut {
            _ if is_hidden(name) => Drawn::Hidden,
            Some(CutFlag::None) => Drawn::Whole,
            Some(CutFlag::Plane(plane)) => Drawn::Open(half_towards_eye(plane, camera)),
            Some(CutFlag::Auto) | None => out_of_the_way(camera, name, mesh, &self.samples),
        };
        Ok(self.names.iter().zip(&self.meshes).map(drawn).collect())
    }
}

/// The bodies of a file, told apart by its array `body` if there are several.
fn bodies_of(path: &Path, count: usize) -> Result<Vec<Mesh>, Failure> {
    let failed = |error: String| Failure::usage(format!("cannot read `{}`: {error}", path.shown()));
    let file = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
    let whole = read_mesh(&file).map_err(|error| failed(error.to_string()))?;
    if count <= 1 {
        return Ok(vec![whole]);
    }
    let (_, arrays) = read_arrays(&file).map_err(|error| failed(error.to_string()))?;
    let Some(array) = arrays.iter().find(|array| array.name == "body" && array.components == 1) else {
        return Err(failed(
            "it has no array `body`, which tells the obstacles apart; `rfm run` writes it".into(),
        ));
    };
    let mut bodies = vec![Mesh::default(); count];
    // the number of each vertex within its body
    let mut numbers = Vec::with_capacity(whole.positions.len());
    for (k, &body) in array.values.iter().enumerate() {
        let Some(own) = bodies.get_mut(body as usize).filter(|_| body >= 0.0) else {
            return Err(failed(format!("its array `body` names the obstacle {body}, and there are {count}")));
        };
        numbers.push(own.positions.len() as u32);
        own.positions.push(whole.positions[k]);
        own.normals.push(whole.normals[k]);
    }
    for triangle in &whole.triangles {
        let body = array.values[triangle[0] as usize] as usize;
        bodies[body].triangles.push(triangle.map(|vertex| numbers[vertex as usize]));
    }
    Ok(bodies)
}
