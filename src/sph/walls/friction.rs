//! Friction between walls and a viscous fluid, which sticks to them or slips along them. A fluid without
//! viscosity carries none of this data.

use glam::DVec3;

use crate::field::Face;

use super::symmetric::Symmetric;

/// Least free part of a kernel by which corrections for walls divide.
pub(super) const LEAST_FREE: f64 = 0.25;

/// A face nearer than this part of the support radius counts as that far away where the slope of a velocity
/// is computed.
const NEAREST: f64 = 0.1;

/// The friction of the faces near a particle, a part of [`super::Coverage`]. It is `()` for a fluid without
/// viscosity.
pub(in crate::sph) trait Friction: Copy + Default {
    /// The friction of one face whose ∇λ has the length `area`, 1/m.
    fn of_face(face: &Face, area: f64, h: f64) -> Self;

    /// The friction of two walls combined; `da` and `db` are the derivatives of the combined λ by their λ.
    fn joined(&self, other: &Self, da: f64, db: f64) -> Self;

    /// Adds a velocity, m/s, to the motion of all of these walls.
    fn take_along(&mut self, velocity: DVec3);

    /// Lets the fluid slip along all of these walls, whose λ is `part`.
    fn let_slip(&mut self, part: f64);

    /// The acceleration by viscosity, m/s², of a fluid with a velocity, m/s, from the acceleration by the
    /// fluid alone and the kinematic viscosity, m²/s.
    fn complete(&self, drag: DVec3, velocity: DVec3, viscosity: f64) -> DVec3;
}

impl Friction for () {
    fn of_face(_: &Face, _: f64, _: f64) -> Self {}

    fn joined(&self, (): &Self, _: f64, _: f64) -> Self {}

    fn take_along(&mut self, _: DVec3) {}

    fn let_slip(&mut self, _: f64) {}

    fn complete(&self, drag: DVec3, _: DVec3, _: f64) -> DVec3 {
        drag
    }
}

/// The friction of a viscous fluid with walls.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::sph) struct WallDrag {
    /// Σ (A/h)/d·(1 − n⊗n), 1/m², over the faces to which the fluid sticks. Times −2ν and a velocity it is
    /// the drag of walls at rest.
    pub tensor: Symmetric,
    /// λ of those walls along which the fluid slips.
    slippery: f64,
    /// The drag of the walls' own velocity, 1/(m·s).
    haul: DVec3,
}

impl Friction for WallDrag {
    fn of_face(face: &Face, area: f64, h: f64) -> Self {
        let along = Symmetric::IDENTITY - Symmetric::square(face.normal);
        Self { tensor: area / face.distance.max(NEAREST * h) * along, ..Self::default() }
    }

    fn joined(&self, other: &Self, da: f64, db: f64) -> Self {
        Self {
            tensor: da * self.tensor + db * other.tensor,
            slippery: da * self.slippery + db * other.slippery,
            haul: da * self.haul + db * other.haul,
        }
    }

    fn take_along(&mut self, velocity: DVec3) {
        self.haul += self.tensor * velocity;
    }

    fn let_slip(&mut self, part: f64) {
        *self = Self { slippery: part, ..Self::default() };
    }

    fn complete(&self, drag: DVec3, velocity: DVec3, viscosity: f64) -> DVec3 {
        let completed = drag / (1.0 - self.slippery).max(LEAST_FREE);
        completed - 2.0 * viscosity * (self.tensor * velocity - self.haul)
    }
}
