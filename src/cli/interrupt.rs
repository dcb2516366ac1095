//! Ctrl-C: a run ends after its step, every other command at once. What is half written does not stay.

use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;
use std::process::Child;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use tempfile::NamedTempFile;

use super::failure::{Failure, note};

/// What must not outlive the command.
enum Unfinished {
    File(PathBuf),
    Program(Arc<Mutex<Child>>),
}

/// All of it, by numbers that are given out in turn.
struct Registry {
    next: u64,
    all: BTreeMap<u64, Unfinished>,
}

static REGISTRY: Mutex<Registry> = Mutex::new(Registry { next: 0, all: BTreeMap::new() });

/// The flag of runs, if there is a run.
static RUN: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Something that is removed or ended on Ctrl-C, until this is dropped.
pub(super) struct Guard(u64);

impl Drop for Guard {
    fn drop(&mut self) {
        registry().all.remove(&self.0);
    }
}

fn registry() -> MutexGuard<'static, Registry> {
    REGISTRY.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Registry {
    fn add(&mut self, thing: Unfinished) -> Guard {
        self.next += 1;
        self.all.insert(self.next, thing);
        Guard(self.next)
    }
}

/// A temporary file that is removed on Ctrl-C while the guard lives.
pub(super) fn temporary(
    make: impl FnOnce() -> io::Result<NamedTempFile>,
) -> io::Result<(Guard, NamedTempFile)> {
    listen_unless_hangups_are_ignored();
    // made while nobody else looks, so that none escapes
    let mut registry = registry();
    let file = make()?;
    Ok((registry.add(Unfinished::File(file.path().to_path_buf())), file))
}

/// A program that is ended on Ctrl-C while the guard lives.
pub(super) fn program(child: Child) -> (Guard, Arc<Mutex<Child>>) {
    let child = Arc::new(Mutex::new(child));
    (registry().add(Unfinished::Program(Arc::clone(&child))), child)
}

/// A flag that Ctrl-C sets. The run ends after the present step; a second Ctrl-C ends the command at once.
pub(super) fn of_runs() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::clone(RUN.get_or_init(Arc::default));
    listen().map_err(|error| Failure::usage(format!("cannot listen for Ctrl-C: {error}")))?;
    Ok(flag)
}

fn listen() -> Result<(), String> {
    // there may be several runs and files in a process, and one handler
    static LISTENS: OnceLock<Result<(), String>> = OnceLock::new();
    LISTENS.get_or_init(|| ctrlc::set_handler(handle).map_err(|error| error.to_string())).clone()
}

/// A command that `nohup` has started goes on when its terminal is closed, and a handler would end it.
fn listen_unless_hangups_are_ignored() {
    const HANGUP: u64 = 1;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    if ignored & HANGUP == 0 {
        // without a handler the next command removes what this one leaves
        let _ = listen();
    }
}

fn handle() {
    if RUN.get().is_some_and(|flag| !flag.swap(true, Ordering::Relaxed)) {
        return;
    }
    // it is never given back: nothing new begins to be written
    let registry = registry();
    let (files, programs): (Vec<_>, Vec<_>) =
        registry.all.values().partition(|thing| matches!(thing, Unfinished::File(_)));
    // a program that goes on would write its file again
    for thing in programs.into_iter().chain(files) {
        match thing {
            Unfinished::Program(child) => {
                let mut child = child.lock().unwrap_or_else(PoisonError::into_inner);
                // one that has ended already needs no end
                let _ = child.kill();
                let _ = child.wait();
            }
            Unfinished::File(path) => {
                // it may have got its name in the meantime
                let _ = std::fs::remove_file(path);
            }
        }
    }
    if !registry.all.is_empty() {
        note("interrupted: what was half written is removed");
    }
    std::process::exit(130);
}
