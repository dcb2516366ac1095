//! Numbers that look random and are always the same for the same seed.

/// What the seeds of SplitMix64 grow by, 2⁶⁴ over the golden ratio.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// One step of the generator SplitMix64 (Steele, Lea and Flood 2014): every bit of the result depends on all bits.
pub(crate) fn scrambled(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(STEP);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The number from 0 to 1 that has this place in the sequence of SplitMix64, without 1.
pub(crate) fn nth(place: u64) -> f64 {
    from_bits(scrambled(place.wrapping_mul(STEP)))
}

/// A number from 0 to 1, without 1, from the upper 53 of the bits.
pub(crate) fn from_bits(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first results of the generator for the seed 1234567, as its authors' program prints them.
    #[test]
    fn it_is_splitmix64() {
        let first = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        for (k, expected) in first.into_iter().enumerate() {
            assert_eq!(scrambled(1_234_567_u64.wrapping_add((k as u64).wrapping_mul(STEP))), expected);
        }
    }

    #[test]
    fn numbers_fill_the_interval() {
        let numbers: Vec<f64> = (0..4000).map(nth).collect();
        assert!(numbers.iter().all(|x| (0.0..1.0).contains(x)));
        // the mean of n such numbers scatters by 1/√(12n) = 0.0046
        let mean = numbers.iter().sum::<f64>() / 4000.0;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
    }
}
