//! The units that files of meshes may be in. Meshes themselves are in metres.

/// A unit of length in files.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LengthUnit {
    /// The name on the command line.
    pub name: &'static str,
    /// The name of several of them, for comments and messages.
    pub plural: &'static str,
    /// The name in 3MF files.
    pub(super) in_3mf: &'static str,
    /// How many of them are a metre.
    pub per_metre: f64,
}

impl LengthUnit {
    /// The unit of meshes.
    pub const METRE: Self = Self { name: "m", plural: "metres", in_3mf: "meter", per_metre: 1.0 };
    /// The unit that most programs take the numbers of an STL file for.
    pub const MILLIMETRE: Self =
        Self { name: "mm", plural: "millimetres", in_3mf: "millimeter", per_metre: 1e3 };

    /// All units, in the order in which help and messages name them. They are those of 3MF.
    pub const ALL: [Self; 6] = [
        Self::METRE,
        Self { name: "cm", plural: "centimetres", in_3mf: "centimeter", per_metre: 1e2 },
        Self::MILLIMETRE,
        Self { name: "um", plural: "micrometres", in_3mf: "micron", per_metre: 1e6 },
        Self { name: "in", plural: "inches", in_3mf: "inch", per_metre: 1.0 / 0.0254 },
        Self { name: "ft", plural: "feet", in_3mf: "foot", per_metre: 1.0 / 0.3048 },
    ];

    /// The unit of a name; `None` if there is no such unit.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|unit| unit.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_found_by_name_and_have_their_size() {
        for unit in LengthUnit::ALL {
            assert_eq!(LengthUnit::named(unit.name), Some(unit));
        }
        assert_eq!(LengthUnit::named("furlong"), None);
        let metres = |name: &str| 1.0 / LengthUnit::named(name).unwrap().per_metre;
        assert!((12.0 * metres("in") - metres("ft")).abs() < 1e-15);
        assert!((metres("cm") - 10.0 * metres("mm")).abs() < 1e-15);
    }
}
