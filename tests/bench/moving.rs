//! What it costs that a solid moves: `cargo bench --bench moving`.
//!
//! A turning blade against the same blade at rest: one thread, all ways taking turns in one run, the best of
//! several passes. Then the cell map of a machine with moving parts: how long it takes to prepare the run on
//! all threads, and on one all cells of a window of time, of which a fluid asks for a part; and what is then
//! near a surface.

use std::hint::black_box;
use std::time::Instant;

use rfm::field::{Moving, Path};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::solid::{MovingMap, Place};
use rfm::{Program, Solid};

const POINTS: usize = 4096;
const ROUNDS: usize = 41;

const BLADE: &str = "box([-0.8, -0.05, -0.3], [0.8, 0.05, 0.3])";

fn solid(formula: &str) -> Solid {
    let text = format!("rfm 1\nsolid it = {formula}\n");
    Program::from_source("moving.rfm", text)
        .and_then(|program| program.solid("it"))
        .unwrap_or_else(|e| panic!("{e}"))
}

fn main() {
    let rest = solid(&format!("{BLADE}.rotate_z(0.7)"));
    let moving = solid(&format!("{BLADE}.rotate_z(2*pi*t)")).at(0.7 / std::f64::consts::TAU);
    let points = points();
    let columns: [Vec<f64>; 3] = std::array::from_fn(|i| points.iter().map(|p| p[i]).collect());
    println!(
        "\nblade, ns per point, path or step (best of {ROUNDS})\n\n| question | at rest | moving |\n|---|--:|--:|"
    );
    compare("ω, columns", [&rest, &moving], |solid| {
        let mut omega = vec![0.0; POINTS];
        solid.omega_many(columns.each_ref().map(Vec::as_slice), &mut omega);
        black_box(omega);
    });
    compare("ω, one point", [&rest, &moving], |solid| {
        points.iter().for_each(|&p| _ = black_box(solid.omega(p)));
    });
    compare("ω and ∇ω, one point", [&rest, &moving], |solid| {
        points.iter().for_each(|&p| _ = black_box(solid.omega_grad(p)));
    });
    compare("distance, normal, curvature", [&rest, &moving], |solid| {
        points.iter().for_each(|&p| _ = black_box(solid.contact(p)));
    });
    compare("velocity of the wall", [&rest, &moving], |solid| {
        points.iter().for_each(|&p| _ = black_box(solid.wall_velocity(p)));
    });
    for length in [0.01, 0.1] {
        compare(&format!("swept path of {length}"), [&rest, &moving], |solid| {
            let step = solid.during(0.1, 0.11);
            for &p in &points {
                let path = Path::new(p, p + DVec3::splat(length / 3.0f64.sqrt()), f64::INFINITY);
                black_box(step.first_entry(&path));
            }
        });
    }
    compare("`during`, and one value", [&rest, &moving], |solid| {
        for i in 0..POINTS {
            let from = i as f64 * 1e-3;
            black_box(solid.during(from, from + 1e-3).omega(DVec3::X));
        }
    });
    maps();
}

fn maps() {
    let machine = solid(
        "(any k in 0..40: ball([0.05*k - 1, sin(7*k), cos(3*k)], 0.06)) \
         or (any k in 0..4: box([0, -0.02, -0.5], [0.6, 0.02, 0.5]).rotate_z(k*90°).rotate_z(2*t)) \
         or ball([0.9*cos(t), 0.9*sin(t), 0.8], 0.1)",
    );
    let domain = Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.5));
    let dt = 0.002;
    println!(
        "\n40 balls at rest, 4 blades turning at 2 rad/s and a ball that flies round; reach 0.05, steps of {dt} s\n"
    );
    println!(
        "| steps in a window | run prepared, ms | window, ms | restless of 4096 | near cells | ns per look-up |"
    );
    println!("|--:|--:|--:|--:|--:|--:|");
    let points = points();
    for steps in [1, 4, 16, 64, 256] {
        let started = Instant::now();
        let window = f64::from(steps) * dt;
        let Some(map) = MovingMap::new(&machine, domain, 0.05, (0.0, 12.0 * window), window) else { return };
        let prepared = started.elapsed().as_secs_f64();
        let mut times = Vec::new();
        for k in 0..12 {
            let from = f64::from(k) * window;
            let started = Instant::now();
            // counting divides them
            black_box(map.between(from, from + dt).map(|cells| cells.stats()));
            times.push(started.elapsed().as_secs_f64());
        }
        // the first one compiles what ranges need
        let best = times[1..].iter().copied().fold(f64::INFINITY, f64::min);
        let Some(cells) = map.between(0.0, dt) else { return };
        let look_up = (0..ROUNDS).map(|_| {
            let started = Instant::now();
            black_box(points.iter().filter(|&&p| cells.place_of(1.5 * p) == Place::Fluid).count());
            started.elapsed().as_secs_f64() / POINTS as f64
        });
        let look_up = look_up.fold(f64::INFINITY, f64::min);
        println!(
            "| {steps} | {:.1} | {:.2} | {} | {} | {:.1} |",
            1e3 * prepared,
            1e3 * best,
            map.restless(),
            cells.stats().near,
            1e9 * look_up
        );
    }
}

/// The best time of each solid, in ns per point.
fn compare(name: &str, solids: [&Solid; 2], question: impl Fn(&Solid)) {
    let mut best = [f64::INFINITY; 2];
    for _ in 0..ROUNDS {
        for (best, solid) in best.iter_mut().zip(solids) {
            let started = Instant::now();
            question(solid);
            *best = best.min(1e9 * started.elapsed().as_secs_f64() / POINTS as f64);
        }
    }
    println!("| {name} | {:.1} | {:.1} |", best[0], best[1]);
}

fn points() -> Vec<DVec3> {
    let mut seed = 3u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        2.0 * ((seed >> 11) as f64 / (1u64 << 53) as f64) - 1.0
    };
    (0..POINTS).map(|_| DVec3::new(random(), random(), random())).collect()
}
