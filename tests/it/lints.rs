//! What `rfm check` calls odd is odd by geometry, and what is not is left alone.

use rfm::glam::DVec3;
use rfm::solid::Breakage;
use rfm::{Engine, Program, Solid};

use crate::tool::{rfm, root};

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
    solid.idle_operands(source).iter().map(|span| text[span.range()].to_string()).collect()
}

/// A small generator (Knuth's linear congruence).
struct Random(u64);

impl Random {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }
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
    // what lies in an operand that may go is not told of again
    assert_eq!(idle("sphere(1) and (sphere(2) and sphere(1.5) or x <= -5)").len(), 1);
    assert_eq!(idle("sphere(2) and (x <= 3 or y <= 3)"), ["(x <= 3 or y <= 3)"]);
    assert_eq!(idle("box([0, 0, 0], [1, 1, 1]) and x <= 1.5"), ["x <= 1.5"]);
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

#[test]
fn what_has_no_value_outside_is_found() {
    let singular = |text: &str| -> Vec<(Breakage, DVec3)> {
        let solid = solid(text);
        let over = solid.bounds().aabb().expect(text).grown(1.0);
        solid.singularities(&over).iter().map(|found| (found.what, found.at)).collect()
    };
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
        let [wall, gap] = plate.thinner_than(1.05 * t, 1.05 * t);
        let wall = wall.expect("a plate");
        assert!((wall.thickness / t - 1.0).abs() < 1e-6, "{} {t}", wall.thickness);
        assert!((wall.area / 4.0 - 1.0).abs() < 0.15, "{}", wall.area);
        assert_eq!(gap, None);
        assert_eq!(plate.thinner_than(0.95 * t, 0.95 * t), [None; 2]);
        let slot = solid(&format!(
            "(box([-1, -1, {}], [1, 1, {}]) or box([-1, -1, {}], [1, 1, {}])).{turn}",
            t,
            t + 0.7,
            -0.7,
            0.0
        ));
        let [wall, gap] = slot.thinner_than(0.5, 1.05 * t);
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
        assert_eq!(solid(text).thinner_than(0.15, 0.15), [None; 2], "{text}");
    }
}

/// What is measured and compared with known solutions has nothing odd.
#[test]
fn flows_that_are_validated_check_without_a_word() {
    for entry in std::fs::read_dir(root().join("examples/validation")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "rfm") {
            let outcome = rfm(root(), &["check", "--deny", "warnings", path.to_str().unwrap()]).expect(0);
            assert_eq!(outcome.stderr, "", "{}", path.display());
        }
    }
}
