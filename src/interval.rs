//! Closed intervals with outward rounding: the enclosure of a real computation, never narrower.
//!
//! Every operation here contains the exact image of its operands: results of the correctly rounded
//! operations (+ − × ÷ √) are widened by one unit in the last place, those of library functions by four.
//! An undefined point (√ of a negative number, division by an interval around zero) widens to [`Interval::ALL`],
//! which also stands for "may be NaN".

/// `lo ≤ hi`; either may be infinite; never NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    pub lo: f64,
    pub hi: f64,
}

impl Interval {
    /// Knows nothing: all reals, and possibly NaN.
    pub const ALL: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    pub const fn point(x: f64) -> Self {
        Self { lo: x, hi: x }
    }

    /// The interval between two bounds; [`Interval::ALL`] if either is NaN.
    pub fn new(lo: f64, hi: f64) -> Self {
        if lo <= hi { Self { lo, hi } } else { Self::ALL }
    }

    pub fn contains(&self, x: f64) -> bool {
        self.lo <= x && x <= self.hi
    }

    pub fn width(&self) -> f64 {
        self.hi - self.lo
    }
}
