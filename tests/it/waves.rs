//! A free wave, which nothing but what the method does brakes.

use std::ops::ControlFlow;

use rfm::{Engine, Experiment, Program};

/// The lowest standing wave of a tank one metre long and half a metre deep: fourteen layers, four particles wide.
fn wave(method: &str) -> String {
    format!(
        "rfm 1
let s = 0.5/14
scene wave {{
  box {{ max: [1, 4*s, 1] }}
  fluid water {{ shape: box([0, 0, 0], [1, 4*s, 1]) and z <= 0.5 + 0.05*cos(pi*x), density: 1000, spacing: s }}
  method: {method}
  run {{ until: 2.4 s }}
}}"
    )
}

/// The greatest kinetic energies, J, in each half period of 0.6 s.
fn swings(method: &str) -> [f64; 4] {
    let program = Program::from_source("wave.rfm", wave(method)).unwrap_or_else(|e| panic!("{e}"));
    let experiment = Experiment::new(&program, "wave", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    let mut most = [0.0; 4];
    simulation
        .advance(2.4, |simulation| {
            let half = (simulation.time() / 0.6) as usize;
            if let Some(most) = most.get_mut(half) {
                *most = f64::max(*most, simulation.stats().kinetic_energy);
            }
            ControlFlow::Continue(())
        })
        .unwrap_or_else(|e| panic!("{e}"));
    most
}

/// An artificial viscosity of the whole motion would leave 0.81 of the height after a period, with either method.
#[test]
#[ignore = "long"]
fn a_free_wave_keeps_its_height() {
    for method in ["wcsph", "dfsph"] {
        let swings = swings(method);
        let left = (swings[2] / swings[0]).sqrt();
        println!("{method}: {swings:.3?} J, after a period {left:.3} of the height");
        assert!((0.84..1.0).contains(&left), "{method}: {left}");
    }
}
