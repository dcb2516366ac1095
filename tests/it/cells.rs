//! The cell map has the same sign everywhere, the same gradient on the surface and the same mesh, at a cost
//! that does not grow with the number of primitives.

use std::fmt::Write;

use rayon::prelude::*;
use rfm::field::{GradientsMut, Points, Walls};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::mesh::{Grid, Resolution, Unwatched, check, marching_cubes};
use rfm::solid::{CellMap, Place};
use rfm::{Engine, Field, Program, Solid};

use crate::random::Random;

/// A union of balls, some cut by slabs, some of them holes.
fn many(count: usize) -> String {
    let mut random = Random(11);
    let mut text = "rfm 1\nsolid many = (sphere(0.01)".to_string();
    for i in 0..count {
        let p = random.in_box(&Aabb::new(DVec3::splat(0.2), DVec3::splat(2.8)));
        let r = 0.9 * (0.05 + 0.05 * random.unit()) * (500.0 / count as f64).cbrt();
        let _ = write!(text, "\n or ball([{}, {}, {}], {r})", p.x, p.y, p.z);
        if i % 7 == 0 {
            let _ = write!(text, " and z <= {}", p.z + 0.5 * r);
        }
    }
    text + ") \\ ball([1.5, 1.5, 1.5], 0.6)\n"
}

fn solid(text: &str, name: &str, engine: Engine) -> Solid {
    let program = Program::from_source("t.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    program.solid_with(name, engine).unwrap()
}

fn domain() -> Aabb {
    Aabb::new(DVec3::ZERO, DVec3::splat(3.0))
}

fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

#[test]
fn signs_and_surface_gradients_are_those_of_the_twin() {
    let odd =
        "rfm 1\nsolid odd = (sqrt(x - 1) >= 0.3 and y/(z - 1.2) <= 2 or torus(1, 0.2).move([1.5,1.5,1.5]))
      and not (box([0,0,0],[1,1,1]) and ((x and y) >= 0.1)) or normalise(sphere(0.4)).move([2, 2, 2])\n";
    let path = format!("{}/examples/pawn.rfm", env!("CARGO_MANIFEST_DIR"));
    let pawn = std::fs::read_to_string(path).unwrap();
    for (text, name) in [(many(150), "many"), (odd.to_string(), "odd"), (pawn, "pawn")] {
        for engine in [Engine::Jit, Engine::Interpreter] {
            let solid = solid(&text, name, engine);
            let map = CellMap::new(&solid, domain()).unwrap();
            let twin = solid.twin();
            let mut random = Random(5);
            let over = domain().grown(0.2); // so that some points are outside the map
            let count = if engine == Engine::Jit { 8_000 } else { 1_000 };
            let points: Vec<DVec3> = (0..count).map(|_| random.in_box(&over)).collect();
            let column = |axis: usize| points.iter().map(|p| p[axis]).collect::<Vec<f64>>();
            let (x, y, z) = (column(0), column(1), column(2));
            let mut together = vec![0.0; count];
            map.omega_many(Points::new(&x, &y, &z), &mut together);
            for (i, &p) in points.iter().enumerate() {
                let (a, b) = (map.omega(p), twin.omega(p));
                assert_eq!((sign(a), a.is_nan()), (sign(b), b.is_nan()), "{name} at {p}: {a} and {b}");
                assert_eq!(together[i].to_bits(), a.to_bits(), "{name} at {p}");
            }
            gradients_together_are_those_of_each(&map, &points, name);
            // at points of the surface the gradient is that of the leaf there
            let mut found = 0;
            for pair in points.windows(2) {
                let (mut inside, mut outside) = (pair[0], pair[1]);
                if !(twin.omega(inside) > 0.0 && twin.omega(outside) < 0.0) {
                    continue;
                }
                for _ in 0..60 {
                    let middle = 0.5 * (inside + outside);
                    if twin.omega(middle) > 0.0 { inside = middle } else { outside = middle }
                }
                let (a, b) = (map.omega_grad(outside).1.normalize(), twin.omega_grad(outside).1.normalize());
                if a.is_finite() && b.is_finite() {
                    assert!((a - b).length() < 1e-6, "{name} at {outside}: {a} and {b}");
                    found += 1;
                }
            }
            assert!(found > 4, "{name}: {found} points on the surface");
        }
    }
}

fn gradients_together_are_those_of_each(map: &CellMap, points: &[DVec3], name: &str) {
    let column = |axis: usize| points.iter().map(|p| p[axis]).collect::<Vec<f64>>();
    let (px, py, pz) = (column(0), column(1), column(2));
    let [mut omega, mut x, mut y, mut z] = [(); 4].map(|()| vec![0.0; points.len()]);
    let out = GradientsMut { omega: &mut omega, x: &mut x, y: &mut y, z: &mut z };
    map.omega_grad_many(Points::new(&px, &py, &pz), out);
    // all that is not a number is alike
    let bits = |v: f64| if v.is_nan() { f64::NAN.to_bits() } else { v.to_bits() };
    for (i, &p) in points.iter().enumerate() {
        let (value, gradient) = map.omega_grad(p);
        let alone = [value, gradient.x, gradient.y, gradient.z].map(bits);
        assert_eq!([omega[i], x[i], y[i], z[i]].map(bits), alone, "{name} at {p}");
    }
}

/// Gradients off the surface come from leaves nearby, which are found when the first is asked for: tasks that
/// share their threads may ask at the same time, and then no thread may wait for work that another has put
/// off.
#[test]
fn gradients_off_the_surface_may_be_asked_for_by_many_tasks_at_once() {
    let solid = solid(&many(300), "many", Engine::Jit);
    let twin = solid.twin();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
    let mut random = Random(29);
    let points: Vec<DVec3> = (0..64).map(|_| random.in_box(&domain())).collect();
    for _ in 0..20 {
        let map = CellMap::new(&solid, domain()).unwrap();
        let signs: Vec<(i8, i8)> = pool.install(|| {
            let both = |&p: &DVec3| (sign(map.omega_grad(p).0), sign(twin.omega(p)));
            points.par_iter().with_max_len(1).map(both).collect()
        });
        assert!(signs.iter().all(|(near, all)| near == all), "{signs:?}");
    }
}

#[test]
fn ranges_of_the_map_hold() {
    let solid = solid(&many(100), "many", Engine::Jit);
    let map = CellMap::new(&solid, domain()).unwrap();
    let mut random = Random(8);
    let mut decided = 0;
    for _ in 0..5_000 {
        let corner = random.in_box(&domain());
        let over = Aabb::new(corner, corner + 0.1 * random.unit());
        let range = map.range(&over);
        decided += i32::from(range.lo > 0.0 || range.hi < 0.0);
        for _ in 0..5 {
            let p = random.in_box(&over);
            let omega = solid.twin().omega(p);
            assert!(range.lo <= 0.0 || omega > 0.0, "{over:?}: {range:?}, {omega} at {p}");
            assert!(range.hi >= 0.0 || omega < 0.0, "{over:?}: {range:?}, {omega} at {p}");
        }
    }
    assert!(decided > 1_000, "{decided}");
}

#[test]
fn the_mesh_is_the_same() {
    let solid = solid(&many(60), "many", Engine::Jit);
    let map = CellMap::new(&solid, domain()).unwrap();
    let grid = Grid::filling(&domain(), Resolution::Cells(80)).unwrap();
    let [with, without] = [&map as &dyn Walls, &solid.twin()].map(|field| {
        let mesh = marching_cubes(field, &grid, &Unwatched).unwrap();
        check(&mesh, field)
    });
    assert_eq!(
        (with.vertices, with.triangles, with.euler),
        (without.vertices, without.triangles, without.euler)
    );
    assert!(with.closed && with.manifold);
    assert!((with.volume / without.volume - 1.0).abs() < 1e-9, "{} {}", with.volume, without.volume);
    assert!(with.max_distance < 1e-12, "{}", with.max_distance);
}

#[test]
fn leaves_of_one_shape_share_a_program_and_far_cells_need_none() {
    let solid = solid(&many(2_000), "many", Engine::Jit);
    let map = CellMap::new(&solid, domain()).unwrap();
    let stats = map.stats();
    assert!(stats.leaves > 2_000 && stats.shapes <= 6, "{stats:?}");
    assert!(stats.leaves_in_cells < 4 * stats.near, "{stats:?}");
    assert_eq!(map.place_of(DVec3::splat(0.01 + 2.98)), Place::Fluid);
    assert_eq!(map.place_of(DVec3::splat(1.5)), Place::Fluid); // in the hole
    assert_eq!(map.place_of(DVec3::splat(9.0)), Place::Near);
    assert!(map.omega(DVec3::NAN).is_nan());
}

/// Every distance of [`Solid::contact`] below the reach is found, from the same surface, and no other.
#[test]
#[ignore = "long"]
fn contacts_are_those_of_the_solid() {
    let example = |name: &str| {
        let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
        Program::from_path(path).unwrap_or_else(|e| panic!("{e}")).solid(name).unwrap()
    };
    let reach = 0.05;
    for (solid, name) in [
        (solid(&many(200), "many", Engine::Auto), "200 balls"),
        (example("pawn"), "pawn"),
        (example("bishop"), "bishop"),
        (example("cube"), "cube"),
    ] {
        let map = CellMap::with_reach(&solid, domain(), reach).unwrap();
        let mut random = Random(21);
        let (mut near, mut other) = (0, 0);
        let mut points = Vec::new();
        while near < 3_000 {
            let p = random.in_box(&domain().grown(0.01));
            let found = map.contact(p);
            points.push((p, found));
            if map.place_of(p) != Place::Near && points.len() % 10 != 0 {
                continue;
            }
            let truth = solid.contact(p);
            assert_eq!(map.sign(p), solid.sign(p), "{name} at {p}");
            assert!(found.distance.signum() * solid.sign(p) <= 0.0, "{name} at {p}: {found:?}");
            if map.place_of(p) == Place::Fluid || map.place_of(p) == Place::Inside {
                assert_eq!(found.distance.abs(), f64::INFINITY);
            }
            if found.distance.is_infinite() && truth.distance.abs() >= reach {
                continue;
            }
            near += 1;
            // one ulp is allowed, because the solid's program joins leaves in another order
            let same = (found.distance - truth.distance).abs() <= 1e-15
                && (found.normal - truth.normal).length() <= 1e-12
                && (found.mean_curvature - truth.mean_curvature).abs()
                    <= 1e-9 * (1.0 + truth.mean_curvature.abs());
            if !same {
                // a leaf that has no zero within reach, but whose estimated distance says it has
                assert!(found.distance.abs() > truth.distance.abs(), "{name} at {p}: {found:?}, {truth:?}");
                other += 1;
            }
        }
        assert!(other * 1000 <= near, "{name}: {other} of {near} differ");
        let column = |axis: usize| points.iter().map(|(p, _)| p[axis]).collect::<Vec<f64>>();
        let (x, y, z) = (column(0), column(1), column(2));
        let mut columns: [Vec<f64>; 5] = std::array::from_fn(|_| vec![0.0; points.len()]);
        map.contact_many(Points::new(&x, &y, &z), columns.each_mut().map(|c| &mut c[..]));
        let mut signs = vec![0.0; points.len()];
        map.sign_many(Points::new(&x, &y, &z), &mut signs);
        for (i, (p, found)) in points.iter().enumerate() {
            assert_eq!((columns[0][i], columns[3][i]), (found.distance, found.normal.z));
            assert_eq!(signs[i], map.sign(*p), "{name} at {p}");
        }
    }
}

/// No point of a ball that is reported as free lies in the solid or on it, whether a map or only ranges show
/// that. Boxes that are reported as far contain no near place.
#[test]
fn what_is_said_to_be_clear_is_clear() {
    let example = |name: &str| {
        let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
        Program::from_path(path).unwrap_or_else(|e| panic!("{e}")).solid(name).unwrap()
    };
    let reach = 0.09;
    for (solid, name) in [
        (solid(&many(200), "many", Engine::Auto), "200 balls"),
        (example("pawn"), "pawn"),
        (example("bishop"), "bishop"),
    ] {
        let map = CellMap::with_reach(&solid, domain(), reach).unwrap();
        let fields: [(&dyn Walls, bool); 2] = [(&map, true), (&solid, false)];
        let mut random = Random(5);
        for (field, is_map) in fields {
            let (mut partly, mut near, mut far) = (0, 0, 0);
            for _ in 0..600 {
                let p = random.in_box(&domain());
                let radius = field.clearance(p, reach);
                assert!((0.0..=reach).contains(&radius), "{name}: {radius}");
                let truth = solid.contact(p).distance;
                let in_reach = truth > 1e-3 && truth < reach;
                near += usize::from(in_reach && is_map);
                partly += usize::from(in_reach && is_map && radius > 0.2 * truth);
                if radius > 0.0 {
                    for _ in 0..20 {
                        let cube = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
                        let q = p + radius * random.in_box(&cube).clamp_length_max(1.0);
                        assert!(
                            solid.sign(q) < 0.0,
                            "{name}: {q} is {} from {p}, of {radius}",
                            p.distance(q)
                        );
                    }
                }
                let cube = Aabb::new(p, p).grown(0.02);
                if field.is_far(&cube, reach) {
                    far += 1;
                    for corner in cube.corners() {
                        let distance = solid.contact(corner).distance;
                        // estimates of leaves that have no zero within reach may be smaller
                        assert!(distance > 0.5 * reach && solid.sign(corner) < 0.0, "{name}: {corner}");
                    }
                }
            }
            println!("{name}: {near} within reach, {partly} of them partly clear, {far} boxes far");
            assert!(far > 40 && 10 * partly >= 9 * near, "{name}: {partly} of {near}, {far}");
        }
    }
}

#[test]
fn no_scene_makes_a_map_explode() {
    // 3000 spheres on one another: no cell at the surface can drop any of them
    let text = "rfm 1\nsolid s = any i in 0..3000: sphere(1 + i*1e-9)";
    let s = solid(text, "s", Engine::Auto);
    let map = CellMap::new(&s, Aabb::new(DVec3::splat(-1.1), DVec3::splat(1.1))).unwrap();
    let stats = map.stats();
    assert!(stats.leaves_in_cells < 1 << 24, "{stats:?}");
    assert_eq!((map.place_of(DVec3::ZERO), map.place_of(DVec3::ONE)), (Place::Inside, Place::Fluid));
    assert_eq!((map.sign(DVec3::X * 1.01), map.sign(DVec3::X * 0.99)), (-1.0, 1.0));
}

#[test]
fn surfaces_that_lie_on_one_another_do_not_divide_cells_for_ever() {
    let text = "rfm 1\nsolid s = any i in 0..30: sphere(1 + i*1e-9)";
    let s = solid(text, "s", Engine::Auto);
    let map = CellMap::new(&s, Aabb::new(DVec3::splat(-1.1), DVec3::splat(1.1))).unwrap();
    let stats = map.stats();
    // about six squares of 64² cells; if they were divided as deep as cells go, there would be millions
    assert!(stats.leaves == 30 && stats.near < 100_000, "{stats:?}");
    assert_eq!((map.place_of(DVec3::ZERO), map.place_of(DVec3::ONE)), (Place::Inside, Place::Fluid));
}
