//! Particles that have entered walls: put back to the surface, and reflected.

use glam::DVec3;

use super::all_directions::nearest_all_around;
use super::contact::{Contact, Undefined, bounce, push_out};
use crate::field::{Normals, Walls};

/// The longest reach, m, that is searched at once.
const LONG: f64 = 4096.0;

/// Each search of a longer reach goes this much farther than the last.
const LENGTHENS: f64 = 64.0;

/// Number of these searches: the last goes 64⁶ m ≈ 7e10 m.
const LENGTHENED: i32 = 7;

/// How walls act on a particle that has entered them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rebound {
    restitution: f64,
    friction: f64,
    reach: f64,
}

impl Rebound {
    /// An answer by the part of the normal speed that returns; by Coulomb's coefficient, so that the tangential speed
    /// loses at most this part of the change of the normal speed; and by the farthest that a particle is moved, m.
    ///
    /// # Errors
    /// What is wrong with a number.
    pub fn new(restitution: f64, friction: f64, reach: f64) -> Result<Self, String> {
        let range = |name: &str, value: f64, fits: bool, expected: &str| match fits {
            true => Ok(()),
            false => Err(format!("{name} is {value}, expected {expected}")),
        };
        range("restitution", restitution, (0.0..=1.0).contains(&restitution), "0 to 1")?;
        range("friction", friction, (0.0..f64::INFINITY).contains(&friction), "0 or more")?;
        range("reach", reach, reach > 0.0, "a length above 0")?;
        Ok(Self { restitution, friction, reach })
    }
}

/// What became of a particle that was not outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Collision {
    /// It was inside, and has been put back.
    Hit,
    /// It is inside, and there is no way out within reach. It was left as it is.
    Stuck,
    /// Its place or its velocity is not finite, or ω has no value there. It was left as it is.
    Undefined,
}

/// Puts a particle that has entered walls (ω ≥ 0) back to the nearest place outside, and reflects its
/// velocity relative to the surface's own. In a corner it loses its speed towards all faces that it has
/// passed. `None` if it is outside, unless its velocity is not finite.
///
/// `walls` is a [`Solid`](crate::Solid), at the time of the particle if it moves, or a field with its sign
/// and its surface: that of [`Solid::surface`](crate::Solid::surface) is faster for many parts. Only places
/// count, not the way there: a particle that has passed a thin part is outside.
/// [`first_contact`](super::first_contact) sees such a part.
///
/// ```
/// use rfm::{Program, glam::DVec3, sph::{Collision, Rebound, collide}};
///
/// let ball = Program::from_source("ball", "rfm 1\nsolid ball = sphere(1)")?.solid("ball")?;
/// let rebound = Rebound::new(0.5, 0.0, 0.2)?; // half of the normal speed returns; nothing moves farther than 0.2 m
/// let (mut place, mut velocity) = (DVec3::new(0.0, 0.0, 0.9), DVec3::new(1.0, 0.0, -2.0));
/// assert_eq!(collide(&ball, &rebound, &mut place, &mut velocity), Some(Collision::Hit));
/// assert!((place - DVec3::Z).length() < 1e-12 && (velocity - DVec3::new(1.0, 0.0, 1.0)).length() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn collide(
    walls: &dyn Walls,
    rebound: &Rebound,
    position: &mut DVec3,
    velocity: &mut DVec3,
) -> Option<Collision> {
    let is_outside = velocity.is_finite() && walls.omega(*position) < 0.0;
    (!is_outside).then(|| put_back(walls, rebound, position, velocity))
}

/// [`collide`] for a particle that is known not to be outside, from ω in columns for instance.
pub fn put_back(
    walls: &dyn Walls,
    rebound: &Rebound,
    position: &mut DVec3,
    velocity: &mut DVec3,
) -> Collision {
    if !(position.is_finite() && velocity.is_finite()) {
        return Collision::Undefined;
    }
    let contact = match through_one_face(walls, *position, rebound.reach) {
        Some(contact) => Ok(Some(contact)),
        None => way_out_nearby(walls, *position, rebound.reach),
    };
    let contact = match contact {
        Ok(Some(contact)) => contact,
        Ok(None) => return Collision::Stuck,
        Err(_) => return Collision::Undefined,
    };
    let wall = walls.wall_velocity(contact.point);
    *velocity = wall + bounce(*velocity - wall, &contact, rebound.restitution, rebound.friction);
    *position = contact.point;
    Collision::Hit
}

/// The place outside that Newton's method finds behind a face, within some rounding errors of its surface.
/// Most particles that are hit have passed one face: a flat one takes two gradients, a curved one four.
/// `None` if another face is met on the way, or if no such place is found within reach.
fn through_one_face(walls: &dyn Walls, from: DVec3, reach: f64) -> Option<Contact> {
    let mut here = from;
    let mut first = None;
    let mut last = f64::INFINITY;
    for _ in 0..8 {
        let (w, gradient) = walls.omega_grad(here);
        let slope = gradient.length();
        let (normal, distance) = (-gradient / slope, w / slope);
        let rounding = least_step(here);
        // steps that do not shrink fast may have gone past a gap, or the formula is far from a distance
        let is_close = distance.abs() <= rounding || distance.abs() <= 0.25 * last;
        // an undefined or vanishing gradient ends it, too
        if !(is_close && is_alike(*first.get_or_insert(normal), normal)) {
            return None;
        }
        if w < 0.0 && (-distance).min(last) <= rounding {
            let mut faces = Normals::default();
            faces.add(normal);
            let contact = Contact { fraction: 1.0, point: here, normal, faces };
            return (here.distance(from) <= reach).then_some(contact);
        }
        // a little farther than the surface, so that a flat face takes two gradients
        here += normal * (distance + 0.5 * rounding);
        last = distance.abs();
    }
    None
}

/// Some rounding errors of a place, m: a particle on the surface would never leave it with less.
fn least_step(at: DVec3) -> f64 {
    (8.0 * f64::EPSILON * at.abs().max_element()).max(f64::MIN_POSITIVE)
}

/// The way out within reach. A search looks at a fixed number of lengths, and finds a place to the rounding errors of the
/// longest: so where the reach is very long, or has no end, places within a metre are searched first, and farther ones
/// only if there are none.
fn way_out_nearby(walls: &dyn Walls, from: DVec3, reach: f64) -> Result<Option<Contact>, Undefined> {
    if reach <= LONG {
        return way_out(walls, from, reach);
    }
    for k in 0..LENGTHENED {
        match way_out(walls, from, reach.min(LENGTHENS.powi(k))) {
            Ok(None) => {}
            // far away, formulas overflow
            Err(_) if k > 0 => return Ok(None),
            found => return found,
        }
    }
    Ok(None)
}

/// The nearest place outside, with all faces that are passed on the way there: in a corner of a vessel a particle is
/// behind several, and must not keep its speed towards any of them.
fn way_out(walls: &dyn Walls, from: DVec3, reach: f64) -> Result<Option<Contact>, Undefined> {
    let mut passed = Normals::default();
    let mut here = from;
    let mut found = push_out(walls, from, reach, 0.0)?;
    // a face takes Newton's method some steps, and `push_out` ends after eight
    for _ in 0..32 {
        let (w, gradient) = walls.omega_grad(here);
        // an undefined or vanishing gradient ends it, too
        let inside = w >= 0.0 && gradient.length_squared() > 0.0;
        if !inside {
            break;
        }
        let normal = -gradient.normalize();
        if !passed.iter().any(|known| is_alike(known, normal)) {
            passed.add(normal);
        }
        if found.is_none() {
            found = push_out(walls, here, reach, 0.0)?;
        }
        here += normal * (w / gradient.length()).max(least_step(here));
    }
    let is_near = |contact: &Contact| contact.point.distance(from) <= reach;
    let Some(found) = found.filter(is_near) else {
        return Ok(nearest_all_around(walls, from, reach)?.filter(is_near));
    };
    Ok(Some(found).map(|mut contact| {
        let mut faces = Normals::default();
        passed
            .iter()
            .filter(|normal| !is_alike(*normal, contact.normal))
            .for_each(|normal| faces.add(normal));
        if !faces.is_empty() {
            contact.faces.iter().for_each(|normal| faces.add(normal));
            contact.faces = faces;
        }
        contact
    }))
}

/// Whether two normals may be those of one face that is curved.
fn is_alike(a: DVec3, b: DVec3) -> bool {
    a.dot(b) > 0.99
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;
    use crate::sph::scenes;

    /// Works from the middle too, where the gradient vanishes.
    #[test]
    fn every_place_inside_a_ball_has_a_way_out() {
        let ball = scenes::sphere(DVec3::ZERO, 1.0);
        let rebound = Rebound::new(1.0, 0.0, 2.0).unwrap();
        for x in [0.0, 1e-300, 1e-8, 0.3, 0.999_999, 1.0] {
            let (mut place, mut velocity) = (DVec3::new(x, 0.0, 0.0), DVec3::new(-3.0, 1.0, 0.0));
            assert_eq!(collide(&*ball, &rebound, &mut place, &mut velocity), Some(Collision::Hit), "{x}");
            assert_eq!(collide(&*ball, &rebound, &mut place.clone(), &mut velocity.clone()), None, "{x}");
            assert!((place.length() - 1.0).abs() < 1e-12 && velocity.is_finite(), "{x}: {place}");
            assert!((velocity.length_squared() - 10.0).abs() < 1e-9, "{x}: {velocity}");
        }
    }

    /// A ball's Newton step is up to half its radius too long, and from the middle there is none.
    #[test]
    fn a_reach_from_the_least_to_none_finds_the_way_out_of_a_ball() {
        let ball = scenes::sphere(DVec3::ZERO, 1.0);
        for place in [DVec3::ZERO, DVec3::splat(1e-120), DVec3::splat(0.1), DVec3::splat(0.3), DVec3::Y * 0.2]
        {
            let depth = 1.0 - place.length();
            for reach in [depth + 1e-9, 1.01 * depth, 1.2 * depth, 10.0, 5000.0, 1e6, 1e100, f64::INFINITY] {
                let rebound = Rebound::new(0.0, 0.0, reach).unwrap();
                let mut now = place;
                let found = collide(&*ball, &rebound, &mut now, &mut DVec3::ZERO.clone());
                assert_eq!(found, Some(Collision::Hit), "{place}, {reach}");
                assert!((now.length() - 1.0).abs() < 1e-12, "{place}, {reach}: {now}");
                assert!(now.distance(place) <= reach, "{place}, {reach}: {now}");
            }
            let rebound = Rebound::new(0.0, 0.0, 0.99 * depth).unwrap();
            let found = collide(&*ball, &rebound, &mut place.clone(), &mut DVec3::ZERO.clone());
            assert_eq!(found, Some(Collision::Stuck), "{place}");
        }
        let everywhere = Closures { omega: |_: DVec3| 1.0, gradient: |_: DVec3| DVec3::ZERO };
        let rebound = Rebound::new(0.0, 0.0, f64::INFINITY).unwrap();
        let found = collide(&everywhere, &rebound, &mut DVec3::ZERO.clone(), &mut DVec3::ZERO.clone());
        assert_eq!(found, Some(Collision::Stuck));
    }

    #[test]
    fn what_cannot_be_put_back_stays() {
        let ball = scenes::sphere(DVec3::ZERO, 1.0);
        let rebound = Rebound::new(0.0, 0.0, 0.1).unwrap();
        let deep = DVec3::new(0.5, 0.0, 0.0);
        for (place, collision) in [(deep, Collision::Stuck), (DVec3::NAN, Collision::Undefined)] {
            let (mut now, mut velocity) = (place, DVec3::X);
            assert_eq!(collide(&*ball, &rebound, &mut now, &mut velocity), Some(collision));
            assert_eq!(
                (now.to_array().map(f64::to_bits), velocity),
                (place.to_array().map(f64::to_bits), DVec3::X)
            );
        }
        for (restitution, friction, reach) in
            [(1.5, 0.0, 1.0), (0.5, -1.0, 1.0), (0.5, 0.0, 0.0), (f64::NAN, 0.0, 1.0)]
        {
            assert!(Rebound::new(restitution, friction, reach).is_err());
        }
    }
}
