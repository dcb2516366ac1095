//! What each command does in the folder of a combination.

use std::path::{Path, PathBuf};

use super::super::args::{Check, Mesh, MessageFormat, Report, Run, Shared};
use super::super::{Failure, check as checks, choose, input, mesh as meshes, report as reports, run as runs};
use super::figures::Command;
use super::options::SweepOptions;
use super::task::Task;

/// The folder of a sweep, as it is asked for or beside the file.
fn folder(options: &SweepOptions, file: &Path) -> PathBuf {
    options.into.clone().unwrap_or_else(|| file.with_extension("sweep"))
}

/// A path within a folder that has the name of one that was asked for.
fn within(folder: &Path, asked: Option<&PathBuf>) -> Option<PathBuf> {
    asked.map(|path| folder.join(path.file_name().unwrap_or_default()))
}

/// Refuses options that have no meaning in a sweep.
fn refuse(options: &[(&str, bool)]) -> Result<(), Failure> {
    match options.iter().find(|(_, given)| *given) {
        Some((flag, _)) => Err(Failure::usage(format!("{flag} and --sweep exclude each other"))),
        None => Ok(()),
    }
}

/// `rfm check --sweep`.
pub(in crate::cli) fn check(shared: &Shared, options: &Check) -> Result<(), Failure> {
    let form = options.message_format != MessageFormat::Human;
    refuse(&[("--watch", options.watch), ("--fix", options.fix), ("--message-format", form)])?;
    let [file] = &options.files[..] else {
        return Err(Failure::usage("--sweep goes through the values of one file at a time"));
    };
    let single = Check { sweep: SweepOptions::default(), again: Default::default(), ..options.clone() };
    let task = Task {
        shared,
        command: Command::Check,
        file,
        sweeps: &options.sweep.sweep,
        folder: folder(&options.sweep, file),
        options: format!("{single:?}"),
        resume: options.again.resume,
        force: options.again.force,
    };
    task.go(|shared, folder| {
        let slice = PathBuf::from("slice.svg");
        let output =
            options.slice.and_then(|_| within(folder, Some(options.output.as_ref().unwrap_or(&slice))));
        checks::run(shared, &Check { output, ..single.clone() })
    })
}

/// `rfm mesh --sweep`.
pub(in crate::cli) fn mesh(shared: &Shared, options: &Mesh) -> Result<(), Failure> {
    refuse(&[("-o -", options.output.as_deref() == Some(Path::new("-")))])?;
    let single = Mesh { sweep: SweepOptions::default(), again: Default::default(), ..options.clone() };
    let task = Task {
        shared,
        command: Command::Mesh,
        file: &options.file,
        sweeps: &options.sweep.sweep,
        folder: folder(&options.sweep, &options.file),
        options: format!("{single:?}"),
        resume: options.again.resume,
        force: options.again.force,
    };
    task.go(|shared, folder| {
        let output = within(folder, options.output.as_ref());
        meshes::run(shared, &Mesh { output, ..single.clone() })
    })
}

/// `rfm run --sweep`.
pub(in crate::cli) fn run(shared: &Shared, options: &Run) -> Result<(), Failure> {
    refuse(&[("--dry-run", options.dry_run)])?;
    if options.output.is_some() && options.sweep.into.is_some() {
        return Err(Failure::usage("-o and --into both name the folder of the sweep: give one of them"));
    }
    let single =
        Run { sweep: SweepOptions::default(), resume: false, force: false, output: None, ..options.clone() };
    let task = Task {
        shared,
        command: Command::Run,
        file: &options.file,
        sweeps: &options.sweep.sweep,
        folder: options.output.clone().unwrap_or_else(|| folder(&options.sweep, &options.file)),
        options: format!("{single:?}"),
        resume: options.resume,
        force: options.force,
    };
    task.go(|shared, folder| {
        // a run of the sweep that was interrupted goes on; what else is in its folder belongs to the sweep
        let resume = options.resume && runs::has_checkpoint(folder);
        let force = !resume && (options.resume || options.force);
        runs::run(shared, &Run { output: Some(folder.to_path_buf()), resume, force, ..single.clone() })
    })
}

/// `rfm report --sweep`.
pub(in crate::cli) fn report(shared: &Shared, options: &Report) -> Result<(), Failure> {
    let (file, name) = choose::subject(&options.subject);
    let is_size = options.sweep.sweep.iter().any(|sweep| sweep.name == "particles");
    if is_size && file != Path::new("-") && is_of_a_flow(shared, options, file, name)? {
        return Err(Failure::usage(
            "the report of a flow chooses `particles` itself: give the sizes by --particles, and sweep another param",
        ));
    }
    let single = Report { sweep: SweepOptions::default(), again: Default::default(), ..options.clone() };
    let task = Task {
        shared,
        command: Command::Report,
        file,
        sweeps: &options.sweep.sweep,
        folder: folder(&options.sweep, file),
        options: format!("{single:?}"),
        resume: options.again.resume,
        force: options.again.force,
    };
    task.go(|shared, folder| {
        let [output, mesh_plot, html] =
            [&options.output, &options.mesh_plot, &options.html].map(|path| within(folder, path.as_ref()));
        reports::run(shared, &Report { output, mesh_plot, html, ..single.clone() })
    })
}

/// Whether a report is about a scene.
fn is_of_a_flow(shared: &Shared, options: &Report, file: &Path, name: Option<&str>) -> Result<bool, Failure> {
    let program = input::program(shared, file)?;
    let module = program.module();
    let asked = !options.flow.particles.is_empty() || !options.flow.methods.is_empty();
    Ok(match name {
        Some(name) => module.scenes.iter().any(|scene| scene.name == name),
        None => asked || module.solids.is_empty(),
    })
}
