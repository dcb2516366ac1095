//! Runs with walls that move: what they drag along, and what they push.

use rfm::glam::DVec3;
use rfm::solid::Engine;
use rfm::{Experiment, Program};

/// A drum that turns drags the fluid that sticks to it as much as one at rest whose surface moves as fast.
#[test]
#[ignore = "long"]
fn a_turning_drum_drags_the_fluid_along() {
    // four spacings across: with a support of three, where the packed particles begin would weigh more
    let mean_turn = |drum: &str, surface: &str| {
        let text = format!(
            "rfm 1
solid drum = {drum}
solid vessel = cylinder(1, 2).move([0, 0, -1])
scene flow {{
  box {{ min: [-1.1, -1.1, 0], max: [1.1, 1.1, 0.5] }}
  container {{ solid: vessel, walls: no_slip }}
  obstacle {{ solid: drum, walls: no_slip{surface} }}
  fluid oil {{ shape: 0.25 <= x^2 + y^2 <= 1, density: 1000, spacing: 0.125, support_radius: 2.6*0.125, viscosity: 100, sound_speed: 10 }}
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
    // the map of what a body takes of kernels turns with it, and is right to 0.0006; so particles that are
    // moved apart beside the drum begin elsewhere, some by 0.4 spacings, which makes up to three hundredths
    // of eight spacings
    assert!((turning / belt - 1.0).abs() < 0.04, "{turning} {belt}");
    // what is stated takes the place of what the motion says
    assert!((both / turning - 1.0).abs() < 1e-6, "{both} {turning}");
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

/// The times, s, between which the steps of a run lie, until `until`.
fn times(text: &str, until: f64) -> Vec<f64> {
    let program = Program::from_source("moving.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let experiment = Experiment::new(&program, "flow", Engine::Auto).unwrap();
    let mut simulation = experiment.start().unwrap().simulation;
    let mut times = vec![0.0];
    while simulation.time() < until {
        simulation.step().unwrap();
        times.push(simulation.time());
    }
    times
}

/// Water that moves with its tank moves as in a tank at rest: along and across the walls, lifted, and turned
/// as a whole. (When `dfsph` continued velocities behind walls as if these were at rest, 5 m/s stirred the
/// water to 0.9 m/s.)
#[test]
#[ignore = "long"]
fn a_tank_carries_its_water_along() {
    let stirred = |method: &str, motion: &str, velocity: [&str; 3]| {
        let [u, v, w] = velocity;
        let simulation = run(&format!(
            "rfm 1\n\
             solid tank = box([-0.2, -0.15, 0], [0.2, 0.15, 0.4]){motion}\n\
             scene s {{\n\
             box {{ min: [-0.5, -0.5, -0.1], max: [4, 0.5, 2.5] }}\n\
             container {{ solid: tank }}\n\
             fluid water {{ shape: box([-0.2, -0.15, 0], [0.2, 0.15, 0.25]), density: 1000, spacing: 0.05, \
                            velocity: [{u}, {v}, {w}] }}\n\
             method: {method}\n\
             run {{ until: 0.4 s }}\n\
             }}\n"
        ))
        .unwrap();
        let particles = simulation.particles();
        let of = |motion: &dyn Fn(DVec3) -> DVec3| {
            let moving = particles.position.iter().zip(particles.velocity.iter());
            let squares = moving.map(|(p, v)| (v - motion(p)).length_squared()).sum::<f64>();
            (squares / particles.len() as f64).sqrt()
        };
        [of(&|_| DVec3::ZERO), of(&|_| 5.0 * DVec3::X), of(&|_| 2.0 * DVec3::Z), of(&|p| DVec3::Z.cross(p))]
    };
    for method in ["dfsph", "wcsph"] {
        let still = stirred(method, "", ["0", "0", "0"])[0];
        let along = stirred(method, ".move([5*t, 0, 0])", ["5", "0", "0"])[1];
        let lifted = stirred(method, ".move([0, 0, 2*t])", ["0", "0", "2"])[2];
        let turned = stirred(method, ".rotate_z(t)", ["-y", "x", "0"])[3];
        println!("{method}: {still} {along} {lifted} {turned}");
        // faster fluids have shorter steps, and the surface of what turns is not where it began
        for found in [along, lifted, turned] {
            assert!(found < 0.02 + 1.5 * still, "{method}: {along} {lifted} {turned}, at rest {still}");
        }
    }
}

/// Nothing falls and the fluid is at rest, so only the ball limits the steps.
#[test]
fn steps_follow_a_body_in_a_fluid_at_rest() {
    let flow = |motion: &str| {
        format!(
            "rfm 1\n\
             solid ball = sphere(0.1).move([0.3 + {motion}, 0.25, 0.25])\n\
             scene flow {{\n\
             box {{ max: [1, 0.5, 0.5] }}\n\
             obstacle {{ solid: ball }}\n\
             fluid water {{ shape: box([0, 0, 0], [0.6, 0.5, 0.5]), density: 1000, spacing: 0.05 }}\n\
             gravity: [0, 0, 0]\n\
             method: dfsph\n\
             run {{ until: 1 s }}\n\
             }}\n"
        )
    };
    // it swings by a fifth of a spacing: no step is too long for its way, but it must be seen to swing
    let period = std::f64::consts::TAU / 20.0;
    let swings = times(&flow("0.01*sin(20*t)"), period).len() - 1;
    assert!((14..80).contains(&swings), "{swings} steps in a period");
    // in a step a fast one moves by 0.4 spacings
    let speed = 5.0;
    let steps = times(&flow("5*t"), 0.02);
    let longest = steps.windows(2).map(|t| speed * (t[1] - t[0])).fold(0.0, f64::max);
    assert!(longest <= 0.4 * 0.05 * (1.0 + 1e-9), "{longest} m in a step");
    // steps are long again where the ball has not yet set out
    let waits = times(&flow("5*max(t - 0.3, 0)"), 0.32);
    let before = waits.iter().filter(|t| **t <= 0.29).count();
    assert!(before < 10 && waits.len() > before + 4, "{before} of {} steps", waits.len());
    // a body that jumps may jump: no step is short enough for its way. The short steps before it stir
    // nothing: the fluid gives way by the centimetre, and gets no speed of that
    let jumps = times(&flow("0.01*floor(10*t)"), 0.25).len();
    assert!((4..1000).contains(&jumps), "{jumps} steps");
    let speed = run(&flow("0.01*floor(10*t)").replace("1 s", "0.25 s")).unwrap().speed();
    assert!(speed < 0.02, "{speed} m/s");
    // one that hurries away from the fluid is none of its business
    let leaves = times(&flow("20 + 50*t"), 0.2).len();
    assert!(leaves < 10, "{leaves} steps");
}

/// A piston comes along x at a speed in m/s, and a ball is in its way to the right wall, which it touches.
fn piston(method: &str, speed: f64, until: f64) -> String {
    format!(
        "rfm 1\n\
         solid piston = box([-1, -1, -1], [0.1, 2, 2]).move([{speed}*t, 0, 0])\n\
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
#[ignore = "long"]
fn a_piston_that_passes_a_stone_leaves_nothing_inside() {
    for method in ["paper", "wcsph", "dfsph"] {
        // at its end the piston has pushed halfway over the stone; above it there is room
        let simulation = run(&piston(method, 0.5, 1.2)).unwrap_or_else(|e| panic!("{method}: {e}"));
        let stats = simulation.stats();
        assert_eq!((stats.inside, stats.lost), (0, 0), "{method}");
    }
}

#[test]
#[ignore = "long"]
fn walls_that_leave_no_room_end_the_run_and_say_so() {
    // the piston goes on to the right wall, and nothing is left of the box
    for method in ["paper", "wcsph", "dfsph"] {
        let error = run(&piston(method, 2.0, 0.5)).err().unwrap_or_else(|| panic!("{method}"));
        match error {
            rfm::sph::StepError::NoRoom { .. } => {
                assert!(error.to_string().contains("no room for particle"), "{error}");
            }
            // what cannot be compressed is pressed out, faster and faster, until no step is short enough
            rfm::sph::StepError::Stalled { .. }
            | rfm::sph::StepError::EnergyDoubled { walls_move: true, .. } => {
                assert_eq!(method, "dfsph", "{error}");
            }
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

/// Walls much thinner than the way that they go in a step carry along what is before them.
#[test]
fn no_particle_is_left_behind_a_thin_wall_that_moves() {
    let foil = |method: &str, speed: f64| {
        let (until, numbers) = (0.5 / speed, if method == "wcsph" { ", sound_speed: 100" } else { "" });
        let text = format!(
            "rfm 1\n\
             solid foil = box([-0.05 mm, -1, -1], [0.05 mm, 2, 2]).move([0.1 + {speed}*t, 0, 0])\n\
             scene push {{\n\
             box {{ max: [2, 0.2, 0.6] }}\n\
             obstacle {{ solid: foil }}\n\
             fluid water {{ shape: box([0.15, 0, 0], [0.5, 0.2, 0.2]), density: 1000, spacing: 0.05{numbers} }}\n\
             method: {method}\n\
             run {{ until: {until}, save_every: {until} }}\n\
             }}\n"
        );
        let simulation = run(&text).unwrap_or_else(|e| panic!("{method}, {speed} m/s: {e}"));
        let particles = simulation.particles();
        let behind = particles.position.iter().filter(|p| p.x < 0.1 + speed * until).count();
        assert_eq!(behind, 0, "{method}, {speed} m/s: {behind} of {}", particles.len());
    };
    for method in ["paper", "wcsph", "dfsph"] {
        for speed in [1.0, 30.0] {
            foil(method, speed);
        }
    }
}

#[test]
fn no_particle_passes_a_thin_blade_that_turns() {
    let text = "rfm 1
solid blade = box([-0.3, -0.5 mm, -1], [0.3, 0.5 mm, 1]).rotate_z(20*t)
solid pot = cylinder(0.3, 2).move([0, 0, -1])
scene mix {
  box { min: [-0.35, -0.35, 0], max: [0.35, 0.35, 0.16] }
  container { solid: pot }
  obstacle { solid: blade }
  fluid water { shape: cylinder(0.3, 0.1), spacing: 0.04, density: 1000, sound_speed: 60 }
  run { until: 0.1 s, save_every: 0.1 s }
}";
    let program = Program::from_source("mix.rfm", text).unwrap();
    let mut simulation = Experiment::new(&program, "mix", Engine::Auto).unwrap().start().unwrap().simulation;
    let side = |p: DVec3, angle: f64| p.y * angle.cos() > p.x * angle.sin();
    let begin: Vec<bool> = by_number(&simulation).into_iter().map(|p| side(p, 0.0)).collect();
    simulation.advance(0.1, |_| std::ops::ControlFlow::Continue(())).unwrap();
    let end: Vec<bool> = by_number(&simulation).into_iter().map(|p| side(p, 2.0)).collect();
    assert_eq!(begin, end);
}

/// The places of all particles, by their numbers.
fn by_number(simulation: &rfm::sph::Simulation) -> Vec<DVec3> {
    let particles = simulation.particles();
    let mut all: Vec<_> = particles.id.iter().copied().zip(particles.position.iter()).collect();
    all.sort_by_key(|(id, _)| *id);
    all.into_iter().map(|(_, p)| p).collect()
}

/// A slab of oil that rubs on a floor between walls along which it slips: what it loses is what the floor feels.
#[test]
fn a_floor_feels_all_of_the_friction() {
    for method in ["wcsph", "dfsph"] {
        let text = format!(
            "rfm 1
solid slab = box([-5, -2, -1], [5, 2, 0])
scene rub {{
  box {{ min: [-1, -0.2, -0.3], max: [3, 0.2, 0.5] }}
  obstacle {{ solid: slab, walls: no_slip }}
  fluid oil {{ shape: box([-0.5, -0.2, 0], [0, 0.2, 0.2]), spacing: 0.04, density: 1000, viscosity: 20, velocity: [1, 0, 0] }}
  method: {method}
  probe f {{ force: slab, every: 1 ms }}
  run {{ until: 50 ms, save_every: 50 ms }}
}}"
        );
        let program = Program::from_source("rub.rfm", text).unwrap();
        let mut simulation =
            Experiment::new(&program, "rub", Engine::Auto).unwrap().start().unwrap().simulation;
        let momentum = |simulation: &rfm::sph::Simulation| {
            let mass = simulation.parameters().particle_mass;
            mass * simulation.particles().velocity.iter().map(|v| v.x).sum::<f64>()
        };
        let begin = momentum(&simulation);
        let (mut felt, mut time) = (0.0, 0.0);
        let mut gauge = simulation.gauge(rfm::sph::Probe::Force { obstacle: 0, about: DVec3::ZERO }).unwrap();
        while simulation.time() < 0.05 {
            simulation.step().unwrap();
            felt += simulation.sample(&mut gauge)[0] * (simulation.time() - time);
            time = simulation.time();
        }
        let lost = begin - momentum(&simulation);
        // friction with the floor brakes it by a tenth at least
        assert!(lost > 0.1 * begin && (felt / lost - 1.0).abs() < 0.02, "{method}: {felt} of {lost}");
    }
}

/// A cup of 1 mm that swings as it goes: its corners and its curved wall come from several sides at once.
#[test]
fn a_thin_cup_that_swings_keeps_what_is_in_it() {
    let text = "rfm 1
solid cup = (cylinder(0.3, 0.5) \\ cylinder(0.299, 0.499).move([0, 0, 0.001])).move([1.5*t, 0, 0]).rotate_y(0.5*sin(10*t))
scene carry {
  box { min: [-1, -1, -1], max: [2.5, 1, 1.5] }
  obstacle { solid: cup }
  fluid water { shape: cylinder(0.28, 0.2).move([0, 0, 0.01]), spacing: 0.05, density: 1000 }
  run { until: 0.15 s, save_every: 0.15 s }
}";
    let simulation = run(text).unwrap_or_else(|e| panic!("{e}"));
    let (sin, cos) = (0.5 * f64::sin(1.5)).sin_cos();
    for p in simulation.particles().position.iter() {
        // back into the cup's own frame
        let own = DVec3::new(cos * p.x - sin * p.z - 0.225, p.y, sin * p.x + cos * p.z);
        let is_in = own.z > 0.0009 && own.truncate().length() < 0.2991;
        assert!(is_in || own.z > 0.4, "{p} is at {own} in the cup");
    }
}

/// A body that hardly changes its shape leaves water at rest, as a body at rest does. Without maps of its
/// volume, the closed forms of the bent faces of a ball three spacings in radius threw particles away at 7
/// m/s.
#[test]
#[ignore = "long"]
fn a_shape_that_hardly_changes_leaves_water_at_rest() {
    let fastest = |change: &str| {
        let simulation = run(&format!(
            "rfm 1
solid b = sphere(0.15 + {change}*t).move([0.25, 0.25, 0.25])
scene s {{
  box {{ max: [0.5, 0.5, 0.6] }}
  obstacle {{ solid: b }}
  fluid water {{ shape: box([0, 0, 0], [0.5, 0.5, 0.5]) \\ b, density: 1000, spacing: 0.05, start: hydrostatic }}
  method: wcsph
  run {{ until: 0.05 s }}
}}"
        ));
        simulation.unwrap().audit().max_speed()
    };
    let (still, changing) = (fastest("0"), fastest("1e-9"));
    println!("{still} and {changing} m/s");
    assert!(changing < 1.1 * still, "{changing} m/s beside one that changes, {still} m/s beside one at rest");
}

/// A ball that grows in water lifts its level by its volume, and is carried by the weight of what it displaces then.
#[test]
#[ignore = "long"]
fn a_ball_that_grows_displaces_its_volume() {
    let text = "rfm 1
solid b = sphere(0.15 + 0.1*clamp(2*t, 0, 1)).move([0.5, 0.5, 0.35])
scene s {
  box { max: [1, 1, 0.9] }
  obstacle { solid: b }
  fluid water { shape: box([0, 0, 0], [1, 1, 0.7]) \\ b, density: 1000, particles: 1750, start: hydrostatic }
  method: wcsph
  run { until: 1 s }
}";
    let program = Program::from_source("grows.rfm", text).unwrap();
    let mut simulation = Experiment::new(&program, "s", Engine::Auto).unwrap().start().unwrap().simulation;
    let probe = rfm::sph::Probe::Force { obstacle: 0, about: DVec3::ZERO };
    let mut gauge = simulation.gauge(probe).unwrap();
    simulation.advance(0.8, |_| std::ops::ControlFlow::Continue(())).unwrap();
    simulation.sample(&mut gauge);
    simulation.advance(1.0, |_| std::ops::ControlFlow::Continue(())).unwrap();
    let force = simulation.sample(&mut gauge)[2];
    let weight = 9810.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.25_f64.powi(3);
    let speed = simulation.audit().max_speed();
    println!("{force} N for {weight} N, at most {speed} m/s");
    // its radius is four spacings, the water still sways, and particles that were pushed aside lie less
    // densely: 7 % too much, 3 % with twice as many particles. The surface moves at 0.2 m/s
    assert!((force / weight - 1.0).abs() < 0.1, "{force} N for {weight} N");
    assert!(speed < 0.8, "{speed} m/s");
}

/// A ball that swings fast, and not far, in a box full of water: the fluid moves along with half of the
/// ball's volume, if its sound is fast enough for it.
#[test]
#[ignore = "long"]
fn a_ball_that_swings_has_the_added_mass_of_half_its_volume() {
    let text = "rfm 1
solid ball = sphere(0.1).move([0.01*(1 - cos(2*pi*5*t)), 0, 0])
scene s {
  box { min: [-0.3, -0.3, -0.3], max: [0.3, 0.3, 0.3] }
  obstacle { solid: ball }
  fluid water { shape: box([-0.3, -0.3, -0.3], [0.3, 0.3, 0.3]), density: 1000, spacing: 3 cm, artificial_viscosity: 0.02 }
  gravity: [0, 0, 0]
  method: wcsph
  run { until: 0.4 s }
}";
    let program = Program::from_source("swings.rfm", text).unwrap();
    let experiment = Experiment::new(&program, "s", Engine::Auto).unwrap();
    let mut simulation = experiment.start().unwrap().simulation;
    let probe = rfm::sph::Probe::Force { obstacle: 0, about: DVec3::ZERO };
    let mut gauge = simulation.gauge(probe).unwrap();
    let (mut sum, mut square) = (0.0, 0.0);
    for k in 1..=100 {
        let time = 0.2 + 0.002 * f64::from(k);
        simulation.advance(time, |_| std::ops::ControlFlow::Continue(())).unwrap();
        let force = simulation.sample(&mut gauge)[0];
        // the mean since the last sample
        let acceleration = 0.01
            * (10.0 * std::f64::consts::PI).powi(2)
            * (10.0 * std::f64::consts::PI * (time - 0.001)).cos();
        sum -= force * acceleration;
        square += acceleration * acceleration;
    }
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.1_f64.powi(3);
    let added = sum / square / (1000.0 * volume);
    println!("added mass {added} of the displaced, typical speed {} m/s", experiment.typical_speed());
    // in a box six radii wide potential flow gives some 0.53; the ball is three spacings in radius, and acts larger
    assert!((0.5..0.85).contains(&added), "{added}");
}

/// A wall that moves, or is accelerated, gives the speed of sound where that is faster than a fall through the box.
#[test]
fn fast_walls_are_expected() {
    let speed = |motion: &str, gravity: f64| {
        let text = format!(
            "rfm 1
solid piston = box([-1, -1, -1], [0.1, 2, 2]).{motion}
scene push {{
  box {{ max: [1, 1, 1] }}
  obstacle {{ solid: piston }}
  fluid water {{ shape: box([0.3, 0, 0], [1, 1, 0.5]), density: 1000, spacing: 0.1 }}
  gravity: [0, 0, -{gravity}]
  run {{ until: 0.1 s }}
}}"
        );
        let program = Program::from_source("piston.rfm", text).unwrap();
        Experiment::new(&program, "push", Engine::Auto).unwrap().typical_speed()
    };
    assert!((speed("move([20*t, 0, 0])", 9.81) - 20.0).abs() < 1e-6);
    assert!((speed("move([20*t, 0, 0])", 0.0) - 20.0).abs() < 1e-6);
    assert!((speed("move([t, 0, 0])", 9.81) - 19.62_f64.sqrt()).abs() < 1e-6);
    // a swing of 0.2 m at 50/s presses with its acceleration of 500 m/s² on a metre of water; at 0.5/s with its speed
    let swing = speed("move([0.2*sin(50*t), 0, 0])", 0.0);
    assert!((22.0..22.37).contains(&swing), "{swing}");
    let swing = speed("move([20*sin(0.5*t), 0, 0])", 0.0);
    assert!((9.9..10.01).contains(&swing), "{swing}");
    assert!(speed("move([0, 0, 0.001*t])", 9.81) < 4.5);
}

/// The scene is flat, and the paddle in it much higher.
#[test]
fn a_paddle_that_reaches_far_out_of_the_box_is_seen_to_move() {
    let simulation = run("rfm 1
solid paddle = box([-0.1, -0.1, -1], [0.1, 0.1, 1]).rotate_z(t)
scene stirred {
  box { min: [-0.4, -0.4, 0], max: [0.4, 0.4, 0.12] }
  obstacle { solid: paddle }
  fluid oil { shape: z <= 0.1, density: 1000, spacing: 0.05, viscosity: 100 }
  gravity: [0, 0, 0]
  run { until: 0.01 s }
}")
    .unwrap();
    // its corners go round at 0.14 m/s, of which 0.1 are across its faces
    let expected = simulation.parameters().expected_speed;
    assert!((0.08..0.5).contains(&expected), "{expected}");
}

#[test]
fn fast_belts_are_expected() {
    let text = "rfm 1
solid belt = box([-1, -1, -1], [2, 2, 0.1])
scene drag {
  box { max: [1, 1, 1] }
  obstacle { solid: belt, walls: no_slip, surface_velocity: [0, 30, 0] }
  fluid oil { shape: box([0.3, 0, 0.1], [1, 1, 0.5]), density: 1000, viscosity: 10, spacing: 0.1 }
  run { until: 0.1 s }
}";
    let program = Program::from_source("belt.rfm", text).unwrap();
    assert_eq!(Experiment::new(&program, "drag", Engine::Auto).unwrap().typical_speed(), 30.0);
}

/// A gravity that depends on the place gives the speed of a fall where the fluid is.
#[test]
fn a_gravity_of_the_place_is_expected() {
    let speed = |gravity: &str, height: f64| {
        let text = format!(
            "rfm 1
scene s {{
  box {{ max: [1, 1, {height}] }}
  fluid water {{ shape: z <= 0.3, density: 1000, spacing: 0.1 }}
  gravity: {gravity}
  run {{ until: 1 s }}
}}"
        );
        let program = Program::from_source("s.rfm", text).unwrap();
        Experiment::new(&program, "s", Engine::Auto).unwrap().typical_speed()
    };
    let still = speed("[0, 0, -9.81]", 0.6);
    assert!((still - (2.0 * 9.81 * 0.6_f64).sqrt()).abs() < 1e-9);
    assert!((speed("[0*x, 0, -9.81]", 0.6) - still).abs() < 1e-9);
    // from twice the height of the fluid, where the box is higher than that
    assert!((speed("[0, 0, -9.81]", 20.0) - still).abs() < 1e-3 * still);
    // 4 m/s² at x = 1, and 9.81 m/s² downwards
    assert!((speed("[4*x, 0, -9.81]", 1.0) - (2.0 * 13.81_f64).sqrt()).abs() < 1e-9);
    // a pole above the fluid does not count
    assert!(speed("[0, 0, -1/(0.8 - z)^2]", 1.0) < (2.0 / 0.25_f64).sqrt() + 1e-9);
}

/// A gravity that ceases to have a value is named, whether it depends on the time or on the place.
#[test]
fn a_gravity_without_a_value_is_named() {
    for (gravity, told) in [
        ("-9.81*sqrt(0.02 - t)", "the formula of gravity has no finite value at t = 0.02"),
        ("-9.81*sqrt(z + 0.02 - t)", "the formula of gravity has no finite value at ["),
    ] {
        let text = format!(
            "rfm 1
scene s {{
  box {{ max: [0.4, 0.4, 0.6] }}
  fluid water {{ shape: box([0, 0, 0], [0.4, 0.4, 0.4]), density: 1000, spacing: 0.05, sound_speed: 30 }}
  gravity: [0, 0, {gravity}]
  method: wcsph
  run {{ until: 1 s }}
}}"
        );
        let error = run(&text).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(told), "{gravity}: {error}");
    }
}

/// A blade that presses oil against the floor again and again. Particles that it pinched came to owe thrice their density,
/// and as soon as they had escaped and were alone, they burst from the few that they met (86 m/s).
#[test]
#[ignore = "long"]
fn what_a_blade_has_pinched_does_not_burst_later() {
    let ended = run("rfm 1
solid paddle = box([-4 mm, -30 mm, -25 mm], [4 mm, 30 mm, 25 mm])
  .rotate([1, 0, 0], 3*t).rotate_z(12*t).move([50 mm, 50 mm, 30 mm])
scene stirred {
  box { min: [0, 0, 0], max: [100 mm, 100 mm, 100 mm] }
  fluid oil {
    shape: z <= 40 mm, particles: 1500, density: 0.9 g/cm^3, viscosity: 50 mPa·s, jitter: 0.2, seed: 7
  }
  obstacle { solid: paddle, walls: no_slip }
  gravity: [0, 0, -9.81]
  method: dfsph
  run { until: 0.15 s, save_every: 0.05 s }
}");
    // the tips of the blade move with 0.5 m/s
    let fastest = ended.unwrap_or_else(|e| panic!("{e}")).audit().max_speed();
    assert!(fastest < 1.5, "{fastest} m/s");
}
