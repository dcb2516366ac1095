//! Particles that have entered a solid: put back to its surface, and reflected.

use rfm::Solid;
use rfm::glam::DVec3;
use rfm::sph::{self, push_out};

/// How a solid answers to what hits it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounce {
    /// Part of the normal speed that returns, 0 to 1.
    pub restitution: f64,
    /// Coulomb's coefficient: the tangential speed loses at most this part of the change of the normal speed.
    pub friction: f64,
    /// The farthest that a particle is moved, m.
    pub reach: f64,
}

/// What became of a particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Collision {
    /// It is outside the solid.
    None,
    /// It was inside, and has been put back.
    Hit,
    /// It is inside, and there is no way out within reach. It was left as it is.
    Stuck,
    /// Its place or its velocity is not finite, or ω has no value there. It was left as it is.
    Undefined,
}

/// Puts a particle that is inside a solid, or on its surface, back to the nearest place outside, and reflects its
/// velocity relative to the surface's own.
pub fn collide(solid: &Solid, bounce: &Bounce, position: &mut DVec3, velocity: &mut DVec3) -> Collision {
    if !(position.is_finite() && velocity.is_finite()) {
        return Collision::Undefined;
    }
    let omega = solid.omega(*position);
    if omega < 0.0 {
        return Collision::None;
    }
    let contact = match push_out(solid, *position, bounce.reach, 0.0) {
        Ok(Some(contact)) => contact,
        Ok(None) => return Collision::Stuck,
        Err(_) => return Collision::Undefined,
    };
    let wall = solid.wall_velocity(contact.point);
    *velocity = wall + sph::bounce(*velocity - wall, &contact, bounce.restitution, bounce.friction);
    *position = contact.point;
    Collision::Hit
}
