//! Input that no person would write, or that a person wrote by mistake, gets a clear message, never a panic
//! or a hang.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rfm::Program;

use crate::tool::{rfm, rfm_reading, root};

/// What `rfm check -` says of it, with one of the documented exit codes.
#[track_caller]
fn check(text: impl AsRef<[u8]>, code: i32, says: &str) {
    let outcome = rfm_reading(root(), &["check", "-"], text.as_ref()).expect(code);
    assert!(outcome.stderr.contains(says), "expected `{says}` in:\n{}", outcome.stderr);
    assert!(outcome.stderr.len() < 100_000, "{} bytes of messages", outcome.stderr.len());
}

fn solid(expression: &str) -> String {
    format!("rfm 1\nsolid s = {expression}\n")
}

#[test]
fn not_a_text() {
    check([0xff, 0xc0, 0x00, 0x41], 2, "not a UTF-8 text (byte 0 ");
    check([0xff, 0xfe, 0x41, 0x00], 2, "it is a UTF-16 text: save it as UTF-8");
    check([0xfe, 0xff, 0x00, 0x41], 2, "it is a UTF-16 text: save it as UTF-8");
    check(b"rfm 1\nsolid s = sphere(\xff)", 2, "byte 23 ");
    check(b"rfm 1\nsolid s = sphere(1)\0\n", 1, "unexpected character U+0000");
    check([0; 5000], 1, "unexpected character U+0000");
    check("", 1, "E0003");
    check("\n\n  # only a comment", 1, "E0003");
    check("rfm 1", 1, "E0003");
    check("rfm 1\nparam a = 1\nlet _b = a", 0, "");
}

#[test]
fn line_ends_and_byte_order_marks_do_not_matter() {
    check("\u{FEFF}rfm 1\r\nparam r = 1 in 0 .. 2 \"radius\"\r\nsolid s = sphere(r) # a ball\r\n", 0, "");
    let quoted = "<stdin>:2:18\n  |\n2 | solid s = sphere(q)\n  |                  ^";
    check("rfm 1\r\nsolid s = sphere(q)\r\n", 1, quoted);
}

#[test]
fn nested_ten_thousand_times() {
    let n = 10_000;
    check(solid(&("(".repeat(n) + "x" + &")".repeat(n))), 1, "nested more than 200 deep");
    check(solid(&"(".repeat(n)), 1, "nested more than 200 deep");
    check(solid(&"[".repeat(n)), 1, "nested more than 200 deep");
    check(format!("rfm 1\nscene s {}", "a {".repeat(n)), 1, "nested more than 200 deep");
    check(solid(&("any i in 0..2: ".repeat(n) + "x")), 1, "nested more than 200 deep");
    check(solid(&("x".to_string() + &"^2".repeat(n))), 1, "nested too deeply");
    check(solid(&("x".to_string() + &"²".repeat(n))), 1, "nested too deeply");
    check(solid(&("x".to_string() + &".scale(2)".repeat(n))), 1, "nested too deeply");
    check(solid(&("not ".repeat(n) + "sphere(1)")), 0, "");
    check(solid(&("!".repeat(n + 1) + "sphere(1)")), 0, "W0403");
    check(solid(&("-".repeat(n) + "x")), 0, "W0403");
    check(solid(&")".repeat(n)), 1, "unexpected `)`");
    check(format!("rfm 1\n{}", "}".repeat(n)), 1, "unexpected `}`");
    // this is as deep as allowed
    check(solid(&("(".repeat(199) + "sphere(1)" + &")".repeat(199))), 0, "");
    check(solid(&("sqrt(".repeat(199) + "1 - x^2" + &")".repeat(199))), 0, "");
}

#[test]
#[ignore = "long"]
fn long_chains() {
    let n = 100_000;
    let terms: Vec<String> = (0..n).map(|i| format!("{i}*x")).collect();
    check(solid(&terms.join(" + ")), 0, "measuring it may take");
    let planes: Vec<String> = (0..n).map(|i| format!("x <= {i}")).collect();
    check(solid(&planes.join(" and ")), 0, "measuring it may take");
    check(solid(&vec!["sphere(1)"; n].join(" and ")), 0, "");
    check(solid(&("x+".repeat(500_000) + "@")), 1, "unexpected `@`");
    check(format!("rfm 1\nlet a = {}", "x".repeat(1_000_000)), 1, "unknown name `xxx");
}

/// A check whose time is up reports what it has: the solids that were measured, and how many there are.
#[test]
fn a_check_ends_early_with_what_it_has() {
    let measured = |solids: usize, budget: &str| {
        let balls: String = (1..=solids).map(|i| format!("solid ball{i} = sphere({i})\n")).collect();
        let arguments = ["check", "--json", "--budget", budget, "-"];
        let outcome = rfm_reading(root(), &arguments, format!("rfm 1\n{balls}").as_bytes()).expect(0);
        let document = outcome.json();
        assert_eq!(document["ok"], true);
        let found = document["solids"].as_array().unwrap();
        for (radius, solid) in (1..).map(f64::from).zip(found) {
            let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
            // on a busy machine the time may end while one of them is measured
            match solid["volume"].as_f64() {
                Some(found) => assert!((found / volume - 1.0).abs() < 0.01, "{solid}"),
                None => assert_eq!(solid["unfinished"][0], "volume", "{solid}"),
            }
        }
        (found.len(), outcome.stderr)
    };
    let (found, said) = measured(5000, "1 s");
    assert!((1..5000).contains(&found), "{found}");
    assert!(
        said.contains(&format!("{found} of 5000 solids were measured, because the budget of 1 s ")),
        "{said}"
    );
    let (next, more) = (found + 1, 5000 - found - 5);
    assert!(
        said.contains(&format!("left out: `ball{next}`, ")) && said.contains(&format!(" and {more} more")),
        "{said}"
    );
    assert_eq!(measured(2, "60 s"), (2, String::new()));
}

#[test]
fn many_mistakes() {
    let lines =
        |line: &dyn Fn(usize) -> String| format!("rfm 1\n{}", (0..10_000).map(line).collect::<String>());
    check(lines(&|i| format!("let a{i} = b{i}\n")), 1, "9900 more messages are not shown");
    check(lines(&|i| format!("let a{i} = )\n")), 1, "9900 more messages are not shown");
    check(lines(&|i| format!("let a{i} = {i}\n")), 0, "9900 more messages are not shown");
}

#[test]
#[ignore = "long"]
fn files_that_unroll_without_end() {
    check(solid("any i in 0..1e12: sphere(1)"), 1, "unrolls to more than 1000000 operations");
    check(solid("any i in 0..1000: any j in 0..1000: any k in 0..1000: sphere(1)"), 1, "E0210");
    check(solid("any i in 0..1e6: any j in 0..1e6: x"), 1, "E0210");
    check(solid("all i in 0..1000000: sphere(1 + i)"), 1, "E0210");
    check("rfm 1\nfn f(n) = f(n - 1)\nsolid s = f(3)", 1, "`f` calls itself");
    let doubling = |i: usize| format!("fn f{i}(a) = f{}(f{}(a))\n", i - 1, i - 1);
    let text =
        "rfm 1\nfn f0(a) = a\n".to_string() + &(1..60).map(doubling).collect::<String>() + "solid s = f59(x)";
    check(text, 1, "E0210");
    let nest = |i: usize| format!("fn f{i}(a) = {}f{}(a){}\n", "abs(".repeat(150), i - 1, ")".repeat(150));
    let text =
        "rfm 1\nfn f0(a) = a\n".to_string() + &(1..60).map(nest).collect::<String>() + "solid s = f59(x)";
    check(text, 1, "unroll too deeply");
}

/// What is certain to be too much is refused before it is made: ten million members took seconds and gigabytes.
#[test]
fn what_unrolls_too_far_is_refused_at_once() {
    let started = std::time::Instant::now();
    check(solid("sum i in 0..10000000: x*i"), 1, "make the range shorter, or allow more with --max-nodes");
    check(solid("sum i in 0..3: sum j in 0..10000000: x*j"), 1, "E0210");
    let copies = "(x + y + z <= 1).repeat([1, 1, 1], [1000, 1000, 1000])";
    check(solid(copies), 1, "make fewer copies, or allow more with --max-nodes");
    check(solid("sphere(1).polar_repeat(1e9)"), 1, "E0210");
    assert!(started.elapsed() < std::time::Duration::from_secs(4), "{:?}", started.elapsed());
}

/// Copies along an axis on which a shape does not depend are the shape itself.
#[test]
fn copies_that_are_all_the_same_cost_nothing() {
    let value = |shape: &str| {
        let outcome = rfm_reading(root(), &["eval", "-", "--at", "0,0,0.5"], solid(shape).as_bytes());
        outcome.expect(0).stdout
    };
    let endless = "(z <= 1).repeat([1, 1, 1000], [1000, 1000, 1000])";
    let along_z = "(z <= 1).repeat([1, 1, 1000], [1, 1, 1000])";
    assert_eq!(value(endless), value(along_z));
    assert_eq!(value("(z <= 1).repeat([1, 1, 1], [1000, 1000, 1])"), value("z <= 1"));
}

#[test]
fn keywords_are_keys_where_keys_stand() {
    let scene = "rfm 1\nsolid pawn = cylinder(0.1, 0.2)\nscene drop {\n  box { min: [0,0,0] max: [1,1,1] }\n  \
                 fluid { shape: ball([0.5, 0.5, 0.5], 0.1) particles: 20 }\n  obstacle { solid: pawn }\n}\n";
    check(scene, 0, "");
}

#[test]
fn limits_of_the_command_line() {
    let file = solid("any i in 0..20: sphere(1).move([i, 0, 0])");
    rfm_reading(root(), &["check", "-", "--max-nodes", "50"], file.as_bytes()).expect(1);
    rfm_reading(root(), &["check", "-", "--max-nodes", "0"], file.as_bytes()).expect(1);
    rfm(root(), &["check", "-", "--max-nodes", "many"]).expect(2);
    rfm(root(), &["check", "-", "--threads", "0"]).expect(2);
}

const TOKENS: &[&str] = &[
    "rfm 1\n",
    "param",
    "let",
    "fn",
    "solid",
    "scene",
    "any",
    "all",
    "in",
    "and",
    "or",
    "not",
    "a",
    "b",
    "s",
    "x",
    "y",
    "z",
    "pi",
    "0",
    "1",
    "2.5",
    "1e9",
    "3 mm",
    "30 deg",
    "..",
    ":",
    "=",
    "==",
    "<=",
    ">=",
    "<",
    "+",
    "-",
    "*",
    "/",
    "^",
    "²",
    "\\",
    "∧",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ".",
    ".x",
    ".move(",
    ".rotate_z(",
    ".scale(",
    "sphere(",
    "box(",
    "sqrt(",
    "min(",
    "ball(",
    "normalise(",
    "\n",
    " ",
    "\"text\"",
    "\"",
    "#",
    "i",
    "fluid",
    "shape",
    "\u{0}",
    "é",
];

/// Goes the whole way to a compiled solid. Only the absence of a panic is asserted.
fn compile(text: &str) {
    let source = rfm::diagnostic::Source::file("soup.rfm", text);
    let options = rfm::lower::Options { max_nodes: Some(2_000), ..Default::default() };
    match Program::check(source, options) {
        Ok(program) => {
            for named in &program.module().solids {
                let solid = program.solid_with(&named.name, rfm::Engine::Interpreter).unwrap();
                solid.omega_grad(rfm::glam::DVec3::new(0.3, -1.5, 2.0));
            }
            let _ = program.warnings().to_string();
        }
        Err(diagnostics) => assert!(!diagnostics.to_string().is_empty()),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(1500) })]

    #[test]
    fn token_soup_never_panics(tokens in prop::collection::vec(prop::sample::select(TOKENS), 0..60)) {
        compile(&tokens.join(" "));
        compile(&format!("rfm 1\nsolid s = {}", tokens.concat()));
    }

    #[test]
    fn any_text_never_panics(text in any::<String>()) {
        compile(&text);
    }

    #[test]
    fn mutated_examples_never_panic(
        which in 0..3usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0..4u8, prop::sample::select(TOKENS)), 1..6),
    ) {
        let examples = [
            include_str!("../../examples/pawn.rfm"),
            include_str!("../../examples/cube.rfm"),
            include_str!("../cases/stages/functions.rfm"),
        ];
        let mut text: Vec<char> = examples[which].chars().collect();
        for (place, kind, token) in changes {
            let at = place.index(text.len());
            match kind {
                0 => { text.remove(at); }
                1 => { text.splice(at..at, token.chars()); }
                2 => { let end = (at + 12).min(text.len()); text.drain(at..end); }
                _ => { let end = (at + 1).min(text.len()); text.splice(at..end, token.chars()); }
            }
            if text.is_empty() { break; }
        }
        compile(&text.into_iter().collect::<String>());
    }
}

/// A file may unroll to more operations if it is longer, and the message says what there is to shorten.
#[test]
#[ignore = "long"]
fn the_limit_of_operations_grows_with_the_file() {
    let lines = |count: usize| {
        let line = |i| {
            format!(
                "solid s{i} = box([0,0,0],[1.{i},1.{i}9,2]).rotate_z(0.{i}).move([0.{i}1,0.{i}2,0]) \\ cylinder(0.2{i},2.{i})\n"
            )
        };
        let mut text = String::from("rfm 1\n");
        text.extend((1..=count).map(line));
        text
    };
    let checked = |text: String, max_nodes| {
        let options = rfm::lower::Options { max_nodes, ..Default::default() };
        Program::check(rfm::diagnostic::Source::file("many.rfm", text), options)
    };
    let many = checked(lines(20_000), None).unwrap_or_else(|e| panic!("{e}"));
    assert!(many.module().graph.len() > rfm::lower::MAX_NODES, "{}", many.module().graph.len());
    let refused = checked(lines(100), Some(1_000)).unwrap_err().to_string();
    assert!(refused.contains("split the file, or allow more with --max-nodes"), "{refused}");
    let range = "rfm 1\nsolid s = any i in 0..100000: sphere(1).move([i, i^2, 0]).rotate_z(i)\n".to_string();
    let refused = checked(range, None).unwrap_err().to_string();
    assert!(refused.contains("more than 1000000 operations"), "{refused}");
    assert!(refused.contains("make a range shorter"), "{refused}");
}
