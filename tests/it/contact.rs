//! The contact program against closed forms and, for the pawn, against the nearest point of its profile.

use rfm::glam::{DVec2, DVec3};
use rfm::solid::Distances;
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
