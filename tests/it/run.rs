//! Runs that are interrupted, damaged, out of space, or that diverge: nothing that was saved is lost, and a
//! resumed run gives what an uninterrupted one would have given. Also probes and their files.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::tool::{Outcome, rfm, snapshot};

/// A drop beside a post, with probes of all kinds.
fn scene(method: &str, run: &str) -> String {
    format!(
        "rfm 1
param r = 0.1 in 0.05 .. 0.2 \"radius of the post\"
solid post = cylinder(r, 0.3).move([0.5, 0.5, 0])
scene drop {{
  box {{ max: [1, 1, 1] }}
  fluid water {{ shape: ball([0.5, 0.52, 0.45], 0.14), fill: middle, spacing: 0.03, viscosity: 0.5 }}
  obstacle {{ solid: post }}
  method: {method}
  run {{ {run} }}
  probe level {{ height: [0.5, 0.52], every: 3 ms }}
  probe load {{ force: post, about: [0.5, 0.5, 0] }}
  probe wind {{ velocity: [0.5, 0.52, 0.45] }}
  probe head {{ pressure: [0.5, 0.52, 0.45] }}
  probe fall {{ flux {{ point: [0.5, 0.5, 0.4], normal: [0, 0, -1] }}, every: 20 ms }}
  probe balance {{ energy: water }}
}}
"
    )
}

const METHODS: [&str; 3] = ["paper", "wcsph", "dfsph"];
const PROBES: [&str; 6] = ["balance", "fall", "head", "level", "load", "wind"];

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// What must not differ between a run in one go and a run with a stop in between.
fn results(out: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = vec![];
    let mut add = |name: String| {
        let bytes = std::fs::read(out.join(&name)).unwrap();
        found.push((name, bytes));
    };
    names(&out.join("frames")).into_iter().for_each(|name| add(format!("frames/{name}")));
    PROBES.iter().for_each(|name| add(format!("probes/{name}.csv")));
    ["energy", "audit"].iter().for_each(|name| add(format!("history/{name}.csv")));
    add("particles.pvd".into());
    found
}

#[track_caller]
fn assert_same_results(one: &Path, other: &Path) {
    let (one, other) = (results(one), results(other));
    let names =
        |results: &[(String, Vec<u8>)]| results.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&one), names(&other));
    for ((name, one), (_, other)) in one.iter().zip(&other) {
        assert!(one == other, "{name} differs");
    }
}

fn run(folder: &Path, flags: &[&str]) -> Outcome {
    let always = ["run", "drop.rfm", "--threads", "1", "--no-pictures", "--mesh-cells", "8", "-o"];
    rfm(folder, &[&always[..], flags].concat())
}

#[test]
#[ignore = "long"]
fn a_run_that_was_stopped_goes_on_as_if_it_had_not_been() {
    for method in METHODS {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        std::fs::write(here.join("drop.rfm"), scene(method, "until: 0.1 s, save_every: 10 ms")).unwrap();
        run(here, &["straight"]).expect(0);
        // it stops between two frames, and then at its end
        run(here, &["broken", "--steps", "11"]).expect(0);
        let summary = run(here, &["broken", "--resume", "--json"]).expect(0).json();
        assert_same_results(&here.join("straight"), &here.join("broken"));
        let straight = std::fs::read_to_string(here.join("straight/summary.json")).unwrap();
        let straight: serde_json::Value = serde_json::from_str(&straight).unwrap();
        for key in
            ["steps", "simulated_seconds", "kinetic_energy", "potential_energy", "energy_at_start", "frames"]
        {
            assert_eq!(summary[key], straight[key], "{method}: {key}");
        }
        assert_eq!(names(&here.join("broken/checkpoints")).len(), 2);
        // a run that has ended stays as it is
        run(here, &["broken", "--resume"]).expect(0);
        assert_same_results(&here.join("straight"), &here.join("broken"));
        for name in PROBES {
            for ending in ["csv", "svg", "png"] {
                assert!(here.join(format!("straight/probes/{name}.{ending}")).is_file(), "{name}.{ending}");
            }
        }
    }
}

#[test]
fn a_longer_run_goes_on_from_the_end_of_a_shorter() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("drop.rfm"), scene("dfsph", "until: 40 ms, save_every: 10 ms")).unwrap();
    run(here, &["short"]).expect(0);
    std::fs::write(here.join("drop.rfm"), scene("dfsph", "until: 80 ms, save_every: 10 ms")).unwrap();
    run(here, &["short", "--resume"]).expect(0);
    run(here, &["long"]).expect(0);
    assert_same_results(&here.join("short"), &here.join("long"));
    let pvd = std::fs::read_to_string(here.join("long/particles.pvd")).unwrap();
    assert!(pvd.contains(r#"timestep="0.05""#), "{pvd}");
}

/// 3·0.05 is 0.15000000000000002: a run that ends at 0.15 ends at the third frame, and not a rounding before it.
#[test]
#[ignore = "long"]
fn a_run_that_ends_at_a_frame_goes_on_as_if_it_had_not() {
    for method in ["wcsph", "dfsph"] {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        std::fs::write(here.join("drop.rfm"), scene(method, "until: 0.25 s, save_every: 50 ms")).unwrap();
        run(here, &["straight"]).expect(0);
        run(here, &["broken", "--until", "0.15"]).expect(0);
        run(here, &["broken", "--resume"]).expect(0);
        assert_same_results(&here.join("straight"), &here.join("broken"));
    }
}

#[test]
fn damaged_and_foreign_checkpoints() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("drop.rfm"), scene("wcsph", "until: 60 ms, save_every: 10 ms")).unwrap();
    let none = run(here, &["out", "--resume"]).expect(2);
    assert!(!here.join("out").exists());
    run(here, &["straight"]).expect(0);
    run(here, &["out", "--until", "0.03"]).expect(0);
    let [older, newer] = &names(&here.join("out/checkpoints"))[..] else { panic!("not two checkpoints") };
    let (older, newer) = (here.join("out/checkpoints").join(older), here.join("out/checkpoints").join(newer));
    let sound = std::fs::read(&newer).unwrap();

    // the post differs, and so does its name
    let changed = run(here, &["out", "--resume", "-D", "r=0.11"]).expect(2);
    let cut = &sound[..sound.len() / 2];
    std::fs::write(&newer, cut).unwrap();
    let fallen_back = run(here, &["out", "--resume", "--until", "0.04"]).expect(0);
    assert!(fallen_back.stderr.contains("is damaged"), "{}", fallen_back.stderr);
    assert!(fallen_back.stderr.contains("going on from the one before"), "{}", fallen_back.stderr);
    run(here, &["out", "--resume"]).expect(0);
    assert_same_results(&here.join("straight"), &here.join("out"));

    for name in names(&here.join("out/checkpoints")) {
        std::fs::remove_file(here.join("out/checkpoints").join(name)).unwrap();
    }
    let mut flipped = sound.clone();
    flipped[sound.len() / 3] ^= 4;
    std::fs::write(&older, flipped).unwrap();
    std::fs::write(&newer, "time,height\n").unwrap();
    let before = names(&here.join("out"));
    let neither = run(here, &["out", "--resume"]).expect(2);
    assert_eq!(names(&here.join("out")), before);

    let mut text = String::new();
    for (what, outcome) in [("no checkpoint", none), ("another scene", changed), ("none is sound", neither)] {
        text += &format!("{what}\n{}", outcome.stderr);
    }
    let steps = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    let text = text.replace(&steps(&older), "OLDER").replace(&steps(&newer), "NEWER");
    snapshot("cli", "resume refused", &text);
}

#[test]
fn files_of_others_are_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("drop.rfm"), scene("paper", "dt: 1 ms, until: 2 ms, save_every: 2 ms")).unwrap();
    let names = [
        "summary.json",
        "particles.pvd",
        "probes/level.csv",
        "history/audit.csv",
        "surface/surface_000001.stl",
        "pictures/frame_000000.png",
    ];
    for (k, name) in names.iter().enumerate() {
        let out = format!("out{k}");
        let path = here.join(&out).join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, "of another program").unwrap();
        let told = run(here, &[&out]).expect(2).stderr;
        assert!(told.contains("holds no run") && told.contains(&format!("`{name}` in it")), "{told}");
        assert_eq!(std::fs::read(&path).unwrap(), b"of another program");
        if k < 2 {
            run(here, &[&out, "--force"]).expect(0);
        }
    }
    // a run that was stopped before its first frame may begin again
    std::fs::create_dir_all(here.join("begun/history")).unwrap();
    std::fs::write(here.join("begun/history/audit.csv"), "time [s]\n").unwrap();
    run(here, &["begun"]).expect(0);
    // files that a run does not write do no harm
    std::fs::create_dir_all(here.join("mine/probes")).unwrap();
    std::fs::write(here.join("mine/probes/other.csv"), "a,b\n").unwrap();
    run(here, &["mine"]).expect(0);
}

/// Makes a hole in one table of a run, and removes another one and a frame. Returns how many samples the first one had.
fn damaged(out: &Path) -> usize {
    let table = out.join("probes/level.csv");
    let text = std::fs::read_to_string(&table).unwrap();
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    std::fs::write(&table, [&lines[..4], &lines[6..]].concat().concat()).unwrap();
    std::fs::remove_file(out.join("probes/head.csv")).unwrap();
    std::fs::remove_file(out.join("frames/particles_000002.vtp")).unwrap();
    lines.len() - 1
}

#[test]
fn what_a_resumed_run_lacks_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let probes = "probe level { height: [0.5, 0.52], every: 3 ms }";
    let text = scene("wcsph", "until: 40 ms, save_every: 10 ms");
    let text = text.replace(probes, "probe level { height: [0.5, 0.52], every: 3 ms, from: 5 ms }");
    std::fs::write(here.join("drop.rfm"), &text).unwrap();
    let whole = run(here, &["out"]).expect(0);
    assert!(!whole.stdout.contains("lost") && !whole.stderr.contains("W0517"), "{}", whole.stderr);

    // an end that lies behind
    for flags in [["--until", "0.02"], ["--steps", "3"]] {
        let told = run(here, &[&["out", "--resume"][..], &flags].concat()).expect(2).stderr;
        assert!(told.contains("0.04 s, already") && told.contains("--force"), "{told}");
    }

    let samples = damaged(&here.join("out"));
    for until in ["60ms", "80ms"] {
        let goes_on = run(here, &["out", "--resume", "--until", until]).expect(0);
        let told = &goes_on.stderr;
        let lacks = format!("`out/probes/level.csv` lacks 2 of the {samples} samples up to 0.04 s");
        assert!(until == "80ms" || told.contains(&lacks), "{told}");
        assert!(told.contains("warning[W0517]: `out/probes/level.csv` lacks 2 of the"), "{told}");
        assert!(told.contains("`out/probes/head.csv` lacks 5 of the"), "{told}");
        assert!(
            told.contains("frames is missing, the first at 0.02 s (`out/frames/particles_000002.vtp`)"),
            "{told}"
        );
        let means = goes_on.stdout.lines().find(|line| line.starts_with("probe level, mean")).unwrap();
        assert!(means.contains("2 samples of its table are lost (W0517)"), "{means}");
        let summary = std::fs::read_to_string(here.join("out/summary.json")).unwrap();
        assert!(summary.contains("\"samples_lost\": 2"), "{summary}");
    }
    // the frames that are left keep their times
    let pvd = std::fs::read_to_string(here.join("out/particles.pvd")).unwrap();
    for (time, number) in [("0.01", 1), ("0.03", 3), ("0.05", 5), ("0.08", 8)] {
        let entry = format!("timestep=\"{time}\" part=\"0\" file=\"frames/particles_{number:06}.vtp\"");
        assert!(pvd.contains(&entry), "{entry}: {pvd}");
    }
    assert!(!pvd.contains("particles_000002"), "{pvd}");

    // probes that are new or measure something else begin where the run goes on
    let more = text.replace("probe level", "probe late { height: [0.5, 0.5], from: 10 ms }\n  probe level");
    let more = more.replace("probe head { pressure: ", "probe head { velocity: ");
    std::fs::write(here.join("drop.rfm"), more).unwrap();
    let goes_on = run(here, &["out", "--resume", "--until", "0.1"]).expect(0);
    for told in [
        "`out/probes/late.csv` has no samples of the time before 0.08 s",
        "`out/probes/head.csv` measures something else",
    ] {
        assert!(goes_on.stderr.contains(told), "{}", goes_on.stderr);
    }
    assert!(goes_on.stdout.contains("probe late, mean from 0.08 s on"), "{}", goes_on.stdout);
}

#[cfg(unix)]
#[test]
#[ignore = "long"]
fn an_interrupted_run_has_a_checkpoint_and_goes_on() {
    for signal in ["-INT", "-TERM"] {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        std::fs::write(here.join("drop.rfm"), scene("dfsph", "until: 60 s, save_every: 10 ms")).unwrap();
        let child = Command::new(env!("CARGO_BIN_EXE_rfm"))
            .args(["run", "drop.rfm", "--threads", "1", "--no-pictures", "--mesh-cells", "8", "-o", "out"])
            .current_dir(here)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let started = Instant::now();
        while !here.join("out/frames/particles_000002.vtp").is_file() {
            assert!(started.elapsed() < Duration::from_secs(60), "no frame");
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(130), "{message}");
        assert!(
            message.contains("interrupted after") && message.contains("--resume goes on from"),
            "{message}"
        );
        let summary = std::fs::read_to_string(here.join("out/summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
        assert_eq!(summary["finished"], false);
        let end = summary["simulated_seconds"].as_f64().unwrap() + 0.02;
        let until = format!("{}", (100.0 * end).ceil() / 100.0);
        run(here, &["out", "--resume", "--until", &until]).expect(0);
        run(here, &["straight", "--until", &until]).expect(0);
        assert_same_results(&here.join("straight"), &here.join("out"));
    }
}

/// The frames that a collection lists. Each must exist and be complete.
fn listed(out: &Path) -> usize {
    let text = std::fs::read_to_string(out.join("particles.pvd")).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let frames: Vec<_> = document.descendants().filter_map(|node| node.attribute("file")).collect();
    for frame in &frames {
        let bytes = std::fs::read(out.join(frame)).unwrap();
        assert!(bytes.ends_with(b"</AppendedData>\n</VTKFile>\n"), "{frame}");
    }
    frames.len()
}

#[cfg(unix)]
#[test]
fn a_full_disk_ends_a_run_in_order_and_it_goes_on_when_there_is_room() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let few = scene("paper", "dt: 1 ms, until: 0.3 s, save_every: 1 ms").replace("0.14", "0.05");
    std::fs::write(here.join("drop.rfm"), few).unwrap();
    // no file may exceed 16 KiB, and the collection does so after about two hundred frames
    let shell = "ulimit -f 16; [ $(ulimit -f) = 16 ] && exec \"$0\" \"$@\"";
    let output = Command::new("bash")
        .args(["-c", shell, env!("CARGO_BIN_EXE_rfm"), "run", "drop.rfm", "--threads", "1", "--no-pictures"])
        .args(["--mesh-cells", "4", "-o", "out"])
        .current_dir(here)
        .output()
        .unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("cannot write `out/"), "{message}");
    assert!(message.contains("--resume goes on from"), "{message}");
    let frames = listed(&here.join("out"));
    assert!((100..300).contains(&frames), "{frames}");
    assert!(names(&here.join("out")).iter().all(|name| !name.starts_with(".rfm-")));
    run(here, &["out", "--resume"]).expect(0);
    run(here, &["straight"]).expect(0);
    assert_eq!(listed(&here.join("out")), 301);
    assert_same_results(&here.join("straight"), &here.join("out"));
}

#[test]
fn a_diverging_run_says_where_and_keeps_what_was_sound() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let wild = scene("paper", "dt: 1 ms, until: 1 s, save_every: 1 ms")
        .replace("viscosity: 0.5", "stiffness: 1e300, support_radius: 0.1, jitter: 0.2");
    std::fs::write(here.join("drop.rfm"), wild).unwrap();
    let outcome = run(here, &["out"]).expect(3);
    for part in [
        "step ",
        "the time step of 0.001 s is too long",
        "s is stable at the speeds of this scene",
        "the frames up to",
    ] {
        assert!(outcome.stderr.contains(part), "no `{part}` in {}", outcome.stderr);
    }
    assert!(listed(&here.join("out")) > 0);
    let summary = std::fs::read_to_string(here.join("out/summary.json")).unwrap();
    assert!(summary.contains("\"finished\": false"), "{summary}");
}

#[cfg(unix)]
#[test]
fn two_runs_never_share_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("drop.rfm"), scene("dfsph", "until: 60 s, save_every: 10 ms")).unwrap();
    let mut first = Command::new(env!("CARGO_BIN_EXE_rfm"))
        .args(["run", "drop.rfm", "--threads", "1", "--no-pictures", "--mesh-cells", "8", "-o", "out"])
        .current_dir(here)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let started = Instant::now();
    while !here.join("out/frames/particles_000001.vtp").is_file() {
        assert!(started.elapsed() < Duration::from_secs(60), "no frame");
        std::thread::sleep(Duration::from_millis(5));
    }
    for how in [&["out", "--force"][..], &["out", "--resume"], &["out"]] {
        let refused = run(here, how).expect(2).stderr;
        assert!(refused.contains("another run is writing into `out`"), "{refused}");
    }
    // a run that is killed releases its lock, and leaves its temporary files to the next
    first.kill().unwrap();
    first.wait().unwrap();
    for part in ["out/.rfm-summary.json-abc", "out/frames/.rfm-def"] {
        std::fs::write(here.join(part), "half a file").unwrap();
    }
    run(here, &["out", "--force", "--until", "0.02"]).expect(0);
    for part in ["out", "out/frames", "out/checkpoints", "out/probes"] {
        assert!(names(&here.join(part)).iter().all(|name| !name.starts_with(".rfm-")), "{part}");
    }
}

#[test]
fn a_fluid_without_room_ends_its_run() {
    let folder = tempfile::tempdir().unwrap();
    let press = "rfm 1
solid press = box([-1, -1, 0], [2, 2, 3]).move([0, 0, 0.6 - 0.3*t])
scene crush {
  box { max: [1, 1, 1] }
  fluid { shape: box([0, 0, 0], [1, 1, 0.4]), mass: 2, support_radius: 0.3, density: 1000 }
  obstacle { solid: press }
  run { until: 3 s, save_every: 50 ms }
}
";
    std::fs::write(folder.path().join("drop.rfm"), press).unwrap();
    let outcome = run(folder.path(), &["out"]).expect(3);
    assert!(outcome.stderr.contains("there is no room left for it"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("m³ of fluid"), "{}", outcome.stderr);
}

#[test]
fn a_forecast_needs_no_particles() {
    let folder = tempfile::tempdir().unwrap();
    let forecast = |spacing: &str, method: &str| {
        let text = scene(method, "until: 100 s, save_every: 10 ms").replace("0.03", spacing);
        std::fs::write(folder.path().join("drop.rfm"), text).unwrap();
        let started = Instant::now();
        let document = run(folder.path(), &["out", "--dry-run", "--json"]).expect(0).json();
        (document, started.elapsed())
    };
    for method in METHODS {
        // the ball has a volume of 0.0115 m³
        let (document, spent) = forecast("0.001", method);
        let particles = document["particles"].as_f64().unwrap();
        assert!((particles / 1.15e7 - 1.0).abs() < 0.05, "{method}: {particles}");
        assert_eq!((&document["estimated"], &document["frames"]), (&true.into(), &10001.into()), "{method}");
        // a loaded machine is slow; an idle one takes less than a second
        assert!(spent < Duration::from_secs(30), "{method}: {spent:?}");
        let number = |key: &str| document[key].as_f64().unwrap();
        assert!(
            number("bytes") > 1e9 && number("disk_bytes") > 1e12 && number("seconds") > 1e6,
            "{document}"
        );
    }
    let (document, _) = forecast("0.03", "wcsph");
    assert_eq!(document["estimated"], false);
    assert!(!folder.path().join("out").exists());
}

#[test]
fn a_forecast_of_a_run_that_goes_on_is_of_what_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("drop.rfm"), scene("paper", "dt: 1 ms, until: 50 ms, save_every: 10 ms"))
        .unwrap();
    run(here, &["out", "--until", "20ms"]).expect(0);
    let before = names(&here.join("out/frames"));
    let forecast =
        |more: &[&str]| run(here, &[&["out", "--dry-run", "--json"], more].concat()).expect(0).json();
    let (whole, rest) = (forecast(&[]), forecast(&["--resume"]));
    assert_eq!((&whole["steps"], &whole["frames"]), (&50.into(), &6.into()));
    assert_eq!((&rest["steps"], &rest["frames"]), (&30.into(), &3.into()));
    assert_eq!((&rest["particles"], &rest["estimated"]), (&whole["particles"], &false.into()));
    assert_eq!(names(&here.join("out/frames")), before);
    let behind = run(here, &["out", "--dry-run", "--resume", "--steps", "5"]).expect(2);
    assert!(behind.stderr.contains("does not go back"), "{}", behind.stderr);
    let nothing = run(here, &["other", "--dry-run", "--resume"]).expect(2);
    assert!(!here.join("other").exists() && !nothing.stderr.is_empty());
}

#[test]
fn checkpoints_as_often_as_a_scene_says() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let often = scene("paper", "dt: 1 ms, until: 50 ms, save_every: 10 ms, checkpoint_every: 20 ms");
    std::fs::write(here.join("drop.rfm"), often).unwrap();
    run(here, &["out"]).expect(0);
    // it was saved after 20, 40 and 50 ms: the last two are kept
    assert_eq!(
        names(&here.join("out/checkpoints")),
        ["step_0000000040.checkpoint", "step_0000000050.checkpoint"]
    );
}

#[test]
fn probes_write_tables_with_units() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let text = scene("paper", "dt: 1 ms, until: 40 ms, save_every: 10 ms");
    std::fs::write(here.join("drop.rfm"), text).unwrap();
    run(here, &["out"]).expect(0);
    let table = |name: &str| std::fs::read_to_string(here.join(format!("out/probes/{name}.csv"))).unwrap();
    let header = |name: &str| table(name).lines().next().unwrap().to_string();
    assert_eq!(header("level"), "time [s],height [m]");
    assert_eq!(header("wind"), "time [s],velocity x [m/s],velocity y [m/s],velocity z [m/s]");
    assert_eq!(header("fall"), "time [s],flux [kg/s]");
    assert_eq!(header("balance"), "time [s],kinetic [J],potential [J],elastic [J],total [J]");
    let times = |name: &str| {
        table(name).lines().skip(1).map(|l| l.split(',').next().unwrap().to_string()).collect::<Vec<_>>()
    };
    assert_eq!(times("balance"), ["0", "0.01", "0.02", "0.03", "0.04"]);
    assert_eq!(times("fall"), ["0", "0.02", "0.04"]);
    assert_eq!(times("level").len(), 14);
    // before the drop meets the post it falls freely: kinetic energy is what was potential energy
    let rows: Vec<Vec<f64>> = table("balance")
        .lines()
        .skip(1)
        .map(|l| l.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    let mass = 998.29 * 0.03f64.powi(3);
    let count = rows[0][2] / (mass * 9.81) / 0.45;
    let expected = 0.5 * mass * count * (9.81f64 * 0.01).powi(2);
    assert!((rows[1][1] / expected - 1.0).abs() < 0.05, "{} {expected}", rows[1][1]);
    // a second run of another scene leaves no table of the first
    let less = text_without_probes();
    std::fs::write(here.join("drop.rfm"), less).unwrap();
    run(here, &["out", "--force"]).expect(0);
    assert!(names(&here.join("out/probes")).is_empty());
}

/// A drop that falls: from 20 ms on its mean velocity is −g times the mean of the times.
#[test]
fn means_of_probes_are_told_with_their_errors() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let text = scene("paper", "dt: 1 ms, until: 100 ms, save_every: 50 ms").replace(
        "probe wind { velocity: [0.5, 0.52, 0.45] }",
        "probe wind { velocity: [0.5, 0.52, 0.42], every: 1 ms, from: 20 ms, known: [0, 0, -0.5] }",
    );
    std::fs::write(here.join("drop.rfm"), text.replace("0.3).move", "0.01).move")).unwrap();
    let output = run(here, &["out"]);
    let summary: serde_json::Value =
        serde_json::from_slice(&std::fs::read(here.join("out/summary.json")).unwrap()).unwrap();
    let [means] = &summary["probes"].as_array().unwrap()[..] else { panic!("{summary}") };
    assert_eq!((&means["probe"], &means["samples"]), (&"wind".into(), &80.into()));
    let mean = means["mean"][2].as_f64().unwrap();
    assert!((mean + 9.81 * 0.0605).abs() < 0.01, "{mean}");
    let deviation = means["deviation"].as_f64().unwrap();
    assert!((deviation - (mean + 0.5).abs() / 0.5).abs() < 0.01, "{deviation}");
    // it grows evenly, so that the means of eight blocks lie g·10 ms apart
    let error = means["error"][2].as_f64().unwrap();
    assert!((error / (9.81 * 0.01 * (6.0_f64 / 8.0).sqrt()) - 1.0).abs() < 0.05, "{error}");
    let told = output.expect(0).stdout;
    assert!(told.contains("probe wind, mean from 0.02 s on: velocity x "), "{told}");
}

fn text_without_probes() -> String {
    let text = scene("paper", "dt: 1 ms, until: 5 ms, save_every: 5 ms");
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("probe")).collect();
    lines.join("\n") + "\n"
}

#[test]
fn explain_lists_the_passes_of_each_method() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::new();
    for method in METHODS {
        std::fs::write(folder.path().join("drop.rfm"), scene(method, "until: 1 s")).unwrap();
        text += &rfm(folder.path(), &["explain", "drop.rfm:drop"]).expect(0).stdout;
    }
    snapshot("cli", "explain passes", &text);
}

#[test]
fn a_file_that_a_scene_reads_is_named_if_a_run_cannot_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let outline = "let outline = points(\"outline.csv\")\nsolid post = polygon(outline).extrude(0, 0.3)";
    let text = scene("wcsph", "until: 20 ms, save_every: 10 ms")
        .replace("solid post = cylinder(r, 0.3).move([0.5, 0.5, 0])", outline);
    std::fs::write(here.join("drop.rfm"), text).unwrap();
    std::fs::write(here.join("outline.csv"), "0.4,0.4\n0.6,0.4\n0.5,0.6\n").unwrap();
    run(here, &["out", "--steps", "5"]).expect(0);
    std::fs::write(here.join("outline.csv"), "0.4,0.4\n0.6,0.4\n0.5,0.61\n").unwrap();
    let refused = run(here, &["out", "--resume"]).expect(2).stderr;
    assert!(
        refused.contains("or this scene, or a file that it reads (`outline.csv`), has changed since"),
        "{refused}"
    );
}
