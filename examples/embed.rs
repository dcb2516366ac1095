//! A particle loop of your own around a compiled obstacle: `cargo run --release --example embed`.

use rfm::Program;
use rfm::glam::DVec3;
use rfm::sph::{Collision, Rebound, collide};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/pawn.rfm");
    let pawn = Program::from_path(file)?.with("cx", 1.25)?.solid("pawn")?;

    let grid = |i: usize, n: usize| (i % n) as f64 / n as f64;
    let mut x: Vec<f64> = (0..1000).map(|i| 0.75 + grid(i, 10)).collect();
    let mut y: Vec<f64> = (0..1000).map(|i| 1.0 + grid(i / 10, 10)).collect();
    let mut z: Vec<f64> = (0..1000).map(|i| 1.6 + grid(i / 100, 10)).collect();
    let mut v = vec![DVec3::ZERO; 1000];
    let mut omega = vec![0.0; 1000];
    let (dt, mut hits) = (0.001, 0);
    let rebound = Rebound::new(0.5, 0.0, 0.1)?; // half of the normal speed returns; nothing is moved farther than 0.1 m
    for _ in 0..1000 {
        for i in 0..1000 {
            v[i].z -= 9.81 * dt;
            let p = DVec3::new(x[i], y[i], z[i]) + v[i] * dt;
            (x[i], y[i], z[i]) = (p.x, p.y, p.z.max(0.0));
        }
        pawn.omega_many([&x, &y, &z], &mut omega); // one call for all points: nothing is allocated
        for i in (0..1000).filter(|&i| omega[i] >= 0.0) {
            let mut p = DVec3::new(x[i], y[i], z[i]);
            hits += usize::from(collide(&pawn, &rebound, &mut p, &mut v[i]) == Some(Collision::Hit));
            (x[i], y[i], z[i]) = (p.x, p.y, p.z);
        }
    }
    pawn.omega_many([&x, &y, &z], &mut omega);
    println!("{hits} hits, {} of 1000 particles inside the pawn", omega.iter().filter(|&&w| w > 0.0).count());
    Ok(())
}
