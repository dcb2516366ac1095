//! What editors know of the language: the words of their grammars are those of the one grammar, and every
//! example is read by all that read files here.

use std::collections::BTreeSet;

use rfm::diagnostic::Source;
use rfm::syntax::ast::{Entry, Item};
use rfm::syntax::{KEYWORDS, Spelling, format, parse};
use serde_json::Value;

use crate::tool::root;

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

fn words(list: &str) -> BTreeSet<String> {
    let quoted = list.split('"').skip(1).step_by(2).map(String::from);
    quoted.filter(|word| !word.is_empty()).collect()
}

/// The words in quotes of a rule of the grammar.
fn rule(name: &str) -> BTreeSet<String> {
    let grammar = read("grammar/rfm.pest");
    let start = grammar.find(&format!("\n{name} ")).unwrap_or_else(|| panic!("no rule {name}"));
    let body = &grammar[start + 1..];
    words(&body[..body.find('}').unwrap()])
}

fn text_mate() -> Value {
    serde_json::from_str(&read("grammar/vscode/syntaxes/rfm.tmLanguage.json")).unwrap()
}

/// The words that a pattern of the TextMate grammar lists in its first brackets with bars.
fn alternatives(pattern: &str, holding: &str) -> BTreeSet<String> {
    let groups = pattern.split('(').map(|part| part.split(')').next().unwrap().trim_start_matches("?:"));
    let found = groups.map(|group| group.split('|').map(String::from).collect::<BTreeSet<_>>());
    found
        .into_iter()
        .find(|words| words.contains(holding))
        .unwrap_or_else(|| panic!("no {holding} in {pattern}"))
}

#[test]
fn the_colours_know_the_words_of_the_grammar() {
    let grammar = text_mate();
    let rules = &grammar["repository"];
    let pattern = |rule: &Value| rule["match"].as_str().unwrap().to_string();
    assert_eq!(alternatives(&pattern(&rules["quantity"]), "kPa"), rule("unit_word"), "units");
    let operators = pattern(&rules["operator"]["patterns"][0]);
    let folds = rule("fold_word");
    assert_eq!(alternatives(&operators, "any"), folds, "folds");
    let fold = rules["fold"]["begin"].as_str().unwrap();
    assert_eq!(alternatives(fold, "any"), folds, "folds with their colons");
    let items = alternatives(&pattern(&rules["item"]), "param");
    let all: BTreeSet<String> = KEYWORDS.iter().map(ToString::to_string).collect();
    let known: BTreeSet<String> =
        items.union(&alternatives(&operators, "and")).chain(&folds).cloned().collect();
    assert!(all.is_subset(&known), "{:?}", all.difference(&known).collect::<Vec<_>>());
    assert_eq!(all, rule("keyword"));
}

/// All regular expressions of a grammar.
fn patterns(rule: &Value) -> Vec<&str> {
    let own = ["match", "begin", "end"].into_iter().filter_map(|key| rule[key].as_str());
    let within = rule.as_object().into_iter().flat_map(|rule| rule.values());
    let within = within.chain(rule.as_array().into_iter().flatten());
    own.chain(within.flat_map(patterns)).collect()
}

#[test]
fn colours_end_where_words_do() {
    let grammar = text_mate();
    // `²` is a letter to `\b`, and the x of x² would end nowhere
    let with_b: Vec<&str> =
        patterns(&grammar).into_iter().filter(|pattern| pattern.contains("\\b")).collect();
    assert!(with_b.is_empty(), "{with_b:?}");
    let order: Vec<&str> = grammar["patterns"]
        .as_array()
        .unwrap()
        .iter()
        .map(|rule| rule["include"].as_str().unwrap())
        .collect();
    let place = |rule: &str| order.iter().position(|name| *name == rule).unwrap_or_else(|| panic!("{rule}"));
    // the n of `any i in 0..n : e` is no key, and the name of a block no call
    assert!(place("#fold") < place("#key") && place("#fold") < place("#operator"));
    assert!(place("#import") < place("#item") && place("#block") < place("#key"));
    let within_folds = &grammar["repository"]["value"]["patterns"];
    assert!(!within_folds.to_string().contains("#key"), "{within_folds}");
    let words = alternatives(grammar["repository"]["import"]["match"].as_str().unwrap(), "as");
    assert_eq!(words, BTreeSet::from(["as".to_string()]));
}

/// The names of all blocks in some entries.
fn blocks(entries: &[Entry], found: &mut BTreeSet<String>) {
    for entry in entries {
        if let Entry::Block { key, entries, .. } = entry {
            found.insert(key.text.clone());
            blocks(entries, found);
        }
    }
}

#[test]
fn the_colours_know_the_blocks_of_scenes() {
    let coloured = alternatives(text_mate()["repository"]["block"]["match"].as_str().unwrap(), "obstacle");
    let mut written = BTreeSet::new();
    for folder in ["examples", "examples/validation", "tests/cases/stages"] {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "rfm") {
                let text = std::fs::read_to_string(&path).unwrap();
                for item in parse(&Source::file("e.rfm", text.as_str())).0.items {
                    if let Item::Scene(scene) = item {
                        blocks(&scene.entries, &mut written);
                    }
                }
            }
        }
    }
    assert!(written.len() > 5 && written.is_subset(&coloured), "{written:?}");
    // each of them has keys of its own
    let method = rfm::sph::Method::default();
    for block in coloured {
        assert!(!rfm::lower::vocabulary::keys(Some(&block), method).is_empty(), "{block}");
    }
}

/// VS Code gives a pattern its flags only if it is written with them; without `u`, `\p{L}` is the letters p and L.
#[test]
fn patterns_of_words_have_their_flags() {
    let text = read("grammar/vscode/language-configuration.json");
    let configuration: Value = serde_json::from_str(&text).unwrap();
    let word = &configuration["wordPattern"];
    assert_eq!(word["pattern"], r"[\p{L}_][\p{L}0-9_]*");
    assert_eq!(word["flags"], "u");
    assert_eq!(text.matches(r"\\p{").count(), 2, "no other pattern needs flags");
    // comments and texts in quotes do not count as brackets
    let indented = configuration["indentationRules"]["increaseIndentPattern"].as_str().unwrap();
    assert!(indented.starts_with(r##"^(?:[^"#/]|"[^"]*"|/(?!/))*[{\[(]"##), "{indented}");
    assert!(indented.ends_with(r"(?:(?:#|//).*)?$"), "{indented}");
}

#[test]
fn the_extension_names_files_that_are_there() {
    let package: Value = serde_json::from_str(&read("grammar/vscode/package.json")).unwrap();
    let contributes = &package["contributes"];
    let configuration = contributes["languages"][0]["configuration"].as_str().unwrap();
    for file in [
        package["main"].as_str().unwrap(),
        configuration,
        contributes["grammars"][0]["path"].as_str().unwrap(),
    ] {
        assert!(root().join("grammar/vscode").join(file).exists(), "{file}");
    }
    let _: Value = serde_json::from_str(&read("grammar/vscode/language-configuration.json")).unwrap();
    let script = read("grammar/vscode/extension.js");
    for command in contributes["commands"].as_array().unwrap() {
        let name = command["command"].as_str().unwrap();
        assert!(script.contains(&format!("registerCommand(\"{name}\"")), "{name}");
    }
    assert_eq!(package["version"], env!("CARGO_PKG_VERSION"));
}

#[test]
fn the_installed_library_has_the_version_of_the_program() {
    let version = env!("CARGO_PKG_VERSION");
    assert!(read("src/bindings/c/package/rfm.pc").contains(&format!("\nVersion: {version}\n")));
    let config = read("src/bindings/c/package/rfmConfigVersion.cmake");
    assert!(config.contains(&format!("set(PACKAGE_VERSION {version})")));
}

#[test]
fn every_example_is_read_by_all() {
    let mut examples = 0;
    for folder in ["examples", "examples/validation"] {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "rfm") {
                let text = std::fs::read_to_string(&path).unwrap();
                let source = Source::file("e.rfm", text.as_str());
                let (ast, messages) = parse(&source);
                assert!(messages.is_empty() && !ast.items.is_empty(), "{}", path.display());
                assert_eq!(format(&source, Spelling::Written).unwrap(), text, "{}", path.display());
                examples += 1;
            }
        }
    }
    assert!(examples > 25, "{examples}");
}

#[test]
fn tree_sitter_knows_the_words_of_the_grammar() {
    let script = read("grammar/tree-sitter-rfm/grammar.js");
    let list = |name: &str| {
        let start = script.find(&format!("const {name} = [")).unwrap_or_else(|| panic!("no {name}"));
        words(&script[start..start + script[start..].find("];").unwrap()])
    };
    assert_eq!(list("UNITS"), rule("unit_word"), "units");
    assert_eq!(list("FOLDS"), rule("fold_word"), "folds");
    let keywords = rule("keyword");
    assert!(list("ITEMS").iter().all(|item| keywords.contains(item)));
    for operators in
        ["or_op", "and_op", "minus_op", "compare_op", "add_op", "mul_op", "sign_op", "superscript"]
    {
        for operator in rule(operators) {
            let quoted = format!("\"{operator}\"");
            assert!(script.contains(&quoted), "{operators}: {quoted}");
        }
    }
    let queries = read("grammar/tree-sitter-rfm/queries/highlights.scm");
    for word in list("UNITS").iter().chain(&list("ITEMS")).chain(&list("FOLDS")) {
        let quoted = queries.contains(&format!("\"{word}\""));
        assert!(quoted || list("UNITS").contains(word), "{word} has no colour");
    }
}
