//! Content of the machine code for single points, as evidence for where time goes.
//!
//! Run it by `cargo run --release --example listing`.
//!
//! The table gives for each program the nodes of its graph, instructions, divisions and roots, loads from and
//! stores to the stack (constants that found no register, and values that lost theirs), and selects. The
//! argument `asm` also prints the code of the pawn's textbook program for `f64`.

#[allow(dead_code)]
#[path = "../src/scenes.rs"]
mod scenes;

use rfm::codegen::{Form, Forms, Listing, Precision, Request, Shape};
use rfm::solid::ProgramKind;
use rfm::{Program, Solid};
use scenes::Order;

fn main() {
    let solid = |text: &str, name: &str| -> Solid {
        let program = Program::from_source("listing.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        program.solid(name).unwrap_or_else(|e| panic!("{e}"))
    };
    let heads = ["program", "nodes", "instructions", "div", "sqrt", "blend", "stack loads", "stack stores"];
    println!("{}", heads.join(" | "));
    let pawn = solid(scenes::PAWN, "pawn");
    for form in [Form::Stable, Form::Textbook] {
        for (what, kind) in [("ω", ProgramKind::Value), ("ω and ∇ω", ProgramKind::Gradient)] {
            for precision in [Precision::F64, Precision::F32] {
                print(&format!("pawn {what} {form:?} {precision:?}"), &pawn, kind, form, precision);
            }
        }
    }
    print("pawn sign F64", &pawn, ProgramKind::Sign, Form::Stable, Precision::F64);
    print("pawn contact F64", &pawn, ProgramKind::Contact, Form::Stable, Precision::F64);
    for n in [64, 500, 2000, 10_000] {
        let union = solid(&scenes::union_text(&scenes::spheres(n), Order::Balanced), "union");
        for (what, kind) in
            [("ω", ProgramKind::Value), ("sign", ProgramKind::Sign), ("contact", ProgramKind::Contact)]
        {
            print(&format!("{n} spheres {what} F32"), &union, kind, Form::Stable, Precision::F32);
        }
    }
    if std::env::args().any(|argument| argument == "asm") {
        println!("\n{}", assembly(&pawn, ProgramKind::Value, Form::Textbook, Precision::F64));
    }
}

fn assembly(solid: &Solid, kind: ProgramKind, form: Form, precision: Precision) -> String {
    let (graph, outputs) = solid.graph(kind);
    let (shape, inputs) = (Shape::Point, &[][..]);
    let request = Request {
        graph,
        inputs,
        outputs,
        precision,
        shape,
        forms: &Forms::all(form),
        parameters: false,
        uniforms: false,
    };
    Listing::of(request).unwrap_or_else(|e| panic!("{e}")).assembly
}

fn print(what: &str, solid: &Solid, kind: ProgramKind, form: Form, precision: Precision) {
    let text = assembly(solid, kind, form, precision);
    // The program is the longest block.
    let longest = text.split("\nblock").max_by_key(|block| block.len()).unwrap_or_default();
    let lines: Vec<&str> = longest.lines().skip(1).map(str::trim).collect();
    let count = |test: &dyn Fn(&str) -> bool| lines.iter().filter(|line| test(line)).count();
    let stores = count(&|line| line.ends_with("(%rsp)"));
    let cells = [
        solid.graph(kind).0.len(),
        lines.len(),
        count(&|line| line.starts_with("vdiv")),
        count(&|line| line.starts_with("vsqrt")),
        count(&|line| line.contains("blend")),
        count(&|line| line.contains("(%rsp)")) - stores,
        stores,
    ];
    println!("{what} | {}", cells.map(|cell| cell.to_string()).join(" | "));
}
