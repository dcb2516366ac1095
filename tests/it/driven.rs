//! Runs with walls that move: what they drag along, and what they push.

use rfm::glam::DVec3;
use rfm::solid::Engine;
use rfm::{Experiment, Program};

/// A drum that turns drags the fluid that sticks to it as much as one at rest whose surface moves as fast.
#[test]
fn a_turning_drum_drags_the_fluid_along() {
    let mean_turn = |drum: &str, surface: &str| {
        let text = format!(
            "rfm 1
solid drum = {drum}
solid vessel = cylinder(1, 2).move([0, 0, -1])
scene flow {{
  box {{ min: [-1.1, -1.1, 0], max: [1.1, 1.1, 0.5] }}
  container {{ solid: vessel, walls: no_slip }}
  obstacle {{ solid: drum, walls: no_slip{surface} }}
  fluid oil {{ shape: 0.25 <= x^2 + y^2 <= 1, density: 1000, spacing: 0.125, viscosity: 100, sound_speed: 10 }}
  gravity: [0, 0, 0]
  run {{ until: 1 s, dt: 0.5 ms }}
}}"
        );
        let program = Program::from_source("drum.rfm", text).unwrap();
        let mut simulation =
            Experiment::new(&program, "flow", Engine::Auto).unwrap().start().unwrap().simulation;
        for _ in 0..100 {
            simulation.step().unwrap();
        }
        let particles = simulation.particles();
        let turn = |(p, v): (DVec3, DVec3)| (p.x * v.y - p.y * v.x) / p.truncate().length();
        particles.position.iter().zip(particles.velocity.iter()).map(turn).sum::<f64>()
            / particles.len() as f64
    };
    let drum = "cylinder(0.5, 2).move([0, 0, -1])";
    let turning = mean_turn(&format!("{drum}.rotate_z(2*t)"), "");
    let belt = mean_turn(drum, ", surface_velocity: [-2*y, 2*x, 0]");
    let both = mean_turn(&format!("{drum}.rotate_z(2*t)"), ", surface_velocity: [-2*y, 2*x, 0]");
    let still = mean_turn(drum, "");
    assert!(still.abs() < 1e-3 && belt > 0.05, "{still} {belt}");
    // the map of what a body takes of kernels turns with it, and is right to 0.0006
    assert!((turning / belt - 1.0).abs() < 0.01, "{turning} {belt}");
    // what is stated takes the place of what the motion says
    assert!((both / belt - 1.0).abs() < 0.01, "{both} {belt}");
}

/// A run of a scene that is given as text: its simulation at the end, or the error that ended it.
fn run(text: &str) -> Result<rfm::sph::Simulation, rfm::sph::StepError> {
    let program = Program::from_source("moving.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let scene = &program.module().scenes[0];
    let experiment = Experiment::new(&program, &scene.name, Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    simulation.advance(scene.run.until, |_| std::ops::ControlFlow::Continue(()))?;
    Ok(simulation)
}

/// A piston comes along x, at 0.5 m/s, and a ball is in its way to the right wall, which it touches.
fn piston(method: &str, until: f64) -> String {
    format!(
        "rfm 1\n\
         solid piston = box([-1, -1, -1], [0.1, 2, 2]).move([0.5*t, 0, 0])\n\
         solid stone = ball([0.7, 0.2, 0.2], 0.15)\n\
         scene pressed {{\n\
         box {{ max: [0.85, 0.4, 0.8] }}\n\
         obstacle {{ solid: piston }}\n\
         obstacle {{ solid: stone }}\n\
         fluid water {{ shape: box([0.2, 0.05, 0.05], [0.5, 0.35, 0.35]), density: 1000, spacing: 0.05 }}\n\
         method: {method}\n\
         run {{ until: {until} s, save_every: {until} s }}\n\
         }}\n"
    )
}

#[test]
fn a_piston_that_passes_a_stone_leaves_nothing_inside() {
    for method in ["paper", "wcsph", "dfsph"] {
        // at its end the piston has pushed halfway over the stone; above it there is room
        let simulation = run(&piston(method, 1.2)).unwrap_or_else(|e| panic!("{method}: {e}"));
        let stats = simulation.stats();
        assert_eq!((stats.inside, stats.lost), (0, 0), "{method}");
    }
}

#[test]
fn walls_that_leave_no_room_end_the_run_and_say_so() {
    // the piston goes on to the right wall, and nothing is left of the box
    for method in ["paper", "wcsph", "dfsph"] {
        let error = run(&piston(method, 2.0)).err().unwrap_or_else(|| panic!("{method}"));
        match error {
            rfm::sph::StepError::NoRoom { .. } => {
                assert!(error.to_string().contains("no room for particle"), "{error}");
            }
            // what cannot be compressed is pressed out so fast that no step is short enough
            rfm::sph::StepError::Stalled { .. } => assert_eq!(method, "dfsph", "{error}"),
            other => panic!("{method}: {other}"),
        }
    }
}

#[test]
fn a_body_that_passes_over_the_fluid_in_one_step_leaves_nothing_inside() {
    let scene = |speed: f64, dt: f64| {
        format!(
            "rfm 1\n\
             solid block = box([-1, 0, 0], [-0.2, 1, 0.6]).move([{speed}*t, 0, 0])\n\
             scene hit {{\n\
             box {{ max: [1, 1, 1] }}\n\
             obstacle {{ solid: block }}\n\
             fluid water {{ shape: box([0.2, 0.2, 0], [0.5, 0.5, 0.3]), density: 1000, spacing: 0.05 }}\n\
             method: paper\n\
             run {{ dt: {dt}, until: {}, save_every: {} }}\n\
             }}\n",
            1.0 / speed,
            1.0 / speed
        )
    };
    for (speed, dt) in [(1.0, 1e-3), (1e2, 1e-3), (1e4, 1e-4), (1.0, 1.0)] {
        match run(&scene(speed, dt)) {
            Ok(simulation) => assert_eq!(simulation.stats().inside, 0, "{speed} {dt}"),
            Err(error) => {
                assert!(matches!(error, rfm::sph::StepError::NoRoom { .. }), "{speed} {dt}: {error}");
            }
        }
    }
}
