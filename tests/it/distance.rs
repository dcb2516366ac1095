//! Distances with proofs: the true distance lies between clearance and estimate, also where no derivative helps.

use rfm::glam::{DVec2, DVec3};
use rfm::solid::{Distance, Distances};
use rfm::{Program, Solid};

use crate::random::Random;

fn solid(text: &str) -> Solid {
    let program = Program::from_source("d.rfm", format!("rfm 1\nsolid s = {text}"));
    program.unwrap_or_else(|e| panic!("{text}: {e}")).solid("s").unwrap()
}

/// The clearance is never above the truth, the estimate never below. The estimate is within `gap` of it; the
/// clearance is farther off in the middle of a ball, all of whose surface is equally near.
#[track_caller]
fn check_at(distances: &Distances, text: &str, p: DVec3, truth: f64, gap: f64) {
    let Distance { estimate, clearance, nearest } = distances.at(p);
    let context = || format!("{text} at {p}: {clearance} … {estimate} for {truth}");
    assert!(clearance <= truth.abs() + 1e-9, "the clearance is too long: {}", context());
    assert!(estimate.abs() >= truth.abs() - 1e-9 && estimate * truth >= 0.0, "{}", context());
    assert!(estimate.abs() - truth.abs() <= gap * truth.abs() + 1e-12, "{}", context());
    assert!(truth.abs() - clearance <= (gap + 3e-2) * truth.abs() + 1e-12, "{}", context());
    assert!((nearest - p).length() - estimate.abs() <= 1e-12 * (1.0 + p.length()), "{}", context());
}

#[track_caller]
fn check(text: &str, p: [f64; 3], truth: f64) {
    check_at(&Distances::new(&solid(text)), text, DVec3::from_array(p), truth, 1e-4);
}

#[test]
fn axes_and_medial_surfaces_have_distances() {
    check("torus(0.9, 0.2)", [0.0, 0.0, 0.0], 0.7);
    check("torus(0.9, 0.2)", [0.0, 0.0, 0.1], 0.82_f64.sqrt() - 0.2);
    check("torus(0.9, 0.2)", [0.9, 0.0, 0.0], -0.2);
    check("torus(0.9, 0.2) or sphere(0.1, [5, 0, 0])", [0.0, 0.0, 0.1], 0.82_f64.sqrt() - 0.2);
    check("sphere(2)", [0.0, 0.0, 0.0], -2.0);
    check("x^2 + y^2 <= 1 and abs(z) <= 9", [0.0, 0.0, 0.3], -1.0);
    check("abs(x) + abs(y) + abs(z) <= 1", [0.0, 0.0, 0.0], -(1.0 / 3_f64.sqrt()));
    check("abs(x) + abs(y) + abs(z) <= 1", [0.0, 0.5, 0.0], -(0.5 / 3_f64.sqrt()));
    check("x^4 + y^4 + z^4 <= 1", [0.0, 0.0, 0.0], -1.0);
    check("box([-1, -1, -1], [1, 2, 3])", [0.0, 0.0, 0.0], -1.0);
    check("box() and sphere(0.2, [5, 0, 0]) or box([3, 0, 0], [4, 1, 1])", [0.0, 0.5, 0.5], 3.0);
}

/// From these points no ray along an axis meets the solid, ω has no slope, and the solid has no end.
#[test]
fn solids_without_end_are_found_where_nothing_leads_to_them() {
    let [two, three] = [2_f64.sqrt(), 3_f64.sqrt()];
    check("x*y <= -1", [0.0, 0.0, 0.0], two);
    check("x*y <= -1", [0.0, 0.0, 1e6], two);
    check("x*y <= -1e6", [0.0, 0.0, 0.0], 1e3 * two);
    check("x*y <= -1e-6", [0.0, 0.0, 0.0], 1e-3 * two);
    check("x*y <= -1 or sphere(1, [1e10, 0, 0])", [0.0, 0.0, 0.0], two);
    check("x*y*z <= -1", [0.0, 0.0, 0.0], three);
    check("x*y*z <= -1 and x*y >= 1", [0.0, 0.0, 0.0], three);
    check("x*y*(x - y)*(x + y) <= -1", [0.0, 0.0, 0.0], two);
}

/// The clearance is compared with the nearest of many points that are inside.
#[test]
fn clearances_in_the_middle_are_a_good_part_of_the_distance() {
    for text in [
        "x*y <= -1",
        "(x - z)*(y + 2*z) <= -1",
        "x^2 + y^2 >= 1",
        "torus(0.9, 0.2)",
        "x^2 + y^2 - z^2 >= 1",
        "x^2 + y^2 - z^2 <= -1",
        "sphere(1, [1, 1.5, 2]) or sphere(1, [-1, -1.5, -2])",
        "sphere(1, [2, 0, 0]) or sphere(1, [-2, 0, 0])",
    ] {
        let solid = solid(text);
        let clearance = solid.distance(DVec3::ZERO).clearance;
        let mut nearest = f64::INFINITY;
        let steps = || (-60..=60).map(|i| 0.05 * f64::from(i));
        for p in steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| DVec3::new(x, y, z)))) {
            if p.length() < nearest && solid.sign(p) >= 0.0 {
                nearest = p.length();
            }
        }
        // the nearest node is at most a cell's diagonal farther away than the surface
        assert!(
            clearance <= nearest && clearance >= 0.9 * (nearest - 0.09),
            "{text}: {clearance}, {nearest}"
        );
    }
}

/// Outlines of many edges, each of which goes on beyond the next: no chain of them has an end by itself.
#[test]
#[ignore = "long"]
fn distances_from_finely_cut_outlines_are_found() {
    for copies in [1, 5, 6, 7, 9] {
        let text = format!("polygon(arc([0.7, 0], 0.1, 0°, 360°)).extrude(0, 0.4).polar_repeat({copies})");
        let distances = Distances::new(&solid(&text));
        let mut numbers = Random(7);
        let first = DVec3::new(-1.16018, -0.73693, 0.64165);
        for p in std::iter::once(first).chain((0..40).map(|_| numbers.around(1.4))) {
            let to_disc = |k: i32| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / f64::from(copies)).sin_cos();
                let beside = (p.truncate() - 0.7 * DVec2::new(cos, sin)).length() - 0.1;
                let above = (p.z - 0.4).max(-p.z);
                beside.max(0.0).hypot(above.max(0.0)) + beside.max(above).min(0.0)
            };
            let truth = (0..copies).map(to_disc).fold(f64::INFINITY, f64::min);
            if truth < 0.01 {
                continue;
            }
            // chords are within 1/2000 of the diameter
            let Distance { estimate, clearance, .. } = distances.at(p);
            assert!(clearance <= truth + 1.1e-4, "{copies} at {p}: {clearance} for {truth}");
            let most = 1.001 * truth + 1.1e-4;
            assert!((truth - 1e-9..=most).contains(&estimate), "{copies} at {p}: {estimate} for {truth}");
        }
    }
}

/// At an edge sharper than a right angle no ray along an axis or the normal meets the solid, and no cell
/// around the edge has its middle or a corner in it.
#[test]
fn the_nearest_point_may_be_on_a_sharp_edge() {
    check("x >= 0 and y >= 0 and x + y <= 1", [1.2, -0.3, 0.0], 0.13_f64.sqrt());
    check("y >= 0 and x + 2*y <= 1", [1.2, -0.3, 0.1], 0.13_f64.sqrt());
    check("x >= 0 and y >= 0 and z >= 0 and x + y + z <= 1", [1.4, -0.3, -0.2], 0.29_f64.sqrt());
    // beside the jump of a bend nothing can be said about the nearest cells
    let bent = solid("box([0, 0, 0], [3, 3, 0.05]).bend(1)");
    assert!(bent.distance(DVec3::new(-1.065, 0.126, 1.981)).estimate < 1.3);
    // ω = 0 where two parts that are cut away meet, but nothing begins there
    let cavity = solid(
        "box([-2, -2, -2], [2, 2, 2]) \\ (box([-1, -1, -1], [0, 1, 1]) or box([0, -1, -1], [1, 1, 1]))",
    );
    let found = cavity.distance(DVec3::new(0.1, 0.0, 0.0)).estimate;
    assert!((found - 0.9).abs() < 1e-3, "{found}");
}

#[test]
fn contacts_are_never_lost_off_the_surface() {
    for (text, p, truth) in [
        ("torus(0.9, 0.2)", [0.0, 0.0, 0.0], 0.7),
        ("torus(0.9, 0.2)", [0.0, 0.0, 0.1], 0.82_f64.sqrt() - 0.2),
        ("torus(0.9, 0.2).move([3, 2, 1])", [3.0, 2.0, 1.1], 0.82_f64.sqrt() - 0.2),
        ("torus(0.9, 0.2).move([3, 2, 1]) or sphere(0.1)", [3.0, 2.0, 1.1], 0.82_f64.sqrt() - 0.2),
        ("torus(0.9, 0.2)", [0.9, 0.0, 0.0], -0.2),
        ("abs(x) + abs(y) + abs(z) <= 1", [0.0, 0.5, 0.0], -(0.5 / 3_f64.sqrt())),
        ("x^4 + y^4 + z^4 <= 1", [0.0, 0.0, 0.0], -1.0),
        ("x^2 + y^2 <= 1", [0.0, 0.0, 0.3], -1.0),
        ("cone(1, 2)", [0.0, 0.0, 0.7], -0.581_377_674_149_945_3),
    ] {
        let found = solid(text).contact(DVec3::from_array(p));
        assert!((found.distance / truth - 1.0).abs() < 1e-5, "{text} at {p:?}: {found:?} for {truth}");
        // zero where all directions are as good
        assert!(found.normal.is_finite() && found.normal.length() < 1.0 + 1e-9, "{text} at {p:?}: {found:?}");
        let (mut columns, p) = ([[0.0]; 5], p.map(|x| [x]));
        solid(text).contact_many([&p[0], &p[1], &p[2]], columns.each_mut().map(|column| &mut column[..]));
        assert_eq!(columns[0][0], found.distance);
    }
}

/// A ball larger than the space that is searched, and solids without a surface: nothing is proven beyond that space.
#[test]
fn clearances_are_finite() {
    for text in ["sphere(1e78)", "x >= 1 and x <= 0", "x^2 >= -1"] {
        let Distance { estimate, clearance, .. } = Distances::new(&solid(text)).at(DVec3::ONE);
        assert!(estimate.is_infinite(), "{text}: {estimate}");
        assert!(clearance.is_finite() && clearance < 1e78, "{text}: {clearance}");
    }
}

/// Solids whose distance is known in closed form, at random points and at points of their axes.
#[test]
#[ignore = "long"]
fn clearances_are_never_too_long() {
    let segment = |p: DVec3| (p.with_z(p.z - p.z.clamp(0.0, 1.5))).length() - 0.4;
    let ring = |p: DVec3| (p.truncate().length() - 0.9).hypot(p.z) - 0.2;
    let cuboid = |p: DVec3| {
        let q = p.abs() - DVec3::new(0.5, 0.7, 0.9);
        q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
    };
    type Known<'a> = (&'a str, &'a dyn Fn(DVec3) -> f64);
    let balls = |p: DVec3| (p.length() - 0.5).min((p - DVec3::X).length() - 0.3);
    let known: [Known; 5] = [
        ("sphere(0.8)", &|p| p.length() - 0.8),
        ("capsule(0.4, 1.5)", &segment),
        ("torus(0.9, 0.2)", &ring),
        ("box([-0.5, -0.7, -0.9], [0.5, 0.7, 0.9])", &cuboid),
        ("sphere(0.5) or sphere(0.3, [1, 0, 0])", &balls),
    ];
    let mut numbers = Random(5);
    for (text, truth) in known {
        let solid = solid(text);
        let distances = Distances::new(&solid);
        for i in 0..120 {
            let mut p = numbers.around(2.0);
            if i % 4 == 0 {
                p = p.with_x(0.0).with_y(0.0);
            }
            // inside a union the nearest ball need not be the nearest surface
            if text.contains(" or ") && truth(p) < 0.0 {
                continue;
            }
            check_at(&distances, text, p, truth(p), 1e-3);
        }
    }
}

/// A coil that is cut at its ends: the flat end is nearer than the side of any turn, and each sign takes hundreds of
/// capsules. The truth is the nearest of points of the end, 1e-5 apart, which lie within the radius of the helix.
#[test]
fn the_cut_end_of_a_coil_is_found() {
    let distances = Distances::new(&solid("sweep(helix(0.02, 0.006, 8), 0.0015) and 0 <= z <= 0.048"));
    let helix = |angle: f64| {
        DVec3::new(0.02 * angle.cos(), 0.02 * angle.sin(), 0.006 * angle / std::f64::consts::TAU)
    };
    let mut end = Vec::new();
    for i in 0..4000 {
        let angle = 5e-4 * f64::from(i);
        for k in -160..=160 {
            let radius = 0.02 + 1e-5 * f64::from(k);
            let q = DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0);
            let near = |j: i32| helix((angle + 2e-3 * f64::from(j)).max(0.0)).distance(q) <= 0.0015;
            if (-10..=10).any(near) {
                end.push(q);
            }
        }
    }
    for p in [
        [0.012229411657852615, 0.0138476527057061, -0.0018246409379967053],
        [0.015, 0.01, -0.002],
        [0.01, 0.004, -0.004],
        [0.02, 0.001, -0.003],
    ] {
        let p = DVec3::from_array(p);
        let truth = end.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
        let Distance { estimate, clearance, .. } = distances.at(p);
        assert!(clearance <= truth && estimate >= truth - 2e-5, "{p}: {clearance} … {estimate} for {truth}");
        assert!(estimate <= 1.02 * truth, "{p}: {estimate} for {truth}");
    }
}
