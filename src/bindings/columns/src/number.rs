//! What differs between the types of numbers that points can have.

use multiversion::multiversion;
use rfm::Solid;
use rfm::field::{Field, Points};
use rfm::solid::{Chosen, Lane};

use crate::memory::BLOCK;

/// A number type that points can have.
pub trait Number: Lane {
    /// ω, by the cheaper program that keeps the tolerance of the file if there is one for this type.
    fn omega(solid: &Solid, chosen: Option<&Chosen>, points: [&[Self]; 3], omega: &mut [Self]);

    /// Sorts the bytes of points, x y z x y z …, into columns.
    fn deinterleave(points: &[u8], columns: &mut [[Self; BLOCK]; 3]);
}

macro_rules! deinterleave {
    ($name:ident, $number:ty) => {
        /// Sorts points into columns, in the widest registers of the processor.
        #[multiversion(targets("x86_64+avx2+bmi2", "x86_64+avx512f+avx512vl+avx512bw"))]
        fn $name(points: &[u8], [x, y, z]: &mut [[$number; BLOCK]; 3]) {
            const SIZE: usize = size_of::<$number>();
            let points = points.as_chunks::<{ 3 * SIZE }>().0;
            for (((point, x), y), z) in points.iter().zip(x).zip(y).zip(z) {
                let [a, b, c] = [0, 1, 2].map(|axis| <$number>::from_ne_bytes(bytes::<SIZE>(point, axis)));
                (*x, *y, *z) = (a, b, c);
            }
        }
    };
}

/// The bytes of one coordinate of a point.
#[inline(always)]
fn bytes<const SIZE: usize>(point: &[u8], axis: usize) -> [u8; SIZE] {
    let mut number = [0; SIZE];
    number.copy_from_slice(&point[axis * SIZE..][..SIZE]);
    number
}

deinterleave!(deinterleave_single, f32);
deinterleave!(deinterleave_double, f64);

impl Number for f32 {
    fn omega(solid: &Solid, _: Option<&Chosen>, points: [&[Self]; 3], omega: &mut [Self]) {
        solid.omega_many(points, omega);
    }

    fn deinterleave(points: &[u8], columns: &mut [[Self; BLOCK]; 3]) {
        deinterleave_single(points, columns);
    }
}

impl Number for f64 {
    fn omega(solid: &Solid, chosen: Option<&Chosen>, points: [&[Self]; 3], omega: &mut [Self]) {
        match chosen {
            Some(chosen) => chosen.omega_many(Points::new(points[0], points[1], points[2]), omega),
            None => solid.omega_many(points, omega),
        }
    }

    fn deinterleave(points: &[u8], columns: &mut [[Self; BLOCK]; 3]) {
        deinterleave_double(points, columns);
    }
}
