//! The contact program against closed forms and, for the pawn, against the nearest point of its profile.

use rfm::geom::Aabb;
use rfm::glam::{DVec2, DVec3};
use rfm::solid::{CellMap, Distances};
use rfm::{Engine, Program, Solid};

use crate::random::Random;

fn solid(definition: &str) -> Solid {
    let program = Program::from_source("t.rfm", format!("rfm 1\nsolid s = {definition}"));
    program.unwrap_or_else(|e| panic!("{e}")).solid("s").unwrap()
}

#[track_caller]
fn check(definition: &str, p: [f64; 3], distance: f64, normal: [f64; 3], curvature: f64) {
    let found = solid(definition).contact(DVec3::from_array(p));
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-13 * b.abs().max(1.0);
    assert!(near(found.distance, distance), "{definition} at {p:?}: {found:?}, expected {distance}");
    assert!((found.normal - DVec3::from_array(normal)).length() < 1e-13, "{definition} at {p:?}: {found:?}");
    assert!(near(found.mean_curvature, curvature), "{definition} at {p:?}: {found:?}, expected {curvature}");
}

#[test]
fn quadrics_are_exact_along_the_normal() {
    check("sphere(2)", [3.0, 0.0, 0.0], 1.0, [1.0, 0.0, 0.0], 1.0 / 3.0);
    check("sphere(2)", [0.0, 1.5, 0.0], -0.5, [0.0, 1.0, 0.0], 1.0 / 1.5);
    check("x^2 + y^2 <= 4", [0.0, 2.25, 7.0], 0.25, [0.0, 1.0, 0.0], 0.5 / 2.25);
    check("x^2 + y^2 + z^2 >= 4", [1.5, 0.0, 0.0], 0.5, [-1.0, 0.0, 0.0], -1.0 / 1.5);
    check("z <= 1", [5.0, 6.0, 3.0], 2.0, [0.0, 0.0, 1.0], 0.0);
    // neither the scale of a leaf nor the product of a layer matters
    check("100*z <= 100", [5.0, 6.0, 3.0], 2.0, [0.0, 0.0, 1.0], 0.0);
    check("0 <= x <= 3", [1000.0, 1.5, 1.5], 997.0, [1.0, 0.0, 0.0], 0.0);
    check("box([0,0,0], [3,3,3])", [-2.0, 1.0, 1.0], 2.0, [-1.0, 0.0, 0.0], 0.0);
}

/// A factor that is the same everywhere, but no constant, changes neither the distance nor the speed of a wall.
#[test]
fn factors_that_depend_on_time_alone_move_nothing() {
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    for (definition, p, distance, speed) in [
        // away from the face, the speed is still that of the face
        ("ellipsoid(1 + t, 1, 0.3)", [1.3, 0.0, 0.0], 0.1, Some(1.0)),
        ("(1 + t)*sphere(1 + t)", [1.3, 0.0, 0.0], 0.1, Some(1.0)),
        ("min(1, 2 + t)*sphere(1 + t)", [0.0, 1.2, 0.0], 0.0, Some(1.0)),
        ("(1 + t)*(1 - x^2 + t)", [1.2_f64.sqrt(), 0.0, 0.0], 0.0, None),
        ("(1 + t)*sphere(1)", [2.0, 0.0, 0.0], 1.0, Some(0.0)),
        ("(t - 1)*sphere(1)", [2.0, 0.0, 0.0], -1.0, Some(0.0)),
    ] {
        let (moving, p) = (solid(definition).at(0.2), DVec3::from_array(p));
        let found = moving.contact(p);
        assert!(near(found.distance, distance), "{definition}: {found:?}");
        // −∂ω/∂t·∇ω/|∇ω|²
        let (omega, gradient) = moving.omega_grad(p);
        let step = 1e-6;
        let [before, after] = [-step, step].map(|dt| solid(definition).at(0.2 + dt).omega(p));
        let expected = -(after - before) / (2.0 * step) / gradient.length();
        let velocity = moving.wall_velocity(p);
        let along = velocity.dot(gradient) / gradient.length();
        if omega.abs() < 1e-12 {
            assert!((along - expected).abs() < 1e-6, "{definition}: {along}, expected {expected}");
        }
        if let Some(speed) = speed {
            assert!((velocity.length() - speed).abs() < 1e-6, "{definition}: {velocity}, expected {speed}");
        }
    }
}

/// Beside an empty solid there is no surface, however flat ω is.
#[test]
fn the_surface_of_an_empty_solid_is_infinitely_far() {
    for p in [DVec3::ZERO, DVec3::new(0.0, 1.0, 2.0)] {
        assert_eq!(solid("x^2 <= -1").contact(p).distance, f64::INFINITY);
        assert_eq!(solid("x^2 >= -1").contact(p).distance, f64::NEG_INFINITY);
    }
}

/// Squares of these gradients are no numbers, or zero: the surface is searched for.
#[test]
fn gradients_beyond_the_range_of_squares() {
    for scale in ["1e200", "1e-200"] {
        let ball = solid(&format!("{scale} - {scale}*x^2 - {scale}*y^2 - {scale}*z^2"));
        let found = ball.contact(DVec3::new(1.2, 0.9, 0.0));
        assert!((found.distance - 0.5).abs() < 1e-3, "{scale}: {found:?}");
        assert!((found.normal - DVec3::new(0.8, 0.6, 0.0)).length() < 1e-3, "{scale}: {found:?}");
    }
}

#[test]
fn places_without_a_normal_are_finite() {
    let centre = solid("sphere(2)").contact(DVec3::ZERO);
    assert!((centre.distance + 2.0).abs() < 1e-14 && centre.normal.is_finite(), "{centre:?}");
    for (definition, p) in [
        ("x^2 + y^2 <= 1", [0.0, 0.0, 0.3]),       // axis
        ("sqrt(x^2 + y^2) <= 1", [0.0, 0.0, 0.3]), // axis of a root
        ("torus(1, 0.25)", [0.0, 0.0, 0.0]),       // middle
        ("cone(1, 2)", [0.0, 0.0, 2.0]),           // apex
        ("box()", [0.0, 0.0, 0.5]),                // edge
        ("box()", [1.0, 1.0, 1.0]),                // corner
        ("0 <= x <= 3", [1.5, 0.0, 0.0]),          // medial plane
        ("sphere(1).move([1,0,0]) or sphere(1).move([-1,0,0])", [0.0, 0.0, 0.0]), // tangent
        ("sphere(1) and not sphere(1)", [1.0, 0.0, 0.0]), // nothing
    ] {
        let found = solid(definition).contact(DVec3::from_array(p));
        let finite =
            found.distance.is_finite() && found.normal.is_finite() && found.mean_curvature.is_finite();
        assert!(finite, "{definition}: {found:?}");
        assert!(found.normal.length() < 1.0 + 1e-12, "{definition}: {found:?}");
    }
    let edge = solid("box()").contact(DVec3::new(0.0, 0.0, 0.5));
    assert!((edge.normal - DVec3::new(-1.0, -1.0, 0.0).normalize()).length() < 1e-14, "{edge:?}");
}

#[test]
fn machine_code_is_the_interpreter() {
    let path = format!("{}/examples/bishop.rfm", env!("CARGO_MANIFEST_DIR"));
    let program = Program::from_path(path).unwrap();
    let [jit, interpreter] =
        [Engine::Jit, Engine::Interpreter].map(|engine| program.solid_with("bishop", engine).unwrap());
    for i in 0..1000 {
        let t = f64::from(i);
        let p = 1.5 + 1.2 * DVec3::new((0.7 * t).sin(), (1.1 * t).cos(), (0.3 * t).sin());
        assert_eq!(jit.contact(p), interpreter.contact(p));
    }
}

/// The part of each arc of the pawn's profile (radius, z) that lies on its surface, densely sampled.
fn pawn_profile(pawn: &Solid) -> Vec<DVec2> {
    const N: usize = 40_000;
    let mut profile = Vec::new();
    let arc = |from: f64, to: f64, point: &dyn Fn(f64) -> DVec2, profile: &mut Vec<DVec2>| {
        for i in 0..=N {
            let q = point(from + (to - from) * i as f64 / N as f64);
            // on the surface: no other part covers it
            if q.x >= 0.0 && pawn.omega(DVec3::new(1.5 + q.x, 1.5, q.y)).abs() < 1e-12 {
                profile.push(q);
            }
        }
    };
    use std::f64::consts::PI;
    arc(0.0, 0.5, &|r| DVec2::new(r, 0.0), &mut profile);
    arc(0.0, 0.2, &|z| DVec2::new(0.5, z), &mut profile);
    arc(0.0, 1.0, &|z| DVec2::new(((1.0 + 10.0 * (z - 0.75).powi(2)) / 20.0).sqrt(), z), &mut profile);
    let a = 0.125f64.sqrt();
    arc(-PI / 2.0, PI / 2.0, &|t| DVec2::new(a * t.cos(), 1.0 + a / 20f64.sqrt() * t.sin()), &mut profile);
    let r = 0.05f64.sqrt();
    arc(-PI / 2.0, PI / 2.0, &|t| DVec2::new(r * t.cos(), 1.25 + r * t.sin()), &mut profile);
    profile
}

#[test]
fn pawn_distances_near_the_wall() {
    let path = format!("{}/examples/pawn.rfm", env!("CARGO_MANIFEST_DIR"));
    let pawn = Program::from_path(path).unwrap().solid("pawn").unwrap();
    let profile = pawn_profile(&pawn);
    assert!(profile.len() > 60_000, "{}", profile.len());
    let mut errors = Vec::new();
    let mut random = Random(7);
    while errors.len() < 1500 {
        // a point of the profile, moved by up to 1 cm
        let q = profile[(random.unit() * profile.len() as f64) as usize] + (random.in_square() - 0.5) * 0.02;
        let p = DVec3::new(1.5 + q.x, 1.5, q.y);
        let exact = profile.iter().map(|s| (*s - q).length_squared()).fold(f64::INFINITY, f64::min).sqrt();
        if q.x < 0.0 || !(1e-3..=1e-2).contains(&exact) {
            continue;
        }
        let exact = if pawn.omega(p) > 0.0 { -exact } else { exact };
        let found = pawn.contact(p).distance;
        assert_eq!(found > 0.0, exact > 0.0, "at {p}");
        errors.push((found / exact - 1.0).abs());
    }
    errors.sort_by(f64::total_cmp);
    let (median, p95) = (errors[errors.len() / 2], errors[errors.len() * 95 / 100]);
    println!(
        "pawn, 1–10 mm from the wall: median {median:.1e}, p95 {p95:.1e}, largest {:.1e}",
        errors.last().unwrap()
    );
    // the method's median is 5e-6 and its p95 0.1 %; the sampled profile resolves 1e-7
    assert!(median < 2e-5 && p95 < 2e-3, "median {median:e}, p95 {p95:e}");
}

/// Far from the wall too the distance found is that of the nearest point, and the clearance is never longer.
#[test]
fn pawn_distances_far_from_the_wall() {
    let path = format!("{}/examples/pawn.rfm", env!("CARGO_MANIFEST_DIR"));
    let pawn = Program::from_path(path).unwrap().solid("pawn").unwrap();
    let (profile, distances) = (pawn_profile(&pawn), Distances::new(&pawn));
    let mut random = Random(11);
    let (mut errors, mut gaps) = (Vec::new(), Vec::new());
    while errors.len() < 200 {
        let q = profile[(random.unit() * profile.len() as f64) as usize] + (random.in_square() - 0.5) * 0.1;
        let p = DVec3::new(1.5 + q.x, 1.5, q.y);
        let exact = profile.iter().map(|s| (*s - q).length_squared()).fold(f64::INFINITY, f64::min).sqrt();
        if q.x < 0.0 || !(0.02..=0.05).contains(&exact) {
            continue;
        }
        let found = distances.at(p);
        // the profile has points up to 2e-5 apart, and none at its corners
        assert!(found.clearance <= exact, "{p}: {found:?} for {exact}");
        assert!(found.estimate.abs() >= exact - 2e-5, "{p}: {found:?} for {exact}");
        errors.push((found.estimate.abs() / exact - 1.0).abs());
        gaps.push(1.0 - found.clearance / exact);
    }
    errors.sort_by(f64::total_cmp);
    gaps.sort_by(f64::total_cmp);
    let p95 = errors.len() * 95 / 100;
    println!(
        "pawn, 20–50 mm from the wall: estimate p95 {:.1e}, clearance p95 {:.1e}",
        errors[p95], gaps[p95]
    );
    assert!(errors[p95] < 5e-3 && gaps[p95] < 1e-2, "{} {}", errors[p95], gaps[p95]);
}

/// Where the slope of a formula has no end, or is that of another branch, or is zero, value over slope would be a thousandth of
/// the distance, or a million times as much: around the axis of an angle, on the crease of a root, in the middle of a valley.
#[test]
fn contacts_at_axes_and_creases_are_as_far_as_the_surface() {
    let star = "abs(x)^0.5 + abs(y)^0.5 + abs(z)^0.5 <= 1";
    let lens = "sqrt(abs(x)) + y^2 + z^2 <= 1";
    let flower = "0.5 - abs(hypot(x, y) - 2 - 0.3*cos(3*atan2(y, x)))";
    let column = "hypot(x, y) <= 1 + 0.2*cos(5*atan2(y, x)) and 0 <= z <= 1";
    let bent = "box([-1,-0.2,-0.3],[1,0.2,0.3]).bend(1.5)";
    let octahedron = "abs(x) + abs(y) + abs(z) <= 1";
    let blended = "blend(sphere(1), box([-2,-0.2,-0.2],[2,0.2,0.2]), 0.3)";
    let (valley, flat_valley) = ("z <= x^2", "z <= x^4");
    let (rounded, bell) = ("x^8 + y^8 + z^8 <= 1", "exp(-(x^2 + y^2 + z^2)) >= 0.5");
    let ring = "(x^2 + y^2 + z^2 + 1 - 0.0625)^2 <= 4*(x^2 + y^2)";
    let bell_radius = 2_f64.ln().sqrt();
    for (definition, p, distance, normal) in [
        // the tips lie on the axes, the hollows where the coordinates are equal: 3√t = 1
        (star, [0.0, 0.0, 1.1], 0.1, None),
        (star, [1e-9, 0.0, 1.1], 0.1, None),
        (star, [0.0, 0.0, 0.0], -(3_f64.sqrt() / 9.0), None),
        (lens, [0.0, 1.1, 0.0], 0.1, Some(DVec3::Y)),
        (lens, [1e-9, 1.1, 0.0], 0.1, Some(DVec3::Y)),
        // 1.5 + 0.3 cos 3θ is 1.2 at least
        (flower, [0.0, 0.0, 0.0], 1.2, None),
        (flower, [1e-9, 0.0, 0.0], 1.2, None),
        (column, [0.0, 0.0, 0.4], -0.4, Some(-DVec3::Z)),
        // the plate is a sector of the ring between 1.2 and 1.8 from the axis
        (bent, [0.0, 0.0, 1.5], 1.2, None),
        (octahedron, [0.0, 0.0, 2.0], 1.0, Some(DVec3::Z)),
        ("z <= abs(x)", [0.0, 0.0, -1.0], -1.0, Some(DVec3::Z)),
        ("cone(1, 2)", [0.0, 0.0, 3.0], 1.0, Some(DVec3::Z)),
        (blended, [0.0, 0.0, 0.0], -1.0, None),
        // d² = x² + (z − x²)² is least where 2x² = 2z − 1
        (valley, [0.0, 0.0, 5.0], 4.75_f64.sqrt(), None),
        (valley, [1e-3, 0.0, 2.0], 1.75_f64.sqrt(), None),
        (flat_valley, [0.0, 0.0, 2.0], 1.175_348, None),
        ("ellipsoid(10, 0.5, 0.2)", [0.0, 0.0, 0.0], -0.2, None),
        ("ellipsoid(10, 0.5, 0.2)", [5.0, 0.0, 0.0], -0.173_194, None),
        ("x*y >= 1", [1e-9, 0.0, 0.0], 2_f64.sqrt(), None),
        (rounded, [1e-3, 0.0, 0.0], -0.999, None),
        (rounded, [0.0, 0.0, 1.2], 0.2, Some(DVec3::Z)),
        (bell, [0.0, 0.0, 4.0], 4.0 - bell_radius, Some(DVec3::Z)),
        (bell, [10.0, 0.0, 0.0], 10.0 - bell_radius, Some(DVec3::X)),
        (ring, [0.0, 0.0, 0.0], 0.75, None),
        (ring, [0.0, 0.0, 0.5], 1.25_f64.sqrt() - 0.25, None),
    ] {
        let (solid, p) = (solid(definition), DVec3::from_array(p));
        let found = solid.contact(p);
        let context = || format!("{definition} at {p}: {found:?}, expected {distance}");
        assert!((found.distance - distance).abs() < 0.02 * distance.abs(), "{}", context());
        assert!(normal.is_none_or(|normal| found.normal.distance(normal) < 0.1), "{}", context());
        assert!((found.normal.length() - 1.0).abs() < 1e-9, "{}", context());
        let mut columns = [[0.0]; 5];
        let [d, x, y, z, k] = &mut columns;
        solid.contact_many([&[p.x], &[p.y], &[p.z]], [d, x, y, z, k]);
        let expected = [found.distance, found.normal.x, found.normal.y, found.normal.z, found.mean_curvature];
        assert_eq!(columns.map(|column| column[0]), expected, "{}", context());
        let single = p.as_vec3();
        let mut columns = [[0_f32]; 5];
        let [d, x, y, z, k] = &mut columns;
        solid.contact_many([&[single.x], &[single.y], &[single.z]], [d, x, y, z, k]);
        let error = (f64::from(columns[0][0]) - distance).abs();
        assert!(error < 0.02 * distance.abs(), "{} in single precision: {columns:?}", context());
    }
}

/// The fluid asks a map of cells, which knows single leaves.
#[test]
fn contacts_of_particles_at_axes_are_as_far_as_the_surface() {
    for (definition, p, distance) in [
        ("abs(x)^0.5 + abs(y)^0.5 + abs(z)^0.5 <= 1", [0.0, 0.0, 1.1], 0.1),
        ("sqrt(abs(x)) + y^2 + z^2 <= 1", [0.0, 1.1, 0.0], 0.1),
        ("hypot(x, y) <= 0.2 + 0.04*cos(5*atan2(y, x)) and -1 <= z <= 1", [0.0, 0.0, 0.5], -0.16),
    ] {
        let (solid, p) = (solid(definition), DVec3::from_array(p));
        let over = Aabb::new(DVec3::splat(-2.0), DVec3::splat(2.0));
        let map = CellMap::with_reach(&solid, over, 0.5).unwrap();
        let found = map.contact(p);
        assert!((found.distance - distance).abs() < 0.02 * distance.abs(), "{definition}: {found:?}");
    }
}

/// The estimate of a face that ends at an edge, as of every box, is the distance of that face.
#[test]
fn contacts_at_edges_stay_estimates() {
    for (definition, p, distance) in [
        ("box([-1,-1,-1],[1,1,1])", [2.0, 2.5, 0.0], 1.5),
        ("box([-0.5,-0.1,0],[0.5,0.1,2]).twist(0.25)", [1.0, 1.0, 2.3], 0.853_321_415_877_888_6),
        ("box([-0.5,-0.1,0],[0.5,0.1,2]).twist(0.25)", [0.2, 0.9, -0.4], 0.572_085_262_523_292_7),
    ] {
        let found = solid(definition).contact(DVec3::from_array(p));
        assert!((found.distance - distance).abs() < 1e-12, "{definition}: {found:?}");
    }
}
