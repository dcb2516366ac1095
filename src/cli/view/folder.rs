//! The folder of a run as a page.
//!
//! Frames are read twice: first for their ranges, then to be written, so that only one is in memory at a time.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use glam::DVec3;
use rayon::prelude::*;

use super::super::args::View;
use super::super::failure::Failure;
use super::super::saved::{self, RunFigures};
use crate::cli::output::Shown;
use rfm::fluid_surface::{FrameEntry, PointArray, read_arrays, read_mesh};
use rfm::geom::Aabb;
use rfm::mesh::split_creases;
use rfm::view::{
    Array, Column, Corners, Frame, FrameHead, Lattice, Levels, Page, Plot, Setting, pack_frame, pack_mesh,
};

/// The part of the values of a frame at each end that may lie beyond the range of the levels.
const STRAY: f64 = 0.001;

/// Most points of a plot.
const MOST_POINTS: usize = 1000;

/// A run in its folder.
pub(super) struct SavedRun {
    folder: PathBuf,
    entries: Vec<(usize, FrameEntry)>,
    /// Files of the obstacles' meshes, and for each frame the number of its mesh.
    meshes: Vec<PathBuf>,
    mesh_of: Vec<Option<usize>>,
    survey: Survey,
    setting: Setting,
    lattice: Lattice,
}

/// What is known of all frames together.
struct Survey {
    bounds: Aabb,
    /// Name and range of each array that all frames have.
    arrays: Vec<(String, Levels)>,
    /// The number of particles of all frames together.
    particles: usize,
}

impl SavedRun {
    /// Reads what the folder has, the frames included.
    pub fn open(folder: &Path, options: &View) -> Result<Self, Failure> {
        let chosen = saved::chosen(saved::collection(folder)?, options.frames)?;
        let entries: Vec<_> = chosen.into_iter().step_by(options.every).collect();
        saved::check_frames(folder, &entries)?;
        let figures = RunFigures::read(&folder.join("summary.json")).ok();
        let survey = Survey::of(folder, &entries)?;
        let (meshes, mesh_of) = obstacles(folder, &entries)?;
        let domain = figures
            .as_ref()
            .and_then(|figures| figures.domain)
            .map(|[min, max]| Aabb::new(DVec3::from_array(min), DVec3::from_array(max)));
        let domain =
            domain.filter(|domain| domain.is_finite() && !domain.is_empty()).unwrap_or(survey.bounds);
        let lattice = Lattice::new(&domain.union(&survey.bounds));
        let volume = figures.as_ref().map(RunFigures::particle_volume);
        let volume = volume.filter(|volume| volume.is_finite() && *volume > 0.0).unwrap_or_else(|| {
            // without a summary it is guessed from the box around the particles
            let frames = entries.len().max(1);
            survey.bounds.volume() / (survey.particles / frames).max(1) as f64 / 8.0
        });
        let setting = Setting {
            title: title(folder),
            facts: facts(&entries, &survey, figures.as_ref()),
            live: false,
            domain: Corners::from(&domain),
            lattice: Some(Corners::from(lattice.bounds())),
            radius: 0.5 * volume.cbrt(),
            arrays: survey.arrays.iter().map(|(name, range)| Array::named(name, Some(*range))).collect(),
            gravity: None,
            params: Vec::new(),
            plots: plots(&folder.join("probes")),
        };
        Ok(Self { folder: folder.to_path_buf(), entries, meshes, mesh_of, survey, setting, lattice })
    }

    pub fn frames(&self) -> usize {
        self.entries.len()
    }

    /// The number of particles of all frames together.
    pub fn particles(&self) -> usize {
        self.survey.particles
    }

    /// Writes the page.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut page = Page::begin(out, &self.setting)?;
        let mut written = 0;
        let mut before: Option<Frame> = None;
        for ((_, entry), mesh) in self.entries.iter().zip(&self.mesh_of) {
            while mesh.is_some_and(|mesh| written <= mesh) {
                let file = std::fs::read(&self.meshes[written])?;
                let mesh = read_mesh(&file).map_err(io::Error::other)?;
                page.block(&pack_mesh(&split_creases(&mesh), 0))?;
                written += 1;
            }
            let frame = self.frame(entry)?;
            let head = FrameHead {
                time: entry.time,
                step: None,
                ranges: self.survey.arrays.iter().map(|(_, range)| *range).collect(),
                mesh: *mesh,
                run: 0,
            };
            page.block(&pack_frame(&head, &frame, before.as_ref()))?;
            before = Some(frame);
        }
        page.end()
    }

    fn frame(&self, entry: &FrameEntry) -> io::Result<Frame> {
        let file = std::fs::read(self.folder.join(&entry.file))?;
        let (points, arrays) = read_arrays(&file).map_err(io::Error::other)?;
        let levels = |(name, range): &(String, Levels)| {
            let array = arrays.iter().find(|array| array.name == *name && array.components == 1);
            let array = array.ok_or_else(|| io::Error::other(format!("the array `{name}` is missing")))?;
            Ok(array.values.iter().map(|value| range.level(*value)).collect())
        };
        Ok(Frame {
            sites: points.iter().map(|p| self.lattice.site(*p)).collect(),
            levels: self.survey.arrays.iter().map(levels).collect::<io::Result<_>>()?,
        })
    }
}

impl Survey {
    fn of(folder: &Path, entries: &[(usize, FrameEntry)]) -> Result<Self, Failure> {
        let surveys: Result<Vec<Self>, Failure> = entries
            .par_iter()
            .map(|(_, entry)| {
                let path = folder.join(&entry.file);
                let failed = |error: String| {
                    Failure::usage(format!("cannot read the frame `{}`: {error}", path.shown()))
                };
                let file = std::fs::read(&path).map_err(|error| failed(error.to_string()))?;
                let (points, arrays) = read_arrays(&file).map_err(|error| failed(error.to_string()))?;
                Ok(Self::of_frame(&points, &arrays))
            })
            .collect();
        let mut surveys = surveys?.into_iter();
        let mut all =
            surveys.next().unwrap_or(Self { bounds: Aabb::EMPTY, arrays: Vec::new(), particles: 0 });
        for next in surveys {
            all.bounds = all.bounds.union(&next.bounds);
            all.particles += next.particles;
            all.arrays.retain_mut(|(name, range)| {
                let same = next.arrays.iter().find(|(other, _)| other == name);
                same.inspect(|(_, other)| *range = range.with(*other)).is_some()
            });
        }
        if all.bounds.is_empty() {
            all.bounds = Aabb::new(DVec3::ZERO, DVec3::ONE);
        }
        // colours of speeds begin at rest
        all.arrays.iter_mut().filter(|(name, _)| name == "speed").for_each(|(_, range)| range.low = 0.0);
        Ok(all)
    }

    fn of_frame(points: &[DVec3], arrays: &[PointArray]) -> Self {
        let finite = points.iter().filter(|p| p.is_finite());
        let scalars = arrays.iter().filter(|array| array.components == 1 && array.name != "id");
        let range = |array: &PointArray| {
            let range = Levels::of_most(array.values.iter().copied(), STRAY);
            (array.name.clone(), range.unwrap_or(Levels { low: 0.0, high: 0.0 }))
        };
        Self {
            bounds: finite.fold(Aabb::EMPTY, |all, p| all.including(*p)),
            arrays: scalars.map(range).collect(),
            particles: points.len(),
        }
    }
}

/// The meshes of the obstacles, and which of them belongs to each frame.
type Meshes = (Vec<PathBuf>, Vec<Option<usize>>);

/// The meshes of the obstacles: one, or if they move one for each frame.
fn obstacles(folder: &Path, entries: &[(usize, FrameEntry)]) -> Result<Meshes, Failure> {
    let moving = folder.join("obstacle.pvd");
    if moving.is_file() {
        let listed = saved::listed(&moving)?;
        let mut files = Vec::new();
        let mesh_of = entries.iter().map(|(_, entry)| {
            let there = listed.iter().find(|mesh| mesh.time == entry.time);
            if let Some(mesh) = there.filter(|mesh| folder.join(&mesh.file).is_file()) {
                files.push(folder.join(&mesh.file));
            }
            files.len().checked_sub(1)
        });
        let mesh_of = mesh_of.collect();
        return Ok((files, mesh_of));
    }
    let still = folder.join("obstacle.vtp");
    if still.is_file() {
        return Ok((vec![still], vec![Some(0); entries.len()]));
    }
    Ok((Vec::new(), vec![None; entries.len()]))
}

fn title(folder: &Path) -> String {
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    whole.file_name().map_or_else(|| whole.shown(), |name| Path::new(name).shown())
}

fn facts(entries: &[(usize, FrameEntry)], survey: &Survey, figures: Option<&RunFigures>) -> String {
    let mut parts = Vec::new();
    parts.extend(figures.map(|figures| format!("scene {}", figures.scene)));
    parts.push(format!("{} particles", survey.particles / entries.len().max(1)));
    if let (Some((_, first)), Some((_, last))) = (entries.first(), entries.last()) {
        parts.push(format!("{} frames, {} to {} s", entries.len(), first.time, last.time));
    }
    parts.join(" · ")
}

/// The tables of probes, a plot for each unit. A table that cannot be read is left out: it may be a file of the user's.
fn plots(folder: &Path) -> Vec<Plot> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut tables: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|e| e == "csv")).collect();
    tables.sort();
    tables.iter().flat_map(|path| plots_of(path).unwrap_or_default()).collect()
}

fn plots_of(path: &Path) -> Option<Vec<Plot>> {
    let text = std::fs::read_to_string(path).ok()?;
    let (header, lines) = text.split_once('\n')?;
    let mut names = header.split(',').map(|name| name.trim().trim_end_matches(']').split_once(" ["));
    names.next().flatten().filter(|(name, unit)| (*name, *unit) == ("time", "s"))?;
    let columns: Vec<(&str, &str)> = names.collect::<Option<_>>()?;
    let numbers =
        |line: &str| line.split(',').map(|word| word.trim().parse().ok()).collect::<Option<Vec<f64>>>();
    let rows: Vec<Vec<f64>> =
        lines.lines().filter_map(numbers).filter(|row| row.len() == columns.len() + 1).collect();
    let every = rows.len().div_ceil(MOST_POINTS).max(1);
    let column = |k: usize| rows.iter().step_by(every).map(|row| row[k]).collect::<Vec<f64>>();
    let mut units: Vec<&str> = Vec::new();
    for (_, unit) in &columns {
        if !units.contains(unit) {
            units.push(unit);
        }
    }
    let name = path.file_stem()?.to_string_lossy();
    let plot = |unit: &str| {
        let same = columns.iter().enumerate().filter(|(_, (_, other))| *other == unit);
        let columns: Vec<Column> =
            same.map(|(k, (name, _))| Column { name: name.to_string(), values: column(k + 1) }).collect();
        let what =
            if let [only] = &columns[..] { format!("{name}: {}", only.name) } else { name.to_string() };
        Plot { name: format!("{what}, {unit}"), times: column(0), columns }
    };
    Some(units.into_iter().filter(|_| !rows.is_empty()).map(plot).collect())
}
