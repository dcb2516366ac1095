//! The way out of a place deep in a solid, looked for in all directions.
//!
//! Newton's method leaves it where the formula is nearly a distance, and the axes are often ways out, too. Where neither
//! leads out within reach, directions all around do: first many of them at several lengths, then those that the slope
//! turns them to. What is found is turned to the nearest place of the same piece of surface.
//!
//! A place within reach can still be missed, where a gap is narrow and no slope leads to it.

use std::array;

use glam::DVec3;

use super::contact::{Contact, Undefined, contact_between};
use crate::field::{Points, Walls};

/// The axes, the diagonals of the planes between them, and those of space.
const DIRECTIONS: usize = 26;

/// Lengths from reach/64 to reach.
const LENGTHS: i32 = 13;

/// Directions from which the slope is followed.
const FOLLOWED: usize = 4;

/// Steps of a direction along the slope.
const TURNS: u32 = 24;

/// The nearest place outside that is found at most `reach`, m, away, for a place inside. `None` if none is found.
///
/// # Errors
/// [`Undefined`] where ω is NaN on the way out.
pub(super) fn nearest_all_around(
    walls: &dyn Walls,
    inside: DVec3,
    reach: f64,
) -> Result<Option<Contact>, Undefined> {
    let directions = directions();
    let mut omega = [0.0; DIRECTIONS];
    for k in 1..=LENGTHS {
        let length = reach * 2.0f64.powf(0.5 * f64::from(k - LENGTHS));
        all_around(walls, inside, length, &directions, &mut omega);
        let outside = directions.iter().zip(omega).filter(|(_, w)| *w < 0.0);
        let mut nearest: Option<Contact> = None;
        for (direction, _) in outside {
            let found = contact_between(walls, inside, inside + length * direction, 0.0)?;
            nearest = Some(nearer(inside, nearest, found));
        }
        if let Some(found) = nearest {
            return turned_to_nearest(walls, inside, found).map(Some);
        }
    }
    let mut nearest = None;
    for start in most_promising(&directions, &omega) {
        if let Some(direction) = along_slope(walls, inside, reach, start) {
            let found = contact_between(walls, inside, inside + reach * direction, 0.0)?;
            nearest = Some(nearer(inside, nearest, turned_to_nearest(walls, inside, found)?));
        }
    }
    Ok(nearest)
}

fn directions() -> [DVec3; DIRECTIONS] {
    // the 27 vectors of −1, 0 and 1 but for the middle one
    let digit = |number: usize, place: usize| f64::from(u8::try_from(number / place % 3).unwrap_or(0)) - 1.0;
    array::from_fn(|k| {
        let number = if k < DIRECTIONS / 2 { k } else { k + 1 };
        DVec3::new(digit(number, 1), digit(number, 3), digit(number, 9)).normalize()
    })
}

/// ω at one length in each direction. NaN is not outside.
fn all_around(
    walls: &dyn Walls,
    inside: DVec3,
    length: f64,
    directions: &[DVec3; DIRECTIONS],
    omega: &mut [f64; DIRECTIONS],
) {
    let places = directions.map(|direction| inside + length * direction);
    let [x, y, z] = array::from_fn(|axis| places.map(|place| place[axis]));
    walls.omega_many(Points::new(&x, &y, &z), omega);
}

/// The directions with the least ω.
fn most_promising(
    directions: &[DVec3; DIRECTIONS],
    omega: &[f64; DIRECTIONS],
) -> impl Iterator<Item = DVec3> {
    let mut order: [usize; DIRECTIONS] = array::from_fn(|k| k);
    order.sort_by(|a, b| omega[*a].total_cmp(&omega[*b]));
    order.map(|k| directions[k]).into_iter().take(FOLLOWED)
}

/// A direction that is outside at a length, where the slope turns one that is not. The mean of all slopes met so far
/// points into a groove, too, where each single one points into the face on its other side.
fn along_slope(walls: &dyn Walls, inside: DVec3, length: f64, start: DVec3) -> Option<DVec3> {
    let mut direction = start;
    let mut sum = DVec3::ZERO;
    for _ in 0..TURNS {
        let (w, gradient) = walls.omega_grad(inside + length * direction);
        if w < 0.0 {
            return Some(direction);
        }
        // a vanishing or undefined gradient ends it
        sum -= gradient.try_normalize()?;
        direction = sum.try_normalize()?;
    }
    None
}

/// The place where the way out is along the normal, if turning the way there shortens it.
fn turned_to_nearest(walls: &dyn Walls, inside: DVec3, found: Contact) -> Result<Contact, Undefined> {
    let mut nearest = found;
    for _ in 0..TURNS {
        let length = nearest.point.distance(inside);
        let outside = inside + length * nearest.normal;
        let is_outside = walls.omega(outside) < 0.0;
        if length == 0.0 || outside == nearest.point || !is_outside {
            break;
        }
        let found = contact_between(walls, inside, outside, 0.0)?;
        if found.point.distance(inside) >= length {
            break;
        }
        nearest = found;
    }
    Ok(nearest)
}

fn nearer(inside: DVec3, known: Option<Contact>, found: Contact) -> Contact {
    match known {
        Some(known) if known.point.distance(inside) <= found.point.distance(inside) => known,
        Some(_) | None => found,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Closures, Field};

    #[test]
    fn directions_differ_and_have_the_length_one() {
        let all = directions();
        for (k, a) in all.iter().enumerate() {
            assert!(a.is_normalized() && all[..k].iter().all(|b| a.dot(*b) < 0.9), "{a}");
        }
    }

    /// Neither an axis nor a diagonal leads out, and the formula is far from a distance.
    #[test]
    fn a_face_in_any_direction_is_found_at_its_distance() {
        for normal in [DVec3::new(0.3, 0.5, 0.8), DVec3::new(-0.9, 0.2, 0.4), DVec3::new(0.1, -0.9, -0.4)] {
            let normal = normal.normalize();
            let face = Closures {
                omega: |p: DVec3| 1.0 - p.dot(normal).powi(3),
                gradient: |p: DVec3| -3.0 * p.dot(normal).powi(2) * normal,
            };
            let inside = 0.2 * normal + 0.3 * normal.any_orthonormal_vector();
            for reach in [0.801, 1.0, 5.0] {
                let out = nearest_all_around(&face, inside, reach).unwrap().unwrap();
                assert!((out.point - inside - 0.8 * normal).length() < 1e-6, "{normal}, {reach}: {out:?}");
                assert!(face.omega(out.point) < 0.0 && out.normal.dot(normal) > 1.0 - 1e-9);
            }
            assert_eq!(nearest_all_around(&face, inside, 0.799), Ok(None));
        }
    }

    /// In a groove between two faces the slopes point into one and the other.
    #[test]
    fn a_groove_is_found() {
        let [a, b] = [DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.5, -0.7, 0.4).normalize()];
        let outside_of = |p: DVec3| (1.0 - p.dot(a), 1.0 - p.dot(b));
        let groove = Closures {
            omega: |p: DVec3| outside_of(p).0.max(outside_of(p).1),
            gradient: |p: DVec3| if outside_of(p).0 > outside_of(p).1 { -a } else { -b },
        };
        // the nearest place of its bottom, which is where both are 1
        let bottom = (a + b) / (1.0 + a.dot(b));
        let out = nearest_all_around(&groove, DVec3::ZERO, 1.05 * bottom.length()).unwrap().unwrap();
        assert!(groove.omega(out.point) < 0.0 && out.point.length() <= 1.05 * bottom.length());
    }
}
