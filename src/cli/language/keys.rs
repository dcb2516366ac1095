//! What the keys of a scene mean, with their units and defaults, and what its methods are.
//!
//! Keys that methods declare are described by their declarations; the table here has all others.

use rfm::lower::vocabulary;
use rfm::sph::{KeyInfo, Method, method_reference};

/// The keys of one block that every method has: name; unit of a number; what holds without the key, empty if it must be
/// there; meaning.
type Rows = &'static [(&'static str, &'static str, &'static str, &'static str)];

/// All blocks with their keys; `None` is the scene itself.
const BLOCKS: &[(Option<&str>, Rows)] = &[
    (None, SCENE),
    (Some("box"), BOX),
    (Some("container"), OBSTACLE),
    (Some("obstacle"), OBSTACLE),
    (Some("fluid"), FLUID),
    (Some("solver"), SOLVER),
    (Some("run"), RUN),
    (Some("truth"), TRUTH),
    (Some("probe"), PROBE),
    (Some("flux"), FLUX),
    (Some("picture"), PICTURE),
];

const SCENE: Rows = &[
    ("units", "", "\"SI\"", "the system of units; there is no other one"),
    ("box", "", "", "the block for the room of the simulation; its walls hold the fluid"),
    ("container", "", "the box alone", "the block for a vessel within the box, in which the fluid stays"),
    ("fluid", "", "", "the block for the fluid: where it is at the start, and what it is"),
    ("obstacle", "", "none", "a block for a solid in the fluid; there may be several"),
    ("gravity", "m/s²", "[0, 0, -9.81]", "the acceleration of free fall; may depend on x, y, z and t"),
    ("walls", "", "free_slip", "whether the fluid slips along walls or sticks to them"),
    ("method", "", "wcsph", "how the pressure is found"),
    ("solver", "", "that of the method", "the block for how the method is run"),
    ("run", "", "5 s, a frame every 0.05 s", "the block for how long the simulation runs and what it saves"),
    ("truth", "", "none", "the block for a known solution, with which the run compares the flow"),
    ("probe", "", "none", "a block with a name for something that is measured; there may be several"),
    ("picture", "", "the whole box", "the block for how pictures are drawn"),
    ("tolerance", "", "none", "the largest error of ω that is accepted for the obstacles"),
];

const BOX: Rows = &[
    ("min", "m", "[0, 0, 0]", "the lowest corner"),
    ("max", "m", "", "the highest corner"),
    (
        "restitution",
        "",
        "0.5",
        "the part of its normal speed with which a particle that hits a wall bounces off, 0 … 1",
    ),
    (
        "friction",
        "",
        "0",
        "the coefficient of friction of particles that hit a wall; a fluid that rests on a wall is held off it by pressure, and feels no friction",
    ),
];

const OBSTACLE: Rows = &[
    ("solid", "", "", "the solid, by its name or written here"),
    (
        "restitution",
        "",
        "0.5",
        "the part of its normal speed with which a particle that hits it bounces off, 0 … 1",
    ),
    (
        "friction",
        "",
        "0",
        "the coefficient of friction of particles that hit it; a fluid that rests on it is held off by pressure, and feels no friction",
    ),
    ("walls", "", "that of the scene", "whether the fluid slips along it or sticks to it"),
    (
        "surface_velocity",
        "m/s",
        "[0, 0, 0]",
        "how fast its surface moves within itself, as a belt does; may depend on x, y, z and t",
    ),
];

const FLUID: Rows = &[
    ("shape", "", "", "where the fluid is at the start: a solid"),
    (
        "fill",
        "",
        "below",
        "which part of the shape is filled where there are fewer particles than fit: from below, or the middle",
    ),
    ("particles", "", "as the method says, or as many as fill the shape", "the number of particles"),
    ("density", "kg/m³", "998.29", "the density at rest"),
    ("mass", "kg", "0.02", "the mass of a particle, unless `spacing` stands in its place"),
    (
        "spacing",
        "m",
        "from the mass",
        "the distance of neighbouring particles, from which their mass follows",
    ),
    ("viscosity", "Pa·s", "that of the method", "the dynamic viscosity"),
    ("surface_tension", "N/m", "that of the method", "the surface tension"),
    (
        "support_radius",
        "m",
        "that of the method",
        "how far a particle feels others: the support of the kernel",
    ),
    ("velocity", "m/s", "[0, 0, 0]", "the velocity at the start; may depend on x, y and z"),
    ("jitter", "", "0", "random displacement of the places at the start, as a part of the spacing, 0 … 1"),
    ("seed", "", "1", "the seed of that displacement: a whole number"),
];

const SOLVER: Rows =
    &[("precision", "", "auto, that of the method", "the precision of the sums over neighbours")];

const RUN: Rows = &[
    ("dt", "s", "as long as is stable", "the length of every step"),
    ("until", "s", "5", "the simulated time at which the run ends"),
    ("save_every", "s", "0.05", "the simulated time between frames"),
    (
        "checkpoint_every",
        "s",
        "with every frame",
        "the simulated time between checkpoints, from which a run goes on",
    ),
];

const TRUTH: Rows = &[
    ("pressure", "Pa", "not compared", "the pressure, by a formula of x, y, z and t"),
    ("velocity", "m/s", "not compared", "the velocity, by three formulas of x, y, z and t"),
    ("front", "m", "not compared", "how far along x the fluid has come on the floor, by a formula of t"),
    ("from", "s", "0", "the time from which on this holds"),
];

const PROBE: Rows = &[
    (
        "height",
        "",
        "",
        "measures the height of the surface, or of dry ground, in m, above a place [x, y], in m",
    ),
    ("pressure", "", "", "measures the pressure, in Pa, at a place, in m"),
    ("velocity", "", "", "measures the velocity, in m/s, at a place, in m"),
    ("force", "", "", "measures the force on an obstacle, in N, and its torque, in N·m"),
    ("flux", "", "", "the block for a plane: measures how much flows through it, in kg/s"),
    ("energy", "", "", "measures the energies of the fluid with this name, in J"),
    ("audit", "", "", "tells how far energy, volume and compression of the fluid with this name are off"),
    ("about", "m", "[0, 0, 0]", "the point about which the torque of a `force` is taken"),
    ("every", "s", "that of the frames", "the simulated time between samples"),
    ("from", "s", "no mean", "asks for the mean of all samples from this time on, with its standard error"),
    ("known", "that of the figures", "nothing", "what the mean is to be: the run says how far off it is"),
];

const FLUX: Rows = &[
    ("point", "m", "", "a point of the plane"),
    ("normal", "", "", "the direction in which the flow counts as positive; of any length"),
];

const PICTURE: Rows = &[
    (
        "camera",
        "",
        "from the front, right and above",
        "the direction from the scene to the eye, of any length",
    ),
    ("look_at", "m", "the middle of the box", "the place in the middle of the picture"),
    ("zoom", "", "1", "how many times as large as if the whole box were seen, 0.05 … 20"),
    ("cut", "", "auto", "the part of the obstacles that is taken away: `y <= 0.5`, `auto` or `none`"),
    ("hide", "", "none", "obstacles that are not drawn, by their names"),
    ("glass", "", "none", "obstacles that are drawn clear, by their names"),
];

/// What a key of a block means under a method; empty if there is no such key. `None` is the block of the
/// scene itself, or an unknown method.
pub(in crate::cli) fn about(block: Option<&str>, key: &str, method: Option<Method>) -> String {
    let declared = |method: Method| {
        method.info().keys.into_iter().find(|own| own.name == key && Some(own.block.name()) == block)
    };
    let own = match method {
        Some(method) => declared(method),
        None => Method::all().into_iter().find_map(declared),
    };
    if let Some(KeyInfo { about, unit, accepts, default, .. }) = own {
        let unit = unit.map_or(String::new(), |unit| format!(", in {unit}"));
        return format!("{about}{unit}; accepts {accepts}; by default {default}");
    }
    let rows = BLOCKS.iter().find(|(known, _)| *known == block).map_or(&[][..], |(_, rows)| rows);
    let Some((_, unit, default, about)) = rows.iter().find(|(name, ..)| *name == key) else {
        return String::new();
    };
    let mut words = (*about).to_string();
    if !unit.is_empty() {
        words += &format!(", in {unit}");
    }
    let words_of_values = vocabulary::words(key);
    if !words_of_values.is_empty() && !words_of_values.iter().any(|word| words.contains(word.as_str())) {
        words += &format!("; accepts {}", words_of_values.join(", "));
    }
    if !default.is_empty() {
        words += &format!("; by default {default}");
    }
    words
}

/// The names of all blocks; `None` is the scene itself.
pub(in crate::cli) fn blocks() -> impl Iterator<Item = Option<&'static str>> {
    BLOCKS.iter().map(|(name, _)| *name)
}

/// What a word that is the value of a key means: so far those of `method`.
pub(in crate::cli) fn about_word(key: &str, word: &str) -> Option<String> {
    if key != "method" {
        return None;
    }
    Some(method_reference(Method::named(word)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_is_described() {
        for (block, rows) in BLOCKS {
            for method in Method::all() {
                for key in vocabulary::keys(*block, method) {
                    assert!(!about(*block, key, Some(method)).is_empty(), "{block:?} {key} of {method:?}");
                }
            }
            for (key, ..) in *rows {
                let known = vocabulary::keys(*block, Method::default());
                assert!(known.contains(key), "{block:?} has no key {key}");
            }
        }
    }

    #[test]
    fn a_key_means_what_its_block_and_its_method_say() {
        let method = Method::named("wcsph");
        assert!(about(Some("run"), "until", method).contains("in s; by default 5"));
        assert_ne!(about(Some("truth"), "from", method), about(Some("probe"), "from", method));
        assert!(about(Some("fluid"), "sound_speed", method).contains("in m/s"));
        assert!(about(None, "walls", method).contains("accepts free_slip, no_slip; by default free_slip"));
        assert_eq!(about(Some("fluid"), "sound_speed", Method::named("dfsph")), "");
        assert_eq!(about_word("fill", "below"), None);
        assert!(about_word("method", "dfsph").unwrap().contains("Unless the scene says otherwise"));
    }
}
