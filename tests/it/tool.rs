//! Runs the real binary, as a person or another program would.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// What a command printed and how it ended.
pub struct Outcome {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Outcome {
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e} in {}", self.stdout))
    }

    /// For snapshots.
    pub fn transcript(&self) -> String {
        format!("{}{}exit {}\n", self.stdout, self.stderr, self.code)
    }

    #[track_caller]
    pub fn expect(self, code: i32) -> Self {
        assert_eq!(self.code, code, "{}{}", self.stdout, self.stderr);
        self
    }
}

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

pub fn rfm(folder: &Path, arguments: &[&str]) -> Outcome {
    rfm_reading(folder, arguments, b"")
}

/// Runs the tool in a folder with the given standard input. Longer than a minute counts as a hang.
#[track_caller]
pub fn rfm_reading(folder: &Path, arguments: &[&str], input: &[u8]) -> Outcome {
    let mut child = Command::new(env!("CARGO_BIN_EXE_rfm"))
        .args(arguments)
        .current_dir(folder)
        .env_remove("COLUMNS")
        .env_remove("CLICOLOR_FORCE")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_vec();
    // a command that does not read its input closes it: that is no error
    let writer = std::thread::spawn(move || drop(stdin.write_all(&input)));
    let id = child.id();
    let started = Instant::now();
    let waiting = std::thread::spawn(move || child.wait_with_output().unwrap());
    while !waiting.is_finished() {
        assert!(started.elapsed() < Duration::from_secs(60), "process {id} hangs: {arguments:?}");
        std::thread::sleep(Duration::from_millis(2));
    }
    let output = waiting.join().unwrap();
    writer.join().unwrap();
    Outcome {
        code: output.status.code().unwrap_or_else(|| panic!("killed by a signal: {arguments:?}")),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// All `.rfm` files of a folder under tests/cases, sorted by name.
pub fn cases(folder: &str) -> Vec<PathBuf> {
    let folder = root().join("tests/cases").join(folder);
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "rfm"));
    files.sort();
    assert!(!files.is_empty());
    files
}

pub fn stem(path: &Path) -> &str {
    path.file_stem().unwrap().to_str().unwrap()
}

/// The snapshots of each topic have a folder of their own.
pub fn snapshot(topic: &str, name: &str, text: &str) {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path(root().join("tests/snapshots").join(topic));
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| insta::assert_snapshot!(name.replace(' ', "_"), text));
}

/// The first scene of a text.
pub fn experiment(text: &str) -> rfm::Experiment {
    let program = rfm::Program::from_source("scene.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let scene = &program.module().scenes[0];
    rfm::Experiment::new(&program, &scene.name, rfm::Engine::Auto).unwrap_or_else(|e| panic!("{e}"))
}

/// The simulation of the first scene of a text, at its start.
pub fn simulation(text: &str) -> rfm::sph::Simulation {
    experiment(text).start().unwrap_or_else(|e| panic!("{e}")).simulation
}

/// Runs a simulation until this time, s.
pub fn run_to(simulation: &mut rfm::sph::Simulation, time: f64) {
    while simulation.time() < time {
        simulation.step().unwrap_or_else(|e| panic!("{e}"));
    }
}
