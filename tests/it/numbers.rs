//! Hard cases with exactly known answers, through the language, in machine code and the interpreter.
//!
//! The expected numbers come from 40-digit arithmetic; tolerances are in units of the last place (ulp).

use rfm::codegen::{Form, Forms, Precision};
use rfm::glam::{DVec3, Vec3};
use rfm::solid::ProgramKind;
use rfm::{Engine, Program, Solid};

fn solids(text: &str) -> [Solid; 2] {
    let program = Program::from_source("t.rfm", format!("rfm 1\n{text}")).unwrap_or_else(|e| panic!("{e}"));
    [Engine::Jit, Engine::Interpreter].map(|engine| program.solid_with("s", engine).unwrap())
}

fn solid(expression: &str) -> [Solid; 2] {
    solids(&format!("solid s = {expression}"))
}

#[track_caller]
fn near(found: f64, expected: f64, ulps: f64) {
    let tolerance = ulps * f64::EPSILON * expected.abs();
    assert!((found - expected).abs() <= tolerance, "{found:?} is not {expected:?} to {ulps} ulp");
}

/// ω of an expression at a point, to 4 ulp.
#[track_caller]
fn omega(expression: &str, at: [f64; 3], expected: f64) {
    for solid in solid(expression) {
        near(solid.omega(DVec3::from_array(at)), expected, 4.0);
        near(solid.omega_grad(DVec3::from_array(at)).0, expected, 4.0);
    }
}

/// The same in single precision.
#[track_caller]
fn omega_f32(expression: &str, at: [f32; 3], expected: f64) {
    for solid in solid(expression) {
        let found = f64::from(solid.omega_f32(Vec3::from_array(at)));
        let tolerance = 4.0 * f64::from(f32::EPSILON) * expected.abs();
        assert!((found - expected).abs() <= tolerance, "{found:?} is not {expected:?}");
    }
}

/// ∇ω of an expression of x and y: the weights of its one operation.
#[track_caller]
fn weights(expression: &str, [u, v]: [f64; 2], expected: [f64; 2]) {
    for solid in solid(expression) {
        let (_, gradient) = solid.omega_grad(DVec3::new(u, v, 0.0));
        near(gradient.x, expected[0], 6.0);
        near(gradient.y, expected[1], 6.0);
        assert_eq!(gradient.z, 0.0);
    }
}

#[track_caller]
fn gradient(expression: &str, at: [f64; 3], expected: [f64; 3]) {
    for solid in solid(expression) {
        let (_, found) = solid.omega_grad(DVec3::from_array(at));
        let expected = DVec3::from_array(expected);
        assert!(
            (found - expected).length() <= 1e-12 * (1.0 + expected.length()),
            "{found} is not {expected}"
        );
    }
}

#[test]
fn pythagorean_node() {
    omega("x and y", [3.0, 4.0, 0.0], 2.0);
    omega("x or y", [3.0, 4.0, 0.0], 12.0);
    omega("x and y", [-3.0, -4.0, 0.0], -12.0);
    omega("x or y", [-3.0, -4.0, 0.0], -2.0);
    omega("x and y", [3.0, -4.0, 0.0], -6.0);
    omega("x or y", [3.0, -4.0, 0.0], 4.0);
    weights("x and y", [3.0, 4.0], [0.4, 0.2]);
    weights("x or y", [3.0, 4.0], [1.6, 1.8]);
    weights("x and y", [3.0, -4.0], [0.4, 1.8]);
    weights("x or y", [3.0, -4.0], [1.6, 0.2]);
}

#[test]
fn cancellation_keeps_sign_and_value() {
    omega_f32("x and y", [1.0, 2f32.powi(-30), 0.0], 9.313_225_741_817_976_5e-10);
    omega_f32("x and y", [1.0, -(2f32.powi(-30)), 0.0], -9.313_225_750_491_593_8e-10);
    omega("x and y", [1.0, 2f64.powi(-60), 0.0], 2f64.powi(-60));
}

#[test]
fn overflow_underflow_and_denormals_keep_the_sign() {
    for solid in solid("x or y") {
        let found = solid.omega_f32(Vec3::new(-1e20, -1.0, 0.0));
        assert!((found + 1.0).abs() <= 4.0 * f32::EPSILON, "{found}");
        let d = f32::from_bits(1);
        assert!(solid.omega_f32(Vec3::new(d, -d, 0.0)) > 0.0);
    }
    for solid in solid("x and y") {
        let found = solid.omega_f32(Vec3::new(1e-25, 1e-25, 0.0));
        assert!(found > 0.0 && found < 1e-25, "{found}"); // squares underflow: the sign is exact, the value is not
        let (_, gradient) = solid.omega_grad_f32(Vec3::new(1e-25, 1e-25, 0.0));
        assert!(gradient.is_finite() && gradient.x > 0.0 && gradient.y > 0.0, "{gradient}");
        let d = f32::from_bits(1);
        assert!(solid.omega_f32(Vec3::new(d, d, 0.0)) > 0.0);
        let d = f64::from_bits(1);
        assert!(solid.omega(DVec3::new(d, d, 0.0)) > 0.0);
    }
}

#[test]
fn corners_and_zeros() {
    for expression in ["x and y", "x or y"] {
        for solid in solid(expression) {
            let (omega, gradient) = solid.omega_grad(DVec3::ZERO);
            assert!(omega == 0.0 && gradient.is_finite() && gradient.x > 0.0, "{omega} {gradient}");
            assert!((gradient.x - gradient.y).abs() < 1e-15, "{gradient}");
        }
    }
    for (expression, v, value, expected) in [
        ("x and y", 1.0, 0.0, [1.0, 0.0]),
        ("x and y", -1.0, -2.0, [1.0, 2.0]),
        ("x or y", 1.0, 2.0, [1.0, 2.0]),
        ("x or y", -1.0, 0.0, [1.0, 0.0]),
    ] {
        omega(expression, [0.0, v, 0.0], value);
        weights(expression, [0.0, v], expected);
    }
}

#[test]
fn infinities_of_leaves_and_nan() {
    omega("1/x and 1", [0.0; 3], 1.0);
    omega("-1/x or 1", [0.0; 3], 1.0);
    for expression in [
        "sqrt(x) and y",
        "y and sqrt(x)",
        "sqrt(x) or y",
        "y or sqrt(x)",
        "min(sqrt(x), y)",
        "max(y, sqrt(x))",
    ] {
        for solid in solid(expression) {
            assert!(solid.omega(DVec3::new(-1.0, 1.0, 0.0)).is_nan(), "{expression}");
            assert!(solid.sign(DVec3::new(-1.0, 1.0, 0.0)).is_nan(), "{expression}");
        }
    }
    for solid in solid("x and y") {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(solid.omega(DVec3::new(1.0, 1.0, bad)).is_nan());
        }
    }
}

#[test]
fn idempotence_is_false_and_complements_have_known_values() {
    omega("x and x", [1.0, 0.0, 0.0], 0.585_786_437_626_904_95);
    omega("x or x", [1.0, 0.0, 0.0], 3.414_213_562_373_095_0);
    omega("x and not x", [1.0, 0.0, 0.0], -std::f64::consts::SQRT_2);
    omega("x or not x", [1.0, 0.0, 0.0], std::f64::consts::SQRT_2);
    omega("x and not x", [0.0; 3], 0.0);
    omega("x or not x", [0.0; 3], 0.0);
    gradient("x and not x", [0.0; 3], [0.0; 3]);
}

#[test]
fn tangent_spheres() {
    let ball = |c: &str| format!("1 - sqrt((x {c})^2 + y^2 + z^2)");
    for (op, at_origin) in [("or", 0.0), ("and", 0.0)] {
        let both = format!("({}) {op} ({})", ball("- 1"), ball("+ 1"));
        omega(&both, [0.0; 3], at_origin);
        for solid in solid(&both) {
            let (_, gradient) = solid.omega_grad(DVec3::ZERO);
            assert!(gradient.is_finite() && gradient.length() < 1e-15, "{gradient}");
        }
    }
    // leaves of −1e-12: only a factored form has their digits
    for (op, expected) in [("or", -5.857_864_376_269_049_5e-13), ("and", -3.414_213_562_373_095_0e-12)] {
        let factored = format!("(x*(2 - x) - y^2 - z^2) {op} (-x*(2 + x) - y^2 - z^2)");
        omega(&factored, [0.0, 1e-6, 0.0], expected);
    }
}

#[test]
fn thin_shell() {
    let shell = "let r2 = x^2 + y^2 + z^2\nlet t = 1e-6\nsolid s = 1 - r2 and r2 - (1 - t)^2";
    for solid in solids(shell) {
        // the leaves are 1e-6 with an error of one ulp of 1
        let found = solid.omega(DVec3::new(1.0 - 5e-7, 0.0, 0.0));
        assert!((found - 5.857_861_447_336_419_4e-7).abs() < 4.0 * f64::EPSILON, "{found:?}");
        near(solid.omega(DVec3::ZERO), -1.414_210_148_161_946_9, 4.0);
        assert!(solid.omega(DVec3::new(2.0, 0.0, 0.0)) < 0.0);
    }
}

#[test]
fn long_folds_do_not_overflow() {
    // balanced as the language writes them; 1024 equal operands are a perfect tree
    omega("any i in 0..1024: x", [1.0, 0.0, 0.0], 215_231.995_242_343_04);
    for solid in solid("any i in 0..1000: x") {
        let found = solid.omega(DVec3::X);
        assert!(found > 1e5 && found < 3e5, "{found}");
        assert!(solid.omega_f32(Vec3::X).is_finite());
        let outside = solid.omega(-DVec3::X);
        assert!(outside < 0.0 && outside > -0.1, "{outside}");
    }
    // a left fold, written with parentheses
    let left = |n: usize, op: &str| "(".repeat(n - 1) + "x" + &format!(" {op} x)").repeat(n - 1);
    for solid in solid(&left(190, "or")) {
        let outside = solid.omega(-DVec3::X);
        assert!(outside < 0.0 && outside > -0.02, "{outside}");
        assert!(solid.omega(DVec3::X).is_finite());
        // in f32 the sum of 2ⁿ overflows, to the side of its sign
        assert_eq!(solid.omega_f32(Vec3::X), f32::INFINITY);
    }
}

/// `let u1 = u0 or …`: a fold by hand that no limit on nesting stops.
fn left_fold(members: usize, op: &str) -> [Solid; 2] {
    let steps = (1..members).map(|i| format!("let u{i} = u{} {op} x\n", i - 1)).collect::<String>();
    solids(&format!("let u0 = x\n{steps}solid s = u{}", members - 1))
}

/// 1000 equal operands: each of 999 steps adds at most an ulp or two, and most of them cancel.
const FOLD_ULPS: f64 = 1000.0;

#[test]
fn folds_by_hand_do_not_overflow_before_their_values_do() {
    for solid in left_fold(1000, "or") {
        for (x, expected) in [(1.0, 1.207_163_035_900_787_5e301), (-1.0, -0.001_986_210_697_496_951_2)] {
            // ω is homogeneous: its slope is its value at 1
            let (omega, gradient) = solid.omega_grad(DVec3::new(x, 0.0, 0.0));
            near(omega, expected, FOLD_ULPS);
            assert_eq!(solid.omega(DVec3::new(x, 0.0, 0.0)).to_bits(), omega.to_bits());
            near(gradient.x, expected * x, FOLD_ULPS);
        }
    }
}

#[test]
fn folds_by_hand_in_single_precision() {
    let near = |found: f32, expected: f64| {
        let tolerance = FOLD_ULPS * f64::from(f32::EPSILON) * expected.abs();
        assert!((f64::from(found) - expected).abs() <= tolerance, "{found} is not {expected}");
    };
    // (members, x, exact value by the recurrence in 40 digits)
    for (members, x, expected) in [
        (65, 1.0, 41_564_253_295_135_782_955.598),
        (100, 1.0, 1.428_136_868_682_147_4e30),
        (500, -1.0, -0.003_950_575_327_898_387),
        (500, 1e-20, f64::INFINITY),
    ] {
        for solid in left_fold(members, "or") {
            let (omega, gradient) = solid.omega_grad_f32(Vec3::new(x, 0.0, 0.0));
            if expected.is_finite() {
                near(omega, expected);
                near(gradient.x, expected * f64::from(x));
            } else {
                // neither has a value in the type, and neither is NaN
                assert_eq!((omega, gradient.x), (f32::INFINITY, f32::INFINITY));
            }
            assert_eq!((gradient.y, gradient.z), (0.0, 0.0));
        }
    }
    // 128 members are beyond the type in every form: the value is infinite with the right sign
    for solid in left_fold(135, "or") {
        assert_eq!(solid.omega_f32(Vec3::X), f32::INFINITY);
        assert!(solid.omega_f32(-Vec3::X) < 0.0);
    }
}

#[test]
fn ordinary_solids_need_no_other_form() {
    let example = |name: &str| {
        let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
        Program::from_path(path).unwrap().solid(name).unwrap()
    };
    let many =
        Program::from_source("m.rfm", "rfm 1\nsolid s = any i in 0..1000: ball([i, 0, 0], 0.4)").unwrap();
    for solid in [example("pawn"), example("bishop"), example("cube"), many.solid("s").unwrap()] {
        for precision in [Precision::F32, Precision::F64] {
            for kind in [ProgramKind::Value, ProgramKind::Gradient] {
                assert_eq!(solid.forms(kind, precision), &Forms::all(Form::Stable), "{solid:?}");
            }
        }
    }
}

#[test]
fn huge_offsets_and_tiny_scales() {
    let x = 1e6 + 0.3;
    let d: f64 = x - 1e6;
    omega("0.5^2 - (x - 1e6)^2 - y^2 - z^2", [x, 0.0, 0.0], 0.25 - d * d);
    for solid in solid("0.5^2 - (x - 1e6)^2 - y^2 - z^2") {
        assert!((solid.omega(DVec3::new(x, 0.0, 0.0)) - 0.159_999_999_972_060_32).abs() < 1e-16);
    }
    omega("1e-24 - x^2 - y^2 - z^2", [0.0; 3], 1e-24);
    omega("x and y", [1e-24, 1e-24, 0.0], 5.857_864_376_269_049_5e-25);
    omega("sphere(1e-12)", [0.0; 3], 5e-13);
}

#[test]
fn corner_of_half_spaces_is_a_left_fold() {
    omega("x and y and z", [1.0; 3], 0.426_844_786_590_227_52);
    omega("x and y and z", [-1.0; 3], -7.971_860_853_700_944);
    // order changes ω, but the normal only by the fold's asymmetry
    let [a, _] = solid("x and y and z");
    let [b, _] = solid("x and (y and z)");
    let p = DVec3::new(1.0, 2.0, 0.5);
    assert_ne!(a.omega(p), b.omega(p));
    assert_eq!(a.sign(p), b.sign(p));
}

#[test]
fn reopened_hyperboloid_and_unlike_scales() {
    let leaf = "1 + 10*(z - 0.75)^2 - 20*((x - 1.5)^2 + (y - 1.5)^2)";
    omega(leaf, [1.5, 1.5, -10.0], 1156.625);
    for solid in solid("0.05 - (x^2 + y^2) and 20*(1 - z)^2 - 0.125") {
        assert!(solid.omega(DVec3::new(0.0, 0.0, 0.0)) > 0.0);
        assert!(solid.omega(DVec3::new(0.3, 0.0, 0.0)) < 0.0);
        assert!(solid.omega(DVec3::new(0.0, 0.0, 1.0)) < 0.0);
    }
}

#[test]
fn singular_axes_and_apexes() {
    for (expression, value, expected) in [
        ("0.5 - sqrt(x^2 + y^2)", 0.5, [0.0; 3]),
        ("0.25^2 - (sqrt(x^2 + y^2) - 1)^2 - z^2", 0.0625 - 1.0, [0.0; 3]),
        ("z*tan(0.5) - sqrt(x^2 + y^2)", 0.0, [0.0, 0.0, 0.546_302_489_843_790_5]),
        ("sphere(2)", 1.0, [0.0; 3]),
        ("torus(1, 0.25)", (0.0625 - 1.0) / 0.5, [0.0; 3]),
    ] {
        omega(expression, [0.0; 3], value);
        gradient(expression, [0.0; 3], expected);
    }
    for solid in solid("cone(1, 2)") {
        let (omega, gradient) = solid.omega_grad(DVec3::new(0.0, 0.0, 2.0));
        assert!(omega == 0.0 && gradient.is_finite(), "{omega} {gradient}");
    }
}
