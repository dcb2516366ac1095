//! Compares rfm with Fidget and with hand-written loops, in one run, on one thread.
//!
//! Run it by `cargo run --release --manifest-path tests/peers/Cargo.toml [-- --json FILE] [--only TEXT]`. The
//! option `--meshes` compares the meshers instead of the evaluators, and `--flows` the fluid solvers.
//! `README.md` in `tests/peers` explains the output.

mod bars;
mod compile;
mod fidget;
mod flows;
mod groups;
mod hand;
mod measure;
mod meshing;
mod ours;
mod scenes;
mod table;

use std::process::ExitCode;

use bars::Found;
use groups::Obstacle;

/// Number of primitives above which gradients are left out: they are not needed there, and compiling takes
/// long.
const GRADIENTS_UP_TO: usize = 500;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let (mut json, mut only, mut meshes) = (None, String::new(), false);
    while let Some(argument) = arguments.next() {
        if argument == "--flows" {
            flows::run();
            return ExitCode::SUCCESS;
        }
        if argument == "--meshes" {
            meshes = true;
            continue;
        }
        match (argument.as_str(), arguments.next()) {
            ("--json", Some(file)) => json = Some(file),
            ("--only", Some(text)) => only = text,
            _ => {
                eprintln!(
                    "usage: peers [--meshes] [--flows] [--json FILE] [--only TEXT], TEXT being part of an obstacle's title"
                );
                return ExitCode::from(2);
            }
        }
    }
    if meshes {
        meshing::run(&only);
        return ExitCode::SUCCESS;
    }
    let found = measure(&only);
    let bars = found.bars();
    table::print_rest(&found);
    table::print_bars(&bars);
    if let Some(file) = json {
        let text = format!("{:#}\n", table::json(&found, &bars));
        if let Err(error) = std::fs::write(&file, text) {
            eprintln!("cannot write {file}: {error}");
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}

/// Measures all obstacles whose title contains a text, and prints each when it is done.
fn measure(only: &str) -> Found {
    let mut found = Found { groups: Vec::new(), decided: Vec::new(), ulps: Vec::new(), compile: Vec::new() };
    let keep = |found: &mut Found, group: measure::Group| {
        table::print_group(&group);
        found.groups.push(group);
    };
    for obstacle in groups::obstacles().iter().filter(|obstacle| obstacle.title.contains(only)) {
        keep(&mut found, obstacle.values());
        if obstacle.primitives() <= GRADIENTS_UP_TO {
            keep(&mut found, obstacle.gradients());
        }
        if obstacle.primitives() >= GRADIENTS_UP_TO && obstacle.title.contains("balanced") {
            keep(&mut found, obstacle.through_cells());
        }
        if obstacle.name == "pawn" {
            keep(&mut found, groups::points_of_the_pawn(obstacle));
            let (group, decided) = groups::ranges(obstacle);
            keep(&mut found, group);
            found.decided = decided;
            let mut node = groups::one_node();
            found.ulps = groups::ulps(&mut node);
            keep(&mut found, node);
        }
        found.compile.extend(compile_times(obstacle));
    }
    found
}

fn compile_times(obstacle: &Obstacle) -> Vec<compile::Time> {
    let turns = match obstacle.primitives() {
        0..100 => 15,
        100..1000 => 3,
        _ => 1,
    };
    let tree = || (obstacle.tree)(fidget::Joins::R0);
    compile::times(&obstacle.title, turns, &obstacle.text, obstacle.name, &tree)
}
