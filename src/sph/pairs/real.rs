//! The two precisions of sums over neighbours.

use fearless_simd::SimdFloatElement;

/// A precision for sums over neighbours.
pub(in crate::sph) trait Real:
    SimdFloatElement + Default + Copy + Send + Sync + 'static
{
    /// Rounds a number to this precision.
    fn of(x: f64) -> Self;

    /// The number as `f64`.
    fn wide(self) -> f64;
}

macro_rules! real {
    ($real:ty) => {
        impl Real for $real {
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $real
            }

            #[inline(always)]
            fn wide(self) -> f64 {
                self.into()
            }
        }
    };
}
real!(f32);
real!(f64);
