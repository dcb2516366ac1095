//! All methods against physics: falls, bounces, slides, drops.

use std::sync::Arc;

use glam::DVec3;

use crate::{
    field::{Closures, Walls},
    geom::Aabb,
};

use super::{
    Cause, Dfsph, Method, NegativePressure, Obstacle, Paper, Parameters, Particles, Pass, Quantity,
    SetupError, Simulation, StepError, Wcsph, scenes,
};

const G: f64 = 9.81;

fn one(position: DVec3, velocity: DVec3) -> Particles {
    let mut fluid = Particles::default();
    fluid.push(position, velocity);
    fluid
}

/// A particle that feels gravity and nothing else.
fn lone(time_step: f64, wall_restitution: f64) -> Parameters {
    Parameters {
        method: Paper { stiffness: 0.0, ..Paper::default() }.into(),
        viscosity: 0.0,
        surface_tension: 0.0,
        time_step,
        wall_restitution,
        ..Parameters::paper()
    }
}

#[test]
fn free_fall_is_exact() {
    let mut simulation = scenes::free(lone(0.001, 0.5), &[(DVec3::ZERO, DVec3::X)]);
    for _ in 0..1000 {
        simulation.step().unwrap();
    }
    let (x, v) = (simulation.particles().position.get(0), simulation.particles().velocity.get(0));
    assert!((x - DVec3::new(1.0, 0.0, -0.5 * G)).length() < 1e-12, "{x}");
    assert!((v - DVec3::new(1.0, 0.0, -G)).length() < 1e-12, "{v}");
}

#[test]
fn free_fall_without_compression_is_exact() {
    let parameters = Parameters {
        viscosity: 0.0,
        surface_tension: 0.0,
        time_step: 0.004,
        method: Dfsph::default().into(),
        ..Parameters::paper()
    };
    let mut simulation = scenes::free(parameters, &[(DVec3::ZERO, DVec3::X)]);
    for step in 0..250 {
        // a frame may cut any step
        simulation.step_at_most(if step % 3 == 0 { 0.001 } else { 0.004 }).unwrap();
    }
    let time = simulation.time();
    let (x, v) = (simulation.particles().position.get(0), simulation.particles().velocity.get(0));
    assert!((x - DVec3::new(time, 0.0, -0.5 * G * time * time)).length() < 1e-12, "{x}");
    assert!((v - DVec3::new(1.0, 0.0, -G * time)).length() < 1e-12, "{v}");
}

/// The skin of a drop is held by its tension and by the pressure that this causes. It falls with the drop nevertheless.
#[test]
fn a_drop_under_tension_falls_as_freely() {
    let parameters = Parameters {
        surface_tension: 0.5,
        time_step: 0.002,
        method: Dfsph::default().into(),
        ..Parameters::paper()
    };
    let mut simulation = scenes::free_drop(parameters, 500);
    let start = simulation.particles().position.mean();
    for _ in 0..100 {
        simulation.step().unwrap();
    }
    let time = simulation.time();
    let fallen = simulation.particles().position.mean() - start;
    // what falls with the velocity at the end of each step goes so much too far
    let by_steps = 0.5 * G * 0.002 * time;
    let off = fallen.z + 0.5 * G * time * time;
    assert!(off.abs() < 0.01 * by_steps, "{off} m of {by_steps}");
}

#[test]
fn momentum_is_conserved_in_free_space() {
    let parameters = Parameters { gravity: DVec3::ZERO, surface_tension: 0.0, ..Parameters::paper() };
    let mut simulation = scenes::free_cloud(parameters, 400, 0.15);
    let before = simulation.stats().momentum;
    for _ in 0..100 {
        simulation.step().unwrap();
    }
    let scale = 400.0 * 0.02; // particles of about 1 m/s
    assert!((simulation.stats().momentum - before).length() < 1e-14 * scale);
}

/// Heights of the first maxima of a bouncing ball.
fn tops(parameters: Parameters, obstacles: Vec<Obstacle>, floor: f64, count: usize) -> Vec<f64> {
    let start = one(DVec3::new(1.5, 1.5, floor + 1.0), DVec3::ZERO);
    let mut simulation = Simulation::new(parameters, start, scenes::BOX, obstacles).unwrap();
    let (mut tops, mut before) = (Vec::new(), 0.0);
    while tops.len() < count {
        simulation.step().unwrap();
        let v = simulation.particles().velocity.z[0];
        if before > 0.0 && v <= 0.0 {
            tops.push(simulation.particles().position.z[0] - floor);
        }
        before = v;
    }
    tops
}

#[test]
fn a_bounce_returns_the_square_of_the_restitution() {
    let block = scenes::half_space(DVec3::Z, DVec3::Z);
    let e: f64 = 0.8;
    let body = Obstacle { restitution: e, ..scenes::obstacle(&block) };
    let on_floor = tops(lone(1e-4, e), Vec::new(), 0.0, 3);
    let on_body = tops(lone(1e-4, 0.0), vec![body], 1.0, 3);
    for tops in [on_floor, on_body] {
        for (bounce, top) in tops.iter().enumerate() {
            let expected = e.powi(2 * (bounce as i32 + 1));
            // stopping on the surface costs at most g·v·dt per bounce, and never adds
            assert!(*top <= expected && *top > 0.99 * expected, "{top} {expected}");
        }
    }
}

#[test]
fn a_particle_slides_down_a_slope() {
    let angle: f64 = 0.5;
    let normal = DVec3::new(angle.sin(), 0.0, angle.cos());
    let slope = scenes::half_space(DVec3::new(0.5, 0.0, 2.0), normal);
    for restitution in [0.0, 0.5] {
        let start = one(DVec3::new(0.5, 1.5, 2.0) + 1e-6 * normal, DVec3::ZERO);
        let body = Obstacle { restitution, ..scenes::obstacle(&slope) };
        let mut simulation = Simulation::new(lone(0.001, 0.5), start, scenes::BOX, vec![body]).unwrap();
        for _ in 0..500 {
            simulation.step().unwrap();
        }
        let along = DVec3::new(angle.cos(), 0.0, -angle.sin());
        let way = (simulation.particles().position.get(0) - DVec3::new(0.5, 1.5, 2.0)).dot(along);
        let expected = 0.5 * G * angle.sin() * 0.25;
        assert!((way / expected - 1.0).abs() < 0.005, "{way} {expected}");
    }
}

#[test]
fn a_particle_swings_through_a_bowl() {
    // in the hollow of a sphere, started at the height of its centre: the particle must come up on the other
    // side
    let bowl: Arc<dyn Walls> = Arc::new(Closures {
        omega: |p: DVec3| p.distance_squared(DVec3::splat(1.5)) - 1.0,
        gradient: |p: DVec3| 2.0 * (p - DVec3::splat(1.5)),
    });
    let body = Obstacle { restitution: 0.0, ..scenes::obstacle(&bowl) };
    let start = one(DVec3::new(2.4999, 1.5, 1.5), DVec3::ZERO);
    let mut simulation = Simulation::new(lone(0.001, 0.0), start, scenes::BOX, vec![body]).unwrap();
    let mut farthest: f64 = 3.0;
    for _ in 0..1500 {
        simulation.step().unwrap();
        let x = simulation.particles().position.get(0);
        assert!(bowl.omega(x) < 0.0);
        farthest = farthest.min(x.x);
    }
    assert!(farthest < 0.6, "{farthest}");
}

#[test]
fn a_fast_particle_does_not_pass_a_thin_plate() {
    let plate: Arc<dyn Walls> = Arc::new(Closures {
        omega: |p: DVec3| 0.005 - (p.x - 1.5).abs(),
        gradient: |p: DVec3| DVec3::new(-(p.x - 1.5).signum(), 0.0, 0.0),
    });
    for speed in [10.0, 100.0, 1000.0] {
        let start = one(DVec3::new(1.3, 1.5, 1.5), DVec3::X * speed);
        let mut simulation =
            Simulation::new(lone(0.002, 0.5), start, scenes::BOX, vec![scenes::obstacle(&plate)]).unwrap();
        for _ in 0..20 {
            simulation.step().unwrap();
            let x = simulation.particles().position.x[0];
            assert!(x < 1.495 + 1e-12, "{x}");
        }
        assert!(simulation.particles().velocity.x[0].abs() <= 0.5 * speed);
    }
}

#[test]
fn a_wedge_between_wall_and_obstacle_holds_particles() {
    // a slope that meets the floor at 20 degrees, overhanging the particle
    let normal = DVec3::new(-0.342, 0.0, -0.940).normalize();
    let roof = scenes::half_space(DVec3::new(2.0, 0.0, 0.0), normal);
    let start = one(DVec3::new(1.0, 1.5, 0.1), DVec3::X * 20.0);
    let mut simulation =
        Simulation::new(lone(0.002, 0.5), start, scenes::BOX, vec![scenes::obstacle(&roof)]).unwrap();
    for _ in 0..500 {
        simulation.step().unwrap();
        let stats = simulation.stats();
        assert_eq!((stats.inside, stats.lost, stats.non_finite), (0, 0, 0));
    }
}

#[test]
fn nothing_creeps_under_an_obstacle_that_stands_on_the_floor() {
    let pawn = scenes::pawn();
    let start = one(DVec3::new(0.7, 1.5, 0.0), DVec3::X);
    let mut simulation =
        Simulation::new(lone(0.002, 0.0), start, scenes::BOX, vec![scenes::obstacle(&pawn)]).unwrap();
    for _ in 0..1000 {
        simulation.step().unwrap();
        let x = simulation.particles().position.get(0);
        assert!((x.x - 1.5).hypot(x.y - 1.5) > 0.4999, "{x}");
    }
}

#[test]
fn a_drop_on_the_pawn_stays_sound_and_gains_no_energy() {
    let pawn = scenes::pawn();
    let mut simulation = scenes::drop_on(&pawn, Parameters::paper(), 2000);
    let energy = |s: &super::Stats| s.kinetic_energy + s.potential_energy;
    let start = energy(&simulation.stats());
    let mut highest: f64 = 0.0;
    for step in 1..=500 {
        simulation.step().unwrap();
        if step % 10 == 0 {
            let stats = simulation.stats();
            assert_eq!((stats.inside, stats.lost, stats.non_finite), (0, 0, 0), "step {step}");
            assert_eq!(stats.max_penetration, 0.0);
            highest = highest.max(energy(&stats));
        }
    }
    assert!(highest < 1.001 * start, "{highest} {start}");
    assert!(energy(&simulation.stats()) < 0.8 * start);
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let pawn = scenes::pawn();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut simulation = scenes::drop_on(&pawn, Parameters::paper(), 1000);
            for _ in 0..200 {
                simulation.step().unwrap();
            }
            simulation.particles().clone()
        })
    };
    assert!(run(1) == run(2));
}

#[test]
fn an_undefined_field_is_an_error() {
    let hole: Arc<dyn Walls> = Arc::new(Closures {
        omega: |p: DVec3| if p.z < 1.0 { f64::NAN } else { -1.0 },
        gradient: |_: DVec3| DVec3::Z,
    });
    let start = one(DVec3::new(1.5, 1.5, 1.2), DVec3::ZERO);
    let mut simulation =
        Simulation::new(lone(0.01, 0.5), start, scenes::BOX, vec![scenes::obstacle(&hole)]).unwrap();
    let error = (0..100).find_map(|_| simulation.step().err()).unwrap();
    let StepError::NonFinite { id, quantity, cause, .. } = error else { panic!("{error}") };
    assert_eq!((id, quantity), (0, Quantity::Omega));
    assert!(matches!(cause, Cause::FieldUndefined { at } if at.z < 1.0));
    assert!(error.to_string().contains("no value at"), "{error}");
}

#[test]
fn a_run_that_would_never_end_is_an_error() {
    let fall = Parameters {
        method: Method::Dfsph(Dfsph::default()),
        adaptive: true,
        time_step: 0.1,
        ..Parameters::paper()
    };
    let mut simulation =
        Simulation::new(fall, one(DVec3::ONE, DVec3::ZERO), scenes::BOX, Vec::new()).unwrap();
    simulation.step().unwrap();
    simulation.set_gravity(DVec3::new(0.0, 0.0, 1e14));
    let error = (0..3).find_map(|_| simulation.step().err()).unwrap();
    assert!(matches!(error, StepError::Stalled { id: 0, dt, .. } if dt < 1e-7), "{error}");
    assert!(error.to_string().contains("particle 0 is the fastest"), "{error}");
}

#[test]
fn wcsph_pairs_conserve_momentum_in_free_space() {
    let wcsph = Wcsph { sound_speed: Some(10.0), artificial_viscosity: Some(0.1), ..Wcsph::default() };
    let parameters = Parameters {
        gravity: DVec3::ZERO,
        surface_tension: 0.0,
        method: Method::Wcsph(wcsph),
        time_step: 1e-4,
        ..Parameters::paper()
    };
    let mut simulation = scenes::free_cloud(parameters, 400, 0.15);
    let before = simulation.stats().momentum;
    for _ in 0..100 {
        simulation.step().unwrap();
    }
    let scale = 400.0 * 0.02; // particles of about 1 m/s
    assert!((simulation.stats().momentum - before).length() < 1e-13 * scale);
}

#[test]
fn a_diverging_run_names_the_step_as_the_cause() {
    let wild = Parameters {
        method: Paper { stiffness: 1e300, ..Paper::default() }.into(),
        time_step: 1e10,
        rest_density: 1.0,
        ..Parameters::paper()
    };
    let mut simulation = scenes::free_drop(wild, 50);
    let error = (0..100).find_map(|_| simulation.step().err()).unwrap();
    let StepError::NonFinite { cause, .. } = error else { panic!("{error}") };
    assert!(matches!(cause, Cause::StepTooLong { .. }), "{error}");
}

#[test]
fn setups_without_meaning_are_refused() {
    let pawn = scenes::pawn();
    let new = |particles: Particles, domain: Aabb| {
        Simulation::new(Parameters::paper(), particles, domain, vec![scenes::obstacle(&pawn)]).err()
    };
    let fluid = one(DVec3::splat(2.5), DVec3::ZERO);
    assert_eq!(new(Particles::default(), scenes::BOX), Some(SetupError::NoParticles));
    assert_eq!(new(fluid.clone(), Aabb::EMPTY), Some(SetupError::Domain(Aabb::EMPTY)));
    assert_eq!(new(one(DVec3::NAN, DVec3::ZERO), scenes::BOX), Some(SetupError::NonFinite { id: 0 }));
    let inside = one(DVec3::new(1.5, 1.5, 0.5), DVec3::ZERO);
    let error = SetupError::NotInFluid { outside_box: 0, inside_obstacles: 1 };
    assert_eq!(new(inside, scenes::BOX), Some(error));
    assert_eq!(new(fluid, scenes::BOX), None);
}

#[test]
fn passes_that_a_scene_does_not_need_do_not_run() {
    let plain = scenes::free(lone(0.001, 0.5), &[(DVec3::ZERO, DVec3::ZERO)]);
    use Pass::*;
    assert_eq!(plain.passes(), [Integrate, Walls, Neighbours, Density, Gravity]);
    let pawn = scenes::pawn();
    let full = scenes::drop_on(&pawn, Parameters::paper(), 10);
    assert_eq!(full.passes().len(), 9);
}

#[test]
fn kept_tension_makes_a_pair_coincide_and_clamping_does_not() {
    let nearest = |negative_pressure| {
        let parameters = Parameters {
            gravity: DVec3::ZERO,
            surface_tension: 0.0,
            method: Paper { negative_pressure, ..Paper::default() }.into(),
            ..Parameters::paper()
        };
        let mut simulation =
            scenes::free(parameters, &[(DVec3::ZERO, DVec3::ZERO), (DVec3::X * 0.05, DVec3::ZERO)]);
        let mut nearest: f64 = 1.0;
        for _ in 0..200 {
            simulation.step().unwrap();
            let position = &simulation.particles().position;
            nearest = nearest.min(position.get(0).distance(position.get(1)));
        }
        nearest
    };
    assert!((nearest(NegativePressure::Clamp) - 0.05).abs() < 1e-12);
    assert!(nearest(NegativePressure::Keep) < 0.02);
}

/// One particle without weight, of a fluid with this spacing, m.
fn weightless(method: Method, spacing: f64) -> Parameters {
    Parameters {
        rest_density: 1000.0,
        particle_mass: 1000.0 * spacing * spacing * spacing,
        support_radius: 2.6 * spacing,
        viscosity: 0.0,
        surface_tension: 0.0,
        gravity: DVec3::ZERO,
        wall_restitution: 0.0,
        adaptive: true,
        time_step: 0.1,
        expected_speed: 4.0,
        precision: crate::sph::Precision::F64,
        ..Parameters::of(method, spacing)
    }
}

/// The greatest energy of one particle between two walls within a second, over that at its start.
fn energy_between_walls(method: Method, speed: f64, obstacles: bool) -> f64 {
    let parameters = weightless(method, 0.04);
    let (walls, bodies) = if obstacles {
        let body = |x: f64, normal: DVec3| Obstacle {
            restitution: 0.0,
            ..Obstacle::at_rest(scenes::half_space(DVec3::new(x, 0.0, 0.0), normal), 0.005)
        };
        (1.0, vec![body(0.9, DVec3::X), body(1.1, -DVec3::X)])
    } else {
        (0.1, Vec::new())
    };
    let domain = Aabb::new(DVec3::new(1.0 - walls, 0.0, 0.0), DVec3::new(1.0 + walls, 2.0, 2.0));
    let start = one(DVec3::ONE, DVec3::new(speed, 0.1 * speed, 0.0));
    let mut simulation = Simulation::new(parameters, start, domain, bodies).unwrap();
    simulation.advance(1.0, |_| std::ops::ControlFlow::Continue(())).unwrap();
    simulation.audit().energy_excess().unwrap()
}

#[test]
fn walls_give_a_particle_no_energy() {
    let weakly = Wcsph { sound_speed: Some(40.0), ..Wcsph::default() };
    for method in [Method::from(weakly), Dfsph::default().into(), Paper::default().into()] {
        for speed in [1.0, 4.0, 7.0, 12.0, 40.0, 100.0] {
            for obstacles in [false, true] {
                let excess = energy_between_walls(method, speed, obstacles);
                assert!(excess < 1e-3, "{} {speed} m/s, obstacles: {obstacles}: {excess}", method.name());
            }
        }
    }
}

/// The rim of the pawn's collar is sharper than the kernel: closed forms for its faces have no common
/// potential, and one particle doubled its energy there within a second.
#[test]
fn sharp_rims_give_a_particle_no_energy() {
    let pawn = Obstacle { restitution: 0.0, ..scenes::obstacle(&scenes::pawn()) };
    let domain = Aabb::new(DVec3::new(0.75, 0.75, 0.0), DVec3::new(2.25, 2.25, 2.0));
    let weakly = Wcsph { sound_speed: Some(40.0), ..Wcsph::default() };
    for velocity in [DVec3::new(2.0, 0.3, -1.0), DVec3::new(1.0, 0.5, -0.3), DVec3::new(-1.5, 0.2, 2.0)] {
        let start = one(DVec3::new(0.9, 1.5, 1.15), velocity);
        let parameters = weightless(weakly.into(), 0.1);
        let mut simulation = Simulation::new(parameters, start, domain, vec![pawn.clone()]).unwrap();
        simulation.advance(4.0, |_| std::ops::ControlFlow::Continue(())).unwrap();
        let excess = simulation.audit().energy_excess().unwrap();
        assert!(excess < 1e-3, "{velocity}: {excess}");
    }
}
