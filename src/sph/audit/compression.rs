//! How much a fluid is compressed, by the densities that its particles' places say.

use rayon::prelude::*;

use crate::sph::particles::CHUNK;

/// Width of a class of compressions, as a part of the rest density.
pub(super) const CLASS: f64 = 5e-4;

/// Number of classes; the last one also holds all that is compressed more.
const CLASSES: usize = 2048;

/// How far densities exceed that at rest, by the places of the particles, as parts of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Compression {
    /// The mean over all particles.
    pub mean: f64,
    /// The value that one particle in a hundred exceeds.
    pub p99: f64,
    /// The largest value.
    pub largest: f64,
}

impl Compression {
    /// The compression by densities, kg/m³, and the mean of ρ₀/max(ρ, ρ₀).
    pub(super) fn of(densities: &[f64], rest_density: f64) -> (Self, f64) {
        let parts: Vec<(f64, f64, f64)> = densities
            .par_chunks(CHUNK)
            .map(|densities| {
                let (mut sum, mut volume, mut largest) = (0.0, 0.0, 0.0f64);
                for rho in densities {
                    let x = (rho / rest_density).max(1.0);
                    sum += x - 1.0;
                    volume += 1.0 / x;
                    largest = largest.max(x - 1.0);
                }
                (sum, volume, largest)
            })
            .collect();
        let (sum, volume, largest) =
            parts.into_iter().fold((0.0, 0.0, 0.0f64), |a, b| (a.0 + b.0, a.1 + b.1, a.2.max(b.2)));
        let mut classes = [0u32; CLASSES];
        for rho in densities {
            let class = (rho / rest_density - 1.0).max(0.0) / CLASS;
            classes[(class as usize).min(CLASSES - 1)] += 1;
        }
        let n = densities.len() as f64;
        let mut above = 0.01 * n;
        let class = classes.iter().rposition(|&count| {
            above -= f64::from(count);
            above < 0.0
        });
        let p99 = match class {
            // all of the first class counts as uncompressed
            None | Some(0) => 0.0,
            // the last class has no end
            Some(class) if class == CLASSES - 1 => exceeded(densities, rest_density),
            // the upper end of the class, but no more than there is
            Some(class) => (CLASS * (class + 1) as f64).min(largest),
        };
        (Self { mean: sum / n, p99, largest }, volume / n)
    }

    /// The worse of each figure.
    pub(super) fn worst(self, other: Self) -> Self {
        Self {
            mean: self.mean.max(other.mean),
            p99: self.p99.max(other.p99),
            largest: self.largest.max(other.largest),
        }
    }
}

/// The excess of the density that one particle in a hundred exceeds, as a part of that at rest.
fn exceeded(densities: &[f64], rest_density: f64) -> f64 {
    let mut excess: Vec<f64> = densities.iter().map(|rho| rho / rest_density - 1.0).collect();
    let rank = (0.01 * excess.len() as f64) as usize;
    *excess.select_nth_unstable_by(rank, |a, b| b.total_cmp(a)).1
}
