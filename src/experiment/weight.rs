//! The pressure of a fluid at rest under its own weight, for methods that start with it.

use glam::DVec3;

use crate::sph::{Parameters, Particles, VectorField};

/// Stretches of the way to a particle over which forces are summed, and the places in each of them with their weights
/// (Gauss).
const STRETCHES: usize = 4;
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Particles to which the work of forces is tested for not depending on the way, and the part of the greatest force, over
/// the extent of the fluid, that may be left.
const TESTED: usize = 100;
const LEFT: f64 = 1e-3;

/// Sets the densities of a fluid at rest under its own weight, for methods that start so. The fluid's surface lies half
/// a spacing above the particle that is highest, which is where the forces do least work on the way. Forces that depend
/// on the place and have no potential hold no fluid at rest, and change nothing here; nor do those whose work is not
/// found on straight ways through the middle of the fluid, as around a planet.
pub(super) fn put_under_pressure(p: &Parameters, field: Option<&VectorField>, particles: &mut Particles) {
    let Some(middle) = middle(particles) else { return };
    if field.is_some_and(|field| !has_potential(field, middle, particles)) {
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

/// Whether the work of forces does not depend on the way: around triangles of the middle and two particles there is
/// none.
fn has_potential(field: &VectorField, middle: DVec3, particles: &Particles) -> bool {
    let every = particles.len().div_ceil(TESTED).max(1);
    let places: Vec<DVec3> = (0..particles.len()).step_by(every).map(|i| particles.position.get(i)).collect();
    let largest = |of: &dyn Fn(DVec3) -> f64| places.iter().map(|at| of(*at)).fold(0.0, f64::max);
    let most = LEFT * largest(&|at| field(at, 0.0).length()) * largest(&|at| at.distance(middle));
    // NaN closes nothing
    let closes = |from: DVec3, to: DVec3| {
        (work(field, middle, from) + work(field, from, to) - work(field, middle, to)).abs() <= most
    };
    let far = 1 + places.len() / 3;
    (0..places.len()).all(|k| closes(places[k], places[(k + far) % places.len()]))
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
    fn forces_around_an_axis_or_a_planet_have_no_potential_that_is_found() {
        let mut particles = Particles::default();
        for i in 0..200 {
            let angle = 0.7 * f64::from(i);
            let place = DVec3::new(angle.cos(), angle.sin(), 0.01 * f64::from(i % 17) - 0.08);
            particles.push((1.0 + 0.002 * f64::from(i % 23)) * place, DVec3::ZERO);
        }
        let middle = middle(&particles).unwrap();
        let held = |p: DVec3, _: f64| DVec3::new(4.0 * p.x, 4.0 * p.y, -9.81);
        let stirred = |p: DVec3, _: f64| DVec3::new(-0.1 * p.y, 0.1 * p.x, -9.81);
        let planet = |p: DVec3, _: f64| -p / p.length().powi(3);
        assert!(has_potential(&held, middle, &particles));
        assert!(!has_potential(&stirred, middle, &particles));
        assert!(!has_potential(&planet, middle, &particles));
    }
}
