//! The obstacles of a saved run: their separate meshes, and how each of them is drawn.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::look::{Look, Opened};
use super::options::Render;
use crate::cli::failure::Failure;
use crate::cli::output::{self, Shown};
use crate::cli::saved::{self, RunFigures};
use crate::cli::scenery::{Drawn, glass, opened_by, out_of_the_way};
use rfm::fluid_surface::{FrameEntry, read_arrays, read_mesh};
use rfm::mesh::Mesh;
use rfm::render::{Camera, Cut};

/// Most particles of the first frame that stand for the fluid when it is asked what hides it.
const MOST_SAMPLES: usize = 3000;

/// The obstacles at the start of a run.
pub(super) struct Bodies {
    /// Their names; one for all if the folder does not distinguish them.
    pub names: Vec<String>,
    are_named: bool,
    meshes: Vec<Mesh>,
    /// Particles of the first frame.
    samples: Vec<DVec3>,
    /// Whether they stay where they are.
    stand: bool,
}

impl Bodies {
    pub fn at_start(
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
        let samples = finite.into_iter().step_by(every).collect();
        Ok(Self { names, are_named, meshes, samples, stand: others.len() <= 1 })
    }

    /// How each of them is drawn.
    pub fn drawn(&self, options: &Render, look: &Look<'_>, camera: &Camera) -> Result<Vec<Drawn>, Failure> {
        let is_unknown = |name: &&String| !self.are_named || !self.names.contains(*name);
        let unknown = |flag, given: &[String]| given.iter().find(is_unknown).map(|name| (flag, name.clone()));
        if let Some((flag, unknown)) =
            unknown("--hide", &options.hide).or_else(|| unknown("--glass", &options.glass))
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
            return Err(Failure::usage(format!("{flag} {unknown}: {reason}")));
        }
        let is_among = |lists: [&[String]; 2], name: &String| {
            self.are_named && lists.iter().any(|list| list.contains(name))
        };
        let is_hidden = |name: &String| is_among(look.hidden(), name);
        let is_glass = |name: &String| is_among(look.glass(), name);
        let by_plane = |cut: Cut, mesh: &Mesh| {
            // where bodies that move will be is not looked up
            if self.stand { opened_by(cut, mesh.positions.iter().copied()) } else { Drawn::Open(cut) }
        };
        let opened = look.opened(camera);
        let drawn = |(name, mesh): (&String, &Mesh)| match opened {
            _ if is_hidden(name) => Drawn::Hidden,
            Opened::By(cut) if is_glass(name) => glass(by_plane(cut, mesh)),
            _ if is_glass(name) => Drawn::Glass(None),
            Opened::Nothing => Drawn::Whole,
            Opened::By(cut) => by_plane(cut, mesh),
            Opened::Automatic => out_of_the_way(camera, name, mesh, &self.samples),
        };
        Ok(self.names.iter().zip(&self.meshes).map(drawn).collect())
    }
}

/// The bodies of a file, distinguished by its array `body` if there are several.
pub(super) fn bodies_of(path: &Path, count: usize) -> Result<Vec<Mesh>, Failure> {
    let failed = |error: String| Failure::usage(format!("cannot read `{}`: {error}", path.shown()));
    let file = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
    output::remember_input(path);
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
    whole.divided(&array.values, count).ok_or_else(|| {
        failed(format!("its array `body` tells apart other obstacles than the {count} that there are"))
    })
}
