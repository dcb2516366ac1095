//! Hard cases with exactly known answers, through every program: machine code and interpreter, double and
//! single precision, one point and many, value, gradient, sign, range and contact.
//!
//! The expected numbers come from closed forms or 40-digit arithmetic. Tolerances are in units of the last
//! place (ulp) of the scale that a case names. Paths through thin and grazed walls are tested in `sweep`,
//! folds of a thousand operands in `numbers`.

mod extremes;
mod logic;
mod obstacles;
mod wall;

use rfm::geom::Aabb;
use rfm::glam::{DVec3, Vec3};
use rfm::{Engine, Field, Solid};

use crate::numbers::solid;

/// One row of a table: a solid, a point and what is known there.
struct Case {
    /// The case of the list to which it belongs.
    row: u32,
    expression: &'static str,
    at: [f64; 3],
    omega: f64,
    /// ∇ω, or `None` if it is not known.
    gradient: Option<[f64; 3]>,
    /// Size of the numbers that ω is made of, at least |ω|. One ulp of it is the unit of the tolerance, which
    /// is four units (six for gradients).
    scale: f64,
    /// Whether single precision holds the point exactly and no intermediate result leaves its range.
    single: bool,
}

/// A case whose operands are the coordinates themselves, so it is exact in every precision.
const fn case(row: u32, expression: &'static str, at: [f64; 3], omega: f64) -> Case {
    Case { row, expression, at, omega, gradient: None, scale: 0.0, single: true }
}

impl Case {
    const fn gradient(self, gradient: [f64; 3]) -> Self {
        Self { gradient: Some(gradient), ..self }
    }

    const fn scale(self, scale: f64) -> Self {
        Self { scale, ..self }
    }

    /// A case that is not meant for single precision.
    const fn double_only(self) -> Self {
        Self { single: false, ..self }
    }
}

fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

#[track_caller]
fn check_all(cases: &[Case]) {
    for case in cases {
        for solid in solid(case.expression) {
            check(case, &solid);
        }
    }
}

#[track_caller]
fn check(case: &Case, solid: &Solid) {
    let p = DVec3::from_array(case.at);
    let what = format!("row {}, `{}` at {p}, {solid:?}", case.row, case.expression);
    let scale = case.scale.max(case.omega.abs());
    let near = |found: f64, expected: f64, tolerance: f64| (found - expected).abs() <= tolerance;

    let omega = solid.omega(p);
    assert!(near(omega, case.omega, 4.0 * f64::EPSILON * scale), "{what}: {omega:?}, not {:?}", case.omega);
    let (same, gradient) = solid.omega_grad(p);
    assert_eq!(same, omega, "{what}"); // the sign of a zero may differ
    if let Some(expected) = case.gradient.map(DVec3::from_array) {
        let tolerance = 6.0 * f64::EPSILON * expected.abs().max_element().max(case.scale);
        let close = (0..3).all(|i| near(gradient[i], expected[i], tolerance));
        assert!(close, "{what}: gradient {gradient}, not {expected}");
    }
    assert!(gradient.is_finite(), "{what}: gradient {gradient}");
    batches(solid, p, omega, gradient, &what);

    // the sign is that of ω in every program, in the range of the point and in those of boxes around it
    assert_eq!(solid.sign(p), sign(omega), "{what}");
    assert_eq!(sign(Field::omega(&solid.twin(), p)), sign(omega), "{what}");
    for size in [0.0, 1e-9, 0.5] {
        let over = Aabb::new(p - size, p + size);
        let (range, twin) = (solid.range(&over), solid.twin().range(&over));
        assert!(range.contains(omega) && range.contains(case.omega), "{what}: {range:?}");
        assert!(twin.contains(Field::omega(&solid.twin(), p)), "{what}: {twin:?}");
    }
    let contact = solid.contact(p);
    assert!(contact.distance.is_finite() && contact.normal.is_finite(), "{what}: {contact:?}");
    if omega != 0.0 {
        // the distance is negative inside
        assert!(contact.distance == 0.0 || sign(contact.distance) == -sign(omega), "{what}: {contact:?}");
    }
    if case.single {
        let (q, epsilon) = (p.as_vec3(), f64::from(f32::EPSILON));
        let (omega, gradient) = solid.omega_grad_f32(q);
        assert!(near(omega.into(), case.omega, 4.0 * epsilon * scale), "{what}, in f32: {omega:?}");
        assert_eq!(solid.omega_f32(q), omega, "{what}");
        assert_eq!(sign(omega.into()), sign(case.omega), "{what}, in f32: {omega:?}");
        assert!(Vec3::is_finite(gradient), "{what}, in f32: {gradient}");
        batches(solid, q, omega, gradient, &what);
    }
}

/// One precision, for what both have in common.
trait Point: Copy {
    type Number: rfm::solid::Lane + PartialEq;
    fn number(self, axis: usize) -> Self::Number;
}

impl Point for DVec3 {
    type Number = f64;
    fn number(self, axis: usize) -> f64 {
        self[axis]
    }
}

impl Point for Vec3 {
    type Number = f32;
    fn number(self, axis: usize) -> f32 {
        self[axis]
    }
}

/// Many points give what one gives, whichever place in a block it has.
#[track_caller]
fn batches<P: Point>(solid: &Solid, p: P, omega: P::Number, gradient: P, what: &str) {
    let columns = [0, 1, 2].map(|axis| vec![p.number(axis); 7]);
    let points = columns.each_ref().map(|c| &c[..]);
    let mut many = vec![P::Number::default(); 7];
    solid.omega_many(points, &mut many);
    assert!(many.iter().all(|&w| w == omega), "{what}: many points");
    let mut out: [Vec<P::Number>; 4] = std::array::from_fn(|_| vec![P::Number::default(); 7]);
    solid.omega_grad_many(points, out.each_mut().map(|c| &mut c[..]));
    let expected = [omega, gradient.number(0), gradient.number(1), gradient.number(2)];
    for (column, expected) in out.iter().zip(expected) {
        assert!(column.iter().all(|&w| w == expected), "{what}: many gradients");
    }
}

/// A solid of the examples, compiled and interpreted.
fn example(name: &str) -> [Solid; 2] {
    let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
    let program = rfm::Program::from_path(path).unwrap_or_else(|e| panic!("{e}"));
    [Engine::Jit, Engine::Interpreter].map(|engine| program.solid_with(name, engine).unwrap())
}
