//! `.round(radius)` against the closed formulas of distances from solids with round edges.

use rfm::geom::Aabb;
use rfm::glam::{DVec2, DVec3};
use rfm::ir::exact;
use rfm::solid::Bounds;
use rfm::{Engine, Program, Solid};

fn compiled(definition: &str, engine: Engine) -> Solid {
    let text = format!("rfm 1\nsolid s = {definition}");
    let program = Program::from_source("t.rfm", text).unwrap_or_else(|e| panic!("{definition}: {e}"));
    program.solid_with("s", engine).unwrap()
}

fn solid(definition: &str) -> Solid {
    compiled(definition, Engine::Auto)
}

/// Places in a box, spread evenly but in no pattern.
fn places(count: u32, over: Aabb) -> impl Iterator<Item = DVec3> {
    (1..=count).map(move |i| {
        let at = DVec3::new(0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3);
        over.min + over.size() * (at * f64::from(i)).fract()
    })
}

fn over(half: f64) -> Aabb {
    Aabb::new(DVec3::splat(-half), DVec3::splat(half))
}

/// ω is a known function, and its gradient has length 1 wherever that function has one normal.
#[track_caller]
fn is(definition: &str, within: f64, known: impl Fn(DVec3) -> f64) {
    let found = solid(definition);
    for p in places(20_000, over(2.0)) {
        let (omega, expected) = (found.omega(p), known(p));
        assert!((omega - expected).abs() <= within, "{definition} at {p}: {omega} instead of {expected}");
    }
}

/// The distance from a box with round edges, negative inside: that from the box that is smaller by r on all
/// sides, less r.
fn round_box(p: DVec3, half: DVec3, r: f64) -> f64 {
    let q = p.abs() - half + r;
    q.max(DVec3::ZERO).length() + q.max_element().min(0.0) - r
}

/// The exact value for a profile of which both distances are known.
fn round_corner(a: f64, b: f64, r: f64) -> f64 {
    let q = DVec2::new(a, b) + r;
    q.max(DVec2::ZERO).length() + q.max_element().min(0.0) - r
}

const BOX: &str = "box([-1, -0.8, -0.5], [1, 0.8, 0.5])";
const HALF: DVec3 = DVec3::new(1.0, 0.8, 0.5);

#[test]
fn a_box_with_round_edges_is_its_distance() {
    for r in [0.01, 0.2, 0.5] {
        is(&format!("{BOX}.round({r})"), 1e-13, |p| -round_box(p, HALF, r));
    }
    let rounded = solid(&format!("{BOX}.round(0.2)"));
    for p in places(20_000, over(1.5)) {
        // where two faces are equally near there is no one normal
        let q = (p.abs() - HALF + 0.2).to_array();
        let is_face = q.iter().filter(|q| **q > 0.0).count() > 0;
        if is_face {
            let length = rounded.omega_grad(p).1.length();
            assert!((length - 1.0).abs() < 1e-9, "{p}: {length}");
        }
    }
    let Bounds::Within(bounds) = *rounded.bounds() else { panic!("{:?}", rounded.bounds()) };
    assert!((bounds.max - HALF).abs().max_element() < 0.01 && (bounds.min + HALF).abs().max_element() < 0.01);
    assert!(bounds.max.cmpge(HALF).all() && bounds.min.cmple(-HALF).all(), "{bounds:?}");
}

#[test]
fn a_cylinder_with_round_edges_is_its_distance_however_it_is_written() {
    let known = |p: DVec3| -round_corner(p.truncate().length() - 0.7, (p.z - 0.5).abs() - 0.5, 0.15);
    for written in [
        "cylinder(0.7, 1)",
        "(x^2 + y^2 <= 0.49 and 0 <= z <= 1)",
        "(3*(0.49 - x^2 - y^2) and z >= 0 and 5*(1 - z))",
        "(not (x^2 + y^2 >= 0.49) \\ (z <= 0 or 2*z >= 2))",
        "cylinder(1.4, 2).scale(0.5)",
        "polygon([[-1, 0], [0.7, 0], [0.7, 1], [-1, 1]]).revolve()",
    ] {
        is(&format!("{written}.round(0.15)"), 1e-9, known);
    }
}

#[test]
fn a_shape_may_be_moved_before_or_after() {
    for motion in [
        ".move([0.3, -0.2, 0.1])",
        ".rotate([1, 2, 3], 40 deg)",
        ".rotate_z(pi*t)",
        ".scale(0.7).mirror([1, 1, 0])",
    ] {
        let radius = if motion.starts_with(".scale") { 0.07 } else { 0.1 };
        let shape = "(box([-1, -0.8, -0.5], [1, 0.8, 0.5]) \\ cylinder(0.3, 2).move([0, 0, -1]))";
        let before = solid(&format!("{shape}.round(0.1){motion}")).at(0.3);
        let after = solid(&format!("{shape}{motion}.round({radius})")).at(0.3);
        for p in places(5000, over(1.5)) {
            assert!((before.omega(p) - after.omega(p)).abs() < 1e-9, "{motion} at {p}");
        }
    }
}

#[test]
fn edges_that_point_inwards_are_filled_unless_they_are_to_stay() {
    // all but a quarter of space: the edge between its walls is filled as a rounded corner of the quarter is cut
    is("(x <= 0 or y <= 0).round(0.3)", 1e-13, |p| round_corner(-p.x, -p.y, 0.3));
    is("(not (x >= 0 and y >= 0)).round(0.3)", 1e-13, |p| round_corner(-p.x, -p.y, 0.3));
    is("(x <= 0 or y <= 0).round(0.3, 0)", 0.0, |p| (-p.x).max(-p.y));
    is("(x <= 0 or y <= 0).round(0.3, 0.1)", 1e-13, |p| round_corner(-p.x, -p.y, 0.1));
    let block = "(box([-1, -1, -1], [1, 1, 0]) or cylinder(0.4, 1.5).move([0, 0, -0.5]))";
    let (filled, sharp) = (solid(&format!("{block}.round(0.2)")), solid(&format!("{block}.round(0.2, 0)")));
    // beside the foot of the cylinder: the arc of radius 0.2 around (0.6, 0.2)
    for (beside, height, inside) in
        [(0.44, 0.04, true), (0.47, 0.07, false), (0.46, 0.1, false), (0.42, 0.07, true)]
    {
        let p = DVec3::new(beside, 0.0, height);
        let arc = DVec2::new(beside - 0.6, height - 0.2).length() > 0.2;
        assert_eq!(arc, inside, "{p}");
        assert_eq!(filled.omega(p) > 0.0, inside, "{p}");
        assert!(sharp.omega(p) < 0.0, "{p}");
    }
    assert!(filled.bounds().aabb().is_some() && sharp.bounds().aabb().is_some());
}

#[test]
fn other_formulas_are_rounded_to_first_order() {
    // the rim of half an ellipsoid of revolution, against the arc of radius r that touches both faces, by brute force
    let (a, c, r) = (1.0, 0.6, 0.05);
    let rounded = solid(&format!("(ellipsoid({a}, {a}, {c}) and z >= 0).round({r})"));
    let plain = solid(&format!("(ellipsoid({a}, {a}, {c}) and z >= 0)"));
    let outline: Vec<DVec2> = (0..=20_000)
        .map(|i| DVec2::from_angle(f64::from(i) / 20_000.0 * std::f64::consts::TAU) * DVec2::new(a, c))
        .collect();
    let nearest = |q: DVec2| outline.iter().map(|o| o.distance(q)).fold(f64::INFINITY, f64::min);
    for p in places(400, Aabb::new(DVec3::new(0.9, 0.0, -0.02), DVec3::new(1.02, 0.0, 0.1))) {
        let q = DVec2::new(p.x, p.z);
        let inside = (q.x / a).powi(2) + (q.y / c).powi(2) < 1.0;
        let expected = -round_corner(if inside { -nearest(q) } else { nearest(q) }, -q.y, r);
        let found = rounded.omega(p);
        // the curvature there is a/c² = 2.8, so that the distance of first order is off by 7 % of r at r
        assert!((found - expected).abs() < 0.08 * r, "{p}: {found} instead of {expected}");
        assert!(found <= 0.0 || plain.omega(p) > 0.0, "{p}");
    }
}

#[test]
fn machine_code_is_the_interpreter() {
    for definition in ROUNDED {
        let (jit, interpreter) =
            (compiled(definition, Engine::Jit), compiled(definition, Engine::Interpreter));
        for p in places(500, over(2.0)) {
            assert_eq!(jit.omega_grad(p), interpreter.omega_grad(p), "{definition} at {p}");
            assert_eq!(jit.contact(p), interpreter.contact(p), "{definition} at {p}");
            assert_eq!(jit.sign(p), interpreter.sign(p), "{definition} at {p}");
            assert!(jit.omega_grad(p).1.is_finite(), "{definition} at {p}");
            let (a, b) = (jit.omega_grad_f32(p.as_vec3()), interpreter.omega_grad_f32(p.as_vec3()));
            assert_eq!(a, b, "{definition} at {p} in f32");
        }
    }
}

/// Solids with all that `.round` makes of a shape.
const ROUNDED: [&str; 5] = [
    "(box() \\ cylinder(0.3, 2).move([0.5, 0.5, -0.5])).round(0.1)",
    "(ellipsoid(1, 0.6, 0.5) or cone(0.5, 1)).round(0.1)",
    "polygon([[0, 0], [2, 0], [2, 2], [1, 1], [0, 2]]).extrude(0, 1).round(0.1)",
    "(torus() or capsule(0.3, 1)).round(0.2, 0.1) and x >= 0",
    "box([-0.4, -0.1, 0], [0.4, 0.1, 1]).twist(0.3).round(0.05)",
];

/// No value at a place of a box is outside the range of the box, for boxes of all sizes, a million in all.
#[test]
fn ranges_hold_over_a_million_boxes() {
    let boxes = 200_000;
    for definition in ROUNDED {
        let solid = solid(definition);
        let mut bounded = 0;
        for (i, (centre, size)) in places(boxes, over(2.0)).zip(places(boxes, over(1.0)).skip(7)).enumerate()
        {
            // halves from a millionth to 1
            let half = size.abs() * 1e-6f64.powf(i as f64 / f64::from(boxes));
            let over = Aabb::new(centre - half, centre + half);
            let range = solid.range(&over);
            bounded += u32::from(range.lo.is_finite() && range.hi.is_finite());
            for p in places(3, over).chain([over.min, over.max, over.centre()]) {
                let omega = solid.omega(p);
                assert!(range.contains(omega), "{definition}: {omega} at {p} not in {range:?} over {over:?}");
            }
        }
        println!("{definition}: {bounded} of {boxes} ranges are bounded");
        // not where a slope may vanish: in large boxes around the middle of an ellipsoid
        assert!(10 * bounded >= 9 * boxes, "{definition}: {bounded} of {boxes}");
    }
}

/// Rounded shapes against the formulas of their distances, which are written in the language and computed
/// with 120 digits. The value is off by at most four rounding errors of the largest coordinate.
#[test]
fn values_are_those_of_the_distance_to_the_last_digits() {
    let arc = |a: &str, b: &str, r: f64| {
        format!("{r} - hypot(max({a} + {r}, 0), max({b} + {r}, 0)) - min(max({a} + {r}, {b} + {r}), 0)")
    };
    let box_distance = |r: f64| {
        let [a, b, c] =
            [("x", 1.0), ("y", 0.8), ("z", 0.5)].map(|(axis, h)| format!("(abs({axis}) - {h} + {r})"));
        let squares = [&a, &b, &c].map(|q| format!("max({q}, 0)^2")).join(" + ");
        format!("{r} - sqrt({squares}) - min(max(max({a}, {b}), {c}), 0)")
    };
    for (rounded, known) in [
        (format!("{BOX}.round(0.2)"), box_distance(0.2)),
        (format!("{BOX}.round(0.01)"), box_distance(0.01)),
        ("cylinder(0.7, 1).round(0.15)".into(), arc("(hypot(x, y) - 0.7)", "(abs(z - 0.5) - 0.5)", 0.15)),
        ("(x >= 0 and y >= 0).round(0.3)".into(), arc("(-x)", "(-y)", 0.3)),
        ("(x <= 0 or y <= 0).round(0.3)".into(), format!("-({})", arc("(-x)", "(-y)", 0.3))),
    ] {
        let (found, known) = (solid(&rounded), solid(&known));
        let (graph, root) = known.formula();
        let mut largest = 0.0f64;
        for p in places(3000, over(2.0)).chain(places(3000, over(1.1))) {
            let truth = exact::evaluate(graph, &[root], p.to_array()).unwrap().remove(0);
            largest = largest.max(truth.error_of(found.omega(p)));
        }
        println!("{rounded}: {largest:.1e}");
        assert!(largest <= 4.0 * f64::EPSILON * 2.0, "{rounded}: {largest:e}");
    }
}

#[test]
fn a_shape_without_edges_is_asked_about() {
    for (definition, edges) in [
        ("sphere(1).round(0.1)", false),
        ("box().taper(1, 0.5).round(0.1)", false),
        ("box().round(0.1).taper(1, 0.5)", true),
        ("(2*(sphere(1) or box())).move([1, 0, 0]).round(0.1)", true),
    ] {
        let program = Program::from_source("t.rfm", format!("rfm 1\nsolid s = {definition}")).unwrap();
        let warned = program.warnings().list.iter().any(|warning| warning.code.0 == "W0419");
        assert_eq!(warned, !edges, "{definition}");
    }
}
