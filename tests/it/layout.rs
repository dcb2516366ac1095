//! `rfm fmt`: the layout changes no value, is found at once, and leaves alone what is not understood.
//!
//! `RFM_PROGRAMS=10000 cargo test --test it layout` tries that number of random programs.

#[path = "layout/programs.rs"]
mod programs;

use std::path::Path;

use rfm::Program;
use rfm::diagnostic::Source;
use rfm::ir::dump;
use rfm::syntax::{Spelling, format, parse, print};

use crate::tool::{cases, rfm, rfm_reading, root};
use programs::program;

const SPELLINGS: [Spelling; 3] = [Spelling::Written, Spelling::Unicode, Spelling::Ascii];

/// Random programs that are tried if no number is stated.
const FEW: u64 = 300;

/// All that a program computes: the graph of each solid, and the scenes. `None` if the text has mistakes.
fn graphs(text: &str) -> Option<String> {
    let program = Program::from_source("p.rfm", text).ok()?;
    let module = program.module();
    let mut print = String::new();
    for solid in &module.solids {
        let (graph, roots) = module.graph.extract(&[solid.node]);
        print += &format!("{}\n{}", solid.name, dump(&graph, &[("omega", roots[0])], &[]));
    }
    for param in &module.params {
        print += &format!("{} {} {:?} {:?}\n", param.name, param.value, param.range, param.doc);
    }
    print +=
        &module.scenes.iter().map(|scene| format!("{} {:?}\n", scene.name, scene.domain)).collect::<String>();
    Some(print)
}

fn comments(text: &str) -> Vec<&str> {
    // no text of these files has a `#` but those of comments and the param's description
    let all = text
        .lines()
        .filter_map(|line| line.split_once("  # ").or(line.split_once("# ")).map(|(_, after)| after.trim()));
    all.filter(|comment| !comment.starts_with("no comment")).collect()
}

/// The layout in every spelling: it means the same, and its own layout is itself.
#[track_caller]
fn check(name: &str, text: &str) {
    let meaning = graphs(text);
    for spelling in SPELLINGS {
        let laid_out =
            format(&Source::file(name, text), spelling).unwrap_or_else(|e| panic!("{name}: {e:?}\n{text}"));
        let again = format(&Source::file(name, laid_out.as_str()), spelling).unwrap();
        assert_eq!(laid_out, again, "{name}, {spelling:?}, of\n{text}");
        assert_eq!(meaning, graphs(&laid_out), "{name}, {spelling:?}: {text}\n{laid_out}");
        assert!(laid_out.lines().all(|line| line.trim_end() == line), "{laid_out}");
    }
}

fn files(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rfm") {
            found.push(path);
        }
    }
}

#[test]
#[ignore = "long"]
fn every_file_here_keeps_its_meaning() {
    let mut paths = Vec::new();
    for folder in ["examples", "tests/cases", "src/lower", "src/cli/init", "tests/peers"] {
        files(&root().join(folder), &mut paths);
    }
    let mut laid_out = 0;
    for path in paths {
        let text = std::fs::read_to_string(&path).unwrap();
        let name = path.display().to_string();
        let (_, messages) = parse(&Source::file(name.as_str(), text.as_str()));
        let fits = messages.iter().all(|m| m.severity != rfm::diagnostic::Severity::Error);
        if fits {
            check(&name, &text);
            laid_out += 1;
        } else if !text.trim().is_empty() && messages[0].code != rfm::diagnostic::Code::EMPTY_FILE {
            assert!(
                format(&Source::file(name.as_str(), text.as_str()), Spelling::Written).is_err(),
                "{name}"
            );
        }
    }
    assert!(laid_out > 150, "{laid_out}");
}

#[test]
fn every_example_is_laid_out() {
    let mut paths = Vec::new();
    for folder in ["examples", "src/lower", "src/cli/init"] {
        files(&root().join(folder), &mut paths);
    }
    for path in paths {
        let text = std::fs::read_to_string(&path).unwrap();
        let laid_out = format(&Source::file("e.rfm", text.as_str()), Spelling::Written).unwrap();
        assert_eq!(text, laid_out, "run `rfm fmt {}`", path.strip_prefix(root()).unwrap().display());
    }
}

#[test]
#[ignore = "long"]
fn random_programs_keep_their_meaning_and_their_comments() {
    let count = std::env::var("RFM_PROGRAMS").ok().map_or(FEW, |n| n.parse().unwrap());
    let (mut compiled, mut commented) = (0, 0);
    for seed in 0..count {
        let text = program(seed);
        check(&format!("program {seed}"), &text);
        let laid_out = format(&Source::file("p.rfm", text.as_str()), Spelling::Written).unwrap();
        assert_eq!(comments(&text), comments(&laid_out), "{text}\n{laid_out}");
        compiled += u64::from(graphs(&text).is_some());
        commented += u64::from(!comments(&text).is_empty());
    }
    assert!(compiled * 4 > count && commented * 2 > count, "{compiled} and {commented} of {count}");
}

#[test]
fn a_spelling_can_be_changed_and_changed_back() {
    let text = "rfm 1\nsolid s = not x^2 <= 1 and y^3 >= z or x \\ y²²^-z\n";
    let signs = format(&Source::file("s.rfm", text), Spelling::Unicode).unwrap();
    assert_eq!(signs, "rfm 1\nsolid s = ¬x² ≤ 1 ∧ y³ ≥ z ∨ x ∖ y²²^-z\n");
    let words = format(&Source::file("s.rfm", signs.as_str()), Spelling::Ascii).unwrap();
    assert!(words.is_ascii(), "{words}");
    let tree = |text: &str| print(&parse(&Source::file("s.rfm", text)).0);
    assert_eq!(tree(&words), tree(text));
}

#[test]
fn files_are_written_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let read = |name: &str| std::fs::read_to_string(path(name)).unwrap();
    std::fs::write(path("a.rfm"), "rfm 1\nsolid  a=sphere( 1 )").unwrap();
    std::fs::write(path("bad.rfm"), "rfm 1\nsolid b = = 1").unwrap();
    std::fs::write(path("good.rfm"), "rfm 1\nsolid c = x\n").unwrap();

    let outcome = rfm(folder.path(), &["fmt", "--check", "a.rfm", "good.rfm"]).expect(1);
    assert_eq!(outcome.stdout, "a.rfm\n");
    let outcome = rfm(folder.path(), &["fmt", "--diff", "a.rfm"]).expect(1);
    assert!(outcome.stdout.contains("\n-solid  a=sphere( 1 )\n"), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("\n+solid a = sphere(1)\n"), "{}", outcome.stdout);
    assert_eq!(read("a.rfm"), "rfm 1\nsolid  a=sphere( 1 )");

    let outcome = rfm(folder.path(), &["fmt", "bad.rfm", "a.rfm"]).expect(1);
    assert!(
        outcome.stderr.contains("error[E01") && outcome.stderr.contains("bad.rfm:2:"),
        "{}",
        outcome.stderr
    );
    assert_eq!(
        (read("a.rfm").as_str(), read("bad.rfm").as_str()),
        ("rfm 1\nsolid a = sphere(1)\n", "rfm 1\nsolid b = = 1")
    );
    rfm(folder.path(), &["fmt", "--check", "a.rfm", "good.rfm"]).expect(0);
    rfm(folder.path(), &["fmt", "a.rfm", "missing.rfm"]).expect(2);
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names.len(), 3, "{names:?}");

    let outcome = rfm_reading(folder.path(), &["fmt", "--unicode", "-"], b"rfm 1\nlet a=x^2").expect(0);
    assert_eq!(outcome.stdout, "rfm 1\nlet a = x²\n");
    let document = rfm(folder.path(), &["fmt", "--check", "--json", "a.rfm"]).expect(0).json();
    assert_eq!(document["files"][0]["changed"], false);
}

#[cfg(unix)]
#[test]
fn links_and_permissions_stay() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("a.rfm"), folder.path().join("link.rfm"));
    std::fs::write(&file, "rfm 1\nlet a=1").unwrap();
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o640)).unwrap();
    std::os::unix::fs::symlink("a.rfm", &link).unwrap();
    rfm(folder.path(), &["fmt", "link.rfm"]).expect(0);
    assert!(link.is_symlink());
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "rfm 1\nlet a = 1\n");
    assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o640);
}

#[test]
fn no_prefix_of_a_file_is_too_much() {
    for name in ["examples/pawn.rfm", "tests/cases/stages/scene.rfm"] {
        let text = std::fs::read_to_string(root().join(name)).unwrap();
        for (at, _) in text.char_indices() {
            if let Ok(laid_out) = format(&Source::file("p.rfm", &text[..at]), Spelling::Written) {
                let again = format(&Source::file("p.rfm", laid_out.as_str()), Spelling::Written).unwrap();
                assert_eq!(laid_out, again);
            }
        }
    }
    assert!(!cases("stages").is_empty());
}
