//! `rfm view`: a page in the browser that shows a run while it is computed, or one that is saved; or that page as a
//! file.
//!
//! | file | what it does |
//! |---|---|
//! | `options` | the flags, with the help that teaches them |
//! | `folder` | the folder of a run → a page with its frames |
//! | `plots` | energy, audit and probes over time, of a folder or of a simulation that goes on |
//! | `section` | ω in a plane |
//! | `way` | where a solid is while it is watched |
//! | `server`, `request`, `stream` | the page and its stream at an address with a token |
//! | `board` | the newest of everything that pages are told |
//! | `session`, `model`, `course`, `command` | what goes on in time on its own thread, and what pages ask of it |
//! | `mesher`, `making` | a mesh at once, and what takes longer on a thread of its own |
//! | `messages` | what went wrong, as text |

mod board;
mod browser;
mod command;
mod course;
mod exact;
mod folder;
mod making;
mod mesher;
mod messages;
mod model;
mod options;
mod plots;
mod request;
mod section;
mod server;
mod session;
mod stream;
mod way;

use std::path::Path;
use std::sync::Arc;

use super::failure::{Failure, note};
use super::shared::Shared;
use super::{input, output};
use crate::cli::output::Shown;
use board::Board;
use folder::SavedRun;
use model::Subject;
pub(super) use options::View;
use server::{Content, Server};
use session::Session;

pub(super) fn run(shared: &Shared, options: &View) -> Result<(), Failure> {
    let path = options.subject.as_path();
    if path.is_dir() {
        let run = SavedRun::open(path, options)?;
        return match &options.save {
            Some(target) => save(shared, &run, target),
            None => {
                let mut page = Vec::new();
                run.write(&mut page)?;
                serve(shared, options, Content::Page(page))
            }
        };
    }
    if path != Path::new("-") && matches!(path.try_exists(), Ok(false)) {
        return Err(input::missing(path));
    }
    if options.save.is_some() {
        let folder = path.with_extension("out");
        let (file, folder) = (path.shown(), folder.shown());
        return Err(Failure::usage(format!(
            "--save writes a run, and `{file}` is a file: `rfm run {file}`, then `rfm view {folder} --save PAGE.html`; a \
             solid alone is written by `rfm mesh {file} -o PAGE.html`"
        )));
    }
    if path == Path::new("-") {
        return Err(Failure::usage(
            "the viewer reads its file again when it changes: standard input cannot be viewed",
        ));
    }
    // a file that cannot be read is an error here, one with mistakes is shown with them until it is mended
    drop(input::read(path)?);
    // no change of the file makes up for what the command line lacks
    Subject::new(shared, options).admit_choice()?;
    let board = Arc::new(Board::default());
    let commands = Session::start(shared, options, Arc::clone(&board))?;
    serve(shared, options, Content::Live { board, commands })
}

/// Writes the page of a run.
fn save(shared: &Shared, run: &SavedRun, target: &Path) -> Result<(), Failure> {
    if target == Path::new("-") {
        if shared.json {
            return Err(Failure::usage(
                "--save - writes the page to standard output, and --json its figures: name a file",
            ));
        }
        run.write(&mut std::io::stdout().lock())?;
        return Ok(());
    }
    let ending = target.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    if ending.is_none_or(|ending| !matches!(ending.as_str(), "html" | "htm")) {
        return Err(Failure::usage(format!(
            "--save writes a page, and `{}` does not end in .html",
            target.shown()
        )));
    }
    let mut sizes = None;
    output::write(target, |out| {
        sizes = Some(run.write(out)?);
        Ok(())
    })?;
    let bytes = std::fs::metadata(target).map(|file| file.len())?;
    let (frames, particles) = (run.frames(), run.particles());
    if shared.json {
        return output::json(&serde_json::json!({
            "schema": 1, "file": target.display().to_string(), "frames": frames, "bytes": bytes,
            "bytes_of_frames": sizes.map(|sizes| sizes.frames), "bytes_of_meshes": sizes.map(|sizes| sizes.meshes),
            "bytes_of_surfaces": sizes.map(|sizes| sizes.surfaces),
            "bytes_per_particle_and_frame": bytes as f64 / particles.max(1) as f64,
        }));
    }
    let per_particle = |bytes: u64| bytes as f64 / particles.max(1) as f64;
    let split = sizes.map_or_else(String::new, |sizes| {
        let mut parts = vec![format!("{:.1} for the particles", per_particle(sizes.frames))];
        if sizes.surfaces > 0 {
            parts.push(format!("{:.1} for the surfaces of the fluid", per_particle(sizes.surfaces)));
        }
        format!(", {}, and {:.2} MB of obstacles", parts.join(", "), sizes.meshes as f64 / 1e6)
    });
    say!(
        "{}, {:.2} MB: {:.1} bytes per particle and frame{split}",
        output::counted(frames, "frame"),
        bytes as f64 / 1e6,
        per_particle(bytes)
    );
    say!("written to {}: it opens in any browser, without a network", target.shown());
    Ok(())
}

fn serve(shared: &Shared, options: &View, content: Content) -> Result<(), Failure> {
    let server = Server::bind(&options.host, options.port)?;
    let (address, told) = (server.address(), server.told_address());
    if shared.json {
        output::json(&serde_json::json!({ "schema": 1, "address": told }))?;
    } else {
        say!("{told}");
    }
    if server.is_open_to_others() {
        note(
            "whoever can reach this machine and has the address sees the page and can change the run; it is not encrypted",
        );
    }
    if !options.no_open && !browser::open(&address) {
        note("no browser could be opened: open the address yourself");
    }
    note("Ctrl-C ends the viewer");
    server.serve(content)
}
