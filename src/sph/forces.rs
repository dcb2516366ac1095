//! Accelerations: pressure, viscosity, surface tension and gravity (equations 10–14).
//!
//! The paper gives force densities f_i; here a_i = f_i/ρ_i, with m_j/ρ_j as the volume of a neighbour in every
//! sum. The paper prints m_j/ρ_i in (11) and (14). With m_j/ρ_j each pair of particles exchanges
//! m·a = ∓ m²/(ρ_i ρ_j)·(…), the same number with opposite signs: momentum is conserved to rounding.
//! With the printed factor the lighter of two particles would push less than it is pushed.
//! Surface tension is no pair force and conserves momentum only as far as the surface is closed.
//!
//! Invariant: particle i gathers from its list in the list's order and writes only a_i.

use rayon::prelude::*;

use glam::DVec3;

use super::{
    kernel::Kernels,
    neighbours::{BLOCK, BlockList, Neighbours},
    params::Parameters,
    particles::{Particles, Vectors},
};

/// What one particle must know of another, in one cache line.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
pub(super) struct Record {
    position: [f64; 3],
    velocity: [f64; 3],
    pressure: f64,
    /// m/ρ, m³
    volume: f64,
}

/// Which terms a fluid has; a term that it lacks is not compiled into its loop.
#[derive(Debug, Clone, Copy)]
pub(super) struct Terms {
    pub pressure: bool,
    pub viscosity: bool,
    pub tension: bool,
}

impl Terms {
    pub fn of(parameters: &Parameters) -> Self {
        Self {
            pressure: parameters.stiffness > 0.0,
            viscosity: parameters.viscosity > 0.0,
            tension: parameters.surface_tension > 0.0,
        }
    }

    pub fn any(self) -> bool {
        self.pressure || self.viscosity || self.tension
    }
}

/// Acceleration of every particle, m/s², for the velocities given (predicted ones: viscosity needs the
/// velocity at the instant of the positions, before the step that computes it is complete).
pub(super) fn find_accelerations(
    parameters: &Parameters,
    kernels: &Kernels,
    neighbours: &Neighbours,
    particles: &Particles,
    predicted_velocity: &Vectors,
    records: &mut Vec<Record>,
    acceleration: &mut Vectors,
) {
    acceleration.resize(particles.len());
    let terms = Terms::of(parameters);
    if !terms.any() {
        let g = parameters.gravity;
        acceleration.x.fill(g.x);
        acceleration.y.fill(g.y);
        acceleration.z.fill(g.z);
        return;
    }
    records.clear();
    records.extend((0..particles.len()).map(|i| Record {
        position: particles.position.get(i).to_array(),
        velocity: predicted_velocity.get(i).to_array(),
        pressure: particles.pressure[i],
        volume: parameters.particle_mass / particles.density[i],
    }));
    let gather = match (terms.viscosity, terms.tension) {
        (true, true) => gather::<true, true>,
        (true, false) => gather::<true, false>,
        (false, true) => gather::<false, true>,
        (false, false) => gather::<false, false>,
    };
    let Vectors { x, y, z } = acceleration;
    x.par_chunks_mut(BLOCK)
        .zip(y.par_chunks_mut(BLOCK))
        .zip(z.par_chunks_mut(BLOCK))
        .zip(neighbours.blocks())
        .enumerate()
        .for_each(|(b, (((x, y), z), block))| {
            for k in 0..x.len() {
                let a = gather(parameters, kernels, records, block, b * BLOCK, k);
                (x[k], y[k], z[k]) = (a.x, a.y, a.z);
            }
        });
}

/// Acceleration of the particle `first + k`.
#[inline(always)]
fn gather<const VISCOSITY: bool, const TENSION: bool>(
    parameters: &Parameters,
    kernels: &Kernels,
    records: &[Record],
    block: &BlockList,
    first: usize,
    k: usize,
) -> DVec3 {
    let i = &records[first + k];
    let mut sums = Sums::default();
    let mut pairs = block.of(k).chunks_exact(LANES);
    for j in &mut pairs {
        sums.add::<VISCOSITY, TENSION>(kernels, i, std::array::from_fn(|l| &records[j[l] as usize]));
    }
    if let [j] = pairs.remainder() {
        sums.add::<VISCOSITY, TENSION>(kernels, i, [&records[*j as usize], &NOTHING]);
    }

    let mut force = -0.5 * total(sums.pressure) + parameters.viscosity * total(sums.viscous);
    if TENSION {
        let normal = total(sums.normal);
        let length = normal.length();
        if length >= parameters.surface_threshold {
            // a particle is part of its own colour field: ∇W(0) = 0, but ∇²W(0) is not
            let curvature = i.volume * kernels.poly6_laplacian(0.0) + sums.curvature[0] + sums.curvature[1];
            force -= parameters.surface_tension * curvature / length * normal;
        }
    }
    force * (i.volume / parameters.particle_mass) + parameters.gravity
}

/// Neighbours handled side by side: as many doubles as a vector register of every x86-64 has.
const LANES: usize = 2;

/// A neighbour without volume: it fills the last lane of an odd list and adds zero.
const NOTHING: Record = Record { position: [0.0; 3], velocity: [0.0; 3], pressure: 0.0, volume: 0.0 };

/// The sums over neighbours, each lane its own; added up once at the end, always in the same order.
#[derive(Default)]
struct Sums {
    /// Σ V_j (p_i + p_j) ∇W_spiky
    pressure: [[f64; LANES]; 3],
    /// Σ V_j (u_j − u_i) ∇²W_viscosity
    viscous: [[f64; LANES]; 3],
    /// ∇c = Σ V_j ∇W_poly6
    normal: [[f64; LANES]; 3],
    /// ∇²c without the particle itself
    curvature: [f64; LANES],
}

impl Sums {
    #[inline(always)]
    fn add<const VISCOSITY: bool, const TENSION: bool>(
        &mut self,
        kernels: &Kernels,
        i: &Record,
        j: [&Record; LANES],
    ) {
        let d: [[f64; LANES]; 3] =
            std::array::from_fn(|c| std::array::from_fn(|l| i.position[c] - j[l].position[c]));
        let r2: [f64; LANES] =
            std::array::from_fn(|l| d[0][l] * d[0][l] + d[1][l] * d[1][l] + d[2][l] * d[2][l]);
        let r = r2.map(f64::sqrt);
        let push: [f64; LANES] = std::array::from_fn(|l| {
            j[l].volume * (i.pressure + j[l].pressure) * kernels.spiky_gradient(r[l])
        });
        accumulate(&mut self.pressure, push, d);
        if VISCOSITY {
            let drag: [f64; LANES] = std::array::from_fn(|l| j[l].volume * kernels.viscosity_laplacian(r[l]));
            let difference: [[f64; LANES]; 3] =
                std::array::from_fn(|c| std::array::from_fn(|l| j[l].velocity[c] - i.velocity[c]));
            accumulate(&mut self.viscous, drag, difference);
        }
        if TENSION {
            let slope: [f64; LANES] = std::array::from_fn(|l| j[l].volume * kernels.poly6_gradient(r2[l]));
            accumulate(&mut self.normal, slope, d);
            self.curvature =
                std::array::from_fn(|l| self.curvature[l] + j[l].volume * kernels.poly6_laplacian(r2[l]));
        }
    }
}

/// sum += factor · vector, lane by lane.
#[inline(always)]
fn accumulate(sum: &mut [[f64; LANES]; 3], factor: [f64; LANES], vector: [[f64; LANES]; 3]) {
    for (sum, vector) in sum.iter_mut().zip(vector) {
        *sum = std::array::from_fn(|l| sum[l] + factor[l] * vector[l]);
    }
}

fn total(lanes: [[f64; LANES]; 3]) -> DVec3 {
    DVec3::from_array(lanes.map(|[a, b]| a + b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sph::scenes;

    /// Total force over the sum of its parts' magnitudes, for a random cloud with random velocities.
    fn imbalance(parameters: &Parameters) -> f64 {
        let simulation = scenes::free_cloud(parameters.clone(), 500, 0.15);
        let (mut total, mut scale) = (DVec3::ZERO, 0.0);
        for a in simulation.acceleration().iter() {
            total += a;
            scale += a.length();
        }
        assert!(scale > 0.0);
        total.length() / scale
    }

    #[test]
    fn pair_forces_conserve_momentum_to_rounding() {
        let free = Parameters { gravity: DVec3::ZERO, surface_tension: 0.0, ..Parameters::default() };
        assert!(imbalance(&free) < 1e-14);
        assert!(imbalance(&Parameters { stiffness: 0.0, ..free.clone() }) < 1e-14);
        assert!(imbalance(&Parameters { viscosity: 0.0, ..free }) < 1e-14);
    }

    #[test]
    fn a_pair_feels_the_printed_forces() {
        let parameters = Parameters { gravity: DVec3::ZERO, surface_tension: 0.0, ..Parameters::default() };
        let kernels = Kernels::new(parameters.support_radius);
        // rest density low enough that two particles are under pressure
        let parameters = Parameters { rest_density: 1.0, ..parameters };
        let pair = [(DVec3::ZERO, DVec3::Y), (DVec3::X * 0.03, DVec3::ZERO)];
        let simulation = scenes::free(parameters.clone(), &pair);
        let m = parameters.particle_mass;
        let rho = m * (kernels.poly6(0.0) + kernels.poly6(0.0009));
        let p = 3.0 * (rho - 1.0);
        let x = p * m / rho * kernels.spiky_gradient(0.03) * 0.03 / rho;
        let y = -3.5 * m / rho * kernels.viscosity_laplacian(0.03) / rho;
        let first = simulation.particles().order_by_id()[0];
        let a = simulation.acceleration().get(first);
        assert!((a - DVec3::new(x, y, 0.0)).length() < 1e-12 * a.length(), "{a} {x} {y}");
    }

    #[test]
    fn surface_tension_pulls_a_drop_together() {
        let parameters = Parameters {
            gravity: DVec3::ZERO,
            stiffness: 0.0,
            viscosity: 0.0,
            surface_tension: 1.0,
            ..Parameters::default()
        };
        let simulation = scenes::free_drop(parameters, 500);
        let inward = |(p, a): (DVec3, DVec3)| -p.dot(a);
        let work: f64 =
            simulation.particles().position.iter().zip(simulation.acceleration().iter()).map(inward).sum();
        assert!(work > 0.0, "{work}");
    }
}
