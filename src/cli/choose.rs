//! The solid or the scene of a file that a command line means.

use std::path::Path;

use super::failure::{Failure, note};
use super::input;
use super::shared::Shared;
use crate::cli::output::Shown;
use rfm::diagnostic::{Diagnostics, nearest};
use rfm::lower::{NamedSolid, Scene};
use rfm::solid::Chosen;
use rfm::{Error, Program, Solid};

/// The parts of `FILE` or `FILE:NAME`. If a file has the whole text as its name, it is that file.
pub(super) fn subject(text: &str) -> (&Path, Option<&str>) {
    match text.rsplit_once(':') {
        Some((path, name)) if !Path::new(text).exists() => (Path::new(path), Some(name)),
        _ => (Path::new(text), None),
    }
}

/// The failure for a name that is neither a solid nor a scene of the file.
pub(super) fn no_such(path: &Path, program: &Program, name: &str) -> Failure {
    let module = program.module();
    let solids = module.solids.iter().map(|s| s.name.as_str());
    let scenes = module.scenes.iter().map(|s| s.name.as_str());
    let near = nearest(name, solids.chain(scenes));
    let hint = near.map_or(String::new(), |n| format!("; did you mean `{n}`?"));
    Failure::usage(format!("`{}` has no solid or scene `{name}`{hint}", path.shown()))
}

/// The solid of a name. Without a name it is the only solid, or the first obstacle of the only scene.
pub(super) fn solid(shared: &Shared, program: &Program, name: Option<&str>) -> Result<Solid, Failure> {
    let name = match name {
        Some(name) => name.to_string(),
        None => default_solid(program)?.name.clone(),
    };
    program.solid_with(&name, shared.engine.into()).map_err(usage)
}

/// The solid that [`solid`] finds, at a time in seconds. If it moves, a note says so.
pub(super) fn solid_at(
    shared: &Shared,
    program: &Program,
    name: Option<&str>,
    time: f64,
) -> Result<Solid, Failure> {
    Ok(at(&solid(shared, program, name)?, time))
}

/// A solid at a time in seconds. If it moves, a note says so.
pub(super) fn at(solid: &Solid, time: f64) -> Solid {
    if solid.moves() {
        note(format!("`{}` moves: this is how it is at t = {time} s", solid.name()));
    }
    solid.at(time)
}

fn default_solid(program: &Program) -> Result<&NamedSolid, Failure> {
    let module = program.module();
    let in_scene = match &module.scenes[..] {
        [scene] => scene.obstacles.first().and_then(|o| module.solids.iter().find(|s| s.name == o.name)),
        _ => None,
    };
    match (&module.solids[..], in_scene) {
        ([], _) => Err(Failure::usage("the file defines no solid; write `solid name = …`")),
        ([only], _) | (_, Some(only)) => Ok(only),
        (several, None) => {
            let names: Vec<&str> = several.iter().map(|s| s.name.as_str()).collect();
            Err(Failure::usage(format!(
                "the file has several solids; choose one with -s: {}",
                names.join(", ")
            )))
        }
    }
}

/// The cheapest program that keeps the tolerance of ω. `None` if the file states no tolerance. Prints the
/// reason if no program keeps it.
pub(super) fn within_tolerance(program: &Program, solid: &Solid) -> Result<Option<Chosen>, Failure> {
    program.within_tolerance(solid).transpose().map_err(|diagnostic| {
        let list = vec![*diagnostic];
        input::show(&Diagnostics { list, sources: program.sources().clone() });
        Failure::Findings
    })
}

/// The scene of a name. Without a name it is the only scene.
pub(super) fn scene<'a>(program: &'a Program, name: Option<&str>) -> Result<&'a Scene, Failure> {
    let scenes = &program.module().scenes;
    let names = || scenes.iter().map(|s| s.name.clone()).collect::<Vec<_>>();
    match (name, &scenes[..]) {
        (Some(name), _) => scenes.iter().find(|s| s.name == name).ok_or_else(|| {
            usage(Error::UnknownName { kind: "scene", name: name.to_string(), known: names() })
        }),
        (None, [only]) => Ok(only),
        (None, []) => Err(Failure::usage("the file has no scene to run; write `scene name { … }`")),
        (None, _) => {
            let names = names().join(", ");
            Err(Failure::usage(format!("the file has several scenes; choose one with --scene: {names}")))
        }
    }
}

pub(super) fn usage(error: Error) -> Failure {
    Failure::usage(error)
}
