//! Our own programs behind the common interface.

use std::hint::black_box;
use std::sync::Arc;

use rfm::codegen::Form;
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::solid::{CellMap, Lane};
use rfm::{Engine, Field, Program, Solid};

use crate::hand;
use crate::measure::{BATCH, Points, Work};
use crate::scenes::SIDE;

/// Precision that every library supports.
pub trait Precision: Lane + hand::Precision + Into<f64> {
    const NAME: &'static str;
    fn columns(points: &Points) -> [&[Self]; 3];
}

impl Precision for f32 {
    const NAME: &'static str = "f32";
    fn columns(points: &Points) -> [&[f32]; 3] {
        points.single.each_ref().map(|c| &c[..])
    }
}

impl Precision for f64 {
    const NAME: &'static str = "f64";
    fn columns(points: &Points) -> [&[f64]; 3] {
        points.double.each_ref().map(|c| &c[..])
    }
}

/// Compiles a solid of a text in a form of R₀. It panics if there is no machine code, rather than interpret.
pub fn solid(text: &str, name: &str, form: Form) -> Solid {
    compiled(text, name, form, Engine::Jit)
}

/// Reads a solid of a text without any program; each is compiled when it is first asked.
pub fn solid_lazily(text: &str, name: &str, form: Form) -> Solid {
    compiled(text, name, form, Engine::Auto)
}

fn compiled(text: &str, name: &str, form: Form, engine: Engine) -> Solid {
    let program = Program::from_source("peers.rfm", text).unwrap_or_else(|e| panic!("{e}"));
    let module = program.module();
    let named = module.solids.iter().find(|solid| solid.name == name).expect("the text has this solid");
    Solid::with_form(name, &module.graph, named.node, engine, form).unwrap_or_else(|e| panic!("{e}"))
}

/// Allocates output columns, has `fill` write them, and takes the answers out of them.
fn columns<T: Precision, const N: usize>(mut fill: impl FnMut([&[T]; 3], [&mut [T]; N]) + 'static) -> Work {
    let mut out: [Vec<T>; N] = std::array::from_fn(|_| vec![T::default(); BATCH]);
    Box::new(move |points, keep| {
        let n = points.len();
        fill(T::columns(points), out.each_mut().map(|c| &mut c[..n]));
        if let Some(keep) = keep {
            let of = |c: usize, i: usize| if c < N { out[c][i].into() } else { 0.0 };
            keep.extend((0..n).map(|i| [0, 1, 2, 3].map(|c| of(c, i))));
        }
        black_box(&mut out);
    })
}

pub fn value<T: Precision>(solid: &Solid) -> Work {
    let solid = solid.clone();
    columns::<T, 1>(move |points, [out]| solid.omega_many(points, out))
}

pub fn gradient<T: Precision>(solid: &Solid) -> Work {
    let solid = solid.clone();
    columns::<T, 4>(move |points, out| solid.omega_grad_many(points, out))
}

pub fn sign<T: Precision>(solid: &Solid) -> Work {
    let solid = solid.clone();
    columns::<T, 1>(move |points, [out]| solid.twin_many(points, out))
}

pub fn contact<T: Precision>(solid: &Solid) -> Work {
    let solid = solid.clone();
    columns::<T, 5>(move |points, out| solid.contact_many(points, out))
}

/// Cells of the box [0, 3]³, for contacts within a reach.
pub fn cell_map(solid: &Solid, reach: f64) -> Arc<CellMap> {
    let domain = Aabb::new(DVec3::ZERO, DVec3::splat(SIDE));
    Arc::new(CellMap::with_reach(solid, domain, reach).expect("a union can be taken apart"))
}

pub fn map_sign(map: &Arc<CellMap>) -> Work {
    let map = Arc::clone(map);
    columns::<f64, 1>(move |[x, y, z], [out]| map.sign_many(rfm::field::Points::new(x, y, z), out))
}

pub fn map_contact(map: &Arc<CellMap>) -> Work {
    let map = Arc::clone(map);
    columns::<f64, 5>(move |[x, y, z], out| map.contact_many(rfm::field::Points::new(x, y, z), out))
}

/// Evaluates ω at one point after the other through a function of three loose numbers.
pub fn each(one: impl Fn(f64, f64, f64) -> f64 + 'static) -> Work {
    Box::new(move |points, mut keep| {
        let [x, y, z] = &points.double;
        for i in 0..x.len() {
            let omega = black_box(one(x[i], y[i], z[i]));
            if let Some(keep) = keep.as_deref_mut() {
                keep.push([omega, 0.0, 0.0, 0.0]);
            }
        }
    })
}

/// Evaluates ω and ∇ω at one point after the other.
pub fn each_grad(one: impl Fn(f64, f64, f64) -> [f64; 4] + 'static) -> Work {
    Box::new(move |points, mut keep| {
        let [x, y, z] = &points.double;
        for i in 0..x.len() {
            // Each number is kept alone: the whole array would be written and read back in other sizes, which
            // stalls.
            let answer = one(x[i], y[i], z[i]).map(black_box);
            if let Some(keep) = keep.as_deref_mut() {
                keep.push(answer);
            }
        }
    })
}

pub fn point(solid: &Solid) -> Work {
    let solid = solid.clone();
    each(move |x, y, z| solid.omega(DVec3::new(x, y, z)))
}

pub fn point_grad(solid: &Solid) -> Work {
    let solid = solid.clone();
    each_grad(move |x, y, z| {
        let (w, g) = solid.omega_grad(DVec3::new(x, y, z));
        [w, g.x, g.y, g.z]
    })
}

/// Evaluates a hand-written formula at all points.
pub fn by_hand<T: Precision, F: hand::Formula + 'static>(width: hand::Width, formula: F) -> Work {
    let mut out: [Vec<T>; 4] = std::array::from_fn(|_| vec![T::default(); BATCH]);
    Box::new(move |points, keep| {
        // Only whole vectors are evaluated, so the few corners are asked with their last point repeated.
        let n = points.len();
        let rest = n.next_multiple_of(32);
        if n == rest {
            hand::run(width, &formula, T::columns(points), &mut out);
        } else {
            let padded = T::columns(points).map(|c| {
                let mut c = c.to_vec();
                c.resize(rest, c[n - 1]);
                c
            });
            hand::run(width, &formula, padded.each_ref().map(|c| &c[..]), &mut out);
        }
        if let Some(keep) = keep {
            let of = |c: usize, i: usize| if c < F::OUTPUTS { out[c][i].into() } else { 0.0 };
            keep.extend((0..n).map(|i| [0, 1, 2, 3].map(|c| of(c, i))));
        }
        black_box(&mut out);
    })
}

/// Returns the range over a box, lower and upper end, of ω or of its min/max twin.
pub fn range(solid: &Solid, twin: bool) -> impl FnMut([[f64; 2]; 3]) -> [f64; 2] + 'static {
    let solid = solid.clone();
    let field = twin.then(|| solid.twin());
    move |[x, y, z]| {
        let over = Aabb::new(DVec3::new(x[0], y[0], z[0]), DVec3::new(x[1], y[1], z[1]));
        let range = match &field {
            None => solid.range(&over),
            Some(field) => field.range(&over),
        };
        [range.lo, range.hi]
    }
}
