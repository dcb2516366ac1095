//! Single nodes of R₀: rows 1 to 15 and 39 to 42.

use super::{Case, case, check_all, sign};
use crate::numbers::{near, solid};
use crate::random::Random;
use rfm::Field;
use rfm::geom::Aabb;
use rfm::glam::{DVec3, Vec3};

const SQRT_2: f64 = std::f64::consts::SQRT_2;

const NODES: &[Case] = &[
    // all of 3, 4 and 5 are exact
    case(1, "x and y", [3.0, 4.0, 0.0], 2.0).gradient([0.4, 0.2, 0.0]),
    case(1, "x or y", [3.0, 4.0, 0.0], 12.0).gradient([1.6, 1.8, 0.0]),
    case(1, "x and y", [-3.0, -4.0, 0.0], -12.0).gradient([1.6, 1.8, 0.0]),
    case(1, "x or y", [-3.0, -4.0, 0.0], -2.0).gradient([0.4, 0.2, 0.0]),
    case(1, "x and y", [3.0, -4.0, 0.0], -6.0).gradient([0.4, 1.8, 0.0]),
    case(1, "x or y", [3.0, -4.0, 0.0], 4.0).gradient([1.6, 0.2, 0.0]),
    // the textbook u + v − √(u² + v²) is 0 here, in single and in double precision
    case(2, "x and y", [1.0, 9.313_225_746_154_785e-10, 0.0], 9.313_225_741_817_976_5e-10),
    case(3, "x and y", [1.0, -9.313_225_746_154_785e-10, 0.0], -9.313_225_750_491_593_8e-10),
    case(4, "x and y", [1.0, 8.673_617_379_884_035e-19, 0.0], 8.673_617_379_884_035e-19),
    // the square of the larger one overflows in single precision
    case(5, "x or y", [-1e20, -1.0, 0.0], -1.0),
    case(6, "x and y", [1e-25, 1e-25, 0.0], 5.857_864_376_269_049_5e-26)
        .gradient([0.292_893_218_813_452_48, 0.292_893_218_813_452_48, 0.0])
        .double_only(),
    case(9, "x and y", [0.0, 1.0, 0.0], 0.0).gradient([1.0, 0.0, 0.0]),
    case(9, "x and y", [0.0, -1.0, 0.0], -2.0).gradient([1.0, 2.0, 0.0]),
    case(9, "x or y", [0.0, 1.0, 0.0], 2.0).gradient([1.0, 2.0, 0.0]),
    case(9, "x or y", [0.0, -1.0, 0.0], 0.0).gradient([1.0, 0.0, 0.0]),
    // R₀ is not idempotent
    case(12, "x and x", [1.0, 0.0, 0.0], 2.0 - SQRT_2).gradient([2.0 - SQRT_2, 0.0, 0.0]),
    case(12, "x and x", [-1.0, 0.0, 0.0], -2.0 - SQRT_2).gradient([2.0 + SQRT_2, 0.0, 0.0]),
    case(12, "x and x", [1e-9, 0.0, 0.0], (2.0 - SQRT_2) * 1e-9)
        .gradient([2.0 - SQRT_2, 0.0, 0.0])
        .double_only(),
    case(13, "x or x", [1.0, 0.0, 0.0], 3.414_213_562_373_095_0),
    case(13, "x or x", [-1.0, 0.0, 0.0], SQRT_2 - 2.0),
    // the empty set and the whole space, each with a spurious zero
    case(14, "x and not x", [1.0, 0.0, 0.0], -SQRT_2),
    case(14, "x and not x", [-1.0, 0.0, 0.0], -SQRT_2),
    case(14, "x and not x", [0.0; 3], 0.0).gradient([0.0; 3]),
    case(15, "x or not x", [1.0, 0.0, 0.0], SQRT_2),
    case(15, "x or not x", [0.0; 3], 0.0).gradient([0.0; 3]),
    // R₀ is invariant to scale
    case(24, "x and y", [1e-24, 1e-24, 0.0], 5.857_864_376_269_049_5e-25).double_only(),
    // R₀ is not associative
    case(29, "x and y and z", [1.0; 3], 0.426_844_786_590_227_52),
    case(29, "x and y and z", [-1.0; 3], -7.971_860_853_700_944),
];

#[test]
fn nodes_have_their_known_values() {
    check_all(NODES);
}

#[test]
fn row_6_underflowing_squares_keep_sign_and_weights() {
    for solid in solid("x and y") {
        let p = Vec3::new(1e-25, 1e-25, 0.0);
        let (omega, gradient) = solid.omega_grad_f32(p);
        assert!(omega > 0.0 && omega < 1e-25, "{omega}"); // the sign is exact, the value need not be
        assert!(gradient.is_finite() && gradient.x > 0.0 && gradient.x == gradient.y, "{gradient}");
    }
}

#[test]
fn row_7_denormals_keep_their_sign() {
    let (single, double) = (f32::from_bits(1), f64::from_bits(1));
    for solid in solid("x or y") {
        assert!(solid.omega_f32(Vec3::new(single, -single, 0.0)) > 0.0);
        assert!(solid.omega(DVec3::new(double, -double, 0.0)) > 0.0);
    }
    for solid in solid("x and y") {
        assert!(solid.omega_f32(Vec3::new(single, single, 0.0)) > 0.0);
        assert!(solid.omega(DVec3::new(double, double, 0.0)) > 0.0);
        assert!(solid.omega(DVec3::new(double, -double, 0.0)) < 0.0);
        let point = DVec3::new(double, double, 0.0);
        let range = solid.range(&Aabb::new(point, point));
        assert!(range.contains(solid.omega(point)) && range.contains(double * 0.5), "{range:?}");
    }
}

#[test]
fn row_8_corners_weigh_both_operands_alike() {
    for expression in ["x and y", "x or y"] {
        for solid in solid(expression) {
            let (omega, gradient) = solid.omega_grad(DVec3::ZERO);
            assert!(omega == 0.0 && gradient.is_finite() && gradient.x > 0.0, "{omega} {gradient}");
            assert!((gradient.x - gradient.y).abs() < 1e-15, "{gradient}");
            let (omega, gradient) = solid.omega_grad_f32(Vec3::ZERO);
            assert!(omega == 0.0 && gradient.is_finite() && gradient.x > 0.0, "{omega} {gradient}");
            let normal = solid.contact(DVec3::ZERO).normal;
            assert!((normal.x - normal.y).abs() < 1e-15 && normal.x < 0.0, "{normal}");
        }
    }
}

#[test]
fn row_10_infinite_leaves() {
    for (expression, expected) in [("1/x and 1", 1.0), ("-1/x or 1", 1.0)] {
        for solid in solid(expression) {
            near(solid.omega(DVec3::ZERO), expected, 4.0);
            assert!(solid.range(&Aabb::new(DVec3::ZERO, DVec3::ONE)).contains(expected));
        }
    }
    // ∞ ∧ ∞ is not known, and the range says so
    for solid in solid("1/x and 1/x^2") {
        assert!(solid.omega(DVec3::ZERO).is_nan());
        let range = solid.range(&Aabb::new(-DVec3::ONE, DVec3::ONE));
        assert_eq!(range, rfm::interval::Interval::ALL);
    }
}

#[test]
fn row_11_nan_is_never_an_answer() {
    for expression in [
        "sqrt(x) and y",
        "y and sqrt(x)",
        "sqrt(x) or y",
        "y or sqrt(x)",
        "min(sqrt(x), y)",
        "max(y, sqrt(x))",
        "min(sqrt(x), y)^2",
        "abs(min(y, ln(x)))",
    ] {
        for solid in solid(expression) {
            let p = DVec3::new(-1.0, 1.0, 0.0);
            assert!(solid.omega(p).is_nan() && solid.sign(p).is_nan(), "{expression}");
            assert!(solid.omega_f32(p.as_vec3()).is_nan(), "{expression}");
            let mut twin = [0.0f64];
            solid.twin_many([&[-1.0], &[1.0], &[0.0]], &mut twin);
            assert!(twin[0].is_nan(), "{expression}");
            for range in [solid.range(&Aabb::new(p, p)), solid.twin().range(&Aabb::new(p, p))] {
                assert_eq!(range, rfm::interval::Interval::ALL, "{expression}");
            }
        }
    }
}

#[test]
fn rows_14_and_15_nothing_and_everything() {
    for (expression, expected) in [("x and not x", -1.0), ("x or not x", 1.0)] {
        for solid in solid(expression) {
            for i in -50..=50 {
                let p = DVec3::new(f64::from(i) / 16.0, 0.3, -0.2);
                let found = solid.sign(p);
                assert!(found == expected || (i == 0 && found == 0.0), "{expression} at {p}: {found}");
            }
        }
    }
    // the empty solid has no surface normal, and its gradient vanishes
    for solid in solid("sphere(1) and not sphere(1)") {
        let contact = solid.contact(DVec3::X);
        assert!(contact.normal.is_finite() && contact.distance.is_finite(), "{contact:?}");
        assert!(solid.sign(DVec3::ZERO) < 0.0 && solid.sign(DVec3::X) == 0.0);
    }
}

#[test]
fn row_39_the_range_of_a_node_is_exact() {
    let over = Aabb::new(DVec3::new(-1.0, 1.0, 0.0), DVec3::new(2.0, 3.0, 0.0));
    for (expression, lo, hi) in [
        ("x and y", -SQRT_2, 5.0 - 13f64.sqrt()),
        ("x or y", SQRT_2, 5.0 + 13f64.sqrt()),
        ("not (x and y)", 13f64.sqrt() - 5.0, SQRT_2),
    ] {
        for solid in solid(expression) {
            let range = solid.range(&over);
            assert!(range.contains(lo) && range.contains(hi), "{expression}: {range:?}");
            // no wider than the rounding of the operands' sum, 5
            let margin = 40.0 * f64::EPSILON * 5.0;
            assert!(range.lo >= lo - margin && range.hi <= hi + margin, "{expression}: {range:?}");
        }
    }
}

#[test]
fn row_40_a_dropped_operand_changes_the_value_by_half_the_ratio() {
    for solid in solid("x and y") {
        for i in -20..=20 {
            for j in 0..=10 {
                let (u, v) = (f64::from(i) / 200.0, 1.0 + f64::from(j) / 10.0);
                let omega = solid.omega(DVec3::new(u, v, 0.0));
                assert_eq!(sign(omega), sign(u));
                // (u ∧ v)/u = 1 − q/2 + q³/8 − … with q = u/v, apart from a rounding
                let deviation = (omega - u).abs();
                assert!(deviation <= u.abs() * (0.5 * (u / v).abs() + 1e-15), "{u} {v}: {omega}");
            }
        }
    }
}

#[test]
fn rows_41_and_42_de_morgan_and_order_bit_for_bit() {
    let pairs = [
        ("not (x and y)", "(not x) or (not y)"),
        ("not (x or y)", "(not x) and (not y)"),
        ("x and y", "y and x"),
        ("x or y", "y or x"),
    ];
    let pairs = pairs.map(|(a, b)| (solid(a), solid(b)));
    let mut random = Random(5);
    let mut bits = || {
        let state = random.bits();
        state ^ (state >> 29)
    };
    let same =
        |a: f64, b: f64| a.to_bits() == b.to_bits() || (a == 0.0 && b == 0.0) || (a.is_nan() && b.is_nan());
    for i in 0..20_000 {
        let u = f64::from_bits(bits());
        // every third pair is a tie of magnitudes
        let v = if i % 3 == 0 { -u } else { f64::from_bits(bits()) };
        if !(u.is_finite() && v.is_finite()) {
            continue;
        }
        let (p, q) = (DVec3::new(u, v, 0.0), Vec3::new(u as f32, v as f32, 0.0));
        for (a, b) in &pairs {
            for (a, b) in a.iter().zip(b) {
                assert!(same(a.omega(p), b.omega(p)), "{a:?} at {p}");
                assert!(same(a.omega_f32(q).into(), b.omega_f32(q).into()), "{a:?} at {q}");
            }
        }
    }
}
