//! Probes against closed forms.

use glam::DVec3;

use super::*;
use std::sync::Arc;

use crate::field::Walls;
use crate::sph::Parameters;
use crate::sph::{
    Dfsph, Method, Obstacle, Paper, Particles, Simulation, Wcsph, scenes,
    walls::{Boundary, BroadPhase, Maps},
};

const G: f64 = 9.81;
const RHO: f64 = 1000.0;
const SPACING: f64 = 0.05;
/// Width of the box, and height of the water in it: whole numbers of spacings.
const WIDTH: f64 = 0.5;
const DEPTH: f64 = 0.4;

fn water(method: Method) -> Parameters {
    Parameters {
        rest_density: RHO,
        particle_mass: RHO * SPACING.powi(3),
        support_radius: 2.6 * SPACING,
        viscosity: 0.0,
        surface_tension: 0.0,
        time_step: 1.0,
        adaptive: true,
        precision: crate::sph::Precision::F64,
        ..Parameters::of(method, SPACING)
    }
}

fn weakly() -> Method {
    Method::Wcsph(Wcsph { sound_speed: Some(30.0), artificial_viscosity: Some(0.0), ..Wcsph::default() })
}

/// Particles at the middles of the cells of a lattice that fills a box.
fn lattice(from: DVec3, to: DVec3) -> Particles {
    let counts = ((to - from) / SPACING).round();
    let mut particles = Particles::default();
    for k in 0..counts.z as usize {
        for j in 0..counts.y as usize {
            for i in 0..counts.x as usize {
                let cell = DVec3::new(i as f64, j as f64, k as f64) + 0.5;
                particles.push(from + SPACING * cell, DVec3::ZERO);
            }
        }
    }
    particles
}

fn bowl() -> Aabb {
    Aabb::new(DVec3::ZERO, DVec3::new(WIDTH, WIDTH, 1.0))
}

/// A simulation whose state is given, not computed.
fn state(method: Method, particles: Particles, domain: Aabb) -> Core {
    state_around(method, particles, domain, Vec::new())
}

fn state_around(method: Method, particles: Particles, domain: Aabb, obstacles: Vec<Obstacle>) -> Core {
    let broad_phase = BroadPhase::unknown(obstacles.len());
    let boundary = Boundary {
        domain,
        wall_restitution: 0.5,
        wall_friction: 0.0,
        obstacles,
        during: Vec::new(),
        slip: crate::sph::Slip::Free,
        time: 0.0,
        step: 0.0,
        clearance: 1e-6,
        maps: Maps::default(),
        broad_phase,
    };
    let mut core = Core::new(water(method), boundary, particles);
    // not the first step: dfsph would move the particles of a start apart
    core.steps = 1;
    crate::sph::methods::start(&mut core, true);
    core.particles.density.fill(RHO);
    core
}

#[test]
fn a_linear_pressure_is_met_exactly_at_walls_too() {
    let mut core = state(weakly(), lattice(DVec3::ZERO, DVec3::new(WIDTH, WIDTH, DEPTH)), bowl());
    let heights = core.particles.position.z.clone();
    core.particles.pressure = heights.iter().map(|z| RHO * G * (DEPTH - z)).collect();
    let middle = 0.5 * WIDTH;
    for (x, y) in [(middle, middle), (0.0, middle), (0.0, 0.0), (0.13, WIDTH)] {
        for z in [0.0, 0.03, 0.2, 0.33] {
            let found = Neighbourhood::around(&core, DVec3::new(x, y, z)).pressure();
            let exact = RHO * G * (DEPTH - z);
            // LEAST_SPREAD against the variance of the places: some 1e-3 of the pressure over a support
            // radius
            assert!(
                (found - exact).abs() < 2e-3 * RHO * G * core.parameters.support_radius,
                "{x} {y} {z}: {found} {exact}"
            );
        }
    }
    assert_eq!(Neighbourhood::around(&core, DVec3::new(middle, middle, 0.9)).pressure(), 0.0);
}

#[test]
fn a_shear_is_met_exactly_and_air_has_no_velocity() {
    let mut core = state(weakly(), lattice(DVec3::ZERO, DVec3::new(WIDTH, WIDTH, DEPTH)), bowl());
    for i in 0..core.particles.len() {
        let p = core.particles.position.get(i);
        core.particles.velocity.set(i, DVec3::new(3.0 * p.z, 1.0 - p.x, 2.0));
    }
    for p in [DVec3::new(0.2, 0.3, 0.15), DVec3::new(0.0, 0.1, 0.0)] {
        let exact = DVec3::new(3.0 * p.z, 1.0 - p.x, 2.0);
        let found = Neighbourhood::around(&core, p).velocity();
        assert!((found - exact).length() < 1e-3, "{found} {exact}");
    }
    assert!(Neighbourhood::around(&core, DVec3::new(0.2, 0.2, 0.9)).velocity().is_nan());
}

#[test]
fn the_height_of_a_column_is_found_in_its_middle_and_at_walls_and_spray_is_not() {
    // the box is wider than the water
    let domain = Aabb::new(DVec3::ZERO, DVec3::new(3.0 * WIDTH, WIDTH, 1.0));
    let mut particles = lattice(DVec3::ZERO, DVec3::new(WIDTH, WIDTH, DEPTH));
    particles.push(DVec3::new(0.25, 0.25, 0.8), DVec3::ZERO);
    for method in [weakly(), Method::Dfsph(Dfsph::default())] {
        let core = state(method, particles.clone(), domain);
        for (x, y) in [(0.25, 0.25), (0.0, 0.25), (0.0, 0.0), (0.25, WIDTH)] {
            let found = height(&core, x, y);
            assert!((found - DEPTH).abs() < 0.1 * SPACING, "{x} {y}: {found}");
        }
        assert_eq!(height(&core, 2.0 * WIDTH, 0.25), 0.0);
    }
}

#[test]
fn a_dry_place_has_the_height_of_its_ground() {
    let slab = Obstacle::at_rest(floor(0.31), 1.0);
    let core = state_around(weakly(), Particles::default(), bowl(), vec![slab]);
    assert!((height(&core, 0.5, 0.25) - 0.31).abs() < 1e-9);
    let full = Obstacle::at_rest(floor(100.0), 1.0);
    let core = state_around(weakly(), Particles::default(), bowl(), vec![full]);
    assert!(height(&core, 0.5, 0.25).is_nan());
    let core = state(weakly(), Particles::default(), bowl());
    assert_eq!(height(&core, 0.5, 0.25), bowl().min.z);
}

#[test]
fn a_falling_block_carries_its_mass_through_a_plane() {
    let (from, to) = (DVec3::new(0.1, 0.1, 0.3), DVec3::new(0.4, 0.3, 0.8));
    for method in [Method::from(Paper::default()), weakly()] {
        let mut core = state(method, lattice(from, to), bowl());
        core.particles.velocity.z.fill(-2.0);
        let area = (to.x - from.x) * (to.y - from.y);
        for z in [0.5, 0.512, 0.55, 0.63] {
            let found = flux(&core, DVec3::new(0.0, 0.0, z), -DVec3::Z);
            // the sum over the lattice's layers stands for an integral
            assert!((found / (RHO * area * 2.0) - 1.0).abs() < 3e-3, "{z}: {found}");
            assert_eq!(flux(&core, DVec3::new(0.0, 0.0, z), DVec3::Z), -found);
        }
        assert_eq!(flux(&core, DVec3::new(0.0, 0.0, 0.1), DVec3::Z), 0.0);
        assert!(flux(&core, DVec3::new(0.25, 0.2, 0.5), DVec3::X).abs() < 1e-12);
    }
}

#[test]
fn energies_of_a_fall() {
    let domain = Aabb::new(DVec3::splat(-10.0), DVec3::splat(10.0));
    let block = lattice(DVec3::ZERO, DVec3::splat(0.2));
    let mass = RHO * 0.008;
    // diffusion would treat an even density as that of a fluid not at rest
    let method = Method::Wcsph(Wcsph {
        sound_speed: Some(30.0),
        density_diffusion: Some(0.0),
        artificial_viscosity: Some(0.0),
        ..Wcsph::default()
    });
    let parameters = Parameters { precision: crate::sph::Precision::F64, ..water(method) };
    let mut simulation = Simulation::new(parameters, block, domain, Vec::new()).unwrap();
    let mut gauge = simulation.gauge(Probe::Energy).unwrap();
    let [_, potential, elastic, total] = simulation.sample(&mut gauge)[..] else { panic!() };
    assert!((potential / (mass * G * 10.1) - 1.0).abs() < 1e-12, "{potential}");
    assert_eq!(elastic, 0.0);
    while simulation.time() < 0.3 {
        simulation.step_at_most(0.3 - simulation.time()).unwrap();
    }
    let [kinetic, _, elastic, later] = simulation.sample(&mut gauge)[..] else { panic!() };
    let speed = G * simulation.time();
    assert!((kinetic / (0.5 * mass * speed * speed) - 1.0).abs() < 1e-9, "{kinetic}");
    assert!((later / total - 1.0).abs() < 1e-9 && elastic.abs() < 1e-9 * total, "{later} {total} {elastic}");
}

#[test]
fn elastic_energy_is_the_integral_of_pressure() {
    for method in [Method::from(Paper::default()), weakly()] {
        let mut core = state(method, lattice(DVec3::ZERO, DVec3::splat(SPACING)), bowl());
        let most = 1.05 * RHO;
        core.particles.density = vec![most];
        let pressure = |rho: f64| match method {
            Method::Paper(_) => 3.0 * (rho - RHO),
            _ => 900.0 * RHO / 7.0 * ((rho / RHO).powi(7) - 1.0),
        };
        // the weakly compressible fluid is accelerated by pressure over ρ₀, the paper's by pressure over ρ
        let over = |rho: f64| if matches!(method, Method::Paper(_)) { rho * rho } else { RHO * RHO };
        // midpoint rule
        let n = 10_000;
        let step = (most - RHO) / n as f64;
        let integral: f64 =
            (0..n).map(|k| RHO + (k as f64 + 0.5) * step).map(|rho| pressure(rho) / over(rho) * step).sum();
        let exact = core.parameters.particle_mass * integral;
        assert!((elastic_energy(&core) / exact - 1.0).abs() < 1e-6, "{} {exact}", elastic_energy(&core));
        core.particles.density = vec![0.9 * RHO];
        assert_eq!(elastic_energy(&core), 0.0, "nothing pulls");
    }
}

fn floor(z: f64) -> Arc<dyn Walls> {
    scenes::half_space(DVec3::Z * z, DVec3::Z)
}

#[test]
fn a_block_carries_the_water_on_it() {
    let block = floor(0.2);
    let particles = lattice(DVec3::Z * 0.2, DVec3::new(WIDTH, WIDTH, 0.2 + DEPTH));
    let weight = particles.len() as f64 * RHO * SPACING.powi(3) * G;
    for method in [weakly(), Method::Dfsph(Dfsph::default())] {
        let mut core = state_around(method, particles.clone(), bowl(), vec![scenes::obstacle(&block)]);
        let heights = core.particles.position.z.clone();
        core.particles.pressure = heights.iter().map(|z| RHO * G * (0.2 + DEPTH - z)).collect();
        core.acceleration.components_mut().into_iter().for_each(|column| column.fill(0.0));
        let [x, y, z, torque_x, torque_y, torque_z] =
            force::on_surface(&core, 0, DVec3::new(WIDTH, 0.0, 0.0), true, &mut KeptPieces::default());
        // the sum over the lattice's layers stands for an integral; `dfsph` has moved the first of them away from
        // the wall, by a hundredth of the spacing
        assert!((z / weight + 1.0).abs() < 0.015, "{z} {weight}");
        assert!(x == 0.0 && y == 0.0 && torque_z.abs() < 1e-9 * weight, "{x} {y} {torque_z}");
        // the weight acts at the middle, half the width away from the corner along x and y
        let arm = 0.5 * WIDTH * weight;
        assert!((torque_x / arm + 1.0).abs() < 0.015 && (torque_y / arm + 1.0).abs() < 0.015, "{torque_x}");
    }
}

#[test]
fn a_shear_drags_a_block_that_it_sticks_to() {
    let block = floor(0.2);
    let particles = lattice(DVec3::Z * 0.2, DVec3::new(WIDTH, WIDTH, 0.2 + DEPTH));
    let mut core = state_around(weakly(), particles, bowl(), vec![scenes::obstacle(&block)]);
    let (rate, viscosity) = (3.0, 2.0);
    core.parameters.viscosity = viscosity;
    core.particles.pressure.fill(0.0);
    core.acceleration.components_mut().into_iter().for_each(|column| column.fill(0.0));
    core.acceleration.z.fill(-G); // in free fall no pressure is missing
    for i in 0..core.particles.len() {
        core.particles.velocity.x[i] = rate * (core.particles.position.z[i] - 0.2);
    }
    assert_eq!(
        force::on_surface(&core, 0, DVec3::ZERO, true, &mut KeptPieces::default())[0],
        0.0,
        "it slips"
    );
    core.boundary.obstacles[0].slip = crate::sph::Slip::No;
    let [x, y, z, ..] = force::on_surface(&core, 0, DVec3::ZERO, true, &mut KeptPieces::default());
    let exact = viscosity * rate * WIDTH * WIDTH;
    assert!((x / exact - 1.0).abs() < 0.01 && y == 0.0 && z.abs() < 1e-9, "{x} {exact} {y} {z}");
}

/// A particle without neighbours above a block.
fn lone(height: f64, restitution: f64, block: &Arc<dyn Walls>) -> Simulation {
    let parameters = Parameters {
        method: Paper { stiffness: 0.0, ..Paper::default() }.into(),
        viscosity: 0.0,
        surface_tension: 0.0,
        time_step: 1e-4,
        ..Parameters::paper()
    };
    let mut particles = Particles::default();
    particles.push(DVec3::new(1.0, 2.0, 1.0 + height), DVec3::ZERO);
    let body = Obstacle { restitution, ..scenes::obstacle(block) };
    Simulation::new(parameters, particles, scenes::BOX, vec![body]).unwrap()
}

#[test]
fn a_bounce_gives_its_impulse_once() {
    let block = floor(1.0);
    let (height, e) = (0.5, 0.8);
    let mut simulation = lone(height, e, &block);
    let about = DVec3::X * 1.0;
    let mut gauge = simulation.gauge(Probe::Force { obstacle: 0, about }).unwrap();
    assert_eq!(simulation.sample(&mut gauge), [0.0; 6]);
    let end = (2.0 * height / G).sqrt() + 0.1;
    while simulation.time() < end {
        simulation.step().unwrap();
    }
    let [_, _, force, torque, ..] = simulation.sample(&mut gauge)[..] else { panic!() };
    let impulse = 0.02 * (1.0 + e) * (2.0 * G * height).sqrt();
    // the contact uses the speed at the end of the step: g·dt more at most
    assert!((-force * simulation.time() / impulse - 1.0).abs() < 1e-3, "{force}");
    // (0, 2, 1) × (0, 0, F) = (2F, 0, 0)
    assert!((torque / (2.0 * force) - 1.0).abs() < 1e-12, "{torque} {force}");
    simulation.step().unwrap();
    assert_eq!(simulation.sample(&mut gauge)[2], 0.0, "counted once");
}

#[test]
fn a_particle_at_rest_weighs_what_it_weighs() {
    let block = floor(1.0);
    let mut simulation = lone(1e-6, 0.0, &block);
    let probe = Probe::Force { obstacle: 0, about: DVec3::ZERO };
    let mut gauge = simulation.gauge(probe).unwrap();
    for _ in 0..100 {
        simulation.step().unwrap();
    }
    simulation.sample(&mut gauge);
    // a checkpoint in between changes nothing
    let checkpoint = simulation.checkpoint();
    let block_too = floor(1.0);
    let body = Obstacle { restitution: 0.0, ..scenes::obstacle(&block_too) };
    let parameters = simulation.parameters().clone();
    let mut resumed = Simulation::resume(parameters, &checkpoint, scenes::BOX, vec![body]).unwrap();
    let mut taken_up = resumed.gauge_at(probe, &checkpoint, gauge.memory()).unwrap();
    for _ in 0..1000 {
        simulation.step().unwrap();
        resumed.step().unwrap();
    }
    let force = simulation.sample(&mut gauge);
    assert!((force[2] / (-0.02 * G) - 1.0).abs() < 1e-3, "{force:?}");
    assert_eq!(resumed.sample(&mut taken_up), force);
    assert!(simulation.gauge(Probe::Force { obstacle: 1, about: DVec3::ZERO }).is_err());
}
