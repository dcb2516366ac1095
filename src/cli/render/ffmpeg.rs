//! Films that the program `ffmpeg` of the system encodes. It reads pictures from a pipe and writes a temporary file.

use std::io::{self, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::cli::failure::Failure;
use crate::cli::interrupt;
use crate::cli::output::Shown;
use rfm::diagnostic::printable_line;
use rfm::render::Image;

const PROGRAM: &str = "ffmpeg";

/// Time between two looks whether the program has ended.
const LOOK: Duration = Duration::from_millis(10);

/// The least even width and height that hold a size: colours are stored for squares of four pixels.
pub(super) fn even((width, height): (u32, u32)) -> (u32, u32) {
    (width.next_multiple_of(2), height.next_multiple_of(2))
}

/// A film that is being encoded.
pub(super) struct Video {
    shown: String,
    child: Arc<Mutex<Child>>,
    /// While it lives Ctrl-C ends the program, too.
    _unfinished: interrupt::Guard,
    pixels: Option<ChildStdin>,
    /// What the program complains of.
    complaint: Option<JoinHandle<String>>,
}

impl Video {
    /// Whether the program is there.
    pub fn check(path: &Path) -> Result<(), Failure> {
        let asked = Command::new(PROGRAM).arg("-version").stdin(Stdio::null()).output();
        match asked {
            Ok(answer) if answer.status.success() => Ok(()),
            Ok(_) | Err(_) => Err(Failure::usage(format!(
                "cannot write `{}`: .mp4 and .webm are made by the program `{PROGRAM}`, which does not start on this machine; \
                 install it, or write .gif or .apng, which are built in",
                path.shown()
            ))),
        }
    }

    /// Starts the program. `path` is the file that the user asked for, `temporary` the one that is written.
    pub fn begin(
        path: &Path,
        temporary: &Path,
        (width, height): (u32, u32),
        rate: u32,
    ) -> Result<Self, Failure> {
        let is_webm = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("webm"));
        let codec: &[&str] = if is_webm {
            &["-c:v", "libvpx-vp9", "-crf", "30", "-b:v", "0", "-row-mt", "1", "-f", "webm"]
        } else {
            &["-c:v", "libx264", "-crf", "18", "-preset", "medium", "-movflags", "+faststart", "-f", "mp4"]
        };
        let mut command = Command::new(PROGRAM);
        command.args([
            "-hide_banner",
            "-loglevel",
            "error",
            "-nostdin",
            "-y",
            "-f",
            "rawvideo",
            "-pix_fmt",
            "rgb24",
        ]);
        command
            .arg("-s")
            .arg(format!("{width}x{height}"))
            .arg("-r")
            .arg(rate.to_string())
            .args(["-i", "pipe:0"]);
        let padded = even((width, height));
        if padded != (width, height) {
            command.arg("-vf").arg(format!("pad={}:{}:0:0:white", padded.0, padded.1));
        }
        command.args(codec).args(["-pix_fmt", "yuv420p", "-map_metadata", "-1", "-fflags", "+bitexact"]);
        command.arg("-flags:v").arg("+bitexact").arg(temporary);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        // Ctrl-C in a terminal is told to all programs of a group, and this one would end its file as if it were whole
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let shown = path.shown();
        let mut child = command.spawn().map_err(|error| {
            Failure::usage(format!("cannot write `{shown}`: `{PROGRAM}` does not start: {error}"))
        })?;
        let pixels = child.stdin.take();
        // it is read while the program works, because a full pipe would stop it
        let complaint = child.stderr.take().map(|mut stream| {
            std::thread::spawn(move || {
                let mut text = Vec::new();
                // what was read until then is all that there is to show
                let _ = stream.read_to_end(&mut text);
                String::from_utf8_lossy(&text).into_owned()
            })
        });
        let (_unfinished, child) = interrupt::program(child);
        Ok(Self { shown, child, _unfinished, pixels, complaint })
    }

    /// Waits for the end of the program, and leaves room for who would end it.
    fn wait(&self) -> io::Result<ExitStatus> {
        loop {
            let ended = self.child.lock().unwrap_or_else(PoisonError::into_inner).try_wait()?;
            match ended {
                Some(status) => return Ok(status),
                None => std::thread::sleep(LOOK),
            }
        }
    }

    /// Hands a picture to the program.
    pub fn add(&mut self, image: &Image) -> io::Result<()> {
        match &mut self.pixels {
            Some(pixels) => pixels.write_all(&image.pixels),
            None => Err(io::ErrorKind::BrokenPipe.into()),
        }
    }

    /// Waits for the end of the file. `fed` says whether all pictures could be handed over.
    pub fn finish(mut self, fed: io::Result<()>) -> Result<(), Failure> {
        drop(self.pixels.take());
        let status = self.wait()?;
        let complaint = self.complaint.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        if status.success() && fed.is_ok() {
            return Ok(());
        }
        let last = complaint.lines().rev().find(|line| !line.trim().is_empty());
        let reason = match (last, fed) {
            (Some(line), _) => printable_line(line.trim()).into_owned(),
            (None, Err(error)) => error.to_string(),
            (None, Ok(())) => status.to_string(),
        };
        Err(Failure::usage(format!("cannot write `{}`: `{PROGRAM}` failed: {reason}", self.shown)))
    }
}

impl Drop for Video {
    fn drop(&mut self) {
        drop(self.pixels.take());
        let mut child = self.child.lock().unwrap_or_else(PoisonError::into_inner);
        // a program that has ended already needs no end
        let _ = child.kill();
        let _ = child.wait();
    }
}
