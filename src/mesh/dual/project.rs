//! From a point near the surface onto it.
//!
//! Newton's method is quick, but a solid's parts may have unlike scales. A little below a steep face the flat
//! face beside it may have the smaller ω, and Newton's method goes there. A search on the line along a known
//! normal finds the right face, because it uses signs alone.

use glam::DVec3;

use super::super::normals::unit;
use crate::field::Field;

/// Maximum number of Newton steps: twice as many as a smooth surface takes.
const STEPS: usize = 8;

/// A step this small, in sizes, ends the search, because the next one would be its square.
const LAST_STEP: f64 = 1e-9;

/// A step this small, relative to the largest coordinate, is rounding: coordinates are off by half of a last digit,
/// and ω of a moved solid by a few. (A formula with larger numbers than its coordinates rounds more.)
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A face turns by less than this between a point and its foot (cosine).
pub(super) const SAME_FACE: f64 = 0.8;

/// The first step along a line, in sizes. Each next step is twice as long.
const FIRST_STEP: f64 = 1.0 / 64.0;

/// Maximum number of steps of the bracketed search. Bisection alone would need fewer.
const BRACKETED: usize = 80;

/// A point of the surface and the face that it lies on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FacePoint {
    /// The point shows on which side of a crease the face lies.
    pub point: DVec3,
    /// The outward unit normal at the point.
    pub normal: DVec3,
}

/// A length near `p` that is as good as none: a share of a size, or rounding where that is larger. Far from the
/// origin no step of Newton's method gets below rounding, so a search that waited for it would fail.
pub(super) fn negligible(share: f64, size: f64, p: DVec3) -> f64 {
    (share * size).max(ROUNDING * p.abs().max_element())
}

/// A point of the surface within `size` of `start`, by Newton's method. `None` if it leads farther away or
/// does not converge.
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
        if step.length() <= negligible(LAST_STEP, size, at) {
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
    let t = root(omega, near, far, f64::EPSILON * size);
    *count += 1;
    let point = start + t * normal;
    Some(FacePoint { point, normal: unit(-field.omega_grad(point).1)? })
}

/// Where a function changes its sign between two places with values of unlike sign, within a tolerance.
///
/// Inverse quadratic interpolation where the last three places bend little enough for it, and bisection elsewhere
/// (Chandrupatla 1997): a smooth ω takes about eight values, and one that jumps hardly more than bisection does.
fn root(mut omega: impl FnMut(f64) -> f64, near: (f64, f64), far: (f64, f64), tolerance: f64) -> f64 {
    // the root lies between the last place and the other one; the third is the one that was left
    let (mut last, mut other) = (far, near);
    let mut nearest = if far.1.abs() < near.1.abs() { far } else { near };
    let mut share = 0.5;
    for _ in 0..BRACKETED {
        let t = last.0 + share * (other.0 - last.0);
        let found = (t, omega(t));
        let third =
            if (found.1 > 0.0) == (last.1 > 0.0) { last } else { std::mem::replace(&mut other, last) };
        last = found;
        nearest = if last.1.abs() < other.1.abs() { last } else { other };
        let least = tolerance / (other.0 - last.0).abs();
        if nearest.1 == 0.0 || least > 0.5 {
            break;
        }
        let place = (last.0 - other.0) / (third.0 - other.0);
        let value = (last.1 - other.1) / (third.1 - other.1);
        share = if value.powi(2) < place && (1.0 - value).powi(2) < 1.0 - place {
            let by_other = last.1 / (other.1 - last.1) * third.1 / (other.1 - third.1);
            let by_third = last.1 / (third.1 - last.1) * other.1 / (third.1 - other.1);
            by_other + (third.0 - last.0) / (other.0 - last.0) * by_third
        } else {
            0.5
        };
        share = if share.is_nan() { 0.5 } else { share.clamp(least, 1.0 - least) };
    }
    nearest.0
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
