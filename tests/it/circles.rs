//! No circles: files do not need each other in a ring, however long, and rooms (the files and folders of
//! `src`) do not either.
//!
//! A file needs what its `use` lines and the paths in its code name, be they of `crate`, `super`, `self` or a
//! child. A name that a file re-exports leads to the file that defines it. A module inside another one may
//! use what its parent defines, although the parent calls it: a small type at the top of a folder is at home
//! there. Files that exist for tests alone are left out.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::tool::root;

type Segments = Vec<String>;

/// A file: its module, what it needs, which names lead elsewhere, and what it defines.
struct Source {
    module: Segments,
    needs: BTreeSet<Segments>,
    leads: BTreeMap<String, Segments>,
    /// The modules of which it re-exports everything.
    globs: Vec<Segments>,
    defines: BTreeSet<String>,
    /// Its children that are compiled for tests alone.
    for_tests: BTreeSet<Segments>,
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

/// A path as seen from the crate's root; `None` for another crate. `names` are those that the file imports.
fn absolute(
    path: &str,
    module: &[String],
    children: &BTreeSet<String>,
    names: &BTreeMap<String, Segments>,
) -> Option<Segments> {
    let mut segments: Segments = path.split("::").map(|s| s.trim().to_string()).collect();
    if segments.last().is_some_and(|last| last == "self") {
        segments.pop();
    }
    let first = segments.first()?.as_str();
    let mut place = module.to_vec();
    match first {
        "crate" => return Some(segments.split_off(1)),
        "self" => drop(segments.remove(0)),
        "super" => {
            while segments.first().is_some_and(|s| s == "super") {
                segments.remove(0);
                place.pop();
            }
        }
        _ if children.contains(first) => {}
        _ => place = names.get(&segments.remove(0))?.clone(),
    }
    place.extend(segments);
    Some(place)
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The paths of two and more segments that stand in code.
fn paths(code: &str) -> BTreeSet<&str> {
    let parts = code.split(|c: char| !is_of_word(c) && c != ':').map(|part| part.trim_matches(':'));
    parts.filter(|part| part.contains("::")).collect()
}

/// The names behind the words that define something.
fn defined(code: &str) -> BTreeSet<String> {
    let words: Vec<&str> = code.split(|c| !is_of_word(c)).filter(|word| !word.is_empty()).collect();
    let defines = |word| {
        matches!(word, "struct" | "enum" | "fn" | "trait" | "const" | "type" | "static" | "macro_rules")
    };
    words.windows(2).filter(|pair| defines(pair[0])).map(|pair| pair[1].to_string()).collect()
}

fn read(path: &Path) -> Source {
    let inside = path.strip_prefix(root().join("src")).unwrap().with_extension("");
    let mut module: Segments = inside.iter().map(|s| s.to_str().unwrap().to_string()).collect();
    let is_parent = module.last().is_some_and(|last| last == "mod") || module == ["lib"];
    if is_parent {
        module.pop();
    }
    let text = std::fs::read_to_string(path).unwrap();
    let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    let code: Vec<&str> = text[..end].lines().map(|line| line.split("//").next().unwrap_or("")).collect();
    let code = code.join("\n");
    let (mut children, mut for_tests) = (BTreeSet::new(), BTreeSet::new());
    for statement in code.split(';') {
        let Some((before, name)) = statement.trim().rsplit_once("mod ") else { continue };
        if !name.chars().all(is_of_word) {
            continue;
        }
        children.insert(name.to_string());
        if before.trim_end().ends_with("#[cfg(test)]") {
            for_tests.insert([&module[..], &[name.to_string()]].concat());
        }
    }
    let (mut needs, mut leads, mut globs) = (BTreeSet::new(), BTreeMap::new(), Vec::new());
    let mut rest = String::new();
    for statement in code.split(';') {
        let is_word =
            |(at, _): &(usize, &str)| statement[..*at].chars().last().is_none_or(char::is_whitespace);
        let Some((at, _)) = statement.rmatch_indices("use ").find(is_word) else {
            rest.push_str(statement);
            rest.push(';');
            continue;
        };
        let (before, tree) = (&statement[..at], &statement[at + "use ".len()..]);
        rest.push_str(before);
        let is_public = before.lines().last().is_some_and(|line| line.trim_start().starts_with("pub"));
        for path in flat(tree) {
            let (path, alias) = path.split_once(" as ").unwrap_or((&path, ""));
            let Some(mut target) = absolute(path, &module, &children, &BTreeMap::new()) else { continue };
            if target.last().is_some_and(|last| last == "*") {
                target.pop();
                globs.push(target.clone());
            } else if let Some(last) = target.last() {
                let name = if alias.is_empty() { last.as_str() } else { alias.trim() };
                leads.insert(name.to_string(), target.clone());
            }
            if !(is_parent && is_public) {
                needs.insert(target);
            }
        }
    }
    needs.extend(paths(&rest).into_iter().filter_map(|path| absolute(path, &module, &children, &leads)));
    Source { module, needs, leads, globs, defines: defined(&rest), for_tests }
}

/// The file that a path leads to.
fn target(path: &[String], sources: &BTreeMap<Segments, Source>) -> Option<Segments> {
    let source = (0..=path.len()).rev().find_map(|length| sources.get(&path[..length]))?;
    let Some(name) = path.get(source.module.len()) else { return Some(source.module.clone()) };
    if let Some(behind) = source.leads.get(name) {
        return if behind == path { None } else { target(behind, sources) };
    }
    if source.defines.contains(name) {
        return Some(source.module.clone());
    }
    let behind = source
        .globs
        .iter()
        .filter_map(|glob| target(&[&glob[..], std::slice::from_ref(name)].concat(), sources));
    let mut defining = behind.filter(|file| sources[file].defines.contains(name));
    Some(defining.next().unwrap_or_else(|| source.module.clone()))
}

/// A way through `needs` that comes back to where it began.
fn circle(needs: &BTreeMap<Segments, BTreeSet<Segments>>) -> Option<Vec<String>> {
    for begin in needs.keys() {
        let mut ways = vec![vec![begin.clone()]];
        let mut seen = BTreeSet::new();
        while let Some(way) = ways.pop() {
            for next in &needs[&way[way.len() - 1]] {
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

/// What each file of `src` needs, as files. The crate's root and its program are left out: nobody needs them.
fn needs() -> BTreeMap<Segments, BTreeSet<Segments>> {
    let mut paths = Vec::new();
    files(&root().join("src"), &mut paths);
    let others = [root().join("src/bindings"), root().join("src/main.rs")];
    paths.retain(|path| !others.iter().any(|other| path.starts_with(other)));
    let mut sources: BTreeMap<Segments, Source> =
        paths.iter().map(|path| read(path)).map(|source| (source.module.clone(), source)).collect();
    let for_tests: BTreeSet<Segments> =
        sources.values().flat_map(|source| source.for_tests.clone()).collect();
    sources.retain(|module, _| !for_tests.contains(module));
    let needs_of = |source: &Source| {
        let targets = source.needs.iter().filter_map(|path| target(path, &sources));
        targets.filter(|file| !source.module.starts_with(file)).collect::<BTreeSet<_>>()
    };
    let mut needs: BTreeMap<Segments, BTreeSet<Segments>> =
        sources.iter().map(|(module, source)| (module.clone(), needs_of(source))).collect();
    needs.remove(&Segments::new());
    needs
}

#[test]
fn no_files_need_each_other_in_a_circle() {
    let needs = needs();
    // the test has understood the sources
    assert!(needs.values().map(BTreeSet::len).sum::<usize>() > 3 * needs.len());
    assert_eq!(circle(&needs), None);
}

#[test]
fn no_rooms_need_each_other_in_a_circle() {
    let mut rooms: BTreeMap<Segments, BTreeSet<Segments>> = BTreeMap::new();
    for (file, needed) in needs() {
        let others = needed.into_iter().map(|other| other[..1].to_vec()).filter(|other| *other != file[..1]);
        rooms.entry(file[..1].to_vec()).or_default().extend(others);
    }
    assert!(rooms.len() > 20);
    assert_eq!(circle(&rooms), None);
}

#[test]
fn paths_are_read_however_they_are_written() {
    let module = ["a", "b"].map(String::from);
    let children = BTreeSet::from(["child".to_string()]);
    let names = BTreeMap::from([("known".to_string(), vec!["x".to_string(), "y".to_string()])]);
    let check = |path: &str, expected: Option<&str>| {
        let found = absolute(path, &module, &children, &names).map(|segments| segments.join("::"));
        assert_eq!(found.as_deref(), expected, "{path}");
    };
    check("crate::c::D", Some("c::D"));
    check("self::child::D", Some("a::b::child::D"));
    check("child::D", Some("a::b::child::D"));
    check("super::c::self", Some("a::c"));
    check("super::super::c", Some("c"));
    check("known::D", Some("x::y::D"));
    check("std::fmt", None);
    assert_eq!(
        paths("let a: Vec<b::C> = crate::d::e(::f::g, h);"),
        BTreeSet::from(["b::C", "crate::d::e", "f::g"])
    );
}
