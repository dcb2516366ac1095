//! Words of OpenSCAD, POV-Ray, GLSL and Python, and what they are called here.

/// How a choice is written.
pub const CONDITION: &str = "write `if x <= 1 then a else b`: a where the condition holds, b elsewhere; shapes are joined by `and` and `or`";

/// What is written in place of a remainder.
pub const REMAINDER: &str = "write `mod(a, b)`; shapes repeat by `shape.repeat([1, 0, 0], [6, 1, 1])`";

/// What is written in place of an operator that is a word; `None` if the word is no operator elsewhere.
pub(super) fn operator(word: &str) -> Option<&'static str> {
    Some(match word {
        "mod" | "rem" => REMAINDER,
        "xor" => "write `(a or b) \\ (a and b)`",
        "div" => "write `a/b`",
        "not" => "write `a and not b`, or `a \\ b`",
        "union" | "plus" | "OR" | "Or" => "write `a or b`",
        "intersect" | "intersection" | "with" | "AND" | "And" => "write `a and b`",
        "minus" | "without" | "except" | "difference" | "subtract" => "write `a \\ b`",
        "if" | "then" | "else" | "when" | "unless" => CONDITION,
        "is" | "eq" | "equals" => "write `a <= b` or `a >= b`",
        "le" | "lt" => "write `a <= b`",
        "ge" | "gt" => "write `a >= b`",
        "for" => "write `any i in 0..6: …` with the repeated shape behind the colon",
        _ => return None,
    })
}

/// What begins an item in place of a word that begins one elsewhere.
pub(super) fn item(word: &str) -> Option<&'static str> {
    Some(match word {
        "union" => {
            "a solid has a name, and shapes are joined by `or`: write `solid part = sphere(1) or box()`"
        }
        "difference" => "a solid has a name, and `\\` is without: write `solid part = sphere(1) \\ box()`",
        "intersection" => {
            "a solid has a name, and shapes are cut by `and`: write `solid part = sphere(1) and box()`"
        }
        "translate" | "rotate" | "scale" | "mirror" | "color" | "hull" | "minkowski" | "linear_extrude"
        | "rotate_extrude" => {
            "methods stand behind a shape that has a name: write `solid part = sphere(1).move([1, 0, 0])`"
        }
        "module" | "function" | "def" | "func" | "fun" | "lambda" | "macro" => {
            "a function is written `fn name(a, b = 1) = …`"
        }
        "var" | "const" | "define" | "float" | "double" | "int" | "real" | "number" | "set" | "uniform"
        | "vec2" | "vec3" | "local" | "auto" => {
            "write `let name = …`, or `param name = …` for a number that can be set from outside"
        }
        "cube" | "cuboid" | "block" => {
            "a solid has a name, and a box two corners: write `solid part = box([0, 0, 0], [1, 1, 1])`"
        }
        "object" | "shape" | "body" | "part" | "model" | "obstacle" | "mesh" => "write `solid name = …`",
        "isosurface" | "blob" | "merge" | "csg" => {
            "write `solid name = …` with an inequality, as in `x² + y² <= 1 and 0 <= z <= 1`"
        }
        "simulation" | "world" | "domain" | "fluid" | "run" => {
            "it belongs to a scene: write `scene name { … }`"
        }
        "include" | "use" | "from" | "require" => {
            "files are imported by name, as in `import \"parts.rfm\" as parts`; their solids are then `parts.…`"
        }
        "for" | "while" | "repeat" => {
            "shapes repeat within a solid: write `solid row = any i in 0..6: sphere(0.3).move([i, 0, 0])`"
        }
        "if" | "else" | "switch" => CONDITION,
        "return" | "print" | "echo" | "show" | "render" | "export" | "assert" => {
            "there are no statements: a function is `fn name(a) = …`, and `rfm check` lists the solids"
        }
        _ => return None,
    })
}

/// The method that does what a function or method of this name does elsewhere.
pub fn method(name: &str) -> Option<&'static str> {
    Some(match name {
        "translate" | "translated" | "trans" | "shift" | "shifted" | "displace" | "moved" | "offset_by"
        | "move" | "moveTo" | "transformed" => "move",
        "rotated" | "rotate" | "rot" | "turn" => "rotate",
        "rotate_x" | "rotateX" | "rotx" | "rotX" | "rot_x" | "rotate_X" | "rotateAboutX" => "rotate_x",
        "rotate_y" | "rotateY" | "roty" | "rotY" | "rot_y" | "rotate_Y" => "rotate_y",
        "rotate_z" | "rotateZ" | "rotz" | "rotZ" | "rot_z" | "rotate_Z" => "rotate_z",
        "scaled" | "scale" | "resize" => "scale",
        "mirrored" | "mirror" | "reflect" | "flip" => "mirror",
        _ => return None,
    })
}

/// A method with arguments as they were written for the function of this name; `None` if it is no transformation.
pub fn method_call(name: &str, arguments: &str) -> Option<String> {
    let method = method(name)?;
    Some(match method {
        "rotate" => turned(arguments),
        "rotate_x" | "rotate_y" | "rotate_z" => format!(".{method}({})", in_degrees(arguments)),
        _ if arguments.contains(',') && !arguments.contains('[') => {
            format!(".{method}([{}])", arguments.trim())
        }
        _ => format!(".{method}({})", arguments.trim()),
    })
}

/// The method that makes a solid of a profile, for the OpenSCAD operator of this name with these arguments.
pub fn of_a_profile(name: &str, arguments: &str) -> Option<String> {
    match name {
        "rotate_extrude" => Some(".revolve()".into()),
        "linear_extrude" => {
            let named = |part: &'_ str| {
                part.split_once('=').map(|(name, value)| (name.trim().to_owned(), value.trim().to_owned()))
            };
            let by_name = arguments.split(',').filter_map(named).find(|(name, _)| name == "height");
            let first = arguments.split(',').next().unwrap_or_default().trim();
            let plain = (!first.is_empty() && !first.contains('=')).then(|| first.to_owned());
            let height = by_name.map(|(_, value)| value).or(plain).unwrap_or_else(|| "1".into());
            Some(format!(".extrude(0, {height})"))
        }
        _ => None,
    }
}

/// A shape of OpenSCAD with its arguments, as it is called here; `None` for another name, or arguments that it does not have.
pub fn shape(name: &str, arguments: &str) -> Option<String> {
    let (mut size, mut is_centred) = (None, false);
    for part in at_commas(arguments) {
        match part.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
            None if size.is_none() => size = Some(part.to_string()),
            Some(("size" | "r", value)) => size = Some(value.to_string()),
            Some(("d", value)) => size = Some(format!("{}/2", operand(value))),
            Some(("center", value)) => is_centred = value == "true",
            None | Some(_) => return None,
        }
    }
    let size = size.unwrap_or_else(|| "1".into());
    let sides: Vec<&str> = match size.strip_prefix('[').and_then(|inner| inner.strip_suffix(']')) {
        Some(inner) => at_commas(inner),
        None => vec![&size],
    };
    match (name, &sides[..]) {
        ("cube", [side]) => Some(cuboid([side; 3], is_centred)),
        ("cube", [x, y, z]) => Some(cuboid([x, y, z], is_centred)),
        ("square", [side]) => Some(rectangle([side; 2], is_centred)),
        ("square", [w, h]) => Some(rectangle([w, h], is_centred)),
        ("circle", [r]) => Some(format!("(x^2 + y^2 <= {}^2)", operand(r))),
        _ => None,
    }
}

/// The arguments between the commas that stand outside of brackets.
fn at_commas(text: &str) -> Vec<&str> {
    let mut depth = 0_i32;
    let is_end = |c: char| {
        depth += match c {
            '(' | '[' => 1,
            ')' | ']' => -1,
            _ => 0,
        };
        c == ',' && depth == 0
    };
    text.split(is_end).map(str::trim).filter(|part| !part.is_empty()).collect()
}

fn cuboid([x, y, z]: [&str; 3], is_centred: bool) -> String {
    if is_centred {
        format!("box(-[{x}, {y}, {z}]/2, [{x}, {y}, {z}]/2)")
    } else {
        format!("box([0, 0, 0], [{x}, {y}, {z}])")
    }
}

fn rectangle([w, h]: [&str; 2], is_centred: bool) -> String {
    let polygon = format!("polygon([[0, 0], [{w}, 0], [{w}, {h}], [0, {h}]])");
    if is_centred { format!("{polygon}.move(-[{w}, {h}, 0]/2)") } else { polygon }
}

/// The turns that `rotate(…)` means elsewhere: three angles about the axes, or one about z.
pub fn turned(arguments: &str) -> String {
    let arguments = arguments.trim();
    let Some(angles) = arguments.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) else {
        return format!(".rotate_z({})", in_degrees(arguments));
    };
    let axes = ["x", "y", "z"].into_iter().zip(angles.split(','));
    let turns: Vec<String> = axes
        .filter(|(_, angle)| angle.trim().parse() != Ok(0.0))
        .map(|(axis, angle)| format!(".rotate_{axis}({})", in_degrees(angle)))
        .collect();
    if turns.is_empty() { ".rotate_z(0)".into() } else { turns.concat() }
}

/// An angle as it was written, with the unit `deg` if it is a number alone.
pub fn in_degrees(angle: &str) -> String {
    let angle = angle.trim();
    if angle.parse::<f64>().is_ok() { format!("{angle} deg") } else { angle.to_string() }
}

/// An expression as the operand of `and`, `or` or `\`: in brackets, unless it is one name or one call.
pub fn operand(text: &str) -> String {
    let mut depth = 0_i32;
    let is_one = text.chars().all(|c| {
        depth += match c {
            '(' | '[' => 1,
            ')' | ']' => -1,
            _ => 0,
        };
        depth > 0 || c.is_alphanumeric() || matches!(c, ')' | ']' | '_' | '.')
    });
    if is_one { text.to_string() } else { format!("({text})") }
}

/// Names of units that are written in full and often misspelt.
pub const UNITS_IN_FULL: [&str; 18] = [
    "meter",
    "metre",
    "meters",
    "millimeter",
    "millimetre",
    "millimeters",
    "centimeter",
    "centimetre",
    "centimeters",
    "degree",
    "degrees",
    "radian",
    "second",
    "seconds",
    "millisecond",
    "kilogram",
    "newton",
    "pascal",
];

/// A quantity with a unit of this language for one with a unit that it does not have.
pub fn quantity(number: &str, word: &str) -> Option<String> {
    let (factor, unit) = match word {
        "meter" | "meters" | "metre" | "metres" | "M" => (1.0, "m"),
        "millimeter" | "millimeters" | "millimetre" | "millimetres" | "MM" | "Mm" => (1.0, "mm"),
        "centimeter" | "centimeters" | "centimetre" | "centimetres" | "CM" => (1.0, "cm"),
        "Pas" => (1.0, "Pa·s"),
        "mPas" => (1.0, "mPa·s"),
        "dm" => (10.0, "cm"),
        "nm" => (1e-3, "um"),
        "micron" | "microns" => (1.0, "um"),
        "in" | "inch" | "inches" | "mil" => (if word == "mil" { 0.0254 } else { 25.4 }, "mm"),
        "ft" | "foot" | "feet" => (30.48, "cm"),
        "yd" | "yard" | "yards" => (91.44, "cm"),
        "degree" | "degrees" | "Deg" | "DEG" | "grad" => (if word == "grad" { 0.9 } else { 1.0 }, "deg"),
        "radian" | "radians" => (1.0, "rad"),
        "turn" | "turns" | "rev" | "revs" => (360.0, "deg"),
        "sec" | "secs" | "second" | "seconds" | "S" => (1.0, "s"),
        "µs" | "μs" => (1.0, "us"),
        "ns" => (1e-3, "us"),
        "msec" | "millisecond" | "milliseconds" => (1.0, "ms"),
        "minute" | "minutes" | "mins" => (1.0, "min"),
        "hour" | "hours" | "hr" => (1.0, "h"),
        "day" | "days" | "d" => (24.0, "h"),
        "kilogram" | "kilograms" | "KG" | "Kg" => (1.0, "kg"),
        "gram" | "grams" => (1.0, "g"),
        "t" | "ton" | "tons" | "tonne" | "tonnes" => (1000.0, "kg"),
        "lb" | "lbs" | "pound" | "pounds" => (0.453_592_37, "kg"),
        "hz" | "HZ" => (1.0, "Hz"),
        "rps" | "rev/s" | "r/s" | "turn/s" | "turns/s" => (60.0, "rpm"),
        "RPM" | "rev/min" | "revs/min" | "r/min" | "rot/min" | "turn/min" | "turns/min" => (1.0, "rpm"),
        "newton" | "newtons" => (1.0, "N"),
        "pascal" | "pascals" | "PA" => (1.0, "Pa"),
        "hPa" | "mbar" => (100.0, "Pa"),
        "bar" => (100.0, "kPa"),
        "atm" => (101.325, "kPa"),
        "psi" => (6.894_757, "kPa"),
        "poise" | "P" => (0.1, "Pa·s"),
        "cP" => (1.0, "mPa·s"),
        "dyn" => (0.01, "mN"),
        "dyn/cm" => (1.0, "mN/m"),
        "l" | "L" | "liter" | "liters" | "litre" | "litres" => (1e-3, "m^3"),
        "ml" | "mL" => (1.0, "cm^3"),
        "mph" => (0.447_04, "m/s"),
        "kph" | "kmh" => (1.0, "km/h"),
        "joule" | "joules" => (1.0, "J"),
        _ => return None,
    };
    if factor == 1.0 {
        return Some(format!("{number} {unit}"));
    }
    let value: f64 = number.parse().ok()?;
    let product = value * factor;
    // without the last digits, which the product does not have
    let rounded: f64 = format!("{product:.12e}").parse().ok()?;
    Some(format!("{rounded} {unit}"))
}

/// The key of a scene that has another name elsewhere; `None` if none is known.
pub fn key(word: &str) -> Option<&'static str> {
    Some(match word {
        "size" | "corner" | "upper" | "high" => "max",
        "lower" | "low" | "origin" => "min",
        "rho" | "rho0" | "rest_density" | "dichte" => "density",
        "mu" | "visc" | "dynamic_viscosity" => "viscosity",
        "sigma" | "tension" => "surface_tension",
        "dx" | "dp" | "resolution" | "particle_spacing" | "radius" | "particle_radius" => "spacing",
        "h" | "smoothing_length" | "kernel_radius" => "support_radius",
        "n" | "count" | "number" | "num_particles" => "particles",
        "g" | "acceleration" => "gravity",
        "c" | "c0" | "speed_of_sound" => "sound_speed",
        "end" | "end_time" | "t_end" | "tmax" | "duration" | "time" | "stop" => "until",
        "timestep" | "time_step" | "step" => "dt",
        "output" | "save" | "interval" | "output_interval" | "write_interval" | "frames" | "write_every" => {
            "save_every"
        }
        "domain" | "bounds" | "tank" => "box",
        "vessel" | "bowl" => "container",
        "rigid" | "body" | "object" | "solid" | "obstacles" => "obstacle",
        "liquid" | "water" | "fluids" => "fluid",
        "scheme" | "sph" => "method",
        "alpha" => "artificial_viscosity",
        "shape" | "name" => "solid",
        "region" | "geometry" | "block" => "shape",
        "sensor" | "gauge" | "measure" => "probe",
        "eye" | "view" | "look_from" | "viewpoint" => "camera",
        "target" | "lookat" | "focus" => "look_at",
        "magnification" | "magnify" => "zoom",
        "ortho" | "orthographic" | "orthogonal" | "parallel" | "perspective" => "projection",
        "section" | "clip" | "slice" | "opening" => "cut",
        "invisible" | "hidden" | "without" => "hide",
        "transparent" | "translucent" | "transparency" => "glass",
        "render" | "image" | "pictures" | "plot" => "picture",
        _ => return None,
    })
}

/// The value of a key that is nearest to one of other solvers, and why; `None` if none is known.
pub fn value(key: &str, word: &str) -> Option<(&'static str, &'static str)> {
    Some(match word {
        _ if key != "method" => return None,
        "pcisph" | "iisph" | "pbf" | "isph" | "pbd" | "icsph" => ("dfsph", "which solves for the pressure"),
        "sph"
        | "delta_sph"
        | "deltasph"
        | "dsph"
        | "tait"
        | "weakly_compressible"
        | "wc_sph"
        | "tvf"
        | "edac" => ("wcsph", "which takes the pressure from the density"),
        _ => return None,
    })
}

/// A number that GLSL or C writes with a letter behind it, as `1.5f`.
pub fn is_letter_of_type(word: &str) -> bool {
    ["f", "F", "u", "U", "lf", "LF"].contains(&word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operands_keep_their_meaning() {
        for (text, expected) in [
            ("a", "a"),
            ("sphere(1, [0, 0, 2]).move([1, 0, 0])", "sphere(1, [0, 0, 2]).move([1, 0, 0])"),
            ("x <= 0 and box()", "(x <= 0 and box())"),
            ("sphere(1) or box()", "(sphere(1) or box())"),
            ("-x", "(-x)"),
        ] {
            assert_eq!(operand(text), expected);
        }
    }

    #[test]
    fn turns_of_other_languages() {
        assert_eq!(turned("[0, 90, 45]"), ".rotate_y(90 deg).rotate_z(45 deg)");
        assert_eq!(turned("45"), ".rotate_z(45 deg)");
        assert_eq!(turned("30 deg"), ".rotate_z(30 deg)");
        assert_eq!(quantity("2", "turns").as_deref(), Some("720 deg"));
        assert_eq!(quantity("0.1", "bar").as_deref(), Some("10 kPa"));
    }
}
