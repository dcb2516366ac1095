//! Sharp meshes do not cross themselves. The test of pairs is independent of the mesher's own: it works on
//! whole numbers, so its answers are exact for the mesh with its coordinates rounded to 2⁻³⁶ of its extent, and
//! it finds neighbours by sweeping along x.

use proptest::test_runner::TestRunner;
use rfm::geom::Aabb;
use rfm::mesh::{Grid, Mesh, Resolution, dual_contouring, self_intersections};
use rfm::{Engine, Program, Solid};

use super::mesh_properties::{DOMAIN, config, csg, solid as random_solid};

type Point = [i128; 3];

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The sign of the volume of a tetrahedron.
fn orientation([a, b, c, d]: [Point; 4]) -> i128 {
    let [u, v, w] = [minus(b, a), minus(c, a), minus(d, a)];
    let minor = |i: usize, j: usize| v[i] * w[j] - v[j] * w[i];
    (u[0] * minor(1, 2) + u[1] * minor(2, 0) + u[2] * minor(0, 1)).signum()
}

/// Whether a side of one triangle passes through the inside of another.
fn pierces(of: [Point; 3], other: [Point; 3]) -> bool {
    let [a, b, c] = other;
    (0..3).any(|i| {
        let (p, q) = (of[i], of[(i + 1) % 3]);
        let through = orientation([a, b, c, p]) * orientation([a, b, c, q]) < 0;
        let around = [(a, b), (b, c), (c, a)].map(|(from, to)| orientation([p, q, from, to]));
        through && around[0] != 0 && around.iter().all(|side| *side == around[0])
    })
}

/// Whether two triangles in one plane have inner points in common.
fn overlap_in_plane(s: [Point; 3], t: [Point; 3]) -> bool {
    let [u, v] = [minus(s[1], s[0]), minus(s[2], s[0])];
    let normal =
        [0, 1, 2].map(|i: usize| (u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]).abs());
    let largest = (0..3).max_by_key(|&i| normal[i]).unwrap();
    if normal[largest] == 0 {
        return false;
    }
    let (x, y) = ((largest + 1) % 3, (largest + 2) % 3);
    let turn = |a: Point, b: Point, c: Point| {
        ((b[x] - a[x]) * (c[y] - a[y]) - (b[y] - a[y]) * (c[x] - a[x])).signum()
    };
    let parts = |of: [Point; 3], from: [Point; 3]| {
        let way = turn(of[0], of[1], of[2]);
        way == 0 || (0..3).any(|i| from.iter().all(|p| way * turn(of[i], of[(i + 1) % 3], *p) <= 0))
    };
    !parts(s, t) && !parts(t, s)
}

fn cross(s: [Point; 3], t: [Point; 3]) -> bool {
    if t.iter().all(|p| orientation([s[0], s[1], s[2], *p]) == 0) {
        return overlap_in_plane(s, t);
    }
    pierces(s, t) || pierces(t, s)
}

/// The number of pairs of triangles that cross.
fn crossings(mesh: &Mesh) -> usize {
    let bounds = mesh.positions.iter().fold(Aabb::EMPTY, |bounds, p| bounds.including(*p));
    let scale = 2_f64.powi(36) / bounds.size().max_element();
    let points: Vec<Point> = mesh
        .positions
        .iter()
        .map(|p| (scale * (*p - bounds.min)).round().to_array().map(|x| x as i128))
        .collect();
    let triangles: Vec<[Point; 3]> = mesh.triangles.iter().map(|t| t.map(|v| points[v as usize])).collect();
    let low = |t: &[Point; 3], axis: usize| t.iter().map(|p| p[axis]).min().unwrap();
    let high = |t: &[Point; 3], axis: usize| t.iter().map(|p| p[axis]).max().unwrap();
    let mut order: Vec<(i128, usize)> = triangles.iter().enumerate().map(|(i, t)| (low(t, 0), i)).collect();
    order.sort_unstable();
    let mut found = 0;
    for (place, &(_, i)) in order.iter().enumerate() {
        let (t, end) = (&triangles[i], high(&triangles[i], 0));
        for &(begin, j) in &order[place + 1..] {
            if begin > end {
                break;
            }
            let other = &triangles[j];
            let apart = |axis| low(t, axis) > high(other, axis) || low(other, axis) > high(t, axis);
            found += usize::from(!apart(1) && !apart(2) && cross(*t, *other));
        }
    }
    found
}

fn solid(text: &str) -> Solid {
    let program = Program::from_source("t.rfm", format!("rfm 1\n{text}")).unwrap_or_else(|e| panic!("{e}"));
    let name = program.module().solids.last().unwrap().name.clone();
    program.solid_with(&name, Engine::Auto).unwrap()
}

fn sharp(solid: &Solid, cells: usize) -> Mesh {
    let bounds = solid.bounds().aabb().unwrap();
    let grid = Grid::around(&bounds, Resolution::Cells(cells)).unwrap();
    dual_contouring(&*solid.surface(*grid.bounds()), &grid, &|_| {}).unwrap()
}

#[track_caller]
fn check(name: &str, solid: &Solid, cells: usize) {
    let mesh = sharp(solid, cells);
    assert_eq!(crossings(&mesh), 0, "{name}, {cells} cells");
    assert_eq!(self_intersections(&mesh), [[0; 2]; 0], "{name}, {cells} cells: the mesher's own test");
}

/// Both tests agree on a mesh that crosses itself: two boxes as one mesh.
#[test]
fn both_tests_find_the_crossings_of_two_boxes() {
    let mut mesh = sharp(&solid("solid s = box([-1, -1, -1], [1, 1, 1])"), 6);
    let other = sharp(
        &solid("solid s = box([-1, -1, -1], [1, 1, 1]).rotate(0.5, [1, 2, 3]).move([0.7, 0.2, 0.3])"),
        7,
    );
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(other.positions);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    let found = crossings(&mesh);
    assert!(found > 20, "{found}");
    assert_eq!(self_intersections(&mesh).len(), found);
    mesh.triangles.swap(0, 1);
    let [a, b, c] = mesh.triangles[0];
    mesh.triangles.push([a, c, b]);
    mesh.triangles.push([a, b, c]);
    assert!(crossings(&mesh) >= found + 3, "triangles that lie on one another");
}

const GEAR: &str =
    "solid s = cylinder(1, 0.3) or any i in 0..60: box([0.95, -0.03, 0], [1.1, 0.03, 0.3]).rotate_z(i*6 deg)";
const PRODUCT: &str =
    "solid s = x*y*z*(x - 0.3)*(y + 0.2)*(z - 0.4) >= 0.001 and box([-1, -1, -1], [1, 1, 1])";

#[test]
fn examples_do_not_cross_themselves() {
    let folder = format!("{}/examples", env!("CARGO_MANIFEST_DIR"));
    let mut meshed = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "rfm") {
            continue;
        }
        let program = Program::from_path(&path).unwrap_or_else(|e| panic!("{e}"));
        for named in &program.module().solids {
            let solid = program.solid_with(&named.name, Engine::Auto).unwrap();
            if solid.bounds().aabb().is_none() {
                continue;
            }
            for cells in [16, 40, 64] {
                check(&format!("{} of {}", named.name, path.display()), &solid, cells);
                meshed += 1;
            }
        }
    }
    assert!(meshed >= 15, "{meshed}");
}

#[test]
fn coarse_products_shells_and_gears_do_not_cross_themselves() {
    for (name, text, list) in [
        ("product", PRODUCT, &[16, 31, 64][..]),
        ("shell", "solid s = sphere(1) \\ sphere(0.985)", &[16, 32, 48]),
        ("gear", GEAR, &[16, 32, 48, 64, 96, 128]),
        (
            "nut",
            "solid s = (all i in 0..6: half_space([1, 0, 0], [1, 0, 0]).rotate_z(i*60 deg)) and 0 <= z <= 0.5 \\ cylinder(0.5, 0.5)",
            &[24, 64, 128],
        ),
    ] {
        let solid = solid(text);
        list.iter().for_each(|&cells| check(name, &solid, cells));
    }
}

fn random_solids(count: u32) {
    let mut runner = TestRunner::new(config(count));
    let result = runner.run(&(csg(), proptest::bool::ANY, 8..28_usize), |(text, is_cut, cells)| {
        let field = random_solid(&text, is_cut);
        let grid = Grid::filling(&DOMAIN, Resolution::Cells(cells)).unwrap();
        let mesh = dual_contouring(&*field.surface(DOMAIN), &grid, &|_| ()).unwrap();
        let found = crossings(&mesh);
        proptest::prop_assert_eq!(found, 0, "{} pairs, {} cells, {}", found, cells, text);
        Ok(())
    });
    result.unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn random_solids_do_not_cross_themselves() {
    random_solids(60);
}

#[test]
#[ignore = "takes minutes"]
fn a_thousand_random_solids_do_not_cross_themselves() {
    random_solids(1000);
}
