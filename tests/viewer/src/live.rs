//! Cases of pages that follow a run or a file that is edited.

use std::time::{Duration, Instant};

use crate::cases::Room;
use crate::program::Viewer;

pub fn live(room: &mut Room) {
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
    // a second page sees the same run, and one that goes away does not disturb the first
    room.browser.open("about:blank");
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.timeline.frames.length > 3");
}

pub fn slider(room: &mut Room) {
    let viewer = Viewer::start(&room.folder, &["pawn.rfm", "-D", "particles=2000"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1 && viewer.timeline.frames.length > 1");
    room.browser.eval("viewer.play(false)");
    room.browser.wait_for("!viewer.run.playing");
    room.browser.choose("#surface", "mesh");
    let mut times = Vec::new();
    for k in 0..9 {
        let began = Instant::now();
        room.browser.eval(&format!(
            "(() => {{ viewer.old = viewer.scene.shown.solid; const track = document.getElementById('param-cx'); track.value = {}; \
             track.dispatchEvent(new Event('input')); }})()",
            1.0 + 0.1 * f64::from(k)
        ));
        room.browser.wait_for("viewer.scene.shown.solid !== viewer.old");
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

/// 22 × 22 posts beside a fluid: a rough mesh follows at once, and the sharp one a little later.
pub fn posts(room: &mut Room) {
    let text = "rfm 1\nparam r = 0.03 in 0.01 .. 0.05\n\
                solid posts = any i in 0..22 : any j in 0..22 : cylinder(r, 0.5).move([0.1*i + 0.1, 0.1*j + 0.1, 0])\n\
                scene s {\n  box { min: [0, 0, 0], max: [2.3, 2.3, 1.5] }\n  obstacle { solid: posts }\n  \
                fluid water { shape: ball([1.1, 1.1, 1], 0.3), particles: 3000, viscosity: 0.1 }\n  method: wcsph\n  \
                run { until: 1 s, save_every: 0.05 s }\n}\n";
    std::fs::write(room.folder.join("posts.rfm"), text).unwrap();
    let viewer = Viewer::start(&room.folder, &["posts.rfm"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1 && viewer.timeline.frames.length > 3");
    for radius in [0.0342, 0.02, 0.04] {
        room.browser.eval("viewer.old = viewer.meshes[0]; viewer.told_run = viewer.run.number");
        let began = Instant::now();
        room.browser.eval(&format!(
            "(() => {{ const track = document.getElementById('param-r'); track.value = {radius}; \
             track.dispatchEvent(new Event('input')); track.dispatchEvent(new Event('change')); }})()"
        ));
        room.browser.wait_for("viewer.meshes[0] !== viewer.old");
        let shown = began.elapsed();
        let rough = room.browser.number("viewer.meshes[0].triangles");
        room.browser.wait_for(&format!("viewer.meshes[0].triangles > {rough}"));
        let sharp = began.elapsed();
        room.browser.wait_for("viewer.run.number > viewer.told_run && viewer.timeline.frames.length > 3");
        let said = room.browser.eval("document.getElementById('latency').textContent");
        println!(
            "  {:.0} ms, sharp after {:.0} ms: {said}",
            shown.as_secs_f64() * 1e3,
            sharp.as_secs_f64() * 1e3
        );
    }
    room.shot("posts");
}

pub fn refused(room: &mut Room) {
    let file = room.folder.join("refused.rfm");
    let good =
        std::fs::read_to_string(room.folder.join("pawn.rfm")).unwrap().replace("= 10000 in", "= 1000 in");
    std::fs::write(&file, &good).unwrap();
    let viewer = Viewer::start(&room.folder, &["refused.rfm"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1 && viewer.timeline.frames.length > 2");
    let type_in = |room: &mut Room, text: &str| {
        room.browser.eval(&format!(
            "(() => {{ const field = document.getElementById('value-cx'); field.focus(); field.value = '{text}'; \
             field.dispatchEvent(new Event('input')); field.dispatchEvent(new Event('change')); }})()"
        ));
    };
    let value = "document.getElementById('value-cx').value";
    type_in(room, "1.2");
    room.browser.wait_for("viewer.setting.params[0].value === 1.2");
    type_in(room, "9");
    room.browser.wait_for(&format!("!document.getElementById('notice').hidden && {value} === '1.2'"));
    room.shot("refused");
    // an edit of the file is shown
    std::fs::write(
        &file,
        good.replace("box      { min: [0, 0, 0], max: [3, 3, 3]", "box { min: [0, 0, 0], max: [3, 3, 4]"),
    )
    .unwrap();
    room.browser.wait_for("document.getElementById('notice').hidden && viewer.setting.box.max[2] > 3.9");
    type_in(room, "");
    room.browser.wait_for(&format!("{value} === '1.5'"));
}

pub fn turned(room: &mut Room) {
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
    room.browser.choose("#gravity", "with the box");
    room.browser.wait_for("Math.abs(viewer.look.gravity[2] + 9.81) < 1e-6");
    room.browser.click("#upright");
    room.browser.wait_for("viewer.camera.turn[3] === 1");
}

pub fn mended(room: &mut Room) {
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
    assert_eq!(room.browser.number("document.querySelectorAll('#notice :not(.quoted)').length"), 0.0);
    assert!(room.browser.number("viewer.scene.drawn") > 900.0, "the last good picture remains");
    std::fs::write(&file, good.replace("0.05)\n", "0.08)\n")).unwrap();
    let waited = room.browser.wait_for("document.getElementById('notice').hidden");
    println!("  mended after {:.0} ms", waited.as_secs_f64() * 1e3);

    // without its scene a file has no fluid, in this page and in one that is opened then
    std::fs::write(&file, "rfm 1\nsolid only = sphere(1)\n").unwrap();
    let shown = "viewer.timeline.frames.length === 0 && viewer.meshes.length === 1 && viewer.setting.box.max[2] < 1.2";
    for _ in 0..2 {
        room.browser.wait_for(&format!("window.viewer && {shown}"));
        assert_eq!(room.browser.eval("document.getElementById('transport').hidden"), true);
        let plots = room.browser.number("document.querySelectorAll('#plots canvas').length");
        assert_eq!(plots, 0.0, "plots of a fluid that is gone");
        room.browser.open(&viewer.address);
    }
    std::fs::write(&file, &good).unwrap();
    room.browser.wait_for("window.viewer && viewer.timeline.frames.length > 2");
    assert_eq!(room.browser.eval("document.getElementById('transport').hidden"), false);
}

pub fn solid(room: &mut Room) {
    let viewer = Viewer::start(&room.folder, &["solid.rfm"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1");
    room.shot("solid");
    let state = room.browser.eval("document.getElementById('state').textContent");
    assert_eq!(state, "", "nothing is starting");
    let off = room.browser.number("Math.hypot(...viewer.camera.centre)");
    assert!(off < 1e-3, "the hoop is in the middle of the picture, {off}");
    assert_eq!(room.browser.eval("document.querySelector('#value-r').value"), "5");
    room.browser.choose("#surface", "mesh");
    room.browser.eval("viewer.old = viewer.scene.shown.solid");
    room.browser.eval("(() => { const track = document.getElementById('param-r'); track.value = 0.1; track.dispatchEvent(new Event('input')); })()");
    room.browser.wait_for("viewer.scene.shown.solid !== viewer.old");
}

pub fn moving_solid(room: &mut Room) {
    let viewer = Viewer::start(&room.folder, &["paddle.rfm", "-s", "stirrer"]);
    room.browser.open(&viewer.address);
    // it moves by itself, and keeps a mesh of each instant as far as there is time for it: blades turn about
    // a shaft at rest
    room.browser.wait_for("window.viewer && viewer.run.playing && viewer.timeline.frames.length > 10");
    assert_eq!(room.browser.eval("document.getElementById('transport').hidden"), false);
    assert_eq!(room.browser.number("viewer.setting.arrays.length"), 0.0);
    room.browser.wait_for("viewer.meshes[0]?.time > 0.3");
    room.browser.click("#play");
    room.browser.wait_for("!viewer.run.playing");
    let same_instant = "viewer.meshes[0] && viewer.meshes[0].time === viewer.timeline.frames.at(-1)?.time";
    room.browser.wait_for(same_instant);
    let time = room.browser.number("viewer.timeline.frames.at(-1).time");
    room.browser.click("#forward");
    room.browser.wait_for(&format!("viewer.timeline.frames.at(-1).time > {time} && {same_instant}"));
    room.shot("moving-solid");
    // another value of a param leaves it where it is, and all turns fit into the box
    let time = room.browser.number("viewer.timeline.frames.at(-1).time");
    room.browser.eval(
        "(() => { const track = document.getElementById('param-period'); track.value = 3; \
         track.dispatchEvent(new Event('change')); })()",
    );
    room.browser.wait_for("viewer.setting.params.find((p) => p.name === 'period').value === 3");
    room.browser.wait_for(same_instant);
    assert_eq!(room.browser.number("viewer.timeline.frames.at(-1).time"), time);
    let reach = room.browser.number("viewer.setting.box.max[0]");
    assert!((0.3..0.33).contains(&reach), "{reach}");
    room.browser.click("#restart");
    room.browser.wait_for("viewer.timeline.frames.length === 1 && viewer.timeline.frames[0].time === 0");

    // one that goes away is left before it is out of sight, and begins again; with a fluid the same file is another one
    let file = room.folder.join("pellet.rfm");
    let pellet = "rfm 1\nsolid pellet = sphere(0.05).move([20*t, 0, 0])\n";
    std::fs::write(&file, pellet).unwrap();
    let viewer = Viewer::start(&room.folder, &["pellet.rfm"]);
    room.browser.open(&viewer.address);
    // words and frames come apart; its way ends at the greatest 1024/2^k s in which it takes up no more than
    // twelve diameters
    let at_end = "!viewer.run.playing && document.getElementById('state').textContent === 'paused at the end of its way' \
                  && viewer.timeline.frames.at(-1)?.time === 0.03125";
    room.browser.wait_for(&format!("window.viewer && {at_end}"));
    let count = room.browser.number("viewer.timeline.frames.length");
    room.browser.click("#forward");
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert_eq!(room.browser.number("viewer.timeline.frames.length"), count, "there is nothing more to show");
    let run = room.browser.number("viewer.run.number");
    room.browser.click("#play");
    room.browser.wait_for(&format!("viewer.run.number > {run} && {at_end}"));
    let scene = "scene s { box { min: [-1, -1, -1], max: [1, 1, 1] } fluid { shape: sphere(0.3), spacing: 0.1 } run { until: 1 } }\n";
    std::fs::write(&file, format!("{pellet}{scene}")).unwrap();
    room.browser.wait_for(
        "viewer.setting.arrays.length > 0 && viewer.timeline.frames.length > 0 && viewer.scene.drawn > 0",
    );
}

/// What moves as one is meshed once, and frames say where it is.
pub fn carried(room: &mut Room) {
    let file = room.folder.join("vane.rfm");
    let vane = "rfm 1\nsolid vane = box([-0.3, -0.05, 0], [0.3, 0.05, 0.4]).rotate_z(2*t)\nsolid hub = sphere(0.2)\n";
    std::fs::write(&file, vane).unwrap();
    let viewer = Viewer::start(&room.folder, &["vane.rfm", "-s", "vane"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.carried && viewer.timeline.frames.length > 10");
    room.browser.choose("#surface", "mesh");
    room.browser.click("#play");
    room.browser.wait_for("!viewer.run.playing");
    let angles = "Math.max(...viewer.timeline.frames.map(({ time, poses: [pose] }) => Math.abs(pose[1] - Math.sin(2 * time))))";
    assert!(room.browser.number(angles) < 1e-9);
    // earlier instants show it where it was
    room.browser.eval("(viewer.timeline.place = 3, viewer.timelineChanged(), viewer.draw())");
    let shown =
        "JSON.stringify(viewer.scene.parts.solid.poses) === JSON.stringify(viewer.timeline.frames[3].poses)";
    assert_eq!(room.browser.eval(shown), true);
    assert_eq!(room.browser.eval("viewer.scene.shown.solid === viewer.carried"), true);

    // of several solids one is chosen in the page
    let viewer = Viewer::start(&room.folder, &["vane.rfm"]);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1");
    assert_eq!(room.browser.eval("viewer.setting.solids.join()"), "hub,vane");
    room.browser.choose("#solid", "vane");
    room.browser.wait_for("viewer.setting.solids.join() === 'vane,hub' && viewer.carried");
    // a file that is gone is reported, and read when it is back
    std::fs::remove_file(&file).unwrap();
    room.browser.wait_for("document.getElementById('notice').textContent.includes('not there any more')");
    std::fs::write(&file, vane).unwrap();
    room.browser.wait_for("document.getElementById('notice').hidden");
}
