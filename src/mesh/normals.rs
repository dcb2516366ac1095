//! Vertex normals: n = −∇ω/|∇ω|, or the mean of the triangles around where the field gives no direction.
//!
//! Invariant: every normal is a finite unit vector.

use glam::DVec3;
use rayon::prelude::*;

use super::Mesh;
use crate::field::{Field, GradientsMut, Points};

/// Vertices evaluated together.
const BATCH: usize = 1024;

/// Computes `mesh.normals`. Cap vertices lie inside the solid, where ∇ω says nothing about the cap: they take
/// the mean of the triangles around.
pub(super) fn add(field: &dyn Field, mesh: &mut Mesh) {
    mesh.normals = vec![DVec3::ZERO; mesh.positions.len()];
    mesh.normals.par_chunks_mut(BATCH).zip(mesh.positions.par_chunks(BATCH)).for_each(
        |(normals, positions)| {
            let gradients = gradients(field, positions);
            for (normal, (_, gradient)) in normals.iter_mut().zip(gradients) {
                *normal = unit(-gradient).unwrap_or(DVec3::ZERO);
            }
        },
    );
    mesh.work.gradients += mesh.positions.len() as u64;
    for &v in &mesh.caps {
        mesh.normals[v as usize] = DVec3::ZERO;
    }
    if mesh.normals.contains(&DVec3::ZERO) {
        fill_from_triangles(mesh);
    }
}

/// ω and ∇ω at each position.
pub(super) fn gradients(field: &dyn Field, positions: &[DVec3]) -> Vec<(f64, DVec3)> {
    let coordinates = |axis: usize| positions.iter().map(|p| p[axis]).collect::<Vec<f64>>();
    let (x, y, z) = (coordinates(0), coordinates(1), coordinates(2));
    let [mut omega, mut gx, mut gy, mut gz] = [(); 4].map(|()| vec![0.0; positions.len()]);
    let out = GradientsMut { omega: &mut omega, x: &mut gx, y: &mut gy, z: &mut gz };
    field.omega_grad_many(Points::new(&x, &y, &z), out);
    (0..positions.len()).map(|i| (omega[i], DVec3::new(gx[i], gy[i], gz[i]))).collect()
}

/// The unit vector along `v`, also where |v|² would underflow; none for zero, infinite and NaN vectors.
pub(super) fn unit(v: DVec3) -> Option<DVec3> {
    let largest = v.abs().max_element();
    if !v.is_finite() || largest == 0.0 {
        return None;
    }
    Some((v / largest).normalize()).filter(|n| n.is_finite())
}

/// Replaces each zero normal by the area-weighted mean of the triangles around, or by +z if these cancel.
fn fill_from_triangles(mesh: &mut Mesh) {
    let is_missing: Vec<bool> = mesh.normals.iter().map(|n| *n == DVec3::ZERO).collect();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        let twice_area = (b - a).cross(c - a);
        for &v in triangle.iter().filter(|&&v| is_missing[v as usize]) {
            mesh.normals[v as usize] += twice_area;
        }
    }
    for (normal, _) in mesh.normals.iter_mut().zip(is_missing).filter(|(_, missing)| *missing) {
        *normal = unit(*normal).unwrap_or(DVec3::Z);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_vectors_of_tiny_and_huge_gradients() {
        for scale in [1e-300, 1.0, 1e300] {
            let n = unit(scale * DVec3::new(3.0, 0.0, 4.0)).unwrap();
            assert!((n - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-15);
        }
        for useless in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
            assert_eq!(unit(useless), None);
        }
    }
}
