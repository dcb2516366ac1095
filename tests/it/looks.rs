//! How pictures look: small pictures that were looked at are kept in `tests/pictures`, and new ones are
//! compared with them.
//!
//! `RFM_PICTURES=write` keeps what is drawn now. Look at the pictures before they are committed.

use std::io::Cursor;
use std::path::Path;

use crate::tool::{rfm, root};

/// Water in a bowl, and a ball that it flows around.
const BOWL: &str = "rfm 1
solid bowl = sphere(0.5) and z <= 0.2
solid stone = ball([0.15, 0, -0.3], 0.12)
solid post = cylinder(0.08, 0.5).move([0.45, -0.4, -0.6])
scene bath {
  box       { min: [-0.6, -0.6, -0.6], max: [0.6, 0.6, 0.6] }
  container { solid: bowl }
  obstacle  { solid: stone }
  obstacle  { solid: post }
  fluid { shape: sphere(0.5) and z <= -0.05 + 0.2*x, density: 1000, spacing: 4 cm }
  method: wcsph
  run { until: 1 ms, save_every: 1 ms }
}
";

fn pixels(file: &[u8]) -> Vec<u8> {
    let mut reader = png::Decoder::new(Cursor::new(file)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    pixels
}

/// Compares a picture with the one that is kept. Programs for surfaces may round otherwise on other
/// processors, so a few pixels at borders may differ.
fn compare(here: &Path, name: &str) {
    let kept = root().join("tests/pictures").join(name);
    let drawn = std::fs::read(here.join(name)).unwrap();
    if std::env::var_os("RFM_PICTURES").is_some_and(|value| value == "write") {
        std::fs::create_dir_all(kept.parent().unwrap()).unwrap();
        std::fs::write(&kept, &drawn).unwrap();
    }
    let (drawn, kept) = (pixels(&drawn), pixels(&std::fs::read(&kept).unwrap()));
    assert_eq!(drawn.len(), kept.len(), "{name}");
    let differing = drawn.iter().zip(&kept).filter(|(a, b)| a.abs_diff(**b) > 3).count();
    assert!(differing * 1000 < kept.len(), "{name}: {differing} of {} bytes differ", kept.len());
}

#[test]
#[ignore = "long"]
fn pictures_look_as_they_were_seen_to_look() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("bath.rfm"), BOWL).unwrap();
    let glass = ["run", "bath.rfm", "-o", "out", "--steps", "1", "--mesh-cells", "40", "--glass", "bowl"];
    rfm(here, &glass).expect(0);
    rfm(here, &["mesh", "out", "--fluid"]).expect(0);
    let render = |name: &str, flags: &[&str]| {
        let first = ["render", "out", "-o", name, "--frames", "0", "--size", "400x300", "--title", name];
        rfm(here, &[&first[..], flags].concat()).expect(0);
        std::fs::read(here.join(name)).unwrap()
    };
    let views: [(&str, &[&str]); 5] = [
        ("cut.png", &["--range", "0..1"]),
        ("glass.png", &["--range", "0..1", "--glass", "bowl"]),
        ("surface.png", &["--surface=opaque"]),
        ("clear-surface.png", &["--surface", "--glass", "bowl", "--cut", "none"]),
        ("particles-in-surface.png", &["--surface", "--particles", "--range", "0..1", "--hide", "bowl,post"]),
    ];
    for (name, flags) in views {
        let alone = render(name, &[flags, &["--threads", "1"]].concat());
        assert!(alone == render(name, &[flags, &["--threads", "2"]].concat()), "{name}");
        compare(here, name);
    }
    // a run draws the same glass, by its flag and by the key of its scene
    let first = |out: &str| std::fs::read(here.join(out).join("pictures/frame_000000.png")).unwrap();
    let keyed = BOWL.replacen("  method", "  picture { glass: bowl }\n  method", 1);
    std::fs::write(here.join("bath.rfm"), keyed).unwrap();
    rfm(here, &["run", "bath.rfm", "-o", "keyed", "--steps", "1", "--mesh-cells", "40"]).expect(0);
    assert!(first("out") == first("keyed"));
    rfm(here, &["run", "bath.rfm", "-o", "hid", "--steps", "1", "--mesh-cells", "40", "--hide", "bowl"])
        .expect(0);
    assert!(first("out") != first("hid"));
}

#[test]
#[ignore = "long"]
fn surfaces_that_are_not_there_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("bath.rfm"), BOWL).unwrap();
    let run = ["run", "bath.rfm", "-o", "out", "--steps", "1", "--mesh-cells", "16", "--no-pictures"];
    rfm(here, &run).expect(0);
    let refused = |flags: &[&str]| rfm(here, &[&["render", "out"][..], flags].concat()).expect(2).stderr;
    let told = refused(&["--surface"]);
    assert!(
        told.contains("no surfaces of the fluid") && told.contains("`rfm mesh out --fluid` makes them"),
        "{told}"
    );
    assert!(refused(&["--particles"]).contains("--surface"));
    assert!(refused(&["--surface=foam"]).contains("[possible values: clear, opaque]"));
    assert!(refused(&["--glass", "vase"]).contains("--glass vase: the run has no such obstacle"));
    rfm(here, &["mesh", "out", "--fluid", "--frames", "0..1", "--format", "ply"]).expect(0);
    let told = refused(&["--surface"]);
    assert!(told.contains("are .ply files, and pictures need the .vtp"), "{told}");
    rfm(here, &["mesh", "out", "--fluid", "--frames", "0..1"]).expect(0);
    let told = refused(&["--surface"]);
    assert!(told.contains("frame 1, at") && told.contains("has no surface"), "{told}");
    rfm(here, &["render", "out", "--surface", "--frames", "0", "-o", "a.png"]).expect(0);
    std::fs::write(here.join("out/surface/surface_000000.vtp"), "nonsense").unwrap();
    assert!(refused(&["--surface", "--frames", "0"]).contains("surface_000000.vtp"));
}
