//! The program `rfm`, as a person calls it.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// The program that is tested: `RFM_PROGRAM`, or that of the release build.
fn path() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    std::env::var_os("RFM_PROGRAM").map_or_else(|| root.join("target/release/rfm"), PathBuf::from)
}

/// Runs a command to its end.
#[track_caller]
pub fn rfm(folder: &Path, arguments: &[&str]) -> String {
    let output = Command::new(path()).args(arguments).current_dir(folder).output();
    let output = output.unwrap_or_else(|error| panic!("{}: {error}: set RFM_PROGRAM", path().display()));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "rfm {arguments:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// A viewer that serves until it is dropped.
pub struct Viewer {
    child: Child,
    pub address: String,
}

impl Viewer {
    #[track_caller]
    pub fn start(folder: &Path, arguments: &[&str]) -> Self {
        let mut child = Command::new(path())
            .arg("view")
            .args(arguments)
            .arg("--no-open")
            .current_dir(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut address = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut address).unwrap();
        let address = address.trim().to_string();
        assert!(address.starts_with("http://127.0.0.1:"), "{address}");
        Self { child, address }
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
