//! Obstacles that move: time in formulas, ranges, swept paths, cell maps and wall velocities, compared with
//! closed forms, 40-digit arithmetic and brute force.

use glam::DVec3;
use rfm::field::{Field, Moving, Path, Still, Walls};
use rfm::geom::Aabb;
use rfm::ir::{self, Given, Interpreter, exact};
use rfm::solid::{CellMap, Engine, MovingMap, Place};
use rfm::{Program, Solid, glam};

use crate::random::Random;
use crate::tool::{rfm, root};

/// A solid from the text of its formula.
fn solid(formula: &str) -> Solid {
    solid_with(formula, Engine::Auto)
}

fn solid_with(formula: &str, engine: Engine) -> Solid {
    let text = format!("rfm 1\nsolid it = {formula}\n");
    let program = Program::from_source("moving.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    program.solid_with("it", engine).unwrap()
}

const FORMULAS: [&str; 6] = [
    "ball([0.3*t, 0, 0], 0.5)",
    "box([-0.8, -0.05, -0.3], [0.8, 0.05, 0.3]).rotate_z(2*pi*t)",
    "box([-0.8, -0.05, -0.3], [0.8, 0.05, 0.3]).rotate([1, 2, 3], t*t - 0.4)",
    "half_space([1, 2, 2]).move([0, 0, sin(3*t)/4])",
    "(sphere(0.6 + 0.2*cos(t)) or torus(0.5, 0.2).rotate_x(t)) \\ ball([t/5, 0.2, 0], 0.3)",
    "any k in 0..5: ball([cos(t + k), sin(t + k), 0.1*k], 0.2 + 0.01*k)",
];

#[test]
fn both_engines_and_both_shapes_give_the_same_bits_at_every_time() {
    let mut random = Random(3);
    for formula in FORMULAS {
        let (jit, interpreter) = (solid_with(formula, Engine::Jit), solid_with(formula, Engine::Interpreter));
        assert!(jit.moves());
        for _ in 0..20 {
            let time = random.within(-3.0, 3.0);
            let (jit, interpreter) = (jit.at(time), interpreter.at(time));
            let points: Vec<DVec3> = (0..37).map(|_| random.around(1.5)).collect();
            let columns: [Vec<f64>; 3] = std::array::from_fn(|i| points.iter().map(|p| p[i]).collect());
            let columns = columns.each_ref().map(Vec::as_slice);
            let (mut omega, mut rows) = (vec![0.0; 37], [const { Vec::new() }; 4]);
            rows.iter_mut().for_each(|row| *row = vec![0.0; 37]);
            jit.omega_many(columns, &mut omega);
            jit.omega_grad_many(columns, rows.each_mut().map(Vec::as_mut_slice));
            for (i, &p) in points.iter().enumerate() {
                let truth = interpreter.omega_grad(p);
                assert_eq!(
                    jit.omega(p).to_bits(),
                    interpreter.omega(p).to_bits(),
                    "{formula} at {p}, {time}"
                );
                assert_eq!(omega[i].to_bits(), jit.omega(p).to_bits());
                assert_eq!(jit.omega_grad(p), truth);
                assert_eq!([rows[1][i], rows[2][i], rows[3][i]], truth.1.to_array());
                let single = p.as_vec3();
                assert_eq!(jit.omega_f32(single).to_bits(), interpreter.omega_f32(single).to_bits());
                assert_eq!(jit.sign(p), interpreter.sign(p));
                assert_eq!(jit.contact(p), interpreter.contact(p));
                assert_eq!(jit.wall_velocity(p), interpreter.wall_velocity(p));
            }
        }
    }
}

#[test]
fn both_engines_find_the_same_entries() {
    let mut random = Random(47);
    let mut hits = 0;
    for formula in FORMULAS {
        let solids = [Engine::Jit, Engine::Interpreter].map(|engine| solid_with(formula, engine));
        for _ in 0..200 {
            let from = random.within(-2.0, 2.0);
            let to = from + random.within(0.0, 0.3);
            let path = Path::new(random.around(1.5), random.around(1.5), f64::INFINITY);
            let [a, b] = solids.each_ref().map(|solid| solid.during(from, to).first_entry(&path));
            assert_eq!(a, b, "{formula}: {path:?} from {from} to {to}");
            hits += usize::from(a.is_some());
        }
    }
    assert!(hits > 200, "{hits}");
}

/// Compares ω and ∂ω/∂t with the same formula in 120-digit arithmetic: its value, and the difference quotient
/// over 2⁻⁴⁰ s, whose own error is about 2⁻⁸⁰ of the third derivative.
#[test]
fn values_and_rates_agree_with_many_digits() {
    let mut random = Random(5);
    for formula in FORMULAS {
        let solid = solid(formula);
        let (graph, root) = solid.formula();
        let mut graph = graph.clone();
        let rate = ir::gradient_and_rate(&mut graph, root)[3];
        let interpreter = Interpreter::new(&graph, &[rate]);
        for _ in 0..60 {
            let (p, time) = (random.around(1.2), random.within(-2.0, 2.0));
            let at = |time: f64| exact::evaluate_at(&graph, &[root], p.to_array(), time).unwrap().remove(0);
            let found = solid.at(time).omega(p);
            let truth = at(time);
            assert!(truth.error_of(found) < 1e-13 * (1.0 + found.abs()), "{formula}: {found}");
            // these times are exact sums
            let (time, h) = ((time * 1024.0).round() / 1024.0, (-20.0f64).exp2());
            let (before, after) = (at(time - h).to_f64(), at(time + h).to_f64());
            let mut found = [0.0];
            interpreter.eval_given(Given { time, ..Given::point(p.to_array()) }, &mut found);
            let quotient = (after - before) / (2.0 * h);
            // the two values are rounded by 1e-16/h, and the third derivative adds h²
            assert!(
                (found[0] - quotient).abs() < 1e-8 * (1.0 + quotient.abs()),
                "{formula}: {found:?} {quotient}"
            );
        }
    }
}

#[test]
fn ranges_hold_all_times_of_a_stretch() {
    let mut random = Random(7);
    for formula in FORMULAS {
        for engine in [Engine::Auto, Engine::Interpreter] {
            let solid = solid_with(formula, engine);
            for _ in 0..300 {
                let from = random.within(-2.0, 2.0);
                let to = from + random.within(0.0, 0.5);
                let corner = random.around(1.2);
                let over = Aabb::new(corner, corner + DVec3::splat(random.within(0.0, 0.4)));
                let stretch = solid.between(from, to);
                let (range, twin) = (stretch.range(&over), stretch.twin().range(&over));
                assert!(range.lo.is_finite() && range.hi.is_finite(), "{formula}: nothing is known");
                for _ in 0..10 {
                    let part = DVec3::from_array(std::array::from_fn(|_| random.unit()));
                    let p = (over.min + part * over.size()).clamp(over.min, over.max);
                    let now = solid.at(random.within(from, to).clamp(from, to));
                    assert!(range.contains(now.omega(p)), "{formula}: {} not in {range:?}", now.omega(p));
                    assert!(twin.contains(now.twin().omega(p)), "{formula}");
                }
            }
        }
    }
}

/// The smallest s from 0 to 1 with |a + s·b| = r: where a path enters a ball, seen from the ball.
fn into_ball(a: DVec3, b: DVec3, r: f64) -> Option<f64> {
    if a.length() <= r {
        return Some(0.0);
    }
    let (half, c) = (a.dot(b), a.length_squared() - r * r);
    let discriminant = half * half - b.length_squared() * c;
    let s = (-half - discriminant.max(0.0).sqrt()) / b.length_squared();
    (discriminant >= 0.0 && (0.0..=1.0).contains(&s)).then_some(s)
}

#[test]
fn paths_enter_a_flying_ball_where_algebra_says() {
    let ball = solid("ball([0.3 - 0.8*t, 0.5*t, t], 0.4)");
    let centre = |t: f64| DVec3::new(0.3 - 0.8 * t, 0.5 * t, t);
    let mut random = Random(11);
    let mut hits = 0;
    for _ in 0..20_000 {
        let (from, to) = (random.around(1.5), random.around(1.5));
        let begin = random.within(-0.5, 0.5);
        let end = begin + random.within(0.0, 1.0);
        let (a, z) = (from - centre(begin), to - centre(end));
        let expected = into_ball(a, z - a, 0.4);
        let found = ball.during(begin, end).first_entry(&Path::new(from, to, f64::INFINITY));
        match (expected, found) {
            (Some(s), Some(entry)) => {
                hits += 1;
                assert!((entry.t - s).abs() < 1e-7, "{} {s}", entry.t);
                if s > 0.0 {
                    // near a grazing path the normal turns with the root of the error
                    let normal = (a + (z - a) * s).normalize();
                    let angle = entry.normals.mean().unwrap().distance(normal);
                    assert!(angle < 1e-6, "{angle}");
                }
            }
            (None, None) => {}
            // within rounding of a path that grazes
            (expected, found) => {
                let nearest =
                    (a - (z - a) * (a.dot(z - a) / (z - a).length_squared()).clamp(-1.0, 0.0)).length();
                assert!((nearest - 0.4).abs() < 1e-9, "{expected:?} {found:?}");
            }
        }
    }
    assert!(hits > 2_000, "{hits}");
}

/// A plane that swings. Its distance along the path is the closed form d(s) = a + b·s − A·sin(w·t(s)), whose
/// first root is found in 4000 steps and by bisection.
#[test]
fn paths_meet_a_swinging_plane_where_its_distance_vanishes() {
    let plane = solid("half_space([0, 0, 1]).move([0, 0, 0.3*sin(5*t)])");
    let mut random = Random(13);
    let mut hits = 0;
    for _ in 0..2_000 {
        let (from, to) = (random.around(1.0), random.around(1.0));
        let begin = random.within(-1.0, 1.0);
        let end = begin + random.within(0.0, 1.5);
        let height = |s: f64| from.z + (to.z - from.z) * s - 0.3 * (5.0 * (begin + (end - begin) * s)).sin();
        let found = plane.during(begin, end).first_entry(&Path::new(from, to, f64::INFINITY));
        let first = (0..=4000).map(|k| f64::from(k) / 4000.0).find(|&s| height(s) <= 0.0);
        let Some(first) = first else {
            // between two samples it is no deeper than the curvature allows, 0.3·25·(1.5/4000)²/8
            assert!(found.is_none_or(|entry| height(entry.t) < 2e-7), "{found:?}");
            continue;
        };
        hits += 1;
        let (mut low, mut high) = ((first - 1.0 / 4000.0).max(0.0), first);
        if first > 0.0 {
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if height(middle) <= 0.0 { high = middle } else { low = middle }
            }
        }
        let entry = found.unwrap_or_else(|| panic!("missed at {first}"));
        assert!(entry.t <= high + 1e-9, "{} after {high}", entry.t);
        assert!(height(entry.t) < 1e-9 || (entry.t - high).abs() < 1e-9, "{} before {high}", entry.t);
    }
    assert!(hits > 500, "{hits}");
}

/// Half lengths of the blade below.
const BLADE: DVec3 = DVec3::new(0.8, 0.05, 0.3);

/// A turning blade: no path passes that any of 2000 samples sees inside, and no sample before an entry is
/// inside.
#[test]
fn no_path_slips_through_a_turning_blade() {
    let blade = solid("box([-0.8, -0.05, -0.3], [0.8, 0.05, 0.3]).rotate_z(2*pi*t)");
    let inside = |p: DVec3, t: f64| {
        let (sin, cos) = (std::f64::consts::TAU * t).sin_cos();
        let q = DVec3::new(cos * p.x + sin * p.y, cos * p.y - sin * p.x, p.z);
        (q.abs() - BLADE).max_element()
    };
    let mut random = Random(17);
    let mut hits = 0;
    for _ in 0..4_000 {
        let (from, to) = (random.around(1.0), random.around(1.0));
        let begin = random.within(0.0, 1.0);
        // one step makes up to a whole turn
        let end = begin + random.unit().powi(2);
        let path = Path::new(from, to, f64::INFINITY);
        let found = blade.during(begin, end).first_entry(&path);
        let until = found.map_or(1.0, |entry| entry.t);
        let depth = |s: f64| inside(path.at(s), begin + (end - begin) * s);
        // a path may begin inside
        for s in (0..2000).map(|k| until * (f64::from(k) / 2000.0)).filter(|&s| s < until) {
            assert!(depth(s) > -1e-9, "inside at {s}, before {found:?}: {from} {to} {begin} {end}");
        }
        if let Some(entry) = found {
            hits += 1;
            assert!(entry.certain, "{entry:?}");
            assert!(depth(entry.t) < 1e-8, "{} at {}", depth(entry.t), entry.t);
        }
    }
    assert!(hits > 500, "{hits}");
}

#[test]
fn a_fast_thin_plate_meets_every_point_at_rest() {
    // a plate of 1 mm that flies 60 m in a step of half a second
    let plate = solid("box([-0.0005, -1, -1], [0.0005, 1, 1]).move([120*t - 30, 0, 0])");
    let step = plate.during(0.0, 0.5);
    let mut random = Random(19);
    for _ in 0..5_000 {
        let p = random.around(0.99) + DVec3::X * random.within(-28.0, 28.0);
        let entry = step.first_entry(&Path::new(p, p, f64::INFINITY)).expect("the plate has passed");
        let expected = (p.x - 0.0005 + 30.0) / 60.0;
        assert!((entry.t - expected).abs() < 1e-9, "{} {expected}", entry.t);
        assert!(entry.normals.mean().unwrap().distance(DVec3::X) < 1e-9);
        let beside = p.with_z(1.0 + 0.01 + random.unit());
        assert!(step.first_entry(&Path::new(beside, beside, f64::INFINITY)).is_none());
    }
}

#[test]
fn the_wall_of_a_turning_blade_moves_as_a_rigid_body() {
    let blade = solid("box([-0.8, -0.05, -0.3], [0.8, 0.05, 0.3]).rotate([2, -1, 2], 3*t)");
    let pair = solid(
        "box([-0.8, -0.05, -0.3], [0.8, 0.05, 0.3]).rotate([2, -1, 2], 3*t) or sphere(0.1).move([9 + t, 0, 0])",
    );
    let axis = DVec3::new(2.0, -1.0, 2.0).normalize();
    let mut random = Random(23);
    let mut looked_at = 0;
    for _ in 0..2_000 {
        let time = random.within(-5.0, 5.0);
        let now = blade.at(time);
        let turn = glam::DQuat::from_axis_angle(axis, 3.0 * time);
        // on a face, away from its edges
        let face = (random.unit() * 6.0) as usize;
        let mut q = DVec3::from_array(std::array::from_fn(|i| random.within(-0.9, 0.9) * BLADE[i]));
        let mut normal = DVec3::ZERO;
        normal[face / 2] = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
        q[face / 2] = normal[face / 2] * BLADE[face / 2];
        let (p, n) = (turn * q, turn * normal);
        let expected = (3.0 * axis).cross(p);
        let found = now.wall_velocity(p);
        assert!(found.distance(expected) < 1e-12, "{found} {expected}");
        // two bodies that move differently: only the velocity along the normal is known
        let found = pair.at(time).wall_velocity(p);
        let expected = (3.0 * axis).cross(p).dot(n) * n;
        assert!(found.distance(expected) < 1e-12, "{found} {expected}");
        // just outside, where R₀ mixes the faces, the velocity is still that of the face
        let near = pair.at(time).wall_velocity(p + 1e-3 * n);
        let there = (3.0 * axis).cross(p + 1e-3 * n).dot(n) * n;
        assert!(near.distance(there) < 1e-12, "{near} {there}");
        looked_at += 1;
    }
    assert_eq!(looked_at, 2_000);
    // a motion within the surface does not show in ω, but in its formula
    let ball = solid("sphere(1).rotate_z(2*t)").at(0.3);
    assert!(ball.wall_velocity(DVec3::X).distance(2.0 * DVec3::Y) < 1e-12);
    // of a half-space it does not show
    assert_eq!(solid("(z <= 0).move([t, 0, 0])").at(0.3).wall_velocity(DVec3::ZERO), DVec3::ZERO);
}

#[test]
fn a_growing_ball_pushes_its_surface_outwards() {
    let ball = solid("sphere(0.5 + 0.25*t)").at(1.0);
    let squares = solid("x^2 + y^2 + z^2 <= (0.5 + 0.25*t)^2").at(1.0);
    for direction in [DVec3::X, DVec3::new(0.6, 0.0, -0.8)] {
        assert!(ball.wall_velocity(0.75 * direction).distance(0.25 * direction) < 1e-15);
        // this is the surface nearest to it, from inside and from outside, whatever ω grows like there
        for (ball, away) in [(&ball, 0.6), (&ball, 0.9), (&squares, 0.6), (&squares, 0.9)] {
            let found = ball.wall_velocity(away * direction);
            assert!(found.distance(0.25 * direction) < 0.005, "{found} at {away}");
        }
    }
}

#[test]
fn bounds_of_a_stretch_hold_the_solid_all_the_time() {
    let piston = solid("box([0, 0, 0], [1, 1, 1]).move([2*t, 0, 0])");
    let near = |found: Aabb, expected: [f64; 2]| {
        assert!(
            (found.min.x - expected[0]).abs() < 1e-5 && (found.max.x - expected[1]).abs() < 1e-5,
            "{found:?}"
        );
    };
    near(piston.bounds().aabb().unwrap(), [0.0, 1.0]);
    near(piston.at(3.0).bounds().aabb().unwrap(), [6.0, 7.0]);
    near(piston.between(0.0, 3.0).bounds().aabb().unwrap(), [0.0, 7.0]);
}

#[test]
fn what_rests_rests_and_what_has_no_time_has_no_place() {
    let rest = solid("sphere(1)");
    assert!(!rest.moves());
    assert_eq!(rest.at(7.0).omega(DVec3::X), rest.omega(DVec3::X));
    assert_eq!(rest.wall_velocity(DVec3::X), DVec3::ZERO);
    let moving = solid("sphere(1 + t)");
    for time in [f64::NAN, f64::INFINITY] {
        assert!(moving.at(time).omega(DVec3::X).is_nan());
        assert!(moving.at(time).sign(DVec3::X).is_nan());
    }
    let still = Still(rest);
    assert_eq!(still.during(0.0, 1.0).omega(DVec3::ZERO), 0.5);
    assert!(Moving::moves(&moving) && !still.moves());
}

/// A scene of many parts, some of which move.
fn machine() -> Solid {
    solid(
        "(any k in 0..40: ball([0.05*k - 1, sin(7*k), cos(3*k)], 0.06)) \
         or (any k in 0..4: box([0, -0.02, -0.5], [0.6, 0.02, 0.5]).rotate_z(k*90°).rotate_z(2*t)) \
         or ball([0.9*cos(t), 0.9*sin(t), 0.8], 0.1)",
    )
}

fn unit_box() -> Aabb {
    Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5))
}

#[test]
fn a_moving_map_has_the_sign_of_the_solid_in_every_step() {
    let solid = machine();
    let map = MovingMap::new(&solid, unit_box(), 0.05, (0.0, 3.0), 0.08).unwrap();
    assert!(map.restless() > 0 && map.restless() < 4096);
    let mut random = Random(29);
    let (dt, mut clear) = (0.01, 0);
    let (mut compared, mut different) = (0, 0);
    for step in 0..300 {
        let (from, to) = (f64::from(step) * dt, f64::from(step + 1) * dt);
        let (now, cells) = (solid.at(to), map.between(from, to).expect("within the run"));
        for _ in 0..60 {
            let p = random.around(1.5);
            assert_eq!(cells.sign(p), now.sign(p), "{p} at {to}");
            assert_eq!(cells.sign(p), cells.omega(p).signum());
            let contact = cells.contact(p);
            let truth = now.contact(p);
            if contact.distance.is_finite() && truth.distance.abs() < 0.04 {
                assert!((contact.distance - truth.distance).abs() < 1e-9, "{contact:?} {truth:?}");
                // before an edge of two parts that move differently, each is as good as the other
                compared += 1;
                different += usize::from(cells.wall_velocity(p).distance(now.wall_velocity(p)) > 1e-9);
            }
            if cells.clearance(p, 0.05) >= 0.05 {
                clear += 1;
                for part in [0.0, 0.3, 1.0] {
                    let then = solid.at(from + part * dt);
                    assert!(then.contact(p).distance > 0.05 - 1e-9 && then.sign(p) < 0.0);
                }
            }
        }
    }
    assert!(clear > 4_000, "{clear}");
    println!("{different} of {compared} velocities differ");
    assert!(compared > 200 && 20 * different < compared, "{different} of {compared}");
}

#[test]
fn a_moving_map_finds_the_entries_of_the_solid() {
    let solid = machine();
    let map = MovingMap::new(&solid, unit_box(), 0.0, (0.0, 3.0), 0.2).unwrap();
    let mut random = Random(31);
    let mut hits = 0;
    for _ in 0..600 {
        let from = random.within(0.0, 2.9);
        let to = from + random.within(0.0, 0.1);
        let path = Path::new(random.around(1.4), random.around(1.4), f64::INFINITY);
        let (slow, fast) =
            (solid.during(from, to).first_entry(&path), map.during(from, to).first_entry(&path));
        match (slow, fast) {
            (Some(slow), Some(fast)) => {
                hits += 1;
                assert!((slow.t - fast.t).abs() < 1e-9, "{slow:?} {fast:?}");
            }
            (slow, fast) => assert!(slow.is_none() && fast.is_none(), "{slow:?} {fast:?}"),
        }
    }
    assert!(hits > 150, "{hits}");
}

#[test]
fn the_answer_of_a_map_does_not_depend_on_the_steps_before() {
    let solid = machine();
    let maps = [(); 2].map(|()| MovingMap::new(&solid, unit_box(), 0.03, (0.0, 3.0), 0.1).unwrap());
    for step in 0..100 {
        maps[0].during(f64::from(step) * 0.01, f64::from(step + 1) * 0.01);
    }
    let [a, b] = maps.each_ref().map(|map| map.between(1.0, 1.01).unwrap());
    let mut random = Random(37);
    let points: Vec<DVec3> = (0..2_000).map(|_| random.around(1.5)).collect();
    // nor on the order of questions, for which cells are divided
    let answer = |map: &CellMap, p: DVec3| (map.place_of(p), map.omega(p).to_bits());
    let of_a: Vec<_> = points.iter().map(|&p| answer(&a, p)).collect();
    let mut of_b: Vec<_> = points.iter().rev().map(|&p| answer(&b, p)).collect();
    of_b.reverse();
    assert!(of_a == of_b);
    assert_eq!(a.stats(), b.stats());
    // outside the run, and for steps too long for a window, the solid itself answers
    for (from, to) in [(5.0, 5.01), (0.0, 1.0), (-0.1, 0.0)] {
        assert!(maps[0].between(from, to).is_none());
        assert_eq!(maps[0].during(from, to).omega(DVec3::X), solid.at(to).omega(DVec3::X));
    }
}

#[test]
fn a_map_of_one_time_is_that_of_the_solid_then() {
    let solid = machine().at(0.7);
    let map = CellMap::with_reach(&solid, unit_box(), 0.02).unwrap();
    let mut random = Random(41);
    for _ in 0..5_000 {
        let p = random.around(1.5);
        assert_eq!(map.sign(p), solid.sign(p));
        assert!(map.place_of(p) != Place::Fluid || solid.contact(p).distance > 0.02 - 1e-9);
    }
}

#[test]
fn certificates_hold_at_the_time_they_are_for() {
    let solid = solid("ball([cos(t), sin(t), 0], 0.5) or box([0, 0, 0], [1, 1, 1]).rotate_x(t)");
    let over = Aabb::new(DVec3::splat(-2.0), DVec3::splat(2.0));
    let mut random = Random(43);
    for (time, tolerance) in [(0.0, 1e-4), (1.3, 1e-5), (2.9, 1e-12)] {
        let now = solid.at(time);
        let chosen = now.within(tolerance, over).unwrap();
        let (graph, root) = now.formula();
        for _ in 0..300 {
            let p = random.around(2.0);
            let truth = exact::evaluate_at(graph, &[root], p.to_array(), time).unwrap().remove(0);
            assert!(truth.error_of(chosen.omega(p)) <= chosen.bound(), "{:?}", chosen.variant());
        }
    }
}

/// The piston of `examples/paddle.rfm` lies between −0.05 and 0.05 at t = 0, and 0.3 farther half a period
/// later.
#[test]
fn the_command_line_looks_at_the_time_that_is_asked_for() {
    let file = "examples/paddle.rfm";
    let at = |time: &str| {
        let arguments = ["eval", file, "-s", "piston", "--at", "0.3,0,0.5", "--what", "sign", "--time", time];
        let outcome = rfm(root(), &arguments).expect(0);
        assert!(outcome.stderr.contains("`piston` moves"), "{}", outcome.stderr);
        outcome.stdout.trim_end().rsplit(',').next().unwrap().to_string()
    };
    assert_eq!([at("0"), at("0.7"), at("1.4")].map(|sign| sign.starts_with('-')), [true, false, true]);

    let document = rfm(root(), &["check", file, "--json", "--time", "0.7"]).expect(0).json();
    let piston = &document["solids"][1];
    assert_eq!((&piston["name"], &piston["time"]), (&"piston".into(), &0.7.into()));
    assert!((piston["bounds"]["min"][0].as_f64().unwrap() - 0.25).abs() < 1e-5, "{piston}");
    let cube = rfm(root(), &["check", "examples/cube.rfm", "--json"]).expect(0).json();
    assert!(cube["solids"][0]["time"].is_null());

    let mesh = ["mesh", file, "-s", "stirrer", "--json", "--cells", "48", "--time"];
    let volume = |time: &str| {
        let outcome = rfm(root(), &[&mesh[..], &[time]].concat()).expect(0);
        outcome.json()["volume"].as_f64().unwrap()
    };
    // it turns and keeps its shape: marching cubes with 48 cells find the volume of thin blades to a few per
    // cent
    assert!((volume("0") / volume("0.2") - 1.0).abs() < 0.1);

    let text = rfm(root(), &["explain", "examples/paddle.rfm:piston"]).expect(0).stdout;
    assert!(text.contains("moves: time enters ω by"), "{text}");
    assert_eq!(rfm(root(), &["eval", file, "-s", "piston", "--at", "0,0,0", "--time", "nan"]).code, 2);
}
