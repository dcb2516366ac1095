//! The words that a file may use at each place, for editors.

pub use super::scene::declaration::{KeyValue, SceneKey, Without};

use super::names::RESERVED;
use super::scene::declaration::names;
use super::scene::read;
use super::{builtins, transforms};
use crate::sph::Method;
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

/// All blocks with the keys that every method has, a block before those within it; `None` is the scene
/// itself.
pub fn blocks() -> Vec<(Option<&'static str>, &'static [SceneKey])> {
    fn add(
        name: Option<&'static str>,
        keys: &'static [SceneKey],
        blocks: &mut Vec<(Option<&'static str>, &'static [SceneKey])>,
    ) {
        blocks.push((name, keys));
        for key in keys {
            if let Some(inner) = key.block() {
                add(Some(key.name), inner, blocks);
            }
        }
    }
    let mut blocks = Vec::new();
    add(None, read::scene_keys::ALL, &mut blocks);
    blocks
}

/// The keys of a block of a scene with a method, or of the scene itself; none if there is no such block.
pub fn keys(block: Option<&str>, method: Method) -> Vec<&'static str> {
    let declared = blocks().into_iter().find(|(name, _)| *name == block);
    let own = method.info().keys.into_iter().filter(|key| Some(key.block.name()) == block);
    let shared = declared.into_iter().flat_map(|(_, keys)| names(keys));
    let mut keys: Vec<&'static str> = shared.chain(own.map(|key| key.name)).collect();
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
    let declared = blocks().into_iter().flat_map(|(_, keys)| keys).find(|declared| declared.name == key);
    match declared.map(|key| key.value) {
        Some(KeyValue::MethodName) => Method::all().iter().map(|method| method.name().to_string()).collect(),
        Some(KeyValue::Words(words)) => words.iter().map(ToString::to_string).collect(),
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
