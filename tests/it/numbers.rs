//! Long folds, and the helpers for tests of exactly known numbers. The other hard cases are in `hard_cases`.
//!
//! The expected numbers come from 40-digit arithmetic; tolerances are in units of the last place (ulp).

use rfm::codegen::{Form, Forms, Precision};
use rfm::glam::{DVec3, Vec3};
use rfm::solid::ProgramKind;
use rfm::{Engine, Program, Solid};

pub(crate) fn solids(text: &str) -> [Solid; 2] {
    let program = Program::from_source("t.rfm", format!("rfm 1\n{text}")).unwrap_or_else(|e| panic!("{e}"));
    [Engine::Jit, Engine::Interpreter].map(|engine| program.solid_with("s", engine).unwrap())
}

/// A solid of one expression, by both engines.
pub(crate) fn solid(expression: &str) -> [Solid; 2] {
    solids(&format!("solid s = {expression}"))
}

#[track_caller]
pub(crate) fn near(found: f64, expected: f64, ulps: f64) {
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

#[test]
fn long_folds_do_not_overflow() {
    // the language balances them, so 1024 equal operands are a perfect tree
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

/// `let u1 = u0 or …`: a fold written by hand, which no limit on nesting stops.
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
                // no type holds the value, and neither answer is NaN
                assert_eq!((omega, gradient.x), (f32::INFINITY, f32::INFINITY));
            }
            assert_eq!((gradient.y, gradient.z), (0.0, 0.0));
        }
    }
    // 128 members exceed the type in every form: the value is infinite with the right sign
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
