//! How long a swept contact takes, against sampling the path: `cargo bench --bench sweep`.
//!
//! Random paths in the pawn's box, on one thread, in portions of which the best of several passes counts, so
//! that a busy machine disturbs less. All ways take turns in one run. Sampling looks every 5 mm, a twentieth
//! of the paper's support radius, and misses what lies between two samples.

use std::hint::black_box;
use std::time::Instant;

use rfm::Program;
use rfm::field::{Closures, Path, Walls};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::solid::CellMap;

const PATHS: usize = 20_000;
const ROUNDS: usize = 15;

fn main() {
    let path = format!("{}/examples/pawn.rfm", env!("CARGO_MANIFEST_DIR"));
    let pawn =
        Program::from_path(path).and_then(|program| program.solid("pawn")).unwrap_or_else(|e| panic!("{e}"));
    let twin = pawn.twin();
    let sampled = Closures { omega: |p: DVec3| pawn.omega(p), gradient: |p: DVec3| pawn.omega_grad(p).1 };
    let domain = Aabb::new(DVec3::ZERO, DVec3::splat(3.0));
    let map = CellMap::new(&pawn, domain).unwrap_or_else(|| panic!("the pawn can be taken apart"));
    let ways: [(&str, &dyn Walls); 3] = [("swept", &twin), ("swept, cell map", &map), ("sampled", &sampled)];
    println!(
        "\npawn, {PATHS} paths, ns per path (best of {ROUNDS}); missed: hits that only the sweep finds\n"
    );
    println!("| step | way | all paths | hits alone | hits | missed |");
    println!("|--:|---|--:|--:|--:|--:|");
    for length in [0.001, 0.01, 0.1, 1.0] {
        let paths = paths(&domain, length, &pawn);
        let hits: Vec<Path> = paths.iter().filter(|path| twin.first_entry(path).is_some()).copied().collect();
        let mut times = [const { [const { Vec::new() }; 2] }; 3];
        for _ in 0..ROUNDS {
            for (times, (_, field)) in times.iter_mut().zip(&ways) {
                time(*field, &paths, &mut times[0]);
                time(*field, &hits, &mut times[1]);
            }
        }
        for (times, (way, field)) in times.iter().zip(&ways) {
            let found = hits.iter().filter(|path| field.first_entry(path).is_some()).count();
            let all = times[0].iter().sum::<f64>() / paths.len() as f64;
            let hit = times[1].iter().sum::<f64>() / hits.len().max(1) as f64;
            println!("| {length} | {way} | {all:.0} | {hit:.0} | {} | {} |", hits.len(), hits.len() - found);
        }
    }
}

/// Paths that begin in the fluid.
fn paths(domain: &Aabb, length: f64, solid: &dyn Walls) -> Vec<Path> {
    let mut seed = 3u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut vector = || DVec3::new(random(), random(), random());
    let mut paths = Vec::new();
    while paths.len() < PATHS {
        let from = domain.min + domain.size() * vector();
        let to = from + length * (2.0 * vector() - 1.0).normalize();
        if solid.omega(from) < 0.0 {
            paths.push(Path::new(from, to, 0.005));
        }
    }
    paths
}

/// Nanoseconds for each portion of the paths; the shortest time so far stays.
fn time(field: &dyn Walls, paths: &[Path], best: &mut Vec<f64>) {
    const PORTION: usize = 100;
    best.resize(paths.len().div_ceil(PORTION), f64::INFINITY);
    for (paths, best) in paths.chunks(PORTION).zip(best) {
        let started = Instant::now();
        for path in paths {
            black_box(field.first_entry(path));
        }
        *best = best.min(started.elapsed().as_secs_f64() * 1e9);
    }
}
