//! What a wall takes of a kernel, in closed form, so that walls need no wall particles.
//!
//! For a particle at the distance d from a wall, the part λ of its kernel lies inside the wall. With δ = d/h
//! and W = h⁻³·w(r/h):
//!
//! - λ(δ) = 2π ∫ (q − δ)·q·w(q) dq from δ to 1: what the wall adds to a density, as a part of the rest
//!   density;
//! - A(δ) = −h·dλ/dd = 2π ∫ q·w(q) dq: ∫ ∇W over the wall is −A/h times its normal, out of the wall;
//! - j(δ) = 2π ∫ (q² − δ²)·q·w(q) dq: a wall of mean curvature H (positive where it is convex) has λ −
//!   ½·H·h·j instead of λ.
//!
//! λ of a plane is the "wall weight" that Harada et al. (2007) tabulate and Fujisawa & Miura (2015)
//! integrate. The polynomials here are the integrals above, carried out. They are written with the factor 1 −
//! δ and positive terms, so that nothing cancels as the particle leaves the wall. The inner piece of the
//! spline stays away from zero and is expanded.
//!
//! [`super::layers`] sums them over the layers of walls, as a fluid in layers has it.
//!
//! Invariant: λ(δ) + λ(−δ) = 1 for a continuous wall. All quantities vanish from δ = 1 on.
/// A smoothing kernel whose integrals over a wall are known; h is the radius of its support.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WallKernel {
    /// Poly6: w = 315/64π·(1 − q²)³.
    Poly6,
    /// Spiky: w = 15/π·(1 − q)³.
    Spiky,
    /// Cubic spline: w = 8/π·(1 − 6q² + 6q³) up to q = ½, then 16/π·(1 − q)³ (Monaghan 1992).
    CubicSpline,
    /// Wendland C2: w = 21/2π·(1 − q)⁴·(1 + 4q) (Wendland 1995).
    WendlandC2,
}

impl WallKernel {
    /// All kernels.
    pub const ALL: [Self; 4] = [Self::Poly6, Self::Spiky, Self::CubicSpline, Self::WendlandC2];

    /// λ: the part of the kernel beyond a plane at the distance δ = d/h. A negative δ is inside the wall.
    pub fn covered(self, delta: f64) -> f64 {
        if delta < 0.0 {
            return 1.0 - self.covered(-delta);
        }
        let d = delta.min(1.0);
        let s = 1.0 - d;
        match self {
            Self::Poly6 => s.powi(5) * horner(&[35.0, 175.0, 345.0, 325.0, 128.0], d) / 256.0,
            Self::Spiky => s.powi(5) * (0.5 + d),
            Self::CubicSpline if d < 0.5 => horner(&[96.0, -144.0, 0.0, 80.0, 0.0, -42.0, 15.0], d) / 30.0,
            Self::CubicSpline => 8.0 / 15.0 * s.powi(5) * (1.0 + 2.0 * d),
            Self::WendlandC2 => s.powi(6) * horner(&[3.0, 3.0, 1.0], d) / 2.0,
        }
    }

    /// A = −dλ/dδ: how strongly the wall repels, even in δ.
    pub fn slope(self, delta: f64) -> f64 {
        let d = delta.abs().min(1.0);
        let s = 1.0 - d;
        match self {
            Self::Poly6 => 315.0 / 256.0 * (s * (1.0 + d)).powi(4),
            Self::Spiky => 1.5 * s.powi(4) * (1.0 + 4.0 * d),
            Self::CubicSpline if d < 0.5 => horner(&[-96.0, 120.0, 0.0, -40.0, 0.0, 7.0], d) / 5.0,
            Self::CubicSpline => 1.6 * s.powi(4) * (1.0 + 4.0 * d),
            Self::WendlandC2 => 1.5 * s.powi(5) * horner(&[8.0, 5.0, 1.0], d),
        }
    }

    /// The derivative −dA/dδ = 2πδ·w(|δ|): how a layer of the wall at this distance repels, odd in δ.
    pub fn steepness(self, delta: f64) -> f64 {
        let d = delta.abs().min(1.0);
        let s = 1.0 - d;
        delta.signum()
            * d
            * match self {
                Self::Poly6 => 315.0 / 32.0 * (s * (1.0 + d)).powi(3),
                Self::Spiky => 30.0 * s.powi(3),
                Self::CubicSpline if d < 0.5 => horner(&[96.0, -96.0, 0.0, 16.0], d),
                Self::CubicSpline => 32.0 * s.powi(3),
                Self::WendlandC2 => 21.0 * s.powi(4) * (1.0 + 4.0 * d),
            }
    }

    /// The part of a kernel's sum over a cubic lattice that lies behind a face half a spacing before a particle, with
    /// `ratio` spacings per support radius.
    pub(super) fn lattice_behind(self, ratio: f64) -> f64 {
        let reach = ratio.ceil() as i32;
        let side = || -reach..=reach;
        let [mut behind, mut all] = [0.0; 2];
        for z in side() {
            for (x, y) in side().flat_map(|x| side().map(move |y| (x, y))) {
                // the kernel is −dA/dδ over 2πδ; at the particle itself, its limit
                let q = (f64::from(x * x + y * y + z * z).sqrt() / ratio).max(AT_PARTICLE);
                let weight = self.steepness(q) / q;
                all += weight;
                behind += if z > 0 { weight } else { 0.0 };
            }
        }
        behind / all
    }

    /// A and −dA/dδ, computed together.
    #[inline]
    pub(super) fn slope_and_steepness(self, delta: f64) -> (f64, f64) {
        if self != Self::WendlandC2 {
            return (self.slope(delta), self.steepness(delta));
        }
        let d = delta.abs().min(1.0);
        let s = 1.0 - d;
        let s4 = (s * s) * (s * s);
        (1.5 * s4 * s * ((8.0 * d + 5.0) * d + 1.0), 21.0 * delta * s4 * (1.0 + 4.0 * d))
    }

    /// j: the moment for the wall's curvature, even in δ; dj/dδ = −2δA.
    pub fn curvature_moment(self, delta: f64) -> f64 {
        let d = delta.abs().min(1.0);
        let s = 1.0 - d;
        match self {
            Self::Poly6 => 63.0 / 256.0 * (s * (1.0 + d)).powi(5),
            Self::Spiky => 3.0 / 14.0 * s.powi(5) * horner(&[8.0, 5.0, 1.0], d),
            Self::CubicSpline if d < 0.5 => {
                horner(&[768.0, -1120.0, 0.0, 560.0, 0.0, -196.0, 0.0, 31.0], d) / 140.0
            }
            Self::CubicSpline => 8.0 / 35.0 * s.powi(5) * horner(&[8.0, 5.0, 1.0], d),
            Self::WendlandC2 => s.powi(6) * horner(&[64.0, 69.0, 30.0, 5.0], d) / 24.0,
        }
    }

    /// About the distance δ at which λ is `part`, at most ½.
    pub(super) fn near_distance_of(self, part: f64) -> f64 {
        // λ falls as about (1 − δ)⁶ at the end of the support, and in proportion to ½ − δ·A(0) at the wall
        let u = f64::from((2.0 * part as f32).powf(1.0 / 6.0));
        let left = match self {
            // a fit, right to 0.003·u
            Self::WendlandC2 => u * horner(&[0.493_516, -0.657_066, 0.372_764, 0.063_965, 0.724_114], u),
            Self::Poly6 | Self::Spiky | Self::CubicSpline => u,
        };
        (1.0 - left).clamp(0.0, 1.0)
    }

    /// λ of a curved wall. `curvature` is H·h, the mean curvature in units of 1/h, positive where the wall is
    /// convex. For balls and cavities the error is at most 0.026·(h/R)², which at h/R = 0.4 is a tenth of the
    /// plane's error.
    pub fn covered_by_curved(self, delta: f64, curvature: f64) -> f64 {
        // walls of the box are flat, and most others are
        let bent = if curvature == 0.0 { 0.0 } else { 0.5 * curvature * self.curvature_moment(delta) };
        self.covered(delta) - bent
    }
}

/// A distance, over the support radius, at which a kernel is what it is at its particle.
const AT_PARTICLE: f64 = 1e-9;

/// The value at x of the polynomial with these coefficients, the highest power first.
fn horner(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().fold(0.0, |sum, c| sum * x + c)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// w(q) of the kernel.
    pub(in crate::sph::walls) fn weight(kernel: WallKernel, q: f64) -> f64 {
        let s = (1.0 - q).max(0.0);
        match kernel {
            WallKernel::Poly6 => 315.0 / (64.0 * PI) * (1.0 - q * q).max(0.0).powi(3),
            WallKernel::Spiky => 15.0 / PI * s.powi(3),
            WallKernel::CubicSpline if q < 0.5 => 8.0 / PI * (1.0 - 6.0 * q * q + 6.0 * q * q * q),
            WallKernel::CubicSpline => 16.0 / PI * s.powi(3),
            WallKernel::WendlandC2 => 21.0 / (2.0 * PI) * s.powi(4) * (1.0 + 4.0 * q),
        }
    }

    /// ∫ f from a to b by three-point Gauss on `panels` panels.
    pub(in crate::sph::walls) fn integral(
        a: f64,
        b: f64,
        panels: usize,
        mut f: impl FnMut(f64) -> f64,
    ) -> f64 {
        let half = 0.5 * (b - a) / panels as f64;
        let node = half * 0.6f64.sqrt();
        let middle = |i: usize| a + half * (2 * i + 1) as f64;
        let panel = |m: f64| 5.0 * f(m - node) + 8.0 * f(m) + 5.0 * f(m + node);
        (0..panels).map(middle).map(panel).sum::<f64>() * half / 9.0
    }

    #[test]
    fn closed_forms_are_the_integrals_over_a_half_space() {
        for kernel in WallKernel::ALL {
            for delta in [-0.7, -0.2, 0.0, 0.1, 0.45, 0.5, 0.6, 0.95] {
                // cylinders around the normal: height z above the particle, distance r from the axis
                let beyond = |moment: &dyn Fn(f64) -> f64| {
                    integral(delta, 1.0, 300, |z| {
                        let disc = integral(0.0, 1.0, 300, |r| {
                            2.0 * PI * r * weight(kernel, (r * r + z * z).sqrt())
                        });
                        moment(z) * disc
                    })
                };
                // kinks of the spline and at the edge of the support: 1e-9
                let lambda = kernel.covered(delta);
                assert!((beyond(&|_| 1.0) - lambda).abs() < 2e-8, "{kernel:?} {delta}: {lambda}");
                // j = 2∫ (z² − δ²)/2 · disc' …, integrated by parts: 2∫ z · disc dz
                let j = kernel.curvature_moment(delta);
                assert!((2.0 * beyond(&|z| z) - j).abs() < 2e-8, "{kernel:?} {delta}: {j}");
            }
        }
    }

    #[test]
    fn derivatives_agree() {
        let e = 1e-5;
        for kernel in WallKernel::ALL {
            for i in -120..=120 {
                let delta = f64::from(i) / 110.0 + 1e-3;
                let slope = |f: &dyn Fn(f64) -> f64| (f(delta + e) - f(delta - e)) / (2.0 * e);
                let a = kernel.slope(delta);
                // third derivatives are below 60, rounding is 1e-11
                assert!((slope(&|d| kernel.covered(d)) + a).abs() < 2e-9, "{kernel:?} {delta}");
                let j = slope(&|d| kernel.curvature_moment(d));
                assert!((j + 2.0 * delta * a).abs() < 4e-9, "{kernel:?} {delta}: {j}");
            }
        }
    }

    #[test]
    fn steepness_is_the_slope_of_the_slope() {
        let e = 1e-5;
        for kernel in WallKernel::ALL {
            for i in -120..=120 {
                let delta = f64::from(i) / 110.0 + 1e-3;
                let fall = (kernel.slope(delta - e) - kernel.slope(delta + e)) / (2.0 * e);
                let (slope, steep) = (kernel.slope(delta), kernel.steepness(delta));
                assert!((fall - steep).abs() < 1e-7, "{kernel:?} {delta}: {fall} {steep}");
                let (a, b) = kernel.slope_and_steepness(delta);
                assert!((a - slope).abs() < 1e-14 && (b - steep).abs() < 1e-14, "{kernel:?} {delta}");
            }
        }
    }

    #[test]
    fn a_wall_and_its_complement_take_all() {
        for kernel in WallKernel::ALL {
            for i in 0..=200 {
                let delta = f64::from(i) / 100.0;
                let (lambda, inside) = (kernel.covered(delta), kernel.covered(-delta));
                assert!((lambda + inside - 1.0).abs() < 1e-15 && lambda >= 0.0, "{kernel:?} {delta}");
            }
            assert!((kernel.covered(0.0) - 0.5).abs() < 1e-15, "{kernel:?}");
            assert_eq!([1.0, 1.5].map(|d| kernel.covered(d)), [0.0; 2]);
            assert_eq!([1.0, 1.5].map(|d| kernel.slope(d)), [0.0; 2]);
        }
    }

    /// λ of a ball of radius R (h = 1), or of all but a ball, by the part of each sphere of radius q that
    /// lies in it.
    fn of_ball(kernel: WallKernel, delta: f64, radius: f64, cavity: bool) -> f64 {
        let centre = if cavity { radius - delta } else { radius + delta };
        integral(0.0, 1.0, 4000, |q| {
            let c = (q * q + centre * centre - radius * radius) / (2.0 * q * centre);
            let c = if cavity { -c } else { c };
            4.0 * PI * q * q * weight(kernel, q) * 0.5 * (1.0 - c.clamp(-1.0, 1.0))
        })
    }

    #[test]
    fn curvature_is_corrected_to_second_order() {
        for kernel in WallKernel::ALL {
            for ratio in [0.05, 0.1, 0.2, 0.4] {
                let (mut plane, mut corrected): (f64, f64) = (0.0, 0.0);
                for i in 0..=18 {
                    let delta = 0.05 * f64::from(i);
                    for (cavity, curvature) in [(false, ratio), (true, -ratio)] {
                        let exact = of_ball(kernel, delta, 1.0 / ratio, cavity);
                        plane = plane.max((kernel.covered(delta) - exact).abs());
                        corrected = corrected.max((kernel.covered_by_curved(delta, curvature) - exact).abs());
                    }
                }
                // the bound of the second-order term, and a tenth of it for higher terms
                assert!(corrected < 0.0286 * ratio * ratio, "{kernel:?} {ratio}: {corrected:e}");
                assert!(plane > 0.08 * ratio, "{kernel:?} {ratio}: {plane:e}");
            }
        }
    }
}
