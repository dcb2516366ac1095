//! `rfm report`: speed against error, for every program of a solid that there is, or for a flow that is known.
//!
//! Errors are measured against 120-digit arithmetic at random points of the box and at points on the surface;
//! times are medians over batches of random points on one thread. Then the meshes: error and time of each method against
//! the number of cells, with the order of convergence that they show. A scene is run at several resolutions instead
//! ([`flows`]).

mod flow_plot;
mod flows;
mod meshes;
mod plot;
mod points;

use std::hint::black_box;
use std::time::Instant;

use anstream::println;
use glam::DVec3;
use serde::Serialize;

use super::args::{Report, Shared};
use super::{Failure, choose, input, output, progress};
use crate::codegen::{Form, target_description};
use crate::geom::Aabb;
use crate::ir::exact::{self, Exact};
use crate::ir::{self, Arithmetic, ErrorAnalysis, FloatType, Graph, Inputs, Node};
use crate::lower::Scene;
use crate::solid::{Lane, ProgramKind};
use crate::{Engine, Program, Solid};
use points::Points;

/// Distances from the surface below this many rounding errors of the coordinates decide nothing.
const ROUNDING: f64 = 8.0;

/// Timed repetitions of which the median counts.
const REPETITIONS: usize = 25;

#[derive(Debug, Clone, Serialize)]
struct Row {
    program: &'static str,
    precision: &'static str,
    engine: &'static str,
    form: &'static str,
    /// One point at a time, or many.
    shape: &'static str,
    ns_per_point: f64,
    /// Over random points of the box.
    max_abs_error: Option<f64>,
    max_rel_error: Option<f64>,
    /// What the error of ω is certified not to exceed anywhere in the box, for coordinates of the row's precision.
    certified_error: Option<f64>,
    /// Over random points and points on the surface.
    sign_mismatches: Option<usize>,
    /// How far the surface is displaced: |error of ω|/|∇ω| on it.
    max_distance_error: Option<f64>,
}

#[derive(Serialize)]
struct Document<'a> {
    schema: u32,
    solid: &'a str,
    target: String,
    box_min: [f64; 3],
    box_max: [f64; 3],
    points: usize,
    surface_points: usize,
    rows: &'a [Row],
    meshes: &'a [meshes::Row],
}

pub(super) fn run(shared: &Shared, options: &Report) -> Result<(), Failure> {
    for path in options.output.iter().chain(&options.mesh_plot) {
        output::Picture::of(path)?;
    }
    let (path, name) = choose::subject(&options.subject);
    let program = input::program(shared, path)?;
    if let Some(scene) = scene(&program, name, options)? {
        return flows::run(shared, &program, scene, &options.flow, options.output.as_deref());
    }
    if let Some(name) = name.filter(|name| program.module().solids.iter().all(|s| s.name != *name)) {
        return Err(choose::no_such(path, &program, name));
    }
    let reference = choose::solid(shared, &program, options.solid.as_deref().or(name))?;
    let nowhere = || Failure::usage("the solid has no bounds and the file no scene: nowhere to measure");
    let over = program.domain(&reference).ok_or_else(nowhere)?;
    let bar = progress::bar(4, "measuring");
    let points = Points::choose(&reference, over);
    bar.inc(1);
    let truth = Truth::at(&reference, &points);
    bar.inc(1);
    let solids = variants(&program, &reference)?;
    let mut rows = Vec::new();
    for (form, solid) in &solids {
        rows.extend(measure::<f64>(solid, form, &points, &truth.double));
        bar.inc(1);
        rows.extend(measure::<f32>(solid, form, &points, &truth.single));
    }
    rows.push(range_row(&reference, &points));
    bar.finish_and_clear();
    let meshes = meshes::measure(&reference, options.mesh_cells)?;
    rows.sort_by_key(|row| (row.program, row.shape));
    if let Some(path) = &options.output {
        let picture = plot::draw(reference.name(), &rows, path)?;
        output::write(path, |out| out.write_all(&picture))?;
    }
    if let Some(path) = &options.mesh_plot {
        let picture = meshes::draw(reference.name(), &meshes, path)?;
        output::write(path, |out| out.write_all(&picture))?;
    }
    if shared.json {
        return output::json(&Document {
            schema: 1,
            solid: reference.name(),
            target: target_description(),
            box_min: over.min.to_array(),
            box_max: over.max.to_array(),
            points: points.random.len(),
            surface_points: points.surface.len(),
            rows: &rows,
            meshes: &meshes,
        });
    }
    print(&reference, &points, over, &rows);
    meshes::print(&meshes);
    for path in options.output.iter().chain(&options.mesh_plot) {
        println!("plot written to {}", path.display());
    }
    Ok(())
}

/// The scene that is meant: by its name, by options that only a flow has, or because the file has no solid.
fn scene<'a>(
    program: &'a Program,
    name: Option<&str>,
    options: &Report,
) -> Result<Option<&'a Scene>, Failure> {
    let module = program.module();
    if let Some(name) = name.filter(|name| module.scenes.iter().any(|s| s.name == *name)) {
        if let Some(flag) =
            [("--solid", options.solid.is_some()), ("--mesh-plot", options.mesh_plot.is_some())]
                .into_iter()
                .find_map(|(flag, given)| given.then_some(flag))
        {
            return Err(Failure::usage(format!("{flag} is about solids, and `{name}` is a scene")));
        }
        return choose::scene(program, Some(name)).map(Some);
    }
    let asked = !options.flow.particles.is_empty() || !options.flow.methods.is_empty();
    match name {
        Some(name) if asked => Err(Failure::usage(format!(
            "--particles and --methods are about flows, and the file has no scene `{name}`"
        ))),
        None if asked || module.solids.is_empty() && !module.scenes.is_empty() => {
            choose::scene(program, None).map(Some)
        }
        _ => Ok(None),
    }
}

/// The forms that are compared.
const FORMS: [(&str, Form); 4] = [
    ("stable", Form::Stable),
    ("guarded", Form::Guarded),
    ("textbook", Form::Textbook),
    ("scaled", Form::Scaled),
];

/// The same solid in every form and on every engine.
fn variants(program: &Program, solid: &Solid) -> Result<Vec<(&'static str, Solid)>, Failure> {
    let node = program.module().solids.iter().find(|s| s.name == solid.name()).map(|s| s.node);
    let Some(node) = node else { return Err(Failure::usage("the solid has no definition of its own")) };
    let graph = &program.module().graph;
    let make =
        |engine, form| Solid::with_form(solid.name(), graph, node, engine, form).map_err(Failure::usage);
    let mut all = Vec::new();
    for (name, form) in FORMS {
        all.push((name, make(Engine::Jit, form)?));
    }
    all.push(("interp", make(Engine::Interpreter, Form::Stable)?));
    Ok(all)
}

/// Exact ω and ∇ω at the points of both precisions.
struct Truth {
    double: Vec<Option<[Exact; 4]>>,
    single: Vec<Option<[Exact; 4]>>,
}

impl Truth {
    fn at(solid: &Solid, points: &Points) -> Self {
        let (graph, outputs) = if solid.moves() {
            // programs do not know the time, the formula does
            let (formula, root) = solid.formula();
            let mut graph = formula.clone();
            let [x, y, z] = ir::gradient(&mut graph, root);
            (graph, vec![root, x, y, z])
        } else {
            let (graph, outputs) = solid.graph(ProgramKind::Gradient);
            (graph.clone(), outputs.to_vec())
        };
        let all =
            |single: bool| points.judged(single).map(|p| truth(&graph, &outputs, p, solid.time())).collect();
        Self { double: all(false), single: all(true) }
    }
}

fn truth(graph: &Graph, outputs: &[Node], p: DVec3, time: f64) -> Option<[Exact; 4]> {
    exact::evaluate_at(graph, outputs, p.to_array(), time)?.try_into().ok()
}

/// All rows of one solid in one precision.
fn measure<T: Lane>(
    solid: &Solid,
    variant: &'static str,
    points: &Points,
    truth: &[Option<[Exact; 4]>],
) -> Vec<Row> {
    let single = size_of::<T>() == 4;
    let precision = if single { "f32" } else { "f64" };
    let (engine, form) = if variant == "interp" { ("interp", "stable") } else { ("jit", variant) };
    let judged: Vec<DVec3> = points.judged(single).collect();
    let surface_from = points.random_judged;
    let columns = Columns::<T>::of(points.random.iter().copied());
    let certified = certified::<T>(solid, points.over);
    let row = |program, shape, ns, errors: Errors| Row {
        program,
        precision,
        engine,
        form: if program == "sign" { "twin" } else { form },
        shape,
        ns_per_point: ns,
        max_abs_error: errors.absolute,
        max_rel_error: errors.relative,
        certified_error: if program == "value" { certified } else { None },
        sign_mismatches: errors.signs,
        max_distance_error: errors.distance,
    };

    let at = Columns::<T>::of(judged.iter().copied());
    let mut omega = vec![T::default(); judged.len()];
    solid.omega_many(at.get(), &mut omega);
    let value_errors = Errors::of_values(&omega, truth, &judged, surface_from);
    let mut gradient: [Vec<T>; 4] = std::array::from_fn(|_| vec![T::default(); judged.len()]);
    solid.omega_grad_many(at.get(), gradient.each_mut().map(|c| &mut c[..]));
    let gradient_errors = Errors::of_gradients(&gradient, truth, &judged, surface_from);
    let mut twin = vec![T::default(); judged.len()];
    solid.twin_many(at.get(), &mut twin);
    let sign_errors = Errors { signs: Some(sign_mismatches(&twin, truth, &judged)), ..Errors::default() };

    let n = points.random.len();
    let mut out: [Vec<T>; 4] = std::array::from_fn(|_| vec![T::default(); n]);
    let ns = |f: &mut dyn FnMut()| median_ns(n, f);
    let mut rows = vec![
        row(
            "value",
            "many",
            ns(&mut || solid.omega_many(columns.get(), black_box(&mut out[0]))),
            value_errors,
        ),
        row(
            "gradient",
            "many",
            ns(&mut || solid.omega_grad_many(columns.get(), black_box(out.each_mut().map(|c| &mut c[..])))),
            gradient_errors,
        ),
    ];
    if form == "stable" {
        let time = ns(&mut || solid.twin_many(columns.get(), black_box(&mut out[0])));
        rows.push(row("sign", "many", time, sign_errors));
    }
    if form == "stable" {
        let mut out: [Vec<T>; 5] = std::array::from_fn(|_| vec![T::default(); n]);
        let time =
            ns(&mut || solid.contact_many(columns.get(), black_box(out.each_mut().map(|c| &mut c[..]))));
        rows.push(row("contact", "many", time, Errors::default()));
    }
    if !single && engine == "jit" {
        let value = ns(&mut || {
            for &p in &points.random {
                black_box(solid.omega(black_box(p)));
            }
        });
        rows.push(row("value", "one", value, value_errors));
        let gradient = ns(&mut || {
            for &p in &points.random {
                black_box(solid.omega_grad(black_box(p)));
            }
        });
        rows.push(row("gradient", "one", gradient, gradient_errors));
    }
    rows
}

/// The certificate of a program over the box and what rounding its points to the type adds to it.
fn certified<T: Lane>(solid: &Solid, over: Aabb) -> Option<f64> {
    let forms = solid.forms(ProgramKind::Value, T::PRECISION);
    let (graph, root) = solid.formula();
    let margin = 2.0 * FloatType::of(T::PRECISION).unit * over.min.abs().max(over.max.abs()).max_element();
    let arithmetic = Arithmetic { precision: T::PRECISION, forms, inputs: Inputs::Exact };
    let bound = ErrorAnalysis::new(graph, root, arithmetic).certify(&over.grown(margin), 0.0);
    bound.is_finite().then_some(bound)
}

/// Ranges of small boxes around the points: a violation is a point whose exact ω is not in the range.
fn range_row(solid: &Solid, points: &Points) -> Row {
    let half = 0.02 * points.over.size();
    let boxes: Vec<Aabb> = points.random.iter().map(|&p| Aabb::new(p - half, p + half)).collect();
    let ns = median_ns(boxes.len(), &mut || {
        for over in &boxes {
            black_box(solid.range(black_box(over)));
        }
    });
    let violations = std::iter::zip(&points.random, &boxes)
        .take(points.random_judged)
        .filter(|(p, over)| !solid.range(over).contains(solid.omega(**p)))
        .count();
    Row {
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

struct Columns<T>([Vec<T>; 3]);

impl<T: Lane> Columns<T> {
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
        self.0.each_ref().map(|c| &c[..])
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

/// Wrong signs among the points that are farther from the surface than their own coordinates are rounded.
fn sign_mismatches<T: Lane>(found: &[T], truth: &[Option<[Exact; 4]>], at: &[DVec3]) -> usize {
    let epsilon = if size_of::<T>() == 4 { f64::from(f32::EPSILON) } else { f64::EPSILON };
    let sign = |x: f64| f64::from(i8::from(x > 0.0) - i8::from(x < 0.0));
    let wrong = |i: &usize| {
        truth[*i].as_ref().is_some_and(|t| {
            let resolvable = t[0].to_f64().abs() > ROUNDING * epsilon * at[*i].abs().max_element() * slope(t);
            resolvable && sign(found[*i].to_f64()) != t[0].sign()
        })
    };
    (0..found.len()).filter(wrong).count()
}

/// Nanoseconds per point, the median of many repetitions after one that is not counted.
fn median_ns(points: usize, work: &mut dyn FnMut()) -> f64 {
    work();
    let mut times: Vec<f64> = (0..REPETITIONS)
        .map(|_| {
            let started = Instant::now();
            work();
            started.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[REPETITIONS / 2] * 1e9 / points as f64
}

fn print(solid: &Solid, points: &Points, over: Aabb, rows: &[Row]) {
    println!("solid {} on {}", solid.name(), target_description());
    println!(
        "{} random points of {} … {}, {} points on the surface; one thread, medians; errors against 120 digits",
        points.random.len(),
        over.min,
        over.max,
        points.surface.len()
    );
    println!(
        "{:<9} {:<5} {:<7} {:<9} {:<5} {:>9} {:>10} {:>10} {:>10} {:>6} {:>11}",
        "program",
        "prec",
        "engine",
        "form",
        "shape",
        "ns/point",
        "abs error",
        "certified",
        "rel error",
        "signs",
        "surface, m"
    );
    for row in rows {
        let number = |x: Option<f64>| x.map_or("–".to_string(), |x| format!("{x:.1e}"));
        println!(
            "{:<9} {:<5} {:<7} {:<9} {:<5} {:>9.2} {:>10} {:>10} {:>10} {:>6} {:>11}",
            row.program,
            row.precision,
            row.engine,
            row.form,
            row.shape,
            row.ns_per_point,
            number(row.max_abs_error),
            number(row.certified_error),
            number(row.max_rel_error),
            row.sign_mismatches.map_or("–".to_string(), |n| n.to_string()),
            number(row.max_distance_error),
        );
    }
}
