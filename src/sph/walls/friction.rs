//! Friction between walls and a viscous fluid, which sticks to them or slips along them. A fluid without
//! viscosity carries none of this data.
//!
//! Viscous forces of thin fluids act along the lines between particles (Monaghan & Gingold 1983):
//! 10ν Σ V (v_ij·r)/r²·∇W. So they conserve angular momentum, leave a rigid rotation alone, and vanish at a free
//! surface as the stress does there (Colagrossi et al. 2011). A wall to which the fluid sticks continues the velocity linearly. With s the
//! distance along the wall's normal and ρ along the wall, its part is −2ν·v/d times
//!
//! ```text
//! Aᵥ/h = (5/2) ∫_{s>d} s·(ρ²/r²)·|W'|/r dV
//! Aᵥ   = (525/2)·[1/140 − δ²/10 − (13/12)δ⁴ − δ⁴ ln δ + (8/5)δ⁵ − δ⁶/2 + (8/105)δ⁷]     (Wendland C2)
//! ```
//!
//! in place of A, to which it is equal in the mean: ∫Aᵥ dδ = ∫A dδ = ½. The velocity of a fluid bends towards
//! the wall (a channel's is a parabola). By its second derivative along the normal, which is the acceleration
//! a over ν, it is ahead of the linear one behind the wall by a/2ν·s(s − d). The part of a that this adds is
//! m·a, so a is what pairs and the linear velocity give, over 1 − m:
//!
//! ```text
//! m = 5 ∫_{s>d} y²·s(s − d)·|W'|/r³ dV     (y along the wall)
//!   = ½ − (15/8)δ + (35/4)δ³ + δ⁵(371/8 + (105/2) ln δ) − 70δ⁶ + (75/4)δ⁷ − (5/2)δ⁸     (Wendland C2)
//! ```
//!
//! (Without it a channel five spacings wide flows 8 % too fast, with it 5 %.)
//!
//! Forces less the turning of each neighbourhood ([`ViscousForces::WithSpin`]) need other integrals. Behind a
//! wall the flow turns as it does before it, and what is left of it is half of the linear velocity. So the part of
//! the wall is −2ν·v/d times A, and m = ∫_{s>d} s(s − d)·|W'|/r dV is K_n − δA: λ, but for walls in layers. (A
//! curved wall hardly changes them: a flow around it bends by the wall's curvature, too, and the wall is farther away
//! beside the normal. The one adds −H·m·v/d, the other H·λ·v/d.)
//!
//! The turning of a particle beside a wall is that of its neighbours and of the fluid that continues behind the
//! wall, with the moment K of the wall (`super::Coverage::tensor`): a slope v/d along the wall there has the
//! torque K_n/d·n × v. What the torques of a particle's pairs lack because of it is a couple of the wall on the
//! fluid, 2ν(K_n/d·n × v − I·ω) with I = tr K − K. (The torque on the drum of `couette` was 4 % too large without.)

use glam::DVec3;

use crate::field::Face;

use super::{
    kernel::WallKernel,
    layers::{OfFace, ViscousForces, Wall},
    symmetric::Symmetric,
};

/// Least free part of a kernel by which corrections for walls divide.
pub(super) const LEAST_FREE: f64 = 0.25;

/// A face nearer than this part of the support radius counts as that far away where the slope of a velocity
/// is computed.
const NEAREST: f64 = 0.1;

/// The friction of the faces near a particle, a part of [`super::Coverage`]. It is `()` for a fluid without
/// viscosity.
pub(in crate::sph) trait Friction: Copy + Default {
    /// Whether there is none.
    const IS_NONE: bool = false;

    /// The friction of one face, with what it takes of the kernel Wendland C2.
    fn of_face(wall: &Wall, face: &Face, taken: &OfFace) -> Self;

    /// The friction of two walls combined by a rule, which says how their λ combine, and the derivatives by both.
    fn joined(&self, other: &Self, rule: impl Fn(f64, f64) -> (f64, f64, f64)) -> Self;

    /// The friction of this part of the walls.
    fn in_part(self, part: f64) -> Self;

    /// Adds a motion to that of all of these walls: a velocity, m/s, at the particle, and by how much it turns, 1/s.
    fn take_along(&mut self, velocity: DVec3, turning: DVec3);

    /// Lets the fluid slip along all of these walls, whose λ is `part`.
    fn let_slip(&mut self, part: f64);

    /// The acceleration by viscosity, m/s², of a fluid with a velocity, m/s, from the acceleration by the
    /// fluid alone and the kinematic viscosity, m²/s.
    fn complete(&self, drag: DVec3, velocity: DVec3, viscosity: f64) -> DVec3;

    /// The part of that acceleration that comes from the walls to which the fluid sticks.
    fn by_walls(&self, drag: DVec3, velocity: DVec3, viscosity: f64) -> DVec3;
}

impl Friction for () {
    const IS_NONE: bool = true;

    fn of_face(_: &Wall, _: &Face, _: &OfFace) -> Self {}

    fn joined(&self, (): &Self, _: impl Fn(f64, f64) -> (f64, f64, f64)) -> Self {}

    fn in_part(self, _: f64) -> Self {}

    fn take_along(&mut self, _: DVec3, _: DVec3) {}

    fn let_slip(&mut self, _: f64) {}

    fn complete(&self, drag: DVec3, _: DVec3, _: f64) -> DVec3 {
        drag
    }

    fn by_walls(&self, _: DVec3, _: DVec3, _: f64) -> DVec3 {
        DVec3::ZERO
    }
}

/// The friction of a viscous fluid with walls. Walls to which it sticks and walls along which it slips
/// combine among themselves: behind the latter the whole flow continues, friction included.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::sph) struct WallDrag {
    /// Σ (Aᵥ/h)/d·(1 − n⊗n), 1/m², over the faces to which the fluid sticks, or A in place of Aᵥ. Times −2ν and a
    /// velocity it is the drag of walls at rest.
    pub tensor: Symmetric,
    /// The part m of the acceleration that the bend of the velocity adds behind the faces to which the fluid sticks.
    beyond: f64,
    /// λ of those walls along which the fluid slips.
    slippery: f64,
    /// The drag of the walls' own velocity, 1/(m·s).
    haul: DVec3,
    /// λ of those walls to which it sticks.
    sticky: f64,
    /// K − λ of those walls.
    spread: Symmetric,
    /// Σ K_n/d·n over those walls, 1/m.
    arm: DVec3,
    /// The torque of the walls' own motion, 1/s.
    twist: DVec3,
}

impl Friction for WallDrag {
    fn of_face(wall: &Wall, face: &Face, taken: &OfFace) -> Self {
        let square = Symmetric::square(face.normal);
        let (delta, distance) = (face.distance / wall.h, face.distance.max(NEAREST * wall.h));
        let drag = |area: f64, beyond: f64| Self {
            tensor: area / distance * (Symmetric::IDENTITY - square),
            beyond,
            ..Self::default()
        };
        let area = taken.area / wall.h;
        match wall.viscous_forces {
            ViscousForces::AlongLines => drag(area * along_lines(delta), beyond_lines(delta)),
            ViscousForces::WithSpin => Self {
                sticky: taken.part,
                spread: taken.spread * square,
                arm: (taken.part + taken.spread) / distance * face.normal,
                ..drag(area, taken.part + taken.spread - delta * taken.area)
            },
        }
    }

    fn joined(&self, other: &Self, rule: impl Fn(f64, f64) -> (f64, f64, f64)) -> Self {
        // forces along lines do not ask for it
        let turns = self.sticky != 0.0 || other.sticky != 0.0;
        let (sticky, of_self, of_other) =
            if turns { rule(self.sticky, other.sticky) } else { (0.0, 0.0, 0.0) };
        let (beyond, da, db) = rule(self.beyond, other.beyond);
        Self {
            tensor: da * self.tensor + db * other.tensor,
            beyond,
            slippery: rule(self.slippery, other.slippery).0,
            haul: da * self.haul + db * other.haul,
            sticky,
            spread: of_self * self.spread + of_other * other.spread,
            arm: of_self * self.arm + of_other * other.arm,
            twist: of_self * self.twist + of_other * other.twist,
        }
    }

    fn in_part(self, part: f64) -> Self {
        Self {
            tensor: part * self.tensor,
            beyond: part * self.beyond,
            slippery: part * self.slippery,
            haul: part * self.haul,
            sticky: part * self.sticky,
            spread: part * self.spread,
            arm: part * self.arm,
            twist: part * self.twist,
        }
    }

    fn take_along(&mut self, velocity: DVec3, turning: DVec3) {
        self.haul += self.tensor * velocity;
        let moment = self.moment();
        self.twist += moment.trace() * turning - moment * turning - self.arm.cross(velocity);
    }

    fn let_slip(&mut self, part: f64) {
        *self = Self { slippery: part, ..Self::default() };
    }

    fn complete(&self, drag: DVec3, velocity: DVec3, viscosity: f64) -> DVec3 {
        (self.mirrored(drag) + self.rub(velocity, viscosity)) / (1.0 - self.beyond).max(LEAST_FREE)
    }

    fn by_walls(&self, drag: DVec3, velocity: DVec3, viscosity: f64) -> DVec3 {
        self.complete(drag, velocity, viscosity) - self.mirrored(drag)
    }
}

impl WallDrag {
    /// Σ F·r × (v′ − v), 1/s, over the fluid that continues behind the walls, beside a particle with the velocity v,
    /// m/s.
    pub fn torque(&self, velocity: DVec3) -> DVec3 {
        self.arm.cross(velocity) + self.twist
    }

    /// The couple of the walls on the fluid, m²/s², at a particle with the velocity v, m/s, that turns by ω, 1/s.
    pub fn couple(&self, velocity: DVec3, spin: DVec3, viscosity: f64) -> DVec3 {
        let moment = self.moment();
        2.0 * viscosity * (self.torque(velocity) - (moment.trace() * spin - moment * spin))
    }

    /// K of the walls to which the fluid sticks: ∫F·r⊗r behind them.
    pub fn moment(&self) -> Symmetric {
        self.sticky * Symmetric::IDENTITY + self.spread
    }

    /// The acceleration, m/s², of a fluid with a velocity, m/s, that goes on linearly behind the walls.
    pub(super) fn rub(&self, velocity: DVec3, viscosity: f64) -> DVec3 {
        -2.0 * viscosity * (self.tensor * velocity - self.haul)
    }

    /// The acceleration by the fluid, which continues behind walls along which it slips.
    fn mirrored(&self, drag: DVec3) -> DVec3 {
        drag / (1.0 - self.slippery).max(LEAST_FREE)
    }
}

/// Aᵥ/A for the kernel Wendland C2, even in δ.
fn along_lines(delta: f64) -> f64 {
    let d = delta.abs();
    // the formula cancels near δ = 1, where the ratio tends to (5/6)(1 − δ)
    if d > 0.98 {
        return 5.0 / 6.0 * (1.0 - d).max(0.0);
    }
    let logarithm = if d > 0.0 { d.ln() } else { 0.0 };
    let high = -13.0 / 12.0 - logarithm + d * (1.6 + d * (-0.5 + d * (8.0 / 105.0)));
    262.5 * (1.0 / 140.0 + d * d * (-0.1 + d * d * high)) / WallKernel::WendlandC2.slope(d)
}

/// m for the kernel Wendland C2: ½ at a wall, 0 at the support radius, and m(−δ) = 1 − m(δ).
fn beyond_lines(delta: f64) -> f64 {
    let d = delta.abs();
    let before = if d >= 1.0 {
        0.0
    } else {
        let logarithm = if d > 0.0 { d.ln() } else { 0.0 };
        let high = 371.0 / 8.0 + 52.5 * logarithm + d * (-70.0 + d * (18.75 - 2.5 * d));
        // the formula cancels near δ = 1
        (0.5 + d * (-1.875 + d * d * (8.75 + d * d * high))).max(0.0)
    };
    if delta < 0.0 { 1.0 - before } else { before }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    /// ∫ |W'|/r³·f(r, cos) dV over the part of the support behind a plane at the distance d, by shells and,
    /// within them, rings; cos is that of the angle to the normal.
    fn behind_a_plane(d: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
        let (n, rings) = (4000, 200);
        let step = (1.0 - d) / f64::from(n);
        let shells = (0..n).map(|k| d + (f64::from(k) + 0.5) * step).map(|r| {
            let width = (1.0 - d / r) / f64::from(rings);
            let over_rings: f64 =
                (0..rings).map(|k| f(r, d / r + (f64::from(k) + 0.5) * width) * width).sum();
            // |W'|/r³·r² = 210/π·(1 − r)³/r² · r², and 2π around the normal
            420.0 * (1.0 - r).powi(3) * over_rings
        });
        step * shells.sum::<f64>()
    }

    #[test]
    fn bends_go_on_behind_a_wall_as_the_integral_does() {
        // y² is half the square of the rings' radius in the mean
        let by_quadrature = |d: f64| {
            5.0 * behind_a_plane(d, |r, cosine| {
                let s = r * cosine;
                0.5 * r * r * (1.0 - cosine * cosine) * s * (s - d)
            })
        };
        for d in [0.0, 0.05, 0.2, 0.5, 0.8] {
            let (found, wanted) = (beyond_lines(d), by_quadrature(d));
            assert!((found - wanted).abs() < 1e-5, "{d}: {found} {wanted}");
        }
        // beside a support radius the formula has lost its digits, and m is nothing
        assert!((900..1100).all(|k| beyond_lines(f64::from(k) / 1000.0) < 1e-6));
        assert_eq!(beyond_lines(-0.1), 1.0 - beyond_lines(0.1));
    }

    /// With the spin, m is K_n − δA, a fluid that sticks to a wall that turns with it feels nothing, and one that is
    /// sheared along the wall as it is beside it turns by half of the shear.
    #[test]
    fn walls_turn_a_fluid_as_it_turns_before_them() {
        let spacing = 1.0 / 2.6;
        let wall = Wall {
            viscous_forces: ViscousForces::WithSpin,
            ..Wall::new(WallKernel::WendlandC2, 1.0, spacing)
        };
        for distance in [0.15, 0.4, 0.8] {
            let face = Face { distance, normal: DVec3::Z, mean_curvature: 0.0 };
            let taken = wall.of_face(distance, 0.0);
            // |W'|/r³·r² is what the helper integrates with
            let bend = behind_a_plane(distance, |r, cosine| r * r * r * cosine * (r * cosine - distance));
            let drag = WallDrag::of_face(&wall, &face, &taken);
            assert!((drag.beyond - bend).abs() < 1e-4, "{distance}: {} {bend}", drag.beyond);

            let (at_rest, moment) = (drag.torque(DVec3::X), drag.moment().to_matrix());
            let inertia = DMat3::from_diagonal(DVec3::splat(drag.moment().trace())) - moment;
            // a shear of 1/d: the fluid before the wall has the rest of a whole moment
            let before = DVec3::Y / distance * (1.0 - moment.z_axis.z);
            let whole = DMat3::from_diagonal(DVec3::splat(2.0));
            let spin = whole.inverse() * (at_rest + before);
            assert!(spin.abs_diff_eq(0.5 / distance * DVec3::Y, 1e-12), "{spin}");

            let turning = DVec3::new(0.3, -2.0, 0.7);
            let mut carried = drag;
            carried.take_along(DVec3::X, turning);
            assert!(carried.torque(DVec3::X).abs_diff_eq(inertia * turning, 1e-12));
            assert!(carried.rub(DVec3::X, 0.5).length() < 1e-12);
            assert!(carried.couple(DVec3::X, turning, 0.5).length() < 1e-12);
        }
    }

    #[test]
    fn walls_rub_along_lines_as_the_integral_does() {
        let by_quadrature =
            |d: f64| 2.5 * behind_a_plane(d, |r, cosine| r.powi(3) * cosine * (1.0 - cosine * cosine));
        for d in [0.0, 0.05, 0.3, 0.6, 0.9] {
            let found = along_lines(d) * WallKernel::WendlandC2.slope(d);
            assert!((found / by_quadrature(d) - 1.0).abs() < 1e-4, "{d}: {found} {}", by_quadrature(d));
        }
        assert!((along_lines(0.0) - 1.25).abs() < 1e-14);
        let (below, above) = (along_lines(0.979_999_9), along_lines(0.980_000_1));
        assert!((below / above - 1.0).abs() < 0.02, "{below} {above}");
        let mean: f64 = (0..20_000)
            .map(|k| (f64::from(k) + 0.5) / 20_000.0)
            .map(|d| along_lines(d) * WallKernel::WendlandC2.slope(d) / 20_000.0)
            .sum();
        assert!((mean - 0.5).abs() < 1e-6, "{mean}");
    }
}
