//! Long folds, and what tests of exactly known numbers share; the other hard cases are in `hard_cases`.
//!
//! The expected numbers come from 40-digit arithmetic; tolerances are in units of the last place (ulp).

use rfm::glam::{DVec3, Vec3};
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
