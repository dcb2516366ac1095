//! Weakly compressible fluid: the density follows the motion (equation of continuity), the pressure the density (Tait).
//!
//! ```text
//! dρ_i/dt = Σ m v_ij·∇W  + δ·h·c Σ 2(ρ_j − ρ_i − ρᴴ_ji) V_j r_ji·∇W/r²  + ρ_i (v_i − v_wall)·∇λ
//! a_i = g − (1 − K)⁻¹ [Σ m (p_i/ρ_i² + p_j/ρ_j²) ∇W + 2p_i/ρ_i ∇λ] + viscosity
//! p = c²ρ₀/7·((ρ/ρ₀)⁷ − 1)
//! ```
//!
//! Kernel: Wendland C2 (1995), whose pairs do not clump. Density diffusion: Molteni & Colagrossi (2009), with the
//! hydrostatic part ρᴴ taken off (Fourtakas et al. 2019), so that it does not lift a fluid at rest. Viscosity: laminar
//! (Morris et al. 1997) or artificial (Monaghan 1992).
//!
//! Walls enter by λ, ∇λ and K in closed form ([`Coverage`]). The pressure beyond a wall is that of the particle,
//! continued linearly by the fluid's own balance ∇p = ρ(g + viscous − a); since a is what is asked for, that is a linear
//! system of three unknowns for each particle at a wall, solved at once: the factor (1 − K)⁻¹.
//!
//! Time: kick–drift–kick with one evaluation per step; velocity and density at the new place are predicted.

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;
use rayon::prelude::*;

use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::{CHUNK, Core, add_scaled, add_scaled_column, set_sum, set_sum_column},
    pairs::{PairPass, Real},
    params::{Method, NegativePressure, Parameters, Wcsph},
    particles::Vectors,
    simulation::StepError,
    walls::{Boundary, WallKernel},
};

/// The exponent of Tait's equation for water.
const EXPONENT: i32 = 7;

/// What is kept between steps: the rate of change of the density; the rest is working memory.
pub struct Weakly {
    numbers: Wcsph,
    /// dρ/dt, kg/m³/s
    density_rate: Vec<f64>,
    /// p/ρ²
    specific: Vec<f64>,
    /// ρ − ρ₀/c²·g·x: constant in a fluid at rest.
    reduced: Vec<f64>,
}

impl Weakly {
    pub fn start(core: &mut Core<'_>) -> Self {
        let Method::Wcsph(numbers) = core.parameters.method else {
            unreachable!("the method decides which scheme is made")
        };
        let n = core.particles.len();
        // a density that was not stated is that at rest
        core.particles.density.resize(n, 0.0);
        for rho in core.particles.density.iter_mut().filter(|rho| **rho == 0.0) {
            *rho = core.parameters.rest_density;
        }
        core.particles.pressure.resize(n, 0.0);
        let mut scheme =
            Self { numbers, density_rate: vec![0.0; n], specific: Vec::new(), reduced: Vec::new() };
        core.sort(&mut [&mut scheme.density_rate]);
        scheme.find_rates(core, 0.0);
        scheme.find_pressure(core);
        scheme
    }

    pub fn step(&mut self, core: &mut Core<'_>, longest: f64) -> Result<f64, StepError> {
        let dt = core.next_dt(longest);
        self.kick(core, 0.5 * dt);
        core.move_obstacles(dt);
        core.drift(dt)?;
        core.sort(&mut [&mut self.density_rate]);
        self.find_rates(core, 0.5 * dt);
        self.kick(core, 0.5 * dt);
        self.find_pressure(core);
        core.check_finite(dt)?;
        Ok(dt)
    }

    pub fn save(&self, checkpoint: &mut Checkpoint) {
        checkpoint.set("density rate", self.density_rate.clone());
    }

    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.density_rate = checkpoint.of_particles("density rate")?;
        Ok(())
    }

    pub fn bytes(&self) -> usize {
        let columns = [&self.density_rate, &self.specific, &self.reduced];
        columns.map(|column| 8 * column.capacity()).iter().sum()
    }

    /// v += a·t, ρ += dρ/dt·t
    fn kick(&self, core: &mut Core<'_>, t: f64) {
        add_scaled(&mut core.particles.velocity, &core.acceleration, t);
        add_scaled_column(&mut core.particles.density, &self.density_rate, t);
    }

    fn find_pressure(&self, core: &mut Core<'_>) {
        let (numbers, parameters, particles) = (&self.numbers, &core.parameters, &mut core.particles);
        particles.pressure.par_chunks_mut(CHUNK).zip(particles.density.par_chunks(CHUNK)).for_each(
            |(pressure, density)| {
                for (p, &rho) in pressure.iter_mut().zip(density) {
                    *p = tait(numbers, parameters, rho);
                }
            },
        );
    }

    /// Accelerations and rates of density for velocities and densities predicted `ahead` seconds from those stored.
    fn find_rates(&mut self, core: &mut Core<'_>, ahead: f64) {
        let mut predicted = std::mem::take(&mut core.spare);
        set_sum(&mut predicted, &core.particles.velocity, &core.acceleration, ahead);
        set_sum_column(&mut self.specific, &core.particles.density, &self.density_rate, ahead);
        self.reduced.resize(core.particles.len(), 0.0);
        let (numbers, parameters) = (&self.numbers, &core.parameters);
        let hydrostatic = parameters.rest_density / numbers.sound_speed.powi(2) * parameters.gravity;
        let position = &core.particles.position;
        self.specific.par_chunks_mut(CHUNK).zip(self.reduced.par_chunks_mut(CHUNK)).enumerate().for_each(
            |(chunk, (specific, reduced))| {
                for (k, (specific, reduced)) in specific.iter_mut().zip(reduced).enumerate() {
                    let rho = *specific;
                    *specific = tait(numbers, parameters, rho) / (rho * rho);
                    *reduced = rho - hydrostatic.dot(position.get(chunk * CHUNK + k));
                }
            },
        );

        let mut acceleration = std::mem::take(&mut core.acceleration);
        let Vectors { x: vx, y: vy, z: vz } = &predicted;
        let fields = [&vx[..], vy, vz, &self.specific, &self.reduced];
        let Vectors { x, y, z } = &mut acceleration;
        let out = [&mut x[..], y, z, &mut self.density_rate];
        let rates = Rates::new(core, numbers, &predicted, &self.specific);
        match (rates.laminar > 0.0, rates.artificial > 0.0) {
            (true, true) => core.sum(&Viscous::<true>(rates), fields, out),
            (true, false) => core.sum(&Viscous::<false>(rates), fields, out),
            (false, true) => core.sum(&Inviscid::<true>(rates), fields, out),
            (false, false) => core.sum(&Inviscid::<false>(rates), fields, out),
        }
        core.acceleration = acceleration;
        core.spare = predicted;
    }
}

/// p = c²ρ₀/7·((ρ/ρ₀)⁷ − 1), not below zero unless that is kept.
#[inline]
fn tait(numbers: &Wcsph, parameters: &Parameters, density: f64) -> f64 {
    let stiffness = numbers.sound_speed.powi(2) * parameters.rest_density / f64::from(EXPONENT);
    let p = stiffness * ((density / parameters.rest_density).powi(EXPONENT) - 1.0);
    match parameters.negative_pressure {
        NegativePressure::Clamp => p.max(0.0),
        NegativePressure::Keep => p,
    }
}

/// The sums over neighbours and what is made of them.
struct Rates<'a> {
    parameters: &'a Parameters,
    boundary: &'a Boundary<'a>,
    position: &'a Vectors,
    velocity: &'a Vectors,
    density: &'a [f64],
    specific: &'a [f64],
    h: f64,
    /// m·c of ∇W = −c(1 − q)³·r
    mass_steepness: f64,
    /// 2δhcV of the diffusion
    diffusion: f64,
    /// ν = μ/ρ₀, m²/s
    laminar: f64,
    /// αhc/ρ₀
    artificial: f64,
}

/// Without viscosity, or with the artificial one alone.
struct Inviscid<'a, const ARTIFICIAL: bool>(Rates<'a>);

/// With laminar viscosity.
struct Viscous<'a, const ARTIFICIAL: bool>(Rates<'a>);

impl<'a> Rates<'a> {
    fn new(core: &'a Core<'a>, numbers: &Wcsph, velocity: &'a Vectors, specific: &'a [f64]) -> Self {
        let parameters = &core.parameters;
        let h = parameters.support_radius;
        let smoothing = 0.5 * h;
        let steepness = 210.0 / (std::f64::consts::PI * h.powi(5));
        let mass_steepness = parameters.particle_mass * steepness;
        Self {
            parameters,
            boundary: &core.boundary,
            position: &core.particles.position,
            velocity,
            density: &core.particles.density,
            specific,
            h,
            mass_steepness,
            diffusion: 2.0 * numbers.density_diffusion * smoothing * numbers.sound_speed * mass_steepness
                / parameters.rest_density,
            laminar: parameters.viscosity / parameters.rest_density,
            artificial: numbers.artificial_viscosity * smoothing * numbers.sound_speed
                / parameters.rest_density,
        }
    }

    /// (1 − q)³, zero beyond the support.
    #[inline(always)]
    fn slope<S: Simd, V: SimdFloat<S, Element: Real>>(&self, r2: V) -> V {
        let of = V::Element::of;
        let s = r2.sqrt().mul_add(of(-1.0 / self.h), of(1.0)).max(of(0.0));
        s * s * s
    }

    /// Adds pressure, compression and diffusion, and artificial viscosity: a pressure between particles that approach, a
    /// tension between those that part. With the pressure alone, noise at rest would hold up a part of the fluid's weight
    /// (3 % of it with α = 0.1).
    #[inline(always)]
    fn accumulate<S: Simd, V: SimdFloat<S, Element: Real>, const ARTIFICIAL: bool>(
        &self,
        d: [V; 3],
        r2: V,
        f: V,
        own: &[V; 5],
        other: [V; 5],
        sums: &mut [V; 5],
    ) {
        let of = V::Element::of;
        let departing = (own[0] - other[0]) * d[0];
        let departing = (own[1] - other[1]).mul_add(d[1], departing);
        let departing = (own[2] - other[2]).mul_add(d[2], departing);
        let mut push = own[3] + other[3];
        if ARTIFICIAL {
            let least = of(0.01 * (0.5 * self.h).powi(2));
            // a viscosity made up needs no more than the twelve digits of an estimate in single precision
            push -= departing * of(self.artificial) * (r2 + least).approximate_recip();
        }
        let push = push * f;
        for k in 0..3 {
            sums[k] = push.mul_add(d[k], sums[k]);
        }
        sums[3] = f.mul_add(departing, sums[3]);
        sums[4] = f.mul_add(other[4] - own[4], sums[4]);
    }

    /// Acceleration and rate of density of particle `i` from Σ push·f·d, Σ f·v·d, Σ f·Δρ and the viscous acceleration.
    fn finish(&self, i: usize, push: DVec3, compression: f64, diffusion: f64, viscous: DVec3) -> [f64; 4] {
        let mut pressure = self.mass_steepness * push;
        let mut rate = -self.mass_steepness * compression + self.diffusion * diffusion;
        let mut viscous = viscous;
        if let Some(wall) = self.boundary.coverage(WallKernel::WendlandC2, self.h, self.position.get(i)) {
            let (density, velocity) = (self.density[i], self.velocity.get(i));
            rate += density * (wall.gradient.dot(velocity) - wall.sweep);
            pressure -= 2.0 * density * self.specific[i] * wall.gradient;
            pressure = wall.completion() * pressure;
            viscous -= 2.0 * self.laminar * (wall.drag * velocity - wall.haul);
        }
        let [x, y, z] = (pressure + viscous + self.parameters.gravity).to_array();
        [x, y, z, rate]
    }
}

impl<const ARTIFICIAL: bool> PairPass<5, 5, 4> for Inviscid<'_, ARTIFICIAL> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 5],
        other: [V; 5],
        sums: &mut [V; 5],
    ) {
        self.0.accumulate::<S, V, ARTIFICIAL>(d, r2, self.0.slope(r2), own, other, sums);
    }

    fn finish(&self, i: usize, [x, y, z, compression, diffusion]: [f64; 5]) -> [f64; 4] {
        self.0.finish(i, DVec3::new(x, y, z), compression, diffusion, DVec3::ZERO)
    }
}

impl<const ARTIFICIAL: bool> PairPass<5, 8, 4> for Viscous<'_, ARTIFICIAL> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 5],
        other: [V; 5],
        sums: &mut [V; 8],
    ) {
        let f = self.0.slope(r2);
        let [x, y, z, compression, diffusion, drag @ ..] = sums;
        let mut inviscid = [*x, *y, *z, *compression, *diffusion];
        self.0.accumulate::<S, V, ARTIFICIAL>(d, r2, f, own, other, &mut inviscid);
        [*x, *y, *z, *compression, *diffusion] = inviscid;
        for k in 0..3 {
            drag[k] = f.mul_add(other[k] - own[k], drag[k]);
        }
    }

    fn finish(&self, i: usize, [x, y, z, compression, diffusion, u, v, w]: [f64; 8]) -> [f64; 4] {
        let rates = &self.0;
        let viscous = 2.0 * rates.laminar * rates.mass_steepness / rates.parameters.rest_density;
        rates.finish(i, DVec3::new(x, y, z), compression, diffusion, viscous * DVec3::new(u, v, w))
    }
}
