//! Cost of a time step: `cargo bench --bench sph`. It asserts nothing about time.
//!
//! The benchmark measures time per particle and neighbour, by method and precision, for a dam that breaks in
//! the box [0, 3]³; a column of water fills a third of the floor. It compares one thread with two. It finds
//! the share of walls and contact in a pool around a pawn and in one around 500 posts, and the time to
//! prepare a pawn until a fluid can meet it. `-- --million` adds a million particles, and `-- --only PART`
//! runs one part alone (methods, threads, walls).
//!
//! Times are processor times of all threads of the process together if the system provides them (Unix), else
//! times of the clock. A repetition takes as many steps as last a quarter of a second. The tables show the
//! median of the repetitions, and the least.

use std::sync::Arc;
use std::time::Instant;

use rfm::field::{Faces, Part, Walls};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::sph::{
    Dfsph, FluidBlock, FluidShape, Gradients, Method, Obstacle, Paper, Parameters, Particles, Precision,
    Simulation, Wcsph, carve,
};
use rfm::{Engine, Program};

const BOX: Aabb = Aabb::new(DVec3::ZERO, DVec3::splat(3.0));

/// Length of a repetition in seconds, and the number of repetitions.
const REPETITION: f64 = 0.25;
const REPETITIONS: usize = 7;

/// Support radii per spacing: 74 neighbours, as scenes with differences of pressure have them, or 45 if
/// pressure is solved for. (With pairs of pressures scenes have 113.)
fn support(method: Method) -> f64 {
    if matches!(method, Method::Dfsph(_)) { 2.2 } else { 2.6 }
}

fn wcsph(gradients: Gradients) -> Method {
    Method::Wcsph(Wcsph {
        sound_speed: Some(10.0 * (9.81f64 * 2.0 * 1.5).sqrt()),
        gradients: Some(gradients),
        ..Wcsph::default()
    })
}

/// Column of water, 1 m wide, 3 m deep and 1.5 m high.
const COLUMN: Aabb = Aabb::new(DVec3::ZERO, DVec3::new(1.0, 3.0, 1.5));

/// Pool with an equal volume of water, half a metre deep.
const POOL: Aabb = Aabb::new(DVec3::ZERO, DVec3::new(3.0, 3.0, 0.5));

fn parameters(particles: usize, method: Method, precision: Precision) -> Parameters {
    let spacing = (COLUMN.volume() / particles as f64).cbrt();
    Parameters {
        rest_density: 1000.0,
        particle_mass: 1000.0 * spacing.powi(3),
        support_radius: support(method) * spacing,
        viscosity: 0.0,
        surface_tension: 0.0,
        precision,
        adaptive: true,
        time_step: 1.0,
        ..Parameters::of(method, spacing)
    }
}

fn dam_break(particles: usize, method: Method, precision: Precision) -> Simulation {
    let parameters = parameters(particles, method, precision);
    let fluid = FluidBlock::filling(FluidShape::Box(COLUMN)).seed(&parameters, BOX).unwrap();
    Simulation::new(parameters, fluid, BOX, Vec::new()).unwrap()
}

/// Seconds that all threads of the process have spent on processors.
fn processor() -> f64 {
    #[cfg(unix)]
    {
        let spent = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        spent.tv_sec as f64 + 1e-9 * spent.tv_nsec as f64
    }
    #[cfg(not(unix))]
    {
        static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
        START.elapsed().as_secs_f64()
    }
}

/// Number of steps that last about a repetition, found after a few that fill the buffers.
fn steps_per_repetition(simulation: &mut Simulation) -> u32 {
    let started = processor();
    for _ in 0..4 {
        simulation.step().unwrap();
    }
    (4.0 * REPETITION / (processor() - started)).ceil().clamp(1.0, 1e4) as u32
}

/// Processor time of one step, s.
fn seconds_per_step(simulation: &mut Simulation, steps: u32) -> f64 {
    let started = processor();
    for _ in 0..steps {
        simulation.step().unwrap();
    }
    (processor() - started) / f64::from(steps)
}

/// Median and least value.
fn middle(mut values: Vec<f64>) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    (values[values.len() / 2], values[0])
}

fn head() {
    println!(
        "| method | precision | particles | neighbours | ms per step | ns per particle·neighbour | iterations | CPU s/s | bytes per particle |"
    );
    println!("|---|---|--:|--:|--:|--:|--:|--:|--:|");
}

/// Prints one row of the methods' table.
fn row(name: &str, particles: usize, method: Method, precision: Precision) {
    let mut simulation = dam_break(particles, method, precision);
    let steps = steps_per_repetition(&mut simulation);
    let (started, mut iterations) = (simulation.time(), 0.0);
    let mut times = Vec::new();
    for _ in 0..REPETITIONS {
        times.push(seconds_per_step(&mut simulation, steps));
        iterations += f64::from(simulation.iterations().unwrap_or(0)) / REPETITIONS as f64;
    }
    let simulated = (simulation.time() - started) / f64::from(steps * REPETITIONS as u32);
    let (median, least) = middle(times);
    let n = simulation.particles().len() as f64;
    let neighbours = simulation.pairs() as f64 / n;
    let iterated = if iterations > 0.0 { format!("{iterations:.1}") } else { "–".into() };
    println!(
        "| {name} | {} | {n} | {neighbours:.0} | {:.2} ({:.2}) | {:.2} | {iterated} | {:.1} | {:.0} |",
        precision.name(),
        1e3 * median,
        1e3 * least,
        1e9 * median / (n * neighbours),
        median / simulated,
        simulation.bytes() as f64 / n
    );
}

fn methods(sizes: &[usize]) {
    println!(
        "\nOne thread. ms per step: median (least); CPU s/s: of the processor per second of the simulation.\n"
    );
    head();
    let dfsph = |tolerance| Method::Dfsph(Dfsph { tolerance, ..Dfsph::default() });
    for &particles in sizes {
        for (name, method) in [
            ("wcsph", wcsph(Gradients::Pairs)),
            ("wcsph, differences", wcsph(Gradients::Differences)),
            ("dfsph, 0.1 %", dfsph(1e-3)),
            ("dfsph, 0.01 %", dfsph(1e-4)),
            ("paper", Paper::default().into()),
        ] {
            for precision in [Precision::F32, Precision::F64] {
                row(name, particles, method, precision);
            }
        }
    }
}

/// Clock time on one thread over that on two. They take turns, so that other work of the machine slows both.
fn threads(sizes: &[usize]) {
    println!("\nwcsph in f32 on one thread and on two, by the clock, in turns.\n");
    println!("| particles | ms on one | ms on two | quotient |");
    println!("|--:|--:|--:|--:|");
    let pools = [1, 2].map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap());
    for &particles in sizes {
        let mut simulation = dam_break(particles, wcsph(Gradients::Pairs), Precision::F32);
        let steps = steps_per_repetition(&mut simulation);
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..REPETITIONS {
            for (pool, times) in pools.iter().zip(&mut times) {
                let started = Instant::now();
                pool.install(|| (0..steps).for_each(|_| simulation.step().unwrap()));
                times.push(started.elapsed().as_secs_f64() / f64::from(steps));
            }
        }
        let quotients = times[0].iter().zip(&times[1]).map(|(one, two)| one / two).collect();
        let [one, two] = times.map(|times| middle(times).0);
        println!(
            "| {} | {:.2} | {:.2} | {:.2} |",
            simulation.particles().len(),
            1e3 * one,
            1e3 * two,
            middle(quotients).0
        );
    }
}

const PAWN: &str = include_str!("../../examples/pawn.rfm");

/// Posts in 25 rows of 20, thinner than the support radius and higher than the pool.
const POSTS: &str = "rfm 1
solid posts = any i in 0..25: any j in 0..20: cylinder(0.02, 0.8).move([0.06 + 0.12*i, 0.075 + 0.15*j, 0])
";

/// Share of walls and contact in a step. One state steps on with the obstacle, without it, and without it in
/// a box whose walls are far away, in turns.
fn walls(particles: usize) {
    println!(
        "\nWalls and contact: a pool 0.5 m deep in the box [0, 3]³, wcsph in f32, one thread, ms per step.\n"
    );
    println!(
        "| obstacle | particles | of them near it | with it | without it | without any wall | obstacle's part | all walls' part | ns per near particle |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|");
    for (name, text, solid) in [("pawn", PAWN, "pawn"), ("500 posts", POSTS, "posts")] {
        let parameters = parameters(particles, wcsph(Gradients::Pairs), Precision::F32);
        let field = obstacle(text, solid, parameters.support_radius);
        let obstacle = || Obstacle::at_rest(field.clone(), 0.05 * parameters.support_radius);
        let mut fluid = FluidBlock::filling(FluidShape::Box(POOL)).seed(&parameters, BOX).unwrap();
        carve(&mut fluid, &BOX, &[obstacle()], 0.25 * parameters.spacing()).unwrap();
        let new = |fluid: &Particles, domain, obstacles| {
            Simulation::new(parameters.clone(), fluid.clone(), domain, obstacles).unwrap()
        };
        // These steps let the lattice give way, so that the fluid leans on the obstacle.
        let mut settled = new(&fluid, BOX, vec![obstacle()]);
        (0..SETTLED).for_each(|_| settled.step().unwrap());
        let state = settled.particles();
        let steps = steps_per_repetition(&mut new(state, BOX, vec![obstacle()]));
        let mut times = [const { Vec::new() }; 3];
        for _ in 0..REPETITIONS {
            let cases = [(BOX, vec![obstacle()]), (BOX, vec![]), (BOX.grown(100.0), vec![])];
            for ((domain, obstacles), times) in cases.into_iter().zip(&mut times) {
                let mut simulation = new(state, domain, obstacles);
                simulation.step().unwrap(); // The first step fills the buffers.
                times.push(seconds_per_step(&mut simulation, steps));
            }
        }
        // Quotients are taken turn by turn, because a machine that slows down in between slows all three.
        let part = |without: usize| {
            let parts = times[0].iter().zip(&times[without]).map(|(all, rest)| 100.0 * (1.0 - rest / all));
            middle(parts.collect()).0
        };
        let (of_obstacle, of_walls) = (part(1), part(2));
        let near = state.position.iter().filter(|&p| is_near(&*field, p, parameters.support_radius)).count();
        let [with, without, free] = times.map(|times| 1e3 * middle(times).0);
        println!(
            "| {name} | {} | {near} | {with:.2} | {without:.2} | {free:.2} | {of_obstacle:.1} % | {of_walls:.1} % | {:.0} |",
            state.len(),
            1e6 * (with - without) / near as f64
        );
    }
    set_up(parameters(particles, wcsph(Gradients::Pairs), Precision::F32).support_radius);
}

/// Whether a part of the surface lies within reach.
fn is_near(field: &dyn Walls, p: DVec3, reach: f64) -> bool {
    let mut faces = Faces::new();
    field.faces(p, reach, &mut faces);
    faces.iter().any(|part| matches!(part, Part::Face(face) if face.distance < reach))
}

/// Steps before walls are measured.
const SETTLED: usize = 150;

fn obstacle(text: &str, solid: &str, reach: f64) -> Arc<dyn Walls> {
    let program = Program::from_source("obstacle.rfm", text).unwrap();
    program.solid_with(solid, Engine::Auto).unwrap().walls(BOX, reach).into()
}

/// Measures the time from the text of a pawn to the first contact with it.
fn set_up(reach: f64) {
    let times = (0..3 * REPETITIONS).map(|_| {
        let started = processor();
        let field = obstacle(PAWN, "pawn", reach);
        std::hint::black_box(field.omega_grad(DVec3::new(1.0, 1.5, 0.5)));
        1e3 * (processor() - started)
    });
    let (median, least) = middle(times.collect());
    println!(
        "\nSet-up of the pawn, from its text, for a reach of {reach:.3} m: {median:.1} ms ({least:.1})."
    );
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let million = arguments.iter().any(|argument| argument == "--million");
    let only = arguments.iter().position(|argument| argument == "--only").and_then(|i| arguments.get(i + 1));
    let asked = |part: &str| only.is_none_or(|only| part.contains(only.as_str()));
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    if asked("methods") {
        one.install(|| methods(&[10_000, 105_000]));
    }
    if asked("threads") {
        threads(&[105_000]);
    }
    if asked("walls") {
        one.install(|| walls(105_000));
    }
    if million {
        println!("\nA million, beside a hundred thousand of the same run.\n");
        head();
        one.install(|| {
            for particles in [105_000, 1_000_000] {
                row("wcsph", particles, wcsph(Gradients::Pairs), Precision::F32);
            }
        });
        threads(&[1_000_000]);
    }
}
