//! How fluids are filled with particles: a stated number of them holds the mass of the shape, as dense as the fluid.

use std::ops::ControlFlow;

use glam::DVec3;
use rfm::experiment::Deviations;
use rfm::sph::Probe;
use rfm::{Engine, Experiment, Program};

/// The flow of `couette`, five spacings across, for a method without compression.
const ENCLOSED: &str = "rfm 1
let spacing = 0.1
let r2 = x^2 + y^2
let turn = 2*(1/r2 - 1)/3
solid drum = cylinder(0.5, 2).move([0, 0, -1])
solid vessel = cylinder(1, 2).move([0, 0, -1])
scene enclosed {
  box       { min: [-1.1, -1.1, 0], max: [1.1, 1.1, 0.4] }
  container { solid: vessel, walls: no_slip, restitution: 0 }
  obstacle  { solid: drum, walls: no_slip, surface_velocity: [-2*y, 2*x, 0], restitution: 0 }
  fluid oil { shape: 0.25 <= r2 <= 1, density: 1000, spacing: spacing, viscosity: 100 }
  gravity: [0, 0, 0]
  method: dfsph
  run       { until: 2 s, save_every: 0.1 s }
  truth     { velocity: [-y*turn, x*turn, 0], from: 1.5 s }
}";

/// A number of particles fills the whole shape. A lattice whose top layers are left out instead holds the
/// fluid's mass in less room: 13 % too dense, for the 3000 particles beside a post.
#[test]
fn a_number_of_particles_fills_the_shape() {
    let reach = "0 <= x <= 0.4 and 0 <= y <= 1 and 0 <= z <= 0.8";
    for (shape, number, post) in
        [(reach, 3000, 0.7), (reach, 1000, 0.7), (reach, 3000, 0.3), (reach, 4000, 0.7)]
    {
        let text = format!(
            "rfm 1
solid post = cylinder(0.15, 1).move([{post}, 0.5, 0])
scene dam {{
  box {{ min: [0, 0, 0], max: [1, 1, 1] }}
  obstacle {{ solid: post }}
  fluid water {{ shape: {shape}, density: 1000, particles: {number} }}
  run {{ until: 1 s }}
}}"
        );
        let program = Program::from_source("dam.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        let experiment = Experiment::new(&program, "dam", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
        let simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
        let (particles, parameters) = (simulation.particles(), simulation.parameters());
        assert_eq!(particles.len(), number);
        let mass = parameters.particle_mass * number as f64;
        // the post takes the part of a disc that lies in the shape
        let (radius, beyond) = (0.15f64, post - 0.4);
        let segment = if beyond >= radius {
            0.0
        } else {
            let whole = std::f64::consts::PI * radius * radius;
            let angle = (f64::abs(beyond) / radius).acos();
            let small = radius * radius * (angle - angle.sin() * angle.cos());
            if beyond < 0.0 { whole - small } else { small }
        };
        let whole = 1000.0 * 0.8 * (0.4 - segment);
        assert!((mass / whole - 1.0).abs() < 2e-3, "{mass} of {whole}");
        let compression = simulation.audit().compression();
        println!("{number} particles, post at {post}: {compression:?}");
        // a post that cuts cells
        assert!(compression.mean < 0.003, "{compression:?}");
    }
}

/// Ordinary shapes whose sides no lattice divides, some with a vessel of the same shape around them: a tank,
/// a jet, a column of honey, a bent tube.
const SHAPES: [(&str, &str, usize); 4] = [
    ("box([0, 0, 0], [0.6, 0.2, 0.15])", "box { max: [0.6, 0.2, 0.4] }", 3000),
    ("cylinder(0.05, 1.1).move([0.02, 0, 0.45])", "box { min: [-0.5, -0.5, 0], max: [0.5, 0.5, 1.6] }", 2000),
    (
        "cylinder(0.12, 0.5).move([0.02, 0.01, 0.5])",
        "box { min: [-0.6, -0.6, 0], max: [0.6, 0.6, 1.2] }",
        2000,
    ),
    (
        "tube and (x <= 0 and z <= 0.8 or x >= 0 and z <= 0.6)",
        "box { min: [-0.45, -0.15, 0], max: [0.45, 0.15, 1.05] }\n  container { solid: tube }",
        3000,
    ),
];

/// A fluid with a stated number of particles starts as dense as it is, so it neither bursts nor grows. (With
/// vacancies in a lattice that was too dense elsewhere, these started 2, 12, 10 and 13 % too dense and grew
/// by 1 to 3 % of their volume; with `dfsph` the fluid in the tube paid a debt of its start and doubled its
/// energy in four steps.)
#[test]
#[ignore = "long"]
fn a_number_of_particles_is_as_dense_as_the_fluid() {
    for (shape, room, number) in SHAPES {
        for method in ["wcsph", "dfsph"] {
            let text = format!(
                "rfm 1
let bend = torus(0.3, 0.1).rotate_x(90 deg).move([0, 0, 0.45]) and z <= 0.46
solid tube = bend or cylinder(0.1, 0.6).move([-0.3, 0, 0.45]) or cylinder(0.1, 0.6).move([0.3, 0, 0.45])
scene start {{
  {room}
  fluid water {{ shape: {shape}, density: 1000, particles: {number} }}
  method: {method}
  run {{ until: 1 s }}
}}"
            );
            let program = Program::from_source("start.rfm", text).unwrap_or_else(|e| panic!("{e}"));
            let experiment =
                Experiment::new(&program, "start", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
            let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
            assert_eq!(simulation.particles().len(), number);
            let compression = simulation.audit().compression();
            println!("{method}, {shape}: {compression:?}");
            assert!(compression.mean < 0.003 && compression.p99 < 0.035, "{method} {shape}: {compression:?}");
            simulation.advance(0.1, |_| ControlFlow::Continue(())).unwrap_or_else(|e| panic!("{e}"));
            let (excess, volume) = (simulation.audit().energy_excess(), simulation.audit().volume_change());
            println!("  energy {excess:?}, volume {volume:.1e}");
            assert!(excess.is_some_and(|excess| excess < 0.01), "{method} {shape}: {excess:?}");
            assert!(volume.abs() < 0.006, "{method} {shape}: {volume}");
        }
    }
}

/// Thin blades take few sites of a lattice. With 3000 particles a lattice whose last layer did not fit was chosen, and
/// all other layers were 8 % too dense.
#[test]
#[ignore = "long"]
fn a_number_of_particles_fills_a_pool_to_its_top() {
    for number in [3000, 2000, 4400] {
        let text = format!(
            "rfm 1
solid blades = box([0.2, 0.48, 0.05], [0.8, 0.52, 0.35]) or box([0.48, 0.2, 0.05], [0.52, 0.8, 0.35])
scene pool {{
  box {{ max: [1, 1, 1] }}
  obstacle {{ solid: blades }}
  fluid water {{ shape: box([0, 0, 0], [1, 1, 0.4]), density: 1000, particles: {number} }}
  run {{ until: 1 s }}
}}"
        );
        let program = Program::from_source("pool.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        let experiment = Experiment::new(&program, "pool", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
        let simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
        let heights = &simulation.particles().position.z;
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        // pool and blades are symmetric about the same height
        assert!((mean / 0.2 - 1.0).abs() < 0.01, "{number}: {mean}");
    }
}

/// A lake and a wet bed, and two pools with a wall between them: layers as high as the particles' spacing
/// would end beside one of the surfaces, and the shallow water would be too much by 7 %, the deep one too
/// little by 3 %.
#[test]
#[ignore = "long"]
fn every_level_of_a_fluid_is_filled() {
    let wall = "solid wall = box([0.95, -1, -1], [1.05, 2, 2])";
    for (wall, obstacle, middle) in [("", "", [1.0, 1.0]), (wall, "obstacle { solid: wall }", [0.95, 1.05])] {
        let [left, right] = middle;
        let text = format!(
            "rfm 1
{wall}
scene levels {{
  box {{ max: [2, 0.5, 1] }}
  {obstacle}
  fluid water {{ shape: box([0, 0, 0], [{left}, 0.5, 0.5]) or box([{right}, 0, 0], [2, 0.5, 0.17]), density: 1000, spacing: 0.03 }}
  run {{ until: 1 s }}
}}"
        );
        let program = Program::from_source("levels.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        let experiment = Experiment::new(&program, "levels", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
        let simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
        let mass = simulation.parameters().particle_mass;
        let on_left = simulation.particles().position.x.iter().filter(|x| **x < 1.0).count();
        let on_right = simulation.particles().len() - on_left;
        for (number, length, depth) in [(on_left, left, 0.5), (on_right, 2.0 - right, 0.17)] {
            let off = mass * number as f64 / (1000.0 * length * 0.5 * depth) - 1.0;
            println!("{depth} m deep: {:+.2} %", 100.0 * off);
            // found: +0.5 and -1.5 %
            assert!(off.abs() < 0.02, "{depth}: {off}");
        }
    }
}

/// A half-space has no bounds of its own, but those that the box leaves it. (Without this, 859 of 4000
/// particles were removed with the corners of the box, and none took their place.)
#[test]
fn a_number_of_particles_fills_a_half_space_in_a_container() {
    let text = "rfm 1
solid tank = cylinder(0.5, 1).move([0.5, 0.5, 0])
scene still {
  box { max: [1, 1, 1] }
  container { solid: tank }
  fluid water { shape: z <= 0.5, density: 1000, particles: 4000 }
  run { until: 1 s }
}";
    let program = Program::from_source("tank.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let experiment = Experiment::new(&program, "still", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    assert_eq!(simulation.particles().len(), 4000);
    let mass = 4000.0 * simulation.parameters().particle_mass;
    let whole = 1000.0 * std::f64::consts::PI * 0.25 * 0.5;
    assert!((mass / whole - 1.0).abs() < 2e-3, "{mass} of {whole}");
    let heights = &simulation.particles().position.z;
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    assert!((mean / 0.25 - 1.0).abs() < 0.01, "{mean}");
}

/// A fluid that fills its vessel is packed and keeps its mass. Particles that are left out at the walls instead leave
/// gaps, and the flow deviates by 63 %.
#[test]
#[ignore = "long"]
fn a_fluid_that_fills_its_vessel_is_packed() {
    let program = Program::from_source("enclosed.rfm", ENCLOSED).unwrap_or_else(|e| panic!("{e}"));
    let experiment = Experiment::new(&program, "enclosed", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let start = experiment.start().unwrap_or_else(|e| panic!("{e}"));
    assert!(start.warnings.list.is_empty(), "{:?}", start.warnings.list);
    // the lattice has this number of sites more than the fluid has cells
    assert!(start.carved <= 5, "{}", start.carved);
    let mut simulation = start.simulation;
    let mass = simulation.parameters().particle_mass * simulation.particles().len() as f64;
    let whole = 1000.0 * std::f64::consts::PI * 0.75 * 0.4;
    let packing = simulation.parameters().packing;
    println!(
        "{} particles, {:.2} % of the mass, {packing:.3} of the room",
        simulation.particles().len(),
        100.0 * mass / whole
    );
    assert!(
        (mass / whole - 1.0).abs() < 2e-3 && (0.9..0.98).contains(&packing),
        "{mass} of {whole}, {packing}"
    );
    let mut deviations = Deviations::default();
    for frame in 1..=20 {
        let reached = simulation.advance(f64::from(frame) * 0.1, |_| ControlFlow::Continue(()));
        reached.unwrap_or_else(|e| panic!("{e}"));
        deviations.look(&experiment, &simulation);
    }
    let velocity = deviations.total().velocity;
    println!("enclosed: {velocity:?}");
    assert!(velocity.is_some_and(|velocity| velocity < 0.13), "{velocity:?}");
}

/// A rod that shakes in a full vessel carries the mass of water that potential flow gives, πρa²(b² + a²)/(b² − a²) for
/// each metre. (Displaced particles used to close gaps first, and it felt 1 % of that.)
#[test]
#[ignore = "long"]
fn a_body_in_a_full_vessel_meets_its_water() {
    let text = "rfm 1
solid rod = cylinder(0.1, 2).move([0.01*(1 - cos(10*t)), 0, -1])
solid pot = cylinder(0.3, 2).move([0, 0, -1])
scene shake {
  box { min: [-0.32, -0.32, 0], max: [0.32, 0.32, 0.06] }
  container { solid: pot }
  obstacle { solid: rod }
  fluid water { shape: 0.1^2 <= x^2 + y^2 <= 0.3^2, density: 1000, particles: 3000 }
  gravity: [0, 0, 0]
  method: dfsph
  probe f { force: rod }
  run { until: 1 s }
}";
    let program = Program::from_source("shake.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let experiment = Experiment::new(&program, "shake", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    // the container comes first
    let mut gauge = simulation.gauge(Probe::Force { obstacle: 1, about: DVec3::ZERO }).unwrap();
    let (mut felt, mut all, mut time) = (0.0, 0.0, 0.0);
    let period = std::f64::consts::TAU / 10.0;
    while time < period {
        simulation.step_at_most(period - time).unwrap_or_else(|e| panic!("{e}"));
        let dt = simulation.time() - time;
        let acceleration = (10.0 * (time + 0.5 * dt)).cos();
        felt -= dt * acceleration * simulation.sample(&mut gauge)[0];
        all += dt * acceleration * acceleration;
        time = simulation.time();
    }
    let (found, truth) = (felt / all, 1000.0 * std::f64::consts::PI * 0.01 * 0.1 / 0.08 * 0.06);
    println!("{found:.3} kg for {truth:.3}, {} particles", simulation.particles().len());
    // particles keep half a spacing, a twelfth of the rod's radius, from it; a fifth more or less of that is 3 %
    assert!((found / truth - 1.0).abs() < 0.1, "{found} for {truth}");
}

/// In a full vessel differences of pressure are those of the whole weight, and the vessel bears all of it.
#[test]
#[ignore = "long"]
fn a_full_vessel_weighs_what_its_shape_weighs() {
    let text = "rfm 1
solid pot = cylinder(0.3, 2).move([0, 0, -1])
scene full {
  box { min: [-0.35, -0.35, 0], max: [0.35, 0.35, 0.6] }
  container { solid: pot }
  fluid water { shape: x^2 + y^2 <= 0.3^2, density: 1000, particles: 2500 }
  gravity: [4, 0, -9.81]
  method: dfsph
  probe f { force: pot }
  run { until: 1 s }
}";
    let program = Program::from_source("full.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let experiment = Experiment::new(&program, "full", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    let mut gauges: Vec<_> = [
        Probe::Force { obstacle: 0, about: DVec3::ZERO },
        Probe::Pressure { at: DVec3::new(0.0, 0.0, 0.1) },
        Probe::Pressure { at: DVec3::new(0.0, 0.0, 0.4) },
    ]
    .map(|probe| simulation.gauge(probe).unwrap())
    .into();
    let mut sums = [0.0; 3];
    while simulation.time() < 1.0 {
        let before = simulation.time();
        simulation.step().unwrap_or_else(|e| panic!("{e}"));
        if before > 0.5 {
            let dt = simulation.time() - before;
            for (sum, gauge) in sums.iter_mut().zip(&mut gauges) {
                *sum += dt * simulation.sample(gauge)[0];
            }
        }
    }
    let [force, low, high] = sums.map(|sum| sum / 0.5);
    let weight = 4.0 * 1000.0 * std::f64::consts::PI * 0.09 * 0.6;
    println!("{force:.1} N for {weight:.1} N, {:.0} Pa for {:.0} Pa", low - high, 0.3 * 9810.0);
    // a mean over half a second of a fluid that has not quite come to rest
    assert!((force / weight - 1.0).abs() < 0.01, "{force} for {weight}");
    // 2 % are missing: the sums of packed particles are a little smaller than their packing says
    assert!(((low - high) / (0.3 * 9810.0) - 1.0).abs() < 0.03, "{low} {high}");
}

/// The particles of a full vessel are packed at the start, and a run that goes on from a checkpoint has to know all that
/// follows from that. (What kernels miss before a surface was that of a lattice in the one, and of the packing in the
/// other.)
#[test]
fn a_full_vessel_goes_on_with_the_same_bits() {
    let text = "rfm 1
solid vessel = sphere(0.5)
scene full {
  box { min: [-0.6, -0.6, -0.6], max: [0.6, 0.6, 0.6] }
  container { solid: vessel }
  fluid water { shape: sphere(0.5), density: 1000, particles: 300, velocity: [-y, x, 0] }
  method: dfsph
  run { until: 1 s }
}";
    let program = Program::from_source("full.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let experiment = Experiment::new(&program, "full", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let mut straight = experiment.start().unwrap_or_else(|e| panic!("{e}")).simulation;
    straight.step().unwrap_or_else(|e| panic!("{e}"));
    let mut resumed = experiment.resume(&straight.checkpoint()).unwrap_or_else(|e| panic!("{e}"));
    for _ in 0..5 {
        straight.step().unwrap_or_else(|e| panic!("{e}"));
        resumed.step().unwrap_or_else(|e| panic!("{e}"));
    }
    assert!(straight.checkpoint() == resumed.checkpoint());
}

/// Warnings about walls that no particle reaches: of a cylinder on a floor, less with a smaller spacing; none
/// where the floor is 45 degrees away, where the shape is only the room for a number of particles of a stated
/// size, or where a lattice does not fit a plate.
#[test]
#[ignore = "long"]
fn walls_without_particles_are_told_of() {
    let said = |solid: &str, fluid: &str| {
        let text = format!(
            "rfm 1
solid body = {solid}
scene rest {{
  box {{ max: [1, 0.02, 0.8] }}
  obstacle {{ solid: body }}
  fluid water {{ shape: box([0, 0, 0], [1, 0.02, 0.4]) \\ body, density: 1000, {fluid} }}
  run {{ until: 1 s }}
}}"
        );
        let program = Program::from_source("rest.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        let experiment = Experiment::new(&program, "rest", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
        let start = experiment.start().unwrap_or_else(|e| panic!("{e}"));
        let mut dry = start.warnings.list.into_iter().filter(|warning| warning.code.0 == "W0518");
        dry.next().map(|warning| {
            let (before, _) = warning.message.split_once(" % of the load").unwrap();
            before.rsplit(' ').next().unwrap().parse::<f64>().unwrap()
        })
    };
    let roll = "cylinder(0.4, 4).rotate_x(90 deg).move([1, 2, 0.4])";
    // particles reach to √(2Rs) = 0.13 and 0.06 m before the line where walls touch, and two spacings farther
    // none is near: 0.09 and 0.05 m of the 0.63 m along the cylinder, where the load is greatest
    let (coarse, fine) = (said(roll, "spacing: 0.02").unwrap(), said(roll, "spacing: 0.005").unwrap());
    assert!((8.0..20.0).contains(&coarse) && (5.0..14.0).contains(&fine) && fine < coarse, "{coarse} {fine}");
    assert_eq!(said("half_space([-1, 0, 1], [0.5, 0, 0])", "spacing: 0.02"), None);
    assert_eq!(said("box([0.613, -1, -1], [0.8, 1, 1])", "spacing: 0.02"), None);
    assert_eq!(said(roll, "spacing: 0.02, particles: 500, fill: middle"), None);
}

/// A ball of four spacings that lies on a floor, in a shape without ends: below it particles find room up to √(2Rs) from
/// where it touches, and the water there would lift it with half of its weight in water.
#[test]
fn a_ball_on_a_floor_lacks_the_load_below_it() {
    let text = "rfm 1
solid body = sphere(0.1, [0.25, 0.25, 0.1])
scene rest {
  box { max: [0.5, 0.5, 0.5] }
  obstacle { solid: body }
  fluid water { shape: z <= 0.3, density: 1000, spacing: 0.025 }
  run { until: 1 s }
}";
    let program = Program::from_source("rest.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let experiment = Experiment::new(&program, "rest", Engine::Auto).unwrap_or_else(|e| panic!("{e}"));
    let start = experiment.start().unwrap_or_else(|e| panic!("{e}"));
    let dry = start.warnings.list.into_iter().find(|warning| warning.code.0 == "W0518").expect("a warning");
    let (_, after) = dry.message.split_once("a force of ").expect(&dry.message);
    let newtons: f64 = after.split(' ').next().unwrap().parse().expect(after);
    println!("{}", dry.message);
    // between the disc of one spacing in radius, beside which a particle of two thirds of a spacing has no room, and that
    // of two spacings
    let pressed = |radius: f64| 2943.0 * std::f64::consts::PI * radius.powi(2);
    assert!(newtons > pressed(0.025) && newtons < pressed(2.0 * 0.025), "{newtons} N");
}
