//! Functions, values and methods of OpenSCAD, POV-Ray, GLSL and Python: how to write here what they do there.

mod solids;

use super::lowering::Lowering;
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::ast::{Argument, Expr, ExprKind, Name};
use crate::syntax::foreign;

/// What to write for a function or method of another language; `None` if the name is not known from there.
pub fn known_elsewhere(name: &str) -> Option<String> {
    if let Some(method) = foreign::method(name) {
        return Some(format!("it is the method `.{method}(…)` here (`rfm explain {method}`)"));
    }
    function(name, &[]).map(|Words { what, help }| format!("{what}; {help}"))
}

impl Lowering<'_> {
    /// The message for a call of a function that other languages have; `None` if the name is not known from there.
    pub fn foreign_function(&self, name: &Name, arguments: &[Argument]) -> Option<Diagnostic> {
        let written: Option<Vec<&str>> = arguments.iter().map(|a| self.written(&a.value)).collect();
        let written = written.filter(|parts| parts.iter().map(|p| p.len()).sum::<usize>() <= 100);
        let Words { what, help } = function(&name.text, &written.unwrap_or_default())?;
        let message = format!("unknown function or shape `{}`", name.text);
        Some(Diagnostic::error(Code::UNKNOWN_NAME, name.span, message).at(what).help(help))
    }

    /// The message for `math.sqrt(x)` and the like; `None` if something here has the name of the module.
    pub fn function_of_a_module(
        &self,
        receiver: &Expr,
        function: &Name,
        arguments: &[Argument],
    ) -> Option<Diagnostic> {
        let ExprKind::Name(module) = &receiver.kind else { return None };
        let is_local = self.scope.locals.iter().any(|local| local.name == *module);
        let is_known = is_local || self.names.candidates(self.scope.source, false).contains(module);
        if is_known || !MODULES.contains(&module.as_str()) {
            return None;
        }
        let diagnostic =
            Diagnostic::error(Code::UNKNOWN_NAME, receiver.span, format!("unknown name `{module}`"))
                .at("functions stand alone here");
        let written: Option<Vec<&str>> = arguments.iter().map(|a| self.written(&a.value)).collect();
        let written = written.unwrap_or_default();
        let known = super::builtins::exists(&function.text);
        match self::function(&function.text, &written).filter(|_| !known) {
            Some(Words { help, .. }) => Some(diagnostic.help(help)),
            None => Some(diagnostic.help(format!("write `{}({})`", function.text, written.join(", ")))),
        }
    }

    /// The message for `math.pi` and the like; `None` if something here has the name of the module.
    pub fn value_of_a_module(&self, module: &Expr, name: &Name) -> Option<Diagnostic> {
        let diagnostic = self.function_of_a_module(module, name, &[])?;
        let help = if name.text == "pi" { Some("write `pi`") } else { value(&name.text, self.in_scene) };
        help.map(|help| diagnostic.at("values stand alone here").help(help))
    }

    /// The message for `mix(a, b, 0.5)` of two shapes.
    pub fn mix_of_shapes(&mut self, name: &Name, arguments: &[Argument]) -> Option<Diagnostic> {
        let [first, second, ..] = arguments else { return None };
        if !matches!(name.text.as_str(), "mix" | "lerp")
            || !self.is_shape(&first.value)
            || !self.is_shape(&second.value)
        {
            return None;
        }
        let [a, b] = [(first, "a"), (second, "b")]
            .map(|(argument, other)| self.written(&argument.value).unwrap_or(other).to_string());
        let message = format!("unknown function or shape `{}`", name.text);
        Some(Diagnostic::error(Code::UNKNOWN_NAME, name.span, message).at("there is no shape between two").help(
            format!("to join them smoothly, write `smooth_or({a}, {b}, 0.1)`; `.loft` leads from one outline to another"),
        ))
    }

    /// The message for a method that other tools have; `None` if the name is not known from there.
    pub fn foreign_method(
        &self,
        receiver: &Expr,
        method: &Name,
        arguments: &[Argument],
    ) -> Option<Diagnostic> {
        let mut written = vec![self.written(receiver).unwrap_or("a")];
        written.extend(arguments.iter().map(|a| self.written(&a.value).unwrap_or("b")));
        let by_axes = |arguments: &[Argument], method: &str| {
            let of = |axis: &str| {
                let given = arguments.iter().find(|a| a.name.as_ref().is_some_and(|name| name.text == axis));
                given.map(|a| self.written(&a.value).unwrap_or("b").to_string())
            };
            let all = ["x", "y", "z"].map(of);
            let is_all = !arguments.is_empty() && all.iter().flatten().count() == arguments.len();
            let left_out = if method == "scale" { "1" } else { "0" };
            is_all.then(|| all.map(|part| part.unwrap_or_else(|| left_out.to_string())))
        };
        let message = format!("shapes have no method `{}`", method.text);
        let diagnostic = Diagnostic::error(Code::UNKNOWN_NAME, method.span, message);
        if let Some(known) = foreign::method(&method.text) {
            let by_axis = by_axes(arguments, known).map(|how| how.join(", "));
            let arguments = by_axis.unwrap_or_else(|| written[1..].join(", "));
            let call = foreign::method_call(&method.text, &arguments)?;
            return Some(diagnostic.at(format!("`.{known}` here")).help(format!("write `{call}`")));
        }
        let Words { what, help } =
            of_a_profile(&method.text, written[0]).or_else(|| joined(&method.text, &written))?;
        Some(diagnostic.at(what).help(help))
    }
}

/// What functions of mathematics belong to elsewhere.
const MODULES: [&str; 8] = ["math", "Math", "cmath", "np", "numpy", "std", "glm", "torch"];

/// The help for a value that other languages have, in a scene or outside of one; `None` if the name is not known from
/// there.
pub(super) fn value(name: &str, in_scene: bool) -> Option<&'static str> {
    Some(match name {
        "PI" | "M_PI" | "Pi" | "π" => "write `pi`",
        "tau" | "TAU" | "M_TAU" | "τ" => "write `2*pi`",
        "e" | "E" | "M_E" => "write `exp(1)`",
        "X" => "write `x`",
        "Y" => "write `y`",
        "Z" => "write `z`",
        "auto" | "automatic" | "default" if !in_scene => {
            "nothing is chosen for a shape: write a number; a param, as in `param r = 0.5`, has one that can be set from outside"
        }
        "auto" | "automatic" | "default" => {
            "leave the key out: what is chosen then is told by `rfm explain KEY`"
        }
        "r" | "R" => "write `sqrt(x^2 + y^2)`, or define it: `let r = sqrt(x^2 + y^2)` above",
        "theta" | "phi" => "write `atan2(y, x)`",
        "T" | "time" | "now" => "write `t`, the time in seconds",
        "dt" => "the time is `t`; the length of steps is a key of `run { dt: 1 ms }` in a scene",
        "true" | "True" | "false" | "False" | "None" | "nil" | "null" | "undef" => {
            "there are no logical values: a field is positive where a shape is"
        }
        "inf" | "Inf" | "infinity" | "Infinity" | "INFINITY" | "nan" | "NaN" => {
            "numbers are finite: a half-space such as `x <= 1` has no end either"
        }
        "off" | "Off" | "none" | "no" | "on" => {
            "there are no switches, only numbers: `gravity: [0, 0, 0]` is no gravity, and `viscosity: 0` no viscosity"
        }
        "p" | "P" | "pos" | "position" | "uv" => "write `[x, y, z]`",
        "if" | "then" | "else" => foreign::CONDITION,
        "path" | "polyline" | "bezier" | "curve" | "contour" | "outline" => CURVES,
        "m2" | "cm2" | "mm2" => "a power of a unit has a sign, as in `2 cm^2`",
        "m3" | "cm3" | "mm3" => "a power of a unit has a sign, as in `1000 kg/m^3`",
        "s2" => "a power of a unit has a sign, as in `9.81 m/s^2`",
        _ => return None,
    })
}

/// The help for a named argument that other tools have; `None` if the name is not known from there.
pub(super) fn parameter(function: &str, given: &str, parameters: &[&str]) -> Option<String> {
    let called = |name: &str| {
        let has = parameters.contains(&name);
        has.then(|| {
            format!("`{given}` is called `{name}` here; its parameters are {}", parameters.join(", "))
        })
    };
    match given {
        "d" | "diameter" | "dia" => parameters.contains(&"r").then(|| {
            format!("its radius is `r`, half of `{given}`; its parameters are {}", parameters.join(", "))
        }),
        "rtop" | "rbottom" if matches!(function, "cylinder" | "cone") => Some(
            "a cone that does not end in a point is a cylinder made narrower upwards: write for example \
             `cylinder(2, 3).taper(3, 0.5)`, which is half as wide at its top"
                .to_string(),
        ),
        "h" | "height" | "length" | "depth" if function == "extrude" => {
            Some("it leads from z0 to z1: write for example `.extrude(0, 1)` for a height of 1".to_string())
        }
        "radius" => called("r"),
        "height" | "length" | "l" => called("h"),
        "center" | "origin" => called("centre").or_else(|| called("point")),
        "r1" | "R1" => called("R"),
        "r2" => called("r"),
        "n" => called("normal"),
        "lo" | "lower" | "low" | "from" => called("min"),
        "hi" | "upper" | "high" | "to" => called("max"),
        _ => None,
    }
}

/// The words for outlines and paths.
const CURVES: &str = "outlines and paths are lists of points, among them those of `arc`, `spline`, `helix` and `rounded`: \
                      write `polygon([arc([0, 0], 1, 0°, 180°), [0, -1]])`, or `sweep([[0, 0, 0], [1, 0, 0], [1, 1, 0]], 0.1)`";

/// What a word is called here, and how its call is written.
struct Words {
    what: String,
    help: String,
}

fn words(what: &str, help: &str) -> Option<Words> {
    Some(Words { what: what.into(), help: help.into() })
}

fn written(what: &str, call: &str) -> Option<Words> {
    Some(Words { what: what.into(), help: format!("write `{call}`") })
}

/// What makes a solid of a profile, as a method.
fn of_a_profile(name: &str, profile: &str) -> Option<Words> {
    match name {
        "rotate_extrude" | "rotateExtrude" | "lathe" | "revolved" => {
            written("`.revolve` here", &format!("{profile}.revolve()"))
        }
        "linear_extrude" | "linearExtrude" | "extruded" | "prism" | "pad" => {
            written("`.extrude` here", &format!("{profile}.extrude(0, 1)"))
        }
        _ => None,
    }
}

/// Shapes that are joined, as a function of all of them or as a method of the first.
fn joined(name: &str, a: &[&str]) -> Option<Words> {
    let chain = |op: &str| match a {
        [] | [_] => format!("a {op} b"),
        all => all.iter().map(|text| foreign::operand(text)).collect::<Vec<_>>().join(&format!(" {op} ")),
    };
    if let Some(words) = joined_smoothly(name, a) {
        return Some(words);
    }
    match name {
        // max(−a, b) elsewhere
        "opSubtraction" => match a {
            [a, b] => {
                let [a, b] = [a, b].map(|text| foreign::operand(text));
                written("`\\` here: the second without the first", &format!("{b} \\ {a}"))
            }
            _ => written("`\\` here, which is without", "a \\ b"),
        },
        "union" | "unite" | "merge" | "fuse" | "join" | "combine" | "opUnion" | "add" | "sdUnion" => {
            written("`or` here", &chain("or"))
        }
        "intersection" | "intersect" | "common" | "opIntersection" => written("`and` here", &chain("and")),
        "difference" | "subtract" | "cut" | "diff" | "minus" | "remove" | "without" => {
            written("`\\` here, which is without", &chain("\\"))
        }
        "xor" | "symmetric_difference" | "opXor" => match a {
            [a, b] => {
                let [a, b] = [a, b].map(|text| foreign::operand(text));
                written("not an operation here", &format!("({a} or {b}) \\ ({a} and {b})"))
            }
            _ => written("not an operation here", "(a or b) \\ (a and b)"),
        },
        "complement" | "inverse" | "invert" | "negate" => match a {
            [only] => written("`not` here", &format!("not {}", foreign::operand(only))),
            _ => written("`not` here", "not a"),
        },
        "smooth_union" | "opSmoothUnion" | "blend" | "fillet" | "rounding" => words(
            "`blend`, `smooth_or` or `.round` here",
            "write `blend(a, b, 0.1)` for a fillet of radius 0.1 between two shapes, `(a or b).round(0.1)` for all edges of a shape",
        ),
        "bevel" | "chamfer" => written("`chamfer` here", "chamfer(a, b, 0.1)"),
        "dilate" | "erode" | "inflate" => written("`.offset` here", "sphere(1).offset(0.1)"),
        "onion" | "thicken" | "hollow" => written("`.shell` here", "sphere(1).shell(0.1)"),
        "hull" | "convex_hull" => words(
            "there are no hulls here",
            "the hull of two equal balls is `capsule(0.1, 1)`, those of each two along a path `sweep([[0, 0, 0], [1, 0, 0], [1, 1, 0]], 0.1)`, \
             that of two outlines at two heights `polygon([[0, 0], [1, 0], [0, 1]]).loft(polygon([[0, 0], [1, 0], [1, 1]]), 0, 1)`",
        ),
        "minkowski" => words(
            "there are no sums of shapes here",
            "with a ball the sum has round edges: write `box().offset(0.1).round(0.1)`",
        ),
        "elongate" => words(
            "there is no such operation here",
            "a rod with round ends is `capsule(0.1, 1)`, an outline of some length `polygon([[0, 0], [1, 0], [0, 1]]).extrude(0, 1)`",
        ),
        "repeat" | "array" | "pattern" | "duplicate" | "grid" => {
            written("`.repeat` here", "sphere(0.3).repeat([1, 0, 0], [6, 1, 1])")
        }
        "polar_array" | "circular_pattern" => {
            written("`.polar_repeat` here", "sphere(0.3).move([1, 0, 0]).polar_repeat(6)")
        }
        "for_each" => written("`any` here", "any i in 0..6: sphere(0.3).move([i, 0, 0])"),
        "color" | "colour" | "material" | "texture" | "pigment" => {
            words("shapes have no colour", "leave it out")
        }
        _ => None,
    }
}

/// Shapes that are joined with a width of the joint, as in `smin(a, b, 0.1)` and `opUnion(a, b, 0.1)`.
fn joined_smoothly(name: &str, a: &[&str]) -> Option<Words> {
    let is_number = |text: &str| text.starts_with(|c: char| c.is_ascii_digit() || c == '.');
    let call = |function: &str| match a {
        [a, b, width] => format!("{function}({a}, {b}, {width})"),
        [a, b] => format!("{function}({a}, {b}, 0.1)"),
        _ => format!("{function}(a, b, 0.1)"),
    };
    let has_a_width = matches!(a, [_, _, _]);
    match name {
        // ω is positive inside, so that the names are the other way round for numbers
        "smin" | "smooth_min" | "smoothmin" | "smoothMin" | "soft_min" | "softmin" | "sminCubic" => words(
            "`smooth_or` joins shapes here",
            &format!("write `{}`, or `smooth_and` for the smaller of two numbers", call("smooth_or")),
        ),
        "smax" | "smooth_max" | "smoothmax" | "smoothMax" | "soft_max" | "softmax" | "smaxCubic" => words(
            "`smooth_and` keeps what shapes share here",
            &format!("write `{}`, or `smooth_or` for the larger of two numbers", call("smooth_and")),
        ),
        "smooth_union" | "opSmoothUnion" if has_a_width => written("`smooth_or` here", &call("smooth_or")),
        "smooth_intersection" | "opSmoothIntersection" => written("`smooth_and` here", &call("smooth_and")),
        "smooth_difference" | "smooth_subtraction" | "smooth_subtract" => {
            written("`smooth_without` here", &call("smooth_without"))
        }
        // the first is taken away from the second elsewhere
        "opSmoothSubtraction" => match a {
            [a, b, rest @ ..] => written(
                "`smooth_without` here: the second without the first",
                &format!("smooth_without({b}, {a}, {})", rest.first().unwrap_or(&"0.1")),
            ),
            _ => written("`smooth_without` here", "smooth_without(a, b, 0.1)"),
        },
        "union" | "opUnion" | "sdUnion" if has_a_width && is_number(a[2]) => {
            written("`smooth_or` here", &call("smooth_or"))
        }
        "intersection" | "intersect" | "opIntersection" if has_a_width && is_number(a[2]) => {
            written("`smooth_and` here", &call("smooth_and"))
        }
        "difference" | "subtract" if has_a_width && is_number(a[2]) => {
            written("`smooth_without` here", &call("smooth_without"))
        }
        "opSubtraction" if has_a_width && is_number(a[2]) => joined_smoothly("opSmoothSubtraction", a),
        _ => None,
    }
}

fn function(name: &str, a: &[&str]) -> Option<Words> {
    joined(name, a).or_else(|| transformed(name, a)).or_else(|| solid(name, a)).or_else(|| number(name, a))
}

/// `translate([1, 0, 0], shape)`: methods that stand in front of a shape elsewhere.
fn transformed(name: &str, a: &[&str]) -> Option<Words> {
    let method = foreign::method(name)?;
    let what = format!("a method here: `shape.{method}(…)`");
    let call = match a {
        [] => None,
        [how] => Some(("sphere(1)".to_string(), how.to_string())),
        [_, _, ..] => shape_and_rest(a),
    };
    let example = match call {
        Some((shape, how)) if method == "rotate" && how.contains(", [") && !how.starts_with('[') => {
            // the angle first, as in OpenSCAD
            let (angle, axis) = how.split_once(", ")?;
            format!("{shape}.rotate({axis}, {})", foreign::in_degrees(angle))
        }
        Some((shape, how)) => match how.rsplit_once("], ") {
            // an axis or a normal, and then an angle or a point
            Some((first, second)) => format!("{shape}.{method}({first}], {})", foreign::in_degrees(second)),
            None if method == "rotate" && how.contains(',') && !how.contains(['[', '(']) => {
                format!("{shape}{}", foreign::turned(&format!("[{how}]")))
            }
            None => format!("{shape}{}", foreign::method_call(name, &how)?),
        },
        None => format!(
            "sphere(1){}",
            foreign::method_call(name, if method == "scale" { "2" } else { "[1, 0, 0]" })?
        ),
    };
    Some(Words { what, help: format!("write `{example}`") })
}

/// The shape among the arguments of a transformation, and the others as they were written; `None` if it is not plain
/// which of them is the shape.
fn shape_and_rest(a: &[&str]) -> Option<(String, String)> {
    let is_amount = |text: &&str| text.starts_with(|c: char| c.is_ascii_digit() || "[-.(".contains(c));
    let shapes: Vec<usize> = (0..a.len()).filter(|i| !is_amount(&a[*i])).collect();
    let at = match (&shapes[..], a) {
        ([only], _) => *only,
        // both are names or formulas: the shape comes first here and last in OpenSCAD; a call is rarely an amount
        ([_, _], [first, second]) => usize::from(second.ends_with(')') || !first.ends_with(')')),
        _ => return None,
    };
    let rest: Vec<&str> = a.iter().enumerate().filter(|(i, _)| *i != at).map(|(_, text)| *text).collect();
    Some((foreign::operand(a[at]), rest.join(", ")))
}

/// Whether an argument is a number or a formula that may be repeated elsewhere: no name is given to it, and
/// it is no point.
fn is_a_value(argument: &str) -> bool {
    !argument.contains(['=', '[', ':']) && !["true", "false"].contains(&argument)
}

/// Standard solids of other tools.
fn solid(name: &str, a: &[&str]) -> Option<Words> {
    let size = a.first().filter(|text| text.starts_with('['));
    match name {
        "rect" | "square" | "rectangle" if size.is_none_or(|size| size.split(',').count() == 2) => {
            let inner = |text: &str| text.trim_start_matches('[').trim_end_matches(']').trim().to_owned();
            let corners = match a {
                [size] if size.starts_with('[') => size.split_once(',').map(|(w, h)| [inner(w), inner(h)]),
                [side] => Some([side, side].map(|side| inner(side))),
                [w, h] if [w, h].iter().all(|text| is_a_value(text)) => Some([w, h].map(|side| inner(side))),
                _ => None,
            };
            let [w, h] = corners.unwrap_or_else(|| ["2", "1"].map(String::from));
            written("`polygon` here", &format!("polygon([[0, 0], [{w}, 0], [{w}, {h}], [0, {h}]])"))
        }
        "cube" | "cuboid" | "Box" | "block" | "brick" | "aabb" => match (a, size) {
            ([_, centred], Some(size)) if centred.ends_with("true") => {
                written("`box(min, max)` here", &format!("box(-{size}/2, {size}/2)"))
            }
            (_, Some(size)) => written("`box(min, max)` here", &format!("box([0, 0, 0], {size})")),
            ([side], None) => {
                written("`box(min, max)` here", &format!("box([0, 0, 0], [{side}, {side}, {side}])"))
            }
            ([x, y, z], None) => written("`box(min, max)` here", &format!("box([0, 0, 0], [{x}, {y}, {z}])")),
            _ => written("`box(min, max)` here", "box([0, 0, 0], [1, 1, 1])"),
        },
        "sdBox" | "box3" => written("`box(min, max)` here", "box([-1, -1, -1], [1, 1, 1])"),
        "sdSphere" | "spheroid" | "f_sphere" | "orb" => written("`sphere(r)` here", "sphere(1)"),
        "pipe" | "tube" if size.is_some_and(|points| points.starts_with("[[")) => {
            written("`sweep(path, radius)` here", &format!("sweep({})", a.join(", ")))
        }
        "disk" | "disc" | "circle" | "tube" | "pipe" | "rod" | "sdCylinder" => written(
            "`cylinder(r, h)` here",
            &if name == "pipe" || name == "tube" {
                "cylinder(0.5, 1) \\ cylinder(0.4, 1)".into()
            } else {
                match a {
                    [r, h] if is_a_value(r) && is_a_value(h) => format!("cylinder({r}, {h})"),
                    [r] if is_a_value(r) => format!("cylinder({r}, 1)"),
                    _ => "cylinder(0.5, 1)".into(),
                }
            },
        ),
        "frustum" | "truncated_cone" | "conical_frustum" | "cone_frustum" => {
            let given = match a {
                [low, top, h] => solids::truncated_cone((low, top), h, false),
                _ => None,
            };
            match given {
                Some(cone) if cone.starts_with("cone(") => written("`cone(r, h)` here", &cone),
                Some(cylinder) => written("`.taper(h, top)` here", &cylinder),
                None => written("`.taper(h, top)` here", "cylinder(1, 2).taper(2, 0.5)"),
            }
        }
        "plane" | "halfspace" | "half_plane" | "sdPlane" => {
            written("`half_space(normal, point)` here", "half_space([0, 0, 1], [0, 0, 0])")
        }
        "slab" => written("`layer(e, low, high)` here", "layer(z, 0, 1)"),
        "donut" | "doughnut" | "ring" | "sdTorus" => written("`torus(R, r)` here", "torus(1, 0.25)"),
        "pill" | "sdCapsule" | "sphylinder" => written("`capsule(r, h)` here", "capsule(0.2, 1)"),
        "pyramid" | "prism" | "wedge" | "tetrahedron" | "octahedron" | "polyhedron" | "hexagon" => words(
            "planes joined by `and` here",
            "write `(all i in 0..6: half_space([1, 0, 0], [1, 0, 0]).rotate_z(i*60 deg)) and 0 <= z <= 1`",
        ),
        "linear_extrude" => {
            written("`.extrude(z0, z1)` here", "polygon([[0, 0], [2, 0], [1, 1]]).extrude(0, 2)")
        }
        "rotate_extrude" | "lathe" | "sor" => {
            written("`.revolve()` here", "polygon([[1, 0], [2, 0], [1.5, 1]]).revolve()")
        }
        "import" | "load" | "stl" | "obj" | "ply" => words(
            "`mesh(…)` here, and `import` for a file of this language",
            "write `mesh(\"part.stl\")`, or `import \"chess.rfm\" as chess` in front of the solids",
        ),
        "path" | "polyline" | "bezier" | "curve" | "contour" | "outline" => {
            words("`polygon` or `sweep` here", CURVES)
        }
        "surface" | "heightfield" | "height_field" | "heightmap" => {
            written("`height_map(…)` here", "height_map(\"terrain.csv\", [0, 0], [100, 80])")
        }
        _ => None,
    }
}

/// Functions of numbers and vectors.
fn number(name: &str, a: &[&str]) -> Option<Words> {
    let first = a.first().copied().unwrap_or("a");
    let call = |name: &str| format!("{name}({})", if a.is_empty() { "a, b".into() } else { a.join(", ") });
    match name {
        "log" | "loge" => {
            let of_base = match a {
                [x, base] => format!("ln({x})/ln({base})"),
                _ => format!("ln({first})"),
            };
            written("`ln` here, or `log10`", &of_base)
        }
        "lg" => written("`log10` here", &format!("log10({first})")),
        "exp2" => written("`^` here", &format!("2^({first})")),
        "fmod" | "rem" => written("`mod` here", &call("mod")),
        "trunc" | "int" => written("`floor` here", &format!("floor({first})")),
        "frac" => written("`fract` here", &format!("fract({first})")),
        "if" | "select" | "ifelse" | "cond" => words("`where` here", foreign::CONDITION),
        "smoothstep" => {
            words("a formula here", "write `let s = clamp((e - a)/(b - a), 0, 1)` and `s^2*(3 - 2*s)`")
        }
        "min3" | "min2" | "min4" | "fmin" | "Min" | "minimum" => written("`min` here", &call("min")),
        "max3" | "max2" | "max4" | "fmax" | "Max" | "maximum" => written("`max` here", &call("max")),
        "mix" | "lerp" => match a {
            [a, b, t] => written("a formula here", &format!("({a}) + (({b}) - ({a}))*({t})")),
            _ => written("a formula here", "a + (b - a)*t"),
        },
        "len" => written("`count` for lists and `length` for vectors here", &format!("count({first})")),
        "norm" | "magnitude" | "mag" | "vlength" | "distance" => match a {
            [a, b] => written("`length` here", &format!("length({a} - {b})")),
            _ => written("`length` here", &format!("length({first})")),
        },
        "sqr" | "square" | "sq" | "pow2" => written("`^2` here", &format!("({first})^2")),
        "cbrt" => written("`^` here", &format!("({first})^(1/3)")),
        "fabs" | "Abs" => written("`abs` here", &format!("abs({first})")),
        "arcsin" => written("`asin` here", &format!("asin({first})")),
        "arccos" => written("`acos` here", &format!("acos({first})")),
        "arctan" => written("`atan` here", &format!("atan({first})")),
        "arctan2" => written("`atan2` here", &call("atan2")),
        "sec" => written("a formula here", &format!("1/cos({first})")),
        "cot" => written("a formula here", &format!("1/tan({first})")),
        "sgn" | "signum" => written("`sign` here", &format!("sign({first})")),
        "rand" | "rands" => written("`random(seed, i)` here", "random(1, i)"),
        "snoise" | "perlin" | "simplex" => written("`noise` here", "noise([x, y, z])"),
        "radians" | "deg2rad" | "deg" => written("a unit here", &format!("{first} deg")),
        "degrees" | "rad2deg" => written("a unit here", &format!("({first})*180/pi")),
        "vec3" | "vec" | "vector" | "Vector" | "DVec3" | "float3" | "point" | "vec2" | "vec4" => match a {
            [x, y, z] => written("`[a, b, c]` here", &format!("[{x}, {y}, {z}]")),
            [one] => written("`[a, b, c]` here", &format!("[{one}, {one}, {one}]")),
            _ => written("`[a, b, c]` here", "[1, 0, 0]"),
        },
        "range" => match a {
            [end] => written("a range is written with dots", &format!("0..{end}")),
            [start, end] => written("a range is written with dots", &format!("{start}..{end}")),
            _ => written("a fold here", "any i in 0..6: sphere(0.3).move([i, 0, 0])"),
        },
        "linspace" | "arange" => written("a list of a fold here", "list i in 0..6: i/5"),
        "sum" | "product" | "total" => {
            words("a fold here", "write `sum i in 0..6: e`, or `sum e in [1, 2, 3]: e`")
        }
        "gradient" | "grad" | "derivative" | "diff" => words(
            "∇ω is found for you",
            "`rfm eval FILE --at 0,0,0 --what gradient` prints it; `normalise(e)` divides by it",
        ),
        _ => None,
    }
}
