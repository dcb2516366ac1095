//! The numbers of generated functions against those of a solid.

use std::ffi::c_void;
use std::ops::AddAssign;

use rfm::Solid;
use rfm::solid::Lane;

use super::library::Library;
use crate::agreement::same;
use crate::random::Random;

/// What was compared.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    pub compared: usize,
    pub different: usize,
    /// Those of `different` that are values of ω or signs.
    pub different_values: usize,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.compared += other.compared;
        self.different += other.different;
        self.different_values += other.different_values;
    }
}

/// The arguments of generated functions besides the point.
#[derive(Debug, Clone, Default)]
pub struct Extra {
    pub time: Option<f64>,
    pub params: Option<Vec<f64>>,
}

impl Extra {
    pub fn of(solid: &Solid) -> Self {
        Self { time: solid.moves().then(|| solid.time()), params: None }
    }
}

/// Points around the origin, and some of them at awkward places.
pub fn points(count: usize, seed: u64) -> [Vec<f64>; 3] {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1);
    const AWKWARD: [f64; 14] =
        [0.0, -0.0, 1.0, -1.0, 0.5, 1.5, 3.0, 1e-8, 1e-160, 1e150, -1e6, f64::NAN, f64::INFINITY, 5e-324];
    let mut coordinate = || {
        if random.unit() < 0.05 {
            AWKWARD[(random.unit() * AWKWARD.len() as f64) as usize]
        } else {
            6.0 * random.unit() - 3.0
        }
    };
    std::array::from_fn(|_| (0..count).map(|_| coordinate()).collect())
}

/// The type of the C functions over columns: n, x, y, z, [t], [params], results.
trait Columns: Lane + Default + Copy {
    const SUFFIX: &'static str;
    fn of(value: f64) -> Self;
    fn wide(self) -> f64;
}

impl Columns for f64 {
    const SUFFIX: &'static str = "";
    fn of(value: f64) -> Self {
        value
    }
    fn wide(self) -> f64 {
        self
    }
}

impl Columns for f32 {
    const SUFFIX: &'static str = "f";
    fn of(value: f64) -> Self {
        value as f32
    }
    fn wide(self) -> f64 {
        self.into()
    }
}

/// Calls a generated function over columns.
fn call<T: Columns, const N: usize>(
    function: *const c_void,
    points: [&[T]; 3],
    extra: &Extra,
    mut out: [&mut [T]; N],
) {
    let n = points[0].len();
    let [x, y, z] = points.map(<[T]>::as_ptr);
    let o: Vec<*mut T> = out.iter_mut().map(|column| column.as_mut_ptr()).collect();
    let last = |i: usize| o.get(i).copied().unwrap_or(std::ptr::null_mut());
    type P<T> = *const T;
    type M<T> = *mut T;
    // SAFETY: the functions take these arguments in this order, as the header of the file says; results that a function
    // does not have come last, where it does not look. All columns are n long.
    unsafe {
        match (extra.time, &extra.params) {
            (None, None) => {
                type F<T> = unsafe extern "C" fn(usize, P<T>, P<T>, P<T>, M<T>, M<T>, M<T>, M<T>);
                let function = std::mem::transmute::<*const c_void, F<T>>(function);
                function(n, x, y, z, last(0), last(1), last(2), last(3));
            }
            (Some(t), None) => {
                type F<T> = unsafe extern "C" fn(usize, P<T>, P<T>, P<T>, f64, M<T>, M<T>, M<T>, M<T>);
                let function = std::mem::transmute::<*const c_void, F<T>>(function);
                function(n, x, y, z, t, last(0), last(1), last(2), last(3));
            }
            (None, Some(p)) => {
                type F<T> = unsafe extern "C" fn(usize, P<T>, P<T>, P<T>, *const f64, M<T>, M<T>, M<T>, M<T>);
                let function = std::mem::transmute::<*const c_void, F<T>>(function);
                function(n, x, y, z, p.as_ptr(), last(0), last(1), last(2), last(3));
            }
            (Some(t), Some(p)) => {
                type F<T> =
                    unsafe extern "C" fn(usize, P<T>, P<T>, P<T>, f64, *const f64, M<T>, M<T>, M<T>, M<T>);
                let function = std::mem::transmute::<*const c_void, F<T>>(function);
                function(n, x, y, z, t, p.as_ptr(), last(0), last(1), last(2), last(3));
            }
        }
    }
}

/// ω, ∇ω, sign and distance of generated functions against those of a solid, in both precisions. Where ω is NaN its
/// gradient has no meaning and is not looked at.
pub fn compare(
    library: &Library,
    prefix: &str,
    solid: &Solid,
    points: &[Vec<f64>; 3],
    extra: Extra,
) -> Counts {
    let mut counts = compare_in::<f64>(library, prefix, solid, points, &extra);
    counts += compare_in::<f32>(library, prefix, solid, points, &extra);
    counts
}

fn compare_in<T: Columns>(
    library: &Library,
    prefix: &str,
    solid: &Solid,
    points: &[Vec<f64>; 3],
    extra: &Extra,
) -> Counts {
    let columns: [Vec<T>; 3] = points.each_ref().map(|c| c.iter().map(|&value| T::of(value)).collect());
    let at = columns.each_ref().map(Vec::as_slice);
    let n = columns[0].len();
    let one = || vec![T::default(); n];
    let function = |name: &str| library.function(&format!("{prefix}_{name}_many{}", T::SUFFIX));
    let mut counts = Counts::default();
    let mut check = |what: &str, found: &[T], expected: &[T], omega: &[T]| {
        for i in 0..n {
            if omega[i].wide().is_nan() && what != "omega" {
                continue;
            }
            counts.compared += 1;
            if !same(found[i].wide(), expected[i].wide()) {
                if counts.different < 3 {
                    let p = at.map(|column| column[i].wide());
                    println!(
                        "{solid:?} {what}{} at {p:?}: {:?}, not {:?}",
                        T::SUFFIX,
                        found[i].wide(),
                        expected[i].wide()
                    );
                }
                counts.different += 1;
                counts.different_values +=
                    usize::from(["omega", "omega with gradient", "sign"].contains(&what));
            }
        }
    };
    let (mut found, mut omega) = (one(), one());
    call(function("omega"), at, extra, [&mut found]);
    solid.omega_many(at, &mut omega);
    check("omega", &found, &omega, &omega);

    let (mut all, mut expected) = ([one(), one(), one(), one()], [one(), one(), one(), one()]);
    call(function("omega_gradient"), at, extra, all.each_mut().map(Vec::as_mut_slice));
    solid.omega_grad_many(at, expected.each_mut().map(Vec::as_mut_slice));
    for (i, what) in ["omega with gradient", "gx", "gy", "gz"].into_iter().enumerate() {
        check(what, &all[i], &expected[i], &omega);
    }

    let mut sign = one();
    call(function("sign"), at, extra, [&mut found]);
    solid.sign_many(at, &mut sign);
    check("sign", &found, &sign, &omega);

    call(function("distance"), at, extra, [&mut found]);
    // sources have the estimates, which the library compares with signs
    let mut estimates = [(); 5].map(|()| one());
    solid.estimated_contact_many(at, estimates.each_mut().map(Vec::as_mut_slice));
    check("distance", &found, &estimates[0], &omega);
    counts
}

/// Functions with the interface of the C files over those of a Rust module.
pub fn rust_host(number: usize, prefix: &str, moves: bool) -> String {
    let (time, t) = if moves { (", t: f64", ", t") } else { ("", "") };
    let mut text = String::new();
    for (kind, c, rust) in [("f64", "", ""), ("f32", "f", "_f32")] {
        for (name, results) in [("omega", 1), ("omega_gradient", 4), ("sign", 1), ("distance", 1)] {
            let pointers: String = (0..results).map(|i| format!(", o{i}: *mut {kind}")).collect();
            let slices: String =
                (0..results).map(|i| format!(", std::slice::from_raw_parts_mut(o{i}, n)")).collect();
            text += &format!(
                "#[no_mangle]\npub unsafe extern \"C\" fn {prefix}_{name}_many{c}(n: usize, x: *const {kind}, y: *const {kind}, \
                 z: *const {kind}{time}{pointers}) {{\n    let [x, y, z] = [x, y, z].map(|p| std::slice::from_raw_parts(p, n));\n    \
                 m{number}::{prefix}_{name}_many{rust}(x, y, z{t}{slices});\n}}\n"
            );
        }
    }
    text
}

/// Times of the generated functions and of the machine code for the same columns.
pub fn speed(library: &Library, prefix: &str, solid: &Solid, extra: &Extra) -> String {
    let double = speed_in::<f64>(library, prefix, solid, extra);
    let single = speed_in::<f32>(library, prefix, solid, extra);
    format!("f64 {double}; f32 {single}")
}

fn speed_in<T: Columns>(library: &Library, prefix: &str, solid: &Solid, extra: &Extra) -> String {
    const POINTS: usize = 8192;
    let points = points(POINTS, 1);
    let columns: [Vec<T>; 3] =
        points.each_ref().map(|c| c.iter().map(|v| T::of(v.clamp(-3.0, 3.0))).collect());
    let at = columns.each_ref().map(Vec::as_slice);
    let function = |name: &str| library.function(&format!("{prefix}_{name}_many{}", T::SUFFIX));
    let (omega, gradient) = (function("omega"), function("omega_gradient"));
    let mut out = [(); 4].map(|()| vec![T::default(); POINTS]);
    let mut best = [f64::INFINITY; 4];
    for _ in 0..25 {
        let [o, ..] = out.each_mut().map(Vec::as_mut_slice);
        best[0] = best[0].min(timed(|| call(omega, at, extra, [o])));
        let [o, ..] = out.each_mut().map(Vec::as_mut_slice);
        best[1] = best[1].min(timed(|| solid.omega_many(at, o)));
        let all = out.each_mut().map(Vec::as_mut_slice);
        best[2] = best[2].min(timed(|| call(gradient, at, extra, all)));
        let all = out.each_mut().map(Vec::as_mut_slice);
        best[3] = best[3].min(timed(|| solid.omega_grad_many(at, all)));
    }
    let [c, machine, c_gradient, machine_gradient] = best.map(|seconds| seconds / POINTS as f64 * 1e9);
    format!("omega {c:.2} and {machine:.2}, with gradient {c_gradient:.2} and {machine_gradient:.2}")
}

fn timed(work: impl FnOnce()) -> f64 {
    let started = std::time::Instant::now();
    work();
    started.elapsed().as_secs_f64()
}
