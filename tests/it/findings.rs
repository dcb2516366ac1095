//! Messages of `rfm check` for other programs, what is denied, and fixes.

use crate::tool::{Outcome, rfm, rfm_reading, root};

const TEXT: &str =
    "let α = 1\nsolid s = x < 1 and 0 <= x <= 1 and 0 <= y <= 1 and 0 <= z <= 1\nsolid q = spere(1)\n";
const ODD: &str = "solid s = x < 1 and 0 <= x <= 1 and 0 <= y <= 1 and 0 <= z <= 1\n";

fn check(arguments: &[&str], text: &str) -> Outcome {
    let all: Vec<&str> = ["check", "-"].iter().chain(arguments).copied().collect();
    rfm_reading(root(), &all, text.as_bytes())
}

#[test]
fn messages_have_a_form_for_each_reader() {
    let short = check(&["--message-format", "short"], TEXT).expect(1);
    assert_eq!(
        short.stdout,
        "<stdin>:1:1: warning[W0002]: the first line does not say `rfm 1`\n\
         <stdin>:2:13: warning[W0405]: `<` means the same as `<=` here\n\
         <stdin>:3:11: error[E0201]: unknown function or shape `spere`\n"
    );
    assert_eq!(short.stderr, "");

    let lines = check(&["--message-format", "json"], TEXT).expect(1).stdout;
    let messages: Vec<serde_json::Value> =
        lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(messages.len(), 3);
    assert_eq!(messages[1]["fix"]["replacement"], "<=");
    assert_eq!((&messages[1]["fix"]["safe"], &messages[2]["fix"]["safe"]), (&true.into(), &false.into()));
    assert_eq!(messages[2]["fix"]["replacement"], "sphere");

    let github = check(&["--message-format", "github"], TEXT).expect(1).stdout;
    let last = github.lines().last().unwrap();
    assert_eq!(
        last,
        "::error file=<stdin>,line=3,endLine=3,col=11,endColumn=16,title=E0201::unknown function or shape `spere`%0Adid you mean `sphere`?"
    );

    let sarif = check(&["--message-format", "sarif"], TEXT).expect(1).json();
    assert_eq!(sarif["version"], "2.1.0");
    let run = &sarif["runs"][0];
    assert_eq!(run["results"].as_array().unwrap().len(), 3);
    let rules: Vec<&str> = run["tool"]["driver"]["rules"]
        .as_array()
        .unwrap()
        .iter()
        .map(|rule| rule["id"].as_str().unwrap())
        .collect();
    assert_eq!(rules, ["E0201", "W0002", "W0405"]);
    assert!(
        run["tool"]["driver"]["rules"][2]["fullDescription"]["text"].as_str().unwrap().contains("comparison")
    );
    let result = &run["results"][1];
    assert_eq!((&result["ruleId"], &result["level"]), (&"W0405".into(), &"warning".into()));
    let region = &result["locations"][0]["physicalLocation"]["region"];
    assert_eq!(
        (&region["startLine"], &region["startColumn"], &region["endColumn"]),
        (&2.into(), &13.into(), &14.into())
    );
    let replaced = &result["fixes"][0]["artifactChanges"][0]["replacements"][0];
    assert_eq!(replaced["insertedContent"]["text"], "<=");

    // a file without findings is an empty document
    let none = check(&["--message-format", "sarif"], "rfm 1\nsolid s = box()\n").expect(0).json();
    assert_eq!(none["runs"][0]["results"].as_array().unwrap().len(), 0);
}

#[test]
fn warnings_are_denied_all_or_by_their_code() {
    check(&[], ODD).expect(0);
    check(&["--deny", "warnings"], ODD).expect(1);
    check(&["--deny", "W0405"], ODD).expect(1);
    check(&["--deny", "w0401", "--deny", "w0002"], ODD).expect(1);
    check(&["--deny", "W0401", "--deny", "W0402"], ODD).expect(0);
    let refused = check(&["--deny", "W9999"], ODD).expect(2);
    assert!(refused.stderr.contains("a code such as W0401"), "{}", refused.stderr);
}

#[test]
fn safe_fixes_are_applied_and_others_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.rfm");
    std::fs::write(&path, TEXT).unwrap();
    let outcome = rfm(folder.path(), &["check", "--fix", "a.rfm"]).expect(1);
    assert!(outcome.stderr.contains("a.rfm: 2 fixes applied"), "{}", outcome.stderr);
    let fixed = std::fs::read_to_string(&path).unwrap();
    assert_eq!(fixed, format!("rfm 1\n{}", TEXT.replace("x < 1", "x <= 1")));
    // what is left is not safe: nothing changes again
    rfm(folder.path(), &["check", "--fix", "a.rfm"]).expect(1);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), fixed);
    check(&["--fix"], TEXT).expect(2);
}
