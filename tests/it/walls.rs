//! Walls a thousandth of a millimetre thick, corners and cusps hold particles at 100 m/s. This is judged
//! after every step by where the particles are, not by what the solver says about itself.

use std::sync::Arc;

use rfm::experiment::Start;
use rfm::field::Walls;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::lower::Scene;
use rfm::sph::{Obstacle, Paper, Parameters, Particles, Simulation};
use rfm::{Engine, Experiment, Program, Solid};

use crate::random::Random;
use crate::tool::rfm;

/// Hollow bodies with a wall of 1e-6, and the hollows inside them.
const SHELLS: &str = "rfm 1
let w = 1e-6
solid plate = abs(z - 0.1*x) <= w/2
solid room_in = box([-0.5, -0.4, -0.3], [0.5, 0.4, 0.3])
solid room = box([-0.5 - w, -0.4 - w, -0.3 - w], [0.5 + w, 0.4 + w, 0.3 + w]) \\ room_in
solid bubble_in = sphere(0.5)
solid bubble = sphere(0.5 + w) \\ bubble_in
solid hat_in = cone(0.5, 0.9)
solid hat = cone(0.5 + 2*w, 0.9 + 4*w).move([0, 0, -w]) \\ hat_in
solid tyre_in = torus(0.6, 0.25)
solid tyre = torus(0.6, 0.25 + w) \\ tyre_in
solid cave_in = ball([0.2, 0, 0], 0.4) or ball([-0.3, 0.1, 0], 0.35) or cylinder(0.1, 0.8)
solid cave = (ball([0.2, 0, 0], 0.4 + w) or ball([-0.3, 0.1, 0], 0.35 + w) or cylinder(0.1 + w, 0.8 + 2*w).move([0, 0, -w]))
  \\ cave_in
solid spikes = any i in 0..8: cone(0.15, 0.8).rotate_y(i*45 deg).move([0.02*i, 0, 0])
";

fn solid(name: &str) -> Solid {
    Program::from_source("shells.rfm", SHELLS).unwrap_or_else(|e| panic!("{e}")).solid(name).unwrap()
}

/// Free particles at 100 m/s among obstacles. `check` is called for every particle after every step.
fn fly(field: Arc<dyn Walls>, starts: &[DVec3], steps: usize, check: &dyn Fn(DVec3, DVec3) -> bool) {
    let mut random = Random(17);
    let mut fluid = Particles::default();
    for &start in starts {
        fluid.push(start, 100.0 * random.around(1.0).normalize());
    }
    let parameters = Parameters {
        method: Paper { stiffness: 0.0, ..Paper::default() }.into(),
        viscosity: 0.0,
        surface_tension: 0.0,
        support_radius: 0.01,
        time_step: 0.002,
        wall_restitution: 1.0,
        ..Parameters::paper()
    };
    let domain = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
    // an infinite resolution, because nothing may depend on it
    let obstacle = Obstacle { restitution: 1.0, ..Obstacle::at_rest(field.clone(), f64::INFINITY) };
    let mut simulation = Simulation::new(parameters, fluid, domain, vec![obstacle]).unwrap();
    for step in 0..steps {
        simulation.step().unwrap();
        let particles = simulation.particles();
        for i in 0..particles.len() {
            let p = particles.position.get(i);
            let start = starts[particles.id[i] as usize];
            assert!(field.omega(p) < 0.0, "step {step}: {p} is inside: {}", field.omega(p));
            assert!(domain.contains(p) && check(start, p), "step {step}: a particle from {start} is at {p}");
        }
    }
    // no particle was caught: the mean speed is near that at the start
    let speeds: f64 = simulation.particles().velocity.iter().map(DVec3::length).sum();
    assert!(speeds > 50.0 * starts.len() as f64, "{}", speeds / starts.len() as f64);
}

fn starts(count: usize, fits: impl Fn(DVec3) -> bool) -> Vec<DVec3> {
    let mut random = Random(4);
    std::iter::from_fn(|| Some(random.around(1.0))).filter(|p| fits(*p)).take(count).collect()
}

#[test]
fn nothing_leaves_a_hollow() {
    for name in ["room", "bubble", "hat", "tyre", "cave"] {
        let (shell, hollow) = (solid(name), solid(&format!("{name}_in")));
        let starts = starts(500, |p| hollow.omega(p) > 0.01);
        fly(Arc::new(shell.clone()), &starts, 200, &|_, p| hollow.omega(p) >= 0.0);
    }
}

#[test]
fn nothing_enters_or_passes() {
    let plate = solid("plate");
    let above = |p: DVec3| p.z > 0.1 * p.x;
    fly(Arc::new(plate.clone()), &starts(1_000, |p| (p.z - 0.1 * p.x).abs() > 0.01), 200, &|start, p| {
        above(start) == above(p)
    });
    let spikes = solid("spikes");
    fly(Arc::new(spikes.clone()), &starts(1_000, |p| spikes.omega(p) < -0.01), 200, &|_, _| true);
}

/// A blade turns through a tray of water, closed by lids of the box.
const STIRRED: &str = "rfm 1
solid blade = box([-0.02, -0.15, -0.35], [0.02, 0.15, -0.1]).rotate_z(pi*t)
scene stirred {
  box { min: [-0.4, -0.4, -0.5], max: [0.4, 0.4, 0.5] }
  obstacle { solid: blade }
  fluid water { shape: z <= -0.1, density: 1000, spacing: 5 cm, viscosity: 1 Pa·s, start: hydrostatic }
  method: wcsph
  run { until: 0.4 s, save_every: 0.05 s }
}";

/// A flap as wide as its tank. The nearest way out of it may lead through the tank's wall.
const FLAP: &str = "rfm 1
solid blade = box([-0.02, -0.2, 0], [0.02, 0.2, 0.5]).rotate_y(0.3*sin(6*t))
scene wavy {
  box { min: [-0.6, -0.2, 0], max: [0.6, 0.2, 0.6] }
  obstacle { solid: blade }
  fluid water { shape: (z <= 0.3) \\ box([-0.05, -1, 0], [0.05, 1, 1]), density: 1000, spacing: 4 cm, start: hydrostatic }
  method: wcsph
  run { until: 2 s, save_every: 0.05 s }
}";

/// Balls in a corner, enough of them for a cell map that knows only their sign, and coarse particles far away
/// from them.
const FAR_BALLS: &str = "rfm 1
solid balls = any i in 0..40: ball([0.05 + 0.01*i, 0.1, 0.1], 0.02)
scene apart {
  box { min: [0, 0, 0], max: [3, 3, 3] }
  obstacle { solid: balls }
  fluid water { shape: box([1.5, 1.5, 1.5], [2.9, 2.9, 2.9]), density: 1000, spacing: 0.2, viscosity: 0, surface_tension: 0 }
  method: paper
  run { until: 0.01 s, save_every: 0.01 s }
}";

#[test]
fn what_is_far_from_many_balls_is_not_too_close_to_them() {
    with_scene(FAR_BALLS, |_, _, simulation, carved| {
        assert!(carved == 0 && simulation.particles().len() > 300, "{carved} carved");
    });
}

/// Passes on a file's scene at its start, with the number of particles that were carved off.
fn with_scene(text: &str, look: impl FnOnce(&Program, &Scene, &mut Simulation, usize)) {
    let program = Program::from_source("scene.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let scene = &program.module().scenes[0];
    let experiment = Experiment::new(&program, &scene.name, Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let Start { mut simulation, carved, .. } = experiment.start().unwrap_or_else(|e| panic!("{e}"));
    look(&program, scene, &mut simulation, carved);
}

/// A lone particle floats at rest. A wall comes along and must not pass over it.
const STONE: &str = "rfm 1
solid wall = box([-0.1, -1, -0.1], [0, 1, 0.5]).move([-0.2 + 0.5*t, 0, 0])
scene pushed {
  box { min: [-0.5, -0.2, 0], max: [0.6, 0.2, 0.5], restitution: 0, friction: 1 }
  obstacle { solid: wall, restitution: 0 }
  fluid stone { shape: ball([0, 0, 0.1], 0.01), particles: 1, fill: middle, spacing: 0.01, viscosity: 0, surface_tension: 0 }
  gravity: [0, 0, 0]
  method: paper
  run { until: 0.8 s, save_every: 0.1 s, dt: 1 ms }
}";

#[test]
fn a_wall_takes_along_what_lies_still() {
    with_scene(STONE, |_, scene, simulation, _| {
        while simulation.time() < scene.run.until {
            simulation.step().unwrap_or_else(|e| panic!("{e}"));
            let front = -0.2 + 0.5 * simulation.time();
            let at = simulation.particles().position.get(0);
            assert!(at.x > front, "{at} behind {front} after {} s", simulation.time());
        }
    });
}

#[test]
#[ignore = "long"]
fn a_turning_blade_stays_free_of_water() {
    stays_free(STIRRED);
}

#[test]
#[ignore = "long"]
fn a_flap_as_wide_as_its_tank_pushes_nothing_out_of_it() {
    stays_free(FLAP);
}

fn stays_free(text: &str) {
    with_scene(text, |program, scene, simulation, _| {
        let blade = program.solid("blade").unwrap();
        while simulation.time() < scene.run.until {
            simulation.step().unwrap_or_else(|e| panic!("{e}"));
            let now = blade.at(simulation.time());
            let inside = simulation.particles().position.iter().filter(|&p| now.sign(p) > 0.0).count();
            assert_eq!(inside, 0, "after {} s", simulation.time());
            let outside = simulation.particles().position.iter().find(|p| !scene.domain.contains(*p));
            assert_eq!(outside, None, "after {} s", simulation.time());
        }
    });
}

/// A particle in the slot between two gates of one solid, of which one lifts, in front of a dam. What is
/// around it changes steadily: it comes back as slowly as it came. (By the faces of the gates, of which the
/// nearest count, it met a jump in their middle and left with 11 m/s.)
#[test]
fn gates_that_lift_one_after_another_throw_nothing() {
    let text = "rfm 1
let gate = box([-0.2, -0.3, 0.05], [-0.1, 0.3, 0.65])
solid dam = box([-0.1, -1.125, 0], [0.6, 1.125, 1.2])
solid gates = any k in 0..3: gate.move([0, (k - 1)*0.75, 0.45*clamp((t + 0.53 - k*0.4)/0.5, 0, 1)])
scene slot {
  box { min: [-1, -1.125, 0], max: [0.6, 1.125, 1.5], restitution: 0 }
  obstacle { solid: dam, restitution: 0 }
  obstacle { solid: gates, restitution: 0 }
  gravity: [0, 0, 0]
  fluid water {
    shape: ball([x0, 0.3765, 0.3876], 0.05), particles: 1, spacing: 0.0906, fill: middle,
    velocity: [2.2, 0, 0], viscosity: 0, sound_speed: 60
  }
  method: wcsph
}";
    for x0 in [-0.16, -0.1525] {
        let text = text.replace("x0", &x0.to_string());
        let program = Program::from_source("slot.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        let experiment = Experiment::new(&program, "slot", Engine::Auto).unwrap();
        let mut simulation = experiment.start().unwrap().simulation;
        let mut fastest: f64 = 0.0;
        while simulation.time() < 0.02 {
            simulation.step().unwrap();
            fastest = fastest.max(simulation.speed());
        }
        // the gate that rises at 0.9 m/s may add a little
        assert!(fastest < 1.02 * 2.2, "{x0}: {fastest} m/s");
    }
}

/// A run that is stopped while a wall moves, before a gate opens and after, goes on as if it had not been: what walls have
/// taken of densities, the velocity of a vessel, and the pace of the fluid are in its checkpoints.
#[test]
fn a_run_that_is_stopped_while_walls_move_goes_on_as_if_it_had_not_been() {
    let gate = |method: &str| {
        format!(
            "rfm 1\nsolid gate = if t < 0.04 then box([0.1, -1, -1], [0.12, 1, 1]) else sphere(0.01).move([0.35, 0.05, 0.15])\n\
             scene s {{\n  box {{ min: [0, 0, 0], max: [0.4, 0.1, 0.2] }}\n  obstacle {{ solid: gate }}\n  \
             fluid w {{ shape: box([0, 0, 0], [0.1, 0.1, 0.1]), spacing: 2 cm }}\n  method: {method}\n  \
             run {{ until: 100 ms, save_every: 20 ms }}\n}}\n"
        )
    };
    let tank = "rfm 1\nsolid tank = not box([0, 0, 0], [0.2, 0.1, 0.1]).move([t^2, 0, 0])\n\
                scene s {\n  box { min: [-0.1, -0.1, -0.1], max: [0.5, 0.2, 0.2], restitution: 0 }\n  \
                gravity: [0, 0, 0]\n  obstacle { solid: tank, restitution: 0 }\n  \
                fluid w { shape: box([0, 0, 0], [0.2, 0.1, 0.1]), spacing: 2 cm }\n  method: dfsph\n  \
                run { until: 100 ms, save_every: 20 ms }\n}\n";
    for (name, text) in [("wcsph", gate("wcsph")), ("dfsph", gate("dfsph")), ("vessel", tank.to_string())] {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        std::fs::write(here.join("s.rfm"), text).unwrap();
        let run = |flags: &[&str]| {
            let always = ["run", "s.rfm", "--threads", "1", "--no-pictures", "--mesh-cells", "8", "-o"];
            rfm(here, &[&always[..], flags].concat()).expect(0);
        };
        run(&["straight"]);
        // between two frames before the gate opens, and beside one after
        run(&["broken", "--steps", "2"]);
        run(&["broken", "--resume", "--until", "0.06"]);
        run(&["broken", "--resume"]);
        for file in [
            "frames/particles_000003.vtp",
            "frames/particles_000005.vtp",
            "history/energy.csv",
            "history/audit.csv",
        ] {
            let [straight, broken] =
                ["straight", "broken"].map(|of| std::fs::read(here.join(of).join(file)).unwrap());
            assert!(straight == broken, "{name}: {file} differs");
        }
    }
}
