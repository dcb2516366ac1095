//! Whole obstacles: rows 16 to 38, except paths (18, 19) and long folds (20 to 22).

use super::{Case, case, check, check_all, example};
use crate::numbers::{near, solid, solids};
use rfm::Solid;
use rfm::glam::{DVec3, Vec3};

const PAWN: &[Case] = &[
    case(30, "pawn", [1.5, 1.5, 0.5], 0.159_599_576_930_204_99).scale(1.0),
    case(30, "pawn", [1.5, 1.5, 0.75], 0.151_641_412_429_565_59).scale(1.0),
    case(30, "pawn", [1.5, 1.5, 1.0], 0.476_246_890_528_022_26).scale(1.0),
    case(30, "pawn", [1.5, 1.5, 1.25], 0.053_752_081_539_519_999).scale(1.0),
    case(30, "pawn", [1.5, 1.5, 2.0], -0.475_439_595_883_728_47).scale(1.0),
    // single precision does not hold the points
    case(31, "pawn", [1.7, 1.5, 0.2], 0.109_435_180_621_832_51).scale(1.0).double_only(),
    case(31, "pawn", [2.0, 1.5, 0.5], -0.669_258_006_364_933_61).scale(1.0),
    case(31, "pawn", [3.0, 3.0, 3.0], -6.916_664_598_080_214_6).scale(1.0),
    // the base plane: a leaf is exactly 0
    case(32, "pawn", [1.5, 1.5, 0.0], 0.0).scale(1.0),
    // the waist opens again far below, but the slab decides
    case(33, "pawn", [1.5, 1.5, -10.0], -93.478_318_409_277_189).scale(1000.0),
];

const CUBE: &[Case] = &[
    case(25, "cube", [1.5; 3], 0.960_400_769_828_011_92).gradient([0.0; 3]).scale(2.25),
    case(26, "cube", [0.0, 1.5, 1.5], 0.0).gradient([3.0, 0.0, 0.0]),
    case(26, "cube", [0.0, 0.5, 1.0], 0.0).gradient([3.0, 0.0, 0.0]),
    case(27, "cube", [1e-8, 1e-8, 1.5], 1.757_359_301_164_986_1e-8).scale(3e-8).double_only(),
    case(28, "cube", [1000.0, 1.5, 1.5], -3_987_993.250_006_347_2),
];

const SOLIDS: &[Case] = &[
    // leaves are −1e-12 here, and only a factored form keeps their digits
    case(
        16,
        "(x*(2 - x) - y^2 - z^2) or (-x*(2 + x) - y^2 - z^2)",
        [0.0, 1e-6, 0.0],
        -5.857_864_376_269_049_5e-13,
    ),
    case(
        16,
        "(x*(2 - x) - y^2 - z^2) and (-x*(2 + x) - y^2 - z^2)",
        [0.0, 1e-6, 0.0],
        -3.414_213_562_373_095_0e-12,
    ),
    // where two balls touch there is no normal
    case(16, "(1 - sqrt((x - 1)^2 + y^2 + z^2)) or (1 - sqrt((x + 1)^2 + y^2 + z^2))", [0.0; 3], 0.0)
        .gradient([0.0; 3]),
    case(16, "(1 - sqrt((x - 1)^2 + y^2 + z^2)) and (1 - sqrt((x + 1)^2 + y^2 + z^2))", [0.0; 3], 0.0)
        .gradient([0.0; 3]),
    // a thin shell: the leaves are 1e-6, with the rounding of 1
    case(
        17,
        "1 - (x^2 + y^2 + z^2) and (x^2 + y^2 + z^2) - (1 - 1e-6)^2",
        [1.0 - 5e-7, 0.0, 0.0],
        5.857_861_447_336_419_4e-7,
    )
    .scale(1.0)
    .double_only(),
    case(
        17,
        "1 - (x^2 + y^2 + z^2) and (x^2 + y^2 + z^2) - (1 - 1e-6)^2",
        [0.0; 3],
        -1.414_210_148_161_946_9,
    ),
    // a million metres away x − 10⁶ is exact, x² − 2·10⁶x + 10¹² is not
    case(23, "0.5^2 - (x - 1e6)^2 - y^2 - z^2", [1_000_000.3, 0.0, 0.0], 0.159_999_999_972_060_32)
        .scale(0.25)
        .double_only(),
    case(24, "1e-24 - x^2 - y^2 - z^2", [0.0; 3], 1e-24),
    case(24, "sphere(1e-12)", [0.0; 3], 5e-13),
    case(33, "1 + 10*(z - 0.75)^2 - 20*((x - 1.5)^2 + (y - 1.5)^2)", [1.5, 1.5, -10.0], 1156.625),
    // at the singular point of a root the gradient is one of its limits
    case(35, "0.5 - sqrt(x^2 + y^2)", [0.0; 3], 0.5).gradient([0.0; 3]),
    case(35, "(0.25 - x^2 - y^2)/(2*0.5)", [0.0; 3], 0.25).gradient([0.0; 3]),
    case(36, "0.25^2 - (sqrt(x^2 + y^2) - 1)^2 - z^2", [0.0; 3], 0.0625 - 1.0).gradient([0.0; 3]),
    case(36, "torus(1, 0.25)", [0.0; 3], (0.0625 - 1.0) / 0.5).gradient([0.0; 3]),
    case(37, "z*tan(0.5) - sqrt(x^2 + y^2)", [0.0; 3], 0.0).gradient([0.0, 0.0, 0.546_302_489_843_790_5]),
    case(38, "sphere(2)", [0.0; 3], 1.0).gradient([0.0; 3]),
];

#[test]
fn solids_have_their_known_values() {
    check_all(SOLIDS);
}

#[test]
fn the_paper_s_obstacles_have_their_known_values() {
    for (name, cases) in [("pawn", PAWN), ("cube", CUBE)] {
        for solid in example(name) {
            cases.iter().for_each(|case| check(case, &solid));
        }
    }
}

#[track_caller]
fn gradient(solid: &Solid, p: [f64; 3], expected: [f64; 3], tolerance: f64) {
    let (_, found) = solid.omega_grad(DVec3::from_array(p));
    let error = (found - DVec3::from_array(expected)).length();
    assert!(error <= tolerance, "{solid:?} at {p:?}: {found} is {error:e} from {expected:?}");
}

/// Reference gradients that are known to ten or twelve digits.
#[test]
fn gradients_of_the_paper_s_obstacles() {
    for pawn in example("pawn") {
        gradient(&pawn, [1.7, 1.5, 0.2], [-0.093_547_775_155_5, 0.0, 0.254_816_995_764], 1e-12);
        gradient(&pawn, [2.0, 1.5, 0.5], [-0.996_359_949_883, 0.0, 1.286_994_687_54], 1e-11);
        gradient(&pawn, [1.5, 1.5, 0.5], [0.0, 0.0, 0.030_975_109_5], 1e-10);
        gradient(&pawn, [1.5, 1.5, 0.75], [0.0, 0.0, -0.114_410_229_1], 1e-10);
        // the rim of the base, where the textbook formula gives NaN
        let (omega, gradient) = pawn.omega_grad(DVec3::new(2.0, 1.5, 0.0));
        assert!(omega == 0.0 && gradient.is_finite(), "{omega} {gradient}");
        // row 32: the sign changes along z alone
        let sign = |z: f64| pawn.sign(DVec3::new(1.5, 1.5, z));
        assert_eq!([sign(1e-12), sign(0.0), sign(-1e-12)], [1.0, 0.0, -1.0]);
    }
    for cube in example("cube") {
        gradient(&cube, [1e-8, 1e-8, 1.5], [0.878_679_645_9, 0.878_679_643_5, 0.0], 1e-9);
    }
}

#[test]
fn rows_26_to_28_normals_and_distances_of_the_cube() {
    for cube in example("cube") {
        let face = cube.contact(DVec3::new(0.0, 0.5, 1.0));
        assert!(face.distance.abs() < 1e-15 && (face.normal + DVec3::X).length() < 1e-15, "{face:?}");
        let (omega, gradient) = cube.omega_grad(DVec3::new(0.0, 0.0, 1.5));
        assert_eq!(omega, 0.0);
        let normal = -gradient.normalize();
        assert!((normal - DVec3::new(-1.0, -1.0, 0.0).normalize()).length() < 1e-15, "{normal}");
        let (omega, gradient) = cube.omega_grad(DVec3::ZERO);
        assert!(omega == 0.0 && gradient.is_finite() && gradient.length() > 0.1, "{gradient}");
        // ω/|∇ω| of the product form is half the distance; the contact is the distance
        let far = DVec3::new(1000.0, 1.5, 1.5);
        let (omega, gradient) = cube.omega_grad(far);
        assert!((omega / gradient.length() + 499.248).abs() < 1e-3, "{}", omega / gradient.length());
        assert!((cube.contact(far).distance - 997.0).abs() < 1e-9);
    }
}

#[test]
fn row_17_the_hole_and_the_outside_of_a_thin_shell() {
    for shell in solids("let r2 = x^2 + y^2 + z^2\nlet d = 1e-6\nsolid s = 1 - r2 and r2 - (1 - d)^2") {
        // −3 ∧ (3 + 2d − d²)
        let v: f64 = 3.0 + 2e-6 - 1e-12;
        let expected = v - 3.0 - v.hypot(3.0);
        near(shell.omega(DVec3::new(2.0, 0.0, 0.0)), expected, 8.0);
        assert_eq!(shell.sign(DVec3::new(2.0, 0.0, 0.0)), -1.0);
        let bounds = shell.bounds().aabb().unwrap();
        assert!(bounds.contains(DVec3::splat(0.577)) && (bounds.size() - 2.0).abs().max_element() < 1e-4);
    }
    // in single precision the factored form keeps the sign
    for shell in
        solids("let r = sqrt(x^2 + y^2 + z^2)\nsolid s = (1 - r)*(1 + r) and (r - 0.999999)*(r + 0.999999)")
    {
        assert!(shell.omega_f32(Vec3::new(0.999_999_5, 0.0, 0.0)) > 0.0);
        assert!(shell.omega_f32(Vec3::new(1.000_000_1, 0.0, 0.0)) < 0.0);
    }
}

#[test]
fn row_23_expansion_would_lose_the_digits() {
    let at = DVec3::new(1e6 + 0.3, 0.0, 0.0);
    for solid in solid("0.5^2 - (x - 1e6)^2 - y^2 - z^2") {
        assert!((solid.omega(at) - 0.159_999_999_972_060_32).abs() < 1e-16);
    }
    // this is what a rewrite to powers of x gives: the compiler must not do it, and a file that does shows
    // why
    for solid in solid("0.25 - x^2 + 2e6*x - 1e12 - y^2 - z^2") {
        assert!((solid.omega(at) - 0.16).abs() > 1e-5, "{}", solid.omega(at));
    }
}

#[test]
fn row_29_order_changes_omega_and_not_the_sign() {
    let [a, _] = solid("x and y and z");
    let [b, _] = solid("x and (y and z)");
    let p = DVec3::new(1.0, 2.0, 0.5);
    assert_ne!(a.omega(p), b.omega(p));
    assert_eq!(a.sign(p), b.sign(p));
}

#[test]
fn row_34_leaves_of_unlike_scale() {
    for solid in solid("0.05 - (x^2 + y^2) and 20*(1 - z)^2 - 0.125") {
        for (p, sign) in [([0.0; 3], 1.0), ([0.3, 0.0, 0.0], -1.0), ([0.0, 0.0, 1.0], -1.0)] {
            assert_eq!(solid.sign(DVec3::from_array(p)), sign);
        }
        // the distance does not depend on the scale: 0.3 − √0.05 from the first leaf
        let contact = solid.contact(DVec3::new(0.3, 0.0, 0.0));
        assert!((contact.distance - (0.3 - 0.05f64.sqrt())).abs() < 1e-12, "{contact:?}");
    }
}

#[test]
fn rows_35_to_38_singular_places_have_a_distance() {
    for (expression, p, distance) in
        [("sphere(2)", [0.0; 3], -2.0), ("sphere(2).move([1, 2, 3])", [1.0, 2.0, 3.0], -2.0)]
    {
        for solid in solid(expression) {
            let contact = solid.contact(DVec3::from_array(p));
            assert!((contact.distance - distance).abs() < 1e-12, "{expression}: {contact:?}");
            assert!(contact.normal.is_finite() && contact.mean_curvature.is_finite(), "{contact:?}");
        }
    }
    // on the axis of a cylinder it is an estimate, see `ir::contact`
    for solid in solid("x^2 + y^2 <= 0.25") {
        let contact = solid.contact(DVec3::ZERO);
        assert!(contact.distance < -0.4 && contact.distance > -0.7, "{contact:?}");
    }
    for solid in solid("cone(1, 2)") {
        let (omega, gradient) = solid.omega_grad(DVec3::new(0.0, 0.0, 2.0));
        assert!(omega == 0.0 && gradient.is_finite(), "{omega} {gradient}");
    }
}
