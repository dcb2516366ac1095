//! A picture of a solid.

use std::path::{Path, PathBuf};

use super::film::Kind;
use super::options::Render;
use crate::cli::args::Shared;
use crate::cli::failure::Failure;
use crate::cli::output::Shown;
use crate::cli::run::bodies::Bodies;
use crate::cli::scenery::{self, Drawn, half_towards_eye};
use crate::cli::values::CutFlag;
use crate::cli::{choose, input, output};
use rfm::mesh::Mesh;
use rfm::render::{Camera, Legend};

/// Cells of the mesh along the longest side, unless others are asked for.
const CELLS: usize = 128;

pub(super) fn run(shared: &Shared, options: &Render) -> Result<(), Failure> {
    let path = options.subject.as_path();
    if let Some(flag) = options.flag_of_runs() {
        let (shown, folder) = (path.shown(), path.with_extension("out").shown());
        return Err(Failure::usage(format!(
            "{flag} is for the folder of a run, and `{shown}` is a file: `rfm run {shown}`, then `rfm render {folder} {flag} …`; \
             without it the picture shows a solid"
        )));
    }
    let program = input::program(shared, path)?;
    let solid = choose::solid_at(shared, &program, options.solid.as_deref(), options.time.unwrap_or(0.0))?;
    let name = solid.name().to_string();
    let target = options.output.clone().unwrap_or_else(|| PathBuf::from(format!("{name}.png")));
    if Kind::of(&target)? != Kind::Png {
        return Err(Failure::usage(format!(
            "`{}`: a solid is one picture, a .png; films and folders are for the frames of a run",
            target.shown()
        )));
    }
    let Some(bounds) = solid.bounds().aabb() else {
        return Err(Failure::usage(format!(
            "`{name}` is empty, or could not be proven to end: there is nothing to show"
        )));
    };
    let domain = bounds.grown(1e-3 * bounds.size().max_element());
    let camera = camera(options, &domain)?;
    let drawn = match &options.cut {
        None | Some(CutFlag::None) => Drawn::Whole,
        Some(CutFlag::Plane(plane)) => Drawn::Open(half_towards_eye(plane, &camera)),
        Some(CutFlag::Auto) => {
            return Err(Failure::usage(
                "--cut auto opens what hides a fluid, and a solid alone hides none: choose a plane, as in --cut y=0",
            ));
        }
    };
    let bodies = Bodies::of(vec![solid], domain, options.mesh_cells.unwrap_or(CELLS));
    let mesh = Mesh::joined(&bodies.meshes_at(0.0)?);
    let file = path.file_name().filter(|_| path != Path::new("-"));
    let file = file.map_or_else(|| "standard input".into(), |name| Path::new(name).shown());
    let title = options.title.clone().unwrap_or_else(|| {
        let cut = scenery::described(&[&name], &[drawn]);
        [vec![file, name.clone()], cut].concat().join(" · ")
    });
    let legend = Legend { title: &title, scale: None };
    let image = scenery::backdrop(&camera, &domain, &legend, std::iter::once((drawn, &mesh)))?.still();
    output::write(&target, |mut out| image.write_png(&mut out))?;
    let (width, height) = options.size;
    if shared.json {
        return output::json(&serde_json::json!({
            "schema": 1, "file": target.display().to_string(), "solid": name, "width": width, "height": height,
            "triangles": mesh.triangles.len(),
        }));
    }
    say!("{name}: {width} × {height} pixels, {} triangles", mesh.triangles.len());
    say!("written to {}", target.shown());
    Ok(())
}

/// The camera that the flags ask for.
pub(super) fn camera(options: &Render, domain: &rfm::geom::Aabb) -> Result<Camera, Failure> {
    if options.look_at.is_some_and(|at| !at.is_finite()) {
        return Err(Failure::usage("--look-at: expected three finite lengths"));
    }
    let flag = options.camera;
    let look_at = options.look_at.or(flag.and_then(|flag| flag.look_at));
    let zoom = options.zoom.or(flag.and_then(|flag| flag.zoom));
    scenery::camera(domain, flag.map(|flag| flag.towards_eye), (look_at, zoom), options.size)
}
