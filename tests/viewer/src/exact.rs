//! The exact surface of obstacles, by rays: beside the mesh, after a slider, in motion, cut, and too thin for a mesh.

use std::time::Instant;

use crate::cases::Room;
use crate::pictures::Picture;
use crate::program::Viewer;
use crate::shaders::FORMULAS;

/// Pixels of a silhouette that may have no neighbour in the other one, of a thousand of it.
const MOST_ALONE: f64 = 1.0;

fn open(room: &mut Room, arguments: &[&str]) -> Viewer {
    let viewer = Viewer::start(&room.folder, arguments);
    room.browser.open(&viewer.address);
    room.browser.wait_for("window.viewer && viewer.meshes.length === 1 && viewer.field");
    room.browser.eval(
        "(viewer.play(false), Object.assign(viewer.look, { box: false, particles: false }), viewer.changed(), 0)",
    );
    viewer
}

/// The obstacle alone, by rays or as a mesh.
fn surface(room: &mut Room, kind: &str) -> Picture {
    room.browser.choose("#surface", kind);
    let said = room.browser.eval("(viewer.draw(), document.getElementById('surface-said').textContent)");
    let expected = if kind == "exact" { "exact, by rays" } else { "mesh" };
    assert!(said.as_str().unwrap().starts_with(expected), "{said}");
    Picture::of(&room.scene())
}

/// Where something else than the background is seen.
fn silhouette(picture: &Picture) -> Vec<bool> {
    let paper = &picture.rgb[..3];
    picture.rgb.chunks_exact(3).map(|p| (0..3).any(|i| p[i].abs_diff(paper[i]) > 8)).collect()
}

/// The pixels of a silhouette, and those of them around which the other picture has none, each of the greater.
fn compare(a: &Picture, b: &Picture) -> (usize, usize) {
    let (width, height) = (a.width as isize, a.height as isize);
    let (a, b) = (silhouette(a), silhouette(b));
    let alone = |one: &[bool], other: &[bool]| {
        let near = |i: usize| {
            let (x, y) = (i as isize % width, i as isize / width);
            (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy))).any(|(x, y)| {
                (0..width).contains(&x) && (0..height).contains(&y) && other[(y * width + x) as usize]
            })
        };
        (0..one.len()).filter(|&i| one[i] && !near(i)).count()
    };
    let count = |one: &[bool]| one.iter().filter(|seen| **seen).count();
    (count(&a).max(count(&b)), alone(&a, &b).max(alone(&b, &a)))
}

/// The exact surface beside the mesh: their outlines agree, and so do their colours away from edges.
fn agree(room: &mut Room, what: &str) {
    let (exact, mesh) = (surface(room, "exact"), surface(room, "mesh"));
    let (size, alone) = compare(&exact, &mesh);
    let differs = exact.difference(&mesh) * exact.rgb.len() as f64 / (3 * size) as f64;
    println!("  {what}: {size} pixels, {alone} of them alone; colours differ by {differs:.2} of 255");
    assert!(size > 2000, "{what}: {size} pixels");
    assert!(alone as f64 <= 1e-3 * MOST_ALONE * size as f64, "{what}: {alone} of {size}");
    assert!(differs < 6.0, "{what}: {differs}");
}

pub fn beside_the_mesh(room: &mut Room) {
    let _viewer = open(room, &["pawn.rfm", "-D", "particles=1000", "--mesh-cells", "192"]);
    agree(room, "the pawn");
    room.browser.choose("#surface", "exact");
    room.shot("exact");
    room.browser.key("p");
    agree(room, "in parallel projection");
    room.browser.key("p");
    room.browser.choose("#cut-axis", "y");
    agree(room, "cut open");
    room.browser.choose("#surface", "exact");
    room.shot("exact-cut");
    room.browser.choose("#cut-axis", "none");
    room.browser.drag((400.0, 300.0), (480.0, 420.0));
    agree(room, "seen from below");
    room.browser.key("h");

    // a slider moves it without a mesh, and both are the same once it is let go
    room.browser.choose("#surface", "exact");
    let (mesh, run) = ("viewer.scene.shown.solid", room.browser.number("viewer.run.number"));
    room.browser.eval(&format!("(viewer.old = {mesh}, 0)"));
    let mut times = Vec::new();
    let slide = |room: &mut Room, event: &str, value: f64| {
        room.browser.eval(&format!(
            "(() => {{ const track = document.getElementById('param-cx'); track.value = {value}; \
             track.dispatchEvent(new Event('{event}')); }})()"
        ));
    };
    let before = Picture::of(&room.scene());
    for k in 0..9 {
        let began = Instant::now();
        slide(room, "input", 1.0 + 0.1 * f64::from(k));
        times.push(began.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_by(f64::total_cmp);
    println!("  from a slider to the picture: {:.0} ms, at most {:.0} ms", times[4], times[8]);
    let moved = Picture::of(&room.scene()).difference(&before);
    assert!(moved > 0.2, "{moved}");
    assert_eq!(room.browser.eval(&format!("viewer.old === {mesh}")), true);
    slide(room, "change", 2.0);
    room.browser.wait_for(&format!("viewer.run.number > {run} && viewer.meshes[0] !== viewer.old"));
    room.browser.eval("(viewer.play(false), 0)");
    agree(room, "after a slider");
}

pub fn in_motion(room: &mut Room) {
    let _viewer = open(room, &["paddle.rfm", "-D", "particles=500", "--mesh-cells", "192"]);
    room.browser.wait_for("!viewer.run.playing");
    // while it plays its mesh may be older than its frame; at rest, and after a step, it belongs to the same instant
    let same_instant = "viewer.meshes[0] && viewer.meshes[0].time === viewer.timeline.frames.at(-1)?.time";
    room.browser.wait_for(same_instant);
    let time = room.browser.number("viewer.timeline.frames.at(-1).time");
    room.browser.click("#forward");
    room.browser.wait_for(&format!("viewer.timeline.frames.at(-1).time > {time} && {same_instant}"));
    agree(room, "a paddle");
    room.shot("exact-moving");
}

pub fn thin(room: &mut Room) {
    // a plate of a tenth of a millimetre, a wire, and thick ones with the same outline; a param that decides
    // how it is built
    let scene = |thick: f64, wire: f64| {
        format!(
            "rfm 1\nparam n = 3 in 1 .. 6\nparam lean = 0.3 in 0 .. 1\nlet turned = [lean, 0, 0]\n\
             solid plate = box([-0.5, {}, -0.4], [0.5, 0, 0.4]).move(turned) or \
             any i in 0..n: cylinder({wire}, 0.9).move([0.2*i - 0.2, 0.1, -0.45])\n",
            -thick
        )
    };
    std::fs::write(room.folder.join("thin.rfm"), scene(1e-4, 4e-3)).unwrap();
    let _viewer = open(room, &["thin.rfm"]);
    assert_eq!(room.browser.eval("viewer.field.fixed.join()"), "n");
    room.browser.eval("(viewer.camera.look([0, -1, 0]), 0)");
    let seen = surface(room, "exact");
    room.shot("exact-thin");
    let paper = silhouette(&seen);
    // no row through the plate has a gap in it
    let gaps = paper.chunks(seen.width).filter(|row| {
        let (first, last) = (row.iter().position(|seen| *seen), row.iter().rposition(|seen| *seen));
        first.zip(last).is_some_and(|(a, b)| b - a > seen.width / 4 && row[a..=b].iter().any(|seen| !seen))
    });
    assert_eq!(gaps.count(), 0);
    assert!(paper.iter().filter(|seen| **seen).count() > 50_000);
    // seen along the plate its wires have no gaps either
    room.browser.eval("(viewer.camera.look([0, 0, 1]), 0)");
    assert!(silhouette(&surface(room, "exact")).iter().filter(|seen| **seen).count() > 300);
    // the number of wires has no uniform: the mesh is shown until the file is read again
    room.browser.eval("(viewer.old = viewer.scene.shown.solid, document.getElementById('param-n').value = 5, document.getElementById('param-n').dispatchEvent(new Event('input')))");
    room.browser.wait_for("viewer.scene.shown.solid !== viewer.old");
    let said = room.browser.eval("document.getElementById('surface-said').textContent");
    assert_eq!(said, "mesh");

    let many =
        "rfm 1\nsolid many = any i in 0..400: ball([0.1*i, 0.3*random(1, i), 0.3*random(2, i)], 0.04)\n";
    std::fs::write(room.folder.join("many.rfm"), many).unwrap();
    let _viewer = open(room, &["many.rfm"]);
    room.browser.wait_for("document.getElementById('surface-said').textContent");
    let said = room.browser.eval("document.getElementById('surface-said').textContent");
    assert!(said.as_str().unwrap().contains("operations"), "{said}");
}

/// Boxes of points that are tried for each formula, and points in each.
const PAGE: &str = r#"(() => {
  const gl = Object.assign(document.createElement('canvas'), { width: 256, height: 128 }).getContext('webgl2');
  if (!gl.getExtension('EXT_color_buffer_float')) throw new Error('no pictures of floats');
  const program = gl.createProgram();
  const main = `out vec4 result;
    float part(inout uint s) { s = s * 1664525u + 1013904223u; return float(s >> 8) / 16777216.0; }
    void main() {
      uint s = uint(gl_FragCoord.x) * 747796405u + uint(gl_FragCoord.y) * 2891336453u + 9u;
      for (int i = 0; i < 6; i++) part(s);
      vec3 at = 2.8 * vec3(part(s), part(s), part(s)) - 1.4, size = vec3(part(s), part(s), part(s)) * 0.6 * exp2(-8.0 * part(s));
      vec3 l = max(at - size, -1.45), h = min(at + size, 1.45);
      vec2 r = field_range(vec2(l.x, h.x), vec2(l.y, h.y), vec2(l.z, h.z));
      float most = -2.0, least = 2.0;
      for (int i = 0; i < 64; i++) {
        // corners first
        vec3 w = i < 8 ? vec3(i & 1, (i >> 1) & 1, i >> 2) : vec3(part(s), part(s), part(s));
        float value = field_sign(mix(l, h, w));
        most = max(most, value); least = min(least, value);
      }
      result = vec4(r, most, least);
    }`;
  const head = '#version 300 es\nprecision highp float; precision highp int;\n';
  const corners = 'void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }';
  for (const [kind, text] of [[gl.VERTEX_SHADER, head + corners], [gl.FRAGMENT_SHADER, head + viewer.field.source + main]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text); gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program); gl.useProgram(program);
  const target = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, target);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 256, 128, 0, gl.RGBA, gl.FLOAT, null);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.viewport(0, 0, 256, 128);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const out = new Float32Array(4 * 256 * 128);
  gl.readPixels(0, 0, 256, 128, gl.RGBA, gl.FLOAT, out);
  let [wrong, outside, skipped] = [0, 0, 0];
  for (let i = 0; i < out.length; i += 4) {
    const [low, high, most, least] = out.slice(i, i + 4);
    // beside zero the last bits decide
    if ((high < -2e-5 && most > 0) || (low > 2e-5 && least < 0)) wrong++;
    if (most < 0) { outside++; if (high <= 0) skipped++; }
  }
  gl.getExtension('WEBGL_lose_context').loseContext();
  return [wrong, outside, skipped].join();
})()"#;

pub fn ranges(room: &mut Room) {
    let mut failures = Vec::new();
    for (name, formula) in FORMULAS {
        let text = format!("rfm 1\nsolid f = ({formula}) and box([-1.5, -1.5, -1.5], [1.5, 1.5, 1.5])\n");
        std::fs::write(room.folder.join("f.rfm"), text).unwrap();
        let _viewer = Viewer::start(&room.folder, &["f.rfm"]);
        room.browser.open(&_viewer.address);
        room.browser.wait_for("window.viewer && viewer.field");
        let reason = room.browser.eval("viewer.field.reason");
        assert_eq!(reason, "", "{name}");
        let told = room.browser.eval(PAGE);
        let counts: Vec<u32> =
            told.as_str().unwrap().split(',').map(|count| count.parse().unwrap()).collect();
        let [wrong, outside, skipped] = counts[..] else { panic!("{told}") };
        println!("  {name}: {wrong} wrong, {skipped} of {outside} boxes outside are known to be");
        // small boxes are distinguished, so rays need not stop everywhere; only the bounds of the weights in
        // a slope are known
        if wrong > 0 || (2 * skipped < outside && *name != "slope") {
            failures.push(format!("{name}: {wrong} wrong, {skipped} of {outside}"));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
