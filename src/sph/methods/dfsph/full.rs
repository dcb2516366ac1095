//! What pressure demands of a fluid that fills its vessel, or a chamber of it.
//!
//! A fluid with a surface may close the gaps between its particles before it resists. One without a surface must not: a
//! rod that shook in a full vessel met 1 % of the resistance of the water, because displaced particles went into
//! gaps. Nor can such a fluid become denser or thinner as a whole. So no rate of density is wanted but what evens out
//! densities, and of all rates only their differences from the mean count: a mean is an error of the sums, which no
//! pressure can take away, and a uniform one would grow without end. (If nothing is compressed at all, without that,
//! a flow between two cylinders bursts. If gaps up to a quantile of the densities are left, it is rougher by a sixth.)

use super::super::shifting::depth;

/// Part of a deviation from the mean density that is taken back within the relaxation time, or within the time in which a
/// particle moves by a spacing as seen from the fluid as a whole, if that is longer: what does not move has a density of
/// its own only where the lattice meets walls. (Taken back at rest, too, a full tank of water moved with 8 mm/s, and its
/// pressure was 1.3 % too high. Without this term vortices are off by 8.0 % instead of 7.5.)
const EVENED: f64 = 0.5;

/// Finds the rates of density, kg/m³/s, that pressure has to take away, from those of the velocities, the densities,
/// kg/m³, and the debts, kg/m³, which are paid back within `relaxation`, s. The `motion` of each particle is the rate,
/// 1/s, at which it passes others. Each of the `count` bodies of fluid, as in two chambers, has its own means: `of` says
/// to which one a particle belongs. The mean of the result over a body is zero.
pub(super) fn find_unwanted(
    free: &mut Vec<f64>,
    (of, count): &(Vec<usize>, usize),
    (rates, densities, debts): (&[f64], &[f64], &[f64]),
    motion: impl Fn(usize) -> f64,
    relaxation: f64,
) {
    let mean_density = means(densities, of, *count);
    free.clear();
    let found = rates.iter().zip(densities).zip(debts).zip(of).enumerate();
    free.extend(found.map(|(i, (((rate, density), debt), body))| {
        let evened = EVENED * (density - mean_density[*body]) * motion(i).min(relaxation.recip());
        rate + evened + debt / relaxation
    }));
    remove_means(free, of, *count);
}

/// Which bodies of fluid have no surface: chambers that are full for the time being, beside others that are not.
pub(super) fn closed((of, count): &(Vec<usize>, usize), spread: &[f64]) -> Vec<bool> {
    let mut is_closed = vec![true; *count];
    spread
        .iter()
        .zip(of)
        .filter(|(spread, _)| depth(**spread) == 0.0)
        .for_each(|(_, body)| is_closed[*body] = false);
    is_closed
}

/// Does for closed bodies what [`find_unwanted`] and [`lower`] do for a full vessel: takes from the rates that pressure has
/// to take away, kg/m³/s, their mean, and from the pressures p/ρ² the least. (In a fluid with a surface gaps want nothing,
/// so the mean of what is wanted is above zero, and where there is no surface no pressure can give it: in a chamber at rest
/// that was full to its lid pressures grew tenfold in a tenth of a second.)
pub(super) fn keep_volumes(
    free: &mut [f64],
    pressures: &mut [f64],
    bodies: &(Vec<usize>, usize),
    closed: &[bool],
) {
    let (of, count) = bodies;
    let (mean, least) = (means(free, of, *count), least(pressures, bodies));
    for ((rate, p), body) in free.iter_mut().zip(pressures).zip(of).filter(|(_, body)| closed[**body]) {
        *rate -= mean[*body];
        *p -= least[*body];
    }
}

/// Takes from the pressures p/ρ² of each body the least of them: only differences act, and what pressure once needed would
/// stay as a level that nothing takes back. (A tank that began to be pushed kept 600 Pa.)
pub(super) fn lower(pressures: &mut [f64], bodies: &(Vec<usize>, usize)) {
    let least = least(pressures, bodies);
    pressures.iter_mut().zip(&bodies.0).for_each(|(p, body)| *p -= least[*body]);
}

/// The least of the numbers of each body.
fn least(numbers: &[f64], (of, count): &(Vec<usize>, usize)) -> Vec<f64> {
    let mut least = vec![f64::INFINITY; *count];
    numbers.iter().zip(of).for_each(|(number, body)| least[*body] = least[*body].min(*number));
    least
}

/// Takes from the numbers of each body their mean.
fn remove_means(numbers: &mut [f64], of: &[usize], count: usize) {
    let mean = means(numbers, of, count);
    numbers.iter_mut().zip(of).for_each(|(number, body)| *number -= mean[*body]);
}

/// The mean of the numbers of each body.
fn means(numbers: &[f64], of: &[usize], count: usize) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); count];
    for (number, body) in numbers.iter().zip(of) {
        sums[*body].0 += number;
        sums[*body].1 += 1.0;
    }
    sums.into_iter().map(|(sum, n)| sum / n).collect()
}

#[cfg(test)]
mod tests {
    use super::{closed, find_unwanted, keep_volumes, lower};

    #[test]
    fn only_differences_within_a_body_count() {
        let mut free = vec![7.0];
        let one = (vec![0; 3], 1);
        find_unwanted(&mut free, &one, (&[4.0, 4.0, 4.0], &[990.0; 3], &[2.0; 3]), |_| 20.0, 0.1);
        assert!(free.iter().all(|rate| rate.abs() < 1e-12), "{free:?}");
        // what is denser than the mean has to expand, what is thinner may be compressed, what is owed is paid
        let uneven: (&[f64], &[f64], &[f64]) = (&[0.0; 3], &[1000.0, 998.0, 999.0], &[0.0, 0.0, 3.0]);
        find_unwanted(&mut free, &one, uneven, |_| 20.0, 0.5);
        assert_eq!(free.iter().map(|rate| rate.round()).collect::<Vec<_>>(), [-1.0, -3.0, 4.0]);
        // what is at rest may stay denser
        find_unwanted(&mut free, &one, uneven, |_| 0.0, 0.5);
        assert_eq!(free.iter().map(|rate| rate.round()).collect::<Vec<_>>(), [-2.0, -2.0, 4.0]);
        // two chambers, one denser than the other
        let two = (vec![0, 1, 0, 1], 2);
        find_unwanted(
            &mut free,
            &two,
            (&[1.0, 5.0, 3.0, 5.0], &[980.0, 950.0, 980.0, 950.0], &[0.0; 4]),
            |_| 20.0,
            0.1,
        );
        assert_eq!(free, [-1.0, 0.0, 1.0, 0.0]);
    }

    #[test]
    fn the_least_pressure_of_each_body_is_zero() {
        let mut pressures = vec![3.0, 9.0, 5.0, 7.0];
        lower(&mut pressures, &(vec![0, 1, 0, 1], 2));
        assert_eq!(pressures, [0.0, 2.0, 2.0, 0.0]);
    }

    #[test]
    fn only_bodies_without_a_surface_keep_their_volume() {
        let two = (vec![0, 1, 0, 1], 2);
        let closed = closed(&two, &[0.98, 0.7, 0.9, 0.98]);
        assert_eq!(closed, [true, false]);
        let (mut free, mut pressures) = ([1.0, 5.0, 3.0, 7.0], [4.0, 2.0, 6.0, 3.0]);
        keep_volumes(&mut free, &mut pressures, &two, &closed);
        assert_eq!((free, pressures), ([-1.0, 5.0, 1.0, 7.0], [0.0, 2.0, 2.0, 3.0]));
    }
}
