//! The colours of speeds: blue for slow, yellow for medium, red for fast.
//!
//! The map is fixed and linear in the speed, so pictures of different runs can be compared: 0 is dark blue, ¼
//! light blue, ½ yellow, ¾ orange, 1 and above red. People with red–green blindness can read it, because it
//! has no green and the yellow between blue and red is lighter than both.

/// An sRGB colour with 8 bits per channel: red, green, blue.
pub type Rgb = [u8; 3];

/// The colour of a particle whose speed is NaN.
pub const UNKNOWN_SPEED: Rgb = [128, 128, 128];

pub(super) const STOPS: [Rgb; 5] =
    [[44, 98, 188], [108, 176, 226], [250, 218, 88], [240, 128, 46], [190, 24, 34]];

/// The colour of `speed` on a map on which `fastest` is red; both in the same unit. Every speed is blue if
/// `fastest` is not positive, and NaN is [`UNKNOWN_SPEED`].
pub fn speed_colour(speed: f64, fastest: f64) -> Rgb {
    if speed.is_nan() {
        return UNKNOWN_SPEED;
    }
    let t = if fastest > 0.0 { (speed / fastest).clamp(0.0, 1.0) } else { 0.0 };
    // ∞/∞ is the fastest
    let position = if t.is_nan() { 4.0 } else { 4.0 * t };
    let k = (position as usize).min(STOPS.len() - 2);
    let part = position - k as f64;
    let blend = |from: u8, to: u8| (f64::from(from) * (1.0 - part) + f64::from(to) * part).round() as u8;
    std::array::from_fn(|i| blend(STOPS[k][i], STOPS[k + 1][i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_of_the_map() {
        assert_eq!(speed_colour(0.0, 2.0), STOPS[0]);
        assert_eq!(speed_colour(1.0, 2.0), STOPS[2]);
        assert_eq!(speed_colour(2.0, 2.0), STOPS[4]);
        assert_eq!(speed_colour(9.0, 2.0), STOPS[4]);
        assert_eq!(speed_colour(f64::INFINITY, f64::INFINITY), STOPS[4]);
        assert_eq!(speed_colour(f64::NAN, 2.0), UNKNOWN_SPEED);
        assert_eq!(speed_colour(3.0, 0.0), STOPS[0]);
    }
}
