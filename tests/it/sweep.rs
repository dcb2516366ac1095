//! Swept contact: no hit is missed, no clear miss is reported, and the time of entry is that of exact
//! arithmetic.

use rfm::field::{Entry, Path, Walls};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::ir::exact;
use rfm::solid::{Bounds, CellMap, ProgramKind};
use rfm::{Engine, Field, Program, Solid};

use crate::random::Random;

/// What is swept: the paper's obstacles, leaves that are not polynomials, and parts that are thin or touch
/// each other.
const SHAPES: &str = "rfm 1
solid ring = torus(0.8, 0.3).rotate_x(0.7)
solid cap = cone(0.7, 1.2).rotate_y(0.4)
solid pill = capsule(0.3, 1).rotate_y(1)
solid balls = any i in 0..12: ball([cos(2*i), sin(3*i), cos(5*i)], 0.2 + 0.02*i)
solid shell = sphere(0.9) and not sphere(0.9 - 1e-6)
solid plates = abs(x) <= 5e-7 or abs(y - 0.3*x) <= 1e-6 or -1e-6 <= z <= 0
solid tangent = sphere(0.5).move([0.5, 0, 0]) or sphere(0.5).move([-0.5, 0, 0])
solid waves = z <= 0.2*sin(7*x)*cos(5*y) and z >= -0.5
solid mixed = (torus(0.8, 0.3) or cone(0.5, 1.1)) \\ ball([0.7, 0, 0.2], 0.4) and x + y/2 <= 0.9
solid egg = ellipsoid(0.9, 0.5, 0.3) and not ellipsoid(0.5, 0.5, 0.5)
solid quartic = (x^2 + y^2)^2 <= x^2 - y^2 - z^2
solid rounded = ((0.8 - abs(x)) and (0.5 - abs(y)) and (0.4 - abs(z))) >= 0.05
";

const NAMES: [&str; 12] = [
    "ring", "cap", "pill", "balls", "shell", "plates", "tangent", "waves", "mixed", "egg", "quartic",
    "rounded",
];

fn solid(definition: &str) -> Solid {
    let program = Program::from_source("t.rfm", format!("rfm 1\nsolid s = {definition}"));
    program.unwrap_or_else(|e| panic!("{e}")).solid("s").unwrap()
}

/// Solids, each with the centre of the box of half size 1.2 around it.
fn solids(engine: Engine) -> Vec<(Solid, DVec3)> {
    let shapes = Program::from_source("shapes.rfm", SHAPES).unwrap_or_else(|e| panic!("{e}"));
    let mut all: Vec<_> =
        NAMES.map(|name| (shapes.solid_with(name, engine).unwrap(), DVec3::ZERO)).into_iter().collect();
    for name in ["pawn", "bishop"] {
        let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
        let program = Program::from_path(path).unwrap_or_else(|e| panic!("{e}"));
        all.push((program.solid_with(name, engine).unwrap(), DVec3::new(1.5, 1.5, 0.75)));
    }
    all
}

/// The exact sign of the solid at a fraction of a path, at the point that the path really has there.
fn exact_sign(solid: &Solid, from: DVec3, to: DVec3, t: f64) -> Option<f64> {
    // multiples of 2⁻³⁰ make the point exact in a double
    let (graph, outputs) = solid.graph(ProgramKind::Sign);
    Some(exact::evaluate(graph, outputs, (from + (to - from) * t).to_array())?[0].sign())
}

/// A point whose coordinates are multiples of 2⁻³⁰, so that multiples of it are exact.
fn coarse(p: DVec3) -> DVec3 {
    (p * f64::from(1 << 30)).round() / f64::from(1 << 30)
}

/// Judges one path by dense samples. Every sample before the entry is in the fluid, a certain entry has a
/// point inside, and a path without an entry has none. Samples whose sign is in doubt are evaluated exactly.
fn judge(solid: &Solid, from: DVec3, to: DVec3, found: Option<Entry>, places: &mut dyn Iterator<Item = f64>) {
    let name = solid.name();
    for t in places {
        if found.is_some_and(|entry| t >= entry.t) {
            continue;
        }
        let inside = Field::omega(&solid.twin(), from + (to - from) * t) >= 0.0;
        let really = inside && exact_sign(solid, from, to, t).is_none_or(|sign| sign >= 0.0);
        assert!(!really, "{name}: {from} → {to} is inside at {t}, found {found:?}");
    }
    if let Some(entry) = found {
        assert!(entry.t <= entry.until && (0.0..=1.0).contains(&entry.t), "{name}: {entry:?}");
        let steps = (0..=64).map(|k| entry.t + (entry.until - entry.t) * f64::from(k) / 64.0);
        let nearest =
            steps.map(|t| Field::omega(&solid.twin(), from + (to - from) * t)).fold(f64::MIN, f64::max);
        // a certain entry has a point inside; an uncertain one grazes the surface within rounding
        assert!(nearest >= -1e-13, "{name}: {from} → {to} is not met at {entry:?}: {nearest:e}");
    }
}

#[test]
fn random_paths_miss_nothing() {
    let mut random = Random(1);
    for (solid, middle) in solids(Engine::Auto) {
        let twin = solid.twin();
        let (mut hits, mut uncertain) = (0, 0);
        for k in 0..2_000 {
            let length = [3.0, 1.0, 0.1, 0.01][k % 4];
            let from = coarse(middle + 1.2 * random.around(1.0));
            let to = coarse(from + length * random.around(1.0));
            let found = solid.first_entry(from, to);
            judge(&solid, from, to, found, &mut (0..=512).map(|i| f64::from(i) / 512.0));
            let Some(entry) = found else { continue };
            hits += 1;
            uncertain += i32::from(!entry.certain);
            if Field::omega(&twin, from) > 0.0 {
                assert_eq!(entry.t, 0.0, "{}: starts inside", solid.name());
            }
        }
        assert!(hits > 50, "{}: {hits} hits", solid.name());
        assert!(uncertain <= 2, "{}: {uncertain} of {hits} in doubt", solid.name());
    }
}

/// Where a path first has a sample that is not in the fluid.
fn first_sample(solid: &Solid, from: DVec3, to: DVec3) -> Option<f64> {
    const SAMPLES: u32 = 2048;
    let places = (0..=SAMPLES).map(|k| f64::from(k) / f64::from(SAMPLES));
    let mut before = 0.0;
    for t in places {
        if solid.sign(from + (to - from) * t) >= 0.0 {
            let (mut out, mut inside) = (before, t);
            for _ in 0..60 {
                let middle = 0.5 * (out + inside);
                if solid.sign(from + (to - from) * middle) >= 0.0 { inside = middle } else { out = middle }
            }
            return Some(inside);
        }
        before = t;
    }
    None
}

/// Paths on which a part of the formula does not change: its derivatives there are 0, or next to nothing.
#[test]
fn entries_along_axes_are_where_the_surface_is() {
    let mut random = Random(3);
    let heights = [
        "sqrt(x + 2)",
        "sin(3*x)",
        "exp(x)",
        "x^3",
        "(x + 2)^0.5",
        "1/(x + 3)",
        "atan(x)",
        "hypot(x, 0.3)",
        "log2(x + 3)",
        "cos(z)",
        "abs(x)",
        "min(x, 0.2)",
        "max(x, 0)",
        "clamp(x, -0.3, 0.4)",
        "step(0.1, x)",
        "floor(2*x)",
        "x*z",
        "max(x, z)*sin(y)",
    ];
    let mut solids: Vec<(Solid, Aabb)> =
        heights.map(|h| (solid(&format!("y <= {h}")), Aabb::new(DVec3::splat(-1.0), DVec3::ONE))).into();
    for name in ["bottle", "gear", "hull", "hood", "labyrinth_weir", "screw"] {
        let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
        let program = Program::from_path(path).unwrap_or_else(|e| panic!("{e}"));
        let name = program.solids().next().unwrap().to_string();
        let solid = program.solid(&name).unwrap();
        let Bounds::Within(bounds) = *solid.bounds() else { panic!("{name}") };
        solids.push((solid, bounds));
    }
    for (solid, around) in solids {
        let (mut met, mut doubts) = (0, 0);
        for k in 0..300 {
            let from = around.centre() + 0.7 * around.size() * random.around(1.0);
            let mut way = DVec3::ZERO;
            way[k % 3] = if k % 2 == 0 { around.size()[k % 3] } else { -around.size()[k % 3] };
            if k % 4 == 3 {
                way = around.size() * random.around(1.0);
            }
            let to = from + way;
            let Some(truth) = first_sample(&solid, from, to) else { continue };
            let name = solid.name();
            let mut path = Path::new(from, to, f64::INFINITY);
            // where a formula jumps its value may be any between both sides
            let entry = loop {
                let entry = Walls::first_entry(&solid, &path);
                let entry = entry.unwrap_or_else(|| panic!("{name}: {from} → {to} misses {truth}"));
                if entry.certain {
                    break entry;
                }
                assert!(entry.until < entry.t + 1e-9, "{name}: {from} → {to} is in doubt at {entry:?}");
                path.start = entry.until.next_up();
                doubts += 1;
            };
            met += 1;
            // samples may jump over what the path meets before
            let sign = solid.sign(from + way * (entry.t + 2e-7).min(1.0));
            let is_there = entry.t <= truth + 1e-12 && (truth - entry.t < 2e-7 || sign >= 0.0);
            assert!(is_there, "{name}: {from} → {to}: {entry:?}, not {truth}");
        }
        assert!(met > 10 && doubts <= met, "{}: {doubts} doubts on {met} paths", solid.name());
    }
}

/// Paths that touch the surface, or pass it at 1e-3 to 1e-15 on either side. They are judged where it
/// matters, around the touching point, and in exact arithmetic.
#[test]
fn grazing_paths_miss_nothing() {
    let mut random = Random(2);
    for (solid, middle) in solids(Engine::Auto) {
        let mut touched = 0;
        let mut missed = 0;
        while touched + missed < 300 {
            let (a, b) = (middle + 1.2 * random.around(1.0), middle + 1.2 * random.around(1.0));
            let Some(entry) = solid.first_entry(a, b).filter(|e| e.t > 0.0 && e.certain) else { continue };
            let Some(normal) = entry.normals.mean() else { continue };
            let Some(tangent) = normal.cross(random.around(1.0)).try_normalize() else { continue };
            let offset = 10f64.powf(-3.0 - 12.0 * random.unit()) * (2.0 * random.unit() - 1.0);
            let centre = coarse(entry.point) + offset * normal;
            let half = 0.3 * random.unit();
            let (from, to) = (centre - half * tangent, centre + half * tangent);
            let found = solid.first_entry(from, to);
            if found.is_some() {
                touched += 1
            } else {
                missed += 1
            }
            let around = (2..=9).flat_map(|e| (-5..=5).map(move |k| 0.5 + f64::from(k) * 10f64.powi(-e)));
            judge(&solid, from, to, found, &mut around.filter(|t| (0.0..=1.0).contains(t)));
        }
        assert!(touched > 10, "{}: {touched} {missed}", solid.name());
    }
}

#[test]
fn a_thin_wall_is_hit_where_it_is() {
    // (0.05 − 5e-7)/0.1. Undecided stretches are 1e-12 long. The product (x + w)(w − x) at x = −0.05 is known
    // to 1e-16 of its value, 0.0025, which its slope at the wall, 1e-7, turns into 1e-10 of the path
    for (definition, tolerance) in
        [("abs(x) <= 5e-7", 2e-12), ("-5e-7 <= x <= 5e-7", 2e-10), ("sqrt(x^2) <= 5e-7", 2e-12)]
    {
        let wall = solid(definition);
        let hit = wall.first_entry(DVec3::new(-0.05, 0.3, 0.1), DVec3::new(0.05, 0.3, 0.1)).unwrap();
        assert!(hit.certain && (hit.t - 0.499995).abs() < tolerance, "{definition}: {hit:?}");
        assert!(hit.until > 0.500005, "{definition}: {hit:?}");
        assert_eq!(hit.normals.mean(), Some(-DVec3::X), "{definition}");
    }
}

#[test]
fn a_sphere_is_grazed_or_passed() {
    let sphere = solid("x^2 + y^2 + z^2 <= 1");
    let at = |y: f64| sphere.first_entry(DVec3::new(-2.0, y, 0.0), DVec3::new(2.0, y, 0.0));
    let hit = at(1.0 - 1e-12).unwrap();
    // 16(t − ½)² = 2e-12. The coefficients −4, 16 and −16 are known to about 4 roundings of 16 (8e-15), which
    // move the root by that over the slope there, 1.1e-5
    assert!((hit.t - 0.4999996464466094).abs() < 2e-9 && hit.certain, "{hit:?}");
    assert!((hit.until - 0.5000003535533906).abs() < 2e-9, "{hit:?}");
    assert_eq!(at(1.0 + 1e-12), None);
    let touch = at(1.0).unwrap();
    // within rounding it may be a hit: 16(t − ½)² ≤ 1e-14
    assert!(!touch.certain && (touch.t - 0.5).abs() < 1e-7, "{touch:?}");
}

#[test]
fn edges_and_corners_name_their_faces() {
    let cube = solid("box([0,0,0], [1,1,1])");
    let normals = |from: [f64; 3], to: [f64; 3]| {
        let entry = cube.first_entry(DVec3::from_array(from), DVec3::from_array(to)).unwrap();
        let mut normals: Vec<[f64; 3]> = entry.normals.iter().map(|n| n.to_array()).collect();
        normals.sort_by(|a, b| a.partial_cmp(b).unwrap());
        (entry.t, normals)
    };
    let (x, y, z) = ([-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]);
    let zero = |normals: &[[f64; 3]]| normals.iter().map(|n| n.map(|c| c + 0.0)).collect::<Vec<_>>();
    let (t, face) = normals([-1.0, 0.5, 0.5], [1.0, 0.5, 0.5]);
    assert!((t - 0.5).abs() < 1e-14);
    assert_eq!(zero(&face), vec![x]);
    let (t, edge) = normals([-1.0, -1.0, 0.5], [1.0, 1.0, 0.5]);
    assert!((t - 0.5).abs() < 1e-14);
    assert_eq!(zero(&edge), vec![x, y]);
    let (_, corner) = normals([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]);
    assert_eq!(zero(&corner), vec![x, y, z]);
    // the inner edge of two walls
    let walls = solid("x <= 0 or y <= 0");
    let entry = walls.first_entry(DVec3::new(1.0, 1.0, 0.0), DVec3::new(-1.0, -1.0, 0.0)).unwrap();
    assert!((entry.t - 0.5).abs() < 1e-14 && entry.normals.len() == 2, "{entry:?}");
    // the apex of a cone, from above
    let entry = solid("cone(1, 2)").first_entry(DVec3::Z * 3.0, DVec3::Z).unwrap();
    assert!((entry.t - 0.5).abs() < 1e-9 && entry.certain, "{entry:?}");
}

#[test]
fn every_engine_and_view_finds_the_same_entry() {
    let (jit, plain) = (solids(Engine::Jit), solids(Engine::Interpreter));
    let mut random = Random(3);
    for ((jit, middle), (plain, _)) in jit.iter().zip(&plain) {
        let box_ = Aabb::new(*middle - 1.2, *middle + 1.2);
        let map = CellMap::new(jit, box_).unwrap();
        let mut hits = 0;
        for k in 0..500 {
            let from = *middle + 1.3 * random.around(1.0);
            let to = from + [2.0, 0.2, 0.02, 0.002][k % 4] * random.around(1.0);
            let found = jit.first_entry(from, to);
            assert_eq!(found, plain.first_entry(from, to), "{jit:?}");
            let by_map = map.first_entry(&Path::new(from, to, 1.0));
            hits += i32::from(found.is_some());
            assert_eq!(found.is_some(), by_map.is_some(), "{jit:?}: {from} → {to}, {found:?} {by_map:?}");
            if let (Some(a), Some(b)) = (found, by_map) {
                // leaves are narrowed from other stretches, and the ends of undecided ones are 1e-12 long
                assert!((a.t - b.t).abs() < 2e-12 && a.certain == b.certain, "{jit:?}: {a:?} {b:?}");
            }
        }
        assert!(hits > 10, "{jit:?}: {hits}");
    }
}

#[test]
fn odd_paths_have_an_answer() {
    for (solid, middle) in solids(Engine::Auto) {
        let nowhere = solid.first_entry(DVec3::NAN, middle);
        assert!(nowhere.is_some_and(|entry| !entry.certain), "{nowhere:?}");
        assert!(solid.first_entry(middle, DVec3::INFINITY).is_some());
        assert_eq!(solid.first_entry(middle + 1e6, middle + 2e6).map(|e| e.certain), None);
        // a point is a path
        let here = solid.first_entry(middle, middle);
        assert_eq!(here.is_some(), Field::omega(&solid.twin(), middle) >= 0.0, "{solid:?}: {here:?}");
    }
}
