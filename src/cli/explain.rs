//! `rfm explain`: the long text of a message, or the stages of the compiler for a file.

use std::path::Path;

use super::args::{Explain, Shared, Stage};
use super::{Failure, choose, input};
use crate::Program;
use crate::codegen::{Listing, Precision, Request, Shape, target_description};
use crate::diagnostic::{explain, nearest};
use crate::ir::dump;
use crate::lower::NamedSolid;
use crate::solid::ProgramKind;
use crate::syntax;

pub(super) fn run(shared: &Shared, options: &Explain) -> Result<(), Failure> {
    if shared.json {
        return Err(Failure::usage("explanations are for people: `rfm explain` has no --json"));
    }
    let subject = options.subject.as_str();
    if let Some(text) = explain(subject) {
        say!("{}\n\n{text}", subject.to_uppercase());
        return Ok(());
    }
    let is_code = subject.len() == 5 && subject.starts_with(['E', 'W']) && !Path::new(subject).exists();
    if is_code && subject[1..].bytes().all(|b| b.is_ascii_digit()) {
        return Err(Failure::usage(format!("there is no message {subject}")));
    }
    let (path, name) = match subject.rsplit_once(':') {
        Some((path, name)) if !Path::new(subject).exists() => (path, Some(name)),
        _ => (subject, None),
    };
    let program = input::program(shared, Path::new(path))?;
    if options.show.contains(&Stage::Ast) {
        say!("{}", syntax::print(program.ast()).trim_end());
    }
    match name {
        Some(name) if program.module().scenes.iter().any(|s| s.name == name) => {
            super::run::explain(shared, &program, choose::scene(&program, Some(name))?)
        }
        Some(name) => {
            let module = program.module();
            let Some(solid) = module.solids.iter().find(|s| s.name == name) else {
                let solids = module.solids.iter().map(|s| s.name.as_str());
                let scenes = module.scenes.iter().map(|s| s.name.as_str());
                let near = nearest(name, solids.chain(scenes));
                let hint = near.map_or(String::new(), |n| format!("; did you mean `{n}`?"));
                return Err(Failure::usage(format!("`{path}` has no solid or scene `{name}`{hint}")));
            };
            stages(shared, &program, solid, &options.show)
        }
        None => {
            for solid in &program.module().solids {
                stages(shared, &program, solid, &options.show)?;
            }
            Ok(())
        }
    }
}

/// What became of one solid.
fn stages(shared: &Shared, program: &Program, named: &NamedSolid, show: &[Stage]) -> Result<(), Failure> {
    let solid = program.solid_with(&named.name, shared.engine.into()).map_err(choose::usage)?;
    let (written, _) = program.module().graph.extract(&[named.node]);
    let (value, value_outputs) = solid.graph(ProgramKind::Value);
    let (gradient, gradient_outputs) = solid.graph(ProgramKind::Gradient);
    say!("solid {}", named.name);
    say!(
        "  operations: {} as written, {} for ω, {} for ω and ∇ω",
        written.len(),
        value.len(),
        gradient.len()
    );
    let rules = &solid.applied_rules().0;
    for (equation, count) in rules {
        say!("  simplified {count:>4} ×  {equation}");
    }
    for (precision, name) in [(Precision::F64, "f64"), (Precision::F32, "f32")] {
        let scaled = solid.forms(ProgramKind::Value, precision).exceptions();
        if scaled > 0 {
            say!("  scaled: {scaled} operations in {name}, where squares may leave the range");
        }
    }
    if let Some(chosen) = choose::within_tolerance(program, &solid)? {
        let over = chosen.over();
        say!(
            "  values of ω: {}, to {:.1e} in {:.3} … {:.3}",
            chosen.plan().name(),
            chosen.bound(),
            over.min,
            over.max
        );
    }
    say!("  target: {}", target_description());
    if show.contains(&Stage::Ir) {
        say!("\nω:\n{}", dump(value, &[("omega", value_outputs[0])], program.sources()));
        let names = ["omega", "gx", "gy", "gz"];
        let roots: Vec<_> = names.into_iter().zip(gradient_outputs.iter().copied()).collect();
        say!("ω and ∇ω:\n{}", dump(gradient, &roots, program.sources()));
    }
    if show.contains(&Stage::Clif) || show.contains(&Stage::Asm) {
        for (title, kind) in [("ω", ProgramKind::Value), ("ω and ∇ω", ProgramKind::Gradient)] {
            let (graph, outputs) = solid.graph(kind);
            let request = Request {
                graph,
                outputs,
                precision: Precision::F64,
                shape: Shape::Batch,
                forms: solid.forms(kind, Precision::F64),
                parameters: false,
            };
            let listing = Listing::of(request).map_err(|e| Failure::usage(e.to_string()))?;
            if show.contains(&Stage::Clif) {
                say!("\n{title}, f64, many points, intermediate representation:\n{}", listing.clif);
            }
            if show.contains(&Stage::Asm) {
                say!("\n{title}, f64, many points, machine code:\n{}", listing.assembly);
            }
        }
    }
    Ok(())
}
