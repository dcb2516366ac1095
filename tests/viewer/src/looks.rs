//! How a page begins, and what of a run it shows where.

use crate::cases::Room;
use crate::pictures::Picture;
use crate::program::{Viewer, rfm};

/// A function of the page: a point through a 4 × 4 matrix.
pub const APPLY: &str = "const apply = (m, p) => [0, 1, 2, 3].map((row) => m[row] * p[0] + m[4 + row] * p[1] + \
                         m[8 + row] * p[2] + m[12 + row] * (p[3] ?? 1));";

/// A gate that rises and a blade that turns.
const DAM: &str = "rfm 1\nsolid gate = box([0.6, 0, 0], [0.65, 1, 0.4]).move([0, 0, 2*t])\n\
                   solid blade = box([-0.02, -0.2, 0], [0.02, 0.2, 0.3]).rotate_z(10*t).move([0.25, 0.5, 0])\n\
                scene dam {\n  box { min: [0, 0, 0], max: [1, 1, 1] }\n  obstacle { solid: gate }\n  obstacle { solid: blade }\n  \
                fluid { shape: box([0, 0, 0], [0.6, 1, 0.3]), particles: 600 }\n  \
                run { until: 0.1 s, save_every: 0.05 s }\n}\n";

/// The part of the pixels that are blue: slow particles.
fn blue(picture: &Picture) -> f64 {
    picture.part(|[r, _, b]| b > r.saturating_add(40))
}

/// Runs a scene and opens its page, which is not played.
fn open(room: &mut Room, name: &str, text: &str) {
    let file = format!("{name}.rfm");
    let page = room.folder.join(format!("{name}.html"));
    if !page.exists() {
        std::fs::write(room.folder.join(&file), text).unwrap();
        rfm(&room.folder, &["run", &file, "--no-pictures", "--mesh-cells", "24"]);
        rfm(&room.folder, &["view", &format!("{name}.out"), "--save", &format!("{name}.html")]);
    }
    room.browser.open(&format!("file://{}", page.display()));
    room.browser.wait_for("window.viewer && viewer.timeline.playing");
    room.browser.eval("viewer.play(false)");
    room.place(0.0);
    room.scene();
}

/// Leaves a live page before its program ends: it would complain of that.
fn leave(room: &mut Room, viewer: Viewer) {
    room.browser.open("about:blank");
    drop(viewer);
}

/// The ratio of the lengths of two equal edges, the nearer over the farther one, is that of the distances from the eye.
/// The same figure stands in a test of src/render/camera.rs.
pub fn perspective(room: &mut Room) {
    open(room, "dam", DAM);
    room.browser.eval(
        "(() => { window.own = new viewer.camera.constructor(); own.frame({ min: [0, 0, 0], max: [3, 3, 3] }); own.look([0.6, -0.64, 0.48]); })()",
    );
    let ratio = format!(
        "(() => {{ {APPLY} const lens = own.projection([1280, 720], {{ left: 48, right: 150, top: 56, bottom: 72 }}); \
         const depth = (p) => apply(lens, apply(own.view(), p))[3]; return depth([0, 3, 0]) / depth([3, 0, 3]); }})()"
    );
    let zoomed = "(() => { own.zoom(0.2); own.pan(150, -40, 720); })()";
    for change in ["0", zoomed, zoomed] {
        room.browser.eval(change);
        let found = room.browser.number(&ratio);
        assert!((found - 1.396_665_022_888_28).abs() < 1e-5, "{found}");
    }
    let height = "(() => { own.parallel = true; return own.renderedHeight(own.box, own.axes().towards, own.centre); })()";
    let found = room.browser.number(height);
    assert!((found - 4.667_214_263_486).abs() < 1e-6, "{found}");
}

/// The camera, the cut and the colours of the scene; what is copied says the same.
pub fn stated(room: &mut Room) {
    let text = "rfm 1\nsolid post = cylinder(0.2, 0.5).move([0.5, 0.5, 0])\nscene drop {\n  \
                box { min: [0, 0, 0], max: [1, 1, 1.5] }\n  obstacle { solid: post }\n  \
                fluid { shape: ball([0.5, 0.5, 1], 0.25), particles: 500, fill: middle }\n  \
                run { until: 0.1 s, save_every: 0.05 s }\n  \
                picture { camera: [0, -1, 0.3], look_at: [0.5, 0.5, 0.8], zoom: 1.5, cut: y <= 0.45, fastest: 2 m/s }\n}\n";
    open(room, "stated", text);
    room.shot("stated");
    let key = "viewer.camera.key(viewer.look.boxBounds, [viewer.canvas.clientWidth, viewer.canvas.clientHeight], viewer.free())";
    // beside controls there is room for less than a picture
    let alone = "(viewer.showPanel(false), viewer.showPlots(false), 0)";
    room.browser.eval(alone);
    let own = room.browser.eval(key);
    assert_eq!(own, "picture { camera: [0, -0.9578, 0.2873], look_at: [0.5, 0.5, 0.8], zoom: 1.5 }");
    let look = "JSON.stringify([viewer.look.cut.map((x) => Number(x.toFixed(6))), viewer.look.cutFluid, viewer.look.range])";
    assert_eq!(room.browser.eval(look), "[[0,-1,0,-0.45],false,{\"low\":0,\"high\":2}]");
    // the way back leads there, too
    room.browser.drag((400.0, 300.0), (520.0, 260.0));
    room.browser.key("h");
    assert_eq!(room.browser.eval(key), own);
    let viewer = Viewer::start(&room.folder, &["stated.rfm"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.timeline.frames.length > 0 && viewer.meshes.length > 0");
    room.browser.eval(alone);
    assert_eq!(room.browser.eval(key), own);
    assert_eq!(room.browser.eval(look), "[[0,-1,0,-0.45],false,{\"low\":0,\"high\":2}]");
    leave(room, viewer);
    let parallel = text.replace("zoom: 1.5,", "zoom: 1.5, projection: parallel,");
    open(room, "parallel", &parallel);
    room.browser.eval(alone);
    let own = room.browser.eval(key);
    let said =
        "picture { camera: [0, -0.9578, 0.2873], look_at: [0.5, 0.5, 0.8], zoom: 1.5, projection: parallel }";
    assert_eq!(own, said);
    assert_eq!(room.browser.eval("document.getElementById('parallel').checked"), true);
}

/// Each obstacle has its own look: the scene says which are hidden and clear, and the page changes that.
pub fn bodies(room: &mut Room) {
    let own = DAM.replace("  run {", "  picture { cut: none, hide: gate, glass: blade }\n  run {");
    open(room, "bodies", &own);
    let looks = "viewer.setting.bodies.map((name, k) => name + ' ' + viewer.look.looks[k]).join()";
    assert_eq!(room.browser.eval(looks), "gate hidden,blade transparent");
    let both_away = {
        room.browser.choose("#body-1", "hidden");
        Picture::of(&room.scene())
    };
    room.browser.choose("#body-0", "as all");
    let with_gate = Picture::of(&room.scene());
    assert_eq!(room.browser.eval(looks), "gate opaque,blade hidden");
    assert!(with_gate.difference(&both_away) > 1.0, "{}", with_gate.difference(&both_away));
    room.shot("bodies");
    room.browser.choose("#obstacle", "hidden");
    assert!(Picture::of(&room.scene()).difference(&both_away) < 0.1);
}

/// A gate that rises and a blade that turns, between two frames.
pub fn between_frames(room: &mut Room) {
    open(room, "dam", DAM);
    assert_eq!(room.browser.number("viewer.meshes.length"), 1.0);
    for (place, time) in [(0.0, 0.0), (0.5, 0.025), (0.9, 0.045), (1.25, 0.0625), (2.0, 0.1)] {
        room.place(place);
        room.scene();
        // where a corner of each of them is
        let place = |part: usize, corner: [f64; 3]| {
            format!(
                "(() => {{ const m = viewer.scene.solid.poses?.[{part}] ?? [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0], p = {corner:?}; \
                 return [0, 1, 2].map((row) => m[row] * p[0] + m[3 + row] * p[1] + m[6 + row] * p[2] + m[9 + row]).join(' '); }})()"
            )
        };
        let mut at = |part: usize, corner: [f64; 3]| -> Vec<f64> {
            let told = room.browser.eval(&place(part, corner));
            told.as_str().unwrap().split(' ').map(|x| x.parse().unwrap()).collect()
        };
        let gate = at(0, [0.6, 0.0, 0.0]);
        assert!((gate[2] - 2.0 * time).abs() < 1e-4 && (gate[0] - 0.6).abs() < 1e-4, "{time}: {gate:?}");
        let tip = at(1, [0.25, 0.7, 0.0]);
        let (sin, cos) = (10.0 * time).sin_cos();
        let off = (tip[0] - (0.25 - 0.2 * sin)).hypot(tip[1] - (0.5 + 0.2 * cos));
        assert!(off < 1e-4, "{time}: {tip:?}");
    }
    room.place(0.9);
    room.shot("between-frames");
}

/// A bowl around its fluid, saved and while it is computed; a post is opaque.
pub fn container(room: &mut Room) {
    let text = "rfm 1\nsolid bowl = sphere(0.5)\nscene still {\n  box { min: [-0.6, -0.6, -0.6], max: [0.6, 0.6, 0.6] }\n  \
                container { solid: bowl }\n  fluid { shape: bowl and z <= 0, particles: 800, viscosity: 1 Pa·s, start: hydrostatic }\n  \
                run { until: 0.02 s, save_every: 0.01 s }\n}\n";
    open(room, "bowl", text);
    assert_eq!(room.browser.eval("document.getElementById('obstacle').value"), "transparent");
    let seen = Picture::of(&room.scene());
    room.shot("container");
    assert!(blue(&seen) > 0.02, "{}", blue(&seen));
    room.browser.choose("#obstacle", "opaque");
    let hidden = Picture::of(&room.scene());
    assert!(blue(&hidden) < 0.1 * blue(&seen), "{}", blue(&hidden));
    let viewer = Viewer::start(&room.folder, &["bowl.rfm"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.look.obstacle === 'transparent'");
    room.shot("container-live");
    leave(room, viewer);
    open(room, "dam", DAM);
    assert_eq!(room.browser.eval("viewer.look.obstacle"), "opaque");
}

/// A tank of 40 m: half a spacing is more than a metre.
pub fn large(room: &mut Room) {
    let text = "rfm 1\nsolid post = cylinder(6, 20).move([20, 20, 0])\nscene tank {\n  box { max: [40, 40, 40] }\n  \
                obstacle { solid: post }\n  fluid { shape: box([0, 0, 0], [12, 40, 16]), particles: 800 }\n  \
                run { until: 0.1 s, save_every: 0.05 s }\n}\n";
    open(room, "tank", text);
    assert!(room.browser.number("viewer.look.radius") > 1.0);
    let opaque = blue(&Picture::of(&room.scene()));
    room.shot("large");
    room.browser.choose("#obstacle", "hidden");
    let alone = blue(&Picture::of(&room.scene()));
    assert!(opaque > 0.02 && opaque > 0.7 * alone, "{opaque} {alone}");
}
