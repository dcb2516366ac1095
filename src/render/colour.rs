//! Maps from values to colours. The first is blue for low, yellow for medium, red for high values.
//!
//! Every map is linear in the value, so pictures of different runs can be compared if their ranges are equal.
//! People with red–green blindness can read them: only viridis and cividis have a green, and these two also
//! become steadily lighter.

/// An sRGB colour with 8 bits per channel: red, green, blue.
pub type Rgb = [u8; 3];

/// The colour of a particle whose value is NaN.
pub const UNKNOWN: Rgb = [128, 128, 128];

/// A map from values to colours, equal to the map of this name in the viewer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourMap {
    /// Dark blue, light blue, yellow, orange, red.
    #[default]
    BlueYellowRed,
    /// From dark violet to yellow, evenly in lightness.
    Viridis,
    /// From dark blue to yellow, evenly in lightness; it looks alike to people with any colour vision.
    Cividis,
    /// Blue below the middle and red above it, for values around a reference.
    BlueWhiteRed,
    /// Dark to light grey, for print.
    Grey,
}

impl ColourMap {
    /// All maps.
    pub const ALL: [Self; 5] =
        [Self::BlueYellowRed, Self::Viridis, Self::Cividis, Self::BlueWhiteRed, Self::Grey];

    /// The name on command lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::BlueYellowRed => "blue-yellow-red",
            Self::Viridis => "viridis",
            Self::Cividis => "cividis",
            Self::BlueWhiteRed => "blue-white-red",
            Self::Grey => "grey",
        }
    }

    /// Colours at equal distances, between which the map is linear.
    pub(super) fn stops(self) -> &'static [Rgb] {
        match self {
            Self::BlueYellowRed => {
                &[[44, 98, 188], [108, 176, 226], [250, 218, 88], [240, 128, 46], [190, 24, 34]]
            }
            Self::Viridis => &[
                [68, 1, 84],
                [71, 45, 123],
                [59, 82, 139],
                [44, 114, 142],
                [33, 145, 140],
                [40, 174, 128],
                [94, 201, 98],
                [173, 220, 48],
                [253, 231, 37],
            ],
            Self::Cividis => &[
                [0, 34, 78],
                [18, 53, 112],
                [59, 73, 108],
                [87, 93, 109],
                [112, 113, 115],
                [138, 134, 120],
                [165, 156, 116],
                [195, 179, 105],
                [225, 204, 85],
                [254, 232, 56],
            ],
            Self::BlueWhiteRed => {
                &[[42, 74, 158], [125, 159, 211], [239, 239, 239], [221, 143, 121], [158, 34, 48]]
            }
            Self::Grey => &[[28, 28, 28], [242, 242, 242]],
        }
    }

    /// The colour of a value on the map over the range `low` … `high`, all in the same unit. Values beyond
    /// the range have the colours of its ends. If the range is empty, all values have the colour of the low
    /// end. NaN has a separate grey.
    pub fn colour(self, value: f64, (low, high): (f64, f64)) -> Rgb {
        if value.is_nan() {
            return UNKNOWN;
        }
        let t = if high > low { ((value - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
        let stops = self.stops();
        let last = (stops.len() - 1) as f64;
        // ∞/∞ counts as the greatest
        let position = if t.is_nan() { last } else { last * t };
        let k = (position as usize).min(stops.len() - 2);
        let part = position - k as f64;
        let blend = |from: u8, to: u8| (f64::from(from) * (1.0 - part) + f64::from(to) * part).round() as u8;
        std::array::from_fn(|i| blend(stops[k][i], stops[k + 1][i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middle_of_the_map() {
        let map = ColourMap::default();
        let stops = map.stops();
        let of = |value, low, high| map.colour(value, (low, high));
        assert_eq!([of(0.0, 0.0, 2.0), of(1.0, 0.0, 2.0), of(2.0, 0.0, 2.0)], [stops[0], stops[2], stops[4]]);
        assert_eq!(
            [of(-3.0, -2.0, 2.0), of(0.0, -2.0, 2.0), of(9.0, -2.0, 2.0)],
            [stops[0], stops[2], stops[4]]
        );
        assert_eq!(of(f64::INFINITY, 0.0, f64::INFINITY), stops[4]);
        assert_eq!(of(f64::NAN, 0.0, 2.0), UNKNOWN);
        assert_eq!((of(3.0, 0.0, 0.0), of(3.0, 4.0, 1.0)), (stops[0], stops[0]));
    }

    #[test]
    fn the_maps_are_those_of_the_viewer() {
        let page = include_str!("../view/page/colours.js");
        for map in ColourMap::ALL {
            let hex = |[r, g, b]: &Rgb| format!("\"{r:02x}{g:02x}{b:02x}\"");
            let list: Vec<String> = map.stops().iter().map(hex).collect();
            let known = page.lines().find(|line| line.contains(&format!("[{}]", list.join(", "))));
            let name = known.unwrap_or_else(|| panic!("{}", map.name())).replace('–', "-");
            assert!(name.contains(map.name()), "{name}");
        }
    }
}
