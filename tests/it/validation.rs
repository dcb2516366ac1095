//! Flows whose outcome is known, from examples/validation, at sizes that take seconds. What is known is a
//! formula or a measurement, never an earlier result of this program. Each tolerance says what it allows for.

use std::ops::ControlFlow;

use rfm::experiment::{Deviation, Deviations};
use rfm::glam::DVec3;
use rfm::lower::Scene;
use rfm::sph::{Probe, Simulation};
use rfm::{Engine, Experiment, Program};

use crate::tool::{rfm, root};

/// The gravity of the scenes, m/s².
const G: f64 = 9.81;

/// A scene with its params changed.
fn program(name: &str, params: &[(&str, f64)]) -> Program {
    let path = root().join(format!("examples/validation/{name}.rfm"));
    let program = Program::from_path(path).unwrap_or_else(|e| panic!("{e}"));
    params.iter().fold(program, |p, (param, value)| p.with(param, *value).unwrap_or_else(|e| panic!("{e}")))
}

/// Runs a scene to its end and looks at it whenever it would be saved. Returns the deviations of pressure and
/// velocity from what is known.
fn watch(name: &str, params: &[(&str, f64)], mut look: impl FnMut(&Scene, &Simulation)) -> [Option<f64>; 2] {
    let program = program(name, params);
    let scene = &program.module().scenes[0];
    let experiment = Experiment::new(&program, &scene.name, Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    let started = std::time::Instant::now();
    let frames = (scene.run.until / scene.run.save_every).round() as u32;
    let mut deviations = Deviations::default();
    look(scene, &simulation);
    for frame in 1..=frames {
        let end = f64::from(frame) * scene.run.save_every;
        let reached = simulation.advance(end, |_| ControlFlow::Continue(()));
        reached.unwrap_or_else(|e| panic!("{name}: {e}"));
        look(scene, &simulation);
        deviations.look(&experiment, &simulation);
    }
    let Deviation { pressure, velocity, .. } = deviations.total();
    let found = [pressure, velocity];
    let stats = simulation.stats();
    println!(
        "{name}: {} particles, spacing {:.4}, {} steps in {:.1} s, deviations {found:?}",
        stats.particles,
        simulation.parameters().spacing(),
        simulation.steps(),
        started.elapsed().as_secs_f64()
    );
    assert_eq!((stats.inside, stats.lost, stats.non_finite), (0, 0, 0), "{name}");
    found
}

/// A simulation of one of several scenes in a file, up to a time, s.
fn advanced(name: &str, scene: &str, params: &[(&str, f64)], until: f64) -> Simulation {
    let program = program(name, params);
    let experiment = Experiment::new(&program, scene, Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    let reached = simulation.advance(until, |_| ControlFlow::Continue(()));
    reached.unwrap_or_else(|e| panic!("{name}, {scene}: {e}"));
    let stats = simulation.stats();
    assert_eq!((stats.inside, stats.lost, stats.non_finite), (0, 0, 0), "{name}, {scene}");
    simulation
}

#[track_caller]
fn pressure_within(name: &str, particles: f64, bar: f64) {
    let [pressure, _] = watch(name, &[("particles", particles)], |_, _| {});
    assert!(pressure.unwrap() < bar, "{name}: {pressure:?}, at most {bar}");
}

#[track_caller]
fn velocity_within(name: &str, params: &[(&str, f64)], bar: f64) {
    let [_, velocity] = watch(name, params, |_, _| {});
    assert!(velocity.unwrap() < bar, "{name}: {velocity:?}, at most {bar}");
}

#[test]
#[ignore = "long"]
fn every_flow_checks_without_a_word() {
    let mut names: Vec<_> = std::fs::read_dir(root().join("examples/validation"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.retain(|name| name.ends_with(".rfm"));
    names.sort();
    assert!(names.len() >= 10, "{names:?}");
    for name in names {
        let file = format!("examples/validation/{name}");
        let outcome = rfm(root(), &["check", "--deny", "warnings", &file]).expect(0);
        assert_eq!(outcome.stderr, "", "{name}");
    }
}

#[test]
#[ignore = "long"]
fn water_at_rest_bears_its_own_weight() {
    // twenty layers: half a layer at the surface is 2.5 % of the depth; forty layers deviate by 0.7 %
    pressure_within("hydrostatic_box", 500.0, 0.04);
}

#[test]
#[ignore = "long"]
fn water_at_rest_in_a_hollow_sphere() {
    // eight layers at the deepest place, one at the rim
    pressure_within("hydrostatic_sphere", 1080.0, 0.06);
}

#[test]
#[ignore = "long"]
fn water_over_a_pawn_stays_out_of_it() {
    // sixteen layers deviate by 1.5 %, although the collar is thinner than the support radius
    pressure_within("hydrostatic_pawn", 3170.0, 0.03);
}

#[test]
#[ignore = "long"]
fn a_splash_makes_no_energy_and_keeps_its_volume() {
    for method in ["wcsph", "dfsph"] {
        let simulation = advanced("closed_tank", method, &[("particles", 1000.0)], 2.5);
        let audit = simulation.audit();
        let (energy, volume, speed) =
            (audit.energy_excess().unwrap(), audit.volume_change(), audit.max_speed());
        println!("closed_tank, {method}: energy {energy:.1e}, volume {volume:.1e}, {speed:.1} m/s");
        // an estimate of pressure at the surface, of which eight layers have much
        assert!(energy < 5e-3, "{method}: {energy}");
        assert!(volume.abs() < 0.01, "{method}: {volume}");
        // a jet: at 64 spacings across the fastest particle of a slice has 9.4 m/s
        assert!(speed < 2.2 * (2.0 * G * 0.8f64).sqrt(), "{method}: {speed}");
    }
}

#[test]
#[ignore = "long"]
fn still_water_comes_to_rest() {
    for method in ["wcsph", "dfsph"] {
        let simulation = advanced("still_water", method, &[("layers", 8.0)], 6.0);
        let velocity = &simulation.particles().velocity;
        let square = velocity.iter().map(|v| v.length_squared()).sum::<f64>() / velocity.len() as f64;
        println!("still_water, {method}: {:.2} mm/s", 1e3 * square.sqrt());
        // a fall through a thousandth of the depth makes 90 mm/s; the rest that `dfsph` is left with swings between 4
        // and 9 mm/s, by how the last bits fall
        let most = if method == "wcsph" { 3e-3 } else { 1e-2 };
        assert!(square.sqrt() < most, "{method}: {} m/s", square.sqrt());
        let particles = simulation.particles();
        let known: Vec<f64> = particles.position.z.iter().map(|z| 1000.0 * G * (0.4 - z).max(0.0)).collect();
        let squares = |values: &mut dyn Iterator<Item = f64>| values.map(|p| p * p).sum::<f64>();
        let off = squares(&mut particles.pressure.iter().zip(&known).map(|(p, known)| p - known));
        let off = (off / squares(&mut known.iter().copied())).sqrt();
        println!("its pressure is off by {:.2} %", 100.0 * off);
        // walls that do not bear their share of the surface would add a tenth of a layer, 2 %
        assert!(off < if method == "wcsph" { 0.012 } else { 0.02 }, "{method}: {off}");
        let volume = simulation.audit().volume_change();
        assert!(volume.abs() < 5e-3, "{method}: {volume}");
    }
}

#[test]
fn compression_stays_near_what_the_method_accepts() {
    let simulation = advanced("closed_tank", "dfsph", &[("particles", 1000.0)], 1.5);
    let compression = simulation.audit().compression();
    let tolerance = rfm::sph::Dfsph::default().tolerance;
    println!("closed_tank, dfsph: {compression:?}");
    // the column falls over and hits the far wall; what is linear in a step's displacement is solved for
    assert!(compression.mean < 4.0 * tolerance, "{compression:?}");
    assert!(compression.p99 < 60.0 * tolerance, "{compression:?}");
}

#[test]
fn a_fluid_without_compression_bears_its_own_weight() {
    // sixteen layers; forty deviate by 1 %, and single particles bear pressures that scatter by 3.5 %
    pressure_within("hydrostatic_dfsph", 256.0, 0.03);
}

#[test]
fn a_block_falls_as_one() {
    // nothing acts but gravity; this allows for rounding in f32, and for what is left of the lattice's own
    // pressure
    velocity_within("free_fall", &[("particles", 125.0)], 1e-4);
}

#[test]
#[ignore = "long"]
fn vortices_keep_their_shape_and_decay() {
    // 24 spacings along a side; 40 deviate by half of that
    velocity_within("taylor_green", &[("particles", 3456.0)], 0.06);
}

#[test]
#[ignore = "long"]
fn a_turning_cylinder_takes_the_fluid_along() {
    // eight spacings across the gap, and both walls cut the lattice; with slip at the walls all of it would
    // stay at rest and deviate by 1
    velocity_within("couette", &[("particles", 2413.0)], 0.015);
}

#[test]
#[ignore = "long"]
fn friction_holds_back_a_turning_cylinder() {
    // five spacings across the gap: both walls are within the support radius of some particles
    let program = program("couette", &[("particles", 942.0)]);
    let experiment = Experiment::new(&program, "couette", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    let obstacle = experiment.bodies().iter().position(|body| body.solid.name() == "drum").unwrap();
    let mut gauge = simulation.gauge(Probe::Force { obstacle, about: DVec3::ZERO }).unwrap();
    simulation.advance(1.5, |_| ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
    simulation.sample(&mut gauge);
    simulation.advance(2.0, |_| ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
    let torque = simulation.sample(&mut gauge)[5];
    let depth = 4.0 * (4.0 * std::f64::consts::PI * 0.75 / 942.0).sqrt();
    let known = -4.0 * std::f64::consts::PI * 100.0 * 2.0 * 0.25 / 0.75 * depth;
    println!("torque {torque}, known {known}");
    // too large by 3.6 %, and by 1.2 and 0.5 % with ten and twenty spacings across
    assert!((torque / known - 1.0).abs() < 0.045, "{torque} {known}");
}

/// Velocities in a cavity below a lid at the Reynolds number 100, from the tables of Ghia, Ghia and Shin (1982): x, z,
/// the axis and the component of the velocity along it, in parts of the side and of the lid's speed.
const CAVITY: [(f64, f64, usize, f64); 15] = [
    (0.5, 0.1016, 0, -0.06434),
    (0.5, 0.1719, 0, -0.1015),
    (0.5, 0.2813, 0, -0.15662),
    (0.5, 0.4531, 0, -0.2109),
    (0.5, 0.6172, 0, -0.13641),
    (0.5, 0.7344, 0, 0.00332),
    (0.5, 0.8516, 0, 0.23151),
    (0.5, 0.9531, 0, 0.68717),
    (0.0938, 0.5, 2, 0.12317),
    (0.1563, 0.5, 2, 0.16077),
    (0.2344, 0.5, 2, 0.17527),
    (0.5, 0.5, 2, 0.05454),
    (0.8047, 0.5, 2, -0.24533),
    (0.8594, 0.5, 2, -0.22445),
    (0.9063, 0.5, 2, -0.16914),
];

#[test]
#[ignore = "long"]
fn a_lid_drags_the_fluid_of_a_cavity_round() {
    let mut simulation = advanced("cavity", "cavity", &[("across", 20.0)], 8.0);
    let y = 2.0 * simulation.parameters().spacing();
    let mut gauges = CAVITY.map(|(x, z, ..)| {
        simulation.gauge(Probe::Velocity { at: DVec3::new(x, y, z) }).unwrap_or_else(|e| panic!("{e}"))
    });
    let mut errors = CAVITY.map(|(.., known)| -known);
    // the start leaves a wave of sound that goes to and fro in 0.2 s, with 2 % of the lid's speed
    const SAMPLES: u32 = 20;
    for k in 1..=SAMPLES {
        let end = 8.0 + 0.2 * f64::from(k) / f64::from(SAMPLES);
        simulation.advance(end, |_| ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
        for ((error, gauge), (_, _, axis, _)) in errors.iter_mut().zip(&mut gauges).zip(CAVITY) {
            *error += simulation.sample(gauge)[axis] / f64::from(SAMPLES);
        }
    }
    let mean = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    println!("errors {errors:.4?}, root of the mean square {mean:.4}");
    // in parts of the lid's speed; 1.3 % with this many particles
    assert!(mean < 0.016, "{mean}");
}

#[test]
fn a_vessel_at_rest_holds_a_turning_fluid_back() {
    // ten spacings along the radius; a wall that let it slip would leave two thirds too much
    velocity_within("spin_down", &[("particles", 1260.0)], 0.08);
}

/// The times t·√(2g/L) at which the front of a dam of width L has come to x/L, measured by Koshizuka & Oka
/// (1996). Two readings of their figure differ by about 5 %.
const FRONT: [(f64, f64); 8] = [
    (0.381, 1.111),
    (0.769, 1.252),
    (1.153, 1.505),
    (1.537, 1.892),
    (1.935, 2.241),
    (2.323, 2.615),
    (2.719, 3.003),
    (3.096, 3.624),
];

#[test]
fn a_dam_breaks_as_fast_as_it_was_measured() {
    const WIDTH: f64 = 0.5;
    let scale = (2.0 * G / WIDTH).sqrt();
    let mut fronts = Vec::new();
    watch("dam_break", &[("particles", 1600.0)], |_, simulation| {
        let spacing = simulation.parameters().spacing();
        let low = simulation.particles().position.iter().filter(|p| p.z < 1.5 * spacing);
        // the water reaches half a spacing beyond its outermost particle
        let front = low.map(|p| p.x).fold(0.0, f64::max) + 0.5 * spacing;
        fronts.push((simulation.time() * scale, front / WIDTH));
    });
    for (time, measured) in FRONT {
        let after = fronts.iter().position(|&(t, _)| t >= time).unwrap();
        let [(t0, x0), (t1, x1)] = [fronts[after - 1], fronts[after]];
        let found = x0 + (x1 - x0) * (time - t0) / (t1 - t0);
        println!(
            "T {time}: front at {found:.3}, measured {measured}: {:+.1} %",
            100.0 * (found / measured - 1.0)
        );
        // at first it is half a spacing of ten behind; later it is ahead, by as much with 12800 particles as
        // with 1600. The reason is not known: the experiment had a gate to lift and a floor with friction,
        // the scene has neither
        assert!((-0.06..0.25).contains(&(found / measured - 1.0)), "T {time}: {found}, measured {measured}");
    }
}

#[test]
fn a_stone_bounces_to_the_square_of_the_restitution() {
    let e: f64 = 0.8;
    let program = program("bouncing", &[("e", e)]);
    let scene = &program.module().scenes[0];
    let experiment = Experiment::new(&program, &scene.name, Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    let height = |s: &Simulation| s.particles().position.get(0).z;
    let start = height(&simulation);
    let (mut rising, mut last, mut tops) = (false, start, Vec::new());
    while simulation.time() < scene.run.until {
        simulation.step().unwrap();
        let now = height(&simulation);
        if rising && now < last {
            tops.push(last / start);
        }
        (rising, last) = (now > last, now);
    }
    assert!(tops.len() >= 4, "{tops:?}");
    for (k, top) in tops.iter().enumerate() {
        let known = e.powi(2 * (k as i32 + 1));
        println!("top {}: {top:.5}, known {known:.5}", k + 1);
        // it stops on the floor within a step, and at 4.4 m/s, after a fall of 1 m, a step of 0.5 ms is 2 mm
        assert!((top - known).abs() < 3e-3 * (k + 1) as f64, "top {k}: {top}, known {known}");
    }
}

#[test]
fn a_stone_slides_down_a_slope() {
    for mu in [0.0, 0.2] {
        // the steps are exact; the short fall to the slope at the start is included
        velocity_within("sliding", &[("mu", mu)], 5e-3);
    }
}

#[test]
fn water_leaves_a_tank_with_the_speed_of_a_fall() {
    let mut ratios = Vec::new();
    watch("torricelli", &[], |_, simulation| {
        if simulation.time() < 0.3 {
            return;
        }
        let particles = simulation.particles();
        let inside = |p: &DVec3| p.z > 0.0;
        let spacing = simulation.parameters().spacing();
        // the water's surface is as high as the rest of the water fills the tank
        let left = particles.position.iter().filter(inside).count() as f64;
        let surface = left * spacing.powi(3) / 0.16;
        let (mut speed, mut fall, mut n) = (0.0, 0.0, 0);
        for i in 0..particles.len() {
            let (p, v) = (particles.position.get(i), particles.velocity.get(i));
            if (-0.25..-0.1).contains(&p.z) {
                speed += v.length();
                fall += (2.0 * G * (surface - p.z)).sqrt();
                n += 1;
            }
        }
        println!(
            "t {:.2}: surface at {surface:.3}, {n} in the jet, ratio {:.4}",
            simulation.time(),
            speed / fall
        );
        ratios.push(speed / fall);
    });
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!("speed of the jet / that of a fall: {mean:.4}");
    // the hole is four spacings wide: the fall begins half a spacing lower at its edges, and the layers that
    // pass shear each other; with eight spacings the ratio is 0.94
    assert!((mean - 1.0).abs() < 0.18, "{mean}");
}

#[test]
#[ignore = "long"]
fn a_channel_that_closes_on_itself_has_its_profile() {
    // eight spacings across; twenty deviate by 0.8 %
    velocity_within("poiseuille", &[("particles", 2413.0)], 0.03);
}

/// A block of water flies into the corner of a plate and a floor, along which it slides or at which it
/// sticks. Nothing else acts on it, so that both together take what it loses.
#[test]
#[ignore = "long"]
fn obstacles_take_the_momentum_that_the_fluid_loses() {
    for (method, fluid, walls) in [
        ("wcsph", "", "free_slip"),
        ("wcsph", ", shifting: 1", "free_slip"),
        ("dfsph", "", "free_slip"),
        ("wcsph", ", viscosity: 5", "no_slip"),
        ("dfsph", ", viscosity: 5", "no_slip"),
        ("paper", ", viscosity: 5", "free_slip"),
    ] {
        let text = format!(
            "rfm 1
solid plate = box([-1, -5, -5], [0.1, 5, 5])
solid floor = box([-1, -5, -5], [5, 5, -0.12])
scene hit {{
  box {{ min: [-0.5, -4, -1], max: [4, 4, 4] }}
  obstacle {{ solid: plate, restitution: 0.5 }}
  obstacle {{ solid: floor, restitution: 0.5 }}
  walls: {walls}
  fluid water {{
    shape: box([0.15, -0.1, -0.1], [0.35, 0.1, 0.1]), density: 1000, spacing: 0.025,
    velocity: [-3 m/s, 1 m/s, -1 m/s]{fluid}
  }}
  gravity: [0, 0, 0]
  method: {method}
  run {{ until: 0.1 s }}
}}"
        );
        let program = Program::from_source("hit.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        let experiment = Experiment::new(&program, "hit", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
        let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
        let momentum = |simulation: &Simulation| {
            let velocity = &simulation.particles().velocity;
            let sum = [&velocity.x, &velocity.y, &velocity.z].map(|column| column.iter().sum::<f64>());
            simulation.parameters().particle_mass * DVec3::from_array(sum)
        };
        // the gauges begin after the first hits, and are looked at now and then
        simulation.advance(0.025, |_| ControlFlow::Continue(())).unwrap();
        let (start, mut last) = (momentum(&simulation), simulation.time());
        let mut gauges =
            [0, 1].map(|k| simulation.gauge(Probe::Force { obstacle: k, about: DVec3::ZERO }).unwrap());
        let mut taken = [DVec3::ZERO; 2];
        while simulation.time() < 0.1 {
            for _ in 0..7 {
                simulation.step().unwrap_or_else(|e| panic!("{method}: {e}"));
            }
            for (gauge, taken) in gauges.iter_mut().zip(&mut taken) {
                let force = simulation.sample(gauge);
                *taken += (simulation.time() - last) * DVec3::new(force[0], force[1], force[2]);
            }
            last = simulation.time();
        }
        let lost = start - momentum(&simulation);
        println!("{method} {walls}: taken {taken:?}, lost {lost}");
        assert!(lost.length() > 5.0, "{method}: {lost}");
        assert!(taken[0].x < -5.0 && taken[1].z < -1.0, "{taken:?}");
        // wcsph changes velocities by the mean of the forces at both ends of a step, and the force is
        // reported at its end
        let off = (taken[0] + taken[1] - lost).length() / lost.length();
        assert!(off < 0.01, "{method} {walls}: {taken:?} {lost}");
    }
}

/// A jet that spreads on a plate, the lift of a body under water, a gate and a bottom that meet the walls of
/// the box: means of forces, as the scenes state them.
#[test]
#[ignore = "long"]
fn forces_on_bodies_are_those_of_momentum_and_of_archimedes() {
    for (name, scene, params, within) in [
        ("jet", 0, ("across", 5.0), 0.06),
        ("buoyancy", 0, ("layers", 10.0), 0.04),
        ("gate_load", 0, ("layers", 8.0), 0.015),
        ("gate_load", 1, ("layers", 8.0), 0.06),
        ("gate_load", 2, ("layers", 8.0), 0.06),
        ("gate_load", 3, ("layers", 8.0), 0.015),
    ] {
        let program = program(name, &[params]);
        let scene = &program.module().scenes[scene];
        let probe = &scene.probes[0];
        let Some(asked) = &probe.mean else { panic!("{name}: no mean is asked for") };
        let experiment = Experiment::new(&program, &scene.name, Engine::Auto).unwrap();
        let mut simulation = experiment.start().unwrap().simulation;
        let mut gauge = simulation.gauge(probe.measured).unwrap();
        simulation.advance(asked.from, |_| ControlFlow::Continue(())).unwrap();
        simulation.sample(&mut gauge);
        simulation.advance(scene.run.until, |_| ControlFlow::Continue(())).unwrap();
        // the time since the last sample is that of the mean
        let force = simulation.sample(&mut gauge);
        let [force, known] = [&force[..], &asked.known].map(|v| DVec3::new(v[0], v[1], v[2]));
        println!("{name}: {force}, known {known}");
        assert!((force - known).length() < within * known.length(), "{name}: {force} {known}");
    }
}

#[test]
#[ignore = "long"]
fn a_drop_swings_at_the_frequency_of_its_tension() {
    let mut stretch = Vec::new();
    watch("oscillating_drop", &[("particles", 2000.0)], |_, simulation| {
        let position = &simulation.particles().position;
        let square = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
        let across = 0.5 * (square(&position.x) + square(&position.y));
        stretch.push((simulation.time(), (square(&position.z) / across).ln()));
    });
    // the lattice leaves the shape that it swings about a little long; the same crossing comes once in a
    // period
    let swings = || stretch.iter().filter(|(t, _)| *t > 0.3).map(|(_, s)| *s);
    let middle = 0.5 * (swings().fold(f64::MIN, f64::max) + swings().fold(f64::MAX, f64::min));
    let falling: Vec<f64> = stretch
        .windows(2)
        .filter(|w| w[0].0 > 0.3 && w[0].1 > middle && w[1].1 <= middle)
        .map(|w| w[0].0 + (w[1].0 - w[0].0) * (w[0].1 - middle) / (w[0].1 - w[1].1))
        .collect();
    let period = falling[1] - falling[0];
    // of a viscous ball, by Chandrasekhar's equation; it leaves 0.78 of an amplitude after half a period
    let known = 2.2452;
    let turns: Vec<f64> = stretch
        .windows(3)
        .filter(|w| w[0].0 > 0.3 && (w[1].1 - w[0].1) * (w[2].1 - w[1].1) < 0.0)
        .map(|w| w[1].1 - middle)
        .collect();
    println!("period {period:.4} s, known {known:.4} s; turns at {turns:.4?}");
    // eight spacings along the radius, and particles whose disorder is different in each run
    assert!((period / known - 1.0).abs() < 0.04, "{period}");
    // with a diffusion of densities the swings of a drop grow
    let (first, last) = (turns[0].abs(), turns[turns.len() - 1].abs());
    assert!(last < 0.9 * first, "{turns:?}");
}

#[test]
#[ignore = "long"]
fn the_lowest_standing_wave_has_its_period() {
    let mut moments = Vec::new();
    let [_, _] = watch("standing_wave", &[("particles", 1800.0)], |_, simulation| {
        let x = &simulation.particles().position.x;
        moments.push((simulation.time(), x.iter().sum::<f64>() / x.len() as f64 - 0.5));
    });
    let crossing = |falls: bool| {
        let pair = moments.windows(2).skip(3).find(|w| (w[0].1 > 0.0) == falls && (w[1].1 > 0.0) != falls);
        let [(t0, x0), (t1, x1)] = pair.unwrap()[..] else { unreachable!() };
        t0 - x0 * (t1 - t0) / (x1 - x0)
    };
    let (half, whole) = (crossing(true), crossing(false));
    let k = std::f64::consts::PI;
    let known = 2.0 * std::f64::consts::PI / (G * k * (0.5 * k).tanh()).sqrt();
    println!("half a period after {half:.4} s, a whole one after {whole:.4} s; known {known:.4} s");
    assert!((whole / known - 1.0).abs() < 0.04, "{whole}, known {known}");
}

#[test]
fn a_truth_that_changes_is_compared_from_where_it_is_known() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let with = |truth: &str| {
        let text = format!(
            "rfm 1\nscene drop {{\n  box {{ max: [1, 1, 1] }}\n  fluid water {{ shape: ball([0.5, 0.5, 0.5], 0.14), \
             fill: middle, spacing: 0.03, viscosity: 0.5 }}\n  truth {{ {truth} }}\n  \
             run {{ until: 20 ms, save_every: 5 ms }}\n}}\n"
        );
        std::fs::write(here.join("drop.rfm"), text).unwrap();
    };
    let run = |out: &str, flags: &[&str]| {
        rfm(here, &[&["run", "drop.rfm", "--no-pictures", "-o", out], flags].concat())
    };
    let error = |out: &str| {
        let text = std::fs::read_to_string(here.join(out).join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
        summary["velocity_error"].as_f64().unwrap()
    };
    with("velocity: [0, 0, -9.81*t]");
    run("out", &[]).expect(0);

    // one that holds already is refused: the instants that have passed were compared with another one
    with("velocity: [0, 0, -9*t], from: 15 ms");
    let refused = run("out", &["--resume", "--until", "0.04"]).expect(2).stderr;
    assert!(refused.contains("`truth` has changed") && refused.contains("from t = 0.015 s"), "{refused}");

    // one that begins later is compared as in a run in one go
    with("velocity: [0, 0, -9*t], from: 25 ms");
    run("out", &["--resume", "--until", "0.04"]).expect(0);
    run("whole", &["--until", "0.04"]).expect(0);
    assert_eq!(error("out"), error("whole"));
    // and goes on
    run("out", &["--resume", "--until", "0.05"]).expect(0);
    run("longer", &["--until", "0.05"]).expect(0);
    assert_eq!(error("out"), error("longer"));
}
