//! Numbers of 120 digits.

use dashu_float::{FBig, round::mode::HalfEven};

pub(in crate::ir) type Big = FBig<HalfEven, 2>;

/// Bits of every intermediate result.
pub(in crate::ir) const PRECISION: usize = 400;

/// A double with all its digits; `None` if it is not finite.
pub(in crate::ir) fn big(x: f64) -> Option<Big> {
    if !x.is_finite() {
        return None;
    }
    Some(Big::try_from(x).ok()?.with_precision(PRECISION).value())
}

pub(in crate::ir) fn number(whole: u32) -> Big {
    Big::from(whole).with_precision(PRECISION).value()
}

pub(in crate::ir) fn one() -> Big {
    Big::ONE.with_precision(PRECISION).value()
}
