//! Bounds of solids: found, never too small, and close to the true extent.

use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use rfm::geom::Aabb;
use rfm::glam::{DMat3, DVec3};
use rfm::solid::Bounds;
use rfm::{Engine, Program, Solid};

use crate::random::Random;

fn solid(text: &str) -> Solid {
    let program = Program::from_source("b.rfm", format!("rfm 1\nsolid s = {text}"));
    program.unwrap_or_else(|e| panic!("{text}: {e}")).solid_with("s", Engine::Auto).unwrap()
}

/// The box of the points that are inside, among many in a box; by the signs alone.
fn sampled(solid: &Solid, over: &Aabb, count: usize) -> Aabb {
    let mut numbers = Random(1);
    let points: Vec<DVec3> = (0..count).map(|_| numbers.in_box(over)).collect();
    let [x, y, z] = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect::<Vec<f64>>());
    let mut sign = vec![0.0; count];
    solid.sign_many([&x, &y, &z], &mut sign);
    let inside = points.iter().zip(&sign).filter(|&(_, &sign)| sign > 0.0);
    inside.fold(Aabb::EMPTY, |hull, (&p, _)| hull.including(p))
}

/// The bounds hold every point that is inside, and are the true extent to within `slack` of its longest side.
#[track_caller]
fn check(text: &str, min: [f64; 3], max: [f64; 3], slack: f64) {
    let solid = solid(text);
    let truth = Aabb::new(DVec3::from_array(min), DVec3::from_array(max));
    let Bounds::Within(found) = *solid.bounds() else { panic!("{text}: {:?}", solid.bounds()) };
    let margin = slack * truth.size().max_element();
    let (low, high) = (truth.min - found.min, found.max - truth.max);
    // never too small, but for the digits to which the truth is given
    let least = -1e-9 * truth.size().max_element();
    assert!(low.min_element() >= least && high.min_element() >= least, "{text}: too small, {found:?}");
    assert!(low.max_element() <= margin && high.max_element() <= margin, "{text}: too large, {found:?}");
    let points = sampled(&solid, &truth.grown(truth.size().max_element()), 1_000_000);
    assert!(points.is_empty() || found.union(&points) == found, "{text}: {points:?} not in {found:?}");
}

/// The parts of rounded and offset shapes are distances, whose formulas do not show where they end.
#[test]
fn rounded_and_offset_shapes_end_where_their_parts_do() {
    check("box([0,0,0],[9,3,0.4]).round(0.15)", [0.0; 3], [9.0, 3.0, 0.4], 1e-3);
    check("box([0,0,0],[1,1,1]).round(0.1)", [0.0; 3], [1.0; 3], 1e-3);
    // the arc at the foot takes something of its radius
    check("cone(1,2).round(0.1)", [-0.9607, -0.9607, 0.0], [0.9607, 0.9607, 2.0], 1e-3);
    check("box([0,0,0],[9,3,0.4]).offset(0.2)", [-0.2; 3], [9.2, 3.2, 0.6], 1e-6);
    check("box([0,0,0],[9,3,0.4]).offset(-0.1)", [0.1; 3], [8.9, 2.9, 0.3], 1e-6);
    check("(sphere(1) or box([0,0,0],[2,2,2])).offset(0.5)", [-1.5; 3], [2.5; 3], 1e-5);
    // on its axis the field of a cone has no slope
    let (wide, high) = (1.0 + 0.2 * (1.0 + 2_f64.sqrt()), 1.0 + 0.2 * 2_f64.sqrt());
    check("cone(1,1).offset(0.2)", [-wide, -wide, -0.2], [wide, wide, high], 1e-5);
}

/// However many parts a fillet joins, it reaches beyond them by no more than its radius.
#[test]
fn a_row_of_fillets_ends_near_its_parts() {
    let row = solid("(any i in 0..30: box([0.1*i, 0, 0], [0.1*i + 0.17, 1, 1])).round(0.1)");
    let Bounds::Within(found) = *row.bounds() else { panic!("{:?}", row.bounds()) };
    let parts = Aabb::new(DVec3::ZERO, DVec3::new(3.07, 1.0, 1.0));
    assert_eq!(parts.grown(0.1).union(&found), parts.grown(0.1), "{found:?}");
    assert_eq!(found.union(&sampled(&row, &parts.grown(0.2), 200_000)), found);
}

/// A chamfer that is rounded ends where it did, and by the radius less at its edges.
#[test]
fn a_chamfer_that_is_rounded_has_bounds() {
    let Bounds::Within(cut) = *solid("chamfer(sphere(1), box(), 0.2).round(0.1)").bounds() else { panic!() };
    assert!(cut.size().max_element() < 2.3, "{cut:?}");
}

/// Ellipsoids in general position, as written by hand; products of coordinates have no end by themselves.
#[test]
fn forms_of_second_degree_end_where_their_matrix_says() {
    let end = (4.0_f64 / 3.0).sqrt();
    check("x^2 + y^2 + z^2 - x*y <= 1", [-end, -end, -1.0], [end, end, 1.0], 1e-6);
    let [a, b] = [1.5_f64.sqrt(), 2_f64.sqrt()];
    check("x^2 + y^2 + z^2 - x*y - y*z <= 1", [-a, -b, -a], [a, b, a], 1e-6);
    let y = 8_f64.sqrt();
    check("(x - 2*y)^2 + (y + z)^2 + (z - 3)^2 <= 4", [-12.0, -3.0 - y, 1.0], [0.0, y - 3.0, 5.0], 1e-6);
    let (low, high) = ([-2.0 / 3.0, -0.5, 0.0], [2.0, 5.0 / 6.0, end]);
    check("1 - x^2 - 4*y^2 - z^2 + 2*x*y + x >= 0 and z >= 0", low, high, 1e-3);
    for text in ["x*y + y*z <= 1", "x^2 + y^2 - 2*x*y + z^2 <= 1", "x^2 + y^2 - z^2 - x*y <= 1"] {
        assert_eq!(*solid(text).bounds(), Bounds::Unbounded, "{text}");
    }
}

/// Bounds that may be too large say so.
#[test]
fn bounds_are_tight_or_said_not_to_be() {
    for text in ["sphere(1)", "box([0,0,0],[9,3,0.4])", "torus(1, 0.25).rotate_x(0.3)"] {
        assert!(solid(text).bounds_are_tight(), "{text}");
    }
    let joint = solid("chamfer(box([0,0,0],[2,1,0.4]), box([0.5,0.2,0.2],[1,0.8,1]), 0.2)");
    let Bounds::Within(found) = *joint.bounds() else { panic!("{:?}", joint.bounds()) };
    assert!(found.min.z > -1e-3 || !joint.bounds_are_tight(), "{found:?}");
}

#[test]
fn conjuncts_bound_each_other() {
    check("x^3 - y^2 - z^2 and x <= 1", [0.0, -1.0, -1.0], [1.0, 1.0, 1.0], 1e-5);
    check("1 - x^4 - y^6 - z^2*z^2", [-1.0; 3], [1.0; 3], 1e-6);
    check("x^66 + y^66 + z^66 <= 1", [-1.0; 3], [1.0; 3], 1e-5);
    check("abs(x)^2.5 + abs(y)^2.5 + abs(z)^2.5 <= 1", [-1.0; 3], [1.0; 3], 1e-5);
    check("sphere(1e9)", [-1e9; 3], [1e9; 3], 1e-6);
    check("sphere(1e-9).move([5, 0, 0])", [5.0 - 1e-9, -1e-9, -1e-9], [5.0 + 1e-9, 1e-9, 1e-9], 1e-5);
    check("box([0, 0, 0], [1e-6, 1, 1])", [0.0; 3], [1e-6, 1.0, 1.0], 1e-9);
    check("abs(x) + abs(y) + abs(z) <= 1", [-1.0; 3], [1.0; 3], 1e-6);
    check("exp(x) <= 2 and x >= y and y >= z and z >= 0", [0.0; 3], [2_f64.ln(); 3], 1e-6);
    check("not (x^2 + y^2 >= 1) and 0 <= z <= 3", [-1.0, -1.0, 0.0], [1.0, 1.0, 3.0], 1e-6);
    check("sqrt(x) <= 1 and abs(y) <= x and 0 <= z <= 1", [0.0, -1.0, 0.0], [1.0; 3], 1e-6);
    check("torus(0.9, 0.2).rotate_x(90 deg)", [-1.1, -0.2, -1.1], [1.1, 0.2, 1.1], 1e-5);
}

#[test]
fn a_conjunct_with_a_box_has_at_least_that_box() {
    for other in
        ["x^y <= 1", "(-x)^0.5 <= 1", "x/y <= 1", "asin(x*y) >= 0", "ln(x - 0.5) <= 9", "tan(x) <= 2"]
    {
        let solid = solid(&format!("{other} and box()"));
        match *solid.bounds() {
            Bounds::Within(found) => {
                assert!(
                    found.union(&Aabb::new(DVec3::ZERO, DVec3::ONE)).size() == DVec3::ONE,
                    "{other}: {found:?}"
                );
            }
            Bounds::Empty => {
                assert!(sampled(&solid, &Aabb::new(DVec3::ZERO, DVec3::ONE), 100_000).is_empty())
            }
            Bounds::Unbounded => panic!("{other} and box() has no bounds"),
        }
    }
}

#[test]
fn turned_half_spaces_are_solved_together() {
    let turn = ".rotate([1, 2, 3], 0.7).move([3, -1, 2])";
    // a wedge: the tetrahedron with the corners 0, x, y and z at 2
    let wedge = "(x >= 0 and y >= 0 and z >= 0 and x + y + z <= 2)";
    let rotation = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]
        .map(|c| rotation * (2.0 * c) + DVec3::new(3.0, -1.0, 2.0));
    let truth = corners.iter().fold(Aabb::EMPTY, |hull, &c| hull.including(c));
    check(&format!("{wedge}{turn}"), truth.min.to_array(), truth.max.to_array(), 1e-6);
    check(
        &format!("({wedge}{turn}) or ({wedge}{turn} and z >= x)"),
        truth.min.to_array(),
        truth.max.to_array(),
        1e-6,
    );
}

/// A wedge between two sides of an outline ends at either side of the notch opposite, so that no end is found unless
/// each of them is looked at alone.
#[test]
fn twisted_outlines_with_notches_have_ends() {
    let end = (2.0 * std::f64::consts::PI * 0.7 * 0.1_f64).sin();
    let dart = "polygon([[1, 0], [0.2, 0.2], [0, 1], [-0.2, -0.2]]).extrude(-0.1, 0.1).twist(0.7)";
    check(dart, [-end, -end, -0.1], [1.0, 1.0, 0.1], 1e-3);
    let star =
        "polygon([[1, 0], [0.3, 0.2], [0, 1], [-0.2, 0.3], [-1, 0], [-0.3, -0.2], [0, -1], [0.2, -0.3]])";
    check(&format!("{star}.extrude(-0.1, 0.1).twist(0.7)"), [-1.0, -1.0, -0.1], [1.0, 1.0, 0.1], 1e-3);
}

/// At the times 0 and 0.5 the angle of a rod lies on the cut of atan2, up to what sines are rounded by: its range would
/// be all directions.
#[test]
fn a_linkage_ends_at_every_instant() {
    let text = "rfm 1
let a = [cos(2*pi*t), sin(2*pi*t), 0]
let turned = atan2(a.y, a.x - 3.5)
solid rod = box([0, -0.1, 0], [3, 0.1, 0.2]).rotate_z(turned).move([3.5, 0, 0])";
    let program = Program::from_source("rod.rfm", text).unwrap();
    let rod = program.solid_with("rod", Engine::Auto).unwrap();
    for time in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let Bounds::Within(found) = *rod.at(time).bounds() else { panic!("{time}: no bounds") };
        let turned =
            f64::atan2((std::f64::consts::TAU * time).sin(), (std::f64::consts::TAU * time).cos() - 3.5);
        let corners = [[0.0, -0.1], [3.0, -0.1], [3.0, 0.1], [0.0, 0.1]].map(|[x, y]| {
            DVec3::new(3.5 + x * turned.cos() - y * turned.sin(), x * turned.sin() + y * turned.cos(), 0.0)
        });
        let truth = corners.iter().fold(Aabb::EMPTY, |all, p| all.including(*p));
        let off = (found.min - truth.min).truncate().abs().max((found.max - truth.max).truncate().abs());
        assert!(off.max_element() < 0.01, "{time}: {found:?} for {truth:?}");
    }
}

#[test]
fn curves_and_blends_have_their_own_extent() {
    // a trefoil knot as the torus of two strands of radius 0.2 around 2 + cos 1.5θ, sin 1.5θ
    let strand = |sign: &str| {
        format!(
            "0.04 - (sqrt(x^2 + y^2) - 2 {sign} cos(1.5*atan2(y, x)))^2 - (z {sign} sin(1.5*atan2(y, x)))^2"
        )
    };
    let knot = solid(&format!("({}) or ({})", strand("+"), strand("-")));
    let Bounds::Within(found) = *knot.bounds() else { panic!("the knot has no bounds") };
    let points = sampled(&knot, &Aabb::new(DVec3::splat(-4.0), DVec3::splat(4.0)), 4_000_000);
    assert!(found.union(&points) == found);
    let excess = (found.size() / points.size()).max_element();
    // an angle jumps behind the knot, where derivatives say nothing
    assert!(excess < 1.15, "{excess}: {found:?} around {points:?}");

    // smooth union of two balls, by logarithms: symmetric, so it ends where y = z = 0
    let blend = "ln(exp(8*sphere(1)) + exp(8*sphere(1, [1.2, 0, 0])))/8";
    let end = {
        // the root of the same function along the x axis, by bisection
        let value = |x: f64| {
            let ball = |c: f64| 4.0 * (1.0 - (x - c) * (x - c));
            (ball(0.0).exp() + ball(1.2).exp()).ln()
        };
        let (mut inside, mut outside) = (2.2, 3.0);
        for _ in 0..60 {
            let middle: f64 = 0.5 * (inside + outside);
            if value(middle) > 0.0 { inside = middle } else { outside = middle }
        }
        outside
    };
    let Bounds::Within(found) = *solid(blend).bounds() else { panic!("the blend has no bounds") };
    assert!((found.max.x - end).abs() < 1e-5 && (found.min.x - (1.2 - end)).abs() < 1e-5, "{found:?}, {end}");
}

#[test]
fn unbounded_solids_say_which_operand_and_where() {
    for (text, operand, sides) in [
        ("x^2 + y^2 <= 1", "x^2 + y^2 <= 1", vec!["-z", "+z"]),
        ("sphere(1) or x >= 2 or box()", "x >= 2", vec!["-y", "+y", "-z", "+z", "+x"]),
        ("x^3 - y^2 - z^2", "x^3 - y^2 - z^2", vec!["+x", "-y", "+y", "-z", "+z"]),
    ] {
        let source = format!("rfm 1\nsolid s = {text}");
        let solid = Program::from_source("b.rfm", source.clone()).unwrap().solid("s").unwrap();
        let why = solid.unbounded().unwrap_or_else(|| panic!("{text} has bounds"));
        let span = why.operand.unwrap();
        assert_eq!(&source[span.range()], operand);
        assert!(
            !why.sides.is_empty() && why.sides.iter().all(|side| sides.contains(side)),
            "{text}: {:?}",
            why.sides
        );
    }
}

fn number(range: std::ops::Range<f64>) -> impl Strategy<Value = f64> {
    range.prop_map(|x| (1000.0 * x).round() / 1000.0)
}

fn vector(reach: f64) -> impl Strategy<Value = [f64; 3]> {
    [number(-reach..reach), number(-reach..reach), number(-reach..reach)]
}

/// A turned and moved convex solid with its true extent from its centre.
fn convex() -> impl Strategy<Value = (String, DVec3, DVec3)> {
    let sizes = [number(0.1..3.0), number(0.1..3.0), number(0.1..3.0)];
    (0..4_usize, sizes, vector(1.0), number(-3.0..3.0), vector(10.0))
        .prop_filter("an axis", |(_, _, axis, ..)| DVec3::from_array(*axis).length() > 0.1)
        .prop_map(|(kind, [a, b, c], axis, angle, by)| {
            let rotation = DMat3::from_axis_angle(DVec3::from_array(axis).normalize(), angle);
            let row = |i: usize| rotation.row(i);
            let reach = |f: &dyn Fn(DVec3) -> f64| DVec3::new(f(row(0)), f(row(1)), f(row(2)));
            let disc = |r: DVec3| a * (r.x * r.x + r.y * r.y).sqrt();
            let (text, reach) = match kind {
                0 => (
                    format!("box([-{a}, -{b}, -{c}], [{a}, {b}, {c}])"),
                    reach(&|r| r.abs().dot(DVec3::new(a, b, c))),
                ),
                1 => (format!("ellipsoid({a}, {b}, {c})"), reach(&|r| (r * DVec3::new(a, b, c)).length())),
                2 => (
                    format!("cylinder({a}, {b}).move([0, 0, -{b}/2])"),
                    reach(&|r| disc(r) + 0.5 * b * r.z.abs()),
                ),
                _ => (format!("capsule({a}, {b}).move([0, 0, -{b}/2])"), reach(&|r| a + 0.5 * b * r.z.abs())),
            };
            (format!("{text}.rotate({axis:?}, {angle}).move({by:?})"), DVec3::from_array(by), reach)
        })
}

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(7),
        ..ProptestConfig::with_cases(cases)
    }
}

#[test]
#[ignore = "long"]
fn convex_solids_at_any_angle_have_their_true_extent() {
    let mut runner = TestRunner::new(config(120));
    let found = std::cell::RefCell::new(Vec::new());
    let result = runner.run(&convex(), |(text, centre, reach)| {
        let Bounds::Within(bounds) = *solid(&text).bounds() else {
            return Err(TestCaseError::fail(format!("{text}: no bounds")));
        };
        let (low, high) = (centre - bounds.min, bounds.max - centre);
        let least = 1.0 - 1e-9;
        prop_assert!(low.cmpge(reach * least).all() && high.cmpge(reach * least).all(), "{text}: {bounds:?}");
        let excess = (low / reach).max(high / reach).max_element();
        if excess > 1.01 {
            println!("{excess}: {text} {bounds:?}");
        }
        found.borrow_mut().push(excess);
        Ok(())
    });
    result.unwrap();
    let mut found = found.into_inner();
    found.sort_by(f64::total_cmp);
    let worst = found[found.len() - 1];
    assert!(worst < 1.01, "{worst}");
    // half of them are nearly exact
    assert!(found[found.len() / 2] < 1.0 + 3e-4, "{}", found[found.len() / 2]);
    println!(
        "convex solids: {worst:.5} times their extent at most, {:.6} half of them",
        found[found.len() / 2]
    );
}

/// Random solids of up to six leaves, some of them undefined in places, with a ball around all of them.
fn bounded() -> impl Strategy<Value = String> {
    let size = || number(0.2..1.5);
    let leaf = prop_oneof![
        (vector(2.0), size()).prop_map(|(c, r)| format!("ball({c:?}, {r})")),
        convex().prop_map(|(text, ..)| text),
        (vector(1.0), vector(2.0))
            .prop_filter("a normal", |(n, _)| DVec3::from_array(*n).length() > 0.1)
            .prop_map(|(n, p)| format!("half_space({n:?}, {p:?})")),
        (size(), size()).prop_map(|(a, b)| format!("torus({a} + {b}, {b})")),
        size().prop_map(|a| format!("x*y*z <= {a}")),
        size().prop_map(|a| format!("(x^2 + y^2 + z^2)^2 <= {a}*(x^3 - 3*x*y^2)")),
        size().prop_map(|a| format!("sin({a}*x) + cos(y*{a}) >= z")),
        size().prop_map(|a| format!("sqrt(x + y) <= {a}")),
        size().prop_map(|a| format!("x^{a} + y/x >= z")),
    ];
    let tree = leaf.prop_recursive(3, 6, 2, |inner| {
        let operation = prop::sample::select(vec!["and", "or", "and not", "or not"]);
        (inner.clone(), operation, inner).prop_map(|(a, operation, b)| format!("({a} {operation} {b})"))
    });
    (tree, vector(5.0), number(0.5..4.0), any::<bool>()).prop_map(|(tree, centre, radius, first)| {
        let ball = format!("ball({centre:?}, {radius})");
        if first { format!("{ball} and {tree}") } else { format!("{tree} and {ball}") }
    })
}

/// A blade with this many teeth of the radii 0.6 and 1.
fn blade(teeth: usize) -> String {
    let corner = |k: usize| {
        let (sin, cos) = (std::f64::consts::PI * k as f64 / teeth as f64).sin_cos();
        let radius = if k.is_multiple_of(2) { 1.0 } else { 0.6 };
        format!("[{:.6}, {:.6}]", radius * cos, radius * sin)
    };
    format!("polygon([{}])", (0..2 * teeth).map(corner).collect::<Vec<_>>().join(", "))
}

#[test]
fn blades_of_many_teeth_have_bounds() {
    // no half-plane of such a formula reaches across a gap between teeth, and all of them cross inside
    let (low, high) = ([-1.0, -1.0, 0.0], [1.0; 3]);
    for teeth in [52, 500] {
        check(&format!("{} and 0 <= z <= 1", blade(teeth)), low, high, 1e-3);
    }
    let blade = blade(52);
    check(
        &format!("({blade} and 0 <= z <= 1).scale(2).rotate_x(90 deg).move([5, 0, 0])"),
        [3.0, -2.0, -2.0],
        [7.0, 0.0, 2.0],
        1e-3,
    );
    // the tips that are farthest out lie half a tooth beside the axes
    let far = (std::f64::consts::PI / 52.0).cos();
    check(&format!("{blade}.rotate_z(45 deg) and 0 <= z <= 1"), [-far, -far, 0.0], [far, far, 1.0], 2e-3);
    check(&format!("{blade}.move([2, 0, 0]).revolve()"), [-3.0, -3.0, -1.0], [3.0, 3.0, 1.0], 1e-3);
    let outside = solid(&format!("not {blade}"));
    assert!(matches!(outside.bounds(), Bounds::Unbounded), "{:?}", outside.bounds());
}

#[test]
fn bounds_hold_the_tip_of_a_needle() {
    // its edges are off by rounding, and cross farther out than its corner lies
    let needle = solid("polygon([[0, 0], [1000, 1e-9], [0, 3e-3], [-1, 1]]) and 0 <= z <= 1");
    let Bounds::Within(found) = *needle.bounds() else { panic!("{:?}", needle.bounds()) };
    let tip = (0..100_000).map(|k| 1000.0 + 1e-8 * (f64::from(k) - 5e4));
    let inside =
        |x: &f64| (0..7).any(|k| needle.sign(DVec3::new(*x, 1e-9 + f64::from(k - 3) * 1e-14, 0.5)) > 0.0);
    let farthest = tip.filter(inside).fold(f64::NEG_INFINITY, f64::max);
    assert!(farthest > 999.0 && farthest <= found.max.x, "{farthest} beyond {}", found.max.x);
}

#[test]
#[ignore = "long"]
fn random_bounded_solids_have_bounds_that_hold_all_their_points() {
    let mut runner = TestRunner::new(config(400));
    let result = runner.run(&bounded(), |text| {
        let solid = solid(&text);
        let over = Aabb::new(DVec3::splat(-10.0), DVec3::splat(10.0));
        let points = sampled(&solid, &over, 20_000);
        match *solid.bounds() {
            Bounds::Within(found) => {
                // again where the solid is, so that many points are near its sides
                let near = sampled(&solid, &found.grown(0.1 * found.size().max_element()), 20_000);
                for points in [points, near] {
                    prop_assert!(
                        points.is_empty() || found.union(&points) == found,
                        "{text}: {points:?}, {found:?}"
                    );
                }
            }
            Bounds::Empty => prop_assert!(points.is_empty(), "{text} is not empty"),
            Bounds::Unbounded => return Err(TestCaseError::fail(format!("{text}: no bounds"))),
        }
        Ok(())
    });
    result.unwrap();
}

#[test]
fn thousands_of_parts_are_bounded_in_milliseconds() {
    let mut numbers = Random(3);
    let kinds = ["sphere(0.1)", "cylinder(0.05, 0.2)", "box([0, 0, 0], [0.1, 0.2, 0.1])", "torus(0.1, 0.03)"];
    let parts: Vec<String> = (0..2000)
        .map(|i| {
            let [a, b] = [numbers.unit(), numbers.unit()].map(|x| 6.0 * x);
            let [x, y, z] = [numbers.unit(), numbers.unit(), numbers.unit()].map(|x| 10.0 * x);
            format!("{}.rotate_x({a}).rotate_z({b}).move([{x}, {y}, {z}])", kinds[i % 4])
        })
        .collect();
    let solid = solid(&parts.join("\n or "));
    let start = std::time::Instant::now();
    let Bounds::Within(found) = *solid.bounds() else { panic!("no bounds") };
    let time = start.elapsed();
    assert!(found.min.min_element() > -0.3 && found.max.max_element() < 10.3, "{found:?}");
    assert!(time.as_secs_f64() < 2.0, "{time:?}");
}
