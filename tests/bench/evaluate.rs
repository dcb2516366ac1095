//! How fast ω and ∇ω are answered, and how exactly: `cargo bench --bench evaluate`.
//!
//! One thread, 4096 random points in [0, 3]³, and the median of many passes over them. All ways take turns in
//! one run, so that a busy machine slows every row alike. Errors are against the interpreter in f64 at the
//! same points; `tests/it/agreement.rs` compares that interpreter with 40-digit arithmetic.
//!
//! The hand-written rows are what a person would type: the paper's formulas with u + v ∓ √(u² + v²), compiled
//! by rustc for the 128-bit vectors that Cargo uses by default.

use std::hint::black_box;
use std::time::{Duration, Instant};

use rfm::glam::{DVec3, Vec3};
use rfm::solid::Lane;
use rfm::{Engine, Program, Solid};

const POINTS: usize = 4096;
/// Passes over all rows; the median of their times is printed.
const ROUNDS: usize = 41;
/// A pass is repeated within a round until it has taken this long.
const SLICE: Duration = Duration::from_millis(2);

type Columns<T> = [Vec<T>; 3];
type Output<T> = [Vec<T>; 4];

/// One way to evaluate one obstacle.
struct Row<'a> {
    obstacle: &'static str,
    way: String,
    /// Evaluates all points once.
    pass: Box<dyn FnMut() + 'a>,
    /// ω, or ω and ∇ω, of all points.
    answers: Box<dyn FnMut() -> Vec<f64> + 'a>,
    /// What the answers should be, by the interpreter.
    truth: Vec<f64>,
    nanoseconds: Vec<f64>,
}

fn main() {
    let solids = ["cube", "pawn", "bishop"].map(|name| (name, compile(name)));
    let double = points();
    let single: Columns<f32> = double.each_ref().map(|column| column.iter().map(|&c| c as f32).collect());
    for gradient in [false, true] {
        let mut rows = Vec::new();
        for (name, [jit, interpreter]) in &solids {
            solid_rows(&mut rows, name, jit, interpreter, &double, gradient);
            solid_rows(&mut rows, name, jit, interpreter, &single, gradient);
            if *name == "pawn" {
                rows.push(by_hand(interpreter, &double, gradient));
                rows.push(by_hand(interpreter, &single, gradient));
            }
        }
        measure(&mut rows);
        print(&mut rows, if gradient { "ω and ∇ω" } else { "ω" });
    }
}

fn compile(name: &str) -> [Solid; 2] {
    let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
    let program = Program::from_path(path).unwrap_or_else(|e| panic!("{e}"));
    [Engine::Jit, Engine::Interpreter]
        .map(|engine| program.solid_with(name, engine).unwrap_or_else(|e| panic!("{e}")))
}

/// Points that f32 holds exactly, so that both precisions are asked the same question.
fn points() -> Columns<f64> {
    let mut seed = 1u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from((3.0 * (seed >> 11) as f64 / (1u64 << 53) as f64) as f32)
    };
    std::array::from_fn(|_| (0..POINTS).map(|_| random()).collect())
}

/// Hides the two precisions of programs, f32 and f64, behind one interface.
trait Precision: Lane + Into<f64> + 'static {
    const NAME: &'static str;
    fn omega(solid: &Solid, p: [Self; 3]) -> Self;
    fn omega_grad(solid: &Solid, p: [Self; 3]) -> [Self; 4];
    fn pawn(p: [Self; 3]) -> Self;
    fn pawn_grad(p: [Self; 3]) -> [Self; 4];
}

fn solid_rows<'a, T: Precision>(
    rows: &mut Vec<Row<'a>>,
    name: &'static str,
    jit: &'a Solid,
    interpreter: &'a Solid,
    points: &'a Columns<T>,
    gradient: bool,
) {
    let truth = truth(interpreter, points, gradient);
    for (engine, solid) in [("jit", jit), ("interpreter", interpreter)] {
        let mut row = |shape: &str, pass: Pass<'a, T>, again: Pass<'a, T>| {
            rows.push(new_row(
                name,
                format!("{engine}, {shape}, {}", T::NAME),
                pass,
                again,
                &truth,
                gradient,
            ));
        };
        if gradient {
            let one = move |p| T::omega_grad(solid, p);
            row("batch", batch_grad(solid, points), batch_grad(solid, points));
            row("one point", each(points, one), each(points, one));
        } else {
            let one = move |p| [T::omega(solid, p), T::default(), T::default(), T::default()];
            row("batch", batch(solid, points), batch(solid, points));
            row("one point", each_value(points, one), each_value(points, one));
        }
    }
    if !gradient {
        rows.push(sign(name, jit, points, &truth));
    }
}

/// The min/max twin, of which only the sign means something: its error is 0 if no sign is wrong, otherwise 1
/// or 2.
fn sign<'a, T: Precision>(
    name: &'static str,
    solid: &'a Solid,
    points: &'a Columns<T>,
    truth: &[f64],
) -> Row<'a> {
    let twin = move |out: &mut [T]| solid.twin_many(points.each_ref().map(|c| &c[..]), out);
    let mut out = vec![T::default(); POINTS];
    Row {
        obstacle: name,
        way: format!("jit, batch, {}, sign alone", T::NAME),
        pass: Box::new(move || {
            twin(&mut out);
            black_box(&mut out);
        }),
        answers: Box::new(move || {
            let mut out = vec![T::default(); POINTS];
            twin(&mut out);
            out.iter().map(|&w| w.into().signum()).collect()
        }),
        truth: truth.iter().map(|w| w.signum()).collect(),
        nanoseconds: Vec::new(),
    }
}

fn by_hand<'a, T: Precision>(interpreter: &'a Solid, points: &'a Columns<T>, gradient: bool) -> Row<'a> {
    let truth = truth(interpreter, points, gradient);
    let way = format!("hand-written textbook loop, {}", T::NAME);
    let pass: fn(&'a Columns<T>) -> Pass<'a, T> = if gradient {
        |points| each(points, T::pawn_grad)
    } else {
        |points| each_value(points, |p| [T::pawn(p), T::default(), T::default(), T::default()])
    };
    new_row("pawn", way, pass(points), pass(points), &truth, gradient)
}

/// Fills the output columns with the answers for all points.
type Pass<'a, T> = Box<dyn FnMut(&mut Output<T>) + 'a>;

fn batch<'a, T: Lane>(solid: &'a Solid, points: &'a Columns<T>) -> Pass<'a, T> {
    Box::new(move |out| solid.omega_many(points.each_ref().map(|c| &c[..]), &mut out[0]))
}

fn batch_grad<'a, T: Lane>(solid: &'a Solid, points: &'a Columns<T>) -> Pass<'a, T> {
    Box::new(move |out| {
        solid.omega_grad_many(points.each_ref().map(|c| &c[..]), out.each_mut().map(|c| &mut c[..]));
    })
}

fn each_value<'a, T: Lane>(points: &'a Columns<T>, one: impl Fn([T; 3]) -> [T; 4] + 'a) -> Pass<'a, T> {
    Box::new(move |[omega, ..]| {
        let [x, y, z] = points.each_ref().map(|c| &c[..POINTS]);
        let omega = &mut omega[..POINTS];
        for i in 0..POINTS {
            [omega[i], ..] = one([x[i], y[i], z[i]]);
        }
    })
}

fn each<'a, T: Lane>(points: &'a Columns<T>, one: impl Fn([T; 3]) -> [T; 4] + 'a) -> Pass<'a, T> {
    Box::new(move |out| {
        let [x, y, z] = points.each_ref().map(|c| &c[..POINTS]);
        let [w, gx, gy, gz] = out.each_mut().map(|c| &mut c[..POINTS]);
        for i in 0..POINTS {
            [w[i], gx[i], gy[i], gz[i]] = one([x[i], y[i], z[i]]);
        }
    })
}

fn new_row<'a, T: Precision>(
    obstacle: &'static str,
    way: String,
    mut pass: Pass<'a, T>,
    mut again: Pass<'a, T>,
    truth: &[f64],
    gradient: bool,
) -> Row<'a> {
    let outputs = || std::array::from_fn(|_| vec![T::default(); POINTS]);
    let mut out: Output<T> = outputs();
    Row {
        obstacle,
        way,
        pass: Box::new(move || {
            pass(&mut out);
            black_box(&mut out);
        }),
        answers: Box::new(move || {
            let mut out: Output<T> = outputs();
            again(&mut out);
            let columns = if gradient { &out[..] } else { &out[..1] };
            columns.iter().flatten().map(|&v| v.into()).collect()
        }),
        truth: truth.to_vec(),
        nanoseconds: Vec::new(),
    }
}

fn truth<T: Precision>(interpreter: &Solid, points: &Columns<T>, gradient: bool) -> Vec<f64> {
    let at = |i: usize| DVec3::from_array(points.each_ref().map(|c| c[i].into()));
    let mut columns: [Vec<f64>; 4] = Default::default();
    for i in 0..POINTS {
        let (w, g) = interpreter.omega_grad(at(i));
        for (column, value) in columns.iter_mut().zip([w, g.x, g.y, g.z]) {
            column.push(value);
        }
    }
    columns.into_iter().take(if gradient { 4 } else { 1 }).flatten().collect()
}

fn measure(rows: &mut [Row<'_>]) {
    for _ in 0..ROUNDS {
        for row in &mut *rows {
            (row.pass)(); // compiles, warms caches
            let (started, mut passes) = (Instant::now(), 0);
            while started.elapsed() < SLICE {
                (row.pass)();
                passes += 1;
            }
            row.nanoseconds.push(started.elapsed().as_secs_f64() * 1e9 / f64::from(passes * POINTS as u32));
        }
    }
}

fn print(rows: &mut [Row<'_>], what: &str) {
    println!("\n{what}, {POINTS} points in [0, 3]³, one thread, median of {ROUNDS}\n");
    println!("| obstacle | by | ns per point | max. error | relative to the largest value |");
    println!("|---|---|--:|--:|--:|");
    for row in rows {
        let mut times = row.nanoseconds.clone();
        times.sort_unstable_by(f64::total_cmp);
        let error = row.error();
        println!(
            "| {} | {} | {:.2} | {:.1e} | {:.1e} |",
            row.obstacle,
            row.way,
            times[times.len() / 2],
            error[0],
            error[1]
        );
    }
}

impl Row<'_> {
    /// The largest absolute error, and the same as a fraction of the largest value.
    fn error(&mut self) -> [f64; 2] {
        let answers = (self.answers)();
        let largest = self.truth.iter().fold(0.0, |most: f64, t| most.max(t.abs()));
        let error = answers.iter().zip(&self.truth).map(|(a, t)| (a - t).abs()).fold(0.0, f64::max);
        [error, error / largest]
    }
}

macro_rules! precision {
    ($t:ident, $omega:ident, $omega_grad:ident, $vector:ty) => {
        impl Precision for $t {
            const NAME: &'static str = stringify!($t);

            fn omega(solid: &Solid, p: [$t; 3]) -> $t {
                solid.$omega(<$vector>::from_array(p))
            }

            fn omega_grad(solid: &Solid, p: [$t; 3]) -> [$t; 4] {
                let (w, g) = solid.$omega_grad(<$vector>::from_array(p));
                [w, g.x, g.y, g.z]
            }

            #[inline(always)]
            fn pawn([x, y, z]: [$t; 3]) -> $t {
                let r2 = (x - 1.5) * (x - 1.5) + (y - 1.5) * (y - 1.5);
                let (cylinder, layer) = (0.25 - r2, z * (1.0 - z));
                let waist = 1.0 + 10.0 * (z - 0.75) * (z - 0.75) - 20.0 * r2;
                let collar = 0.125 - r2 - 20.0 * (1.0 - z) * (1.0 - z);
                let head = 0.05 - r2 - (1.25 - z) * (1.25 - z);
                let post = cylinder + layer - (cylinder * cylinder + layer * layer).sqrt();
                let body = post + waist - (post * post + waist * waist).sqrt();
                let top = collar + head + (collar * collar + head * head).sqrt();
                body + top + (body * body + top * top).sqrt()
            }

            /// By the chain rule from the root down. It is 0/0 at edges and corners, as every textbook form
            /// is.
            #[inline(always)]
            fn pawn_grad([x, y, z]: [$t; 3]) -> [$t; 4] {
                let (u, v) = (x - 1.5, y - 1.5);
                let r2 = u * u + v * v;
                let (cylinder, layer) = (0.25 - r2, z * (1.0 - z));
                let waist = 1.0 + 10.0 * (z - 0.75) * (z - 0.75) - 20.0 * r2;
                let collar = 0.125 - r2 - 20.0 * (1.0 - z) * (1.0 - z);
                let head = 0.05 - r2 - (1.25 - z) * (1.25 - z);
                let h_post = (cylinder * cylinder + layer * layer).sqrt();
                let post = cylinder + layer - h_post;
                let h_body = (post * post + waist * waist).sqrt();
                let body = post + waist - h_body;
                let h_top = (collar * collar + head * head).sqrt();
                let top = collar + head + h_top;
                let h = (body * body + top * top).sqrt();
                // ∂ω/∂ of each intermediate value
                let (d_body, d_top) = (1.0 + body / h, 1.0 + top / h);
                let (d_collar, d_head) = (d_top * (1.0 + collar / h_top), d_top * (1.0 + head / h_top));
                let (d_post, d_waist) = (d_body * (1.0 - post / h_body), d_body * (1.0 - waist / h_body));
                let (d_cylinder, d_layer) =
                    (d_post * (1.0 - cylinder / h_post), d_post * (1.0 - layer / h_post));
                let d_r2 = -(d_cylinder + 20.0 * d_waist + d_collar + d_head);
                let dz = d_layer * (1.0 - 2.0 * z)
                    + d_waist * 20.0 * (z - 0.75)
                    + d_collar * 40.0 * (1.0 - z)
                    + d_head * 2.0 * (1.25 - z);
                [body + top + h, d_r2 * 2.0 * u, d_r2 * 2.0 * v, dz]
            }
        }
    };
}

precision!(f64, omega, omega_grad, DVec3);
precision!(f32, omega_f32, omega_grad_f32, Vec3);
