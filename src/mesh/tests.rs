//! The mesher as a whole, against closed forms.

use std::{f64::consts::PI, time::Instant};

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::{
    field::{Closures, Field},
    geom::Aabb,
    interval::Interval,
};

/// A field from ω alone. Central differences give ∇ω, which is good enough for normals and Newton steps.
pub(super) struct Formula<F>(pub F);

impl<F: Fn(DVec3) -> f64 + Send + Sync> Field for Formula<F> {
    fn omega(&self, p: DVec3) -> f64 {
        (self.0)(p)
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        const STEP: f64 = 1e-6;
        let slope = |axis: DVec3| (self.omega(p + STEP * axis) - self.omega(p - STEP * axis)) / (2.0 * STEP);
        (self.omega(p), DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)))
    }
}

pub(super) fn r0_and(u: f64, v: f64) -> f64 {
    u + v - (u * u + v * v).sqrt()
}

pub(super) fn r0_or(u: f64, v: f64) -> f64 {
    u + v + (u * u + v * v).sqrt()
}

/// The paper's pawn, in the box [0, 3]³.
pub(super) fn pawn(p: DVec3) -> f64 {
    let r2 = (p.x - 1.5).powi(2) + (p.y - 1.5).powi(2);
    let z = p.z;
    let w1 = 0.25 - r2;
    let w2 = z * (1.0 - z);
    let w3 = -20.0 * r2 + 1.0 + 10.0 * (z - 0.75) * (z - 0.75);
    let w4 = 0.125 - r2 - 20.0 * (1.0 - z) * (1.0 - z);
    let w5 = 0.05 - r2 - (1.25 - z) * (1.25 - z);
    r0_or(r0_and(r0_and(w1, w2), w3), r0_or(w4, w5))
}

/// The pawn's volume by quadrature of its profile, independent of this program.
const PAWN_VOLUME: f64 = 0.442701;

pub(super) fn ball(centre: DVec3, radius: f64) -> impl Fn(DVec3) -> f64 {
    move |p| radius * radius - p.distance_squared(centre)
}

/// A box by the max norm: ω = 0 exactly on faces that lie on nodes.
fn cuboid(p: DVec3, half: DVec3) -> f64 {
    (half - p.abs()).min_element()
}

pub(super) fn cube(half_side: f64) -> Aabb {
    Aabb::new(DVec3::splat(-half_side), DVec3::splat(half_side))
}

fn mesh_in(field: &dyn Field, grid: &Grid) -> Mesh {
    marching_cubes(field, grid, &Unwatched).unwrap()
}

/// Meshes in a padded grid and checks what must hold of every mesh.
#[track_caller]
fn check_around(field: &dyn Field, bounds: &Aabb, cells: usize) -> (Mesh, Report) {
    check_mesh(field, &Grid::around(bounds, Resolution::Cells(cells)).unwrap())
}

/// Meshes in an imposed box and checks what must hold of every mesh.
#[track_caller]
fn check_filling(field: &dyn Field, bounds: &Aabb, cells: usize) -> (Mesh, Report) {
    check_mesh(field, &Grid::filling(bounds, Resolution::Cells(cells)).unwrap())
}

#[track_caller]
fn check_mesh(field: &dyn Field, grid: &Grid) -> (Mesh, Report) {
    let mesh = mesh_in(field, grid);
    let report = check(&mesh, field);
    assert!(report.closed && report.manifold, "{report:?}");
    assert!(mesh.normals.len() == mesh.positions.len());
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-12), "normals must be unit vectors");
    assert!(mesh.positions.iter().all(|&p| grid.bounds().contains(p)));
    (mesh, report)
}

#[track_caller]
fn assert_close(found: f64, truth: f64, tolerance: f64) {
    assert!((found - truth).abs() <= tolerance, "found {found}, expected {truth} ± {tolerance}");
}

#[test]
fn ball_has_its_volume_area_and_outward_normals() {
    let centre = DVec3::new(0.3, -0.2, 0.1);
    let field = Formula(ball(centre, 1.0));
    let (mesh, report) = check_around(&field, &cube(1.3), 64);
    assert_eq!((report.components, report.solids, report.euler, report.degenerate), (1, 1, 2, 0));
    // Inscribed chords of length ≤ √3·h lose a relative h²/R² or so: h = 0.041 here.
    assert_close(report.volume, 4.0 / 3.0 * PI, 0.004);
    assert_close(report.area, 4.0 * PI, 0.02);
    assert!(report.max_distance <= 1e-12, "{}", report.max_distance);
    let worst = mesh.positions.iter().map(|p| (p.distance(centre) - 1.0).abs()).fold(0.0, f64::max);
    assert!(worst <= 1e-15 * 2.0, "true distance from the sphere: {worst}");
    for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
        assert!(n.dot(*p - centre) > 0.999_999);
    }
}

#[test]
fn torus_has_a_hole() {
    let field = Formula(|p: DVec3| 0.09 - (p.x.hypot(p.y) - 1.0).powi(2) - p.z * p.z);
    let (_, report) = check_around(&field, &cube(1.3), 60);
    assert_eq!((report.components, report.solids, report.euler), (1, 1, 0));
    assert_close(report.volume, 2.0 * PI * PI * 0.09, 0.02);
}

#[test]
fn touching_and_overlapping_balls() {
    let pair = |gap: f64| {
        let (a, b) =
            (ball(DVec3::new(-0.5 - gap, 0.0, 0.0), 0.5), ball(DVec3::new(0.5 + gap, 0.0, 0.0), 0.5));
        Formula(move |p| r0_or(a(p), b(p)))
    };
    assert_eq!(check_around(&pair(0.05), &cube(1.1), 48).1.components, 2);
    let (_, overlapping) = check_around(&pair(-0.1), &cube(1.1), 48);
    assert_eq!((overlapping.components, overlapping.euler), (1, 2));
    let lens = PI * 0.1_f64.powi(2) * (3.0 * 0.5 - 0.1) / 3.0;
    assert_close(overlapping.volume, 2.0 * (4.0 / 3.0 * PI * 0.125 - lens), 0.01);
    // Touching in a node, the balls stay apart; touching within a cell, they cannot be distinguished from
    // overlapping ones.
    for (cells, solids) in [(20, 2), (21, 1)] {
        let (_, touching) = check_filling(&pair(0.0), &cube(1.0), cells);
        assert_eq!((touching.solids, touching.degenerate), (solids, 0));
    }
}

#[test]
fn cavity_has_negative_volume() {
    let (outer, inner) = (ball(DVec3::ZERO, 1.0), ball(DVec3::ZERO, 0.5));
    let field = Formula(move |p| r0_and(outer(p), -inner(p)));
    let (_, report) = check_around(&field, &cube(1.0), 48);
    assert_eq!((report.components, report.solids, report.euler), (2, 1, 4));
    let cavity = report.component_volumes.iter().copied().fold(0.0, f64::min);
    assert_close(cavity, -4.0 / 3.0 * PI * 0.125, 0.01);
    assert_close(report.volume, 4.0 / 3.0 * PI * 0.875, 0.02);
}

#[test]
fn pawn_is_closed_exact_and_has_its_volume() {
    let bounds = Aabb::new(DVec3::ZERO, DVec3::splat(3.0));
    let start = Instant::now();
    let grid = Grid::around(&bounds, Resolution::Cells(128)).unwrap();
    let mesh = mesh_in(&Formula(pawn), &grid);
    println!("pawn 128³: {:.1?}, {} triangles", start.elapsed(), mesh.triangles.len());
    let report = check(&mesh, &Formula(pawn));
    println!("{report:#?}");
    assert!(report.closed && report.manifold);
    assert_eq!((report.components, report.euler, report.degenerate), (1, 2, 0));
    assert_close(report.volume, PAWN_VOLUME, 0.005 * PAWN_VOLUME);
    assert!(report.max_distance <= 1e-9, "{}", report.max_distance);
}

/// In the paper's own box the base lies on the border, where ω = 0 exactly.
#[test]
fn pawn_in_the_papers_box_stands_on_a_closed_base() {
    let bounds = Aabb::new(DVec3::ZERO, DVec3::splat(3.0));
    let (mesh, report) = check_filling(&Formula(pawn), &bounds, 96);
    assert_eq!((report.components, report.euler, report.degenerate), (1, 2, 0));
    assert!(mesh.caps.is_empty());
    assert_close(report.volume, PAWN_VOLUME, 0.005 * PAWN_VOLUME);
}

#[test]
fn volume_converges_with_the_square_of_the_cell() {
    let error = |cells| {
        let field = Formula(ball(DVec3::ZERO, 1.0));
        4.0 / 3.0 * PI - check_around(&field, &cube(1.0), cells).1.volume
    };
    let order = (error(20) / error(80)).log2() / 2.0;
    println!("order of convergence on the ball: {order}");
    assert_close(order, 2.0, 0.15);
    // Creases of the pawn are cut across a cell: also a loss of order h².
    let bounds = Aabb::new(DVec3::new(0.9, 0.9, 0.0), DVec3::new(2.1, 2.1, 1.5));
    for cells in [32, 64, 128] {
        let volume = check_around(&Formula(pawn), &bounds, cells).1.volume;
        println!("pawn {cells}: volume error {:+.2e}", volume / PAWN_VOLUME - 1.0);
    }
}

#[test]
fn solid_cut_by_the_border_is_closed_by_caps_on_it() {
    let domain = cube(0.5);
    // A ball whose centre is a corner of the box: one eighth of it is inside.
    let field = Formula(ball(DVec3::splat(0.5), 0.7));
    let (mesh, report) = check_filling(&field, &domain, 40);
    assert_eq!((report.components, report.euler, report.degenerate), (1, 2, 0));
    assert_close(report.volume, PI / 6.0 * 0.343, 0.001);
    assert_close(report.area, PI / 2.0 * 0.49 + 3.0 * PI / 4.0 * 0.49, 0.003);
    assert!(report.max_distance <= 1e-12);
    assert!(mesh.positions.contains(&DVec3::splat(0.5)), "the box's corner is sharp");
    let on_border = |p: DVec3| p.abs().max_element() == 0.5;
    assert!(mesh.caps.iter().all(|&v| on_border(mesh.positions[v as usize])));
}

#[test]
fn solid_everywhere_becomes_the_box_itself() {
    let everywhere = Closures { omega: |_| 1.0, gradient: |_| DVec3::ZERO };
    let domain = Aabb::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 3.5, 3.5));
    let (_, report) = check_filling(&everywhere, &domain, 12);
    assert_close(report.volume, domain.volume(), 1e-13);
    assert_close(report.area, 2.0 * (3.0 * 1.5 + 3.0 * 0.5 + 1.5 * 0.5), 1e-12);
    assert_eq!((report.components, report.euler, report.degenerate), (1, 2, 0));
    // One cell: the smallest box.
    let (_, report) = check_filling(&everywhere, &cube(1.0), 2);
    assert_close(report.volume, 8.0, 1e-14);
}

#[test]
fn faces_and_corners_on_nodes_leave_no_degenerate_triangles() {
    // Nodes at multiples of 0.25; faces on them.
    let field = Formula(|p| cuboid(p, DVec3::new(0.5, 0.75, 0.25)));
    let (_, report) = check_filling(&field, &cube(1.0), 8);
    assert_eq!((report.components, report.euler, report.degenerate), (1, 2, 0));
    assert!(report.max_distance <= 1e-12);
    // An octahedron: slanted faces run through nodes, where up to six roots meet.
    let field = Formula(|p: DVec3| 0.75 - p.abs().element_sum());
    let (mesh, report) = check_filling(&field, &cube(1.0), 8);
    assert_eq!((report.components, report.euler, report.degenerate), (1, 2, 0));
    assert!(mesh.work.merged > 0);
    assert_close(report.volume, 4.0 / 3.0 * 0.75_f64.powi(3), 1e-12);
    assert!(report.max_distance <= 1e-12);
}

#[test]
fn empty_field_gives_an_empty_mesh() {
    let nowhere = Formula(|_| -1.0);
    let (mesh, report) = check_around(&nowhere, &cube(1.0), 16);
    assert!(mesh.positions.is_empty() && mesh.triangles.is_empty());
    assert_eq!((report.components, report.euler, report.volume), (0, 0, 0.0));
    // Zero everywhere is not inside either.
    assert!(check_around(&Formula(|_| 0.0), &cube(1.0), 16).0.triangles.is_empty());
}

#[test]
fn a_solid_and_its_complement_share_nothing_and_fill_the_box_together() {
    let a = ball(DVec3::ZERO, 0.7);
    // R₀ and min/max: ω = 0 on the sphere, without a change of sign
    for both in [r0_and as fn(f64, f64) -> f64, f64::min] {
        let nothing = Formula(|p| both(a(p), -a(p)));
        assert!(check_filling(&nothing, &cube(1.0), 20).0.triangles.is_empty());
    }
    for either in [r0_or as fn(f64, f64) -> f64, f64::max] {
        // at 20 cells nodes such as (0.7, 0, 0) lie on the sphere: ω = 0 there, and specks around them vanish
        for cells in [20, 21] {
            let everything = Formula(|p| either(a(p), -a(p)));
            let (_, report) = check_filling(&everything, &cube(1.0), cells);
            assert_eq!((report.solids, report.degenerate), (1, 0));
            assert_close(report.volume, 8.0, 1e-9);
        }
    }
}

#[test]
fn blob_within_one_cell_around_a_node_is_an_octahedron_and_others_are_missed() {
    let field = Formula(ball(DVec3::splat(0.1), 0.04));
    let (mesh, report) = check_filling(&field, &cube(1.0), 20); // node (11, 11, 11) is its centre
    assert_eq!((mesh.positions.len(), mesh.triangles.len(), report.euler), (6, 8, 2));
    assert_close(report.volume, 4.0 / 3.0 * 0.04_f64.powi(3), 1e-15);
    assert!(check_filling(&Formula(ball(DVec3::splat(0.15), 0.04)), &cube(1.0), 20).0.triangles.is_empty());
}

#[test]
fn shell_of_one_cell_keeps_its_cavity_and_a_thinner_one_falls_to_pieces_but_stays_closed() {
    let shell = |thickness: f64| {
        let (outer, inner) = (ball(DVec3::ZERO, 0.8), ball(DVec3::ZERO, 0.8 - thickness));
        Formula(move |p| r0_and(outer(p), -inner(p)))
    };
    // the diagonal of a cell is 0.087
    let (_, report) = check_filling(&shell(0.1), &cube(1.0), 40);
    assert_eq!((report.components, report.solids, report.euler), (2, 1, 4));
    let (_, report) = check_filling(&shell(0.02), &cube(1.0), 40);
    assert!(report.euler != 4 && report.max_distance <= 1e-12, "{report:?}");
}

#[test]
fn nan_is_an_error_that_names_the_point() {
    let field = Formula(|p: DVec3| if p.x > 0.4 { f64::NAN } else { 0.3 - p.length() });
    let grid = Grid::around(&cube(1.0), Resolution::Cells(16)).unwrap();
    let found = marching_cubes(&field, &grid, &Unwatched);
    assert!(matches!(found, Err(MeshError::NotANumber { at }) if at.x > 0.4), "{found:?}");
}

#[test]
fn the_limit_of_vertices_is_the_one_that_the_error_names() {
    assert_eq!(MeshError::check_vertices(Mesh::MAX_VERTICES), Ok(()));
    let error = MeshError::check_vertices(Mesh::MAX_VERTICES + 1).unwrap_err();
    assert_eq!(error, MeshError::TooManyVertices { found: 536_870_913 });
    assert_eq!(
        error.to_string(),
        "the mesh would have 536870913 vertices; at most 536870912 are possible, use larger cells"
    );
    // what the limit is for: `check` numbers the corners of twice as many triangles, PLY and VTP write
    // signed indices
    assert!(u32::try_from(3 * 2 * Mesh::MAX_VERTICES).is_ok() && i32::try_from(Mesh::MAX_VERTICES).is_ok());
}

#[test]
fn nan_or_zero_gradients_fall_back_to_triangles() {
    for bad in [DVec3::NAN, DVec3::ZERO] {
        let field = Closures { omega: ball(DVec3::ZERO, 1.0), gradient: move |_| bad };
        let grid = Grid::around(&cube(1.0), Resolution::Cells(24)).unwrap();
        let mesh = mesh_in(&field, &grid);
        assert!(mesh.positions.iter().zip(&mesh.normals).all(|(p, n)| n.dot(*p) > 0.95));
    }
}

#[test]
fn double_root_is_found_within_its_bracket() {
    // ω = s·|s| is flat on the surface: its gradient vanishes there.
    let field = Formula(|p: DVec3| {
        let s = 1.0 - p.length();
        s * s.abs()
    });
    let (_, report) = check_around(&field, &cube(1.0), 32);
    assert!(report.max_distance <= 1e-12, "{}", report.max_distance);
}

#[test]
fn threads_change_no_bit() {
    let grid = Grid::around(&cube(1.0), Resolution::Cells(70)).unwrap();
    let field = Formula(|p: DVec3| (9.0 * p.x).sin() + (8.0 * p.y).sin() * (7.0 * p.z).cos() - 0.1);
    let with_threads = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| {
            let mesh = mesh_in(&field, &grid);
            let report = check(&mesh, &field);
            (mesh, report)
        })
    };
    let (mesh, report) = with_threads(1);
    assert!(report.closed && report.manifold && !mesh.caps.is_empty());
    let (other_mesh, other_report) = with_threads(2);
    assert_eq!(mesh, other_mesh);
    assert_eq!(report, other_report);
    let bits =
        |mesh: &Mesh| mesh.positions.iter().flat_map(|p| p.to_array().map(f64::to_bits)).collect::<Vec<_>>();
    assert_eq!(bits(&mesh), bits(&other_mesh));
}

#[test]
fn progress_ends_at_one() {
    let seen = std::sync::Mutex::new(Vec::new());
    let grid = Grid::around(&cube(1.0), Resolution::Cells(40)).unwrap();
    marching_cubes(&Formula(ball(DVec3::ZERO, 1.0)), &grid, &|share| seen.lock().unwrap().push(share))
        .unwrap();
    let seen = seen.into_inner().unwrap();
    assert_eq!(seen.iter().copied().fold(0.0, f64::max), 1.0);
    // without ranges all 6³ bricks are near: 14 tasks that take samples, and then those that make triangles
    assert!((15..=28).contains(&seen.len()), "{}", seen.len());
    assert_eq!(seen.iter().filter(|share| **share <= 0.5).count(), 14);
}

/// Ends the work when its first task is done.
#[derive(Default)]
struct Impatient(std::sync::atomic::AtomicBool);

impl Watch for Impatient {
    fn progress(&self, _done: f64) {
        self.0.store(true, std::sync::atomic::Ordering::Relaxed);
    }
    fn is_over(&self) -> bool {
        self.0.load(std::sync::atomic::Ordering::Relaxed)
    }
}

#[test]
fn who_waits_may_end_the_work() {
    let asked = std::sync::atomic::AtomicUsize::new(0);
    let counted = |p: DVec3| {
        asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        1.0 - p.length_squared()
    };
    let field = Formula(counted);
    let grid = Grid::around(&cube(1.0), Resolution::Cells(40)).unwrap();
    let ended_after = |mesher: fn(&dyn Field, &Grid, &dyn Watch) -> Result<Mesh, MeshError>| {
        asked.store(0, std::sync::atomic::Ordering::Relaxed);
        assert_eq!(mesher(&field, &grid, &Impatient::default()), Err(MeshError::Ended));
        asked.load(std::sync::atomic::Ordering::Relaxed)
    };
    // without ranges all of some 70 000 nodes are asked for in 14 tasks; a few of them may be under way
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    for mesher in [marching_cubes, dual_contouring] {
        let asked = pool.install(|| ended_after(mesher));
        assert!(asked < 20_000, "{asked}");
    }
    let over = Impatient(true.into());
    assert_eq!(volume(&field, &cube(1.0), 40, &over), Err(VolumeError::Mesh(MeshError::Ended)));
    assert_eq!(thin_cells(&field, &grid, &over), Ok(ThinCells { ended: true, ..ThinCells::NONE }));
}

/// A ball with an exact range.
struct RangedBall;

impl Field for RangedBall {
    fn omega(&self, p: DVec3) -> f64 {
        0.81 - p.length_squared()
    }
    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        (self.omega(p), -2.0 * p)
    }
    fn range(&self, over: &Aabb) -> Interval {
        let nearest = DVec3::ZERO.clamp(over.min, over.max);
        let farthest = over.min.abs().max(over.max.abs());
        Interval::new(self.omega(farthest) - 1e-12, self.omega(nearest) + 1e-12)
    }
}

#[test]
fn proven_bricks_save_samples_and_change_no_bit() {
    for cells in [15, 40, 100] {
        let grid = Grid::filling(&cube(1.0), Resolution::Cells(cells)).unwrap();
        let pruned = mesh_in(&RangedBall, &grid);
        let mut full = mesh_in(&Closures { omega: |p| RangedBall.omega(p), gradient: |p| -2.0 * p }, &grid);
        println!("{cells}³: {} evaluations of {}", pruned.work.evaluations, full.work.evaluations);
        assert!(cells < 100 || pruned.work.evaluations < full.work.evaluations * 3 / 4);
        full.work = pruned.work;
        assert_eq!(pruned, full);
    }
}

/// ω interpolated between given values at the nodes of a grid in [0, n]³, trilinear in each cell.
pub(super) fn trilinear(values: Vec<f64>, n: usize) -> impl Fn(DVec3) -> f64 {
    move |p| between_nodes(&values, n + 1, p)
}

/// The value at a point between `n`³ nodes. Meshes of random grids ask for it millions of times, so it is written for
/// a compiler that optimises little.
pub(super) fn between_nodes(values: &[f64], n: usize, p: DVec3) -> f64 {
    let (i, j, k) = ((p.x as usize).min(n - 2), (p.y as usize).min(n - 2), (p.z as usize).min(n - 2));
    let (u, v, w) = (p.x - i as f64, p.y - j as f64, p.z - k as f64);
    let first = (k * n + j) * n + i;
    let mut on_planes = [0.0; 2];
    for (plane, value) in on_planes.iter_mut().enumerate() {
        let low = first + plane * n * n;
        let high = low + n;
        let a = (1.0 - u) * values[low] + u * values[low + 1];
        let b = (1.0 - u) * values[high] + u * values[high + 1];
        *value = (1.0 - v) * a + v * b;
    }
    (1.0 - w) * on_planes[0] + w * on_planes[1]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    /// Noise has every case, every neighbourhood of cases and every way to meet the border.
    #[test]
    fn random_grids_are_closed_and_manifold(values in prop::collection::vec(-1.0..1.0_f64, 125)) {
        let domain = Aabb::new(DVec3::ZERO, DVec3::splat(4.0));
        let (_, report) = check_filling(&Formula(trilinear(values, 4)), &domain, 4);
        prop_assert!(report.max_distance <= 1e-12, "{}", report.max_distance);
        prop_assert_eq!(report.degenerate, 0);
    }

    /// In noise with many exact zeros vertices meet in nodes all over.
    #[test]
    fn random_grids_with_zeros_stay_closed_and_manifold(values in prop::collection::vec(-1..=1_i32, 125)) {
        let values = values.into_iter().map(f64::from).collect();
        let domain = Aabb::new(DVec3::ZERO, DVec3::splat(4.0));
        check_filling(&Formula(trilinear(values, 4)), &domain, 4);
    }
}

/// A small mesh for the writers' tests.
pub(super) fn pawn_mesh() -> Mesh {
    let bounds = Aabb::new(DVec3::new(0.9, 0.9, 0.0), DVec3::new(2.1, 2.1, 1.5));
    check_around(&Formula(pawn), &bounds, 24).0
}

/// Prints times and asserts nothing about them. `cargo test --release --lib print_times -- --nocapture`
#[test]
fn print_times_of_the_pawn() {
    let fastest = |work: &mut dyn FnMut()| {
        let runs = (0..3).map(|_| {
            let start = Instant::now();
            work();
            start.elapsed()
        });
        runs.min().unwrap()
    };
    let bounds = Aabb::new(DVec3::ZERO, DVec3::splat(3.0));
    let sizes: &[usize] = if cfg!(debug_assertions) { &[64] } else { &[128, 256] };
    for &cells in sizes {
        let grid = Grid::around(&bounds, Resolution::Cells(cells)).unwrap();
        let [x, y, z] = [0, 1, 2].map(|axis| grid.nodes(axis));
        let sampling = fastest(&mut || {
            let mut inside = 0;
            for (y, z) in z.iter().flat_map(|z| y.iter().map(move |y| (y, z))) {
                inside += x.iter().filter(|&&x| pawn(DVec3::new(x, *y, *z)) > 0.0).count();
            }
            assert!(inside > 0);
        });
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut mesh = Mesh::default();
            let whole = fastest(&mut || mesh = pool.install(|| mesh_in(&Formula(pawn), &grid)));
            println!(
                "pawn {cells}³, {threads} threads: {whole:.1?}; sampling alone on one thread {sampling:.1?}; \
                 {} triangles, {} evaluations",
                mesh.triangles.len(),
                mesh.work.evaluations
            );
        }
    }
}
