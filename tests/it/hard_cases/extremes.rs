//! Numbers that no scene has. Every program still gives a defined answer, and the same one in every way of
//! asking.

use rfm::geom::Aabb;
use rfm::glam::{DVec3, Vec3};
use rfm::interval::Interval;
use rfm::{Field, Solid};

use crate::numbers::solid;

/// Fields that divide by zero, leave the domain of a function, overflow, or join a field with itself.
const FIELDS: &[&str] = &[
    "1/x",
    "1/(x - x)",
    "x/y and y/x",
    "x/(y*z) or sphere(1)",
    "sqrt(x) - sqrt(y)",
    "ln(x) and ln(-x)",
    "asin(x) or acos(y)",
    "tan(x)/cos(y)",
    "x^y - z",
    "exp(x) - exp(y) and z",
    "sphere(1) and sphere(1)",
    "sphere(1) or sphere(1)",
    "sphere(1) and not sphere(1)",
    "sphere(1) or not sphere(1)",
    "sphere(1) \\ sphere(1)",
    "min(sphere(1), not sphere(1))",
    "x and -x and x and -x",
    "x*1e300*1e300 and y",
    "x^2*1e200 - y^2*1e200 and z",
    "x*1e-300 and y*1e-300 or z*1e-300",
    "1e-320*x and 1e-320*y",
    "normalise(x^2 + y^2 - z^2)",
    "normalise(x*y*z)",
    "hypot(x, y) - atan2(y, x)",
    "cone(1, 2) and torus(1, 0.2).scale([1e-3, 1, 1e3])",
    "sphere(1).move([1e6, 0, 0]) or box().move([1e15, 0, 0])",
];

const COORDINATES: &[f64] = &[
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.3,
    5e-324,
    -5e-324,
    1e-310,
    1e-200,
    1e6,
    -1e6,
    1e6 + 0.3,
    1e15,
    1e77,
    1e155,
    -1e160,
    f64::MAX,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

fn points() -> impl Iterator<Item = DVec3> {
    let pairs = COORDINATES.iter().flat_map(|&x| COORDINATES.iter().map(move |&y| (x, y)));
    pairs.flat_map(|(x, y)| [0.0, 0.7, -1e6, 1e160].map(|z| DVec3::new(x, y, z)))
}

fn same(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

/// One answer of a solid at a point, by every way of asking.
fn answers(solid: &Solid, p: DVec3) -> [f64; 3] {
    let omega = solid.omega(p);
    let what = || format!("{solid:?} at {p}");
    assert!(same(solid.omega_grad(p).0, omega), "{}", what());
    let columns = p.to_array().map(|c| [c; 3]);
    let mut many = [0.0; 3];
    solid.omega_many(columns.each_ref().map(|c| &c[..]), &mut many);
    assert!(many.iter().all(|&w| same(w, omega)), "{}: {many:?}, not {omega}", what());
    assert!(p.is_finite() || omega.is_nan(), "{}: {omega}", what());
    let sign = solid.sign(p);
    assert!([-1.0, 0.0, 1.0].contains(&sign) || sign.is_nan(), "{}: sign {sign}", what());
    if !(omega.is_nan() || sign.is_nan()) {
        let of_omega = f64::from(i8::from(omega > 0.0) - i8::from(omega < 0.0));
        assert_eq!(sign, of_omega, "{}: ω {omega}", what());
    }
    [omega, sign, Field::omega(&solid.twin(), p)]
}

#[test]
#[ignore = "long"]
fn every_program_has_a_defined_answer() {
    for expression in FIELDS {
        let [jit, interpreter] = solid(expression);
        for p in points() {
            let (a, b) = (answers(&jit, p), answers(&interpreter, p));
            assert!((0..3).all(|i| same(a[i], b[i])), "`{expression}` at {p}: {a:?} {b:?}");
            let (a, b) = (jit.contact(p), interpreter.contact(p));
            assert!(same(a.distance, b.distance), "`{expression}` at {p}: {a:?} {b:?}");
            let q = p.as_vec3();
            let (a, b) = (jit.omega_f32(q), interpreter.omega_f32(q));
            assert!(same(a.into(), b.into()), "`{expression}` at {q}: {a} {b}");
            assert!(Vec3::is_finite(q) || a.is_nan(), "`{expression}` at {q}: {a}");
        }
    }
}

#[test]
fn ranges_hold_what_overflows_and_own_up_to_nan() {
    // coordinates whose sum does not overflow; beyond them ω is NaN by definition
    let finite: Vec<f64> = COORDINATES.iter().copied().filter(|c| c.abs() <= 1e160).collect();
    for expression in FIELDS {
        for solid in solid(expression) {
            for &a in &finite {
                for &b in &finite {
                    let (min, max) = (a.min(b), a.max(b));
                    let over = Aabb::new(DVec3::new(min, min, -1.0), DVec3::new(max, max, 1.0));
                    let (range, twin) = (solid.range(&over), solid.twin().range(&over));
                    assert!(range.lo <= range.hi && twin.lo <= twin.hi);
                    for p in [over.min, over.max, over.centre(), DVec3::new(min, max, 0.5)] {
                        if !p.is_finite() {
                            continue; // the centre of the largest boxes
                        }
                        let omega = solid.omega(p);
                        let held =
                            if omega.is_nan() { range == Interval::ALL } else { range.contains(omega) };
                        assert!(held, "`{expression}` {solid:?} over {over:?} at {p}: {omega:?}, {range:?}");
                        let omega = Field::omega(&solid.twin(), p);
                        // far away the twin gives NaN whatever its leaves are
                        let far = p.abs().max_element() >= 1e76;
                        let held =
                            if omega.is_nan() { far || twin == Interval::ALL } else { twin.contains(omega) };
                        assert!(held, "`{expression}` {solid:?} over {over:?} at {p}: {omega:?}, {twin:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn unions_of_a_thousand_equal_and_opposite_parts() {
    for (expression, inside, outside) in [
        ("any i in 0..1000: sphere(1)", 1.0, -1.0),
        ("all i in 0..1000: sphere(1)", 1.0, -1.0),
        ("any i in 0..1000: (sphere(1) and not sphere(1))", -1.0, -1.0),
        ("all i in 0..1000: (sphere(1) or not sphere(1))", 1.0, 1.0),
    ] {
        for solid in solid(expression) {
            for (p, sign) in [(DVec3::ZERO, inside), (DVec3::X * 2.0, outside)] {
                let (omega, gradient) = solid.omega_grad(p);
                assert!(omega.is_finite() && gradient.is_finite(), "{expression} at {p}: {omega} {gradient}");
                assert_eq!((omega.signum(), solid.sign(p)), (sign, sign), "{expression} at {p}");
                let (omega, gradient) = solid.omega_grad_f32(p.as_vec3());
                assert!(omega.is_finite() && Vec3::is_finite(gradient), "{expression} at {p}: {omega}");
                let range = solid.range(&Aabb::new(p - 1e-3, p + 1e-3));
                assert!(range.contains(solid.omega(p)), "{expression} at {p}: {range:?}");
            }
            assert_eq!(solid.sign(DVec3::Y), 0.0, "{expression}");
        }
    }
}
