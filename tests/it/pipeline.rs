//! What each stage makes of the text, printed.

use rfm::Program;
use rfm::ir::dump;
use rfm::solid::ProgramKind;

use crate::tool::{cases, snapshot, stem};

fn program(text: &str) -> Program {
    Program::from_source("t.rfm", format!("rfm 1\n{text}")).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn stages_of_small_files() {
    for path in cases("stages") {
        let text = std::fs::read_to_string(&path).unwrap();
        let name = format!("{}.rfm", stem(&path));
        let program = Program::from_source(name, text).unwrap_or_else(|e| panic!("{e}"));
        let mut print = format!("ast\n{}", rfm::syntax::print(program.ast()));
        for named in &program.module().solids {
            let solid = program.solid(&named.name).unwrap();
            let (graph, roots) = solid.graph(ProgramKind::Value);
            print += &format!("\nvalue of {}\n", named.name);
            print += &dump(graph, &[("omega", roots[0])], program.sources());
            let (graph, roots) = solid.graph(ProgramKind::Gradient);
            let names = ["omega", "gx", "gy", "gz"].into_iter().zip(roots.iter().copied());
            print += &format!("\nvalue and gradient of {}\n", named.name);
            print += &dump(graph, &names.collect::<Vec<_>>(), program.sources());
        }
        snapshot("pipeline", stem(&path), &print);
    }
}

/// The graph as lowered, before simplification, as nested calls.
fn graph(expression: &str) -> String {
    let program = program(&format!("solid s = {expression}"));
    let module = program.module();
    let (graph, roots) = module.graph.extract(&[module.solids[0].node]);
    let mut names: Vec<String> = Vec::new();
    for line in dump(&graph, &[("s", roots[0])], &[]).lines().filter(|line| line.starts_with('%')) {
        let (_, operation) = line.split_once(" = ").unwrap();
        let words: Vec<&str> = operation.split_whitespace().collect();
        let operand = |i: usize| names[words[i][1..].parse::<usize>().unwrap()].clone();
        names.push(match words[..] {
            ["r0_and", _, _] => format!("({}^{})", operand(1), operand(2)),
            ["r0_or", _, _] => format!("({}v{})", operand(1), operand(2)),
            ["neg", _] => format!("-{}", operand(1)),
            [leaf] => leaf.trim_end_matches(".0").to_string(),
            [name, _] => format!("{name}({})", operand(1)),
            _ => format!("{}({}, {})", words[0], operand(1), operand(2)),
        });
    }
    names.pop().unwrap()
}

#[test]
fn chains_are_balanced_and_the_left_half_is_the_larger() {
    assert_eq!(graph("x and y and z"), "((x^y)^z)");
    assert_eq!(graph("x or y or z or 1 or 2"), "(((xvy)vz)v(1v2))");
    assert_eq!(graph("x and y and z and 1 and 2 and 3 and 4 and 5"), "(((x^y)^(z^1))^((2^3)^(4^5)))");
    assert_eq!(graph("all i in 0..5: i"), "(((0^1)^2)^(3^4))");
}

#[test]
fn parentheses_are_kept() {
    assert_eq!(graph("x and (y and z)"), "(x^(y^z))");
    assert_eq!(graph("(x or y) or (z or 1)"), graph("x or y or z or 1"));
    assert_eq!(graph("x and (y and (z and 1))"), "(x^(y^(z^1)))");
}

#[test]
fn precedence() {
    assert_eq!(graph("x or y and z"), "(xv(y^z))");
    assert_eq!(graph("not x and y"), "(-x^y)");
    assert_eq!(graph("x \\ y"), "(x^-y)");
    assert_eq!(graph("x \\ y \\ z"), "((x^-y)^-z)");
    assert_eq!(graph("x and y \\ z"), "((x^y)^-z)");
    assert_eq!(graph("not not x"), "x");
    assert_eq!(graph("x or y >= z"), graph("x or (y >= z)"));
    assert_eq!(graph("-x^2"), graph("-(x^2)"));
    assert_eq!(graph("x - y - z"), graph("(x - y) - z"));
    assert_ne!(graph("x - y - z"), graph("x - (y - z)"));
}

#[test]
fn comparisons_are_differences_and_chains_are_products() {
    assert_eq!(graph("x <= y"), graph("y - x"));
    assert_eq!(graph("x >= y"), graph("x - y"));
    assert_eq!(graph("0 <= z <= 1"), graph("(z - 0)*(1 - z)"));
    assert_eq!(graph("1 >= z >= 0"), graph("(z - 0)*(1 - z)"));
}

#[test]
fn synonyms_give_the_same_graph() {
    let written = graph("x <= 1 and y >= 2 or not z \\ x*y/2 - 1");
    for synonym in [
        "x ≤ 1 ∧ y ≥ 2 ∨ ¬z ∖ x·y÷2 − 1",
        "x =< 1 & y => 2 | !z \\ x×y/2 - 1",
        "x <= 1 && y >= 2 || !z ∖ x*y/2 - 1",
    ] {
        assert_eq!(graph(synonym), written, "{synonym}");
    }
    assert_eq!(graph("x² + y³"), graph("x^2 + y^3"));
    assert_eq!(graph("sphere(1)"), graph("sphere(r = 1, centre = [0, 0, 0])"));
    assert_eq!(graph("ball([1, 2, 3], 4)"), graph("ball(r = 4, centre = [1, 2, 3])"));
    assert_eq!(graph("sphere(20 mm)"), graph("sphere(0.02)"));
}

/// Operations of the value program, by name.
fn operations(expression: &str) -> Vec<String> {
    let solid = program(&format!("solid s = {expression}")).solid("s").unwrap();
    let (graph, roots) = solid.graph(ProgramKind::Value);
    let text = dump(graph, &[("s", roots[0])], &[]);
    let words = text.lines().filter_map(|line| line.split_once(" = ")?.1.split(' ').next());
    words.map(String::from).collect()
}

#[test]
fn forbidden_rewrites_do_not_happen() {
    let count = |expression: &str, name: &str| operations(expression).iter().filter(|o| *o == name).count();
    // R₀ is not idempotent and not associative
    assert_eq!(count("x and x", "r0_and"), 1);
    assert_eq!(count("x or (x or y)", "r0_or"), 2);
    assert_eq!(count("x and not x", "r0_and"), 1);
    // factored differences keep their digits: nothing is expanded, nothing reassociated
    assert_eq!(count("(x - 1e6)*(x - 1e6)", "mul"), 1);
    assert!(operations("(x + 1e16) - 1e16").contains(&"1e16".to_string()));
    // 0·x is NaN for x = ∞, x − x is NaN there too, x/x is not 1 at 0
    assert_eq!(count("0*x <= y", "mul"), 1);
    assert_eq!(count("x/x <= y", "div"), 1);
    assert_eq!(count("sqrt(x)^2 <= y", "sqrt"), 1);
}

#[test]
fn the_file_shadows_the_standard_solids_but_not_inside_them() {
    let own = program("fn sphere(r) = x <= r\nsolid s = sphere(3)");
    let plain = program("solid s = x <= 3");
    for program in [&own, &plain] {
        assert_eq!(program.solid("s").unwrap().omega(rfm::glam::DVec3::ZERO), 3.0);
    }
    // a global that is named like a parameter of a standard solid must not leak into it
    let shadowed = program("let r = 5\nsolid s = sphere(1) and sphere(r)");
    assert!(shadowed.solid("s").unwrap().omega(rfm::glam::DVec3::new(2.0, 0.0, 0.0)) < 0.0);
}
