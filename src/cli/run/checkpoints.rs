//! Checkpoints of a run. They are written beside the frames, and the last two are kept for `--resume`.
//!
//! Invariant: an older checkpoint is removed only after a newer one is complete.

use std::path::{Path, PathBuf};

use super::super::{Failure, note, output};
use crate::cli::output::Shown;
use rfm::experiment::{Every, SceneMark};
use rfm::lower::Scene;
use rfm::sph::{Checkpoint, CheckpointError, Simulation};

/// Number of checkpoints that are kept. The second serves if the last is found damaged.
const KEPT: usize = 2;

const FOLDER: &str = "checkpoints";

pub(super) struct Checkpoints {
    folder: PathBuf,
    mark: SceneMark,
    /// Times of checkpoints; `None`: one is saved with every frame.
    every: Option<Every>,
    /// Step numbers of the checkpoints in the folder, oldest first.
    steps: Vec<u64>,
}

impl Checkpoints {
    pub fn new(run_folder: &Path, mark: SceneMark, scene: &Scene, resumed: Option<&Checkpoint>) -> Self {
        let folder = run_folder.join(FOLDER);
        let time = resumed.map_or(0.0, |checkpoint| checkpoint.time);
        let every = scene.run.checkpoint_every.map(|period| Every::after(period, time));
        let upto = resumed.map_or(0, |checkpoint| checkpoint.steps);
        let steps = list(&folder).into_iter().filter(|steps| *steps <= upto && resumed.is_some()).collect();
        Self { folder, mark, every, steps }
    }

    /// Whether a checkpoint is to be written at this instant; `with_frame`: a frame has been saved at it.
    pub fn is_due(&mut self, time: f64, with_frame: bool) -> bool {
        self.every.as_mut().map_or(with_frame, |every| every.is_due(time))
    }

    /// Writes the present state, with what `more` adds to it.
    pub fn save(
        &mut self,
        simulation: &Simulation,
        more: impl FnOnce(&mut Checkpoint),
    ) -> Result<(), Failure> {
        std::fs::create_dir_all(&self.folder)
            .map_err(|e| Failure::usage(format!("cannot make the folder `{}`: {e}", self.folder.shown())))?;
        let mut checkpoint = simulation.checkpoint();
        self.mark.stamp(&mut checkpoint);
        more(&mut checkpoint);
        let steps = checkpoint.steps;
        output::write(&path(&self.folder, steps), |mut out| checkpoint.write(&mut out))?;
        self.steps.retain(|other| *other != steps);
        self.steps.push(steps);
        while self.steps.len() > KEPT {
            // a file that cannot be removed is no reason to end a run
            let _ = std::fs::remove_file(path(&self.folder, self.steps.remove(0)));
        }
        Ok(())
    }

    /// The newest checkpoint, if there is one.
    pub fn last(&self) -> Option<PathBuf> {
        self.steps.last().map(|steps| path(&self.folder, *steps))
    }
}

/// The newest sound checkpoint of a run.
///
/// # Errors
/// There is no checkpoint, or it is not one of this scene. `read` are the files that the scene's file names.
pub(super) fn latest(run_folder: &Path, mark: &SceneMark, read: &[String]) -> Result<Checkpoint, Failure> {
    let folder = run_folder.join(FOLDER);
    let mut faults = Vec::new();
    for steps in list(&folder).into_iter().rev() {
        let path = path(&folder, steps);
        match sound(&path) {
            Ok(checkpoint) if !mark.fits(&checkpoint) => {
                return Err(Failure::usage(format!(
                    "cannot go on from `{}`: {}; only the `run` block and probes may change (with --force instead of \
                     --resume the run begins anew)",
                    path.shown(),
                    what_changed(mark, &checkpoint, read)
                )));
            }
            Ok(checkpoint) => {
                for fault in &faults {
                    note(format!("{fault}; going on from the one before, step {steps}"));
                }
                return Ok(checkpoint);
            }
            Err(error) => faults.push(format!("cannot use `{}`: {error}", path.shown())),
        }
    }
    if faults.is_empty() {
        let folder = folder.shown();
        return Err(Failure::usage(format!("there is no checkpoint in `{folder}` to go on from")));
    }
    faults
        .push("there is nothing else to go on from: --force in place of --resume begins the run anew".into());
    Err(Failure::usage(faults.join("\n")))
}

/// Why a checkpoint does not belong to the scene that has this mark, and reads these files.
fn what_changed(mark: &SceneMark, checkpoint: &Checkpoint, read: &[String]) -> String {
    // a part of the scene may come from a file
    let files = match read {
        [] => String::new(),
        files => format!(", or a file that it reads ({}),", listed(files)),
    };
    let differences = match &mark.differences(checkpoint)[..] {
        [] => String::new(),
        found => format!(": {}", found.join(", ")),
    };
    format!("it belongs to another scene, or this scene{files} has changed since{differences}")
}

/// Whether a folder has a checkpoint.
pub(super) fn exist(run_folder: &Path) -> bool {
    !list(&run_folder.join(FOLDER)).is_empty()
}

/// Removes all checkpoints of a folder, and nothing else.
pub(super) fn remove_all(run_folder: &Path) -> std::io::Result<()> {
    let folder = run_folder.join(FOLDER);
    for steps in list(&folder) {
        std::fs::remove_file(path(&folder, steps))?;
    }
    Ok(())
}

fn path(folder: &Path, steps: u64) -> PathBuf {
    folder.join(Checkpoint::file_name(steps))
}

/// Step numbers of the checkpoints in a folder, ascending.
fn list(folder: &Path) -> Vec<u64> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut steps: Vec<u64> =
        entries.filter_map(|entry| Checkpoint::steps_of_file(entry.file_name().to_str()?)).collect();
    steps.sort_unstable();
    steps
}

/// Why a file is not used as a checkpoint.
enum Unusable {
    File(std::io::Error),
    Content(CheckpointError),
}

impl std::fmt::Display for Unusable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(error) => error.fmt(f),
            Self::Content(error) => error.fmt(f),
        }
    }
}

/// The names of files: the first few, and how many others there are.
fn listed(files: &[String]) -> String {
    const SHOWN: usize = 5;
    let mut names: Vec<String> =
        files.iter().take(SHOWN).map(|name| format!("`{}`", Path::new(name).shown())).collect();
    if files.len() > SHOWN {
        names.push(format!("{} more", files.len() - SHOWN));
    }
    names.join(", ")
}

fn sound(path: &Path) -> Result<Checkpoint, Unusable> {
    let bytes = std::fs::read(path).map_err(Unusable::File)?;
    Checkpoint::read(&bytes).map_err(Unusable::Content)
}
