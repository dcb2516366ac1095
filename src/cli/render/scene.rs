//! The folder of a run as pictures.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use glam::DVec3;

use super::bodies::{Bodies, bodies_of};
use super::film::Target;
use super::look::{Look, Opened};
use super::options::{Render, Surface};
use crate::cli::failure::{Failure, note};
use crate::cli::output::{self, Shown, significant};
use crate::cli::saved::{self, RunFigures};
use crate::cli::scenery::{self, Drawn};
use crate::cli::shared::Shared;
use crate::cli::surfaces;
use crate::cli::survey::{Survey, is_velocity};
use rfm::diagnostic::nearest;
use rfm::field::Points;
use rfm::fluid_surface::{FrameEntry, read_arrays, read_mesh, values_at};
use rfm::geom::Aabb;
use rfm::mesh::Mesh;
use rfm::render::{Backdrop, Caption, Cut, Image, Legend, MeshView, Moving, ParticlesView, Scale};
use rfm::view::{Array, Levels, VELOCITY};

pub(super) fn run(shared: &Shared, options: &Render) -> Result<(), Failure> {
    let folder = options.subject.as_path();
    if let Some(flag) = options.flag_of_solids() {
        let instead = if flag == "--time" { ": choose frames by --times 0.5..2 or --frames 40" } else { "" };
        return Err(Failure::usage(format!(
            "{flag} is for a solid of a file, and `{}` is the folder of a run{instead}",
            folder.shown()
        )));
    }
    let path = options.output.clone().unwrap_or_else(|| folder.join("render"));
    let target = options.target(path)?;
    if options.fps.is_some() && !target.kind.is_film() {
        return Err(Failure::usage(format!(
            "--fps is for films, and `{}` is none: name a .gif, .apng, .mp4 or .webm",
            target.path.shown()
        )));
    }
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
    /// How each body of a mesh is drawn; the only entry is for all if bodies are not distinguished.
    drawn: Vec<Drawn>,
    domain: Aabb,
    radius: f64,
    /// The mean time between frames of the run, s.
    every: f64,
    /// The array that is shown, with its unit and its range.
    shown: Array,
    range: Levels,
    /// The file of the fluid's surface in each frame, and how it is drawn; none where it is not.
    surfaces: Vec<PathBuf>,
    surface: Option<Surface>,
    /// Whether the surface has the colours of particles, and the plane that cuts it open.
    tinted: bool,
    cut: Option<Cut>,
    /// Whether the plane leaves particles out, too.
    cuts_balls: bool,
    balls: bool,
    /// The scene without particles, and without obstacles that move.
    still: Backdrop,
    /// What was spent on drawing, µs; the pictures that were drawn; the particles that could not be.
    spent: AtomicU64,
    pictures: AtomicUsize,
    left_out: AtomicUsize,
}

impl RunScene {
    fn open(folder: &Path, options: &Render) -> Result<Self, Failure> {
        let all = saved::collection(folder)?;
        let first = all[0].clone();
        // of all frames: a single one of them has digits of its time, too
        let length = all[all.len() - 1].time - first.time;
        let every = length / (all.len() - 1).max(1) as f64;
        let mut entries = saved::chosen(all, options.frames)?;
        if let Some((from, to)) = options.times {
            entries = at_times(entries, (from, to))?;
        }
        let entries: Vec<_> = entries.into_iter().step_by(options.every.unwrap_or(1)).collect();
        saved::check_frames(folder, &entries)?;
        let figures = RunFigures::of(folder);
        let survey = Survey::of(folder, &entries)?;
        survey.tell_of_other_runs(folder, &entries, figures.as_ref());
        saved::tell_of_lost_obstacles(folder, &entries, figures.as_ref())?;
        let domain = survey.domain(figures.as_ref());
        let radius = survey.radius(figures.as_ref(), entries.len());
        let (shown, found) = shown(options, &survey)?;
        let look = Look::new(options, figures.as_ref().map(|figures| &figures.picture));
        let range = look.range(&shown.name).unwrap_or(found);
        let camera = look.camera(&domain)?;
        let (meshes, mesh_of) = saved::obstacles(folder, &entries)?;
        let bodies = Bodies::at_start(folder, &first, &meshes, figures.as_ref())?;
        let drawn = bodies.drawn(options, &look, &camera)?;
        let names: Vec<&str> = bodies.names.iter().map(String::as_str).collect();
        let title = options.title.clone().unwrap_or_else(|| {
            let words = saved::subject(folder, figures.as_ref()).into_iter();
            words.chain(scenery::described(&names, &drawn)).collect::<Vec<_>>().join(" · ")
        });
        let surfaces = match options.surface {
            Some(_) => surfaces::of_frames(folder, &entries)?,
            None => Vec::new(),
        };
        let balls = options.surface.is_none() || options.particles;
        let tinted = options.surface.is_some() && options.by.is_some();
        let cut = match look.opened(&camera) {
            Opened::By(cut) => Some(cut),
            Opened::Automatic | Opened::Nothing => None,
        };
        if options.cut_fluid && cut.is_none() {
            return Err(Failure::usage(
                "--cut-fluid leaves out particles at a plane: --cut y=0.5 --cut-fluid",
            ));
        }
        let stands = meshes.len() <= 1 && mesh_of.iter().all(|mesh| *mesh == mesh_of[0]);
        let bodies = match meshes.first() {
            Some(file) if stands => bodies_of(file, drawn.len())?,
            Some(_) | None => Vec::new(),
        };
        let unit = &shown.unit;
        let label = if unit.is_empty() { shown.name.clone() } else { format!("{}, {unit}", shown.name) };
        let map = options.colours.unwrap_or_default();
        let open = [found.low < range.low, found.high > range.high];
        let scale = Scale { label: &label, low: range.low, high: range.high, open, map };
        let legend = Legend { title: &title, scale: (balls || tinted).then_some(scale) };
        let still = scenery::backdrop(&camera, &domain, &legend, drawn.iter().copied().zip(&bodies))?;
        Ok(Self {
            folder: folder.to_path_buf(),
            every,
            entries,
            meshes: if stands { Vec::new() } else { meshes },
            mesh_of,
            drawn,
            domain,
            radius,
            shown,
            range,
            surfaces,
            surface: options.surface,
            tinted,
            cut,
            cuts_balls: options.cut_fluid,
            balls,
            still: still.coloured(&scale),
            spent: AtomicU64::new(0),
            pictures: AtomicUsize::new(0),
            left_out: AtomicUsize::new(0),
        })
    }

    /// The picture of a chosen frame.
    fn picture(&self, k: usize) -> Result<Image, Failure> {
        let (_, entry) = &self.entries[k];
        let (mut points, mut values) = self.particles(entry)?;
        let bodies = match self.mesh_of[k].and_then(|mesh| self.meshes.get(mesh)) {
            Some(file) => bodies_of(file, self.drawn.len())?,
            None => Vec::new(),
        };
        let water = self.surfaces.get(k).map(|file| surface_of(file)).transpose()?;
        let tints = match &water {
            // as far as particles reach in the surface
            Some(water) if self.tinted => values_at(&water.positions, &points, &values, 4.0 * self.radius),
            Some(_) | None => Vec::new(),
        };
        if let Some(cut) = self.cut.filter(|_| self.cuts_balls) {
            // no ball stands out of the plane
            let kept = |p: &DVec3| cut.beyond(*p) <= -self.radius;
            let seen = points.iter().zip(&values).filter(|(p, _)| kept(p));
            (points, values) = seen.map(|(p, value)| (*p, *value)).unzip();
        }
        let [x, y, z] = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect::<Vec<f64>>());
        let particles =
            ParticlesView { positions: Points::new(&x, &y, &z), values: &values, radius: self.radius };
        let started = Instant::now();
        let bodies = scenery::sharp(&self.domain, self.drawn.iter().copied().zip(&bodies));
        let mut meshes = scenery::views(&bodies);
        meshes.extend(self.surface.zip(water.as_ref()).map(|(surface, mesh)| MeshView {
            values: &tints,
            cut: self.cut,
            ..scenery::surface(mesh, surface.material())
        }));
        let moving = Moving { meshes: &meshes, particles, balls: self.balls };
        let image =
            self.still.frame_with(&moving, &Caption { time: entry.time, every: self.every, step: None });
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
        output::remember_input(&path);
        let (mut points, arrays) = read_arrays(&file).map_err(|error| failed(error.to_string()))?;
        let name = &self.shown.name;
        let own = arrays.iter().find(|array| array.name == *name && array.components == 1);
        let part = VELOCITY.iter().position(|component| component == name);
        let (array, first) = match (own, part) {
            (None, Some(component)) => (arrays.iter().find(|array| is_velocity(array)), component),
            (own, _) => (own, 0),
        };
        let array = array.ok_or_else(|| failed(format!("the array `{name}` is missing")))?;
        let values = array.values.iter().skip(first).step_by(array.components).copied().collect();
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
        if let Some(speed) = target.kind.is_film().then(|| self.speed(target.rate)).flatten() {
            say!("it shows {speed}");
        }
        Ok(())
    }

    /// How fast a film with `rate` pictures in a second is, in words; `None` if its pictures are not of
    /// instants that follow each other.
    fn speed(&self, rate: u32) -> Option<String> {
        let (first, last) = (self.entries.first()?.1.time, self.entries.last()?.1.time);
        let between = (last - first) / (self.entries.len() - 1) as f64;
        let speed = between * f64::from(rate);
        match speed {
            0.98..1.02 => Some("the fluid as fast as it was".into()),
            1.0.. if speed.is_finite() => {
                Some(format!("the fluid {} times as fast as it was", factor(speed)))
            }
            0.0..1.0 if speed > 0.0 => Some(format!("the fluid slowed down {} times", factor(1.0 / speed))),
            _ => None,
        }
    }
}

/// A factor of 1 and more as a person reads it.
fn factor(factor: f64) -> String {
    if factor < 1e3 { significant(factor, 1) } else { format!("{factor:.1e}") }
}

/// The mesh of a surface of the fluid.
fn surface_of(path: &Path) -> Result<Mesh, Failure> {
    let failed = |error: String| Failure::usage(format!("cannot read `{}`: {error}", path.shown()));
    let file = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
    output::remember_input(path);
    read_mesh(&file).map_err(|error| failed(error.to_string()))
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

/// The array that is shown, and the range of its values in all frames.
fn shown(options: &Render, survey: &Survey) -> Result<(Array, Levels), Failure> {
    let name = options.by.as_deref().unwrap_or("speed");
    // the viewer has the components of the velocity, too
    let velocity = survey.velocity.into_iter().flat_map(|range| VELOCITY.map(|name| (name, range)));
    let own = survey.arrays.iter().map(|(name, range)| (name.as_str(), *range));
    let arrays: Vec<(&str, Levels)> = own.chain(velocity).collect();
    let names = || arrays.iter().map(|(name, _)| *name);
    let Some((_, found)) = arrays.iter().find(|(known, _)| *known == name) else {
        let near = nearest(name, names()).map_or(String::new(), |near| format!("; did you mean `{near}`?"));
        let there = names().collect::<Vec<_>>().join(", ");
        return Err(Failure::usage(format!(
            "--by {name}: the frames have no such number at each particle; there is {there}{near}"
        )));
    };
    Ok((Array::named(name, None), *found))
}
