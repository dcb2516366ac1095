//! Every program of a solid: the time per point, and the distance of the results from the truth.

use std::hint::black_box;
use std::time::{Duration, Instant};

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::super::failure::Failure;
use super::points::SamplePoints;
use super::table::{Column, scientific};
use rfm::codegen::Form;
use rfm::geom::Aabb;
use rfm::ir::exact::{self, Exact};
use rfm::ir::{self, Arithmetic, ErrorAnalysis, FloatType, Graph, Inputs, Node};
use rfm::solid::{Lane, ProgramKind};
use rfm::{Engine, Precision, Program, Solid};

/// A point nearer to the surface than this many rounding errors of its coordinates has no sign to compare.
const ROUNDING: f64 = 8.0;

/// Timed repetitions, of which the median counts.
const REPETITIONS: usize = 25;

/// After this time a program is not timed again.
const LONG: Duration = Duration::from_secs(1);

/// The points of the first try, which shows whether a program is slow.
const FEW: usize = 16;

/// The speed and the errors of one program, a row of the report.
#[derive(Debug, Clone, Serialize)]
pub(super) struct ProgramFigures {
    pub program: &'static str,
    pub precision: &'static str,
    pub engine: &'static str,
    pub form: &'static str,
    /// `one` point at a time, or `many`.
    pub shape: &'static str,
    pub ns_per_point: f64,
    /// The largest error over random points of the box.
    pub max_abs_error: Option<f64>,
    /// The largest relative error over random points of the box.
    pub max_rel_error: Option<f64>,
    /// The certified bound of the error of ω in the box, for coordinates of the row's precision.
    pub certified_error: Option<f64>,
    /// The number of wrong signs at random points and points on the surface.
    pub sign_mismatches: Option<usize>,
    /// The largest displacement |error of ω|/|∇ω| of the surface, in metres.
    pub max_distance_error: Option<f64>,
}

/// What the table of programs holds.
pub(super) const COLUMNS: [Column; 11] = [
    Column::words("program", 9),
    Column::words("prec", 5),
    Column::words("engine", 7),
    Column::words("form", 9),
    Column::words("shape", 5),
    Column::numbers("ns/point", 9),
    Column::numbers("abs error", 10),
    Column::numbers("certified", 10),
    Column::numbers("rel error", 10),
    Column::numbers("signs", 6),
    Column::numbers("surface, m", 11),
];

impl ProgramFigures {
    /// The cells of [`COLUMNS`].
    pub fn cells(&self) -> Vec<String> {
        vec![
            self.program.to_string(),
            self.precision.to_string(),
            self.engine.to_string(),
            self.form.to_string(),
            self.shape.to_string(),
            format!("{:.2}", self.ns_per_point),
            scientific(self.max_abs_error),
            scientific(self.certified_error),
            scientific(self.max_rel_error),
            self.sign_mismatches.map_or("–".to_string(), |n| n.to_string()),
            scientific(self.max_distance_error),
        ]
    }
}

/// The forms that are compared.
const FORMS: [(&str, Form); 4] = [
    ("stable", Form::Stable),
    ("guarded", Form::Guarded),
    ("textbook", Form::Textbook),
    ("scaled", Form::Scaled),
];

/// The solid in every form and on every engine, with the names of these variants.
pub(super) fn variants(program: &Program, solid: &Solid) -> Result<Vec<(&'static str, Solid)>, Failure> {
    let node = program.module().solids.iter().find(|s| s.name == solid.name()).map(|s| s.node);
    let Some(node) = node else { return Err(Failure::usage("the solid has no definition of its own")) };
    let graph = &program.module().graph;
    if graph.has_lookups(&[node]) {
        let name = solid.name();
        return Err(Failure::usage(format!(
            "the errors of `{name}` cannot be measured: a part of it is no formula but a mesh or a map from a file"
        )));
    }
    let make =
        |engine, form| Solid::with_form(solid.name(), graph, node, engine, form).map_err(Failure::usage);
    let mut all = Vec::new();
    for (name, form) in FORMS {
        all.push((name, make(Engine::Jit, form)?));
    }
    all.push(("interp", make(Engine::Interpreter, Form::Stable)?));
    Ok(all)
}

/// Exact ω and ∇ω at the points of both precisions. `None` where there is no exact value.
pub(super) struct ExactValues {
    pub double: Vec<Option<[Exact; 4]>>,
    pub single: Vec<Option<[Exact; 4]>>,
}

impl ExactValues {
    /// `done` is called after every point.
    pub fn at(solid: &Solid, points: &SamplePoints, done: &(dyn Fn() + Sync)) -> Self {
        let (graph, outputs) = if solid.moves() {
            // only the formula depends on the time, programs do not
            let (formula, root) = solid.formula();
            let mut graph = formula.clone();
            let [x, y, z] = ir::gradient(&mut graph, root);
            (graph, vec![root, x, y, z])
        } else {
            let (graph, outputs) = solid.graph(ProgramKind::Gradient);
            (graph.clone(), outputs.to_vec())
        };
        let all = |precision: Precision| {
            let points: Vec<DVec3> = points.judged(precision).collect();
            let exact = |p: DVec3| {
                let found = truth(&graph, &outputs, p, solid.time());
                done();
                found
            };
            points.into_par_iter().map(exact).collect()
        };
        Self { double: all(Precision::F64), single: all(Precision::F32) }
    }
}

fn truth(graph: &Graph, outputs: &[Node], p: DVec3, time: f64) -> Option<[Exact; 4]> {
    exact::evaluate_at(graph, outputs, p.to_array(), time)?.try_into().ok()
}

/// One solid in one form, on one engine and in one precision.
struct Variant<'a> {
    solid: &'a Solid,
    precision: Precision,
    engine: &'static str,
    form: &'static str,
}

/// The figures of all programs of one solid in one precision. `name` is that of [`variants`], and `truth` is
/// for the judged points of the precision.
pub(super) fn measure<T: Lane>(
    solid: &Solid,
    name: &'static str,
    points: &SamplePoints,
    truth: &[Option<[Exact; 4]>],
) -> Vec<ProgramFigures> {
    let (engine, form) = if name == "interp" { ("interp", "stable") } else { ("jit", name) };
    let variant = Variant { solid, precision: T::PRECISION, engine, form };
    let certified = certified::<T>(solid, points.over);
    let errors = ErrorsOfAll::find::<T>(solid, points, truth);
    let mut rows = variant.many::<T>(points, &errors);
    if T::PRECISION == Precision::F64 && engine == "jit" {
        rows.extend(variant.one(points, &errors));
    }
    for row in rows.iter_mut().filter(|row| row.program == "value") {
        row.certified_error = certified;
    }
    rows
}

/// The errors of a solid's programs.
struct ErrorsOfAll {
    value: Errors,
    gradient: Errors,
    sign: Errors,
}

impl ErrorsOfAll {
    fn find<T: Lane>(solid: &Solid, points: &SamplePoints, truth: &[Option<[Exact; 4]>]) -> Self {
        let judged: Vec<DVec3> = points.judged(T::PRECISION).collect();
        let surface_from = points.random_judged;
        let at = PointColumns::<T>::of(judged.iter().copied());
        let mut omega = vec![T::default(); judged.len()];
        solid.omega_many(at.get(), &mut omega);
        let value = Errors::of_values(&omega, truth, &judged, surface_from);
        let mut gradient: [Vec<T>; 4] = std::array::from_fn(|_| vec![T::default(); judged.len()]);
        solid.omega_grad_many(at.get(), gradient.each_mut().map(|c| &mut c[..]));
        let gradient = Errors::of_gradients(&gradient, truth, &judged, surface_from);
        let mut twin = vec![T::default(); judged.len()];
        solid.twin_many(at.get(), &mut twin);
        let sign = Errors { signs: Some(sign_mismatches(&twin, truth, &judged)), ..Errors::default() };
        Self { value, gradient, sign }
    }
}

impl Variant<'_> {
    /// Programs that take many points at a time.
    fn many<T: Lane>(&self, points: &SamplePoints, errors: &ErrorsOfAll) -> Vec<ProgramFigures> {
        let solid = self.solid;
        let columns = PointColumns::<T>::of(points.random.iter().copied());
        let n = points.random.len();
        let mut out: [Vec<T>; 5] = std::array::from_fn(|_| vec![T::default(); n]);
        let ns = |f: &mut dyn FnMut(usize)| median_ns(n, f);
        let value = ns(&mut |n| solid.omega_many(columns.first(n), black_box(&mut out[0][..n])));
        let gradient = ns(&mut |n| {
            let [omega, x, y, z, _] = out.each_mut().map(|c| &mut c[..n]);
            solid.omega_grad_many(columns.first(n), black_box([omega, x, y, z]));
        });
        let mut rows = vec![
            self.figures("value", "many", value, errors.value),
            self.figures("gradient", "many", gradient, errors.gradient),
        ];
        if self.form == "stable" {
            let sign = ns(&mut |n| solid.twin_many(columns.first(n), black_box(&mut out[0][..n])));
            rows.push(self.figures("sign", "many", sign, errors.sign));
            let contact = ns(&mut |n| {
                solid.contact_many(columns.first(n), black_box(out.each_mut().map(|c| &mut c[..n])));
            });
            rows.push(self.figures("contact", "many", contact, Errors::default()));
        }
        rows
    }

    /// Programs that take one point at a time, which exist in `f64`.
    fn one(&self, points: &SamplePoints, errors: &ErrorsOfAll) -> [ProgramFigures; 2] {
        let n = points.random.len();
        let value = median_ns(n, &mut |n| {
            for &p in &points.random[..n] {
                black_box(self.solid.omega(black_box(p)));
            }
        });
        let gradient = median_ns(n, &mut |n| {
            for &p in &points.random[..n] {
                black_box(self.solid.omega_grad(black_box(p)));
            }
        });
        [
            self.figures("value", "one", value, errors.value),
            self.figures("gradient", "one", gradient, errors.gradient),
        ]
    }

    fn figures(&self, program: &'static str, shape: &'static str, ns: f64, errors: Errors) -> ProgramFigures {
        ProgramFigures {
            program,
            precision: self.precision.name(),
            engine: self.engine,
            form: if program == "sign" { "twin" } else { self.form },
            shape,
            ns_per_point: ns,
            max_abs_error: errors.absolute,
            max_rel_error: errors.relative,
            certified_error: None,
            sign_mismatches: errors.signs,
            max_distance_error: errors.distance,
        }
    }
}

/// The certified bound of a program over the box. The box is grown by the rounding of its points to the type.
fn certified<T: Lane>(solid: &Solid, over: Aabb) -> Option<f64> {
    let forms = solid.forms(ProgramKind::Value, T::PRECISION);
    let (graph, root) = solid.formula();
    let margin = 2.0 * FloatType::of(T::PRECISION).unit * over.min.abs().max(over.max.abs()).max_element();
    let arithmetic = Arithmetic { precision: T::PRECISION, forms, inputs: Inputs::Exact };
    let bound = ErrorAnalysis::new(graph, root, arithmetic).certify(&over.grown(margin), 0.0);
    bound.is_finite().then_some(bound)
}

/// The figures of ranges, for small boxes around the points. A point whose ω is not in the range counts as a
/// wrong sign.
pub(super) fn range_row(solid: &Solid, points: &SamplePoints) -> ProgramFigures {
    let half = 0.02 * points.over.size();
    let boxes: Vec<Aabb> = points.random.iter().map(|&p| Aabb::new(p - half, p + half)).collect();
    let ns = median_ns(boxes.len(), &mut |n| {
        for over in &boxes[..n] {
            black_box(solid.range(black_box(over)));
        }
    });
    let violations = std::iter::zip(&points.random, &boxes)
        .take(points.random_judged)
        .filter(|(p, over)| !solid.range(over).contains(solid.omega(**p)))
        .count();
    ProgramFigures {
        program: "range",
        precision: "f64",
        engine: if solid.is_compiled() { "jit" } else { "interp" },
        form: "stable",
        shape: "one",
        ns_per_point: ns,
        max_abs_error: None,
        max_rel_error: None,
        certified_error: None,
        sign_mismatches: Some(violations),
        max_distance_error: None,
    }
}

struct PointColumns<T>([Vec<T>; 3]);

impl<T: Lane> PointColumns<T> {
    fn of(points: impl Iterator<Item = DVec3>) -> Self {
        let mut columns: [Vec<T>; 3] = std::array::from_fn(|_| Vec::new());
        for p in points {
            for (column, x) in columns.iter_mut().zip(p.to_array()) {
                column.push(T::from_f64(x));
            }
        }
        Self(columns)
    }

    fn get(&self) -> [&[T]; 3] {
        self.first(self.0[0].len())
    }

    /// The first `count` points.
    fn first(&self, count: usize) -> [&[T]; 3] {
        self.0.each_ref().map(|c| &c[..count])
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Errors {
    absolute: Option<f64>,
    relative: Option<f64>,
    signs: Option<usize>,
    distance: Option<f64>,
}

impl Errors {
    fn of_values<T: Lane>(
        found: &[T],
        truth: &[Option<[Exact; 4]>],
        at: &[DVec3],
        surface_from: usize,
    ) -> Self {
        let (mut absolute, mut relative, mut distance) = (0f64, 0f64, 0f64);
        for (i, (found, truth)) in std::iter::zip(found, truth).enumerate() {
            let Some(truth) = truth else { continue };
            let error = truth[0].error_of(found.to_f64());
            if i < surface_from {
                absolute = absolute.max(error);
                relative = relative.max(error / truth[0].to_f64().abs());
            } else {
                distance = distance.max(error / slope(truth));
            }
        }
        let signs = Some(sign_mismatches(found, truth, at));
        Self { absolute: Some(absolute), relative: Some(relative), signs, distance: Some(distance) }
    }

    fn of_gradients<T: Lane>(
        found: &[Vec<T>; 4],
        truth: &[Option<[Exact; 4]>],
        at: &[DVec3],
        surface_from: usize,
    ) -> Self {
        let (mut absolute, mut relative) = (0f64, 0f64);
        for (i, truth) in truth.iter().enumerate().take(surface_from) {
            let Some(truth) = truth else { continue };
            let errors: [f64; 3] =
                std::array::from_fn(|axis| truth[axis + 1].error_of(found[axis + 1][i].to_f64()));
            let error = DVec3::from_array(errors).length();
            absolute = absolute.max(error);
            relative = relative.max(error / slope(truth));
        }
        let signs = Some(sign_mismatches(&found[0], truth, at));
        Self { absolute: Some(absolute), relative: Some(relative), signs, distance: None }
    }
}

fn slope(truth: &[Exact; 4]) -> f64 {
    DVec3::new(truth[1].to_f64(), truth[2].to_f64(), truth[3].to_f64()).length()
}

/// The number of wrong signs among the points that are farther from the surface than the rounding of
/// their coordinates.
fn sign_mismatches<T: Lane>(found: &[T], truth: &[Option<[Exact; 4]>], at: &[DVec3]) -> usize {
    let epsilon = match T::PRECISION {
        Precision::F32 => f64::from(f32::EPSILON),
        Precision::F64 => f64::EPSILON,
    };
    let sign = |x: f64| f64::from(i8::from(x > 0.0) - i8::from(x < 0.0));
    let wrong = |i: &usize| {
        truth[*i].as_ref().is_some_and(|t| {
            let resolvable = t[0].to_f64().abs() > ROUNDING * epsilon * at[*i].abs().max_element() * slope(t);
            resolvable && sign(found[*i].to_f64()) != t[0].sign()
        })
    };
    (0..found.len()).filter(wrong).count()
}

/// The median time in nanoseconds per point over many repetitions, after one that does not count. `work`
/// takes the number of points. A slow program is timed on fewer points and less often, so that no time costs
/// much more than a second.
fn median_ns(points: usize, work: &mut dyn FnMut(usize)) -> f64 {
    let started = Instant::now();
    let mut count = FEW.min(points);
    loop {
        work(count);
        if count == points || started.elapsed() > LONG / 8 {
            break;
        }
        count = (4 * count).min(points);
    }
    let mut times: Vec<f64> = Vec::new();
    while times.len() < REPETITIONS && (times.is_empty() || started.elapsed() < LONG) {
        let before = Instant::now();
        work(count);
        times.push(before.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    times[times.len() / 2] * 1e9 / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_program_is_timed_on_few_points() {
        let started = Instant::now();
        let mut most = 0;
        let ns = median_ns(4096, &mut |n| {
            most = most.max(n);
            std::thread::sleep(Duration::from_millis(4) * n as u32);
        });
        assert!(started.elapsed() < Duration::from_secs(4), "{:?}", started.elapsed());
        assert!(most < 200 && (4e6..8e6).contains(&ns), "{most} {ns}");
        let mut all = 0;
        median_ns(4096, &mut |n| all = n);
        assert_eq!(all, 4096);
    }
}
