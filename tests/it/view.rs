//! `rfm view`: what a saved page holds, and how the server treats browsers, other pages and nonsense. What
//! the page does with it is tested in a browser, by `tests/viewer`.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use rfm::fluid_surface::read_arrays;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::view::{Lattice, Levels};
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use crate::tool::rfm;

const SCENE: &str = "rfm 1
param r = 0.2 in 0.1 .. 0.4
solid post = cylinder(r, 0.5).move([0.5, 0.5, 0])
scene drop {
  box { min: [0, 0, 0], max: [1, 1, 1.5] }
  fluid { shape: ball([0.5, 0.5, 1], 0.25), particles: 800, fill: middle }
  obstacle { solid: post }
  run { until: 0.2 s, save_every: 0.02 s }
}
";

fn scene(folder: &Path) {
    std::fs::write(folder.join("drop.rfm"), SCENE).unwrap();
}

fn run(folder: &Path) {
    scene(folder);
    rfm(folder, &["run", "drop.rfm", "--no-pictures"]).expect(0);
}

/// The blocks of a page: the head and the planes of each.
fn blocks(page: &str) -> Vec<(serde_json::Value, Vec<u8>)> {
    let mut blocks = Vec::new();
    for part in page.split("<script type=\"application/octet-stream\">").skip(1) {
        let base64 = part.split("</script>").next().unwrap();
        let deflated = BASE64_STANDARD.decode(base64).unwrap();
        let mut group = Vec::new();
        flate2::read::DeflateDecoder::new(&deflated[..]).read_to_end(&mut group).unwrap();
        let length = |bytes: &[u8]| u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        let mut rest = &group[..];
        while !rest.is_empty() {
            let (block, others) = rest[4..].split_at(length(rest));
            let end = 4 + length(block);
            blocks.push((serde_json::from_slice(&block[4..end]).unwrap(), block[end..].to_vec()));
            rest = others;
        }
    }
    blocks
}

/// A frame of a page: the sites of the particles, and for each array their levels.
type Decoded = (Vec<[u16; 3]>, Vec<Vec<u8>>);

/// What a block says of a frame, by differences from the frame before and from where velocities lead.
fn decoded(head: &serde_json::Value, planes: &[u8], before: &Decoded) -> Decoded {
    let n = head["count"].as_u64().unwrap() as usize;
    let follows = head["follows"].as_bool().unwrap();
    let (ranges, motion) = (head["ranges"].as_array().unwrap(), &head["motion"]);
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let value = |k: usize, level: u8| {
        let (low, high) = (number(&ranges[k]["low"]), number(&ranges[k]["high"]));
        low + f64::from(level) / 254.0 * (high - low)
    };
    let velocity = |axis: usize| motion["velocity"][axis].as_u64().unwrap() as usize;
    let mut levels: Vec<Vec<u8>> = Vec::new();
    for k in 0..ranges.len() {
        let plane = &planes[(6 + k) * n..(7 + k) * n];
        let is_speed = motion["speed"].as_u64() == Some(k as u64);
        let then = |i: usize| if follows && !is_speed { before.1[k][i] } else { 0 };
        levels.push(plane.iter().enumerate().map(|(i, level)| level.wrapping_add(then(i))).collect());
    }
    let speed = motion["speed"].as_u64().unwrap() as usize;
    let (low, high) = (number(&ranges[speed]["low"]), number(&ranges[speed]["high"]));
    let components = [0, 1, 2].map(|axis| (velocity(axis), levels[velocity(axis)].clone()));
    for (i, level) in levels[speed].iter_mut().enumerate() {
        let [x, y, z] = components.each_ref().map(|(k, levels)| value(*k, levels[i]));
        let part = (((x * x + y * y + z * z).sqrt() - low) / (high - low)).clamp(0.0, 1.0);
        *level = level.wrapping_add((part * 254.0 + 0.5).floor() as u8);
    }
    let unfolded = |x: u16| (x >> 1) ^ 0u16.wrapping_sub(x & 1);
    let site = |i: usize| {
        std::array::from_fn(|axis| {
            let stated = u16::from_le_bytes([planes[2 * axis * n + i], planes[(2 * axis + 1) * n + i]]);
            if !follows {
                return stated;
            }
            let k = velocity(axis);
            let moved = number(&motion["steps"][axis]) * (value(k, before.1[k][i]) + value(k, levels[k][i]));
            let expected = i64::from(before.0[i][axis]) + (moved + 0.5).floor() as i64;
            (expected as u16).wrapping_add(unfolded(stated))
        })
    };
    ((0..n).map(site).collect(), levels)
}

#[test]
fn a_saved_page_holds_every_position_in_few_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    run(here);
    let summary = rfm(here, &["view", "drop.out", "--save", "drop.html", "--json"]).expect(0).json();
    let page = std::fs::read_to_string(here.join("drop.html")).unwrap();
    assert_eq!((summary["frames"].as_u64(), summary["bytes"].as_u64()), (Some(11), Some(page.len() as u64)));
    let setting = page.split("id=\"setting\">").nth(1).unwrap().split("</script>").next().unwrap();
    let setting: serde_json::Value = serde_json::from_str(setting).unwrap();
    assert_eq!(setting["box"]["max"], serde_json::json!([1.0, 1.0, 1.5]));
    let names: Vec<_> = setting["arrays"].as_array().unwrap().iter().map(|array| &array["name"]).collect();
    assert_eq!(names, ["speed", "density", "pressure", "velocity x", "velocity y", "velocity z"]);
    let plots = setting["plots"].as_array().unwrap().iter();
    let plots: Vec<_> =
        plots.map(|plot| (plot["name"].as_str().unwrap(), plot["unit"].as_str().unwrap())).collect();
    assert_eq!(plots, [("energy", "J"), ("audit", "%"), ("audit", "m/s")]);

    let blocks = blocks(&page);
    let frames = || blocks.iter().filter(|(head, _)| head["kind"] == "frame");
    assert_eq!((frames().count(), blocks.len()), (11, 12));
    let lattice = Lattice::new(&Aabb::new(DVec3::ZERO, DVec3::new(1.0, 1.0, 1.5)));
    let rounding = lattice.rounding() + DVec3::splat(1e-7);
    let (mut before, mut particles) = (Decoded::default(), 0);
    for (k, (head, planes)) in frames().enumerate() {
        let file = std::fs::read(here.join(format!("drop.out/frames/particles_{k:06}.vtp"))).unwrap();
        let (points, arrays) = read_arrays(&file).unwrap();
        before = decoded(head, planes, &before);
        assert_eq!(before.0.len(), points.len());
        for (site, point) in before.0.iter().zip(&points) {
            let off = (lattice.position(*site) - *point).abs();
            assert!(off.cmple(rounding).all(), "frame {k}: {point} is {off} away");
        }
        for (name, j) in [("speed", 0), ("density", 1), ("pressure", 2)] {
            let values = &arrays.iter().find(|array| array.name == name).unwrap().values;
            let of = |end: &str| head["ranges"][j][end].as_f64().unwrap();
            let levels = Levels { low: of("low"), high: of("high") };
            let mut pairs = before.1[j].iter().zip(values);
            assert!(pairs.all(|(level, value)| *level == levels.level(*value)), "frame {k}: {name}");
        }
        assert!((head["time"].as_f64().unwrap() - 0.02 * k as f64).abs() < 1e-9);
        particles += points.len();
    }
    // what the frames after the first one add
    let one = rfm(here, &["view", "drop.out", "--save", "one.html", "--frames", "0..1", "--json"]);
    let first = one.expect(0).json()["bytes"].as_u64().unwrap() as usize;
    let bytes = (page.len() - first) as f64 / (particles * 10 / 11) as f64;
    assert!(bytes <= 8.0, "{bytes} bytes per particle and frame");
}

#[test]
fn what_is_only_moved_has_one_mesh_and_surfaces_of_the_fluid_are_shown() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let text = SCENE
        .replace("post = cylinder(r, 0.5)", "post = box([0, -0.05, 0.1], [r, 0.05, 0.5]).rotate_z(4*t)")
        .replace(
            "scene drop {",
            "solid wall = box([0.9, 0, 0], [1, 1, 0.4])\nscene drop {\n  obstacle { solid: wall }",
        );
    std::fs::write(here.join("drop.rfm"), text).unwrap();
    rfm(here, &["run", "drop.rfm", "--no-pictures", "--mesh-cells", "24"]).expect(0);
    let saved = |name: &str| {
        let page = rfm(here, &["view", "drop.out", "--save", name]).expect(0);
        assert!(page.stdout.contains(" bytes per particle and frame, "), "{}", page.stdout);
        blocks(&std::fs::read_to_string(here.join(name)).unwrap())
    };
    let of = |blocks: &[(serde_json::Value, Vec<u8>)], kind: &str| -> Vec<serde_json::Value> {
        blocks.iter().map(|(head, _)| head).filter(|head| head["kind"] == kind).cloned().collect()
    };
    let plain = saved("plain.html");
    let (meshes, frames) = (of(&plain, "mesh"), of(&plain, "frame"));
    assert_eq!((meshes.len(), frames.len()), (1, 11));
    let parts: Vec<_> = meshes[0]["parts"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect();
    assert!(parts.len() == 2 && parts.iter().sum::<u64>() == meshes[0]["triangles"].as_u64().unwrap());
    assert!(frames[0]["poses"].is_null() && frames[0]["surface"].is_null());
    for (k, frame) in frames.iter().enumerate().skip(1) {
        let number = |part: usize, i: usize| frame["poses"][part][i].as_f64().unwrap();
        // the scene names the wall first; the post turns about the axis at (½, ½)
        let identity = (0..12).map(|i| number(0, i) - f64::from(u8::from(i % 4 == 0 && i < 9)));
        assert!(identity.map(f64::abs).fold(0.0, f64::max) < 1e-9);
        let (sin, cos) = (4.0 * 0.02 * k as f64).sin_cos();
        let moved = [0.5 - 0.5 * cos + 0.5 * sin, 0.5 - 0.5 * sin - 0.5 * cos];
        for (i, truth) in [(0, cos), (1, sin), (9, moved[0]), (10, moved[1]), (11, 0.0)] {
            assert!((number(1, i) - truth).abs() < 1e-9, "frame {k}, {i}: {} {truth}", number(1, i));
        }
    }
    rfm(here, &["mesh", "drop.out", "--fluid", "--frames", "3..6"]).expect(0);
    let with = saved("with.html");
    for (surfaces, count) in [("none", 0), ("fine", 3)] {
        rfm(here, &["view", "drop.out", "--save", "some.html", "--surfaces", surfaces]).expect(0);
        let some = blocks(&std::fs::read_to_string(here.join("some.html")).unwrap());
        assert_eq!(of(&some, "surface").len(), count, "{surfaces}");
    }
    let surfaces: Vec<_> = of(&with, "frame").iter().map(|frame| frame["surface"].as_u64()).collect();
    let none = [None; 3];
    assert_eq!(surfaces, [&none[..], &[Some(0), Some(1), Some(2)], &[None; 5]].concat());
    assert_eq!(of(&with, "surface").len(), 3);
    // those of another run are not shown, and a message says so
    let more =
        std::fs::read_to_string(here.join("drop.rfm")).unwrap().replace("particles: 800", "particles: 900");
    std::fs::write(here.join("other.rfm"), more).unwrap();
    rfm(here, &["run", "other.rfm", "--no-pictures", "-o", "other.out"]).expect(0);
    std::fs::create_dir(here.join("other.out/surface")).unwrap();
    for entry in std::fs::read_dir(here.join("drop.out/surface")).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), here.join("other.out/surface").join(entry.file_name())).unwrap();
    }
    let other = rfm(here, &["view", "other.out", "--save", "other.html"]).expect(0);
    assert!(other.stderr.contains("3 surfaces") && other.stderr.contains("another run"), "{}", other.stderr);
    // a list of surfaces that cannot be read takes nothing else away
    std::fs::write(here.join("drop.out/surface/surface.pvd"), "<VTKFile").unwrap();
    let broken = rfm(here, &["view", "drop.out", "--save", "-"]).expect(0);
    assert!(
        broken.stderr.contains("surface.pvd`: ") && broken.stderr.contains("are not shown"),
        "{}",
        broken.stderr
    );
    assert_eq!(of(&blocks(&broken.stdout), "frame").len(), 11);
    assert!(!here.join("-").exists());
    rfm(here, &["view", "drop.out", "--save", "-", "--json"]).expect(2);
    let wrong = rfm(here, &["view", "drop.out", "--save", "page.pdf"]).expect(2);
    assert!(wrong.stderr.contains("does not end in .html") && !here.join("page.pdf").exists());
}

#[test]
fn a_page_of_a_mesh_is_one_file() {
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path());
    rfm(folder.path(), &["mesh", "drop.rfm", "--cells", "24", "-o", "post.html"]).expect(0);
    let page = std::fs::read_to_string(folder.path().join("post.html")).unwrap();
    let [(head, planes)] = &blocks(&page)[..] else { panic!("one block") };
    let (count, triangles) = (head["count"].as_u64().unwrap(), head["triangles"].as_u64().unwrap());
    assert_eq!(planes.len() as u64, 12 * count + 12 * triangles);
    assert!(triangles > 500);
    for word in ["src=", "href=\"http", "url(", "@import"] {
        assert!(!page.contains(word), "the page asks for something else: {word}");
    }
    let refused = rfm(folder.path(), &["mesh", "drop.rfm", "--unit", "mm", "-o", "post.html"]).expect(2);
    assert!(refused.stderr.contains("in metres"), "{}", refused.stderr);
}

#[test]
fn what_cannot_be_viewed_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    scene(here);
    std::fs::create_dir(here.join("empty")).unwrap();
    let (_, scene) = SCENE.split_once("scene drop").unwrap();
    std::fs::write(here.join("two.rfm"), format!("{SCENE}scene other{scene}")).unwrap();
    for (arguments, words) in [
        (&["view", "drop.rfm", "--save", "a.html"][..], "rfm run drop.rfm"),
        (&["view", "empty", "--save", "a.html"], "there are no frames in `empty`"),
        (&["view", "none.rfm", "--no-open"], "there is no file `none.rfm`"),
        (&["view", "-"], "standard input cannot be viewed"),
        (&["view", "drop.rfm", "--host", "256.1.1.1", "--no-open"], "cannot serve at --host 256.1.1.1"),
        (&["view", "drop.rfm", "--scene", "drip", "--no-open"], "no scene `drip`; did you mean `drop`?"),
        (&["view", "drop.rfm", "-s", "pots", "--no-open"], "no solid `pots`; did you mean `post`?"),
        (&["view", "two.rfm", "--no-open"], "several scenes; choose one with --scene: drop, other"),
    ] {
        let outcome = rfm(here, arguments).expect(2);
        assert!(outcome.stderr.contains(words), "{arguments:?}: {}", outcome.stderr);
    }
    run(here);
    let text = std::fs::read(here.join("drop.out/frames/particles_000003.vtp")).unwrap();
    std::fs::write(here.join("drop.out/frames/particles_000003.vtp"), &text[..text.len() / 2]).unwrap();
    let outcome = rfm(here, &["view", "drop.out", "--save", "a.html"]).expect(2);
    assert!(outcome.stderr.contains("cut off"), "{}", outcome.stderr);
    assert!(!here.join("a.html").exists());
    rfm(here, &["view", "drop.out", "--save", "a.html", "--frames", "0..3"]).expect(0);
}

/// A server that ends with the test.
struct Viewer {
    child: Child,
    at: SocketAddr,
    /// `/TOKEN/`
    path: String,
    folder: tempfile::TempDir,
}

impl Viewer {
    fn start() -> Self {
        let folder = tempfile::tempdir().unwrap();
        scene(folder.path());
        let mut child = Command::new(env!("CARGO_BIN_EXE_rfm"))
            .args(["view", "drop.rfm", "--no-open", "--mesh-cells", "24"])
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().strip_prefix("http://").unwrap();
        let (at, token) = address.split_once('/').unwrap();
        assert_eq!(token.len(), 33, "{line}");
        Self { child, at: at.parse().unwrap(), path: format!("/{token}"), folder }
    }

    /// Sends bytes, and returns the first line of the answer and the whole.
    fn ask(&self, request: &str) -> (String, String) {
        let mut stream = TcpStream::connect(self.at).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        // a server that refuses may have closed before all of it is sent
        let _ = stream.write_all(request.as_bytes());
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer).into_owned();
        (answer.lines().next().unwrap_or_default().to_string(), answer)
    }

    fn get(&self, path: &str, headers: &str) -> String {
        self.ask(&format!("GET {path} HTTP/1.1\r\nHost: {}\r\n{headers}\r\n", self.at)).0
    }

    fn is_well(&self) {
        assert_eq!(self.get(&self.path, ""), "HTTP/1.1 200 OK");
    }

    /// Connects to the stream as a page does.
    fn follow(&self, origin: &str) -> Result<WebSocket<TcpStream>, String> {
        let stream = TcpStream::connect(self.at).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let mut request = format!("ws://{}{}stream", self.at, self.path).into_client_request().unwrap();
        request.headers_mut().insert("Origin", origin.parse().unwrap());
        tungstenite::client(request, stream).map(|(socket, _)| socket).map_err(|error| error.to_string())
    }

    fn own_page(&self) -> WebSocket<TcpStream> {
        self.follow(&format!("http://{}", self.at)).unwrap()
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads until a message of a kind comes, and answers those before it as a page does.
fn until(socket: &mut WebSocket<TcpStream>, kind: &str) -> serde_json::Value {
    for _ in 0..200 {
        let head = match socket.read().unwrap() {
            Message::Text(text) => serde_json::from_str(text.as_str()).unwrap(),
            Message::Binary(block) => {
                socket.send(Message::text(r#"{"do":"seen"}"#)).unwrap();
                let length = u32::from_le_bytes(block[..4].try_into().unwrap()) as usize;
                serde_json::from_slice::<serde_json::Value>(&block[4..4 + length]).unwrap()
            }
            other => panic!("{other:?}"),
        };
        if head["kind"] == kind {
            return head;
        }
    }
    panic!("no message of the kind {kind}");
}

#[test]
fn only_the_page_itself_with_its_token_is_let_in() {
    let viewer = Viewer::start();
    viewer.is_well();
    let (_, page) = viewer.ask(&format!("GET {} HTTP/1.1\r\nHost: localhost:1\r\n\r\n", viewer.path));
    assert!(page.contains("<!doctype html>") && page.contains("\"live\":true") && page.contains("drop.rfm"));
    for header in
        ["X-Content-Type-Options: nosniff", "Referrer-Policy: no-referrer", "Cache-Control: no-store"]
    {
        assert!(page.contains(header), "{header}");
    }
    let forbidden = "HTTP/1.1 403 Forbidden";
    let wrong = format!("/{}/", "0".repeat(32));
    for path in ["/", "", "/stream", "//", &wrong, &viewer.path[..32], &format!("{}x", &viewer.path[..33])] {
        assert_eq!(viewer.get(path, ""), forbidden, "{path}");
    }
    assert_eq!(viewer.get(&format!("{}other", viewer.path), ""), "HTTP/1.1 404 Not Found");
    assert_eq!(viewer.get(&viewer.path, "Origin: http://evil.example\r\n"), forbidden);
    for host in ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "localhost.evil.example"] {
        let (line, answer) = viewer.ask(&format!("GET {} HTTP/1.1\r\nHost: {host}\r\n\r\n", viewer.path));
        assert_eq!(line, forbidden, "{host}");
        assert!(!answer.contains(&viewer.path));
    }
    for origin in ["http://evil.example", "null", "https://127.0.0.1", "http://localhost:1"] {
        assert!(viewer.follow(origin).unwrap_err().contains("403"), "{origin}");
    }
    viewer.own_page();
}

#[test]
fn nonsense_is_refused_and_survived() {
    let viewer = Viewer::start();
    let long = "a".repeat(40_000);
    for (request, status) in [
        ("\r\n\r\n".to_string(), "400"),
        ("GET\r\n\r\n".into(), "400"),
        ("GET / HTTP/3\r\nHost: localhost\r\n\r\n".into(), "400"),
        ("GET / HTTP/1.1\r\nHost\r\n\r\n".into(), "400"),
        ("GET / HTTP/1.1\r\n\r\n".into(), "400"),
        ("\u{0}\u{1}ω\r\n\r\n".into(), "400"),
        ("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\nx".into(), "405"),
        (format!("GET /{long} HTTP/1.1\r\nHost: localhost\r\n\r\n"), "431"),
    ] {
        let (line, _) = viewer.ask(&request);
        // the rest of a request that is too long may arrive after the answer, which is lost then
        let is_cut = status == "431" && line.is_empty();
        assert!(line.contains(status) || is_cut, "{line} for {:.40}", request);
    }
    drop(TcpStream::connect(viewer.at).unwrap());
    // more connections than are served, which say nothing, give way to those that ask for something
    let silent: Vec<TcpStream> = (0..300).map(|_| TcpStream::connect(viewer.at).unwrap()).collect();
    viewer.is_well();
    drop(silent);
    // pages that are open do not
    let pages: Vec<_> = (0..32).map(|_| viewer.own_page()).collect();
    let is_refused = |_| {
        std::thread::sleep(Duration::from_millis(50));
        viewer.get(&viewer.path, "").contains("503")
    };
    assert!((0..20).any(is_refused), "one page more is served");
    drop(pages);
    std::thread::sleep(Duration::from_millis(1000));
    viewer.is_well();
}

#[test]
fn a_page_follows_the_run_and_commands_it() {
    let viewer = Viewer::start();
    let mut page = viewer.own_page();
    let setting = until(&mut page, "setting");
    assert_eq!((&setting["live"], &setting["params"][0]["name"]), (&true.into(), &"r".into()));
    let mesh = until(&mut page, "mesh");
    assert!(mesh["triangles"].as_u64().unwrap() > 100);
    let frame = until(&mut page, "frame");
    assert!(frame["count"].as_u64().unwrap() > 700, "{frame}");
    let first = frame["run"].as_u64().unwrap();
    page.send(Message::text(r#"{"do":"set","name":"r","value":0.3}"#)).unwrap();
    let mut last = frame;
    for _ in 0..100 {
        last = until(&mut page, "frame");
        if last["run"].as_u64().unwrap() > first {
            break;
        }
    }
    assert_eq!(last["run"].as_u64().unwrap(), first + 1);
    page.send(Message::text(r#"{"do":"pause"}"#)).unwrap();
    while until(&mut page, "status")["playing"] == true {}
    // values beyond the range, of unknown params, and no numbers at all change nothing
    for command in [
        r#"{"do":"set","name":"none","value":1}"#,
        r#"{"do":"gravity","vector":[1e999,0,0]}"#,
        r#"{"do":"speed","value":-1}"#,
    ] {
        let mut other = viewer.own_page();
        other.send(Message::text(command)).unwrap();
        // what is no command ends the connection, perhaps before the state is sent
        let is_told =
            |message: Message| matches!(message, Message::Text(text) if text.contains("\"status\""));
        while other.read().is_ok_and(|message| !message.is_close() && !is_told(message)) {
            let _ = other.send(Message::text(r#"{"do":"seen"}"#));
        }
    }
    page.send(Message::text(r#"{"do":"set","name":"r","value":7}"#)).unwrap();
    // the page hears of the last good value, and an edit of the file is shown
    let radius = |setting: &serde_json::Value| setting["params"][0]["value"].as_f64();
    let before = until(&mut page, "setting");
    assert_eq!(radius(&before), Some(0.3));
    let error = loop {
        if let Some(error) = until(&mut page, "status")["error"].as_str() {
            break error.to_string();
        }
    };
    assert!(error.contains("`r`") && error.contains("0.4"), "{error}");
    let file = viewer.folder.path().join("drop.rfm");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("particles: 800", "particles: 700")).unwrap();
    while until(&mut page, "setting")["facts"] == before["facts"] {}
    while !until(&mut page, "status")["error"].is_null() {}
    // a value that the edited file does not allow any more is that of the file
    page.send(Message::text(r#"{"do":"set","name":"r","value":0.35}"#)).unwrap();
    while radius(&until(&mut page, "setting")) != Some(0.35) {}
    std::fs::write(&file, text.replace("0.4", "0.3")).unwrap();
    while radius(&until(&mut page, "setting")) == Some(0.35) {}
    page.send(Message::text(r#"{"do":"set","name":"r","value":0.15}"#)).unwrap();
    while radius(&until(&mut page, "setting")) != Some(0.15) {}
    page.send(Message::text(r#"{"do":"unset","name":"r"}"#)).unwrap();
    while radius(&until(&mut page, "setting")) == Some(0.15) {}
    page.send(Message::text(r#"{"do":"reset"}"#)).unwrap();
    until(&mut page, "setting");
}

#[test]
fn a_page_that_misbehaves_or_goes_away_harms_nobody() {
    let viewer = Viewer::start();
    // oversized, of the wrong kind, no command
    let messages = [
        Message::text("x".repeat(1 << 20)),
        Message::Binary(vec![0; 100].into()),
        Message::text("{\"do\":\"erase\"}"),
        Message::text("["),
    ];
    for message in messages {
        let mut page = viewer.own_page();
        // the server may close before all of it is sent
        let _ = page.send(message);
        let ended = (0..200).any(|_| page.read().is_err());
        assert!(ended, "the connection goes on");
    }
    // closing in the middle of a frame, with and without a farewell
    for _ in 0..4 {
        let page = viewer.own_page();
        let mut stream = page.into_inner();
        let mut part = [0; 1000];
        stream.read_exact(&mut part).unwrap();
        drop(stream);
        let mut page = viewer.own_page();
        until(&mut page, "setting");
        let _ = page.close(None);
    }
    // one that never takes anything does not hold up another one
    let _silent = viewer.own_page();
    let mut page = viewer.own_page();
    for _ in 0..5 {
        until(&mut page, "frame");
    }
    viewer.is_well();
}
