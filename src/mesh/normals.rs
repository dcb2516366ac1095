//! Vertex normals: n = −∇ω/|∇ω|, or the mean of the triangles around a vertex where the field gives
//! no direction.
//!
//! Invariant: every normal is a finite unit vector.

use glam::DVec3;
use rayon::prelude::*;

use super::Mesh;
use crate::field::{Field, GradientsMut, Points};

/// Gradients at many points. The columns are kept from one call to the next.
#[derive(Debug, Default)]
pub(super) struct GradientColumns {
    points: [Vec<f64>; 3],
    /// ω and its derivatives.
    found: [Vec<f64>; 4],
}

impl GradientColumns {
    /// Writes −∇ω/|∇ω| at each position, and zero where the field gives no direction.
    pub(super) fn normals(&mut self, field: &dyn Field, positions: &[DVec3], normals: &mut [DVec3]) {
        self.evaluate(field, positions);
        let [_, x, y, z] = &self.found;
        for (i, normal) in normals.iter_mut().enumerate() {
            *normal = unit(DVec3::new(-x[i], -y[i], -z[i])).unwrap_or(DVec3::ZERO);
        }
    }

    /// ω and ∇ω at each position.
    pub(super) fn at(
        &mut self,
        field: &dyn Field,
        positions: &[DVec3],
    ) -> impl Iterator<Item = (f64, DVec3)> {
        self.evaluate(field, positions);
        let [omega, x, y, z] = &self.found;
        (0..omega.len()).map(|i| (omega[i], DVec3::new(x[i], y[i], z[i])))
    }

    fn evaluate(&mut self, field: &dyn Field, positions: &[DVec3]) {
        self.points.iter_mut().for_each(Vec::clear);
        let [x, y, z] = &mut self.points;
        x.extend(positions.iter().map(|p| p.x));
        y.extend(positions.iter().map(|p| p.y));
        z.extend(positions.iter().map(|p| p.z));
        self.found.iter_mut().for_each(|column| column.resize(positions.len(), 0.0));
        let [x, y, z] = &self.points;
        let [omega, gx, gy, gz] = &mut self.found;
        field.omega_grad_many(Points::new(x, y, z), GradientsMut { omega, x: gx, y: gy, z: gz });
    }
}

impl Mesh {
    /// A mesh that stands for no field: each normal is the area-weighted mean of the triangles around
    /// its vertex.
    pub fn from_triangles(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let normals = vec![DVec3::ZERO; positions.len()];
        let mut mesh = Self { positions, normals, triangles, ..Self::default() };
        fill_missing(&mut mesh);
        mesh
    }
}

/// ω and ∇ω at each position.
pub(super) fn gradients(field: &dyn Field, positions: &[DVec3]) -> Vec<(f64, DVec3)> {
    GradientColumns::default().at(field, positions).collect()
}

/// Vertices evaluated together.
const BATCH: usize = 1024;

/// Computes the normals of the vertices given by number.
pub(super) fn add(field: &dyn Field, mesh: &mut Mesh, vertices: &[u32]) {
    let parts: Vec<Vec<DVec3>> = vertices
        .par_chunks(BATCH)
        .map_init(GradientColumns::default, |gradients, part| {
            let positions: Vec<DVec3> = part.iter().map(|&v| mesh.positions[v as usize]).collect();
            let mut normals = vec![DVec3::ZERO; part.len()];
            gradients.normals(field, &positions, &mut normals);
            normals
        })
        .collect();
    for (&v, normal) in vertices.iter().zip(parts.into_iter().flatten()) {
        mesh.normals[v as usize] = normal;
    }
    mesh.work.gradients += vertices.len() as u64;
    for &v in &mesh.caps {
        mesh.normals[v as usize] = DVec3::ZERO;
    }
    fill_missing(mesh);
}

/// Squared lengths in this range come from vectors whose squared parts do not underflow and whose sum does
/// not overflow.
const SAFE: std::ops::Range<f64> = 1e-200..1e200;

/// The unit vector along `v`, also where |v|² would underflow. `None` for zero, infinite and NaN vectors.
pub(super) fn unit(v: DVec3) -> Option<DVec3> {
    let squared = v.length_squared();
    if SAFE.contains(&squared) {
        return Some(v / squared.sqrt());
    }
    let largest = v.abs().max_element();
    if !v.is_finite() || largest == 0.0 {
        return None;
    }
    Some((v / largest).normalize()).filter(|n| n.is_finite())
}

/// Replaces each zero normal by the area-weighted mean of the triangles around it, or by +z if these cancel.
/// Cap vertices are treated so too: they lie inside the solid, where ∇ω says nothing about the cap.
pub(super) fn fill_missing(mesh: &mut Mesh) {
    let is_missing: Vec<bool> = mesh.normals.par_iter().map(|n| *n == DVec3::ZERO).collect();
    if is_missing.par_iter().all(|missing| !missing) {
        return;
    }
    let touches = |t: &&[u32; 3]| t.iter().any(|&v| is_missing[v as usize]);
    // found in parallel, summed in their order
    let around: Vec<&[u32; 3]> = mesh.triangles.par_iter().filter(touches).collect();
    for triangle in around {
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
