//! Solids as source text and object code: compiled by the compilers that are here, and compared with the machine code
//! of `rfm` bit by bit.

mod compare;
mod library;
mod params;
mod shaders;

use std::time::Instant;

use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use rfm::codegen::Form;
use rfm::precision::Precision;
use rfm::source::{self, Math, Options, Target};
use rfm::{Engine, Program, Solid};

use crate::agreement::EVERYTHING;
use crate::properties::expression;
use crate::tool::{rfm, root};
use compare::{Counts, Extra, compare, points};
use library::{Workshop, compile, is_here, mathematics};

/// Points in the usual run, and in the one that is asked for.
const FEW: usize = 4000;
const MANY: usize = 1_000_000;

/// Lines of C of the longest file that is compiled in the usual run.
const LONGEST_TEXT: usize = 1000;

fn exact(prefix: &str) -> Options {
    Options { prefix: Some(prefix.into()), sign: true, distance: true, math: Math::Rfm, ..Options::default() }
}

/// A file whose functions of the mathematical library are those of `rfm`.
fn c_text(solid: &Solid, prefix: &str) -> String {
    source::write(solid, Target::C, &exact(prefix)).unwrap_or_else(|e| panic!("{e}")).text
}

/// Solids of random formulas.
fn random_solids(count: usize) -> Vec<Solid> {
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
    let mut runner = TestRunner::new_with_rng(Config::default(), rng);
    let mut solids = Vec::new();
    while solids.len() < count {
        let text = expression().new_tree(&mut runner).unwrap().current();
        let program = Program::from_source("random.rfm", format!("rfm 1\nsolid s = {text}"));
        solids.push(program.unwrap_or_else(|e| panic!("{e}")).solid_with("s", Engine::Jit).unwrap());
    }
    solids
}

/// All solids of all examples that are formulas, those that move at a time at which they have moved.
fn example_solids() -> Vec<Solid> {
    let mut solids = Vec::new();
    for folder in ["examples", "examples/validation"] {
        let mut paths: Vec<_> =
            std::fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        for path in paths.iter().filter(|path| path.extension().is_some_and(|ending| ending == "rfm")) {
            let program = Program::from_path(path).unwrap_or_else(|e| panic!("{e}"));
            let graph = &program.module().graph;
            let named = program.module().solids.iter().filter(|solid| !graph.has_lookups(&[solid.node]));
            solids.extend(named.map(|solid| program.solid(&solid.name).unwrap().at(0.37)));
        }
    }
    assert!(solids.len() >= 8, "{}", solids.len());
    solids
}

/// The solids of examples, each once, without the longest: a compiler takes seconds for each of them, and their object
/// files are compared all the same.
fn short_examples() -> Vec<Solid> {
    let mut solids = example_solids();
    let mut known = std::collections::HashSet::new();
    solids.retain(|solid| {
        let text = c_text(solid, "s");
        let functions = text.split_once("#include").map_or("", |(_, functions)| functions).to_string();
        text.lines().count() <= LONGEST_TEXT && known.insert(functions)
    });
    assert!(solids.len() >= 15, "{}", solids.len());
    solids
}

/// A fold written by hand, in two forms: in `f32` its first operations are stable and the later ones scaled.
/// (A long fold is no better: gcc takes 16 s for 90 steps, and clang 14 half a minute for 25.)
fn wide_fold() -> String {
    let step = |i: usize| format!("let u{i} = u{} or 1e15*{i}*x - y\n", i - 1);
    format!("rfm 1\nlet u0 = 1e15*x - z\n{}solid fold = u19\n", (1..20).map(step).collect::<String>())
}

/// Every operation in every form, and folds whose operands leave the range of `f32`.
fn solids_of_every_operation() -> Vec<Solid> {
    let program = Program::from_source("everything.rfm", EVERYTHING).unwrap();
    let (graph, node) = (&program.module().graph, program.module().solids[0].node);
    let mut solids: Vec<Solid> = [Form::Stable, Form::Textbook, Form::Scaled]
        .into_iter()
        .map(|form| Solid::with_form("everything", graph, node, Engine::Jit, form).unwrap())
        .collect();
    let moving =
        "rfm 1\nsolid s = (box() \\ sphere(0.7)).rotate_z(3*t).move([sin(t), t^2, 0]) or t*x <= y/(1 + t)";
    for text in [wide_fold(), moving.to_string(), "rfm 1\nsolid s = sphere(1) \\ z <= -1e300*x".into()] {
        let program = Program::from_source("s.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        let name = program.module().solids[0].name.clone();
        solids.push(program.solid_with(&name, Engine::Jit).unwrap().at(0.8));
    }
    solids
}

/// Solids that are repeated, rounded, blended and bent: their choices follow one another, and they call functions.
fn bent_solids() -> Vec<Solid> {
    let text = "rfm 1\n\
        solid repeated = sphere(0.3).repeat([1, 1, 1], [5, 5, 5])\n\
        solid rounded = (box([-1, -1, -1], [1, 1, 1]) \\ cylinder(0.5, 3)).round(0.1)\n\
        solid blended = blend(box(), blend(sphere(1).move([1, 0, 0]), cylinder(0.4, 2), 0.3), 0.2)\n\
        solid twisted = (box([-0.5, -0.5, -1], [0.5, 0.5, 1]) \\ cylinder(0.2, 3)).twist(0.3).repeat([3, 0, 0], [2, 1, 1])\n\
        solid waves = sin(30*x)*cos(3*y) + sin(3*y)*cos(3*z) + sin(3*z)*cos(30*x) <= 0.3 and sphere(2)\n\
        solid calls = sin(exp(0.3*x) + y^1.5) + atan2(sin(z), x) + sin(t) <= 0.3 and sphere(2)\n\
        solid tangents = tan(x) + 0.1*sin(1e5*y) <= cos(z*(2 + sin(x)))\n\
        solid drills = any i in 0..12: box().twist(0.1*i).move([sin(i), cos(i), i/20])\n\
        solid ripples = (sum i in 1..60: sin(i*x + y)/i + exp(-i*z^2)) <= 1\n";
    let program = Program::from_source("bent.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let names: Vec<String> = program.module().solids.iter().map(|solid| solid.name.clone()).collect();
    names.iter().map(|name| program.solid_with(name, Engine::Jit).unwrap().at(0.37)).collect()
}

/// The loops that a compiler says it has vectorised.
fn vectorised_loops(compiler: &str, text: &str) -> usize {
    let workshop = Workshop::new();
    workshop.write("s.c", text);
    let (report, word) = match compiler {
        "gcc" => ("-fopt-info-vec-optimized", "loop vectorized"),
        _ => ("-Rpass=loop-vectorize", "vectorized loop"),
    };
    let mut command = std::process::Command::new(compiler);
    command.args(library::FLAGS).args(["-c", "s.c", report]).current_dir(workshop.path());
    let words = String::from_utf8(command.output().unwrap().stderr).unwrap();
    let lines = words.lines().filter(|line| line.contains(word));
    lines.filter_map(|line| line.split(':').nth(1)).collect::<std::collections::HashSet<_>>().len()
}

/// All numbers of a C library of some solids against those of their machine code.
fn compare_c(compiler: &str, solids: &[Solid], count: usize) -> Counts {
    let workshop = Workshop::new();
    let mut files = Vec::new();
    for (i, solid) in solids.iter().enumerate() {
        files.push(format!("s{i}.c"));
        workshop.write(&files[i], c_text(solid, &format!("s{i}")));
    }
    workshop.write("mathematics.c", mathematics());
    files.push("mathematics.c".into());
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let library = workshop.library(compiler, &files);
    let mut counts = Counts::default();
    for (i, solid) in solids.iter().enumerate() {
        counts += compare(&library, &format!("s{i}"), solid, &points(count, i as u64), Extra::of(solid));
    }
    counts
}

fn compilers() -> Vec<&'static str> {
    ["gcc", "clang"].into_iter().filter(|compiler| is_here(compiler)).collect()
}

#[test]
#[ignore = "long"]
fn c_of_every_operation_has_the_bits_of_rfm() {
    // all forms in one test take gcc minutes; the object files of another have them all
    let mut solids = solids_of_every_operation();
    solids.drain(1..3);
    for compiler in compilers() {
        let counts = compare_c(compiler, &solids, FEW);
        assert_eq!(counts.different, 0, "{compiler}: {counts:?}");
    }
}

#[test]
#[ignore = "long"]
fn c_of_bent_solids_has_the_bits_of_rfm() {
    for compiler in compilers() {
        let counts = compare_c(compiler, &bent_solids(), FEW);
        assert_eq!(counts.different, 0, "{compiler}: {counts:?}");
    }
}

#[test]
#[ignore = "long"]
fn loops_of_bent_solids_are_vectorised() {
    for compiler in compilers() {
        for solid in bent_solids().iter().filter(|solid| !["drills", "ripples"].contains(&solid.name())) {
            let text = c_text(solid, "s");
            let found = vectorised_loops(compiler, &text);
            // in two precisions, four questions have a loop each, or one for sines at least and one for the rest
            assert!(found >= 8, "{compiler}, {solid:?}: {found} loops");
        }
    }
}

/// sin and cos of the file itself, those of <math.h> for a few arguments only.
#[test]
fn sines_of_a_text_differ_from_those_of_rfm_at_few_points() {
    let (solids, workshop) = (bent_solids(), Workshop::new());
    let waves = solids.iter().find(|solid| solid.name() == "waves").unwrap();
    let options = Options { math: Math::System, ..exact("s") };
    workshop.write("s.c", source::write(waves, Target::C, &options).unwrap().text);
    for compiler in compilers() {
        let library = workshop.library(compiler, &["s.c"]);
        let counts = compare(&library, "s", waves, &points(FEW, 3), Extra::default());
        assert!(counts.different < counts.compared / 200, "{compiler}: {counts:?}");
    }
}

#[test]
#[ignore = "long"]
fn c_of_random_solids_has_the_bits_of_rfm() {
    for compiler in compilers() {
        let counts = compare_c(compiler, &random_solids(5), FEW);
        assert_eq!(counts.different, 0, "{compiler}: {counts:?}");
    }
}

#[test]
#[ignore = "long"]
fn c_of_all_examples_has_the_bits_of_rfm() {
    for compiler in compilers() {
        let counts = compare_c(compiler, &short_examples(), FEW);
        assert_eq!(counts.different, 0, "{compiler}: {counts:?}");
    }
}

#[test]
#[ignore = "a million points for each of 150 solids: minutes"]
fn study_of_c_at_a_million_points() {
    for compiler in compilers() {
        let mut counts = Counts::default();
        for solids in [solids_of_every_operation(), example_solids(), random_solids(100)] {
            for some in solids.chunks(20) {
                counts += compare_c(compiler, some, MANY / 4);
            }
        }
        for solids in [solids_of_every_operation(), example_solids(), bent_solids()] {
            counts += compare_c(compiler, &solids, MANY);
        }
        println!("{compiler}: {counts:?}");
        assert_eq!(counts.different, 0, "{compiler}: {counts:?}");
    }
}

/// Nanoseconds per point of C and of machine code, in columns, the best of many rounds that take turns.
#[test]
#[ignore = "a measurement: run it alone, in a quiet moment"]
fn study_of_the_time_that_c_takes() {
    for compiler in compilers() {
        let mut solids = example_solids();
        solids.truncate(6);
        solids.push(balls(20));
        solids.push(balls(500));
        solids.extend(bent_solids());
        let workshop = Workshop::new();
        workshop.write("mathematics.c", mathematics());
        let mut files = vec!["mathematics.c".to_string()];
        for (i, solid) in solids.iter().enumerate() {
            workshop.write(&format!("s{i}.c"), c_text(solid, &format!("s{i}")));
            files.push(format!("s{i}.c"));
        }
        let files: Vec<&str> = files.iter().map(String::as_str).collect();
        let library = workshop.library(compiler, &files);
        println!("{compiler}: ns per point in columns, C and machine code");
        for (i, solid) in solids.iter().enumerate() {
            println!("{solid:?}: {}", compare::speed(&library, &format!("s{i}"), solid, &Extra::of(solid)));
        }
    }
}

fn balls(count: usize) -> Solid {
    let text = format!(
        "rfm 1\nsolid s = any i in 0..{count}: ball([2*sin(i*1.7), 2*cos(i*2.3), i/{count}], 0.1 + i/{count}/9)"
    );
    Program::from_source("s.rfm", text)
        .unwrap_or_else(|e| panic!("{e}"))
        .solid_with("s", Engine::Jit)
        .unwrap()
}

#[test]
fn five_hundred_parts_are_compiled_in_seconds_and_have_the_bits_of_rfm() {
    for compiler in compilers() {
        let started = Instant::now();
        let counts = compare_c(compiler, &[balls(500)], FEW);
        let seconds = started.elapsed().as_secs_f64();
        println!("{compiler}: 500 balls written, compiled and compared in {seconds:.1} s");
        assert_eq!(counts.different, 0, "{compiler}: {counts:?}");
        assert!(seconds < 60.0, "{compiler}: {seconds} s");
    }
}

/// Long folds that have no parts of R₀, alone and within R₀, and one whose members hold the others.
fn folds() -> Vec<Solid> {
    let square = "((x - 2*sin(i*1.7))^2 + (y - 2*cos(i*2.3))^2 + (z - i/500)^2)";
    let mut text = format!(
        "rfm 1\nsolid blobs = (sum i in 0..100: 0.01/{square}) >= 0.5\n\
         solid surface = (product i in 0..100: {square}) <= 0.1\n\
         solid hills = (sum i in 0..200: abs(x*cos(i) + y*sin(i) - i/500)) <= 70 and z <= 1 or ball([0, 0, 1], 0.3)\n\
         let b0 = sphere(0.3)\n"
    );
    for i in 1..50 {
        text += &format!("let b{i} = blend(b{}, ball([{i}/50, 0.3*sin({i}), z/9], 0.2), 0.05)\n", i - 1);
    }
    text += "solid chain = b49\n";
    let program = Program::from_source("s.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let solid = |name: &&str| program.solid_with(name, Engine::Jit).unwrap();
    ["blobs", "surface", "hills", "chain"].iter().map(solid).collect()
}

#[test]
#[ignore = "long"]
fn long_folds_are_short_texts_and_have_the_bits_of_rfm() {
    for solid in folds() {
        // straight lines of the longest would be 20 000
        let lines = c_text(&solid, "s").lines().count();
        assert!(lines < 17_000, "{solid:?}: {lines} lines");
    }
    for compiler in compilers() {
        let counts = compare_c(compiler, &folds(), FEW / 4);
        assert_eq!(counts.different, 0, "{compiler}: {counts:?}");
    }
}

#[test]
#[ignore = "a million points for each of four long folds: minutes"]
fn study_of_long_folds_at_a_million_points() {
    for compiler in compilers() {
        let counts = compare_c(compiler, &folds(), MANY);
        assert_eq!(counts.different, 0, "{compiler}: {counts:?}");
    }
}

#[test]
fn a_part_that_is_no_formula_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let file = "rfm 1\nlet ground = height_map(\"ground.csv\", [0, 0], [4, 3])\nsolid hill = ground or sphere(1)\n\
                solid free = sphere(1)\n";
    std::fs::write(folder.path().join("a.rfm"), file).unwrap();
    std::fs::write(folder.path().join("ground.csv"), "0,1\n1,0\n").unwrap();
    let refused =
        rfm(folder.path(), &["build", "a.rfm", "-s", "hill", "-o", "hill.c"]).expect(1).transcript();
    for part in ["E0219", "`hill` cannot be written as source: it has a height map", "a.rfm:2:25", "rfm mesh"]
    {
        assert!(refused.contains(part), "{part}\n{refused}");
    }
    assert!(!folder.path().join("hill.c").exists());
    rfm(folder.path(), &["build", "a.rfm", "-s", "free", "-o", "free.c"]).expect(0);
    assert!(folder.path().join("free.c").exists());
}

#[test]
fn a_header_is_c_and_cplusplus_and_cuda_is_cplusplus() {
    let solid = example_solids().remove(0);
    let workshop = Workshop::new();
    for (target, name) in [(Target::Header, "s.h"), (Target::Cuda, "s.cu")] {
        workshop.write(name, source::write(&solid, target, &exact("s")).unwrap().text);
    }
    let use_it = |file: &str| {
        format!(
            "#include \"{file}\"\n#include \"{file}\"\nint main(void) {{ return s_omega(0, 0, 0) > 1e300; }}\n"
        )
    };
    workshop.write("header.c", use_it("s.h"));
    workshop.write("header.cpp", use_it("s.h"));
    workshop.write("cuda.cpp", use_it("s.cu"));
    let warnings = ["-Wall", "-Wextra", "-fsyntax-only"];
    if is_here("gcc") {
        compile("gcc", workshop.path(), &[&warnings[..], &["-std=c99", "-pedantic", "header.c"]].concat());
    }
    if is_here("g++") {
        for file in ["header.cpp", "cuda.cpp"] {
            compile("g++", workshop.path(), &[&warnings[..], &["-std=c++11", file]].concat());
        }
    }
}

#[test]
#[ignore = "long"]
fn an_object_file_is_linked_into_a_c_host_and_has_the_bits_of_rfm() {
    if !is_here("gcc") {
        return;
    }
    let workshop = Workshop::new();
    let mut solids = solids_of_every_operation();
    solids.extend(example_solids());
    let mut files = vec!["mathematics.c".to_string()];
    workshop.write("mathematics.c", mathematics());
    for (i, solid) in solids.iter().enumerate() {
        let prefix = format!("s{i}");
        let made = source::object(solid, &exact(&prefix), None).unwrap_or_else(|e| panic!("{e}"));
        workshop.write(&format!("{prefix}.o"), &made.bytes);
        workshop.write(&format!("{prefix}.h"), made.header);
        // its own symbols are those of the header, which only declares them
        workshop.write(&format!("{prefix}_host.c"), format!("#include \"{prefix}.h\"\n"));
        files.extend([format!("{prefix}.o"), format!("{prefix}_host.c")]);
    }
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let library = workshop.library("gcc", &files);
    for (i, solid) in solids.iter().enumerate() {
        let counts = compare(&library, &format!("s{i}"), solid, &points(FEW + 1, 9), Extra::of(solid));
        assert_eq!(counts.different, 0, "{solid:?}: {counts:?}");
    }
}

#[test]
#[ignore = "long"]
fn rust_is_compiled_by_rustc_alone_and_has_the_bits_of_rfm() {
    if !is_here("rustc") {
        return;
    }
    let workshop = Workshop::new();
    let mut text = String::new();
    let mut solids = solids_of_every_operation();
    solids.retain(|solid| solid.name() != "everything"); // its functions are those of the system
    solids.extend(short_examples());
    for (i, solid) in solids.iter().enumerate() {
        let prefix = format!("s{i}");
        let options = Options { math: Math::System, ..exact(&prefix) };
        let module = source::write(solid, Target::Rust, &options).unwrap().text;
        text += &format!("mod m{i} {{\n{module}\n}}\n");
        text += &compare::rust_host(i, &prefix, solid.moves());
    }
    workshop.write("all.rs", text);
    let arguments = ["--edition=2021", "-O", "--crate-type=cdylib", "-Dwarnings", "-o", "all.so", "all.rs"];
    compile("rustc", workshop.path(), &arguments);
    let library = library::Library::load(&workshop.path().join("all.so"));
    let mut compared = 0;
    for (i, solid) in solids.iter().enumerate() {
        let own = Options { math: Math::Rfm, ..exact("s") };
        if source::write(solid, Target::Rust, &own).unwrap().text.contains("libm::") {
            continue; // sines of the system: compiled above, and compared with those of rfm in C
        }
        compared += 1;
        let counts = compare(&library, &format!("s{i}"), solid, &points(FEW, 5), Extra::of(solid));
        assert_eq!(counts.different, 0, "{solid:?}: {counts:?}");
    }
    assert!(compared >= 8, "{compared}");
    let everything = solids_of_every_operation().remove(0);
    for math in [Math::System, Math::Rfm] {
        let options = Options { math, ..exact("s") };
        let text = source::write(&everything, Target::Rust, &options).unwrap().text;
        assert_eq!(text.contains("libm::sin("), math == Math::Rfm);
        if math == Math::System {
            workshop.write("everything.rs", text);
            let arguments = ["--edition=2021", "--crate-type=lib", "-Dwarnings", "everything.rs"];
            compile("rustc", workshop.path(), &arguments);
        }
    }
}

#[test]
fn one_precision_and_no_more_functions_than_asked_for() {
    let solid = balls(3);
    let options = Options { precisions: vec![Precision::F32], ..Options::default() };
    for target in [Target::C, Target::Rust, Target::Wgsl] {
        let text = source::write(&solid, target, &options).unwrap().text;
        assert!(!text.contains("double") && !text.contains("f64") && !text.contains("s_sign"), "{text}");
    }
    let refused = Options { precisions: vec![Precision::F64], ..Options::default() };
    assert!(source::write(&solid, Target::Glsl, &refused).is_err());
    let refused = Options { prefix: Some("2d".into()), ..Options::default() };
    assert!(source::write(&solid, Target::C, &refused).is_err());
}

#[test]
fn the_command_writes_files_and_refuses_with_advice() {
    let folder = tempfile::tempdir().unwrap();
    let file = "rfm 1\nparam r = 1\nparam n = 3\nsolid post = cylinder(r, 1) and any i in 0..n: x <= i\nsolid wheel = sphere(r).rotate_z(t)\n";
    std::fs::write(folder.path().join("a.rfm"), file).unwrap();
    let build = |arguments: &[&str]| rfm(folder.path(), &[&["build", "a.rfm"], arguments].concat());
    std::fs::write(folder.path().join("mine.h"), "int mine;\n").unwrap();
    let mut transcript = String::new();
    for arguments in [
        &["-s", "post", "-o", "post.c"][..],
        &["-s", "post", "-o", "post.c"],
        &["-s", "post", "-o", "mine.c"],
        &["-s", "wheel", "-o", "wheel.wgsl", "--what", "sign,distance"],
        &["-s", "post", "-o", "post.rs", "--runtime-params"],
        &["-s", "post", "-o", "post.o", "--json"],
        &["-s", "post", "-o", "post.zig"],
        &["-s", "post", "-o", "post"],
        &["-s", "post"],
        &["-s", "pots", "-o", "post.c"],
        &["-o", "post.c"],
        &["-s", "post", "-o", "nowhere/post.c"],
        &["-s", "post", "-o", "post.glsl", "--precision", "f64"],
        &["-s", "post", "-o", "post.glsl", "--math", "rfm"],
        &["-s", "post", "-o", "post.c", "--prefix", "2d"],
        &["-s", "post", "-o", "post.c", "--target", "x86_64-apple-darwin"],
        &["-s", "post", "-o", "post.o", "--target", "pdp11"],
    ] {
        transcript +=
            &format!("$ rfm build a.rfm {}\n{}\n", arguments.join(" "), build(arguments).transcript());
    }
    crate::tool::snapshot("cli", "build", &transcript);
    let mut files: Vec<String> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(files, ["a.rfm", "mine.h", "post.c", "post.h", "post.o", "post.rs", "wheel.wgsl"]);
}
