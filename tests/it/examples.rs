//! The files in examples/ are what a new user reads first: they check without a warning and run well.

use std::ops::ControlFlow;
use std::path::Path;

use rfm::{Engine, Experiment, Program};

use crate::tool::{rfm, root, stem};

fn examples() -> Vec<std::path::PathBuf> {
    let mut files: Vec<_> =
        std::fs::read_dir(root().join("examples")).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "rfm"));
    files.sort();
    files
}

/// Examples that `rfm check` measures for many seconds, because their formulas are long.
const LONG: [&str; 6] = ["gear", "heat_exchanger", "hood", "screw", "spring", "wing"];

/// What `rfm check` says of examples: nothing, and that their solids have a volume.
fn check_without_a_word(examples: impl Iterator<Item = std::path::PathBuf>) {
    for path in examples {
        let name = format!("examples/{}.rfm", stem(&path));
        let outcome = rfm(root(), &["check", "--deny", "warnings", "--json", &name]).expect(0);
        assert_eq!(outcome.stderr, "", "{name}");
        let document = outcome.json();
        assert_eq!(document["ok"], true);
        for solid in document["solids"].as_array().unwrap() {
            assert!(solid["volume"].as_f64().unwrap() > 0.0, "{name}: {solid}");
        }
    }
}

#[test]
#[ignore = "long"]
fn every_example_checks_without_a_word() {
    let (long, short): (Vec<_>, Vec<_>) = examples().into_iter().partition(|path| LONG.contains(&stem(path)));
    assert!(long.len() == LONG.len() && short.len() > 10, "{long:?}");
    check_without_a_word(short.into_iter());
    for path in long {
        // all that is found out about a file but for the measures of its solids, which are also meshed in `crossings`
        let program = Program::from_path(&path).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(program.warnings().list, [], "{}", path.display());
        for named in &program.module().solids {
            let solid = program.solid_with(&named.name, Engine::Auto).unwrap();
            assert!(solid.bounds().aabb().is_some(), "{} of {}", named.name, path.display());
        }
    }
}

#[test]
#[ignore = "within the budget of a check on a machine that is not busy"]
fn study_of_the_long_examples() {
    check_without_a_word(examples().into_iter().filter(|path| LONG.contains(&stem(path))));
}

/// A small drop falls on the piece. The invariants are those of the long run.
#[track_caller]
fn falls_well(name: &str) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let file = format!("examples/{name}.rfm");
    let arguments = [
        "run",
        &file,
        "-D",
        "particles=400",
        "--until",
        "0.4",
        "--mesh-cells",
        "32",
        "--json",
        "-o",
        out.to_str().unwrap(),
    ];
    let outcome = rfm(root(), &arguments).expect(0);
    let summary = outcome.json();
    let written: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary, written);
    for key in ["inside", "lost", "non_finite", "particles_carved"] {
        assert_eq!(summary[key], 0, "{key}: {summary}");
    }
    assert_eq!(summary["particles"], 400);
    assert!(summary["max_penetration"].as_f64().unwrap() <= 1e-9, "{summary}");
    assert!(summary["energy_excess"].as_f64().unwrap() < 1e-3, "{summary}");
    assert_eq!(summary["finished"], true);
    let frames = summary["frames"].as_u64().unwrap() as usize;
    assert!(frames >= 5, "{summary}");
    frames_are_whole(&out, frames);
}

fn frames_are_whole(out: &Path, frames: usize) {
    let collection = std::fs::read_to_string(out.join("particles.pvd")).unwrap();
    assert_eq!(collection.matches("<DataSet").count(), frames);
    for i in 0..frames {
        let bytes = std::fs::read(out.join(format!("frames/particles_{i:06}.vtp"))).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("NumberOfPoints=\"400\""));
        assert!(["speed", "density", "pressure"].iter().all(|name| text.contains(name)));
        assert!(text.trim_end().ends_with("</VTKFile>"));
        let picture = std::fs::File::open(out.join(format!("pictures/frame_{i:06}.png"))).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(picture)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert!(info.width >= 320 && pixels.iter().any(|&p| p != pixels[0]));
    }
    for file in ["obstacle.stl", "obstacle.vtp"] {
        assert!(std::fs::metadata(out.join(file)).unwrap().len() > 1000);
    }
}

/// Runs the first tenths of a second of a scene in which something moves. Frames of the obstacle are written
/// beside those of the fluid, and they differ.
#[track_caller]
fn moves_well(name: &str, until: &str) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let file = format!("examples/{name}.rfm");
    let arguments = [
        &["run", &file, "-D", "particles=700", "--until", until, "--mesh-cells", "24"],
        &["--no-pictures", "--json", "-o", out.to_str().unwrap()][..],
    ];
    let summary = rfm(root(), &arguments.concat()).expect(0).json();
    for key in ["inside", "lost", "non_finite", "particles_carved"] {
        assert_eq!(summary[key], 0, "{key}: {summary}");
    }
    let frames = summary["frames"].as_u64().unwrap() as usize;
    let collection = std::fs::read_to_string(out.join("obstacle.pvd")).unwrap();
    assert_eq!(collection.matches("<DataSet").count(), frames);
    let obstacle = |i: usize| std::fs::read(out.join(format!("frames/obstacle_{i:06}.vtp"))).unwrap();
    assert!(collection.contains("file=\"frames/obstacle_000000.vtp\""));
    assert_ne!(obstacle(0), obstacle(frames - 1));
}

#[test]
#[ignore = "long"]
fn a_flap_turns_and_lets_water_out() {
    moves_well("gate", "0.8");
}

#[test]
fn a_paddle_makes_waves() {
    moves_well("paddle", "0.5");
}

#[test]
fn a_box_turns_about_its_fluid() {
    let program = Program::from_path(root().join("examples/rotating_box.rfm")).unwrap();
    let program = program.with("particles", 300.0).and_then(|p| p.with("turn", 12.0)).unwrap();
    let scene = &program.module().scenes[0];
    let experiment = Experiment::new(&program, &scene.name, Engine::Auto).unwrap();
    let mut simulation = experiment.start().unwrap().simulation;
    // it rests for a second and makes a quarter of a turn: the wall x = 3 is then the floor
    simulation.advance(4.0, |_| ControlFlow::Continue(())).unwrap();
    let gravity = simulation.parameters().gravity;
    assert!(gravity.x > 9.8 && gravity.z.abs() < 0.1, "{gravity}");
    let x = &simulation.particles().position.x;
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    // the paper's fluid lies flat, at most half a support radius high
    assert!(mean > 2.5, "{mean}");
    let stats = simulation.stats();
    assert_eq!((stats.inside, stats.lost, stats.non_finite), (0, 0, 0));
}

#[test]
fn a_drop_falls_on_the_pawn() {
    falls_well("pawn");
}

#[test]
fn a_drop_falls_on_the_bishop() {
    falls_well("bishop");
}

#[test]
fn a_drop_falls_on_the_cube() {
    falls_well("cube");
}
