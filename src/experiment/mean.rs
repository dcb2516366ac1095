//! Means over samples that depend on each other, with their errors.

/// Samples are grouped into this number of blocks, whose means are taken to be independent.
const BLOCKS: usize = 8;

/// Fewest samples of a block.
const LEAST_OF_BLOCK: usize = 4;

/// A mean over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Its standard error; `None` if there are too few samples for one.
    pub error: Option<f64>,
    /// Number of samples.
    pub samples: usize,
}

impl Mean {
    /// The mean of samples in the order of time, each with the time, s, for which it stands; those that are
    /// not finite do not count. `None` if none is left.
    ///
    /// Samples of a flow that follow each other are alike, so that σ/√n is too small an error. They are
    /// therefore joined to eight blocks, and the error is that of the mean of their means (H. Flyvbjerg, H.
    /// G. Petersen, J. Chem. Phys. 91, 1989). This holds if every oscillation is shorter than a block.
    pub fn of(samples: impl IntoIterator<Item = (f64, f64)>) -> Option<Self> {
        let samples: Vec<(f64, f64)> =
            samples.into_iter().filter(|(value, time)| value.is_finite() && *time > 0.0).collect();
        let mean = |samples: &[(f64, f64)]| {
            let (sum, times) = samples
                .iter()
                .fold((0.0, 0.0), |(sum, times), (value, time)| (sum + value * time, times + time));
            sum / times
        };
        if samples.is_empty() {
            return None;
        }
        let length = samples.len() / BLOCKS;
        let error = (length >= LEAST_OF_BLOCK).then(|| {
            let means: Vec<f64> = samples.rchunks_exact(length).take(BLOCKS).map(mean).collect();
            let middle = means.iter().sum::<f64>() / BLOCKS as f64;
            let squares: f64 = means.iter().map(|value| (value - middle).powi(2)).sum();
            (squares / (BLOCKS * (BLOCKS - 1)) as f64).sqrt()
        });
        Some(Self { value: mean(&samples), error, samples: samples.len() })
    }
}

#[cfg(test)]
mod tests {
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::{Rng, SeedableRng};

    use super::*;

    /// Samples that forget slowly: x' = a x + noise has the mean 0, and the mean of n samples the variance
    /// σ²/(n (1 − a)²) for many samples.
    #[test]
    fn errors_heed_that_samples_depend_on_each_other() {
        let (memory, count) = (0.9, 4000);
        let (mut within, mut ratio) = (0, 0.0);
        for seed in 0..200 {
            let mut random = Pcg64::seed_from_u64(seed);
            let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            let mut x = 0.0;
            let samples = (0..count).map(|_| {
                x = memory * x + uniform();
                (x, 0.1)
            });
            let found = Mean::of(samples).unwrap();
            let error = found.error.unwrap();
            within += usize::from(found.value.abs() < error);
            ratio += error / 200.0;
        }
        let expected = (1.0 / 12.0_f64).sqrt() / (1.0 - memory) / f64::from(count).sqrt();
        // Student's distribution with seven degrees of freedom: 65 % lie within one standard error
        assert!((110..150).contains(&within), "{within} of 200");
        assert!((ratio / expected - 1.0).abs() < 0.1, "{ratio} {expected}");
    }

    #[test]
    fn a_few_samples_have_a_mean_without_an_error() {
        let found = Mean::of([(1.0, 1.0), (f64::NAN, 9.0), (3.0, 3.0)]).unwrap();
        assert_eq!(found, Mean { value: 2.5, error: None, samples: 2 });
        assert_eq!(Mean::of([(f64::NAN, 1.0)]), None);
    }
}
