//! Divergence-free fluid (Bender & Koschier 2017): pressure is what keeps the density, found by iteration.
//!
//! ```text
//! v ← v + dt·(g + viscosity)
//! v ← v + dt·a(s)      s so that ρ + dt·dρ/dt ≤ ρ₀   (constant density)
//! x ← x + dt·v
//! v ← v + dt·a(s′)     s′ so that dρ/dt ≤ 0          (divergence-free)
//! ```
//!
//! with s = p/ρ² ≥ 0, a(s)_i = −(1 − K)⁻¹[Σ m (s_i + s_j) ∇W + 2ρ_i s_i ∇λ] and dρ_i/dt = Σ m v_ij·∇W + ρ_i v_i·∇λ. Both
//! solvers are relaxed Jacobi iterations that begin with the last step's answer; since s is a pressure and no impulse,
//! that stays a good beginning when the step changes. Walls enter as in the weakly compressible method, by λ, ∇λ and K.
//!
//! Invariant: between steps the velocity is free of divergence to the tolerance, and density and pressure belong to the
//! positions and the last step's forces.

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;
use rayon::prelude::*;

use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::{CHUNK, Core, add_scaled},
    pairs::{PairPass, Real},
    params::{Dfsph, Method, Parameters, Slip},
    particles::{Particles, Vectors},
    simulation::StepError,
    walls::{Coverage, WallKernel},
};

/// Of the correction that an error asks for, the part that is made at once: all neighbours correct the same error.
const RELAXATION: f64 = 0.5;

/// Corrections for walls divide by what is left of the kernel, but never by less than this.
const LEAST_FREE: f64 = 0.25;

/// A particle without neighbours has no pressure to find: a factor below this part of that in a full neighbourhood.
const LONELY: f64 = 1e-3;

/// What is kept between steps: the answers of both solvers; the rest is working memory.
pub struct DivergenceFree {
    numbers: Dfsph,
    /// p/ρ² of the constant density.
    density_pressure: Vec<f64>,
    /// p/ρ² of the vanishing divergence.
    divergence_pressure: Vec<f64>,
    /// How much a unit of p/ρ² lowers the own dρ/dt in a second: (1 − K)⁻¹(…)·(…) + Σ m²|∇W|².
    factor: Vec<f64>,
    /// dρ/dt
    rate: Vec<f64>,
    /// The same without pressure.
    free: Vec<f64>,
    /// a(s)
    push: Vectors,
    walls: Walls,
    /// Σ of errors, chunk by chunk.
    errors: Vec<f64>,
    /// Of the last step's density and divergence solver.
    pub iterations: [u32; 2],
}

/// Walls near particles, found once for all passes of a step.
#[derive(Default)]
struct Walls {
    /// Place in `coverage` of each particle; `NONE`: no wall is near.
    place: Vec<u32>,
    coverage: Vec<Coverage>,
    found: Vec<Option<Coverage>>,
}

const NONE: u32 = u32::MAX;

impl Walls {
    fn find(&mut self, core: &Core<'_>) {
        let h = core.parameters.support_radius;
        let position = &core.particles.position;
        (0..position.len())
            .into_par_iter()
            .with_min_len(CHUNK / 4)
            .map(|i| core.boundary.coverage(WallKernel::WendlandC2, h, position.get(i)))
            .collect_into_vec(&mut self.found);
        self.place.clear();
        self.coverage.clear();
        for found in &self.found {
            self.place.push(if found.is_some() { self.coverage.len() as u32 } else { NONE });
            self.coverage.extend(found);
        }
    }

    #[inline]
    fn near(&self, i: usize) -> Option<&Coverage> {
        let place = self.place[i];
        (place != NONE).then(|| &self.coverage[place as usize])
    }
}

impl DivergenceFree {
    pub fn start(core: &mut Core<'_>) -> Self {
        let Method::Dfsph(numbers) = core.parameters.method else {
            unreachable!("the method decides which scheme is made")
        };
        let n = core.particles.len();
        core.particles.density.resize(n, 0.0);
        core.particles.pressure.resize(n, 0.0);
        let mut scheme = Self {
            numbers,
            density_pressure: vec![0.0; n],
            divergence_pressure: vec![0.0; n],
            factor: vec![0.0; n],
            rate: vec![0.0; n],
            free: vec![0.0; n],
            push: Vectors::default(),
            walls: Walls::default(),
            errors: Vec::new(),
            iterations: [0; 2],
        };
        scheme.push.resize(n);
        scheme.settle(core);
        scheme
    }

    pub fn step(&mut self, core: &mut Core<'_>, longest: f64) -> Result<f64, StepError> {
        let dt = core.next_dt(longest);
        self.find_other_accelerations(core);
        add_scaled(&mut core.particles.velocity, &core.acceleration, dt);
        self.keep_density(core, dt);
        core.drift(dt)?;
        self.settle(core);
        self.remove_divergence(core, dt);
        core.check_finite(dt)?;
        Ok(dt)
    }

    /// The answers of the last step; all else follows from the positions.
    pub fn save(&self, checkpoint: &mut Checkpoint) {
        checkpoint.set("density pressure", self.density_pressure.clone());
        checkpoint.set("divergence pressure", self.divergence_pressure.clone());
    }

    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.density_pressure = checkpoint.of_particles("density pressure")?;
        self.divergence_pressure = checkpoint.of_particles("divergence pressure")?;
        Ok(())
    }

    pub fn bytes(&self) -> usize {
        let columns = [&self.density_pressure, &self.divergence_pressure, &self.factor, &self.rate];
        columns.map(|column| 8 * column.capacity()).iter().sum::<usize>()
            + self.push.bytes()
            + 4 * self.walls.place.capacity()
            + size_of::<Coverage>() * self.walls.coverage.capacity()
            + size_of::<Option<Coverage>>() * self.walls.found.capacity()
    }

    /// Order, walls, densities and factors of the present positions.
    fn settle(&mut self, core: &mut Core<'_>) {
        core.sort(&mut [&mut self.density_pressure, &mut self.divergence_pressure]);
        self.walls.find(core);
        let mut density = std::mem::take(&mut core.particles.density);
        let pass = Densities { constants: Constants::of(&core.parameters), walls: &self.walls };
        core.sum(&pass, [], [&mut density, &mut self.factor]);
        core.particles.density = density;
    }

    /// Gravity and viscosity.
    fn find_other_accelerations(&self, core: &mut Core<'_>) {
        let mut acceleration = std::mem::take(&mut core.acceleration);
        let g = core.parameters.gravity;
        let Vectors { x, y, z } = &mut acceleration;
        if core.parameters.viscosity > 0.0 {
            let Vectors { x: vx, y: vy, z: vz } = &core.particles.velocity;
            let pass = Drag {
                constants: Constants::of(&core.parameters),
                walls: &self.walls,
                velocity: &core.particles.velocity,
                kinematic: core.parameters.viscosity / core.parameters.rest_density,
                slip: core.parameters.slip,
                gravity: g,
            };
            core.sum(&pass, [&vx[..], vy, vz], [&mut x[..], y, z]);
        } else {
            x.fill(g.x);
            y.fill(g.y);
            z.fill(g.z);
        }
        core.acceleration = acceleration;
    }

    /// Changes velocities so that the density does not exceed that at rest after the step.
    fn keep_density(&mut self, core: &mut Core<'_>, dt: f64) {
        let rest = core.parameters.rest_density;
        let mut pressure = std::mem::take(&mut self.density_pressure);
        // the compression to come without pressure; that which s takes away is found in each iteration
        self.find_rate_of(core, &core.particles.velocity);
        let mut free = std::mem::take(&mut self.free);
        for ((free, rate), rho) in free.iter_mut().zip(&self.rate).zip(&core.particles.density) {
            *free = (rho - rest) / dt + rate;
        }
        self.iterations[0] = self.solve(core, &mut pressure, &free, dt, self.numbers.tolerance * rest / dt);
        self.free = free;
        add_scaled(&mut core.particles.velocity, &self.push, dt);
        add_scaled(&mut core.acceleration, &self.push, 1.0);
        let Particles { pressure: p, density, .. } = &mut core.particles;
        for ((p, s), rho) in p.iter_mut().zip(&pressure).zip(density) {
            *p = s * *rho * *rho;
        }
        self.density_pressure = pressure;
    }

    /// Changes velocities so that nothing is compressed now.
    fn remove_divergence(&mut self, core: &mut Core<'_>, dt: f64) {
        let mut pressure = std::mem::take(&mut self.divergence_pressure);
        self.find_rate_of(core, &core.particles.velocity);
        // the rates without pressure are kept apart from those that each iteration finds
        std::mem::swap(&mut self.rate, &mut self.free);
        let free = std::mem::take(&mut self.free);
        let rest = core.parameters.rest_density;
        self.iterations[1] =
            self.solve(core, &mut pressure, &free, dt, 10.0 * self.numbers.tolerance * rest / dt);
        self.free = free;
        add_scaled(&mut core.particles.velocity, &self.push, dt);
        self.divergence_pressure = pressure;
    }

    /// Finds s ≥ 0 such that the rate of density `free` + dt·(rate of a(s)) vanishes where s > 0, and is not positive
    /// elsewhere, to a mean of `tolerance`; leaves a(s) in `push`. Returns the iterations.
    fn solve(&mut self, core: &Core<'_>, pressure: &mut [f64], free: &[f64], dt: f64, tolerance: f64) -> u32 {
        let constants = Constants::of(&core.parameters);
        let least = LONELY * constants.full_factor();
        let n = pressure.len() as f64;
        let mut iteration = 0;
        loop {
            self.find_push(core, pressure);
            let push = std::mem::take(&mut self.push);
            self.find_rate_of(core, &push);
            self.push = push;
            self.rate
                .par_chunks(CHUNK)
                .zip(free.par_chunks(CHUNK))
                .zip(self.factor.par_chunks(CHUNK))
                .zip(pressure.par_chunks(CHUNK))
                .map(|(((rate, free), factor), s)| {
                    let mut sum = 0.0;
                    for k in 0..rate.len() {
                        let error = free[k] + dt * rate[k];
                        // an expansion that no pressure resists is none of ours
                        sum += if factor[k] > least {
                            if s[k] > 0.0 { error.abs() } else { error.max(0.0) }
                        } else {
                            0.0
                        };
                    }
                    sum
                })
                .collect_into_vec(&mut self.errors);
            let mean = self.errors.iter().sum::<f64>() / n;
            if (mean <= tolerance && iteration > 0) || iteration >= self.numbers.most_iterations {
                return iteration;
            }
            pressure
                .par_chunks_mut(CHUNK)
                .zip(self.rate.par_chunks(CHUNK))
                .zip(free.par_chunks(CHUNK))
                .zip(self.factor.par_chunks(CHUNK))
                .for_each(|(((pressure, rate), free), factor)| {
                    for k in 0..pressure.len() {
                        if factor[k] > least {
                            let error = free[k] + dt * rate[k];
                            pressure[k] = (pressure[k] + RELAXATION * error / (dt * factor[k])).max(0.0);
                        } else {
                            pressure[k] = 0.0;
                        }
                    }
                });
            iteration += 1;
        }
    }

    /// a(s)
    fn find_push(&mut self, core: &Core<'_>, pressure: &[f64]) {
        let pass = Push {
            constants: Constants::of(&core.parameters),
            walls: &self.walls,
            pressure,
            density: &core.particles.density,
        };
        let Vectors { x, y, z } = &mut self.push;
        core.sum(&pass, [pressure], [&mut x[..], y, z]);
    }

    /// dρ/dt of a velocity, or of an acceleration per second.
    fn find_rate_of(&mut self, core: &Core<'_>, velocity: &Vectors) {
        let pass = Squeeze {
            constants: Constants::of(&core.parameters),
            walls: &self.walls,
            velocity,
            density: &core.particles.density,
        };
        let Vectors { x, y, z } = velocity;
        core.sum(&pass, [&x[..], y, z], [&mut self.rate]);
    }
}

/// Of the kernel W = w(1 − q)⁴(1 + 4q), ∇W = −c(1 − q)³·r.
#[derive(Clone, Copy)]
struct Constants {
    per_h: f64,
    rest_density: f64,
    /// m·w
    mass_weight: f64,
    /// m·c
    mass_steepness: f64,
}

impl Constants {
    fn of(parameters: &Parameters) -> Self {
        let (h, m) = (parameters.support_radius, parameters.particle_mass);
        Self {
            per_h: 1.0 / h,
            rest_density: parameters.rest_density,
            mass_weight: m * 21.0 / (2.0 * std::f64::consts::PI * h.powi(3)),
            mass_steepness: m * 210.0 / (std::f64::consts::PI * h.powi(5)),
        }
    }

    /// Σ m²|∇W|² in a full neighbourhood: mρ₀∫|∇W|² = mρ₀·c²·4π∫(1 − q)⁶r⁴ dr, ∫q⁴(1 − q)⁶ dq = 1/2310.
    fn full_factor(&self) -> f64 {
        let c2 = self.mass_steepness.powi(2);
        // m·c²: the mass cancels against the number of neighbours, ρ₀/m per volume
        4.0 * std::f64::consts::PI * c2 / (2310.0 * self.per_h.powi(5)) * self.neighbours_per_volume()
    }

    fn neighbours_per_volume(&self) -> f64 {
        // m from m·w
        let mass = self.mass_weight * 2.0 * std::f64::consts::PI / (21.0 * self.per_h.powi(3));
        self.rest_density / mass
    }

    /// 1 − q, zero beyond the support.
    #[inline(always)]
    fn nearness<S: Simd, V: SimdFloat<S, Element: Real>>(&self, r2: V) -> V {
        let of = V::Element::of;
        r2.sqrt().mul_add(of(-self.per_h), of(1.0)).max(of(0.0))
    }
}

/// ρ and the factor.
struct Densities<'a> {
    constants: Constants,
    walls: &'a Walls,
}

impl PairPass<0, 5, 2> for Densities<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        _: &[V; 0],
        _: [V; 0],
        sums: &mut [V; 5],
    ) {
        let of = V::Element::of;
        let s = self.constants.nearness(r2);
        let f = s * s * s;
        // 1 + 4q = 5 − 4s
        sums[0] = (f * s).mul_add(s.mul_add(of(-4.0), of(5.0)), sums[0]);
        for k in 0..3 {
            sums[1 + k] = f.mul_add(d[k], sums[1 + k]);
        }
        sums[4] = (f * f).mul_add(r2, sums[4]);
    }

    fn finish(&self, i: usize, [weight, x, y, z, squares]: [f64; 5]) -> [f64; 2] {
        let Constants { mass_weight, mass_steepness, rest_density, .. } = self.constants;
        let mut density = mass_weight * weight;
        let slope = -mass_steepness * DVec3::new(x, y, z);
        let own = match self.walls.near(i) {
            None => slope.length_squared(),
            Some(wall) => {
                density += rest_density * wall.part;
                let pushed = wall.completed(slope + 2.0 * rest_density * wall.gradient, LEAST_FREE);
                pushed.dot(slope + rest_density * wall.gradient)
            }
        };
        [density, own.max(0.0) + mass_steepness.powi(2) * squares]
    }
}

/// a(s)
struct Push<'a> {
    constants: Constants,
    walls: &'a Walls,
    pressure: &'a [f64],
    density: &'a [f64],
}

impl PairPass<1, 3, 3> for Push<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 1],
        other: [V; 1],
        sums: &mut [V; 3],
    ) {
        let s = self.constants.nearness(r2);
        let push = (own[0] + other[0]) * s * s * s;
        for k in 0..3 {
            sums[k] = push.mul_add(d[k], sums[k]);
        }
    }

    fn finish(&self, i: usize, sums: [f64; 3]) -> [f64; 3] {
        let push = self.constants.mass_steepness * DVec3::from_array(sums);
        let push = match self.walls.near(i) {
            None => push,
            Some(wall) => {
                let wall_push = -2.0 * self.density[i] * self.pressure[i] * wall.gradient;
                wall.completed(push + wall_push, LEAST_FREE)
            }
        };
        push.to_array()
    }
}

/// dρ/dt
struct Squeeze<'a> {
    constants: Constants,
    walls: &'a Walls,
    velocity: &'a Vectors,
    density: &'a [f64],
}

impl PairPass<3, 1, 1> for Squeeze<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        own: &[V; 3],
        other: [V; 3],
        sums: &mut [V; 1],
    ) {
        let s = self.constants.nearness(r2);
        let departing = (own[0] - other[0]) * d[0];
        let departing = (own[1] - other[1]).mul_add(d[1], departing);
        let departing = (own[2] - other[2]).mul_add(d[2], departing);
        sums[0] = (s * s * s).mul_add(departing, sums[0]);
    }

    fn finish(&self, i: usize, [sum]: [f64; 1]) -> [f64; 1] {
        let rate = -self.constants.mass_steepness * sum;
        let at_wall =
            self.walls.near(i).map_or(0.0, |w| self.density[i] * w.gradient.dot(self.velocity.get(i)));
        [rate + at_wall]
    }
}

/// Laminar viscosity (Morris et al. 1997) and gravity.
struct Drag<'a> {
    constants: Constants,
    walls: &'a Walls,
    velocity: &'a Vectors,
    /// ν, m²/s
    kinematic: f64,
    slip: Slip,
    gravity: DVec3,
}

impl PairPass<3, 3, 3> for Drag<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        _: [V; 3],
        r2: V,
        own: &[V; 3],
        other: [V; 3],
        sums: &mut [V; 3],
    ) {
        let s = self.constants.nearness(r2);
        let f = s * s * s;
        for k in 0..3 {
            sums[k] = f.mul_add(other[k] - own[k], sums[k]);
        }
    }

    fn finish(&self, i: usize, sums: [f64; 3]) -> [f64; 3] {
        let Constants { mass_steepness, rest_density, .. } = self.constants;
        let mut drag = 2.0 * self.kinematic * mass_steepness / rest_density * DVec3::from_array(sums);
        if let (Slip::No, Some(wall)) = (self.slip, self.walls.near(i)) {
            drag -= 2.0 * self.kinematic * (wall.drag * self.velocity.get(i));
        }
        (drag + self.gravity).to_array()
    }
}
