//! Syntax that is half remembered: what the messages suggest is the call, the range or the joint that was meant.

use super::{alone, messages, program, read, told};

const TEXTS: &[&str] = &[
    "solid s = smooth_min(sphere(1), box(), 0.1)",
    "solid s = smax(sphere(1), box(), 0.1)",
    "solid s = soft_min(sphere(1), box())",
    "solid s = opSmoothUnion(sphere(1), box(), 0.2)",
    "solid s = opSmoothIntersection(sphere(1), box(), 0.2)",
    "solid s = opSmoothSubtraction(sphere(1), box(), 0.2)",
    "solid s = opSubtraction(sphere(0.5), box())",
    "solid s = opUnion(sphere(1), box(), 0.1)",
    "solid s = intersection(sphere(1), box(), 0.1)",
    "solid s = difference(sphere(1), box(), 0.1)",
    "solid s = any k in 0..5 step 2: sphere(0.1).move([k, 0, 0])",
    "solid s = any k in 1..4 by 0.5: ball([k, k^2, 0], 0.3)",
    "solid s = any k in 5..0 step -1: ball([k, 0, 0], 0.3)",
    "param n = 6\nsolid s = any k in 0..n step 2: sphere(0.1).move([k, 0, 0])",
    "solid s = x^2 + y^2 + z^2 <= r^2 where r = 2",
    "solid s = (sphere(1) ^ sphere(2)) and box()",
    "param r = 1 in [0.5, 2]\nsolid s = sphere(r)",
    "param r = 10 mm in (5, 20) \"radius\"\nsolid s = sphere(r)",
    "param r: 1 mm .. 5 mm\nsolid s = sphere(r)",
    "param r: 2\nsolid s = sphere(r)",
    "solid s = sphr(2)",
    "solid s = sphere(0.1).repeat(2, 3)",
    "solid s = sphere(1).shell(-0.1)",
    "solid s = sphere(1).shell(-2 mm)",
    "solid s = box(center=[0, 0, 0], size=[1, 1, 1])",
    "solid s = box(center=[1, 2, 3], size=2)",
    "solid s = box(size=[1 cm, 2 cm, 3 cm], center=true)",
    "solid s = [sphere(1), sphere(2) and box()]",
    "let k = sum(i, 0..5, i)\nsolid s = sphere(k)",
    "solid s = any(i, 0..5, ball([i, 0, 0], 0.3))",
    "solid s = sqrt(x² + y²) ≤ 1 ∧ z ∈ [0, 1]",
    "solid s = sphere(1) and z in [0, 1]",
    "solid s = sphere(1) and z in 0..1",
    "solid s = atan(y, x) <= 1 and sphere(1)",
    "solid s = cylinder(h=2, r1=1, r2=0.5)",
    "solid s = cylinder(h=3, d1=2 mm, d2=1 mm)",
    "solid s = cylinder(h=3, r1=0, r2=1)",
    "solid s = cylinder(h=3, r1=1, r2=0)",
    // what was not understood in full leads to no text of its own
    "solid s = box([1, 2, 3], center=true)",
    "solid s = box(2, center=true)",
    "solid s = box(1, 2, 3, center=true)",
    "solid s = box(min=[1, 1, 1], size=[2, 2, 2])",
    "let d = [1, 2, 3]\nsolid s = box(size=d, center=true)",
    "solid s = cylinder(h=2, r1=1, r2=0.5, center=true)",
    "solid s = cylinder(h=2 cm, r1=0, r2=1 cm, center=true)",
    "solid s = cylinder(h=2, r1=1, r2=0.5, segments=32)",
    "solid s = cylinder(h=3 mm, r1=0 mm, r2=1 mm)",
    "solid s = cylinder(h=3 mm, r1=1 mm, r2=0 mm)",
    "solid s = sphere(1).shell(-0.1 - 0.2)",
    "solid s = sphere(1).shell(0/0)",
    "solid s = if z in [0, 1] then sphere(1) else box()",
    "solid s = sphere(3) and z in [min(0, 1), 2]",
    "param r = 2 in [max(1, 2), 3]\nsolid s = sphere(r)",
    "param r = 2 [max(1, 2), 3]\nsolid s = sphere(r)",
    "param r = 2 in [1, 2, 3]\nsolid s = sphere(r)",
    "solid s: x^2 <= 1",
    "solid s: sphere(r=2)",
    "param r: float = 1\nsolid s = sphere(r)",
    "param r: float\nsolid s = sphere(r)",
    "let i = 1\nparam r = 2 * i in [0.5, 2]\nsolid s = sphere(r)",
    "solid s = any r in 0..5 step 2: sphere(r=0.1).move([r, 0, 0])",
    "solid s = any(sphere(0.3).move([i, 0, 0]) for i in range(3))",
    "solid s = any(sphere(0.3).move([i, 0, 0]) for i in range(1, 3))",
    "solid s = sweep([[i, i^2, 0] for i in range(5)], 0.1)",
    "solid s = sweep([for (i = [0:4]) [i, i^2, 0]], 0.1)",
    "let p = [any i in 0..60: [sin(i), cos(i), 0]]\nsolid s = sweep(p, 0.1)",
    "let p = max q in [[1, 2], [3, 4]]: q\nsolid s = sphere(p[0])",
    "solid s = list i in 0..4: sphere(0.3).move([i, 0, 0])",
    "solid s = sphere(1) or (list i in 0..4: sphere(0.3).move([i, 0, 0]))",
    "solid s = sweep(list i in 0..4: \"a\", 0.1)",
    "fn f(r) =\n  let q = r*2\n  sphere(q)\nsolid s = f(1)",
    "fn f(r) =\n  let q = r*2\n  let p = 2\n  sphere(q)\nsolid s = f(1)",
    "solid s = box().rotate_z(3 s)",
    "solid s = box().rotate_z(-30 rpm)",
    "solid s = box().rotate_z(2 Hz)",
    "solid s = polygon(arc([0, 0], 1, 0, 3 s)).extrude(0, 1)",
    "solid s = polygon(arc([0, 0], 1, 0, 90)).extrude(0, 1)",
    "solid s = sphere(1/0)",
    "solid s = sphere(sqrt(-1))",
    "solid s = box().rotate_z(45 deg + 45)",
    "param angle = 45 deg\nsolid s = box().rotate_z(angle - 30)",
    "let a = sphere(1)\nsolid s = a + [1, 0, 0]",
    "solid s = cylinder([0, 0, 0], [0, 0, 1], 0.2)",
    "solid s = cylinder(1, 2, 3)",
    "solid s = cylinder(2, r = 1)",
    "fn f(n) = n*f(n - 1)\nsolid s = sphere(f(3))",
    "solid s = sin^2(x) + y^2 + z^2 <= 1 and box()",
    "solid s = sphere(1) and atan2(y, x) <= 45",
];

#[test]
fn syntax_that_is_half_remembered() {
    read("half_remembered", alone(TEXTS));
}

/// Each mistake with its first suggestion in its place.
#[test]
fn what_is_suggested_makes_the_solid_that_was_meant() {
    for (text, wrong, expected) in [
        (
            "solid s = opSubtraction(sphere(0.5), box())",
            "opSubtraction(sphere(0.5), box())",
            "box() \\ sphere(0.5)",
        ),
        (
            "solid s = any k in 1..4 by 0.5: ball([k, k^2, 0], 0.3)",
            "any k in 1..4 by 0.5: ball([k, k^2, 0], 0.3)",
            "any k in 0..6: ball([1 + 0.5*k, (1 + 0.5*k)^2, 0], 0.3)",
        ),
        (
            "solid s = any k in 5..0 step -1: ball([k, 0, 0], 0.3)",
            "any k in 5..0 step -1: ball([k, 0, 0], 0.3)",
            "any k in 0..5: ball([5 - k, 0, 0], 0.3)",
        ),
        (
            "solid s = box(center=[1, 2, 3], size=2)",
            "box(center=[1, 2, 3], size=2)",
            "box([0, 1, 2], [2, 3, 4])",
        ),
        (
            "solid s = box(size=[1 cm, 2 cm, 3 cm], center=true)",
            "box(size=[1 cm, 2 cm, 3 cm], center=true)",
            "box([-0.5 cm, -1 cm, -1.5 cm], [0.5 cm, 1 cm, 1.5 cm])",
        ),
        (
            "solid s = cylinder(h=3, r1=0, r2=1)",
            "cylinder(h=3, r1=0, r2=1)",
            "cone(1, 3).mirror([0, 0, 1]).move([0, 0, 3])",
        ),
        (
            "let c = [1, 2, 3]\nlet d = [1, 1, 1]\nsolid s = box(center=c, size=d)",
            "box(center=c, size=d)",
            "box(c - d/2, c + d/2)",
        ),
        (
            "solid s = sweep([[i, i^2, 0] for i in range(5)], 0.1)",
            "[[i, i^2, 0] for i in range(5)]",
            "list i in 0..5: [i, i^2, 0]",
        ),
        (
            "solid s = sweep([for (i = [0:4]) [i, i^2, 0]], 0.1)",
            "[for (i = [0:4]) [i, i^2, 0]]",
            "list i in 0..5: [i, (i)^2, 0]",
        ),
        (
            "let p = (any i in 0..60: [sin(i), cos(i), 0])\nsolid s = sweep(p, 0.1)",
            "any i in 0..60: [sin(i), cos(i), 0]",
            "list i in 0..60: [sin(i), cos(i), 0]",
        ),
        (
            "solid s = list i in 0..4: sphere(0.3).move([i, 0, 0])",
            "list i in 0..4: sphere(0.3).move([i, 0, 0])",
            "any i in 0..4: sphere(0.3).move([i, 0, 0])",
        ),
        (
            "solid s = cylinder([0, 0, 0], [0, 0, 1], 0.2)",
            "cylinder([0, 0, 0], [0, 0, 1], 0.2)",
            "sweep([[0, 0, 0], [0, 0, 1]], 0.2)",
        ),
        ("solid s = polygon(arc([0, 0], 1, 0, 90)).extrude(0, 1)", "90", "90 deg"),
        (
            "fn f(r) =\n  let q = r*2\n  sphere(q)\nsolid s = f(1)",
            "fn f(r) =\n  let q = r*2\n  sphere(q)",
            "fn f(r) = sphere(r*2)",
        ),
        ("let parts = [sphere(1), box()]\nsolid s = parts", "parts", "any part in parts: part"),
        (
            "param n = 6\nsolid s = any k in 1..n step 2: ball([k, 0, 0], 0.3)",
            "any k in 1..n step 2: ball([k, 0, 0], 0.3)",
            "any k in 0..ceil((n - 1)/2): ball([1 + 2*k, 0, 0], 0.3)",
        ),
        (
            "param r: 1 mm .. 5 mm\nsolid s = sphere(r)",
            "param r: 1 mm .. 5 mm",
            "param r = 1 mm in 1 mm .. 5 mm",
        ),
        (
            "solid s = cylinder(h=3, d1=2 mm, d2=1 mm)",
            "cylinder(h=3, d1=2 mm, d2=1 mm)",
            "cylinder(1 mm, 3).taper(3, 0.5)",
        ),
    ] {
        let found = messages(text);
        let help = found.list[0].help.clone().unwrap_or_default();
        assert_eq!(told(&help)[0], expected, "{found}");
        let (before, after) = text.rsplit_once(wrong).unwrap();
        let mended = format!("{before}{expected}{after}");
        let mended = program(&mended).unwrap_or_else(|found| panic!("{mended}: {found}"));
        assert!(!mended.warnings().has_errors());
    }
    let found = messages("solid s = sphere(p) \\ sphere(q) where p = 2, q = 1").to_string();
    assert!(found.contains("write `let p = 2` and `let q = 1` above"), "{found}");
}

/// A body whose shape is written in the scene has no name of its own.
#[test]
fn a_force_on_a_shape_without_a_name() {
    let scene = |force: &str| {
        format!(
            "scene s {{\n  box {{ max: [1, 1, 1] }}\n  fluid {{ shape: ball([0.5, 0.5, 0.5], 0.2) }}\n  \
             container {{ solid: sphere(0.5).move([0.5, 0.5, 0.5]) }}\n  probe f {{ force: {force} }}\n}}"
        )
    };
    let found = messages(&scene("vessel")).to_string();
    assert!(found.contains("write `force: obstacle`, or define `solid vessel = …`"), "{found}");
    assert!(program(&scene("obstacle")).is_ok());
    // a solid that is there is not defined again
    let found = messages(&format!("solid post = sphere(0.1)\n{}", scene("post"))).to_string();
    assert!(found.contains("write `force: obstacle`, or `solid: post` in place"), "{found}");
    assert!(!found.contains("define `solid post"), "{found}");
}

/// A file is no solid, but a shape can be made of it.
#[test]
fn an_obstacle_that_is_a_file() {
    let found = messages("scene s {\n  box { max: [1, 1, 1] }\n  obstacle = \"post.stl\"\n}").to_string();
    assert!(found.contains("write `obstacle { solid: mesh(\"post.stl\") }`"), "{found}");
}

/// The fourth argument of an arc is an angle, or the tolerance of an arc through three points.
#[test]
fn an_arc_through_three_points_has_a_tolerance() {
    let told = |tolerance: &str| {
        messages(&format!("solid s = polygon(arc([0, 0], [1, 1], [2, 0], {tolerance})).extrude(0, 1)"))
            .to_string()
    };
    assert!(told("3 s").contains("a time is not a length"), "{}", told("3 s"));
    assert!(told("10 deg").contains("an angle is not a length"), "{}", told("10 deg"));
    let arc = messages("solid s = polygon(arc([0, 0], 1, 0, 3 s)).extrude(0, 1)").to_string();
    assert!(arc.contains("a time is not an angle"), "{arc}");
    let arc = messages("solid s = polygon(arc([0, 0], 1, 0, 90 deg, 3 s)).extrude(0, 1)").to_string();
    assert!(arc.contains("a time is not a length"), "{arc}");
}

/// What people who come from other tools wrote in their first files.
#[test]
fn first_files_of_new_users() {
    let scene = |inner: &str| format!("solid dam = sphere(0.2)\nscene a {{ {inner} run {{ until: 1 s }} }}");
    let (room, pool) = ("box { max: [1, 1, 1] }", "fluid water { shape: z <= 0.3 }");
    for (text, expected) in [
        (scene(&format!("{room} {pool} obstacles {{ dam }}")), "write `obstacle { solid: dam }`"),
        (scene(&format!("{room} fluid water {{ z <= 0.3 }}")), "write `fluid water { shape: z <= 0.3 }`"),
        (
            scene(&format!("{room} fluid {{ sphere(0.1) and z <= 0.3 }}")),
            "`fluid { shape: sphere(0.1) and z <= 0.3 }`",
        ),
        (scene(&format!("box [1, 1, 1] {pool}")), "write `box { max: [1, 1, 1] }`"),
        (
            scene(&format!("domain: [0, 0, 0] .. [1, 1, 1], {pool}")),
            "write `box { min: [0, 0, 0], max: [1, 1, 1] }`",
        ),
        (
            scene(&format!("box {{ max: [1, 1, 1], periodic: x }} {pool}")),
            "there are no inlets, outlets and periodic boxes",
        ),
        (format!("scene a {{ {room} {pool} run {{ steps: 100 }} }}"), "`rfm run FILE --steps 100`"),
        ("solid bunny = mesh(bunny.stl)".into(), "write `\"bunny.stl\"`"),
        ("solid a = a or sphere(1)".into(), "nothing can be made of itself"),
        ("solid s = polygon([for i in 0..5: [i, i^2]]).extrude(0, 1)".into(), "write `list i in 0..5: …`"),
        (
            "solid s = polygon([[0, 0], [1, 0], [0, 1]]).extrude(h = 1)".into(),
            "write for example `.extrude(0, 1)`",
        ),
        ("solid s = sphere(1).translate(x = 1, z = 2)".into(), "write `.move([1, 0, 2])`"),
        ("solid s = abs([x, y, z]) <= 1".into(), "take its components, `v.x`"),
    ] {
        let found = messages(&text).to_string();
        assert!(found.contains(expected), "{text}: {found}");
    }
    let found = messages("solid hex = cylinder(r = 2, h = 3, $fn = 6)").to_string();
    let (_, prism) = found.split_once("a prism with 6 sides is `").unwrap();
    let program = program(&format!("solid hex = {}", prism.split('`').next().unwrap())).unwrap();
    let hex = program.solid("hex").unwrap();
    let sign = |x: f64, y: f64| hex.sign(rfm::glam::DVec3::new(x, y, 1.5));
    // across its sides, and across its corners
    assert_eq!([sign(1.72, 0.0), sign(1.74, 0.0), sign(0.0, 1.99), sign(0.0, 2.01)], [1.0, -1.0, 1.0, -1.0]);
    // a size that is not stated as a number by name is not made up
    for sizes in ["h = 3", "r = 2", "2, 3", "r = w, h = 3"] {
        let found = messages(&format!("let w = 2\nsolid hex = cylinder({sizes}, $fn = 6)")).to_string();
        assert!(!found.contains("a prism"), "{sizes}: {found}");
    }
}
