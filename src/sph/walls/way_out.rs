//! The way out for particles over which walls have moved.
//!
//! A particle that a moving wall meets on its path is put before it. But a path ends after at most a few
//! contacts, and then a wall that keeps moving may reach the place where the particle stopped, or press it
//! into another wall. So at the end of a step all obstacles are looked at together: the particle goes to a
//! place near it that is outside all of them, without passing one on the way. If there is none, the fluid has
//! nowhere to go, and the run ends, because a particle that stays inside would be an error that nobody
//! notices.

use glam::DVec3;

use crate::{field::Path, geom::Aabb};

use super::{
    boundary::Boundary,
    contact::{Trouble, Undefined, first_contact, push_out_to, reflect},
    flight::End,
};

/// Maximum number of walls that push a particle on, one after the other.
const ROUNDS: usize = 8;

/// Number of times that a way which begins on a surface is looked at again from a slightly later point, up to
/// half of it.
const LATER: i32 = 16;

/// Clearances after which a way has left the surface that it begins on.
const BEGINNING: f64 = 4.0;

/// Number of distances at which a place is looked for all around, the longest a support radius.
const DISTANCES: i32 = 13;

impl Boundary {
    /// Moves a particle out of all obstacles at the end of a step in which it came from `from`, and gives it
    /// the velocity that their walls leave it. `hit` is called for each of them with its number, the change
    /// of velocity, the velocity of the wall, and the place.
    pub(super) fn leave_moving(
        &self,
        from: DVec3,
        End { at, mut velocity, is_proven }: End,
        hit: impl Fn(usize, DVec3, DVec3, DVec3),
    ) -> Result<(DVec3, DVec3), Trouble> {
        if self.all_at_rest() || is_proven && self.first_around(at)?.is_none() {
            return Ok((at, velocity));
        }
        let out = match self.one_after_the_other(from, at)? {
            Some(out) => out,
            None => self.all_around(from, at)?.ok_or(Trouble::NoRoom { at })?,
        };
        for k in self.broad_phase.at(at) {
            let (obstacle, field) = (&self.obstacles[k], self.field(k));
            if field.omega(at) < 0.0 {
                continue;
            }
            let (wall, before) = (self.wall_velocity(k, out), velocity);
            if !wall.is_finite() {
                return Err(Undefined { at: out }.into());
            }
            let normal = (-field.omega_grad(out).1).try_normalize().unwrap_or((out - at).normalize_or_zero());
            velocity = wall + reflect(velocity - wall, normal, obstacle.restitution);
            hit(k, velocity - before, wall, out);
        }
        Ok((out, velocity))
    }

    /// The first obstacle that a point lies in.
    fn first_around(&self, at: DVec3) -> Result<Option<usize>, Undefined> {
        for k in self.broad_phase.at(at) {
            let omega = self.field(k).omega(at);
            if omega.is_nan() {
                return Err(Undefined { at });
            }
            if omega >= 0.0 {
                return Ok(Some(k));
            }
        }
        Ok(None)
    }

    /// Whether a point is in the box, and the straight way to it during the step passes no obstacle.
    fn is_within_reach(&self, from: DVec3, to: DVec3) -> Result<bool, Undefined> {
        for k in self.broad_phase.over(Aabb::new(from.min(to), from.max(to))) {
            if !self.is_free(k, from, to)? {
                return Ok(false);
            }
        }
        Ok(self.domain.contains(to))
    }

    /// Whether the straight way during the step passes no surface of an obstacle. It may begin on one, within rounding
    /// errors, and leave it.
    fn is_free(&self, k: usize, from: DVec3, to: DVec3) -> Result<bool, Undefined> {
        let (obstacle, field) = (&self.obstacles[k], self.field(k));
        let mut path = Path::new(from, to, obstacle.resolution);
        for later in 0..LATER {
            let Some(contact) = first_contact(field, &path, self.clearance)? else { return Ok(true) };
            let way = to - from - self.step * self.wall_velocity(k, contact.point);
            if contact.fraction > path.start {
                return Ok(false);
            }
            // a surface met within rounding errors may have no normal at the time of the contact: a way of
            // some clearances shows whether it is left
            let shortest = (BEGINNING * self.clearance / way.length()).min(0.5);
            let leaves = match contact.faces.is_empty() {
                true => path.start < shortest && field.on_path(&path, shortest) < 0.0,
                false => way.dot(contact.normal) > 0.0,
            };
            if !leaves {
                return Ok(false);
            }
            path.start =
                2.0f64.powi(later - LATER).max(if contact.faces.is_empty() { shortest } else { 0.0 });
        }
        Ok(false)
    }

    /// Leaves one obstacle by the nearest way, then the next.
    fn one_after_the_other(&self, from: DVec3, at: DVec3) -> Result<Option<DVec3>, Undefined> {
        let mut here = at;
        for _ in 0..ROUNDS {
            let Some(k) = self.first_around(here)? else {
                let near = here.distance(at) <= self.reach();
                return Ok((near && self.is_within_reach(from, here)?).then_some(here));
            };
            // the nearest way out may lead through a wall of the box
            let in_box = |p: DVec3| self.domain.contains(p);
            match push_out_to(self.field(k), here, self.reach(), self.clearance, in_box)? {
                Some(lifted) => here = lifted.point,
                None => break,
            }
        }
        Ok(None)
    }

    /// The nearest of some places all around.
    fn all_around(&self, from: DVec3, at: DVec3) -> Result<Option<DVec3>, Undefined> {
        for k in 0..DISTANCES {
            let distance = self.reach() * 2.0f64.powf(0.5 * f64::from(k + 1 - DISTANCES));
            for direction in directions() {
                let place = at + distance * direction;
                if self.domain.contains(place)
                    && self.first_around(place)?.is_none()
                    && self.is_within_reach(from, place)?
                {
                    return Ok(Some(place));
                }
            }
        }
        Ok(None)
    }
}

/// Unit vectors to the sides, edges and corners of a cube.
fn directions() -> impl Iterator<Item = DVec3> {
    let steps = [0.0, 1.0, -1.0];
    let all = steps.into_iter().flat_map(move |z| {
        steps.into_iter().flat_map(move |x| steps.into_iter().map(move |y| DVec3::new(x, y, z)))
    });
    all.filter_map(DVec3::try_normalize)
}
