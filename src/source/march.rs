//! Solids for a ray-marcher: functions of GLSL ES 3.0 for the sign, the gradient and the range of ω, with
//! params and time as uniforms.
//!
//! The range is that of the min/max twin, which has the zero set of ω and needs no roots. A piece of a ray
//! over which it does not hold zero meets no surface, however thin the solid is.
//!
//! Invariant: a range holds all values of the twin over its box, but for rounding: numbers are in `f32` and
//! ends are not rounded outwards, except where functions of the shader language may be off by more.

use super::operations::Names;
use super::program::{Program, Question};
use super::shader::{self, GLSL};
use super::statements::{Own, Writer};
use super::{File, Math, Options, Param, SourceError, in_file, language};
use crate::ir::{Axis, Binary, BinaryFunction, Expr, Graph, Node, Unary, UnaryFunction};
use crate::precision::Precision;
use crate::solid::Solid;

/// Functions for a ray-marcher, for the union of solids.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Marched {
    /// The text: `float field_sign(vec3 p)`, `vec4 field_gradient(vec3 p)` with ω in its last component, and
    /// `vec2 field_range(vec2 x, vec2 y, vec2 z)` of the least and the greatest coordinates of a box. The time is the
    /// uniform `field_time`.
    pub text: String,
    /// The uniforms for params, each with the name of its param.
    pub uniforms: Vec<(String, String)>,
    /// How many operations all ranges have.
    pub operations: usize,
    /// Whether any of the solids moves.
    pub moves: bool,
}

/// Writes solids that are open in `params`, as [`Options::params`] are.
///
/// # Errors
/// Those of [`write`](super::write) for GLSL.
pub fn marched(solids: &[Solid], params: &[Param]) -> Result<Marched, SourceError> {
    let moves = solids.iter().any(Solid::moves);
    let mut made =
        Marched { text: "uniform float field_time;\n".into(), uniforms: Vec::new(), operations: 0, moves };
    made.text.push_str(LIBRARY);
    let mut calls = Vec::new();
    for (k, solid) in solids.iter().enumerate() {
        let prefix = format!("body{k}");
        let options =
            Options { prefix: Some(prefix), sign: true, params: params.to_vec(), ..Options::default() };
        calls.push(in_file(solid, true, &options, |file| body(file, &mut made))??);
    }
    join(&calls, &mut made.text);
    Ok(made)
}

/// How the functions of a body are called, behind their first arguments.
struct Call {
    prefix: String,
    rest: String,
}

/// Writes the functions of a solid.
fn body(file: &File<'_>, made: &mut Marched) -> Result<Call, SourceError> {
    made.text.push_str(&shader::source(file, &GLSL)?);
    let mut rest = String::new();
    if file.moves {
        rest.push_str(", field_time");
    }
    let prefix = file.prefix;
    if !file.params.is_empty() {
        made.text.push_str(&format!("uniform {prefix}_params {prefix}_values;\n"));
        rest.push_str(&format!(", {prefix}_values"));
        let uniforms = file
            .params
            .iter()
            .map(|open| (format!("{prefix}_values.{}", open.field), open.param.name.clone()));
        made.uniforms.extend(uniforms);
    }
    let sign = file.programs.iter().find(|program| program.question == Question::Sign);
    if let Some(program) = sign {
        let (lines, operations) = range(file, program)?;
        made.text.push_str(&(lines.join("\n") + "\n"));
        made.operations += operations;
    }
    Ok(Call { prefix: prefix.to_string(), rest })
}

/// The functions of all bodies together. Without bodies, space is empty everywhere.
fn join(calls: &[Call], text: &mut String) {
    let each = |name: &str, first: &str| {
        calls
            .iter()
            .map(|Call { prefix, rest }| format!("{prefix}_{name}({first}{rest})"))
            .collect::<Vec<_>>()
    };
    let greatest = |parts: Vec<String>, none: &str| {
        parts.into_iter().reduce(|all, part| format!("max({all}, {part})")).unwrap_or_else(|| none.into())
    };
    let sign = greatest(each("sign", "p"), "-1.0");
    text.push_str(&format!("float field_sign(vec3 p) {{ return {sign}; }}\n"));
    let range = greatest(each("range", "x, y, z"), "vec2(-1.0)");
    text.push_str(&format!("vec2 field_range(vec2 x, vec2 y, vec2 z) {{ return {range}; }}\n"));
    text.push_str("vec4 field_gradient(vec3 p) {\n    vec4 most = vec4(0.0, 0.0, 0.0, -3.0e38), next;\n");
    for part in each("omega_gradient", "p") {
        text.push_str(&format!("    next = {part};\n    if (next.w > most.w) most = next;\n"));
    }
    text.push_str("    return most;\n}\n");
}

/// The function for the range of a solid's twin, and the number of its operations.
fn range(file: &File<'_>, program: &Program) -> Result<(Vec<String>, usize), SourceError> {
    let names = Names { prefix: file.prefix };
    let parameter = |i: u32| format!("params.{}", file.field(i));
    let uniform = |i: u32| format!("u{i}");
    let writer = Writer {
        language: &language::GLSL,
        precision: Precision::F32,
        names: &names,
        math: Math::System,
        axes: ["x", "y", "z", "t"],
        parameter: &parameter,
        uniform: &uniform,
        gathered: None,
        values: "s",
        own: Own::Shaders,
    };
    let Program { graph, outputs, .. } = program;
    let root = match graph.expr(outputs[0]) {
        Expr::Unary(Unary::Sign, twin) => twin,
        Expr::Unary(..)
        | Expr::Binary(..)
        | Expr::Constant(_)
        | Expr::Coordinate(_)
        | Expr::Parameter(_)
        | Expr::Uniform(_)
        | Expr::Lookup(..) => outputs[0],
    };
    let arguments = ["vec2 x", "vec2 y", "vec2 z"].map(String::from).into_iter();
    let arguments: Vec<String> = arguments.chain(shader::arguments(file, &GLSL).split_off(1)).collect();
    let mut lines = vec![format!("vec2 {}_range({}) {{", file.prefix, arguments.join(", "))];
    lines.extend(shader::hoisted(program, &writer)?.0);
    let mut texts: Vec<Text> = Vec::new();
    texts.resize_with(root.index() + 1, || Text::Number(String::new()));
    let used = graph.reachable(&[root]);
    let cone: Vec<Node> = (0..=root.index()).filter(|&i| used[i]).map(|i| graph.node(i)).collect();
    for &node in &cone {
        let text = match graph.expr(node) {
            Expr::Constant(bits) => {
                let value = f64::from_bits(bits);
                let written = language::GLSL.constant(value, Precision::F32);
                Text::Constant(written.ok_or(SourceError::NumberOutOfRange(value))?, value)
            }
            Expr::Coordinate(Axis::X) => Text::Range("x".into()),
            Expr::Coordinate(Axis::Y) => Text::Range("y".into()),
            Expr::Coordinate(Axis::Z) => Text::Range("z".into()),
            Expr::Coordinate(Axis::T) => Text::Number("t".into()),
            Expr::Parameter(i) => Text::Number(parameter(i)),
            Expr::Uniform(i) => Text::Number(uniform(i)),
            Expr::Unary(op, a) => declared(&mut lines, node, &unary(op, &texts[a.index()])),
            Expr::Binary(op, a, b) => {
                let text = binary(op, (a, &texts[a.index()]), (b, &texts[b.index()]));
                declared(&mut lines, node, &text)
            }
            Expr::Lookup(..) => return Err(SourceError::Table),
        };
        texts[node.index()] = text;
    }
    lines.push(format!("    return {};", texts[root.index()].wide()));
    lines.push("}".into());
    Ok((lines, operations(graph, &cone)))
}

fn operations(graph: &Graph, cone: &[Node]) -> usize {
    cone.iter().filter(|&&node| graph.expr(node).operands().next().is_some()).count()
}

/// How a node is written.
enum Text {
    /// A number of the formula, with its value.
    Constant(String, f64),
    /// One number over the whole box.
    Number(String),
    /// A `vec2` of the least and the greatest value.
    Range(String),
}

impl Text {
    /// The value as a range.
    fn wide(&self) -> String {
        match self {
            Self::Constant(text, _) | Self::Number(text) => format!("vec2({text})"),
            Self::Range(text) => text.clone(),
        }
    }
}

fn declared(lines: &mut Vec<String>, node: Node, value: &str) -> Text {
    let name = format!("r{}", node.index());
    lines.push(format!("    vec2 {name} = {value};"));
    Text::Range(name)
}

fn unary(op: Unary, a: &Text) -> String {
    let a = a.wide();
    match op {
        Unary::Neg => format!("-{a}.yx"),
        Unary::Abs => format!("range_abs({a})"),
        Unary::Sqrt => format!("range_sqrt({a})"),
        Unary::Sign => format!("sign({a})"),
        Unary::Floor => format!("floor({a})"),
        Unary::Round => format!("roundEven({a})"),
        Unary::Call(function) => format!("range_near({})", called(function, &a)),
    }
}

fn called(function: UnaryFunction, a: &str) -> String {
    match function {
        UnaryFunction::Sin => format!("range_sin({a})"),
        UnaryFunction::Cos => format!("range_sin({a} + 1.57079633)"),
        UnaryFunction::Tan => format!("range_tan({a})"),
        UnaryFunction::Asin => format!("asin(clamp({a}, -1.0, 1.0))"),
        UnaryFunction::Acos => format!("acos(clamp({a}, -1.0, 1.0)).yx"),
        UnaryFunction::Atan => format!("atan({a})"),
        UnaryFunction::Exp => format!("exp(min({a}, 80.0))"),
        UnaryFunction::Ln => format!("range_log2({a}) * 0.69314718"),
        UnaryFunction::Log2 => format!("range_log2({a})"),
        UnaryFunction::Log10 => format!("range_log2({a}) * 0.30103"),
        UnaryFunction::Sinh => format!("sinh(clamp({a}, -80.0, 80.0))"),
        UnaryFunction::Cosh => format!("cosh(min(range_abs({a}), 80.0))"),
        // beyond this it is one in single precision, and some drivers overflow
        UnaryFunction::Tanh => format!("tanh(clamp({a}, -20.0, 20.0))"),
    }
}

fn binary(op: Binary, (i, a): (Node, &Text), (j, b): (Node, &Text)) -> String {
    match op {
        Binary::Add => match (a, b) {
            (Text::Range(range), Text::Constant(number, _) | Text::Number(number))
            | (Text::Constant(number, _) | Text::Number(number), Text::Range(range)) => {
                format!("{range} + {number}")
            }
            (Text::Range(_), Text::Range(_))
            | (Text::Constant(..) | Text::Number(_), Text::Constant(..) | Text::Number(_)) => {
                format!("{} + {}", a.wide(), b.wide())
            }
        },
        // the result is no number beyond all bounds because equal numbers are subtracted
        Binary::Sub if i == j => "vec2(0.0)".into(),
        Binary::Sub => match b {
            Text::Constant(number, _) | Text::Number(number) => format!("{} - {number}", a.wide()),
            Text::Range(range) => format!("{} - {range}.yx", a.wide()),
        },
        Binary::Mul if i == j => format!("range_square({})", a.wide()),
        Binary::Mul => match (a, b) {
            (Text::Constant(factor, value), other) | (other, Text::Constant(factor, value)) => {
                let swapped = if *value < 0.0 { ".yx" } else { "" };
                format!("{}{swapped} * {factor}", other.wide())
            }
            (Text::Number(factor), other) | (other, Text::Number(factor)) => {
                format!("range_scaled({}, {factor})", other.wide())
            }
            (Text::Range(a), Text::Range(b)) => format!("range_product({a}, {b})"),
        },
        Binary::Div => match b {
            Text::Constant(divisor, value) => {
                let swapped = if *value < 0.0 { ".yx" } else { "" };
                format!("{}{swapped} / {divisor}", a.wide())
            }
            Text::Number(_) | Text::Range(_) => format!("range_quotient({}, {})", a.wide(), b.wide()),
        },
        Binary::DivOrZero => format!("range_quotient({}, {})", a.wide(), b.wide()),
        Binary::MulOrZero => format!("range_with_zero(range_product({}, {}))", a.wide(), b.wide()),
        Binary::Min | Binary::PlainMin => format!("min({}, {})", a.wide(), b.wide()),
        Binary::Max | Binary::PlainMax => format!("max({}, {})", a.wide(), b.wide()),
        Binary::MinWeight | Binary::MaxWeight => "vec2(0.0, 1.0)".into(),
        Binary::And => format!("range_joined({}, {}, -1.0)", a.wide(), b.wide()),
        Binary::Or => format!("range_joined({}, {}, 1.0)", a.wide(), b.wide()),
        Binary::AndWeight | Binary::OrWeight => "vec2(0.0, 2.0)".into(),
        Binary::Call(BinaryFunction::Pow) => match b {
            Text::Constant(exponent, _) | Text::Number(exponent) => {
                format!("range_near(range_power({}, {exponent}))", a.wide())
            }
            Text::Range(exponent) => format!("range_near(range_powers({}, {exponent}))", a.wide()),
        },
        Binary::Call(BinaryFunction::Atan2) => format!("range_near(range_atan2({}, {}))", a.wide(), b.wide()),
    }
}

/// Operations on ranges. One that may be undefined is as wide as can be.
const LIBRARY: &str = "const vec2 range_all = vec2(-1.0e30, 1.0e30);
vec2 range_near(vec2 a) { return a + vec2(-1.0e-5, 1.0e-5) * (1.0 + abs(a)); }
vec2 range_abs(vec2 a) {
    vec2 b = abs(a);
    return vec2(a.x < 0.0 && a.y > 0.0 ? 0.0 : min(b.x, b.y), max(b.x, b.y));
}
vec2 range_square(vec2 a) { vec2 b = range_abs(a); return b * b; }
vec2 range_sqrt(vec2 a) { return a.y < 0.0 ? range_all : sqrt(max(a, 0.0)); }
vec2 range_scaled(vec2 a, float k) { return k < 0.0 ? a.yx * k : a * k; }
vec2 range_product(vec2 a, vec2 b) {
    vec4 p = vec4(a.x * b, a.y * b);
    return vec2(min(min(p.x, p.y), min(p.z, p.w)), max(max(p.x, p.y), max(p.z, p.w)));
}
vec2 range_quotient(vec2 a, vec2 b) {
    return b.x > 0.0 || b.y < 0.0 ? range_product(a, 1.0 / b.yx) : range_all;
}
vec2 range_with_zero(vec2 a) { return vec2(min(a.x, 0.0), max(a.y, 0.0)); }
vec2 range_joined(vec2 a, vec2 b, float side) {
    return a + b + side * sqrt(a * a + b * b) + vec2(-1.0e-6, 1.0e-6) * (abs(a) + abs(b));
}
vec2 range_sin(vec2 a) {
    // in quarter turns from a trough: whole multiples of four are troughs, and two beyond them are crests
    vec2 q = a * 0.636619772 + 1.0;
    vec2 s = sin(a);
    bool trough = floor(q.y * 0.25) > floor(q.x * 0.25), crest = floor(q.y * 0.25 + 0.5) > floor(q.x * 0.25 + 0.5);
    return vec2(trough ? -1.0 : min(s.x, s.y), crest ? 1.0 : max(s.x, s.y)) + vec2(-1.0e-3, 1.0e-3);
}
vec2 range_tan(vec2 a) {
    vec2 turns = floor(a * 0.318309886 + 0.5);
    return turns.x == turns.y ? tan(a) : range_all;
}
vec2 range_log2(vec2 a) { return a.y <= 0.0 ? range_all : vec2(a.x > 0.0 ? log2(a.x) : -1.0e30, log2(a.y)); }
vec2 range_powers(vec2 a, vec2 b) {
    if (a.x <= 0.0) return range_all;
    return exp2(clamp(range_product(log2(a), b), -120.0, 120.0));
}
vec2 range_power(vec2 a, float n) {
    bool is_whole = floor(n) == n;
    if (a.x <= 0.0 && (n < 0.0 || !is_whole)) {
        return n > 0.0 && a.y > 0.0 ? vec2(0.0, pow(a.y, n)) : range_all;
    }
    bool is_odd = is_whole && n - 2.0 * floor(n * 0.5) == 1.0;
    if (a.x <= 0.0 && is_odd) return sign(a) * pow(abs(a), vec2(n));
    vec2 b = pow(range_abs(a), vec2(n));
    return n < 0.0 ? b.yx : b;
}
vec2 range_atan2(vec2 y, vec2 x) {
    if (x.x <= 0.0 && y.x <= 0.0 && y.y >= 0.0) return vec2(-3.14159274, 3.14159274);
    vec4 p = atan(vec4(y, y), vec4(x, x.yx));
    return vec2(min(min(p.x, p.y), min(p.z, p.w)), max(max(p.x, p.y), max(p.z, p.w)));
}
";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Engine;
    use crate::compile::Program;

    fn marched_file(text: &str) -> Result<Marched, SourceError> {
        let program = Program::from_source("a.rfm", text).unwrap();
        let (opened, _) = program.with_open_params().unwrap();
        let names: Vec<String> = opened.module().solids.iter().map(|solid| solid.name.clone()).collect();
        let solid = |name: &String| opened.solid_with(name, Engine::Interpreter).unwrap();
        let solids: Vec<Solid> = names.iter().map(solid).collect();
        let params = opened.module().params.iter();
        let params = params.map(|p| Param { name: p.name.clone(), value: p.value, doc: None });
        marched(&solids, &params.collect::<Vec<_>>())
    }

    #[test]
    fn a_union_has_a_uniform_for_each_param_of_each_solid() {
        let text = "rfm 1\nparam r = 0.5\nparam speed = 2\nparam unused = 1\nsolid a = sphere(r)\n\
                    solid b = sphere(r).move([speed*t, 0, 0])\n";
        let made = marched_file(text).unwrap();
        let uniform = |name: &str, param: &str| (name.to_string(), param.to_string());
        let expected = [("body0_values.r", "r"), ("body1_values.r", "r"), ("body1_values.speed", "speed")];
        assert_eq!(made.uniforms, expected.map(|(name, param)| uniform(name, param)));
        assert!(made.moves);
        for call in [
            "return max(body0_sign(p, body0_values), body1_sign(p, field_time, body1_values));",
            "return max(body0_range(x, y, z, body0_values), body1_range(x, y, z, field_time, body1_values));",
            "next = body1_omega_gradient(p, field_time, body1_values);",
        ] {
            assert!(made.text.contains(call), "{call}\n{}", made.text);
        }
    }

    #[test]
    fn squares_are_not_products_and_guards_do_not_widen_ranges() {
        let made = marched_file("rfm 1\nsolid a = x*x + y^2 - z*x <= 1\n").unwrap();
        assert_eq!(made.text.matches("= range_square(x)").count(), 1);
        assert_eq!(made.text.matches("= range_product(z, x)").count(), 1);
        // the guard of large places is a difference of equal numbers
        assert!(made.text.contains("= vec2(0.0);"), "{}", made.text);
        assert!(!made.moves && made.uniforms.is_empty() && made.operations > 5);
    }
}
