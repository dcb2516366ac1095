//! Fluids in vessels, and under what changes with time and place: levels, weights and energies have closed forms.

use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::sph::{Particles, Probe, Simulation};

use crate::tool::{experiment, run_to, simulation};

fn middle(simulation: &Simulation) -> DVec3 {
    let places = &simulation.particles().position;
    places.iter().sum::<DVec3>() / places.iter().count() as f64
}

/// Water 0.4 m deep in a vessel of ten spacings by ten that is turned in its box, so that its edges lie along
/// no wall of the box. Its middle lies at half of its depth. (Edges that counted as planes lifted it by 4 and
/// 6 mm.)
#[test]
#[ignore = "long"]
fn water_in_a_turned_vessel_stands_as_high_as_its_volume() {
    for (method, most) in [("wcsph", 0.0025), ("dfsph", 0.0035)] {
        let mut simulation = simulation(&format!(
            "rfm 1
let turned = box([-0.2, -0.2, 0.1], [0.2, 0.2, 1]).rotate_z(30 deg)
scene still {{
  box {{ min: [-0.4, -0.4, 0], max: [0.4, 0.4, 0.8] }}
  container {{ solid: turned }}
  fluid water {{ shape: turned and z <= 0.5, density: 1000, spacing: 0.04 }}
  method: {method}
  run {{ until: 1 s, save_every: 1 s }}
}}"
        ));
        run_to(&mut simulation, 0.8);
        let off = middle(&simulation).z - 0.3;
        println!("{method}: the middle is {:.2} mm too high", 1e3 * off);
        // water is compressed by its weight with wcsph, by less than a thousandth
        assert!((-0.0005..most).contains(&off), "{method}: {off} m");
    }
}

/// A box that is full to its walls, at rest under its weight and in a slow vortex. (It burst within a second,
/// and in fifteen steps.)
#[test]
fn a_full_box_neither_bursts_at_rest_nor_in_a_vortex() {
    let vortex = "velocity: [0.1*sin(pi*x/0.4)*cos(pi*y/0.4), -0.1*cos(pi*x/0.4)*sin(pi*y/0.4), 0]";
    for (fluid, gravity, most) in [("", "[0, 0, -9.81]", 0.5), (vortex, "[0, 0, 0]", 0.2)] {
        let mut simulation = simulation(&format!(
            "rfm 1
scene full {{
  box {{ max: [0.4, 0.4, 0.4] }}
  fluid water {{ shape: z >= 0, spacing: 0.05{} {fluid} }}
  gravity: {gravity}
  method: dfsph
  run {{ until: 2 s, save_every: 0.1 s }}
}}",
            if fluid.is_empty() { "" } else { "," }
        ));
        run_to(&mut simulation, 1.0);
        let speed = simulation.audit().max_speed();
        assert!(speed < most, "{fluid}: {speed} m/s");
        assert_eq!(simulation.findings(), [], "{fluid}");
    }
}

/// The middle of a drop in a trap whose pull grows with the distance swings as x₀·cos(ωt), whatever else the
/// fluid does. Steps are longer where it turns. (It lost 7 % of its way in three periods with dfsph.)
#[test]
#[ignore = "long"]
fn a_drop_swings_in_a_trap_without_loss() {
    for method in ["wcsph", "dfsph"] {
        let mut simulation = simulation(&format!(
            "rfm 1
scene trap {{
  box {{ min: [-1, -1, -1], max: [1, 1, 1] }}
  fluid water {{ shape: ball([0.3, 0, 0], 0.2), density: 1000, particles: 300 }}
  gravity: [-40*x, -40*y, -40*z]
  method: {method}
  run {{ until: 3 s, save_every: 0.5 s }}
}}"
        ));
        let start = middle(&simulation).x;
        let mut worst = 0.0_f64;
        while simulation.time() < 3.0 {
            simulation.step().unwrap_or_else(|e| panic!("{e}"));
            worst = worst
                .max((middle(&simulation).x - start * (40.0_f64.sqrt() * simulation.time()).cos()).abs());
        }
        let excess = simulation.audit().energy_excess();
        println!("{method}: {:.1e} of the way off, energy excess {excess:?}", worst / start);
        // the phase of steps of 7 ms is off by (ωΔt)²/24 of itself
        assert!(worst < 0.005 * start, "{method}: {worst} m");
        assert!(excess.is_some_and(|excess| excess < 0.01), "{method}: {excess:?}");
    }
}

/// Water turns along a smooth round wall, which gives no torque: a ring without weight, and a bucket with it, whose
/// frames cut steps short. (With velocities tangential where a step begins, and none after it, `dfsph` lost 3.7 % of the
/// ring's momentum and 8 % of its energy of motion.)
#[test]
#[ignore = "long"]
fn water_turns_along_a_round_wall_without_loss() {
    let ring = ("x^2 + y^2 >= 0.04", 0.4, 0.0, 0.5);
    let bucket = ("z <= 0.2 + 36*(x^2 + y^2 - 0.08)/19.62", 0.6, -9.81, 0.0137);
    for ((shape, height, gravity, frames), method) in
        [ring, bucket].into_iter().flat_map(|scene| ["wcsph", "dfsph"].map(|method| (scene, method)))
    {
        let mut simulation = simulation(&format!(
            "rfm 1
solid vessel = cylinder(0.4, {height})
scene turning {{
  box {{ min: [-0.45, -0.45, 0], max: [0.45, 0.45, {height}] }}
  container {{ solid: vessel }}
  fluid water {{
    shape: vessel and {shape}, spacing: 0.04, density: 1000, viscosity: 0, artificial_viscosity: 0,
    velocity: [-6*y, 6*x, 0]
  }}
  gravity: [0, 0, {gravity}]
  method: {method}
  run {{ until: 0.5 s, save_every: {frames} s }}
}}"
        ));
        let turning = |simulation: &Simulation| {
            let particles = simulation.particles();
            let pairs = particles.position.iter().zip(particles.velocity.iter());
            pairs.fold([0.0; 2], |[l, k], (x, v)| [l + x.cross(v).z, k + v.length_squared()])
        };
        let start = turning(&simulation);
        for frame in 1..=(0.5 / frames) as usize {
            let until = frame as f64 * frames;
            simulation
                .advance(until, |_| std::ops::ControlFlow::Continue(()))
                .unwrap_or_else(|e| panic!("{e}"));
        }
        let end = turning(&simulation);
        let [lost, slower] = [0, 1].map(|k| 1.0 - end[k] / start[k]);
        println!(
            "{method}: {:.2} % of the momentum lost, {:.2} % of the energy",
            100.0 * lost,
            100.0 * slower
        );
        assert!(lost.abs() < 0.006 && slower.abs() < 0.025, "{method} {shape}: {lost} {slower}");
    }
}

/// Water under a gravity that grows from next to nothing, and a drop that hardly moves but for its surface
/// tension: the speed of sound of wcsph follows from what comes, and not from the start. (The first was
/// crushed to three quarters of its height, the second by a third.)
#[test]
#[ignore = "long"]
fn sound_is_fast_enough_for_what_comes() {
    let growing = "
  box { max: [0.32, 0.32, 1] }
  fluid water { shape: z <= 0.8, density: 1000, spacing: 0.04 }
  gravity: [0, 0, -0.1 - 40*min(t, 1)]";
    let drop = "
  box { min: [-0.3, -0.3, -0.3], max: [0.3, 0.3, 0.3] }
  fluid water { shape: ball([0, 0, 0], 0.1), particles: 500, viscosity: 0.5, surface_tension: 1, velocity: [0.02, 0, 0] }
  gravity: [0, 0, 0]";
    for scene in [growing, drop] {
        let mut simulation = simulation(&format!(
            "rfm 1\nscene s {{{scene}\n  method: wcsph\n  run {{ until: 1.5 s, save_every: 0.1 s }}\n}}"
        ));
        run_to(&mut simulation, 1.5);
        let compression = simulation.audit().compression().mean;
        println!("compressed by {:.2} %", 100.0 * compression);
        assert!(compression < 0.005, "{scene}: {compression}");
        assert_eq!(simulation.findings(), [], "{scene}");
    }
}

/// Water in a vessel that may move, whose faces lie in walls of the box, one of them or all, or less than a spacing
/// before its floor. Nothing moves, so the water rests as it does in a vessel that is nowhere near the box. (Walls
/// counted twice where the vessel's own walls meet: it swirled with 2 to 10 cm/s, with `dfsph` 18 cm/s, and stood 6 mm
/// too high.)
#[test]
#[ignore = "long"]
fn water_rests_in_a_moving_vessel_whose_faces_lie_in_the_box() {
    let free = ("[-0.1, -0.1, -0.1]", "[0.6, 0.3, 0.6]");
    let floor = ("[-0.1, -0.1, 0]", "[0.6, 0.3, 0.6]");
    let all = ("[0, 0, 0]", "[0.5, 0.2, 0.6]");
    let before_floor = ("[-0.1, -0.1, -0.01]", "[0.6, 0.3, 0.6]");
    // divergence-free water never quite rests, and how much it moves is a matter of chance
    for (method, start, factor) in [("wcsph", ", start: hydrostatic", 2.0), ("dfsph", "", 4.0)] {
        let mut at_best = None;
        for (min, max) in [free, floor, all, before_floor] {
            let mut simulation = simulation(&format!(
                "rfm 1
scene still {{
  box {{ min: {min}, max: {max} }}
  container {{ solid: box([0, 0, 0], [0.5, 0.2, 0.5]).move([0*t, 0, 0]) }}
  fluid water {{ shape: box([0, 0, 0], [0.5, 0.2, 0.2]), density: 1000, spacing: 0.025{start} }}
  method: {method}
  run {{ until: 1 s, save_every: 0.5 s }}
}}"
            ));
            run_to(&mut simulation, 0.4);
            let velocity = &simulation.particles().velocity;
            let squares = velocity.iter().map(|v| v.length_squared()).sum::<f64>();
            let speed = (squares / velocity.iter().count() as f64).sqrt();
            let height = middle(&simulation).z;
            println!("{method}, box from {min}: {:.2} mm/s, middle at {height:.5} m", 1e3 * speed);
            let [slowest, level] = *at_best.get_or_insert([speed, height]);
            assert!(speed < factor * slowest, "{method}, box from {min}: {speed} m/s beside {slowest}");
            // a hundredth of a layer of particles, or five with dfsph
            let most = 0.025 * if method == "wcsph" { 0.01 } else { 0.05 };
            assert!((height - level).abs() < most, "{method}, box from {min}: {height} m beside {level}");
            assert_eq!(simulation.findings(), [], "{method}, box from {min}");
        }
    }
}

/// A full vessel turns with its water as one rigid body, its floor and lid in those of the box. (Its angular momentum
/// grew by 1 % in a second.)
#[test]
#[ignore = "long"]
fn a_turning_vessel_neither_drives_nor_brakes_its_water() {
    let mut simulation = simulation(
        "rfm 1
scene turning {
  box { min: [-0.25, -0.25, 0], max: [0.25, 0.25, 0.2] }
  container { solid: cylinder(0.2, 0.2).rotate_z(3*t) }
  fluid water {
    shape: cylinder(0.2, 0.2), density: 1000, spacing: 0.025, viscosity: 0.001, velocity: [-3*y, 3*x, 0]
  }
  gravity: [0, 0, 0]
  method: wcsph
  run { until: 2 s, save_every: 0.5 s }
}",
    );
    let turning = |simulation: &Simulation| {
        let particles = simulation.particles();
        let pairs = particles.position.iter().zip(particles.velocity.iter());
        pairs.map(|(x, v)| x.cross(v).z).sum::<f64>()
    };
    let at_start = turning(&simulation);
    run_to(&mut simulation, 1.5);
    let change = turning(&simulation) / at_start - 1.0;
    println!("angular momentum changes by {:.2} %", 1e2 * change);
    assert!(change.abs() < 0.005, "{change}");
    assert_eq!(simulation.findings(), []);
}

/// A fluid of so slow a sound that it is crushed says so.
#[test]
fn a_crushed_fluid_is_told_of() {
    let mut simulation = simulation(
        "rfm 1
scene crushed {
  box { max: [0.32, 0.32, 1] }
  fluid water { shape: z <= 0.8, density: 1000, spacing: 0.08, sound_speed: 4 m/s }
  method: wcsph
  run { until: 1 s, save_every: 0.1 s }
}",
    );
    run_to(&mut simulation, 1.0);
    let told: Vec<_> = simulation.findings().into_iter().map(|(finding, _)| finding).collect();
    println!("{:?}: {told:?}", simulation.audit().compression());
    assert!(told.contains(&rfm::sph::Finding::Compression), "{told:?}");
}

/// A cup half a spacing above the floor, under water: nothing fits below it, beside its hollow as little as
/// elsewhere. (Four particles stayed there, and fell in place without end.)
#[test]
fn no_particle_lies_below_a_cup_that_leaves_no_room() {
    let mut simulation = simulation(
        "rfm 1
solid cup = (cylinder(0.2, 0.2) \\ cylinder(0.14, 0.5).move([0, 0, 0.06])).move([0.3, 0.3, 0.02])
scene gap {
  box { max: [0.6, 0.6, 0.5] }
  obstacle { solid: cup }
  fluid water { shape: z <= 0.32, density: 1000, spacing: 0.04 }
  method: dfsph
  run { until: 1 s, save_every: 0.1 s }
}",
    );
    let below = |p: &DVec3| p.z < 0.02 && (p.x - 0.3).hypot(p.y - 0.3) < 0.15;
    assert_eq!(simulation.particles().position.iter().filter(below).count(), 0);
    run_to(&mut simulation, 0.3);
    assert!(simulation.audit().max_speed() < 1.0, "{}", simulation.audit().max_speed());
}

/// Whether a fluid fills its vessel is asked around the fluid, and beyond necks: samples of a large box miss a small vessel
/// in it. Still water in the pot had a third of its pressure in a box of 8 m.
#[test]
#[ignore = "long"]
fn a_vessel_is_as_full_in_a_large_box_as_in_a_small_one() {
    let pot = "cylinder(0.1, 0.3)";
    // a chamber full to the brim, with a neck that leads to an empty one
    let glass = "cylinder(0.1, 0.1) or cylinder(0.02, 0.4) or cylinder(0.1, 0.2).move([0, 0, 0.35])";
    let lower = "cylinder(0.1, 0.1)";
    for (vessel, shape, half, is_full) in [
        (pot, "cylinder(0.1, 0.15)", 0.3, false),
        (pot, "cylinder(0.1, 0.15)", 4.0, false),
        (pot, pot, 0.3, true),
        (pot, pot, 4.0, true),
        (glass, lower, 0.6, false),
        ("box([0, 0, 0], [0.4, 0.2, 0.3])", "box([0, 0, 0], [0.4, 0.2, 0.3])", 2.1, true),
    ] {
        let simulation = simulation(&format!(
            "rfm 1
solid vessel = {vessel}
scene s {{
  box {{ min: [-{half}, -{half}, -0.1], max: [{half}, {half}, {half}] }}
  container {{ solid: vessel }}
  fluid water {{ shape: {shape}, spacing: 0.02, density: 1000 }}
  method: dfsph
  run {{ until: 1, save_every: 1 }}
}}"
        ));
        assert_eq!(simulation.parameters().fills_vessel, is_full, "{shape} in {vessel}, box of {half}");
    }
}

/// A tank that moves through a long box keeps its room. Samples of the whole box missed it, and the run ended with \"no room
/// left\".
#[test]
fn a_tank_that_moves_through_a_long_box_has_room() {
    let experiment = experiment(
        "rfm 1
solid tank = box([0, 0, 0], [0.4, 0.12, 0.5]).move([0.5*t^2, 0, 0])
scene s {
  box { min: [-0.2, -0.2, -0.2], max: [16, 0.3, 0.7] }
  container { solid: tank }
  fluid water { shape: box([0, 0, 0], [0.4, 0.12, 0.2]), spacing: 0.04, density: 1000 }
  method: dfsph
  run { until: 1, save_every: 1 }
}",
    );
    let fluid = |t: f64| {
        let way = DVec3::X * 0.5 * t * t;
        Aabb::new(way, way + DVec3::new(0.4, 0.12, 0.2))
    };
    for t in [0.1, 0.6, 3.0] {
        assert_eq!(experiment.lacks_room(&fluid(t), t, 0.0096), None, "at {t}");
        // around the fluid the tank has 0.4 × 0.12 × 0.3 m³
        let left = experiment.lacks_room(&fluid(t), t, 0.02).unwrap();
        assert!((left / (0.4 * 0.12 * 0.3) - 1.0).abs() < 0.02, "{left} at {t}");
    }
}

/// A full tank at rest, and one that is pushed with 2 m/s², in a large box: water that a hydrostatic pressure carries stays
/// where it is, presses as deep water does, and its weight and inertia are borne by the tank. (Solved for with gravity, it
/// stood 5 % too low within a second, moved with 9 cm/s and had a third of its pressure less; in the larger box it burst.)
#[test]
#[ignore = "long"]
fn a_full_tank_bears_its_water() {
    // at rest nothing moves; where the water is pressed together as it begins to be pushed, it is stirred
    for (push, load_within, speed_within) in [(0.0, 0.001, 1e-6), (2.0, 0.01, 0.02)] {
        let experiment = experiment(&format!(
            "rfm 1
solid tank = box([0, 0, 0], [0.4, 0.2, 0.3]).move([{push}/2*t^2, 0, 0])
scene full {{
  box {{ min: [-0.1, -0.1, -0.1], max: [2, 0.3, 0.4] }}
  container {{ solid: tank, restitution: 0 }}
  fluid water {{ shape: box([0, 0, 0], [0.4, 0.2, 0.3]), spacing: 2.5 cm, density: 1000, viscosity: 0 }}
  method: dfsph
  run {{ until: 0.6 s, save_every: 0.6 s }}
}}"
        ));
        let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
        assert!(simulation.parameters().is_sealed);
        let load = Probe::Force { obstacle: 0, about: DVec3::ZERO };
        let mut gauge = simulation.gauge(load).unwrap_or_else(|e| panic!("{e}"));
        let (mut sum, mut count, mut fastest) = (DVec3::ZERO, 0.0, 0.0_f64);
        while simulation.time() < 0.6 {
            simulation.step().unwrap_or_else(|e| panic!("{e}"));
            let carried = DVec3::new(push * simulation.time(), 0.0, 0.0);
            let relative = simulation.particles().velocity.iter().map(|v| (v - carried).length());
            fastest = relative.fold(fastest, f64::max);
            if simulation.time() > 0.2 {
                let values = simulation.sample(&mut gauge);
                sum += DVec3::new(values[0], values[1], values[2]);
                count += 1.0;
            }
        }
        println!("pushed with {push} m/s²: {:.2} N, {fastest:.4} m/s in the tank", sum / count);
        let known = DVec3::new(-24.0 * push, 0.0, -24.0 * 9.81);
        assert!((sum / count - known).length() < load_within * known.length(), "{} for {known}", sum / count);
        assert!(fastest < speed_within, "{fastest} m/s");
        let Particles { position, pressure, .. } = simulation.particles();
        let middle = 0.2 + 0.5 * push * simulation.time().powi(2);
        for (at, pressure) in position.iter().zip(pressure).filter(|(at, _)| (at.x - middle).abs() < 0.05) {
            // the push presses the water together from its front face, where it presses on nothing
            let known = 9810.0 * (0.3 - at.z) + 1000.0 * push * (middle + 0.2 - at.x);
            // packing moves the highest particle, half a spacing above which the pressure is zero
            assert!((pressure - known).abs() < 100.0, "{pressure} Pa at {at}, {known}");
        }
    }
}

/// A full tank whose lid begins to rise: from then on gravity moves its water, also after a resume, and a run beyond the
/// scene's end knows it.
#[test]
fn a_full_tank_that_opens_has_its_weight_back() {
    let experiment = experiment(
        "rfm 1
solid lid = box([-1, -1, 0.3], [2, 2, 2]).move([0, 0, 0.6*max(t - 0.05, 0)])
scene opening {
  box { min: [0, 0, 0], max: [0.3, 0.2, 0.6] }
  obstacle { solid: lid, restitution: 0 }
  fluid water { shape: z <= 0.3, spacing: 3 cm, density: 1000 }
  method: dfsph
  run { until: 0.04 s, save_every: 0.04 s }
}",
    );
    let mut straight = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    run_to(&mut straight, 0.04);
    assert!(straight.parameters().is_sealed);
    let mut resumed = experiment.resume(&straight.checkpoint()).unwrap_or_else(|e| panic!("{e}"));
    assert!(resumed.parameters().is_sealed);
    let fastest = |simulation: &Simulation| simulation.stats().max_speed;
    assert!(fastest(&straight) < 0.02, "{} m/s", fastest(&straight));
    for simulation in [&mut straight, &mut resumed] {
        run_to(simulation, 0.8);
        assert!(!simulation.parameters().is_sealed);
    }
    assert!(straight.checkpoint() == resumed.checkpoint());
    // the lid is at 0.75 m then; it drew the water up by 3 cm before the vessel counted as open
    let top = straight.particles().position.iter().map(|at| at.z).fold(0.0, f64::max);
    assert!(top < 0.3 && fastest(&straight) < 0.1, "{top} m, {} m/s", fastest(&straight));
}

/// Gravity that swings in a sealed tank, and in an open one: pressures follow it at once. Another pressure than that of the
/// weight is left alone. (Means over the relaxation time were 25 to 38 % off.)
#[test]
fn pressures_follow_a_gravity_of_time() {
    for (top, name) in [(0.3, "sealed"), (0.5, "open")] {
        let mut simulation = simulation(&format!(
            "rfm 1
scene swinging {{
  box {{ min: [0, 0, 0], max: [0.3, 0.2, {top}] }}
  fluid water {{ shape: z <= 0.3, spacing: 3 cm, density: 1000 }}
  gravity: [0, 0, -9.81*(1 + 0.5*sin(2*pi*t))]
  method: dfsph
  run {{ until: 1 s, save_every: 1 s }}
}}"
        ));
        let mut worst = 0.0_f64;
        while simulation.time() < 0.8 {
            simulation.step().unwrap_or_else(|e| panic!("{e}"));
            let Particles { position, pressure, .. } = simulation.particles();
            let low: Vec<f64> =
                position.iter().zip(pressure).filter(|(at, _)| at.z < 0.06).map(|(_, p)| *p).collect();
            let known = 0.27 * 1000.0 * simulation.parameters().gravity.length();
            let found = low.iter().sum::<f64>() / low.len() as f64;
            if simulation.time() > 0.3 {
                worst = worst.max((found / known - 1.0).abs());
            }
        }
        println!("{name}: off by {worst:.3}");
        // the mean height of the particles is known to a quarter of a spacing
        assert!(worst < 0.07, "{name}: {worst}");
    }
    // a swing of next to no gravity says nothing about the pressure of a drop under tension
    let pressure = |gravity: &str| {
        let mut simulation = simulation(&format!(
            "rfm 1
scene drop {{
  box {{ min: [-1, -1, -1], max: [1, 1, 1] }}
  fluid water {{ shape: ball([0, 0, 0], 0.2), spacing: 5 cm, density: 1000, surface_tension: 5 N/m, viscosity: 5 Pa·s }}
  gravity: {gravity}
  method: dfsph
  run {{ until: 1 s, save_every: 1 s }}
}}"
        ));
        run_to(&mut simulation, 0.1);
        simulation.particles().pressure.iter().sum::<f64>()
    };
    let (without, with) = (pressure("[0, 0, 0]"), pressure("[0, 0, -1e-6*(1.5 + sin(60*t))]"));
    assert!((with / without - 1.0).abs() < 0.01, "{with} {without}");
}

/// Water of `dfsph` that is full to a lid, in a chamber of a scene whose room is empty elsewhere. (It counted as a fluid with
/// a surface, and burst within a second.)
#[test]
fn a_full_chamber_is_full_whatever_lies_behind_its_walls() {
    let chamber = |walls: &str| {
        simulation(&format!(
            "rfm 1
solid walls = {walls}
scene full {{
  box {{ min: [0, 0, 0], max: [0.4, 0.16, 0.5], restitution: 0 }}
  obstacle {{ solid: walls, restitution: 0 }}
  fluid water {{ shape: box([0, 0, 0], [0.16, 0.16, 0.2]), spacing: 2 cm, density: 1000 }}
  method: dfsph
  run {{ until: 0.2 s, save_every: 0.2 s }}
}}"
        ))
    };
    let side = "box([0.16, -1, -1], [0.24, 1, 1])";
    let lid = "box([-1, -1, 0.2], [0.24, 1, 0.25])";
    let mut closed = chamber(&format!("{side} or {lid}"));
    assert!(closed.parameters().is_sealed);
    run_to(&mut closed, 0.1);
    assert!(closed.stats().max_speed < 1e-6, "{} m/s", closed.stats().max_speed);
    // a stirrer in it does not open it to what lies behind its walls
    let stirrer = "box([0.02, 0.07, 0.05], [0.14, 0.09, 0.07])";
    let stirred = |walls: &str| {
        simulation(&format!(
            "rfm 1
solid walls = {walls}
solid stirrer = {stirrer}.move([0, 0.02*sin(10*t), 0])
scene full {{
  box {{ min: [0, 0, 0], max: [0.4, 0.16, 0.5], restitution: 0 }}
  obstacle {{ solid: walls, restitution: 0 }}
  obstacle {{ solid: stirrer, restitution: 0 }}
  fluid water {{ shape: box([0, 0, 0], [0.16, 0.16, 0.2]), spacing: 2 cm, density: 1000 }}
  method: dfsph
  run {{ until: 0.2 s, save_every: 0.2 s }}
}}"
        ))
    };
    let mut moving = stirred("box([0.16, -1, -1], [0.18, 1, 1]) or box([-1, -1, 0.2], [0.18, 1, 0.22])");
    run_to(&mut moving, 0.1);
    assert!(
        moving.parameters().is_sealed && moving.stats().max_speed < 1.0,
        "{} m/s",
        moving.stats().max_speed
    );
    // a hole in the lid as wide as a particle, and a lid as thin as a film, leave it open
    let hole = "box([0.06, 0.06, -1], [0.085, 0.085, 1])";
    let film = "box([-1, -1, 0.2], [0.24, 1, 0.202])";
    for open in [side.to_string(), format!("{side} or {lid} \\ {hole}"), format!("{side} or {film}")] {
        assert!(!chamber(&open).parameters().is_sealed, "{open}");
    }
}

/// Water between two pistons that swing together moves as they do, and their work is that of its motion. (What carries it was
/// learnt from the pressure of eight steps, and came late: it moved 5 % too far, and the noted work was 44 % of its energy.)
#[test]
#[ignore = "long"]
fn water_between_pistons_swings_with_them() {
    let mut simulation = simulation(
        "rfm 1
let way = 0.05*(1 - cos(4*pi*t))
solid left = box([-2, -1, -1], [-0.15, 1, 1]).move([way, 0, 0])
solid right = box([0.15, -1, -1], [2, 1, 1]).move([way, 0, 0])
scene swinging {
  box { min: [-0.4, -0.1, -0.1], max: [0.5, 0.1, 0.1], restitution: 0 }
  obstacle { solid: left, restitution: 0 }
  obstacle { solid: right, restitution: 0 }
  fluid water { shape: box([-0.15, -0.1, -0.1], [0.15, 0.1, 0.1]), density: 1000, spacing: 0.02, viscosity: 0.1 }
  gravity: [0, 0, 0]
  method: dfsph
  run { until: 1 s, save_every: 0.1 s }
}",
    );
    let (mut found, mut truth) = (0.0, 0.0);
    for k in 1..=40 {
        let time = 0.025 * f64::from(k);
        simulation.advance(time, |_| std::ops::ControlFlow::Continue(())).unwrap();
        let velocity = &simulation.particles().velocity;
        found += velocity.iter().map(|v| v.length_squared()).sum::<f64>() / velocity.len() as f64;
        truth += (0.2 * std::f64::consts::PI * (4.0 * std::f64::consts::PI * time).sin()).powi(2);
    }
    let too_fast = (found / truth).sqrt() - 1.0;
    assert!(too_fast.abs() < 0.03, "{too_fast}");
    // over two periods nothing is given; the greatest energy is 2.4 J
    let given = simulation.audit().wall_work().unwrap();
    assert!(given.abs() < 0.25, "{given} J");
}
