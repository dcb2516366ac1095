//! The pressure of a fluid at rest under its own weight, for methods that start with it.

use glam::DVec3;

use crate::sph::{Parameters, Particles, VectorField};

/// Stretches of the way to a particle over which forces are summed, and the places in each of them with their weights
/// (Gauss).
const STRETCHES: usize = 4;
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Particles around which forces are tested for having a potential, and the part of the greatest force that may be left.
const TESTED: usize = 100;
const LEFT: f64 = 1e-3;

/// Sets the densities of a fluid at rest under its own weight, for methods that start so. The fluid's surface lies half
/// a spacing above the particle that is highest, which is where the forces do least work on the way. Forces that depend
/// on the place and have no potential hold no fluid at rest, and change nothing here.
pub(super) fn put_under_pressure(p: &Parameters, field: Option<&VectorField>, particles: &mut Particles) {
    let Some(middle) = middle(particles) else { return };
    if field.is_some_and(|field| !has_potential(field, particles, p.spacing())) {
        return;
    }
    let force = |at: DVec3| field.map_or(p.gravity, |field| field(at, 0.0));
    let work = |at: DVec3| match field {
        None => p.gravity.dot(at - middle),
        Some(field) => work(field, middle, at),
    };
    let works: Vec<f64> = particles.position.iter().map(work).collect();
    let highest = (0..works.len()).min_by(|&i, &j| works[i].total_cmp(&works[j]));
    let Some(highest) = highest else { return };
    let least = works[highest] - 0.5 * p.spacing() * force(particles.position.get(highest)).length();
    let density = |work: &f64| p.density_at_start(p.rest_density * (work - least));
    let densities: Option<Vec<f64>> = works.iter().map(density).collect();
    if let Some(densities) = densities {
        particles.density = densities;
    }
}

/// The middle of all particles; `None` if there are none.
fn middle(particles: &Particles) -> Option<DVec3> {
    let count = particles.len();
    (count > 0).then(|| particles.position.iter().sum::<DVec3>() / count as f64)
}

/// The work of forces at the start on a straight way, m²/s².
fn work(field: &VectorField, from: DVec3, to: DVec3) -> f64 {
    let step = (to - from) / STRETCHES as f64;
    let stretch = |k: usize| {
        let part =
            |&(place, weight): &(f64, f64)| weight * field(from + (k as f64 + place) * step, 0.0).dot(step);
        GAUSS.iter().map(part).sum::<f64>()
    };
    (0..STRETCHES).map(stretch).sum()
}

/// Whether forces do no work around small squares beside some of the particles.
fn has_potential(field: &VectorField, particles: &Particles, side: f64) -> bool {
    let every = particles.len().div_ceil(TESTED).max(1);
    let around = |at: DVec3, axis: usize| {
        let (u, v) = (side * DVec3::AXES[axis], side * DVec3::AXES[(axis + 1) % 3]);
        let corners = [at, at + u, at + u + v, at + v, at];
        corners.array_windows::<2>().map(|[from, to]| work(field, *from, *to)).sum::<f64>()
    };
    let places = || (0..particles.len()).step_by(every).map(|i| particles.position.get(i));
    let greatest = places().map(|at| field(at, 0.0).length()).fold(0.0, f64::max);
    places().all(|at| (0..3).all(|axis| around(at, axis).abs() <= LEFT * greatest * 4.0 * side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_of_a_potential_is_its_difference() {
        // of a vessel that turns: g = [4x, 4y, −9.81]
        let field = |p: DVec3, _: f64| DVec3::new(4.0 * p.x, 4.0 * p.y, -9.81);
        let (from, to) = (DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.5, 0.4, -0.1));
        let potential = |p: DVec3| 2.0 * (p.x * p.x + p.y * p.y) - 9.81 * p.z;
        assert!((work(&field, from, to) - (potential(to) - potential(from))).abs() < 1e-12);
    }

    #[test]
    fn forces_around_an_axis_have_no_potential() {
        let mut particles = Particles::default();
        for i in 0..50 {
            particles.push(DVec3::new(0.02 * f64::from(i), 0.3, 0.1), DVec3::ZERO);
        }
        let held = |p: DVec3, _: f64| DVec3::new(4.0 * p.x, 4.0 * p.y, -9.81);
        let stirred = |p: DVec3, _: f64| DVec3::new(-p.y, p.x, -1.0);
        assert!(has_potential(&held, &particles, 0.01));
        assert!(!has_potential(&stirred, &particles, 0.01));
    }
}
