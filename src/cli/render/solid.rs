//! A picture of a solid, or a film of one that moves.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::film::{Kind, Target};
use super::options::Render;
use crate::cli::failure::{Failure, complain, note};
use crate::cli::output::{Shown, counted};
use crate::cli::run::bodies::Bodies;
use crate::cli::scenery::{self, Drawn, half_towards_eye, opened_by};
use crate::cli::shared::Shared;
use crate::cli::values::CutFlag;
use crate::cli::{choose, input, output};
use rfm::Solid;
use rfm::field::Points;
use rfm::geom::Aabb;
use rfm::mesh::Mesh;
use rfm::render::{Backdrop, Camera, Caption, Image, Legend, Moving, ParticlesView, Projection};
use rfm::solid::Bounds;

/// Cells of the mesh along the longest side, unless others are asked for.
const CELLS: usize = 128;

/// The end of a film for which no times are stated, s.
const END: f64 = 2.0;

/// The most pictures of a film of a solid.
const MOST_PICTURES: f64 = 100_000.0;

pub(super) fn run(shared: &Shared, options: &Render) -> Result<(), Failure> {
    let path = options.subject.as_path();
    if path != Path::new("-") && matches!(path.try_exists(), Ok(false)) {
        return Err(input::missing(path));
    }
    if let Some(flag) = options.flag_of_runs() {
        let (shown, folder) = (path.shown(), path.with_extension("out").shown());
        return Err(Failure::usage(format!(
            "{flag} is for the folder of a run, and `{shown}` is a file: `rfm run {shown}`, then `rfm render {folder} {flag} …`; \
             without it the picture shows a solid"
        )));
    }
    let program = input::program(shared, path)?;
    let solid = choose::solid(shared, &program, options.solid.as_deref())?;
    let path = options.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}.png", solid.name())));
    output::keep_inputs(&path)?;
    let target = options.target(path)?;
    match target.kind {
        Kind::Png => picture(shared, options, &solid, &target),
        Kind::Folder | Kind::Gif | Kind::Apng | Kind::Mp4 | Kind::Webm => {
            film(shared, options, &solid, &target)
        }
    }
}

fn picture(shared: &Shared, options: &Render, solid: &Solid, target: &Target) -> Result<(), Failure> {
    if let Some(flag) = options.flag_of_films() {
        return Err(Failure::usage(format!(
            "{flag} is for films, and `{}` is one picture: --time T chooses its time, and a .gif, .apng, .mp4 or .webm or a \
             folder holds many",
            target.path.shown()
        )));
    }
    let solid = choose::at(solid, options.time.unwrap_or(0.0));
    let name = solid.name().to_string();
    let domain = room(std::slice::from_ref(&solid))?;
    let bodies = bodies(solid, domain, options);
    let mesh = Mesh::joined(&bodies.meshes_at(options.time.unwrap_or(0.0))?);
    tell_of_thin_parts(&bodies, options)?;
    if mesh.triangles.is_empty() {
        complain(&format!(
            "the picture would be empty, and `{}` is not written: no point of the mesh's grid lies inside `{name}`; more \
             --mesh-cells find thinner parts",
            target.path.shown()
        ));
        return Err(Failure::Findings);
    }
    let (camera, drawn) = seen(options, &domain)?;
    let title = title(options, &name, drawn);
    let legend = Legend { title: &title, scale: None };
    let image = scenery::backdrop(&camera, &domain, &legend, std::iter::once((drawn, &mesh)))?.still();
    output::write(&target.path, |mut out| image.write_png(&mut out))?;
    let (width, height) = options.size;
    if shared.json {
        return output::json(&serde_json::json!({
            "schema": 1, "file": target.path.display().to_string(), "solid": name, "width": width, "height": height,
            "triangles": mesh.triangles.len(),
        }));
    }
    say!("{name}: {width} × {height} pixels, {} triangles", mesh.triangles.len());
    say!("written to {}", target.path.shown());
    Ok(())
}

fn film(shared: &Shared, options: &Render, solid: &Solid, target: &Target) -> Result<(), Failure> {
    let name = solid.name();
    let refuse = |reason: String| Err(Failure::usage(format!("`{}`: {reason}", target.path.shown())));
    if !solid.moves() {
        return refuse(format!(
            "`{name}` does not move, and is one picture, a .png; films and folders are for what moves and for the frames of \
             a run"
        ));
    }
    if options.time.is_some() {
        return refuse("--time is for one picture; --times A..B are those of a film".into());
    }
    let times = instants(options.times, target.rate)?;
    target.check(times.len())?;
    let moments: Vec<Solid> = times.iter().map(|time| solid.at(*time)).collect();
    let domain = room(&moments)?;
    let (camera, drawn) = seen(options, &domain)?;
    let title = title(options, name, drawn);
    let legend = Legend { title: &title, scale: None };
    let still = Backdrop::new(camera, &domain, &[], &legend).map_err(Failure::usage)?;
    let every = 1.0 / f64::from(target.rate);
    let picture = |k: usize| -> Result<Image, Failure> {
        let mesh = mesh(moments[k].clone(), domain, options)?;
        let bodies = scenery::sharp(&domain, std::iter::once((drawn, &mesh)));
        let particles = ParticlesView { positions: Points::new(&[], &[], &[]), values: &[], radius: 0.0 };
        let moving = Moving { meshes: &scenery::views(&bodies), particles, balls: false };
        Ok(still.frame_with(&moving, &Caption { time: times[k], every, step: None }))
    };
    target.write(&(0..times.len()).collect::<Vec<_>>(), &picture)?;
    let (width, height) = options.size;
    if shared.json {
        return output::json(&serde_json::json!({
            "schema": 1, "file": target.path.display().to_string(), "solid": name, "pictures": times.len(),
            "width": width, "height": height,
        }));
    }
    let (first, last) = (times[0], times[times.len() - 1]);
    let pictures = counted(times.len(), "picture");
    say!("{name}: {pictures} of {width} × {height}, from {first} s to {last} s");
    say!("written to {}", target.path.shown());
    Ok(())
}

/// The instants of a film, s.
fn instants(times: Option<(f64, f64)>, rate: u32) -> Result<Vec<f64>, Failure> {
    let (from, to) = times.unwrap_or((0.0, END));
    let from = if from == f64::NEG_INFINITY { 0.0 } else { from };
    if !to.is_finite() || from > to {
        return Err(Failure::usage("--times: state when a film of a solid begins and ends, as in 0..2"));
    }
    // sums of steps are not exact
    let count = ((to - from) * f64::from(rate) * (1.0 + 1e-12)).floor() + 1.0;
    if count > MOST_PICTURES {
        return Err(Failure::usage(format!(
            "--times: that is {count:.1e} pictures, and {MOST_PICTURES:.0} is the most; --fps makes them fewer"
        )));
    }
    Ok((0..count as u64).map(|k| from + k as f64 / f64::from(rate)).collect())
}

/// A box around a solid at all these times.
///
/// # Errors
/// It has none at one of them, or is empty at all of them.
fn room(moments: &[Solid]) -> Result<Aabb, Failure> {
    let name = moments[0].name();
    let refuse = |why: String| Err(Failure::usage(format!("`{name}` {why}: there is nothing to show")));
    let bounds: Vec<Bounds> = moments.par_iter().map(|solid| *solid.bounds()).collect();
    let mut room = None::<Aabb>;
    for (bounds, solid) in bounds.into_iter().zip(moments) {
        match bounds {
            Bounds::Within(bounds) => room = Some(room.map_or(bounds, |room| room.union(&bounds))),
            // of a film it may be empty for a while
            Bounds::Empty => {}
            Bounds::Unbounded => return refuse(format!("could not be proven to end at {} s", solid.time())),
        }
    }
    match room {
        Some(room) => Ok(room.grown(1e-3 * room.size().max_element())),
        None => refuse("is empty".into()),
    }
}

fn bodies(solid: Solid, domain: Aabb, options: &Render) -> Bodies {
    Bodies::of(vec![solid], domain, options.mesh_cells.unwrap_or(CELLS))
}

fn mesh(solid: Solid, domain: Aabb, options: &Render) -> Result<Mesh, Failure> {
    let time = solid.time();
    Ok(Mesh::joined(&bodies(solid, domain, options).meshes_at(time)?))
}

/// Notes what is too thin for the cells of the mesh that is drawn.
fn tell_of_thin_parts(bodies: &Bodies, options: &Render) -> Result<(), Failure> {
    for missed in bodies.missed_at(options.time.unwrap_or(0.0))? {
        note(format!(
            "the picture does not show all of what is thinner than two cells: {missed}; --mesh-cells sets how many there are"
        ));
    }
    Ok(())
}

/// From where a solid is seen, and how it is drawn.
fn seen(options: &Render, domain: &Aabb) -> Result<(Camera, Drawn), Failure> {
    let camera = camera(options, domain)?;
    let drawn = match &options.cut {
        None | Some(CutFlag::None) => Drawn::Whole,
        Some(CutFlag::Plane(plane)) => opened_by(half_towards_eye(plane, &camera), domain.corners()),
        Some(CutFlag::Auto) => {
            return Err(Failure::usage(
                "--cut auto opens what hides a fluid, and a solid alone hides none: choose a plane, as in --cut y=0",
            ));
        }
    };
    if let (Drawn::Hidden, Some(CutFlag::Plane(plane))) = (drawn, &options.cut) {
        return Err(Failure::usage(format!(
            "--cut {plane}: all of the solid lies between this plane and the eye and is cut away: choose a plane through it, \
             or a --camera on the other side"
        )));
    }
    Ok((camera, drawn))
}

/// The text over the pictures.
fn title(options: &Render, name: &str, drawn: Drawn) -> String {
    let path = options.subject.as_path();
    let file = path.file_name().filter(|_| path != Path::new("-"));
    let file = file.map_or_else(|| "standard input".into(), |name| Path::new(name).shown());
    options.title.clone().unwrap_or_else(|| {
        [vec![file, name.to_string()], scenery::described(&[name], &[drawn])].concat().join(" · ")
    })
}

/// The camera that the flags ask for.
pub(super) fn camera(options: &Render, domain: &Aabb) -> Result<Camera, Failure> {
    if options.look_at.is_some_and(|at| !at.is_finite()) {
        return Err(Failure::usage("--look-at: expected three finite lengths"));
    }
    let mut viewpoint = options.camera.unwrap_or_default();
    viewpoint.look_at = options.look_at.or(viewpoint.look_at);
    viewpoint.zoom = options.zoom.or(viewpoint.zoom);
    if options.parallel {
        viewpoint.projection = Projection::Parallel;
    }
    scenery::tell_of_aim(domain, viewpoint.look_at);
    scenery::camera(domain, viewpoint, options.size)
}
