//! The contact of one path with one obstacle, and the way out for a point inside.
//!
//! The field finds the contact itself ([`Walls::first_entry`]). For compiled solids it is proven that no wall
//! is passed, however thin. A closure, whose range is unknown, is sampled: its `resolution` is the thinnest
//! wall that surely stops a particle.
//!
//! A particle stops a little before the surface, so that its next path does not begin within the rounding
//! errors of the obstacle's formula.
//!
//! Invariant: a point returned here is strictly in the fluid (ω < 0), and no division is by an unguarded
//! |∇ω|. ω = 0 counts as contact: an obstacle that stands on the container's floor has ω = 0 all over its
//! footprint, and particles must not creep under it.

use glam::DVec3;

use crate::field::{Entry, Normals, Path, Walls, last_outside};

/// A bracket shorter than this part of the coordinates' size counts as a point.
const POINT: f64 = 4.0 * f64::EPSILON;

/// Maximum number of uncertain stretches of a path that samples may show to be free. A path with more of them
/// counts as a contact.
const MOST_DOUBTS: usize = 16;

/// Where a path meets an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Part of the path before the contact, 0 to 1.
    pub fraction: f64,
    /// A point of the path in the fluid (ω < 0): the clearance away from the surface, or the beginning of the
    /// path.
    pub point: DVec3,
    /// Outward unit normal of the surface. At edges and corners it is the mean of the normals of the faces
    /// that meet.
    pub normal: DVec3,
    /// Unit normals of these faces; empty where the gradient vanishes.
    pub faces: Normals,
}

/// The field has no finite value or gradient at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Undefined {
    /// The point, m.
    pub at: DVec3,
}

/// Why a particle cannot be put anywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::sph) enum Trouble {
    /// A field has no value at a point.
    Undefined(Undefined),
    /// All places near a point lie in obstacles, or behind them.
    NoRoom {
        /// The point, m.
        at: DVec3,
    },
}

impl From<Undefined> for Trouble {
    fn from(undefined: Undefined) -> Self {
        Self::Undefined(undefined)
    }
}

/// First contact of a path that begins in the fluid; `None` if there is none. The contact's point is
/// `clearance`, m, before the surface, measured along its normal.
///
/// # Errors
/// [`Undefined`] where ω is NaN, or ∇ω at the contact is not finite.
pub fn first_contact(field: &dyn Walls, path: &Path, clearance: f64) -> Result<Option<Contact>, Undefined> {
    first_contact_during(field, path, clearance, 0.0)
}

/// The first contact of a path that a particle takes `duration`, s, to pass, while the obstacle may move.
///
/// # Errors
/// [`Undefined`] where ω is NaN, or ∇ω at the contact is not finite.
pub(super) fn first_contact_during(
    field: &dyn Walls,
    path: &Path,
    clearance: f64,
    duration: f64,
) -> Result<Option<Contact>, Undefined> {
    let stop = |entry: &Entry| stop(field, path, entry, clearance, duration).map(Some);
    let mut rest = *path;
    for _ in 0..MOST_DOUBTS {
        let Some(entry) = field.first_entry(&rest) else {
            // the value of the field at the end decides, because it also decides whether a particle is inside
            return match omega(field, path.to)? {
                w if w < 0.0 => Ok(None),
                _ => stop(&Entry::new(path, (1.0, 1.0), true, Normals::default())),
            };
        };
        if entry.certain {
            return stop(&entry);
        }
        if let Some((t, w)) = entry
            .first_sample_met(path, |t| field.on_path(path, t))
            .filter(|(t, w)| w.is_nan() || *t > path.start)
        {
            if w.is_nan() {
                return Err(Undefined { at: path.at(t) });
            }
            return stop(&entry);
        }
        if entry.until >= 1.0 {
            return Ok(None); // the last sample was the end of the path
        }
        rest.start = entry.until.next_up();
    }
    stop(&Entry::new(path, (rest.start, 1.0), true, Normals::default()))
}

/// The contact at which a path stops before an entry. The particle takes `duration`, s, to pass the whole path.
fn stop(
    field: &dyn Walls,
    path: &Path,
    entry: &Entry,
    clearance: f64,
    duration: f64,
) -> Result<Contact, Undefined> {
    let mut step = path.to - path.from;
    let normal = match entry.normals.mean() {
        Some(normal) => normal,
        None => normal(field, entry.point, -step)?,
    };
    if duration > 0.0 {
        // the way relative to the wall, which may come to a particle at rest
        step -= duration * field.wall_velocity(entry.point);
    }
    let approach = -step.dot(normal);
    // a path that hardly approaches goes back to its beginning and loses nothing: its rest goes on from there
    let back = clearance / if approach > 0.0 { approach } else { step.length() };
    let mut fraction = if back.is_finite() { (entry.t - back).max(path.start) } else { path.start };
    let mut less = POINT * (1.0 + path.from.abs().max(path.to.abs()).max_element() / step.length());
    while fraction > path.start && on_path(field, path, fraction)? >= 0.0 {
        fraction = (fraction - less).max(path.start);
        less *= 4.0;
    }
    let fraction = if fraction.is_nan() { path.start } else { fraction };
    let point = if fraction == 0.0 { path.from } else { path.at(fraction) };
    Ok(Contact { fraction, point, normal, faces: entry.normals })
}

/// The nearest place in the fluid for a point inside an obstacle, at most `reach`, m, away; `None` if there
/// is no way out. The search takes Newton steps of ω/|∇ω| along the outward normal. Where the gradient is no
/// help, it takes the shortest way along an axis. The place is then moved `clearance`, m, farther, if that is
/// in the fluid.
///
/// # Errors
/// [`Undefined`] where ω is NaN.
pub fn push_out(
    field: &dyn Walls,
    inside: DVec3,
    reach: f64,
    clearance: f64,
) -> Result<Option<Contact>, Undefined> {
    push_out_to(field, inside, reach, clearance, |_| true)
}

/// The nearest place, as [`push_out`] finds it, that also fulfils a condition.
///
/// # Errors
/// [`Undefined`] where ω is NaN.
pub(super) fn push_out_to(
    field: &dyn Walls,
    inside: DVec3,
    reach: f64,
    clearance: f64,
    is_wanted: impl Fn(DVec3) -> bool,
) -> Result<Option<Contact>, Undefined> {
    let contact = |from, to| contact_between(field, from, to, clearance);
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
            let found = contact(here, next)?;
            if is_wanted(found.point) {
                return Ok(Some(found));
            }
            break;
        }
        here = next;
    }

    // thirteen lengths from reach/64 to reach
    for k in 0..=12 {
        let distance = reach * 2.0f64.powf(0.5 * f64::from(k) - 6.0);
        let mut nearest: Option<Contact> = None;
        for direction in [DVec3::Z, DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, -DVec3::Z] {
            let outside = inside + direction * distance;
            if omega(field, outside)? < 0.0 {
                let found = contact(inside, outside)?;
                let is_nearer = nearest
                    .as_ref()
                    .is_none_or(|known| found.point.distance(inside) < known.point.distance(inside));
                if is_nearer && is_wanted(found.point) {
                    nearest = Some(found);
                }
            }
        }
        if nearest.is_some() {
            return Ok(nearest);
        }
    }
    Ok(None)
}

/// The contact where a straight way from a place inside to one outside leaves the obstacle, `clearance`, m, farther if
/// that is in the fluid. If the way leaves it more than once, it is any of these places.
pub(super) fn contact_between(
    field: &dyn Walls,
    inside: DVec3,
    outside: DVec3,
    clearance: f64,
) -> Result<Contact, Undefined> {
    let (outer, inner) = (omega(field, outside)?, omega(field, inside)?);
    let path = Path::new(outside, inside, f64::INFINITY);
    // the obstacle is taken at the end of the step, not on its way there
    let fraction = last_outside(|t| field.omega(path.at(t)), &path, (0.0, outer), (1.0, inner));
    let point = path.at(fraction);
    let mut faces = Normals::default();
    let normal = normal(field, point, outside - inside)?;
    faces.add(normal);
    // a little farther, so that the next path does not begin on the surface itself
    let lifted = point + clearance * normal;
    let point = if omega(field, lifted)? < 0.0 { lifted } else { point };
    Ok(Contact { fraction, point, normal, faces })
}

/// A velocity (or a displacement) reflected by each of several faces into which it points, one after the
/// other.
pub(super) fn turn_back(mut velocity: DVec3, contact: &Contact, restitution: f64) -> DVec3 {
    if contact.faces.len() < 2 {
        return reflect(velocity, contact.normal, restitution);
    }
    for normal in contact.faces.iter() {
        velocity = reflect(velocity, normal, restitution);
    }
    // reflection at a later face may turn it into an earlier one again
    for normal in contact.faces.iter() {
        velocity = reflect(velocity, normal, 0.0);
    }
    velocity
}

/// The reflected velocity v − (1 + c_R)(v·n)n, if it points into the obstacle; one that leaves it is kept.
/// The paper prints (1 − c_R), which for c_R = 1 would let the particle through.
pub(super) fn reflect(velocity: DVec3, normal: DVec3, restitution: f64) -> DVec3 {
    let speed = velocity.dot(normal);
    if speed < 0.0 { velocity - (1.0 + restitution) * speed * normal } else { velocity }
}

/// The velocity with which a particle leaves a contact at which it arrives with a velocity, m/s, both relative
/// to the wall: reflected with a restitution c_R, 0 to 1, and slowed along the face by friction μ times the
/// change of its normal velocity. A particle that is leaving already keeps its velocity.
pub fn bounce(arriving: DVec3, contact: &Contact, restitution: f64, friction: f64) -> DVec3 {
    rubbed(arriving, turn_back(arriving, contact, restitution), contact.normal, friction)
}

/// A velocity after a contact with friction. The contact changed it from `before` to `after`; along the face
/// it loses μ times the change along the normal, at most all of it.
pub(super) fn rubbed(before: DVec3, after: DVec3, normal: DVec3, friction: f64) -> DVec3 {
    let change = (after - before).dot(normal).abs();
    let along = after - after.dot(normal) * normal;
    let speed = along.length();
    if friction == 0.0 || speed == 0.0 { after } else { after - along * (friction * change / speed).min(1.0) }
}

/// ω at a part of a path, at the time at which the path passes it.
fn on_path(field: &dyn Walls, path: &Path, t: f64) -> Result<f64, Undefined> {
    let w = field.on_path(path, t);
    if w.is_nan() { Err(Undefined { at: path.at(t) }) } else { Ok(w) }
}

fn omega(field: &dyn Walls, at: DVec3) -> Result<f64, Undefined> {
    let w = field.omega(at);
    if w.is_nan() { Err(Undefined { at }) } else { Ok(w) }
}

/// The normal −∇ω/|∇ω|, or the direction from which the particle came where the gradient vanishes.
fn normal(field: &dyn Walls, at: DVec3, backward: DVec3) -> Result<DVec3, Undefined> {
    let (_, gradient) = field.omega_grad(at);
    if !gradient.is_finite() {
        return Err(Undefined { at });
    }
    // scaled first, so that neither a tiny nor a huge gradient is lost in its square
    let scaled = gradient / gradient.abs().max_element();
    Ok((-scaled).try_normalize().or_else(|| backward.try_normalize()).unwrap_or(DVec3::Z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;
    use crate::sph::scenes;

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
        let path = Path::new(DVec3::X * 2.0, DVec3::X * 0.2, 0.1);
        let hit = first_contact(&*sphere, &path, 0.0).unwrap().unwrap();
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
        let path = Path::new(DVec3::X * 0.5, -DVec3::X * 0.5, 0.009);
        let hit = first_contact(&plate, &path, 1e-6).unwrap().unwrap();
        assert!((hit.point.x - 0.005 - 1e-6).abs() < 1e-14);
    }

    #[test]
    fn push_out_finds_the_surface_even_from_the_centre() {
        let sphere = scenes::sphere(DVec3::ONE, 0.5);
        for start in [DVec3::ONE, DVec3::new(1.0, 1.1, 1.0), DVec3::new(1.0, 1.0, 1.499)] {
            let out = push_out(&*sphere, start, 2.0, 0.0).unwrap().unwrap();
            assert!((out.point.distance(DVec3::ONE) - 0.5).abs() < 1e-12, "{out:?}");
            assert!(sphere.omega(out.point) < 0.0 && out.normal.is_normalized());
        }
        // Newton's step of 1.2 is not within this reach: the shortest of the ways along the axes is
        let ball = scenes::sphere(DVec3::ZERO, 0.5);
        for start in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Z].map(|axis| 0.1 * axis) {
            let out = push_out(&*ball, start, 0.5, 0.0).unwrap().unwrap();
            assert!((out.point - 5.0 * start).length() < 1e-12, "{start}: {out:?}");
        }
        let everywhere = Closures { omega: |_: DVec3| 1.0, gradient: |_: DVec3| DVec3::ZERO };
        assert_eq!(push_out(&everywhere, DVec3::ZERO, 2.0, 0.0), Ok(None));
        assert_eq!(push_out(&everywhere, DVec3::ZERO, 0.0, 0.0), Ok(None));
    }

    #[test]
    fn undefined_fields_are_errors() {
        let hole = Closures { omega: |_: DVec3| f64::NAN, gradient: |_: DVec3| DVec3::NAN };
        assert!(first_contact(&hole, &Path::new(DVec3::ZERO, DVec3::X, 0.1), 0.0).is_err());
        assert!(push_out(&hole, DVec3::ZERO, 1.0, 0.0).is_err());
    }
}
