//! Smoothing kernels, all with the support radius h. The paper has three:
//!
//! - poly6, for density and the colour field (equations 8, 13, 14);
//! - spiky, for pressure (equation 10): its gradient does not vanish where particles meet;
//! - viscosity (equation 11): its Laplacian is positive everywhere.
//!
//! The other methods use Wendland's C2 (1995). Its Fourier transform is positive, so that particles do not
//! pair.
//!
//! Invariant: each kernel integrates to one over the ball of radius h and is exactly zero beyond it.

use std::f64::consts::PI;

use fearless_simd::{Simd, SimdFloat};

use super::pairs::Real;

/// The three kernels of the paper for one support radius, with their constants.
///
/// Arguments named `r2` are squares of distances, m²: those functions need no root. A gradient is returned as
/// the factor g in ∇W = g·**r**, with **r** from the neighbour to the particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernels {
    /// Support radius h, m.
    pub h: f64,
    /// h², m².
    pub h2: f64,
    poly6: f64,
    poly6_gradient: f64,
    spiky: f64,
    spiky_gradient: f64,
    viscosity: f64,
}

impl Kernels {
    /// Kernels of this support radius, m.
    pub fn new(support_radius: f64) -> Self {
        let h = support_radius;
        Self {
            h,
            h2: h * h,
            poly6: 315.0 / (64.0 * PI * h.powi(9)),
            poly6_gradient: -945.0 / (32.0 * PI * h.powi(9)),
            spiky: 15.0 / (PI * h.powi(6)),
            spiky_gradient: -45.0 / (PI * h.powi(6)),
            viscosity: 15.0 / (2.0 * PI * h.powi(3)),
        }
    }

    /// The kernel W_poly6 = 315/(64πh⁹)·(h² − r²)³, 1/m³.
    #[inline(always)]
    pub fn poly6(&self, r2: f64) -> f64 {
        let q = positive(self.h2 - r2);
        self.poly6 * q * q * q
    }

    /// The factor of ∇W_poly6 = −945/(32πh⁹)·(h² − r²)²·**r**, 1/m⁵.
    #[inline(always)]
    pub fn poly6_gradient(&self, r2: f64) -> f64 {
        let q = positive(self.h2 - r2);
        self.poly6_gradient * q * q
    }

    /// The Laplacian ∇²W_poly6 = −945/(32πh⁹)·(h² − r²)(3h² − 7r²), 1/m⁵.
    #[inline(always)]
    pub fn poly6_laplacian(&self, r2: f64) -> f64 {
        self.poly6_gradient * positive(self.h2 - r2) * (3.0 * self.h2 - 7.0 * r2)
    }

    /// The kernel W_spiky = 15/(πh⁶)·(h − r)³, 1/m³.
    pub fn spiky(&self, r: f64) -> f64 {
        self.spiky * positive(self.h - r).powi(3)
    }

    /// The factor of ∇W_spiky = −45/(πh⁶)·(h − r)²·**r**/r, 1/m⁵. Coinciding particles have no direction: the
    /// factor stays finite there, so that its product with **r** = 0 is zero.
    #[inline(always)]
    pub fn spiky_gradient(&self, r: f64) -> f64 {
        let q = positive(self.h - r);
        let least = 1e-12 * self.h;
        self.spiky_gradient * q * q / if r > least { r } else { least }
    }

    /// The constant of ∇W_spiky with h² taken out, 1/m⁴: ∇W = this·(1 − r/h)²·**r**/r.
    pub fn spiky_steepness(&self) -> f64 {
        self.spiky_gradient * self.h2
    }

    /// The kernel W_viscosity = 15/(2πh³)·(−r³/2h³ + r²/h² + h/2r − 1), 1/m³; infinite at r = 0.
    pub fn viscosity(&self, r: f64) -> f64 {
        if r > self.h {
            return 0.0;
        }
        let q = r / self.h;
        self.viscosity * (-0.5 * q * q * q + q * q + 0.5 / q - 1.0)
    }

    /// The Laplacian ∇²W_viscosity = 45/(πh⁶)·(h − r), 1/m⁵.
    #[inline(always)]
    pub fn viscosity_laplacian(&self, r: f64) -> f64 {
        -self.spiky_gradient * positive(self.h - r)
    }
}

/// What a particle of a lattice sees of the surface above it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// |Σ V ∇W|·h.
    pub normal: f64,
    /// The part of Σ V W that is missing.
    pub missing: f64,
}

/// The kernel Wendland C2: W = w·(1 − q)⁴(1 + 4q), ∇W = −c·(1 − q)³·**r**, with q = r/h.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wendland {
    /// Support radius h, m.
    pub h: f64,
    /// The factor w = 21/(2πh³), 1/m³.
    pub weight: f64,
    /// The factor c = 210/(πh⁵), 1/m⁵.
    pub steepness: f64,
}

impl Wendland {
    /// The kernel of this support radius, m.
    pub fn new(h: f64) -> Self {
        Self { h, weight: 21.0 / (2.0 * PI * h.powi(3)), steepness: 210.0 / (PI * h.powi(5)) }
    }

    /// W at the square of a distance, 1/m³.
    pub fn at(&self, r2: f64) -> f64 {
        let s = positive(1.0 - r2.sqrt() / self.h);
        self.weight * s.powi(4) * (5.0 - 4.0 * s)
    }

    /// Σ W·V over a cubic lattice with `ratio` spacings per support radius. It is a little more than ∫ W = 1,
    /// because a particle is always its own neighbour. Body- and face-centred lattices have the same sum to
    /// 2e-3.
    pub fn lattice_sum(ratio: f64) -> f64 {
        if ratio > MOST_COUNTED {
            return 1.0;
        }
        let reach = ratio.ceil() as i32;
        let weight = |x: i32, y: i32, z: i32| {
            let q = f64::from(x * x + y * y + z * z).sqrt() / ratio;
            (1.0 - q).max(0.0).powi(4) * (1.0 + 4.0 * q)
        };
        let cube = || -reach..=reach;
        let sum: f64 =
            cube().flat_map(|x| cube().flat_map(move |y| cube().map(move |z| weight(x, y, z)))).sum();
        sum * Self::new(ratio).weight
    }

    /// A layer under the flat surface of a cubic lattice with `ratio` spacings per support radius. Layer 0 is the
    /// outermost; the surface lies half a spacing above it.
    pub fn lattice_surface(ratio: f64, layer: u32) -> Surface {
        let ratio = ratio.min(MOST_COUNTED);
        let kernel = Self::new(ratio);
        let reach = ratio.ceil() as i32;
        let side = || -reach..=reach;
        let (mut normal, mut missing) = (0.0, 0.0);
        for z in layer as i32 + 1..=reach {
            for (x, y) in side().flat_map(|x| side().map(move |y| (x, y))) {
                let q = f64::from(x * x + y * y + z * z).sqrt() / ratio;
                let nearness = (1.0 - q).max(0.0);
                normal += kernel.steepness * nearness.powi(3) * f64::from(z) * ratio;
                missing += kernel.weight * nearness.powi(4) * (1.0 + 4.0 * q);
            }
        }
        Surface { normal, missing: missing / Self::lattice_sum(ratio) }
    }

    /// C = s²·Σ V·2(1 − cos πn_x)·∂²W/∂x² over a cubic lattice of the spacing s, with `ratio` spacings per
    /// support radius. Under an even pressure p, planes of particles that are displaced in turns to the left
    /// and to the right swing with ω² = C·p/(ρs²). Among all motions that leave every density as it is, this
    /// is the fastest.
    pub fn lattice_stiffness(ratio: f64) -> f64 {
        if ratio > MOST_COUNTED {
            return 0.0;
        }
        let kernel = Self::new(ratio);
        let reach = ratio.ceil() as i32;
        let bend = |x: i32, y: i32, z: i32| {
            let along = f64::from(x * x);
            let r2 = f64::from(x * x + y * y + z * z);
            let q = (r2.sqrt() / ratio).min(1.0);
            // W′/r and its slope over r
            let steepness = -kernel.steepness * (1.0 - q).powi(3);
            let change = 3.0 * kernel.steepness * (1.0 - q).powi(2) / (q * ratio * ratio);
            steepness + along * change
        };
        let side = || -reach..=reach;
        let planes = || side().filter(|x| x % 2 != 0);
        let sum: f64 =
            planes().flat_map(|x| side().flat_map(move |y| side().map(move |z| bend(x, y, z)))).sum();
        4.0 * sum
    }

    /// 1 − q for the squares of many distances, zero beyond the support.
    #[inline(always)]
    pub fn nearness<S: Simd, V: SimdFloat<S, Element: Real>>(&self, r2: V) -> V {
        let of = V::Element::of;
        r2.sqrt().mul_add(of(-1.0 / self.h), of(1.0)).max(of(0.0))
    }
}

/// Spacings per support radius up to which a lattice is counted out. With more, its sums are those of a fluid without
/// grains, to 2e-7 for the density and 4e-5 for the stiffness.
const MOST_COUNTED: f64 = 16.0;

/// max(x, 0) in one instruction. `f64::max` takes three, because it returns the number if the other argument
/// is NaN.
#[inline(always)]
fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    const H: f64 = 0.1;

    /// ∫ W over the ball, by the midpoint rule over n shells.
    fn integral(w: impl Fn(f64) -> f64) -> f64 {
        let n = 2000;
        let dr = H / n as f64;
        (0..n).map(|i| (i as f64 + 0.5) * dr).map(|r| 4.0 * PI * r * r * w(r) * dr).sum()
    }

    #[test]
    fn kernels_integrate_to_one() {
        let k = Kernels::new(H);
        // midpoint error of 2000 shells: about 1e-7
        let wendland = Wendland::new(H);
        for total in [
            integral(|r| k.poly6(r * r)),
            integral(|r| k.spiky(r)),
            integral(|r| k.viscosity(r)),
            integral(|r| wendland.at(r * r)),
        ] {
            assert!((total - 1.0).abs() < 1e-6, "{total}");
        }
    }

    #[test]
    fn kernels_are_positive_inside_and_zero_beyond() {
        let k = Kernels::new(H);
        for i in 1..100 {
            let r = H * i as f64 / 100.0;
            assert!(k.poly6(r * r) > 0.0 && k.spiky(r) > 0.0 && k.viscosity(r) > 0.0);
        }
        let r = H * 1.0001;
        assert_eq!(
            [k.poly6(r * r), k.spiky(r), k.viscosity(r), k.spiky_gradient(r), k.viscosity_laplacian(r)]
                .map(f64::abs),
            [0.0; 5]
        );
    }

    #[test]
    fn closed_values() {
        let k = Kernels::new(H);
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-14, "{a} {b}");
        close(k.poly6(0.0), 315.0 / (64.0 * PI * 1e-3));
        close(k.poly6(0.005), 315.0 / (64.0 * PI * 1e-3) / 8.0);
        close(k.spiky_gradient(0.05) * 0.05, -45.0 / (PI * 1e-4) / 4.0);
        close(k.viscosity_laplacian(0.05), 45.0 / (PI * 1e-5) / 2.0);
        assert!(k.spiky_gradient(0.0).is_finite());
    }

    /// Forces on a lattice whose planes are displaced in turns, from finite differences of the kernel.
    #[test]
    fn planes_of_a_lattice_are_as_stiff_as_the_forces_on_them() {
        for ratio in [2.0, 2.2, 2.6, 3.0] {
            let kernel = Wendland::new(ratio);
            let (way, d) = (1e-4, 1e-5);
            let value = |x: f64, y: i32, z: i32| kernel.at(x * x + f64::from(y * y + z * z));
            let mut force = 0.0;
            for (x, y, z) in
                (-4..=4).flat_map(|x| (-4..=4).flat_map(move |y| (-4..=4).map(move |z| (x, y, z))))
            {
                // planes of even numbers are at +way, the others at −way
                let apart = f64::from(x) + if x % 2 == 0 { 0.0 } else { 2.0 * way };
                force -= (value(apart + d, y, z) - value(apart - d, y, z)) / d;
            }
            let (stiffness, known) = (-force / way, Wendland::lattice_stiffness(ratio));
            // the kernel's third derivative jumps at its rim
            assert!((stiffness / known - 1.0).abs() < 2e-3, "{ratio}: {stiffness} {known}");
        }
    }

    #[test]
    fn gradients_and_laplacians_match_finite_differences() {
        let k = Kernels::new(H);
        let d = 1e-6;
        for i in 1..10 {
            let r = H * i as f64 / 10.0;
            let slope = |w: &dyn Fn(f64) -> f64| (w(r + d) - w(r - d)) / (2.0 * d);
            // Laplacian of a radial function: (r W)″ / r
            let laplacian = |w: &dyn Fn(f64) -> f64| {
                let d = 1e-4 * H;
                ((r + d) * w(r + d) - 2.0 * r * w(r) + (r - d) * w(r - d)) / (d * d * r)
            };
            let poly6 = |r: f64| k.poly6(r * r);
            let close = |a: f64, b: f64, scale: f64| assert!((a - b).abs() < 1e-5 * scale, "{a} {b} at {r}");
            close(k.poly6_gradient(r * r) * r, slope(&poly6), k.poly6(0.0) / H);
            close(k.spiky_gradient(r) * r, slope(&|r| k.spiky(r)), k.spiky(0.0) / H);
            close(k.poly6_laplacian(r * r), laplacian(&poly6), k.poly6(0.0) / (H * H));
            let wendland = Wendland::new(H);
            let gradient = -wendland.steepness * (1.0 - r / H).powi(3) * r;
            close(gradient, slope(&|r| wendland.at(r * r)), wendland.weight / H);
            close(k.viscosity_laplacian(r), laplacian(&|r| k.viscosity(r)), k.viscosity_laplacian(0.0));
        }
    }

    #[test]
    fn gradients_sum_to_zero_over_a_symmetric_lattice() {
        let k = Kernels::new(H);
        let mut sums = [DVec3::ZERO; 2];
        for i in 0..343i32 {
            let r = DVec3::new((i % 7 - 3) as f64, (i / 7 % 7 - 3) as f64, (i / 49 - 3) as f64) * 0.03;
            sums[0] += k.poly6_gradient(r.length_squared()) * r;
            sums[1] += k.spiky_gradient(r.length()) * r;
        }
        assert!(sums[0].length() < 1e-9 * k.poly6(0.0) / H);
        assert!(sums[1].length() < 1e-9 * k.spiky(0.0) / H);
    }
}
