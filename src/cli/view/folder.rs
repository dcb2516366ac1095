//! The folder of a run as a page.
//!
//! Frames are read twice: first for their ranges, then to be written, so that only one is in memory at a time.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::super::args::View;
use super::super::failure::Failure;
use super::super::saved::{self, RunFigures};
use super::super::survey::Survey;
use rfm::fluid_surface::{FrameEntry, read_arrays, read_mesh};
use rfm::mesh::split_creases;
use rfm::view::{
    Array, Column, Corners, Frame, FrameHead, Lattice, Levels, Page, Plot, Setting, pack_frame, pack_mesh,
};

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
        let lattice = Lattice::new(&domain.union(&survey.bounds));
        let setting = Setting {
            title: saved::title(folder),
            facts: facts(&entries, &survey, figures.as_ref()),
            live: false,
            domain: Corners::from(&domain),
            lattice: Some(Corners::from(lattice.bounds())),
            radius: survey.radius(figures.as_ref(), entries.len()),
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
