//! Meshes from files as leaves of solids: in all programs, joined with R-functions.

use std::sync::Arc;

use rfm::diagnostic::Source;
use rfm::files::{Files, Reader, Unread};
use rfm::geom::Aabb;
use rfm::glam::{DVec3, Vec3};
use rfm::lower::Options;
use rfm::mesh::{Grid, Resolution, Unwatched, check, dual_contouring, marching_cubes};
use rfm::source::{self, Target};
use rfm::{Engine, Program, Solid};

use crate::random::Random;

type Soup = Vec<[DVec3; 3]>;

/// One file, whatever its name.
struct OneFile(Vec<u8>);

impl Reader for OneFile {
    fn read(&self, _: &str) -> Result<Vec<u8>, Unread> {
        Ok(self.0.clone())
    }
}

fn program(text: &str, file: Vec<u8>) -> Program {
    let options = Options { files: Files::new(Arc::new(OneFile(file))), ..Options::default() };
    Program::check(Source::file("t.rfm", format!("rfm 1\n{text}")), options).unwrap_or_else(|e| panic!("{e}"))
}

fn binary_stl(soup: &Soup) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((soup.len() as u32).to_le_bytes());
    for triangle in soup {
        bytes.extend([0; 12]);
        for c in triangle.iter().flat_map(|p| p.to_array()) {
            bytes.extend((c as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn text_stl(soup: &Soup) -> Vec<u8> {
    let mut text = String::from("solid part\n");
    for [a, b, c] in soup {
        text += "facet normal 0 0 0\nouter loop\n";
        for p in [a, b, c] {
            text += &format!("vertex {} {} {}\n", p.x, p.y, p.z);
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid\n").into_bytes()
}

fn obj(soup: &Soup) -> Vec<u8> {
    let mut text = String::from("# a part\n");
    for (i, [a, b, c]) in soup.iter().enumerate() {
        for p in [a, b, c] {
            text += &format!("v {} {} {}\n", p.x, p.y, p.z);
        }
        text += &if i % 2 == 0 {
            format!("f {} {}/1 {}//2\n", 3 * i + 1, 3 * i + 2, 3 * i + 3)
        } else {
            "f -3 -2 -1\n".into()
        };
    }
    text.into_bytes()
}

fn ply(soup: &Soup, format: &str) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat {format} 1.0\ncomment a part\nelement vertex {}\nproperty float x\nproperty uchar red\n\
         property float y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        3 * soup.len(),
        soup.len()
    )
    .into_bytes();
    let put = |out: &mut Vec<u8>, little: &[u8]| match format {
        "binary_big_endian" => out.extend(little.iter().rev()),
        _ => out.extend(little),
    };
    for p in soup.iter().flatten() {
        let [x, y, z] = p.to_array().map(|c| c as f32);
        if format == "ascii" {
            out.extend(format!("{} 7 {} {}\n", p.x, p.y, p.z).into_bytes());
        } else {
            put(&mut out, &x.to_le_bytes());
            out.push(7);
            put(&mut out, &y.to_le_bytes());
            put(&mut out, &z.to_le_bytes());
        }
    }
    for i in 0..soup.len() as u32 {
        let corners = [3 * i, 3 * i + 1, 3 * i + 2];
        if format == "ascii" {
            out.extend(format!("3 {} {} {}\n", corners[0], corners[1], corners[2]).into_bytes());
        } else {
            out.push(3);
            corners.iter().for_each(|c| put(&mut out, &c.to_le_bytes()));
        }
    }
    out
}

/// The mesh of a pawn, in single precision as a file has it.
fn pawn(cells: usize) -> Soup {
    let path = format!("{}/examples/pawn.rfm", env!("CARGO_MANIFEST_DIR"));
    let solid = Program::from_path(path).unwrap().solid("pawn").unwrap();
    let grid = Grid::around(&solid.bounds().aabb().unwrap(), Resolution::Cells(cells)).unwrap();
    let mesh = marching_cubes(&*solid.surface(*grid.bounds()), &grid, &Unwatched).unwrap();
    let corner = |i: u32| mesh.positions[i as usize].as_vec3().as_dvec3();
    mesh.triangles.iter().map(|t| t.map(corner)).collect()
}

const HOLES: &str = "solid part = mesh(\"part.stl\") \\ cylinder(0.15, 3).move([1.5, 1.5, -1])
  \\ any i in 0..3: ball([1.5 + 0.4*cos(2*pi*i/3), 1.5 + 0.4*sin(2*pi*i/3), 0.3], 0.18)";

#[test]
fn all_formats_give_the_same_solid() {
    let soup = pawn(12);
    let at = |name: &str, file: Vec<u8>| {
        let solid = program(&format!("solid part = mesh(\"{name}\")"), file).solid("part").unwrap();
        let mut random = Random(3);
        (0..200).map(|_| solid.omega(random.in_cube() * 3.0).to_bits()).collect::<Vec<u64>>()
    };
    let expected = at("a.stl", binary_stl(&soup));
    for (name, file) in [
        ("a.STL", text_stl(&soup)),
        ("a.obj", obj(&soup)),
        ("a.ply", ply(&soup, "ascii")),
        ("a.ply", ply(&soup, "binary_little_endian")),
        ("a.ply", ply(&soup, "binary_big_endian")),
    ] {
        assert_eq!(at(name, file), expected, "{name}");
    }
}

#[test]
fn a_unit_scales_the_solid() {
    let soup = pawn(12);
    let in_metres = program("solid s = mesh(\"a.stl\")", binary_stl(&soup)).solid("s").unwrap();
    let in_mm = program("solid s = mesh(\"a.stl\", 1 mm)", binary_stl(&soup)).solid("s").unwrap();
    let mut random = Random(4);
    for _ in 0..200 {
        let p = random.in_cube() * 3.0;
        assert!((in_metres.omega(p) - 1e3 * in_mm.omega(p * 1e-3)).abs() < 1e-12);
    }
}

#[test]
fn a_mesh_that_is_moved_alone_keeps_its_triangles() {
    let soup = pawn(16);
    let volume_and_area = |text: &str| {
        let solid = program(&format!("solid s = {text}"), binary_stl(&soup)).solid("s").unwrap();
        solid.triangles().map(|(places, triangles)| {
            let shells = rfm::mesh::shells(&rfm::mesh::Mesh::from_triangles(places.clone(), triangles));
            // they are the surface of the solid where it is
            let bounds = solid.bounds().aabb().unwrap();
            assert!(
                places.iter().all(|p| bounds.grown(1e-9).contains(*p) && solid.omega(*p).abs() < 1e-9),
                "{text}"
            );
            shells.iter().fold([0.0; 2], |[v, a], shell| [v + shell.volume, a + shell.area])
        })
    };
    let [volume, area] = volume_and_area("mesh(\"p.stl\")").unwrap();
    assert!(volume > 0.0);
    for (change, factor) in [
        (".rotate_z(30 deg).move([0.1, 0.2, 0.3])", 1.0_f64),
        (".scale(3).rotate([1, 2, 3], 0.7, [0, 0, 1])", 3.0),
        (".mirror([1, 1, 0])", 1.0),
        (".move([sin(t), 0, 0]).rotate_x(t)", 1.0),
    ] {
        let [moved, its_area] = volume_and_area(&format!("mesh(\"p.stl\"){change}")).unwrap();
        assert!((moved / (factor.powi(3) * volume) - 1.0).abs() < 1e-12, "{change}: {moved} {volume}");
        assert!((its_area / (factor.powi(2) * area) - 1.0).abs() < 1e-12, "{change}: {its_area} {area}");
    }
    for other in ["mesh(\"p.stl\").offset(0.01)", "mesh(\"p.stl\") and z <= 0.1", "mesh(\"p.stl\").turned(z)"]
    {
        assert_eq!(volume_and_area(other), None, "{other}");
    }
}

/// Machine code, for points and columns, in both precisions, has the bits of the interpreter.
#[test]
fn programs_are_the_interpreter() {
    let program =
        program(&format!("{HOLES}\nsolid turned = part.rotate_x(20 deg).twist(0.1)"), binary_stl(&pawn(16)));
    for name in ["part", "turned"] {
        let [jit, interpreter] =
            [Engine::Jit, Engine::Interpreter].map(|engine| program.solid_with(name, engine).unwrap());
        let mut random = Random(9);
        let points: Vec<DVec3> =
            (0..401).map(|_| random.in_cube() * 3.0).chain([DVec3::NAN, DVec3::INFINITY]).collect();
        let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan() || a == b;
        let axes: [Vec<f64>; 3] = std::array::from_fn(|i| points.iter().map(|p| p[i]).collect());
        let columns = axes.each_ref().map(|axis| &axis[..]);
        let mut out = [(); 5].map(|()| vec![0.0; points.len()]);
        let all = |solid: &Solid, p: DVec3| {
            let (omega, gradient) = solid.omega_grad(p);
            [omega, gradient.x, gradient.y, gradient.z, solid.sign(p)]
        };
        jit.omega_grad_many(columns, out[..4].each_mut_array());
        for (i, &p) in points.iter().enumerate() {
            let (a, b) = (all(&jit, p), all(&interpreter, p));
            assert!(std::iter::zip(a, b).all(|(a, b)| same(a, b)), "{name} at {p}: {a:?}, {b:?}");
            assert!(same(jit.omega(p), interpreter.omega(p)), "{name} at {p}");
            assert!((0..4).all(|k| same(out[k][i], b[k])), "{name} at {p}");
            let p = p.as_vec3();
            assert!(same(jit.omega_f32(p).into(), interpreter.omega_f32(p).into()), "{name} at {p} in f32");
        }
        for &p in points.iter().filter(|p| p.is_finite()) {
            let (a, b) = (jit.contact(p), interpreter.contact(p));
            assert!(
                same(a.distance, b.distance) && a.normal == b.normal && a.mean_curvature == b.mean_curvature,
                "{name} at {p}"
            );
        }
    }
}

trait Columns<'a> {
    fn each_mut_array(self) -> [&'a mut [f64]; 4];
}

impl<'a> Columns<'a> for &'a mut [Vec<f64>] {
    fn each_mut_array(self) -> [&'a mut [f64]; 4] {
        let [a, b, c, d] = self else { panic!("four columns") };
        [a, b, c, d]
    }
}

#[test]
fn gradients_are_differences_and_ranges_hold_all_values() {
    let program = program(HOLES, binary_stl(&pawn(16)));
    let solid = program.solid("part").unwrap();
    let mut random = Random(2);
    let mut far = 0;
    for _ in 0..3000 {
        let p = random.in_cube() * 3.0;
        let (_, gradient) = solid.omega_grad(p);
        let h = 1e-6;
        let difference = DVec3::from_array(
            [DVec3::X, DVec3::Y, DVec3::Z]
                .map(|axis| (solid.omega(p + h * axis) - solid.omega(p - h * axis)) / (2.0 * h)),
        );
        // but where the nearest triangle or the deciding leaf changes between the points
        far += usize::from((gradient - difference).length() > 1e-5);
        let over = Aabb::new(p, p + random.in_cube() * 3.0 * random.unit() * 0.2);
        let range = solid.range(&over);
        for _ in 0..5 {
            let part = DVec3::new(random.unit(), random.unit(), random.unit());
            let value = solid.omega((over.min + part * over.size()).clamp(over.min, over.max));
            assert!(range.contains(value), "{value} not in {range:?}");
        }
    }
    assert!(far < 30, "{far}");
}

#[test]
fn contacts_are_distances_from_the_mesh() {
    let soup = pawn(16);
    let solid = program("solid part = mesh(\"part.stl\").move([0.25, 0, 0])", binary_stl(&soup))
        .solid("part")
        .unwrap();
    let mut random = Random(6);
    for _ in 0..1000 {
        let p = random.in_cube() * 3.0;
        let contact = solid.contact(p);
        assert!((contact.distance + solid.omega(p)).abs() < 1e-12, "{p}");
        assert!((contact.normal.length() - 1.0).abs() < 1e-9);
        let foot = p - contact.distance * contact.normal;
        assert!(solid.omega(foot).abs() < 1e-9, "{p}: {}", solid.omega(foot));
    }
    // a path into the solid ends at its surface
    let (from, to) = (DVec3::new(0.1, 1.5, 0.3), DVec3::new(1.8, 1.5, 0.3));
    let entry = solid.first_entry(from, to).unwrap();
    assert!(solid.omega(entry.point).abs() < 1e-6, "{}", solid.omega(entry.point));
}

#[test]
fn a_pawn_with_holes_has_a_closed_mesh() {
    let program = program(HOLES, binary_stl(&pawn(24)));
    let solid = program.solid("part").unwrap();
    let bounds = solid.bounds().aabb().unwrap();
    assert!(
        bounds.min.cmpge(DVec3::new(0.9, 0.9, -0.01)).all()
            && bounds.max.cmple(DVec3::new(2.1, 2.1, 1.6)).all()
    );
    let grid = Grid::around(&bounds, Resolution::Cells(40)).unwrap();
    let field = solid.surface(*grid.bounds());
    for mesh in [
        marching_cubes(&*field, &grid, &Unwatched).unwrap(),
        dual_contouring(&*field, &grid, &Unwatched).unwrap(),
    ] {
        let report = check(&mesh, &*field);
        assert!(report.closed && report.manifold, "{report:?}");
        let off = mesh.positions.iter().filter(|&&p| solid.omega(p).abs() > 1e-7).count();
        // those that would make triangles cross stay off it
        assert!(off * 60 < mesh.positions.len(), "{off} of {}", mesh.positions.len());
    }
}

#[test]
fn source_text_of_a_mesh_is_refused() {
    let solid = program(HOLES, binary_stl(&pawn(8))).solid("part").unwrap();
    for target in [Target::C, Target::Header, Target::Cuda, Target::Wgsl, Target::Glsl, Target::Rust] {
        let error = source::write(&solid, target, &source::Options::default()).unwrap_err();
        assert!(error.to_string().contains("no formula"), "{error}");
    }
    assert!(source::object(&solid, &source::Options::default(), None).is_err());
}

/// Two meshes that differ make two graphs that differ, in what a run's fingerprint is made of.
#[test]
fn the_fingerprint_of_a_run_knows_the_mesh() {
    let scene = "solid part = mesh(\"part.stl\")
scene drop {
  box { min: [0, 0, 0], max: [3, 3, 3] }
  fluid water { shape: ball([1.5, 1.5, 2.3], 0.4), particles: 200 }
  obstacle { solid: part }
  run { until: 0.1 s, save_every: 0.05 s }
}";
    let soup = pawn(8);
    let mut other = soup.clone();
    for corner in other.iter_mut().flatten() {
        corner.z *= 0.5;
    }
    let [a, b, c] = [soup.clone(), soup, other].map(|soup| {
        let program = program(scene, binary_stl(&soup));
        rfm::Experiment::new(&program, "drop", Engine::Auto).unwrap().fingerprint()
    });
    assert!(a == b && a != c);
}

/// Points in single precision have a value of their own type.
#[test]
fn points_in_single_precision_are_near() {
    let solid = program("solid part = mesh(\"part.stl\")", binary_stl(&pawn(12))).solid("part").unwrap();
    let mut random = Random(8);
    for _ in 0..300 {
        let p: Vec3 = (random.in_cube() * 3.0).as_vec3();
        assert!((f64::from(solid.omega_f32(p)) - solid.omega(p.as_dvec3())).abs() < 1e-6);
    }
}

/// The bars of the project, for a program that is optimised: `cargo test --release -- --ignored study`.
#[test]
#[ignore = "it measures time"]
fn study_of_the_time_for_a_hundred_thousand_triangles() {
    let path = format!("{}/examples/pawn.rfm", env!("CARGO_MANIFEST_DIR"));
    let solid = Program::from_path(path).unwrap().solid("pawn").unwrap();
    let grid = Grid::around(&solid.bounds().aabb().unwrap(), Resolution::Cells(180)).unwrap();
    let mesh = marching_cubes(&*solid.surface(*grid.bounds()), &grid, &Unwatched).unwrap();
    let corner = |i: u32| mesh.positions[i as usize].as_vec3().as_dvec3();
    let soup: Soup = mesh.triangles.iter().map(|t| t.map(corner)).collect();
    let file = binary_stl(&soup);
    let started = std::time::Instant::now();
    let program = program("solid part = mesh(\"part.stl\")", file);
    let solid = program.solid("part").unwrap();
    let setup = started.elapsed();
    let mut random = Random(1);
    let mut axes = [(); 3].map(|()| Vec::new());
    for i in 0..1_000_000 {
        let p = if i % 2 == 0 {
            random.in_cube() * 3.0
        } else {
            DVec3::new(1.5, 1.5, 0.0) + 0.4 * (random.in_cube() * 3.0)
        };
        axes.iter_mut().zip(p.to_array()).for_each(|(axis, c)| axis.push(c));
    }
    let mut omega = vec![0.0; axes[0].len()];
    let started = std::time::Instant::now();
    solid.omega_many(axes.each_ref().map(|axis| &axis[..]), &mut omega);
    let spent = started.elapsed().as_secs_f64() / omega.len() as f64;
    eprintln!(
        "{} triangles: {:.3} s of set-up, {:.0} ns a point",
        soup.len(),
        setup.as_secs_f64(),
        spent * 1e9
    );
    assert!(setup.as_secs_f64() <= 1.0 && spent <= 2e-6);
}

/// A file that names polygons with notches, corners within sides among them, is the solid that it shows.
#[test]
fn notches_of_polygons_stay_empty() {
    let outline = [[0, 0], [1, 0], [3, 0], [3, 2], [2, 2], [2, 1], [1, 1], [1, 2], [0, 2]];
    let n = outline.len();
    let mut text = String::new();
    for z in [0, 1] {
        outline.iter().for_each(|[x, y]| text += &format!("v {x} {y} {z}\n"));
    }
    let line = |corners: &mut dyn Iterator<Item = usize>| {
        "f".to_string() + &corners.map(|corner| format!(" {corner}")).collect::<String>() + "\n"
    };
    text += &line(&mut (1..=n).rev());
    text += &line(&mut (n + 1..=2 * n));
    for i in 1..=n {
        let next = i % n + 1;
        text += &line(&mut [i, next, next + n, i + n].into_iter());
    }
    let solid = program("solid s = mesh(\"u.obj\")", text.into_bytes()).solid("s").unwrap();
    let inside = |p: DVec3| {
        let within = p.x > 0.0 && p.x < 3.0 && p.y > 0.0 && p.y < 2.0 && p.z > 0.0 && p.z < 1.0;
        within && !(p.x > 1.0 && p.x < 2.0 && p.y > 1.0)
    };
    for i in 0..20_000 {
        let part = |k: f64| (0.413_7 + f64::from(i) * k).fract();
        let p =
            DVec3::new(4.0 * part(0.754_877_666), 3.0 * part(0.569_840_29), 2.0 * part(0.430_159_7)) - 0.5;
        assert_eq!(solid.omega(p) > 0.0, inside(p), "{p}");
    }
}
