//! Output: files, and lines and documents on standard output. A file is written under a temporary name beside
//! its target and then renamed, so it is whole or not there. Devices and pipes are written as they stand.

use std::borrow::Cow;
use std::cell::RefCell;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::Serialize;

use rfm::diagnostic::{is_hidden, printable, printable_line};
use rfm::sph::{Method, Parameters};

use super::failure::{Failure, complain};
use super::interrupt;

/// Beginning of the names of temporary files. The name of the file that is written follows.
pub(super) const TEMPORARY: &str = ".rfm-";

/// The files that this command has read, without links and detours.
static READ: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Remembers that the command has read a file: no output may take its place. Names that lead to no file are left out.
pub(super) fn remember_input(path: &Path) {
    if let (Ok(file), Ok(mut read)) = (path.canonicalize(), READ.lock())
        && !read.contains(&file)
    {
        read.push(file);
    }
}

/// Refuses an output that would replace a file that this command has read, however its path is spelt.
///
/// # Errors
/// [`Failure::Usage`] with both paths.
pub(super) fn keep_inputs(path: &Path) -> Result<(), Failure> {
    let Ok(file) = path.canonicalize() else { return Ok(()) };
    let is_input = file.is_file() && READ.lock().is_ok_and(|read| read.contains(&file));
    if !is_input {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "`{}` is one of the files that this command reads, and would be lost: choose another name for the output",
        path.shown()
    )))
}

/// Writes a file through a callback. If anything fails, a file that was there before is unchanged. The files that the
/// command reads are never replaced.
pub(super) fn write(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Failure> {
    keep_inputs(path)?;
    write_anew(path, fill)
}

/// [`write`], also in place of a file that the command has read.
fn write_anew(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Failure> {
    let failed = |error: io::Error| {
        // an error may carry the temporary name, which means nothing to the user
        let text = error.to_string();
        let reason = text.split(" at path ").next().unwrap_or_default();
        Failure::usage(format!("cannot write `{}`: {reason}", path.shown()))
    };
    if path.is_dir() {
        return Err(Failure::usage(format!("cannot write `{}`: it is a folder", path.shown())));
    }
    if is_stream(path) {
        let mut stream = BufWriter::new(File::options().write(true).open(path).map_err(failed)?);
        return fill(&mut stream).and_then(|()| stream.flush()).map_err(failed);
    }
    let path = &target(path);
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.exists() {
        let message =
            format!("cannot write `{}`: the folder `{}` does not exist", path.shown(), folder.shown());
        return Err(Failure::usage(message));
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let prefix = format!("{TEMPORARY}{name}-");
    remove_temporaries(folder);
    let made = interrupt::temporary(|| tempfile::Builder::new().prefix(&prefix).tempfile_in(folder));
    let (_unfinished, temporary) = made.map_err(failed)?;
    // a folder that cannot be locked keeps what killed commands leave
    let _ = temporary.as_file().try_lock();
    let mut writer = BufWriter::new(temporary);
    fill(&mut writer).map_err(failed)?;
    let temporary = writer.into_inner().map_err(|e| failed(e.into_error()))?;
    readable_by_others(temporary.as_file()).map_err(failed)?;
    temporary.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}

/// Whether the path is something that a file must not replace: a device (`/dev/null`), a pipe, or the output
/// of the command itself (`/dev/stdout`).
fn is_stream(path: &Path) -> bool {
    path.starts_with("/dev") || path.metadata().is_ok_and(|there| !there.is_file())
}

/// The file that a path means: a link stays a link.
fn target(path: &Path) -> PathBuf {
    let mut found = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(next) = std::fs::read_link(&found) else { break };
        // from the folder of the link
        found = found.parent().unwrap_or(Path::new("")).join(next);
    }
    found
}

/// Links that lead to one another.
const MOST_LINKS: usize = 40;

/// Lets another program write a file: `fill` gets the path of a temporary one, which then takes the place of the file.
pub(super) fn through(path: &Path, fill: impl FnOnce(&Path) -> Result<(), Failure>) -> Result<(), Failure> {
    keep_inputs(path)?;
    let failed = |error: io::Error| Failure::usage(format!("cannot write `{}`: {error}", path.shown()));
    let to = &target(path);
    let folder = to.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.is_dir() || !folder.is_dir() {
        // says what is wrong
        return write(path, |_| Ok(()));
    }
    if is_stream(path) {
        // films are written by programs that look at the ending of a name, and go back to the beginning
        return Err(failed(io::Error::other("a film needs a file")));
    }
    let name = to.file_name().unwrap_or_default().to_string_lossy();
    let ending = path.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
    let prefix = format!("{TEMPORARY}{name}-");
    let make = || tempfile::Builder::new().prefix(&prefix).suffix(&ending).tempfile_in(folder);
    let (_unfinished, temporary) = interrupt::temporary(make).map_err(failed)?;
    let _ = temporary.as_file().try_lock();
    fill(temporary.path())?;
    readable_by_others(temporary.as_file()).map_err(failed)?;
    temporary.persist(to).map_err(|e| failed(e.error))?;
    Ok(())
}

/// Puts a text in place of a file at once. A link stays a link, and the permissions of the file stay.
pub(super) fn replace(path: &Path, text: &str) -> Result<(), Failure> {
    let failed = |e: io::Error| Failure::usage(format!("cannot write `{}`: {e}", path.shown()));
    let target = path.canonicalize().map_err(failed)?;
    let permissions = target.metadata().map_err(failed)?.permissions();
    if permissions.readonly() {
        return Err(failed(io::ErrorKind::PermissionDenied.into()));
    }
    write_anew(&target, |out| out.write_all(text.as_bytes()))?;
    std::fs::set_permissions(&target, permissions).map_err(failed)
}

/// Removes temporary files that killed commands have left in a folder, once for each folder. Those that
/// another command is writing are locked, by a lock that ends with its process.
fn remove_temporaries(folder: &Path) {
    static SEEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
    let Ok(mut seen) = SEEN.lock() else { return };
    if seen.iter().any(|known| known == folder) {
        return;
    }
    seen.push(folder.to_path_buf());
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_ours = entry.file_name().to_string_lossy().starts_with(TEMPORARY);
        let is_left = || File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok());
        if is_ours && is_left() {
            // one that cannot be removed does no harm
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// A path as a message shows it: on one line, and without characters that control a terminal.
pub(super) trait Shown {
    fn shown(&self) -> String;
}

impl Shown for Path {
    fn shown(&self) -> String {
        printable_line(&self.display().to_string()).into_owned()
    }
}

/// The formats of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Picture {
    Svg,
    Png,
}

impl Picture {
    /// The format that the ending of a path names.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        match ending.as_str() {
            "svg" => Ok(Self::Svg),
            "png" => Ok(Self::Png),
            _ => Err(Failure::Usage(format!(
                "cannot tell the picture format of `{}`: the ending must be .svg or .png",
                path.shown()
            ))),
        }
    }
}

/// Lets others read a file, because temporary files are private and results are not.
#[cfg(unix)]
fn readable_by_others(file: &std::fs::File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn readable_by_others(_: &std::fs::File) -> io::Result<()> {
    Ok(())
}

/// Prints one line on standard output. If the reader is gone, the process ends quietly, as other tools do.
pub(super) fn line(words: std::fmt::Arguments<'_>) {
    let words = words.to_string();
    if let Err(error) = writeln!(anstream::stdout(), "{}", printable(&words)) {
        if error.kind() == io::ErrorKind::BrokenPipe {
            std::process::exit(0);
        }
        complain(&format!("cannot write to standard output: {error}"));
        std::process::exit(2);
    }
}

thread_local! {
    /// The documents that [`captured`] keeps from standard output; `None` where it is not at work.
    static KEPT: RefCell<Option<Vec<serde_json::Value>>> = const { RefCell::new(None) };
}

/// Runs a command, and returns its result and the documents that it would print with `--json`. They are not
/// printed.
pub(super) fn captured<T>(command: impl FnOnce() -> T) -> (T, Vec<serde_json::Value>) {
    KEPT.set(Some(Vec::new()));
    let result = command();
    (result, KEPT.take().unwrap_or_default())
}

/// Prints one JSON document on standard output.
pub(super) fn json(document: &impl Serialize) -> Result<(), Failure> {
    let is_kept = KEPT.with_borrow_mut(|kept| match kept {
        Some(kept) => serde_json::to_value(document).map(|document| kept.push(document)).map(|()| true),
        None => Ok(false),
    });
    if is_kept.map_err(io::Error::from)? {
        return Ok(());
    }
    let text = serde_json::to_string_pretty(document).map_err(io::Error::from)?;
    writeln!(io::stdout().lock(), "{}", escaped(&text))?;
    Ok(())
}

/// A value as JSON on one line.
pub(super) fn json_line(value: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string(value).map_err(io::Error::from)?;
    Ok(escaped(&text).into_owned())
}

/// JSON in which hidden characters, which stand only in its texts, are escaped.
fn escaped(json: &str) -> Cow<'_, str> {
    if !json.contains(is_hidden) {
        return json.into();
    }
    let mut out = String::new();
    for c in json.chars() {
        if is_hidden(c) {
            let mut units = [0; 2];
            out.extend(c.encode_utf16(&mut units).iter().map(|unit| format!("\\u{unit:04x}")));
        } else {
            out.push(c);
        }
    }
    out.into()
}

/// A figure with the given number of digits behind the point where that is readable; otherwise with the given
/// number of digits in all, and an exponent.
pub(super) fn significant(figure: f64, digits: usize) -> String {
    let size = figure.abs();
    if (1e-2..1e7).contains(&size) || size == 0.0 {
        format!("{figure:.digits$}")
    } else {
        format!("{figure:.*e}", digits - 1)
    }
}

/// The speed of sound of a scene, and whether it is stated.
pub(super) fn sound_speed(parameters: &Parameters) -> String {
    let origin = match (parameters.states_sound_speed(), &parameters.method) {
        (true, _) => "stated",
        (false, Method::Paper(_)) => "the root of the stiffness",
        (false, Method::Wcsph(_) | Method::Dfsph(_)) => {
            "derived from the speeds and pressures that are foreseen"
        }
    };
    format!("{} m/s ({origin})", significant(parameters.sound_speed(), 3))
}

/// A number of things: `1 frame`, `3 frames`.
pub(super) fn counted(count: usize, one: &str) -> String {
    format!("{count} {one}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_keeps_its_meaning_without_hidden_characters() {
        let text = "a\u{9b}\u{202e}\u{e0041}ω";
        let json = serde_json::to_string(text).unwrap();
        let shown = escaped(&json);
        assert!(!shown.contains(is_hidden), "{shown}");
        assert_eq!(serde_json::from_str::<String>(&shown).unwrap(), text);
    }
}
