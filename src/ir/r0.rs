//! The R₀ system: u ∧ v = u + v − √(u² + v²), u ∨ v = u + v + √(u² + v²), ¬u = −u (Rvachev 1963), evaluated
//! without cancellation.
//!
//! The textbook formula loses every digit when one operand is much smaller than the other. Here, with M the
//! operand of larger magnitude, m the other and τ = m/(M + sign(M)·h) = tan(½·atan(m/M)), h = √(u² + v²):
//!
//! - small branch (∧: M > 0, ∨: M < 0): r = m·(1 − τ), weights w_M = 2τ²/(1+τ²), w_m = (1−τ)²/(1+τ²)
//! - big branch: r = (u + v) + sign(M)·h, weights w_M = 2/(1+τ²), w_m = (1+τ)²/(1+τ²)
//!
//! so every result is a product of well-conditioned factors (≤ 2 ulp), and the sign of the result is exactly
//! the logic of the operands' signs for all finite operands, denormals included: |τ| ≤ ½ because h is clamped
//! to ≥ |M|, hence m − m·τ keeps the sign of m (do not contract it into an FMA), and s + H keeps that of M.
//!
//! At u = v = 0 the gradient has no limit; τ is put to √2 − 1 there, which gives both operands the same
//! weight.
//!
//! These functions are the specification of the code generator: same operations, same order, same bits.

use crate::ir::real::Real;

/// τ at the singular point u = v = 0.
pub const SINGULAR_TAU: f64 = std::f64::consts::SQRT_2 - 1.0;

/// The intermediate results that value and weights share, for one pair of operands of ∧.
struct Parts<T> {
    min: T,
    max: T,
    /// u + v
    sum: T,
    /// √(u² + v²), clamped to ≥ max(|u|, |v|) against underflow of the squares.
    h: T,
    /// The larger operand dominates: the result is near the smaller one.
    small: bool,
    /// max(|u|, |v|) + h
    denominator: T,
}

#[inline(always)]
fn parts<T: Real>(u: T, v: T) -> Parts<T> {
    let min = if u < v { u } else { v };
    let max = if u > v { u } else { v };
    let sum = u + v;
    let magnitude = if max > -min { max } else { -min };
    let h = (u * u + v * v).sqrt();
    // a NaN stays: value and weights are then NaN in either order of the operands
    let h = if h < magnitude { magnitude } else { h };
    Parts { min, max, sum, h, small: sum > T::from_f64(0.0), denominator: magnitude + h }
}

/// R₀-conjunction u ∧ v: positive exactly where both are, zero exactly where the smaller is zero.
// Inlined always, as all that follows: loops over columns compile these formulas for several instruction
// sets.
#[inline(always)]
pub fn and<T: Real>(u: T, v: T) -> T {
    let p = parts(u, v);
    if p.small { p.min - p.min * (p.min / p.denominator) } else { p.sum - p.h }
}

/// R₀-disjunction u ∨ v = ¬(¬u ∧ ¬v), bit for bit.
#[inline(always)]
pub fn or<T: Real>(u: T, v: T) -> T {
    -and(-u, -v)
}

/// (∂/∂u, ∂/∂v) of u ∧ v: non-negative, at most 2, finite for all finite operands.
pub fn and_weights<T: Real>(u: T, v: T) -> (T, T) {
    let (_, by_u, by_v) = and_weighted(u, v);
    (by_u, by_v)
}

/// u ∧ v with ∂/∂u and ∂/∂v: the same bits as [`and`] and [`and_weights`].
#[inline(always)]
pub fn and_weighted<T: Real>(u: T, v: T) -> (T, T, T) {
    let p = parts(u, v);
    // −τ on the big branch, so that one formula serves both
    let tau = (if p.small { p.min } else { p.max }) / p.denominator;
    let value = if p.small { p.min - p.min * tau } else { p.sum - p.h };
    let tau = if p.denominator == T::from_f64(0.0) { T::from_f64(-SINGULAR_TAU) } else { tau };
    let (by_u, by_v) = weights_of_tau(tau, p.small, [u < v, v < u]);
    (value, by_u, by_v)
}

/// The weights from τ, which has the opposite sign on the big branch; `less`: u < v, v < u. At a tie both
/// operands get the same one.
#[inline(always)]
fn weights_of_tau<T: Real>(tau: T, small: bool, less: [bool; 2]) -> (T, T) {
    let one = T::from_f64(1.0);
    let square = tau * tau;
    let scale = one / (one + square);
    let lesser = (one - tau) * (one - tau) * scale; // weight of m
    let greater = (if small { square } else { one }) * (scale + scale); // weight of M
    // an operand is M on the small branch unless it is the minimum, and the other way round on the big branch
    let of = |less: bool| if small == less { lesser } else { greater };
    (of(less[0]), of(less[1]))
}

/// (∂/∂u, ∂/∂v) of u ∨ v.
pub fn or_weights<T: Real>(u: T, v: T) -> (T, T) {
    and_weights(-u, -v)
}

/// u ∨ v with ∂/∂u and ∂/∂v.
#[inline(always)]
pub fn or_weighted<T: Real>(u: T, v: T) -> (T, T, T) {
    let (value, by_u, by_v) = and_weighted(-u, -v);
    (-value, by_u, by_v)
}

/// Intermediate results of the scaled form of ∧.
struct Scaled<T> {
    /// The operand of smaller magnitude, and the other one.
    m: T,
    big: T,
    /// m/M
    q: T,
    /// 1 + √(1 + q²)
    k1: T,
    small: bool,
}

#[inline(always)]
fn scaled<T: Real>(u: T, v: T) -> Scaled<T> {
    let one = T::from_f64(1.0);
    // one comparison for both, so that a NaN is one of them
    let (min, max) = if u < v { (u, v) } else { (v, u) };
    let small = u + v > T::from_f64(0.0); // the sign of a rounded sum is exact, and it may overflow
    let (m, big) = if small { (min, max) } else { (max, min) };
    // exact at a tie, and a number at 0/0 and ∞/∞
    let q = if m == big { one } else { m / big };
    let k1 = one + (one + q * q).sqrt();
    Scaled { m, big, q, k1, small }
}

/// u ∧ v in a form that neither overflows nor underflows where the result does not: squares only of the ratio
/// q = m/M; two divisions. For operands whose squares leave the range of the type.
#[inline(always)]
pub fn and_scaled<T: Real>(u: T, v: T) -> T {
    let s = scaled(u, v);
    if s.small { s.m - s.m * (s.q / s.k1) } else { s.big * (s.k1 + s.q) }
}

/// u ∨ v in the scaled form.
#[inline(always)]
pub fn or_scaled<T: Real>(u: T, v: T) -> T {
    -and_scaled(-u, -v)
}

/// (∂/∂u, ∂/∂v) of u ∧ v in the scaled form.
pub fn and_weights_scaled<T: Real>(u: T, v: T) -> (T, T) {
    let (_, by_u, by_v) = and_weighted_scaled(u, v);
    (by_u, by_v)
}

/// u ∧ v with ∂/∂u and ∂/∂v in the scaled form.
#[inline(always)]
pub fn and_weighted_scaled<T: Real>(u: T, v: T) -> (T, T, T) {
    let s = scaled(u, v);
    let tau = s.q / s.k1;
    let value = if s.small { s.m - s.m * tau } else { s.big * (s.k1 + s.q) };
    let (by_u, by_v) = weights_of_tau(if s.small { tau } else { -tau }, s.small, [u < v, v < u]);
    (value, by_u, by_v)
}

/// u ∨ v with ∂/∂u and ∂/∂v in the scaled form.
#[inline(always)]
pub fn or_weighted_scaled<T: Real>(u: T, v: T) -> (T, T, T) {
    let (value, by_u, by_v) = and_weighted_scaled(-u, -v);
    (-value, by_u, by_v)
}

/// (∂/∂u, ∂/∂v) of u ∨ v in the scaled form.
pub fn or_weights_scaled<T: Real>(u: T, v: T) -> (T, T) {
    and_weights_scaled(-u, -v)
}

/// u + v − √(u² + v²) as every textbook prints it: cheapest; loses the digits of a small result between large
/// operands, at worst its sign.
#[inline(always)]
pub fn and_textbook<T: Real>(u: T, v: T) -> T {
    (u + v) - (u * u + v * v).sqrt()
}

/// u ∨ v in the textbook form.
#[inline(always)]
pub fn or_textbook<T: Real>(u: T, v: T) -> T {
    (u + v) + (u * u + v * v).sqrt()
}

/// 1 − u/√(u² + v²), the weight of u in u ∧ v; NaN at a corner.
#[inline(always)]
pub fn and_weight_textbook<T: Real>(u: T, v: T) -> T {
    T::from_f64(1.0) - u / (u * u + v * v).sqrt()
}

/// 1 + u/√(u² + v²), the weight of u in u ∨ v; NaN at a corner.
#[inline(always)]
pub fn or_weight_textbook<T: Real>(u: T, v: T) -> T {
    T::from_f64(1.0) + u / (u * u + v * v).sqrt()
}

/// u ∧ v with ∂/∂u and ∂/∂v in the textbook form.
#[inline(always)]
pub fn and_weighted_textbook<T: Real>(u: T, v: T) -> (T, T, T) {
    (and_textbook(u, v), and_weight_textbook(u, v), and_weight_textbook(v, u))
}

/// u ∨ v with ∂/∂u and ∂/∂v in the textbook form.
#[inline(always)]
pub fn or_weighted_textbook<T: Real>(u: T, v: T) -> (T, T, T) {
    (or_textbook(u, v), or_weight_textbook(u, v), or_weight_textbook(v, u))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn assert_ulps(found: f64, expected: f64, ulps: f64) {
        let error = (found - expected).abs() / (expected.abs() * f64::EPSILON).max(f64::MIN_POSITIVE);
        assert!(error <= ulps, "{found:e} is {error:.2} eps away from {expected:e}");
    }

    // All of these are exact in real arithmetic or carry 17 digits of a 40-digit evaluation.
    #[test]
    fn known_values() {
        assert_ulps(and(3.0, 4.0), 2.0, 2.0);
        assert_ulps(or(3.0, 4.0), 12.0, 2.0);
        assert_ulps(and(-3.0, -4.0), -12.0, 2.0);
        assert_ulps(or(-3.0, -4.0), -2.0, 2.0);
        assert_ulps(and(3.0, -4.0), -6.0, 2.0);
        assert_ulps(or(3.0, -4.0), 4.0, 2.0);
        assert_ulps(and(1.0, 2f64.powi(-60)), 2f64.powi(-60), 1.0);
        assert_eq!(and(1f32, 2f32.powi(-30)), 9.313_226e-10);
        assert_eq!(and(1f32, -2f32.powi(-30)), -9.313_226e-10);
        assert_eq!(or(-1e20f32, -1.0), -1.0);
        assert_eq!((and(0.0, 1.0), and(0.0, -1.0), or(0.0, 1.0), or(0.0, -1.0)), (0.0, -2.0, 2.0, 0.0));
        assert_ulps(and(1e-24, 1e-24), 5.857_864_376_269_049_5e-25, 2.0);
    }

    #[test]
    fn known_weights() {
        let close = |(a, b): (f64, f64), (c, d): (f64, f64)| {
            assert_ulps(a, c, 6.0);
            assert_ulps(b, d, 6.0);
        };
        close(and_weights(3.0, 4.0), (0.4, 0.2));
        close(or_weights(3.0, 4.0), (1.6, 1.8));
        close(and_weights(3.0, -4.0), (0.4, 1.8));
        close(or_weights(3.0, -4.0), (1.6, 0.2));
        assert_eq!(and_weights(0.0, 1.0), (1.0, 0.0));
        assert_eq!(and_weights(0.0, -1.0), (1.0, 2.0));
        assert_eq!(or_weights(0.0, 1.0), (1.0, 2.0));
        assert_eq!(or_weights(0.0, -1.0), (1.0, 0.0));
        let (wu, wv) = and_weights(0.0, 0.0);
        assert!(wu > 0.0 && (wu - wv).abs() < 1e-15, "{wu} {wv}");
    }

    #[test]
    fn denormals_keep_their_sign() {
        let d = f64::from_bits(1);
        assert!(and(d, d) > 0.0 && or(d, -d) > 0.0 && and(d, -d) < 0.0);
        let d = f32::from_bits(1);
        assert!(and(d, d) > 0.0 && or(d, -d) > 0.0 && and(d, -d) < 0.0);
    }

    #[test]
    fn infinities_and_nan() {
        assert_eq!(and(f64::INFINITY, 1.0), 1.0);
        assert_eq!(or(f64::NEG_INFINITY, 1.0), 1.0);
        for x in [0.0, 1.0, -1.0, f64::INFINITY, f64::NAN] {
            assert!(and(f64::NAN, x).is_nan() && and(x, f64::NAN).is_nan());
            assert!(or(f64::NAN, x).is_nan() && or(x, f64::NAN).is_nan());
        }
    }

    fn sign(x: f64) -> i8 {
        i8::from(x > 0.0) - i8::from(x < 0.0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn sign_is_the_logic_of_the_signs(u in any::<u64>(), v in any::<u64>()) {
            let (u, v) = (f64::from_bits(u), f64::from_bits(v));
            prop_assume!(u.is_finite() && v.is_finite());
            prop_assert_eq!(sign(and(u, v)), sign(u.min(v)));
            prop_assert_eq!(sign(or(u, v)), sign(u.max(v)));
            prop_assert_eq!(sign(and_scaled(u, v)), sign(u.min(v)));
        }

        #[test]
        fn sign_is_the_logic_of_the_signs_f32(u in any::<u32>(), v in any::<u32>()) {
            let (u, v) = (f32::from_bits(u), f32::from_bits(v));
            prop_assume!(u.is_finite() && v.is_finite());
            prop_assert_eq!(sign(and(u, v).into()), sign(u.min(v).into()));
            prop_assert_eq!(sign(or(u, v).into()), sign(u.max(v).into()));
            prop_assert_eq!(sign(or_scaled(u, v).into()), sign(u.max(v).into()));
        }

        #[test]
        fn commutes_and_obeys_de_morgan_bit_for_bit(u in any::<f64>(), v in any::<f64>()) {
            prop_assume!(!u.is_nan() && !v.is_nan());
            let same = |a: f64, b: f64| (a == b) || (a.is_nan() && b.is_nan());
            prop_assert!(same(and(u, v), and(v, u)));
            prop_assert!(same(or(u, v), or(v, u)));
            prop_assert!(same(-and(u, v), or(-u, -v)));
        }

        #[test]
        fn weights_are_finite_and_not_negative(u in any::<f64>(), v in any::<f64>()) {
            prop_assume!(u.is_finite() && v.is_finite());
            for w in [and_weights(u, v), or_weights(u, v), and_weights_scaled(u, v), or_weights_scaled(u, v)] {
                prop_assert!(w.0 >= 0.0 && w.1 >= 0.0 && w.0 <= 2.0001 && w.1 <= 2.0001, "{:?}", w);
            }
        }

        #[test]
        fn scaled_and_plain_forms_agree(u in -1e6..1e6f64, v in -1e6..1e6f64) {
            let (a, b) = (and(u, v), and_scaled(u, v));
            prop_assert!((a - b).abs() <= 5.0 * f64::EPSILON * a.abs(), "{} {}", a, b);
            let (a, b) = (and_weights(u, v), and_weights_scaled(u, v));
            prop_assert!((a.0 - b.0).abs() <= 8.0 * f64::EPSILON * a.0, "{:?} {:?}", a, b);
            prop_assert!((a.1 - b.1).abs() <= 8.0 * f64::EPSILON * a.1, "{:?} {:?}", a, b);
        }
    }
}
