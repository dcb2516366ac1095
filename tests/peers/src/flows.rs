//! Cost of a step in a dam break by rfm and by salva3d, each on one thread, in turns.
//!
//! A column of water of 1 m × 3 m × 1.5 m stands in the box [0, 3]³, just like in `tests/bench/sph.rs`. Both
//! solvers share the lattice, a support radius of two spacings (salva3d's own) and steps of one fixed length.
//! salva3d keeps its water in by one layer of particles on the floor and the four walls; rfm needs none. Both
//! solve for the pressure (DFSPH) to 0.1 %.
//!
//! Times are processor times of all threads of the process together.

use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::sph::{Dfsph, FluidBlock, FluidShape, Method, Parameters, Precision, Simulation, Wcsph};
use salva3d::LiquidWorld;
use salva3d::math::Vector;
use salva3d::object::{Boundary, Fluid, interaction_groups::InteractionGroups};
use salva3d::solver::{DFSPHSolver, DfsphParameters};

const BOX: Aabb = Aabb::new(DVec3::ZERO, DVec3::splat(3.0));
const COLUMN: Aabb = Aabb::new(DVec3::ZERO, DVec3::new(1.0, 3.0, 1.5));

/// Support radii per spacing.
const SUPPORT: f64 = 2.0;

/// Mean compression that both accept.
const TOLERANCE: f64 = 1e-3;

/// Time step as a fraction of the time that water fallen from the column's top needs to pass one spacing.
const COURANT: f64 = 0.4;

/// Number of turns whose median counts, and least duration in seconds of one of rfm's turns.
const TURNS: usize = 5;
const TURN: f64 = 0.3;

/// One solver at work.
struct Row {
    name: &'static str,
    step: Box<dyn FnMut()>,
    /// Ordered pairs of fluid particles within the support radius, at the end.
    pairs: Box<dyn Fn() -> f64>,
    particles: usize,
    others: usize,
    /// Time of a step in each turn, s.
    times: Vec<f64>,
}

/// Measures and prints a table.
pub fn run() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    println!(
        "| solver | particles | on walls | step, ms | ms per step | ns per particle·neighbour | / rfm dfsph |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|");
    for particles in [10_000, 105_000] {
        let spacing = (COLUMN.volume() / particles as f64).cbrt();
        let dt = COURANT * spacing / (2.0 * 9.81 * COLUMN.size().z).sqrt();
        pool.install(|| {
            let mut rows = vec![
                ours("rfm dfsph, f32", spacing, dt, dfsph(), Precision::F32),
                ours("rfm dfsph, f64", spacing, dt, dfsph(), Precision::F64),
                salva(spacing, dt),
                ours("rfm wcsph, f32", spacing, f64::INFINITY, wcsph(), Precision::F32),
            ];
            measure(&mut rows);
            print(&rows, dt);
        });
    }
}

fn dfsph() -> Method {
    Method::Dfsph(Dfsph { tolerance: TOLERANCE, ..Dfsph::default() })
}

fn wcsph() -> Method {
    let sound_speed = 10.0 * (2.0 * 9.81 * COLUMN.size().z).sqrt();
    Method::Wcsph(Wcsph { sound_speed: Some(sound_speed), ..Wcsph::default() })
}

/// Sets up rfm with steps of length `dt`, or of the length that the sound speed allows if `dt` is infinite.
fn ours(name: &'static str, spacing: f64, dt: f64, method: Method, precision: Precision) -> Row {
    let parameters = Parameters {
        rest_density: 1000.0,
        particle_mass: 1000.0 * spacing.powi(3),
        support_radius: SUPPORT * spacing,
        viscosity: 0.0,
        surface_tension: 0.0,
        precision,
        adaptive: dt.is_infinite(),
        time_step: dt.min(1.0),
        ..Parameters::of(method, spacing)
    };
    let fluid = FluidBlock::filling(FluidShape::Box(COLUMN)).seed(&parameters, BOX).expect("room");
    let particles = fluid.len();
    let simulation = Simulation::new(parameters, fluid, BOX, Vec::new()).expect("a sound scene");
    let shared = std::rc::Rc::new(std::cell::RefCell::new(simulation));
    let of_pairs = std::rc::Rc::clone(&shared);
    Row {
        name,
        step: Box::new(move || shared.borrow_mut().step().expect("finite numbers")),
        pairs: Box::new(move || of_pairs.borrow().pairs() as f64),
        particles,
        others: 0,
        times: Vec::new(),
    }
}

fn salva(spacing: f64, dt: f64) -> Row {
    let parameters = DfsphParameters {
        max_density_error: TOLERANCE as f32,
        // This error is a percentage per step.
        max_divergence_error: 100.0 * TOLERANCE as f32,
        ..DfsphParameters::default()
    };
    let solver: DFSPHSolver = DFSPHSolver::with_parameters(parameters);
    let radius = 0.5 * spacing as f32;
    let mut world = LiquidWorld::new(solver, radius, SUPPORT as f32, 1.0);
    let lattice = lattice(spacing);
    let particles = lattice.len();
    let everything = InteractionGroups::default();
    let handle = world.add_fluid(Fluid::new(lattice, radius, 1000.0, everything));
    let walls = walls(spacing);
    let others = walls.len();
    world.add_boundary(Boundary::new(walls, everything));
    let gravity = Vector::new(0.0, 0.0, -9.81);
    let shared = std::rc::Rc::new(std::cell::RefCell::new(world));
    let of_pairs = std::rc::Rc::clone(&shared);
    Row {
        name: "salva3d 0.11 DFSPH, f32",
        step: Box::new(move || shared.borrow_mut().step(dt as f32, &gravity)),
        pairs: Box::new(move || {
            let world = of_pairs.borrow();
            let fluid = world.fluids().get(handle).expect("the fluid");
            neighbours(&fluid.positions, world.h())
        }),
        particles,
        others,
        times: Vec::new(),
    }
}

/// Middles of the cells of a column of cubes, where rfm puts its particles.
fn lattice(spacing: f64) -> Vec<Vector<f32>> {
    let parameters =
        Parameters { rest_density: 1000.0, particle_mass: 1000.0 * spacing.powi(3), ..Parameters::paper() };
    let fluid = FluidBlock::filling(FluidShape::Box(COLUMN)).seed(&parameters, BOX).expect("room");
    fluid.position.iter().map(|p| Vector::new(p.x as f32, p.y as f32, p.z as f32)).collect()
}

/// One layer of particles, half a spacing behind the floor and the four walls.
fn walls(spacing: f64) -> Vec<Vector<f32>> {
    let side = (3.0 / spacing).round() as i32;
    let at = |k: i32| ((f64::from(k) + 0.5) * spacing) as f32;
    let mut walls = Vec::new();
    for i in -1..=side {
        for j in -1..=side {
            walls.push(Vector::new(at(i), at(j), at(-1)));
            let is_wall = i == -1 || i == side || j == -1 || j == side;
            walls.extend((0..side).filter(|_| is_wall).map(|k| Vector::new(at(i), at(j), at(k))));
        }
    }
    walls
}

/// Number of ordered pairs within a distance, found by a grid of that size.
fn neighbours(points: &[Vector<f32>], reach: f32) -> f64 {
    let cell = |p: &Vector<f32>| [p.x, p.y, p.z].map(|c| (c / reach).floor() as i32);
    let mut cells: std::collections::HashMap<[i32; 3], Vec<usize>> = std::collections::HashMap::new();
    for (i, point) in points.iter().enumerate() {
        cells.entry(cell(point)).or_default().push(i);
    }
    let around = || (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k])));
    let mut pairs = 0;
    for point in points {
        let own = cell(point);
        for offset in around() {
            let there = cells.get(&[0, 1, 2].map(|axis| own[axis] + offset[axis]));
            pairs += there.map_or(0, |list| {
                list.iter().filter(|&&j| (points[j] - point).norm_squared() < reach * reach).count()
            });
        }
    }
    (pairs - points.len()) as f64
}

/// Runs all solvers in turns. Each takes as many steps per turn as the first needs to fill one.
fn measure(rows: &mut [Row]) {
    for row in rows.iter_mut() {
        (0..3).for_each(|_| (row.step)());
    }
    let started = processor();
    (0..3).for_each(|_| (rows[0].step)());
    let steps = (3.0 * TURN / (processor() - started)).ceil().max(1.0) as u32;
    for _ in 0..TURNS {
        for row in rows.iter_mut() {
            let started = processor();
            (0..steps).for_each(|_| (row.step)());
            row.times.push((processor() - started) / f64::from(steps));
        }
    }
}

fn print(rows: &[Row], dt: f64) {
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    for row in rows {
        let quotients = row.times.iter().zip(&rows[0].times).map(|(own, first)| own / first).collect();
        let seconds = median(row.times.clone());
        let step = if row.name.contains("wcsph") { "adaptive".into() } else { format!("{:.2}", 1e3 * dt) };
        println!(
            "| {} | {} | {} | {step} | {:.2} | {:.1} | {:.2} |",
            row.name,
            row.particles,
            row.others,
            1e3 * seconds,
            1e9 * seconds / (row.pairs)(),
            median(quotients)
        );
    }
}

/// Seconds that all threads of the process have spent on processors.
fn processor() -> f64 {
    let spent = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    spent.tv_sec as f64 + 1e-9 * spent.tv_nsec as f64
}
