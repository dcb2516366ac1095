//! Pictures and pages of saved runs: what the scene states of them, and what is said of parts that are missing.

use std::path::Path;

use crate::tool::{rfm, snapshot};

/// A drop between a post and a moon, with room for what a scene states of its pictures.
fn drop_scene(stated: &str) -> String {
    format!(
        "rfm 1
solid post = cylinder(0.2, 0.5).move([0.5, 0.5, 0])
solid moon = sphere(0.15).move([0.2, 0.2, 1.2])
scene drop {{
  box {{ min: [0, 0, 0], max: [1, 1, 1.5] }}
  fluid {{ shape: ball([0.5, 0.5, 1], 0.25), particles: 300, fill: middle }}
  obstacle {{ solid: post }}
  obstacle {{ solid: moon }}
  run {{ until: 0.04 s, save_every: 0.02 s }}
  {stated}
}}
"
    )
}

/// A gate that rises, so that each frame has obstacles of its own.
const GATE: &str = "rfm 1
solid gate = box([0.6, 0, 0], [0.7, 1, 0.5]).move([0, 0, t])
scene dam {
  box { min: [0, 0, 0], max: [1, 1, 1] }
  fluid { shape: box([0, 0, 0], [0.6, 1, 0.3]), particles: 150 }
  obstacle { solid: gate }
  run { until: 0.04 s, save_every: 0.02 s }
}
";

fn run(here: &Path, name: &str, text: &str) {
    let file = format!("{name}.rfm");
    std::fs::write(here.join(&file), text).unwrap();
    rfm(here, &["run", &file, "--no-pictures", "--mesh-cells", "16"]).expect(0);
}

#[test]
fn pictures_and_pages_obey_what_the_scene_states() {
    let (plain, stating) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    run(plain.path(), "drop", &drop_scene(""));
    let stated = "picture { camera: [0, -1, 0.3], look_at: [0.5, 0.5, 0.8], zoom: 1.5, cut: y <= 0.45, fastest: 2 m/s, \
                  hide: moon, glass: post }";
    run(stating.path(), "drop", &drop_scene(stated));
    let picture = |here: &Path, flags: &[&str]| {
        let words = ["render", "drop.out", "-o", "a.png", "--frames", "1", "--size", "320x240", "--json"];
        let told = rfm(here, &[&words[..], flags].concat()).expect(0).json();
        (std::fs::read(here.join("a.png")).unwrap(), told["high"].as_f64().unwrap())
    };
    let camera = "picture { camera: [0, -1, 0.3], look_at: [0.5, 0.5, 0.8], zoom: 1.5 }";
    let flags =
        ["--camera", camera, "--cut", "y=0.45", "--range", "0..2", "--hide", "moon", "--glass", "post"];
    let asked = picture(plain.path(), &flags);
    assert_eq!(asked.1, 2.0);
    assert!(asked == picture(stating.path(), &[]), "the scene says the same as the flags");
    assert!(asked != picture(plain.path(), &[]));
    let parallel = picture(plain.path(), &["--parallel"]);
    assert!(parallel != picture(plain.path(), &[]));
    let copied = "picture { camera: [0.48, -1, 0.46], projection: parallel }";
    assert!(parallel == picture(plain.path(), &["--camera", copied]));
    // flags come first
    let others = ["--camera", "1,0,0", "--cut", "none", "--range", "0..5"];
    let hiding = [&others[..], &["--hide", "moon", "--glass", "post"]].concat();
    assert!(picture(stating.path(), &others) == picture(plain.path(), &hiding));

    let page = |here: &Path| {
        rfm(here, &["view", "drop.out", "--save", "a.html"]).expect(0);
        let page = std::fs::read_to_string(here.join("a.html")).unwrap();
        let (_, setting) = page.split_once("id=\"setting\">").unwrap();
        serde_json::from_str::<serde_json::Value>(setting.split_once("</script>").unwrap().0).unwrap()
    };
    let told = page(stating.path());
    let expected = serde_json::json!({
        "camera": [0.0, -1.0, 0.3], "look_at": [0.5, 0.5, 0.8], "zoom": 1.5,
        "cut": { "axis": 1, "at": 0.45, "below": true }, "obstacle": "opaque", "parallel": false,
        "hide": ["moon"], "glass": ["post"],
    });
    assert_eq!(told["picture"], expected);
    assert_eq!(told["arrays"][0]["range"]["high"], 2.0);
    assert!(page(plain.path())["picture"]["obstacle"].is_null());
}

#[test]
fn particles_have_the_colours_of_a_component_of_their_velocity() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here, "drop", &drop_scene(""));
    let words = ["render", "drop.out", "-o", "a.png", "--frames", "2", "--size", "160x120", "--json"];
    let by = |array: &str| rfm(here, &[&words[..], &["--by", array]].concat()).expect(0).json();
    let (speed, fall) = (by("speed"), by("velocity z"));
    assert_eq!(fall["by"], "velocity z");
    // the drop falls, so its speed is that of the fall
    let end = |told: &serde_json::Value, key: &str| told[key].as_f64().unwrap();
    assert!((end(&fall, "high") / end(&speed, "high") - 1.0).abs() < 0.1, "{fall} {speed}");
    assert_eq!(end(&fall, "low"), -end(&fall, "high"));
    let wrong = rfm(here, &[&words[..], &["--by", "velocity w"]].concat()).expect(2).stderr;
    assert!(wrong.contains("did you mean `velocity"), "{wrong}");
}

/// What `render` and `view` say of the folder of a run that lacks something, where both say the same.
fn said(here: &Path, folder: &str) -> String {
    let render = ["render", folder, "-o", "a.gif", "--size", "64x48", "--cut", "none"];
    let render = rfm(here, &render).expect(0).stderr;
    let view = rfm(here, &["view", folder, "--save", "a.html"]).expect(0).stderr;
    assert_eq!(render, view);
    render
}

#[test]
#[ignore = "long"]
fn what_a_run_lacks_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here, "drop", &drop_scene("picture { cut: none }"));
    run(here, "dam", GATE);
    assert_eq!(said(here, "drop.out") + &said(here, "dam.out"), "");
    let mut all = String::new();
    let mut tell = |what: &str, folder: &str| all += &format!("{what}\n{}", said(here, folder));
    let rename = |from: &str, to: &str| std::fs::rename(here.join(from), here.join(to)).unwrap();

    rename("drop.out/obstacle.vtp", "kept.vtp");
    tell("a still obstacle", "drop.out");
    rename("kept.vtp", "drop.out/obstacle.vtp");
    let frame = "dam.out/frames/obstacle_000001.vtp";
    rename(frame, "kept.vtp");
    tell("the obstacle of a frame", "dam.out");
    rename("kept.vtp", frame);
    rename("dam.out/obstacle.pvd", "kept.pvd");
    tell("the list of obstacles", "dam.out");
    rename("kept.pvd", "dam.out/obstacle.pvd");

    let frame = "drop.out/frames/particles_000001.vtp";
    rename(frame, "kept.vtp");
    std::fs::copy(here.join("dam.out/frames/particles_000001.vtp"), here.join(frame)).unwrap();
    tell("a frame of another run", "drop.out");
    rename("kept.vtp", frame);
    let summary = here.join("drop.out/summary.json");
    let text = std::fs::read_to_string(&summary).unwrap();
    std::fs::write(&summary, &text[..100]).unwrap();
    tell("a damaged summary", "drop.out");
    std::fs::remove_file(&summary).unwrap();
    tell("no summary", "drop.out");
    snapshot("cli", "parts of runs that are missing", &all);
}
