//! Code that a person would write by hand: the ceiling that generated code is measured against.
//!
//! Each formula is written once, over [`Vector`]. It is compiled with explicit 128-bit intrinsics (SSE4.1),
//! with 256-bit intrinsics (AVX, if the processor has it) and as a plain loop over numbers, which rustc may
//! vectorise.

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Sub};

use crate::scenes::{Order, Sphere};

/// Some lanes of numbers; one lane is a plain number.
pub trait Vector:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    type Lane: Copy;
    const LANES: usize;
    /// # Safety
    /// `from` must be valid for reading `LANES` numbers.
    unsafe fn load(from: *const Self::Lane) -> Self;
    /// # Safety
    /// `to` must be valid for writing `LANES` numbers.
    unsafe fn store(self, to: *mut Self::Lane);
    fn splat(x: f64) -> Self;
    fn sqrt(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    /// Selects `yes` where self > 0, otherwise `no`.
    fn if_positive(self, yes: Self, no: Self) -> Self;
}

macro_rules! vector {
    ($name:ident, $raw:ty, $lane:ty, $lanes:literal, $load:ident, $store:ident, $set:ident, $add:ident,
     $sub:ident, $mul:ident, $div:ident, $sqrt:ident, $min:ident, $max:ident, |$m:ident, $yes:ident, $no:ident| $select:expr) => {
        #[derive(Clone, Copy)]
        pub struct $name($raw);
        vector!(@op $name, Add, add, $add);
        vector!(@op $name, Sub, sub, $sub);
        vector!(@op $name, Mul, mul, $mul);
        vector!(@op $name, Div, div, $div);
        // SAFETY: only `run` below makes these types, behind a check of the processor. This holds for all
        // methods.
        #[allow(clippy::missing_safety_doc)]
        impl Vector for $name {
            type Lane = $lane;
            const LANES: usize = $lanes;
            #[inline(always)]
            unsafe fn load(from: *const $lane) -> Self {
                Self(unsafe { $load(from) })
            }
            #[inline(always)]
            unsafe fn store(self, to: *mut $lane) {
                unsafe { $store(to, self.0) }
            }
            #[inline(always)]
            #[allow(clippy::unnecessary_cast)]
            fn splat(x: f64) -> Self {
                Self(unsafe { $set(x as $lane) })
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                Self(unsafe { $min(self.0, other.0) })
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                Self(unsafe { $max(self.0, other.0) })
            }
            #[inline(always)]
            fn if_positive(self, yes: Self, no: Self) -> Self {
                let ($m, $yes, $no) = (self.0, yes.0, no.0);
                Self(unsafe { $select })
            }
        }
    };
    (@op $name:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

vector!(
    F32x4,
    __m128,
    f32,
    4,
    _mm_loadu_ps,
    _mm_storeu_ps,
    _mm_set1_ps,
    _mm_add_ps,
    _mm_sub_ps,
    _mm_mul_ps,
    _mm_div_ps,
    _mm_sqrt_ps,
    _mm_min_ps,
    _mm_max_ps,
    |m, yes, no| _mm_blendv_ps(no, yes, _mm_cmpgt_ps(m, _mm_setzero_ps()))
);
vector!(
    F64x2,
    __m128d,
    f64,
    2,
    _mm_loadu_pd,
    _mm_storeu_pd,
    _mm_set1_pd,
    _mm_add_pd,
    _mm_sub_pd,
    _mm_mul_pd,
    _mm_div_pd,
    _mm_sqrt_pd,
    _mm_min_pd,
    _mm_max_pd,
    |m, yes, no| _mm_blendv_pd(no, yes, _mm_cmpgt_pd(m, _mm_setzero_pd()))
);
vector!(
    F32x8,
    __m256,
    f32,
    8,
    _mm256_loadu_ps,
    _mm256_storeu_ps,
    _mm256_set1_ps,
    _mm256_add_ps,
    _mm256_sub_ps,
    _mm256_mul_ps,
    _mm256_div_ps,
    _mm256_sqrt_ps,
    _mm256_min_ps,
    _mm256_max_ps,
    |m, yes, no| _mm256_blendv_ps(no, yes, _mm256_cmp_ps::<_CMP_GT_OQ>(m, _mm256_setzero_ps()))
);
vector!(
    F64x4,
    __m256d,
    f64,
    4,
    _mm256_loadu_pd,
    _mm256_storeu_pd,
    _mm256_set1_pd,
    _mm256_add_pd,
    _mm256_sub_pd,
    _mm256_mul_pd,
    _mm256_div_pd,
    _mm256_sqrt_pd,
    _mm256_min_pd,
    _mm256_max_pd,
    |m, yes, no| _mm256_blendv_pd(no, yes, _mm256_cmp_pd::<_CMP_GT_OQ>(m, _mm256_setzero_pd()))
);

macro_rules! number {
    ($t:ty) => {
        #[allow(clippy::missing_safety_doc)]
        impl Vector for $t {
            type Lane = $t;
            const LANES: usize = 1;
            #[inline(always)]
            unsafe fn load(from: *const $t) -> Self {
                unsafe { *from }
            }
            #[inline(always)]
            unsafe fn store(self, to: *mut $t) {
                unsafe { *to = self }
            }
            #[inline(always)]
            #[allow(clippy::unnecessary_cast)]
            fn splat(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn if_positive(self, yes: Self, no: Self) -> Self {
                if self > 0.0 { yes } else { no }
            }
        }
    };
}

number!(f32);
number!(f64);

/// One formula for a vector of points: x, y, z → ω, ∂x, ∂y, ∂z. Outputs that it does not give stay unchanged.
pub trait Formula {
    const OUTPUTS: usize;
    /// Whether it is one long chain of dependent operations.
    fn is_chain(&self) -> bool {
        false
    }
    fn at<V: Vector>(&self, p: [V; 3]) -> [V; 4];
}

/// Leaves of the pawn: cylinder, layer, waist, collar, head.
#[inline(always)]
fn leaves<V: Vector>([x, y, z]: [V; 3]) -> [V; 5] {
    let k = V::splat;
    let (u, v) = (x - k(1.5), y - k(1.5));
    let r2 = u * u + v * v;
    let (a, b, c) = (z - k(0.75), k(1.0) - z, z - k(1.25));
    [
        k(0.25) - r2,
        z * b,
        (k(1.0) + k(10.0) * (a * a)) - k(20.0) * r2,
        k(0.125) - (r2 + k(20.0) * (b * b)),
        k(0.05) - (r2 + c * c),
    ]
}

// These are functions, not closures, because only what is always inlined gets the instructions of the caller.

#[inline(always)]
fn and<V: Vector>(u: V, v: V) -> V {
    u + v - (u * u + v * v).sqrt()
}

#[inline(always)]
fn or<V: Vector>(u: V, v: V) -> V {
    u + v + (u * u + v * v).sqrt()
}

#[inline(always)]
fn stable_and<V: Vector>(u: V, v: V) -> V {
    let (min, max, sum) = (u.min(v), u.max(v), u + v);
    let magnitude = max.max(V::splat(0.0) - min);
    let h = (u * u + v * v).sqrt().max(magnitude);
    sum.if_positive(min - min * (min / (magnitude + h)), sum - h)
}

#[inline(always)]
fn stable_or<V: Vector>(u: V, v: V) -> V {
    let (min, max, sum) = (u.min(v), u.max(v), u + v);
    let magnitude = max.max(V::splat(0.0) - min);
    let h = (u * u + v * v).sqrt().max(magnitude);
    (V::splat(0.0) - sum).if_positive(max + max * (max / (magnitude + h)), sum + h)
}

/// Root of the sum of squares, and its reciprocal for the weights. Each node thus takes one division.
#[inline(always)]
fn hypot<V: Vector>(u: V, v: V) -> (V, V) {
    let h = (u * u + v * v).sqrt();
    (h, V::splat(1.0) / h)
}

/// ω of the pawn as the paper prints it.
pub struct Textbook;

impl Formula for Textbook {
    const OUTPUTS: usize = 1;
    #[inline(always)]
    fn at<V: Vector>(&self, p: [V; 3]) -> [V; 4] {
        let [cylinder, layer, waist, collar, head] = leaves(p);
        [or(and(and(cylinder, layer), waist), or(collar, head)); 4]
    }
}

/// ω of the pawn in the half-angle form of `rfm::ir::r0`. It uses the operations of that form, blended by
/// SSE4.1.
pub struct Stable;

impl Formula for Stable {
    const OUTPUTS: usize = 1;
    #[inline(always)]
    fn at<V: Vector>(&self, p: [V; 3]) -> [V; 4] {
        let [cylinder, layer, waist, collar, head] = leaves(p);
        [stable_or(stable_and(stable_and(cylinder, layer), waist), stable_or(collar, head)); 4]
    }
}

/// ω and ∇ω of the pawn by the chain rule from the root down. Like any textbook form, it gives 0/0 at edges.
pub struct TextbookGradient;

impl Formula for TextbookGradient {
    const OUTPUTS: usize = 4;
    #[inline(always)]
    fn at<V: Vector>(&self, [x, y, z]: [V; 3]) -> [V; 4] {
        let k = V::splat;
        let one = k(1.0);
        let [cylinder, layer, waist, collar, head] = leaves([x, y, z]);
        let (h, post_i) = hypot(cylinder, layer);
        let post = cylinder + layer - h;
        let (h, body_i) = hypot(post, waist);
        let body = post + waist - h;
        let (h, top_i) = hypot(collar, head);
        let top = collar + head + h;
        let (h, i) = hypot(body, top);
        let (d_body, d_top) = (one + body * i, one + top * i);
        let (d_collar, d_head) = (d_top * (one + collar * top_i), d_top * (one + head * top_i));
        let (d_post, d_waist) = (d_body * (one - post * body_i), d_body * (one - waist * body_i));
        let (d_cylinder, d_layer) = (d_post * (one - cylinder * post_i), d_post * (one - layer * post_i));
        let d_r2 = k(-2.0) * (d_cylinder + k(20.0) * d_waist + d_collar + d_head);
        let dz = d_layer * (one - k(2.0) * z)
            + d_waist * (k(20.0) * (z - k(0.75)))
            + d_collar * (k(40.0) * (one - z))
            + d_head * (k(2.0) * (k(1.25) - z));
        [body + top + h, d_r2 * (x - k(1.5)), d_r2 * (y - k(1.5)), dz]
    }
}

/// ω of a union of spheres, folded from the left or as a balanced tree of 2ⁿ of them.
pub struct Spheres {
    pub list: Vec<Sphere>,
    pub order: Order,
}

/// One leaf of such a union.
#[inline(always)]
fn sphere<V: Vector>([x, y, z]: [V; 3], s: &Sphere) -> V {
    let k = V::splat;
    let [u, v, w] = [x - k(s.centre[0]), y - k(s.centre[1]), z - k(s.centre[2])];
    k(s.r2) - u * u - v * v - w * w
}

impl Formula for Spheres {
    const OUTPUTS: usize = 1;
    fn is_chain(&self) -> bool {
        self.order == Order::Left
    }
    #[inline(always)]
    fn at<V: Vector>(&self, p: [V; 3]) -> [V; 4] {
        let first = sphere(p, &self.list[0]);
        if self.order == Order::Left {
            let mut sum = first;
            for s in &self.list[1..] {
                sum = or(sum, sphere(p, s));
            }
            return [sum; 4];
        }
        let mut values = [first; 64];
        let mut n = self.list.len();
        assert!(n.is_power_of_two() && n <= 64);
        for (value, s) in values.iter_mut().zip(&self.list) {
            *value = sphere(p, s);
        }
        while n > 1 {
            n /= 2;
            for i in 0..n {
                values[i] = or(values[2 * i], values[2 * i + 1]);
            }
        }
        [values[0]; 4]
    }
}

/// Four vectors side by side. A fold is one long chain, and the processor can work on several such chains at
/// once.
#[derive(Clone, Copy)]
pub struct Four<V>([V; 4]);

macro_rules! four {
    ($trait:ident, $method:ident) => {
        impl<V: Vector> $trait for Four<V> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
                Self([a.$method(e), b.$method(f), c.$method(g), d.$method(h)])
            }
        }
    };
}

four!(Add, add);
four!(Sub, sub);
four!(Mul, mul);
four!(Div, div);

#[allow(clippy::missing_safety_doc)]
impl<V: Vector> Vector for Four<V> {
    type Lane = V::Lane;
    const LANES: usize = 4 * V::LANES;
    #[inline(always)]
    unsafe fn load(from: *const V::Lane) -> Self {
        let n = V::LANES;
        unsafe {
            Self([V::load(from), V::load(from.add(n)), V::load(from.add(2 * n)), V::load(from.add(3 * n))])
        }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut V::Lane) {
        let (n, [a, b, c, d]) = (V::LANES, self.0);
        unsafe {
            a.store(to);
            b.store(to.add(n));
            c.store(to.add(2 * n));
            d.store(to.add(3 * n));
        }
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([V::splat(x); 4])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let [a, b, c, d] = self.0;
        Self([a.sqrt(), b.sqrt(), c.sqrt(), d.sqrt()])
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        Self([a.min(e), b.min(f), c.min(g), d.min(h)])
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (self.0, other.0);
        Self([a.max(e), b.max(f), c.max(g), d.max(h)])
    }
    #[inline(always)]
    fn if_positive(self, yes: Self, no: Self) -> Self {
        let [a, b, c, d] = self.0;
        let ([e, f, g, h], [i, j, k, l]) = (yes.0, no.0);
        Self([a.if_positive(e, i), b.if_positive(f, j), c.if_positive(g, k), d.if_positive(h, l)])
    }
}

/// Width of the vectors.
#[derive(Clone, Copy, PartialEq)]
pub enum Width {
    Plain,
    Bits128,
    Bits256,
}

impl Width {
    pub fn is_here(self) -> bool {
        match self {
            Self::Plain => true,
            Self::Bits128 => is_x86_feature_detected!("sse4.1"),
            Self::Bits256 => is_x86_feature_detected!("avx"),
        }
    }
}

#[inline(always)]
fn each<V: Vector, F: Formula>(formula: &F, points: [&[V::Lane]; 3], out: &mut [Vec<V::Lane>; 4]) {
    let n = points[0].len();
    assert!(points.iter().all(|c| c.len() == n) && out.iter().all(|c| c.len() >= n) && n % V::LANES == 0);
    let points = points.map(|column| column.as_ptr());
    let out = out.each_mut().map(|column| column.as_mut_ptr());
    for i in (0..n).step_by(V::LANES) {
        // SAFETY: i + LANES ≤ n ≤ the length of every column.
        unsafe {
            let answer = formula.at(points.map(|column| V::load(column.add(i))));
            for output in 0..F::OUTPUTS {
                answer[output].store(out[output].add(i));
            }
        }
    }
}

/// A precision, with its vectors.
pub trait Precision: Copy + Default + 'static {
    type Plain: Vector<Lane = Self>;
    type Bits128: Vector<Lane = Self>;
    type Bits256: Vector<Lane = Self>;
}

impl Precision for f32 {
    type Plain = f32;
    type Bits128 = F32x4;
    type Bits256 = F32x8;
}

impl Precision for f64 {
    type Plain = f64;
    type Bits128 = F64x2;
    type Bits256 = F64x4;
}

/// Evaluates a formula at all points.
pub fn run<T: Precision, F: Formula>(width: Width, formula: &F, points: [&[T]; 3], out: &mut [Vec<T>; 4]) {
    #[target_feature(enable = "sse4.1")]
    fn bits128<T: Precision, F: Formula>(formula: &F, points: [&[T]; 3], out: &mut [Vec<T>; 4]) {
        if formula.is_chain() {
            each::<Four<T::Bits128>, F>(formula, points, out)
        } else {
            each::<T::Bits128, F>(formula, points, out)
        }
    }
    #[target_feature(enable = "avx")]
    fn bits256<T: Precision, F: Formula>(formula: &F, points: [&[T]; 3], out: &mut [Vec<T>; 4]) {
        if formula.is_chain() {
            each::<Four<T::Bits256>, F>(formula, points, out)
        } else {
            each::<T::Bits256, F>(formula, points, out)
        }
    }
    assert!(width.is_here());
    match width {
        Width::Plain => each::<T::Plain, F>(formula, points, out),
        // SAFETY: the processor has been asked for this width.
        Width::Bits128 => unsafe { bits128(formula, points, out) },
        Width::Bits256 => unsafe { bits256(formula, points, out) },
    }
}

/// Evaluates ω of the pawn at one point, called as a function of its own.
#[inline(never)]
pub fn pawn_at(x: f64, y: f64, z: f64) -> f64 {
    Textbook.at([x, y, z])[0]
}

/// Evaluates ω and ∇ω of the pawn at one point, called as a function of its own.
#[inline(never)]
pub fn pawn_grad_at(x: f64, y: f64, z: f64) -> [f64; 4] {
    TextbookGradient.at([x, y, z])
}
