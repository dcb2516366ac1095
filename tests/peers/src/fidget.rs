//! The obstacles in Fidget's own expressions, and its evaluators behind the common interface.

use std::hint::black_box;

use fidget::context::Tree;
use fidget::eval::{BulkEvaluator, Function, Tape};
use fidget::jit::{JitFunction, JitShape};
use fidget::shape::EzShape;
use fidget::types::{Grad, Interval};
use fidget::var::{Var, VarMap};

use crate::measure::{Points, Work};
use crate::scenes::{Ball, Order, Sphere, fold};

/// Formulas for *and* and *or*.
#[derive(Clone, Copy, PartialEq)]
pub enum Joins {
    R0,
    MinMax,
}

impl Joins {
    fn and(self, u: Tree, v: Tree) -> Tree {
        match self {
            Self::R0 => u.clone() + v.clone() - (u.square() + v.square()).sqrt(),
            Self::MinMax => u.min(v),
        }
    }

    fn or(self, u: Tree, v: Tree) -> Tree {
        match self {
            Self::R0 => u.clone() + v.clone() + (u.square() + v.square()).sqrt(),
            Self::MinMax => u.max(v),
        }
    }
}

fn r2(x: Tree, y: Tree) -> Tree {
    (x - 1.5).square() + (y - 1.5).square()
}

fn layer(e: Tree, height: f32) -> Tree {
    e.clone() * (height - e)
}

pub fn pawn(j: Joins) -> Tree {
    let (x, y, z) = Tree::axes();
    let r2 = r2(x, y);
    let waist = (1.0 + 10.0 * (z.clone() - 0.75).square()) - 20.0 * r2.clone();
    let collar = 0.125 - (r2.clone() + 20.0 * (1.0 - z.clone()).square());
    let head = 0.05 - (r2.clone() + (1.25 - z.clone()).square());
    let body = j.and(j.and(0.25 - r2, layer(z, 1.0)), waist);
    j.or(body, j.or(collar, head))
}

pub fn bishop(j: Joins) -> Tree {
    let (x, y, z) = Tree::axes();
    let waist = (1.0 + 10.0 * (z.clone() - 0.85).square()) - 20.0 * r2(x.clone(), y.clone());
    let collar = 0.2 - (r2(x.clone(), y.clone()) + 20.0 * (1.25 - z.clone()).square());
    let ellipse = 5.0 * (x.clone() - 1.5).square() + 4.0 * (y.clone() - 1.5).square();
    let head = 0.2 - (ellipse + (1.4 - z.clone()).square());
    let body = j.and(j.and(0.25 - r2(x, y), layer(z, 1.25)), waist);
    j.or(body, j.or(collar, head))
}

pub fn cube(j: Joins) -> Tree {
    let (x, y, z) = Tree::axes();
    j.and(j.and(layer(z, 3.0), layer(x, 3.0)), layer(y, 3.0))
}

/// `x and y`, the bare node.
pub fn both(j: Joins) -> Tree {
    j.and(Tree::x(), Tree::y())
}

pub fn union(spheres: &[Sphere], order: Order, j: Joins) -> Tree {
    let (x, y, z) = Tree::axes();
    let square = |axis: &Tree, at: f64| (axis.clone() - at as f32).square();
    let leaf = |s: &Sphere| {
        let [a, b, c] = s.centre;
        s.r2 as f32 - square(&x, a) - square(&y, b) - square(&z, c)
    };
    let leaves: Vec<Tree> = spheres.iter().map(leaf).collect();
    fold(&leaves, order, &|u, v| j.or(u, v))
}

/// Balls, each as r² − d², or as r − d, which costs one more root but has slope 1.
pub fn balls(balls: &[Ball], j: Joins, as_distance: bool) -> Tree {
    let (x, y, z) = Tree::axes();
    let square = |axis: &Tree, at: f64| (axis.clone() - at as f32).square();
    let leaf = |b: &Ball| {
        let [p, q, r] = b.centre;
        let squares = square(&x, p) + square(&y, q) + square(&z, r);
        if as_distance { b.radius as f32 - squares.sqrt() } else { (b.radius * b.radius) as f32 - squares }
    };
    let leaves: Vec<Tree> = balls.iter().map(leaf).collect();
    fold(&leaves, Order::Balanced, &|u, v| j.or(u, v))
}

/// Arranges columns in the order in which a tape takes its variables.
fn arrange<T>(vars: &VarMap, columns: [T; 3]) -> Vec<T> {
    let mut list: Vec<(usize, T)> = [Var::X, Var::Y, Var::Z]
        .into_iter()
        .zip(columns)
        .filter_map(|(var, column)| Some((vars.get(&var)?, column)))
        .collect();
    list.sort_by_key(|(index, _)| *index);
    list.into_iter().map(|(_, column)| column).collect()
}

fn value_answer(w: f32) -> [f64; 4] {
    [f64::from(w), 0.0, 0.0, 0.0]
}

fn grad_answer(g: Grad) -> [f64; 4] {
    [g.v, g.dx, g.dy, g.dz].map(f64::from)
}

/// Evaluates ω at all points by Fidget's machine code, without the wrapper that copies the columns.
pub fn raw(shape: &JitShape) -> Work {
    let tape = shape.inner().float_slice_tape(Default::default());
    let mut eval = JitFunction::new_float_slice_eval();
    Box::new(move |points, keep| {
        let columns = arrange(tape.vars(), points.single.each_ref().map(|c| &c[..]));
        let out = eval.eval(&tape, &columns).expect("three columns of one length");
        if let Some(keep) = keep {
            keep.extend(out[0].iter().map(|&w| value_answer(w)));
        }
        black_box(&out[0]);
    })
}

/// Evaluates ω at all points in the way that Fidget's documentation recommends.
pub fn shape_api(shape: &JitShape) -> Work {
    let tape = shape.ez_float_slice_tape();
    let mut eval = JitShape::new_float_slice_eval();
    Box::new(move |points, keep| {
        let [x, y, z] = &points.single;
        let out = eval.eval(&tape, x, y, z).expect("three columns of one length");
        if let Some(keep) = keep {
            keep.extend(out.iter().map(|&w| value_answer(w)));
        }
        black_box(out);
    })
}

fn grad_columns(points: &Points) -> [Vec<Grad>; 3] {
    let unit = |axis: usize| [0, 1, 2].map(|i| if i == axis { 1.0 } else { 0.0 });
    std::array::from_fn(|axis| {
        let [dx, dy, dz] = unit(axis);
        points.single[axis].iter().map(|&c| Grad::new(c, dx, dy, dz)).collect()
    })
}

/// Evaluates ω and ∇ω at all points by Fidget's machine code. Columns with their derivatives are made
/// beforehand.
pub fn raw_grad(shape: &JitShape) -> Work {
    let tape = shape.inner().grad_slice_tape(Default::default());
    let mut eval = JitFunction::new_grad_slice_eval();
    let mut ready: Option<(usize, [Vec<Grad>; 3])> = None;
    Box::new(move |points, keep| {
        if ready.as_ref().is_none_or(|(id, _)| *id != points.id) {
            ready = Some((points.id, grad_columns(points)));
        }
        let (_, columns) = ready.as_ref().expect("just made");
        let columns = arrange(tape.vars(), columns.each_ref().map(|c| &c[..]));
        let out = eval.eval(&tape, &columns).expect("three columns of one length");
        if let Some(keep) = keep {
            keep.extend(out[0].iter().map(|&g| grad_answer(g)));
        }
        black_box(&out[0]);
    })
}

/// Evaluates ω at one point after the other.
pub fn point(shape: &JitShape) -> Work {
    let tape = shape.ez_point_tape();
    let mut eval = JitShape::new_point_eval();
    Box::new(move |points, mut keep| {
        let [x, y, z] = &points.single;
        for i in 0..x.len() {
            let (w, _) = eval.eval(&tape, x[i], y[i], z[i]).expect("no further variables");
            black_box(w);
            if let Some(keep) = keep.as_deref_mut() {
                keep.push(value_answer(w));
            }
        }
    })
}

/// Evaluates ω and ∇ω at one point after the other. Fidget has no gradient program for one point, so columns
/// have length 1.
pub fn point_grad(shape: &JitShape) -> Work {
    let tape = shape.ez_grad_slice_tape();
    let mut eval = JitShape::new_grad_slice_eval();
    Box::new(move |points, mut keep| {
        let [x, y, z] = &points.single;
        for i in 0..x.len() {
            let p = [
                Grad::new(x[i], 1.0, 0.0, 0.0),
                Grad::new(y[i], 0.0, 1.0, 0.0),
                Grad::new(z[i], 0.0, 0.0, 1.0),
            ];
            let out = eval.eval(&tape, &p[..1], &p[1..2], &p[2..]).expect("three columns of one length");
            black_box(out);
            if let Some(keep) = keep.as_deref_mut() {
                keep.push(grad_answer(out[0]));
            }
        }
    })
}

/// Returns the range over a box: lower and upper end.
pub fn range(shape: &JitShape) -> impl FnMut([[f64; 2]; 3]) -> [f64; 2] + 'static {
    let tape = shape.ez_interval_tape();
    let mut eval = JitShape::new_interval_eval();
    move |sides| {
        let [x, y, z] = sides.map(|[low, high]| Interval::new(low as f32, high as f32));
        let (range, _) = eval.eval(&tape, x, y, z).expect("no further variables");
        [f64::from(range.lower()), f64::from(range.upper())]
    }
}
