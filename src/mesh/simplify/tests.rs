//! Solids for which the least number of triangles is known.

use super::*;
use crate::field::Closures;
use crate::mesh::Unwatched;
use crate::mesh::{Grid, Quality, Report, Resolution, check, dual_contouring, marching_cubes, measure};

type Mesher = fn(&dyn Field, &Grid, &dyn Watch) -> Result<Mesh, crate::mesh::MeshError>;

/// Simplifies a mesh in [−1, 1]³. Returns the findings before and after, and the measured quality and the
/// mesh after.
fn simplified(
    mesher: Mesher,
    field: &dyn Field,
    cells: usize,
    tolerance: f64,
) -> (Report, Report, Quality, Mesh) {
    let grid = Grid::filling(&Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0)), Resolution::Cells(cells));
    let grid = grid.unwrap();
    let mut mesh = mesher(field, &grid, &Unwatched).unwrap();
    let before = check(&mesh, field);
    let taken = simplify(&mut mesh, field, tolerance, &Unwatched);
    let after = check(&mesh, field);
    assert_eq!(before.vertices - after.vertices, taken);
    assert!(after.closed && after.manifold, "{after:?}");
    assert_eq!((after.euler, after.components), (before.euler, before.components));
    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-12));
    let quality = measure(&mesh, field, field, &grid).unwrap();
    println!(
        "{} triangles → {}, tolerance {tolerance}, found {:.2e}, volume {:+.2e}, worst shape {:.3}",
        before.triangles,
        after.triangles,
        quality.hausdorff(),
        quality.volume_error,
        quality.min_radius_ratio
    );
    (before, after, quality, mesh)
}

fn ball() -> impl Field {
    Closures { omega: |p: DVec3| 0.9 - p.length(), gradient: |p: DVec3| -p.normalize_or(DVec3::X) }
}

fn torus() -> impl Field {
    let ring = |p: DVec3| DVec3::new(p.x, p.y, 0.0).normalize_or(DVec3::X) * 0.6;
    Closures {
        omega: move |p: DVec3| 0.25 - p.distance(ring(p)),
        gradient: move |p: DVec3| (ring(p) - p).normalize_or(DVec3::X),
    }
}

fn cube() -> impl Field {
    let away = |p: DVec3| {
        let outside = p.abs() - 0.73;
        let axis = (0..3).max_by(|&i, &j| outside[i].total_cmp(&outside[j])).unwrap_or(0);
        (outside[axis], axis)
    };
    Closures {
        omega: move |p: DVec3| -away(p).0,
        gradient: move |p: DVec3| {
            let axis = away(p).1;
            -DVec3::AXES[axis] * p[axis].signum()
        },
    }
}

/// If triangles of a ball of radius r are equilateral and their middles are d below it, their sides are √(6 r
/// d). The least possible number is then 4πr² / (√3/4 · 6rd).
#[test]
fn a_ball_has_about_as_few_triangles_as_its_tolerance_allows() {
    for (tolerance, cells) in [(0.02, 40), (0.005, 40), (0.005, 80)] {
        let (_, after, quality, _) = simplified(marching_cubes, &ball(), cells, tolerance);
        let least = 16.0 * std::f64::consts::PI * 0.9 / (3.0_f64.sqrt() * 6.0 * tolerance);
        assert!(after.triangles as f64 > least && (after.triangles as f64) < 3.0 * least, "{least}");
        // the measure has other samples, which may lie a little further off
        assert!(quality.hausdorff() <= 1.05 * tolerance, "{quality:?}");
        assert!(after.max_distance < 1e-12 && quality.flipped == 0, "{quality:?}");
        assert!(quality.min_radius_ratio > 0.02, "{quality:?}");
    }
}

#[test]
fn a_cube_keeps_its_edges_and_a_torus_its_hole() {
    let (_, after, quality, _) = simplified(dual_contouring, &cube(), 24, 0.001);
    assert!(after.triangles <= 24, "{after:?}");
    assert!(quality.hausdorff() < 1e-9 && quality.volume_error.abs() < 1e-9, "{quality:?}");
    let (before, after, quality, _) = simplified(dual_contouring, &torus(), 48, 0.01);
    assert_eq!(after.euler, 0);
    assert!(4 * after.triangles < before.triangles && quality.hausdorff() <= 0.0105, "{quality:?}");
}

#[test]
fn caps_stay_where_they_are() {
    let pillar = Closures {
        omega: |p: DVec3| 0.6 - p.x.hypot(p.y),
        gradient: |p: DVec3| -DVec3::new(p.x, p.y, 0.0).normalize_or(DVec3::X),
    };
    let (before, after, quality, mesh) = simplified(marching_cubes, &pillar, 32, 0.01);
    assert!(!mesh.caps.is_empty() && mesh.caps.iter().all(|&v| mesh.positions[v as usize].z.abs() == 1.0));
    assert!(3 * after.triangles < 2 * before.triangles && quality.hausdorff() <= 0.0105, "{quality:?}");
    assert!((after.volume / before.volume - 1.0).abs() < 0.02);
}

#[test]
fn no_tolerance_changes_nothing_and_the_same_mesh_gives_the_same_bits() {
    let grid =
        Grid::filling(&Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0)), Resolution::Cells(24)).unwrap();
    let mesh = marching_cubes(&ball(), &grid, &Unwatched).unwrap();
    for tolerance in [0.0, -1.0, f64::NAN] {
        let mut same = mesh.clone();
        assert_eq!(simplify(&mut same, &ball(), tolerance, &Unwatched), 0);
        assert_eq!(same, mesh);
    }
    assert_eq!(simplify(&mut Mesh::default(), &ball(), 1.0, &Unwatched), 0);
    let [mut one, mut two] = [mesh.clone(), mesh];
    simplify(&mut one, &ball(), 0.01, &Unwatched);
    simplify(&mut two, &ball(), 0.01, &Unwatched);
    assert_eq!(one, two);
}

/// Notes the shares that are reported, and ends the work at one of them.
struct Until(f64, std::sync::Mutex<Vec<f64>>);

impl Watch for Until {
    fn progress(&self, done: f64) {
        self.1.lock().unwrap().push(done);
    }

    fn is_over(&self) -> bool {
        self.1.lock().unwrap().last().is_some_and(|done| *done >= self.0)
    }
}

#[test]
fn progress_ascends_and_work_that_is_ended_leaves_a_mesh_within_the_tolerance() {
    let grid =
        Grid::filling(&Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0)), Resolution::Cells(48)).unwrap();
    let mesh = marching_cubes(&ball(), &grid, &Unwatched).unwrap();
    let [(all, shares), (some, _)] = [2.0, 0.3].map(|end| {
        let (mut less, watch) = (mesh.clone(), Until(end, std::sync::Mutex::default()));
        simplify(&mut less, &ball(), 0.01, &watch);
        (less, watch.1.into_inner().unwrap())
    });
    assert!(shares.len() > 3 && shares.is_sorted() && shares.last() == Some(&1.0), "{shares:?}");
    assert!(
        some.triangles.len() > 2 * all.triangles.len(),
        "{} {}",
        some.triangles.len(),
        all.triangles.len()
    );
    assert!(some.triangles.len() < mesh.triangles.len());
    let quality = measure(&some, &ball(), &ball(), &grid).unwrap();
    assert!(quality.hausdorff() <= 0.0105, "{quality:?}");
}
