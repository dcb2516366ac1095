//! A particle loop of your own around a compiled obstacle: `cargo run --release --example embed`.

use rfm::{Program, glam::DVec3};

fn main() -> Result<(), rfm::Error> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/pawn.rfm");
    let pawn = Program::from_path(file)?.with("cx", 1.25)?.solid("pawn")?;

    let grid = |i: usize, n: usize| (i % n) as f64 / n as f64;
    let mut x: Vec<f64> = (0..1000).map(|i| 0.75 + grid(i, 10)).collect();
    let mut y: Vec<f64> = (0..1000).map(|i| 1.0 + grid(i / 10, 10)).collect();
    let mut z: Vec<f64> = (0..1000).map(|i| 1.6 + grid(i / 100, 10)).collect();
    let mut v = vec![DVec3::ZERO; 1000];
    let mut omega = vec![0.0; 1000];
    let (dt, mut hits) = (0.001, 0);
    for _ in 0..1000 {
        for i in 0..1000 {
            v[i].z -= 9.81 * dt;
            let p = DVec3::new(x[i], y[i], z[i]) + v[i] * dt;
            (x[i], y[i], z[i]) = (p.x, p.y, p.z.max(0.0));
        }
        pawn.omega_many([&x, &y, &z], &mut omega); // one call for all points: nothing is allocated
        for i in (0..1000).filter(|&i| omega[i] > 0.0) {
            hits += 1;
            let (mut w, mut gradient) = pawn.omega_grad(DVec3::new(x[i], y[i], z[i]));
            let normal = -gradient.normalize();
            let approach = v[i].dot(normal).min(0.0);
            v[i] -= 1.5 * approach * normal; // half of the normal speed returns
            while w > 0.0 {
                let p = DVec3::new(x[i], y[i], z[i]) + (w / gradient.length() + 1e-9) * -gradient.normalize();
                (x[i], y[i], z[i]) = (p.x, p.y, p.z);
                (w, gradient) = pawn.omega_grad(p);
            }
        }
    }
    pawn.omega_many([&x, &y, &z], &mut omega);
    println!("{hits} hits, {} of 1000 particles inside the pawn", omega.iter().filter(|&&w| w > 0.0).count());
    Ok(())
}
