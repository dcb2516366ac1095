//! Habits from OpenSCAD and Python, and units of other systems: what the messages suggest has the user's own values.

use super::{alone, read};

const TEXTS: &[&str] = &[
    "solid s = import \"p.stl\"",
    "solid s = import \"parts.rfm\"",
    "solid s = rotate([0,0,45]) cube(1)",
    "solid s = translate([1,0,0]) rotate([0,0,45]) cube([1,2,3], center=true)",
    "solid s = translate([1,0,0]) sphere(1) and z <= 0",
    "solid s = scale(2) rotate([90,0,0])",
    "solid s = linear_extrude(2) square(1)",
    "solid s = linear_extrude(2) square([2,1])",
    "solid s = rotate_extrude() translate([2,0,0]) circle(1)",
    "solid s = cylinder(h=10, r=2, $fn=50)",
    "solid s = cube(1, $fn=50)",
    "solid s = $fn",
    "solid s = for (i=[0:5]) translate([i,0,0]) sphere(0.3)",
    "for (i = [0:2:10]) translate([i, 0, 0]) cube(0.5);",
    "solid s = any i in [0:5]: sphere(0.3).move([i,0,0])",
    "solid s = any i in [0:2:10]: sphere(0.3).move([i,0,0])",
    "param n = 5\nsolid s = any i in [1:n]: sphere(0.3).move([i,0,0])",
    "solid s = any i in range(5): sphere(0.3).move([i,0,0])",
    "solid s = any i in range(2, 5): sphere(0.3).move([i,0,0])",
    "solid s = any i in 0 to 5: sphere(0.3).move([i,0,0])",
    "param d = 1 in 0 to 5\nsolid s = sphere(d)",
    "let f = lambda a: a^2\nsolid s = sphere(1)",
    "solid s = sphere(1).and(sphere(2))",
    "solid s = sphere(1).or(x <= 0 and box())",
    "solid s = sphere(1e)",
    "param temperature = 20 C\nsolid s = sphere(1)",
    "param w = 3000 rev/min\nsolid s = sphere(1)",
    "param w = 3000 r/min\nsolid s = sphere(1)",
    "param w = 50 rev/s\nsolid s = sphere(1)",
    "param v = 3 ft/s\nsolid s = sphere(1)",
    "solid s = box().rotate_z(60 rpm*t)",
    "solid s = box().move([2 m/s*t,0,0])",
    "solid s = box() and x <= 10 deg",
    "solid s = box() and 10 deg <= x - 0.1",
    "solid s = box().twist(90)",
    "solid s = box().scale([1,1])",
    "scene q {\n  box { max: [1, 1, 1] }\n  fluid { shape: ball([0.5, 0.5, 0.5], 0.2) }\n  gravity: [0, 0, -9.81 m/s]\n}",
];

#[test]
fn habits_of_other_tools_are_answered_with_the_values_that_were_written() {
    read("openscad", alone(TEXTS));
}

/// A place may be compared with an angle where it has one.
#[test]
fn angles_are_compared_with_angles() {
    for text in [
        "solid s = box() and atan2(y, x) <= 10 deg",
        "param a = 5 mm\nsolid s = box() and x <= a",
        "solid s = box().twist(0.25)",
    ] {
        let found = super::messages(text);
        assert!(found.list.is_empty(), "{text}: {found}");
    }
}
