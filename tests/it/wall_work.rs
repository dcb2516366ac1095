//! What walls that move do to the energy of the fluid: the audit measures it, so that it sees what comes from nowhere.

use std::ops::ControlFlow;

use rfm::sph::{Finding, Simulation};
use rfm::{Engine, Experiment, Program};

fn experiment(text: &str) -> Experiment {
    let program = Program::from_source("work.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    Experiment::new(&program, "work", Engine::Auto).unwrap_or_else(|e| panic!("{e}"))
}

fn start(text: &str) -> Simulation {
    experiment(text).start().unwrap_or_else(|e| panic!("{e}")).simulation
}

/// Kinetic, potential and elastic energy, J.
fn energy(simulation: &mut Simulation) -> f64 {
    let mut gauge = simulation.gauge(rfm::sph::Probe::Energy).unwrap();
    simulation.sample(&mut gauge)[3]
}

/// A wall that comes at 2 m/s returns a particle at rest with twice its speed, if nothing is lost.
#[test]
fn a_wall_that_hits_a_particle_gives_it_what_it_has_then() {
    let mut simulation = start(
        "rfm 1
solid wall = box([-1, -1, -1], [0, 2, 2]).move([2*t - 0.5, 0, 0])
scene work {
  box { min: [-1, 0, 0], max: [3, 1, 1] }
  obstacle { solid: wall, restitution: 1 }
  fluid dust { shape: ball([0.1, 0.5, 0.5], 0.05), particles: 1, mass: 0.3 kg }
  gravity: [0, 0, 0]
  method: paper
  run { until: 1 s, dt: 1 ms }
}",
    );
    simulation.advance(0.5, |_| ControlFlow::Continue(())).unwrap();
    let given = 0.5 * 0.3 * 16.0;
    let (found, work) = (energy(&mut simulation), simulation.audit().wall_work());
    assert!((found - given).abs() < 1e-9 && (work - given).abs() < 1e-9, "{found} {work}");
    assert!(simulation.audit().energy_excess().unwrap() < 1e-9);
}

const PISTON: &str = "rfm 1
let way = 0.3*where(t <= 1, t^2*(3 - 2*t), 1)
solid piston = box([-0.4, -0.1, -0.1], [0, 0.7, 1.1]).move([way, 0, 0])
scene work {
  box { min: [0, 0, 0], max: [1.5, 0.3, 1] }
  obstacle { solid: piston, restitution: 0 }
  fluid water { shape: box([0, 0, 0], [1.5, 0.3, 0.45]), density: 1000, spacing: 0.0375, viscosity: 0 }
  method: METHOD
  run { until: 3 s }
}";

/// A piston that pushes half a metre of water together and rests again: the water keeps what it was given, less a little
/// artificial viscosity. The sum of force times way has the error of the steps and of forces in corners.
#[test]
fn a_piston_gives_what_the_water_has_then() {
    for method in ["wcsph", "dfsph"] {
        let mut simulation = start(&PISTON.replace("METHOD", method));
        let before = energy(&mut simulation);
        simulation.advance(1.2, |_| ControlFlow::Continue(())).unwrap();
        let gained = energy(&mut simulation) - before;
        let audit = simulation.audit();
        let (work, excess) = (audit.wall_work(), audit.energy_excess().unwrap());
        println!("{method}: {work:.2} J of work, {gained:.2} J gained, {excess:.1e}");
        assert!(gained > 50.0 && (gained / work - 1.0).abs() < 0.04, "{method}: {gained} of {work}");
        assert!(excess < 8e-3, "{method}: {excess}");
        assert_eq!(simulation.findings(), [], "{method}");
    }
}

/// The same if probes ask for the force on it, which is found in every step, for a piston in a corner as well.
#[test]
fn work_does_not_depend_on_whether_forces_are_asked_for() {
    for method in ["wcsph", "dfsph"] {
        let [work, of_all_steps] = ["", "  probe push { force: piston }\n"].map(|probe| {
            let text = PISTON.replace("METHOD", method).replacen("  method", &format!("{probe}  method"), 1);
            let experiment = experiment(&text);
            let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
            for probe in &experiment.scene().probes {
                simulation.gauge(rfm::experiment::probe_of(&probe.measured)).unwrap();
            }
            simulation.advance(0.6, |_| ControlFlow::Continue(())).unwrap();
            let audit = simulation.audit();
            println!("{method}: {} J, {:?}", audit.wall_work(), audit.energy_excess());
            audit.wall_work()
        });
        assert!((work / of_all_steps - 1.0).abs() < 0.01, "{method}: {work} {of_all_steps}");
    }
}

/// Water that has dissipated most of what a stirrer gave, and then gains speed from nowhere.
#[test]
fn energy_from_nowhere_is_found_beside_a_stirrer() {
    let experiment = experiment(
        "rfm 1
solid blade = box([-0.3, -0.05, 0], [0.3, 0.05, 0.3]).rotate_z(6*t)
scene work {
  box { min: [-0.4, -0.4, 0], max: [0.4, 0.4, 0.8] }
  obstacle { solid: blade, restitution: 0 }
  fluid water { shape: z <= 0.4, density: 1000, spacing: 0.08 }
  method: wcsph
  run { until: 3 s }
}",
    );
    let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    simulation.advance(0.5, |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(simulation.findings(), []);
    let audit = simulation.audit();
    let (work, at_start) = (audit.wall_work(), 1000.0 * 0.24 * 9.81 * 0.2);
    assert!(work > 0.1 * at_start, "{work}");
    let mut checkpoint = simulation.checkpoint();
    let column = checkpoint.get("velocity z").unwrap().iter().map(|v| v + 1.0).collect();
    checkpoint.set("velocity z", column);
    let mut simulation = experiment.resume(&checkpoint).unwrap();
    assert_eq!(simulation.audit().wall_work(), work, "it goes on from the checkpoint");
    simulation.step().unwrap();
    assert!(matches!(simulation.findings()[..], [(Finding::Energy, _)]), "{:?}", simulation.findings());
}
