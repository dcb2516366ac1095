//! Walls of the solver: row 43. The law of reflection, row 44, is private to the solver and tested there, as
//! a formula in `sph::contact` and by bounces in `sph::tests`.

use rfm::sph::WallKernel;

#[test]
fn row_43_the_part_of_a_kernel_in_a_wall() {
    let expected = [
        (WallKernel::Poly6, 0.048_927_307_128_906_25),
        (WallKernel::Spiky, 0.031_25),
        (WallKernel::CubicSpline, 1.0 / 30.0),
        (WallKernel::WendlandC2, 0.025_390_625),
    ];
    for (kernel, half) in expected {
        // λ consists of numbers up to ½
        let close = |a: f64, b: f64| assert!((a - b).abs() <= f64::EPSILON, "{kernel:?}: {a:?} {b:?}");
        close(kernel.covered(0.0), 0.5);
        close(kernel.covered(0.5), half);
        // both pieces of the spline
        close(kernel.covered(0.5_f64.next_down()), half);
        close(kernel.covered(-0.5), 1.0 - half);
        close(kernel.covered(0.3) + kernel.covered(-0.3), 1.0);
    }
}
