//! Viscous forces of a fluid whose viscosity matters, less the turning of each neighbourhood:
//!
//! ```text
//! a_i = 4ν Σ V F·(v_j − v_i − ½(ω_i + ω_j) × r)        F = −W'/r, r = x_j − x_i
//! ω_i = I⁻¹·Σ F·r × (v_j − v_i)                        I = Σ F·(r²·1 − r⊗r)
//! ```
//!
//! This is the dissipative particle dynamics with spin of Müller, Fedosov & Gompper (2015), whose spins have no
//! inertia: ω is the turning that the neighbours have in the mean, so half the vorticity. From Taylor series the
//! sum is ν(∇²v + ∇∇·v), the divergence of the stress 2νD, and needs no more than Σ V F·r⊗r = 1 for that, which a
//! lattice gives as well as disorder does. By the choice of ω all torques r × f of a particle's pairs with one
//! half of their turning cancel, up to what walls take over as a couple ([`WallDrag::couple`]). So
//!
//! - angular momentum is conserved as momentum is,
//! - a fluid that turns like a rigid body is left alone,
//! - the power is −2νm Σ V F·|v_j − v_i − ω_i × r|² over all i and j, which never is a gain,
//! - and there is no stress at a free surface.
//!
//! Forces along the lines between particles (Monaghan & Gingold 1983) have all of this too, and need two sums over
//! neighbours less. But they rest on Σ V F·r⊗r⊗r⊗r/r², and layers of particles, as they lie along walls, resist a
//! shear along them by only 0.76 of the viscosity with a support radius of 2.2 spacings, 0.87 with 2.6 and 0.93
//! with 3. With the spin it is 1.00 to 1.03 for waves of twenty spacings. (A bent pipe ten spacings wide flowed
//! 19 % too fast with `dfsph`.) They remain for fluids of which the viscosity hardly matters, see [`ViscousForces`].

use fearless_simd::{Simd, SimdFloat};
use glam::{DMat3, DVec3};

use crate::sph::{
    core::Core,
    kernel::Wendland,
    pairs::{PairPass, Real},
    particles::Vectors,
    walls::{Pushed, Symmetric, ViscousForces, WallDrag},
};

/// A part of the trace of I that is added to its diagonal: the particles of a line have no inertia about it.
const SLENDER: f64 = 1e-6;

/// The viscous forces of the present step.
#[derive(Default)]
pub(super) struct SpinViscosity {
    /// ω, 1/s.
    spin: Vectors,
    /// Σ V F·(v_j − v_i − ½(ω_i + ω_j) × r), 1/(m·s).
    rubbing: Vectors,
}

/// What [`SpinViscosity`] found.
#[derive(Clone, Copy)]
pub(super) struct SpinSums<'a> {
    spin: &'a Vectors,
    rubbing: &'a Vectors,
}

impl SpinSums<'_> {
    /// The acceleration of a particle by other particles, m/s², with a kinematic viscosity, m²/s.
    pub fn drag(&self, i: usize, viscosity: f64) -> DVec3 {
        4.0 * viscosity * self.rubbing.get(i)
    }

    /// Adds what walls with this friction do to a particle by turning it.
    pub fn with_couple(&self, i: usize, wall: &WallDrag, pushed: Pushed) -> Pushed {
        let spin = self.spin.get(i);
        Pushed { spin, couple: wall.couple(pushed.velocity, spin, pushed.viscosity), ..pushed }
    }
}

impl SpinViscosity {
    /// Finds the sums for particles with these velocities, m/s, if the viscosity of the fluid matters. `wall` tells
    /// the friction of the walls near a particle.
    pub fn find(
        &mut self,
        core: &Core,
        velocity: &Vectors,
        wall: impl Fn(usize) -> Option<WallDrag> + Copy + Sync,
    ) -> Option<SpinSums<'_>> {
        if core.wall().viscous_forces == ViscousForces::AlongLines {
            return None;
        }
        let parameters = &core.parameters;
        let kernel = Wendland::new(parameters.support_radius);
        // of packed particles Σ V F·r⊗r is 1 with the volumes that they fill, not with those by which densities are found
        let steepness = parameters.volume() * kernel.steepness;
        let n = core.particles.len();
        self.spin.resize(n);
        self.rubbing.resize(n);
        let Vectors { x: vx, y: vy, z: vz } = velocity;
        let Vectors { x, y, z } = &mut self.spin;
        core.sum(&Turning { kernel, steepness, velocity, wall }, [vx, vy, vz], [&mut x[..], y, z]);
        let Vectors { x: wx, y: wy, z: wz } = &self.spin;
        let Vectors { x, y, z } = &mut self.rubbing;
        core.sum(&Rubbing { kernel, steepness }, [vx, vy, vz, wx, wy, wz], [&mut x[..], y, z]);
        Some(SpinSums { spin: &self.spin, rubbing: &self.rubbing })
    }

    /// Memory of the columns, bytes.
    pub fn bytes(&self) -> usize {
        self.spin.bytes() + self.rubbing.bytes()
    }
}

/// The pass that finds ω. With d from the neighbour it sums f·d × (v_i − v_j) and f·d⊗d.
#[derive(Clone, Copy)]
struct Turning<'a, W> {
    kernel: Wendland,
    /// V·c, 1/m².
    steepness: f64,
    velocity: &'a Vectors,
    /// The walls near a particle.
    wall: W,
}

impl<W: Fn(usize) -> Option<WallDrag> + Copy + Sync> PairPass<3, 9, 3> for Turning<'_, W> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 3],
        other: [V; 3],
        sums: &mut [V; 9],
    ) {
        let s = self.kernel.nearness(r2);
        let f = s * s * s;
        let along: [V; 3] = std::array::from_fn(|k| f * d[k]);
        let parting: [V; 3] = std::array::from_fn(|k| own[k] - other[k]);
        for k in 0..3 {
            let (next, last) = ((k + 1) % 3, (k + 2) % 3);
            sums[k] = along[next].mul_add(parting[last], sums[k]);
            sums[k] = along[last].mul_add(-parting[next], sums[k]);
            sums[3 + k] = along[k].mul_add(d[k], sums[3 + k]);
            sums[6 + k] = along[next].mul_add(d[last], sums[6 + k]);
        }
    }

    fn finish(&self, i: usize, [x, y, z, xx, yy, zz, yz, zx, xy]: [f64; 9]) -> [f64; 3] {
        let mut torque = self.steepness * DVec3::new(x, y, z);
        let mut moment = self.steepness * Symmetric::new(DVec3::new(xx, yy, zz), DVec3::new(yz, zx, xy));
        if let Some(wall) = (self.wall)(i) {
            torque += wall.torque(self.velocity.get(i));
            moment = moment + wall.moment();
        }
        let trace = moment.trace();
        if trace <= 0.0 {
            return [0.0; 3];
        }
        let inertia = DMat3::from_diagonal(DVec3::splat((1.0 + SLENDER) * trace)) - moment.to_matrix();
        let spin = inertia.inverse() * torque;
        if spin.is_finite() { spin.to_array() } else { [0.0; 3] }
    }
}

/// The pass that finds Σ V F·(v_j − v_i − ½(ω_i + ω_j) × r), from the columns of v and ω.
#[derive(Clone, Copy)]
struct Rubbing {
    kernel: Wendland,
    /// V·c, 1/m².
    steepness: f64,
}

impl PairPass<6, 3, 3> for Rubbing {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 6],
        other: [V; 6],
        sums: &mut [V; 3],
    ) {
        let s = self.kernel.nearness(r2);
        let f = s * s * s;
        let half = V::Element::of(0.5);
        let turning: [V; 3] = std::array::from_fn(|k| (own[3 + k] + other[3 + k]) * half);
        for k in 0..3 {
            let (next, last) = ((k + 1) % 3, (k + 2) % 3);
            // d = −r
            let rest = turning[next].mul_add(d[last], other[k] - own[k]);
            let rest = turning[last].mul_add(-d[next], rest);
            sums[k] = f.mul_add(rest, sums[k]);
        }
    }

    fn finish(&self, _: usize, sums: [f64; 3]) -> [f64; 3] {
        sums.map(|sum| self.steepness * sum)
    }
}
