//! A point of the crease where two faces of a surface meet, or of the corner of three, to the last digits.
//!
//! The field itself bends on a crease, so Newton's method on it does not converge there. A little beside the
//! crease it is smooth. Points on each face at a distance δ from the crease give tangent planes, and these
//! meet only κδ²/2 away from the crease, where κ is the faces' curvature. Then δ shrinks.
//!
//! Invariant: a point that is returned lies on the surface, and the faces still meet at an angle there. Where
//! a smooth surface bends sharply the normals approach each other as δ shrinks, and no point is returned.

use glam::{DMat3, DVec3};

use super::super::normals::unit;
use super::project::{self, FacePoint};
use crate::field::Field;

/// The distances δ of the probes from the crease, in sizes. Each is much larger than the error that the one
/// before leaves (κ·size is below 1 where a grid resolves the surface at all), so that probes fall on their
/// own faces. What the last one leaves is below rounding.
const DISTANCES: [f64; 4] = [0.2, 0.02, 1e-3, 1e-6];

/// Probes are at least this many times as far from the crease as points are rounded there, so that they fall on
/// their own faces far from the origin, too.
const PROBES_APART: f64 = 16.0;

/// Faces whose normals differ by less than this make no crease (the cosine of 2.5°).
const SMOOTH: f64 = 0.999;

/// The largest distance of the result from the surface, in sizes. The error that the last probe leaves is far
/// smaller.
const RESIDUAL: f64 = 1e-9;

/// The point of the crease of two faces nearest to `start`, or the corner of three. `None` if there is no
/// such point. `size` is a length over which there are no other faces, for example a cell's side.
///
/// `count` counts the evaluations of ω and ∇ω.
pub(super) fn find(
    field: &dyn Field,
    start: DVec3,
    faces: &[FacePoint],
    size: f64,
    count: &mut u64,
) -> Option<DVec3> {
    let mut planes: [FacePoint; 3] = [faces[0]; 3];
    planes[..faces.len()].copy_from_slice(faces);
    let planes = &mut planes[..faces.len()];
    let mut at = meeting_point(start, planes)?;
    let least = project::negligible(0.0, size, PROBES_APART * start);
    for delta in DISTANCES.map(|share| (share * size).max(least)) {
        if at.distance(start) > 2.0 * size {
            return None;
        }
        for (plane, face) in planes.iter_mut().zip(faces) {
            let towards = face.point - at;
            let along = unit(towards - plane.normal * plane.normal.dot(towards))?;
            *plane = tangent(field, at + delta * along, plane.normal, delta, count)?;
        }
        at = meeting_point(at, planes)?;
    }
    *count += 1;
    let (omega, gradient) = field.omega_grad(at);
    (omega.abs() <= project::negligible(RESIDUAL, size, at) * gradient.length()).then_some(at)
}

/// The tangent plane of the face near a probe. It misses the face by the square of their distance, as a plane
/// that touches the face at δ from the crease does. If the field at the probe belongs to another face, the
/// face is sought at most δ away, because a point farther away may be on another one.
fn tangent(field: &dyn Field, probe: DVec3, normal: DVec3, delta: f64, count: &mut u64) -> Option<FacePoint> {
    *count += 1;
    let (omega, gradient) = field.omega_grad(probe);
    let found = unit(-gradient)
        .map(|normal| FacePoint { point: probe - gradient * (omega / gradient.length_squared()), normal });
    let is_same = |face: &FacePoint| {
        face.normal.dot(normal) > project::SAME_FACE && face.point.distance(probe) <= 0.5 * delta
    };
    found.filter(is_same).or_else(|| project::onto_face(field, probe, normal, delta, count))
}

/// The point nearest to `from` that lies in two or three planes. `None` if they are nearly parallel.
fn meeting_point(from: DVec3, planes: &[FacePoint]) -> Option<DVec3> {
    let height = |face: &FacePoint| face.normal.dot(face.point - from);
    let (a, b) = (&planes[0], &planes[1]);
    let cosine = a.normal.dot(b.normal);
    if cosine.abs() > SMOOTH {
        return None;
    }
    let step = match planes.get(2) {
        None => {
            let scale = 1.0 / (1.0 - cosine * cosine);
            let (ha, hb) = (height(a), height(b));
            scale * ((ha - cosine * hb) * a.normal + (hb - cosine * ha) * b.normal)
        }
        Some(c) => {
            let matrix = DMat3::from_cols(a.normal, b.normal, c.normal).transpose();
            if matrix.determinant().abs() < 1.0 - SMOOTH {
                return None;
            }
            matrix.inverse() * DVec3::new(height(a), height(b), height(c))
        }
    };
    step.is_finite().then_some(from + step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;

    /// A cylinder of radius 1 along z, cut off at z = 0.
    fn can() -> impl Field {
        let side = |p: DVec3| 1.0 - p.x * p.x - p.y * p.y;
        Closures {
            omega: move |p: DVec3| side(p).min(-p.z),
            gradient: move |p: DVec3| {
                if side(p) < -p.z { DVec3::new(-2.0 * p.x, -2.0 * p.y, 0.0) } else { -DVec3::Z }
            },
        }
    }

    #[test]
    fn the_rim_of_a_can_is_found_to_the_last_digits() {
        let faces = [
            FacePoint { point: DVec3::new(0.9, 0.0, 0.0), normal: DVec3::Z },
            FacePoint {
                point: DVec3::new(0.99, 0.14, -0.1),
                normal: DVec3::new(0.99, 0.14, 0.0).normalize(),
            },
        ];
        let start = DVec3::new(0.97, 0.05, -0.03);
        let found = find(&can(), start, &faces, 0.1, &mut 0).unwrap();
        assert!((found.x.hypot(found.y) - 1.0).abs() < 1e-14 && found.z.abs() < 1e-14, "{found}");
        assert!(found.distance(start) < 0.05);
    }

    #[test]
    fn a_smooth_bend_is_no_crease() {
        let ball = Closures { omega: |p: DVec3| 0.01 - p.length_squared(), gradient: |p: DVec3| -2.0 * p };
        let at = |angle: f64| DVec3::new(angle.cos(), angle.sin(), 0.0);
        let faces = [0.0, 0.9].map(|angle| FacePoint { point: 0.1 * at(angle), normal: at(angle) });
        assert_eq!(find(&ball, DVec3::new(0.095, 0.05, 0.0), &faces, 0.1, &mut 0), None);
    }

    #[test]
    fn three_faces_meet_in_a_corner() {
        let corner = Closures {
            omega: |p: DVec3| -p.max_element(),
            gradient: |p: DVec3| -DVec3::AXES[p.max_position()],
        };
        let faces = [0, 1, 2].map(|axis| {
            let mut point = DVec3::splat(-0.3);
            point[axis] = 0.0;
            FacePoint { point, normal: DVec3::AXES[axis] }
        });
        let found = find(&corner, DVec3::splat(-0.1), &faces, 1.0, &mut 0).unwrap();
        assert!(found.length() < 1e-15, "{found}");
    }
}
