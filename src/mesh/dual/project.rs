//! From a point near the surface onto it.
//!
//! Newton's method is quick, but a solid's parts may have unlike scales. A little below a steep face the flat
//! face beside it may have the smaller ω, and Newton's method goes there. A search on the line along a known
//! normal finds the right face, because it uses signs alone.

use glam::DVec3;

use super::super::normals::unit;
use crate::field::Field;

/// Newton steps at most: twice as many as a smooth surface takes.
const STEPS: usize = 8;

/// A step this small, in sizes, ends the search, because the next one would be below rounding.
const LAST_STEP: f64 = 1e-9;

/// A face turns by less than this between a point and its foot (cosine).
pub(super) const SAME_FACE: f64 = 0.8;

/// The first step along a line, in sizes. Each next step is twice as long.
const FIRST_STEP: f64 = 1.0 / 64.0;

/// Steps of the bracketed search at most. Bisection alone would need fewer.
const BRACKETED: usize = 80;

/// A point of the surface and the face that it lies on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FacePoint {
    /// The point shows on which side of a crease the face lies.
    pub point: DVec3,
    /// The outward unit normal at the point.
    pub normal: DVec3,
}

/// The surface by Newton's method, within `size` of `start`. `None` if it leads farther away or does
/// not converge.
pub(super) fn newton(field: &dyn Field, start: DVec3, size: f64, count: &mut u64) -> Option<FacePoint> {
    let mut at = start;
    for _ in 0..STEPS {
        *count += 1;
        let (omega, gradient) = field.omega_grad(at);
        let step = gradient * (omega / gradient.length_squared());
        at -= step;
        if at.is_nan() || at.distance(start) > size {
            return None;
        }
        if step.length() <= LAST_STEP * size {
            return Some(FacePoint { point: at, normal: unit(-gradient)? });
        }
    }
    None
}

/// The surface on the line through `start` along an outward normal. `None` if it is more than `size` away.
pub(super) fn along(
    field: &dyn Field,
    start: DVec3,
    normal: DVec3,
    size: f64,
    count: &mut u64,
) -> Option<FacePoint> {
    if !(size > 0.0 && size.is_finite()) {
        return None; // steps without length would never end
    }
    let mut omega = |t: f64| {
        *count += 1;
        field.omega(start + t * normal)
    };
    let mut near = (0.0, omega(0.0));
    let inside = near.1 > 0.0;
    let outwards = if inside { 1.0 } else { -1.0 };
    let mut far = near;
    let mut reach = FIRST_STEP * size;
    while (far.1 > 0.0) == inside {
        if reach > size {
            return None;
        }
        near = far;
        far = (outwards * reach, omega(outwards * reach));
        reach *= 2.0;
    }
    // regula falsi; the end that stays counts half (Illinois), and every third step is a bisection
    for step in 0..BRACKETED {
        if (far.0 - near.0).abs() <= f64::EPSILON * size {
            break;
        }
        let share = near.1 / (near.1 - far.1);
        let share = if step % 3 == 2 || !(0.0..=1.0).contains(&share) { 0.5 } else { share };
        let t = near.0 + share * (far.0 - near.0);
        if t == near.0 || t == far.0 {
            break;
        }
        let found = (t, omega(t));
        if (found.1 > 0.0) == inside {
            near = found;
            far.1 *= 0.5;
        } else {
            far = found;
            near.1 *= 0.5;
        }
    }
    // the values may have been halved
    let ends = [near.0, far.0].map(|t| (omega(t).abs(), t));
    let t = if ends[0].0 <= ends[1].0 { ends[0].1 } else { ends[1].1 };
    *count += 1;
    let point = start + t * normal;
    Some(FacePoint { point, normal: unit(-field.omega_grad(point).1)? })
}

/// The surface within `size` of `start` where it faces about as `normal` does. `None` if no such point
/// is found.
pub(super) fn onto_face(
    field: &dyn Field,
    start: DVec3,
    normal: DVec3,
    size: f64,
    count: &mut u64,
) -> Option<FacePoint> {
    let faces_alike = |face: &FacePoint| face.normal.dot(normal) > SAME_FACE;
    newton(field, start, size, count)
        .filter(faces_alike)
        .or_else(|| along(field, start, normal, size, count).filter(faces_alike))
}

/// Whether the surface crosses the line along `normal` within `reach` of a point.
pub(super) fn is_within(field: &dyn Field, p: DVec3, normal: DVec3, reach: f64, count: &mut u64) -> bool {
    *count += 2;
    field.omega(p - reach * normal) > 0.0 && field.omega(p + reach * normal) <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;

    /// A steep floor z ≤ 0 and a flat wall x ≤ 0.1. A point that is deeper below the floor than a thousandth
    /// of its way to the wall gets the wall's ω.
    fn unlike() -> impl Field {
        let (floor, wall) = (|p: DVec3| -1000.0 * p.z, |p: DVec3| 0.1 - p.x);
        Closures {
            omega: move |p: DVec3| floor(p).min(wall(p)),
            gradient: move |p: DVec3| if floor(p) < wall(p) { -1000.0 * DVec3::Z } else { -DVec3::X },
        }
    }

    #[test]
    fn a_known_normal_finds_the_right_face() {
        let start = DVec3::new(0.05, 0.0, -0.001);
        let lost = newton(&unlike(), start, 1.0, &mut 0).unwrap();
        assert!((lost.point.x - 0.1).abs() < 1e-15);
        let found = onto_face(&unlike(), start, DVec3::Z, 1.0, &mut 0).unwrap();
        assert!(found.point.distance(DVec3::new(0.05, 0.0, 0.0)) < 1e-15, "{found:?}");
        assert_eq!(found.normal, DVec3::Z);
        assert!(is_within(&unlike(), start, DVec3::Z, 0.0011, &mut 0));
        assert!(!is_within(&unlike(), start, DVec3::Z, 0.0009, &mut 0));
    }

    #[test]
    fn a_line_finds_curved_flat_and_jumping_surfaces_from_both_sides() {
        for omega in
            [|z: f64| 1.0 - z * z, |z: f64| (1.0 - z).powi(3), |z: f64| if z < 1.0 { 1e6 } else { -1e-6 }]
        {
            let field = Closures { omega: move |p: DVec3| omega(p.z), gradient: |_| -DVec3::Z };
            for from in [0.7, 1.25] {
                let found = along(&field, from * DVec3::Z, DVec3::Z, 0.5, &mut 0).unwrap();
                assert!((found.point.z - 1.0).abs() < 1e-5, "{found:?}");
            }
            assert_eq!(along(&field, 0.3 * DVec3::Z, DVec3::Z, 0.5, &mut 0), None);
            assert_eq!(along(&field, 0.7 * DVec3::Z, DVec3::Z, 0.0, &mut 0), None);
            assert_eq!(along(&field, 0.7 * DVec3::Z, DVec3::NAN, 0.5, &mut 0), None);
        }
    }
}
