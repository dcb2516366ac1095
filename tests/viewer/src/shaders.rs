//! Solids as GLSL, computed by the browser: the same numbers as those of `rfm eval` in single precision.

use std::fmt::Write as _;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use crate::cases::Room;
use crate::program::rfm;

/// A formula of x, y and z between −1.5 and 1.5 for every operation of the language, by the function that it is about.
pub const FORMULAS: &[(&str, &str)] = &[
    ("+ - * /", "(x + 2*y)*z - x/(y*y + 0.5)"),
    ("neg", "-(x - y*z)"),
    ("abs", "abs(x) - abs(y*z)"),
    ("sqrt", "sqrt(x*x + y*y) - 0.7*sqrt(abs(z))"),
    ("sign", "sign(x - y) + sign(z)*0.25"),
    ("floor", "floor(3*x) - 0.5*floor(y) + 0.1"),
    ("ceil", "ceil(3*x) - 0.5*ceil(y) + 0.1"),
    ("round", "round(3*x) - 0.5*round(y) + 0.1"),
    ("fract", "fract(3*x) - fract(y)"),
    ("mod", "mod(x, 0.25) - mod(y, 0.7)"),
    ("step", "step(y, x) - 0.5*step(0.2, z)"),
    ("min max", "min(x, y) + max(y, z) - 0.1"),
    ("clamp", "clamp(x, y*0.1 - 0.5, 0.5) - 0.2*z"),
    ("^", "x^3 - y^2 + z^5/4 + abs(x)^0.5"),
    ("where", "where(x <= y, x*z, y - z)"),
    ("sin", "sin(3*x) + sin(y)*z"),
    ("cos", "cos(3*x) - cos(y)*z"),
    ("tan", "tan(0.9*x) - tan(0.5*y)"),
    ("asin", "asin(x/1.6) - asin(y/2)"),
    ("acos", "acos(x/1.6) - acos(y/2)"),
    ("atan", "atan(4*x) - atan(y)"),
    ("atan2", "atan2(y, x) - 0.3*z"),
    ("exp", "exp(x) - exp(y*z)"),
    ("ln", "ln(abs(x) + 0.01) + ln(abs(y) + 1)"),
    ("log2", "log2(abs(x) + 0.01) + z"),
    ("log10", "log10(abs(x) + 0.01) + z"),
    ("sinh", "sinh(x) - sinh(y*0.1)"),
    ("cosh", "cosh(x) - cosh(y)"),
    ("tanh", "tanh(2*x) - tanh(y*0.1)"),
    ("pow", "pow(abs(x) + 0.1, y) - 1"),
    ("and", "x - 0.2 and y + 0.1"),
    ("or", "x - 0.2 or y + 0.1"),
    ("not", "not (x - 0.2 and y + 0.1) and z"),
    ("without", "sphere(1.1) \\ box([0, 0, 0], [1, 1, 1])"),
    ("slope", "slope(x*x - y*y + (x and y)) - 1"),
    ("normalise", "normalise(x^2 + 2*y^2 - z and z + 1)"),
    ("any all", "any i in 0..5: all k in 0..2: ball([0.4*i - 0.9, 0.3*k, 0], 0.4)"),
    ("polygon", "polygon([[-1, -1], [1, -0.7], [0.6, 0.9], [0, 0.1], [-0.8, 1]])"),
    ("turned", "cylinder(0.5, 1).rotate_x(0.4).move([0.1, 0.2, -0.3])"),
    ("repeat", "sphere(0.2).repeat([0.7, 0.7, 0.7], [3, 3, 3])"),
];

/// Shapes with round edges. Shaders that compute their ranges as well are too long for a browser without a
/// graphics processor.
const ROUNDED: &[(&str, &str)] = &[
    (
        "rounded",
        "(box([-1, -0.8, -0.5], [1, 0.8, 0.5]) \\ cylinder(0.3, 2).move([0, 0, -1]) or half_space([0, 0, 1], [0, 0, -1])).round(0.2, 0.1)",
    ),
    ("rounded to first order", "(ellipsoid(1, 0.6, 0.5) or cone(0.5, 1)).round(0.1)"),
];

/// The points of a picture of this size, one at each pixel.
const SIZE: (usize, usize) = (400, 250);
/// The largest difference that is accepted, of the largest value.
const LARGEST: f64 = 1e-6;
/// The page: it computes ω at the points that are stored as a picture.
const PAGE: &str = r##"<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,"><body><script>
"use strict";
const [width, height] = [WIDTH, HEIGHT];
const gl = Object.assign(document.createElement("canvas"), { width, height }).getContext("webgl2");
if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("no pictures of floats");
const texture = (data) => {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, data);
  return made;
};
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
let points;
const given = (text) => { points = texture(new Float32Array(bytes(text).buffer)); return true; };
const shader = (kind, text) => {
  const made = gl.createShader(kind);
  gl.shaderSource(made, text);
  gl.compileShader(made);
  if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
  return made;
};
const computed = (source, call) => {
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `#version 300 es
    void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1)*4.0 - 1.0, 0.0, 1.0); }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `#version 300 es
    precision highp float; precision highp int; precision highp sampler2D;
    uniform sampler2D points; out vec4 result;
    ${source}
    void main() { vec3 p = texelFetch(points, ivec2(gl_FragCoord.xy), 0).xyz; result = ${call}; }`));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  const target = texture(null);
  const frame = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.viewport(0, 0, width, height);
  gl.useProgram(program);
  gl.bindTexture(gl.TEXTURE_2D, points);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  const found = new Float32Array(4*width*height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, found);
  gl.deleteTexture(target);
  gl.deleteFramebuffer(frame);
  gl.deleteProgram(program);
  let text = "";
  const all = new Uint8Array(found.buffer);
  for (let i = 0; i < all.length; i += 32768) text += String.fromCharCode(...all.subarray(i, i + 32768));
  return btoa(text);
};
</script></body>"##;

/// Points without an order, as single numbers: a counter that is multiplied.
fn points() -> Vec<[f32; 3]> {
    let mut state = 1_u64;
    let mut number = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (3.0 * (state >> 11) as f64 / (1_u64 << 53) as f64 - 1.5) as f32
    };
    (0..SIZE.0 * SIZE.1).map(|_| [number(), number(), number()]).collect()
}

/// The largest value, the largest difference, and the number of wrong signs beyond the accepted difference.
fn compare(found: &[f32], known: &[f32]) -> (f64, f64, usize) {
    let pairs = || found.iter().zip(known).map(|(a, b)| (f64::from(*a), f64::from(*b)));
    let largest = known.iter().fold(0.0, |most: f64, value| most.max(f64::from(value.abs())));
    assert!(known.iter().all(|value| value.is_finite()) && largest > 0.0);
    let error = pairs().map(|(a, b)| if a.is_finite() { (a - b).abs() } else { f64::INFINITY });
    let wrong = pairs().filter(|(a, b)| b.abs() > LARGEST * largest && (*a > 0.0) != (*b > 0.0)).count();
    (largest, error.fold(0.0, f64::max), wrong)
}

/// Every function of the language's library is tried.
fn all_are_tried() {
    let library = include_str!("../../../src/ir/function.rs");
    let names = library.lines().filter_map(|line| {
        let (variant, rest) = line.trim().split_once(" \"")?;
        let is_variant = line.ends_with(';') && variant.chars().all(char::is_alphanumeric);
        is_variant.then(|| rest.split_once('"').unwrap().0)
    });
    let names: Vec<&str> = names.collect();
    assert!(names.len() >= 15, "{names:?}");
    for name in names {
        let call = format!("{name}(");
        assert!(FORMULAS.iter().any(|(_, formula)| formula.contains(&call)), "no formula has `{name}`");
    }
}

pub fn shaders(room: &mut Room) {
    all_are_tried();
    let points = points();
    let table = points.iter().fold(String::from("x,y,z\n"), |mut table, [x, y, z]| {
        let _ = writeln!(table, "{x:?},{y:?},{z:?}");
        table
    });
    std::fs::write(room.folder.join("points.csv"), table).unwrap();
    let page = PAGE.replace("WIDTH", &SIZE.0.to_string()).replace("HEIGHT", &SIZE.1.to_string());
    std::fs::write(room.folder.join("shaders.html"), page).unwrap();
    room.browser.open(&format!("file://{}", room.folder.join("shaders.html").display()));
    let texels: Vec<u8> =
        points.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0.0]).flat_map(f32::to_le_bytes).collect();
    room.browser.eval(&format!("given('{}')", BASE64_STANDARD.encode(texels)));
    let mut failures = Vec::new();
    for (name, formula) in FORMULAS.iter().chain(ROUNDED) {
        std::fs::write(room.folder.join("f.rfm"), format!("rfm 1\nsolid f = {formula}\n")).unwrap();
        rfm(&room.folder, &["build", "f.rfm", "-o", "f.glsl"]);
        let source = std::fs::read_to_string(room.folder.join("f.glsl")).unwrap();
        let arguments = ["eval", "f.rfm", "--points", "points.csv", "--precision", "f32", "--what", "value"];
        let known = rfm(&room.folder, &arguments);
        let number = |line: &str| line.split(',').nth(3).unwrap().parse::<f64>().unwrap() as f32;
        let known: Vec<f32> = known.lines().skip(1).map(number).collect();
        let mut computed = |call: &str| -> Vec<f32> {
            let source = source.replace('\\', "\\\\").replace('`', "\\`").replace("${", "\\${");
            let text = room.browser.eval(&format!("computed(`{source}`, `{call}`)"));
            let bytes = BASE64_STANDARD.decode(text.as_str().unwrap()).unwrap();
            bytes.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect()
        };
        let value: Vec<f32> =
            computed("vec4(f_omega(p), 0.0, 0.0, 0.0)").chunks(4).map(|texel| texel[0]).collect();
        assert_eq!(value.len(), points.len());
        let (largest, error, wrong) = compare(&value, &known);
        println!("  {name}: {:.1e} of the largest value, {wrong} wrong signs", error / largest);
        if wrong > 0 || error > LARGEST * largest {
            failures.push(format!(
                "{name}: ω differs by {:.1e} of {largest}, {wrong} wrong signs",
                error / largest
            ));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
