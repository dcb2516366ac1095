//! Drops under tension that lie on walls.

use rfm::{glam::DVec3, sph::Simulation};

use crate::tool::{run_to, simulation};

/// The middle of the fluid, m, its rms speed, m/s, and the number of particles with fewer than four others nearer than
/// two spacings.
fn state(simulation: &Simulation, spacing: f64) -> (DVec3, f64, usize) {
    let particles = simulation.particles();
    let places: Vec<DVec3> = particles.position.iter().collect();
    let n = places.len() as f64;
    let speed = (particles.velocity.iter().map(|v| v.length_squared()).sum::<f64>() / n).sqrt();
    let near = |p: &DVec3| places.iter().filter(|q| p.distance(**q) < 2.0 * spacing).count() - 1;
    let alone = places.iter().filter(|p| near(p) < 4).count();
    (places.iter().sum::<DVec3>() / n, speed, alone)
}

/// Half a ball of water without weight on the floor of a box: at a right angle it is at rest, with its middle at ⅜R.
/// (It spread until it was a layer thin, and then fell apart into a gas.)
#[test]
fn half_a_ball_rests_on_a_floor() {
    let spacing = 2e-3;
    let mut simulation = simulation(
        "rfm 1
scene sessile {
  box { min: [0, 0, 0], max: [6 cm, 6 cm, 4 cm], restitution: 0 }
  fluid water {
    shape: sphere(1.2 cm).move([3 cm, 3 cm, 0]) and z >= 0, density: 1000, spacing: 2 mm,
    viscosity: 0.2 Pa·s, surface_tension: 0.0728 N/m
  }
  gravity: [0, 0, 0]
  method: wcsph
  run { until: 1 s, save_every: 0.1 s }
}",
    );
    run_to(&mut simulation, 1.0);
    let (middle, speed, alone) = state(&simulation, spacing);
    println!("middle {middle}, {speed:.1e} m/s, {alone} alone");
    assert_eq!(alone, 0);
    // the speed of its tension is √(σ/ρR) = 0.08 m/s; six spacings of radius know a height to a twentieth
    assert!(speed < 2e-3, "{speed} m/s");
    assert!((middle.z / (0.375 * 0.012) - 1.0).abs() < 0.05, "{middle}");
    assert!((middle.truncate() - 0.03).length() < 1e-4, "{middle}");
    assert_eq!(simulation.findings(), []);
}

/// A drop of 2 mm on a table, with its weight. (It left the table as a ball after 0.03 s, and a tenth of it became
/// spray.)
#[test]
fn a_drop_stays_on_a_table() {
    let spacing = 0.25e-3;
    for method in ["wcsph", "dfsph"] {
        let mut simulation = simulation(&format!(
            "rfm 1
solid table = box([-1 cm, -1 cm, -2 mm], [2 cm, 2 cm, 0])
scene drop {{
  box {{ min: [0, 0, -2 mm], max: [1 cm, 1 cm, 6 mm], restitution: 0 }}
  obstacle {{ solid: table }}
  fluid water {{
    shape: sphere(2 mm).move([5 mm, 5 mm, 0]) and z >= 0, density: 1000, spacing: 0.25 mm,
    viscosity: 0.05 Pa·s, surface_tension: 0.0728 N/m
  }}
  walls: no_slip
  method: {method}
  run {{ until: 0.05 s, save_every: 0.01 s }}
}}"
        ));
        run_to(&mut simulation, 0.05);
        let (middle, speed, alone) = state(&simulation, spacing);
        println!("{method}: middle {middle}, {speed:.1e} m/s, {alone} alone");
        assert_eq!(alone, 0, "{method}");
        // its weight makes it a tenth lower than half a ball, whose middle is 0.75 mm high; it still swings a little
        assert!((0.62e-3..0.74e-3).contains(&middle.z), "{method}: {middle}");
        assert!((middle.truncate() - 5e-3).length() < 1e-4, "{method}: {middle}");
        // a twentieth of the speed of its tension, √(σ/ρR) = 0.19 m/s
        assert!(speed < 0.01, "{method}: {speed} m/s");
    }
}
