//! Dual contouring as a whole, against closed forms.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use proptest::prelude::*;

use super::super::tests::{Formula, ball, cube, pawn, r0_and, r0_or, trilinear};
use super::super::{Grid, Mesh, Report, Resolution, check};
use super::dual_contouring;
use crate::field::{Closures, Field};
use crate::geom::Aabb;
use crate::mesh::{Unwatched, Watch};

#[track_caller]
fn check_in(field: &dyn Field, grid: &Grid) -> (Mesh, Report) {
    let mesh = dual_contouring(field, grid, &Unwatched).unwrap();
    let report = check(&mesh, field);
    assert!(report.closed && report.manifold, "{report:?}");
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-12), "normals must be unit vectors");
    (mesh, report)
}

#[track_caller]
fn around(field: &dyn Field, bounds: &Aabb, cells: usize) -> (Mesh, Report) {
    let (mesh, report) = check_in(field, &Grid::around(bounds, Resolution::Cells(cells)).unwrap());
    assert_eq!(report.degenerate, 0);
    (mesh, report)
}

#[track_caller]
fn filling(field: &dyn Field, bounds: &Aabb, cells: usize) -> (Mesh, Report) {
    check_in(field, &Grid::filling(bounds, Resolution::Cells(cells)).unwrap())
}

#[track_caller]
fn assert_close(found: f64, truth: f64, tolerance: f64) {
    assert!((found - truth).abs() <= tolerance, "found {found}, expected {truth} ± {tolerance}");
}

/// A min/max box about the origin with exact gradients, turned about an axis.
fn turned_box(half: DVec3, axis: DVec3, angle: f64) -> impl Field {
    let turn = glam::DQuat::from_axis_angle(axis.normalize(), angle);
    let inner = move |p: DVec3| half - (turn.inverse() * p).abs();
    Closures {
        omega: move |p: DVec3| inner(p).min_element(),
        gradient: move |p: DVec3| {
            let face = inner(p).min_position();
            let side = (turn.inverse() * p)[face].signum();
            turn * (-side * DVec3::AXES[face])
        },
    }
}

#[test]
fn a_ball_has_exact_vertices_and_its_volume() {
    let field = Formula(ball(DVec3::new(0.1, 0.2, 0.3), 1.0));
    let (mesh, report) = around(&field, &Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.4)), 40);
    assert_eq!((report.components, report.euler), (1, 2));
    let centre = DVec3::new(0.1, 0.2, 0.3);
    let worst = mesh.positions.iter().map(|p| (p.distance(centre) - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-9, "{worst}"); // the gradient is a difference quotient
    // chords of a cell miss the sphere by h²/4R at most
    assert_close(report.volume, 4.0 / 3.0 * PI, 4.0 * PI * 0.06_f64.powi(2) / 4.0);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        assert!((b - a).cross(c - a).dot(a - centre) > 0.0, "upside down at {a}");
    }
}

/// Planes meet in edges and corners without any error. An edge that no hit shows may be missed by
/// `TOLERANCE` cells.
#[test]
fn boxes_have_exact_vertices_at_any_angle() {
    let half = DVec3::new(0.5, 0.7, 0.3);
    for (axis, angle) in
        [(DVec3::Z, 0.0), (DVec3::Z, 0.3), (DVec3::new(1.0, 2.0, 3.0), 0.7), (DVec3::ONE, 1.1)]
    {
        let field = turned_box(half, axis, angle);
        let (mesh, report) = around(&field, &cube(0.95), 30);
        assert_eq!((report.components, report.euler), (1, 2));
        let missed = 0.025 * 1.9 / 28.0;
        let (volume, edges) = (8.0 * half.x * half.y * half.z, 8.0 * half.element_sum());
        assert_close(report.volume, volume, 4.0 * edges * missed * missed);
        assert_close(
            report.area,
            8.0 * (half.x * half.y + half.y * half.z + half.z * half.x),
            2.0 * edges * missed,
        );
        assert!(report.max_distance < 1e-13, "{}", report.max_distance);
        let turn = glam::DQuat::from_axis_angle(axis.normalize(), angle);
        let nearest =
            |corner: DVec3| mesh.positions.iter().map(|p| p.distance(turn * corner)).fold(9.0, f64::min);
        let corners = Aabb::new(-half, half).corners().map(nearest);
        assert!(corners.iter().filter(|distance| **distance < 1e-13).count() >= 4, "{corners:?}");
    }
}

#[test]
fn faces_on_nodes_are_exact() {
    let field = turned_box(DVec3::new(0.5, 0.75, 0.25), DVec3::Z, 0.0);
    let (_, report) = filling(&field, &cube(1.0), 8);
    assert_close(report.volume, 8.0 * 0.5 * 0.75 * 0.25, 1e-13);
    // hits on the octahedron's edges, where the difference quotient is a mean of two faces
    let octahedron = Formula(|p: DVec3| 0.75 - p.abs().element_sum());
    let (_, report) = filling(&octahedron, &cube(1.0), 8);
    assert_close(report.volume, 4.0 / 3.0 * 0.75_f64.powi(3), 0.01 * 0.5625);
}

/// The rims of a cylinder are circles on which vertices lie exactly. The rest is the error of chords.
#[test]
fn the_rim_of_a_cylinder_is_sharp() {
    let side = |p: DVec3| 0.25 - p.x * p.x - p.y * p.y;
    let field = Closures {
        omega: move |p: DVec3| side(p).min(0.4 - p.z.abs()),
        gradient: move |p: DVec3| {
            if side(p) < 0.4 - p.z.abs() {
                DVec3::new(-2.0 * p.x, -2.0 * p.y, 0.0)
            } else {
                DVec3::new(0.0, 0.0, -p.z.signum())
            }
        },
    };
    let (mesh, report) = around(&field, &cube(0.5), 32);
    let on_rim = |p: &&DVec3| (p.z.abs() - 0.4).abs() < 1e-12 && (p.x.hypot(p.y) - 0.5).abs() < 1e-12;
    let count = mesh.positions.iter().filter(on_rim).count();
    // a vertex in each cell that a rim passes, 2 rims of 4·0.5/h or more cells
    assert!(count >= 2 * 4 * 15, "{count}");
    // the volume of a prism over a polygon with chords of one cell: πr²·(1 − h²/6r²) or better
    assert_close(report.volume, PI * 0.25 * 0.8, PI * 0.25 * 0.8 * (0.032_f64 / 0.5).powi(2) / 6.0 * 2.0);
    assert!(report.max_distance < 1e-11, "{}", report.max_distance);
}

#[test]
fn the_pawn_is_closed_and_near_its_volume() {
    let bounds = Aabb::new(DVec3::ZERO, DVec3::splat(3.0));
    for grid in [Grid::around(&bounds, Resolution::Cells(96)), Grid::filling(&bounds, Resolution::Cells(96))]
    {
        let (_, report) = check_in(&Formula(pawn), &grid.unwrap());
        assert_eq!((report.components, report.euler), (1, 2));
        assert_close(report.volume, 0.442701, 0.002 * 0.442701);
    }
}

#[test]
fn a_solid_cut_by_the_border_is_closed_on_it() {
    let domain = cube(0.5);
    let field = Formula(ball(DVec3::splat(0.5), 0.7));
    let (mesh, report) = filling(&field, &domain, 40);
    assert_eq!((report.components, report.euler), (1, 2));
    assert_close(report.volume, PI / 6.0 * 0.343, 0.001);
    assert!(mesh.positions.contains(&DVec3::splat(0.5)), "the box's corner is sharp");
    assert!(!mesh.caps.is_empty());
    assert!(mesh.caps.iter().all(|&v| mesh.positions[v as usize].abs().max_element() == 0.5));
    assert!(report.max_distance <= 1e-9, "{}", report.max_distance);
    assert!(mesh.positions.iter().all(|&p| domain.contains(p)));
}

#[test]
fn solid_everywhere_becomes_the_box_and_nothing_becomes_nothing() {
    let everywhere = Closures { omega: |_| 1.0, gradient: |_| DVec3::ZERO };
    let domain = Aabb::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 3.5, 3.5));
    let (_, report) = filling(&everywhere, &domain, 12);
    assert_close(report.volume, domain.volume(), 1e-12);
    let nowhere = Closures { omega: |_| -1.0, gradient: |_| DVec3::ZERO };
    assert!(filling(&nowhere, &domain, 12).0.triangles.is_empty());
}

#[test]
fn touching_balls_and_thin_walls_stay_manifold() {
    for gap in [-0.01, 0.0, 0.01] {
        let (a, b) =
            (ball(DVec3::new(-0.5 - gap, 0.0, 0.0), 0.5), ball(DVec3::new(0.5 + gap, 0.0, 0.0), 0.5));
        let pair = Formula(move |p| r0_or(a(p), b(p)));
        for cells in [20, 21, 48] {
            filling(&pair, &cube(1.05), cells);
        }
    }
    let (outer, inner) = (ball(DVec3::ZERO, 1.0), ball(DVec3::ZERO, 0.98));
    around(&Formula(move |p| r0_and(outer(p), -inner(p))), &cube(1.0), 40);
}

#[test]
fn nan_and_useless_gradients() {
    let field = Formula(|p: DVec3| if p.x > 0.4 { f64::NAN } else { 0.3 - p.length() });
    let grid = Grid::around(&cube(1.0), Resolution::Cells(16)).unwrap();
    assert!(
        matches!(dual_contouring(&field, &grid, &Unwatched), Err(super::MeshError::NotANumber { at }) if at.x > 0.4)
    );
    for bad in [DVec3::NAN, DVec3::ZERO] {
        let field = Closures { omega: ball(DVec3::ZERO, 1.0), gradient: move |_| bad };
        let mesh = dual_contouring(&field, &grid, &Unwatched).unwrap();
        assert!(mesh.positions.iter().zip(&mesh.normals).all(|(p, n)| n.dot(*p) > 0.8));
    }
}

#[test]
fn threads_change_no_bit() {
    let grid = Grid::around(&cube(1.0), Resolution::Cells(40)).unwrap();
    let field =
        Formula(|p: DVec3| r0_and((9.0 * p.x).sin() + (8.0 * p.y).sin() * (7.0 * p.z).cos(), 0.5 - p.x));
    let with_threads = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| check_in(&field, &grid))
    };
    assert_eq!(with_threads(1), with_threads(2));
}

/// Counts the evaluations between two looks at the watch.
#[derive(Default)]
struct Evaluations {
    since: AtomicU64,
    most: AtomicU64,
    all: AtomicU64,
}

impl Evaluations {
    fn count<T>(&self, value: T) -> T {
        self.since.fetch_add(1, Ordering::Relaxed);
        self.all.fetch_add(1, Ordering::Relaxed);
        value
    }
}

impl Watch for Evaluations {
    fn is_over(&self) -> bool {
        self.most.fetch_max(self.since.swap(0, Ordering::Relaxed), Ordering::Relaxed);
        false
    }
}

/// Details in every cell, whose triangles cross nearly everywhere.
#[test]
fn work_that_takes_long_looks_at_its_watch_all_along() {
    let counted = Evaluations::default();
    let wave = |p: DVec3| DVec3::new((90.0 * p.x).sin(), (80.0 * p.y + 3.0 * p.z).sin(), (70.0 * p.z).sin());
    let slope = |p: DVec3| DVec3::new((90.0 * p.x).cos(), (80.0 * p.y + 3.0 * p.z).cos(), (70.0 * p.z).cos());
    let field = Closures {
        omega: |p: DVec3| counted.count(wave(p).element_sum()),
        gradient: |p: DVec3| {
            let c = slope(p);
            counted.count(DVec3::new(90.0 * c.x, 80.0 * c.y, 3.0 * c.y + 70.0 * c.z))
        },
    };
    let grid = Grid::around(&cube(1.0), Resolution::Cells(20)).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| dual_contouring(&field, &grid, &counted)).unwrap();
    counted.is_over();
    let [most, all] = [&counted.most, &counted.all].map(|count| count.load(Ordering::Relaxed));
    // the longest stretch joins vertices to triangles
    assert!(most < all / 6, "{most} of {all} evaluations between two looks");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]

    /// Noise has every case, every neighbourhood of cases, faces passed twice and every way to meet
    /// the border.
    #[test]
    fn random_grids_are_closed_and_manifold(values in prop::collection::vec(-1.0..1.0_f64, 125)) {
        let domain = Aabb::new(DVec3::ZERO, DVec3::splat(4.0));
        filling(&Formula(trilinear(values, 4)), &domain, 4);
    }

    #[test]
    fn random_grids_with_zeros_stay_closed_and_manifold(values in prop::collection::vec(-1..=1_i32, 125)) {
        let values = values.into_iter().map(f64::from).collect();
        let domain = Aabb::new(DVec3::ZERO, DVec3::splat(4.0));
        filling(&Formula(trilinear(values, 4)), &domain, 4);
    }
}
