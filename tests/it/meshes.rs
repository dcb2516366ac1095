//! Meshes of compiled solids: vertices on the surface, normals, volumes, hidden parts.

use std::f64::consts::PI;

use rfm::field::{Closures, Field};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::mesh::{
    Grid, Mesh, Quality, Resolution, Unwatched, check, dual_contouring, marching_cubes, measure, thin_cells,
    volume,
};
use rfm::solid::Depth;
use rfm::{Engine, Program, Solid};

fn solid(text: &str, name: &str) -> Solid {
    let program = Program::from_source("t.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    program.solid_with(name, Engine::Auto).unwrap()
}

fn example(name: &str) -> Solid {
    let path = format!("{}/examples/{name}.rfm", env!("CARGO_MANIFEST_DIR"));
    solid(&std::fs::read_to_string(path).unwrap(), name)
}

fn mesh(solid: &Solid, grid: &Grid) -> Mesh {
    marching_cubes(&*solid.surface(*grid.bounds()), grid, &Unwatched).unwrap()
}

fn around(solid: &Solid, cells: usize) -> Grid {
    Grid::around(&solid.bounds().aabb().unwrap(), Resolution::Cells(cells)).unwrap()
}

/// The contact program knows nothing of the mesher. At an edge it gives the mean of two normals, while the
/// mesher gives one of them.
#[test]
fn vertices_lie_on_the_surface_and_normals_are_those_of_the_contact_program() {
    for name in ["pawn", "bishop"] {
        let solid = example(name);
        let mesh = mesh(&solid, &around(&solid, 64));
        let mut at_edges = 0;
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            let contact = solid.contact(*p);
            assert!(
                contact.distance.abs() <= 1e-12 * p.abs().max_element(),
                "{name} at {p}: {}",
                contact.distance
            );
            at_edges += usize::from((contact.normal - *n).length() > 1e-9);
        }
        assert!(at_edges * 20 < mesh.positions.len(), "{name}: {at_edges} of {}", mesh.positions.len());
    }
}

/// The domain of the examples' scenes.
const DOMAIN: Aabb = Aabb { min: DVec3::ZERO, max: DVec3::splat(3.0) };

/// A sharp mesh of an example in its domain, measured both ways against the contact program's distance.
fn sharp(name: &str, cells: usize) -> Quality {
    let solid = example(name);
    let field = solid.surface(DOMAIN);
    let distance = Closures {
        omega: |p: DVec3| -solid.contact(p).distance,
        gradient: |p: DVec3| -solid.contact(p).normal,
    };
    let grid = Grid::filling(&DOMAIN, Resolution::Cells(cells)).unwrap();
    let mesh = dual_contouring(&*field, &grid, &Unwatched).unwrap();
    let report = check(&mesh, &*field);
    assert!(report.closed && report.manifold, "{name}, {cells} cells: {report:?}");
    measure(&mesh, &*field, &distance, &grid).unwrap()
}

#[test]
#[ignore = "long"]
fn sharp_meshes_of_pawn_and_bishop_are_within_a_small_part_of_a_cell() {
    for name in ["pawn", "bishop"] {
        for (cells, most) in [(128, 1.5e-3), (256, 4e-4)] {
            let quality = sharp(name, cells);
            assert!(quality.hausdorff() <= most, "{name}, {cells} cells: {quality:?}");
            assert_eq!(quality.flipped, 0, "{name}, {cells} cells: {quality:?}");
        }
    }
}

/// The collars are 0.158 m and 0.2 m thick on the axis and thin out towards their rims; the gaps between
/// collar and head thin out towards their bottoms. With 32 cells and more, the edges beside them show what
/// the nodes do not see, and a tenth of a cell is left where a gap is narrower than that. With fewer cells
/// (0.19 m down to 0.125 m) whole cells of a rim lie between nodes: part of the rim is cut off, and at 16
/// cells a few triangles turn their backs to the faces that were missed.
#[test]
fn sharp_meshes_keep_to_thin_collars_on_coarse_grids() {
    for name in ["pawn", "bishop"] {
        for (cells, most, flipped) in [
            (16, 1.0, 4),
            (20, 0.5, 0),
            (24, 0.35, 0),
            (32, 0.12, 0),
            (40, 0.12, 0),
            (48, 0.12, 0),
            (64, 0.12, 0),
        ] {
            let quality = sharp(name, cells);
            let share = quality.hausdorff() / (3.0 / cells as f64);
            println!("{name}, {cells} cells: {share:.3} cells, {} folded", quality.flipped);
            assert!(share <= most, "{name}, {cells} cells: {share} cells, {quality:?}");
            assert!(quality.flipped <= flipped, "{name}, {cells} cells: {quality:?}");
        }
    }
}

/// True volumes by quadrature of the profiles, independent of this program.
#[test]
fn volumes_of_pawn_and_bishop_converge_with_the_square_of_the_cell() {
    for (name, truth) in [("pawn", 0.442701), ("bishop", 0.601689)] {
        let solid = example(name);
        let error = |cells| {
            let grid = around(&solid, cells);
            (check(&mesh(&solid, &grid), &solid.twin()).volume / truth - 1.0).abs()
        };
        let [coarse, fine] = [64, 256].map(error);
        println!("{name}: {coarse:.2e} at 64 cells, {fine:.2e} at 256");
        assert!(fine <= 5e-4, "{name}: {fine}");
        // sixteen times smaller, but for what creases do between nodes
        assert!(coarse > 10.0 * fine, "{name}: {coarse} and {fine}");
    }
}

#[test]
fn walls_and_gaps_thinner_than_a_cell_are_counted_and_thick_ones_are_not() {
    let thin = |text: &str, cells: usize| {
        let solid = solid(&format!("rfm 1\nsolid s = {text}"), "s");
        let domain = Aabb::new(DVec3::splat(-1.53), DVec3::splat(1.57));
        let grid = Grid::filling(&domain, Resolution::Cells(cells)).unwrap();
        thin_cells(&*solid.surface(domain), &grid, &Unwatched).unwrap().count
    };
    assert_eq!(thin("sphere(1)", 40), 0);
    assert_eq!(thin("sphere(1) and -0.5 <= z <= 0.5", 40), 0);
    let plate = "sphere(1) and 0 <= z <= 0.001";
    assert!(thin(plate, 40) > 100, "a plate between two planes of nodes");
    assert!(thin("sphere(1) and not (x <= 0.001 and x >= 0)", 40) > 100, "a gap");
    assert_eq!(thin("sphere(1) or not sphere(1)", 40), 0, "a crack without width hides nothing");
    for name in ["pawn", "bishop"] {
        let solid = example(name);
        assert_eq!(thin_cells(&solid.twin(), &around(&solid, 96), &Unwatched).unwrap().count, 0, "{name}");
    }
}

/// Near the surface of a solid of many leaves the depth is found by those nearby, and is the same.
#[test]
fn depths_by_the_leaves_nearby_are_those_by_all() {
    let text = "rfm 1\nsolid s = box([-0.1, -0.1, -0.1], [1.1, 1.1, 0.6]) \\ any i in 0..40: ball([random(1, i), random(2, i), random(3, i)], 0.1)";
    let solid = solid(text, "s");
    assert!(solid.has_many_leaves());
    let grid = around(&solid, 24);
    let mesh = dual_contouring(&*solid.surface(*grid.bounds()), &grid, &Unwatched).unwrap();
    let near = solid.depth(*grid.bounds(), grid.spacing().x);
    let (mut worst, mut tried) = (0.0_f64, 0);
    for (k, p) in mesh.positions.iter().enumerate() {
        let p = *p + 0.3 * grid.spacing().x * (k as f64).sin() * mesh.normals[k];
        let (all, by_all) = Depth(&solid).omega_grad(p);
        let (some, by_some) = near.omega_grad(p);
        // beside an edge two faces may be as near
        if by_all.distance(by_some) < 1e-6 {
            worst = worst.max((all - some).abs());
            tried += 1;
        }
    }
    assert!(
        worst < 1e-12 && tried * 100 > 99 * mesh.positions.len(),
        "{worst} {tried} of {}",
        mesh.positions.len()
    );
}

/// Text, volume and area of shapes at several places and sizes.
fn known_shapes() -> Vec<(String, f64, f64)> {
    let mut shapes = Vec::new();
    for (k, place) in ["", ".move([3, -2, 1])", ".rotate([1, 2, 3], 0.7)", ".rotate([0.3, -1, 0.4], 2.1)"]
        .iter()
        .enumerate()
    {
        let k = k as f64;
        let mut add =
            |text: String, volume: f64, area: f64| shapes.push((format!("({text}){place}"), volume, area));
        for (outer, wall, long) in
            [(6e-3, 2e-3, 0.1 + 0.05 * k), (0.5, 0.1, 1.0 + k), (20.0, 10.0, 5.0 + 9.0 * k)]
        {
            let inner = outer - wall;
            let ends = PI * (outer * outer - inner * inner);
            let text = format!(
                "cylinder({outer}, {long}) \\ cylinder({inner}, {}).move([0, 0, {}])",
                2.0 * long,
                -0.5 * long
            );
            add(text, ends * long, 2.0 * PI * long * (outer + inner) + 2.0 * ends);
        }
        let (a, b, c) = (0.95 - 0.2 * k, 0.08 + 0.1 * k, 0.079);
        add(format!("box([0, 0, 0], [{a}, {b}, {c}])"), a * b * c, 2.0 * (a * b + b * c + c * a));
        let (r, h) = (0.4 + 0.1 * k, 0.9 - 0.15 * k);
        add(format!("cone({r}, {h})"), PI * r * r * h / 3.0, PI * r * (r + r.hypot(h)));
        add(format!("capsule({r}, {h})"), PI * r * r * (h + 4.0 / 3.0 * r), 2.0 * PI * r * (h + 2.0 * r));
        add(format!("torus(1, {r})"), 2.0 * PI * PI * r * r, 4.0 * PI * PI * r);
        // a hexagonal prism, and two balls apart from it
        let text = format!(
            "(all i in 0..6: half_space([1, 0, 0], [{r}, 0, 0]).rotate_z(i*60 deg)) and 0 <= z <= {h}"
        );
        let (side, base) = (12.0 * r * h / 3.0_f64.sqrt(), 12.0_f64.sqrt() * r * r);
        add(text.clone(), base * h, 2.0 * base + side);
        let balls = format!("({text}) or ball([3, 0, 0], {r}) or ball([0, 3, 0], {h})");
        let (volume, area) = (4.0 / 3.0 * PI * (r.powi(3) + h.powi(3)), 4.0 * PI * (r * r + h * h));
        add(balls, base * h + volume, 2.0 * base + side + area);
        let inner = 0.9 - 0.05 * k;
        add(
            format!("sphere(1) \\ sphere({inner})"),
            4.0 / 3.0 * PI * (1.0 - inner.powi(3)),
            4.0 * PI * (1.0 + inner * inner),
        );
    }
    shapes
}

#[test]
#[ignore = "long"]
fn volumes_and_areas_are_right_within_their_errors() {
    let (mut area_errors, shapes) = (Vec::new(), known_shapes());
    for (text, exact_volume, exact_area) in &shapes {
        let solid = solid(&format!("rfm 1\nsolid s = {text}\n"), "s");
        let bounds = solid.bounds().aabb().unwrap();
        let surface = solid.surface(bounds.grown(0.1 * bounds.size().max_element()));
        let found = volume(&*surface, &bounds, 96, &Unwatched).unwrap();
        assert!(
            (found.volume - exact_volume).abs() <= found.error,
            "{text}: {found:?}, volume {exact_volume}"
        );
        assert!((found.area - exact_area).abs() <= found.area_error, "{text}: {found:?}, area {exact_area}");
        area_errors.push(found.area_error / exact_area);
    }
    // errors that are always large would be right, too
    area_errors.sort_by(f64::total_cmp);
    assert!(area_errors[shapes.len() / 2] < 1e-3, "{area_errors:?}");
}

/// How far a point lies outside of a box or cylinder whose edges are rounded, from its distances beyond the faces
/// of the solid that is smaller by the radius.
fn beyond_rounded<const N: usize>(beyond: [f64; N], radius: f64) -> f64 {
    let outside = beyond.iter().map(|x| x.max(0.0).powi(2)).sum::<f64>().sqrt();
    outside + beyond.into_iter().fold(f64::NEG_INFINITY, f64::max).min(0.0) - radius
}

/// Searches for the surface end at rounding, which is larger than any fixed share of a cell far from the origin, or
/// of the cells of a part of some micrometres.
#[test]
#[ignore = "long"]
fn vertices_are_as_exact_as_coordinates_far_from_the_origin() {
    let round_box = |p: DVec3| {
        let beyond = (p - DVec3::new(0.5, 1.0, 1.5)).abs() - DVec3::new(0.4, 0.9, 1.4);
        beyond_rounded(beyond.to_array(), 0.1)
    };
    let can = |p: DVec3| beyond_rounded([p.x.hypot(p.y) - 0.9, (p.z - 1.0).abs() - 0.9], 0.1);
    let solids: [(&str, &dyn Fn(DVec3) -> f64); 2] =
        [("box([0, 0, 0], [1, 2, 3])", &round_box), ("cylinder(1, 2)", &can)];
    for ((text, distance), cells) in solids.into_iter().flat_map(|of| [20, 50, 64].map(|cells| (of, cells))) {
        let mut counts = Vec::new();
        for (scale, away) in [(1.0, 0.0), (1.0, 3e3), (1.0, 1e4), (1.0, 1e6), (1e-6, 1.0)] {
            let moved =
                format!("rfm 1\nsolid s = {text}.round(0.1).scale({scale:e}).move([{away}, {away}, {away}])");
            let solid = solid(&moved, "s");
            let grid = around(&solid, cells);
            let mesh = dual_contouring(&*solid.surface(*grid.bounds()), &grid, &Unwatched).unwrap();
            // each coordinate is rounded by at most ε/2 of itself, and ω once more by about as much
            let rounding = 2.0 * f64::EPSILON * (away + 3.0 * scale);
            let found = |p: &DVec3| scale * distance((p - away) / scale).abs();
            let worst = mesh.positions.iter().map(found).fold(0.0, f64::max);
            assert!(worst <= rounding, "{moved} with {cells} cells: {worst:e} of {rounding:e}");
            counts.push(mesh.positions.len());
        }
        assert!(counts[..4].iter().all(|count| *count == counts[0]), "{text} with {cells} cells: {counts:?}");
    }
}
