//! What is tried.

use std::path::{Path, PathBuf};
use std::time::Instant;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use crate::browser::Browser;
use crate::exact;
use crate::live;
use crate::looks::{self, APPLY};
use crate::pictures::{Picture, compare};
use crate::program::{Viewer, rfm};
use crate::shaders;

const SIZE: (u32, u32) = (1100, 700);

/// The height in metres of what `rfm render` leaves to the scene, for a cube of 3 m from the direction (0.6,
/// −0.64, 0.48).
const RENDERED_HEIGHT: f64 = 4.692_309_429_472;

/// What the cases share.
pub struct Room {
    pub browser: Browser,
    pub folder: PathBuf,
    pub shots: PathBuf,
}

type Case = fn(&mut Room);

pub const ALL: &[(&str, Case)] = &[
    ("a saved page opens from a file and plays", saved),
    ("a person turns, zooms, cuts and colours", handled),
    ("pictures and videos are saved", files),
    ("a page of a mesh", mesh),
    ("a page of moving obstacles and probes", moving),
    ("the surface of the fluid, and what is carried along, cut open", surface),
    ("plots of energy, audit and probes follow a run and stand in its page", plots),
    ("a slice of ω, cut open there, follows its slider and the obstacle", slice),
    ("arrows and trails show where the fluid goes", motion),
    ("the camera is copied as `rfm render` and a scene read it", camera),
    ("lines that go away from the eye meet as in `rfm render`", looks::perspective),
    ("a page begins as the scene states it", looks::stated),
    ("obstacles between frames are where they were then", looks::between_frames),
    ("each obstacle has a look of its own", looks::bodies),
    ("a container that hides the fluid begins transparent", looks::container),
    ("particles of metres are seen beside an obstacle", looks::large),
    ("the page of a report opens from a file", report),
    ("small windows and both themes", windows),
    ("a hundred thousand particles", many),
    ("solids as GLSL have the numbers of `rfm eval`", shaders::shaders),
    ("a run is followed, stopped, stepped and begun again", live::live),
    ("the obstacle follows a slider", live::slider),
    ("hundreds of posts follow a slider", live::posts),
    ("a value that the file refuses gives way to the last good one", live::refused),
    ("the exact surface agrees with the mesh", exact::beside_the_mesh),
    ("the exact surface moves with time", exact::in_motion),
    ("the exact surface of what is thin, and a mesh where there is none", exact::thin),
    ("ranges of ω on the graphics processor hold its values", exact::ranges),
    ("the box turns and gravity stays", live::turned),
    ("a mistake in the file is shown and mended", live::mended),
    ("a solid without a scene", live::solid),
    ("a solid that moves without a scene", live::moving_solid),
    ("what moves as one is carried along, and one of several solids is chosen", live::carried),
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

    pub fn shot(&mut self, name: &str) -> Picture {
        let png = self.browser.screenshot();
        std::fs::write(self.shots.join(format!("{name}.png")), &png).unwrap();
        Picture::of(&png)
    }

    /// The scene alone, without text, which every system draws by its own letters.
    pub fn scene(&mut self) -> Vec<u8> {
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

    pub fn place(&mut self, place: f64) {
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
    assert!(room.browser.number("viewer.camera.height / viewer.camera.reach") < 1.8);
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
    // the energy, the audit in per cent and its speed, and the height of the scene's probe
    assert_eq!(room.browser.number("document.querySelectorAll('#plots canvas').length"), 4.0);
}

/// A blade that turns within the water, with the surface of the fluid: its mesh is there once, and sections are closed.
fn surface(room: &mut Room) {
    let text = "rfm 1\nsolid blade = box([-0.2, -0.05, 0.1], [0.2, 0.05, 0.3]).rotate_z(3*t)\nscene stirred {\n  \
                box { min: [-0.3, -0.3, 0], max: [0.3, 0.3, 0.6] }\n  obstacle { solid: blade }\n  \
                fluid { shape: box([-0.3, -0.3, 0], [0.3, 0.3, 0.35]), particles: 1500 }\n  \
                run { until: 0.2 s, save_every: 0.1 s }\n}\n";
    std::fs::write(room.folder.join("stirred.rfm"), text).unwrap();
    rfm(&room.folder, &["run", "stirred.rfm", "--no-pictures"]);
    rfm(&room.folder, &["mesh", "stirred.out", "--fluid"]);
    rfm(&room.folder, &["view", "stirred.out", "--save", "stirred.html"]);
    room.browser.open(&format!("file://{}", room.folder.join("stirred.html").display()));
    room.browser.wait_for("window.viewer && viewer.timeline.playing");
    room.browser.eval("viewer.play(false)");
    room.place(2.0);
    assert_eq!(
        room.browser.eval("[viewer.meshes.length, viewer.surfaces.length, viewer.look.particles].join()"),
        "1,3,false"
    );
    room.shot("surface");
    room.browser.choose("#cut-axis", "y");
    room.browser.choose("#water", "opaque");
    let blue = |picture: &Picture| picture.part(|[r, _, b]| b > r.saturating_add(40));
    let orange = |picture: &Picture| picture.part(|[r, _, b]| r > b.saturating_add(40));
    let cut = Picture::of(&room.scene());
    room.shot("surface-cut");
    assert!(blue(&cut) > 0.02 && orange(&cut) > 0.003, "{} {}", blue(&cut), orange(&cut));
    // particles behind the plane do not stand out of the section of the blade
    room.browser.choose("#water", "hidden");
    let alone = Picture::of(&room.scene());
    room.browser.click("#particles-shown");
    let among = Picture::of(&room.scene());
    room.shot("surface-particles");
    assert!(orange(&alone) - orange(&among) < 0.05 * orange(&alone), "{} {}", orange(&alone), orange(&among));
    // it is where the frame says
    room.browser.choose("#cut-axis", "none");
    room.browser.click("#particles-shown");
    let late = Picture::of(&room.scene());
    room.place(0.0);
    assert!(Picture::of(&room.scene()).difference(&late) > 0.2);
}

/// What stands in plots is within them, and they are within the window.
fn assert_plots_fit(room: &mut Room) {
    let outside = room.browser.number(
        "viewer.plots.plots.filter(({ canvas, legend, x, last }) => { const box = canvas.getBoundingClientRect(); \
         const list = document.getElementById('plots'); \
         return box.left < 0 || box.width < 268 || list.scrollWidth > list.clientWidth || x(last) > 268 || \
         legend.places.some(([left]) => left + legend.width > 264); }).length",
    );
    assert_eq!(outside, 0.0);
}

fn plots(room: &mut Room) {
    room.open_saved("pawn");
    room.place(9.0);
    room.shot("plots");
    let names =
        room.browser.eval("viewer.plots.plots.map(({ name, unit }) => `${name}, ${unit}`).join('; ')");
    assert_eq!(names.as_str().unwrap(), "energy, J; audit, %; audit, m/s");
    assert_plots_fit(room);
    // ten samples from frame to frame, and the sum of the energies is their total
    assert!(room.browser.number("viewer.plots.plots[0].times.length") > 150.0);
    let off = room.browser.number(
        "Math.max(...viewer.plots.plots[0].columns[3].values.map((total, k) => \
         Math.abs(total - [0, 1, 2].reduce((sum, c) => sum + viewer.plots.plots[0].columns[c].values[k], 0)) / total))",
    );
    assert!(off < 1e-4, "{off}");
    // the fluid falls from rest
    assert_eq!(room.browser.number("viewer.plots.plots[0].columns[0].values[0]"), 0.0);
    // a click goes to its time
    let (x, y) = room.browser.middle("#plots canvas");
    room.browser.drag((x, y), (x, y));
    let (time, clicked) =
        (room.browser.number("viewer.timeline.time"), room.browser.number("viewer.plots.plots[0].at(134)"));
    assert!((time - clicked).abs() < 0.02, "{time} {clicked}");
    room.browser.key("d");
    assert_eq!(room.browser.number("document.querySelector('#plots').getBoundingClientRect().height"), 0.0);
    room.browser.key("d");
    numbers(room);

    let viewer = Viewer::start(&room.folder, &["paddle.rfm", "-D", "particles=1500"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for(
        "window.viewer && viewer.plots.plots.length === 4 && viewer.plots.plots[0].times.length > 8",
    );
    let last = room.browser.number("viewer.plots.plots[0].times.at(-1)");
    room.browser.wait_for(&format!("viewer.plots.plots[0].times.at(-1) > {last} + 0.02"));
    room.browser.click("#play");
    // the last sample is sent when the run pauses
    room.browser.wait_for("!viewer.run.playing && viewer.plots.plots[0].times.at(-1) === Number(viewer.timeline.frames.at(-1).time.toPrecision(6))");
    room.shot("plots-live");
    assert_plots_fit(room);
    let hidden = room.browser.number(
        "document.getElementById('plots').scrollHeight - document.getElementById('plots').clientHeight",
    );
    assert!(hidden <= 0.0, "four plots of usual size are seen whole, and {hidden} pixels are not");
    room.browser.click("#restart");
    room.browser.wait_for("viewer.plots.plots[0].times.length === 1");
    room.browser.theme("dark");
    room.browser.click("#play");
    room.browser.wait_for("viewer.plots.plots[0].times.length > 20");
    room.shot("plots-dark");
    room.browser.theme("light");
}

/// A level that hardly changes: its numbers differ, and so do those of the times; what is typed is seen whole.
fn numbers(room: &mut Room) {
    let texts = room.browser.eval(
        "(() => { const plot = { name: 'level', unit: 'm', times: [0, 1], columns: [{ name: 'height', values: [0.3, 0.3007] }] }; \
         viewer.plots.set([plot]); viewer.plots.draw(0, viewer.look.colours, 1); return viewer.plots.plots[0].numbers.join(' '); })()",
    );
    assert_eq!(texts.as_str().unwrap(), "0.3 0.3005");
    let clipped = room.browser.number(
        "[...document.querySelectorAll('#low, #high')].filter((field) => { field.value = '-0.01862'; \
         return field.scrollWidth > field.clientWidth; }).length",
    );
    assert_eq!(clipped, 0.0);
}

fn slice(room: &mut Room) {
    let viewer = Viewer::start(&room.folder, &["pawn.rfm", "-D", "particles=2000"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1 && viewer.timeline.frames.length > 8");
    room.browser.eval("viewer.play(false)");
    room.browser.wait_for("!viewer.run.playing");
    let before = Picture::of(&room.scene());
    room.browser.choose("#slice-axis", "y");
    room.browser.wait_for("viewer.look.slice?.axis === 1");
    assert_eq!(room.browser.eval("viewer.look.cutting.axis"), "y");
    assert!((room.browser.number("viewer.look.slice.at") - 1.5).abs() < 1e-9);
    room.shot("slice");
    let cut = Picture::of(&room.scene());
    assert!(cut.difference(&before) > 2.0);
    // orange inside, blue outside
    assert!(cut.part(|[r, _, b]| r > b.saturating_add(60)) > 0.003);
    assert!(cut.part(|[r, _, b]| b > r.saturating_add(25)) > 0.03);
    // the values are those of `rfm eval` in the same plane
    for line in ["0.1,1.5,0.3", "1.5,1.5,0.5", "2,1.5,2.9", "1.3,1.5,1.2"] {
        let at: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        let told = rfm(&room.folder, &["eval", "pawn.rfm", "--at", line, "--json"]);
        let told: serde_json::Value = serde_json::from_str(&told).unwrap();
        let exact = told["points"][0]["omega"].as_f64().unwrap_or_else(|| panic!("{told}"));
        // bilinear between four nodes, a hundredth apart
        let found = room.browser.number(&format!(
            "(() => {{ const s = viewer.look.slice, u = ({} - s.min[0]) / (s.max[0] - s.min[0]) * (s.columns - 1), \
             v = ({} - s.min[1]) / (s.max[1] - s.min[1]) * (s.rows - 1), i = Math.min(Math.floor(u), s.columns - 2), \
             j = Math.min(Math.floor(v), s.rows - 2), w = (a, b) => s.values[(j + b) * s.columns + i + a], f = u - i, g = v - j; \
             return (w(0, 0) * (1 - f) + w(1, 0) * f) * (1 - g) + (w(0, 1) * (1 - f) + w(1, 1) * f) * g; }})()",
            at[0], at[2]
        ));
        assert!((found - exact).abs() < 2e-3 * exact.abs().max(1.0), "{line}: {found} {exact}");
    }
    // a param that moves the pawn moves its section
    room.browser.eval("viewer.oldSlice = viewer.look.slice");
    room.browser.eval("(() => { const track = document.getElementById('param-cx'); track.value = 2; track.dispatchEvent(new Event('input')); })()");
    room.browser.wait_for("viewer.look.slice !== viewer.oldSlice");
    let began = Instant::now();
    room.browser.eval("(() => { viewer.oldSlice = viewer.look.slice; const track = document.getElementById('slice-at'); track.value = 0.4; track.dispatchEvent(new Event('input')); })()");
    room.browser
        .wait_for("viewer.look.slice !== viewer.oldSlice && Math.abs(viewer.look.slice.at - 1.2) < 1e-9");
    println!("  from the slider of a slice to the picture: {:.0} ms", began.elapsed().as_secs_f64() * 1e3);
    room.shot("slice-moved");
    for axis in ["x", "z"] {
        room.browser.choose("#slice-axis", axis);
        room.browser.wait_for(&format!("viewer.look.slice?.axis === 'xyz'.indexOf('{axis}')"));
        room.shot(&format!("slice-{axis}"));
    }
    room.browser.choose("#slice-axis", "none");
    room.browser.wait_for("!viewer.look.slice && viewer.look.cutting.axis === 'none'");
}

fn motion(room: &mut Room) {
    room.open_saved("pawn");
    room.place(9.0);
    let before = Picture::of(&room.scene());
    room.browser.key("a");
    room.shot("arrows");
    let arrows = Picture::of(&room.scene());
    assert!(arrows.difference(&before) > 0.2, "{}", arrows.difference(&before));
    assert!(room.browser.number("viewer.scene.motion.drawn") >= 2000.0);
    // velocities are those of the frames: their length is the speed
    let off = room.browser.number(
        "(() => { const f = viewer.timeline.frames[9], value = (k, i) => f.ranges[k].low + f.levels[k][i] / 254 * (f.ranges[k].high - f.ranges[k].low); \
         let most = 0; for (let i = 0; i < f.count; i++) { const v = viewer.look.velocity.map((k) => value(k, i)); \
         most = Math.max(most, Math.abs(Math.hypot(...v) - value(0, i))); } return most / f.ranges[0].high; })()",
    );
    assert!(off < 0.02, "{off}");
    room.browser.key("a");
    room.browser.key("t");
    room.shot("trails");
    let trails = Picture::of(&room.scene());
    assert!(trails.difference(&before) > 0.2, "{}", trails.difference(&before));
    // a thousand particles and more, each with a piece from frame to frame
    assert!(room.browser.number("viewer.scene.motion.ways.count") >= 900.0 * 9.0 * 2.0);
    room.browser
        .eval("(() => { viewer.look.particles = false; viewer.look.arrows = true; viewer.changed(); })()");
    room.shot("arrows-trails");
    // in the run that is computed, too
    let viewer = Viewer::start(&room.folder, &["pawn.rfm", "-D", "particles=2000"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.timeline.frames.length > 12");
    room.browser.key("a");
    room.browser.key("t");
    room.browser.wait_for("viewer.scene.motion.drawn > 900 && viewer.scene.motion.ways.count > 10000");
    room.shot("motion-live");
}

fn camera(room: &mut Room) {
    room.open_saved("pawn");
    room.place(9.0);
    room.browser.drag((560.0, 300.0), (640.0, 260.0));
    room.browser
        .eval("(() => { viewer.camera.pan(-60, 40, 700); viewer.camera.zoom(0.5); viewer.copyCamera(); })()");
    let key = "viewer.camera.key(viewer.look.boxBounds, [viewer.canvas.clientWidth, viewer.canvas.clientHeight], viewer.free())";
    let key = room.browser.eval(key).as_str().unwrap().to_string();
    println!("  {key}");
    room.shot("camera");
    rfm(
        &room.folder,
        &[
            "render",
            "pawn.out",
            "-o",
            "camera-render.png",
            "--frames",
            "9",
            "--camera",
            &key,
            "--cut",
            "none",
        ],
    );
    std::fs::copy(room.folder.join("camera-render.png"), room.shots.join("camera-render.png")).unwrap();
    // what is in the middle of the one is in the middle of the other, as large
    let file = std::fs::read_to_string(room.folder.join("pawn.rfm")).unwrap();
    let scene = file.replacen("fluid ", &format!("{key}\n  fluid "), 1);
    assert_ne!(file, scene);
    std::fs::write(room.folder.join("seen.rfm"), scene).unwrap();
    rfm(&room.folder, &["check", "seen.rfm"]);
    let room_height = room.browser.number(&format!(
        "(() => {{ {APPLY} const free = viewer.free(), size = [viewer.canvas.clientWidth, viewer.canvas.clientHeight]; \
         const {{ camera }} = viewer, lens = camera.projection(size, free), view = camera.view(), {{ up }} = camera.axes(); \
         const at = (part) => {{ const [, y, , w] = apply(lens, apply(view, camera.target.map((x, k) => x + part * up[k]))); \
         return 0.5 * size[1] * y / w; }}; return (size[1] - free.top - free.bottom) / (at(0.5) - at(-0.5)); }})()"
    ));
    let told = room.browser.eval("document.getElementById('state').textContent");
    assert!(told.as_str().unwrap().contains("; beside it: --cut none"), "{told}");
    let zoom: f64 = key.rsplit_once("zoom: ").unwrap().1.trim_end_matches(" }").parse().unwrap();
    let rendered = room.browser.number(
        "viewer.camera.renderedHeight(viewer.look.boxBounds, viewer.camera.axes().towards, viewer.camera.target)",
    );
    // the same figure stands in a test of src/render/camera.rs
    let whole = room.browser.number(
        "viewer.camera.renderedHeight({ min: [0, 0, 0], max: [3, 3, 3] }, [0.6, -0.64, 0.48], [1.5, 1.5, 1.5])",
    );
    assert!((whole - RENDERED_HEIGHT).abs() < 1e-6, "{whole}");
    assert!((rendered / zoom / room_height - 1.0).abs() < 1e-3, "{rendered} {zoom} {room_height}");
}

fn report(room: &mut Room) {
    rfm(&room.folder, &["report", "pawn.rfm", "--mesh-cells", "32", "--html", "report.html"]);
    let page = room.folder.join("report.html");
    room.browser.open(&format!("file://{}", page.display()));
    room.browser.wait_for("document.images.length === 4 && [...document.images].every((i) => i.complete)");
    // every drawing is one, nothing but the file was asked for, and nothing is wider than the window
    assert_eq!(room.browser.number("[...document.images].filter((i) => i.naturalWidth < 300).length"), 0.0);
    let asked = "performance.getEntriesByType('resource').filter((r) => !r.name.startsWith('data:')).length";
    assert_eq!(room.browser.number(asked), 0.0);
    for (name, size) in [("report", SIZE), ("report-phone", (390, 760))] {
        room.browser.resize(size);
        assert!(room.browser.number("document.documentElement.scrollWidth - innerWidth") <= 0.0, "{name}");
        room.shot(name);
        room.browser.eval("scrollTo(0, 700)");
        room.shot(&format!("{name}-below"));
        room.browser.eval("scrollTo(0, document.body.scrollHeight)");
        room.shot(&format!("{name}-end"));
        room.browser.eval("scrollTo(0, 0)");
    }
    room.browser.resize(SIZE);
    room.browser.theme("dark");
    room.shot("report-dark");
    room.browser.theme("light");
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
