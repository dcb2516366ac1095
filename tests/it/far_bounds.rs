//! Bounds of formulas that end by the powers with which they grow, by an angle, or in turned coordinates.

use std::f64::consts::TAU;

use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::solid::Bounds;
use rfm::{Engine, Program, Solid};

use crate::random::Random;

fn solid(text: &str) -> Solid {
    let program = Program::from_source("b.rfm", format!("rfm 1\n{text}"));
    program.unwrap_or_else(|e| panic!("{text}: {e}")).solid_with("s", Engine::Auto).unwrap()
}

fn bounds(text: &str) -> (Solid, Aabb) {
    let solid = solid(text);
    let Bounds::Within(found) = *solid.bounds() else { panic!("{text}: {:?}", solid.bounds()) };
    (solid, found)
}

/// The bounds of a solid are those of points of its surface, which is sampled so densely that they are right to `slack`
/// times the longest side.
#[track_caller]
fn check(text: &str, surface: impl Iterator<Item = DVec3>, slack: f64) {
    let (_, found) = bounds(text);
    let truth = surface.fold(Aabb::EMPTY, |hull, p| hull.including(p));
    let longest = truth.size().max_element();
    let (low, high) = (truth.min - found.min, found.max - truth.max);
    let (least, most) = (low.min(high).min_element(), low.max(high).max_element());
    assert!(least >= -1e-9 * longest, "{text}: too small, {found:?} around {truth:?}");
    assert!(most <= slack * longest, "{text}: too large, {found:?} around {truth:?}");
}

/// All points that are inside lie within the bounds, also far out, and some are near each side.
#[track_caller]
fn check_by_samples(text: &str, slack: f64) {
    let (solid, found) = bounds(text);
    let mut numbers = Random(1);
    let mut inside = |over: &Aabb, count: usize| {
        let points: Vec<DVec3> = (0..count).map(|_| numbers.in_box(over)).collect();
        let [x, y, z] = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect::<Vec<f64>>());
        let mut sign = vec![0.0; count];
        solid.sign_many([&x, &y, &z], &mut sign);
        let inside = points.iter().zip(&sign).filter(|&(_, &sign)| sign > 0.0);
        inside.fold(Aabb::EMPTY, |hull, (&p, _)| hull.including(p))
    };
    let longest = found.size().max_element();
    for k in 0..12 {
        let hull = inside(&found.grown(longest * 3_f64.powi(2 * k)), 200_000);
        assert!(hull.is_empty() || found.union(&hull) == found, "{text}: {hull:?} not in {found:?}");
    }
    for axis in 0..3 {
        for upper in [false, true] {
            let mut layer = found;
            let depth = slack * longest;
            if upper {
                layer.min[axis] = found.max[axis] - depth;
            } else {
                layer.max[axis] = found.min[axis] + depth;
            }
            assert!(!inside(&layer, 1_000_000).is_empty(), "{text}: nothing in {layer:?} of {found:?}");
        }
    }
}

/// Surfaces of algebra: the sixth power decides, far out, and no interval of values shows it.
#[test]
fn algebraic_surfaces_end() {
    for text in [
        "solid s = (x^2 + 9/4*y^2 + z^2 - 1)^3 - x^2*z^3 - 9/80*y^2*z^3 <= 0",
        "solid s = ((x^2 + 9/4*y^2 + z^2 - 1)^3 - x^2*z^3 - 9/80*y^2*z^3 <= 0).rotate([1,2,3], 1).move([100, 20, 3])",
        "solid s = x^4 + y^4 + z^4 - 5*(x^2 + y^2 + z^2) + 11.8 <= 0",
        "solid s = ((x^2 + y^2 + z^2 + 2*y - 1)*((x^2 + y^2 + z^2 - 2*y - 1)^2 - 8*z^2) \
         + 16*x*z*(x^2 + y^2 + z^2 - 2*y - 1))^2 <= 0.1",
        "solid s = x^4 + y^4 + z^4 - (x^2 + y^2 + z^2) <= 0",
        "solid s = x^2 + y^2 - (1 - z)*z^2 <= 0 and z >= -1",
        "solid s = (x^2 + y^2 + z^2 + 1)^2 - 4*x^2 <= 1.2",
        "solid s = abs(x)^2.5 + abs(y/2)^2.5 + abs(z)^2.5 <= 1",
        "solid s = x^4 - x^3 + y^2 + z^2 <= 0",
        "solid s = ((x^2 + y^2 - 0.64)^2 + (z^2 - 1)^2)*((y^2 + z^2 - 0.64)^2 + (x^2 - 1)^2)\
         *((z^2 + x^2 - 0.64)^2 + (y^2 - 1)^2) <= 0.02",
        "solid s = cos(3*x)*sin(3*y) + cos(3*y)*sin(3*z) + cos(3*z)*sin(3*x) >= 0.2 and sphere(2)",
        "solid s = 1/hypot(x, y, z) + 1/hypot(x - 2, y, z) >= 1.5",
    ] {
        check_by_samples(text, 0.04);
    }
}

/// A torus knot as the two roots of a complex number: the equation of both, and the tubes around each.
#[test]
fn knots_end() {
    check_by_samples(
        "let d = hypot(x, y) - 2
let a = 3*atan2(y, x)
solid s = (d^2 - z^2 - 0.5*cos(a))^2 + (2*d*z - 0.5*sin(a))^2 <= 0.02",
        0.04,
    );
    check_by_samples(
        "let d = hypot(x, y) - 2
let a = 1.5*atan2(y, x)
solid s = min((d - 0.7*cos(a))^2 + (z - 0.7*sin(a))^2, (d + 0.7*cos(a))^2 + (z + 0.7*sin(a))^2) <= 0.04",
        0.04,
    );
}

/// These are not bounded, and must not be said to be.
#[test]
fn surfaces_without_ends_have_none() {
    for text in [
        // Barth's sextic has cones that go on
        "solid s = 4*(2.618*x^2 - y^2)*(2.618*y^2 - z^2)*(2.618*z^2 - x^2) - 4.236*(x^2 + y^2 + z^2 - 1)^2 >= 0",
        "solid s = x^2 + y^2 - (1 - z)*z^2 <= 0",
        "solid s = x^2 + y^2 + z^2 + x^3/4 <= 1",
        // the sixth power ends only where it is not cancelled
        "solid s = (x^2 + y^2)^3 - x^2*z^3 <= 0",
        "solid s = atan2(y, x) >= 3",
        "let a = atan2(y, x)/2
solid s = abs(hypot(x, y)*cos(a) + z*sin(a)) <= 0.3",
        "solid s = (y - 3*x^2 <= 1).rotate_z(1)",
    ] {
        assert_eq!(*solid(text).bounds(), Bounds::Unbounded, "{text}");
    }
}

/// A band that turns by half a turn while it goes around.
#[test]
fn a_moebius_band_ends() {
    let band = "let a = atan2(y, x)/2
let d = hypot(x, y) - 1
solid s = abs(d*cos(a) + z*sin(a)) <= 0.3 and abs(-d*sin(a) + z*cos(a)) <= 0.05";
    // all angles and the four corners of its section: the steps of the angle are 2e-4 of a length of one
    let surface = (0..40_000).flat_map(|k| {
        let angle = TAU * (f64::from(k) / 40_000.0 - 0.5);
        let (sin, cos) = (0.5 * angle).sin_cos();
        [(0.3, 0.05), (0.3, -0.05), (-0.3, 0.05), (-0.3, -0.05)].map(|(u, v)| {
            let (d, z) = (u * cos - v * sin, u * sin + v * cos);
            DVec3::new((1.0 + d) * angle.cos(), (1.0 + d) * angle.sin(), z)
        })
    });
    check(band, surface, 1e-3);
}

/// A plate that is bent is as long when it is turned.
#[test]
fn bent_plates_end_in_any_direction() {
    let parabola = |turn: fn(DVec3) -> DVec3| {
        (0..=1000).flat_map(move |k| {
            let x = f64::from(k) / 1000.0;
            [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)]
                .map(|(y, z)| turn(DVec3::new(x, 3.0 * x * x + y, z)))
        })
    };
    let about_z = |p: DVec3| {
        let (sin, cos) = 1_f64.sin_cos();
        DVec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z)
    };
    let plate = "box([0,-1,-1],[1,1,1]).at([x, y - 3*x^2, z])";
    check(&format!("solid s = {plate}"), parabola(|p| p), 1e-3);
    check(&format!("solid s = {plate}.rotate_z(1)"), parabola(about_z), 0.01);
    let both = parabola(about_z).chain([DVec3::new(0.5, -3.0, 0.0), DVec3::new(0.0, -2.5, 0.5)]);
    let both = both.chain([DVec3::new(0.0, -2.5, -0.5)]);
    check(&format!("solid s = {plate}.rotate_z(1) or ball([0,-2.5,0], 0.5)"), both, 0.01);
    for turn in ["rotate_z(30 deg)", "rotate([1,2,3], 0.7)", "rotate_x(1).move([3,4,5]).rotate_y(2)"] {
        check_by_samples(&format!("solid s = box([0,-0.2,-1],[3,0.2,1]).bend(1.5).{turn}"), 0.04);
    }
    let blades = "solid s = (cylinder(0.15, 0.012) or cylinder(0.03, 0.06) or (any i in 0..7: \
        (box([0.02,-0.002,0.005],[0.145,0.002,0.04]).at([x, y - 3*x^2, z])).rotate_z(i*360 deg/7))) \
        \\ cylinder(0.012, 0.2).move([0,0,-0.05])";
    check_by_samples(blades, 0.04);
}

/// The plate turns: at each time it ends where it is then.
#[test]
fn a_bent_plate_that_turns_has_ends_at_all_times() {
    let plate = solid("solid s = box([0,-1,-1],[1,1,1]).at([x, y - 3*x^2, z]).rotate_z(t)");
    for time in [0.0, 1.0, 2.5] {
        let Bounds::Within(found) = *plate.at(time).bounds() else { panic!("{time}: no bounds") };
        assert!(found.size().max_element() < 5.2, "{time}: {found:?}");
    }
}

/// What turns from height to height has a limit that follows from the shape, and products of coordinates, whose ends are
/// found by powers or from near, have one, too.
#[test]
fn twisted_polynomials_have_bounds_near_their_points() {
    check_by_samples("solid s = (x^2 + y^2 + z^2 - x*y <= 0.1).twist(0.1)", 0.02);
    check_by_samples("solid s = (x^4 + y^4 + z^4 - x*y*z <= 0.1).twist(0.1)", 0.2);
    check_by_samples("solid s = (x^4 - x^2 + y^2 + z^2 <= 0.1).rotate([1, 1, 1], 1).twist(0.1)", 0.2);
    check_by_samples("solid s = (x^4 + y^4 + z^4 - x*y <= 0.1).rotate([1, 1, 1], 1).twist(0.1)", 0.2);
}
