//! What a cell map costs, for sign and contact at random points: `cargo bench --bench cells`.
//!
//! Unions of balls in [0, 3]³, whose volume is the same for any number of them, on one thread. The points are
//! taken in portions, and the best of several passes counts for each, so that a busy machine disturbs less.
//! The solid itself evaluates every leaf at every point, so it is asked for fewer points in the same run.

use std::fmt::Write;
use std::hint::black_box;
use std::time::Instant;

use rfm::field::Points;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::solid::{CellMap, Place};
use rfm::{Program, Solid};

const POINTS: usize = 100_000;
const ROUNDS: usize = 25;
/// Points of one portion: a few tens of microseconds.
const PORTION: usize = 4_000;

fn main() {
    let mut random = Random(1);
    let points: [Vec<f64>; 3] = std::array::from_fn(|_| (0..POINTS).map(|_| 3.0 * random.unit()).collect());
    let all = Points::new(&points[0], &points[1], &points[2]);
    let domain = Aabb::new(DVec3::ZERO, DVec3::splat(3.0));
    println!("\nrandom points in [0, 3]³, ns per point (best of {ROUNDS})\n");
    println!(
        "| balls | reach | build, ms | near, % | leaves per near cell | sign | contact | all leaves: sign | contact |"
    );
    println!("|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for balls in [500, 10_000] {
        let solid = union(balls);
        // each pass over all leaves takes some milliseconds
        let few = if balls > 1_000 { 20 } else { 400 };
        let mut sign = vec![0.0; few];
        let plain_sign = best(few, few, 9, &mut |i, n| {
            let part = [&points[0][i..i + n], &points[1][i..i + n], &points[2][i..i + n]];
            solid.twin_many(part, &mut sign[..n]);
        });
        let mut columns: [Vec<f64>; 5] = std::array::from_fn(|_| vec![0.0; few]);
        let plain_contact = best(few, few, 9, &mut |i, n| {
            let part = [&points[0][i..i + n], &points[1][i..i + n], &points[2][i..i + n]];
            solid.contact_many(part, columns.each_mut().map(|c| &mut c[..n]));
        });
        for reach in [0.0, 0.01, 0.03] {
            let started = Instant::now();
            let map = CellMap::with_reach(&solid, domain, reach)
                .unwrap_or_else(|| panic!("balls can be taken apart"));
            let build = started.elapsed().as_secs_f64() * 1e3;
            let near = (0..POINTS).filter(|&i| map.place_of(all.get(i)) == Place::Near).count();
            let part = |i: usize, n: usize| Points::new(&all.x[i..i + n], &all.y[i..i + n], &all.z[i..i + n]);
            let mut signs = vec![0.0; PORTION];
            let sign = best(POINTS, PORTION, ROUNDS, &mut |i, n| map.sign_many(part(i, n), &mut signs[..n]));
            let mut columns: [Vec<f64>; 5] = std::array::from_fn(|_| vec![0.0; PORTION]);
            let contact = best(POINTS, PORTION, ROUNDS, &mut |i, n| {
                map.contact_many(part(i, n), columns.each_mut().map(|c| &mut c[..n]));
            });
            let stats = map.stats();
            println!(
                "| {balls} | {reach} | {build:.0} | {:.1} | {:.1} | {sign:.1} | {contact:.1} | {plain_sign:.0} | \
                 {plain_contact:.0} |",
                100.0 * near as f64 / POINTS as f64,
                stats.leaves_in_cells as f64 / stats.near as f64,
            );
            black_box((&signs, &columns));
        }
    }
}

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn union(balls: usize) -> Solid {
    let mut random = Random(7);
    let mut text = "rfm 1\nsolid s = sphere(0.01)".to_string();
    for _ in 0..balls {
        let [x, y, z] = std::array::from_fn(|_| 0.2 + 2.6 * random.unit());
        let r = 0.9 * (0.05 + 0.05 * random.unit()) * (500.0 / balls as f64).cbrt();
        let _ = write!(text, "\n or ball([{x}, {y}, {z}], {r})");
    }
    let program = Program::from_source("balls.rfm", text + "\n");
    program.and_then(|program| program.solid("s")).unwrap_or_else(|e| panic!("{e}"))
}

/// Nanoseconds per point. The pass receives the beginning and the length of a portion.
fn best(points: usize, portion: usize, rounds: usize, pass: &mut dyn FnMut(usize, usize)) -> f64 {
    let mut best = vec![f64::INFINITY; points.div_ceil(portion)];
    for _ in 0..=rounds {
        for (k, best) in best.iter_mut().enumerate() {
            let first = k * portion;
            let started = Instant::now();
            pass(first, portion.min(points - first));
            *best = best.min(started.elapsed().as_secs_f64() * 1e9);
        }
    }
    best.iter().sum::<f64>() / points as f64
}
