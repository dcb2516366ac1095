//! What walls add to rates of density while there is a gap before them.

use glam::DVec3;

use super::super::{solver::RateOf, walls::WallsNear};
use super::pressure::approach_speed;
use super::symmetry_tests::{SPACING, of_particles, parameters};
use super::{Dfsph, DivergenceFree};
use crate::sph::{core::Core, params::Parameters, particles::Particles};

/// Particles along each side of the block, which is far from all walls but one.
const SIDE: usize = 9;

/// A block of fluid that moves against a wall of its box with the speed `speed`, m/s, and has `gap` spacings to go.
fn before_a_wall(gap: f64, speed: f64) -> (Core, DivergenceFree) {
    let mut particles = Particles::default();
    for n in 0..SIDE * SIDE * SIDE {
        let cell = DVec3::new((n % SIDE) as f64, (n / SIDE % SIDE) as f64, (n / SIDE / SIDE) as f64);
        let place = cell + DVec3::new(0.5 + gap, 5.0, 5.0);
        particles.push(SPACING * place, DVec3::new(-speed, 0.0, 0.0));
    }
    let parameters = Parameters { support_radius: 2.2 * SPACING, gravity: DVec3::ZERO, ..parameters() };
    let mut core = of_particles(parameters, particles, 19.0);
    let scheme = DivergenceFree::at(Dfsph::default(), &mut core);
    (core, scheme)
}

/// The rates of density of the first layer's middle before a gap is taken into account and after, and what is missing in the density
/// there, all for a step of the length `dt`, s.
fn rates(gap: f64, speed: f64, dt: f64) -> [f64; 3] {
    let (core, mut scheme) = before_a_wall(gap, speed);
    let middle = SPACING * DVec3::new(0.5 + gap, 9.0, 9.0);
    let far = |i: &usize| (core.particles.position.get(*i) - middle).length();
    let first = (0..core.particles.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
    scheme.gaps.find(&core, &scheme.walls, 1.0);
    let velocity = &core.particles.velocity;
    scheme.forces.find_rate_of(&core, &scheme.walls, velocity, RateOf::Velocity(&scheme.whole));
    let before = scheme.forces.rate[first];
    scheme.gaps.take(&core, (&mut scheme.forces, &scheme.walls), &scheme.whole, dt);
    let missing = 0.99 * core.parameters.rest_density - core.particles.density[first];
    [before, scheme.forces.rate[first], missing]
}

/// What is taken from a rate in a step is what closes the gap in it, however small a part of the wall's that is.
#[test]
fn as_much_of_a_rate_is_taken_as_fills_the_gap() {
    let speed = 3.0;
    for gap in [0.2, 0.4, 0.8] {
        // from a step that closes a small part of the gap to one that closes all of it and more
        for ways in [2.0, 5.0, 20.0] {
            let dt = ways * gap * SPACING / speed;
            let [before, after, missing] = rates(gap, speed, dt);
            assert!(before > 0.0 && missing > 0.0, "{gap}: {before} {missing}");
            let taken = (before - after) * dt / missing;
            let is_all = after.abs() < 1e-9 * before;
            assert!((taken - 1.0).abs() < 0.02 || is_all && taken < 1.0, "{gap} {ways}: {taken} {is_all}");
            assert!(!is_all || ways < 20.0, "{gap}");
        }
        // in a short step nothing is left of the wall
        let [before, after, _] = rates(gap, speed, 0.01 * gap * SPACING / speed);
        assert!(after.abs() < 1e-9 * before, "{gap}: {after} of {before}");
    }
    // fluid that touches the wall has no gap
    let [before, after, missing] = rates(0.0, speed, 1e-5);
    assert!(missing <= 0.0 && (after - before).abs() < 1e-12 * before, "{before} {after} {missing}");
}

/// Between two walls that face each other ∇λ vanishes in the middle. What is left of it says nothing of their approach.
#[test]
fn walls_that_close_from_both_sides_come_as_fast_as_they_move() {
    let (core, scheme) = before_a_wall(0.3, 0.0);
    let (_, (near, _)) = scheme.walls.found()[0];
    let towards = -3.0 * near.gradient.normalize();
    let one = WallsNear { sweep: near.gradient.dot(towards), ..near };
    assert!((approach_speed(&core, &one, DVec3::ZERO) / 3.0 - 1.0).abs() < 1e-6);
    let both = WallsNear { part: 2.0 * near.part, gradient: DVec3::ZERO, sweep: 2.0 * one.sweep, ..near };
    let found = approach_speed(&core, &both, DVec3::ZERO);
    assert!(found > 3.0 && found < 4.5, "{found}");
    assert_eq!(approach_speed(&core, &WallsNear { sweep: -both.sweep, ..both }, DVec3::ZERO), 0.0);
}
