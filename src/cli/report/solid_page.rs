//! The page of a report on a solid.

use std::path::Path;

use super::super::failure::Failure;
use super::super::run::bodies::Bodies;
use super::super::scenery::{self, Drawn};
use super::meshes::{self, MeshFigures};
use super::page::{Figure, Page};
use super::plot;
use super::programs::{self, ProgramFigures};
use rfm::geom::{Aabb, significant};
use rfm::mesh::Mesh;
use rfm::render::{Camera, Legend};
use rfm::slice::{self, Axis, Plane};
use rfm::{Program, Solid};

/// Cells of the mesh that is shown, along the longest side.
const CELLS: usize = 128;

/// Width and height of its picture.
const SIZE: (u32, u32) = (960, 720);

/// A path that stands for drawings in the page.
const DRAWING: &str = "drawing.svg";

/// The page: tables and plots of programs and meshes, pictures, and how to make it again.
pub(super) fn made(
    program: &Program,
    solid: &Solid,
    about: &str,
    rows: &[ProgramFigures],
    meshes: &[MeshFigures],
) -> Result<Vec<u8>, Failure> {
    let name = solid.name();
    let mut page = Page::begin(&format!("{name}: speed against error"), about);
    page.figures(&pictures(solid)?);
    page.section(
        "Programs",
        "Time for one point and errors, by program, precision and form. A program that is certified never errs by more.",
    );
    let drawn = plot::draw(name, rows, Path::new(DRAWING))?;
    page.figures(&[Figure::svg(
        drawn,
        "Each mark is a program: its time for one point against its largest relative error",
    )]);
    page.table(&programs::COLUMNS, rows.iter().map(ProgramFigures::cells));
    if meshes.is_empty() {
        page.section("Meshes", "There are none: the solid has no bounds.");
    } else {
        let lack = meshes::without_triangles(meshes);
        let about =
            lack.map_or_else(|| meshes::ABOUT.to_string(), |lack| format!("{}. {lack}", meshes::ABOUT));
        page.section("Meshes", &about);
        let drawn = meshes::draw(name, meshes, Path::new(DRAWING))?;
        page.figures(&[Figure::svg(
            drawn,
            "Largest distance between mesh and surface against the number of cells",
        )]);
        page.table(&meshes::COLUMNS, meshes.iter().map(MeshFigures::cells));
    }
    Ok(page.end(program))
}

/// The solid, and ω in a plane through its middle; only the plane if it has no bounds.
fn pictures(solid: &Solid) -> Result<Vec<Figure>, Failure> {
    let name = solid.name();
    let bounds = solid.bounds().aabb().filter(|bounds| !bounds.is_empty());
    let mut figures = Vec::new();
    if let Some(bounds) = &bounds {
        let domain = bounds.grown(1e-3 * bounds.size().max_element());
        let camera = Camera::three_quarter(&domain, SIZE).map_err(Failure::usage)?;
        let mesh = Mesh::joined(&Bodies::of(vec![solid.clone()], domain, CELLS).meshes_at(0.0)?);
        let legend = Legend { title: name, scale: None };
        let shown = std::iter::once((Drawn::Whole, &mesh));
        let mut png = Vec::new();
        scenery::backdrop(&camera, &domain, &legend, shown)?.still().write_png(&mut png)?;
        figures.push(Figure::png(png, format!("{name}, as a mesh of {} triangles", mesh.triangles.len())));
    }
    let around = bounds.map_or(Aabb::new(-glam::DVec3::ONE, glam::DVec3::ONE), |bounds| {
        bounds.grown(0.25 * bounds.size().max_element())
    });
    let plane = Plane::new(Axis::Y, around.centre().y);
    let mut svg = Vec::new();
    slice::write_svg(solid, name, plane, plane.window(&around), slice::DEFAULT_SAMPLES, &mut svg)
        .map_err(Failure::usage)?;
    figures.push(Figure::svg(
        svg,
        format!(
            "ω of {name} in the plane {} = {} m: above 0 inside, 0 on the surface",
            plane.axis.name(),
            significant(plane.value)
        ),
    ));
    Ok(figures)
}
