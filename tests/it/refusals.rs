//! Commands that are refused before they would do nothing, or something else than what was meant.

use crate::tool::{rfm, rfm_reading};

/// Files by their names, in a folder of their own.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), format!("rfm 1\n{text}\n")).unwrap();
    }
    folder
}

#[test]
fn numbers_of_flags_are_refused_in_plain_words() {
    let folder = folder(&[("a.rfm", "param r = 1\nsolid a = sphere(r)")]);
    for (arguments, expected) in [
        (
            &["mesh", "--cells", "-5"][..],
            "expected a whole number of cells along the longest side, as in 128",
        ),
        (&["mesh", "--cells", "64x64x64"], "from which the others follow: write 64"),
        (&["mesh", "--cells", "1e2"], "expected a whole number of cells along the longest side: write 100"),
        (&["render", "--mesh-cells", "many"], "expected a whole number of cells along the longest side"),
        (
            &["check", "-D", "r=1,2"],
            "decimals have a point, as in 1.2, and several values are those of --sweep r=1,2",
        ),
        (&["check", "-D", "r:1.5"], "expected NAME=VALUE, as in r=1.5"),
        (&["check", "-D", "r 2 mm"], "expected NAME=VALUE, as in r=2 mm"),
        (&["check", "-D", "r"], "expected NAME=VALUE, as in r=1.2"),
    ] {
        let (command, flags) = arguments.split_first().unwrap();
        let refused = rfm(folder.path(), &[&[*command, "a.rfm"][..], flags].concat()).expect(2);
        assert!(refused.stderr.contains(expected), "{arguments:?}: {}", refused.stderr);
        assert!(!refused.stderr.contains("invalid digit"), "{arguments:?}: {}", refused.stderr);
    }
}

#[test]
fn pictures_of_nothing_are_not_written() {
    let folder = folder(&[
        ("beam.rfm", "solid a = box([0, 0, 0], [100, 0.1, 0.1])"),
        ("ball.rfm", "solid b = sphere(1)"),
    ]);
    let refused = rfm(folder.path(), &["render", "beam.rfm", "--mesh-cells", "32"]).expect(1);
    assert!(refused.stderr.contains("the picture would be empty"), "{}", refused.stderr);
    let cut = ["render", "ball.rfm", "--mesh-cells", "16", "--camera", "0,-1,0", "--cut"];
    let refused = rfm(folder.path(), &[&cut[..], &["y=2"]].concat()).expect(2);
    assert!(
        refused.stderr.contains("all of the solid lies between this plane and the eye"),
        "{}",
        refused.stderr
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    rfm(folder.path(), &[&cut[..], &["y=0"]].concat()).expect(0);
}

#[test]
fn a_window_beside_the_solid_is_told_from_a_plane_beside_it() {
    let folder = folder(&[("a.rfm", "solid a = box()")]);
    let told = |slice: &str, window: &str| {
        let slice = ["--slice", slice, "--window", window, "-o", "a.svg", "--budget", "100ms"];
        rfm(folder.path(), &[&["check", "a.rfm"][..], &slice].concat()).expect(0).stderr
    };
    let beside = told("z=0.5", "5,5,6,6");
    assert!(
        beside
            .contains("a place beside it, and it lies between x = 0 and x = 1, and between y = 0 and y = 1"),
        "{beside}"
    );
    let above = told("z=5", "0,0,1,1");
    assert!(above.contains("in the picture: it lies between z = 0 and z = 1"), "{above}");
}

#[test]
fn the_folder_of_a_sweep_leads_to_its_runs() {
    let scene = "param h = 0.5\nscene s {\n  box { max: [1, 1, 1] }\n  fluid w { shape: ball([0.5, 0.5, h], 0.2), particles: 50 }\n  \
                 run { until: 1 ms }\n}";
    let folder = folder(&[("a.rfm", scene)]);
    let refused = rfm(folder.path(), &["run", "a.rfm", "--no-pictures", "-o", "a.rfm"]).expect(2);
    assert!(
        refused.stderr.contains("`a.rfm` is a file, and a run writes into a folder"),
        "{}",
        refused.stderr
    );
    let run = ["run", "a.rfm", "--sweep", "h=0.4,0.5", "--no-pictures", "--threads", "1", "-o", "out"];
    rfm(folder.path(), &run).expect(0);
    for arguments in [&["render", "out", "-o", "a.gif"][..], &["view", "out", "--save", "a.html"]] {
        let refused = rfm(folder.path(), arguments).expect(2);
        assert!(refused.stderr.contains("name one of them, such as `out"), "{}", refused.stderr);
        assert!(refused.stderr.contains("h=0.4`"), "{}", refused.stderr);
    }
}

#[test]
fn an_editor_that_announces_too_much_is_refused() {
    for (head, expected) in [
        ("Content-Length: 99999999999\r\n\r\n", "a message of 99999999999 bytes is announced"),
        ("X: 1\r\ncontent-length: 99999999999\r\n\r\n", "a message of 99999999999 bytes is announced"),
        (&"x".repeat(100_000), "more than 65536 bytes stand before a message"),
    ] {
        let refused = rfm_reading(std::path::Path::new("."), &["lsp"], head.as_bytes()).expect(2);
        assert!(refused.stderr.contains(expected), "{}", refused.stderr);
    }
}
