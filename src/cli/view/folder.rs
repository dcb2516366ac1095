//! The folder of a run as a page.
//!
//! Frames are read twice: first for their ranges, then to be written, so that only one is in memory at a time.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::super::failure::Failure;
use super::super::output::counted;
use super::super::saved::{self, RunFigures};
use super::super::survey::{Survey, is_velocity};
use super::options::View;
use super::plots;
use rfm::fluid_surface::{FrameEntry, read_arrays, read_mesh};
use rfm::mesh::split_creases;
use rfm::view::{
    Array, Corners, Frame, FrameHead, Lattice, Levels, Motion, Page, Setting, VELOCITY, pack_frame, pack_mesh,
};

/// A run in its folder.
pub(super) struct SavedRun {
    folder: PathBuf,
    entries: Vec<(usize, FrameEntry)>,
    /// Files of the obstacles' meshes, and for each frame the number of its mesh.
    meshes: Vec<PathBuf>,
    mesh_of: Vec<Option<usize>>,
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
        let figures = RunFigures::read(&folder.join("summary.json")).ok();
        let survey = Survey::of(folder, &entries)?;
        let (meshes, mesh_of) = saved::obstacles(folder, &entries)?;
        let domain = survey.domain(figures.as_ref());
        let mut arrays = survey.arrays.clone();
        let velocity = survey.velocity.into_iter();
        arrays.extend(velocity.flat_map(|range| VELOCITY.map(|name| (name.to_string(), range))));
        let lattice = Lattice::new(&domain.union(&survey.bounds));
        let setting = Setting {
            title: saved::title(folder),
            facts: facts(&entries, &survey, figures.as_ref()),
            live: false,
            moves: false,
            domain: Corners::from(&domain),
            lattice: Some(Corners::from(lattice.bounds())),
            radius: survey.radius(figures.as_ref(), entries.len()),
            arrays: arrays.iter().map(|(name, range)| Array::named(name, Some(*range))).collect(),
            gravity: None,
            params: Vec::new(),
            plots: Some(plots::saved(folder)),
        };
        let (folder, particles) = (folder.to_path_buf(), survey.particles);
        Ok(Self { folder, entries, meshes, mesh_of, arrays, particles, setting, lattice })
    }

    pub fn frames(&self) -> usize {
        self.entries.len()
    }

    /// The number of particles of all frames together.
    pub fn particles(&self) -> usize {
        self.particles
    }

    /// Writes the page.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut page = Page::begin(out, &self.setting)?;
        let mut written = 0;
        let (mut before, mut time) = (None::<Frame>, 0.0);
        for ((_, entry), mesh) in self.entries.iter().zip(&self.mesh_of) {
            while mesh.is_some_and(|mesh| written <= mesh) {
                let file = std::fs::read(&self.meshes[written])?;
                let mesh = read_mesh(&file).map_err(io::Error::other)?;
                page.block(&pack_mesh(&split_creases(&mesh), entry.time, 0))?;
                written += 1;
            }
            let frame = self.frame(entry)?;
            let head = FrameHead {
                time: entry.time,
                step: None,
                ranges: self.arrays.iter().map(|(_, range)| *range).collect(),
                mesh: *mesh,
                run: 0,
                motion: self.motion(entry.time - time),
            };
            page.block(&pack_frame(&head, &frame, before.as_ref()))?;
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

fn facts(entries: &[(usize, FrameEntry)], survey: &Survey, figures: Option<&RunFigures>) -> String {
    let mut parts = Vec::new();
    parts.extend(figures.map(|figures| format!("scene {}", figures.scene)));
    parts.push(format!("{} particles", survey.particles / entries.len().max(1)));
    if let (Some((_, first)), Some((_, last))) = (entries.first(), entries.last()) {
        parts.push(format!("{}, {} to {} s", counted(entries.len(), "frame"), first.time, last.time));
    }
    parts.join(" · ")
}
