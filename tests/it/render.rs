//! `rfm render`: what its pictures show, what its films hold, and what it refuses.

use std::io::Cursor;
use std::path::Path;
use std::process::Command;

use rfm::fluid_surface::read_arrays;

use crate::tool::rfm;

const SCENE: &str = "rfm 1
solid post = cylinder(0.2, 0.5).move([0.5, 0.5, 0])
solid moon = sphere(0.15).move([0.2, 0.2, 1.2])
scene drop {
  box { min: [0, 0, 0], max: [1, 1, 1.5] }
  fluid { shape: ball([0.5, 0.5, 1], 0.25), particles: 800, fill: middle }
  obstacle { solid: post }
  obstacle { solid: moon }
  run { until: 0.1 s, save_every: 0.02 s }
}
";

/// A solid that goes from the left to the right.
const SWING: &str = "rfm 1\nsolid swing = sphere(0.2).move([2*t, 0, 0])\n";

/// Runs the scene: six frames, 0.02 s apart, in `drop.out`.
fn run(here: &Path) {
    std::fs::write(here.join("drop.rfm"), SCENE).unwrap();
    rfm(here, &["run", "drop.rfm", "--no-pictures", "--mesh-cells", "24"]).expect(0);
}

/// The pixels of a PNG.
fn pixels(file: &[u8]) -> Vec<u8> {
    let mut reader = png::Decoder::new(Cursor::new(file)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    pixels
}

/// The parts of a picture 640 wide, without its colour bar, that are blue, red, and of the colour of stone and of
/// sections.
fn shares(picture: &Path) -> [f64; 4] {
    let pixels = pixels(&std::fs::read(picture).unwrap());
    let count = |is: &dyn Fn(i32, i32, i32) -> bool| {
        let rows = pixels.chunks(3 * 640).flat_map(|row| row[..3 * 540].chunks(3));
        let found = rows.filter(|p| is(p[0].into(), p[1].into(), p[2].into())).count();
        found as f64 / (pixels.len() / 3) as f64
    };
    [
        count(&|r, _, b| b > r + 40),
        count(&|r, g, b| r > g + 90 && r > b + 90),
        count(&|r, _, b| (8..25).contains(&(r - b)) && r < 235),
        count(&|r, g, b| (40..90).contains(&(r - b)) && r - g < 60),
    ]
}

#[test]
fn pictures_of_solids_say_what_they_do_not_show() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(
        here.join("thin.rfm"),
        "rfm 1\nsolid thin = sphere(1) or box([0, -0.5, 0], [3, 0.5, 0.004])\n",
    )
    .unwrap();
    let drawn = rfm(here, &["render", "thin.rfm", "--size", "320x180"]).expect(0);
    assert!(drawn.stderr.contains("--mesh-cells"), "{}", drawn.stderr);
    std::fs::write(here.join("ball.rfm"), "rfm 1\nsolid ball = sphere(1)\n").unwrap();
    let drawn = rfm(here, &["render", "ball.rfm", "--size", "320x180"]).expect(0);
    assert!(!drawn.stderr.contains("note"), "{}", drawn.stderr);
    let aside = rfm(here, &["render", "ball.rfm", "--size", "320x180", "--look-at", "100,0,0"]).expect(0);
    assert!(aside.stderr.contains("lies outside of the box that is drawn"), "{}", aside.stderr);
}

#[test]
#[ignore = "long"]
fn every_frame_becomes_a_picture_with_the_same_bytes_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here);
    for target in ["frames", "drop.gif", "drop.apng"] {
        let made = |threads: &str| {
            let flags =
                ["render", "drop.out", "-o", target, "--size", "320x240", "--threads", threads, "--json"];
            let document = rfm(here, &flags).expect(0).json();
            assert_eq!((&document["pictures"], &document["by"]), (&6.into(), &"speed".into()));
            let file = |name: String| std::fs::read(here.join(name)).unwrap();
            let frames: Vec<Vec<u8>> = match target {
                "frames" => (0..6).map(|k| file(format!("frames/frame_{k:06}.png"))).collect(),
                film => vec![file(film.into())],
            };
            frames
        };
        assert!(made("1") == made("2"), "{target}");
    }
    let apng = std::fs::read(here.join("drop.apng")).unwrap();
    let still = std::fs::read(here.join("frames/frame_000000.png")).unwrap();
    assert!(pixels(&apng) == pixels(&still), "a program without animation shows the first frame");
    let reader = png::Decoder::new(Cursor::new(&apng)).read_info().unwrap();
    assert_eq!(reader.info().animation_control.unwrap().num_frames, 6);
    let gif = std::fs::read(here.join("drop.gif")).unwrap();
    let mut decoder = gif::DecodeOptions::new().read_info(&gif[..]).unwrap();
    assert_eq!((decoder.width(), decoder.height()), (320, 240));
    let mut delays = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        delays.push(frame.delay);
    }
    assert_eq!(delays, [4; 6]);
    // frames of every 20 ms
    let speed = |flags: &[&str], told: &str| {
        let mut arguments = vec!["render", "drop.out", "-o", "a.gif", "--size", "64x48"];
        arguments.extend(flags);
        let stdout = rfm(here, &arguments).expect(0).stdout;
        assert!(stdout.contains(told), "{flags:?}: {stdout}");
    };
    speed(&[], "it shows the fluid slowed down 2.0 times");
    speed(&["--fps", "50"], "it shows the fluid as fast as it was");
    speed(&["--fps", "50", "--every", "2"], "it shows the fluid 2.0 times as fast as it was");
}

#[test]
fn frames_are_chosen_by_number_time_and_step() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here);
    let count = |flags: &[&str]| {
        let mut arguments = vec!["render", "drop.out", "-o", "a.gif", "--size", "64x48", "--json"];
        arguments.extend(flags);
        rfm(here, &arguments).expect(0).json()["pictures"].as_u64().unwrap()
    };
    assert_eq!(count(&["--frames", "2..5"]), 3);
    assert_eq!(count(&["--every", "4"]), 2);
    assert_eq!(count(&["--times", "40ms..0.08"]), 3);
    assert_eq!(count(&["--times", "..0.05", "--every", "2"]), 2);
    // the numbers of files are those of the frames
    rfm(here, &["render", "drop.out", "--frames", "3.."]).expect(0);
    let first = pixels(&std::fs::read(here.join("drop.out/render/frame_000003.png")).unwrap());
    assert_eq!(first.len(), 3 * 1280 * 720);
    assert!(!here.join("drop.out/render/frame_000002.png").exists());
}

#[test]
fn colours_have_the_range_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here);
    let file = std::fs::read(here.join("drop.out/frames/particles_000005.vtp")).unwrap();
    let (_, arrays) = read_arrays(&file).unwrap();
    let speeds = &arrays.iter().find(|array| array.name == "speed").unwrap().values;
    let fastest = speeds.iter().copied().fold(0.0, f64::max);
    let slowest = speeds.iter().copied().fold(f64::INFINITY, f64::min);
    let picture = |flags: &[&str]| {
        let mut arguments = vec!["render", "drop.out", "-o", "one.png", "--frames", "5", "--size", "640x480"];
        arguments.extend(flags);
        rfm(here, &arguments).expect(0);
        shares(&here.join("one.png"))
    };
    let [blue, red, ..] = picture(&["--range", &format!("{fastest}..{}", fastest + 9.0)]);
    assert!(blue > 0.01 && red == 0.0, "all below the range: {blue} {red}");
    let [blue, red, ..] = picture(&["--range", &format!("{}..{slowest}", slowest - 9.0)]);
    assert!(blue == 0.0 && red > 0.01, "all above the range: {blue} {red}");
    let [blue, red, ..] =
        picture(&["--range", &format!("{}..{slowest}", slowest - 9.0), "--colours", "grey"]);
    assert!(blue == 0.0 && red == 0.0, "grey: {blue} {red}");
    let [blue, red, ..] = picture(&["--by", "density", "--range", "5000..6000"]);
    assert!(blue > 0.01 && red == 0.0, "densities of water are low there: {blue} {red}");
}

#[test]
#[ignore = "long"]
fn the_surface_of_the_fluid_has_the_colours_of_particles_and_is_cut() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here);
    rfm(here, &["mesh", "drop.out", "--fluid", "--frames", "5..6"]).expect(0);
    let picture = |flags: &[&str]| {
        let mut arguments = vec!["render", "drop.out", "-o", "one.png", "--frames", "5", "--size", "640x480"];
        arguments.extend(flags);
        rfm(here, &arguments).expect(0);
        here.join("one.png")
    };
    // the middle of the fluid, which a cut opens, is paler than its surface
    let opened = |picture: &Path| {
        let pixels = pixels(&std::fs::read(picture).unwrap());
        let is_pale = |p: &&[u8]| p[0] > 100 && (50..90).contains(&(i32::from(p[2]) - i32::from(p[0])));
        pixels.chunks(3).filter(is_pale).count()
    };
    let [blue, red, ..] = shares(&picture(&["--surface=opaque", "--cut", "none"]));
    assert!(blue > 0.01 && red == 0.0, "water: {blue} {red}");
    let whole = opened(&here.join("one.png"));
    let cut = opened(&picture(&["--surface=opaque", "--cut", "y=0.5"]));
    assert!(cut > 1500 && cut > 10 * whole, "{cut} {whole}");
    for kind in ["--surface=opaque", "--surface"] {
        let red = ["--by", "speed", "--range", "-9..-8", "--cut", "none"];
        let [blue, red, ..] = shares(&picture(&[&[kind][..], &red].concat()));
        assert!(blue < 0.001 && (red > 0.01 || kind == "--surface"), "{kind}: {blue} {red}");
    }
    // particles stay in front of a section unless they are cut, too, and none stands out of the plane then
    let shown =
        |flags: &[&str]| shares(&picture(&[&["--by", "speed", "--range", "-9..-8"], flags].concat()))[1];
    let (whole, cut) = (shown(&["--cut", "y=0.5"]), shown(&["--cut", "y=0.5", "--cut-fluid"]));
    assert!(cut > 0.2 * whole && cut < 0.95 * whole, "{cut} {whole}");
    assert!(shown(&["--cut", "y=2", "--cut-fluid"]) == 0.0);
    for flags in [&["--cut-fluid"][..], &["--cut", "auto", "--cut-fluid"]] {
        let words = [&["render", "drop.out", "-o", "x.png", "--frames", "5"], flags].concat();
        rfm(here, &words).expect(2);
    }
    // a run draws its own
    let run = |out: &str, flags: &[&str]| {
        let first = ["run", "drop.rfm", "-o", out, "--steps", "1"];
        rfm(here, &[&first[..], flags].concat()).expect(0);
        std::fs::read(here.join(out).join("pictures/frame_000000.png")).unwrap()
    };
    let blue = |file: &[u8]| {
        let is_blue = |p: &&[u8]| i32::from(p[2]) > i32::from(p[0]) + 70;
        pixels(file).chunks(3).filter(is_blue).count()
    };
    let (particles, surface) = (run("a", &[]), run("b", &["--surface=opaque"]));
    assert!(particles != surface && blue(&surface) > 5000, "{}", blue(&surface));
    assert!(run("c", &["--surface"]) != surface);
}

#[test]
#[ignore = "long"]
fn obstacles_are_hidden_by_name_and_cut() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here);
    let stone = |flags: &[&str]| {
        let mut arguments = vec!["render", "drop.out", "-o", "one.png", "--frames", "0", "--size", "640x480"];
        arguments.extend(flags);
        rfm(here, &arguments).expect(0);
        shares(&here.join("one.png"))
    };
    let [_, _, all, section] = stone(&["--cut", "none"]);
    let [_, _, no_moon, _] = stone(&["--cut", "none", "--hide", "moon"]);
    let [_, _, nothing, _] = stone(&["--cut", "none", "--hide", "moon,post"]);
    assert!(nothing < 0.002 && no_moon > 0.01 && all > no_moon + 0.003, "{all} {no_moon} {nothing}");
    assert!(section < 0.002);
    let [.., opened] = stone(&["--cut", "y=0.5"]);
    assert!(opened > 0.01, "{opened}");
    // zoomed in on the post, it fills more of the picture
    let [_, _, near, _] = stone(&["--cut", "none", "--look-at", "0.5,0.5,0.25", "--zoom", "2"]);
    assert!(near > 1.8 * all, "{near} {all}");
    // the direction as the viewer copies it
    let of = |camera: &str| {
        rfm(here, &["render", "drop.out", "-o", "one.png", "--frames", "0", "--camera", camera]).expect(0);
        std::fs::read(here.join("one.png")).unwrap()
    };
    assert!(of("0.1,-1,0.3") == of("picture { camera: [0.1, -1, 0.3] }"));
    assert!(of("0.1,-1,0.3") != of("1,-1,0.3"));
    // and with the place in the middle and the size; flags go before them
    let whole = "picture { camera: [0.1, -1, 0.3], look_at: [0.5, 0.5, 0.25], zoom: 2 }";
    let aimed = of(whole);
    assert!(aimed != of("0.1,-1,0.3"));
    let by = |flags: &[&str]| {
        let first = ["render", "drop.out", "-o", "two.png", "--frames", "0"];
        rfm(here, &[&first[..], flags].concat()).expect(0);
        std::fs::read(here.join("two.png")).unwrap()
    };
    assert!(aimed == by(&["--camera", "0.1,-1,0.3", "--look-at", "0.5,0.5,0.25", "--zoom", "2"]));
    assert!(by(&["--camera", whole, "--zoom", "1", "--look-at", "0.5,0.5,0.75"]) != aimed);
    // a scene states the same keys for the pictures of its run
    let file = std::fs::read_to_string(here.join("drop.rfm")).unwrap();
    std::fs::create_dir(here.join("seen")).unwrap();
    let stated = file.replacen("fluid", &format!("{whole}\n  fluid"), 1);
    std::fs::write(here.join("seen/drop.rfm"), stated).unwrap();
    let run = |file: &str, out: &str, flags: &[&str]| {
        let first = ["run", file, "-o", out, "--steps", "1"];
        rfm(here, &[&first[..], flags].concat()).expect(0);
        std::fs::read(here.join(out).join("pictures/frame_000000.png")).unwrap()
    };
    assert!(run("seen/drop.rfm", "a", &[]) == run("drop.rfm", "b", &["--camera", whole]));
    assert!(
        run("seen/drop.rfm", "c", &["--camera", "0.1,-1,0.3"]) != run("drop.rfm", "d", &["--camera", whole])
    );
}

#[test]
fn a_solid_is_one_picture() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("drop.rfm"), SCENE).unwrap();
    let document = rfm(here, &["render", "drop.rfm", "--size", "640x480", "--json"]).expect(0).json();
    assert_eq!(document["file"], "post.png");
    let [_, _, stone, section] = shares(&here.join("post.png"));
    assert!(stone > 0.1 && section < 0.002, "{stone} {section}");
    let cut = ["render", "drop.rfm", "-s", "moon", "-o", "m.png", "--cut", "y=0.2", "--size", "640x480"];
    rfm(here, &cut).expect(0);
    let [.., section] = shares(&here.join("m.png"));
    assert!(section > 0.1, "{section}");
}

#[test]
fn refusals_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here);
    std::fs::write(here.join("swing.rfm"), SWING).unwrap();
    let cases: [(&[&str], &str); 25] = [
        (&["drop.out", "-o", "a.jpg"], ".jpg is none of .png .gif .apng .mp4 .webm"),
        (&["drop.out", "-o", "a.png"], "`a.png` is one picture, and there are 6 frames"),
        (&["drop.out", "-o", "a.gif", "--fps", "60"], "50 is the most"),
        (&["drop.out", "--fps", "30"], "--fps is for films"),
        (&["drop.out", "--size", "640"], "expected WIDTHxHEIGHT"),
        (&["drop.out", "--range", "3..1"], "the first number must be the lower one"),
        (&["drop.out", "--times", "5..6"], "no frame lies there; they go from 0 s to 0.1"),
        (&["drop.out", "--times", "0..1", "--frames", "0..1"], "cannot be used with"),
        (&["drop.out", "--frames", "3..90"], "there are 6 frames"),
        (&["drop.out", "--by", "sped"], "did you mean `speed`?"),
        (&["drop.out", "--hide", "sun"], "there is post, moon"),
        (&["drop.out", "--zoom", "0"], "expected a number from 0.05 to 20"),
        (&["drop.out", "--solid", "post"], "--solid is for a solid of a file"),
        (&["drop.rfm", "--by", "speed"], "--by is for the folder of a run"),
        (&["drop.rfm", "-o", "a.gif"], "`post` does not move"),
        (&["drop.rfm", "--times", "0..1"], "--times is for films"),
        (&["swing.rfm", "-o", "a.gif", "--times", "0.."], "begins and ends"),
        (&["swing.rfm", "-o", "a.gif", "--times", "..-1"], "begins and ends"),
        (&["swing.rfm", "-o", "a.gif", "--times", "0..1e9"], "100000 is the most; --fps"),
        (&["swing.rfm", "-o", "a.gif", "--time", "1"], "--times A..B are those of a film"),
        (&["drop.rfm", "--cut", "auto"], "choose a plane"),
        (&["nothing.rfm"], "there is no file `nothing.rfm`"),
        (&["nothing", "--frames", "1"], "there is no file `nothing`"),
        (&["drop.rfn"], "did you mean `drop.rfm`?"),
        (&["drop.out", "-o", "no/such/a.gif"], "does not exist"),
    ];
    for (arguments, reason) in cases {
        let outcome = rfm(here, &[&["render"], arguments].concat()).expect(2);
        assert!(outcome.stderr.contains(reason), "{arguments:?}: {}", outcome.stderr);
        assert!(!here.join("drop.out/render").exists(), "{arguments:?}");
    }
    // a run without its summary does not know the names of its obstacles, and is drawn all the same
    std::fs::remove_file(here.join("drop.out/summary.json")).unwrap();
    let outcome = rfm(here, &["render", "drop.out", "--hide", "post"]).expect(2);
    assert!(outcome.stderr.contains("does not name its obstacles"), "{}", outcome.stderr);
    rfm(here, &["render", "drop.out", "-o", "a.gif", "--size", "64x48"]).expect(0);
    // a damaged frame is named, and nothing is left half-written
    std::fs::write(here.join("drop.out/frames/particles_000002.vtp"), "nonsense").unwrap();
    let outcome = rfm(here, &["render", "drop.out", "-o", "b.gif"]).expect(2);
    assert!(outcome.stderr.contains("particles_000002.vtp"), "{}", outcome.stderr);
    assert!(!here.join("b.gif").exists());
    std::fs::remove_dir_all(here.join("drop.out/frames")).unwrap();
    let outcome = rfm(here, &["render", "drop.out"]).expect(2);
    assert!(outcome.stderr.contains("is missing"), "{}", outcome.stderr);
}

#[cfg(unix)]
#[test]
fn videos_are_handed_to_the_program_of_the_system() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here);
    let tools = here.join("tools");
    std::fs::create_dir(&tools).unwrap();
    let of_size = |size: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rfm"));
        command.args(["render", "drop.out", "-o", "a.mp4", "--size", size, "--fps", "10"]);
        command.current_dir(here).env("PATH", &tools).output().unwrap()
    };
    let render = || of_size("64x48");
    let outcome = render();
    let text = String::from_utf8_lossy(&outcome.stderr).into_owned();
    assert!(outcome.status.code() == Some(2) && text.contains("write .gif or .apng"), "{text}");
    // a program that keeps its arguments and its input
    let script = |body: &str| {
        let path = tools.join("ffmpeg");
        std::fs::write(&path, format!("#!/bin/sh\n[ \"$1\" = -version ] && exit 0\n{body}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    };
    script("echo \"$@\" > told\n/bin/cat > given\nfor last; do :; done\necho film > \"$last\"");
    let outcome = render();
    assert!(outcome.status.success(), "{}", String::from_utf8_lossy(&outcome.stderr));
    assert_eq!(std::fs::metadata(here.join("given")).unwrap().len(), 6 * 3 * 64 * 48);
    let told = std::fs::read_to_string(here.join("told")).unwrap();
    assert!(told.contains("-s 64x48 -r 10 -i pipe:0") && told.contains("libx264"), "{told}");
    assert_eq!(std::fs::read_to_string(here.join("a.mp4")).unwrap(), "film\n");
    assert!(!told.contains("pad="), "{told}");
    // colours are stored for squares of four pixels: an odd size gets a border
    let outcome = of_size("65x49");
    let note = String::from_utf8_lossy(&outcome.stderr).into_owned();
    assert!(outcome.status.success() && note.contains("white border and has 66x50"), "{note}");
    let told = std::fs::read_to_string(here.join("told")).unwrap();
    assert!(told.contains("-s 65x49") && told.contains("-vf pad=66:50:0:0:white"), "{told}");
    // one that fails: its last words are shown, and the film that was there stays
    script("echo 'Unknown encoder libx264' >&2\nexit 1");
    let outcome = render();
    let text = String::from_utf8_lossy(&outcome.stderr).into_owned();
    assert!(outcome.status.code() == Some(2) && text.contains("Unknown encoder libx264"), "{text}");
    assert_eq!(std::fs::read_to_string(here.join("a.mp4")).unwrap(), "film\n");
}

#[test]
fn an_obstacle_that_moves_is_drawn_where_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let still = "sphere(0.15).move([0.2, 0.2, 1.2])";
    assert!(SCENE.contains(still));
    // it leaves the picture within the run
    let moving = SCENE.replace(still, "sphere(0.15).move([0.2, 0.2, 1.2 + 20*t])");
    std::fs::write(here.join("drop.rfm"), moving).unwrap();
    rfm(here, &["run", "drop.rfm", "--no-pictures", "--mesh-cells", "24"]).expect(0);
    let render = |target: &str, others: &[&str]| {
        let flags = ["--size", "640x480", "--cut", "none", "--hide", "post", "--range", "50..60"];
        rfm(here, &[&["render", "drop.out", "-o", target], &flags[..], others].concat()).expect(0);
    };
    render("all", &[]);
    let stone = |k: usize| shares(&here.join(format!("all/frame_{k:06}.png")))[2];
    assert!(stone(0) > 0.005 && stone(5) < 0.001, "{} {}", stone(0), stone(5));
    // a frame alone is the same picture
    render("one.png", &["--frames", "1"]);
    let bytes = |name: &str| std::fs::read(here.join(name)).unwrap();
    assert!(bytes("one.png") == bytes("all/frame_000001.png"));
}

#[test]
fn a_solid_that_moves_becomes_a_film() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("swing.rfm"), SWING).unwrap();
    let render = |target: &str, others: &[&str]| {
        let flags = [
            "render",
            "swing.rfm",
            "--size",
            "640x480",
            "--mesh-cells",
            "24",
            "--camera=0,-1,0.1",
            "-o",
            target,
        ];
        rfm(here, &[&flags[..], others].concat()).expect(0)
    };
    let told = render("all", &["--times", "0..1", "--fps", "4"]);
    assert!(told.stdout.contains("5 pictures of 640 × 480, from 0 s to 1 s"), "{}", told.stdout);
    // where stone is seen: all pictures have one camera, whose box holds the whole way
    let middle = |k: usize| {
        let pixels = pixels(&std::fs::read(here.join(format!("all/frame_{k:06}.png"))).unwrap());
        let stones = pixels
            .chunks(3)
            .enumerate()
            .filter(|(_, p)| (8..25).contains(&(i32::from(p[0]) - i32::from(p[2]))));
        let columns: Vec<f64> = stones.map(|(i, _)| (i % 640) as f64).collect();
        columns.iter().sum::<f64>() / columns.len() as f64
    };
    let middles = [0, 1, 2, 3, 4].map(middle);
    assert!(middles.is_sorted() && middles[4] - middles[0] > 300.0, "{middles:?}");
    for threads in ["1", "2"] {
        render(&format!("{threads}.gif"), &["--times", "0..0.5", "--fps", "4", "--threads", threads]);
    }
    let bytes = |name: &str| std::fs::read(here.join(name)).unwrap();
    assert!(bytes("1.gif") == bytes("2.gif") && bytes("1.gif").len() > 1000);
}

/// Glass that is cut open looks different, and the title says where it was cut.
#[test]
fn glass_is_cut_open_like_stone() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here);
    let render = |target: &str, others: &[&str]| {
        let flags =
            ["render", "drop.out", "-o", target, "--frames", "0", "--size", "640x480", "--title", "drop"];
        rfm(here, &[&flags[..], others].concat()).expect(0);
        std::fs::read(here.join(target)).unwrap()
    };
    let whole = render("whole.png", &["--glass", "post,moon", "--cut", "none"]);
    let open = render("open.png", &["--glass", "post,moon", "--cut", "y=0.3"]);
    let hidden = render("hidden.png", &["--hide", "post,moon"]);
    assert!(whole != open && open != hidden);
    // what stands before the plane is gone altogether: the moon, which reaches to y = 0.35 only
    let before = render("before.png", &["--glass", "moon", "--hide", "post", "--cut", "y=0.4"]);
    assert!(before == hidden);
}
