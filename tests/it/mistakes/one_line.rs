//! Mistakes for which one line is proposed: it stands in the help, and is accepted in place of what was written.

use super::{messages, program, told};

/// A file without its first line, what is wrong in it, and what is proposed.
const PROPOSED: &[(&str, &str, &str)] = &[
    ("solid s = sphere(1).move(y=2)", ".move(y=2)", ".move([0, 2, 0])"),
    ("solid s = sphere(1).move(z=2 cm, x=-1)", ".move(z=2 cm, x=-1)", ".move([-1, 0, 2 cm])"),
    ("solid s = sphere(1).scale(x=2)", ".scale(x=2)", ".scale([2, 1, 1])"),
    ("solid s = sphere(1).mirror(z=1)", ".mirror(z=1)", ".mirror([0, 0, 1])"),
    ("solid s = 1 <= z <= 0 and sphere(1)", "1 <= z <= 0", "0 <= z <= 1"),
    ("solid s = 0 >= z >= 1 and sphere(1)", "0 >= z >= 1", "1 >= z >= 0"),
    (
        "solid s = any i in [0..6]: sphere(0.1).move([i, 0, 0])",
        "any i in [0..6]: sphere(0.1).move([i, 0, 0])",
        "any i in 0..6: sphere(0.1).move([i, 0, 0])",
    ),
    (
        "solid s = cylinder(1, 2, center=true)",
        "cylinder(1, 2, center=true)",
        "cylinder(1, 2).move([0, 0, -1])",
    ),
    (
        "solid s = cylinder(h=4 mm, r=1 mm, center=false)",
        "cylinder(h=4 mm, r=1 mm, center=false)",
        "cylinder(1 mm, 4 mm)",
    ),
    ("solid s = sin x <= y and sphere(1)", "sin x", "sin(x)"),
    ("solid s = z <= abs sin(x) and sphere(1)", "abs sin(x)", "abs(sin(x))"),
    (
        "param a = 45 deg in 0 .. 90\nsolid s = box().rotate_z(a)",
        "param a = 45 deg in 0 .. 90",
        "param a = 45 deg in 0 deg .. 90 deg",
    ),
    (
        "param d = 20 mm in 1 .. 100 \"mm\"\nsolid s = sphere(d)",
        "param d = 20 mm in 1 .. 100",
        "param d = 20 mm in 1 mm .. 100 mm",
    ),
    (
        "param d = 2 cm in 0 .. 2*5\nsolid s = sphere(d)",
        "param d = 2 cm in 0 .. 2*5",
        "param d = 2 cm in 0 cm .. 10 cm",
    ),
];

#[test]
fn what_is_proposed_is_accepted() {
    for (text, wrong, expected) in PROPOSED {
        let found = messages(text);
        let help = found.list[0].help.clone().unwrap_or_default();
        assert_eq!(told(&help).first(), Some(expected), "{found}");
        let mended = text.replacen(wrong, expected, 1);
        let mended = program(&mended).unwrap_or_else(|found| panic!("{mended}: {found}"));
        assert!(mended.warnings().list.is_empty(), "{}", mended.warnings());
    }
}

/// A quantity that no shape has leads to one that it has, and not to a name for it.
#[test]
fn quantities_of_another_kind() {
    for (text, message, help) in [
        ("solid s = sphere(3 s)", "a time is not a length", "a length such as `1`, `2 cm` or `5 mm`"),
        ("solid s = sphere(1 kg)", "a mass is not a length", "a length such as `1`, `2 cm` or `5 mm`"),
        ("solid s = sphere(-1 kg)", "a mass is not a length", "a length such as `1`, `2 cm` or `5 mm`"),
        ("solid s = sphere(1 m^2)", "is not a length", "a length such as `1`, `2 cm` or `5 mm`"),
        ("solid s = box([0, 0, 0], [1 s, 1, 1])", "a time is not a length", "a length such as"),
        ("solid s = box().move([1 s, 0, 0])", "a time is not a length", "a length such as"),
        ("solid s = mesh(\"b.stl\", 1 kg)", "`kg` is not a length or an angle", "a length such as `1 mm`"),
    ] {
        let found = messages(text);
        assert_eq!(found.list.len(), 1, "{found}");
        assert!(found.list[0].message.contains(message), "{found}");
        let told = found.list[0].help.as_deref().unwrap_or_default();
        assert!(told.contains(help) && !told.contains("param"), "{found}");
    }
    // what moves needs the name
    let found = messages("solid s = box().rotate_z(60 rpm*t)").to_string();
    assert!(found.contains("`param w = 60 rpm`"), "{found}");
}

#[test]
fn ranges_in_si_units_ask_nothing() {
    for text in [
        "param d = 20 mm in 0.01 .. 0.1\nsolid s = sphere(d)",
        "param a = 45 deg in 0 .. pi/2\nsolid s = box().rotate_z(a)",
        "param a = 45 deg in 0 .. 90 deg\nsolid s = box().rotate_z(a)",
        "param d = 2 m in 1 .. 3\nsolid s = sphere(d)",
    ] {
        let found = messages(text);
        assert!(found.list.is_empty(), "{text}: {found}");
    }
}

#[test]
fn messages_that_name_what_was_meant() {
    let scene = |method: &str, fluid: &str| {
        format!("scene s {{\n  box {{ max: [1, 1, 1] }}\n  {method}\n  fluid w {{ {fluid} }}\n}}")
    };
    for (text, expected) in [
        (scene("solver: dfsph", "shape: ball([0.5, 0.5, 0.5], 0.2)"), "write `method: dfsph`"),
        (scene("", "solid: ball([0.5, 0.5, 0.5], 0.2)"), "`solid` is called `shape` here"),
        (scene("", "shape: ball([0.5, 0.5, 0.5], 0.2), density: 1"), "is `1 g/cm^3` meant?"),
        ("scene s\n  box { max: [1, 1, 1] }\n}".into(), "write `scene s {` here"),
        ("@tolerance 1e-5\nsolid s = sphere(1)".into(), "`@tolerance(1e-6)`"),
        ("solid s = sphere(1) – sphere(0.5)".into(), "this is a dash"),
        ("solid s = sphere(1) not z <= 0".into(), "write `a and not b`"),
        (
            "solid s = polygon([[0, 0], [1, 0], [1, 1]]).extrude(1, 0)".into(),
            "the height of what is extruded must be positive, found -1",
        ),
        (
            "solid s = polygon([[0, 0], [1, 0], [1, 1]]).extrude(1, 0)".into(),
            "`z0` is above `z1`: exchange them",
        ),
        ("solid s = layer(z, 1, 0) and sphere(1)".into(), "`low` is above `high`: exchange them"),
    ] {
        let found = messages(&text).to_string();
        assert!(found.contains(expected), "{text}\n{found}");
    }
    let light = messages(&scene("", "shape: ball([0.5, 0.5, 0.5], 0.2), density: 1.2 kg/m^3")).to_string();
    assert!(!light.contains("W0526"), "{light}");
}
