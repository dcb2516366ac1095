//! The words that a file may use at each place, for editors.

use super::names::RESERVED;
use super::scene::{fluid, picture, read};
use super::{builtins, probes, transforms};
use crate::sph::{KeyBlock, Method};
use crate::syntax::Ast;

/// The standard solids and maps, as they are written in the language.
pub fn prelude() -> &'static Ast {
    super::prelude()
}

/// The functions that are no text of the prelude.
pub fn builtins() -> impl Iterator<Item = &'static str> {
    builtins::names()
}

/// The methods that are no text of the prelude, each with the names of its parameters.
pub fn methods() -> impl Iterator<Item = (&'static str, Vec<&'static str>)> {
    transforms::methods()
}

/// Names with a meaning that no item can change.
pub fn reserved() -> &'static [&'static str] {
    &RESERVED
}

/// The keys of a block of a scene with a method, or of the scene itself.
pub fn keys(block: Option<&str>, method: Method) -> Vec<&'static str> {
    let own = |block: KeyBlock| {
        method.info().keys.into_iter().filter(move |key| key.block == block).map(|key| key.name)
    };
    let mut keys: Vec<&'static str> = match block {
        None => read::SCENE_KEYS.to_vec(),
        Some("box") => read::BOX_KEYS.to_vec(),
        Some("container" | "obstacle") => read::OBSTACLE_KEYS.to_vec(),
        Some("fluid") => fluid::FLUID_KEYS.iter().copied().chain(own(KeyBlock::Fluid)).collect(),
        Some("solver") => fluid::SOLVER_KEYS.iter().copied().chain(own(KeyBlock::Solver)).collect(),
        Some("run") => read::RUN_KEYS.to_vec(),
        Some("truth") => read::TRUTH_KEYS.to_vec(),
        Some("probe") => probes::PROBE_KEYS.to_vec(),
        Some("flux") => probes::FLUX_KEYS.to_vec(),
        Some("picture") => picture::PICTURE_KEYS.to_vec(),
        // there is no other block
        Some(_) => Vec::new(),
    };
    let mut known = std::collections::HashSet::new();
    keys.retain(|key| known.insert(*key));
    keys
}

/// Whether the fluid, the solver or the run of a scene has a key of this name, with any method, whose value
/// is a number.
pub fn is_key(name: &str) -> bool {
    const BLOCKS: [Option<&str>; 3] = [Some("fluid"), Some("solver"), Some("run")];
    let is_number = name != "shape" && words(name).is_empty();
    is_number
        && Method::all()
            .into_iter()
            .any(|method| BLOCKS.iter().any(|block| keys(*block, method).contains(&name)))
}

/// The words that a key takes as its value; none if it takes a number, a name or an expression.
pub fn words(key: &str) -> Vec<String> {
    let fixed = |words: &[&str]| words.iter().map(ToString::to_string).collect();
    match key {
        "method" => Method::all().iter().map(|method| method.name().to_string()).collect(),
        "fill" => fixed(&["below", "middle"]),
        "walls" => fixed(&["free_slip", "no_slip"]),
        "precision" => fixed(&["auto", "f32", "f64"]),
        "cut" => fixed(&["auto", "none"]),
        _ => {
            let keys = Method::all().into_iter().flat_map(|method| method.info().keys);
            let accepts = keys.filter(|own| own.name == key && own.unit.is_none()).map(|own| own.accepts);
            // words are listed with commas; what a number accepts is a phrase
            let split = |accepts: String| -> Vec<String> {
                let words: Vec<String> = accepts.split(", ").map(str::to_string).collect();
                let plain = words.iter().all(|word| word.chars().all(|c| c.is_alphanumeric() || c == '_'));
                if plain { words } else { Vec::new() }
            };
            let mut words: Vec<String> = accepts.flat_map(split).collect();
            words.dedup();
            words
        }
    }
}
