//! Guaranteed ranges: no point is ever outside, in machine code and in the interpreter.

use rfm::codegen::Rounding;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::interval::Interval;
use rfm::ir::{Binary, Expr, Graph, Interpreter, Node, RangeEvaluator, exact};
use rfm::simplify::simplify;
use rfm::solid::{CellMap, Place, RangeProgram};
use rfm::{Engine, Field, Program, Solid};

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

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

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
    const FORMULAS: [&str; 10] = [
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
    ];
    let formula = |text: &&str| {
        let program = Program::from_source("f.rfm", format!("rfm 1\nsolid s = {text}"));
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
        let divides = graph.nodes().any(|(_, expr)| matches!(expr, Expr::Binary(Binary::Div, ..)));
        assert!(answers == asked || divides && 3 * answers > asked, "{graph:?}: {answers} of {asked}");
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
