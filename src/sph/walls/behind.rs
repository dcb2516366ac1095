//! The velocity that the fluid has behind walls. Only a fluid that must not be compressed needs it; others
//! carry none of this data.

use glam::DVec3;

use super::symmetric::Symmetric;

/// What is known of the motion behind the faces near a particle, a part of [`super::Coverage`]. It is `()`
/// for fluids that do not need it.
pub(in crate::sph) trait Behind: Copy + Default {
    /// What is known of one face at rest, with its λ.
    fn of_face(part: f64, normal: DVec3) -> Self;

    /// Lets all of these walls, whose K − λ·1 is `spread`, move with one velocity, m/s.
    fn set_in_motion(&mut self, spread: &Symmetric, velocity: DVec3);

    /// Two walls combined. `shares` are those of their λ in that of both, and `slopes` the derivatives by their λ.
    fn joined(&self, other: &Self, shares: impl FnOnce() -> [f64; 2], slopes: [f64; 2]) -> Self;

    /// What is known of bodies, with their λ and their K − λ·1, whose surface moves with a velocity, m/s.
    fn of_bodies(part: f64, normal: DVec3, spread: &Symmetric, velocity: impl FnOnce() -> DVec3) -> Self;

    /// What is known of a box with bodies in it, whose K add up: everything but the part of K is as for two
    /// walls.
    fn with_moments_of(self, of_box: &Self, bodies: &Self) -> Self;

    /// What is known of this part of the walls.
    fn in_part(self, part: f64) -> Self;
}

impl Behind for () {
    fn of_face(_: f64, _: DVec3) -> Self {}

    fn set_in_motion(&mut self, _: &Symmetric, _: DVec3) {}

    fn joined(&self, (): &Self, _: impl FnOnce() -> [f64; 2], _: [f64; 2]) -> Self {}

    fn of_bodies(_: f64, _: DVec3, _: &Symmetric, _: impl FnOnce() -> DVec3) -> Self {}

    fn with_moments_of(self, (): &Self, (): &Self) -> Self {}

    fn in_part(self, _: f64) -> Self {}
}

/// The directions across walls, and the velocities of walls with the weights that these have in K, across them alone.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::sph) struct Carried {
    /// Σ λ·n⊗n over the faces: the part of λ·1 that belongs to directions across walls.
    pub across: Symmetric,
    /// Σ λ·n⊗n·v, m/s.
    pub by_part: DVec3,
    /// (K − λ·1)·v, m/s.
    pub by_spread: DVec3,
}

impl Behind for Carried {
    fn of_face(part: f64, normal: DVec3) -> Self {
        Self { across: part * Symmetric::square(normal), ..Self::default() }
    }

    fn set_in_motion(&mut self, spread: &Symmetric, velocity: DVec3) {
        *self = Self { by_part: self.across * velocity, by_spread: *spread * velocity, across: self.across };
    }

    fn joined(&self, other: &Self, shares: impl FnOnce() -> [f64; 2], [da, db]: [f64; 2]) -> Self {
        let [sa, sb] = shares();
        Self {
            across: sa * self.across + sb * other.across,
            by_part: sa * self.by_part + sb * other.by_part,
            by_spread: da * self.by_spread + db * other.by_spread,
        }
    }

    fn of_bodies(part: f64, normal: DVec3, spread: &Symmetric, velocity: impl FnOnce() -> DVec3) -> Self {
        let mut bodies = Self::of_face(part, normal);
        bodies.set_in_motion(spread, velocity());
        bodies
    }

    fn with_moments_of(self, of_box: &Self, bodies: &Self) -> Self {
        Self { by_spread: of_box.by_spread + bodies.by_spread, ..self }
    }

    fn in_part(self, part: f64) -> Self {
        let Self { across, by_part, by_spread } = self;
        Self { across: part * across, by_part: part * by_part, by_spread: part * by_spread }
    }
}
