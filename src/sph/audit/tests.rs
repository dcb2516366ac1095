//! The audit against runs whose energy, volume and speeds are known.

use std::sync::Arc;

use super::compression::CLASS;
use super::*;
use crate::geom::Aabb;
use crate::sph::{Dfsph, FluidBlock, Method, Obstacle, Paper, Simulation, Wcsph, scenes};

const TANK: Aabb = Aabb::new(DVec3::ZERO, DVec3::new(1.2, 0.2, 1.4));

fn parameters(method: Method, spacing: f64) -> Parameters {
    Parameters {
        rest_density: 1000.0,
        particle_mass: 1000.0 * spacing.powi(3),
        support_radius: if matches!(method, Method::Dfsph(_)) { 2.2 } else { 2.6 } * spacing,
        viscosity: 1e-3,
        surface_tension: 0.0,
        wall_restitution: 0.0,
        adaptive: true,
        time_step: 0.1,
        expected_speed: 4.0,
        precision: crate::sph::Precision::F64,
        ..Parameters::of(method, spacing)
    }
}

/// A column of water in a closed tank, that falls over.
fn column(method: Method, spacing: f64) -> Simulation {
    column_of(parameters(method, spacing), spacing)
}

fn column_of(parameters: Parameters, spacing: f64) -> Simulation {
    let mut fluid = crate::sph::Particles::default();
    let count = |length: f64| (length / spacing).round() as usize;
    for (i, j, k) in (0..count(0.4))
        .flat_map(|i| (0..count(0.2)).flat_map(move |j| (0..count(0.8)).map(move |k| (i, j, k))))
    {
        fluid.push(spacing * (DVec3::new(i as f64, j as f64, k as f64) + 0.5), DVec3::ZERO);
    }
    Simulation::new(parameters, fluid, TANK, Vec::new()).unwrap()
}

#[test]
fn classes_give_mean_and_percentile() {
    // a hundred and one densities from 0 to 10 % above rest, and as many below it
    let densities: Vec<f64> =
        (0..=100).map(|k| 1000.0 + f64::from(k)).chain((0..101).map(|_| 700.0)).collect();
    let (Compression { mean, p99, largest }, volume) = Compression::of(&densities, 1000.0);
    assert!((mean - 0.025).abs() < 1e-12, "{mean}");
    assert!((largest - 0.1).abs() < 1e-12);
    // 202 particles, so two lie above it: 0.099 and 0.1
    // the upper end of its class
    assert!((p99 - 0.098).abs() < 1.01 * CLASS, "{p99}");
    let exact: f64 = densities.iter().map(|rho| 1000.0 / rho.max(1000.0)).sum::<f64>() / 202.0;
    assert!((volume - exact).abs() < 1e-12);
}

#[test]
fn a_fluid_that_collapses_has_its_percentile_too() {
    // a thousand densities from 2 to 5 times that at rest, beyond the last class
    let densities: Vec<f64> = (0..1000).map(|k| 2000.0 + 3.0 * f64::from(k)).collect();
    let (Compression { mean, p99, largest }, _) = Compression::of(&densities, 1000.0);
    assert!((p99 - 3.967).abs() < 1e-9, "{p99}"); // ten lie above it
    assert!(mean < p99 && p99 < largest);
}

#[test]
fn a_splash_in_a_closed_tank_makes_no_energy() {
    for method in [Method::from(Wcsph::default()), Paper::default().into()] {
        let mut simulation = column(method, 0.05);
        simulation.advance(2.0, |_| std::ops::ControlFlow::Continue(())).unwrap();
        let audit = simulation.audit();
        let excess = audit.energy_excess().unwrap();
        assert!(excess < 1e-4, "{}: {excess}", method.name());
        // Torricelli's speed of the whole height, twice over
        assert!(audit.max_speed() < 2.0 * (2.0 * 9.81 * 0.8f64).sqrt(), "{}", audit.max_speed());
    }
}

#[test]
fn water_in_the_tank_keeps_its_volume() {
    let mut simulation = column(Wcsph::default().into(), 0.05);
    simulation.advance(2.0, |_| std::ops::ControlFlow::Continue(())).unwrap();
    let change = simulation.audit().volume_change();
    assert!(change.abs() < 0.01, "{change}");
    assert_eq!(simulation.findings(), []);
}

#[test]
fn a_fluid_as_fast_as_a_gas_is_told_of() {
    // nobody expected a fall of 0.8 m
    let slow = Parameters { expected_speed: 0.4, ..parameters(Wcsph::default().into(), 0.1) };
    let mut simulation = column_of(slow, 0.1);
    simulation.advance(0.4, |_| std::ops::ControlFlow::Continue(())).unwrap();
    let found = simulation.findings();
    let told = found.iter().find(|(finding, _)| *finding == Finding::Speed).map(|(_, text)| text.as_str());
    assert!(told.is_some_and(|text| text.contains("a derived speed of sound of 4 m/s")), "{found:?}");
    // one that is stated too low is best left out, whatever the fluid has reached because of it
    let stated = Wcsph { sound_speed: Some(4.0), ..Wcsph::default() };
    let mut simulation = column(stated.into(), 0.1);
    simulation.advance(0.4, |_| std::ops::ControlFlow::Continue(())).unwrap();
    let found = simulation.findings();
    let told = found.iter().find(|(finding, _)| *finding == Finding::Speed).map(|(_, text)| text.as_str());
    assert!(told.is_some_and(|text| text.ends_with("; leave `sound_speed` out")), "{found:?}");
}

#[test]
fn what_flies_as_one_is_no_gas() {
    let parameters = Parameters { gravity: DVec3::ZERO, ..parameters(Wcsph::default().into(), 0.1) };
    let flying = |stirred: f64| {
        let mut simulation = crate::sph::scenes::free(
            parameters.clone(),
            &std::array::from_fn::<_, 8, _>(|k| {
                let at = 0.1 * DVec3::new((k % 2) as f64, (k / 2 % 2) as f64, (k / 4) as f64);
                (at, DVec3::new(2.0 * parameters.sound_speed(), stirred * (k % 2) as f64, 0.0))
            }),
        );
        simulation.step_at_most(1e-5).unwrap();
        simulation.findings().iter().any(|(finding, _)| *finding == Finding::Speed)
    };
    assert!(!flying(0.0) && flying(2.0 * parameters.sound_speed()));
}

/// A cube of 0.4 m without gravity that is pressed flat along x at this rate, 1/s, and grows at half of it along y and z.
fn pressed_flat(method: Method, rate: f64) -> Simulation {
    let spacing = 0.05;
    let mut fluid = crate::sph::Particles::default();
    for place in (0..512).map(|i| DVec3::new((i % 8) as f64, (i / 8 % 8) as f64, (i / 64) as f64) - 3.5) {
        fluid.push(spacing * place, rate * spacing * place * DVec3::new(-1.0, 0.5, 0.5));
    }
    let parameters = Parameters { gravity: DVec3::ZERO, ..parameters(method, spacing) };
    let room = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
    Simulation::new(parameters, fluid, room, Vec::new()).unwrap()
}

#[test]
fn rows_that_are_pressed_together_are_told_of() {
    for method in [Method::from(Wcsph::default()), Dfsph::default().into()] {
        let told = |rate: f64, until: f64| {
            let mut simulation = pressed_flat(method, rate);
            simulation.advance(until, |_| std::ops::ControlFlow::Continue(())).unwrap();
            let most = simulation.audit().rows.most;
            // a method with long steps has counted twice by then
            assert!(simulation.steps() >= 4, "{} steps", simulation.steps());
            let is_told = simulation.findings().into_iter().any(|(finding, _)| finding == Finding::Rows);
            assert_eq!(is_told, most > 0.3, "{most}");
            most
        };
        // a layer of the thickness h becomes thinner at the rate −s·h/(1 + s·t): to 0.4 and to 0.7 of what it was, if
        // nothing holds it back
        let (flat, less) = (told(10.0, 0.15), told(10.0, 0.045));
        assert!(flat > 0.35, "{method:?}: {flat}");
        assert!(less < 0.1, "{method:?}: {less}");
    }
}

#[test]
fn energy_from_nowhere_is_found_and_stops_a_run() {
    let mut simulation = column(Wcsph::default().into(), 0.1);
    simulation.step().unwrap();
    assert!(simulation.news().is_empty());
    let faster = |simulation: &mut Simulation, speed: f64| {
        let mut checkpoint = simulation.checkpoint();
        let mut column = checkpoint.get("velocity y").unwrap().to_vec();
        column.iter_mut().for_each(|v| *v += speed);
        checkpoint.set("velocity y", column);
        *simulation =
            Simulation::resume(simulation.parameters().clone(), &checkpoint, TANK, Vec::new()).unwrap();
    };
    faster(&mut simulation, 0.5);
    simulation.step().unwrap();
    let excess = simulation.audit().energy_excess().unwrap();
    // ½v² over the potential energy of the column, g·0.4 m, less a little for the pressure
    assert!((excess - 0.125 / (9.81 * 0.4)).abs() < 5e-3, "{excess}");
    let told = simulation.news();
    assert!(matches!(told[..], [(Finding::Energy, _)]), "{told:?}");
    assert!(simulation.news().is_empty(), "told once");
    faster(&mut simulation, 4.0);
    assert!(matches!(simulation.step(), Err(StepError::EnergyDoubled { .. })));
}

/// A band on a post moves a little of the fluid: what it gives and takes is in the balance, and what exceeds all of it
/// ends the run as it does where nothing moves.
#[test]
fn energy_from_nowhere_stops_a_run_with_moving_walls_too() {
    let band = || Obstacle {
        surface_velocity: Some(Arc::new(|_, _| DVec3::new(0.0, 0.0, 0.1))),
        ..Obstacle::at_rest(scenes::sphere(DVec3::new(0.9, 0.1, 0.1), 0.1), 0.01)
    };
    let mut simulation = column(Wcsph::default().into(), 0.1);
    let mut checkpoint = simulation.checkpoint();
    let parameters = simulation.parameters().clone();
    let mut faster = |simulation: &mut Simulation, speed: f64| {
        let mut column = checkpoint.get("velocity y").unwrap().to_vec();
        column.iter_mut().for_each(|v| *v += speed);
        checkpoint.set("velocity y", column);
        *simulation = Simulation::resume(parameters.clone(), &checkpoint, TANK, vec![band()]).unwrap();
        (0..10 * LOOK)
            .map(|_| simulation.step().map(|_| checkpoint = simulation.checkpoint()))
            .collect::<Result<Vec<_>, _>>()
    };
    faster(&mut simulation, 0.5).unwrap();
    let excess = simulation.audit().energy_excess().unwrap();
    assert!((0.01..0.1).contains(&excess), "{excess}");
    assert!(matches!(faster(&mut simulation, 30.0), Err(StepError::EnergyDoubled { walls_move: true, .. })));
}

#[test]
fn what_a_low_wave_gains_is_compared_with_its_motion() {
    let mut simulation = column(Wcsph::default().into(), 0.1);
    simulation.step().unwrap();
    // a little more than 0.2 % of g·0.4 m, and nothing moved before: the water at rest was given a speed
    let mut checkpoint = simulation.checkpoint();
    let mut column = checkpoint.get("velocity y").unwrap().to_vec();
    column.iter_mut().for_each(|v| *v += 0.16);
    checkpoint.set("velocity y", column);
    simulation = Simulation::resume(simulation.parameters().clone(), &checkpoint, TANK, Vec::new()).unwrap();
    simulation.step().unwrap();
    let excess = simulation.audit().energy_excess().unwrap();
    assert!((0.002..0.01).contains(&excess), "{excess}");
    let told = simulation.news();
    let [(Finding::Energy, text)] = &told[..] else { panic!("{told:?}") };
    assert!(text.contains("greatest energy of motion"), "{text}");
}

#[test]
fn crowded_places_are_found_whatever_density_is_carried() {
    // particles that nothing pushes apart
    let dust = crate::sph::Paper { stiffness: 0.0, ..crate::sph::Paper::default() };
    let mut simulation = column(dust.into(), 0.1);
    let mut checkpoint = simulation.checkpoint();
    for name in ["position x", "position y", "position z"] {
        let column = checkpoint.get(name).unwrap().iter().map(|x| 0.9 * x).collect();
        checkpoint.set(name, column);
    }
    simulation = Simulation::resume(simulation.parameters().clone(), &checkpoint, TANK, Vec::new()).unwrap();
    while simulation.steps() < LOOK {
        simulation.step().unwrap();
    }
    assert!(simulation.audit().volume_change() < -0.05, "{}", simulation.audit().volume_change());
    assert!(simulation.audit().compression().p99 > 0.1);
}

#[test]
fn the_energy_of_a_surface_is_its_tension_times_its_area() {
    let parameters = Parameters {
        surface_tension: 1.0,
        gravity: DVec3::ZERO,
        ..parameters(Dfsph::default().into(), 0.05)
    };
    let count = 4000;
    let space = Aabb::new(DVec3::splat(-9.0), DVec3::splat(9.0));
    let drop = FluidBlock::drop(DVec3::ZERO, count).seed(&parameters, space).unwrap();
    let radius = (count as f64 * 0.05f64.powi(3) * 0.75 / std::f64::consts::PI).cbrt();
    let simulation = Simulation::new(parameters.clone(), drop, space, Vec::new()).unwrap();
    let found = surface_energy(&parameters, &simulation.particles().density);
    let exact = 4.0 * std::f64::consts::PI * radius * radius;
    // a lattice's ball has steps
    assert!((found / exact - 1.0).abs() < 0.15, "{found} {exact}");
}

#[test]
fn a_fluid_without_energy_is_not_judged() {
    let simulation = scenes::free(
        Parameters { gravity: DVec3::ZERO, ..parameters(Wcsph::default().into(), 0.1) },
        &[(DVec3::ZERO, DVec3::ZERO)],
    );
    assert_eq!(simulation.audit().unjudged(), Some(NO_ENERGY));
    assert_eq!(simulation.audit().energy_excess(), None);
}

#[test]
fn a_film_between_walls_has_nothing_to_release_and_a_drop_has() {
    let cube = Aabb::new(DVec3::ZERO, DVec3::ONE);
    // 0.4 m³: a plane of 1 m², a quarter of a cylinder of 1.12 m², an eighth of a sphere of 1.31 m²
    assert!((least_area(&cube, 0.4) - 1.0).abs() < 1e-12);
    assert!((least_area(&cube, 0.2) - (0.2 * PI).sqrt()).abs() < 1e-12);
    // the air above 0.99 m³ is a bubble in a corner of the radius 0.267 m
    let radius = (0.06 / PI).powf(1.0 / 3.0);
    assert!((least_area(&cube, 0.99) - 0.5 * PI * radius.powi(2)).abs() < 1e-12);

    let spacing = 0.05;
    let parameters = Parameters { surface_tension: 1.0, ..parameters(Wcsph::default().into(), spacing) };
    // plane 0.4 m above the floor, and a ball of 0.2 m
    let at_start = |is_fluid: &dyn Fn(DVec3) -> bool| {
        let mut fluid = crate::sph::Particles::default();
        let sites = (0..8000)
            .map(|n| spacing * (DVec3::new((n % 20) as f64, (n / 20 % 20) as f64, (n / 400) as f64) + 0.5));
        sites.filter(|p| is_fluid(*p)).for_each(|p| fluid.push(p, DVec3::ZERO));
        Simulation::new(parameters.clone(), fluid, cube, Vec::new()).unwrap().audit().at_start
    };
    assert!(at_start(&|p| p.z < 0.4) < 0.15);
    let ball = at_start(&|p| p.distance(DVec3::splat(0.5)) < 0.2);
    let (whole, least) = (4.0 * PI * 0.04, least_area(&cube, 4.0 / 3.0 * PI * 0.008));
    assert!((ball / (UNSURE_AREA * whole - least) - 1.0).abs() < 0.2, "{ball} {whole} {least}");
}
