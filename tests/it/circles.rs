//! No two files of a room import each other in a circle, however long.
//!
//! A `mod.rs` that only names and re-exports its children is seen through: who imports a name from it imports
//! the child that defines it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::tool::root;

/// Rooms without circles of files.
const ROOMS: [&str; 16] = [
    "cli",
    "codegen",
    "diagnostic",
    "experiment",
    "field",
    "fluid_surface",
    "ir",
    "lower",
    "mesh",
    "render",
    "simplify",
    "slice",
    "solid",
    "sph",
    "syntax",
    "view",
];

type Segments = Vec<String>;

/// A file of a room: its module, what it imports, and what it re-exports under which name.
struct Source {
    module: Segments,
    imports: BTreeSet<Segments>,
    reexports: BTreeMap<String, Segments>,
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The paths that a `use` names: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn flat(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((before, list)) = tree.split_once('{') else { return vec![tree.to_string()] };
    let list = list.strip_suffix('}').unwrap_or(list);
    let (mut depth, mut start, mut parts) = (0, 0, Vec::new());
    for (at, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&list[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&list[start..]);
    let parts = parts.into_iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| flat(part).into_iter().map(|inner| format!("{before}{inner}"))).collect()
}

/// A path as seen from the crate's root; `None` for another crate.
fn absolute(path: &str, module: &[String], children: &BTreeSet<String>) -> Option<Segments> {
    let path = path.split(" as ").next().unwrap_or(path);
    let mut segments: Segments = path.split("::").map(|s| s.trim().to_string()).collect();
    let mut place = module.to_vec();
    match segments[0].as_str() {
        "crate" => return Some(segments.split_off(1)),
        "super" => {
            while segments.first().is_some_and(|s| s == "super") {
                segments.remove(0);
                place.pop();
            }
        }
        first if children.contains(first) => {}
        _ => return None,
    }
    place.extend(segments);
    Some(place)
}

fn read(path: &Path) -> Source {
    let inside = path.strip_prefix(root().join("src")).unwrap().with_extension("");
    let mut module: Segments = inside.iter().map(|s| s.to_str().unwrap().to_string()).collect();
    let is_parent = module.last().is_some_and(|last| last == "mod");
    if is_parent {
        module.pop();
    }
    let text = std::fs::read_to_string(path).unwrap();
    let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    let code: Vec<&str> = text[..end].lines().map(|line| line.split("//").next().unwrap_or("")).collect();
    let code = code.join("\n");
    let declared = |statement: &str| {
        let (_, name) = statement.trim().rsplit_once("mod ")?;
        Some(name.trim().to_string())
    };
    let children: BTreeSet<String> = code.split(';').filter_map(declared).collect();
    let (mut imports, mut reexports) = (BTreeSet::new(), BTreeMap::new());
    for statement in code.split(';') {
        let Some((before, tree)) = statement.rsplit_once("use ") else { continue };
        let is_public = before.lines().last().is_some_and(|line| line.trim_start().starts_with("pub"));
        for path in flat(tree) {
            let Some(target) = absolute(&path, &module, &children) else { continue };
            let name = path.rsplit(" as ").next().unwrap_or(&path).rsplit("::").next().unwrap_or("");
            if is_parent && is_public {
                reexports.insert(name.trim().to_string(), target);
            } else {
                imports.insert(target);
            }
        }
    }
    Source { module, imports, reexports }
}

/// The file that a path leads to.
fn target(path: &[String], sources: &BTreeMap<Segments, Source>) -> Option<Segments> {
    for length in (1..=path.len()).rev() {
        let Some(source) = sources.get(&path[..length]) else { continue };
        return match path.get(length).and_then(|name| source.reexports.get(name)) {
            Some(behind) => target(behind, sources),
            None => Some(source.module.clone()),
        };
    }
    None
}

/// A way through `imports` that comes back to where it began.
fn circle(imports: &BTreeMap<Segments, BTreeSet<Segments>>) -> Option<Vec<String>> {
    for begin in imports.keys() {
        let mut ways = vec![vec![begin.clone()]];
        let mut seen = BTreeSet::new();
        while let Some(way) = ways.pop() {
            for next in &imports[&way[way.len() - 1]] {
                let further = [&way[..], std::slice::from_ref(next)].concat();
                if next == begin {
                    return Some(further.iter().map(|file| file.join("::")).collect());
                }
                if seen.insert(next.clone()) {
                    ways.push(further);
                }
            }
        }
    }
    None
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let mut paths = Vec::new();
    for room in ROOMS {
        files(&root().join("src").join(room), &mut paths);
    }
    let sources: BTreeMap<Segments, Source> =
        paths.iter().map(|path| read(path)).map(|source| (source.module.clone(), source)).collect();
    let imports_of = |source: &Source| {
        let targets = source.imports.iter().filter_map(|path| target(path, &sources));
        targets.filter(|file| *file != source.module).collect::<BTreeSet<_>>()
    };
    let imports: BTreeMap<Segments, BTreeSet<Segments>> =
        sources.iter().map(|(module, source)| (module.clone(), imports_of(source))).collect();
    // the test has understood the sources
    assert!(imports.values().map(BTreeSet::len).sum::<usize>() > 2 * imports.len());
    assert_eq!(circle(&imports), None);
}
