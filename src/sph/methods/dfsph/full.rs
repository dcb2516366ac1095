//! What pressure demands of a fluid that fills its vessel.
//!
//! A fluid with a surface may close the gaps between its particles before it resists. One without a surface must not: a
//! rod that shook in a full vessel met 1 % of the resistance of the water, because displaced particles went into
//! gaps. Nor can such a fluid become denser or thinner as a whole. So no rate of density is wanted but what evens out
//! densities, and of all rates only their differences from the mean count: a mean is an error of the sums, which no
//! pressure can take away, and a uniform one would grow without end. (If nothing is compressed at all, without that,
//! a flow between two cylinders bursts. If gaps up to a quantile of the densities are left, it is rougher by a sixth.)

/// Part of a deviation from the mean density that is taken back within the relaxation time. Without it a rod that shakes
/// makes half as much noise again; with all of it a vessel of turning water is off by a fifth more.
const EVENED: f64 = 0.5;

/// Finds the rates of density, kg/m³/s, that pressure has to take away, from those of the velocities, the densities,
/// kg/m³, and the debts, kg/m³, which are paid back within `relaxation`, s. The mean of the result is zero.
pub(super) fn find_unwanted(
    free: &mut Vec<f64>,
    (rates, densities, debts): (&[f64], &[f64], &[f64]),
    relaxation: f64,
) {
    let n = densities.len().max(1) as f64;
    let mean_density = densities.iter().sum::<f64>() / n;
    free.clear();
    free.extend(
        rates
            .iter()
            .zip(densities)
            .zip(debts)
            .map(|((rate, density), debt)| rate + (EVENED * (density - mean_density) + debt) / relaxation),
    );
    let mean = free.iter().sum::<f64>() / n;
    free.iter_mut().for_each(|rate| *rate -= mean);
}

#[cfg(test)]
mod tests {
    use super::find_unwanted;

    #[test]
    fn only_differences_count() {
        let mut free = vec![7.0];
        find_unwanted(&mut free, (&[4.0, 4.0, 4.0], &[990.0; 3], &[2.0; 3]), 0.1);
        assert!(free.iter().all(|rate| rate.abs() < 1e-12), "{free:?}");
        // what is denser than the mean has to expand, what is thinner may be compressed, what is owed is paid
        find_unwanted(&mut free, (&[0.0; 3], &[1000.0, 998.0, 999.0], &[0.0, 0.0, 3.0]), 0.5);
        assert_eq!(free.iter().map(|rate| rate.round()).collect::<Vec<_>>(), [-1.0, -3.0, 4.0]);
    }
}
