//! The shape of the source: who imports whom, where `unsafe` may stand, what every module begins with.

use std::path::{Path, PathBuf};

use crate::tool::root;

/// A module, and the modules of the crate that it may use besides itself; `*` is all.
///
/// Uses that need a reason: `field` uses `interval`, the type of a guaranteed range; `simplify`, `codegen`
/// and `solid` use `diagnostic` for the spans that nodes carry; `codegen` uses `geom` for the reach of range
/// programs; `lower` uses `geom` for the boxes of scenes, `sph` for the keys that its methods declare, and
/// `lettering` for the outlines of texts; `solid` uses `simplify`, because a gradient is derived and
/// simplified when it is first asked for; `compile` opens the file that `Program::from_path` names, and uses
/// `geom` for the box of a tolerance.
const MAY_USE: &[(&str, &[&str])] = &[
    ("diagnostic", &[]),
    ("geom", &[]),
    ("interval", &[]),
    ("precision", &[]),
    ("quantity", &[]),
    ("lettering", &[]),
    ("random", &[]),
    ("table", &["geom", "interval"]),
    ("heights", &["geom", "interval", "table"]),
    ("triangles", &["geom", "interval", "table"]),
    ("field", &["geom", "interval"]),
    ("files", &["table"]),
    ("syntax", &["diagnostic", "quantity"]),
    ("ir", &["diagnostic", "geom", "interval", "precision", "table"]),
    (
        "lower",
        &[
            "syntax",
            "ir",
            "diagnostic",
            "geom",
            "precision",
            "quantity",
            "sph",
            "files",
            "table",
            "triangles",
            "heights",
            "lettering",
            "random",
        ],
    ),
    ("simplify", &["ir", "diagnostic"]),
    ("codegen", &["ir", "diagnostic", "geom", "precision", "table"]),
    ("solid", &["diagnostic", "ir", "simplify", "codegen", "field", "geom", "interval", "precision"]),
    ("source", &["ir", "codegen", "precision", "solid"]),
    (
        "compile",
        &[
            "diagnostic",
            "files",
            "geom",
            "quantity",
            "syntax",
            "ir",
            "lower",
            "simplify",
            "codegen",
            "solid",
            "sph",
            "triangles",
        ],
    ),
    ("slice", &["field", "geom", "interval", "lettering"]),
    ("mesh", &["field", "geom", "interval", "random", "table", "triangles"]),
    ("fluid_surface", &["geom", "mesh"]),
    ("sph", &["field", "geom", "interval", "precision", "quantity"]),
    ("experiment", &["compile", "diagnostic", "field", "geom", "ir", "lower", "solid", "sph", "precision"]),
    ("render", &["field", "geom", "lettering"]),
    ("view", &["geom", "mesh"]),
    ("cli", &["*"]),
    ("lib", &["*"]),
    ("main", &["*"]),
];

/// Names that the crate's root re-exports, and the modules they come from.
const REEXPORTED: [(&str, &str); 7] = [
    ("Experiment", "experiment"),
    ("Program", "compile"),
    ("Error", "compile"),
    ("Solid", "solid"),
    ("Engine", "solid"),
    ("Field", "field"),
    ("Precision", "precision"),
];

fn sources() -> Vec<(PathBuf, String)> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.file_name().is_some_and(|name| name == "target") {
                continue; // what Cargo has built of the bindings
            }
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    let mut paths = Vec::new();
    for folder in ["src", "tests/it", "examples"] {
        walk(&root().join(folder), &mut paths);
    }
    paths.sort();
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).unwrap();
        (path.strip_prefix(root()).unwrap().to_path_buf(), text)
    };
    paths.into_iter().map(read).collect()
}

/// The top-level module of a file under src.
fn module(path: &Path) -> Option<String> {
    let inside = path.strip_prefix("src").ok()?;
    let first = inside.components().next()?.as_os_str().to_str()?;
    Some(first.trim_end_matches(".rs").to_string())
}

/// Whether a file belongs to one of the bindings. They are crates of their own, which see only what the
/// library makes public, and they stand at the edge of the program, as the command line does.
fn is_binding(path: &Path) -> bool {
    path.starts_with("src/bindings")
}

/// What a line of code names of the crate: `crate::a::…`, `use crate::{a::…, b};`.
fn uses(code: &str) -> Vec<String> {
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        match rest.strip_prefix('{') {
            None => found.push(word(rest)),
            Some(list) => {
                let mut depth = 0;
                let mut part = String::new();
                for c in list.chars() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => {
                            found.push(word(part.trim()));
                            part.clear();
                            continue;
                        }
                        _ => {}
                    }
                    part.push(c);
                }
                found.push(word(part.trim()));
            }
        }
    }
    found.retain(|name| !name.is_empty());
    found
}

/// The text without comments, and without the tests at its end, which may use more.
fn code(text: &str) -> String {
    let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    text[..end].lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

#[test]
fn modules_use_what_they_may() {
    let mut wrong = Vec::new();
    for (path, text) in sources() {
        let Some(module) = module(&path) else { continue };
        if path.ends_with("tests.rs") || is_binding(&path) {
            continue;
        }
        let allowed = MAY_USE.iter().find(|(name, _)| *name == module);
        let Some((_, allowed)) = allowed else { panic!("{}: not in the table", path.display()) };
        for used in uses(&code(&text)) {
            let target = REEXPORTED.iter().find(|(name, _)| *name == used).map_or(used.as_str(), |(_, m)| m);
            if target != module && !allowed.contains(&"*") && !allowed.contains(&target) {
                wrong.push(format!("{} uses {used}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_module_begins_with_what_it_is_for() {
    for (path, text) in sources() {
        assert!(text.starts_with("//! "), "{} has no header", path.display());
        assert!(
            !text.lines().any(|line| line.ends_with([' ', '\t'])),
            "{} has trailing blanks",
            path.display()
        );
        assert!(text.ends_with('\n') && !text.contains('\t') && !text.contains('\r'), "{}", path.display());
    }
}

#[test]
fn unsafe_stands_where_machine_code_and_the_memory_of_others_are_used() {
    for (path, text) in sources().into_iter().filter(|(path, _)| path.starts_with("src")) {
        let allowed = path.starts_with("src/codegen")
            || path == Path::new("src/solid/programs/compiled.rs")
            || ["memory", "evaluate", "collision", "state"]
                .iter()
                .any(|name| path == Path::new("src/bindings/python/src").join(name).with_extension("rs"))
            || path == Path::new("src/bindings/columns/src/memory.rs")
            || path.starts_with("src/bindings/c/src");
        let lines: Vec<&str> = text.lines().collect();
        for (i, line) in lines.iter().enumerate() {
            let code = line.split("//").next().unwrap_or("");
            if code.contains("unsafe {") || code.contains("unsafe fn") || code.contains("unsafe impl") {
                assert!(allowed, "{}:{}: unsafe", path.display(), i + 1);
                let said = lines[i.saturating_sub(6)..=i].iter().any(|l| l.contains("SAFETY:"));
                assert!(said, "{}:{}: no SAFETY sentence", path.display(), i + 1);
            }
        }
    }
}

#[test]
fn nothing_unfinished_is_left() {
    // put together here, so that this file does not find itself
    let words =
        [concat!("todo", "!("), concat!("unimplemented", "!("), concat!("dbg", "!("), concat!("FIX", "ME")];
    for (path, text) in sources() {
        for word in words {
            assert!(!text.contains(word), "{}: {word}", path.display());
        }
    }
}

#[test]
fn only_the_command_line_touches_files_clocks_and_the_terminal() {
    let words = ["std::fs", "std::env", "Instant::now", "SystemTime", "println!", "stdin()", "stdout()"];
    for (path, text) in sources() {
        let Some(module) = module(&path).filter(|_| !path.ends_with("tests.rs")) else { continue };
        if is_binding(&path) {
            continue;
        }
        let code = code(&text);
        for word in words.iter().filter(|word| code.contains(**word)) {
            // `Program::from_path` is the library's one door to the file system
            let door = module == "compile" && *word == "std::fs";
            assert!(["cli", "main"].contains(&module.as_str()) || door, "{}: {word}", path.display());
        }
    }
}
