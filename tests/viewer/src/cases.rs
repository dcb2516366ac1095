//! What is tried.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use crate::browser::Browser;
use crate::pictures::{Picture, compare};
use crate::program::{Viewer, rfm};

const SIZE: (u32, u32) = (1100, 700);

/// What the cases share.
pub struct Room {
    pub browser: Browser,
    folder: PathBuf,
    shots: PathBuf,
}

type Case = fn(&mut Room);

pub const ALL: &[(&str, Case)] = &[
    ("a saved page opens from a file and plays", saved),
    ("a person turns, zooms, cuts and colours", handled),
    ("pictures and videos are saved", files),
    ("a page of a mesh", mesh),
    ("a page of moving obstacles and probes", moving),
    ("small windows and both themes", windows),
    ("a hundred thousand particles", many),
    ("a run is followed, stopped, stepped and begun again", live),
    ("the obstacle follows a slider", slider),
    ("the box turns and gravity stays", turned),
    ("a mistake in the file is shown and mended", mended),
    ("a solid without a scene", solid),
];

impl Room {
    pub fn prepare(program: &Path, folder: &Path, shots: &Path) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
        for name in ["pawn", "gate", "paddle"] {
            std::fs::copy(root.join(format!("{name}.rfm")), folder.join(format!("{name}.rfm"))).unwrap();
        }
        std::fs::write(
            folder.join("solid.rfm"),
            "rfm 1\nparam r = 5 cm in 1 cm .. 20 cm \"radius\"\nsolid hoop = torus(0.3, r)\n",
        )
        .unwrap();
        Self { browser: Browser::start(program, SIZE), folder: folder.into(), shots: shots.into() }
    }

    fn shot(&mut self, name: &str) -> Picture {
        let png = self.browser.screenshot();
        std::fs::write(self.shots.join(format!("{name}.png")), &png).unwrap();
        Picture::of(&png)
    }

    /// The scene alone, without text, which every system draws by its own letters.
    fn scene(&mut self) -> Vec<u8> {
        let data = self.browser.eval("(viewer.draw(), viewer.canvas.toDataURL('image/png'))");
        BASE64_STANDARD.decode(data.as_str().unwrap().split_once(',').unwrap().1).unwrap()
    }

    /// Saves a run and opens the page from its file.
    fn open_saved(&mut self, run: &str) {
        let page = self.folder.join(format!("{run}.html"));
        if !page.exists() {
            let (particles, until) =
                if run == "pawn" { ("particles=4000", "1") } else { ("particles=1500", "0.3") };
            let file = format!("{run}.rfm");
            let words =
                ["run", &file, "-D", particles, "--until", until, "--no-pictures", "--mesh-cells", "48"];
            rfm(&self.folder, &words);
            rfm(&self.folder, &["view", &format!("{run}.out"), "--save", &format!("{run}.html")]);
        }
        self.browser.open(&format!("file://{}", page.display()));
        self.browser.wait_for("window.viewer && viewer.timeline.playing");
        self.browser.eval("viewer.play(false)");
    }

    fn place(&mut self, place: f64) {
        self.browser
            .eval(&format!("viewer.timeline.place = {place}; viewer.timelineChanged(); viewer.changed()"));
    }
}

fn saved(room: &mut Room) {
    room.open_saved("pawn");
    assert_eq!(room.browser.number("viewer.timeline.frames.length"), 21.0);
    assert!(room.browser.eval("document.title").as_str().unwrap().contains("pawn.out"));
    room.place(9.0);
    room.shot("saved");
    let png = room.scene();
    compare("pawn", &png, &room.shots.clone());
    let picture = Picture::of(&png);
    assert!(picture.part(|[r, _, b]| b > r.saturating_add(40)) > 0.0002, "no slow particles are seen");
    let particles = room.browser.number("viewer.scene.drawn");
    assert!((3900.0..=4000.0).contains(&particles), "{particles}");

    let before = room.browser.number("viewer.timeline.place");
    room.browser.click("#play");
    room.browser.wait_for(&format!("viewer.timeline.place > {before} + 1"));
    room.browser.key(" ");
    room.browser.wait_for("!viewer.playing");
    // the slider of the time, by the mouse
    let (x, y) = room.browser.middle("#scrub");
    room.browser.drag((x - 100.0, y), (x, y));
    let place = room.browser.number("viewer.timeline.place");
    assert!((9.0..11.0).contains(&place), "{place}");
    room.browser.key("ArrowRight");
    room.browser.eval("document.querySelector('#scrub').blur()");
    room.browser.key("ArrowLeft");
    let whole = room.browser.number("viewer.timeline.place");
    assert_eq!(whole.fract(), 0.0);
    room.browser.key("0");
    assert_eq!(room.browser.number("viewer.timeline.place"), 0.0);
}

fn handled(room: &mut Room) {
    room.open_saved("pawn");
    room.place(9.0);
    let first = room.shot("handled-first");
    room.browser.drag((400.0, 300.0), (520.0, 260.0));
    let turned = room.shot("handled-turned");
    assert!(turned.difference(&first) > 0.5);
    room.browser.call(
        "Input.dispatchMouseEvent",
        serde_json::json!({ "type": "mouseWheel", "x": 400, "y": 300, "deltaX": 0, "deltaY": -300 }),
    );
    assert!(room.browser.number("viewer.camera.distance / viewer.camera.reach") < 3.0);
    room.browser.key("h");
    assert!(room.shot("handled-home").difference(&first) < 0.2, "home restores the view");

    let whole = Picture::of(&room.scene());
    room.browser.choose("#cut-axis", "y");
    let cut = Picture::of(&room.scene());
    room.shot("handled-cut");
    assert!(cut.difference(&whole) > 0.5, "{}", cut.difference(&whole));
    room.browser.choose("#cut-axis", "none");
    room.browser.choose("#obstacle", "transparent");
    room.shot("handled-transparent");
    room.browser.choose("#obstacle", "hidden");
    let without = Picture::of(&room.scene()).difference(&whole);
    println!("  a hidden obstacle changes a channel by {without:.2} of 255 on average");
    assert!(without > 0.5, "{without}");
    room.browser.choose("#obstacle", "opaque");

    for array in ["density", "pressure"] {
        room.browser.choose("#array", array);
        room.shot(&format!("handled-{array}"));
        assert!(Picture::of(&room.scene()).difference(&whole) > 0.05, "{array}");
    }
    room.browser.choose("#array", "speed");
    room.browser.choose("#map", "viridis");
    let coloured = Picture::of(&room.scene());
    assert!(coloured.difference(&whole) > 0.05);
    room.browser.choose("#map", "blue–yellow–red");
    for (key, name) in [("z", "from-above"), ("p", "parallel"), ("x", "along-x")] {
        room.browser.key(key);
        room.shot(&format!("handled-{name}"));
    }
    room.browser.key("?");
    room.shot("handled-help");
    room.browser.eval("document.querySelector('#help').close()");
    let size = room
        .browser
        .number("new Promise((done) => viewer.composed().toBlob((blob) => done(blob.size), 'image/png'))");
    assert!(size > 10_000.0, "{size}");
    let composed = room.browser.eval("viewer.composed().toDataURL('image/png')");
    let composed = composed.as_str().unwrap().split_once(',').unwrap().1.to_string();
    std::fs::write(room.shots.join("composed.png"), BASE64_STANDARD.decode(composed).unwrap()).unwrap();
}

/// What is handed to the user as a file: its ending and its length.
fn handed_over(room: &mut Room, begin: &str, end: &str) -> (String, f64) {
    room.browser.eval(
        "(viewer.save = (blob, ending) => (window.handed = [ending, blob.size]), window.handed = null, 0)",
    );
    room.browser.key(begin);
    if !end.is_empty() {
        // how much a second of video is depends on the machine
        room.browser.wait_for("viewer.film.bytes > 10000");
        room.browser.key(end);
    }
    room.browser.wait_for("window.handed");
    let ending = room.browser.eval("window.handed[0]").as_str().unwrap().to_string();
    (ending, room.browser.number("window.handed[1]"))
}

fn files(room: &mut Room) {
    room.open_saved("pawn");
    room.browser.eval("viewer.play(true)");
    let (ending, bytes) = handed_over(room, "s", "");
    assert!(ending == "png" && bytes > 10_000.0, "{ending}: {bytes} bytes");
    let (ending, bytes) = handed_over(room, "v", "v");
    assert!(ending == "webm" && bytes > 10_000.0, "{ending}: {bytes} bytes");
}

fn mesh(room: &mut Room) {
    rfm(&room.folder, &["mesh", "pawn.rfm", "-o", "solid.html", "--cells", "64"]);
    let page = room.folder.join("solid.html");
    room.browser.open(&format!("file://{}", page.display()));
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1");
    room.shot("mesh-page");
    let png = room.scene();
    compare("mesh", &png, &room.shots.clone());
}

fn moving(room: &mut Room) {
    room.open_saved("paddle");
    assert_eq!(room.browser.number("viewer.meshes.length"), 7.0);
    room.place(0.0);
    let first = Picture::of(&room.scene());
    room.place(6.0);
    room.shot("moving");
    assert!(Picture::of(&room.scene()).difference(&first) > 0.2);
    assert_eq!(room.browser.number("document.querySelectorAll('#plots canvas').length"), 1.0);
}

fn windows(room: &mut Room) {
    room.open_saved("pawn");
    room.place(12.0);
    room.browser.theme("dark");
    room.shot("dark");
    for (name, size) in [("phone", (390, 760)), ("low", (900, 420)), ("wide", (1800, 900))] {
        room.browser.resize(size);
        room.shot(&format!("window-{name}"));
        // nothing is cut off at the sides
        let outside = room.browser.number(
            "[...document.querySelectorAll('button, input, select, header, #panel')].filter((e) => { \
             const r = e.getBoundingClientRect(); return r.width > 0 && (r.left < -0.5 || r.right > innerWidth + 0.5); }).length",
        );
        assert_eq!(outside, 0.0, "{name}");
    }
    room.browser.theme("light");
    room.browser.resize(SIZE);
}

fn many(room: &mut Room) {
    room.open_saved("pawn");
    room.browser.eval(
        "(() => { const n = 100000, sites = new Uint16Array(3 * n), level = new Uint8Array(n); let seed = 1; \
         const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647; \
         for (let i = 0; i < n; i++) { for (let k = 0; k < 3; k++) sites[3 * i + k] = random() * (k === 2 ? 20000 : 65534); level[i] = random() * 254; } \
         const old = viewer.timeline.frames[0]; viewer.timeline.clear(); \
         viewer.look.radius = 0.006; \
         viewer.timeline.add({ ...old, count: n, sites, levels: old.levels.map(() => level) }); viewer.changed(); })()",
    );
    room.shot("many");
    let milliseconds = room.browser.number(
        "(() => { const gl = viewer.scene.gl, pixel = new Uint8Array(4), times = []; \
         for (let k = 0; k < 12; k++) { viewer.camera.orbit(5, 0); const began = performance.now(); viewer.draw(); \
         gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); times.push(performance.now() - began); } \
         return times.sort((a, b) => a - b)[6]; })()",
    );
    println!(
        "  100000 particles at {} × {}: {milliseconds:.0} ms per picture on the processor",
        SIZE.0, SIZE.1
    );
    assert_eq!(room.browser.number("viewer.scene.drawn"), 100_000.0);
}

fn live(room: &mut Room) {
    let viewer = Viewer::start(&room.folder, &["pawn.rfm", "-D", "particles=4000"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.timeline.frames.length > 5");
    room.browser.wait_for("viewer.meshes.length === 1 && viewer.scene.drawn > 3900");
    room.shot("live");
    room.browser.click("#play");
    room.browser.wait_for("!viewer.run.playing");
    std::thread::sleep(Duration::from_millis(300));
    let count = room.browser.number("viewer.timeline.frames.length");
    let step = room.browser.number("viewer.timeline.frames.at(-1).step");
    room.browser.click("#forward");
    room.browser.wait_for(&format!("viewer.timeline.frames.length > {count}"));
    assert_eq!(room.browser.number("viewer.timeline.frames.at(-1).step"), step + 1.0);
    room.browser.click("#restart");
    room.browser.wait_for("viewer.timeline.frames.length === 1 && viewer.timeline.frames[0].step === 0");
    room.browser.click("#play");
    room.browser.wait_for("viewer.timeline.frames.length > 3");
    // a second page sees the same run, and one that goes away disturbs nobody
    room.browser.open("about:blank");
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.timeline.frames.length > 3");
}

fn slider(room: &mut Room) {
    let viewer = Viewer::start(&room.folder, &["pawn.rfm", "-D", "particles=2000"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1 && viewer.timeline.frames.length > 1");
    room.browser.eval("viewer.play(false)");
    room.browser.wait_for("!viewer.run.playing");
    let mut times = Vec::new();
    for k in 0..9 {
        let began = Instant::now();
        room.browser.eval(&format!(
            "(() => {{ viewer.old = viewer.scene.shown.mesh; const track = document.getElementById('param-cx'); track.value = {}; \
             track.dispatchEvent(new Event('input')); }})()",
            1.0 + 0.1 * f64::from(k)
        ));
        room.browser.wait_for("viewer.scene.shown.mesh !== viewer.old");
        times.push(began.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_by(f64::total_cmp);
    println!("  from a slider to the picture: {:.0} ms, at most {:.0} ms", times[4], times[8]);
    let run = room.browser.number("viewer.run.number");
    let (x, y) = room.browser.middle("#param-cx");
    room.browser.drag((x, y), (x + 40.0, y));
    room.browser.wait_for(&format!("viewer.run.number > {run} && viewer.timeline.frames.length >= 1"));
    room.shot("slider");
    let value = room.browser.number("viewer.setting.params.find((p) => p.name === 'cx').value");
    assert!(value > 1.5, "{value}");
    room.browser.click("#params-reset");
    room.browser.wait_for("viewer.setting.params.find((p) => p.name === 'cx').value === 1.5");
}

fn turned(room: &mut Room) {
    let viewer = Viewer::start(&room.folder, &["pawn.rfm", "-D", "particles=1000"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.timeline.frames.length > 1");
    room.browser.choose("#drag", "turns the box");
    room.browser.drag((400.0, 300.0), (400.0, 90.0));
    let gravity =
        |room: &mut Room| ["0", "1", "2"].map(|k| room.browser.number(&format!("viewer.look.gravity[{k}]")));
    let [x, y, z] = gravity(room);
    let length = (x * x + y * y + z * z).sqrt();
    assert!((length - 9.81).abs() < 1e-3 && z > -9.0, "{x} {y} {z}");
    // the fluid goes where gravity points in the box
    room.browser.wait_for("viewer.timeline.frames.at(-1).time > 0.3");
    room.shot("turned");
    room.browser.choose("#gravity", "turns with the box");
    room.browser.wait_for("Math.abs(viewer.look.gravity[2] + 9.81) < 1e-6");
    room.browser.click("#upright");
    room.browser.wait_for("viewer.camera.turn[3] === 1");
}

fn mended(room: &mut Room) {
    let file = room.folder.join("edited.rfm");
    let good =
        std::fs::read_to_string(room.folder.join("pawn.rfm")).unwrap().replace("= 10000 in", "= 1000 in");
    std::fs::write(&file, &good).unwrap();
    let viewer = Viewer::start(&room.folder, &["edited.rfm"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1 && viewer.timeline.frames.length > 2");
    std::fs::write(&file, good.replace("waist(0.75)", "<b>waits</b>(0.75)")).unwrap();
    room.browser.wait_for("!document.getElementById('notice').hidden");
    room.shot("mistake");
    let notice = room.browser.eval("document.getElementById('notice').textContent");
    let notice = notice.as_str().unwrap();
    assert!(notice.contains("edited.rfm:") && notice.contains('^') && notice.contains("<b>"), "{notice}");
    assert_eq!(room.browser.number("document.querySelectorAll('#notice *').length"), 0.0);
    assert!(room.browser.number("viewer.scene.drawn") > 900.0, "the last good picture remains");
    std::fs::write(&file, good.replace("0.05)\n", "0.08)\n")).unwrap();
    let waited = room.browser.wait_for("document.getElementById('notice').hidden");
    println!("  mended after {:.0} ms", waited.as_secs_f64() * 1e3);
}

fn solid(room: &mut Room) {
    let viewer = Viewer::start(&room.folder, &["solid.rfm"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1");
    room.shot("solid");
    assert_eq!(room.browser.eval("document.querySelector('#value-r').value"), "5");
    room.browser.eval("viewer.old = viewer.scene.shown.mesh");
    room.browser.eval("(() => { const track = document.getElementById('param-r'); track.value = 0.1; track.dispatchEvent(new Event('input')); })()");
    room.browser.wait_for("viewer.scene.shown.mesh !== viewer.old");
}
