//! Error against cost for a flow with a known solution: a scene is run at growing resolution by each method.
//!
//! A scene with a `truth`, the methods and the sizes give rows, which are printed as a table or JSON and
//! drawn as a picture. A run that fails is a row that says so.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use anstream::println;
use serde::Serialize;

use super::super::run::bodies::Bodies;
use super::super::run::pictures::{Look, Pictures, Seen};
use super::super::shared::Shared;
use super::super::stopwatch::processor_seconds;
use super::super::{Failure, choose, input, output, progress};
use super::flow_plot;
use super::flow_run::FlowRun;
use super::options::Report;
use super::page::{Figure, Page};
use super::table::{self, Column};
use crate::cli::output::Shown;
use rfm::experiment::{Deviation, Deviations};
use rfm::lower::{Scene, Truth};
use rfm::sph::{Method, Simulation};
use rfm::{Error, Experiment, Program};

/// The param of a file that sets the resolution of its scene.
const SIZE: &str = "particles";

/// Sizes without `--particles`, as parts of what the file states. In space two spacings then differ by 4^⅓ =
/// 1.6, in a layer of a fixed number of spacings by 2.
const PARTS: [f64; 3] = [1.0 / 16.0, 1.0 / 4.0, 1.0];

/// Cells of the obstacles' meshes in a picture, along the longest side of each.
const CELLS: usize = 64;

/// A run makes no progress if this number of steps covers less than this part of its time: at that pace it
/// would take a hundred million steps.
const STANDSTILL: (u64, f64) = (200, 1e-6);

#[derive(Serialize)]
struct Document<'a> {
    schema: u32,
    scene: &'a str,
    threads: usize,
    /// Number of saved instants that were compared in a run that did not fail.
    instants: usize,
    rows: &'a [FlowRun],
}

pub(super) fn run(
    shared: &Shared,
    program: &Program,
    scene: &Scene,
    options: &Report,
) -> Result<(), Failure> {
    let (picture, options, html) = (options.output.as_deref(), &options.flow, options.html.as_deref());
    let Some(truth) = scene.truth else {
        return Err(Failure::usage(format!(
            "the scene `{}` does not say what is known of its flow; write `truth {{ pressure: … }}`, with \
             `velocity: […]` or `front: …`, formulas of x, y, z and t",
            scene.name
        )));
    };
    let sizes = sizes(program, &options.particles)?;
    let methods: Vec<Option<Method>> = match &options.methods[..] {
        [] => vec![None],
        several => several.iter().copied().map(Some).collect(),
    };
    let mut study = Study {
        shared,
        scene: &scene.name,
        is_seen: html.is_some(),
        picture: None,
        instants: 0,
        bar: bar(&sizes, methods.len()),
    };
    let table = Table::of(&truth);
    if !shared.json {
        println!("{}: {}", scene.name, about(&truth));
        println!("{}", table::head(&table.columns()));
    }
    let rows = study.rows(program, &methods, &sizes, &table)?;
    study.bar.finish_and_clear();
    if let Some(path) = picture {
        let picture = flow_plot::draw(&scene.name, &rows, path)?;
        output::write(path, |out| out.write_all(&picture))?;
    }
    let instants = study.instants;
    if let Some(path) = html {
        let page = page(program, scene, &truth, &table, (&rows, study.picture))?;
        output::write(path, |out| out.write_all(&page))?;
    }
    if shared.json {
        let threads = rayon::current_num_threads();
        output::json(&Document { schema: 1, scene: &scene.name, threads, instants, rows: &rows })?;
    } else {
        if let Some(path) = picture {
            println!("plot written to {}", path.shown());
        }
        if let Some(path) = html {
            println!("page written to {}", path.shown());
        }
    }
    match failures(&rows) {
        None => Ok(()),
        Some(failures) => Err(Failure::Numerical(failures)),
    }
}

/// What the table of a flow means.
fn about(truth: &Truth) -> String {
    format!(
        "relative deviation from what is known, over all particles and the saved instants from {} s on",
        truth.from
    )
}

/// The report as a page.
fn page(
    program: &Program,
    scene: &Scene,
    truth: &Truth,
    table: &Table,
    (rows, picture): (&[FlowRun], Option<Figure>),
) -> Result<Vec<u8>, Failure> {
    let mut page = Page::begin(&format!("{}: error against cost", scene.name), &about(truth));
    let drawn = flow_plot::draw(&scene.name, rows, Path::new("drawing.svg"))?;
    let drawn = Figure::svg(drawn, "Each mark is a run: its processor time against its deviation");
    page.figures(&[Some(drawn), picture].into_iter().flatten().collect::<Vec<_>>());
    page.section("Runs", "The order is p of error ∝ spacingᵖ between a run and the coarser one before it.");
    page.table(&table.columns(), rows.iter().map(|row| table.cells(row)));
    if let Some(failures) = failures(rows) {
        page.section("Runs that failed", &failures);
    }
    Ok(page.end(program))
}

/// The failures of runs, one in each line; `None` if there are none.
fn failures(rows: &[FlowRun]) -> Option<String> {
    let failed = rows.iter().filter_map(|row| {
        Some(format!("{}, {} particles: {}", row.method, row.particles, row.failure.as_ref()?))
    });
    let lines: Vec<String> = failed.collect();
    (!lines.is_empty()).then(|| lines.join("\n"))
}

/// The sizes that were asked for, or [`PARTS`] of the file's own size within its range. `None` stands for one
/// run as the file is.
fn sizes(program: &Program, asked: &[usize]) -> Result<Vec<Option<usize>>, Failure> {
    let param = program.module().params.iter().find(|param| param.name == SIZE);
    let mut sizes: Vec<usize> = match (param, asked) {
        (None, []) => return Ok(vec![None]),
        (None, _) => {
            return Err(Failure::usage(format!(
                "the file has no `param {SIZE}` to set its resolution by; write `param {SIZE} = 4000` and let the \
                 fluid's `spacing` follow from it"
            )));
        }
        (Some(param), []) => {
            let least = param.range.map_or(1.0, |(low, _)| low.max(1.0));
            PARTS.iter().map(|part| (part * param.value).max(least).ceil() as usize).collect()
        }
        (Some(_), asked) => asked.to_vec(),
    };
    sizes.sort_unstable();
    sizes.dedup();
    Ok(sizes.into_iter().map(Some).collect())
}

/// The state that all runs of a report share.
struct Study<'a> {
    shared: &'a Shared,
    scene: &'a str,
    /// Whether a picture of the fluid is wanted.
    is_seen: bool,
    /// The fluid at the end of the finest run that did not fail.
    picture: Option<Figure>,
    instants: usize,
    bar: progress::Progress,
}

impl Study<'_> {
    /// Runs the scene by each method in each size. A row is printed as soon as it is known, because the next
    /// may take long.
    fn rows(
        &mut self,
        program: &Program,
        methods: &[Option<Method>],
        sizes: &[Option<usize>],
        table: &Table,
    ) -> Result<Vec<FlowRun>, Failure> {
        let mut rows: Vec<FlowRun> = Vec::new();
        for method in methods {
            let by_method = match method {
                Some(method) => program.with_method(*method).map_err(refused)?,
                None => program.clone(),
            };
            for &size in sizes {
                let sized = match size {
                    Some(size) => by_method.with(SIZE, size as f64).map_err(refused)?,
                    None => by_method.clone(),
                };
                let mut row = self.measure(&sized, size)?;
                if let Some(coarser) = rows.last() {
                    row.compare(coarser);
                }
                if !self.shared.json {
                    self.bar.suspend(|| println!("{}", table::line(&table.columns(), &table.cells(&row))));
                }
                rows.push(row);
            }
        }
        Ok(rows)
    }

    /// Runs the scene to its end, and compares it with the known solution at every instant at which it would
    /// be saved.
    fn measure(&mut self, program: &Program, size: Option<usize>) -> Result<FlowRun, Failure> {
        let scene = choose::scene(program, Some(self.scene))?;
        let experiment = Experiment::new(program, &scene.name, self.shared.engine.into()).map_err(refused)?;
        let start = experiment.start().map_err(refused)?;
        input::show(&experiment.warnings());
        input::show(&start.warnings);
        let mut simulation = start.simulation;
        let before = self.bar.position();
        let method = experiment.parameters().method.name();
        let (mut failure, mut mark) = (None, (0, 0.0));
        let mut stands_still = false;
        let mut follow = |simulation: &Simulation| {
            let done = simulation.time() / scene.run.until;
            self.bar.set_position(before + (done * work(size)) as u64);
            let particles = simulation.particles().len();
            self.bar.set_message(format!("{method}, {particles} particles, t = {:.3} s", simulation.time()));
            if simulation.steps() >= mark.0 + STANDSTILL.0 {
                stands_still = simulation.time() - mark.1 < STANDSTILL.1 * scene.run.until;
                mark = (simulation.steps(), simulation.time());
            }
            if stands_still { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut deviations = Deviations::default();
        let (mut cpu_seconds, mut seconds) = (0.0, 0.0);
        let mut frame = 0;
        while failure.is_none() && simulation.time() < scene.run.until * (1.0 - 1e-12) {
            frame += 1;
            let end = (f64::from(frame) * scene.run.save_every).min(scene.run.until);
            let (clock, processor) = (Instant::now(), processor_seconds());
            let reached = simulation.advance(end, &mut follow);
            failure = reached.err().map(|error| error.to_string());
            if simulation.time() < end * (1.0 - 1e-12) && failure.is_none() {
                failure = Some(format!(
                    "step {}: time stands still at {:.4} s, steps have become too short",
                    simulation.steps(),
                    simulation.time()
                ));
            }
            cpu_seconds += processor_seconds() - processor;
            seconds += clock.elapsed().as_secs_f64();
            if failure.is_none() {
                deviations.look(&experiment, &simulation);
            }
        }
        self.bar.set_position(before + work(size) as u64);
        self.instants = self.instants.max(deviations.instants());
        if failure.is_none() && self.is_seen {
            self.picture = Some(seen(&experiment, &simulation)?);
        }
        let deviation = if failure.is_none() { deviations.total() } else { Deviation::default() };
        Ok(FlowRun::of(&simulation, deviation, [cpu_seconds, seconds], failure))
    }
}

/// The fluid of a run, where it is now.
fn seen(experiment: &Experiment, simulation: &Simulation) -> Result<Figure, Failure> {
    let look = Look { camera: None, cut: None, hide: &[], glass: &[], surface: None, fastest: None };
    let solids = experiment.bodies().iter().map(|body| body.solid.clone()).collect();
    let bodies = Bodies::of(solids, experiment.domain(), CELLS);
    let mut pictures = Pictures::new(look, experiment, &bodies.meshes_at(0.0)?)?;
    pictures.show(&bodies.meshes_at(simulation.time())?);
    let mut png = Vec::new();
    pictures.image(Seen::of(simulation))?.write_png(&mut png)?;
    let (method, particles) = (experiment.parameters().method.name(), simulation.particles().len());
    let time = simulation.time();
    Ok(Figure::png(
        png,
        format!("The fluid at {time:.3} s: {method}, {particles} particles, coloured by their speed"),
    ))
}

/// Relative duration of a run: N particles, in steps whose length is proportional to the spacing.
fn work(size: Option<usize>) -> f64 {
    (size.unwrap_or(1000) as f64).powf(4.0 / 3.0)
}

fn bar(sizes: &[Option<usize>], methods: usize) -> progress::Progress {
    let once: u64 = sizes.iter().map(|&size| work(size) as u64).sum();
    progress::bar(once * methods as u64, "running")
}

/// Shows the messages about a file, and returns the failure for them.
fn refused(error: Error) -> Failure {
    match error {
        Error::Diagnostics(diagnostics) => {
            input::show(&diagnostics);
            input::failure(&diagnostics)
        }
        other => choose::usage(other),
    }
}

/// The table of a report.
struct Table {
    /// Indices, in [`Deviation::NAMES`], of the quantities that are known.
    known: Vec<usize>,
}

impl Table {
    fn of(truth: &Truth) -> Self {
        let known = [truth.pressure.is_some(), truth.velocity.is_some(), truth.front.is_some()];
        Self { known: (0..3).filter(|&k| known[k]).collect() }
    }

    fn columns(&self) -> Vec<Column> {
        let known = self.known.iter();
        let errors =
            known.flat_map(|&k| [Column::numbers(Deviation::NAMES[k], 9), Column::numbers("order", 6)]);
        let first = [
            Column::words("method", 7),
            Column::words("precision", 9),
            Column::numbers("particles", 9),
            Column::numbers("spacing", 9),
        ];
        let last = [
            Column::numbers("steps", 8),
            Column::numbers("CPU s", 9),
            Column::numbers("per simulated s", 17),
        ];
        first.into_iter().chain(errors).chain(last).collect()
    }

    fn cells(&self, row: &FlowRun) -> Vec<String> {
        let error = |error: Option<f64>| error.map_or("failed".to_string(), |error| format!("{error:.2e}"));
        let (errors, orders) = (row.errors(), row.orders());
        let first = [
            row.method.to_string(),
            row.precision.to_string(),
            row.particles.to_string(),
            format!("{:.4}", row.spacing),
        ];
        let known = self.known.iter().flat_map(|&k| [error(errors[k]), table::order(orders[k])]);
        let last = [
            row.steps.to_string(),
            format!("{:.2}", row.cpu_seconds),
            format!("{:.2}", row.cpu_seconds_per_simulated_second),
        ];
        first.into_iter().chain(known).chain(last).collect()
    }
}
