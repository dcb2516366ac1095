//! The documents beside the code: what they show is accepted, and what they link to is there.

use crate::tool::{rfm, rfm_reading, root};

const DOCUMENTS: [&str; 9] = [
    "README.md",
    "CHANGELOG.md",
    "examples/README.md",
    "examples/validation/README.md",
    "tests/bench/README.md",
    "tests/peers/README.md",
    "src/sph/methods/README.md",
    "src/bindings/python/README.md",
    "src/bindings/c/README.md",
];

fn text(document: &str) -> String {
    std::fs::read_to_string(root().join(document)).unwrap_or_else(|e| panic!("{document}: {e}"))
}

#[test]
fn every_rfm_block_checks_without_a_word() {
    let mut blocks = 0;
    for document in DOCUMENTS {
        for part in text(document).split("```rfm\n").skip(1) {
            let (block, _) = part.split_once("```").unwrap();
            let outcome =
                rfm_reading(root(), &["check", "--deny", "warnings", "-"], block.as_bytes()).expect(0);
            assert_eq!(outcome.stderr, "", "{document}: {block}");
            blocks += 1;
        }
    }
    assert!(blocks >= 5, "{blocks}");
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

#[test]
fn the_first_page_stays_short() {
    let lines = text("README.md").lines().count();
    assert!(lines <= 300, "{lines} lines");
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
