//! The paper's figure 4 again: time of one step against the number of particles. `cargo bench --bench
//! figure4` prints a table and writes target/figure4.svg and target/figure4.png. It takes two minutes.
//!
//! The obstacle is the compiled pawn of examples/pawn.rfm. Two ways to have more particles:
//! - *table 1*: mass and support radius stay those of the paper, so the drop grows;
//! - *refined*: the drop stays and its particles shrink, as `-D particles=N` does.
//!
//! What is timed: windows of 8 whole steps, and the median of 5 to 25 windows. *Falling*: the first steps
//! after the start, each window from a fresh drop. *Settled*: after 1.2 s, when the fluid lies around the
//! pawn, where more particles touch something and each has fewer neighbours; only for N up to 10 000, so that
//! the bench stays short. Numbers of threads take turns, window by window. The fastest window stands beside
//! the median: where the two differ much, something else used the machine. Frames are not written.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rfm::lower::{Gravity, Scene};
use rfm::sph::{FluidBlock, Obstacle, Parameters, Simulation, Stats, carve};
use rfm::{Engine, Program, Solid, glam::DVec3};

#[path = "figure4/plot.rs"]
mod plot;

const COUNTS: [usize; 7] = [1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000];
const STEPS: u32 = 8;
const WINDOWS: std::ops::RangeInclusive<usize> = 5..=25;
/// No further window begins once all of a row have taken this long.
const PATIENCE: Duration = Duration::from_millis(1500);
const SETTLED_AFTER: f64 = 1.2;
const LARGEST_SETTLED: usize = 10_000;

/// The authors' published program, measured on another machine: N and ms per step. It finds 29 neighbours per
/// particle, rfm finds all that lie within the support radius.
const PAPERS_CODE: [(f64, f64); 2] = [(10_000.0, 27.0), (100_000.0, 738.0)];
const PAPERS_NEIGHBOURS: f64 = 29.0;

/// One line of the table.
struct Row {
    particles: usize,
    scene: &'static str,
    state: &'static str,
    threads: usize,
    neighbours: f64,
    milliseconds: f64,
    fastest: f64,
}

impl Row {
    fn nanoseconds_per_neighbour(&self) -> f64 {
        self.milliseconds * 1e6 / (self.particles as f64 * self.neighbours)
    }
}

fn main() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/pawn.rfm");
    let program = Program::from_path(file).unwrap_or_else(|e| panic!("{e}"));
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let all = pool(processors);
    let pools = if processors > 1 { vec![pool(1), pool(processors)] } else { vec![pool(1)] };
    let mut rows = Vec::new();
    println!("{}, {processors} threads\n", processor());
    println!(
        "| N | scene | state | neighbours | threads | ms per step | fastest | ns per particle·neighbour |"
    );
    println!("|--:|---|---|--:|--:|--:|--:|--:|");
    for count in COUNTS {
        for scene in ["table 1", "refined"] {
            if count == 10_000 && scene == "refined" {
                continue; // it is the same scene
            }
            let start = rows.len();
            run(&program, scene, count, &all, &pools, &mut rows);
            rows[start..].iter().for_each(print);
        }
    }
    for (particles, milliseconds) in PAPERS_CODE {
        let nanoseconds = milliseconds * 1e6 / (particles * PAPERS_NEIGHBOURS);
        println!(
            "| {particles} | the paper's own code | elsewhere | {PAPERS_NEIGHBOURS} | 1 | {milliseconds} | | {nanoseconds:.0} |"
        );
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target");
    let svg = plot::svg(&curves(&rows), &PAPERS_CODE);
    std::fs::write(folder.join("figure4.svg"), &svg).expect("target/ is writable");
    plot::write_png(&svg, &folder.join("figure4.png"));
    println!("\ndrawn in {}", folder.join("figure4.svg").display());
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started")
}

/// The rows *falling* and, if there are few enough particles, *settled*, with each pool.
fn run(
    program: &Program,
    name: &'static str,
    count: usize,
    all: &rayon::ThreadPool,
    pools: &[rayon::ThreadPool],
    rows: &mut Vec<Row>,
) {
    let refined = program.with("particles", count as f64).unwrap_or_else(|e| panic!("{e}"));
    let program = if name == "refined" { &refined } else { program };
    let scene = &program.module().scenes[0];
    let pawn = program.compile("pawn", scene.obstacles[0].shape, Engine::Auto).expect("the pawn compiles");
    let falling = || simulation(scene, &pawn, count);
    let times = medians(pools, |pool| {
        let mut simulation = falling();
        pool.install(|| (window(&mut simulation), simulation.stats()))
    });
    add(rows, count, name, "falling", pools, times);
    if count > LARGEST_SETTLED {
        return;
    }
    let mut settled = falling();
    all.install(|| {
        while settled.time() < SETTLED_AFTER {
            step(&mut settled);
        }
    });
    let times = medians(pools, |pool| pool.install(|| (window(&mut settled), settled.stats())));
    add(rows, count, name, "settled", pools, times);
}

fn add(
    rows: &mut Vec<Row>,
    particles: usize,
    scene: &'static str,
    state: &'static str,
    pools: &[rayon::ThreadPool],
    times: Vec<[f64; 3]>,
) {
    for (pool, [milliseconds, fastest, neighbours]) in pools.iter().zip(times) {
        let threads = pool.current_num_threads();
        rows.push(Row { particles, scene, state, threads, neighbours, milliseconds, fastest });
    }
}

/// For each pool, the median and the fastest of its windows in ms per step, and the mean number of
/// neighbours.
fn medians(
    pools: &[rayon::ThreadPool],
    mut window: impl FnMut(&rayon::ThreadPool) -> (f64, Stats),
) -> Vec<[f64; 3]> {
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); pools.len()];
    let mut neighbours = vec![0.0; pools.len()];
    let started = Instant::now();
    let mut windows = 0;
    while windows < *WINDOWS.start() || (windows < *WINDOWS.end() && started.elapsed() < PATIENCE) {
        for (i, pool) in pools.iter().enumerate() {
            let (milliseconds, stats) = window(pool);
            let wrong = [stats.inside, stats.lost, stats.non_finite];
            assert_eq!(wrong, [0; 3], "a run that is wrong is not fast");
            times[i].push(milliseconds);
            neighbours[i] += stats.neighbours_per_particle;
        }
        windows += 1;
    }
    let figures = |(mut times, neighbours): (Vec<f64>, f64)| {
        times.sort_unstable_by(f64::total_cmp);
        [times[times.len() / 2], times[0], neighbours / windows as f64]
    };
    times.into_iter().zip(neighbours).map(figures).collect()
}

/// Milliseconds per step of the next steps, after one step that wakes the pool's threads.
fn window(simulation: &mut Simulation) -> f64 {
    step(simulation);
    let started = Instant::now();
    (0..STEPS).for_each(|_| step(simulation));
    started.elapsed().as_secs_f64() * 1e3 / f64::from(STEPS)
}

/// The drop of the scene, around the scene's centre, with the wanted number of particles. What touches the
/// pawn is carved off.
fn simulation(scene: &Scene, pawn: &Solid, count: usize) -> Simulation {
    let Gravity::Still(gravity) = scene.gravity else { panic!("the scene has gravity that stays") };
    let mut parameters = Parameters {
        rest_density: scene.fluid.density,
        particle_mass: scene.fluid.mass,
        support_radius: scene.fluid.support_radius.unwrap_or(Parameters::paper().support_radius),
        viscosity: scene.fluid.viscosity,
        surface_tension: scene.fluid.surface_tension,
        method: scene.method,
        gravity,
        wall_restitution: scene.walls.restitution,
        time_step: 1.0,
        ..Parameters::paper()
    };
    let fall = (2.0 * gravity.length() * scene.domain.size().z).sqrt();
    parameters.time_step = parameters.stable_dt(fall);
    let radius = (0.75 / std::f64::consts::PI * count as f64).cbrt() * parameters.spacing();
    let top = scene.domain.max.z - parameters.spacing();
    let centre = DVec3::new(1.5, 1.5, 2.2f64.min(top - radius));
    let block = FluidBlock { jitter: scene.fluid.jitter, ..FluidBlock::drop(centre, count) };
    let mut particles = block.seed(&parameters, scene.domain).unwrap_or_else(|e| panic!("{e}"));
    let resolution = 0.05 * parameters.support_radius;
    let obstacles = vec![Obstacle {
        restitution: scene.obstacles[0].skin.bounce.restitution,
        ..Obstacle::at_rest(Arc::new(pawn.clone()), resolution)
    }];
    carve(&mut particles, &scene.domain, &obstacles, 0.5 * parameters.spacing())
        .unwrap_or_else(|e| panic!("{e}"));
    Simulation::new(parameters, particles, scene.domain, obstacles).unwrap_or_else(|e| panic!("{e}"))
}

fn step(simulation: &mut Simulation) {
    simulation.step().unwrap_or_else(|e| panic!("{e}"));
}

fn print(row: &Row) {
    println!(
        "| {} | {} | {} | {:.0} | {} | {:.2} | {:.2} | {:.1} |",
        row.particles,
        row.scene,
        row.state,
        row.neighbours,
        row.threads,
        row.milliseconds,
        row.fastest,
        row.nanoseconds_per_neighbour()
    );
}

/// The rows of table 1 as curves; those of the refined drop would lie on top of them.
fn curves(rows: &[Row]) -> Vec<plot::Curve> {
    let mut curves: Vec<plot::Curve> = Vec::new();
    let rows: Vec<&Row> = rows.iter().filter(|r| r.scene == "table 1").collect();
    for row in &rows {
        let neighbours = rows.iter().filter(|r| r.state == row.state).map(|r| r.neighbours);
        let (fewest, most) = neighbours.fold((f64::MAX, 0.0), |(a, b), n| (n.min(a), n.max(b)));
        let plural = if row.threads > 1 { "s" } else { "" };
        let (state, threads) = (row.state, row.threads);
        let name = format!("{state}, {threads} thread{plural}; {fewest:.0} to {most:.0} neighbours");
        let point = (row.particles as f64, row.milliseconds);
        match curves.iter_mut().find(|c| c.name == name) {
            Some(curve) => curve.points.push(point),
            None => curves.push(plot::Curve {
                name,
                points: vec![point],
                settled: row.state == "settled",
                single: row.threads == 1,
            }),
        }
    }
    curves
}

fn processor() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = cpu.lines().find_map(|line| line.strip_prefix("model name"));
    line.map_or_else(|| "unknown processor".into(), |name| name.trim_start_matches([' ', '\t', ':']).into())
}
