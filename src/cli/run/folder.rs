//! The folder of a run: who may write into it.
//!
//! Invariant: two runs never write into one folder at the same time, and no run is replaced unless the user
//! asks for it.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

use super::super::args::Run;
use super::super::output::{Shown, TEMPORARY, counted};
use super::super::{Failure, note};
use super::{checkpoints, paraview};
use crate::cli::saved::{HISTORY, OWN_TABLES};
use crate::cli::surfaces;
use rfm::lower::Scene;

/// Name of the file that a run locks in its folder. The system unlocks it when the process ends, however it ends.
const LOCK: &str = ".rfm.lock";

/// Folders within that of a run.
const PARTS: [&str; 5] = ["frames", "pictures", "checkpoints", PROBES, HISTORY];

/// The folder, within that of a run, of the tables of probes.
pub(super) const PROBES: &str = "probes";

/// Files that a run writes beside these folders.
pub(super) const RESULTS: [&str; 6] =
    ["summary.json", "particles.pvd", "obstacle.pvd", "obstacle.stl", "obstacle.vtp", paraview::NAME];

/// Beginnings of the names of files that a run writes beside these folders.
const FILES: [&str; 4] = ["summary", "particles", "obstacle", "open_in_paraview"];

/// The right to write into a folder, until it is dropped. The file with the lock stays: if it were removed, another run
/// could hold the lock of the removed file while a third locks a new one.
pub(super) struct Hold {
    _lock: File,
}

/// The folder for a run's files. The default is beside the file, `pawn.rfm` → `pawn.out`; for standard input
/// it is `rfm.out`.
pub(super) fn of(options: &Run) -> PathBuf {
    match &options.output {
        Some(folder) => folder.clone(),
        None if options.file == Path::new("-") => PathBuf::from("rfm.out"),
        None => options.file.with_extension("out"),
    }
}

/// Whether a run has written, or is writing, into a folder.
pub(super) fn was_held(folder: &Path) -> bool {
    folder.join(LOCK).is_file()
}

/// Refuses a folder that holds a sweep, a run which is neither to be replaced nor to be continued, or files
/// of others that the run of a scene would replace.
pub(super) fn may_be_written(folder: &Path, options: &Run, scene: &Scene) -> Result<(), Failure> {
    if folder == Path::new("-") {
        return Err(Failure::usage("a run writes a folder, and nothing to standard output: give -o DIR"));
    }
    if holds_a_sweep(folder) {
        return Err(Failure::usage(format!(
            "`{}` holds a sweep: write the run elsewhere with -o DIR",
            folder.shown()
        )));
    }
    if options.resume || options.force {
        return Ok(());
    }
    let Some(content) = run_in(folder) else { return nothing_is_replaced(folder, scene) };
    let shown = folder.shown();
    let go_on = if checkpoints::exist(folder) { "go on from it with --resume, " } else { "" };
    Err(Failure::usage(format!(
        "`{shown}` holds a run already ({content}): {go_on}replace it with --force, or write elsewhere with -o DIR"
    )))
}

/// Refuses a folder that is not one of a run and has files which the run of a scene would replace.
fn nothing_is_replaced(folder: &Path, scene: &Scene) -> Result<(), Failure> {
    let tables = scene.probes.iter().map(|probe| format!("{PROBES}/{}.csv", probe.name));
    let own = OWN_TABLES.iter().map(|(name, _)| format!("{HISTORY}/{name}.csv"));
    if OWN_TABLES.iter().any(|(name, _)| is_table(&folder.join(HISTORY).join(format!("{name}.csv")))) {
        return Ok(()); // of a run that was stopped before its first frame
    }
    let mut written = RESULTS.iter().map(ToString::to_string).chain(tables).chain(own);
    let found = written.find(|name| folder.join(name).exists());
    let numbered = || {
        let pictures = [("pictures", "frame_", ".png"), ("frames", "obstacle_", ".vtp")];
        pictures.into_iter().find_map(|(part, prefix, suffix)| first_numbered(folder, part, prefix, suffix))
    };
    let Some(found) = found.or_else(numbered).or_else(|| surfaces::first_old(folder)) else { return Ok(()) };
    Err(Failure::usage(format!(
        "`{}` holds no run, and `{found}` in it would be replaced: write elsewhere with -o DIR, or replace it with --force",
        folder.shown()
    )))
}

/// The head of the first column of every table.
pub(super) const TIME: &str = "time [s]";

/// Whether a file is a table that a run has written.
pub(super) fn is_table(path: &Path) -> bool {
    std::fs::read(path).is_ok_and(|bytes| bytes.starts_with(TIME.as_bytes()))
}

/// The first file of a part of a folder whose name is a number between these ends, in any order.
fn first_numbered(folder: &Path, part: &str, prefix: &str, suffix: &str) -> Option<String> {
    let names = std::fs::read_dir(folder.join(part)).into_iter().flatten().flatten();
    let mut names = names.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.find(|name| number_in(name, prefix, suffix).is_some()).map(|name| format!("{part}/{name}"))
}

/// The number between these ends of a name.
pub(super) fn number_in(name: &str, prefix: &str, suffix: &str) -> Option<usize> {
    name.strip_prefix(prefix)?.strip_suffix(suffix)?.parse().ok()
}

/// Whether a folder has the index of a sweep.
fn holds_a_sweep(folder: &Path) -> bool {
    let text = std::fs::read_to_string(folder.join("index.json")).unwrap_or_default();
    let index: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    ["fingerprint", "sweeps", "rows"].iter().all(|key| index.get(key).is_some())
}

/// What a folder has of a run, in words; `None` if there is nothing that a new run would remove.
pub(super) fn run_in(folder: &Path) -> Option<String> {
    let frames = std::fs::read_dir(folder.join("frames")).map_or(0, |entries| {
        entries.flatten().filter(|e| e.file_name().to_string_lossy().starts_with("particles_")).count()
    });
    let text = std::fs::read_to_string(folder.join("summary.json")).unwrap_or_default();
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    let is_summary = summary.get("simulated_seconds").is_some();
    if !is_summary && frames == 0 && !checkpoints::exist(folder) {
        return None;
    }
    let frames = counted(frames, "frame");
    Some(match (summary["scene"].as_str(), summary["simulated_seconds"].as_f64()) {
        (Some(scene), Some(time)) => format!("scene {scene}, {time:.3} s, {frames}"),
        _ => format!("not finished, {frames}"),
    })
}

impl Hold {
    /// Makes the folder if it is not there, and locks it. Removes the temporary files of a run that was killed.
    pub fn take(folder: &Path) -> Result<Self, Failure> {
        if folder.is_file() {
            return Err(Failure::usage(format!(
                "`{}` is a file, and a run writes into a folder: name one with -o DIR",
                folder.shown()
            )));
        }
        std::fs::create_dir_all(folder)
            .map_err(|e| Failure::usage(format!("cannot make the folder `{}`: {e}", folder.shown())))?;
        let path = folder.join(LOCK);
        let open = File::options().create(true).truncate(false).write(true).open(&path);
        let lock = open
            .map_err(|e| Failure::usage(format!("cannot write into the folder `{}`: {e}", folder.shown())))?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(Failure::usage(format!(
                    "another run is writing into `{}`: wait for its end, or write elsewhere with -o DIR",
                    folder.shown()
                )));
            }
            // some network folders cannot be locked
            Err(TryLockError::Error(e)) => note(format!("`{}` cannot be locked: {e}", folder.shown())),
        }
        // the folder may be one that other commands write into, too
        remove_temporaries(folder, &FILES);
        for part in PARTS {
            remove_temporaries(&folder.join(part), &[""]);
        }
        Ok(Self { _lock: lock })
    }
}

/// Removes files that a killed run was writing, by the beginnings of their names. One that cannot be removed
/// does no harm.
fn remove_temporaries(folder: &Path, names: &[&str]) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_of_run = |rest: &str| names.iter().any(|beginning| rest.starts_with(beginning));
        if name.strip_prefix(TEMPORARY).is_some_and(is_of_run) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}
