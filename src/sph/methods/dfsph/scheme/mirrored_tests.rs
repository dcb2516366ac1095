//! The systems of a fluid that has images in the walls of its box.

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

/// Particles in disorder in a corner of a box, with a surface towards its middle.
fn in_a_corner() -> Core {
    const SPACING: f64 = 2e-4;
    let side = 5;
    let mut particles = Particles::default();
    for n in 0..side * side * side {
        let cell = DVec3::new((n % side) as f64, (n / side % side) as f64, (n / side / side) as f64);
        let jitter = DVec3::new((7.0 * n as f64).sin(), (11.0 * n as f64).sin(), (13.0 * n as f64).sin());
        particles.push(SPACING * (cell + 0.5 + 0.4 * jitter), DVec3::ZERO);
    }
    let boundary = Boundary {
        domain: Aabb::new(DVec3::ZERO, DVec3::splat(20.0 * SPACING)),
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
    let parameters = Parameters {
        surface_tension: 0.0728,
        support_radius: 3.0 * SPACING,
        expected_speed: 0.1,
        precision: Precision::F64,
        ..Parameters::of(Dfsph::default(), SPACING)
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
