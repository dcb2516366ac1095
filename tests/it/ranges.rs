//! Guaranteed ranges: no point is ever outside, in machine code and in the interpreter.

use rfm::codegen::Rounding;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::interval::Interval;
use rfm::ir::{Binary, Expr, Graph, Interpreter, Node, RangeEvaluator, Unary, exact};
use rfm::simplify::simplify;
use rfm::solid::{CellMap, Place, RangeProgram};
use rfm::{Engine, Field, Program, Solid};

use crate::random::Random;

const MORE: &str = "rfm 1
solid mixed = (torus(1, 0.3).rotate_x(0.4) or cone(1, 2) \\ cylinder(0.3, 3)) and abs(x - y/3) <= 2 - z
  or capsule(0.2, 1).move([1, 1, 0]) or x*y*z <= -1 and 2*x^3 - x*y + 0.1 >= z/7 and -1.5 <= x + y <= 2
";

fn solids() -> Vec<[Solid; 2]> {
    let example = |name: &str| {
        let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
        (Program::from_path(path).unwrap_or_else(|e| panic!("{e}")), name.to_string())
    };
    let more = Program::from_source("more.rfm", MORE).unwrap_or_else(|e| panic!("{e}"));
    let all = [example("cube"), example("pawn"), example("bishop"), (more, "mixed".to_string())];
    all.map(|(program, name)| {
        [Engine::Jit, Engine::Interpreter].map(|engine| program.solid_with(&name, engine).unwrap())
    })
    .into()
}

impl Random {
    /// A box of any size from 1e-9 to 10 somewhere within 5 of the origin; some are flat or single points.
    fn aabb(&mut self) -> Aabb {
        let size = 10f64.powf(10.0 * self.unit() - 9.0);
        let min = 10.0 * DVec3::new(self.unit(), self.unit(), self.unit()) - 5.0;
        let side = |r: f64| if r < 0.1 { 0.0 } else { size * r };
        let size = DVec3::new(side(self.unit()), side(self.unit()), side(self.unit()));
        Aabb::new(min, min + size)
    }
}

#[test]
fn no_point_is_outside_its_range() {
    let mut random = Random(3);
    for [jit, interpreter] in solids() {
        for _ in 0..20_000 {
            let over = random.aabb();
            let (fast, slow) = (jit.range(&over), interpreter.range(&over));
            let (twin, slow_twin) = (jit.twin().range(&over), interpreter.twin().range(&over));
            for _ in 0..4 {
                let at = DVec3::new(random.unit(), random.unit(), random.unit());
                let p = (over.min + over.size() * at).clamp(over.min, over.max);
                let omega = jit.omega(p);
                assert!(
                    fast.contains(omega) && slow.contains(omega),
                    "{jit:?} over {over:?}: {omega} {fast:?} {slow:?}"
                );
                let omega = Field::omega(&jit.twin(), p);
                assert!(
                    twin.contains(omega) && slow_twin.contains(omega),
                    "{jit:?} over {over:?}: {omega} {twin:?}"
                );
            }
            // machine code is not wider than a few roundings
            for (fast, slow) in [(fast, slow), (twin, slow_twin)] {
                let slack = 1e-12 * (1.0 + slow.lo.abs().max(slow.hi.abs()));
                let close = fast.lo >= slow.lo - slack && fast.hi <= slow.hi + slack;
                assert!(close, "{jit:?} over {over:?}: {fast:?} {slow:?}");
            }
        }
    }
}

#[test]
fn most_cells_of_the_pawn_are_decided() {
    let [pawn, _] = &solids()[1];
    let twin = pawn.twin();
    let side = 3.0 / 32.0;
    let (mut decided, mut near) = (0, 0);
    for i in 0..32 * 32 * 32 {
        let corner = DVec3::new(f64::from(i % 32), f64::from(i / 32 % 32), f64::from(i / 1024)) * side;
        let range = twin.range(&Aabb::new(corner, corner + side));
        if range.lo > 0.0 || range.hi < 0.0 { decided += 1 } else { near += 1 }
    }
    // the monotone rule decides 98 % of the cells at depth five
    assert!(decided * 100 >= 98 * (decided + near), "{decided} decided, {near} not");
}

#[test]
fn odd_boxes_have_an_answer() {
    for [jit, interpreter] in solids() {
        let infinite = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        let far = Aabb::new(DVec3::splat(1e12), DVec3::splat(2e12));
        let nan = Aabb::new(DVec3::NAN, DVec3::ONE);
        for over in [infinite, far, nan, Aabb::EMPTY] {
            let range = jit.range(&over);
            assert_eq!(range, interpreter.range(&over));
            assert!(range.lo <= range.hi);
        }
    }
}

/// ω as written, and a range program of it for each way of rounding that this processor supports.
fn formulas() -> Vec<(Graph, Node, RangeEvaluator, Vec<RangeProgram>)> {
    const FORMULAS: [&str; 18] = [
        "x*(3 - x)",
        "(x - 0.1)*(x - 0.7) or (0.3 - y)*(y + 1e3)",
        "x*y*z - (x + y)*(y - z)*(2 - x) and 3*x - y/7 + z*(-0.3)",
        "abs(x - y)*abs(y) - sqrt(x^2 + y^2 + 0.1) or -z/(-3)",
        "1e-200*x and 1e-180*y or 1e-160*z",
        "(x and y) + (y or z)*(x and -z) and x",
        "min(x, y, z) + max(x*y, y*z, 0.5) or (1 - x)*(1 - x)",
        "(0.1 - z)*(0.3 - z) and (z - 5)*(-z)",
        // where a divisor may vanish only the interpreter answers
        "x/(y - 0.3) + (z/(2 + abs(z)) - y)/sqrt(x^2 + y^2)",
        "(1 - x)/(x*y - 0.5)/(z^2 + 1e-3)",
        "atan2(y, x) + x/10",
        "r*abs(atan2(y + 0.1, -x)) and atan2(x*y, z - 1)",
        "atan(100*x) - atan2(x - y, z)*atan(z - 0.3)",
        "normalise(x - y^2 and y or z)",
        // functions that are called
        "sin(3*x) + cos(y - z)*exp(z/2) - tanh(x)",
        "ln(x + 6 + y^2) + (x^2 + 0.1)^(y/3) - tan(z/2)",
        "asin(x/30) + acos(y/30) - sinh(z/2) + log2(z + 20) - cosh(y/3)*log10(x + 30)",
        // where a root may be that of a negative number only the interpreter answers
        "sqrt(x + 4) - sqrt(y^2 + x + 3)",
    ];
    let formula = |text: &&str| {
        let program = Program::from_source("f.rfm", format!("rfm 1\nlet r = hypot(x, y)\nsolid s = {text}"));
        let program = program.unwrap_or_else(|e| panic!("{e}"));
        let module = program.module();
        let (graph, roots, _) = simplify(&module.graph, &[module.solids[0].node]);
        let root = roots[0];
        // rounding to nearest is available on every machine that has machine code
        let nearest = RangeProgram::with_rounding(&graph, root, Rounding::Nearest).unwrap();
        let upward = RangeProgram::with_rounding(&graph, root, Rounding::Upward).ok();
        let evaluator = RangeEvaluator::new(&graph, root);
        (graph, root, evaluator, upward.into_iter().chain([nearest]).collect())
    };
    FORMULAS.iter().map(formula).collect()
}

/// Boxes per formula and per solid. RFM_RANGE_BOXES=1000000 asks for a night's work.
fn boxes() -> usize {
    std::env::var("RFM_RANGE_BOXES").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000)
}

#[test]
#[ignore = "long"]
fn neither_exact_values_nor_rounded_ones_leave_the_range() {
    let mut random = Random(11);
    for (graph, root, evaluator, programs) in formulas() {
        let interpreter = Interpreter::new(&graph, &[root]);
        let mut answers = 0;
        for i in 0..boxes() {
            let over = random.aabb();
            let slow = evaluator.eval(&over);
            let fast: Vec<Interval> = programs.iter().filter_map(|p| p.call(&over, &[], &[])).collect();
            answers += fast.len();
            for _ in 0..3 {
                let at = DVec3::new(random.unit(), random.unit(), random.unit());
                let p = (over.min + over.size() * at).clamp(over.min, over.max);
                let mut rounded = [0.0];
                interpreter.eval_f64(p.to_array(), &mut rounded);
                if rounded[0].is_nan() {
                    assert!(
                        slow == Interval::ALL && fast.is_empty(),
                        "{graph:?} over {over:?} at {p}: {fast:?}"
                    );
                    continue;
                }
                let held =
                    |value: f64| slow.contains(value) && fast.iter().all(|range| range.contains(value));
                assert!(held(rounded[0]), "{graph:?} over {over:?} at {p}: {rounded:?} {slow:?} {fast:?}");
                if i % 10 == 0 {
                    let exact = exact::evaluate(&graph, &[root], p.to_array()).unwrap()[0].to_f64();
                    assert!(held(exact), "{graph:?} over {over:?} at {p}: {exact} {slow:?} {fast:?}");
                }
            }
            for range in fast {
                // R₀ is widened by 16 ulp of its larger operand, here up to 5e3; other nodes by a few ulp of
                // their own
                let slack = 1e-10 * (1.0 + slow.lo.abs().max(slow.hi.abs()));
                let close = range.lo >= slow.lo - slack && range.hi <= slow.hi + slack;
                assert!(close, "{graph:?} over {over:?}: {range:?} {slow:?}");
            }
        }
        let asked = boxes() * programs.len();
        let may_refuse = graph.nodes().any(|(_, expr)| {
            matches!(
                expr,
                Expr::Binary(Binary::Div | Binary::DivOrZero | Binary::Call(_), ..)
                    | Expr::Unary(Unary::Call(_) | Unary::Sqrt, _)
            )
        });
        assert!(answers == asked || may_refuse && 3 * answers > asked, "{graph:?}: {answers} of {asked}");
    }
}

#[test]
fn the_rounding_of_the_caller_is_put_back() {
    let [pawn, _] = &solids()[1];
    let over = Aabb::new(DVec3::ZERO, DVec3::ONE);
    let third = || std::hint::black_box(1.0f64) / std::hint::black_box(3.0);
    let before = third();
    let first = pawn.range(&over);
    assert_eq!(third().to_bits(), before.to_bits());
    assert_eq!(pawn.range(&over), first);
    // rounding upwards would give the neighbour above
    assert_eq!(before, 0.333_333_333_333_333_31);
}

#[test]
fn leaves_of_one_shape_have_ranges_from_one_program() {
    // 30 balls, slabs and halves of each sign: the cell map and the bounds use the ranges of leaves
    let text = "any i in 0..30: sphere(0.1 + i/100).move([i/10 - 1.5, sin(i), cos(i)])
        and (i/20 - 1)*z <= 0.3 and (x - i/9)*(x + 2 - i/7) <= 5 and abs(y)/(i - 15.5) <= 0.2";
    let program = Program::from_source("t.rfm", format!("rfm 1\nsolid s = {text}"));
    let program = program.unwrap_or_else(|e| panic!("{e}"));
    let [jit, interpreter] = [Engine::Jit, Engine::Interpreter].map(|e| program.solid_with("s", e).unwrap());
    let domain = Aabb::new(DVec3::splat(-2.0), DVec3::splat(2.0));
    let maps = [&jit, &interpreter].map(|solid| CellMap::new(solid, domain).unwrap());
    let mut random = Random(5);
    for _ in 0..boxes() {
        let p = 4.0 * DVec3::new(random.unit(), random.unit(), random.unit()) - 2.0;
        let sign = interpreter.sign(p);
        for map in &maps {
            match map.place_of(p) {
                Place::Fluid => assert_eq!(sign, -1.0, "{p}"),
                Place::Inside => assert_eq!(sign, 1.0, "{p}"),
                Place::Near => {}
            }
        }
    }
    let [a, b] = maps.each_ref().map(|map| map.stats());
    // cells that touch a surface in a corner are decided by one way of rounding and not by another
    assert!(a.fluid > 1000 && a.near > 100 && a.near.abs_diff(b.near) < b.near / 50, "{a:?} {b:?}");
    let [a, b] = [&jit, &interpreter].map(|solid| solid.bounds().aabb().unwrap());
    assert!((a.min - b.min).length() + (a.max - b.max).length() < 1e-4, "{a:?} {b:?}");
}

/// Two ends of an interval of any size, of either sign or none, with zeros now and then.
fn ends(random: &mut Random) -> [f64; 2] {
    let mut end = || {
        let size = 10f64.powf(if random.unit() < 0.5 {
            4.0 * random.unit() - 3.0
        } else {
            331.0 * random.unit() - 323.5 // numbers that have lost digits, too
        });
        let signed = if random.unit() < 0.5 { -size } else { size };
        if random.unit() < 0.1 { 0.0 } else { signed }
    };
    let (a, b) = (end(), end());
    let b = if random.unit() < 0.2 { a } else { b };
    let near = if random.unit() < 0.3 { a + (b - a) * 1e-9 } else { b };
    [a.min(near), a.max(near)]
}

#[test]
#[ignore = "long"]
fn angles_hold_forty_digits_across_the_cut_and_around_the_origin() {
    let mut random = Random(23);
    for text in ["atan2(y, x)", "atan(x)"] {
        let program = Program::from_source("f.rfm", format!("rfm 1\nsolid s = {text}")).unwrap();
        let module = program.module();
        let (graph, roots, _) = simplify(&module.graph, &[module.solids[0].node]);
        let root = roots[0];
        let evaluator = RangeEvaluator::new(&graph, root);
        let nearest = RangeProgram::with_rounding(&graph, root, Rounding::Nearest).unwrap();
        let upward = RangeProgram::with_rounding(&graph, root, Rounding::Upward).ok();
        let interpreter = Interpreter::new(&graph, &[root]);
        let (mut crossing, mut around) = (0, 0);
        for i in 0..2 * boxes() {
            let [x, y] = [ends(&mut random), ends(&mut random)];
            let over = Aabb::new(DVec3::new(x[0], y[0], 0.0), DVec3::new(x[1], y[1], 0.0));
            crossing += usize::from(x[0] < 0.0 && y[0] < 0.0 && y[1] > 0.0);
            around += usize::from(over.contains(DVec3::ZERO));
            let slow = evaluator.eval(&over);
            for program in upward.iter().chain([&nearest]) {
                let fast = program.call(&over, &[], &[]).unwrap();
                let slack = 40.0 * f64::EPSILON;
                assert!(
                    fast.lo >= slow.lo - slack * slow.lo.abs() - 1e-299
                        && fast.hi <= slow.hi + slack * slow.hi.abs() + 1e-299,
                    "{text} over {over:?}: {fast:?} {slow:?}"
                );
                for k in 0..8 {
                    let at = DVec3::new(random.unit(), random.unit(), 0.0);
                    let inner = over.min + over.size() * at;
                    let corner = DVec3::new(x[k & 1], y[k >> 1 & 1], 0.0);
                    let p = if k < 4 { corner } else { inner.clamp(over.min, over.max) };
                    let mut rounded = [0.0];
                    interpreter.eval_f64(p.to_array(), &mut rounded);
                    assert!(fast.contains(rounded[0]), "{text} over {over:?} at {p}: {rounded:?} {fast:?}");
                    if i % 8 == 0 {
                        let exact = exact::evaluate(&graph, &[root], p.to_array()).unwrap()[0].to_f64();
                        assert!(fast.contains(exact), "{text} over {over:?} at {p}: {exact} {fast:?}");
                    }
                }
            }
        }
        assert!(crossing > boxes() / 20 && around > boxes() / 20, "{crossing} {around}");
        let infinite = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        assert_eq!(nearest.call(&infinite, &[], &[]), None);
    }
}

#[test]
fn slopes_hold_between_any_two_points_whatever_jumps_between_them() {
    // nine leaves of each shape, so that machine code answers for them
    const LEAVES: [&str; 7] = [
        "atan2(y - (i + 1)/9, x) + i/20 - 0.7",
        "floor(3*x + i/10 + 0.05) - y*(i + 1)",
        "where(x <= (i + 1)/10, 1 + y, 2 - z) - z*(i + 2)",
        "tan(x*(1 + i/9)) - y",
        "sqrt(x + (i + 1)/10) - y",
        "normalise(x - (i + 1)/10 and y) - z",
        "sign(x - (i + 1)/10)*y - z",
    ];
    let mut random = Random(31);
    for leaf in LEAVES {
        let text = format!("rfm 1\nsolid s = any i in 0..9: {leaf}");
        let program = Program::from_source("f.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        let solid = program.solid("s").unwrap();
        let (twin, mut looked_at) = (solid.twin(), 0);
        for _ in 0..2000 {
            let min = 4.0 * DVec3::new(random.unit(), random.unit(), random.unit()) - 2.0;
            let size = 10f64.powf(3.0 * random.unit() - 3.0);
            let over = Aabb::new(min, min + size);
            let mut points = [DVec3::ZERO; 6];
            points.fill_with(|| over.min + size * DVec3::new(random.unit(), random.unit(), random.unit()));
            twin.sheets(&over, &mut |sheet| {
                for pair in points.windows(2) {
                    let ((from, _), (to, _)) = ((sheet.at)(pair[0]), (sheet.at)(pair[1]));
                    let step = (pair[1] - pair[0]).to_array();
                    let allowed = (0..3).fold(Interval::point(0.0), |sum, axis| {
                        sum + sheet.slopes[axis] * Interval::point(step[axis])
                    });
                    let slack = 1e-12 * (1.0 + from.abs() + to.abs());
                    let rise = to - from;
                    let holds = rise >= allowed.lo - slack && rise <= allowed.hi + slack;
                    assert!(holds || rise.is_nan(), "{leaf} over {over:?}: {rise} {allowed:?}");
                    looked_at += 1;
                }
            });
        }
        assert!(looked_at > 1000, "{leaf}: {looked_at}");
    }
}

/// Where the operands of a minimum are equal, as the faces of a rounded shape are beside its edges, its
/// slopes are theirs.
#[test]
fn slopes_of_a_rounded_box_are_those_of_its_plane_faces() {
    let text = "rfm 1\nsolid s = box([-0.5, -0.4, -0.3], [0.5, 0.4, 0.3]).rotate([1, 2, 3], 0.6).round(5 cm)";
    let solid = Program::from_source("f.rfm", text).unwrap().solid("s").unwrap();
    let (twin, mut faces) = (solid.twin(), 0);
    let axis = DVec3::new(1.0, 2.0, 3.0).normalize();
    let turned = |p: DVec3| rfm::glam::DQuat::from_axis_angle(axis, 0.6) * p;
    for normal in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z] {
        let middle = turned(normal * DVec3::new(0.5, 0.4, 0.3));
        let outward = turned(normal);
        let all = twin.sheets(&Aabb::new(middle - 1e-3, middle + 1e-3), &mut |sheet| {
            faces += 1;
            for (slope, out) in sheet.slopes.iter().zip(outward.to_array()) {
                assert!(slope.lo < -out + 1e-9 && slope.hi > -out - 1e-9, "{normal}: {slope:?}, {out}");
                assert!(slope.width() < 0.3, "{normal}: {slope:?}, {out}");
            }
        });
        assert!(all);
    }
    assert!(faces >= 6, "{faces}");
}
