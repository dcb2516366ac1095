//! R₀ and the other operations that join leaves, as loops over columns in the widest vectors of this
//! processor.
//!
//! The code generator stops at 128 bits, and roots and divisions are what R₀ costs: on processors that take
//! as long for 128 as for 256 or 512 bits, these loops are two to three times as fast. They are the
//! specification itself, `ir::r0`, compiled for several instruction sets, of which one is chosen when the
//! program runs; none of them contracts a product and a sum, so all give the same bits.

use multiversion::multiversion;

use crate::codegen::Form;
use crate::ir::{Binary, r0};

/// u, v → result
pub type Kernel<T> = fn(&[T], &[T], &mut [T]);

/// u, v → result, ∂/∂u, ∂/∂v
pub type WeightedKernel<T> = fn(&[T], &[T], [&mut [T]; 3]);

/// A type that there are kernels for.
pub trait Wide: Sized {
    /// The loop for an operation; `None` if there is none.
    fn kernel(op: Binary, form: Form) -> Option<Kernel<Self>>;

    /// The loop that negates its first operand.
    fn negation() -> Kernel<Self>;

    /// The loop for R₀ with both weights; `None` for other operations.
    fn weighted_kernel(op: Binary, form: Form) -> Option<WeightedKernel<Self>>;
}

/// The operations of `ir`, as functions.
mod plain {
    use crate::ir::{Binary, Real};

    macro_rules! plain {
        ($name:ident, $op:expr) => {
            #[inline(always)]
            pub fn $name<T: Real>(u: T, v: T) -> T {
                $op.eval(u, v)
            }
        };
    }

    #[inline(always)]
    pub fn negate<T: Real>(u: T, _: T) -> T {
        -u
    }

    plain!(add, Binary::Add);
    plain!(sub, Binary::Sub);
    plain!(mul, Binary::Mul);
    plain!(div, Binary::Div);
    plain!(div_or_zero, Binary::DivOrZero);
    plain!(min_weight, Binary::MinWeight);
    plain!(max_weight, Binary::MaxWeight);
    plain!(min, Binary::Min);
    plain!(max, Binary::Max);
    plain!(plain_min, Binary::PlainMin);
    plain!(plain_max, Binary::PlainMax);
}

macro_rules! value {
    ($name:ident, $t:ty, $f:expr) => {
        #[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx+avx2", "x86_64+sse4.1"))]
        pub fn $name(u: &[$t], v: &[$t], out: &mut [$t]) {
            for ((out, &u), &v) in out.iter_mut().zip(u).zip(v) {
                *out = $f(u, v);
            }
        }
    };
}

/// Points that a guarded kernel looks at together.
const RUN: usize = 16;

/// A result smaller than this part of √(u² + v²) has lost more than four bits by cancellation.
const CANCELLED: f64 = 1.0 / 8.0;

/// Whether the textbook's result is near enough: nothing cancelled, and no square that counts has left the
/// range. NaN is not near enough: the stable form then gives NaN too.
#[inline(always)]
fn is_near<T: SafeSquares>(result: T, h: T) -> bool {
    let part = result.abs() >= h * T::from_f64(CANCELLED);
    let fits = h > T::from_f64(T::LEAST) && h < T::from_f64(T::LARGEST);
    part & fits
}

/// The magnitudes between which √(u² + v²) is good to 2 ulp without scaling.
trait SafeSquares: crate::ir::Real {
    const LEAST: f64;
    const LARGEST: f64;
}

impl SafeSquares for f64 {
    const LEAST: f64 = 1e-140;
    const LARGEST: f64 = 1e150;
}

impl SafeSquares for f32 {
    const LEAST: f64 = 1e-15;
    const LARGEST: f64 = 1e18;
}

macro_rules! guarded {
    ($name:ident, $t:ty, $textbook:expr, $stable:expr) => {
        #[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx+avx2", "x86_64+sse4.1"))]
        pub fn $name(u: &[$t], v: &[$t], out: &mut [$t]) {
            for ((out, u), v) in out.chunks_mut(RUN).zip(u.chunks(RUN)).zip(v.chunks(RUN)) {
                let mut near = true;
                for ((out, &u), &v) in out.iter_mut().zip(u).zip(v) {
                    *out = $textbook(u, v);
                    near &= is_near(*out, (u * u + v * v).sqrt());
                }
                if !near {
                    for ((out, &u), &v) in out.iter_mut().zip(u).zip(v) {
                        *out = $stable(u, v);
                    }
                }
            }
        }
    };
}

macro_rules! weighted {
    ($name:ident, $t:ty, $f:expr) => {
        #[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx+avx2", "x86_64+sse4.1"))]
        pub fn $name(u: &[$t], v: &[$t], [out, by_u, by_v]: [&mut [$t]; 3]) {
            for ((((out, by_u), by_v), &u), &v) in out.iter_mut().zip(by_u).zip(by_v).zip(u).zip(v) {
                (*out, *by_u, *by_v) = $f(u, v);
            }
        }
    };
}

macro_rules! wide {
    ($module:ident, $t:ty) => {
        mod $module {
            use super::*;

            value!(and, $t, r0::and);
            value!(or, $t, r0::or);
            value!(textbook_and, $t, r0::and_textbook);
            value!(textbook_or, $t, r0::or_textbook);
            guarded!(guarded_and, $t, r0::and_textbook, r0::and);
            guarded!(guarded_or, $t, r0::or_textbook, r0::or);
            value!(negate, $t, plain::negate);
            value!(add, $t, plain::add);
            value!(sub, $t, plain::sub);
            value!(mul, $t, plain::mul);
            value!(div, $t, plain::div);
            value!(div_or_zero, $t, plain::div_or_zero);
            value!(min_weight, $t, plain::min_weight);
            value!(max_weight, $t, plain::max_weight);
            value!(min, $t, plain::min);
            value!(max, $t, plain::max);
            value!(plain_min, $t, plain::plain_min);
            value!(plain_max, $t, plain::plain_max);
            value!(scaled_and, $t, r0::and_scaled);
            value!(scaled_or, $t, r0::or_scaled);
            weighted!(scaled_and_weighted, $t, r0::and_weighted_scaled);
            weighted!(scaled_or_weighted, $t, r0::or_weighted_scaled);
            weighted!(and_weighted, $t, r0::and_weighted);
            weighted!(or_weighted, $t, r0::or_weighted);
            weighted!(textbook_and_weighted, $t, r0::and_weighted_textbook);
            weighted!(textbook_or_weighted, $t, r0::or_weighted_textbook);
        }

        impl Wide for $t {
            fn kernel(op: Binary, form: Form) -> Option<Kernel<Self>> {
                Some(match (op, form) {
                    (Binary::And, Form::Stable) => $module::and,
                    (Binary::Or, Form::Stable) => $module::or,
                    (Binary::And, Form::Textbook) => $module::textbook_and,
                    (Binary::Or, Form::Textbook) => $module::textbook_or,
                    (Binary::And, Form::Scaled) => $module::scaled_and,
                    (Binary::Or, Form::Scaled) => $module::scaled_or,
                    (Binary::And, Form::Guarded) => $module::guarded_and,
                    (Binary::Or, Form::Guarded) => $module::guarded_or,
                    (Binary::Add, _) => $module::add,
                    (Binary::Sub, _) => $module::sub,
                    (Binary::Mul, _) => $module::mul,
                    (Binary::Div, _) => $module::div,
                    (Binary::DivOrZero, _) => $module::div_or_zero,
                    (Binary::MinWeight, _) => $module::min_weight,
                    (Binary::MaxWeight, _) => $module::max_weight,
                    (Binary::Min, _) => $module::min,
                    (Binary::Max, _) => $module::max,
                    (Binary::PlainMin, _) => $module::plain_min,
                    (Binary::PlainMax, _) => $module::plain_max,
                    _ => return None,
                })
            }

            fn negation() -> Kernel<Self> {
                $module::negate
            }

            fn weighted_kernel(op: Binary, form: Form) -> Option<WeightedKernel<Self>> {
                Some(match (op, form) {
                    (Binary::And, Form::Stable | Form::Guarded) => $module::and_weighted,
                    (Binary::Or, Form::Stable | Form::Guarded) => $module::or_weighted,
                    (Binary::And, Form::Scaled) => $module::scaled_and_weighted,
                    (Binary::Or, Form::Scaled) => $module::scaled_or_weighted,
                    (Binary::And, Form::Textbook) => $module::textbook_and_weighted,
                    (Binary::Or, Form::Textbook) => $module::textbook_or_weighted,
                    _ => return None,
                })
            }
        }
    };
}

wide!(double, f64);
wide!(single, f32);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Real;

    /// Operands over the whole range, and close to each other in magnitude.
    fn operands<T: Real>(least: f64, largest: f64) -> (Vec<T>, Vec<T>) {
        let mut seed = 3u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut operand = |width: f64| {
            let middle = 0.5 * (least.log2() + largest.log2());
            let size = (middle + width * (random() - 0.5) * (largest.log2() - least.log2())).exp2();
            T::from_f64(if random() < 0.5 { size } else { -size })
        };
        // enough for 2000 runs; odd, so that there is a short one
        (0..32_005)
            .map(|i| if i % 2 == 0 { (operand(1.0), operand(1.0)) } else { (operand(0.02), operand(0.02)) })
            .unzip()
    }

    /// Every kernel at every place of a run, against the specification.
    fn agree<T: Wide + SafeSquares>(least: f64, largest: f64) {
        let (u, v) = operands::<T>(least, largest);
        let mut out = vec![T::from_f64(0.0); u.len()];
        let joins = [Binary::And, Binary::Or, Binary::Min, Binary::Max, Binary::PlainMin, Binary::PlainMax];
        let sums = [Binary::Add, Binary::Sub, Binary::Mul, Binary::Div, Binary::DivOrZero];
        let plain = sums.into_iter().chain([Binary::MinWeight, Binary::MaxWeight]);
        for op in joins.into_iter().chain(plain) {
            T::kernel(op, Form::Stable).unwrap()(&u, &v, &mut out);
            for ((&u, &v), &found) in u.iter().zip(&v).zip(&out) {
                let expected = op.eval(u, v);
                assert!(found == expected, "{op:?} of {u:?}, {v:?}: {found:?}, not {expected:?}");
            }
        }
        for op in [Binary::And, Binary::Or] {
            T::kernel(op, Form::Guarded).unwrap()(&u, &v, &mut out);
            for ((&u, &v), &found) in u.iter().zip(&v).zip(&out) {
                let expected = op.eval(u, v).to_f64();
                // 14 ulp and those of the stable form, also where results are denormal
                let ulp = if size_of::<T>() == 4 { 2f64.powi(-23) } else { 2f64.powi(-52) };
                let error = (found.to_f64() - expected).abs() / (ulp * expected.abs());
                assert!(error <= 16.0, "{op:?} of {u:?}, {v:?}: {error} ulp");
                assert!(found.to_f64().signum() == expected.signum());
            }
            let weight = if op == Binary::And { Binary::AndWeight } else { Binary::OrWeight };
            for form in [Form::Stable, Form::Textbook, Form::Scaled] {
                T::kernel(op, form).unwrap()(&u, &v, &mut out);
                let mut all = [out.clone(), out.clone(), out.clone()];
                T::weighted_kernel(op, form).unwrap()(&u, &v, all.each_mut().map(|c| &mut c[..]));
                for (i, (&u, &v)) in u.iter().zip(&v).enumerate() {
                    let expected = [form.eval(op, u, v), form.eval(weight, u, v), form.eval(weight, v, u)];
                    let found = all.each_ref().map(|column| column[i]);
                    assert!(found == expected, "{op:?} of {u:?}, {v:?}: {found:?}, not {expected:?}");
                    assert!(out[i] == expected[0]);
                }
            }
        }
    }

    #[test]
    fn kernels_are_the_specification_bit_for_bit() {
        agree::<f64>(1e-300, 1e150);
        agree::<f32>(1e-36, 1e18);
    }
}
