//! One path against one field: where it first meets the obstacle, and the way out for a point inside.
//!
//! The field is only sampled. A part of an obstacle that a path crosses between two samples is not seen: the
//! `resolution` is the thinnest wall that surely holds. A swept query with guarantees can replace
//! [`first_contact`] without any other change.
//!
//! Invariant: a point returned here is in the fluid (ω < 0, strictly) and no division is by an unguarded |∇ω|.
//! ω = 0 counts as contact: an obstacle that stands on the container's floor has ω = 0 all over its
//! footprint, and particles must not creep under it.

use glam::DVec3;

use crate::field::Field;

/// Samples of one path at most; only a runaway particle needs more.
const MAX_SAMPLES: f64 = 4096.0;

/// A bracket shorter than this part of the coordinates' size is a point.
const POINT: f64 = 4.0 * f64::EPSILON;

/// Where a path meets an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Part of the path before the contact, 0 to 1.
    pub fraction: f64,
    /// The last point of the path in the fluid: on the surface to rounding, with ω < 0.
    pub point: DVec3,
    /// Outward unit normal there.
    pub normal: DVec3,
}

/// The field has no finite value or gradient at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Undefined {
    pub at: DVec3,
}

/// Number of samples after the start that a path of this length needs.
pub(super) fn samples(length: f64, resolution: f64) -> usize {
    (length / resolution).ceil().clamp(1.0, MAX_SAMPLES) as usize
}

/// First contact of the path `from → to`, sampled every `resolution` metres; `from` lies in the fluid.
///
/// # Errors
/// [`Undefined`] where a sample of ω is NaN, or ∇ω at the contact is not finite.
pub fn first_contact(
    field: &dyn Field,
    from: DVec3,
    to: DVec3,
    resolution: f64,
) -> Result<Option<Contact>, Undefined> {
    let count = samples(from.distance(to), resolution);
    let mut before = (0.0, omega(field, from)?);
    for k in 1..=count {
        let t = k as f64 / count as f64;
        let after = (t, omega(field, from.lerp(to, t))?);
        if after.1 >= 0.0 {
            let fraction = last_outside(field, from, to, before, after)?;
            let point = from.lerp(to, fraction);
            return Ok(Some(Contact { fraction, point, normal: normal(field, point, from - to)? }));
        }
        before = after;
    }
    Ok(None)
}

/// The nearest place in the fluid for a point inside, at most `reach` away: Newton steps of ω/|∇ω| along the
/// outward normal, or, where the gradient gives no answer, the shortest way along an axis. `None`: no way out.
///
/// # Errors
/// [`Undefined`] where ω is NaN.
pub fn push_out(field: &dyn Field, inside: DVec3, reach: f64) -> Result<Option<Contact>, Undefined> {
    let contact = |from: DVec3, to: DVec3| -> Result<Contact, Undefined> {
        let (outer, inner) = (omega(field, to)?, omega(field, from)?);
        let fraction = last_outside(field, to, from, (0.0, outer), (1.0, inner))?;
        let point = to.lerp(from, fraction);
        Ok(Contact { fraction, point, normal: normal(field, point, to - from)? })
    };

    let mut here = inside;
    for _ in 0..8 {
        let (w, gradient) = field.omega_grad(here);
        let slope = gradient.length();
        // the least step is a few rounding errors, or a point on the surface would never leave it
        let step = (w / slope).max(8.0 * POINT * here.abs().max_element()).max(f64::MIN_POSITIVE);
        let next = here - gradient * (step / slope);
        // a vanishing or undefined gradient fails here: infinite and NaN distances are not within reach
        let within_reach = next.distance(inside) <= reach;
        if !within_reach {
            break;
        }
        if omega(field, next)? < 0.0 {
            return contact(here, next).map(Some);
        }
        here = next;
    }

    // thirteen lengths from reach/64 to reach
    for k in 0..=12 {
        let distance = reach * 2.0f64.powf(0.5 * f64::from(k) - 6.0);
        for direction in [DVec3::Z, DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, -DVec3::Z] {
            let outside = inside + direction * distance;
            if omega(field, outside)? < 0.0 {
                return contact(inside, outside).map(Some);
            }
        }
    }
    Ok(None)
}

/// v − (1 + c_R)(v·n)n for a velocity into the obstacle; one that leaves it is kept. The paper prints
/// (1 − c_R), which for c_R = 1 would let the particle through.
pub(super) fn reflect(velocity: DVec3, normal: DVec3, restitution: f64) -> DVec3 {
    let speed = velocity.dot(normal);
    if speed < 0.0 { velocity - (1.0 + restitution) * speed * normal } else { velocity }
}

fn omega(field: &dyn Field, at: DVec3) -> Result<f64, Undefined> {
    let w = field.omega(at);
    if w.is_nan() { Err(Undefined { at }) } else { Ok(w) }
}

/// −∇ω/|∇ω|, or the direction the particle came from where the gradient vanishes.
fn normal(field: &dyn Field, at: DVec3, backward: DVec3) -> Result<DVec3, Undefined> {
    let (_, gradient) = field.omega_grad(at);
    if !gradient.is_finite() {
        return Err(Undefined { at });
    }
    // scaled first, so that neither a tiny nor a huge gradient is lost in its square
    let scaled = gradient / gradient.abs().max_element();
    Ok((-scaled).try_normalize().or_else(|| backward.try_normalize()).unwrap_or(DVec3::Z))
}

/// Largest known t with ω < 0 on the path, between a sample (t, ω) in the fluid and a later one that is not:
/// secant steps, every third a bisection.
fn last_outside(
    field: &dyn Field,
    from: DVec3,
    to: DVec3,
    (mut low, mut w_low): (f64, f64),
    (mut high, mut w_high): (f64, f64),
) -> Result<f64, Undefined> {
    let size = from.abs().max(to.abs()).max_element();
    let tolerance = POINT * (size / from.distance(to)).max(1.0);
    for k in 0..120 {
        let width = high - low;
        if width <= tolerance {
            break;
        }
        // nearer to either end than half the tolerance teaches nothing
        let margin = (0.5 * tolerance / width).min(0.5);
        let secant = w_low / (w_low - w_high);
        let part = if k % 3 == 2 || !secant.is_finite() { 0.5 } else { secant.clamp(margin, 1.0 - margin) };
        let t = low + part * width;
        let w = omega(field, from.lerp(to, t))?;
        if w < 0.0 {
            (low, w_low) = (t, w);
        } else {
            (high, w_high) = (t, w);
        }
    }
    Ok(low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{field::Closures, sph::scenes};

    #[test]
    fn reflection_law() {
        let down = DVec3::new(0.0, 0.0, -1.0);
        assert_eq!(reflect(down, DVec3::Z, 1.0), DVec3::Z);
        assert_eq!(reflect(down, DVec3::Z, 0.0), DVec3::ZERO);
        assert_eq!(reflect(DVec3::new(3.0, 0.0, -2.0), DVec3::Z, 0.5), DVec3::new(3.0, 0.0, 1.0));
        assert_eq!(reflect(DVec3::Z, DVec3::Z, 0.5), DVec3::Z);
    }

    #[test]
    fn contact_with_a_sphere_is_exact_and_outside() {
        let sphere = scenes::sphere(DVec3::ZERO, 1.0);
        let hit = first_contact(&sphere, DVec3::X * 2.0, DVec3::X * 0.2, 0.1).unwrap().unwrap();
        assert!((hit.point.x - 1.0).abs() < 1e-14 && sphere.omega(hit.point) < 0.0);
        assert!((hit.fraction - 1.0 / 1.8).abs() < 1e-14);
        assert!((hit.normal - DVec3::X).length() < 1e-14);
    }

    #[test]
    fn a_thin_plate_is_seen_at_its_resolution() {
        let plate = Closures {
            omega: |p: DVec3| 0.005 - p.x.abs(),
            gradient: |p: DVec3| DVec3::new(-p.x.signum(), 0.0, 0.0),
        };
        let hit = first_contact(&plate, DVec3::X * 0.5, -DVec3::X * 0.5, 0.009).unwrap().unwrap();
        assert!((hit.point.x - 0.005).abs() < 1e-14);
    }

    #[test]
    fn push_out_finds_the_surface_even_from_the_centre() {
        let sphere = scenes::sphere(DVec3::ONE, 0.5);
        for start in [DVec3::ONE, DVec3::new(1.0, 1.1, 1.0), DVec3::new(1.0, 1.0, 1.499)] {
            let out = push_out(&sphere, start, 2.0).unwrap().unwrap();
            assert!((out.point.distance(DVec3::ONE) - 0.5).abs() < 1e-12, "{out:?}");
            assert!(sphere.omega(out.point) < 0.0 && out.normal.is_normalized());
        }
        let everywhere = Closures { omega: |_: DVec3| 1.0, gradient: |_: DVec3| DVec3::ZERO };
        assert_eq!(push_out(&everywhere, DVec3::ZERO, 2.0), Ok(None));
        assert_eq!(push_out(&everywhere, DVec3::ZERO, 0.0), Ok(None));
    }

    #[test]
    fn undefined_fields_are_errors() {
        let hole = Closures { omega: |_: DVec3| f64::NAN, gradient: |_: DVec3| DVec3::NAN };
        assert!(first_contact(&hole, DVec3::ZERO, DVec3::X, 0.1).is_err());
        assert!(push_out(&hole, DVec3::ZERO, 1.0).is_err());
    }
}
