//! Surfaces around the particles of a run, made by the real binary.

use std::path::Path;

use serde_json::Value;

use crate::tool::{Outcome, rfm};

/// A block of about 1000 particles that falls onto a post.
const SCENE: &str = "rfm 1
solid post = cylinder(0.1, 0.1).move([0.5, 0.5, 0])
let block = 0.3 <= x <= 0.7 and 0.3 <= y <= 0.7 and 0.15 <= z <= 0.6
scene drop {
  box { max: [1, 1, 1] }
  fluid { shape: block, particles: 1000, density: 1000 kg/m^3, mass: 0.05, support_radius: 0.1 }
  obstacle { solid: post }
  run { dt: 1 ms, until: 20 ms, save_every: 10 ms }
}
";

/// A folder with the run of the scene in `drop.out`.
fn run() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("drop.rfm"), SCENE).unwrap();
    rfm(folder.path(), &["run", "drop.rfm", "--no-pictures"]).expect(0);
    folder
}

fn mesh(folder: &Path, flags: &[&str]) -> Outcome {
    rfm(folder, &[&["mesh", "drop.out", "--fluid"], flags].concat())
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Vertices and triangles of a `.vtp`, by a reader that knows nothing of this program.
fn read(path: &Path) -> (Vec<f64>, Vec<[u64; 3]>) {
    let vtk = vtkio::Vtk::import(path).unwrap();
    let vtkio::model::DataSet::PolyData { pieces, .. } = vtk.data else { panic!("no PolyData") };
    let piece = pieces.into_iter().next().unwrap().into_loaded_piece_data(None).unwrap();
    let Some(vtkio::model::VertexNumbers::XML { connectivity, offsets }) = piece.polys else {
        panic!("no polygons")
    };
    assert!(offsets.iter().enumerate().all(|(i, &end)| end == 3 * (i as u64 + 1)));
    let triangles = connectivity.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    (piece.points.cast_into::<f64>().unwrap(), triangles)
}

#[test]
fn frames_become_closed_surfaces_about_as_large_as_the_fluid() {
    let folder = run();
    let document = mesh(folder.path(), &["--json"]).expect(0).json();
    assert_eq!((&document["schema"], &document["frames"]), (&1.into(), &3.into()));
    let surfaces = document["surfaces"].as_array().unwrap();
    let out = folder.path().join("drop.out/surface");
    assert_eq!(
        names(&out),
        ["surface.json", "surface.pvd", "surface_000000.vtp", "surface_000001.vtp", "surface_000002.vtp"]
    );
    let mut triangles = 0;
    for (i, surface) in surfaces.iter().enumerate() {
        assert_eq!((&surface["frame"], &surface["closed"]), (&i.into(), &true.into()));
        assert!((number(&surface["time"]) - 0.01 * i as f64).abs() < 1e-9);
        // the mass of a particle divided by its density
        let expected = number(&surface["particles"]) * 0.05 / 1000.0;
        assert!((number(&surface["particle_volume"]) / expected - 1.0).abs() < 1e-12);
        let ratio = number(&surface["volume_ratio"]);
        assert!((ratio - number(&surface["volume"]) / expected).abs() < 1e-12);
        // edges and corners of the block are rounded off; within 20 ms little else happens
        assert!((0.9..1.1).contains(&ratio), "{surface}");
        triangles += surface["triangles"].as_u64().unwrap();
        // an independent reader sees what was reported: a closed surface with that volume
        let (points, found) = read(&out.join(surface["file"].as_str().unwrap()));
        assert_eq!(
            (points.len() as u64 / 3, found.len() as u64),
            (surface["vertices"].as_u64().unwrap(), surface["triangles"].as_u64().unwrap())
        );
        let mut edges = std::collections::HashSet::new();
        for [a, b, c] in &found {
            assert!([(a, b), (b, c), (c, a)].into_iter().all(|edge| edges.insert(edge)));
        }
        assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))));
        let corner = |v: u64| rfm::glam::DVec3::from_slice(&points[3 * v as usize..]);
        let volume: f64 =
            found.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum();
        assert!((volume / number(&surface["volume"]) - 1.0).abs() < 1e-9);
    }
    assert_eq!(document["triangles"].as_u64().unwrap(), triangles);
    let list = std::fs::read_to_string(out.join("surface.pvd")).unwrap();
    assert!(list.contains("timestep=\"0.01\"") && list.contains("file=\"surface_000001.vtp\""));
}

#[test]
fn formats_frames_and_lengths_can_be_chosen_and_threads_do_not_matter() {
    let folder = run();
    let here = folder.path();
    for format in ["stl", "ply", "obj", "glb", "3mf"] {
        let flags = ["--format", format, "--frames", "1..2", "--cell", "2cm", "-o", format, "--json"];
        let document = mesh(here, &flags).expect(0).json();
        assert_eq!((&document["frames"], &document["surfaces"][0]["frame"]), (&1.into(), &1.into()));
        assert_eq!(document["cell"], 0.02);
        assert_eq!(names(&here.join(format)), [format!("surface_000001.{format}")]);
    }
    let text = mesh(here, &["--format", "stl", "--ascii", "--radius", "15mm", "--frames", "0", "-o", "text"]);
    assert!(text.expect(0).stdout.contains("particles of radius 1.500e-2 m"));
    assert!(std::fs::read(here.join("text/surface_000000.stl")).unwrap().starts_with(b"solid rfm"));
    for threads in ["1", "2"] {
        mesh(here, &["--frames", "2..", "--threads", threads, "-o", threads]).expect(0);
    }
    let bytes = |out: &str| std::fs::read(here.join(out).join("surface_000002.vtp")).unwrap();
    assert!(bytes("1") == bytes("2"));
}

#[test]
fn what_is_no_run_is_refused_with_advice() {
    let folder = run();
    let here = folder.path();
    let refused = |arguments: &[&str], advice: &str| {
        let outcome = rfm(here, arguments).expect(2);
        assert!(outcome.stdout.is_empty() && outcome.stderr.contains(advice), "{}", outcome.stderr);
        assert!(!outcome.stderr.contains("panicked"));
    };
    refused(&["mesh", "none.out", "--fluid"], "rfm run FILE -o none.out");
    refused(&["mesh", "drop.rfm", "--fluid"], "rfm mesh drop.out --fluid");
    refused(&["mesh", ".", "--fluid"], "no frames in `.`");
    refused(&["mesh", "drop.out", "-o", "x.stl"], "rfm mesh drop.out --fluid");
    refused(&["mesh", "drop.rfm", "--radius", "1mm", "--json"], "--fluid");
    refused(&["mesh", "drop.out", "--fluid", "--quality"], "--quality");
    refused(&["mesh", "drop.out", "--fluid", "--frames", "2..9"], "from 0 to 2");
    refused(&["mesh", "drop.out", "--fluid", "--radius", "0"], "above 0");
    refused(&["mesh", "drop.out", "--fluid", "--radius", "3kg"], "`3kg` is not a length");
    refused(&["mesh", "drop.out", "--fluid", "--cell", "1um"], "use ");
    refused(&["mesh", "drop.out", "--fluid", "--format", "glb", "--ascii"], "--ascii");
    refused(&["mesh", "drop.out", "--fluid", "-o", "drop.rfm"], "cannot make the folder");
    assert!(!here.join("drop.out/surface").exists());

    // one frame was cut off: those before it are kept, and the damaged file stays as it was
    let frame = here.join("drop.out/frames/particles_000001.vtp");
    let whole = std::fs::read(&frame).unwrap();
    std::fs::write(&frame, &whole[..whole.len() / 2]).unwrap();
    refused(&["mesh", "drop.out", "--fluid"], "particles_000001.vtp");
    let out = here.join("drop.out/surface");
    assert_eq!(names(&out), ["surface.json", "surface.pvd", "surface_000000.vtp"]);
    refused(&["mesh", "drop.out", "--fluid"], "it was cut off");
    std::fs::remove_file(&frame).unwrap();
    refused(&["mesh", "drop.out", "--fluid"], "is missing");
    mesh(here, &["--frames", "..1"]).expect(0);

    // a run that was cut off wrote no summary, so the radius must be given
    std::fs::remove_file(here.join("drop.out/summary.json")).unwrap();
    refused(&["mesh", "drop.out", "--fluid", "--frames", "0"], "--radius");
    let document = mesh(here, &["--frames", "0", "--radius", "18.4mm", "--json"]).expect(0).json();
    assert!((0.9..1.1).contains(&number(&document["surfaces"][0]["volume_ratio"])), "{document}");
}

#[test]
fn surfaces_go_with_the_run_that_they_were_made_of() {
    let folder = run();
    let here = folder.path();
    let render = |code: i32| rfm(here, &["render", "drop.out", "--surface", "-o", "pictures"]).expect(code);
    let surface = here.join("drop.out/surface");
    mesh(here, &[]).expect(0);
    mesh(here, &["--format", "stl", "--frames", "0"]).expect(0);
    std::fs::write(surface.join("notes.txt"), "of the user").unwrap();
    render(0);

    // a new run in the folder removes what the old one left, and nothing else
    let kept: Vec<_> =
        names(&surface).into_iter().map(|name| (std::fs::read(surface.join(&name)).unwrap(), name)).collect();
    let other = SCENE.replace("z <= 0.6", "z <= 0.5").replace("particles: 1000", "particles: 900");
    std::fs::write(here.join("drop.rfm"), other).unwrap();
    rfm(here, &["run", "drop.rfm", "--no-pictures", "--force"]).expect(0);
    assert_eq!(names(&surface), ["notes.txt"]);
    assert!(render(2).stderr.contains("`rfm mesh drop.out --fluid` makes them"));

    // surfaces of the old run beside frames of the new one, at the same times
    for (bytes, name) in kept {
        std::fs::write(surface.join(name), bytes).unwrap();
    }
    let told = render(2).stderr;
    assert!(told.contains("surface_000000.vtp` was made of another run than frame 0"), "{told}");
    mesh(here, &["--frames", "1.."]).expect(0);
    assert!(render(2).stderr.contains("frame 0, at 0 s, has no surface"));
    rfm(here, &["render", "drop.out", "--surface", "--frames", "1..", "-o", "pictures"]).expect(0);

    // older versions did not record what surfaces were made of
    std::fs::remove_file(surface.join("surface.json")).unwrap();
    rfm(here, &["render", "drop.out", "--surface", "--frames", "1..", "-o", "pictures"]).expect(0);
}

#[test]
fn a_file_for_the_surface_holds_one_frame() {
    let folder = run();
    let here = folder.path();
    let refused = |flags: &[&str], part: &str| {
        let told = mesh(here, flags).expect(2).stderr;
        assert!(told.contains(part), "{told}");
        assert!(!here.join("x.stl").exists(), "{flags:?}");
    };
    refused(&["-o", "x.stl"], "there are 3 frames: write a file for each into a folder, -o x --format stl");
    refused(&["-o", "x.stl", "--frames", "0", "--format", "ply"], "names a .stl file, and --format ply");
    refused(&["-o", "x.html"], "rfm view drop.out --save x.html");
    let told = mesh(here, &["-o", "x.stl", "--frames", "1"]).expect(0).stdout;
    assert!(told.starts_with("1 frame, ") && told.contains("written to x.stl"), "{told}");
    let file = std::fs::read(here.join("x.stl")).unwrap();
    mesh(here, &["-o", "all", "--format", "stl"]).expect(0);
    assert!(file == std::fs::read(here.join("all/surface_000001.stl")).unwrap());
}

/// The crate that makes surfaces relies on sane particles; these are not.
#[test]
fn strange_particles_end_in_a_mesh_or_a_message() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::create_dir(here.join("drop.out")).unwrap();
    let list = "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"a.vtp\"/></Collection></VTKFile>";
    std::fs::write(here.join("drop.out/particles.pvd"), list).unwrap();
    for (points, code) in [
        ("", 0),
        ("0 0 0", 0),
        ("1 2 3 1 2 3 1 2 3", 0),
        ("nan 0 0 1 1 1", 0),
        ("0 0 0 1e30 0 0", 2),
        ("1e30 1e30 1e30", 0),
        ("0 0 0 50 0 0", 0),
        ("0 0 0 100 0 0", 2),
        ("inf 0 0", 0),
    ] {
        let count = points.split_whitespace().count() / 3;
        let frame = format!(
            "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"{count}\"><Points>\
             <DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">{points}</DataArray>\
             </Points></Piece></PolyData></VTKFile>"
        );
        std::fs::write(here.join("drop.out/a.vtp"), frame).unwrap();
        let outcome = mesh(here, &["--radius", "1cm", "--json"]);
        assert!(!outcome.stderr.contains("panicked"), "{points}: {}", outcome.stderr);
        let outcome = outcome.expect(code);
        if code == 0 {
            let surface = &outcome.json()["surfaces"][0];
            assert_eq!(surface["closed"], true, "{points}: {surface}");
            let found = surface["particles"].as_u64().unwrap() + surface["left_out"].as_u64().unwrap();
            assert_eq!(found as usize, count);
        }
    }
}
