//! Corners, thin plates, walls behind walls and walls that rub against each other: who has what of a push.

use std::sync::Arc;

use super::*;
use crate::{
    field::{Closures, Walls},
    geom::Aabb,
    sph::walls::{BroadPhase, Obstacle, WallKernel, volume::Maps},
};

fn sticky(field: impl Walls + 'static) -> Obstacle {
    Obstacle { slip: Slip::No, ..Obstacle::at_rest(Arc::new(field), 0.01) }
}

/// A box with a floor at z = 0 and two blocks, that end at x = 0 and begin at x = `gap`.
fn boundary(gap: f64) -> Boundary {
    let left = Closures { omega: |p: DVec3| -p.x, gradient: |_: DVec3| -DVec3::X };
    let right = Closures { omega: move |p: DVec3| p.x - gap, gradient: |_: DVec3| DVec3::X };
    around(vec![sticky(left), sticky(right)])
}

/// That box with other obstacles.
fn around(obstacles: Vec<Obstacle>) -> Boundary {
    let broad_phase = BroadPhase::unknown(obstacles.len());
    Boundary {
        domain: Aabb::new(DVec3::new(-5.0, -5.0, 0.0), DVec3::splat(5.0)),
        wall_restitution: 0.0,
        wall_friction: 0.0,
        slip: Slip::No,
        obstacles,
        during: Vec::new(),
        time: 0.0,
        step: 0.0,
        clearance: 1e-6,
        maps: Maps::new(&[], &Aabb::new(DVec3::ZERO, DVec3::ONE), 1.0, 0.0),
        broad_phase,
    }
}

fn shares(boundary: &Boundary, p: DVec3, pushed: Pushed) -> [DVec3; 2] {
    let mut shares = [DVec3::ZERO; 2];
    let wall = Wall::new(WallKernel::WendlandC2, 1.0, 0.5);
    boundary.divide(&wall, p, &pushed, |k, share| shares[k] += share.by_pressure + share.by_friction);
    shares
}

#[test]
fn one_wall_has_all() {
    let push = DVec3::new(3.0, 1.0, 2.0);
    let pushed = Pushed { by_pressure: push, factor: -7.0, by_friction: push, ..Pushed::default() };
    assert_eq!(shares(&boundary(9.0), DVec3::new(0.2, 0.0, 2.0), pushed), [2.0 * push, DVec3::ZERO]);
}

#[test]
fn in_a_corner_each_wall_presses_as_if_it_were_alone() {
    let p = DVec3::new(0.2, 0.0, 0.3);
    let boundary = boundary(9.0);
    let wall = Wall::new(WallKernel::WendlandC2, 1.0, 0.5);
    let gradient = boundary.coverage::<(), ()>(&wall, p).unwrap().gradient;
    let alone = boundary.with_faces(&wall, p, Coverage::<()>::default(), 0).gradient;
    assert!(gradient.x.abs() < 0.9 * alone.x.abs(), "the walls overlap");
    let pushed = Pushed { by_pressure: -4.0 * gradient, factor: -4.0, gradient, ..Pushed::default() };
    let [left, right] = shares(&boundary, p, pushed);
    assert!((left.x + 4.0 * alone.x).abs() < 0.01 * left.x.abs(), "{left} {alone}");
    // the image of the fluid in the block is pressed down less than the fluid itself
    assert!(left.z < -0.1 * left.x.abs(), "{left}");
    assert_eq!(right, DVec3::ZERO);
}

/// A plate that stands on the floor presses as much less than a block as it is thinner than a kernel is wide.
#[test]
fn a_thin_plate_presses_as_what_it_takes() {
    let text = "rfm 1\nsolid plate = box([-0.1, -9, -9], [0, 9, 9])";
    let program = crate::Program::from_source("plate.rfm", text).unwrap();
    let plate = sticky(program.solid("plate").unwrap());
    let boundary = around(vec![plate]);
    let wall = Wall::new(WallKernel::WendlandC2, 1.0, 0.5);
    let p = DVec3::new(0.2, 0.0, 0.3);
    let slope = |distance: f64| wall.kernel.slope(distance);
    let thin = slope(0.2) - slope(0.3);
    let gradient = DVec3::new(-thin, 0.0, -slope(0.3));
    let pushed = Pushed { by_pressure: -4.0 * gradient, factor: -4.0, gradient, ..Pushed::default() };
    let mut shares = DVec3::ZERO;
    boundary.divide(&wall, p, &pushed, |_, share| shares += share.by_pressure + share.by_friction);
    // a block as deep as the kernel would press with all of its slope, 3.4 times as much
    assert!((shares.x - 4.0 * thin).abs() < 0.02 * thin, "{shares} {thin}");
}

/// A slab on the floor of the box, and a second one at the same place: of walls behind one another the
/// first takes everything.
#[test]
fn what_is_behind_another_wall_has_nothing() {
    let slab = || Closures { omega: |p: DVec3| 0.1 - p.z, gradient: |_: DVec3| -DVec3::Z };
    let p = DVec3::new(0.4, 0.0, 0.3);
    let pushed = Pushed {
        by_pressure: DVec3::new(0.3, 0.1, 5.0),
        factor: -4.0,
        gradient: DVec3::new(0.0, 0.0, -1.1),
        by_friction: DVec3::new(1.0, 2.0, 0.0),
        ..Pushed::default()
    };
    let twice = around(vec![sticky(slab()), sticky(slab())]);
    let [first, second] = shares(&twice, p, pushed);
    let whole = pushed.by_pressure + pushed.by_friction;
    assert!((first - whole).length() < 1e-9 && second.length() < 1e-9, "{first} {second}");
    // two slabs on a floor, thinner than the kernel: the upper one has all, also what the lower ones rub
    let plate = |low: f64, high: f64| Closures {
        omega: move |p: DVec3| (high - p.z).min(p.z - low),
        gradient: move |p: DVec3| if p.z > 0.5 * (low + high) { -DVec3::Z } else { DVec3::Z },
    };
    let text =
        "rfm 1\nsolid lower = box([-9, -9, 0], [9, 9, 0.1])\nsolid upper = box([-9, -9, 0.1], [9, 9, 0.2])";
    let program = crate::Program::from_source("slabs.rfm", text).unwrap();
    let slabs = ["lower", "upper"].map(|name| sticky(program.solid(name).unwrap()));
    let mut stack = around(slabs.into());
    stack.obstacles[1].slip = Slip::Free;
    let [lower, upper] = shares(&stack, p + 0.1 * DVec3::Z, pushed);
    assert!((upper - whole).length() < 0.02 && lower.length() < 0.02, "{lower} {upper}");
    // below a gap the floor has its part
    let above = around(vec![sticky(plate(0.1, 0.2))]);
    let mut shares = DVec3::ZERO;
    let wall = Wall::new(WallKernel::WendlandC2, 1.0, 0.5);
    above.divide(&wall, p, &pushed, |_, share| shares += share.by_pressure + share.by_friction);
    assert!(shares.z > 0.1 && shares.z < 4.9, "{shares}");
}

#[test]
fn what_completes_pressures_in_a_corner_belongs_to_both_walls() {
    let (p, push) = (DVec3::new(0.2, 0.0, 0.2), DVec3::new(3.0, 0.0, 3.0));
    let [left, right] = shares(&boundary(9.0), p, Pushed { by_pressure: push, ..Pushed::default() });
    // the floor has as much the other way round
    assert!((left.x + left.z - 3.0).abs() < 1e-9 && left.x > 1.2 * left.z && left.z > 0.5, "{left}");
    assert_eq!(right, DVec3::ZERO);
}

#[test]
fn in_a_corner_each_wall_has_the_friction_along_it() {
    let (p, push) = (DVec3::new(0.2, 0.0, 0.3), DVec3::new(3.0, 0.0, 5.0));
    // what acts along x is the floor's, which is that of the box
    let [left, _] = shares(&boundary(9.0), p, Pushed { by_friction: push, ..Pushed::default() });
    assert!(left.x.abs() < 0.02 && (left.z - 5.0).abs() < 0.02, "{left}");
}

#[test]
fn walls_along_which_the_fluid_slips_have_no_part_of_the_friction() {
    let (p, push) = (DVec3::new(0.2, 0.0, 0.3), DVec3::new(0.0, 4.0, 1.0));
    let friction = Pushed { by_friction: push, ..Pushed::default() };
    let floor_slips = Boundary { slip: Slip::Free, ..boundary(9.0) };
    assert!((shares(&floor_slips, p, friction)[0] - push).length() < 1e-12);
    let mut floor_sticks = boundary(9.0);
    floor_sticks.obstacles[0].slip = Slip::Free;
    assert_eq!(shares(&floor_sticks, p, friction)[0], DVec3::ZERO);
}

#[test]
fn walls_that_rub_against_each_other_each_have_their_own() {
    let mut boundary = boundary(1.0);
    boundary.obstacles[1].surface_velocity = Some(Arc::new(|_, _| 5.0 * DVec3::Y));
    let wall = Wall::new(WallKernel::WendlandC2, 1.0, 0.5);
    let (p, velocity, viscosity) = (DVec3::new(0.4, 0.0, 2.0), 2.0 * DVec3::Y, 0.3);
    let of = |k: usize| boundary.with_faces(&wall, p, Coverage::<WallDrag>::default(), k).friction;
    let by_friction = of(0).rub(velocity, viscosity) + of(1).rub(velocity, viscosity);
    let pushed = Pushed { by_friction, velocity, viscosity, ..Pushed::default() };
    let [left, right] = shares(&boundary, p, pushed);
    assert!(left.y < -0.5 && right.y > 0.1, "{left} {right}");
    assert!((left - of(0).rub(velocity, viscosity)).length() < 1e-9, "{left}");
    assert!((right - of(1).rub(velocity, viscosity)).length() < 1e-9, "{right}");
}

#[test]
fn shares_add_up_to_the_whole() {
    let pushed = Pushed {
        by_pressure: DVec3::new(3.0, -2.0, 5.0),
        factor: -4.0,
        gradient: DVec3::new(0.3, -0.1, 0.0),
        by_friction: DVec3::new(-1.0, 7.0, 2.0),
        velocity: DVec3::new(0.0, 3.0, -1.0),
        viscosity: 0.2,
        ..Pushed::default()
    };
    let [left, right] = shares(&boundary(1.2), DVec3::new(0.5, 0.0, 2.0), pushed);
    assert!((left + right - pushed.by_pressure - pushed.by_friction).length() < 1e-9, "{left} {right}");
    assert!(left.length() > 0.1 && right.length() > 0.1, "{left} {right}");
}

#[test]
fn between_two_walls_each_presses_by_itself() {
    // in the middle the pressure on both is the same, and the particle stays
    let [left, right] =
        shares(&boundary(1.0), DVec3::new(0.5, 0.0, 2.0), Pushed { factor: -4.0, ..Pushed::default() });
    assert!(left.x > 1.0 && (left + right).length() < 1e-12, "{left} {right}");
}

/// The walls of a channel are one formula, which tells the nearest face alone. What stands behind the other one is pressed
/// by nothing.
#[test]
fn a_channel_has_both_of_its_faces() {
    let sides = Closures {
        omega: |p: DVec3| (p.x - 0.5).abs() - 0.5,
        gradient: |p: DVec3| (p.x - 0.5).signum() * DVec3::X,
    };
    let behind = Closures { omega: |p: DVec3| p.x - 1.1, gradient: |_: DVec3| DVec3::X };
    let boundary = around(vec![sticky(sides), sticky(behind)]);
    for x in [0.4, 0.49, 0.51, 0.6] {
        let pushed = Pushed { factor: -4.0, ..Pushed::default() };
        let [of_sides, of_behind] = shares(&boundary, DVec3::new(x, 0.0, 2.0), pushed);
        assert_eq!(of_behind, DVec3::ZERO, "{x}");
        assert_eq!(of_sides, DVec3::ZERO, "{x}: nothing pushes the particle");
    }
}
