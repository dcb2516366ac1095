//! What pictures of runs show, and what the flags and keys for them do.

use std::path::{Path, PathBuf};

use crate::tool::{rfm, root};

/// A bowl whose near half hides the water in it.
const BOWL: &str = "rfm 1
solid bowl = sphere(0.5)
solid post = cylinder(0.05, 0.4).move([0, 0, -0.45])
scene bath {
  box       { min: [-0.6, -0.6, -0.6], max: [0.6, 0.6, 0.6] }
  container { solid: bowl }
  obstacle  { solid: post }
  fluid { shape: bowl and z <= 0, density: 1000, spacing: 8 cm }
  method: wcsph
  run { until: 1 ms, save_every: 1 ms }
}
";

/// The first picture of a run of a file with some flags.
fn picture(folder: &Path, file: &str, flags: &[&str]) -> PathBuf {
    let mut arguments = vec!["run", file, "-o", "out", "--force", "--steps", "1", "--mesh-cells", "32"];
    arguments.extend(flags);
    rfm(folder, &arguments).expect(0);
    folder.join("out/pictures/frame_000000.png")
}

/// The parts of a picture that have the colours of slow water, of the obstacles' stone, and of faces that a cut opens.
fn shares(picture: &Path) -> [f64; 3] {
    let file = std::io::BufReader::new(std::fs::File::open(picture).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    let count = |is: &dyn Fn(i32, i32, i32) -> bool| {
        // without the colour bar to the right
        let width = 1280;
        let rows = pixels.chunks(3 * width).flat_map(|row| row[..3 * 1100].chunks(3));
        let found = rows.filter(|p| is(p[0].into(), p[1].into(), p[2].into())).count();
        found as f64 / (pixels.len() / 3) as f64
    };
    [
        count(&|r, _, b| b > r + 40),
        count(&|r, _, b| (8..25).contains(&(r - b)) && r < 235),
        count(&|r, _, b| (40..90).contains(&(r - b))),
    ]
}

#[test]
#[ignore = "long"]
fn a_container_is_cut_open_unless_that_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("bath.rfm"), BOWL).unwrap();
    let [water, stone, section] = shares(&picture(here, "bath.rfm", &[]));
    assert!(water > 0.03 && stone > 0.05 && section > 0.05, "{water} {stone} {section}");
    let [water, stone, section] = shares(&picture(here, "bath.rfm", &["--cut", "none"]));
    assert!(water == 0.0 && stone > 0.2 && section < 0.01, "{water} {stone} {section}");
    let [water, stone, section] = shares(&picture(here, "bath.rfm", &["--hide", "bowl"]));
    assert!(water > 0.03 && stone < 0.05 && section < 0.01, "{water} {stone} {section}");
    // seen from below everything is bowl again, above the plane that is asked for
    let flags = ["--camera", "0,0,-1", "--cut", "z=-0.55"];
    let [water, _, section] = shares(&picture(here, "bath.rfm", &flags));
    assert!(water == 0.0 && section > 0.2, "{water} {section}");
}

#[test]
#[ignore = "long"]
fn keys_and_flags_say_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let write = |entries: &str| {
        let text = BOWL.replace("  method", &format!("  picture {{ {entries} }}\n  method"));
        std::fs::write(here.join("bath.rfm"), text).unwrap();
    };
    for (entries, flags) in [
        ("camera: [1, -1, 2]", &["--camera", "1,-1,2"][..]),
        ("cut: none", &["--cut", "none"]),
        ("cut: x >= 10 cm, camera: [1, 0, 0.2]", &["--cut", "x=10cm", "--camera", "1,0,0.2"]),
        ("hide: [bowl, post]", &["--hide", "bowl,post"]),
        ("cut: auto", &[]),
    ] {
        write(entries);
        let stated = std::fs::read(picture(here, "bath.rfm", &[])).unwrap();
        std::fs::write(here.join("bath.rfm"), BOWL).unwrap();
        let asked = std::fs::read(picture(here, "bath.rfm", flags)).unwrap();
        assert!(stated == asked, "{entries}");
    }
    // a flag takes the place of a key
    write("cut: none");
    let [water, ..] = shares(&picture(here, "bath.rfm", &["--cut", "auto"]));
    assert!(water > 0.03, "{water}");
}

#[test]
fn obstacles_that_hide_little_stay_whole() {
    let folder = tempfile::tempdir().unwrap();
    let pawn = root().join("examples/pawn.rfm");
    let flags = ["-D", "particles=1000"];
    let [water, stone, section] = shares(&picture(folder.path(), pawn.to_str().unwrap(), &flags));
    assert!(water > 0.01 && stone > 0.02 && section == 0.0, "{water} {stone} {section}");
}

#[test]
fn a_run_says_what_its_pictures_miss() {
    let folder = tempfile::tempdir().unwrap();
    let text = "rfm 1
solid plate = ball([0.5, 0.5, 0.3], 0.3) or box([0.1, 0.1, 0.3], [0.9, 0.9, 0.3001])
scene drop {
  box { max: [1, 1, 1] }
  fluid { shape: ball([0.5, 0.5, 0.8], 0.1), spacing: 5 cm }
  obstacle { solid: plate }
  method: wcsph
  run { until: 1 ms, save_every: 1 ms }
}
";
    std::fs::write(folder.path().join("thin.rfm"), text).unwrap();
    let run = |flags: &[&str]| {
        let arguments = [&["run", "thin.rfm", "--steps", "1", "--force"], flags].concat();
        rfm(folder.path(), &arguments).expect(0).stderr
    };
    let missed = "its mesh and its pictures do not show all of what is thinner than two cells";
    let told = run(&["--mesh-cells", "16"]);
    assert!(told.contains(missed) && told.contains("`plate`") && told.contains("--mesh-cells"), "{told}");
    assert!(!run(&["--no-frames"]).contains(missed));
}

#[test]
fn flags_for_pictures_that_are_not_drawn_are_told_of() {
    let folder = tempfile::tempdir().unwrap();
    let text = "rfm 1\nscene s {\n  box { max: [1, 1, 1] }\n  fluid { shape: ball([0.5, 0.5, 0.5], 0.2), spacing: 0.1 }
  run { until: 1 ms, save_every: 1 ms }\n}\n";
    std::fs::write(folder.path().join("ball.rfm"), text).unwrap();
    let run = |flags: &[&str]| {
        let arguments = [&["run", "ball.rfm", "--steps", "1", "--force"], flags].concat();
        rfm(folder.path(), &arguments).expect(0).stderr
    };
    let told = run(&["--no-pictures", "--camera", "1,1,1"]);
    assert!(told.contains("--camera is of no effect: with --no-pictures there are no pictures"), "{told}");
    let told = run(&["--no-frames", "--cut", "none", "--surface"]);
    assert!(told.contains("--cut, --surface are of no effect: with --no-frames"), "{told}");
    assert!(!run(&["--no-pictures"]).contains("no effect"));
}

#[test]
fn a_plane_within_a_small_face_is_told_of() {
    let folder = tempfile::tempdir().unwrap();
    let text = "rfm 1\nsolid plate = box([0, 0, 0], [1, 1, 0.2]) \\ box([0.4, 0.4, 0.1], [0.45, 0.45, 1])
solid roof = polygon([[0, 0], [1, 0], [0.5, 0.5]]).extrude(0, 1).rotate_x(90 deg)\n";
    std::fs::write(folder.path().join("plate.rfm"), text).unwrap();
    let check = |solid: &str, plane: &str| {
        let arguments = ["check", "plate.rfm", "-s", solid, "--slice", plane, "-o", "s.svg"];
        rfm(folder.path(), &arguments).expect(0).stderr
    };
    assert!(check("plate", "z=0.1").contains("W0414"));
    assert!(check("plate", "z=0.11").is_empty());
    // a line is no face
    assert!(!check("roof", "z=0.5").contains("W0414"));
}

#[test]
#[ignore = "long"]
fn a_plane_within_a_face_shows_what_lies_outside_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let text = "rfm 1\nsolid step = box([0, 0, 0], [1, 1, 0.2]) or cylinder(0.3, 0.6).move([0.5, 0.5, 0])\n";
    std::fs::write(folder.path().join("step.rfm"), text).unwrap();
    let check = |plane: &str| {
        let outcome = rfm(folder.path(), &["check", "step.rfm", "--slice", plane, "-o", "s.svg"]).expect(0);
        (outcome.stderr, std::fs::read_to_string(folder.path().join("s.svg")).unwrap())
    };
    let (told, picture) = check("z=0.2");
    assert!(told.contains("W0414") && picture.contains("just outside its face"), "{told}");
    // the section is that of the cylinder above the plane
    let above = check("z=0.20001").1;
    let outline = |svg: &str| {
        let line = svg.lines().find(|line| line.contains(r#"stroke-width="1.8""#)).unwrap().to_string();
        line.matches(['C', 'L']).count()
    };
    assert!(outline(&picture).abs_diff(outline(&above)) <= 2 && outline(&picture) < 60);
    let (told, picture) = check("z=0.1");
    assert!(told.is_empty() && !picture.contains("outside its face"), "{told}");
    // so is that of distances, whose sign rounding would decide in the face itself
    let distances = ["check", "step.rfm", "--slice", "z=0.2", "--plot", "distance", "-o", "d.svg"];
    let told = rfm(folder.path(), &distances).expect(0).stderr;
    let picture = std::fs::read_to_string(folder.path().join("d.svg")).unwrap();
    assert!(told.contains("W0414") && picture.contains("just outside its face"), "{told}");
    assert!(!picture.contains("e-1") && !picture.contains("e−1"), "the bar has numbers of rounding");

    let outcome = rfm(folder.path(), &["check", "step.rfm", "--slice", "z=5", "--json"]).expect(0);
    assert_eq!(outcome.json()["diagnostics"][0]["code"], "W0413");
    assert!(outcome.stderr.is_empty(), "{}", outcome.stderr);
}

/// Colours are chosen before anything is known of the flow. At the end they fit it, and one scale holds for all
/// pictures.
#[test]
fn colours_fit_a_fluid_that_is_slower_than_was_expected() {
    let folder = tempfile::tempdir().unwrap();
    let scene = |picture: &str| {
        format!(
            "rfm 1
solid post = cylinder(0.1, 0.2).move([0.5, 0.5, 0])
scene rest {{
  box {{ max: [1, 1, 1] }}
  fluid {{ shape: ball([0.5, 0.5, 0.5], 0.2), spacing: 5 cm, velocity: [0.1*sin(20*x), 0, 0] }}
  obstacle {{ solid: post }}
  gravity: [0, 0, -0.3]
  method: wcsph
  run {{ until: 20 ms, save_every: 10 ms }}
  {picture}
}}
"
        )
    };
    let run = |name: &str, text: String| {
        let file = format!("{name}.rfm");
        std::fs::write(folder.path().join(&file), text).unwrap();
        let arguments = ["run", &file, "--threads", "1", "--mesh-cells", "16", "-o", name];
        rfm(folder.path(), &arguments).expect(0).stdout
    };
    let told = run("own", scene(""));
    let (_, end) = told.split_once("drawn again with colours up to ").unwrap_or_else(|| panic!("{told}"));
    let end = end.split_once(" m/s").unwrap().0;
    // and so do those of the state for ParaView
    let script = std::fs::read_to_string(folder.path().join("own/open_in_paraview.py")).unwrap();
    let (_, fastest) = script.split_once("FASTEST = ").unwrap();
    assert_eq!(fastest.split(' ').next().unwrap().parse::<f64>().unwrap(), end.parse::<f64>().unwrap());
    let stated = scene(&format!("picture {{ fastest: {end} m/s }}"));
    let told = run("stated", stated);
    assert!(!told.contains("drawn again"), "{told}");
    // all but the title is the same
    let pixels = |folder_of: &str, number: usize| {
        let path = folder.path().join(format!("{folder_of}/pictures/frame_{number:06}.png"));
        let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        pixels.split_off(pixels.len() / 12 / info.line_size * info.line_size)
    };
    for number in 0..3 {
        let [own, stated] = ["own", "stated"].map(|name| pixels(name, number));
        let differ = own.iter().zip(&stated).filter(|(a, b)| a.abs_diff(**b) > 8).count();
        assert!(differ < own.len() / 1000, "frame {number}: {differ} of {}", own.len());
    }
}
