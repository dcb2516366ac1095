//! The path of one particle in a step: where it meets walls, and where it ends.

use glam::DVec3;

use super::{
    boundary::Boundary,
    contact::{Contact, Undefined, bounce, first_contact_during, push_out, reflect, turn_back},
};
use crate::{field::Path, geom::Aabb};

/// Maximum number of contacts of one particle in one step. After them it stays where it is.
const MAX_CONTACTS: usize = 4;

/// The part of a step in which a wall that moves is no longer met: too little to know where a path began.
const LEAST_LEFT: f64 = 1e-6;

/// Where a particle's path ends.
pub(super) struct End {
    pub at: DVec3,
    pub velocity: DVec3,
    /// Whether no wall can have passed it since.
    pub is_proven: bool,
}

impl Boundary {
    /// Where the path of a particle ends, and the velocity there. `hit` is called for each contact with the
    /// obstacle's number, the change of velocity, the velocity of the wall, and the place.
    ///
    /// A wall that moves takes the particle with it for the rest of the step: what is left of the path is
    /// passed relative to the wall, and searched from the instant of the contact on.
    pub(super) fn resolve(
        &self,
        from: DVec3,
        to: DVec3,
        velocity: DVec3,
        hit: impl Fn(usize, DVec3, DVec3, DVec3),
    ) -> Result<End, Undefined> {
        let (mut here, mut since, mut target, mut velocity) = (from, 0.0, to, velocity);
        for _ in 0..MAX_CONTACTS {
            (target, velocity) = self.hold_in_box(target, velocity);
            let Some((index, contact)) = self.nearest_contact(here, since, target)? else {
                let is_proven = 1.0 - since >= LEAST_LEFT || self.stays_outside(here, since)?;
                return Ok(End { at: target, velocity, is_proven });
            };
            let (obstacle, field) = (&self.obstacles[index], self.field(index));
            let before = velocity;
            // the bounce depends on the velocity relative to the wall
            let wall = self.wall_velocity(index, contact.point);
            if !wall.is_finite() {
                return Err(Undefined { at: contact.point });
            }
            let arriving = velocity - wall;
            velocity = wall + bounce(arriving, &contact, obstacle.restitution, obstacle.friction);
            let left = (1.0 - contact.fraction) * self.step;
            let along = match obstacle.moving {
                // by the velocity in the middle of the way, as walls turn
                Some(_) => left * field.wall_velocity(contact.point + 0.5 * left * wall),
                None => DVec3::ZERO,
            };
            let rest = target - contact.point - along;
            let slide = turn_back(rest, &contact, 0.0);
            (here, since) = (contact.point, contact.fraction);
            target = here + along + slide;
            // A tangent enters a hollow surface, and by rounding also a flat one: lift its end out again.
            if field.omega(target) >= 0.0
                && let Some((lifted, normal)) = self.lifted(index, target, &contact, along, slide)?
            {
                target = lifted;
                velocity = wall + reflect(velocity - wall, normal, obstacle.restitution);
            }
            hit(index, velocity - before, wall, contact.point);
        }
        // a wall that keeps moving may pass a particle that cannot go on
        let is_proven = self.stays_outside(here, since)?;
        Ok(End { at: here, velocity, is_proven })
    }

    /// Whether no wall that moves passes a place between a part of the step and its end.
    fn stays_outside(&self, here: DVec3, since: f64) -> Result<bool, Undefined> {
        for k in self.broad_phase.at(here).filter(|k| self.obstacles[*k].moving.is_some()) {
            let obstacle = &self.obstacles[k];
            let path = Path { start: since, ..Path::new(here, here, obstacle.resolution) };
            if first_contact_during(self.field(k), &path, self.clearance, self.step)?.is_some() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// A place beside the end of a path that is inside an obstacle after a contact, and the normal there: on
    /// the side of the contact, not behind a wall that moves.
    fn lifted(
        &self,
        index: usize,
        end: DVec3,
        contact: &Contact,
        along: DVec3,
        slide: DVec3,
    ) -> Result<Option<(DVec3, DVec3)>, Undefined> {
        let field = self.field(index);
        let reach = (slide.length() + along.length()).min(self.reach());
        let found = push_out(field, end, reach, self.clearance)?;
        if self.obstacles[index].moving.is_none() {
            return Ok(found.map(|lifted| (lifted.point, lifted.normal)));
        }
        if let Some(lifted) = found.filter(|lifted| lifted.normal.dot(contact.normal) > 0.0) {
            return Ok(Some((lifted.point, lifted.normal)));
        }
        let mut distance = self.clearance;
        while distance <= reach {
            let place = end + distance * contact.normal;
            if field.omega(place) < 0.0 {
                return Ok(Some((place, contact.normal)));
            }
            distance *= 2.0;
        }
        Ok(None)
    }

    /// The first contact on the way to a target, from a place where a particle is after a part of the step.
    fn nearest_contact(
        &self,
        here: DVec3,
        since: f64,
        target: DVec3,
    ) -> Result<Option<(usize, Contact)>, Undefined> {
        let mut nearest: Option<(usize, Contact)> = None;
        let left = 1.0 - since;
        for k in self.broad_phase.over(Aabb::new(here.min(target), here.max(target))) {
            let obstacle = &self.obstacles[k];
            let mut path = Path::new(here, target, obstacle.resolution);
            let is_late = obstacle.moving.is_some() && since > 0.0;
            if is_late {
                if left < LEAST_LEFT {
                    continue; // `stays_outside` looks at what little is left
                }
                // where it would have begun
                path.from = here - since / left * (target - here);
                path.start = since;
            }
            let duration = if obstacle.moving.is_some() { self.step } else { 0.0 };
            let Some(mut contact) = first_contact_during(self.field(k), &path, self.clearance, duration)?
            else {
                continue;
            };
            if !is_late {
                contact.fraction = since + left * contact.fraction;
            } else if contact.fraction <= since {
                contact.point = here;
            }
            if nearest.is_none_or(|(_, other)| contact.fraction < other.fraction) {
                nearest = Some((k, contact));
            }
        }
        Ok(nearest)
    }
}
