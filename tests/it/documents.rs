//! The documents beside the code: what they show is accepted, and what they link to is there.

use crate::tool::{rfm, rfm_reading, root};

const DOCUMENTS: [&str; 14] = [
    "README.md",
    "CHANGELOG.md",
    "grammar/README.md",
    "grammar/words.md",
    "grammar/outputs.md",
    "examples/README.md",
    "examples/lammps/README.md",
    "examples/validation/README.md",
    "tests/bench/README.md",
    "tests/peers/README.md",
    "tests/viewer/README.md",
    "src/sph/methods/README.md",
    "src/bindings/python/README.md",
    "src/bindings/c/README.md",
];

fn text(document: &str) -> String {
    std::fs::read_to_string(root().join(document)).unwrap_or_else(|e| panic!("{document}: {e}"))
}

/// The page of words.
const WORDS: &str = "grammar/README.md";

fn rfm_blocks(document: &str) -> Vec<String> {
    let blocks = |text: String| -> Vec<String> {
        text.split("```rfm\n").skip(1).map(|part| part.split_once("```").unwrap().0.to_string()).collect()
    };
    blocks(text(document))
}

/// Blends and shells take `rfm check` minutes to measure, so the solids on the page of words are compiled and
/// looked at here: without a warning, with bounds, and with an inside.
#[test]
fn every_block_of_the_page_of_words_makes_solids() {
    let blocks = rfm_blocks(WORDS);
    assert!(blocks.len() >= 6 && !text(WORDS).contains("```text\nrfm"), "{}", blocks.len());
    for block in blocks {
        let path = root().join("page.rfm");
        let source = rfm::diagnostic::Source::file(path.display().to_string(), block.as_str());
        let files = rfm::compile::files_beside(&path, false);
        let program = rfm::Program::check(source, rfm::lower::Options { files, ..Default::default() });
        let program = program.unwrap_or_else(|e| panic!("{:?}", e.list));
        assert_eq!(program.warnings().list, [], "{block}");
        assert!(!program.module().solids.is_empty(), "{block}");
        for named in &program.module().solids {
            let solid = program.solid(&named.name).unwrap();
            let bounds = solid.bounds().aabb().unwrap_or_else(|| panic!("{} has no bounds", named.name));
            let place = |i: u32| {
                let cell = |n: u32| (f64::from(n % 40) + 0.5) / 40.0;
                bounds.min + bounds.size() * rfm::glam::DVec3::new(cell(i), cell(i / 40), cell(i / 1600))
            };
            assert!((0..64_000).any(|i| solid.omega(place(i)) > 0.0), "{} is empty", named.name);
        }
    }
}

#[test]
fn every_rfm_block_checks_without_a_word() {
    let mut blocks = 0;
    for document in DOCUMENTS.into_iter().filter(|document| *document != WORDS) {
        for block in rfm_blocks(document) {
            let outcome =
                rfm_reading(root(), &["check", "--deny", "warnings", "-"], block.as_bytes()).expect(0);
            assert_eq!(outcome.stderr, "", "{document}: {block}");
            blocks += 1;
        }
    }
    assert!(blocks >= 5, "{blocks}");
}

/// The commands that a document shows, in its order and each once.
fn commands(document: &str) -> Vec<String> {
    let text = text(document);
    let mut commands: Vec<String> = Vec::new();
    let in_line = text.split('`').filter(|part| part.starts_with("rfm "));
    let in_blocks = text.split("```sh\n").skip(1).flat_map(|part| part.split("```").next().unwrap().lines());
    for command in in_blocks.filter(|line| line.starts_with("rfm ")).chain(in_line) {
        let command = command.split(" #").next().unwrap().trim();
        // words in capitals stand for what the reader has
        let is_pattern = command
            .split([' ', ':'])
            .any(|word| word.len() > 2 && word.chars().all(|c| c.is_ascii_uppercase()));
        let is_command = !command.contains('\n') && command.split(' ').count() > 2;
        if is_command && !is_pattern && !commands.iter().any(|known| known == command) {
            commands.push(command.to_string());
        }
    }
    commands
}

/// The examples in a folder, with few particles: what is tested is that the commands are right, not that they are slow.
fn small_examples(folder: &std::path::Path) {
    std::fs::create_dir_all(folder.join("examples/validation")).unwrap();
    for part in ["examples", "examples/validation"] {
        for entry in std::fs::read_dir(root().join(part)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "rfm") {
                let text = std::fs::read_to_string(&path).unwrap();
                let text = text
                    .replace("particles: particles", "particles: particles/50")
                    .replace("mass: 200/particles", "mass: 10000/particles")
                    .replace("(10000/particles)^(1/3)", "(500000/particles)^(1/3)")
                    .replace("until: 5 s", "until: 0.5 s")
                    .replace("until: 2 s", "until: 0.2 s")
                    .replace("from: 1.5 s", "from: 0.1 s");
                std::fs::write(folder.join(part).join(path.file_name().unwrap()), text).unwrap();
            }
        }
    }
}

/// Commands that take long at their usual sizes, by their beginnings, and the options that make them short.
const SHORTER: [(&str, &str); 2] = [
    ("rfm mesh examples/pawn.rfm --simplify", "--cells 48"),
    ("rfm report examples/pawn.rfm", "--mesh-cells 32"),
];

#[test]
#[ignore = "long"]
fn every_command_of_the_first_page_works() {
    let folder = tempfile::tempdir().unwrap();
    small_examples(folder.path());
    let commands = commands("README.md");
    assert!(commands.len() >= 18, "{commands:#?}");
    for (beginning, _) in SHORTER {
        assert!(commands.iter().any(|command| command.starts_with(beginning)), "{beginning}");
    }
    for command in commands {
        let shorter = SHORTER.iter().filter(|(beginning, _)| command.starts_with(beginning));
        let more = shorter.flat_map(|(_, options)| options.split(' '));
        let arguments: Vec<&str> = command.split(' ').skip(1).chain(more).collect();
        let outcome = rfm(folder.path(), &arguments);
        assert_eq!(outcome.code, 0, "{command}\n{}{}", outcome.stdout, outcome.stderr);
        assert!(!outcome.stdout.is_empty(), "{command} prints nothing");
    }
}

#[test]
fn every_local_link_leads_to_a_file() {
    for document in DOCUMENTS {
        let folder = root().join(document);
        let folder = folder.parent().unwrap();
        for part in text(document).split("](").skip(1) {
            let (link, _) = part.split_once(')').unwrap();
            let (path, _) = link.split_once('#').unwrap_or((link, ""));
            let remote = link.starts_with("https://");
            assert!(remote || path.is_empty() || folder.join(path).exists(), "{document}: {link}");
        }
    }
}

#[test]
fn every_example_is_in_the_gallery() {
    let gallery = text("examples/README.md");
    for folder in ["examples", "examples/validation"] {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "rfm" || ending == "rs") {
                let name = path.strip_prefix(root().join("examples")).unwrap().display().to_string();
                assert!(gallery.contains(&format!("]({name})")), "{name}");
            }
        }
    }
}

/// What `examples/pictures/make` makes are the pictures of the gallery, each with the command that stands beside it.
#[test]
fn one_script_makes_every_picture_of_the_gallery() {
    let (gallery, script) = (text("examples/README.md"), text("examples/pictures/make"));
    let mut made: Vec<String> = script
        .lines()
        .filter_map(|line| {
            let mut words = line.split(' ');
            match (words.next()?, words.next()?) {
                ("section", name) => Some(format!("{name}-slice.png")),
                ("flow", name) if !name.contains('$') => Some(format!("{name}.png")),
                ("view", name) => Some(format!("{name}.png")),
                ("truth", name) => Some(format!("validation/{name}.png")),
                _ => None,
            }
        })
        .collect();
    made.push("pawn-film.gif".into());
    let shown = gallery.split("](pictures/").skip(1).filter_map(|part| Some(part.split_once(')')?.0));
    let mut shown: Vec<&str> = shown.filter(|name| name.contains('.')).collect();
    made.sort();
    shown.sort_unstable();
    assert_eq!(made, shown);
    for line in script.lines() {
        if let Some(call) = line.strip_prefix("section ") {
            let (_, call) = call.split_once(' ').unwrap();
            assert!(
                gallery.contains(&format!("`rfm check examples/{call} ")) || call.contains("validation"),
                "{call}"
            );
        }
    }
}

#[test]
fn the_first_page_stays_short() {
    let lines = text("README.md").lines().count();
    assert!(lines <= 300, "{lines} lines");
}

#[test]
fn the_words_are_listed_as_they_are_declared() {
    let page = rfm(root(), &["explain", "words"]).expect(0).stdout;
    assert_eq!(page, text("grammar/words.md"), "write the output of `rfm explain words` there");
    let one = rfm(root(), &["explain", "twist"]).expect(0).stdout;
    assert!(one.starts_with("- `twist(shape, turns)`: ") && one.contains("`shape.twist(turns)`"), "{one}");
    let unknown = rfm(root(), &["explain", "twisst"]).expect(2);
    assert!(unknown.stderr.contains("did you mean `twist`?"), "{}", unknown.stderr);
}

#[test]
fn what_a_run_writes_is_listed_as_it_is_described() {
    let page = rfm(root(), &["explain", "outputs"]).expect(0).stdout;
    assert_eq!(page, text("grammar/outputs.md"), "write the output of `rfm explain outputs` there");
    let one = rfm(root(), &["explain", "energy_excess"]).expect(0).stdout;
    assert!(one.starts_with("- `energy_excess` (part of the greatest energy): "), "{one}");
}

#[test]
fn the_methods_are_described_as_they_are_declared() {
    let page = rfm(root(), &["explain", "--methods"]).expect(0).stdout;
    assert_eq!(page, text("src/sph/methods/README.md"), "write the output of `rfm explain --methods` there");
    let readme = text("README.md");
    for line in rfm::sph::methods_overview().lines() {
        assert!(readme.contains(line), "README lacks: {line}");
    }
}
