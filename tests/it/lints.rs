//! What `rfm check` calls odd is odd by geometry, and what is not is left alone.

use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::solid::{Breakage, ThinPart};
use rfm::{Engine, Experiment, Program, Solid};

use crate::random::Random;
use crate::tool::{rfm, rfm_reading, root};

fn solid(text: &str) -> Solid {
    let program = Program::from_source("t.rfm", format!("rfm 1\nsolid s = {text}"));
    program.unwrap_or_else(|e| panic!("{text}: {e}")).solid_with("s", Engine::Auto).unwrap()
}

/// The texts of the operands that are found idle.
fn idle(text: &str) -> Vec<String> {
    let text = format!("rfm 1\nsolid s = {text}");
    let program = Program::from_source("t.rfm", text.clone()).unwrap_or_else(|e| panic!("{text}: {e}"));
    let source = program.module().solids[0].span.source;
    let solid = program.solid("s").unwrap();
    let found = solid.idle_operands(source, &mut { usize::MAX });
    assert!(!found.is_cut, "{text}");
    found.spans.iter().map(|span| text[span.range()].to_string()).collect()
}

/// One ball lies within another if the distance of their centres and its radius make less than the other's radius.
#[test]
fn a_ball_is_idle_in_a_union_if_it_lies_within_another_one() {
    let (mut random, mut inner) = (Random(5), 0);
    for _ in 0..60 {
        let (x, y) = (random.within(-0.6, 0.6), random.within(-0.6, 0.6));
        let r = random.within(0.2, 0.9);
        let reach = x.hypot(y) + r;
        if (reach - 1.0).abs() < 0.02 {
            continue; // almost touching: allowed to be unknown
        }
        let small = format!("ball([{x}, {y}, 0], {r})");
        let wanted = if reach < 1.0 { vec![small.clone()] } else { Vec::new() };
        assert_eq!(idle(&format!("ball([0, 0, 0], 1) or {small}")), wanted, "{reach}");
        // of a conjunction the larger one is idle, and a ball that is taken away is if it does not meet the other one
        let larger = if reach < 1.0 { vec!["ball([0, 0, 0], 1)".to_string()] } else { Vec::new() };
        assert_eq!(idle(&format!("ball([0, 0, 0], 1) and {small}")), larger, "{reach}");
        let far = format!("ball([{}, {y}, 0], {r})", x + 1.2);
        let apart = (x + 1.2).hypot(y) - r - 1.0;
        if apart.abs() > 0.02 {
            let wanted = if apart > 0.0 { vec![far.clone()] } else { Vec::new() };
            assert_eq!(idle(&format!("ball([0, 0, 0], 1) \\ {far}")), wanted, "{apart}");
        }
        inner += usize::from(reach < 1.0);
    }
    assert!((15..45).contains(&inner), "{inner}");
}

#[test]
fn operands_are_idle_by_all_of_the_formula() {
    // the plane cuts the small ball, which lies within the large one
    let text = "sphere(1) or (sphere(0.5) and x <= 0)";
    assert_eq!(idle(text), ["(sphere(0.5) and x <= 0)"]);
    assert_eq!(
        idle("sphere(0.3) or (x <= 2 and sphere(1)) or sphere(0.4)"),
        ["sphere(0.3)", "x <= 2", "sphere(0.4)"]
    );
    // what lies in an operand that may go is not reported again
    assert_eq!(idle("sphere(1) and (sphere(2) and sphere(1.5) or x <= -5)").len(), 1);
    assert_eq!(idle("sphere(2) and (x <= 3 or y <= 3)"), ["(x <= 3 or y <= 3)"]);
    assert_eq!(idle("box([0, 0, 0], [1, 1, 1]) and x <= 1.5"), ["x <= 1.5"]);
    // a wall that it shares with another cylinder is no operand of its own, and neither is what is left of it
    let shared = "((cylinder(0.5, 1) or sphere(1)) \\ cylinder(0.5, 4).move([0, 0, -2])).scale(0.37)";
    assert!(idle(shared).is_empty(), "{:?}", idle(shared));
    // what only touches, members of a fold, and parts of a standard solid are left alone
    for text in [
        "box([0, 0, 0], [1, 1, 1]) and x <= 1",
        "any i in 0..4: sphere(1 + 0.1*i)",
        "cylinder(1, 1) and x + y + z <= 1",
        "sphere(1) and not sphere(0.999)",
        "sphere(1) or sphere(0.1).move([1.05, 0, 0])",
        // a crumb far beyond the lattice that is tried first
        "sphere(1) or ball([40, 0, 0], 0.001)",
    ] {
        assert_eq!(idle(text), Vec::<String>::new(), "{text}");
    }
}

/// What `.twist` and `.repeat` draw around a shape follows from all of it, and proves nothing of the shape without a part:
/// here that one has points at any distance.
#[test]
fn an_operand_that_ends_a_shape_is_not_idle_by_the_limits_that_follow_from_it() {
    let endless = "x^2 + y^2 + z^2 - x*y*z <= 0.1";
    for (map, far) in [("twist(0.1)", [0.0, 8.0, 7.0]), ("repeat([6, 0, 0], [3, 1, 1])", [-4.0, -4.0, 4.0])] {
        let text =
            format!("rfm 1\nsolid s = ({endless} and sphere(2)).{map}\nsolid without = ({endless}).{map}");
        let program = Program::from_source("t.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        let source = program.module().solids[0].span.source;
        let [solid, without] = ["s", "without"].map(|name| program.solid(name).unwrap());
        let far = DVec3::from_array(far);
        assert!(solid.sign(far) < 0.0 && without.sign(far) > 0.0, "{map}");
        assert_eq!(solid.idle_operands(source, &mut { usize::MAX }).spans, [], "{map}");
    }
    assert_eq!(idle("(box([0, 0, 0], [1, 1, 1]) and sphere(2)).repeat([3, 0, 0], [3, 1, 1])"), ["sphere(2)"]);
}

/// |∇ω| of k·(r² − x² − y²) at the surface is 2kr, that of a half-space 1.
#[test]
fn gradients_are_compared_at_the_surface() {
    for (k, r, told) in [(1e4, 0.1, true), (4e3, 0.1, false), (1.0, 1.0, false), (1.0, 2e-4, true)] {
        let found = solid(&format!("{k}*({r}^2 - x² - y²) and 0 <= z and z <= {r}")).uneven_operands();
        let steep: f64 = 2.0 * k * r;
        assert_eq!(!found.is_empty(), told, "{k} {r}: {found:?}");
        if let Some(uneven) = found.first() {
            let [large, small] = uneven.gradients;
            let wanted = [steep.max(1.0), steep.min(1.0)];
            assert!((large / wanted[0] - 1.0).abs() < 1e-3, "{large} {wanted:?}");
            assert!((small / wanted[1] - 1.0).abs() < 1e-3, "{small} {wanted:?}");
        }
    }
    // `normalise` is what the help says: it makes both 1
    assert_eq!(solid("normalise(1e4*(0.01 - x² - y²)) and 0 <= z and z <= 1").uneven_operands(), []);
}

fn breaks(text: &str) -> Vec<(Breakage, DVec3)> {
    let solid = solid(text);
    let around = solid.bounds().aabb().expect(text).grown(0.1);
    solid.jumps(&around).iter().map(|found| (found.what, found.at)).collect()
}

#[test]
fn jumps_are_found_where_they_are() {
    let found = breaks("box([-1, -1, 0], [1, 1, 2]) and where(x <= 0.1, 1 - z, 0.5 - z)");
    assert!(
        matches!(found[..], [(Breakage::Jump, at)] if (at.x - 0.1).abs() < 1e-12 && at.z > 0.5),
        "{found:?}"
    );
    let found = breaks("(0.7 - mod(x, 1)) and -2.2 <= x <= 2.2 and -1 <= y <= 1 and -1 <= z <= 1");
    assert!(matches!(found[..], [(Breakage::Jump, at)] if (at.x - at.x.round()).abs() < 1e-12), "{found:?}");
    let found = breaks("sphere(2) and 1/(x - 0.3) >= 0.1");
    assert!(matches!(found[..], [(Breakage::Pole, at)] if (at.x - 0.3).abs() < 1e-12), "{found:?}");
    for continuous in [
        // both values agree at the border
        "box([-1, -1, 0], [1, 1, 2]) and where(x <= 0.1, 1 - z, 1.1 - x - z)",
        // the distance from the nearest whole number jumps nowhere
        "(0.3 - abs(x - round(x))) and -2.2 <= x <= 2.2 and -1 <= y <= 1 and -1 <= z <= 1",
        // the divisor is zero far from the surface
        "sphere(1) and x + 1/(x - 5) <= 0.5",
        "sphere(1) and sqrt(abs(x)) <= 0.5 and abs(y)^0.3 <= 0.8",
    ] {
        assert_eq!(breaks(continuous), [], "{continuous}");
    }
}

fn singular(text: &str) -> Vec<(Breakage, DVec3)> {
    let solid = solid(text);
    let over = solid.bounds().aabb().expect(text).grown(1.0);
    solid.singularities(&over).iter().map(|found| (found.what, found.at)).collect()
}

#[test]
fn what_has_no_value_outside_is_found() {
    let found = singular("sphere(1) and ln(x + 1.2) <= 0.5");
    assert!(matches!(found[..], [(Breakage::NoValue, at)] if at.x <= -1.2), "{found:?}");
    let found = singular("sphere(1) and sqrt(1.5 - y) >= 0.2");
    assert!(matches!(found[..], [(Breakage::NoValue, at)] if at.y > 1.5), "{found:?}");
    let found = singular("sphere(1) or (0.01 - 1/(x - 1.7)^2 >= 0 and sphere(1))");
    assert_eq!(found, [], "a pole without a change of sign is not looked for");
    let found = singular("sphere(1) and 0.1/(z - 1.7) <= 0.5");
    assert!(matches!(found[..], [(Breakage::Pole, at)] if (at.z - 1.7).abs() < 1e-9), "{found:?}");
    assert_eq!(singular("sphere(1) and sqrt(x*x + y*y) >= 0.2"), []);
}

/// sin(x)/x has the limit 1, 1/x has none.
#[test]
fn a_divisor_that_is_zero_where_omega_has_a_limit_is_no_pole() {
    for (text, has_limit) in [
        ("sphere(1) and sin(x)/x >= 0.5", true),
        ("sphere(1) and (x*x - 0.25)/(x - 0.5) >= 0.2", true),
        ("sphere(1) and 1/x >= 0.5", false),
        ("sphere(1) and -1/x >= 0.5", false),
        ("sphere(1) and (sin(x) + 0.1)/x >= 0.5", false),
    ] {
        // the middle is no node, and is met by halving
        let found = singular(text);
        assert_eq!(found.is_empty(), has_limit, "{text}: {found:?}");
        assert!(found.iter().all(|(what, at)| *what == Breakage::Pole && at.x.abs() < 1e-9), "{found:?}");
    }
}

/// Among 200 divisors that are zero without harm, because a constant takes the place of their quotients
/// there, one harms.
#[test]
fn a_pole_is_found_among_many_quotients() {
    let guarded = |i: usize| {
        let a = i as f64 * 0.009 - 0.9;
        format!("where(abs(x - {a}) > 0.001, 1e-6/(x - {a}), 0)")
    };
    let harmless: Vec<String> = (0..200).map(guarded).collect();
    let text = format!("sphere(1) and {} <= 0.5", harmless.join(" + "));
    assert_eq!(singular(&text), []);
    let found = singular(&text.replacen(&harmless[100], "1e-6/(x - 0.1003)", 1));
    assert!(matches!(found[..], [(Breakage::Pole, at)] if (at.x - 0.1003).abs() < 1e-9), "{found:?}");
}

/// What a choice leaves out is not blamed: the texts of the operations that are.
#[test]
fn operations_that_a_choice_leaves_out_are_not_blamed() {
    for (of, blamed) in [
        ("where(x > 0, ln(x), -20) + sqrt(y) - 1", vec!["sqrt(y)"]),
        ("sqrt(y) + where(x > 0, ln(x), -20) - 1", vec!["sqrt(y)"]),
        ("where(x > 0, ln(x), -20)", vec![]),
        ("where(x > -0.2, ln(x), -20)", vec!["ln(x)"]),
        ("where(abs(x) > 0.1, 0.1/x, 0) + 0.1/y - 1", vec!["0.1/y"]),
    ] {
        let text = format!("rfm 1\nsolid s = sphere(1) and {of} >= 0");
        let program = Program::from_source("t.rfm", text.clone()).unwrap_or_else(|e| panic!("{text}: {e}"));
        let found =
            program.solid("s").unwrap().singularities(&Aabb::new(DVec3::splat(-1.5), DVec3::splat(1.4)));
        let words: Vec<&str> = found.iter().map(|found| &text[found.span.unwrap().range()]).collect();
        assert_eq!(words, blamed, "{text}");
    }
}

fn thinner_than(solid: &Solid, wall: f64, gap: f64) -> [Option<ThinPart>; 2] {
    let within = Aabb::new(DVec3::splat(-100.0), DVec3::splat(100.0));
    solid.thin_parts([wall, gap, gap], &within, &mut { usize::MAX })
}

/// No fluid is below a plate on the floor of its box, or behind one at its wall.
#[test]
fn walls_without_fluid_on_both_sides_and_gaps_outside_do_not_count() {
    let within = Aabb::new(DVec3::ZERO, DVec3::splat(2.0));
    let parts = |text: &str| {
        solid(text).thin_parts([0.02, 0.04, 0.04], &within, &mut { usize::MAX }).map(|part| part.is_some())
    };
    for (text, wanted) in [
        ("box([0, 0, 0], [2, 2, 0.01])", [false, false]),
        ("box([0.5, 0.5, 0], [1.5, 1.5, 0.01])", [false, false]),
        ("box([0.5, 0.5, -0.005], [1.5, 1.5, 0.01])", [false, false]),
        // no particle finds room below
        ("box([0.5, 0.5, 0.02], [1.5, 1.5, 0.03])", [false, false]),
        ("box([0.5, 0.5, 0.05], [1.5, 1.5, 0.06])", [true, false]),
        // it stands on the floor
        ("box([1, 0.5, 0], [1.01, 1.5, 1])", [true, false]),
        ("box([1.99, 0.5, 0], [2, 1.5, 1])", [false, false]),
        // a slot inside, one below the floor, and one outside
        ("box([0.5, 0.5, 0.5], [1.5, 1.5, 0.7]) or box([0.5, 0.5, 0.73], [1.5, 1.5, 1])", [false, true]),
        ("box([0, 0, -1], [2, 2, -0.53]) or box([0, 0, -0.5], [2, 2, 0.3])", [false, false]),
        ("box([2.5, 0, 0], [2.51, 1, 1]) or box([1, 1, 1], [1.5, 1.5, 1.5])", [false, false]),
    ] {
        assert_eq!(parts(text), wanted, "{text}");
    }
    // beyond its budget the search says nothing
    let plate = solid("box([0.5, 0.5, 0.5], [1.5, 1.5, 0.51])");
    let mut budget = 1_000_000_000;
    assert!(plate.thin_parts([0.02, 0.04, 0.04], &within, &mut budget)[0].is_some());
    assert!(budget < 1_000_000_000);
    assert_eq!(plate.thin_parts([0.02, 0.04, 0.04], &within, &mut 1000), [None; 2]);
}

/// Plates and slots of known thickness, in any direction.
#[test]
fn thin_walls_and_gaps_have_their_thickness() {
    let mut random = Random(11);
    for _ in 0..8 {
        let t = random.within(0.02, 0.2);
        let turn = format!(
            "rotate([1, {}, {}], {})",
            random.within(-1.0, 1.0),
            random.within(-1.0, 1.0),
            random.within(0.0, 3.0)
        );
        let plate = solid(&format!("box([-1, -1, 0], [1, 1, {t}]).{turn}"));
        let [wall, gap] = thinner_than(&plate, 1.05 * t, 1.05 * t);
        let wall = wall.expect("a plate");
        assert!((wall.thickness / t - 1.0).abs() < 1e-6, "{} {t}", wall.thickness);
        assert!((wall.area / 4.0 - 1.0).abs() < 0.15, "{}", wall.area);
        assert_eq!(gap, None);
        assert_eq!(thinner_than(&plate, 0.95 * t, 0.95 * t), [None; 2]);
        let slot = solid(&format!(
            "(box([-1, -1, {}], [1, 1, {}]) or box([-1, -1, {}], [1, 1, {}])).{turn}",
            t,
            t + 0.7,
            -0.7,
            0.0
        ));
        let [wall, gap] = thinner_than(&slot, 0.5, 1.05 * t);
        assert_eq!(wall, None);
        assert!((gap.expect("a slot").thickness / t - 1.0).abs() < 1e-6, "{gap:?} {t}");
    }
}

#[test]
fn tips_and_edges_are_not_walls() {
    for text in [
        "cone(0.5, 1)",
        "sphere(1)",
        "box([0, 0, 0], [1, 1, 1])",
        "0 <= z and z <= 0.5*x and x <= 1 and 0 <= y and y <= 1",
    ] {
        assert_eq!(thinner_than(&solid(text), 0.15, 0.15), [None; 2], "{text}");
    }
}

/// What is measured and compared with known solutions has nothing odd.
#[test]
#[ignore = "long"]
fn flows_that_are_validated_check_without_a_word() {
    for entry in std::fs::read_dir(root().join("examples/validation")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "rfm") {
            let outcome = rfm(root(), &["check", "--deny", "warnings", path.to_str().unwrap()]).expect(0);
            assert_eq!(outcome.stderr, "", "{}", path.display());
        }
    }
}

/// Slots hold less than they should below two spacings.
#[test]
fn gaps_of_less_than_two_spacings_are_told() {
    for (width, told) in [(1.2, true), (1.9, true), (2.1, false), (4.0, false)] {
        let text = format!(
            "rfm 1\nsolid mould = box([-1, -1, -0.3], [2, 1, 0]) \\ box([0.1, -2, -0.2], [0.1 + {width}*2 cm, 2, 0.1])\n\
             scene m {{\n  box {{ min: [0, 0, -0.25], max: [0.4, 0.2, 0.4] }}\n  obstacle {{ solid: mould }}\n\
             fluid w {{ shape: box([0, 0, 0], [0.4, 0.2, 0.2]), spacing: 2 cm }}\n}}\n"
        );
        let program = Program::from_source("t.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        let found = Experiment::new(&program, "m", Engine::Auto).unwrap().misfits();
        let gaps: Vec<_> = found.list.iter().filter(|message| message.code.0 == "W0508").collect();
        assert_eq!(gaps.len(), usize::from(told), "{width}: {gaps:?}");
        assert!(gaps.iter().all(|gap| gap.message.contains(&format!("{width:.1} times"))), "{gaps:?}");
    }
}

/// The budget counts the work: what is found before it ends is right, and the end of the budget is reported.
#[test]
fn a_search_that_is_cut_says_so() {
    let shape = "all i in 0..100: x + 0.01*sin(i)*y*z*x^2 + 0.01*cos(i)*z^2*y <= 5 + i";
    let text = format!("rfm 1\nsolid s = ({shape}) and box([-1, -1, -1], [1, 1, 1]) and x <= 30 and y >= -5");
    let program = Program::from_source("t.rfm", text).unwrap();
    let source = program.module().solids[0].span.source;
    let solid = program.solid("s").unwrap();
    let mut left = usize::MAX;
    let all = solid.idle_operands(source, &mut left);
    assert!(!all.is_cut && all.spans.len() >= 2, "{all:?}");
    let whole = usize::MAX - left;
    for budget in [0, 1000, whole / 2, whole - 1] {
        let found = solid.idle_operands(source, &mut { budget });
        assert!(found.is_cut && (budget > 1000 || found.spans.is_empty()), "{budget} of {whole}: {found:?}");
        assert!(found.spans.iter().all(|span| all.spans.contains(span)));
    }
    assert_eq!(solid.idle_operands(source, &mut { whole }), all);
}

/// A run reports what its fluid meets, once: not again when the run goes on.
#[test]
fn a_run_tells_of_what_its_fluid_meets() {
    for (case, code) in [("no_value_in_the_fluid", "W0418"), ("wall_thinner_than_the_spacing", "W0508")] {
        let folder = tempfile::tempdir().unwrap();
        let file = root().join(format!("tests/cases/scene_error/{case}.rfm"));
        let end = |until: &'static str| {
            let more = if until == "2ms" { &["--resume"][..] } else { &[] };
            let run = ["run", file.to_str().unwrap(), "-o", "out", "--until", until];
            rfm(folder.path(), &[&run, more].concat()).expect(0).stderr
        };
        let at_start = end("1ms");
        assert!(at_start.contains(&format!("warning[{code}]")), "{at_start}");
        let later = end("2ms");
        assert!(!later.contains(code), "{later}");
    }
}

/// A program that embeds the library hears of them as well.
#[test]
fn an_experiment_tells_of_obstacles_that_its_particles_do_not_fit() {
    for (case, code) in [("obstacle_outside_the_box", "W0519"), ("wall_thinner_than_the_spacing", "W0508")] {
        let file = root().join(format!("tests/cases/scene_error/{case}.rfm"));
        let program = Program::from_path(file).unwrap();
        let scene = program.module().scenes[0].name.clone();
        let found = Experiment::new(&program, &scene, Engine::Auto).unwrap().misfits();
        assert!(
            !found.list.is_empty() && found.list.iter().all(|message| message.code.0 == code),
            "{found:?}"
        );
    }
}

#[test]
fn a_vessel_that_is_an_obstacle_is_asked_about() {
    let scene = |vessel: &str, shape: &str| {
        let text = format!(
            "rfm 1\nsolid bowl = sphere(0.5)\nsolid post = sphere(0.1)\nscene s {{\nbox {{ min: [-1, -1, -1], max: [1, 1, 1] }}\n\
             fluid {{ shape: {shape}, particles: 500 }}\nobstacle {{ solid: post }}\n{vessel} {{ solid: bowl }}\n}}\n"
        );
        rfm_reading(root(), &["run", "-", "--dry-run"], text.as_bytes()).stderr
    };
    let told = scene("obstacle", "bowl and z <= 0");
    assert!(
        told.contains("if `bowl` is the vessel that holds the fluid, it is no `obstacle`, but a `container`"),
        "{told}"
    );
    assert!(!scene("container", "bowl and z <= 0").contains("E0502"));
}

/// Each of many obstacles would have a map of the box, but whether the fluid has room is told all the same.
#[test]
fn the_room_among_many_obstacles_is_looked_at() {
    let posts: String = (0..64)
        .map(|k| {
            let at = format!("[{}, {}, 0]", 0.25 * f64::from(k % 8), 0.25 * f64::from(k / 8));
            format!("obstacle {{ solid: cylinder(0.05, 1).move({at}) }}\n")
        })
        .collect();
    for (shape, code) in [
        ("ball([0.25, 0.25, 0.5], 0.04)", "error[E0502]"),
        ("ball([0.25, 0.25, 0.5], 0.06)", "warning[W0501]"),
        ("ball([9, 0, 0], 0.1)", "error[E0304]"),
        ("z <= 0.5", ""),
    ] {
        let text = format!(
            "rfm 1\nscene s {{\nbox {{ min: [-0.1, -0.1, 0], max: [2, 2, 1] }}\n\
             fluid {{ shape: {shape}, particles: 500 }}\n{posts}}}\n"
        );
        let told = rfm_reading(root(), &["check", "-"], text.as_bytes()).stderr;
        assert!(if code.is_empty() { told.is_empty() } else { told.contains(code) }, "{shape}: {told}");
    }
}

/// An outline with an edge on the axis is a surface there once it is turned, wherever the body stands then.
#[test]
fn seams_of_turned_outlines_are_found() {
    let can = "polygon([[0, 0], [0.5, 0], [0.5, 1], [0, 1]]).revolve()";
    for text in
        [can.to_string(), format!("{can}.move([3, 1, 0])"), format!("{can}.rotate_x(90°).move([0, 2, 1])")]
    {
        let solid = solid(&text);
        let at = solid.seam().unwrap_or_else(|| panic!("{text} has none"));
        assert_eq!(solid.omega(at), 0.0, "{text}");
    }
    for sound in [
        "polygon([[-0.1, 0], [0.5, 0], [0.5, 1], [-0.1, 1]]).revolve()",
        "box([0, 0, 0], [1, 1, 1]) or box([1, 0, 0], [2, 1, 1])",
        "sphere(1)",
        "torus(1, 0.25)",
        "cylinder(1, 1) \\ cylinder(0.2, 3).move([0, 0, -1])",
    ] {
        assert_eq!(solid(sound).seam(), None, "{sound}");
    }
}

/// Functions and folds may make equal operands for some arguments and members only.
#[test]
fn equal_operands_are_told_of_where_a_person_has_written_them() {
    let count = |text: &str| {
        let program =
            Program::from_source("t.rfm", format!("rfm 1\n{text}")).unwrap_or_else(|e| panic!("{e}"));
        program.warnings().list.iter().filter(|warning| warning.code.0 == "W0415").count()
    };
    for (text, expected) in [
        ("solid s = sphere(1) or sphere(1)", 1),
        ("solid s = sphere(1) or ball([0, 0, 0], 1)", 1),
        ("solid s = sphere(1) or sphere(1) or sphere(1)", 1),
        ("let a = sphere(1) solid s = box() \\ a \\ a", 1),
        ("solid s = sphere(1) or sphere(0.5)", 0),
        ("solid s = sphere(1) or sphere(1).move([1, 0, 0])", 0),
        ("fn pair(d) = sphere(1) or sphere(1).move([d, 0, 0]) solid s = pair(0) or pair(3)", 0),
        ("solid s = any k in 0..3: sphere(1).move([k, 0, 0]) or sphere(1).move([k*k, 0, 0])", 0),
        ("solid s = any k in 0..3: any l in 0..2: sphere(1).move([k*l, 0, 0])", 0),
        ("solid s = chamfer(sphere(1), sphere(1), 0.1)", 0),
        ("solid s = polygon([[0, 0], [1, 0], [0, 1]]).loft(polygon([[0, 0], [1, 0], [0, 1]]), 0, 1)", 0),
        ("solid s = sphere(1).polar_repeat(4)", 0),
    ] {
        assert_eq!(count(text), expected, "{text}");
    }
}

#[test]
fn only_lofts_of_solids_are_asked_about() {
    let told = |first: &str| {
        let text = format!(
            "rfm 1\nlet square = polygon([[0, 0], [1, 0], [1, 1], [0, 1]]) solid s = {first}.loft(square, 0, 1)"
        );
        let program = Program::from_source("t.rfm", text).unwrap_or_else(|e| panic!("{first}: {e}"));
        program.warnings().list.iter().any(|warning| warning.code.0 == "W0426")
    };
    for outline in [
        "square",
        "square.twist(0.1)",
        "square.taper(1, 0.5)",
        "text(\"R\", 1)",
        "(x^2 + y^2 <= 1 + 0.1*sin(z))",
        "box([0, 0, -1.5], [1, 1, 2.5])",
    ] {
        assert!(!told(outline), "{outline}");
    }
    for solid in [
        "sphere(1)",
        "square.extrude(0, 1)",
        "box([0, 0, 0.2], [1, 1, 0.8])",
        "box([0, 0, -1.5], [1, 1, 1.5])",
    ] {
        assert!(told(solid), "{solid}");
    }
}

/// A ball smaller than the digits of its place is divided by no grid. The other solids of the file are measured.
#[test]
fn a_solid_that_is_next_to_nothing_does_not_hide_the_others() {
    let text = b"rfm 1\nsolid s = ball([0, 0, 0.5], 1e-16)\nsolid d = sphere(1)\n";
    let said = rfm_reading(root(), &["check", "-"], text).expect(0).stdout;
    assert!(said.contains("volume      not found: the room around [0, 0, 0.5] cannot be divided"), "{said}");
    assert!(said.contains("volume      4.18879"), "{said}");
}

#[test]
fn a_volume_that_is_no_number_is_not_called_thin_and_one_of_a_thin_sheet_is_found() {
    let text = b"rfm 1\nsolid s = box([0, 0, 0], [1, 1, 1]) and log10(x) <= 0\n";
    let said = rfm_reading(root(), &["check", "-"], text).expect(0).stdout;
    assert!(said.contains("volume      not found: the field is not a number at (-"), "{said}");
    assert!(!said.contains("thin"), "{said}");
    let sheet = b"rfm 1\nsolid s = box([0, 0, 0], [1, 1, 1]) and abs(x + y + z - 1.234) <= 1e-5\n";
    let said = rfm_reading(root(), &["check", "--json", "-"], sheet).expect(0).json();
    // the density of a sum of three numbers from 0 to 1, times the width of the sheet
    let s = 1.234_f64;
    let exact = 2e-5 * 0.5 * (-2.0 * s * s + 6.0 * s - 3.0);
    let figure = |key: &str| said["solids"][0][key].as_f64().unwrap();
    assert!((figure("volume") - exact).abs() <= figure("volume_error"), "{said} {exact}");
    assert!(figure("volume_error") < 0.01 * exact && figure("lines") > 0.0, "{said}");
}

/// The volume of each solid, and the messages of `rfm check`, of a text.
fn checked(text: &str) -> (Vec<f64>, Vec<serde_json::Value>) {
    let document = rfm_reading(root(), &["check", "-", "--json"], text.as_bytes()).json();
    let volumes =
        document["solids"].as_array().unwrap().iter().map(|solid| solid["volume"].as_f64().unwrap());
    (volumes.collect(), document["diagnostics"].as_array().unwrap().clone())
}

/// Each of the six orders of x, y and z holds in a sixth of the unit cube.
#[test]
fn a_chain_that_holds_in_both_orders_leads_to_the_one_that_is_meant() {
    let coded = |messages: &[serde_json::Value]| -> Vec<serde_json::Value> {
        messages.iter().filter(|message| message["code"] == "W0421").cloned().collect()
    };
    for text in [
        "rfm 1\nsolid s = box() and x <= y <= z\n",
        "rfm 1\nfn steps(e) = z >= e >= x\nsolid s = box() and steps(y)\n",
        "rfm 1\nsolid s = box() \\ not x <= y <= z\n",
    ] {
        let (volumes, messages) = checked(text);
        let [message] = &coded(&messages)[..] else { panic!("{text}: {messages:?}") };
        assert!((volumes[0] - 1.0 / 3.0).abs() < 1e-3, "{volumes:?}");
        let line = text.lines().nth(message["fix"]["line"].as_u64().unwrap() as usize - 1).unwrap();
        let [start, end] =
            ["column", "end_column"].map(|end| message["fix"][end].as_u64().unwrap() as usize - 1);
        let mended = text.replace(&line[start..end], message["fix"]["replacement"].as_str().unwrap());
        let (volumes, messages) = checked(&mended);
        assert!((volumes[0] - 1.0 / 6.0).abs() < 1e-3, "{mended}: {volumes:?}");
        assert!(coded(&messages).is_empty(), "{mended}: {messages:?}");
    }
    // one end is the greater everywhere, or where the other one is the rest of the formula cuts it off
    for text in [
        "rfm 1\nsolid s = box() and x - 0.1 <= y <= x + 0.1\n",
        "rfm 1\nsolid s = cylinder(1, 2) and 0 <= z <= 1 - x^2 - y^2\n",
        "rfm 1\nsolid s = box() and 0 <= z <= 0.5\n",
    ] {
        let (_, messages) = checked(text);
        assert!(coded(&messages).is_empty(), "{text}: {messages:?}");
    }
}

#[test]
fn a_bend_with_the_radius_that_is_proposed_keeps_all_of_its_shape() {
    for (shape, radius) in
        [("box([-1, 0, 0], [1, 1, 0.1])", 0.3), ("box([-1, 0, 0], [1, 1, 1])", 0.5), ("box()", 0.05)]
    {
        let text = |radius: &str| format!("rfm 1\nsolid s = {shape}.bend({radius})\n");
        let (_, messages) = checked(&text(&radius.to_string()));
        let codes: Vec<_> = messages.iter().map(|message| &message["code"]).collect();
        assert_eq!(codes, ["W0428"], "{messages:?}");
        let help = messages[0]["help"].as_str().unwrap();
        let enough = help.split(['(', ')']).nth(1).unwrap();
        let (volumes, messages) = checked(&text(enough));
        assert!(messages.is_empty(), "{messages:?}");
        // the line at half of the height is as long as the arc that it becomes at its distance from the middle
        let (radius, height) =
            (enough.parse::<f64>().unwrap(), if shape.contains("0.1") { 0.1 } else { 1.0 });
        let length = if shape == "box()" { 1.0 } else { 2.0 };
        let expected = length * height * (1.0 - 0.5 * height / radius);
        assert!((volumes[0] - expected).abs() < 1e-3 * expected, "{shape}: {volumes:?}, not {expected}");
    }
}

#[test]
fn omega_that_is_zero_throughout_a_part_of_space_is_told() {
    for (shape, is_flat) in [
        ("clamp(z, -0.2, 0.3) >= z and sphere(1)", true),
        ("abs(z) <= z and sphere(1)", true),
        ("clamp(z, -0.2, 0.3) >= z - 0.01 and sphere(1)", false),
        ("box() and not box([0, 0, 0], [0.5, 1, 1]) or box([0, 0, 0], [0.5, 1, 1])", false),
        ("sphere(1) and not sphere(1)", false),
    ] {
        assert_eq!(solid(shape).flat_room().is_some(), is_flat, "{shape}");
    }
}

/// The support radius that is stated against the one that the method takes of itself.
#[test]
fn a_support_radius_far_beyond_that_of_the_method_is_asked_about() {
    let scene = |fluid: &str| {
        let text = format!(
            "rfm 1\nscene s {{\n  box {{ max: [1, 1, 1] }}\n  fluid {{ shape: z <= 0.5, spacing: 0.1{fluid} }}\n}}\n"
        );
        let program = Program::from_source("t.rfm", text).unwrap_or_else(|e| panic!("{e}"));
        Experiment::new(&program, "s", Engine::Auto).unwrap_or_else(|e| panic!("{e}"))
    };
    let usual = scene("").parameters().support_radius;
    for (factor, is_wide) in [(1.0, false), (2.4, false), (2.6, true)] {
        let experiment = scene(&format!(", support_radius: {}", factor * usual));
        let warnings = experiment.warnings();
        let found = warnings.list.iter().find(|warning| warning.code.0 == "W0529");
        assert_eq!(found.is_some(), is_wide, "{factor}: {warnings}");
        if let Some(found) = found {
            assert!(found.message.contains("2.6 times"), "{warnings}");
            let proposed = found.help.as_ref().unwrap().trim_end_matches(" m").rsplit(' ').next().unwrap();
            assert!((proposed.parse::<f64>().unwrap() / usual - 1.0).abs() < 0.05, "{warnings}");
        }
    }
}
