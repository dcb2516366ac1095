//! What each command does in the folder of a combination.

use std::path::{Component, Path, PathBuf};

use super::super::args::{Check, Mesh, MessageFormat, Run};
use super::super::output::Shown;
use super::super::report::Report;
use super::super::shared::Shared;
use super::super::{Failure, check as checks, choose, input, mesh as meshes, report as reports, run as runs};
use super::figures::Command;
use super::options::SweepOptions;
use super::task::Task;

/// A command to repeat, and the folder for its results: the stated one, or one beside the file. It holds
/// whether the command resumes and replaces, and all its other options as a text.
fn task<'a>(
    shared: &'a Shared,
    command: Command,
    file: &'a Path,
    sweep: &'a SweepOptions,
    [resume, force]: [bool; 2],
    options: String,
) -> Task<'a> {
    let folder = sweep.into.clone().unwrap_or_else(|| file.with_extension("sweep"));
    let folder_flag = "--into DIR";
    Task { shared, command, file, sweeps: &sweep.sweep, folder, folder_flag, options, resume, force }
}

/// Refuses a path with a folder where a sweep takes the name of a file, which it writes in each of its folders. Only
/// `--into` names the folder of a sweep: what it holds is in the index, and guarded by `--force` and `--resume`.
fn plain_name(flag: &str, asked: Option<&PathBuf>, sweep: &SweepOptions) -> Result<(), Failure> {
    let Some(path) = asked else { return Ok(()) };
    let mut parts = path.components().filter(|part| *part != Component::CurDir);
    let is_plain = matches!(parts.next(), Some(Component::Normal(_))) && parts.next().is_none();
    if is_plain {
        return Ok(());
    }
    let shown = path.shown();
    let message =
        format!("{flag} names a file in each folder of the sweep, and `{shown}` names a folder as well");
    let name = path.file_name().map(|name| Path::new(name).shown());
    let folder = path.parent().map(Path::shown).filter(|folder| !folder.is_empty());
    let advice = match (name, folder) {
        (Some(name), Some(folder)) if sweep.into.is_none() => {
            let (folder, name) = (as_argument(&folder), as_argument(&name));
            format!("the folder of the sweep is given by --into DIR: write --into {folder} {flag} {name}")
        }
        (Some(name), _) => {
            format!("the folder of the sweep is given by --into DIR: write {flag} {}", as_argument(&name))
        }
        (None, _) => "write the name of a file, and the folder of the sweep by --into DIR".into(),
    };
    Err(Failure::usage(format!("{message}; {advice}")))
}

/// A path as an argument in a shell.
fn as_argument(path: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=+,:@%".contains(c);
    if path.chars().all(is_plain) { path.to_string() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}

/// The file of a plain name in the folder of a combination.
fn within(folder: &Path, asked: Option<&PathBuf>) -> Option<PathBuf> {
    asked.map(|name| folder.join(name))
}

/// Whether a path stands for standard output, on which a sweep prints its table.
fn is_stdout(path: Option<&Path>) -> bool {
    path == Some(Path::new("-"))
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
    let to_stdout = is_stdout(options.output.as_deref());
    refuse(&[
        ("--watch", options.watch),
        ("--fix", options.fix),
        ("--message-format", form),
        ("-o -", to_stdout),
    ])?;
    plain_name("-o", options.output.as_ref(), &options.sweep)?;
    let [file] = &options.files[..] else {
        return Err(Failure::usage("--sweep goes through the values of one file at a time"));
    };
    let single = Check { sweep: SweepOptions::default(), again: Default::default(), ..options.clone() };
    let again = [options.again.resume, options.again.force];
    task(shared, Command::Check, file, &options.sweep, again, format!("{single:?}")).go(|shared, folder| {
        let slice = PathBuf::from("slice.svg");
        let wanted = (!options.slice.is_empty()).then(|| options.output.as_ref().unwrap_or(&slice));
        let output = wanted.and_then(|output| within(folder, Some(output)));
        checks::run(shared, &Check { output, ..single.clone() })
    })
}

/// `rfm mesh --sweep`.
pub(in crate::cli) fn mesh(shared: &Shared, options: &Mesh) -> Result<(), Failure> {
    refuse(&[("-o -", is_stdout(options.output.as_deref()))])?;
    plain_name("-o", options.output.as_ref(), &options.sweep)?;
    let single = Mesh { sweep: SweepOptions::default(), again: Default::default(), ..options.clone() };
    let again = [options.again.resume, options.again.force];
    task(shared, Command::Mesh, &options.file, &options.sweep, again, format!("{single:?}")).go(
        |shared, folder| {
            let output = within(folder, options.output.as_ref());
            meshes::run(shared, &Mesh { output, ..single.clone() })
        },
    )
}

/// `rfm run --sweep`.
pub(in crate::cli) fn run(shared: &Shared, options: &Run) -> Result<(), Failure> {
    refuse(&[("--dry-run", options.dry_run), ("-o -", is_stdout(options.output.as_deref()))])?;
    if options.output.is_some() && options.sweep.into.is_some() {
        return Err(Failure::usage("-o and --into both name the folder of the sweep: give one of them"));
    }
    let single =
        Run { sweep: SweepOptions::default(), resume: false, force: false, output: None, ..options.clone() };
    let sweep = SweepOptions {
        into: options.sweep.into.clone().or_else(|| options.output.clone()),
        ..options.sweep.clone()
    };
    let again = [options.resume, options.force];
    let task = task(shared, Command::Run, &options.file, &sweep, again, format!("{single:?}"));
    let folder_flag = if options.output.is_some() { "-o DIR" } else { task.folder_flag };
    Task { folder_flag, ..task }.go(|shared, folder| {
        // an interrupted run of the sweep is continued; everything else in its folder belongs to the sweep
        let resume = options.resume && runs::has_checkpoint(folder);
        let force = !resume && (options.resume || options.force);
        runs::run(shared, &Run { output: Some(folder.to_path_buf()), resume, force, ..single.clone() })
    })
}

/// `rfm report --sweep`.
pub(in crate::cli) fn report(shared: &Shared, options: &Report) -> Result<(), Failure> {
    let [output, mesh_plot, html] =
        [&options.output, &options.mesh_plot, &options.html].map(|path| is_stdout(path.as_deref()));
    refuse(&[("-o -", output), ("--mesh-plot -", mesh_plot), ("--html -", html)])?;
    for (flag, path) in
        [("-o", &options.output), ("--mesh-plot", &options.mesh_plot), ("--html", &options.html)]
    {
        plain_name(flag, path.as_ref(), &options.sweep)?;
    }
    let (file, name) = choose::subject(&options.subject);
    let is_size = options.sweep.sweep.iter().any(|sweep| sweep.name == "particles");
    // standard input is read once, and no sweep reads it
    let is_read = is_size && file != Path::new("-");
    if is_read && reports::scene(&input::program(shared, file)?, name, options)?.is_some() {
        return Err(Failure::usage(
            "the report of a flow chooses `particles` itself: give the sizes by --particles, and sweep another param",
        ));
    }
    let single = Report { sweep: SweepOptions::default(), again: Default::default(), ..options.clone() };
    let again = [options.again.resume, options.again.force];
    task(shared, Command::Report, file, &options.sweep, again, format!("{single:?}")).go(|shared, folder| {
        let [output, mesh_plot, html] =
            [&options.output, &options.mesh_plot, &options.html].map(|path| within(folder, path.as_ref()));
        reports::run(shared, &Report { output, mesh_plot, html, ..single.clone() })
    })
}
