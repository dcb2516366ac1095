//! Columns are evaluated in blocks, step by step. Whatever the steps are, the bits are those of the
//! interpreter.

use rfm::glam::{DVec3, Vec3};
use rfm::{Engine, Program, Solid};

use crate::random::Random;

/// Scenes whose graphs fall into blocks in every possible way.
fn scenes() -> Vec<(&'static str, String)> {
    let balls = |joined: &dyn Fn(usize) -> String, n: usize| (0..n).map(joined).collect::<String>();
    let fold = balls(&|i| format!("let u{} = u{i} or ball([{i}/9, 1, 2 - {i}/40], 0.3)\n", i + 1), 40);
    vec![
        ("one_junction", "solid s = x <= 1 and y <= 2".into()),
        ("twice_the_same", "let a = sphere(1)\nsolid s = a and a or (a and z <= 0)".into()),
        ("a_constant", "solid s = sphere(1) or 0.25 and x".into()),
        (
            "arithmetic_above",
            "solid s = 2*(x <= 1 and y <= 2) + (z <= 1 or x <= y)^2 and not (z and x)".into(),
        ),
        ("normalised", "solid s = normalise(box() and sphere(0.7)) or normalise(x and y)".into()),
        (
            "shared",
            "solid s = any i in 0..64 : ball([i/16, sin(i), cos(i)], 0.4) \\ box().move([i/20, 0, 0])".into(),
        ),
        (
            "few_of_many",
            "solid s = any i in 0..30 : sphere(1 + i/8) and x <= i/7 and y^2 + z*x <= i and cone(1, 2 + i)"
                .into(),
        ),
        ("a_fold", format!("let u0 = sphere(1)\n{fold}solid s = u40")),
    ]
}

fn compile(name: &str, text: &str) -> [Solid; 2] {
    let program = Program::from_source(format!("{name}.rfm"), format!("rfm 1\n{text}\n"));
    let program = program.unwrap_or_else(|e| panic!("{name}: {e}"));
    [Engine::Jit, Engine::Interpreter].map(|engine| program.solid_with("s", engine).unwrap())
}

/// Random places, and some where operands are zero, equal, huge or NaN.
fn points(count: usize) -> [Vec<f64>; 3] {
    let special = [0.0, 1.0, -1.0, 2.0, 1e30, -1e-30, f64::NAN, f64::INFINITY, 5e-324];
    let mut random = Random(7);
    let mut next = || {
        let number = random.within(-2.0, 4.0);
        let at = (random.0 >> 33) as usize;
        if at.is_multiple_of(11) { special[at / 11 % special.len()] } else { number }
    };
    std::array::from_fn(|_| (0..count).map(|_| next()).collect())
}

fn same(a: f64, b: f64) -> bool {
    a == b || (a.is_nan() && b.is_nan())
}

#[test]
fn columns_are_the_interpreter_bit_for_bit() {
    for (name, text) in scenes() {
        let [jit, interpreter] = compile(name, &text);
        for count in [1, 2, 15, 16, 17, 255, 300] {
            let columns = points(count);
            let double = columns.each_ref().map(|c| &c[..]);
            let columns = columns.each_ref().map(|c| c.iter().map(|&v| v as f32).collect::<Vec<f32>>());
            let single = columns.each_ref().map(|c| &c[..]);
            let (mut omega, mut omega32) = (vec![0.0; count], vec![0f32; count]);
            jit.omega_many(double, &mut omega);
            jit.omega_many(single, &mut omega32);
            let mut twin = vec![0.0; count];
            jit.twin_many(double, &mut twin);
            let mut all: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; count]);
            jit.omega_grad_many(double, all.each_mut().map(|c| &mut c[..]));
            let mut all32: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; count]);
            jit.omega_grad_many(single, all32.each_mut().map(|c| &mut c[..]));
            for i in 0..count {
                let p = DVec3::new(double[0][i], double[1][i], double[2][i]);
                let q = Vec3::new(single[0][i], single[1][i], single[2][i]);
                let (w, g) = interpreter.omega_grad(p);
                assert!(same(omega[i], interpreter.omega(p)), "{name}: ω at {p}");
                assert!(same(jit.omega(p), omega[i]), "{name}: ω of one point at {p}");
                assert!(same(twin[i], rfm::Field::omega(&interpreter.twin(), p)), "{name}: twin at {p}");
                let expected = [w, g.x, g.y, g.z];
                assert!((0..4).all(|k| same(all[k][i], expected[k])), "{name}: ∇ω at {p}");
                let (w, g) = interpreter.omega_grad_f32(q);
                assert!(same(omega32[i].into(), interpreter.omega_f32(q).into()), "{name}: ω at {q}");
                let expected = [w, g.x, g.y, g.z];
                assert!(
                    (0..4).all(|k| same(all32[k][i].into(), expected[k].into())),
                    "{name}: ∇ω at {q} in f32"
                );
            }
        }
    }
}
