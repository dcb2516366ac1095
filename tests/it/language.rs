//! What the language can say: numbers, choices, lists, maps of space, joints. Values against plain arithmetic, signs
//! against the definition.

use rfm::geom::Aabb;
use rfm::glam::{DVec2, DVec3};
use rfm::solid::Bounds;
use rfm::{Engine, Program, Solid};

fn compiled(text: &str, engine: Engine) -> Solid {
    let program = Program::from_source("t.rfm", format!("rfm 1\n{text}"));
    program.unwrap_or_else(|e| panic!("{text}: {e}")).solid_with("s", engine).unwrap()
}

fn solid(definition: &str) -> Solid {
    compiled(&format!("solid s = {definition}"), Engine::Auto)
}

fn value(expression: &str, p: [f64; 3]) -> f64 {
    compiled(&format!("solid s = {expression}"), Engine::Interpreter).omega(DVec3::from_array(p))
}

/// Places in a box, spread evenly but in no pattern.
fn places(count: u32, over: Aabb) -> impl Iterator<Item = DVec3> {
    (1..=count).map(move |i| {
        let at = DVec3::new(0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3);
        over.min + over.size() * (at * f64::from(i)).fract()
    })
}

fn cube(half: f64) -> Aabb {
    Aabb::new(DVec3::splat(-half), DVec3::splat(half))
}

/// Two descriptions have the same sign wherever neither is about zero.
#[track_caller]
fn same_sign(a: &str, b: &str, over: Aabb) {
    let (first, second) = (solid(a), solid(b));
    let mut inside = 0;
    for p in places(20_000, over) {
        let (u, v) = (first.omega(p), second.omega(p));
        inside += u32::from(v > 0.0);
        assert!(u.abs() < 1e-9 || v.abs() < 1e-9 || (u > 0.0) == (v > 0.0), "{a} at {p}: {u}; {b}: {v}");
    }
    assert!(inside > 20, "{b}: {inside} of 20 000 places");
}

#[test]
fn numbers_of_steps_and_functions() {
    for (expression, expected) in [
        ("floor(-0.5)", -1.0),
        ("floor(2)", 2.0),
        ("ceil(1.2) + ceil(-1.2)", 1.0),
        ("round(2.5) + 10*round(3.5)", 42.0),
        ("round(0.49999999999999994)", 0.0),
        ("fract(-0.25)", 0.75),
        ("mod(-1, 3) + 10*mod(7, 3)", 12.0),
        ("mod(7, -3)", -2.0),
        ("log10(1000)", 3.0),
        ("log2(1024)", 10.0),
        ("sinh(0) + cosh(0) + tanh(0)", 1.0),
        ("step(1, 0.5) + 2*step(1, 1)", 2.0),
        ("where(3 >= 2, 1, 1/0)", 1.0),
        ("where(2 == 3 or 1 != 1, 1, 2)", 2.0),
        ("if 2 == 3 then 1/0 else if not 1 != 1 then 2 else 3", 2.0),
        ("if 1 > 0 then 4 else 5 + 6", 4.0),
        ("if (if 1 > 0 then 2 == 2 else 2 == 3) then 7 else 8", 7.0),
        ("(if 0 > 1 then 4 else 5) + 6", 11.0),
        ("sum i in 1..5: i^2", 30.0),
        ("product i in 1..6: i", 120.0),
        ("sum i in 3..3: i", 0.0),
        ("product i in 3..3: i", 1.0),
        ("min i in 0..5: (i - 2)^2 + 1", 1.0),
        ("max p in [[1, 2], [3, 4]]: p.x*p.y", 12.0),
        ("sum e in [1, 2, 4]: e", 7.0),
        ("(sum p in [[1, 2, 3], [4, 5, 6]]: p).y", 7.0),
        ("[5, 6, 7, 8][2] + [5, 6, 7][0]", 12.0),
        ("([[1, 2], [3, 4]][1]*2 + [1, 1]).y", 9.0),
        ("count([[1, 2], [3, 4]]) + count([1, 2, 3])", 5.0),
        ("(list i in 0..4: i^2)[3]", 9.0),
        ("(list i in 1..4: i).y", 2.0),
        ("(list i in 0..2: list j in 0..3: [i, j])[1][2].y", 2.0),
        ("sum p in (list p in [[1, 2], [3, 4]]: 2*p): p.x*p.y", 56.0),
        ("count(list i in 3..3: i)", 0.0),
    ] {
        assert_eq!(value(&format!("({expression}) + 0*x"), [0.0; 3]), expected, "{expression}");
    }
    for (expression, expected) in
        [("sinh(x)", 0.7f64.sinh()), ("cosh(x)", 0.7f64.cosh()), ("tanh(x)", 0.7f64.tanh())]
    {
        assert!((value(expression, [0.7, 0.0, 0.0]) - expected).abs() < 1e-15, "{expression}");
    }
}

#[test]
fn choices_are_written_in_two_ways() {
    for (choice, call) in [
        ("if x >= 0 then sphere(1) else box()", "where(x >= 0, sphere(1), box())"),
        (
            "box() and if x >= 0 and y <= 1 then z <= x or z <= y else z <= 0.5",
            "box() and where(x >= 0 and y <= 1, z <= x or z <= y, z <= 0.5)",
        ),
        ("sphere(if 2 >= 1 then 0.5 else 2)", "sphere(where(2 >= 1, 0.5, 2))"),
        ("sphere(1).move(if 1 > 2 then [1, 0, 0] else [0, 1, 0])", "sphere(1).move([0, 1, 0])"),
    ] {
        let [choice, call] = [choice, call].map(solid);
        for point in [[0.3, -0.2, 0.1], [-0.7, 0.4, 0.9], [1.2, 0.1, -0.5]] {
            let p = DVec3::from_array(point);
            assert_eq!(choice.omega_grad(p), call.omega_grad(p));
        }
    }
}

#[test]
fn a_list_that_is_made_by_a_fold_is_the_list_that_is_written() {
    for (fold, written) in [
        (
            "sweep(list i in 0..4: [i, i^2, 0], 0.2)",
            "sweep([[0, 0, 0], [1, 1, 0], [2, 4, 0], [3, 9, 0]], 0.2)",
        ),
        (
            "any p in (list i in 0..2: [i, 0, 1]): sphere(1, p)",
            "sphere(1, [0, 0, 1]) or sphere(1, [1, 0, 1])",
        ),
        // the word is a name where no fold begins
        ("any list in [2]: sphere(list)", "sphere(2)"),
    ] {
        let [fold, written] = [fold, written].map(solid);
        for point in [[0.3, -0.2, 0.1], [1.7, 3.4, 0.1], [1.2, 0.1, -0.5]] {
            let p = DVec3::from_array(point);
            assert_eq!(fold.omega_grad(p), written.omega_grad(p));
        }
    }
    let named = Program::from_source(
        "t.rfm",
        "rfm 1\nlet list = [1, 2]\nsolid s = sphere(list[1] + (sum e in list: e))\n",
    );
    assert_eq!(named.unwrap().solid("s").unwrap().omega(DVec3::ZERO), 2.5);
}

#[test]
fn a_closed_path_of_computed_points_is_closed_but_for_rounding() {
    let closed = solid("sweep(spline(list i in 0..13: [cos(i*30°), sin(i*30°), 0]), 0.1)");
    let exact = solid("torus(1, 0.1)");
    // an open spline has no bend at its ends
    for degrees in [-15.0_f64, 0.0, 15.0, 100.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let p = DVec3::new(1.05 * cos, 1.05 * sin, 0.0);
        let off = closed.omega(p) - exact.omega(p);
        assert!(off.abs() < 2e-3, "{degrees}: {off}");
    }
}

#[test]
fn names_in_what_is_left_out_are_used() {
    let text = "rfm 1\nparam wide = 1\nlet r = 2\nlet height = 3\nlet unused = 3\nfn tall(shape) = shape.scale(height)\n\
                solid s = if wide == 1 then sphere(1) else sphere(r).tall()\n";
    let warnings = Program::from_source("t.rfm", text).unwrap().warnings();
    let found: Vec<&str> = warnings.list.iter().map(|d| d.message.as_str()).collect();
    assert_eq!(found, ["the name `unused` is never used"]);
}

#[test]
fn a_choice_does_not_look_at_what_is_left_out() {
    let chosen = solid("where(x >= 0, sqrt(x), -1 - x^2)");
    assert_eq!(chosen.omega_grad(DVec3::new(0.25, 0.0, 0.0)), (0.5, DVec3::X));
    assert_eq!(chosen.omega_grad(DVec3::new(-2.0, 0.0, 0.0)), (-5.0, 4.0 * DVec3::X));
    let left = chosen.range(&Aabb::new(DVec3::new(-2.0, 0.0, 0.0), DVec3::new(-1.0, 1.0, 1.0)));
    assert!(left.lo > -5.1 && left.hi < -1.9, "{left:?}");
    let right = chosen.range(&Aabb::new(DVec3::new(1.0, 0.0, 0.0), DVec3::new(4.0, 1.0, 1.0)));
    assert!(right.lo > 0.9 && right.hi < 2.1, "{right:?}");
}

#[test]
fn random_numbers_are_even_and_the_same_everywhere() {
    let text = "solid s = (sum i in 0..4000: random(1, i)) + x";
    let mean = compiled(text, Engine::Interpreter).omega(DVec3::ZERO) / 4000.0;
    assert!((mean - 0.5).abs() < 0.02, "{mean}");
    assert_eq!(value("random(1, 2) + 0*x", [0.0; 3]), 0.234_364_617_758_881_84);
    assert_ne!(value("random(1, 2) + 0*x", [0.0; 3]), value("random(2, 2) + 0*x", [0.0; 3]));
}

#[test]
fn lists_hold_places_and_sizes() {
    same_sign(
        "any p in [[1, 0, 0], [0, 1, 0], [0, 0, 1]]: ball(p, 0.6)",
        "ball([1, 0, 0], 0.6) or ball([0, 1, 0], 0.6) or ball([0, 0, 1], 0.6)",
        cube(2.0),
    );
    let text = "let spots = [[0, 0.5], [1, 0.25], [2, 0.75]]\n\
                solid s = any i in 0..count(spots): ball([spots[i].x, 0, 0], spots[i].y)";
    let found = compiled(text, Engine::Auto);
    for (x, radius) in [(0.0, 0.5), (1.0, 0.25), (2.0, 0.75)] {
        assert!(found.omega(DVec3::new(x, 0.99 * radius, 0.0)) > 0.0);
        assert!(found.omega(DVec3::new(x, 0.0, 1.01 * radius)) < 0.0 || x == 1.0);
    }
}

#[test]
fn maps_are_their_substitution() {
    let p = [0.3, -0.7, 0.9];
    let at = |q: [f64; 3]| value("ellipsoid(1, 2, 3)", q);
    assert_eq!(value("ellipsoid(1, 2, 3).at([y, z*2, x])", p), at([-0.7, 1.8, 0.3]));
    assert_eq!(value("ellipsoid(1, 2, 3).revolve()", p), at([0.3f64.hypot(0.7), 0.9, 0.0]));
    same_sign("box().rotate([0, 0, 1], 90°, [1, 0, 0])", "box([0, -1, 0], [1, 0, 1])", cube(2.5));
    same_sign("box().mirror([1, 0, 0], [1, 0, 0])", "box([1, 0, 0], [2, 1, 1])", cube(2.5));
    same_sign("box().mirror([1, 0, 0])", "box([-1, 0, 0], [0, 1, 1])", cube(2.5));
    // a whole turn in each unit of length: at half of it everything is turned by half a turn
    let twisted = solid("box([0, -0.1, 0], [1, 0.1, 1]).twist(1)");
    for (z, x, y) in [(0.01, 0.7, 0.05), (0.25, 0.0, 0.7), (0.5, -0.7, 0.0), (0.75, 0.0, -0.7)] {
        assert!(twisted.omega(DVec3::new(x, y, z)) > 0.0, "{z}");
        assert!(twisted.omega(DVec3::new(-x, -y, z)) < 0.0, "{z}");
    }
    let tapered = solid("box([-1, -1, 0], [1, 1, 2]).taper(2, 0.5)");
    assert!(
        tapered.omega(DVec3::new(0.74, 0.0, 1.0)) > 0.0 && tapered.omega(DVec3::new(0.76, 0.0, 1.0)) < 0.0
    );
    // a quarter of a circle of radius 2/π·1
    let bent = solid("box([0, -0.1, -0.1], [1, 0.1, 0.1]).bend(2/pi)");
    let radius = std::f64::consts::FRAC_2_PI;
    assert!(bent.omega(DVec3::new(radius + 0.09, 0.0, radius - 0.01)) > 0.0);
    assert!(bent.omega(DVec3::new(radius + 0.09, 0.0, radius + 0.01)) < 0.0);
}

#[test]
fn bounds_of_mapped_shapes_are_found() {
    for (definition, min, max) in [
        ("box([-1, -0.2, 0], [1, 0.2, 3]).twist(0.5)", [-1.02, -1.02, 0.0], [1.02, 1.02, 3.0]),
        ("sphere(0.3).repeat([1, 2, 3], [10, 20, 5])", [-0.3, -0.3, -0.3], [9.3, 38.3, 12.3]),
        ("box([0, 0, 0], [2, 1, 1]).repeat([-1, 1, 1], [3, 1, 1])", [-2.0, 0.0, 0.0], [2.0, 1.0, 1.0]),
        ("box([-1, -0.1, -0.1], [1, 0.1, 0.1]).bend(1)", [-0.93, -0.1, -0.1], [0.93, 0.1, 0.6]),
        ("box([-1, -1, 0], [1, 1, 2]).taper(2, 0.5)", [-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]),
        ("sphere(0.2).move([1, 0, 0]).polar_repeat(5)", [-1.1, -1.2, -0.2], [1.2, 1.2, 0.2]),
        ("polygon([[1, 0], [2, 0], [1.5, 1]]).revolve()", [-2.0, -2.0, 0.0], [2.0, 2.0, 1.0]),
        ("smooth_or(sphere(1), sphere(1).move([1, 0, 0]), 0.3)", [-1.1, -1.1, -1.1], [2.1, 1.1, 1.1]),
        ("blend(sphere(1), box([0, 0, 0], [2, 1, 1]), 0.3)", [-1.1, -1.1, -1.1], [2.1, 1.1, 1.1]),
        ("box().shell(0.1)", [0.0; 3], [1.0; 3]),
        ("where(x <= 0, sphere(1), sphere(0.5))", [-1.0, -1.0, -1.0], [0.5, 1.0, 1.0]),
        ("where(z >= 0, hypot(x, y, z) <= 1, hypot(x, y) <= 1) and z >= -2", [-1.0, -1.0, -2.0], [1.0; 3]),
    ] {
        let found = solid(definition);
        let Bounds::Within(bounds) = *found.bounds() else { panic!("{definition}: {:?}", found.bounds()) };
        let allowed = Aabb::new(DVec3::from_array(min), DVec3::from_array(max)).grown(0.02);
        assert!(allowed.union(&bounds) == allowed, "{definition}: {bounds:?}");
        for p in places(20_000, allowed.grown(0.5)) {
            assert!(found.omega(p) <= 0.0 || bounds.contains(p), "{definition}: {p} is outside {bounds:?}");
        }
    }
}

/// Whether copies are looked at one by one, or joined because they may reach into other cells: the sign is that of
/// all copies.
#[test]
fn copies_are_whole_whatever_their_size() {
    for (shape, step, counts) in [
        ("sphere(0.4)", "[1, 1, 1]", [3, 2, 2]),
        ("sphere(0.7)", "[1, 1, 1]", [3, 2, 2]),
        ("box([0, 0, 0], [1, 1, 1])", "[1, 1, 1]", [2, 2, 2]),
        ("sphere(0.4).move([5, 0, 0.3])", "[1, -1.5, 1]", [4, 2, 1]),
        ("box([-0.4, -0.1, 0], [0.4, 0.1, 1]).twist(0.3)", "[0.6, 1, 1]", [3, 1, 2]),
        ("(x + y <= 1 and x >= 0 and y >= 0 and 0 <= z <= 1)", "[1, 1, 1]", [2, 3, 1]),
    ] {
        let step_of = |axis: &str| format!("({step}.{axis})");
        let [a, b, c] = counts;
        let all = format!(
            "any i in 0..{a}*{b}*{c}: {shape}.move([mod(i, {a})*{}, mod(floor(i/{a}), {b})*{}, floor(i/({a}*{b}))*{}])",
            step_of("x"),
            step_of("y"),
            step_of("z")
        );
        let over = Aabb::new(DVec3::new(-2.0, -3.0, -1.5), DVec3::new(8.0, 4.0, 3.0));
        same_sign(&format!("{shape}.repeat({step}, [{a}, {b}, {c}])"), &all, over);
    }
}

#[test]
fn joints_differ_from_the_plain_ones_near_the_edge_only() {
    let (a, b) = ("(-x)", "(-y)"); // material below zero: a step whose inner edge is at the origin
    let inside = |definition: &str, x: f64, y: f64| solid(definition).omega(DVec3::new(x, y, 0.0)) > 0.0;
    // the fillet of radius 1 ends where the arc around [1, 1] does
    let fillet = format!("blend({a}, {b}, 1)");
    for (x, y, expected) in [(0.29, 0.29, true), (0.30, 0.30, false), (1.01, 0.01, false), (0.99, 1e-5, true)]
    {
        assert_eq!(inside(&fillet, x, y), expected, "{x} {y}");
    }
    let chamfer = format!("chamfer({a}, {b}, 1)");
    for (x, y, expected) in [(0.49, 0.5, true), (0.51, 0.5, false), (1.01, 0.01, false)] {
        assert_eq!(inside(&chamfer, x, y), expected, "{x} {y}");
    }
    for (joint, plain) in [
        ("smooth_or(sphere(1), box([0, 0, 0], [1, 1, 1]), 1e-9)", "sphere(1) or box([0, 0, 0], [1, 1, 1])"),
        ("smooth_and(sphere(1), box([0, 0, 0], [1, 1, 1]), 1e-9)", "sphere(1) and box([0, 0, 0], [1, 1, 1])"),
        (
            "smooth_without(sphere(1), box([0, 0, 0], [1, 1, 1]), 1e-9)",
            "sphere(1) \\ box([0, 0, 0], [1, 1, 1])",
        ),
    ] {
        same_sign(joint, plain, cube(1.5));
    }
}

/// The legs of a chamfer, and the ends of the arc of a fillet, on a post that stands on a plate, along both.
#[test]
fn the_width_of_a_joint_is_a_length() {
    let (post, plate) = ("cylinder(0.3, 1).move([0, 0, -0.5])", "box([-1, -1, -1], [1, 1, 0])");
    for r in [0.02, 0.1, 0.2] {
        // in planes through the axis the surfaces are straight and at a right angle
        let arc = |s: f64| r - (r * r - (r - s).powi(2)).sqrt();
        for (joint, known) in
            [("chamfer", &(|s: f64| r - s) as &dyn Fn(f64) -> f64), ("blend", &arc as &dyn Fn(f64) -> f64)]
        {
            for [a, b] in [[post, plate], [plate, post]] {
                let joined = solid(&format!("{joint}({a}, {b}, {r})"));
                for s in [1e-6, 0.3 * r, 0.8 * r] {
                    let (along_plate, along_post) =
                        (DVec3::new(0.29, 0.0, s), DVec3::new(0.3 + s, 0.0, -0.01));
                    let legs = [
                        end_of(&joined, along_plate, DVec3::X, 0.5) - 0.01,
                        end_of(&joined, along_post, DVec3::Z, 0.4) - 0.01,
                    ];
                    for leg in legs {
                        assert!(
                            (leg - known(s)).abs() <= 1e-9,
                            "{joint} {r} at {s}: {leg}, not {}",
                            known(s)
                        );
                    }
                }
                // beyond the joint nothing changes
                let plain = solid(&format!("{a} or {b}"));
                for p in places(5000, cube(1.2)) {
                    let is_at_joint = p.z >= 0.0 && p.truncate().length() < 0.3 + r && p.z < r;
                    assert!(
                        is_at_joint || (joined.omega(p) > 0.0) == (plain.omega(p) > 0.0),
                        "{joint} {r}: {p}"
                    );
                }
            }
        }
    }
}

/// Distances from a torus are known, and their bounds are found, so those of joints are.
#[test]
fn joints_with_a_torus_have_bounds() {
    for definition in [
        "torus(1, 0.2).distance()",
        "torus(1, 0.2).round(0.05)",
        "blend(torus(1, 0.2), cylinder(0.1, 1), 0.1)",
    ] {
        let Bounds::Within(bounds) = *solid(definition).bounds() else { panic!("{definition}") };
        assert!(cube(1.25).union(&bounds) == cube(1.25), "{definition}: {bounds:?}");
    }
    let ring = solid("torus(1, 0.2).rotate_x(30°).scale(2).distance()");
    for p in places(2000, cube(3.0)) {
        let turned = DVec2::from_angle(-30_f64.to_radians()).rotate(DVec2::new(p.y, p.z));
        let expected = 0.4 - (p.x.hypot(turned.x) - 2.0).hypot(turned.y);
        assert!((ring.omega(p) - expected).abs() < 1e-12, "{p}");
    }
}

/// Where a ray from inside leaves a solid, within a length at which it is outside.
fn end_of(solid: &Solid, from: DVec3, way: DVec3, within: f64) -> f64 {
    let (mut inside, mut outside) = (0.0, within);
    assert!(solid.omega(from) > 0.0, "{from} is not inside");
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if solid.omega(from + middle * way) > 0.0 { inside = middle } else { outside = middle }
    }
    inside
}

#[test]
fn offsets_move_faces_by_the_distance() {
    // the plain shape, a place inside, and how far its surface is in some directions
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let centre = DVec3::new(0.5, 1.0, 1.5);
    let turned = DVec3::new(0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0);
    for (shape, from, ends) in [
        ("sphere(2)", DVec3::ZERO, vec![(x, 2.0), (-y, 2.0), (turned, 2.0)]),
        ("box([0, 0, 0], [1, 2, 3])", centre, vec![(x, 0.5), (-y, 1.0), (z, 1.5)]),
        ("box([-1, -1, -1], [1, 1, 1]).rotate_z(45°)", DVec3::ZERO, vec![(turned, 1.0), (z, 1.0)]),
        (
            "(box([-1, -1, -1], [1, 1, 1]) \\ cylinder(0.4, 4).move([0, 0, -2]))",
            0.7 * x,
            vec![(x, 0.3), (-x, 0.3)],
        ),
        ("cone(1, 1)", 0.2 * z, vec![((x + z).normalize(), 0.8 * 0.5_f64.sqrt()), (-z, 0.2)]),
        ("(half_space() or z <= 2)", DVec3::ZERO, vec![(z, 2.0)]),
        (
            "polygon([[0, 0], [2, 0], [2, 2], [1, 1], [0, 2]]).extrude(0, 1)",
            turned,
            vec![(y, 1.0), (-z, 0.5)],
        ),
    ] {
        let from = if shape.starts_with("polygon") { DVec3::new(0.5, 0.4, 0.5) } else { from };
        for d in [0.1, -0.1] {
            let moved = solid(&format!("{shape}.offset({d})"));
            for &(way, end) in &ends {
                // the upper edges of the polygon are at 45° above the middle of its lower one
                let expected = match shape.starts_with("polygon") && way == y {
                    true => 1.5 - 0.4 + 2_f64.sqrt() * d,
                    false => end + d,
                };
                let found = end_of(&moved, from, way, expected + 0.3);
                assert!(
                    (found - expected).abs() < 1e-12,
                    "{shape}, {d}, {way}: {found}, expected {expected}"
                );
            }
        }
    }
}

#[test]
fn shells_are_as_thick_as_they_say() {
    for (shape, inner) in [
        ("sphere(2)", "sphere(1.9)"),
        ("box([0, 0, 0], [1, 2, 3])", "box([0.1, 0.1, 0.1], [0.9, 1.9, 2.9])"),
        ("(cylinder(1, 2) and z <= 1)", "cylinder(0.9, 0.8).move([0, 0, 0.1])"),
    ] {
        same_sign(&format!("{shape}.shell(0.1)"), &format!("{shape} \\ {inner}"), cube(3.0));
    }
}

/// An offset by a length that depends on the place, of a formula without a known distance: right to first order.
#[test]
fn offsets_of_other_formulas_are_of_first_order() {
    let bulge = solid("ellipsoid(1, 0.5, 0.5).offset(0.02 + 0.01*sin(z))");
    // ω = (1 − 4y²)/4 + 0.02·2y
    let expected = 0.02 + 0.2504_f64.sqrt();
    assert!((end_of(&bulge, DVec3::ZERO, DVec3::Y, 1.0) - expected).abs() < 1e-12);
}

#[test]
fn lofts_lead_straight_from_edge_to_edge() {
    let square = |half: f64| {
        format!("polygon([[-{half}, -{half}], [{half}, -{half}], [{half}, {half}], [-{half}, {half}]])")
    };
    let loft = format!("{}.loft({}, 0, 1)", square(0.5), square(0.25));
    let pyramid = "(abs(x) <= 0.5 - z/4 and abs(y) <= 0.5 - z/4 and 0 <= z <= 1)";
    same_sign(&loft, pyramid, cube(1.2));
    let cone = "(x^2 + y^2 <= (1 - z/2)^2 and 0 <= z <= 1)";
    same_sign("(x^2 + y^2 <= 1).loft(sqrt(x^2 + y^2) <= 0.5, 0, 1)", cone, cube(1.2));
}

#[test]
fn functions_of_a_shape_are_methods() {
    let text = "fn twin(shape, by) = shape or shape.move([by, 0, 0])\nsolid s = sphere(1).twin(by = 2)";
    let (found, plain) = (compiled(text, Engine::Auto), solid("sphere(1) or sphere(1).move([2, 0, 0])"));
    for p in places(1000, cube(3.0)) {
        assert_eq!(found.omega(p), plain.omega(p));
    }
}

#[test]
fn machine_code_is_the_interpreter_in_every_program() {
    for definition in [
        "box([-0.4, -0.1, 0], [0.4, 0.1, 1]).twist(0.3)",
        "sphere(0.4).repeat([1, 1, 1], [3, 2, 2])",
        "where(x >= 0.2, sphere(1), box() or y <= -1)",
        "tanh(x) + sinh(y)*cosh(z) - log2(1.5 + z^2) + log10(2 + y^2) and round(3*x) <= 2 or fract(y) >= 0.3",
        "blend(box(), sphere(0.7), 0.2) and mod(x, 0.4) <= 0.3",
        "polygon([[0, 0], [2, 0], [2, 2], [1, 1], [0, 2]]).extrude(0, 1).shell(0.1)",
        "polygon([[0, 0], arc([1, 0], 1, -90°, 90°), spline([[1, 1], [0.4, 0.5], [0, 1]])]).revolve()",
        "polygon([[-1, -1], [1, -1], [0, 1]]).loft(polygon(arc([0, 0], 0.7, 0°, 360°, 0.02)), -1, 1)",
        "sweep([[0, 0, 0], [1, 0, 0], arc([1, 0, 0], [1.5, 0.2, 0.3], [1, 1, 0])], 0.2) \\ sphere(0.3)",
    ] {
        let text = format!("solid s = {definition}");
        let (jit, interpreter) = (compiled(&text, Engine::Jit), compiled(&text, Engine::Interpreter));
        for p in places(500, cube(2.0)) {
            assert_eq!(jit.omega_grad(p), interpreter.omega_grad(p), "{definition} at {p}");
            assert_eq!(jit.contact(p), interpreter.contact(p), "{definition} at {p}");
            assert_eq!(jit.sign(p), interpreter.sign(p), "{definition} at {p}");
            let (a, b) = (jit.omega_grad_f32(p.as_vec3()), interpreter.omega_grad_f32(p.as_vec3()));
            assert_eq!(a, b, "{definition} at {p} in f32");
        }
        let corners: Vec<DVec3> = places(300, cube(2.0)).collect();
        for pair in corners.chunks(2) {
            let over = Aabb::new(pair[0].min(pair[1]), pair[0].max(pair[1]));
            for solid in [&jit, &interpreter] {
                let range = solid.range(&over);
                for p in places(20, over) {
                    let omega = solid.omega(p);
                    assert!(
                        range.contains(omega) || omega.is_nan(),
                        "{definition}: {omega} not in {range:?}"
                    );
                }
            }
        }
    }
}
