//! What particles carry, at places between them.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// The values at places: the mean of those of the particles within `reach` in metres, near ones counting
/// most. NaN where there is none. Particles without a finite place or without a value do not count.
pub fn values_at(places: &[DVec3], particles: &[DVec3], values: &[f64], reach: f64) -> Vec<f64> {
    // `as` saturates, and what is so far away has no neighbours
    let cell = |p: DVec3| (p / reach).to_array().map(|x| x.floor() as i64);
    let mut cells: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
    for (k, (place, _)) in
        (0..).zip(particles.iter().zip(values)).filter(|(_, (p, v))| p.is_finite() && v.is_finite())
    {
        cells.entry(cell(*place)).or_default().push(k);
    }
    let near = |place: DVec3| {
        let middle = cell(place);
        let around = (0..27_i64).map(move |i| {
            let step = [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
            std::array::from_fn::<i64, 3, _>(|axis| middle[axis].saturating_add(step[axis]))
        });
        around.filter_map(|at| cells.get(&at)).flatten().map(|&k| k as usize)
    };
    let value = |place: &DVec3| {
        let (mut sum, mut all) = (0.0, 0.0);
        for k in near(*place) {
            let part = 1.0 - place.distance_squared(particles[k]) / (reach * reach);
            if part > 0.0 {
                let weight = part * part * part;
                sum += weight * values[k];
                all += weight;
            }
        }
        sum / all
    };
    places.par_iter().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_between_particles_are_means_of_those_that_are_near() {
        let particles: Vec<DVec3> =
            (0..1000).map(|i| DVec3::new((i % 10) as f64, (i / 10 % 10) as f64, (i / 100) as f64)).collect();
        let values: Vec<f64> = particles.iter().map(|p| 3.0 + p.x - 2.0 * p.z).collect();
        // in the middle of a lattice the means of a linear function are its values
        let places = [DVec3::new(4.5, 4.5, 4.5), DVec3::new(5.0, 4.0, 6.0), DVec3::splat(99.0)];
        let found = values_at(&places, &particles, &values, 2.1);
        assert!((found[0] - (3.0 + 4.5 - 9.0)).abs() < 1e-12, "{}", found[0]);
        assert!((found[1] - (3.0 + 5.0 - 12.0)).abs() < 1e-12, "{}", found[1]);
        assert!(found[2].is_nan());
        // what is nowhere or has no value does not count
        let odd = [DVec3::NAN, DVec3::ZERO, DVec3::X, DVec3::splat(1e300)];
        assert_eq!(values_at(&[DVec3::ZERO], &odd, &[7.0, 2.0, f64::NAN, 1.0], 1.5), [2.0]);
    }
}
