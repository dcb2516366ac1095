//! `--sweep`: what is in the folders, the index and the table is what the values give.

use std::f64::consts::PI;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::tool::{Outcome, rfm, root};

const BALL: &str = "rfm 1\nparam r = 1 in 0.1 .. 3\nsolid s = sphere(r)\n";

fn in_folder(text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.rfm"), text).unwrap();
    folder
}

fn index(folder: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("index.json")).unwrap()).unwrap()
}

fn figure(row: &Value, name: &str) -> f64 {
    let figures = row["figures"].as_array().unwrap();
    let found = figures.iter().find(|figure| figure["name"] == name);
    found.unwrap_or_else(|| panic!("{name} in {row}"))["value"].as_f64().unwrap()
}

fn rows(index: &Value) -> &[Value] {
    index["rows"].as_array().unwrap()
}

#[test]
fn a_sweep_of_check_has_the_volumes_of_balls() {
    let folder = in_folder(BALL);
    let outcome =
        rfm(folder.path(), &["check", "a.rfm", "--sweep", "r=0.5..1.5:3", "--slice", "z=0"]).expect(0);
    let found = index(&folder.path().join("a.sweep"));
    assert_eq!((&found["command"], &found["file"]), (&"check".into(), &"a.rfm".into()));
    assert_eq!(rows(&found).len(), 3);
    for (row, r) in rows(&found).iter().zip([0.5, 1.0, 1.5]) {
        assert_eq!((&row["values"][0], &row["exit"]), (&r.into(), &0.into()));
        assert_eq!(row["folder"], format!("r={r}"));
        let volume = 4.0 / 3.0 * PI * f64::powi(r, 3);
        assert!((figure(row, "volume") / volume - 1.0).abs() < 1e-3, "{row}");
        assert!((figure(row, "area") / (4.0 * PI * r * r) - 1.0).abs() < 1e-3, "{row}");
        let slice = folder.path().join(format!("a.sweep/r={r}/slice.svg"));
        assert!(std::fs::read_to_string(slice).unwrap().contains("<svg"));
    }
    // the table for people, and for programs
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert_eq!(lines[0].split_whitespace().collect::<Vec<_>>(), ["r", "volume", "area", "components"]);
    assert!(lines[1].contains("0.5236") && lines[1].ends_with('1'), "{}", lines[1]);
    let table = std::fs::read_to_string(folder.path().join("a.sweep/table.csv")).unwrap();
    let table: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let head = ["r", "volume", "volume error", "area", "area error", "components", "resolved", "failure"];
    assert_eq!(table[0], head);
    assert_eq!(table[2][1].parse::<f64>().unwrap(), figure(&rows(&found)[1], "volume"));
    // a panel for volume and one for area: the number of components does not change
    let plot = std::fs::read_to_string(folder.path().join("a.sweep/plot.svg")).unwrap();
    assert_eq!(plot.matches("<polyline").count(), 2);
    assert!(plot.contains(">the same at all values: components 1<"), "{plot}");
    assert_eq!(plot.matches("<svg").count(), plot.matches("</svg>").count());
    let picture = std::fs::File::open(folder.path().join("a.sweep/plot.png")).unwrap();
    let picture = png::Decoder::new(std::io::BufReader::new(picture)).read_info().unwrap();
    let (width, height) = picture.info().size();
    assert!(width > 1000 && height > width, "two panels: {width} × {height}");
}

#[test]
fn several_sweeps_make_a_grid_with_units() {
    let text = "rfm 1\nparam a = 10 mm\nparam alpha = 0 deg in 0 deg .. 90 deg\n\
                solid s = box([0, 0, 0], [a, 1, 1]).rotate_z(alpha)\n";
    let folder = in_folder(text);
    let arguments = ["mesh", "a.rfm", "--cells", "24", "-o", "a.stl", "--into", "out", "--json"];
    let sweeps = ["--sweep", "a=1..3 m:2", "--sweep", "alpha=0..45 deg:4"];
    let printed = rfm(folder.path(), &[&arguments[..], &sweeps[..]].concat()).expect(0).json();
    let found = index(&folder.path().join("out"));
    assert_eq!(printed, found);
    assert_eq!(rows(&found).len(), 8);
    assert_eq!(rows(&found)[5]["folder"], "a=3m,alpha=15deg");
    for row in rows(&found) {
        let a = row["values"][0].as_f64().unwrap();
        assert!((figure(row, "volume") / a - 1.0).abs() < 1e-3, "{row}");
        assert_eq!(figure(row, "closed"), 1.0);
        let part = folder.path().join("out").join(row["folder"].as_str().unwrap()).join("a.stl");
        assert!(part.is_file());
    }
    // a line for each of the four angles
    let plot = std::fs::read_to_string(folder.path().join("out/plot.svg")).unwrap();
    assert!(plot.contains("alpha = 45 deg") && plot.contains("a [m]"), "{plot}");
}

#[test]
fn a_folder_in_the_name_of_a_file_is_refused() {
    let folder = in_folder(BALL);
    let elsewhere = tempfile::tempdir().unwrap();
    let absolute = elsewhere.path().join("ball.stl").to_string_lossy().into_owned();
    let to_absolute = format!("write --into {} -o ball.stl", elsewhere.path().display());
    let sweep = ["a.rfm", "--sweep", "r=1,2"];
    for (arguments, advice) in [
        (&["mesh", "-o", &absolute][..], &*to_absolute),
        (&["mesh", "-o", "../meshes/ball.stl"], "write --into ../meshes -o ball.stl"),
        (&["mesh", "-o", "parts/ball.stl"], "write --into parts -o ball.stl"),
        (&["mesh", "-o", "parts/ball.stl", "--into", "out"], "write -o ball.stl"),
        (&["mesh", "-o", ".."], "write the name of a file, and the folder of the sweep by --into DIR"),
        (&["check", "--slice", "z=0", "-o", "p/s.svg"], "write --into p -o s.svg"),
        (&["report", "--html", "p/a.html"], "write --into p --html a.html"),
    ] {
        let refused = rfm(folder.path(), &[arguments, &sweep].concat()).expect(2);
        assert!(refused.stderr.contains(advice), "{arguments:?}: {}", refused.stderr);
        assert!(refused.stderr.contains("names a file in each folder of the sweep"), "{}", refused.stderr);
    }
    // nothing was made, here or there
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    assert_eq!(std::fs::read_dir(elsewhere.path()).unwrap().count(), 0);
    let arguments = ["mesh", "--cells", "16", "-o", "./ball.stl"];
    rfm(folder.path(), &[&arguments[..], &sweep].concat()).expect(0);
    assert!(folder.path().join("a.sweep/r=2/ball.stl").is_file());
}

#[test]
fn a_value_that_fails_is_told_and_the_others_go_on() {
    let folder = in_folder("rfm 1\nparam h = 2\nsolid s = cylinder(1, h - 1)\n");
    let outcome = rfm(folder.path(), &["check", "a.rfm", "--sweep", "h=0.5..2.5:3"]).expect(1);
    assert!(outcome.stderr.contains("1 of 3 combinations failed"), "{}", outcome.stderr);
    let found = index(&folder.path().join("a.sweep"));
    let codes: Vec<&Value> = rows(&found).iter().map(|row| &row["exit"]).collect();
    assert_eq!(codes, [1, 0, 0]);
    assert!(rows(&found)[0]["failure"].as_str().unwrap().contains("positive"), "{found}");
    assert!((figure(&rows(&found)[2], "volume") / (1.5 * PI) - 1.0).abs() < 1e-2);
    assert!(outcome.stdout.lines().nth(1).unwrap().contains("positive"), "{}", outcome.stdout);
}

#[test]
fn warnings_are_shown_and_may_be_denied() {
    let folder = in_folder("rfm 1\nparam r = 1\nsolid s = sphere(1) or sphere(r)\n");
    let arguments = ["check", "a.rfm", "--sweep", "r=0.5..1.5:2", "--deny", "W0415"];
    // of two balls about one point the smaller one has no effect, for either value
    let outcome = rfm(folder.path(), &arguments).expect(1);
    assert_eq!(outcome.stderr.matches("W0415: solid `s` is the same").count(), 2, "{}", outcome.stderr);
    let found = index(&folder.path().join("a.sweep"));
    assert!(rows(&found)[1]["failure"].as_str().unwrap().contains("without one of its operands"), "{found}");
    assert!(figure(&rows(&found)[1], "volume") > 14.0);
    rfm(folder.path(), &[&arguments[..4], &["--force"]].concat()).expect(0);
}

#[test]
fn a_table_that_the_file_names_belongs_to_it() {
    let folder = in_folder("rfm 1\nparam h = 1\nsolid s = polygon(points(\"c.csv\")).extrude(0, h)\n");
    let corners =
        |x: f64| std::fs::write(folder.path().join("c.csv"), format!("x,y\n0,0\n{x},0\n{x},1\n0,1\n"));
    corners(1.0).unwrap();
    let arguments = ["check", "a.rfm", "--sweep", "h=1..2:2"];
    rfm(folder.path(), &arguments).expect(0);
    corners(3.0).unwrap();
    let refused = rfm(folder.path(), &[&arguments[..], &["--resume"]].concat()).expect(2);
    assert!(refused.stderr.contains("of an older state of it"), "{}", refused.stderr);
    rfm(folder.path(), &[&arguments[..], &["--force"]].concat()).expect(0);
    let found = index(&folder.path().join("a.sweep"));
    assert!((figure(&rows(&found)[1], "volume") / 6.0 - 1.0).abs() < 1e-2, "{found}");
}

#[test]
fn what_cannot_be_swept_is_refused_before_anything_is_done() {
    let folder = in_folder("rfm 1\nparam radius = 1 in 0.1 .. 3\nsolid s = sphere(radius)\n");
    let check = |sweeps: &[&str], reason: &str| {
        let outcome: Outcome = rfm(folder.path(), &[&["check", "a.rfm"], sweeps].concat()).expect(2);
        assert!(outcome.stderr.contains(reason), "{sweeps:?}: {}", outcome.stderr);
        assert!(!folder.path().join("a.sweep").exists(), "{sweeps:?}");
    };
    check(&["--sweep", "radiu=1..2:3"], "did you mean `radius`?");
    check(&["--sweep", "x=1..2:3"], "it has radius");
    check(&["--sweep", "radius=1..4:3"], "4 lies outside 0.1 .. 3, which the file allows");
    check(&["--sweep", "radius=1..2:0"], "0 values are none");
    check(&["--sweep", "radius=2..1:3"], "write radius=1..2:3");
    check(&["--sweep", "radius=1..2"], "the number of values is missing");
    check(&["--sweep", "radius=1..2:2", "--sweep", "radius=1..2:3"], "swept twice");
    check(&["--sweep", "radius=1..2:200", "--sweep", "other=1..2:200"], "40000 combinations");
    check(&["--sweep", "radius=1..2:2", "--watch"], "--watch and --sweep exclude each other");
    check(&["--sweep", "radius=1..2:2", "--slice", "z=0", "-o", "-"], "-o - and --sweep exclude each other");
    check(&["--into", "out"], "--sweep");
    check(&["--resume"], "--sweep");
    rfm(folder.path(), &["check", "-", "--sweep", "radius=1..2:2"]).expect(2);
    for option in ["-o", "--html", "--mesh-plot"] {
        let arguments = ["report", "a.rfm", "--sweep", "radius=1..2:2", option, "-"];
        let refused = rfm(folder.path(), &arguments).expect(2);
        let reason = format!("{option} - and --sweep exclude each other");
        assert!(refused.stderr.contains(&reason), "{}", refused.stderr);
    }
}

#[test]
#[ignore = "long"]
fn a_sweep_is_continued_replaced_or_left_alone() {
    let folder = in_folder(BALL);
    let mesh = |sweep: &str, more: &[&str]| {
        let arguments = ["mesh", "a.rfm", "--cells", "16", "-o", "b.ply", "--sweep", sweep];
        rfm(folder.path(), &[&arguments[..], more].concat())
    };
    mesh("r=1..2:2", &[]).expect(0);
    let refused = mesh("r=1..2:2", &[]).expect(2);
    assert!(
        refused.stderr.contains("holds a sweep already (mesh of `a.rfm`, 2 combinations)"),
        "{}",
        refused.stderr
    );
    assert!(refused.stderr.contains("write elsewhere with --into DIR"), "{}", refused.stderr);
    // the folder is named by the flag with which it was given
    let run = ["run", "a.rfm", "--sweep", "r=1..2:2", "-o", "a.sweep"];
    let refused = rfm(folder.path(), &run).expect(2);
    assert!(refused.stderr.contains("write elsewhere with -o DIR"), "{}", refused.stderr);
    // more values: those that are known are not computed again
    let first = folder.path().join("a.sweep/r=1/b.ply");
    std::fs::remove_file(&first).unwrap();
    let outcome = mesh("r=1..2:3", &["--resume"]).expect(0);
    assert!(
        outcome.stderr.contains("2 of 3: r = 1.5") && !outcome.stderr.contains("1 of 3"),
        "{}",
        outcome.stderr
    );
    assert!(!first.exists() && folder.path().join("a.sweep/r=1.5/b.ply").exists());
    assert_eq!(rows(&index(&folder.path().join("a.sweep"))).len(), 3);
    // rows of other values stay, in their order
    mesh("r=0.5..1.25:2", &["--resume"]).expect(0);
    let found = index(&folder.path().join("a.sweep"));
    let values: Vec<f64> = rows(&found).iter().map(|row| row["values"][0].as_f64().unwrap()).collect();
    assert_eq!(values, [0.5, 1.0, 1.25, 1.5, 2.0]);
    // other options or another file are another sweep
    let other = mesh("r=1..2:3", &["--resume", "--method", "mc"]).expect(2);
    assert!(other.stderr.contains("other options"), "{}", other.stderr);
    std::fs::write(folder.path().join("a.rfm"), BALL.replace("sphere(r)", "sphere(r/2)")).unwrap();
    mesh("r=1..2:3", &["--resume"]).expect(2);
    // folders of values that are gone are removed, and nothing that is not of the sweep
    let sweep = folder.path().join("a.sweep");
    std::fs::create_dir(sweep.join("r=mine")).unwrap();
    std::fs::create_dir(folder.path().join("own=1")).unwrap();
    let text = std::fs::read_to_string(sweep.join("index.json")).unwrap();
    std::fs::write(sweep.join("index.json"), text.replace("\"r=0.5\"", "\"../own=1\"")).unwrap();
    mesh("r=1..2:2", &["--force"]).expect(0);
    let is_there = |name: &str| sweep.join(name).is_dir();
    assert!(is_there("r=1") && is_there("r=2") && !is_there("r=1.25") && !is_there("r=1.5"));
    assert!(is_there("r=mine") && is_there("r=0.5") && is_there("../own=1"));
    let found = index(&sweep);
    assert_eq!(rows(&found).len(), 2);
    assert!((figure(&rows(&found)[0], "volume") / (PI / 6.0) - 1.0).abs() < 0.05);
}

const FALL: &str = "rfm 1
param v = 0 m/s in -5 m/s .. 0 m/s
scene fall {
  box { max: [1, 1, 4] }
  fluid water { shape: box([0.3, 0.3, 2.5], [0.7, 0.7, 2.9]), spacing: 8 cm, velocity: [0, 0, v] }
  run { until: 0.2 s, save_every: 0.05 s }
  probe top { height: [0.5, 0.5], every: 10 ms }
}
";

#[test]
fn runs_have_their_audit_and_the_means_of_probes() {
    let folder = in_folder(FALL);
    let arguments = ["run", "a.rfm", "--sweep", "v=-2..0 m/s:3", "--no-pictures", "-o", "out"];
    let outcome = rfm(folder.path(), &arguments).expect(0);
    let found = index(&folder.path().join("out"));
    for (row, v) in rows(&found).iter().zip([-2.0, -1.0, 0.0]) {
        // bodies in free fall
        assert!((figure(row, "max_speed") - (9.81 * 0.2 - v)).abs() < 0.02, "{row}");
        assert!(figure(row, "energy_excess").abs() < 1e-3, "{row}");
        let own = folder.path().join("out").join(row["folder"].as_str().unwrap());
        let table = std::fs::read_to_string(own.join("probes/top.csv")).unwrap();
        let heights: Vec<f64> =
            table.lines().skip(1).map(|line| line.split(',').nth(1).unwrap().parse().unwrap()).collect();
        let later = &heights[heights.len() / 2..];
        let mean = later.iter().sum::<f64>() / later.len() as f64;
        assert!((figure(row, "top.height") - mean).abs() < 1e-12, "{row}");
        assert!(own.join("summary.json").is_file() && own.join("particles.pvd").is_file());
    }
    assert!(
        outcome.stdout.contains("v [m/s]") && outcome.stdout.contains("top.height"),
        "{}",
        outcome.stdout
    );
    // a sweep that is complete has nothing to go on with, and is not replaced unasked
    rfm(folder.path(), &[&arguments[..], &["--resume"]].concat()).expect(0);
    rfm(folder.path(), &arguments).expect(2);
}

#[test]
fn a_report_has_the_errors_of_a_flow() {
    let text = std::fs::read_to_string(root().join("examples/validation/free_fall.rfm")).unwrap();
    // what is stated as known is right for k = 1 only
    let text = text.replace("-9.81*t]", "-9.81*k*t]").replacen("rfm 1\n", "rfm 1\nparam k = 1\n", 1);
    let folder = in_folder(&text);
    let report = |sweep: &str| {
        let arguments =
            ["report", "a.rfm:free_fall", "--particles", "125", "--sweep", sweep, "--into", "out"];
        rfm(folder.path(), &arguments)
    };
    let refused = report("particles=125..216:2").expect(2);
    assert!(refused.stderr.contains("sweep another param"), "{}", refused.stderr);
    report("k=1..2:2").expect(0);
    let found = index(&folder.path().join("out"));
    let errors: Vec<f64> = rows(&found).iter().map(|row| figure(row, "velocity_error")).collect();
    assert!(errors[0] < 0.05 && errors[1] > 0.3, "{errors:?}");
}

#[test]
fn files_of_others_are_not_replaced() {
    let folder = in_folder(BALL);
    let own = folder.path().join("table.csv");
    std::fs::write(&own, "mine\n").unwrap();
    for more in [&[][..], &["--force"]] {
        let arguments = ["check", "a.rfm", "--sweep", "r=1..2:2", "--into", "."];
        let refused = rfm(folder.path(), &[&arguments[..], more].concat()).expect(2);
        assert!(refused.stderr.contains("table.csv"), "{}", refused.stderr);
        assert_eq!(std::fs::read_to_string(&own).unwrap(), "mine\n");
    }
    let other = folder.path().join("other");
    std::fs::create_dir(&other).unwrap();
    std::fs::write(other.join("index.json"), "{}").unwrap();
    rfm(folder.path(), &["check", "a.rfm", "--sweep", "r=1..2:2", "--into", "other", "--force"]).expect(2);
    assert_eq!(std::fs::read_to_string(other.join("index.json")).unwrap(), "{}");
}

#[test]
fn a_run_and_a_sweep_have_folders_of_their_own() {
    let folder = in_folder(FALL);
    let run = ["run", "a.rfm", "--no-pictures", "-o"];
    let sweep = ["--sweep", "v=-1..0 m/s:2"];
    rfm(folder.path(), &[&run[..], &["single"]].concat()).expect(0);
    let refused = rfm(folder.path(), &[&run[..], &["single"], &sweep].concat()).expect(2);
    assert!(refused.stderr.contains("holds a run"), "{}", refused.stderr);
    rfm(folder.path(), &[&run[..], &["several"], &sweep].concat()).expect(0);
    let refused = rfm(folder.path(), &[&run[..], &["several"]].concat()).expect(2);
    assert!(refused.stderr.contains("holds a sweep"), "{}", refused.stderr);
    assert!(!folder.path().join("several/frames").exists());
}

/// The row that was interrupted goes on from its own checkpoint, and ends as one that was not.
#[cfg(unix)]
#[test]
#[ignore = "long"]
fn an_interrupted_sweep_goes_on_within_its_row() {
    let folder = in_folder(&FALL.replace("save_every: 0.05 s", "save_every: 4 ms"));
    let arguments =
        |out| ["run", "a.rfm", "--sweep", "v=-1..0 m/s:2", "--no-pictures", "--threads", "1", "-o", out];
    let mut child = Command::new(env!("CARGO_BIN_EXE_rfm"))
        .args(arguments("broken"))
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let frames = folder.path().join("broken/v=-1m_s/frames");
    let started = Instant::now();
    while !frames.join("particles_000002.vtp").is_file() {
        assert!(
            started.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none(),
            "no frame"
        );
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{message}");
    assert!(message.contains("--resume goes on with `broken`"), "{message}");
    let found = index(&folder.path().join("broken"));
    assert_eq!((rows(&found).len(), &rows(&found)[0]["exit"]), (1, &130.into()));
    // a run that began again would write its first frame again
    let first = frames.join("particles_000001.vtp");
    let written = || std::fs::metadata(&first).unwrap().modified().unwrap();
    let before = written();
    rfm(folder.path(), &[&arguments("broken")[..], &["--resume"]].concat()).expect(0);
    assert_eq!(written(), before);
    rfm(folder.path(), &arguments("straight")).expect(0);
    let [broken, straight] = ["broken", "straight"].map(|name| folder.path().join(name));
    let codes: Vec<Value> = rows(&index(&broken)).iter().map(|row| row["exit"].clone()).collect();
    assert_eq!(codes, [0, 0]);
    for file in ["probes/top.csv", "history/energy.csv", "frames/particles_000050.vtp"] {
        let content = |out: &Path| std::fs::read(out.join("v=-1m_s").join(file)).unwrap();
        assert!(content(&broken) == content(&straight), "{file} differs");
    }
}

/// A volume that no cells show is measured along lines, in the table of a sweep too.
#[test]
#[ignore = "long"]
fn volumes_that_are_not_resolved_by_cells_have_their_error_in_the_table() {
    let folder = in_folder(
        "rfm 1\nparam r = 0.2 in 0.05 .. 0.9\nsolid pin = box([0, 0, 0], [1, 1, 0.5]) \\ cylinder(r, 2).move([0.5, 0.5, -0.5])\n",
    );
    // the wall beside the wider hole needs thousands of cells.
    // What is given for a swept param is not used, and a message says so
    let outcome =
        rfm(folder.path(), &["check", "a.rfm", "--sweep", "r=0.3..0.4995:2", "-D", "r=0.4"]).expect(0);
    assert!(outcome.stderr.contains("the value that is given for `r` is not used"), "{}", outcome.stderr);
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert!(lines[1].contains(" ± ") && !lines[1].contains("not resolved"), "{}", lines[1]);
    assert!(lines[2].contains(" ± ") && !lines[2].contains("not resolved"), "{}", lines[2]);
    let found = index(&folder.path().join("a.sweep"));
    let exact = 0.5 * (1.0 - std::f64::consts::PI * 0.4995_f64.powi(2));
    let volume = figure(&rows(&found)[1], "volume");
    assert!((volume / exact - 1.0).abs() < 1e-3, "{volume} {exact}");
    assert_eq!([0, 1].map(|row| figure(&rows(&found)[row], "resolved")), [1.0, 0.0]);
}

/// `-s` names what is measured: other solids cost nothing and have no column.
#[test]
fn a_study_of_one_solid_measures_no_other() {
    let folder = in_folder(
        "rfm 1\nparam r = 0.2 in 0.05 .. 0.9\nsolid ball = sphere(r)\nsolid other = sphere(1)\nsolid third = sphere(2)\n",
    );
    let outcome = rfm(folder.path(), &["check", "a.rfm", "-s", "ball", "--sweep", "r=0.1..0.3:2"]).expect(0);
    let head: Vec<&str> = outcome.stdout.lines().next().unwrap().split_whitespace().collect();
    assert_eq!(head, ["r", "volume", "area", "components"]);
    let outcome = rfm(folder.path(), &["check", "a.rfm", "-s", "ball,third"]).expect(0);
    assert!(
        outcome.stdout.contains("solid third") && !outcome.stdout.contains("solid other"),
        "{}",
        outcome.stdout
    );
    let outcome = rfm(folder.path(), &["check", "a.rfm", "-s", "bell"]).expect(2);
    assert!(outcome.stderr.contains("did you mean `ball`?"), "{}", outcome.stderr);
}
