//! What a step costs per particle and neighbour, by method and precision: `cargo bench --bench sph`. A dam breaks in the
//! box [0, 3]³: a column of water fills a third of the floor. Asserts nothing about time.

use std::time::Instant;

use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::sph::{FluidBlock, FluidShape, Gradients, Method, Parameters, Precision, Simulation, Wcsph};

/// Support radii per spacing: 74 neighbours.
const SUPPORT: f64 = 2.6;
const BOX: Aabb = Aabb::new(DVec3::ZERO, DVec3::splat(3.0));

fn dam_break(particles: usize, method: Method, precision: Precision) -> Simulation<'static> {
    // 1 m wide, 3 m deep, 1.5 m high
    let volume = 1.0 * 3.0 * 1.5;
    let spacing = (volume / particles as f64).cbrt();
    let mut parameters = Parameters {
        rest_density: 1000.0,
        particle_mass: 1000.0 * spacing.powi(3),
        support_radius: SUPPORT * spacing,
        viscosity: 0.0,
        surface_tension: 0.0,
        method,
        precision,
        adaptive: true,
        ..Parameters::default()
    };
    parameters.time_step = 1.0;
    let water = Aabb::new(DVec3::ZERO, DVec3::new(1.0, 3.0, 1.5));
    let fluid = FluidBlock::filling(FluidShape::Box(water)).seed(&parameters, BOX).unwrap();
    Simulation::new(parameters, fluid, BOX, Vec::new()).unwrap()
}

/// Seconds: of this thread on the processor where the system tells (Linux) and there is one thread, else of the clock.
fn now() -> f64 {
    let on_processor = || -> Option<f64> {
        let schedule = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(1e-9 * schedule.split_whitespace().next()?.parse::<f64>().ok()?)
    };
    static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
    let clock = START.elapsed().as_secs_f64();
    if rayon::current_num_threads() == 1 { on_processor().unwrap_or(clock) } else { clock }
}

fn main() {
    let threads: usize = std::env::var("THREADS").map_or(1, |n| n.parse().unwrap());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let wcsph = Method::Wcsph(Wcsph {
        sound_speed: 10.0 * (9.81f64 * 2.0 * 1.5).sqrt(),
        density_diffusion: 0.1,
        artificial_viscosity: 0.02,
        gradients: Gradients::Pairs,
        shifting: 0.0,
    });
    println!("| method | precision | particles | neighbours | ms per step | ns per particle·neighbour |");
    println!("|---|---|--:|--:|--:|--:|");
    for particles in [10_000, 105_000] {
        for (name, method) in [("wcsph", wcsph), ("paper", Method::Paper)] {
            for precision in [Precision::Single, Precision::Double] {
                let mut simulation = dam_break(particles, method, precision);
                pool.install(|| {
                    for _ in 0..3 {
                        simulation.step().unwrap();
                    }
                    let mut times: Vec<f64> = (0..9)
                        .map(|_| {
                            let started = now();
                            simulation.step().unwrap();
                            now() - started
                        })
                        .collect();
                    times.sort_by(f64::total_cmp);
                    let n = simulation.particles().len();
                    let neighbours = simulation.pairs() as f64 / n as f64;
                    println!(
                        "| {name} | {} | {n} | {neighbours:.0} | {:.2} ({:.2}) | {:.2} |",
                        precision.name(),
                        1e3 * times[4],
                        1e3 * times[0],
                        1e9 * times[4] / (n as f64 * neighbours)
                    );
                });
            }
        }
    }
}
