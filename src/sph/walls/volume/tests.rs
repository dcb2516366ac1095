//! Maps against integrals in closed form.

use std::{f64::consts::PI, sync::Arc};

use glam::DVec3;

use super::{
    changing::{Changing, ChangingShape},
    map::{Taken, VolumeMap},
    maps::{Known, Mapped, Maps, RigidPart},
};
use crate::sph::{
    scenes::{half_space, pawn, random_cloud, sphere},
    walls::{Wall, WallKernel, symmetric::Symmetric},
};
use crate::{
    field::{Moving, Walls},
    geom::Aabb,
};

const H: f64 = 0.26;

const KERNEL: WallKernel = WallKernel::WendlandC2;

fn map(body: Arc<dyn Walls>, domain: Aabb) -> VolumeMap {
    VolumeMap::new(vec![body], &domain, H).unwrap()
}

/// A body that moves, and its parts.
fn mapped<'a>(field: &'a Arc<dyn Walls>, motion: &'a Arc<dyn Moving>, parts: &'a [RigidPart]) -> Mapped<'a> {
    Mapped { field, motion: Some(motion), parts, changing: None }
}

fn cube(side: f64) -> Aabb {
    Aabb::new(DVec3::splat(-0.5 * side), DVec3::splat(0.5 * side))
}

/// λ, ∇λ and K at a plane differ from the closed forms by as much as the module says.
#[test]
fn planes_have_their_closed_forms() {
    let (mut of_part, mut of_gradient, mut of_moment): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for normal in [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.3, -0.5, 0.7)] {
        let normal = normal.normalize();
        let map = map(half_space(DVec3::new(0.01, 0.02, 0.03), normal), cube(2.0));
        for place in random_cloud(300, 0.6).iter() {
            let delta = (place - DVec3::new(0.01, 0.02, 0.03)).dot(normal) / H;
            if !(0.0..1.0).contains(&delta) {
                continue;
            }
            let nothing = Taken {
                part: 0.0,
                gradient: DVec3::ZERO,
                moment: Symmetric::default(),
                sweep: 0.0,
                velocity: None,
            };
            let taken = map.at(place).unwrap_or(nothing);
            let (part, slope) = (KERNEL.covered(delta), KERNEL.slope(delta));
            let moment = part * Symmetric::IDENTITY + delta * slope * Symmetric::square(normal);
            of_part = of_part.max((taken.part - part).abs());
            of_gradient = of_gradient.max((taken.gradient * H + slope * normal).length());
            let off = (taken.moment - moment).to_matrix();
            of_moment = of_moment.max(off.to_cols_array().into_iter().fold(0.0, |m, x| m.max(x.abs())));
        }
    }
    println!("λ {of_part:.5}, ∇λ {of_gradient:.4}, K {of_moment:.4}");
    assert!(of_part < 0.001 && of_gradient < 0.012 && of_moment < 0.02);
}

/// λ of a ball of radius `ball` at the distance `away` from its middle: shell by shell of the kernel, whose caps inside
/// the ball have the areas of Archimedes.
fn of_ball(ball: f64, away: f64) -> f64 {
    let steps = 4000;
    let shell = |k: usize| {
        let r = (k as f64 + 0.5) / steps as f64 * H;
        let q = r / H;
        let weight = 21.0 / (2.0 * PI * H.powi(3)) * (1.0 - q).powi(4) * (1.0 + 4.0 * q);
        let cosine = ((away * away + r * r - ball * ball) / (2.0 * away * r)).clamp(-1.0, 1.0);
        weight * 2.0 * PI * r * r * (1.0 - cosine) * H / steps as f64
    };
    (0..steps).map(shell).sum()
}

/// Balls larger and smaller than the kernel. Closed forms for curved faces miss the smallest by far.
#[test]
fn balls_have_their_integrals() {
    for ball in [2.0 * H, H, 0.3 * H] {
        let mut worst: f64 = 0.0;
        let centre = DVec3::new(0.013, -0.02, 0.04);
        let map = map(sphere(centre, ball), cube(2.0));
        for direction in random_cloud(40, 1.0).iter().map(DVec3::normalize) {
            for delta in [0.01, 0.3, 0.7] {
                let away = ball + delta * H;
                let found = map.at(centre + away * direction).unwrap().part;
                let exact = of_ball(ball, away);
                // chords of a ball hold less than its arcs
                worst = worst.max((found - exact).abs());
            }
        }
        println!("{:.1} h: {worst:.4}", ball / H);
        assert!(worst < 0.005, "{ball}: {worst}");
    }
}

/// ∇λ is the derivative of λ, even at the rim of the pawn's collar, which is sharper than the kernel.
#[test]
fn gradients_are_derivatives() {
    let body = pawn();
    let map = map(body.clone(), Aabb::new(DVec3::ZERO, DVec3::splat(3.0)));
    let middle = DVec3::new(1.5, 1.5, 1.0);
    let part = |p: DVec3| map.at(p).map_or(0.0, |taken| taken.part);
    let mut seen = 0;
    for place in random_cloud(2000, 1.2).iter().map(|p| middle + p).filter(|p| body.omega(*p) < 0.0) {
        let Some(taken) = map.at(place) else { continue };
        // λ is known to seven digits, so the difference is taken over a part of a cell
        let e = 3e-3 * H;
        let slope = |axis: DVec3| (part(place + e * axis) - part(place - e * axis)) / (2.0 * e);
        let derivative = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
        // the difference is off by e²/6 times a third derivative of some 100/H³
        assert!((derivative - taken.gradient).length() * H < 5e-4, "{place}: {taken:?} {derivative}");
        seen += 1;
    }
    assert!(seen > 500, "{seen}");
}

#[test]
fn what_is_far_or_outside_the_box_takes_nothing() {
    let floor = map(half_space(DVec3::ZERO, DVec3::Z), Aabb::new(DVec3::ZERO, DVec3::ONE));
    // the body fills all below the box and nothing in it
    assert!(floor.at(DVec3::splat(0.1)).is_none_or(|taken| taken.part < 1e-6));
    let ball = map(sphere(DVec3::ZERO, 0.2), cube(4.0));
    assert!(ball.at(DVec3::splat(1.5)).is_none());
    assert!(ball.at(DVec3::new(0.2 + 1.5 * H, 0.0, 0.0)).is_none_or(|taken| taken.part < 1e-9));
}

/// At the end of the support λ is so small that it makes no difference whether it counts.
#[test]
fn nothing_is_left_beyond_the_support() {
    let map = map(half_space(DVec3::ZERO, DVec3::new(0.6, 0.0, 0.8)), cube(2.0));
    for along in [0.0, 0.03, 0.07] {
        let place = DVec3::new(0.6, 0.0, 0.8) * H + along * DVec3::new(0.8, 0.0, -0.6);
        let part = map.at(place).map_or(0.0, |taken| taken.part);
        assert!(part < 3e-5, "{part}");
    }
}

#[test]
fn distances_take_their_parts() {
    for kernel in WallKernel::ALL {
        let wall = Wall::new(kernel, H, H / 2.6);
        for k in 1..100 {
            let part = f64::from(k) / 100.0;
            let delta = wall.distance_of(part);
            assert!((kernel.covered(delta) - part).abs() < 1e-12, "{kernel:?} {part} {delta}");
        }
        for part in [1e-9, 1e-6, 1e-4] {
            let delta = wall.distance_of(part);
            assert!((kernel.covered(delta) / part - 1.0).abs() < 1e-9, "{kernel:?} {part} {delta}");
        }
        assert_eq!((wall.distance_of(0.0), wall.distance_of(1.0)), (1.0, -1.0));
    }
}

/// A body that turns takes its map along: it takes what it would if it lay there.
#[test]
fn moving_bodies_take_their_map_along() {
    let program = crate::Program::from_source(
        "moving.rfm",
        "rfm 1\nsolid s = box([-0.4,-0.2,-0.1],[0.4,0.2,0.1]).rotate_z(t).move([0.2*t, 0, 0.05])",
    );
    let solid = program.unwrap().solid("s").unwrap();
    let field: Arc<dyn Walls> = Arc::new(solid.at(0.0));
    let motion: Arc<dyn Moving> = Arc::new(solid.clone());
    let mut maps = Maps::new(&[mapped(&field, &motion, &[])], &cube(2.0), H, 0.0);
    maps.move_to(0.0, 0.7);
    let there = map(Arc::new(solid.at(0.7)), cube(2.0));
    let mut seen = 0;
    for place in random_cloud(300, 1.2).iter() {
        let (Known::Taken(found), Some(exact)) = (maps.of(0, place), there.at(place)) else { continue };
        // the lattices differ, and edges are sharper than the kernel
        assert!((found.part - exact.part).abs() < 0.01, "{place}: {found:?} {exact:?}");
        assert!((found.gradient - exact.gradient).length() * H < 0.06, "{place}: {found:?} {exact:?}");
        seen += 1;
    }
    assert!(seen > 100, "{seen}");
}

/// Plates of one body that rise differently: each takes what it would alone, also beside the middle of a plate that is
/// thinner than the kernel, and carries its own velocity.
#[test]
fn parts_of_a_body_take_their_maps_along() {
    let plate = "box([-0.05, -0.6, -0.6], [0.05, 0.6, 0.6])";
    let text = format!(
        "rfm 1\nlet plate = {plate}\nsolid slow = plate.move([-0.3, 0, 0.1*t])\nsolid fast = plate.move([0.3, 0, 0.3*t])\n\
         solid both = slow or fast"
    );
    let program = crate::Program::from_source("plates.rfm", text).unwrap();
    let [slow, fast, both] = ["slow", "fast", "both"].map(|name| program.solid(name).unwrap());
    let parts = [&slow, &fast]
        .map(|solid| RigidPart { field: Arc::new(solid.at(0.0)), moving: Some(Arc::new(solid.clone())) });
    let field: Arc<dyn Walls> = Arc::new(both.at(0.0));
    let motion: Arc<dyn Moving> = Arc::new(both.clone());
    let mut maps = Maps::new(&[mapped(&field, &motion, &parts)], &cube(2.0), H, 0.0);
    maps.move_to(0.4, 0.5);
    let there = [&slow, &fast].map(|solid| map(Arc::new(solid.at(0.5)), cube(2.0)));
    let mut before: Option<f64> = None;
    for k in 0..200 {
        let place = DVec3::new(-0.6 + 0.006 * f64::from(k), 0.05, 0.62);
        let found = match maps.of(0, place) {
            Known::Parts(found) => found,
            Known::Nothing => Vec::new(),
            Known::AtRest | Known::Taken(_) | Known::Changing | Known::ByFaces => panic!("{place}"),
        };
        let [by_slow, by_fast] = there.each_ref().map(|map| map.at(place).map_or(0.0, |taken| taken.part));
        let part_with = |rise: f64| {
            let carried = found.iter().filter(|(_, velocity)| (*velocity - rise * DVec3::Z).length() < 1e-12);
            carried.map(|(taken, _)| taken.part).sum::<f64>()
        };
        for (rise, exact) in [(0.1, by_slow), (0.3, by_fast)] {
            let part = part_with(rise);
            assert!((part - exact).abs() < 0.01, "{place}, {rise}: {part} {exact}");
        }
        let part = found.iter().map(|(taken, _)| taken.part).sum::<f64>();
        assert!((part - by_slow - by_fast).abs() < 0.01, "{place}: a velocity of neither plate");
        // a step of a fortieth of the kernel
        assert!(before.is_none_or(|before| (part - before).abs() < 0.1), "{place}: {before:?} {part}");
        before = Some(part);
    }
}

/// A ball that grows takes what it would at each instant, and its sweep is how fast that grows: at the first
/// and the last instant of a run too, and beyond.
#[test]
fn bodies_that_change_their_shape_take_what_they_would_at_each_instant() {
    let program = crate::Program::from_source("grows.rfm", "rfm 1\nsolid s = sphere(0.3 + 0.2*sin(t))");
    let solid = program.unwrap().solid("s").unwrap();
    let shape = ChangingShape { body: Arc::new(solid.clone()), until: 1.4, intervals: 9, switches: false };
    let domain = cube(2.0);
    for time in [0.0, 0.07, 0.61, 1.23, 1.4, 1.52] {
        let changing = Changing::new(&shape, &domain, H, time).unwrap();
        let [before, there, after] = [-1e-3, 0.0, 1e-3].map(|d| map(Arc::new(solid.at(time + d)), domain));
        let mut worst = [0.0_f64; 3];
        for place in random_cloud(300, 0.9).iter() {
            let (Some(found), Some(exact)) = (changing.at(place), there.at(place)) else { continue };
            let part_at = |map: &VolumeMap| map.at(place).map_or(0.0, |taken| taken.part);
            let rate = (part_at(&after) - part_at(&before)) / 2e-3;
            let off = [
                (found.part - exact.part).abs(),
                (found.gradient - exact.gradient).length() * H,
                (found.sweep + rate).abs() * H,
            ];
            worst = std::array::from_fn(|k| worst[k].max(off[k]));
        }
        println!("{time}: λ {:.5}, ∇λ {:.4}, sweep {:.4}", worst[0], worst[1], worst[2]);
        // the surface moves by an eighth of h in an interval; in the first and the last one the cubic is one-sided
        assert!(worst[0] < 0.002 && worst[1] < 0.015 && worst[2] < 0.02, "{time}: {worst:?}");
    }
    // one after the other, also back and beyond the end, the same as at once
    let mut along = Changing::new(&shape, &domain, H, 0.2).unwrap();
    for time in [0.21, 0.26, 0.43, 1.0, 0.3, 1.39, 1.4, 1.45, 1.9, 1.3] {
        along.move_to(time);
        let at_once = Changing::new(&shape, &domain, H, time).unwrap();
        for place in random_cloud(50, 0.9).iter() {
            let figures = |changing: &Changing| changing.at(place).map(|taken| (taken.part, taken.sweep));
            assert_eq!(figures(&along), figures(&at_once), "{time}");
        }
    }
}
