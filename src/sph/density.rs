//! Density from the neighbours, and pressure from the density (equations 8 and 9).
//!
//! Invariant: a particle counts itself, so no density is zero.

use rayon::prelude::*;

use super::{
    kernel::Kernels,
    neighbours::{BLOCK, Neighbours},
    params::Parameters,
    particles::Vectors,
};

/// ρ_i = Σ_j m W_poly6(r_ij), i included (equation 8), kg/m³.
pub(super) fn find_density(
    neighbours: &Neighbours,
    position: &Vectors,
    kernels: &Kernels,
    mass: f64,
    density: &mut [f64],
) {
    let (x, y, z) = (&position.x[..], &position.y[..], &position.z[..]);
    density.par_chunks_mut(BLOCK).zip(neighbours.blocks()).enumerate().for_each(|(b, (density, block))| {
        for (k, rho) in density.iter_mut().enumerate() {
            let i = b * BLOCK + k;
            let (xi, yi, zi) = (x[i], y[i], z[i]);
            let mut sum = kernels.poly6(0.0);
            for &j in block.of(k) {
                let j = j as usize;
                let (dx, dy, dz) = (xi - x[j], yi - y[j], zi - z[j]);
                sum += kernels.poly6(dx * dx + dy * dy + dz * dz);
            }
            *rho = mass * sum;
        }
    });
}

/// p_i from ρ_i (equation 9), Pa.
pub(super) fn find_pressure(parameters: &Parameters, density: &[f64], pressure: &mut [f64]) {
    for (p, &rho) in pressure.iter_mut().zip(density) {
        *p = parameters.pressure(rho);
    }
}

#[cfg(test)]
mod tests {
    use crate::sph::{Parameters, scenes};

    #[test]
    fn a_lattice_of_the_rest_spacing_has_the_rest_density() {
        let parameters = Parameters::default();
        let simulation = scenes::free_drop(parameters.clone(), 2000);
        let particles = simulation.particles();
        let centre = particles.order_by_id()[0];
        // 3.7 spacings per support radius: the sum differs from the integral by less than 1 %
        assert!((particles.density[centre] / parameters.rest_density - 1.0).abs() < 0.01);
        assert_eq!(particles.pressure[centre], parameters.pressure(particles.density[centre]));
    }

    #[test]
    fn a_lone_particle_counts_itself() {
        let parameters = Parameters::default();
        let simulation = scenes::free_drop(parameters.clone(), 1);
        let expected = parameters.particle_mass * 315.0 / (64.0 * std::f64::consts::PI * 1e-3);
        assert!((simulation.particles().density[0] / expected - 1.0).abs() < 1e-14);
    }
}
