//! Machine code gives the bits of the interpreter, and both agree with 40-digit arithmetic to a few units in
//! the last place.

use rfm::codegen::Form;
use rfm::glam::{DVec3, Vec3};
use rfm::{Engine, Field, Program, Solid};

use crate::random::Random;

fn example(name: &str) -> [Solid; 2] {
    let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
    let program = Program::from_path(path).unwrap_or_else(|e| panic!("{e}"));
    [Engine::Jit, Engine::Interpreter].map(|engine| program.solid_with(name, engine).unwrap())
}

/// Every operation of the language in one solid.
pub const EVERYTHING: &str = "rfm 1
let r = sqrt(x^2 + y^2)
solid everything = (sin(x) <= cos(y) and exp(-z^2) >= abs(x)/3 or atan2(y, x) <= 1)
  and min(x, y, z) <= max(x, 2)^3 or (tan(x/4) + asin(x/9) + acos(y/9) + atan(z) <= ln(4 + x) + pow(2 + y^2, z/3))
  or hypot(x, y) <= sign(z) and not torus(1, 0.2).rotate([1, 2, 3], 40 deg).scale([1, 2, 3]).move([0.1, 0, z/5])
  \\ normalise(box() and sphere(0.3) or cone(1, 2) and capsule(0.2, 1) and ellipsoid(1, 2, 3))
  and any i in 0..5 : cylinder(0.1, 1).move([1, 0, 0]).rotate_z(i*72 deg) and r <= 3 - clamp(z, 0, 1)
  and all i in 0..3 : half_space([i, 1, -1], [0, 1, 0]).mirror([1, i, 0]).rotate_x(90 deg).rotate_y(0.3)
";

fn awkward_coordinates() -> Vec<f64> {
    let mut values =
        vec![0.0, -0.0, 1.0, -1.0, 0.5, 1.5, 3.0, 1e-8, 1e-300, 5e-324, 1e6, -1e6, 1e160, f64::NAN];
    values.extend([f64::INFINITY, f64::NEG_INFINITY, 0.1, -0.7, 2.0, 0.25, 1.25]);
    values
}

pub fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()) || (a == 0.0 && b == 0.0)
}

/// A fold written by hand. In `f32` some of its operations are scaled, in `f64` none.
pub fn left_fold(members: usize) -> String {
    let steps = (1..members).map(|i| format!("let u{i} = u{} or {i}*x - y\n", i - 1)).collect::<String>();
    format!("rfm 1\nlet u0 = x - z\n{steps}solid fold = u{}\n", members - 1)
}

#[test]
fn machine_code_is_the_interpreter() {
    let source = Program::from_source("everything.rfm", EVERYTHING).unwrap_or_else(|e| panic!("{e}"));
    let everything =
        [Engine::Jit, Engine::Interpreter].map(|engine| source.solid_with("everything", engine).unwrap());
    let fold = Program::from_source("fold.rfm", left_fold(90)).unwrap_or_else(|e| panic!("{e}"));
    let folds = [Engine::Jit, Engine::Interpreter].map(|engine| fold.solid_with("fold", engine).unwrap());
    let node = source.module().solids[0].node;
    let [textbook, scaled] = [Form::Textbook, Form::Scaled].map(|form| {
        [Engine::Jit, Engine::Interpreter]
            .map(|engine| Solid::with_form("everything", &source.module().graph, node, engine, form).unwrap())
    });
    let pieces = [example("pawn"), example("bishop"), example("cube")];
    for [jit, interpreter] in [everything, textbook, scaled, folds].into_iter().chain(pieces) {
        let values = awkward_coordinates();
        for &x in &values {
            for &y in &values {
                for &z in &values {
                    let p = DVec3::new(x, y, z);
                    let (a, b) = (jit.omega_grad(p), interpreter.omega_grad(p));
                    let equal = same(a.0, b.0) && (0..3).all(|i| same(a.1[i], b.1[i]));
                    assert!(equal, "{jit:?} at {p}: {a:?} and {b:?}");
                    assert!(same(jit.omega(p), interpreter.omega(p)), "{jit:?} at {p}");
                    assert!(p.is_finite() || a.0.is_nan(), "{jit:?} at {p}: {}", a.0);
                    let q = p.as_vec3();
                    let (a, b) = (jit.omega_grad_f32(q), interpreter.omega_grad_f32(q));
                    let equal =
                        same(a.0.into(), b.0.into()) && (0..3).all(|i| same(a.1[i].into(), b.1[i].into()));
                    assert!(equal, "{jit:?} at {q} in f32: {a:?} and {b:?}");
                    assert!(same(jit.omega_f32(q).into(), interpreter.omega_f32(q).into()));
                    assert!(Vec3::is_finite(q) || a.0.is_nan());
                }
            }
        }
    }
}

#[test]
fn batches_of_any_length_are_the_single_points() {
    let [jit, _] = example("bishop");
    let mut random = Random(1);
    for n in [0, 1, 2, 3, 4, 5, 7, 8, 31, 100] {
        let [x, y, z] =
            std::array::from_fn(|_| (0..n + 1).map(|_| random.within(0.0, 3.0)).collect::<Vec<f64>>());
        // begins one past the start: no alignment may be needed
        let points = [&x[1..], &y[1..], &z[1..]];
        let mut omega = vec![0.0; n];
        jit.omega_many(points, &mut omega);
        let mut out: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; n]);
        jit.omega_grad_many(points, out.each_mut().map(|c| &mut c[..]));
        let single = points.map(|c| c.iter().map(|&v| v as f32).collect::<Vec<f32>>());
        let mut omega32 = vec![0f32; n];
        jit.omega_many(single.each_ref().map(|c| &c[..]), &mut omega32);
        for i in 0..n {
            let p = DVec3::new(points[0][i], points[1][i], points[2][i]);
            let (w, g) = jit.omega_grad(p);
            assert_eq!(omega[i].to_bits(), w.to_bits());
            assert_eq!([out[0][i], out[1][i], out[2][i], out[3][i]], [w, g.x, g.y, g.z]);
            assert_eq!(omega32[i], jit.omega_f32(p.as_vec3()));
        }
    }
}

#[test]
fn programs_are_shared_between_threads_and_freed() {
    let program = Program::from_source("ball.rfm", "rfm 1\nsolid ball = sphere(1)").unwrap();
    for _ in 0..200 {
        let solid = program.solid_with("ball", Engine::Jit).unwrap();
        let copies: Vec<Solid> = (0..4).map(|_| solid.clone()).collect();
        drop(solid);
        std::thread::scope(|scope| {
            for copy in copies {
                scope.spawn(move || assert_eq!(copy.omega(DVec3::ZERO), 0.5));
            }
        });
    }
}

#[test]
fn the_twin_has_the_sign_of_omega() {
    let source = Program::from_source("everything.rfm", EVERYTHING).unwrap_or_else(|e| panic!("{e}"));
    let everything =
        [Engine::Jit, Engine::Interpreter].map(|engine| source.solid_with("everything", engine).unwrap());
    for [jit, interpreter] in [everything, example("pawn"), example("bishop"), example("cube")] {
        let values = awkward_coordinates();
        let mut points = Vec::new();
        for &x in &values {
            for &y in &values {
                points.extend(values.iter().map(|&z| DVec3::new(x, y, z)));
            }
        }
        let column = |axis: usize| points.iter().map(|p| p[axis]).collect::<Vec<f64>>();
        let (x, y, z) = (column(0), column(1), column(2));
        let mut twin = vec![0.0; points.len()];
        jit.twin_many([&x, &y, &z], &mut twin);
        let mut signs = vec![0.0; points.len()];
        jit.sign_many([&x, &y, &z], &mut signs);
        for (i, &p) in points.iter().enumerate() {
            let sign = interpreter.sign(p);
            assert!(same(jit.sign(p), sign) && same(signs[i], sign), "{jit:?} at {p}");
            assert!(same(twin[i], Field::omega(&interpreter.twin(), p)), "{jit:?} at {p}");
            assert!(p.is_finite() || sign.is_nan(), "{jit:?} at {p}: {sign}");
            let omega = jit.omega(p);
            // far from the origin leaves overflow, and then perhaps only one of the two has an answer
            if p.abs().max_element() < 1e70 && !omega.is_nan() {
                let expected = f64::from(i8::from(omega > 0.0) - i8::from(omega < 0.0));
                assert!(sign == expected || sign.is_nan(), "{jit:?} at {p}: sign {sign}, ω {omega}");
            }
            let twin = jit.twin();
            let (a, b) = (twin.omega_grad(p), interpreter.twin().omega_grad(p));
            assert!(
                same(a.0, b.0) && (0..3).all(|i| same(a.1[i], b.1[i])),
                "{jit:?} at {p}: {a:?} and {b:?}"
            );
        }
    }
}
