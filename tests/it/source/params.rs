//! Params that remain arguments of what is written.

use rfm::files::Files;
use rfm::source::{self, Options, Param, Target};
use rfm::{Engine, Program, Solid};

use super::compare::{Extra, compare, points};
use super::library::{Workshop, compile, is_here, mathematics};
use super::{FEW, compilers, exact};
use crate::tool::rfm;

/// The C of a solid that was opened.
fn c_with_params(opened: &Program, solid: &Solid) -> String {
    let params = opened.module().params.iter();
    let params = params.map(|p| Param { name: p.name.clone(), value: p.value, doc: p.doc.clone() }).collect();
    let options = Options { params, ..exact("s") };
    source::write(solid, Target::C, &options).unwrap().text
}

#[test]
fn only_what_a_solid_takes_from_another_file_decides_which_params_are_constants() {
    let parts = "rfm 1\nparam r = 1\nparam n = 3\nfn ring(k) = any i in 0..k: sphere(r).move([i, 0, 0])\n\
                 solid post = sphere(r)\nsolid row = ring(n)\n";
    let text = "rfm 1\nimport \"parts.rfm\" as parts\nsolid plain = parts.post\nsolid long = parts.row\n\
                solid own = parts.ring(parts.n)\n";
    let files = Files::from_memory([("parts.rfm", parts)]);
    let program = Program::from_source_with("s.rfm", text, files).unwrap_or_else(|e| panic!("{e}"));
    let fixed = |solid| program.with_open_params_of([solid]).unwrap().1;
    assert!(fixed("plain").is_empty(), "{:?}", fixed("plain"));
    assert_eq!(fixed("long"), ["parts.n"]);
    assert_eq!(fixed("own"), ["parts.n"]);
}

#[test]
fn params_that_stay_constant_are_named_in_the_text() {
    let build = |arguments: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(
            folder.path().join("a.rfm"),
            "rfm 1\nparam a = 0.5\nparam b = 2\nsolid s = sphere(b).scale(a)\n",
        )
        .unwrap();
        crate::tool::rfm(folder.path(), &[&["build", "a.rfm", "-o", "a.c"], arguments].concat()).expect(0);
        std::fs::read_to_string(folder.path().join("a.c")).unwrap()
    };
    assert!(build(&[]).contains(" * Params: a = 0.5, b = 2.0.\n"));
    let open = build(&["--runtime-params"]);
    assert!(
        open.contains(" * Params: a = 0.5.\n * `a` decides how `s` is built and stays as in the file.\n"),
        "{open}"
    );
    assert!(open.contains("double b;") && !open.contains("double a;"));
}

/// A host in C for files with params: it prints what `say` asks.
fn printed(workshop: &Workshop, compiler: &str, headers: &[&str], files: &[&str], say: &str) -> String {
    let includes: String = headers.iter().map(|header| format!("#include \"{header}\"\n")).collect();
    let host =
        format!("#include <complex.h>\n{includes}#include <stdio.h>\nint main(void) {{ {say} return 0; }}\n");
    workshop.write("host.c", host);
    compile(compiler, workshop.path(), &[&["-o", "host", "host.c"], files, &["-lm"]].concat());
    let run = std::process::Command::new(workshop.path().join("host")).output().unwrap();
    String::from_utf8(run.stdout).unwrap()
}

/// A factor of params scales ω and moves no surface.
#[test]
fn distances_of_params_are_those_of_constants() {
    if !is_here("gcc") {
        return;
    }
    let workshop = Workshop::new();
    workshop.write("el.rfm", "rfm 1\nparam a = 0.9\nsolid s = ellipsoid(a, 1, 0.3)\n");
    workshop.write("tt.rfm", "rfm 1\nparam I = 0.5\nsolid T = (1 + t)*sphere(2*I)\n");
    for (file, solid, output) in
        [("el.rfm", "s", "s.c"), ("el.rfm", "s", "s_o.o"), ("tt.rfm", "T", "big.c"), ("tt.rfm", "T", "t.c")]
    {
        let prefix = if output == "t.c" { "t" } else { output.split('.').next().unwrap() };
        let arguments = ["build", file, "-s", solid, "--what", "distance", "--runtime-params", "-o", output];
        rfm(
            workshop.path(),
            &[&arguments[..], &["--prefix", if prefix == "big" { "T" } else { prefix }]].concat(),
        )
        .expect(0);
    }
    let say = "printf(\"%.9f %.9f %.9f %.9f\", s_distance(2,0,0,&s_defaults), s_o_distance(2,0,0,&s_o_defaults), \
               T_distance(2,0,0,0.5,&T_defaults), t_distancef(2,0,0,0.5,&t_defaults));";
    let found =
        printed(&workshop, "gcc", &["s.h", "s_o.h", "big.h", "t.h"], &["s.c", "s_o.o", "big.c", "t.c"], say);
    assert_eq!(found, "1.100000000 1.100000000 1.000000000 1.000000000");
    if is_here("g++") {
        // which takes all of these files for C++
        let found = printed(
            &workshop,
            "g++",
            &["s.h", "s_o.h"],
            &["s.c", "s_o.o"],
            "printf(\"%.3f\", s_omega(0,0,0,&s_defaults));",
        );
        assert!(found.parse::<f64>().unwrap() > 0.0, "{found}");
    }
}

/// ω and signs to the bit. The sums of a gradient have another order where params are no constants, and at creases any
/// member of its limits is as good.
#[test]
fn params_that_stay_open_give_the_values_of_params_that_were_set() {
    let text = "rfm 1\nparam side = 2 in 0.1 .. 9 \"of the cube\"\nparam turn = 0.3\nparam n = 3\nparam unused = 1\n\
                let _ = unused\nsolid s = box([-side/2, -side, -1], [side/2, side, 1]).rotate_z(turn + t).move([turn, 0, 0])\n  \
                \\ any i in 0..n: ball([0.3*i, 0, 0], side/4)";
    let program = Program::from_source("s.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let (opened, fixed) = program.with_open_params().unwrap();
    assert_eq!(fixed, ["n"]);
    // what another solid is built by stays open for this one
    let more = format!("{text}\nlet k = side\nsolid row = any i in 0..k: s.move([i, 0, 0])");
    let more = Program::from_source("s.rfm", more).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(more.with_open_params().unwrap().1, ["n", "side"]);
    assert_eq!(more.with_open_params_of(["s"]).unwrap().1, ["n"]);
    assert_eq!(more.with_open_params_of(["row"]).unwrap().1, ["n", "side"]);
    let solid = opened.solid_with("s", Engine::Interpreter).unwrap();
    let text = c_with_params(&opened, &solid);
    assert!(text.contains("Nothing checks them against the ranges"), "{text}");
    assert!(text.contains("double side;") && !text.contains("double n;") && !text.contains("double unused;"));
    if !is_here("gcc") {
        return;
    }
    let workshop = Workshop::new();
    workshop.write("s.c", &text);
    workshop.write("mathematics.c", mathematics());
    let library = workshop.library("gcc", &["s.c", "mathematics.c"]);
    for (side, turn) in [(2.0, 0.3), (0.7, -1.1)] {
        let set = program.with("side", side).unwrap().with("turn", turn).unwrap();
        let set = set.solid_with("s", Engine::Jit).unwrap().at(0.4);
        let extra = Extra { time: Some(0.4), params: Some(vec![side, turn]) };
        let counts = compare(&library, "s", &set, &points(FEW, 3), extra);
        assert_eq!(counts.different_values, 0, "{counts:?}");
    }
}

/// Parts that differ in what params and time make of them are one function and a table, as those of constants are.
#[test]
#[ignore = "long"]
fn hundreds_of_parts_with_params_are_short_texts() {
    let mut text = "rfm 1\nparam r = 0.1\nparam d = 0.2\n\
                    solid balls = any i in 0..150: ball([d*(mod(i, 7) - 3), 2*sin(i*1.7), d*floor(i/40) - t*i/300], \
                    r*(1 + i/100))\n\
                    solid posts = any i in 0..80: cylinder(r*(1 + i/100), d + 1).rotate_x(i*d).move([sin(i), 2*cos(i), 0])\n\
                    solid blobs = (sum i in 0..150: r*(1 + i/50)/((x - 2*sin(i*d))^2 + (y - i/100)^2 + z^2)) >= 40*d\n\
                    let b0 = sphere(r)\n"
        .to_string();
    for i in 1..25 {
        text += &format!("let b{i} = blend(b{}, ball([{i}*d/10, r*sin({i}), z/9], 2*r), 0.05)\n", i - 1);
    }
    text += "solid chain = b24\n";
    let program = Program::from_source("s.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let (opened, fixed) = program.with_open_params().unwrap();
    assert!(fixed.is_empty(), "{fixed:?}");
    for name in ["balls", "posts", "blobs", "chain"] {
        let solid = opened.solid_with(name, Engine::Interpreter).unwrap();
        let text = c_with_params(&opened, &solid);
        let longest =
            text.split("\n}\n").filter(|f| !f.contains("_uniforms_")).map(|f| f.lines().count()).max();
        let functions = text.matches("RFM_NOINLINE void s_at_").count();
        assert!(functions < 400, "{name}: {functions} functions, the longest of {longest:?} lines");
        // what differs between compilers is seen with constants
        for compiler in compilers().into_iter().take(1) {
            let workshop = Workshop::new();
            workshop.write("s.c", &text);
            workshop.write("mathematics.c", mathematics());
            let library = workshop.library(compiler, &["s.c", "mathematics.c"]);
            for (r, d) in [(0.1, 0.2), (0.03, -0.31)] {
                let set = program.with("r", r).unwrap().with("d", d).unwrap();
                let set = set.solid_with(name, Engine::Jit).unwrap().at(0.4);
                let extra = Extra { time: set.moves().then_some(0.4), params: Some(vec![r, d]) };
                let counts = compare(&library, "s", &set, &points(FEW / 4, 3), extra);
                assert_eq!(counts.different_values, 0, "{compiler}, {name}: {counts:?}");
            }
        }
    }
}
