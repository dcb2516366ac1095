//! The contract of `rfm mesh`: what it says of a mesh is that of the file that it writes.

use crate::cli::{PAWN, SMALL, contract};
use crate::tool::{rfm, rfm_reading, root};

const MESH_KEYS: [&str; 14] = [
    "schema",
    "vertices",
    "triangles",
    "closed",
    "manifold",
    "components",
    "euler",
    "volume",
    "area",
    "max_distance",
    "rms_distance",
    "thin_cells",
    "small_components",
    "evaluations",
];

/// Every directed edge occurs once, and so does its opposite.
fn closed_and_manifold(triangles: impl Iterator<Item = [usize; 3]>) {
    let mut edges = std::collections::HashSet::new();
    for [a, b, c] in triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            assert!(edges.insert(edge), "the edge {edge:?} is used twice");
        }
    }
    assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))), "there is a hole");
}

#[test]
fn meshes_read_back_as_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let mesh = |name: &str, threads: &str| {
        let arguments = ["mesh", PAWN, "--cells", "40", "--json", "--threads", threads, "-o", &path(name)];
        let outcome = rfm(root(), &arguments).expect(0);
        let document = outcome.json();
        contract(&outcome.stdout, &document, &MESH_KEYS);
        assert!(document["milliseconds"].is_number());
        document
    };
    let report = mesh("a.stl", "1");
    assert_eq!(report["closed"], true);
    assert_eq!(report["manifold"], true);
    assert_eq!(report["euler"], 2);
    assert!(report["max_distance"].as_f64().unwrap() <= 1e-9);
    let (vertices, triangles) = (report["vertices"].as_u64().unwrap(), report["triangles"].as_u64().unwrap());

    let mut file = std::fs::File::open(path("a.stl")).unwrap();
    let read = stl_io::read_stl(&mut file).unwrap();
    closed_and_manifold(read.faces.iter().map(|face| face.vertices));
    assert_eq!((read.vertices.len() as u64, read.faces.len() as u64), (vertices, triangles));

    mesh("a.ply", "1");
    let mut file = std::io::BufReader::new(std::fs::File::open(path("a.ply")).unwrap());
    let parser = ply_rs_bw::parser::Parser::<ply_rs_bw::ply::DefaultElement>::new();
    let ply = parser.read_ply(&mut file).unwrap();
    assert_eq!(ply.payload["vertex"].len() as u64, vertices);
    assert_eq!(ply.payload["face"].len() as u64, triangles);

    for name in ["stl", "ply", "obj", "vtp", "glb", "3mf"] {
        mesh(&format!("one.{name}"), "1");
        mesh(&format!("two.{name}"), "2");
        let bytes = |which: &str| std::fs::read(path(&format!("{which}.{name}"))).unwrap();
        assert!(bytes("one") == bytes("two"), "{name} depends on the number of threads");
        assert!(bytes("one").len() > 1000);
    }
}

#[test]
fn figures_of_a_small_solid_have_their_digits() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("small.rfm"), "rfm 1\nsolid small = sphere(1 mm)\n").unwrap();
    let text =
        rfm(folder.path(), &["mesh", "small.rfm", "--cells", "64", "-o", "small.stl"]).expect(0).stdout;
    let figure = |name: &str| -> f64 {
        let (_, after) = text.split_once(&format!("{name}: ")).unwrap();
        after.split([',', '\n']).next().unwrap().parse().unwrap()
    };
    let (volume, area) = (4e-9 / 3.0 * std::f64::consts::PI, 4e-6 * std::f64::consts::PI);
    assert!((figure("volume") / volume - 1.0).abs() < 2e-3, "{text}");
    assert!((figure("area") / area - 1.0).abs() < 2e-3, "{text}");
}

#[test]
fn a_negative_number_of_cells_is_told_what_is_expected() {
    let said = rfm(root(), &["mesh", PAWN, "--cells", "-5", "-o", "pawn.stl"]);
    assert_eq!(said.code, 2);
    let text = said.stderr;
    assert!(text.contains("'-5' for '--cells <N>'") && !text.contains("-- -5"), "{text}");
}

#[test]
fn quality_and_sharp_creases() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pawn.stl").to_str().unwrap().to_string();
    let measured = |method: &str| {
        let arguments = [
            "mesh",
            PAWN,
            "--cells",
            "48",
            "--method",
            method,
            "--quality",
            "--ascii",
            "--json",
            "-o",
            &path,
        ];
        let outcome = rfm(root(), &arguments).expect(0);
        let document = outcome.json();
        contract(&outcome.stdout, &document, &MESH_KEYS);
        assert_eq!((&document["method"], &document["closed"]), (&method.into(), &true.into()));
        let mut file = std::fs::File::open(&path).unwrap();
        let read = stl_io::read_stl(&mut file).unwrap();
        closed_and_manifold(read.faces.iter().map(|face| face.vertices));
        document["quality"].clone()
    };
    let number = |quality: &serde_json::Value, key: &str| quality[key].as_f64().unwrap();
    let (cut, sharp) = (measured("mc"), measured("dc"));
    for key in ["hausdorff", "mesh_to_surface_rms", "surface_to_mesh_max", "normal_error_rms", "slivers"] {
        assert!(number(&sharp, key) < 0.6 * number(&cut, key), "{key}: {sharp} {cut}");
    }
    assert_eq!(sharp["flipped"], 0);
    // 48 cells of the pawn's 1.47 m
    assert!(number(&sharp, "hausdorff") < 0.5 * 1.5 / 48.0, "{sharp}");
    let without = rfm(root(), &["mesh", PAWN, "--cells", "24", "--json"]).expect(0).json();
    assert!(without.get("quality").is_none());
}

#[test]
fn a_budget_ends_the_measuring_of_quality_and_says_so() {
    let quality = |budget: &str| {
        let arguments = ["mesh", PAWN, "--cells", "24", "--quality", "--json", "--budget", budget];
        let outcome = rfm(root(), &arguments).expect(0);
        (outcome.json()["quality"]["measured"].as_f64(), outcome.stderr)
    };
    let (all, said) = quality("60 s");
    assert!(all == Some(1.0) && !said.contains("quality"), "{all:?} {said}");
    let (none, said) = quality("0");
    assert!(none.is_none() && said.contains("the quality was not measured"), "{none:?} {said}");
}

#[test]
fn odd_solids_are_meshed_or_refused() {
    let mesh = |text: &str, flags: &[&str]| {
        let arguments = [&["mesh", "-", "--cells", "20", "--json"], flags].concat();
        rfm_reading(root(), &arguments, format!("rfm 1\nsolid s = {text}").as_bytes())
    };
    let empty = mesh("sphere(1) and sphere(1).move([3, 0, 0])", &[]).expect(1);
    assert_eq!((&empty.json()["triangles"], &empty.json()["manifold"]), (&0.into(), &false.into()));
    assert!(empty.stderr.contains("empty"), "{}", empty.stderr);
    let unbounded = mesh("x^2 + y^2 <= 1", &[]).expect(2);
    assert!(unbounded.stderr.contains("--box"), "{}", unbounded.stderr);
    let cut = mesh("x^2 + y^2 <= 1", &["--box", "-2,-2,-1,2,2,1"]).expect(0).json();
    assert_eq!((cut["closed"].as_bool(), cut["components"].as_u64()), (Some(true), Some(1)));
    let full = mesh("1", &["--box", "0,0,0,1,1,1"]).expect(0).json();
    assert_eq!(full["closed"], true);
    assert_eq!(mesh("x and not x", &["--box", "-1,-1,-1,1,1,1"]).expect(1).json()["triangles"], 0);
}

#[test]
fn meshes_are_in_the_unit_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("post.rfm"), SMALL).unwrap();
    let largest = |unit: &str| {
        let arguments = ["mesh", "post.rfm", "-o", "p.stl", "--ascii", "--cells", "16", "--unit", unit];
        let outcome = rfm(here, &arguments).expect(0);
        let text = std::fs::read_to_string(here.join("p.stl")).unwrap();
        let numbers = text.lines().filter_map(|line| line.strip_prefix("vertex ")).flat_map(|v| v.split(' '));
        (outcome.stdout, numbers.map(|x| x.parse::<f64>().unwrap()).fold(0.0, f64::max))
    };
    for (unit, plural, expected) in
        [("m", "metres", 0.6), ("mm", "millimetres", 600.0), ("in", "inches", 0.6 / 0.0254)]
    {
        let (told, found) = largest(unit);
        assert!(told.contains(&format!("in {plural}")), "{told}");
        assert!((found / expected - 1.0).abs() < 1e-6, "{unit}: {found}");
    }
    let plain = rfm(here, &["mesh", "post.rfm", "-o", "p.stl", "--cells", "16"]).expect(0);
    assert!(plain.stdout.contains("in metres; most programs read .stl as millimetres: --unit mm"));
}

/// A bearing with half a millimetre of play in cells of 1.3 mm: where two faces lie in one cell, triangles of marching cubes
/// pass through each other.
#[test]
fn triangles_that_cross_are_told_of() {
    let text = "rfm 1
let ring = cylinder(40 mm, 18 mm) \\ cylinder(34 mm, 1).move([0, 0, -0.5])
    or cylinder(26 mm, 18 mm) \\ cylinder(20 mm, 1).move([0, 0, -0.5])
solid bearing = ring \\ torus(30 mm, 5.5 mm).move([0, 0, 9 mm])
    or any i in 0..9: sphere(5 mm, [30 mm, 0, 9 mm]).rotate_z(i*40 deg)
";
    let said = |method: &str| {
        let arguments = ["mesh", "-", "--cells", "64", "--json", "--method", method];
        rfm_reading(root(), &arguments, text.as_bytes()).expect(0).stderr
    };
    assert!(
        said("mc").contains("pairs of triangles cross: more cells part them, and `--method dc`"),
        "{}",
        said("mc")
    );
    assert!(!said("dc").contains("triangles cross"), "{}", said("dc"));
}
