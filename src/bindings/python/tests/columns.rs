//! ω of columns of points in Rust, with which `speed.py` compares Python: prints nanoseconds per point.
//!
//! Arguments: the file, the solid, the number of points, that of threads, and that of repetitions.

use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;
use rfm::solid::Lane;
use rfm::{Program, Solid, glam::DVec3};

/// Points that one thread takes at a time.
const CHUNK: usize = 8192;

/// The median time of a call, ns.
fn median(repetitions: usize, mut call: impl FnMut()) -> f64 {
    call();
    let mut times: Vec<f64> = (0..repetitions)
        .map(|_| {
            let started = Instant::now();
            call();
            started.elapsed().as_secs_f64() * 1e9
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn columns<T: Lane>(solid: &Solid, count: usize, repetitions: usize, number: impl Fn(f64) -> T) -> f64 {
    let coordinate = |k: usize, step: usize| number(3.0 * ((k * step) % 1009) as f64 / 1009.0);
    let [x, y, z] = [7, 31, 101].map(|step| (0..count).map(|k| coordinate(k, step)).collect::<Vec<T>>());
    let mut omega = vec![T::default(); count];
    median(repetitions, || {
        if rayon::current_num_threads() == 1 {
            solid.omega_many([&x, &y, &z], &mut omega);
        } else {
            let points = x.par_chunks(CHUNK).zip(y.par_chunks(CHUNK)).zip(z.par_chunks(CHUNK));
            points.zip(omega.par_chunks_mut(CHUNK)).for_each(|(((x, y), z), omega)| {
                solid.omega_many([x, y, z], omega);
            });
        }
        black_box(&omega);
    }) / count as f64
}

/// The time of one point, ns.
fn one(solid: &Solid) -> f64 {
    const MANY: u32 = 2000;
    let started = Instant::now();
    for k in 0..MANY {
        black_box(solid.omega(black_box(DVec3::new(1.5, 1.4, f64::from(k) * 1e-5))));
    }
    started.elapsed().as_secs_f64() * 1e9 / f64::from(MANY)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, solid, count, threads, repetitions] = &arguments[..] else {
        return Err("expected FILE SOLID POINTS THREADS REPETITIONS".into());
    };
    let (count, repetitions) = (count.parse()?, repetitions.parse()?);
    let solid = Program::from_path(file)?.solid(solid)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.parse()?).build()?;
    let double = pool.install(|| columns::<f64>(&solid, count, repetitions, |x| x));
    let single = pool.install(|| columns::<f32>(&solid, count, repetitions, |x| x as f32));
    let one = (0..300).map(|_| one(&solid)).fold(f64::INFINITY, f64::min);
    println!("{double} {single} {one}");
    Ok(())
}
