//! Fluids at rest that are easily stirred: deep ones, and those whose steps are cut short.

use std::ops::ControlFlow;

use rfm::glam::DVec3;
use rfm::sph::Simulation;

use crate::tool::simulation;

/// A column of eight particles by eight, and `layers` deep.
fn column(layers: u32) -> String {
    format!(
        "rfm 1
let spacing = 1/{layers}
scene deep {{
  box {{ min: [0, 0, 0], max: [8*spacing, 8*spacing, 1.5] }}
  fluid water {{ shape: box([0, 0, 0], [8*spacing, 8*spacing, 1]), density: 1000, spacing: spacing, viscosity: 0 }}
  method: dfsph
  run {{ until: 0.1 s, save_every: 0.1 s }}
}}"
    )
}

/// Eighty layers on a lattice, whose first steps are the hardest that `dfsph` meets: nothing is too dense in
/// them, all of the pressure is to be found at once, and a column that falls for some steps does not stop in
/// time. (It reached 0.5 m/s.)
#[test]
fn a_deep_column_stands_from_the_first_step() {
    let mut simulation = simulation(&column(80));
    let mut speed = 0.0_f64;
    while simulation.time() < 0.1 {
        simulation.step().unwrap_or_else(|e| panic!("{e}"));
        speed = speed.max(simulation.stats().max_speed);
    }
    let height = |p: DVec3| p.z;
    let top = simulation.particles().position.iter().map(height).fold(0.0, f64::max);
    println!("{} steps, at most {speed:.2} m/s, top at {top:.3} m", simulation.steps());
    // a fall of 0.1 s would reach 1 m/s; the highest particles lie half a spacing below the surface
    assert!(speed < 0.3 && (0.98..1.0).contains(&top), "{speed} m/s, {top} m");
}

/// Water between walls that no whole number of layers fits, where the system of forces sees no compression in layers that
/// leave the walls. Between two and three spacings some energy still comes from nowhere, as README says. (Before such motion
/// was taken from velocities, energy grew by 80 % in 0.3 s with 2.4 spacings, and by 50 % with 2.3.)
#[test]
fn water_in_a_narrow_channel_keeps_its_energy() {
    for (width, most) in [(2.3, 0.25), (2.4, 0.25), (4.3, 0.015), (6.4, 0.015)] {
        let mut simulation = simulation(&format!(
            "rfm 1
let spacing = 0.024
scene channel {{
  box {{ min: [0, 0, 0], max: [0.5, {width}*spacing, 0.6], restitution: 0 }}
  fluid water {{ shape: box([0, 0, 0], [0.5, {width}*spacing, 0.3]), density: 1000, spacing: spacing }}
  method: dfsph
  run {{ until: 0.3 s, save_every: 0.1 s }}
}}"
        ));
        while simulation.time() < 0.3 {
            simulation.step().unwrap_or_else(|e| panic!("{width}: {e}"));
        }
        let excess = simulation.audit().energy_excess().unwrap_or(0.0);
        println!("{width} spacings: energy {:.2} % above that at the start", 100.0 * excess);
        // where layers fit badly the lattice gives way, and the level rises with it
        assert!(excess < most, "{width}: {excess}");
    }
}

/// Water under its own weight starts with the same densities however its gravity is written, and in a vessel that turns
/// with those of p = ρ(½ω²r² − gz) below its highest place.
#[test]
fn a_weight_that_depends_on_the_place_presses_from_the_start() {
    let start = |gravity: &str| {
        simulation(&format!(
            "rfm 1
scene pool {{
  box {{ min: [-0.2, -0.2, 0], max: [0.2, 0.2, 0.5] }}
  fluid water {{
    shape: box([-0.2, -0.2, 0], [0.2, 0.2, 0.3]), density: 1000, spacing: 0.05, start: hydrostatic, sound_speed: 30 m/s
  }}
  gravity: [{gravity}]
  run {{ until: 0.1 s, save_every: 0.1 s }}
}}"
        ))
    };
    let (plain, field, turned) = (start("0, 0, -9.81"), start("0*x, 0, -9.81"), start("16*x, 16*y, -9.81"));
    let density = |simulation: &Simulation, i: usize| simulation.particles().density[i];
    // (1 + 7p/(ρc²))^(1/7) at the floor
    let deepest = (1.0_f64 + 7.0 * 9.81 * 0.275 / 900.0).powf(1.0 / 7.0);
    let densest = plain.particles().density.iter().copied().fold(0.0, f64::max);
    assert!((densest / 1000.0 - deepest).abs() < 1e-4, "{densest}");
    let tait = |density: f64| 1000.0 * 900.0 / 7.0 * ((density / 1000.0).powi(7) - 1.0);
    let potential = |p: DVec3| 8.0 * (p.x * p.x + p.y * p.y) - 9.81 * p.z;
    let (at, count) = (&turned.particles().position, turned.particles().len());
    let lowest = (0..count).map(|i| potential(at.get(i))).fold(f64::INFINITY, f64::min);
    let offset = tait(density(&turned, 0)) - 1000.0 * (potential(at.get(0)) - lowest);
    for i in 0..count {
        assert!((density(&plain, i) - density(&field, i)).abs() < 1e-9, "{i}");
        let known = offset + 1000.0 * (potential(at.get(i)) - lowest);
        assert!((tait(density(&turned, i)) - known).abs() < 1.0, "{i}: {known} Pa");
    }
    assert!((200.0..300.0).contains(&offset), "half a spacing of water: {offset} Pa");
}

/// Planes of particles under the pressure p swing with ω² = 6.82·p/(ρs²), the greatest eigenvalue of the forces
/// on a cubic lattice with 2.2 spacings in a support radius, and a step of more than 2/ω makes them grow.
#[test]
fn steps_are_short_enough_for_the_pressure() {
    let layers = 40;
    let mut simulation = simulation(&column(layers));
    let spacing = 1.0 / f64::from(layers);
    while simulation.time() < 0.1 {
        let pressure = simulation.particles().pressure.iter().copied().fold(0.0, f64::max);
        let before = simulation.time();
        simulation.step().unwrap_or_else(|e| panic!("{e}"));
        let limit = 2.0 * spacing / (6.82 * pressure / 1000.0).sqrt();
        let step = simulation.time() - before;
        assert!(step < 0.76 * limit, "{step} s at {before} s, {limit} s");
    }
    let deepest = simulation.particles().pressure.iter().copied().fold(0.0, f64::max);
    assert!(deepest > 5000.0, "{deepest} Pa: the pressure never came");
}

/// Water that tapers off between a cylinder and the floor it lies on. Walls on both sides complete what
/// pressure does there, so steps that are short enough for the depth are not for the wedge: particles reached
/// 148 m/s.
#[test]
fn steps_are_short_enough_for_a_wedge() {
    let mut simulation = simulation(
        "rfm 1
solid roll = cylinder(0.4, 4).rotate_x(90 deg).move([1, 2, 0.4])
scene wedge {
  box { max: [1, 0.2, 0.8] }
  obstacle { solid: roll }
  fluid water { shape: box([0, 0, 0], [1, 0.2, 0.4]) \\ roll, density: 1000, spacing: 0.02 }
  method: dfsph
  run { until: 0.15 s, save_every: 0.15 s }
}",
    );
    let mut speed = 0.0_f64;
    while simulation.time() < 0.15 {
        simulation.step().unwrap_or_else(|e| panic!("{e}"));
        speed = speed.max(simulation.stats().max_speed);
    }
    println!("{} steps, at most {speed:.2} m/s", simulation.steps());
    // the wedge is empty at first, and what flows into it falls no deeper than the tank; twice as fast, as a jet may be
    assert!(speed < 2.0 * (2.0 * 9.81 * 0.4_f64).sqrt(), "{speed} m/s");
}

/// Frames that follow each other closely make steps short. What keeps densities must not become a speed for that.
#[test]
fn short_steps_do_not_stir_a_fluid_at_rest() {
    let text = "rfm 1
scene calm {
  box { max: [0.5, 0.5, 0.5] }
  gravity: [0, 0, 0]
  fluid water { shape: box([0, 0, 0], [0.5, 0.5, 0.3]), density: 1000, particles: 2000 }
  method: dfsph
  run { until: 20 ms, save_every: 0.1 ms }
}";
    let mut simulation = simulation(text);
    let mut fastest = 0.0_f64;
    for frame in 1..=200 {
        let end = 1e-4 * f64::from(frame);
        simulation.advance(end, |_| std::ops::ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
        fastest = fastest.max(simulation.stats().max_speed);
    }
    assert!(simulation.steps() >= 200);
    assert!(fastest < 1e-3, "{fastest} m/s");
}

/// A gravity that depends on the place is weight, too: walls bear their share of the surface under it.
/// (Without that share the pressure would be a tenth of a layer too high, 2 %; were the diffusion of
/// densities not to know of the weight, 8 %.)
#[test]
#[ignore = "long"]
fn walls_bear_their_share_under_any_gravity() {
    let mut simulation = simulation(
        "rfm 1
scene rest {
  box { max: [0.4, 0.4, 0.6] }
  fluid water { shape: box([0, 0, 0], [0.4, 0.4, 0.4]), density: 1000, spacing: 0.05, sound_speed: 28 }
  gravity: [0, 0, -9.81 + 1e-9*x]
  method: wcsph
  run { until: 4 s }
}",
    );
    simulation.advance(4.0, |_| ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
    let particles = simulation.particles();
    let (mut off, mut all) = (0.0, 0.0);
    for (p, z) in particles.pressure.iter().zip(&particles.position.z) {
        let known = 9810.0 * (0.4 - z).max(0.0);
        off += (p - known).powi(2);
        all += known * known;
    }
    let off = (off / all).sqrt();
    println!("its pressure is off by {:.2} %", 100.0 * off);
    assert!(off < 0.02, "{off}");
}

/// A block that has fallen into its tank comes to rest as deep as its volume says, and presses as its weight
/// does. (With `wcsph` it stood 15 % too high, and pressed 29 % too much at a third of its depth.)
#[test]
#[ignore = "long"]
fn water_that_has_splashed_fills_no_more_than_its_volume() {
    for method in ["wcsph", "dfsph"] {
        let mut simulation = simulation(&format!(
            "rfm 1\n\
             scene s {{\n\
             box {{ max: [0.4, 0.4, 2] }}\n\
             fluid water {{ shape: box([0, 0, 0.2], [0.2, 0.4, 0.8]), density: 1000, spacing: 5 cm, viscosity: 1 }}\n\
             method: {method}\n\
             run {{ until: 4 s }}\n\
             }}\n"
        ));
        simulation.advance(4.0, |_| ControlFlow::Continue(())).unwrap();
        let particles = simulation.particles();
        let n = particles.len() as f64;
        let depth = 2.0 * particles.position.z.iter().sum::<f64>() / n;
        // the disorder of six layers makes an error of a hundredth, and slow waves are left
        assert!((depth / 0.3 - 1.0).abs() < 0.03, "{method}: {depth} m");
        let low = particles.position.z.iter().zip(&particles.pressure).filter(|(z, _)| **z < 0.1);
        let (mut error, mut count) = (0.0, 0.0);
        for (z, pressure) in low {
            error += pressure - 9810.0 * (0.3 - z);
            count += 1.0;
        }
        let error: f64 = error / count / (9810.0 * 0.3);
        assert!(error.abs() < 0.06, "{method}: {error}");
    }
}

/// Where pressures act by their differences, gradients are those of the neighbours that a particle has, at
/// walls and in corners too. (By closed forms of what whole walls take, this water, which has hardly any
/// viscosity, moved at 70 mm/s after half a second and at 100 after two.)
#[test]
fn differences_of_pressure_rest_in_edges_and_corners() {
    let mut simulation = simulation(
        "rfm 1
scene rest {
  box { max: [0.3, 0.2, 0.4] }
  fluid water { shape: box([0, 0, 0], [0.3, 0.2, 0.2]), density: 1000, spacing: 0.025, gradients: differences }
  method: wcsph
  run { until: 1 s }
}",
    );
    simulation.advance(1.0, |_| ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
    let velocity = &simulation.particles().velocity;
    let square = velocity.iter().map(|v| v.length_squared()).sum::<f64>() / velocity.len() as f64;
    println!("{:.1} mm/s", 1e3 * square.sqrt());
    // found: 8 mm/s, most of it the first swing of all the water
    assert!(square.sqrt() < 0.016, "{} m/s", square.sqrt());
}

#[test]
#[ignore = "long"]
fn honey_that_sticks_to_its_vessel_stops() {
    // with the longest step that viscosity allows away from walls, speeds grow beside them
    for (walls, sticky) in [
        ("box { min: [-0.3, -0.3, 0], max: [0.3, 0.3, 0.2] }", "walls: no_slip"),
        (
            "box { min: [-0.31, -0.31, 0], max: [0.31, 0.31, 0.2] }
            container { solid: vessel, walls: no_slip, restitution: 0 }",
            "",
        ),
    ] {
        for gradients in ["pairs", "differences"] {
            let text = format!(
                "rfm 1
                solid vessel = cylinder(0.3, 2).move([0, 0, -1])
                scene s {{
                  {walls}
                  fluid honey {{
                    shape: box([-0.3, -0.3, 0], [0.3, 0.3, 0.2]), density: 1000, spacing: 0.1/3, viscosity: 1000,
                    velocity: [-2*y, 2*x + 0.3*sin(300*x), 0.3*sin(400*y)], gradients: {gradients}
                  }}
                  gravity: [0, 0, 0]
                  {sticky}
                  method: wcsph
                  run {{ until: 20 ms }}
                }}"
            );
            let mut simulation = simulation(&text);
            let energy = |simulation: &Simulation| {
                simulation.particles().velocity.iter().map(|v| v.length_squared()).sum::<f64>()
            };
            let (first, mut last) = (energy(&simulation), f64::INFINITY);
            for end in [5e-3, 10e-3, 20e-3] {
                simulation.advance(end, |_| ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
                let now = energy(&simulation);
                assert!(now < last, "{walls} {gradients}: {now} after {last}");
                last = now;
            }
            // turning dies away as exp(−ν(3.83/R)²t), to 4 % of its speed
            assert!(last < 5e-3 * first, "{walls} {gradients}: {last} of {first}");
        }
    }
}
