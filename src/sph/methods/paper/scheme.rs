//! The scheme of the paper's method (equations 8–14), corrected.
//!
//! Time: velocity Verlet in kick–drift–kick form, with one evaluation of the forces per step. Viscosity
//! depends on the velocity, which is not yet known when the forces are found. It is predicted as v + a·dt/2
//! from the half-step velocity and the last acceleration, the paper's "approximation of a new velocity
//! vector".
//!
//! The paper gives force densities f_i; here a_i = f_i/ρ_i, with m_j/ρ_j as the volume of a neighbour in
//! every sum. The paper prints m_j/ρ_i in (11) and (14). With m_j/ρ_j each pair of particles exchanges m·a =
//! ∓ m²/(ρ_i ρ_j)·(…), the same number with opposite signs, so momentum is conserved to rounding. With the
//! printed factor the lighter of two particles would push less than it is pushed. Surface tension is not a
//! pair force, and conserves momentum only as far as the surface is closed.
//!
//! Walls act on positions and velocities only, as in the paper.

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;

use super::super::scheme::{Scheme, Start};
use super::Paper;
use crate::sph::{
    core::Core,
    error::StepError,
    kernel::Kernels,
    pairs::{PairPass, Real},
    params::Parameters,
    particles::{Vectors, add_scaled, set_sum},
};

/// The scheme. It keeps only working memory between steps.
pub struct PaperScheme {
    numbers: Paper,
    kernels: Kernels,
    volume: Vec<f64>,
}

impl Scheme for PaperScheme {
    fn step(&mut self, core: &mut Core, longest: f64) -> Result<f64, StepError> {
        let dt = core.next_dt(longest)?;
        add_scaled(&mut core.particles.velocity, &core.acceleration, 0.5 * dt);
        core.move_obstacles(dt);
        core.drift(dt, None)?;
        core.sort(&mut []);
        self.find_density_and_pressure(core);
        self.find_accelerations(core, 0.5 * dt);
        add_scaled(&mut core.particles.velocity, &core.acceleration, 0.5 * dt);
        core.check_finite(dt)?;
        Ok(dt)
    }

    fn densities<'a>(&'a self, core: &'a Core) -> &'a [f64] {
        &core.particles.density
    }

    fn bytes(&self) -> usize {
        8 * self.volume.capacity()
    }
}

impl Start for Paper {
    fn start(self, core: &mut Core, _is_new: bool) -> Box<dyn Scheme> {
        let kernels = Kernels::new(core.parameters.support_radius);
        let mut scheme = PaperScheme { numbers: self, kernels, volume: Vec::new() };
        core.sort(&mut []);
        scheme.find_density_and_pressure(core);
        scheme.find_accelerations(core, 0.0);
        Box::new(scheme)
    }
}

impl PaperScheme {
    fn find_density_and_pressure(&self, core: &mut Core) {
        let mut density = std::mem::take(&mut core.particles.density);
        density.resize(core.particles.len(), 0.0);
        let pass = Density { kernels: self.kernels, mass: core.parameters.particle_mass };
        core.sum(&pass, [], [&mut density]);
        core.particles.density = density;
        core.particles.pressure.resize(core.particles.len(), 0.0);
        for (p, &rho) in core.particles.pressure.iter_mut().zip(&core.particles.density) {
            *p = self.numbers.pressure(rho, core.parameters.rest_density);
        }
    }

    /// Finds the accelerations for the velocities predicted `ahead` seconds from those stored.
    fn find_accelerations(&mut self, core: &mut Core, ahead: f64) {
        let terms = Terms::of(&self.numbers, &core.parameters);
        let mut acceleration = std::mem::take(&mut core.acceleration);
        if !terms.any() {
            let g = core.parameters.gravity;
            acceleration.x.fill(g.x);
            acceleration.y.fill(g.y);
            acceleration.z.fill(g.z);
            core.acceleration = acceleration;
            core.pull(1.0);
            return;
        }
        let mut predicted = std::mem::take(&mut core.spare);
        set_sum(&mut predicted, &core.particles.velocity, &acceleration, ahead);
        let mass = core.parameters.particle_mass;
        self.volume.clear();
        self.volume.extend(core.particles.density.iter().map(|rho| mass / rho));

        let Vectors { x: vx, y: vy, z: vz } = &predicted;
        let fields = [&vx[..], vy, vz, &core.particles.pressure, &self.volume];
        let Vectors { x, y, z } = &mut acceleration;
        let out = [&mut x[..], y, z];
        let (kernels, parameters, volume) = (self.kernels, &core.parameters, &self.volume[..]);
        let threshold = self.numbers.surface_threshold;
        match (terms.viscosity, terms.tension) {
            (true, true) => {
                core.sum(&Forces::<true, true> { kernels, parameters, threshold, volume }, fields, out)
            }
            (true, false) => {
                core.sum(&Forces::<true, false> { kernels, parameters, threshold, volume }, fields, out)
            }
            (false, true) => {
                core.sum(&Forces::<false, true> { kernels, parameters, threshold, volume }, fields, out)
            }
            (false, false) => {
                core.sum(&Forces::<false, false> { kernels, parameters, threshold, volume }, fields, out)
            }
        }
        core.acceleration = acceleration;
        core.spare = predicted;
        core.pull(1.0);
    }
}

/// The force terms of a fluid. A term that it lacks is not compiled into its loop.
#[derive(Debug, Clone, Copy)]
struct Terms {
    pressure: bool,
    viscosity: bool,
    tension: bool,
}

impl Terms {
    fn of(numbers: &Paper, parameters: &Parameters) -> Self {
        Self {
            pressure: numbers.stiffness > 0.0,
            viscosity: parameters.viscosity > 0.0,
            tension: parameters.surface_tension > 0.0,
        }
    }

    fn any(self) -> bool {
        self.pressure || self.viscosity || self.tension
    }
}

/// ρ_i = Σ_j m W_poly6(r_ij), i included (equation 8), kg/m³.
#[derive(Clone, Copy)]
struct Density {
    kernels: Kernels,
    mass: f64,
}

impl PairPass<0, 1, 1> for Density {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        _: [V; 3],
        r2: V,
        _: &[V; 0],
        _: [V; 0],
        sums: &mut [V; 1],
    ) {
        // (1 − r²/h²)³
        let s =
            r2.mul_add(V::Element::of(-1.0 / self.kernels.h2), V::Element::of(1.0)).max(V::Element::of(0.0));
        sums[0] = (s * s).mul_add(s, sums[0]);
    }

    fn finish(&self, _: usize, [sum]: [f64; 1]) -> [f64; 1] {
        [self.mass * self.kernels.poly6(0.0) * sum]
    }
}

/// Pressure, viscosity and surface tension (equations 10–14), and gravity.
#[derive(Clone, Copy)]
struct Forces<'a, const VISCOSITY: bool, const TENSION: bool> {
    kernels: Kernels,
    parameters: &'a Parameters,
    /// Threshold on |∇c| above which a particle counts as surface, 1/m.
    threshold: f64,
    /// Volume m/ρ of each particle, m³.
    volume: &'a [f64],
}

/// The sums of the forces without their constants, with q = r/h: Σ V_j (p_i + p_j)(1 − q)²/r·d, Σ V_j (u_j −
/// u_i)(1 − q), Σ V_j (1 − q²)²·d, and Σ V_j (1 − q²)(3 − 7q²).
impl<const VISCOSITY: bool, const TENSION: bool> PairPass<5, 10, 3> for Forces<'_, VISCOSITY, TENSION> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 5],
        other: [V; 5],
        sums: &mut [V; 10],
    ) {
        let of = V::Element::of;
        let r = r2.sqrt();
        let s = r.mul_add(of(-1.0 / self.kernels.h), of(1.0)).max(of(0.0));
        let [.., p_own, _] = *own;
        let [.., p, volume] = other;
        // coinciding particles have no direction: the quotient stays finite, and its product with d = 0 is
        // zero
        let push = volume * (p_own + p) * s * s / r.max(of(1e-12 * self.kernels.h));
        for k in 0..3 {
            sums[k] = push.mul_add(d[k], sums[k]);
        }
        if VISCOSITY {
            let drag = volume * s;
            for k in 0..3 {
                sums[3 + k] = drag.mul_add(other[k] - own[k], sums[3 + k]);
            }
        }
        if TENSION {
            let q2 = r2 * of(1.0 / self.kernels.h2);
            let s2 = volume * (-q2 + of(1.0)).max(of(0.0));
            let slope = s2 * (-q2 + of(1.0));
            for k in 0..3 {
                sums[6 + k] = slope.mul_add(d[k], sums[6 + k]);
            }
            sums[9] = s2.mul_add(q2.mul_add(of(-7.0), of(3.0)), sums[9]);
        }
    }

    fn finish(&self, i: usize, sums: [f64; 10]) -> [f64; 3] {
        let (kernels, parameters) = (&self.kernels, self.parameters);
        let vector = |first: usize| DVec3::new(sums[first], sums[first + 1], sums[first + 2]);
        let push = kernels.spiky_steepness() * vector(0);
        let drag = kernels.viscosity_laplacian(0.0) * vector(3);
        let mut force = -0.5 * push + parameters.viscosity * drag;
        if TENSION {
            // a particle is part of its own colour field: ∇W(0) = 0, but ∇²W(0) is not
            let normal = kernels.poly6_gradient(0.0) * vector(6);
            let length = normal.length();
            if length >= self.threshold {
                let curvature = kernels.poly6_laplacian(0.0) / 3.0 * sums[9];
                force -= parameters.surface_tension * curvature / length * normal;
            }
        }
        (force * (self.volume[i] / parameters.particle_mass) + parameters.gravity).to_array()
    }
}
