//! The point nearest to many planes, in the sense of least squares, and the number of directions in which
//! they fix it.
//!
//! Σ (nᵢ·(x − pᵢ))² is minimised with the eigenvalues and eigenvectors of Σ nᵢnᵢᵀ. All planes are nearly
//! parallel to an eigenvector whose eigenvalue is small, and along it the point stays where it was instead of
//! flying off.

use glam::{DMat3, DVec3};

use crate::geom::eigen;

/// Eigenvalues below this share of the largest count as zero. For two faces at an angle θ the ratio is
/// tan²(θ/2), so creases down to 8° are sharp. A smooth surface that bends by θ within the cell has the
/// same ratio and no crease. Evidence from the pawn in [0, 3]³ at 128³ cells: with 0.0005 (2.6°) 0.30 % of
/// the triangles are slivers and their normals are off by 2.8° rms; with 0.005, as with 0.1, it is 0.13 %
/// and 1.1°.
const TRUNCATED: f64 = 0.005;

/// The minimiser nearest to `around`, and the rank that was kept: 1 on a plane, 2 on an edge, 3 in a corner.
/// Planes are given by a point and the unit normal.
pub(super) fn minimiser(planes: impl Iterator<Item = (DVec3, DVec3)>, around: DVec3) -> (DVec3, usize) {
    let mut matrix = DMat3::ZERO;
    let mut right = DVec3::ZERO;
    for (point, normal) in planes {
        matrix += DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        right += normal * normal.dot(point - around);
    }
    let (values, vectors) = eigen(matrix);
    let largest = values.max_element();
    let mut step = DVec3::ZERO;
    let mut rank = 0;
    for i in 0..3 {
        if values[i] > TRUNCATED * largest {
            step += vectors.col(i) * (vectors.col(i).dot(right) / values[i]);
            rank += 1;
        }
    }
    (around + step, rank)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_edges_and_corners() {
        let start = DVec3::new(0.3, 0.4, 0.6);
        let x = (DVec3::new(1.0, 5.0, 6.0), DVec3::X);
        let y = (DVec3::new(7.0, 2.0, 8.0), DVec3::Y);
        let z = (DVec3::new(-1.0, 4.0, 3.0), DVec3::Z);
        for (planes, expected, rank) in [
            (vec![x, x], DVec3::new(1.0, 0.4, 0.6), 1),
            (vec![x, y, y], DVec3::new(1.0, 2.0, 0.6), 2),
            (vec![z, y, x, x], DVec3::new(1.0, 2.0, 3.0), 3),
        ] {
            let (found, kept) = minimiser(planes.into_iter(), start);
            assert!(found.distance(expected) < 1e-14 && kept == rank, "{found}, {kept}");
        }
    }

    /// All tangent planes of a cone pass its tip.
    #[test]
    fn the_tip_of_a_cone_is_exact() {
        let tip = DVec3::new(0.1, -0.2, 0.3);
        let planes = (0..7).map(|i| {
            let (sin, cos) = f64::from(i).sin_cos();
            (tip + DVec3::new(cos, sin, -1.0), DVec3::new(cos, sin, 1.0).normalize())
        });
        let (found, rank) = minimiser(planes, DVec3::ZERO);
        assert!(found.distance(tip) < 1e-14 && rank == 3, "{found}");
    }

    #[test]
    fn planes_that_are_nearly_parallel_do_not_throw_the_point_away() {
        let tilted = |angle: f64| (DVec3::ZERO, DVec3::new(angle.sin(), angle.cos(), 0.0));
        let planes = [tilted(0.02), tilted(-0.02), (DVec3::new(0.5, 0.001, 0.0), DVec3::Y)];
        let (found, rank) = minimiser(planes.into_iter(), DVec3::ZERO);
        assert!(rank == 1 && found.length() < 0.01, "{found}, {rank}");
    }
}
