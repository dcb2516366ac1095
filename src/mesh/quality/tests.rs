//! Meshes that are wrong in known ways, and what is told of them.

use super::*;
use crate::field::Closures;
use crate::geom::Aabb;
use crate::mesh::marching_cubes;

#[test]
fn nearest_points_of_a_triangle() {
    let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
    for (p, expected) in [
        (DVec3::new(0.2, 0.3, 5.0), DVec3::new(0.2, 0.3, 0.0)),
        (DVec3::new(0.4, -2.0, 1.0), DVec3::new(0.4, 0.0, 0.0)),
        (DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.5, 0.5, 0.0)),
        (DVec3::new(-1.0, -1.0, 2.0), DVec3::ZERO),
        (DVec3::new(-1.0, 3.0, 2.0), DVec3::Y),
    ] {
        assert!(nearest_point(triangle, p).distance(expected) < 1e-15, "{p}");
    }
    // without area: a point or a segment
    assert_eq!(nearest_point([DVec3::X; 3], DVec3::ZERO), DVec3::X);
    assert_eq!(nearest_point([DVec3::ZERO, DVec3::X, 2.0 * DVec3::X], DVec3::ONE), DVec3::X);
}

#[test]
fn shapes_of_triangles() {
    let equilateral = [DVec3::X, DVec3::Y, DVec3::Z];
    assert!((radius_ratio(equilateral) - 1.0).abs() < 1e-15);
    assert!((min_angle(equilateral) - 60.0).abs() < 1e-12);
    // sides 3, 4, 5: r = 1, R = 2.5
    let right = [DVec3::ZERO, 3.0 * DVec3::X, 4.0 * DVec3::Y];
    assert!((radius_ratio(right) - 0.8).abs() < 1e-15);
    assert!((min_angle(right) - (3.0_f64 / 4.0).atan().to_degrees()).abs() < 1e-12);
    assert_eq!((radius_ratio([DVec3::X; 3]), min_angle([DVec3::X; 3])), (0.0, 0.0));
}

/// A mesh of a ball of radius r is 1 − r away from a ball of radius 1 both ways, up to the chords' error.
#[test]
fn a_ball_that_is_too_small_is_told_both_ways() {
    let ball = |radius: f64| Closures {
        omega: move |p: DVec3| radius - p.length(),
        gradient: |p: DVec3| -p.normalize_or(DVec3::X),
    };
    let bounds = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
    let grid = Grid::around(&bounds, Resolution::Cells(40)).unwrap();
    let mesh = marching_cubes(&ball(0.9), &grid, &Unwatched).unwrap();
    let quality = measure(&mesh, &ball(1.0), &ball(1.0), &grid).unwrap();
    let chord = 3.0 * grid.spacing().x.powi(2) / 8.0 / 0.9;
    for found in [quality.to_surface, quality.from_surface] {
        assert!(found.max >= 0.1 && found.max <= 0.1 + chord, "{found:?}");
        assert!(found.rms >= 0.1 && found.rms < found.max && found.samples > 1000, "{found:?}");
    }
    assert!((quality.volume_error - (0.9_f64.powi(3) - 1.0)).abs() < 0.01, "{quality:?}");
    assert!((quality.area_error - (0.9_f64.powi(2) - 1.0)).abs() < 0.01, "{quality:?}");
    assert_eq!(quality.flipped, 0);
    assert!(quality.normal_error.max < 90.0 && quality.slivers < 0.2, "{quality:?}");
}

/// Volume and area are compared with those of the ball itself, by either method.
#[test]
fn errors_of_a_balls_volume_and_area_are_those_of_its_formula() {
    let ball =
        Closures { omega: |p: DVec3| 0.8 - p.length(), gradient: |p: DVec3| -p.normalize_or(DVec3::X) };
    let grid = Grid::around(&Aabb::new(DVec3::NEG_ONE, DVec3::ONE), Resolution::Cells(24)).unwrap();
    let (volume, area) =
        (4.0 / 3.0 * std::f64::consts::PI * 0.8_f64.powi(3), 4.0 * std::f64::consts::PI * 0.64);
    for mesh in [marching_cubes(&ball, &grid, &Unwatched), dual_contouring(&ball, &grid, &Unwatched)] {
        let mesh = mesh.unwrap();
        let (quality, own) = (measure(&mesh, &ball, &ball, &grid).unwrap(), extent(&mesh));
        for (found, true_error) in
            [(quality.volume_error, own.0 / volume - 1.0), (quality.area_error, own.1 / area - 1.0)]
        {
            // what is left is of fourth order, 4 % of the volume's error with these cells
            assert!((found / true_error - 1.0).abs() < 0.06, "{found} {true_error}");
        }
    }
}

/// A lost part shows only from the surface's side.
#[test]
fn a_missing_ball_shows_from_the_surface() {
    let two = Closures {
        omega: |p: DVec3| (0.3 - p.length()).max(0.3 - p.distance(DVec3::X)),
        gradient: |p: DVec3| {
            let nearer = if p.x < 0.5 { p } else { p - DVec3::X };
            -nearer.normalize_or(DVec3::X)
        },
    };
    let one = Closures { omega: |p: DVec3| 0.3 - p.length(), gradient: |p: DVec3| -p.normalize_or(DVec3::X) };
    let bounds = Aabb::new(DVec3::splat(-0.4), DVec3::new(1.4, 0.4, 0.4));
    let grid = Grid::filling(&bounds, Resolution::Cells(45)).unwrap();
    let mesh = marching_cubes(&one, &grid, &Unwatched).unwrap();
    let quality = measure(&mesh, &two, &two, &grid).unwrap();
    assert!(quality.to_surface.max < 0.01, "{quality:?}");
    assert!((quality.from_surface.max - 1.0).abs() < 0.02, "{quality:?}");
    assert!(quality.hausdorff() == quality.from_surface.max);
}

/// Shares of all parts of the work arrive: of the finer mesh, of the points on it, and of both ways.
#[test]
fn each_part_of_the_work_shows_progress() {
    let ball =
        Closures { omega: |p: DVec3| 0.8 - p.length(), gradient: |p: DVec3| -p.normalize_or(DVec3::X) };
    let grid = Grid::around(&Aabb::new(DVec3::NEG_ONE, DVec3::ONE), Resolution::Cells(16)).unwrap();
    let mesh = marching_cubes(&ball, &grid, &Unwatched).unwrap();
    let seen = std::sync::Mutex::new(Vec::new());
    let watch = |done: f64| seen.lock().unwrap().push(done);
    let shares_around = |part: f64| {
        let seen = std::mem::take(&mut *seen.lock().unwrap());
        assert_eq!(seen.iter().copied().fold(0.0, f64::max), 1.0);
        [seen.iter().filter(|done| **done <= part).count(), seen.iter().filter(|done| **done > part).count()]
    };
    let reference = Reference::new(&ball, &ball, &grid, &watch).unwrap();
    let [meshing, moving] = shares_around(MESHING);
    assert!(meshing > 2 && moving > 2, "{meshing} {moving}");
    reference.measure(&mesh, &watch);
    let [there, back] = shares_around(THERE);
    assert!(there > 2 && back > 2, "{there} {back}");
}

/// Ends the work after it was asked so many times.
struct Patience(AtomicUsize);

impl Watch for Patience {
    fn is_over(&self) -> bool {
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_err()
    }
}

#[test]
fn a_watch_ends_the_measuring_with_what_was_found() {
    let ball =
        Closures { omega: |p: DVec3| 0.8 - p.length(), gradient: |p: DVec3| -p.normalize_or(DVec3::X) };
    let grid = Grid::around(&Aabb::new(DVec3::NEG_ONE, DVec3::ONE), Resolution::Cells(16)).unwrap();
    let mesh = marching_cubes(&ball, &grid, &Unwatched).unwrap();
    let of = |asked| Patience(AtomicUsize::new(asked));
    assert!(matches!(Reference::new(&ball, &ball, &grid, &of(0)), Err(MeshError::Ended)));
    let reference = Reference::new(&ball, &ball, &grid, &Unwatched).unwrap();
    let [none, some, all] = [0, 4, usize::MAX].map(|asked| reference.measure(&mesh, &of(asked)));
    assert_eq!((none.measured, all.measured), (0.0, 1.0));
    assert!(some.to_surface.samples > 0 && some.to_surface.samples < all.to_surface.samples);
    assert!(some.to_surface.max <= all.to_surface.max);
    // the shapes of the triangles need no samples
    assert_eq!(none.min_angle, all.min_angle);
}

#[test]
fn triangles_that_face_inwards_are_counted() {
    let ball =
        Closures { omega: |p: DVec3| 0.8 - p.length(), gradient: |p: DVec3| -p.normalize_or(DVec3::X) };
    let grid = Grid::around(&Aabb::new(DVec3::NEG_ONE, DVec3::ONE), Resolution::Cells(16)).unwrap();
    let mut mesh = marching_cubes(&ball, &grid, &Unwatched).unwrap();
    mesh.triangles[7].swap(0, 1);
    mesh.triangles[100].swap(1, 2);
    assert_eq!(measure(&mesh, &ball, &ball, &grid).unwrap().flipped, 2);
}
