//! Shaders: what naga says of them, and what GLSL computes where C++ reads it.

use std::process::Command;
use std::time::Instant;

use naga::front::{glsl, wgsl};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use rfm::Solid;
use rfm::source::{self, Math, Options, Target};

use super::compare::points;
use super::library::{Workshop, compile, is_here};
use super::{balls, exact, example_solids, random_solids, short_examples, solids_of_every_operation};

fn shader(solid: &Solid, target: Target) -> String {
    let options = Options { math: Math::System, ..exact("s") };
    source::write(solid, target, &options).unwrap_or_else(|e| panic!("{e}")).text
}

fn validate(module: &naga::Module, text: &str) {
    let result = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(module);
    assert!(result.is_ok(), "{:?}\n{text}", result.err());
}

fn validate_wgsl(text: &str) {
    let module = wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}\n{text}", e.emit_to_string(text)));
    validate(&module, text);
}

/// A fragment shader around the functions. naga reads the desktop's GLSL, in which they mean the same.
fn validate_glsl(text: &str) {
    let whole = format!("#version 450\nprecision highp float;\n{text}\nvoid main() {{}}\n");
    let options = glsl::Options::from(naga::ShaderStage::Fragment);
    let module = glsl::Frontend::default().parse(&options, &whole);
    validate(&module.unwrap_or_else(|e| panic!("{}\n{whole}", e.emit_to_string(&whole))), &whole);
}

/// Lines of the longest shader that is read in every run of the tests: the time that naga takes grows with
/// their square.
const LONGEST_SHADER: usize = 500;

/// Solids whose numbers `f32` can hold.
fn solids() -> Vec<Solid> {
    let mut solids = solids_of_every_operation();
    solids.pop(); // it has 1e300, see below
    let is_short = |solid: &Solid| shader(solid, Target::Wgsl).lines().count() <= LONGEST_SHADER;
    solids.extend(example_solids().into_iter().filter(is_short));
    solids.extend(random_solids_for_shaders(40));
    solids
}

/// Random solids without numbers that shaders cannot hold, such as the logarithm of a constant zero.
fn random_solids_for_shaders(count: usize) -> Vec<Solid> {
    let options = Options { math: Math::System, ..exact("s") };
    let fits = |solid: &Solid| match source::write(solid, Target::Wgsl, &options) {
        Ok(_) => true,
        Err(error) => {
            assert!(error.to_string().contains("f32 cannot hold"), "{error}");
            false
        }
    };
    let solids: Vec<Solid> = random_solids(count).into_iter().filter(fits).collect();
    assert!(4 * solids.len() >= 3 * count, "{} of {count}", solids.len());
    solids
}

/// naga accepts both shaders of a solid.
fn accepted(solid: &Solid) {
    validate_wgsl(&shader(solid, Target::Wgsl));
    validate_glsl(&shader(solid, Target::Glsl));
}

#[test]
#[ignore = "takes minutes"]
fn study_of_the_longest_examples_by_naga() {
    example_solids().iter().for_each(accepted);
    let started = Instant::now();
    validate_wgsl(&shader(&balls(500), Target::Wgsl));
    println!("500 balls validated in {:.2} s", started.elapsed().as_secs_f64());
}

#[test]
#[ignore = "long"]
fn naga_accepts_wgsl_and_glsl_of_every_operation() {
    solids().iter().for_each(accepted);
    validate_wgsl(&shader(&balls(40), Target::Wgsl));
}

#[test]
fn numbers_that_shaders_cannot_hold_are_refused() {
    let solid = solids_of_every_operation().pop().unwrap();
    for target in [Target::Wgsl, Target::Glsl] {
        let error = source::write(&solid, target, &Options::default()).unwrap_err().to_string();
        assert!(error.contains("f32 cannot hold"), "{error}");
    }
}

/// The part of GLSL that the functions use, in C++.
const GLSL_IN_CPLUSPLUS: &str = "#include <cmath>\n#include <cstdio>\n#include <cstring>\n\
struct vec3 { float x, y, z; };\n\
struct vec4 { float x, y, z, w; vec4(float a, float b, float c, float d) : x(a), y(b), z(c), w(d) {} };\n\
using std::abs; using std::acos; using std::asin; using std::atan; using std::cos; using std::exp; using std::floor;\n\
using std::log; using std::pow; using std::sin; using std::sqrt; using std::tan;\n\
using std::cosh; using std::log2; using std::sinh; using std::tanh;\n\
static float roundEven(float x) { return std::nearbyint(x); }\n\
static float atan(float y, float x) { return std::atan2(y, x); }\n";

/// A program that reads points and writes ω, the sign and the gradient there, of the solid whose number is
/// its argument.
fn all_in_cplusplus(solids: &[Solid]) -> String {
    let mut text = GLSL_IN_CPLUSPLUS.to_string() + "#include <cstdlib>\n";
    let mut calls = String::new();
    for (i, solid) in solids.iter().enumerate() {
        text += &format!("namespace n{i} {{\n{}\n}}\n", shader(solid, Target::Glsl));
        let t = if solid.moves() { format!(", {}f", solid.time()) } else { String::new() };
        calls += &format!(
            "case {i}: {{ vec4 g = n{i}::s_omega_gradient(q{t}); float out[6] = {{n{i}::s_omega(q{t}), \
             n{i}::s_sign(q{t}), g.x, g.y, g.z, g.w}}; std::fwrite(out, 4, 6, stdout); break; }}\n"
        );
    }
    text + "int main(int, char **words) { float p[3]; while (std::fread(p, 4, 3, stdin) == 3) { \
            vec3 q = {p[0], p[1], p[2]}; switch (std::atoi(words[1])) {\n"
        + &calls
        + "} } return 0; }\n"
}

#[test]
fn glsl_computes_omega_to_the_digits_of_f32() {
    if !is_here("g++") {
        return;
    }
    let mut solids = short_examples();
    solids.extend(random_solids_for_shaders(12));
    solids.push(solids_of_every_operation().remove(0));
    let workshop = Workshop::new();
    workshop.write("all.cpp", all_in_cplusplus(&solids));
    compile("g++", workshop.path(), &["-std=c++20", "-O0", "-ffp-contract=off", "-o", "all", "all.cpp"]);
    for (i, solid) in solids.iter().enumerate() {
        let [x, y, z] = points(1000, i as u64);
        let places: Vec<[f32; 3]> = (0..1000).map(|i| [x[i] as f32, y[i] as f32, z[i] as f32]).collect();
        let bytes: Vec<u8> = places.iter().flatten().flat_map(|c| c.to_ne_bytes()).collect();
        let input = workshop.write("points", bytes);
        let output = Command::new(workshop.path().join("all"))
            .arg(i.to_string())
            .stdin(std::fs::File::open(input).unwrap())
            .output()
            .unwrap();
        assert!(output.status.success());
        let numbers: Vec<f32> =
            output.stdout.chunks(4).map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]])).collect();
        check(solid, &places, &numbers);
    }
}

/// Values in `f32` against those of the machine code in `f32`: functions of the system differ in their last bits.
fn check(solid: &Solid, places: &[[f32; 3]], numbers: &[f32]) {
    let (mut largest, mut creased) = (0f32, 0);
    for p in places.iter().filter(|p| p.iter().all(|c| c.abs() <= 3.0)) {
        let omega = solid.omega_f32((*p).into());
        if omega.is_finite() {
            largest = largest.max(omega.abs());
        }
    }
    for (p, found) in places.iter().zip(numbers.chunks(6)) {
        let (omega, gradient) = solid.omega_grad_f32((*p).into());
        if !p.iter().all(|c| c.abs() <= 3.0) || !omega.is_finite() {
            continue;
        }
        let error = (found[0] - omega).abs();
        assert!(error <= 4e-6 * largest, "{solid:?} at {p:?}: {} and {omega}", found[0]);
        if omega.abs() > 4e-6 * largest {
            assert!(found[0].signum() == omega.signum(), "{solid:?} at {p:?}: {} and {omega}", found[0]);
        }
        if gradient.is_finite() && solid.name() != "everything" {
            // at a crease any of the gradients beside it will do, and sums of them, where operands have it together
            let beside = (0..6).map(|i| {
                let mut q = *p;
                q[i % 3] += if i < 3 { 1e-5 } else { -1e-5 };
                solid.omega_grad_f32(q.into()).1
            });
            let all = beside.filter(|g| g.is_finite());
            let (least, most) =
                all.fold((gradient, gradient), |(least, most), g| (least.min(g), most.max(g)));
            let allowed = 1e-3 * (1.0 + gradient.length());
            if (most - least).length() > allowed {
                creased += 1;
                continue;
            }
            let error = (glam(found) - glam(found).clamp(least, most)).length();
            assert!(error <= allowed, "{solid:?} at {p:?}: {found:?} and {gradient}");
        }
    }
    assert!(creased * 10 <= places.len(), "{solid:?}: {creased} gradients at creases");
}

fn glam(found: &[f32]) -> rfm::glam::Vec3 {
    rfm::glam::Vec3::new(found[2], found[3], found[4])
}
