//! What walls that move do to the fluid: the audit measures their work, so that it sees what comes from nowhere.

use std::ops::ControlFlow;

use rfm::glam::DVec3;
use rfm::sph::{Finding, Simulation};

use crate::tool::{experiment, run_to, simulation};

/// Kinetic, potential and elastic energy, J.
fn energy(simulation: &mut Simulation) -> f64 {
    let mut gauge = simulation.gauge(rfm::sph::Probe::Energy).unwrap();
    simulation.sample(&mut gauge)[3]
}

/// A wall that comes at 2 m/s returns a particle at rest with twice its speed, if nothing is lost.
#[test]
fn a_wall_that_hits_a_particle_gives_it_what_it_has_then() {
    let mut simulation = simulation(
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
    let (found, work) = (energy(&mut simulation), simulation.audit().wall_work().unwrap());
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

/// A piston that pushes half a metre of water together and rests again: the water keeps what it was given,
/// less a little artificial viscosity. The sum of force times way has the error of the steps and of forces in
/// corners.
#[test]
#[ignore = "long"]
fn a_piston_gives_what_the_water_has_then() {
    for method in ["wcsph", "dfsph"] {
        let mut simulation = simulation(&PISTON.replace("METHOD", method));
        let before = energy(&mut simulation);
        simulation.advance(1.2, |_| ControlFlow::Continue(())).unwrap();
        let gained = energy(&mut simulation) - before;
        let audit = simulation.audit();
        let (work, excess) = (audit.wall_work().unwrap(), audit.energy_excess().unwrap());
        println!("{method}: {work:.2} J of work, {gained:.2} J gained, {excess:.1e}");
        assert!(gained > 50.0 && (gained / work - 1.0).abs() < 0.04, "{method}: {gained} of {work}");
        // dfsph also displaces particles without a force, and settles it later: 0.6 %. More than 1 % would be a finding
        assert!(excess < 8e-3, "{method}: {excess}");
        assert_eq!(simulation.findings(), [], "{method}");
    }
}

/// Probes of the force on a piston, which is found in every step, change nothing; nor do they for a piston in
/// a corner.
#[test]
#[ignore = "long"]
fn work_does_not_depend_on_whether_forces_are_asked_for() {
    for method in ["wcsph", "dfsph"] {
        let [work, of_all_steps] = ["", "  probe push { force: piston }\n"].map(|probe| {
            let text = PISTON.replace("METHOD", method).replacen("  method", &format!("{probe}  method"), 1);
            let experiment = experiment(&text);
            let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
            for probe in &experiment.scene().probes {
                simulation.gauge(probe.measured).unwrap();
            }
            simulation.advance(0.4, |_| ControlFlow::Continue(())).unwrap();
            let audit = simulation.audit();
            audit.wall_work().unwrap()
        });
        // only what is wrong with the rough division is found in one of eight steps: 0.04 %
        assert!((work / of_all_steps - 1.0).abs() < 0.005, "{method}: {work} {of_all_steps}");
    }
}

/// Water that has dissipated most of what a stirrer gave, and then gains speed from nowhere, less than it has
/// lost before, in an open tank and in a full one, where the work of the blade is known to a tenth.
#[test]
#[ignore = "long"]
fn energy_from_nowhere_is_found_beside_a_stirrer() {
    for (height, kick) in [(0.8, 0.4), (0.4, 1.2)] {
        energy_from_nowhere_is_found_in_a_tank(height, kick);
    }
}

fn energy_from_nowhere_is_found_in_a_tank(height: f64, upwards: f64) {
    let experiment = experiment(&format!(
        "rfm 1
solid blade = box([-0.3, -0.05, 0], [0.3, 0.05, 0.3]).rotate_z(9*t)
scene work {{
  box {{ min: [-0.4, -0.4, 0], max: [0.4, 0.4, {height}] }}
  obstacle {{ solid: blade, restitution: 0 }}
  fluid water {{ shape: z <= 0.4, density: 1000, spacing: 0.08 }}
  method: wcsph
  run {{ until: 3 s }}
}}",
    ));
    let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    let before = energy(&mut simulation);
    simulation.advance(1.0, |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(simulation.findings(), []);
    let work = simulation.audit().wall_work().unwrap();
    let lost = work - (energy(&mut simulation) - before);
    let mut checkpoint = simulation.checkpoint();
    let kicked: Vec<f64> = checkpoint.get("velocity z").unwrap().iter().map(|v| v + upwards).collect();
    let squares = |column: &[f64]| column.iter().map(|v| v * v).sum::<f64>();
    let mass = simulation.parameters().particle_mass;
    let kick = 0.5 * mass * (squares(&kicked) - squares(checkpoint.get("velocity z").unwrap()));
    assert!(
        0.0 < kick && kick < 0.5 * lost,
        "the energy at the start would not show it: {kick} J of {lost} J"
    );
    checkpoint.set("velocity z", kicked);
    let mut simulation = experiment.resume(&checkpoint).unwrap();
    assert_eq!(simulation.audit().wall_work(), Some(work), "it goes on from the checkpoint");
    // the audit looks at means of eight steps
    for _ in 0..16 {
        simulation.step().unwrap();
    }
    assert!(matches!(simulation.findings()[..], [(Finding::Energy, _)]), "{:?}", simulation.findings());
}

/// A drum that turns in a fluid which sticks to it: at last its power is what the closed form says,
/// 4πµLΩ²·a²b²/(b² − a²). With five spacings across the gap the friction is a sixth too large; it was a tenth too
/// large when packing took 5 % of the mass, and with it of all forces.
#[test]
#[ignore = "long"]
fn a_drum_works_by_friction() {
    let mut simulation = simulation(
        "rfm 1
let r2 = x^2 + y^2
solid drum = cylinder(0.5, 2).move([0, 0, -1])
solid vessel = cylinder(1, 2).move([0, 0, -1])
scene work {
  box       { min: [-1.1, -1.1, 0], max: [1.1, 1.1, 0.4] }
  container { solid: vessel, walls: no_slip, restitution: 0 }
  obstacle  { solid: drum, walls: no_slip, surface_velocity: [-2*y, 2*x, 0], restitution: 0 }
  fluid oil { shape: 0.25 <= r2 <= 1, density: 1000, spacing: 0.1, viscosity: 100 }
  gravity: [0, 0, 0]
  method: dfsph
  run       { until: 2 s }
}",
    );
    let mut after = |until: f64| {
        simulation.advance(until, |_| ControlFlow::Continue(())).unwrap();
        simulation.audit().wall_work().unwrap()
    };
    let (early, late) = (after(1.5), after(2.0));
    let power = (late - early) / 0.5;
    let exact = 4.0 * std::f64::consts::PI * 100.0 * 0.4 * 4.0 * 0.25 / 0.75;
    println!("{power:.1} W for {exact:.1}");
    assert!((power / exact - 1.0).abs() < 0.2, "{power} {exact}");
    assert!(simulation.audit().energy_excess().unwrap() < 1e-2);
}

/// A vessel that goes up and down: the work of a period comes back, and its errors do not add up to a finding.
#[test]
#[ignore = "long"]
fn a_vessel_that_heaves_takes_back_what_it_gives() {
    for method in ["wcsph", "dfsph"] {
        let mut simulation = simulation(
            &"rfm 1
let way = 0.1*sin(4*t)
solid inside = box([-0.3, -0.3, 0.2], [0.3, 0.3, 1]).move([0, 0, way])
scene work {
  box { min: [-0.4, -0.4, 0], max: [0.4, 0.4, 1.3] }
  container { solid: inside, restitution: 0 }
  fluid water { shape: box([-0.3, -0.3, 0.2], [0.3, 0.3, 0.5]), density: 1000, spacing: 0.05 }
  method: METHOD
  run { until: 5 s }
}"
            .replace("METHOD", method),
        );
        simulation.advance(3.2, |_| ControlFlow::Continue(())).unwrap();
        let audit = simulation.audit();
        println!("{method}: {:?} J, {:?}", audit.wall_work(), audit.energy_excess());
        assert_eq!(simulation.findings(), [], "{method}");
    }
}

/// A rod that is lowered into a pool is lifted by what it displaces, with both methods. Compressed by the wall already where
/// there was a gap, the water of `wcsph` fled from the rod, and its lift was 1.47 times as large.
#[test]
#[ignore = "long"]
fn a_rod_that_is_lowered_closes_the_gap_before_it_presses() {
    for method in ["wcsph", "dfsph"] {
        let mut simulation = simulation(
            &"rfm 1
solid rod = cylinder(0.1, 1).move([0.3, 0.3, 0.45 - 0.2*t])
scene lowered {
  box { min: [0, 0, 0], max: [0.6, 0.6, 0.8], restitution: 0 }
  fluid water { shape: z <= 0.4, particles: 1500, density: 1000 }
  obstacle { solid: rod, restitution: 0 }
  method: METHOD
  run { until: 1 s }
}"
            .replace("METHOD", method),
        );
        let mut gauge = simulation.gauge(rfm::sph::Probe::Force { obstacle: 0, about: DVec3::ZERO }).unwrap();
        simulation.advance(0.8, |_| ControlFlow::Continue(())).unwrap();
        simulation.sample(&mut gauge);
        simulation.advance(1.0, |_| ControlFlow::Continue(())).unwrap();
        // the mean since the last sample
        let lift = simulation.sample(&mut gauge)[2];
        let area = std::f64::consts::PI * 0.01;
        let known = 9810.0 * area * 0.13 / (1.0 - area / 0.36);
        println!("{method}: {lift:.1} N for {known:.1}");
        // three particles across the rod, a third of which is immersed by four
        assert!((1.0..1.3).contains(&(lift / known)), "{method}: {lift} N for {known}");
    }
}

/// A wall that is drawn into the water by its formula, so slowly that it rests: its load is that of a wall at rest. (What the
/// map of a body that changes its shape tells of the room in the box counted as all that it takes, also behind the walls of
/// the box: the load was 18 to 22 % too large, and a vertical wall on which water slips was lifted.)
#[test]
#[ignore = "long"]
fn a_wall_that_hardly_changes_bears_what_one_at_rest_does() {
    for method in ["wcsph", "dfsph"] {
        let mut simulation = simulation(
            &"rfm 1
solid wall = box([-1, -1, -1], [0.0001*t, 1, 1])
scene pressed {
  box { min: [-0.05, 0, 0], max: [0.4, 0.12, 0.4] }
  obstacle { solid: wall, restitution: 0 }
  fluid water { shape: box([0, 0, 0], [0.4, 0.12, 0.12]), spacing: 2 cm, density: 1000, viscosity: 0.05 }
  method: METHOD
  run { until: 0.8 s }
}"
            .replace("METHOD", method),
        );
        let mut gauge = simulation.gauge(rfm::sph::Probe::Force { obstacle: 0, about: DVec3::ZERO }).unwrap();
        run_to(&mut simulation, 0.4);
        simulation.sample(&mut gauge);
        run_to(&mut simulation, 0.8);
        let force = simulation.sample(&mut gauge);
        let known = 0.5 * 9810.0 * 0.12_f64.powi(3);
        println!("{method}: {:.2} N for {:.2}, {:.2} N upwards", force[0], -known, force[2]);
        assert!(
            (force[0] / -known - 1.0).abs() < 0.06 && force[2].abs() < 0.03 * known,
            "{method}: {force:?}"
        );
    }
}

/// Water that meets a plate with its flat front hardly leaves it again, whichever of the two moves and however long a step
/// is: before the gap between them is closed, nothing is compressed. (Half to two thirds of its speed came back when steps
/// were short, and up to a quarter otherwise.)
#[test]
fn a_flat_impact_does_not_depend_on_the_frame_of_reference() {
    let loss = |slug: f64, plate: f64, step: &str| {
        let text = format!(
            "rfm 1
solid plate = (x >= 0).move([0.5 + {plate}*t, 0, 0])
scene flow {{
  box {{ min: [-0.3, 0, 0], max: [0.9, 0.1, 0.1], restitution: 0 }}
  obstacle {{ solid: plate, restitution: 0 }}
  fluid water {{ shape: box([0.398, 0, 0], [0.448, 0.1, 0.1]), density: 1000, spacing: 0.01, velocity: [{slug}, 0, 0], viscosity: 0 }}
  method: dfsph
  gravity: [0, 0, 0]
  run {{ until: 0.04 s{step} }}
}}"
        );
        let mut simulation = simulation(&text);
        run_to(&mut simulation, 0.04);
        let velocity = &simulation.particles().velocity;
        let after = velocity.iter().map(|v| v.x).sum::<f64>() / velocity.len() as f64;
        (slug - after) / (slug - plate)
    };
    for step in ["", ", dt: 0.15 ms"] {
        for (slug, plate) in [(3.0, 0.0), (0.0, -3.0), (1.5, -1.5)] {
            let found = loss(slug, plate, step);
            // a step crosses up to 0.4 spacings, and what two systems of walls differ by in it becomes a debt
            assert!((0.99..1.12).contains(&found), "{slug} m/s on {plate} m/s{step}: {found}");
        }
    }
}

/// A gate that is gone leaves the water as if it had never been there: no density is that of half a fluid and half a wall.
/// (Particles behind it had down to 471 kg/m³, and the flow gained 2 % of energy at the next wall.)
#[test]
fn a_gate_that_opens_takes_no_density_along() {
    let at = |height: &str| format!("box([-0.02, -1, -1], [0.02, 1, 1]).move([0, 0, {height}])");
    let front = |gate: &str, until: f64| {
        let mut simulation = simulation(&format!(
            "rfm 1
solid gate = {gate}
scene flow {{
  box {{ min: [-0.2, -0.05, 0], max: [0.3, 0.05, 0.6], restitution: 0 }}
  obstacle {{ solid: gate, restitution: 0 }}
  fluid water {{
    shape: box([-0.2, -0.05, 0], [-0.02, 0.05, 0.3]), density: 1000, spacing: 0.02, viscosity: 0.1,
    start: hydrostatic, sound_speed: 34
  }}
  method: wcsph
  run {{ until: 1 s }}
}}"
        ));
        run_to(&mut simulation, until);
        let particles = simulation.particles();
        let thinnest = particles.density.iter().copied().fold(f64::INFINITY, f64::min);
        (particles.position.iter().map(|at| at.x).sum::<f64>() / particles.len() as f64, thinnest)
    };
    let (never, _) = front(&at("5"), 0.14);
    let shapes = format!("if t < 0.001 then {} else {}", at("0"), at("5"));
    for gate in [at("if t < 0.001 then 0 else 5"), shapes] {
        let (gone, thinnest) = front(&gate, 0.14);
        // the front has lost its balance with the wall for ten steps, and moves as one at a surface
        assert!(thinnest > 850.0, "{gate}: {thinnest} kg/m³");
        assert!((gone - never).abs() < 0.002, "{gate}: {gone} m, without a gate {never} m");
    }
    // at 20 m/s it takes 65 ms until the gate is out of the water
    let (_, thinnest) = front(&at("20*t"), 0.08);
    assert!(thinnest > 850.0, "{thinnest} kg/m³ behind a gate that is lifted");
}
