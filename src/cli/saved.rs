//! What `rfm run` left in a folder: the list of its frames, and the figures of its summary.

use std::path::Path;

use serde::Deserialize;

use super::failure::Failure;
use super::output::Shown;
use super::values::Frames;
use rfm::fluid_surface::{FrameEntry, read_collection};

/// The part of a run's `summary.json` that other commands need.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct RunFigures {
    pub particle_mass: f64,
    pub rest_density: f64,
    #[serde(default)]
    pub scene: String,
    /// The lowest and the highest corner of the scene's box, m.
    #[serde(default, rename = "box")]
    pub domain: Option<[[f64; 3]; 2]>,
}

impl RunFigures {
    /// Reads the summary of a run, or says why that is not possible.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = std::fs::read_to_string(path).map_err(|error| error.to_string())?;
        serde_json::from_str(&text).map_err(|error| error.to_string())
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

/// The entries of a collection.
pub(super) fn listed(path: &Path) -> Result<Vec<FrameEntry>, Failure> {
    let failed = |error: String| Failure::usage(format!("cannot read `{}`: {error}", path.shown()));
    let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
    read_collection(&text).map_err(|error| failed(error.to_string()))
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
            "--frames {first}..{end}: there are {count} frames, from 0 to {}; B is the first that is left out",
            count - 1
        )));
    }
    Ok(entries.into_iter().enumerate().take(end).skip(first).collect())
}
