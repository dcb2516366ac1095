//! Round numbers for axes: 1, 2 or 5 times a power of ten, and their multiples.
//!
//! Invariant: values are read back from decimal digits, so 0.05 is the double nearest to 0.05 and its label
//! is exactly `0.05`.

use std::fmt;

/// The number mantissa · 10^exponent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decimal {
    pub mantissa: i64,
    pub exponent: i32,
}

impl Decimal {
    pub const ZERO: Self = Self { mantissa: 0, exponent: 0 };

    pub fn value(self) -> f64 {
        // the digits of a number always parse
        format!("{}e{}", self.mantissa, self.exponent).parse().unwrap_or(f64::NAN)
    }

    pub fn negated(self) -> Self {
        Self { mantissa: -self.mantissa, ..self }
    }

    /// The largest 1, 2 or 5 · 10ⁿ that is not above `x`. `None` for zero, negative and non-finite numbers.
    pub fn below(x: f64) -> Option<Self> {
        if !(x > 0.0 && x.is_finite()) {
            return None;
        }
        // one decade lower than the logarithm, in case that was rounded up
        let mut best = Self { mantissa: 1, exponent: libm::log10(x).floor() as i32 - 1 };
        while best.larger().value() <= x {
            best = best.larger();
        }
        Some(best)
    }

    /// The next larger number in the series 1, 2, 5.
    pub fn larger(self) -> Self {
        match self.mantissa {
            1 => Self { mantissa: 2, ..self },
            2 => Self { mantissa: 5, ..self },
            _ => Self { mantissa: 1, exponent: self.exponent + 1 },
        }
    }

    /// The next smaller number in the series 1, 2, 5.
    pub fn smaller(self) -> Self {
        match self.mantissa {
            5 => Self { mantissa: 2, ..self },
            2 => Self { mantissa: 1, ..self },
            _ => Self { mantissa: 5, exponent: self.exponent - 1 },
        }
    }
}

impl fmt::Display for Decimal {
    /// Plain digits if they are few, and otherwise like 5e−7; with a true minus sign.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.mantissa < 0 { "−" } else { "" };
        let digits = self.mantissa.unsigned_abs();
        match self.exponent {
            _ if digits == 0 => write!(f, "0"),
            0..=4 => write!(f, "{sign}{}", digits * 10u64.pow(self.exponent as u32)),
            -5..=-1 => {
                let places = -self.exponent as usize;
                let one = 10u64.pow(places as u32);
                write!(f, "{sign}{}.{:0places$}", digits / one, digits % one)
            }
            e => write!(f, "{sign}{digits}e{}{}", if e < 0 { "−" } else { "" }, e.unsigned_abs()),
        }
    }
}

impl Decimal {
    /// All digits, before and behind the point. `None` if they are very many.
    fn in_full(self) -> Option<String> {
        let digits = self.mantissa.unsigned_abs();
        let one = 10u64.checked_pow(self.exponent.unsigned_abs())?;
        let sign = if self.mantissa < 0 { "−" } else { "" };
        if self.exponent >= 0 {
            return Some(format!("{sign}{}", digits.checked_mul(one)?));
        }
        let places = self.exponent.unsigned_abs() as usize;
        Some(format!("{sign}{}.{:0places$}", digits / one, digits % one))
    }
}

/// Numbers that belong together as text: as plain digits if those of all are few, or else like 5e−7 where that is shorter.
pub fn written(numbers: &[Decimal]) -> Vec<String> {
    let is_plain = |n: &Decimal| n.mantissa == 0 || (-5..=4).contains(&n.exponent);
    if numbers.iter().all(is_plain) {
        return numbers.iter().map(Decimal::to_string).collect();
    }
    let text = |n: &Decimal| {
        let sign = if n.mantissa < 0 { "−" } else { "" };
        let mut digits = n.mantissa.unsigned_abs();
        let mut exponent = n.exponent;
        while digits > 0 && digits.is_multiple_of(10) {
            (digits, exponent) = (digits / 10, exponent + 1);
        }
        match digits {
            0 => "0".to_string(),
            _ => format!("{sign}{digits}e{}{}", if exponent < 0 { "−" } else { "" }, exponent.unsigned_abs()),
        }
    };
    let short: Vec<String> = numbers.iter().map(text).collect();
    let widest = |texts: &[String]| texts.iter().map(|text| text.chars().count()).max();
    match numbers.iter().map(|n| n.in_full()).collect::<Option<Vec<String>>>() {
        Some(full) if widest(&full) <= widest(&short) => full,
        Some(_) | None => short,
    }
}

/// About `count`/2 to `count` round numbers from `min` to `max`, evenly spaced and with the same number
/// of digits.
pub fn ticks(min: f64, max: f64, count: usize) -> Vec<Decimal> {
    let span = max - min;
    let Some(mut step) = Decimal::below(span / count as f64) else { return Vec::new() };
    while span / step.value() > count as f64 {
        step = step.larger();
    }
    // rounding must not lose a tick on the border itself
    let slack = 1e-9 * span;
    let first = ((min - slack) / step.value()).ceil();
    let last = ((max + slack) / step.value()).floor();
    if !(first.abs() < 1e15 && last.abs() < 1e15) {
        return Vec::new();
    }
    (first as i64..=last as i64)
        .map(|k| Decimal { mantissa: k * step.mantissa, exponent: step.exponent })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_belong_together_are_written_alike() {
        let of = |parts: &[(i64, i32)]| {
            let numbers: Vec<Decimal> =
                parts.iter().map(|&(mantissa, exponent)| Decimal { mantissa, exponent }).collect();
            written(&numbers).join(" ")
        };
        assert_eq!(of(&[(-1, -5), (-5, -6), (0, 0), (5, -6), (10, -6)]), "−1e−5 −5e−6 0 5e−6 1e−5");
        assert_eq!(of(&[(-1, -3), (0, 0), (5, -4)]), "−0.001 0 0.0005");
        assert_eq!(of(&[(20, 4), (1, 5)]), "2e5 1e5");
        // few steps far from zero
        let far = [(19_999_999_995, -7), (20_000_000_000, -7), (20_000_000_005, -7)];
        assert_eq!(of(&far), "1999.9999995 2000.0000000 2000.0000005");
        assert_eq!(of(&[(-123_456, 5), (1, 300)]), "−123456e5 1e300");
    }

    #[track_caller]
    fn check_ticks(min: f64, max: f64, expected: &str) {
        let labels: Vec<_> = ticks(min, max, 7).iter().map(Decimal::to_string).collect();
        assert_eq!(labels.join(" "), expected);
    }

    #[test]
    fn ticks_are_round_and_reach_both_ends() {
        check_ticks(0.8, 2.2, "0.8 1.0 1.2 1.4 1.6 1.8 2.0 2.2");
        check_ticks(0.0, 3.0, "0 0.5 1.0 1.5 2.0 2.5 3.0");
        check_ticks(-1.0, 1.0, "−1.0 −0.5 0 0.5 1.0");
        check_ticks(-30.0, 130.0, "0 50 100");
        check_ticks(0.0, 3e-7, "0 5e−8 10e−8 15e−8 20e−8 25e−8 30e−8");
        check_ticks(f64::NAN, 1.0, "");
        check_ticks(1.0, 1.0, "");
    }

    #[test]
    fn the_series_is_one_two_five() {
        assert_eq!(Decimal::below(0.16).unwrap().to_string(), "0.1");
        assert_eq!(Decimal::below(1000.0).unwrap().to_string(), "1000");
        assert_eq!(Decimal::below(4.99).unwrap().to_string(), "2");
        assert_eq!(Decimal::below(0.05).unwrap().value(), 0.05);
        assert_eq!(Decimal::below(0.0), None);
        assert_eq!(Decimal::below(f64::INFINITY), None);
        let one = Decimal { mantissa: 1, exponent: 0 };
        let down = std::iter::successors(Some(one), |level| Some(level.smaller()));
        let labels: Vec<_> = down.take(5).map(|level| level.to_string()).collect();
        assert_eq!(labels.join(" "), "1 0.5 0.2 0.1 0.05");
    }
}
