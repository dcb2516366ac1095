//! What commands leave in folders: nothing half written, nothing of an earlier run, and all that others keep there.

use crate::cli::{SMALL, files};
use crate::tool::{rfm, snapshot};

#[test]
fn a_run_leaves_nothing_of_the_one_before() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("drop.rfm"), SMALL).unwrap();
    let run = |flags: &[&str]| rfm(here, &[&["run", "drop.rfm", "-o", "out"], flags].concat());
    run(&[]).expect(0);
    std::fs::write(here.join("out/frames/notes.txt"), "kept").unwrap();
    // what is refused changes nothing
    let before = [files(&here.join("out")), files(&here.join("out/frames"))];
    run(&["--force", "--mesh-cells", "0"]).expect(2);
    let refused = run(&["--steps", "1"]).expect(2).stderr;
    assert!(refused.contains("holds a run already (scene drop, 0.010 s, 3 frames)"), "{refused}");
    assert_eq!([files(&here.join("out")), files(&here.join("out/frames"))], before);
    // nor is what others keep beside the run's own tables
    let kept = ["compare.csv", "energy.png"].map(|name| here.join("out/history").join(name));
    kept.iter().for_each(|path| std::fs::write(path, "time [s],mine\n").unwrap());
    run(&["--force", "--no-frames", "--steps", "1"]).expect(0);
    assert_eq!(files(&here.join("out/history")), ["audit.csv", "compare.csv", "energy.csv", "energy.png"]);
    assert_eq!(files(&here.join("out")), ["checkpoints", "frames", "history", "pictures", "summary.json"]);
    assert_eq!(files(&here.join("out/frames")), ["notes.txt"]);
    assert!(files(&here.join("out/pictures")).is_empty());
}

#[test]
fn unwritable_places_are_refused_and_nothing_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("drop.rfm"), SMALL).unwrap();
    std::fs::write(here.join("file"), "kept").unwrap();
    std::fs::create_dir(here.join("folder.stl")).unwrap();
    std::fs::create_dir(here.join("folder.svg")).unwrap();
    let before = files(here);
    for (name, arguments) in [
        ("mesh into a missing folder", &["mesh", "drop.rfm", "--cells", "16", "-o", "none/post.stl"][..]),
        ("mesh onto a folder", &["mesh", "drop.rfm", "--cells", "16", "-o", "folder.stl"]),
        ("mesh below a file", &["mesh", "drop.rfm", "--cells", "16", "-o", "file/post.stl"]),
        ("slice into a missing folder", &["check", "drop.rfm", "--slice", "z=0.1", "-o", "none/post.svg"]),
        ("slice onto a folder", &["check", "drop.rfm", "--slice", "z=0.1", "-o", "folder.svg"]),
        ("run into a file", &["run", "drop.rfm", "-o", "file"]),
        ("run below a file", &["run", "drop.rfm", "-o", "file/out"]),
    ] {
        let outcome = rfm(here, arguments).expect(2);
        snapshot("cli", name, &format!("rfm {}\n{}exit 2\n", arguments.join(" "), outcome.stderr));
        assert_eq!(files(here), before, "{name}");
    }
    assert_eq!(std::fs::read_to_string(here.join("file")).unwrap(), "kept");
    assert!(files(&here.join("folder.stl")).is_empty());
}

#[test]
fn what_killed_commands_leave_is_removed_and_what_others_write_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("post.rfm"), SMALL).unwrap();
    for name in [".rfm-p.stl-a1b2c3", ".rfm-other.svg-d4e5f6", ".rfm-busy.stl-g7h8i9"] {
        std::fs::write(here.join(name), "half a file").unwrap();
    }
    // a command that still runs holds a lock on what it writes
    let busy = std::fs::File::open(here.join(".rfm-busy.stl-g7h8i9")).unwrap();
    busy.lock().unwrap();
    rfm(here, &["mesh", "post.rfm", "-o", "p.stl", "--cells", "16"]).expect(0);
    assert_eq!(files(here), [".rfm-busy.stl-g7h8i9", "p.stl", "post.rfm"]);
    drop(busy);
    rfm(here, &["mesh", "post.rfm", "-o", "p.stl", "--cells", "16"]).expect(0);
    assert_eq!(files(here), ["p.stl", "post.rfm"]);
}

/// A device is written, not replaced: as root, `-o /dev/null` would leave a plain file there.
#[cfg(unix)]
#[test]
fn devices_pipes_and_links_stay_what_they_are() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("drop.rfm"), SMALL).unwrap();
    // links, so that a failing test does no harm
    symlink("/dev/null", here.join("null.stl")).unwrap();
    symlink("part.stl", here.join("link.stl")).unwrap();
    std::fs::write(here.join("part.stl"), "old").unwrap();
    assert!(std::process::Command::new("mkfifo").arg(here.join("pipe.stl")).status().unwrap().success());
    let pipe = here.join("pipe.stl");
    let reader = std::thread::spawn(move || std::fs::read(pipe).unwrap());
    for name in ["null.stl", "link.stl", "pipe.stl"] {
        rfm(here, &["mesh", "drop.rfm", "--cells", "16", "-o", name]).expect(0);
    }
    assert!(here.join("null.stl").is_symlink() && here.join("link.stl").is_symlink());
    let part = std::fs::read(here.join("part.stl")).unwrap();
    assert!(part.len() > 84);
    assert_eq!(reader.join().unwrap(), part);
    assert!(std::fs::symlink_metadata(here.join("pipe.stl")).unwrap().file_type().is_fifo());
    let here_again = files(here);
    assert_eq!(here_again, ["drop.rfm", "link.stl", "null.stl", "part.stl", "pipe.stl"]);
}

/// Ctrl-C in the middle of a film: the command ends at once, and so does the program that encodes for it.
#[cfg(unix)]
#[test]
#[ignore = "long"]
fn an_interrupted_film_leaves_nothing() {
    use std::os::unix::fs::PermissionsExt;
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("drop.rfm"), SMALL).unwrap();
    rfm(here, &["run", "drop.rfm", "-o", "out", "--no-pictures"]).expect(0);
    // one that takes all pictures and never ends by itself
    let tool = here.join("tools/ffmpeg");
    std::fs::create_dir(here.join("tools")).unwrap();
    let script = format!(
        "#!/bin/sh\n[ \"$1\" = -version ] && exit\necho $$ > {}\ncat > /dev/null\nexec sleep 60\n",
        here.join("id").display()
    );
    std::fs::write(&tool, script).unwrap();
    std::fs::set_permissions(&tool, std::fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:{}", here.join("tools").display(), std::env::var("PATH").unwrap());
    std::fs::create_dir(here.join("films")).unwrap();
    for name in ["a.gif", "a.mp4"] {
        let arguments =
            ["render", "out", "-o", &format!("films/{name}"), "--size", "8000x8000", "--threads", "1"];
        let mut command = Command::new(env!("CARGO_BIN_EXE_rfm"));
        command
            .args(arguments)
            .current_dir(here)
            .env("PATH", &path)
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let child = command.spawn().unwrap();
        let started = Instant::now();
        let begun =
            || !files(&here.join("films")).is_empty() && (name == "a.gif" || here.join("id").exists());
        while !begun() {
            assert!(started.elapsed() < Duration::from_secs(60), "{name} is not begun");
            std::thread::sleep(Duration::from_millis(5));
        }
        let ended = |id: &str| {
            !Command::new("kill").args(["-0", id]).stderr(Stdio::null()).status().unwrap().success()
        };
        assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(130), "{name}: {told}");
        assert!(told.contains("interrupted: what was half written is removed"), "{name}: {told}");
        assert!(files(&here.join("films")).is_empty(), "{name}");
        if name == "a.mp4" {
            assert!(ended(std::fs::read_to_string(here.join("id")).unwrap().trim()), "the program goes on");
        }
    }
}
