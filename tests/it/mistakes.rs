//! Small mistakes by theme, many to a snapshot: read each as the person who made it would. What a message
//! suggests is accepted as it stands.

mod commands;
mod half_remembered;
mod one_line;
mod openscad;
mod scenes;

use rfm::diagnostic::{Diagnostics, Source};
use rfm::lower::Options;
use rfm::{Engine, Experiment, Program};

use crate::tool::{root, snapshot};

/// Words of OpenSCAD, POV-Ray, GLSL and Python.
const WORDS: &[&str] = &[
    "solid s = union(sphere(1), box())",
    "solid s = difference(sphere(1), sphere(0.5))",
    "solid s = difference(sphere(1), x <= 0 or y <= 0)",
    "solid s = difference(sphere(1), x <= 0 and box())",
    "solid s = intersection(sphere(1), box())",
    "solid s = union()",
    "solid s = xor(sphere(1), box())",
    "solid s = sphere(1) xor box()",
    "solid s = sphere(1) union box()",
    "solid s = sphere(1) minus box()",
    "solid s = sphere(1).union(box())",
    "solid s = sphere(1).cut(box())",
    "solid s = complement(sphere(1))",
    "solid s = cube([1, 2, 3])",
    "solid s = cube(2)",
    "solid s = translate([1, 0, 0], sphere(1))",
    "solid s = translate([1, 0, 0]) sphere(1)",
    "solid s = rotate([0, 0, 45]) box()",
    "solid s = translate(sphere(1), [1, 0, 0])",
    "solid s = sphere(1).translate([1, 0, 0])",
    "solid s = box().rotateZ(45)",
    "solid s = box().translate(1, 2, 3)",
    "solid s = scale(2, sphere(1))",
    "solid s = plane(0, 0, 1)",
    "solid s = donut(1, 0.2)",
    "solid s = linear_extrude(2)",
    "solid s = hull(sphere(1), box())",
    "solid s = smooth_union(sphere(1), box())",
    "solid s = log(x) <= 1",
    "solid s = x % 2 <= 1",
    "solid s = 5 mod 2 <= x",
    "solid s = min3(x, y, z) <= 1",
    "solid s = fmax(x, y) <= 1",
    "solid s = norm([x, y, z]) <= 1",
    "solid s = mix(x, y, 0.5) <= 1",
    "solid s = sphere(1).move(vec3(1, 0, 0))",
    "solid s = if(x <= 0, sphere(1), box())",
    "solid s = x <= 0 ? sphere(1) : box()",
    "solid s = sphere(1) if x <= 0 else box()",
    "solid s = or(sphere(1), box())",
    "solid s = and(sphere(1), box(), z <= 0)",
    "solid s = and(sphere(1) or box(), z <= 0)",
    "solid s = sphere(PI)",
    "solid s = r <= 1",
    "let \"a b\" = 3",
    "solid s = sphere(1) \"big ball\"",
    "solid s = box([0, 0, [1]], [1, 1, 2])",
    "solid s = box().rotate_z(radians(30))",
    "solid s = random() <= x",
    "solid s = sphere(1) AND box()",
    "solid s = sphere(1) and NOT box()",
    "solid s = cylinder(d=2, h=3)",
    "solid s = cylinder(r=2, height=3)",
    "solid s = cylinder(r1=2, r2=1, h=3)",
    "union() { sphere(1); box(); }",
    "difference() {\n  sphere(1);\n}",
    "solid s = union() { sphere(1) box() }",
    "module part() { }",
    "def part(r): return r",
    "function f(x) = x",
    "let n = 6\nfor i in 0..n: sphere(1)",
    "solid s = for i in 0..6: sphere(i)",
    "solid s = for k in 2..9: sphere(0.1).move([k, 0, 0])",
    "solid s = for i in range(5): sphere(0.1).move([i, 0, 0])",
    "solid s = any i in 0:5: sphere(0.1).move([i, 0, 0])",
    "solid s = linear_extrude(2) polygon([[0, 0], [1, 0], [0, 1]])",
    "solid s = linear_extrude(height = 2) polygon([[0, 0], [1, 0], [0, 1]])",
    "solid s = rotate_extrude() polygon([[1, 0], [2, 0], [1, 1]])",
    "solid s = minkowski(box(), sphere(0.1))",
    "solid s = mesh(\"part.off\")",
    "solid s = any i in range(6): sphere(1)",
    "sphere(1)",
    "cube(1);",
    "r = 0.5",
    "float r = 0.5;",
    "var r = 0.5",
    "import \"part.stl\"",
    "import \"parts.rfm\"",
    "include <parts.scad>",
    "return sphere(1)",
    "solid s = math.sqrt(x) <= 1",
    "solid s = np.log(x) <= 1",
    "solid s = numpy.where(x <= 0, 1, 2)",
    "solid s = sphere { <0, 0, 0>, 1 }",
    "solid s = torus { 1, 0.2 }",
    "use \"parts.rfm\"",
    "param a = if 1 > 0 then 2",
    "param a = if 1 > 0: 2 else: 3",
    "param n = 4\nparam a = if n mod 2 == 0 then 1 else 2",
    "solid s = if x >= 0 then sphere(1) union box() else box()",
    "solid s = if x = 0 then sphere(1) else box()",
    "param a = if (1 > 0) 2 else 3",
    "param a = if 1 = 0 then 2 else 3",
    "param a = if 1 > 0 then 2 elif 0 > 1 then 3 else 4",
    "solid s = sphere(if 1 > 0 { 2 } else { 3 })",
    "solid s = polygon(path)",
    "solid s = path([[0, 0], [1, 0], [0, 1]]).extrude(0, 1)",
    "solid s = polygon(arc)",
    "solid s = polygon([[0, 0], spline, [0, 1]])",
    "solid s = square([1, 2]).extrude(0, 1)",
    "solid s = rect(1, 2).extrude(0, 1)",
    "solid s = frustum(1, 0.5, 2)",
    "solid s = truncated_cone(1, 0, 2)",
    "solid s = circle(2)",
    "solid s = pipe([[0, 0, 0], [1, 0, 0]], 0.1)",
    "solid s = cube([1, 2, 3], true)",
    "solid s = import(\"part.stl\")",
    "import part.stl",
    "solid box = sphere(1)\nsolid s = box([0, 0, 0], [1, 1, 1])",
    "solid s = square(10, center=true)",
    "solid s = cube([1, 2, 3], center=true)",
    "solid s = scale(sphere(1), 2)",
    "solid s = rotate(sphere(1).move([1, 0, 0]), [0, 0, 1], 30°)",
    "solid s = rotate_z(sphere(1), 30 deg)",
    "solid s = mix(sphere(1), box(), 0.5)",
    "solid s = x^2 + y^2 <= R^2",
    "solid s = sphere(5 milimeter)",
    "solid s = shell(0.1, sphere(1))",
    "solid s = offset(0.1, sphere(1))",
    "param r = 1 [0.1, 5]",
    "param r: float = 1",
    "solid s = mesh(\"part.stl\", mm)",
    "solid s = x ≠ 0",
];

/// Units where they do not fit.
const UNITS: &[&str] = &[
    "solid s = box().twist(90 deg)",
    "solid s = polygon([[0, 0], [2, 0], [1, 1]]).extrude(0, 10 deg)",
    "solid s = sphere(2 mm + 30 deg)",
    "param w = 5 s\nparam m = 3 kg\nsolid s = sphere(w + m)",
    "param w = 5 s\nsolid s = sphere(w)",
    "param r = 5 mm\nlet d = 2*r\nsolid s = sphere(1).rotate_z(d)",
    "solid s = box().taper(1, 5 mm)",
    "solid s = sphere(1).polar_repeat(5 mm)",
    "solid s = sphere(1).scale(30 deg)",
    "solid s = sphere(1).turned(2 mm)",
    "solid s = sweep([helix(1, 30 deg, 3)], 0.1)",
];

/// Choices, lists, maps of space, profiles and joints.
const SHAPES: &[&str] = &[
    "solid s = where(x <= 0, 1)",
    "solid s = sphere(1).move(where(x <= 0, [1, 2, 3], 1))",
    "solid s = random(x, 1)",
    "let l = [1, 2, 3, 4]\nsolid s = sphere(l[4])",
    "let l = [1, 2, 3, 4]\nsolid s = sphere(l)",
    "solid s = sphere([1, 2][x])",
    "let r = 2\nsolid s = sphere(r[0])",
    "solid s = sphere(count(3))",
    "solid s = any i in 6: sphere(i)",
    "solid s = any p in sphere(1): ball([p, 0, 0], 1)",
    "solid s = max i in 0..0: x",
    "solid s = min p in [[0, 1], [2, 3]]: p",
    "let l = [[0, 0] [1, 1]]\nsolid s = polygon(l)",
    "solid s = polygon([[0, 0], [1, 1], [1, 0], [0, 1]])",
    "solid s = polygon([[0, 0], [2, 0], [2, 2], [1, 0], [0, 2]])",
    "solid s = polygon([[0, 0], [1, 0]])",
    "solid s = polygon([[0, 0, 1], [1, 0, 0], [0, 1, 0]])",
    "solid s = polygon(3)",
    "solid s = polygon([[0, 0], [1, 0], [1, 0], [0, 1]])",
    "solid s = polygon([[0, 0], [1, 0], [0.5, 0], [0, 1]])",
    "solid s = polygon([[0, 0], [x, 0], [0, 1]])",
    "solid s = box().repeat([1, 1, 1], [0, 1, 1])",
    "solid s = box().repeat([0, 1, 1], [2, 1, 1])",
    "param n = 0 in 0 .. 9\nsolid s = sphere(1).polar_repeat(n)",
    "solid s = sphere(1).polar_repeat(2.5)",
    "solid s = any i in 0..3: any j in 0..i: ball([i, j, 0], 1)",
    "solid s = sphere(1) or box() or sphere(1)",
    "solid s = sphere(1) or box() or sphere(1) or box()",
    "let a = sphere(1)\nsolid s = a and a",
    "solid s = box() \\ sphere(1) \\ ball([0, 0, 0], 1)",
    "solid s = box().repeat(2)",
    "solid s = box().at([x, y])",
    "solid s = box().at(2*x)",
    "solid s = box().turned([0, 0, 1])",
    "solid s = box().twist()",
    "solid s = box().twirl(2)",
    "solid s = sphere(1).bend(0)",
    "solid s = blend(sphere(1), box(), 0)",
    "solid s = sphere(1).blend(box())",
    "solid s = box().rotate([0, 0, 1], 45 deg, 2)",
    "solid s = box().round()",
    "solid s = box().round(0)",
    "solid s = box().round(0.1, -1)",
    "solid s = box().round(45 deg)",
    "solid s = box().round(x)",
    "solid s = sphere(1).round(0.1)",
    "solid s = round(box(), 0.1)",
    "solid s = box().fillet(0.1)",
    "solid s = any i in 0..6: ball([cos(360/6*i), sin(60*i), 0], 0.2)",
    "solid s = sweep(helix(1, 0.5, 3))",
    "solid s = sweep(helix(radius = 1, pitch = 0.5, turns = 3), 0.1)",
    "solid s = sweep(helix(1, 0.5, 3), polygon([[0, 0], [0.1, 0], [0, 0.1]]))",
    "solid s = text(\"Hi\").extrude(0, 1)",
    "solid s = polygon([[0, 0], [1, 0], [1, 1]]).extrude(1)",
    "solid s = polygon([[0, 0], [1, 0], [1, 1]]).rotate_extrude()",
    "solid s = capsule([0, 0, 0], [1, 0, 0], 0.1)",
    "param c = [0, 0, 1]\nsolid s = ball(c, 1)",
    "param name = \"pawn\"\nsolid s = sphere(1)",
    "param r = 5 mm in 1 .. 10 mm\nsolid s = sphere(r)",
];

/// Signs that mean something elsewhere.
const SIGNS: &[&str] = &[
    "solid s = sphere(1, centre: [0, 0, 1])",
    "solid s = box(min: [0, 0, 0], max: [1, 2, 3]) and z <= 1",
    "solid s = sphere(1) ∪ box()",
    "solid s = sphere(1) ∩ box()",
    "solid s = sphere(√(2))",
    "solid s = sphere(1'000)",
    "solid s = any i in 0...5: sphere(1).move([i, 0, 0])",
    "/* a ball */\nsolid s = sphere(1)",
    "solid s = sphere(1) /* a ball */ and box()",
    "-- a ball\nsolid s = sphere(1)",
    "solid s = any i in 0..=5: sphere(0.3).move([i, 0, 0])",
    "param n = 5\nsolid s = any i in 0..=n: sphere(0.3).move([i, 0, 0])",
    "solid s = x = 1",
    "solid s = sphere(1);",
    "solid s = x ** 2 <= 1",
    "solid s = sphere(<0, 0, 0>, 1)",
    "solid s = sphere(0,5)",
    "let v = (1, 0, 0)\nsolid s = sphere(1).move(v)",
    "let a = 1\nsolid s = sphere(1).move((a, 0, -a))",
    "let corners = [(0, 0), (1, 0), (0, 1)]\nsolid s = polygon(corners)",
    "solid s = sphere(1_000)",
    "solid s = sphere(1.5f)",
    "solid s = sphere(10%)",
    "solid s = sphere(5 inches)",
    "solid s = sphere(1 metre)",
    "solid s = box().rotate_z(30 degrees)",
    "param a = 1 'the radius'\nsolid s = sphere(a)",
    "param a = 1 “the radius”\nsolid s = sphere(a)",
    "solid s { sphere(1) }",
    "solid s = { sphere(1) }",
    "solid s = sphere(1e999999)",
    "solid s = sphere(1e-999999)",
    "solid s = sphere(1)\u{200b}",
    "solid s\u{202e} = sphere(1)",
    "param a = 1 \"\u{1b}[31mred\u{9b}0m\u{202e}\"\nsolid s = sphere(b)",
    "solid s = |x| + |y| + |z| <= 1",
    "solid s = sin(2pi*x) <= 0 and box()",
    "solid s = any i in 0..4, j in 0..4: cylinder(0.2, 1).move([i, j, 0])",
    "solid s = any(i in 0..4, cylinder(0.2, 1).move([i, 0, 0]))",
    "let s = sum(i in 1..4: x^i)\nsolid t = s <= 1",
    "solid s = any(cylinder(0.2, 1).move([i, 0, 0]) for i in 0..4)",
    "let f(x) = x^2\nsolid s = f(x) <= 1",
    "fn f(a) { a^2 }\nsolid s = f(x) <= 1",
    "solid my-part = sphere(1)",
    "solid s = (x - 1)^2 + (y - 1)^2 = 4 and 0 <= z <= 1",
    "solid s = box().move([1, 0, 0]) move([0, 1, 0])",
    "solid s = box().move([1, 0, 0]) sphere(1)",
];

/// Arguments, angles, lengths, and what is rarely meant.
const VALUES: &[&str] = &[
    "solid s = sphere(1) and x <= 1 or 2",
    "solid s = sum i in 0..3: sphere(1).move([i, 0, 0])",
    "solid s = (x <= 1)*(y <= 2) and box()",
    "solid s = box([1, 1, 1])",
    "solid s = box(2)",
    "solid s = box(1, 1, 1)",
    "solid s = box([0, 0, 0], [1, 1, 0])",
    "solid s = sphere(1, 2, 3)",
    "solid s = sphere([0, 0, 0], 1)",
    "solid s = cylinder(h = 1, radius = 2)",
    "solid s = ball(1)",
    "solid s = sphere(1).move(1, 0, 0)",
    "solid s = sphere(1).move(1)",
    "solid s = sphere(1).move(x = 1)",
    "solid s = box().rotate(45)",
    "solid s = box().rotate([0, 0, 45])",
    "solid s = box().rotate(45 deg, [0, 0, 1])",
    "solid s = box().rotate_z([0, 0, 1])",
    "solid s = box().scale(1, 2, 3)",
    "solid s = box().mirror(1, 0, 0)",
    "solid s = box().rotate_z(45)",
    "solid s = box().rotate_x(-90)",
    "param turn = 45\nsolid s = box().rotate_z(turn)",
    "solid s = any i in 0..6: box().rotate_z(i*60)",
    "solid s = box().rotate([0, 0, 1], 90)",
    "solid s = ball([1 deg, 0, 0], 1)",
    "solid s = sphere(30 deg)",
    "solid s = sphere(1).move([0, 0, -90 deg])",
    "solid s = box().rotate_z(5 mm)",
    "solid s = sphere(1 kg)",
    "param n = 2\nsolid s = sphere(n m)",
    "param n = 2\nsolid s = sphere(1 + n mm)",
    "param n = 2\nsolid s = box([0, 0, 0], [(1 + n) cm, 1, 1])",
    "solid s = 5",
    "solid s = -1",
    "solid s = 1/0 - x",
    "let a = 1/0\nsolid s = a - x",
    "solid s = box().rotate_z(45*t)",
    "solid s = box().rotate_z(50*sin(t))",
    "solid s = sphere(auto)",
    "let r = auto\nsolid s = sphere(r)",
    "solid s = box().rotate([0, 0, 1], 360*sin(t))",
    "solid s = box().rotate_z(min(90*t, 45))",
    "solid s = sphere(1) - sphere(0.5)",
    "solid a = sphere(1)\nsolid s = a + box()",
    "solid s = sphere(1)*box()",
    "solid s = sphere(1)/box()",
    "param k = 3.5 1..5  \"a size\"\nsolid s = sphere(k)",
    "param k = 8 mm 1 mm .. 1 cm\nsolid s = sphere(k)",
    "param d = 8 mm in 1 cm .. 2 cm\nsolid s = sphere(d)",
    "param a = 45 deg in 90 deg .. 0 deg\nsolid s = box().rotate_z(a)",
    "",
    "# nothing but a remark",
    "solid s = sphere(2 in)",
    "solid s = sphere(1/2 inch)",
    "solid s = 5 <= z <= 2 and sphere(3)",
    "solid s = box().rotate_z(3000 rpm*t)",
    "let h = 2\nsolid s = cylinder(1 h)",
    "let r = 1\nlet h = 2\nsolid s = cylinder(r h)",
    "param n = 2\nsolid s = sphere(1 cm + n mm)",
    "let d = 2 in 0 .. 5\nsolid s = sphere(d)",
    "solid s = 2 >= z >= 5",
];

fn program(text: &str) -> Result<Program, Diagnostics> {
    let text =
        if text.is_empty() || text.starts_with('#') { text.to_string() } else { format!("rfm 1\n{text}\n") };
    Program::check(Source::file("s.rfm", text), Options::default())
}

/// The messages about a text, and about the start of its scene if it has one.
fn messages(text: &str) -> Diagnostics {
    let program = match program(text) {
        Ok(program) => program,
        Err(diagnostics) => return diagnostics,
    };
    let mut all = program.warnings();
    if let Some(scene) = program.module().scenes.first() {
        let found = Experiment::new(&program, &scene.name, Engine::Interpreter).and_then(|experiment| {
            all.list.extend(experiment.warnings().list);
            experiment.estimated_particles()?;
            Ok(experiment.start()?.warnings)
        });
        match found {
            Ok(warnings) => all.list.extend(warnings.list),
            Err(rfm::Error::Diagnostics(errors)) => all.list.extend(errors.list),
            Err(other) => panic!("{text}: {other}"),
        }
    }
    all
}

#[test]
fn rates_of_turning_in_radians_per_second_ask_nothing() {
    for rate in ["10*t", "-200*t + 1", "7.5*(t - 1)", "t*20"] {
        let found = messages(&format!("solid s = box().rotate_z({rate})"));
        assert!(found.list.is_empty(), "{rate}: {found}");
    }
}

/// What a message suggests, between backticks behind the word `write`.
fn told(help: &str) -> Vec<&str> {
    let mut told = Vec::new();
    for part in help.split("write ").skip(1) {
        let part = part.strip_prefix("for example ").unwrap_or(part);
        if let Some((code, _)) = part.strip_prefix('`').and_then(|rest| rest.split_once('`')) {
            told.push(code);
        }
    }
    told.retain(|code| !code.contains('…') && !code.contains("name"));
    told
}

/// Whether a text is accepted somewhere in a file: as an item, a value, a method of a shape, or an entry of a scene.
fn is_accepted(code: &str) -> bool {
    let known = "param n = 6\nparam turn = 45\nparam i = 1\nlet o = [0, 0, 0]\nlet e = x\nsolid a = sphere(1)\nsolid b = box()\nsolid shape = sphere(2)\n";
    let scene = |entries: &str| {
        let text = format!(
            "{known}solid post = a\nscene q {{\n  box {{ max: [1, 1, 1] }}\n  fluid {{ shape: ball([0.5, 0.5, 0.5], 0.2) }}\n}}\n"
        );
        let first = entries.split([':', ' ']).next().unwrap_or_default();
        match first {
            "box" => text.replace("box { max: [1, 1, 1] }", entries),
            "obstacle" => text.replace("  fluid", &format!("  {entries}\n  fluid")),
            "fluid" => text.replace("fluid { shape: ball([0.5, 0.5, 0.5], 0.2) }", entries),
            "gravity" | "method" | "run" => text.replace("  fluid", &format!("  {entries}\n  fluid")),
            "max" => text.replace("max: [1, 1, 1]", entries),
            "dt" | "until" | "save_every" => {
                text.replace("  fluid", &format!("  run {{ {entries} }}\n  fluid"))
            }
            "height" | "pressure" | "flux" => {
                text.replace("  fluid", &format!("  probe p {{ {entries} }}\n  fluid"))
            }
            "normal" => {
                let probe = format!("  probe p {{ flux {{ point: [0.5, 0, 0], {entries} }} }}\n  fluid");
                text.replace("  fluid", &probe)
            }
            "picture" => text.replace("  fluid", &format!("  {entries}\n  fluid")),
            "camera" | "look_at" | "zoom" | "cut" | "hide" | "glass" => {
                text.replace("  fluid", &format!("  picture {{ {entries} }}\n  fluid"))
            }
            _ => text.replace("0.2) }", &format!("0.2), {entries} }}")),
        }
    };
    let tried = [
        format!("{known}{code}"),
        format!("{known}solid s = {code}"),
        format!("{known}let l = any i in {code}: e + i"),
        format!("{known}let l = [{code}, 0, 0]"),
        format!("{known}solid s = box().rotate_z({code})"),
        format!("{known}let l = {code}"),
        format!("{known}solid s = sphere(1){code}"),
        format!("{known}param p = 1 in {code}"),
        scene(code),
        scene(&format!("viscosity: {code}")),
    ];
    tried.iter().any(|text| program(text).is_ok())
}

/// One snapshot of a theme, and a check of everything that its messages suggest.
fn read(theme: &str, texts: impl IntoIterator<Item = (String, String)>) {
    let (mut all, mut refused) = (String::new(), String::new());
    for (title, text) in texts {
        let found = messages(&text);
        assert!(!found.list.is_empty(), "no message about: {title}");
        let rendered = found.to_string();
        assert!(!rendered.contains(rfm::diagnostic::is_hidden), "{title}: hidden characters in\n{rendered}");
        let shown: String = title.chars().filter(|c| !rfm::diagnostic::is_hidden(*c)).collect();
        all += &format!("──── {shown}\n{rendered}\n");
        for diagnostic in &found.list {
            for code in told(diagnostic.help.as_deref().unwrap_or_default()) {
                if !is_accepted(code) {
                    refused += &format!("not accepted: `{code}`, as told in\n{rendered}");
                }
            }
        }
    }
    snapshot("mistakes", theme, &all);
    assert!(refused.is_empty(), "{refused}");
}

fn alone(texts: &[&str]) -> Vec<(String, String)> {
    texts.iter().map(|text| (text.to_string(), text.to_string())).collect()
}

#[test]
fn words_of_other_languages() {
    read("words", alone(WORDS));
}

#[test]
fn signs_of_other_languages() {
    read("signs", alone(SIGNS));
}

#[test]
fn arguments_angles_and_what_is_rarely_meant() {
    read("values", alone(VALUES));
}

#[test]
fn units_that_do_not_fit() {
    read("units", alone(UNITS));
    // lengths of arcs, plain numbers, and products in which a plain number stands for a quantity
    for text in [
        "param r = 5 mm\nparam a = 30 deg\nsolid s = sphere(r*a + 2 mm + r/r)",
        "let p = 1000*9.81 m/s^2*0.1 m\nlet q = p + 5 kPa\nlet _r = q\nsolid s = sphere(1)",
        "solid s = box().twist(1/(2 m))",
        "param s = 5 mm\nparam k = 20\nsolid s1 = box().rotate_z(k*s)",
        "solid s = box().scale(1 mm)",
        "fn part(w) = sphere(w + 2 mm)\nsolid s = part(1)",
    ] {
        let found = messages(text);
        assert!(!found.has_errors(), "{text}: {found}");
    }
}

#[test]
fn choices_lists_maps_and_profiles() {
    read("shapes", alone(SHAPES));
}

#[test]
fn a_file_that_tells_of_a_mistake_is_told_from_the_examples() {
    // the messages above are about mistakes alone: what the examples do raises none of them
    for name in ["pawn", "bishop", "cube", "gate", "paddle", "rotating_box"] {
        let program = Program::from_path(root().join(format!("examples/{name}.rfm"))).unwrap();
        assert!(program.warnings().list.is_empty(), "{name}: {}", program.warnings());
        for scene in &program.module().scenes {
            let experiment = Experiment::new(&program, &scene.name, Engine::Auto).unwrap();
            let warnings = experiment.start().unwrap().warnings;
            assert!(warnings.list.is_empty(), "{name}: {warnings}");
        }
    }
}
