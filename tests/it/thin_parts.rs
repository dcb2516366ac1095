//! Parts and gaps thinner than a cell are shown by the mesh or counted, wherever they are, and nothing else is
//! counted.

use rfm::glam::DVec3;
use rfm::mesh::{Grid, Mesh, Resolution, ThinCells, Unwatched, marching_cubes, thin_cells};
use rfm::{Engine, Program, Solid};

use crate::random::Random;
use crate::tool::{rfm_reading, root};

fn solid(text: &str) -> Solid {
    let program = Program::from_source("t.rfm", format!("rfm 1\nsolid s = {text}"));
    program.unwrap_or_else(|e| panic!("{text}: {e}")).solid_with("s", Engine::Auto).unwrap()
}

fn looked_at(solid: &Solid, cells: usize) -> (Mesh, ThinCells) {
    let grid = Grid::around(&solid.bounds().aabb().unwrap(), Resolution::Cells(cells)).unwrap();
    let field = solid.surface(*grid.bounds());
    (marching_cubes(&*field, &grid, &Unwatched).unwrap(), thin_cells(&*field, &grid, &Unwatched).unwrap())
}

/// How often the mesh goes around a point, by the solid angles of its triangles (van Oosterom and Strackee,
/// IEEE Trans. Biomed. Eng. 30, 1983).
fn turns(mesh: &Mesh, p: DVec3) -> f64 {
    let angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize] - p);
        let [la, lb, lc] = [a, b, c].map(|v| v.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    mesh.triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

#[test]
fn tips_and_rims_of_what_the_grid_shows_are_told_from_thin_parts() {
    // a tip between four faces, a rim of 23°, the horns of a crescent, a wedge of 11°, a cusp; rims of 27° in a ring that
    // its sides cut off
    for text in [
        "abs(x)/2 + abs(y) + abs(z)/3 <= 1",
        "sphere(5).move([0, 0, -4.9]) and sphere(5).move([0, 0, 4.9])",
        "sphere(1) \\ sphere(1).move([0.2, 0, 0])",
        "box([0, 0, 0], [1, 1, 1]) and 5*z <= x",
        "4*(x^2 + y^2) <= (1 + z)*(1 - z)^3 and abs(z) <= 1",
        "cylinder(26.5, 8).move([0, 0, -4]) \\ cylinder(23.5, 10).move([0, 0, -5]) \\ \
         sphere(4.5).move([25, 0, 0]).polar_repeat(9)",
    ] {
        let (_, thin) = looked_at(&solid(text), 96);
        assert!(thin.count > 0 && thin.is_wedge && !thin.ended, "{text}: {thin:?}");
    }
    // half a ball and a plate on a ball, and a needle
    for text in [
        "sphere(1) or ball([1, 0, 0], 0.006)",
        "sphere(1) or box([-0.3, -0.003, 0.9], [0.3, 0.003, 1.1])",
        "cone(0.01, 3).rotate([1, 0.2, 0.3], 1.3) or sphere(0.3)",
    ] {
        let (_, thin) = looked_at(&solid(text), 96);
        assert!(thin.count > 0 && !thin.is_wedge, "{text}: {thin:?}");
    }
}

impl Random {
    fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::from_array([(); 3].map(|()| self.within(-1.0, 1.0)));
            if (0.1..1.0).contains(&v.length()) {
                return v.normalize();
            }
        }
    }
}

const CELLS: usize = 32;

/// A solid with one feature, and points of the feature with whether they lie inside.
struct Feature {
    text: String,
    points: Vec<(DVec3, bool)>,
}

fn moved_along(shape: &str, way: DVec3) -> String {
    // the z axis turned to `way`
    let (tilt, turn) = (way.z.acos(), way.y.atan2(way.x));
    format!("{shape}.rotate_y({tilt}).rotate_z({turn})")
}

fn feature(kind: &str, random: &mut Random) -> Feature {
    // 0.1 to 2 cells of a ball of radius 1
    let size = 2.0 / (CELLS as f64 - 1.4) * 0.1 * 20_f64.powf(random.unit());
    let (way, half) = (random.direction(), 0.5 * size);
    match kind {
        "bump" => {
            let centre = random.within(1.0 - 0.2 * half, 1.0 + 0.9 * half) * way;
            let [x, y, z] = centre.to_array();
            Feature {
                text: format!("sphere(1) or ball([{x}, {y}, {z}], {half})"),
                points: vec![(centre + 0.6 * half * way, true)],
            }
        }
        "spike" => {
            let spike = moved_along(&format!("cylinder({half}, 1.2)"), way);
            Feature {
                text: format!("sphere(1) or {spike}"),
                points: [1.05, 1.1, 1.15].map(|r| (r * way, true)).to_vec(),
            }
        }
        "tunnel" => {
            let tunnel = moved_along(&format!("cylinder({half}, 4).move([0, 0, -2])"), way);
            Feature {
                text: format!("sphere(1) \\ {tunnel}"),
                points: [-0.9, -0.31, 0.37, 0.83].map(|r| (r * way, false)).to_vec(),
            }
        }
        "slit" => {
            let depth = random.within(0.2, 0.6);
            let slit = moved_along(&format!("box([-{half}, -0.5, {depth}], [{half}, 0.5, 2])"), way);
            // the slit's broad side after the turns
            let turn = way.y.atan2(way.x);
            let broad = DVec3::new(-turn.sin(), turn.cos(), 0.0);
            let points = [(-0.3, 0.75), (0.0, 0.8), (0.2, 0.9)];
            Feature {
                text: format!("sphere(1) \\ {slit}"),
                points: points.map(|(a, r)| (a * broad + r * way, false)).to_vec(),
            }
        }
        "shell" => Feature {
            text: format!("sphere(1) \\ sphere({})", 1.0 - size),
            points: (0..12).map(|_| ((1.0 - half) * random.direction(), true)).collect(),
        },
        _ => unreachable!("{kind}"),
    }
}

/// Features that the mesh does not show and that were not counted.
fn missed(count: u64) -> Vec<String> {
    let mut missed = Vec::new();
    for kind in ["bump", "spike", "tunnel", "slit", "shell"] {
        let (mut shown, mut counted) = (0, 0);
        for number in 0..count {
            let mut random = Random(1000 * number + kind.len() as u64);
            (0..5).for_each(|_| _ = random.unit());
            let Feature { text, points } = feature(kind, &mut random);
            let (mesh, thin) = looked_at(&solid(&text), CELLS);
            if thin.count > 0 {
                counted += 1;
            } else if points.iter().all(|&(p, inside)| (turns(&mesh, p) > 0.5) == inside) {
                shown += 1;
            } else {
                missed.push(format!("{kind} {number}: {text}"));
            }
        }
        println!("{kind}: {counted} counted, {shown} shown, of {count}");
        assert!(counted * 4 >= count, "{kind}: most are thinner than a cell, and {counted} were counted");
    }
    missed
}

#[test]
#[ignore = "long"]
fn random_thin_features_are_shown_or_counted() {
    assert_eq!(missed(25), Vec::<String>::new());
}

#[test]
#[ignore = "takes minutes"]
fn study_of_a_thousand_thin_features_of_each_kind() {
    assert_eq!(missed(1000), Vec::<String>::new());
}

#[test]
fn what_hides_has_a_place_and_a_thickness() {
    for cells in [32, 64, 96] {
        let (_, bump) = looked_at(&solid("sphere(1) or sphere(0.012).move([0.601, 0, 0.8])"), cells);
        assert!(bump.count > 0 && bump.at.distance(DVec3::new(0.601, 0.0, 0.8)) < 0.013, "{cells}: {bump:?}");
        assert!(bump.thickness < 0.026, "{cells}: {bump:?}");
        let (_, spike) = looked_at(&solid("sphere(1) or cylinder(0.01, 1.05).rotate_x(0.3)"), cells);
        let tip = DVec3::new(0.0, -0.3_f64.sin(), 0.3_f64.cos());
        assert!(spike.count > 0 && spike.at.distance(1.02 * tip) < 0.1, "{cells}: {spike:?}");
        // it is measured across the spike, or aslant where its rim is near
        assert!((0.009..0.025).contains(&spike.thickness) && !spike.is_gap, "{cells}: {spike:?}");
    }
    let (_, shell) = looked_at(&solid("sphere(1) \\ sphere(0.985)"), 64);
    assert!(shell.count > 100 && (shell.thickness - 0.015).abs() < 0.001 && !shell.is_gap, "{shell:?}");
    let (_, slit) = looked_at(&solid("sphere(1) \\ box([0.1, -2, -2], [0.107, 2, 2])"), 48);
    assert!(slit.count > 100 && (slit.thickness - 0.007).abs() < 0.001 && slit.is_gap, "{slit:?}");
}

/// Slits, films, foils, bumps and voids of a millionth of the solid. (Newton's method halves its way to what is so thin, and
/// was ended after eight steps.)
#[test]
fn parts_of_a_millionth_are_counted() {
    let cube = "box([-1, -1, -1], [1, 1, 1])";
    for text in [
        format!("{cube} \\ box([0.3, -2, -2], [0.300003, 2, 2])"),
        format!("{cube} or box([-0.5, -0.5, 1.2], [0.5, 0.5, 1.200001])"),
        "cylinder(1, 2) \\ layer(z, 1, 1.000001)".to_string(),
        "sphere(1) \\ layer(x, 0.3, 0.300001)".to_string(),
        "sphere(1) or sphere(1e-5).move([0.6, 0, 0.800001])".to_string(),
        "sphere(1) \\ sphere(1e-5).move([0.31, 0.22, 0.13])".to_string(),
    ] {
        let (_, thin) = looked_at(&solid(&text), 96);
        println!("{text}: {} cells, {:.1e} m", thin.count, thin.thickness);
        assert!(thin.count > 0, "{text}");
    }
}

#[test]
fn faces_that_coincide_and_smooth_surfaces_hide_nothing() {
    let nut = "(all i in 0..6: half_space([1, 0, 0], [1, 0, 0]).rotate_z(i*60 deg)) and 0 <= z <= 0.5 \\ cylinder(0.5, 0.5)";
    let spillway = "any i in 0..6: box([i*0.3, 0, 0], [(i + 1)*0.3, 1, (6 - i)*0.2])";
    let square = "-y^2 <= 0 and box([-1, -1, -1], [1, 1, 1])";
    let gear = "hypot(x, y) <= 1 + 0.05*sin(12*atan2(y, x)) and 0 <= z <= 0.3";
    for text in [nut, spillway, square, gear, "torus(0.8, 0.25)", "cone(0.5, 1)"] {
        let solid = solid(text);
        for cells in [40, 64] {
            let (_, thin) = looked_at(&solid, cells);
            assert_eq!(thin.count, 0, "{text}, {cells} cells: {thin:?}");
        }
    }
}

/// No grid shows all of a wedge: it is counted, and distinguished from a wall. Its volume is measured all the
/// same.
#[test]
fn wedges_are_told_from_walls() {
    let (_, wedge) = looked_at(&solid("polygon([[0, 0], [1, 0], [1, 0.577]]).extrude(0, 1)"), 96);
    assert!(wedge.count > 0 && wedge.is_wedge, "{wedge:?}");
    let (_, wall) =
        looked_at(&solid("box([0, 0, 0], [1, 0.003, 1]).rotate_z(0.2) or sphere(0.4).move([2, 0, 0])"), 48);
    assert!(wall.count > 0 && !wall.is_wedge && (wall.thickness - 0.003).abs() < 1e-6, "{wall:?}");
    // a ridge of 22° on a plate, all of it thinner than a cell, is no edge of what the grid shows
    let ridge = "box([0, 0, 0], [1, 1, 0.1]) or polygon([[0.3, 0.1], [0.304, 0.1], [0.302, 0.11]]).extrude(-0.9, -0.1).rotate_x(90 deg)";
    let (_, ridge) = looked_at(&solid(ridge), 96);
    assert!(ridge.count > 0 && !ridge.is_wedge, "{ridge:?}");
    // nor is a wire along a plate
    let wire =
        "box([0, 0, 0], [1, 1, 0.1]) or cylinder(0.002, 0.8).rotate_y(90 deg).move([0.1, 0.437, 0.107])";
    let (_, wire) = looked_at(&solid(wire), 96);
    assert!(wire.count > 0 && !wire.is_wedge, "{wire:?}");
    // where there are both, the wall is reported
    let both = "polygon([[0, 0], [1, 0], [1, 0.577]]).extrude(0, 1) or box([0, 1, 0], [1, 1.003, 1])";
    let (_, both) = looked_at(&solid(both), 48);
    assert!(!both.is_wedge && (both.thickness - 0.003).abs() < 1e-6, "{both:?}");
}

/// The search for thin parts follows slopes, and a choice has none where it jumps. What lines do not confirm is no
/// figure of `check`, and what they do not meet is within its error.
#[test]
#[ignore = "long"]
fn what_a_choice_cuts_out_is_measured_within_the_error() {
    for (solid, exact) in [
        ("if abs(x - 0.3) <= 0.004 then -1 else box([-1, -1, -1], [1, 1, 1])", 8.0 - 0.008 * 4.0),
        ("box([-1, -1, -1], [1, 1, 1]) and 1 - 2*(step(0.1, x) - step(0.102, x)) >= 0", 8.0 - 0.002 * 4.0),
        (
            "if (x - 0.3)^2 + (y - 0.2)^2 <= 0.04^2 then -1 else box([-1, -1, -1], [1, 1, 1])",
            8.0 - 2.0 * std::f64::consts::PI * 0.04 * 0.04,
        ),
    ] {
        let text = format!("rfm 1\nsolid s = {solid}\n");
        let found = rfm_reading(root(), &["check", "--json", "-"], text.as_bytes()).expect(0).json();
        let figure = |key: &str| found["solids"][0][key].as_f64().unwrap();
        let off = (figure("volume") - exact).abs();
        assert!(off <= figure("volume_error") && figure("volume_error") < 0.01, "{found}, {exact}");
    }
}

/// Plates as thin as the cells, some of which coarser meshes miss, are measured with more of them.
#[test]
fn plates_that_coarse_meshes_miss_are_measured_with_more_cells() {
    let text = b"rfm 1\nsolid plates = box([0, -0.1, 0], [8, 0, 1]) or box([0, 1, 0], [8, 1.1, 1])";
    let document = rfm_reading(root(), &["check", "--json", "-"], text).expect(0).json();
    let solid = &document["solids"][0];
    assert!((solid["volume"].as_f64().unwrap() - 1.6).abs() < 1e-9, "{solid}");
    assert!(solid["volume_error"].as_f64().unwrap() < 1e-3, "{solid}");
    assert_eq!(solid["components"], 2, "{solid}");
}

/// A gap that cells do not show divides a solid for nobody who counts its parts by them.
#[test]
fn components_are_those_of_cells_where_gaps_are_not_resolved() {
    let text = b"rfm 1\nsolid rings = cylinder(1, 0.3) \\ cylinder(0.6, 1).move([0, 0, -0.5]) or cylinder(0.595, 0.3)";
    let outcome = rfm_reading(root(), &["check", "-"], text).expect(0);
    assert!(outcome.stdout.contains("components  1 of what 96 cells show"), "{}", outcome.stdout);
    let solid = &rfm_reading(root(), &["check", "--json", "-"], text).expect(0).json()["solids"][0];
    assert_eq!((&solid["resolved"], &solid["components"]), (&false.into(), &1.into()), "{solid}");
}

/// Two wedges that meet along the diagonal of a ball are measured along lines, and each is a sixth of it.
#[test]
fn edges_on_a_diagonal_are_measured_within_the_error() {
    for radius in [1.0, 2.0] {
        let text = format!("rfm 1\nsolid wedges = x <= y <= z and sphere({radius})");
        let document = rfm_reading(root(), &["check", "--json", "-"], text.as_bytes()).expect(0).json();
        let solid = &document["solids"][0];
        let [volume, error] = ["volume", "volume_error"].map(|key| solid[key].as_f64().unwrap());
        let exact = 4.0 / 9.0 * std::f64::consts::PI * f64::powi(radius, 3);
        assert!((volume - exact).abs() <= error && error < 2e-3 * exact, "{volume} ± {error}, {exact}");
    }
}

/// Where no range of a formula is known, each cell would be divided to the end.
#[test]
fn thin_parts_are_not_looked_for_without_ranges() {
    let text =
        b"rfm 1\nsolid joint = blend(sphere(1), box(), 0.2).offset(0.1) and box([-2, -2, -2], [2, 2, 2])";
    let outcome = rfm_reading(root(), &["mesh", "--json", "--cells", "16", "-"], text).expect(0);
    assert!(outcome.stderr.contains("the ranges of its formula are unknown"), "{}", outcome.stderr);
    assert!(outcome.json()["thin_cells"].is_null(), "{}", outcome.stdout);
}
