//! Quantities: dimensions, units (a factor to SI and the exponents of metre, kilogram, second and radian),
//! and the bounds that a number may have to keep.

use std::fmt;

/// A physical dimension, as the exponents of m, kg, s and rad.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dimension {
    /// Exponent of the metre.
    pub length: i8,
    /// Exponent of the kilogram.
    pub mass: i8,
    /// Exponent of the second.
    pub time: i8,
    /// Exponent of the radian.
    pub angle: i8,
}

impl Dimension {
    /// The dimension of a plain number.
    pub const NONE: Self = Self::new(0, 0, 0, 0);
    /// Length, m.
    pub const LENGTH: Self = Self::new(1, 0, 0, 0);
    /// Mass, kg.
    pub const MASS: Self = Self::new(0, 1, 0, 0);
    /// Time, s.
    pub const TIME: Self = Self::new(0, 0, 1, 0);
    /// Angle, rad.
    pub const ANGLE: Self = Self::new(0, 0, 0, 1);
    /// How often in a second.
    pub const FREQUENCY: Self = Self::new(0, 0, -1, 0);
    /// An angle in a second.
    pub const TURN_RATE: Self = Self::new(0, 0, -1, 1);
    /// Speed, m/s.
    pub const SPEED: Self = Self::new(1, 0, -1, 0);
    /// Acceleration, m/s².
    pub const ACCELERATION: Self = Self::new(1, 0, -2, 0);
    /// Density, kg/m³.
    pub const DENSITY: Self = Self::new(-3, 1, 0, 0);
    /// Dynamic viscosity, Pa·s.
    pub const VISCOSITY: Self = Self::new(-1, 1, -1, 0);
    /// Surface tension, N/m.
    pub const TENSION: Self = Self::new(0, 1, -2, 0);
    /// Energy, J.
    pub const ENERGY: Self = Self::new(2, 1, -2, 0);
    /// Energy per mass, J/kg.
    pub const SPECIFIC_ENERGY: Self = Self::new(2, 0, -2, 0);
    /// One over a length, 1/m. Scenes write it as `m^-1`.
    pub const PER_LENGTH: Self = Self::new(-1, 0, 0, 0);
    /// Force, N.
    pub const FORCE: Self = Self::new(1, 1, -2, 0);
    /// Pressure, Pa.
    pub const PRESSURE: Self = Self::new(-1, 1, -2, 0);
    /// Mass flow, kg/s.
    pub const MASS_FLOW: Self = Self::new(0, 1, -1, 0);

    /// The dimension m^length · kg^mass · s^time · rad^angle.
    pub const fn new(length: i8, mass: i8, time: i8, angle: i8) -> Self {
        Self { length, mass, time, angle }
    }

    /// The SI unit as a scene writes it; `None` for a plain number.
    pub fn unit(self) -> Option<&'static str> {
        const UNITS: [(Dimension, &str); 15] = [
            (Dimension::LENGTH, "m"),
            (Dimension::MASS, "kg"),
            (Dimension::TIME, "s"),
            (Dimension::ANGLE, "rad"),
            (Dimension::SPEED, "m/s"),
            (Dimension::ACCELERATION, "m/s^2"),
            (Dimension::DENSITY, "kg/m^3"),
            (Dimension::VISCOSITY, "Pa·s"),
            (Dimension::TENSION, "N/m"),
            (Dimension::ENERGY, "J"),
            (Dimension::SPECIFIC_ENERGY, "J/kg"),
            (Dimension::PER_LENGTH, "m^-1"),
            (Dimension::FORCE, "N"),
            (Dimension::PRESSURE, "Pa"),
            (Dimension::MASS_FLOW, "kg/s"),
        ];
        UNITS.into_iter().find(|(dimension, _)| *dimension == self).map(|(_, unit)| unit)
    }

    /// The dimension of a product.
    pub fn times(self, other: Self) -> Self {
        self.plus(other, 1)
    }

    /// The dimension of a quotient.
    pub fn per(self, other: Self) -> Self {
        self.plus(other, -1)
    }

    fn plus(self, other: Self, times: i8) -> Self {
        let add = |a: i8, b: i8| a.saturating_add(b.saturating_mul(times));
        Self {
            length: add(self.length, other.length),
            mass: add(self.mass, other.mass),
            time: add(self.time, other.time),
            angle: add(self.angle, other.angle),
        }
    }
}

/// A condition on the value of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// Finite and above zero.
    Positive,
    /// Finite and at least zero.
    NotNegative,
    /// From 0 to 1.
    Fraction,
    /// At least the first number, and below the second.
    From(f64, f64),
}

impl Bound {
    /// Whether the bound admits a number. No bound admits an infinity or NaN.
    pub fn admits(self, number: f64) -> bool {
        number.is_finite()
            && match self {
                Self::Positive => number > 0.0,
                Self::NotNegative => number >= 0.0,
                Self::Fraction => (0.0..=1.0).contains(&number),
                Self::From(least, limit) => (least..limit).contains(&number),
            }
    }

    /// What the bound demands, as text that follows the name of a number: "must be positive".
    pub fn demand(self) -> String {
        match self {
            Self::Positive => "must be positive".into(),
            Self::NotNegative => "must not be negative".into(),
            Self::Fraction => "must lie between 0 and 1".into(),
            Self::From(least, limit) => format!("must be at least {least:?} and below {limit}"),
        }
    }
}

impl fmt::Display for Bound {
    /// Writes which numbers the bound admits: "a finite number above 0".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Positive => write!(f, "a finite number above 0"),
            Self::NotNegative => write!(f, "a finite number of at least 0"),
            Self::Fraction => write!(f, "a number from 0 to 1"),
            Self::From(least, limit) => write!(f, "a number of at least {least:?} and below {limit}"),
        }
    }
}

/// A unit of measurement, as a scene writes it at a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Size of the unit in SI units: 0.001 for mm.
    pub factor: f64,
    /// The dimension of what the unit measures.
    pub dimension: Dimension,
}

/// A value in SI units as a text in another unit, without the last digits, which the conversion leaves undetermined.
pub fn in_unit(value: f64, unit: Unit, text: &str) -> String {
    let converted = value / unit.factor;
    let rounded: f64 = format!("{converted:.12e}").parse().unwrap_or(converted);
    format!("{rounded} {text}")
}

/// Reads a number with or without a unit, as in `10 deg`, `8mm` or `0.5`. The dimension is `None` if there is no unit.
///
/// # Errors
/// What is wrong with the text, in words.
pub fn parse_quantity(text: &str) -> Result<(f64, Option<Dimension>), String> {
    let (number, unit) = number_and_unit(text);
    let number: f64 = number.parse().map_err(|_| format!("`{}` is not a number", text.trim()))?;
    if unit.is_empty() {
        return Ok((number, None));
    }
    let unit = parse_unit(unit).ok_or_else(|| format!("`{unit}` is not a unit"))?;
    Ok((number * unit.factor, Some(unit.dimension)))
}

/// A text as a number and the unit behind it, without blanks around them; the unit is empty if there is none.
pub fn number_and_unit(text: &str) -> (&str, &str) {
    let text = text.trim();
    let is_exponent = |at: usize, c: char| {
        matches!(c, 'e' | 'E')
            && text[at + 1..].trim_start_matches(['+', '-']).starts_with(|c: char| c.is_ascii_digit())
    };
    let begins_unit = |(at, c): &(usize, char)| (c.is_alphabetic() || *c == '°') && !is_exponent(*at, *c);
    let digits = text.find(|c: char| c.is_ascii_digit()).unwrap_or(text.len());
    let split = text
        .char_indices()
        .skip_while(|(at, _)| *at < digits)
        .find(begins_unit)
        .map_or(text.len(), |(at, _)| at);
    (text[..split].trim(), text[split..].trim())
}

/// Reads a unit in the notation of the grammar: `kg/m^3`, `Pa·s`, `deg/s`. A `/` divides by the next unit
/// only. `None` if a part of the text is not a known unit.
pub fn parse_unit(text: &str) -> Option<Unit> {
    let mut unit = Unit { factor: 1.0, dimension: Dimension::NONE };
    let mut rest = text;
    let mut sign = 1;
    loop {
        let end = rest.find(['/', '·']).unwrap_or(rest.len());
        let (part, power) = split_power(&rest[..end])?;
        let base = base_unit(part)?;
        let power = power * sign;
        unit.factor *= base.factor.powi(i32::from(power));
        unit.dimension = unit.dimension.plus(base.dimension, power);
        let Some(separator) = rest[end..].chars().next() else { return Some(unit) };
        sign = if separator == '/' { -1 } else { 1 };
        rest = &rest[end + separator.len_utf8()..];
    }
}

fn split_power(text: &str) -> Option<(&str, i8)> {
    if let Some(base) = text.strip_suffix('²') {
        return Some((base, 2));
    }
    if let Some(base) = text.strip_suffix('³') {
        return Some((base, 3));
    }
    match text.split_once('^') {
        Some((base, power)) => Some((base, power.parse().ok()?)),
        None => Some((text, 1)),
    }
}

fn base_unit(word: &str) -> Option<Unit> {
    let unit = |factor: f64, dimension: Dimension| Some(Unit { factor, dimension });
    match word {
        "m" => unit(1.0, Dimension::LENGTH),
        "km" => unit(1e3, Dimension::LENGTH),
        "cm" => unit(1e-2, Dimension::LENGTH),
        "mm" => unit(1e-3, Dimension::LENGTH),
        // the sign for micro, or the Greek letter, which looks the same
        "um" | "µm" | "μm" => unit(1e-6, Dimension::LENGTH),
        "kg" => unit(1.0, Dimension::MASS),
        "g" => unit(1e-3, Dimension::MASS),
        "s" => unit(1.0, Dimension::TIME),
        "ms" => unit(1e-3, Dimension::TIME),
        "us" => unit(1e-6, Dimension::TIME),
        "min" => unit(60.0, Dimension::TIME),
        "h" => unit(3600.0, Dimension::TIME),
        "Hz" => unit(1.0, Dimension::FREQUENCY),
        "N" => unit(1.0, Dimension::FORCE),
        "mN" => unit(1e-3, Dimension::FORCE),
        "kN" => unit(1e3, Dimension::FORCE),
        "Pa" => unit(1.0, Dimension::PRESSURE),
        "mPa" => unit(1e-3, Dimension::PRESSURE),
        "kPa" => unit(1e3, Dimension::PRESSURE),
        "MPa" => unit(1e6, Dimension::PRESSURE),
        "J" => unit(1.0, Dimension::ENERGY),
        "kJ" => unit(1e3, Dimension::ENERGY),
        "rad" => unit(1.0, Dimension::ANGLE),
        "deg" | "°" => unit(std::f64::consts::PI / 180.0, Dimension::ANGLE),
        "rpm" => unit(std::f64::consts::PI / 30.0, Dimension::TURN_RATE),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compound_units() {
        let check = |text, factor: f64, dimension| {
            let unit = parse_unit(text).unwrap();
            assert!((unit.factor / factor - 1.0).abs() < 1e-15, "{text}: {}", unit.factor);
            assert_eq!(unit.dimension, dimension, "{text}");
        };
        check("kg/m^3", 1.0, Dimension::DENSITY);
        check("g/cm³", 1000.0, Dimension::DENSITY);
        check("Pa·s", 1.0, Dimension::VISCOSITY);
        check("mPa·s", 1e-3, Dimension::VISCOSITY);
        check("N/m", 1.0, Dimension::TENSION);
        check("kJ/kg", 1e3, Dimension::SPECIFIC_ENERGY);
        check("m^-1", 1.0, Dimension::PER_LENGTH);
        check("m/s^2", 1.0, Dimension::ACCELERATION);
        check("mm", 1e-3, Dimension::LENGTH);
        assert_eq!(parse_unit("furlong"), None);
    }

    #[test]
    fn numbers_with_units() {
        let check = |text: &str, value: f64, dimension| {
            let (found, unit) = parse_quantity(text).unwrap();
            assert!((found - value).abs() <= 1e-15 * value.abs(), "{text}: {found}");
            assert_eq!(unit, dimension, "{text}");
        };
        check("0.5", 0.5, None);
        check(" -1e-3 ", -1e-3, None);
        check("8mm", 8e-3, Some(Dimension::LENGTH));
        check("2e-1 cm", 2e-3, Some(Dimension::LENGTH));
        check("180 deg", std::f64::consts::PI, Some(Dimension::ANGLE));
        check("180°", std::f64::consts::PI, Some(Dimension::ANGLE));
        check("500 ms", 0.5, Some(Dimension::TIME));
        assert!(parse_quantity("inf").unwrap().0.is_infinite());
        for text in ["", "mm", "wide", "1,5", "8 furlong", "8 mm long", "--8"] {
            assert!(parse_quantity(text).is_err(), "{text}");
        }
    }

    #[test]
    fn values_are_shown_in_the_unit_that_they_were_written_in() {
        let unit = |text| parse_unit(text).unwrap();
        assert_eq!(in_unit(0.0008, unit("mm"), "mm"), "0.8 mm");
        assert_eq!(in_unit(45.0 * (std::f64::consts::PI / 180.0), unit("deg"), "deg"), "45 deg");
        assert_eq!(in_unit(f64::INFINITY, unit("mm"), "mm"), "inf mm");
    }
}
