//! What `rfm run` left in a folder: the list of its frames, and the figures of its summary.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Deserialize;

use super::failure::{Failure, note};
use super::output::{Shown, counted};
use super::stated::Stated;
use super::values::Frames;
use rfm::fluid_surface::{FrameEntry, PointArray, read_arrays, read_collection};
use rfm::geom::Aabb;
use rfm::sph::Probe;

/// The folder, within that of a run, of the tables that every run writes.
pub(super) const HISTORY: &str = "history";

/// These tables: `energy.csv` and `audit.csv`.
pub(super) const OWN_TABLES: [(&str, Probe); 2] = [("energy", Probe::Energy), ("audit", Probe::Audit)];

/// The part of a run's `summary.json` that other commands need.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct RunFigures {
    pub particle_mass: f64,
    pub rest_density: f64,
    /// The file of the scene, without its folder; empty in folders of earlier versions, as the method is.
    #[serde(default)]
    pub file: String,
    #[serde(default)]
    pub scene: String,
    #[serde(default)]
    pub method: String,
    /// The names of the obstacles, in the order of the array `body` of their mesh.
    #[serde(default)]
    pub obstacles: Vec<String>,
    /// The lowest and the highest corner of the scene's box, m.
    #[serde(default, rename = "box")]
    pub domain: Option<[[f64; 3]; 2]>,
    /// The number of particles.
    #[serde(default)]
    pub particles: Option<usize>,
    /// What the scene states of its pictures.
    #[serde(default)]
    pub picture: Stated,
}

impl RunFigures {
    /// Reads the summary of a run, or says why that is not possible.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = std::fs::read_to_string(path).map_err(|error| error.to_string())?;
        serde_json::from_str(&text).map_err(|error| error.to_string())
    }

    /// The summary in the folder of a run. Without one pictures are possible, and a remark says what they lack.
    pub fn of(folder: &Path) -> Option<Self> {
        let path = folder.join("summary.json");
        let why = match Self::read(&path) {
            Ok(figures) => return Some(figures),
            Err(_) if !path.exists() => {
                format!("`{}`, which `rfm run` writes at its end, is not there", path.shown())
            }
            Err(error) => format!("cannot read `{}`: {error}", path.shown()),
        };
        note(format!(
            "{why}: the box and the size of the particles are guessed from their places, obstacles have no names, and what \
             the scene states of its pictures is not known"
        ));
        None
    }

    /// The box of the scene, if the summary states one.
    pub fn vessel(&self) -> Option<Aabb> {
        let vessel = self.domain.map(|[min, max]| Aabb::new(DVec3::from_array(min), DVec3::from_array(max)));
        vessel.filter(|vessel| vessel.is_finite() && !vessel.is_empty())
    }

    /// The volume of the fluid that a particle stands for, m³.
    pub fn particle_volume(&self) -> f64 {
        self.particle_mass / self.rest_density
    }
}

/// The frames of a run, from its `particles.pvd`.
pub(super) fn collection(folder: &Path) -> Result<Vec<FrameEntry>, Failure> {
    let path = folder.join("particles.pvd");
    if !path.is_file() {
        if let Some(first) = first_run_of_a_sweep(folder) {
            return Err(Failure::usage(format!(
                "`{}` holds a sweep, and each of its folders a run: name one of them, such as `{}`",
                folder.shown(),
                first.shown()
            )));
        }
        return Err(Failure::usage(format!(
            "there are no frames in `{}`: `rfm run` lists them in particles.pvd, unless it is told --no-frames",
            folder.shown()
        )));
    }
    let entries = listed(&path)?;
    if entries.is_empty() {
        return Err(Failure::usage(format!("cannot read `{}`: it lists no frames", path.shown())));
    }
    Ok(entries)
}

/// The first folder of a sweep that holds the frames of a run. `None` if the folder is not that of a sweep.
fn first_run_of_a_sweep(folder: &Path) -> Option<PathBuf> {
    if !folder.join("index.json").is_file() {
        return None;
    }
    let inner = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    inner.filter(|path| path.join("particles.pvd").is_file()).min()
}

/// The meshes of the obstacles, and which of them belongs to each frame.
pub(super) type Meshes = (Vec<PathBuf>, Vec<Option<usize>>);

/// Entries of a list by the bits of their times: runs may have very many.
pub(super) fn by_time(entries: Vec<FrameEntry>) -> HashMap<u64, FrameEntry> {
    // of several at one time the first counts
    entries.into_iter().rev().map(|entry| (entry.time.to_bits(), entry)).collect()
}

/// The meshes of the obstacles: one, or if they move one for each frame.
pub(super) fn obstacles(folder: &Path, entries: &[(usize, FrameEntry)]) -> Result<Meshes, Failure> {
    let moving = folder.join("obstacle.pvd");
    if moving.is_file() {
        let listed = by_time(listed(&moving)?);
        let mut files = Vec::new();
        let mesh_of = entries.iter().map(|(_, entry)| {
            let there = listed.get(&entry.time.to_bits());
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

/// Says which files of obstacles are missing, and what is seen in their place.
pub(super) fn tell_of_lost_obstacles(
    folder: &Path,
    entries: &[(usize, FrameEntry)],
    figures: Option<&RunFigures>,
) -> Result<(), Failure> {
    let list = folder.join("obstacle.pvd");
    let of_frame = |entry: &FrameEntry| folder.join(entry.file.replace("particles", "obstacle"));
    if !list.is_file() {
        let still = folder.join("obstacle.vtp");
        let names = figures.map(|figures| figures.obstacles.join(", ")).unwrap_or_default();
        if !still.is_file() && !names.is_empty() {
            note(format!("`{}` is missing: {names} cannot be drawn", still.shown()));
        }
        if entries.iter().any(|(_, entry)| of_frame(entry).is_file()) {
            note(format!("`{}` is missing: obstacles are drawn where they were at the start", list.shown()));
        }
        return Ok(());
    }
    let listed = by_time(listed(&list)?);
    let file = |entry: &FrameEntry| {
        let there = listed.get(&entry.time.to_bits());
        there.map_or_else(|| of_frame(entry), |mesh| folder.join(&mesh.file))
    };
    let lost = |entry: &FrameEntry| {
        Some(file(entry)).filter(|path| !listed.contains_key(&entry.time.to_bits()) || !path.is_file())
    };
    let mut lost = entries.iter().filter_map(|(_, entry)| lost(entry));
    let Some(first) = lost.next() else { return Ok(()) };
    let more = match lost.count() {
        0 => String::new(),
        more => format!(", and so are {} more", counted(more, "file")),
    };
    note(format!(
        "`{}` is missing{more}: obstacles are drawn there as in the frame before, or not at all",
        first.shown()
    ));
    Ok(())
}

/// What pictures of a run are of: its file, its scene and its method, or the folder if the run does not tell.
pub(super) fn subject(folder: &Path, figures: Option<&RunFigures>) -> Vec<String> {
    let file = figures.map(|figures| figures.file.as_str()).filter(|file| !file.is_empty());
    let file = file.map_or_else(|| title(folder), |file| Path::new(file).shown());
    let told = figures.into_iter().flat_map(|figures| [&figures.scene, &figures.method]);
    std::iter::once(file).chain(told.filter(|word| !word.is_empty()).cloned()).collect()
}

/// The name of a run's folder.
pub(super) fn title(folder: &Path) -> String {
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    whole.file_name().map_or_else(|| whole.shown(), |name| Path::new(name).shown())
}

/// The entries of a collection.
pub(super) fn listed(path: &Path) -> Result<Vec<FrameEntry>, Failure> {
    let failed = |error: String| Failure::usage(format!("cannot read `{}`: {error}", path.shown()));
    let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
    read_collection(&text).map_err(|error| failed(error.to_string()))
}

/// The places of the particles of a frame, and the values at them.
pub(super) fn arrays(path: &Path) -> Result<(Vec<DVec3>, Vec<PointArray>), Failure> {
    let failed = |error: String| Failure::usage(format!("cannot read the frame `{}`: {error}", path.shown()));
    let file = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
    read_arrays(&file).map_err(|error| failed(error.to_string()))
}

/// Refuses frames whose file is missing.
pub(super) fn check_frames(folder: &Path, entries: &[(usize, FrameEntry)]) -> Result<(), Failure> {
    for (_, entry) in entries {
        let file = folder.join(&entry.file);
        if !file.is_file() {
            let lost =
                format!("the frame `{}` is missing; `rfm run` writes it again, or choose", file.shown());
            return Err(Failure::usage(format!("{lost} others with --frames A..B")));
        }
    }
    Ok(())
}

/// The entries that are asked for, with their numbers.
pub(super) fn chosen(
    entries: Vec<FrameEntry>,
    frames: Option<Frames>,
) -> Result<Vec<(usize, FrameEntry)>, Failure> {
    let count = entries.len();
    let Frames { first, end } = frames.unwrap_or_default();
    let end = end.unwrap_or(count);
    if first >= end || end > count {
        return Err(Failure::usage(format!(
            "--frames {first}..{end}: there {} {}, from 0 to {}; B is the first that is left out",
            if count == 1 { "is" } else { "are" },
            counted(count, "frame"),
            count - 1
        )));
    }
    Ok(entries.into_iter().enumerate().take(end).skip(first).collect())
}
