//! `rfm report`: speed against error, for every program of a solid, or for a flow whose truth is known.
//!
//! Errors of programs are measured against 120-digit arithmetic at random points of the box and at points on
//! the surface. Times are medians over batches of random points on one thread. For meshes the report gives
//! the error and the time of each method against the number of cells, and the order of convergence. A scene
//! is run at several resolutions instead ([`flows`]). All of it may become one page ([`page`]).

mod flow_plot;
mod flow_run;
mod flows;
mod meshes;
mod options;
mod page;
mod plot;
mod points;
mod programs;
mod solid_page;
mod table;

use anstream::println;
use glam::DVec3;
use serde::Serialize;

use super::failure::Failure;
use super::shared::Shared;
use super::{choose, input, output, progress};
use crate::cli::output::Shown;
use meshes::MeshFigures;
pub(super) use options::Report;
use points::SamplePoints;
use programs::{ExactValues, ProgramFigures};
use rfm::codegen::target_description;
use rfm::geom::{Aabb, significant};
use rfm::lower::Scene;
use rfm::{Precision, Program, Solid};

/// What the programs of one form and precision count in the progress, where an exact value counts one.
const PART: u64 = 200;

#[derive(Serialize)]
struct Document<'a> {
    schema: u32,
    solid: &'a str,
    target: String,
    box_min: [f64; 3],
    box_max: [f64; 3],
    points: usize,
    surface_points: usize,
    rows: &'a [ProgramFigures],
    meshes: &'a [MeshFigures],
}

pub(super) fn run(shared: &Shared, options: &Report) -> Result<(), Failure> {
    for path in options.output.iter().chain(&options.mesh_plot) {
        output::Picture::of(path)?;
    }
    if let Some(path) = options.html.as_ref().filter(|path| path.extension().is_none_or(|e| e != "html")) {
        return Err(Failure::usage(format!("`{}`: the page of a report is a file .html", path.shown())));
    }
    let (path, name) = choose::subject(&options.subject);
    let program = input::program(shared, path)?;
    if let Some(scene) = scene(&program, name, options)? {
        return flows::run(shared, &program, scene, options);
    }
    if let Some(name) = name.filter(|name| program.module().solids.iter().all(|s| s.name != *name)) {
        return Err(choose::no_such(path, &program, name));
    }
    let reference = choose::solid(shared, &program, options.solid.as_deref().or(name))?;
    solid(shared, options, &program, &reference)
}

/// Reports on all programs of a solid and on its meshes.
fn solid(shared: &Shared, options: &Report, program: &Program, solid: &Solid) -> Result<(), Failure> {
    let nowhere = || Failure::usage("the solid has no bounds and the file no scene: nowhere to measure");
    let over = program.domain(solid).ok_or_else(nowhere)?;
    let points = SamplePoints::choose(solid, over);
    let rows = all_programs(program, solid, &points)?;
    let meshes = meshes::measure(solid, options.mesh_cells)?;
    if let Some(path) = &options.output {
        let picture = plot::draw(solid.name(), &rows, path)?;
        output::write(path, |out| out.write_all(&picture))?;
    }
    if let Some(path) = &options.mesh_plot {
        let picture = meshes::draw(solid.name(), &meshes, path)?;
        output::write(path, |out| out.write_all(&picture))?;
    }
    if let Some(path) = &options.html {
        let page = solid_page::made(program, solid, &about(&points, over), &rows, &meshes)?;
        output::write(path, |out| out.write_all(&page))?;
    }
    if shared.json {
        return output::json(&Document {
            schema: 1,
            solid: solid.name(),
            target: target_description(),
            box_min: over.min.to_array(),
            box_max: over.max.to_array(),
            points: points.random.len(),
            surface_points: points.surface.len(),
            rows: &rows,
            meshes: &meshes,
        });
    }
    print(solid, &points, over, &rows);
    meshes::print(&meshes);
    for path in options.output.iter().chain(&options.mesh_plot) {
        println!("plot written to {}", path.shown());
    }
    if let Some(path) = &options.html {
        println!("page written to {}", path.shown());
    }
    Ok(())
}

/// The figures of every form, engine and precision, by program and shape.
fn all_programs(
    program: &Program,
    solid: &Solid,
    points: &SamplePoints,
) -> Result<Vec<ProgramFigures>, Failure> {
    let variants = programs::variants(program, solid)?;
    let judged = points.judged(Precision::F64).count() as u64;
    let bar = progress::bar(2 * judged + PART * (2 * variants.len() as u64 + 1), "measuring");
    bar.set_message("exact values".into());
    let truth = ExactValues::at(solid, points, &|| bar.inc(1));
    let mut rows = Vec::new();
    for (name, variant) in &variants {
        bar.set_message(format!("programs, {name}"));
        rows.extend(programs::measure::<f64>(variant, name, points, &truth.double));
        bar.inc(PART);
        rows.extend(programs::measure::<f32>(variant, name, points, &truth.single));
        bar.inc(PART);
    }
    rows.push(programs::range_row(solid, points));
    bar.inc(PART);
    bar.finish_and_clear();
    rows.sort_by_key(|row| (row.program, row.shape));
    Ok(rows)
}

/// The scene to report on, if one is meant: by its name, by options that only a flow has, or because the file
/// has no solid.
pub(super) fn scene<'a>(
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

/// What the table of programs means.
fn about(points: &SamplePoints, over: Aabb) -> String {
    format!(
        "{} random points of {} … {}, {} points on the surface; one thread, medians; errors against 120 digits",
        points.random.len(),
        corner(over.min),
        corner(over.max),
        points.surface.len()
    )
}

/// A corner of a box as a person reads it.
fn corner(p: DVec3) -> String {
    let [x, y, z] = p.to_array().map(significant);
    format!("[{x}, {y}, {z}]")
}

fn print(solid: &Solid, points: &SamplePoints, over: Aabb, rows: &[ProgramFigures]) {
    println!("solid {} on {}", solid.name(), target_description());
    println!("{}", about(points, over));
    println!("{}", table::head(&programs::COLUMNS));
    for row in rows {
        println!("{}", table::line(&programs::COLUMNS, &row.cells()));
    }
}
