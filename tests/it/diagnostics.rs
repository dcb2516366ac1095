//! One mistake per file, with its message as a person reads it.

use std::collections::BTreeSet;

use crate::tool::{cases, rfm, root, snapshot, stem};

const FOLDERS: [&str; 6] =
    ["parse_error", "name_error", "type_error", "range_error", "scene_error", "file_error"];

/// Codes that no file can raise by itself: for files of more than 256 MiB, for flags of the command line, for a
/// machine without room, for what the audit of a run finds, and for what --resume misses.
const NOT_OF_A_FILE: [&str; 13] = [
    "E0103", "E0211", "E0219", "E0220", "W0214", "W0413", "W0414", "W0506", "W0511", "W0512", "W0513",
    "W0517", "W0527",
];

/// What a person who runs the file sees: `check`, and for a scene that passes it, the start of a run.
fn messages(path: &str) -> String {
    let folder = root().join("tests/cases");
    let mut outcome = rfm(&folder, &["check", path]);
    if outcome.code == 0 && outcome.stderr.is_empty() {
        outcome = rfm(&folder, &["run", "--dry-run", "--threads", "1", path]);
    }
    assert!(!outcome.stderr.is_empty(), "{path} has no mistake");
    // 3: the first steps of the run show already that it fails
    assert!([0, 1, 3].contains(&outcome.code), "{path}: exit {}\n{}", outcome.code, outcome.stderr);
    assert!(!outcome.stderr.contains('\x1b'), "{path}: escape codes in a pipe");
    format!("{}\nexit {}\n", outcome.stderr, outcome.code)
}

#[test]
fn every_mistake_has_its_message() {
    let mut raised = BTreeSet::new();
    for folder in FOLDERS {
        for path in cases(folder) {
            let relative = format!("{folder}/{}.rfm", stem(&path));
            let text = messages(&relative);
            let codes = text.split('[').skip(1).filter_map(|rest| rest.split_once("]: "));
            raised.extend(codes.map(|(code, _)| code.to_string()));
            snapshot(&format!("diagnostics/{folder}"), stem(&path), &text);
        }
    }
    let missing: Vec<String> =
        codes().into_iter().filter(|c| !raised.contains(c) && !NOT_OF_A_FILE.contains(&c.as_str())).collect();
    assert!(missing.is_empty(), "no case raises {missing:?}");
}

/// All codes, read from the table's source: the table itself is private.
fn codes() -> Vec<String> {
    let text = std::fs::read_to_string(root().join("src/diagnostic/codes.rs")).unwrap();
    let codes: Vec<String> = text
        .lines()
        .filter_map(|line| line.split_once(" = \"")?.1.strip_suffix("\":"))
        .map(String::from)
        .collect();
    assert!(codes.len() > 25, "{codes:?}");
    codes
}

#[test]
fn every_code_is_explained() {
    for code in codes() {
        let outcome = rfm(root(), &["explain", &code]).expect(0);
        assert!(outcome.stdout.starts_with(&code) && outcome.stdout.len() > 40, "{}", outcome.stdout);
        assert_eq!(rfm(root(), &["explain", &code.to_lowercase()]).expect(0).stdout, outcome.stdout);
    }
}

#[test]
fn no_two_codes_are_equal() {
    let all = codes();
    assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), all.len());
}
