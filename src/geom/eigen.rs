//! Eigenvalues and eigenvectors of symmetric 3×3 matrices.

use glam::{DMat3, DVec3};

/// Maximum number of sweeps of Jacobi's method. A symmetric 3×3 matrix is diagonal to the last digit after
/// four or five.
const SWEEPS: usize = 10;

/// Eigenvalues and orthonormal eigenvectors (columns) of a symmetric matrix, by Jacobi's rotations.
pub(crate) fn eigen(mut m: DMat3) -> (DVec3, DMat3) {
    let mut vectors = DMat3::IDENTITY;
    for _ in 0..SWEEPS {
        let off = m.col(1)[0].abs() + m.col(2)[0].abs() + m.col(2)[1].abs();
        let trace = m.col(0)[0].abs() + m.col(1)[1].abs() + m.col(2)[2].abs();
        // each sweep squares what is left, so less than this would change no digit
        if off <= f64::EPSILON * trace {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let apq = m.col(q)[p];
            if apq == 0.0 {
                continue;
            }
            let theta = (m.col(q)[q] - m.col(p)[p]) / (2.0 * apq);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            // Rᵀ m R for the rotation R in the plane of axes p and q, first from the left
            for column in 0..3 {
                let (mp, mq) = (m.col(column)[p], m.col(column)[q]);
                m.col_mut(column)[p] = c * mp - s * mq;
                m.col_mut(column)[q] = s * mp + c * mq;
            }
            rotate_columns(&mut m, (p, q), (c, s));
            rotate_columns(&mut vectors, (p, q), (c, s));
        }
    }
    (DVec3::new(m.col(0)[0], m.col(1)[1], m.col(2)[2]), vectors)
}

/// m·R for the rotation R by the angle of the given cosine and sine in the plane of two axes.
fn rotate_columns(m: &mut DMat3, (p, q): (usize, usize), (c, s): (f64, f64)) {
    let (mp, mq) = (m.col(p), m.col(q));
    (*m.col_mut(p), *m.col_mut(q)) = (c * mp - s * mq, s * mp + c * mq);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_rebuild_the_matrix() {
        let m = DMat3::from_cols(
            DVec3::new(4.0, 1.0, -2.0),
            DVec3::new(1.0, 3.0, 0.5),
            DVec3::new(-2.0, 0.5, 1.0),
        );
        let (values, vectors) = eigen(m);
        let rebuilt = vectors * DMat3::from_diagonal(values) * vectors.transpose();
        assert!(rebuilt.abs_diff_eq(m, 1e-14), "{rebuilt}");
        assert!((vectors.transpose() * vectors).abs_diff_eq(DMat3::IDENTITY, 1e-14));
    }
}
