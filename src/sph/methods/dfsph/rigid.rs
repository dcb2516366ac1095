//! The motion of a fluid as a whole.

use glam::{DMat3, DVec3};

use crate::sph::particles::Vectors;

/// The rigid motion with the momentum and the angular momentum of particles of equal mass.
#[derive(Default)]
pub(super) struct Rigid {
    centre: DVec3,
    /// Velocity of the centre, m/s.
    velocity: DVec3,
    /// Angular velocity, 1/s.
    turning: DVec3,
}

impl Rigid {
    /// The motion of particles at the places `at`, m, with the given velocities, m/s.
    pub fn of(at: &Vectors, velocity: &Vectors) -> Self {
        let n = at.len().max(1) as f64;
        let all = || (0..at.len()).map(|i| (at.get(i), velocity.get(i)));
        let centre = all().map(|(x, _)| x).sum::<DVec3>() / n;
        let mean = all().map(|(_, v)| v).sum::<DVec3>() / n;
        let (mut inertia, mut momentum) = (DMat3::ZERO, DVec3::ZERO);
        for (x, v) in all() {
            let r = x - centre;
            momentum += r.cross(v - mean);
            inertia += r.length_squared() * DMat3::IDENTITY - DMat3::from_cols(r * r.x, r * r.y, r * r.z);
        }
        // particles on a line have no angular velocity around it
        let turning = inertia.inverse() * momentum;
        let turning = if turning.is_finite() { turning } else { DVec3::ZERO };
        Self { centre, velocity: mean, turning }
    }

    /// Its velocity at a place, m/s.
    pub fn at(&self, place: DVec3) -> DVec3 {
        self.velocity + self.turning.cross(place - self.centre)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn particles_that_move_as_one_have_that_motion() {
        let (mut at, mut velocity) = (Vectors::default(), Vectors::default());
        at.resize(20);
        velocity.resize(20);
        let (drift, turning) = (DVec3::new(3.0, -1.0, 0.5), DVec3::new(0.2, 1.0, -2.0));
        for i in 0..20 {
            let k = i as f64;
            let place = DVec3::new((3.0 * k).sin(), (5.0 * k).cos(), 0.1 * k);
            at.set(i, place);
            velocity.set(i, drift + turning.cross(place));
        }
        let found = Rigid::of(&at, &velocity);
        for place in [DVec3::ZERO, DVec3::new(1.0, -2.0, 4.0)] {
            assert!((found.at(place) - drift - turning.cross(place)).length() < 1e-12);
        }
    }

    #[test]
    fn a_lone_particle_does_not_turn() {
        let (mut at, mut velocity) = (Vectors::default(), Vectors::default());
        at.resize(1);
        velocity.resize(1);
        velocity.set(0, DVec3::Y);
        assert_eq!(Rigid::of(&at, &velocity).at(DVec3::splat(7.0)), DVec3::Y);
        assert_eq!(Rigid::of(&Vectors::default(), &Vectors::default()).at(DVec3::ONE), DVec3::ZERO);
    }
}
