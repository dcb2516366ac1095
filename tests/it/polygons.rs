//! Polygons: the sign against a count of turns around the point, for outlines that are as wild as simple ones can be.

use rfm::Program;
use rfm::glam::{DVec2, DVec3};

use crate::random::Random;

fn crosses([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let side = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

/// Random corners joined by a tour that is untangled, crossing by crossing, until it is simple.
fn tangle(corners: usize, random: &mut Random) -> Vec<DVec2> {
    let mut points: Vec<DVec2> = (0..corners).map(|_| random.in_square()).collect();
    let mut changed = true;
    while changed {
        changed = false;
        for i in 0..corners {
            for j in i + 2..corners {
                let edges = [[points[i], points[i + 1]], [points[j], points[(j + 1) % corners]]];
                if !(i == 0 && j == corners - 1) && crosses(edges[0], edges[1]) {
                    points[i + 1..=j].reverse();
                    changed = true;
                }
            }
        }
    }
    points
}

/// A star whose arms have random lengths, and arms of arms.
fn star(corners: usize, random: &mut Random) -> Vec<DVec2> {
    let turn = std::f64::consts::TAU / corners as f64;
    (0..corners)
        .map(|i| DVec2::splat(0.5) + (0.05 + 0.45 * random.unit()) * DVec2::from_angle(i as f64 * turn))
        .collect()
}

/// A comb: teeth of one height, whose ends lie on one line and whose gaps end on another one.
fn comb(corners: usize) -> Vec<DVec2> {
    let teeth = (corners / 4).max(1);
    let mut points = vec![DVec2::new(0.0, 0.0), DVec2::new(1.0, 0.0)];
    let width = 1.0 / (2 * teeth - 1) as f64;
    for tooth in (0..teeth).rev() {
        let left = 2.0 * tooth as f64 * width;
        points.extend([DVec2::new(left + width, 1.0), DVec2::new(left, 1.0)]);
        if tooth > 0 {
            points.extend([DVec2::new(left, 0.3), DVec2::new(left - width, 0.3)]);
        }
    }
    points
}

fn turns_around(p: DVec2, points: &[DVec2]) -> i32 {
    let mut turns = 0;
    for (i, &a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        let side = (b - a).perp_dot(p - a);
        turns += i32::from(a.y <= p.y && b.y > p.y && side > 0.0);
        turns -= i32::from(a.y > p.y && b.y <= p.y && side < 0.0);
    }
    turns
}

fn distance(p: DVec2, points: &[DVec2]) -> f64 {
    let to_edge = |(i, &a): (usize, &DVec2)| {
        let along = points[(i + 1) % points.len()] - a;
        (p - a - along * ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0)).length()
    };
    points.iter().enumerate().map(to_edge).fold(f64::INFINITY, f64::min)
}

#[track_caller]
fn check(points: &[DVec2], samples: usize, random: &mut Random) {
    let corners: Vec<String> = points.iter().map(|p| format!("[{:?}, {:?}]", p.x, p.y)).collect();
    let text = format!("rfm 1\nsolid s = polygon([{}])", corners.join(", "));
    let program = Program::from_source("p.rfm", text).unwrap_or_else(|e| panic!("{points:?}: {e}"));
    let solid = program.solid("s").unwrap();
    for i in 0..samples {
        // in the box, about it, and close to an edge
        let p = match i % 3 {
            0 => random.in_square(),
            1 => random.in_square() * 3.0 - DVec2::ONE,
            _ => {
                let at = (random.unit() * points.len() as f64) as usize % points.len();
                let edge = points[at].lerp(points[(at + 1) % points.len()], random.unit());
                edge + (random.in_square() - DVec2::splat(0.5)) * 1e-6
            }
        };
        let away = distance(p, points);
        if away < 1e-12 {
            continue;
        }
        let omega = solid.omega(DVec3::new(p.x, p.y, random.unit()));
        let inside = turns_around(p, points) != 0;
        // never zero off the outline, and never of the wrong sign
        assert!(
            omega != 0.0 && (omega > 0.0) == inside,
            "{} corners at {p}: {omega}, {away} away",
            points.len()
        );
    }
}

#[test]
fn the_sign_of_random_polygons_is_that_of_a_count_of_turns() {
    let mut random = Random(3);
    for round in 0..120 {
        let corners = match round % 4 {
            0 => 3 + round / 8,
            1 => 20 + round / 3,
            _ => 3 + (random.unit() * 198.0) as usize,
        };
        let mut points =
            if round % 2 == 0 { tangle(corners, &mut random) } else { star(corners, &mut random) };
        if round % 3 == 0 {
            points.reverse();
        }
        check(&points, 3_000, &mut random);
    }
    for corners in [4, 12, 40, 200] {
        check(&comb(corners), 3_000, &mut random);
    }
}

/// Spirals nest pockets in pockets, one for each turn.
#[test]
fn a_spiral_is_taken_apart() {
    let mut random = Random(9);
    for turns in [1, 2, 5] {
        let count = 24 * turns;
        let arm = |i: usize, width: f64| {
            let angle = std::f64::consts::TAU * i as f64 / 24.0;
            DVec2::splat(0.5) + DVec2::from_angle(angle) * (0.05 + 0.4 * i as f64 / count as f64 - width)
        };
        let width = 0.15 / turns as f64;
        let mut points: Vec<DVec2> = (0..=count).map(|i| arm(i, 0.0)).collect();
        points.extend((0..=count).rev().map(|i| arm(i, width.min(0.04))));
        check(&points, 20_000, &mut random);
    }
}

#[test]
fn an_outline_that_ends_where_it_began_is_the_same() {
    let solid = |text: &str| {
        let program = Program::from_source("p.rfm", format!("rfm 1\nsolid s = polygon({text})")).unwrap();
        program.solid("s").unwrap()
    };
    let (open, closed) = (solid("[[0, 0], [2, 0], [1, 2]]"), solid("[[0, 0], [2, 0], [1, 2], [0, 0]]"));
    let p = DVec3::new(0.9, 0.4, 7.0);
    assert_eq!(open.omega(p), closed.omega(p));
    assert!(open.omega(p) > 0.0);
}
