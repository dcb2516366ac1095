//! How long marching cubes and dual contouring take, how that grows with the grid, and how far the meshes are
//! from the surface. `cargo bench --bench mesh` prints all tables, `-- methods` or `-- growth` one of them,
//! and `-- --large` 2048 cells too. It asserts nothing about time.
//!
//! Pawn and bishop stand in the box [0, 3]³, as in the paper; the balls are 500 at random places. The fastest
//! of several runs counts, and runs on one thread and on all take turns. Where the system provides it
//! (Linux), the processor time of one thread stands beside it; other programs hardly disturb that. What a
//! solid prepares once (machine code, cell map) is timed separately. The exponent is that of the
//! least-squares line through log time on one thread against log cells.

use std::fmt::Write;
use std::time::{Duration, Instant};

use rfm::field::Field;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::mesh::{Grid, Mesh, Resolution, Unwatched, check, dual_contouring, marching_cubes, measure};
use rfm::solid::Depth;
use rfm::{Engine, Program, Solid};

/// True volumes by quadrature of the profiles, independent of this program.
const VOLUMES: [(&str, f64); 2] = [("pawn", 0.442701), ("bishop", 0.601689)];

/// No further run begins once all of a size have taken this long.
const PATIENCE: Duration = Duration::from_millis(3000);
const RUNS: usize = 100;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let is_wanted = |part: &str| {
        arguments.iter().all(|argument| argument.starts_with("--")) || arguments.iter().any(|a| a == part)
    };
    if is_wanted("methods") {
        methods();
    }
    if is_wanted("growth") {
        growth(arguments.iter().any(|argument| argument == "--large"));
    }
}

fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn example(name: &str) -> Solid {
    let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
    let program = Program::from_path(path.as_str()).unwrap_or_else(|e| panic!("{e}"));
    program.solid_with(name, Engine::Jit).unwrap_or_else(|e| panic!("{e}"))
}

fn filling(cells: usize) -> Grid {
    Grid::filling(&domain(), Resolution::Cells(cells)).unwrap_or_else(|e| panic!("{e}"))
}

/// A way to make a mesh.
type Method = (&'static str, fn(&dyn Field, &Grid) -> Mesh);

const METHODS: [Method; 2] = [("mc", cubes), ("dc", dual)];

fn cubes(field: &dyn Field, grid: &Grid) -> Mesh {
    marching_cubes(field, grid, &Unwatched).unwrap_or_else(|e| panic!("{e}"))
}

fn dual(field: &dyn Field, grid: &Grid) -> Mesh {
    dual_contouring(field, grid, &Unwatched).unwrap_or_else(|e| panic!("{e}"))
}

/// Both methods side by side: time, and the quality of the mesh. To choose between them, look at the last
/// column but one, the error times the time in µm·s: halving the cells of either method leaves it about as it
/// is.
fn methods() {
    println!(
        "| solid | cells | method | 1 thread, ms | {} threads, ms | triangles | Hausdorff distance, m | surface to mesh, rms m | volume error | upside down | slivers | error × time, µm·s | closed |",
        processors()
    );
    println!("|---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|");
    let pools = pools();
    for (name, volume) in VOLUMES {
        let solid = example(name);
        let field = solid.surface(domain());
        for cells in [16, 32, 64, 128, 256, 512] {
            let grid = filling(cells);
            let mut fastest = [[f64::INFINITY; 2]; METHODS.len()];
            let started = Instant::now();
            for _ in 0..RUNS {
                for ((_, method), fastest) in METHODS.iter().zip(&mut fastest) {
                    for (pool, fastest) in pools.iter().zip(fastest) {
                        let start = Instant::now();
                        let made = pool.install(|| method(&*field, &grid));
                        *fastest = fastest.min(start.elapsed().as_secs_f64());
                        drop(made);
                    }
                }
                if started.elapsed() > PATIENCE {
                    break;
                }
            }
            for ((method, mesh), [one, all]) in METHODS.iter().zip(fastest) {
                let found = mesh(&*field, &grid);
                let quality =
                    measure(&found, &*field, &Depth(&solid), &grid).unwrap_or_else(|e| panic!("{e}"));
                let report = check(&found, &*field);
                println!(
                    "| {name} | {cells} | {method} | {:.2} | {:.2} | {} | {:.2e} | {:.2e} | {:+.4} % | {} | {:.2} % | {:.3} | {} |",
                    1e3 * one,
                    1e3 * all,
                    found.triangles.len(),
                    quality.hausdorff(),
                    quality.from_surface.rms,
                    100.0 * (found_volume(&found) / volume - 1.0),
                    quality.flipped,
                    100.0 * quality.slivers,
                    1e6 * quality.hausdorff() * one,
                    if report.closed && report.manifold { "yes" } else { "NO" },
                );
            }
        }
    }
}

/// One thread, and all.
fn pools() -> [rayon::ThreadPool; 2] {
    [1, processors()].map(|threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap_or_else(|e| panic!("{e}"))
    })
}

fn growth(large: bool) {
    let processors = processors();
    let mut sizes = vec![64, 128, 256, 512, 1024];
    if large {
        sizes.push(2048);
    }
    println!(
        "| solid | cells | 1 thread, ms | of which on the processor | {processors} threads, ms | ratio | triangles | evaluations per vertex | volume error | MiB |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for (name, volume) in VOLUMES {
        let solid = example(name);
        let mut points = Vec::new();
        for &cells in &sizes {
            let (seconds, _) = row(name, &solid, cells, Some(volume));
            points.push((cells as f64, seconds));
        }
        println!("{name}: time grows as cells^{:.2}", exponent(&points));
    }
    let solid = balls(500);
    let started = Instant::now();
    drop(solid.surface(domain()));
    println!("500 balls: programs and cell map {:.1} ms", 1e3 * started.elapsed().as_secs_f64());
    for cells in [128, 256, 512] {
        let (_, mesh) = row("500 balls", &solid, cells, None);
        let report = check(&mesh, &*solid.surface(domain()));
        println!(
            "closed {}, manifold {}, {} solids, Euler characteristic {}",
            report.closed, report.manifold, report.solids, report.euler
        );
    }
}

/// Measures and prints one line; returns the processor's seconds of one thread, and the mesh.
fn row(name: &str, solid: &Solid, cells: usize, volume: Option<f64>) -> (f64, Mesh) {
    let grid = filling(cells);
    let field = solid.surface(domain());
    let pools = pools();
    let mut fastest = [f64::INFINITY; 2];
    let (mut on_processor, mut runs) = (0.0, 0_u32);
    let mut found = Mesh::default();
    let started = Instant::now();
    for _ in 0..RUNS {
        for (pool, fastest) in pools.iter().zip(&mut fastest) {
            let start = Instant::now();
            let (made, spent) = pool.install(|| {
                let before = processor_time();
                let made = cubes(&*field, &grid);
                (made, processor_time().zip(before).map(|(after, before)| after - before))
            });
            let elapsed = start.elapsed().as_secs_f64();
            found = made;
            *fastest = fastest.min(elapsed);
            if pool.current_num_threads() == 1 {
                on_processor += spent.unwrap_or(elapsed);
                runs += 1;
            }
        }
        if started.elapsed() > PATIENCE {
            break;
        }
    }
    let error = volume
        .map_or(String::new(), |truth| format!("{:+.4} %", 100.0 * (found_volume(&found) / truth - 1.0)));
    // the system counts in ticks of some milliseconds: only the mean of many runs means anything
    let mean = on_processor / f64::from(runs);
    println!(
        "| {name} | {cells} | {:.2} | {:.2} | {:.2} | {:.2} | {} | {:.2} | {error} | {} |",
        1e3 * fastest[0],
        1e3 * mean,
        1e3 * fastest[1],
        fastest[0] / fastest[1],
        found.triangles.len(),
        found.work.evaluations as f64 / found.positions.len().max(1) as f64,
        peak_memory(),
    );
    (fastest[0], found)
}

fn domain() -> Aabb {
    Aabb::new(DVec3::ZERO, DVec3::splat(3.0))
}

/// Divergence theorem over the triangles.
fn found_volume(mesh: &Mesh) -> f64 {
    let corners = mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize] - DVec3::splat(1.5)));
    corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

/// Seconds that this thread has run, without waiting; `None` where the system does not provide it.
fn processor_time() -> Option<f64> {
    let line = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    line.split(' ').next()?.parse::<f64>().ok().map(|nanoseconds| 1e-9 * nanoseconds)
}

/// The most memory that this process has used, in MiB; zero where the system does not provide it.
fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches(" kB").parse::<u64>().ok()).unwrap_or(0) / 1024
}

fn exponent(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(n, t)| (n.ln(), t.ln())).collect();
    let count = logs.len() as f64;
    let (mx, my) = logs.iter().fold((0.0, 0.0), |(mx, my), (x, y)| (mx + x / count, my + y / count));
    let (up, down) = logs
        .iter()
        .fold((0.0, 0.0), |(up, down), (x, y)| (up + (x - mx) * (y - my), down + (x - mx) * (x - mx)));
    up / down
}

fn balls(count: usize) -> Solid {
    let mut state = 11_u64;
    let mut unit = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut text = "rfm 1\nsolid balls = ball([1.5, 1.5, 1.5], 0.1)".to_string();
    for _ in 1..count {
        let [x, y, z] = [(); 3].map(|()| 0.2 + 2.6 * unit());
        let _ = write!(text, "\n or ball([{x}, {y}, {z}], {})", 0.05 + 0.05 * unit());
    }
    let program = Program::from_source("balls.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    program.solid_with("balls", Engine::Jit).unwrap_or_else(|e| panic!("{e}"))
}
