//! Properties of whole solids: R₀ identities hold bit for bit, engines agree, simplification changes no
//! value, and ranges hold.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::interval::Interval;
use rfm::ir::Interpreter;
use rfm::{Engine, Program, Solid};

fn solid(expression: &str, engine: Engine) -> Solid {
    let program = Program::from_source("p.rfm", format!("rfm 1\nsolid s = {expression}"));
    program.unwrap_or_else(|e| panic!("{e}")).solid_with("s", engine).unwrap()
}

fn same(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -3.0..3.0f64,
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 1e-8, 1e-160, 1e150, -1e6]),
    ]
}

fn point() -> impl Strategy<Value = DVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(DVec3::from_array)
}

/// A number-valued expression of the language, fully bracketed.
pub fn expression() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        prop::sample::select(vec!["x", "y", "z", "0", "1", "0.3", "2", "(x^2 + y^2)"]).prop_map(String::from),
        prop::sample::select(vec![
            "sphere(1)",
            "box()",
            "cylinder(0.5, 2)",
            "torus()",
            "cone(1, 2)",
            "capsule()"
        ])
        .prop_map(String::from),
    ];
    leaf.prop_recursive(4, 24, 2, |inner| {
        let two = prop::sample::select(vec!["+", "-", "*", "/", "and", "or", "\\", "<=", ">="]);
        let one = prop::sample::select(vec!["sqrt", "abs", "sin", "cos", "atan", "exp", "not ", "-", "floor", "round", "ceil", "fract",
            "sinh", "cosh", "tanh", "log2", "log10"]);
        prop_oneof![
            4 => (inner.clone(), two, inner.clone()).prop_map(|(a, op, b)| format!("({a} {op} {b})")),
            2 => (one, inner.clone()).prop_map(|(f, a)| format!("({f}({a}))")),
            1 => (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("min({a}, max({b}, z))")),
            1 => inner.clone().prop_map(|a| format!("({a}).move([0.5, 0, -1]).rotate_z(30 deg)")),
            1 => inner.clone().prop_map(|a| format!("({a}).twist(0.2).repeat([1, 1, 1], [2, 1, 1])")),
            1 => (inner.clone(), inner.clone(), inner.clone()).prop_map(|(c, a, b)| format!("where({c}, {a}, {b})")),
            1 => (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("mod({a}, {b})")),
            1 => (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("smooth_or({a}, blend({b}, x, 1), 0.5)")),
            1 => inner.prop_map(|a| format!("(0 <= {a} <= 1)")),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(120) })]

    #[test]
    fn logic_commutes_and_obeys_de_morgan_bit_for_bit(a in expression(), b in expression(), p in point()) {
        let value = |text: String| solid(&text, Engine::Interpreter).omega_grad(p);
        for (left, right) in [
            (format!("{a} and {b}"), format!("{b} and {a}")),
            (format!("{a} or {b}"), format!("{b} or {a}")),
            (format!("not ({a} and {b})"), format!("(not {a}) or (not {b})")),
            (format!("not ({a} or {b})"), format!("(not {a}) and (not {b})")),
            (format!("{a} \\ {b}"), format!("{a} and not {b}")),
        ] {
            let (v, w) = (value(left), value(right));
            prop_assert!(same(v.0, w.0), "{:?} {:?}", v, w);
        }
    }

    #[test]
    fn machine_code_is_the_interpreter(text in expression(), points in prop::collection::vec(point(), 8)) {
        let (jit, interpreter) = (solid(&text, Engine::Jit), solid(&text, Engine::Interpreter));
        for p in points {
            let (a, b) = (jit.omega_grad(p), interpreter.omega_grad(p));
            // where ω is NaN its gradient has no meaning, and the engines differ in it
            if a.0.is_nan() {
                prop_assert!(b.0.is_nan(), "{} at {}: {:?} {:?}", text, p, a, b);
                continue;
            }
            prop_assert!(same(a.0, b.0) && (0..3).all(|i| same(a.1[i], b.1[i])), "{} at {}: {:?} {:?}", text, p, a, b);
            let (a, b) = (jit.omega_grad_f32(p.as_vec3()), interpreter.omega_grad_f32(p.as_vec3()));
            let equal =
                same(a.0.into(), b.0.into()) && (a.0.is_nan() || (0..3).all(|i| same(a.1[i].into(), b.1[i].into())));
            prop_assert!(equal, "{} at {} in f32: {:?} {:?}", text, p, a, b);
            prop_assert!(same(jit.omega(p), interpreter.omega(p)));
        }
    }

    #[test]
    fn simplification_changes_no_value(text in expression(), points in prop::collection::vec(point(), 8)) {
        let program = Program::from_source("p.rfm", format!("rfm 1\nsolid s = {text}")).unwrap();
        let module = program.module();
        let written = Interpreter::new(&module.graph, &[module.solids[0].node]);
        let simplified = program.solid_with("s", Engine::Interpreter).unwrap();
        for p in points {
            let mut value = [0.0];
            written.eval_f64(p.to_array(), &mut value);
            prop_assert!(same(value[0], simplified.omega(p)), "{} at {}", text, p);
        }
    }

    #[test]
    fn ranges_hold_the_values(text in expression(), a in point(), b in point(), t in [0.0..=1.0f64, 0.0..=1.0f64, 0.0..=1.0f64]) {
        for engine in [Engine::Jit, Engine::Interpreter] {
            let solid = solid(&text, engine);
            let over = Aabb::new(a.min(b), a.max(b));
            let range = solid.range(&over);
            let inside = over.min + (over.max - over.min) * DVec3::from_array(t);
            for p in [inside, over.min, over.max, over.centre()] {
                let omega = solid.omega(p.clamp(over.min, over.max));
                // this holds for overflow too; where ω is NaN, the range is everything
                let held = if omega.is_nan() { range == Interval::ALL } else { range.contains(omega) };
                prop_assert!(held, "{} at {}: {} not in {:?}", text, p, omega, range);
            }
        }
    }
}
