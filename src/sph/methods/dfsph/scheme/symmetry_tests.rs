//! The systems of a fluid that has images in the walls of its box, and of one that fills it.

use glam::DVec3;

use super::super::solver::{RateOf, Solver};
use super::{Continuation, Dfsph, DivergenceFree};
use crate::geom::Aabb;
use crate::precision::Precision;
use crate::sph::{
    core::Core,
    params::Parameters,
    particles::{Particles, Vectors},
    walls::{Boundary, BroadPhase, Maps},
};

pub(super) const SPACING: f64 = 2e-4;

/// Particles in disorder in a corner of a box, with a surface towards its middle.
fn in_a_corner() -> Core {
    let parameters = Parameters { surface_tension: 0.0728, support_radius: 3.0 * SPACING, ..parameters() };
    in_a_box(parameters, 5, 20.0)
}

/// Particles in disorder that fill a box.
fn in_a_full_box() -> Core {
    let parameters = Parameters { fills_vessel: true, support_radius: 2.2 * SPACING, ..parameters() };
    in_a_box(parameters, 11, 11.0)
}

pub(super) fn parameters() -> Parameters {
    Parameters { expected_speed: 0.1, precision: Precision::F64, ..Parameters::of(Dfsph::default(), SPACING) }
}

/// `side`³ particles in the corner of a box `width` spacings wide.
fn in_a_box(parameters: Parameters, side: usize, width: f64) -> Core {
    let mut particles = Particles::default();
    for n in 0..side * side * side {
        let cell = DVec3::new((n % side) as f64, (n / side % side) as f64, (n / side / side) as f64);
        let jitter = DVec3::new((7.0 * n as f64).sin(), (11.0 * n as f64).sin(), (13.0 * n as f64).sin());
        particles.push(SPACING * (cell + 0.5 + 0.4 * jitter), DVec3::ZERO);
    }
    of_particles(parameters, particles, width)
}

/// Particles in a box `width` spacings wide.
pub(super) fn of_particles(parameters: Parameters, particles: Particles, width: f64) -> Core {
    let boundary = Boundary {
        domain: Aabb::new(DVec3::ZERO, DVec3::splat(width * SPACING)),
        wall_restitution: 0.0,
        wall_friction: 0.0,
        obstacles: Vec::new(),
        during: Vec::new(),
        slip: crate::sph::Slip::Free,
        time: 0.0,
        step: 0.0,
        clearance: 1e-9,
        maps: Maps::default(),
        broad_phase: BroadPhase::unknown(0),
    };
    Core::new(parameters, boundary, particles)
}

/// What pressures take from the rates of density.
fn taken(solver: &mut Solver, scheme: &DivergenceFree, core: &Core, s: &[f64]) -> Vec<f64> {
    let mut push = Vectors::default();
    push.resize(s.len());
    solver.find_push_of(core, &scheme.walls, s, &mut push);
    solver.find_rate_of(core, &scheme.walls, &push, RateOf::Pressure);
    solver.rate.iter().map(|rate| -rate).collect()
}

/// Symmetry is what keeps pressures from adding energy. The diagonal bounds the length of the solver's steps.
#[test]
fn both_systems_are_symmetric_and_their_diagonals_are_no_less_than_they_are() {
    let mut core = in_a_corner();
    let mut scheme = DivergenceFree::at(Dfsph::default(), &mut core);
    assert!(scheme.walls.mirrors().is_some());
    let n = core.particles.len();
    let [a, b] = [3.0, 5.0].map(|k: f64| (0..n).map(|i| (k * i as f64).sin()).collect::<Vec<f64>>());
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    for continuation in [Continuation::Linear, Continuation::Barrier] {
        let part = match continuation {
            Continuation::Linear => &mut scheme.forces,
            Continuation::Barrier => &mut scheme.places,
        };
        let mut solver = std::mem::replace(part, Solver::new(continuation, &core.parameters, n));
        let [of_a, of_b] = [&a, &b].map(|s| taken(&mut solver, &scheme, &core, s));
        let (there, back) = (product(&b, &of_a), product(&a, &of_b));
        let scale = product(&of_a, &of_a).sqrt() * product(&b, &b).sqrt();
        assert!((there - back).abs() < 1e-12 * scale, "{there} {back}");
        for i in 0..n {
            let mut alone = vec![0.0; n];
            alone[i] = 1.0;
            let exact = taken(&mut solver, &scheme, &core, &alone)[i];
            let found = solver.factor[i];
            // its own images count twice, and a neighbour with its images as if all pushed the same way
            assert!(exact > 0.0 && found >= (1.0 - 1e-9) * exact && found < 4.0 * exact, "{found} {exact}");
        }
    }
}

#[test]
fn the_corrected_system_is_symmetric_and_does_not_see_a_shear() {
    let mut core = in_a_full_box();
    let mut scheme = DivergenceFree::at(Dfsph::default(), &mut core);
    assert!(scheme.walls.mirrors().is_none());
    let n = core.particles.len();
    let mut solver = Solver::new(Continuation::Linear, &core.parameters, n);
    std::mem::swap(&mut solver, &mut scheme.forces);
    let [a, b] = [3.0, 5.0].map(|k: f64| (0..n).map(|i| (k * i as f64).sin()).collect::<Vec<f64>>());
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // dρ/dt of a shear
    let mut shear = Vectors::default();
    shear.resize(n);
    for (i, x) in core.particles.position.iter().enumerate() {
        shear.set(i, DVec3::new(x.y, x.z, -2.0 * x.x));
    }
    let mut seen = [0.0, 0.0];
    for (is_corrected, seen) in [false, true].into_iter().zip(&mut seen) {
        solver.correct(&core, &scheme.walls, is_corrected);
        let [of_a, of_b] = [&a, &b].map(|s| taken(&mut solver, &scheme, &core, s));
        let (there, back) = (product(&b, &of_a), product(&a, &of_b));
        let scale = product(&of_a, &of_a).sqrt() * product(&b, &b).sqrt();
        assert!((there - back).abs() < 1e-12 * scale, "{there} {back}");
        assert!(product(&a, &of_a) > 0.0);
        solver.find_rate_of(&core, &scheme.walls, &shear, RateOf::Pressure);
        // no neighbour's velocity is completed by walls
        let deep = (0..n).filter(|i| {
            let from_the_middle = core.particles.position.get(*i) - 5.5 * SPACING;
            from_the_middle.abs().max_element() < 5.5 * SPACING - 2.0 * core.parameters.support_radius
        });
        assert!(deep.clone().count() > 3);
        *seen = deep.map(|i| solver.rate[i].abs()).fold(0.0, f64::max) / core.parameters.rest_density;
    }
    let [before, after] = seen;
    assert!(before > 0.1 && after < 1e-12, "{before} {after}");
}
