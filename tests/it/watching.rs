//! `rfm check --watch` follows the files that a file imports.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A check that goes on, with the lines that it prints.
struct Watching {
    process: Child,
    lines: Receiver<String>,
}

impl Watching {
    fn start(folder: &std::path::Path, file: &str) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_rfm"))
            .args(["check", file, "--watch"])
            .current_dir(folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let (send, lines) = channel();
        let reader = BufReader::new(process.stdout.take().unwrap());
        std::thread::spawn(move || reader.lines().map_while(Result::ok).try_for_each(|line| send.send(line)));
        Self { process, lines }
    }

    /// The next volume that is printed.
    fn volume(&self) -> f64 {
        loop {
            let line = self.lines.recv_timeout(Duration::from_secs(50)).expect("no volume is printed");
            if let Some(rest) = line.trim().strip_prefix("volume") {
                return rest.split_whitespace().next().unwrap().parse().unwrap();
            }
        }
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn a_change_of_an_import_of_an_import_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let cube = |side: f64| format!("rfm 1\nsolid cube = box([0, 0, 0], [{side}, 1, 1])\n");
    write("cube.rfm", &cube(1.0));
    write("parts.rfm", "rfm 1\nimport \"cube.rfm\" as other\nsolid part = other.cube\n");
    write("whole.rfm", "rfm 1\nimport \"parts.rfm\" as parts\nsolid whole = parts.part\n");
    let watching = Watching::start(folder.path(), "whole.rfm");
    assert!((watching.volume() - 1.0).abs() < 1e-3);
    write("cube.rfm", &cube(3.0));
    assert!((watching.volume() - 3.0).abs() < 1e-2);
    // the file that stands between
    write("parts.rfm", "rfm 1\nimport \"cube.rfm\" as other\nsolid part = other.cube.scale(2)\n");
    assert!((watching.volume() - 24.0).abs() < 1e-1);
    // it may be gone for a moment
    std::fs::remove_file(folder.path().join("cube.rfm")).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    write("cube.rfm", &cube(2.0));
    assert!((watching.volume() - 16.0).abs() < 1e-1);
}
