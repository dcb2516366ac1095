//! A simulation on a thread of its own, followed and stopped from another one: what a viewer or a server
//! does.
//!
//! ```text
//! cargo run --release --example background
//! ```

use std::ops::ControlFlow;
use std::sync::mpsc;
use std::thread;

use rfm::{Engine, Experiment, Program};

/// What the thread sends about an instant.
struct Report {
    time: f64,
    steps: u64,
    /// Mean height of the particles, m.
    height: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let program = Program::from_path("examples/pawn.rfm")?.with("particles", 2000.0)?;
    let experiment = Experiment::new(&program, &program.module().scenes[0].name, Engine::Auto)?;
    drop(program); // the experiment owns what it needs

    // no report is kept waiting: the thread goes on when one has been taken
    let (send, reports) = mpsc::sync_channel(0);
    let worker = thread::spawn(move || {
        let mut simulation = experiment.start().map_err(|error| error.to_string())?.simulation;
        for frame in 1..=20 {
            let end = 0.05 * f64::from(frame);
            simulation.advance(end, |_| ControlFlow::Continue(())).map_err(|error| error.to_string())?;
            let z = &simulation.particles().position.z;
            let height = z.iter().sum::<f64>() / z.len() as f64;
            let report = Report { time: simulation.time(), steps: simulation.steps(), height };
            if send.send(report).is_err() {
                break; // the receiver is gone
            }
        }
        Ok::<u64, String>(simulation.steps())
    });

    for Report { time, steps, height } in reports {
        println!("t = {time:.2} s, {steps} steps, mean height {height:.3} m");
        if height < 0.9 {
            break; // dropping the receiver ends the thread
        }
    }
    let steps = worker.join().map_err(|_| "the simulation's thread panicked")??;
    println!("stopped after {steps} steps");
    Ok(())
}
