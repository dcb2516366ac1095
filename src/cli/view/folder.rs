//! The folder of a run as a page.
//!
//! Frames are read for their ranges, and again to be written, so that only one is in memory at a time.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::super::failure::Failure;
use super::super::output::counted;
use super::super::saved::{self, RunFigures};
use super::super::stated::Stated;
use super::super::surfaces;
use super::super::survey::{Survey, is_velocity};
use super::options::{Surfaces, View};
use super::plots;
use rfm::fluid_surface::{FrameEntry, read_arrays, read_mesh};
use rfm::geom::Aabb;
use rfm::mesh::{Mesh, split_creases};
use rfm::view::{
    Array, Corners, Frame, FrameHead, Lattice, Levels, MeshRole, Motion, Page, Setting, Sizes, VELOCITY,
    coarse, columns, pack_frame, pack_parts, pack_surface, pose, reduced,
};

/// A run in its folder.
pub(super) struct SavedRun {
    folder: PathBuf,
    entries: Vec<(usize, FrameEntry)>,
    /// Files of the obstacles' meshes, and for each frame the number of its mesh.
    meshes: Vec<PathBuf>,
    mesh_of: Vec<Option<usize>>,
    /// For each frame the file of the fluid's surface, where there is one.
    surfaces: Vec<Option<PathBuf>>,
    is_fine: bool,
    /// Name and range of each array of a page: the numbers at particles, then the components of the velocity.
    arrays: Vec<(String, Levels)>,
    /// The number of particles of all frames together.
    particles: usize,
    setting: Setting,
    lattice: Lattice,
}

impl SavedRun {
    /// Reads what the folder has, the frames included.
    pub fn open(folder: &Path, options: &View) -> Result<Self, Failure> {
        let chosen = saved::chosen(saved::collection(folder)?, options.frames)?;
        let entries: Vec<_> = chosen.into_iter().step_by(options.every).collect();
        saved::check_frames(folder, &entries)?;
        let figures = RunFigures::of(folder);
        let survey = Survey::of(folder, &entries)?;
        survey.tell_of_other_runs(folder, &entries, figures.as_ref());
        saved::tell_of_lost_obstacles(folder, &entries, figures.as_ref())?;
        let (meshes, mesh_of) = saved::obstacles(folder, &entries)?;
        let surfaces = match options.surfaces {
            Surfaces::None => vec![None; entries.len()],
            Surfaces::Small | Surfaces::Fine => surfaces::there_are(folder, &entries)?,
        };
        let domain = survey.domain(figures.as_ref());
        let mut arrays = survey.arrays.clone();
        let velocity = survey.velocity.into_iter();
        arrays.extend(velocity.flat_map(|range| VELOCITY.map(|name| (name.to_string(), range))));
        let lattice = Lattice::new(&domain.union(&survey.bounds));
        let picture = figures.as_ref().map(|figures| &figures.picture);
        // the levels of frames keep the range of the frames
        let colours = |name: &str, range| match picture.and_then(|picture| picture.fastest) {
            Some(high) if name == "speed" => Levels { low: 0.0, high },
            Some(_) | None => range,
        };
        let setting = Setting {
            title: saved::title(folder),
            facts: facts(&entries, &survey, figures.as_ref()),
            live: false,
            moves: false,
            has_surface: surfaces.iter().any(Option::is_some),
            domain: Corners::from(&domain),
            lattice: Some(Corners::from(lattice.bounds())),
            radius: survey.radius(figures.as_ref(), entries.len()),
            arrays: arrays
                .iter()
                .map(|(name, range)| Array::named(name, Some(colours(name, *range))))
                .collect(),
            solids: Vec::new(),
            bodies: figures.as_ref().map_or_else(Vec::new, |figures| figures.obstacles.clone()),
            gravity: None,
            params: Vec::new(),
            plots: Some(plots::saved(folder)),
            picture: picture.map(Stated::outset),
        };
        let (folder, particles) = (folder.to_path_buf(), survey.particles);
        let is_fine = options.surfaces == Surfaces::Fine;
        Ok(Self { folder, entries, meshes, mesh_of, surfaces, is_fine, arrays, particles, setting, lattice })
    }

    pub fn frames(&self) -> usize {
        self.entries.len()
    }

    /// The number of particles of all frames together.
    pub fn particles(&self) -> usize {
        self.particles
    }

    /// Writes the page.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<Sizes> {
        let mut page = Page::begin(out, &self.setting)?;
        let (mut meshes, mut surfaces) = (Meshes::default(), 0);
        let (mut before, mut time) = (None::<Frame>, 0.0);
        for (k, (_, entry)) in self.entries.iter().enumerate() {
            let file = self.mesh_of[k].map(|mesh| (mesh, self.meshes[mesh].as_path()));
            if let Some(block) = meshes.next(file, entry.time)? {
                page.mesh(&block)?;
            }
            let frame = self.frame(entry)?;
            let surface = match &self.surfaces[k] {
                Some(file) => {
                    let mesh = read_mesh(&std::fs::read(file)?).map_err(io::Error::other)?;
                    let radius = self.setting.radius;
                    let (mesh, cell) = if self.is_fine {
                        (coarse(&mesh, radius), radius)
                    } else {
                        reduced(&mesh, 2.0 * radius, frame.sites.len())
                    };
                    page.surface(&pack_surface(&mesh, cell, entry.time))?;
                    surfaces += 1;
                    Some(surfaces - 1)
                }
                None => None,
            };
            let head = FrameHead {
                time: entry.time,
                step: None,
                ranges: self.arrays.iter().map(|(_, range)| *range).collect(),
                mesh: meshes.written.checked_sub(1),
                poses: meshes.poses.clone(),
                surface,
                run: 0,
                motion: self.motion(entry.time - time),
            };
            page.frame(&pack_frame(&head, &frame, before.as_ref()))?;
            (before, time) = (Some(frame), entry.time);
        }
        page.end()
    }

    /// How numbers follow from velocities, if the frames have them, so long after the frame before, s.
    fn motion(&self, after: f64) -> Option<Motion> {
        let place = |wanted: &str| self.arrays.iter().position(|(name, _)| name == wanted);
        let [Some(x), Some(y), Some(z)] = VELOCITY.map(place) else { return None };
        let steps = (0.5 * after * self.lattice.steps()).to_array();
        // a browser counts exactly up to 2⁵³
        let fastest = [x, y, z].map(|k| self.arrays[k].1.low.abs().max(self.arrays[k].1.high.abs()));
        let is_exact = steps.iter().zip(fastest).all(|(steps, fastest)| (steps * fastest).abs() < 1e12);
        is_exact.then_some(Motion { velocity: [x, y, z], speed: place("speed"), steps })
    }

    fn frame(&self, entry: &FrameEntry) -> io::Result<Frame> {
        let file = std::fs::read(self.folder.join(&entry.file))?;
        let (points, arrays) = read_arrays(&file).map_err(io::Error::other)?;
        let levels = |(name, range): &(String, Levels)| {
            let (array, first) = match VELOCITY.iter().position(|component| component == name) {
                Some(component) => (arrays.iter().find(|array| is_velocity(array)), component),
                None => (arrays.iter().find(|array| array.name == *name && array.components == 1), 0),
            };
            let array = array.ok_or_else(|| io::Error::other(format!("the array `{name}` is missing")))?;
            let values = array.values.iter().skip(first).step_by(array.components);
            Ok(values.map(|value| range.level(*value)).collect())
        };
        Ok(Frame {
            sites: points.iter().map(|p| self.lattice.site(*p)).collect(),
            levels: self.arrays.iter().map(levels).collect::<io::Result<_>>()?,
        })
    }
}

/// The meshes of the obstacles as they are written: a mesh that has only moved is not written again.
#[derive(Default)]
struct Meshes {
    /// How many are written.
    written: usize,
    /// The number of the file that was read last.
    read: Option<usize>,
    /// The parts of the mesh that was written last.
    last: Vec<Mesh>,
    /// Where its parts are now; empty if they are where they were.
    poses: Vec<[f64; 12]>,
}

/// A page draws each part of a mesh by itself. For more parts than this it receives one mesh for each frame.
const MOST_PARTS: f64 = 1000.0;

/// How far a part may lie from its mesh, as a part of the longest side of all: half a step of the 16 bits of
/// coordinates.
const BESIDE: f64 = 0.5 / 65534.0;

impl Meshes {
    /// Goes on to a frame with the mesh of a file, which has a number: the block of the mesh, if it is a new one.
    fn next(&mut self, file: Option<(usize, &Path)>, time: f64) -> io::Result<Option<Vec<u8>>> {
        let Some((number, path)) = file.filter(|(number, _)| self.read != Some(*number)) else {
            return Ok(None);
        };
        self.read = Some(number);
        let parts = parts_of(&std::fs::read(path)?)?;
        if let Some(poses) = self.poses_of(&parts) {
            self.poses = poses;
            return Ok(None);
        }
        let sharp: Vec<Mesh> = parts.iter().map(split_creases).collect();
        (self.last, self.poses) = (parts, Vec::new());
        self.written += 1;
        Ok(Some(pack_parts(&sharp, MeshRole::Solids, time, 0)))
    }

    /// Where the parts of the last mesh are, if these are no other ones.
    fn poses_of(&self, parts: &[Mesh]) -> Option<Vec<[f64; 12]>> {
        if self.written == 0 || parts.len() != self.last.len() {
            return None;
        }
        let bounds = self.last.iter().flat_map(|part| &part.positions);
        let side = bounds.fold(Aabb::EMPTY, |all, p| all.including(*p)).size().max_element();
        let of = |(then, now): (&Mesh, &Mesh)| {
            let is_same = then.triangles == now.triangles;
            is_same.then(|| pose(&then.positions, &now.positions, BESIDE * side)).flatten()
        };
        let placements = self.last.iter().zip(parts).map(of);
        placements.map(|placement| Some(columns(&placement?))).collect()
    }
}

/// The bodies of the mesh of a file, distinguished by its array `body` if it has one.
fn parts_of(file: &[u8]) -> io::Result<Vec<Mesh>> {
    let whole = read_mesh(file).map_err(io::Error::other)?;
    let (_, arrays) = read_arrays(file).map_err(io::Error::other)?;
    let Some(body) = arrays.into_iter().find(|array| array.name == "body" && array.components == 1) else {
        return Ok(vec![whole]);
    };
    let last = body.values.iter().copied().fold(0.0, f64::max);
    let parts = if last < MOST_PARTS { whole.divided(&body.values, last as usize + 1) } else { None };
    Ok(parts.unwrap_or_else(|| vec![whole]))
}

fn facts(entries: &[(usize, FrameEntry)], survey: &Survey, figures: Option<&RunFigures>) -> String {
    let mut parts = Vec::new();
    parts.extend(figures.map(|figures| format!("scene {}", figures.scene)));
    parts.push(format!("{} particles", survey.particles / entries.len().max(1)));
    if let (Some((_, first)), Some((_, last))) = (entries.first(), entries.last()) {
        parts.push(format!("{}, {} to {} s", counted(entries.len(), "frame"), first.time, last.time));
    }
    parts.join(" · ")
}
